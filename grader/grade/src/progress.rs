//! Progress line on the terminal.

use std::io::{self, IsTerminal};
use std::sync::{Mutex, MutexGuard, PoisonError};

use grader::grading::events::{Event, Observer, Task};

use crate::bar::Bar;
use crate::interrupt::Interrupt;
use crate::terminal::inert;

/// The progress line; removed from the terminal on drop.
pub(super) struct Progress {
    /// `None` if no line is shown.
    bar: Option<Bar>,
    state: Mutex<ProgressState>,
    interrupt: Interrupt,
}

/// The content of the line.
#[derive(Default)]
struct ProgressState {
    /// Number, total, name.
    submission: Option<(usize, usize, String)>,
    task: Option<Task>,
    done: usize,
    /// Failed shipped scenes; still shown while other tasks run.
    failed: usize,
    /// In the order in which they were started.
    running: Vec<String>,
}

impl Progress {
    /// A progress line; invisible unless `wanted`, standard error is a terminal, and this is not CI.
    pub(super) fn new(wanted: bool, interrupt: Interrupt) -> Self {
        let variable = |name: &str| std::env::var(name).unwrap_or_default();
        let is_seen = io::stderr().is_terminal()
            && variable("TERM") != "dumb"
            && ["", "0", "false"].contains(&variable("CI").as_str());
        let bar = (wanted && is_seen).then(|| {
            let bar = Bar::new("[{elapsed_precise}] {wide_msg}");
            bar.tick();
            bar
        });
        Self { bar, state: Mutex::default(), interrupt }
    }

    /// Shows this text.
    pub(super) fn show(&self, text: &str) {
        if let Some(bar) = &self.bar {
            bar.say(inert(text));
        }
    }

    /// Removes the line, before output.
    pub(super) fn clear(&self) {
        if let Some(bar) = &self.bar {
            bar.clear();
        }
    }

    fn state(&self) -> MutexGuard<'_, ProgressState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Observer for Progress {
    fn notice(&self, event: Event<'_>) {
        let Some(bar) = &self.bar else { return };
        let mut state = self.state();
        state.take(event);
        bar.say(inert(&state.line()));
    }

    fn is_stopped(&self) -> bool {
        self.interrupt.is_requested()
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.clear();
    }
}

impl ProgressState {
    fn take(&mut self, event: Event<'_>) {
        let called = |name: Option<&str>| name.unwrap_or("hidden").to_owned();
        match event {
            Event::Submission { name, number, total } => {
                *self =
                    Self { submission: Some((number, total, name.to_owned())), ..Self::default() };
            }
            Event::Task(task) => {
                self.task = Some(task);
                self.running.clear();
                match task {
                    Task::Scenes(_) => (self.done, self.failed) = (0, 0),
                    Task::HiddenScenes(_) => self.done = 0,
                    Task::Opening
                    | Task::Jacobians
                    | Task::Repetition
                    | Task::Probe
                    | Task::Altered
                    | Task::Functions => {}
                }
            }
            Event::SceneStarted { name } => self.running.push(called(name)),
            Event::SceneFinished { name, passed } => {
                self.done += 1;
                self.failed += usize::from(!passed);
                let name = called(name);
                if let Some(place) = self.running.iter().position(|running| *running == name) {
                    self.running.remove(place);
                }
            }
        }
    }

    /// The text of the line, the most important part first: a narrow terminal cuts off the rest.
    fn line(&self) -> String {
        let mut line = String::new();
        if let Some((number, total, name)) = &self.submission {
            line += &format!("{number}/{total} {name}: ");
        }
        let Some(task) = self.task else { return line };
        line += &match task {
            Task::Opening => "opening the submission".to_owned(),
            Task::Jacobians => "checking Jacobians".to_owned(),
            Task::Scenes(total) => format!("{}/{total} scenes", self.done),
            Task::Repetition => "running some scenes twice".to_owned(),
            Task::Probe => "measuring Jacobians".to_owned(),
            Task::Altered => "running altered scenes".to_owned(),
            Task::Functions => "calling functions".to_owned(),
            Task::HiddenScenes(total) => format!("{}/{total} hidden scenes", self.done),
        };
        if self.failed > 0 {
            line += &format!(", {} failed", self.failed);
        }
        if let Task::Scenes(_) = task
            && !self.running.is_empty()
        {
            line += &format!(": {}", self.running.join(", "));
        }
        line
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_line_names_running_scenes_but_no_hidden_scene() {
        let mut state = ProgressState::default();
        let mut line = |event| {
            state.take(event);
            state.line()
        };
        let [a, b] = [Some("a"), Some("b")];
        assert_eq!(line(Event::Task(Task::Scenes(2))), "0/2 scenes");
        assert_eq!(line(Event::SceneStarted { name: a }), "0/2 scenes: a");
        assert_eq!(line(Event::SceneStarted { name: b }), "0/2 scenes: a, b");
        let finished = |name, passed| Event::SceneFinished { name, passed };
        assert_eq!(line(finished(a, false)), "1/2 scenes, 1 failed: b");
        assert_eq!(line(finished(b, true)), "2/2 scenes, 1 failed");
        assert_eq!(line(Event::Task(Task::Probe)), "measuring Jacobians, 1 failed");
        line(Event::Task(Task::HiddenScenes(3)));
        let hidden = line(Event::SceneStarted { name: None });
        assert_eq!(hidden, "0/3 hidden scenes, 1 failed");
        let next = Event::Submission { name: "ada", number: 2, total: 9 };
        assert_eq!(line(next), "2/9 ada: ");
    }
}
