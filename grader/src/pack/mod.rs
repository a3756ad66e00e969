//! Course packs: what a teacher gives, so that students hand in sources only.
//!
//! ```text
//! hand-in ─> received ─> files that the pack takes ─┐
//!                                      take.rs      ├─> project ─> build ─> program, called as the pack says
//! pack.toml ─> starter code ────────────────────────┘
//! ```
//!
//! A pack is a folder, or an archive of one, with `pack.toml`:
//!
//! ```toml
//! title = "Springs in one file"
//! assignment = "t1m2"                        # the assignment that is graded; default: every scene
//! points = 19                                # of its required features; optional, for `grade pack check`
//! submission-toml = true                     # a hand-in with its own submission.toml counts too; default: false
//!
//! [hand-in]
//! files = ["FOSSSim/*.cpp", "FOSSSim/*.h"]   # the files that are taken, by their place in the project
//! needs = ["FOSSSim/SpringForce.cpp"]        # files that must be among them; optional
//!
//! [starter]                                  # the course's files around them; optional
//! folder = "starter"                         # seen from the pack; `--starter` names another
//! files = ["**"]                             # those that are laid; default: all
//! help = "get it from the course's page"     # said if the folder is missing
//!
//! [build]                                    # optional
//! commands = [["make", "-j4"]]               # one after the other, in the project
//!
//! [run]
//! command = ["./simulate", "{scene}", "-o", "{trace}"]
//! format = "csv"                             # or "fosssim"
//! readable = ["data"]                        # of the pack, for builds and runs; optional
//!
//! [functions]                                # functions that are graded by themselves; optional
//! command = ["./driver", "{calls}", "{answers}"]
//! each = [{ name = "spring", is = "springforce/force", points = 2 }]
//!
//! [[example]]                                # programs that `grade pack check` grades
//! folder = "examples/right"                  # a hand-in
//! fails = []                                 # scenes that fail, by patterns as for --only; all others pass
//! ```
//!
//! The project is made of the starter code, of the pack's own files in its folder `project/`, and of the files of the hand-in:
//! later ones replace earlier ones of the same name. The pack may have `assets/`, `extracreditassets/` and `expected/`
//! (else the scenes that come with the grader are graded), `rubric.toml`, and hidden scenes in `hidden/`.

pub mod check;
mod take;

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::Spanned;

use crate::boundary::own_file::{self, OwnFileError, Toml, line_and_column};
use crate::boundary::printed::Untrusted;
use crate::class::fingerprint::Fingerprint;
use crate::functions::{Function, Functions, Quantity};
use crate::submission::Submission;
use crate::submission::folder::{self, Built, FolderError, ManifestFormat, Recipe};
use crate::submission::hand_in::{HandIn, HandInError};
use crate::submission::program::{HOME, Runner};
use crate::submission::received::{
    Form, ReceiveError, Received, list_files, manifest_folder, only_archive,
};
use crate::verdict::Failure;
use sandbox::scratch::scratch_folder;
use sandbox::{Limits, Sandbox};
use take::{NotTaken, Pattern, Taken, take};

/// The manifest's file name.
pub const MANIFEST: &str = "pack.toml";

/// Folder of the packs that come with the scenes, next to the rubric.
pub const FOLDER: &str = "packs";

/// Maximum size of the manifest, in MiB.
const MAX_MEBIBYTES: u64 = 1;

/// A pack that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum PackError {
    /// A file or folder cannot be read, or the manifest is not valid.
    #[error(transparent)]
    File(#[from] OwnFileError),
    /// The folder of the starter code is missing.
    #[error("{}: there is no starter code{}", folder.display(), help)]
    NoStarter {
        /// The folder.
        folder: PathBuf,
        /// The remedy.
        help: String,
    },
    /// The archive of the pack cannot be unpacked.
    #[error("{}: {error}", path.display())]
    NotUnpacked {
        /// The file.
        path: PathBuf,
        /// Why.
        error: ReceiveError,
    },
    /// There is no pack of this name.
    #[error("{}: no pack: there is no pack.toml in it{}", path.display(), help)]
    NoPack {
        /// The folder.
        path: PathBuf,
        /// The remedy.
        help: String,
    },
}

