//! Runs a scene step by step, from its initial state to its end.

use std::fmt;
use std::ops::Range;

use sparse::LinearError;
use sparse::linear::LinearSolver;

use crate::fallback::MAX_HALVINGS;
use crate::force::{Degenerate, ForceKind};
use crate::growth::{EnergyWatch, Scale};
use crate::integrator::{
    BuildIntegrator, Integrator, IntegratorKind, Interrupt, IterationRecorder, REGISTRY, Step,
    StepError,
};
use crate::parts::Parts;
use crate::statistics::Statistics;
use crate::system::{BuildForce, System};
use scene::state::{Energies, StateView};
use scene::trace::State;
use scene::{Dimension, Location, Particles, Scene};

/// Options of a simulation that are not part of the scene.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SimulationOptions {
    /// Solver for linear systems.
    pub solver: LinearSolver,
    /// Whether failed steps are retried as described in [`fallback`](crate::fallback).
    pub robust: bool,
    /// Whether the energy is watched as described in [`growth`](crate::growth).
    pub watch_energy: bool,
}

/// A running simulation. It dispatches on the dimension once, when it is created.
pub struct Simulation {
    stepper: Box<dyn Stepper>,
    scene: String,
    forces: Vec<(&'static str, Location)>,
    dimension: Dimension,
    time_step: f64,
    n_steps: u64,
    /// Number of the current state.
    step: u64,
    positions: Vec<f64>,
    velocities: Vec<f64>,
    /// The start of the step, for the fallbacks and for the step after it; `None` if neither needs it.
    start: Option<State>,
    is_two_step: bool,
    /// The state one step before the current one, of a two-step method; `None` at the start of a run.
    earlier: Option<State>,
    statistics: Statistics,
    fallback: Option<Fallback>,
    /// `None` if the energy is not watched, or was seen to grow.
    watch: Option<EnergyWatch>,
    parts: Parts,
}

/// Scene and stepper for retrying a failed step.
struct Fallback {
    scene: Scene,
    solver: LinearSolver,
    /// Created at the first failure.
    stepper: Option<Box<dyn Stepper>>,
}

impl Simulation {
    /// A simulation at the scene's initial state.
    ///
    /// # Panics
    /// If the scene's integrator is not in the registry.
    pub fn new(scene: &Scene) -> Self {
        Self::with_solver(scene, LinearSolver::Auto)
    }

    /// The same with a given linear solver instead of the automatic choice.
    ///
    /// # Panics
    /// If the scene's integrator is not in the registry.
    pub fn with_solver(scene: &Scene, solver: LinearSolver) -> Self {
        Self::with_options(scene, SimulationOptions { solver, ..SimulationOptions::default() })
    }

    /// The same with options.
    ///
    /// # Panics
    /// If the scene's integrator is not in the registry.
    pub fn with_options(
        scene: &Scene,
        SimulationOptions { solver, robust, watch_energy }: SimulationOptions,
    ) -> Self {
        let forces = scene.forces.iter().map(|element| (element.schema.tag, element.location));
        let (positions, velocities) = (scene.positions(), scene.velocities());
        let is_two_step = scene.integrator.equation.is_two_step();
        let start = (robust || is_two_step).then(|| State {
            time: None,
            positions: scene.positions(),
            velocities: scene.velocities(),
        });
        let fallback = robust.then(|| Fallback { scene: scene.clone(), solver, stepper: None });
        Self {
            stepper: build_stepper(scene, solver),
            scene: scene.name.clone(),
            forces: forces.collect(),
            dimension: scene.dimension,
            time_step: scene.time_step,
            n_steps: scene.n_steps(),
            step: 0,
            positions,
            velocities,
            start,
            is_two_step,
            earlier: None,
            statistics: Statistics::default(),
            fallback,
            watch: watch_energy.then(|| EnergyWatch::new(scene)),
            parts: Parts::of_scene(scene),
        }
    }

