//! Sparse factorisations with pivoting, where [`ldl`](super::ldl) is not accurate enough: LBLᵀ of a symmetric matrix
//! with pivoting inside supernodes, and LU with partial pivoting.
//!
//! Both are faer's, on one thread, so that the bits do not depend on how many there are; they do depend
//! on the vector instructions of the processor. A method's pattern is analysed when it is first needed;
//! after that nothing is allocated. Cost: that of the fill.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, IntranodeLbltRef, SymbolicCholesky, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::linalg::lu::{
    LuRef, LuSymbolicParams, NumericLu, SymbolicLu, factorize_symbolic_lu,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};
use faer::{Conj, MatMut, Par, Side, Spec};

use super::LinearError;
use super::blocks::BlockColumns;
use crate::statistics::LinearStatistics;

/// The matrix entry by entry, with the workspace of its factorisation.
pub(super) struct General<W> {
    columns: ScalarColumns,
    workspace: W,
}

/// LBLᵀ of a symmetric matrix.
pub(super) type Lblt = General<LbltWorkspace>;

/// LU with partial pivoting.
pub(super) type Lu = General<LuWorkspace>;

struct ScalarColumns {
    pattern: SymbolicSparseColMat<u32>,
    values: Vec<f64>,
    /// Where each entry is among the values of the blocks.
    sources: Vec<u32>,
}

pub(super) struct LbltWorkspace {
    symbolic: SymbolicCholesky<u32>,
    factor: Vec<f64>,
    subdiagonal: Vec<f64>,
    forward: Vec<u32>,
    inverse: Vec<u32>,
    memory: MemBuffer,
}

pub(super) struct LuWorkspace {
    symbolic: SymbolicLu<u32>,
    factor: NumericLu<u32, f64>,
    memory: MemBuffer,
}

impl Lblt {
    /// Analyses the pattern.
    ///
    /// # Errors
    /// Where there is not enough memory.
    pub(super) fn new<const D: usize>(
        matrix: &BlockColumns<D>,
        statistics: &mut LinearStatistics,
    ) -> Result<Self, LinearError> {
        statistics.symbolic_analyses += 1;
        let size = matrix.size();
        let columns = ScalarColumns::new(matrix);
        let symbolic = factorize_symbolic_cholesky(
            columns.pattern.as_ref(),
            Side::Lower,
            SymmetricOrdering::Amd,
            CholeskySymbolicParams::default(),
        );
        let symbolic = symbolic.map_err(|_| LinearError::OutOfMemory { size })?;
        let requirements = [
            symbolic.factorize_numeric_intranode_lblt_scratch::<f64>(Par::Seq, Spec::default()),
            symbolic.solve_in_place_scratch::<f64>(1, Par::Seq),
        ];
        let workspace = LbltWorkspace {
            factor: zeros(size, symbolic.len_val())?,
            subdiagonal: zeros(size, size)?,
            forward: zeros(size, size)?,
            inverse: zeros(size, size)?,
            memory: allocate(size, &requirements)?,
            symbolic,
        };
        Ok(Self { columns, workspace })
    }

    /// Factorises the matrix.
    pub(super) fn factorise<const D: usize>(
        &mut self,
        matrix: &BlockColumns<D>,
        statistics: &mut LinearStatistics,
    ) {
        statistics.factorisations += 1;
        let LbltWorkspace { symbolic, factor, subdiagonal, forward, inverse, memory } =
            &mut self.workspace;
        symbolic.factorize_numeric_intranode_lblt(
            factor,
            subdiagonal,
            forward,
            inverse,
            self.columns.filled(matrix),
            Side::Lower,
            Par::Seq,
            MemStack::new(memory),
            Spec::default(),
        );
    }

    /// Overwrites a right-hand side by the solution.
    pub(super) fn solve(&mut self, values: &mut [f64]) {
        let LbltWorkspace { symbolic, factor, subdiagonal, forward, inverse, memory } =
            &mut self.workspace;
        let order = PermRef::new_checked(&*forward, &*inverse, values.len());
        IntranodeLbltRef::new(symbolic, factor, subdiagonal, order).solve_in_place_with_conj(
            Conj::No,
            column(values),
            Par::Seq,
            MemStack::new(memory),
        );
    }
}

