//! `dust3d map spectrum`.

use super::super::print;
use super::super::session::Session;
use super::harmonics::Maps;
use super::mask;
use crate::cut_sky::Master;
use crate::error::Result;
use crate::io::fits::write::{self as fits, Provenance};
use crate::io::output::write_atomically;
use crate::kernels::healpix::Nside;
use crate::kernels::spectra::cross_spectrum;
use crate::sht::{ShtPlan, Spectra};
use std::fmt::Write;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  dust3d map spectrum I_353.f64\n  dust3d map spectrum I_353.f64 Q_353.f64 U_353.f64 --lmax 128 --out cl.csv\n\n  dust3d map spectrum I.f64 Q.f64 U.f64 --mask sky70.f64 --master 16\n\nC_l = Σ_m |a_lm|²/(2l+1), full sky unless --mask is given; missing pixels count as no fluctuation, without a factor for the sky fraction."
)]
pub(in super::super) struct Args {
    /// I, or I Q U
    #[arg(required = true, num_args = 1..=3, value_name = "MAP")]
    maps: Vec<String>,
    /// Band limit, at most 4 Nside [default: 2 Nside]
    #[arg(long, value_name = "L")]
    lmax: Option<usize>,
    /// Jacobi iterations of the analysis
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u16).range(0..=100))]
    iter: u16,
    /// Weights of the sky, 0 to 1 (dust3d map mask makes some): spectra of the weighted maps, divided by the mean squared
    /// weight; intensity without its weighted mean
    #[arg(long, value_name = "MAP")]
    mask: Option<String>,
    /// Undo the coupling by the mask (MASTER): l(l+1)C_l/2π in bands of so many multipoles
    #[arg(long, value_name = "WIDTH", requires = "mask", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    master: Option<u32>,
    /// Write the table here instead of printing it: CSV, or .fits that healpy's read_cl reads
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

pub(super) fn execute(args: &Args, session: &Session) -> Result<()> {
    let mut maps = Maps::read(&args.maps)?;
    let lmax = maps.lmax(args.lmax)?;
    if maps.missing > 0 {
        session.note(&format!(
            "{} missing pixels count as no fluctuation",
            maps.missing
        ));
    }
    let unit = maps.maps[0].unit.clone();
    let weights = args
        .mask
        .as_deref()
        .map(|spec| mask::read(spec, maps.nside))
        .transpose()?;
    if let Some(weights) = &weights {
        maps.weigh(weights);
    }
    let nside = maps.nside;
    let coefficients = maps.analyse(lmax, args.iter.into(), session.level)?;
    let pairs: &[(&str, usize, usize)] = match coefficients.alms.len() {
        3 => &[
            ("TT", 0, 0),
            ("EE", 1, 1),
            ("BB", 2, 2),
            ("TE", 0, 1),
            ("EB", 1, 2),
            ("TB", 0, 2),
        ],
        _ => &[("TT", 0, 0)],
    };
    let mut spectra = Vec::new();
    let mut text = "l".to_owned();
    for (name, a, b) in pairs {
        let mut spectrum = vec![0.0; coefficients.lmax + 1];
        cross_spectrum(
            &coefficients.alms[*a],
            &coefficients.alms[*b],
            &mut spectrum,
        )?;
        spectra.push(spectrum);
        let _ = write!(text, ",{name}");
    }
    if let Some((weights, width)) = weights.as_ref().zip(args.master) {
        let plan = ShtPlan::new(Nside::new(nside.into())?, lmax, session.level)?;
        let text = decoupled(&Master::new(&plan, weights, width as usize)?, &spectra)?;
        return match &args.out {
            Some(path) => write_atomically(path, text.as_bytes()),
            None => print(&text),
        };
    }
    if let Some(weights) = &weights {
        let square = weights.mean_square();
        spectra.iter_mut().flatten().for_each(|c| *c /= square);
    }
    if let Some(path) = args.out.as_deref().filter(|path| is_fits(path)) {
        return write_fits(path, pairs, &spectra, unit.as_deref());
    }
    text.push('\n');
    for l in 0..=coefficients.lmax {
        let _ = write!(text, "{l}");
        for spectrum in &spectra {
            let _ = write!(text, ",{:e}", spectrum[l]);
        }
        text.push('\n');
    }
    match &args.out {
        Some(path) => write_atomically(path, text.as_bytes()),
        None => print(&text),
    }
}

/// Band powers as a table: the multipoles of each band and l(l+1)C_l/2π.
fn decoupled(master: &Master, spectra: &[Vec<f64>]) -> Result<String> {
    let zero = vec![0.0; spectra[0].len()];
    let get = |index: usize| spectra.get(index).unwrap_or(&zero).clone();
    let weighted = Spectra {
        tt: get(0),
        ee: get(1),
        bb: get(2),
        te: get(3),
    };
    let found = master.band_powers(&weighted)?;
    let powers = [
        ("TT", &found.powers.tt),
        ("EE", &found.powers.ee),
        ("BB", &found.powers.bb),
        ("TE", &found.powers.te),
    ];
    let powers = if spectra.len() == 1 {
        &powers[..1]
    } else {
        &powers
    };
    let mut text = "l_first,l_last".to_owned();
    for (name, _) in powers {
        let _ = write!(text, ",{name}");
    }
    text.push('\n');
    for (b, band) in found.bands.iter().enumerate() {
        let _ = write!(text, "{},{}", band.start, band.end - 1);
        for (_, power) in powers {
            let _ = write!(text, ",{:e}", power[b]);
        }
        text.push('\n');
    }
    Ok(text)
}

fn is_fits(path: &Path) -> bool {
    path.extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("fits"))
}

/// One column per spectrum, with healpy's names.
fn write_fits(
    path: &Path,
    pairs: &[(&str, usize, usize)],
    spectra: &[Vec<f64>],
    unit: Option<&str>,
) -> Result<()> {
    let unit = unit.map(|unit| format!("({unit})^2")).unwrap_or_default();
    let name = |pair: &str| match pair {
        "TT" => "TEMPERATURE",
        "EE" => "GRADIENT",
        "BB" => "CURL",
        "TE" => "G-T",
        "TB" => "C-T",
        _ => "C-G",
    };
    // healpy's order: TT EE BB TE TB EB, unlike that of the table.
    let mut columns: Vec<_> = pairs
        .iter()
        .zip(spectra)
        .map(|((pair, _, _), values)| (name(pair), unit.as_str(), values.as_slice()))
        .collect();
    if columns.len() == 6 {
        columns.swap(4, 5);
    }
    let mut bytes = Vec::new();
    fits::spectra(&columns, &Provenance::default(), &mut |part| {
        bytes.extend_from_slice(part);
        Ok(())
    })?;
    write_atomically(path, &bytes)
}
