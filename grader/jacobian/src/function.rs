//! A function of any size with its Jacobian, as its author computes them.

use crate::ridders::Function as Values;

/// Fills a vector for a point; `false` where it is undefined.
pub type Fill<'a> = Box<dyn FnMut(&[f64], &mut [f64]) -> bool + 'a>;

/// Appends the entries of a sparse matrix for a point; `false` where it is undefined.
pub type FillSparse<'a> = Box<dyn FnMut(&[f64], &mut Vec<Triplet>) -> bool + 'a>;

/// Fills the product of the Jacobian at a point (first) with a vector (second); `false` where it is undefined.
pub type Product<'a> = Box<dyn FnMut(&[f64], &[f64], &mut [f64]) -> bool + 'a>;

/// A function of `columns` variables with `rows` values. A callback may return `false` from some call on, to end a check.
pub struct Function<'a> {
    /// Number of values.
    pub rows: usize,
    /// Number of variables.
    pub columns: usize,
    /// The values.
    pub value: Fill<'a>,
    /// The Jacobian.
    pub derivative: Derivative<'a>,
    /// Calls of both so far.
    pub calls: Calls,
}

/// How a Jacobian is computed.
pub enum Derivative<'a> {
    /// All entries, row by row.
    Dense(Fill<'a>),
    /// The entries that are not zero. Several for one place add up.
    Sparse(FillSparse<'a>),
    /// Products with vectors.
    Product(Product<'a>),
}

/// Number of calls of a function's callbacks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Calls {
    /// Evaluations of the function.
    pub values: usize,
    /// Evaluations of the Jacobian, or products with it.
    pub jacobians: usize,
}

/// An entry of a sparse matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triplet {
    /// Its row.
    pub row: usize,
    /// Its column.
    pub column: usize,
    /// Its value.
    pub value: f64,
}

impl<'a> Function<'a> {
    /// A function with no calls so far.
    pub fn new(rows: usize, columns: usize, value: Fill<'a>, derivative: Derivative<'a>) -> Self {
        Self { rows, columns, value, derivative, calls: Calls::default() }
    }

    /// The values at `x`; `false` if they are undefined or not finite.
    pub fn evaluate(&mut self, x: &[f64], values: &mut [f64]) -> bool {
        self.calls.values += 1;
        (self.value)(x, values) && values.iter().all(|value| value.is_finite())
    }

    /// The same as a closure.
    pub(crate) fn values(&mut self) -> impl FnMut(&[f64], &mut [f64]) -> bool {
        |x, values| self.evaluate(x, values)
    }

    /// Number of calls that a Jacobian takes.
    pub(crate) fn calls_of_jacobian(&self) -> usize {
        if matches!(self.derivative, Derivative::Product(_)) { self.columns } else { 1 }
    }

    /// The Jacobian at `x`; not a number where it is undefined.
    pub fn jacobian(&mut self, x: &[f64]) -> Matrix {
        let (rows, columns) = (self.rows, self.columns);
        self.calls.jacobians += self.calls_of_jacobian();
        let mut triplets = Vec::new();
        let defined = match &mut self.derivative {
            Derivative::Dense(fill) => {
                let mut by_row = vec![f64::NAN; rows * columns];
                let defined = fill(x, &mut by_row);
                if defined {
                    let mut by_column = vec![0.0; rows * columns];
                    for (row, values) in by_row.chunks_exact(columns).enumerate() {
                        for (column, value) in values.iter().enumerate() {
                            by_column[column * rows + row] = *value;
                        }
                    }
                    return Matrix::Dense { rows, by_column };
                }
                false
            }
            Derivative::Sparse(fill) => fill(x, &mut triplets),
            Derivative::Product(product) => {
                let (mut direction, mut values) = (vec![0.0; columns], vec![0.0; rows]);
                (0..columns).all(|column| {
                    direction[column] = 1.0;
                    let defined = product(x, &direction, &mut values);
                    direction[column] = 0.0;
                    let entry =
                        |(row, value): (usize, &f64)| Triplet { row, column, value: *value };
                    triplets
                        .extend(values.iter().enumerate().map(entry).filter(|t| t.value != 0.0));
                    defined
                })
            }
        };
        if !defined {
            return Matrix::Dense { rows, by_column: vec![f64::NAN; rows * columns] };
        }
        Matrix::sparse(rows, columns, triplets)
    }
}

