//! Copies of files and folders that an untrusted program may have created.

#[cfg(not(unix))]
mod elsewhere;
#[cfg(unix)]
mod unix;

#[cfg(not(unix))]
pub(crate) use elsewhere::*;
#[cfg(unix)]
pub(crate) use unix::*;

/// The deepest nesting of folders that is copied.
const MAX_DEPTH: usize = 100;

/// Limits of a copy.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds {
    /// Total length of all files, including holes.
    pub(crate) bytes: u64,
    /// Files, folders and links.
    pub(crate) entries: u64,
}
