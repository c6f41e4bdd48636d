//! F_m on eight ring pairs of equal length ↔ their pixels, eight rings across the lanes.
//!
//! The rings of the equatorial belt all have 4 Nside pixels. What `ring_spectrum` does one ring at a time happens here
//! on vectors as the Legendre stage leaves them: harmonics N_m + iS_m and conj N_m + i conj S_m go straight to their
//! places in the arrangement of [`Fourier`], eight complex transforms serve sixteen real rings, and the only exchange
//! between lanes is a transposition of 8 × 8 pixels on the way to or from the map.
//!
//! ```text
//! synthesis                                            adjoint
//!   for m: x[±m] ← e^{imφ₀} (N_m ± …)                    x ← pixels, transposed
//!   the harmonics between: 0; those that alias: added    forward transform
//!   backward transform                                   for m: N_m, S_m from x[m], x[−m]
//!   pixels ← x, transposed
//! ```

use super::resampling::ORDERS;
use super::ring_spectrum::{
    PhaseTable, PhaseTile, check_places, clear_harmonics, clear_orders, harmonics, order, phase,
};
use super::window::prefetch;
use crate::error::Error;
use crate::fourier::{Eight, Fourier};
use crate::simd::{Lanes, Level, Stores, Writer};

/// Pixels asked for before they are read or written.
pub(super) const AHEAD: usize = 32;

#[inline(always)]
fn spectrum_body<L: Lanes>(
    token: L::Token,
    tiles: &[PhaseTile],
    (places, orders): (&[usize], usize),
    table: &[PhaseTable],
    fourier: &Fourier,
    data: &mut [Eight],
) -> Option<()> {
    let n = data.len();
    // orders up to `plain` have harmonics of their own
    let plain = orders.min(n.div_ceil(2));
    clear_harmonics(fourier, plain..n.min(n - plain + 1), data)?;
    let mut up = fourier.places(0);
    let mut down = fourier.places(n - 1);
    for m in 0..orders {
        if let Some(next) = places.get(m / ORDERS + 1).and_then(|&k| tiles.get(k)) {
            prefetch::<L>(token, &next[m % ORDERS]);
        }
        let (c, s) = phase::<L>(token, m, table)?;
        let block = tiles.get(*places.get(m / ORDERS)?)?.get(m % ORDERS)?;
        let [plus, minus] = harmonics::<L>(token, block, m, (c, s));
        if m == 0 {
            let to = data.get_mut(up.step())?;
            plus[0].store(&mut to[0]);
            plus[1].store(&mut to[1]);
            continue;
        }
        if m < plain {
            let to = data.get_mut(up.step())?;
            plus[0].store(&mut to[0]);
            plus[1].store(&mut to[1]);
            let to = data.get_mut(down.step_back())?;
            minus[0].store(&mut to[0]);
            minus[1].store(&mut to[1]);
        } else {
            for (k, z) in [(m % n, plus), ((n - m % n) % n, minus)] {
                let to = data.get_mut(fourier.position(k))?;
                (L::load(token, &to[0]) + z[0]).store(&mut to[0]);
                (L::load(token, &to[1]) + z[1]).store(&mut to[1]);
            }
        }
    }
    Some(())
}

/// F_m of a block of rings of equal length → the harmonics of N + iS at their places, for [`Fourier::backward`].
///
/// Arguments as of [`super::cap_spectrum_from_phases`], of one map; `data` of the length of the rings.
///
/// # Errors
/// [`Error::Length`] unless `data` has the length of `fourier` and there is a place within `tiles` for all orders.
pub fn belt_spectrum_from_phases(
    level: Level,
    tiles: &[PhaseTile],
    (places, orders): (&[usize], usize),
    table: &[PhaseTable],
    fourier: &Fourier,
    data: &mut [Eight],
) -> Result<(), Error> {
    Error::check_len("spectra", fourier.len(), data.len())?;
    check_places(tiles, places, orders)?;
    crate::dispatch!(level, |token: L| spectrum_body::<L>(
        token,
        tiles,
        (places, orders),
        table,
        fourier,
        data
    ));
    Ok(())
}

#[inline(always)]
fn phases_body<L: Lanes>(
    token: L::Token,
    data: &[Eight],
    fourier: &Fourier,
    scale: &[f64; 8],
    table: &[PhaseTable],
    (tiles, orders): (&mut [&mut PhaseTile], usize),
    stores: Stores,
) -> Option<()> {
    let n = data.len();
    let scale = L::load(token, scale) * L::splat(token, 0.5);
    let mut up = fourier.places(0);
    let mut down = fourier.places(n - 1);
    clear_orders(tiles, orders);
    let mut blocks = Writer::new(token, tiles, stores);
    for m in 0..orders {
        let (c, s) = phase::<L>(token, m, table)?;
        let (c, s) = (c * scale, s * scale);
        let k = m % n;
        if k == 0 {
            up = fourier.places(0);
            down = fourier.places(n - 1);
        }
        let plus = data.get(up.step())?;
        let minus = if k == 0 {
            plus
        } else {
            data.get(down.step_back())?
        };
        let plus = [L::load(token, &plus[0]), L::load(token, &plus[1])];
        let minus = [L::load(token, &minus[0]), L::load(token, &minus[1])];
        blocks.put(m, order::<L>(token, [plus, minus], m, (c, s)))?;
    }
    Some(())
}

