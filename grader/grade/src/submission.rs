//! Opens submissions: finds and builds them, and keeps the oracle out of their reach.

use std::path::{Path, PathBuf};

use grader::boundary::printed::{RawUse, Untrusted};
use grader::pack::Pack;
use grader::rubric::Rubric;
use grader::submission::Submission;
use grader::submission::folder::{self, Built, FolderError};
use grader::submission::hand_in::HandInError;
use grader::submission::program::{Identified, Program, Runner};
use grader::submission::received::{Form, Located, ReceiveError};
use grader::suite::Suite;
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
        let absolute = |path: &PathBuf| {
            let named = |error| Stop::bad_input(format!("--readable {}: {error}", path.display()));
            scene::input::real_path(path).map_err(named)
        };
        let readable = self.readable.iter().map(absolute).collect::<Result<Vec<_>, _>>()?;
        let sandbox = open_sandbox(self.unprotected, rubric)?;
        for path in &readable {
            if let Some(part) = sandbox.closed_part(path) {
                let (path, part) = (path.display(), part.display());
                return Err(Stop::bad_input(format!(
                    "--readable {path}: programs run as a user of their own, who may not read {part}\n  help: `chmod o+rX \
                     {part}`, or name another folder"
                )));
            }
        }
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
    let sandbox = strongest().map_err(|error| Stop::bad_input(format!("{error}{UNPROTECTED}")))?;
    check(&sandbox, rubric.required_protections())
        .map_err(|missing| Stop::bad_input(format!("{missing}{UNPROTECTED}")))?;
    let launcher = std::env::current_exe().map_err(Stop::fault)?;
    // A separate root of a run does not contain this program.
    let is_shown = !sandbox.protections().contains(&Protection::Processes)
        && sandbox::revealed_by(&launcher, &[]).is_some()
        && sandbox.closed_part(&launcher).is_none();
    if is_shown {
        let warning = "programs can read this program, and the oracle in it\n  help: install it in another folder, such as \
                       ~/.cargo/bin; if root runs it, `chmod 700` keeps others out";
        complain("warning", format!("{}: {warning}", launcher.display()));
    }
    Ok(sandbox)
}

/// The remedy that is left on a machine of one's own.
const UNPROTECTED: &str = "\n  help: --unprotected runs programs without protection";

/// The strongest sandbox of this system.
pub(super) fn strongest() -> Result<Sandbox, String> {
    let launcher = std::env::current_exe();
    let launcher = if Sandbox::IS_OFFERED { launcher } else { Ok(PathBuf::new()) };
    let launcher = launcher.map_err(|error| error.to_string())?;
    Sandbox::open(&launcher).map_err(|error| error.to_string())
}

/// Warns of missing protections.
///
/// # Errors
/// A message with its remedy, if a required protection is missing.
pub(super) fn check(sandbox: &Sandbox, required: &[Protection]) -> Result<(), String> {
    let in_force = sandbox.protections();
    let names = |protections: &[Protection]| {
        let missing = protections.iter().filter(|protection| !protection.holds_under(in_force));
        missing.map(|protection| protection.name()).collect::<Vec<_>>().join(", ")
    };
    let reason = sandbox.refused().map(|reason| format!(" ({reason})")).unwrap_or_default();
    let say = |names: String| format!("this system does not offer protection of: {names}{reason}");
    let is_closed = in_force.contains(&Protection::ClosedFolders);
    if required.iter().any(|protection| !protection.holds_under(in_force)) {
        let weaker = if is_closed {
            "\n  help: require = [\"closed-folders\"] in [protection] of the rubric accepts a user ID of its own and \
                 closed folders in the place of \"files\""
        } else {
            ""
        };
        return Err(format!("nothing is run: {}{weaker}", say(names(required))));
    }
    let missing = names(&Protection::ALL);
    if !missing.is_empty() {
        complain("warning", say(missing));
    }
    if is_closed {
        complain("warning", format!("files are protected by {} alone", report::text::WEAKER));
    }
    Ok(())
}

/// A submission, and, if it runs programs, the protections in force.
type Opened = (Submission, Option<Vec<Protection>>);

