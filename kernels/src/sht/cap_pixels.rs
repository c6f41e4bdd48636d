//! Sequences of quarters of a ring ↔ the pixels of the ring and its southern partner, two maps at once.
//!
//! ```text
//! synthesis, eight points of a quarter at a time       adjoint: the transpose, from the last line to the first
//!   g_r(φ_j) ← x[j], or Σ_t w_t x[⌊x_j⌋ − 7 + t]          (lanes are (map, r))
//!   transpose                                             (lanes are points)
//!   g_r ← e^{irφ_j} g_r
//!   N, S of quarter q ← Σ_r i^{qr} g_r
//! ```
//! Point j of a quarter of i points lies at x_j = jL/i on a grid of L: with whole numbers, so ⌊x_j⌋ is exact and the
//! rest rounded once. The window is that of `window`, but its values are not tabled (sixteen for every pixel would be
//! more memory than the map): between two points each of the sixteen is a polynomial of degree 13 in the place,
//! s = 2(x − ⌊x⌋) − 1, off by 4e-18 of the window's height at most. Mirror images share even and odd powers, and eight
//! pairs are the lanes.
//!
//! The transpose adds to sixteen points of the grid for every pixel. Four neighbouring pixels, whose windows
//! overlap but for a few points, share loads and stores.

use super::belt::AHEAD;
use super::cap::{CAP_MAPS, CLASSES, CapRing};
use super::resampling::{OVERSAMPLING, fold, repeat_ends};
use super::window::{MARGIN, TAPS, bessel, sharpness};
use crate::error::Error;
use crate::fourier::{Eight, Z, four};
use crate::scalar;
use crate::simd::{Lanes, Level, math};
use core::f64::consts::{FRAC_PI_2, PI};

/// Coefficients of even, and of odd powers.
const POWERS: usize = 7;

/// The window between two points of a grid, as polynomials.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct CapWindow {
    /// (even or odd, power, tap 0 … 7); tap 15 − t is tap t mirrored.
    powers: [[[f64; MARGIN]; POWERS]; 2],
}

impl Default for CapWindow {
    fn default() -> Self {
        Self::new()
    }
}

impl CapWindow {
    /// The polynomials that interpolate at Chebyshev's points.
    #[must_use]
    pub fn new() -> Self {
        const N: usize = 2 * POWERS;
        let beta = sharpness(OVERSAMPLING);
        let mut powers = [[[0.0; MARGIN]; POWERS]; 2];
        let angle = |k: usize| PI * (2 * k + 1) as f64 / (2 * N) as f64;
        for tap in 0..MARGIN {
            let value = |s: f64| {
                let u = (0.5 * (s + 1.0) + (MARGIN - 1 - tap) as f64) / MARGIN as f64;
                bessel(beta * scalar::sqrt((1.0 - u * u).max(0.0)), beta)
            };
            let mut values = [0.0; N];
            for (k, v) in values.iter_mut().enumerate() {
                *v = value(scalar::cos(angle(k)));
            }
            // T_k and T_{k+1} by powers
            let (mut now, mut next) = ([0.0; N], [0.0; N]);
            (now[0], next[1]) = (1.0, 1.0);
            for degree in 0..N {
                let mut c = 0.0;
                for (k, v) in values.iter().enumerate() {
                    c += v * scalar::cos(degree as f64 * angle(k));
                }
                c *= if degree == 0 { 1.0 } else { 2.0 } / N as f64;
                let mut after = [0.0; N];
                for (power, &t) in now.iter().enumerate() {
                    powers[power % 2][power / 2][tap] += c * t;
                    after[power] -= t;
                }
                for (to, from) in after.iter_mut().skip(1).zip(next) {
                    *to += 2.0 * from;
                }
                (now, next) = (next, after);
            }
        }
        Self { powers }
    }

