//! Every key of the configuration, as plain structs with the defaults of the model.

use super::frequency::{frequencies_from, seed_from};
use serde::{Deserialize, Serialize};

/// The configuration of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Config {
    /// Working resolution, a power of two.
    pub nside: u32,
    /// Band limit of every transform; `None` = 2 Nside. At most 4 Nside.
    pub lmax: Option<usize>,
    /// The one seed of all random draws.
    #[serde(deserialize_with = "seed_from")]
    pub seed: u64,
    /// Seed of the built-in sky; `None` = `seed`.
    pub sky_seed: Option<u64>,
    /// Frequencies of the emission maps, GHz; `"100um"` in TOML stands for 2997.92458.
    #[serde(deserialize_with = "frequencies_from")]
    pub frequencies: Vec<f64>,
    /// Threads; 0 = all cores. No result depends on it.
    pub threads: usize,
    /// The observations; none given = the built-in sky.
    pub inputs: Inputs,
    /// How the reddening cube is read.
    pub cube: Cube,
    /// The layers along the line of sight.
    pub layers: Layers,
    /// Magnetic field, dust density, and the fit of the pitch angle.
    pub field: FieldConfig,
    /// Bound on the polarisation fraction.
    pub polarisation: Polarisation,
    /// Random small scales.
    pub small_scales: SmallScales,
    /// Random temperature and spectral-index maps of the layers.
    pub laws: Laws,
    /// The modified-blackbody fit.
    pub fit: Fit,
    /// What is written, and how.
    pub output: Output,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            nside: 64,
            lmax: None,
            seed: 1,
            sky_seed: None,
            frequencies: vec![143.0, 217.0, 353.0],
            threads: 0,
            inputs: Inputs::default(),
            cube: Cube::default(),
            layers: Layers::default(),
            field: FieldConfig::default(),
            polarisation: Polarisation::default(),
            small_scales: SmallScales::default(),
            laws: Laws::default(),
            fit: Fit::default(),
            output: Output::default(),
        }
    }
}

/// The observations: paths of maps, relative to the configuration file. Intensities are in MJy/sr.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Inputs {
    /// Intensity at 353 GHz.
    #[serde(rename = "I_353")]
    pub i_353: Option<String>,
    /// Stokes Q at 353 GHz.
    #[serde(rename = "Q_353")]
    pub q_353: Option<String>,
    /// Stokes U at 353 GHz.
    #[serde(rename = "U_353")]
    pub u_353: Option<String>,
    /// Optical depth at 353 GHz.
    pub tau: Option<String>,
    /// Dust temperature, K.
    #[serde(rename = "T")]
    pub t: Option<String>,
    /// Dust spectral index.
    pub beta: Option<String>,
    /// Intensity at 545 GHz.
    #[serde(rename = "I_545")]
    pub i_545: Option<String>,
    /// Intensity at 857 GHz.
    #[serde(rename = "I_857")]
    pub i_857: Option<String>,
    /// Intensity at 100 µm (2997.92 GHz).
    #[serde(rename = "I_2998")]
    pub i_2998: Option<String>,
    /// Intensity at 217 GHz, for validation.
    #[serde(rename = "I_217")]
    pub i_217: Option<String>,
    /// Stokes Q at 217 GHz, for validation.
    #[serde(rename = "Q_217")]
    pub q_217: Option<String>,
    /// Stokes U at 217 GHz, for validation.
    #[serde(rename = "U_217")]
    pub u_217: Option<String>,
    /// Intensity at 143 GHz, for validation.
    #[serde(rename = "I_143")]
    pub i_143: Option<String>,
    /// Stokes Q at 143 GHz, for validation.
    #[serde(rename = "Q_143")]
    pub q_143: Option<String>,
    /// Stokes U at 143 GHz, for validation.
    #[serde(rename = "U_143")]
    pub u_143: Option<String>,
    /// Cumulative reddening; `{modulus}` in the path runs over 04.0, 04.5 … 19.0.
    pub cube: Option<String>,
    /// Factor on I, Q, U at 353 GHz, from band-integrated to monochromatic.
    pub color_correction: f64,
}

