//! The built-in sky: plausible observations made from nothing, so that the program runs on a machine without data.
//!
//! **Synthetic.** Nothing here is measured:
//!
//! * reddening: the column density of the galactic disc in each distance bin, times log-normal fluctuations (angular
//!   spectrum l^−2.6, rms of the logarithm 0.5), normalised to a median total E(B−V) of 0.05 mag at |b| > 30°; the cube is
//!   masked south of declination −30°, as the survey of \[MKD18\] is; τ(ν₀) = E(B−V)/1.49e4,
//! * T = 19.4 ± 1.25 K and β = 1.60 ± 0.13, Gaussian, spectra ∝ l^−2.6, correlation −0.5; I = τ B_ν₀(T),
//! * polarisation fractions: those of the spiral field at pitch −33°, plus a Gaussian random field (C_EE ∝ l^−2.42,
//!   C_BB = C_EE/2, 1° beam, rms 5 %),
//! * maps at 143, 217, 545, 857 GHz and 100 µm by the same T and β.
//!
//! It is one provider of observations like files are; the pipeline sees no difference.

use super::emission::{self, Law, Layer};
use super::{field, regrid};
use crate::Error;
use crate::io::inputs::modulus_label;
use crate::io::{InputMap, Inputs};
use crate::parallel;
use crate::random::{Stage, white_alm};
use crate::sht::ShtPlan;
use dust3d_kernels::field::column::columns_into;
use dust3d_kernels::field::{Density, Model, Spiral};
use dust3d_kernels::healpix::missing::MISSING;
use dust3d_kernels::healpix::{Nside, ring};
use dust3d_kernels::planck::spectrum::planck_scalar;
use dust3d_kernels::simd::Level;
use dust3d_kernels::spectra::{beam, scale_by_l};
use dust3d_kernels::units::{NU_100UM_GHZ, NU0_GHZ};
use num_complex::Complex;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Distance moduli of the cube's bins: 4, 4.5 … 19.
const BINS: usize = 31;
/// Finest grid of the cube.
const CUBE_NSIDE: u64 = 64;
/// Every bin holds at least this share of a line of sight's reddening, or the distant ones would be lost to rounding at
/// high latitude.
const BIN_FLOOR: f64 = 1e-6;
/// Median total reddening at |b| > 30°, mag.
const MEDIAN_REDDENING: f64 = 0.05;
/// E(B−V) over τ(353 GHz).
const REDDENING_PER_TAU: f64 = 1.49e4;
/// Southern limit of the cube's footprint, degrees.
const LEAST_DECLINATION: f64 = -30.0;
/// Pitch angle of the field, degrees.
const PITCH_DEG: f64 = -33.0;
/// Moduli between which the field's polarisation is integrated.
const FIELD_EDGES: [f64; 6] = [4.0, 7.0, 10.0, 13.0, 16.0, 19.0];

/// The distance modulus of bin k.
fn modulus(bin: usize) -> f64 {
    4.0 + 0.5 * bin as f64
}

/// d = 10^(μ/5+1) pc, in kpc.
#[must_use]
pub fn distance_kpc(modulus: f64) -> f64 {
    10_f64.powf(modulus / 5.0 - 2.0)
}

