//! A scene that runs while its settings change.
//!
//! Between two changes of the settings, the states are those of a [`Simulation`](simulator::simulation::Simulation), bit
//! for bit. A change builds the simulation anew at the current state. A new time step h continues at the multiple of h that
//! is nearest to the current time.
//!
//! A separate thread takes the steps of a run ([`worker`](crate::worker)). A step that takes long does not hold up the
//! page: [`Run::finish`] gives up waiting, and says for how long the step has been running. A reset and a change of the
//! settings abandon it. A particle that is held, or let go, waits for its end.

use std::ops::RangeInclusive;
use std::sync::Arc;
use std::time::{Duration, Instant};

use scene::error::Problem;
use scene::schema::{Domain, IntegratorOptions, Refusal, Stencil};
use scene::{ForceElement, Location, Particles, Scene};
use serde::{Deserialize, Serialize};
use simulator::simulation::{FailureKind, SimulationError};
use simulator::vocabulary;

use crate::worker::{Done, Job, State, Stopped, Worker};

/// Tag of the wind.
const WIND: &str = "windforce";

/// Parameters of elastic bodies that are a modulus, and Poisson's ratio.
const MODULI: [&str; 3] = ["youngsmodulus", "alpha", "stiffness"];
const POISSON: &str = "poissonratio";

/// Time steps, in seconds.
const TIME_STEPS: RangeInclusive<f64> = 1e-9..=1e3;

/// Option of an integrator that says how fixed particles stay, and its value with which a held particle can be moved.
const PINS: (&str, &str) = ("pins", "elimination");

/// Settings of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub(crate) struct Settings {
    /// Name of the integrator.
    pub(crate) integrator: String,
    /// In seconds.
    time_step: f64,
    /// Factor of the mass of every particle.
    mass: f64,
    /// Factor of the stiffness of every spring.
    stiffness: f64,
    /// Added to the damping of every spring.
    damping: f64,
    /// Factor of the moduli of elastic bodies; `None` if the scene has no elastic body.
    modulus: Option<f64>,
    /// Poisson's ratio of the elements with that parameter; `None` if no element has it.
    poisson: Option<f64>,
    /// Strength of the wind; 0 if there is none.
    wind: f64,
}

/// A particle that the page holds, and where.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Hold {
    particle: usize,
    position: [f64; 3],
}

/// How far a run advances: one step, or the whole steps of a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Advance {
    Step,
    Seconds(f64),
}

/// A running scene.
pub(crate) struct Run {
    original: Arc<Scene>,
    budget: Duration,
    settings: Settings,
    hold: Option<Hold>,
    /// The particle that the page holds now; it takes effect once the running steps have ended.
    wanted: Option<Hold>,
    worker: Worker,
    /// Changes that the worker does not know yet: the scene, and that the state is not that of its last step.
    scene: Option<Scene>,
    placed: bool,
    /// Whether steps may start: the page is not paused.
    moves: bool,
    /// Simulated time that was asked for, and is less than a step.
    owed: f64,
    /// The last state that is finite, and its kinetic and potential energy; `None` before they are computed.
    state: State,
    energies: Option<[f64; 2]>,
    failure: Option<Failure>,
}

/// Why a run stands still.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Failure {
    kind: Standstill,
    message: String,
    help: String,
}

/// Sorts of standstill.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
enum Standstill {
    /// The energy has grown beyond all measure, or a number of the state is no longer finite.
    BlewUp,
    /// Another failure of a step.
    Failed,
    /// The settings cannot be simulated.
    Refused,
}

/// Result of [`Run::finish`].
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Status {
    /// Number of the state, and its time.
    step: u64,
    time: f64,
    /// Steps that were taken, and their simulated time.
    pub(crate) steps: u64,
    simulated: f64,
    /// Time that the steps took, in seconds.
    computing: f64,
    /// Simulated time that was asked for and left out, because the steps took too long.
    late: f64,
    /// Energies of the state; `None` if they are not finite, or not computed yet.
    kinetic: Option<f64>,
    potential: Option<f64>,
    failure: Option<Failure>,
    /// Steps that have not ended.
    underway: Option<Underway>,
}

