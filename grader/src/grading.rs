//! A submission graded over a suite: scenes in parallel, results in the suite's order.

use std::any::Any;
use std::collections::HashSet;
use std::panic::{AssertUnwindSafe, catch_unwind};

use rayon::prelude::*;
use simulator::trace::{self, Shape};

use crate::compare::{Comparison, Expectation, Tolerances, compare};
use crate::jacobian::JacobianReport;
use crate::oracle::Oracle;
use crate::probe::{self, Probing};
use crate::rubric::Rubric;
use crate::sandbox::Protection;
use crate::submission::program::Program;
use crate::submission::{StateSource, Submission};
use crate::suite::{Case, Feature, Section, Suite};
use crate::verdict::{Fault, Verdict};

/// The most scenes that are run twice.
const REPEATED: usize = 8;

/// Everything a report says.
#[derive(Debug, Clone, PartialEq)]
pub struct Grading {
    /// What the submission is called.
    pub submission: String,
    /// Features in the order of the report: by section, group, integrator.
    pub features: Vec<FeatureResult>,
    /// How its programs were run; `None` where it has none.
    pub protection: Option<Vec<Protection>>,
    /// Whether its programs do the same twice; `None` where it has none.
    pub repetition: Option<Repetition>,
    /// Forces and Jacobians of its program, measured from single steps; `None` where they were not.
    pub probing: Option<Probing>,
    /// Jacobian checks; empty where the submission is not the built-in simulator.
    pub jacobians: JacobianReport,
}

/// Some scenes, each run twice more.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Repetition {
    /// How many were run twice.
    pub scenes: usize,
    /// The names of those whose two traces were not the same bytes.
    pub differing: Vec<String>,
}

impl Repetition {
    /// Runs the first scene of each feature twice, as long as it leaves a trace at all.
    fn of(suite: &Suite, program: &Program) -> Self {
        let mut features = HashSet::new();
        let first_ones = suite.cases.iter().filter(|case| features.insert(&case.feature));
        let cases: Vec<&Case> = first_ones.take(REPEATED).collect();
        let same = |case: &&Case| {
            let [first, second] = [(); 2].map(|()| program.trace_hash(case));
            Some((case.id.clone(), first.ok()? == second.ok()?))
        };
        let results: Vec<(String, bool)> = cases.par_iter().filter_map(same).collect();
        let differing = results.iter().filter(|(_, same)| !same).map(|(id, _)| id.clone());
        Self { scenes: results.len(), differing: differing.collect() }
    }
}

/// A feature with its scenes.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureResult {
    /// The feature.
    pub feature: Feature,
    /// Points it may earn.
    pub points: f64,
    /// Its scenes, by name.
    pub scenes: Vec<SceneResult>,
}

/// A scene with its verdict.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneResult {
    /// The scene's name.
    pub id: String,
    /// The scene's path, as given.
    pub path: String,
    /// The tolerances it was judged by.
    pub tolerances: Tolerances,
    /// How its trace compares.
    pub comparison: Comparison,
}

impl FeatureResult {
    /// Scenes that passed.
    pub fn n_passed(&self) -> usize {
        self.scenes.iter().filter(|scene| scene.comparison.verdict.is_pass()).count()
    }

    /// Scenes that could not be judged.
    pub fn n_faults(&self) -> usize {
        let is_fault =
            |scene: &&SceneResult| matches!(scene.comparison.verdict, Verdict::GraderFault(_));
        self.scenes.iter().filter(is_fault).count()
    }

    /// Points earned: in proportion to the judged scenes that passed. A scene that could not be judged
    /// costs nothing.
    pub fn points_earned(&self) -> f64 {
        let judged = self.scenes.len() - self.n_faults();
        if judged == 0 { self.points } else { self.points * self.n_passed() as f64 / judged as f64 }
    }

    /// The largest position and velocity residual of its scenes; `None` where none was compared.
    pub fn largest_residuals(&self) -> Option<(f64, f64)> {
        let comparisons = self.scenes.iter().map(|scene| &scene.comparison);
        let residuals = comparisons
            .filter(|comparison| comparison.is_compared())
            .map(|Comparison { position, velocity, .. }| (position.largest, velocity.largest));
        residuals.reduce(|(p, v), (position, velocity)| (p.max(position), v.max(velocity)))
    }
}

/// Sums over the features of a section.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Totals {
    /// Scenes.
    pub scenes: usize,
    /// Scenes that passed.
    pub passed: usize,
    /// Scenes that could not be judged.
    pub faults: usize,
    /// Features.
    pub features: usize,
    /// Features of which every scene passed.
    pub features_passed: usize,
    /// Points that may be earned.
    pub points: f64,
    /// Points earned.
    pub points_earned: f64,
}

/// What a grading comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Everything passed.
    Passed,
    /// Something failed.
    Failed,
    /// Something could not be judged.
    GraderFault,
}

impl Grading {
    /// Sums over the features of `section`.
    pub fn totals(&self, section: Section) -> Totals {
        let mut totals = Totals::default();
        for result in self.features.iter().filter(|result| result.feature.section == section) {
            totals.scenes += result.scenes.len();
            totals.passed += result.n_passed();
            totals.faults += result.n_faults();
            totals.features += 1;
            totals.features_passed += usize::from(result.n_passed() == result.scenes.len());
            totals.points += result.points;
            totals.points_earned += result.points_earned();
        }
        totals
    }

