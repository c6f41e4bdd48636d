//! Where a point of the picture lies on the sky, and back.
//!
//! The picture is a plane (x to the right, y up) in units of its own: Mollweide's ellipse is |x| ≤ 2, |y| ≤ 1; the
//! gnomonic square is |x|, |y| ≤ 1. Longitude increases to the left.

use crate::error::Result;
use crate::kernels::healpix::{Location, Nside, ring};
use std::borrow::Cow;
use std::f64::consts::{FRAC_PI_2, PI};

/// What a picture shows.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum View {
    /// The whole sky, equal areas, l = 0 in the middle.
    #[default]
    Mollweide,
    /// A square around a point, projected on the tangent plane.
    Gnomonic {
        /// Galactic longitude of the middle, degrees.
        lon_deg: f64,
        /// Galactic latitude of the middle, degrees.
        lat_deg: f64,
        /// Side of the square, degrees, below 180.
        size_deg: f64,
    },
}

impl View {
    /// Half the width of the plane; half the height is 1.
    pub(super) const fn half_width(self) -> f64 {
        match self {
            Self::Mollweide => 2.0,
            Self::Gnomonic { .. } => 1.0,
        }
    }

    /// The values of a map (RING order) that a picture shows, for choosing its scale.
    ///
    /// # Errors
    /// An Nside that no map has.
    pub fn visible<'a>(self, nside: u32, values: &'a [f64]) -> Result<Cow<'a, [f64]>> {
        if matches!(self, Self::Mollweide) {
            return Ok(Cow::Borrowed(values));
        }
        let nside = Nside::new(nside.into())?;
        let mut shown = Vec::new();
        for (pixel, value) in values.iter().enumerate() {
            let (theta, phi) = ring::pix2ang(nside, pixel as u64)?;
            let inside = |(x, y): (f64, f64)| x.abs() <= 1.0 && y.abs() <= 1.0;
            if self.plane((phi, FRAC_PI_2 - theta)).is_some_and(inside) {
                shown.push(*value);
            }
        }
        // A detail smaller than a pixel may hold no centre at all.
        if shown.is_empty() {
            return Ok(Cow::Borrowed(values));
        }
        Ok(Cow::Owned(shown))
    }

    /// The line of the plane at height y, with all that its points share.
    pub(super) fn row(self, y: f64) -> Row {
        match self {
            Self::Mollweide => {
                // y = sin a is the sine of the auxiliary angle of the parallel, sin b = (2a + sin 2a)/π.
                let cos = ((1.0 - y) * (1.0 + y)).max(0.0).sqrt();
                let z = ((2.0 * y.clamp(-1.0, 1.0).asin() + 2.0 * y * cos) / PI).clamp(-1.0, 1.0);
                Row::Parallel {
                    reach: if y.abs() <= 1.0 { 2.0 * cos } else { -1.0 },
                    z,
                    sin_theta: ((1.0 - z) * (1.0 + z)).sqrt(),
                }
            }
            Self::Gnomonic {
                lon_deg,
                lat_deg,
                size_deg,
            } => {
                let reach = (size_deg.to_radians() / 2.0).tan();
                let (sin, cos) = lat_deg.to_radians().sin_cos();
                // Tangent plane: the unit vector to the middle, east to the left, north.
                let north = y * reach;
                Row::Tangent {
                    reach,
                    lon: lon_deg.to_radians(),
                    along: cos - north * sin,
                    up: sin + north * cos,
                }
            }
        }
    }

    /// The point of the plane where a direction appears; `None` if it is not in front of the tangent plane.
    pub(super) fn plane(self, (lon, lat): (f64, f64)) -> Option<(f64, f64)> {
        match self {
            Self::Mollweide => {
                let angle = auxiliary_angle(lat);
                let lon = if lon.abs() <= PI {
                    lon
                } else {
                    lon - 2.0 * PI * (lon / (2.0 * PI)).round()
                };
                Some((-lon * angle.cos() / FRAC_PI_2, angle.sin()))
            }
            Self::Gnomonic {
                lon_deg,
                lat_deg,
                size_deg,
            } => {
                let reach = (size_deg.to_radians() / 2.0).tan();
                let (sin0, cos0) = lat_deg.to_radians().sin_cos();
                let (sin, cos) = lat.sin_cos();
                let (dsin, dcos) = (lon - lon_deg.to_radians()).sin_cos();
                let depth = sin0 * sin + cos0 * cos * dcos;
                (depth > 1e-3).then(|| {
                    let east = cos * dsin / depth;
                    let north = (cos0 * sin - sin0 * cos * dcos) / depth;
                    (-east / reach, north / reach)
                })
            }
        }
    }
}

