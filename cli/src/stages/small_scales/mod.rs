//! Small scales of a layer: random fluctuations beyond the resolution of the observations (\[MKD18\], section 5).
//!
//! Each layer by itself, from its renormalised I, Q, U at ν₀:
//!
//! 1. analyse it; fit power laws to its TT, EE and BB spectra,
//! 2. [`seeds`]: Gaussian a_lm with those spectra, T and E correlated,
//! 3. [`intensity`]: log-normal fluctuations, large scales restored,
//! 4. [`polarisation`]: Gaussian fluctuations in proportion to the polarised intensity, added through windows,
//! 5. [`correlation`]: the T–E correlation of the result set to the wanted one,
//! 6. synthesis of Q and U, limited to |(Q, U)| ≤ I.

pub mod correlation;
pub mod intensity;
pub mod polarisation;
pub mod seeds;

pub use intensity::KappaStatus;

use crate::Error;
use crate::config::SmallScales;
use crate::parallel;
use crate::sht::{Harmonics, ShtPlan, Spectra};
use dust3d_kernels::spectra::{
    PowerLaw, beam_complement, fit_amplitude, fit_power_law, fit_range, scale_by_l,
};

/// Multipoles of the fit of the intensity spectrum.
const FIT_TT: (usize, usize) = (30, 300);
/// Multipoles of the fits of the polarisation spectra.
const FIT_POL: (usize, usize) = (30, 100);

/// Stokes maps of one layer at ν₀, MJy/sr.
#[derive(Debug, Clone)]
pub struct StokesMaps {
    /// Intensity.
    pub i: Vec<f64>,
    /// Stokes Q, COSMO.
    pub q: Vec<f64>,
    /// Stokes U, COSMO.
    pub u: Vec<f64>,
}

/// What was fitted and done to a layer.
#[derive(Debug, Clone)]
pub struct LayerReport {
    /// Fit of the intensity spectrum; zero for an empty layer.
    pub tt: PowerLaw,
    /// Amplitude of the E spectrum at l = 80.
    pub a_ee: f64,
    /// Amplitude of the B spectrum at l = 80.
    pub a_bb: f64,
    /// Amplitude of the log-normal fluctuations.
    pub kappa: f64,
    /// How `kappa` was found.
    pub kappa_status: KappaStatus,
    /// Pixels where |(Q, U)| was cut to I.
    pub limited_pixels: u64,
    /// Spectra of the layer as observed, (MJy/sr)².
    pub before: Spectra,
    /// Spectra with small scales, before the limit |(Q, U)| ≤ I.
    pub after: Spectra,
}

/// A layer's spectra and the laws they follow: all that small scales need to know of it, whatever the seed.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// Fit of the intensity spectrum; zero for an empty layer.
    pub tt: PowerLaw,
    /// Of the E spectrum; its slope is the configured one.
    pub ee: PowerLaw,
    /// Of the B spectrum; its slope is the configured one.
    pub bb: PowerLaw,
    /// Multipoles in which E and B were fitted.
    pub range: (usize, usize),
    /// The spectra.
    pub spectra: Spectra,
}

/// Analyses a layer and fits power laws to its spectra.
///
/// `reach`: the multipole up to which the observations carry signal, 1.5 Nside of the coarsest of the I, Q, U inputs
/// and the working grid.
///
/// # Errors
/// If a map has another length than the plan's.
pub fn measure(
    plan: &mut ShtPlan,
    config: &SmallScales,
    reach: usize,
    maps: &StokesMaps,
) -> Result<(Harmonics, Fitted), Error> {
    let lmax = plan.lmax();
    let observed = Harmonics::analyse(plan, &[[&maps.i, &maps.q, &maps.u]])?.remove(0);
    let spectra = observed.spectra(lmax)?;

    let reach = reach.min(lmax);
    let (lo, hi) = fit_range(FIT_TT.0, FIT_TT.1, reach);
    let tt = fit_power_law(&spectra.tt, lo, hi).unwrap_or(PowerLaw {
        amplitude: 0.0,
        slope: 0.0,
    });
    let (lo, hi) = fit_range(FIT_POL.0, FIT_POL.1, reach);
    let law = |c: &[f64], slope: f64| PowerLaw {
        amplitude: fit_amplitude(c, lo, hi, slope),
        slope,
    };
    let fitted = Fitted {
        tt,
        ee: law(&spectra.ee, config.slope_ee),
        bb: law(&spectra.bb, config.slope_bb),
        range: (lo, hi),
        spectra,
    };
    Ok((observed, fitted))
}

