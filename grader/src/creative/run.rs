//! Runs of a scene that tell whether it blows up.
//!
//! A scene that blows up follows the time step, not its forces. The check runs the scene again at half of the time step
//! and compares the largest kinetic energies. An accurate motion has nearly the same one; a method that damps at large
//! time steps, or lets an orbit drift, stays within a factor of ten.

use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use scene::Scene;
use simulator::integrator::Interrupt;
use simulator::simulation::Simulation;

use super::motion::Motion;

/// Largest ratio of the largest kinetic energies at a time step and at half of it.
const MAX_RATIO: f64 = 10.0;

/// Kinetic energies below this share of the largest potential energy are rounding errors.
const ROUNDING: f64 = 1e-12;

/// Runs the scene, and again at half of the time step; each run has the time `limit`.
pub(super) fn check(scene: &Scene, limit: Duration) -> (Result<String, String>, Motion) {
    let mut motion = Motion::new(scene);
    let started = Instant::now();
    let first = energy_of(scene, limit, Some(&mut motion));
    let took = started.elapsed().as_secs_f64();
    let halved = Scene { time_step: 0.5 * scene.time_step, ..scene.clone() };
    let found = first.and_then(|first| {
        let second = energy_of(&halved, limit, None)
            .map_err(|error| format!("at half of the time step: {error}"))?;
        let h = scene.time_step;
        let kinetic = format!(
            "the largest kinetic energy is {} at the time step of {h} s, and {} at half of it",
            short(first.kinetic),
            short(second.kinetic)
        );
        if differ(&first, &second) {
            return Err(format!("it blows up: {kinetic}\nhelp: shorten the time step"));
        }
        Ok(format!("{} steps in {took:.1} s; {kinetic}", scene.n_steps()))
    });
    (found, motion)
}

/// Whether the motion of a scene follows its time step, in a run of any length.
///
/// # Errors
/// If a step fails, at the time step or at half of it.
pub fn blows_up(scene: &Scene) -> Result<bool, String> {
    let first = energy_of(scene, Duration::MAX, None)?;
    let halved = Scene { time_step: 0.5 * scene.time_step, ..scene.clone() };
    Ok(differ(&first, &energy_of(&halved, Duration::MAX, None)?))
}

/// Whether the largest kinetic energies of two runs differ by more than rounding and drift.
fn differ(first: &Peaks, second: &Peaks) -> bool {
    let floor = ROUNDING * first.potential.max(second.potential);
    let (large, small) = (first.kinetic.max(floor), second.kinetic.max(floor));
    large > MAX_RATIO * small || small > MAX_RATIO * large
}

/// A number with four digits.
pub(super) fn short(value: f64) -> String {
    match value {
        0.0 => "0".to_owned(),
        _ if (1e-3..1e5).contains(&value) => {
            let decimals = (3.0 - value.log10().floor()).max(0.0);
            format!("{value:.*}", decimals as usize)
        }
        _ => format!("{value:.3e}"),
    }
}

/// Largest energies of a run.
struct Peaks {
    kinetic: f64,
    /// The largest magnitude of the potential energy.
    potential: f64,
}

/// Runs a scene to its end.
fn energy_of(
    scene: &Scene,
    limit: Duration,
    mut motion: Option<&mut Motion>,
) -> Result<Peaks, String> {
    let started = Instant::now();
    let mut simulation = Simulation::new(scene);
    let _deadline = Deadline::set(&mut simulation, limit);
    let mut peaks = Peaks { kinetic: 0.0, potential: 0.0 };
    loop {
        let state = simulation.state();
        if let Some(motion) = &mut motion {
            motion.add(scene, state);
        }
        let energies = simulation.energies().map_err(|error| error.to_string())?;
        peaks.kinetic = peaks.kinetic.max(energies.kinetic);
        peaks.potential = peaks.potential.max(energies.potential.abs());
        let step = state.step + 1;
        let advanced = if started.elapsed() > limit { Ok(true) } else { simulation.advance() };
        if matches!(advanced, Ok(false)) {
            return Ok(peaks);
        }
        if started.elapsed() > limit {
            return Err(format!(
                "step {step} of {} is not reached within {} s\nhelp: shorten the scene, or set another limit with --seconds",
                scene.n_steps(),
                limit.as_secs_f64()
            ));
        }
        advanced.map_err(|error| error.to_string())?;
    }
}

/// Interrupts a simulation at a time; nothing once it is dropped.
struct Deadline {
    _ended: mpsc::Sender<()>,
}

impl Deadline {
    fn set(simulation: &mut Simulation, limit: Duration) -> Self {
        let interrupt = Interrupt::default();
        simulation.interrupt_by(&interrupt);
        let (ended, end) = mpsc::channel::<()>();
        thread::spawn(move || {
            if end.recv_timeout(limit) == Err(mpsc::RecvTimeoutError::Timeout) {
                interrupt.raise();
            }
        });
        Self { _ended: ended }
    }
}
