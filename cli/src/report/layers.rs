//! The layers as maps: reddening and optical depth, then I, Q, U after each stage, and polarised intensity.

use super::figure::{Figure, Panel};
use super::numbers::{STATISTICS, Statistics};
use super::source::{Show, Source, panel};
use crate::error::Result;
use crate::kernels::healpix::Nside;
use crate::kernels::healpix::missing::{MISSING, is_missing};
use crate::stages::builtin_sky::distance_kpc;

/// How to have what a run did not keep.
pub(super) const KEEP_ALL: &str = "make the run again with --keep all";

/// Distances between which a layer lies, such as `63 pc – 251 pc`.
fn distances(edges: &[f64], layer: usize) -> String {
    let show = |mu: f64| {
        let kpc = distance_kpc(mu);
        if kpc < 0.9995 {
            format!("{:.0} pc", 1e3 * kpc)
        } else if kpc < 9.95 {
            format!("{kpc:.2} kpc")
        } else {
            format!("{kpc:.1} kpc")
        }
    };
    match (
        layer.checked_sub(1).and_then(|i| edges.get(i)),
        edges.get(layer),
    ) {
        (None, Some(&to)) => format!("nearer than {}", show(to)),
        (Some(&from), Some(&to)) => format!("{} – {}", show(from), show(to)),
        _ => String::new(),
    }
}

/// Rows of statistics, each led by the number of the layer.
fn statistics(figure: &mut Figure, maps: &[Vec<f64>]) {
    let rows: Vec<(String, Vec<f64>)> = maps
        .iter()
        .enumerate()
        .map(|(i, map)| (format!("layer {}", i + 1), Statistics::of(map).row()))
        .collect();
    let name = figure.id;
    figure.named_numbers(name, &STATISTICS, &rows);
}

/// Figure 1: reddening in shells.
pub(super) fn shells(source: &Source<'_>) -> Result<Figure> {
    let mut figure = Figure::new("shells", "Figure 1", "Reddening in shells of distance");
    figure.caption = "E(B−V) between the edges of the layers: differences of the cumulative maps of the cube, on its own grid. Grey: not observed.".into();
    figure.look = "Nearby shells cover the sky with small reddening at high latitude; distant ones hug the Galactic plane. The grey part is the sky the survey cannot see; the next figure has it filled.".into();
    let edges = &source.config.layers.edges;
    let stems: Vec<String> = edges
        .iter()
        .map(|mu| format!("cube/ebv_{mu:04.1}"))
        .collect();
    if !stems.iter().all(|stem| source.run.holds(stem)) {
        figure.lacking = format!("The run did not keep the reddening cube; {KEEP_ALL}.");
        return Ok(figure);
    }
    let mut before: Option<Vec<f64>> = None;
    let mut shells = Vec::new();
    for (layer, stem) in stems.iter().enumerate() {
        let map = source.run.map(stem)?;
        let nside = Nside::new(map.nside.into())?;
        let shell: Vec<f64> = match &before {
            None => map.values.clone(),
            Some(before) => map
                .values
                .iter()
                .zip(before)
                .map(|(far, near)| {
                    if is_missing(*far) || is_missing(*near) {
                        MISSING
                    } else {
                        far - near
                    }
                })
                .collect(),
        };
        let title = format!("Layer {}: {}", layer + 1, distances(edges, layer));
        figure.panels.push(Panel::Map(panel(
            nside,
            &shell,
            title,
            Show::Positive("mag"),
            source.level,
        )?));
        shells.push(shell);
        before = Some(map.values);
    }
    statistics(&mut figure, &shells);
    Ok(figure)
}

/// Figure 2: optical depth of the layers.
pub(super) fn optical_depth(source: &Source<'_>) -> Result<Figure> {
    let mut figure = Figure::new("optical-depth", "Figure 2", "Optical depth of the layers");
    figure.caption = "f_i τ at 353 GHz: the observed optical depth shared among the layers by their fractions of the reddening, where nothing was observed by those at the mirrored directions.".into();
    figure.look = "The layers add up to the observed optical depth in every pixel. No edge of the survey should be seen; structure in the filled part is that of τ, not of the cube.".into();
    if !source.kept("fractions/f") {
        figure.lacking = format!("The run did not keep the fractions of the layers; {KEEP_ALL}.");
        return Ok(figure);
    }
    let tau = source.map("observations/tau")?;
    let mut maps = Vec::new();
    for (layer, fraction) in source.maps("fractions/f")?.into_iter().enumerate() {
        let map: Vec<f64> = fraction.iter().zip(&tau).map(|(f, tau)| f * tau).collect();
        let title = format!(
            "Layer {}: {}",
            layer + 1,
            distances(&source.config.layers.edges, layer)
        );
        figure
            .panels
            .push(Panel::Map(source.panel(&map, title, Show::Positive(""))?));
        maps.push(map);
    }
    statistics(&mut figure, &maps);
    Ok(figure)
}