/// Settings for opening a submission.
#[derive(Clone, Copy)]
pub(super) struct Opening<'a> {
    pub(super) run: &'a RunArgs,
    pub(super) rubric: &'a Rubric,
    pub(super) pack: Option<&'a Pack>,
    /// The scenes, whose names tell a folder of traces; `None` where only programs are opened.
    pub(super) suite: Option<&'a Suite>,
    /// The assignment of a class, which refuses a submission that names another one; elsewhere the command line decides.
    pub(super) assignment: Option<&'a str>,
}

/// Why a submission is not opened, other than by defects that become its verdict.
pub(super) enum NotOpened {
    /// Its folder says something invalid: wrong usage of those who wrote it, else a verdict.
    Invalid(String),
    /// There is nothing in it that is graded.
    Nothing,
    /// The grader or its machine is at fault.
    Fault(String),
}

impl From<FolderError> for NotOpened {
    fn from(error: FolderError) -> Self {
        match error {
            FolderError::HandIn { .. } | FolderError::Invalid { .. } => {
                Self::Invalid(error.to_string())
            }
            FolderError::NotCopied(_) | FolderError::NotRun(_) => Self::Fault(error.to_string()),
        }
    }
}

impl Inputs {
    /// Settings for opening submissions of this run.
    pub(super) fn opening<'a>(&'a self, run: &'a RunArgs) -> Opening<'a> {
        Opening {
            run,
            rubric: &self.rubric,
            pack: self.pack.as_ref(),
            suite: Some(&self.suite),
            assignment: None,
        }
    }
}

/// The submission at `path`, which must be able to read neither the oracle and hidden scenes nor the `further` paths.
pub(super) fn open_path(
    path: &Path,
    run: &RunArgs,
    inputs: &Inputs,
    further: &[PathBuf],
) -> Result<Opened, Stop> {
    let mut secrets = inputs.secrets();
    secrets.extend_from_slice(further);
    let (submission, protections) = open_program(path, inputs.opening(run), &secrets)?;
    // No protection is needed without a run.
    let is_run = match &submission {
        Submission::Unusable { failure, .. } => !matches!(failure, Failure::BadHandIn { .. }),
        Submission::Traces { .. } => false,
        _ => true,
    };
    Ok((submission, is_run.then_some(protections)))
}

/// A hand-in that a platform received from a student: its defects become its verdict. Traces alone are not accepted,
/// because nothing shows that a program made them.
pub(super) fn open_handed_in(path: &Path, run: &RunArgs, inputs: &Inputs) -> Result<Opened, Stop> {
    if !path.exists() {
        return Err(Stop::bad_input(format!("{}: folder not found", path.display())));
    }
    if path.is_file() && inputs.pack.is_none() && Form::of(path).ok() != Some(Form::Archive) {
        return Err(Stop::bad_input(format!(
            "{}: is a file, and the reports of platforms are of folders that were handed in\n  help: name the folder \
             with submission.toml, or use other reports",
            path.display()
        )));
    }
    // The folder may be given as a dot.
    let absolute = scene::input::real_path(path).map_err(Stop::bad_input)?;
    let name = absolute.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let (runner, protections) = run.runner(&inputs.rubric)?;
    check_readable(&runner, &absolute, inputs.opening(run), (&inputs.secrets(), &protections))?;
    match open_entry(path, &name, runner, inputs.opening(run)) {
        Submission::NotGraded { detail, .. } => Err(Stop::fault(detail)),
        Submission::Unusable { name, failure: Failure::BadHandIn { reason } } => {
            Ok((Submission::Unusable { name, failure: Failure::BadHandIn { reason } }, None))
        }
        submission => Ok((submission, Some(protections))),
    }
}

/// A folder with at least one trace, of whatever scene.
pub(super) fn open_traces(folder: &Path, inputs: &Inputs) -> Result<Opened, Stop> {
    if watch::files(folder).iter().any(|(path, ..)| TraceFormat::of_path(path).is_some()) {
        return Ok((Submission::traces(folder), None));
    }
    Err(Stop::bad_input(no_submission(&folder.display().to_string(), Some(&inputs.suite))))
}

/// A message about a folder or an archive without anything that is graded.
fn no_submission(name: &str, suite: Option<&Suite>) -> String {
    let example = suite.and_then(|suite| suite.cases.first());
    let example = example.map_or("GROUP/SCENE", |case| &case.id);
    format!(
        "{name}: no submission: there is no submission.toml in this folder, and no trace\n  help: name a \
         program, a folder with submission.toml, or a folder of traces such as {example}.csv; `grade init` writes a \
         skeleton, and --pack grades sources"
    )
}

