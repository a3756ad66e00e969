//! The skeletons of `grade init` pass the simplest group in the sandbox.

#![expect(clippy::print_stderr, reason = "a skipped language is told")]

use std::path::Path;
use std::process::Command;
use test_support::root;

use grader::init::Language;

const GRADE: &str = env!("CARGO_BIN_EXE_grade");

/// Arguments that make the tool of a language readable if it is in a home folder.
fn readable(language: Language) -> Option<String> {
    let sysroot = Command::new("rustc").args(["--print", "sysroot"]).output().ok()?;
    let sysroot = String::from_utf8(sysroot.stdout).ok()?;
    (language == Language::Rust).then(|| sysroot.trim().to_owned())
}

fn is_there(tool: &str, readable: Option<&String>) -> bool {
    let folders = ["/usr/local", "/usr", "/"].into_iter().chain(readable.map(String::as_str));
    folders.into_iter().any(|folder| Path::new(folder).join("bin").join(tool).exists())
}

#[test]
fn every_skeleton_passes_the_simplest_group() {
    for language in Language::ALL {
        let readable = readable(language);
        if !is_there(language.tool(), readable.as_ref()) {
            eprintln!("skipped: there is no {}", language.tool());
            continue;
        }
        let folder = tempfile::tempdir().unwrap();
        let submission = folder.path().join("mine");
        let init = Command::new(GRADE).args(["init", language.name()]).arg(&submission).output();
        assert!(init.unwrap().status.success());
        let again = Command::new(GRADE).args(["init", language.name()]).arg(&submission).output();
        let again = again.unwrap();
        assert_eq!(again.status.code(), Some(2), "nothing is overwritten");
        assert!(String::from_utf8_lossy(&again.stderr).contains("already exists"));

        let mut grade = Command::new(GRADE);
        grade.arg(&submission).args(["--only", "Inertia", "--root"]).arg(root());
        if let Some(readable) = readable {
            grade.args(["--readable", &readable]);
        }
        let graded = grade.output().unwrap();
        assert_eq!(graded.status.code(), Some(0), "{}: {graded:?}", language.name());
    }
}
