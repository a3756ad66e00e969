//! What is graded: something that yields, for each scene, a stream of states.

pub mod folder;
pub mod hand_in;
pub mod program;

pub mod builtin;
mod traces;

use std::path::PathBuf;

use simulator::solver::linear::LinearSolver;
use simulator::trace::{Shape, State, TraceError, TraceReader};

use crate::suite::Case;
use crate::verdict::{Failure, Fault, Verdict};
use program::{Program, SceneSource};

/// A submission.
#[derive(Debug, Clone)]
pub enum Submission {
    /// This project's own simulator, with these linear solvers.
    BuiltIn(LinearSolver),
    /// A folder with a trace a scene.
    Traces(PathBuf),
    /// A program.
    Program(Program),
    /// A program that cannot be built, or writes no trace of the simplest scene.
    Unusable {
        /// What reports call it.
        name: String,
        /// How.
        failure: Failure,
    },
    /// Something that could not be graded, through no fault of its own.
    NotGraded {
        /// What reports call it.
        name: String,
        /// Why.
        detail: String,
    },
}

impl Submission {
    /// What reports call it.
    pub fn name(&self) -> String {
        match self {
            Self::BuiltIn(_) => "built-in simulator".to_owned(),
            Self::Traces(folder) => folder.display().to_string(),
            Self::Program(program) => program.name().to_owned(),
            Self::Unusable { name, .. } | Self::NotGraded { name, .. } => name.clone(),
        }
    }

    /// The states it has for this scene.
    ///
    /// # Errors
    /// Where it has none, or that cannot be found out.
    pub fn states(&self, case: &Case) -> Result<Box<dyn StateSource>, Verdict> {
        match self {
            Self::BuiltIn(solver) => Ok(builtin::start(&case.scene, *solver)),
            Self::Traces(folder) => traces::open(folder, case).map_err(Verdict::Fail),
            Self::Unusable { failure, .. } => Err(Verdict::Fail(failure.clone())),
            Self::NotGraded { detail, .. } => {
                Err(Verdict::GraderFault(Fault::NotRun { detail: detail.clone() }))
            }
            Self::Program(program) => {
                let shape = Shape::of(&case.scene);
                Ok(Box::new(program.run(SceneSource::Case(case), shape)?))
            }
        }
    }
}

/// States that are judged.
pub trait StateSource {
    /// Puts the next state into `state`; false where there is none.
    ///
    /// # Errors
    /// Where there is something else in its place.
    fn read(&mut self, state: &mut State) -> Result<bool, Failure>;

    /// Where the state read last stands: a file, and a place in it. `None` where it is in no file.
    fn location(&self) -> Option<String> {
        None
    }
}

impl StateSource for Box<dyn TraceReader> {
    fn read(&mut self, state: &mut State) -> Result<bool, Failure> {
        self.as_mut().read(state).map_err(failure_of)
    }
}

fn failure_of(error: TraceError) -> Failure {
    let detail = error.to_string();
    match error {
        TraceError::Unreadable { .. } => {
            Failure::NoOutput { detail: format!("there is no trace: {detail}") }
        }
        TraceError::Line { .. } | TraceError::Record { .. } => Failure::Malformed { detail },
    }
}
