//! A scene stepped from its start to its end.

use std::fmt;

use crate::force::ForceKind;
use crate::integrator::{BuildIntegrator, Integrator, IntegratorKind, REGISTRY, Step, StepError};
use crate::scene::{Dimension, Location, Scene};
use crate::solver::LinearError;
use crate::solver::linear::LinearSolver;
use crate::state::{Energies, StateView};
use crate::statistics::Statistics;
use crate::system::{BuildForce, System};

/// A scene on its way. The dimension is dispatched here, once.
pub struct Simulation {
    run: Box<dyn Run>,
    scene: String,
    forces: Vec<(&'static str, [usize; 2], Location)>,
    dimension: Dimension,
    time_step: f64,
    n_steps: u64,
    positions: Vec<f64>,
    velocities: Vec<f64>,
    statistics: Statistics,
}

impl Simulation {
    /// Puts the scene at its initial state.
    ///
    /// # Panics
    /// Where the scene's integrator is not one of the registry.
    pub fn new(scene: &Scene) -> Self {
        Self::with_solver(scene, LinearSolver::Auto)
    }

    /// The same, its linear systems given to these solvers instead of to what fits them.
    ///
    /// # Panics
    /// Where the scene's integrator is not one of the registry.
    pub fn with_solver(scene: &Scene, solver: LinearSolver) -> Self {
        let of_every_particle = |vector: fn(&crate::scene::Particle) -> &[f64; 3]| {
            let components = scene.dimension.count();
            let particles = scene.particles.iter();
            particles.flat_map(|particle| vector(particle)[..components].to_vec()).collect()
        };
        let run: Box<dyn Run> = match scene.dimension {
            Dimension::Two => Runner::<2>::start(scene, solver),
            Dimension::Three => Runner::<3>::start(scene, solver),
        };
        let forces = scene.forces.iter().map(|element| {
            (element.schema.tag, element.pair.unwrap_or_default(), element.location)
        });
        Self {
            run,
            scene: scene.name.clone(),
            forces: forces.collect(),
            dimension: scene.dimension,
            time_step: scene.time_step,
            n_steps: scene.n_steps(),
            positions: of_every_particle(|particle| &particle.position),
            velocities: of_every_particle(|particle| &particle.velocity),
            statistics: Statistics::default(),
        }
    }

    /// Takes the next step; false where the scene is at its end.
    ///
    /// # Errors
    /// Where the step has no answer. The simulation is then of no further use.
    pub fn advance(&mut self) -> Result<bool, SimulationError> {
        if self.statistics.steps == self.n_steps {
            return Ok(false);
        }
        let step = Step {
            size: self.time_step,
            time: self.statistics.steps as f64 * self.time_step,
            positions: &mut self.positions,
            velocities: &mut self.velocities,
            statistics: &mut self.statistics,
        };
        self.run.step(step).map_err(|error| self.failure(FailureKind::of(error, &self.forces)))?;
        if let Some(kind) = self.not_finite() {
            return Err(self.failure(kind));
        }
        self.statistics.steps += 1;
        Ok(true)
    }

    /// The current state.
    pub fn state(&self) -> StateView<'_> {
        StateView {
            step: self.statistics.steps,
            time: self.statistics.steps as f64 * self.time_step,
            positions: &self.positions,
            velocities: &self.velocities,
        }
    }

    /// Energies and momentum of the current state.
    ///
    /// # Errors
    /// Where one of them is not finite.
    pub fn energies(&self) -> Result<Energies, SimulationError> {
        let energies = self.run.energies(self.state());
        let Energies { kinetic, potential, momentum } = &energies;
        let finite = (kinetic + potential).is_finite() && momentum.iter().all(|p| p.is_finite());
        if finite {
            return Ok(energies);
        }
        // A force that is not defined here would say so in the next step; it says more than its energy.
        let undefined = self.run.check(self.state()).err();
        let kind = match undefined {
            Some(error) => FailureKind::of(error, &self.forces),
            None => FailureKind::EnergyNotFinite,
        };
        Err(self.failure(kind))
    }

    /// What the run has cost so far.
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// How many coordinates a particle has.
    pub fn dimension(&self) -> Dimension {
        self.dimension
    }

    /// Steps from the start to the end of the scene.
    pub fn n_steps(&self) -> u64 {
        self.n_steps
    }

    fn failure(&self, kind: FailureKind) -> SimulationError {
        let step = self.statistics.steps + 1;
        let time = self.statistics.steps as f64 * self.time_step;
        SimulationError { scene: self.scene.clone(), step, time, kind }
    }

    fn not_finite(&self) -> Option<FailureKind> {
        let count = self.dimension.count();
        let look = |values: &[f64], what| {
            // Without an early exit, the usual case is one vectorised pass.
            let all = pulp::Arch::new().dispatch(
                #[inline(always)]
                || values.iter().fold(true, |all, value| all & value.is_finite()),
            );
            let place = if all { None } else { values.iter().position(|value| !value.is_finite()) };
            place.map(|place| FailureKind::NotFinite {
                what,
                particle: place / count,
                coordinate: ["x", "y", "z"][place % count],
            })
        };
        look(&self.positions, "position").or_else(|| look(&self.velocities, "velocity"))
    }
}

