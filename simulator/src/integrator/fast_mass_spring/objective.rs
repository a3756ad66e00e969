//! The objective of a step, and its iterate.
//!
//! With `u = x − x^n`, the displacement that is sought, and up to a constant,
//!
//! ```text
//! E(u) = Σ a_i/2 |u_i|² − Σ y_i·u_i + Σ_springs k/2 (l − l0)²
//! a_i = m_i/h² (+ w on pins)        y_i = m_i v_i/h + f_i (+ w (target_i − x_i^n))
//! −∇E  = y − a u + Σ k A_eᵀ (d_e − A_e x) = b − Q x
//! ```
//!
//! so that a round of the method, `Q x' = b`, is `x' = x + Q⁻¹ (b − Q x)`: it is solved for the change, whose
//! rounding errors the next round takes back. Velocities are `u/h`, without the digits that a difference of
//! positions would lose. Everything is in slots: unknowns in the order of elimination, then the fixed
//! particles that are not unknowns, then one unused slot.

use sparse::LinearError;
use sparse::statistics::FactorWork;

use super::global::{GlobalMatrix, GlobalSolver, Storage, add};
use super::local::{ElasticSpring, SpringGroups, Undirected};
use crate::force::Degenerate;
use crate::integrator::StepError;
use crate::sizes::MAX_DENSE_GLOBAL_ROWS;
use crate::statistics::Statistics;

/// The energy of a step at an iterate, up to a constant.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Energy {
    pub(super) value: f64,
    /// Sum of the magnitudes of its terms: what its rounding is relative to.
    pub(super) magnitude: f64,
}

/// The data of a scene that stay constant over a run.
pub(super) struct Terms<'a> {
    /// Mass of each particle.
    pub(super) masses: &'a [f64],
    /// Which particles are fixed.
    pub(super) fixed: &'a [bool],
    /// Springs between particles.
    pub(super) springs: &'a [ElasticSpring],
    /// Weight of the penalty on a fixed particle; `None` if it is no unknown.
    pub(super) pin_weight: Option<f64>,
    /// How `Q` is factorised; `None` chooses by size.
    pub(super) storage: Option<Storage>,
}

/// The minimisation of one step, of vectors padded to `P` components.
pub(super) struct StepObjective<const P: usize> {
    /// Time step.
    pub(super) h: f64,
    /// The particle of each slot; unknowns first.
    pub(super) particles: Vec<usize>,
    n_unknowns: usize,
    springs: SpringGroups,
    global: GlobalSolver<P>,
    /// Springs from an unknown to a fixed particle that is not one: slots and stiffness.
    boundary: Vec<(usize, usize, f64)>,
    /// `a`, of each unknown.
    pub(super) weights: Vec<f64>,
    /// `y`, of each unknown.
    pub(super) load: Vec<[f64; P]>,
    /// `x^n`, and where the fixed particles go; every slot.
    pub(super) start: Vec<[f64; P]>,
    /// Displacement of the fixed particles over the step; 0 on unknowns.
    pub(super) drift: Vec<[f64; P]>,
    /// The iterate `u`.
    pub(super) u: Vec<[f64; P]>,
    /// `x^n + u`, of every slot.
    x: Vec<[f64; P]>,
    /// `−∇E` at the iterate; what is there of slots beyond the unknowns means nothing.
    residual: Vec<[f64; P]>,
    /// The last right-hand side of the global step, and its solution.
    right: Vec<[f64; P]>,
    change: Vec<[f64; P]>,
}

impl<const P: usize> StepObjective<P> {
    /// Chooses the unknowns, and factorises.
    ///
    /// # Errors
    /// If the matrix cannot be factorised.
    pub(super) fn new(
        terms: &Terms<'_>,
        h: f64,
        statistics: &mut Statistics,
    ) -> Result<Self, LinearError> {
        let is_unknown = |particle: &usize| !terms.fixed[*particle] || terms.pin_weight.is_some();
        let (unknowns, others): (Vec<usize>, Vec<usize>) =
            (0..terms.masses.len()).partition(is_unknown);
        let mut row_of = vec![None; terms.masses.len()];
        for (row, particle) in unknowns.iter().enumerate() {
            row_of[*particle] = Some(row);
        }
        let weight = |particle: &usize| {
            let inertia = terms.masses[*particle] / h / h;
            match terms.pin_weight {
                Some(weight) if terms.fixed[*particle] => inertia + weight,
                _ => inertia,
            }
        };
        let mut matrix =
            GlobalMatrix { diagonal: unknowns.iter().map(weight).collect(), links: Vec::new() };
        for ElasticSpring { ends, stiffness, .. } in terms.springs {
            let rows = ends.map(|end| row_of[end]);
            rows.iter().flatten().for_each(|row| matrix.diagonal[*row] += stiffness);
            if let [Some(i), Some(j)] = rows {
                matrix.links.push(([i, j], *stiffness));
            }
        }
        let by_size =
            if unknowns.len() <= MAX_DENSE_GLOBAL_ROWS { Storage::Dense } else { Storage::Sparse };
        let storage = terms.storage.unwrap_or(by_size);
        let (global, order) = GlobalSolver::new(&matrix, storage, &mut statistics.linear)?;
        statistics.assemblies += 1;
        statistics.linear_solver = global.describe();

        let n_unknowns = unknowns.len();
        let mut particles: Vec<usize> = order.iter().map(|row| unknowns[*row]).collect();
        particles.extend(&others);
        let mut slot_of = vec![0; particles.len()];
        for (slot, particle) in particles.iter().enumerate() {
            slot_of[*particle] = slot;
        }
        let in_slots = |spring: &ElasticSpring| ElasticSpring {
            ends: spring.ends.map(|end| slot_of[end]),
            ..*spring
        };
        let mut springs: Vec<ElasticSpring> = terms.springs.iter().map(in_slots).collect();
        let n_slots = particles.len() + 1;
        let groups = SpringGroups::new(&mut springs, n_slots - 1);
        let boundary =
            springs.iter().filter_map(|&ElasticSpring { ends: [i, j], stiffness, .. }| {
                match (i < n_unknowns, j < n_unknowns) {
                    (true, false) => Some((i, j, stiffness)),
                    (false, true) => Some((j, i, stiffness)),
                    _ => None,
                }
            });
        Ok(Self {
            h,
            n_unknowns,
            springs: groups,
            global,
            boundary: boundary.collect(),
            weights: particles[..n_unknowns].iter().map(weight).collect(),
            load: vec![[0.0; P]; n_unknowns],
            start: vec![[0.0; P]; n_slots],
            drift: vec![[0.0; P]; n_slots],
            u: vec![[0.0; P]; n_unknowns],
            x: vec![[0.0; P]; n_slots],
            residual: vec![[0.0; P]; n_slots],
            right: vec![[0.0; P]; n_unknowns],
            change: vec![[0.0; P]; n_unknowns],
            particles,
        })
    }

