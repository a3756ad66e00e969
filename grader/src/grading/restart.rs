//! Restarts a program from the oracle's states.
//!
//! Each step becomes a scene with one step that starts from the oracle's state. The result may differ from the
//! program's steps from its own states: a program may carry more than the state from step to step.

use std::io;

use scene::trace::{Shape, State, TraceReader};
use scene::{Scene, write};

use crate::submission::StateSource;
use crate::submission::program::{Program, SceneSource};
use crate::suite::Case;
use diagnosis::findings::Restarts;
use diagnosis::steps::{Before, Judge};

/// Maximum number of steps for a scene.
const MOST: u64 = 8;

/// Redoes some steps of a scene from the states of `oracle`; `None` if its steps depend on more than the state, or the
/// scenes cannot be written.
pub(super) fn restart(
    case: &Case,
    program: &Program,
    oracle: &mut dyn TraceReader,
) -> Option<Restarts> {
    let scene = &case.scene;
    // Wind depends on the time and on the initial positions of the particles.
    let is_windy = scene.forces.iter().any(|element| element.schema.depends_on().time);
    let is_two_step = scene.integrator.equation.is_two_step();
    let is_xml = case.files.first()?.name.extension().is_some_and(|extension| extension == "xml");
    if is_windy || is_two_step || !is_xml {
        return None;
    }
    let n_steps = scene.n_steps();
    let chosen: Vec<u64> = if n_steps <= MOST {
        (0..n_steps).collect()
    } else {
        (0..MOST).map(|number| number * (n_steps - 1) / (MOST - 1)).collect()
    };
    let shape = Shape::of(scene);
    let mut state = State::zeros(shape);
    let mut restarts = Restarts::default();
    for step in 0..n_steps {
        if !oracle.read(&mut state).ok()? {
            return None;
        }
        if !chosen.contains(&step) {
            continue;
        }
        let one = one_step(scene, &state);
        let mut text = Vec::new();
        write::write(&one, &mut text as &mut dyn io::Write).ok()?;
        let text = String::from_utf8(text).ok()?;
        restarts.made.push(step + 1);
        if !is_right(&one, program, &text, &state) {
            restarts.wrong.push(step + 1);
        }
    }
    (!restarts.made.is_empty()).then_some(restarts)
}

/// The scene of one step from `state`.
fn one_step(scene: &Scene, state: &State) -> Scene {
    let mut one = scene.clone();
    one.duration = one.time_step;
    let dimension = scene.dimension.count();
    for (number, particle) in one.particles.iter_mut().enumerate() {
        let place = number * dimension;
        let range = place..place + dimension;
        particle.position[..dimension].copy_from_slice(&state.positions[range.clone()]);
        particle.velocity[..dimension].copy_from_slice(&state.velocities[range]);
    }
    one
}

fn is_right(one: &Scene, program: &Program, text: &str, start: &State) -> bool {
    let shape = Shape::of(one);
    let Ok(mut run) = program.run(SceneSource::Xml(text), shape) else { return false };
    let mut states = [State::zeros(shape), State::zeros(shape)];
    for state in &mut states {
        if !run.read(state).is_ok_and(|is_state| is_state) {
            return false;
        }
    }
    let mut all = states[1].positions.iter().chain(&states[1].velocities);
    if !all.all(|value| value.is_finite()) {
        return false;
    }
    let before = Before { step: 0, earlier: None, state: start };
    let step = Judge::new(one, 0.0).step(before, &states[1]);
    step.is_some_and(|[defect, noise]| defect[0] <= noise[0] && defect[1] <= noise[1])
}
