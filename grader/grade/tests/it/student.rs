//! Small simulator in C from the self-test, used as a submission.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use test_support::root;

/// Compiles the program, with a planted mistake unless it is empty, as `folder/student` or `folder/mistaken`. `None`,
/// with a printed reason, if there is no C compiler.
#[expect(clippy::print_stderr, reason = "a test that is skipped says why")]
pub(crate) fn compile(folder: &Path, mistake: &str) -> Option<PathBuf> {
    fs::create_dir_all(folder).unwrap();
    let program = folder.join("student");
    let source = root().join("grader/selftest/src/programs/student.c");
    let compiler =
        Command::new("cc").args(["-O2", "-o"]).arg(&program).arg(source).arg("-lm").output();
    match compiler {
        Ok(output) => {
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr))
        }
        Err(error) => {
            eprintln!("skipped: cc: {error}");
            return None;
        }
    }
    if mistake.is_empty() {
        return Some(program);
    }
    let script = folder.join("mistaken");
    let text =
        format!("#!/bin/sh\nexport MISTAKE='{mistake}'\nexec '{}' \"$@\"\n", program.display());
    fs::write(&script, text).unwrap();
    fs::set_permissions(&script, fs::metadata(&program).unwrap().permissions()).unwrap();
    Some(script)
}
