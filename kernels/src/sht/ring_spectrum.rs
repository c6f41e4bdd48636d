//! F_m on rings ↔ spectra of the rings.
//!
//! On a ring of n pixels, the first at φ₀, f_j = Σ_m F_m e^{imφ₀} e^{2πi m j/n}: order m falls on harmonic m mod n,
//! whatever n (short rings near the poles alias many orders on one harmonic). A northern and its southern ring have
//! the same n and φ₀ and are put in one complex sequence N + iS, so that one complex FFT of length n serves two real
//! rings: harmonic k takes N_m + i S_m, harmonic −k takes conj N_m + i conj S_m.
//!
//! The FFT is always the forward one, e^{−2πi jk/n}: with real and imaginary parts exchanged before and after, it is
//! the backward one. Spectra here are therefore stored as (imaginary, real), and the sequence comes out as S + iN.
//!
//! e^{imφ₀} is the product of two table entries, e^{i 64 m₁ φ₀} e^{i m₀ φ₀}, each correctly reduced: no drift with m.

use super::legendre::{Aligned, PhaseBlock};
use super::window::prefetch;
use crate::error::Error;
use crate::scalar;
use crate::simd::{Lanes, Level};
use num_complex::Complex;

/// Orders per coarse step of the table of phases.
const FINE: usize = 64;

/// Length of the [`PhaseTable`] of a block.
#[must_use]
pub const fn phase_table_len(lmax: usize) -> usize {
    FINE + lmax / FINE + 1
}

/// One entry of the table of phases: cos and sin on eight ring pairs.
pub type PhaseTable = Aligned<2>;

/// Geometry of the rings of a block, and access to it.
#[derive(Clone, Copy, Debug)]
pub struct RingShapes {
    /// Pixels of each ring; zero for lanes that repeat a ring.
    pub pixels: [usize; 8],
    /// Is the first pixel at φ₀ = π/n (else 0)?
    pub shifted: [bool; 8],
}

impl RingShapes {
    /// Block number `block` of a HEALPix map.
    #[must_use]
    pub fn healpix(nside: u64, block: usize) -> Self {
        let mut shapes = Self {
            pixels: [0; 8],
            shifted: [false; 8],
        };
        for lane in 0..8 {
            let pair = (8 * block + lane) as u64;
            if pair < 2 * nside {
                let (_, _, pixels, shifted) = super::healpix_ring(nside, pair);
                shapes.pixels[lane] = pixels as usize;
                shapes.shifted[lane] = shifted;
            }
        }
        shapes
    }

    /// Complex values the spectra of all its ring pairs take, one after another.
    #[must_use]
    pub fn len(&self) -> usize {
        self.pixels.iter().sum()
    }

