//! The steps of a shipped scene allocate nothing. This file has one test: allocations are counted over the process.

use test_support::suite;

use simulator::simulation::Simulation;

#[global_allocator]
static ALLOCATOR: dhat::Alloc = dhat::Alloc;

/// Enough that every room is made.
const FIRST_STEPS: u64 = 12;

#[test]
fn no_shipped_scene_allocates_once_its_room_is_made() {
    let cases = suite().cases;
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
