//! Angular power spectra: of the layers on parts of the sky, of the whole, at other frequencies; decoupled ones.

use super::figure::{Check, Figure, Panel, Table, decimal};
use super::layers::KEEP_ALL;
use super::numbers::{by_l, correlation, curve, mean_over_l};
use super::sky::lacking_observations;
use super::source::{Source, views};
use crate::cut_sky::master::band_weight;
use crate::cut_sky::{Mask, Master};
use crate::error::{Error, Result};
use crate::kernels::spectra::{PowerLaw, beam};
use crate::plot::{Axis, Chart, Curve, Spread, Style};
use crate::sht::{Harmonics, Spectra};
use crate::stages::emission::Stokes;

/// Slopes of TT that the paper finds.
const PAPER_SLOPES: (f64, f64) = (-3.2, -2.2);
/// Tolerance of the T–E correlation of a layer.
const TE_TOLERANCE: f64 = 0.03;
/// Least scatter of that of a single multipole: on coarse grids few of them lie beyond the observed scales.
const TE_SCATTER: f64 = 0.06;

fn diagram(title: impl Into<String>, spread: Spread, curves: Vec<Curve>) -> Panel {
    let what = if spread == Spread::Log {
        "C_l ((MJy/sr)²)"
    } else {
        "correlation"
    };
    Panel::Chart(Chart {
        title: title.into(),
        x: Axis::new("multipole l", Spread::Log),
        y: Axis::new(what, spread),
        curves,
        density: None,
    })
}

/// A power law as a dashed line.
fn reference(label: &str, colour: usize, law: PowerLaw, lo: usize, hi: usize) -> Curve {
    let points = [lo.max(2), hi.max(3)].map(|l| (l as f64, law.at(l)));
    Curve::new(label, colour, points.to_vec()).styled(Style::Dashed)
}

/// Figure 10: spectra of the layers, and the check of their T–E correlation.
pub(super) fn layers(source: &mut Source<'_>) -> Result<(Figure, Check)> {
    let mut figure = Figure::new("layer-spectra", "Figure 10", "Spectra of the layers");
    let mut percents = vec![100.0];
    percents.extend(
        source
            .options
            .sky_percent
            .iter()
            .copied()
            .filter(|p| *p < 100.0),
    );
    figure.caption = format!(
        "TT, EE and BB of each template on the whole sky and on its faintest parts (by the observed intensity at a resolution of 5°, edges apodised over {}°). On a part of the sky: spectra of the weighted maps divided by the mean squared weight. Curves are means over bands a tenth of l wide; the files hold every l. Dashed: the power laws fitted before small scales, TT with a slope of its own, EE and BB with the configured one.",
        source.options.apodise_deg
    );
    figure.look = "Straight lines down to the smallest scales: no bump, gap or step where observed and random scales meet (l ≈ 80 in polarisation). Far layers lie in the plane, so that little of them is left on the faint sky.".into();
    let lmax = source.lmax;
    let mut spectra: Vec<Vec<Spectra>> = Vec::new();
    for number in 1..=source.layers {
        let stokes: Stokes = [
            source.map(&format!("templates/I_{number}"))?,
            source.map(&format!("templates/Q_{number}"))?,
            source.map(&format!("templates/U_{number}"))?,
        ];
        let mut of_layer = Vec::new();
        for &percent in &percents {
            let mask = if percent < 100.0 {
                Some(source.sky(percent, source.nside)?)
            } else {
                None
            };
            let square = mask.as_ref().map_or(1.0, Mask::mean_square);
            let alm = Harmonics::of(&mut source.plan, views(&stokes), mask.as_ref())?;
            of_layer.push(alm.spectra(lmax)?.over(square));
        }
        spectra.push(of_layer);
    }
    let scales = &source.config.small_scales;
    for (layer, of_layer) in spectra.iter().enumerate() {
        let number = layer + 1;
        let fit = source.run.manifest.small_scales.get(layer);
        let pick: [(&str, fn(&Spectra) -> &Vec<f64>); 3] =
            [("TT", |s| &s.tt), ("EE", |s| &s.ee), ("BB", |s| &s.bb)];
        for (kind, (name, get)) in pick.into_iter().enumerate() {
            let mut curves: Vec<Curve> = percents
                .iter()
                .zip(of_layer)
                .enumerate()
                .map(|(colour, (percent, s))| {
                    curve(&format!("{percent} % of the sky"), colour, get(s), lmax)
                })
                .collect();
            if let Some(fit) = fit {
                let (amplitude, slope) = [
                    (fit.a_t, fit.alpha_t),
                    (fit.a_ee, scales.slope_ee),
                    (fit.a_bb, scales.slope_bb),
                ][kind];
                let law = PowerLaw { amplitude, slope };
                curves.push(reference(
                    &format!("slope {}", decimal(slope, 2)),
                    5,
                    law,
                    20,
                    lmax,
                ));
            }
            figure.panels.push(diagram(
                format!("{name}, layer {number}"),
                Spread::Log,
                curves,
            ));
        }
        let mut names: Vec<String> = vec!["l".into()];
        let mut columns: Vec<&[f64]> = Vec::new();
        for (percent, s) in percents.iter().zip(of_layer) {
            for (name, c) in [("TT", &s.tt), ("EE", &s.ee), ("BB", &s.bb), ("TE", &s.te)] {
                names.push(format!("{name}_{percent}"));
                columns.push(c);
            }
        }
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        figure.numbers(format!("spectra-layer-{number}"), &names, &by_l(&columns));
    }
    slopes(source, &mut figure);
    let check = te_correlation(source, &mut figure, &spectra)?;
    Ok((figure, check))
}

