//! `manifest.json`: what a run is, how it was made, and every file in it.

use crate::config::Config;
use crate::error::{Error, Result};
use crate::progress::StageTime;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The name of the manifest in its directory.
pub const MANIFEST: &str = "manifest.json";

/// What is written beside the maps, last of all. What does not apply is null.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// `dust3d`.
    pub program: String,
    /// Version of the program.
    pub version: String,
    /// The command that made the directory: `run`, `emit`, `fit`, …
    pub command: String,
    /// When, RFC 3339.
    pub created: String,
    /// Every resolved value of the configuration; null where the command has none.
    pub config: Option<Config>,
    /// Seed of all random draws.
    pub seed: Option<u64>,
    /// Working resolution.
    pub nside: u32,
    /// Band limit.
    pub lmax: Option<usize>,
    /// Number of layers.
    pub layers: Option<usize>,
    /// Frequency of the templates.
    pub nu0_ghz: f64,
    /// `RING`.
    pub ordering: String,
    /// `GALACTIC`.
    pub coordinates: String,
    /// `COSMO`.
    pub polarisation: String,
    /// Vector instructions used: `portable`, `avx2`, `avx512`.
    pub simd: String,
    /// The observations.
    pub inputs: Vec<InputRecord>,
    /// Whether the observations were made by the program.
    pub synthetic_inputs: Option<bool>,
    /// Pitch angle of the spiral, fitted or given, degrees.
    pub pitch_deg: Option<f64>,
    /// Averages of the observed T and β in each layer.
    pub layer_averages: Option<LayerAverages>,
    /// One entry per layer; empty without small scales.
    pub small_scales: Vec<SmallScaleRecord>,
    /// Emission laws of the layers.
    pub laws: Option<LawsRecord>,
    /// Modified-blackbody fit of the simulated total.
    pub mbb_fit_total: Option<FitStatistics>,
    /// The same of the observations.
    pub mbb_fit_observed: Option<FitStatistics>,
    /// Pixels that needed special treatment.
    pub counts: Counts,
    /// Wall-clock time per stage.
    pub stages: Vec<StageTime>,
    /// Largest resident memory of the process, where the system tells.
    pub peak_memory_bytes: Option<u64>,
    /// Every other file of the directory.
    pub files: Vec<FileRecord>,
}

/// One observed map.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputRecord {
    /// `I_353`, … or `ebv_<modulus>`.
    pub name: String,
    /// The file; null if the program made the map.
    pub path: Option<String>,
    /// Resolution.
    pub nside: u32,
    /// Unit of the values.
    pub unit: String,
    /// BLAKE3 hash of the file.
    pub blake3: String,
}

/// Averages of the observed T and β, weighted by the fractions of each layer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LayerAverages {
    /// Temperature per layer, K.
    #[serde(rename = "T", with = "nan_list")]
    pub t: Vec<f64>,
    /// Spectral index per layer.
    #[serde(with = "nan_list")]
    pub beta: Vec<f64>,
}

/// Fits and factor of the small scales of one layer. Spectra are A (l/80)^α.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SmallScaleRecord {
    /// Slope of TT.
    #[serde(rename = "alpha_T", with = "nan")]
    pub alpha_t: f64,
    /// Amplitude of TT.
    #[serde(rename = "A_T", with = "nan")]
    pub a_t: f64,
    /// Amplitude of EE.
    #[serde(rename = "A_EE", with = "nan")]
    pub a_ee: f64,
    /// Amplitude of BB.
    #[serde(rename = "A_BB", with = "nan")]
    pub a_bb: f64,
    /// Strength of the log-normal fluctuations.
    #[serde(with = "nan")]
    pub kappa: f64,
    /// `root`, `enough` or `limit`.
    pub kappa_status: String,
}

/// Factors and statistics of the emission laws.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LawsRecord {
    /// Factor on the mean temperatures.
    #[serde(with = "nan")]
    pub s_avg: f64,
    /// Factor on the temperature fluctuations.
    #[serde(rename = "s_T", with = "nan")]
    pub s_t: f64,
    /// Factor on the index fluctuations.
    #[serde(with = "nan")]
    pub s_beta: f64,
    /// `solved`, `limit` or `given`.
    pub calibration_status: String,
    /// Mean temperature per layer, K.
    #[serde(rename = "T_mean", with = "nan_list")]
    pub t_mean: Vec<f64>,
    /// Its standard deviation.
    #[serde(rename = "T_std", with = "nan_list")]
    pub t_std: Vec<f64>,
    /// Mean spectral index per layer.
    #[serde(with = "nan_list")]
    pub beta_mean: Vec<f64>,
    /// Its standard deviation.
    #[serde(with = "nan_list")]
    pub beta_std: Vec<f64>,
}

