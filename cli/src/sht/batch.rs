//! Eight orders: a_lm ↔ tiles of F_m on the rings of the map.
//!
//! Where the plan has equidistant rings, the stage runs on these and the resampling is its other half, while the values
//! are in cache. Else the rings are those of the map, and the kernels work on the tiles themselves. Of a batch only blocks
//! within the polar limit of its first order have tiles.

use super::equidistant::{Equidistant, ResamplingRoom};
use super::group::{Alm, Grid, Part, sound};
use super::workers::{Scratch, room};
use dust3d_kernels::fourier::Eight;
use dust3d_kernels::sht::{
    ORDERS, PhaseBlock, PhaseIndex, PhaseTile, RingTaps, Stores, add_to_fine, grid_from_phases,
    phases_from_fine, phases_from_grid,
};
use std::ops::Range;

/// Of a block without a tile.
const NOWHERE: usize = usize::MAX;

/// Where the phases of one order lie: polar blocks of all channels, then the others.
#[derive(Clone, Copy)]
pub(super) struct Places<'a> {
    places: &'a [usize],
    offset: usize,
    /// How synthesis leaves them there.
    stores: Stores,
}

impl<'a> Places<'a> {
    /// Of so many polar entries, and of the others with channels from `divided` on times sin²θ.
    pub(super) fn split(self, polar: usize, divided: usize) -> [PhaseIndex<'a>; 2] {
        let (polar, main) = self.places.split_at(polar);
        [(polar, usize::MAX), (main, divided)].map(|(places, divided)| PhaseIndex {
            places: Some(places),
            offset: self.offset,
            divided,
            stores: self.stores,
        })
    }
}

