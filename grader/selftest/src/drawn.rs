//! Programs drawn by a seed: unfinished ones, with none to three mistakes, whole or as partial folders of traces.
//!
//! ```text
//! level      what is there: milestones 1 to 3, extra credit, everything; the rest is refused or silently left out
//! mistakes   none to three, of what is there; one in ten thresholds, other formulas and stray indices
//! delivery   a program; traces alone; a part of the traces; traces of few digits
//! ```
//!
//! Each is drawn with its labels (the features that are wrong, those that are not there) before it is graded. A mistake
//! that does not change the traces, or that another one hides, is left out. Then every
//! finding of the grader is held against them.

use std::collections::BTreeMap;
use std::time::Instant;

use diagnosis::findings::{Family, Feature, FindingKind, Part, Thresholds};
use fastrand::Rng;
use grader::compare::Criteria;
use grader::grading::{self, Grading};
use grader::oracle::Oracle;
use grader::rubric::Rubric;
use grader::submission::StateSource;
use grader::suite::{Case, NoTrace, Suite};
use grader::verdict::{Failure, LastOutput, RunEnd, RunFailure, Verdict};
use rayon::prelude::*;
use scene::Scene;
use scene::trace::State;

use crate::mistake::{self, Mistake};
use crate::student::{Run, Student};

/// Minimum number of delivered scenes on which a drawn mistake can have an effect.
const MATTERS: usize = 3;

/// Properties of a drawn program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Level {
    name: &'static str,
    forces: &'static [&'static str],
    integrators: &'static [&'static str],
}

const FREE: &[&str] = &["simplegravity"];
const SECOND: &[&str] = &["simplegravity", "springforce", "gravitationalforce", "dragdamping"];
const THIRD: &[&str] = SECOND;
const EXTRA: &[&str] =
    &["simplegravity", "springforce", "gravitationalforce", "dragdamping", "vortexforce"];
const EXPLICIT: &[&str] = &["explicit-euler"];
const BOTH: &[&str] = &["explicit-euler", "symplectic-euler"];
const LINEARIZED: &[&str] = &["explicit-euler", "symplectic-euler", "linearized-implicit-euler"];

const LEVELS: [Level; 5] = [
    Level { name: "milestone 1", forces: FREE, integrators: EXPLICIT },
    Level { name: "milestone 2", forces: SECOND, integrators: BOTH },
    Level { name: "milestone 3", forces: THIRD, integrators: LINEARIZED },
    Level { name: "extra credit", forces: EXTRA, integrators: &[] },
    Level { name: "everything", forces: &[], integrators: &[] },
];

/// How a program is handed in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Delivery {
    /// A program.
    Program,
    /// Traces of all scenes that it simulates.
    Traces,
    /// A part of the traces: a percentage.
    Part(u8),
    /// Traces of this many digits.
    Digits(u8),
}

impl Delivery {
    /// Whether numbers have all their digits.
    pub fn is_exact(self) -> bool {
        !matches!(self, Self::Digits(_))
    }

    /// The name of its kind.
    pub fn name(self) -> &'static str {
        match self {
            Self::Program => "program",
            Self::Traces => "traces",
            Self::Part(_) => "partial folder",
            Self::Digits(_) => "rounded digits",
        }
    }
}

/// A drawn program.
struct Drawn<'a> {
    level: Level,
    silent: bool,
    delivery: Delivery,
    mistakes: Vec<&'a Mistake>,
    seed: u64,
}

/// A drawn program with what the grader said.
#[derive(Debug, Clone)]
pub struct Result {
    /// Its number.
    pub number: u64,
    /// Level, delivery and mistakes in words.
    pub description: String,
    /// How it was handed in.
    pub delivery: Delivery,
    /// The features that are wrong.
    pub wrong: Vec<Feature>,
    /// Whether a scene failed that lacks nothing.
    pub caught: bool,
    /// Findings that name nothing that is wrong or not there.
    pub false_findings: Vec<String>,
    /// For each mistake, whether its feature is among the findings.
    pub named: Vec<bool>,
    /// For each mistake, whether its cause is proven.
    pub proven: Vec<bool>,
    /// Whether the first finding on mistakes names one.
    pub first: bool,
    /// All findings.
    pub findings: Vec<String>,
}

impl Level {
    fn lacks_force(self, tag: &str) -> bool {
        !self.forces.is_empty() && !self.forces.contains(&tag)
    }

