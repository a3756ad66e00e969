//! Accuracy study: errors and costs of integrators over a ladder of time steps.
//!
//! ```text
//! scene ──> reference (closed form, or order 8 to two tolerances) with an error bar ──┐
//!   └─────> ladder: method × setting × h0/2^k ──> states ──> measure ─────────────────┴─> errors, cost
//!                             errors over h ──> order: slopes and windows ──> confirm: the order of each method
//!                             errors over time ──> cheapest
//! ```
//!
//! Errors of positions (m), of velocities (m/s), each the largest over the particles, and of the energy (J) are
//! measured as the largest over the sample times, and at the end. The units assume a scene in SI units. A submission
//! is measured from its traces alone.

mod program;
mod store;

pub mod cheapest;
pub mod confirm;
pub mod ladder;
pub mod measure;
pub mod order;
pub mod problem;
pub mod reference;

use scene::{Scene, write};
use serde::{Deserialize, Serialize};

pub use ::reference::closed::Closed;
pub use store::{Store, file_name};

use grader::submission::program::Program;
use ladder::Method;
use order::{Exception, Expected, Fit};
use problem::Problem;
use reference::Reference;

use crate::store::bits;

/// A measured quantity of a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Positions.
    Position,
    /// Velocities.
    Velocity,
    /// The energy.
    Energy,
}

impl Quantity {
    /// All quantities, in the order of reports.
    pub const ALL: [Self; 3] = [Self::Position, Self::Velocity, Self::Energy];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Position => "position",
            Self::Velocity => "velocity",
            Self::Energy => "energy",
        }
    }

    /// Its unit, for a scene in metres, kilograms and seconds.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Position => "m",
            Self::Velocity => "m/s",
            Self::Energy => "J",
        }
    }
}

/// A number for each quantity.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Of positions.
    #[serde(with = "bits")]
    pub position: f64,
    /// Of velocities.
    #[serde(with = "bits")]
    pub velocity: f64,
    /// Of the energy.
    #[serde(with = "bits")]
    pub energy: f64,
}

impl Errors {
    /// The number of a quantity.
    pub fn of(self, quantity: Quantity) -> f64 {
        match quantity {
            Quantity::Position => self.position,
            Quantity::Velocity => self.velocity,
            Quantity::Energy => self.energy,
        }
    }

    fn max(self, other: Self) -> Self {
        Self {
            position: self.position.max(other.position),
            velocity: self.velocity.max(other.velocity),
            energy: self.energy.max(other.energy),
        }
    }
}

/// Outcome of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum RunOutcome {
    /// Finished, with position errors of at most [`BLOWN_UP`](measure::BLOWN_UP) times the size of the motion.
    Finished {
        /// Errors at the end.
        end: Errors,
        /// The largest errors.
        largest: Errors,
    },
    /// Finished with finite numbers, but larger position errors.
    BlownUp {
        /// The largest errors.
        largest: Errors,
    },
    /// A step failed, or the states are invalid.
    Failed {
        /// The step, from 1; 0 if there is no state at all.
        step: u64,
        /// Start time of the step, in seconds.
        #[serde(with = "bits")]
        time: f64,
        /// Why.
        reason: String,
    },
}

/// Times of runs, in seconds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// The least.
    #[serde(with = "bits")]
    pub least: f64,
    /// The median.
    #[serde(with = "bits")]
    pub median: f64,
    /// The largest.
    #[serde(with = "bits")]
    pub largest: f64,
    /// Number of timed runs.
    pub repeats: u32,
}

/// Work of a run of the built-in simulator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Work {
    /// Evaluations of the sum of all forces.
    pub force_evaluations: u64,
    /// Matrices factorised.
    pub factorisations: u64,
    /// Newton iterations, and rounds of local and global steps.
    pub iterations: u64,
}

/// Cost of a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Time.
    pub time: Option<Timing>,
    /// Work; `None` for a program.
    pub work: Option<Work>,
}

