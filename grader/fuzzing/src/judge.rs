//! Judges a simulator on a drawn scene.
//!
//! ```text
//! our states ── the floor of a tolerance ── agrees: right
//!            ── differs: envelope of this scene, by all variants ── within: right
//!                        ── a horizon, a variant that fails, a wide envelope: the scene tells nothing
//!                        ── 10 times the tolerance, and no other root of the same equation: wrong
//! ```
//!
//! A right program costs one run of ours; the two dozen variants run only where a program differs.

use crate::conditioning::Conditioning;
use crate::motion::{Replay, simulate, statistics};
use fastrand::Rng;
use grader::compare::calibration::{Bound, Bounds, Calibration, Class, Envelope, calibrate_by};
use grader::compare::{Calibrated, Comparison, Criteria, Expectation, compare, compare_watched};
use grader::grading::refusal;
use grader::submission::program::{Program, SceneSource};
use grader::submission::{StateSource, serving};
use grader::verdict::{Failure, Fault, Quantity, Verdict};
use reference::equation::{self, Equation};
use reference::laws::Laws;
use reference::second::{Second, Style};
use scene::Scene;
use scene::schema::{Convergence, StepEquation};
use scene::trace::{Shape, State};

/// Numbers that keep right programs from being called wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strictness {
    /// Ratio of a residual to its tolerance from which a program is wrong. The tolerance is already ten times the largest
    /// difference of two dozen right programs; a million scenes have rarer differences than they show.
    pub clear: f64,
    /// The same under a method without a second implementation: its envelope lacks other formulas.
    pub clear_alone: f64,
    /// Largest tolerance, relative to the size of the motion, of a scene that is used.
    pub sensitive: f64,
    /// Largest change of a motion by changes of a billionth, relative to its size: where it is larger, a force all but jumps.
    /// The growth of rounding errors is bounded by [`Self::sensitive`].
    pub jump: f64,
    /// Largest number of a motion that is used.
    pub large: f64,
    /// Most iterations of Newton's method in a step without a doubt. The first iterates of a longer one may be wild, and its end
    /// depend on rounding errors.
    pub iterations: u64,
    /// Most iterations of a step that is used if nearby scenes take as many: a program may end after 50.
    pub steady_iterations: u64,
    /// Largest amplification by the matrix of a step, 1 where forces hold or dissipate. Elimination without pivots fails
    /// before others do.
    pub amplification: f64,
    /// Smallest ratio of a tolerance on updates to their rounding errors. Where it is less, whether an update ever comes below
    /// the tolerance is chance; the same scene, moved by its size, has several times the rounding errors.
    pub rounding: f64,
}

impl Default for Strictness {
    fn default() -> Self {
        Self {
            clear: 10.0,
            clear_alone: 1e4,
            sensitive: 1e-7,
            jump: 1e-3,
            large: 1e6,
            iterations: 8,
            steady_iterations: 32,
            amplification: 1e3,
            rounding: 16.0,
        }
    }
}

/// A tested simulator.
pub trait Subject: Sync {
    /// Starts it on a scene, whose file has this text.
    ///
    /// # Errors
    /// Why there are no states.
    fn start(&self, scene: &Scene, text: &str) -> Result<Box<dyn StateSource>, Verdict>;

    /// The most scenes that it takes in one run.
    fn at_a_time(&self) -> usize {
        1
    }

    /// Starts it on several scenes at once, if it can: `None` for each scene that it is not started on.
    fn serve(&self, scenes: &[(&Scene, &str)]) -> Vec<Option<Box<dyn StateSource>>> {
        scenes.iter().map(|_| None).collect()
    }

    /// Whether it is one program, which transformed scenes test. The built-in simulator on transformed scenes is not.
    fn has_symmetries(&self) -> bool {
        true
    }
}

