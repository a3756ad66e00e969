//! The steps of shipped scenes do not allocate on their thread.

use simulator::simulation::Simulation;
use test_support::suite;

/// Enough steps to allocate every workspace.
const FIRST_STEPS: u64 = 12;

#[test]
fn shipped_scenes_do_not_allocate_after_the_first_steps() {
    let cases = suite().cases;
    let (mut looked, mut offenders) = (0, Vec::new());
    for case in &cases {
        let mut simulation = Simulation::new(&case.scene);
        for _ in 0..FIRST_STEPS {
            simulation.advance().unwrap();
        }
        let count =
            allocation_counter::measure(|| while simulation.advance().unwrap() {}).count_total;
        if count > 0 {
            offenders.push(format!("{}: {count}", case.id));
        }
        looked += u64::from(simulation.n_steps() > FIRST_STEPS);
    }
    assert!(offenders.is_empty(), "{offenders:#?}");
    assert!(looked > 50, "{looked} scenes are long enough");
}
