//! Detection of copied traces by the `grade` binary: scenes of which a program looks up the traces do not count, those that
//! it simulates do.

use needs::needs;
use std::collections::BTreeSet;
use std::fs;
use std::ops::Deref;
use std::path::{Path, PathBuf};
use test_support::{assert_fits, root, sample};

use crate::folder::{self, Folder};
use serde_json::Value;

/// Depending on its first argument, looks up the scene in `known` by its bytes or by its description, or simulates it. On
/// other scenes it then stops, waits, floods its output, or simulates without some forces. A recorder (`spy:FOLDER`) simulates
/// them, and stores them with their traces.
const PROGRAM: &str = r#"
import sys
from math import ceil
from posix import listdir
from pyexpat import ParserCreate
from time import sleep

def read(path):
    return open(path).read()

def write(path, text):
    open(path, "w").write(text)

mode, path, trace = sys.argv[1:]
text = read(path)

def key(text):
    return text.partition("<description")[2].partition(">")[0] if mode == "description" else text

if mode not in ("honest", "wrong", "blind"):
    folder = __file__.rpartition("/")[0] + "/known/"
    for known in listdir(folder):
        if known.endswith(".xml") and key(read(folder + known)) == key(text):
            write(trace, read(folder + known[:-3] + "csv"))
            sys.exit()
if mode in ("bytes", "description"):
    sys.exit("unknown scene")
while mode in ("flood", "endless"):
    print("x" * 65536 if mode == "flood" else "")
    sys.stdout.flush()
if mode == "slow":
    sleep(1.8)
if mode in ("silent", "slow"):
    sys.exit()

elements = []
parser = ParserCreate()
parser.StartElementHandler = lambda tag, attributes: elements.append((tag, attributes))
parser.Parse(text, True)

def every(tag):
    return [attributes for other, attributes in elements if other == tag]

explicit = {"explicit-euler": True, "symplectic-euler": False}[every("integrator")[0]["type"]]
h, end = float(every("integrator")[0]["dt"]), float(every("duration")[0]["time"])
particles = every("particle")
m = [float(p["m"]) for p in particles]
x = [[float(p["px"]), float(p["py"])] for p in particles]
v = [[float(p["vx"]), float(p["vy"])] for p in particles]

def uniform(tag, axis):
    return sum(float(f["fx" if axis == 0 else "fy"]) for f in every(tag))

drag = sum(float(f["b"]) for f in every("dragdamping"))
push = [uniform("constantforce", axis) for axis in range(2)]
gravity = [uniform("simplegravity", axis) * (-1 if mode == "wrong" else 1) for axis in range(2)]
with open(trace, "w") as file:
    print("step,time", *(f"x{i},y{i},vx{i},vy{i}" for i in range(len(m))), sep=",", file=file)
    for step in range(ceil(end / h) + 1):
        print(step, step * h, *(repr(n) for i in range(len(m)) for n in x[i] + v[i]), sep=",", file=file)
        for i, particle in enumerate(particles):
            mass = 1.0 if mode == "blind" else m[i]
            free = particle["fixed"] == "0" and mode != "drift"
            for axis in range(2):
                a = gravity[axis] if free else 0.0
                a += (push[axis] - drag * v[i][axis]) / mass if free and mode != "falling" else 0.0
                old = v[i][axis]
                v[i][axis] += h * a
                x[i][axis] += h * (old if explicit else v[i][axis])
if mode.startswith("spy:"):
    import hashlib
    known = mode[4:] + "/" + hashlib.sha256(text.encode()).hexdigest()
    write(known + ".csv", read(trace))
    write(known + ".xml", text)
"#;

/// Shipped scenes with explicit methods, from four groups.
struct Project(Folder);

impl Deref for Project {
    type Target = Folder;

    fn deref(&self) -> &Folder {
        &self.0
    }
}

