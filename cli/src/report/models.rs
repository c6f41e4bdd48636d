//! How models agree with the observation and with each other, and one frequency with another.

use super::figure::{Check, Figure, Panel, Table, decimal};
use super::numbers::{by_l, correlation, curve, mean_over_l};
use super::sky::lacking_observations;
use super::source::{Source, views};
use crate::cut_sky::Mask;
use crate::cut_sky::pseudo::truncated;
use crate::error::Result;
use crate::kernels::healpix::Nside;
use crate::kernels::spectra::{beam, scale_by_l};
use crate::plot::{Axis, Chart, Curve, Spread};
use crate::sht::{Harmonics, ShtPlan, Spectra};
use crate::stages::emission::{Model, Stokes};

/// Beam to which maps are smoothed before models are compared, degrees.
const BEAM_DEG: f64 = 2.0;
/// Finest grid on which smoothed maps are compared: a beam of 2° needs no more.
const SMOOTH_NSIDE: u64 = 128;
/// The multipoles called low.
pub(super) const LOW_L: std::ops::RangeInclusive<usize> = 2..=30;
/// Least correlation with the observation in E and B at low l, per frequency: the paper's, with Planck's maps.
const LEAST: [(u32, f64); 2] = [(143, 0.96), (217, 0.99)];
/// The same on the built-in sky, whose T and β fluctuate more on small scales.
const LEAST_BUILT_IN: [(u32, f64); 2] = [(143, 0.94), (217, 0.97)];

/// Emission of the three models at 143 and 217 GHz.
pub(super) struct Emission {
    /// In the order of [`Model::ALL`], then of [`FREQUENCIES`].
    pub(super) maps: Vec<Vec<Stokes>>,
}

/// The frequencies at which models are compared.
pub(super) const FREQUENCIES: [u32; 2] = [143, 217];

impl Emission {
    pub(super) fn of(source: &Source<'_>) -> Result<Self> {
        let ghz = FREQUENCIES.map(f64::from);
        let maps = Model::ALL
            .into_iter()
            .map(|model| source.emission(model, &ghz))
            .collect::<Result<_>>()?;
        Ok(Self { maps })
    }

    /// The 3-D model at each frequency, the higher first as the paper has it.
    pub(super) fn three_d(&self) -> Vec<(u32, &Stokes)> {
        FREQUENCIES.into_iter().zip(&self.maps[0]).rev().collect()
    }
}

/// Skies smoothed to 2° and weighted by a mask, as a_lm on a coarser grid.
struct Smooth {
    plan: ShtPlan,
    mask: Mask,
}

impl Smooth {
    fn new(source: &mut Source<'_>) -> Result<Self> {
        let nside = Nside::new(source.nside.get().min(SMOOTH_NSIDE))?;
        let lmax = source.lmax.min(2 * nside.get() as usize);
        Ok(Self {
            plan: ShtPlan::new(nside, lmax, source.level)?,
            mask: source.correlation_mask(nside)?,
        })
    }

    fn harmonics(&mut self, source: &mut Source<'_>, stokes: &Stokes) -> Result<Harmonics> {
        let whole = Harmonics::of(&mut source.plan, views(stokes), None)?;
        let lmax = self.plan.lmax();
        let window: Vec<f64> = (0..=lmax).map(|l| beam(BEAM_DEG.to_radians(), l)).collect();
        let mut smooth =
            [&whole.t, &whole.e, &whole.b].map(|alm| truncated(alm, source.lmax, lmax));
        for alm in &mut smooth {
            scale_by_l(alm, &window)?;
        }
        let mut maps: Stokes = std::array::from_fn(|_| vec![0.0; self.plan.npix()]);
        let [t, e, b] = &smooth;
        let [i, q, u] = &mut maps;
        self.plan
            .synthesis_mixed(&[t], &[[e, b]], &mut [i], &mut [[q, u]])?;
        Harmonics::of(&mut self.plan, views(&maps), Some(&self.mask))
    }
}

/// T, E, B correlation per l of two skies.
fn correlations(a: &Harmonics, b: &Harmonics, lmax: usize) -> Result<[Vec<f64>; 3]> {
    let (aa, bb, ab): (Spectra, Spectra, Spectra) =
        (a.spectra(lmax)?, b.spectra(lmax)?, a.cross(b, lmax)?);
    Ok([
        correlation(&ab.tt, &aa.tt, &bb.tt),
        correlation(&ab.ee, &aa.ee, &bb.ee),
        correlation(&ab.bb, &aa.bb, &bb.bb),
    ])
}

