//! Evidence in the scenes of a submission: steps of its traces, and whether a changed simulator makes the same steps.
//!
//! ```text
//! sample    one step of the trace, redone with a change from the trace's own state before it
//! replay    the whole scene with a change, from the scene's initial state, against the trace
//! ```
//!
//! A replay agrees if every state does, within ten times the difference to a replay whose last bits differ, plus the scene's
//! calibrated tolerance and the error of an iterative solver. Once that spread is a thousandth of the motion, or Newton's
//! method no longer converges, states say nothing more; then the single steps decide.

use std::collections::BTreeSet;
use std::ops::Deref;

use crate::change::{Change, Memory, Model, Place, Residual, Work};
use scene::schema::Convergence;
use scene::trace::State;
use scene::{Rendering, Scene};

use super::FEW;
use super::form::Kind;
use super::judged::{JudgedScene, Outcome};
use super::scope::Failing;
use super::thresholds::Thresholds;
use crate::bound::Bound;
use crate::steps::{self, Evidence, Rounding, WrongSteps};

/// Error of a linear solver relative to the change of the velocities, where a change makes the system worse.
const SOLVER: f64 = 1e-10;

/// Where what is wrong is smaller than this many times that error, the error is taken to be as many times smaller than what is wrong.
const APART: f64 = 100.0;

/// Relative error of a step, or of its change, in single precision: larger ones have another reason.
const NEAR: f64 = 1e-4;

/// Numbers of fewer digits than this are not called rounded: few numbers have that many.
const FEWEST: usize = 3;

/// A scene of a submission.
pub(super) struct SceneEvidence<'a> {
    pub(super) judged: &'a JudgedScene<'a>,
    /// The scene without what steps do not need.
    pub(super) scene: Scene,
    pub(super) passed: bool,
    /// How it failed; `None` if it passed.
    pub(super) kind: Option<Kind>,
    pub(super) steps: WrongSteps,
    pub(super) evidence: Vec<Evidence>,
    /// The largest error of a wrong step, relative to its change; infinite if none is wrong.
    pub(super) relative_error: f64,
    /// Relative error of the numbers of the trace.
    pub(super) rounding: f64,
    /// The numbers that judge it.
    pub(super) limits: &'a Thresholds,
    pub(super) work: Work,
}

/// Wrong steps of a scene that tell changes apart.
pub(super) struct Samples<'a> {
    pub(super) limits: &'a Thresholds,
    steps: Vec<&'a Evidence>,
}

impl<'a> Deref for Samples<'a> {
    type Target = [&'a Evidence];

    fn deref(&self) -> &[&'a Evidence] {
        &self.steps
    }
}

/// The largest error of the velocities after a wrong step of this size, and of positions divided by it, relative to the change of
/// velocities in it; infinite if none is wrong.
fn relative_error(evidence: &[Evidence], h: f64) -> f64 {
    let wrong = evidence.iter().filter(|evidence| evidence.is_wrong());
    let error = |Evidence { sample, defect: [x, v], .. }: &Evidence| {
        let [_, change] = distances(&sample.before, &sample.after);
        v.max(x / h) / change
    };
    wrong.map(error).reduce(f64::max).unwrap_or(f64::INFINITY)
}

/// Number of particles up to which they are listed.
const FEW_PARTICLES: usize = 4;

/// How far an equation is off at most where it is said to hold, as a share of how far it is off elsewhere.
const CLEAR: f64 = 1e-3;

/// Whether a change makes the trace's steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Agreement {
    Agrees,
    Differs,
    /// Newton's method converges slowly or not at all with the change: no statement.
    Open,
}

