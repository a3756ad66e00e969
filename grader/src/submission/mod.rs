//! Submissions: sources of a stream of states for each scene.

pub mod budget;
pub mod folder;
pub mod hand_in;
pub mod init;
pub mod kept;
pub mod program;
pub mod received;
pub mod serving;

pub mod builtin;
mod traces;

use std::path::{Path, PathBuf};

use scene::trace::{Shape, State, TraceReader};
use simulator::solver::linear::LinearSolver;

use crate::boundary::printed::Untrusted;
use crate::suite::Case;
use crate::verdict::{Failure, Fault, Verdict};
use program::{Program, SceneSource};
use received::Received;

/// A submission.
#[derive(Debug, Clone)]
pub enum Submission {
    /// This project's own simulator, with this linear solver.
    BuiltIn(LinearSolver),
    /// A folder with one trace a scene.
    Traces {
        /// The submission's name in reports.
        name: Untrusted,
        /// The folder.
        folder: PathBuf,
        /// The unpacked archive that it lies in, if any.
        received: Option<Received>,
    },
    /// A program.
    Program(Program),
    /// A program that cannot be built, or that writes no trace of the simplest scene.
    Unusable {
        /// The submission's name in reports.
        name: Untrusted,
        /// Its failure.
        failure: Failure,
    },
    /// A submission that the grader or its machine could not grade.
    NotGraded {
        /// Its name in reports.
        name: Untrusted,
        /// Why.
        detail: String,
    },
}

impl Submission {
    /// The traces in this folder.
    pub fn traces(folder: &Path) -> Self {
        Self::Traces { name: folder.into(), folder: folder.to_path_buf(), received: None }
    }

    /// The submission's name in reports.
    pub fn name(&self) -> Untrusted {
        match self {
            Self::BuiltIn(_) => "built-in simulator".into(),
            Self::Program(program) => program.name().clone(),
            Self::Traces { name, .. }
            | Self::Unusable { name, .. }
            | Self::NotGraded { name, .. } => name.clone(),
        }
    }

    /// The submission, with a budget of time for its runs if it has none yet.
    pub(crate) fn with_budget(&self) -> Self {
        match self {
            Self::Program(program) => Self::Program(program.with_budget()),
            other => other.clone(),
        }
    }

    /// The submission, for runs of which nothing is shown: they are not those of its first phase.
    pub(crate) fn beyond_first_phase(&self) -> Self {
        match self {
            Self::Program(program) => Self::Program(program.beyond_first_phase()),
            other => other.clone(),
        }
    }

    /// The submission's states for this scene.
    ///
    /// # Errors
    /// If there are none, or the grader cannot run the submission.
    pub fn states(&self, case: &Case) -> Result<Box<dyn StateSource>, Verdict> {
        match self {
            Self::BuiltIn(solver) => Ok(builtin::start(&case.scene, *solver)),
            Self::Traces { folder, .. } => traces::open(folder, case).map_err(Verdict::Fail),
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

/// A stream of states to be judged.
pub trait StateSource: Send {
    /// Reads the next state into `state`. Returns false at the end.
    ///
    /// # Errors
    /// If the next state is invalid.
    fn read(&mut self, state: &mut State) -> Result<bool, Failure>;

    /// Whether the velocities are the submission's own. Otherwise only positions are compared.
    fn has_velocities(&self) -> bool {
        true
    }

    /// The location of the last state: a file and a place in it. `None` if it is not in a file.
    fn location(&self) -> Option<String> {
        None
    }
}

impl StateSource for Box<dyn TraceReader> {
    fn read(&mut self, state: &mut State) -> Result<bool, Failure> {
        self.as_mut().read(state).map_err(Failure::of_trace)
    }

    fn has_velocities(&self) -> bool {
        self.as_ref().has_velocities()
    }
}
