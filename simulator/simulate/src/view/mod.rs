//! `simulate view`: a page on this machine on which a scene runs live.
//!
//! ```text
//! page ── POST open ──> scene: drawing data, integrators, settings; the run starts anew
//!      ── POST frame ─> settings, a held particle, seconds to advance
//!      <── u64 length of the JSON, JSON (a status of each run), positions of each run (f64) ──
//! ```
//!
//! The page asks for a frame before it draws the last one. Numbers are little-endian. The steps of a frame take at most
//! [`BUDGET`], or are one. A frame waits for them for [`PATIENCE`] at most; the page then asks again.
//!
//! Only the page reaches the run. The server listens on 127.0.0.1, at a port that the system chooses. The path of a request
//! starts with a token of 128 random bits. A request names this address as its host: the name of another site that
//! resolves to it (DNS rebinding) is refused. So is a request from a page of another origin. A request that changes
//! something must name its origin, as browsers do.
//!
//! A scene may be a stranger's. Its sizes are limited, and memory with them; what a request computes has the two times above,
//! and opening the page takes time in proportion to the sizes.

mod connections;
mod http;
mod run;
mod worker;

use std::fmt::Write as _;
use std::io::{self, Write};
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, mpsc};
use std::thread;
use std::time::{Duration, Instant};

use clap::Args;
use connections::{Connections, Requests};
use frames::materials::Materials;
use frames::{Bounds, Palette};
use http::{Request, Response, Status};
use picture::web;
use run::{Advance, Hold, Run, Settings};
use scene::schema::IntegratorSchema;
use scene::{EDGE_RADIUS, Edge, Overrides, PARTICLE_RADIUS, Scene};
use serde::{Deserialize, Serialize};
use simulator::generate::{parse_integrator, parse_option};
use simulator::integrator::{self, Interrupt};
use simulator::simulation::Simulation;

use super::reading::{DRAWN, Reading};
use super::{Failure, load, materials, parse_time_step};

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

/// Time after which a response that nobody takes is given up.
const WRITE: Duration = Duration::from_secs(60);

/// How long, and for how many bytes, the rest of a refused request is read.
const LINGER: Duration = Duration::from_secs(1);
const MAX_LINGER: u64 = 1 << 20;

const JSON: &str = "application/json";

const FAULT: &str = "internal error: simulate printed it";

/// The files of the page: name, type and content. The first one is the page itself.
const FILES: [(&str, &str, &str); 8] = [
    ("", "text/html; charset=utf-8", include_str!("live.html")),
    (web::STYLE.0, CSS, web::STYLE.1),
    ("live.css", CSS, include_str!("live.css")),
    (web::BASE.0, SCRIPT, web::BASE.1),
    (web::STAGE.0, SCRIPT, web::STAGE.1),
    (web::GESTURES.0, SCRIPT, web::GESTURES.1),
    (web::CHART.0, SCRIPT, web::CHART.1),
    ("live.js", SCRIPT, include_str!("live.js")),
];

const CSS: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";

/// Show a scene live, on a page of this machine
///
/// It prints the address of the page; Ctrl-C ends it. On the page: play, step, reset; another integrator, time step,
/// mass, stiffness, damping and wind while the scene runs; energies; particles to drag; two integrators side by side. Only
/// this address, with a random port and a random token, reaches the scene.
#[derive(Args)]
pub(super) struct View {
    /// Scene file (XML, or JSON beside OBJ)
    #[arg(value_name = "SCENE")]
    scene: PathBuf,

    /// Start with this integrator instead of the scene's
    #[arg(long, value_name = "TYPE", value_parser = parse_integrator)]
    integrator: Option<&'static IntegratorSchema>,

    /// Start with this time step (seconds) instead of the scene's
    #[arg(long, value_name = "SECONDS", value_parser = parse_time_step, allow_negative_numbers = true)]
    dt: Option<f64>,

    /// Set an option of the integrator, overriding the scene; may be given several times
    #[arg(long = "option", value_name = "NAME=VALUE", value_parser = parse_option)]
    options: Vec<(String, String)>,

    #[command(flatten)]
    reading: Reading,
}

