//! A submission folder with `submission.toml`: its build and its run command.
//!
//! ```toml
//! name = "Ada"                                       # optional, as is `build`
//! build = ["make"]
//! run = ["./simulate", "{scene}", "-o", "{trace}"]
//! serve = ["./simulate", "--serve"]                  # optional; many scenes in one run
//! format = "csv"                                     # or "fosssim", the course's binary
//! assignment = "t1m3"                                # optional; the assignment to grade
//! ```
//!
//! `{scene}` and `{trace}` are the files of a run, `{folder}` is the submission's own. `{solver}` is `dense` or `sparse`, as
//! the assignment says. A program name with a `/` is
//! relative to that folder; any other is searched in the system's folders. The submission itself is never written to:
//! it is built and run in a copy.

use std::fs;
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use scene::trace::TraceFormat;
use serde::Deserialize;

use super::hand_in::{HandIn, HandInError};
use super::program::{CommandLine, HOME, Program, Runner, Serving, failure_of_run};
use crate::boundary::door::Door;
use crate::boundary::printed::{RawUse, Untrusted};
use crate::verdict::{BuildFailure, Failure};
use sandbox::scratch::{Scratch, scratch_folder};
use sandbox::{End, Job, Keep, Limits, SandboxError};

/// The manifest's file name.
pub const MANIFEST: &str = "submission.toml";

/// The content of a manifest.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SubmissionManifest {
    name: Option<Untrusted>,
    build: Option<Vec<String>>,
    run: Vec<String>,
    serve: Option<Vec<String>>,
    #[serde(default)]
    format: ManifestFormat,
    assignment: Option<Untrusted>,
}

/// The format of a program's traces.
#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub(crate) enum ManifestFormat {
    /// CSV.
    #[default]
    Csv,
    /// The course's binary.
    Fosssim,
}

/// How a program is built and called.
#[derive(Debug)]
pub(crate) struct Recipe {
    /// Commands that build it, one after the other.
    pub(crate) build: Vec<Vec<String>>,
    /// The command that runs it.
    pub(crate) run: Vec<String>,
    /// The command that serves many scenes, if there is one.
    pub(crate) serve: Option<Vec<String>>,
    /// The format of its traces.
    pub(crate) format: ManifestFormat,
}

/// A folder that cannot be graded.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// Its files cannot be read, or exceed a limit.
    #[error("{}: {error}", path.display())]
    HandIn {
        /// The folder.
        path: PathBuf,
        /// The fault.
        error: HandInError,
    },
    /// The manifest is not valid.
    #[error("{}:{line}: {}", path.display(), message.text())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// The fault; it may quote the file.
        message: Untrusted,
    },
    /// The copy for the build cannot be made.
    #[error("no folder for the build: {0}")]
    NotCopied(io::Error),
    /// The build could not be run.
    #[error(transparent)]
    NotRun(#[from] SandboxError),
}

/// Result of opening a folder.
#[derive(Debug)]
pub enum Built {
    /// A program.
    Program(Program),
    /// The build failed.
    Failed {
        /// The submission's name in reports.
        name: Untrusted,
        /// The build's failure.
        failure: Failure,
    },
}

/// Whether the folder contains an entry with the manifest's name.
pub fn is_submission(folder: &Path) -> bool {
    let found = fs::symlink_metadata(folder.join(MANIFEST));
    found.map_or_else(|error| error.kind() != io::ErrorKind::NotFound, |_| true)
}

/// Reads the manifest and runs the build, if any, under the runner's protection. The submission is called `name` if the
/// manifest gives it no name.
///
/// # Errors
/// If the manifest is not valid, or the build could not be run. A build that fails is not an error.
pub fn open(
    folder: &Path,
    name: &Untrusted,
    runner: Runner,
    build_limits: Limits,
) -> Result<Built, FolderError> {
    let refused = |error| FolderError::HandIn { path: folder.to_path_buf(), error };
    let manifest = SubmissionManifest::read(folder)?;
    let files = HandIn::open(&home_of(folder)).map_err(refused)?;
    // The sandbox's own user may lack permission to read the original. No report depends on the original's path.
    let copy = scratch_folder().map_err(FolderError::NotCopied)?;
    files.copy_to(&copy.path().join(HOME)).map_err(refused)?;
    let build = manifest.build.into_iter().collect();
    let SubmissionManifest { run, serve, format, .. } = manifest;
    let recipe = Recipe { build, run, serve, format };
    self::build(manifest.name.as_ref().unwrap_or(name), copy, &recipe, runner, build_limits)
}

