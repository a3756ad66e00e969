//! A submission graded over a suite: scenes in parallel, results in the suite's order.

use std::any::Any;
use std::collections::HashSet;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};

use rayon::prelude::*;
use simulator::trace::{self, Shape};

use crate::altered::Copied;
use crate::blame::Blame;
use crate::compare::{Comparison, Criteria, Expectation, compare};
use crate::diagnosis::{Diagnosis, diagnose, restart};
use crate::events::{Event, Observer, Task};
use crate::hidden::{Hidden, Tally};
use crate::jacobian::JacobianReport;
use crate::oracle::Oracle;
use crate::printed;
use crate::probe::{self, Probing};
use crate::rubric::{FaultPoints, Rubric};
use crate::submission::program::Program;
use crate::submission::{StateSource, Submission};
use crate::suite::{Case, Feature, Section, Suite};
use crate::verdict::{Failure, Fault, Verdict};
use sandbox::Protection;

/// The most scenes that are run twice.
const REPEATED: usize = 8;

/// The most scenes of which steps are made from the oracle's states.
const RESTARTED: usize = 5;

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
    /// That it passes shipped scenes, and takes no right step in altered ones; `None` where it is not so, or not known.
    pub copied: Option<Copied>,
    /// What it looks as if it had wrong; `None` where nothing failed.
    pub blame: Option<Blame>,
    /// Jacobian checks; empty where the submission is not the built-in simulator.
    pub jacobians: JacobianReport,
    /// Whether there are hidden scenes, and whether they were run.
    pub hidden: Hidden,
    /// What is shown of points where something could not be judged.
    pub faults: FaultPoints,
    /// How much was done, where it was ended early.
    pub interrupted: Option<Interrupted>,
}

/// How much was done of a run that was ended early.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interrupted {
    /// Scenes graded.
    pub graded: usize,
    /// Scenes that there are, without hidden ones.
    pub scenes: usize,
}

impl fmt::Display for Interrupted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} of {} scenes graded", self.graded, self.scenes)
    }
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
    /// Whether it earns them in proportion to its scenes that pass; otherwise all or nothing.
    pub partial: bool,
    /// Its scenes, by name.
    pub scenes: Vec<SceneResult>,
    /// Its hidden scenes; none where they were not run.
    pub hidden: Tally,
}

/// A scene with its verdict.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneResult {
    /// The scene's name.
    pub id: String,
    /// The scene's path, as given.
    pub path: String,
    /// What it was judged by.
    pub criteria: Criteria,
    /// What it counts among the scenes of its feature.
    pub weight: f64,
    /// How its trace compares.
    pub comparison: Comparison,
    /// Why it differs; `None` where it does not, or that cannot be found out.
    pub diagnosis: Option<Diagnosis>,
}

impl FeatureResult {
    /// A feature without scenes so far.
    pub(crate) fn new(feature: Feature, rubric: &Rubric) -> Self {
        Self {
            points: rubric.points(&feature),
            partial: rubric.partial(&feature),
            feature,
            scenes: Vec::new(),
            hidden: Tally::default(),
        }
    }

    /// Whether every scene passed, hidden ones too.
    pub fn is_pass(&self) -> bool {
        self.n_passed() == self.scenes.len() && self.hidden.n_passed() == self.hidden.n_scenes()
    }

    /// Whether a scene passed, be it hidden.
    pub fn has_passes(&self) -> bool {
        self.n_passed() + self.hidden.n_passed() > 0
    }

    /// Whether a scene could not be judged, be it hidden.
    pub fn has_faults(&self) -> bool {
        self.n_faults() + self.hidden.n_faults() > 0
    }

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