impl<'a> SceneEvidence<'a> {
    pub(super) fn of(judged: &'a JudgedScene<'a>, limits: &'a Thresholds) -> Self {
        let JudgedScene { scene: inner, outcome, states, .. } = judged;
        let mut scene = Self {
            judged,
            scene: stripped(inner),
            passed: *outcome == Outcome::Passed,
            kind: Kind::of(judged),
            steps: WrongSteps::default(),
            evidence: Vec::new(),
            relative_error: f64::INFINITY,
            rounding: 0.0,
            limits,
            work: Work::default(),
        };
        if states.len() < 2 {
            return scene;
        }
        if scene.passed {
            scene.evidence = steps::sampled(inner, states);
        } else if *outcome != Outcome::NotJudged {
            if scene.kind.as_ref().is_some_and(|kind| !is_rounding(kind, judged)) {
                scene.kind = Some(Kind::Wrong);
            }
            scene.rounding = Rounding::of(states).unit();
            (scene.steps, scene.evidence) = steps::examine(inner, states, 0.0);
            scene.relative_error = relative_error(&scene.evidence, inner.time_step);
        }
        scene
    }

    /// A scene whose steps are examined already, with numbers of at least this relative error; a wrong one unless it passed.
    pub(super) fn of_steps(
        judged: &'a JudgedScene<'a>,
        (steps, evidence): (WrongSteps, Vec<Evidence>),
        rounding: f64,
        limits: &'a Thresholds,
    ) -> Self {
        let passed = judged.outcome == Outcome::Passed;
        Self {
            judged,
            scene: stripped(judged.scene),
            passed,
            kind: (!passed).then_some(Kind::Wrong),
            steps,
            relative_error: relative_error(&evidence, judged.scene.time_step),
            evidence,
            rounding: Rounding::of(judged.states).unit().max(rounding),
            limits,
            work: Work::default(),
        }
    }

    /// The steps of the scene with these changes.
    pub(super) fn model(&self, changes: &[Change]) -> Model {
        Model::counted(&self.scene, changes, &self.work)
    }

    /// Whether Newton's method solves its steps.
    pub(super) fn is_newton(&self) -> bool {
        matches!(self.scene.integrator.convergence, Convergence::Update(_))
    }

    /// Whether each sampled step is off by little, relative to the state after it.
    pub(super) fn is_near(&self) -> bool {
        self.evidence.iter().all(|Evidence { sample, defect, .. }| {
            let sizes = [&sample.after.positions, &sample.after.velocities].map(|all| largest(all));
            (0..2).all(|kind| defect[kind] <= NEAR * sizes[kind])
        })
    }

    /// Whether its steps are right to a few digits, and wrong.
    pub(super) fn is_nearly_right(&self) -> bool {
        self.relative_error < NEAR
    }

    /// The error of a linear solver that a change is allowed, relative to the change of the velocities.
    fn solver(&self) -> f64 {
        SOLVER.min(self.relative_error / APART)
    }

    /// Whether its first step is not finite.
    pub(super) fn is_infinite_at_once(&self) -> bool {
        matches!(self.judged.outcome, Outcome::NotFinite(step) if step <= 1)
    }

    /// Whether its steps are evidence of a mistake.
    pub(super) fn is_suspect(&self) -> bool {
        self.kind == Some(Kind::Wrong) && self.steps.wrong > 0
    }

    /// Simplest first: what a student should do first.
    pub(super) fn simplicity(&self) -> [usize; 5] {
        super::simplicity(self.judged.scene)
    }

    /// The wrong steps whose defect is far above the noise.
    fn clear(&self) -> impl Iterator<Item = &Evidence> {
        self.evidence.iter().filter(|evidence| {
            let far =
                |kind: usize| evidence.defect[kind] > self.limits.clear * evidence.noise[kind];
            evidence.is_wrong() && (far(0) || far(1))
        })
    }

    /// Whether there is such a step.
    pub(super) fn has_clear_sample(&self) -> bool {
        self.clear().next().is_some()
    }

