//! A file below a folder, opened without following a link below that folder.

use std::ffi::{CStr, CString};
use std::io::Read;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::ffi::OsStrExt;
use std::path::{Component, Path};

use rustix::fs::{CWD, Mode, OFlags, openat};

use super::{
    FOLDER, HandInError, MAX_ENTRIES, names, open_regular, read_bounded, shown, unreadable,
};
use crate::boundary::door::Door;

/// The name of a file, in an open folder.
#[derive(Debug)]
pub(crate) struct Place {
    folder: OwnedFd,
    name: CString,
    path: Vec<u8>,
}

impl Place {
    /// The file at the path `below` from the folder `base`.
    ///
    /// # Errors
    /// If a folder on the way cannot be opened, or is a link; or if the path is absolute or has a `..`.
    pub(crate) fn open(base: &Path, below: &Path) -> Result<Self, HandInError> {
        let base = if base.as_os_str().is_empty() { Path::new(".") } else { base };
        let folder = openat(CWD, base, FOLDER - OFlags::NOFOLLOW, Mode::empty())
            .map_err(|errno| unreadable(base.as_os_str().as_bytes(), errno))?;
        Self::descend(folder, below)
    }

    /// The file at the path `below` from the folder that holds this one.
    pub(crate) fn beside(&self, below: &Path) -> Result<Self, HandInError> {
        let path = below.as_os_str().as_bytes();
        let folder = self.folder.try_clone();
        let failed = |source| HandInError::Unreadable { path: shown(path), source };
        Self::descend(folder.map_err(failed)?, below)
    }

    fn descend(mut folder: OwnedFd, below: &Path) -> Result<Self, HandInError> {
        let path = below.as_os_str().as_bytes();
        let outside = || HandInError::Outside { path: shown(path) };
        let name = |part: Component<'_>| match part {
            Component::Normal(name) => CString::new(name.as_bytes()).map_err(|_| outside()),
            _ => Err(outside()),
        };
        let mut parts = below.components().filter(|part| *part != Component::CurDir);
        let last = name(parts.next_back().ok_or_else(outside)?)?;
        for part in parts {
            folder = openat(&folder, &name(part)?, FOLDER, Mode::empty())
                .map_err(|errno| unreadable(path, errno))?;
        }
        Ok(Self { folder, name: last, path: path.to_vec() })
    }

    /// The content, as much as the door lets through.
    pub(crate) fn read(&self, door: Door) -> Result<Vec<u8>, HandInError> {
        read_bounded(&self.folder, &self.name, &self.path, door.facts().limit)
    }

    /// The names in its folder, sorted.
    pub(crate) fn siblings(&self) -> Result<Vec<CString>, HandInError> {
        names(&self.folder, MAX_ENTRIES).map_err(|errno| unreadable(b"", errno))
    }

    /// The size and the first bytes of a regular file in its folder.
    pub(crate) fn head(&self, name: &CStr, bytes: u64) -> Result<(u64, Vec<u8>), HandInError> {
        let path = name.to_bytes();
        let failed = |source| HandInError::Unreadable { path: shown(path), source };
        let file = open_regular(self.folder.as_fd(), name, path)?;
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
