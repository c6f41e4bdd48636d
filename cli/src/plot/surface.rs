//! What pictures are drawn on: a PNG ([`Canvas`](super::canvas::Canvas)) or an SVG ([`Svg`](super::svg::Svg)).
//!
//! A picture is drawn by the same code on either. Inks are roles, not colours: the surface chooses the colour, which in an
//! SVG follows the light or dark scheme of the page around it.

use super::colours::{Colours, Rgb};
use super::text::Anchor;

/// A rectangle of the picture, in pixels from the upper left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Frame {
    pub(crate) x: f32,
    pub(crate) y: f32,
    pub(crate) width: f32,
    pub(crate) height: f32,
}

/// What a line or a letter is for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Ink {
    /// Words and numbers.
    Text,
    /// Words of less weight.
    Faint,
    /// The edge of a map or a diagram.
    Frame,
    /// Meridians and parallels.
    Graticule,
    /// Lines of a diagram's grid.
    Grid,
    /// The curve of this number, counted from 0.
    Series(usize),
    /// This very colour, sRGB.
    Rgb(Rgb),
}

/// Number of colours of curves; beyond it they begin again.
pub(crate) const SERIES: usize = 6;

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Dash {
    /// Without gaps.
    #[default]
    Solid,
    /// With gaps as long as half its strokes.
    Dashed,
    /// Points.
    Dotted,
}

impl Dash {
    /// Lengths of stroke and gap in units of the line's width.
    pub(crate) const fn lengths(self) -> Option<[f32; 2]> {
        match self {
            Self::Solid => None,
            Self::Dashed => Some([4.0, 2.5]),
            Self::Dotted => Some([1.2, 2.0]),
        }
    }
}

/// One cell of a [`Raster`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Cell {
    /// Mean position of its values on the colour bar, 0 to 1.
    pub(crate) position: f32,
    /// Share of the cell with values.
    pub(crate) valued: f32,
    /// Share of the cell where values are missing.
    pub(crate) missing: f32,
}

/// A rectangle of cells, row by row from the upper left.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Raster {
    pub(crate) width: usize,
    pub(crate) cells: Vec<Cell>,
    pub(crate) colours: Colours,
}

impl Raster {
    pub(crate) fn height(&self) -> usize {
        self.cells.len() / self.width.max(1)
    }
}

/// Takes shapes and text. Coordinates are pixels, y downwards.
pub(crate) trait Surface {
    /// A closed shape.
    fn polygon(&mut self, points: &[(f32, f32)], ink: Ink);
    /// A line through points.
    fn stroke(&mut self, points: &[(f32, f32)], width: f32, ink: Ink, dash: Dash);
    /// The outline of the ellipse within a rectangle.
    fn ellipse(&mut self, frame: Frame, width: f32, ink: Ink);
    /// Text with its baseline through (x, y).
    fn text(&mut self, text: &str, size: f32, anchor: Anchor, x: f32, y: f32, ink: Ink);
    /// Text read from below, (x, y) the middle of its baseline.
    fn text_upwards(&mut self, text: &str, size: f32, x: f32, y: f32, ink: Ink);
    /// Text on a map, legible on any colour.
    fn text_on_map(&mut self, text: &str, size: f32, anchor: Anchor, x: f32, y: f32);
    /// Cells over a rectangle.
    fn raster(&mut self, frame: Frame, raster: &Raster);
    /// Width of a text.
    fn text_width(&self, text: &str, size: f32) -> f32;
    /// Cells worth drawing per pixel and direction.
    fn cells_per_pixel(&self) -> f32;

    /// A line through points, without gaps.
    fn line(&mut self, points: &[(f32, f32)], width: f32, ink: Ink) {
        self.stroke(points, width, ink, Dash::Solid);
    }

    /// The outline of a rectangle.
    fn outline(&mut self, frame: Frame, width: f32, ink: Ink) {
        let (right, bottom) = (frame.x + frame.width, frame.y + frame.height);
        let corners = [
            (frame.x, frame.y),
            (right, frame.y),
            (right, bottom),
            (frame.x, bottom),
            (frame.x, frame.y),
            (right, frame.y),
        ];
        self.line(&corners, width, ink);
    }
}
