//! Coordinates of a map, and its rotation to Galactic ones through harmonic coefficients.

use super::header::Header;
use crate::error::Result;
use crate::kernels::healpix::Nside;
use crate::kernels::sht::alm;
use crate::kernels::simd::Level;
use crate::kernels::{Complex, Error as KernelError};
use crate::sht::{ShtPlan, rotate_alms};

/// Coordinates of a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Frame {
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

    pub(super) const fn name(self) -> &'static str {
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

    /// Band limit of the coefficients: healpy's 3 Nside − 1, but 2 Nside for large maps, where the matrices of the
    /// rotation would take gigabytes.
    const fn lmax(nside: usize) -> usize {
        if nside <= 512 {
            3 * nside - 1
        } else {
            2 * nside
        }
    }

    /// The map, or Q and U, in Galactic coordinates. No pixel may be missing.
    pub(super) fn rotate(
        self,
        nside: u32,
        maps: &mut [Vec<f64>],
    ) -> std::result::Result<(), KernelError> {
        let lmax = Self::lmax(nside as usize);
        let mut plan = ShtPlan::new(Nside::new(nside.into())?, lmax, Level::detect())?;
        let mut a = vec![Complex::new(0.0, 0.0); alm::len(lmax)];
        match maps {
            [q, u] => {
                let mut b = a.clone();
                plan.analysis_spin2_to_accuracy(q, u, &mut a, &mut b, TOLERANCE, ITERATIONS)?;
                rotate_alms(&mut [&mut a, &mut b], lmax, self.euler())?;
                plan.synthesis_spin2(&a, &b, q, u)
            }
            [map] => {
                plan.analysis_to_accuracy(map, &mut a, TOLERANCE, ITERATIONS)?;
                rotate_alms(&mut [&mut a], lmax, self.euler())?;
                plan.synthesis(&a, map)
            }
            _ => Ok(()),
        }
    }
}

/// Of the analysis; beyond 2 Nside a map does not fix its coefficients, and more iterations find noise.
const TOLERANCE: f64 = 1e-10;
const ITERATIONS: usize = 20;