/// The content of `pack.toml`.
#[derive(Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct PackFile {
    /// One line, for reports.
    title: String,
    /// The assignment that is graded; without it, every scene.
    assignment: Option<String>,
    /// The sum of the points of required features, for `grade pack check`.
    points: Option<f64>,
    /// Whether a `submission.toml` in the hand-in decides how it is built and run.
    #[serde(default)]
    submission_toml: bool,
    hand_in: HandInTable,
    starter: Option<StarterTable>,
    build: Option<BuildTable>,
    run: PackRunTable,
    functions: Option<FunctionsTable>,
    /// Programs that `grade pack check` grades.
    #[serde(default)]
    #[cfg_attr(test, schemars(with = "Vec<ExampleTable>"))]
    example: Vec<Spanned<ExampleTable>>,
}

/// The files that are taken from a hand-in.
#[derive(Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct HandInTable {
    /// Patterns of their paths in the project: `*`, `?`, and `**` for any number of folders.
    #[cfg_attr(test, schemars(with = "Vec<String>"))]
    files: Spanned<Vec<Spanned<String>>>,
    /// Paths of files that must be among them.
    #[serde(default)]
    #[cfg_attr(test, schemars(with = "Vec<String>"))]
    needs: Vec<Spanned<String>>,
}

/// The files around those of a hand-in.
#[derive(Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct StarterTable {
    /// Their folder, seen from the pack.
    folder: PathBuf,
    /// Patterns of the files that are laid; all, if left out.
    #[cfg_attr(test, schemars(with = "Option<Vec<String>>"))]
    files: Option<Vec<Spanned<String>>>,
    /// The remedy if the folder is missing.
    help: Option<String>,
}

/// The build, in the folder of the project.
#[derive(Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct BuildTable {
    /// Commands that run one after the other, each a program and its arguments.
    #[cfg_attr(test, schemars(with = "Vec<Vec<String>>"))]
    commands: Vec<Spanned<Vec<String>>>,
}

/// How the program is called.
#[derive(Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct PackRunTable {
    /// The program and its arguments, with `{scene}` and `{trace}` for files, `{folder}` for the project, and `{solver}`.
    #[cfg_attr(test, schemars(with = "Vec<String>"))]
    command: Spanned<Vec<String>>,
    /// The format of its traces.
    #[serde(default)]
    format: ManifestFormat,
    /// Files and folders of the pack that builds and programs may read where they are.
    #[serde(default)]
    #[cfg_attr(test, schemars(with = "Vec<PathBuf>"))]
    readable: Vec<Spanned<PathBuf>>,
}

/// Functions of the hand-in that are graded, each by itself.
#[derive(Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct FunctionsTable {
    /// The driver and its arguments, with `{calls}` and `{answers}` for files, and `{folder}` for the project.
    #[cfg_attr(test, schemars(with = "Vec<String>"))]
    command: Spanned<Vec<String>>,
    /// The functions.
    #[cfg_attr(test, schemars(with = "Vec<FunctionTable>"))]
    each: Vec<Spanned<FunctionTable>>,
}

/// A function with its points.
#[derive(Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct FunctionTable {
    /// Its name in calls and in reports: one word.
    name: String,
    /// The quantity that it must return: `springforce/jacobian-x`, `fast-mass-spring/A`.
    is: String,
    /// Its points.
    points: f64,
}

/// A program whose verdicts are known.
#[derive(Debug, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct ExampleTable {
    /// Its folder, seen from the pack: a hand-in.
    folder: PathBuf,
    /// Patterns of the scenes that fail, as for `--only`; each fails somewhere, and all other scenes pass.
    #[serde(default)]
    fails: Vec<String>,
}