fn slopes(source: &Source<'_>, figure: &mut Figure) {
    let records = &source.run.manifest.small_scales;
    if records.is_empty() {
        return;
    }
    let slopes: Vec<f64> = records.iter().map(|r| r.alpha_t).collect();
    let mut head = vec!["".to_owned()];
    head.extend((1..=records.len()).map(|i| format!("layer {i}")));
    let mut table = Table {
        head,
        rows: Vec::new(),
    };
    table.row("slope of TT", &slopes, 2);
    table.row(
        "A_TT at l = 80",
        &records.iter().map(|r| r.a_t).collect::<Vec<_>>(),
        1,
    );
    table.row(
        "A_EE at l = 80",
        &records.iter().map(|r| r.a_ee).collect::<Vec<_>>(),
        1,
    );
    table.row(
        "A_BB at l = 80",
        &records.iter().map(|r| r.a_bb).collect::<Vec<_>>(),
        1,
    );
    table.row("κ", &records.iter().map(|r| r.kappa).collect::<Vec<_>>(), 3);
    let mut how = vec!["κ found by".to_owned()];
    how.extend(records.iter().map(|r| r.kappa_status.clone()));
    table.rows.push(how);
    figure.tables.push(table);
    let (low, high) = slopes
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), s| {
            (low.min(*s), high.max(*s))
        });
    let agrees = low >= PAPER_SLOPES.0 - 0.1 && high <= PAPER_SLOPES.1 + 0.1;
    figure.compare(
        "slopes of TT of the layers",
        "−2.2 … −3.2, steeper with distance",
        format!("{} … {}", decimal(high, 2), decimal(low, 2)),
        Some(agrees),
        "slopes depend on the beam of the intensity map, on the fitted range of l (up to 300, or what the inputs and the grid carry) and on the cube; a layer that is a thin line along the plane has a shallow spectrum",
    );
}

