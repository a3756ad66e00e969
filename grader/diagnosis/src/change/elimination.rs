//! Gaussian elimination without pivoting, with one of its loops or statements wrong, or of rounded numbers. Cost: `O(n³)`.

use nalgebra::{DMatrix, DVector};

/// A slip in an elimination.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Slip {
    /// The last row is not eliminated.
    LastRow,
    /// The last column is not changed.
    LastColumn,
    /// The right-hand side is not changed.
    RightKept,
    /// The factor of a row is positive.
    PositiveFactor,
    /// Back substitution leaves out the unknown next to the diagonal.
    NextUnknown,
    /// Back substitution leaves out the last unknown.
    LastTerm,
    /// Back substitution does not divide by the diagonal.
    Undivided,
    /// The last unknown stays zero.
    LastUnknown,
    /// The first unknown stays zero.
    FirstUnknown,
    /// Matrix and right-hand side are in single precision.
    Single,
}

impl Slip {
    /// Every slip, in words.
    pub(super) const ALL: [(Self, &'static str); 10] = [
        (Self::LastRow, "the elimination leaves out the last row"),
        (Self::LastColumn, "the elimination leaves out the last column"),
        (Self::RightKept, "the elimination does not change the right-hand side"),
        (Self::PositiveFactor, "the elimination takes the absolute value of each row's factor"),
        (Self::NextUnknown, "back substitution leaves out the unknown next to the diagonal"),
        (Self::LastTerm, "back substitution leaves out the last unknown in the other rows"),
        (Self::Undivided, "back substitution does not divide by the diagonal"),
        (Self::LastUnknown, "back substitution leaves the last unknown 0"),
        (Self::FirstUnknown, "back substitution leaves the first unknown 0"),
        (Self::Single, "the matrix and the right-hand side are rounded to single precision"),
    ];

    /// The unknowns, with the slip.
    pub(super) fn solve(self, mut matrix: DMatrix<f64>, mut right: DVector<f64>) -> DVector<f64> {
        let n = right.len();
        let without = |slip: Self| n - usize::from(self == slip);
        if self == Self::Single {
            let numbers = matrix.iter_mut().chain(right.iter_mut());
            numbers.for_each(|value| *value = f64::from(*value as f32));
        }
        for pivot in 0..n {
            for row in pivot + 1..without(Self::LastRow) {
                let mut factor = matrix[(row, pivot)] / matrix[(pivot, pivot)];
                if self == Self::PositiveFactor {
                    factor = factor.abs();
                }
                for column in pivot..without(Self::LastColumn) {
                    matrix[(row, column)] -= factor * matrix[(pivot, column)];
                }
                if self != Self::RightKept {
                    right[row] -= factor * right[pivot];
                }
            }
        }
        let mut unknowns = DVector::zeros(n);
        let first = usize::from(self == Self::FirstUnknown);
        for row in (first..without(Self::LastUnknown)).rev() {
            let next = row + 1 + usize::from(self == Self::NextUnknown);
            let mut rest = right[row];
            for column in next..without(Self::LastTerm) {
                rest -= matrix[(row, column)] * unknowns[column];
            }
            let divisor = if self == Self::Undivided { 1.0 } else { matrix[(row, row)] };
            unknowns[row] = rest / divisor;
        }
        unknowns
    }
}