/// A method at one time step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Time step, in seconds.
    #[serde(with = "bits")]
    pub time_step: f64,
    /// Total number of steps.
    pub steps: u64,
    /// Errors, or the reason for their absence.
    pub outcome: RunOutcome,
    /// Cost.
    pub cost: Cost,
}

/// A method on a scene, from the coarsest time step to the finest.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// The method.
    pub method: Method,
    /// Whether the curve is of the submission.
    pub foreign: bool,
    /// The points, from coarse to fine.
    pub points: Vec<Point>,
}

impl Curve {
    /// Its name in reports.
    pub fn label(&self) -> String {
        let whose = if self.foreign { "theirs: " } else { "" };
        format!("{whose}{}", self.method.label())
    }

    /// Whether there are any states: a program need not offer every method.
    pub fn is_offered(&self) -> bool {
        self.points.iter().any(|point| !matches!(point.outcome, RunOutcome::Failed { step: 0, .. }))
    }
}

/// The order of a curve, for one quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Order {
    /// Which error.
    pub quantity: Quantity,
    /// The fit.
    pub fit: Fit,
    /// The prediction of theory; `None` if there is none.
    pub expected: Option<Expected>,
    /// Why the prediction differs from the method's usual order.
    pub reason: Option<&'static str>,
}

impl Order {
    /// Whether fit and prediction agree; `None` if there is no prediction or nothing could be fitted.
    pub fn agrees(&self) -> Option<bool> {
        self.expected.and_then(|expected| order::agrees(self.fit, expected))
    }
}

/// A scene to measure.
pub struct Target {
    /// Its name.
    pub name: String,
    /// Short description of the motion.
    pub title: String,
    /// The scene; its time step is the coarsest of the ladder.
    pub scene: Scene,
    /// Number of steps of the scene with its own time step.
    pub steps: u64,
    /// The closed form of its motion, if known.
    pub closed: Option<Closed>,
    /// Exceptions from the usual orders; `None` if it is unknown whether the motion is smooth.
    pub exceptions: Option<&'static [Exception]>,
}

impl Target {
    /// A problem of the registry.
    pub fn of_problem(problem: &'static Problem) -> Self {
        let scene = problem.scene();
        Self {
            name: problem.name.to_owned(),
            title: problem.title.to_owned(),
            closed: problem.closed.map(|closed| closed(&scene)),
            steps: scene.n_steps(),
            scene: ladder::coarsest(scene),
            exceptions: Some(problem.exceptions),
        }
    }

    /// Any scene: the reference is adaptive, and orders are shown but not judged.
    pub fn of_scene(name: &str, scene: Scene) -> Self {
        let title = "a scene as it is".to_owned();
        Self {
            name: name.to_owned(),
            title,
            steps: scene.n_steps(),
            scene: ladder::coarsest(scene),
            closed: None,
            exceptions: None,
        }
    }

    /// Prediction of theory for a curve's error.
    fn expected(
        &self,
        method: &Method,
        quantity: Quantity,
    ) -> (Option<Expected>, Option<&'static str>) {
        let (Some(exceptions), Some(order)) = (self.exceptions, method.order) else {
            return (None, None);
        };
        let applies = |exception: &&Exception| {
            let named = exception.integrators;
            exception.quantity == quantity
                && (named.is_empty() || named.contains(&method.integrator.name))
        };
        match exceptions.iter().find(applies) {
            Some(exception) => (Some(exception.expected), Some(exception.reason)),
            None => (Some(Expected::Order(order)), None),
        }
    }
}

/// Extent of the study.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AccuracyConfig {
    /// Maximum number of time steps in the ladder, each half of the one before.
    pub rungs: u32,
    /// Maximum number of timed runs per point.
    pub repeats: u32,
    /// Time limit per point after which no further run starts, in seconds.
    pub budget: f64,
    /// Maximum number of steps of a run.
    pub max_steps: u64,
}

impl AccuracyConfig {
    /// All scenes in half a minute.
    pub const QUICK: Self = Self { rungs: u32::MAX, repeats: 3, budget: 0.02, max_steps: 1 << 13 };