/// Adds small scales to one layer (counted from 1), which [`measure`] has seen.
///
/// # Errors
/// If a map has another length than the plan's.
pub fn add_small_scales(
    plan: &mut ShtPlan,
    config: &SmallScales,
    seed: u64,
    layer: usize,
    maps: &StokesMaps,
    (observed, fitted): (&Harmonics, &Fitted),
) -> Result<(StokesMaps, LayerReport), Error> {
    let lmax = plan.lmax();
    let &Fitted { tt, ee, bb, .. } = fitted;

    let mut seeds = seeds::draw(seed, layer, lmax, (tt, ee, bb), config.te)?;

    let intensity_beam = (config.intensity_beam_arcmin / 60.0).to_radians();
    let window: Vec<f64> = (0..=lmax)
        .map(|l| beam_complement(intensity_beam, l).sqrt())
        .collect();
    scale_by_l(&mut seeds.t, &window)?;
    let mut g = vec![0.0; maps.i.len()];
    plan.synthesis(&seeds.t, &mut g)?;
    drop(std::mem::take(&mut seeds.t));
    let intensity::LogNormal {
        map: i,
        alm: t,
        kappa,
        status: kappa_status,
    } = intensity::add(
        plan,
        &maps.i,
        &observed.t,
        &g,
        &tt,
        config.restore_fwhm_deg.to_radians(),
    )?;
    drop(g);

    let beams = &config.polarisation_beam_deg;
    let polarisation_beam = beams
        .get(layer - 1)
        .or(beams.last())
        .map_or(0.0, |deg| deg.to_radians());
    let (e, b) = polarisation::add(
        plan,
        &polarisation::Fluctuations {
            maps,
            ee,
            bb,
            range: fitted.range,
            beam: polarisation_beam,
        },
        (&observed.e, &observed.b),
        (seeds.e, seeds.b),
    )?;
    let mut simulated = Harmonics { t, e, b };
    correlation::correlate(
        config.te_filter,
        &correlation::Te {
            rho: config.te,
            intensity_beam,
            polarisation_beam,
            tt,
            ee,
            t_obs: &observed.t,
            e_obs: &observed.e,
        },
        &simulated.t,
        &mut simulated.e,
        lmax,
    )?;

    let (mut q, mut u) = (vec![0.0; i.len()], vec![0.0; i.len()]);
    plan.synthesis_spin2(&simulated.e, &simulated.b, &mut q, &mut u)?;
    let limited_pixels = if config.physical_limit {
        limit_polarisation(&i, &mut q, &mut u)
    } else {
        0
    };
    let report = LayerReport {
        tt,
        a_ee: ee.amplitude,
        a_bb: bb.amplitude,
        kappa,
        kappa_status,
        limited_pixels,
        before: fitted.spectra.clone(),
        after: simulated.spectra(lmax)?,
    };
    Ok((StokesMaps { i, q, u }, report))
}

/// Scales (Q, U) down to |(Q, U)| = I wherever it is more; returns in how many pixels.
///
/// Harmonic synthesis leaks polarisation into pixels where a layer is faint or empty.
fn limit_polarisation(i: &[f64], q: &mut Vec<f64>, u: &mut Vec<f64>) -> u64 {
    let mut maps = [std::mem::take(q), std::mem::take(u)];
    let counts = parallel::for_columns(&mut maps, |range, mut qu| {
        let mut count = 0;
        let (q, u) = qu.split_at_mut(1);
        for ((q, u), &i) in q[0].iter_mut().zip(u[0].iter_mut()).zip(&i[range]) {
            let p = q.hypot(*u);
            if p > i {
                *q *= i / p;
                *u *= i / p;
                count += 1;
            }
        }
        count
    });
    let [new_q, new_u] = maps;
    (*q, *u) = (new_q, new_u);
    counts.into_iter().sum()
}
