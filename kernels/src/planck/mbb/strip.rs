//! Strips of pixels: all layers at all bands, while what they share is in the nearest cache.

use super::{MbbLayer, MbbNode, Sample};
use crate::simd::Lanes;
use crate::simd::math::{exp2, one_minus_exp2};
use core::ops::Range;

/// Vectors worked on together: their chains of operations are independent, and the constants of a frequency are loaded
/// once for all.
const BLOCK: usize = 4;

/// Pixels of a block.
const PIXELS: usize = 8 * BLOCK;

/// Blocks of a strip: whole cache lines of every map, and pages changed less often.
const BLOCKS: usize = 2;

/// Layers at a time, at most: what is kept of a strip of them fits the nearest cache.
pub(super) const GROUP: usize = 8;

/// Maps are asked for a strip ahead of use: hardware does not follow so many, nor beyond a page, which is 512 pixels.
const AHEAD: usize = BLOCKS * PIXELS;

/// A layer at a block of pixels: what the bands share, side by side.
#[derive(Clone, Copy)]
struct Cell<L, const S: usize> {
    /// 1/T, NaN where T is not positive.
    inverse_t: [L; BLOCK],
    /// 3 + β.
    slope: [L; BLOCK],
    /// 1 − e^−x₀.
    d0: [L; BLOCK],
    /// X_ν₀.
    templates: [[L; BLOCK]; S],
}

impl<L: Lanes, const S: usize> Cell<L, S> {
    #[inline(always)]
    fn zero(token: L::Token) -> Self {
        let zero = [L::splat(token, 0.0); BLOCK];
        Self {
            inverse_t: zero,
            slope: zero,
            d0: zero,
            templates: [zero; S],
        }
    }

    #[inline(always)]
    fn new<E: Sample>(
        token: L::Token,
        decay0: f64,
        layer: &MbbLayer<'_, E, S>,
        range: &Range<usize>,
    ) -> Self {
        let c = |v: f64| L::splat(token, v);
        let mut cell = Self::zero(token);
        load::<L, E>(token, part(layer.t, range), &mut cell.inverse_t);
        load::<L, E>(token, part(layer.beta, range), &mut cell.slope);
        for (to, from) in cell.templates.iter_mut().zip(layer.templates) {
            load::<L, E>(token, part(from, range), to);
        }
        for ((t, slope), d0) in cell
            .inverse_t
            .iter_mut()
            .zip(&mut cell.slope)
            .zip(&mut cell.d0)
        {
            *t = L::select(t.gt(c(0.0)), c(1.0) / *t, c(f64::NAN));
            *slope += c(3.0);
            *d0 = one_minus_exp2(token, c(decay0), *t);
        }
        cell
    }

    /// totals\[X\] += X_ν₀ Σ_k a_k s_k.
    #[inline(always)]
    fn add_band(&self, token: L::Token, band: &[MbbNode], totals: &mut [[L; BLOCK]; S]) {
        let Some((first, others)) = band.split_first() else {
            return;
        };
        let mut sums = [L::splat(token, 0.0); BLOCK];
        // The first is no addition to zero: at ν₀ with weight 1 the sum is 1.
        self.node(
            token,
            first,
            &mut sums,
            #[inline(always)]
            |s, weight, _| s * weight,
        );
        for node in others {
            self.node(
                token,
                node,
                &mut sums,
                #[inline(always)]
                |s, weight, sum| s.mul_add(weight, sum),
            );
        }
        for (total, template) in totals.iter_mut().zip(&self.templates) {
            for ((total, template), sum) in total.iter_mut().zip(template).zip(&sums) {
                *total = template.mul_add(*sum, *total);
            }
        }
    }

    /// Puts the s of one frequency into the sums.
    #[inline(always)]
    fn node(
        &self,
        token: L::Token,
        node: &MbbNode,
        sums: &mut [L; BLOCK],
        join: impl Fn(L, L, L) -> L,
    ) {
        let c = |v: f64| L::splat(token, v);
        let (log2_ratio, decay) = (c(node.log2_ratio), c(node.decay));
        let (difference, weight) = (c(node.decay_difference), c(node.weight));
        for (((sum, inverse_t), slope), d0) in sums
            .iter_mut()
            .zip(&self.inverse_t)
            .zip(&self.slope)
            .zip(&self.d0)
        {
            let exponent = slope.mul_add(log2_ratio, difference * *inverse_t);
            let d = one_minus_exp2(token, decay, *inverse_t);
            let s = exp2(token, exponent) * (*d0 / d);
            *sum = join(s, weight, *sum);
        }
    }
}

