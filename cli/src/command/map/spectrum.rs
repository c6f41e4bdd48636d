//! `dust3d map spectrum`.

use super::super::print;
use super::super::session::Session;
use super::harmonics::Maps;
use crate::error::Result;
use crate::io::fits::write::{self as fits, Provenance};
use crate::io::output::write_atomically;
use crate::kernels::spectra::cross_spectrum;
use std::fmt::Write;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  dust3d map spectrum I_353.f64\n  dust3d map spectrum I_353.f64 Q_353.f64 U_353.f64 --lmax 128 --out cl.csv\n\nC_l = Σ_m |a_lm|²/(2l+1), full sky; missing pixels count as no fluctuation, without a factor for the sky fraction."
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
    /// Write the table here instead of printing it: CSV, or .fits that healpy's read_cl reads
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

pub(super) fn execute(args: &Args, session: &Session) -> Result<()> {
    let maps = Maps::read(&args.maps)?;
    let lmax = maps.lmax(args.lmax)?;
    if maps.missing > 0 {
        session.note(&format!(
            "{} missing pixels count as no fluctuation",
            maps.missing
        ));
    }
    let unit = maps.maps[0].unit.clone();
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
