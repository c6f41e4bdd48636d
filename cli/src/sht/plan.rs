//! The plan: everything that does not change from transform to transform.

use super::caps::Caps;
use super::equidistant::{Equidistant, Ready};
use super::group::Channels;
use super::orders::Orders;
use super::workers::Scratch;
use dust3d_kernels::Error;
use dust3d_kernels::healpix::Nside;
use dust3d_kernels::sht::{
    PhaseBlock, PhaseTable, PhaseTile, RingBlock, RingShapes, alm, phase_table, phase_table_len,
    ring_block_count, ring_blocks,
};
use dust3d_kernels::simd::Level;
use num_complex::Complex;
use std::fmt;

/// Below this sin²θ spin 2 runs on the spin-weighted functions instead of dividing by sin²θ. At colatitude 0.03 both
/// have the same error (2e-14 at l = 4096); this is nearly twice as far.
pub(super) const SPIN_POLE: f64 = 0.0025;

/// Bytes of phases held at once for three channels; larger transforms go through the rings in parts, unless their
/// Legendre stage runs on equidistant rings: these would have to be done again for every part.
const PHASE_BYTES: usize = 400 << 20;

/// Rings, recurrence tables, Fourier transforms and workspace of the transforms of one Nside and lmax.
///
/// Workspace is allocated by the first transform that needs it and reused. At Nside 2048 and lmax 4096 it is 0.35 GB for
/// each real map of a group, by far the most of what a plan takes: with maps and coefficients 1.8 GB for spin 2. A plan is
/// used by one transform at a time (`&mut self`), which divides its work among the threads of the caller's rayon pool.
pub struct ShtPlan {
    pub(super) nside: Nside,
    pub(super) lmax: usize,
    pub(super) level: Level,
    pub(super) geometry: Geometry,
    pub(super) orders: Orders,
    pub(super) tiles: Vec<PhaseTile>,
    pub(super) workers: Vec<Scratch>,
    pub(super) ring_weights: Option<Vec<[f64; 8]>>,
}

/// Rings of the map in blocks of eight pairs.
pub(super) struct Geometry {
    pub(super) rings: Vec<RingBlock>,
    pub(super) shapes: Vec<RingShapes>,
    /// Pixels of the northern and southern rings of each block.
    pub(super) pixels: Vec<(usize, usize)>,
    /// Leading blocks on which spin 2 uses the spin-weighted functions.
    pub(super) polar: usize,
    /// Rings of the Legendre stage of the lower orders where they are not those of the map.
    pub(super) equidistant: Option<Equidistant>,
    /// Blocks per part.
    pub(super) part: usize,
    /// Is there room for the phases of two groups?
    together: bool,
    /// e^{imφ₀} of each block.
    pub(super) phase_tables: Vec<PhaseTable>,
    pub(super) phase_table_len: usize,
    /// Transforms of the rings of the caps.
    pub(super) caps: Caps,
    /// Transform of eight rings of the belt at once, where their length allows.
    belt: Option<Ready>,
}

impl Geometry {
    fn new(nside: u64, lmax: usize) -> Result<Self, Error> {
        let count = ring_block_count(nside);
        let mut rings = vec![RingBlock::default(); count];
        ring_blocks(nside, lmax, &mut rings)?;
        let shapes: Vec<_> = (0..count).map(|b| RingShapes::healpix(nside, b)).collect();
        let equator = 4 * nside as usize;
        let pixels = shapes
            .iter()
            .enumerate()
            .map(|(b, s)| {
                let north = s.pixels.iter().sum();
                // the last ring is the equator, which has no southern partner
                let south = if b + 1 == count {
                    north - equator
                } else {
                    north
                };
                (north, south)
            })
            .collect();
        let table_len = phase_table_len(lmax);
        let mut tables = vec![PhaseTable::default(); table_len * count];
        for (table, s) in tables.chunks_exact_mut(table_len).zip(&shapes) {
            phase_table(s, table);
        }
        let per_block = (lmax + 1) * 3 * size_of::<PhaseBlock>();
        let equidistant = Equidistant::new(nside, lmax, &rings)?;
        let belt = Ready::new(equator);
        let caps = Caps::new(rings.iter().zip(&shapes).map(|(ring, shape)| {
            let cap = !in_belt(belt.as_ref(), shape);
            (ring.m_limit.min(lmax) + 1, cap.then_some(shape))
        }));
        Ok(Self {
            polar: rings.partition_point(|r| r.sin2_min < SPIN_POLE),
            together: 2 * per_block * count <= PHASE_BYTES,
            part: match equidistant {
                // every ring comes from all equidistant ones
                Some(_) => count,
                None => (PHASE_BYTES / per_block).clamp(1, count),
            },
            equidistant,
            rings,
            shapes,
            pixels,
            phase_tables: tables,
            phase_table_len: table_len,
            caps,
            belt,
        })
    }