/// Adds at most [`GROUP`] layers, equally long, to `out`, or to zero.
#[inline(always)]
pub(super) fn sum_layers<L: Lanes, E: Sample, const S: usize>(
    token: L::Token,
    bands: &[&[MbbNode]],
    decay0: f64,
    layers: &[MbbLayer<'_, E, S>],
    add: bool,
    out: &mut [&mut [f64]],
) {
    let n = out.first().map_or(0, |map| map.len());
    // The first strip ends where a cache line of the output begins: a vector that lies in two costs twice as much.
    let head = out.first().map_or(0, |map| map.as_ptr().align_offset(64));
    let mut start = 0;
    let mut end = if (1..8).contains(&head) {
        n.min(head)
    } else {
        n.min(BLOCKS * PIXELS)
    };
    if let ([band], maps) = (bands, &mut *out) {
        while start < n {
            for block in blocks(start, end) {
                let mut totals = before::<L, S>(token, maps, &block, add);
                for layer in layers {
                    ask::<L, E, S>(token, layer, &block);
                    Cell::new(token, decay0, layer, &block).add_band(token, band, &mut totals);
                }
                store(&totals, maps, &block);
            }
            (start, end) = (end, n.min(end + BLOCKS * PIXELS));
        }
        return;
    }
    let mut cells = [[Cell::<L, S>::zero(token); GROUP]; BLOCKS];
    while start < n {
        for (block, cells) in blocks(start, end).zip(&mut cells) {
            for (cell, layer) in cells.iter_mut().zip(layers) {
                *cell = Cell::new(token, decay0, layer, &block);
            }
        }
        for (b, (band, maps)) in bands.iter().zip(out.chunks_mut(S.max(1))).enumerate() {
            for (block, cells) in blocks(start, end).zip(&cells) {
                let mut totals = before::<L, S>(token, maps, &block, add);
                for (k, (cell, layer)) in cells.iter().zip(layers).enumerate() {
                    if k % bands.len() == b {
                        ask::<L, E, S>(token, layer, &block);
                    }
                    cell.add_band(token, band, &mut totals);
                }
                store(&totals, maps, &block);
            }
        }
        (start, end) = (end, n.min(end + BLOCKS * PIXELS));
    }
}

/// The pixels of the blocks of a strip.
#[inline(always)]
fn blocks(start: usize, end: usize) -> impl Iterator<Item = Range<usize>> {
    (start..end).step_by(PIXELS).map(
        #[inline(always)]
        move |from| from..end.min(from + PIXELS),
    )
}

/// The same block of the next strip.
#[inline(always)]
fn ahead(block: &Range<usize>) -> Range<usize> {
    block.start + AHEAD..block.start + AHEAD + PIXELS
}

/// Asks for what will be needed of a layer.
#[inline(always)]
fn ask<L: Lanes, E: Sample, const S: usize>(
    token: L::Token,
    layer: &MbbLayer<'_, E, S>,
    block: &Range<usize>,
) {
    let ahead = ahead(block);
    E::prefetch::<L>(token, part(layer.t, &ahead));
    E::prefetch::<L>(token, part(layer.beta, &ahead));
    for template in layer.templates {
        E::prefetch::<L>(token, part(template, &ahead));
    }
}

/// What is in a block of the maps, or zero. Asks for what will be written next: a store, too, waits for its cache line.
#[inline(always)]
fn before<L: Lanes, const S: usize>(
    token: L::Token,
    maps: &[&mut [f64]],
    block: &Range<usize>,
    add: bool,
) -> [[L; BLOCK]; S] {
    let mut totals = [[L::splat(token, 0.0); BLOCK]; S];
    for (total, map) in totals.iter_mut().zip(maps) {
        <f64 as Sample>::prefetch::<L>(token, part(map, &ahead(block)));
        if add {
            load::<L, f64>(token, part(map, block), total);
        }
    }
    totals
}

/// Up to a block of pixels; beyond the end of the slice they are what `load_padded` makes them.
#[inline(always)]
fn load<L: Lanes, E: Sample>(token: L::Token, from: &[E], to: &mut [L; BLOCK]) {
    if let Some(eights) = from.as_chunks::<8>().0.first_chunk::<BLOCK>() {
        for (to, from) in to.iter_mut().zip(eights) {
            *to = E::load(token, from);
        }
    } else {
        for (to, from) in to.iter_mut().zip(from.chunks(8)) {
            *to = E::load_padded(token, from);
        }
    }
}

/// Writes a block of the maps.
#[inline(always)]
fn store<L: Lanes, const S: usize>(
    totals: &[[L; BLOCK]; S],
    maps: &mut [&mut [f64]],
    block: &Range<usize>,
) {
    for (total, map) in totals.iter().zip(maps) {
        let to = map.get_mut(block.clone()).unwrap_or(&mut []);
        if let Some(eights) = to.as_chunks_mut::<8>().0.first_chunk_mut::<BLOCK>() {
            for (total, to) in total.iter().zip(eights) {
                total.store(to);
            }
        } else {
            for (total, to) in total.iter().zip(to.chunks_mut(8)) {
                total.store_padded(to);
            }
        }
    }
}

/// The pixels `range` of a map; none if it has none of them.
#[inline(always)]
fn part<'a, E>(map: &'a [E], range: &Range<usize>) -> &'a [E] {
    map.get(range.clone()).unwrap_or(&[])
}
