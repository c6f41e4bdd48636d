//! Equidistant rings for the Legendre stage, where they are fewer than those of the map.

use dust3d_kernels::Error;
use dust3d_kernels::fourier::{Eight, Fourier};
use dust3d_kernels::sht::{
    Carrier, MARGIN, Resampling, RingBlock, RingTaps, equidistant_carriers,
    equidistant_ring_blocks, resampling_factors, resampling_lengths, ring_taps,
};

/// Below this lmax what is saved is less than what the resampling costs.
const LEAST_LMAX: usize = 400;

/// A transform across lanes with its table.
pub(super) struct Ready {
    pub(super) fourier: Fourier,
    pub(super) table: Vec<[f64; 2]>,
}

impl Ready {
    pub(super) fn new(n: usize) -> Option<Self> {
        let fourier = Fourier::new(n)?;
        let mut table = vec![[0.0; 2]; fourier.table_len()];
        fourier.fill_table(&mut table);
        Some(Self { fourier, table })
    }
}

/// The equidistant rings of an lmax, and the way to the rings of the map.
pub(super) struct Equidistant {
    pub(super) rings: Vec<RingBlock>,
    pub(super) carriers: Vec<Carrier>,
    pub(super) taps: Vec<RingTaps>,
    lmax: usize,
    coarse: Ready,
    fine: Ready,
    factors: Vec<[f64; 2]>,
}

impl Equidistant {
    /// None where the rings of the map are too few to gain by it: depends on Nside and lmax alone.
    pub(super) fn new(nside: u64, lmax: usize, blocks: usize) -> Result<Option<Self>, Error> {
        let (n, m) = resampling_lengths(lmax);
        let rings = 4 * nside - 1;
        if lmax < LEAST_LMAX || 10 * n as u64 > 7 * rings {
            return Ok(None);
        }
        let (Some(coarse), Some(fine)) = (Ready::new(n), Ready::new(m)) else {
            return Ok(None);
        };
        let mut equidistant = Self {
            rings: vec![RingBlock::default(); n.div_ceil(16)],
            carriers: vec![Carrier::default(); n.div_ceil(16)],
            taps: vec![RingTaps::default(); blocks],
            lmax,
            coarse,
            fine,
            factors: vec![[0.0; 2]; lmax + 1],
        };
        equidistant_ring_blocks(n, lmax, &mut equidistant.rings)?;
        equidistant_carriers(n, &mut equidistant.carriers);
        ring_taps(nside, lmax, m, &mut equidistant.taps)?;
        resampling_factors(lmax, (n, m), &mut equidistant.factors);
        Ok(Some(equidistant))
    }

    pub(super) fn resampling(&self) -> Resampling<'_> {
        Resampling {
            lmax: self.lmax,
            coarse: &self.coarse.fourier,
            coarse_table: &self.coarse.table,
            fine: &self.fine.fourier,
            fine_table: &self.fine.table,
            factors: &self.factors,
        }
    }

    /// Makes room for one channel of eight orders.
    pub(super) fn reserve(&self, room: &mut ResamplingRoom) {
        room.reserve(&self.coarse.fourier);
        room.reserve(&self.fine.fourier);
        room.coarse
            .resize(self.coarse.fourier.len(), Eight::default());
    }

    /// Points of the fine grid with its margins.
    pub(super) fn fine_len(&self) -> usize {
        self.fine.fourier.len() + 2 * MARGIN
    }
}

/// Room of one worker for transforms across lanes.
#[derive(Default)]
pub(super) struct ResamplingRoom {
    pub(super) coarse: Vec<Eight>,
    pub(super) fine: Vec<Eight>,
    pub(super) scratch: Vec<Eight>,
}

impl ResamplingRoom {
    /// Makes room for a transform in `fine`, with margins.
    pub(super) fn reserve(&mut self, fourier: &Fourier) {
        let (fine, scratch) = (fourier.len() + 2 * MARGIN, fourier.scratch_len());
        if self.fine.len() < fine {
            self.fine.resize(fine, Eight::default());
        }
        if self.scratch.len() < scratch {
            self.scratch.resize(scratch, Eight::default());
        }
    }
}
