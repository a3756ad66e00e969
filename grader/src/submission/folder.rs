//! A folder with `submission.toml`: what is built, and how it is run.
//!
//! ```toml
//! name = "Ada"                                       # may be left out, as may `build`
//! build = ["make"]
//! run = ["./simulate", "{scene}", "-o", "{trace}"]
//! format = "csv"                                     # or "fosssim", the course's binary
//! ```
//!
//! `{scene}` and `{trace}` are the files of a run, `{folder}` is the submission's own. A program with a `/` in
//! its name is looked for in that folder, any other where the system keeps its own. The folder itself is not
//! written to: a build works on a copy.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Deserialize;
use simulator::trace::TraceFormat;
use tempfile::TempDir;

use super::printed;
use super::program::{Program, Runner, failure_of_run};
use crate::sandbox::scratch::scratch_folder;
use crate::sandbox::{End, Job, Keep, Limits, SandboxError};
use crate::suite::read_text;
use crate::verdict::Failure;

/// What the file is called.
pub const MANIFEST: &str = "submission.toml";

/// The largest manifest that is read, in MiB.
const MAX_MEBIBYTES: u64 = 1;

/// The largest folder that is copied for a build, in bytes.
const MAX_COPY: u64 = 1 << 30;

/// In commands: the submission's folder.
const FOLDER: &str = "{folder}";

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Manifest {
    name: Option<String>,
    build: Option<Vec<String>>,
    run: Vec<String>,
    #[serde(default)]
    format: Format,
}

#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Format {
    #[default]
    Csv,
    Fosssim,
}

