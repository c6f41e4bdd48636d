//! SI constants, intensity units and their conversion.
//!
//! Inside the program intensities are in MJy/sr and frequencies in GHz. A brightness I_ν is written in seven other
//! units at the boundaries:
//!
//! | unit | definition |
//! | --- | --- |
//! | `MJy/sr`, `Jy/sr` | 1e-20 and 1e-26 W m⁻² Hz⁻¹ sr⁻¹ |
//! | `K_RJ`, `mK_RJ`, `uK_RJ` | Rayleigh–Jeans temperature, I_ν = (2kν²/c²) T_RJ |
//! | `K_CMB`, `mK_CMB`, `uK_CMB` | thermodynamic temperature about the CMB, I_ν = (∂B_ν/∂T)(T_CMB) ΔT |
//!
//! The temperatures depend on the frequency; over a bandpass the two factors are integrated
//! ([`crate::planck::bandpass`]). Constants are the exact SI values of 2019; T_CMB = 2.7255 K (Fixsen, ApJ 707, 916,
//! 2009).

use crate::Error;
use crate::planck::spectrum;
use core::fmt;
use core::str::FromStr;

/// Planck constant, J s (exact in SI 2019).
pub const H: f64 = 6.626_070_15e-34;
/// Boltzmann constant, J/K (exact in SI 2019).
pub const K_B: f64 = 1.380_649e-23;
/// Speed of light, m/s (exact).
pub const C: f64 = 299_792_458.0;
/// Temperature of the cosmic microwave background, K.
pub const T_CMB: f64 = 2.7255;
/// The reference frequency ν₀ of the model, GHz.
pub const NU0_GHZ: f64 = 353.0;
/// The frequency meant by "100 µm", c / 100 µm in GHz.
///
/// ```
/// use dust3d_kernels::units::{C, NU_100UM_GHZ};
/// assert_eq!(NU_100UM_GHZ, C / 1e-4 / 1e9);
/// ```
pub const NU_100UM_GHZ: f64 = 2_997.924_58;

/// h/k in K/GHz, rounded: x = hν/kT = `H_OVER_K_GHZ`·ν/T.
///
/// ```
/// use dust3d_kernels::units::{H, H_OVER_K_GHZ, K_B};
/// assert!((H_OVER_K_GHZ - H * 1e9 / K_B).abs() < 1e-16);
/// ```
pub const H_OVER_K_GHZ: f64 = 0.047_992_430_733_662_21;
/// What [`H_OVER_K_GHZ`] lacks: the sum of both holds h/k to 2^−106.
pub const H_OVER_K_GHZ_LOW: f64 = 2.518_334_103_574_378_4e-18;
/// 2h/c² in MJy sr⁻¹ GHz⁻³: B_ν = `TWO_H_OVER_C2`·ν³/(eˣ − 1).
///
/// ```
/// use dust3d_kernels::units::{C, H, TWO_H_OVER_C2};
/// assert!((TWO_H_OVER_C2 / (2.0 * H / (C * C) * 1e47) - 1.0).abs() < 1e-15);
/// ```
pub const TWO_H_OVER_C2: f64 = 0.001_474_499_464_762_541_6;
/// 2k/c² in MJy sr⁻¹ GHz⁻² K⁻¹: I_ν = `TWO_K_OVER_C2`·ν²·T_RJ.
///
/// ```
/// use dust3d_kernels::units::{C, K_B, TWO_K_OVER_C2};
/// assert!((TWO_K_OVER_C2 / (2.0 * K_B / (C * C) * 1e38) - 1.0).abs() < 1e-15);
/// ```
pub const TWO_K_OVER_C2: f64 = 0.030_723_583_744_807_444;

/// What kind of quantity a unit measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum UnitKind {
    /// Surface brightness: no frequency enters the conversion.
    Brightness,
    /// Rayleigh–Jeans temperature.
    RayleighJeans,
    /// Thermodynamic temperature about the CMB.
    Cmb,
}

