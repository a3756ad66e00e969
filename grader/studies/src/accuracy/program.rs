//! Measurement of a program, from its traces alone.
//!
//! Its time is the wall time of the whole process, including its start, reading the scene, writing the trace and the
//! sandbox. It is therefore shown next to the built-in simulator's times, but not ranked with them.

use std::time::Instant;

use scene::trace::Shape;
use scene::{Scene, write};

use super::ladder::{self, Method};
use super::measure::follow;
use super::reference::Reference;
use super::{AccuracyConfig, Cost, Point, RunOutcome, Target, Timing};
use grader::submission::program::{Program, SceneSource};
use grader::verdict::Verdict;

/// Maximum number of timed runs per time step.
const REPEATS: u32 = 3;

/// A scene at one time step of the ladder.
#[derive(Clone, Copy)]
pub(super) struct Rung<'a> {
    pub(super) scene: &'a Scene,
    pub(super) reference: &'a Reference,
    /// Steps in the place of each of the coarsest.
    pub(super) refinement: u64,
}

/// The spelling of the method by which the program goes through the scene, with a time step no longer than the scene's
/// own; what came of the first spelling where it does by none.
pub(super) fn spelling(
    program: &Program,
    method: &Method,
    target: &Target,
    reference: &Reference,
) -> Result<&'static str, RunOutcome> {
    let refinement = target.steps.div_ceil(ladder::STEPS).next_power_of_two();
    let scene = &method.scene(&target.scene, refinement);
    let mut first = None;
    let spellings = method.integrator.aliases.iter().chain([&method.integrator.name]).rev();
    for spelling in spellings {
        let (outcome, _) =
            run(program, &text(scene, spelling), Rung { scene, reference, refinement });
        match outcome {
            RunOutcome::Failed { step: 0, .. } => first = first.or(Some(outcome)),
            _ => return Ok(spelling),
        }
    }
    let none = || RunOutcome::Failed { step: 0, time: 0.0, reason: "it has no name".to_owned() };
    Err(first.unwrap_or_else(none))
}

/// The program on `scene`.
pub(super) fn measure(
    program: &Program,
    spelling: &str,
    rung: Rung<'_>,
    config: AccuracyConfig,
) -> Point {
    let scene = rung.scene;
    let text = text(scene, spelling);
    let (outcome, first) = run(program, &text, rung);
    let (mut times, mut spent) = (vec![first], first);
    // The first run counts too: every process starts cold.
    while times.len() < config.repeats.min(REPEATS) as usize && spent < config.budget {
        let (_, time) = run(program, &text, rung);
        spent += time;
        times.push(time);
    }
    let cost = Cost { time: Timing::of(times), work: None };
    Point { time_step: scene.time_step, steps: scene.n_steps(), outcome, cost }
}

/// A run, and its wall time in seconds.
fn run(program: &Program, text: &str, rung: Rung<'_>) -> (RunOutcome, f64) {
    let Rung { scene, reference, refinement } = rung;
    let started = Instant::now();
    let run = program.run(SceneSource::Xml(text), Shape::of(scene));
    let time = started.elapsed().as_secs_f64();
    let outcome = match run {
        Ok(mut run) => follow(&mut run, scene, reference, refinement),
        Err(verdict) => {
            let reason = match verdict {
                Verdict::Fail(failure) => failure.to_string(),
                other => other.to_string(),
            };
            RunOutcome::Failed { step: 0, time: 0.0, reason }
        }
    };
    (outcome, time)
}

/// The scene as XML, with this spelling of its integrator and without options of the built-in simulator.
fn text(scene: &Scene, spelling: &str) -> String {
    let mut bytes = Vec::new();
    // A parsed scene can always be written.
    let _ = write::write(scene, &mut bytes);
    let text = String::from_utf8(bytes).unwrap_or_default();
    text.replacen(&format!("\"{}\"", scene.integrator.name), &format!("\"{spelling}\""), 1)
}
