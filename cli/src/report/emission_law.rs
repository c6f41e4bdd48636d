//! The mean emission law of the 3-D model against the 2-D one, and requirement i.

use super::figure::{Check, Figure, Panel, Table, decimal};
use super::numbers::Statistics;
use super::source::Source;
use crate::error::Result;
use crate::kernels::healpix::missing::is_missing;
use crate::plot::{Axis, Chart, Curve, Spread, Style};
use crate::stages::emission::{Law, Layer, Model, Stokes, layers_into, monochromatic};
use crate::stages::laws::sky::mean_std;

/// Frequencies of the law, GHz: those of Planck and IRAS, and others between.
const FREQUENCIES: [f64; 20] = [
    20.0, 30.0, 44.0, 70.0, 85.0, 100.0, 120.0, 143.0, 180.0, 217.0, 280.0, 353.0, 450.0, 545.0,
    700.0, 857.0, 1200.0, 1700.0, 2300.0, 2997.92458,
];
/// Bytes of maps held at once.
const PASS_BYTES: usize = 1 << 29;
/// Where the intensity is compared with the observed one, and its name in files.
const COMPARED: [(f64, &str); 5] = [
    (143.0, "143"),
    (217.0, "217"),
    (545.0, "545"),
    (857.0, "857"),
    (2997.92458, "2998"),
];
/// Largest deviation of the median pixel, and of the mean over the sky at Planck's frequencies.
const MEDIAN: f64 = 0.05;
const MEAN: f64 = 0.10;

/// Means over the sky of I and P at a frequency.
fn means([i, q, u]: &Stokes) -> [f64; 2] {
    let n = i.len() as f64;
    let p: f64 = q.iter().zip(u).map(|(q, u)| q.hypot(*u)).sum();
    [i.iter().sum::<f64>() / n, p / n]
}

/// Figure 19, and requirement i.
pub(super) fn law(source: &Source<'_>) -> Result<(Figure, Check)> {
    let mut figure = Figure::new(
        "emission-law",
        "Figure 19",
        "Mean emission law of the 3-D and 2-D models",
    );
    figure.columns = 2;
    figure.caption = "Mean over the whole sky of intensity I and of polarised intensity P = √(Q² + U²) from 20 GHz to 100 µm, of the model with six layers and of the one with the observed T and β in every pixel; and their ratio. Both are the same at 353 GHz.".into();
    figure.look = "The ratio above 1 at low frequency: where layers of unlike β add up, the flattest one wins there. The same in intensity and polarisation.".into();
    let npix = source.plan.npix();
    let per_pass = (PASS_BYTES / (3 * npix * size_of::<f64>())).max(1);
    let mut laws: [Vec<[f64; 2]>; 2] = Default::default();
    let mut compared = Vec::new();
    for (law, model) in laws.iter_mut().zip([Model::ThreeD, Model::TwoD]) {
        for ghz in FREQUENCIES.chunks(per_pass) {
            let maps = source.emission(model, ghz)?;
            law.extend(maps.iter().map(means));
            if model == Model::ThreeD {
                for (nu, map) in ghz.iter().zip(&maps) {
                    compared.extend(Compared::of(source, *nu, &map[0])?);
                }
            }
        }
    }
    let rows: Vec<Vec<f64>> = FREQUENCIES
        .iter()
        .enumerate()
        .map(|(k, nu)| {
            let (a, b) = (laws[0][k], laws[1][k]);
            vec![*nu, a[0], b[0], a[0] / b[0], a[1], b[1], a[1] / b[1]]
        })
        .collect();
    let series = |column: usize| -> Vec<(f64, f64)> {
        rows.iter().map(|row| (row[0], row[column])).collect()
    };
    figure.panels.push(Panel::Chart(Chart {
        title: "Mean emission".into(),
        x: Axis::new("frequency (GHz)", Spread::Log),
        y: Axis::new("mean over the sky (MJy/sr)", Spread::Log),
        curves: vec![
            Curve::new("I, 3d", 0, series(1)),
            Curve::new("I, 2d", 1, series(2)).styled(Style::Dashed),
            Curve::new("P, 3d", 2, series(4)),
            Curve::new("P, 2d", 3, series(5)).styled(Style::Dashed),
        ],
        density: None,
    }));
    figure.panels.push(Panel::Chart(Chart {
        title: "3-D model over 2-D model".into(),
        x: Axis::new("frequency (GHz)", Spread::Log),
        y: Axis::new("ratio of the means", Spread::Linear),
        curves: vec![
            Curve::new("intensity", 0, series(3)),
            Curve::new("polarised intensity", 2, series(6)),
        ],
        density: None,
    }));
    figure.numbers(
        "emission-law",
        &["GHz", "I_3d", "I_2d", "I_ratio", "P_3d", "P_2d", "P_ratio"],
        &rows,
    );
    let mut table = Table::new(&["GHz", "I 3d / 2d", "P 3d / 2d"]);
    for row in rows
        .iter()
        .filter(|row| [30.0, 70.0, 100.0, 143.0, 217.0, 353.0, 545.0, 857.0].contains(&row[0]))
    {
        table.row(format!("{}", row[0]), &[row[3], row[6]], 4);
    }
    figure.tables.push(table);
    let low = &rows[1];
    figure.compare(
        "3-D over 2-D emission at 30 GHz, I and P",
        "above 1 (flatter law at low frequency)",
        format!("I {}, P {}", decimal(low[3], 3), decimal(low[6], 3)),
        Some(low[3] > 1.0 && low[6] > 1.0),
        "the spread of β along the line of sight decides; the 2-D model has the T and β of a fit at 353 GHz and above, so that this is extrapolation",
    );
    let check = requirement_i(&mut figure, &compared);
    Ok((figure, check))
}

