//! The overview of a run: I, Q, U, T and β of the total on one page.

use super::canvas::{Canvas, FAINT, Frame, TEXT};
use super::colours::Colours;
use super::projection::View;
use super::scale::Scale;
use super::sky::MapPlot;
use super::text::Anchor;
use crate::error::Result;

/// One map of the overview.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Panel<'a> {
    /// Resolution.
    pub nside: u32,
    /// 12 Nside² values in RING order.
    pub values: &'a [f64],
}

/// The maps of the overview and the words around them.
#[derive(Debug, Clone, PartialEq)]
pub struct Overview<'a> {
    /// Intensity at 353 GHz, MJy/sr.
    pub i: Panel<'a>,
    /// Stokes Q at 353 GHz, MJy/sr.
    pub q: Panel<'a>,
    /// Stokes U at 353 GHz, MJy/sr.
    pub u: Panel<'a>,
    /// Temperature of the fit of the total, K.
    pub t: Panel<'a>,
    /// Spectral index of the fit of the total.
    pub beta: Panel<'a>,
    /// Heading.
    pub title: String,
    /// One line below the heading.
    pub subtitle: String,
}

/// Width of the picture in pixels.
const WIDTH: u32 = 1800;

impl Overview<'_> {
    /// The picture as a PNG file: intensity large, the other four below it two by two.
    ///
    /// # Errors
    /// A map of the wrong length.
    pub fn png(&self) -> Result<Vec<u8>> {
        let width = WIDTH as f32;
        let heading = 120.0;
        let large = 760.0;
        let small = 585.0;
        let height = heading + large + 2.0 * small + 20.0;
        let mut canvas = Canvas::new(WIDTH, height as u32)?;
        canvas.text(&self.title, 40.0, Anchor::Middle, width / 2.0, 62.0, TEXT);
        canvas.text(
            &self.subtitle,
            23.0,
            Anchor::Middle,
            width / 2.0,
            100.0,
            FAINT,
        );
        let frame = |column: f32, y: f32| Frame {
            x: column * width / 2.0,
            y,
            width: width / 2.0,
            height: small,
        };
        let first = Frame {
            x: 0.0,
            y: heading,
            width,
            height: large,
        };
        let (second, third) = (heading + large, heading + large + small);
        let (log, linear) = (
            Scale::symlog_of as fn(&[f64]) -> Scale,
            Scale::linear_of as fn(&[f64]) -> Scale,
        );
        for (panel, title, unit, scale, colours, frame, size) in [
            (
                self.i,
                "Intensity I, 353 GHz",
                "MJy/sr",
                log,
                Colours::Inferno,
                first,
                23.0,
            ),
            (
                self.q,
                "Stokes Q, 353 GHz",
                "MJy/sr",
                log,
                Colours::Planck,
                frame(0.0, second),
                20.0,
            ),
            (
                self.u,
                "Stokes U, 353 GHz",
                "MJy/sr",
                log,
                Colours::Planck,
                frame(1.0, second),
                20.0,
            ),
            (
                self.t,
                "Temperature T of the fitted total",
                "K",
                linear,
                Colours::Planck,
                frame(0.0, third),
                20.0,
            ),
            (
                self.beta,
                "Spectral index β of the fitted total",
                "",
                linear,
                Colours::Planck,
                frame(1.0, third),
                20.0,
            ),
        ] {
            let plot = MapPlot {
                nside: panel.nside,
                values: panel.values,
                title: title.to_owned(),
                unit: unit.to_owned(),
                scale: scale(panel.values),
                colours,
                view: View::Mollweide,
            };
            plot.check()?;
            plot.draw(&mut canvas, frame, size)?;
        }
        canvas.png()
    }
}
