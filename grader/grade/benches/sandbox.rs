//! Benchmark of the sandbox: overhead of protection for a program that does nothing. See grader/benches/README.md.

#[path = "../../../simulator/benches/harness/mod.rs"]
mod harness;

use std::fs;
use std::path::Path;
use std::time::Duration;

use harness::Harness;
use sandbox::{End, Job, Keep, Limits, Sandbox};

/// A program that does nothing.
const NOTHING: &str = "/bin/true";

fn main() {
    if !Path::new(NOTHING).exists() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let scratch = folder.path().join("scratch");
    fs::create_dir(&scratch).expect("a folder");
    let job = Job {
        program: NOTHING.into(),
        arguments: Vec::new(),
        folder: scratch,
        input: None,
        keep: Keep::File("nothing".to_owned(), folder.path().join("nothing")),
        readable: Vec::new(),
        limits: Limits::default(),
    };
    let harness = Harness::new(50, Duration::from_millis(50));
    let protected = Sandbox::open(Path::new(env!("CARGO_BIN_EXE_grade"))).expect("protection");
    for (name, sandbox) in [("unprotected", Sandbox::Unprotected), ("protected", protected)] {
        harness.run(&format!("run/{name}"), 1, || {
            let outcome = sandbox.run(&job).expect("it is run");
            assert_eq!(outcome.end, End::Exited(0));
        });
    }
}
