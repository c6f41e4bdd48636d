//! F_m on eight ring pairs of any length ↔ harmonics of their quarters, two maps at once.
//!
//! The rings of the caps have 4i pixels, every one another i, most with great prime factors. Eight lanes need eight
//! sequences of one length all the same, and a ring has four: orders m = 4κ + r with r = 0 … 3 repeat, but for e^{irφ},
//! every quarter of the ring. So f(φ_j + qπ/2) = Σ_r i^{qr} e^{irφ_j} g_r(φ_j), where g_r has the harmonics κ and i points
//! (`cap_pixels`): four lanes, and four more for another map. N + iS of a ring pair is one complex sequence.
//!
//! Where i has no small factors, or the band is narrow, g_r is had on another number of points, of small factors and
//! at least 1.7 times that of harmonics, and a window takes it to the pixels, as in `window`; this replaces
//! transforms of great primes by ones half again as long.
//!
//! ```text
//! synthesis                                             adjoint
//!   for k, orders 4k … 4k + 3 of both maps:               for k:
//!     Z_m, Z_−m of eight rings  (lanes are rings)           of each ring: x[κ = k], x[κ = −k − 1]
//!     transpose: lanes are (map, r)                         transpose
//!     of each ring: x[κ = k] ← Z_m, x[κ = −k − 1] ← Z_−m    F_m of both maps
//! ```
//! * *Whole vectors:* Z_−m of 4k + 1 … 4k + 4 belong to κ = −k − 1. The last of these is the first order of the next k, made
//!   one step ahead and kept, and every access to memory is one of eight lanes.
//! * Rings so short that orders alias (near the poles, or lmax large) have their harmonics added up; the others'
//!   are stored, and the gap between highest and lowest filled with zeros.

use super::resampling::{ORDERS, OVERSAMPLING};
use super::ring_spectrum::{
    Harmonics, PhaseTable, PhaseTile, check_places, clear_harmonics, clear_orders, harmonics,
    order, phase,
};
use super::window::{MARGIN, TAPS, factor, prefetch, sharpness};
use crate::error::Error;
use crate::fourier::{Eight, Fourier, Places};
use crate::simd::{Lanes, Level, Stores, Writer};

/// Classes of orders: m modulo 4.
pub(super) const CLASSES: usize = 4;
/// Maps transformed at once.
pub const CAP_MAPS: usize = 2;

/// One ring pair as the transforms of its quarters see it.
#[derive(Clone, Copy, Debug)]
pub struct CapRing<'a> {
    /// Pixels of a quarter of a ring.
    pub quarter: usize,
    /// Transform of a quarter's length, or of the grid the window starts from: see [`cap_length`].
    pub fourier: &'a Fourier,
    /// From [`cap_factors`] where there is a window, else empty.
    pub factors: &'a [f64],
}

impl CapRing<'_> {
    /// Room of its sequences: the points between two margins.
    #[must_use]
    pub const fn room(&self) -> usize {
        self.fourier.len() + 2 * MARGIN
    }
}

/// The rings of a block; none where there are less than eight.
pub type CapRings<'a> = [Option<CapRing<'a>>; 8];

/// Room the sequences of a block take.
#[must_use]
pub fn cap_room(rings: &CapRings<'_>) -> usize {
    rings.iter().flatten().map(CapRing::room).sum()
}

/// Vector operations for a point by the window.
const WINDOW_WORK: usize = 90;

/// Length of the transform for the quarters of a ring with `orders` orders: their own, or that of a grid and a window,
/// whichever is less work.
#[must_use]
pub fn cap_length(quarter: usize, orders: usize) -> usize {
    let harmonics = 2 * orders.div_ceil(CLASSES) + 1;
    let least = (OVERSAMPLING * harmonics as f64) as usize + 1;
    let grid = Fourier::quick_length(least.max(2 * TAPS));
    let work = |n: usize| Fourier::new(n).map_or(usize::MAX, |f| f.work());
    if work(quarter) <= work(grid).saturating_add(WINDOW_WORK * quarter) {
        quarter
    } else {
        grid
    }
}

