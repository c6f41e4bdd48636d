//! The page: one HTML file that needs nothing else, neither scripts nor a network.

use super::Listed;
use super::figure::{Check, Status};
use super::render::prose;
use crate::io::Manifest;
use crate::plot::base64;
use crate::plot::svg::{FONT_FAMILY, escape};
use crate::plot::text::FONT;
use std::fmt::Write as _;

const STYLE: &str = include_str!("style.css");

/// An entry of the contents.
pub(super) struct Entry {
    pub(super) id: &'static str,
    pub(super) paper: &'static str,
    pub(super) title: String,
    pub(super) lacking: bool,
}

/// The whole page.
pub(super) fn page(
    manifest: &Manifest,
    name: &str,
    checks: &[Check],
    comparisons: &[Listed],
    entries: &[Entry],
    sections: &str,
) -> String {
    let title = format!("dust3d report: {}", escape(name));
    let mut html = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
         <meta name=\"color-scheme\" content=\"light dark\">\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'; font-src data:\">\
         <link rel=\"icon\" href=\"data:,\"><title>{title}</title><style>\
         @font-face{{font-family:{FONT_FAMILY};src:url(data:font/ttf;base64,{}) format(\"truetype\")}}\n{STYLE}</style></head><body>\n<main>\n",
        base64::encode(FONT)
    );
    let _ = writeln!(
        html,
        "<header><h1>{title}</h1><p>{}</p></header>",
        facts(manifest)
    );
    html.push_str(&verdict(checks));
    html.push_str(&beside_the_paper(comparisons));
    html.push_str(&contents(entries));
    html.push_str(sections);
    html.push_str("<footer><p>The model and the figures follow Martínez-Solaeche, Karakci &amp; Delabrouille, “A 3-D model of polarised dust emission in the Milky Way”, MNRAS 476, 1310 (2018), “the paper” above. Maps are in Galactic coordinates, l = 0 in the middle and increasing to the left; polarisation is in the HEALPix (COSMO) convention. The same numbers for programs: <a href=\"summary.json\">summary.json</a>, <a href=\"manifest.json\">manifest.json</a>.</p></footer>\n</main></body></html>\n");
    html
}

fn facts(manifest: &Manifest) -> String {
    let mut text = format!("Nside {}", manifest.nside);
    if let Some(lmax) = manifest.lmax {
        let _ = write!(text, ", lmax {lmax}");
    }
    if let Some(layers) = manifest.layers {
        let _ = write!(text, ", {layers} layers");
    }
    if let Some(seed) = manifest.seed {
        let _ = write!(text, ", seed {seed}");
    }
    text.push_str(if manifest.synthetic_inputs == Some(true) {
        ", built-in synthetic sky"
    } else {
        ", observed maps"
    });
    let _ = write!(
        text,
        "; made {} by dust3d {}.",
        escape(manifest.created.split('.').next().unwrap_or_default()),
        escape(&manifest.version)
    );
    text
}

/// How the checks ended, in one sentence.
pub(super) fn outcome(checks: &[Check]) -> String {
    let count = |status: Status| checks.iter().filter(|check| check.status == status).count();
    let (pass, fail, open) = (
        count(Status::Pass),
        count(Status::Fail),
        count(Status::NotAvailable),
    );
    let mut text = match (fail, open) {
        (0, 0) => format!("All {pass} checks pass"),
        (0, _) => format!("{pass} checks pass, none fails"),
        (1, _) => format!("1 check fails, {pass} pass"),
        _ => format!("{fail} checks fail, {pass} pass"),
    };
    if open > 0 {
        let _ = write!(text, ", {open} could not be made");
    }
    text.push('.');
    text
}

fn verdict(checks: &[Check]) -> String {
    let failed = checks.iter().any(|check| check.status == Status::Fail);
    let mut html = format!(
        "<section id=\"verdict\" class=\"{}\"><h2>Verdict</h2><p class=\"outcome\">{}</p><ul class=\"checks\">",
        if failed { "failed" } else { "passed" },
        outcome(checks)
    );
    for check in checks {
        let (class, word) = match check.status {
            Status::Pass => ("pass", "pass"),
            Status::Fail => ("fail", "fail"),
            Status::NotAvailable => ("none", "not made"),
        };
        let _ = write!(
            html,
            "<li><span class=\"badge {class}\">{word}</span><div><a href=\"#{}\">{}</a><br><span class=\"found\">{}</span></div></li>",
            check.figure,
            prose(&capital(&check.demand)),
            prose(&capital(&check.found))
        );
    }
    html.push_str("</ul></section>\n");
    html
}

/// All values that the paper states, beside the run's.
fn beside_the_paper(comparisons: &[Listed]) -> String {
    if comparisons.is_empty() {
        return String::new();
    }
    let agree = |wanted: bool| {
        let outcomes = comparisons.iter().filter_map(|item| item.comparison.agrees);
        outcomes.filter(|agrees| *agrees == wanted).count()
    };
    let mut html = format!(
        "<section id=\"paper\"><h2>Beside the paper</h2><p>{} of the values that the paper states agree with this run, {} differ; each figure below says why they may.</p><div class=\"scroll\"><table><thead><tr><th>quantity</th><th>paper</th><th>this run</th><th></th></tr></thead><tbody>",
        agree(true),
        agree(false)
    );
    for Listed { figure, comparison } in comparisons {
        let (class, word) = match comparison.agrees {
            Some(true) => ("pass", "agrees"),
            Some(false) => ("differs", "differs"),
            None => ("none", "given"),
        };
        let _ = write!(
            html,
            "<tr><th><a href=\"#{figure}\">{}</a></th><td>{}</td><td>{}</td><td><span class=\"badge {class}\">{word}</span></td></tr>",
            prose(&comparison.quantity),
            prose(&comparison.paper),
            prose(&comparison.run)
        );
    }
    html.push_str("</tbody></table></div></section>\n");
    html
}

fn contents(entries: &[Entry]) -> String {
    let mut html = String::from("<nav aria-label=\"Contents\"><h2>Contents</h2><ul>");
    for entry in entries {
        let note = if entry.lacking {
            " <span class=\"why\">(in part)</span>"
        } else {
            ""
        };
        let paper = if entry.paper.is_empty() {
            String::new()
        } else {
            format!(" <span class=\"why\">{}</span>", escape(entry.paper))
        };
        let _ = write!(
            html,
            "<li><a href=\"#{}\">{}</a>{paper}{note}</li>",
            entry.id,
            escape(&entry.title)
        );
    }
    html.push_str("</ul></nav>\n");
    html
}

/// With a capital first letter, but for the numbers i, ii and iii.
fn capital(text: &str) -> String {
    if text.starts_with("i:") || text.starts_with("ii:") || text.starts_with("iii:") {
        return format!("Requirement {text}");
    }
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| {
        first.to_uppercase().chain(letters).collect()
    })
}
