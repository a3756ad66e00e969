//! Grading of a submission over a suite: scenes run in parallel, results keep the suite's order.
//!
//! ```text
//! Grader::grade    Jacobians (built-in) ─> scenes ─> twice ─> probe ─> altered ─> hidden ─> Grading
//!                                          judge.rs                              hidden.rs  result.rs
//! ```
//!
//! Hidden scenes run last, so that no run with visible output can depend on them.

pub mod altered;
pub mod events;
pub mod hidden;
pub mod points;
pub mod provenance;

mod breaker;
mod diagnose;
mod judge;
mod measured;
mod refusal;
mod restart;
mod result;
mod spelling;

use std::collections::HashSet;

use rayon::prelude::*;
use scene::Scene;
use scene::trace::State;

use crate::boundary::printed::Untrusted;
use crate::boundary::seal::Secret;
use crate::compare::{Comparison, Criteria};
use crate::functions::Functions;
use crate::oracle::Oracle;
use crate::probe;
use crate::rubric::Rubric;
use crate::submission::Submission;
use crate::submission::program::Program;
use crate::suite::assignment::Assignment;
use crate::suite::{Case, Suite};
use crate::verdict::{Failure, Verdict};
use crate::white_box::{self, JacobianReport};
use breaker::{Failures, PILOTS};
use events::{Event, Observer, Task};
use hidden::HiddenSuite;
use sandbox::Protection;

use diagnose::look_into;
pub use diagnose::outcome;
use diagnosis::findings::{Finding, Thresholds};
use judge::{Judged, judge_case, of_case, restart_some};
pub use judge::{judge, panic_message};
pub use refusal::refusal;
use result::gather;
pub use result::{
    Adjustment, AssignmentName, Credit, FeatureResult, Grading, GradingOutcome, Hidden,
    HiddenTally, Interrupted, NotRunReason, Repetition, SceneResult, Since, Totals,
};
use spelling::misread;

/// Maximum number of scenes that are run twice.
const REPEATED: usize = 8;

impl Repetition {
    /// Runs the first scene of each feature twice. Scenes without a trace are left out; those that timed out are not run
    /// again.
    fn of(suite: &Suite, program: &Program, features: &[FeatureResult]) -> Self {
        let scenes = features.iter().flat_map(|feature| &feature.scenes);
        let timed_out = scenes.filter(|scene| {
            matches!(&scene.comparison.verdict, Verdict::Fail(failure) if failure.is_timeout())
        });
        let timed_out: HashSet<&str> = timed_out.map(|scene| scene.id.as_str()).collect();
        let mut features = HashSet::new();
        let first_ones = suite.cases.iter().filter(|case| features.insert(&case.feature));
        let cases: Vec<&Case> = first_ones.take(REPEATED).collect();
        let same = |case: &&Case| {
            if timed_out.contains(case.id.as_str()) {
                return None;
            }
            let hash = |before| program.trace_hash(case, before).ok();
            Some((case.id.clone(), hash(0)? == hash(1)?))
        };
        let results: Vec<(String, bool)> = cases.par_iter().filter_map(same).collect();
        let differing = results.iter().filter(|(_, same)| !same).map(|(id, _)| id.clone());
        Self { scenes: results.len(), differing: differing.collect() }
    }
}

/// Settings of a grading: the suite, the oracle and the checks.
#[derive(Clone, Copy)]
pub struct Grader<'a> {
    /// The shipped scenes that are graded.
    pub suite: &'a Suite,
    /// Their traces.
    pub oracle: &'a Oracle,
    /// Tolerances and points.
    pub rubric: &'a Rubric,
    /// The assignment that the suite was narrowed to; `None` if it contains every scene.
    pub assignment: Option<&'a Assignment>,
    /// The hidden scenes, where they are available.
    pub hidden: Option<&'a HiddenSuite>,
    /// The functions of a pack that are graded by themselves.
    pub functions: Option<&'a Functions>,
    /// Checks other than the shipped scenes.
    pub checks: Checks,
    /// Receives events, and may end the run early.
    pub observer: &'a dyn Observer,
    /// Runs of programs at a time; by default as many as rayon has threads.
    pub runs_at_once: Option<usize>,
}

