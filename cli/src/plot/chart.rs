//! Diagrams of numbers: curves over linear or logarithmic axes, histograms, densities.

use super::axis::{label_decimal, label_power};
use super::canvas::Canvas;
use super::colours::Colours;
use super::scale::round_step;
use super::surface::{Cell, Dash, Frame, Ink, Raster, Surface};
use super::text::Anchor;
use crate::error::{Error, Result};

/// How a quantity is spread over an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Spread {
    /// Evenly.
    #[default]
    Linear,
    /// By its logarithm; what is not positive is left out.
    Log,
}

/// One axis of a diagram.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Axis {
    /// Words along it, with the unit.
    pub label: String,
    /// Linear or logarithmic.
    pub spread: Spread,
    /// First and last value; `None` = what the curves need.
    pub range: Option<(f64, f64)>,
}

impl Axis {
    /// An axis over what the curves need.
    #[must_use]
    pub fn new(label: &str, spread: Spread) -> Self {
        Self {
            label: label.to_owned(),
            spread,
            range: None,
        }
    }

    /// The same axis from `first` to `last`.
    #[must_use]
    pub const fn over(mut self, first: f64, last: f64) -> Self {
        self.range = Some((first, last));
        self
    }

    fn place(&self, value: f64) -> Option<f64> {
        match self.spread {
            Spread::Linear => value.is_finite().then_some(value),
            Spread::Log => (value > 0.0 && value.is_finite()).then(|| value.log10()),
        }
    }
}

/// How a curve is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Style {
    /// A line.
    #[default]
    Solid,
    /// A dashed line.
    Dashed,
    /// A dotted line.
    Dotted,
}

/// One curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Its name; empty = not in the key.
    pub label: String,
    /// Its points in order; it breaks where a value is not finite or not on the axis.
    pub points: Vec<(f64, f64)>,
    /// Number of its colour.
    pub colour: usize,
    /// Its stroke.
    pub style: Style,
}

impl Curve {
    /// A solid line.
    #[must_use]
    pub fn new(label: &str, colour: usize, points: Vec<(f64, f64)>) -> Self {
        Self {
            label: label.to_owned(),
            points,
            colour,
            style: Style::Solid,
        }
    }

    /// A staircase: one step per bin, `edges` one longer than `values`.
    #[must_use]
    pub fn steps(label: &str, colour: usize, edges: &[f64], values: &[f64]) -> Self {
        let points = edges
            .windows(2)
            .zip(values)
            .flat_map(|(edge, &value)| [(edge[0], value), (edge[1], value)]);
        Self::new(label, colour, points.collect())
    }

    /// The same curve with another stroke.
    #[must_use]
    pub const fn styled(mut self, style: Style) -> Self {
        self.style = style;
        self
    }
}

/// Counts over a grid of cells, drawn as colours below the curves.
#[derive(Debug, Clone, PartialEq)]
pub struct Density {
    /// Cells along x.
    pub columns: usize,
    /// Row by row, the lowest y first; the logarithm of counts is shown, empty cells are not.
    pub counts: Vec<f64>,
}

/// A diagram.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Chart {
    /// Above the diagram.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// The curves, later ones on top.
    pub curves: Vec<Curve>,
    /// A density that fills the diagram; its axes need ranges.
    pub density: Option<Density>,
}

/// Most decades that a vertical axis shows unless its range is given.
const DECADES: f64 = 9.0;
/// Height of the diagram proper over its width.
const SHAPE: f32 = 0.68;

impl Chart {
    /// The picture as a PNG file `width` pixels wide.
    ///
    /// # Errors
    /// A width outside 100 … 16384.
    pub fn png(&self, width: u32) -> Result<Vec<u8>> {
        if !(100..=16_384).contains(&width) {
            return Err(Error::usage(format!(
                "a picture {width} pixels wide cannot be made; choose 100 to 16384"
            )));
        }
        let size = width as f32 / 32.0;
        let probe = Canvas::new(1, 1)?;
        let height = self.height(&probe, width as f32, size);
        let mut canvas = Canvas::new(width, height.round() as u32)?;
        let frame = Frame {
            x: 0.0,
            y: 0.0,
            width: width as f32,
            height,
        };
        self.draw(&mut canvas, frame, size);
        canvas.png()
    }