/// A pack.
#[derive(Debug)]
pub struct Pack {
    /// One line about it.
    pub title: String,
    /// The assignment that it is for; `None` for every scene.
    pub assignment: Option<String>,
    /// The sum of the points of required features, if the manifest states it.
    points: Option<f64>,
    folder: PathBuf,
    /// Whether a hand-in's own `submission.toml` counts.
    submission_toml: bool,
    patterns: Vec<Pattern>,
    needs: Vec<PathBuf>,
    starter: Option<Layer>,
    /// The pack's own files of a project.
    project: Option<Layer>,
    recipe: Recipe,
    /// The functions that are graded by themselves.
    functions: Option<Functions>,
    readable: Vec<PathBuf>,
    examples: Vec<Example>,
    /// The hash of the manifest and the starter code.
    hash: String,
    /// The unpacked archive, if it is one.
    _received: Option<Received>,
}

/// The folder of the pack's own files of a project.
const PROJECT: &str = "project";

/// Files of a project.
#[derive(Debug)]
struct Layer {
    folder: PathBuf,
    /// The files that are laid, relative to the folder.
    files: Vec<PathBuf>,
}

/// A program whose verdicts are known.
#[derive(Debug)]
pub struct Example {
    /// Its folder.
    pub folder: PathBuf,
    /// Patterns of the scenes that fail.
    pub fails: Vec<String>,
    /// The line of its entry.
    pub line: usize,
}

/// A fault of the grader or its machine that stops a build.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct NotBuilt(String);

impl Pack {
    /// Opens a pack: a folder with `pack.toml`, or an archive of one. `starter` is the folder of the starter code, if it is
    /// not the one that the pack names.
    ///
    /// # Errors
    /// If it cannot be read, or is not valid.
    pub fn open(path: &Path, starter: Option<&Path>) -> Result<Self, PackError> {
        if !path.is_file() {
            return Self::load(path.to_path_buf(), starter, None);
        }
        // The teacher's own archive.
        let failed = |error| PackError::NotUnpacked { path: path.to_path_buf(), error };
        let received = Received::open(path, &Sandbox::Unprotected).map_err(failed)?;
        let files = received.files().map_err(|error| failed(error.into()))?;
        let manifests = files.iter().filter(|file| file.file_name() == Some(MANIFEST.as_ref()));
        let nearest = manifests.min_by_key(|file| file.components().count());
        let below = nearest.and_then(|file| file.parent()).unwrap_or(Path::new(""));
        Self::load(received.folder().join(below), starter, Some(received))
    }