/// Builds what lies in the folder [`HOME`] of a scratch folder, under the runner's protection.
///
/// # Errors
/// If the build could not be run. A build that fails is not an error.
pub(crate) fn build(
    name: &Untrusted,
    copy: Scratch,
    recipe: &Recipe,
    mut runner: Runner,
    limits: Limits,
) -> Result<Built, FolderError> {
    let home = copy.path().join(HOME);
    for (number, command) in recipe.build.iter().enumerate() {
        // Built before, and shown as such; without a program, its hidden scenes fail by themselves.
        if let Err(failure) = run_build((number, command), &home, &runner, limits)? {
            if runner.is_second_phase() {
                break;
            }
            return Ok(Built::Failed { name: name.clone(), failure });
        }
    }
    runner.readable.push(home.clone());
    let call = |command: &Vec<String>| CommandLine::of(command, &home).in_folder(&home);
    let CommandLine { program, arguments } = call(&recipe.run);
    let serving = recipe.serve.as_ref().map(call);
    let serving = serving.map(|serve| Arc::new(Serving::new(serve)));
    let format = match recipe.format {
        ManifestFormat::Csv => TraceFormat::Csv,
        ManifestFormat::Fosssim => TraceFormat::Fosssim,
    };
    let (name, copy) = (name.clone(), Some(Arc::new(copy)));
    Ok(Built::Program(Program {
        name,
        path: program,
        arguments,
        serving,
        format,
        runner,
        copy,
        taken: None,
    }))
}

/// The assignment that the manifest names; `None` if it names none.
///
/// # Errors
/// If the manifest cannot be read, or is not valid.
pub fn assignment_of(folder: &Path) -> Result<Option<Untrusted>, FolderError> {
    Ok(SubmissionManifest::read(folder)?.assignment)
}

fn home_of(folder: &Path) -> PathBuf {
    scene::input::real_path(folder).unwrap_or_else(|_| folder.to_path_buf())
}

impl SubmissionManifest {
    fn read(folder: &Path) -> Result<Self, FolderError> {
        let path = folder.join(MANIFEST);
        let refused = |error| {
            let error = HandInError::of_door(MANIFEST, error);
            FolderError::HandIn { path: folder.to_path_buf(), error }
        };
        Self::parse(&Door::Manifest.text(&path).map_err(refused)?, &path)
    }

    /// Parses a manifest. `path` is its name in messages.
    ///
    /// # Errors
    /// If it is not valid.
    pub fn parse(text: &Untrusted, path: &Path) -> Result<Self, FolderError> {
        let text = text.raw(RawUse::Parsing);
        let invalid = |line: usize, message: String| FolderError::Invalid {
            path: path.to_path_buf(),
            line,
            message: message.into(),
        };
        let manifest: Self = toml::from_str(text).map_err(|error| {
            let span = error.span().unwrap_or_default();
            let start = span.start.min(text.len());
            let message = not_a_list(text, span).unwrap_or_else(|| error.message().to_owned());
            invalid(1 + text[..start].matches('\n').count(), message)
        })?;
        let check = |key, command: &Option<Vec<String>>| {
            command.as_ref().map_or(Ok(()), |command| check_command(key, command))
        };
        check("build", &manifest.build)
            .and_then(|()| check("serve", &manifest.serve))
            .and_then(|()| check_run("run", &manifest.run))
            .map_err(|message| invalid(1, message))?;
        Ok(manifest)
    }
}

