//! Compares a trace with the oracle's, state by state.
//!
//! For each state and particle there are two residuals: the Euclidean norm of the difference in position, and that
//! of the difference in velocity. The course accepts a trace where the largest residual of each kind is below 1e-10
//! and their sum over all particles and states is below 1e-6.
//!
//! Calibrated criteria have a tolerance for each state and quantity, and no bound on the sum: see [`calibration`].
//!
//! Both traces are read as streams; memory is that of a few states, whatever their length. A fault in the trace's
//! form (malformed, not finite, too short, too long) decides the verdict, whatever the numbers before it.

pub mod calibration;
mod limits;
pub mod recording;

use std::collections::VecDeque;
use std::sync::Arc;

use scene::Scene;
use scene::trace::{Shape, State, TraceReader};
use simulator::solver::linear::LinearSolver;

use crate::submission::StateSource;
use crate::verdict::{Conserved, Drift, Failure, Fault, FormFault, Place, Quantity, Verdict};
use calibration::{Bound, Envelope, Horizon, SingleStep, SingleSteps, WrongStep};
use diagnosis::findings::ContextRow;
use diagnosis::stepping::Stepper;
use limits::{Excess, Limits};

/// States kept before and after the first wrong one.
const CONTEXT: usize = 2;

/// Coordinates of states that are large enough for two threads: one reads the oracle's state, one the other.
const LARGE_STATE: usize = 256;

/// Tolerances on the residuals. Both bounds are exclusive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerances {
    /// Bound on each residual.
    pub largest: f64,
    /// Bound on the sum of the residuals over all particles and states.
    pub accumulated: f64,
}

impl Tolerances {
    /// The course's own criteria.
    pub const COURSE: Self = Self { largest: 1e-10, accumulated: 1e-6 };
}

/// Criteria by which a trace is judged.
#[derive(Debug, Clone, PartialEq)]
pub enum Criteria {
    /// The same tolerances for every state.
    Fixed(Tolerances),
    /// Tolerances that grow with the differences between correct programs.
    Calibrated(Calibrated),
}

/// The envelope of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibrated {
    /// Differences between correct programs.
    pub envelope: Arc<Envelope>,
    /// The scene, if it has a horizon: single steps, energy and momentum are then judged.
    scene: Option<Arc<Scene>>,
}

impl Calibrated {
    /// The criteria of `scene`.
    pub fn new(envelope: Envelope, scene: &Scene) -> Self {
        let scene = envelope.horizon.map(|_| Arc::new(scene.clone()));
        Self { envelope: Arc::new(envelope), scene }
    }
}

impl From<Tolerances> for Criteria {
    fn from(tolerances: Tolerances) -> Self {
        Self::Fixed(tolerances)
    }
}

impl Criteria {
    /// "calibrated", or "fixed".
    pub fn name(&self) -> &'static str {
        match self {
            Self::Fixed(_) => "fixed",
            Self::Calibrated(_) => "calibrated",
        }
    }
}

/// Known properties of a trace before it is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expectation {
    /// Numbers in a state.
    pub shape: Shape,
    /// Time between two states, in seconds.
    pub time_step: f64,
    /// States in the trace, the initial one included.
    pub n_states: u64,
}

impl Expectation {
    /// The expected properties of a trace of `scene`.
    pub fn of(scene: &Scene) -> Self {
        Self { shape: Shape::of(scene), time_step: scene.time_step, n_states: scene.n_steps() + 1 }
    }
}

/// The outcome of a comparison.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Pass or a named failure.
    pub verdict: Verdict,
    /// States compared.
    pub states: u64,
    /// Residuals of the positions.
    pub position: Residuals,
    /// Residuals of the velocities.
    pub velocity: Residuals,
    /// The first number out of tolerance, if there is one.
    pub first_wrong: Option<FirstWrong>,
    /// Tolerances at the last state that was compared; `None` where tolerances are fixed.
    pub allowed: Option<Allowed>,
    /// The first state that differs, where the trace passes because its steps solve the same equations.
    pub other_root: Option<u64>,
    /// Whether the trace has no velocities.
    pub has_positions_alone: bool,
}

/// Calibrated envelopes and tolerances of a state, and the used share of them so far.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Allowed {
    /// Bound on the positions.
    pub position: Bound,
    /// Bound on the velocities.
    pub velocity: Bound,
    /// The largest ratio of a residual to its tolerance.
    pub used: f64,
}

