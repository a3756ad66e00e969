//! Judges one scene: compares the trace with the oracle's, and records it for the [findings](diagnosis::findings).

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

use rayon::prelude::*;
use scene::Scene;
use scene::trace::{self, Shape, State};

use super::refusal::refusal;
use super::restart::restart;
use super::result::SceneResult;
use crate::compare::recording::Recorder;
use crate::compare::{Comparison, Criteria, Expectation, Pair, compare_watched};
use crate::oracle::Oracle;
use crate::rubric::{OtherRoot, Rubric};
use crate::submission::program::Program;
use crate::submission::{StateSource, Submission};
use crate::suite::Case;
use crate::verdict::{Failure, Fault, Verdict};
use diagnosis::findings::{Diagnosis, is_recorded};
use diagnosis::roots;

/// Maximum number of scenes for which a program is restarted from the oracle's states.
const RESTARTED: usize = 5;

/// A scene with its result and the states of its trace.
#[derive(Clone)]
pub(super) struct Judged<'a> {
    pub(super) case: &'a Case,
    pub(super) result: SceneResult,
    /// The finite states; empty for large scenes, and for traces without velocities.
    pub(super) states: Vec<State>,
    /// Whether the program passes or starts rightly if the scene's file is written otherwise.
    pub(super) is_misread: bool,
}

impl<'a> Judged<'a> {
    /// The result of a scene that is not run.
    pub(super) fn skipped(
        case: &'a Case,
        oracle: &Oracle,
        rubric: &Rubric,
        failure: Failure,
    ) -> Self {
        of_case(case, oracle, rubric, |_| {
            (Comparison::without_states(Verdict::Fail(failure)), Vec::new())
        })
    }
}

/// Judges a submission on one scene, and records the comparison if asked for.
pub(super) fn judge_case<'a>(
    case: &'a Case,
    oracle: &Oracle,
    rubric: &Rubric,
    submission: &Submission,
    is_shown: bool,
) -> Judged<'a> {
    let mut recorder = is_shown.then(|| Recorder::new(&case.scene));
    let mut judged = of_case(case, oracle, rubric, |criteria| {
        judge_watched(case, oracle, criteria, || submission.states(case), &mut |pair| {
            if let Some(recorder) = &mut recorder {
                recorder.add(pair);
            }
        })
    });
    // A fault may be a panic that left the recorder in the middle of a state.
    let is_judged = !matches!(judged.result.comparison.verdict, Verdict::GraderFault(_));
    judged.result.recording = recorder.filter(|_| is_judged).map(|mut recorder| {
        record_rest(case, oracle, &mut recorder);
        recorder.finish()
    });
    judged
}

/// Records the oracle's states after the end of the submission's trace.
fn record_rest(case: &Case, oracle: &Oracle, recorder: &mut Recorder) {
    let Expectation { shape, n_states, .. } = Expectation::of(&case.scene);
    if recorder.n_pairs() == n_states {
        return;
    }
    // The verdict is known; without the oracle, the recording ends with the trace.
    let Ok(mut states) = open_oracle(case, oracle, shape) else { return };
    let mut state = State::zeros(shape);
    for step in 0..n_states {
        if !matches!(states.read(&mut state), Ok(true)) {
            return;
        }
        if step >= recorder.n_pairs() {
            recorder.add_expected(step, &state);
        }
    }
}

/// Judges one scene by its criteria.
pub(super) fn of_case<'a>(
    case: &'a Case,
    oracle: &Oracle,
    rubric: &Rubric,
    judge: impl FnOnce(Criteria) -> (Comparison, Vec<State>),
) -> Judged<'a> {
    let criteria = rubric.criteria(case, oracle.calibrated(case));
    let (mut comparison, states) = judge(criteria.clone());
    if rubric.other_root() == OtherRoot::Pass
        && let Some(step) = other_root(&case.scene, &comparison, &states)
    {
        comparison.verdict = Verdict::Pass;
        comparison.first_wrong = None;
        comparison.other_root = Some(step);
    }
    let result = SceneResult {
        id: case.id.clone(),
        path: case.shown_path(),
        n_particles: case.scene.particles.len(),
        comparison,
        criteria,
        weight: rubric.weight(case),
        diagnosis: None,
        recording: None,
    };
    Judged { case, result, states, is_misread: false }
}

/// Judges the states that `start` yields for a scene, and returns the finite ones. A panic, here or in the submission's
/// code, fails this scene only.
pub fn judge(
    case: &Case,
    oracle: &Oracle,
    criteria: Criteria,
    start: impl FnOnce() -> Result<Box<dyn StateSource>, Verdict>,
) -> (Comparison, Vec<State>) {
    judge_watched(case, oracle, criteria, start, &mut |_| {})
}

