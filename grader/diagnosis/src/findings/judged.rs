//! A judged scene of a submission: how its run ended, and what is found in it.

use scene::Scene;
use scene::trace::State;

use crate::explanation::Explanation;
use crate::steps::WrongSteps;

/// A judged scene.
pub struct JudgedScene<'a> {
    /// Its name in findings.
    pub name: &'a str,
    /// The scene.
    pub scene: &'a Scene,
    /// Whether it is required.
    pub is_required: bool,
    /// How its run ended; where it was not run, how those before it did.
    pub outcome: Outcome,
    /// Whether it was run.
    pub was_run: bool,
    /// The first number out of tolerance, if there is one.
    pub first_wrong: Option<FirstWrong<'a>>,
    /// The largest differences from the oracle's trace: position, velocity.
    pub largest: [f64; 2],
    /// Whether the trace has no velocities; those of `states` are differences of positions.
    pub has_positions_alone: bool,
    /// Whether its steps satisfy the right equations, with another solution.
    pub has_other_root: bool,
    /// For each state, the differences between correct programs: position, velocity. Zero where they are not known.
    pub envelope: Vec<[f64; 2]>,
    /// The finite states of its trace; empty if they were not recorded.
    pub states: &'a [State],
}

#[cfg(test)]
impl<'a> JudgedScene<'a> {
    /// A required scene whose numbers are wrong.
    pub(super) fn wrong(name: &'a str, scene: &'a Scene, states: &'a [State]) -> Self {
        Self {
            name,
            scene,
            is_required: true,
            outcome: Outcome::Differs,
            was_run: true,
            first_wrong: None,
            largest: [1.0; 2],
            has_positions_alone: false,
            has_other_root: false,
            envelope: Vec::new(),
            states,
        }
    }
}

/// How the run of a scene ended. The form of a trace is judged before its numbers.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// The trace is right.
    Passed,
    /// It was not run or not judged.
    NotJudged,
    /// The program says that it lacks a feature of the scene: its name, if the program names it.
    Refused(Option<String>),
    /// A folder of traces has none of this scene.
    Missing,
    /// There is no program.
    NotBuilt,
    /// The program failed: the message of the error that it did not catch, if it printed one.
    Crashed(Option<String>),
    /// The program ended with an error message: its first line.
    Stopped(String),
    /// The program exceeded its time limit.
    TimedOut,
    /// The program exceeded its memory limit.
    OutOfMemory,
    /// There is no trace.
    NoTrace,
    /// The program exceeded an output limit.
    TooMuchOutput,
    /// The trace is not in its format: what is wrong, in words.
    Malformed(String),
    /// A row or the header of the trace has another number of fields.
    Fields {
        /// The number that it should have.
        expected: usize,
        /// The number that it has.
        found: usize,
    },
    /// The step of the first row of the trace is 1, not 0.
    StartsAtOne,
    /// The times of the trace count by this time step, which is not the scene's.
    OtherTimes(f64),
    /// The trace holds an infinity or a NaN in the state of this number.
    NotFinite(u64),
    /// The trace ends early: the states that it holds, and those that it should hold.
    TooShort {
        /// The states that it holds.
        states: u64,
        /// The states that it should hold.
        expected: u64,
    },
    /// The trace continues after the last state.
    TooLong,
    /// Its numbers are out of tolerance.
    Differs,
}

/// The first wrong number of a trace.
#[derive(Debug, Clone, Copy)]
pub struct FirstWrong<'a> {
    /// Number of the state: 0 is the initial one.
    pub step: u64,
    /// Particle, from 0.
    pub particle: usize,
    /// The particle in the states around it.
    pub context: &'a [ContextRow],
}

/// A particle in one state, in the oracle's trace and in the graded one.
#[derive(Debug, Clone, PartialEq)]
pub struct ContextRow {
    /// Step number of the state.
    pub step: u64,
    /// The oracle's position, then velocity.
    pub expected: Vec<f64>,
    /// The same numbers of the graded trace.
    pub got: Vec<f64>,
}

/// The findings in a scene.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Found {
    /// The diagnosis, if the trace differs.
    pub diagnosis: Option<Diagnosis>,
    /// The feature that the program lacks, in words, if its trace shows that.
    pub lacks: Option<String>,
}

/// The diagnosis of a trace that differs.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnosis {
    /// The steps that are wrong by themselves.
    pub steps: WrongSteps,
    /// The findings that explain them, in words.
    pub causes: Vec<String>,
    /// Number of the first implicit step that satisfies its own equation and differs, from 1.
    pub other_root: Option<u64>,
    /// Steps redone from the oracle's states; `None` without a program, or for scenes where it is impossible.
    pub restarts: Option<Restarts>,
    /// The first wrong step in numbers; `None` if no step is wrong.
    pub explanation: Option<Explanation>,
}

/// The result of restarted steps.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Restarts {
    /// The restarted steps, counted from 1.
    pub made: Vec<u64>,
    /// The steps among them that are wrong, or that failed.
    pub wrong: Vec<u64>,
}

impl Restarts {
    /// The description.
    pub fn words(&self) -> String {
        let list =
            |steps: &[u64]| steps.iter().map(u64::to_string).collect::<Vec<String>>().join(", ");
        let Self { made, wrong } = self;
        match wrong.as_slice() {
            [] => format!("steps {} are right", list(made)),
            wrong if wrong.len() == made.len() => format!("steps {} are wrong", list(wrong)),
            wrong => format!("of steps {}, these are wrong: {}", list(made), list(wrong)),
        }
    }
}