impl Subject for Program {
    fn start(&self, scene: &Scene, text: &str) -> Result<Box<dyn StateSource>, Verdict> {
        let run = self.run(SceneSource::Xml(text), Shape::of(scene));
        run.map(|run| Box::new(run) as Box<dyn StateSource>).map_err(|verdict| match verdict {
            Verdict::Fail(failure) => Verdict::Fail(refusal(scene, "xml", failure)),
            other => other,
        })
    }

    fn at_a_time(&self) -> usize {
        if self.serves() { serving::MOST } else { 1 }
    }

    fn serve(&self, scenes: &[(&Scene, &str)]) -> Vec<Option<Box<dyn StateSource>>> {
        let shapes: Vec<(&str, Shape)> =
            scenes.iter().map(|(scene, text)| (*text, Shape::of(scene))).collect();
        // A separate run says why it could not be run.
        let served = self.serve(&shapes).unwrap_or_default().into_iter();
        let boxed = |run| Box::new(run) as Box<dyn StateSource>;
        let mut all: Vec<_> = served.map(|run| run.map(boxed)).collect();
        all.resize_with(scenes.len(), || None);
        all
    }
}

/// A scene with the outcome of a run.
#[derive(Debug, Clone)]
pub enum Judgement {
    /// The states agree.
    Right(Run),
    /// The program says that it lacks something.
    Refused,
    /// Equally right programs differ too much to tell, or our own simulator has no answer.
    Tells(Nothing),
    /// The program is wrong.
    Wrong(Box<Wrong>),
    /// The grader or its machine could not run it.
    Fault(Fault),
}

/// How a program was run on a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum How {
    /// By itself.
    Alone,
    /// Among other scenes in one process.
    Served,
    /// By itself, and right; among other scenes, it was not.
    Unlike,
    /// By itself, and not right; among other scenes, it was.
    RightServed,
}

/// Why a scene tells nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Nothing {
    /// A step of ours fails.
    NoAnswer,
    /// Equally right programs differ much, or one of them fails.
    Sensitive,
    /// The motion leaves the range of ordinary numbers.
    Explodes,
    /// Particles of a force are in one place, or pass through it in the first guess of a step.
    Degenerate,
    /// Newton's method takes many iterations, its matrix is nearly singular, or its tolerance is near rounding errors.
    Slow,
    /// The steps solve the same equation; another solution.
    OtherRoot,
    /// The residual is hardly beyond its tolerance.
    Close,
}

/// The states of a run that is right.
#[derive(Debug, Clone)]
pub struct Run {
    /// The program's states.
    pub states: Vec<State>,
    /// The largest ratio of a residual to its tolerance.
    pub used: f64,
}

/// A failure.
#[derive(Debug, Clone)]
pub struct Wrong {
    /// The failure.
    pub failure: Failure,
    /// The comparison of its states with ours; it counts no state where the program has none.
    pub comparison: Comparison,
    /// The program's finite states.
    pub states: Vec<State>,
    /// Ours.
    pub expected: Vec<State>,
    /// Differences between right programs.
    pub envelope: Envelope,
}

impl Wrong {
    /// The first step that shows it: its number counts from 1; 0 is the initial state.
    pub fn first_step(&self) -> u64 {
        match (&self.comparison.first_wrong, &self.failure) {
            (Some(first), _) => first.place.step,
            (None, Failure::NotFinite { place, .. }) => place.step,
            _ => self.comparison.states,
        }
    }
}

/// Judges by these numbers, with envelopes of variants of some kinds.
#[derive(Debug, Clone, Copy)]
pub struct Judge {
    /// When a program is called wrong.
    pub strictness: Strictness,
    /// The kinds of right programs.
    pub classes: fn(Class) -> bool,
}

impl Default for Judge {
    fn default() -> Self {
        Self { strictness: Strictness::default(), classes: |_| true }
    }
}

