//! The scenes of a run: ends it after some failures, and measures how long each scene takes.

use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use grader::grading::events::{Event, Observer};
use report::SceneTimes;

/// Passes events on, counts failures and measures times.
pub(super) struct Scenes<'a> {
    next: &'a dyn Observer,
    /// Number of failed scenes after which the run ends.
    fail_fast: Option<usize>,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    /// The names of those that failed.
    failed: Vec<String>,
    started: HashMap<String, Instant>,
    finished: SceneTimes,
}

impl<'a> Scenes<'a> {
    pub(super) fn new(next: &'a dyn Observer, fail_fast: Option<usize>) -> Self {
        Self { next, fail_fast, state: Mutex::default() }
    }

    /// Whether so many scenes failed that the run ended.
    pub(super) fn has_ended(&self) -> bool {
        self.fail_fast.is_some_and(|limit| self.state().failed.len() >= limit)
    }

    /// The names of the scenes that failed, in the order in which they ended.
    pub(super) fn failed(&self) -> Vec<String> {
        self.state().failed.clone()
    }

    /// How long the finished scenes took.
    pub(super) fn times(&self) -> SceneTimes {
        self.state().finished.clone()
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
                state.failed.extend((!passed).then(|| name.to_owned()));
                if let Some(start) = state.started.remove(name) {
                    state.finished.insert(name.to_owned(), start.elapsed());
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

/// The scenes that took longest, with their times; the slowest first.
pub(super) fn slowest(times: &SceneTimes, count: usize) -> Vec<(Duration, &str)> {
    let mut slowest: Vec<_> = times.iter().map(|(name, time)| (*time, name.as_str())).collect();
    slowest.sort_by(|a, b| b.cmp(a));
    slowest.truncate(count);
    slowest
}