    /// Takes the next step. Returns false at the end of the scene.
    ///
    /// # Errors
    /// If the step fails. The state is then undefined until [`set_state`](Self::set_state).
    pub fn advance(&mut self) -> Result<bool, SimulationError> {
        if self.step == self.n_steps {
            return Ok(false);
        }
        if let Some(start) = &mut self.start {
            start.positions.copy_from_slice(&self.positions);
            start.velocities.copy_from_slice(&self.velocities);
        }
        if let Some(watch) = &mut self.watch {
            let state = state_of(self.step, self.time_step, &self.positions, &self.velocities);
            watch.start(|| self.stepper.scale(state, self.time_step));
        }
        self.statistics.conditioning.last = 0.0;
        let time = self.step as f64 * self.time_step;
        let step = Step {
            size: self.time_step,
            time,
            positions: &mut self.positions,
            velocities: &mut self.velocities,
            earlier: self.earlier.as_ref(),
            statistics: &mut self.statistics,
        };
        let taken = self.stepper.step(step).map_err(|error| FailureKind::of(error, &self.forces));
        let taken = taken.and_then(|()| {
            if self.stepper.is_finite() { Ok(()) } else { self.not_finite().map_or(Ok(()), Err) }
        });
        match taken {
            Ok(()) if self.statistics.conditioning.is_nearly_singular() => self.retake(),
            Ok(()) => {}
            // Error control has shortened the step already, as far as it may.
            Err(kind @ (FailureKind::ErrorControl { .. } | FailureKind::Interrupted)) => {
                return Err(self.failure(kind));
            }
            Err(kind) => {
                if !self.fall_back() {
                    return Err(self.failure(kind));
                }
            }
        }
        if self.is_two_step {
            std::mem::swap(&mut self.earlier, &mut self.start);
            if self.start.is_none() {
                self.start.clone_from(&self.earlier);
            }
        }
        self.step += 1;
        self.statistics.steps += 1;
        self.statistics.conditioning.end_step(self.step);
        self.statistics.frozen.end_step(self.step);
        self.watch_energy();
        Ok(true)
    }

    fn watch_energy(&mut self) {
        let Some(watch) = &mut self.watch else { return };
        if !EnergyWatch::is_due(self.step, self.n_steps) {
            return;
        }
        let kinetic = self.stepper.kinetic_energy(&self.velocities);
        let state = state_of(self.step, self.time_step, &self.positions, &self.velocities);
        let grown = watch.look(self.step, kinetic, || self.stepper.scale(state, self.time_step));
        if grown.is_some() {
            self.statistics.energy_growth = grown;
            self.watch = None;
        }
    }

    /// Retries a step that was taken through a nearly singular matrix with the fallbacks. It stays as it is if they are
    /// off or all fail.
    fn retake(&mut self) {
        if self.fallback.is_none() {
            return;
        }
        let taken = [self.positions.clone(), self.velocities.clone()];
        let amplification = self.statistics.conditioning.last;
        if !self.fall_back() {
            [self.positions, self.velocities] = taken;
            self.statistics.conditioning.last = amplification;
        }
    }

    /// Retries the failed step with the fallbacks. Returns false if they are off or all fail.
    fn fall_back(&mut self) -> bool {
        let Some(mut fallback) = self.fallback.take() else { return false };
        let mut stepper = fallback
            .stepper
            .take()
            .unwrap_or_else(|| build_stepper(&fallback.scene, fallback.solver));
        let succeeded = self.retry(&mut *stepper);
        fallback.stepper = Some(stepper);
        self.fallback = Some(fallback);
        succeeded
    }

    fn retry(&mut self, stepper: &mut dyn Stepper) -> bool {
        let (h, time) = (self.time_step, self.step as f64 * self.time_step);
        self.restore();
        let damped = stepper.step_damped(self.step_of(h, time));
        if damped.is_some_and(|taken| taken.is_ok()) && self.is_sound() {
            self.statistics.fallback.line_searched += 1;
            return true;
        }
        for halvings in 1..=MAX_HALVINGS {
            self.restore();
            let substeps = 1_u64 << halvings;
            let size = h / substeps as f64;
            let all = (0..substeps).all(|number| {
                // The earlier state is a whole step away.
                let step =
                    Step { earlier: None, ..self.step_of(size, time + number as f64 * size) };
                stepper.step(step).is_ok() && self.is_sound()
            });
            if all {
                let counts = &mut self.statistics.fallback;
                counts.substepped += 1;
                counts.substeps += substeps;
                counts.max_substeps = counts.max_substeps.max(substeps);
                return true;
            }
        }
        false
    }

    /// Whether the state is finite, and was not reached through a nearly singular matrix.
    fn is_sound(&self) -> bool {
        !self.statistics.conditioning.is_nearly_singular() && self.not_finite().is_none()
    }

    fn restore(&mut self) {
        self.statistics.conditioning.last = 0.0;
        self.statistics.frozen.last = false;
        if let Some(start) = &self.start {
            self.positions.copy_from_slice(&start.positions);
            self.velocities.copy_from_slice(&start.velocities);
        }
    }