    fn lacks_integrator(self, name: &str) -> bool {
        !self.integrators.is_empty() && !self.integrators.contains(&name)
    }

    /// The first name in a scene that the program lacks.
    fn lacks(self, scene: &Scene) -> Option<&str> {
        let integrator = scene.integrator.name;
        let tags = scene.forces.iter().map(|element| element.schema.tag);
        let force = tags.into_iter().find(|tag| self.lacks_force(tag));
        if self.lacks_integrator(integrator) { Some(integrator) } else { force }
    }

    /// The scene as a program sees it that leaves out what it lacks, and steps by explicit Euler in place of methods it
    /// lacks.
    fn seen(self, scene: &Scene) -> Scene {
        let mut seen = scene.clone();
        seen.forces.retain(|element| !self.lacks_force(element.schema.tag));
        if self.lacks_integrator(scene.integrator.name) {
            let vocabulary = simulator::vocabulary();
            if let Some(explicit) = vocabulary.integrator("explicit-euler") {
                seen.integrator = explicit;
            }
        }
        seen
    }
}

/// States written with few digits.
struct Rounded {
    run: Run,
    digits: u8,
}

impl StateSource for Rounded {
    fn read(&mut self, state: &mut State) -> std::result::Result<bool, Failure> {
        let is_state = self.run.read(state)?;
        let digits = usize::from(self.digits) - 1;
        for value in state.positions.iter_mut().chain(&mut state.velocities) {
            *value = format!("{value:.digits$e}").parse().unwrap_or(*value);
        }
        Ok(is_state)
    }
}

impl<'a> Drawn<'a> {
    fn draw(suite: &Suite, own: &'a [Mistake], foreign: &'a [Mistake], seed: u64) -> Self {
        let mut random = Rng::with_seed(seed);
        let level = LEVELS[random.usize(0..LEVELS.len())];
        let silent = random.bool();
        let delivery = match random.u8(0..8) {
            0..=3 => Delivery::Program,
            4 => Delivery::Traces,
            5..=6 => Delivery::Part(random.u8(30..90)),
            _ => Delivery::Digits(random.u8(7..15)),
        };
        let mut drawn = Self { level, silent, delivery, mistakes: Vec::new(), seed };
        let wanted = random.usize(0..4);
        for _ in 0..200 {
            if drawn.mistakes.len() == wanted {
                break;
            }
            let list = if random.u8(0..10) == 0 { foreign } else { own };
            let mistake = &list[random.usize(0..list.len())];
            let is_new = drawn.mistakes.iter().all(|known| known.feature() != mistake.feature());
            let misread = |mistake: &Mistake| mistake.student().misreads();
            let clashes = misread(mistake) && drawn.mistakes.iter().any(|known| misread(known));
            let matters = |case: &&Case| {
                let scene = &case.scene;
                drawn.delivers(case) && level.lacks(scene).is_none() && mistake.can_matter_on(scene)
            };
            if is_new && !clashes && suite.cases.iter().filter(matters).count() >= MATTERS {
                drawn.mistakes.push(mistake);
            }
        }
        // A mistake that another one hides is none.
        let all = drawn.mistakes.clone();
        let traces = |mistakes: &[&Mistake]| -> Vec<Vec<State>> {
            let mut student = Student::faultless();
            mistakes.iter().for_each(|mistake| mistake.plant(&mut student));
            let delivered = suite.cases.iter().filter(|case| drawn.delivers(case));
            let offered = delivered.filter(|case| level.lacks(&case.scene).is_none());
            offered.map(|case| first_states(&student, &case.scene)).collect()
        };
        let whole = traces(&all);
        let shows = |mistake: &&&Mistake| {
            let others: Vec<&Mistake> =
                all.iter().copied().filter(|other| !std::ptr::eq(*other, **mistake)).collect();
            let rest = traces(&others);
            whole.iter().zip(&rest).filter(|(a, b)| differs(a, b)).count() >= MATTERS
        };
        let right = traces(&[]);
        let n_wrong = whole.iter().zip(&right).filter(|(a, b)| differs(a, b)).count();
        let mut shown: Vec<&Mistake> = all.iter().filter(shows).copied().collect();
        if n_wrong < MATTERS {
            shown.clear();
        }
        drawn.mistakes = shown;
        drawn
    }

