//! An untrusted hand-in on disk, a file or a folder: walks, reads and copies it.
//!
//! Every entry is opened relative to its folder, links are never followed, and only regular files are read. The walk
//! keeps one open folder a level on its own stack, so that it needs neither long paths nor deep recursion. These limits
//! are checked before any content is read:
//!
//! | quantity | maximum |
//! | --- | --- |
//! | depth of nested folders | 100 |
//! | files and folders | 100,000 |
//! | length of an entry's path, relative to the hand-in | 1,000 bytes |
//! | sum of all file sizes, sparse files at full length | 1 GiB |

pub(crate) mod place;

use std::ffi::{OsStr, OsString};
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use sandbox::files::{self, Facts, Folder, Kind};

use crate::boundary::door::{Door, DoorError, Limit};
use crate::boundary::printed;
use crate::suite::hash_reader;
use crate::time::Time;

/// Maximum depth of nested folders.
const MAX_DEPTH: usize = 100;

/// Maximum number of files and folders.
const MAX_ENTRIES: usize = 100_000;

/// Maximum length of an entry's path, in bytes.
const MAX_PATH: usize = 1_000;

/// Maximum sum of all file sizes.
const MAX_SIZE: Limit = Door::HandIn.facts().limit;

/// A hand-in that cannot be graded.
#[derive(Debug, thiserror::Error)]
pub enum HandInError {
    /// The system refuses to read an entry.
    #[error("{path}: cannot be read: {source}\n  help: give everybody permission to read it")]
    Unreadable {
        /// The entry, relative to the hand-in.
        path: String,
        /// Why.
        source: io::Error,
    },
    /// The files are too large together.
    #[error(
        "the files are larger than {MAX_SIZE} together, counted up to {path}\n  help: hand in sources, \
         without the products of a build"
    )]
    TooLarge {
        /// The file that exceeds the limit.
        path: String,
    },
    /// There are too many entries.
    #[error(
        "{path}: there are more than {MAX_ENTRIES} files and folders\n  help: hand in sources, without the \
         products of a build"
    )]
    TooMany {
        /// The folder that exceeds the limit.
        path: String,
    },
    /// Folders are nested too deeply.
    #[error(
        "{path}: folders are nested more than {MAX_DEPTH} deep\n  help: hand in fewer folders inside each other"
    )]
    TooDeep {
        /// The folder that exceeds the limit.
        path: String,
    },
    /// A path is too long.
    #[error("{path}: the path has more than {MAX_PATH} bytes\n  help: give it a shorter name")]
    LongPath {
        /// The entry.
        path: String,
    },
    /// An entry is a pipe, a socket or a device; or the file does not come through its door.
    #[error("{path}: {error}")]
    Closed {
        /// The entry.
        path: String,
        /// Why.
        error: DoorError,
    },
    /// A name leads out of the folder it is looked up in.
    #[error(
        "{path}: is not below its folder\n  help: name a file by its path from there, without \"..\""
    )]
    Outside {
        /// The name.
        path: String,
    },
    /// The copy cannot be written.
    #[error("{path}: cannot be copied: {source}")]
    NotCopied {
        /// The entry.
        path: String,
        /// Why.
        source: io::Error,
    },
}

impl HandInError {
    /// Why an entry does not come through its door.
    pub(crate) fn of_door(path: impl AsRef<OsStr>, error: DoorError) -> Self {
        let path = shown(path);
        match error {
            DoorError::Unreadable(source) => Self::Unreadable { path, source },
            error => Self::Closed { path, error },
        }
    }

    /// Whether the grader or its machine is at fault, rather than the hand-in.
    pub fn is_fault(&self) -> bool {
        match self {
            Self::NotCopied { .. } => true,
            Self::Unreadable { source, .. } => files::is_of_machine(source),
            _ => false,
        }
    }
}

/// A hand-in within the limits.
pub(crate) struct HandIn {
    /// Its parent folder.
    parent: Folder,
    name: OsString,
}

