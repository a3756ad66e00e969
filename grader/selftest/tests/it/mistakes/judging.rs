//! Comparison of a student's states with an oracle's, by the grader's own code.

use std::collections::BTreeSet;
use std::path::Path;

use grader::compare::{Comparison, Expectation, Residuals, Tolerances, compare};
use grader::submission::StateSource;
use grader::suite::{Section, Suite, find_trace};
use grader::verdict::{Failure, Verdict};
use rayon::prelude::*;
use scene::Scene;
use scene::trace::{self, Shape, State, TraceError, TraceReader};
use selftest::student::Student;

/// A residual within this factor of a tolerance, on either side, is no evidence: with different rounding it could be
/// on the other side.
const BORDERLINE: f64 = 100.0;

/// Result of a student on a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Finding {
    /// Fails by a wide margin.
    Caught,
    /// The verdict is close.
    Borderline,
    /// Passes by a wide margin.
    Passed,
}

/// A scene with the oracle's states.
pub(crate) struct Graded {
    pub(crate) id: String,
    pub(crate) section: Section,
    pub(crate) scene: Scene,
    states: Vec<State>,
}

impl Graded {
    /// All scenes of the suite, with the traces in `folder`.
    pub(crate) fn all(suite: &Suite, folder: &Path) -> Vec<Self> {
        let grade = |case: &grader::suite::Case| Self {
            id: case.id.clone(),
            section: case.feature.section,
            states: stored_states(folder, &case.id, &case.scene),
            scene: case.scene.clone(),
        };
        suite.cases.par_iter().map(grade).collect()
    }

    /// Number of kinds of force, then of particles.
    pub(crate) fn complexity(&self) -> (usize, usize) {
        let tags: BTreeSet<&str> = self.scene.forces.iter().map(|force| force.schema.tag).collect();
        (tags.len(), self.scene.particles.len())
    }

    /// The grader's comparison.
    pub(crate) fn compare(&self, student: &Student) -> Comparison {
        compare_states(&self.states, &mut student.simulate(&self.scene), &self.scene)
    }

    /// The result that follows from the comparison.
    pub(crate) fn judge(&self, student: &Student) -> Finding {
        let comparison = self.compare(student);
        let excess = excess(&comparison);
        match comparison.verdict {
            Verdict::GraderFault(fault) => panic!("{}: {fault}", self.id),
            Verdict::Pass if excess <= 1.0 / BORDERLINE => Finding::Passed,
            Verdict::Fail(Failure::Differs) if excess >= BORDERLINE => Finding::Caught,
            Verdict::Pass | Verdict::Fail(Failure::Differs) => Finding::Borderline,
            Verdict::Fail(_) => Finding::Caught,
        }
    }
}

/// The largest ratio of a residual to its tolerance.
pub(crate) fn excess(Comparison { position, velocity, .. }: &Comparison) -> f64 {
    let Tolerances { largest, accumulated } = Tolerances::COURSE;
    let of = |residuals: &Residuals| {
        (residuals.largest / largest).max(residuals.accumulated / accumulated)
    };
    of(position).max(of(velocity))
}

/// The grader's comparison with the course's tolerances.
pub(crate) fn compare_states(
    oracle: &[State],
    actual: &mut dyn StateSource,
    scene: &Scene,
) -> Comparison {
    compare(&mut Replay(oracle.iter()), actual, Expectation::of(scene), Tolerances::COURSE)
}

/// All states of a source.
pub(crate) fn states_of(source: &mut dyn StateSource, scene: &Scene) -> Vec<State> {
    let mut states = Vec::new();
    let mut state = State::zeros(Shape::of(scene));
    while source.read(&mut state).expect("a source without faults") {
        states.push(state.clone());
    }
    states
}

/// The states of the oracle's trace, read once for many students.
fn stored_states(folder: &Path, id: &str, scene: &Scene) -> Vec<State> {
    let (path, format) = find_trace(folder, id).unwrap_or_else(|error| {
        panic!("{id} has no oracle trace: {error}; make it with `grade oracle regenerate`")
    });
    let mut reader = trace::open(&path, format, Shape::of(scene)).expect("a trace");
    states_of(&mut reader, scene)
}

struct Replay<'a>(std::slice::Iter<'a, State>);

impl TraceReader for Replay<'_> {
    fn read(&mut self, state: &mut State) -> Result<bool, TraceError> {
        let Some(next) = self.0.next() else { return Ok(false) };
        state.clone_from(next);
        Ok(true)
    }
}
