//! Transforms of up to six channels: both stages, part by part of the rings.
//!
//! ```text
//! synthesis, for each part of the rings      adjoint
//!   for each batch of orders (threads):        for each block of rings (threads):
//!     a_lm → coefficients → F_m on all rings     maps → F_m for all m
//!   for each block of rings (threads):         for each batch of orders (threads):
//!     F_m for all m → maps                       F_m on all rings → coefficients → add to a_lm
//! ```
//!
//! Between the stages F_m lies in tiles of eight orders on eight ring pairs, 2 kB each, as (batch, channel, block). Rings
//! write or read one tile here and one there; the Legendre stage and its resampling take the tiles of a batch one after
//! another, as fast as memory gives them (in the adjoint, tiles far apart cost twice the time of the resampling itself; in
//! synthesis the rings would gain by the other order what the resampling loses). Tiles too large for the caches are
//! written past them. Only tiles within the polar limit exist. The size of the parts depends on Nside and lmax alone, so
//! the order of summation is the same for every batch and number of threads.

use super::equidistant::Equidistant;
use super::orders::Orders;
use super::plan::{Geometry, ShtPlan};
use super::ring_stage::TOGETHER;
use super::workers::{room, share};
use dust3d_kernels::sht::{ORDERS, PhaseTile, RingBlock, Stores};
use dust3d_kernels::simd::Level;
use num_complex::Complex;
use std::ops::Range;

pub(super) type Alm = Complex<f64>;

/// Tiles beyond this size are written past the caches: transforms gain up to 8 %, those of small maps would lose up to a
/// fifth (measured).
const CACHED_BYTES: usize = 40 << 20;

/// Scalar maps and spin-2 pairs that share a recurrence, three channels at most; scalars come first among them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Channels {
    pub(super) scalars: usize,
    pub(super) pairs: usize,
}

impl Channels {
    /// The next of what is left: one of each while there are both, then three scalars or one pair at a time.
    const fn next(scalars: usize, pairs: usize) -> Option<Self> {
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

    pub(super) const fn count(self) -> usize {
        self.scalars + 2 * self.pairs
    }

    /// Divides maps in groups. One of an odd number of channels takes the next along where `together` says so: the rings of
    /// the caps are transformed two maps at a time.
    pub(super) fn groups(mut scalars: usize, mut pairs: usize, together: bool) -> Vec<Vec<Self>> {
        let mut groups: Vec<Vec<Self>> = Vec::new();
        while let Some(next) = Self::next(scalars, pairs) {
            scalars -= next.scalars;
            pairs -= next.pairs;
            match groups.last_mut() {
                Some(group) if together && group.len() == 1 && group[0].count() % 2 == 1 => {
                    group.push(next);
                }
                _ => groups.push(vec![next]),
            }
        }
        groups
    }
}

/// The kernels refuse only slices of wrong length, and these are cut to length here.
pub(super) fn sound(result: Result<(), dust3d_kernels::Error>) {
    if let Err(error) = result {
        unreachable!("lengths of the transform's workspace: {error}");
    }
}

/// The rings of a Legendre stage.
#[derive(Clone, Copy)]
pub(super) struct Grid<'a> {
    pub(super) rings: &'a [RingBlock],
    /// Leading blocks on which spin 2 uses the spin-weighted functions.
    pub(super) polar: usize,
    /// Where these are not rings of the map.
    pub(super) equidistant: Option<&'a Equidistant>,
}

/// A part of the rings of the map, blocks `range`, and the rings of its Legendre stage.
#[derive(Clone)]
pub(super) struct Part<'a> {
    /// Those in hand that share a recurrence, the number of channels before them, and that of all.
    pub(super) channels: Channels,
    pub(super) before: usize,
    count: usize,
    pub(super) level: Level,
    pub(super) lmax: usize,
    pub(super) range: Range<usize>,
    /// How tiles are written.
    pub(super) stores: Stores,
    /// The rings of the part.
    map: Grid<'a>,
    /// The equidistant rings of the lower orders, if any.
    lower: Option<Grid<'a>>,
    pub(super) geometry: &'a Geometry,
    pub(super) orders: &'a Orders,
}