/// Steps that have not ended.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Underway {
    /// For how long they have been running.
    seconds: f64,
    /// Whether their states are no longer wanted; the next steps wait for their end.
    abandoned: bool,
}

impl Settings {
    /// The settings of the scene as it is.
    pub(crate) fn of(scene: &Scene) -> Self {
        Self {
            integrator: scene.integrator.name.to_owned(),
            time_step: scene.time_step,
            mass: 1.0,
            stiffness: 1.0,
            damping: 0.0,
            modulus: scene.forces.iter().any(is_elastic).then_some(1.0),
            poisson: poisson(scene),
            wind: wind(scene),
        }
    }

    /// The scene with these settings, and a particle held. It has no end.
    fn apply(&self, original: &Scene, held: Option<usize>) -> Result<Scene, Failure> {
        let refused = |message: String, help: &str| Failure {
            kind: Standstill::Refused,
            message,
            help: help.to_owned(),
        };
        let vocabulary = vocabulary();
        let integrator = vocabulary.integrator(&self.integrator).ok_or_else(|| {
            refused(format!("there is no integrator {:?}", self.integrator), "choose another one")
        })?;
        let h = self.time_step;
        if !(TIME_STEPS.contains(&h) || h == original.time_step) {
            let help =
                format!("give a number from {:e} to {}", TIME_STEPS.start(), TIME_STEPS.end());
            return Err(refused(format!("the time step is {h} s"), &help));
        }
        let mut scene = Scene { time_step: h, duration: f64::MAX, integrator, ..original.clone() };
        if integrator != original.integrator {
            scene.integrator_options = IntegratorOptions::defaults(integrator);
        }
        for (number, particle) in scene.particles.iter_mut().enumerate() {
            particle.mass *= self.mass;
            if !Domain::Positive.contains(particle.mass) {
                let help = format!("it must be {}", Domain::Positive.describe());
                let message = format!("the mass of particle {number} is {}", particle.mass);
                return Err(refused(message, &help));
            }
        }
        for force in &mut scene.forces {
            if force.schema.stencil == Stencil::Edge {
                self.change(force);
                continue;
            }
            for name in MODULI.into_iter().filter(|name| force.schema.has_parameter(name)) {
                *force.parameter_mut(name) *= self.modulus.unwrap_or(1.0);
            }
            if let Some(ratio) = self.poisson.filter(|_| self.poisson != poisson(original))
                && force.schema.has_parameter(POISSON)
            {
                *force.parameter_mut(POISSON) = ratio;
            }
        }
        if self.wind != wind(original) {
            scene.forces.retain(|force| force.schema.tag != WIND);
            let schema = vocabulary.force(WIND).filter(|_| self.wind != 0.0);
            scene.forces.extend(schema.map(|schema| ForceElement {
                schema,
                particles: Particles::new(),
                edge: None,
                parameters: schema.values(&[("strength", self.wind)]),
                location: Location::default(),
            }));
        }
        if let Some(held) = held {
            scene.particles[held].fixed = true;
            // Other integrators have no such option.
            let _ = scene.integrator_options.set(PINS.0, PINS.1);
        }
        for force in &scene.forces {
            for (parameter, value) in force.schema.parameters.iter().zip(&force.parameters) {
                if !parameter.domain.contains(*value) {
                    let (tag, name) = (force.schema.tag, parameter.name);
                    let help = format!("it must be {}", parameter.domain.describe());
                    return Err(refused(format!("{name} of <{tag}> is {value}"), &help));
                }
            }
            if let Some(Refusal { because, remedy }) = (integrator.refuses)(force) {
                let (integrator, tag) = (integrator.name, force.schema.tag);
                let problem = Problem::RefusedForce { integrator, tag, because, remedy };
                return Err(refused(problem.to_string(), remedy));
            }
        }
        Ok(scene)
    }

    /// Changes the stiffness and the damping of a spring.
    fn change(&self, spring: &mut ForceElement) {
        if spring.schema.has_parameter("k") {
            *spring.parameter_mut("k") *= self.stiffness;
        }
        if spring.schema.has_parameter("b") {
            *spring.parameter_mut("b") += self.damping;
        }
    }
}