    fn step_of(&mut self, size: f64, time: f64) -> Step<'_> {
        Step {
            size,
            time,
            positions: &mut self.positions,
            velocities: &mut self.velocities,
            earlier: self.earlier.as_ref(),
            statistics: &mut self.statistics,
        }
    }

    /// Ends a step that iterates with [`FailureKind::Interrupted`] once `interrupt` is raised, here or in another thread.
    /// Retries of a failed step are not interrupted.
    pub fn interrupt_by(&mut self, interrupt: &Interrupt) {
        self.stepper.interrupt_by(interrupt);
    }

    /// Hands the iterates of later steps to `recorder`; those of retries of a failed step are left out. False if the
    /// integrator does not solve implicit Euler's equations by iterations: there is nothing to record.
    pub fn record_by(&mut self, recorder: IterationRecorder) -> bool {
        self.stepper.record_by(recorder)
    }

    /// Replaces the state by another one, that at the beginning of step `step` (from 0). A two-step method goes on from
    /// `earlier` as well, the state one step before; without it, it starts anew. Other methods ignore it.
    ///
    /// # Panics
    /// If the positions or velocities are not `n·D` numbers.
    pub fn set_state(
        &mut self,
        step: u64,
        earlier: Option<&State>,
        positions: &[f64],
        velocities: &[f64],
    ) {
        self.step = step;
        self.positions.copy_from_slice(positions);
        self.velocities.copy_from_slice(velocities);
        self.earlier = earlier.filter(|_| self.is_two_step).cloned();
        if let Some(watch) = &mut self.watch {
            watch.restart();
        }
    }

    /// The earlier state that the next step of a two-step method uses.
    pub fn earlier(&self) -> Option<&State> {
        self.earlier.as_ref()
    }

    /// The current state.
    pub fn state(&self) -> StateView<'_> {
        state_of(self.step, self.time_step, &self.positions, &self.velocities)
    }

    /// Energies and momentum of the current state.
    ///
    /// # Errors
    /// If one of them is not finite.
    pub fn energies(&self) -> Result<Energies, SimulationError> {
        let energies = self.energies_of(self.state());
        let Energies { kinetic, potential, momentum } = &energies;
        let finite = (kinetic + potential).is_finite() && momentum.iter().all(|p| p.is_finite());
        if finite {
            return Ok(energies);
        }
        // An undefined force is the more specific error: report it instead of the energy.
        let undefined = self.stepper.check(self.state()).err();
        let kind = match undefined {
            Some(error) => FailureKind::of(error, &self.forces),
            None => FailureKind::EnergyNotFinite,
        };
        Err(self.failure(kind))
    }

    /// Energies and momentum of any state, finite or not.
    pub fn energies_of(&self, state: StateView<'_>) -> Energies {
        self.stepper.energies(state)
    }

    /// Statistics of the run so far.
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// The kinds of force that a step evaluates, by their tags, in the order of the registry.
    pub fn force_tags(&self) -> &[&'static str] {
        self.stepper.force_tags()
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
        let step = self.step + 1;
        let time = self.step as f64 * self.time_step;
        SimulationError { scene: self.scene.clone(), step, time, kind }
    }

    fn not_finite(&self) -> Option<FailureKind> {
        let count = self.dimension.count();
        let (positions, velocities) = (&self.positions, &self.velocities);
        let all_finite = |Range { start, end }: Range<usize>, []: [&mut [f64]; 0]| {
            let part = start * count..end * count;
            let (positions, velocities) = (&positions[part.clone()], &velocities[part]);
            // Without an early exit, this is vectorised.
            pulp::Arch::new().dispatch(
                #[inline(always)]
                || {
                    let all = positions.iter().fold(true, |all, value| all & value.is_finite());
                    velocities.iter().fold(all, |all, value| all & value.is_finite())
                },
            )
        };
        if self.parts.map(count, [], all_finite, |left, right| left & right) {
            return None;
        }
        let look = |values: &[f64], what| {
            let place = values.iter().position(|value| !value.is_finite());
            place.map(|place| FailureKind::NotFinite {
                what,
                particle: place / count,
                coordinate: ["x", "y", "z"][place % count],
            })
        };
        look(positions, "position").or_else(|| look(velocities, "velocity"))
    }
}

