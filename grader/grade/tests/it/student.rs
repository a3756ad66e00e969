//! Small simulator in C from the self-test, used as a submission.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;

use test_support::root;

static COMPILED: LazyLock<PathBuf> = LazyLock::new(|| {
    let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join("student-in-c");
    let source = root().join("grader/selftest/src/programs/student.c");
    let mut compiler = Command::new("cc");
    let compiled = compiler.args(["-O2", "-o"]).arg(&program).arg(source).arg("-lm").output();
    let compiled = compiled.unwrap();
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    program
});

/// Puts the program, with a planted mistake unless it is empty, in place as `folder/student` or `folder/mistaken`.
pub(crate) fn compile(folder: &Path, mistake: &str) -> PathBuf {
    fs::create_dir_all(folder).unwrap();
    let program = folder.join("student");
    fs::copy(&*COMPILED, &program).unwrap();
    if mistake.is_empty() {
        return program;
    }
    let script = folder.join("mistaken");
    let text =
        format!("#!/bin/sh\nexport MISTAKE='{mistake}'\nexec '{}' \"$@\"\n", program.display());
    fs::write(&script, text).unwrap();
    fs::set_permissions(&script, fs::metadata(&program).unwrap().permissions()).unwrap();
    script
}