impl Judge {
    /// Runs and judges a subject on a scene.
    pub fn judge(&self, subject: &dyn Subject, scene: &Scene, text: &str) -> Judgement {
        match self.expected(scene) {
            Ok(expected) => self.judge_states(scene, &expected, || subject.start(scene, text)),
            Err(nothing) => Judgement::Tells(nothing),
        }
    }

    /// The states of a scene by our own simulator.
    ///
    /// # Errors
    /// Why the scene tells nothing.
    pub fn expected(&self, scene: &Scene) -> Result<Vec<State>, Nothing> {
        let expected = simulate(scene).map_err(|_| Nothing::NoAnswer)?;
        if expected.iter().all(|state| self.is_ordinary(state)) {
            Ok(expected)
        } else {
            Err(Nothing::Explodes)
        }
    }

    /// Judges a run among others of the same process, if there is one, and otherwise or where that is not right, one by itself.
    /// The second value says which it was.
    pub fn judge_served(
        &self,
        subject: &dyn Subject,
        (scene, text): (&Scene, &str),
        expected: &[State],
        served: Option<Box<dyn StateSource>>,
    ) -> (Judgement, How) {
        let judged = served.map(|source| self.judge_states(scene, expected, || Ok(source)));
        if let Some(judged @ Judgement::Right(_)) = judged {
            return (judged, How::Served);
        }
        let wrong = matches!(judged, Some(Judgement::Wrong(_)));
        let alone = self.judge_states(scene, expected, || subject.start(scene, text));
        let is_unlike = wrong && matches!(alone, Judgement::Right(_));
        (alone, if is_unlike { How::Unlike } else { How::Alone })
    }

    /// Judges a run by itself of a scene in which a subject is right among others of the same process.
    pub fn confirm(
        &self,
        subject: &dyn Subject,
        (scene, text): (&Scene, &str),
        expected: &[State],
    ) -> (Judgement, How) {
        let alone = self.judge_states(scene, expected, || subject.start(scene, text));
        let is_right = matches!(alone, Judgement::Right(_));
        (alone, if is_right { How::Served } else { How::RightServed })
    }

    /// Judges the states that `start` yields against these.
    pub fn judge_states(
        &self,
        scene: &Scene,
        expected: &[State],
        start: impl FnOnce() -> Result<Box<dyn StateSource>, Verdict>,
    ) -> Judgement {
        let expectation = Expectation::of(scene);
        let criteria = |envelope| Criteria::Calibrated(Calibrated::new(envelope, scene));
        let mut states = Vec::new();
        let mut has_velocities = true;
        let compared = start().map(|mut source| {
            has_velocities = source.has_velocities();
            let mut ours = Replay::of(expected);
            let floor = criteria(Envelope::zero());
            compare_watched(&mut ours, source.as_mut(), expectation, floor, &mut |pair| {
                states.push(pair.got.clone());
            })
        });
        let comparison = compared.unwrap_or_else(Comparison::without_states);
        let failure = match comparison.verdict.clone() {
            Verdict::Pass => {
                let used = comparison.allowed.map_or(0.0, |allowed| allowed.used);
                return Judgement::Right(Run { states, used });
            }
            Verdict::GraderFault(fault) => return Judgement::Fault(fault),
            Verdict::Fail(Failure::NotImplemented(_)) => return Judgement::Refused,
            Verdict::Fail(failure) => failure,
        };
        if is_degenerate(scene, expected) {
            return Judgement::Tells(Nothing::Degenerate);
        }
        if self.is_slow(scene) {
            return Judgement::Tells(Nothing::Slow);
        }
        let Calibration { envelope, is_sound } = calibrate_by(scene, self.classes);
        if !is_sound || envelope.horizon.is_some() || self.jumps(scene, &envelope) {
            return Judgement::Tells(Nothing::Sensitive);
        }
        let wrong = Wrong { failure, comparison, states, expected: expected.to_vec(), envelope };
        if wrong.failure != Failure::Differs || !has_velocities {
            return Judgement::Wrong(Box::new(wrong));
        }
        self.differs(scene, wrong)
    }