/// A diagram of correlations. Its range is that of all but the lowest few per cent of the points: a single low multipole,
/// of few modes, would take all the room.
fn diagram(title: String, curves: Vec<Curve>) -> Panel {
    let mut values: Vec<f64> = curves
        .iter()
        .flat_map(|curve| curve.points.iter().map(|(_, r)| *r))
        .collect();
    values.sort_unstable_by(f64::total_cmp);
    let high = values.last().copied().unwrap_or(1.0);
    let low = values.get(values.len() / 25).copied().unwrap_or(0.0);
    let room = (high - low).max(1e-4);
    Panel::Chart(Chart {
        title,
        x: Axis::new("multipole l", Spread::Log),
        y: Axis::new("correlation", Spread::Linear).over(low - 0.15 * room, high + 0.05 * room),
        curves,
        density: None,
    })
}

/// Figures 17 and 18, and requirement ii.
pub(super) fn compare(
    source: &mut Source<'_>,
    emission: &Emission,
) -> Result<(Figure, Figure, Check)> {
    let mut smooth = Smooth::new(source)?;
    let lmax = smooth.plan.lmax();
    let sky = sky_in_words(source);
    let mut with = Figure::new(
        "models-observation",
        "Figure 17",
        "Correlation of the models with the observation",
    );
    with.caption = format!(
        "C_l between a model and what was observed at 143 and 217 GHz over the root of the product of their own, in T, E and B: maps smoothed to 2° and taken to Nside {}, {sky}. Three models: 3d (maps of T and β in each layer), 3d-uniform (one T and β per layer), 2d (the summed templates with the observed T and β).",
        smooth.plan.nside().get()
    );
    with.look = "Near one at low l; the 3-D model below the 2-D one, since its fluctuations of T and β are random, and all falling towards high l. Single low multipoles, of few modes, may lie below the diagrams.".into();
    let mut among = Figure::new(
        "models",
        "Figure 18",
        "Correlation of the models with each other",
    );
    among.caption = format!("As figure 17, between the models, {sky}.");
    among.look = "Differences of a few per cent at most for l ≤ 100 in polarisation.".into();

    let built_in = source.run.manifest.synthetic_inputs == Some(true);
    let bounds = if built_in { LEAST_BUILT_IN } else { LEAST };
    let demand = format!(
        "ii: polarisation at 143 and 217 GHz is that observed (correlation of E and B over 2 ≤ l ≤ 30 at least {} and {}{})",
        bounds[0].1,
        bounds[1].1,
        if built_in {
            "; the built-in sky decorrelates more than Planck's"
        } else {
            ""
        }
    );
    let (mut lowest, mut words, mut holds) = (Vec::new(), Vec::new(), true);
    let mut without = Vec::new();
    let mut table = Table::new(&["mean over 2 ≤ l ≤ 30", "T", "E", "B"]);
    let mut among_table = Table::new(&["mean over 2 ≤ l ≤ 100", "T", "E", "B"]);
    let (mut with_columns, mut among_columns) = (Vec::new(), Vec::new());
    let (mut with_names, mut among_names) = (vec!["l".to_owned()], vec!["l".to_owned()]);
    for (index, ghz) in FREQUENCIES.into_iter().enumerate() {
        let mut skies = Vec::new();
        for maps in &emission.maps {
            skies.push(smooth.harmonics(source, &maps[index])?);
        }
        let pairs = [(0, 1), (0, 2), (1, 2)];
        let mut curves: [Vec<Curve>; 3] = Default::default();
        for (colour, (a, b)) in pairs.into_iter().enumerate() {
            let name = format!("{} × {}", Model::ALL[a].name(), Model::ALL[b].name());
            let r = correlations(&skies[a], &skies[b], lmax)?;
            among_table.row(
                format!("{name}, {ghz} GHz"),
                &r.each_ref()
                    .map(|r| mean_over_l(r, |l| (2..=100).contains(&l))),
                4,
            );
            for (kind, (r, letter)) in r.into_iter().zip(["T", "E", "B"]).enumerate() {
                curves[kind].push(curve(&name, colour, &r, lmax));
                among_names.push(format!(
                    "{letter}_{}_{}_{ghz}",
                    Model::ALL[a].name(),
                    Model::ALL[b].name()
                ));
                among_columns.push(r);
            }
        }
        for (curves, letter) in curves.into_iter().zip(["T", "E", "B"]) {
            among
                .panels
                .push(diagram(format!("{letter}, {ghz} GHz"), curves));
        }

        let Some(observed) = source.observed_at(ghz)? else {
            without.push(ghz.to_string());
            continue;
        };
        let observed = smooth.harmonics(source, &observed)?;
        let mut curves: [Vec<Curve>; 3] = Default::default();
        for (colour, (model, sky)) in Model::ALL.into_iter().zip(&skies).enumerate() {
            let r = correlations(sky, &observed, lmax)?;
            let low = r.each_ref().map(|r| mean_over_l(r, |l| LOW_L.contains(&l)));
            table.row(format!("{}, {ghz} GHz", model.name()), &low, 4);
            if model == Model::ThreeD {
                let at = |list: [(u32, f64); 2]| {
                    list.into_iter()
                        .find(|(nu, _)| *nu == ghz)
                        .map_or(0.0, |(_, least)| least)
                };
                let (least, bound) = (at(LEAST), at(bounds));
                let ok = low[1] >= least && low[2] >= least;
                holds &= low[1] >= bound && low[2] >= bound;
                words.push(format!(
                    "{ghz} GHz: E {}, B {}",
                    decimal(low[1], 4),
                    decimal(low[2], 4)
                ));
                lowest.push((ghz, low));
                with.compare(
                    format!("E and B with the observation at {ghz} GHz, low l"),
                    format!("above {} %", 100.0 * least),
                    format!("E {} %, B {} %", decimal(100.0 * low[1], 2), decimal(100.0 * low[2], 2)),
                    Some(ok),
                    "the paper's observed maps are GNILC, which keeps what is correlated between channels; random T and β lower the correlation where they fluctuate more",
                );
            }
            for (kind, (r, letter)) in r.into_iter().zip(["T", "E", "B"]).enumerate() {
                curves[kind].push(curve(model.name(), colour, &r, lmax));
                with_names.push(format!("{letter}_{}_{ghz}", model.name()));
                with_columns.push(r);
            }
        }
        for (curves, letter) in curves.into_iter().zip(["T", "E", "B"]) {
            with.panels
                .push(diagram(format!("{letter}, {ghz} GHz"), curves));
        }
    }
    for (figure, names, columns, table) in [
        (&mut with, with_names, with_columns, table),
        (&mut among, among_names, among_columns, among_table),
    ] {
        if !columns.is_empty() {
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
            let file = figure.id;
            figure.numbers(file, &names, &by_l(&columns));
            figure.tables.push(table);
        }
    }
    if !without.is_empty() {
        with.lacking = lacking_observations(&without);
    }
    let check = if lowest.is_empty() {
        Check::not_available(
            "requirement_ii",
            demand,
            lacking_observations(&without),
            "models-observation",
        )
    } else {
        let mut check = Check::new(
            "requirement_ii",
            demand,
            holds,
            words.join("; "),
            "models-observation",
        );
        for (ghz, low) in lowest {
            check = check
                .with(&format!("E_{ghz}"), low[1])
                .with(&format!("B_{ghz}"), low[2]);
        }
        check
    };
    Ok((with, among, check))
}