/// A step of a walk. The entries of each folder come by name.
pub(crate) enum WalkStep<'a> {
    /// A folder, before its content.
    Enter(HandInNode<'a>),
    /// The end of the innermost open folder.
    Leave,
    /// A regular file.
    File(HandInNode<'a>),
    /// A symbolic link.
    Link(HandInNode<'a>),
}

/// A visit of an entry's path and step, or of the reason why it is refused.
pub(crate) type Visit<'v> =
    dyn FnMut(&OsStr, Result<WalkStep<'_>, HandInError>) -> Result<(), HandInError> + 'v;

/// An entry of a hand-in.
pub(crate) struct HandInNode<'a> {
    folder: &'a Folder,
    /// Its name in its folder.
    pub(crate) name: &'a OsStr,
    /// Its path relative to the hand-in, with `/` between names on every system.
    pub(crate) path: &'a OsStr,
    facts: Facts,
}

impl HandInNode<'_> {
    /// Whether any user may execute it.
    pub(crate) fn is_executable(&self) -> bool {
        self.facts.is_executable
    }

    /// Its size in bytes.
    pub(crate) fn size(&self) -> u64 {
        self.facts.size
    }

    /// The content of a regular file, as far as its size during the walk.
    pub(crate) fn read(&self) -> Result<Vec<u8>, HandInError> {
        let mut bytes = Vec::new();
        let failed = |source| HandInError::Unreadable { path: shown(self.path), source };
        self.open()?.read_to_end(&mut bytes).map_err(failed)?;
        Ok(bytes)
    }

    /// Opens a regular file. Yields no more bytes than its size during the walk.
    fn open(&self) -> Result<io::Take<File>, HandInError> {
        let file = open_regular(self.folder, self.name, self.path)?;
        Ok(file.take(self.facts.size))
    }

    /// SHA-256 of a regular file, in hexadecimal.
    pub(crate) fn hash(&self) -> Result<String, HandInError> {
        let failed = |source| HandInError::Unreadable { path: shown(self.path), source };
        hash_reader(self.open()?).map_err(failed)
    }

    /// The target of a link.
    pub(crate) fn target(&self) -> Result<OsString, HandInError> {
        self.folder.target(self.name).map_err(|error| unreadable(self.path, error))
    }
}

/// When the newest regular file of a hand-in was last changed.
///
/// # Errors
/// If the hand-in cannot be read, or exceeds a limit.
pub fn last_changed(path: &Path) -> Result<Option<Time>, HandInError> {
    let mut newest: Option<i64> = None;
    HandIn::open(path)?.walk(&mut |step| {
        if let WalkStep::File(node) = step {
            newest = newest.max(Some(node.facts.modified));
        }
        Ok(())
    })?;
    Ok(newest.map(|seconds| Time(seconds as f64)))
}

/// A folder during a walk.
struct Level {
    folder: Folder,
    names: std::vec::IntoIter<OsString>,
    /// Its path relative to the hand-in.
    path: OsString,
}

impl HandIn {
    /// Opens a file or folder after checking its limits. Only metadata is read.
    pub(crate) fn open(path: &Path) -> Result<Self, HandInError> {
        let hand_in = Self::unchecked(path)?;
        hand_in.walk(&mut |_| Ok(()))?;
        Ok(hand_in)
    }

    /// A file or folder whose limits a walk checks.
    pub(crate) fn unchecked(path: &Path) -> Result<Self, HandInError> {
        let unreadable = |source| HandInError::Unreadable { path: shown(""), source };
        let resolved;
        let path = match path.file_name() {
            Some(_) => path,
            None => {
                resolved = scene::input::real_path(path).map_err(unreadable)?;
                &resolved
            }
        };
        let (parent, name) = parent_and_name(path).map_err(unreadable)?;
        Ok(Self { parent, name })
    }

    /// Visits every entry once, the hand-in itself first.
    pub(crate) fn walk(
        &self,
        visit: &mut dyn FnMut(WalkStep<'_>) -> Result<(), HandInError>,
    ) -> Result<(), HandInError> {
        self.walk_past(&mut |_, step| visit(step?))
    }

    /// The same; each visit is given the path of the entry, relative to the hand-in. A visit may pass over an entry that
    /// is refused, and what is in it.
    pub(crate) fn walk_past(&self, visit: &mut Visit<'_>) -> Result<(), HandInError> {
        let parent = self.parent.try_clone();
        let folder =
            parent.map_err(|source| HandInError::Unreadable { path: shown(""), source })?;
        let itself = vec![self.name.clone()].into_iter();
        let mut levels = vec![Level { folder, names: itself, path: OsString::new() }];
        let (mut entries, mut bytes) = (0, 0_u64);
        while let Some(level) = levels.last_mut() {
            let mut path = level.path.clone();
            let Some(name) = level.names.next() else {
                levels.pop();
                if !levels.is_empty() {
                    visit(&path, Ok(WalkStep::Leave))?;
                }
                continue;
            };
            let depth = levels.len() - 1;
            let folder = &levels[depth].folder;
            if depth > 0 {
                if depth > 1 {
                    path.push("/");
                }
                path.push(&name);
            }
            let mut look = || {
                if path.len() > MAX_PATH {
                    return Err(HandInError::LongPath { path: shown(&path) });
                }
                let facts = folder.facts(&name).map_err(|error| unreadable(&path, error))?;
                let node = HandInNode { folder, name: &name, path: &path, facts };
                match facts.kind {
                    Kind::File => {
                        bytes = bytes.saturating_add(facts.size);
                        if bytes > MAX_SIZE.bytes() {
                            return Err(HandInError::TooLarge { path: shown(&path) });
                        }
                        Ok((WalkStep::File(node), None))
                    }
                    Kind::Link => Ok((WalkStep::Link(node), None)),
                    Kind::Folder => {
                        if depth > MAX_DEPTH {
                            return Err(HandInError::TooDeep { path: shown(&path) });
                        }
                        let inner =
                            folder.folder(&name).map_err(|error| unreadable(&path, error))?;
                        let left = MAX_ENTRIES - entries;
                        let found = inner.names(left).map_err(|error| unreadable(&path, error))?;
                        if found.len() > left {
                            return Err(HandInError::TooMany { path: shown(&path) });
                        }
                        entries += found.len();
                        let names = found.into_iter();
                        let level = Level { folder: inner, names, path: path.clone() };
                        Ok((WalkStep::Enter(node), Some(level)))
                    }
                    special => {
                        let error = DoorError::Special(special.word());
                        Err(HandInError::of_door(&path, error))
                    }
                }
            };
            match look() {
                Ok((step, level)) => {
                    visit(&path, Ok(step))?;
                    levels.extend(level);
                }
                Err(error) => visit(&path, Err(error))?,
            }
        }
        Ok(())
    }

    /// Copies the hand-in to `to`, which must not exist. Files get the mode 0644, or 0755 if any user may execute them.
    /// Links are copied as links, and a file with two names as two files.
    pub(crate) fn copy_to(&self, to: &Path) -> Result<(), HandInError> {
        let (base, top) = parent_and_name(to)
            .map_err(|source| HandInError::NotCopied { path: shown(""), source })?;
        let mut folders = vec![base];
        self.walk(&mut |step| {
            let Some(folder) = folders.last() else { return Ok(()) };
            let is_top = folders.len() == 1;
            match step {
                WalkStep::Leave => drop(folders.pop()),
                WalkStep::Enter(node) => {
                    let name = if is_top { &top } else { node.name };
                    let made = folder.make_folder(name);
                    folders.push(made.map_err(|error| not_copied(&node, error))?);
                }
                WalkStep::File(node) => {
                    let name = if is_top { &top } else { node.name };
                    copy_file(&node, folder, name)?;
                }
                WalkStep::Link(node) => {
                    let name = if is_top { &top } else { node.name };
                    folder
                        .make_link(name, &node.target()?)
                        .map_err(|error| not_copied(&node, error))?;
                }
            }
            Ok(())
        })
    }
}

fn copy_file(node: &HandInNode<'_>, folder: &Folder, name: &OsStr) -> Result<(), HandInError> {
    let mut source = node.open()?;
    let mut copy = || io::copy(&mut source, &mut folder.make_file(name, node.is_executable())?);
    copy().map(drop).map_err(|source| not_copied(node, source))
}

/// The content of a regular file, within a limit.
fn read_bounded(
    folder: &Folder,
    name: &OsStr,
    path: &OsStr,
    limit: Limit,
) -> Result<Vec<u8>, HandInError> {
    let failed = |source| HandInError::Unreadable { path: shown(path), source };
    let file = open_regular(folder, name, path)?;
    let mut bytes = Vec::new();
    file.take(limit.bytes().saturating_add(1)).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > limit.bytes() {
        Err(HandInError::of_door(path, DoorError::TooLarge(limit)))
    } else {
        Ok(bytes)
    }
}

/// Opens a regular file.
fn open_regular(folder: &Folder, name: &OsStr, path: &OsStr) -> Result<File, HandInError> {
    folder.file(name).map_err(|refused| HandInError::of_door(path, refused.into()))
}

fn parent_and_name(path: &Path) -> io::Result<(Folder, OsString)> {
    let parent = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    Ok((Folder::at(parent)?, path.file_name().unwrap_or(OsStr::new(".")).to_owned()))
}

/// The path for messages.
fn shown(path: impl AsRef<OsStr>) -> String {
    let path = path.as_ref();
    if path.is_empty() { "the hand-in".to_owned() } else { printed::path(path.as_encoded_bytes()) }
}

fn unreadable(path: &OsStr, source: io::Error) -> HandInError {
    HandInError::Unreadable { path: shown(path), source }
}

fn not_copied(node: &HandInNode<'_>, source: io::Error) -> HandInError {
    HandInError::NotCopied { path: shown(node.path), source }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};

    use rustix::fs::{CWD, Mode};

    use super::*;

    fn message(path: &Path) -> String {
        HandIn::open(path).err().map(|error| error.to_string()).unwrap_or_default()
    }

    /// A chain of folders whose path is too long for the system.
    fn nest(folder: &Path, levels: usize) {
        let mut folder = Folder::at(folder).unwrap();
        for _ in 0..levels {
            folder = folder.make_folder("d".as_ref()).unwrap();
        }
    }

    #[test]
    fn exceeded_limits_are_reported_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ada");
        let fresh = || {
            let _ = fs::remove_dir_all(&path);
            fs::create_dir(&path).unwrap();
        };
        fresh();
        nest(&path, MAX_DEPTH);
        assert_eq!(message(&path), "");
        let deep = tempfile::tempdir().unwrap();
        nest(deep.path(), MAX_DEPTH + 1);
        assert!(
            message(deep.path()).contains("nested more than 100 deep"),
            "{}",
            message(deep.path())
        );

        fresh();
        let sparse = |length| File::create(path.join("a")).unwrap().set_len(length).unwrap();
        sparse(MAX_SIZE.bytes());
        assert_eq!(message(&path), "");
        fs::write(path.join("b"), "!").unwrap();
        assert!(
            message(&path).contains("1024 MiB together, counted up to b"),
            "{}",
            message(&path)
        );
        sparse(MAX_SIZE.bytes() + 1);
        // A single file may be a hand-in as well.
        assert!(message(&path.join("a")).contains("counted up to the hand-in"));

        fresh();
        let name = "n".repeat(250);
        fs::create_dir_all(path.join(&name).join(&name).join(&name).join(&name)).unwrap();
        assert!(message(&path).contains("the path has more than"), "{}", message(&path));
        assert!(message(&path).len() < 300, "{}", message(&path));

        fresh();
        rustix::fs::mkfifoat(CWD, path.join("p\u{1b}e"), Mode::RWXU).unwrap();
        assert!(message(&path).starts_with("p\u{fffd}e: is a pipe"), "{}", message(&path));
        assert!(message(&path.join("nothing")).starts_with("the hand-in: cannot be read"));
    }

    #[test]
    fn an_endlessly_nested_folder_is_refused_before_it_is_read() {
        let folder = tempfile::tempdir().unwrap();
        for number in 0..20 {
            File::create(folder.path().join(number.to_string())).unwrap();
        }
        let inner = Folder::at(folder.path()).unwrap();
        assert_eq!(inner.names(20).unwrap().len(), 20);
        assert_eq!(inner.names(7).unwrap().len(), 8);
    }

    #[test]
    fn copied_hand_in_has_plain_modes_and_no_shared_inodes() {
        let folder = tempfile::tempdir().unwrap();
        let (from, to) = (folder.path().join("from"), folder.path().join("to"));
        fs::create_dir_all(from.join("b")).unwrap();
        for (name, mode) in [("a", 0o4711), ("b/c", 0o600)] {
            fs::write(from.join(name), name).unwrap();
            fs::set_permissions(from.join(name), fs::Permissions::from_mode(mode)).unwrap();
        }
        fs::hard_link(from.join("a"), from.join("twin")).unwrap();
        symlink("/etc/passwd", from.join("link")).unwrap();
        HandIn::open(&from).unwrap().copy_to(&to).unwrap();
        let mode = |name: &str| fs::metadata(to.join(name)).unwrap().mode() & 0o7777;
        assert_eq!((mode("a"), mode("twin"), mode("b/c")), (0o755, 0o755, 0o644));
        assert_eq!(fs::read(to.join("b/c")).unwrap(), b"b/c");
        assert_eq!(fs::metadata(to.join("a")).unwrap().nlink(), 1);
        assert_eq!(fs::read_link(to.join("link")).unwrap(), Path::new("/etc/passwd"));
        // Existing files are not overwritten, and the hand-in is not at fault.
        assert!(HandIn::open(&from).unwrap().copy_to(&to).unwrap_err().is_fault());
    }
}
