//! Reading of stored reference vectors (`tests/data`).

/// The numbers of every row of a text table; rows that start with `#` are comments.
///
/// # Panics
/// If something is not a number: the table is part of the tests.
pub fn rows(table: &str) -> Vec<Vec<f64>> {
    table
        .lines()
        .filter(|line| !line.starts_with('#') && !line.trim().is_empty())
        .map(|line| {
            line.split_whitespace()
                .map(|x| x.parse().unwrap_or_else(|_| panic!("not a number: {x}")))
                .collect()
        })
        .collect()
}

/// The error of `got` in units of the last place of `value`, the exact result being `value + rest`.
pub fn ulps(got: f64, value: f64, rest: f64) -> f64 {
    if got.is_nan() || !value.is_finite() {
        return f64::INFINITY;
    }
    let ulp = f64::from_bits(value.abs().to_bits() + 1) - value.abs();
    (((got - value) - rest) / ulp).abs()
}

/// |got / (value + rest) − 1|.
pub fn relative(got: f64, value: f64, rest: f64) -> f64 {
    if got.is_nan() {
        return f64::INFINITY;
    }
    (((got - value) - rest) / value).abs()
}