/// One line of the plane.
#[derive(Debug, Clone, Copy)]
pub(super) enum Row {
    /// All points have one latitude.
    Parallel { reach: f64, z: f64, sin_theta: f64 },
    /// Points are (along, east, up) with east = −x · reach, turned by lon about the axis.
    Tangent {
        reach: f64,
        lon: f64,
        along: f64,
        up: f64,
    },
}

impl Row {
    /// The direction at x; `None` off the sky.
    pub(super) fn at(self, x: f64) -> Option<Location> {
        match self {
            Self::Parallel {
                reach,
                z,
                sin_theta,
            } => (x.abs() <= reach).then(|| Location {
                z,
                sin_theta,
                phi: if reach > 0.0 { -PI * x / reach } else { 0.0 },
            }),
            Self::Tangent {
                reach,
                lon,
                along,
                up,
            } => {
                let east = -x * reach;
                let flat = along * along + east * east;
                let norm = (flat + up * up).sqrt();
                Some(Location {
                    z: up / norm,
                    sin_theta: flat.sqrt() / norm,
                    phi: lon + east.atan2(along),
                })
            }
        }
    }
}

/// Mollweide's auxiliary angle a of a latitude, 2a + sin 2a = π sin b, by Newton's method.
fn auxiliary_angle(lat: f64) -> f64 {
    let target = PI * lat.sin();
    let mut angle = lat;
    for _ in 0..50 {
        let slope = 2.0 + 2.0 * (2.0 * angle).cos();
        if slope < 1e-12 {
            break;
        }
        let step = (2.0 * angle + (2.0 * angle).sin() - target) / slope;
        angle = (angle - step).clamp(-FRAC_PI_2, FRAC_PI_2);
        if step.abs() < 1e-12 {
            break;
        }
    }
    angle
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Longitude and latitude at (x, y).
    fn sky(view: View, x: f64, y: f64) -> Option<(f64, f64)> {
        view.row(y)
            .at(x)
            .map(|location| (location.phi, FRAC_PI_2 - location.theta()))
    }

    #[test]
    fn prop_grid_plane_inverts_sky() {
        let views = [
            View::Mollweide,
            View::Gnomonic {
                lon_deg: 30.0,
                lat_deg: 50.0,
                size_deg: 40.0,
            },
            View::Gnomonic {
                lon_deg: 0.0,
                lat_deg: -90.0,
                size_deg: 100.0,
            },
        ];
        for view in views {
            for i in -19..20 {
                for j in -19..20 {
                    let (x, y) = (f64::from(i) / 20.0 * view.half_width(), f64::from(j) / 20.0);
                    if let Some(direction) = sky(view, x, y) {
                        let (x2, y2) = view.plane(direction).expect("in front");
                        assert!(
                            (x - x2).abs() < 1e-8 && (y - y2).abs() < 1e-8,
                            "{view:?} {x} {y} {x2} {y2}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn known_points_projection() {
        assert_eq!(sky(View::Mollweide, 0.0, 0.0), Some((0.0, 0.0)));
        assert_eq!(sky(View::Mollweide, 2.0, 0.1), None);
        // A quarter turn to the left of the middle is l = 90°.
        let (lon, lat) = sky(View::Mollweide, -1.0, 0.0).expect("on the sky");
        assert!((lon - FRAC_PI_2).abs() < 1e-12 && lat.abs() < 1e-12);
        // Half of the sphere lies within 30° of the equator: its parallel is the one of sin b = 1/2.
        let (_, y) = View::Mollweide
            .plane((0.0, 30.0_f64.to_radians()))
            .expect("on the sky");
        let angle = y.asin();
        assert!((2.0 * angle + (2.0 * angle).sin() - PI / 2.0).abs() < 1e-12);
        let detail = View::Gnomonic {
            lon_deg: 120.0,
            lat_deg: -30.0,
            size_deg: 20.0,
        };
        let (lon, lat) = sky(detail, 0.0, 1.0).expect("on the sky");
        assert!(
            (lat.to_degrees() + 20.0).abs() < 1e-10 && (lon.to_degrees() - 120.0).abs() < 1e-10
        );
        let (lon, _) = sky(detail, -0.5, 0.0).expect("on the sky");
        assert!(lon.to_degrees() > 120.0, "east is left");
    }
}