    /// Whether a scene's trace is handed in.
    fn delivers(&self, case: &Case) -> bool {
        let Delivery::Part(percent) = self.delivery else { return true };
        let hash = case
            .id
            .bytes()
            .fold(self.seed, |sum, byte| (sum ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
        Rng::with_seed(hash).u8(0..100) < percent
    }

    fn student(&self) -> Student {
        let mut student = Student::faultless();
        self.mistakes.iter().for_each(|mistake| mistake.plant(&mut student));
        student
    }

    fn states(
        &self,
        student: &Student,
        case: &Case,
    ) -> std::result::Result<Box<dyn StateSource>, Verdict> {
        let missing = || {
            let missing = NoTrace::Missing { stem: (&case.id).into(), other_case: None };
            Err(Verdict::Fail(Failure::NoTrace(missing)))
        };
        if !self.delivers(case) {
            return missing();
        }
        if let Some(name) = self.level.lacks(&case.scene).filter(|_| !self.silent) {
            if self.delivery != Delivery::Program {
                return missing();
            }
            let text = format!("unknown {name}").into();
            let output = LastOutput { text, misses_file: false };
            let refused = RunFailure { end: RunEnd::Exited(1), output };
            return Err(Verdict::Fail(refused.into()));
        }
        let run = student.simulate(&self.level.seen(&case.scene));
        Ok(match self.delivery {
            Delivery::Digits(digits) => Box::new(Rounded { run, digits }),
            _ => Box::new(run),
        })
    }

    fn grade(&self, inputs: Inputs<'_>, limits: &Thresholds) -> Grading {
        let Inputs { suite, oracle, rubric } = inputs;
        let student = self.student();
        let judge = |case: &Case, criteria: Criteria| {
            grading::judge(case, oracle, criteria, || self.states(&student, case))
        };
        grading::collect_within(limits, suite, String::new(), oracle, rubric, judge)
    }

    fn describe(&self) -> String {
        let mistakes = self.mistakes.iter().map(|m| format!("{}: {}", m.subject, m.description));
        let mistakes: Vec<String> = mistakes.collect();
        let lacking = if self.silent { "silent" } else { "refusing" };
        let delivery = match self.delivery {
            Delivery::Part(percent) => format!("{percent} % of the traces"),
            Delivery::Digits(digits) => format!("{digits} digits"),
            other => other.name().to_owned(),
        };
        format!("{} ({lacking}), {delivery}; {}", self.level.name, mistakes.join("; "))
    }

    /// Whether a finding on this feature is true: it is wrong, or not there.
    fn is_true(&self, feature: Feature) -> bool {
        let lacking = match feature {
            Feature::Force(part) => self.level.lacks_force(part.tag()),
            Feature::Integrator(name) => self.level.lacks_integrator(name),
            Feature::Precision => matches!(self.delivery, Delivery::Digits(_)),
            _ => false,
        };
        lacking || self.mistakes.iter().any(|mistake| is_it(mistake.feature(), feature))
    }

    fn held_against(&self, number: u64, suite: &Suite, grading: &Grading) -> Result {
        let list = &grading.findings.list;
        let lacks: BTreeMap<&str, bool> = suite
            .cases
            .iter()
            .map(|case| (case.id.as_str(), self.level.lacks(&case.scene).is_some()))
            .collect();
        let scenes = grading.features.iter().flat_map(|feature| &feature.scenes);
        let caught = scenes.filter(|scene| {
            let missing = matches!(scene.comparison.verdict, Verdict::Fail(Failure::NoTrace(_)));
            !scene.comparison.verdict.is_pass() && !missing && !lacks[scene.id.as_str()]
        });
        let is_false =
            |features: &[Feature]| !features.iter().any(|feature| self.is_true(*feature));
        // Properties that failing scenes share are counts, and blame nothing.
        let blaming = list.iter().filter(|finding| finding.kind != FindingKind::Common);
        let false_findings = blaming.filter(|finding| is_false(&finding.features));
        let named = |mistake: &&Mistake, proven: bool| {
            list.iter().any(|finding| {
                let names = |feature: &Feature| is_it(mistake.feature(), *feature);
                finding.features.iter().any(names) && (finding.is_proven() || !proven)
            })
        };
        let on_mistakes = list.iter().find(|finding| {
            !matches!(finding.kind, FindingKind::Output)
                && !finding.features.iter().all(|feature| {
                    let mistakes = self.mistakes.iter();
                    self.is_true(*feature)
                        && mistakes.clone().all(|mistake| !is_it(mistake.feature(), *feature))
                })
        });
        Result {
            number,
            description: self.describe(),
            delivery: self.delivery,
            wrong: self.mistakes.iter().map(|mistake| mistake.feature()).collect(),
            caught: caught.count() > 0,
            false_findings: false_findings.map(|finding| finding.sentence()).collect(),
            named: self.mistakes.iter().map(|mistake| named(mistake, false)).collect(),
            proven: self.mistakes.iter().map(|mistake| named(mistake, true)).collect(),
            first: on_mistakes.is_some_and(|finding| !is_false(&finding.features)),
            findings: list.iter().map(ToString::to_string).collect(),
        }
    }
}

/// The first states of a trace: enough to see whether a mistake shows.
fn first_states(student: &Student, scene: &Scene) -> Vec<State> {
    const STEPS: usize = 12;
    let mut run = student.simulate(scene);
    let mut states = Vec::new();
    let mut state = State::zeros(scene::trace::Shape::of(scene));
    while states.len() <= STEPS && matches!(run.read(&mut state), Ok(true)) {
        states.push(state.clone());
    }
    states
}

/// Whether two traces differ by more than a millionth.
fn differs(a: &[State], b: &[State]) -> bool {
    let values = |states: &[State]| -> Vec<f64> {
        states.iter().flat_map(|s| [s.positions.clone(), s.velocities.clone()].concat()).collect()
    };
    let near = |(a, b): (f64, f64)| (a - b).abs() <= 1e-6 * a.abs().max(b.abs()).max(1e-3);
    !values(a).into_iter().zip(values(b)).all(near)
}

/// Whether the finding on `named` is that of a mistake in `planted`: fixed particles count under any methods.
fn is_it(planted: Feature, named: Feature) -> bool {
    match (planted, named) {
        (Feature::Fixed(a), Feature::Fixed(b)) => a == b || a == Family::Any || b == Family::Any,
        // A whole force is each of its parts.
        (Feature::Force(Part::One(a, _)), Feature::Force(Part::All(b))) => a == b,
        // Where one force alone uses them.
        (Feature::Helpers, Feature::Force(_)) => true,
        (a, b) => a == b,
    }
}

/// Which programs are drawn.
#[derive(Debug, Clone, Copy)]
pub struct Plan {
    /// The number of the first one.
    pub first: u64,
    /// How many.
    pub count: u64,
    /// The seed of all.
    pub seed: u64,
}

/// Scenes, traces and rubric by which programs are graded.
#[derive(Clone, Copy)]
pub struct Inputs<'a> {
    /// Scenes that the student supports, and no others.
    pub suite: &'a Suite,
    /// Their traces.
    pub oracle: &'a Oracle,
    /// Tolerances and points.
    pub rubric: &'a Rubric,
}

/// Draws and grades programs; causes are looked for within these limits.
pub fn run(inputs: Inputs<'_>, plan: Plan, limits: &Thresholds) -> Vec<Result> {
    let own = mistake::possible(inputs.suite, mistake::all());
    let foreign = mistake::foreign();
    let one = |number: u64| {
        let seed = plan.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(number);
        let drawn = Drawn::draw(inputs.suite, &own, &foreign, seed);
        let grading = drawn.grade(inputs, limits);
        drawn.held_against(number, inputs.suite, &grading)
    };
    (plan.first..plan.first + plan.count).into_par_iter().map(one).collect()
}

/// The drawn programs, graded with one number of the search moved.
pub struct Moved {
    /// The number; `None` where all are as they are.
    pub number: Option<&'static str>,
    /// Its value.
    pub value: f64,
    /// The programs.
    pub results: Vec<Result>,
    /// Seconds that drawing and grading took, on all processors.
    pub seconds: f64,
}

/// Grades the same drawn programs as they are, and with each number of the search divided and multiplied by 4.
pub fn moved(inputs: Inputs<'_>, plan: Plan) -> Vec<Moved> {
    let default = Thresholds::default();
    let mut all = vec![(None, f64::NAN, default)];
    for &number in Thresholds::ALL {
        let moved = [0.25, 4.0].map(|factor| default.moved(number, factor));
        all.extend(moved.map(|limits| (Some(number), limits.number(number), limits)));
    }
    let graded = |(number, value, limits): (Option<&'static str>, f64, Thresholds)| {
        let start = Instant::now();
        let results = run(inputs, plan, &limits);
        Moved { number, value, results, seconds: start.elapsed().as_secs_f64() }
    };
    all.into_iter().map(graded).collect()
}
