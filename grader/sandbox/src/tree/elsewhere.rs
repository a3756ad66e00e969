//! Copies by paths: regular files and folders.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::{Bounds, MAX_DEPTH};
use crate::files::{Folder, Kind, Refused};
use crate::{Exceeded, Limits, NotKept};

impl From<io::Error> for NotKept {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::NotFound => Self::Missing,
            _ => Self::Other(format!("cannot be copied: {error}")),
        }
    }
}

/// An open folder.
pub(crate) type Opened = Folder;

/// Opens a folder.
pub(crate) fn open_folder(path: &Path) -> io::Result<Opened> {
    Folder::at(path)
}

/// Copies the regular file `name` of a folder to `to`.
pub(crate) fn copy_file(folder: &Folder, name: &str, to: &Path, most: u64) -> Result<(), NotKept> {
    let mut from = folder.file(name.as_ref()).map_err(|refused| match refused {
        Refused::Unreadable(error) => error.into(),
        Refused::Special(Kind::Link) => NotKept::Link,
        Refused::Special(Kind::Folder) => NotKept::Folder,
        Refused::Special(_) => NotKept::Special,
    })?;
    if from.metadata()?.len() > most {
        return Err(NotKept::TooLarge(most));
    }
    io::copy(&mut from, &mut fs::File::create_new(to)?)?;
    Ok(())
}

/// Copies the content of a folder into an empty one.
pub(crate) fn copy(from: &Folder, to: &Folder, bounds: Bounds) -> Result<(), NotKept> {
    copy_below(from, to, bounds, &mut { bounds }, 0)
}

fn copy_below(
    from: &Folder,
    to: &Folder,
    bounds: Bounds,
    left: &mut Bounds,
    depth: usize,
) -> Result<(), NotKept> {
    if depth > MAX_DEPTH {
        return Err(NotKept::TooDeep(MAX_DEPTH));
    }
    for name in from.names(usize::MAX)? {
        left.entries = left.entries.checked_sub(1).ok_or_else(|| {
            NotKept::Other(format!("holds more than {} files and folders", bounds.entries))
        })?;
        let facts = from.facts(&name)?;
        match facts.kind {
            Kind::Folder => {
                let (from, to) = (from.folder(&name)?, to.make_folder(&name)?);
                copy_below(&from, &to, bounds, left, depth + 1)?;
            }
            Kind::File => {
                let rest = left.bytes.checked_sub(facts.size);
                left.bytes = rest.ok_or(NotKept::TooLarge(bounds.bytes))?;
                if let Ok(mut source) = from.file(&name) {
                    io::copy(&mut source, &mut to.make_file(&name, facts.is_executable)?)?;
                }
            }
            _ => {}
        }
    }
    Ok(())
}

/// The limit that the content of a folder exceeds, if any.
pub(crate) fn exceeded_size(folder: &Path, limits: Limits) -> Option<Exceeded> {
    let (mut bytes, mut entries) = (0, 0);
    let mut folders: Vec<PathBuf> = vec![folder.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            entries += 1;
            match entry.metadata() {
                Ok(metadata) if metadata.is_dir() => folders.push(entry.path()),
                Ok(metadata) => bytes += metadata.len(),
                Err(_) => {}
            }
        }
    }
    match () {
        () if bytes >= limits.trace => Some(Exceeded::Trace),
        () if entries > limits.files => Some(Exceeded::Files),
        () => None,
    }
}
