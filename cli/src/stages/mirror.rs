//! Southern pixels from northern ones, for what does not know north from south.
//!
//! Every ring of a RING map has its mirror image at the opposite latitude, with the same longitudes: half of the sky,
//! the equator included, is all that has to be computed.

use crate::Error;
use crate::parallel::CHUNK;
use dust3d_kernels::healpix::Nside;
use dust3d_kernels::healpix::layout::{self, Ring};
use rayon::prelude::*;

/// Number of pixels from the north pole to the equator's ring, which is the last of them.
#[must_use]
pub const fn north_len(nside: Nside) -> usize {
    ((nside.npix() + 4 * nside.get()) / 2) as usize
}

/// Fills `out` (pixels `first` …) with the values of `north`, [`north_len`] pixels, at the mirrored places.
///
/// # Errors
/// If a pixel does not exist.
///
/// # Panics
/// If `north` is too short.
pub fn reflect(nside: Nside, north: &[f64], first: usize, out: &mut [f64]) -> Result<(), Error> {
    out.par_chunks_mut(CHUNK)
        .enumerate()
        .try_for_each(|(k, mut rest)| {
            let mut pixel = (first + k * CHUNK) as u64;
            while !rest.is_empty() {
                let at = layout::locate(nside, pixel)?;
                let ring = Ring::new(nside, at.ring)?;
                let count = ((ring.len() - at.index) as usize).min(rest.len());
                let (here, after) = rest.split_at_mut(count);
                let source = (ring.mirrored().first_pixel() + at.index) as usize;
                here.copy_from_slice(&north[source..source + count]);
                pixel += count as u64;
                rest = after;
            }
            Ok(())
        })
}

#[cfg(test)]
mod tests {
    use super::{north_len, reflect};
    use dust3d_kernels::healpix::{Nside, ring};

    #[test]
    fn southern_pixels_are_the_mirrored_ones() {
        for nside in [1, 2, 5, 64] {
            let nside = Nside::new(nside).expect("a valid Nside");
            let z = |p: usize| ring::pix2vec(nside, p as u64).expect("a pixel");
            let north: Vec<f64> = (0..north_len(nside)).map(|p| p as f64).collect();
            assert!(z(north.len() - 1)[2].abs() < 1e-15);
            let first = north.len() - 3;
            let mut out = vec![-1.0; nside.npix() as usize - north.len()];
            reflect(nside, &north, north.len(), &mut out).expect("pixels");
            for (p, &q) in (north.len()..).zip(&out) {
                let ([x, y, z], [u, v, w]) = (z(p), z(q as usize));
                assert!([x, y, z] == [u, v, -w], "{p}");
            }
            let mut all = vec![-1.0; out.len() + 3];
            assert_eq!(reflect(nside, &north, first, &mut all).ok(), Some(()));
            assert_eq!(all[3..], out);
        }
    }
}