/// One over the transform of the window, for |κ| = 0, 1, … on a grid of `grid` points: half of these are enough.
pub fn cap_factors(grid: usize, out: &mut [f64]) {
    let beta = sharpness(OVERSAMPLING);
    for (kappa, out) in out.iter_mut().enumerate() {
        *out = factor(beta, grid, kappa as f64);
    }
}

/// Is there room for the rings, and a factor for every harmonic?
fn check(rings: &CapRings<'_>, data: usize, orders: usize) -> Result<(), Error> {
    Error::check_len("quarters", cap_room(rings), data)?;
    for ring in rings.iter().flatten().filter(|r| !r.factors.is_empty()) {
        let need = orders.div_ceil(CLASSES) + 1;
        Error::check_scratch("factors", need, ring.factors.len())?;
    }
    Ok(())
}

/// A walk through the harmonics of one ring: κ = 0, 1, … and κ = −1, −2, …
#[derive(Clone, Copy)]
struct Walk<'a> {
    ring: CapRing<'a>,
    /// Where the points of the ring begin.
    start: usize,
    up: Places,
    down: Places,
    /// Harmonics until κ = 0 comes again.
    left: usize,
}

impl<'a> Walk<'a> {
    fn new(ring: &CapRing<'a>, start: usize) -> Self {
        let n = ring.fourier.len();
        Self {
            ring: *ring,
            start,
            up: ring.fourier.places(0),
            down: ring.fourier.places(n - 1),
            left: n,
        }
    }

    /// The walks of all rings.
    #[inline(always)]
    fn all(rings: &CapRings<'a>) -> [Option<Self>; 8] {
        let mut walks = [None; 8];
        let mut start = MARGIN;
        for (walk, ring) in walks.iter_mut().zip(rings) {
            if let Some(ring) = ring {
                *walk = Some(Self::new(ring, start));
                start += ring.room();
            }
        }
        walks
    }

    /// Places of κ = k and κ = −k − 1, and one over the window's transform at both; k goes on.
    #[inline(always)]
    fn next(&mut self, k: usize) -> ([usize; 2], [f64; 2]) {
        let places = [
            self.start + self.up.step(),
            self.start + self.down.step_back(),
        ];
        self.left -= 1;
        if self.left == 0 {
            *self = Self::new(&self.ring, self.start);
        }
        let factor = |k: usize| self.ring.factors.get(k).copied().unwrap_or(1.0);
        (places, [factor(k), factor(k + 1)])
    }

    /// Has every order a harmonic of its own?
    const fn distinct(&self, groups: usize) -> bool {
        2 * groups <= self.ring.fourier.len()
    }

    /// Zeros where nothing will be stored: between the ends, or, if orders alias and are added, everywhere.
    fn clear(&self, groups: usize, data: &mut [Eight]) -> Option<()> {
        let n = self.ring.fourier.len();
        let points = data.get_mut(self.start..self.start + n)?;
        if self.distinct(groups) {
            clear_harmonics(self.ring.fourier, groups..n - groups, points)?;
        } else {
            points.fill(Eight::default());
        }
        Some(())
    }
}

/// Stores or adds a harmonic of all classes.
#[inline(always)]
fn put<L: Lanes>(token: L::Token, [re, im]: [L; 2], add: bool, factor: f64, to: &mut Eight) {
    let f = L::splat(token, factor);
    let (mut re, mut im) = (re * f, im * f);
    if add {
        re += L::load(token, &to[0]);
        im += L::load(token, &to[1]);
    }
    re.store(&mut to[0]);
    im.store(&mut to[1]);
}

