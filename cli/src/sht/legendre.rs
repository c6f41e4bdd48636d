//! The Legendre stage of eight orders: a_lm ↔ tiles of F_m on the rings of the map.
//!
//! Where the plan has equidistant rings, the stage runs on these and the resampling is its other half, while the values
//! are in cache. Else the rings are those of the map. Of a batch only blocks within the polar limit of its first order
//! have tiles.

use super::group::{Alm, Grid, Part, sound};
use super::orders::Order;
use super::workers::Scratch;
use dust3d_kernels::fourier::Eight;
use dust3d_kernels::sht::{
    Coefficient, Layout, Line, ORDERS, PhaseBlock, PhaseTile, RingBlock, add_to_fine, adjoint,
    adjoint_scratch_len, alm, grid_from_phases, mixing_scratch_len, phases_from_fine, phases_from_grid,
    scalar_coefficients, scalar_from_sums, spin2_coefficients, spin2_from_sums, synthesis,
    wigner_adjoint, wigner_adjoint_scratch_len, wigner_coefficients, wigner_from_sums,
    wigner_synthesis,
};
use std::ops::Range;

/// A run of blocks in the rows: where it starts there, its first block, its rings, and whether spin 2 is times sin²θ.
struct Run<'a> {
    at: usize,
    first: usize,
    rings: &'a [RingBlock],
    divided: bool,
}

