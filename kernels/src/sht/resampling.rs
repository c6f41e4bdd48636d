//! Colatitudes where a transform is cheap → colatitudes of the map.
//!
//! On the whole great circle, 0 ≤ θ < 2π, F_m is a trigonometric polynomial of degree lmax with
//! F_m(2π − θ) = (−1)^m F_m(θ) (spin 0 and spin ±2 alike) \[MW11\]. Its values on n > lmax equidistant rings
//! θ_j = (j + ½)π/n are all there is to know, and a HEALPix map has twice as many rings where lmax = 2 Nside: the
//! Legendre stage runs on the equidistant rings, and the values on the others follow by a Fourier transform in θ that
//! is not equidistant at its end \[RBC23\]. That one is made of equidistant transforms and a window of a few points: the
//! harmonics are divided by the transform of the window, brought to a grid of M > n points, and every ring takes
//! [`TAPS`] of them, weighted. The adjoint is the transpose, step by step.
//!
//! # Eight orders at once, without redundancy
//! * An even order a and the next one b make one function G = F_a + F_b without symmetry on the circle; both come back
//!   as F_a ± F_b at θ and 2π − θ.
//! * Harmonics of even and odd number separate by G(θ) ± G(θ + π): two functions of period π, the odd one after
//!   division by e^{iθ}, each with half as many points. On a ring pair θ, π − θ these are all the values there are.
//! * Four pairs of orders, even and odd halves, are the eight lanes of [`Fourier`]. The lanes of the Legendre stage are
//!   rings, so blocks of 8 × 8 are transposed in registers on the way.
//!
//! # Window
//! Kaiser and Bessel's, I₀(β√(1 − (2u/W)²)) over I₀(β) with W = [`TAPS`] = 16, whose transform is
//! W sinh √(β² − ξ²)/√(β² − ξ²), ξ = πWκ/M, and β just below πW(1 − (lmax + 1)/2M). With M ≥ 1.7 (lmax + 1) the rms error
//! for a flat spectrum is 2e-14 (measured; of it half is aliasing, the rest rounding: the highest harmonics grow twentyfold
//! in the division). θ of the rings is carried in two parts: lmax times its rounding error would be 4e-13.
//!
//! # Cost
//! For eight orders and each real-valued map 40 (n log₂ n + M log₂ M) operations of transforms and 2 · 2 · 16 FMA of
//! eight lanes per ring pair, against half of the Legendre stage, which is lmax/2 · 6 FMA for each order and eight pairs.
//!
//! \[MW11\] McEwen & Wiaux, IEEE Trans. Signal Process. 59, 5876 (2011).
//! \[RBC23\] Reinecke, Belkner & Carron, A&A 678, A165 (2023).

use super::double::Double;
use super::legendre::{Aligned, PhaseBlock};
use super::rings::{RingBlock, half_angle, healpix_half_angle};
use crate::error::Error;
use crate::fourier::{Eight, Fourier};
use crate::scalar;
use crate::simd::{Lanes, Level};
use core::f64::consts::PI;

/// Points of the window.
pub const TAPS: usize = 16;
/// Points on either side of the fine grid that repeat the other end, so that no window wraps.
pub const MARGIN: usize = TAPS / 2;
/// Orders of a batch: four pairs.
pub const ORDERS: usize = 8;
/// Least ratio of fine points to harmonics.
const OVERSAMPLING: f64 = 1.7;

/// cos θ and sin θ of eight ring pairs.
pub type Carrier = Aligned<2>;

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

/// Numbers of equidistant rings (even) and of points of the fine grid for an lmax.
#[must_use]
pub fn resampling_lengths(lmax: usize) -> (usize, usize) {
    let fine = OVERSAMPLING * (lmax + 1) as f64;
    (
        Fourier::good_length(lmax + 2),
        Fourier::good_length((fine as usize + 1).max(2 * TAPS)),
    )
}

/// β of the window.
fn sharpness(lmax: usize, fine: usize) -> f64 {
    0.985 * PI * TAPS as f64 * (1.0 - (lmax + 1) as f64 / (2.0 * fine as f64))
}

