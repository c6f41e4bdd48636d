//! The report of a finished run: what one looks at before trusting a realisation.
//!
//! Every figure and table of \[MKD18\] in the paper's order, from the run's files alone, each with the numbers behind it;
//! and a verdict on the requirements of the paper and the invariants of the model.
//!
//! Data flow one way: `source` (the run's maps and what many figures share) → one module per family of figures (maps to
//! numbers, numbers to panels) → `render` (panels to SVG and PNG) → `page` (HTML).
//!
//! | module | \[MKD18\] |
//! | --- | --- |
//! | `layers` | figures 1, 2, 4, 5, 6, 8 |
//! | `field` | the pitch angle, figure 9 |
//! | `sky` | figures 3, 7, 12, 13, 16 |
//! | `spectra` | figures 10, 11, 14, and decoupled spectra |
//! | `laws` | figure 15, table 1 with the fit of the total |
//! | `models` | figures 17, 18, 20, 21 |
//! | `emission_law` | figure 19 |
//! | `invariants` | – |
//! | `against` | – : two runs side by side |

mod against;
mod emission_law;
mod field;
mod figure;
mod invariants;
mod laws;
mod layers;
mod models;
mod numbers;
mod page;
mod render;
mod sky;
mod source;
mod spectra;

pub use figure::{Check, Comparison, Status};
pub use source::Options;

use crate::error::Result;
use crate::io::{Run, RunDir};
use crate::kernels::simd::Level;
use crate::progress::Progress;
use figure::Figure;
use serde::Serialize;
use source::Source;

/// What a report says to programs: `summary.json`.
#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    /// `dust3d`.
    pub program: &'static str,
    /// Version of the program that made the report.
    pub version: &'static str,
    /// The run's directory as it was given.
    pub run: String,
    /// The run's resolution.
    pub nside: u32,
    /// Its band limit.
    pub lmax: Option<usize>,
    /// Its seed.
    pub seed: Option<u64>,
    /// `fail` if any check fails, else `pass`.
    pub verdict: Status,
    /// The requirements and invariants.
    pub checks: Vec<Check>,
    /// The paper's values beside the run's.
    pub comparisons: Vec<Listed>,
    /// The figures and their files.
    pub figures: Vec<FigureRecord>,
}

/// A comparison and the figure where it stands.
#[derive(Debug, Clone, Serialize)]
pub struct Listed {
    /// Name of the figure.
    pub figure: &'static str,
    /// The comparison.
    #[serde(flatten)]
    pub comparison: Comparison,
}

/// A figure in [`Summary`].
#[derive(Debug, Clone, Serialize)]
pub struct FigureRecord {
    /// Its name, and its place in the page.
    pub id: &'static str,
    /// As the paper calls it.
    pub paper: &'static str,
    /// Its heading.
    pub title: String,
    /// Its files.
    pub files: Vec<String>,
    /// What the run lacks for it; empty if nothing.
    pub lacking: String,
}

