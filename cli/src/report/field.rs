//! The pitch angle of the field, and the polarisation fractions.

use super::figure::{Figure, Panel, Table, decimal};
use super::layers::KEEP_ALL;
use super::numbers::histogram;
use super::source::Source;
use crate::error::{Error, Result};
use crate::plot::{Axis, Chart, Curve, Spread, Style};

/// The paper's pitch angle, degrees.
const PAPER_PITCH: f64 = -33.0;
/// Least share of a layer in the intensity of a pixel whose polarisation fraction is counted.
const LEAST_SHARE: f64 = 0.1;
/// Fewest pixels that make a histogram worth drawing.
const LEAST_PIXELS: f64 = 200.0;
/// Bins of the histograms, from 0 to 1.
const BINS: usize = 100;

/// The objective of the pitch angle.
pub(super) fn pitch(source: &Source<'_>) -> Result<Figure> {
    let mut figure = Figure::new("pitch", "section 4.2", "Pitch angle of the field");
    let fitted = source.config.field.pitch_deg.is_none();
    let found = source.run.manifest.pitch_deg.unwrap_or(f64::NAN);
    let latitude = source.config.field.min_latitude_deg;
    figure.columns = 2;
    figure.caption = format!(
        "G(q): the sum over pixels at |b| ≥ {latitude}° of |Q model − Q observed| + |U model − U observed|, for the field of pitch angle q."
    );
    figure.look = "One clear minimum within the scanned range. A minimum at an end, or a flat curve, means that the regular field explains nothing of these data.".into();
    let why = if source.run.manifest.synthetic_inputs == Some(true) {
        "the built-in sky is made with a field of −33°, to which random polarisation is added"
    } else {
        "the paper's data are GNILC maps of Planck; other maps, and this program's orientation of grains perpendicular to the field, move the minimum by some degrees"
    };
    let agrees = (found - PAPER_PITCH).abs() <= 5.0;
    figure.compare(
        "pitch angle",
        "−33°",
        format!(
            "{}° ({})",
            decimal(found, 2),
            if fitted { "fitted" } else { "given" }
        ),
        fitted.then_some(agrees),
        why,
    );
    if !source
        .run
        .manifest
        .files
        .iter()
        .any(|file| file.path == "pitch.csv")
    {
        figure.lacking = "The pitch angle was given, so there is no scan; leave field.pitch_deg out to have it fitted.".into();
        return Ok(figure);
    }
    let path = source.run.dir.join("pitch.csv");
    let text = std::fs::read_to_string(&path).map_err(|cause| Error::io("read", &path, &cause))?;
    let points: Vec<(f64, f64)> = text
        .lines()
        .skip(1)
        .filter_map(|line| {
            let (q, g) = line.split_once(',')?;
            Some((q.parse().ok()?, g.parse().ok()?))
        })
        .collect();
    let rows: Vec<Vec<f64>> = points.iter().map(|(q, g)| vec![*q, *g]).collect();
    let (low, high) = points
        .iter()
        .fold((f64::INFINITY, 0.0_f64), |(low, high), (_, g)| {
            (low.min(*g), high.max(*g))
        });
    let mark = |q: f64| vec![(q, low - 0.05 * (high - low)), (q, high)];
    figure.panels.push(Panel::Chart(Chart {
        title: "Distance between field model and observation".into(),
        x: Axis::new("pitch angle q (degrees)", Spread::Linear),
        y: Axis::new("G (MJy/sr)", Spread::Linear),
        curves: vec![
            Curve::new("G(q)", 0, points),
            Curve::new(&format!("this run: {}°", decimal(found, 2)), 1, mark(found)),
            Curve::new("paper: −33°", 2, mark(PAPER_PITCH)).styled(Style::Dashed),
        ],
        density: None,
    }));
    figure.numbers("pitch", &["q_deg", "G"], &rows);
    Ok(figure)
}