fn is_elastic(force: &ForceElement) -> bool {
    MODULI.iter().any(|name| force.schema.has_parameter(name))
}

/// Poisson's ratio of the first element that has one.
fn poisson(scene: &Scene) -> Option<f64> {
    let mut with = scene.forces.iter().filter(|force| force.schema.has_parameter(POISSON));
    with.next().map(|force| force.parameter(POISSON))
}

/// Strength of a scene's wind.
fn wind(scene: &Scene) -> f64 {
    let winds = scene.forces.iter().filter(|force| force.schema.tag == WIND);
    winds.map(|force| force.parameter("strength")).sum()
}

impl Run {
    /// A run at the scene's initial state. `budget` is the computing time of a frame.
    pub(crate) fn new(original: Arc<Scene>, budget: Duration) -> Self {
        let mut run = Self {
            budget,
            settings: Settings::of(&original),
            hold: None,
            wanted: None,
            worker: Worker::start(budget),
            scene: None,
            placed: false,
            moves: false,
            owed: 0.0,
            state: State {
                step: 0,
                time: 0.0,
                positions: original.positions(),
                velocities: original.velocities(),
            },
            energies: None,
            failure: None,
            original,
        };
        run.rebuild();
        run
    }

    /// A second run at the same state.
    pub(crate) fn beside(&self) -> Self {
        let mut run = Self::new(Arc::clone(&self.original), self.budget);
        (run.settings, run.hold, run.wanted) = (self.settings.clone(), self.hold, self.wanted);
        run.state = self.state.clone();
        run.rebuild();
        run
    }

    /// Returns to the scene's initial state and its settings.
    pub(crate) fn restart(&mut self) {
        self.settings = Settings::of(&self.original);
        (self.hold, self.wanted) = (None, None);
        self.reset();
    }

    /// Returns to the initial state.
    pub(crate) fn reset(&mut self) {
        self.state.positions = self.original.positions();
        self.state.velocities = self.original.velocities();
        (self.state.time, self.owed) = (0.0, 0.0);
        self.rebuild();
    }

    /// Continues with other settings, from the last state that is finite.
    pub(crate) fn set(&mut self, settings: &Settings) {
        if *settings != self.settings {
            self.settings = settings.clone();
            self.rebuild();
        }
    }

    /// Holds a particle at a position, at rest and as if it was fixed, or lets it go. A fixed particle that is let go has
    /// its velocity again.
    pub(crate) fn hold(&mut self, hold: Option<Hold>) {
        self.wanted = hold;
        self.take_hold();
    }

    /// Holds what the page holds, unless steps are running.
    fn take_hold(&mut self) {
        let hold = self.wanted;
        if self.failure.is_some() || hold == self.hold || self.worker.is_running() {
            return;
        }
        let dimension = self.original.dimension.count();
        let own = |particle: usize| particle * dimension..(particle + 1) * dimension;
        let before = self.hold.map(|hold| hold.particle);
        if let Some(particle) = before.filter(|particle| self.original.particles[*particle].fixed) {
            let velocity = self.original.particles[particle].velocity;
            self.state.velocities[own(particle)].copy_from_slice(&velocity[..dimension]);
        }
        if let Some(Hold { particle, position }) = hold {
            self.state.positions[own(particle)].copy_from_slice(&position[..dimension]);
            self.state.velocities[own(particle)].fill(0.0);
        }
        self.hold = hold;
        if before == hold.map(|hold| hold.particle) {
            self.place();
        } else {
            self.rebuild();
        }
    }

    /// Builds the simulation anew, at the last state that is finite. Abandons steps that are running.
    fn rebuild(&mut self) {
        self.worker.abandon();
        match self.settings.apply(&self.original, self.hold.map(|hold| hold.particle)) {
            Ok(scene) => {
                self.scene = Some(scene);
                self.failure = None;
                self.state.step = (self.state.time / self.settings.time_step).round() as u64;
                self.place();
            }
            Err(failure) => self.failure = Some(failure),
        }
    }

    /// Lets the next steps start from the last state that is finite.
    fn place(&mut self) {
        self.state.time = self.state.step as f64 * self.settings.time_step;
        (self.placed, self.energies) = (true, None);
    }

