//! The picture of one map.

use super::axis::colour_bar;
use super::canvas::{Canvas, FAINT, FRAME, Frame, GRATICULE, TEXT};
use super::colours::{Colours, MISSING_COLOUR, Rgb};
use super::projection::{LonLat, View};
use super::scale::{Scale, round_step};
use super::text::Anchor;
use crate::error::{Error, Result};
use crate::io::is_missing;
use crate::kernels::healpix::{Nside, ring};
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Samples per screen pixel and direction.
const SAMPLES: usize = 4;

/// One map and how to show it.
#[derive(Debug, Clone, PartialEq)]
pub struct MapPlot<'a> {
    /// Resolution.
    pub nside: u32,
    /// 12 Nside² values in RING order.
    pub values: &'a [f64],
    /// Above the picture; may be empty.
    pub title: String,
    /// Below the colour bar; may be empty.
    pub unit: String,
    /// From values to colours.
    pub scale: Scale,
    /// The colours.
    pub colours: Colours,
    /// The part of the sky shown.
    pub view: View,
}

impl MapPlot<'_> {
    /// The picture as a PNG file `width` pixels wide.
    ///
    /// # Errors
    /// A scale whose ends do not differ, a map of the wrong length, a detail of 0 or 180° or more, a width outside
    /// 100 … 16384.
    pub fn png(&self, width: u32) -> Result<Vec<u8>> {
        if !(100..=16_384).contains(&width) {
            return Err(Error::usage(format!(
                "a picture {width} pixels wide cannot be made; choose 100 to 16384"
            )));
        }
        self.check()?;
        let w = width as f32;
        let size = match self.view {
            View::Mollweide => w / 62.0,
            View::Gnomonic { .. } => w / 42.0,
        };
        let height = w * 0.97 / self.view.half_width() as f32 + self.margins(size);
        let mut canvas = Canvas::new(width, height.round() as u32)?;
        let frame = Frame {
            x: 0.0,
            y: 0.0,
            width: w,
            height,
        };
        self.draw(&mut canvas, frame, size)?;
        canvas.png()
    }

    pub(super) fn check(&self) -> Result<()> {
        let npix = Nside::new(u64::from(self.nside))?.npix();
        crate::kernels::Error::check_len("the map of a picture", npix as usize, self.values.len())?;
        if !self.scale.is_valid() {
            let (min, max) = self.scale.ends();
            return Err(Error::usage(format!(
                "the colours cannot run from {min} to {max}; --max must be above --min, and --threshold above 0"
            )));
        }
        if let View::Gnomonic {
            lon_deg,
            lat_deg,
            size_deg,
        } = self.view
        {
            let sound =
                lon_deg.is_finite() && lat_deg.abs() <= 90.0 && size_deg > 0.0 && size_deg < 180.0;
            if !sound {
                return Err(Error::usage(format!(
                    "a detail of {size_deg}° at l = {lon_deg}°, b = {lat_deg}° cannot be shown; the latitude is from -90 to 90, the side above 0 and below 180"
                )));
            }
        }
        Ok(())
    }

    /// Height of all that is not map, at a letter size.
    pub(super) fn margins(&self, size: f32) -> f32 {
        let title = if self.title.is_empty() { 0.8 } else { 2.9 };
        let frame = if matches!(self.view, View::Mollweide) {
            0.0
        } else {
            1.6
        };
        let unit = if self.unit.is_empty() { 0.0 } else { 1.45 };
        size * (title + frame + 4.0 + unit)
    }

    /// Draws title, map, graticule and colour bar into `frame`; `size` is the size of the letters.
    pub(super) fn draw(&self, canvas: &mut Canvas, frame: Frame, size: f32) -> Result<()> {
        let mut top = frame.y + size * 0.8;
        let middle = frame.x + frame.width / 2.0;
        if !self.title.is_empty() {
            canvas.text(
                &self.title,
                size * 1.3,
                Anchor::Middle,
                middle,
                frame.y + size * 1.9,
                TEXT,
            );
            top = frame.y + size * 2.9;
        }
        let room = frame.height - self.margins(size);
        let half_width = self.view.half_width() as f32;
        let width = (frame.width - 1.2 * size).min(room * half_width).floor();
        let map = Frame {
            x: (middle - width / 2.0).round(),
            y: top.round(),
            width,
            height: (width / half_width).floor(),
        };
        self.raster(canvas, map)?;
        self.graticule(canvas, map, size);
        let bar_width = map.width * 0.62;
        let gap = if matches!(self.view, View::Mollweide) {
            0.7
        } else {
            2.3
        };
        let bar = Frame {
            x: middle - bar_width / 2.0,
            y: (map.y + map.height + size * gap).round(),
            width: bar_width,
            height: size,
        };
        colour_bar(
            canvas,
            bar,
            self.scale,
            self.colours,
            &self.unit,
            self.beyond(),
            size,
        );
        Ok(())
    }

    /// Whether values lie below and above the ends of the scale.
    fn beyond(&self) -> (bool, bool) {
        let (min, max) = self.scale.ends();
        // Rounding of the ends is no reason for an arrowhead.
        let margin = 1e-9 * (max - min);
        let valid = || self.values.iter().filter(|value| !is_missing(**value));
        (
            valid().any(|&value| value < min - margin),
            valid().any(|&value| value > max + margin),
        )
    }

    /// The map itself: every screen pixel is the mean colour of a grid of samples.
    fn raster(&self, canvas: &mut Canvas, map: Frame) -> Result<()> {
        let nside = Nside::new(u64::from(self.nside))?;
        let (width, height) = (map.width as usize, map.height as usize);
        let rows: Vec<Vec<(Rgb, f64)>> = (0..height)
            .into_par_iter()
            .map(|row| {
                (0..width)
                    .map(|column| self.shade(nside, row, column, width, height))
                    .collect()
            })
            .collect();
        for (row, pixels) in rows.into_iter().enumerate() {
            for (column, (colour, coverage)) in pixels.into_iter().enumerate() {
                canvas.blend(
                    map.x as u32 + column as u32,
                    map.y as u32 + row as u32,
                    colour,
                    coverage,
                );
            }
        }
        Ok(())
    }

    /// Mean colour of one screen pixel, and how much of it is sky.
    fn shade(
        &self,
        nside: Nside,
        row: usize,
        column: usize,
        width: usize,
        height: usize,
    ) -> (Rgb, f64) {
        let mut sum = [0.0; 3];
        let mut hits = 0;
        let sample = |index: usize, sub: usize, count: usize| {
            (index as f64 + (sub as f64 + 0.5) / SAMPLES as f64) / count as f64 * 2.0 - 1.0
        };
        for i in 0..SAMPLES {
            for j in 0..SAMPLES {
                let x = sample(column, j, width) * self.view.half_width();
                let y = -sample(row, i, height);
                if let Some(colour) = self
                    .view
                    .sky(x, y)
                    .and_then(|direction| self.colour(nside, direction))
                {
                    for (sum, channel) in sum.iter_mut().zip(colour) {
                        *sum += channel;
                    }
                    hits += 1;
                }
            }
        }
        let count = f64::from(hits).max(1.0);
        (
            sum.map(|channel| channel / count),
            f64::from(hits) / (SAMPLES * SAMPLES) as f64,
        )
    }

    fn colour(&self, nside: Nside, (lon, lat): LonLat) -> Option<Rgb> {
        let pixel = ring::ang2pix(nside, FRAC_PI_2 - lat, lon.rem_euclid(TAU)).ok()?;
        let value = *self.values.get(pixel as usize)?;
        Some(if is_missing(value) {
            MISSING_COLOUR
        } else {
            self.colours.at(self.scale.position(value))
        })
    }

    fn graticule(&self, canvas: &mut Canvas, map: Frame, size: f32) {
        let line = (size / 20.0).max(0.6);
        match self.view {
            View::Mollweide => {
                for lat in [-60, -30, 0, 30, 60] {
                    self.curve(canvas, map, line, |t| {
                        (t * 359.99 - 179.995, f64::from(lat))
                    });
                }
                for lon in [-120, -60, 0, 60, 120] {
                    self.curve(canvas, map, line, |t| (f64::from(lon), t * 180.0 - 90.0));
                }
                canvas.ellipse(map, line * 1.6, FRAME);
                for (lon, label) in [
                    (120, "120°"),
                    (60, "60°"),
                    (0, "0°"),
                    (-60, "300°"),
                    (-120, "240°"),
                ] {
                    if let Some((x, y)) = self.screen(map, f64::from(lon), 0.0) {
                        canvas.text_on_map(
                            label,
                            size * 0.8,
                            Anchor::Left,
                            x + size * 0.25,
                            y - size * 0.3,
                        );
                    }
                }
                for (lat, label) in [(60, "60°"), (30, "30°"), (-30, "−30°"), (-60, "−60°")]
                {
                    if let Some((x, y)) = self.screen(map, 179.995, f64::from(lat)) {
                        let below = if lat < 0 { size * 0.75 } else { 0.0 };
                        canvas.text(
                            label,
                            size * 0.8,
                            Anchor::Right,
                            x - size * 0.4,
                            y + below,
                            FAINT,
                        );
                    }
                }
            }
            View::Gnomonic {
                lon_deg,
                lat_deg,
                size_deg,
            } => {
                self.detail_graticule(canvas, map, size, line, (lon_deg, lat_deg, size_deg));
                canvas.outline(map, line * 1.6, FRAME);
            }
        }
    }

    /// Lines of a detail at round angles, labelled on the frame where they leave it.
    fn detail_graticule(
        &self,
        canvas: &mut Canvas,
        map: Frame,
        size: f32,
        line: f32,
        view: (f64, f64, f64),
    ) {
        let (lon0, lat0, side) = view;
        let step = round_angle(side / 4.0);
        // The square reaches side/√2 from its middle, farther towards its corners in latitude than on a flat map.
        let reach = (2.0_f64.sqrt() * (side.to_radians() / 2.0).tan())
            .atan()
            .to_degrees();
        let (low, high) = ((lat0 - reach).max(-90.0), (lat0 + reach).min(90.0));
        let poles = low <= -90.0 || high >= 90.0;
        let cos = low.abs().max(high.abs()).to_radians().cos();
        let half = if poles {
            180.0
        } else {
            (reach.to_radians().sin() / cos)
                .min(1.0)
                .asin()
                .to_degrees()
        };
        let lon_step = round_angle((step / lat0.to_radians().cos().max(0.05)).min(45.0));
        let multiples = |low: f64, high: f64, step: f64| {
            let first = (low / step).ceil();
            let count = ((high / step).floor() - first).max(-1.0) as i64;
            (0..=count).map(move |index| (first + index as f64) * step)
        };
        let mut taken: Vec<(f32, f32)> = Vec::new();
        for lat in multiples(low, high, step) {
            self.curve(canvas, map, line, |t| (lon0 - half + 2.0 * half * t, lat));
            if let Some((x, y)) = self.leaves_left(map, |t| (lon0 - half + 2.0 * half * t, lat))
                && lat.abs() < 90.0
            {
                canvas.text_on_map(
                    &angle_label(lat, step),
                    size * 0.8,
                    Anchor::Left,
                    x + size * 0.3,
                    y - size * 0.25,
                );
            }
        }
        let turn = if poles { lon_step / 2.0 } else { 0.0 };
        for lon in multiples(lon0 - half + turn, lon0 + half, lon_step) {
            self.curve(canvas, map, line, |t| (lon, low + (high - low) * t));
            if let Some((x, y)) = self.leaves_bottom(map, |t| (lon, low + (high - low) * t)) {
                let label = angle_label(lon.rem_euclid(360.0), lon_step);
                let half = canvas.text_width(&label, size * 0.8) / 2.0;
                if taken
                    .iter()
                    .all(|(left, right)| x + half < *left || x - half > *right)
                {
                    canvas.text(&label, size * 0.8, Anchor::Middle, x, y + size * 1.1, FAINT);
                    taken.push((x - half - size * 0.4, x + half + size * 0.4));
                }
            }
        }
    }

    /// Where a curve crosses the left edge of the frame.
    fn leaves_left(&self, map: Frame, at: impl Fn(f64) -> (f64, f64)) -> Option<(f32, f32)> {
        self.crossing(map, at, |(x, _)| x - map.x)
            .find(|(_, y)| *y > map.y + map.height * 0.04 && *y < map.y + map.height * 0.98)
    }

    /// Where a curve crosses the bottom edge of the frame.
    fn leaves_bottom(&self, map: Frame, at: impl Fn(f64) -> (f64, f64)) -> Option<(f32, f32)> {
        self.crossing(map, at, |(_, y)| y - map.y - map.height)
            .find(|(x, _)| *x > map.x + map.width * 0.02 && *x < map.x + map.width * 0.98)
    }

    /// The points where `side` changes its sign along a curve.
    fn crossing(
        &self,
        map: Frame,
        at: impl Fn(f64) -> (f64, f64),
        side: impl Fn((f32, f32)) -> f32,
    ) -> impl Iterator<Item = (f32, f32)> {
        let points: Vec<_> = (0..=400)
            .map(|index| {
                let (lon, lat) = at(f64::from(index) / 400.0);
                self.screen(map, lon, lat)
            })
            .collect();
        let mut crossings = Vec::new();
        for pair in points.windows(2) {
            if let [Some(a), Some(b)] = *pair {
                let (from, to) = (side(a), side(b));
                if (from < 0.0) != (to < 0.0) {
                    let share = from / (from - to);
                    crossings.push((a.0 + share * (b.0 - a.0), a.1 + share * (b.1 - a.1)));
                }
            }
        }
        crossings.into_iter()
    }

    /// Draws the part of a curve (degrees, over t from 0 to 1) that lies within the frame.
    fn curve(&self, canvas: &mut Canvas, map: Frame, line: f32, at: impl Fn(f64) -> (f64, f64)) {
        let mut run: Vec<(f32, f32)> = Vec::new();
        for index in 0..=400 {
            let (lon, lat) = at(f64::from(index) / 400.0);
            let inside = self.screen(map, lon, lat).filter(|(x, y)| {
                (map.x..=map.x + map.width).contains(x) && (map.y..=map.y + map.height).contains(y)
            });
            match inside {
                Some(point) => run.push(point),
                None => {
                    canvas.line(&run, line, GRATICULE);
                    run.clear();
                }
            }
        }
        canvas.line(&run, line, GRATICULE);
    }

    /// Where a direction (degrees) is on the screen.
    fn screen(&self, map: Frame, lon: f64, lat: f64) -> Option<(f32, f32)> {
        let (x, y) = self.view.plane((lon.to_radians(), lat.to_radians()))?;
        let across = (x / self.view.half_width() + 1.0) / 2.0;
        Some((
            map.x + map.width * across as f32,
            map.y + map.height * ((1.0 - y) / 2.0) as f32,
        ))
    }
}

/// A step for a graticule in degrees: round, and a divisor of 90 above 10.
fn round_angle(rough: f64) -> f64 {
    if rough > 20.0 {
        if rough > 32.0 { 45.0 } else { 30.0 }
    } else if rough > 10.0 {
        15.0
    } else {
        round_step(rough)
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
