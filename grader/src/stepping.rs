//! Single steps of the built-in simulator, from whatever state is asked for.
//!
//! [`simulator::simulation::Simulation`] runs a scene from its own start; here the caller holds the state. Shapes:
//! positions and velocities hold `n·D` numbers, particle-major. Cost: that of the scene's integrator, a step.

use simulator::force::ForceKind;
use simulator::integrator::{BuildIntegrator, Integrator, IntegratorKind, REGISTRY, Step};
use simulator::scene::{Dimension, Scene};
use simulator::solver::linear::LinearSolver;
use simulator::statistics::Statistics;
use simulator::system::{BuildForce, System};

/// A scene's physics with its integrator.
pub struct Stepper {
    physics: Box<dyn Physics>,
    time_step: f64,
}

/// Energy and momentum of a state.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Invariants {
    /// Kinetic and potential energy.
    pub energy: f64,
    /// Momentum; z is 0 in two dimensions.
    pub momentum: [f64; 3],
}

impl Stepper {
    /// The physics of `scene`, its linear systems given to these solvers.
    ///
    /// # Panics
    /// Where the scene's integrator is not one of the registry.
    pub fn new(scene: &Scene, solver: LinearSolver) -> Self {
        let physics: Box<dyn Physics> = match scene.dimension {
            Dimension::Two => Parts::<2>::of(scene, solver),
            Dimension::Three => Parts::<3>::of(scene, solver),
        };
        Self { physics, time_step: scene.time_step }
    }

    /// Replaces the state at the beginning of step `step`, from 0, by that at its end; false where the step has
    /// no answer, or one that is not finite. The state is then meaningless.
    pub fn step(&mut self, step: u64, positions: &mut [f64], velocities: &mut [f64]) -> bool {
        let time = step as f64 * self.time_step;
        let step = Step {
            size: self.time_step,
            time,
            positions: &mut *positions,
            velocities: &mut *velocities,
            statistics: &mut Statistics::default(),
        };
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        self.physics.step(step) && finite(positions) && finite(velocities)
    }

    /// Energy and momentum of the state at the beginning of step `step`.
    pub fn invariants(&self, step: u64, positions: &[f64], velocities: &[f64]) -> Invariants {
        self.physics.invariants(step as f64 * self.time_step, positions, velocities)
    }
}

/// [`Parts`], their dimension forgotten.
trait Physics: Send {
    fn step(&mut self, step: Step<'_>) -> bool;
    fn invariants(&self, time: f64, positions: &[f64], velocities: &[f64]) -> Invariants;
}

struct Parts<const D: usize> {
    system: System<D>,
    integrator: Box<dyn Integrator<D>>,
}

impl<const D: usize> Parts<D>
where
    ForceKind: BuildForce<D>,
    IntegratorKind: BuildIntegrator<D>,
{
    fn of(scene: &Scene, solver: LinearSolver) -> Box<dyn Physics> {
        let system = System::new(scene);
        let kind = REGISTRY.iter().find(|kind| kind.schema.name == scene.integrator.name);
        let kind = kind.expect("a scene holds schemas of the registry");
        let integrator = kind.build(scene, &system, solver);
        Box::new(Self { system, integrator })
    }
}

impl<const D: usize> Physics for Parts<D> {
    fn step(&mut self, step: Step<'_>) -> bool {
        self.integrator.step(&self.system, step).is_ok()
    }

    fn invariants(&self, time: f64, positions: &[f64], velocities: &[f64]) -> Invariants {
        let kinetic = self.system.kinetic_energy(velocities);
        let potential = self.system.potential_energy(positions, velocities, time);
        let mut momentum = [0.0; 3];
        momentum[..D].copy_from_slice(&self.system.momentum(velocities));
        Invariants { energy: kinetic + potential, momentum }
    }
}