impl Comparison {
    /// A comparison without states.
    pub fn without_states(verdict: Verdict) -> Self {
        let none = Residuals::default();
        Self {
            verdict,
            states: 0,
            position: none,
            velocity: none,
            first_wrong: None,
            allowed: None,
            other_root: None,
            has_positions_alone: false,
        }
    }

    /// Whether any state was compared; without one, the residuals are meaningless.
    pub fn is_compared(&self) -> bool {
        self.states > 0
    }
}

/// Residuals of one quantity over all particles and states.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Residuals {
    /// The largest residual.
    pub largest: f64,
    /// The sum of the residuals.
    pub accumulated: f64,
}

/// The first number of a trace that is out of tolerance.
#[derive(Debug, Clone, PartialEq)]
pub struct FirstWrong {
    /// Its place: the worst coordinate of the first wrong particle.
    pub place: Place,
    /// Time of the state, in seconds.
    pub time: f64,
    /// The oracle's value.
    pub expected: f64,
    /// The trace's value.
    pub got: f64,
    /// The residual that is too large: the particle's, or the sum.
    pub residual: f64,
    /// The tolerance that the residual exceeds.
    pub tolerance: f64,
    /// The envelope that the tolerance follows from, where it is calibrated.
    pub envelope: Option<f64>,
    /// Whether the sum of the residuals is too large, rather than this one.
    pub accumulated: bool,
    /// The particle's rows around that state.
    pub context: Vec<ContextRow>,
}

/// Two states that were compared.
#[derive(Debug, Clone, Copy)]
pub struct Pair<'a> {
    /// Number of the state: 0 is the initial one.
    pub step: u64,
    /// The oracle's state.
    pub expected: &'a State,
    /// The trace's state.
    pub got: &'a State,
    /// Bounds of positions and velocities; `None` beyond the horizon. The envelope is 0 where tolerances are fixed.
    pub bounds: Option<[Bound; 2]>,
    /// Whether this state or an earlier one is out of tolerance.
    pub is_wrong: bool,
}

/// Whether a time is right that differs by this: a sum of time steps differs from their product by rounding only. Not if it is NaN.
pub(crate) fn is_close(difference: f64, time: f64) -> bool {
    difference <= 1e-9 * time.abs().max(1.0)
}

/// Compares `actual` with the oracle's trace.
pub fn compare(
    oracle: &mut dyn TraceReader,
    actual: &mut dyn StateSource,
    expectation: Expectation,
    criteria: impl Into<Criteria>,
) -> Comparison {
    compare_watched(oracle, actual, expectation, criteria, &mut |_| {})
}

