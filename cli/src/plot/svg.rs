//! Drawing into an SVG to be put into a page.
//!
//! Inks become CSS classes, so that the page decides on colours; rasters become PNGs of a palette within the SVG. Text
//! stays text, in the font whose widths this program knows ([`FONT_FAMILY`]), which the page embeds.

use super::base64;
use super::colours::{Colours, MISSING_COLOUR};
use super::surface::{Dash, Frame, Ink, Raster, SERIES, Surface};
use super::text::{Anchor, Typeface};
use crate::error::{Error, ErrorKind, Result};
use std::fmt::Write as _;

/// The family under which a page has to embed [`FONT`](super::text::FONT).
pub(crate) const FONT_FAMILY: &str = "dust3d";

/// Colours of a raster's palette; one more is grey for missing values, and one is transparent.
const SHADES: usize = 160;

/// An SVG in the making.
pub(crate) struct Svg {
    width: f32,
    height: f32,
    body: String,
    face: Typeface,
}

impl Svg {
    /// An empty picture.
    pub(crate) fn new(width: f32, height: f32) -> Result<Self> {
        let face = Typeface::new().ok_or_else(|| {
            Error::new(
                ErrorKind::Io,
                "the embedded font is broken; rebuild the program",
            )
        })?;
        Ok(Self {
            width,
            height,
            body: String::new(),
            face,
        })
    }

    /// The element, described by `label` to those who cannot see it.
    pub(crate) fn finish(self, label: &str) -> String {
        format!(
            "<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">{}</svg>",
            number(self.width),
            number(self.height),
            escape(label),
            self.body
        )
    }

    fn write_text(&mut self, text: &str, size: f32, place: &str, class: &str) {
        let _ = write!(
            self.body,
            "<text {place} font-size=\"{}\" class=\"{class}\">{}</text>",
            number(size),
            escape(text)
        );
    }
}

impl Surface for Svg {
    fn polygon(&mut self, points: &[(f32, f32)], ink: Ink) {
        let colour = match ink {
            Ink::Rgb([r, g, b]) => format!("fill=\"rgb({r:.0},{g:.0},{b:.0})\""),
            ink => format!("class=\"f-{}\"", class(ink)),
        };
        let _ = write!(self.body, "<path d=\"{}z\" {colour}/>", path(points));
    }

    fn stroke(&mut self, points: &[(f32, f32)], width: f32, ink: Ink, dash: Dash) {
        if points.len() < 2 {
            return;
        }
        let dash = dash.lengths().map_or_else(String::new, |[on, off]| {
            format!(
                " stroke-dasharray=\"{} {}\"",
                number(on * width),
                number(off * width)
            )
        });
        let _ = write!(
            self.body,
            "<path d=\"{}\" class=\"s-{}\" stroke-width=\"{}\"{dash}/>",
            path(points),
            class(ink),
            number(width)
        );
    }

    fn ellipse(&mut self, frame: Frame, width: f32, ink: Ink) {
        let _ = write!(
            self.body,
            "<ellipse cx=\"{}\" cy=\"{}\" rx=\"{}\" ry=\"{}\" class=\"s-{}\" stroke-width=\"{}\"/>",
            number(frame.x + frame.width / 2.0),
            number(frame.y + frame.height / 2.0),
            number(frame.width / 2.0),
            number(frame.height / 2.0),
            class(ink),
            number(width)
        );
    }

    fn text(&mut self, text: &str, size: f32, anchor: Anchor, x: f32, y: f32, ink: Ink) {
        let place = format!(
            "x=\"{}\" y=\"{}\"{}",
            number(x),
            number(y),
            anchored(anchor)
        );
        self.write_text(text, size, &place, &format!("f-{}", class(ink)));
    }

    fn text_upwards(&mut self, text: &str, size: f32, x: f32, y: f32, ink: Ink) {
        let place = format!(
            "transform=\"translate({} {}) rotate(-90)\"{}",
            number(x),
            number(y),
            anchored(Anchor::Middle)
        );
        self.write_text(text, size, &place, &format!("f-{}", class(ink)));
    }

