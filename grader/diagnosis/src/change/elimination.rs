//! Solvers of a linear system with one of their loops or statements wrong, for another kind of matrix, or of rounded numbers.
//!
//! ```text
//! elimination         without pivoting, or with pivoting by rows
//! sweeps              of Gauss and Seidel's or Jacobi's method, from 0
//! Cholesky            L Lᵀ of the lower triangle, in place: the matrix stays above the diagonal
//! conjugate gradients n iterations from 0, exact for a symmetric matrix
//! ```
//!
//! Cost: `O(n³)`, of sweeps `O(n²)` each.

use nalgebra::{DMatrix, DVector};

/// A solver with a slip.
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
    /// The factor of a row has the wrong sign.
    NegativeFactor,
    /// Back substitution adds the other unknowns.
    Added,
    /// Back substitution leaves out the unknown next to the diagonal.
    NextUnknown,
    /// Back substitution leaves out the last unknown.
    LastTerm,
    /// Back substitution does not divide by the diagonal.
    Undivided,
    /// It does not divide the last unknown by the diagonal.
    LastUndivided,
    /// The right-hand side of the row below the pivot is not changed.
    RightBelowKept,
    /// That of the row below the pivot alone is changed.
    RightBelowAlone,
    /// The reciprocal of the pivot is in single precision.
    SinglePivot,
    /// The factor of a row is in single precision.
    SingleFactor,
    /// Only so many rows below the pivot are eliminated.
    Band(u8),
    /// In each row, only so many entries after the pivot are changed.
    BandOfColumns(u8),
    /// The solution is in single precision.
    SingleSolution,
    /// Back substitution reads the entries below the diagonal, as the elimination leaves them.
    Below,
    /// Back substitution subtracts no other unknown.
    Alone,
    /// The last unknown stays zero.
    LastUnknown,
    /// The first unknown stays zero.
    FirstUnknown,
    /// Back substitution, in place, stops before the first row.
    FirstRow,
    /// There is no back substitution.
    Forward,
    /// A Cholesky factorisation, with this slip.
    Cholesky(Cholesky),
    /// Matrix and right-hand side are in single precision.
    Single,
    /// Rows are exchanged, their right-hand sides are not.
    RightNotExchanged,
    /// Right-hand sides are exchanged, their rows are not.
    RowsNotExchanged,
    /// So many sweeps of Gauss and Seidel's method.
    Sweeps(u16),
    /// So many sweeps of Jacobi's method.
    Jacobi(u16),
    /// Rows whose factor is smaller than this power of ten are not eliminated.
    Skips(i32),
    /// The same of the entries to be eliminated.
    SkipsEntries(i32),
    /// Conjugate gradients.
    ConjugateGradients,
    /// They end where the residual is smaller than this power of ten, relative to the right-hand side if so.
    EarlyGradients(i32, bool),
}

/// A slip in a Cholesky factorisation, or in the substitutions after it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cholesky {
    /// Pivots are not replaced by their square roots.
    NoRoot,
    /// Forward substitution does not divide by the diagonal.
    ForwardUndivided,
    /// Back substitution does not divide by it.
    BackUndivided,
    /// Back substitution reads the matrix above the diagonal.
    Above,
    /// Forward substitution takes its place.
    Twice,
    /// It stops before the first row.
    FirstRow,
    /// There is none.
    Forward,
}

/// A number is larger than another one from this multiple on.
const SAME: f64 = 1.0 + 1e-9;

/// Usual numbers of sweeps.
const SWEEPS: [u16; 14] = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 15, 20, 50, 100];

impl Slip {
    /// Every slip, in words.
    pub(super) fn all() -> Vec<(Self, String)> {
        let plain = Self::PLAIN.iter().map(|(slip, words)| (*slip, (*words).to_owned()));
        let number = |count: u16| match count {
            1 => "1 sweep".to_owned(),
            _ => format!("{count} sweeps"),
        };
        let of = |count: u16| {
            let solved = format!("the linear system is solved by {}", number(count));
            [
                (Self::Sweeps(count), format!("{solved} of Gauss and Seidel's method, from 0")),
                (Self::Jacobi(count), format!("{solved} of Jacobi's method, from 0")),
            ]
        };
        let skips = (-6..=-1).flat_map(|power| {
            let slips = [(Self::Skips(power), "factor"), (Self::SkipsEntries(power), "entry")];
            slips.map(|(slip, what)| {
                (slip, format!("the elimination skips rows whose {what} is below 1e{power}"))
            })
        });
        let early = (-12..=-3).flat_map(|power| {
            [(true, "relative residual"), (false, "residual")].map(|(is_relative, what)| {
                let words = format!(
                    "the linear system is solved by conjugate gradients, which end at a {what} of 1e{power}"
                );
                (Self::EarlyGradients(power, is_relative), words)
            })
        });
        let bands = (1..=8).flat_map(|count| {
            let of = [
                (Self::Band(count), "row", "rows", "below each pivot"),
                (Self::BandOfColumns(count), "entry", "entries", "of a row after the pivot"),
            ];
            of.map(|(slip, one, several, place)| {
                let some = if count == 1 { one.to_owned() } else { format!("{count} {several}") };
                (slip, format!("the elimination changes only the {some} {place}"))
            })
        });
        let cholesky = Cholesky::ALL.map(|(slip, words)| (Self::Cholesky(slip), words.to_owned()));
        plain
            .chain(cholesky)
            .chain(SWEEPS.into_iter().flat_map(of))
            .chain(skips)
            .chain(early)
            .chain(bands)
            .collect()
    }

