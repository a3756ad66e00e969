//! Sparse LU with partial pivoting, for unsymmetric matrices and where [`ldl`](super::ldl) is not accurate enough.
//!
//! It is faer's, on one thread, so that the bits do not depend on the number of threads; they do depend on the vector
//! instructions of the processor. The pattern is analysed once; after that nothing is allocated. Cost: that of the
//! fill.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::sparse::linalg::lu::{
    LuRef, LuSymbolicParams, NumericLu, SymbolicLu, factorize_symbolic_lu,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};
use faer::{Conj, MatMut, Par, Spec};

use super::LinearError;
use super::blocks::BlockColumns;
use crate::statistics::LinearStatistics;

/// The matrix entry by entry, with its factor and workspace.
pub(super) struct Lu {
    pattern: SymbolicSparseColMat<u32>,
    values: Vec<f64>,
    /// Where each entry is among the values of the blocks.
    sources: Vec<u32>,
    symbolic: SymbolicLu<u32>,
    factor: NumericLu<u32, f64>,
    memory: MemBuffer,
}

impl Lu {
    /// Analyses the pattern.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub(super) fn new<const D: usize>(
        matrix: &BlockColumns<D>,
        statistics: &mut LinearStatistics,
    ) -> Result<Self, LinearError> {
        statistics.symbolic_analyses += 1;
        let out_of_memory = LinearError::OutOfMemory { size: matrix.size() };
        let (pattern, sources) = matrix.scalar_columns();
        let symbolic = factorize_symbolic_lu(pattern.as_ref(), LuSymbolicParams::default());
        let symbolic = symbolic.map_err(|_| out_of_memory.clone())?;
        let scratch = StackReq::any_of(&[
            symbolic.factorize_numeric_lu_scratch::<f64>(Par::Seq, Spec::default()),
            symbolic.solve_in_place_scratch::<f64>(1, Par::Seq),
        ]);
        let memory = MemBuffer::try_new(scratch).map_err(|_| out_of_memory)?;
        let values = vec![0.0; sources.len()];
        Ok(Self { pattern, values, sources, symbolic, factor: NumericLu::new(), memory })
    }

    /// Factorises the matrix.
    ///
    /// # Errors
    /// If its pattern is singular, or there is not enough memory.
    pub(super) fn factorise<const D: usize>(
        &mut self,
        matrix: &BlockColumns<D>,
        statistics: &mut LinearStatistics,
    ) -> Result<(), LinearError> {
        statistics.factorisations += 1;
        let size = matrix.size();
        for (value, source) in self.values.iter_mut().zip(&self.sources) {
            *value = matrix.values[*source as usize];
        }
        let factorised = self.symbolic.factorize_numeric_lu(
            &mut self.factor,
            SparseColMatRef::new(self.pattern.as_ref(), &self.values),
            Par::Seq,
            MemStack::new(&mut self.memory),
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
        let rows = values.len();
        LuRef::new_unchecked(&self.symbolic, &self.factor).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(values, rows, 1),
            Par::Seq,
            MemStack::new(&mut self.memory),
        );
    }
}
