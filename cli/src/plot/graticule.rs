//! Lines of constant longitude and latitude over a map, and their labels.

use super::projection::View;
use super::scale::round_step;
use super::surface::{Frame, Ink, Surface};
use super::text::Anchor;

/// Latitude of the longitude labels, degrees: away from the Galactic plane.
const LABELLED_LATITUDE: f64 = -43.0;

/// A direction in degrees as a function of a parameter from 0 to 1.
type Curve<'a> = &'a dyn Fn(f64) -> (f64, f64);

/// The lines over one map.
pub(super) struct Graticule {
    pub(super) view: View,
    /// Where the map is.
    pub(super) map: Frame,
    /// Size of the letters.
    pub(super) size: f32,
}

impl Graticule {
    /// Draws the lines, the frame and the labels.
    pub(super) fn draw(&self, canvas: &mut dyn Surface) {
        match self.view {
            View::Mollweide => self.whole_sky(canvas),
            View::Gnomonic {
                lon_deg,
                lat_deg,
                size_deg,
            } => {
                self.detail(canvas, lon_deg, lat_deg, size_deg);
                canvas.outline(self.map, self.line() * 1.6, Ink::Frame);
            }
        }
    }

    fn line(&self) -> f32 {
        (self.size / 20.0).max(0.6)
    }

    fn whole_sky(&self, canvas: &mut dyn Surface) {
        let size = self.size;
        for lat in [-60, -30, 0, 30, 60] {
            // Just short of the cut at l = 180°, where the curve would jump to the other side.
            self.curve(canvas, &|t| (t * 359.99 - 179.995, f64::from(lat)));
        }
        for lon in [-120, -60, 0, 60, 120] {
            self.curve(canvas, &|t| (f64::from(lon), t * 180.0 - 90.0));
        }
        canvas.ellipse(self.map, self.line() * 1.6, Ink::Frame);
        for (lon, label) in [
            (120, "120°"),
            (60, "60°"),
            (0, "0°"),
            (-60, "300°"),
            (-120, "240°"),
        ] {
            if let Some((x, y)) = self.screen(f64::from(lon), LABELLED_LATITUDE) {
                canvas.text_on_map(label, size * 0.8, Anchor::Left, x + size * 0.3, y);
            }
        }
        for (lat, label) in [(60, "60°"), (30, "30°"), (-30, "−30°"), (-60, "−60°")] {
            if let Some((x, y)) = self.screen(179.995, f64::from(lat)) {
                let below = if lat < 0 { size * 0.75 } else { 0.0 };
                canvas.text(
                    label,
                    size * 0.8,
                    Anchor::Right,
                    x - size * 0.4,
                    y + below,
                    Ink::Faint,
                );
            }
        }
    }

    /// Lines at round angles, labelled where they leave the frame to the left and below.
    fn detail(&self, canvas: &mut dyn Surface, lon0: f64, lat0: f64, side: f64) {
        let (map, size) = (self.map, self.size);
        let step = round_angle(side / 4.0);
        // Angular distance of the corners from the middle.
        let reach = (2.0_f64.sqrt() * (side.to_radians() / 2.0).tan())
            .atan()
            .to_degrees();
        let (low, high) = ((lat0 - reach).max(-90.0), (lat0 + reach).min(90.0));
        let pole = low <= -90.0 || high >= 90.0;
        let half = if pole {
            180.0
        } else {
            (reach.to_radians().sin() / lat0.to_radians().cos())
                .min(1.0)
                .asin()
                .to_degrees()
        };
        let lon_step = round_angle((step / lat0.to_radians().cos().max(0.05)).min(45.0));
        for lat in multiples(low, high, step).filter(|lat| lat.abs() < 90.0) {
            let parallel = |t: f64| (lon0 - half + 2.0 * half * t, lat);
            self.curve(canvas, &parallel);
            let left = self.crossings(&parallel, |(x, _)| x - map.x);
            if let Some((x, y)) = left
                .into_iter()
                .find(|(_, y)| *y > map.y && *y < map.y + map.height)
            {
                let label = angle_label(lat, step);
                canvas.text(
                    &label,
                    size * 0.8,
                    Anchor::Right,
                    x - size * 0.4,
                    y + size * 0.3,
                    Ink::Faint,
                );
            }
        }
        let mut taken: Vec<(f32, f32)> = Vec::new();
        // Around a pole every longitude is there, and one meridian must not be drawn twice.
        let last = if pole {
            lon0 + half - lon_step / 2.0
        } else {
            lon0 + half
        };
        for lon in multiples(lon0 - half, last, lon_step) {
            let meridian = |t: f64| (lon, low + (high - low) * t);
            self.curve(canvas, &meridian);
            let bottom = self.crossings(&meridian, |(_, y)| y - map.y - map.height);
            let label = angle_label(lon.rem_euclid(360.0), lon_step);
            let half = canvas.text_width(&label, size * 0.8) / 2.0;
            let free = |x: f32| {
                taken
                    .iter()
                    .all(|(left, right)| x + half < *left || x - half > *right)
            };
            if let Some((x, y)) = bottom
                .into_iter()
                .find(|(x, _)| *x > map.x && *x < map.x + map.width && free(*x))
            {
                canvas.text(
                    &label,
                    size * 0.8,
                    Anchor::Middle,
                    x,
                    y + size * 1.1,
                    Ink::Faint,
                );
                taken.push((x - half - size * 0.4, x + half + size * 0.4));
            }
        }
    }