    /// First of these steps that `model` does not make: in the others, nothing is wrong besides its changes.
    pub(super) fn clear_samples(&self, model: &Model) -> Samples<'_> {
        let is_left = |evidence: &&Evidence| {
            let Evidence { sample, noise, .. } = evidence;
            let Some(residual) = model.residual(sample) else { return !model.remembers() };
            let [x, v] = noise.map(|noise| self.limits.left * noise);
            let is_off = |left: &[f64], bound: f64| left.iter().any(|left| left.abs() > bound);
            is_off(&residual.position, x)
                || is_off(&residual.momentum, v * residual.stiffness)
                || model.moves_fixed(sample, v)
        };
        let left = self.clear().filter(is_left);
        Samples { limits: self.limits, steps: left.take(self.limits.first).collect() }
    }

    /// All sampled steps.
    pub(super) fn all_samples(&self) -> Samples<'_> {
        Samples { limits: self.limits, steps: self.evidence.iter().collect() }
    }

    /// Whether `model` makes the sampled step, after the steps of `memory`.
    fn agrees(&self, model: &Model, memory: &mut Memory, evidence: &Evidence) -> Agreement {
        let Evidence { sample, noise, .. } = evidence;
        let earlier = sample.earlier.as_ref();
        let Some(made) = model.step(memory, sample.step, earlier, &sample.before) else {
            return Agreement::Differs;
        };
        let [x, v] = distances(&made.state, &sample.after);
        let [_, change] = distances(&sample.before, &sample.after);
        let solver = if change.is_finite() { self.solver() * change } else { 0.0 };
        if x <= self.limits.left * noise[0] + self.scene.time_step * solver
            && (self.judged.has_positions_alone || v <= self.limits.left * noise[1] + solver)
        {
            return Agreement::Agrees;
        }
        if made.converged { Agreement::Differs } else { Agreement::Open }
    }

    /// Whether the sampled step ends with these velocities.
    pub(super) fn ends_at(&self, evidence: &Evidence, velocities: &[f64]) -> bool {
        let Evidence { sample, noise: [_, noise], .. } = evidence;
        let [_, change] = distances(&sample.before, &sample.after);
        let pairs = velocities.iter().zip(&sample.after.velocities);
        let off = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        off <= self.limits.left * noise + self.solver() * change
    }

    /// Whether `model` makes all sampled steps, or those of the first `most`.
    pub(super) fn agrees_with(&self, model: &Model, most: usize) -> Agreement {
        self.agree(model, self.evidence.iter().take(most))
    }

    /// Whether `model` makes these steps, in their order.
    fn agree<'e>(&self, model: &Model, steps: impl Iterator<Item = &'e Evidence>) -> Agreement {
        let mut all = Agreement::Agrees;
        let mut memory = Memory::default();
        let mut next = 0;
        for evidence in steps {
            // The kept values depend on every step of the trace before this one.
            let states = &self.judged.states;
            for step in next..if model.remembers() { evidence.sample.step as usize } else { 0 } {
                let earlier = step.checked_sub(1).map(|earlier| &states[earlier]);
                if model.step(&mut memory, step as u64, earlier, &states[step]).is_none() {
                    return Agreement::Differs;
                }
            }
            next = evidence.sample.step as usize + 1;
            match self.agrees(model, &mut memory, evidence) {
                Agreement::Agrees => {}
                Agreement::Differs => return Agreement::Differs,
                Agreement::Open => all = Agreement::Open,
            }
        }
        all
    }

    /// Replays the whole scene with these changes.
    pub(super) fn replay(&self, changes: &[Change]) -> Agreement {
        let model = self.model(changes);
        if !model.can_step() {
            return Agreement::Open;
        }
        let Some(first) = self.judged.states.first() else { return Agreement::Open };
        let start = model.start();
        let mut replay = Replay::new(&start);
        let Some(expected) = self.expected(&replay, &start, 0) else { return Agreement::Open };
        if !within(&start, first, expected) {
            return Agreement::Differs;
        }
        for (step, got) in self.judged.states.iter().enumerate().skip(1) {
            let number = step as u64 - 1;
            match replay.advance(&model, number) {
                Advance::Failed => return Agreement::Differs,
                Advance::NotConverged => return self.single_steps(&model, step),
                Advance::Made => {}
            }
            let Some(tolerance) = self.expected(&replay, got, step) else {
                return self.single_steps(&model, step);
            };
            if !within(&replay.main, got, tolerance) {
                return Agreement::Differs;
            }
        }
        Agreement::Agrees
    }

    /// The tolerances at a state; `None` where replays of the same steps differ too much.
    fn expected(&self, replay: &Replay, got: &State, step: usize) -> Option<[f64; 2]> {
        let calibrated = self.judged.envelope.get(step).copied().unwrap_or_default();
        let values = [&got.positions, &got.velocities];
        let mut tolerances = [f64::INFINITY; 2];
        for kind in 0..2 - usize::from(self.judged.has_positions_alone) {
            let size = replay.size[kind].max(largest(values[kind]));
            if replay.spread[kind] > self.limits.chaotic * size {
                return None;
            }
            let Bound { tolerance, .. } = Bound::of(replay.spread[kind] + calibrated[kind], size);
            tolerances[kind] = tolerance + (self.solver() + self.rounding) * size;
        }
        Some(tolerances)
    }

    /// The failure that the wrong steps show, with the changes made.
    pub(super) fn failing(&self, made: &[Change]) -> Failing<'_> {
        let model = self.model(made);
        let axes = self.scene.dimension.count();
        let is_of_fixed = |change: &Change| {
            matches!(change.place, Place::Fixed(_) | Place::FixedUnder(_))
                && change.acts_in(&self.scene)
        };
        let holds_otherwise = made.iter().any(is_of_fixed);
        let mut shown = [false; 2];
        let mut wrong = BTreeSet::new();
        for evidence in self.evidence.iter().filter(|evidence| evidence.is_wrong()) {
            let Evidence { sample, noise: [x, v], .. } = evidence;
            let Some(residual) = model.residual(sample) else { continue };
            // The numbers in the rule have the trace's own errors.
            let h = self.scene.time_step;
            let size = largest(&sample.after.positions) + h * largest(&sample.after.velocities);
            let unit = self.rounding.max(f64::EPSILON);
            let bound = self.limits.clearly * (x + h * v + unit * size);
            for (dof, left) in residual.position.iter().enumerate() {
                let is_fixed = self.scene.particles[dof / axes].fixed;
                shown[usize::from(is_fixed)] |= left.abs() > bound;
            }
            shown[1] |= !holds_otherwise && model.moves_fixed(sample, self.limits.clearly * v);
            let bound = self.momentum_bound(&residual, *v);
            let momentum = residual.momentum.iter().enumerate();
            wrong
                .extend(momentum.filter(|(_, left)| left.abs() > bound).map(|(dof, _)| dof / axes));
        }
        let [moves_otherwise, moves_fixed] = shown;
        Failing { scene: self.judged.scene, moves_otherwise, moves_fixed, wrong }
    }

    /// Residual of the momentum from which an equation is off, for this accepted error of velocities.
    fn momentum_bound(&self, residual: &Residual, noise: f64) -> f64 {
        self.limits.clearly * noise * residual.stiffness
    }

    /// The first fixed particle that does not move by its velocity, in words.
    pub(super) fn misplaced(&self) -> Option<String> {
        let axes = self.scene.dimension.count();
        let h = self.scene.time_step;
        self.evidence.iter().filter(|evidence| evidence.is_wrong()).find_map(|evidence| {
            let Evidence { sample, noise, .. } = evidence;
            let (before, after) = (&sample.before, &sample.after);
            let fixed = self.scene.particles.iter().enumerate().filter(|(_, one)| one.fixed);
            let off = |number: usize| {
                let mut squares = [0.0; 2];
                for dof in number * axes..(number + 1) * axes {
                    let (v, new) = (before.velocities[dof], after.velocities[dof]);
                    let moved = after.positions[dof] - before.positions[dof];
                    squares[0] += (moved - h * v).powi(2);
                    squares[1] += (new - v).powi(2);
                }
                squares.map(f64::sqrt)
            };
            let step = sample.step + 1;
            fixed.map(|(number, _)| (number, off(number))).find_map(|(number, [x, v])| {
                let is_clear = |off: f64, kind: usize| off > self.limits.clearly * noise[kind];
                let what = match (is_clear(x, 0), is_clear(v, 1)) {
                    (true, _) => format!(
                        "particle {number} is {x:.1e} away from where its velocity takes it"
                    ),
                    (false, true) => {
                        format!("the velocity of particle {number} changes by {v:.1e}")
                    }
                    (false, false) => return None,
                };
                Some(format!("in step {step} of {}, {what}, though it is fixed", self.judged.name))
            })
        })
    }

    /// The wrong part of the equation of the first wrong step, in words, if the rest is right.
    pub(super) fn wrong_part(&self) -> Option<String> {
        let model = self.model(&[]);
        let axes = self.scene.dimension.count();
        let Evidence { sample, noise: [_, v], .. } =
            self.evidence.iter().find(|evidence| evidence.is_wrong())?;
        let residual = model.residual(sample)?;
        let bound = self.momentum_bound(&residual, *v);
        let momentum = residual.momentum.iter().enumerate();
        let free = momentum.filter(|(dof, _)| !self.scene.particles[dof / axes].fixed);
        let (wrong, mut right): (Vec<_>, Vec<_>) = free.partition(|(_, left)| left.abs() > bound);
        let holds: BTreeSet<usize> = right.iter().map(|(dof, _)| dof / axes).collect();
        // Where nothing changes, an equation holds that says nothing.
        right.retain(|(dof, _)| sample.after.velocities[*dof] != sample.before.velocities[*dof]);
        let largest = right.iter().fold(0.0_f64, |most, (_, left)| most.max(left.abs()));
        let is_clear = wrong.iter().all(|(_, left)| largest < CLEAR * left.abs());
        if right.is_empty() || !is_clear {
            return None;
        }
        let all = |list: &[(usize, &f64)], of: fn(usize, usize) -> usize| -> BTreeSet<usize> {
            list.iter().map(|(dof, _)| of(*dof, axes)).collect()
        };
        let [wrong_axes, right_axes] = [&wrong, &right].map(|list| all(list, |dof, n| dof % n));
        let [wrong_particles, right_particles] =
            [&wrong, &right].map(|list| all(list, |dof, n| dof / n));
        let what = if wrong_particles.is_disjoint(&right_particles) {
            let numbers = |list: &BTreeSet<usize>| {
                let names: Vec<String> = list.iter().map(usize::to_string).collect();
                let noun = if names.len() == 1 { "particle" } else { "particles" };
                format!("{noun} {}", names.join(", "))
            };
            match wrong_particles.len() {
                0 => return None,
                1..=FEW_PARTICLES => format!("is off for {} only", numbers(&wrong_particles)),
                _ if holds.len() <= FEW_PARTICLES => format!("holds for {} only", numbers(&holds)),
                _ => return None,
            }
        } else if wrong_axes.len() == 1 && wrong_axes.is_disjoint(&right_axes) && axes > 1 {
            let axis = wrong_axes.first().map_or("", |axis| ["x", "y", "z"][*axis]);
            format!("is off along {axis} only")
        } else {
            return None;
        };
        Some(format!("the equation of step {} of {} {what}", sample.step + 1, self.judged.name))
    }

    /// Whether every step from this state on is made from the trace's own state before it.
    fn single_steps(&self, model: &Model, from: usize) -> Agreement {
        self.agree(model, self.evidence.iter().filter(|e| e.sample.step as usize + 1 >= from))
    }
}

