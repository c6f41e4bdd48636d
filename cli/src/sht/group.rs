//! Transforms of up to three channels: both stages, part by part of the rings.
//!
//! ```text
//! synthesis, for each part of the rings      adjoint
//!   for each m (threads):                      for each block of rings (threads):
//!     a_lm → coefficients → F_m on all rings     maps → FFT → F_m for all m
//!   for each block of rings (threads):         for each m (threads):
//!     F_m for all m → FFT → maps                 F_m on all rings → coefficients → add to a_lm
//! ```
//!
//! Between the stages F_m lies in memory as (m, channel, block) for synthesis and (block, m, channel) for the adjoint,
//! so that the first stage always writes what no other thread writes. The size of the parts depends on Nside and lmax
//! alone, so the order of summation is the same for every batch and number of threads.

use super::orders::{Order, Orders};
use super::plan::{Geometry, ShtPlan};
use super::workers::{Scratch, share};
use dust3d_kernels::sht::{
    Coefficient, Line, PhaseBlock, RingBlock, adjoint, adjoint_scratch_len, alm,
    phases_from_spectrum, scalar_coefficients, scalar_from_sums, spectrum_from_phases,
    spin2_coefficients, spin2_from_sums, synthesis, wigner_adjoint, wigner_adjoint_scratch_len,
    wigner_coefficients, wigner_from_sums, wigner_synthesis,
};
use dust3d_kernels::simd::Level;
use num_complex::Complex;
use std::ops::Range;

type Alm = Complex<f64>;

/// Scalar maps and spin-2 pairs of a group; scalars come first among the channels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Channels {
    pub(super) scalars: usize,
    pub(super) pairs: usize,
}

impl Channels {
    /// The next group of what is left: one of each while there are both, then three scalars or one pair at a time.
    pub(super) const fn next(scalars: usize, pairs: usize) -> Option<Self> {
        Some(match (scalars, pairs) {
            (0, 0) => return None,
            (0, _) => Self {
                scalars: 0,
                pairs: 1,
            },
            (_, 0) => Self {
                scalars: if scalars < 3 { scalars } else { 3 },
                pairs: 0,
            },
            _ => Self {
                scalars: 1,
                pairs: 1,
            },
        })
    }

    const fn count(self) -> usize {
        self.scalars + 2 * self.pairs
    }
}

/// The kernels refuse only slices of wrong length, and these are cut to length here.
fn sound(result: Result<(), dust3d_kernels::Error>) {
    if let Err(error) = result {
        unreachable!("lengths of the transform's workspace: {error}");
    }
}

/// A part of the rings: blocks `range`, of which those before `split` run spin 2 on the spin-weighted functions.
struct Part<'a> {
    channels: Channels,
    level: Level,
    lmax: usize,
    range: Range<usize>,
    polar: &'a [RingBlock],
    main: &'a [RingBlock],
    geometry: &'a Geometry,
    orders: &'a Orders,
}

