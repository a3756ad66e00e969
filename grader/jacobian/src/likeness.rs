//! The pattern of a wrong Jacobian: the region where it is wrong, and the change of the right one.
//!
//! With the Jacobian `J` and the estimate `D`, the smallest region that holds all wrong entries is tried first, and within it
//! `J = c D` for one number `c`: missing (0), negative (−1) or a factor. Then `J = Dᵀ`, exchanged rows or columns, an error
//! of rank one, and a Jacobian that is that of another state.

use std::collections::BTreeSet;
use std::fmt;

/// Tolerance of comparisons, relative to the larger number.
const SAME: f64 = 1e-7;

/// Ratio of a factor to a known one below which it is that one.
const KNOWN: f64 = 1e-5;

/// A part of a matrix. Blocks are of the size that the caller gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Region {
    /// One entry.
    Entry(usize, usize),
    /// One block.
    Block(usize, usize),
    /// One row.
    Row(usize),
    /// One column.
    Column(usize),
    /// The rows of one block.
    BlockRow(usize),
    /// The columns of one block.
    BlockColumn(usize),
    /// The diagonal.
    Diagonal,
    /// The blocks on the diagonal.
    DiagonalBlocks,
    /// All above the diagonal.
    Upper,
    /// All below the diagonal.
    Lower,
    /// All blocks that are not on the diagonal.
    OtherBlocks,
    /// All but the diagonal.
    OffDiagonal,
    /// Everywhere.
    All,
}

/// The change of the entries of the region.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// They are zero.
    Missing,
    /// They are exactly the negative.
    Negative,
    /// They are multiplied by a number, whose name is given if it is known.
    Factor(f64, Option<String>),
    /// They should be zero.
    Extra,
    /// They are transposed; of several blocks, each by itself.
    Transposed,
    /// They are the mean of the matrix and its transpose.
    Symmetrised,
    /// Two columns, or those of two blocks, are exchanged.
    ColumnsExchanged(usize, usize),
    /// Two rows, or those of two blocks, are exchanged.
    RowsExchanged(usize, usize),
    /// The error is of rank one: it shows in one direction only.
    OneDirection,
    /// They are the same at all states.
    OtherState,
    /// They are not finite.
    NotFinite,
    /// None of these.
    Other,
}

/// Where and how a Jacobian is wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct Likeness {
    /// Where.
    pub region: Region,
    /// How.
    pub change: Change,
}

/// A matrix and its estimate, column by column.
pub struct Pair<'a> {
    /// Number of rows.
    pub rows: usize,
    /// Size of blocks: the dimension of a particle, or 1.
    pub block: usize,
    /// The Jacobian.
    pub stated: &'a [f64],
    /// The estimate.
    pub measured: &'a [f64],
    /// Bounds of the estimates, by row.
    pub bounds: &'a [f64],
    /// Places of the entries that are wrong: row and column.
    pub wrong: &'a [(usize, usize)],
}