    /// Judges states that differ by more than the floor.
    fn differs(&self, scene: &Scene, wrong: Wrong) -> Judgement {
        let compared = |states: &[State]| {
            let criteria = Criteria::Calibrated(Calibrated::new(wrong.envelope.clone(), scene));
            let (mut ours, mut theirs) = (Replay::of(&wrong.expected), Replay::of(states));
            compare(&mut ours, &mut theirs, Expectation::of(scene), criteria)
        };
        let comparison = compared(&wrong.states);
        let used = comparison.allowed.map_or(0.0, |allowed| allowed.used);
        let Some(first) = &comparison.first_wrong else {
            return Judgement::Right(Run { states: wrong.states, used });
        };
        let size = wrong.expected.iter().flat_map(|state| match first.place.quantity {
            Quantity::Position => &state.positions,
            Quantity::Velocity => &state.velocities,
        });
        let size = size.fold(0.0_f64, |size, value| size.max(value.abs()));
        if first.tolerance > self.strictness.sensitive * size {
            return Judgement::Tells(Nothing::Sensitive);
        }
        // A right program may make more updates than the steps need.
        if further(scene).is_some_and(|states| compared(&states).first_wrong.is_some()) {
            return Judgement::Tells(Nothing::Sensitive);
        }
        if diagnosis::roots::solve_all(scene, &wrong.states) {
            return Judgement::Tells(Nothing::OtherRoot);
        }
        if is_solved_by_norm(scene, &wrong.states) {
            return Judgement::Tells(Nothing::Sensitive);
        }
        let is_alone = Second::new(scene, Style::default(), 0).is_none();
        if is_alone && is_rounded(scene, &wrong, first.place.step) {
            return Judgement::Tells(Nothing::Sensitive);
        }
        let Strictness { clear, clear_alone, .. } = self.strictness;
        if used < if is_alone { clear_alone } else { clear } {
            return Judgement::Tells(Nothing::Close);
        }
        Judgement::Wrong(Box::new(Wrong { comparison, ..wrong }))
    }

    /// Whether steps of ours take many iterations, a matrix is nearly singular, or an update within the tolerance is rounding.
    fn is_slow(&self, scene: &Scene) -> bool {
        let statistics = statistics(scene);
        let Conditioning { amplification, rounding } = Conditioning::of(scene);
        let is_below_rounding = match scene.integrator.convergence {
            Convergence::Update(tolerance) => self.strictness.rounding * rounding > tolerance,
            _ => false,
        };
        let amplification = amplification.max(statistics.conditioning.largest);
        amplification > self.strictness.amplification
            || is_below_rounding
            || self.is_unsteady(scene, statistics.max_newton_iterations)
    }

    /// Whether how many iterations a step takes depends on rounding errors, as in a long wild search.
    fn is_unsteady(&self, scene: &Scene, iterations: u64) -> bool {
        if iterations <= self.strictness.iterations {
            return false;
        }
        let Ok(expected) = &simulate(scene) else { return true };
        let distances = sizes(expected).map(|size| NEAR * size);
        iterations > self.strictness.steady_iterations
            || (0..AROUND).any(|seed| {
                let beside = statistics(&moved(scene, distances, seed));
                beside.max_newton_iterations.abs_diff(iterations) > 1
            })
    }

