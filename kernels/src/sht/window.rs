//! The window that takes values from a fine equidistant grid to the rings of a map, and its transpose.
//!
//! Kaiser and Bessel's, I₀(β√(1 − (2u/W)²)) over I₀(β) with W = [`TAPS`] = 16, whose transform is
//! W sinh √(β² − ξ²)/√(β² − ξ²), ξ = πWκ/M, and β just below πW(1 − (lmax + 1)/2M). With M ≥ 1.7 (lmax + 1) the rms error
//! for a flat spectrum is 2e-14 (measured; of it half is aliasing, the rest rounding: the highest harmonics grow twentyfold
//! in the division by the transform). θ of the rings is carried in two parts: lmax times its rounding error would be 4e-13.
//!
//! ```text
//! fine grid → rings, a block of 8 ring pairs           rings → fine grid
//!   for each ring: N, S ← Σ_i w_i x[first ± i]            halves of the tile, transposed: a vector of orders per ring
//!   transpose: a vector of rings per order                for four rings at once: x[i] += Σ_k w_ki N_k; the same in the south
//!   tile ← wholes
//! ```
//! * Lanes are orders, so that weights are scalars and neighbouring points need no shuffling.
//! * The southern window is the northern one mirrored: one set of weights.
//! * Margins on either side of the grid repeat the other end: no index wraps.
//! * The transpose would be held up by loads and stores, two of each for two FMA; four rings share them.
//! * The next tile is fetched while one is in use: the hardware does not see it coming in time.

use super::double::Double;
use super::legendre::PhaseBlock;
use super::resampling::{Carrier, ORDERS, Values, halves, whole};
use super::rings::{half_angle, healpix_half_angle};
use crate::error::Error;
use crate::fourier::Eight;
use crate::scalar;
use crate::simd::{Lanes, Level, Stores, Writer};
use core::f64::consts::PI;

/// Points of the window.
pub const TAPS: usize = 16;
/// Points on either side of the fine grid that repeat the other end, so that no window wraps.
pub const MARGIN: usize = TAPS / 2;
/// Zeros on either side of a window's weights: windows of neighbouring rings are used together, shifted by up to as much.
const SHIFT: usize = 4;

/// The window on eight ring pairs.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct RingTaps {
    weights: [[f64; TAPS + 2 * SHIFT]; 8],
    carrier: Carrier,
    /// First point of the northern window, counted from the start of the margin.
    first: [usize; 8],
}

impl Default for RingTaps {
    fn default() -> Self {
        Self {
            weights: [[0.0; TAPS + 2 * SHIFT]; 8],
            carrier: Carrier::default(),
            first: [0; 8],
        }
    }
}

impl RingTaps {
    /// End of the points that the northern windows reach, none of them beyond that of the last ring. The southern ones are
    /// their mirror images.
    #[must_use]
    pub fn end(&self) -> usize {
        self.first[7].saturating_add(TAPS)
    }
}

/// β of the window for so many points per harmonic.
pub(super) fn sharpness(oversampling: f64) -> f64 {
    0.985 * PI * TAPS as f64 * (1.0 - 0.5 / oversampling)
}

/// One over the transform of the window at harmonic κ of a grid of `fine` points.
pub(super) fn factor(beta: f64, fine: usize, kappa: f64) -> f64 {
    let xi = PI * TAPS as f64 * kappa / fine as f64;
    let root = scalar::sqrt((beta * beta - xi * xi).max(1e-300));
    // e^{−β} sinh r
    let sinh = 0.5 * (scalar::exp(root - beta) - scalar::exp(-root - beta));
    root / (TAPS as f64 * sinh)
}

/// I₀(x) e^{−β} by its series, all of whose terms are positive; x ≤ β < 60.
pub(super) fn bessel(x: f64, beta: f64) -> f64 {
    let x2 = 0.25 * x * x;
    let (mut sum, mut term, mut k) = (1.0, 1.0, 1.0);
    while term > 1e-18 * sum && k < 200.0 {
        term *= x2 / (k * k);
        sum += term;
        k += 1.0;
    }
    sum * scalar::exp(-beta)
}

