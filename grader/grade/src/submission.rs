//! Opens submissions: finds and builds them, and keeps the oracle out of their reach.

use std::path::{Path, PathBuf};

use grader::boundary::printed::{RawUse, Untrusted};
use grader::rubric::Rubric;
use grader::submission::Submission;
use grader::submission::folder::{self, Built, FolderError};
use grader::submission::hand_in::HandInError;
use grader::submission::program::{Identified, Program, Runner};
use grader::verdict::Failure;
use sandbox::{self, Protection, Sandbox};
use scene::trace::TraceFormat;

use crate::args::RunArgs;
use crate::inputs::Inputs;
use crate::stop::{Stop, complain};
use crate::watch;

impl RunArgs {
    /// The runner for programs, and the protections in force.
    pub(super) fn runner(&self, rubric: &Rubric) -> Result<(Runner, Vec<Protection>), Stop> {
        let mut limits = rubric.limits();
        for (name, value) in &self.limit {
            limits.set(name, *value).map_err(Stop::bad_input)?;
        }
        let absolute = |path: &PathBuf| std::fs::canonicalize(path).map_err(Stop::about(path));
        let readable = self.readable.iter().map(absolute).collect::<Result<_, _>>()?;
        let sandbox = open_sandbox(self.unprotected, rubric)?;
        let protections = sandbox.protections().to_vec();
        Ok((Runner::new(sandbox, limits, readable), protections))
    }
}

/// The sandbox for untrusted programs.
///
/// # Errors
/// If the system refuses one, or lacks a protection that the rubric requires.
pub(super) fn open_sandbox(unprotected: bool, rubric: &Rubric) -> Result<Sandbox, Stop> {
    if unprotected {
        complain("warning", "programs run unprotected, with all your rights");
        return Ok(Sandbox::Unprotected);
    }
    let launcher = std::env::current_exe().map_err(Stop::fault)?;
    let help = "\n  help: --unprotected runs programs without protection";
    let sandbox =
        Sandbox::open(&launcher).map_err(|error| Stop::bad_input(format!("{error}{help}")))?;
    check(&sandbox, rubric.required_protections())
        .map_err(|missing| Stop::bad_input(format!("nothing is run: {missing}{help}")))?;
    Ok(sandbox)
}

/// Warns of missing protections.
///
/// # Errors
/// A message, if a required protection is missing.
fn check(sandbox: &Sandbox, required: &[Protection]) -> Result<(), String> {
    let is_missing = |protection: &&Protection| !sandbox.protections().contains(protection);
    let names = |protections: &[Protection]| {
        let missing = protections.iter().filter(is_missing).map(|protection| protection.name());
        missing.collect::<Vec<_>>().join(", ")
    };
    let reason = sandbox.refused().map(|reason| format!(" ({reason})")).unwrap_or_default();
    let say = |names: String| format!("this system does not offer protection of: {names}{reason}");
    if required.iter().any(|protection| is_missing(&protection)) {
        return Err(say(names(required)));
    }
    if Protection::ALL.iter().any(|protection| is_missing(&protection)) {
        complain("warning", say(names(&Protection::ALL)));
    }
    Ok(())
}

/// A submission, and, if it runs programs, the protections in force.
type Opened = (Submission, Option<Vec<Protection>>);

/// The submission at `path`, which must be able to read neither the oracle and hidden scenes nor the `further` paths.
pub(super) fn open_path(
    path: &Path,
    run: &RunArgs,
    inputs: &Inputs,
    further: &[PathBuf],
) -> Result<Opened, Stop> {
    if path.is_dir() && !folder::is_submission(path) {
        return open_traces(path, inputs);
    }
    let mut secrets = inputs.secrets();
    secrets.extend_from_slice(further);
    let (submission, protections) = open_program(path, run, &inputs.rubric, &secrets)?;
    // A hand-in that cannot be graded does not run.
    let is_run =
        !matches!(submission, Submission::Unusable { failure: Failure::BadHandIn { .. }, .. });
    Ok((submission, is_run.then_some(protections)))
}