#[inline(always)]
fn spectrum_body<L: Lanes>(
    token: L::Token,
    tiles: &[PhaseTile],
    (places, orders): ([&[usize]; CAP_MAPS], usize),
    table: &[PhaseTable],
    rings: &CapRings<'_>,
    data: &mut [Eight],
) -> Option<()> {
    let zero = L::splat(token, 0.0);
    let groups = orders.div_ceil(CLASSES);
    let mut walks = Walk::all(rings);
    for walk in walks.iter().flatten() {
        walk.clear(groups, data)?;
    }
    // κ = k and κ = −k − 1 of (map, class), real and imaginary; of the first order of the next group comes Z_−m, too
    let mut next: [Harmonics<L>; CAP_MAPS] = [[[zero; 2]; 2]; CAP_MAPS];
    for k in 0..=groups {
        let (mut plus, mut minus) = ([[zero; 8]; 2], [[zero; 8]; 2]);
        let first = next;
        for map in 0..CAP_MAPS {
            for part in 0..2 {
                plus[part][CLASSES * map] = first[map][0][part];
            }
        }
        for r in 1..=CLASSES {
            // orders 4k − 3 … 4k, of which the last begins the next group
            let Some(m) = (CLASSES * k + r).checked_sub(CLASSES) else {
                continue;
            };
            if m >= orders {
                for map in 0..CAP_MAPS {
                    next[map] = [[zero; 2]; 2];
                }
                continue;
            }
            let rotation = phase::<L>(token, m, table)?;
            for map in 0..CAP_MAPS {
                let Some(place) = places[map].get(m / ORDERS) else {
                    continue;
                };
                if let Some(tile) = places[map].get(m / ORDERS + 1).and_then(|&p| tiles.get(p)) {
                    prefetch::<L>(token, &tile[m % ORDERS]);
                }
                let block = &tiles.get(*place)?[m % ORDERS];
                let [z, opposite] = harmonics::<L>(token, block, m, rotation);
                if r == CLASSES {
                    next[map] = [z, opposite];
                    for part in 0..2 {
                        minus[part][CLASSES * map] = opposite[part];
                    }
                } else {
                    for part in 0..2 {
                        plus[part][CLASSES * map + r] = z[part];
                        minus[part][CLASSES * map + CLASSES - r] = opposite[part];
                    }
                }
            }
        }
        let Some(k) = k.checked_sub(1) else { continue };
        for part in 0..2 {
            plus[part] = L::transpose(token, plus[part]);
            minus[part] = L::transpose(token, minus[part]);
        }
        for lane in 0..8 {
            let Some(walk) = &mut walks[lane] else {
                continue;
            };
            let add = !walk.distinct(groups);
            let ([up, down], factors) = walk.next(k);
            let (p, m) = (
                [plus[0][lane], plus[1][lane]],
                [minus[0][lane], minus[1][lane]],
            );
            put::<L>(token, p, add, factors[0], data.get_mut(up)?);
            put::<L>(token, m, add, factors[1], data.get_mut(down)?);
        }
    }
    Some(())
}

/// F_m of a block of ring pairs of up to two maps → the harmonics of their quarters at their places, for
/// [`Fourier::backward`].
///
/// | argument | shape | what |
/// | --- | --- | --- |
/// | `places`, `orders` | per map: orders/8 | tiles of orders 8k … 8k + 7; none for a map that is not there |
/// | `table` | | from [`super::phase_table`] |
/// | `rings` | 8 | the rings of the block |
/// | `data` | [`cap_room`] | ring after ring; its points begin after a margin of [`MARGIN`] |
///
/// # Errors
/// [`Error::Length`] unless `data` and factors are as long as the rings say and there is a place within `tiles` for all orders.
pub fn cap_spectrum_from_phases(
    level: Level,
    tiles: &[PhaseTile],
    (places, orders): ([&[usize]; CAP_MAPS], usize),
    table: &[PhaseTable],
    rings: &CapRings<'_>,
    data: &mut [Eight],
) -> Result<(), Error> {
    check(rings, data.len(), orders)?;
    for places in places {
        if !places.is_empty() {
            check_places(tiles, places, orders)?;
        }
    }
    crate::dispatch!(level, |token: L| spectrum_body::<L>(
        token,
        tiles,
        (places, orders),
        table,
        rings,
        data
    ));
    Ok(())
}

