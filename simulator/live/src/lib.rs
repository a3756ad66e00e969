//! A scene that runs live behind a page: [`Live`] answers the page's two requests, in a program and in a browser.
//!
//! ```text
//! page ── open ──> scene: drawing data, integrators, settings; the run starts anew
//!      ── frame ─> settings, a held particle, seconds to advance
//!      <── u64 length of the JSON, JSON (a status of each run), positions of each run (f64) ──
//! ```
//!
//! The page asks for a frame before it draws the last one. Numbers are little-endian. The steps of a frame take at most
//! 12 ms, or are one. A frame waits for them for 100 ms at most; the page then asks again.

mod run;
mod worker;

use std::sync::Arc;
use std::time::{Duration, Instant};

use frames::materials::Materials;
use frames::{Bounds, Palette, StrainPalette};
use run::{Advance, Hold, Run, Settings};
use scene::{EDGE_RADIUS, Edge, PARTICLE_RADIUS, Scene};
use serde::{Deserialize, Serialize};
use simulator::integrator;

/// Computing time of a frame: less than a sixtieth of a second.
const BUDGET: Duration = Duration::from_millis(12);

/// How long a frame waits for a step.
const PATIENCE: Duration = Duration::from_millis(100);

/// Time for a first run that finds the bounds of the motion.
const LOOK: Duration = Duration::from_millis(200);

/// How far the motion is followed on each side, and the room that is shown otherwise, as multiples of the scene's size.
const SURROUNDINGS: f64 = 1.2;
const ROOM: f64 = 0.4;

/// Largest default radius of particles and of edges, as a share of the median edge.
const SLENDER: [f64; 2] = [0.12, 0.03];

/// Longest simulated time that a frame may ask for, in seconds.
const LONGEST_FRAME: f64 = 100.0;

/// Most runs side by side.
const MAX_RUNS: usize = 2;

/// A scene, and the runs of the page that was opened last.
pub struct Live {
    scene: Arc<Scene>,
    bounds: Bounds,
    materials: Materials,
    session: u64,
    /// At least one.
    runs: Vec<Run>,
}

/// Why a request is not answered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Refused {
    /// It is not a request of this scene's page.
    Malformed(String),
    /// The scene was opened in another window.
    Conflict,
    /// Something failed inside.
    Fault(String),
}

/// A request of the page, before each picture.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
struct Frame {
    session: u64,
    /// Whether the runs start anew.
    reset: bool,
    /// Whether they take one step.
    step: bool,
    /// Simulated time to advance otherwise.
    seconds: f64,
    hold: Option<Hold>,
    /// Of each run.
    settings: Vec<Settings>,
}

/// Data of the page.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Opened<'a> {
    session: u64,
    name: &'a str,
    description: Option<&'a str>,
    scene: Palette,
    strain: Option<StrainPalette>,
    integrators: Vec<&'static str>,
    settings: Settings,
    positions: Vec<f64>,
    /// Fixed particles.
    fixed: Vec<usize>,
}

impl Live {
    /// A scene at its initial state. Takes a fifth of a second at most to find the bounds of the motion.
    pub fn new(scene: Scene, materials: Materials) -> Self {
        let scene = Arc::new(scene);
        let bounds = bounds(&scene);
        let runs = vec![Run::new(Arc::clone(&scene), BUDGET)];
        Self { scene, bounds, materials, session: 0, runs }
    }

    /// Starts a session for a page that was opened. It replaces the session before it. Yields the page's data, as JSON.
    ///
    /// # Errors
    /// If they cannot be written.
    pub fn open(&mut self) -> Result<Vec<u8>, Refused> {
        self.session += 1;
        self.runs.truncate(1);
        self.runs[0].restart();
        let scene = &*self.scene;
        let drawn = slender(scene);
        let opened = Opened {
            session: self.session,
            name: &scene.name,
            description: scene.description.as_deref(),
            scene: Palette::of(&drawn, self.bounds, &self.materials),
            strain: StrainPalette::of(scene),
            integrators: integrator::REGISTRY.iter().map(|kind| kind.schema.name).collect(),
            settings: Settings::of(scene),
            positions: scene.positions(),
            fixed: (0..scene.particles.len())
                .filter(|number| scene.particles[*number].fixed)
                .collect(),
        };
        serde_json::to_vec(&opened).map_err(|error| Refused::Fault(error.to_string()))
    }

