//! A figure as a section of the page and as a PNG.

use super::figure::{Figure, MapPanel, Panel, Table};
use crate::error::Result;
use crate::plot::MapPlot;
use crate::plot::canvas::Canvas;
use crate::plot::surface::{Frame, Ink, Surface};
use crate::plot::svg::{Svg, escape};
use crate::plot::text::Anchor;
use rayon::prelude::*;
use std::fmt::Write as _;

/// Width of a panel in the page and size of its letters, CSS pixels: three fit beside each other on a screen of 1280.
const PANEL: (f32, f32) = (400.0, 13.0);
/// The PNG is so many times larger.
const PNG_SCALE: f32 = 1.6;
/// Letters of a PNG's heading.
const HEADING: f32 = 30.0;

impl MapPanel {
    fn plot(&self) -> MapPlot<'_> {
        MapPlot {
            nside: self.nside,
            values: &self.values,
            title: self.title.clone(),
            unit: self.unit.to_owned(),
            scale: self.scale,
            colours: self.colours,
            view: self.view,
        }
    }
}

impl Panel {
    fn title(&self) -> &str {
        match self {
            Self::Map(map) => &map.title,
            Self::Chart(chart) => &chart.title,
        }
    }

    fn height(&self, surface: &dyn Surface, width: f32, size: f32) -> f32 {
        match self {
            Self::Map(map) => map.plot().height(width, size),
            Self::Chart(chart) => chart.height(surface, width, size),
        }
    }

    fn draw(&self, surface: &mut dyn Surface, frame: Frame, size: f32) -> Result<()> {
        match self {
            Self::Map(map) => map.plot().draw(surface, frame, size),
            Self::Chart(chart) => {
                chart.draw(surface, frame, size);
                Ok(())
            }
        }
    }

    /// The panel as an SVG of its own.
    fn svg(&self) -> Result<String> {
        let (width, size) = PANEL;
        let height = self.height(&Svg::new(width, 1.0)?, width, size).ceil();
        let mut svg = Svg::new(width, height)?;
        self.draw(
            &mut svg,
            Frame {
                x: 0.0,
                y: 0.0,
                width,
                height,
            },
            size,
        )?;
        Ok(svg.finish(self.title()))
    }
}

/// All panels on one picture.
pub(super) fn png(figure: &Figure) -> Result<Vec<u8>> {
    let (width, size) = (PANEL.0 * PNG_SCALE, PANEL.1 * PNG_SCALE);
    let columns = figure.columns.min(figure.panels.len()).max(1);
    let probe = Canvas::new(1, 1)?;
    let rows: Vec<&[Panel]> = figure.panels.chunks(columns).collect();
    let heights: Vec<f32> = rows
        .iter()
        .map(|row| {
            row.iter()
                .map(|panel| panel.height(&probe, width, size))
                .fold(0.0, f32::max)
                .ceil()
        })
        .collect();
    let top = HEADING * 2.2;
    let (whole, total) = (
        width * columns as f32,
        top + heights.iter().sum::<f32>() + size,
    );
    let mut canvas = Canvas::new(whole as u32, total as u32)?;
    let heading = if figure.paper.is_empty() {
        figure.title.clone()
    } else {
        format!("{}: {}", figure.paper, figure.title)
    };
    let room = (whole - HEADING) / canvas.text_width(&heading, HEADING);
    canvas.text(
        &heading,
        HEADING * room.min(1.0),
        Anchor::Middle,
        whole / 2.0,
        HEADING * 1.5,
        Ink::Text,
    );
    let mut y = top;
    for (row, height) in rows.iter().zip(heights) {
        for (column, panel) in row.iter().enumerate() {
            let x = width * column as f32;
            // Not stretched to the height of its neighbours.
            let own = panel.height(&probe, width, size);
            panel.draw(
                &mut canvas,
                Frame {
                    x,
                    y,
                    width,
                    height: own,
                },
                size,
            )?;
        }
        y += height;
    }
    canvas.png()
}