impl Lu {
    /// Analyses the pattern.
    ///
    /// # Errors
    /// Where there is not enough memory.
    pub(super) fn new<const D: usize>(
        matrix: &BlockColumns<D>,
        statistics: &mut LinearStatistics,
    ) -> Result<Self, LinearError> {
        statistics.symbolic_analyses += 1;
        let size = matrix.size();
        let columns = ScalarColumns::new(matrix);
        let symbolic = factorize_symbolic_lu(columns.pattern.as_ref(), LuSymbolicParams::default());
        let symbolic = symbolic.map_err(|_| LinearError::OutOfMemory { size })?;
        let requirements = [
            symbolic.factorize_numeric_lu_scratch::<f64>(Par::Seq, Spec::default()),
            symbolic.solve_in_place_scratch::<f64>(1, Par::Seq),
        ];
        let memory = allocate(size, &requirements)?;
        Ok(Self { columns, workspace: LuWorkspace { symbolic, factor: NumericLu::new(), memory } })
    }

    /// Factorises the matrix.
    ///
    /// # Errors
    /// Where its pattern is singular, or there is not enough memory.
    pub(super) fn factorise<const D: usize>(
        &mut self,
        matrix: &BlockColumns<D>,
        statistics: &mut LinearStatistics,
    ) -> Result<(), LinearError> {
        statistics.factorisations += 1;
        let size = matrix.size();
        let LuWorkspace { symbolic, factor, memory } = &mut self.workspace;
        let factorised = symbolic.factorize_numeric_lu(
            factor,
            self.columns.filled(matrix),
            Par::Seq,
            MemStack::new(memory),
            Spec::default(),
        );
        factorised.map(|_| ()).map_err(|error| match error {
            faer::sparse::linalg::LuError::SymbolicSingular { index } => {
                LinearError::Singular { pivot: index, size }
            }
            faer::sparse::linalg::LuError::Generic(_) => LinearError::OutOfMemory { size },
        })
    }

    /// Overwrites a right-hand side by the solution, which is not finite where a pivot is zero.
    pub(super) fn solve(&mut self, values: &mut [f64]) {
        let LuWorkspace { symbolic, factor, memory } = &mut self.workspace;
        LuRef::new_unchecked(symbolic, factor).solve_in_place_with_conj(
            Conj::No,
            column(values),
            Par::Seq,
            MemStack::new(memory),
        );
    }
}

impl ScalarColumns {
    fn new<const D: usize>(matrix: &BlockColumns<D>) -> Self {
        let (pattern, sources) = matrix.scalar_columns();
        Self { pattern, values: vec![0.0; sources.len()], sources }
    }

    /// The entries that `matrix` has now.
    fn filled<const D: usize>(
        &mut self,
        matrix: &BlockColumns<D>,
    ) -> SparseColMatRef<'_, u32, f64> {
        for (value, source) in self.values.iter_mut().zip(&self.sources) {
            *value = matrix.values[*source as usize];
        }
        SparseColMatRef::new(self.pattern.as_ref(), &self.values)
    }
}

fn column(values: &mut [f64]) -> MatMut<'_, f64> {
    let rows = values.len();
    MatMut::from_column_major_slice_mut(values, rows, 1)
}

/// Scratch memory for any one of `requirements`.
fn allocate(size: usize, requirements: &[StackReq]) -> Result<MemBuffer, LinearError> {
    MemBuffer::try_new(StackReq::any_of(requirements))
        .map_err(|_| LinearError::OutOfMemory { size })
}

/// So many zeros for a matrix of `size` rows: the fill may be more than there is memory.
fn zeros<T: Clone + Default>(size: usize, count: usize) -> Result<Vec<T>, LinearError> {
    let mut values = Vec::new();
    values.try_reserve_exact(count).map_err(|_| LinearError::OutOfMemory { size })?;
    values.resize(count, T::default());
    Ok(values)
}
