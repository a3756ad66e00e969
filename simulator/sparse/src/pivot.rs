//! Pivot blocks of a factorisation: `D × D` blocks, factorised with complete pivoting where they need it.

#![expect(clippy::needless_range_loop, reason = "indices run over several arrays at once")]

/// A pivot in a block is left in its place where it is this part of what is below it: growth is bounded,
/// as by partial pivoting.
const PIVOT_THRESHOLD: f64 = 0.25;

/// The signs of the pivots.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Inertia {
    /// The matrix is symmetric, and every pivot block is positive definite: so is the matrix.
    Definite,
    /// The matrix is not symmetric, or some pivot block is not positive definite.
    Indefinite,
    /// Some pivot block is singular: there is no factor.
    Singular,
}

/// A diagonal block as `P B Q = L U`, reciprocals of the pivots on the diagonal.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PivotBlock<const D: usize> {
    pub(crate) lu: [[f64; D]; D],
    pub(crate) rows: [usize; D],
    pub(crate) columns: [usize; D],
}

/// So many zeros; `None` if there is not enough memory.
pub(crate) fn zeros<T: Clone>(count: usize, zero: T) -> Option<Vec<T>> {
    let mut values = Vec::new();
    values.try_reserve_exact(count).ok()?;
    values.resize(count, zero);
    Some(values)
}

impl<const D: usize> PivotBlock<D> {
    /// Factorises the transpose of a block of which the columns are given; `None` if it is singular. Whether a symmetric
    /// block is positive definite: then, and only then, all pivots are positive and on the diagonal.
    #[inline(always)]
    pub(crate) fn new<const SYMMETRIC: bool>(block: [[f64; D]; D]) -> (Option<Self>, bool) {
        let mut lu = [[0.0; D]; D];
        for i in 0..D {
            for j in 0..D {
                // Of a symmetric block, only the lower triangle is up to date.
                lu[i][j] = if SYMMETRIC { block[i.min(j)][i.max(j)] } else { block[i][j] };
            }
        }
        let (mut rows, mut columns) = ([0; D], [0; D]);
        for i in 0..D {
            (rows[i], columns[i]) = (i, i);
        }
        let mut definite = true;
        for k in 0..D {
            // Most blocks are best left in order, and need no search.
            let mut largest: f64 = 0.0;
            for i in k + 1..D {
                largest = largest.max(lu[i][k].abs());
            }
            if lu[k][k].abs() < PIVOT_THRESHOLD * largest || lu[k][k] == 0.0 {
                let at = find_pivot(&lu, k);
                definite &= at[0] == at[1];
                lu.swap(k, at[0]);
                rows.swap(k, at[0]);
                for row in &mut lu {
                    row.swap(k, at[1]);
                }
                columns.swap(k, at[1]);
                if lu[k][k] == 0.0 {
                    return (None, false);
                }
            }
            definite &= lu[k][k] > 0.0;
            let reciprocal = 1.0 / lu[k][k];
            lu[k][k] = reciprocal;
            for i in k + 1..D {
                lu[i][k] *= reciprocal;
                for j in k + 1..D {
                    lu[i][j] -= lu[i][k] * lu[k][j];
                }
            }
        }
        (Some(Self { lu, rows, columns }), definite)
    }

    /// Overwrites a right-hand side by the solution for the symmetric block.
    #[inline(always)]
    pub(crate) fn solve(&self, values: &mut [f64; D]) {
        let mut permuted = [0.0; D];
        for i in 0..D {
            permuted[i] = values[self.rows[i]];
            for k in 0..i {
                permuted[i] -= self.lu[i][k] * permuted[k];
            }
        }
        for i in (0..D).rev() {
            for k in i + 1..D {
                permuted[i] -= self.lu[i][k] * permuted[k];
            }
            permuted[i] *= self.lu[i][i];
        }
        for i in 0..D {
            values[self.columns[i]] = permuted[i];
        }
    }

    /// The same for a block that is not symmetric, whose transpose is factorised.
    #[inline(always)]
    pub(crate) fn solve_transposed(&self, values: &mut [f64; D]) {
        let mut permuted = [0.0; D];
        for i in 0..D {
            permuted[i] = values[self.columns[i]];
            for k in 0..i {
                permuted[i] -= self.lu[k][i] * permuted[k];
            }
            permuted[i] *= self.lu[i][i];
        }
        for i in (0..D).rev() {
            for k in i + 1..D {
                permuted[i] -= self.lu[k][i] * permuted[k];
            }
        }
        for i in 0..D {
            values[self.rows[i]] = permuted[i];
        }
    }
}

/// The largest entry from row and column `k` on; of equal ones, one on the diagonal.
#[cold]
fn find_pivot<const D: usize>(lu: &[[f64; D]; D], k: usize) -> [usize; 2] {
    let (mut best, mut at) = (0.0, [k, k]);
    for i in k..D {
        if lu[i][i].abs() > best {
            (best, at) = (lu[i][i].abs(), [i, i]);
        }
    }
    for i in k..D {
        for j in k..D {
            if lu[i][j].abs() > best {
                (best, at) = (lu[i][j].abs(), [i, j]);
            }
        }
    }
    at
}
