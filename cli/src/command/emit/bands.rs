//! What is emitted: frequencies and bandpasses, their names, their beams.

use super::Args;
use crate::config::parse_frequency;
use crate::error::{Error, Result};
use crate::io::Bandpass;
use crate::kernels::planck::bandpass::band_weights_into;
use crate::kernels::planck::mbb::MbbNode;
use crate::kernels::units::{NU0_GHZ, Unit};
use std::collections::HashSet;
use std::path::Path;

/// One map or set of I, Q, U.
pub(super) struct Band {
    /// Its name in files.
    pub(super) name: String,
    /// The frequency, or the one that stands for the band.
    pub(super) ghz: Option<f64>,
    /// A sum over frequencies.
    pub(super) nodes: Vec<MbbNode>,
    /// Beam.
    pub(super) fwhm_rad: f64,
}

/// Those of `--freq` and `--bandpass`, then those of `--band`.
pub(super) fn bands(args: &Args) -> Result<Vec<Band>> {
    let files = files(&args.bandpass);
    let mut bands = Vec::new();
    if files.is_empty() {
        for &nu in &args.freq {
            bands.push(monochromatic(args.unit, nu, None)?);
        }
    } else if args.freq.is_empty() || args.freq.len() == files.len() {
        for (number, file) in files.iter().enumerate() {
            let ghz = args.freq.get(number).copied();
            let name = ghz.map(|nu| format!("{nu}GHz"));
            bands.push(integrated(args.unit, file, name, ghz)?);
        }
    } else {
        return Err(Error::usage(format!(
            "--freq gives {} frequencies and --bandpass {} files; give as many, where each frequency names the band, or bands without a file by --band",
            args.freq.len(),
            files.len()
        )));
    }
    for spec in &args.band {
        bands.push(band(args.unit, spec)?);
    }
    let mut names = HashSet::new();
    if let Some(twice) = bands.iter().find(|band| !names.insert(band.name.clone())) {
        return Err(Error::usage(format!(
            "two bands are called {}; name one of them as in --band NAME=FILE",
            twice.name
        )));
    }
    beams(&args.beam, &mut bands)?;
    Ok(bands)
}

/// Lists separated by commas, which a name may hold all the same if the file is there.
fn files(given: &[String]) -> Vec<String> {
    given
        .iter()
        .flat_map(|list| {
            if Path::new(list).exists() {
                vec![list.clone()]
            } else {
                list.split(',').map(str::to_owned).collect()
            }
        })
        .collect()
}

fn beams(arcmin: &[f64], bands: &mut [Band]) -> Result<()> {
    if let Some(bad) = arcmin.iter().find(|fwhm| !(0.0..=10_800.0).contains(*fwhm)) {
        return Err(Error::usage(format!(
            "--beam {bad} is not possible; give a FWHM in arcmin from 0 to 10800"
        )));
    }
    if arcmin.len() > 1 && arcmin.len() != bands.len() {
        return Err(Error::usage(format!(
            "--beam gives {} beams for {} bands; give one for all, or one for each",
            arcmin.len(),
            bands.len()
        )));
    }
    for (number, band) in bands.iter_mut().enumerate() {
        let fwhm = arcmin.get(number).or(arcmin.first());
        band.fwhm_rad = (fwhm.copied().unwrap_or(0.0) / 60.0).to_radians();
    }
    Ok(())
}

/// `[NAME=]NU|FILE`.
fn band(unit: Unit, spec: &str) -> Result<Band> {
    // `=` may also belong to the name of a file, or to file.fits[HDU=…].
    let (name, what) = match spec.split_once('=') {
        Some((name, what)) if !Path::new(spec).exists() && !name.contains('[') => {
            (Some(name.to_owned()), what)
        }
        _ => (None, spec),
    };
    if let Some(name) = &name
        && (name.is_empty() || name.contains(['/', '\\']) || name.starts_with('.'))
    {
        return Err(Error::usage(format!(
            "--band {spec}: the name `{name}` cannot be part of the name of a file; choose letters and digits"
        )));
    }
    match parse_frequency(what) {
        Some(nu) => monochromatic(unit, nu, name),
        None => integrated(unit, what, name, None),
    }
}

fn monochromatic(unit: Unit, nu: f64, name: Option<String>) -> Result<Band> {
    let factor = unit
        .from_mjysr(nu)
        .map_err(|cause| Error::usage(format!("{nu} GHz in {unit}: {cause}")))?;
    Ok(Band {
        name: name.unwrap_or_else(|| format!("{nu}GHz")),
        ghz: Some(nu),
        nodes: vec![MbbNode::new(nu, NU0_GHZ, factor)?],
        fwhm_rad: 0.0,
    })
}

fn integrated(unit: Unit, spec: &str, name: Option<String>, ghz: Option<f64>) -> Result<Band> {
    let (band, own_name) = Bandpass::read(Path::new(spec))?;
    let mut weights = vec![0.0; band.nu_ghz.len()];
    band_weights_into(unit, &band.nu_ghz, &band.weight, &mut weights)
        .map_err(|cause| Error::input(format!("{spec}: {cause}")))?;
    let nodes = band.nu_ghz.iter().zip(weights);
    Ok(Band {
        name: name.unwrap_or(own_name),
        ghz,
        nodes: nodes
            .filter(|(_, weight)| *weight != 0.0)
            .map(|(&nu, weight)| Ok(MbbNode::new(nu, NU0_GHZ, weight)?))
            .collect::<Result<_>>()?,
        fwhm_rad: 0.0,
    })
}
