//! The ring stage: F_m for all m ↔ the pixels of a block of rings.

use super::group::{Part, sound};
use super::workers::Scratch;
use dust3d_kernels::sht::{
    CAP_MAPS, CapRing, MARGIN, PhaseTile, belt_from_pixels, belt_spectrum_from_phases,
    cap_from_pixels, cap_room, cap_spectrum_from_phases, phases_from_belt_spectrum,
    phases_from_cap_spectrum, pixels_from_belt, pixels_from_cap,
};
use std::ops::Range;

/// Maps whose rings are transformed together, those of the caps.
pub(super) const TOGETHER: usize = CAP_MAPS;

/// Where the next ring lies, in the north and in the south, where they come in the opposite order and the equator is
/// missing.
struct RingPlaces {
    start: usize,
    end: usize,
}

impl RingPlaces {
    fn next(&mut self, ring: &CapRing<'_>) -> [Range<usize>; 2] {
        let n = 4 * ring.quarter;
        let north = self.start..self.start + n;
        let south = self.end.saturating_sub(n)..self.end;
        (self.start, self.end) = (north.end, south.start);
        [north, south]
    }
}

impl Part<'_> {
    /// Collects the tiles (batch, channel, active block) of a block, in order.
    fn tiles_of(&self, starts: &[usize], channel: usize, block: usize, places: &mut Vec<usize>) {
        places.extend((0..self.batches(block)).map(|batch| {
            let active = self.active(batch);
            starts[batch] + channel * active.len() + (block - active.start)
        }));
    }

    /// Tiles of F_m → the pixels of a block of rings, \[north, south\] of neighbouring channels.
    pub(super) fn rings(
        &self,
        own: &mut Scratch,
        (tiles, starts): (&[PhaseTile], &[usize]),
        (channel, block): (usize, usize),
        maps: [[&mut [f64]; 2]; TOGETHER],
    ) {
        own.places.clear();
        let count = maps.iter().filter(|[north, _]| !north.is_empty()).count();
        for c in 0..count {
            self.tiles_of(starts, channel + c, block, &mut own.places);
        }
        let each = self.batches(block);
        let reach = self.reach(block);
        let table = self.geometry.phase_table(block);
        if let Some(belt) = self.geometry.belt(block) {
            let (data, scratch) = own.resampling.one(&belt.fourier);
            for (places, [north, south]) in own.places.chunks_exact(each).zip(maps) {
                sound(belt_spectrum_from_phases(
                    self.level,
                    tiles,
                    (places, reach),
                    table,
                    &belt.fourier,
                    data,
                ));
                sound(
                    belt.fourier
                        .backward(self.level, &belt.table, data, scratch),
                );
                sound(pixels_from_belt(self.level, data, north, south));
            }
            return;
        }
        let (caps, rings) = (&self.geometry.caps, self.geometry.caps.rings(block));
        let geometry = rings.map(|ring| Some(ring?.0));
        let (data, scratch) = own.resampling.caps(cap_room(&geometry), &rings);
        let (first, second) = own.places.split_at(each);
        sound(cap_spectrum_from_phases(
            self.level,
            tiles,
            ([first, second], reach),
            table,
            &geometry,
            data,
        ));
        let mut maps = maps;
        let mut places = RingPlaces {
            start: 0,
            end: maps[0][1].len(),
        };
        let mut rest = data;
        for (ring, ready) in rings.iter().flatten() {
            let Some(data) = rest.split_off_mut(..ring.room()) else {
                break;
            };
            let n = ring.fourier.len();
            let points = &mut data[MARGIN..MARGIN + n];
            sound(
                ready
                    .fourier
                    .backward(self.level, &ready.table, points, scratch),
            );
            let [north, south] = places.next(ring);
            let cut = maps.each_mut().map(|[n, s]| {
                [
                    n.get_mut(north.clone()).unwrap_or_default(),
                    s.get_mut(south.clone()).unwrap_or_default(),
                ]
            });
            sound(pixels_from_cap(self.level, ring, &caps.window, data, cut));
        }
    }

    /// The pixels of a block of rings, \[north, south\] of neighbouring channels → tiles of F_m for all m, one channel
    /// after the other.
    pub(super) fn rings_adjoint(
        &self,
        own: &mut Scratch,
        block: usize,
        weights: Option<&[[f64; 8]]>,
        maps: [[&[f64]; 2]; TOGETHER],
        tiles: &mut [&mut PhaseTile],
    ) {
        let scale = weights.map_or([1.0; 8], |weights| weights[block]);
        let each = self.batches(block);
        let reach = self.reach(block);
        let table = self.geometry.phase_table(block);
        if let Some(belt) = self.geometry.belt(block) {
            let (data, scratch) = own.resampling.one(&belt.fourier);
            for (tiles, [north, south]) in tiles.chunks_exact_mut(each).zip(maps) {
                sound(belt_from_pixels(self.level, north, south, data));
                sound(belt.fourier.forward(self.level, &belt.table, data, scratch));
                sound(phases_from_belt_spectrum(
                    self.level,
                    data,
                    &belt.fourier,
                    &scale,
                    table,
                    (tiles, reach),
                    self.stores,
                ));
            }
            return;
        }
        let (caps, rings) = (&self.geometry.caps, self.geometry.caps.rings(block));
        let geometry = rings.map(|ring| Some(ring?.0));
        let (data, scratch) = own.resampling.caps(cap_room(&geometry), &rings);
        let mut places = RingPlaces {
            start: 0,
            end: maps[0][1].len(),
        };
        let mut rest = &mut *data;
        for (ring, ready) in rings.iter().flatten() {
            let Some(data) = rest.split_off_mut(..ring.room()) else {
                break;
            };
            let [north, south] = places.next(ring);
            let cut = maps.map(|[n, s]| {
                [
                    n.get(north.clone()).unwrap_or_default(),
                    s.get(south.clone()).unwrap_or_default(),
                ]
            });
            sound(cap_from_pixels(self.level, ring, &caps.window, cut, data));
            let n = ring.fourier.len();
            let points = &mut data[MARGIN..MARGIN + n];
            sound(
                ready
                    .fourier
                    .forward(self.level, &ready.table, points, scratch),
            );
        }
        let (first, second) = tiles.split_at_mut(each);
        sound(phases_from_cap_spectrum(
            self.level,
            data,
            &geometry,
            &scale,
            table,
            ([first, second], reach),
            self.stores,
        ));
    }
}