    /// The transform of a block of eight rings of the belt.
    pub(super) fn belt(&self, block: usize) -> Option<&Ready> {
        self.belt
            .as_ref()
            .filter(|belt| in_belt(Some(belt), &self.shapes[block]))
    }

    /// The table e^{imφ₀} of a block.
    pub(super) fn phase_table(&self, block: usize) -> &[PhaseTable] {
        &self.phase_tables[block * self.phase_table_len..(block + 1) * self.phase_table_len]
    }
}

/// Have all rings of a block the length of the belt's?
fn in_belt(belt: Option<&Ready>, shapes: &RingShapes) -> bool {
    belt.is_some_and(|belt| shapes.pixels.iter().all(|&n| n == belt.fourier.len()))
}

impl fmt::Debug for ShtPlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ShtPlan")
            .field("nside", &self.nside)
            .field("lmax", &self.lmax)
            .field("level", &self.level)
            .finish_non_exhaustive()
    }
}

impl ShtPlan {
    /// A plan for maps of `nside` and coefficients up to `lmax` (any from 0; mmax = lmax).
    ///
    /// Beyond lmax = 2 Nside a HEALPix map does not determine its coefficients; synthesis and its adjoint are exact at
    /// any lmax.
    ///
    /// # Errors
    /// [`Error::Nside`] above 2^20.
    pub fn new(nside: Nside, lmax: usize, level: Level) -> Result<Self, Error> {
        let geometry = Geometry::new(nside.get(), lmax)?;
        let limit = |rings: &[RingBlock]| rings.last().map_or(0, |r| r.m_limit);
        let wigner_limit = limit(&geometry.rings[..geometry.polar]).max(
            geometry
                .equidistant
                .as_ref()
                .map_or(0, |e| limit(&e.rings[..e.polar])),
        );
        Ok(Self {
            nside,
            lmax,
            level,
            orders: Orders::new(lmax, wigner_limit),
            geometry,
            tiles: Vec::new(),
            workers: Vec::new(),
            ring_weights: None,
        })
    }

    /// Resolution of the maps.
    #[must_use]
    pub const fn nside(&self) -> Nside {
        self.nside
    }

    /// Greatest degree and order.
    #[must_use]
    pub const fn lmax(&self) -> usize {
        self.lmax
    }

    /// Vector instructions used.
    #[must_use]
    pub const fn level(&self) -> Level {
        self.level
    }

    /// Length of a set of coefficients.
    #[must_use]
    pub const fn alm_len(&self) -> usize {
        alm::len(self.lmax)
    }

    /// Length of a map.
    #[must_use]
    pub const fn npix(&self) -> usize {
        self.nside.npix() as usize
    }

    fn check(&self, maps: &[usize], alms: &[usize]) -> Result<(), Error> {
        for &len in maps {
            Error::check_len("map", self.npix(), len)?;
        }
        for &len in alms {
            Error::check_len("coefficients", self.alm_len(), len)?;
        }
        Ok(())
    }

