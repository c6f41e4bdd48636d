//! What a report consists of: figures with their panels, numbers and comparisons, and the checks of the verdict.

use crate::plot::{Chart, Colours, Scale, View};
use serde::Serialize;
use std::fmt::Write as _;

/// A figure or table of the report.
#[derive(Debug, Clone, Default)]
pub(super) struct Figure {
    /// Name of its files, and its place in the page.
    pub(super) id: &'static str,
    /// As the paper calls it, such as `Figure 4`; empty for what the paper has not.
    pub(super) paper: &'static str,
    /// Its heading.
    pub(super) title: String,
    /// What is shown, and how it was computed.
    pub(super) caption: String,
    /// What to look for.
    pub(super) look: String,
    /// Panels side by side, on a wide screen.
    pub(super) columns: usize,
    /// The pictures.
    pub(super) panels: Vec<Panel>,
    /// Numbers to be read in the page.
    pub(super) tables: Vec<Table>,
    /// Numbers in files: name without extension, content.
    pub(super) csv: Vec<(String, String)>,
    /// The paper's own values beside these.
    pub(super) comparisons: Vec<Comparison>,
    /// Why it, or a part of it, is not there and how to have it.
    pub(super) lacking: String,
}

/// A picture of a figure.
#[derive(Debug, Clone)]
pub(super) enum Panel {
    /// A map.
    Map(MapPanel),
    /// A diagram.
    Chart(Chart),
}

/// A map with how to show it.
#[derive(Debug, Clone)]
pub(super) struct MapPanel {
    /// Resolution.
    pub(super) nside: u32,
    /// RING order.
    pub(super) values: Vec<f64>,
    /// Above the map.
    pub(super) title: String,
    /// Below the colour bar.
    pub(super) unit: &'static str,
    /// From values to colours.
    pub(super) scale: Scale,
    /// The colours.
    pub(super) colours: Colours,
    /// The part of the sky.
    pub(super) view: View,
}

/// Numbers in rows.
#[derive(Debug, Clone, Default)]
pub(super) struct Table {
    /// Names of the columns.
    pub(super) head: Vec<String>,
    /// The first cell of a row is its name.
    pub(super) rows: Vec<Vec<String>>,
}

/// A value of the paper beside that of the run.
#[derive(Debug, Clone, Serialize)]
pub struct Comparison {
    /// Which quantity.
    pub quantity: String,
    /// What the paper says.
    pub paper: String,
    /// What the run says.
    pub run: String,
    /// Whether they agree; null where that cannot be said.
    pub agrees: Option<bool>,
    /// Why they may differ.
    pub why: String,
}

/// How a check ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// It holds.
    Pass,
    /// It does not.
    Fail,
    /// The run does not hold what is needed to say.
    NotAvailable,
}

/// One requirement or invariant.
#[derive(Debug, Clone, Serialize)]
pub struct Check {
    /// Its name in `summary.json`.
    pub id: &'static str,
    /// What is demanded.
    pub demand: String,
    /// The outcome.
    pub status: Status,
    /// What was found, in words.
    pub found: String,
    /// What was found, as numbers by name.
    pub values: serde_json::Map<String, serde_json::Value>,
    /// The figure that shows it.
    pub figure: &'static str,
}

impl Check {
    /// A check that passes or fails.
    #[must_use]
    pub fn new(
        id: &'static str,
        demand: impl Into<String>,
        holds: bool,
        found: String,
        figure: &'static str,
    ) -> Self {
        Self {
            id,
            demand: demand.into(),
            status: if holds { Status::Pass } else { Status::Fail },
            found,
            values: serde_json::Map::new(),
            figure,
        }
    }

    /// A check that cannot be made; `why` says what is lacking and how to have it.
    #[must_use]
    pub fn not_available(
        id: &'static str,
        demand: impl Into<String>,
        why: impl Into<String>,
        figure: &'static str,
    ) -> Self {
        Self {
            status: Status::NotAvailable,
            ..Self::new(id, demand, false, why.into(), figure)
        }
    }