/// The T–E correlation of every layer where nothing is observed. What the model promises is that of the layers before
/// their polarisation is limited to the intensity, which the run keeps as spectra; that of the templates stands beside it.
fn te_correlation(
    source: &Source<'_>,
    figure: &mut Figure,
    spectra: &[Vec<Spectra>],
) -> Result<Check> {
    let scales = &source.config.small_scales;
    let demand = format!(
        "TE correlation {:.2} ± {TE_TOLERANCE} (or three standard errors of its scatter) in every layer beyond the observed scales",
        scales.te
    );
    let beyond = |layer: usize| {
        let beams = &scales.polarisation_beam_deg;
        let fwhm = beams
            .get(layer)
            .or(beams.last())
            .copied()
            .unwrap_or(0.0)
            .to_radians();
        move |l: usize| beam(fwhm, l).powi(2) < 0.05
    };
    let mut curves = Vec::new();
    let (mut columns, mut names) = (Vec::new(), vec!["l".to_owned()]);
    let (mut templates, mut made, mut errors) = (Vec::new(), Vec::new(), Vec::new());
    for (layer, of_layer) in spectra.iter().enumerate() {
        let number = layer + 1;
        let whole = &of_layer[0];
        let rho = correlation(&whole.te, &whole.tt, &whole.ee);
        templates.push(mean_over_l(&rho, beyond(layer)));
        curves.push(curve(&format!("layer {number}"), layer, &rho, source.lmax));
        names.push(format!("template_{number}"));
        columns.push(rho);
        if let Some(rho) = made_with(source, number)? {
            let mean = mean_over_l(&rho, beyond(layer));
            let used = rho.iter().enumerate().filter(|(l, _)| beyond(layer)(*l));
            let n = used.clone().count() as f64;
            let square = used.map(|(_, r)| (r - mean).powi(2)).sum::<f64>() / n;
            made.push(mean);
            errors.push((square.max(TE_SCATTER.powi(2)) / n).sqrt());
            names.push(format!("made_{number}"));
            columns.push(rho);
        }
    }
    let ends = [2.0, source.lmax as f64].map(|l| (l, scales.te));
    curves.push(Curve::new("configured", 5, ends.to_vec()).styled(Style::Dashed));
    figure.panels.push(diagram(
        "T–E correlation of the templates",
        Spread::Linear,
        curves,
    ));
    let head: Vec<&str> = names.iter().map(String::as_str).collect();
    let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    figure.numbers("te-correlation", &head, &by_l(&columns));
    let mut table = Table {
        head: vec!["C_TE/√(C_TT C_EE), mean over l with h_l² < 0.05".into()],
        rows: Vec::new(),
    };
    table
        .head
        .extend((1..=spectra.len()).map(|i| format!("layer {i}")));
    if !made.is_empty() {
        table.row("as made", &made, 3);
        table.row("standard error", &errors, 3);
    }
    table.row("templates, after the limit P ≤ I", &templates, 3);
    figure.tables.push(table);
    if !scales.enabled || scales.te_filter == crate::config::TeFilter::None {
        return Ok(Check::not_available(
            "te_correlation",
            demand,
            "small scales, or the filter that sets their T–E correlation, are switched off; set small_scales.enabled = true and small_scales.te_filter = \"measured\"",
            "layer-spectra",
        ));
    }
    if made.len() < spectra.len() {
        return Ok(Check::not_available(
            "te_correlation",
            demand,
            format!("the run did not keep the spectra of its layers; {KEEP_ALL}"),
            "layer-spectra",
        ));
    }
    let known: Vec<(f64, f64)> = made
        .iter()
        .copied()
        .zip(errors)
        .filter(|(mean, _)| mean.is_finite())
        .collect();
    if known.is_empty() {
        return Ok(Check::not_available(
            "te_correlation",
            demand,
            "the band limit is too low for scales beyond the observed ones; raise lmax or nside",
            "layer-spectra",
        ));
    }
    let holds = known
        .iter()
        .all(|(mean, error)| (mean - scales.te).abs() <= TE_TOLERANCE.max(3.0 * error));
    let shown: Vec<String> = made.iter().map(|m| decimal(*m, 3)).collect();
    Ok(Check::new(
        "te_correlation",
        demand,
        holds,
        format!("layers 1 … {}: {}", made.len(), shown.join(", ")),
        "layer-spectra",
    )
    .with("layers", made)
    .with("templates", templates))
}

/// C_TE/√(C_TT C_EE) of a layer as the run made it, where the run kept its spectra.
fn made_with(source: &Source<'_>, number: usize) -> Result<Option<Vec<f64>>> {
    let path = source.run.dir.join(format!("spectra/layer_{number}.csv"));
    if !path.exists() {
        return Ok(None);
    }
    let text = std::fs::read_to_string(&path).map_err(|cause| Error::io("read", &path, &cause))?;
    let mut lines = text.lines();
    let head: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let place = |name: &str| head.iter().position(|column| *column == name);
    let (Some(tt), Some(ee), Some(te)) = (place("TT"), place("EE"), place("TE")) else {
        return Ok(None);
    };
    let mut columns: [Vec<f64>; 3] = Default::default();
    for line in lines {
        let values: Vec<f64> = line.split(',').map(|x| x.parse().unwrap_or(0.0)).collect();
        for (column, place) in columns.iter_mut().zip([tt, ee, te]) {
            column.push(values.get(place).copied().unwrap_or(0.0));
        }
    }
    let [tt, ee, te] = columns;
    Ok(Some(correlation(&te, &tt, &ee)))
}