/// Makes the built-in sky on the grid of `plan` from a seed.
///
/// # Errors
/// Those of the kernels; none for a valid plan.
pub fn observe(plan: &mut ShtPlan, seed: u64, level: Level) -> Result<Inputs, Error> {
    let nside = plan.nside();
    let mut shells = shells(plan, seed, level)?;
    for k in 1..BINS {
        let (nearer, this) = shells.split_at_mut(k);
        accumulate(&nearer[k - 1], &mut this[0]);
    }
    let mut cumulative = shells;

    let cube_nside = Nside::new(nside.get().min(CUBE_NSIDE))?;
    let mut cube = cumulative
        .iter()
        .map(|map| regrid::scalar(map, nside, cube_nside, level))
        .collect::<Result<Vec<_>, _>>()?;
    let footprint = (0..cube_nside.npix())
        .map(|p| Ok(declination_deg(ring::pix2vec(cube_nside, p)?) > LEAST_DECLINATION))
        .collect::<Result<Vec<bool>, Error>>()?;
    let scale = MEDIAN_REDDENING / high_latitude_median(&cube[BINS - 1], cube_nside)?;
    for map in &mut cube {
        for (x, &inside) in map.iter_mut().zip(&footprint) {
            if !inside {
                *x = MISSING;
            }
        }
    }
    for x in cube.iter_mut().flatten().filter(|x| **x != MISSING) {
        *x *= scale;
    }
    cumulative
        .par_iter_mut()
        .flatten()
        .for_each(|x| *x *= scale);

    let tau: Vec<f64> = cumulative[BINS - 1]
        .iter()
        .map(|ebv| ebv / REDDENING_PER_TAU)
        .collect();
    let (t, beta) = laws(plan, seed)?;
    let i: Vec<f64> = tau
        .iter()
        .zip(&t)
        .map(|(tau, &t)| tau * planck_scalar(NU0_GHZ, t))
        .collect();
    let (q_fraction, u_fraction) = polarisation(plan, seed, &cumulative, level)?;
    drop(cumulative);
    let (q, u) = (product(&q_fraction, &i), product(&u_fraction, &i));

    let mut maps = BTreeMap::new();
    let mut put = |name: &str, unit: &str, values: Vec<f64>| {
        maps.insert(
            name.to_owned(),
            InputMap::generated(name, unit, nside.get() as u32, values),
        );
    };
    let names = ["143", "217", "545", "857", "2998"];
    let bands = [143.0, 217.0, 545.0, 857.0, NU_100UM_GHZ]
        .into_iter()
        .map(emission::monochromatic)
        .collect::<Result<Vec<_>, _>>()?;
    let mut others: Vec<emission::Stokes> = (0..names.len())
        .map(|_| std::array::from_fn(|_| vec![0.0; i.len()]))
        .collect();
    let layer = Layer {
        stokes: [&i, &q, &u],
        law: Law::Maps { t: &t, beta: &beta },
    };
    emission::add_layer(level, &bands, &layer, &mut others)?;
    for (nu, [i, q, u]) in names.into_iter().zip(others) {
        put(&format!("I_{nu}"), "MJy/sr", i);
        if matches!(nu, "143" | "217") {
            put(&format!("Q_{nu}"), "MJy/sr", q);
            put(&format!("U_{nu}"), "MJy/sr", u);
        }
    }
    put("I_353", "MJy/sr", i);
    put("Q_353", "MJy/sr", q);
    put("U_353", "MJy/sr", u);
    put("tau", "", tau);
    put("T", "K", t);
    put("beta", "", beta);
    let cube = cube
        .into_iter()
        .enumerate()
        .map(|(bin, values)| {
            let mu = modulus(bin);
            let name = format!("ebv_{}", modulus_label(mu));
            let map = InputMap::generated(name, "mag", cube_nside.get() as u32, values);
            (mu, map)
        })
        .collect();
    Ok(Inputs { maps, cube })
}

fn product(x: &[f64], y: &[f64]) -> Vec<f64> {
    x.iter().zip(y).map(|(x, y)| x * y).collect()
}

/// `this` += `nearer`.
fn accumulate(nearer: &[f64], this: &mut [f64]) {
    this.par_iter_mut().zip(nearer).for_each(|(t, n)| *t += n);
}

/// Reddening of each distance bin, up to a common factor.
fn shells(plan: &mut ShtPlan, seed: u64, level: Level) -> Result<Vec<Vec<f64>>, Error> {
    let nside = plan.nside();
    let npix = nside.npix() as usize;
    let mut edges = [0.0; BINS + 1];
    for (k, edge) in edges.iter_mut().skip(1).enumerate() {
        *edge = distance_kpc(modulus(k));
    }
    let mut shells = vec![vec![0.0; npix]; BINS];
    let density = Density::default();
    let results = parallel::for_columns(&mut shells, |range, mut shells| -> Result<(), Error> {
        let directions = field::directions(nside, range)?;
        let sun = Spiral::default().r_sun_kpc;
        columns_into(level, &density, sun, &edges, &directions, &mut shells)?;
        Ok(())
    });
    results.into_iter().collect::<Result<(), _>>()?;

    let mut g = vec![0.0; npix];
    for (bin, shell) in shells.iter_mut().enumerate() {
        let alm = red_alm(seed, bin, 0, plan.lmax(), -2.6, 0.0)?;
        plan.synthesis(&alm, &mut g)?;
        scale_to_std(&mut g, 0.5);
        shell
            .par_iter_mut()
            .zip(&g)
            .for_each(|(s, g)| *s *= (g - 0.125).exp());
    }
    parallel::for_columns(&mut shells, |range, mut shells| {
        for k in 0..range.len() {
            let total: f64 = shells.iter().map(|s| s[k]).sum();
            for shell in &mut shells {
                shell[k] += BIN_FLOOR * total;
            }
        }
    });
    Ok(shells)
}

/// Random a_lm with C_l ∝ l^slope for l ≥ 1, seen through a beam.
fn red_alm(
    seed: u64,
    layer: usize,
    field: u32,
    lmax: usize,
    slope: f64,
    beam_rad: f64,
) -> Result<Vec<Complex<f64>>, Error> {
    let mut alm = white_alm(seed, Stage::BuiltinSky, layer, field, lmax)?;
    let amplitude: Vec<f64> = (0..=lmax)
        .map(|l| match l {
            0 => 0.0,
            _ => (l as f64).powf(0.5 * slope) * beam(beam_rad, l),
        })
        .collect();
    scale_by_l(&mut alm, &amplitude)?;
    Ok(alm)
}

