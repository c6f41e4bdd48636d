//! The ring stage: F_m for all m ↔ the pixels of a block of rings.

use super::group::{Alm, Part, sound};
use super::workers::Scratch;
use dust3d_kernels::sht::{
    PhaseTile, belt_from_pixels, belt_spectrum_from_phases, phases_from_belt_spectrum,
    phases_from_spectrum, pixels_from_belt, spectrum_from_phases,
};
use num_complex::Complex;

impl Part<'_> {
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
            own.resampling.reserve(&belt.fourier);
            let data = &mut own.resampling.fine[..belt.fourier.len()];
            sound(belt_spectrum_from_phases(
                self.level,
                tiles,
                (&own.places, self.reach(block)),
                self.geometry.phase_table(block),
                &belt.fourier,
                data,
            ));
            let scratch = &mut own.resampling.scratch;
            sound(
                belt.fourier
                    .backward(self.level, &belt.table, data, scratch),
            );
            sound(pixels_from_belt(self.level, data, north, south));
            return;
        }
        let shapes = &self.geometry.shapes[block];
        own.spectra.resize(shapes.len(), Alm::default());
        sound(spectrum_from_phases(
            self.level,
            tiles,
            (&own.places, self.reach(block)),
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
            own.resampling.reserve(&belt.fourier);
            let data = &mut own.resampling.fine[..belt.fourier.len()];
            sound(belt_from_pixels(self.level, north, south, data));
            let scratch = &mut own.resampling.scratch;
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
        sound(phases_from_spectrum(
            self.level,
            &own.spectra,
            &scale,
            self.geometry.phase_table(block),
            shapes,
            tiles,
            self.reach(block),
        ));
    }
}