/// Serves the page until the program is ended.
pub(super) fn run(view: &View) -> Result<(), Failure> {
    let overrides = Overrides {
        integrator: view.integrator,
        time_step: view.dt,
        duration: None,
        options: view.options.clone(),
    };
    let scene = load(&view.scene, &view.reading.options(overrides, DRAWN))?.scene;
    let cannot = |error: io::Error| Failure::Input(format!("no port on 127.0.0.1: {error}"));
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).map_err(cannot)?;
    let host = listener.local_addr().map_err(cannot)?.to_string();
    let server = Server::new(&scene, host)?;
    let mut out = anstream::stdout();
    let name = &scene.name;
    let printed = writeln!(
        out,
        "{name} runs at {}/{}/\nOpen this address in a browser on this machine. Ctrl-C ends it.",
        server.origin, server.token
    );
    Failure::of_stdout(printed.and_then(|()| out.flush()))?;
    let connections = Connections::default();
    thread::scope(|scope| {
        for stream in listener.incoming() {
            // Too many open files: until one is closed.
            let Ok(stream) = stream else {
                thread::sleep(Duration::from_millis(10));
                continue;
            };
            let Some(number) = connections.admit(&stream) else { continue };
            let (server, connections) = (&server, &connections);
            scope.spawn(move || {
                // A connection that breaks off concerns nobody else.
                let _ = server.serve(stream, || connections.know(number));
                connections.forget(number);
            });
        }
    });
    Ok(())
}

/// The server of a scene.
struct Server<'a> {
    scene: &'a Scene,
    /// Where the page is: address and port, the same with its scheme, and the first part of its path.
    host: String,
    origin: String,
    token: String,
    bounds: Bounds,
    materials: Materials,
    session: Mutex<Session<'a>>,
}

/// The runs of the page that was opened last.
struct Session<'a> {
    number: u64,
    /// At least one.
    runs: Vec<Run<'a>>,
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
    integrators: Vec<&'static str>,
    settings: Settings,
    positions: Vec<f64>,
    /// Fixed particles.
    fixed: Vec<usize>,
}

impl<'a> Server<'a> {
    fn new(scene: &'a Scene, host: String) -> Result<Self, Failure> {
        let mut random = [0_u8; 16];
        getrandom::fill(&mut random).map_err(|error| Failure::Input(error.to_string()))?;
        let token = random.iter().fold(String::new(), |mut token, byte| {
            let _ = write!(token, "{byte:02x}");
            token
        });
        Ok(Self {
            scene,
            origin: format!("http://{host}"),
            host,
            token,
            bounds: bounds(scene),
            materials: materials(scene),
            session: Mutex::new(Session { number: 0, runs: vec![Run::new(scene, BUDGET)] }),
        })
    }

    /// Answers the requests of a connection. `know` is called when it has sent the token; without it, it has one request.
    fn serve(&self, mut stream: TcpStream, know: impl Fn()) -> io::Result<()> {
        stream.set_write_timeout(Some(WRITE))?;
        stream.set_nodelay(true)?;
        let mut requests = Requests::of(stream.try_clone()?);
        let mut is_known = false;
        loop {
            match Request::read(requests.next(is_known)?) {
                Ok(Some(request)) => {
                    is_known = self.inside(&request).is_some();
                    if is_known {
                        know();
                    }
                    let closes = request.closes || !is_known;
                    self.answer(&request).write(&mut stream, closes)?;
                    if closes {
                        return Ok(());
                    }
                }
                Ok(None) => return Ok(()),
                Err(refusal) => {
                    refusal.write(&mut stream, true)?;
                    // To close with bytes that nobody read would reset the connection, and lose the response.
                    stream.shutdown(Shutdown::Write)?;
                    requests.drain(LINGER, MAX_LINGER)?;
                    return Ok(());
                }
            }
        }
    }

