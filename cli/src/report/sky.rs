//! The whole sky: observations, the three steps of Q and U, E and B of the total, and a detail.

use super::figure::{Figure, MapPanel, Panel};
use super::layers::KEEP_ALL;
use super::numbers::{STATISTICS, Statistics};
use super::source::{Show, Source, look, views};
use crate::error::Result;
use crate::plot::View;
use crate::sht::Harmonics;
use crate::stages::emission::Stokes;

/// The detail of the paper: longitude, latitude, side, degrees.
const DETAIL: (f64, f64, f64) = (0.0, 50.0, 25.0);

/// A figure of maps with their statistics, a row of the file per panel.
fn add(
    source: &Source<'_>,
    figure: &mut Figure,
    rows: &mut Vec<(String, Vec<f64>)>,
    map: &[f64],
    title: &str,
    show: Show,
) -> Result<()> {
    figure
        .panels
        .push(Panel::Map(source.panel(map, title, show)?));
    rows.push((title.to_owned(), Statistics::of(map).row()));
    Ok(())
}

/// As [`add`], in the colours of another map.
fn add_like(
    source: &Source<'_>,
    figure: &mut Figure,
    rows: &mut Vec<(String, Vec<f64>)>,
    (map, like): (&[f64], &[f64]),
    title: &str,
    show: Show,
) -> Result<()> {
    add(source, figure, rows, map, title, show)?;
    if let Some(Panel::Map(panel)) = figure.panels.last_mut() {
        panel.scale = source.panel(like, "", show)?.scale;
    }
    Ok(())
}

fn finish(figure: &mut Figure, rows: &[(String, Vec<f64>)]) {
    let name = figure.id;
    figure.named_numbers(name, &STATISTICS, rows);
}

/// E and B as maps.
fn modes(source: &mut Source<'_>, alm: &Harmonics) -> Result<[Vec<f64>; 2]> {
    let npix = source.plan.npix();
    let (mut e, mut b) = (vec![0.0; npix], vec![0.0; npix]);
    source
        .plan
        .synthesis_batch(&[&alm.e, &alm.b], &mut [&mut e, &mut b])?;
    Ok([e, b])
}

/// Figure 3: the observed T, E and B.
pub(super) fn observed(source: &mut Source<'_>) -> Result<Figure> {
    let mut figure = Figure::new("observed", "Figure 3", "The observations: T, E and B");
    figure.caption = "What the run took as observed, polarisation as its E and B modes, at 353 GHz and at the frequencies that are given for validation.".into();
    figure.look = "These maps are inputs: what is wrong with them is wrong with the run.".into();
    let mut rows = Vec::new();
    let mut skies = vec![(353, source.observed[0].clone(), source.observed_alm.clone())];
    let mut without = Vec::new();
    for ghz in [217, 143] {
        if let Some(stokes) = source.observed_at(ghz)? {
            let alm = Harmonics::of(&mut source.plan, views(&stokes), None)?;
            let [t, ..] = stokes;
            skies.push((ghz, t, alm));
        } else {
            without.push(ghz.to_string());
        }
    }
    for (ghz, t, alm) in &skies {
        let [e, b] = modes(source, alm)?;
        for (letter, map, show) in [
            ("T", t, Show::Intensity),
            ("E", &e, Show::Signed),
            ("B", &b, Show::Signed),
        ] {
            let title = format!("{letter}, {ghz} GHz");
            add(source, &mut figure, &mut rows, map, &title, show)?;
        }
    }
    if !without.is_empty() {
        figure.lacking = lacking_observations(&without);
    }
    finish(&mut figure, &rows);
    Ok(figure)
}

/// That a run has no observations at some frequencies, and how to have them.
pub(super) fn lacking_observations(ghz: &[String]) -> String {
    let keys: Vec<String> = ghz
        .iter()
        .map(|nu| format!("I_{nu}, Q_{nu} and U_{nu}"))
        .collect();
    format!(
        "The run was given no observed maps at {} GHz (without missing pixels); give {} in [inputs] to compare with them.",
        ghz.join(" and "),
        keys.join(", ")
    )
}

/// Figure 7: Q and U of the field model, of the observation and of the simulation.
pub(super) fn totals(source: &Source<'_>) -> Result<Figure> {
    let mut figure = Figure::new(
        "totals",
        "Figure 7",
        "Q and U of the whole sky: field model, observation, simulation",
    );
    figure.columns = 2;
    figure.caption = "Sums over the layers: predicted by the field (first row), observed (second), simulated with small scales (third), the last two in the same colours.".into();
    figure.look = "The field model is a crude approximation; the simulation agrees with the observation on large scales and adds fine grain.".into();
    let mut rows = Vec::new();
    if source.kept("predicted/Q") && source.kept("predicted/U") {
        for letter in ["Q", "U"] {
            let mut sum = vec![0.0; source.plan.npix()];
            for map in source.maps(&format!("predicted/{letter}"))? {
                for (sum, x) in sum.iter_mut().zip(&map) {
                    *sum += x;
                }
            }
            add(
                source,
                &mut figure,
                &mut rows,
                &sum,
                &format!("{letter}, field model"),
                Show::Signed,
            )?;
        }
    } else {
        figure.lacking =
            format!("The run did not keep the layers that the field predicts; {KEEP_ALL}.");
    }
    for (maps, name) in [(&source.observed, "observed"), (&source.total, "simulated")] {
        for (index, letter) in [(1, "Q"), (2, "U")] {
            add_like(
                source,
                &mut figure,
                &mut rows,
                (&maps[index], &source.observed[index]),
                &format!("{letter}, {name}"),
                Show::Signed,
            )?;
        }
    }
    finish(&mut figure, &rows);
    Ok(figure)
}