/// The windows of the rings of a HEALPix map on a grid of `fine` points; rings that repeat have weights zero.
///
/// # Errors
/// [`Error::Length`] unless `out` has [`super::ring_block_count`] entries; [`Error::Nside`].
pub fn ring_taps(nside: u64, lmax: usize, fine: usize, out: &mut [RingTaps]) -> Result<(), Error> {
    if nside == 0 || nside > 1 << 20 {
        return Err(Error::Nside { nside });
    }
    Error::check_len("ring blocks", super::ring_block_count(nside), out.len())?;
    let beta = sharpness(fine as f64 / (lmax + 1) as f64);
    // 2/π, to turn half angles into periods
    let two_over_pi = Double {
        hi: core::f64::consts::FRAC_2_PI,
        lo: -3.935_735_335_036_497e-17,
    };
    for (b, taps) in (0u64..).zip(out.iter_mut()) {
        *taps = RingTaps::default();
        for lane in 0..8 {
            let pair = 8 * b + lane as u64;
            if pair >= 2 * nside {
                taps.first[lane] = taps.first[lane.saturating_sub(1)];
                continue;
            }
            let half = half_angle(healpix_half_angle(nside, pair));
            let (sin, cos) = scalar::sin_cos(2.0 * half.value());
            taps.carrier[0][lane] = cos;
            taps.carrier[1][lane] = sin;
            let place = half.mul(two_over_pi).mul(Double::from(fine as f64));
            let first = scalar::floor(place.value()) - (MARGIN as f64 - 1.0);
            taps.first[lane] = (first + MARGIN as f64) as usize;
            let weights = taps.weights[lane].iter_mut().skip(SHIFT).take(TAPS);
            for (i, weight) in weights.enumerate() {
                let u = ((place.hi - (first + i as f64)) + place.lo) / MARGIN as f64;
                *weight = bessel(beta * scalar::sqrt((1.0 - u * u).max(0.0)), beta);
            }
        }
    }
    Ok(())
}

#[inline(always)]
fn interpolate_body<L: Lanes>(
    token: L::Token,
    fine: &[Eight],
    taps: &[RingTaps],
    phases: &mut [PhaseBlock],
    stores: Stores,
) -> Option<()> {
    let zero = L::splat(token, 0.0);
    let mut phases = Writer::new(token, phases, stores);
    for (b, taps) in taps.iter().enumerate() {
        let mut v = [[zero; 8]; 4];
        for lane in 0..8 {
            let first = taps.first[lane];
            let north = fine.get(first..first + TAPS)?;
            // the mirror image about the middle of the grid
            let end = fine.len().checked_sub(first)? + 1;
            let south = fine.get(end.checked_sub(TAPS)?..end)?;
            let mut sums = [zero; 4];
            for i in 0..TAPS {
                let w = L::splat(token, taps.weights[lane][SHIFT + i]);
                let (n, s) = (&north[i], &south[TAPS - 1 - i]);
                sums[0] = L::load(token, &n[0]).mul_add(w, sums[0]);
                sums[1] = L::load(token, &n[1]).mul_add(w, sums[1]);
                sums[2] = L::load(token, &s[0]).mul_add(w, sums[2]);
                sums[3] = L::load(token, &s[1]).mul_add(w, sums[3]);
            }
            for k in 0..4 {
                v[k][lane] = sums[k];
            }
        }
        whole::<L>(token, v, &mut phases, (ORDERS * b, 1), &taps.carrier)?;
    }
    Some(())
}

/// Fine grid → F of eight orders on the blocks of rings of `taps`: `phases` as (blocks, [`ORDERS`]), written as `stores`
/// says.
///
/// # Errors
/// [`Error::Length`] unless `phases` is that long. `fine` must be the grid the taps were made for.
pub fn phases_from_fine(
    level: Level,
    fine: &[Eight],
    taps: &[RingTaps],
    phases: &mut [PhaseBlock],
    stores: Stores,
) -> Result<(), Error> {
    Error::check_len("phases", ORDERS * taps.len(), phases.len())?;
    crate::dispatch!(level, |token: L| interpolate_body::<L>(
        token, fine, taps, phases, stores
    ));
    Ok(())
}