    /// Enough time steps and repeats to resolve small errors.
    pub const FULL: Self = Self { rungs: u32::MAX, repeats: 9, budget: 0.5, max_steps: 1 << 16 };

    /// Number of parts of each coarsest step, from coarse to fine, for a scene of `own` steps.
    pub fn refinements(self, own: u64) -> impl Iterator<Item = u64> {
        // A slope needs several points where the scene is stable: a scene with very many steps gets them below its own.
        let finest = own.saturating_mul(1 << (order::FEWEST - 1)).max(self.max_steps);
        let all = (0..self.rungs.min(40)).map(|rung| 1 << rung);
        all.take_while(move |refinement| ladder::STEPS.saturating_mul(*refinement) <= finest)
    }
}

/// A measured scene.
pub struct SceneStudy {
    /// The scene.
    pub target: Target,
    /// The reference for errors.
    pub reference: Reference,
    /// One curve per method.
    pub curves: Vec<Curve>,
}

impl SceneStudy {
    /// Bound of the rounding error of a point, if its method were exact.
    fn rounding(&self, curve: &Curve, point: &Point) -> Errors {
        self.reference.rounding(point.steps, curve.method.integrator.family)
    }

    /// The orders of a curve.
    pub fn orders(&self, curve: &Curve) -> [Order; 3] {
        Quantity::ALL.map(|quantity| {
            let sample = |point: &Point| match point.outcome {
                RunOutcome::Finished { largest, .. } => Some(order::ErrorSample {
                    time_step: point.time_step,
                    error: largest.of(quantity),
                    floor: self.reference.floor.of(quantity),
                    rounding: self.rounding(curve, point).of(quantity),
                }),
                _ => None,
            };
            let samples: Vec<order::ErrorSample> = curve.points.iter().filter_map(sample).collect();
            let (expected, reason) = self.target.expected(&curve.method, quantity);
            Order { quantity, fit: order::fit(&samples), expected, reason }
        })
    }

    /// The cheapest methods for each power of ten of the position's error, of the built-in simulator or the submission.
    pub fn levels(&self, foreign: bool) -> Vec<cheapest::Level> {
        let curves: Vec<(usize, &Curve)> =
            self.curves.iter().enumerate().filter(|(_, curve)| curve.foreign == foreign).collect();
        cheapest::levels(&curves, self.reference.floor.position)
    }
}

/// Results of an accuracy study.
pub struct Study {
    /// The submission measured in addition to the built-in simulator.
    pub submission: Option<String>,
    /// Extent of the study.
    pub config: AccuracyConfig,
    /// The scenes, in order.
    pub scenes: Vec<SceneStudy>,
}