/// Maps of a stage, those of a layer side by side; of each, what comes before `_1` is `…/I`, `…/Q` or `…/U`.
fn stage(source: &Source<'_>, mut figure: Figure, stems: &[&str]) -> Result<Figure> {
    if let Some(stem) = stems.iter().find(|stem| !source.kept(stem)) {
        figure.lacking = format!(
            "The run did not keep {stem}_1 … {}; {KEEP_ALL}.",
            source.layers
        );
        return Ok(figure);
    }
    figure.columns = stems.len();
    let mut rows: Vec<(String, Vec<f64>)> = Vec::new();
    for number in 1..=source.layers {
        for stem in stems {
            let map = source.map(&format!("{stem}_{number}"))?;
            let letter = stem.rsplit('/').next().unwrap_or(stem);
            let show = if letter == "I" {
                Show::Intensity
            } else {
                Show::Signed
            };
            let title = format!("{letter}, layer {number}");
            rows.push((title.clone(), Statistics::of(&map).row()));
            figure
                .panels
                .push(Panel::Map(source.panel(&map, title, show)?));
        }
    }
    let name = figure.id;
    figure.named_numbers(name, &STATISTICS, &rows);
    Ok(figure)
}

/// Figure 4: the layers that the galactic field predicts.
pub(super) fn predicted(source: &Source<'_>) -> Result<Figure> {
    let mut figure = Figure::new(
        "predicted",
        "Figure 4",
        "Layers predicted by the galactic field",
    );
    figure.caption = "Intensity of each layer at 353 GHz, and its Q and U as the bisymmetric spiral field polarises it, before anything is made to agree with the observed polarisation.".into();
    figure.look = "Regular, large patterns: Q > 0 along the plane, U changing its sign across it. Fluctuations are those of the intensity alone.".into();
    stage(
        source,
        figure,
        &["intensity/I", "predicted/Q", "predicted/U"],
    )
}

/// Figure 5: the layers that add up to the observation.
pub(super) fn renormalised(source: &Source<'_>) -> Result<Figure> {
    let mut figure = Figure::new(
        "renormalised",
        "Figure 5",
        "Layers renormalised to the observation",
    );
    figure.caption = "Q and U of each layer after the residual has been shared out and the polarisation fraction capped; they add up to the observed Q and U. Intensity is that of figure 4.".into();
    figure.look = "Observed structure appears in the layers that are bright where it is; loops and the plane's sign stay as the data have them.".into();
    stage(source, figure, &["renormalised/Q", "renormalised/U"])
}

/// Figure 6: the templates.
pub(super) fn templates(source: &Source<'_>) -> Result<Figure> {
    let mut figure = Figure::new(
        "templates",
        "Figure 6",
        "Templates: layers with small scales",
    );
    figure.caption = "The product at 353 GHz: I, Q and U of each layer with random small scales, log-normal in intensity, Gaussian in polarisation.".into();
    figure.look = "The large scales of figure 5 with fine grain everywhere, stronger where the layer is bright. No rings around bright spots, no empty regions at high latitude in the near layers.".into();
    stage(
        source,
        figure,
        &["templates/I", "templates/Q", "templates/U"],
    )
}

/// Figure 8: polarised intensity.
pub(super) fn polarised_intensity(source: &Source<'_>) -> Result<Figure> {
    let mut figure = Figure::new(
        "polarised-intensity",
        "Figure 8",
        "Polarised intensity of the layers",
    );
    figure.caption = "P = √(Q² + U²) of the templates at 353 GHz.".into();
    figure.look =
        "Near layers carry the polarisation of the high latitudes, far ones that of the plane."
            .into();
    let (q, u) = (source.maps("templates/Q")?, source.maps("templates/U")?);
    let mut maps = Vec::new();
    for (layer, (q, u)) in q.iter().zip(&u).enumerate() {
        let p: Vec<f64> = q.iter().zip(u).map(|(q, u)| q.hypot(*u)).collect();
        let title = format!("P, layer {}", layer + 1);
        figure
            .panels
            .push(Panel::Map(source.panel(&p, title, Show::Intensity)?));
        maps.push(p);
    }
    statistics(&mut figure, &maps);
    Ok(figure)
}