    /// Whether the motion jumps at this scene, as where bars are folded onto each other: exact coordinates are on a jump of a
    /// force, and the last bits of a 0 show no other side of it.
    ///
    /// ```text
    /// f(x + q d) - q (f(x + d) - f(x)) - f(x)      0 up to q |d|² for a smooth motion f; a jump of f, however small |d| is
    /// ```
    fn jumps(&self, scene: &Scene, envelope: &Envelope) -> bool {
        let Ok(expected) = &simulate(scene) else { return true };
        let sizes = sizes(expected);
        let is_off = |a: &State, b: &State, bounds: [f64; 2]| {
            let values = [(&a.positions, &b.positions), (&a.velocities, &b.velocities)];
            values
                .into_iter()
                .zip(bounds)
                .any(|((a, b), bound)| a.iter().zip(b).any(|(a, b)| (a - b).abs() > bound))
        };
        let mut beside =
            (0..BESIDE).flat_map(|seed| [NEAR, -NEAR].map(|distance| (seed, distance)));
        beside.any(|(seed, distance)| {
            let at =
                |distance: f64| simulate(&moved(scene, sizes.map(|size| distance * size), seed));
            let (Ok(far), Ok(near)) = (at(distance), at(NEARER * distance)) else { return true };
            let steep = sizes.map(|size| self.strictness.jump * size);
            let back = extrapolated(expected, &far, &near);
            expected.iter().zip(&far).zip(&back).enumerate().any(|(step, ((ours, far), back))| {
                // A motion that starts at rest has the size that it will have: its neighbours have that from the first state on.
                let Bounds { position, velocity } = envelope.at(step as u64);
                let [position, velocity] = [(position, sizes[0]), (velocity, sizes[1])]
                    .map(|(bound, size)| Bound::of(bound, size));
                is_off(far, ours, steep)
                    || is_off(back, ours, [position.tolerance, velocity.tolerance])
            })
        })
    }

    fn is_ordinary(&self, state: &State) -> bool {
        let mut values = state.positions.iter().chain(&state.velocities);
        values.all(|value| value.abs() < self.strictness.large)
    }
}

/// The largest coordinate of positions, and of velocities.
fn sizes(states: &[State]) -> [f64; 2] {
    let size = |values: fn(&State) -> &[f64]| {
        let all = states.iter().flat_map(&values);
        all.fold(0.0_f64, |size, value| size.max(value.abs()))
    };
    [size(|state| &state.positions), size(|state| &state.velocities)]
}

/// Distance of nearby scenes from a scene, relative to its size.
const NEAR: f64 = 1e-9;

/// The distance of the nearer ones, as a share of that. It is beyond rounding errors, and of a smooth motion no curvature is
/// left at it.
const NEARER: f64 = 1e-4;

/// Directions of nearby scenes, on both sides of a scene: of two opposite ones, one is beyond a jump.
const BESIDE: u64 = 2;

/// Nearby scenes whose steps must take as many iterations.
const AROUND: u64 = 8;

/// The scene with its positions and velocities moved by up to half of these distances.
fn moved(scene: &Scene, distances: [f64; 2], seed: u64) -> Scene {
    let mut random = Rng::with_seed(seed);
    let mut other = scene.clone();
    for particle in &mut other.particles {
        let values = [&mut particle.position, &mut particle.velocity];
        for (values, distance) in values.into_iter().zip(distances) {
            for value in &mut values[..scene.dimension.count()] {
                *value += distance * (random.f64() - 0.5);
            }
        }
    }
    other
}

/// The states of a scene if its motion is smooth, extrapolated from those of two nearby scenes.
fn extrapolated(expected: &[State], far: &[State], near: &[State]) -> Vec<State> {
    let values = |expected: &[f64], far: &[f64], near: &[f64]| {
        let pairs = expected.iter().zip(far).zip(near);
        pairs.map(|((expected, far), near)| near - NEARER * (far - expected)).collect()
    };
    let all = expected.iter().zip(far).zip(near);
    all.map(|((expected, far), near)| State {
        time: None,
        positions: values(&expected.positions, &far.positions, &near.positions),
        velocities: values(&expected.velocities, &far.velocities, &near.velocities),
    })
    .collect()
}

/// The tolerance of further updates, as a share of the scene's.
const FURTHER: f64 = 1e-3;