/// Where numbers stop being finite before the last state in some scenes, the last state is no fault of the output in others.
pub(super) fn settle_last_states(scenes: &mut [SceneEvidence<'_>]) {
    let is_earlier = |scene: &SceneEvidence<'_>| {
        matches!(scene.judged.outcome, Outcome::NotFinite(_)) && scene.kind == Some(Kind::Wrong)
    };
    if scenes.iter().any(is_earlier) {
        for scene in scenes.iter_mut().filter(|one| one.kind == Some(Kind::NotFiniteAtLast)) {
            scene.kind = Some(Kind::Wrong);
        }
    }
}

/// Where most wrong first states are states that the program goes on from, all are, whatever their numbers look like: a step
/// with another mistake in it does not follow from its first state.
pub(super) fn settle_first_states(scenes: &mut [SceneEvidence<'_>]) {
    let is_wrong = |scene: &SceneEvidence<'_>| {
        scene.kind.is_some() && scene.judged.first_wrong.is_some_and(|first| first.step == 0)
    };
    let count = |kind: Option<Kind>| {
        let of_kind = |scene: &&SceneEvidence<'_>| {
            is_wrong(scene) && kind.as_ref().is_none_or(|kind| scene.kind.as_ref() == Some(kind))
        };
        scenes.iter().filter(of_kind).count()
    };
    let [read, written, open] =
        [Kind::InitialState, Kind::InitialWritten, Kind::InitialOpen].map(|kind| count(Some(kind)));
    if read < FEW || written > 0 || 4 * read < 3 * (count(None) - open) {
        return;
    }
    for scene in scenes.iter_mut().filter(|scene| is_wrong(scene)) {
        scene.kind = Some(Kind::InitialState);
    }
}

