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
use super::observations::Show;
use super::{field, mirror, regrid};
use crate::Error;
use crate::io::inputs::modulus_label;
use crate::io::{InputMap, Inputs};
use crate::parallel::{self, CHUNK};
use crate::random::{Stage, white_alm};
use crate::sht::ShtPlan;
use crate::store::{MEMORY_PIXELS, slabs};
use dust3d_kernels::field::column::columns_into;
use dust3d_kernels::field::{Density, Model, Spiral};
use dust3d_kernels::healpix::missing::MISSING;
use dust3d_kernels::healpix::{Nside, ring};
use dust3d_kernels::planck::spectrum::planck_scalar;
use dust3d_kernels::simd::Level;
use dust3d_kernels::spectra::{beam, log_normal_into, scale_by_l};
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

/// Frequencies of the maps for validation: name, GHz, whether there is Q and U.
const OTHERS: [(&str, f64, bool); 5] = [
    ("143", 143.0, true),
    ("217", 217.0, true),
    ("545", 545.0, false),
    ("857", 857.0, false),
    ("2998", NU_100UM_GHZ, false),
];

/// Makes the built-in sky on the grid of `plan` from a seed, without the maps that serve validation alone.
///
/// # Errors
/// Those of the kernels; none for a valid plan.
pub fn observe(plan: &mut ShtPlan, seed: u64, level: Level) -> Result<Inputs, Error> {
    let nside = plan.nside();
    let Reddening { mut edges, cube } = reddening(plan, seed, level)?;
    let cube_nside = Nside::new(nside.get().min(CUBE_NSIDE))?;
    let scale = MEDIAN_REDDENING / high_latitude_median(&cube[BINS - 1], cube_nside)?;
    let cube = footprint(cube, cube_nside, scale)?;

    let (q_fraction, u_fraction) = polarisation(plan, seed, &edges, level)?;
    let mut tau = edges.pop().unwrap_or_default();
    drop(edges);
    tau.par_iter_mut()
        .for_each(|x| *x *= scale / REDDENING_PER_TAU);
    let (t, beta) = laws(plan, seed)?;
    let i = parallel::map(tau.len(), |range, out| {
        for ((i, tau), &t) in out.iter_mut().zip(&tau[range.clone()]).zip(&t[range]) {
            *i = tau * planck_scalar(NU0_GHZ, t);
        }
    });
    let (q, u) = (product(q_fraction, &i), product(u_fraction, &i));

    let mut maps = BTreeMap::new();
    for (name, unit, values) in [
        ("I_353", "MJy/sr", i),
        ("Q_353", "MJy/sr", q),
        ("U_353", "MJy/sr", u),
        ("tau", "", tau),
        ("T", "K", t),
        ("beta", "", beta),
    ] {
        let map = InputMap::generated(name, unit, nside.get() as u32, values);
        maps.insert(name.to_owned(), map);
    }
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

/// Shows the maps for validation that go with [`observe`]'s, one after the other: `I_143`, `Q_143` …, MJy/sr.
///
/// # Errors
/// If a map of `sky` is absent, or `show` fails.
pub fn others(sky: &Inputs, level: Level, show: &mut Show<'_>) -> Result<(), Error> {
    let get = |name: &str| -> Result<&[f64], Error> {
        let map = sky
            .get(name)
            .ok_or_else(|| Error::input(format!("the sky has no {name}")))?;
        Ok(&map.values)
    };
    let layer = Layer {
        stokes: [get("I_353")?, get("Q_353")?, get("U_353")?],
        law: Law::Maps {
            t: get("T")?,
            beta: get("beta")?,
        },
    };
    for (name, nu, polarised) in OTHERS {
        let bands = [emission::monochromatic(nu)?];
        let mut out = [emission::Stokes::default()];
        let npix = layer.stokes[0].len();
        emission::layers_into(level, &bands, &[layer], npix, &mut out)?;
        let [[i, q, u]] = &out;
        let [name_i, name_q, name_u] = ["I", "Q", "U"].map(|stokes| format!("{stokes}_{name}"));
        let maps: [(&str, &[f64]); 3] = [(&name_i, i), (&name_q, q), (&name_u, u)];
        show(if polarised { &maps } else { &maps[..1] })?;
    }
    Ok(())
}

fn product(mut x: Vec<f64>, y: &[f64]) -> Vec<f64> {
    x.par_iter_mut().zip(y).for_each(|(x, y)| *x *= y);
    x
}

/// Cumulative reddening, up to a common factor.
struct Reddening {
    /// Up to each of [`FIELD_EDGES`], on the working grid.
    edges: Vec<Vec<f64>>,
    /// Up to the end of each bin, on the cube's grid.
    cube: Vec<Vec<f64>>,
}

/// Adds up the fluctuating shells, bin by bin: only what is needed later is kept of the [`BINS`] cumulative maps.
///
/// Every bin's share [`BIN_FLOOR`] of the total is known at the end only, and added then.
fn reddening(plan: &mut ShtPlan, seed: u64, level: Level) -> Result<Reddening, Error> {
    let nside = plan.nside();
    let npix = nside.npix() as usize;
    let cube_nside = Nside::new(nside.get().min(CUBE_NSIDE))?;
    let [mut sum, mut g, mut column] = [(); 3].map(|()| vec![0.0; npix]);
    let (mut edges, mut cube) = (Vec::new(), Vec::new());
    let mut near = 0.0;
    for bin in 0..BINS {
        let far = distance_kpc(modulus(bin));
        let alm = red_alm(seed, bin, 0, plan.lmax(), -2.6, 0.0)?;
        plan.synthesis(&alm, &mut g)?;
        drop(alm);
        let (mean, std) = super::laws::sky::mean_std(&g);
        let amplitude = if std > 0.0 { 0.5 / std } else { 0.0 };
        let shift = 0.125 + amplitude * mean;
        columns(nside, [near, far], level, &mut column)?;
        sum.par_chunks_mut(CHUNK)
            .zip(g.par_chunks(CHUNK).zip(column.par_chunks(CHUNK)))
            .try_for_each_init(Vec::new, |shell, (sum, (g, column))| {
                shell.resize(g.len(), 0.0);
                log_normal_into(level, column, g, amplitude, shift, shell)?;
                for (sum, shell) in sum.iter_mut().zip(&*shell) {
                    *sum += shell;
                }
                Ok::<_, Error>(())
            })?;
        cube.push(regrid::scalar(&sum, nside, cube_nside, level)?);
        if FIELD_EDGES.contains(&modulus(bin)) && bin + 1 < BINS {
            edges.push(sum.clone());
        }
        near = far;
    }
    drop((g, column));
    let totals = cube.last().cloned().unwrap_or_default();
    for (bin, map) in cube.iter_mut().enumerate() {
        add_floor(map, &totals, bin);
    }
    for (map, edge) in edges.iter_mut().zip(FIELD_EDGES) {
        add_floor(map, &sum, (2.0 * (edge - 4.0)) as usize);
    }
    let floor = 1.0 + BIN_FLOOR * BINS as f64;
    sum.par_iter_mut().for_each(|x| *x *= floor);
    edges.push(sum);
    Ok(Reddening { edges, cube })
}

/// Column density between two distances (kpc), the same on both sides of the Galactic plane.
fn columns(nside: Nside, bounds_kpc: [f64; 2], level: Level, out: &mut [f64]) -> Result<(), Error> {
    let (sun, density) = (Spiral::default().r_sun_kpc, Density::default());
    let (north, south) = out.split_at_mut(mirror::north_len(nside));
    north
        .par_chunks_mut(CHUNK)
        .enumerate()
        .try_for_each(|(k, out)| {
            let first = k * CHUNK;
            let directions = field::directions(nside, first..first + out.len(), level)?;
            let maps = &mut [out];
            Ok::<_, Error>(columns_into(
                level,
                &density,
                sun,
                &bounds_kpc,
                &directions,
                maps,
            )?)
        })?;
    mirror::reflect(nside, north, north.len(), south)
}

/// What the bins up to `bin` get of the total.
fn add_floor(map: &mut [f64], total: &[f64], bin: usize) {
    let share = BIN_FLOOR * (bin + 1) as f64;
    map.par_iter_mut()
        .zip(total)
        .for_each(|(x, total)| *x += share * total);
}

/// The cube, scaled, as far as its footprint reaches.
fn footprint(mut cube: Vec<Vec<f64>>, nside: Nside, scale: f64) -> Result<Vec<Vec<f64>>, Error> {
    for p in 0..nside.npix() {
        let inside = declination_deg(ring::pix2vec(nside, p)?) > LEAST_DECLINATION;
        for map in &mut cube {
            let x = &mut map[p as usize];
            *x = if inside { *x * scale } else { MISSING };
        }
    }
    Ok(cube)
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
    t.par_iter_mut().for_each(|t| *t += 19.4);
    beta.par_iter_mut().for_each(|b| *b += 1.60);
    Ok((t, beta))
}

/// Polarisation fractions Q/I and U/I: the spiral field's, weighted with the reddening between the `edges`, plus random
/// ones.
fn polarisation(
    plan: &mut ShtPlan,
    seed: u64,
    edges: &[Vec<f64>],
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
    drop((e, b));
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
    let distances: Vec<f64> = FIELD_EDGES.iter().map(|&mu| distance_kpc(mu)).collect();
    let keep_north = npix <= MEMORY_PIXELS;
    let mut ratios = field::Ratios::new(&model, &distances, nside, level, keep_north);
    for slab in slabs(npix) {
        let (q_field, u_field) = ratios.next(slab.len())?;
        let parts = [
            (&mut q[slab.clone()], q_field),
            (&mut u[slab.clone()], u_field),
        ];
        for (map, ratios) in parts {
            map.par_chunks_mut(CHUNK).enumerate().for_each(|(c, map)| {
                for (k, x) in map.iter_mut().enumerate() {
                    let here = c * CHUNK + k;
                    let p = slab.start + here;
                    let total = edges[edges.len() - 1][p];
                    let mut nearer = 0.0;
                    *x *= scale;
                    for (edge, ratio) in edges.iter().zip(&ratios) {
                        *x += (edge[p] - nearer) / total * ratio[here];
                        nearer = edge[p];
                    }
                }
            });
        }
    }
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