    /// Height that the diagram needs at a width and a letter size.
    pub(crate) fn height(&self, surface: &dyn Surface, width: f32, size: f32) -> f32 {
        let key = self.key(surface, width - 2.0 * size, size).len() as f32;
        (width - 6.6 * size) * SHAPE + size * (self.heading() + 1.6 * key + 3.6)
    }

    fn heading(&self) -> f32 {
        if self.title.is_empty() { 0.8 } else { 2.6 }
    }

    /// Rows of the key, each the curves it names with their widths.
    fn key(&self, surface: &dyn Surface, room: f32, size: f32) -> Vec<Vec<(usize, f32)>> {
        let mut rows: Vec<Vec<(usize, f32)>> = Vec::new();
        let mut used = 0.0;
        for (index, curve) in self.curves.iter().enumerate() {
            if curve.label.is_empty() {
                continue;
            }
            let width = surface.text_width(&curve.label, size * 0.9) + 3.6 * size;
            if rows.is_empty() || used + width > room {
                rows.push(Vec::new());
                used = 0.0;
            }
            if let Some(row) = rows.last_mut() {
                row.push((index, width));
            }
            used += width;
        }
        rows
    }

    /// Draws the diagram into `frame`; `size` is the size of the letters.
    pub(crate) fn draw(&self, surface: &mut dyn Surface, frame: Frame, size: f32) {
        let mut top = frame.y + size * self.heading();
        if !self.title.is_empty() {
            let middle = frame.x + frame.width / 2.0;
            let room = (frame.width - size) / surface.text_width(&self.title, size * 1.15);
            surface.text(
                &self.title,
                size * 1.15 * room.min(1.0),
                Anchor::Middle,
                middle,
                frame.y + size * 1.7,
                Ink::Text,
            );
        }
        for row in self.key(surface, frame.width - 2.0 * size, size) {
            let width: f32 = row.iter().map(|(_, width)| width).sum();
            let mut x = frame.x + (frame.width - width) / 2.0 + size * 0.4;
            let y = top + size * 0.9;
            for (index, width) in row {
                let curve = &self.curves[index];
                surface.stroke(
                    &[(x, y - size * 0.3), (x + size * 2.0, y - size * 0.3)],
                    size / 8.0,
                    Ink::Series(curve.colour),
                    dash(curve.style),
                );
                surface.text(
                    &curve.label,
                    size * 0.9,
                    Anchor::Left,
                    x + size * 2.5,
                    y,
                    Ink::Text,
                );
                x += width;
            }
            top += size * 1.6;
        }
        let plot = Frame {
            x: frame.x + 5.4 * size,
            y: top,
            width: frame.width - 6.6 * size,
            height: frame.y + frame.height - top - 3.6 * size,
        };
        let (x, y) = (self.range(true), self.range(false));
        let view = View { plot, x, y };
        self.grid(surface, &view, size);
        if let Some(density) = &self.density {
            let raster = density.raster(&plot, surface.cells_per_pixel());
            surface.raster(plot, &raster);
        }
        for curve in &self.curves {
            let points: Vec<Option<(f64, f64)>> = curve
                .points
                .iter()
                .map(|(px, py)| Some((self.x.place(*px)?, self.y.place(*py)?)))
                .collect();
            for run in view.runs(&points) {
                surface.stroke(
                    &run,
                    size / 9.0,
                    Ink::Series(curve.colour),
                    dash(curve.style),
                );
            }
        }
        surface.outline(plot, size / 14.0, Ink::Frame);
    }