fn state_of<'a>(
    step: u64,
    time_step: f64,
    positions: &'a [f64],
    velocities: &'a [f64],
) -> StateView<'a> {
    StateView { step, time: step as f64 * time_step, positions, velocities }
}

/// Builds the scene's system and integrator for its dimension.
fn build_stepper(scene: &Scene, solver: LinearSolver) -> Box<dyn Stepper> {
    match scene.dimension {
        Dimension::Two => SystemStepper::<2>::start(scene, solver),
        Dimension::Three => SystemStepper::<3>::start(scene, solver),
    }
}

/// A system with its integrator, behind a trait object that hides the dimension.
trait Stepper: Send {
    fn step(&mut self, step: Step<'_>) -> Result<(), StepError>;
    fn step_damped(&mut self, step: Step<'_>) -> Option<Result<(), StepError>>;
    fn is_finite(&self) -> bool;
    fn interrupt_by(&mut self, interrupt: &Interrupt);
    fn record_by(&mut self, recorder: IterationRecorder) -> bool;
    /// The kinds of force that are evaluated, by their tags.
    fn force_tags(&self) -> &[&'static str];
    fn energies(&self, state: StateView<'_>) -> Energies;
    fn kinetic_energy(&self, velocities: &[f64]) -> f64;
    /// Energies of a state from which steps of this size are taken.
    fn scale(&self, state: StateView<'_>, time_step: f64) -> Scale;
    /// Whether every force is defined at this state.
    fn check(&self, state: StateView<'_>) -> Result<(), StepError>;
}

struct SystemStepper<const D: usize> {
    system: System<D>,
    integrator: Box<dyn Integrator<D>>,
}

impl<const D: usize> SystemStepper<D>
where
    ForceKind: BuildForce<D>,
    IntegratorKind: BuildIntegrator<D>,
{
    fn start(scene: &Scene, solver: LinearSolver) -> Box<dyn Stepper> {
        let system = System::new(scene);
        let kind = REGISTRY.iter().find(|kind| kind.schema.name == scene.integrator.name);
        let kind = kind.expect("a scene holds schemas of the registry");
        let integrator = kind.build(scene, &system, solver);
        Box::new(Self { system, integrator })
    }
}

impl<const D: usize> Stepper for SystemStepper<D> {
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

    fn step_damped(&mut self, step: Step<'_>) -> Option<Result<(), StepError>> {
        self.integrator.step_damped(&self.system, step)
    }

    fn is_finite(&self) -> bool {
        self.integrator.is_finite()
    }

    fn interrupt_by(&mut self, interrupt: &Interrupt) {
        self.integrator.interrupt_by(interrupt);
    }

    fn record_by(&mut self, recorder: IterationRecorder) -> bool {
        self.integrator.record_by(recorder)
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

    fn kinetic_energy(&self, velocities: &[f64]) -> f64 {
        self.system.kinetic_energy(velocities)
    }

    fn scale(
        &self,
        StateView { time, positions, velocities, .. }: StateView<'_>,
        time_step: f64,
    ) -> Scale {
        let kinetic = self.system.kinetic_energy(velocities);
        let (potential, size) = self.system.energy_and_size(positions, velocities, time);
        let mut force = vec![0.0; positions.len()];
        // Without a force, the step fails or kicks by forces elsewhere.
        let kick = match self.system.force(positions, velocities, time, &mut force) {
            Ok(()) => {
                let particles = force.chunks_exact(D).zip(self.system.masses());
                let of_particle = |(force, mass): (&[f64], &f64)| {
                    force.iter().map(|force| force * force).sum::<f64>() / (2.0 * mass)
                };
                time_step * time_step * particles.map(of_particle).sum::<f64>()
            }
            Err(_) => 0.0,
        };
        Scale { energy: kinetic + potential, reference: kinetic + size + kick }
    }
}

/// A scene that could not be simulated to its end.
///
/// Displays as one message and a second line `  help: remedy`.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub struct SimulationError {
    /// The scene, as messages call it.
    pub scene: String,
    /// Number of the failed step, from 1.
    pub step: u64,
    /// The time at which that step starts, in seconds.
    pub time: f64,
    /// The cause.
    pub kind: FailureKind,
}

/// Why a step failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what the variants and their fields are")]
pub enum FailureKind {
    #[error("{}", degenerate(tag, particles))]
    Degenerate { tag: &'static str, particles: Particles, location: Location },
    #[error(
        "Newton's method did not converge: after {iterations} iterations the update is {update:.1e} and the residual {residual:.1e}"
    )]
    NotConverged { iterations: u64, update: f64, residual: f64 },
    #[error(
        "Newton's method cannot converge: its tolerance is below the rounding of velocities of size {speed:.1e}; after {iterations} iterations the update is {update:.1e}"
    )]
    BelowRounding { iterations: u64, update: f64, speed: f64 },
    #[error(
        "Newton's method cannot converge: its tolerance of {tolerance:e} for an update of the velocities is below {rounding:.1e}, the rounding of positions of size {size:.1e} over a step of {step:e} s; after {iterations} iterations the update is {update:.1e}"
    )]
    BelowPositions {
        iterations: u64,
        update: f64,
        tolerance: f64,
        size: f64,
        step: f64,
        rounding: f64,
    },
    #[error(
        "the line search found no descent: after {iterations} iterations, Newton's step of {update:.1e} does not decrease the energy"
    )]
    NoDescent { iterations: u64, update: f64 },
    #[error(
        "error control does not reach the end of the step: after {trials} steps, the last one is {size:.1e} s long"
    )]
    ErrorControl { trials: u64, size: f64 },
    #[error("the linear system of the step cannot be solved: {0}")]
    Linear(LinearError),
    #[error("the step was interrupted")]
    Interrupted,
    #[error("the energy of the state is not finite")]
    EnergyNotFinite,
    #[error("the {what} of particle {particle} is no longer finite (coordinate {coordinate})")]
    NotFinite { what: &'static str, particle: usize, coordinate: &'static str },
}

