//! The colour bar: colours, marks, numbers, unit.

use super::colours::Colours;
use super::scale::Scale;
use super::surface::{Cell, Frame, Ink, Raster, Surface};
use super::text::Anchor;

/// Draws a horizontal colour bar in the upper part of `frame`, numbers and unit below it. `beyond` says whether values
/// lie below and above the ends, which is shown by arrowheads.
pub(super) fn colour_bar(
    canvas: &mut dyn Surface,
    frame: Frame,
    scale: Scale,
    colours: Colours,
    unit: &str,
    beyond: (bool, bool),
    size: f32,
) {
    // Whole pixels, so that colours do not mix with the paper.
    let bar = Frame {
        x: frame.x.round(),
        y: frame.y.round(),
        width: frame.width.round(),
        height: (size * 0.95).round(),
    };
    let columns = (bar.width * canvas.cells_per_pixel()) as usize;
    let rows = (bar.height * canvas.cells_per_pixel()) as usize;
    let cells = (0..columns * rows).map(|index| Cell {
        position: ((index % columns) as f32 + 0.5) / columns as f32,
        valued: 1.0,
        missing: 0.0,
    });
    let raster = Raster {
        width: columns,
        cells: cells.collect(),
        colours,
    };
    canvas.raster(bar, &raster);
    let line = size / 16.0;
    arrowheads(canvas, bar, colours, beyond, line);
    canvas.outline(bar, line, Ink::Frame);
    let baseline = bar.y + bar.height + size * 1.35;
    let mut taken = f32::NEG_INFINITY;
    // Zero is the number a reader looks for first; then the rest from left to right, where there is room.
    let (ticks, minor) = scale.ticks();
    for value in minor {
        let x = bar.x + bar.width * scale.spread().position(value) as f32;
        canvas.line(
            &[
                (x, bar.y + bar.height),
                (x, bar.y + bar.height + size * 0.17),
            ],
            line,
            Ink::Frame,
        );
    }
    let zero = ticks
        .iter()
        .position(|&tick| tick == 0.0)
        .map(|index| place(canvas, bar, scale, &ticks, index, size));
    for index in 0..ticks.len() {
        let (label, x, half) = place(canvas, bar, scale, &ticks, index, size);
        canvas.line(
            &[
                (x, bar.y + bar.height),
                (x, bar.y + bar.height + size * 0.3),
            ],
            line,
            Ink::Frame,
        );
        let clear_of_zero = zero.as_ref().is_none_or(|(_, zero, width)| {
            ticks[index] == 0.0 || (x - zero).abs() > half + width + size * 0.4
        });
        if clear_of_zero && x - half > taken {
            canvas.text(&label, size, Anchor::Middle, x, baseline, Ink::Text);
            taken = x + half + size * 0.4;
        }
    }
    canvas.text(
        unit,
        size,
        Anchor::Middle,
        bar.x + bar.width / 2.0,
        baseline + size * 1.45,
        Ink::Text,
    );
}

fn place(
    canvas: &dyn Surface,
    bar: Frame,
    scale: Scale,
    ticks: &[f64],
    index: usize,
    size: f32,
) -> (String, f32, f32) {
    let label = label(scale, ticks, ticks[index]);
    let x = bar.x + bar.width * scale.spread().position(ticks[index]) as f32;
    let half = canvas.text_width(&label, size) / 2.0;
    (label, x, half)
}

fn arrowheads(
    canvas: &mut dyn Surface,
    bar: Frame,
    colours: Colours,
    (below, above): (bool, bool),
    line: f32,
) {
    let mut arrow = |show: bool, position: f64, base: f32, tip: f32| {
        if show {
            let shape = [
                (base, bar.y),
                (tip, bar.y + bar.height / 2.0),
                (base, bar.y + bar.height),
            ];
            canvas.polygon(&shape, Ink::Rgb(colours.at(position)));
            canvas.line(&shape, line, Ink::Frame);
        }
    };
    arrow(below, 0.0, bar.x, bar.x - bar.height);
    arrow(
        above,
        1.0,
        bar.x + bar.width,
        bar.x + bar.width + bar.height,
    );
}