/// Checks other than the shipped scenes, and recordings.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Checks {
    /// Check of the built-in simulator's Jacobians.
    pub jacobians: bool,
    /// Measurement of a program's forces and Jacobians from single steps.
    pub probe: bool,
    /// Altered copies of the scenes that a program passes, drawn from this number.
    pub altered: Option<Secret>,
    /// Hidden scenes.
    pub hidden: bool,
    /// The machine grades no other submission: hidden scenes run also without namespaces.
    pub is_alone: bool,
    /// Recordings of the comparisons of shipped scenes, for display.
    pub recordings: bool,
}

impl<'a> Grader<'a> {
    /// Grades the shipped scenes only, without an observer.
    pub fn new(suite: &'a Suite, oracle: &'a Oracle, rubric: &'a Rubric) -> Self {
        let checks = Checks::default();
        let (assignment, hidden, functions, observer) = (None, None, None, &());
        let runs_at_once = None;
        Self {
            suite,
            oracle,
            rubric,
            assignment,
            hidden,
            functions,
            checks,
            observer,
            runs_at_once,
        }
    }

    /// Grades a submission. Its programs, if any, run under `protection`. If the observer ends the run early, the
    /// result contains only the scenes that had ended.
    pub fn grade(&self, submission: &Submission, protection: Option<Vec<Protection>>) -> Grading {
        let wanted = self.runs_at_once.filter(|_| matches!(submission, Submission::Program(_)));
        let pool = wanted.map(|runs| rayon::ThreadPoolBuilder::new().num_threads(runs).build());
        match pool {
            Some(Ok(pool)) => pool.install(|| self.graded(submission, protection)),
            // Without further threads, there are fewer runs at a time.
            _ => self.graded(submission, protection),
        }
    }