    /// First and last place on an axis.
    fn range(&self, horizontal: bool) -> (f64, f64) {
        let axis = if horizontal { &self.x } else { &self.y };
        let given = axis
            .range
            .and_then(|(first, last)| Some((axis.place(first)?, axis.place(last)?)));
        if let Some(range) = given.filter(|(first, last)| first < last) {
            return range;
        }
        let places = self.curves.iter().flat_map(|curve| {
            curve.points.iter().filter_map(|&(px, py)| {
                let (x, y) = (self.x.place(px)?, self.y.place(py)?);
                Some(if horizontal { x } else { y })
            })
        });
        let (low, high) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        if !(low.is_finite() && high.is_finite()) {
            return (0.0, 1.0);
        }
        // Rounding where there is nothing must not take the room of what there is.
        let low = match axis.spread {
            Spread::Log if !horizontal => low.max(high - DECADES),
            _ => low,
        };
        let margin = if horizontal { 0.0 } else { 0.05 };
        let room = if high > low {
            high - low
        } else if low == 0.0 {
            1.0
        } else {
            0.1 * low.abs()
        };
        let widen = if high > low {
            margin * room
        } else {
            room / 2.0
        };
        (low - widen, high + widen)
    }

    /// Grid, marks, numbers and the words along the axes.
    fn grid(&self, surface: &mut dyn Surface, view: &View, size: f32) {
        let plot = view.plot;
        let (left, bottom) = (plot.x, plot.y + plot.height);
        let line = size / 20.0;
        let mut taken = f32::NEG_INFINITY;
        for (value, text) in ticks(self.x.spread, view.x, 6) {
            let x = view.across(value);
            surface.line(&[(x, plot.y), (x, bottom)], line, Ink::Grid);
            let half = surface.text_width(&text, size * 0.9) / 2.0;
            if x - half > taken {
                surface.text(
                    &text,
                    size * 0.9,
                    Anchor::Middle,
                    x,
                    bottom + size * 1.25,
                    Ink::Text,
                );
                taken = x + half + size * 0.5;
            }
        }
        let mut taken = f32::INFINITY;
        for (value, text) in ticks(self.y.spread, view.y, 5) {
            let y = view.down(value);
            surface.line(&[(left, y), (left + plot.width, y)], line, Ink::Grid);
            if y + size * 0.5 < taken {
                surface.text(
                    &text,
                    size * 0.9,
                    Anchor::Right,
                    left - size * 0.4,
                    y + size * 0.32,
                    Ink::Text,
                );
                taken = y - size * 0.6;
            }
        }
        surface.text(
            &self.x.label,
            size,
            Anchor::Middle,
            left + plot.width / 2.0,
            bottom + size * 2.8,
            Ink::Text,
        );
        surface.text_upwards(
            &self.y.label,
            size,
            left - size * 4.45,
            plot.y + plot.height / 2.0,
            Ink::Text,
        );
    }
}

/// A diagram on the screen: places on the axes to pixels.
struct View {
    plot: Frame,
    x: (f64, f64),
    y: (f64, f64),
}

impl View {
    fn across(&self, x: f64) -> f32 {
        self.plot.x + self.plot.width * ((x - self.x.0) / (self.x.1 - self.x.0)) as f32
    }

    fn down(&self, y: f64) -> f32 {
        self.plot.y + self.plot.height * (1.0 - ((y - self.y.0) / (self.y.1 - self.y.0)) as f32)
    }

    /// The parts of a curve within the diagram, as lines on the screen.
    fn runs(&self, points: &[Option<(f64, f64)>]) -> Vec<Vec<(f32, f32)>> {
        let mut runs: Vec<Vec<(f32, f32)>> = Vec::new();
        let mut open = false;
        for pair in points.windows(2) {
            let clipped = match (pair[0], pair[1]) {
                (Some(a), Some(b)) => self.clip(a, b),
                _ => None,
            };
            let Some((a, b, reaches_b)) = clipped else {
                open = false;
                continue;
            };
            let (a, b) = (self.screen(a), self.screen(b));
            match runs.last_mut().filter(|_| open) {
                Some(run) => run.push(b),
                None => runs.push(vec![a, b]),
            }
            open = reaches_b;
        }
        runs
    }