    /// Weights of taps 0 … 7, and of their mirror images 15 … 8.
    #[inline(always)]
    fn weights<L: Lanes>(&self, token: L::Token, s: f64) -> [L; 2] {
        let s = L::splat(token, s);
        let z = s * s;
        let [even, odd] = &self.powers;
        let mut a = L::load(token, &even[POWERS - 1]);
        let mut b = L::load(token, &odd[POWERS - 1]);
        for k in (0..POWERS - 1).rev() {
            a = a.mul_add(z, L::load(token, &even[k]));
            b = b.mul_add(z, L::load(token, &odd[k]));
        }
        [b.mul_add(s, a), b.neg_mul_add(s, a)]
    }
}

/// Places of a quarter's points on the grid, one after another.
struct Points {
    quarter: usize,
    grid: usize,
    first: usize,
    rest: usize,
}

impl Points {
    const fn new(ring: &CapRing<'_>) -> Self {
        Self {
            quarter: ring.quarter,
            grid: ring.fourier.len(),
            first: 1,
            rest: 0,
        }
    }

    /// First point of the window, counted from the start of the margin, and the place between two points, −1 … 1.
    #[inline(always)]
    fn next(&mut self) -> (usize, f64) {
        let now = (
            self.first,
            2.0 * self.rest as f64 / self.quarter as f64 - 1.0,
        );
        self.rest += self.grid;
        while self.rest >= self.quarter {
            self.rest -= self.quarter;
            self.first += 1;
        }
        now
    }
}

