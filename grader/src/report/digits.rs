//! Two numbers below each other, with the digits that differ marked; two traces around a step.

use similar::{Algorithm, DiffOp, capture_diff_slices};

use crate::compare::{ContextRow, FirstWrong};

/// A number with all its digits, aligned with any other.
pub(super) fn full(value: f64) -> String {
    format!("{value:+.16e}")
}

/// How many characters two numbers share from the left, if their exponents are the same; else none.
///
/// A digit after the first different one says nothing, even where it happens to be the same.
pub(super) fn common_prefix(a: &str, b: &str) -> usize {
    let exponent = |text: &str| text.split_once('e').map(|(_, exponent)| exponent.to_owned());
    if exponent(a) != exponent(b) {
        return 0;
    }
    a.chars().zip(b.chars()).take_while(|(a, b)| a == b).count()
}

/// Where a line of the context comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LineKind {
    /// Both, within tolerance.
    Same,
    /// The oracle, where the trace has another.
    Expected,
    /// The trace.
    Got,
}

/// A line of the context, in pieces that are told apart by whether they differ from the other side.
pub(super) struct Line {
    pub(super) kind: LineKind,
    pub(super) pieces: Vec<(String, bool)>,
}

/// The particle's rows around the first wrong number, as lines of a diff. Rows that agree within the
/// tolerance are the same line.
pub(super) fn context(first: &FirstWrong) -> Vec<Line> {
    let row = |step: u64, values: &[f64]| {
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
    let mut lines = Vec::new();
    for operation in capture_diff_slices(Algorithm::Myers, &old, &new) {
        match operation {
            DiffOp::Equal { old_index, len, .. } => {
                lines.extend(
                    old[old_index..][..len].iter().map(|text| line(LineKind::Same, text, text)),
                );
            }
            // Both sides have a row a step, so that they differ in pairs.
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

/// The line `text`, whose digits differ from those of `other`.
fn line(kind: LineKind, text: &str, other: &str) -> Line {
    let mut pieces = Vec::new();
    let mut space = String::new();
    for (column, (word, other)) in text.split_whitespace().zip(other.split_whitespace()).enumerate()
    {
        let common = if word == other { word.len() } else { common_prefix(word, other) };
        // The step is flush right; numbers are flush left, so that their digits are below each other.
        let (before, after) = if column == 0 { (8, 0) } else { (0, 24) };
        space += &" ".repeat(before - word.len().min(before));
        pieces.push((space + &word[..common], false));
        pieces.push((word[common..].to_owned(), true));
        space = " ".repeat(2 + after - word.len().min(after));
    }
    Line { kind, pieces }
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
        assert_eq!(&a[..common_prefix(&a, &b)], "-1.23");
    }

    #[test]
    fn numbers_of_different_magnitude_share_nothing() {
        assert_eq!(common_prefix(&full(1.5), &full(15.0)), 0);
    }
}