    fn graded(&self, submission: &Submission, protection: Option<Vec<Protection>>) -> Grading {
        let Self { suite, oracle, rubric, checks, observer, .. } = *self;
        let submission = &submission.with_budget();
        let jacobians = if checks.jacobians && matches!(submission, Submission::BuiltIn(_)) {
            observer.notice(Event::Task(Task::Jacobians));
            white_box::check_all(white_box::Config::default())
        } else {
            JacobianReport::default()
        };
        let (mut judged, broken) = self.scenes(submission);
        // A program that was killed with the run, or that only times out, has no further results.
        let program = || match submission {
            Submission::Program(_) if observer.is_stopped() || broken.is_some() => None,
            Submission::Program(program) => Some(program),
            _ => None,
        };
        // Scenes that follow keep what measurements take.
        let measured = program().map(Program::with_own_budget);
        let program = || measured.as_ref().filter(|_| program().is_some());
        let misread = program().map(|program| misread(program, oracle, &mut judged));
        let mut findings = look_into(&mut judged, &Thresholds::default());
        findings.list.splice(..0, misread.unwrap_or_default());
        if let Some(program) = program() {
            restart_some(program, oracle, &mut judged);
        }
        let results = judged.into_iter().map(|judged| (judged.case, judged.result));
        let mut grading = gather(submission.name(), rubric, results.collect(), findings);
        let may_tell = matches!(submission, Submission::Program(_))
            && !rubric.runs_hidden_under(protection.as_deref().unwrap_or_default())
            && !checks.is_alone;
        (grading.jacobians, grading.protection) = (jacobians, protection);
        grading.assignment = self.assignment.map(AssignmentName::of);
        if let Submission::Program(program) = submission {
            grading.taken = program.taken.clone();
        }
        grading.is_own = matches!(submission, Submission::BuiltIn(_));
        grading.hidden = self.hidden_not_run();
        if let Some(program) = program() {
            observer.notice(Event::Task(Task::Repetition));
            let repetition = Repetition::of(suite, program, &grading.features);
            if !repetition.differing.is_empty() {
                let first = Finding::of_differing_runs(repetition.differing.clone());
                grading.findings.list.insert(0, first);
            }
            grading.repetition = Some(repetition);
        }
        let measures = self.assignment.is_none_or(|assignment| assignment.scope().has_jacobians());
        if let Some(program) = program().filter(|_| checks.probe && measures) {
            observer.notice(Event::Task(Task::Probe));
            let offers = |tag: &str, dimension| {
                self.assignment.is_none_or(|assignment| assignment.scope().offers(tag, dimension))
            };
            let mut probing = probe::probe(program, offers);
            let passed = grading.passed_cases(suite, rubric.other_root());
            let passed: Vec<&Scene> = passed.iter().map(|one| &one.case.scene).collect();
            measured::take_back(&mut probing, &grading.findings.list, &passed);
            grading.probing = Some(probing);
        }
        if let (Some(program), Some(secret)) = (program(), checks.altered) {
            observer.notice(Event::Task(Task::Altered));
            let is_stopped = || observer.is_stopped();
            let passed = grading.passed_cases(suite, rubric.other_root());
            let copied = altered::of_program(
                suite,
                &passed,
                secret,
                &program.with_own_budget(),
                &is_stopped,
            );
            grading.withdraw(copied.filter(|_| !is_stopped()));
        }
        if let Some(functions) = self.functions.filter(|_| !observer.is_stopped()) {
            observer.notice(Event::Task(Task::Functions));
            let judged = functions.judge(submission).into_iter();
            let of_function = |(function, verdict)| FeatureResult::of_function(function, verdict);
            grading.features.extend(judged.map(of_function));
            grading.features.sort_by(|a, b| a.feature.cmp(&b.feature));
        }
        if let Hidden::NotRun { reason, .. } = &mut grading.hidden
            && may_tell
        {
            *reason = NotRunReason::WithoutNamespaces;
        }
        let is_asked = checks.hidden && !may_tell && !observer.is_stopped();
        if let Some(hidden) = self.hidden.filter(|_| is_asked) {
            let skipped = broken.as_ref();
            let submission = submission.beyond_first_phase();
            hidden.grade(&submission, (rubric, skipped), &mut grading, observer);
        }
        if observer.is_stopped() {
            grading.interrupt(suite);
        }
        grading
    }

    /// The state of the hidden scenes before they run.
    pub fn hidden_not_run(&self) -> Hidden {
        let reason = NotRunReason::Unavailable;
        match (self.hidden, self.rubric.hidden()) {
            (Some(hidden), _) => Hidden::NotRun { scenes: Some(hidden.n_scenes()), reason },
            (None, Some(rule)) => Hidden::NotRun { scenes: rule.scenes.map(Into::into), reason },
            (None, None) => Hidden::None,
        }
    }

