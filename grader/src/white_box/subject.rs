//! The interface of a force whose Jacobians are checked.
//!
//! A [`Subject`] is a small system of `n` particles in `D` dimensions: its force, both Jacobians of the force, the
//! couplings that it claims, and its energy, if it has one. The simulator's [`System`] is one ([`Simulated`]). The
//! check uses nothing else, so that any implementation of these functions can be judged.
//!
//! Positions, velocities and forces hold `n·D` numbers, particle-major; a Jacobian is a dense matrix of `n·D`
//! rows (of the force) and columns (of the position or velocity).

use reference::law::Jacobians;
use scene::{Dimension, Scene};
use simulator::force::{
    self, Coupling, Degenerate, ElementJacobians, Force, ForceKind, JacobianSink, Numbered, State,
};
use simulator::system::{BuildForce, System};

/// A force with its Jacobians, of a system with one kind of force and no fixed particle.
pub trait Subject {
    /// Sets `force` to the force on every particle.
    ///
    /// # Errors
    /// If it is undefined there.
    fn force(&self, x: &[f64], v: &[f64], time: f64, force: &mut [f64]) -> Result<(), Degenerate>;

    /// Both Jacobians, as the subject computes them.
    ///
    /// # Errors
    /// If they are undefined there.
    fn jacobians(&self, x: &[f64], v: &[f64], time: f64) -> Result<Jacobians, Degenerate>;

    /// The potential energy, if the force has one.
    fn energy(&self, x: &[f64], v: &[f64], time: f64) -> Option<f64>;

    /// The couplings that the subject claims for its Jacobians.
    fn couplings(&self) -> Vec<Coupling>;
}

/// Makes the subject of a scene.
pub type Maker<'a> = dyn Fn(&Scene) -> Box<dyn Subject> + Sync + 'a;

/// The built-in simulator's force.
pub fn simulated(scene: &Scene) -> Box<dyn Subject> {
    simulated_of_kinds(scene, force::REGISTRY)
}

/// The same with forces of these kinds.
pub fn simulated_of_kinds(scene: &Scene, kinds: &[&ForceKind]) -> Box<dyn Subject> {
    match scene.dimension {
        Dimension::Two => Box::new(Simulated::<2>::new(scene, kinds)),
        Dimension::Three => Box::new(Simulated::<3>::new(scene, kinds)),
    }
}

/// The simulator's system of a scene.
struct Simulated<const D: usize> {
    system: System<D>,
    /// Each kind of force by itself, to find out whether it has an energy.
    forces: Vec<Box<dyn Force<D>>>,
}

impl<const D: usize> Simulated<D>
where
    ForceKind: BuildForce<D>,
{
    fn new(scene: &Scene, kinds: &[&ForceKind]) -> Self {
        let build = |kind: &&ForceKind| {
            let is_of_kind = |(_, element): &Numbered<'_>| *element.schema == kind.schema;
            let elements: Vec<Numbered<'_>> =
                scene.forces.iter().enumerate().filter(is_of_kind).collect();
            (!elements.is_empty()).then(|| kind.build(scene, &elements))
        };
        Self {
            system: System::of_kinds(scene, kinds),
            forces: kinds.iter().filter_map(build).collect(),
        }
    }
}

impl<const D: usize> Subject for Simulated<D> {
    fn force(&self, x: &[f64], v: &[f64], time: f64, force: &mut [f64]) -> Result<(), Degenerate> {
        self.system.force(x, v, time, force)
    }

    fn jacobians(&self, x: &[f64], v: &[f64], time: f64) -> Result<Jacobians, Degenerate> {
        let mut sink = Dense(Jacobians::zeros(x.len()));
        self.system.jacobians(x, v, time, &mut sink)?;
        Ok(sink.0)
    }

    fn energy(&self, x: &[f64], v: &[f64], time: f64) -> Option<f64> {
        let state = State { masses: self.system.masses(), positions: x, velocities: v, time };
        self.forces.iter().map(|force| force.energy(state)).sum()
    }

    fn couplings(&self) -> Vec<Coupling> {
        let mut couplings = Vec::new();
        self.system.couplings(&mut |coupling| couplings.push(coupling));
        couplings
    }
}

/// Adds blocks to dense matrices.
struct Dense(Jacobians);

impl<const D: usize> JacobianSink<D> for Dense {
    fn add(&mut self, element: ElementJacobians<'_, D>) {
        let Jacobians { by_position, by_velocity } = &mut self.0;
        for (matrix, blocks) in
            [(by_position, element.by_position), (by_velocity, element.by_velocity)]
        {
            element.spread(blocks, |row, column, block| {
                let mut view = matrix.fixed_view_mut::<D, D>(row * D, column * D);
                view += block;
            });
        }
    }
}