    fn load(
        folder: PathBuf,
        starter: Option<&Path>,
        received: Option<Received>,
    ) -> Result<Self, PackError> {
        let path = folder.join(MANIFEST);
        let unreadable =
            |path: &Path, source| OwnFileError::Unreadable { path: path.to_path_buf(), source };
        if !path.is_file() {
            let help = if folder.is_dir() { "" } else { " (there is no such folder)" };
            return Err(PackError::NoPack { path: folder, help: help.to_owned() });
        }
        let text =
            own_file::read_text(&path, MAX_MEBIBYTES).map_err(|error| unreadable(&path, error))?;
        let toml = Toml { path: &path, text: &text };
        let invalid = |start, message| PackError::File(toml.invalid(start, message));
        let file: PackFile = toml.parse()?;
        let pattern = |text: &Spanned<String>| {
            Pattern::parse(text.as_ref()).map_err(|message| invalid(text.span().start, message))
        };
        let patterns =
            file.hand_in.files.as_ref().iter().map(pattern).collect::<Result<Vec<_>, _>>()?;
        if patterns.is_empty() {
            let message = "files names none\n  help: name the files that students hand in, as in [\"FOSSSim/*.cpp\"]";
            return Err(invalid(file.hand_in.files.span().start, message.to_owned()));
        }
        for need in &file.hand_in.needs {
            pattern(need)?;
            if !patterns.iter().any(|pattern| pattern.matches(Path::new(need.as_ref()))) {
                let message = format!(
                    "{:?} is needed, but never taken\n  help: add a pattern for it to files",
                    need.as_ref()
                );
                return Err(invalid(need.span().start, message));
            }
        }
        let mut build = Vec::new();
        for command in file.build.into_iter().flat_map(|build| build.commands) {
            folder::check_command("commands", command.as_ref())
                .map_err(|message| invalid(command.span().start, message))?;
            build.push(command.into_inner());
        }
        let run = file.run.command;
        folder::check_run("command", run.as_ref())
            .map_err(|message| invalid(run.span().start, message))?;
        let functions = |table: FunctionsTable| -> Result<_, PackError> {
            let command = table.command;
            folder::check_placeholders("command", command.as_ref(), ["{calls}", "{answers}"])
                .map_err(|message| invalid(command.span().start, message))?;
            let each = table.each.into_iter().map(|entry| {
                let start = entry.span().start;
                entry.into_inner().read().map_err(|message| invalid(start, message))
            });
            Ok(Functions { command: command.into_inner(), each: each.collect::<Result<_, _>>()? })
        };
        let functions = file.functions.map(functions).transpose()?;
        let mut readable = Vec::new();
        for each in file.run.readable {
            let path = folder.join(each.as_ref());
            let real = scene::input::real_path(&path).map_err(|error| {
                invalid(each.span().start, format!("{}: {error}", each.as_ref().display()))
            })?;
            readable.push(real);
        }
        let layer = |folder: PathBuf, kept: &dyn Fn(&PathBuf) -> bool| -> Result<_, PackError> {
            let files = list_files(&folder);
            let files = files.map_err(|error| unreadable(&folder, io::Error::other(error)))?;
            Ok(Layer { files: files.into_iter().filter(kept).collect(), folder })
        };
        let starter = match (&file.starter, starter) {
            (None, None) => None,
            (None, Some(_)) => {
                let message = "this pack has no [starter]\n  help: leave out --starter";
                return Err(invalid(0, message.to_owned()));
            }
            (Some(table), named) => {
                let folder = named.map_or_else(|| folder.join(&table.folder), Path::to_path_buf);
                if !folder.is_dir() {
                    let help = table.help.as_ref().map(|help| format!("\n  help: {help}"));
                    return Err(PackError::NoStarter { folder, help: help.unwrap_or_default() });
                }
                let kept = table.files.as_ref();
                let kept =
                    kept.map(|files| files.iter().map(pattern).collect::<Result<Vec<_>, _>>());
                let kept = kept.transpose()?;
                Some(layer(folder, &|file| {
                    kept.as_ref()
                        .is_none_or(|kept| kept.iter().any(|pattern| pattern.matches(file)))
                })?)
            }
        };
        let project = Some(folder.join(PROJECT)).filter(|folder| folder.is_dir());
        let project = project.map(|folder| layer(folder, &|_| true)).transpose()?;
        let mut hash = Fingerprint::default();
        hash.part(text.as_bytes());
        for layer in starter.iter().chain(&project) {
            for file in &layer.files {
                hash.part(file.as_os_str().as_encoded_bytes());
                let path = layer.folder.join(file);
                hash.file(&path).map_err(|error| unreadable(&path, error))?;
            }
        }
        let example = |entry: Spanned<ExampleTable>| {
            let (line, _) = line_and_column(&text, entry.span().start);
            let ExampleTable { folder: below, fails } = entry.into_inner();
            Example { folder: folder.join(below), fails, line }
        };
        Ok(Self {
            title: file.title,
            assignment: file.assignment,
            points: file.points,
            submission_toml: file.submission_toml,
            patterns,
            needs: file.hand_in.needs.into_iter().map(|need| need.into_inner().into()).collect(),
            starter,
            project,
            recipe: Recipe { build, run: run.into_inner(), serve: None, format: file.run.format },
            functions,
            readable,
            examples: file.example.into_iter().map(example).collect(),
            hash: hash.finish(),
            folder,
            _received: received,
        })
    }

    /// Its folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The hash of the files, besides the hand-in, that a program is built from.
    pub fn hash(&self) -> &str {
        &self.hash
    }

    /// The files and folders of the pack that programs may read where they are.
    pub fn readable(&self) -> &[PathBuf] {
        &self.readable
    }

    /// The functions that are graded by themselves.
    pub fn functions(&self) -> Option<&Functions> {
        self.functions.as_ref()
    }

    /// The programs whose verdicts are known.
    pub fn examples(&self) -> &[Example] {
        &self.examples
    }

