//! A simulator that takes one step of a scene: a program, or the built-in one.

use scene::trace::{Shape, State};
use scene::{Scene, write};
use simulator::simulation::Simulation;

use crate::boundary::printed::Untrusted;
use crate::submission::StateSource;
use crate::submission::program::{Program, SceneSource};
use crate::verdict::{Failure, FormFault, Place, Quantity, Verdict};

/// Tolerance on a trace's first state: only the digits of the trace matter here, not physics.
const SAME: f64 = 1e-6;

/// Takes single steps of scenes.
pub trait Stepper: Sync {
    /// The name in reports.
    fn name(&self) -> Untrusted;

    /// Velocities after the only step of `scene`, `n·D` numbers, particle-major, by the integrator of this name.
    ///
    /// # Errors
    /// If the step fails or is not finite.
    fn step(&self, scene: &Scene, integrator: &str) -> Result<Vec<f64>, Failure>;
}

/// The simulator of this project.
#[derive(Debug, Clone, Copy, Default)]
pub struct BuiltIn;

impl Stepper for BuiltIn {
    fn name(&self) -> Untrusted {
        "built-in simulator".into()
    }

    fn step(&self, scene: &Scene, integrator: &str) -> Result<Vec<f64>, Failure> {
        let crashed = |reason: String| Failure::GaveUp { reason: reason.into() };
        let schema = simulator::vocabulary().integrator(integrator);
        let schema = schema.ok_or_else(|| crashed(format!("unknown integrator {integrator}")))?;
        let scene = Scene { integrator: schema, ..scene.clone() };
        let mut simulation = Simulation::new(&scene);
        simulation.advance().map_err(|error| crashed(error.to_string()))?;
        Ok(simulation.state().velocities.to_vec())
    }
}

impl Stepper for Program {
    fn name(&self) -> Untrusted {
        Self::name(self).clone()
    }

    fn step(&self, scene: &Scene, integrator: &str) -> Result<Vec<f64>, Failure> {
        let shape = Shape::of(scene);
        let text = text(scene, integrator);
        let mut run =
            self.run(SceneSource::Xml(&text), shape).map_err(|verdict| match verdict {
                Verdict::Fail(failure) => failure,
                // No step, and not the program's fault: it does not count against it.
                other => Failure::GaveUp { reason: other.to_string().into() },
            })?;
        let mut state = State::zeros(shape);
        let expected = 2;
        for number in 0..expected {
            if !run.read(&mut state)? {
                return Err(Failure::TooShort { states: number, expected });
            }
            check_finite(&state, number, shape)?;
            if number == 0 {
                check_start(scene, &state)?;
            }
        }
        let velocities = std::mem::take(&mut state.velocities);
        let mut further = State::zeros(shape);
        if run.read(&mut further)? { Err(Failure::TooLong { expected }) } else { Ok(velocities) }
    }
}

/// The scene as text, with this name of its integrator.
pub(super) fn text(scene: &Scene, integrator: &str) -> String {
    let mut bytes = Vec::new();
    // Every scene of the probe can be written.
    let _ = write::write(scene, &mut bytes);
    let text = String::from_utf8(bytes).unwrap_or_default();
    text.replacen(&format!("\"{}\"", scene.integrator.name), &format!("\"{integrator}\""), 1)
}

fn check_finite(state: &State, step: u64, shape: Shape) -> Result<(), Failure> {
    let count = shape.dimension.count();
    for (quantity, values) in
        [(Quantity::Position, &state.positions), (Quantity::Velocity, &state.velocities)]
    {
        if let Some(index) = values.iter().position(|value| !value.is_finite()) {
            let place = Place { step, particle: index / count, quantity, axis: index % count };
            return Err(Failure::NotFinite { location: None, place, value: values[index] });
        }
    }
    Ok(())
}

fn check_start(scene: &Scene, state: &State) -> Result<(), Failure> {
    let count = scene.dimension.count();
    let found = state.positions.chunks_exact(count).zip(state.velocities.chunks_exact(count));
    for (number, (particle, (position, velocity))) in scene.particles.iter().zip(found).enumerate()
    {
        let expected = particle.position[..count].iter().chain(&particle.velocity[..count]);
        let found = position.iter().chain(velocity);
        if expected.zip(found).any(|(expected, found)| (expected - found).abs() > SAME) {
            return Err(Failure::malformed(FormFault::Start { particle: number }));
        }
    }
    Ok(())
}
