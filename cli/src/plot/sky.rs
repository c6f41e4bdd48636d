//! The picture of one map.

use super::axis::colour_bar;
use super::canvas::Canvas;
use super::colours::Colours;
use super::graticule::Graticule;
use super::projection::{Row, View};
use super::scale::Scale;
use super::surface::{Cell, Frame, Ink, Raster, Surface};
use super::text::Anchor;
use crate::error::{Error, Result};
use crate::kernels::healpix::missing::is_missing;
use crate::kernels::healpix::{Nside, ring};
use rayon::prelude::*;
use std::sync::{Arc, Mutex};

/// Samples per screen pixel and direction.
const SAMPLES: usize = 3;

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
        let height = self.height(w, size);
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

    /// Width of the margin on either side of the map.
    fn side(&self, size: f32) -> f32 {
        match self.view {
            // Room for the latitudes, which stand beside the ellipse.
            View::Mollweide => 1.6 * size,
            View::Gnomonic { .. } => 3.2 * size,
        }
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

    /// Height of the picture at a width and a letter size.
    pub(crate) fn height(&self, width: f32, size: f32) -> f32 {
        (width - 2.0 * self.side(size)) / self.view.half_width() as f32 + self.margins(size)
    }

    /// Draws title, map, graticule and colour bar into `frame`; `size` is the size of the letters.
    pub(crate) fn draw(&self, canvas: &mut dyn Surface, frame: Frame, size: f32) -> Result<()> {
        let mut top = frame.y + size * 0.8;
        let middle = frame.x + frame.width / 2.0;
        if !self.title.is_empty() {
            let room = (frame.width - size) / canvas.text_width(&self.title, size * 1.3);
            canvas.text(
                &self.title,
                size * 1.3 * room.min(1.0),
                Anchor::Middle,
                middle,
                frame.y + size * 1.9,
                Ink::Text,
            );
            top = frame.y + size * 2.9;
        }
        let room = frame.height - self.margins(size);
        let half_width = self.view.half_width() as f32;
        let width = (frame.width - 2.0 * self.side(size))
            .min(room * half_width)
            .floor();
        let map = Frame {
            x: (middle - width / 2.0).round(),
            y: top.round(),
            width,
            height: (width / half_width).floor(),
        };
        let raster = self.raster(map, canvas.cells_per_pixel())?;
        canvas.raster(map, &raster);
        Graticule {
            view: self.view,
            map,
            size,
        }
        .draw(canvas);
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

    /// The map itself: every cell is the mean of a grid of samples.
    fn raster(&self, map: Frame, cells_per_pixel: f32) -> Result<Raster> {
        let size = (
            (map.width * cells_per_pixel).round() as usize,
            (map.height * cells_per_pixel).round() as usize,
        );
        let nside = Nside::new(u64::from(self.nside))?;
        let positions = positions(self.values, self.scale);
        let grid = Samples {
            nside,
            view: self.view,
            size,
        };
        let known = grid.known();
        let rows: Vec<Vec<Cell>> = (0..size.1)
            .into_par_iter()
            .map(|row| match &known {
                Some(pixels) => {
                    let length = size.0 * PER_CELL;
                    cells(&pixels[row * length..(row + 1) * length], &positions)
                }
                None => cells(&grid.row(row), &positions),
            })
            .collect();
        Ok(Raster {
            width: size.0,
            cells: rows.concat(),
            colours: self.colours,
        })
    }
}

/// Samples per cell.
const PER_CELL: usize = SAMPLES * SAMPLES;
/// Samples of a picture that are worth remembering; a larger one is unlikely to be followed by another like it.
const REMEMBERED: usize = 1 << 22;
/// Stands for a sample off the sky.
const NO_PIXEL: u32 = u32::MAX;

/// Where the samples of a picture lie.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Samples {
    nside: Nside,
    view: View,
    /// Of the map on the screen, cells.
    size: (usize, usize),
}

/// The pixels of the samples of a few pictures: a report draws a hundred maps on the same grid of cells, and to find a
/// pixel costs ten times as much as to read it.
static KNOWN: Mutex<Vec<(Samples, Arc<Vec<u32>>)>> = Mutex::new(Vec::new());

impl Samples {
    /// The pixels of all samples, row by row, if the picture is small.
    fn known(&self) -> Option<Arc<Vec<u32>>> {
        if self.size.0 * self.size.1 * PER_CELL > REMEMBERED {
            return None;
        }
        if let Ok(list) = KNOWN.lock()
            && let Some((_, pixels)) = list.iter().find(|(samples, _)| samples == self)
        {
            return Some(Arc::clone(pixels));
        }
        // Without the lock: a thread that waits here for others may be given work that wants it.
        let rows: Vec<Vec<u32>> = (0..self.size.1)
            .into_par_iter()
            .map(|row| self.row(row))
            .collect();
        let pixels = Arc::new(rows.concat());
        if let Ok(mut list) = KNOWN.lock() {
            list.retain(|(samples, _)| samples != self);
            list.insert(0, (*self, Arc::clone(&pixels)));
            list.truncate(4);
        }
        Some(pixels)
    }

    /// The pixels of the samples of a line of the screen, cell by cell.
    fn row(&self, row: usize) -> Vec<u32> {
        let (width, height) = self.size;
        let lines: [Row; SAMPLES] =
            std::array::from_fn(|sub| self.view.row(-place(row, sub, height)));
        let mut pixels = Vec::with_capacity(width * PER_CELL);
        for column in 0..width {
            for sub in 0..SAMPLES {
                let x = place(column, sub, width) * self.view.half_width();
                pixels.extend(lines.iter().map(|line| {
                    line.at(x)
                        .and_then(|location| ring::loc2pix(self.nside, location).ok())
                        .and_then(|pixel| u32::try_from(pixel).ok())
                        .unwrap_or(NO_PIXEL)
                }));
            }
        }
        pixels
    }
}

/// What is seen in the cells of a line of the screen, given the pixels of their samples.
fn cells(pixels: &[u32], positions: &[f32]) -> Vec<Cell> {
    pixels
        .chunks(PER_CELL)
        .map(|pixels| {
            let (mut sum, mut valued, mut missing) = (0.0, 0.0, 0.0);
            for position in pixels
                .iter()
                .filter_map(|&pixel| positions.get(pixel as usize))
            {
                if position.is_nan() {
                    missing += 1.0;
                } else {
                    sum += position;
                    valued += 1.0;
                }
            }
            let all = PER_CELL as f32;
            Cell {
                position: sum / f32::max(valued, 1.0),
                valued: valued / all,
                missing: missing / all,
            }
        })
        .collect()
}

/// The position of every pixel of a map on the colour bar, NaN where it is missing.
fn positions(values: &[f64], scale: Scale) -> Vec<f32> {
    let spread = scale.spread();
    let position = |value: &f64| {
        if is_missing(*value) {
            f32::NAN
        } else {
            spread.position(*value).clamp(0.0, 1.0) as f32
        }
    };
    values.par_iter().map(position).collect()
}

/// Sample `sub` of screen pixel `index` of `count`, from −1 to 1.
fn place(index: usize, sub: usize, count: usize) -> f64 {
    (index as f64 + (sub as f64 + 0.5) / SAMPLES as f64) / count as f64 * 2.0 - 1.0
}