impl Pair<'_> {
    fn columns(&self) -> usize {
        self.stated.len() / self.rows
    }

    fn stated(&self, row: usize, column: usize) -> f64 {
        self.stated[column * self.rows + row]
    }

    fn measured(&self, row: usize, column: usize) -> f64 {
        self.measured[column * self.rows + row]
    }

    fn same(&self, row: usize, value: f64, expected: f64) -> bool {
        (value - expected).abs() <= 16.0 * self.bounds[row] + SAME * value.abs().max(expected.abs())
    }

    fn places(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let (rows, columns) = (self.rows, self.columns());
        (0..columns).flat_map(move |column| (0..rows).map(move |row| (row, column)))
    }

    /// Whether the entries are those of `expected`, wherever `region` is.
    fn matches(&self, region: Region, expected: impl Fn(usize, usize) -> f64) -> bool {
        self.places()
            .filter(|(row, column)| region.contains(*row, *column, self.block))
            .all(|(row, column)| self.same(row, self.stated(row, column), expected(row, column)))
    }

    /// Names the error. `factors` are names of numbers that may have been left out or multiplied by twice.
    pub fn likeness(&self, factors: &[(String, f64)], same_elsewhere: bool) -> Likeness {
        let is_square = self.rows == self.columns();
        let (first_row, first_column) = self.wrong[0];
        let b = self.block.max(1);
        let regions = [
            Region::Entry(first_row, first_column),
            Region::Row(first_row),
            Region::Column(first_column),
            Region::Block(first_row / b, first_column / b),
            Region::BlockRow(first_row / b),
            Region::BlockColumn(first_column / b),
            Region::Diagonal,
            Region::DiagonalBlocks,
            Region::Upper,
            Region::Lower,
            if b > 1 { Region::OtherBlocks } else { Region::OffDiagonal },
            Region::OffDiagonal,
            Region::All,
        ];
        let holds_all = |region: &Region| {
            self.wrong.iter().all(|(row, column)| region.contains(*row, *column, b))
        };
        let regions: Vec<Region> = regions.into_iter().filter(holds_all).collect();
        let finite = self.wrong.iter().all(|(row, column)| self.stated(*row, *column).is_finite());
        if !finite {
            return Likeness { region: regions[0], change: Change::NotFinite };
        }
        // Of a matrix with a single block or row, the larger region says more.
        for region in &regions {
            if let Some(change) = self.scaled(*region, factors) {
                let whole = regions[regions.len() - 1];
                let region = if self.scaled(whole, factors).as_ref() == Some(&change) {
                    whole
                } else {
                    *region
                };
                return Likeness { region, change };
            }
        }
        let transposed = |row, column| self.measured(column, row);
        let in_block = |row: usize, column: usize| {
            let (r, c) = (row / b * b + column % b, column / b * b + row % b);
            self.measured(r, c)
        };
        for region in &regions {
            if is_square && *region == Region::All && self.matches(Region::All, transposed) {
                return Likeness { region: *region, change: Change::Transposed };
            }
            let fits = self.rows.is_multiple_of(b) && self.columns().is_multiple_of(b) && b > 1;
            if fits && self.matches(*region, in_block) {
                return Likeness { region: *region, change: Change::Transposed };
            }
        }
        let mean = |row, column| 0.5 * (self.measured(row, column) + self.measured(column, row));
        let change = match () {
            () if is_square && self.matches(Region::All, mean) => Change::Symmetrised,
            () => self.exchanged().unwrap_or_else(|| match () {
                () if same_elsewhere => Change::OtherState,
                () if self.has_rank_one() => Change::OneDirection,
                () => Change::Other,
            }),
        };
        Likeness { region: regions[0], change }
    }

    /// `J = c D` in `region`.
    fn scaled(&self, region: Region, factors: &[(String, f64)]) -> Option<Change> {
        let (mut both, mut square) = (0.0, 0.0);
        for (row, column) in self.places().filter(|(r, c)| region.contains(*r, *c, self.block)) {
            both += self.stated(row, column) * self.measured(row, column);
            square += self.measured(row, column) * self.measured(row, column);
        }
        let is_zero = |row, column| self.same(row, self.measured(row, column), 0.0);
        if matches!(region, Region::Entry(row, column) if is_zero(row, column)) {
            return Some(Change::Extra);
        }
        if square == 0.0 {
            return None;
        }
        let factor = both / square;
        if !self.matches(region, |row, column| factor * self.measured(row, column)) {
            return None;
        }
        let is_close = |to: f64| (factor - to).abs() <= KNOWN * to.abs().max(1e-3 * factor.abs());
        if factor.abs() < KNOWN && self.matches(region, |_, _| 0.0) {
            return Some(Change::Missing);
        }
        if is_close(-1.0) {
            return Some(Change::Negative);
        }
        let powers = |(name, value): &(String, f64)| {
            [
                (name.clone(), *value),
                (format!("{name}²"), value * value),
                (format!("1/{name}"), 1.0 / value),
                (format!("1/{name}²"), 1.0 / (value * value)),
            ]
        };
        let known = [("½".to_owned(), 0.5), ("2".to_owned(), 2.0)];
        let signed = |(name, value): (String, f64)| [(format!("−{name}"), -value), (name, value)];
        let mut names = known.into_iter().chain(factors.iter().flat_map(powers)).flat_map(signed);
        let name = names.find(|(_, value)| is_close(*value)).map(|(name, _)| name);
        Some(Change::Factor(factor, name))
    }

    fn exchanged(&self) -> Option<Change> {
        for size in [self.block.max(1), 1] {
            let columns = Exchange::of(self.wrong.iter().map(|(_, column)| *column), size);
            if let Some(two) = columns.filter(|two| two.fits(self.columns()))
                && self.matches(Region::All, |row, column| self.measured(row, two.other(column)))
            {
                return Some(Change::ColumnsExchanged(two.first, two.second));
            }
            let rows = Exchange::of(self.wrong.iter().map(|(row, _)| *row), size);
            if let Some(two) = rows.filter(|two| two.fits(self.rows))
                && self.matches(Region::All, |row, column| self.measured(two.other(row), column))
            {
                return Some(Change::RowsExchanged(two.first, two.second));
            }
        }
        None
    }

    /// Whether `J − D` is the product of a column and a row, which says something of a matrix alone.
    fn has_rank_one(&self) -> bool {
        if self.rows == 1 || self.columns() == 1 {
            return false;
        }
        let error = |row, column| self.stated(row, column) - self.measured(row, column);
        let sizes =
            self.wrong.iter().map(|(row, column)| (error(*row, *column).abs(), *row, *column));
        let Some((_, pivot_row, pivot_column)) = sizes.max_by(|a, b| a.0.total_cmp(&b.0)) else {
            return false;
        };
        let pivot = error(pivot_row, pivot_column);
        self.places().all(|(row, column)| {
            let expected = error(row, pivot_column) * error(pivot_row, column) / pivot;
            let value = error(row, column);
            let bound = self.bounds[row] + self.bounds[pivot_row];
            (value - expected).abs() <= 16.0 * bound + 1e-3 * value.abs().max(expected.abs())
        })
    }
}

