//! Drawing on an opaque picture, and its PNG.

use super::colours::{MISSING_COLOUR, Rgb};
use super::surface::{Dash, Frame, Ink, Raster, Surface};
use super::text::{Anchor, Typeface};
use crate::error::{Error, ErrorKind, Result};
use tiny_skia::{
    Color, FillRule, Paint, Path, PathBuilder, Pixmap, PremultipliedColorU8, Rect, Stroke,
    StrokeDash, Transform,
};

/// sRGB and opacity, 0 to 255.
type Rgba = [u8; 4];

/// A picture on white paper.
pub(crate) struct Canvas {
    pixmap: Pixmap,
    face: Typeface,
}

impl Canvas {
    /// A white picture.
    pub(crate) fn new(width: u32, height: u32) -> Result<Self> {
        let (Some(mut pixmap), Some(face)) = (Pixmap::new(width, height), Typeface::new()) else {
            return Err(Error::usage(format!(
                "a picture of {width} × {height} pixels cannot be made"
            )));
        };
        pixmap.fill(Color::WHITE);
        Ok(Self { pixmap, face })
    }

    /// Lays `colour` over a pixel with the given coverage, 0 to 1.
    fn blend(&mut self, x: u32, y: u32, colour: Rgb, coverage: f64) {
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

    /// The picture as a PNG file, without time stamps: the same picture gives the same bytes.
    pub(crate) fn png(&self) -> Result<Vec<u8>> {
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

    fn fill_path(&mut self, path: &Path, colour: Rgba) {
        self.pixmap.fill_path(
            path,
            &paint(colour),
            FillRule::Winding,
            Transform::identity(),
            None,
        );
    }

    fn stroke_path(&mut self, path: &Path, width: f32, colour: Rgba, dash: Dash) {
        let stroke = Stroke {
            width,
            line_join: tiny_skia::LineJoin::Round,
            dash: dash
                .lengths()
                .and_then(|lengths| StrokeDash::new(lengths.map(|x| x * width).to_vec(), 0.0)),
            ..Stroke::default()
        };
        self.pixmap
            .stroke_path(path, &paint(colour), &stroke, Transform::identity(), None);
    }
}

impl Surface for Canvas {
    fn polygon(&mut self, points: &[(f32, f32)], ink: Ink) {
        if let Some(path) = path_through(points, true) {
            self.fill_path(&path, rgba(ink));
        }
    }

    fn stroke(&mut self, points: &[(f32, f32)], width: f32, ink: Ink, dash: Dash) {
        if let Some(path) = path_through(points, false) {
            self.stroke_path(&path, width, rgba(ink), dash);
        }
    }

    fn ellipse(&mut self, frame: Frame, width: f32, ink: Ink) {
        let rect = Rect::from_xywh(frame.x, frame.y, frame.width, frame.height);
        if let Some(path) = rect.and_then(PathBuilder::from_oval) {
            self.stroke_path(&path, width, rgba(ink), Dash::Solid);
        }
    }

    fn text(&mut self, text: &str, size: f32, anchor: Anchor, x: f32, y: f32, ink: Ink) {
        if let Some(path) = self.face.outline(text, size, anchor, x, y) {
            self.fill_path(&path, rgba(ink));
        }
    }

    fn text_upwards(&mut self, text: &str, size: f32, x: f32, y: f32, ink: Ink) {
        let path = self.face.outline(text, size, Anchor::Middle, 0.0, 0.0);
        let turn = Transform::from_row(0.0, -1.0, 1.0, 0.0, x, y);
        if let Some(path) = path.and_then(|path| path.transform(turn)) {
            self.fill_path(&path, rgba(ink));
        }
    }

    /// Dark on light or light on dark, with a faint halo.
    fn text_on_map(&mut self, text: &str, size: f32, anchor: Anchor, x: f32, y: f32) {
        if let Some(path) = self.face.outline(text, size, anchor, x, y) {
            let (ink, halo) = if self.is_dark_under(path.bounds()) {
                ([235, 235, 235, 255], [0, 0, 0, 110])
            } else {
                (rgba(Ink::Text), [255, 255, 255, 130])
            };
            self.stroke_path(&path, size / 6.0, halo, Dash::Solid);
            self.fill_path(&path, ink);
        }
    }

    /// A raster has as many cells as the rectangle has pixels: one is drawn on the other.
    fn raster(&mut self, frame: Frame, raster: &Raster) {
        let (left, top) = (frame.x.round() as u32, frame.y.round() as u32);
        for (row, cells) in raster.cells.chunks(raster.width.max(1)).enumerate() {
            for (column, cell) in cells.iter().enumerate() {
                let (valued, missing) = (f64::from(cell.valued), f64::from(cell.missing));
                let coverage = valued + missing;
                if coverage <= 0.0 {
                    continue;
                }
                let value = raster.colours.at(f64::from(cell.position));
                let colour = std::array::from_fn(|channel| {
                    (value[channel] * valued + MISSING_COLOUR[channel] * missing) / coverage
                });
                self.blend(left + column as u32, top + row as u32, colour, coverage);
            }
        }
    }

    fn text_width(&self, text: &str, size: f32) -> f32 {
        self.face.width(text, size)
    }

    fn cells_per_pixel(&self) -> f32 {
        1.0
    }
}

/// The colours of inks on white paper.
fn rgba(ink: Ink) -> Rgba {
    const SERIES: [Rgba; super::surface::SERIES] = [
        [24, 95, 165, 255],
        [201, 84, 10, 255],
        [26, 132, 74, 255],
        [158, 51, 140, 255],
        [140, 105, 0, 255],
        [84, 90, 100, 255],
    ];
    match ink {
        Ink::Text => [33, 37, 41, 255],
        Ink::Faint => [95, 102, 110, 255],
        Ink::Frame => [60, 64, 70, 255],
        Ink::Graticule => [120, 120, 120, 120],
        Ink::Grid => [222, 225, 229, 255],
        Ink::Series(index) => SERIES[index % SERIES.len()],
        Ink::Rgb(colour) => {
            let [r, g, b] = colour.map(|channel| channel.round() as u8);
            [r, g, b, 255]
        }
    }
}

fn paint([r, g, b, a]: Rgba) -> Paint<'static> {
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
