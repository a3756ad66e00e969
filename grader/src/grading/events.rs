//! Events of a grading run, sent to an observer as they happen.
//!
//! An [`Observer`] can end a run early, between two scenes, and change nothing else of its result. Events of scenes that
//! run at the same time come in any order.

/// An event of a grading run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event<'a> {
    /// Grading of another submission begins.
    Submission {
        /// The submission's name.
        name: &'a str,
        /// Its number, from 1.
        number: usize,
        /// Total number of submissions.
        total: usize,
    },
    /// A part of grading begins; the part before it has ended.
    Task(Task),
    /// A scene starts.
    SceneStarted {
        /// The scene's name; `None` where it is hidden.
        name: Option<&'a str>,
    },
    /// A scene has its verdict.
    SceneFinished {
        /// The scene's name; `None` where it is hidden.
        name: Option<&'a str>,
        /// Whether it passed.
        passed: bool,
    },
}

/// A part of grading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Task {
    /// Builds the submission, or finds out its calling convention.
    Opening,
    /// Checks the built-in simulator's Jacobians.
    Jacobians,
    /// Runs this many scenes.
    Scenes(usize),
    /// Repeats some scenes to check that the program is deterministic.
    Repetition,
    /// Measures the program's forces and Jacobians.
    Probe,
    /// Runs altered copies of shipped scenes.
    Altered,
    /// Calls the functions of the hand-in that a pack grades by themselves.
    Functions,
    /// Runs this many hidden scenes.
    HiddenScenes(usize),
}

/// Receives events.
pub trait Observer: Sync {
    /// Receives an event, on the thread on which it happens.
    fn notice(&self, event: Event<'_>);

    /// Whether the run shall end early. Scenes that have not ended by then are not graded.
    fn is_stopped(&self) -> bool {
        false
    }
}

/// Ignores all events.
impl Observer for () {
    fn notice(&self, _event: Event<'_>) {}
}
