//! Two runs side by side.

use super::figure::{Figure, Panel, Table};
use super::numbers::{STATISTICS, Statistics, by_l, correlation, curve};
use super::source::{Show, Source, panel};
use crate::error::Result;
use crate::io::{Manifest, Run};
use crate::kernels::healpix::Nside;
use crate::plot::{Axis, Chart, Spread};
use crate::sht::{Harmonics, ShtPlan, Spectra};
use crate::stages::emission::Stokes;
use crate::stages::regrid;

/// The sum of a run's templates.
fn total(run: &Run) -> Result<Stokes> {
    let npix = 12 * (run.manifest.nside as usize).pow(2);
    let mut total: Stokes = std::array::from_fn(|_| vec![0.0; npix]);
    for number in 1..=run.layers() {
        for (letter, total) in ["I", "Q", "U"].into_iter().zip(&mut total) {
            for (sum, x) in total
                .iter_mut()
                .zip(&run.map(&format!("templates/{letter}_{number}"))?.values)
            {
                *sum += x;
            }
        }
    }
    Ok(total)
}

/// Maps, spectra and correlation of the totals at 353 GHz, and what is different about the runs.
pub(super) fn figures(source: &mut Source<'_>, other: &Run) -> Result<[Figure; 2]> {
    let nside = Nside::new(u64::from(other.manifest.nside).min(source.nside.get()))?;
    let lmax = source.lmax.min(
        other
            .manifest
            .lmax
            .unwrap_or(2 * other.manifest.nside as usize),
    );
    let lmax = lmax.min(2 * nside.get() as usize);
    let theirs = total(other)?;
    let to_common = |maps: &Stokes, from: Nside| -> Result<Stokes> {
        let mut out: Stokes = std::array::from_fn(|_| Vec::new());
        for (out, map) in out.iter_mut().zip(maps) {
            *out = regrid::scalar(map, from, nside, source.level)?;
        }
        Ok(out)
    };
    let here = to_common(&source.total, source.nside)?;
    let there = to_common(&theirs, Nside::new(other.manifest.nside.into())?)?;
    let name = other.dir.display();
    let mut maps = Figure::new("against", "", "Against another run");
    maps.caption = format!(
        "The sum of the templates at 353 GHz of this run and of {name}, and the difference, on the grid of Nside {}.",
        nside.get()
    );
    maps.look = "With another seed alone, the large scales are the same and the difference is fine grain that follows the brightness of the dust.".into();
    let difference: Stokes =
        std::array::from_fn(|s| here[s].iter().zip(&there[s]).map(|(a, b)| a - b).collect());
    let mut rows = Vec::new();
    for (stokes, what, show) in [
        (&here, "this run", Show::Signed),
        (&there, "other run", Show::Signed),
        (&difference, "this − other", Show::Difference),
    ] {
        for (k, letter) in ["I", "Q", "U"].into_iter().enumerate() {
            let show = if k == 0 && show == Show::Signed {
                Show::Intensity
            } else {
                show
            };
            let title = format!("{letter}, {what}");
            rows.push((title.clone(), Statistics::of(&stokes[k]).row()));
            maps.panels.push(Panel::Map(panel(
                nside,
                &stokes[k],
                title,
                show,
                source.level,
            )?));
        }
    }
    maps.named_numbers("against", &STATISTICS, &rows);
    maps.tables
        .push(differences(&source.run.manifest, &other.manifest));

    let mut plan = ShtPlan::new(nside, lmax, source.level)?;
    let views = [&here, &there].map(|maps| maps.each_ref().map(Vec::as_slice));
    let alms = Harmonics::of_all(&mut plan, &views, None)?;
    let (a, b, ab): (Spectra, Spectra, Spectra) = (
        alms[0].spectra(lmax)?,
        alms[1].spectra(lmax)?,
        alms[0].cross(&alms[1], lmax)?,
    );
    let mut spectra = Figure::new(
        "against-spectra",
        "",
        "Against another run: spectra and correlation",
    );
    spectra.caption = format!(
        "Spectra of the two totals at 353 GHz, whole sky, and their correlation C_l/√(C_l C_l), on the grid of Nside {}.",
        nside.get()
    );
    spectra.look = "The same spectra; a correlation near one where the scales are observed and near zero where they are random and the seeds differ.".into();
    let kinds = [
        ("TT", &a.tt, &b.tt, &ab.tt),
        ("EE", &a.ee, &b.ee, &ab.ee),
        ("BB", &a.bb, &b.bb, &ab.bb),
    ];
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut correlations = Vec::new();
    for (colour, (kind, a, b, ab)) in kinds.into_iter().enumerate() {
        let r = correlation(ab, a, b);
        correlations.push(curve(&kind[..1], colour, &r, lmax));
        spectra.panels.push(Panel::Chart(Chart {
            title: kind.to_owned(),
            x: Axis::new("multipole l", Spread::Log),
            y: Axis::new("C_l ((MJy/sr)²)", Spread::Log),
            curves: vec![
                curve("this run", 0, a, lmax),
                curve("other run", 1, b, lmax),
            ],
            density: None,
        }));
        columns.extend([a.clone(), b.clone(), r]);
    }
    spectra.panels.push(Panel::Chart(Chart {
        title: "Correlation of the two runs".into(),
        x: Axis::new("multipole l", Spread::Log),
        y: Axis::new("correlation", Spread::Linear),
        curves: correlations,
        density: None,
    }));
    spectra.columns = 2;
    let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    spectra.numbers(
        "against-spectra",
        &[
            "l",
            "TT_this",
            "TT_other",
            "T_correlation",
            "EE_this",
            "EE_other",
            "E_correlation",
            "BB_this",
            "BB_other",
            "B_correlation",
        ],
        &by_l(&columns),
    );
    Ok([maps, spectra])
}

