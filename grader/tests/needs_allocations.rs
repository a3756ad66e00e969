//! The steps of a shipped scene allocate nothing. This file has one test: allocations are counted over the process.

use std::path::Path;

use grader::suite::{Section, Suite};
use simulator::scene::ParseOptions;
use simulator::simulation::Simulation;

#[global_allocator]
static ALLOCATOR: dhat::Alloc = dhat::Alloc;

/// Enough that every room is made.
const FIRST_STEPS: u64 = 12;

#[test]
fn no_shipped_scene_allocates_once_its_room_is_made() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let sections = [
        (Section::Required, root.join("assets")),
        (Section::ExtraCredit, root.join("extracreditassets")),
    ];
    let cases = Suite::load(&sections, &ParseOptions::default()).unwrap().cases;
    let profiler = dhat::Profiler::builder().testing().build();
    let (mut looked, mut offenders) = (0, Vec::new());
    for case in &cases {
        let mut simulation = Simulation::new(&case.scene);
        for _ in 0..FIRST_STEPS {
            simulation.advance().unwrap();
        }
        let before = dhat::HeapStats::get().total_blocks;
        while simulation.advance().unwrap() {}
        let count = dhat::HeapStats::get().total_blocks - before;
        if count > 0 {
            offenders.push(format!("{}: {count}", case.id));
        }
        looked += u64::from(simulation.n_steps() > FIRST_STEPS);
    }
    assert!(offenders.is_empty(), "{offenders:#?}");
    assert!(looked > 50, "{looked} scenes are long enough");
    drop(profiler);
}
