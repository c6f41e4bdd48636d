//! The Legendre stage of eight orders: a_lm ↔ tiles of F_m on the rings of the map.
//!
//! Where the plan has equidistant rings, the stage runs on these and the resampling is its other half, while the values
//! are in cache. Else the rings are those of the map, and the kernels work on the tiles themselves. Of a batch only blocks
//! within the polar limit of its first order have tiles.

use super::group::{Alm, Grid, Part, sound};
use super::orders::Order;
use super::workers::Scratch;
use dust3d_kernels::fourier::Eight;
use dust3d_kernels::sht::{
    Coefficient, Layout, ORDERS, PhaseBlock, PhaseIndex, PhaseTile, add_to_fine, adjoint,
    adjoint_scratch_len, alm, grid_from_phases, mixing_scratch_len, phases_from_fine,
    phases_from_grid, scalar_coefficients, scalar_from_sums, spin2_coefficients, spin2_from_sums,
    synthesis, wigner_adjoint, wigner_adjoint_scratch_len, wigner_coefficients, wigner_from_sums,
    wigner_synthesis,
};
use std::ops::Range;

/// Of a block without a tile.
const NOWHERE: usize = usize::MAX;

/// Where the phases of one order lie: polar blocks of all channels, then the others.
#[derive(Clone, Copy)]
struct Places<'a> {
    places: &'a [usize],
    offset: usize,
}