impl<'a> Part<'a> {
    /// The rings of the Legendre stage of a batch.
    pub(super) fn grid(&self, batch: usize) -> Grid<'a> {
        match self.lower {
            Some(lower) if lower.equidistant.is_some_and(|e| batch < e.batches) => lower,
            _ => self.map,
        }
    }

    /// Batches of orders.
    fn all_batches(&self) -> usize {
        self.lmax / ORDERS + 1
    }

    /// Blocks of the map that some order of a batch reaches.
    pub(super) fn active(&self, batch: usize) -> Range<usize> {
        let rings = &self.geometry.rings[self.range.clone()];
        self.range.start + rings.partition_point(|r| r.m_limit < ORDERS * batch)..self.range.end
    }

    /// Orders that reach the rings of a block.
    pub(super) fn reach(&self, block: usize) -> usize {
        self.geometry.rings[block].m_limit.min(self.lmax) + 1
    }

    /// Batches that reach a block.
    pub(super) fn batches(&self, block: usize) -> usize {
        self.reach(block).div_ceil(ORDERS)
    }

    /// Tiles of all channels.
    fn tiles(&self) -> usize {
        self.count * self.range.clone().map(|b| self.batches(b)).sum::<usize>()
    }

    /// The channels in hand among all.
    pub(super) fn in_hand(&self) -> Range<usize> {
        self.before..self.before + self.channels.count()
    }

    /// The same part with each of the channels of a group in hand.
    fn each(&self, group: &[Channels]) -> Vec<Self> {
        let mut before = 0;
        let of = |&channels: &Channels| {
            let part = Self {
                channels,
                before,
                ..self.clone()
            };
            before += channels.count();
            part
        };
        group.iter().map(of).collect()
    }

    /// Where the tiles (channel, active block) of every batch start.
    fn batch_starts(&self) -> Vec<usize> {
        let mut end = 0;
        let starts = (0..self.all_batches()).map(|batch| {
            let start = end;
            end += self.count * self.active(batch).len();
            start
        });
        starts.collect()
    }

    /// The tiles in the order (block, channel, batch) of those who write them.
    fn by_block<'t>(&self, mut tiles: &'t mut [PhaseTile]) -> Vec<&'t mut PhaseTile> {
        let mut blocks = Vec::with_capacity(tiles.len());
        let mut runs = Vec::with_capacity(self.all_batches() * self.count);
        for batch in 0..self.all_batches() {
            for _ in 0..self.count {
                if let Some(run) = tiles.split_off_mut(..self.active(batch).len()) {
                    runs.push(run.iter_mut());
                }
            }
        }
        for block in self.range.clone() {
            for channel in 0..self.count {
                let reached = runs.iter_mut().skip(channel).step_by(self.count);
                let reached = reached.take(self.batches(block));
                blocks.extend(reached.filter_map(Iterator::next));
            }
        }
        blocks
    }
}

/// Cuts every set of coefficients by orders: for each batch, for each of its m, the slices l = m … lmax of all sets.
struct ByOrder<'a> {
    rest: Vec<&'a mut [Alm]>,
    lmax: usize,
    m: usize,
}

impl<'a> Iterator for ByOrder<'a> {
    type Item = (usize, Vec<Vec<&'a mut [Alm]>>);
    fn next(&mut self) -> Option<Self::Item> {
        if self.m > self.lmax {
            return None;
        }
        let batch = self.m / ORDERS;
        let end = (self.m + ORDERS).min(self.lmax + 1);
        let orders = (self.m..end)
            .map(|m| {
                let n = self.lmax - m + 1;
                self.rest
                    .iter_mut()
                    .filter_map(|rest| rest.split_off_mut(..n))
                    .collect()
            })
            .collect();
        self.m = end;
        Some((batch, orders))
    }
}

impl ShtPlan {
    fn parts(&self) -> impl Iterator<Item = Range<usize>> + use<> {
        let (count, part) = (self.geometry.rings.len(), self.geometry.part);
        (0..count.div_ceil(part)).map(move |k| k * part..((k + 1) * part).min(count))
    }