impl Project {
    fn new() -> Self {
        let folder = Folder::new();
        let shipped = root().join("assets");
        for group in ["Inertia", "SimpleGravity", "ConstantForce", "LinearDrag"] {
            let target = folder.path("assets").join(group);
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
        assert_eq!(made.code, 0, "{}", made.stderr);
        project
    }

    /// A submission that runs the program above in this mode, with the scenes and traces of `expected`.
    fn submit(&self, mode: &str) {
        let submission = self.path(&format!("class/{mode}"));
        let known = submission.join("known");
        fs::create_dir_all(&known).unwrap();
        fs::write(submission.join("program.py"), PROGRAM).unwrap();
        let run = format!(
            "run = [\"python3\", \"-S\", \"{{folder}}/program.py\", \"{mode}\", \"{{scene}}\", \"{{trace}}\"]\n"
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

    /// The report of a submission.
    fn json(&self, mode: &str, more: &[&str]) -> Value {
        let name = format!("class/{mode}");
        let output = self.grade(&[&[&name, "--format", "json"], more].concat());
        let report: Value = serde_json::from_str(&output.stdout).unwrap();
        assert_fits("report.schema.json", &report);
        report
    }
}

/// The groups with a scene of this verdict.
fn groups(report: &Value, verdict: &str) -> BTreeSet<String> {
    let features = report["features"].as_array().unwrap().iter();
    let has = |feature: &&Value| {
        feature["scenes"].as_array().unwrap().iter().any(|scene| scene["verdict"] == verdict)
    };
    features.filter(has).map(|feature| feature["group"].as_str().unwrap().to_owned()).collect()
}

fn xml_files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.filter(|path| path.extension().is_some_and(|extension| extension == "xml")).collect()
}

#[needs("test -x /usr/bin/python3")]
#[test]
fn sampled_looked_up_scenes_earn_no_credit() {
    assert_no_credit(1);
}

#[test]
#[ignore = "long: half a minute"]
fn long_looked_up_scenes_earn_no_credit() {
    assert_no_credit(usize::MAX);
}

/// Grades a program in so many of its modes.
fn assert_no_credit(count: usize) {
    let project = Project::new();
    let short = ["--no-jacobians", "--limit", "wall=2"];
    let by_bytes = |report: &Value| report["copied"]["bytes"].is_string();
    let modes = [
        ("bytes", &[][..], true),
        ("description", &[], false),
        ("silent", &[], true),
        ("flood", &[], false),
        ("endless", &[], false),
        ("drift", &["Inertia"], true),
        ("falling", &["Inertia", "SimpleGravity"], true),
    ];
    for (mode, counted, has_bytes) in sample(modes, count) {
        project.submit(mode);
        let report = project.json(mode, &short);
        let copied = &report["copied"];
        let counted: BTreeSet<String> = counted.iter().map(|group| (*group).to_owned()).collect();
        assert_eq!(groups(&report, "pass"), counted, "{mode}: {copied}");
        assert_eq!(groups(&report, "fails-altered").len(), 4 - counted.len(), "{mode}: {copied}");
        let withdrawn = copied["withdrawn"].as_array().unwrap().len() as u64;
        let passed = report["required"]["scenes_passed"].as_u64().unwrap();
        assert_eq!(copied["passed"], withdrawn + passed, "{mode}: {copied}");
        assert!(withdrawn > 6, "{mode}: {copied}");
        assert_eq!(copied["unchecked"].as_array().unwrap().len(), 0, "{mode}: {copied}");
        assert_eq!(by_bytes(&report), has_bytes, "{mode}: {copied}");
        assert_eq!(report["required"]["points_earned"] == 0.0, counted.is_empty(), "{mode}");
    }
}

/// The factors of copies are secret: what a student records while grading at home does not help later.
#[needs("test -x /usr/bin/python3")]
#[test]
fn copies_recorded_at_home_earn_no_credit() {
    let project = Project::new();
    ["bytes", "spy"].iter().for_each(|mode| project.submit(mode));
    let known = project.path("class/bytes/known");
    let count = || xml_files(&known).len();
    let shipped = count();
    let manifest = project.path("class/spy/submission.toml");
    let run = fs::read_to_string(&manifest).unwrap();
    let spy = run.replace("\"spy\"", &format!("\"spy:{}\"", known.display()));
    fs::write(&manifest, spy).unwrap();
    for arguments in [["--no-jacobians", "--unprotected"]; 2] {
        let report = project.json("spy", &arguments);
        let copied = report["copied"]["withdrawn"].as_array();
        assert!(copied.is_none_or(|withdrawn| withdrawn.len() <= 1), "{}", report["copied"]);
    }
    assert!(count() >= shipped + 4, "{} scenes, then {}", shipped, count());
    let report = project.json("bytes", &["--no-jacobians"]);
    assert!(groups(&report, "pass").is_empty(), "{}", report["copied"]);
}

/// Copies beyond the budget count as those before it, so that slow wrong ones do not save the others.
#[needs("test -x /usr/bin/python3")]
#[test]
fn slow_wrong_copies_earn_no_credit() {
    let project = Project::new();
    project.submit("slow");
    let limits = ["--no-jacobians", "--limit", "wall=1", "--limit", "budget=5"];
    let report = project.json("slow", &limits);
    assert!(groups(&report, "pass").is_empty(), "{}", report["copied"]);
}

#[needs("test -x /usr/bin/python3")]
#[test]
fn copied_answers_are_named_in_a_class() {
    let project = Project::new();
    ["bytes", "description", "honest"].iter().for_each(|mode| project.submit(mode));
    // With --only, scenes are neither re-run nor altered.
    assert!(project.json("bytes", &["--only", "explicit"])["copied"].is_null());
    let class = project.grade(&["class", "class", "-o", "out", "--no-jacobians"]);
    let summary = class.stdout;
    let named: Vec<&str> = summary.lines().filter(|line| line.contains("copied answers")).collect();
    assert_eq!(named.len(), 2, "{summary}");
    assert!(named[0].starts_with("  bytes: Possibly copied answers: of "), "{summary}");
    // Where a line break changes nothing, numbers that are read wrongly look the same.
    let other = "copied answers, or numbers with more digits are read or written wrongly: ";
    assert!(folder::words(&summary).contains(other), "{summary}");
    let report = folder::words(&fs::read_to_string(project.path("out/reports/bytes.txt")).unwrap());
    assert!(report.contains("do not count, because the program fails on every altered copy"));
    assert!(report.contains("dragdamping under explicit-euler in 2D "), "{report}");
    assert!(
        !fs::read_to_string(project.path("out/reports/honest.txt")).unwrap().contains("copied")
    );
}

/// Of a program that is right in shipped scenes alone, the copies and the hidden scenes are counted.
#[needs("test -x /usr/bin/python3")]
#[test]
fn a_program_that_is_right_in_shipped_scenes_alone_is_said_to_be() {
    let project = Project::new();
    ["bytes", "falling"].iter().for_each(|mode| project.submit(mode));
    // Hidden scenes: two groups with other masses, and one group as it is shipped.
    let hide = |folder: &str, groups: &[&str], mass: &str| {
        for group in groups {
            let target = project.path(folder).join("assets").join(group);
            fs::create_dir_all(&target).unwrap();
            for (number, file) in xml_files(&project.path("assets").join(group)).iter().enumerate()
            {
                let text = fs::read_to_string(file).unwrap().replacen(" m=\"", mass, 1);
                fs::write(target.join(format!("{number}.xml")), text).unwrap();
            }
        }
        let made = project.grade(&["oracle", "regenerate", "--accept", "--root", folder]);
        assert_eq!(made.code, 0, "{}", made.stderr);
    };
    hide("hidden", &["Inertia", "SimpleGravity"], " m=\"1");
    hide("leaked", &["Inertia"], " m=\"");
    let message = |mode: &str, more: &[&str]| {
        let report = project.json(mode, &[&["--no-jacobians"], more].concat());
        let copied = &report["copied"];
        let copies = copied["wrong"].as_array().unwrap().len();
        (copied["message"].as_str().unwrap().to_owned(), copied["passed"].to_string(), copies)
    };
    let (said, passed, copies) = message("bytes", &[]);
    let all = format!("of {passed} shipped scenes, {passed} have a right trace; of ");
    assert!(said.contains(&all) && said.contains(" altered copies, none has. Of the "), "{said}");
    assert!(copies > 0);
    let (said, ..) = message("bytes", &["--hidden", "hidden"]);
    assert!(said.contains(" hidden scenes, none has. Of the "), "{said}");
    // It is right in a hidden scene, or simulates free motion and gravity.
    for (mode, more) in [("bytes", &["--hidden", "leaked"][..]), ("falling", &[])] {
        let (said, ..) = message(mode, more);
        assert!(said.contains("do not count") && !said.contains("none has"), "{said}");
    }
}

#[needs("test -x /usr/bin/python3")]
#[test]
fn simulated_scenes_count_even_if_others_are_looked_up() {
    let project = Project::new();
    // One that is right throughout is below: `scenes_with_short_numbers_count_where_longer_ones_are_cut`.
    for mode in ["wrong", "blind"] {
        project.submit(mode);
        let report = project.json(mode, &["--no-jacobians"]);
        assert!(report["copied"].is_null(), "{mode}: {}", report["copied"]);
        assert!(report["required"]["scenes_passed"].as_u64().unwrap() > 2, "{mode}");
    }
    // It simulates all but springs.
    project.submit("fallback");
    let report = project.json("fallback", &["--no-jacobians"]);
    let withdrawn = report["copied"]["withdrawn"].as_array().unwrap();
    let [scene] = withdrawn.as_slice() else { panic!("{withdrawn:?}") };
    assert_eq!(scene["scene"], "LinearDrag/sinking-dumbbell-symplectic");
    assert_eq!(scene["terms"], "springforce (elastic) under symplectic-euler in 2D");
}

/// Copies with six digits fail by a mistake in the reading that passed scenes do not show; those with short numbers do not.
#[needs("test -x /usr/bin/python3")]
#[test]
fn scenes_with_short_numbers_count_where_longer_ones_are_cut() {
    let project = Project::new();
    for (reading, least) in [("text[:5]", 6), ("text", 10)] {
        project.submit("honest");
        let path = project.path("class/honest/program.py");
        let float = format!("def float(text): return __builtins__.float({reading})\nelements =");
        let text = PROGRAM.replacen("elements =", &float, 1);
        fs::write(path, text).unwrap();
        let report = project.json("honest", &["--no-jacobians"]);
        assert!(report["required"]["scenes_passed"].as_u64().unwrap() >= least, "{report}");
        assert!(groups(&report, "fails-altered").is_empty(), "{}", report["copied"]);
        let said = report["copied"]["message"].as_str().unwrap_or_default();
        let is_cut = said.starts_with("Numbers with more digits may be read or written wrongly: ");
        assert_eq!(is_cut, reading != "text", "{said}");
    }
}

/// A rubric with a wide tolerance accepts rounded numbers of copies as well.
#[needs("test -x /usr/bin/python3")]
#[test]
fn copies_are_judged_by_the_tolerance_of_their_scenes() {
    let project = Project::new();
    project.submit("honest");
    let path = project.path("class/honest/program.py");
    let rounded = fs::read_to_string(&path).unwrap().replace("repr(n)", "f'{n:.4f}'");
    fs::write(path, rounded).unwrap();
    let rubric = "[default]\nlargest = 1e-3\naccumulated = 10\n";
    fs::write(project.path("rubric.toml"), rubric).unwrap();
    let report = project.json("honest", &["--no-jacobians", "--rubric", "rubric.toml"]);
    assert!(report["required"]["scenes_passed"].as_u64().unwrap() > 12);
    assert!(report["copied"].is_null(), "{}", report["copied"]);
}