/// A folder that a platform received from a student: its defects become its verdict. Traces alone are not accepted,
/// because nothing shows that a program made them.
pub(super) fn open_handed_in(path: &Path, run: &RunArgs, inputs: &Inputs) -> Result<Opened, Stop> {
    if path.is_file() {
        return Err(Stop::bad_input(format!(
            "{}: is a file, and the reports of platforms are of folders that were handed in\n  help: name the folder \
             with submission.toml, or use other reports",
            path.display()
        )));
    }
    if !path.is_dir() {
        return Err(Stop::bad_input(format!("{}: folder not found", path.display())));
    }
    // The folder may be given as a dot.
    let absolute = std::fs::canonicalize(path).map_err(Stop::bad_input)?;
    let name = absolute.file_name().unwrap_or_default().to_string_lossy().into_owned();
    if !folder::is_submission(path) {
        let detail = "there is no submission.toml in the files that were handed in, outside of any folder\n  help: hand \
                      in the content of the folder that `grade init` writes, not the folder itself";
        let failure = Failure::BadHandIn { reason: detail.into() };
        return Ok((Submission::Unusable { name: name.into(), failure }, None));
    }
    let (runner, protections) = run.runner(&inputs.rubric)?;
    let mut readable = runner.readable.clone();
    readable.push(absolute);
    if !run.unprotected {
        check_secrets(&inputs.secrets(), &readable)?;
    }
    match open_entry(path, &name, runner, &inputs.rubric) {
        Submission::NotGraded { detail, .. } => Err(Stop::fault(detail)),
        submission => Ok((submission, Some(protections))),
    }
}

/// A folder with at least one trace, of whatever scene.
pub(super) fn open_traces(folder: &Path, inputs: &Inputs) -> Result<Opened, Stop> {
    if watch::files(folder).iter().any(|(path, ..)| TraceFormat::of_path(path).is_some()) {
        return Ok((Submission::Traces(folder.to_path_buf()), None));
    }
    let example = inputs.suite.cases.first().map_or("GROUP/SCENE", |case| &case.id);
    Err(Stop::bad_input(format!(
        "{0}: no submission: there is no submission.toml in this folder, and no trace\n  help: name a \
         program, a folder with submission.toml, or a folder of traces such as {example}.csv; `grade init` writes a \
         skeleton",
        folder.display()
    )))
}

/// Checks that a file can be a program.
fn check_executable(path: &Path) -> Result<(), Stop> {
    #[cfg(unix)]
    if let Ok(metadata) = path.metadata() {
        use std::os::unix::fs::PermissionsExt;
        if metadata.is_file() && metadata.permissions().mode() & 0o111 == 0 {
            return Err(Stop::bad_input(format!(
                "{0}: no submission: the file is not executable\n  help: name a program, a folder with \
                 submission.toml, or a folder of traces; `chmod +x {0}` makes a script executable",
                path.display()
            )));
        }
    }
    Ok(())
}

/// The program of a file or of a folder with a manifest, and the protections in force.
///
/// # Errors
/// If the program cannot be opened, or could read one of the secrets.
pub(super) fn open_program(
    path: &Path,
    run: &RunArgs,
    rubric: &Rubric,
    secrets: &[PathBuf],
) -> Result<(Submission, Vec<Protection>), Stop> {
    if !path.exists() {
        let path = path.display();
        return Err(Stop::bad_input(format!("{path}: file or folder not found")));
    }
    if path.is_dir() && !folder::is_submission(path) {
        let path = path.display();
        return Err(Stop::bad_input(format!("{path}: no submission.toml in this folder")));
    }
    check_executable(path)?;
    let (runner, protections) = run.runner(rubric)?;
    let mut readable = runner.readable.clone();
    readable.extend(std::fs::canonicalize(path));
    if !run.unprotected {
        check_secrets(secrets, &readable)?;
    }
    let submission = if path.is_dir() {
        match folder::open(path, runner, rubric.build_limits()) {
            Ok(Built::Program(program)) => Submission::Program(program),
            Ok(Built::Failed { name, failure }) => Submission::Unusable { name, failure },
            Err(FolderError::HandIn { error, .. }) => {
                refused(path.display().to_string().into(), &error)
            }
            Err(error @ FolderError::Invalid { .. }) => return Err(Stop::bad_input(error)),
            Err(error @ (FolderError::NotCopied(_) | FolderError::NotRun(_))) => {
                return Err(Stop::fault(error));
            }
        }
    } else {
        match Program::identify(path, runner) {
            Ok(Identified::Program(program)) => Submission::Program(program),
            Ok(Identified::Unusable { name, failure }) => Submission::Unusable { name, failure },
            Err(error) => return Err(Stop::fault(error)),
        }
    };
    Ok((submission, protections))
}

