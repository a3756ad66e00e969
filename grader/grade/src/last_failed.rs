//! The verdicts of a submission the last time, for `--last-failed` and for what changed since.
//!
//! One file for each submission and folder of scenes, `spring-oracle/failed/HASH` in the user's cache folder: the names
//! of the scenes, one a line, with a `+` before those that passed. Without a cache folder nothing is stored.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use grader::boundary::own_file;
use grader::grading::{Grading, Since};
use grader::suite::hash_bytes;

use crate::installed::cache;
use crate::output::write_file;

/// The file for a submission and a folder of traces; `None` without a cache folder.
pub(super) fn file(submission: Option<&Path>, expected: &Path) -> Option<PathBuf> {
    let real = |path: &Path| scene::input::real_path(path).unwrap_or_else(|_| path.to_path_buf());
    let key = format!("{:?} {:?}", submission.map(real), real(expected));
    Some(cache()?.join("spring-oracle/failed").join(hash_bytes(key.as_bytes())))
}

/// The scenes that failed; none if the file does not exist.
pub(super) fn load(file: &Path) -> BTreeSet<String> {
    let lines = lines(file).into_iter();
    lines.filter(|line| !line.starts_with(PASSED)).collect()
}

fn lines(file: &Path) -> BTreeSet<String> {
    own_file::text(file).unwrap_or_default().lines().map(str::to_owned).collect()
}

/// Precedes the names of scenes that passed.
const PASSED: char = '+';

/// Replaces the verdicts of the graded scenes in the file, and returns which changed; those of other scenes stay. A file
/// that cannot be written is no error: only the next run depends on it.
pub(super) fn store(file: &Path, grading: &Grading) -> Option<Since> {
    let mut known = lines(file);
    let mut since = (!known.is_empty()).then(Since::default);
    for scene in grading.features.iter().flat_map(|feature| &feature.scenes) {
        let [failed, passed] = [scene.id.clone(), format!("{PASSED}{}", scene.id)];
        let is_pass = scene.comparison.verdict.is_pass();
        let (now, before) = if is_pass { (passed, failed) } else { (failed, passed) };
        if known.remove(&before)
            && let Some(since) = &mut since
        {
            let changed = if is_pass { &mut since.mended } else { &mut since.broken };
            changed.push(scene.id.clone());
        }
        known.insert(now);
    }
    let text: String = known.iter().map(|name| format!("{name}\n")).collect();
    let folder = file.parent().unwrap_or(Path::new(""));
    let _ = fs::create_dir_all(folder).and_then(|()| write_file(file, text.as_bytes()));
    since
}
