//! Comparison of two numbers digit by digit, and of two traces around a step.

use std::ops::Range;

use similar::{Algorithm, DiffOp, capture_diff_slices};

use diagnosis::findings::ContextRow;
use grader::compare::FirstWrong;
use grader::verdict::number;

/// The shortest decimal that reads back as this number, with its sign.
pub(super) fn full(value: f64) -> String {
    let sign = if value.is_sign_negative() || value.is_nan() { "" } else { "+" };
    format!("{sign}{}", number(value))
}

/// Length of the common prefix of two numbers, or 0 if their digits stand for different powers of ten.
///
/// Digits after the first difference carry no information, even if equal.
pub(super) fn common_prefix(a: &str, b: &str) -> usize {
    // The exponent, and the number of characters before the point.
    let scale = |text: &str| {
        let (digits, exponent) = text.split_once('e').unwrap_or((text, ""));
        (exponent.to_owned(), digits.find('.').unwrap_or(digits.len()))
    };
    if scale(a) != scale(b) {
        return 0;
    }
    a.chars().zip(b.chars()).take_while(|(a, b)| a == b).count()
}

/// Origin of a line of the context.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LineKind {
    /// Oracle and trace agree within tolerance.
    Same,
    /// The oracle's line; the trace differs.
    Expected,
    /// The trace's line.
    Got,
}

/// A line of the context, split into pieces that agree with the other side or differ from it.
pub(super) struct DiffLine {
    pub(super) kind: LineKind,
    pub(super) pieces: Vec<(String, bool)>,
}

/// The particle's rows around the first wrong number, as lines of a diff, with the numbers of these `columns`. Rows that
/// agree within tolerance give one line.
pub(super) fn context(first: &FirstWrong, columns: Range<usize>) -> Vec<DiffLine> {
    let row = |step: u64, values: &[f64]| {
        let values = values.get(columns.clone()).unwrap_or(values);
        let numbers: Vec<String> = values.iter().map(|value| full(*value)).collect();
        format!("{step} {}", numbers.join(" "))
    };
    let (mut old, mut new) = (Vec::new(), Vec::new());
    for ContextRow { step, expected: oracle, got: trace } in &first.context {
        old.push(row(*step, oracle));
        let close = if first.accumulated {
            *step != first.place.step
        } else {
            halves_within(oracle, trace, first.tolerance)
        };
        new.push(row(*step, if close { oracle } else { trace }));
    }
    let numbers = old.iter().chain(&new).flat_map(|row| row.split(' ').skip(1));
    let width = numbers.map(str::len).max().unwrap_or(0);
    let line = |kind, text: &str, other: &str| line(kind, text, other, width);
    let mut lines = Vec::new();
    for operation in capture_diff_slices(Algorithm::Myers, &old, &new) {
        match operation {
            DiffOp::Equal { old_index, len, .. } => {
                lines.extend(
                    old[old_index..][..len].iter().map(|text| line(LineKind::Same, text, text)),
                );
            }
            // Both sides have one row per step, so that differing rows form pairs.
            _ => {
                for (old, new) in old[operation.old_range()].iter().zip(&new[operation.new_range()])
                {
                    lines.push(line(LineKind::Expected, old, new));
                    lines.push(line(LineKind::Got, new, old));
                }
            }
        }
    }
    lines
}

/// The line `text`, with the digits marked that differ from `other`; numbers are `width` characters wide.
fn line(kind: LineKind, text: &str, other: &str, width: usize) -> DiffLine {
    let mut pieces = Vec::new();
    let mut space = String::new();
    for (column, (word, other)) in text.split_whitespace().zip(other.split_whitespace()).enumerate()
    {
        let common = if word == other { word.len() } else { common_prefix(word, other) };
        // Align the step to the right and numbers to the left, so that their digits are below each other.
        let (before, after) = if column == 0 { (8, 0) } else { (0, width) };
        space += &" ".repeat(before - word.len().min(before));
        pieces.push((space + &word[..common], false));
        pieces.push((word[common..].to_owned(), true));
        space = " ".repeat(2 + after - word.len().min(after));
    }
    DiffLine { kind, pieces }
}

/// Whether both the positions and the velocities of two rows are closer than `tolerance`.
fn halves_within(a: &[f64], b: &[f64], tolerance: f64) -> bool {
    let half = a.len() / 2;
    let close = |a: &[f64], b: &[f64]| {
        let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
        squares.sum::<f64>().sqrt() < tolerance
    };
    close(&a[..half], &b[..half]) && close(&a[half..], &b[half..])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_different_digit_ends_the_common_prefix() {
        let (a, b) = (full(-0.123_456), full(-0.123_999));
        assert_eq!(&a[..common_prefix(&a, &b)], "-0.123");
    }

    #[test]
    fn numbers_are_shortest_round_trip_decimals() {
        for (value, text) in
            [(-0.15, "-0.15"), (1.0, "+1"), (0.1 + 0.2, "+0.30000000000000004"), (1e-7, "+1e-7")]
        {
            assert_eq!(full(value), text);
            assert_eq!(text.parse(), Ok(value));
        }
        assert_eq!(full(-0.0), "-0");
    }

    #[test]
    fn extra_digit_counts_as_different() {
        assert_eq!(common_prefix(&full(0.15), &full(0.15 + 1e-16)), "+0.15".len());
        assert_eq!(common_prefix(&full(1.0), &full(1.5)), "+1".len());
        assert_eq!(common_prefix(&full(1e-7), &full(1.5e-7)), "+1".len());
    }

    #[test]
    fn numbers_of_different_magnitude_share_no_prefix() {
        for (a, b) in [(1.5, 15.0), (9.5, 10.5), (1e-7, 1e-6), (1e-4, 1e-6), (1.0, -1.0)] {
            assert_eq!(common_prefix(&full(a), &full(b)), 0, "{a} {b}");
        }
    }
}