/// Spectra of the observation and of the simulation as four diagrams.
fn pair(
    figure: &mut Figure,
    name: &str,
    what: &str,
    observed: &Spectra,
    simulated: &Spectra,
    lmax: usize,
    te: bool,
) {
    let kinds: [(&str, &Vec<f64>, &Vec<f64>); 4] = [
        ("TT", &observed.tt, &simulated.tt),
        ("EE", &observed.ee, &simulated.ee),
        ("BB", &observed.bb, &simulated.bb),
        ("TE", &observed.te, &simulated.te),
    ];
    for (kind, observed, simulated) in kinds {
        if kind == "TE" && !te {
            continue;
        }
        let size = |c: &[f64]| -> Vec<f64> {
            if kind == "TE" {
                c.iter().map(|x| x.abs()).collect()
            } else {
                c.to_vec()
            }
        };
        let title = if kind == "TE" {
            format!("|TE|{what}")
        } else {
            format!("{kind}{what}")
        };
        let curves = vec![
            curve("observed", 0, &size(observed), lmax),
            curve("simulated", 1, &size(simulated), lmax),
        ];
        figure.panels.push(diagram(title, Spread::Log, curves));
    }
    let columns: Vec<&[f64]> = kinds
        .iter()
        .flat_map(|(_, o, s)| [o.as_slice(), s.as_slice()])
        .collect();
    figure.numbers(
        name,
        &[
            "l",
            "TT_observed",
            "TT_simulated",
            "EE_observed",
            "EE_simulated",
            "BB_observed",
            "BB_simulated",
            "TE_observed",
            "TE_simulated",
        ],
        &by_l(&columns),
    );
}

/// Figure 11: spectra of the whole at 353 GHz.
pub(super) fn total(source: &Source<'_>) -> Result<Figure> {
    let mut figure = Figure::new(
        "total-spectra",
        "Figure 11",
        "Spectra of observation and simulation at 353 GHz",
    );
    figure.columns = 2;
    figure.caption = "TT, EE, BB and TE of the observed maps on the run's grid and of the sum of the templates, whole sky. TE is drawn without its sign; the file has it.".into();
    figure.look = "The same on large scales; where the observation falls below its own power law, for want of resolution, the simulation continues it.".into();
    let (observed, simulated) = (
        source.observed_alm.spectra(source.lmax)?,
        source.total_alm.spectra(source.lmax)?,
    );
    pair(
        &mut figure,
        "total-spectra",
        "",
        &observed,
        &simulated,
        source.lmax,
        true,
    );
    let low = |get: fn(&Spectra) -> &Vec<f64>| {
        let ratio = |l: usize| get(&simulated)[l] / get(&observed)[l];
        let c: Vec<f64> = (0..=source.lmax)
            .map(|l| if l < 2 { 0.0 } else { ratio(l) })
            .collect();
        mean_over_l(&c, |l| (2..=30).contains(&l))
    };
    let mut table = Table::new(&["", "TT", "EE", "BB"]);
    table.row(
        "simulated / observed, mean over 2 ≤ l ≤ 30",
        &[low(|s| &s.tt), low(|s| &s.ee), low(|s| &s.bb)],
        3,
    );
    figure.tables.push(table);
    Ok(figure)
}