/// e^{iφ} at eight points of a quarter from j on.
#[inline(always)]
fn twist<L: Lanes>(token: L::Token, quarter: usize, j: usize) -> Z<L> {
    let count = L::load(token, &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
    let step = FRAC_PI_2 / quarter as f64;
    let angle = (count + L::splat(token, j as f64)) * L::splat(token, step);
    let (im, re) = math::sin_cos::<L>(token, angle);
    Z { re, im }
}

/// Asks for the pixels of all quarters that come soon: sixteen streams are more than the hardware foresees.
#[inline(always)]
fn ask<L: Lanes>(token: L::Token, pixels: &[f64], quarter: usize, j: usize) {
    for q in 0..4 {
        if let Some(pixel) = pixels.get(q * quarter + j + AHEAD) {
            L::prefetch(token, pixel);
        }
    }
}

#[inline(always)]
fn pixels_body<L: Lanes>(
    token: L::Token,
    ring: &CapRing<'_>,
    window: &CapWindow,
    data: &[Eight],
    maps: [[&mut [f64]; 2]; CAP_MAPS],
) -> Option<()> {
    let zero = L::splat(token, 0.0);
    let n = ring.quarter;
    let mut points = Points::new(ring);
    let mut j = 0;
    while j < n {
        let count = (n - j).min(8);
        for pixels in maps.as_flattened() {
            ask::<L>(token, pixels, n, j);
        }
        let mut parts = [[zero; 8]; 2];
        if ring.factors.is_empty() {
            for (k, x) in data
                .get(MARGIN + j..MARGIN + j + count)?
                .iter()
                .enumerate()
                .take(8)
            {
                parts[0][k] = L::load(token, &x[0]);
                parts[1][k] = L::load(token, &x[1]);
            }
        } else {
            let mut weights = [[[0.0; MARGIN]; 2]; 8];
            let mut first = [0; 8];
            for k in 0..count.min(8) {
                let (at, s) = points.next();
                first[k] = at;
                let [w, mirrored] = window.weights::<L>(token, s);
                w.store(&mut weights[k][0]);
                mirrored.store(&mut weights[k][1]);
            }
            for k in 0..count.min(8) {
                let x = data.get(first[k]..)?.first_chunk::<TAPS>()?;
                let (mut re, mut im) = (zero, zero);
                for t in 0..MARGIN {
                    let w = L::splat(token, weights[k][0][t]);
                    re = L::load(token, &x[t][0]).mul_add(w, re);
                    im = L::load(token, &x[t][1]).mul_add(w, im);
                }
                for t in MARGIN..TAPS {
                    let w = L::splat(token, weights[k][1][TAPS - 1 - t]);
                    re = L::load(token, &x[t][0]).mul_add(w, re);
                    im = L::load(token, &x[t][1]).mul_add(w, im);
                }
                parts[0][k] = re;
                parts[1][k] = im;
            }
        }
        let (re, im) = (L::transpose(token, parts[0]), L::transpose(token, parts[1]));
        let w = twist::<L>(token, n, j);
        let w2 = w.times(w);
        let w3 = w2.times(w);
        for map in 0..CAP_MAPS {
            let mut g = [w; CLASSES];
            for r in 0..CLASSES {
                let at = CLASSES * map + r;
                g[r] = Z {
                    re: re[at],
                    im: im[at],
                };
            }
            // i for −i
            let [y0, y3, y2, y1] = four([g[0], g[1].times(w), g[2].times(w2), g[3].times(w3)]);
            let quarters = [[y0.re, y1.re, y2.re, y3.re], [y0.im, y1.im, y2.im, y3.im]];
            for part in 0..2 {
                if maps[map][part].is_empty() {
                    continue;
                }
                for q in 0..4 {
                    let at = q * n + j;
                    quarters[part][q].store_padded(maps[map][part].get_mut(at..at + count)?);
                }
            }
        }
        j += count;
    }
    Some(())
}

fn check(ring: &CapRing<'_>, data: usize, pixels: [[usize; 2]; CAP_MAPS]) -> Result<(), Error> {
    Error::check_len("quarters", ring.room(), data)?;
    for [north, south] in pixels {
        for (what, len) in [("northern ring", north), ("southern ring", south)] {
            if len != 0 {
                Error::check_len(what, 4 * ring.quarter, len)?;
            }
        }
    }
    Ok(())
}

/// Sequences after [`Fourier::backward`](crate::fourier::Fourier::backward) → the pixels of \[north, south\] of up to two
/// maps; empty where there are none. The margins in `data` are filled.
///
/// # Errors
/// [`Error::Length`] unless `data` and the rings are as long as `ring` says.
pub fn pixels_from_cap(
    level: Level,
    ring: &CapRing<'_>,
    window: &CapWindow,
    data: &mut [Eight],
    maps: [[&mut [f64]; 2]; CAP_MAPS],
) -> Result<(), Error> {
    check(
        ring,
        data.len(),
        maps.each_ref().map(|m| [m[0].len(), m[1].len()]),
    )?;
    let n = ring.fourier.len();
    if !ring.factors.is_empty() {
        repeat_ends(n, data);
    }
    crate::dispatch!(level, |token: L| pixels_body::<L>(
        token, ring, window, data, maps
    ));
    Ok(())
}

/// Four points at a time, whose windows begin at most this far apart.
const SHIFT: usize = 8;

/// Adds K neighbouring points of a quarter to the grid.
#[inline(always)]
fn spread<L: Lanes, const K: usize>(
    token: L::Token,
    points: &mut Points,
    window: &CapWindow,
    parts: &[[L; K]; 2],
    data: &mut [Eight],
) -> Option<()> {
    // weights with zeros around them, as many in front as the window is ahead of the first
    let mut weights = [[0.0; TAPS + 2 * SHIFT]; K];
    let mut reach = 0;
    let mut first = 0;
    for k in 0..K {
        let (at, s) = points.next();
        if k == 0 {
            first = at;
        }
        reach = at - first;
        let [w, mirrored] = window.weights::<L>(token, s);
        let (mut a, mut b) = ([0.0; MARGIN], [0.0; MARGIN]);
        w.store(&mut a);
        mirrored.store(&mut b);
        b.reverse();
        let to = weights[k].get_mut(reach..)?.first_chunk_mut::<TAPS>()?;
        to[..MARGIN].copy_from_slice(&a);
        to[MARGIN..].copy_from_slice(&b);
    }
    let count = TAPS + reach;
    for (t, to) in data.get_mut(first..first + count)?.iter_mut().enumerate() {
        let mut re = L::load(token, &to[0]);
        let mut im = L::load(token, &to[1]);
        for k in 0..K {
            let w = L::splat(token, *weights[k].get(t)?);
            re = parts[0][k].mul_add(w, re);
            im = parts[1][k].mul_add(w, im);
        }
        re.store(&mut to[0]);
        im.store(&mut to[1]);
    }
    Some(())
}

#[inline(always)]
fn load_body<L: Lanes>(
    token: L::Token,
    ring: &CapRing<'_>,
    window: &CapWindow,
    maps: [[&[f64]; 2]; CAP_MAPS],
    data: &mut [Eight],
) -> Option<()> {
    let zero = L::splat(token, 0.0);
    let n = ring.quarter;
    let mut points = Points::new(ring);
    let near = 3 * ring.fourier.len() < (SHIFT - 1) * n;
    let mut j = 0;
    while j < n {
        let count = (n - j).min(8);
        for pixels in maps.as_flattened() {
            ask::<L>(token, pixels, n, j);
        }
        let w = twist::<L>(token, n, j);
        let w = Z {
            re: w.re,
            im: -w.im,
        };
        let w2 = w.times(w);
        let w3 = w2.times(w);
        let (mut re, mut im) = ([zero; 8], [zero; 8]);
        for map in 0..CAP_MAPS {
            let mut z = [Z { re: zero, im: zero }; CLASSES];
            for q in 0..4 {
                let at = q * n + j;
                let [north, south] = maps[map];
                if !north.is_empty() {
                    z[q].re = L::load_padded(token, north.get(at..at + count)?, 0.0);
                }
                if !south.is_empty() {
                    z[q].im = L::load_padded(token, south.get(at..at + count)?, 0.0);
                }
            }
            let [y0, y1, y2, y3] = four(z);
            let g = [y0, y1.times(w), y2.times(w2), y3.times(w3)];
            for r in 0..CLASSES {
                (re[CLASSES * map + r], im[CLASSES * map + r]) = (g[r].re, g[r].im);
            }
        }
        let (re, im) = (L::transpose(token, re), L::transpose(token, im));
        if ring.factors.is_empty() {
            for (k, x) in data
                .get_mut(MARGIN + j..MARGIN + j + count)?
                .iter_mut()
                .enumerate()
                .take(8)
            {
                re[k].store(&mut x[0]);
                im[k].store(&mut x[1]);
            }
        } else if near && count == 8 {
            for half in [0, 4] {
                let mut parts = [[zero; 4]; 2];
                for k in 0..4 {
                    (parts[0][k], parts[1][k]) = (re[half + k], im[half + k]);
                }
                spread::<L, 4>(token, &mut points, window, &parts, data)?;
            }
        } else {
            for k in 0..count.min(8) {
                spread::<L, 1>(token, &mut points, window, &[[re[k]], [im[k]]], data)?;
            }
        }
        j += count;
    }
    Some(())
}

/// The transpose of [`pixels_from_cap`], for [`Fourier::forward`](crate::fourier::Fourier::forward); rings that are not
/// there count as zero.
///
/// # Errors
/// As there.
pub fn cap_from_pixels(
    level: Level,
    ring: &CapRing<'_>,
    window: &CapWindow,
    maps: [[&[f64]; 2]; CAP_MAPS],
    data: &mut [Eight],
) -> Result<(), Error> {
    check(ring, data.len(), maps.map(|m| [m[0].len(), m[1].len()]))?;
    let n = ring.fourier.len();
    let windowed = !ring.factors.is_empty();
    if windowed {
        data.fill(Eight::default());
    }
    crate::dispatch!(level, |token: L| load_body::<L>(
        token, ring, window, maps, data
    ));
    if windowed {
        crate::dispatch!(level, |token: L| fold::<L>(token, n, data));
    }
    Ok(())
}