    /// Judges the scenes of the suite, features in parallel; those that ended, in the order of the suite. The failure
    /// is that of a program that is not run further.
    fn scenes(&self, submission: &Submission) -> (Vec<Judged<'a>>, Option<Failure>) {
        let Self { suite, rubric, observer, .. } = *self;
        observer.notice(Event::Task(Task::Scenes(suite.cases.len())));
        let features = breaker::by_feature(&suite.cases);
        let judge_first = |cases: &Vec<&'a Case>| {
            let mut failures = Failures::default();
            let judged = self.scene(cases[0], submission, None)?;
            failures.add(&judged.result.comparison.verdict);
            Some((judged, failures))
        };
        let mut pilots: Vec<(Judged<'a>, Failures)> = Vec::new();
        let mut wanted = if matches!(submission, Submission::Program(_)) { PILOTS } else { 0 };
        while wanted > 0 && pilots.len() < features.len() && !observer.is_stopped() {
            let first = features[pilots.len()..].par_iter().take(wanted);
            let judged: Vec<_> = first.filter_map(judge_first).collect();
            // One that is refused shows nothing of the others.
            let refused =
                |(judged, _): &&(Judged<'a>, _)| judged.result.comparison.verdict.is_lack();
            wanted = judged.iter().filter(refused).count();
            pilots.extend(judged);
        }
        let rest = &features[pilots.len()..];
        let verdicts = pilots.iter().map(|(judged, _)| &judged.result.comparison.verdict);
        let broken = breaker::after_pilots(verdicts, rubric.breaker());
        let begun = pilots.iter().map(|(_, failures)| (1, failures.clone()));
        let begun = begun.chain(rest.iter().map(|_| (0, Failures::default())));
        let begun: Vec<(usize, Failures)> = begun.collect();
        let judge = |(cases, (done, failures)): (&Vec<&'a Case>, &(usize, Failures))| {
            let mut failures = failures.clone();
            let mut results = Vec::with_capacity(cases.len());
            for case in &cases[*done..] {
                let skipped = broken.clone().or_else(|| failures.next(rubric.breaker()));
                let is_run = skipped.is_none();
                let Some(judged) = self.scene(case, submission, skipped) else { break };
                if is_run {
                    failures.add(&judged.result.comparison.verdict);
                }
                results.push(judged);
            }
            results
        };
        let others: Vec<_> = if observer.is_stopped() {
            Vec::new()
        } else {
            features.par_iter().zip(&begun).flat_map_iter(judge).collect()
        };
        let pilots = pilots.into_iter().map(|(judged, _)| judged);
        let mut results: Vec<Judged<'_>> = pilots.chain(others).collect();
        let place = |judged: &Judged<'a>| (judged.case.feature.section, judged.case.id.as_str());
        results.sort_by(|a, b| place(a).cmp(&place(b)));
        (results, broken)
    }

    /// Judges one scene, or gives it the failure of scenes that are not run. `None` if the run was ended.
    fn scene(
        &self,
        case: &'a Case,
        submission: &Submission,
        skipped: Option<Failure>,
    ) -> Option<Judged<'a>> {
        let Self { oracle, rubric, checks, observer, .. } = *self;
        if observer.is_stopped() {
            return None;
        }
        let name = Some(case.id.as_str());
        observer.notice(Event::SceneStarted { name });
        let judged = match skipped {
            None => judge_case(case, oracle, rubric, submission, checks.recordings),
            Some(failure) => Judged::skipped(case, oracle, rubric, failure),
        };
        // The program may have been killed with the run. A stop that follows from this result keeps it.
        let is_killed = observer.is_stopped();
        let passed = judged.result.comparison.verdict.is_pass();
        observer.notice(Event::SceneFinished { name, passed });
        (!is_killed).then_some(judged)
    }
}

/// Judges every scene of the suite by `judge`, in parallel.
pub fn collect(
    suite: &Suite,
    submission: impl Into<Untrusted>,
    oracle: &Oracle,
    rubric: &Rubric,
    judge: impl Fn(&Case, Criteria) -> (Comparison, Vec<State>) + Sync,
) -> Grading {
    collect_within(&Thresholds::default(), suite, submission, oracle, rubric, judge)
}

/// The same, with these numbers of the search for causes.
pub fn collect_within(
    limits: &Thresholds,
    suite: &Suite,
    submission: impl Into<Untrusted>,
    oracle: &Oracle,
    rubric: &Rubric,
    judge: impl Fn(&Case, Criteria) -> (Comparison, Vec<State>) + Sync,
) -> Grading {
    let cases = suite.cases.par_iter();
    let judged = |case| of_case(case, oracle, rubric, |criteria| judge(case, criteria));
    let mut judged: Vec<Judged<'_>> = cases.map(judged).collect();
    let findings = look_into(&mut judged, limits);
    let results = judged.into_iter().map(|judged| (judged.case, judged.result));
    gather(submission.into(), rubric, results.collect(), findings)
}