/// A scene, with what is known of it.
#[derive(Clone, Copy)]
pub(super) struct Marked<'a> {
    shown: &'a SceneEvidence<'a>,
    /// Whether a fault of the output, another root or the changes made so far explain it.
    pub(super) explained: bool,
    /// Whether its steps satisfy the right equation, with another solution.
    pub(super) has_other_root: bool,
    /// Whether Newton's method converges slowly or not at all with the changes made so far: it shows nothing.
    pub(super) open: bool,
    /// Whether it is compared with nothing yet.
    pub(super) is_set_aside: bool,
}

impl<'a> Deref for Marked<'a> {
    type Target = SceneEvidence<'a>;

    fn deref(&self) -> &SceneEvidence<'a> {
        self.shown
    }
}

impl<'a> Marked<'a> {
    pub(super) fn new(shown: &'a SceneEvidence<'a>) -> Self {
        let has_other_root = shown.judged.has_other_root;
        Self { shown, explained: false, has_other_root, open: false, is_set_aside: false }
    }

    /// Whether its steps are evidence of a mistake.
    pub(super) fn is_suspect(&self) -> bool {
        !self.is_set_aside && self.shown.is_suspect()
    }

    /// Whether its steps are evidence that nothing explains.
    pub(super) fn is_left(&self) -> bool {
        self.is_suspect() && !self.explained && !self.open
    }