/// Our states with more updates than the steps need, if the method may make them. A tolerance below the rounding is not reached.
fn further(scene: &Scene) -> Option<Vec<State>> {
    let Convergence::UpdateOption(name) = scene.integrator.convergence else { return None };
    let mut further = scene.clone();
    let tolerance = scene.integrator_options.number(name) * FURTHER;
    further.integrator_options.set(name, &format!("{tolerance:e}")).ok()?;
    // Others have no bound on their number.
    let _ = further.integrator_options.set("max_iterations", "1000");
    simulate(&further).ok()
}

/// Whether every step of a linearized method solves its system as accurately as is usual relative to the largest entry of the
/// matrix. Where masses are far apart, that determines light particles less than row by row, which is not asked of a solver.
fn is_solved_by_norm(scene: &Scene, states: &[State]) -> bool {
    if scene.integrator.equation != StepEquation::LinearizedImplicitEuler {
        return false;
    }
    let equation = Equation::solved_by_norm(scene);
    states.windows(2).enumerate().all(|(step, pair)| {
        let of = |state: &State| equation::State {
            x: state.positions.clone(),
            v: state.velocities.clone(),
        };
        let time = step as f64 * scene.time_step;
        equation.excess(None, &of(&pair[0]), &of(&pair[1]), time).0 <= 1.0
    })
}

/// Bound of a force's rounding error, relative to the magnitude of its terms.
const ROUNDING: f64 = 256.0 * f64::EPSILON;

/// Whether the states of a step differ by no more than the rounding errors of the forces at its start.
fn is_rounded(scene: &Scene, wrong: &Wrong, step: u64) -> bool {
    let h = scene.time_step;
    let Some(before) = step.checked_sub(1) else { return false };
    let (at, at_start) = (step as usize, before as usize);
    let (Some(ours), Some(theirs)) = (wrong.expected.get(at), wrong.states.get(at)) else {
        return false;
    };
    let start = &wrong.expected[at_start];
    let (x, v) = (&start.positions, &start.velocities);
    let scales = Laws::new(scene).scales_of_rounded(x, v, before as f64 * h);
    let kicks = scene.particles.iter().zip(&scales);
    let kick =
        kicks.fold(0.0_f64, |most, (particle, terms)| most.max(h * terms.force / particle.mass));
    let is_within = |a: &[f64], b: &[f64], bound: f64| {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() <= ROUNDING * bound)
    };
    is_within(&ours.positions, &theirs.positions, h * kick)
        && is_within(&ours.velocities, &theirs.velocities, kick)
}

/// Smallest distance of particles between which a force acts, relative to the size of the scene.
const CLOSEST: f64 = 1e-6;