/// The section of the page. `files` are the names of what was written for it.
pub(super) fn section(figure: &Figure, files: &[String]) -> Result<String> {
    let mut html = String::new();
    let number = if figure.paper.is_empty() {
        String::new()
    } else {
        format!(
            "<span class=\"paper\">Paper: {}</span>",
            escape(figure.paper)
        )
    };
    let _ = write!(
        html,
        "<section id=\"{}\"><h2>{}{number}</h2>",
        figure.id,
        escape(&figure.title)
    );
    let _ = write!(html, "<p>{}</p>", prose(&figure.caption));
    if !figure.look.is_empty() {
        let _ = write!(
            html,
            "<p class=\"look\"><b>What to look for.</b> {}</p>",
            prose(&figure.look)
        );
    }
    if !figure.lacking.is_empty() {
        let _ = write!(html, "<p class=\"lacking\">{}</p>", prose(&figure.lacking));
    }
    if !figure.panels.is_empty() {
        let panels: Vec<String> = figure
            .panels
            .par_iter()
            .map(Panel::svg)
            .collect::<Result<_>>()?;
        let _ = write!(
            html,
            "<div class=\"panels c{}\">{}</div>",
            figure.columns.min(3),
            panels.concat()
        );
    }
    for table in &figure.tables {
        html.push_str(&self::table(table));
    }
    html.push_str(&comparisons(figure));
    if !files.is_empty() {
        let links: Vec<String> = files
            .iter()
            .map(|name| format!("<a href=\"{name}\">{name}</a>"))
            .collect();
        let _ = write!(html, "<p class=\"files\">Files: {}</p>", links.join(" · "));
    }
    html.push_str("</section>\n");
    Ok(html)
}

/// Prose for the page: escaped, with the subscripts of symbols set as such.
pub(super) fn prose(text: &str) -> String {
    const SYMBOLS: [(&str, &str); 20] = [
        ("C_TE", "C<sub>TE</sub>"),
        ("C_TT", "C<sub>TT</sub>"),
        ("C_EE", "C<sub>EE</sub>"),
        ("C_Tβ", "C<sub>Tβ</sub>"),
        ("C_ββ", "C<sub>ββ</sub>"),
        ("C_l", "C<sub>l</sub>"),
        ("D_l", "D<sub>l</sub>"),
        ("h_l", "h<sub>l</sub>"),
        ("A_TT", "A<sub>TT</sub>"),
        ("A_EE", "A<sub>EE</sub>"),
        ("A_BB", "A<sub>BB</sub>"),
        ("T_avg", "T<sub>avg</sub>"),
        ("β_avg", "β<sub>avg</sub>"),
        ("s_avg", "s<sub>avg</sub>"),
        ("s_T", "s<sub>T</sub>"),
        ("s_β", "s<sub>β</sub>"),
        ("σ_T", "σ<sub>T</sub>"),
        ("σ_β", "σ<sub>β</sub>"),
        ("p_max", "p<sub>max</sub>"),
        ("f_i", "f<sub>i</sub>"),
    ];
    // Names of keys and files have dots or slashes and stay as they are typed.
    escape(text)
        .split(' ')
        .map(|word| {
            if word.contains(['/', '.']) && !word.ends_with('.') && !word.contains('√') {
                return word.to_owned();
            }
            SYMBOLS
                .into_iter()
                .fold(word.to_owned(), |word, (plain, set)| {
                    word.replace(plain, set)
                })
        })
        .collect::<Vec<_>>()
        .join(" ")
}

fn table(table: &Table) -> String {
    let mut html = String::from("<div class=\"scroll\"><table><thead><tr>");
    for name in &table.head {
        let _ = write!(html, "<th>{}</th>", prose(name));
    }
    html.push_str("</tr></thead><tbody>");
    for row in &table.rows {
        html.push_str("<tr>");
        for (index, cell) in row.iter().enumerate() {
            let tag = if index == 0 { "th" } else { "td" };
            let _ = write!(html, "<{tag}>{}</{tag}>", prose(cell));
        }
        html.push_str("</tr>");
    }
    html.push_str("</tbody></table></div>");
    html
}

/// The paper's values beside the run's.
fn comparisons(figure: &Figure) -> String {
    if figure.comparisons.is_empty() {
        return String::new();
    }
    let mut html = String::from("<ul class=\"compare\">");
    for item in &figure.comparisons {
        let (class, word) = match item.agrees {
            Some(true) => ("pass", "agrees"),
            Some(false) => ("differs", "differs"),
            None => ("none", "given"),
        };
        let _ = write!(
            html,
            "<li><span class=\"badge {class}\">{word}</span><div><b>{}</b>: paper {}; this run {}.{}</div></li>",
            prose(&item.quantity),
            prose(&item.paper),
            prose(&item.run),
            if item.agrees == Some(true) {
                String::new()
            } else {
                format!(
                    " <span class=\"why\">Why it may differ: {}.</span>",
                    prose(&item.why)
                )
            }
        );
    }
    html.push_str("</ul>");
    html
}