    /// Whether its first step is not finite, and nothing explains it.
    pub(super) fn fails_at_once(&self) -> bool {
        self.is_infinite_at_once() && !self.is_set_aside && !self.explained && !self.open
    }

    /// Whether a change that disagrees with it is refuted. A wrong Jacobian may have led to another root, and states in a
    /// wrong form show no steps.
    pub(super) fn is_settled(&self) -> bool {
        let has_states = self.kind.as_ref().is_none_or(Kind::keeps_states);
        (self.passed || self.explained && has_states) && !self.has_other_root && !self.is_set_aside
    }
}

/// The scene without its names and drawing.
fn stripped(scene: &Scene) -> Scene {
    let mut stripped = scene.clone();
    (stripped.name, stripped.description, stripped.tag) = (String::new(), None, None);
    stripped.rendering = Rendering::default();
    stripped
}

/// Whether rounding alone makes the trace differ; true for failures of another kind than rounding.
fn is_rounding(kind: &Kind, judged: &JudgedScene<'_>) -> bool {
    let size = |of: fn(&State) -> &[f64]| {
        judged.states.iter().map(|state| largest(of(state))).fold(0.0, f64::max)
    };
    let sizes = [size(|state| &state.positions), size(|state| &state.velocities)];
    let allowed = match kind {
        Kind::Digits(digits) if *digits < FEWEST => return false,
        Kind::Digits(digits) => sizes.map(|size| 10.0_f64.powi(1 - *digits as i32) * size),
        Kind::Decimals(decimals) => {
            let unit = 10.0_f64.powi(-(*decimals as i32));
            if unit > 10.0_f64.powi(1 - FEWEST as i32) * sizes[0].max(sizes[1]) {
                return false;
            }
            [unit; 2]
        }
        Kind::Single => sizes.map(|size| 1e-4 * size),
        _ => return true,
    };
    let [position, velocity] = judged.largest;
    position <= 2.0 * allowed[0] && velocity <= 2.0 * allowed[1]
}