/// I₀(x) e^{−β} by its series, all of whose terms are positive; x ≤ β < 60.
fn bessel(x: f64, beta: f64) -> f64 {
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
    let beta = sharpness(lmax, fine);
    // 2/π, to turn half angles into periods
    let two_over_pi = Double {
        hi: 0.636_619_772_367_581_4,
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

/// Factors of the harmonics κ = −⌊(lmax + 1)/2⌋ … ⌊lmax/2⌋: `out` of lmax + 1, as (real, imaginary).
///
/// 1/n, the shift of the equidistant rings by half a step, and one over the transform of the window.
pub fn resampling_factors(lmax: usize, (coarse, fine): (usize, usize), out: &mut [[f64; 2]]) {
    let beta = sharpness(lmax, fine);
    let lowest = lmax.div_ceil(2) as f64;
    for (k, out) in out.iter_mut().enumerate() {
        let kappa = k as f64 - lowest;
        let xi = PI * TAPS as f64 * kappa / fine as f64;
        let root = scalar::sqrt((beta * beta - xi * xi).max(1e-300));
        // e^{−β} sinh r
        let sinh = 0.5 * (scalar::exp(root - beta) - scalar::exp(-root - beta));
        let size = root / (TAPS as f64 * sinh * coarse as f64);
        let (s, c) = scalar::sin_cos(-PI * kappa / coarse as f64);
        *out = [size * c, size * s];
    }
}

/// cos θ and sin θ of the equidistant rings.
pub fn equidistant_carriers(coarse: usize, out: &mut [Carrier]) {
    for (b, carrier) in out.iter_mut().enumerate() {
        for lane in 0..8 {
            let j = (8 * b + lane) as f64;
            let (s, c) = scalar::sin_cos(PI * (j + 0.5) / coarse as f64);
            carrier[0][lane] = c;
            carrier[1][lane] = s;
        }
    }
}

/// Where the phases of eight orders lie: steps between orders and between blocks.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    /// From an order to the next.
    pub order: usize,
    /// From a block to the next.
    pub block: usize,
}

/// Northern and southern values of eight rings, a vector of orders each: real and imaginary north, the same south.
type Values<L> = [[L; 8]; 4];

/// F of eight orders on a block → halves of the four functions G, ring by ring; all times `scale`.
#[inline(always)]
fn halves<L: Lanes>(
    token: L::Token,
    phases: &[PhaseBlock],
    (first, step): (usize, usize),
    carrier: &Carrier,
    scale: L,
) -> Option<Values<L>> {
    let zero = L::splat(token, 0.0);
    let mut out = [[zero; 8]; 4];
    let scale = scale * L::splat(token, 0.5);
    let c = L::load(token, &carrier[0]) * scale;
    let s = L::load(token, &carrier[1]) * scale;
    for t in 0..4 {
        let a = phases.get(first + 2 * t * step)?;
        let b = phases.get(first + (2 * t + 1) * step)?;
        let mut sums = [zero; 4];
        let mut differences = [zero; 4];
        for k in 0..4 {
            let (a, b) = (L::load(token, &a[k]), L::load(token, &b[k]));
            sums[k] = a + b;
            differences[k] = a - b;
        }
        for hemisphere in 0..2 {
            let (here, there) = (2 * hemisphere, 2 - 2 * hemisphere);
            // G(θ) and G(θ + π)
            let (re, im) = (sums[here], sums[here + 1]);
            let (far_re, far_im) = (differences[there], differences[there + 1]);
            out[here][t] = (re + far_re) * scale;
            out[here + 1][t] = (im + far_im) * scale;
            let (re, im) = (re - far_re, im - far_im);
            // e^{−iθ}; in the south, −e^{iθ}
            let (c, s) = if hemisphere == 0 { (c, -s) } else { (-c, -s) };
            out[here][4 + t] = re.mul_sub(c, im * s);
            out[here + 1][4 + t] = re.mul_add(s, im * c);
        }
    }
    for rows in &mut out {
        *rows = L::transpose(token, *rows);
    }
    Some(out)
}

/// The transpose of [`halves`], which is also its inverse where F has its symmetry.
#[inline(always)]
fn whole<L: Lanes>(
    token: L::Token,
    mut values: Values<L>,
    phases: &mut [PhaseBlock],
    (first, step): (usize, usize),
    carrier: &Carrier,
    scale: L,
) -> Option<()> {
    let zero = L::splat(token, 0.0);
    for rows in &mut values {
        *rows = L::transpose(token, *rows);
    }
    let scale = scale * L::splat(token, 0.5);
    let c = L::load(token, &carrier[0]) * scale;
    let s = L::load(token, &carrier[1]) * scale;
    for t in 0..4 {
        let (mut near, mut far) = ([zero; 4], [zero; 4]);
        for hemisphere in 0..2 {
            let here = 2 * hemisphere;
            let (even_re, even_im) = (values[here][t] * scale, values[here + 1][t] * scale);
            let (re, im) = (values[here][4 + t], values[here + 1][4 + t]);
            // e^{iθ}; in the south, −e^{−iθ}
            let (c, s) = if hemisphere == 0 { (c, s) } else { (-c, s) };
            let (odd_re, odd_im) = (re.mul_sub(c, im * s), re.mul_add(s, im * c));
            (near[here], near[here + 1]) = (even_re + odd_re, even_im + odd_im);
            (far[here], far[here + 1]) = (even_re - odd_re, even_im - odd_im);
        }
        for k in 0..4 {
            let opposite = far[k ^ 2];
            (near[k] + opposite).store(&mut phases.get_mut(first + 2 * t * step)?[k]);
            (near[k] - opposite).store(&mut phases.get_mut(first + (2 * t + 1) * step)?[k]);
        }
    }
    Some(())
}

#[inline(always)]
fn gather_body<L: Lanes>(
    token: L::Token,
    phases: &[PhaseBlock],
    layout: Layout,
    carriers: &[Carrier],
    rings: Option<&[RingBlock]>,
    first: usize,
    grid: &mut [Eight],
) -> Option<()> {
    let n = grid.len();
    for (b, carrier) in carriers.iter().enumerate() {
        let scale = match rings {
            Some(rings) => L::load(token, &rings.get(b)?.inv_sin2),
            None => L::splat(token, 1.0),
        };
        let place = (b * layout.block, layout.order);
        let v = halves::<L>(token, phases, place, carrier, scale)?;
        for lane in 0..8 {
            let j = first + 8 * b + lane;
            if 2 * j >= n {
                break;
            }
            let north = grid.get_mut(j)?;
            v[0][lane].store(&mut north[0]);
            v[1][lane].store(&mut north[1]);
            let south = grid.get_mut(n - 1 - j)?;
            v[2][lane].store(&mut south[0]);
            v[3][lane].store(&mut south[1]);
        }
    }
    Some(())
}

/// F of eight orders on consecutive blocks of equidistant rings → the functions of period π on the grid `grid`.
///
/// `first`: ring pair where the blocks start; `rings` for values to be multiplied by 1/sin²θ; `phases` as `layout` says.
///
/// # Errors
/// [`Error::Length`] unless `phases` and `rings` hold the blocks.
pub fn grid_from_phases(
    level: Level,
    phases: &[PhaseBlock],
    layout: Layout,
    carriers: &[Carrier],
    rings: Option<&[RingBlock]>,
    first: usize,
    grid: &mut [Eight],
) -> Result<(), Error> {
    check(phases.len(), layout, carriers.len(), rings)?;
    crate::dispatch!(level, |token: L| gather_body::<L>(
        token, phases, layout, carriers, rings, first, grid
    ));
    Ok(())
}

fn check(
    phases: usize,
    layout: Layout,
    blocks: usize,
    rings: Option<&[RingBlock]>,
) -> Result<(), Error> {
    if blocks > 0 {
        let need = (ORDERS - 1) * layout.order + (blocks - 1) * layout.block + 1;
        Error::check_scratch("phases", need, phases)?;
    }
    rings.map_or(Ok(()), |r| Error::check_scratch("rings", blocks, r.len()))
}

#[inline(always)]
fn scatter_body<L: Lanes>(
    token: L::Token,
    grid: &[Eight],
    first: usize,
    carriers: &[Carrier],
    rings: Option<&[RingBlock]>,
    phases: &mut [PhaseBlock],
    layout: Layout,
) -> Option<()> {
    let n = grid.len();
    for (b, carrier) in carriers.iter().enumerate() {
        let scale = match rings {
            Some(rings) => L::load(token, &rings.get(b)?.inv_sin2),
            None => L::splat(token, 1.0),
        };
        let mut v = [[L::splat(token, 0.0); 8]; 4];
        for lane in 0..8 {
            let j = first + 8 * b + lane;
            if 2 * j >= n {
                break;
            }
            let (north, south) = (grid.get(j)?, grid.get(n - 1 - j)?);
            v[0][lane] = L::load(token, &north[0]);
            v[1][lane] = L::load(token, &north[1]);
            v[2][lane] = L::load(token, &south[0]);
            v[3][lane] = L::load(token, &south[1]);
        }
        let place = (b * layout.block, layout.order);
        whole::<L>(token, v, phases, place, carrier, scale)?;
    }
    Some(())
}

/// The transpose of [`grid_from_phases`]; repeated rings come out as zero.
///
/// # Errors
/// As there.
pub fn phases_from_grid(
    level: Level,
    grid: &[Eight],
    first: usize,
    carriers: &[Carrier],
    rings: Option<&[RingBlock]>,
    phases: &mut [PhaseBlock],
    layout: Layout,
) -> Result<(), Error> {
    check(phases.len(), layout, carriers.len(), rings)?;
    crate::dispatch!(level, |token: L| scatter_body::<L>(
        token, grid, first, carriers, rings, phases, layout
    ));
    Ok(())
}

/// The two transforms of a resampling: coarse to harmonics, harmonics to fine.
#[derive(Clone, Copy, Debug)]
pub struct Resampling<'a> {
    /// Greatest degree.
    pub lmax: usize,
    /// The transform on the equidistant rings, more than lmax of them.
    pub coarse: &'a Fourier,
    /// Its table.
    pub coarse_table: &'a [[f64; 2]],
    /// The transform on the fine grid.
    pub fine: &'a Fourier,
    /// Its table.
    pub fine_table: &'a [[f64; 2]],
    /// From [`resampling_factors`].
    pub factors: &'a [[f64; 2]],
}

