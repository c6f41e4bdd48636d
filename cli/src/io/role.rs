//! What a map is wanted for: which column of a file of several that is, and in which unit.

use crate::config::parse_frequency;
use crate::kernels::units::{NU_100UM_GHZ, Unit};

/// What a map is wanted for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Role {
    /// Intensity at a frequency in GHz; read in MJy/sr.
    Intensity(f64),
    /// Stokes Q at a frequency in GHz; read in MJy/sr.
    StokesQ(f64),
    /// Stokes U at a frequency in GHz, COSMO; read in MJy/sr.
    StokesU(f64),
    /// Optical depth.
    OpticalDepth,
    /// Dust temperature; read in K.
    Temperature,
    /// Spectral index.
    SpectralIndex,
    /// E(B − V); read in mag.
    Reddening,
}

/// What the name of a column says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Meaning {
    /// It is what is wanted, and says so.
    Wanted,
    /// It says nothing: `TEMPERATURE` (healpy's name of any single map), `SIGNAL`, `COLUMN_1`.
    Neutral,
    /// It says that it is something else.
    Other,
}

impl Role {
    /// The role of an input by its key: `I_353`, `Q_353`, `U_353`, `tau`, `T`, `beta`, `ebv_<modulus>`.
    #[must_use]
    pub fn of_key(key: &str) -> Option<Self> {
        match key {
            "tau" => return Some(Self::OpticalDepth),
            "T" => return Some(Self::Temperature),
            "beta" => return Some(Self::SpectralIndex),
            _ if key.starts_with("ebv") || key == "cube" => return Some(Self::Reddening),
            _ => {}
        }
        let (stokes, nu) = key.split_once('_')?;
        let ghz = match nu {
            // The name stands for 100 µm.
            "2998" => NU_100UM_GHZ,
            _ => parse_frequency(nu)?,
        };
        match stokes {
            "I" => Some(Self::Intensity(ghz)),
            "Q" => Some(Self::StokesQ(ghz)),
            "U" => Some(Self::StokesU(ghz)),
            _ => None,
        }
    }

    /// The unit in which it is read.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Intensity(_) | Self::StokesQ(_) | Self::StokesU(_) => "MJy/sr",
            Self::OpticalDepth | Self::SpectralIndex => "1",
            Self::Temperature => "K",
            Self::Reddening => "mag",
        }
    }

    /// What a sentence calls it.
    pub(super) const fn title(self) -> &'static str {
        match self {
            Self::Intensity(_) => "an intensity",
            Self::StokesQ(_) => "Stokes Q",
            Self::StokesU(_) => "Stokes U",
            Self::OpticalDepth => "an optical depth",
            Self::Temperature => "a dust temperature",
            Self::SpectralIndex => "a spectral index",
            Self::Reddening => "a reddening",
        }
    }

    /// How many of [`unit`](Self::unit) make one of `unit`, as a header writes it; `None` if that is no such unit.
    pub(super) fn factor(self, unit: &str) -> Option<f64> {
        let plain = unit.trim().to_ascii_lowercase();
        match self {
            Self::Intensity(ghz) | Self::StokesQ(ghz) | Self::StokesU(ghz) => {
                unit.parse::<Unit>().ok()?.to_mjysr(ghz).ok()
            }
            Self::OpticalDepth | Self::SpectralIndex => {
                matches!(plain.as_str(), "1" | "tau" | "dimensionless").then_some(1.0)
            }
            Self::Temperature => match plain.as_str() {
                "k" | "kelvin" | "kelvins" => Some(1.0),
                "mk" if unit.trim() == "mK" => Some(1e-3),
                "uk" => Some(1e-6),
                _ => None,
            },
            Self::Reddening => match plain.as_str() {
                "mag" | "mags" | "magnitude" | "magnitudes" | "ebv" | "e(b-v)" => Some(1.0),
                "mmag" if unit.trim() == "mmag" => Some(1e-3),
                _ => None,
            },
        }
    }

    /// What a column called `name` holds, in view of this role.
    pub(super) fn meaning(self, name: &str) -> Meaning {
        let name = Name::of(name);
        let stokes = |letter: char, ghz: f64| match name.stokes() {
            Some((found, nu)) if found == letter && nu.is_none_or(|nu| same_band(nu, ghz)) => {
                Meaning::Wanted
            }
            Some(_) => Meaning::Other,
            // Next to Q and U, the intensity is often called T.
            None if name.0 == "T" => Meaning::Neutral,
            None if name.parameter().is_some() || name.is_auxiliary() => Meaning::Other,
            None => Meaning::Neutral,
        };
        let parameter = |wanted: Self| match name.parameter() {
            Some(found) if found == wanted => Meaning::Wanted,
            Some(_) => Meaning::Other,
            None if name.stokes().is_some() || name.is_auxiliary() => Meaning::Other,
            None => Meaning::Neutral,
        };
        match self {
            Self::Intensity(ghz) => stokes('I', ghz),
            Self::StokesQ(ghz) => stokes('Q', ghz),
            Self::StokesU(ghz) => stokes('U', ghz),
            // healpy calls any single map T or TEMPERATURE if it is not told more.
            Self::Temperature if name.0 == "TEMPERATURE" => Meaning::Wanted,
            other if other != Self::Temperature && name.0 == "T" => Meaning::Neutral,
            other => parameter(other),
        }
    }
}

