//! Properties of any bytes that a student hands to the grader: a parser takes or refuses them, and what is shown of
//! them steers no terminal.
//!
//! The fuzzers call these, and `grader/grade/tests/it/doors.rs` does with the inputs of `ci/fuzz/src/seeds.rs`.

use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;
use std::sync::LazyLock;

use grader::boundary::printed::{Untrusted, steers};
use grader::boundary::seal::Seal;
use grader::class::layout::parse_export;
use grader::class::marks::{Marks, MarksRules};
use grader::class::record::Record;
use grader::class::roster::Roster;
use grader::class::similar::Sources;
use grader::creative::{Examined, starts_as_film};
use grader::rubric::creative::CreativeRule;
use grader::submission::folder::SubmissionManifest;
use grader::submission::received::unpack_bytes;
use platforms::gradescope::metadata::Metadata;
use report::creative::is_contact_sheet;
use report::html::gallery::MotionData;
use report::provenance::StoredReport;

/// Name of a fuzz target, and its check.
type Check = (&'static str, fn(&[u8]));

/// All targets of this file.
pub(crate) const ALL: [Check; 11] = [
    ("archive", archive),
    ("examined", examined),
    ("export", export),
    ("film", film),
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

/// The part before the first of these bytes, and the part after it.
fn parts(bytes: &[u8], separator: u8) -> (&[u8], &[u8]) {
    let end = bytes.iter().position(|byte| *byte == separator).unwrap_or(bytes.len());
    (&bytes[..end], bytes.get(end + 1..).unwrap_or_default())
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

/// The result of an examination: its line, and the picture after it.
fn examined(bytes: &[u8]) {
    let (line, picture) = parts(bytes, b'\n');
    if let Some(found) = Examined::parse(&[line, b"\n"].concat()) {
        let texts = match &found {
            Examined::NoScene => Vec::new(),
            Examined::NeedsMesh { place, .. } => vec![place],
            Examined::Malformed(error) => vec![error],
            Examined::Scene(facts) => {
                let either = |found| match found {
                    &Ok(ref text) | &Err(ref text) => text,
                };
                let found = [&facts.format, &facts.run, &facts.overlap].map(either);
                found.into_iter().chain(&facts.description).collect()
            }
        };
        assert!(texts.iter().all(|text| is_inert(text)), "{texts:?}");
        let again = serde_json::to_string(&found).expect("memory takes all") + "\n";
        assert!(Examined::parse(again.as_bytes()).is_some(), "{again}");
    }
    if let Some(motion) = MotionData::read(picture) {
        let script = serde_json::to_string(&motion).expect("memory takes all");
        assert!(!script.contains('<'), "{script}");
        assert!(MotionData::read(script.as_bytes()).is_some(), "{script}");
    }
    let _ = is_contact_sheet(picture);
}

fn export(bytes: &[u8]) {
    match parse_export(&text(bytes)) {
        Ok(found) => {
            for (name, facts) in found {
                let people = facts.people.iter().flat_map(|it| [&it.name, &it.id, &it.email]);
                assert!(people.chain([&name, &facts.submitted]).all(|text| is_inert(text)));
            }
        }
        Err((_, message)) => assert!(is_inert(&message), "{message:?}"),
    }
}

/// The name of a film, a zero byte, and its start.
fn film(bytes: &[u8]) {
    let (name, head) = parts(bytes, 0);
    let is_film = starts_as_film(Path::new(OsStr::from_bytes(name)), head);
    assert!(!is_film || head.len() >= 4, "a film of {} bytes", head.len());
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
    let text = String::from_utf8_lossy(bytes);
    assert!(
        Record::parse(&text.clone().into_owned().into(), "ada", &SEAL).is_err(),
        "nobody signed it"
    );
    let signed = SEAL.wrap("ada", &text).into();
    assert!(Record::parse(&signed, "eve", &SEAL).is_err(), "it is signed for another name");
    if let Ok(record) = Record::parse(&signed, "ada", &SEAL) {
        let again = record.render("ada", &SEAL).expect("memory takes all").into();
        // JSON may change the last bit of a number.
        let again = Record::parse(&again, "ada", &SEAL)
            .map(|again| Record { seconds: record.seconds, ..again });
        assert_eq!(again, Ok(record));
    }
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

/// A roster, or marks, a zero byte and the key of a gallery.
fn sheet(bytes: &[u8]) {
    if let Ok(roster) = Roster::parse(&text(bytes), Path::new("roster.csv")) {
        assert!(roster.students.iter().all(|student| is_inert(&student.shown())));
        let _ = roster.find_submissions(&["ada", "b_ob"]);
    }
    let (sheet, key) = parts(bytes, 0);
    let (sheet, key) = (text(sheet), text(key));
    let rules = MarksRules {
        submissions: &["ada", "bob"],
        folder: Path::new("class"),
        assignment: Some("t1m2"),
        rule: CreativeRule::default(),
    };
    for key in [None, Some(&key)] {
        match Marks::parse(&sheet, key, rules) {
            Ok(marks) => {
                assert!(
                    marks.of.values().flatten().flatten().all(|mark| (0.0..=10.0).contains(mark))
                );
                assert!(marks.remarks.iter().all(|remark| is_inert(remark)), "{:?}", marks.remarks);
            }
            Err(error) => assert!(is_inert(&error.to_string()), "{error:?}"),
        }
    }
}

fn tokens(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let names = ["a.cpp", "a.py", "a.rs", "a.java"];
    let _ = Sources::of("ada", names.map(|name| (name, &*text)));
}