/// Copies harmonics between the arrangements of two lengths, times a factor (`sign` −1: its conjugate).
#[inline(always)]
fn move_harmonics<L: Lanes>(
    token: L::Token,
    factors: &[[f64; 2]],
    lowest: usize,
    sign: f64,
    (from_fourier, from): (&Fourier, &[Eight]),
    (to_fourier, to): (&Fourier, &mut [Eight]),
) -> Option<()> {
    let (columns, rows) = to_fourier.shape();
    // harmonics between the two ends, row by row of the arrangement
    let highest = factors.len() - lowest;
    let n = to.len();
    for (k, row) in to.chunks_exact_mut(rows).enumerate().take(columns) {
        let begin = highest.saturating_sub(k).div_ceil(columns);
        let end = (n - lowest).saturating_sub(k).div_ceil(columns);
        if let Some(gap) = row.get_mut(begin..end) {
            gap.fill(Eight::default());
        }
    }
    let mut from_places = from_fourier.places(from.len() - lowest);
    let mut to_places = to_fourier.places(n - lowest);
    for (k, factor) in factors.iter().enumerate() {
        if k == lowest {
            from_places = from_fourier.places(0);
            to_places = to_fourier.places(0);
        }
        let x = from.get(from_places.step())?;
        let to = to.get_mut(to_places.step())?;
        let (re, im) = (L::load(token, &x[0]), L::load(token, &x[1]));
        let c = L::splat(token, factor[0]);
        let s = L::splat(token, sign * factor[1]);
        re.mul_sub(c, im * s).store(&mut to[0]);
        re.mul_add(s, im * c).store(&mut to[1]);
    }
    Some(())
}