/// The same; `watch` sees every pair of states.
fn judge_watched(
    case: &Case,
    oracle: &Oracle,
    criteria: Criteria,
    start: impl FnOnce() -> Result<Box<dyn StateSource>, Verdict>,
    watch: &mut dyn FnMut(Pair<'_>),
) -> (Comparison, Vec<State>) {
    // State that a panic leaves inconsistent is dropped with the closure.
    let judged = catch_unwind(AssertUnwindSafe(|| {
        let expectation = Expectation::of(&case.scene);
        let mut expected = match open_oracle(case, oracle, expectation.shape) {
            Ok(expected) => expected,
            Err(fault) => {
                return (Comparison::without_states(Verdict::GraderFault(fault)), Vec::new());
            }
        };
        let mut states = Vec::new();
        let comparison = match start() {
            Ok(mut actual) => {
                let is_recorded = is_recorded(&case.scene);
                let mut watch = |pair: Pair<'_>| {
                    if is_recorded {
                        states.push(pair.got.clone());
                    }
                    watch(pair);
                };
                let compared = compare_watched(
                    expected.as_mut(),
                    actual.as_mut(),
                    expectation,
                    criteria,
                    &mut watch,
                );
                if compared.has_positions_alone {
                    fill_velocities(&case.scene, &mut states);
                }
                compared
            }
            Err(Verdict::Fail(failure)) => Comparison::without_states(Verdict::Fail(refusal(
                &case.scene,
                case.format(),
                failure,
            ))),
            Err(verdict) => Comparison::without_states(verdict),
        };
        (comparison, states)
    }));
    judged.unwrap_or_else(|panic| {
        let fault = Fault::Internal { detail: panic_message(panic.as_ref()) };
        (Comparison::without_states(Verdict::GraderFault(fault)), Vec::new())
    })
}

/// Velocities of states that have positions alone, as fast mass-spring defines them: those of a fixed particle stay, and
/// others are differences of positions.
fn fill_velocities(scene: &Scene, states: &mut [State]) {
    let axes = scene.dimension.count();
    for number in 0..states.len() {
        let (before, rest) = states.split_at_mut(number);
        let State { positions, velocities, .. } = &mut rest[0];
        for (dof, velocity) in velocities.iter_mut().enumerate() {
            let particle = &scene.particles[dof / axes];
            *velocity = match before.last() {
                Some(before) if !particle.fixed => {
                    (positions[dof] - before.positions[dof]) / scene.time_step
                }
                _ => particle.velocity[dof % axes],
            };
        }
    }
}

/// The first state of a trace that differs from the oracle's, if every step of the trace solves its equation.
fn other_root(scene: &Scene, comparison: &Comparison, states: &[State]) -> Option<u64> {
    let first = comparison.first_wrong.as_ref()?.place.step;
    let is_complete = states.len() as u64 == Expectation::of(scene).n_states;
    let differs = comparison.verdict == Verdict::Fail(Failure::Differs);
    (differs && first > 0 && is_complete && roots::solve_all(scene, states)).then_some(first)
}

/// Restarts the program from the oracle's states in the first scenes that differ.
pub(super) fn restart_some(program: &Program, oracle: &Oracle, judged: &mut [Judged<'_>]) {
    let differing = judged.iter_mut().filter_map(|Judged { case, result, .. }| {
        result.diagnosis.as_mut().map(|diagnosis| (*case, diagnosis))
    });
    let first: Vec<(&Case, &mut Diagnosis)> = differing.take(RESTARTED).collect();
    first.into_par_iter().for_each(|(case, diagnosis)| {
        let steps = || {
            let mut states = open_oracle(case, oracle, Shape::of(&case.scene)).ok()?;
            restart(case, program, states.as_mut())
        };
        diagnosis.restarts = catch_unwind(AssertUnwindSafe(steps)).ok().flatten();
    });
}

/// The message of a panic.
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
    use scene::ParseOptions;
    use simulator::solver::linear::LinearSolver;

    use super::*;
    use crate::compare::Tolerances;
    use crate::oracle::{Acceptance, Origin, Staged};
    use crate::suite::{Section, Suite};

    const SCENE: &str = r#"<scene>
      <duration time="0.3"/> <integrator type="explicit-euler" dt="0.1"/>
      <particle m="1" px="0" py="0" vx="1" vy="0" fixed="0"/>
    </scene>"#;

    /// Yields one right state, then panics.
    struct Panicking(Box<dyn StateSource>, bool);

    impl StateSource for Panicking {
        fn read(&mut self, state: &mut State) -> Result<bool, Failure> {
            assert!(!self.1, "out of luck at state {}", 1);
            self.1 = true;
            self.0.read(state)
        }
    }

    #[test]
    fn a_panic_affects_only_its_scene() {
        let folder = tempfile::tempdir().unwrap();
        let (scenes, traces) = (folder.path().join("assets"), folder.path().join("expected"));
        std::fs::create_dir(&scenes).unwrap();
        std::fs::write(scenes.join("free.xml"), SCENE).unwrap();
        let sections = [(Section::Required, scenes)];
        let suite = Suite::load(&sections, &ParseOptions::default()).unwrap();
        let nothing = Acceptance::Nothing;
        let staged = Staged::make(&suite, &traces, &Rubric::default(), nothing).unwrap();
        staged.replace(nothing, &Origin::default()).unwrap();
        let oracle = Oracle::open(&traces).unwrap();
        let [case] = suite.cases.as_slice() else { panic!("one scene") };

        let judge = |start: fn(Box<dyn StateSource>) -> Box<dyn StateSource>| {
            let start = || Submission::BuiltIn(LinearSolver::Auto).states(case).map(start);
            judge(case, &oracle, Tolerances::COURSE.into(), start).0
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