/// A matrix by columns.
#[derive(Debug, Clone, PartialEq)]
pub enum Matrix {
    /// All entries, column by column.
    Dense {
        /// Number of rows.
        rows: usize,
        /// The entries.
        by_column: Vec<f64>,
    },
    /// The entries that are not zero, by column and row.
    Sparse {
        /// Number of rows.
        rows: usize,
        /// Where each column begins in `entries`, and their number.
        starts: Vec<usize>,
        /// Row and value.
        entries: Vec<(usize, f64)>,
    },
}

impl Matrix {
    /// The sum of `triplets`.
    fn sparse(rows: usize, columns: usize, mut triplets: Vec<Triplet>) -> Self {
        triplets.retain(|triplet| triplet.row < rows && triplet.column < columns);
        triplets.sort_by_key(|triplet| (triplet.column, triplet.row));
        triplets.dedup_by(|next, kept| {
            let same = (next.row, next.column) == (kept.row, kept.column);
            if same {
                kept.value += next.value;
            }
            same
        });
        let before = |column| triplets.partition_point(|triplet| triplet.column < column);
        let starts = (0..=columns).map(before).collect();
        let entries = triplets.iter().map(|triplet| (triplet.row, triplet.value)).collect();
        Self::Sparse { rows, starts, entries }
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        match self {
            Self::Dense { rows, by_column } => by_column.len() / (*rows).max(1),
            Self::Sparse { starts, .. } => starts.len() - 1,
        }
    }

    /// Row and value of the entries of a column that are stored.
    pub fn column(&self, column: usize) -> Box<dyn Iterator<Item = (usize, f64)> + '_> {
        match self {
            Self::Dense { rows, by_column } => {
                Box::new(by_column[column * rows..(column + 1) * rows].iter().copied().enumerate())
            }
            Self::Sparse { starts, entries, .. } => {
                Box::new(entries[starts[column]..starts[column + 1]].iter().copied())
            }
        }
    }

    /// Adds the product with `direction` to `values`.
    pub fn add_product(&self, direction: &[f64], values: &mut [f64]) {
        for (column, weight) in direction.iter().enumerate().filter(|(_, weight)| **weight != 0.0) {
            self.column(column).for_each(|(row, value)| values[row] += weight * value);
        }
    }

    /// All entries, column by column.
    pub fn dense(&self) -> Vec<f64> {
        match self {
            Self::Dense { by_column, .. } => by_column.clone(),
            Self::Sparse { rows, .. } => {
                let mut all = vec![0.0; rows * self.columns()];
                for column in 0..self.columns() {
                    self.column(column).for_each(|(row, value)| all[column * rows + row] = value);
                }
                all
            }
        }
    }

    /// Groups of columns of which no two have an entry in the same row; of a dense matrix, single columns.
    pub fn groups(&self) -> Vec<Vec<usize>> {
        let Self::Sparse { rows, .. } = self else {
            return (0..self.columns()).map(|column| vec![column]).collect();
        };
        let mut groups: Vec<(Vec<usize>, Vec<bool>)> = Vec::new();
        for column in 0..self.columns() {
            let is_free = |taken: &[bool]| self.column(column).all(|(row, _)| !taken[row]);
            let place = groups.iter().position(|(_, taken)| is_free(taken)).unwrap_or_else(|| {
                groups.push((Vec::new(), vec![false; *rows]));
                groups.len() - 1
            });
            let (columns, taken) = &mut groups[place];
            columns.push(column);
            self.column(column).for_each(|(row, _)| taken[row] = true);
        }
        groups.into_iter().map(|(columns, _)| columns).collect()
    }
}

/// The function along a line: its one variable is the distance from `x` along `direction`.
pub(crate) fn along<'a>(
    function: Values<'a>,
    x: &'a [f64],
    direction: &'a [f64],
) -> impl FnMut(&[f64], &mut [f64]) -> bool + 'a {
    let mut moved = x.to_vec();
    move |distance, values| {
        for ((moved, x), direction) in moved.iter_mut().zip(x).zip(direction) {
            *moved = x + distance[0] * direction;
        }
        function(&moved, values)
    }
}
