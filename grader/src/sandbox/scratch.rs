//! Scratch folders, and what is left of those whose grader was killed.

use std::fs;
use std::io;
use std::path::Path;

use tempfile::TempDir;

/// What the names of scratch folders begin with; the number of the process that made it follows.
const SCRATCH: &str = "spring-oracle-";

/// A new folder that is removed with what it returns.
pub(crate) fn scratch_folder() -> io::Result<TempDir> {
    tempfile::Builder::new().prefix(&format!("{SCRATCH}{}-", std::process::id())).tempdir()
}

/// Whether a path is named as a scratch folder is.
#[cfg(target_os = "linux")]
pub(super) fn is_scratch(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(SCRATCH.as_bytes()))
}

/// Removes the scratch folders of graders that were killed.
pub fn sweep() {
    for entry in fs::read_dir(std::env::temp_dir()).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let number = name.to_str().and_then(|name| name.strip_prefix(SCRATCH)?.split_once('-'));
        let Some(process) = number.and_then(|(number, _)| number.parse::<i32>().ok()) else {
            continue;
        };
        if !is_running(process) {
            // It may be another user's, or be swept by another grader.
            let _ = fs::remove_dir_all(entry.path());
        }
    }
}

/// Whether there is a process of this number; true where that is not to be told.
fn is_running(process: i32) -> bool {
    #[cfg(unix)]
    if let Some(process) = rustix::process::Pid::from_raw(process) {
        return rustix::process::test_kill_process(process) != Err(rustix::io::Errno::SRCH);
    }
    true
}
