//! The ring stage: F_m for all m ↔ the pixels of a block of rings.

use super::group::{Alm, Part, sound};
use super::workers::{Scratch, room};
use dust3d_kernels::sht::{
    PhaseTile, belt_from_pixels, belt_spectrum_from_phases, phases_from_belt_spectrum,
    phases_from_spectrum, pixels_from_belt, pixels_from_ring, ring_from_pixels,
    spectrum_from_phases,
};
use std::ops::Range;

impl Part<'_> {
    /// One sequence, in place.
    fn fft(&self, ring: &mut [Alm], scratch: &mut Vec<Alm>) {
        let fft = &self.geometry.ffts[ring.len() / 4 - 1];
        let need = fft.get_inplace_scratch_len();
        fft.process_with_scratch(ring, room(scratch, need));
    }

    /// Where the rings of a block lie, in the north (and in its spectra) and in the south, where they come in the
    /// opposite order and the equator is missing.
    fn ring_places(&self, block: usize, south: usize) -> impl Iterator<Item = [Range<usize>; 2]> {
        let pixels = &self.geometry.shapes[block].pixels;
        let (mut start, mut end) = (0, south);
        pixels.iter().filter(|&&n| n > 0).map(move |&n| {
            let north = start..start + n;
            let south = end.saturating_sub(n)..end;
            start += n;
            end = south.start;
            [north, south]
        })
    }

    /// Tiles (batch, channel, active block) of F_m → the pixels of one block of rings, one channel.
    pub(super) fn rings(
        &self,
        own: &mut Scratch,
        tiles: &[PhaseTile],
        starts: &[usize],
        (channel, block): (usize, usize),
        north: &mut [f64],
        south: &mut [f64],
    ) {
        own.places.clear();
        for (batch, start) in starts.iter().enumerate().take(self.batches(block)) {
            let active = self.active(batch);
            own.places
                .push(start + channel * active.len() + (block - active.start));
        }
        if let Some(belt) = self.geometry.belt(block) {
            let (data, scratch) = own.resampling.one(&belt.fourier);
            sound(belt_spectrum_from_phases(
                self.level,
                tiles,
                (&own.places, self.reach(block)),
                self.geometry.phase_table(block),
                &belt.fourier,
                data,
            ));
            sound(
                belt.fourier
                    .backward(self.level, &belt.table, data, scratch),
            );
            sound(pixels_from_belt(self.level, data, north, south));
            return;
        }
        let shapes = &self.geometry.shapes[block];
        let spectra = room(&mut own.spectra, shapes.len());
        sound(spectrum_from_phases(
            self.level,
            tiles,
            (&own.places, self.reach(block)),
            self.geometry.phase_table(block),
            shapes,
            spectra,
        ));
        for [n, s] in self.ring_places(block, south.len()) {
            let ring = &mut spectra[n.clone()];
            self.fft(ring, &mut own.fft);
            sound(pixels_from_ring(
                self.level,
                ring,
                &mut north[n],
                &mut south[s],
            ));
        }
    }

    /// The pixels of one block of rings, one channel → tiles of F_m for all m.
    pub(super) fn rings_adjoint(
        &self,
        own: &mut Scratch,
        block: usize,
        weights: Option<&[[f64; 8]]>,
        north: &[f64],
        south: &[f64],
        tiles: &mut [PhaseTile],
    ) {
        let scale = weights.map_or([1.0; 8], |weights| weights[block]);
        if let Some(belt) = self.geometry.belt(block) {
            let (data, scratch) = own.resampling.one(&belt.fourier);
            sound(belt_from_pixels(self.level, north, south, data));
            sound(belt.fourier.forward(self.level, &belt.table, data, scratch));
            sound(phases_from_belt_spectrum(
                self.level,
                data,
                &belt.fourier,
                &scale,
                self.geometry.phase_table(block),
                tiles,
                self.reach(block),
            ));
            return;
        }
        let shapes = &self.geometry.shapes[block];
        let spectra = room(&mut own.spectra, shapes.len());
        for [n, s] in self.ring_places(block, south.len()) {
            let ring = &mut spectra[n.clone()];
            sound(ring_from_pixels(self.level, &north[n], &south[s], ring));
            self.fft(ring, &mut own.fft);
        }
        sound(phases_from_spectrum(
            self.level,
            spectra,
            &scale,
            self.geometry.phase_table(block),
            shapes,
            tiles,
            self.reach(block),
        ));
    }
}
