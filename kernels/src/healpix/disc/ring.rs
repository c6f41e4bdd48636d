//! Discs in RING order.

use super::super::faces::FacePixel;
use super::super::layout::{self, RingPixel, first_pixel, is_shifted, quarter_length, ring_above};
use super::super::ring::location_valid;
use super::super::{Location, Nside, faces};
use super::emit::Emitter;
use super::{Inclusion, squared_chord};
use crate::healpix::location::domain;
use crate::simd::Level;
use crate::{Error, scalar};
use core::f64::consts::{FRAC_2_PI, PI};
use core::ops::Range;

/// The pixels of a disc in RING order, as ascending ranges given to `each`.
///
/// | argument | meaning |
/// | --- | --- |
/// | `centre` | of the disc |
/// | `radius` | rad; π or more is the whole sphere |
/// | `inclusion` | which pixels count |
///
/// # Errors
/// [`Error::Domain`] unless `centre` is a direction and `radius` ≥ 0, or if `fact` is 0 or makes Nside exceed 2²⁹.
///
/// ```
/// use dust3d_kernels::healpix::{Location, Nside, disc};
/// use dust3d_kernels::simd::Level;
/// let (nside, pole) = (Nside::new(4)?, Location::from_ang(0.0, 0.0)?);
/// let mut n = 0;
/// disc::ring_ranges(Level::detect(), nside, pole, 0.5, Default::default(), |range| {
///     n += range.end - range.start;
/// })?;
/// assert_eq!(n, 12); // the first two rings
/// # Ok::<(), dust3d_kernels::Error>(())
/// ```
pub fn ring_ranges(
    _level: Level,
    nside: Nside,
    centre: Location,
    radius: f64,
    inclusion: Inclusion,
    each: impl FnMut(Range<u64>),
) -> Result<(), Error> {
    centre.check()?;
    if radius.is_nan() || radius < 0.0 {
        return Err(domain("radius ≥ 0", radius));
    }
    let rim = Rim::new(nside, centre, radius, inclusion)?;
    let mut out = Emitter::new(each);
    if rim.reach >= PI {
        out.push(0..nside.npix());
        out.finish();
        return Ok(());
    }
    let (north, south) = ring_span(nside, centre, rim.reach);
    for ring in north..=south {
        if let Some((west, east)) = rim.on_ring(ring) {
            push_wrapped(&mut out, nside, ring, west, east);
        }
    }
    out.finish();
    Ok(())
}

/// The rings that can lie within `reach` of the centre, one to spare on either side.
fn ring_span(nside: Nside, centre: Location, reach: f64) -> (u64, u64) {
    let theta = centre.theta();
    let above = |theta: f64| {
        let (sin, cos) = scalar::sin_cos(theta);
        ring_above(nside, cos, scalar::abs(sin))
    };
    let (top, bottom) = (theta - reach, theta + reach);
    let north = if top <= 0.0 { 1 } else { above(top).max(1) };
    let south = if bottom >= PI {
        nside.nrings()
    } else {
        (above(bottom) + 1).min(nside.nrings())
    };
    (north, south)
}

/// Gives the places `west` ..= `east` of a ring, which may be negative or pass its end, but are fewer than its length.
#[inline]
fn push_wrapped<F: FnMut(Range<u64>)>(
    out: &mut Emitter<F>,
    nside: Nside,
    ring: u64,
    west: i64,
    east: i64,
) {
    let n = nside.get();
    let first = first_pixel(n, ring);
    let len = 4 * quarter_length(n, ring);
    let count = (east - west + 1).cast_unsigned();
    if count >= len {
        return out.push(first..first + len);
    }
    let west = west.rem_euclid(len.cast_signed()).cast_unsigned();
    let end = west + count;
    if end > len {
        out.push(first..first + (end - len));
        out.push(first + west..first + len);
    } else {
        out.push(first + west..first + end);
    }
}

/// The limit of a disc, and how to cut a ring with it.
struct Rim {
    nside: Nside,
    centre: Location,
    /// φ₀ in quarter turns.
    turns: f64,
    /// Centres farther than this from the centre do not count, rad.
    reach: f64,
    /// 4 sin²(reach/2).
    chord2: f64,
    check: Option<SubPixels>,
}