/// Asks for one order of a tile that comes next, which may lie where no hardware sees a pattern. One at a time, because a
/// whole tile takes twice the requests that can be under way, and the rest would wait in line.
#[inline(always)]
pub(super) fn prefetch<L: Lanes>(token: L::Token, block: &PhaseBlock) {
    for part in &block.0 {
        L::prefetch(token, part);
    }
}

#[inline(always)]
fn spread_body<L: Lanes>(
    token: L::Token,
    phases: &[PhaseBlock],
    next: &[PhaseBlock],
    taps: &RingTaps,
    fine: &mut [Eight],
) -> Option<()> {
    let v = halves::<L>(token, phases, (0, 1), &taps.carrier)?;
    if !add_rings::<L, 4>(token, &v, taps, 0, fine, next.get(..4))? {
        for lane in 0..4 {
            add_rings::<L, 1>(token, &v, taps, lane, fine, None)?;
        }
    }
    if !add_rings::<L, 4>(token, &v, taps, 4, fine, next.get(4..))? {
        for lane in 4..8 {
            add_rings::<L, 1>(token, &v, taps, lane, fine, None)?;
        }
    }
    Some(())
}

/// Adds K neighbouring rings to the grid, from ring `lane` on; false if their windows are too far apart for that.
///
/// Their windows overlap but for a point or two: every point is loaded and stored once for all of them, which would
/// otherwise be the bottleneck (two loads and stores for two FMA).
#[inline(always)]
fn add_rings<L: Lanes, const K: usize>(
    token: L::Token,
    values: &Values<L>,
    taps: &RingTaps,
    lane: usize,
    fine: &mut [Eight],
    next: Option<&[PhaseBlock]>,
) -> Option<bool> {
    let zero = L::splat(token, 0.0);
    let mut own = [[zero; K]; 4];
    let mut weights: [&[f64]; K] = [&[]; K];
    let first = taps.first[lane & 7];
    let mut reach = 0;
    for k in 0..K {
        let at = (lane + k) & 7;
        let shift = taps.first[at].wrapping_sub(first);
        if shift > SHIFT || shift < reach {
            return Some(false);
        }
        reach = shift;
        weights[k] = taps.weights[at].get(SHIFT - shift..)?;
        for part in 0..4 {
            own[part][k] = values[part][at];
        }
    }
    let count = TAPS + reach;
    let mut cut = weights;
    for k in 0..K {
        cut[k] = weights[k].get(..count)?;
    }
    let end = fine.len().checked_sub(first)? + 1;
    for i in 0..count {
        if let Some(next) = next
            && let Some(block) = next.get(i / 4)
        {
            L::prefetch(token, &block.0[i % 4]);
        }
        let mut w = [zero; K];
        for k in 0..K {
            w[k] = L::splat(token, cut[k][i]);
        }
        // north, then the mirror image in the south
        for (place, part) in [(first + i, 0), (end.wrapping_sub(1 + i), 2)] {
            let to = fine.get_mut(place)?;
            let mut re = L::load(token, &to[0]);
            let mut im = L::load(token, &to[1]);
            for k in 0..K {
                re = own[part][k].mul_add(w[k], re);
                im = own[part + 1][k].mul_add(w[k], im);
            }
            re.store(&mut to[0]);
            im.store(&mut to[1]);
        }
    }
    Some(true)
}

/// The transpose of [`phases_from_fine`] for one block of rings, added to `fine`.
///
/// `next`: phases soon to come, fetched from memory meanwhile (may be empty).
///
/// # Errors
/// [`Error::Length`] unless `phases` holds [`ORDERS`] orders.
pub fn add_to_fine(
    level: Level,
    phases: &[PhaseBlock],
    next: &[PhaseBlock],
    taps: &RingTaps,
    fine: &mut [Eight],
) -> Result<(), Error> {
    Error::check_len("phases", ORDERS, phases.len())?;
    crate::dispatch!(level, |token: L| spread_body::<L>(
        token, phases, next, taps, fine
    ));
    Ok(())
}
