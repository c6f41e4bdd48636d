//! Discs in RING order.

use super::super::faces::FacePixel;
use super::super::layout::{self, RingPixel, first_pixel, is_shifted, quarter_length, ring_above};
use super::super::ring::location_valid;
use super::super::vector::{self, Arc, Arcs, Disc};
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
    level: Level,
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
    if vector::fits(nside) {
        match rim.check {
            None => vector::arcs(level, &rim.disc, north, south, &mut out),
            Some(_) => {
                let (rim, out) = (&rim, &mut out);
                vector::arcs(level, &rim.disc, north, south, &mut Trimmed { rim, out });
            }
        }
    } else {
        for ring in north..=south {
            out.push_arc(rim.trimmed(rim.arc(ring)));
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

impl<F: FnMut(Range<u64>)> Emitter<F> {
    /// Gives the pixels of an arc.
    #[inline]
    fn push_arc(&mut self, arc: Arc) {
        let Arc {
            first,
            len,
            west,
            count,
            ..
        } = arc;
        if count >= len {
            self.push(first..first + len);
        } else if west + count > len {
            self.push(first..first + (west + count - len));
            self.push(first + west..first + len);
        } else {
            self.push(first + west..first + west + count);
        }
    }
}

impl<F: FnMut(Range<u64>)> Arcs for Emitter<F> {
    const AS_ARCS: bool = false;

    #[inline(always)]
    fn range(&mut self, start: u64, end: u64) {
        self.push(start..end);
    }
    #[inline(always)]
    fn ranges_apart(&mut self, start: &[u64], end: &[u64]) {
        self.push_apart(start, end);
    }
    #[inline(always)]
    fn ranges_around(&mut self, pixels: Range<u64>, start: &[u64], end: &[u64]) {
        self.push_around(pixels, start, end);
    }
    fn arc(&mut self, arc: Arc) {
        self.push_arc(arc);
    }
}

/// Hands arcs on without those pixels at their ends that do not overlap with the disc.
struct Trimmed<'a, F: FnMut(Range<u64>)> {
    rim: &'a Rim,
    out: &'a mut Emitter<F>,
}

impl<F: FnMut(Range<u64>)> Arcs for Trimmed<'_, F> {
    const AS_ARCS: bool = true;

    fn range(&mut self, start: u64, end: u64) {
        self.out.push(start..end);
    }
    fn ranges_apart(&mut self, start: &[u64], end: &[u64]) {
        self.out.push_apart(start, end);
    }
    fn ranges_around(&mut self, pixels: Range<u64>, start: &[u64], end: &[u64]) {
        self.out.push_around(pixels, start, end);
    }
    fn arc(&mut self, arc: Arc) {
        self.out.push_arc(self.rim.trimmed(arc));
    }
}

/// The limit of a disc, and how to cut a ring with it.
struct Rim {
    /// Centres farther than this from the centre do not count, rad.
    reach: f64,
    disc: Disc,
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
                // The whole sphere only where even the sub-pixels say so.
                let reach = (radius + nside.max_pixel_radius()).min(PI.next_down());
                (if small >= PI { small } else { reach }, check)
            }
        };
        Ok(Self {
            reach,
            disc: Disc {
                nside,
                centre,
                turns: faces::quarter_turns(centre.phi),
                chord2: squared_chord(reach.min(PI)),
            },
            check,
        })
    }

    /// The disc's arc on a ring, by scalar arithmetic; see `vector::rim`.
    fn arc(&self, ring: u64) -> Arc {
        let Disc {
            nside,
            centre,
            turns,
            chord2,
        } = self.disc;
        let n = nside.get();
        let quarter = quarter_length(n, ring);
        let whole = Arc {
            ring,
            first: first_pixel(n, ring),
            len: 4 * quarter,
            west: 0,
            count: 4 * quarter,
        };
        let (z, s) = layout::latitude(nside, ring);
        let (dz, ds) = (z - centre.z, s - centre.sin_theta);
        let room = chord2 - dz * dz - ds * ds;
        if room < 0.0 {
            return Arc { count: 0, ..whole };
        }
        let sine2 = room / (4.0 * s * centre.sin_theta);
        let quarter = quarter as f64;
        let shift = if is_shifted(n, ring) { 0.5 } else { 0.0 };
        let at = turns * quarter - shift;
        let wrapped = |place: f64| {
            (place as i64)
                .rem_euclid(whole.len.cast_signed())
                .cast_unsigned()
        };
        // NaN (a rim that touches the pole) is a whole ring.
        if sine2 < 1.0 {
            let half = 2.0 * scalar::asin(scalar::sqrt(sine2)) * FRAC_2_PI * quarter;
            let (west, east) = (-scalar::floor(half - at), scalar::floor(at + half));
            Arc {
                west: wrapped(west),
                count: ((east - west + 1.0) as u64).min(whole.len),
                ..whole
            }
        } else {
            Arc {
                west: wrapped(scalar::floor(at - 2.0 * quarter) + 1.0),
                ..whole
            }
        }
    }

    /// The arc without those pixels at its ends that do not overlap with the disc.
    fn trimmed(&self, arc: Arc) -> Arc {
        let Some(check) = &self.check else {
            return arc;
        };
        let Arc {
            ring,
            len,
            mut west,
            mut count,
            ..
        } = arc;
        let overlaps = |place: u64| {
            let index = if place < len { place } else { place - len };
            check.overlaps(&self.disc, RingPixel { ring, index })
        };
        while count > 0 && !overlaps(west) {
            west += 1;
            count -= 1;
        }
        while count > 1 && !overlaps(west + count - 1) {
            count -= 1;
        }
        Arc {
            west: if west < len { west } else { west - len },
            count,
            ..arc
        }
    }
}

impl SubPixels {
    /// Is one of the sub-pixels along the border near enough, or is this the pixel of the centre?
    fn overlaps(&self, disc: &Disc, at: RingPixel) -> bool {
        let pixel = FacePixel::from_ring(disc.nside, at);
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
                    chord2_between(sub, disc.centre) < self.chord2
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