/// The test of the outermost pixels of a ring by their sub-pixels.
struct SubPixels {
    nside: Nside,
    fact: u64,
    chord2: f64,
    /// The pixel that holds the disc's centre counts in any case.
    home: FacePixel,
}

impl Rim {
    fn new(
        nside: Nside,
        centre: Location,
        radius: f64,
        inclusion: Inclusion,
    ) -> Result<Self, Error> {
        let (reach, check) = match inclusion {
            Inclusion::Centres => (radius, None),
            Inclusion::Overlapping { fact } => {
                let reach = radius + nside.max_pixel_radius();
                let fine = u64::from(fact) * nside.get();
                let fine = Nside::new(fine)
                    .map_err(|_| domain("fact · nside in 1 … 2^29", fine as f64))?;
                let small = radius + fine.max_pixel_radius();
                let check = (fact > 1).then(|| SubPixels {
                    nside: fine,
                    fact: u64::from(fact),
                    chord2: squared_chord(small.min(PI)),
                    home: FacePixel::from_location(nside, centre),
                });
                (if small >= PI { small } else { reach.min(PI) }, check)
            }
        };
        Ok(Self {
            nside,
            centre,
            turns: faces::quarter_turns(centre.phi),
            reach,
            chord2: squared_chord(reach.min(PI)),
            check,
        })
    }

    /// First and last place of the disc on a ring.
    #[inline]
    fn on_ring(&self, ring: u64) -> Option<(i64, i64)> {
        let n = self.nside.get();
        let (z, s) = layout::latitude(self.nside, ring);
        let (dz, ds) = (z - self.centre.z, s - self.centre.sin_theta);
        let room = self.chord2 - dz * dz - ds * ds;
        if room < 0.0 {
            return None;
        }
        let quarter = quarter_length(n, ring) as f64;
        let sine2 = room / (4.0 * s * self.centre.sin_theta);
        let shift = if is_shifted(n, ring) { 0.5 } else { 0.0 };
        let at = self.turns * quarter - shift;
        // NaN (a rim that touches the pole) is a whole ring.
        let (mut west, mut east) = if sine2 < 1.0 {
            let half = 2.0 * scalar::asin(scalar::sqrt(sine2)) * FRAC_2_PI * quarter;
            (-scalar::floor(half - at), scalar::floor(at + half))
        } else {
            let half = 2.0 * quarter;
            (scalar::floor(at - half) + 1.0, scalar::floor(at + half))
        };
        if let Some(check) = &self.check {
            while west <= east && !check.overlaps(self, ring, west as i64) {
                west += 1.0;
            }
            while west < east && !check.overlaps(self, ring, east as i64) {
                east -= 1.0;
            }
        }
        (west <= east).then_some((west as i64, east as i64))
    }
}

impl SubPixels {
    /// Is one of the sub-pixels along the border near enough, or is this the pixel of the centre?
    fn overlaps(&self, rim: &Rim, ring: u64, index: i64) -> bool {
        let len = 4 * quarter_length(rim.nside.get(), ring);
        let index = index.rem_euclid(len.cast_signed()).cast_unsigned();
        let pixel = FacePixel::from_ring(rim.nside, RingPixel { ring, index });
        if pixel == self.home {
            return true;
        }
        let (x, y, last) = (pixel.x * self.fact, pixel.y * self.fact, self.fact - 1);
        (0..last).any(|i| {
            [(i, 0), (last, i), (last - i, last), (0, last - i)]
                .into_iter()
                .any(|(dx, dy)| {
                    let sub = FacePixel {
                        face: pixel.face,
                        x: x + dx,
                        y: y + dy,
                    };
                    let sub = location_valid(self.nside, sub.to_ring(self.nside));
                    chord2_between(sub, rim.centre) < self.chord2
                })
        })
    }
}

/// The squared chord between two directions.
#[inline]
pub(super) fn chord2_between(a: Location, b: Location) -> f64 {
    let (dz, ds) = (a.z - b.z, a.sin_theta - b.sin_theta);
    let sine = scalar::sin(0.5 * (a.phi - b.phi));
    dz * dz + ds * ds + 4.0 * a.sin_theta * b.sin_theta * sine * sine
}
