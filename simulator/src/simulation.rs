//! A scene stepped from its start to its end.

use std::fmt;

use crate::force::ForceKind;
use crate::integrator::{BuildIntegrator, Integrator, IntegratorKind, REGISTRY, Step, StepError};
use crate::rescue::MAX_HALVINGS;
use crate::scene::{Dimension, Location, Scene};
use crate::solver::LinearError;
use crate::solver::linear::LinearSolver;
use crate::state::{Energies, StateView};
use crate::statistics::Statistics;
use crate::system::{BuildForce, System};

/// How a scene is stepped, beside what it says itself.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Config {
    /// Which solvers linear systems are given to.
    pub solver: LinearSolver,
    /// Whether a step that has no answer is tried again in other ways, as [`rescue`](crate::rescue) says.
    pub robust: bool,
}

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
    rescue: Option<Rescue>,
}

/// What it takes to take a step once more.
struct Rescue {
    scene: Scene,
    solver: LinearSolver,
    /// Made at the first failure.
    run: Option<Box<dyn Run>>,
    positions: Vec<f64>,
    velocities: Vec<f64>,
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
        Self::with_config(scene, Config { solver, robust: false })
    }

    /// The same, stepped as `config` says.
    ///
    /// # Panics
    /// Where the scene's integrator is not one of the registry.
    pub fn with_config(scene: &Scene, Config { solver, robust }: Config) -> Self {
        let of_every_particle = |vector: fn(&crate::scene::Particle) -> &[f64; 3]| {
            let components = scene.dimension.count();
            let particles = scene.particles.iter();
            particles.flat_map(|particle| vector(particle)[..components].to_vec()).collect()
        };
        let forces = scene.forces.iter().map(|element| {
            (element.schema.tag, element.pair.unwrap_or_default(), element.location)
        });
        let positions: Vec<f64> = of_every_particle(|particle| &particle.position);
        let velocities: Vec<f64> = of_every_particle(|particle| &particle.velocity);
        let rescue = robust.then(|| Rescue {
            scene: scene.clone(),
            solver,
            run: None,
            positions: positions.clone(),
            velocities: velocities.clone(),
        });
        Self {
            run: start(scene, solver),
            scene: scene.name.clone(),
            forces: forces.collect(),
            dimension: scene.dimension,
            time_step: scene.time_step,
            n_steps: scene.n_steps(),
            positions,
            velocities,
            statistics: Statistics::default(),
            rescue,
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
        if let Some(rescue) = &mut self.rescue {
            rescue.positions.copy_from_slice(&self.positions);
            rescue.velocities.copy_from_slice(&self.velocities);
        }
        let time = self.statistics.steps as f64 * self.time_step;
        let step = Step {
            size: self.time_step,
            time,
            positions: &mut self.positions,
            velocities: &mut self.velocities,
            statistics: &mut self.statistics,
        };
        let taken = self.run.step(step).map_err(|error| FailureKind::of(error, &self.forces));
        let taken = taken.and_then(|()| self.not_finite().map_or(Ok(()), Err));
        if let Err(kind) = taken
            && !self.rescue_step()
        {
            return Err(self.failure(kind));
        }
        self.statistics.steps += 1;
        Ok(true)
    }

    /// Takes the step that has just failed in another way; false where none has an answer, or none is asked for.
    fn rescue_step(&mut self) -> bool {
        let Some(mut rescue) = self.rescue.take() else { return false };
        let mut run = rescue.run.take().unwrap_or_else(|| start(&rescue.scene, rescue.solver));
        let rescued = self.retry(&rescue, &mut *run);
        rescue.run = Some(run);
        self.rescue = Some(rescue);
        rescued
    }

    fn retry(&mut self, rescue: &Rescue, run: &mut dyn Run) -> bool {
        let (h, time) = (self.time_step, self.statistics.steps as f64 * self.time_step);
        self.restore(rescue);
        let patient = run.step_patiently(self.step_of(h, time));
        if patient.is_some_and(|taken| taken.is_ok()) && self.not_finite().is_none() {
            self.statistics.rescue.line_searched += 1;
            return true;
        }
        for halvings in 1..=MAX_HALVINGS {
            self.restore(rescue);
            let substeps = 1_u64 << halvings;
            let size = h / substeps as f64;
            let all = (0..substeps).all(|number| {
                let step = self.step_of(size, time + number as f64 * size);
                run.step(step).is_ok() && self.not_finite().is_none()
            });
            if all {
                let counts = &mut self.statistics.rescue;
                counts.substepped += 1;
                counts.substeps += substeps;
                counts.max_substeps = counts.max_substeps.max(substeps);
                return true;
            }
        }
        false
    }

    fn restore(&mut self, rescue: &Rescue) {
        self.positions.copy_from_slice(&rescue.positions);
        self.velocities.copy_from_slice(&rescue.velocities);
    }

    fn step_of(&mut self, size: f64, time: f64) -> Step<'_> {
        Step {
            size,
            time,
            positions: &mut self.positions,
            velocities: &mut self.velocities,
            statistics: &mut self.statistics,
        }
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

    /// The kinds of force that a step evaluates, by their tags, in the order of the registry.
    pub fn force_tags(&self) -> &[&'static str] {
        self.run.force_tags()
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

/// The scene's system and integrator, of its dimension.
fn start(scene: &Scene, solver: LinearSolver) -> Box<dyn Run> {
    match scene.dimension {
        Dimension::Two => Runner::<2>::start(scene, solver),
        Dimension::Three => Runner::<3>::start(scene, solver),
    }
}

/// A system with its integrator, its dimension forgotten.
trait Run: Send {
    fn step(&mut self, step: Step<'_>) -> Result<(), StepError>;
    fn step_patiently(&mut self, step: Step<'_>) -> Option<Result<(), StepError>>;
    /// The kinds of force that are evaluated, by their tags.
    fn force_tags(&self) -> &[&'static str];
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

    fn step_patiently(&mut self, step: Step<'_>) -> Option<Result<(), StepError>> {
        self.integrator.step_patiently(&self.system, step)
    }

    fn force_tags(&self) -> &[&'static str] {
        self.system.force_tags()
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