    fn text_on_map(&mut self, text: &str, size: f32, anchor: Anchor, x: f32, y: f32) {
        let place = format!(
            "x=\"{}\" y=\"{}\"{}",
            number(x),
            number(y),
            anchored(anchor)
        );
        self.write_text(text, size, &place, "halo");
    }

    fn raster(&mut self, frame: Frame, raster: &Raster) {
        // An encoder that writes to memory has nothing to fail on but the size, which is checked here.
        let Some(png) = palette_png(raster) else {
            return;
        };
        let _ = write!(
            self.body,
            "<image x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" preserveAspectRatio=\"none\" href=\"data:image/png;base64,{}\"/>",
            number(frame.x),
            number(frame.y),
            number(frame.width),
            number(frame.height),
            base64::encode(&png)
        );
    }

    fn text_width(&self, text: &str, size: f32) -> f32 {
        self.face.width(text, size)
    }

    fn cells_per_pixel(&self) -> f32 {
        1.4
    }
}

/// The name of an ink in classes: `f-…` fills, `s-…` strokes.
fn class(ink: Ink) -> String {
    match ink {
        Ink::Text | Ink::Rgb(_) => "text".to_owned(),
        Ink::Faint => "faint".to_owned(),
        Ink::Frame => "frame".to_owned(),
        Ink::Graticule => "graticule".to_owned(),
        Ink::Grid => "grid".to_owned(),
        Ink::Series(index) => format!("{}", index % SERIES),
    }
}

const fn anchored(anchor: Anchor) -> &'static str {
    match anchor {
        Anchor::Left => "",
        Anchor::Middle => " text-anchor=\"middle\"",
        Anchor::Right => " text-anchor=\"end\"",
    }
}

/// A tenth of a pixel is fine enough for any screen.
fn number(x: f32) -> String {
    let text = format!("{x:.1}");
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}

fn path(points: &[(f32, f32)]) -> String {
    let mut text = String::new();
    let mut last = (String::new(), String::new());
    for (index, (x, y)) in points.iter().enumerate() {
        let place = (number(*x), number(*y));
        if index > 0 && place == last {
            continue;
        }
        let _ = write!(
            text,
            "{}{} {}",
            if index == 0 { "M" } else { "L" },
            place.0,
            place.1
        );
        last = place;
    }
    text
}

/// Text as it must be written in HTML and XML.
pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// A PNG of a palette: the colours, grey for missing values, and nothing off the sky.
fn palette_png(raster: &Raster) -> Option<Vec<u8>> {
    let (grey, nothing) = (SHADES as u8, SHADES as u8 + 1);
    let indices: Vec<u8> = raster
        .cells
        .iter()
        .map(|cell| {
            if cell.valued + cell.missing < 0.5 {
                nothing
            } else if cell.missing > cell.valued {
                grey
            } else {
                (cell.position.clamp(0.0, 1.0) * (SHADES - 1) as f32).round() as u8
            }
        })
        .collect();
    let mut bytes = Vec::new();
    let (width, height) = (
        u32::try_from(raster.width).ok()?,
        u32::try_from(raster.height()).ok()?,
    );
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(palette(raster.colours));
    let mut opacity = vec![255; SHADES + 1];
    opacity.push(0);
    encoder.set_trns(opacity);
    encoder.set_filter(png::Filter::NoFilter);
    encoder.set_compression(png::Compression::Balanced);
    let mut writer = encoder.write_header().ok()?;
    writer.write_image_data(&indices).ok()?;
    writer.finish().ok()?;
    Some(bytes)
}

fn palette(colours: Colours) -> Vec<u8> {
    let shades = (0..SHADES).map(|index| colours.at(index as f64 / (SHADES - 1) as f64));
    shades
        .chain([MISSING_COLOUR, [255.0; 3]])
        .flatten()
        .map(|channel| channel.round() as u8)
        .collect()
}