    /// f(p) = Σ_lm a_lm Y_lm(p), m < 0 understood. The imaginary parts of a_l0 are not used.
    ///
    /// # Errors
    /// [`Error::Length`] unless `alm` and `map` fit the plan.
    pub fn synthesis(&mut self, alm: &[Complex<f64>], map: &mut [f64]) -> Result<(), Error> {
        self.synthesis_mixed(&[alm], &[], &mut [map], &mut [])
    }

    /// (Q, U) of E and B, COSMO convention, with healpy's signs (`alm2map_spin([E, B], …, spin=2)`).
    ///
    /// Degrees below 2 and the imaginary parts of m = 0 are not used.
    ///
    /// # Errors
    /// [`Error::Length`] unless all fit the plan.
    pub fn synthesis_spin2(
        &mut self,
        e: &[Complex<f64>],
        b: &[Complex<f64>],
        q: &mut [f64],
        u: &mut [f64],
    ) -> Result<(), Error> {
        self.synthesis_mixed(&[], &[[e, b]], &mut [], &mut [[q, u]])
    }

    /// [`synthesis`](Self::synthesis) of several maps at once.
    ///
    /// # Errors
    /// [`Error::Length`] unless all fit the plan and each other in number.
    pub fn synthesis_batch(
        &mut self,
        alms: &[&[Complex<f64>]],
        maps: &mut [&mut [f64]],
    ) -> Result<(), Error> {
        self.synthesis_mixed(alms, &[], maps, &mut [])
    }

    /// [`synthesis_spin2`](Self::synthesis_spin2) of several pairs at once.
    ///
    /// # Errors
    /// [`Error::Length`] unless all fit the plan and each other in number.
    pub fn synthesis_spin2_batch(
        &mut self,
        eb: &[[&[Complex<f64>]; 2]],
        qu: &mut [[&mut [f64]; 2]],
    ) -> Result<(), Error> {
        self.synthesis_mixed(&[], eb, &mut [], qu)
    }

    /// Scalar maps and spin-2 pairs at once; fastest where there are as many of both (I, Q, U of layers).
    ///
    /// Every map has the bits it would have alone.
    ///
    /// # Errors
    /// [`Error::Length`] unless all fit the plan and each other in number.
    pub fn synthesis_mixed(
        &mut self,
        alms: &[&[Complex<f64>]],
        eb: &[[&[Complex<f64>]; 2]],
        maps: &mut [&mut [f64]],
        qu: &mut [[&mut [f64]; 2]],
    ) -> Result<(), Error> {
        Error::check_len("scalar maps", alms.len(), maps.len())?;
        Error::check_len("spin-2 maps", eb.len(), qu.len())?;
        for (a, map) in alms.iter().zip(maps.iter()) {
            self.check(&[map.len()], &[a.len()])?;
        }
        for ([e, b], [q, u]) in eb.iter().zip(qu.iter()) {
            self.check(&[q.len(), u.len()], &[e.len(), b.len()])?;
        }
        let (mut alms, mut eb) = (alms.iter(), eb.iter());
        let (mut maps, mut qu) = (maps.iter_mut(), qu.iter_mut());
        for group in Channels::groups(alms.len(), eb.len(), self.geometry.together) {
            let (mut from, mut to) = (Vec::new(), Vec::<&mut [f64]>::new());
            for channels in &group {
                from.extend(alms.by_ref().take(channels.scalars).copied());
                from.extend(eb.by_ref().take(channels.pairs).flatten().copied());
                to.extend(maps.by_ref().take(channels.scalars).map(|m| &mut **m));
                to.extend(qu.by_ref().take(channels.pairs).flatten().map(|m| &mut **m));
            }
            self.synthesise_group(&group, &from, &mut to);
        }
        Ok(())
    }

    /// a_lm = Σ_p Y*_lm(p) map(p): the transpose of [`synthesis`](Self::synthesis) (m > 0 counted twice in products).
    ///
    /// # Errors
    /// [`Error::Length`] unless `alm` and `map` fit the plan.
    pub fn adjoint_synthesis(
        &mut self,
        map: &[f64],
        alm: &mut [Complex<f64>],
    ) -> Result<(), Error> {
        self.adjoint_synthesis_mixed(&[map], &[], &mut [alm], &mut [])
    }