/// A unit of intensity.
///
/// Parsed from the spellings of PySM, Planck and FITS `TUNIT` cards ([`FromStr`]), written as PySM writes it
/// ([`fmt::Display`]).
///
/// ```
/// use dust3d_kernels::units::Unit;
///
/// // At 353 GHz 1 MJy/sr = 261.20333 uK_RJ = 3370.9585 uK_CMB.
/// let rj = Unit::MicroKRj.from_mjysr(353.0)?;
/// let cmb = Unit::MicroKCmb.from_mjysr(353.0)?;
/// assert!((rj - 261.20333).abs() < 5e-6);
/// assert!((cmb - 3370.9585).abs() < 5e-5);
/// assert_eq!("uK_CMB".parse(), Ok(Unit::MicroKCmb));
/// # Ok::<(), dust3d_kernels::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Unit {
    /// MJy/sr.
    #[default]
    MJySr,
    /// Jy/sr.
    JySr,
    /// K, Rayleigh–Jeans.
    KRj,
    /// mK, Rayleigh–Jeans.
    MilliKRj,
    /// µK, Rayleigh–Jeans.
    MicroKRj,
    /// K, thermodynamic.
    KCmb,
    /// mK, thermodynamic.
    MilliKCmb,
    /// µK, thermodynamic.
    MicroKCmb,
}

impl Unit {
    /// Every unit.
    pub const ALL: [Self; 8] = [
        Self::MJySr,
        Self::JySr,
        Self::KRj,
        Self::MilliKRj,
        Self::MicroKRj,
        Self::KCmb,
        Self::MilliKCmb,
        Self::MicroKCmb,
    ];

    /// The name, as PySM writes it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::MJySr => "MJy/sr",
            Self::JySr => "Jy/sr",
            Self::KRj => "K_RJ",
            Self::MilliKRj => "mK_RJ",
            Self::MicroKRj => "uK_RJ",
            Self::KCmb => "K_CMB",
            Self::MilliKCmb => "mK_CMB",
            Self::MicroKCmb => "uK_CMB",
        }
    }

    /// What the unit measures.
    #[must_use]
    pub const fn kind(self) -> UnitKind {
        match self {
            Self::MJySr | Self::JySr => UnitKind::Brightness,
            Self::KRj | Self::MilliKRj | Self::MicroKRj => UnitKind::RayleighJeans,
            Self::KCmb | Self::MilliKCmb | Self::MicroKCmb => UnitKind::Cmb,
        }
    }

    /// How many of this unit make one MJy/sr, K_RJ or K_CMB: an exact power of ten.
    #[must_use]
    pub const fn per_base(self) -> f64 {
        match self {
            Self::MJySr | Self::KRj | Self::KCmb => 1.0,
            Self::MilliKRj | Self::MilliKCmb => 1e3,
            Self::JySr | Self::MicroKRj | Self::MicroKCmb => 1e6,
        }
    }

    /// The factor that turns MJy/sr at `nu_ghz` into this unit.
    ///
    /// # Errors
    /// [`Error::Domain`] unless the unit is a brightness or `nu_ghz` is positive and finite and the factor is too (in
    /// K_CMB it overflows above 39 THz, where the CMB has no light left).
    #[doc(alias = "conversion")]
    pub fn from_mjysr(self, nu_ghz: f64) -> Result<f64, Error> {
        let base = self.base_mjysr(nu_ghz)?;
        let factor = self.per_base() / base;
        if factor.is_finite() {
            Ok(factor)
        } else {
            Err(Error::Domain {
                what: "frequency in GHz of a unit conversion (above 0, below 39000 for K_CMB)",
                value: nu_ghz,
            })
        }
    }

    /// The factor that turns this unit at `nu_ghz` into MJy/sr.
    ///
    /// # Errors
    /// As [`from_mjysr`](Self::from_mjysr), but for the upper end: it is 0 where the CMB has no light left.
    pub fn to_mjysr(self, nu_ghz: f64) -> Result<f64, Error> {
        Ok(self.base_mjysr(nu_ghz)? / self.per_base())
    }

    /// 1 MJy/sr, 1 K_RJ or 1 K_CMB in MJy/sr.
    fn base_mjysr(self, nu_ghz: f64) -> Result<f64, Error> {
        let kind = self.kind();
        if kind != UnitKind::Brightness && !(nu_ghz > 0.0 && nu_ghz < f64::INFINITY) {
            return Err(Error::Domain {
                what: "frequency in GHz of a unit conversion (above 0, finite)",
                value: nu_ghz,
            });
        }
        Ok(match kind {
            UnitKind::Brightness => 1.0,
            UnitKind::RayleighJeans => spectrum::rayleigh_jeans_scalar(nu_ghz),
            UnitKind::Cmb => spectrum::planck_derivative_scalar(nu_ghz, T_CMB),
        })
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A string that names no [`Unit`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ParseUnitError;

impl fmt::Display for ParseUnitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(
            "not a unit of intensity (MJy/sr, Jy/sr, K_RJ, mK_RJ, uK_RJ, K_CMB, mK_CMB, uK_CMB)",
        )
    }
}

