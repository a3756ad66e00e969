//! A file below a folder, opened without following a link below that folder.

use std::ffi::{OsStr, OsString};
use std::io::Read;
use std::path::{Component, Path};

use sandbox::files::Folder;

use super::{HandInError, MAX_ENTRIES, open_regular, read_bounded, shown, unreadable};
use crate::boundary::door::Door;

/// The name of a file, in an open folder.
#[derive(Debug)]
pub(crate) struct Place {
    folder: Folder,
    name: OsString,
    path: OsString,
}

impl Place {
    /// The file at the path `below` from the folder `base`.
    ///
    /// # Errors
    /// If a folder on the way cannot be opened, or is a link; or if the path is absolute or has a `..`.
    pub(crate) fn open(base: &Path, below: &Path) -> Result<Self, HandInError> {
        let base = if base.as_os_str().is_empty() { Path::new(".") } else { base };
        let folder = Folder::at(base).map_err(|error| unreadable(base.as_os_str(), error))?;
        Self::descend(folder, below)
    }

    /// The file at the path `below` from the folder that holds this one.
    pub(crate) fn beside(&self, below: &Path) -> Result<Self, HandInError> {
        let path = below.as_os_str();
        let folder = self.folder.try_clone();
        let failed = |source| HandInError::Unreadable { path: shown(path), source };
        Self::descend(folder.map_err(failed)?, below)
    }

    fn descend(mut folder: Folder, below: &Path) -> Result<Self, HandInError> {
        let path = below.as_os_str();
        let outside = || HandInError::Outside { path: shown(path) };
        let mut names = Vec::new();
        for part in below.components().filter(|part| *part != Component::CurDir) {
            let Component::Normal(name) = part else { return Err(outside()) };
            names.push(name);
        }
        let last = names.pop().ok_or_else(outside)?;
        for name in names {
            folder = folder.folder(name).map_err(|error| unreadable(path, error))?;
        }
        Ok(Self { folder, name: last.to_owned(), path: path.to_owned() })
    }

    /// The content, as much as the door lets through.
    pub(crate) fn read(&self, door: Door) -> Result<Vec<u8>, HandInError> {
        read_bounded(&self.folder, &self.name, &self.path, door.facts().limit)
    }

    /// The names in its folder, sorted.
    pub(crate) fn siblings(&self) -> Result<Vec<OsString>, HandInError> {
        self.folder.names(MAX_ENTRIES).map_err(|error| unreadable("".as_ref(), error))
    }

    /// The size and the first bytes of a regular file in its folder.
    pub(crate) fn head(&self, name: &OsStr, bytes: u64) -> Result<(u64, Vec<u8>), HandInError> {
        let failed = |source| HandInError::Unreadable { path: shown(name), source };
        let file = open_regular(&self.folder, name, name)?;
        let size = file.metadata().map_err(failed)?.len();
        let mut head = Vec::new();
        file.take(bytes).read_to_end(&mut head).map_err(failed)?;
        Ok((size, head))
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn paths_cannot_leave_the_folder() {
        let folder = tempfile::tempdir().unwrap();
        let base = folder.path().join("base");
        fs::create_dir_all(base.join("in")).unwrap();
        fs::write(folder.path().join("secret"), "!").unwrap();
        fs::write(base.join("in/plain"), "text").unwrap();
        symlink("..", base.join("up")).unwrap();
        symlink("../secret", base.join("link")).unwrap();
        let read = |below: &str| {
            Place::open(&base, Path::new(below)).and_then(|it| it.read(Door::CreativeScene))
        };
        assert_eq!(read("in/plain").unwrap(), b"text");
        assert_eq!(read("./in/./plain").unwrap(), b"text");
        for below in ["../secret", "in/../../secret", "/etc/passwd", "up/secret", "link", "", "in"]
        {
            assert!(read(below).is_err(), "{below}");
        }
        let place = Place::open(&base, Path::new("in/plain")).unwrap();
        assert!(place.beside(Path::new("../link")).is_err());
        assert_eq!(
            place.beside(Path::new("plain")).unwrap().read(Door::CreativeScene).unwrap(),
            b"text"
        );
    }
}
