//! F_m on rings ↔ harmonics of the rings: what the rings of caps and belt have in common.
//!
//! On a ring of n pixels, the first at φ₀, f_j = Σ_m F_m e^{imφ₀} e^{2πi m j/n}: order m falls on harmonic m mod n,
//! whatever n (short rings near the poles alias many orders on one harmonic). A northern and its southern ring have
//! the same n and φ₀ and are put in one complex sequence N + iS, so that one complex transform serves two real rings:
//! harmonic m takes N_m + i S_m, harmonic −m takes conj N_m + i conj S_m.
//!
//! e^{imφ₀} is the product of two table entries, e^{i 64 m₁ φ₀} e^{i m₀ φ₀}, each correctly reduced: no drift with m.

use super::legendre::PhaseBlock;
use super::resampling::ORDERS;
use crate::error::Error;
use crate::fourier::{Eight, Fourier};
use crate::scalar;
use crate::simd::{Aligned, Lanes};
use core::ops::Range;

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

/// Is there a place within `tiles` for all orders?
pub(super) fn check_places(
    tiles: &[PhaseTile],
    places: &[usize],
    orders: usize,
) -> Result<(), Error> {
    let count = orders.div_ceil(ORDERS);
    Error::check_scratch("places", count, places.len())?;
    for place in places.iter().take(count) {
        Error::check_scratch("phases", place.saturating_add(1), tiles.len())?;
    }
    Ok(())
}

/// F of eight consecutive orders on a block: what the two stages hand each other.
pub type PhaseTile = [PhaseBlock; ORDERS];

/// Harmonics m and −m of N + iS, eight rings each: real, imaginary.
pub(super) type Harmonics<L> = [[L; 2]; 2];

/// F_m on a block → its harmonics; those of m = 0, one and the same, come as F_0 (its real part) and zero.
#[inline(always)]
pub(super) fn harmonics<L: Lanes>(
    token: L::Token,
    block: &PhaseBlock,
    m: usize,
    (c, s): (L, L),
) -> Harmonics<L> {
    let (nr, ni) = (L::load(token, &block[0]), L::load(token, &block[1]));
    let (sr, si) = (L::load(token, &block[2]), L::load(token, &block[3]));
    let (nr, ni) = (nr.mul_sub(c, ni * s), nr.mul_add(s, ni * c));
    let (sr, si) = (sr.mul_sub(c, si * s), sr.mul_add(s, si * c));
    if m == 0 {
        return [[nr, sr], [L::splat(token, 0.0); 2]];
    }
    [[nr - si, ni + sr], [nr + si, sr - ni]]
}

/// The transpose of [`harmonics`]; `rotation` is half of cos and sin of mφ₀.
///
/// N = (Z_m + conj Z_−m)/2, S = (Z_m − conj Z_−m)/2i, times e^{−imφ₀}; Z_−0 is Z_0.
#[inline(always)]
pub(super) fn order<L: Lanes>(
    token: L::Token,
    [[pr, pi], [mr, mi]]: Harmonics<L>,
    m: usize,
    (c, s): (L, L),
) -> [L; 4] {
    let (nr, ni) = (pr + mr, pi - mi);
    let (sr, si) = (pi + mi, mr - pr);
    let mut block = [
        nr.mul_add(c, ni * s),
        ni.mul_sub(c, nr * s),
        sr.mul_add(c, si * s),
        si.mul_sub(c, sr * s),
    ];
    if m == 0 {
        block[1] = L::splat(token, 0.0);
        block[3] = block[1];
    }
    block
}

/// Zeros in place of the harmonics `gap`.
pub(super) fn clear_harmonics(
    fourier: &Fourier,
    gap: Range<usize>,
    points: &mut [Eight],
) -> Option<()> {
    let mut places = fourier.places(gap.start);
    for _ in gap {
        *points.get_mut(places.step())? = Eight::default();
    }
    Some(())
}

/// Zeros in place of the orders that the last tile has beyond `orders`.
pub(super) fn clear_orders(tiles: &mut [&mut PhaseTile], orders: usize) {
    if let Some(rest) = tiles
        .get_mut(orders / ORDERS)
        .and_then(|tile| tile.get_mut(orders % ORDERS..))
    {
        rest.fill(PhaseBlock::default());
    }
}
