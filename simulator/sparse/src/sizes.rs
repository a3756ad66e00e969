//! Sizes at which another code path begins.
//!
//! Each has a test on both sides of it, which [`SIZES`] names: the results are the same there, in bits or within
//! rounding.

/// A size, for the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// Name of its constant.
    pub name: &'static str,
    /// Its value.
    pub value: u64,
    /// The counted quantity, and the code path that begins or ends there.
    pub meaning: &'static str,
    /// Why this value, with a figure.
    pub reason: &'static str,
    /// The same results on both sides: in bits, or within rounding.
    pub same: Same,
    /// The test on both sides of it, a function of its crate.
    pub test: &'static str,
}

/// How results on both sides of a size compare.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Same {
    /// The same bits.
    Bits,
    /// The same within rounding: another method computes them.
    Rounding,
}

/// Declares sizes and their table.
#[macro_export]
macro_rules! define_sizes {
    ($($name:ident: $type:ty = $value:expr, $same:ident, $test:literal, $meaning:literal, $reason:literal;)*) => {
        $(
            #[doc = $meaning]
            ///
            #[doc = $reason]
            pub const $name: $type = $value;
        )*

        /// All of them.
        pub const SIZES: &[$crate::sizes::Size] = &[$($crate::sizes::Size {
            name: stringify!($name),
            value: $value as u64,
            meaning: $meaning,
            reason: $reason,
            same: $crate::sizes::Same::$same,
            test: $test,
        }),*];
    };
}

define_sizes! {
    MAX_SMALL_BLOCKS: usize = 3, Rounding, "dense_gives_way_to_sparse_by_size",
        "particles up to which a component is solved by dense LU with complete pivoting",
        "the course's own method: 4,000 steps on a Kepler orbit are its oracle's to the last bit, and 1e-11 off by Cholesky";
    MAX_DENSE_BLOCKS: usize = 16, Rounding, "dense_gives_way_to_sparse_by_size",
        "particles up to which an unsymmetric component is solved by dense LU",
        "pivoting by rows costs little there: a damped chain of 16 takes 0.03 ms a step, and 0.01 by the sparse factor, which does not pivot";
    MAX_DENSE_ROWS: usize = 2_000, Rounding, "dense_fallback_ends_at_a_size",
        "rows up to which a matrix is solved as a dense one where its sparse factor is not accurate enough",
        "it takes 64 MB with its factor, and 5 billion operations; a larger one is an error";
    MAX_UNORDERED_BLOCKS: usize = 4, Rounding, "small_matrices_keep_the_order_of_the_file",
        "particles up to which a sparse matrix is eliminated in the order of the file",
        "4 pivots make one dense front in any order";
    MIN_PRODUCTS: u64 = 1_000_000, Bits, "threads_begin_at_a_number_of_products",
        "products of blocks in a factorisation from which on threads share it",
        "a net of 47 by 47 particles; when threads began there, a step of 65 by 65 took 1 % less time by two, one of 129 by 129 took 11 % less";
    BRANCHES: u64 = 16, Bits, "branches_of_any_cost_have_the_same_bits",
        "a branch of the elimination tree that costs more than the tree's cost over this is divided further",
        "a thread that finds no more branches waits for a sixteenth of the work, 6 %, at most";
    DEEPEST: usize = 128, Bits, "branches_of_any_depth_have_the_same_bits",
        "levels of branches within branches",
        "it bounds the recursion; a tree with more is almost a chain, and threads gain nothing";
    LARGE: usize = 128, Bits, "large_fronts_have_the_same_bits",
        "rows of a front from which on threads eliminate it in chunks of rows",
        "threads share chunks, and one thread gains nothing; 128 columns take 0.35 to 0.7 million products, less than two threads need";
    GRAIN: usize = 1 << 19, Bits, "a_front_shared_by_threads_has_the_same_bits",
        "products of numbers in a part of a front; a part of more than two of them is halved between threads",
        "half a million take some 0.1 ms, far longer than handing them to another thread";
    PANEL: usize = 8, Bits, "fronts_of_every_small_size_have_the_same_bits",
        "pivots of a front that are eliminated together, before what is to their right is updated",
        "24 columns in 3D; with 128 rows they are 24 kB, which the nearest cache holds";
    TILE_ROWS: usize = 8, Bits, "fronts_of_every_small_size_have_the_same_bits",
        "rows of a tile of a small front; the rest is done by tiles of 4, 2 and 1",
        "a tile of 8 by 6 sums is 12 of the 16 registers of AVX2";
    CHUNK: usize = 8, Bits, "fronts_of_every_small_size_have_the_same_bits",
        "rows of a chunk of a large front; the last chunk is filled up by zeros",
        "the longest vectors hold 8 numbers";
    BLOCK: usize = 3, Bits, "fronts_of_every_small_size_have_the_same_bits",
        "chunks of rows that a panel is eliminated from at a time",
        "3 by 8 vectors of sums fill 24 of the 32 registers of AVX-512";
    WORTHWHILE: u64 = 4, Rounding, "lagged_factor_is_tried_above_a_cost",
        "iterations for the cost of a factorisation from which on an old factor is tried as a preconditioner",
        "a solution takes one to three: below four there is nothing to gain";
}