    /// The points of the screen where `side` changes its sign along a curve.
    fn crossings(&self, at: Curve<'_>, side: impl Fn((f32, f32)) -> f32) -> Vec<(f32, f32)> {
        let points: Vec<_> = self.points(at).collect();
        points
            .windows(2)
            .filter_map(|pair| {
                let (a, b) = (pair[0]?, pair[1]?);
                let (from, to) = (side(a), side(b));
                let share = from / (from - to);
                ((from < 0.0) != (to < 0.0))
                    .then_some((a.0 + share * (b.0 - a.0), a.1 + share * (b.1 - a.1)))
            })
            .collect()
    }

    /// Draws the part of a curve that lies within the frame.
    fn curve(&self, canvas: &mut dyn Surface, at: Curve<'_>) {
        let map = self.map;
        let inside = |(x, y): &(f32, f32)| {
            (map.x..=map.x + map.width).contains(x) && (map.y..=map.y + map.height).contains(y)
        };
        let points: Vec<_> = self.points(at).map(|point| point.filter(inside)).collect();
        for run in points.split(Option::is_none) {
            let run: Vec<_> = run.iter().flatten().copied().collect();
            canvas.line(&run, self.line(), Ink::Graticule);
        }
    }

    fn points(&self, at: Curve<'_>) -> impl Iterator<Item = Option<(f32, f32)>> {
        (0..=600).map(move |index| {
            let (lon, lat) = at(f64::from(index) / 600.0);
            self.screen(lon, lat)
        })
    }

    /// Where a direction (degrees) is on the screen.
    fn screen(&self, lon: f64, lat: f64) -> Option<(f32, f32)> {
        let (x, y) = self.view.plane((lon.to_radians(), lat.to_radians()))?;
        let across = (x / self.view.half_width() + 1.0) / 2.0;
        let down = (1.0 - y) / 2.0;
        Some((
            self.map.x + self.map.width * across as f32,
            self.map.y + self.map.height * down as f32,
        ))
    }
}

/// The multiples of `step` from `low` to `high`.
fn multiples(low: f64, high: f64, step: f64) -> impl Iterator<Item = f64> {
    let first = (low / step).ceil();
    let count = ((high / step).floor() - first).max(-1.0) as i64;
    (0..=count).map(move |index| (first + index as f64) * step)
}

/// A step for a graticule in degrees: round, and a divisor of 90 above 10.
fn round_angle(rough: f64) -> f64 {
    match rough {
        rough if rough > 32.0 => 45.0,
        rough if rough > 20.0 => 30.0,
        rough if rough > 10.0 => 15.0,
        rough => round_step(rough),
    }
}

fn angle_label(angle: f64, step: f64) -> String {
    let decimals = if step < 1.0 {
        (-step.log10()).ceil().max(0.0) as usize
    } else {
        0
    };
    format!("{angle:.decimals$}°").replace('-', "−")
}
