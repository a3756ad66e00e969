//! The doors of students' files: the table of docs/protection.md, the fuzz targets, and that there is no other way in.

use std::collections::BTreeMap;
use std::fs;

use grader::boundary::door::{Door, Limit};
use test_support::{assert_document, root};

use crate::folder::sources_below;

#[path = "../../../../ci/fuzz/src/doors.rs"]
mod checks;
#[path = "../../../../ci/fuzz/src/seeds.rs"]
mod seeds;

const START: &str =
    "| what a student writes | largest | parser | fuzz targets |\n| --- | --- | --- | --- |\n";

#[test]
fn the_page_on_protection_lists_every_door() {
    let rows = Door::ALL.map(|door| {
        let facts = door.facts();
        let largest = match facts.limit {
            Limit::Stream => "any: read as a stream".to_owned(),
            Limit::Bytes(count) if count >= 1 << 20 => Limit::Mebibytes(count >> 20).to_string(),
            limit => limit.to_string(),
        };
        assert!(root().join(facts.parser).is_file(), "{}", facts.parser);
        let targets: Vec<String> = facts.fuzz.iter().map(|target| format!("`{target}`")).collect();
        let targets = if targets.is_empty() { "–".to_owned() } else { targets.join(", ") };
        format!("| {} | {largest} | `{}` | {targets} |\n", facts.what, facts.parser)
    });
    let page = fs::read_to_string(root().join("docs/protection.md")).unwrap();
    let (before, rest) = page.split_once(START).expect("the table of doors");
    let (_, after) = rest.split_once("\n\n").expect("text after the table");
    let new = format!("{before}{START}{}\n{after}", rows.concat());
    assert_document("protection.md", &new, "cargo test --release -p grade --test it doors");
}

#[test]
fn every_door_with_a_parser_is_fuzzed() {
    let manifest = fs::read_to_string(root().join("ci/fuzz/Cargo.toml")).unwrap();
    let manifest: toml::Table = manifest.parse().unwrap();
    let built = manifest["bin"].as_array().unwrap().iter().map(|bin| bin["name"].as_str().unwrap());
    let mut built: Vec<&str> = built.collect();
    let script = fs::read_to_string(root().join("ci/fuzz.sh")).unwrap();
    let line = script.lines().find_map(|line| line.strip_prefix("for target in ")).unwrap();
    let mut run: Vec<&str> = line.trim_end_matches("; do").split(' ').collect();
    let mut known: Vec<&str> =
        Door::ALL.iter().flat_map(|door| door.facts().fuzz).copied().collect();
    built.sort_unstable();
    run.sort_unstable();
    known.sort_unstable();
    assert_eq!(known, built);
    assert_eq!(known, run);
}

/// Sources that open files themselves: the two modules for it, the walks of a hand-in's folders, and programs that
/// `grade init` writes.
const OPENING: [&str; 6] = [
    "grader/src/boundary/door.rs",
    "grader/src/boundary/own_file.rs",
    "grader/src/submission/hand_in.rs",
    "grader/src/submission/hand_in/place.rs",
    "grader/src/submission/init/simulate.rs",
    "grader/src/submission/init/springs.rs",
];

/// Ways to open a file for reading.
const WAYS: [&str; 9] = [
    "fs::read(",
    "fs::read_to_string(",
    "fs::open(",
    "File::open(",
    "File::options(",
    ".read(true)",
    "files::open_regular(",
    "Folder::at(",
    "from_path(",
];

#[test]
fn untrusted_files_are_opened_only_through_doors() {
    let folders = ["grader/src", "grader/report/src", "grader/platforms/src", "grader/grade/src"];
    let opens = |code: &String| WAYS.iter().any(|way| code.contains(way));
    let found: Vec<String> = sources(&folders)
        .into_iter()
        .filter(|(_, code)| opens(code))
        .map(|(name, _)| name)
        .collect();
    assert_eq!(found, OPENING, "read it by grader::boundary::door or grader::boundary::own_file");
}

/// Folders of the modules that see hand-ins.
const OF_HAND_INS: [&str; 4] = [
    "grader/src/class",
    "grader/src/creative",
    "grader/src/submission",
    "grader/grade/src/commands/class",
];

#[test]
fn modules_of_hand_ins_read_as_their_own_only_what_is_signed() {
    for (name, code) in sources(&OF_HAND_INS) {
        let is_signed = code.contains("boundary::seal");
        assert!(is_signed || !code.contains("own_file"), "{name}: read it by a door");
    }
}

/// The code of the sources in these folders, without tests, by the names of the files.
fn sources(folders: &[&str]) -> BTreeMap<String, String> {
    let sources = folders.iter().flat_map(|folder| sources_below(&root().join(folder)));
    let named = sources.map(|(path, text)| {
        let code = text.split("#[cfg(test)]\nmod ").next().unwrap().to_owned();
        (path.strip_prefix(root()).unwrap().display().to_string(), code)
    });
    named.collect()
}

#[test]
fn parsers_survive_fuzzing_seeds() {
    for (target, _) in checks::ALL {
        let seeds = seeds::seeds(target);
        assert!(seeds.len() >= 2, "{target}");
        for (name, bytes) in seeds {
            // Truncated inputs as well.
            for end in (0..=bytes.len()).step_by(bytes.len() / 50 + 1).chain([bytes.len()]) {
                let outcome = std::panic::catch_unwind(|| checks::run(target, &bytes[..end]));
                assert!(outcome.is_ok(), "{name}, {end} bytes");
            }
        }
    }
}