/// The program at `path`, for a command that needs no suite and no rubric.
///
/// # Errors
/// If it is no program, or cannot be built or run.
pub(super) fn open_measured(path: &Path, run: &RunArgs) -> Result<Program, Stop> {
    match open_program(path, run, &Rubric::default(), &[])? {
        (Submission::Program(program), _) => Ok(program),
        (Submission::Unusable { name, failure }, _) => {
            Err(Stop::bad_input(format!("{}: {failure}", name.line())))
        }
        _ => Err(Stop::bad_input(format!("{}: not a program", path.display()))),
    }
}

/// Checks that a submission, which may read the system's folders and these, can read no secret.
pub(super) fn check_secrets(secrets: &[PathBuf], readable: &[PathBuf]) -> Result<(), Stop> {
    for secret in secrets.iter().filter_map(|secret| std::fs::canonicalize(secret).ok()) {
        if let Some(folder) = sandbox::revealed_by(&secret, readable) {
            return Err(Stop::bad_input(format!(
                "{}: the submission may read {}, which contains it\n  help: move one of them, or name \
                 another folder with --expected, --hidden or --html",
                secret.display(),
                folder.display(),
            )));
        }
    }
    Ok(())
}

/// Opens the submission at `path`, called `name` in its class. A defect of the submission becomes its verdict.
pub(super) fn open_entry(path: &Path, name: &str, runner: Runner, rubric: &Rubric) -> Submission {
    let name = Untrusted::from(name);
    if path.is_dir() && !folder::is_submission(path) {
        if rubric.class().traces {
            return Submission::Traces(path.to_path_buf());
        }
        let detail = "there is no submission.toml in this folder, and traces alone show no program that made them\n  \
                      help: hand in the program, in a folder with submission.toml; [class] traces = true in the rubric \
                      accepts traces";
        return Submission::Unusable {
            name,
            failure: Failure::BadHandIn { reason: detail.into() },
        };
    }
    if path.is_dir() {
        return match folder::open(path, runner, rubric.build_limits()) {
            Ok(Built::Program(program)) => Submission::Program(program),
            Ok(Built::Failed { failure, .. }) => Submission::Unusable { name, failure },
            Err(FolderError::HandIn { error, .. }) => refused(name, &error),
            Err(error @ FolderError::Invalid { .. }) => {
                let detail = error.to_string();
                Submission::Unusable { name, failure: Failure::BadHandIn { reason: detail.into() } }
            }
            Err(error @ (FolderError::NotCopied(_) | FolderError::NotRun(_))) => {
                Submission::NotGraded { name, detail: error.to_string() }
            }
        };
    }
    match Program::identify(path, runner) {
        Ok(Identified::Program(program)) => Submission::Program(program),
        Ok(Identified::Unusable { failure, .. }) => Submission::Unusable { name, failure },
        Err(error) => Submission::NotGraded { name, detail: error.to_string() },
    }
}

/// A submission whose files cannot be graded.
pub(super) fn refused(name: Untrusted, error: &HandInError) -> Submission {
    let detail = error.to_string();
    if error.is_fault() {
        Submission::NotGraded { name, detail }
    } else {
        Submission::Unusable { name, failure: Failure::BadHandIn { reason: detail.into() } }
    }
}

/// The assignment that the submission names; `None` if it names none, or cannot be read, which is reported when it is
/// opened.
pub(super) fn named_assignment(submission: &Path) -> Option<String> {
    let is_folder = submission.is_dir() && folder::is_submission(submission);
    let named = is_folder.then(|| folder::assignment_of(submission).ok().flatten()).flatten()?;
    // It is looked up among the known names.
    Some(named.raw(RawUse::Comparison).to_owned())
}