    fn screen(&self, (x, y): (f64, f64)) -> (f32, f32) {
        (self.across(x), self.down(y))
    }

    /// The part of a segment within the diagram (Liang and Barsky), and whether it reaches its second point.
    fn clip(&self, a: (f64, f64), b: (f64, f64)) -> Option<((f64, f64), (f64, f64), bool)> {
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let (mut from, mut to) = (0.0_f64, 1.0_f64);
        for (step, room) in [
            (-dx, a.0 - self.x.0),
            (dx, self.x.1 - a.0),
            (-dy, a.1 - self.y.0),
            (dy, self.y.1 - a.1),
        ] {
            if step == 0.0 {
                if room < 0.0 {
                    return None;
                }
            } else if step < 0.0 {
                from = from.max(room / step);
            } else {
                to = to.min(room / step);
            }
        }
        let at = |t: f64| (a.0 + t * dx, a.1 + t * dy);
        (from <= to).then(|| (at(from), at(to), to == 1.0))
    }
}

impl Density {
    fn raster(&self, plot: &Frame, cells_per_pixel: f32) -> Raster {
        let width = (plot.width * cells_per_pixel).round().max(1.0) as usize;
        let height = (plot.height * cells_per_pixel).round().max(1.0) as usize;
        let rows = self.counts.len() / self.columns.max(1);
        let most = self.counts.iter().fold(1.0_f64, |most, n| most.max(*n));
        let cell = |index: usize| {
            let column = (index % width) * self.columns / width;
            let row = rows.saturating_sub(1 + (index / width) * rows / height);
            let count = self
                .counts
                .get(row * self.columns + column)
                .copied()
                .unwrap_or(0.0);
            Cell {
                position: (count.ln_1p() / most.ln_1p()) as f32,
                valued: if count > 0.0 { 1.0 } else { 0.0 },
                missing: 0.0,
            }
        };
        Raster {
            width,
            cells: (0..width * height).map(cell).collect(),
            colours: Colours::Viridis,
        }
    }
}

const fn dash(style: Style) -> Dash {
    match style {
        Style::Solid => Dash::Solid,
        Style::Dashed => Dash::Dashed,
        Style::Dotted => Dash::Dotted,
    }
}

/// Places on an axis worth a line, with their numbers.
fn ticks(spread: Spread, (first, last): (f64, f64), about: i32) -> Vec<(f64, String)> {
    match spread {
        Spread::Linear => {
            let step = round_step((last - first) / f64::from(about));
            let start = (first / step - 1e-9).ceil();
            let count = ((last / step + 1e-9).floor() - start).max(0.0) as usize;
            (0..=count)
                .map(|index| (start + index as f64) * step)
                .map(|value| {
                    (
                        value,
                        label_decimal(value, step, first.abs().max(last.abs())),
                    )
                })
                .collect()
        }
        Spread::Log => {
            let decades = (last.floor() - first.ceil()) as i32 + 1;
            if last - first < 2.6 {
                // Over few decades 1, 2 and 5 of each.
                let powers = first.floor() as i32..=last.ceil() as i32;
                return powers
                    .flat_map(|power| [1.0, 2.0, 5.0].map(|factor: f64| (factor, power)))
                    .map(|(factor, power)| (factor.log10() + f64::from(power), factor, power))
                    .filter(|(place, ..)| (first - 1e-9..=last + 1e-9).contains(place))
                    .map(|(place, factor, power)| (place, label_power(factor, power)))
                    .collect();
            }
            let every = (decades + about - 1) / about;
            (first.ceil() as i32..=last.floor() as i32)
                .filter(|power| power.rem_euclid(every.max(1)) == 0)
                .map(|power| (f64::from(power), label_power(1.0, power)))
                .collect()
        }
    }
}
