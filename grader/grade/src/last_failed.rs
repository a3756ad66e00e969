//! The scenes that a submission failed the last time, for `--last-failed`.
//!
//! One file for each submission and folder of scenes, `spring-oracle/failed/HASH` in the user's cache folder: the names
//! of the scenes, one a line. Without a cache folder nothing is stored.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use grader::boundary::own_file;
use grader::grading::Grading;
use grader::suite::hash_bytes;

use crate::installed::cache;
use crate::output::write_file;

/// The file for a submission, graded on the scenes beside `expected`; `None` without a cache folder.
pub(super) fn file(submission: Option<&Path>, expected: &Path) -> Option<PathBuf> {
    let real = |path: &Path| fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    let key = format!("{:?} {:?}", submission.map(real), real(expected));
    Some(cache()?.join("spring-oracle/failed").join(hash_bytes(key.as_bytes())))
}

/// The names in the file; none if it does not exist.
pub(super) fn load(file: &Path) -> BTreeSet<String> {
    let text = own_file::text(file).unwrap_or_default();
    text.lines().map(str::to_owned).collect()
}

/// Replaces the names of the graded scenes in the file; those of other scenes stay. A file that cannot be written is no
/// error: only the next `--last-failed` depends on it.
pub(super) fn store(file: &Path, grading: &Grading) {
    let mut names = load(file);
    for scene in grading.features.iter().flat_map(|feature| &feature.scenes) {
        if scene.comparison.verdict.is_pass() {
            names.remove(&scene.id)
        } else {
            names.insert(scene.id.clone())
        };
    }
    let text: String = names.iter().map(|name| format!("{name}\n")).collect();
    let folder = file.parent().unwrap_or(Path::new(""));
    let _ = fs::create_dir_all(folder).and_then(|()| write_file(file, text.as_bytes()));
}