    /// What becomes of its points: in proportion to the weight of its scenes, hidden ones too, or all or nothing.
    pub fn credit(&self) -> Credit {
        let Tally { weight_passed: mut passed, weight_unjudged: mut unjudged, mut weight, .. } =
            self.hidden;
        for scene in &self.scenes {
            weight += scene.weight;
            match scene.comparison.verdict {
                Verdict::Pass => passed += scene.weight,
                Verdict::Fail(_) => {}
                Verdict::GraderFault(_) => unjudged += scene.weight,
            }
        }
        let n_scenes = self.scenes.len() + self.hidden.n_scenes();
        let n_passed = self.n_passed() + self.hidden.n_passed();
        let n_faults = self.n_faults() + self.hidden.n_faults();
        let (earned, unjudged) = match () {
            // To the last bit, which a quotient might lose.
            () if n_passed == n_scenes => (self.points, 0.0),
            () if n_faults == n_scenes => (0.0, self.points),
            () if self.partial => (self.points * passed / weight, self.points * unjudged / weight),
            () if n_passed + n_faults < n_scenes => (0.0, 0.0),
            () => (0.0, self.points),
        };
        Credit { points: self.points, earned, unjudged }
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

/// What becomes of points: what is neither earned nor unjudged is lost.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Credit {
    /// Points that there are.
    pub points: f64,
    /// Points earned.
    pub earned: f64,
    /// Points of scenes that could not be judged.
    pub unjudged: f64,
}

impl Credit {
    /// The points earned, as far as they are shown: not where nothing was judged, or they are withheld.
    pub fn shown(&self, faults: FaultPoints) -> Option<f64> {
        let is_withheld = faults == FaultPoints::Withheld || self.unjudged >= self.points;
        (self.unjudged == 0.0 || !is_withheld).then_some(self.earned)
    }
}

impl std::ops::Add for Credit {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            points: self.points + other.points,
            earned: self.earned + other.earned,
            unjudged: self.unjudged + other.unjudged,
        }
    }
}

/// Sums over the features of a section.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Totals {
    /// Scenes, without hidden ones.
    pub scenes: usize,
    /// Scenes that passed.
    pub passed: usize,
    /// Scenes that could not be judged.
    pub faults: usize,
    /// Hidden scenes that were run.
    pub hidden: usize,
    /// Hidden scenes that passed.
    pub hidden_passed: usize,
    /// Hidden scenes that could not be judged.
    pub hidden_faults: usize,
    /// Features.
    pub features: usize,
    /// Features of which every scene passed, hidden ones too.
    pub features_passed: usize,
    /// What becomes of their points.
    pub credit: Credit,
}

impl Totals {
    /// Sums over these features.
    pub fn of<'a>(features: impl IntoIterator<Item = &'a FeatureResult>) -> Self {
        let mut totals = Self::default();
        for result in features {
            totals.scenes += result.scenes.len();
            totals.passed += result.n_passed();
            totals.faults += result.n_faults();
            totals.hidden += result.hidden.n_scenes();
            totals.hidden_passed += result.hidden.n_passed();
            totals.hidden_faults += result.hidden.n_faults();
            totals.features += 1;
            totals.features_passed += usize::from(result.is_pass());
            totals.credit = totals.credit + result.credit();
        }
        totals
    }
}

/// What a grading comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Everything passed.
    Passed,
    /// Everything that was run passed; there are hidden scenes, which were not.
    PassedShipped,
    /// Something failed.
    Failed,
    /// Something could not be judged.
    GraderFault,
}

impl Grading {
    /// Sums over the features of `section`.
    pub fn totals(&self, section: Section) -> Totals {
        Totals::of(self.features.iter().filter(|result| result.feature.section == section))
    }

    /// The features of `section`, group by group.
    pub fn groups(&self, section: Section) -> impl Iterator<Item = &[FeatureResult]> {
        let same = |a: &FeatureResult, b: &FeatureResult| {
            (a.feature.section, &a.feature.group) == (b.feature.section, &b.feature.group)
        };
        let groups = self.features.chunk_by(same);
        groups.filter(move |group| group.iter().all(|result| result.feature.section == section))
    }

    /// Notes that it was ended early, and drops what was said of all scenes together.
    pub fn interrupt(&mut self, suite: &Suite) {
        let graded = self.features.iter().map(|result| result.scenes.len()).sum();
        self.interrupted = Some(Interrupted { graded, scenes: suite.cases.len() });
        (self.repetition, self.probing, self.copied, self.blame) = (None, None, None, None);
    }

