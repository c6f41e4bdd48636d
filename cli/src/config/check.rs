//! What the values of a configuration may be, and those that follow from others.

use super::keys::Config;
use crate::error::{Error, Result};

/// Largest working Nside: memory, not indexing, is the limit (one map is 6.4 GB at 8192).
const LARGEST_NSIDE: u32 = 8192;

impl Config {
    /// Checks every value and fills in those that follow from others: `lmax`, and one beam per layer.
    ///
    /// # Errors
    /// A usage error that names the key, its value and its range.
    pub fn resolve(mut self) -> Result<Self> {
        self.check()?;
        let lmax = self.lmax();
        self.lmax = Some(lmax);
        let beams = &mut self.small_scales.polarisation_beam_deg;
        let last = beams.last().copied().unwrap_or_default();
        beams.resize(self.layers.edges.len(), last);
        Ok(self)
    }

    /// The band limit: `lmax` if given, else 2 Nside.
    #[must_use]
    pub fn lmax(&self) -> usize {
        self.lmax.unwrap_or(2 * self.nside as usize)
    }

    /// The number of layers.
    #[must_use]
    pub fn layer_count(&self) -> usize {
        self.layers.edges.len()
    }

    fn check(&self) -> Result<()> {
        nside("nside", self.nside)?;
        // Fits need two multipoles from l = 2 on.
        require(
            (3..=4 * self.nside as usize).contains(&self.lmax()),
            "lmax",
            self.lmax(),
            "from 3 to 4 nside",
        )?;
        require(
            self.threads <= 4096,
            "threads",
            self.threads,
            "from 0 (all cores) to 4096",
        )?;
        for &nu in &self.frequencies {
            require(
                nu > 0.0 && nu < 1e6,
                "frequencies",
                nu,
                "GHz, above 0 and below 1e6",
            )?;
        }
        positive("inputs.color_correction", self.inputs.color_correction)?;
        self.check_layers()?;
        self.check_field()?;
        self.check_small_scales()?;
        self.check_laws()
    }

    fn check_layers(&self) -> Result<()> {
        let edges = &self.layers.edges;
        require(
            !edges.is_empty() && edges.windows(2).all(|pair| pair[0] < pair[1]),
            "layers.edges",
            format_args!("{edges:?}"),
            "a list of one or more increasing distance moduli",
        )?;
        for &edge in edges {
            require(
                (4.0..=19.0).contains(&edge) && (2.0 * edge).fract() == 0.0,
                "layers.edges",
                edge,
                "distance moduli of the cube: 4, 4.5 … 19",
            )?;
        }
        let radius = self.layers.fill_radius_deg;
        require(
            radius > 0.0 && radius <= 180.0,
            "layers.fill_radius_deg",
            radius,
            "above 0, at most 180",
        )
    }

    fn check_field(&self) -> Result<()> {
        let field = &self.field;
        let pitch = |value: f64| value > -90.0 && value < 90.0 && value != 0.0;
        if let Some(value) = field.pitch_deg {
            require(
                pitch(value),
                "field.pitch_deg",
                value,
                "between -90 and 90, not 0",
            )?;
        }
        let [low, high] = field.pitch_range_deg;
        require(
            pitch(low) && pitch(high) && high - low >= 2.0 && low.signum() == high.signum(),
            "field.pitch_range_deg",
            format_args!("[{low}, {high}]"),
            "two angles, the first at least 2 below the second, between -90 and 0 or between 0 and 90",
        )?;
        let latitude = field.min_latitude_deg;
        require(
            (0.0..90.0).contains(&latitude),
            "field.min_latitude_deg",
            latitude,
            "from 0 to below 90",
        )?;
        nside("field.fit_nside", field.fit_nside)?;
        require(
            (0.0..=1.0).contains(&field.p0),
            "field.p0",
            field.p0,
            "from 0 to 1",
        )?;
        require(
            (0.0..=100.0).contains(&field.k),
            "field.k",
            field.k,
            "from 0 to 100",
        )?;
        for (key, value) in [
            ("field.r_sun_kpc", field.r_sun_kpc),
            ("field.h_r_kpc", field.h_r_kpc),
            ("field.h_z_kpc", field.h_z_kpc),
            ("field.b0_ug", field.b0_ug),
            ("field.r0_kpc", field.r0_kpc),
            ("field.z0_kpc", field.z0_kpc),
        ] {
            positive(key, value)?;
        }
        let p_max = self.polarisation.p_max;
        require(
            p_max > 0.0 && p_max <= 1.0,
            "polarisation.p_max",
            p_max,
            "above 0, at most 1",
        )
    }

    fn check_small_scales(&self) -> Result<()> {
        let small = &self.small_scales;
        positive(
            "small_scales.intensity_beam_arcmin",
            small.intensity_beam_arcmin,
        )?;
        require(
            !small.polarisation_beam_deg.is_empty(),
            "small_scales.polarisation_beam_deg",
            "[]",
            "one beam per layer (the last holds for all further layers)",
        )?;
        for &beam in &small.polarisation_beam_deg {
            positive("small_scales.polarisation_beam_deg", beam)?;
        }
        require(
            small.te > -1.0 && small.te < 1.0,
            "small_scales.te",
            small.te,
            "between -1 and 1",
        )?;
        for (key, slope) in [
            ("small_scales.slope_ee", small.slope_ee),
            ("small_scales.slope_bb", small.slope_bb),
        ] {
            require(slope.abs() <= 10.0, key, slope, "from -10 to 10")?;
        }
        let restore = small.restore_fwhm_deg;
        require(
            (0.0..=180.0).contains(&restore),
            "small_scales.restore_fwhm_deg",
            restore,
            "from 0 (none) to 180",
        )
    }

    fn check_laws(&self) -> Result<()> {
        let laws = &self.laws;
        positive("laws.s_avg", laws.s_avg)?;
        for (key, value) in [("laws.s_t", laws.s_t), ("laws.s_beta", laws.s_beta)] {
            require((0.0..=100.0).contains(&value), key, value, "from 0 to 100")?;
        }
        require(
            laws.refilter_iterations <= 100,
            "laws.refilter_iterations",
            laws.refilter_iterations,
            "from 0 to 100",
        )?;
        let fit = &self.fit;
        require(
            fit.nu_ghz.len() == 4
                && fit.nu_ghz.windows(2).all(|pair| pair[0] < pair[1])
                && fit.nu_ghz[0] > 0.0,
            "fit.nu_ghz",
            format_args!("{:?}", fit.nu_ghz),
            "four increasing frequencies, those of I_353, I_545, I_857, I_2998",
        )?;
        require(
            fit.sigma.len() == fit.nu_ghz.len(),
            "fit.sigma",
            format_args!("{:?}", fit.sigma),
            "one relative uncertainty per frequency of fit.nu_ghz",
        )?;
        for &sigma in &fit.sigma {
            positive("fit.sigma", sigma)?;
        }
        Ok(())
    }
}

fn require(holds: bool, key: &str, value: impl std::fmt::Display, range: &str) -> Result<()> {
    if holds {
        Ok(())
    } else {
        Err(Error::usage(format!(
            "configuration key `{key}` is {value}; it must be {range}"
        )))
    }
}

fn positive(key: &str, value: f64) -> Result<()> {
    require(
        value.is_finite() && value > 0.0,
        key,
        value,
        "a number above 0",
    )
}

fn nside(key: &str, value: u32) -> Result<()> {
    require(
        value.is_power_of_two() && value <= LARGEST_NSIDE,
        key,
        value,
        "a power of two from 1 to 8192",
    )
}
