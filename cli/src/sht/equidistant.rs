//! Equidistant rings for the Legendre stage, where they are fewer than those of the map.

use super::plan::SPIN_POLE;
use super::workers::room;
use dust3d_kernels::Error;
use dust3d_kernels::fourier::{Eight, Fourier};
use dust3d_kernels::sht::{
    CapRing, Carrier, MARGIN, ORDERS, Resampling, RingBlock, RingTaps, equidistant_carriers,
    equidistant_ring_blocks, resampling_factors, resampling_lengths, ring_taps,
};

/// Do the orders of a batch from m on gain by equidistant rings, n of them and a fine grid of `fine` points?
///
/// In cycles, measured with AVX-512: 3.6 for a step of the recurrence on a block with its sums, 4 k log₂ k for eight
/// transforms of length k, 600 to interpolate one block of the map (more than copying it takes).
fn gains(
    lmax: usize,
    (n, fine): (usize, usize),
    m: usize,
    (map, rings): (&[RingBlock], &[RingBlock]),
) -> bool {
    let active = |rings: &[RingBlock]| rings.len() - rings.partition_point(|r| r.m_limit < m);
    let (many, few) = (active(map), active(rings));
    let saved = 36 * ORDERS * ((lmax - m) / 2) * many.saturating_sub(few) / 10;
    let transform = |k: usize| 4 * k * (k.ilog2() as usize + 1);
    saved > transform(n) + transform(fine) + 600 * many
}

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
    /// Leading blocks on which spin 2 uses the spin-weighted functions.
    pub(super) polar: usize,
    /// Batches of orders that gain by it; the higher ones have few degrees and stay on the rings of the map.
    pub(super) batches: usize,
    pub(super) carriers: Vec<Carrier>,
    pub(super) taps: Vec<RingTaps>,
    lmax: usize,
    coarse: Ready,
    fine: Ready,
    factors: Vec<[f64; 2]>,
}

impl Equidistant {
    /// None where no order gains by it: depends on Nside and lmax alone. `map`: rings of the map.
    pub(super) fn new(nside: u64, lmax: usize, map: &[RingBlock]) -> Result<Option<Self>, Error> {
        let (n, m) = resampling_lengths(lmax);
        if n as u64 >= 4 * nside {
            return Ok(None);
        }
        let mut rings = vec![RingBlock::default(); n.div_ceil(16)];
        equidistant_ring_blocks(n, lmax, &mut rings)?;
        let gains = |batch: usize| gains(lmax, (n, m), ORDERS * batch, (map, &rings));
        let batches = (0..=lmax / ORDERS).take_while(|&b| gains(b)).count();
        if batches == 0 {
            return Ok(None);
        }
        let (Some(coarse), Some(fine)) = (Ready::new(n), Ready::new(m)) else {
            return Ok(None);
        };
        let mut equidistant = Self {
            polar: rings.partition_point(|r| r.sin2_min < SPIN_POLE),
            rings,
            batches,
            carriers: vec![Carrier::default(); n.div_ceil(16)],
            taps: vec![RingTaps::default(); map.len()],
            lmax,
            coarse,
            fine,
            factors: vec![[0.0; 2]; lmax + 1],
        };
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

    /// Room for one channel of eight orders: equidistant rings, fine grid with its margins, scratch.
    pub(super) fn room<'a>(
        &self,
        own: &'a mut ResamplingRoom,
    ) -> (&'a mut [Eight], &'a mut [Eight], &'a mut [Eight]) {
        let (coarse, fine) = (&self.coarse.fourier, &self.fine.fourier);
        let scratch = coarse.scratch_len().max(fine.scratch_len());
        (
            room(&mut own.coarse, coarse.len()),
            room(&mut own.fine, fine.len() + 2 * MARGIN),
            room(&mut own.scratch, scratch),
        )
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
    /// Room for the rings of a block of the caps, and scratch for the longest.
    pub(super) fn caps(
        &mut self,
        need: usize,
        rings: &[Option<(CapRing<'_>, &Ready)>; 8],
    ) -> (&mut [Eight], &mut [Eight]) {
        let scratch = rings
            .iter()
            .flatten()
            .map(|(_, ready)| ready.fourier.scratch_len())
            .max();
        (
            room(&mut self.fine, need),
            room(&mut self.scratch, scratch.unwrap_or(0)),
        )
    }

    /// Room for one transform, and its scratch.
    pub(super) fn one(&mut self, fourier: &Fourier) -> (&mut [Eight], &mut [Eight]) {
        (
            room(&mut self.fine, fourier.len()),
            room(&mut self.scratch, fourier.scratch_len()),
        )
    }
}