/// Two blocks of rows or columns in each other's place.
struct Exchange {
    first: usize,
    second: usize,
    size: usize,
}

impl Exchange {
    /// The two blocks of this size in which these indices lie; `None` if they lie in another number of blocks.
    fn of(indices: impl Iterator<Item = usize>, size: usize) -> Option<Self> {
        let blocks: BTreeSet<usize> = indices.map(|index| index / size).collect();
        let mut blocks = blocks.into_iter();
        match (blocks.next(), blocks.next(), blocks.next()) {
            (Some(first), Some(second), None) => Some(Self { first, second, size }),
            _ => None,
        }
    }

    /// Whether both lie within `count` rows or columns.
    fn fits(&self, count: usize) -> bool {
        (self.second + 1) * self.size <= count
    }

    /// The index that stands in the place of this one.
    fn other(&self, index: usize) -> usize {
        let within = index % self.size;
        match index / self.size {
            block if block == self.first => self.second * self.size + within,
            block if block == self.second => self.first * self.size + within,
            _ => index,
        }
    }
}

impl Region {
    /// Whether an entry lies in the region, with blocks of `block` rows and columns.
    pub fn contains(self, row: usize, column: usize, block: usize) -> bool {
        let b = block.max(1);
        match self {
            Self::Entry(r, c) => (row, column) == (r, c),
            Self::Block(r, c) => (row / b, column / b) == (r, c),
            Self::Row(r) => row == r,
            Self::Column(c) => column == c,
            Self::BlockRow(r) => row / b == r,
            Self::BlockColumn(c) => column / b == c,
            Self::Diagonal => row == column,
            Self::DiagonalBlocks => row / b == column / b,
            Self::Upper => row < column,
            Self::Lower => row > column,
            Self::OtherBlocks => row / b != column / b,
            Self::OffDiagonal => row != column,
            Self::All => true,
        }
    }
}

impl fmt::Display for Region {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Entry(row, column) => write!(f, "entry ({row}, {column})"),
            Self::Block(row, column) => write!(f, "block ({row}, {column})"),
            Self::Row(row) => write!(f, "row {row}"),
            Self::Column(column) => write!(f, "column {column}"),
            Self::BlockRow(row) => write!(f, "the rows of block {row}"),
            Self::BlockColumn(column) => write!(f, "the columns of block {column}"),
            Self::Diagonal => write!(f, "the diagonal"),
            Self::DiagonalBlocks => write!(f, "the blocks on the diagonal"),
            Self::Upper => write!(f, "the upper triangle"),
            Self::Lower => write!(f, "the lower triangle"),
            Self::OtherBlocks => write!(f, "the blocks beside the diagonal"),
            Self::OffDiagonal => write!(f, "all but the diagonal"),
            Self::All => write!(f, "the whole Jacobian"),
        }
    }
}

impl Likeness {
    /// In words, of something else than a Jacobian, whose whole is called `whole`.
    pub fn of(&self, whole: &str) -> String {
        self.to_string().replacen(&Region::All.to_string(), whole, 1)
    }
}

impl fmt::Display for Likeness {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let region = &self.region;
        match &self.change {
            Change::Missing => write!(f, "{region} is missing: zero"),
            Change::Negative => write!(f, "{region} is exactly the negative"),
            Change::Factor(_, Some(name)) => write!(f, "{region} has a factor {name} too many"),
            Change::Factor(value, None) if (value - 1.0).abs() < 1e-2 => {
                write!(f, "{region} is off by a relative {:.1e}", value - 1.0)
            }
            Change::Factor(value, None) => {
                write!(f, "{region} is {value:.6} times what it should be")
            }
            Change::Extra => write!(f, "{region} should be zero"),
            Change::Transposed => write!(f, "{region} is transposed"),
            Change::Symmetrised => write!(f, "{region} is made symmetric, which it is not"),
            Change::ColumnsExchanged(a, b) => write!(f, "columns of {a} and {b} are exchanged"),
            Change::RowsExchanged(a, b) => write!(f, "rows of {a} and {b} are exchanged"),
            Change::OneDirection => {
                write!(f, "wrong along one direction only: the error has rank one")
            }
            Change::OtherState => {
                write!(f, "it is that of another state: it does not change with x")
            }
            Change::NotFinite => write!(f, "{region} is not finite"),
            Change::Other => write!(f, "{region} is wrong, in no way that has a name"),
        }
    }
}