    /// Slots that are unknowns; they come first.
    pub(super) fn n_unknowns(&self) -> usize {
        self.n_unknowns
    }

    /// `−∇E` at the iterate.
    pub(super) fn residual(&self) -> &[[f64; P]] {
        &self.residual[..self.n_unknowns]
    }

    /// The first round starts from `x^n` on all particles, the fixed ones included, and ends with these where
    /// they are at the end of the step: its right-hand side.
    ///
    /// # Errors
    /// If a spring has no direction.
    pub(super) fn start(&mut self) -> Result<(), Degenerate> {
        self.u.fill([0.0; P]);
        self.evaluate::<false>()?;
        for &(unknown, fixed, stiffness) in &self.boundary {
            for axis in 0..P {
                self.residual[unknown][axis] += stiffness * self.drift[fixed][axis];
            }
        }
        add(&mut self.start, &self.drift);
        Ok(())
    }

    /// Computes `−∇E` at the iterate, and returns `E` where `ENERGY` is true.
    ///
    /// # Errors
    /// If a spring has no direction.
    pub(super) fn evaluate<const ENERGY: bool>(&mut self) -> Result<Energy, Degenerate> {
        let mut energy = Energy::default();
        self.x.copy_from_slice(&self.start);
        let unknowns = self.x.iter_mut().zip(&mut self.residual).zip(&self.u);
        for (((x, residual), u), (load, weight)) in
            unknowns.zip(self.load.iter().zip(&self.weights))
        {
            let (mut inertial, mut work) = (0.0, 0.0);
            for axis in 0..P {
                x[axis] += u[axis];
                residual[axis] = load[axis] - weight * u[axis];
                if ENERGY {
                    inertial += 0.5 * weight * u[axis] * u[axis];
                    work += load[axis] * u[axis];
                }
            }
            energy.value += inertial - work;
            energy.magnitude += inertial + work.abs();
        }
        let springs = self.springs.pull::<P, ENERGY>(&self.x, &mut self.residual);
        let elastic = springs.map_err(|Undirected { element, slots }| Degenerate {
            element,
            particles: slots.map(|slot| self.particles[slot]).into(),
        })?;
        energy.value += elastic;
        energy.magnitude += elastic;
        Ok(energy)
    }

    /// Solves `Q change = right` for the right-hand side that `fill` makes of `−∇E`.
    pub(super) fn solve(&mut self, fill: impl FnOnce(&[[f64; P]], &mut [[f64; P]])) {
        fill(&self.residual[..self.n_unknowns], &mut self.right);
        self.change.copy_from_slice(&self.right);
        self.global.solve(&mut self.change);
    }

    /// Substitutes with the factor, for [`solve`](Self::solve).
    pub(super) fn work_of_solve(&self) -> FactorWork {
        self.global.work_of_solve()
    }

    /// The plain round: solves for the change from `−∇E`, and makes it.
    pub(super) fn round(&mut self) {
        self.solve(|residual, right| right.copy_from_slice(residual));
        self.apply_change();
    }

    /// `u ← u + change`.
    pub(super) fn apply_change(&mut self) {
        add(&mut self.u, &self.change);
    }

    /// The last solution of the global step.
    pub(super) fn change(&self) -> &[[f64; P]] {
        &self.change
    }

    /// `|δ|_Q²` of the last solution `δ`.
    pub(super) fn change_squared(&self) -> f64 {
        let products = self.change.as_flattened().iter().zip(self.right.as_flattened());
        products.map(|(change, right)| change * right).sum()
    }

    /// Judges the last solution. Where its error is more than rounding and `u` was changed by it, that error is
    /// taken back.
    ///
    /// # Errors
    /// If the error is larger than refinement can repair.
    pub(super) fn check(
        &mut self,
        changed_by_it: bool,
        statistics: &mut Statistics,
    ) -> Result<(), StepError> {
        let Self { global, change, right, u, .. } = self;
        match global.check(change, right, &mut statistics.linear)? {
            Some(correction) if changed_by_it => add(u, correction),
            _ => {}
        }
        Ok(())
    }
}

/// The largest component; a NaN if there is one.
pub(super) fn largest<const P: usize>(values: &[[f64; P]]) -> f64 {
    let larger = |a: f64, b: &f64| if b.abs() <= a { a } else { b.abs() };
    values.as_flattened().iter().fold(0.0, larger)
}
