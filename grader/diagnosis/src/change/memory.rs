//! What a program keeps from one step to the next: sums that are never cleared, values that are computed once.

use nalgebra::DMatrix;

use super::Kept;

/// The kept values, after the steps made so far; those of a program that has made none by default.
#[derive(Debug, Clone, Default)]
pub struct Memory {
    force: Option<Vec<f64>>,
    jacobians: [Option<DMatrix<f64>>; 2],
    n_masses: f64,
}

impl Memory {
    /// The force that a step uses, where this one is evaluated.
    pub(super) fn force(&mut self, kept: Option<Kept>, mut force: Vec<f64>) -> Vec<f64> {
        let Some(Kept { summed, .. }) = kept.filter(|kept| kept.forces) else { return force };
        match &self.force {
            Some(before) if summed => force.iter_mut().zip(before).for_each(|(f, b)| *f += b),
            Some(before) => force.clone_from(before),
            None => {}
        }
        self.force = Some(force.clone());
        force
    }

    /// The Jacobians that a step uses, where these are evaluated.
    pub(super) fn jacobians(
        &mut self,
        kept: Option<Kept>,
        mut both: [DMatrix<f64>; 2],
    ) -> [DMatrix<f64>; 2] {
        let Some(Kept { summed, jacobians, .. }) = kept else { return both };
        for ((matrix, before), _) in
            both.iter_mut().zip(&mut self.jacobians).zip(jacobians).filter(|(_, kept)| *kept)
        {
            match before {
                Some(before) if summed => *matrix += &*before,
                Some(before) => matrix.clone_from(before),
                None => {}
            }
            *before = Some(matrix.clone());
        }
        both
    }

    /// How often the matrix of a step has the masses.
    pub(super) fn masses(&mut self, kept: Option<Kept>) -> f64 {
        let is_summed = kept.is_some_and(|kept| kept.inertia && kept.summed);
        self.n_masses = if is_summed { self.n_masses + 1.0 } else { 1.0 };
        self.n_masses
    }
}