/// Shifts and scales a map to mean 0 and the given standard deviation.
fn scale_to_std(map: &mut [f64], std: f64) {
    let (mean, now) = super::laws::sky::mean_std(map);
    let scale = if now > 0.0 { std / now } else { 0.0 };
    map.par_iter_mut().for_each(|x| *x = (*x - mean) * scale);
}

/// Correlated temperature (kelvin) and spectral-index maps.
fn laws(plan: &mut ShtPlan, seed: u64) -> Result<(Vec<f64>, Vec<f64>), Error> {
    let lmax = plan.lmax();
    let t_alm = red_alm(seed, BINS, 0, lmax, -2.6, 0.0)?;
    let mut beta_alm = red_alm(seed, BINS, 1, lmax, -2.6, 0.0)?;
    for (b, t) in beta_alm.iter_mut().zip(&t_alm) {
        *b = *b * 0.75_f64.sqrt() - *t * 0.5;
    }
    let npix = plan.nside().npix() as usize;
    let (mut t, mut beta) = (vec![0.0; npix], vec![0.0; npix]);
    plan.synthesis(&t_alm, &mut t)?;
    plan.synthesis(&beta_alm, &mut beta)?;
    scale_to_std(&mut t, 1.25);
    scale_to_std(&mut beta, 0.13);
    t.iter_mut().for_each(|t| *t += 19.4);
    beta.iter_mut().for_each(|b| *b += 1.60);
    Ok((t, beta))
}

/// Polarisation fractions Q/I and U/I: the spiral field's plus random ones.
fn polarisation(
    plan: &mut ShtPlan,
    seed: u64,
    cumulative: &[Vec<f64>],
    level: Level,
) -> Result<(Vec<f64>, Vec<f64>), Error> {
    let lmax = plan.lmax();
    let nside = plan.nside();
    let beam_rad = 1_f64.to_radians();
    let e = red_alm(seed, BINS + 1, 0, lmax, -2.42, beam_rad)?;
    let mut b = red_alm(seed, BINS + 1, 1, lmax, -2.42, beam_rad)?;
    b.iter_mut()
        .for_each(|b| *b *= std::f64::consts::FRAC_1_SQRT_2);
    let npix = nside.npix() as usize;
    let (mut q, mut u) = (vec![0.0; npix], vec![0.0; npix]);
    plan.synthesis_spin2(&e, &b, &mut q, &mut u)?;
    let [square] = parallel::sums(npix, |r| {
        [q[r.clone()]
            .iter()
            .zip(&u[r])
            .map(|(q, u)| q * q + u * u)
            .sum()]
    });
    let scale = 0.05 / (square / npix as f64).sqrt();

    let spiral = Spiral {
        pitch_rad: PITCH_DEG.to_radians(),
        ..Spiral::default()
    };
    let model = Model {
        spiral,
        ..Model::default()
    };
    let edges: Vec<f64> = FIELD_EDGES.iter().map(|&mu| distance_kpc(mu)).collect();
    let (q_field, u_field) = field::ratios(&model, &edges, nside, level)?;
    let bins: Vec<usize> = FIELD_EDGES
        .iter()
        .map(|mu| (2.0 * (mu - 4.0)) as usize)
        .collect();
    let mut maps = [q, u];
    parallel::for_columns(&mut maps, |range, mut maps| {
        for (k, p) in range.enumerate() {
            let total = cumulative[BINS - 1][p];
            let mut nearer = 0.0;
            for map in maps.iter_mut() {
                map[k] *= scale;
            }
            for (layer, &bin) in bins.iter().enumerate() {
                let share = (cumulative[bin][p] - nearer) / total;
                nearer = cumulative[bin][p];
                maps[0][k] += share * q_field[layer][p];
                maps[1][k] += share * u_field[layer][p];
            }
        }
    });
    let [q, u] = maps;
    Ok((q, u))
}

/// Declination (J2000, degrees) of a galactic direction.
fn declination_deg([x, y, z]: [f64; 3]) -> f64 {
    // Third row of the galactic → equatorial rotation (Hipparcos catalogue, vol. 1, eq. 1.5.11).
    let sine = -0.483_834_991_775 * x + 0.746_982_244_497 * y + 0.455_983_776_175 * z;
    sine.clamp(-1.0, 1.0).asin().to_degrees()
}

/// Median of a map's pixels at |b| > 30°.
fn high_latitude_median(map: &[f64], nside: Nside) -> Result<f64, Error> {
    let mut values = Vec::new();
    for (p, &x) in map.iter().enumerate() {
        let [_, _, z] = ring::pix2vec(nside, p as u64)?;
        // Rings at exactly 30° are out, whatever the rounding.
        if z.abs() > 0.5 + 1e-9 {
            values.push(x);
        }
    }
    values.sort_unstable_by(f64::total_cmp);
    let n = values.len();
    if n == 0 {
        // Nside 1 has pixels at 0 and ±41.8°: never empty in practice, and the scale is then arbitrary.
        return Ok(MEDIAN_REDDENING);
    }
    Ok(0.5 * (values[(n - 1) / 2] + values[n / 2]))
}