    /// The same check with a number.
    #[must_use]
    pub fn with(mut self, name: &str, value: impl Into<serde_json::Value>) -> Self {
        self.values.insert(name.to_owned(), value.into());
        self
    }
}

impl Figure {
    /// A figure without anything in it yet.
    #[must_use]
    pub(super) fn new(id: &'static str, paper: &'static str, title: &str) -> Self {
        Self {
            id,
            paper,
            title: title.to_owned(),
            columns: 3,
            ..Self::default()
        }
    }

    /// Adds a comparison with the paper.
    pub(super) fn compare(
        &mut self,
        quantity: impl Into<String>,
        paper: impl Into<String>,
        run: impl Into<String>,
        agrees: Option<bool>,
        why: impl Into<String>,
    ) {
        self.comparisons.push(Comparison {
            quantity: quantity.into(),
            paper: paper.into(),
            run: run.into(),
            agrees,
            why: why.into(),
        });
    }

    /// Adds a file of numbers whose rows have names.
    pub(super) fn named_numbers(
        &mut self,
        file: impl Into<String>,
        columns: &[&str],
        rows: &[(String, Vec<f64>)],
    ) {
        let mut text = columns.join(",");
        text.push('\n');
        for (name, values) in rows {
            let _ = write!(text, "\"{name}\"");
            for value in values {
                text.push(',');
                if value.is_finite() {
                    let _ = write!(text, "{}", Shortest(*value));
                }
            }
            text.push('\n');
        }
        self.csv.push((file.into(), text));
    }

    /// Adds a file of numbers.
    pub(super) fn numbers(&mut self, name: impl Into<String>, columns: &[&str], rows: &[Vec<f64>]) {
        let mut text = columns.join(",");
        text.push('\n');
        for row in rows {
            for (index, value) in row.iter().enumerate() {
                if index > 0 {
                    text.push(',');
                }
                if value.is_finite() {
                    let _ = write!(text, "{}", Shortest(*value));
                }
            }
            text.push('\n');
        }
        self.csv.push((name.into(), text));
    }
}

/// A number in the fewest letters that give it back: an integer, a decimal, or with an exponent.
struct Shortest(f64);

impl std::fmt::Display for Shortest {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let size = self.0.abs();
        if size == 0.0 || (1e-3..1e7).contains(&size) {
            write!(f, "{}", self.0)
        } else {
            write!(f, "{:e}", self.0)
        }
    }
}

impl Table {
    /// A table with these columns.
    #[must_use]
    pub(super) fn new(head: &[&str]) -> Self {
        Self {
            head: head.iter().map(|&name| name.to_owned()).collect(),
            rows: Vec::new(),
        }
    }

    /// Adds a row of a name and numbers with so many decimals; what is not finite is a dash.
    pub(super) fn row(&mut self, name: impl Into<String>, values: &[f64], decimals: usize) {
        let mut row = vec![name.into()];
        row.extend(values.iter().map(|value| decimal(*value, decimals)));
        self.rows.push(row);
    }
}

/// A number with so many decimals, or a dash; very large and small ones with an exponent.
#[must_use]
pub(super) fn decimal(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return "–".to_owned();
    }
    let size = value.abs();
    if size != 0.0 && (size < 0.5 * 10.0_f64.powi(-(decimals as i32)) || size >= 1e6) {
        return power(value, 2);
    }
    format!("{value:.decimals$}").replace('-', "−")
}

/// A number as a decimal times a power of ten.
#[must_use]
pub(super) fn power(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$e}");
    let Some((digits, power)) = text.split_once('e') else {
        return text;
    };
    let raised: String = power
        .chars()
        .map(|digit| match digit.to_digit(10) {
            Some(digit) => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][digit as usize],
            None => '⁻',
        })
        .collect();
    format!("{} × 10{raised}", digits.replace('-', "−"))
}
