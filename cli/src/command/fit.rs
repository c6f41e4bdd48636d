//! `dust3d fit`.

use super::print;
use super::run::frequency;
use super::session::Session;
use crate::config::{Dtype, Fit};
use crate::error::{Error, Result};
use crate::io::manifest::{FitStatistics, InputRecord};
use crate::io::{Manifest, MapFile, MapSource, Role, RunDir};
use crate::kernels::fit::mbb::{FitCounts, MbbFit, fit_into};
use crate::kernels::simd::Level;
use crate::parallel;
use crate::stages::laws::sky::mean_std;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  dust3d fit --map 353:I_353.f64 --map 545:I_545.f64 --map 857:I_857.f64 --map 100um:I_2998.f64 --out fitted\n\nWrites tau (at 353 GHz), T (K), beta and chi2, missing where there is no fit."
)]
pub(super) struct Args {
    /// An intensity map (raw: in MJy/sr; FITS: in any unit it states) with its frequency in GHz (or a wavelength: 100um); at least three
    #[arg(long, value_name = "FREQ:FILE", required = true, value_parser = band)]
    map: Vec<(f64, String)>,
    /// Relative uncertainty at a frequency [default: 0.0078, 0.061, 0.064, 0.135 at 353, 545, 857 GHz and 100 µm]
    #[arg(long, value_name = "FREQ:SIGMA", value_parser = sigma)]
    sigma: Vec<(f64, f64)>,
    /// Directory to make
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replace the directory if this program made it
    #[arg(long)]
    force: bool,
}

pub(super) fn execute(args: &Args, session: &Session) -> Result<()> {
    let mut bands = args.map.clone();
    bands.sort_by(|a, b| a.0.total_cmp(&b.0));
    if let Some(pair) = bands.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        return Err(Error::usage(format!(
            "--map gives {} GHz twice; give each frequency once",
            pair[0].0
        )));
    }
    if bands.len() < 3 {
        return Err(Error::usage(format!(
            "--map gives {} frequencies; τ, T and β need at least three",
            bands.len()
        )));
    }
    let nu: Vec<f64> = bands.iter().map(|(nu, _)| *nu).collect();
    let sigma = nu
        .iter()
        .map(|nu| sigma_at(*nu, &args.sigma))
        .collect::<Result<Vec<_>>>()?;
    let fit = MbbFit::new(&nu, &sigma)
        .map_err(|cause| Error::usage(format!("the fit is not possible: {cause}")))?;
    let sources = bands
        .iter()
        .map(|(_, spec)| MapSource::parse(spec))
        .collect::<Result<Vec<_>>>()?;

    session.on_threads(0, || {
        let out = RunDir::create(&args.out, args.force)?;
        let maps = sources
            .iter()
            .zip(&nu)
            .map(|(source, &nu)| source.read_as(Role::Intensity(nu)))
            .collect::<Result<Vec<_>>>()?;
        for note in maps.iter().flat_map(|map| &map.notes) {
            session.note(note);
        }
        let nside = common_nside(&bands, &maps)?;
        let values: Vec<&[f64]> = maps.iter().map(|map| map.values.as_slice()).collect();
        let (fitted, counts) = fit_maps(session.level, &fit, &values)?;
        for ((name, quantity, unit), map) in PRODUCTS.into_iter().zip(&fitted) {
            out.map(name, quantity, unit, nside, map, Dtype::F64)?;
        }
        let (t_mean, t_std) = mean_std(&fitted[1]);
        let (beta_mean, beta_std) = mean_std(&fitted[2]);
        let mut manifest = Manifest::new("fit", nside);
        session.level.name().clone_into(&mut manifest.simd);
        manifest.inputs = bands.iter().zip(&maps).map(|((nu, spec), map)| record(*nu, spec, map)).collect();
        manifest.mbb_fit_observed = Some(FitStatistics { t_mean, t_std, beta_mean, beta_std });
        manifest.counts.unconverged_fits = counts.total() - counts.fitted;
        out.finish(manifest)?;
        if session.is_quiet() {
            return Ok(());
        }
        print(&format!(
            "fitted {} of {} pixels ({} without all intensities, {} not converged, {} with χ² above 50)\nT    {t_mean:.4} ± {t_std:.4} K\nβ    {beta_mean:.4} ± {beta_std:.4}\n",
            counts.fitted, counts.total(), counts.missing, counts.unconverged, counts.poor
        ))
    })
}

