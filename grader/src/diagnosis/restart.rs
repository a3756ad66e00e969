//! Steps of a program that start from the oracle's states.
//!
//! A scene of one step is written for each, with the oracle's state in the place of its start. What holds of a
//! program's steps from its own states need not hold of these: it may carry more from step to step than a state.

use std::io;

use simulator::scene::{Scene, write};
use simulator::trace::{Shape, State, TraceReader};

use super::steps::SingleSteps;
use crate::submission::StateSource;
use crate::submission::program::{Program, SceneSource};
use crate::suite::Case;

/// The most steps of a scene.
const MOST: u64 = 8;

/// What came of them.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Restarts {
    /// The steps that were made, from 1.
    pub made: Vec<u64>,
    /// Those of them that are wrong, or that the program did not make.
    pub wrong: Vec<u64>,
}

impl Restarts {
    /// In words.
    pub fn words(&self) -> String {
        let list =
            |steps: &[u64]| steps.iter().map(u64::to_string).collect::<Vec<String>>().join(", ");
        let Self { made, wrong } = self;
        match wrong.as_slice() {
            [] => format!("steps {} are right", list(made)),
            wrong if wrong.len() == made.len() => format!("steps {} are wrong", list(wrong)),
            wrong => format!("of steps {}, {} are wrong", list(made), list(wrong)),
        }
    }
}

/// Makes some steps of a scene from the states of `oracle`; `None` where its steps depend on more than a state, or
/// they cannot be written down.
pub fn restart(case: &Case, program: &Program, oracle: &mut dyn TraceReader) -> Option<Restarts> {
    let scene = &case.scene;
    // A wind depends on the time, and on where particles started.
    let is_windy = scene.forces.iter().any(|element| element.schema.depends_on().time);
    let is_xml = case.files.first()?.name.extension().is_some_and(|extension| extension == "xml");
    if is_windy || !is_xml {
        return None;
    }
    let n_steps = scene.n_steps();
    let chosen: Vec<u64> = match n_steps <= MOST {
        true => (0..n_steps).collect(),
        false => (0..MOST).map(|number| number * (n_steps - 1) / (MOST - 1)).collect(),
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

/// The scene's first step from `state`.
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
    let mut state = State::zeros(shape);
    let mut single = SingleSteps::new(one);
    single.add(start);
    for number in 0..2 {
        if !run.read(&mut state).is_ok_and(|is_state| is_state) {
            return false;
        }
        let all = || state.positions.iter().chain(&state.velocities);
        if !all().all(|value| value.is_finite()) {
            return false;
        }
        if number == 1 {
            single.add(&state);
        }
    }
    let (found, _) = single.finish();
    found.total > 0 && found.wrong == 0
}
