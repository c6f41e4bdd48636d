//! Which column of a table is meant, and the factor that brings its unit to the one wanted.

use super::column::{Column, Element};
use super::hdu::Hdu;
use super::rows::Wanted;
use super::select::Selection;
use super::sky::{Indexing, Sky};
use crate::error::Result;
use crate::io::role::{Meaning, Role};

/// The column that `selection` or else `role` asks for.
pub(super) fn choose<'a>(
    hdu: &Hdu,
    columns: &'a [Column],
    indexing: Indexing,
    selection: &Selection,
    role: Option<Role>,
) -> Result<Wanted<'a>> {
    let is_pixel = |column: &Column| indexing == Indexing::Column(column.number);
    let numbers: Vec<Wanted<'a>> = columns
        .iter()
        .filter(|column| !is_pixel(column))
        .filter_map(|column| {
            Some(Wanted {
                column,
                element: column.element?,
            })
        })
        .collect();
    let found = match (&selection.column, role) {
        (Some(asked), _) => return explicit(hdu, columns, &numbers, asked),
        (None, None) => numbers.first(),
        (None, Some(role)) => by_role(&numbers, role),
    };
    match (found, role) {
        (Some(&wanted), _) => Ok(wanted),
        (None, Some(role)) if !numbers.is_empty() => Err(hdu.place().error(format_args!(
            "none of its columns {} is plainly {}; say which one, as in file.fits[NAME] or file.fits[2]",
            list(columns),
            role.title()
        ))),
        (None, _) => Err(hdu.place().error(
            "it holds no column or plane of numbers of HEALPix length; name another HDU, as in file.fits[HDU=2]",
        )),
    }
}

/// The column of that name, or else of that number.
fn explicit<'a>(
    hdu: &Hdu,
    columns: &[Column],
    numbers: &[Wanted<'a>],
    asked: &str,
) -> Result<Wanted<'a>> {
    let is_meant = |column: &Column| {
        column.name.eq_ignore_ascii_case(asked) || asked.parse() == Ok(column.number)
    };
    let by_name = |wanted: &&Wanted<'_>| wanted.column.name.eq_ignore_ascii_case(asked);
    if let Some(&wanted) = numbers
        .iter()
        .find(by_name)
        .or_else(|| numbers.iter().find(|wanted| is_meant(wanted.column)))
    {
        return Ok(wanted);
    }
    match columns.iter().find(|column| is_meant(column)) {
        Some(column) if column.element.is_some() => Err(hdu.place().error(format_args!(
            "{} holds the numbers of the pixels, not a map; choose another of {}",
            column.title(),
            list(columns)
        ))),
        Some(column) => hdu.place().refuse(
            &format!("TFORM{}", column.number),
            format_args!(
                "{} ('{}') holds no numbers that can be read as a map (types L, B, I, J, K, E, D); choose another of {}",
                column.title(),
                column.form,
                list(columns)
            ),
        ),
        None => Err(hdu.place().error(format_args!(
            "there is no column `{asked}`; it has {} (numbers count from 1)",
            list(columns)
        ))),
    }
}

/// What its name says, else what its place says.
fn by_role<'a, 'b>(numbers: &'b [Wanted<'a>], role: Role) -> Option<&'b Wanted<'a>> {
    let meaning = |wanted: &Wanted<'_>| role.meaning(&wanted.column.name);
    if let Some(wanted) = numbers.iter().find(|w| meaning(w) == Meaning::Wanted) {
        return Some(wanted);
    }
    let neutral = |wanted: &&Wanted<'_>| meaning(wanted) == Meaning::Neutral;
    let nameless = |wanted: &Wanted<'_>| {
        let name = &wanted.column.name;
        name.is_empty() || name.to_ascii_uppercase().starts_with("COLUMN_")
    };
    match (role, numbers) {
        (_, [only]) => Some(only).filter(neutral),
        (Role::Intensity(_), [first, ..]) => Some(first).filter(neutral),
        // Columns without names: I, Q, U by convention.
        (Role::StokesQ(_), [_, q, _, ..]) if numbers.iter().all(nameless) => Some(q),
        (Role::StokesU(_), [_, _, u, ..]) if numbers.iter().all(nameless) => Some(u),
        _ => None,
    }
}

