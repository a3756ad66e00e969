//! A step of GitHub Actions: its summary, and the commands in what it prints.

use std::fs::OpenOptions;
use std::hash::{BuildHasher, Hasher};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use grader::grading::Grading;
use platforms::github::{annotations, commands_off, commands_on, summary};

use crate::output::print_commands;
use crate::stop::Stop;

/// A step, during which nothing that is printed is a command.
pub(super) struct Actions {
    /// The file of the job's summary.
    summary: PathBuf,
    /// Ends the time without commands.
    token: String,
}

impl Actions {
    /// Begins a step: from now on, what a program prints gives no commands.
    ///
    /// # Errors
    /// If the environment is not that of GitHub Actions.
    pub(super) fn begin() -> Result<Self, Stop> {
        let file = |name: &str| {
            std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from).ok_or_else(|| {
                Stop::bad_input(format!(
                    "{name} is not set, so this is no step of GitHub Actions\n  help: leave out --report github"
                ))
            })
        };
        let summary = file("GITHUB_STEP_SUMMARY")?;
        // The standard library's hashers have random keys.
        let random = || std::hash::RandomState::new().build_hasher().finish();
        let token = format!("{:016x}{:016x}", random(), random());
        print_commands(&commands_off(&token))?;
        Ok(Self { summary, token })
    }

    /// Ends the step with the summary and the annotations of a grading.
    pub(super) fn end(&self, grading: &Grading, details: usize) -> Result<(), Stop> {
        let summary = summary::render(grading, details).map_err(Stop::fault)?;
        self.write(&summary, &annotations::render(grading))
    }

    /// Ends the step of a submission that was not graded.
    pub(super) fn end_not_graded(&self, reason: &str) -> Result<(), Stop> {
        self.write(&summary::not_graded(reason), &annotations::not_graded(reason))
    }

    fn write(&self, summary: &str, annotations: &str) -> Result<(), Stop> {
        append(&self.summary, summary)?;
        print_commands(&(commands_on(&self.token) + annotations))
    }
}

/// Appends to a file of the step, which other programs of the step write too.
fn append(path: &Path, text: &str) -> Result<(), Stop> {
    let appended = || -> io::Result<()> {
        let mut file = OpenOptions::new().append(true).create(true).open(path)?;
        file.write_all(text.as_bytes())
    };
    appended().map_err(|error| Stop::bad_input(format!("{}: {error}", path.display())))
}