    const PLAIN: [(Self, &'static str); 25] = [
        (Self::LastRow, "the elimination leaves out the last row"),
        (Self::LastColumn, "the elimination leaves out the last column"),
        (Self::RightKept, "the elimination does not change the right-hand side"),
        (Self::PositiveFactor, "the elimination takes the absolute value of each row's factor"),
        (Self::NegativeFactor, "the elimination adds rows, and does not subtract them"),
        (Self::Added, "back substitution adds the other unknowns, and does not subtract them"),
        (Self::NextUnknown, "back substitution leaves out the unknown next to the diagonal"),
        (Self::LastTerm, "back substitution leaves out the last unknown in the other rows"),
        (Self::Undivided, "back substitution does not divide by the diagonal"),
        (Self::LastUndivided, "back substitution does not divide the last unknown by the diagonal"),
        (
            Self::RightBelowKept,
            "the elimination does not change the right-hand side of the row below the pivot",
        ),
        (
            Self::RightBelowAlone,
            "the elimination changes the right-hand side of the row below the pivot alone",
        ),
        (Self::SingleFactor, "the factors of the elimination are rounded to single precision"),
        (Self::SinglePivot, "the reciprocals of the pivots are rounded to single precision"),
        (Self::SingleSolution, "the solution of the linear system is rounded to single precision"),
        (
            Self::Below,
            "back substitution reads entries of the column below the diagonal in the place of those of the row",
        ),
        (Self::Alone, "back substitution subtracts no other unknown"),
        (Self::LastUnknown, "back substitution leaves the last unknown 0"),
        (Self::FirstUnknown, "back substitution leaves the first unknown 0"),
        (Self::FirstRow, "back substitution stops before the first row"),
        (Self::Forward, "there is no back substitution after the elimination"),
        (Self::Single, "the matrix and the right-hand side are rounded to single precision"),
        (Self::RightNotExchanged, "the elimination exchanges rows, and not their right-hand sides"),
        (Self::RowsNotExchanged, "the elimination exchanges right-hand sides, and not their rows"),
        (
            Self::ConjugateGradients,
            "the linear system is solved by conjugate gradients, which need a symmetric matrix",
        ),
    ];

    /// The unknowns, with the slip.
    pub(super) fn solve(self, mut matrix: DMatrix<f64>, mut right: DVector<f64>) -> DVector<f64> {
        match self {
            Self::Sweeps(count) => return sweeps(&matrix, &right, count, true),
            Self::Jacobi(count) => return sweeps(&matrix, &right, count, false),
            Self::Cholesky(slip) => return slip.solve(matrix, right),
            Self::ConjugateGradients => return conjugate_gradients(&matrix, right, 0.0),
            Self::EarlyGradients(power, is_relative) => {
                let size = if is_relative { right.norm() } else { 1.0 };
                return conjugate_gradients(&matrix, right, 10.0_f64.powi(power) * size);
            }
            _ => {}
        }
        let n = right.len();
        let without = |slip: Self| n - usize::from(self == slip);
        let over = |value: f64, pivot: f64| match self {
            Self::SinglePivot => value * f64::from((1.0 / pivot) as f32),
            _ => value / pivot,
        };
        if self == Self::Single {
            let numbers = matrix.iter_mut().chain(right.iter_mut());
            numbers.for_each(|value| *value = f64::from(*value as f32));
        }
        for pivot in 0..n {
            if matches!(
                self,
                Self::RightNotExchanged
                    | Self::RowsNotExchanged
                    | Self::Skips(_)
                    | Self::SkipsEntries(_)
            ) {
                // Of two that are equal but for rounding, the first.
                let size = |row: usize| matrix[(row, pivot)].abs();
                let larger = |most, row| if size(row) > SAME * size(most) { row } else { most };
                let largest = (pivot..n).fold(pivot, larger);
                if self != Self::RowsNotExchanged {
                    matrix.swap_rows(pivot, largest);
                }
                if self != Self::RightNotExchanged {
                    right.swap_rows(pivot, largest);
                }
            }
            let end = match self {
                Self::Band(count) => n.min(pivot + 1 + usize::from(count)),
                _ => without(Self::LastRow),
            };
            for row in pivot + 1..end {
                let mut factor = over(matrix[(row, pivot)], matrix[(pivot, pivot)]);
                let is_small = |size: f64, power: i32| size.abs() < 10.0_f64.powi(power);
                match self {
                    Self::PositiveFactor => factor = factor.abs(),
                    Self::NegativeFactor => factor = -factor,
                    Self::SingleFactor => factor = f64::from(factor as f32),
                    Self::SkipsEntries(power) if is_small(matrix[(row, pivot)], power) => continue,
                    Self::Skips(power) if is_small(factor, power) => continue,
                    _ => {}
                }
                // Entries below the diagonal are left, where nothing reads them.
                let first = pivot + usize::from(self == Self::Below);
                let end = match self {
                    Self::BandOfColumns(count) => n.min(pivot + 1 + usize::from(count)),
                    _ => without(Self::LastColumn),
                };
                for column in first..end {
                    matrix[(row, column)] -= factor * matrix[(pivot, column)];
                }
                let is_below = row == pivot + 1;
                let is_kept = match self {
                    Self::RightKept => true,
                    Self::RightBelowKept => is_below,
                    Self::RightBelowAlone => !is_below,
                    _ => false,
                };
                if !is_kept {
                    right[row] -= factor * right[pivot];
                }
            }
        }
        let mut unknowns = match self {
            Self::Forward => return right,
            Self::FirstRow => right.clone(),
            _ => DVector::zeros(n),
        };
        let first = usize::from(matches!(self, Self::FirstUnknown | Self::FirstRow));
        for row in (first..without(Self::LastUnknown)).rev() {
            let next = row + 1 + usize::from(self == Self::NextUnknown);
            let mut rest = right[row];
            for column in next..without(Self::LastTerm) {
                rest -= match self {
                    Self::Below => matrix[(column, row)],
                    Self::Alone => 0.0,
                    Self::Added => -matrix[(row, column)],
                    _ => matrix[(row, column)],
                } * unknowns[column];
            }
            let is_undivided =
                self == Self::Undivided || self == Self::LastUndivided && row + 1 == n;
            let divisor = if is_undivided { 1.0 } else { matrix[(row, row)] };
            unknowns[row] = over(rest, divisor);
        }
        if self == Self::SingleSolution {
            unknowns.iter_mut().for_each(|value| *value = f64::from(*value as f32));
        }
        unknowns
    }
}

impl Cholesky {
    /// Every slip, in words.
    const ALL: [(Self, &'static str); 7] = [
        (Self::NoRoot, "the Cholesky factorisation takes no square root of its pivots"),
        (
            Self::ForwardUndivided,
            "after the Cholesky factorisation, forward substitution does not divide by the diagonal",
        ),
        (
            Self::BackUndivided,
            "after the Cholesky factorisation, back substitution does not divide by the diagonal",
        ),
        (
            Self::Above,
            "after the Cholesky factorisation, back substitution reads the matrix above the diagonal, not Lᵀ",
        ),
        (
            Self::Twice,
            "after the Cholesky factorisation, forward substitution with L takes the place of back substitution with Lᵀ",
        ),
        (
            Self::FirstRow,
            "after the Cholesky factorisation, back substitution stops before the first row",
        ),
        (Self::Forward, "after the Cholesky factorisation, there is no back substitution"),
    ];

    /// The unknowns, with the slip.
    fn solve(self, mut matrix: DMatrix<f64>, right: DVector<f64>) -> DVector<f64> {
        let n = right.len();
        for column in 0..n {
            for row in column..n {
                let known = (0..column).map(|k| matrix[(row, k)] * matrix[(column, k)]);
                let rest = matrix[(row, column)] - known.sum::<f64>();
                matrix[(row, column)] = match self {
                    _ if row > column => rest / matrix[(column, column)],
                    Self::NoRoot => rest,
                    _ => rest.sqrt(),
                };
            }
        }
        let forward = |mut values: DVector<f64>| {
            for row in 0..n {
                let known: f64 = (0..row).map(|k| matrix[(row, k)] * values[k]).sum();
                let divisor = if self == Self::ForwardUndivided { 1.0 } else { matrix[(row, row)] };
                values[row] = (values[row] - known) / divisor;
            }
            values
        };
        let mut values = forward(right);
        match self {
            Self::Twice => return forward(values),
            Self::Forward => return values,
            _ => {}
        }
        for row in (usize::from(self == Self::FirstRow)..n).rev() {
            let entry = |k: usize| match self {
                Self::Above => matrix[(row, k)],
                _ => matrix[(k, row)],
            };
            let known: f64 = (row + 1..n).map(|k| entry(k) * values[k]).sum();
            let divisor = if self == Self::BackUndivided { 1.0 } else { matrix[(row, row)] };
            values[row] = (values[row] - known) / divisor;
        }
        values
    }
}

/// Sweeps from 0. Those of Gauss and Seidel use each unknown as soon as it is new.
fn sweeps(matrix: &DMatrix<f64>, right: &DVector<f64>, count: u16, at_once: bool) -> DVector<f64> {
    let n = right.len();
    let mut unknowns = DVector::zeros(n);
    for _ in 0..count {
        let before = unknowns.clone();
        for row in 0..n {
            let known = if at_once { &unknowns } else { &before };
            let others = (0..n).filter(|column| *column != row);
            let sum: f64 = others.map(|column| matrix[(row, column)] * known[column]).sum();
            unknowns[row] = (right[row] - sum) / matrix[(row, row)];
        }
    }
    unknowns
}

/// As many iterations as there are unknowns, fewer where the residual is smaller than this before.
fn conjugate_gradients(matrix: &DMatrix<f64>, right: DVector<f64>, end: f64) -> DVector<f64> {
    let mut unknowns = DVector::zeros(right.len());
    let (mut along, mut rest) = (right.clone(), right);
    for _ in 0..rest.len() {
        let square = rest.norm_squared();
        if square == 0.0 || square.sqrt() < end {
            break;
        }
        let image = matrix * &along;
        let part = square / along.dot(&image);
        unknowns += part * &along;
        rest -= part * image;
        along = &rest + (rest.norm_squared() / square) * along;
    }
    unknowns
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_solver_is_exact_where_its_slip_has_no_effect() {
        let mut random = fastrand::Rng::with_seed(5);
        let n = 6;
        let part = DMatrix::from_fn(n, n, |_, _| random.f64() - 0.5);
        let right = DVector::from_fn(n, |_, _| random.f64() - 0.5);
        // Symmetric, and its diagonal the largest of each row and column.
        let dominant = &part + part.transpose() + DMatrix::identity(n, n) * 8.0;
        let exact = dominant.clone().lu().solve(&right).expect("a regular matrix");
        let unsymmetric = &part + DMatrix::identity(n, n) * 8.0;
        let other = unsymmetric.clone().lu().solve(&right).expect("a regular matrix");
        let mut exchanged = unsymmetric.clone();
        exchanged.swap_rows(0, 1);
        let error = |slip: Slip, matrix: &DMatrix<f64>, exact: &DVector<f64>| {
            (slip.solve(matrix.clone(), right.clone()) - exact).amax()
        };
        for slip in [
            Slip::RightNotExchanged,
            Slip::RowsNotExchanged,
            Slip::Sweeps(50),
            Slip::Jacobi(100),
            Slip::ConjugateGradients,
            Slip::EarlyGradients(-14, true),
        ] {
            assert!(error(slip, &dominant, &exact) < 1e-14, "{slip:?}");
        }
        // Of a diagonal matrix, only its square roots and divisions matter.
        let diagonal = DMatrix::from_diagonal(&dominant.diagonal());
        let quotients = right.component_div(&dominant.diagonal());
        for slip in [Cholesky::Above, Cholesky::Twice] {
            assert!(error(Slip::Cholesky(slip), &diagonal, &quotients) < 1e-14, "{slip:?}");
            assert!(error(Slip::Cholesky(slip), &dominant, &exact) > 1e-6, "{slip:?}");
        }
        for slip in [Slip::FirstRow, Slip::Cholesky(Cholesky::FirstRow)] {
            let errors = slip.solve(dominant.clone(), right.clone()) - &exact;
            assert!(errors[0].abs() > 1e-6 && errors.rows(1, n - 1).amax() < 1e-14, "{slip:?}");
        }
        assert!(error(Slip::Sweeps(1), &dominant, &exact) > 1e-6);
        assert!(
            error(Slip::Jacobi(4), &dominant, &exact) > error(Slip::Sweeps(4), &dominant, &exact)
        );
        assert!(error(Slip::ConjugateGradients, &unsymmetric, &other) > 1e-6);
        let mut swapped = right.clone();
        swapped.swap_rows(0, 1);
        let of_swapped = unsymmetric.lu().solve(&swapped).expect("a regular matrix");
        // Right-hand sides stay where they were: those of the other order are solved.
        let unknowns = Slip::RightNotExchanged.solve(exchanged, swapped.clone());
        assert!((unknowns - of_swapped).amax() < 1e-14);
    }
}