impl Resampling<'_> {
    fn check(&self, coarse: &[Eight], fine: &[Eight]) -> Result<(), Error> {
        Error::check_len("equidistant rings", self.coarse.len(), coarse.len())?;
        Error::check_len("fine grid", self.fine.len() + 2 * MARGIN, fine.len())?;
        Error::check_len("factors", self.lmax + 1, self.factors.len())?;
        if self.coarse.len() <= self.lmax || self.fine.len() < self.coarse.len() {
            return Err(Error::Domain {
                what: "points of a resampling, more than lmax",
                value: self.coarse.len() as f64,
            });
        }
        Ok(())
    }

    /// Values on the equidistant grid → fine grid with its margins; `coarse` is destroyed.
    ///
    /// # Errors
    /// [`Error::Length`] unless `coarse`, `fine` (with two margins), tables and `scratch` are as long as the lengths say.
    pub fn refine(
        &self,
        level: Level,
        coarse: &mut [Eight],
        fine: &mut [Eight],
        scratch: &mut [Eight],
    ) -> Result<(), Error> {
        self.check(coarse, fine)?;
        self.coarse
            .forward(level, self.coarse_table, coarse, scratch)?;
        let n = self.fine.len();
        let grid = fine.get_mut(MARGIN..MARGIN + n).unwrap_or(&mut []);
        let lowest = self.lmax.div_ceil(2);
        crate::dispatch!(level, |token: L| move_harmonics::<L>(
            token,
            self.factors,
            lowest,
            1.0,
            (self.coarse, &*coarse),
            (self.fine, &mut *grid)
        ));
        self.fine.backward(level, self.fine_table, grid, scratch)?;
        fine.copy_within(n..n + MARGIN, 0);
        fine.copy_within(MARGIN..2 * MARGIN, n + MARGIN);
        Ok(())
    }

    /// The adjoint of [`refine`](Self::refine); `fine` is destroyed.
    ///
    /// # Errors
    /// As there.
    pub fn coarsen(
        &self,
        level: Level,
        fine: &mut [Eight],
        coarse: &mut [Eight],
        scratch: &mut [Eight],
    ) -> Result<(), Error> {
        self.check(coarse, fine)?;
        let n = self.fine.len();
        crate::dispatch!(level, |token: L| fold::<L>(token, n, fine));
        let grid = fine.get_mut(MARGIN..MARGIN + n).unwrap_or(&mut []);
        self.fine.forward(level, self.fine_table, grid, scratch)?;
        let lowest = self.lmax.div_ceil(2);
        crate::dispatch!(level, |token: L| move_harmonics::<L>(
            token,
            self.factors,
            lowest,
            -1.0,
            (self.fine, &*grid),
            (self.coarse, &mut *coarse)
        ));
        self.coarse
            .backward(level, self.coarse_table, coarse, scratch)
    }
}