    /// The transpose of [`synthesis_spin2`](Self::synthesis_spin2).
    ///
    /// # Errors
    /// [`Error::Length`] unless all fit the plan.
    pub fn adjoint_synthesis_spin2(
        &mut self,
        q: &[f64],
        u: &[f64],
        e: &mut [Complex<f64>],
        b: &mut [Complex<f64>],
    ) -> Result<(), Error> {
        self.adjoint_synthesis_mixed(&[], &[[q, u]], &mut [], &mut [[e, b]])
    }

    /// [`adjoint_synthesis`](Self::adjoint_synthesis) of several maps at once.
    ///
    /// # Errors
    /// [`Error::Length`] unless all fit the plan and each other in number.
    pub fn adjoint_synthesis_batch(
        &mut self,
        maps: &[&[f64]],
        alms: &mut [&mut [Complex<f64>]],
    ) -> Result<(), Error> {
        self.adjoint_synthesis_mixed(maps, &[], alms, &mut [])
    }

    /// [`adjoint_synthesis_spin2`](Self::adjoint_synthesis_spin2) of several pairs at once.
    ///
    /// # Errors
    /// [`Error::Length`] unless all fit the plan and each other in number.
    pub fn adjoint_synthesis_spin2_batch(
        &mut self,
        qu: &[[&[f64]; 2]],
        eb: &mut [[&mut [Complex<f64>]; 2]],
    ) -> Result<(), Error> {
        self.adjoint_synthesis_mixed(&[], qu, &mut [], eb)
    }

    /// The transpose of [`synthesis_mixed`](Self::synthesis_mixed).
    ///
    /// # Errors
    /// [`Error::Length`] unless all fit the plan and each other in number.
    pub fn adjoint_synthesis_mixed(
        &mut self,
        maps: &[&[f64]],
        qu: &[[&[f64]; 2]],
        alms: &mut [&mut [Complex<f64>]],
        eb: &mut [[&mut [Complex<f64>]; 2]],
    ) -> Result<(), Error> {
        self.weighted_adjoint(maps, qu, alms, eb, None)
    }

    /// The adjoint with every ring pair multiplied by its weight.
    pub(super) fn weighted_adjoint(
        &mut self,
        maps: &[&[f64]],
        qu: &[[&[f64]; 2]],
        alms: &mut [&mut [Complex<f64>]],
        eb: &mut [[&mut [Complex<f64>]; 2]],
        weights: Option<&[[f64; 8]]>,
    ) -> Result<(), Error> {
        Error::check_len("scalar coefficients", maps.len(), alms.len())?;
        Error::check_len("spin-2 coefficients", qu.len(), eb.len())?;
        for (a, map) in alms.iter().zip(maps.iter()) {
            self.check(&[map.len()], &[a.len()])?;
        }
        for ([e, b], [q, u]) in eb.iter().zip(qu.iter()) {
            self.check(&[q.len(), u.len()], &[e.len(), b.len()])?;
        }
        let (mut maps, mut qu) = (maps.iter(), qu.iter());
        let (mut alms, mut eb) = (alms.iter_mut(), eb.iter_mut());
        for group in Channels::groups(maps.len(), qu.len(), self.geometry.together) {
            let (mut from, mut to) = (Vec::new(), Vec::<&mut [Complex<f64>]>::new());
            for channels in &group {
                from.extend(maps.by_ref().take(channels.scalars).copied());
                from.extend(qu.by_ref().take(channels.pairs).flatten().copied());
                to.extend(alms.by_ref().take(channels.scalars).map(|a| &mut **a));
                to.extend(eb.by_ref().take(channels.pairs).flatten().map(|a| &mut **a));
            }
            self.adjoint_group(&group, weights, &from, &mut to);
        }
        Ok(())
    }
}