/// The correction, if a command at this place is one text instead of a list of words.
fn not_a_list(text: &str, place: Range<usize>) -> Option<String> {
    let (before, value) = (text.get(..place.start)?, text.get(place)?);
    let key = before.lines().last()?.trim_end_matches(['=', ' ']).trim();
    let command = value.strip_prefix('"')?.strip_suffix('"')?;
    let words: Vec<String> = command.split_whitespace().map(|word| format!("\"{word}\"")).collect();
    let is_command = ["build", "run", "serve"].contains(&key);
    let list = words.join(", ");
    is_command.then(|| format!("{key} is a list of words\n  help: write {key} = [{list}]"))
}

/// Checks that the command with this key names a program.
///
/// # Errors
/// A message, if not.
pub(crate) fn check_command(key: &str, command: &[String]) -> Result<(), String> {
    if command.first().is_none_or(String::is_empty) {
        return Err(format!("{key} names no program\n  help: {key} = [\"./program\", …]"));
    }
    Ok(())
}

/// Checks the command that runs a program.
///
/// # Errors
/// A message, if it names no program, scene or trace.
pub(crate) fn check_run(key: &str, command: &[String]) -> Result<(), String> {
    check_placeholders(key, command, ["{scene}", "{trace}"])
}

/// Checks a command that reads one file and writes another.
///
/// # Errors
/// A message, if it names no program, or one of these files is missing.
pub(crate) fn check_placeholders(
    key: &str,
    command: &[String],
    files: [&str; 2],
) -> Result<(), String> {
    check_command(key, command)?;
    let [input, output] = files;
    for placeholder in files {
        if !command.iter().any(|argument| argument.contains(placeholder)) {
            return Err(format!(
                "{key} holds no {placeholder}\n  help: {key} = [\"./simulate\", \"{input}\", \"-o\", \
                 \"{output}\"]"
            ));
        }
    }
    Ok(())
}

/// Runs the build's command of this number. The copy of the folder before it is removed with the scratch folder.
fn run_build(
    (number, build): (usize, &[String]),
    home: &Path,
    runner: &Runner,
    limits: Limits,
) -> Result<Result<(), Failure>, FolderError> {
    let built = home.with_file_name("built");
    let CommandLine { program, arguments } = CommandLine::of(build, home);
    let job = Job {
        program,
        arguments: arguments.into_iter().map(Into::into).collect(),
        folder: home.to_path_buf(),
        input: None,
        keep: Keep::Tree(built.clone()),
        readable: runner.readable.clone(),
        limits,
    };
    let outcome = runner.sandbox.run(&job)?;
    if outcome.end != End::Exited(0) {
        let failure = failure_of_run(&outcome, &job, &runner.sandbox);
        return Ok(Err(Failure::BuildFailed(BuildFailure::Run(failure))));
    }
    if let Err(reason) = outcome.kept {
        return Ok(Err(Failure::BuildFailed(BuildFailure::NotKept(reason))));
    }
    fs::rename(home, home.with_file_name(format!("unbuilt{number}")))
        .and_then(|()| fs::rename(&built, home))
        .map_err(SandboxError::no_scratch)?;
    Ok(Ok(()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_in_one_text_is_shown_as_a_list() {
        let refused = |text: &str| {
            let parsed = SubmissionManifest::parse(&text.into(), Path::new(MANIFEST));
            parsed.unwrap_err().to_string()
        };
        let run = "run = [\"./a\", \"{scene}\", \"{trace}\"]\n";
        let help =
            "submission.toml:2: build is a list of words\n  help: write build = [\"make\", \"-j\"]";
        assert_eq!(refused(&format!("{run}build = \"make -j\"\n")), help);
        let help = "help: write run = [\"./a\", \"{scene}\"]";
        assert!(refused("run=\"./a {scene}\"").ends_with(help));
        assert!(refused(&format!("{run}format = \"xml\"\n")).contains("unknown variant"));
    }

    #[test]
    fn control_characters_of_quoted_manifests_are_replaced() {
        let text = "\"\\u001b[2J\" = 1\nrun = [\"./a\"]\n";
        let error =
            SubmissionManifest::parse(&text.into(), Path::new(MANIFEST)).unwrap_err().to_string();
        assert!(error.contains("`\u{fffd}[2J`"), "{error:?}");
    }
}