    /// Starts to advance; [`Self::finish`] waits for the steps. While steps are running, no others are started: a step that
    /// is asked for is the one that is running, and time that is asked for is left out beyond one step.
    pub(crate) fn begin(&mut self, advance: Advance) {
        self.moves = advance != Advance::Seconds(0.0);
        match advance {
            Advance::Step if self.worker.is_running() => {}
            Advance::Step => self.owed = self.settings.time_step,
            Advance::Seconds(seconds) => self.owed += seconds,
        }
        self.hand_over();
    }

    /// Hands the worker the steps that are due, and the state it does not know, unless it is busy.
    fn hand_over(&mut self) {
        if self.worker.is_busy() || self.failure.is_some() {
            return;
        }
        let h = self.settings.time_step;
        // A sum of frames falls short of a step by rounding.
        let due = if self.moves { (self.owed / h * (1.0 + 1e-9)).floor() } else { 0.0 };
        if due == 0.0 && !self.placed {
            return;
        }
        self.owed -= due * h;
        self.worker.begin(Job {
            scene: self.scene.take(),
            start: std::mem::take(&mut self.placed).then(|| self.state.clone()),
            steps: due as u64,
        });
    }

    /// Waits for the steps, until `deadline` at most.
    ///
    /// # Errors
    /// If the thread of the steps has ended by an internal error.
    pub(crate) fn finish(&mut self, deadline: Instant) -> Result<Status, Stopped> {
        let h = self.settings.time_step;
        let (mut steps, mut computing) = (0, 0.0);
        while self.worker.is_busy() {
            let was_running = self.worker.is_running();
            let Some(done) = self.worker.wait(deadline)? else { break };
            if !was_running {
                // These steps were abandoned. The next ones waited for their end.
                self.hand_over();
                continue;
            }
            (steps, computing) = (done.steps, done.computing.as_secs_f64());
            self.owed += (done.asked - steps) as f64 * h;
            self.take(done);
            break;
        }
        let late = if self.failure.is_none() { (self.owed - h).max(0.0) } else { 0.0 };
        // States that were not computed in time are left out.
        self.owed = self.owed.min(h);
        let [kinetic, potential] = [0, 1].map(|which| {
            self.energies.map(|energies| energies[which]).filter(|energy| energy.is_finite())
        });
        Ok(Status {
            step: self.state.step,
            time: self.state.time,
            steps,
            simulated: steps as f64 * h,
            computing,
            late,
            kinetic,
            potential,
            failure: self.failure.clone(),
            underway: self.worker.busy_since().map(|since| Underway {
                seconds: since.elapsed().as_secs_f64(),
                abandoned: !self.worker.is_running(),
            }),
        })
    }

    fn take(&mut self, done: Done) {
        if let Some(state) = done.end {
            self.state = state;
        }
        self.energies = Some(done.energies);
        self.failure = done.failure.as_ref().map(Failure::of);
        if done.blown_up && self.failure.is_none() {
            self.failure = Some(Failure {
                kind: Standstill::BlewUp,
                message: format!("the kinetic energy is {:.1e} J", done.energies[0]),
                help: "shorten the time step, or take an implicit method".to_owned(),
            });
        }
        self.take_hold();
    }

    /// The last positions that are finite, `n·D`.
    pub(crate) fn positions(&self) -> &[f64] {
        &self.state.positions
    }
}

impl Hold {
    /// Whether the particle is one of the scene's, and its position a point.
    pub(crate) fn is_of(&self, scene: &Scene) -> bool {
        let is_point = self.position.iter().all(|value| value.is_finite());
        is_point && self.particle < scene.particles.len()
    }
}

impl Failure {
    fn of(error: &SimulationError) -> Self {
        let kind = match error.kind {
            FailureKind::NotFinite { .. } => Standstill::BlewUp,
            _ => Standstill::Failed,
        };
        Self { kind, message: error.kind.to_string(), help: error.kind.remedy().to_owned() }
    }
}

#[cfg(test)]
mod tests {
    use scene::{ParseOptions, xml};
    use simulator::generate::{Disc, Generator};
    use simulator::simulation::Simulation;

