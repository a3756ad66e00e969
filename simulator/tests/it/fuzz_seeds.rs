//! Regression tests from the fuzzers: `ci/fuzz/seeds/<target>/` holds inputs that reach different parts of the
//! parsers of scenes and readers of traces, and every input that once failed.

#[path = "../../../ci/fuzz/src/checks.rs"]
mod checks;

use std::path::Path;

fn try_seeds(target: &str, check: fn(&[u8])) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../ci/fuzz/seeds").join(target);
    let entries = std::fs::read_dir(&folder).expect("the folder of the seeds can be read");
    let mut seeds: Vec<_> = entries.map(|entry| entry.expect("an entry").path()).collect();
    seeds.sort();
    assert!(seeds.len() >= 20, "{}: only {} seeds", folder.display(), seeds.len());
    for seed in seeds {
        let bytes = std::fs::read(&seed).expect("a seed can be read");
        let outcome = std::panic::catch_unwind(|| check(&bytes));
        assert!(outcome.is_ok(), "{}", seed.display());
    }
}

#[test]
fn xml_seeds_do_not_panic() {
    try_seeds("scene-xml", checks::scene_xml);
}

#[test]
fn json_seeds_do_not_panic() {
    try_seeds("scene-json", checks::scene_json);
}

#[test]
fn csv_trace_seeds_do_not_panic() {
    try_seeds("trace-csv", checks::trace_csv);
}

#[test]
fn binary_trace_seeds_do_not_panic() {
    try_seeds("trace-fosssim", checks::trace_fosssim);
}
