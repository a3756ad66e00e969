//! Steps that are redone from the states of a trace.

use diagnosis::steps;
use scene::trace::State;
use simulator::simulation::Simulation;
use test_support::suite;

/// Which steps of a scene's own trace are wrong, after a change of one of its states.
fn wrong(scene: &str, changed: Option<usize>) -> Vec<[u64; 2]> {
    let suite = suite();
    let case = suite.cases.iter().find(|case| case.id == scene).expect("the scene is there");
    let mut simulation = Simulation::new(&case.scene);
    let mut states = Vec::new();
    loop {
        let state = simulation.state();
        let (positions, velocities) = (state.positions.to_vec(), state.velocities.to_vec());
        states.push(State { time: None, positions, velocities });
        if !simulation.advance().unwrap() {
            break;
        }
    }
    if let Some(number) = changed {
        states[number].velocities[0] += 1e-6;
    }
    let (found, _) = steps::examine(&case.scene, &states, 0.0);
    assert_eq!(found.total + 1, states.len() as u64);
    found.ranges
}

#[test]
fn wrong_state_affects_only_its_own_steps() {
    let [one_step, two_step] =
        ["HigherOrder/swinging-triangle-midpoint", "HigherOrder/swinging-triangle-bdf2"];
    for scene in [one_step, two_step] {
        assert_eq!(wrong(scene, None), [[0; 2]; 0], "{scene}");
    }
    // The step that ends in the wrong state, the step that starts there, and a two-step method's next one.
    assert_eq!(wrong(one_step, Some(10)), [[10, 11]]);
    assert_eq!(wrong(two_step, Some(10)), [[10, 12]]);
    // The second step of a run is the first that uses an earlier state.
    assert_eq!(wrong(two_step, Some(0)), [[1, 2]]);
}