/// Figures 12 and 13: E and B of the total, and a detail of T, E and B.
pub(super) fn modes_and_detail(source: &mut Source<'_>) -> Result<[Figure; 2]> {
    let mut whole = Figure::new("modes", "Figure 12", "E and B of the simulation at 353 GHz");
    whole.columns = 2;
    whole.caption = "Scalar maps of the E and B modes of the sum of the templates.".into();
    whole.look =
        "E and B are alike in level; fine grain follows the brightness of the dust.".into();
    let alm = source.total_alm.clone();
    let simulated = modes(source, &alm)?;
    let alm = source.observed_alm.clone();
    let observed = modes(source, &alm)?;
    let mut rows = Vec::new();
    add(
        source,
        &mut whole,
        &mut rows,
        &simulated[0],
        "E, simulated",
        Show::Signed,
    )?;
    add(
        source,
        &mut whole,
        &mut rows,
        &simulated[1],
        "B, simulated",
        Show::Signed,
    )?;
    finish(&mut whole, &rows);

    let (lon, lat, side) = DETAIL;
    let mut detail = Figure::new(
        "detail",
        "Figure 13",
        "A detail: T, E and B observed and simulated",
    );
    detail.caption = format!(
        "{side}° around l = {lon}°, b = {lat}°, at 353 GHz; observed above, simulated below, each pair in the same colours. The file has the statistics of the pixels shown."
    );
    detail.look = "Below, the structures of the upper row with fine grain where the observation is smooth. The paper shows this at Nside 512; at lower resolution pixels are seen.".into();
    let view = View::Gnomonic {
        lon_deg: lon,
        lat_deg: lat,
        size_deg: side,
    };
    let total = (&source.total[0], &simulated[0], &simulated[1]);
    let seen = (&source.observed[0], &observed[0], &observed[1]);
    let mut rows = Vec::new();
    for ((t, e, b), name) in [(seen, "observed"), (total, "simulated")] {
        for (map, with, letter, show) in [
            (t, seen.0, "T", Show::Intensity),
            (e, total.1, "E", Show::Even("MJy/sr")),
            (b, total.2, "B", Show::Even("MJy/sr")),
        ] {
            let nside = source.nside.get() as u32;
            let (scale, colours, unit) = look(&view.visible(nside, with)?, show);
            let title = format!("{letter}, {name}");
            rows.push((
                title.clone(),
                Statistics::of(&view.visible(nside, map)?).row(),
            ));
            detail.panels.push(Panel::Map(MapPanel {
                nside,
                values: map.clone(),
                title,
                unit,
                scale,
                colours,
                view,
            }));
        }
    }
    finish(&mut detail, &rows);
    Ok([whole, detail])
}

/// Figure 16: model, observation and difference at other frequencies.
pub(super) fn other_frequencies(source: &Source<'_>, models: &[(u32, &Stokes)]) -> Result<Figure> {
    let mut figure = Figure::new(
        "other-frequencies",
        "Figure 16",
        "Model, observation and difference at 143 and 217 GHz",
    );
    figure.caption = "I, Q and U of the 3-D model beside what was observed at those frequencies, in the same colours, and the difference, in colours of its own.".into();
    figure.look = "Differences grow with the distance from 353 GHz and are largest in the plane. They are not expected to vanish: the fluctuations of T and β are random.".into();
    let mut rows = Vec::new();
    let mut without = Vec::new();
    for &(ghz, model) in models {
        let Some(observed) = source.observed_at(ghz)? else {
            without.push(ghz.to_string());
            continue;
        };
        let difference: Stokes = std::array::from_fn(|s| {
            model[s]
                .iter()
                .zip(&observed[s])
                .map(|(m, o)| m - o)
                .collect()
        });
        for (maps, name, signed) in [
            (&observed, "observed", Show::Signed),
            (model, "model", Show::Signed),
            (&difference, "model − observed", Show::Difference),
        ] {
            for (index, letter) in ["I", "Q", "U"].into_iter().enumerate() {
                let show = if index == 0 && signed == Show::Signed {
                    Show::Intensity
                } else {
                    signed
                };
                let like = if signed == Show::Difference {
                    &difference[index]
                } else {
                    &observed[index]
                };
                add_like(
                    source,
                    &mut figure,
                    &mut rows,
                    (&maps[index], like),
                    &format!("{letter}, {name}, {ghz} GHz"),
                    show,
                )?;
            }
        }
    }
    if !without.is_empty() {
        figure.lacking = lacking_observations(&without);
    }
    finish(&mut figure, &rows);
    Ok(figure)
}