/// A folder that cannot be graded.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// The manifest cannot be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The manifest does not say what it has to.
    #[error("{}:{line}: {message}", path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What is wrong.
        message: String,
    },
    /// There is no copy to build.
    #[error("{}: cannot be copied to be built: {source}", path.display())]
    NotCopied {
        /// The folder.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The build could not be run.
    #[error(transparent)]
    NotRun(#[from] SandboxError),
}

/// What a folder comes to.
#[derive(Debug)]
pub enum Built {
    /// A program.
    Program(Program),
    /// Its build failed.
    Failed {
        /// What reports call it.
        name: String,
        /// How.
        failure: Failure,
    },
}

/// Whether this folder is such a submission.
pub fn is_submission(folder: &Path) -> bool {
    folder.join(MANIFEST).is_file()
}

/// Reads the manifest, and builds what is to be built, under the runner's protection.
///
/// # Errors
/// Where the manifest says nothing of use, or the build could not be run. A build that fails is no error.
pub fn open(folder: &Path, mut runner: Runner, build_limits: Limits) -> Result<Built, FolderError> {
    let path = folder.join(MANIFEST);
    let unreadable = |source| FolderError::Unreadable { path: path.clone(), source };
    let text = read_text(&path, MAX_MEBIBYTES).map_err(unreadable)?;
    let manifest = Manifest::parse(&text, &path)?;
    let home = fs::canonicalize(folder).map_err(unreadable)?;
    let name = manifest.name.as_deref().map_or_else(
        || folder.display().to_string(),
        // It is the submission's, and stands in every report.
        printed::line,
    );
    let (home, copy) = match &manifest.build {
        None => (home, None),
        Some(build) => {
            let not_copied = |source| FolderError::NotCopied { path: folder.to_path_buf(), source };
            let copy = scratch_folder().map_err(not_copied)?;
            let home = copy.path().join("folder");
            copy_folder(&home_of(folder), &home, &mut 0).map_err(not_copied)?;
            if let Err(failure) = run_build(build, &home, &runner, build_limits)? {
                return Ok(Built::Failed { name, failure });
            }
            (home, Some(Arc::new(copy)))
        }
    };
    runner.readable.push(home.clone());
    let Command { program, arguments } = Command::of(&manifest.run, &home);
    let format = match manifest.format {
        Format::Csv => TraceFormat::Csv,
        Format::Fosssim => TraceFormat::Fosssim,
    };
    Ok(Built::Program(Program::new(name, program, arguments, format, runner, copy)))
}

fn home_of(folder: &Path) -> PathBuf {
    fs::canonicalize(folder).unwrap_or_else(|_| folder.to_path_buf())
}

impl Manifest {
    fn parse(text: &str, path: &Path) -> Result<Self, FolderError> {
        let invalid = |line: usize, message: String| FolderError::Invalid {
            path: path.to_path_buf(),
            line,
            message,
        };
        let manifest: Self = toml::from_str(text).map_err(|error| {
            let start = error.span().map_or(0, |span| span.start).min(text.len());
            invalid(1 + text[..start].matches('\n').count(), error.message().to_owned())
        })?;
        for (key, command) in [("run", Some(&manifest.run)), ("build", manifest.build.as_ref())] {
            if command.is_some_and(|command| command.first().is_none_or(String::is_empty)) {
                let message = format!("{key} names no program\n  help: {key} = [\"./program\", …]");
                return Err(invalid(1, message));
            }
        }
        for placeholder in ["{scene}", "{trace}"] {
            if !manifest.run.iter().any(|argument| argument.contains(placeholder)) {
                let message = format!(
                    "run holds no {placeholder}\n  help: run = [\"./simulate\", \"{{scene}}\", \"-o\", \
                     \"{{trace}}\"]"
                );
                return Err(invalid(1, message));
            }
        }
        Ok(manifest)
    }
}

/// A command with the folder put in.
struct Command {
    program: PathBuf,
    arguments: Vec<String>,
}

impl Command {
    fn of(words: &[String], home: &Path) -> Self {
        let folder = home.to_string_lossy();
        let mut words = words.iter().map(|word| word.replace(FOLDER, &folder));
        let program = words.next().unwrap_or_default();
        // Where there is no `/` in it, the system looks for it; an absolute path stays one.
        let program =
            if program.contains('/') { home.join(&program) } else { PathBuf::from(&program) };
        Self { program, arguments: words.collect() }
    }
}

fn run_build(
    build: &[String],
    home: &Path,
    runner: &Runner,
    limits: Limits,
) -> Result<Result<(), Failure>, FolderError> {
    let built = home.with_file_name("built");
    let Command { program, arguments } = Command::of(build, home);
    let job = Job {
        program,
        arguments: arguments.into_iter().map(Into::into).collect(),
        folder: home.to_path_buf(),
        keep: Keep::Tree(built.clone()),
        readable: runner.readable.clone(),
        limits,
    };
    let outcome = runner.sandbox.run(&job)?;
    let failed = |detail: String| Ok(Err(Failure::BuildFailed { detail }));
    if outcome.end != End::Exited(0) {
        return failed(format!("the build {}", failure_of_run(&outcome, &job)));
    }
    if let Err(reason) = &outcome.kept {
        return failed(format!("the built folder {reason}"));
    }
    let exchange = || {
        fs::remove_dir_all(home)?;
        fs::rename(&built, home)
    };
    exchange().map_err(SandboxError::no_scratch)?;
    Ok(Ok(()))
}

/// Copies a folder; links are copied as links.
fn copy_folder(from: &Path, to: &Path, copied: &mut u64) -> io::Result<()> {
    fs::create_dir(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let (source, target) = (entry.path(), to.join(entry.file_name()));
        // It does not follow links.
        let kind = entry.file_type()?;
        if kind.is_dir() {
            copy_folder(&source, &target, copied)?;
        } else if kind.is_symlink() {
            #[cfg(unix)]
            std::os::unix::fs::symlink(fs::read_link(&source)?, &target)?;
        } else if kind.is_file() {
            *copied += entry.metadata()?.len();
            if *copied > MAX_COPY {
                let message = format!("it holds more than {} MiB", MAX_COPY >> 20);
                return Err(io::Error::new(io::ErrorKind::FileTooLarge, message));
            }
            fs::copy(&source, &target)?;
        }
    }
    Ok(())
}

/// The copy that a program runs from.
pub(super) type Copy = Arc<TempDir>;
