//! The observed maps at ν₀ on the working grid (\[MKD18\], section 3).
//!
//! Intensity and polarisation at ν₀ are multiplied by the colour correction; every map is taken to the working Nside;
//! where τ, T and β are not given they are fitted to the intensities ([`dust3d_kernels::fit::mbb`]).

use super::regrid;
use crate::Error;
use crate::config::{Config, Fit};
use crate::io::Inputs;
use crate::parallel;
use crate::stages::intensity::mean;
use dust3d_kernels::fit::mbb::{MbbFit, fit_into};
use dust3d_kernels::healpix::Nside;
use dust3d_kernels::healpix::missing::{MISSING, is_missing};
use dust3d_kernels::planck::spectrum::planck_scalar;
use dust3d_kernels::simd::Level;
use dust3d_kernels::units::NU0_GHZ;
use rayon::prelude::*;

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
    /// The least Nside of the I, Q, U inputs.
    pub stokes_nside: u64,
    /// The least Nside of the inputs that T and β come from.
    pub laws_nside: u64,
}

/// The intensities that τ, T and β are fitted to when they are not given.
pub const FITTED: [&str; 4] = ["I_353", "I_545", "I_857", "I_2998"];

/// Takes maps, some at a time, with their names: `I_353`, `tau`, `Q_217` …
pub type Show<'a> = dyn FnMut(&[(&str, &[f64])]) -> Result<(), Error> + 'a;

/// Brings `inputs` (checked, all needed ones there) to the grid `nside`; their maps are used up. The cube is left alone.
///
/// The maps that are made are shown to `show`: those for validation are not kept.
///
/// # Errors
/// If a map that is needed is absent, a fit is impossible, or `show` fails.
pub fn observe(
    inputs: &mut Inputs,
    config: &Config,
    nside: Nside,
    level: Level,
    show: &mut Show<'_>,
) -> Result<Observations, Error> {
    let least = |inputs: &Inputs, names: &[&str]| {
        let nsides = names.iter().filter_map(|n| inputs.maps.get(*n));
        nsides.map(|m| u64::from(m.nside)).min().unwrap_or(u64::MAX)
    };
    let given = ["tau", "T", "beta"]
        .iter()
        .all(|n| inputs.maps.contains_key(*n));
    let stokes_nside = least(inputs, &["I_353", "Q_353", "U_353"]);
    let laws_nside = least(inputs, if given { &["T", "beta"] } else { &FITTED });

    let mut grid = Grid {
        inputs,
        config,
        nside,
        level,
    };
    let i = grid.scalar("I_353")?;
    let (q, u) = grid.polarisation("353")?;
    show(&[("I_353", &i), ("Q_353", &q), ("U_353", &u)])?;
    let mut fitted = Vec::new();
    for nu in ["545", "857", "2998", "217", "143"] {
        let name = format!("I_{nu}");
        if grid.inputs.maps.contains_key(&name) {
            let map = grid.scalar(&name)?;
            show(&[(&name, &map)])?;
            if !given && FITTED.contains(&name.as_str()) {
                fitted.push(map);
            }
        }
        let (name_q, name_u) = (format!("Q_{nu}"), format!("U_{nu}"));
        if grid.inputs.maps.contains_key(&name_q) && grid.inputs.maps.contains_key(&name_u) {
            let (q, u) = grid.polarisation(nu)?;
            show(&[(&name_q, &q), (&name_u, &u)])?;
        }
    }
    let (tau, t, beta) = if given {
        (grid.scalar("tau")?, grid.scalar("T")?, grid.scalar("beta")?)
    } else {
        if fitted.len() + 1 < FITTED.len() {
            return Err(Error::usage(
                "the inputs I_545, I_857 and I_2998 are needed to fit τ, T and β; give them in [inputs]",
            ));
        }
        let mut maps: Vec<&[f64]> = vec![&i];
        maps.extend(fitted.iter().map(Vec::as_slice));
        fit_laws(&maps, &config.fit, level)?
    };
    show(&[("tau", &tau), ("T", &t), ("beta", &beta)])?;
    Ok(Observations {
        i,
        q,
        u,
        tau,
        t,
        beta,
        stokes_nside,
        laws_nside,
    })
}

/// Takes inputs to the working grid.
struct Grid<'a> {
    inputs: &'a mut Inputs,
    config: &'a Config,
    nside: Nside,
    level: Level,
}

impl Grid<'_> {
    fn take(&mut self, name: &str) -> Result<(Nside, Vec<f64>), Error> {
        let map = self.inputs.maps.get_mut(name).ok_or_else(|| {
            Error::usage(format!("the input `{name}` is needed; give it in [inputs]"))
        })?;
        let values = std::mem::take(&mut map.values);
        Ok((Nside::new(map.nside.into())?, values))
    }

    fn scalar(&mut self, name: &str) -> Result<Vec<f64>, Error> {
        let (from, values) = self.take(name)?;
        let mut out = regrid::scalar_owned(values, from, self.nside, self.level)?;
        scale(&mut out, colour(name, self.config));
        Ok(out)
    }

    fn polarisation(&mut self, nu: &str) -> Result<(Vec<f64>, Vec<f64>), Error> {
        let (name_q, name_u) = (format!("Q_{nu}"), format!("U_{nu}"));
        let (from, q) = self.take(&name_q)?;
        let (from_u, u) = self.take(&name_u)?;
        if from != from_u {
            return Err(Error::input(format!(
                "`{name_q}` has Nside {} and `{name_u}` Nside {}; give both on one grid",
                from.get(),
                from_u.get()
            )));
        }
        let (mut q, mut u) = regrid::polarisation(q, u, from, self.nside, self.level)?;
        for map in [&mut q, &mut u] {
            scale(map, colour(&name_q, self.config));
        }
        Ok((q, u))
    }
}

/// Multiplies what is not missing.
fn scale(map: &mut [f64], factor: f64) {
    if factor != 1.0 {
        map.par_iter_mut()
            .filter(|x| !is_missing(**x))
            .for_each(|x| *x *= factor);
    }
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