const PRODUCTS: [(&str, &str, &str); 4] = [
    ("tau", "optical depth at 353 GHz", "1"),
    ("T", "dust temperature", "K"),
    ("beta", "dust spectral index", "1"),
    ("chi2", "χ² of the fit", "1"),
];

/// τ, T, β, χ² in every pixel, on all threads.
fn fit_maps(level: Level, fit: &MbbFit, maps: &[&[f64]]) -> Result<(Vec<Vec<f64>>, FitCounts)> {
    let npix = maps.first().map_or(0, |map| map.len());
    let mut out = vec![vec![0.0; npix]; PRODUCTS.len()];
    let parts = parallel::for_columns(&mut out, |range, columns| {
        let maps: Vec<&[f64]> = maps.iter().map(|map| &map[range.clone()]).collect();
        let Ok([tau, t, beta, chi2]) = <[&mut [f64]; 4]>::try_from(columns) else {
            return Err(crate::kernels::Error::Length {
                what: "maps of the fit",
                expected: 4,
                got: 0,
            });
        };
        fit_into(level, fit, &maps, tau, t, beta, Some(chi2))
    });
    let mut counts = FitCounts::default();
    for part in parts {
        counts += part?;
    }
    Ok((out, counts))
}

fn common_nside(bands: &[(f64, String)], maps: &[MapFile]) -> Result<u32> {
    let (first, rest) = maps
        .split_first()
        .ok_or_else(|| Error::usage("--map is needed at least three times"))?;
    for (map, (_, spec)) in rest.iter().zip(&bands[1..]) {
        if map.nside != first.nside {
            return Err(Error::input(format!(
                "`{}` has Nside {} and `{spec}` has {}; bring them to one Nside first (dust3d map degrade)",
                bands[0].1, first.nside, map.nside
            )));
        }
    }
    Ok(first.nside)
}

fn record(nu_ghz: f64, spec: &str, map: &MapFile) -> InputRecord {
    InputRecord {
        name: format!("I_{nu_ghz}"),
        path: Some(spec.to_owned()),
        nside: map.nside,
        unit: "MJy/sr".to_owned(),
        blake3: map.blake3.clone(),
    }
}

/// The uncertainty given for a frequency, or the default one of a band within a percent of it.
fn sigma_at(nu: f64, given: &[(f64, f64)]) -> Result<f64> {
    let default = Fit::default();
    let defaults = default
        .nu_ghz
        .iter()
        .copied()
        .zip(default.sigma.iter().copied());
    given
        .iter()
        .copied()
        .find(|(at, _)| *at == nu)
        .or_else(|| {
            defaults
                .into_iter()
                .find(|(at, _)| (at / nu - 1.0).abs() < 0.01)
        })
        .map(|(_, sigma)| sigma)
        .ok_or_else(|| {
            Error::usage(format!(
                "no uncertainty is known at {nu} GHz; give one, as in --sigma {nu}:0.05"
            ))
        })
}

fn band(text: &str) -> std::result::Result<(f64, String), String> {
    let (nu, file) = text
        .split_once(':')
        .ok_or("FREQ:FILE is needed, as in 353:I_353.f64")?;
    Ok((frequency(nu)?, file.to_owned()))
}

fn sigma(text: &str) -> std::result::Result<(f64, f64), String> {
    let (nu, sigma) = text
        .split_once(':')
        .ok_or("FREQ:SIGMA is needed, as in 353:0.0078")?;
    match sigma.parse() {
        Ok(sigma) if sigma > 0.0 && f64::is_finite(sigma) => Ok((frequency(nu)?, sigma)),
        _ => Err("the relative uncertainty must be a number above 0".to_owned()),
    }
}