/// Why a study failed.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what the variants and their fields are")]
pub enum AccuracyError {
    #[error("{scene}: {reason}\n  help: measure a shorter or softer scene")]
    NoReference { scene: String, reason: String },
    #[error("cannot store the results: {0}")]
    Store(#[from] std::io::Error),
}

/// Measures every method on every scene, sequentially, so that runs do not disturb each other's times. Calls `progress`
/// with the next scene and method, the number of finished ones, and the total.
///
/// # Errors
/// If a scene has no reference, or results cannot be stored.
pub fn study(
    targets: Vec<Target>,
    submission: Option<&Program>,
    config: AccuracyConfig,
    store: Option<&Store>,
    progress: &mut dyn FnMut(&str, usize, usize),
) -> Result<Study, AccuracyError> {
    let plans: Vec<Vec<(Method, bool)>> =
        targets.iter().map(|target| plan(&target.scene, submission)).collect();
    let total = plans.iter().map(Vec::len).sum();
    let mut done = 0;
    let mut scenes = Vec::new();
    for (target, plan) in targets.into_iter().zip(plans) {
        progress(&format!("{}: reference", target.name), done, total);
        let reference = Reference::new(&target.scene, target.closed.as_ref())
            .map_err(|reason| AccuracyError::NoReference { scene: target.name.clone(), reason })?;
        let mut curves = Vec::new();
        for (method, foreign) in plan {
            let mut curve = Curve { method, foreign, points: Vec::new() };
            progress(&format!("{}: {}", target.name, curve.label()), done, total);
            fill(&mut curve, &target, &reference, Measuring { submission, config, store })?;
            curves.push(curve);
            done += 1;
        }
        scenes.push(SceneStudy { target, reference, curves });
    }
    progress("", done, total);
    Ok(Study { submission: submission.map(|submission| submission.name().line()), config, scenes })
}

/// The methods of a scene: those of the built-in simulator, then those that a program may offer.
fn plan(scene: &Scene, submission: Option<&Program>) -> Vec<(Method, bool)> {
    let ours = ladder::methods(scene);
    // Only the built-in simulator has these options; a program offers the methods of the course.
    let theirs = ours.iter().filter(|method| method.setting.is_none() && submission.is_some());
    let theirs: Vec<(Method, bool)> = theirs.cloned().map(|method| (method, true)).collect();
    ours.into_iter().map(|method| (method, false)).chain(theirs).collect()
}

/// Options of the study: a submission to measure, the extent, and the store of results.
#[derive(Clone, Copy)]
struct Measuring<'a> {
    submission: Option<&'a Program>,
    config: AccuracyConfig,
    store: Option<&'a Store>,
}

/// Measures the points of a curve, or finds them in the store.
fn fill(
    curve: &mut Curve,
    target: &Target,
    reference: &Reference,
    measuring: Measuring<'_>,
) -> Result<(), AccuracyError> {
    let Measuring { submission, config, store } = measuring;
    let kept = store.map(|store| {
        let mut scene = Vec::new();
        // A parsed scene can always be written.
        let _ = write::write(&target.scene, &mut scene);
        let scene = String::from_utf8_lossy(&scene);
        let label = curve.label();
        (store, store.key(&[&scene, &label, &format!("{config:?} {}", target.steps)]), label)
    });
    if let Some((store, key, label)) = &kept
        && let Some(points) = store.load(&target.name, label, key)
    {
        curve.points = points;
        return Ok(());
    }
    let mut spelling = None;
    for refinement in config.refinements(target.steps) {
        let scene = curve.method.scene(&target.scene, refinement);
        let point = match (curve.foreign, submission) {
            (true, Some(program)) => {
                let method = &curve.method;
                let spelt = match spelling {
                    Some(spelling) => Ok(spelling),
                    None => program::spelling(program, method, target, reference),
                };
                match spelt {
                    Ok(spelt) => {
                        spelling = Some(spelt);
                        program::measure(
                            program,
                            spelt,
                            program::Rung { scene: &scene, reference, refinement },
                            config,
                        )
                    }
                    Err(outcome) => {
                        curve.points.push(Point {
                            time_step: scene.time_step,
                            steps: scene.n_steps(),
                            outcome,
                            cost: Cost { time: None, work: None },
                        });
                        break;
                    }
                }
            }
            _ => measure::built_in(&scene, reference, refinement, config),
        };
        curve.points.push(point);
        if is_rounding(curve, reference) {
            break;
        }
    }
    if let Some((store, key, label)) = &kept {
        store.save(&target.name, label, key, &curve.points)?;
    }
    Ok(())
}

/// Whether shorter steps only show rounding: the last two points have no larger error, and there are enough for a slope.
fn is_rounding(curve: &Curve, reference: &Reference) -> bool {
    let is_exact = |point: &Point| match point.outcome {
        RunOutcome::Finished { largest, .. } => {
            let rounding = reference.rounding(point.steps, curve.method.integrator.family);
            Quantity::ALL.into_iter().all(|quantity| {
                largest.of(quantity) <= reference.floor.of(quantity) + rounding.of(quantity)
            })
        }
        _ => false,
    };
    let last = curve.points.iter().rev().take(2);
    curve.points.len() >= order::FEWEST && last.filter(|point| is_exact(point)).count() == 2
}