    /// Are there no rings?
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Fills the table of a block: `out` of [`phase_table_len`].
pub fn phase_table(shapes: &RingShapes, out: &mut [PhaseTable]) {
    for (k, out) in out.iter_mut().enumerate() {
        let m = if k < FINE { k } else { (k - FINE) * FINE };
        for lane in 0..8 {
            let n = shapes.pixels[lane];
            let (s, c) = if shapes.shifted[lane] && n > 0 {
                // mπ/n, period 2n
                let reduced = (m % (2 * n)) as f64;
                scalar::sin_cos(core::f64::consts::PI * reduced / n as f64)
            } else {
                (0.0, 1.0)
            };
            out[0][lane] = c;
            out[1][lane] = s;
        }
    }
}

/// cos and sin of mφ₀.
#[inline(always)]
pub(super) fn phase<L: Lanes>(token: L::Token, m: usize, table: &[PhaseTable]) -> Option<(L, L)> {
    let fine = table.get(m % FINE)?;
    let coarse = table.get(FINE + m / FINE)?;
    let (c0, s0) = (L::load(token, &fine[0]), L::load(token, &fine[1]));
    let (c1, s1) = (L::load(token, &coarse[0]), L::load(token, &coarse[1]));
    Some((c0.mul_sub(c1, s0 * s1), c0.mul_add(s1, s0 * c1)))
}

/// Start of each ring pair's spectrum.
fn starts(shapes: &RingShapes) -> [usize; 8] {
    let mut starts = [0; 8];
    let mut sum = 0;
    for (start, n) in starts.iter_mut().zip(shapes.pixels) {
        *start = sum;
        sum += n;
    }
    starts
}

/// Do `orders` orders and their negatives fall on different harmonics of every ring? Else some alias.
fn all_distinct(shapes: &RingShapes, orders: usize) -> bool {
    shapes.pixels.iter().all(|&n| n == 0 || 2 * orders <= n)
}

/// Is there a place within `tiles` for all orders?
pub(super) fn check_places(
    tiles: &[PhaseTile],
    places: &[usize],
    orders: usize,
) -> Result<(), Error> {
    let count = orders.div_ceil(BATCH);
    Error::check_scratch("places", count, places.len())?;
    for place in places.iter().take(count) {
        Error::check_scratch("phases", place.saturating_add(1), tiles.len())?;
    }
    Ok(())
}

/// Orders moved together between lanes and spectra.
const BATCH: usize = super::ORDERS;

/// F of eight consecutive orders on a block: what the two stages hand each other.
pub type PhaseTile = [PhaseBlock; BATCH];

/// N_m + i S_m and conj N_m + i conj S_m of one order, as (imaginary, real, imaginary, real).
#[inline(always)]
fn combine<L: Lanes>(token: L::Token, block: &PhaseBlock, (c, s): (L, L)) -> [L; 4] {
    let (nr, ni) = (L::load(token, &block[0]), L::load(token, &block[1]));
    let (sr, si) = (L::load(token, &block[2]), L::load(token, &block[3]));
    let (nr, ni) = (nr.mul_sub(c, ni * s), nr.mul_add(s, ni * c));
    let (sr, si) = (sr.mul_sub(c, si * s), sr.mul_add(s, si * c));
    [ni + sr, nr - si, sr - ni, nr + si]
}

#[inline(always)]
fn spectrum_body<L: Lanes>(
    token: L::Token,
    tiles: &[PhaseTile],
    (places, orders): (&[usize], usize),
    table: &[PhaseTable],
    shapes: &RingShapes,
    spectra: &mut [Complex<f64>],
) {
    let starts = starts(shapes);
    let distinct = all_distinct(shapes, orders);
    if !distinct {
        spectra.fill(Complex::default());
    }
    let mut first = 0;
    while first < orders {
        let count = BATCH.min(orders - first);
        let Some(tile) = places.get(first / BATCH).and_then(|&k| tiles.get(k)) else {
            return;
        };
        let next = places.get(first / BATCH + 1).and_then(|&k| tiles.get(k));
        // orders by rings → rings by orders
        let zero = L::splat(token, 0.0);
        let mut parts = [[zero; BATCH]; 4];
        for j in 0..count {
            let Some(rotation) = phase::<L>(token, first + j, table) else {
                return;
            };
            if let Some(next) = next {
                prefetch::<L>(token, &next[j]);
            }
            let combined = combine::<L>(token, &tile[j], rotation);
            for k in 0..4 {
                parts[k][j] = combined[k];
            }
        }
        if first == 0 {
            // F_0 is real, and its two harmonics are one
            let half = L::splat(token, 0.5);
            parts[0][0] = (parts[0][0] + parts[2][0]) * half;
            parts[1][0] = (parts[1][0] + parts[3][0]) * half;
            (parts[2][0], parts[3][0]) = (zero, zero);
        }
        let mut batch = [[[0.0; BATCH]; 8]; 4];
        for k in 0..4 {
            let rows = L::transpose(token, parts[k]);
            for lane in 0..8 {
                rows[lane].store(&mut batch[k][lane]);
            }
        }
        for lane in 0..8 {
            let n = shapes.pixels[lane];
            let Some(ring) = spectra.get_mut(starts[lane]..starts[lane] + n) else {
                return;
            };
            if n == 0 {
                continue;
            }
            if distinct {
                let last = first + count;
                if let Some(plus) = ring.get_mut(first..last) {
                    for (j, z) in plus.iter_mut().enumerate().take(BATCH) {
                        *z = Complex::new(batch[0][lane][j], batch[1][lane][j]);
                    }
                }
                let begin = usize::from(first == 0);
                if let Some(minus) = ring.get_mut(n + 1 - last..n + 1 - first - begin) {
                    for (j, z) in (begin..BATCH).zip(minus.iter_mut().rev()) {
                        *z = Complex::new(batch[2][lane][j], batch[3][lane][j]);
                    }
                }
                if last == orders
                    && let Some(gap) = ring.get_mut(last..n + 1 - last)
                {
                    gap.fill(Complex::default());
                }
            } else {
                let mut k = first % n;
                for j in 0..count {
                    let opposite = if k == 0 { 0 } else { n - k };
                    if let Some(z) = ring.get_mut(k) {
                        *z += Complex::new(batch[0][lane][j], batch[1][lane][j]);
                    }
                    if let Some(z) = ring.get_mut(opposite) {
                        *z += Complex::new(batch[2][lane][j], batch[3][lane][j]);
                    }
                    k = if k + 1 == n { 0 } else { k + 1 };
                }
            }
        }
        first += count;
    }
}

/// F_m of a block of ring pairs → their spectra, one after another in `spectra`, ready for a forward FFT.
///
/// Orders 8k … 8k + 7 are `tiles[places[k]]`, `orders` in all; `table` from [`phase_table`].
///
/// # Errors
/// [`Error::Length`] unless `spectra` is as long as the shapes say and there is a place within `tiles` for all orders.
pub fn spectrum_from_phases(
    level: Level,
    tiles: &[PhaseTile],
    (places, orders): (&[usize], usize),
    table: &[PhaseTable],
    shapes: &RingShapes,
    spectra: &mut [Complex<f64>],
) -> Result<(), Error> {
    Error::check_len("spectra", shapes.len(), spectra.len())?;
    check_places(tiles, places, orders)?;
    crate::dispatch!(level, |token: L| spectrum_body::<L>(
        token,
        tiles,
        (places, orders),
        table,
        shapes,
        spectra
    ));
    Ok(())
}

#[inline(always)]
fn phases_body<L: Lanes>(
    token: L::Token,
    spectra: &[Complex<f64>],
    scale: &[f64; 8],
    table: &[PhaseTable],
    shapes: &RingShapes,
    tiles: &mut [PhaseTile],
    orders: usize,
) {
    let starts = starts(shapes);
    let scale = L::load(token, scale) * L::splat(token, 0.5);
    let distinct = all_distinct(shapes, orders);
    let mut first = 0;
    while first < orders {
        let count = BATCH.min(orders - first);
        let mut batch = [[[0.0; BATCH]; 8]; 4];
        for lane in 0..8 {
            let n = shapes.pixels[lane];
            let Some(ring) = spectra.get(starts[lane]..starts[lane] + n) else {
                return;
            };
            if n == 0 {
                continue;
            }
            if distinct && first > 0 {
                let last = first + count;
                if let (Some(plus), Some(minus)) =
                    (ring.get(first..last), ring.get(n + 1 - last..n + 1 - first))
                {
                    for (j, (p, m)) in (0..BATCH).zip(plus.iter().zip(minus.iter().rev())) {
                        batch[0][lane][j] = p.re;
                        batch[1][lane][j] = p.im;
                        batch[2][lane][j] = m.re;
                        batch[3][lane][j] = m.im;
                    }
                }
            } else {
                let mut k = first % n;
                for j in 0..count {
                    let opposite = if k == 0 { 0 } else { n - k };
                    if let (Some(p), Some(m)) = (ring.get(k), ring.get(opposite)) {
                        batch[0][lane][j] = p.re;
                        batch[1][lane][j] = p.im;
                        batch[2][lane][j] = m.re;
                        batch[3][lane][j] = m.im;
                    }
                    k = if k + 1 == n { 0 } else { k + 1 };
                }
            }
        }
        let Some(tile) = tiles.get_mut(first / BATCH) else {
            return;
        };
        if count < BATCH {
            *tile = [PhaseBlock::default(); BATCH];
        }
        // rings by orders → orders by rings
        let mut parts = [[L::splat(token, 0.0); BATCH]; 4];
        for k in 0..4 {
            for lane in 0..8 {
                parts[k][lane] = L::load(token, &batch[k][lane]);
            }
            parts[k] = L::transpose(token, parts[k]);
        }
        for j in 0..count {
            let m = first + j;
            let Some((c, s)) = phase::<L>(token, m, table) else {
                return;
            };
            let (c, s) = (c * scale, s * scale);
            let block = &mut tile[j];
            let (pr, pi) = (parts[0][j], parts[1][j]);
            let (mr, mi) = (parts[2][j], parts[3][j]);
            // N = (Z_k + conj Z_−k)/2, S = (Z_k − conj Z_−k)/2i, times e^{−imφ₀}
            let (nr, ni) = (pr + mr, pi - mi);
            let (sr, si) = (pi + mi, mr - pr);
            nr.mul_add(c, ni * s).store(&mut block[0]);
            ni.mul_sub(c, nr * s).store(&mut block[1]);
            sr.mul_add(c, si * s).store(&mut block[2]);
            si.mul_sub(c, sr * s).store(&mut block[3]);
            if m == 0 {
                block[1] = [0.0; 8];
                block[3] = [0.0; 8];
            }
        }
        first += count;
    }
}

/// The transpose of [`spectrum_from_phases`]: forward FFTs of the sequences N + iS (stored plainly) → F_m.
///
/// `tiles` are those of the block, in order; orders beyond `orders` in the last one become zero.
///
/// # Errors
/// [`Error::Length`] unless `spectra` is as long as the shapes say and `tiles` hold `orders`.
pub fn phases_from_spectrum(
    level: Level,
    spectra: &[Complex<f64>],
    scale: &[f64; 8],
    table: &[PhaseTable],
    shapes: &RingShapes,
    tiles: &mut [PhaseTile],
    orders: usize,
) -> Result<(), Error> {
    Error::check_len("spectra", shapes.len(), spectra.len())?;
    Error::check_scratch("phases", orders.div_ceil(BATCH), tiles.len())?;
    crate::dispatch!(level, |token: L| phases_body::<L>(
        token, spectra, scale, table, shapes, tiles, orders
    ));
    Ok(())
}

/// One sequence after its FFT, S + iN → the pixels of the northern and of the southern ring (empty if there is none).
///
/// # Errors
/// [`Error::Length`] unless `north` and `south` are as long as `ring`, or `south` empty.
pub fn pixels_from_ring(
    level: Level,
    ring: &[Complex<f64>],
    north: &mut [f64],
    south: &mut [f64],
) -> Result<(), Error> {
    check_ring(ring.len(), north.len(), south.len())?;
    crate::dispatch!(level, |token: L| part_body::<L>(token, ring, north, south));
    Ok(())
}

fn check_ring(ring: usize, north: usize, south: usize) -> Result<(), Error> {
    Error::check_len("northern ring", ring, north)?;
    if south != 0 {
        Error::check_len("southern ring", ring, south)?;
    }
    Ok(())
}

#[inline(always)]
fn part_body<L: Lanes>(
    _token: L::Token,
    ring: &[Complex<f64>],
    north: &mut [f64],
    south: &mut [f64],
) {
    for (z, pixel) in ring.iter().zip(north) {
        *pixel = z.im;
    }
    for (z, pixel) in ring.iter().zip(south) {
        *pixel = z.re;
    }
}

/// Pixels of a northern and a southern ring (empty if there is none) → the sequence N + iS.
///
/// # Errors
/// As in [`pixels_from_ring`].
pub fn ring_from_pixels(
    level: Level,
    north: &[f64],
    south: &[f64],
    ring: &mut [Complex<f64>],
) -> Result<(), Error> {
    check_ring(ring.len(), north.len(), south.len())?;
    crate::dispatch!(level, |token: L| join_body::<L>(token, north, south, ring));
    Ok(())
}

#[inline(always)]
fn join_body<L: Lanes>(_token: L::Token, north: &[f64], south: &[f64], ring: &mut [Complex<f64>]) {
    if south.is_empty() {
        for (z, &pixel) in ring.iter_mut().zip(north) {
            *z = Complex::new(pixel, 0.0);
        }
    }
    for ((z, &north), &south) in ring.iter_mut().zip(north).zip(south) {
        *z = Complex::new(north, south);
    }
}