fn sky_in_words(source: &Source<'_>) -> String {
    match source.options.mask {
        Some(_) => "with the mask given by --mask".to_owned(),
        None => format!(
            "on the faintest {} % of the sky, edges apodised over {}°",
            source.options.correlation_percent, source.options.apodise_deg
        ),
    }
}

/// Figures 20 and 21: correlation between frequencies of the 3-D model.
pub(super) fn between_frequencies(
    source: &mut Source<'_>,
    emission: &Emission,
) -> Result<[Figure; 2]> {
    let lmax = source.lmax;
    let mut main = Figure::new(
        "frequencies",
        "Figure 20",
        "Correlation between frequencies",
    );
    main.columns = 2;
    main.caption = format!(
        "C_l of the 3-D model between 143 or 217 GHz and 353 GHz, over the root of the product of their own, in E and B, {}; maps at the full resolution of the run.",
        sky_in_words(source)
    );
    main.look = "Close to 1 on large scales, falling by a few per cent towards small ones, further at 143 than at 217 GHz.".into();
    let mut fractions = Figure::new(
        "frequencies-fractions",
        "Figure 21",
        "Correlation between frequencies on other parts of the sky",
    );
    fractions.columns = 2;
    fractions.caption = "As figure 20, on the faintest parts of the sky and on the whole.".into();
    fractions.look =
        "The same correlation whatever the part of the sky, within a few per cent.".into();
    let mut skies: Vec<(String, Option<Mask>)> = vec![(
        match source.options.mask {
            Some(_) => "given mask".to_owned(),
            None => format!("{} %", source.options.correlation_percent),
        },
        Some(source.correlation_mask(source.nside)?),
    )];
    skies.push(("100 %".into(), None));
    for percent in source.options.fractions_percent.clone() {
        skies.push((
            format!("{percent} %"),
            Some(source.sky(percent, source.nside)?),
        ));
    }
    let maps: Vec<[Vec<f64>; 3]> = vec![
        emission.maps[0][0].clone(),
        emission.maps[0][1].clone(),
        source.total.clone(),
    ];
    let mut curves: [Vec<Curve>; 4] = Default::default();
    let mut table = Table::new(&["", "E 143×353", "B 143×353", "E 217×353", "B 217×353"]);
    let (mut names, mut columns) = (vec!["l".to_owned()], Vec::new());
    for (index, (name, mask)) in skies.iter().enumerate() {
        let all: Vec<[&[f64]; 3]> = maps.iter().map(views).collect();
        let alms = Harmonics::of_all(&mut source.plan, &all, mask.as_ref())?;
        let r = [
            correlations(&alms[0], &alms[2], lmax)?,
            correlations(&alms[1], &alms[2], lmax)?,
        ];
        let four = [&r[0][1], &r[0][2], &r[1][1], &r[1][2]];
        let mid = four.map(|r| mean_over_l(r, |l| (55..=90).contains(&l)));
        table.row(format!("{name} of the sky, mean over 55 ≤ l ≤ 90"), &mid, 4);
        if index == 0 {
            for (letter, k) in [("E", 1), ("B", 2)] {
                main.panels.push(diagram(
                    letter.to_owned(),
                    vec![
                        curve("143 × 353 GHz", 0, &r[0][k], lmax),
                        curve("217 × 353 GHz", 1, &r[1][k], lmax),
                    ],
                ));
            }
            let file = main.id;
            main.numbers(
                file,
                &["l", "E_143_353", "B_143_353", "E_217_353", "B_217_353"],
                &by_l(&four.map(Vec::as_slice)),
            );
            compare_with_paper(source, &mut main, &four, mid);
        }
        for (slot, r) in four.into_iter().enumerate() {
            curves[slot].push(curve(name, index, r, lmax));
            let kind = ["E_143_353", "B_143_353", "E_217_353", "B_217_353"][slot];
            names.push(format!(
                "{kind}_{}",
                name.replace(" %", "").replace(' ', "_")
            ));
            columns.push(r.clone());
        }
    }
    for (curves, title) in curves.into_iter().zip([
        "E, 143 × 353 GHz",
        "B, 143 × 353 GHz",
        "E, 217 × 353 GHz",
        "B, 217 × 353 GHz",
    ]) {
        fractions.panels.push(diagram(title.to_owned(), curves));
    }
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    let file = fractions.id;
    fractions.numbers(file, &names, &by_l(&columns));
    fractions.tables.push(table);
    Ok([main, fractions])
}