    use super::*;

    const BUDGET: Duration = Duration::from_secs(60);

    /// Takes the steps, however long they take.
    fn advance(run: &mut Run, advance: Advance) -> Status {
        run.begin(advance);
        run.finish(Instant::now() + Duration::from_secs(600)).ok().unwrap()
    }

    fn scene() -> Scene {
        let text = r#"<scene><duration time="1"/><integrator type="symplectic-euler" dt="0.01"/>
            <particle m="1" px="0" py="0" vx="0.1" vy="0" fixed="1"/>
            <particle m="1" px="1.2" py="0.1" vx="0" vy="0" fixed="0"/>
            <edge i="0" j="1"/><springforce edge="0" k="100" l0="1"/></scene>"#;
        xml::parse(text, "scene.xml", &vocabulary(), &ParseOptions::default()).unwrap().scene
    }

    fn changed(run: &Run, change: impl FnOnce(&mut Settings)) -> Settings {
        let mut settings = run.settings.clone();
        change(&mut settings);
        settings
    }

    #[test]
    fn a_run_is_the_simulation_of_the_scene() {
        let scene = scene();
        let mut run = Run::new(Arc::new(scene.clone()), BUDGET);
        // Frames of 1/60 s, which are no multiple of the step.
        let steps: u64 =
            (0..60).map(|_| advance(&mut run, Advance::Seconds(1.0 / 60.0)).steps).sum();
        assert_eq!(steps, 100);
        let mut simulation = Simulation::new(&scene);
        while simulation.advance().unwrap() {}
        let state = simulation.state();
        assert_eq!((run.positions(), &*run.state.velocities), (state.positions, state.velocities));
        assert_eq!(run.state.time, state.time);
        run.reset();
        assert_eq!(run.positions(), scene.positions());
        assert_eq!(advance(&mut run, Advance::Step).step, 1);
    }

    #[test]
    fn settings_take_effect_from_the_current_state() {
        let scene = scene();
        let mut run = Run::new(Arc::new(scene.clone()), BUDGET);
        advance(&mut run, Advance::Seconds(0.1));
        let before = run.state.clone();
        run.set(&changed(&run, |settings| {
            (settings.stiffness, settings.damping, settings.wind) = (4.0, 0.5, 2.0);
            settings.mass = 2.5;
            settings.integrator = "implicit-euler".to_owned();
        }));
        assert_eq!(run.positions(), before.positions);
        let mut expected = scene.clone();
        expected.integrator = vocabulary().integrator("implicit-euler").unwrap();
        expected.integrator_options = IntegratorOptions::defaults(expected.integrator);
        (*expected.forces[0].parameter_mut("k"), *expected.forces[0].parameter_mut("b")) =
            (400.0, 0.5);
        expected.particles.iter_mut().for_each(|particle| particle.mass = 2.5);
        let schema = vocabulary().force(WIND).unwrap();
        let wind = ForceElement {
            schema,
            particles: Particles::new(),
            edge: None,
            parameters: schema.values(&[("strength", 2.0)]),
            location: Location::default(),
        };
        expected.forces.push(wind);
        let mut simulation = Simulation::new(&expected);
        simulation.set_state(10, None, &before.positions, &before.velocities);
        simulation.advance().unwrap();
        advance(&mut run, Advance::Step);
        assert_eq!(run.positions(), simulation.state().positions);
        // A longer step continues at its nearest multiple.
        run.set(&changed(&run, |settings| settings.time_step = 0.04));
        assert_eq!((run.state.step, run.state.time), (3, 0.12));
    }