impl<'a> Places<'a> {
    /// Of so many polar entries, and of the others with channels from `divided` on times sin²θ.
    fn split(self, polar: usize, divided: usize) -> [PhaseIndex<'a>; 2] {
        let (polar, main) = self.places.split_at(polar);
        [(polar, usize::MAX), (main, divided)].map(|(places, divided)| PhaseIndex {
            places: Some(places),
            offset: self.offset,
            divided,
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

    /// a_lm of eight orders → tiles (channel, active block).
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
        let grid = self.grid(batch);
        let mut places = std::mem::take(&mut own.places);
        let orders = ORDERS * batch..(ORDERS * (batch + 1)).min(self.lmax + 1);
        let Some(equidistant) = grid.equidistant else {
            let first = active.start - self.range.start;
            self.places(grid, &mut places, |channel, block| {
                match block.checked_sub(first) {
                    Some(b) => ORDERS * (channel * active.len() + b),
                    None => NOWHERE,
                }
            });
            let out = tiles.as_flattened_mut();
            self.clear(grid, batch, (&places, 1), out);
            for (offset, m) in orders.enumerate() {
                let to = Places {
                    places: &places,
                    offset,
                };
                self.legendre(own, grid, m, alms, to, out);
            }
            own.places = places;
            return;
        };
        let blocks = grid.rings.len();
        let row = self.channels.count() * blocks;
        let mut rows = std::mem::take(&mut own.rows);
        rows.resize(ORDERS * row, PhaseBlock::default());
        self.places(grid, &mut places, |channel, block| channel * blocks + block);
        self.clear(grid, batch, (&places, row), &mut rows);
        for (j, m) in orders.enumerate() {
            let to = Places {
                places: &places,
                offset: j * row,
            };
            self.legendre(own, grid, m, alms, to, &mut rows);
        }
        let room = &mut own.resampling;
        equidistant.reserve(room);
        let fine = &mut room.fine[..equidistant.fine_len()];
        let layout = Layout {
            order: row,
            block: 1,
        };
        for (channel, tiles) in tiles.chunks_exact_mut(active.len()).enumerate() {
            sound(grid_from_phases(
                self.level,
                &rows[channel * blocks..],
                layout,
                &equidistant.carriers,
                0,
                &mut room.coarse,
            ));
            sound(equidistant.resampling().refine(
                self.level,
                &mut room.coarse,
                fine,
                &mut room.scratch,
            ));
            sound(phases_from_fine(
                self.level,
                fine,
                &equidistant.taps[active.clone()],
                tiles.as_flattened_mut(),
            ));
        }
        own.rows = rows;
        own.places = places;
    }

    /// Tiles (block, channel, batch) → a_lm of eight orders, added.
    pub(super) fn batch_adjoint(
        &self,
        own: &mut Scratch,
        batch: usize,
        tiles: &[PhaseTile],
        starts: &[usize],
        alms: &mut [Vec<&mut [Alm]>],
    ) {
        let active = self.active(batch);
        if active.is_empty() {
            return;
        }
        let grid = self.grid(batch);
        let tile_at = |channel: usize, block: usize| {
            starts[block - self.range.start] + channel * self.batches(block) + batch
        };
        let mut places = std::mem::take(&mut own.places);
        let Some(equidistant) = grid.equidistant else {
            self.places(grid, &mut places, |channel, block| {
                match self.range.start + block {
                    block if block < active.start => NOWHERE,
                    block => ORDERS * tile_at(channel, block),
                }
            });
            for (offset, alms) in alms.iter_mut().enumerate() {
                let from = Places {
                    places: &places,
                    offset,
                };
                let m = ORDERS * batch + offset;
                self.legendre_adjoint(own, grid, m, from, tiles.as_flattened(), alms);
            }
            own.places = places;
            return;
        };
        let blocks = grid.rings.len();
        let row = self.channels.count() * blocks;
        let mut rows = std::mem::take(&mut own.rows);
        rows.resize(ORDERS * row, PhaseBlock::default());
        let room = &mut own.resampling;
        equidistant.reserve(room);
        let fine = &mut room.fine[..equidistant.fine_len()];
        let layout = Layout {
            order: row,
            block: 1,
        };
        for channel in 0..self.channels.count() {
            fine.fill(Eight::default());
            for block in active.clone() {
                let next = (block + 1).min(active.end - 1);
                sound(add_to_fine(
                    self.level,
                    &tiles[tile_at(channel, block)],
                    &tiles[tile_at(channel, next)],
                    &equidistant.taps[block],
                    fine,
                ));
            }
            sound(equidistant.resampling().coarsen(
                self.level,
                fine,
                &mut room.coarse,
                &mut room.scratch,
            ));
            sound(phases_from_grid(
                self.level,
                &room.coarse,
                0,
                &equidistant.carriers,
                &mut rows[channel * blocks..],
                layout,
            ));
        }
        self.places(grid, &mut places, |channel, block| channel * blocks + block);
        for (j, alms) in alms.iter_mut().enumerate() {
            let from = Places {
                places: &places,
                offset: j * row,
            };
            self.legendre_adjoint(own, grid, ORDERS * batch + j, from, &rows, alms);
        }
        own.rows = rows;
        own.places = places;
    }

    /// Steps in use at order m: spin 2 reaches lmax + 2.
    fn steps(&self, m: usize) -> usize {
        let top = if self.channels.pairs > 0 {
            self.lmax + 2
        } else {
            self.lmax
        };
        (top - m) / 2 + 1
    }

    /// a_lm of order m → F_m on all rings of the part.
    fn legendre(
        &self,
        own: &mut Scratch,
        grid: Grid<'_>,
        m: usize,
        alms: &[&[Alm]],
        to: Places<'_>,
        out: &mut [PhaseBlock],
    ) {
        let order = self.orders.get(m, self.channels.pairs > 0, &mut own.tables);
        let Order { epsilon, steps, .. } = order;
        let (scalars, count) = (self.channels.scalars, self.channels.count());
        let (polar, main) = grid.rings.split_at(grid.polar);
        let [to_polar, to_main] = to.split(count * grid.polar, scalars);
        let first = alm::index(self.lmax, m, m);
        let of_order = |a: &'_ [Alm]| -> Range<usize> {
            debug_assert_eq!(a.len(), alm::len(self.lmax));
            first..first + self.lmax - m + 1
        };
        if main.last().is_some_and(|r| r.m_limit >= m) {
            let n = self.steps(m);
            own.coefficients.resize(n * count, [0.0; 4]);
            for (c, a) in alms[..scalars].iter().enumerate() {
                scalar_coefficients(
                    self.level,
                    &a[of_order(a)],
                    epsilon,
                    &steps[..n],
                    count,
                    c,
                    &mut own.coefficients,
                );
            }
            if let [e, b] = alms[scalars..] {
                let (mixing, padded) = mixing_scratch_len(self.lmax - m + 1);
                own.mixing.resize(mixing, Alm::default());
                own.padded.resize(padded, 0.0);
                spin2_coefficients(
                    self.level,
                    m,
                    &e[of_order(e)],
                    &b[of_order(b)],
                    &self.orders.spin_factors,
                    epsilon,
                    &steps[..n],
                    count,
                    scalars,
                    &mut own.coefficients,
                    &mut own.mixing,
                    &mut own.padded,
                );
            }
            sound(synthesis(
                self.level,
                main,
                m,
                order.norm,
                &steps[..n],
                count,
                &own.coefficients,
                to_main,
                out,
            ));
        }
        if polar.last().is_some_and(|r| r.m_limit >= m) {
            let [to_scalars, to_pair] = to_polar.split_at(scalars * grid.polar);
            if scalars > 0 {
                let n = (self.lmax - m) / 2 + 1;
                own.polar_coefficients.resize(n * scalars, [0.0; 4]);
                for (c, a) in alms[..scalars].iter().enumerate() {
                    scalar_coefficients(
                        self.level,
                        &a[of_order(a)],
                        epsilon,
                        &steps[..n],
                        scalars,
                        c,
                        &mut own.polar_coefficients,
                    );
                }
                sound(synthesis(
                    self.level,
                    polar,
                    m,
                    order.norm,
                    &steps[..n],
                    scalars,
                    &own.polar_coefficients,
                    to_scalars,
                    out,
                ));
            }
            if let [e, b] = alms[scalars..] {
                own.wigner_coefficients.resize(order.wigner.len(), [0.0; 4]);
                wigner_coefficients(
                    m,
                    &e[of_order(e)],
                    &b[of_order(b)],
                    order.wigner,
                    &mut own.wigner_coefficients,
                );
                sound(wigner_synthesis(
                    self.level,
                    polar,
                    m,
                    order.wigner_norm,
                    order.wigner,
                    &own.wigner_coefficients,
                    to_pair,
                    out,
                ));
            }
        }
    }

    /// F_m on all rings of the part → a_lm of order m, added.
    fn legendre_adjoint(
        &self,
        own: &mut Scratch,
        grid: Grid<'_>,
        m: usize,
        from: Places<'_>,
        phases: &[PhaseBlock],
        alms: &mut [&mut [Alm]],
    ) {
        let order = self.orders.get(m, self.channels.pairs > 0, &mut own.tables);
        let Order { epsilon, steps, .. } = order;
        let (scalars, count) = (self.channels.scalars, self.channels.count());
        let (polar, main) = grid.rings.split_at(grid.polar);
        let [from_polar, from_main] = from.split(count * grid.polar, scalars);
        let (mixing, padded) = mixing_scratch_len(self.lmax - m + 1);
        own.mixing.resize(mixing, Alm::default());
        own.padded.resize(padded, 0.0);
        let add_scalars = |sums: &[Coefficient],
                           channels: usize,
                           n: usize,
                           alms: &mut [&mut [Alm]],
                           mixing: &mut [Alm]| {
            for (c, a) in alms[..scalars].iter_mut().enumerate() {
                let mixing = &mut mixing[..a.len()];
                scalar_from_sums(sums, epsilon, &steps[..n], channels, c, mixing);
                for (a, x) in a.iter_mut().zip(mixing.iter()) {
                    *a += x;
                }
            }
        };
        if main.last().is_some_and(|r| r.m_limit >= m) {
            let n = self.steps(m);
            own.coefficients.resize(n * count, [0.0; 4]);
            own.lines.reserve(adjoint_scratch_len(n, count));
            sound(adjoint(
                self.level,
                main,
                m,
                order.norm,
                &steps[..n],
                count,
                from_main,
                phases,
                &mut own.coefficients,
                &mut own.lines.0,
            ));
            add_scalars(&own.coefficients, count, n, alms, &mut own.mixing);
            if let [e, b] = &mut alms[scalars..] {
                spin2_from_sums(
                    self.level,
                    m,
                    &own.coefficients,
                    &self.orders.spin_factors,
                    epsilon,
                    &steps[..n],
                    count,
                    scalars,
                    e,
                    b,
                    &mut own.padded,
                );
            }
        }
        if polar.last().is_some_and(|r| r.m_limit >= m) {
            let [from_scalars, from_pair] = from_polar.split_at(scalars * grid.polar);
            if scalars > 0 {
                let n = (self.lmax - m) / 2 + 1;
                own.polar_coefficients.resize(n * scalars, [0.0; 4]);
                own.lines.reserve(adjoint_scratch_len(n, scalars));
                sound(adjoint(
                    self.level,
                    polar,
                    m,
                    order.norm,
                    &steps[..n],
                    scalars,
                    from_scalars,
                    phases,
                    &mut own.polar_coefficients,
                    &mut own.lines.0,
                ));
                add_scalars(&own.polar_coefficients, scalars, n, alms, &mut own.mixing);
            }
            if let [e, b] = &mut alms[scalars..] {
                let n = order.wigner.len();
                own.wigner_coefficients.resize(n, [0.0; 4]);
                own.lines.reserve(wigner_adjoint_scratch_len(n));
                sound(wigner_adjoint(
                    self.level,
                    polar,
                    m,
                    order.wigner_norm,
                    order.wigner,
                    from_pair,
                    phases,
                    &mut own.wigner_coefficients,
                    &mut own.lines.0,
                ));
                wigner_from_sums(m, &own.wigner_coefficients, order.wigner, e, b);
            }
        }
    }
}
