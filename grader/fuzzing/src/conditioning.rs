//! Conditioning of the linear systems of a scene's steps, from the whole inverse of each matrix.
//!
//! ```text
//! A δ = r(u)      A = M − h² ∂F/∂x − h ∂F/∂v
//! amplification   ‖A⁻¹ M‖_∞                                           1 where forces hold or dissipate
//! rounding        ε ‖ |A⁻¹| (M |u| + |A − M| (max |q|/h + |u|)) ‖₂    of an update, by that of positions and velocities
//! ```
//!
//! The simulator's own figure ([`Statistics::conditioning`]) costs nothing and is a lower bound, that of one right-hand side. Cost
//! here: an inverse for each system, so that only scenes are asked in which a program differs.

use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::DVector;
use scene::trace::State;
use scene::{Dimension, Scene};
use simulator::force::ForceKind;
use simulator::integrator::{BuildIntegrator, IntegratorKind, NewtonSystem, REGISTRY, Step};
use simulator::solver::linear::LinearSolver;
use simulator::statistics::Statistics;
use simulator::system::{BuildForce, System};

/// The worst of all systems of a run.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Conditioning {
    /// How many times larger than by the masses alone a change of velocity can be.
    pub(crate) amplification: f64,
    /// l2 norm of an update of velocities that is rounding error.
    pub(crate) rounding: f64,
}

impl Conditioning {
    /// That of a scene's steps, up to the first one that fails; 0 where the method solves no such systems.
    pub(crate) fn of(scene: &Scene) -> Self {
        let mut kinds = REGISTRY.iter();
        let kind = kinds.find(|kind| kind.schema.name == scene.integrator.name);
        match (kind, scene.dimension) {
            (None, _) => Self::default(),
            (Some(kind), Dimension::Two) => run::<2>(scene, kind),
            (Some(kind), Dimension::Three) => run::<3>(scene, kind),
        }
    }

    fn add(&mut self, system: &NewtonSystem<'_>, masses: &[f64], places: &[usize]) {
        let Some(inverse) = system.matrix.clone().try_inverse() else {
            self.amplification = f64::INFINITY;
            return;
        };
        let h = system.h;
        let rows = inverse.row_iter();
        let sums =
            rows.map(|row| row.iter().zip(masses).map(|(x, mass)| x.abs() * mass).sum::<f64>());
        self.amplification = sums.fold(self.amplification, f64::max);
        let at = |values: &[f64]| {
            DVector::from_iterator(places.len(), places.iter().map(|place| values[*place].abs()))
        };
        let velocities = at(system.iterate);
        let size = system.positions.iter().fold(0.0_f64, |size, value| size.max(value.abs()));
        let mut forces = system.matrix.clone();
        for (place, mass) in masses.iter().enumerate() {
            forces[(place, place)] -= mass;
        }
        let momenta = velocities.component_mul(&DVector::from_column_slice(masses));
        let sums = momenta + forces.abs() * (velocities.add_scalar(size / h));
        let rounding = f64::EPSILON * (inverse.abs() * sums).norm();
        self.rounding = self.rounding.max(rounding);
    }
}

fn run<const D: usize>(scene: &Scene, kind: &IntegratorKind) -> Conditioning
where
    ForceKind: BuildForce<D>,
    IntegratorKind: BuildIntegrator<D>,
{
    let free = || scene.particles.iter().enumerate().filter(|(_, particle)| !particle.fixed);
    let places: Vec<usize> =
        free().flat_map(|(number, _)| (0..D).map(move |axis| D * number + axis)).collect();
    let masses: Vec<f64> = free().flat_map(|(_, particle)| [particle.mass; D]).collect();
    let system = System::<D>::new(scene);
    let mut method = kind.build(scene, &system, LinearSolver::Auto);
    let worst = Arc::new(Mutex::new(Conditioning::default()));
    let observed = Arc::clone(&worst);
    method.observe(Box::new(move |system| {
        observed.lock().unwrap_or_else(PoisonError::into_inner).add(system, &masses, &places);
    }));
    let (mut positions, mut velocities) = (scene.positions(), scene.velocities());
    let h = scene.time_step;
    let mut earlier: Option<State> = None;
    for step in 0..scene.n_steps() {
        let start =
            State { time: None, positions: positions.clone(), velocities: velocities.clone() };
        let step = Step {
            size: h,
            time: step as f64 * h,
            positions: &mut positions,
            velocities: &mut velocities,
            earlier: earlier.as_ref(),
            statistics: &mut Statistics::default(),
        };
        if method.step(&system, step).is_err() {
            break;
        }
        earlier = Some(start);
    }
    *worst.lock().unwrap_or_else(PoisonError::into_inner)
}