    #[test]
    fn modulus_and_poissons_ratio_are_those_of_elastic_bodies() {
        let scene = Disc { rings: 1, ..Disc::default() }.scene().unwrap();
        let mut run = Run::new(Arc::new(scene.clone()), BUDGET);
        assert_eq!((run.settings.modulus, run.settings.poisson), (Some(1.0), Some(0.3)));
        run.set(&changed(&run, |settings| {
            (settings.modulus, settings.poisson) = (Some(0.5), Some(0.2));
        }));
        let mut expected = scene;
        for force in expected.forces.iter_mut().filter(|force| force.schema.is_triangle()) {
            *force.parameter_mut("youngsmodulus") *= 0.5;
            *force.parameter_mut("poissonratio") = 0.2;
        }
        let mut simulation = Simulation::new(&expected);
        for _ in 0..5 {
            advance(&mut run, Advance::Step);
            simulation.advance().unwrap();
        }
        assert_eq!(run.positions(), simulation.state().positions);
        // A scene of springs has neither.
        let run = Run::new(Arc::new(self::scene()), BUDGET);
        assert_eq!((run.settings.modulus, run.settings.poisson), (None, None));
    }

    #[test]
    fn invalid_settings_stop_the_run_with_a_reason() {
        let scene = scene();
        let mut run = Run::new(Arc::new(scene.clone()), BUDGET);
        let before = run.positions().to_vec();
        type Edit = fn(&mut Settings);
        let wrong: [(&str, Edit); 8] = [
            ("integrator \"adams\"", |settings| settings.integrator = "adams".to_owned()),
            ("time step is 0 s", |settings| settings.time_step = 0.0),
            ("time step is NaN s", |settings| settings.time_step = f64::NAN),
            ("mass of particle 0 is 0", |settings| settings.mass = 0.0),
            ("mass of particle 0 is NaN", |settings| settings.mass = f64::NAN),
            ("k of <springforce> is -100", |settings| settings.stiffness = -1.0),
            ("k of <springforce> is inf", |settings| settings.stiffness = 1e307),
            ("projected-newton cannot simulate", |settings| {
                (settings.integrator, settings.damping) = ("projected-newton".to_owned(), 0.5);
            }),
        ];
        for (message, change) in wrong {
            run.set(&changed(&run, change));
            let failure = advance(&mut run, Advance::Seconds(0.1)).failure.unwrap();
            assert_eq!(failure.kind, Standstill::Refused);
            assert!(failure.message.contains(message), "{failure:?}");
            assert_eq!(run.positions(), before);
            run.set(&Settings::of(&scene));
        }
        assert_eq!(advance(&mut run, Advance::Seconds(0.1)).failure, None);
    }

    #[test]
    fn explicit_euler_blows_up_and_the_last_state_is_kept() {
        let scene = scene();
        let mut run = Run::new(Arc::new(scene.clone()), BUDGET);
        run.set(&changed(&run, |settings| {
            (settings.integrator, settings.time_step) = ("explicit-euler".to_owned(), 0.5);
        }));
        let status = (0..5000).map(|_| advance(&mut run, Advance::Seconds(0.5))).last().unwrap();
        let [kinetic, potential] = [status.kinetic, status.potential].map(Option::unwrap);
        assert!(kinetic + potential < 1e18, "said at {kinetic} J and {potential} J");
        assert_eq!(status.failure.unwrap().kind, Standstill::BlewUp);
        assert!(status.time > 1.0, "{}", status.time);
        assert!(run.positions().iter().all(|value| value.is_finite()));
        run.set(&Settings::of(&scene));
        run.reset();
        assert_eq!(advance(&mut run, Advance::Seconds(0.1)).failure, None);
    }

    #[test]
    fn overlong_steps_are_skipped() {
        let scene = scene();
        let mut run = Run::new(Arc::new(scene.clone()), Duration::ZERO);
        let status = advance(&mut run, Advance::Seconds(0.1));
        assert_eq!((status.steps, status.simulated), (1, 0.01));
        assert!((status.late - 0.08).abs() < 1e-12, "{status:?}");
        // A step is owed, but not taken in a pause.
        assert_eq!(advance(&mut run, Advance::Seconds(0.0)).steps, 0);
        assert_eq!(advance(&mut run, Advance::Seconds(1e-9)).steps, 1);
    }