/// Intensity of the model and of the observation at a frequency.
struct Compared {
    nu: f64,
    name: &'static str,
    /// Means over the sky, MJy/sr.
    model: f64,
    observed: f64,
    /// Median over the pixels of the ratio.
    median: f64,
    /// What stands for the observation.
    how: &'static str,
}

impl Compared {
    /// At one of the compared frequencies. Where a run was given no such map, the observed intensity at 353 GHz with the T
    /// and β fitted to the observations stands for it at the frequencies which that fit is made at.
    fn of(source: &Source<'_>, nu: f64, model: &[f64]) -> Result<Option<Self>> {
        let Some((_, name)) = COMPARED.into_iter().find(|(compared, _)| *compared == nu) else {
            return Ok(None);
        };
        let stem = format!("observations/I_{name}");
        let (observed, how) = if source.run.holds(&stem) {
            (source.map(&stem)?, "map")
        } else if nu > 353.0 {
            (by_fit(source, nu)?, "fit of T, β")
        } else {
            return Ok(None);
        };
        if observed.iter().any(|x| is_missing(*x)) {
            return Ok(None);
        }
        let ratios: Vec<f64> = model
            .iter()
            .zip(&observed)
            .filter(|(_, o)| **o > 0.0)
            .map(|(m, o)| m / o)
            .collect();
        Ok(Some(Self {
            nu,
            name,
            model: mean_std(model).0,
            observed: mean_std(&observed).0,
            median: Statistics::of(&ratios).median,
            how,
        }))
    }
}

/// The model's intensity over that observed: of the median pixel, and in the mean over the sky, which the brightest pixels
/// of the plane decide.
fn requirement_i(figure: &mut Figure, compared: &[Compared]) -> Check {
    let mut table = Table::new(&[
        "GHz",
        "mean, model (MJy/sr)",
        "mean, observed (MJy/sr)",
        "ratio of means",
        "median ratio",
        "observed as",
    ]);
    let (mut words, mut rows, mut holds) = (Vec::new(), Vec::new(), true);
    let mut values = serde_json::Map::new();
    for Compared {
        nu,
        name,
        model,
        observed,
        median,
        how,
    } in compared
    {
        let ratio = model / observed;
        holds &= (median - 1.0).abs() <= MEDIAN && (*nu > 1000.0 || (ratio - 1.0).abs() <= MEAN);
        table.row(format!("{nu:.0}"), &[*model, *observed, ratio, *median], 4);
        if let Some(row) = table.rows.last_mut() {
            row.push((*how).to_owned());
        }
        rows.push(vec![*nu, *model, *observed, ratio, *median]);
        words.push(format!(
            "{nu:.0} GHz {} and {}",
            decimal(*median, 3),
            decimal(ratio, 3)
        ));
        values.insert(format!("median_{name}"), (*median).into());
        values.insert(format!("ratio_{name}"), ratio.into());
    }
    figure.tables.push(table);
    figure.numbers(
        "requirement-i",
        &["GHz", "model", "observed", "ratio", "median_ratio"],
        &rows,
    );
    let mut check = Check::new(
        "requirement_i",
        "i: the intensity at other frequencies is the observed one (the median pixel within 5 %, the mean over the sky within 10 % up to 857 GHz)",
        holds,
        format!(
            "model over observed, median pixel and mean: {}. At 100 µm the mean is that of the warmest bright pixels of the plane, which random temperatures do not know, so nothing is demanded of it",
            words.join("; ")
        ),
        "emission-law",
    );
    check.values = values;
    check
}

/// The observed intensity at 353 GHz taken to a frequency by the observed T and β.
fn by_fit(source: &Source<'_>, nu: f64) -> Result<Vec<f64>> {
    let (mut t, mut beta) = (
        source.map("observations/T")?,
        source.map("observations/beta")?,
    );
    for map in [&mut t, &mut beta] {
        let (mean, _) = mean_std(map);
        for value in map.iter_mut().filter(|x| is_missing(**x)) {
            *value = mean;
        }
    }
    let stokes = source.observed.each_ref().map(Vec::as_slice);
    let mut out = [Stokes::default()];
    let law = Law::Maps { t: &t, beta: &beta };
    layers_into(
        source.level,
        &[monochromatic(nu)?],
        &[Layer { stokes, law }],
        source.plan.npix(),
        &mut out,
    )?;
    let [[i, _, _]] = out;
    Ok(i)
}