    /// The requested resource, if the path starts with the token.
    fn inside<'r>(&self, request: &'r Request) -> Option<&'r str> {
        let (token, name) = request.target[1..].split_once('/')?;
        is_same(token, &self.token).then_some(name)
    }

    fn answer(&self, request: &Request) -> Response {
        let forbidden = |why| Response::refusal(Status::Forbidden, why);
        if request.host != self.host {
            return forbidden("the Host header is not the address of this page");
        }
        if request.origin.as_ref().is_some_and(|origin| *origin != self.origin) {
            return forbidden("the Origin header is not that of this page");
        }
        let Some(name) = self.inside(request) else {
            return forbidden(
                "the address lacks its token: open the address that simulate view printed",
            );
        };
        let file = FILES.iter().find(|(file, ..)| *file == name);
        match (request.method.as_str(), name, file) {
            ("GET", _, Some((_, content_type, text))) => {
                Response::of(content_type, text.as_bytes())
            }
            ("POST", "open" | "frame", _) if request.origin.is_none() => {
                forbidden("the Origin header is missing")
            }
            ("POST", "open", _) => self.open(),
            ("POST", "frame", _) => self.frame(&request.body),
            (_, "open" | "frame", _) | (_, _, Some(_)) => {
                Response::refusal(Status::OtherMethod, "this address has another method")
            }
            _ => Response::refusal(Status::NotFound, "there is no such file"),
        }
    }

    /// The session; an error if an internal error broke it off.
    fn session(&self) -> Result<MutexGuard<'_, Session<'a>>, Response> {
        let fault = |_| Response::refusal(Status::Fault, FAULT);
        self.session.lock().map_err(fault)
    }

    /// Starts a session for a page that was opened. It replaces the session before it.
    fn open(&self) -> Response {
        let mut session = match self.session() {
            Ok(session) => session,
            Err(response) => return response,
        };
        session.number += 1;
        session.runs.truncate(1);
        session.runs[0].restart();
        let drawn = slender(self.scene);
        let opened = Opened {
            session: session.number,
            name: &self.scene.name,
            description: self.scene.description.as_deref(),
            scene: Palette::of(&drawn, self.bounds, &self.materials),
            integrators: integrator::REGISTRY.iter().map(|kind| kind.schema.name).collect(),
            settings: Settings::of(self.scene),
            positions: self.scene.positions(),
            fixed: (0..self.scene.particles.len())
                .filter(|number| self.scene.particles[*number].fixed)
                .collect(),
        };
        match serde_json::to_vec(&opened) {
            Ok(json) => Response::of(JSON, json),
            Err(error) => Response::refusal(Status::Fault, error.to_string()),
        }
    }

    /// Advances the runs.
    fn frame(&self, body: &[u8]) -> Response {
        let malformed = |why: &str| Response::refusal(Status::Malformed, why);
        let frame: Frame = match serde_json::from_slice(body) {
            Ok(frame) => frame,
            Err(error) => return malformed(&error.to_string()),
        };
        if !(0.0..=LONGEST_FRAME).contains(&frame.seconds) {
            return malformed("the seconds are out of range");
        }
        if frame.hold.is_some_and(|hold| !hold.is_of(self.scene)) {
            return malformed("there is no such particle to hold");
        }
        if !(1..=MAX_RUNS).contains(&frame.settings.len()) {
            return malformed("the number of settings is out of range");
        }
        let mut session = match self.session() {
            Ok(session) => session,
            Err(response) => return response,
        };
        if session.number != frame.session {
            let why = "the scene was opened in another window";
            return Response::refusal(Status::Conflict, why);
        }
        let runs = &mut session.runs;
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
        let Ok(statuses) = statuses else { return Response::refusal(Status::Fault, FAULT) };
        match serde_json::to_vec(&statuses) {
            Ok(json) => Response::of("application/octet-stream", packed(json, runs)),
            Err(error) => Response::refusal(Status::Fault, error.to_string()),
        }
    }
}

/// Whether two texts are the same, in a time that does not depend on where they differ.
fn is_same(a: &str, b: &str) -> bool {
    let pairs = a.bytes().zip(b.bytes());
    a.len() == b.len() && pairs.fold(0, |difference, (a, b)| difference | (a ^ b)) == 0
}

/// JSON, then the positions of each run at a multiple of eight bytes.
fn packed(mut json: Vec<u8>, runs: &[Run<'_>]) -> Vec<u8> {
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
fn bounds(scene: &Scene) -> Bounds {
    let mut first = Bounds::default();
    first.include(scene, &scene.positions());
    let near = first.enlarged(SURROUNDINGS);
    let found = Arc::new(Mutex::new(first));
    let interrupt = Interrupt::default();
    let (ended, end) = mpsc::channel();
    // A step may take longer than the look: a separate thread takes the steps, and ends after the one that is running.
    let look = {
        let (scene, found, interrupt) = (scene.clone(), Arc::clone(&found), interrupt.clone());
        move || {
            let mut simulation = Simulation::new(&scene);
            simulation.interrupt_by(&interrupt);
            let mut bounds = first;
            while !interrupt.is_raised() && matches!(simulation.advance(), Ok(true)) {
                bounds.include(&scene, simulation.state().positions);
                let is_near = near.contains(&bounds);
                let shown = if is_near { bounds } else { first.enlarged(ROOM) };
                *found.lock().unwrap_or_else(PoisonError::into_inner) = shown;
                if !is_near {
                    break;
                }
            }
            // Nobody waits any more.
            let _ = ended.send(());
        }
    };
    thread::spawn(look);
    let _ = end.recv_timeout(LOOK);
    interrupt.raise();
    let found = found.lock().unwrap_or_else(PoisonError::into_inner);
    *found
}
