//! Detection of copied traces by the `grade` binary: programs that look up traces are reported, simulators are not.

#![expect(clippy::print_stderr, reason = "a skipped test is told")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use test_support::{root, schema};

use serde_json::Value;
use tempfile::TempDir;

/// Depending on its first argument, looks up the scene in `known` by its bytes or by its description, or simulates it.
const PROGRAM: &str = r#"
import math, pathlib, re, sys
import xml.etree.ElementTree as ElementTree

mode, path, trace = sys.argv[1:]
text = pathlib.Path(path).read_text()

def key(text):
    return re.search("<description[^>]*>", text)[0] if mode == "description" else text

if mode in ("bytes", "description", "drift", "fallback"):
    for known in (pathlib.Path(__file__).parent / "known").glob("*.xml"):
        if key(known.read_text()) == key(text):
            pathlib.Path(trace).write_text(known.with_suffix(".csv").read_text())
            sys.exit()
if mode in ("bytes", "description"):
    sys.exit("unknown scene")

root = ElementTree.fromstring(text)
explicit = {"explicit-euler": True, "symplectic-euler": False}[root.find("integrator").get("type")]
h, end = float(root.find("integrator").get("dt")), float(root.find("duration").get("time"))
particles = root.findall("particle")
m = [float(p.get("m")) for p in particles]
x = [[float(p.get("px")), float(p.get("py"))] for p in particles]
v = [[float(p.get("vx")), float(p.get("vy"))] for p in particles]

def uniform(tag, axis):
    return sum(float(f.get("fx" if axis == 0 else "fy")) for f in root.findall(tag))

drag = sum(float(f.get("b")) for f in root.findall("dragdamping"))
push = [uniform("constantforce", axis) for axis in range(2)]
gravity = [uniform("simplegravity", axis) * (-1 if mode == "wrong" else 1) for axis in range(2)]
with open(trace, "w") as file:
    print("step,time", *(f"x{i},y{i},vx{i},vy{i}" for i in range(len(m))), sep=",", file=file)
    for step in range(math.ceil(end / h) + 1):
        print(step, step * h, *(repr(n) for i in range(len(m)) for n in x[i] + v[i]), sep=",", file=file)
        for i, particle in enumerate(particles):
            mass = 1.0 if mode == "blind" else m[i]
            free = particle.get("fixed") == "0" and mode != "drift"
            for axis in range(2):
                a = gravity[axis] + (push[axis] - drag * v[i][axis]) / mass if free else 0.0
                old = v[i][axis]
                v[i][axis] += h * a
                x[i][axis] += h * (old if explicit else v[i][axis])
"#;

/// Shipped scenes with explicit methods, from four groups.
struct Project(TempDir);

