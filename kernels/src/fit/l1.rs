//! The objective of the pitch-angle fit, G(q) = Σ_p |Σ_i Q̃^i(q) − Q| + |Σ_i Ũ^i(q) − U| (\[MKD18\], section 4.2).
//!
//! Q̃^i = (Q_m/I_m)^i I^i, so per pixel the sum over layers is one sum over all quadrature nodes of all layers, with
//! weights I^i/I_m^i. The nodes do not depend on q: [`scan_add`] places them once per pixel and evaluates every
//! pitch angle on them.
//!
//! **Order of sums.** [`scan_add`] adds pixel after pixel. A caller with threads gives each chunk of [`CHUNK`] pixels
//! its own sums, and adds the chunks in order: the bits then do not depend on the number of threads.

use crate::Error;
use crate::dispatch;
use crate::field::line_of_sight::{self, check_edges, layer_nodes, nodes_in, ratios_scratch_len};
use crate::field::{Depolarisation, Model, Panels, Turn, polarise};
use crate::scalar::{abs, sin_cos};
use crate::simd::{Lanes, Level};

/// Pixels whose contributions are summed one after the other; callers with threads split the sky at its multiples.
pub const CHUNK: usize = 1024;

/// Σ_p |q_model − q_obs| + |u_model − u_obs| over one chunk, pixel after pixel; units of the maps.
///
/// # Errors
/// [`Error::Length`] unless all four slices are equally long.
pub fn objective(
    q_model: &[f64],
    u_model: &[f64],
    q_obs: &[f64],
    u_obs: &[f64],
) -> Result<f64, Error> {
    let n = q_model.len();
    Error::check_len("u_model", n, u_model.len())?;
    Error::check_len("q_obs", n, q_obs.len())?;
    Error::check_len("u_obs", n, u_obs.len())?;
    let model = q_model.iter().zip(u_model);
    let observed = q_obs.iter().zip(u_obs);
    Ok(model.zip(observed).fold(0.0, |sum, ((qm, um), (q, u))| {
        sum + (abs(qm - q) + abs(um - u))
    }))
}

/// Length of the scratch of [`scan_add`] for a number of pitch angles.
#[must_use]
pub const fn scan_scratch_len(n_pitch: usize) -> usize {
    ratios_scratch_len() + n_pitch * (2 + 16)
}

/// Adds the terms of G(q) of some pixels, for a list of pitch angles, to `sums`.
///
/// | argument | shape | unit | domain |
/// | --- | --- | --- | --- |
/// | `edges_kpc` | N + 1 | kpc | as in [`line_of_sight::ratios_into`] |
/// | `directions` | n_pix | any | vectors, as there |
/// | `intensity` | N slices of n_pix | MJy/sr | I^i |
/// | `q_obs`, `u_obs` | n_pix | MJy/sr | COSMO |
/// | `pitch_rad` | n_q | rad | any; the pitch angle in `model` is not used |
/// | `sums` | n_q | MJy/sr | added to |
/// | `scratch` | ≥ [`scan_scratch_len`]`(n_q)` | | contents ignored, left dirty |
///
/// A NaN in a pixel makes the sums NaN. The same pixels in the same order give the same bits at every AVX level.
///
/// # Accuracy
/// That of the ratios, times the intensity.
/// # Errors
/// [`Error::Length`] or [`Error::Domain`]; nothing has been written then.
pub fn scan_add(
    level: Level,
    model: &Model,
    edges_kpc: &[f64],
    directions: &[[f64; 3]],
    intensity: &[&[f64]],
    q_obs: &[f64],
    u_obs: &[f64],
    pitch_rad: &[f64],
    sums: &mut [f64],
    scratch: &mut [f64],
) -> Result<(), Error> {
    model.check()?;
    check_edges(edges_kpc)?;
    let n = directions.len();
    Error::check_len("intensity", edges_kpc.len() - 1, intensity.len())?;
    for map in intensity {
        Error::check_len("a layer of intensity", n, map.len())?;
    }
    Error::check_len("q_obs", n, q_obs.len())?;
    Error::check_len("u_obs", n, u_obs.len())?;
    Error::check_len("sums", pitch_rad.len(), sums.len())?;
    Error::check_scratch("scratch", scan_scratch_len(pitch_rad.len()), scratch.len())?;
    dispatch!(level, |token: L| scan::<L>(
        token, model, edges_kpc, directions, intensity, q_obs, u_obs, pitch_rad, sums, scratch
    ));
    Ok(())
}

#[inline(always)]
fn scan<L: Lanes>(
    token: L::Token,
    model: &Model,
    edges_kpc: &[f64],
    directions: &[[f64; 3]],
    intensity: &[&[f64]],
    q_obs: &[f64],
    u_obs: &[f64],
    pitch_rad: &[f64],
    sums: &mut [f64],
    scratch: &mut [f64],
) {
    let n_q = pitch_rad.len();
    let (nodes, rest) = scratch.split_at_mut(ratios_scratch_len());
    let nodes = nodes_in(nodes);
    // Per pitch angle: Q and U of the pixel, eight lanes each; sine and cosine.
    let (totals, rest) = rest.split_at_mut(16 * n_q);
    let totals = totals.as_chunks_mut::<8>().0.as_chunks_mut::<2>().0;
    let pitches = rest.as_chunks_mut::<2>().0;
    for ([sin_q, cos_q], &q) in pitches.iter_mut().zip(pitch_rad) {
        (*sin_q, *cos_q) = sin_cos(q);
    }
    let line_of_sight::Grains { p0, k } = model.grains;
    let law = Depolarisation::new(k);
    let mut panels = Panels::new();
    for (pixel, &direction) in directions.iter().enumerate() {
        let sight = model.sight(direction);
        totals.fill([[0.0; 8]; 2]);
        for (edges, map) in edges_kpc.windows(2).zip(intensity) {
            let (&[near, far], Some(&i)) = (edges, map.get(pixel)) else {
                continue;
            };
            if i == 0.0 {
                continue;
            }
            // Nodes for all pitch angles at once, or for one after the other.
            let group = match law.turn(&sight, 0.0) {
                Turn::Every(_) => n_q.max(1),
                Turn::Graded(_) => 1,
            };
            let groups = totals
                .chunks_mut(group)
                .zip(pitches.chunks(group))
                .zip(pitch_rad);
            for ((totals, pitches), &pitch) in groups {
                let turn = law.turn(&sight, pitch);
                let (nodes, i_m) =
                    layer_nodes::<L>(token, &sight, [near, far], turn, &mut panels, nodes);
                let scale = L::splat(token, p0 * i / i_m);
                for ([q_total, u_total], &pitch) in totals.iter_mut().zip(pitches) {
                    let (q, u) = polarise::<L>(token, nodes, pitch, &sight, law);
                    scale.mul_add(q, L::load(token, q_total)).store(q_total);
                    scale.mul_add(u, L::load(token, u_total)).store(u_total);
                }
            }
        }
        let (Some(&q_obs), Some(&u_obs)) = (q_obs.get(pixel), u_obs.get(pixel)) else {
            continue;
        };
        for (sum, [q, u]) in sums.iter_mut().zip(&*totals) {
            let q_model = L::load(token, q).reduce_sum();
            let u_model = 2.0 * sight.signed_sin_b * L::load(token, u).reduce_sum();
            *sum += abs(q_model - q_obs) + abs(u_model - u_obs);
        }
    }
}