impl Default for Inputs {
    fn default() -> Self {
        Self {
            i_353: None,
            q_353: None,
            u_353: None,
            tau: None,
            t: None,
            beta: None,
            i_545: None,
            i_857: None,
            i_2998: None,
            i_217: None,
            q_217: None,
            u_217: None,
            i_143: None,
            q_143: None,
            u_143: None,
            cube: None,
            color_correction: 1.0,
        }
    }
}

impl Inputs {
    /// Every map that is given, by the name of its key, the cube apart.
    pub fn maps(&self) -> impl Iterator<Item = (&'static str, &str)> {
        [
            ("I_353", &self.i_353),
            ("Q_353", &self.q_353),
            ("U_353", &self.u_353),
            ("tau", &self.tau),
            ("T", &self.t),
            ("beta", &self.beta),
            ("I_545", &self.i_545),
            ("I_857", &self.i_857),
            ("I_2998", &self.i_2998),
            ("I_217", &self.i_217),
            ("Q_217", &self.q_217),
            ("U_217", &self.u_217),
            ("I_143", &self.i_143),
            ("Q_143", &self.q_143),
            ("U_143", &self.u_143),
        ]
        .into_iter()
        .filter_map(|(name, path)| path.as_deref().map(|path| (name, path)))
    }

    /// Whether no file is given at all, so that the built-in sky is used.
    #[must_use]
    pub fn is_built_in(&self) -> bool {
        self.cube.is_none() && self.maps().next().is_none()
    }
}

/// How the reddening cube is read.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Cube {
    /// What to do where the cumulative reddening decreases with distance.
    pub monotone: Monotone,
}

/// What to do where the cumulative reddening decreases with distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Monotone {
    /// Stop with an error.
    #[default]
    Error,
    /// Take the running maximum.
    Clip,
}

/// The layers along the line of sight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Layers {
    /// Outer edges as distance moduli, increasing; layer 1 begins at the Sun.
    pub edges: Vec<f64>,
    /// First radius of the discs that fill unobserved pixels, degrees.
    pub fill_radius_deg: f64,
}

impl Default for Layers {
    fn default() -> Self {
        Self {
            edges: vec![4.0, 7.0, 10.0, 13.0, 16.0, 19.0],
            fill_radius_deg: 2.0,
        }
    }
}

/// Magnetic field, dust density, and the fit of the pitch angle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct FieldConfig {
    /// Pitch angle, degrees; given = no fit.
    pub pitch_deg: Option<f64>,
    /// Range of the scan, degrees.
    pub pitch_range_deg: [f64; 2],
    /// Latitude from which pixels take part in the fit, degrees.
    pub min_latitude_deg: f64,
    /// Resolution of the fit, a power of two (at most the working one is used).
    pub fit_nside: u32,
    /// Intrinsic polarisation fraction.
    pub p0: f64,
    /// Exponent of sin α.
    pub k: f64,
    /// Distance of the Sun from the Galactic centre, kpc.
    pub r_sun_kpc: f64,
    /// Scale length of the dust, kpc.
    pub h_r_kpc: f64,
    /// Scale height of the dust, kpc.
    pub h_z_kpc: f64,
    /// Field strength at the Sun, µG.
    pub b0_ug: f64,
    /// Radius that fixes the phase of the spiral, kpc.
    pub r0_kpc: f64,
    /// Scale height of the field, kpc.
    pub z0_kpc: f64,
}

impl Default for FieldConfig {
    fn default() -> Self {
        Self {
            pitch_deg: None,
            pitch_range_deg: [-60.0, -5.0],
            min_latitude_deg: 15.0,
            fit_nside: 64,
            p0: 0.20,
            k: 3.0,
            r_sun_kpc: 8.5,
            h_r_kpc: 3.0,
            h_z_kpc: 0.1,
            b0_ug: 3.0,
            r0_kpc: 10.55,
            z0_kpc: 1.0,
        }
    }
}

