//! A hand-in as it came: a folder in a folder, an archive, with the leavings of systems and editors.
//!
//! ```text
//! file or folder ─> copy, archives unpacked (unpack.rs) ─> the folder in it that is the submission
//! ```
//!
//! Folders are searched for `submission.toml`, or for traces, down to any depth; the least deep folder counts.

pub(crate) mod kind;
mod unpack;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use sandbox::files::is_executable;
use sandbox::scratch::{Scratch, scratch_folder};
use sandbox::{Sandbox, SandboxError};

use super::folder::MANIFEST;
use super::hand_in::{HandIn, HandInError, WalkStep};
use crate::boundary::door::Door;
use crate::boundary::printed;
use crate::suite::Suite;
use kind::{FileKind, HEAD, is_name_of_archive};
use scene::trace::TraceFormat;
pub use unpack::{serve, unpack_bytes};

/// Why a hand-in could not be received.
#[derive(Debug, thiserror::Error)]
pub enum ReceiveError {
    /// Its files cannot be read, or exceed a limit.
    #[error(transparent)]
    HandIn(#[from] HandInError),
    /// Its archive is refused.
    #[error("{0}")]
    NotUnpacked(String),
    /// The sandbox could not unpack it.
    #[error(transparent)]
    NotRun(#[from] SandboxError),
}

/// The files of a hand-in that had to be unpacked or copied first.
#[derive(Debug, Clone)]
pub struct Received {
    folder: PathBuf,
    /// Removed with the last use.
    _scratch: Arc<Scratch>,
}

/// Form of a file or folder, by its name and first bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// A folder.
    Folder,
    /// A program or a script.
    Program,
    /// An archive.
    Archive,
    /// A file that is neither, such as a source.
    File,
    /// A program for this other system.
    Foreign(&'static str),
}

impl Form {
    /// The form of the file or folder at this path.
    ///
    /// # Errors
    /// If it cannot be read, or is neither a file nor a folder.
    pub fn of(path: &Path) -> Result<Self, HandInError> {
        let metadata = fs::symlink_metadata(path);
        if metadata.is_ok_and(|metadata| metadata.is_dir()) {
            return Ok(Self::Folder);
        }
        let head = Door::HandIn.head(path, HEAD);
        let head = head.map_err(|error| HandInError::of_door("", error))?;
        Ok(match FileKind::of(&head) {
            FileKind::Archive(_) => Self::Archive,
            FileKind::Foreign(system) => Self::Foreign(system),
            FileKind::Program | FileKind::Script => Self::Program,
            FileKind::Other => Self::File,
        })
    }
}

/// The part of a file or folder that is graded.
#[derive(Debug)]
pub enum Located {
    /// A program.
    Program,
    /// A folder with `submission.toml`.
    Manifest {
        /// The folder.
        folder: PathBuf,
        /// The unpacked archive that it lies in.
        received: Option<Received>,
    },
    /// A folder of traces.
    Traces {
        /// The folder.
        folder: PathBuf,
        /// The unpacked archive that it lies in.
        received: Option<Received>,
    },
    /// A program for another system.
    Foreign(&'static str),
    /// Several folders could be meant.
    Ambiguous(String),
    /// A file that cannot be run.
    NotExecutable,
    /// Nothing.
    Nothing,
}

impl Located {
    /// Looks for what is graded in a file or folder, without a pack. Archives are unpacked. Without a suite, traces are not
    /// looked for.
    ///
    /// # Errors
    /// If it cannot be read or unpacked.
    pub fn of(path: &Path, suite: Option<&Suite>, sandbox: &Sandbox) -> Result<Self, ReceiveError> {
        let located = Self::outside(path, suite, sandbox)?;
        if !matches!(located, Self::Nothing) {
            return Ok(located);
        }
        match only_archive(path)? {
            Some(archive) => Self::outside(&archive, suite, sandbox),
            None => Ok(located),
        }
    }

    /// The same, without looking into an archive that stands among other files.
    fn outside(
        path: &Path,
        suite: Option<&Suite>,
        sandbox: &Sandbox,
    ) -> Result<Self, ReceiveError> {
        match Form::of(path)? {
            Form::Folder if super::folder::is_submission(path) => {
                return Ok(Self::Manifest { folder: path.to_path_buf(), received: None });
            }
            Form::Folder | Form::Archive => {}
            Form::Foreign(system) => return Ok(Self::Foreign(system)),
            Form::Program | Form::File => {
                let is_executable =
                    fs::metadata(path).is_ok_and(|metadata| is_executable(path, &metadata));
                return Ok(if is_executable { Self::Program } else { Self::NotExecutable });
            }
        }
        let archive = archive(path)?;
        let received = archive.map(|_| Received::open(path, sandbox)).transpose()?;
        let top = received.as_ref().map_or(path, Received::folder).to_path_buf();
        match manifest_folder(&list_files(&top)?) {
            Ok(Some(below)) => return Ok(Self::Manifest { folder: top.join(below), received }),
            Ok(None) => {}
            Err(message) => return Ok(Self::Ambiguous(message)),
        }
        // A trace that is a link is named as such when it is opened.
        let files = list(&top, true)?;
        Ok(match suite.map(|suite| traces_folder(&files, suite)) {
            Some(Ok(Some(below))) => Self::Traces { folder: top.join(below), received },
            Some(Err(message)) => Self::Ambiguous(message),
            Some(Ok(None)) if files.iter().any(|file| TraceFormat::of_path(file).is_some()) => {
                Self::Traces { folder: top, received }
            }
            _ => Self::Nothing,
        })
    }
}

impl Received {
    /// Receives a file or folder: copies it, and unpacks an archive, also one that is the only file of a folder.
    ///
    /// # Errors
    /// If it cannot be read or unpacked.
    pub fn open(path: &Path, sandbox: &Sandbox) -> Result<Self, ReceiveError> {
        let scratch = scratch_folder().map_err(SandboxError::no_scratch)?;
        let folder = scratch.path().join("received");
        if let Some(archive) = archive(path)? {
            unpack::unpack(&archive, &folder, sandbox)?;
        } else if path.is_dir() {
            HandIn::open(path)?.copy_to(&folder)?;
        } else {
            fs::create_dir(&folder).map_err(SandboxError::no_scratch)?;
            let name = path.file_name().unwrap_or("file".as_ref());
            HandIn::open(path)?.copy_to(&folder.join(name))?;
        }
        Ok(Self { folder, _scratch: Arc::new(scratch) })
    }

    /// The folder of its files.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Its regular files, relative to the folder, without junk.
    ///
    /// # Errors
    /// If they exceed a limit.
    pub fn files(&self) -> Result<Vec<PathBuf>, HandInError> {
        list_files(&self.folder)
    }
}

/// The archive that a hand-in is, or that is the only file of its folder.
///
/// # Errors
/// If it cannot be read, or is an archive by its name alone.
fn archive(path: &Path) -> Result<Option<PathBuf>, ReceiveError> {
    let file = match Form::of(path)? {
        Form::Folder => match &list_files(path)?[..] {
            [only] => path.join(only),
            _ => return Ok(None),
        },
        _ => path.to_path_buf(),
    };
    if Form::of(&file)? == Form::Archive {
        return Ok(Some(file));
    }
    match is_name_of_archive(&file) {
        true => Err(ReceiveError::NotUnpacked(unpack::not_an_archive(&file).to_string())),
        false => Ok(None),
    }
}

/// The only archive among the files of a folder, such as one with a report; `None` for a file.
///
/// # Errors
/// If a file cannot be read.
pub fn only_archive(folder: &Path) -> Result<Option<PathBuf>, HandInError> {
    if Form::of(folder)? != Form::Folder {
        return Ok(None);
    }
    let mut found = None;
    for file in list_files(folder)? {
        let path = folder.join(file);
        if Form::of(&path)? == Form::Archive && found.replace(path).is_some() {
            return Ok(None);
        }
    }
    Ok(found)
}

/// The regular files of a hand-in, relative to its folder, by name; without junk.
///
/// # Errors
/// If they cannot be read, or exceed a limit.
pub(crate) fn list_files(path: &Path) -> Result<Vec<PathBuf>, HandInError> {
    list(path, false)
}

/// The same, also with its links, if `links`.
fn list(path: &Path, links: bool) -> Result<Vec<PathBuf>, HandInError> {
    let mut files = Vec::new();
    HandIn::open(path)?.walk(&mut |step| {
        let node = match step {
            WalkStep::File(node) => Some(node),
            WalkStep::Link(node) => links.then_some(node),
            WalkStep::Enter(_) | WalkStep::Leave => None,
        };
        if let Some(node) = node
            && !node.path.as_encoded_bytes().split(|byte| *byte == b'/').any(is_junk)
        {
            files.push(PathBuf::from(node.path));
        }
        Ok(())
    })?;
    Ok(files)
}

/// Names of files that systems leave behind; version control leaves its own in clones.
const LEFT_BEHIND: [&str; 7] =
    ["__MACOSX", ".DS_Store", "Thumbs.db", "desktop.ini", ".git", ".gitignore", ".gitattributes"];

/// Whether systems leave files or folders of this name among those of people.
pub fn is_left_behind(name: &[u8]) -> bool {
    LEFT_BEHIND.iter().any(|each| each.as_bytes().eq_ignore_ascii_case(name))
        || name.starts_with(b"._")
}

/// Whether a file or folder of this name is no part of a hand-in: systems, editors, interpreters or version control leave it
/// in folders.
pub fn is_junk(name: &[u8]) -> bool {
    is_left_behind(name) || name.starts_with(b".") || name == b"__pycache__" || name.ends_with(b"~")
}

/// The folder with `submission.toml` among the files of a hand-in, if there is one: the least deep.
///
/// # Errors
/// A message that names them, if several are as deep.
pub fn manifest_folder(files: &[PathBuf]) -> Result<Option<PathBuf>, String> {
    let named = files.iter().filter(|file| file.file_name() == Some(MANIFEST.as_ref()));
    let folders = named.filter_map(|file| file.parent());
    least_deep(folders.map(|folder| (folder.to_path_buf(), 0)).collect()).map_err(|folders| {
        format!("submission.toml stands in {folders}\n  help: hand in one of them")
    })
}

/// The folder below which most traces have the names of scenes, if there is one.
///
/// # Errors
/// A message that names them, if several are as deep.
pub fn traces_folder(files: &[PathBuf], suite: &Suite) -> Result<Option<PathBuf>, String> {
    let mut folders: BTreeMap<PathBuf, usize> = BTreeMap::new();
    for file in files.iter().filter(|file| TraceFormat::of_path(file).is_some()) {
        let stem = file.with_extension("");
        for case in suite.cases.iter().filter(|case| stem.ends_with(&case.id)) {
            let depth = Path::new(&case.id).components().count();
            let folder: PathBuf =
                stem.components().rev().skip(depth).collect::<Vec<_>>().into_iter().rev().collect();
            *folders.entry(folder).or_default() += 1;
        }
    }
    let most = folders.values().copied().max();
    let folders = folders.into_iter().filter(|(_, count)| Some(*count) == most).collect();
    least_deep(folders).map_err(|folders| {
        format!("as many traces stand in {folders}\n  help: hand in one of them")
    })
}

/// The least deep folder. If several are, an error names them.
fn least_deep(folders: Vec<(PathBuf, usize)>) -> Result<Option<PathBuf>, String> {
    let depth = |folder: &PathBuf| folder.components().count();
    let Some(least) = folders.iter().map(|(folder, _)| depth(folder)).min() else {
        return Ok(None);
    };
    let mut found =
        folders.into_iter().map(|(folder, _)| folder).filter(|folder| depth(folder) == least);
    match (found.next(), found.next()) {
        (Some(one), Some(other)) => {
            let names =
                [&one, &other].map(|folder| printed::path(folder.as_os_str().as_encoded_bytes()));
            Err(format!("{} and {}", names[0], names[1]))
        }
        (found, _) => Ok(found),
    }
}
