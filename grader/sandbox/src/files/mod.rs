//! Files of others, looked up by name in open folders.
//!
//! No link is followed below an open folder. On Unix, a folder is a descriptor, so that nobody can exchange what a name
//! on the way stands for. Elsewhere it is a path: there, people grade what is theirs.

#[cfg(not(unix))]
mod elsewhere;
#[cfg(unix)]
mod unix;

use std::io;

#[cfg(not(unix))]
pub use elsewhere::*;
#[cfg(unix)]
pub use unix::*;

/// A kind of entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A regular file.
    File,
    /// A folder.
    Folder,
    /// A symbolic link.
    Link,
    /// A pipe.
    Pipe,
    /// A socket.
    Socket,
    /// A device, or a kind that has no name here.
    Device,
}

impl Kind {
    /// Its name, with an article.
    pub fn word(self) -> &'static str {
        match self {
            Self::File => "a file",
            Self::Folder => "a folder",
            Self::Link => "a link",
            Self::Pipe => "a pipe",
            Self::Socket => "a socket",
            Self::Device => "a device",
        }
    }
}

/// Facts of an entry.
#[derive(Debug, Clone, Copy)]
pub struct Facts {
    /// Its kind.
    pub kind: Kind,
    /// Its length in bytes.
    pub size: u64,
    /// Whether any user may execute it.
    pub is_executable: bool,
    /// When its content was last changed, in seconds since 1970.
    pub modified: i64,
}

/// Why a file is not opened.
#[derive(Debug)]
pub enum Refused {
    /// The system refuses it.
    Unreadable(io::Error),
    /// It is no regular file.
    Special(Kind),
}

impl From<io::Error> for Refused {
    fn from(error: io::Error) -> Self {
        Self::Unreadable(error)
    }
}