    /// What it comes to: a fault of the grader outweighs a failure.
    pub fn outcome(&self) -> Outcome {
        if self.features.iter().any(FeatureResult::has_faults) {
            Outcome::GraderFault
        } else if !self.features.iter().all(FeatureResult::is_pass)
            || !self.jacobians.is_pass()
            || self
                .probing
                .as_ref()
                .is_some_and(|probing| probing.verdict() == probe::Verdict::Wrong)
        {
            Outcome::Failed
        } else if matches!(self.hidden, Hidden::NotRun { .. }) {
            Outcome::PassedShipped
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
    grade_observed(suite, submission, oracle, rubric, jacobians, &())
}

/// As [`grade`], before an observer, which may end it early: then only the scenes that ended before are in it.
pub fn grade_observed(
    suite: &Suite,
    submission: &Submission,
    oracle: &Oracle,
    rubric: &Rubric,
    jacobians: JacobianReport,
    observer: &dyn Observer,
) -> Grading {
    observer.notice(Event::Task(Task::Scenes(suite.cases.len())));
    let judge = |case: &Case| {
        if observer.is_stopped() {
            return None;
        }
        let name = Some(case.id.as_str());
        observer.notice(Event::SceneStarted { name });
        let mut result = judge_case(case, oracle, rubric, submission);
        result.diagnosis = look_into(case, submission, &result.comparison);
        let passed = result.comparison.verdict.is_pass();
        observer.notice(Event::SceneFinished { name, passed });
        // A program that was ended with the run says nothing.
        (!observer.is_stopped()).then_some(result)
    };
    let results: Vec<Option<SceneResult>> = suite.cases.par_iter().map(judge).collect();
    let graded = suite.cases.iter().zip(results);
    let mut results: Vec<(&Case, SceneResult)> =
        graded.filter_map(|(case, result)| Some((case, result?))).collect();
    if let (Submission::Program(program), false) = (submission, observer.is_stopped()) {
        restart_some(program, oracle, &mut results);
    }
    let mut grading = gather(submission.name(), rubric, results);
    grading.jacobians = jacobians;
    if observer.is_stopped() {
        grading.interrupt(suite);
    } else if let Submission::Program(program) = submission {
        observer.notice(Event::Task(Task::Repetition));
        grading.repetition = Some(Repetition::of(suite, program));
    }
    grading
}

/// Judges every scene of the suite by `judge`, in parallel.
pub fn collect(
    suite: &Suite,
    submission: String,
    oracle: &Oracle,
    rubric: &Rubric,
    judge: impl Fn(&Case, Criteria) -> Comparison + Sync,
) -> Grading {
    let cases = suite.cases.par_iter();
    let judged = |case| (case, of_case(case, oracle, rubric, |criteria| judge(case, criteria)));
    gather(submission, rubric, cases.map(judged).collect())
}

/// Puts together the results of scenes, in the order of the suite.
fn gather(submission: String, rubric: &Rubric, results: Vec<(&Case, SceneResult)>) -> Grading {
    let blame = Blame::of(results.iter().map(|(case, result)| (*case, &result.comparison)));

    let mut features: Vec<FeatureResult> = Vec::new();
    for (case, result) in results {
        match features.iter_mut().find(|known| known.feature == case.feature) {
            Some(known) => known.scenes.push(result),
            None => {
                let mut feature = FeatureResult::new(case.feature.clone(), rubric);
                feature.scenes.push(result);
                features.push(feature);
            }
        }
    }
    features.sort_by(|a, b| a.feature.cmp(&b.feature));
    Grading {
        submission: printed::text(&submission),
        features,
        protection: None,
        repetition: None,
        probing: None,
        copied: None,
        blame,
        jacobians: JacobianReport::default(),
        hidden: Hidden::None,
        faults: rubric.fault_points(),
        interrupted: None,
    }
}

/// Judges a submission on one scene.
pub(crate) fn judge_case(
    case: &Case,
    oracle: &Oracle,
    rubric: &Rubric,
    submission: &Submission,
) -> SceneResult {
    of_case(case, oracle, rubric, |criteria| {
        judge(case, oracle, criteria, || submission.states(case))
    })
}

/// One scene, judged by its criteria.
fn of_case(
    case: &Case,
    oracle: &Oracle,
    rubric: &Rubric,
    judge: impl FnOnce(Criteria) -> Comparison,
) -> SceneResult {
    let criteria = rubric.criteria(case, oracle.calibrated(case));
    SceneResult {
        id: case.id.clone(),
        path: case.scene.name.clone(),
        comparison: judge(criteria.clone()),
        criteria,
        weight: rubric.weight(case),
        diagnosis: None,
    }
}

/// Judges the states that `start` yields for a scene. A panic, here or there, costs this scene alone.
pub fn judge(
    case: &Case,
    oracle: &Oracle,
    criteria: Criteria,
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
            Ok(mut actual) => compare(expected.as_mut(), actual.as_mut(), expectation, criteria),
            Err(verdict) => Comparison::without_states(verdict),
        }
    }));
    judged.unwrap_or_else(|panic| {
        let fault = Fault::Internal { detail: panic_message(panic.as_ref()) };
        Comparison::without_states(Verdict::GraderFault(fault))
    })
}