/// The Stokes parameter that a column is wanted for, or else names: `I`, `Q`, `U`.
pub(super) fn stokes(role: Option<Role>, name: &str) -> Option<char> {
    match role {
        Some(Role::Intensity(_)) => Some('I'),
        Some(Role::StokesQ(_)) => Some('Q'),
        Some(Role::StokesU(_)) => Some('U'),
        Some(_) => None,
        None => Name::of(name).stokes().map(|(letter, _)| letter),
    }
}

/// Names write frequencies in whole GHz.
fn same_band(named: f64, ghz: f64) -> bool {
    (named - ghz).abs() < 1.0
}

/// The name of a column in capitals, with `_` for what separates its parts.
struct Name(String);

impl Name {
    fn of(name: &str) -> Self {
        let name = name.trim().to_ascii_uppercase();
        Self(name.replace(['-', ' ', '.'], "_"))
    }

    /// Stokes letter and frequency, if it names one: `Q_POLARISATION`, `Q_STOKES`, `STOKES_Q`, `Q`, `Q353`, `I_545`.
    fn stokes(&self) -> Option<(char, Option<f64>)> {
        let name = self.0.strip_prefix("STOKES_").unwrap_or(&self.0);
        if matches!(name, "INTENSITY" | "I_INTENSITY") {
            return Some(('I', None));
        }
        let letter = name.chars().next().filter(|c| "IQU".contains(*c))?;
        let rest = name[1..].trim_start_matches('_');
        if matches!(
            rest,
            "" | "STOKES" | "POLARISATION" | "POLARIZATION" | "POL" | "MAP" | "SIGNAL"
        ) {
            return Some((letter, None));
        }
        let digits = rest
            .strip_suffix("GHZ")
            .unwrap_or(rest)
            .trim_end_matches('_');
        let nu: f64 = digits.parse().ok().filter(|nu: &f64| nu.is_finite())?;
        // `I_1`, `I_2`: columns of one kind, numbered.
        Some((letter, (nu >= 10.0).then_some(nu)))
    }

    /// The parameter of the dust it names, if it does.
    fn parameter(&self) -> Option<Role> {
        match self.0.as_str() {
            "TAU" | "TAU353" | "TAU_353" | "OPTICAL_DEPTH" | "OPACITY" => Some(Role::OpticalDepth),
            "TEMP" | "T" | "T_DUST" | "TDUST" | "TD" | "T_D" | "TEMP_ML" | "DUST_TEMPERATURE" => {
                Some(Role::Temperature)
            }
            "BETA" | "BETA_DUST" | "BETA_D" | "BETAD" | "BETA_ML" | "SPECTRAL_INDEX"
            | "SPECIND" => Some(Role::SpectralIndex),
            "EBV" | "E(B_V)" | "E_B_V" | "REDDENING" => Some(Role::Reddening),
            _ => None,
        }
    }

    /// Hits, variances, errors, masks: never a map to work on unless it is asked for.
    fn is_auxiliary(&self) -> bool {
        let name = self.0.as_str();
        [
            "N_OBS", "NOBS", "HIT", "ERR", "COV", "RMS", "MASK", "VAR", "SIGMA", "RADIANCE",
            "NHITS",
        ]
        .iter()
        .any(|part| name.contains(part))
            || matches!(name, "II" | "IQ" | "IU" | "QQ" | "QU" | "UU" | "PIXEL")
    }
}