    /// Advances the runs as `body`, JSON, says. Yields their states.
    ///
    /// # Errors
    /// If the request is none of this session's, or a run has ended by an internal error.
    pub fn frame(&mut self, body: &[u8]) -> Result<Vec<u8>, Refused> {
        let malformed = |why: &str| Err(Refused::Malformed(why.to_owned()));
        let frame: Frame = match serde_json::from_slice(body) {
            Ok(frame) => frame,
            Err(error) => return malformed(&error.to_string()),
        };
        if !(0.0..=LONGEST_FRAME).contains(&frame.seconds) {
            return malformed("the seconds are out of range");
        }
        if frame.hold.is_some_and(|hold| !hold.is_of(&self.scene)) {
            return malformed("there is no such particle to hold");
        }
        if !(1..=MAX_RUNS).contains(&frame.settings.len()) {
            return malformed("the number of settings is out of range");
        }
        if self.session != frame.session {
            return Err(Refused::Conflict);
        }
        let runs = &mut self.runs;
        runs.truncate(frame.settings.len());
        while runs.len() < frame.settings.len() {
            let beside = runs[0].beside();
            runs.push(beside);
        }
        for (run, settings) in runs.iter_mut().zip(&frame.settings) {
            run.set(settings);
            if frame.reset {
                run.reset();
            }
            run.hold(frame.hold);
        }
        let advance = if frame.step { Advance::Step } else { Advance::Seconds(frame.seconds) };
        runs.iter_mut().for_each(|run| run.begin(advance));
        let deadline = Instant::now() + PATIENCE;
        let statuses: Result<Vec<run::Status>, _> =
            runs.iter_mut().map(|run| run.finish(deadline)).collect();
        let statuses =
            statuses.map_err(|worker::Stopped| Refused::Fault("a run has ended".to_owned()))?;
        let json =
            serde_json::to_vec(&statuses).map_err(|error| Refused::Fault(error.to_string()))?;
        Ok(packed(json, runs))
    }
}

/// JSON, then the positions of each run at a multiple of eight bytes.
fn packed(mut json: Vec<u8>, runs: &[Run]) -> Vec<u8> {
    json.resize(json.len().next_multiple_of(8), b' ');
    let numbers: usize = runs.iter().map(|run| run.positions().len()).sum();
    let mut bytes = Vec::with_capacity(8 + json.len() + 8 * numbers);
    bytes.extend((json.len() as u64).to_le_bytes());
    bytes.extend(json);
    let positions = runs.iter().flat_map(Run::positions);
    bytes.extend(positions.flat_map(|value| value.to_le_bytes()));
    bytes
}

/// The scene with radii that leave its edges visible: those that are the default are at most a share of an edge.
fn slender(scene: &Scene) -> Scene {
    let mut drawn = scene.clone();
    let length = |edge: &Edge| {
        let [a, b] = edge.particles.map(|particle| scene.particles[particle].position);
        a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
    };
    let mut lengths: Vec<f64> =
        scene.edges.iter().map(length).filter(|length| *length > 0.0).collect();
    lengths.sort_by(f64::total_cmp);
    let Some(median) = lengths.get(lengths.len() / 2) else { return drawn };
    let shrink = |radius: &mut f64, default: f64, share: f64| {
        if *radius == default {
            *radius = radius.min(share * median);
        }
    };
    for particle in &mut drawn.particles {
        shrink(&mut particle.radius, PARTICLE_RADIUS, SLENDER[0]);
    }
    for edge in &mut drawn.edges {
        shrink(&mut edge.radius, EDGE_RADIUS, SLENDER[1]);
    }
    drawn
}

/// The bounds of the motion, as far as a short run finds them; of a run that leaves its surroundings, those of its
/// first state with some room.
fn bounds(scene: &Arc<Scene>) -> Bounds {
    let mut first = Bounds::default();
    first.include(scene, &scene.positions());
    let near = first.enlarged(SURROUNDINGS);
    let mut bounds = first;
    worker::look(scene, LOOK, first, move |scene, positions| {
        bounds.include(scene, positions);
        let is_near = near.contains(&bounds);
        (if is_near { bounds } else { first.enlarged(ROOM) }, is_near)
    })
}