impl Part<'_> {
    /// The polar and the other blocks of a channel.
    fn runs<'b>(&self, grid: Grid<'b>, channel: usize) -> [Run<'b>; 2] {
        let (polar, main) = (grid.polar.len(), grid.main.len());
        [
            Run {
                at: channel * polar,
                first: 0,
                rings: grid.polar,
                divided: false,
            },
            Run {
                at: self.channels.count() * polar + channel * main,
                first: polar,
                rings: grid.main,
                divided: channel >= self.channels.scalars,
            },
        ]
    }

    /// Sets what the Legendre stage leaves out at order m to zero: rings beyond the polar limit.
    fn clear(&self, grid: Grid<'_>, m: usize, row: &mut [PhaseBlock]) {
        for channel in 0..self.channels.count() {
            for run in self.runs(grid, channel) {
                let idle = run.rings.partition_point(|r| r.m_limit < m);
                row[run.at..run.at + idle].fill(PhaseBlock::default());
            }
        }
    }

    /// Divides Q and U by sin²θ where that is not left to the ring stage.
    fn divide(&self, channel: usize, block: usize, tile: &mut PhaseTile) {
        if self.is_divided(channel, block) && !self.divided(channel, block) {
            let factors = &self.geometry.rings[block].inv_sin2;
            for part in tile.iter_mut().flat_map(|order| order.iter_mut()) {
                for (x, f) in part.iter_mut().zip(factors) {
                    *x *= f;
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
        let row = grid.row();
        let mut rows = std::mem::take(&mut own.rows);
        rows.resize(ORDERS * row, PhaseBlock::default());
        for (j, to) in rows.chunks_exact_mut(row).enumerate() {
            let m = ORDERS * batch + j;
            if m > self.lmax {
                to.fill(PhaseBlock::default());
            } else {
                self.clear(grid, m, to);
                self.legendre(own, grid, m, alms, to);
            }
        }
        for (channel, tiles) in tiles.chunks_exact_mut(active.len()).enumerate() {
            match grid.equidistant {
                Some(equidistant) => {
                    let room = &mut own.resampling;
                    equidistant.reserve(room);
                    let fine = &mut room.fine[..equidistant.fine_len()];
                    for run in self.runs(grid, channel) {
                        let end = run.first + run.rings.len();
                        sound(grid_from_phases(
                            self.level,
                            &rows[run.at..],
                            Layout {
                                order: row,
                                block: 1,
                            },
                            &equidistant.carriers[run.first..end],
                            run.divided.then_some(run.rings),
                            8 * run.first,
                            &mut room.coarse,
                        ));
                    }
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
                None => {
                    for (block, tile) in active.clone().zip(tiles) {
                        let from = grid.position(channel, block - self.range.start);
                        for (to, row) in tile.iter_mut().zip(rows.chunks_exact(row)) {
                            *to = row[from];
                        }
                        self.divide(channel, block, tile);
                    }
                }
            }
        }
        own.rows = rows;
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
        let row = grid.row();
        let mut rows = std::mem::take(&mut own.rows);
        rows.resize(ORDERS * row, PhaseBlock::default());
        for channel in 0..self.channels.count() {
            let tile = |block: usize| {
                let start = starts[block - self.range.start];
                &tiles[start + channel * self.batches(block) + batch]
            };
            match grid.equidistant {
                Some(equidistant) => {
                    let room = &mut own.resampling;
                    equidistant.reserve(room);
                    let fine = &mut room.fine[..equidistant.fine_len()];
                    fine.fill(Eight::default());
                    for block in active.clone() {
                        let next = (block + 1).min(active.end - 1);
                        sound(add_to_fine(
                            self.level,
                            tile(block),
                            tile(next),
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
                    for run in self.runs(grid, channel) {
                        let end = run.first + run.rings.len();
                        sound(phases_from_grid(
                            self.level,
                            &room.coarse,
                            8 * run.first,
                            &equidistant.carriers[run.first..end],
                            run.divided.then_some(run.rings),
                            &mut rows[run.at..],
                            Layout {
                                order: row,
                                block: 1,
                            },
                        ));
                    }
                }
                None => {
                    for block in active.clone() {
                        let to = grid.position(channel, block - self.range.start);
                        let mut tile = *tile(block);
                        self.divide(channel, block, &mut tile);
                        for (from, row) in tile.iter().zip(rows.chunks_exact_mut(row)) {
                            row[to] = *from;
                        }
                    }
                }
            }
        }
        for ((j, row), alms) in rows.chunks_exact_mut(row).enumerate().zip(alms) {
            self.legendre_adjoint(own, grid, ORDERS * batch + j, row, alms);
        }
        own.rows = rows;
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
        out: &mut [PhaseBlock],
    ) {
        let order = self.orders.get(m, self.channels.pairs > 0, &mut own.tables);
        let Order { epsilon, steps, .. } = order;
        let (scalars, count) = (self.channels.scalars, self.channels.count());
        let (polar_out, main_out) = out.split_at_mut(count * grid.polar.len());
        let first = alm::index(self.lmax, m, m);
        let of_order = |a: &'_ [Alm]| -> Range<usize> {
            debug_assert_eq!(a.len(), alm::len(self.lmax));
            first..first + self.lmax - m + 1
        };
        if grid.main.last().is_some_and(|r| r.m_limit >= m) {
            let n = self.steps(m);
            own.coefficients.resize(n * count, [0.0; 4]);
            for (c, a) in alms[..scalars].iter().enumerate() {
                scalar_coefficients(
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
                grid.main,
                m,
                order.norm,
                &steps[..n],
                count,
                &own.coefficients,
                main_out,
            ));
        }
        if grid.polar.last().is_some_and(|r| r.m_limit >= m) {
            let (scalar_out, pair_out) = polar_out.split_at_mut(scalars * grid.polar.len());
            if scalars > 0 {
                let n = (self.lmax - m) / 2 + 1;
                own.polar_coefficients.resize(n * scalars, [0.0; 4]);
                for (c, a) in alms[..scalars].iter().enumerate() {
                    scalar_coefficients(
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
                    grid.polar,
                    m,
                    order.norm,
                    &steps[..n],
                    scalars,
                    &own.polar_coefficients,
                    scalar_out,
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
                let (q, u) = pair_out.split_at_mut(grid.polar.len());
                sound(wigner_synthesis(
                    self.level,
                    grid.polar,
                    m,
                    order.wigner_norm,
                    order.wigner,
                    &own.wigner_coefficients,
                    q,
                    u,
                ));
            }
        }
    }

    /// F_m on all rings of the part (destroyed) → a_lm of order m, added.
    fn legendre_adjoint(
        &self,
        own: &mut Scratch,
        grid: Grid<'_>,
        m: usize,
        row: &mut [PhaseBlock],
        alms: &mut [&mut [Alm]],
    ) {
        let order = self.orders.get(m, self.channels.pairs > 0, &mut own.tables);
        let Order { epsilon, steps, .. } = order;
        let (scalars, count) = (self.channels.scalars, self.channels.count());
        let (polar_row, main_row) = row.split_at_mut(count * grid.polar.len());
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
        if grid.main.last().is_some_and(|r| r.m_limit >= m) {
            let n = self.steps(m);
            own.coefficients.resize(n * count, [0.0; 4]);
            let need = adjoint_scratch_len(n, count);
            own.lines.resize(need.max(own.lines.len()), Line::default());
            sound(adjoint(
                self.level,
                grid.main,
                m,
                order.norm,
                &steps[..n],
                count,
                main_row,
                &mut own.coefficients,
                &mut own.lines,
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
                    &mut own.mixing,
                    &mut own.padded,
                );
            }
        }
        if grid.polar.last().is_some_and(|r| r.m_limit >= m) {
            let (scalar_row, pair_row) = polar_row.split_at_mut(scalars * grid.polar.len());
            if scalars > 0 {
                let n = (self.lmax - m) / 2 + 1;
                own.polar_coefficients.resize(n * scalars, [0.0; 4]);
                let need = adjoint_scratch_len(n, scalars);
                own.lines.resize(need.max(own.lines.len()), Line::default());
                sound(adjoint(
                    self.level,
                    grid.polar,
                    m,
                    order.norm,
                    &steps[..n],
                    scalars,
                    scalar_row,
                    &mut own.polar_coefficients,
                    &mut own.lines,
                ));
                add_scalars(&own.polar_coefficients, scalars, n, alms, &mut own.mixing);
            }
            if let [e, b] = &mut alms[scalars..] {
                let n = order.wigner.len();
                own.wigner_coefficients.resize(n, [0.0; 4]);
                let need = wigner_adjoint_scratch_len(n);
                own.lines.resize(need.max(own.lines.len()), Line::default());
                let (q, u) = pair_row.split_at(grid.polar.len());
                sound(wigner_adjoint(
                    self.level,
                    grid.polar,
                    m,
                    order.wigner_norm,
                    order.wigner,
                    q,
                    u,
                    &mut own.wigner_coefficients,
                    &mut own.lines,
                ));
                wigner_from_sums(m, &own.wigner_coefficients, order.wigner, e, b);
            }
        }
    }
}
