//! A scratch folder. Those of killed graders stay in the user's folder for temporary files, which the system clears.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::{PREFIX, RANDOM};

/// Attempts to remove a folder in which a file is still in use, and the pause between two.
const ATTEMPTS: u32 = 100;
const PAUSE: Duration = Duration::from_millis(10);

/// A folder that is removed on drop.
#[derive(Debug)]
pub struct Scratch(PathBuf);

impl Scratch {
    /// Path of the folder.
    pub fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // A program that was ended may have its files open for a while.
        for _ in 0..ATTEMPTS {
            match fs::remove_dir_all(&self.0) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => std::thread::sleep(PAUSE),
                _ => return,
            }
        }
    }
}

/// Creates a folder in the user's folder for temporary files.
pub fn scratch_folder() -> io::Result<Scratch> {
    let random: String = (0..RANDOM).map(|_| fastrand::alphanumeric()).collect();
    let path = crate::files::temporary().join(format!("{PREFIX}{random}"));
    fs::create_dir(&path)?;
    Ok(Scratch(path))
}
