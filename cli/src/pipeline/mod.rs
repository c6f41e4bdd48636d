//! The whole pipeline: stages in order, their maps written as they are made and dropped when no longer needed.
//!
//! ```text
//! prepare   observations → fractions → intensities → pitch → field → renormalised layers     once
//! realise   small scales → templates → laws → calibration → emission, overview               per seed
//! ```
//!
//! What works pixel by pixel goes through the sky in slabs, and the layers' maps rest in a [`Store`] between stages, in
//! memory or on disk: at Nside 2048 a run needs less than 8 GB.

mod emission;
mod laws;
mod layers;
mod observed;
mod records;
mod templates;

use crate::Error;
use crate::config::{Config, Dtype, Keep};
use crate::io::manifest::FileRecord;
use crate::io::{Inputs, Manifest, RunDir};
use crate::progress::{Progress, Stopwatch};
use crate::sht::ShtPlan;
use crate::stages::intensity::LayerAverages;
use crate::stages::laws::ObservedLaws;
use crate::store::{MEMORY_PIXELS, Store, Stored};
use dust3d_kernels::healpix::Nside;
use dust3d_kernels::simd::Level;
use std::path::PathBuf;
use templates::Measured;

/// Runs the pipeline on the current thread pool: from `inputs` (checked; none: the built-in sky) to every file of a
/// run's directory but the manifest, which is returned for [`RunDir::finish`].
///
/// # Errors
/// An input that cannot be used, or a file that cannot be written; `out` is then to be dropped.
pub fn run(
    config: &Config,
    inputs: Option<Inputs>,
    out: &RunDir,
    level: Level,
    progress: &dyn Progress,
) -> Result<Manifest, Error> {
    let options = Options {
        level,
        ..Options::default()
    };
    let mut prepared = prepare(config, inputs, out, &options, progress)?;
    prepared.realise(config.seed, out, progress)
}

/// How a run is computed; no bit of a result depends on it.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Instructions to use.
    pub level: Level,
    /// Maps of more pixels are kept on disk between the stages.
    pub memory_pixels: usize,
    /// Whether several realisations will be made of what is prepared.
    pub reuse: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            level: Level::detect(),
            memory_pixels: MEMORY_PIXELS,
            reuse: false,
        }
    }
}

/// All that does not depend on the random draws: layers that add up to the observations.
pub struct Prepared {
    config: Config,
    nside: Nside,
    options: Options,
    plan: ShtPlan,
    store: Store,
    /// I, Q, U of the layers; those of a single run are taken away as they are used.
    layers: Vec<Option<[Stored; 3]>>,
    /// What small scales know of each layer, once measured.
    measured: Vec<Option<Measured>>,
    averages: LayerAverages,
    /// Observed T and β.
    t: Stored,
    beta: Stored,
    /// Their statistics, once measured.
    laws: Option<ObservedLaws>,
    /// The multipole up to which the observations carry signal.
    reach: usize,
    laws_nside: usize,
    /// Where the files so far are, and what they are.
    home: PathBuf,
    files: Vec<FileRecord>,
    manifest: Manifest,
}