    /// The folder of the starter code, and the files that are laid from it; `None` if the manifest has none.
    pub fn starter(&self) -> Option<(&Path, &[PathBuf])> {
        self.starter.as_ref().map(|layer| (layer.folder.as_path(), layer.files.as_slice()))
    }

    /// The starter code, then the pack's own files.
    fn layers(&self) -> impl Iterator<Item = &Layer> {
        self.starter.iter().chain(&self.project)
    }

    /// The names of the files that are taken from a hand-in, without their folders, each once: those that it needs, then
    /// patterns of those that it may have.
    pub fn file_names(&self) -> Vec<String> {
        let name = |need: &PathBuf| Some(need.file_name()?.to_str()?.to_owned());
        let needed: BTreeSet<String> = self.needs.iter().filter_map(name).collect();
        let names = self.patterns.iter().map(|pattern| pattern.name().to_owned());
        let others: BTreeSet<String> = names.filter(|name| !needed.contains(name)).collect();
        needed.into_iter().chain(others).collect()
    }

    /// Writes what a student starts from: the project without a hand-in.
    ///
    /// # Errors
    /// If a file cannot be written, or exists.
    pub fn start(&self, folder: &Path) -> io::Result<Vec<PathBuf>> {
        let files = self.layers().flat_map(|layer| &layer.files).map(|file| folder.join(file));
        let files: BTreeSet<PathBuf> = files.collect();
        if let Some(path) = files.iter().find(|path| path.exists()) {
            let message = format!("{} exists\n  help: name another folder", path.display());
            return Err(io::Error::new(io::ErrorKind::AlreadyExists, message));
        }
        self.layers().try_for_each(|layer| layer.lay(folder))?;
        Ok(files.into_iter().collect())
    }

    /// Builds the hand-in at `path`. A defect of the hand-in is its verdict.
    ///
    /// # Errors
    /// If the grader or its machine cannot build it.
    pub fn submission(
        &self,
        path: &Path,
        name: Untrusted,
        runner: Runner,
        limits: Limits,
    ) -> Result<Submission, NotBuilt> {
        match self.build(path, &name, runner, limits) {
            Ok(Built::Program(program)) => Ok(Submission::Program(program)),
            Ok(Built::Failed { name, failure }) => Ok(Submission::Unusable { name, failure }),
            Err(Unbuilt::Refused(detail)) => {
                let failure = Failure::BadHandIn { reason: detail.into() };
                Ok(Submission::Unusable { name, failure })
            }
            Err(Unbuilt::Fault(detail)) => Err(NotBuilt(detail)),
        }
    }

    /// Whether there is something to build among the files of a hand-in.
    fn finds(&self, files: &[PathBuf]) -> bool {
        let is_own = |file: &PathBuf| {
            self.submission_toml && file.file_name() == Some(folder::MANIFEST.as_ref())
        };
        !matches!(take(files, &self.patterns, &BTreeSet::new()), Err(NotTaken::Nothing { .. }))
            || files.iter().any(is_own)
    }

    fn build(
        &self,
        path: &Path,
        name: &Untrusted,
        mut runner: Runner,
        limits: Limits,
    ) -> Result<Built, Unbuilt> {
        let mut received = Received::open(path, &runner.sandbox)?;
        let mut files = received.files()?;
        if !self.finds(&files)
            && let Some(archive) = only_archive(received.folder())?
        {
            received = Received::open(&archive, &runner.sandbox)?;
            files = received.files()?;
        }
        if self.submission_toml
            && let Some(own) = manifest_folder(&files).map_err(Unbuilt::Refused)?
        {
            return Ok(folder::open(&received.folder().join(own), name, runner, limits)?);
        }
        if let [only] = &files[..]
            && let Form::Foreign(system) = Form::of(&received.folder().join(only))?
        {
            return Err(Unbuilt::Refused(format!(
                "it is a program for {system}, without sources\n  help: hand in the sources"
            )));
        }
        let known = self.layers().flat_map(|layer| &layer.files);
        let known: BTreeSet<PathBuf> = known.chain(&self.needs).cloned().collect();
        let taken = match (&files[..], &self.patterns[..]) {
            ([only], [pattern]) if path.is_file() && only.file_name() == path.file_name() => {
                Taken::only(only, pattern)
            }
            _ => None,
        };
        let taken = taken.map_or_else(|| take(&files, &self.patterns, &known), Ok)?;
        if let Some(missing) = self.needs.iter().find(|need| !taken.files.contains_key(*need)) {
            return Err(Unbuilt::Refused(format!(
                "{} is missing\n  help: hand it in with the other files",
                missing.display()
            )));
        }
        let fault = |error: io::Error| Unbuilt::Fault(format!("no folder for the build: {error}"));
        let scratch = scratch_folder().map_err(fault)?;
        let home = scratch.path().join(HOME);
        fs::create_dir(&home).map_err(fault)?;
        self.layers().try_for_each(|layer| layer.lay(&home)).map_err(fault)?;
        lay(&taken, received.folder(), &home)?;
        runner.readable.extend(self.readable.iter().cloned());
        let mut built = folder::build(name, scratch, &self.recipe, runner, limits)?;
        if let Built::Program(program) = &mut built {
            program.taken = Some(taken.words(&files));
        }
        Ok(built)
    }
}