/// The transpose: harmonics from [`Fourier::forward`] → tiles of F_m, in the order of m; orders beyond `orders` in the
/// last one become zero. `stores`: how tiles are written.
///
/// # Errors
/// [`Error::Length`] unless `data` has the length of `fourier` and `tiles` hold `orders`.
pub fn phases_from_belt_spectrum(
    level: Level,
    data: &[Eight],
    fourier: &Fourier,
    scale: &[f64; 8],
    table: &[PhaseTable],
    (tiles, orders): (&mut [&mut PhaseTile], usize),
    stores: Stores,
) -> Result<(), Error> {
    Error::check_len("spectra", fourier.len(), data.len())?;
    Error::check_len("phases", orders.div_ceil(ORDERS), tiles.len())?;
    crate::dispatch!(level, |token: L| phases_body::<L>(
        token,
        data,
        fourier,
        scale,
        table,
        (tiles, orders),
        stores
    ));
    Ok(())
}

/// Start of ring `lane` of the north, or (PART 1) of its southern partner: these lie in the opposite order, and the equator
/// has none.
#[inline(always)]
fn ring_start<const PART: usize>(len: usize, n: usize, lane: usize) -> Option<usize> {
    if PART == 0 {
        Some(lane * n)
    } else {
        len.checked_sub((lane + 1) * n)
    }
}

/// North and south one after the other: sixteen rings a power of two apart are more than a set of the first-level cache
/// has ways.
#[inline(always)]
fn pixels_body<L: Lanes, const PART: usize>(
    token: L::Token,
    data: &[Eight],
    pixels: &mut [f64],
) -> Option<()> {
    let n = data.len();
    let zero = L::splat(token, 0.0);
    for (number, run) in data.chunks(8).enumerate() {
        let mut rows = [zero; 8];
        for (j, x) in run.iter().enumerate().take(8) {
            rows[j] = L::load(token, &x[PART]);
        }
        let rows = L::transpose(token, rows);
        for lane in 0..8 {
            if let Some(start) = ring_start::<PART>(pixels.len(), n, lane) {
                let at = start + 8 * number;
                if let Some(pixel) = pixels.get(at + AHEAD) {
                    L::prefetch(token, pixel);
                }
                rows[lane].store_padded(pixels.get_mut(at..at + run.len())?);
            }
        }
    }
    Some(())
}

/// Sequences N + iS → the pixels of eight northern rings and their southern partners (seven beside the equator).
///
/// # Errors
/// [`Error::Length`] unless `north` is eight rings and `south` eight or seven.
pub fn pixels_from_belt(
    level: Level,
    data: &[Eight],
    north: &mut [f64],
    south: &mut [f64],
) -> Result<(), Error> {
    check_pixels(data.len(), north.len(), south.len())?;
    crate::dispatch!(level, |token: L| {
        pixels_body::<L, 0>(token, data, north);
        pixels_body::<L, 1>(token, data, south);
    });
    Ok(())
}

fn check_pixels(n: usize, north: usize, south: usize) -> Result<(), Error> {
    Error::check_len("northern rings", 8 * n, north)?;
    if south != 7 * n {
        Error::check_len("southern rings", 8 * n, south)?;
    }
    Ok(())
}

#[inline(always)]
fn load_body<L: Lanes, const PART: usize>(
    token: L::Token,
    pixels: &[f64],
    data: &mut [Eight],
) -> Option<()> {
    let n = data.len();
    let zero = L::splat(token, 0.0);
    for (number, run) in data.chunks_mut(8).enumerate() {
        let mut rows = [zero; 8];
        for lane in 0..8 {
            if let Some(start) = ring_start::<PART>(pixels.len(), n, lane) {
                let at = start + 8 * number;
                if let Some(pixel) = pixels.get(at + AHEAD) {
                    L::prefetch(token, pixel);
                }
                rows[lane] = L::load_padded(token, pixels.get(at..at + run.len())?, 0.0);
            }
        }
        let rows = L::transpose(token, rows);
        for (j, x) in run.iter_mut().enumerate().take(8) {
            rows[j].store(&mut x[PART]);
        }
    }
    Some(())
}

/// The transpose of [`pixels_from_belt`]; a southern ring that is not there is zero.
///
/// # Errors
/// As there.
pub fn belt_from_pixels(
    level: Level,
    north: &[f64],
    south: &[f64],
    data: &mut [Eight],
) -> Result<(), Error> {
    check_pixels(data.len(), north.len(), south.len())?;
    crate::dispatch!(level, |token: L| {
        load_body::<L, 0>(token, north, data);
        load_body::<L, 1>(token, south, data);
    });
    Ok(())
}