/// Makes the report of `run` in `out`, all but its manifest; with `against`, sets another run beside it.
///
/// # Errors
/// A file of the run that is not there or has changed; a file that cannot be written.
pub fn write(
    run: &Run,
    against: Option<&Run>,
    options: &Options,
    out: &RunDir,
    level: Level,
    progress: &dyn Progress,
) -> Result<Summary> {
    progress.stage("reading the run", 1);
    let mut source = Source::new(run, options, level)?;
    let mut book = Book {
        out,
        sections: String::new(),
        entries: Vec::new(),
        figures: Vec::new(),
        comparisons: Vec::new(),
    };

    progress.stage("layers", 6);
    book.add(layers::shells(&source)?)?;
    book.add(layers::optical_depth(&source)?)?;
    book.add(sky::observed(&mut source)?)?;
    book.add(layers::predicted(&source)?)?;
    book.add(field::pitch(&source)?)?;
    book.add(layers::renormalised(&source)?)?;
    book.add(layers::templates(&source)?)?;
    book.add(sky::totals(&source)?)?;
    book.add(layers::polarised_intensity(&source)?)?;
    book.add(field::fractions(&source)?)?;

    progress.stage("spectra", 1);
    let (figure, te) = spectra::layers(&mut source)?;
    book.add(figure)?;
    book.add(spectra::total(&source)?)?;
    if let Some(width) = options.master_band {
        book.add(spectra::decoupled(&mut source, width)?)?;
    }
    let [modes, detail] = sky::modes_and_detail(&mut source)?;
    book.add(modes)?;
    book.add(detail)?;
    let emission = models::Emission::of(&source)?;
    book.add(spectra::other_frequencies(
        &mut source,
        &emission.three_d(),
    )?)?;

    progress.stage("emission laws", 1);
    book.add(laws::first_layer(&mut source)?)?;
    book.add(laws::averages(&source)?)?;
    let (figure, iii) = laws::fit(&mut source)?;
    book.add(figure)?;
    book.add(sky::other_frequencies(&source, &emission.three_d())?)?;

    progress.stage("models", 1);
    let (with, among, ii) = models::compare(&mut source, &emission)?;
    book.add(with)?;
    book.add(among)?;
    let between = models::between_frequencies(&mut source, &emission)?;
    drop(emission);
    let (figure, i) = emission_law::law(&source)?;
    book.add(figure)?;
    for figure in between {
        book.add(figure)?;
    }
    if let Some(other) = against {
        progress.stage("comparison of runs", 1);
        for figure in against::figures(&mut source, other)? {
            book.add(figure)?;
        }
    }

    progress.stage("verdict and page", 1);
    let mut checks = vec![i, ii, iii];
    checks.extend(invariants::checks(&source)?);
    checks.push(te);
    let verdict = if checks.iter().any(|check| check.status == Status::Fail) {
        Status::Fail
    } else {
        Status::Pass
    };
    for (stem, nside, mask) in source.masks() {
        out.map(
            &stem,
            "weights of a part of the sky",
            "",
            nside,
            &mask.weight,
            crate::config::Dtype::F64,
        )?;
    }
    let name = run.dir.display().to_string();
    let page = page::page(
        &run.manifest,
        &name,
        &checks,
        &book.comparisons,
        &book.entries,
        &book.sections,
    );
    out.file("index.html", "the report", page.as_bytes())?;
    let summary = Summary {
        program: "dust3d",
        version: env!("CARGO_PKG_VERSION"),
        run: name,
        nside: run.manifest.nside,
        lmax: run.manifest.lmax,
        seed: run.manifest.seed,
        verdict,
        checks,
        comparisons: book.comparisons,
        figures: book.figures,
    };
    // The structs hold nothing that could fail to serialise.
    let mut json = serde_json::to_vec_pretty(&summary).unwrap_or_default();
    json.push(b'\n');
    out.file("summary.json", "verdict and numbers for programs", &json)?;
    Ok(summary)
}

/// How the checks ended, in one sentence.
#[must_use]
pub fn outcome(summary: &Summary) -> String {
    page::outcome(&summary.checks)
}

/// The report in the making: figures are written and rendered one by one, and dropped.
struct Book<'a> {
    out: &'a RunDir,
    sections: String,
    entries: Vec<page::Entry>,
    figures: Vec<FigureRecord>,
    comparisons: Vec<Listed>,
}

impl Book<'_> {
    fn add(&mut self, figure: Figure) -> Result<()> {
        let mut files = Vec::new();
        if !figure.panels.is_empty() {
            let name = format!("{}.png", figure.id);
            self.out
                .file(&name, &figure.title, &render::png(&figure)?)?;
            files.push(name);
        }
        for (stem, text) in &figure.csv {
            let name = format!("{stem}.csv");
            self.out.file(&name, &figure.title, text.as_bytes())?;
            files.push(name);
        }
        self.sections.push_str(&render::section(&figure, &files)?);
        self.entries.push(page::Entry {
            id: figure.id,
            paper: figure.paper,
            title: figure.title.clone(),
            lacking: !figure.lacking.is_empty(),
        });
        self.comparisons
            .extend(figure.comparisons.into_iter().map(|comparison| Listed {
                figure: figure.id,
                comparison,
            }));
        self.figures.push(FigureRecord {
            id: figure.id,
            paper: figure.paper,
            title: figure.title,
            files,
            lacking: figure.lacking,
        });
        Ok(())
    }
}
