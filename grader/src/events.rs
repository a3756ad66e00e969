//! Events of a grading run, sent to an observer as they happen.
//!
//! An [`Observer`] can end a run early, between two scenes, and change nothing else of its result. Events of scenes that
//! run at the same time come in any order.

/// Something that happens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event<'a> {
    /// Another submission's turn begins.
    Submission {
        /// What it is called.
        name: &'a str,
        /// Its number, from 1.
        number: usize,
        /// How many there are.
        total: usize,
    },
    /// Something begins; what was before has ended.
    Task(Task),
    /// A scene is run.
    SceneStarted {
        /// Its name; `None` where it is hidden.
        name: Option<&'a str>,
    },
    /// A scene has its verdict.
    SceneFinished {
        /// Its name; `None` where it is hidden.
        name: Option<&'a str>,
        /// Whether it passed.
        passed: bool,
    },
}

/// A part of grading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Task {
    /// The submission is built, or it is found out how it is called.
    Opening,
    /// The built-in simulator's Jacobians are checked.
    Jacobians,
    /// So many scenes are run.
    Scenes(usize),
    /// Some scenes are run twice.
    Repetition,
    /// The program's forces and Jacobians are measured.
    Probe,
    /// Shipped scenes are run, altered a little.
    Altered,
    /// So many hidden scenes are run.
    HiddenScenes(usize),
}

/// Receives events.
pub trait Observer: Sync {
    /// Receives an event, on the thread on which it happens.
    fn notice(&self, event: Event<'_>);

    /// Whether the run is to end early. Scenes that have not ended by then are not graded.
    fn is_stopped(&self) -> bool {
        false
    }
}

/// Ignores all events.
impl Observer for () {
    fn notice(&self, _event: Event<'_>) {}
}
