//! The observed maps at ν₀ on the working grid (\[MKD18\], section 3).
//!
//! Intensity and polarisation at ν₀ are multiplied by the colour correction; every map is taken to the working Nside;
//! where τ, T and β are not given they are fitted to the intensities ([`dust3d_kernels::fit::mbb`]).

use super::regrid;
use crate::Error;
use crate::config::{Config, Fit};
use crate::io::{InputMap, Inputs};
use crate::parallel;
use crate::stages::intensity::mean;
use dust3d_kernels::fit::mbb::{MbbFit, fit_into};
use dust3d_kernels::healpix::Nside;
use dust3d_kernels::healpix::missing::{MISSING, is_missing};
use dust3d_kernels::planck::spectrum::planck_scalar;
use dust3d_kernels::simd::Level;
use dust3d_kernels::units::NU0_GHZ;
use std::collections::BTreeMap;

/// What the run works from.
#[derive(Debug, Clone)]
pub struct Observations {
    /// Intensity at ν₀, MJy/sr.
    pub i: Vec<f64>,
    /// Stokes Q at ν₀, MJy/sr.
    pub q: Vec<f64>,
    /// Stokes U at ν₀, MJy/sr.
    pub u: Vec<f64>,
    /// Optical depth at ν₀.
    pub tau: Vec<f64>,
    /// Dust temperature, kelvin; may have missing pixels.
    pub t: Vec<f64>,
    /// Spectral index; may have missing pixels.
    pub beta: Vec<f64>,
    /// Other maps, by name (`I_545`, `Q_217` …), MJy/sr: of use for validation.
    pub others: BTreeMap<String, Vec<f64>>,
    /// The least Nside of the I, Q, U inputs.
    pub stokes_nside: u64,
    /// The least Nside of the inputs that T and β come from.
    pub laws_nside: u64,
}

/// The intensities that τ, T and β are fitted to when they are not given.
pub const FITTED: [&str; 4] = ["I_353", "I_545", "I_857", "I_2998"];

/// Brings `inputs` (checked, all needed ones there) to the grid `nside`.
///
/// # Errors
/// If a map that is needed is absent, or a fit is impossible.
pub fn observe(
    inputs: &Inputs,
    config: &Config,
    nside: Nside,
    level: Level,
) -> Result<Observations, Error> {
    let get = |name: &str| {
        inputs.maps.get(name).ok_or_else(|| {
            Error::usage(format!("the input `{name}` is needed; give it in [inputs]"))
        })
    };
    let scalar = |map: &InputMap| -> Result<Vec<f64>, Error> {
        let from = Nside::new(map.nside.into())?;
        let factor = colour(&map.name, config);
        let mut out = regrid::scalar(&map.values, from, nside, level)?;
        if factor != 1.0 {
            out.iter_mut()
                .filter(|x| !is_missing(**x))
                .for_each(|x| *x *= factor);
        }
        Ok(out)
    };
    let polarisation = |nu: &str| -> Result<(Vec<f64>, Vec<f64>), Error> {
        let (q, u) = (get(&format!("Q_{nu}"))?, get(&format!("U_{nu}"))?);
        if q.nside != u.nside {
            return Err(Error::input(format!(
                "`Q_{nu}` has Nside {} and `U_{nu}` Nside {}; give both on one grid",
                q.nside, u.nside
            )));
        }
        let from = Nside::new(q.nside.into())?;
        let factor = colour(&q.name, config);
        let (mut q, mut u) = regrid::polarisation(&q.values, &u.values, from, nside, level)?;
        if factor != 1.0 {
            q.iter_mut().chain(&mut u).for_each(|x| *x *= factor);
        }
        Ok((q, u))
    };

    let i = scalar(get("I_353")?)?;
    let (q, u) = polarisation("353")?;
    let mut others = BTreeMap::new();
    for nu in ["545", "857", "2998", "217", "143"] {
        let name = format!("I_{nu}");
        if let Some(map) = inputs.maps.get(&name) {
            others.insert(name, scalar(map)?);
        }
        let (name_q, name_u) = (format!("Q_{nu}"), format!("U_{nu}"));
        if inputs.maps.contains_key(&name_q) && inputs.maps.contains_key(&name_u) {
            let (q, u) = polarisation(nu)?;
            others.insert(name_q, q);
            others.insert(name_u, u);
        }
    }

    let least = |names: &[&str]| -> Result<u64, Error> {
        let mut least = u64::MAX;
        for name in names {
            least = least.min(get(name)?.nside.into());
        }
        Ok(least)
    };
    let given = ["tau", "T", "beta"]
        .iter()
        .all(|n| inputs.maps.contains_key(*n));
    let (tau, t, beta, laws_nside) = if given {
        let map = |name| scalar(get(name)?);
        (map("tau")?, map("T")?, map("beta")?, least(&["T", "beta"])?)
    } else {
        let maps: Vec<&[f64]> = FITTED
            .iter()
            .map(|&name| match name {
                "I_353" => Ok(i.as_slice()),
                _ => others.get(name).map(Vec::as_slice).ok_or_else(|| {
                    Error::usage(format!("the input `{name}` is needed to fit τ, T and β"))
                }),
            })
            .collect::<Result<_, _>>()?;
        let (tau, t, beta) = fit_laws(&maps, &config.fit, level)?;
        (tau, t, beta, least(&FITTED)?)
    };
    Ok(Observations {
        stokes_nside: least(&["I_353", "Q_353", "U_353"])?,
        laws_nside,
        i,
        q,
        u,
        tau,
        t,
        beta,
        others,
    })
}

/// The colour correction of a map: it holds for I, Q and U at ν₀.
fn colour(name: &str, config: &Config) -> f64 {
    match name {
        "I_353" | "Q_353" | "U_353" => config.inputs.color_correction,
        _ => 1.0,
    }
}

/// τ, T and β from intensities. Where a pixel has no fit, T and β are missing, and τ is what gives its intensity at ν₀ at
/// the mean temperature.
fn fit_laws(
    maps: &[&[f64]],
    config: &Fit,
    level: Level,
) -> Result<(Vec<f64>, Vec<f64>, Vec<f64>), Error> {
    let fit = MbbFit::new(&config.nu_ghz, &config.sigma)?;
    let npix = maps.first().map_or(0, |m| m.len());
    let mut laws = vec![vec![0.0; npix]; 3];
    let results = parallel::for_columns(&mut laws, |range, mut laws| -> Result<(), Error> {
        let pieces: Vec<&[f64]> = maps.iter().map(|m| &m[range.clone()]).collect();
        if let [tau, t, beta] = laws.as_mut_slice() {
            fit_into(level, &fit, &pieces, tau, t, beta, None)?;
        }
        for x in laws.iter_mut().flat_map(|l| l.iter_mut()) {
            if x.is_nan() {
                *x = MISSING;
            }
        }
        Ok(())
    });
    results.into_iter().collect::<Result<(), _>>()?;
    let beta = laws.pop().unwrap_or_default();
    let t = laws.pop().unwrap_or_default();
    let mut tau = laws.pop().unwrap_or_default();
    let mean_t = mean(&t);
    if !mean_t.is_finite() {
        return Err(Error::input(
            "no pixel of I_353, I_545, I_857 and I_2998 can be fitted by a modified blackbody; check their units (MJy/sr)",
        ));
    }
    let brightness = planck_scalar(NU0_GHZ, mean_t);
    for (tau, i) in tau.iter_mut().zip(maps[0]) {
        if *tau == MISSING {
            *tau = i / brightness;
        }
    }
    Ok((tau, t, beta))
}
