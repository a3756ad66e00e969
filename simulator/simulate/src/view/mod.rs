//! `simulate view`: a page on this machine on which a scene runs live.
//!
//! Its two requests, `open` and `frame`, are those of [`live`].
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

use std::fmt::Write as _;
use std::io::{self, Write};
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::Mutex;
use std::thread;
use std::time::Duration;

use clap::Args;
use connections::{Connections, Requests};
use http::{Request, Response, Status};
use live::{Live, Refused};
use picture::web;
use scene::schema::IntegratorSchema;
use scene::{Overrides, Scene};
use simulator::generate::{parse_integrator, parse_option};

use super::reading::{DRAWN, Reading};
use super::{Failure, load, materials, parse_time_step};

/// Time after which a response that nobody takes is given up.
const WRITE: Duration = Duration::from_secs(60);

/// How long, and for how many bytes, the rest of a refused request is read.
const LINGER: Duration = Duration::from_secs(1);
const MAX_LINGER: u64 = 1 << 20;

const JSON: &str = "application/json";
const BYTES: &str = "application/octet-stream";

const FAULT: &str = "internal error: simulate printed it";

/// The files of the page: name, type and content. The first one is the page itself.
const FILES: [(&str, &str, &str); 10] = [
    ("", "text/html; charset=utf-8", include_str!("live.html")),
    (web::STYLE.0, CSS, web::STYLE.1),
    ("live.css", CSS, include_str!("live.css")),
    (web::BASE.0, SCRIPT, web::BASE.1),
    (web::STRAIN.0, SCRIPT, web::STRAIN.1),
    (web::STAGE.0, SCRIPT, web::STAGE.1),
    (web::GESTURES.0, SCRIPT, web::GESTURES.1),
    (web::CHART.0, SCRIPT, web::CHART.1),
    ("live.js", SCRIPT, include_str!("live.js")),
    ("view.js", SCRIPT, include_str!("view.js")),
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
    let name = scene.name.clone();
    let server = Server::new(scene, host)?;
    let mut out = anstream::stdout();
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
struct Server {
    /// Where the page is: address and port, the same with its scheme, and the first part of its path.
    host: String,
    origin: String,
    token: String,
    live: Mutex<Live>,
}

impl Server {
    fn new(scene: Scene, host: String) -> Result<Self, Failure> {
        let mut random = [0_u8; 16];
        getrandom::fill(&mut random).map_err(|error| Failure::Input(error.to_string()))?;
        let token = random.iter().fold(String::new(), |mut token, byte| {
            let _ = write!(token, "{byte:02x}");
            token
        });
        let materials = materials(&scene);
        Ok(Self {
            origin: format!("http://{host}"),
            host,
            token,
            live: Mutex::new(Live::new(scene, materials)),
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
            ("POST", "open", _) => self.ask(JSON, Live::open),
            ("POST", "frame", _) => self.ask(BYTES, |live| live.frame(&request.body)),
            (_, "open" | "frame", _) | (_, _, Some(_)) => {
                Response::refusal(Status::OtherMethod, "this address has another method")
            }
            _ => Response::refusal(Status::NotFound, "there is no such file"),
        }
    }

    /// The answer of the scene; a fault if an internal error broke it off.
    fn ask(
        &self,
        content_type: &'static str,
        answer: impl FnOnce(&mut Live) -> Result<Vec<u8>, Refused>,
    ) -> Response {
        let Ok(mut live) = self.live.lock() else {
            return Response::refusal(Status::Fault, FAULT);
        };
        match answer(&mut live) {
            Ok(bytes) => Response::of(content_type, bytes),
            Err(Refused::Malformed(why)) => Response::refusal(Status::Malformed, why),
            Err(Refused::Conflict) => {
                Response::refusal(Status::Conflict, "the scene was opened in another window")
            }
            Err(Refused::Fault(_)) => Response::refusal(Status::Fault, FAULT),
        }
    }
}

/// Whether two texts are the same, in a time that does not depend on where they differ.
fn is_same(a: &str, b: &str) -> bool {
    let pairs = a.bytes().zip(b.bytes());
    a.len() == b.len() && pairs.fold(0, |difference, (a, b)| difference | (a ^ b)) == 0
}