/// The program of a file, of a folder with a manifest or of a pack, and the protections in force.
///
/// # Errors
/// If the program cannot be opened, or could read one of the secrets.
pub(super) fn open_program(
    path: &Path,
    opening: Opening<'_>,
    secrets: &[PathBuf],
) -> Result<(Submission, Vec<Protection>), Stop> {
    if !path.exists() {
        let path = path.display();
        return Err(Stop::bad_input(format!("{path}: file or folder not found")));
    }
    let (runner, protections) = if is_run(path, opening) {
        opening.run.runner(opening.rubric)?
    } else {
        (Runner::new(Sandbox::Unprotected, opening.rubric.limits(), Vec::new()), Vec::new())
    };
    let absolute = scene::input::real_path(path).map_err(Stop::about(path))?;
    check_readable(&runner, &absolute, opening, (secrets, &protections))?;
    match open(path, &path.into(), runner, opening) {
        Ok(submission) => Ok((submission, protections)),
        Err(NotOpened::Invalid(message)) => Err(Stop::bad_input(message)),
        Err(NotOpened::Nothing) => {
            Err(Stop::bad_input(no_submission(&path.display().to_string(), opening.suite)))
        }
        Err(NotOpened::Fault(message)) => Err(Stop::fault(message)),
    }
}

/// Whether the submission at `path` may be run, where there is no sandbox: traces are read, and there they are the reader's own.
fn is_run(path: &Path, opening: Opening<'_>) -> bool {
    let located = || Located::of(path, opening.suite, &Sandbox::Unprotected);
    Sandbox::IS_OFFERED
        || opening.pack.is_some()
        || matches!(located(), Ok(Located::Program | Located::Manifest { .. }))
}

/// Checks that a submission at `path` can read no secret.
fn check_readable(
    runner: &Runner,
    path: &Path,
    opening: Opening<'_>,
    (secrets, protections): (&[PathBuf], &[Protection]),
) -> Result<(), Stop> {
    if opening.run.unprotected {
        return Ok(());
    }
    let mut readable = runner.readable.clone();
    readable.extend(opening.pack.into_iter().flat_map(Pack::readable).cloned());
    // A pack takes copies of its files.
    if opening.pack.is_none() {
        readable.push(path.to_path_buf());
    }
    check_secrets(secrets, &readable, protections)
}

/// Opens the submission at `path`, whatever it is. A defect of its files is its verdict.
fn open(
    path: &Path,
    name: &Untrusted,
    runner: Runner,
    opening: Opening<'_>,
) -> Result<Submission, NotOpened> {
    let unusable = |detail: String| {
        let failure = Failure::BadHandIn { reason: detail.into() };
        Ok(Submission::Unusable { name: name.clone(), failure })
    };
    let limits = opening.rubric.build_limits();
    if let Some(pack) = opening.pack {
        return pack
            .submission(path, name.clone(), runner, limits)
            .map_err(|error| NotOpened::Fault(error.to_string()));
    }
    let located = match Located::of(path, opening.suite, &runner.sandbox) {
        Ok(located) => located,
        Err(ReceiveError::NotRun(error)) => return Err(NotOpened::Fault(error.to_string())),
        Err(ReceiveError::HandIn(error)) => return Ok(refused(name.clone(), &error)),
        Err(error @ ReceiveError::NotUnpacked(_)) => return unusable(error.to_string()),
    };
    match located {
        Located::Manifest { folder, received: _received } => {
            if let Some(detail) = other_assignment(&folder, opening.assignment) {
                return unusable(detail);
            }
            match folder::open(&folder, name, runner, limits) {
                Ok(Built::Program(program)) => Ok(Submission::Program(program)),
                Ok(Built::Failed { name, failure }) => Ok(Submission::Unusable { name, failure }),
                Err(FolderError::HandIn { error, .. }) => Ok(refused(name.clone(), &error)),
                Err(error) => Err(error.into()),
            }
        }
        Located::Traces { folder, received } => {
            Ok(Submission::Traces { name: name.clone(), folder, received })
        }
        Located::Program => match Program::identify(path, runner) {
            Ok(Identified::Program(program)) => Ok(Submission::Program(program)),
            Ok(Identified::Unusable { name, failure }) => {
                Ok(Submission::Unusable { name, failure })
            }
            Err(error) => Err(NotOpened::Fault(error.to_string())),
        },
        Located::Foreign(system) => unusable(format!(
            "it is a program for {system}, and runs there only\n  help: hand in its sources, with how they are built in \
             submission.toml"
        )),
        Located::Ambiguous(message) => unusable(message),
        Located::NotExecutable => {
            let name = name.line();
            let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
            let help = if TraceFormat::of_path(path).is_some() {
                "name the folder in which this trace lies as GROUP/SCENE".to_owned()
            } else if extension == "xml" || extension == "json" {
                format!("`simulate {name}` runs a scene; name a program, or a folder of its traces")
            } else {
                format!(
                    "name a program, a folder with submission.toml, or a folder of traces; `chmod +x {name}` makes a \
                     script executable, and --pack grades sources"
                )
            };
            Err(NotOpened::Invalid(format!(
                "{name}: no submission: the file is not executable\n  help: {help}"
            )))
        }
        Located::Nothing => Err(NotOpened::Nothing),
    }
}