/// Keys of the configuration that differ, and the numbers of both runs.
fn differences(here: &Manifest, there: &Manifest) -> Table {
    let mut table = Table::new(&["", "this run", "other run"]);
    let flat = |manifest: &Manifest| {
        let mut list = Vec::new();
        if let Some(config) = &manifest.config {
            flatten(
                "",
                &serde_json::to_value(config).unwrap_or_default(),
                &mut list,
            );
        }
        list
    };
    let (ours, theirs) = (flat(here), flat(there));
    for (key, value) in &ours {
        let other = theirs
            .iter()
            .find(|(name, _)| name == key)
            .map_or("–", |(_, value)| value);
        if value != other {
            table
                .rows
                .push(vec![key.clone(), value.clone(), other.to_owned()]);
        }
    }
    let number = |m: &Manifest, get: fn(&Manifest) -> Option<f64>| get(m).unwrap_or(f64::NAN);
    type Get = fn(&Manifest) -> Option<f64>;
    let rows: [(&str, Get, usize); 8] = [
        ("pitch angle (degrees)", |m| m.pitch_deg, 2),
        ("s_avg", |m| m.laws.as_ref().map(|l| l.s_avg), 4),
        ("s_T", |m| m.laws.as_ref().map(|l| l.s_t), 4),
        ("s_β", |m| m.laws.as_ref().map(|l| l.s_beta), 4),
        (
            "mean T of the fit (K)",
            |m| m.mbb_fit_total.map(|f| f.t_mean),
            3,
        ),
        (
            "σ_T of the fit (K)",
            |m| m.mbb_fit_total.map(|f| f.t_std),
            3,
        ),
        (
            "mean β of the fit",
            |m| m.mbb_fit_total.map(|f| f.beta_mean),
            4,
        ),
        ("σ_β of the fit", |m| m.mbb_fit_total.map(|f| f.beta_std), 4),
    ];
    for (name, get, decimals) in rows {
        table.row(name, &[number(here, get), number(there, get)], decimals);
    }
    table
}

/// Every value of a tree with its dotted name.
fn flatten(name: &str, value: &serde_json::Value, list: &mut Vec<(String, String)>) {
    match value {
        serde_json::Value::Object(map) => {
            for (key, value) in map {
                let name = if name.is_empty() {
                    key.clone()
                } else {
                    format!("{name}.{key}")
                };
                flatten(&name, value, list);
            }
        }
        serde_json::Value::String(text) => list.push((name.to_owned(), text.clone())),
        value => list.push((name.to_owned(), value.to_string())),
    }
}