/// Figure 14: E and B spectra at other frequencies.
pub(super) fn other_frequencies(
    source: &mut Source<'_>,
    models: &[(u32, &Stokes)],
) -> Result<Figure> {
    let mut figure = Figure::new(
        "frequency-spectra",
        "Figure 14",
        "Spectra of observation and simulation at 143 and 217 GHz",
    );
    figure.columns = 2;
    figure.caption = "EE and BB of what was observed at 143 and 217 GHz and of the 3-D model there, whole sky. The files hold TT and TE too.".into();
    figure.look =
        "Agreement on large scales; on small ones the observation lacks resolution, as at 353 GHz."
            .into();
    let mut without = Vec::new();
    for &(ghz, model) in models {
        let Some(observed) = source.observed_at(ghz)? else {
            without.push(ghz.to_string());
            continue;
        };
        let alms = Harmonics::of_all(&mut source.plan, &[views(&observed), views(model)], None)?;
        let (observed, simulated) = (alms[0].spectra(source.lmax)?, alms[1].spectra(source.lmax)?);
        let before = figure.panels.len();
        pair(
            &mut figure,
            &format!("spectra-{ghz}"),
            &format!(", {ghz} GHz"),
            &observed,
            &simulated,
            source.lmax,
            false,
        );
        // The paper shows E and B.
        figure.panels.remove(before);
    }
    if !without.is_empty() {
        figure.lacking = lacking_observations(&without);
    }
    Ok(figure)
}

/// Band powers on a part of the sky with the coupling by the mask undone.
pub(super) fn decoupled(source: &mut Source<'_>, width: usize) -> Result<Figure> {
    let mut figure = Figure::new(
        "decoupled-spectra",
        "",
        "Spectra on a part of the sky, decoupled",
    );
    figure.columns = 2;
    let mask = source.correlation_mask(source.nside)?;
    figure.caption = format!(
        "Band powers D_l = l(l+1)C_l/2π at 353 GHz on {:.1} % of the sky (mean weight), {width} multipoles a band, with the coupling of multipoles and of E with B by the mask undone (MASTER), beside the spectra of the weighted maps divided by the mean squared weight.",
        100.0 * mask.mean()
    );
    figure.look = "Where the two differ, the simple correction is not enough: at the lowest multipoles, and in BB where it is far below EE.".into();
    let views = [views(&source.observed), views(&source.total)];
    let alms = Harmonics::of_all(&mut source.plan, &views, Some(&mask))?;
    let master = Master::new(&source.plan, &mask, width)?;
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut names = vec!["l_first".to_owned(), "l_last".to_owned()];
    let mut curves: [Vec<Curve>; 4] = Default::default();
    let mut bands = Vec::new();
    for (index, (alm, name)) in alms.iter().zip(["observed", "simulated"]).enumerate() {
        let weighted = alm.spectra(source.lmax)?;
        let powers = master.band_powers(&weighted)?;
        let simple = weighted.over(mask.mean_square());
        bands.clone_from(&powers.bands);
        let kinds = [
            ("TT", &simple.tt, &powers.powers.tt),
            ("EE", &simple.ee, &powers.powers.ee),
            ("BB", &simple.bb, &powers.powers.bb),
            ("TE", &simple.te, &powers.powers.te),
        ];
        for (curves, (kind, simple, decoupled)) in curves.iter_mut().zip(kinds) {
            let size = |c: f64| if kind == "TE" { c.abs() } else { c };
            let points = powers.bands.iter().zip(decoupled);
            let points =
                points.map(|(band, c)| (0.5 * (band.start + band.end - 1) as f64, size(*c)));
            let simple: Vec<f64> = simple
                .iter()
                .enumerate()
                .map(|(l, c)| size(*c) * band_weight(l))
                .collect();
            curves.push(Curve::new(
                &format!("{name}, decoupled"),
                2 * index,
                points.collect(),
            ));
            curves.push(
                curve(
                    &format!("{name}, simple"),
                    2 * index + 1,
                    &simple,
                    source.lmax,
                )
                .styled(Style::Dashed),
            );
            names.push(format!("{kind}_{name}"));
            columns.push(decoupled.clone());
        }
    }
    for (curves, kind) in curves.into_iter().zip(["TT", "EE", "BB", "|TE|"]) {
        figure.panels.push(Panel::Chart(Chart {
            title: kind.to_owned(),
            x: Axis::new("multipole l", Spread::Log),
            y: Axis::new("l(l+1)C_l/2π ((MJy/sr)²)", Spread::Log),
            curves,
            density: None,
        }));
    }
    let rows: Vec<Vec<f64>> = bands
        .iter()
        .enumerate()
        .map(|(b, band)| {
            let mut row = vec![band.start as f64, (band.end - 1) as f64];
            row.extend(columns.iter().map(|column| column[b]));
            row
        })
        .collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    figure.numbers("decoupled-spectra", &names, &rows);
    Ok(figure)
}