/// Bound on the polarisation fraction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Polarisation {
    /// Largest polarisation fraction of a layer.
    pub p_max: f64,
}

impl Default for Polarisation {
    fn default() -> Self {
        Self { p_max: 0.25 }
    }
}

/// Random small scales.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SmallScales {
    /// Whether any are added.
    pub enabled: bool,
    /// Beam above which intensity is observed, FWHM in arcmin.
    pub intensity_beam_arcmin: f64,
    /// Beam above which polarisation is observed, FWHM in degrees, one per layer; the last holds for all further layers.
    pub polarisation_beam_deg: Vec<f64>,
    /// Correlation coefficient of T and E.
    pub te: f64,
    /// Slope of the EE spectrum.
    pub slope_ee: f64,
    /// Slope of the BB spectrum.
    pub slope_bb: f64,
    /// How the correlation of T and E is imposed.
    pub te_filter: TeFilter,
    /// Scale above which the intensity is restored, degrees; 0 = not at all.
    pub restore_fwhm_deg: f64,
    /// Whether |(Q, U)| ≤ I is imposed on the templates.
    pub physical_limit: bool,
}

impl Default for SmallScales {
    fn default() -> Self {
        Self {
            enabled: true,
            intensity_beam_arcmin: 5.0,
            polarisation_beam_deg: vec![2.5, 2.5, 2.5, 2.0, 2.0, 2.0],
            te: 0.30,
            slope_ee: -2.42,
            slope_bb: -2.42,
            te_filter: TeFilter::Measured,
            restore_fwhm_deg: 1.0,
            physical_limit: true,
        }
    }
}

/// How the correlation of T and E is imposed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TeFilter {
    /// From the measured spectra of the simulation.
    #[default]
    Measured,
    /// By the formula of the paper.
    Analytic,
    /// Not at all.
    None,
}

/// Random temperature and spectral-index maps of the layers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Laws {
    /// Whether the factors below are solved for instead of taken as given.
    pub calibrate: bool,
    /// Factor on the mean temperature of a layer.
    pub s_avg: f64,
    /// Factor on its fluctuations.
    pub s_t: f64,
    /// Factor on the fluctuations of the spectral index.
    pub s_beta: f64,
    /// Iterations of remapping and refiltering.
    pub refilter_iterations: u32,
}

impl Default for Laws {
    fn default() -> Self {
        Self {
            calibrate: true,
            s_avg: 0.982,
            s_t: 1.84,
            s_beta: 1.94,
            refilter_iterations: 1,
        }
    }
}

/// The modified-blackbody fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Fit {
    /// Effective frequencies of the four intensity maps, GHz.
    #[serde(deserialize_with = "frequencies_from")]
    pub nu_ghz: Vec<f64>,
    /// Relative uncertainty at each.
    pub sigma: Vec<f64>,
}

impl Default for Fit {
    fn default() -> Self {
        Self {
            nu_ghz: vec![353.0, 545.0, 857.0, super::MICRON_100_GHZ],
            sigma: vec![0.0078, 0.061, 0.064, 0.135],
        }
    }
}

/// What is written, and how.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Output {
    /// Which stages are kept.
    pub keep: Keep,
    /// Element type of templates, laws and emission.
    pub dtype: Dtype,
}

/// Which stages are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Keep {
    /// All of them.
    #[default]
    All,
    /// Observations, templates, laws, emission.
    Final,
}

/// Element type of a raw map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Dtype {
    /// IEEE single precision, little-endian.
    F32,
    /// IEEE double precision, little-endian.
    #[default]
    F64,
}

impl Dtype {
    /// `f32` or `f64`, which is also the extension of the file.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::F64 => "f64",
        }
    }

    /// Bytes per value.
    #[must_use]
    pub const fn size(self) -> usize {
        match self {
            Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}
