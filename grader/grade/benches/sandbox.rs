//! What protection costs a run of a program that does nothing. See README.md beside this file.

use std::fs;
use std::path::Path;

use criterion::{Criterion, criterion_group, criterion_main};
use sandbox::{End, Job, Keep, Limits, Sandbox};

/// A program that does nothing.
const NOTHING: &str = "/bin/true";

fn runs(criterion: &mut Criterion) {
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
        keep: Keep::File("nothing".to_owned(), folder.path().join("nothing")),
        readable: Vec::new(),
        limits: Limits::default(),
    };
    let mut group = criterion.benchmark_group("run");
    let protected = Sandbox::open(Path::new(env!("CARGO_BIN_EXE_grade"))).expect("protection");
    for (name, sandbox) in [("unprotected", Sandbox::Unprotected), ("protected", protected)] {
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                let outcome = sandbox.run(&job).expect("it is run");
                assert_eq!(outcome.end, End::Exited(0));
            });
        });
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(50).without_plots();
    targets = runs
}
criterion_main!(benches);