fn list(columns: &[Column]) -> String {
    const MOST: usize = 20;
    let mut names: Vec<String> = columns
        .iter()
        .take(MOST)
        .map(|column| match column.name.as_str() {
            "" => column.number.to_string(),
            name => format!("{} {name}", column.number),
        })
        .collect();
    if columns.len() > MOST {
        names.push("…".to_owned());
    }
    names.join(", ")
}

/// The column that belongs to Q or U: rotated, each becomes a mixture of both.
pub(super) fn partner<'a>(
    hdu: &Hdu,
    columns: &'a [Column],
    sky: &Sky,
    of: Wanted<'_>,
    stokes: Option<char>,
    role: Option<Role>,
) -> Result<Wanted<'a>> {
    let ghz = match role {
        Some(Role::StokesQ(ghz) | Role::StokesU(ghz)) => ghz,
        _ => f64::NAN,
    };
    let (role, letter) = match stokes {
        Some('Q') => (Role::StokesU(ghz), 'U'),
        _ => (Role::StokesQ(ghz), 'Q'),
    };
    choose(hdu, columns, sky.indexing, &Selection::default(), Some(role))
        .ok()
        .filter(|other| other.column.number != of.column.number)
        .ok_or_else(|| {
            hdu.place().keyword(
                "COORDSYS",
                format_args!(
                    "the map is in {} coordinates; to rotate {}, the Stokes {letter} that belongs to it is needed in a column of that name, and there is none among {}",
                    sky.frame.name(),
                    of.column.title(),
                    list(columns)
                ),
            )
        })
}

/// The factor from the unit of the column to that of `role`, and a note if the unit had to be assumed.
pub(super) fn unit_factor(
    hdu: &Hdu,
    column: &Column,
    selection: &Selection,
    role: Role,
) -> Result<(f64, Option<String>)> {
    let stated = selection.unit.as_deref().or_else(|| known_unit(column));
    let key = format!("TUNIT{}", column.number);
    let dimensionless = matches!(role, Role::OpticalDepth | Role::SpectralIndex);
    let Some(unit) = stated else {
        let note = (!dimensionless).then(|| {
            format!(
                "{}: no {key}, {} is assumed (otherwise: file.fits[unit=…])",
                hdu.place(),
                role.unit()
            )
        });
        return Ok((1.0, note));
    };
    match role.factor(unit) {
        Some(factor) => Ok((factor, None)),
        None => hdu.place().refuse(
            &key,
            format_args!(
                "'{unit}' is no unit of {}; {}",
                role.title(),
                match role {
                    Role::Intensity(_) | Role::StokesQ(_) | Role::StokesU(_) =>
                        "say which of MJy/sr, Jy/sr, K_RJ, mK_RJ, uK_RJ, K_CMB, mK_CMB, uK_CMB it is, as in file.fits[I_STOKES][unit=K_CMB]",
                    Role::Temperature => "it must be K; if it is, say so as in file.fits[TEMP][unit=K]",
                    Role::Reddening => "it must be mag; if it is, say so as in file.fits[EBV][unit=mag]",
                    Role::OpticalDepth | Role::SpectralIndex =>
                        "it has none; if that is so, say it as in file.fits[TAU353][unit=1]",
                }
            ),
        ),
    }
}

/// TUNITn, unless it says only that nobody knows.
pub(super) fn known_unit(column: &Column) -> Option<&str> {
    let unit = column.unit.as_deref()?.trim();
    let nothing = ["", "none", "unknown", "undefined", "n/a", "na", "unitless"];
    (!nothing.contains(&unit.to_ascii_lowercase().as_str())).then_some(unit)
}

/// The column with the numbers of the pixels.
pub(super) fn pixels(columns: &[Column], number: usize) -> Option<Wanted<'_>> {
    let column = columns.get(number.checked_sub(1)?)?;
    let element: Element = column.element?;
    Some(Wanted { column, element })
}