impl Part<'_> {
    /// Collects the places of (channel, block) in the order the kernels want.
    fn places(
        &self,
        grid: Grid<'_>,
        places: &mut Vec<usize>,
        place: impl Fn(usize, usize) -> usize,
    ) {
        places.clear();
        for blocks in [0..grid.polar, grid.polar..grid.rings.len()] {
            for channel in 0..self.channels.count() {
                places.extend(blocks.clone().map(|block| place(channel, block)));
            }
        }
    }

    /// Collects the places in rows, those of an order by (channel, block), and gives the length of a row.
    fn row_places(&self, grid: Grid<'_>, places: &mut Vec<usize>) -> usize {
        let blocks = grid.rings.len();
        self.places(grid, places, |channel, block| channel * blocks + block);
        self.channels.count() * blocks
    }

    /// Collects the places of the first order in the tiles (channel, active block) of a batch.
    fn tile_places(&self, grid: Grid<'_>, active: &Range<usize>, places: &mut Vec<usize>) {
        let first = active.start - self.range.start;
        self.places(grid, places, |channel, block| {
            match block.checked_sub(first) {
                Some(b) => ORDERS * (channel * active.len() + b),
                None => NOWHERE,
            }
        });
    }

    /// Sets what the Legendre stage leaves out to zero: rings beyond the polar limit, orders beyond lmax. `step`: from an
    /// order to the next.
    fn clear(
        &self,
        grid: Grid<'_>,
        batch: usize,
        (places, step): (&[usize], usize),
        out: &mut [PhaseBlock],
    ) {
        let count = self.channels.count();
        let (polar, main) = places.split_at(count * grid.polar);
        for j in 0..ORDERS {
            let m = ORDERS * batch + j;
            let idle = if m > self.lmax {
                grid.rings.len()
            } else {
                grid.rings.partition_point(|r| r.m_limit < m)
            };
            for (places, blocks, idle) in [
                (polar, grid.polar, idle.min(grid.polar)),
                (
                    main,
                    grid.rings.len() - grid.polar,
                    idle.saturating_sub(grid.polar),
                ),
            ] {
                for channel in places.chunks_exact(blocks.max(1)) {
                    for &place in &channel[..idle] {
                        if let Some(block) = out.get_mut(place.saturating_add(j * step)) {
                            *block = PhaseBlock::default();
                        }
                    }
                }
            }
        }
    }

    /// a_lm of eight orders → tiles (channel, active block), those of the channels in hand.
    pub(super) fn batch(
        &self,
        own: &mut Scratch,
        batch: usize,
        alms: &[&[Alm]],
        tiles: &mut [PhaseTile],
    ) {
        let active = self.active(batch);
        if active.is_empty() {
            return;
        }
        let Range { start, end } = self.in_hand();
        let alms = &alms[start..end];
        let tiles = &mut tiles[start * active.len()..end * active.len()];
        let grid = self.grid(batch);
        let mut places = std::mem::take(&mut own.places);
        if let Some(equidistant) = grid.equidistant {
            let row = self.row_places(grid, &mut places);
            let mut all = std::mem::take(&mut own.rows);
            let rows = room(&mut all, ORDERS * row);
            self.orders(own, grid, batch, alms, (&places, row), rows);
            let taps = &equidistant.taps[active.clone()];
            for (channel, tiles) in tiles.chunks_exact_mut(active.len()).enumerate() {
                let rows = &rows[channel * grid.rings.len()..];
                self.refine(equidistant, &mut own.resampling, (rows, row), taps, tiles);
            }
            own.rows = all;
        } else {
            self.tile_places(grid, &active, &mut places);
            let tiles = tiles.as_flattened_mut();
            self.orders(own, grid, batch, alms, (&places, 1), tiles);
        }
        own.places = places;
    }

    /// Tiles (channel, active block) → a_lm of eight orders, those of the channels in hand, added or, if `fresh`, in place
    /// of what is there.
    pub(super) fn batch_adjoint(
        &self,
        own: &mut Scratch,
        batch: usize,
        tiles: &[PhaseTile],
        alms: &mut [Vec<&mut [Alm]>],
        fresh: bool,
    ) {
        let active = self.active(batch);
        if active.is_empty() {
            if fresh {
                let all = alms.iter_mut().flat_map(|a| &mut a[self.in_hand()]);
                all.for_each(|a| a.fill(Alm::default()));
            }
            return;
        }
        let grid = self.grid(batch);
        let Range { start, end } = self.in_hand();
        let tiles = &tiles[start * active.len()..end * active.len()];
        let mut places = std::mem::take(&mut own.places);
        if let Some(equidistant) = grid.equidistant {
            let row = self.row_places(grid, &mut places);
            let mut all = std::mem::take(&mut own.rows);
            let rows = room(&mut all, ORDERS * row);
            let taps = &equidistant.taps[active.clone()];
            for (channel, tiles) in tiles.chunks_exact(active.len()).enumerate() {
                let rows = &mut rows[channel * grid.rings.len()..];
                self.coarsen(equidistant, &mut own.resampling, (tiles, taps), (rows, row));
            }
            self.orders_adjoint(own, grid, batch, (&places, row), rows, alms, fresh);
            own.rows = all;
        } else {
            self.tile_places(grid, &active, &mut places);
            let tiles = tiles.as_flattened();
            self.orders_adjoint(own, grid, batch, (&places, 1), tiles, alms, fresh);
        }
        own.places = places;
    }

    /// The Legendre stage of the orders of a batch; `step`: from the phases of one to those of the next.
    fn orders(
        &self,
        own: &mut Scratch,
        grid: Grid<'_>,
        batch: usize,
        alms: &[&[Alm]],
        (places, step): (&[usize], usize),
        out: &mut [PhaseBlock],
    ) {
        self.clear(grid, batch, (places, step), out);
        // rows of equidistant rings are read at once
        let stores = match grid.equidistant {
            Some(_) => Stores::Cached,
            None => self.stores,
        };
        let first = ORDERS * batch;
        for j in 0..ORDERS.min(self.lmax + 1 - first) {
            let offset = j * step;
            let to = Places {
                places,
                offset,
                stores,
            };
            self.legendre(own, grid, first + j, alms, to, out);
        }
    }

    /// The transpose of [`orders`](Self::orders).
    fn orders_adjoint(
        &self,
        own: &mut Scratch,
        grid: Grid<'_>,
        batch: usize,
        (places, step): (&[usize], usize),
        phases: &[PhaseBlock],
        alms: &mut [Vec<&mut [Alm]>],
        fresh: bool,
    ) {
        for (j, alms) in alms.iter_mut().enumerate() {
            let offset = j * step;
            let from = Places {
                places,
                offset,
                stores: Stores::Cached,
            };
            let m = ORDERS * batch + j;
            let alms = &mut alms[self.in_hand()];
            self.legendre_adjoint(own, grid, m, from, phases, alms, fresh);
        }
    }

    /// F_m of one channel on the equidistant rings, `step` blocks from one order to the next → on those of the map.
    fn refine(
        &self,
        equidistant: &Equidistant,
        own: &mut ResamplingRoom,
        (rows, step): (&[PhaseBlock], usize),
        taps: &[RingTaps],
        tiles: &mut [PhaseTile],
    ) {
        let (coarse, fine, scratch) = equidistant.room(own);
        sound(grid_from_phases(
            self.level,
            rows,
            step,
            &equidistant.carriers,
            coarse,
        ));
        let resampling = equidistant.resampling();
        sound(resampling.refine(self.level, coarse, fine, scratch));
        let tiles = tiles.as_flattened_mut();
        sound(phases_from_fine(self.level, fine, taps, tiles, self.stores));
    }

    /// The transpose of [`refine`](Self::refine).
    fn coarsen(
        &self,
        equidistant: &Equidistant,
        own: &mut ResamplingRoom,
        (tiles, taps): (&[PhaseTile], &[RingTaps]),
        (rows, step): (&mut [PhaseBlock], usize),
    ) {
        let (coarse, fine, scratch) = equidistant.room(own);
        // zeros from both ends to where the windows have come, while that is in cache
        let len = fine.len();
        let mut cleared = 0;
        for (b, (tile, taps)) in tiles.iter().zip(taps).enumerate() {
            let next = tiles.get(b + 1).unwrap_or(tile);
            let end = taps.end().min(len.div_ceil(2));
            if end > cleared {
                fine[cleared..end].fill(Eight::default());
                fine[len - end..len - cleared].fill(Eight::default());
                cleared = end;
            }
            sound(add_to_fine(self.level, tile, next, taps, fine));
        }
        fine[cleared..(len - cleared).max(cleared)].fill(Eight::default());
        let resampling = equidistant.resampling();
        sound(resampling.coarsen(self.level, fine, coarse, scratch));
        sound(phases_from_grid(
            self.level,
            coarse,
            &equidistant.carriers,
            rows,
            step,
        ));
    }
}