impl Part<'_> {
    fn blocks(&self) -> usize {
        self.range.len()
    }

    /// Length of the phases of one order in synthesis.
    fn row(&self) -> usize {
        self.channels.count() * self.blocks()
    }

    /// Position of (channel, block) in the phases of one order: polar blocks of all channels, then the others.
    fn position(&self, channel: usize, block: usize) -> usize {
        let (polar, main) = (self.polar.len(), self.main.len());
        let b = block - self.range.start;
        if b < polar {
            channel * polar + b
        } else {
            self.channels.count() * polar + channel * main + (b - polar)
        }
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
    fn legendre(&self, own: &mut Scratch, m: usize, alms: &[&[Alm]], out: &mut [PhaseBlock]) {
        let order = self.orders.get(m, &mut own.tables);
        let Order { epsilon, steps, .. } = order;
        let (scalars, count) = (self.channels.scalars, self.channels.count());
        let (polar_out, main_out) = out.split_at_mut(count * self.polar.len());
        let first = alm::index(self.lmax, m, m);
        let of_order = |a: &'_ [Alm]| -> Range<usize> {
            debug_assert_eq!(a.len(), alm::len(self.lmax));
            first..first + self.lmax - m + 1
        };
        if self.main.last().is_some_and(|r| r.m_limit >= m) {
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
                own.mixing.resize(2 * (self.lmax - m + 3), Alm::default());
                spin2_coefficients(
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
                );
            }
            sound(synthesis(
                self.level,
                self.main,
                m,
                order.norm,
                &steps[..n],
                count,
                &own.coefficients,
                main_out,
            ));
        }
        if self.polar.last().is_some_and(|r| r.m_limit >= m) {
            let (scalar_out, pair_out) = polar_out.split_at_mut(scalars * self.polar.len());
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
                    self.polar,
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
                let (q, u) = pair_out.split_at_mut(self.polar.len());
                sound(wigner_synthesis(
                    self.level,
                    self.polar,
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

    /// F_m on all rings of the part (`row`) → a_lm of order m, added.
    fn legendre_adjoint(
        &self,
        own: &mut Scratch,
        m: usize,
        row: &mut [PhaseBlock],
        alms: &mut [&mut [Alm]],
    ) {
        let order = self.orders.get(m, &mut own.tables);
        let Order { epsilon, steps, .. } = order;
        let (scalars, count) = (self.channels.scalars, self.channels.count());
        let (polar_row, main_row) = row.split_at_mut(count * self.polar.len());
        own.mixing.resize(2 * (self.lmax - m + 3), Alm::default());
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
        if self.main.last().is_some_and(|r| r.m_limit >= m) {
            let n = self.steps(m);
            own.coefficients.resize(n * count, [0.0; 4]);
            let need = adjoint_scratch_len(n, count);
            own.lines.resize(need.max(own.lines.len()), Line::default());
            sound(adjoint(
                self.level,
                self.main,
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
                );
            }
        }
        if self.polar.last().is_some_and(|r| r.m_limit >= m) {
            let (scalar_row, pair_row) = polar_row.split_at_mut(scalars * self.polar.len());
            if scalars > 0 {
                let n = (self.lmax - m) / 2 + 1;
                own.polar_coefficients.resize(n * scalars, [0.0; 4]);
                let need = adjoint_scratch_len(n, scalars);
                own.lines.resize(need.max(own.lines.len()), Line::default());
                sound(adjoint(
                    self.level,
                    self.polar,
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
                let (q, u) = pair_row.split_at(self.polar.len());
                sound(wigner_adjoint(
                    self.level,
                    self.polar,
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

    /// 1/sin²θ for what the main rings hold as Q sin²θ and U sin²θ, one for everything else.
    fn scale(&self, channel: usize, block: usize) -> [f64; 8] {
        if channel >= self.channels.scalars && block >= self.range.start + self.polar.len() {
            self.geometry.rings[block].inv_sin2
        } else {
            [1.0; 8]
        }
    }

    /// Orders that reach the rings of a block.
    fn reach(&self, block: usize) -> usize {
        self.geometry.rings[block].m_limit.min(self.lmax) + 1
    }

    fn fft(&self, own: &mut Scratch, block: usize) {
        let mut rest = &mut own.spectra[..];
        for &n in &self.geometry.shapes[block].pixels {
            if n == 0 {
                continue;
            }
            let (ring, after) = rest.split_at_mut(n);
            let fft = &self.geometry.ffts[n / 4 - 1];
            let need = fft.get_inplace_scratch_len();
            if own.fft.len() < need {
                own.fft.resize(need, Alm::default());
            }
            fft.process_with_scratch(ring, &mut own.fft[..need]);
            rest = after;
        }
    }

    /// F_m for all m → the pixels of one block of rings, one channel.
    fn rings(
        &self,
        own: &mut Scratch,
        phases: &[PhaseBlock],
        channel: usize,
        block: usize,
        north: &mut [f64],
        south: &mut [f64],
    ) {
        let shapes = &self.geometry.shapes[block];
        own.spectra.resize(shapes.len(), Alm::default());
        sound(spectrum_from_phases(
            self.level,
            phases,
            (self.position(channel, block), self.row(), self.reach(block)),
            &self.scale(channel, block),
            self.geometry.phase_table(block),
            shapes,
            &mut own.spectra,
        ));
        self.fft(own, block);
        // real and imaginary parts are exchanged: S + iN. Southern rings lie in the opposite order.
        for (pixel, z) in north.iter_mut().zip(&own.spectra) {
            *pixel = z.im;
        }
        let mut end = south.len();
        let mut start = 0;
        for &n in &shapes.pixels {
            if n == 0 || end < n {
                break;
            }
            for (pixel, z) in south[end - n..end].iter_mut().zip(&own.spectra[start..]) {
                *pixel = z.re;
            }
            end -= n;
            start += n;
        }
    }

    /// The pixels of one block of rings, one channel → F_m for all m, in `phases` as (m, channel).
    fn rings_adjoint(
        &self,
        own: &mut Scratch,
        (channel, block): (usize, usize),
        weights: Option<&[[f64; 8]]>,
        north: &[f64],
        south: &[f64],
        phases: &mut [PhaseBlock],
    ) {
        let shapes = &self.geometry.shapes[block];
        own.spectra.resize(shapes.len(), Alm::default());
        for (pixel, z) in north.iter().zip(own.spectra.iter_mut()) {
            *z = Complex::new(*pixel, 0.0);
        }
        let mut end = south.len();
        let mut start = 0;
        for &n in &shapes.pixels {
            if n == 0 || end < n {
                break;
            }
            for (pixel, z) in south[end - n..end].iter().zip(&mut own.spectra[start..]) {
                z.im = *pixel;
            }
            end -= n;
            start += n;
        }
        self.fft(own, block);
        let mut scale = self.scale(channel, block);
        if let Some(weights) = weights {
            for (s, w) in scale.iter_mut().zip(weights[block]) {
                *s *= w;
            }
        }
        sound(phases_from_spectrum(
            self.level,
            &own.spectra,
            &scale,
            self.geometry.phase_table(block),
            shapes,
            phases,
            (channel, self.channels.count(), self.reach(block)),
        ));
    }
}

/// Cuts every set of coefficients by orders: for each m the slices l = m … lmax of all sets.
struct ByOrder<'a> {
    rest: Vec<&'a mut [Alm]>,
    lmax: usize,
    m: usize,
}

impl<'a> Iterator for ByOrder<'a> {
    type Item = (usize, Vec<&'a mut [Alm]>);
    fn next(&mut self) -> Option<Self::Item> {
        if self.m > self.lmax {
            return None;
        }
        let (m, n) = (self.m, self.lmax - self.m + 1);
        self.m += 1;
        let cut = self
            .rest
            .iter_mut()
            .filter_map(|rest| rest.split_off_mut(..n))
            .collect();
        Some((m, cut))
    }
}

/// Orders taken together by the adjoint: their phases lie side by side, and a longer stretch is read faster.
const ORDERS_AT_ONCE: usize = 8;

/// [`ByOrder`], [`ORDERS_AT_ONCE`] at a time.
struct InGroups<'a>(ByOrder<'a>);

impl<'a> Iterator for InGroups<'a> {
    type Item = Vec<(usize, Vec<&'a mut [Alm]>)>;
    fn next(&mut self) -> Option<Self::Item> {
        let group: Vec<_> = self.0.by_ref().take(ORDERS_AT_ONCE).collect();
        (!group.is_empty()).then_some(group)
    }
}

impl ShtPlan {
    fn parts(&self) -> impl Iterator<Item = Range<usize>> + use<> {
        let (count, part) = (self.geometry.rings.len(), self.geometry.part);
        (0..count.div_ceil(part)).map(move |k| k * part..((k + 1) * part).min(count))
    }

    /// Takes the workspace out of the plan, so that the rest can be shared among threads.
    fn part<'a>(
        geometry: &'a Geometry,
        orders: &'a Orders,
        (channels, level, lmax): (Channels, Level, usize),
        range: Range<usize>,
    ) -> Part<'a> {
        // also without pairs: the adjoint sums in the same order in every group
        let polar_end = geometry.polar.clamp(range.start, range.end);
        Part {
            channels,
            level,
            lmax,
            polar: &geometry.rings[range.start..polar_end],
            main: &geometry.rings[polar_end..range.end],
            range,
            geometry,
            orders,
        }
    }

    /// Room for the phases of the largest part.
    fn reserve_phases(&mut self, channels: Channels) {
        let need = channels.count() * self.geometry.part * (self.lmax + 1);
        if self.phases.len() < need {
            self.phases.resize(need, PhaseBlock::default());
        }
    }

    pub(super) fn synthesise_group(
        &mut self,
        channels: Channels,
        scalars: &[&[Alm]],
        pairs: &[[&[Alm]; 2]],
        maps: &mut [&mut [f64]],
    ) {
        self.reserve_phases(channels);
        let alms: Vec<&[Alm]> = scalars
            .iter()
            .copied()
            .chain(pairs.iter().flatten().copied())
            .collect();
        let mut rest: Vec<&mut [f64]> = maps.iter_mut().map(|m| &mut **m).collect();
        for range in self.parts() {
            let part = Self::part(
                &self.geometry,
                &self.orders,
                (channels, self.level, self.lmax),
                range.clone(),
            );
            let phases = &mut self.phases[..part.row() * (self.lmax + 1)];
            share(
                &mut self.workers,
                phases.chunks_exact_mut(part.row()).enumerate(),
                |own, (m, out)| part.legendre(own, m, &alms, out),
            );
            let phases = &*phases;
            let mut tasks = Vec::with_capacity(range.len() * channels.count());
            for (channel, rest) in rest.iter_mut().enumerate() {
                for block in range.clone() {
                    let (north, south) = self.geometry.pixels[block];
                    if let Some(n) = rest.split_off_mut(..north)
                        && let Some(s) = rest.split_off_mut(rest.len() - south..)
                    {
                        tasks.push((channel, block, n, s));
                    }
                }
            }
            // longest rings first
            share(
                &mut self.workers,
                tasks.into_iter().rev(),
                |own, (channel, block, north, south)| {
                    part.rings(own, phases, channel, block, north, south);
                },
            );
        }
    }

    pub(super) fn adjoint_group(
        &mut self,
        channels: Channels,
        weights: Option<&[[f64; 8]]>,
        maps: &[&[f64]],
        alms: &mut [&mut [Alm]],
    ) {
        self.reserve_phases(channels);
        for a in alms.iter_mut() {
            a.fill(Alm::default());
        }
        let count = channels.count();
        let mut rest: Vec<&[f64]> = maps.to_vec();
        for range in self.parts() {
            let part = Self::part(
                &self.geometry,
                &self.orders,
                (channels, self.level, self.lmax),
                range.clone(),
            );
            let per_block = (self.lmax + 1) * count;
            let phases = &mut self.phases[..part.blocks() * per_block];
            let mut tasks = Vec::with_capacity(range.len());
            for (block, phases) in range.clone().zip(phases.chunks_exact_mut(per_block)) {
                let (north, south) = self.geometry.pixels[block];
                let slices: Vec<_> = rest
                    .iter_mut()
                    .filter_map(|rest| {
                        let n = rest.split_off(..north)?;
                        let s = rest.split_off(rest.len() - south..)?;
                        Some((n, s))
                    })
                    .collect();
                tasks.push((block, slices, phases));
            }
            share(
                &mut self.workers,
                tasks.into_iter().rev(),
                |own, (block, slices, phases)| {
                    for (channel, (north, south)) in slices.into_iter().enumerate() {
                        part.rings_adjoint(own, (channel, block), weights, north, south, phases);
                    }
                },
            );
            let phases = &*phases;
            let orders = ByOrder {
                rest: alms.iter_mut().map(|a| &mut **a).collect(),
                lmax: self.lmax,
                m: 0,
            };
            share(&mut self.workers, InGroups(orders), |own, group| {
                let first = group.first().map_or(0, |(m, _)| *m);
                let row = part.row();
                let mut rows = std::mem::take(&mut own.rows);
                rows.resize(row * group.len(), PhaseBlock::default());
                for block in part.range.clone() {
                    let reach = part.geometry.rings[block].m_limit + 1;
                    let from = (block - part.range.start) * per_block + first * count;
                    let used = group.len().min(reach.saturating_sub(first));
                    for (k, from) in phases[from..from + used * count].chunks(count).enumerate() {
                        for (channel, from) in from.iter().enumerate() {
                            rows[k * row + part.position(channel, block)] = *from;
                        }
                    }
                }
                for ((m, mut alms), row) in group.into_iter().zip(rows.chunks_exact_mut(row)) {
                    part.legendre_adjoint(own, m, row, &mut alms);
                }
                own.rows = rows;
            });
        }
    }
}
