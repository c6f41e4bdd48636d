//! Discs in NESTED order.

use super::super::faces::FacePixel;
use super::super::ring::location_valid;
use super::super::{Location, Nside};
use super::emit::Emitter;
use super::ring::chord2_between;
use super::{Inclusion, squared_chord};
use crate::Error;
use crate::healpix::location::domain;
use core::f64::consts::PI;
use core::ops::Range;

/// Levels of the quadtree, 2⁰ … 2²⁹.
const LEVELS: usize = 30;

/// The pixels of a disc in NESTED order, as ascending ranges given to `each`.
///
/// Arguments as of [`ring_ranges`](super::ring_ranges). With [`Inclusion::Centres`] the pixels are the same.
///
/// # Errors
/// [`Error::Nside`] where Nside is not a power of two; [`Error::Domain`] unless `centre` is a direction and `radius` ≥ 0,
/// or if `fact` is not a power of two or makes Nside exceed 2²⁹.
pub fn nested_ranges(
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
    } else {
        let walk = Walk {
            order,
            deepest,
            overlapping: inclusion != Inclusion::Centres,
            centre,
            chord2: squared_chord(radius),
            bounds: Bounds::new(radius),
        };
        walk.run(&mut out);
    }
    out.finish();
    Ok(())
}

/// Squared chords of radius ± pixel radius on every level.
struct Bounds {
    outside: [f64; LEVELS],
    inside: [f64; LEVELS],
}

impl Bounds {
    fn new(radius: f64) -> Self {
        let mut bounds = Self {
            outside: [4.0; LEVELS],
            inside: [-1.0; LEVELS],
        };
        for (level, (outside, inside)) in bounds
            .outside
            .iter_mut()
            .zip(&mut bounds.inside)
            .enumerate()
        {
            let Ok(nside) = Nside::new(1 << level) else {
                break;
            };
            let pixel = nside.max_pixel_radius();
            *outside = squared_chord((radius + pixel).min(PI));
            if radius > pixel {
                *inside = squared_chord(radius - pixel);
            }
        }
        bounds
    }
}

/// Where a pixel lies.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Zone {
    Outside,
    /// Its centre is outside, but no farther than its radius.
    Rim,
    CentreInside,
    Inside,
}

struct Walk {
    order: u32,
    deepest: u32,
    overlapping: bool,
    centre: Location,
    chord2: f64,
    bounds: Bounds,
}

/// What to do with a pixel of the tree.
enum Verdict {
    Skip,
    Open,
    /// All of its pixels of the map's level (or the one it lies in).
    Take,
}

impl Walk {
    fn zone(&self, level: u32, pixel: u64) -> Zone {
        let Ok(nside) = Nside::new(1 << level) else {
            return Zone::Outside;
        };
        let centre = location_valid(nside, FacePixel::from_nested(level, pixel).to_ring(nside));
        let chord2 = chord2_between(centre, self.centre);
        let at = |table: &[f64; LEVELS]| table.get(level as usize).copied().unwrap_or(0.0);
        if chord2 > at(&self.bounds.outside) {
            Zone::Outside
        } else if chord2 > self.chord2 {
            Zone::Rim
        } else if chord2 >= at(&self.bounds.inside) {
            Zone::CentreInside
        } else {
            Zone::Inside
        }
    }

    fn verdict(&self, level: u32, pixel: u64) -> Verdict {
        let zone = self.zone(level, pixel);
        if zone == Zone::Outside {
            return Verdict::Skip;
        }
        if level < self.order {
            return if zone == Zone::Inside {
                Verdict::Take
            } else {
                Verdict::Open
            };
        }
        if zone >= Zone::CentreInside {
            Verdict::Take
        } else if !self.overlapping {
            Verdict::Skip
        } else if level < self.deepest {
            Verdict::Open
        } else {
            Verdict::Take
        }
    }

    /// Depth first, without a stack: the next pixel of a level is the next number, and a number divisible by four means
    /// that a quad is done and its parent's successor is next.
    fn run<F: FnMut(Range<u64>)>(&self, out: &mut Emitter<F>) {
        let (mut level, mut pixel) = (0, 0);
        loop {
            match self.verdict(level, pixel) {
                Verdict::Open => {
                    level += 1;
                    pixel *= 4;
                    continue;
                }
                Verdict::Take if level <= self.order => {
                    let below = 2 * (self.order - level);
                    out.push(pixel << below..(pixel + 1) << below);
                }
                Verdict::Take => {
                    pixel >>= 2 * (level - self.order);
                    level = self.order;
                    out.push(pixel..pixel + 1);
                }
                Verdict::Skip => {}
            }
            pixel += 1;
            while level > 0 && pixel.is_multiple_of(4) {
                level -= 1;
                pixel /= 4;
            }
            if level == 0 && pixel >= 12 {
                return;
            }
        }
    }
}