/// A system with its integrator, its dimension forgotten.
trait Run: Send {
    fn step(&mut self, step: Step<'_>) -> Result<(), StepError>;
    fn energies(&self, state: StateView<'_>) -> Energies;
    /// Whether every force is defined at this state.
    fn check(&self, state: StateView<'_>) -> Result<(), StepError>;
}

struct Runner<const D: usize> {
    system: System<D>,
    integrator: Box<dyn Integrator<D>>,
}

impl<const D: usize> Runner<D>
where
    ForceKind: BuildForce<D>,
    IntegratorKind: BuildIntegrator<D>,
{
    fn start(scene: &Scene, solver: LinearSolver) -> Box<dyn Run> {
        let system = System::new(scene);
        let kind = REGISTRY.iter().find(|kind| kind.schema.name == scene.integrator.name);
        let kind = kind.expect("a scene holds schemas of the registry");
        let integrator = kind.build(scene, &system, solver);
        Box::new(Self { system, integrator })
    }
}

impl<const D: usize> Run for Runner<D> {
    fn check(
        &self,
        StateView { time, positions, velocities, .. }: StateView<'_>,
    ) -> Result<(), StepError> {
        let mut force = vec![0.0; positions.len()];
        Ok(self.system.force(positions, velocities, time, &mut force)?)
    }

    fn step(&mut self, step: Step<'_>) -> Result<(), StepError> {
        self.integrator.step(&self.system, step)
    }

    fn energies(&self, StateView { time, positions, velocities, .. }: StateView<'_>) -> Energies {
        Energies {
            kinetic: self.system.kinetic_energy(velocities),
            potential: self.system.potential_energy(positions, velocities, time),
            momentum: self.system.momentum(velocities).to_vec(),
        }
    }
}

/// A scene that could not be simulated to its end.
///
/// Displays as one message and a second line `  help: remedy`.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub struct SimulationError {
    /// The scene, as messages call it.
    pub scene: String,
    /// The step that has no answer, from 1.
    pub step: u64,
    /// The time at which that step starts, in seconds.
    pub time: f64,
    /// Why.
    pub kind: FailureKind,
}

/// Why a step has no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what the variants and their fields are")]
pub enum FailureKind {
    #[error("<{tag}> has no direction: particles {} and {} are at the same place", particles[0], particles[1])]
    Coincident { tag: &'static str, particles: [usize; 2], location: Location },
    #[error(
        "Newton's method did not converge: after {iterations} iterations the update is {update:.1e} and the residual {residual:.1e}"
    )]
    NotConverged { iterations: u64, update: f64, residual: f64 },
    #[error(
        "Newton's method cannot converge: its tolerance is below the rounding of velocities of size {speed:.1e}; after {iterations} iterations the update is {update:.1e}"
    )]
    BelowRounding { iterations: u64, update: f64, speed: f64 },
    #[error(
        "the line search found no descent: after {iterations} iterations, Newton's step of {update:.1e} leads uphill"
    )]
    NoDescent { iterations: u64, update: f64 },
    #[error("the linear system of the step cannot be solved: {0}")]
    Linear(LinearError),
    #[error("the energy of the state is not finite")]
    EnergyNotFinite,
    #[error("the {what} of particle {particle} is no longer finite (coordinate {coordinate})")]
    NotFinite { what: &'static str, particle: usize, coordinate: &'static str },
}

impl FailureKind {
    fn of(error: StepError, forces: &[(&'static str, [usize; 2], Location)]) -> Self {
        match error {
            StepError::Degenerate(degenerate) => {
                let (tag, particles, location) = forces[degenerate.element];
                Self::Coincident { tag, particles, location }
            }
            StepError::NotConverged { iterations, update, residual } => {
                Self::NotConverged { iterations, update, residual }
            }
            StepError::BelowRounding { iterations, update, speed } => {
                Self::BelowRounding { iterations, update, speed }
            }
            StepError::NoDescent { iterations, update } => Self::NoDescent { iterations, update },
            StepError::Linear(error) => Self::Linear(error),
        }
    }

    fn remedy(&self) -> &'static str {
        match self {
            Self::Coincident { .. } => "move one of them, or shorten the time step",
            Self::NotConverged { .. } | Self::NotFinite { .. } => {
                "shorten the time step, or soften the forces; the motion may be unstable"
            }
            Self::NoDescent { .. } => {
                "project the Hessian (projection=\"clamp\"), or shorten the time step"
            }
            Self::BelowRounding { .. } => "choose units in which the velocities are smaller",
            Self::EnergyNotFinite => "move apart what is in one place; check masses and velocities",
            Self::Linear(LinearError::OutOfMemory { .. }) => {
                "make the scene smaller, or use symplectic-euler, which needs no matrix"
            }
            Self::Linear(LinearError::Unsettled { .. }) => {
                "soften the forces, or shorten the time step"
            }
            Self::Linear(_) => "shorten the time step; check masses and stiffnesses",
        }
    }
}

impl fmt::Display for SimulationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:", self.scene)?;
        if let FailureKind::Coincident { location: Location { line, column }, .. } = self.kind {
            write!(f, "{line}:{column}:")?;
        }
        write!(f, " step {} (from t = {} s):", self.step, self.time)?;
        write!(f, " {}\n  help: {}", self.kind, self.kind.remedy())
    }
}
