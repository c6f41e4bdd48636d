//! Text as outlines of the embedded font (DejaVu Sans, `assets/font/`), so that it is anti-aliased like any other shape.

use ab_glyph::{Font, FontRef, GlyphId, OutlineCurve};
use tiny_skia::{Path, PathBuilder, Transform};

/// The font file, for pages that set text themselves.
pub(crate) const FONT: &[u8] = include_bytes!("../../assets/font/DejaVuSans-subset.ttf");

/// Which point of a text is put where one says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Anchor {
    Left,
    Middle,
    Right,
}

/// The font of all pictures.
pub(crate) struct Typeface(FontRef<'static>);

impl Typeface {
    /// `None` only if the embedded file were broken, which a test rules out.
    pub(crate) fn new() -> Option<Self> {
        FontRef::try_from_slice(FONT).ok().map(Self)
    }

    /// Width of a text at a size of `size` pixels per em.
    pub(crate) fn width(&self, text: &str, size: f32) -> f32 {
        let unit = size / self.0.units_per_em().unwrap_or(2048.0);
        self.place(text).last().map_or(0.0, |(_, end)| end * unit)
    }

    /// The outlines of a text whose baseline passes through (x, y); y downwards.
    pub(crate) fn outline(
        &self,
        text: &str,
        size: f32,
        anchor: Anchor,
        x: f32,
        y: f32,
    ) -> Option<Path> {
        let unit = size / self.0.units_per_em().unwrap_or(2048.0);
        let width = self.width(text, size);
        let left = match anchor {
            Anchor::Left => x,
            Anchor::Middle => x - width / 2.0,
            Anchor::Right => x - width,
        };
        let mut builder = PathBuilder::new();
        let mut start = 0.0;
        for (glyph, end) in self.place(text) {
            self.add(glyph, start, &mut builder);
            start = end;
        }
        // Font units have y upwards.
        builder
            .finish()?
            .transform(Transform::from_row(unit, 0.0, 0.0, -unit, left, y))
    }

    /// The glyphs with the place where each ends, in font units; kerned.
    fn place(&self, text: &str) -> Vec<(GlyphId, f32)> {
        let mut end = 0.0;
        let mut before = None;
        text.chars()
            .map(|letter| {
                let glyph = self.0.glyph_id(letter);
                end += before.map_or(0.0, |before| self.0.kern_unscaled(before, glyph));
                end += self.0.h_advance_unscaled(glyph);
                before = Some(glyph);
                (glyph, end)
            })
            .collect()
    }

    fn add(&self, glyph: GlyphId, left: f32, builder: &mut PathBuilder) {
        let Some(outline) = self.0.outline(glyph) else {
            return; // a space
        };
        let mut pen: Option<ab_glyph::Point> = None;
        for curve in outline.curves {
            let (from, to) = match curve {
                OutlineCurve::Line(from, to)
                | OutlineCurve::Quad(from, _, to)
                | OutlineCurve::Cubic(from, _, _, to) => (from, to),
            };
            // Contours follow each other without a mark: a new one begins where the pen is not.
            if pen != Some(from) {
                if pen.is_some() {
                    builder.close();
                }
                builder.move_to(left + from.x, from.y);
            }
            match curve {
                OutlineCurve::Line(..) => builder.line_to(left + to.x, to.y),
                OutlineCurve::Quad(_, a, _) => builder.quad_to(left + a.x, a.y, left + to.x, to.y),
                OutlineCurve::Cubic(_, a, b, _) => {
                    builder.cubic_to(left + a.x, a.y, left + b.x, b.y, left + to.x, to.y);
                }
            }
            pen = Some(to);
        }
        if pen.is_some() {
            builder.close();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn embedded_font_draws_every_letter_in_use() {
        let face = Typeface::new().expect("the embedded font is sound");
        for letter in "AZaz09 τβµ°⁻⁰¹²³⁴⁵⁶⁷⁸⁹₀₁₂−×√≤σκ%()[]".chars()
        {
            assert_ne!(face.0.glyph_id(letter), GlyphId(0), "no glyph for {letter}");
        }
        assert!(face.width("MM", 10.0) > face.width("il", 10.0));
        let path = face
            .outline("β", 20.0, Anchor::Left, 5.0, 30.0)
            .expect("has an outline");
        let bounds = path.bounds();
        assert!(
            bounds.left() > 4.0
                && bounds.right() < 25.0
                && bounds.top() > 5.0
                && bounds.bottom() < 40.0
        );
    }
}