/// The number at a mark: decimals as the distance of the marks asks for, powers of ten on a logarithmic scale.
fn label(scale: Scale, ticks: &[f64], value: f64) -> String {
    let text = match scale {
        Scale::SymLog { .. } if value != 0.0 => {
            let power = value.abs().log10().round() as i32;
            if (-2..=3).contains(&power) || value.abs() < 1e4 && value.abs() > 2e-3 {
                format!("{value}")
            } else {
                format!(
                    "{}10{}",
                    if value < 0.0 { "-" } else { "" },
                    superscript(power)
                )
            }
        }
        Scale::SymLog { .. } => "0".to_owned(),
        Scale::Linear { .. } => {
            let step = match ticks {
                [first, second, ..] => second - first,
                _ => value.abs(),
            };
            let largest = ticks
                .iter()
                .fold(0.0_f64, |largest, tick| largest.max(tick.abs()));
            return label_decimal(value, step, largest);
        }
    };
    text.replace('-', "−")
}

/// A number at a mark among others `step` apart, the largest of magnitude `largest`.
pub(super) fn label_decimal(value: f64, step: f64, largest: f64) -> String {
    let text = if largest >= 1e5 || (step < 1e-4 && step > 0.0) {
        let text = format!("{value:.1e}");
        match text
            .split_once('e')
            .map(|(digits, power)| (digits, power.parse()))
        {
            _ if value.abs() < 1e-9 * step => "0".to_owned(),
            Some((digits, Ok(power))) => {
                format!("{}×10{}", digits.trim_end_matches(".0"), superscript(power))
            }
            _ => text,
        }
    } else {
        let decimals = if step > 0.0 {
            (-(step * 1.001).log10().floor()).max(0.0) as usize
        } else {
            0
        };
        let text = format!("{value:.decimals$}");
        // Zero has no sign.
        if text.trim_matches(['-', '0', '.']).is_empty() {
            text.trim_start_matches('-').to_owned()
        } else {
            text
        }
    };
    text.replace('-', "−")
}

/// `factor` times a power of ten, at a mark of a logarithmic axis.
pub(super) fn label_power(factor: f64, power: i32) -> String {
    if (-2..=3).contains(&power) {
        let value = factor * 10.0_f64.powi(power);
        let decimals = (-power).max(0) as usize;
        format!("{value:.decimals$}")
    } else if factor == 1.0 {
        format!("10{}", superscript(power))
    } else {
        format!("{factor}×10{}", superscript(power))
    }
}

fn superscript(power: i32) -> String {
    power
        .to_string()
        .chars()
        .map(|digit| match digit {
            '-' => '⁻',
            digit => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹']
                [digit.to_digit(10).unwrap_or(0) as usize],
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_labels_of_marks() {
        let linear = Scale::Linear {
            min: 15.2,
            max: 25.0,
        };
        let (ticks, _) = linear.ticks();
        assert_eq!(ticks, [16.0, 18.0, 20.0, 22.0, 24.0]);
        let labels = |scale: Scale| -> Vec<String> {
            let (ticks, _) = scale.ticks();
            ticks
                .iter()
                .map(|&tick| label(scale, &ticks, tick))
                .collect()
        };
        let linear = Scale::Linear {
            min: -0.31,
            max: 0.31,
        };
        assert_eq!(labels(linear), ["−0.2", "0.0", "0.2"]);
        let log = Scale::SymLog {
            min: -20.0,
            max: 20.0,
            threshold: 0.02,
        };
        assert_eq!(labels(log), ["−10", "−1", "−0.1", "0", "0.1", "1", "10"]);
        let log = Scale::SymLog {
            min: 0.0,
            max: 3.0,
            threshold: 0.2,
        };
        assert_eq!(labels(log), ["0", "0.2", "0.5", "1", "2"]);
        assert_eq!(label(log, &[], 1e-5), "10⁻⁵");
    }
}