/// The same; `watch` sees every pair of states.
pub fn compare_watched(
    oracle: &mut dyn TraceReader,
    actual: &mut dyn StateSource,
    expectation: Expectation,
    criteria: impl Into<Criteria>,
    watch: &mut dyn FnMut(Pair<'_>),
) -> Comparison {
    let mut comparer = Comparer::new(expectation, criteria.into());
    let verdict = match (comparer.run(oracle, actual, watch), comparer.drift()) {
        (Err(verdict), _) => verdict,
        (Ok(()), _) if comparer.first_wrong.is_some() => Verdict::Fail(Failure::Differs),
        (Ok(()), Some(failure)) => Verdict::Fail(failure),
        (Ok(()), None) => Verdict::Pass,
    };
    Comparison {
        verdict,
        states: comparer.states,
        position: comparer.position,
        velocity: comparer.velocity,
        first_wrong: comparer.first_wrong,
        allowed: comparer.limits.allowed(),
        other_root: None,
        has_positions_alone: !comparer.compares_velocities,
    }
}

struct Comparer {
    expectation: Expectation,
    limits: Limits,
    beyond: Option<Beyond>,
    states: u64,
    position: Residuals,
    velocity: Residuals,
    first_wrong: Option<FirstWrong>,
    /// The last states, until the first wrong one is found.
    recent: VecDeque<(State, State)>,
    /// Whether the velocities of the graded trace are compared.
    compares_velocities: bool,
}

impl Comparer {
    fn new(expectation: Expectation, criteria: Criteria) -> Self {
        let beyond = match &criteria {
            Criteria::Fixed(_) => None,
            Criteria::Calibrated(calibrated) => Beyond::of(calibrated),
        };
        Self {
            expectation,
            limits: Limits::of(criteria),
            beyond,
            states: 0,
            position: Residuals::default(),
            velocity: Residuals::default(),
            first_wrong: None,
            recent: VecDeque::with_capacity(CONTEXT + 1),
            compares_velocities: true,
        }
    }

    /// Reads both traces to their ends. `Err` is a verdict that does not depend on residuals.
    fn run(
        &mut self,
        oracle: &mut dyn TraceReader,
        actual: &mut dyn StateSource,
        watch: &mut dyn FnMut(Pair<'_>),
    ) -> Result<(), Verdict> {
        let Expectation { shape, n_states, .. } = self.expectation;
        let broken = |detail: String| Verdict::GraderFault(Fault::BrokenOracle { detail });
        let (mut expected, mut got) = (State::zeros(shape), State::zeros(shape));
        self.compares_velocities = actual.has_velocities();
        while self.states < n_states {
            let (oracle_read, actual_read) = if shape.n_coordinates() < LARGE_STATE {
                (oracle.read(&mut expected), None)
            } else {
                let actual = || Some(actual.read(&mut got));
                rayon::join(|| oracle.read(&mut expected), actual)
            };
            match oracle_read {
                Ok(true) => {}
                Ok(false) => {
                    let detail = format!("it has {} states, not {n_states}", self.states);
                    return Err(broken(detail));
                }
                Err(error) => return Err(broken(error.to_string())),
            }
            if let Some((place, value)) = self.not_finite(&expected) {
                return Err(broken(format!("{value} at {place}")));
            }
            let actual_read = actual_read.unwrap_or_else(|| actual.read(&mut got));
            let is_read = match actual_read {
                Ok(is_read) => is_read,
                Err(failure) => {
                    if failure.starts_at_one() && matches!(actual.read(&mut got), Ok(true)) {
                        self.watch_on(oracle, actual, [&mut expected, &mut got], watch);
                    }
                    return Err(Verdict::Fail(failure));
                }
            };
            if !is_read {
                let failure = Failure::TooShort { states: self.states, expected: n_states };
                return Err(Verdict::Fail(failure));
            }
            if let Err(failure) = self.check_form(&got, actual) {
                if matches!(&failure, Failure::Malformed { fault: FormFault::Time { .. }, .. }) {
                    self.watch_on(oracle, actual, [&mut expected, &mut got], watch);
                }
                return Err(Verdict::Fail(failure));
            }
            if let Some(beyond) = self.beyond.as_mut().filter(|_| self.compares_velocities) {
                beyond.check_step(self.states, &self.recent, &got);
            }
            match &mut self.beyond {
                Some(beyond) if self.states >= beyond.horizon.step => {
                    let step = self.states;
                    beyond.check(step, &expected, &got);
                }
                _ => self.measure(&expected, &got),
            }
            watch(self.pair(&expected, &got));
            self.states += 1;

            // Keeps the pair read last. The next pair is read into the buffers of the one that drops out.
            if self.recent.len() < CONTEXT {
                self.recent.push_back((expected.clone(), got.clone()));
            } else if let Some(oldest) = self.recent.pop_front() {
                self.recent.push_back((
                    std::mem::replace(&mut expected, oldest.0),
                    std::mem::replace(&mut got, oldest.1),
                ));
            }
        }
        if oracle.read(&mut expected).map_err(|error| broken(error.to_string()))? {
            return Err(broken(format!("it has more than {n_states} states")));
        }
        if actual.read(&mut got).map_err(Verdict::Fail)? {
            return Err(Verdict::Fail(Failure::TooLong { expected: n_states }));
        }
        Ok(())
    }

    /// Shows this state, whose time or number is wrong, and those that follow, as long as both traces have finite ones. They
    /// are not measured.
    fn watch_on(
        &self,
        oracle: &mut dyn TraceReader,
        actual: &mut dyn StateSource,
        [expected, got]: [&mut State; 2],
        watch: &mut dyn FnMut(Pair<'_>),
    ) {
        for step in self.states..self.expectation.n_states {
            if self.not_finite(got).is_some() {
                return;
            }
            watch(Pair { step, expected, got, bounds: None, is_wrong: true });
            let is_read = matches!(oracle.read(expected), Ok(true));
            if !is_read || !matches!(actual.read(got), Ok(true)) {
                return;
            }
        }
    }

    /// The fault beyond the horizon.
    fn drift(&self) -> Option<Failure> {
        let Beyond { horizon, drift, .. } = self.beyond.as_ref()?;
        Some(Failure::Drifts { horizon: horizon.step, drift: drift.clone()? })
    }

    /// The current pair of states, after it was compared.
    fn pair<'a>(&self, expected: &'a State, got: &'a State) -> Pair<'a> {
        let drifts = |beyond: &Beyond| beyond.drift.is_some();
        let is_beyond = |beyond: &Beyond| self.states >= beyond.horizon.step;
        let is_compared = !self.beyond.as_ref().is_some_and(is_beyond);
        let bounds = is_compared.then(|| self.limits.bounds());
        let is_wrong = self.first_wrong.is_some() || self.beyond.as_ref().is_some_and(drifts);
        Pair { step: self.states, expected, got, bounds, is_wrong }
    }

    fn check_form(&self, got: &State, source: &dyn StateSource) -> Result<(), Failure> {
        if let Some(time) = got.time {
            let expected = self.states as f64 * self.expectation.time_step;
            if !is_close((time - expected).abs(), expected) {
                let fault = FormFault::Time { state: self.states, found: time, expected };
                return Err(Failure::Malformed { location: source.location(), fault });
            }
        }
        match self.not_finite(got) {
            Some((place, value)) => {
                Err(Failure::NotFinite { location: source.location(), place, value })
            }
            None => Ok(()),
        }
    }

    fn not_finite(&self, state: &State) -> Option<(Place, f64)> {
        let look = |values: &[f64], quantity| {
            let index = values.iter().position(|value| !value.is_finite())?;
            Some((self.place(index, quantity), values[index]))
        };
        look(&state.positions, Quantity::Position)
            .or_else(|| look(&state.velocities, Quantity::Velocity))
    }

    fn place(&self, index: usize, quantity: Quantity) -> Place {
        let dimension = self.expectation.shape.dimension.count();
        let (particle, axis) = (index / dimension, index % dimension);
        Place { step: self.states, particle, quantity, axis }
    }

    /// Adds the residuals of a pair of states.
    fn measure(&mut self, expected: &State, got: &State) {
        let dimension = self.expectation.shape.dimension.count();
        self.limits.advance(self.states, expected);
        // The lowest particle that is out of tolerance, positions before velocities.
        let mut wrong: Option<Wrong> = None;
        let n_compared = 1 + usize::from(self.compares_velocities);
        for quantity in [Quantity::Position, Quantity::Velocity].into_iter().take(n_compared) {
            let residuals = match quantity {
                Quantity::Position => &mut self.position,
                Quantity::Velocity => &mut self.velocity,
            };
            let particles = values(expected, quantity).chunks_exact(dimension);
            let particles = particles.zip(values(got, quantity).chunks_exact(dimension));
            for (particle, (expected, got)) in particles.enumerate() {
                let residual = distance(expected, got);
                residuals.largest = residuals.largest.max(residual);
                residuals.accumulated += residual;
                // The used share of the tolerances is a maximum over all particles.
                let excess = self.limits.check(quantity, residual, residuals.accumulated);
                if let Some(excess) = excess
                    && wrong.as_ref().is_none_or(|wrong| particle < wrong.particle)
                {
                    wrong = Some(Wrong { particle, quantity, excess });
                }
            }
        }
        if let Some(first) = &mut self.first_wrong {
            if self.states <= first.place.step + CONTEXT as u64 {
                let particle = first.place.particle;
                first.context.push(context_row(expected, got, particle, self.states, dimension));
            }
        } else if let Some(wrong) = wrong {
            self.first_wrong = Some(self.describe(wrong, expected, got));
        }
    }

    /// The first wrong number, with the states around it.
    fn describe(&self, wrong: Wrong, expected: &State, got: &State) -> FirstWrong {
        let Wrong { particle, quantity, excess } = wrong;
        let Excess { residual, tolerance, accumulated } = excess;
        let dimension = self.expectation.shape.dimension.count();
        let index = worst(values(expected, quantity), values(got, quantity), particle, dimension);
        let row = |(step, (expected, got)): (u64, (&State, &State))| {
            context_row(expected, got, particle, step, dimension)
        };
        let recent = self.recent.iter().map(|(expected, got)| (expected, got));
        let first_kept = self.states - self.recent.len() as u64;
        let pairs = (first_kept..).zip(recent.chain([(expected, got)]));
        let bound = self.limits.bounds()[quantity as usize];
        FirstWrong {
            place: self.place(index, quantity),
            time: self.states as f64 * self.expectation.time_step,
            expected: values(expected, quantity)[index],
            got: values(got, quantity)[index],
            residual,
            tolerance,
            envelope: self.limits.allowed().map(|_| bound.envelope),
            accumulated,
            context: pairs.map(row).collect(),
        }
    }
}

/// A particle whose residual is out of tolerance.
struct Wrong {
    particle: usize,
    quantity: Quantity,
    excess: Excess,
}

/// The positions or the velocities of a state.
fn values(state: &State, quantity: Quantity) -> &[f64] {
    match quantity {
        Quantity::Position => &state.positions,
        Quantity::Velocity => &state.velocities,
    }
}

/// The index of the coordinate of a particle that differs most.
fn worst(expected: &[f64], got: &[f64], particle: usize, dimension: usize) -> usize {
    let difference = |index: &usize| (expected[*index] - got[*index]).abs();
    let range = particle * dimension..(particle + 1) * dimension;
    let worst = range.max_by(|a, b| difference(a).total_cmp(&difference(b)));
    worst.unwrap_or(particle * dimension)
}

/// Judges a trace of which states are not compared beyond the horizon: each step by itself, and energy and momentum beyond
/// the horizon.
struct Beyond {
    horizon: Horizon,
    steps: SingleSteps,
    physics: Stepper,
    /// The first that is wrong.
    drift: Option<Drift>,
}

impl Beyond {
    fn of(calibrated: &Calibrated) -> Option<Self> {
        let scene = calibrated.scene.as_ref()?;
        let horizon = calibrated.envelope.horizon?;
        let physics = Stepper::new(scene, LinearSolver::Auto);
        Some(Self { horizon, steps: SingleSteps::new(scene), physics, drift: None })
    }

    /// Redoes the step to state `state` from the trace's own states before it, the last of `recent`.
    fn check_step(&mut self, state: u64, recent: &VecDeque<(State, State)>, after: &State) {
        let mut own = recent.iter().rev().map(|(_, got)| got);
        let Some(before) = own.next().filter(|_| self.drift.is_none()) else { return };
        let step = SingleStep { step: state - 1, earlier: own.next(), before, after };
        let Some(wrong) = self.steps.check(step) else { return };
        let WrongStep { particle, quantity, residual, bound, expected } = wrong;
        let expected = match quantity {
            Quantity::Position => expected.positions,
            Quantity::Velocity => expected.velocities,
        };
        let (got, axes) = (values(after, quantity), self.steps.dimension());
        let index = worst(&expected, got, particle, axes);
        let place = Place { step: state, particle, quantity, axis: index % axes };
        self.drift = Some(Drift::Step {
            place,
            expected: expected[index],
            got: got[index],
            residual,
            envelope: bound.envelope,
            tolerance: bound.tolerance,
        });
    }

    fn check(&mut self, step: u64, expected: &State, got: &State) {
        if self.drift.is_some() {
            return;
        }
        let of = |state: &State| self.physics.invariants(step, &state.positions, &state.velocities);
        let (oracle, own) = (of(expected), of(got));
        let Horizon { energy, momentum, .. } = self.horizon;
        let (by_energy, by_momentum) = calibration::difference(oracle, own);
        let by_energy =
            (Conserved::Energy { expected: oracle.energy, got: own.energy }, by_energy, energy);
        let differences = [by_energy, (Conserved::Momentum, by_momentum, momentum)];
        for (quantity, difference, envelope) in differences {
            let tolerance = calibration::FACTOR_BEYOND * envelope;
            // A NaN does not agree.
            if difference <= tolerance {
                continue;
            }
            self.drift = Some(Drift::Conserved { quantity, step, difference, envelope, tolerance });
            return;
        }
    }
}

/// Euclidean distance.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

fn context_row(
    expected: &State,
    got: &State,
    particle: usize,
    step: u64,
    dimension: usize,
) -> ContextRow {
    let range = particle * dimension..(particle + 1) * dimension;
    let row = |state: &State| {
        [&state.positions[range.clone()], &state.velocities[range.clone()]].concat()
    };
    ContextRow { step, expected: row(expected), got: row(got) }
}
