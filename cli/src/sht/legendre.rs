//! The Legendre stage of one order: a_lm ↔ F_m on rings.
//!
//! Near the poles spin 2 runs on the spin-weighted functions and the scalars alone on the recurrence; elsewhere all
//! channels share it.

use super::batch::Places;
use super::group::{Alm, Grid, Part, sound};
use super::orders::Order;
use super::workers::{Scratch, room};
use dust3d_kernels::sht::{
    Coefficient, Line, PhaseBlock, PhaseIndex, RingBlock, adjoint, adjoint_scratch_len, alm,
    mixing_scratch_len, scalar_coefficients, scalar_from_sums, spin2_coefficients, spin2_from_sums,
    synthesis, wigner_adjoint, wigner_adjoint_scratch_len, wigner_coefficients, wigner_from_sums,
    wigner_synthesis,
};
use std::ops::Range;

/// Does order m reach any of the rings?
fn reached(rings: &[RingBlock], m: usize) -> bool {
    rings.last().is_some_and(|r| r.m_limit >= m)
}

impl Part<'_> {
    /// Steps of the recurrence at order m up to a degree.
    const fn steps(top: usize, m: usize) -> usize {
        (top - m) / 2 + 1
    }

    /// Greatest degree of the recurrence shared by all channels: spin 2 reaches lmax + 2.
    const fn top(&self) -> usize {
        if self.channels.pairs > 0 {
            self.lmax + 2
        } else {
            self.lmax
        }
    }

    /// a_lm of order m → F_m on all rings of the part.
    pub(super) fn legendre(
        &self,
        own: &mut Scratch,
        grid: Grid<'_>,
        m: usize,
        alms: &[&[Alm]],
        to: Places<'_>,
        out: &mut [PhaseBlock],
    ) {
        let order = self.orders.get(m, self.channels.pairs > 0, &mut own.tables);
        let (scalars, count) = (self.channels.scalars, self.channels.count());
        let (polar, main) = grid.rings.split_at(grid.polar);
        let [to_polar, to_main] = to.split(count * grid.polar, scalars);
        let first = alm::index(self.lmax, m, m);
        let of_order: Range<usize> = first..first + self.lmax - m + 1;
        if reached(main, m) {
            let n = Self::steps(self.top(), m);
            let coefficients = room(&mut own.coefficients, n * count);
            self.scalars(&order, &alms[..scalars], &of_order, count, coefficients);
            if let [e, b] = alms[scalars..] {
                let (mixing, padded) = mixing_scratch_len(of_order.len());
                spin2_coefficients(
                    self.level,
                    m,
                    &e[of_order.clone()],
                    &b[of_order.clone()],
                    &self.orders.spin_factors,
                    order.epsilon,
                    &order.steps[..n],
                    count,
                    scalars,
                    coefficients,
                    room(&mut own.mixing, mixing),
                    room(&mut own.padded, padded),
                );
            }
            self.synthesis(&order, (main, m), count, coefficients, to_main, out);
        }
        if reached(polar, m) {
            let [to_scalars, to_pair] = to_polar.split_at(scalars * grid.polar);
            let coefficients = room(&mut own.coefficients, Self::steps(self.lmax, m) * scalars);
            self.scalars(&order, &alms[..scalars], &of_order, scalars, coefficients);
            self.synthesis(&order, (polar, m), scalars, coefficients, to_scalars, out);
            if let [e, b] = alms[scalars..] {
                let coefficients = room(&mut own.coefficients, order.wigner.len());
                wigner_coefficients(
                    m,
                    &e[of_order.clone()],
                    &b[of_order],
                    order.wigner,
                    coefficients,
                );
                sound(wigner_synthesis(
                    self.level,
                    polar,
                    m,
                    order.wigner_norm,
                    order.wigner,
                    coefficients,
                    to_pair,
                    out,
                ));
            }
        }
    }

    /// Coefficients of all scalars, which come first of `channels`.
    fn scalars(
        &self,
        order: &Order<'_>,
        alms: &[&[Alm]],
        of_order: &Range<usize>,
        channels: usize,
        coefficients: &mut [Coefficient],
    ) {
        for (c, alm) in alms.iter().enumerate() {
            debug_assert_eq!(alm.len(), alm::len(self.lmax));
            scalar_coefficients(
                self.level,
                &alm[of_order.clone()],
                order.epsilon,
                order.steps,
                channels,
                c,
                coefficients,
            );
        }
    }

    /// Coefficients → F_m on rings that share the recurrence.
    fn synthesis(
        &self,
        order: &Order<'_>,
        (rings, m): (&[RingBlock], usize),
        channels: usize,
        coefficients: &[Coefficient],
        to: PhaseIndex<'_>,
        out: &mut [PhaseBlock],
    ) {
        sound(synthesis(
            self.level,
            rings,
            m,
            order.norm,
            order.steps,
            channels,
            coefficients,
            to,
            out,
        ));
    }

    /// F_m on all rings of the part → a_lm of order m, added or, if `fresh`, in place of what is there.
    pub(super) fn legendre_adjoint(
        &self,
        own: &mut Scratch,
        grid: Grid<'_>,
        m: usize,
        from: Places<'_>,
        phases: &[PhaseBlock],
        alms: &mut [&mut [Alm]],
        fresh: bool,
    ) {
        let order = self.orders.get(m, self.channels.pairs > 0, &mut own.tables);
        let (scalars, count) = (self.channels.scalars, self.channels.count());
        let (polar, main) = grid.rings.split_at(grid.polar);
        let [from_polar, from_main] = from.split(count * grid.polar, scalars);
        let degrees = self.lmax - m + 1;
        if reached(main, m) {
            let n = Self::steps(self.top(), m);
            let sums = room(&mut own.coefficients, n * count);
            self.adjoint(
                &order,
                (main, m),
                count,
                (from_main, phases),
                sums,
                &mut own.lines,
            );
            self.take_scalars(&order, sums, count, &mut alms[..scalars], !fresh);
            if let [e, b] = &mut alms[scalars..] {
                spin2_from_sums(
                    self.level,
                    m,
                    sums,
                    &self.orders.spin_factors,
                    order.epsilon,
                    &order.steps[..n],
                    count,
                    scalars,
                    !fresh,
                    e,
                    b,
                    room(&mut own.padded, mixing_scratch_len(degrees).1),
                );
            }
        }
        if fresh && !reached(main, m) {
            alms.iter_mut().for_each(|a| a.fill(Alm::default()));
        }
        if reached(polar, m) {
            let [from_scalars, from_pair] = from_polar.split_at(scalars * grid.polar);
            let sums = room(&mut own.coefficients, Self::steps(self.lmax, m) * scalars);
            let from = (from_scalars, phases);
            self.adjoint(&order, (polar, m), scalars, from, sums, &mut own.lines);
            self.take_scalars(&order, sums, scalars, &mut alms[..scalars], true);
            if let [e, b] = &mut alms[scalars..] {
                let n = order.wigner.len();
                let sums = room(&mut own.coefficients, n);
                sound(wigner_adjoint(
                    self.level,
                    polar,
                    m,
                    order.wigner_norm,
                    order.wigner,
                    from_pair,
                    phases,
                    sums,
                    room(&mut own.lines, wigner_adjoint_scratch_len(n)),
                ));
                wigner_from_sums(m, sums, order.wigner, e, b);
            }
        }
    }

    /// F_m on rings that share the recurrence → coefficients.
    fn adjoint(
        &self,
        order: &Order<'_>,
        (rings, m): (&[RingBlock], usize),
        channels: usize,
        (from, phases): (PhaseIndex<'_>, &[PhaseBlock]),
        sums: &mut [Coefficient],
        lines: &mut Vec<Line>,
    ) {
        let n = sums.len() / channels.max(1);
        sound(adjoint(
            self.level,
            rings,
            m,
            order.norm,
            order.steps,
            channels,
            from,
            phases,
            sums,
            room(lines, adjoint_scratch_len(n, channels)),
        ));
    }

    /// What the sums give to the scalars, which come first of `channels`.
    fn take_scalars(
        &self,
        order: &Order<'_>,
        sums: &[Coefficient],
        channels: usize,
        alms: &mut [&mut [Alm]],
        add: bool,
    ) {
        let steps = &order.steps[..sums.len() / channels.max(1)];
        for (c, alm) in alms.iter_mut().enumerate() {
            scalar_from_sums(
                self.level,
                sums,
                order.epsilon,
                steps,
                channels,
                c,
                add,
                alm,
            );
        }
    }
}