impl FunctionTable {
    fn read(self) -> Result<Function, String> {
        let Self { name, is, points } = self;
        if name.is_empty() || name.contains(char::is_whitespace) {
            return Err(format!("{name:?} is not one word\n  help: name it as the driver does"));
        }
        if !(points >= 0.0 && points.is_finite()) {
            return Err(format!("{points} points\n  help: give it 0 or more"));
        }
        Ok(Function { name, quantity: Quantity::parse(&is)?, points })
    }
}

impl Layer {
    /// Copies its files to a folder.
    fn lay(&self, folder: &Path) -> io::Result<()> {
        for file in &self.files {
            let to = folder.join(file);
            fs::create_dir_all(to.parent().unwrap_or(folder))?;
            fs::copy(self.folder.join(file), to)?;
        }
        Ok(())
    }
}

/// Puts the files of a hand-in into the project, in the place of those of the starter code.
fn lay(taken: &Taken, from: &Path, home: &Path) -> Result<(), Unbuilt> {
    let fault = |error: io::Error| Unbuilt::Fault(format!("no folder for the build: {error}"));
    for (target, source) in &taken.files {
        let to = home.join(target);
        fs::create_dir_all(to.parent().unwrap_or(home)).map_err(fault)?;
        match fs::remove_file(&to) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(fault(error)),
            _ => HandIn::open(&from.join(source))?.copy_to(&to)?,
        }
    }
    Ok(())
}

/// Why a hand-in is not built.
enum Unbuilt {
    /// Its own fault.
    Refused(String),
    /// That of the grader or its machine.
    Fault(String),
}

impl From<HandInError> for Unbuilt {
    fn from(error: HandInError) -> Self {
        if error.is_fault() {
            Self::Fault(error.to_string())
        } else {
            Self::Refused(error.to_string())
        }
    }
}

impl From<ReceiveError> for Unbuilt {
    fn from(error: ReceiveError) -> Self {
        match error {
            ReceiveError::HandIn(error) => error.into(),
            ReceiveError::NotUnpacked(detail) => Self::Refused(detail),
            ReceiveError::NotRun(error) => Self::Fault(error.to_string()),
        }
    }
}

impl From<NotTaken> for Unbuilt {
    fn from(error: NotTaken) -> Self {
        Self::Refused(error.to_string())
    }
}

impl From<FolderError> for Unbuilt {
    fn from(error: FolderError) -> Self {
        match error {
            FolderError::HandIn { error, .. } => error.into(),
            FolderError::Invalid { .. } => Self::Refused(error.to_string()),
            FolderError::NotCopied(_) | FolderError::NotRun(_) => Self::Fault(error.to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn schema_of_the_manifest_is_documented() {
        let schema = schemars::schema_for!(PackFile);
        let text = serde_json::to_string_pretty(&schema).unwrap() + "\n";
        test_support::assert_document(
            "pack.schema.json",
            &text,
            "cargo test --release -p grader schema_of_the_manifest",
        );
    }
}
