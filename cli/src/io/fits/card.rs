//! One header card: 80 characters, keyword and value (FITS standard 4.0, §4.1–4.2).

/// Length of a card.
pub(super) const CARD: usize = 80;

/// The value of a keyword.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    /// A string without its quotes and trailing blanks.
    Text(String),
    Integer(i64),
    Real(f64),
    Logical(bool),
    /// Nothing between `=` and the comment.
    Undefined,
    /// What is no value of the standard, as it stands there.
    Broken(String),
}

/// Keyword and value; `None` for comments, blanks and what has no value.
pub(super) fn parse(card: &[u8; CARD]) -> Option<(String, Value)> {
    let (keyword, rest) = card.split_at(8);
    let value = rest.strip_prefix(b"= ")?;
    let keyword = keyword.trim_ascii_end();
    let valid = |c: &u8| c.is_ascii_uppercase() || c.is_ascii_digit() || matches!(c, b'-' | b'_');
    if keyword.is_empty() || !keyword.iter().all(valid) {
        return None;
    }
    let keyword = String::from_utf8_lossy(keyword).into_owned();
    Some((keyword, parse_value(value)))
}

fn parse_value(field: &[u8]) -> Value {
    let shown = || Value::Broken(String::from_utf8_lossy(field).trim().to_owned());
    // A byte that is no character of the standard: the card is damaged, whatever else it seems to say.
    if !field.iter().all(|c| (b' '..=b'~').contains(c)) {
        return shown();
    }
    let text = field.trim_ascii_start();
    if let Some(quoted) = text.strip_prefix(b"'") {
        return parse_text(quoted).unwrap_or_else(shown);
    }
    let token = text.split(|&c| c == b'/').next().unwrap_or_default();
    let Ok(token) = str::from_utf8(token.trim_ascii()) else {
        return shown();
    };
    match token {
        "" => Value::Undefined,
        "T" => Value::Logical(true),
        "F" => Value::Logical(false),
        _ => parse_number(token).unwrap_or_else(shown),
    }
}

/// What stands before the closing quote; two quotes are one character.
fn parse_text(quoted: &[u8]) -> Option<Value> {
    let mut text = String::new();
    let mut characters = quoted.iter().copied().peekable();
    loop {
        match characters.next()? {
            b'\'' if characters.peek() == Some(&b'\'') => {
                characters.next();
                text.push('\'');
            }
            b'\'' => break,
            c => text.push(char::from(c)),
        }
    }
    text.truncate(text.trim_end_matches(' ').len());
    Some(Value::Text(text))
}

/// An integer or a real; FITS allows `D` for the exponent.
fn parse_number(token: &str) -> Option<Value> {
    if let Ok(integer) = token.parse() {
        return Some(Value::Integer(integer));
    }
    let numeric = |c: u8| c.is_ascii_digit() || b"+-.EeDd".contains(&c);
    if !token.bytes().all(numeric) {
        return None;
    }
    let real: f64 = token.replace(['D', 'd'], "E").parse().ok()?;
    real.is_finite().then_some(Value::Real(real))
}