/// Description of an element that has no value: the particles that it names.
fn degenerate(tag: &str, particles: &[usize]) -> String {
    if let [i, j] = particles {
        return format!("<{tag}> has no direction: particles {i} and {j} are at the same place");
    }
    let names: Vec<String> = particles.iter().map(ToString::to_string).collect();
    format!("<{tag}> is not defined where its particles ({}) are", names.join(", "))
}

impl FailureKind {
    fn of(error: StepError, forces: &[(&'static str, Location)]) -> Self {
        match error {
            StepError::Degenerate(Degenerate { element, particles }) => {
                let (tag, location) = forces[element];
                Self::Degenerate { tag, particles, location }
            }
            StepError::NotConverged { iterations, update, residual } => {
                Self::NotConverged { iterations, update, residual }
            }
            StepError::BelowRounding { iterations, update, speed } => {
                Self::BelowRounding { iterations, update, speed }
            }
            StepError::BelowPositions { iterations, update, tolerance, size, step, rounding } => {
                Self::BelowPositions { iterations, update, tolerance, size, step, rounding }
            }
            StepError::NoDescent { iterations, update } => Self::NoDescent { iterations, update },
            StepError::ErrorControl { trials, size } => Self::ErrorControl { trials, size },
            StepError::Linear(error) => Self::Linear(error),
            StepError::Interrupted => Self::Interrupted,
        }
    }

    /// The remedy.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Degenerate { .. } => "move one of them, or shorten the time step",
            Self::NotConverged { .. } | Self::NotFinite { .. } => {
                "shorten the time step, or soften the forces; the motion may be unstable"
            }
            Self::NoDescent { .. } => {
                "project the Hessian (projection=\"clamp\"), or shorten the time step"
            }
            Self::ErrorControl { .. } => {
                "shorten the time step, enlarge the tolerance, or soften the forces"
            }
            Self::BelowRounding { .. } => "choose units in which the velocities are smaller",
            Self::BelowPositions { .. } => {
                "move the scene towards the origin, choose units in which its coordinates are smaller, lengthen the time step, or take projected-newton, whose tolerance can be enlarged"
            }
            Self::Interrupted => "run it again",
            Self::EnergyNotFinite => "separate coincident particles; check masses and velocities",
            Self::Linear(LinearError::OutOfMemory { .. }) => {
                "make the scene smaller, or use symplectic-euler, which needs no matrix"
            }
            Self::Linear(LinearError::RefinementStalled { .. }) => {
                "soften the forces, or shorten the time step"
            }
            Self::Linear(_) => "shorten the time step; check masses and stiffnesses",
        }
    }
}

impl fmt::Display for SimulationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:", self.scene)?;
        if let FailureKind::Degenerate { location: Location { line, column }, .. } = self.kind {
            write!(f, "{line}:{column}:")?;
        }
        write!(f, " step {} (from t = {} s):", self.step, self.time)?;
        write!(f, " {}\n  help: {}", self.kind, self.kind.remedy())
    }
}
