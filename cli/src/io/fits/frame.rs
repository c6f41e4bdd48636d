//! Coordinates of a map, and its rotation to Galactic ones through harmonic coefficients.

use super::header::Header;
use crate::error::Result;
use crate::kernels::healpix::Nside;
use crate::kernels::sht::alm;
use crate::kernels::simd::Level;
use crate::kernels::{Complex, Error as KernelError};
use crate::sht::{Analysis, ShtPlan, rotate_alms};

/// Coordinates of a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Frame {
    /// Galactic.
    #[default]
    Galactic,
    /// Equatorial, J2000.
    Equatorial,
    /// Mean ecliptic, J2000.
    Ecliptic,
}

impl Frame {
    /// COORDSYS, or SKYCOORD of some archives, of the HDU or else of the primary header.
    pub(super) fn of(header: &Header, primary: &Header, notes: &mut Vec<String>) -> Result<Self> {
        let mut stated = None;
        for key in ["COORDSYS", "SKYCOORD"] {
            for header in [header, primary] {
                if stated.is_none() {
                    let text = header.text(key)?.filter(|text| !text.is_empty());
                    stated = text.map(|text| (key, text));
                }
            }
        }
        let Some((key, text)) = stated else {
            notes.push(format!(
                "{}: no COORDSYS, Galactic coordinates are assumed",
                header.place
            ));
            return Ok(Self::Galactic);
        };
        match text.to_ascii_uppercase().as_str() {
            "G" | "GAL" | "GALACTIC" => Ok(Self::Galactic),
            "C" | "Q" | "CELESTIAL" | "CEL" | "EQUATORIAL" | "EQU" | "ICRS" | "FK5" | "J2000" => {
                Ok(Self::Equatorial)
            }
            "E" | "ECL" | "ECLIPTIC" => Ok(Self::Ecliptic),
            _ => header.place.refuse(
                key,
                format_args!("'{text}' names no coordinates; write G (Galactic), C (equatorial) or E (ecliptic)"),
            ),
        }
    }

    /// The frame that HEALPix calls `G`, `C` or `E`.
    #[must_use]
    pub fn by_name(letter: &str) -> Option<Self> {
        [Self::Galactic, Self::Equatorial, Self::Ecliptic]
            .into_iter()
            .find(|frame| frame.letter() == letter)
    }