    /// What it comes to: a fault of the grader outweighs a failure.
    pub fn outcome(&self) -> Outcome {
        let totals = Section::ALL.map(|section| self.totals(section));
        if totals.iter().any(|totals| totals.faults > 0) {
            Outcome::GraderFault
        } else if totals.iter().any(|totals| totals.passed < totals.scenes)
            || !self.jacobians.is_pass()
            || self
                .probing
                .as_ref()
                .is_some_and(|probing| probing.verdict() == probe::Verdict::Wrong)
        {
            Outcome::Failed
        } else {
            Outcome::Passed
        }
    }
}

/// Grades `submission` on every scene of the suite.
pub fn grade(
    suite: &Suite,
    submission: &Submission,
    oracle: &Oracle,
    rubric: &Rubric,
    jacobians: JacobianReport,
) -> Grading {
    let judge = |case: &Case| {
        let tolerances = rubric.tolerances(case);
        SceneResult {
            id: case.id.clone(),
            path: case.scene.name.clone(),
            tolerances,
            comparison: judge(case, oracle, tolerances, || submission.states(case)),
        }
    };
    let results: Vec<SceneResult> = suite.cases.par_iter().map(judge).collect();

    let mut features: Vec<FeatureResult> = Vec::new();
    for (case, result) in suite.cases.iter().zip(results) {
        match features.iter_mut().find(|known| known.feature == case.feature) {
            Some(known) => known.scenes.push(result),
            None => features.push(FeatureResult {
                points: rubric.points(&case.feature),
                feature: case.feature.clone(),
                scenes: vec![result],
            }),
        }
    }
    features.sort_by(|a, b| a.feature.cmp(&b.feature));
    let repetition = match submission {
        Submission::Program(program) => Some(Repetition::of(suite, program)),
        _ => None,
    };
    Grading {
        submission: submission.name(),
        features,
        protection: None,
        repetition,
        probing: None,
        jacobians,
    }
}

/// Judges the states that `start` yields for a scene. A panic, here or there, costs this scene alone.
fn judge(
    case: &Case,
    oracle: &Oracle,
    tolerances: Tolerances,
    start: impl FnOnce() -> Result<Box<dyn StateSource>, Verdict>,
) -> Comparison {
    // What a panic leaves half done is dropped with it.
    let judged = catch_unwind(AssertUnwindSafe(|| {
        let expectation = Expectation::of(&case.scene);
        let mut expected = match open_oracle(case, oracle, expectation.shape) {
            Ok(expected) => expected,
            Err(fault) => return Comparison::without_states(Verdict::GraderFault(fault)),
        };
        match start() {
            Ok(mut actual) => compare(expected.as_mut(), actual.as_mut(), expectation, tolerances),
            Err(verdict) => Comparison::without_states(verdict),
        }
    }));
    judged.unwrap_or_else(|panic| {
        let fault = Fault::Internal { detail: message(panic.as_ref()) };
        Comparison::without_states(Verdict::GraderFault(fault))
    })
}

/// What a panic said.
fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
    text.unwrap_or_else(|| "a panic without a message".to_owned())
}

fn open_oracle(
    case: &Case,
    oracle: &Oracle,
    shape: Shape,
) -> Result<Box<dyn trace::TraceReader>, Fault> {
    let (path, format) = oracle.find(case)?;
    oracle.check(case, &path)?;
    let broken = |error: trace::TraceError| Fault::BrokenOracle { detail: error.to_string() };
    trace::open(&path, format, shape).map_err(broken)
}

#[cfg(test)]
mod tests {
    use simulator::scene::ParseOptions;
    use simulator::solver::linear::LinearSolver;
    use simulator::trace::State;

    use super::*;
    use crate::oracle::regenerate;
    use crate::verdict::Failure;

    const SCENE: &str = r#"<scene>
      <duration time="0.3"/> <integrator type="explicit-euler" dt="0.1"/>
      <particle m="1" px="0" py="0" vx="1" vy="0" fixed="0"/>
    </scene>"#;

    /// Yields one right state, and breaks off.
    struct Panicking(Box<dyn StateSource>, bool);

    impl StateSource for Panicking {
        fn read(&mut self, state: &mut State) -> Result<bool, Failure> {
            assert!(!self.1, "out of luck at state {}", 1);
            self.1 = true;
            self.0.read(state)
        }
    }

    #[test]
    fn a_panic_is_a_fault_of_the_scene_it_happens_in() {
        let folder = tempfile::tempdir().unwrap();
        let (scenes, traces) = (folder.path().join("assets"), folder.path().join("expected"));
        std::fs::create_dir(&scenes).unwrap();
        std::fs::write(scenes.join("free.xml"), SCENE).unwrap();
        let sections = [(Section::Required, scenes)];
        let suite = Suite::load(&sections, &ParseOptions::default()).unwrap();
        regenerate(&suite, &traces, &Rubric::default(), false).unwrap();
        let oracle = Oracle::open(&traces).unwrap();
        let [case] = suite.cases.as_slice() else { panic!("one scene") };

        let judge = |start: fn(Box<dyn StateSource>) -> Box<dyn StateSource>| {
            judge(case, &oracle, Tolerances::COURSE, || {
                Submission::BuiltIn(LinearSolver::Auto).states(case).map(start)
            })
        };
        assert_eq!(judge(|source| source).verdict, Verdict::Pass);
        let internal =
            |detail: &str| Verdict::GraderFault(Fault::Internal { detail: detail.to_owned() });
        let midway = judge(|source| Box::new(Panicking(source, false)));
        assert_eq!(midway.verdict, internal("out of luck at state 1"));
        assert!(!midway.is_compared());
        assert_eq!(judge(|_| panic!("no start")).verdict, internal("no start"));
    }
}