/// A replay with another one whose last bits differ.
struct Replay {
    main: State,
    other: State,
    earlier: Option<[State; 2]>,
    memories: [Memory; 2],
    random: fastrand::Rng,
    spread: [f64; 2],
    size: [f64; 2],
}

enum Advance {
    Made,
    NotConverged,
    Failed,
}

impl Replay {
    fn new(start: &State) -> Self {
        let random = fastrand::Rng::with_seed(0);
        let (main, other) = (start.clone(), start.clone());
        let memories = Default::default();
        Self { main, other, earlier: None, memories, random, spread: [0.0; 2], size: [0.0; 2] }
    }

    fn advance(&mut self, model: &Model, step: u64) -> Advance {
        for value in self.other.positions.iter_mut().chain(&mut self.other.velocities) {
            *value += f64::EPSILON * f64::from(self.random.i8(-1..=1)) * *value;
        }
        let earlier = |number: usize| self.earlier.as_ref().map(|states| &states[number]);
        let [memory, memory_of_other] = &mut self.memories;
        let Some(made) = model.step(memory, step, earlier(0), &self.main) else {
            return Advance::Failed;
        };
        if !made.converged {
            return Advance::NotConverged;
        }
        let Some(other) = model.step(memory_of_other, step, earlier(1), &self.other) else {
            return Advance::NotConverged;
        };
        let before = std::mem::replace(&mut self.main, made.state);
        let before_other = std::mem::replace(&mut self.other, other.state);
        self.earlier = Some([before, before_other]);
        let found = distances(&self.main, &self.other);
        self.spread = [0, 1].map(|kind| self.spread[kind].max(found[kind]));
        let sizes = [largest(&self.main.positions), largest(&self.main.velocities)];
        self.size = [0, 1].map(|kind| self.size[kind].max(sizes[kind]));
        Advance::Made
    }
}

fn within(a: &State, b: &State, tolerance: [f64; 2]) -> bool {
    let [x, v] = distances(a, b);
    x <= tolerance[0] && v <= tolerance[1]
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |size: f64, value| size.max(value.abs()))
}

/// The largest differences: position, velocity. A difference that is not a number is infinite.
fn distances(a: &State, b: &State) -> [f64; 2] {
    let of = |a: &[f64], b: &[f64]| {
        let differences = a.iter().zip(b).map(|(a, b)| (a - b).abs());
        differences.fold(0.0, |most: f64, d| if d.is_nan() { f64::INFINITY } else { most.max(d) })
    };
    [of(&a.positions, &b.positions), of(&a.velocities, &b.velocities)]
}