impl Project {
    /// `None` if Python is missing.
    fn new() -> Option<Self> {
        let is_there = |folder: &str| Path::new(folder).join("python3").exists();
        if !["/usr/local/bin", "/usr/bin", "/bin"].into_iter().any(is_there) {
            eprintln!("skipped: there is no python3");
            return None;
        }
        let folder = tempfile::tempdir().unwrap();
        let shipped = root().join("assets");
        for group in ["Inertia", "SimpleGravity", "ConstantForce", "LinearDrag"] {
            let target = folder.path().join("assets").join(group);
            fs::create_dir_all(&target).unwrap();
            for file in xml_files(&shipped.join(group)) {
                let name = file.file_name().unwrap().to_str().unwrap();
                if !name.contains("linearized") {
                    fs::copy(&file, target.join(name)).unwrap();
                }
            }
        }
        let project = Self(folder);
        let made = project.grade(&["oracle", "regenerate", "--accept"]);
        assert!(made.status.success(), "{made:?}");
        Some(project)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// A submission that runs the program above in this mode, with the scenes and traces of `expected`.
    fn submit(&self, mode: &str) {
        let submission = self.path(&format!("class/{mode}"));
        let known = submission.join("known");
        fs::create_dir_all(&known).unwrap();
        fs::write(submission.join("program.py"), PROGRAM).unwrap();
        let run = format!(
            "run = [\"python3\", \"{{folder}}/program.py\", \"{mode}\", \"{{scene}}\", \"{{trace}}\"]\n"
        );
        fs::write(submission.join("submission.toml"), run).unwrap();
        for group in fs::read_dir(self.path("assets")).unwrap() {
            let group = group.unwrap().path();
            for scene in xml_files(&group) {
                let name = scene.file_stem().unwrap().to_str().unwrap();
                let trace = Path::new("expected").join(group.file_name().unwrap()).join(name);
                fs::copy(&scene, known.join(format!("{name}.xml"))).unwrap();
                let trace = self.path(&format!("{}.csv", trace.display()));
                fs::copy(trace, known.join(format!("{name}.csv"))).unwrap();
            }
        }
    }

    fn grade(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_grade"));
        command.current_dir(self.0.path()).args(arguments).output().unwrap()
    }

    /// The report of a submission, and the number of scenes it passed.
    fn json(&self, mode: &str, more: &[&str]) -> (Value, u64) {
        let name = format!("class/{mode}");
        let output = self.grade(&[&[&name, "--format", "json"], more].concat());
        let report: Value = serde_json::from_slice(&output.stdout).unwrap();
        let schema = root().join("docs/report.schema.json");
        let schema = serde_json::from_str(&fs::read_to_string(schema).unwrap()).unwrap();
        schema::validate(&schema, &report).unwrap();
        let passed = report["required"]["scenes_passed"].as_u64().unwrap();
        (report["copied"].clone(), passed)
    }
}

fn xml_files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.filter(|path| path.extension().is_some_and(|extension| extension == "xml")).collect()
}

#[test]
fn a_program_that_looks_its_traces_up_is_named() {
    let Some(project) = Project::new() else { return };
    for (mode, by_bytes) in [("bytes", true), ("drift", true), ("description", false)] {
        project.submit(mode);
        let (copied, passed) = project.json(mode, &["--no-jacobians"]);
        assert_eq!(copied["passed"], passed, "{mode}: {copied}");
        assert!(passed > 12, "{passed} scenes");
        assert_eq!(copied["altered"].as_array().unwrap().len(), 6, "{mode}: {copied}");
        assert_eq!(copied["bytes"].is_string(), by_bytes, "{mode}: {copied}");
        if mode == "drift" {
            let (probed, _) = project.json(mode, &[]);
            assert_eq!(probed, copied, "what the probe finds shows no simulator");
        }
        // With --only, scenes are neither re-run nor altered.
        assert!(project.json(mode, &["--only", "explicit"]).0.is_null());
    }
    project.submit("honest");
    let class = project.grade(&["class", "class", "-o", "out", "--no-jacobians"]);
    let summary = String::from_utf8(class.stdout).unwrap();
    let named: Vec<&str> = summary.lines().filter(|line| line.contains("copied answers")).collect();
    assert_eq!(named.len(), 3, "{summary}");
    let start = "  bytes: Possibly copied answers: the program passes ";
    assert!(named[0].starts_with(start), "{summary}");
    let report = fs::read_to_string(project.path("out/reports/bytes.txt")).unwrap();
    assert!(report.contains("a wrong first step in all 6 slightly altered copies of them, and in"));
    assert!(
        !fs::read_to_string(project.path("out/reports/honest.txt")).unwrap().contains("copied")
    );
}

#[test]
fn a_program_that_simulates_is_not_named_whatever_else_it_does() {
    let Some(project) = Project::new() else { return };
    let unprobed: &[&str] = &["--no-jacobians"];
    for (mode, options) in
        [("honest", &[][..]), ("wrong", unprobed), ("blind", unprobed), ("fallback", &[])]
    {
        project.submit(mode);
        let (copied, passed) = project.json(mode, options);
        assert!(copied.is_null(), "{mode}: {copied}");
        assert!(passed > 2, "{mode}: {passed} scenes");
    }
}
