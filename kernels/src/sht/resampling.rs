//! Colatitudes where a transform is cheap → colatitudes of the map.
//!
//! On the whole great circle, 0 ≤ θ < 2π, F_m is a trigonometric polynomial of degree lmax with
//! F_m(2π − θ) = (−1)^m F_m(θ) (spin 0 and spin ±2 alike) \[MW11\]. Its values on n > lmax equidistant rings
//! θ_j = (j + ½)π/n are all there is to know, and a HEALPix map has twice as many rings where lmax = 2 Nside: the
//! Legendre stage runs on the equidistant rings, and the values on the others follow by a Fourier transform in θ that
//! is not equidistant at its end \[RBC23\]. That one is made of equidistant transforms and a window of a few points: the
//! harmonics are divided by the transform of the window, brought to a grid of M > n points, and every ring takes
//! [`TAPS`](super::TAPS) of them, weighted (`window`). The adjoint is the transpose, step by step.
//!
//! # Eight orders at once, without redundancy
//! * An even order a and the next one b make one function G = F_a + F_b without symmetry on the circle; both come back
//!   as F_a ± F_b at θ and 2π − θ.
//! * Harmonics of even and odd number separate by G(θ) ± G(θ + π): two functions of period π, the odd one after
//!   division by e^{iθ}, each with half as many points. On a ring pair θ, π − θ these are all the values there are.
//! * Four pairs of orders, even and odd halves, are the eight lanes of [`Fourier`]. The lanes of the Legendre stage are
//!   rings, so blocks of 8 × 8 are transposed in registers on the way.
//!
//! # Cost
//! For eight orders and each real-valued map 40 (n log₂ n + M log₂ M) operations of transforms and 2 · 2 · 16 FMA of
//! eight lanes per ring pair, against half of the Legendre stage, which is lmax/2 · 6 FMA for each order and eight pairs.
//!
//! \[MW11\] McEwen & Wiaux, IEEE Trans. Signal Process. 59, 5876 (2011).
//! \[RBC23\] Reinecke, Belkner & Carron, A&A 678, A165 (2023).

use super::legendre::PhaseBlock;
use super::window::{MARGIN, TAPS, factor, sharpness};
use crate::error::Error;
use crate::fourier::{Eight, Fourier};
use crate::scalar;
use crate::simd::{Aligned, Lanes, Level, Stores, Writer};
use core::f64::consts::PI;

/// Orders of a batch: four pairs.
pub const ORDERS: usize = 8;
/// Least ratio of fine points to harmonics.
pub(super) const OVERSAMPLING: f64 = 1.7;

/// cos θ and sin θ of eight ring pairs.
pub type Carrier = Aligned<2>;

/// Numbers of equidistant rings (even) and of points of the fine grid for an lmax.
#[must_use]
pub fn resampling_lengths(lmax: usize) -> (usize, usize) {
    let fine = OVERSAMPLING * (lmax + 1) as f64;
    (
        Fourier::good_length(lmax + 2),
        Fourier::quick_length((fine as usize + 1).max(2 * TAPS)),
    )
}

