//! Bandpasses in tables, as in the reduced instrument models of Planck.

use super::column::Column;
use super::hdu::{Hdu, Kind};
use super::rows::{Wanted, stream_rows};
use super::select::Selection;
use super::stream::Stream;
use crate::error::{Error, Result};
use crate::io::Bandpass;
use crate::kernels::healpix::missing::is_missing;
use crate::kernels::units::C;
use std::path::Path;

/// No bandpass has more rows; a damaged header may.
const MOST_ROWS: u64 = 1 << 20;

/// Reads the table that `selection` names (by its EXTNAME, in either of its places, or number), or the only one there is;
/// and its name.
///
/// # Errors
/// A file that cannot be read, no such table or several, or one that holds no bandpass.
pub(in crate::io) fn read_bandpass(
    path: &Path,
    selection: &Selection,
) -> Result<(Bandpass, String)> {
    let mut stream = Stream::open(path)?;
    let asked = selection.hdu.as_ref().or(selection.column.as_ref());
    let mut found = None;
    let mut seen = Vec::new();
    for number in 0.. {
        let Some(hdu) = Hdu::read(&mut stream, number)? else {
            break;
        };
        let columns = if hdu.kind == Kind::Table {
            hdu.columns()?
        } else {
            Vec::new()
        };
        let name = hdu.place().name.clone().unwrap_or_default();
        let is_asked = asked
            .is_some_and(|asked| name.eq_ignore_ascii_case(asked) || asked.parse() == Ok(number));
        let pair = pair(&columns);
        if is_asked || (asked.is_none() && pair.is_some() && found.is_none()) {
            let Some(pair) = pair else {
                return Err(hdu.place().error(
                    "it holds no bandpass: columns WAVENUMBER or FREQUENCY and TRANSMISSION, RESPONSE or WEIGHT; name another HDU, or write the band as text, GHz and weight",
                ));
            };
            let band = read(&mut stream, &hdu, pair)?;
            let title = name.strip_prefix("BANDPASS_").unwrap_or(&name);
            let stem = path.file_stem().unwrap_or_default().to_string_lossy();
            let title = if title.is_empty() { &stem } else { title };
            let title = title.trim().replace(['/', '\\', ' '], "_");
            if is_asked {
                return Ok((band, title));
            }
            found = Some((band, title));
            seen.push(name);
            hdu.skip_after(&mut stream, hdu.rows * hdu.row_len)?;
        } else {
            if pair.is_some() {
                seen.push(name);
            }
            hdu.skip(&mut stream)?;
        }
    }
    let file = path.display();
    match (found, asked) {
        (Some(found), _) if seen.len() == 1 => Ok(found),
        (Some(_), _) => Err(Error::input(format!(
            "`{file}` holds several bandpasses, {}; say which one, as in {file}[{}]",
            seen.join(", "),
            seen[0]
        ))),
        (None, Some(asked)) => Err(Error::input(format!(
            "`{file}` has no HDU {asked}; its bandpasses are {}",
            if seen.is_empty() {
                "none".to_owned()
            } else {
                seen.join(", ")
            }
        ))),
        (None, None) => Err(Error::input(format!(
            "`{file}` holds no bandpass: no table with columns WAVENUMBER or FREQUENCY and TRANSMISSION, RESPONSE or WEIGHT; give another file, or text of two columns, GHz and weight"
        ))),
    }
}

/// The columns of frequency and response.
fn pair(columns: &[Column]) -> Option<[Wanted<'_>; 2]> {
    let named = |names: &[&str]| {
        let column = columns.iter().find(|column| {
            let name = column.name.trim();
            names.iter().any(|known| name.eq_ignore_ascii_case(known))
        })?;
        Some(Wanted {
            column,
            element: column.element?,
        })
    };
    Some([
        named(&["WAVENUMBER", "FREQUENCY", "FREQ", "NU"])?,
        named(&["TRANSMISSION", "RESPONSE", "WEIGHT", "WEIGHTS"])?,
    ])
}

fn read(stream: &mut Stream<'_>, hdu: &Hdu, pair: [Wanted<'_>; 2]) -> Result<Bandpass> {
    let count = pair.map(|wanted| wanted.column.repeat.saturating_mul(hdu.rows));
    if count[0] != count[1] || count[0] > MOST_ROWS {
        return hdu.place().refuse(
            "NAXIS2",
            format_args!(
                "{} frequencies and {} weights are no bandpass (as many of both, at most {MOST_ROWS}); give another table",
                count[0], count[1]
            ),
        );
    }
    let factor = ghz(hdu, pair[0].column)?;
    let mut table = [Vec::new(), Vec::new()];
    stream_rows(stream, hdu, &pair, |values| {
        for (all, part) in table.iter_mut().zip(values) {
            all.extend_from_slice(part);
        }
        Ok(())
    })?;
    let [nu, weight] = table;
    let mut rows: Vec<[f64; 2]> = Vec::new();
    for (row, (stored, weight)) in (1..).zip(nu.into_iter().zip(weight)) {
        let nu = stored * factor;
        let bad = |what: &str| {
            hdu.place()
                .error(format_args!("row {row} of the bandpass {what}"))
        };
        if !nu.is_finite() || !weight.is_finite() || is_missing(weight) || is_missing(stored) {
            return Err(bad("is no pair of numbers; leave it out"));
        }
        if rows.last().is_some_and(|[before, _]| nu < *before) {
            return Err(bad(
                "has a frequency that is below the one before; sort the table",
            ));
        }
        if nu > 0.0 {
            rows.push([nu, weight]);
        }
    }
    if rows.is_empty() {
        return Err(hdu
            .place()
            .error("the bandpass has no row above frequency 0; give another table"));
    }
    Ok(Bandpass::of_rows(&rows))
}

/// The factor from the unit of the column to GHz.
fn ghz(hdu: &Hdu, column: &Column) -> Result<f64> {
    let wavenumber = column.name.trim().eq_ignore_ascii_case("WAVENUMBER");
    let unit = column.unit.as_deref().unwrap_or_default();
    let plain: String = unit
        .chars()
        .filter(|c| !matches!(c, ' ' | '^' | '*' | '(' | ')' | '{' | '}'))
        .collect();
    match plain.to_ascii_lowercase().as_str() {
        "" if wavenumber => Ok(C * 1e-7),
        "cm-1" | "1/cm" => Ok(C * 1e-7),
        "m-1" | "1/m" => Ok(C * 1e-9),
        "" | "ghz" => Ok(1.0),
        "hz" => Ok(1e-9),
        "mhz" => Ok(1e-3),
        "thz" => Ok(1e3),
        _ => hdu.place().refuse(
            &format!("TUNIT{}", column.number),
            format_args!(
                "'{unit}' is none of cm^-1, m^-1, Hz, MHz, GHz, THz; correct the header, or write the band as text, GHz and weight"
            ),
        ),
    }
}