/// Figure 9: histograms of the polarisation fraction.
pub(super) fn fractions(source: &Source<'_>) -> Result<Figure> {
    let mut figure = Figure::new(
        "polarisation-fraction",
        "Figure 9",
        "Polarisation fraction of the layers",
    );
    figure.columns = 2;
    let p_max = source.config.polarisation.p_max;
    let renormalised = ["intensity/I", "renormalised/Q", "renormalised/U"];
    let whole = renormalised.iter().all(|stem| source.kept(stem));
    figure.caption = format!(
        "Share of pixels with polarisation fraction p = √(Q² + U²)/I per bin of 0.01, over the pixels where the layer has more than a tenth of the intensity of all. Before small scales p is at most {p_max} wherever the observation allows it; the templates may exceed it. Layers with fewer than {LEAST_PIXELS} such pixels are in the file alone."
    );
    figure.look = "Few strongly polarised pixels, and an edge at p_max before small scales.".into();
    let mut columns: Vec<String> = vec!["p_low".into(), "p_high".into()];
    let mut series: Vec<Vec<f64>> = Vec::new();
    let mut edges = Vec::new();
    let mut counted: Vec<Vec<f64>> = Vec::new();
    let mut draw = |stems: [&str; 3], title: &str, name: &str| -> Result<Chart> {
        let i = source.maps(stems[0])?;
        let sum: Vec<f64> = (0..source.plan.npix())
            .map(|p| i.iter().map(|i| i[p]).sum())
            .collect();
        let mut curves = Vec::new();
        for layer in 0..source.layers {
            let number = layer + 1;
            let (q, u) = (
                source.map(&format!("{}_{number}", stems[1]))?,
                source.map(&format!("{}_{number}", stems[2]))?,
            );
            let i = &i[layer];
            let p = (0..i.len())
                .filter(|&p| i[p] > LEAST_SHARE * sum[p])
                .map(|p| q[p].hypot(u[p]) / i[p]);
            let count = p.clone().count() as f64;
            counted.push(vec![count]);
            let (bins, counts) = histogram(p, 0.0, 1.0, BINS);
            let shares: Vec<f64> = counts.iter().map(|n| n / count.max(1.0)).collect();
            if count >= LEAST_PIXELS {
                curves.push(Curve::steps(
                    &format!("layer {number}"),
                    layer,
                    &bins,
                    &shares,
                ));
            }
            columns.push(format!("{name}_{number}"));
            series.push(shares);
            edges = bins;
        }
        Ok(Chart {
            title: title.to_owned(),
            x: Axis::new("polarisation fraction p", Spread::Linear).over(0.0, 0.5),
            y: Axis::new("share of pixels per 0.01", Spread::Linear),
            curves,
            density: None,
        })
    };
    if whole {
        let chart = draw(renormalised, "Before small scales", "renormalised")?;
        figure.panels.push(Panel::Chart(chart));
    } else {
        figure.lacking =
            format!("The run did not keep the layers before small scales; {KEEP_ALL}.");
    }
    let chart = draw(
        ["templates/I", "templates/Q", "templates/U"],
        "Templates",
        "template",
    )?;
    figure.panels.push(Panel::Chart(chart));
    let mut table = Table::new(&["pixels counted"]);
    table
        .head
        .extend((1..=source.layers).map(|i| format!("layer {i}")));
    let stages: &[&str] = if whole {
        &["before small scales", "templates"]
    } else {
        &["templates"]
    };
    for (name, counts) in stages.iter().zip(counted.chunks(source.layers.max(1))) {
        table.row(*name, &counts.concat(), 0);
    }
    figure.tables.push(table);
    let rows: Vec<Vec<f64>> = (0..BINS)
        .map(|bin| {
            let mut row = vec![edges[bin], edges[bin + 1]];
            row.extend(series.iter().map(|shares| shares[bin]));
            row
        })
        .collect();
    let names: Vec<&str> = columns.iter().map(String::as_str).collect();
    figure.numbers("polarisation-fraction", &names, &rows);
    Ok(figure)
}
