//! Counts of the work of linear solvers.

/// Counts of a linear solver's work.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LinearStatistics {
    /// Systems solved.
    pub solves: u64,
    /// Sparsity patterns analysed.
    pub symbolic_analyses: u64,
    /// Matrices factorised; a system may consist of several independent ones, or of none.
    pub factorisations: u64,
    /// Refinement steps, taken when a residual was too large.
    pub refinements: u64,
    /// Symmetric matrices found not to be positive definite.
    pub indefinite: u64,
    /// Systems that were solved with the factor of an earlier matrix.
    pub reused: u64,
    /// Conjugate gradient iterations with the factor of an earlier matrix, unsuccessful ones included.
    pub iterations: u64,
    /// Matrices that needed complete pivoting.
    pub complete_pivotings: u64,
    /// Largest accepted residual of a system, relative to `‖A‖·‖x‖ + ‖b‖` in the maximum norm.
    pub worst_residual: f64,
    /// Work with sparse factors.
    pub factor: FactorWork,
}

/// Work with sparse factors, as their patterns tell it; benches compare it with what the processor can do.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FactorWork {
    /// Multiplications and additions of factorisations and substitutions.
    pub operations: u64,
    /// Bytes of the factor that substitutions read.
    pub bytes: u64,
    /// Entries of the largest factor.
    pub entries: u64,
}

impl FactorWork {
    /// Adds other work.
    pub fn add(&mut self, FactorWork { operations, bytes, entries }: FactorWork) {
        self.operations += operations;
        self.bytes += bytes;
        self.entries = self.entries.max(entries);
    }

    /// Adds forward and backward substitutions for `columns` right-hand sides with a triangle of so many entries.
    pub fn add_substitutions(&mut self, entries: usize, columns: usize) {
        let entries = entries as u64;
        let operations = 4 * entries * columns as u64;
        self.add(FactorWork { operations, bytes: 16 * entries, entries });
    }
}