/// The program at `path`, for a command that needs no suite and no rubric.
///
/// # Errors
/// If it is no program, or cannot be built or run.
pub(super) fn open_measured(path: &Path, run: &RunArgs) -> Result<Program, Stop> {
    let rubric = Rubric::default();
    let opening = Opening { run, rubric: &rubric, pack: None, suite: None, assignment: None };
    match open_program(path, opening, &[])? {
        (Submission::Program(program), _) => Ok(program),
        (Submission::Unusable { name, failure }, _) => {
            Err(Stop::bad_input(format!("{}: {failure}", name.line())))
        }
        _ => Err(Stop::bad_input(format!("{}: not a program", path.display()))),
    }
}

/// Checks that a submission, which may read the system's folders and these, can read no secret.
pub(super) fn check_secrets(
    secrets: &[PathBuf],
    readable: &[PathBuf],
    protections: &[Protection],
) -> Result<(), Stop> {
    for secret in secrets.iter().filter_map(|secret| scene::input::real_path(secret).ok()) {
        if let Some(folder) = sandbox::revealed_by(&secret, readable) {
            return Err(Stop::bad_input(format!(
                "{}: the submission may read {}, which contains it\n  help: move one of them, or name \
                 another folder with --expected, --hidden or --html",
                secret.display(),
                folder.display(),
            )));
        }
        if protections.contains(&Protection::ClosedFolders) && !sandbox::files::is_closed(&secret) {
            let folder = secret.parent().unwrap_or(&secret);
            return Err(Stop::bad_input(format!(
                "{}: every user can read it, and nothing but closed folders protects files here\n  help: chmod 700 {}",
                secret.display(),
                folder.display(),
            )));
        }
    }
    Ok(())
}

/// Opens the submission at `path`, called `name` in its class. A defect of the submission becomes its verdict.
pub(super) fn open_entry(
    path: &Path,
    name: &str,
    runner: Runner,
    opening: Opening<'_>,
) -> Submission {
    let name = Untrusted::from(name);
    let unusable = |detail: &str| Submission::Unusable {
        name: name.clone(),
        failure: Failure::BadHandIn { reason: detail.into() },
    };
    match open(path, &name, runner, opening) {
        Ok(Submission::Traces { .. }) if !opening.rubric.class().traces => unusable(
            "traces alone show no program that made them\n  help: hand in the program, in a folder with submission.toml; \
             [class] traces = true in the rubric accepts traces",
        ),
        // Names in submission.toml need not be unique.
        Ok(Submission::Unusable { failure, .. }) => Submission::Unusable { name, failure },
        Ok(submission) => submission,
        Err(NotOpened::Invalid(detail)) => unusable(&detail),
        Err(NotOpened::Nothing) => unusable(
            "there is no submission.toml in it, and no trace\n  help: hand in the folder that `grade init` writes",
        ),
        Err(NotOpened::Fault(detail)) => Submission::NotGraded { name, detail },
    }
}

/// A message, if the `submission.toml` in this folder names another assignment than the one that is graded.
fn other_assignment(folder: &Path, graded: Option<&str>) -> Option<String> {
    let own = folder::assignment_of(folder).ok()??;
    let graded = graded?;
    (!own.raw(RawUse::Comparison).eq_ignore_ascii_case(graded)).then(|| {
        format!(
            "submission.toml names the assignment {own:?}, but {graded} is graded\n  help: change it there, or grade \
             with --assignment"
        )
    })
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
