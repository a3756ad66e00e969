//! The server of `simulate view`, as a browser and as others meet it.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::shared::bits;
use crate::support::{simulate, stderr};
use serde_json::{Value, json};
use tempfile::TempDir;

/// Two particles on a spring; explicit Euler blows up with a long step.
const SCENE: &str = r#"<scene>
  <description text="A &lt;script&gt;"/>
  <duration time="0.5"/>
  <integrator type="implicit-euler" dt="0.01"/>
  <particle m="1.1" px="0" py="0" vx="0" vy="0" fixed="1"/>
  <particle m="0.9" px="1.2" py="0.1" vx="0" vy="0" fixed="0"/>
  <edge i="0" j="1"/>
  <springforce edge="0" k="70" l0="1.05" b="0.3"/>
  <simplegravity fx="0" fy="-9.81"/>
</scene>
"#;

/// A request that takes longer hangs.
const HANGS: Duration = Duration::from_secs(60);

/// A running `simulate view`, which ends with the test.
struct Viewer {
    child: Child,
    folder: TempDir,
    /// Address and port, and the first part of the path.
    host: String,
    token: String,
}

/// A response: status code, headers in lower case, body.
struct Answer {
    status: u16,
    headers: String,
    body: Vec<u8>,
}

impl Viewer {
    fn start(scene: &str) -> Self {
        let folder = TempDir::new().unwrap();
        fs::write(folder.path().join("scene.xml"), scene).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_simulate"));
        command.args(["view", "scene.xml"]).current_dir(folder.path()).stdout(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let address = line.trim_end().strip_prefix("scene.xml runs at http://");
        let address = address.and_then(|address| address.strip_suffix('/'));
        let (host, token) = address.and_then(|address| address.split_once('/')).expect(&line);
        assert!(host.starts_with("127.0.0.1:"), "{host}");
        assert!(token.len() == 32 && token.bytes().all(|byte| byte.is_ascii_hexdigit()), "{token}");
        Self { host: host.to_owned(), token: token.to_owned(), child, folder }
    }

    /// Sends bytes on a new connection, and reads to its end.
    fn send(&self, bytes: &[u8]) -> Answer {
        let mut stream = TcpStream::connect(&self.host).unwrap();
        stream.set_read_timeout(Some(HANGS)).unwrap();
        stream.write_all(bytes).unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        let end = answer.windows(4).position(|four| four == b"\r\n\r\n").unwrap() + 4;
        let body = answer.split_off(end);
        let headers = String::from_utf8(answer).unwrap();
        let status = headers.split(' ').nth(1).unwrap().parse().unwrap();
        Answer { status, headers: headers.to_lowercase(), body }
    }

    fn request(&self, method: &str, path: &str, headers: &[(&str, &str)], body: &str) -> Answer {
        let mut text = format!("{method} {path} HTTP/1.1\r\nConnection: close\r\n");
        for (name, value) in headers {
            text += &format!("{name}: {value}\r\n");
        }
        text += &format!("Content-Length: {}\r\n\r\n{body}", body.len());
        self.send(text.as_bytes())
    }

    fn origin(&self) -> String {
        format!("http://{}", self.host)
    }

    fn get(&self, name: &str) -> Answer {
        self.request("GET", &format!("/{}/{name}", self.token), &[("Host", &self.host)], "")
    }

    fn post(&self, name: &str, body: &str) -> Answer {
        let headers = [("Host", self.host.as_str()), ("Origin", &self.origin())];
        self.request("POST", &format!("/{}/{name}", self.token), &headers, body)
    }

    fn open(&self) -> Value {
        let answer = self.post("open", "");
        assert_eq!(answer.status, 200);
        serde_json::from_slice(&answer.body).unwrap()
    }

    /// A frame, and the frames that wait for its steps: the status and the positions of each run.
    fn frame(&self, frame: &Value) -> (Value, Vec<Vec<f64>>) {
        let mut answer = self.frame_now(frame);
        let mut waiting = frame.clone();
        (waiting["step"], waiting["reset"]) = (json!(false), json!(false));
        waiting["seconds"] = json!(0.0);
        let started = Instant::now();
        while answer.0.as_array().unwrap().iter().any(|status| !status["underway"].is_null()) {
            assert!(started.elapsed() < HANGS, "{}", answer.0);
            answer = self.frame_now(&waiting);
        }
        answer
    }

    /// A frame, whether its steps have ended or not.
    fn frame_now(&self, frame: &Value) -> (Value, Vec<Vec<f64>>) {
        let answer = self.post("frame", &frame.to_string());
        assert_eq!(answer.status, 200, "{}", String::from_utf8_lossy(&answer.body));
        let (length, rest) = answer.body.split_at(8);
        let length = u64::from_le_bytes(length.try_into().unwrap()) as usize;
        let (status, positions) = rest.split_at(length);
        let status: Value = serde_json::from_slice(status).unwrap();
        let number = |bytes: &[u8]| f64::from_le_bytes(bytes.try_into().unwrap());
        let positions: Vec<f64> = positions.chunks_exact(8).map(number).collect();
        let n_runs = status.as_array().unwrap().len();
        (status, positions.chunks(positions.len() / n_runs).map(<[f64]>::to_vec).collect())
    }

    /// The positions of every state that `simulate` writes with these options.
    fn trace(&self, options: &[&str]) -> Vec<Vec<f64>> {
        let arguments = [&["scene.xml", "-o", "trace.csv"], options].concat();
        let run = simulate(self.folder.path(), &arguments);
        assert_eq!((run.status.code(), stderr(&run)), (Some(0), ""));
        let csv = fs::read_to_string(self.folder.path().join("trace.csv")).unwrap();
        let positions = |line: &str| {
            let numbers: Vec<f64> =
                line.split(',').skip(2).map(|field| field.parse().unwrap()).collect();
            numbers.chunks(4).flat_map(|particle| particle[..2].to_vec()).collect()
        };
        csv.lines().skip(1).map(positions).collect()
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A frame of one step, with the settings of the scene.
fn step(opened: &Value) -> Value {
    json!({
        "session": opened["session"], "reset": false, "step": true, "seconds": 0.0, "hold": null,
        "settings": [opened["settings"]],
    })
}

#[test]
fn the_page_and_its_files_are_served_and_request_nothing_else() {
    let viewer = Viewer::start(SCENE);
    let page = viewer.get("");
    assert_eq!(page.status, 200);
    for header in [
        "content-type: text/html; charset=utf-8",
        "content-security-policy: default-src 'none';",
        "cache-control: no-store",
        "referrer-policy: no-referrer",
        "x-content-type-options: nosniff",
    ] {
        assert!(page.headers.contains(header), "{header}\n{}", page.headers);
    }
    assert!(!page.headers.contains("access-control"), "{}", page.headers);
    let text = String::from_utf8(page.body).unwrap();
    let addresses =
        text.split(['"', '\'']).filter(|word| word.ends_with(".js") || word.ends_with(".css"));
    let files: Vec<&str> = addresses.collect();
    assert_eq!(files.len(), 9, "{files:?}");
    for file in files {
        assert_eq!(viewer.get(file).status, 200, "{file}");
    }
    assert!(!text.contains("http"), "{text}");
    let opened = viewer.open();
    assert_eq!(opened["name"], "scene.xml");
    assert_eq!(opened["description"], "A <script>");
    assert_eq!(
        opened["integrators"].as_array().unwrap().len(),
        simulator::integrator::REGISTRY.len()
    );
}

#[test]
fn requests_without_the_token_or_from_elsewhere_are_refused() {
    let viewer = Viewer::start(SCENE);
    let (host, origin) = (viewer.host.as_str(), viewer.origin());
    let port = host.split_once(':').unwrap().1;
    let page = format!("/{}/", viewer.token);
    let status = |method: &str, path: &str, headers: &[(&str, &str)]| {
        viewer.request(method, path, headers, "").status
    };
    assert_eq!(status("GET", &page, &[("Host", host)]), 200);
    assert_eq!(status("GET", &page, &[("Host", host), ("Origin", &origin)]), 200);

    // Without the token, with another one, or with a part of it.
    let wrong = format!("/{}/", "0".repeat(32));
    let part = format!("/{}/", &viewer.token[..31]);
    for path in ["/", "/base.js", "/favicon.ico", &wrong, &part, &page[..33], "//"] {
        assert_eq!(status("GET", path, &[("Host", host)]), 403, "{path}");
        assert_eq!(status("POST", path, &[("Host", host), ("Origin", &origin)]), 403, "{path}");
    }
    // Under another name, as after DNS rebinding.
    let names = ["evil.example", "127.0.0.1", "localhost", "127.0.0.1.evil.example", "[::1]", ""];
    for name in names {
        for other in [name.to_owned(), format!("{name}:{port}")] {
            if other != host {
                assert_eq!(status("GET", &page, &[("Host", &other)]), 403, "{other}");
            }
        }
    }
    assert_eq!(status("GET", &page, &[]), 400);
    assert_eq!(status("GET", &page, &[("Host", host), ("Host", "evil.example")]), 400);
    // From another site.
    let open = format!("{page}open");
    let https = format!("https://{host}");
    for other in ["http://evil.example", "null", "http://127.0.0.1", "http://localhost", &https, ""]
    {
        let headers = [("Host", host), ("Origin", other)];
        assert_eq!(status("GET", &page, &headers), 403, "{other}");
        assert_eq!(status("POST", &open, &headers), 403, "{other}");
        assert_eq!(status("OPTIONS", &open, &headers), 403, "{other}");
    }
    // Requests that change something need an origin.
    assert_eq!(status("POST", &open, &[("Host", host)]), 403);
    assert_eq!(status("POST", &open, &[("Host", host), ("Origin", &origin)]), 200);

    // Another address of this machine.
    assert!(TcpStream::connect(format!("127.0.0.2:{port}")).is_err());
    assert_ne!(Viewer::start(SCENE).token, viewer.token);
}

#[test]
fn other_paths_and_methods_and_malformed_requests_are_refused() {
    let viewer = Viewer::start(SCENE);
    let (host, token) = (&viewer.host, &viewer.token);
    for name in [
        "..",
        "../",
        "../../etc/passwd",
        "%2e%2e/",
        "/base.js",
        "base.js/",
        "base.js?x",
        "scene.xml",
        "OPEN",
    ] {
        assert_eq!(viewer.get(name).status, 404, "{name}");
    }
    for (method, name) in [
        ("GET", "open"),
        ("GET", "frame"),
        ("POST", "base.js"),
        ("POST", ""),
        ("DELETE", "open"),
        ("HEAD", ""),
    ] {
        let headers = [("Host", host.as_str()), ("Origin", &viewer.origin())];
        let answer = viewer.request(method, &format!("/{token}/{name}"), &headers, "");
        assert_eq!(answer.status, 405, "{method} {name}");
    }
    for (text, status) in [
        ("GET\r\n\r\n".to_owned(), 400),
        (format!("GET /{token}/ HTTP/1.1\nHost: {host}\n\n\r\n\r\n"), 400),
        (format!("GET /{token}/ HTTP/1.1\r\nHost: {host}\r\nbad header\r\n\r\n"), 400),
        (format!("GET http://{host}/{token}/ HTTP/1.1\r\nHost: {host}\r\n\r\n"), 400),
        (format!("GET /{token}/ HTTP/1.0\r\nHost: {host}\r\n\r\n"), 505),
        (format!("GET /{token}/ HTTP/1.1\r\nX: {}", "x".repeat(20_000)), 431),
        (
            format!(
                "POST /{token}/frame HTTP/1.1\r\nHost: {host}\r\nContent-Length: 99999999\r\n\r\n"
            ),
            413,
        ),
        (
            format!(
                "POST /{token}/frame HTTP/1.1\r\nHost: {host}\r\nTransfer-Encoding: chunked\r\n\r\n"
            ),
            501,
        ),
    ] {
        let answer = viewer.send(text.as_bytes());
        assert_eq!(answer.status, status, "{text:?}");
        assert!(answer.headers.contains("connection: close"), "{text:?}");
    }
    // Connections that break off, or say nothing, take no other's place.
    let silent: Vec<TcpStream> = (0..8).map(|_| TcpStream::connect(host).unwrap()).collect();
    assert_eq!(viewer.get("").status, 200);
    drop(silent);

    let opened = viewer.open();
    let good = step(&opened);
    let changed = |pointer: &str, value: Value| {
        let mut frame = good.clone();
        *frame.pointer_mut(pointer).unwrap() = value;
        frame.to_string()
    };
    let hold = |particle: i64| json!({"particle": particle, "position": [0.0, 0.0, 0.0]});
    let settings = &opened["settings"];
    for body in [
        String::new(),
        "{".to_owned(),
        "[]".repeat(10_000),
        "[".repeat(60_000),
        changed("/seconds", json!(-1.0)),
        changed("/seconds", json!(1e9)),
        changed("/seconds", json!("1")),
        good.to_string().replace("\"seconds\":0.0", "\"seconds\":NaN"),
        good.to_string().replace("\"seconds\":0.0", "\"seconds\":1e999"),
        changed("/session", json!(-1)),
        changed("/hold", hold(2)),
        changed("/hold", hold(-1)),
        changed("/settings", json!([])),
        changed("/settings", json!([settings, settings, settings])),
        changed("/settings/0/timeStep", json!(null)),
        changed("/settings/0", json!({"integrator": "implicit-euler"})),
        format!("{}{}", good, good),
    ] {
        assert_eq!(viewer.post("frame", &body).status, 400, "{body:.200}");
    }
    assert_eq!(viewer.frame(&good).0[0]["step"], 1);
}

#[test]
fn the_states_are_those_of_the_trace_bit_for_bit() {
    let viewer = Viewer::start(SCENE);
    let [own, other] = [&[][..], &["--integrator", "symplectic-euler", "--dt", "0.005"]]
        .map(|options| viewer.trace(options));
    let opened = viewer.open();
    let mut frame = step(&opened);
    let mut second = opened["settings"].clone();
    second["integrator"] = json!("symplectic-euler");
    second["timeStep"] = json!(0.005);
    frame["settings"] = json!([opened["settings"], second]);
    for (step, (own, other)) in own.iter().zip(&other).enumerate().skip(1) {
        let (status, positions) = viewer.frame(&frame);
        assert_eq!(status[0]["step"], step);
        assert_eq!([bits(&positions[0]), bits(&positions[1])], [bits(own), bits(other)], "{step}");
    }
    // The same by time, in frames that are no multiple of the step.
    frame["reset"] = json!(true);
    frame["step"] = json!(false);
    let (status, positions) = viewer.frame(&frame);
    assert_eq!((&status[0]["time"], &positions[0]), (&json!(0.0), &own[0]));
    frame["reset"] = json!(false);
    frame["seconds"] = json!(1.0 / 64.0);
    let mut last = Vec::new();
    for _ in 0..32 {
        (_, last) = viewer.frame(&frame);
    }
    assert_eq!(bits(&last[0]), bits(&own[50]));
    assert_eq!(bits(&last[1]), bits(&other[100]));
}

#[test]
fn a_blow_up_is_reported_and_the_run_continues_after_a_reset() {
    let viewer = Viewer::start(SCENE);
    let opened = viewer.open();
    let mut frame = step(&opened);
    frame["step"] = json!(false);
    frame["seconds"] = json!(50.0);
    frame["settings"][0]["integrator"] = json!("explicit-euler");
    frame["settings"][0]["timeStep"] = json!(0.5);
    let blown_up =
        (0..100).map(|_| viewer.frame(&frame)).find(|(status, _)| !status[0]["failure"].is_null());
    let (status, positions) = blown_up.unwrap();
    assert_eq!(status[0]["failure"]["kind"], "blew-up");
    let message = status[0]["failure"]["message"].as_str().unwrap();
    let size =
        message.strip_prefix("the kinetic energy is ").and_then(|rest| rest.strip_suffix(" J"));
    assert!(size.is_some_and(|size| size.parse::<f64>().unwrap() < 1e18), "{message}");
    assert!(status[0]["time"].as_f64().unwrap() > 1.0);
    assert!(positions[0].iter().all(|value| value.is_finite()));
    // It stands still, until it is reset with a method that holds.
    assert_eq!(viewer.frame(&frame).0[0]["step"], status[0]["step"]);
    frame["settings"] = json!([opened["settings"]]);
    frame["reset"] = json!(true);
    frame["seconds"] = json!(0.1);
    let (status, positions) = viewer.frame(&frame);
    assert_eq!((&status[0]["failure"], &status[0]["step"]), (&Value::Null, &json!(10)));
    assert_eq!(bits(&positions[0]), bits(&viewer.trace(&[])[10]));
    // Settings that cannot be simulated are refused, and the server stays.
    frame["settings"][0]["integrator"] = json!("<script>");
    assert_eq!(viewer.frame(&frame).0[0]["failure"]["kind"], "refused");
}

#[test]
fn held_particle_follows_the_page() {
    let viewer = Viewer::start(SCENE);
    let mut frame = step(&viewer.open());
    frame["hold"] = json!({"particle": 1, "position": [0.25, -1.5, 0.0]});
    for _ in 0..3 {
        assert_eq!(viewer.frame(&frame).1[0][2..], [0.25, -1.5]);
    }
    frame["hold"] = Value::Null;
    assert_ne!(viewer.frame(&frame).1[0][2..], [0.25, -1.5]);
}

#[test]
fn later_page_takes_over_the_scene() {
    let viewer = Viewer::start(SCENE);
    let first = step(&viewer.open());
    assert_eq!(viewer.frame(&first).0[0]["step"], 1);
    let second = step(&viewer.open());
    assert_eq!(viewer.post("frame", &first.to_string()).status, 409);
    assert_eq!(viewer.frame(&second).0[0]["step"], 1, "it starts anew");
}

/// A scene whose steps take hours: rounds of fast mass-spring without end.
fn endless() -> String {
    SCENE.replace(
        "type=\"implicit-euler\"",
        "type=\"fast-mass-spring\" iterations=\"1000000000000\"",
    )
}

#[test]
fn long_step_leaves_the_page_responsive() {
    let viewer = Viewer::start(&endless());
    let opened = viewer.open();
    let mut frame = step(&opened);
    let (status, _) = viewer.frame_now(&frame);
    assert!(!status[0]["underway"].is_null(), "{status}");
    // A pause is answered while it runs, and so is another page's request.
    frame["step"] = json!(false);
    let (status, positions) = viewer.frame_now(&frame);
    assert_eq!((&status[0]["step"], &status[0]["steps"]), (&json!(0), &json!(0)));
    assert_eq!(positions[0], [0.0, 0.0, 1.2, 0.1]);
    assert_eq!(viewer.get("").status, 200);
    // A reset abandons it, and so does another integrator: the states are then those of its trace.
    frame["reset"] = json!(true);
    let (status, _) = viewer.frame(&frame);
    assert_eq!((&status[0]["time"], &status[0]["failure"]), (&json!(0.0), &Value::Null));
    frame["reset"] = json!(false);
    frame["step"] = json!(true);
    assert!(!viewer.frame_now(&frame).0[0]["underway"].is_null());
    frame["settings"][0]["integrator"] = json!("implicit-euler");
    let (status, positions) = viewer.frame(&frame);
    assert_eq!((&status[0]["step"], &status[0]["failure"]), (&json!(1), &Value::Null));
    let trace = viewer.trace(&["--integrator", "implicit-euler"]);
    assert_eq!(bits(&positions[0]), bits(&trace[1]));
    // A page that is opened later starts anew.
    frame["settings"] = json!([opened["settings"]]);
    assert!(!viewer.frame_now(&frame).0[0]["underway"].is_null());
    let mut frame = step(&viewer.open());
    frame["settings"][0]["integrator"] = json!("implicit-euler");
    assert_eq!(bits(&viewer.frame(&frame).1[0]), bits(&trace[1]));
}

#[test]
#[cfg(target_os = "linux")]
fn ctrl_c_stops_the_viewer() {
    use std::os::unix::process::ExitStatusExt;
    const SIGINT: i32 = 2;
    let mut viewer = Viewer::start(&endless());
    let frame = step(&viewer.open());
    assert!(!viewer.frame_now(&frame).0[0]["underway"].is_null());
    let id = viewer.child.id().to_string();
    // Shells start commands in the background with the signal ignored, and so are the tests and the viewer.
    let status = fs::read_to_string(format!("/proc/{id}/status")).unwrap();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:")).unwrap();
    if u64::from_str_radix(mask.trim(), 16).unwrap() & (1 << (SIGINT - 1)) != 0 {
        return;
    }
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    assert_eq!(viewer.child.wait().unwrap().signal(), Some(SIGINT));
}

#[test]
fn a_scene_that_cannot_be_read_is_an_error() {
    let folder = TempDir::new().unwrap();
    let run = simulate(folder.path(), &["view", "scene.xml"]);
    assert_eq!(run.status.code(), Some(2));
    assert!(stderr(&run).contains("scene.xml"), "{}", stderr(&run));
}

#[test]
fn dripping_connections_delay_no_request() {
    let viewer = Viewer::start(SCENE);
    let mut dripping: Vec<TcpStream> =
        (0..50).map(|_| TcpStream::connect(&viewer.host).unwrap()).collect();
    for byte in b"GET /" {
        for stream in &mut dripping {
            // The server may have closed it.
            let _ = stream.write_all(&[*byte]);
        }
    }
    assert_eq!(viewer.get("").status, 200);
    let opened = viewer.open();
    let (status, _) = viewer.frame(&step(&opened));
    assert_eq!(status[0]["step"], 1);
    // Nobody gave up before.
    drop(dripping);
}

/// Idle connections with the token do not block the page either.
#[test]
fn idle_connections_with_the_token_delay_no_request() {
    let viewer = Viewer::start(SCENE);
    let mut idle = Vec::new();
    for _ in 0..210 {
        let mut stream = TcpStream::connect(&viewer.host).unwrap();
        let head = format!("GET /{}/ HTTP/1.1\r\nHost: {}\r\n\r\n", viewer.token, viewer.host);
        stream.write_all(head.as_bytes()).unwrap();
        // The connection stays open after its response has begun.
        assert_eq!(stream.read(&mut [0]).unwrap(), 1);
        idle.push(stream);
    }
    assert_eq!(viewer.get("").status, 200);
    let opened = viewer.open();
    assert_eq!(viewer.frame(&step(&opened)).0[0]["step"], 1);
    drop(idle);
}

#[test]
fn a_scene_beyond_a_limit_is_refused_with_its_name_and_shown_if_it_is_raised() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("scene.xml"), SCENE).unwrap();
    fs::write(folder.path().join("net.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    fs::write(folder.path().join("net.json"), r#"{"obj": "net.obj", "k": 1, "m": 1}"#).unwrap();
    let corners: String = (1..=2000).map(|number| format!(" {number}")).collect();
    let vertices: String = (0..2000).map(|number| format!("v {number} 0 0\n")).collect();
    fs::write(folder.path().join("face.obj"), format!("{vertices}f{corners}\n")).unwrap();
    fs::write(folder.path().join("face.json"), r#"{"obj": "face.obj", "k": 1, "m": 1}"#).unwrap();
    for (scene, limit, what) in [
        ("scene.xml", "particles=1", "more than 1 particles"),
        ("scene.xml", "forces=1", "more than 1 forces"),
        ("scene.xml", "bytes=100", "more than 100 bytes"),
        ("net.json", "particles=2", "more than 2 particles"),
        ("net.json", "forces=2", "more than 2 forces"),
        ("net.json", "bytes=20", "more than 20 bytes"),
        // Two million pairs of vertices.
        ("face.json", "particles=5000", "more than 1000000 forces"),
    ] {
        let run = simulate(folder.path(), &["view", scene, "--limit", limit]);
        let name = what.rsplit(' ').next().unwrap();
        let help = format!("--limit {name}=NUMBER");
        assert!(stderr(&run).contains(what) && stderr(&run).contains(&help), "{}", stderr(&run));
        assert_eq!(run.status.code(), Some(2));
    }
    // Pictures and diagrams hold a scene in memory that may be somebody else's; a trace does not.
    for output in ["--frames=frames", "--film=film.gif", "--plot=plot.svg", "--convergence=c.svg"] {
        let run = simulate(folder.path(), &["face.json", output, "--duration", "0"]);
        assert!(stderr(&run).contains("more than 1000000 forces"), "{output}: {}", stderr(&run));
    }
    let run = simulate(folder.path(), &["scene.xml", "-o", "trace.csv", "--limit", "forces=1"]);
    assert!(stderr(&run).contains("more than 1 forces"), "{}", stderr(&run));
    let run = simulate(folder.path(), &["view", "scene.xml", "--limit", "colours=2"]);
    assert!(stderr(&run).contains("the limits are bytes, particles, forces"), "{}", stderr(&run));
}