/// Whether two particles of an element are in one place: in a state, or in the first guess `x + h v` of a step.
fn is_degenerate(scene: &Scene, states: &[State]) -> bool {
    let axes = scene.dimension.count();
    let pairs: Vec<[usize; 2]> = scene
        .forces
        .iter()
        .flat_map(|force| {
            let others = |end: usize| force.particles.iter().skip(end + 1);
            (0..force.particles.len())
                .flat_map(move |end| others(end).map(move |other| [force.particles[end], *other]))
        })
        .collect();
    states.iter().any(|State { positions, velocities, .. }| {
        let size = positions.iter().fold(0.0_f64, |size, value| size.max(value.abs()));
        [0.0, scene.time_step].into_iter().any(|h| {
            pairs.iter().any(|&[i, j]| {
                let at = |place: usize| positions[place] + h * velocities[place];
                let away = (0..axes).map(|axis| (at(axes * i + axis) - at(axes * j + axis)).abs());
                away.fold(0.0, f64::max) <= CLOSEST * size
            })
        })
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::draw::read;
    use crate::motion::Held;

    /// A step of the linearized method whose matrix is taken for symmetric, and has the rows of fixed particles.
    fn symmetrized(scene: &Scene) -> Vec<State> {
        let (h, v) = (scene.time_step, scene.velocities());
        let x: Vec<f64> = scene.positions().iter().zip(&v).map(|(x, v)| x + h * v).collect();
        let laws = Laws::new(scene);
        let derivatives = laws.jacobians(&x, &v, h);
        let particle = |dof: usize| &scene.particles[dof / 2];
        let matrix = DMatrix::from_fn(v.len(), v.len(), |i, j| {
            let at = (i.max(j), i.min(j));
            let inertia = if i == j { particle(i).mass } else { 0.0 };
            match particle(i).fixed || particle(j).fixed {
                true => f64::from(u8::from(i == j)),
                false => {
                    inertia - h * (h * derivatives.by_position[at] + derivatives.by_velocity[at])
                }
            }
        });
        let mut push = h * DVector::from_vec(laws.force(&x, &v, h));
        (0..v.len()).filter(|dof| particle(*dof).fixed).for_each(|dof| push[dof] = 0.0);
        let change = matrix.lu().solve(&push).unwrap();
        let ends: Vec<f64> = v.iter().zip(&change).map(|(v, change)| v + change).collect();
        let moved = scene.positions().iter().zip(&ends).map(|(x, v)| x + h * v).collect();
        let of = |positions, velocities| State { time: None, positions, velocities };
        vec![of(scene.positions(), v), of(moved, ends)]
    }

    #[test]
    fn a_solver_need_not_tell_light_particles_row_by_row_beside_heavy_ones() {
        let judged = |heavy: f64, fixed: u8, damping: f64| {
            let text = format!(
                r#"<scene>
                <duration time="2e-7"/>
                <integrator type="linearized-implicit-euler" dt="2e-7"/>
                <particle m="{heavy}" px="0" py="0" vx="0" vy="0" fixed="{fixed}"/>
                <particle m="2e-6" px="0" py="1" vx="1" vy="1" fixed="0"/>
                <edge i="1" j="0"/>
                <springforce edge="0" k="0" l0="0" b="{damping}"/>
                </scene>"#
            );
            let scene = read(&text).unwrap();
            let start = || Ok(Box::new(Held::of(symmetrized(&scene))) as Box<dyn StateSource>);
            Judge::default().judge_states(&scene, &simulate(&scene).unwrap(), start)
        };
        // A row of a fixed particle holds 1.
        for (heavy, fixed, damping) in [(5e5, 0, 1.0), (2e-6, 1, 0.1)] {
            let told = judged(heavy, fixed, damping);
            assert!(matches!(told, Judgement::Tells(Nothing::Sensitive)), "{heavy}: {told:?}");
        }
        for (heavy, fixed, damping) in [(1.0, 0, 1.0), (2e-6, 0, 0.1)] {
            let told = judged(heavy, fixed, damping);
            assert!(matches!(told, Judgement::Wrong(_)), "{heavy}: {told:?}");
        }
    }

    #[test]
    fn a_solver_tells_light_particles_that_nothing_is_coupled_to() {
        let scene = read(
            r#"<scene>
            <duration time="1"/>
            <integrator type="linearized-implicit-euler" dt="1"/>
            <particle m="5e5" px="0" py="0" vx="0" vy="0" fixed="0"/>
            <particle m="2e-6" px="0" py="1" vx="0" vy="0" fixed="0"/>
            <constantforce fx="0" fy="2e-6"/>
            </scene>"#,
        );
        let scene = scene.unwrap();
        let expected = simulate(&scene).unwrap();
        let mut states = expected.clone();
        states[1].positions[3] += 1e-4;
        states[1].velocities[3] += 1e-4;
        let start = || Ok(Box::new(Held::of(states)) as Box<dyn StateSource>);
        let told = Judge::default().judge_states(&scene, &expected, start);
        assert!(matches!(told, Judgement::Wrong(_)), "{told:?}");
    }
}
