//! What must hold of any bytes that a student hands to the grader: a parser takes or refuses them, and what is shown of
//! them steers no terminal.
//!
//! The fuzzers call these, and `grader/grade/tests/it/doors.rs` does with the inputs of `ci/fuzz/src/seeds.rs`.

use std::path::Path;
use std::sync::LazyLock;

use grader::boundary::printed::{Untrusted, steers};
use grader::boundary::seal::Seal;
use grader::class::record::Record;
use grader::class::roster::Roster;
use grader::class::similar::Sources;
use grader::submission::folder::SubmissionManifest;
use grader::submission::received::unpack_bytes;
use platforms::gradescope::metadata::Metadata;
use report::provenance::StoredReport;

/// Name of a fuzz target, and its check.
type Check = (&'static str, fn(&[u8]));

/// All targets of this file.
pub(crate) const ALL: [Check; 8] = [
    ("archive", archive),
    ("manifest", manifest),
    ("metadata", metadata),
    ("printed", printed),
    ("record", record),
    ("report", report),
    ("sheet", sheet),
    ("tokens", tokens),
];

/// Runs the check of this name.
pub(crate) fn run(target: &str, bytes: &[u8]) {
    for (_, check) in ALL.iter().filter(|(name, _)| *name == target) {
        check(bytes);
    }
}

fn text(bytes: &[u8]) -> Untrusted {
    String::from_utf8_lossy(bytes).into_owned().into()
}

fn is_inert(shown: &str) -> bool {
    !shown.contains(|character| steers(character) && character != '\n')
}

fn archive(bytes: &[u8]) {
    let folder = tempfile::tempdir().expect("a folder");
    if let Err(error) = unpack_bytes(bytes, &folder.path().join("into")) {
        assert!(is_inert(&error.to_string()), "{error:?}");
    }
    let beside = std::fs::read_dir(folder.path()).expect("a folder");
    assert!(beside.flatten().all(|entry| entry.file_name() == "into"));
}

fn manifest(bytes: &[u8]) {
    if let Err(error) = SubmissionManifest::parse(&text(bytes), Path::new("submission.toml")) {
        assert!(is_inert(&error.to_string()), "{error:?}");
    }
}

fn metadata(bytes: &[u8]) {
    let _ = Metadata::parse(&String::from_utf8_lossy(bytes));
}

fn printed(bytes: &[u8]) {
    let text = text(bytes);
    assert!(is_inert(&text.text()) && is_inert(&text.line()) && is_inert(&text.cell()));
    assert!(!text.line().contains('\n') && is_inert(&format!("{text:?}")));
    assert!(!text.cell().starts_with(['=', '+', '-', '@']));
}

fn record(bytes: &[u8]) {
    static SEAL: LazyLock<Seal> = LazyLock::new(|| {
        let folder = tempfile::tempdir().expect("a folder");
        Seal::of(folder.path()).expect("a key")
    });
    assert!(Record::parse(&text(bytes), "ada", &SEAL).is_err(), "nobody signed it");
}

fn report(bytes: &[u8]) {
    match StoredReport::parse(&text(bytes)) {
        Ok(report) => {
            assert_eq!(report.changed_inputs(&report), [""; 0]);
            assert_eq!(report.different_results(&report), [""; 0]);
        }
        Err(error) => assert!(is_inert(&error.to_string()), "{error:?}"),
    }
}

fn sheet(bytes: &[u8]) {
    if let Ok(roster) = Roster::parse(&text(bytes), Path::new("roster.csv")) {
        assert!(roster.students.iter().all(|student| is_inert(&student.shown())));
        let _ = roster.find_submissions(&["ada", "b_ob"]);
    }
}

fn tokens(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let names = ["a.cpp", "a.py", "a.rs", "a.java"];
    let _ = Sources::of("ada", names.map(|name| (name, &*text)));
}