fn compare_with_paper(
    source: &Source<'_>,
    figure: &mut Figure,
    four: &[&Vec<f64>; 4],
    mid: [f64; 4],
) {
    let why = if source.run.manifest.synthetic_inputs == Some(true) {
        "the built-in sky has more small-scale structure in T and β than Planck's maps, so it decorrelates more"
    } else {
        "how fast T and β vary within and between layers decides; it depends on the factors that the calibration found"
    };
    // Bands of the curves, so that the scatter of single multipoles does not decide.
    let range = |r: &[f64]| {
        curve("", 0, r, source.lmax)
            .points
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, r)| {
                (low.min(*r), high.max(*r))
            })
    };
    for (name, pair) in [
        ("143 × 353 GHz", [four[0], four[1]]),
        ("217 × 353 GHz", [four[2], four[3]]),
    ] {
        let [e, b] = pair.map(|r| range(r));
        let (low, high) = (e.0.min(b.0), e.1.max(b.1));
        figure.compare(
            format!("correlation {name}, E and B, all l"),
            "97 % (small scales) to nearly 100 % (large scales)",
            format!(
                "{} % to {} %",
                decimal(100.0 * low, 2),
                decimal(100.0 * high, 2)
            ),
            Some(low >= 0.965),
            why,
        );
    }
    let lost = mid.map(|r| 100.0 * (1.0 - r));
    figure.compare(
        "decorrelation 143 × 353 GHz, 55 ≤ l ≤ 90",
        "1 to 2 %",
        format!("E {} %, B {} %", decimal(lost[0], 2), decimal(lost[1], 2)),
        Some(lost[..2].iter().all(|x| (0.5..=2.5).contains(x))),
        why,
    );
    figure.compare(
        "decorrelation 217 × 353 GHz, 55 ≤ l ≤ 90",
        "compatible with below 0.4 %",
        format!("E {} %, B {} %", decimal(lost[2], 2), decimal(lost[3], 2)),
        Some(lost[2..].iter().all(|x| *x <= 0.4)),
        why,
    );
}
