//! The overview of a run: I, Q, U, T and β of the total on one page.

use super::canvas::Canvas;
use super::colours::Colours;
use super::projection::View;
use super::scale::Scale;
use super::sky::MapPlot;
use super::surface::{Frame, Ink, Surface as _};
use super::text::Anchor;
use crate::error::Result;

/// The maps of the overview: 12 Nside² values each, RING order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overview<'a> {
    /// Resolution of the run, for the title.
    pub nside: u32,
    /// Resolution of these maps.
    pub grid: u32,
    /// Intensity at 353 GHz, MJy/sr.
    pub i: &'a [f64],
    /// Stokes Q at 353 GHz, MJy/sr.
    pub q: &'a [f64],
    /// Stokes U at 353 GHz, MJy/sr.
    pub u: &'a [f64],
    /// Temperature of the fit of the total, K.
    pub t: &'a [f64],
    /// Spectral index of the fit of the total.
    pub beta: &'a [f64],
}

/// Width of the picture in pixels.
const WIDTH: u32 = 1800;

/// The picture as a PNG file: intensity large, the other four below it two by two.
///
/// # Errors
/// A map of the wrong length.
pub fn render(maps: &Overview<'_>) -> Result<Vec<u8>> {
    let width = WIDTH as f32;
    let (heading, large, small) = (120.0, 930.0, 560.0);
    let mut canvas = Canvas::new(WIDTH, (heading + large + 2.0 * small) as u32)?;
    let title = "Polarised Galactic dust in 3-D: the total of all layers";
    canvas.text(title, 38.0, Anchor::Middle, width / 2.0, 60.0, Ink::Text);
    let subtitle = format!(
        "Nside {}, Galactic coordinates, polarisation as in HEALPix (COSMO)",
        maps.nside
    );
    canvas.text(
        &subtitle,
        22.0,
        Anchor::Middle,
        width / 2.0,
        98.0,
        Ink::Faint,
    );

    let whole = Frame {
        x: 0.0,
        y: heading,
        width,
        height: large,
    };
    let half = |column: f32, row: f32| Frame {
        x: column * width / 2.0,
        y: heading + large + row * small,
        width: width / 2.0,
        height: small,
    };
    let (log, linear) = (
        Scale::symlog_of as fn(&[f64]) -> Scale,
        Scale::linear_of as fn(&[f64]) -> Scale,
    );
    let (i, q, u) = (
        "Intensity I at 353 GHz",
        "Stokes Q at 353 GHz",
        "Stokes U at 353 GHz",
    );
    let (t, beta) = (
        "Temperature fitted to the total",
        "Spectral index β fitted to the total",
    );
    for (values, title, unit, scale, colours, frame, size) in [
        (maps.i, i, "MJy/sr", log, Colours::Inferno, whole, 22.0),
        (
            maps.q,
            q,
            "MJy/sr",
            log,
            Colours::Planck,
            half(0.0, 0.0),
            19.0,
        ),
        (
            maps.u,
            u,
            "MJy/sr",
            log,
            Colours::Planck,
            half(1.0, 0.0),
            19.0,
        ),
        (
            maps.t,
            t,
            "K",
            linear,
            Colours::Planck,
            half(0.0, 1.0),
            19.0,
        ),
        (
            maps.beta,
            beta,
            "dimensionless",
            linear,
            Colours::Planck,
            half(1.0, 1.0),
            19.0,
        ),
    ] {
        let plot = MapPlot {
            nside: maps.grid,
            values,
            title: title.to_owned(),
            unit: unit.to_owned(),
            scale: scale(values),
            colours,
            view: View::Mollweide,
        };
        plot.check()?;
        plot.draw(&mut canvas, frame, size)?;
    }
    canvas.png()
}
