//! Regression tests from the fuzzers: inputs that reach different parts of the parsers of scenes and readers of traces,
//! and every input that failed before a correction.

#[path = "../../../ci/fuzz/src/checks.rs"]
mod checks;

#[path = "../../../ci/fuzz/src/seeds.rs"]
mod seeds;

fn try_seeds(target: &str, check: fn(&[u8])) {
    let seeds = seeds::seeds(target);
    assert!(seeds.len() >= 20, "{target}: only {} seeds", seeds.len());
    for (name, bytes) in seeds {
        let outcome = std::panic::catch_unwind(|| check(&bytes));
        assert!(outcome.is_ok(), "{name}");
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
