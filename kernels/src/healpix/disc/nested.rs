//! Discs in NESTED order.

use super::super::faces::{FacePixel, quarter_turns};
use super::super::ring::location_valid;
use super::super::vector::{self, LEVELS, Near, Quads};
use super::super::{Location, Nside};
use super::emit::Emitter;
use super::ring::chord2_between;
use super::window::Window;
use super::{Inclusion, squared_chord};
use crate::healpix::location::domain;
use crate::simd::Level;
use crate::{Error, scalar};
use core::f64::consts::PI;
use core::ops::Range;

/// The pixels of a disc in NESTED order, as ascending ranges given to `each`.
///
/// Arguments as of [`ring_ranges`](super::ring_ranges). With [`Inclusion::Centres`] the pixels are the same.
///
/// # Errors
/// [`Error::Nside`] where Nside is not a power of two; [`Error::Domain`] unless `centre` is a direction and `radius` ≥ 0,
/// or if `fact` is not a power of two or makes Nside exceed 2²⁹.
pub fn nested_ranges(
    level: Level,
    nside: Nside,
    centre: Location,
    radius: f64,
    inclusion: Inclusion,
    each: impl FnMut(Range<u64>),
) -> Result<(), Error> {
    let order = nside.nested_order()?;
    centre.check()?;
    if radius.is_nan() || radius < 0.0 {
        return Err(domain("radius ≥ 0", radius));
    }
    let deepest = match inclusion {
        Inclusion::Centres => order,
        Inclusion::Overlapping { fact } => {
            let fine = u64::from(fact) * nside.get();
            match Nside::new(fine).map(Nside::order) {
                Ok(Some(fine)) => fine,
                _ => {
                    return Err(domain(
                        "fact: a power of two with fact · nside ≤ 2^29",
                        f64::from(fact),
                    ));
                }
            }
        }
    };
    let mut out = Emitter::new(each);
    if radius >= PI {
        out.push(0..nside.npix());
        out.finish();
        return Ok(());
    }
    let is_plain = inclusion == Inclusion::Centres;
    let (sin, cos) = scalar::sin_cos(0.5 * radius);
    let chord2 = 4.0 * sin * sin;
    let mut start = None;
    if is_plain && let Some(window) = Window::around(centre, radius) {
        if let Some(pixel) = window.only(order) {
            let there = location_valid(nside, pixel.to_ring(nside));
            if chord2_between(there, centre) <= chord2 {
                let number = pixel.to_nested(order);
                out.push(number..number + 1);
            }
            out.finish();
            return Ok(());
        }
        start = window.level(order).map(|level| (window, level));
    }
    let mut near = Near {
        centre,
        turns: 0.25 * quarter_turns(centre.phi),
        order,
        start,
        outer: [4.0; LEVELS],
        inner: [-1.0; LEVELS],
    };
    if is_plain {
        for level in near.levels() {
            near.set(level, quick_bounds(sin, cos, level));
        }
    } else {
        for level in 0..deepest + 1 {
            near.set(level, bounds(radius, level));
        }
    }
    // At the level of the map, centres decide; around them, sub-pixels do.
    let outer = if is_plain {
        chord2
    } else {
        bounds(radius, order).0
    };
    near.set(order, (outer, chord2.next_up()));
    let rim = Rim {
        order,
        deepest,
        centre,
        chord2,
        outside: &near.outer,
    };
    let mut leaves = Leaves { rim, out: &mut out };
    vector::quads(level, &near, &mut leaves);
    out.finish();
    Ok(())
}

/// Squared chords of radius + and − the greatest radius of a pixel on a level, the latter −1 if there is none.
fn bounds(radius: f64, level: u32) -> (f64, f64) {
    let Ok(nside) = Nside::new(1 << level) else {
        return (4.0, -1.0);
    };
    let pixel = nside.max_pixel_radius();
    let inside = if radius > pixel {
        squared_chord(radius - pixel)
    } else {
        -1.0
    };
    (squared_chord((radius + pixel).min(PI)), inside)
}

/// A little more and a little less than those, from the sine and cosine of half the radius r.
///
/// The sine of half a pixel's radius p is below 0.5345/Nside, the limit for fine grids; sin(r/2 ± p/2) is from the addition
/// theorem, with bounds for cos(p/2).
#[inline]
fn quick_bounds(sin: f64, cos: f64, level: u32) -> (f64, f64) {
    let pixel = 0.5345 / (1_u64 << level) as f64;
    let square = pixel * pixel;
    let (most, least) = (1.0 - 0.5 * square, 1.0 - 0.5 * square * (1.0 + square));
    let outer = if cos > pixel {
        sin * most + cos * pixel
    } else {
        1.0
    };
    let inner = sin * least - cos * pixel;
    let inside = if inner > 0.0 {
        4.0 * inner * inner
    } else {
        -1.0
    };
    (4.0 * outer * outer, inside)
}

/// Pixels whose sub-pixels decide.
struct Rim<'a> {
    order: u32,
    deepest: u32,
    centre: Location,
    chord2: f64,
    outside: &'a [f64; LEVELS],
}

impl Rim<'_> {
    /// Does a pixel of the map's level overlap with the disc? Its centre lies outside, but not too far.
    ///
    /// Depth first, without a stack: the next pixel of a level is the next number, and a number divisible by four means
    /// that a quad is done and its parent's successor is next.
    fn overlaps(&self, pixel: u64) -> bool {
        if self.order == self.deepest {
            return true;
        }
        let (mut level, mut sub) = (self.order + 1, 4 * pixel);
        while level > self.order {
            let chord2 = self.chord2_of(level, sub);
            let outside = self.outside.get(level as usize).copied().unwrap_or(0.0);
            if chord2 <= self.chord2 || (level == self.deepest && chord2 <= outside) {
                return true;
            }
            if chord2 <= outside {
                level += 1;
                sub *= 4;
                continue;
            }
            sub += 1;
            while level > self.order && sub.is_multiple_of(4) {
                level -= 1;
                sub /= 4;
            }
        }
        false
    }

    fn chord2_of(&self, level: u32, pixel: u64) -> f64 {
        let Ok(nside) = Nside::new(1 << level) else {
            return 4.0;
        };
        let centre = location_valid(nside, FacePixel::from_nested(level, pixel).to_ring(nside));
        chord2_between(centre, self.centre)
    }
}

/// Hands pixels on as ranges.
struct Leaves<'a, F: FnMut(Range<u64>)> {
    rim: Rim<'a>,
    out: &'a mut Emitter<F>,
}

impl<F: FnMut(Range<u64>)> Quads for Leaves<'_, F> {
    #[inline(always)]
    fn range(&mut self, start: u64, end: u64) {
        self.out.push(start..end);
    }
    fn rim(&mut self, pixel: u64) {
        if self.rim.overlaps(pixel) {
            self.out.push(pixel..pixel + 1);
        }
    }
}
