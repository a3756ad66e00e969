//! The scenes of a run: ends it after some failures, and measures how long each scene takes.

use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use grader::events::{Event, Observer};

/// Passes events on, counts failures and measures times.
pub(super) struct Scenes<'a> {
    next: &'a dyn Observer,
    /// Number of failed scenes after which the run ends.
    fail_fast: Option<usize>,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    failed: usize,
    started: HashMap<String, Instant>,
    finished: Vec<(Duration, String)>,
}

impl<'a> Scenes<'a> {
    pub(super) fn new(next: &'a dyn Observer, fail_fast: Option<usize>) -> Self {
        Self { next, fail_fast, state: Mutex::default() }
    }

    /// Whether so many scenes failed that the run ended.
    pub(super) fn has_ended(&self) -> bool {
        self.fail_fast.is_some_and(|limit| self.state().failed >= limit)
    }

    /// The scenes that took longest, with their times; the slowest first.
    pub(super) fn slowest(&self, count: usize) -> Vec<(Duration, String)> {
        let mut finished = self.state().finished.clone();
        finished.sort_by(|a, b| b.cmp(a));
        finished.truncate(count);
        finished
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Observer for Scenes<'_> {
    fn notice(&self, event: Event<'_>) {
        match event {
            Event::SceneStarted { name: Some(name) } => {
                self.state().started.insert(name.to_owned(), Instant::now());
            }
            Event::SceneFinished { name: Some(name), passed } => {
                let mut state = self.state();
                state.failed += usize::from(!passed);
                if let Some(start) = state.started.remove(name) {
                    state.finished.push((start.elapsed(), name.to_owned()));
                }
            }
            _ => {}
        }
        self.next.notice(event);
    }

    fn is_stopped(&self) -> bool {
        self.has_ended() || self.next.is_stopped()
    }
}
