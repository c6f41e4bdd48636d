//! Harmonic coefficients and spectra, as healpy's `read_alm` and `read_cl` read them.

use super::cards::Cards;
use super::provenance::Provenance;
use super::table::{Field, describe, pad, rows};
use crate::config::Dtype;
use crate::error::{Error, Result};
use crate::kernels::Complex;

/// The file of coefficients: one HDU for each of `fields` (name such as `T`, `E`, `B`; values in healpy's order, m-major,
/// m ≥ 0), with columns INDEX = l² + l + m + 1, REAL and IMAG.
///
/// # Errors
/// A length that is not (lmax + 1)(lmax + 2)/2, an index beyond 32 bits (lmax > 46339), or what the sink returns.
pub fn alm(
    fields: &[(&str, &[Complex<f64>])],
    lmax: usize,
    unit: &str,
    provenance: &Provenance,
    sink: &mut dyn FnMut(&[u8]) -> Result<()>,
) -> Result<()> {
    let count = (lmax + 1) * (lmax + 2) / 2;
    if lmax > 46339 {
        return Err(Error::input(format!(
            "lmax = {lmax} is more than the 46339 that the index column of FITS coefficients can hold; write them raw"
        )));
    }
    sink(&Cards::primary())?;
    for (name, values) in fields {
        if values.len() != count {
            return Err(Error::input(format!(
                "{name} has {} coefficients, but lmax = {lmax} means {count}",
                values.len()
            )));
        }
        let mut cards = Cards::table(4 + 8 + 8, count, 3);
        describe(&mut cards, 1, "INDEX", "1J", "l*l+l+m+1");
        describe(&mut cards, 2, "REAL", "1D", unit);
        describe(&mut cards, 3, "IMAG", "1D", unit);
        cards.text("EXTNAME", name, "");
        cards.text("PDMTYPE", "ALM", "harmonic coefficients");
        cards.integer("MIN-LPOL", 0, "smallest l");
        cards.integer("MAX-LPOL", lmax as u64, "largest l");
        cards.integer("MAX-MPOL", lmax as u64, "largest m");
        let frame = provenance.frame;
        cards.text(
            "COORDSYS",
            frame.letter(),
            &format!("{} coordinates", frame.name()),
        );
        cards.text("POLCCONV", "COSMO", "sign of U");
        provenance.put(&mut cards);
        sink(&cards.finish())?;
        coefficients(values, lmax, sink)?;
        pad(count * 20, sink)?;
    }
    Ok(())
}

fn coefficients(
    values: &[Complex<f64>],
    lmax: usize,
    sink: &mut dyn FnMut(&[u8]) -> Result<()>,
) -> Result<()> {
    let mut bytes = Vec::new();
    let mut values = values.iter();
    for m in 0..=lmax {
        for (l, a) in (m..=lmax).zip(&mut values) {
            // Below 2^31, as lmax was checked.
            bytes.extend_from_slice(&((l * l + l + m + 1) as u32).to_be_bytes());
            bytes.extend_from_slice(&a.re.to_be_bytes());
            bytes.extend_from_slice(&a.im.to_be_bytes());
        }
        sink(&bytes)?;
        bytes.clear();
    }
    Ok(())
}

/// The file of spectra, one column each (name, unit, values from l = 0), one l a row.
///
/// # Errors
/// No spectrum, different lengths, or what the sink returns.
pub fn spectra(
    columns: &[(&str, &str, &[f64])],
    provenance: &Provenance,
    sink: &mut dyn FnMut(&[u8]) -> Result<()>,
) -> Result<()> {
    let fields: Vec<_> = columns
        .iter()
        .map(|&(name, unit, values)| Field { name, unit, values })
        .collect();
    let count = fields.first().map_or(0, |field| field.values.len());
    if count == 0 || fields.iter().any(|field| field.values.len() != count) {
        return Err(Error::input(
            "spectra in one file must all begin at l = 0 and end at one lmax",
        ));
    }
    let mut cards = Cards::table(8 * fields.len(), count, fields.len());
    for (number, field) in (1..).zip(&fields) {
        describe(&mut cards, number, field.name, "1D", field.unit);
    }
    cards.text("EXTNAME", "SPECTRA", "");
    cards.text("PDMTYPE", "POWERMAP", "power spectra");
    cards.integer("MIN-LPOL", 0, "smallest l");
    cards.integer("MAX-LPOL", count as u64 - 1, "largest l");
    provenance.put(&mut cards);
    sink(&Cards::primary())?;
    sink(&cards.finish())?;
    rows(&fields, 1, Dtype::F64, sink)
}