/// Factors of the harmonics κ = −⌊(lmax + 1)/2⌋ … ⌊lmax/2⌋: `out` of lmax + 1, as (real, imaginary).
///
/// 1/n, the shift of the equidistant rings by half a step, and one over the transform of the window.
pub fn resampling_factors(lmax: usize, (coarse, fine): (usize, usize), out: &mut [[f64; 2]]) {
    let beta = sharpness(fine as f64 / (lmax + 1) as f64);
    let lowest = lmax.div_ceil(2) as f64;
    for (k, out) in out.iter_mut().enumerate() {
        let kappa = k as f64 - lowest;
        let size = factor(beta, fine, kappa) / coarse as f64;
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

/// Northern and southern values of eight rings, a vector of orders each: real and imaginary north, the same south.
pub(super) type Values<L> = [[L; 8]; 4];

/// F of eight orders on a block → halves of the four functions G, ring by ring.
#[inline(always)]
pub(super) fn halves<L: Lanes>(
    token: L::Token,
    phases: &[PhaseBlock],
    (first, step): (usize, usize),
    carrier: &Carrier,
) -> Option<Values<L>> {
    let zero = L::splat(token, 0.0);
    let mut out = [[zero; 8]; 4];
    let half = L::splat(token, 0.5);
    let c = L::load(token, &carrier[0]) * half;
    let s = L::load(token, &carrier[1]) * half;
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
            out[here][t] = (re + far_re) * half;
            out[here + 1][t] = (im + far_im) * half;
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
pub(super) fn whole<L: Lanes>(
    token: L::Token,
    mut values: Values<L>,
    phases: &mut Writer<'_, L, [PhaseBlock]>,
    (first, step): (usize, usize),
    carrier: &Carrier,
) -> Option<()> {
    let zero = L::splat(token, 0.0);
    for rows in &mut values {
        *rows = L::transpose(token, *rows);
    }
    let half = L::splat(token, 0.5);
    let c = L::load(token, &carrier[0]) * half;
    let s = L::load(token, &carrier[1]) * half;
    for t in 0..4 {
        let (mut near, mut far) = ([zero; 4], [zero; 4]);
        for hemisphere in 0..2 {
            let here = 2 * hemisphere;
            let (even_re, even_im) = (values[here][t] * half, values[here + 1][t] * half);
            let (re, im) = (values[here][4 + t], values[here + 1][4 + t]);
            // e^{iθ}; in the south, −e^{−iθ}
            let (c, s) = if hemisphere == 0 { (c, s) } else { (-c, s) };
            let (odd_re, odd_im) = (re.mul_sub(c, im * s), re.mul_add(s, im * c));
            (near[here], near[here + 1]) = (even_re + odd_re, even_im + odd_im);
            (far[here], far[here + 1]) = (even_re - odd_re, even_im - odd_im);
        }
        let (mut a, mut b) = (near, near);
        for k in 0..4 {
            let opposite = far[k ^ 2];
            a[k] += opposite;
            b[k] -= opposite;
        }
        phases.put(first + 2 * t * step, a)?;
        phases.put(first + (2 * t + 1) * step, b)?;
    }
    Some(())
}

#[inline(always)]
fn gather_body<L: Lanes>(
    token: L::Token,
    phases: &[PhaseBlock],
    step: usize,
    carriers: &[Carrier],
    grid: &mut [Eight],
) -> Option<()> {
    let n = grid.len();
    for (b, carrier) in carriers.iter().enumerate() {
        let v = halves::<L>(token, phases, (b, step), carrier)?;
        for lane in 0..8 {
            let j = 8 * b + lane;
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

/// F of eight orders on the blocks of equidistant rings → the functions of period π on the grid `grid`.
///
/// `phases`: those of an order one after another, `step` from an order to the next.
///
/// # Errors
/// [`Error::Length`] unless `phases` hold the blocks.
pub fn grid_from_phases(
    level: Level,
    phases: &[PhaseBlock],
    step: usize,
    carriers: &[Carrier],
    grid: &mut [Eight],
) -> Result<(), Error> {
    check(phases.len(), step, carriers.len())?;
    crate::dispatch!(level, |token: L| gather_body::<L>(
        token, phases, step, carriers, grid
    ));
    Ok(())
}

fn check(phases: usize, step: usize, blocks: usize) -> Result<(), Error> {
    let need = step.saturating_mul(ORDERS - 1).saturating_add(blocks);
    Error::check_scratch("phases", need, phases)
}

#[inline(always)]
fn scatter_body<L: Lanes>(
    token: L::Token,
    grid: &[Eight],
    carriers: &[Carrier],
    phases: &mut [PhaseBlock],
    step: usize,
) -> Option<()> {
    let n = grid.len();
    let mut phases = Writer::new(token, phases, Stores::Cached);
    for (b, carrier) in carriers.iter().enumerate() {
        let mut v = [[L::splat(token, 0.0); 8]; 4];
        for lane in 0..8 {
            let j = 8 * b + lane;
            if 2 * j >= n {
                break;
            }
            let (north, south) = (grid.get(j)?, grid.get(n - 1 - j)?);
            v[0][lane] = L::load(token, &north[0]);
            v[1][lane] = L::load(token, &north[1]);
            v[2][lane] = L::load(token, &south[0]);
            v[3][lane] = L::load(token, &south[1]);
        }
        whole::<L>(token, v, &mut phases, (b, step), carrier)?;
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
    carriers: &[Carrier],
    phases: &mut [PhaseBlock],
    step: usize,
) -> Result<(), Error> {
    check(phases.len(), step, carriers.len())?;
    crate::dispatch!(level, |token: L| scatter_body::<L>(
        token, grid, carriers, phases, step
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
        repeat_ends(n, fine);
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

/// Fills the margins of a grid of n points, n at least as long as one.
pub(super) fn repeat_ends(n: usize, fine: &mut [Eight]) {
    fine.copy_within(n..n + MARGIN, 0);
    fine.copy_within(MARGIN..2 * MARGIN, n + MARGIN);
}

/// Adds the margins to the points they repeat.
#[inline(always)]
pub(super) fn fold<L: Lanes>(token: L::Token, n: usize, fine: &mut [Eight]) -> Option<()> {
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