    #[test]
    fn held_particle_stays_and_is_released() {
        let scene = scene();
        let mut run = Run::new(Arc::new(scene.clone()), BUDGET);
        let held = |particle, position: [f64; 2]| {
            Some(Hold { particle, position: [position[0], position[1], 0.0] })
        };
        run.hold(held(1, [0.3, 1.4]));
        advance(&mut run, Advance::Seconds(0.1));
        assert_eq!(run.positions()[2..], [0.3, 1.4]);
        run.hold(held(1, [0.4, 1.4]));
        advance(&mut run, Advance::Seconds(0.1));
        assert_eq!(run.positions()[2..], [0.4, 1.4]);
        run.hold(None);
        advance(&mut run, Advance::Seconds(0.1));
        assert_ne!(run.positions()[2..], [0.4, 1.4]);
        // A fixed one continues with its velocity.
        run.hold(held(0, [0.0, 0.0]));
        advance(&mut run, Advance::Seconds(0.1));
        assert_eq!(run.positions()[..2], [0.0, 0.0]);
        run.hold(None);
        advance(&mut run, Advance::Step);
        assert_eq!(run.positions()[..2], [0.001, 0.0]);
    }

    #[test]
    fn a_particle_can_be_held_where_pins_are_held_by_a_penalty() {
        let mut scene = scene();
        scene.integrator = vocabulary().integrator("fast-mass-spring").unwrap();
        scene.integrator_options = IntegratorOptions::defaults(scene.integrator);
        scene.integrator_options.set("pins", "penalty").unwrap();
        let mut run = Run::new(Arc::new(scene.clone()), BUDGET);
        run.hold(Some(Hold { particle: 1, position: [0.3, 1.4, 0.0] }));
        assert_eq!(advance(&mut run, Advance::Seconds(0.1)).failure, None);
        assert_eq!(run.positions()[2..], [0.3, 1.4]);
        run.hold(None);
        assert_eq!(advance(&mut run, Advance::Seconds(0.1)).failure, None);
        assert_ne!(run.positions()[2..], [0.3, 1.4]);
    }

    #[test]
    fn a_second_run_continues_from_the_state_of_the_first() {
        let scene = scene();
        let mut run = Run::new(Arc::new(scene.clone()), BUDGET);
        advance(&mut run, Advance::Seconds(0.1));
        let mut beside = run.beside();
        for run in [&mut run, &mut beside] {
            advance(run, Advance::Step);
        }
        assert_eq!(run.positions(), beside.positions());
        assert_eq!(run.state.time, beside.state.time);
    }

    /// A net whose fast mass-spring step takes rounds without end.
    fn endless() -> Scene {
        let mut scene = scene();
        scene.integrator = vocabulary().integrator("fast-mass-spring").unwrap();
        scene.integrator_options = IntegratorOptions::defaults(scene.integrator);
        scene.integrator_options.set("iterations", "1000000000000").unwrap();
        scene
    }

    #[test]
    fn a_step_that_takes_long_is_reported_and_a_change_of_the_settings_abandons_it() {
        let scene = endless();
        let mut run = Run::new(Arc::new(scene.clone()), BUDGET);
        let now = |run: &mut Run, advance| {
            run.begin(advance);
            run.finish(Instant::now() + Duration::from_millis(20)).ok().unwrap()
        };
        let status = now(&mut run, Advance::Step);
        assert_eq!((status.step, status.steps, status.failure), (0, 0, None));
        assert!(!status.underway.unwrap().abandoned);
        // A pause, and a particle that is held, wait for its end.
        run.hold(Some(Hold { particle: 1, position: [0.3, 1.4, 0.0] }));
        let status = now(&mut run, Advance::Seconds(0.0));
        assert!(status.underway.unwrap().seconds > 0.03);
        assert_eq!(run.positions(), scene.positions());
        run.hold(None);
        run.set(&changed(&run, |settings| settings.integrator = "symplectic-euler".to_owned()));
        let status = advance(&mut run, Advance::Seconds(0.1));
        assert_eq!((status.step, status.underway), (10, None));
        let mut expected = scene.clone();
        expected.integrator = vocabulary().integrator("symplectic-euler").unwrap();
        expected.integrator_options = IntegratorOptions::defaults(expected.integrator);
        let mut simulation = Simulation::new(&expected);
        (0..10).for_each(|_| assert!(simulation.advance().unwrap()));
        assert_eq!(run.positions(), simulation.state().positions);
    }
}
