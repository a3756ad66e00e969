//! `--watch`: waits until a submission changes.

use std::fs;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, SystemTime};

use crate::interrupt::Interrupt;

/// Pause between two looks at the files.
const PAUSE: Duration = Duration::from_millis(300);

/// Maximum number of files that are looked at.
const MOST: usize = 10_000;

/// Path, time of the last change and size of each file.
pub(super) type Files = Vec<(PathBuf, Option<SystemTime>, u64)>;

/// The files of a submission: the program, or all files of the folder, links not followed.
pub(super) fn files(submission: &Path) -> Files {
    let (mut found, mut pending) = (Files::new(), vec![submission.to_path_buf()]);
    while let Some(path) = pending.pop() {
        let Ok(metadata) = fs::symlink_metadata(&path) else { continue };
        if metadata.is_dir() {
            let entries = fs::read_dir(&path).into_iter().flatten().flatten();
            pending.extend(entries.map(|entry| entry.path()));
        } else {
            found.push((path, metadata.modified().ok(), metadata.len()));
        }
        if found.len() + pending.len() > MOST {
            break;
        }
    }
    found.sort();
    found
}

/// Waits until the files differ from those before, and then until they no longer change. False if interrupted.
pub(super) fn wait(submission: &Path, before: &Files, interrupt: &Interrupt) -> bool {
    let mut last = before.clone();
    loop {
        if interrupt.is_requested() {
            return false;
        }
        thread::sleep(PAUSE);
        let now = files(submission);
        // A compiler may still be writing, or have removed the program to write it anew.
        if now != *before && now == last && !now.is_empty() {
            return true;
        }
        last = now;
    }
}