    /// COORDSYS: `G`, `C` or `E`.
    #[must_use]
    pub const fn letter(self) -> &'static str {
        match self {
            Self::Galactic => "G",
            Self::Equatorial => "C",
            Self::Ecliptic => "E",
        }
    }

    /// `Galactic`, `equatorial` or `ecliptic`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Galactic => "Galactic",
            Self::Equatorial => "equatorial",
            Self::Ecliptic => "ecliptic",
        }
    }

    /// Angles α, β, γ of R_z(α) R_y(β) R_z(γ), which takes directions in this frame to Galactic ones: the longitude of
    /// this frame's pole, the distance of the two poles, and 180° less the longitude of the Galactic pole in this frame.
    const fn euler(self) -> [f64; 3] {
        let [alpha, beta, pole]: [f64; 3] = match self {
            Self::Galactic => [0.0, 0.0, 180.0],
            // FK5 J2000, from the definition in B1950, as astropy and healpy have it.
            Self::Equatorial => [
                122.931_918_568_002_6,
                62.871_748_819_143_77,
                192.859_481_206_534_8,
            ],
            Self::Ecliptic => [
                96.383_988_719_657_13,
                60.188_554_310_130_84,
                180.023_221_323_238_52,
            ],
        };
        [
            alpha.to_radians(),
            beta.to_radians(),
            (180.0 - pole).to_radians(),
        ]
    }

    /// Angles α, β, γ of R_z(α) R_y(β) R_z(γ), which takes Galactic directions to this frame, as [`rotate_alms`] wants them.
    #[must_use]
    pub fn from_galactic(self) -> [f64; 3] {
        let [alpha, beta, gamma] = self.euler();
        [-gamma, -beta, -alpha]
    }

    /// The map, or Q and U, in Galactic coordinates. No pixel may be missing.
    ///
    /// Up to lmax = 2 Nside the pixels fix the coefficients, which are found by least squares: a map without power beyond
    /// comes out exact to about 1e-9. What they leave of another map is turned by itself, up to 3 Nside − 1 as healpy does,
    /// where coefficients are only about right; above Nside 512 it is left out, as the matrices would take gigabytes.
    pub(super) fn rotate(
        self,
        nside: u32,
        maps: &mut [Vec<f64>],
    ) -> std::result::Result<(), KernelError> {
        let largest = |maps: &[Vec<f64>]| {
            let sizes = maps.iter().flatten().map(|value| value.abs());
            sizes.fold(0.0, f64::max)
        };
        let before = largest(maps);
        let wide = 2 * nside as usize;
        let mut rest = maps.to_vec();
        turn(
            nside,
            wide,
            Fit::LeastSquares,
            self.euler(),
            maps,
            Some(&mut rest),
        )?;
        if nside <= 512 && largest(&rest) > 1e-8 * before {
            let wider = 3 * nside as usize - 1;
            turn(nside, wider, Fit::Quadrature, self.euler(), &mut rest, None)?;
            for (map, rest) in maps.iter_mut().zip(&rest) {
                map.iter_mut()
                    .zip(rest)
                    .for_each(|(map, rest)| *map += rest);
            }
        }
        Ok(())
    }
}

/// How coefficients are found.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Fit {
    LeastSquares,
    Quadrature,
}

/// Puts the turned map, or Q and U, in the place of `maps`, and what its coefficients do not describe in `rest`.
fn turn(
    nside: u32,
    lmax: usize,
    fit: Fit,
    euler: [f64; 3],
    maps: &mut [Vec<f64>],
    rest: Option<&mut [Vec<f64>]>,
) -> std::result::Result<(), KernelError> {
    // Convergence at 2 Nside takes some ten iterations.
    let (tolerance, most) = (1e-12, 40);
    let mut plan = ShtPlan::new(Nside::new(nside.into())?, lmax, Level::detect())?;
    let mut a = vec![Complex::new(0.0, 0.0); alm::len(lmax)];
    let mut b = a.clone();
    match (&mut *maps, fit) {
        ([q, u], Fit::LeastSquares) => {
            plan.analysis_spin2_to_accuracy(q, u, &mut a, &mut b, tolerance, most)?;
        }
        ([q, u], Fit::Quadrature) => {
            plan.analysis_spin2(q, u, &mut a, &mut b, &Analysis::default())?;
        }
        ([map], Fit::LeastSquares) => {
            plan.analysis_to_accuracy(map, &mut a, tolerance, most)?;
        }
        ([map], Fit::Quadrature) => plan.analysis(map, &mut a, &Analysis::default())?,
        _ => return Ok(()),
    }
    if let Some(rest) = rest {
        synthesis(&mut plan, &a, &b, maps)?;
        for (rest, described) in rest.iter_mut().zip(&*maps) {
            rest.iter_mut()
                .zip(described)
                .for_each(|(rest, described)| *rest -= described);
        }
    }
    rotate_alms(&mut [&mut a, &mut b], lmax, euler)?;
    synthesis(&mut plan, &a, &b, maps)
}

/// A map, or Q and U.
fn synthesis(
    plan: &mut ShtPlan,
    a: &[Complex<f64>],
    b: &[Complex<f64>],
    maps: &mut [Vec<f64>],
) -> std::result::Result<(), KernelError> {
    match maps {
        [q, u] => plan.synthesis_spin2(a, b, q, u),
        [map] => plan.synthesis(a, map),
        _ => Ok(()),
    }
}