/// Adds the margins to the points they repeat.
#[inline(always)]
fn fold<L: Lanes>(token: L::Token, n: usize, fine: &mut [Eight]) -> Option<()> {
    for k in 0..MARGIN {
        for (from, to) in [(k, k + n), (n + MARGIN + k, MARGIN + k)] {
            let x = *fine.get(from)?;
            let to = fine.get_mut(to)?;
            for part in 0..2 {
                (L::load(token, &to[part]) + L::load(token, &x[part])).store(&mut to[part]);
            }
        }
    }
    Some(())
}

#[inline(always)]
fn interpolate_body<L: Lanes>(
    token: L::Token,
    fine: &[Eight],
    taps: &[RingTaps],
    phases: &mut [PhaseBlock],
) -> Option<()> {
    let zero = L::splat(token, 0.0);
    for (taps, out) in taps.iter().zip(phases.chunks_exact_mut(ORDERS)) {
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
        whole::<L>(token, v, out, (0, 1), &taps.carrier, L::splat(token, 1.0))?;
    }
    Some(())
}

/// Fine grid → F of eight orders on the blocks of rings of `taps`: `phases` as (blocks, [`ORDERS`]).
///
/// # Errors
/// [`Error::Length`] unless `phases` is that long. `fine` must be the grid the taps were made for.
pub fn phases_from_fine(
    level: Level,
    fine: &[Eight],
    taps: &[RingTaps],
    phases: &mut [PhaseBlock],
) -> Result<(), Error> {
    Error::check_len("phases", ORDERS * taps.len(), phases.len())?;
    crate::dispatch!(level, |token: L| interpolate_body::<L>(
        token, fine, taps, phases
    ));
    Ok(())
}

/// Asks for a tile that comes next: tiles of one batch lie far apart, where no hardware sees a pattern.
#[inline(always)]
pub(super) fn prefetch_tile<L: Lanes>(token: L::Token, tile: &[PhaseBlock]) {
    for block in tile {
        for part in &block.0 {
            L::prefetch(token, part);
        }
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
    prefetch_tile::<L>(token, next);
    let v = halves::<L>(token, phases, (0, 1), &taps.carrier, L::splat(token, 1.0))?;
    if !add_rings::<L, 4>(token, &v, taps, 0, fine)? {
        for lane in 0..4 {
            add_rings::<L, 1>(token, &v, taps, lane, fine)?;
        }
    }
    if !add_rings::<L, 4>(token, &v, taps, 4, fine)? {
        for lane in 4..8 {
            add_rings::<L, 1>(token, &v, taps, lane, fine)?;
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
    // north, then the mirror image in the south
    let north = fine.get_mut(first..first + count)?;
    for i in 0..count {
        let mut re = L::load(token, &north[i][0]);
        let mut im = L::load(token, &north[i][1]);
        for k in 0..K {
            let w = L::splat(token, cut[k][i]);
            re = own[0][k].mul_add(w, re);
            im = own[1][k].mul_add(w, im);
        }
        re.store(&mut north[i][0]);
        im.store(&mut north[i][1]);
    }
    let south = fine.get_mut(end.checked_sub(count)?..end)?;
    for i in 0..count {
        let to = &mut south[count - 1 - i];
        let mut re = L::load(token, &to[0]);
        let mut im = L::load(token, &to[1]);
        for k in 0..K {
            let w = L::splat(token, cut[k][i]);
            re = own[2][k].mul_add(w, re);
            im = own[3][k].mul_add(w, im);
        }
        re.store(&mut to[0]);
        im.store(&mut to[1]);
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
