//! Drawing: shapes and text on an opaque picture, and its PNG.

use super::colours::Rgb;
use super::text::{Anchor, Typeface};
use crate::error::{Error, ErrorKind, Result};
use tiny_skia::{
    FillRule, Paint, Path, PathBuilder, Pixmap, PremultipliedColorU8, Rect, Stroke, Transform,
};

/// An ink: sRGB and opacity, 0 to 255.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ink(pub(super) u8, pub(super) u8, pub(super) u8, pub(super) u8);

pub(super) const TEXT: Ink = Ink(33, 37, 41, 255);
pub(super) const FAINT: Ink = Ink(95, 102, 110, 255);
pub(super) const FRAME: Ink = Ink(60, 64, 70, 255);
pub(super) const GRATICULE: Ink = Ink(120, 120, 120, 120);

/// A rectangle of the picture, in pixels from the upper left.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    pub(super) x: f32,
    pub(super) y: f32,
    pub(super) width: f32,
    pub(super) height: f32,
}

pub(super) struct Canvas {
    pixmap: Pixmap,
    face: Typeface,
}

impl Canvas {
    /// A white picture.
    pub(super) fn new(width: u32, height: u32) -> Result<Self> {
        let (Some(mut pixmap), Some(face)) = (Pixmap::new(width, height), Typeface::new()) else {
            return Err(Error::usage(format!(
                "a picture of {width} × {height} pixels cannot be made"
            )));
        };
        pixmap.fill(tiny_skia::Color::WHITE);
        Ok(Self { pixmap, face })
    }

    /// Lays `colour` over a pixel with the given coverage, 0 to 1.
    pub(super) fn blend(&mut self, x: u32, y: u32, colour: Rgb, coverage: f64) {
        let index = y as usize * self.pixmap.width() as usize + x as usize;
        if x >= self.pixmap.width() || coverage <= 0.0 {
            return;
        }
        if let Some(pixel) = self.pixmap.pixels_mut().get_mut(index) {
            let mix = |new: f64, old: u8| {
                (new * coverage + f64::from(old) * (1.0 - coverage)).round() as u8
            };
            let (r, g, b) = (
                mix(colour[0], pixel.red()),
                mix(colour[1], pixel.green()),
                mix(colour[2], pixel.blue()),
            );
            if let Some(mixed) = PremultipliedColorU8::from_rgba(r, g, b, 255) {
                *pixel = mixed;
            }
        }
    }

    /// A closed shape.
    pub(super) fn polygon(&mut self, points: &[(f32, f32)], ink: Ink) {
        if let Some(path) = path_through(points, true) {
            self.fill_path(&path, ink);
        }
    }

    /// A line through points.
    pub(super) fn line(&mut self, points: &[(f32, f32)], width: f32, ink: Ink) {
        if let Some(path) = path_through(points, false) {
            self.stroke_path(&path, width, ink);
        }
    }

    /// The outline of a rectangle.
    pub(super) fn outline(&mut self, frame: Frame, width: f32, ink: Ink) {
        if let Some(rect) = Rect::from_xywh(frame.x, frame.y, frame.width, frame.height) {
            self.stroke_path(&PathBuilder::from_rect(rect), width, ink);
        }
    }

    /// The outline of the ellipse within a rectangle.
    pub(super) fn ellipse(&mut self, frame: Frame, width: f32, ink: Ink) {
        let rect = Rect::from_xywh(frame.x, frame.y, frame.width, frame.height);
        if let Some(path) = rect.and_then(PathBuilder::from_oval) {
            self.stroke_path(&path, width, ink);
        }
    }

    /// Text with its baseline through (x, y).
    pub(super) fn text(&mut self, text: &str, size: f32, anchor: Anchor, x: f32, y: f32, ink: Ink) {
        if let Some(path) = self.face.outline(text, size, anchor, x, y) {
            self.fill_path(&path, ink);
        }
    }

    /// Text on a map: dark on light or light on dark, with a faint halo.
    pub(super) fn text_on_map(&mut self, text: &str, size: f32, anchor: Anchor, x: f32, y: f32) {
        if let Some(path) = self.face.outline(text, size, anchor, x, y) {
            let (ink, halo) = if self.is_dark_under(path.bounds()) {
                (Ink(235, 235, 235, 255), Ink(0, 0, 0, 110))
            } else {
                (TEXT, Ink(255, 255, 255, 130))
            };
            self.stroke_path(&path, size / 6.0, halo);
            self.fill_path(&path, ink);
        }
    }

    /// Whether the picture is dark on average in a rectangle.
    fn is_dark_under(&self, area: Rect) -> bool {
        let (left, right) = (area.left().max(0.0) as u32, area.right().max(0.0) as u32);
        let (top, bottom) = (area.top().max(0.0) as u32, area.bottom().max(0.0) as u32);
        let pixels = (top..=bottom).flat_map(|y| (left..=right).map(move |x| (x, y)));
        let (mut sum, mut count) = (0_u64, 0_u64);
        for pixel in pixels.filter_map(|(x, y)| self.pixmap.pixel(x, y)) {
            // Luma, in thousandths.
            sum += 299 * u64::from(pixel.red())
                + 587 * u64::from(pixel.green())
                + 114 * u64::from(pixel.blue());
            count += 1;
        }
        sum < 110_000 * count
    }

    pub(super) fn text_width(&self, text: &str, size: f32) -> f32 {
        self.face.width(text, size)
    }

    /// The picture as a PNG file, without time stamps: the same picture gives the same bytes.
    pub(super) fn png(&self) -> Result<Vec<u8>> {
        let rgb: Vec<u8> = self
            .pixmap
            .pixels()
            .iter()
            .flat_map(|pixel| [pixel.red(), pixel.green(), pixel.blue()])
            .collect();
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.pixmap.width(), self.pixmap.height());
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::Fast);
        let written = encoder.write_header().and_then(|mut writer| {
            writer.write_image_data(&rgb)?;
            writer.finish()
        });
        written.map_err(|cause| {
            Error::new(ErrorKind::Io, format!("cannot encode the picture: {cause}"))
        })?;
        Ok(bytes)
    }

    fn fill_path(&mut self, path: &Path, ink: Ink) {
        self.pixmap.fill_path(
            path,
            &paint(ink),
            FillRule::Winding,
            Transform::identity(),
            None,
        );
    }

    fn stroke_path(&mut self, path: &Path, width: f32, ink: Ink) {
        let stroke = Stroke {
            width,
            line_join: tiny_skia::LineJoin::Round,
            ..Stroke::default()
        };
        self.pixmap
            .stroke_path(path, &paint(ink), &stroke, Transform::identity(), None);
    }
}

fn paint(Ink(r, g, b, a): Ink) -> Paint<'static> {
    let mut paint = Paint {
        anti_alias: true,
        ..Paint::default()
    };
    paint.set_color_rgba8(r, g, b, a);
    paint
}

fn path_through(points: &[(f32, f32)], closed: bool) -> Option<Path> {
    let (first, rest) = points.split_first()?;
    let mut builder = PathBuilder::new();
    builder.move_to(first.0, first.1);
    for point in rest {
        builder.line_to(point.0, point.1);
    }
    if closed {
        builder.close();
    }
    builder.finish()
}
