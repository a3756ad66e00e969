//! Looks of the curves of a diagram: a colour, dashes and a marker, numbered.
//!
//! ```text
//! curve n:  colour n mod 9, dashes n mod 5, marker n mod 7
//! ```
//!
//! No two of these numbers have a common divisor. Curves `n` and `m` agree in two of the three only if `n − m` is a multiple
//! of their product: any two of 35 curves differ in two of the three, and any two of 315 in one.

/// Number of colours.
pub const COLORS: usize = 9;

/// Lengths of dashes and gaps, in pixels; empty for a solid line.
pub const DASHES: [&[u32]; 5] = [&[], &[9, 4], &[2, 3], &[12, 3, 2, 3], &[8, 3, 2, 3, 2, 3]];

/// Number of markers, which are closed shapes and can be open or filled.
pub const MARKERS: usize = 7;

/// Look of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Look {
    /// Number of its colour.
    pub color: usize,
    /// Number of its dashes.
    pub dashes: usize,
    /// Number of its marker.
    pub marker: usize,
}

impl Look {
    /// The look of a curve, by its number in the diagram.
    pub fn of(number: usize) -> Self {
        Self { color: number % COLORS, dashes: number % DASHES.len(), marker: number % MARKERS }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In how many of colour, dashes and marker the looks of two curves differ.
    fn differences(one: usize, other: usize) -> usize {
        let (one, other) = (Look::of(one), Look::of(other));
        usize::from(one.color != other.color)
            + usize::from(one.dashes != other.dashes)
            + usize::from(one.marker != other.marker)
    }

    #[test]
    fn curve_styles_are_distinguishable() {
        for (curves, least) in [(35, 2), (315, 1)] {
            for one in 0..curves {
                for other in 0..one {
                    assert!(differences(one, other) >= least, "{one} and {other}");
                }
            }
        }
        for (number, dashes) in DASHES.iter().enumerate() {
            assert!(!DASHES[..number].contains(dashes), "{dashes:?} twice");
        }
    }
}