/// Statistics of a modified-blackbody fit over the fitted pixels, unweighted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FitStatistics {
    /// Mean temperature, K.
    #[serde(rename = "T_mean", with = "nan")]
    pub t_mean: f64,
    /// Its standard deviation.
    #[serde(rename = "T_std", with = "nan")]
    pub t_std: f64,
    /// Mean spectral index.
    #[serde(with = "nan")]
    pub beta_mean: f64,
    /// Its standard deviation.
    #[serde(with = "nan")]
    pub beta_std: f64,
}

/// Pixels that needed special treatment; all on the working grid but those of the cube.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Counts {
    /// Pixels of the cube with any edge missing.
    pub missing_cube_pixels: u64,
    /// Pixels where an intensity layer came out negative.
    pub negative_intensity: u64,
    /// Pixels where a layer exceeded its cap, those below apart.
    pub capped_pixels: u64,
    /// Pixels where the observation itself exceeds the cap.
    pub infeasible_pixels: u64,
    /// Pixels where the fit of the total did not converge.
    pub unconverged_fits: u64,
    /// Values of T and β raised to their floors, over all layers.
    pub floored_laws: u64,
    /// Pixels scaled down to |(Q, U)| = I, over all layers.
    pub limited_pixels: u64,
}

/// One file of the directory.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileRecord {
    /// Relative to the directory, with `/`.
    pub path: String,
    /// What it holds.
    pub quantity: String,
    /// Unit of the values; null where there is none, as in a table.
    pub unit: Option<String>,
    /// Resolution; null for what is not a map.
    pub nside: Option<u32>,
    /// `f32`, `f64`, `c128`; null for what is not an array.
    pub dtype: Option<String>,
    /// BLAKE3 hash of the file.
    pub blake3: String,
}

impl Manifest {
    /// The manifest of a directory made by `command`, now, with nothing else filled in.
    #[must_use]
    pub fn new(command: &str, nside: u32) -> Self {
        Self {
            program: "dust3d".to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            command: command.to_owned(),
            created: jiff::Timestamp::now().to_string(),
            config: None,
            seed: None,
            nside,
            lmax: None,
            layers: None,
            nu0_ghz: 353.0,
            ordering: "RING".to_owned(),
            coordinates: "GALACTIC".to_owned(),
            polarisation: "COSMO".to_owned(),
            simd: String::new(),
            inputs: Vec::new(),
            synthetic_inputs: None,
            pitch_deg: None,
            layer_averages: None,
            small_scales: Vec::new(),
            laws: None,
            mbb_fit_total: None,
            mbb_fit_observed: None,
            counts: Counts::default(),
            stages: Vec::new(),
            peak_memory_bytes: None,
            files: Vec::new(),
        }
    }

    /// The manifest of a run of `config`, which must be resolved.
    #[must_use]
    pub fn of_run(config: &Config) -> Self {
        Self {
            seed: Some(config.seed),
            lmax: Some(config.lmax()),
            layers: Some(config.layer_count()),
            synthetic_inputs: Some(config.inputs.is_built_in()),
            config: Some(config.clone()),
            ..Self::new("run", config.nside)
        }
    }

    /// Reads the manifest of a finished directory.
    ///
    /// # Errors
    /// No manifest, so that the directory is no finished run; or one that is not this program's.
    pub fn read(dir: &Path) -> Result<Self> {
        let path = dir.join(MANIFEST);
        let text = std::fs::read(&path).map_err(|cause| match cause.kind() {
            std::io::ErrorKind::NotFound => Error::usage(format!(
                "`{}` is not a finished run: it has no {MANIFEST}; give the directory that `dust3d run --out` made",
                dir.display()
            )),
            _ => Error::io("read the manifest", &path, &cause),
        })?;
        serde_json::from_slice(&text).map_err(|cause| {
            Error::input(format!(
                "`{}` is not a manifest of this program: {cause}; make the run again with this version",
                path.display()
            ))
        })
    }

    pub(super) fn to_json(&self) -> Vec<u8> {
        // The structs hold nothing that could fail to serialise.
        let mut text = serde_json::to_vec_pretty(self).unwrap_or_default();
        text.push(b'\n');
        text
    }
}

/// NaN as null.
mod nan {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[expect(
        clippy::trivially_copy_pass_by_ref,
        reason = "the signature serde asks for"
    )]
    pub(super) fn serialize<S: Serializer>(value: &f64, output: S) -> Result<S::Ok, S::Error> {
        value.serialize(output)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(input: D) -> Result<f64, D::Error> {
        Ok(Option::deserialize(input)?.unwrap_or(f64::NAN))
    }
}

/// NaN as null, in lists.
mod nan_list {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(super) fn serialize<S: Serializer>(list: &[f64], output: S) -> Result<S::Ok, S::Error> {
        list.serialize(output)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(input: D) -> Result<Vec<f64>, D::Error> {
        let list = Vec::<Option<f64>>::deserialize(input)?;
        Ok(list
            .into_iter()
            .map(|value| value.unwrap_or(f64::NAN))
            .collect())
    }
}