impl core::error::Error for ParseUnitError {}

impl FromStr for Unit {
    type Err = ParseUnitError;

    /// Accepts the names of [`Unit::name`] and how FITS files spell them: `Kcmb`, `K_{CMB}`, `K(CMB)`, `KRJ`, `muK_RJ`,
    /// `µK_CMB`, `microK_CMB`, `mK, thermodynamic`, `mK,antenna`, `MJy sr-1`, `MJy sr^-1`, `MJy sr**-1`. The case of
    /// `M` and `m` before `Jy` matters; a temperature that does not say which (`K`) is refused.
    fn from_str(s: &str) -> Result<Self, ParseUnitError> {
        // Spaces, underscores, brackets and commas carry nothing; no unit is longer than the buffer without them.
        let mut buffer = [0_u8; 24];
        let mut length = 0;
        for &b in s.as_bytes() {
            if matches!(
                b,
                b' ' | b'\t' | b'_' | b'(' | b')' | b'{' | b'}' | b',' | b'\''
            ) {
                continue;
            }
            *buffer.get_mut(length).ok_or(ParseUnitError)? = b;
            length += 1;
        }
        let bytes = buffer.get(..length).ok_or(ParseUnitError)?;
        let text = core::str::from_utf8(bytes).map_err(|_| ParseUnitError)?;
        brightness(text)
            .or_else(|| temperature(text))
            .ok_or(ParseUnitError)
    }
}

/// `strip_prefix` without regard to ASCII case.
fn strip<'a>(text: &'a str, prefix: &str) -> Option<&'a str> {
    let head = text.get(..prefix.len())?;
    head.eq_ignore_ascii_case(prefix)
        .then(|| text.get(prefix.len()..))?
}

fn brightness(text: &str) -> Option<Unit> {
    let (unit, rest) = match text.strip_prefix('M') {
        Some(rest) => (Unit::MJySr, rest),
        None => (Unit::JySr, text),
    };
    let rest = strip(rest, "Jy")?;
    [
        "/sr", "sr-1", ".sr-1", "*sr-1", "sr^-1", "sr**-1", "*sr**-1",
    ]
    .iter()
    .any(|tail| rest.eq_ignore_ascii_case(tail))
    .then_some(unit)
}

fn temperature(text: &str) -> Option<Unit> {
    const MICRO: [&str; 5] = ["micro", "mu", "u", "\u{b5}", "\u{3bc}"];
    let (prefix, rest) = MICRO
        .iter()
        .find_map(|p| text.strip_prefix(p))
        .map(|rest| (2, rest))
        .or_else(|| {
            let rest = text.strip_prefix("milli").or(text.strip_prefix('m'))?;
            Some((1, rest))
        })
        .unwrap_or((0, text));
    let rest = strip(rest, "K")?;
    let is = |names: &[&str]| names.iter().any(|n| rest.eq_ignore_ascii_case(n));
    let units = if is(&["RJ", "antenna"]) {
        [Unit::KRj, Unit::MilliKRj, Unit::MicroKRj]
    } else if is(&["CMB", "thermo", "thermodynamic"]) {
        [Unit::KCmb, Unit::MilliKCmb, Unit::MicroKCmb]
    } else {
        return None;
    };
    units.get(prefix).copied()
}