    /// Everything shared among threads, without the workspace.
    fn part<'a>(
        geometry: &'a Geometry,
        orders: &'a Orders,
        (group, level, lmax): (&[Channels], Level, usize),
        range: Range<usize>,
    ) -> Part<'a> {
        // polar also without pairs: the adjoint sums in the same order in every group
        let grid = |rings: &'a [RingBlock], polar: usize, equidistant| Grid {
            rings,
            polar,
            equidistant,
        };
        let polar_end = geometry.polar.clamp(range.start, range.end);
        let mut part = Part {
            channels: group[0],
            before: 0,
            count: group.iter().map(|c| c.count()).sum(),
            level,
            lmax,
            map: grid(
                &geometry.rings[range.clone()],
                polar_end - range.start,
                None,
            ),
            lower: geometry
                .equidistant
                .as_ref()
                .map(|e| grid(&e.rings, e.polar, Some(e))),
            range,
            stores: Stores::Cached,
            geometry,
            orders,
        };
        if part.tiles() * size_of::<PhaseTile>() > CACHED_BYTES {
            part.stores = Stores::Streamed;
        }
        part
    }

    /// `alms` and `maps`: channel by channel.
    pub(super) fn synthesise_group(
        &mut self,
        group: &[Channels],
        alms: &[&[Alm]],
        maps: &mut [&mut [f64]],
    ) {
        let mut rest: Vec<&mut [f64]> = maps.iter_mut().map(|m| &mut **m).collect();
        for range in self.parts() {
            let part = Self::part(
                &self.geometry,
                &self.orders,
                (group, self.level, self.lmax),
                range.clone(),
            );
            let starts = part.batch_starts();
            let tiles = room(&mut self.tiles, part.tiles());
            let mut left = &mut *tiles;
            let batches = (0..part.all_batches()).filter_map(|batch| {
                let n = part.count * part.active(batch).len();
                Some((batch, left.split_off_mut(..n)?))
            });
            let each = part.each(group);
            share(&mut self.workers, batches, |own, (batch, out)| {
                for part in &each {
                    part.batch(own, batch, alms, out);
                }
            });
            let tiles = &*tiles;
            let mut tasks = Vec::with_capacity(range.len() * part.count.div_ceil(TOGETHER));
            for (number, rest) in rest.chunks_mut(TOGETHER).enumerate() {
                for block in range.clone() {
                    let (north, south) = self.geometry.pixels[block];
                    let mut maps = <[[&mut [f64]; 2]; TOGETHER]>::default();
                    for (map, rest) in maps.iter_mut().zip(rest.iter_mut()) {
                        if let Some(n) = rest.split_off_mut(..north)
                            && let Some(s) = rest.split_off_mut(rest.len() - south..)
                        {
                            *map = [n, s];
                        }
                    }
                    tasks.push(((number * TOGETHER, block), maps));
                }
            }
            // longest rings first
            share(
                &mut self.workers,
                tasks.into_iter().rev(),
                |own, (which, maps)| part.rings(own, (tiles, &starts), which, maps),
            );
        }
    }

    /// `maps` and `alms`: channel by channel.
    pub(super) fn adjoint_group(
        &mut self,
        group: &[Channels],
        weights: Option<&[[f64; 8]]>,
        maps: &[&[f64]],
        alms: &mut [&mut [Alm]],
    ) {
        let mut rest: Vec<&[f64]> = maps.to_vec();
        for range in self.parts() {
            let part = Self::part(
                &self.geometry,
                &self.orders,
                (group, self.level, self.lmax),
                range.clone(),
            );
            let tiles = room(&mut self.tiles, part.tiles());
            let mut by_block = part.by_block(tiles);
            let mut left = &mut by_block[..];
            let mut tasks = Vec::with_capacity(range.len() * part.count.div_ceil(TOGETHER));
            for block in range.clone() {
                let (north, south) = self.geometry.pixels[block];
                for rest in rest.chunks_mut(TOGETHER) {
                    let mut maps = <[[&[f64]; 2]; TOGETHER]>::default();
                    for (map, rest) in maps.iter_mut().zip(rest.iter_mut()) {
                        if let Some(n) = rest.split_off(..north)
                            && let Some(s) = rest.split_off(rest.len() - south..)
                        {
                            *map = [n, s];
                        }
                    }
                    if let Some(tiles) = left.split_off_mut(..rest.len() * part.batches(block)) {
                        tasks.push((block, maps, tiles));
                    }
                }
            }
            share(
                &mut self.workers,
                tasks.into_iter().rev(),
                |own, (block, maps, tiles)| part.rings_adjoint(own, block, weights, maps, tiles),
            );
            let orders = ByOrder {
                rest: alms.iter_mut().map(|a| &mut **a).collect(),
                lmax: self.lmax,
                m: 0,
            };
            let mut left = &*tiles;
            let batches = orders.filter_map(|(batch, alms)| {
                let n = part.count * part.active(batch).len();
                Some((batch, left.split_off(..n)?, alms))
            });
            let first = range.start == 0;
            let each = part.each(group);
            share(
                &mut self.workers,
                batches,
                |own, (batch, tiles, mut alms)| {
                    for part in &each {
                        part.batch_adjoint(own, batch, tiles, &mut alms, first);
                    }
                },
            );
        }
    }
}