/// Carries the stages that no random draw enters, and writes their maps to `out`.
///
/// # Errors
/// An input that cannot be used, or a file that cannot be written; `out` is then to be dropped.
pub fn prepare(
    config: &Config,
    inputs: Option<Inputs>,
    out: &RunDir,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Prepared, Error> {
    let watch = Stopwatch::new(progress);
    let nside = Nside::new(config.nside.into())?;
    let mut stage = Preparation {
        config,
        nside,
        level: options.level,
        plan: ShtPlan::new(nside, config.lmax(), options.level)?,
        store: Store::new(&out.path(""), options.memory_pixels),
        writer: Writer { config, out },
        progress: &watch,
        manifest: Manifest::of_run(config),
    };
    stage.manifest.simd = options.level.name().to_owned();

    let (observed, cube) = stage.observations(inputs)?;
    let (layers, averages) = stage.layers(&observed, &cube)?;

    let reach = observed.stokes_nside.min(nside.get()) as usize * 3 / 2;
    let laws_nside = observed.laws_nside as usize;
    let (t, beta) = (
        stage.store.keep(observed.t)?,
        stage.store.keep(observed.beta)?,
    );
    let Preparation {
        plan,
        store,
        mut manifest,
        ..
    } = stage;
    manifest.stages = watch.stages();
    Ok(Prepared {
        config: config.clone(),
        nside,
        options: *options,
        plan,
        store,
        measured: layers.iter().map(|_| None).collect(),
        layers: layers.into_iter().map(Some).collect(),
        averages,
        t,
        beta,
        laws: None,
        reach,
        laws_nside,
        home: out.target().to_owned(),
        files: out.records(),
        manifest,
    })
}

impl Prepared {
    /// Makes the realisation of a seed in `out`, where the files of the preparation are already, or are taken over from
    /// the finished run that has them. Returns the manifest for [`RunDir::finish`].
    ///
    /// # Errors
    /// A file that cannot be written; `out` is then to be dropped.
    pub fn realise(
        &mut self,
        seed: u64,
        out: &RunDir,
        progress: &dyn Progress,
    ) -> Result<Manifest, Error> {
        let watch = Stopwatch::new(progress);
        let mut config = self.config.clone();
        if config.inputs.is_built_in() && config.seed != seed {
            // So that this configuration alone makes the same run again.
            config.sky_seed.get_or_insert(config.seed);
        }
        config.seed = seed;
        let mut manifest = Manifest {
            seed: Some(seed),
            config: Some(config.clone()),
            ..self.manifest.clone()
        };
        if out.target() != self.home {
            out.adopt(&self.home, &self.files)?;
            manifest.stages.clear();
        }
        let mut stage = Realisation {
            config: &config,
            writer: Writer {
                config: &config,
                out,
            },
            progress: &watch,
            manifest,
            base: self,
        };
        let templates = stage.templates()?;
        let laws = stage.laws(&templates)?;
        stage.emission_and_overview(&templates, &laws)?;

        let mut manifest = stage.manifest;
        manifest.stages.extend(watch.stages());
        watch.finish();
        manifest.peak_memory_bytes = records::peak_memory_bytes();
        Ok(manifest)
    }
}

/// The stages of [`prepare`].
struct Preparation<'a> {
    config: &'a Config,
    nside: Nside,
    level: Level,
    plan: ShtPlan,
    store: Store,
    writer: Writer<'a>,
    progress: &'a dyn Progress,
    manifest: Manifest,
}

/// The stages of [`Prepared::realise`].
struct Realisation<'a> {
    config: &'a Config,
    writer: Writer<'a>,
    progress: &'a dyn Progress,
    manifest: Manifest,
    base: &'a mut Prepared,
}

/// Writes maps of the working grid.
#[derive(Clone, Copy)]
struct Writer<'a> {
    config: &'a Config,
    out: &'a RunDir,
}

impl<'a> Writer<'a> {
    fn keeps_all(&self) -> bool {
        self.config.output.keep == Keep::All
    }

    fn map(
        &self,
        stem: &str,
        quantity: &str,
        unit: &str,
        map: &[f64],
        dtype: Dtype,
    ) -> Result<(), Error> {
        self.out
            .map(stem, quantity, unit, self.config.nside, map, dtype)
    }

    /// Begins one intermediate map per layer, `stem`_1 … N; none if intermediates are not kept.
    fn layers(
        &self,
        stem: &str,
        quantity: &str,
        unit: &str,
    ) -> Result<Vec<crate::io::output::MapWriter<'a>>, Error> {
        let count = if self.keeps_all() {
            self.config.layer_count()
        } else {
            0
        };
        (1..=count)
            .map(|number| {
                self.out.begin_map(
                    &format!("{stem}_{number}"),
                    quantity,
                    unit,
                    self.config.nside,
                    Dtype::F64,
                )
            })
            .collect()
    }
}