#[inline(always)]
fn phases_body<L: Lanes>(
    token: L::Token,
    data: &[Eight],
    rings: &CapRings<'_>,
    scale: &[f64; 8],
    table: &[PhaseTable],
    (tiles, orders): ([&mut [&mut PhaseTile]; CAP_MAPS], usize),
    stores: Stores,
) -> Option<()> {
    let zero = L::splat(token, 0.0);
    let scale = L::load(token, scale) * L::splat(token, 0.5);
    let mut walks = Walk::all(rings);
    let mut opposite = [[zero; 2]; CAP_MAPS];
    let missing = tiles.each_ref().map(|tiles| tiles.is_empty());
    let mut blocks = tiles.map(|tiles| {
        clear_orders(tiles, orders);
        Writer::new(token, tiles, stores)
    });
    for k in 0..orders.div_ceil(CLASSES) {
        let (mut plus, mut minus) = ([[zero; 8]; 2], [[zero; 8]; 2]);
        for lane in 0..8 {
            let Some(walk) = &mut walks[lane] else {
                continue;
            };
            let ([up, down], factors) = walk.next(k);
            let (p, m) = (data.get(up)?, data.get(down)?);
            for part in 0..2 {
                plus[part][lane] = L::load(token, &p[part]) * L::splat(token, factors[0]);
                minus[part][lane] = L::load(token, &m[part]) * L::splat(token, factors[1]);
            }
        }
        for part in 0..2 {
            plus[part] = L::transpose(token, plus[part]);
            minus[part] = L::transpose(token, minus[part]);
        }
        for r in 0..CLASSES {
            let m = CLASSES * k + r;
            if m >= orders {
                break;
            }
            let (c, s) = phase::<L>(token, m, table)?;
            for map in 0..CAP_MAPS {
                if missing[map] {
                    continue;
                }
                let at = CLASSES * map;
                let z = [plus[0][at + r], plus[1][at + r]];
                let other = match (m, r) {
                    (0, _) => z,
                    (_, 0) => opposite[map],
                    _ => [minus[0][at + CLASSES - r], minus[1][at + CLASSES - r]],
                };
                let values = order::<L>(token, [z, other], m, (c * scale, s * scale));
                blocks[map].put(m, values)?;
            }
        }
        for map in 0..CAP_MAPS {
            opposite[map] = [minus[0][CLASSES * map], minus[1][CLASSES * map]];
        }
    }
    Some(())
}

/// The transpose of [`cap_spectrum_from_phases`]: harmonics from [`Fourier::forward`] → tiles of F_m of each map, in the
/// order of m (none for a map that is not there); orders beyond `orders` in the last one become zero. `stores`: how tiles
/// are written.
///
/// # Errors
/// [`Error::Length`] unless `data` and factors are as long as the rings say and `tiles` hold `orders`.
pub fn phases_from_cap_spectrum(
    level: Level,
    data: &[Eight],
    rings: &CapRings<'_>,
    scale: &[f64; 8],
    table: &[PhaseTable],
    (tiles, orders): ([&mut [&mut PhaseTile]; CAP_MAPS], usize),
    stores: Stores,
) -> Result<(), Error> {
    check(rings, data.len(), orders)?;
    for tiles in &tiles {
        if !tiles.is_empty() {
            Error::check_len("phases", orders.div_ceil(ORDERS), tiles.len())?;
        }
    }
    crate::dispatch!(level, |token: L| phases_body::<L>(
        token,
        data,
        rings,
        scale,
        table,
        (tiles, orders),
        stores
    ));
    Ok(())
}