/// Looks into a trace that differs. It is read, or made, once more.
fn look_into(case: &Case, submission: &Submission, comparison: &Comparison) -> Option<Diagnosis> {
    if comparison.verdict != Verdict::Fail(Failure::Differs) {
        return None;
    }
    // What breaks off here costs the remark, and not the verdict.
    let found =
        catch_unwind(AssertUnwindSafe(|| diagnose(case, submission.states(case).ok()?.as_mut())));
    found.ok().flatten()
}

/// Makes some steps of the first scenes that differ from the oracle's states.
fn restart_some(program: &Program, oracle: &Oracle, results: &mut [(&Case, SceneResult)]) {
    let differing = results
        .iter_mut()
        .filter_map(|(case, result)| result.diagnosis.as_mut().map(|diagnosis| (*case, diagnosis)));
    let first: Vec<(&Case, &mut Diagnosis)> = differing.take(RESTARTED).collect();
    first.into_par_iter().for_each(|(case, diagnosis)| {
        let steps = || {
            let mut states = open_oracle(case, oracle, Shape::of(&case.scene)).ok()?;
            restart(case, program, states.as_mut())
        };
        diagnosis.restarts = catch_unwind(AssertUnwindSafe(steps)).ok().flatten();
    });
}

/// What a panic said.
pub fn panic_message(panic: &(dyn Any + Send)) -> String {
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
    use crate::compare::Tolerances;
    use crate::oracle::regenerate;

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

    /// A feature of scenes with these weights: passed, failed, or not judged.
    fn feature(partial: bool, scenes: &[(f64, char)]) -> FeatureResult {
        let scene = |&(weight, kind): &(f64, char)| SceneResult {
            id: String::new(),
            path: String::new(),
            criteria: Tolerances::COURSE.into(),
            weight,
            comparison: Comparison::without_states(match kind {
                'p' => Verdict::Pass,
                'f' => Verdict::Fail(Failure::Differs),
                _ => Verdict::GraderFault(Fault::StaleOracle),
            }),
            diagnosis: None,
        };
        FeatureResult {
            feature: Feature {
                section: Section::Required,
                group: String::new(),
                integrator: "explicit-euler",
            },
            points: 0.7,
            partial,
            scenes: scenes.iter().map(scene).collect(),
            hidden: Tally::default(),
        }
    }

    #[test]
    fn what_was_not_judged_is_neither_earned_nor_lost() {
        let credit = |partial, scenes: &[(f64, char)]| {
            let Credit { earned, unjudged, .. } = feature(partial, scenes).credit();
            (earned, unjudged)
        };
        let [third, half] = [0.7 * 1.0 / 3.0, 0.7 * 2.0 / 4.0];
        for (scenes, partial, all_or_nothing) in [
            (&[(1.0, '?'), (1.0, '?')][..], (0.0, 0.7), (0.0, 0.7)),
            (&[(1.0, 'p'), (1.0, 'f'), (1.0, '?')], (third, third), (0.0, 0.0)),
            (&[(1.0, 'p'), (2.0, '?'), (1.0, 'p')], (half, half), (0.0, 0.7)),
            (&[(0.1, 'p'), (0.2, 'p'), (0.3, 'p')], (0.7, 0.0), (0.7, 0.0)),
            (&[(3.0, 'f')], (0.0, 0.0), (0.0, 0.0)),
        ] {
            assert_eq!(credit(true, scenes), partial, "{scenes:?}");
            assert_eq!(credit(false, scenes), all_or_nothing, "{scenes:?}");
        }
        let mut hidden = feature(true, &[(1.0, 'p')]);
        let verdicts = [("pass", 1), ("grader-fault", 1), ("differs", 1)].into();
        let (weight_passed, weight_unjudged, weight) = (1.0, 1.0, 3.0);
        hidden.hidden = Tally { verdicts, weight_passed, weight_unjudged, weight };
        assert_eq!(hidden.credit(), Credit { points: 0.7, earned: half, unjudged: 0.7 / 4.0 });
    }

    #[test]
    fn points_are_shown_as_earned_where_something_was_judged() {
        let shown = |earned, unjudged| {
            let credit = Credit { points: 2.0, earned, unjudged };
            [FaultPoints::Apart, FaultPoints::Withheld].map(|faults| credit.shown(faults))
        };
        assert_eq!(shown(1.0, 0.0), [Some(1.0), Some(1.0)]);
        assert_eq!(shown(1.0, 1.0), [Some(1.0), None]);
        assert_eq!(shown(0.0, 2.0), [None, None]);
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
            judge(case, &oracle, Tolerances::COURSE.into(), || {
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
