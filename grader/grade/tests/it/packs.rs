//! Course packs: hand-ins of sources, as students make them.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use needs::needs;
use test_support::{root, sample};

use crate::folder::{Folder, Run, grade};

/// The path of a pack that comes with the scenes.
fn pack(name: &str) -> String {
    root().join("assets/packs").join(name).display().to_string()
}

/// The points and the verdict of each submission of a class.
fn rows(folder: &Folder) -> BTreeMap<String, (String, String)> {
    let table = folder.read("out/summary.csv");
    let rows = table.lines().skip(1).map(|line| {
        let cells: Vec<&str> = line.split(',').collect();
        (cells[0].to_owned(), (cells[2].to_owned(), cells[1].to_owned()))
    });
    rows.collect()
}

/// Output of a Python script in a folder.
fn python(folder: &Path, script: &str) {
    let mut child = Command::new("/usr/bin/python3")
        .current_dir(folder)
        .arg("-")
        .stdin(Stdio::piped())
        .stderr(Stdio::inherit())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(script.as_bytes()).unwrap();
    assert!(child.wait().unwrap().success());
}

/// Removes all submissions of a class but a sample of `count`, and those that start with one of `always`. Yields the
/// number of those left.
fn draw_class(folder: &Folder, always: &[&str], count: usize) -> usize {
    let entries = fs::read_dir(folder.path("class")).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    let n_names = names.len();
    names.retain(|name| !always.iter().any(|start| name.starts_with(start)));
    let dropped = sample(names.clone(), names.len().saturating_sub(count));
    dropped.iter().for_each(|name| remove(folder, &format!("class/{name}")));
    n_names - dropped.len()
}

/// A copy of the pack of functions in Python, with some scenes added.
fn small_pack(folder: &Folder) {
    small_copy(folder, "functions-python");
}

/// A copy of a pack of functions, with some scenes added.
fn small_copy(folder: &Folder, name: &str) {
    let copied = Command::new("cp").arg("-r").arg(pack(name)).arg(folder.path("pack")).status();
    assert!(copied.unwrap().success());
    with_scenes(folder);
}

fn check(folder: &Folder) -> Run {
    grade(&folder.path("."), &["pack", "check", "pack"])
}

/// Asserts that a check found two examples and no fault.
fn assert_passed(run: &Run) {
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    assert!(run.stdout.ends_with("2 examples, 0 faults, 0 warnings\n"), "{}", run.stdout);
}

const FUNCTION_PACKS: [&str; 3] = ["functions-python", "functions-javascript", "functions-cpp"];

#[needs("test -x /usr/bin/python3 && test -x /usr/bin/node && g++ --version")]
#[test]
fn sampled_function_pack_with_few_scenes_passes_its_own_check() {
    for name in sample(FUNCTION_PACKS, 1) {
        let folder = Folder::new();
        small_copy(&folder, name);
        assert_passed(&check(&folder));
    }
}

#[needs("test -x /usr/bin/python3 && test -x /usr/bin/node && g++ --version")]
#[test]
#[ignore = "long: half a minute"]
fn long_function_packs_pass_their_own_check() {
    for name in FUNCTION_PACKS {
        assert_passed(&grade(root(), &["pack", "check", name]));
    }
}

#[needs("test -d /usr/include/eigen3 && g++ --version")]
#[test]
#[ignore = "long: a minute of compiling"]
fn long_fast_mass_spring_pack_passes_its_own_check() {
    assert_passed(&grade(root(), &["pack", "check", "fast-mass-spring"]));
}

#[needs("test -x /usr/bin/python3")]
#[test]
fn sampled_functions_are_graded_one_by_one() {
    assert_graded_one_by_one(1);
}

#[needs("test -x /usr/bin/python3")]
#[test]
#[ignore = "long: ten seconds"]
fn long_functions_are_graded_one_by_one() {
    assert_graded_one_by_one(usize::MAX);
}

/// Plants so many single mistakes in functions: each is found by its own function alone, and named.
fn assert_graded_one_by_one(count: usize) {
    let folder = Folder::new();
    small_pack(&folder);
    let right = folder.read("pack/examples/right/forces.py");
    let graded = |text: &str| {
        folder.write("ada.py", text);
        let args = ["--pack", "pack", "ada.py", "--format", "json", "--no-jacobians"];
        let run = grade(&folder.path("."), &args);
        let report: serde_json::Value = serde_json::from_str(&run.stdout).expect(&run.stderr);
        let features = report["features"].as_array().unwrap().clone();
        let functions = features.into_iter().filter_map(|feature| {
            let name = feature["group"].as_str()?.strip_prefix("functions/")?.to_owned();
            let scene = &feature["scenes"][0];
            let verdict = scene["verdict"].as_str()?.to_owned();
            let message = scene["message"].as_str().unwrap_or_default().to_owned();
            Some((name, (verdict, message, feature["points_earned"].as_f64()?)))
        });
        functions.collect::<BTreeMap<_, _>>()
    };
    let found = graded(&right);
    assert_eq!(found.len(), 4);
    assert!(found.values().all(|(verdict, ..)| verdict == "pass"), "{found:?}");
    let points: f64 = found.values().map(|(.., earned)| earned).sum();
    assert_eq!(points, 5.0);
    let last = |name: &str, negate: &str| {
        format!(
            "{right}\n_right = {name}\ndef {name}(*a):\n    f = _right(*a)\n    return {negate}\n"
        )
    };
    let mistakes = [
        (
            "spring",
            "spring",
            "[-c for c in f]",
            "wrong-function",
            "all of it is exactly the negative",
        ),
        ("drag", "drag", "[2 * c for c in f]", "wrong-function", "a factor 2 too many"),
        ("gravitation", "gravitation", "[f[0], 0.0]", "wrong-function", "entry ("),
        ("gravity", "simple_gravity", "1 / 0", "crashed", "ZeroDivisionError"),
        ("spring", "spring", "exit(77)", "not-implemented", ""),
        ("drag", "drag", "[float('nan')] * 2", "wrong-function", "finite"),
        ("drag", "drag", "[f[0]]", "wrong-function", "1 numbers, not 2 x 1"),
    ];
    for (name, called, edit, verdict, says) in sample(mistakes, count) {
        for (function, (found, message, earned)) in graded(&last(called, edit)) {
            if function == name {
                assert_eq!((found.as_str(), earned), (verdict, 0.0), "{edit}: {message}");
                assert!(message.contains(says), "{edit}: {message}");
            } else {
                assert_eq!(found, "pass", "{edit}: {function}: {message}");
            }
        }
    }
}

/// A fault of a pack: its name, how it is planted, and what the check says.
type Fault = (&'static str, fn(&Folder), &'static str);

/// Replaces text in the manifest.
fn edit(folder: &Folder, old: &str, new: &str) {
    let text = folder.read("pack/pack.toml");
    assert!(text.contains(old), "{old}");
    folder.write("pack/pack.toml", &text.replacen(old, new, 1));
}

/// Adds text to the manifest.
fn append(folder: &Folder, text: &str) {
    folder.write("pack/pack.toml", &(folder.read("pack/pack.toml") + text));
}

/// Adds scenes, traces and an assignment to the pack.
fn with_scenes(folder: &Folder) {
    for scene in [
        "Spring/compressed-strut-explicit",
        "Spring/shearing-pair-symplectic",
        "LinearDrag/three-weights-explicit",
        "LinearDrag/sinking-dumbbell-symplectic",
    ] {
        for file in [format!("assets/{scene}.xml"), format!("expected/{scene}.csv")] {
            let to = folder.path("pack").join(&file);
            fs::create_dir_all(to.parent().unwrap()).unwrap();
            fs::copy(root().join(file), to).unwrap();
        }
    }
    for name in ["manifest.toml", "envelopes.toml"] {
        fs::copy(root().join("expected").join(name), folder.path("pack/expected").join(name))
            .unwrap();
    }
    fs::create_dir_all(folder.path("pack/assets/assignments")).unwrap();
    fs::copy(
        root().join("assets/assignments/all.toml"),
        folder.path("pack/assets/assignments/all.toml"),
    )
    .unwrap();
    folder.write(
        "pack/assets/assignments/t1m2.toml",
        "title = \"Two groups\"\nforces = [\"springforce\", \"dragdamping\", \"simplegravity\"]\nintegrators = \
         [\"explicit-euler\", \"symplectic-euler\"]\n[[feature]]\nsection = \"required\"\ngroups = [\"Spring\", \
         \"LinearDrag\"]\n",
    );
    edit(
        folder,
        "fails = [\"Spring\", \"SpringDamping\", \"FixedParticles\", \"LinearDrag\", \"Combined\", \
         \"functions/spring\"]",
        "fails = [\"Spring\", \"LinearDrag\", \"functions/spring\"]",
    );
}

fn remove(folder: &Folder, path: &str) {
    let path = folder.path(path);
    if path.is_dir() { fs::remove_dir_all(path).unwrap() } else { fs::remove_file(path).unwrap() }
}

const FAULTS: &[Fault] = &[
    ("no manifest", |f| remove(f, "pack/pack.toml"), "there is no pack.toml"),
    ("syntax", |f| edit(f, "title = ", "title "), "pack.toml:4:7"),
    ("unknown key", |f| edit(f, "[run]", "[run]\nshell = true"), "unknown field `shell`"),
    (
        "unknown function",
        |f| edit(f, "springforce/force", "springforce/jerk"),
        "springforce gives no \"jerk\"\n  help: it gives force, energy, gradient,",
    ),
    (
        "functions without answers",
        |f| edit(f, ", \"{answers}\"]", "]"),
        "command holds no {answers}",
    ),
    ("unknown table", |f| append(f, "\n[limit]\nwall = 1\n"), "unknown field `limit`"),
    ("no title", |f| edit(f, "title = ", "#"), "missing field `title`"),
    ("no run", |f| edit(f, "[run]\ncommand", "[build]\ncommands"), "pack.toml:"),
    ("no files", |f| edit(f, "files = [\"forces.py\"]", "files = []"), "files names none"),
    (
        "absolute pattern",
        |f| edit(f, "files = [\"forces.py\"", "files = [\"/etc/*\""),
        "not a path below the project",
    ),
    (
        "pattern that leads out",
        |f| edit(f, "files = [\"forces.py\"", "files = [\"../*\""),
        "not a path below the project",
    ),
    (
        "need that is never taken",
        |f| edit(f, "needs = [\"forces.py\"]", "needs = [\"main.py\"]"),
        "\"main.py\" is needed, but never taken",
    ),
    ("no scene in the command", |f| edit(f, "{scene}", "scene.xml"), "command holds no {scene}"),
    (
        "no trace in the command",
        |f| edit(f, "\"{trace}\"", "\"trace.csv\""),
        "command holds no {trace}",
    ),
    (
        "no program in the command",
        |f| edit(f, "\"python3\", ", "\"\", "),
        "command names no program",
    ),
    (
        "empty build command",
        |f| append(f, "\n[build]\ncommands = [[]]\n"),
        "commands names no program",
    ),
    ("unknown format", |f| edit(f, "[run]", "[run]\nformat = \"json\""), "unknown variant `json`"),
    (
        "readable that is missing",
        |f| edit(f, "[run]", "[run]\nreadable = [\"data\"]"),
        "data: No such file",
    ),
    (
        "no starter code",
        |f| append(f, "\n[starter]\nfolder = \"starter\"\nhelp = \"fetch it\"\n"),
        "there is no starter code\n  help: fetch it",
    ),
    ("unknown assignment", |f| edit(f, "\"t1m2\"", "\"t9m9\""), "there is no assignment \"t9m9\""),
    ("example that is missing", |f| remove(f, "pack/examples/right"), "there is no example"),
    (
        "pattern of an example without scenes",
        |f| edit(f, "fails = [\"Spring\"", "fails = [\"Sprong\""),
        "nothing matches \"Sprong\"",
    ),
    (
        "points that do not add up",
        |f| edit(f, "assignment =", "points = 100\nassignment ="),
        "promises 100 required points",
    ),
    (
        "feature without points",
        |f| f.write("pack/rubric.toml", "[[feature]]\ngroup = \"Spring\"\npoints = 0\n"),
        "is required, and has no points",
    ),
    (
        "rubric of an unknown group",
        |f| f.write("pack/rubric.toml", "[[feature]]\ngroup = \"Sprong\"\npoints = 2\n"),
        "matches no scene",
    ),
    (
        "rubric with a negative number",
        |f| f.write("pack/rubric.toml", "[default]\npoints = -1\n"),
        "rubric.toml:2",
    ),
    (
        "driver that a hand-in replaces",
        |f| edit(f, "files = [\"forces.py\"", "files = [\"*.py\""),
        "a hand-in can replace driver.py",
    ),
    (
        "trace among the files of the build",
        |f| {
            let trace = root().join("expected/Spring/shearing-pair-symplectic.csv");
            fs::copy(trace, f.path("pack/project/data.txt")).unwrap();
        },
        "data.txt, which is a trace of the oracle",
    ),
    (
        "program among the files of the build",
        |f| {
            fs::copy("/bin/true", f.path("pack/project/oracle")).unwrap();
        },
        "oracle, a program that they could run",
    ),
    (
        "solution among the files of the build",
        |f| append(f, "\n[starter]\nfolder = \".\"\n"),
        "which is an example",
    ),
    (
        "readable example",
        |f| edit(f, "[run]", "[run]\nreadable = [\"examples\"]"),
        "which has an example in it",
    ),
    (
        "readable oracle",
        |f| edit(f, "[run]", "[run]\nreadable = [\".\"]"),
        "which has the oracle in it",
    ),
    (
        "missing trace",
        |f| remove(f, "pack/expected/Spring/shearing-pair-symplectic.csv"),
        "Spring/shearing-pair-symplectic: ",
    ),
    (
        "trace of an older scene",
        |f| {
            let path = "pack/assets/Spring/shearing-pair-symplectic.xml";
            f.write(path, &f.read(path).replace("m=\"", "m=\"1"));
        },
        "Spring/shearing-pair-symplectic: ",
    ),
    (
        "edited trace",
        |f| {
            let path = "pack/expected/Spring/shearing-pair-symplectic.csv";
            f.write(path, &f.read(path).replacen("\n1,", "\n1,9", 1));
        },
        "Spring/shearing-pair-symplectic: ",
    ),
    (
        "scene that is no scene",
        |f| {
            f.write("pack/assets/Spring/new.xml", "<scene>");
        },
        "new.xml:",
    ),
    (
        "new scene without a trace",
        |f| {
            f.write(
                "pack/assets/Spring/new.xml",
                &f.read("pack/assets/Spring/shearing-pair-symplectic.xml"),
            );
        },
        "Spring/new: ",
    ),
    (
        "no scenes",
        |f| {
            remove(f, "pack/assets");
            fs::create_dir_all(f.path("pack/assets")).unwrap();
        },
        "no scenes",
    ),
    (
        "assignment without scenes",
        |f| {
            let path = "pack/assets/assignments/t1m2.toml";
            f.write(
                path,
                &f.read(path).replace(
                    "\"LinearDrag\"]",
                    "\"LinearDrag\"]\n[[feature]]\ngroups = [\"Sprong\"]",
                ),
            );
        },
        "selects no scene",
    ),
    (
        "hidden scenes that are not there",
        |f| {
            f.write(
                "pack/rubric.toml",
                "[hidden]\nscenes = 3\nfolder = \"hidden\"\n\n[default]\npoints = 1\n",
            )
        },
        "promises hidden scenes, and there are none",
    ),
    (
        "right program that is wrong",
        |f| {
            fs::copy(
                f.path("pack/examples/spring-pulls-wrong-way/forces.py"),
                f.path("pack/examples/right/forces.py"),
            )
            .unwrap();
        },
        "example right does not pass",
    ),
    (
        "wrong program that is right",
        |f| {
            fs::copy(
                f.path("pack/examples/right/forces.py"),
                f.path("pack/examples/spring-pulls-wrong-way/forces.py"),
            )
            .unwrap();
        },
        "where it should fail",
    ),
    (
        "wrong program that fails elsewhere",
        |f| edit(f, ", \"LinearDrag\", ", ", "),
        "name these scenes in `fails` too",
    ),
    (
        "driver that prints to the trace",
        |f| {
            let driver = f.read("pack/project/driver.py");
            f.write(
                "pack/project/driver.py",
                &driver.replace(
                    "    for step in range(steps + 1):\n",
                    "    print(\"starting\", file=trace)\n    for step in range(steps + 1):\n",
                ),
            );
        },
        "example right does not pass",
    ),
    (
        "build that fails",
        |f| append(f, "\n[build]\ncommands = [[\"false\"]]\n"),
        "the build ended with exit status 1",
    ),
    (
        "example without the needed file",
        |f| {
            fs::rename(
                f.path("pack/examples/right/forces.py"),
                f.path("pack/examples/right/force.py"),
            )
            .unwrap();
        },
        "example right does not pass",
    ),
    (
        "starting file that is the solution",
        |f| {
            fs::copy(f.path("pack/examples/right/forces.py"), f.path("pack/project/forces.py"))
                .unwrap();
        },
        "what students start from passes every required scene",
    ),
];

#[needs("test -x /usr/bin/python3")]
#[test]
fn sampled_faults_of_a_pack_are_refused_with_their_remedy() {
    assert_refused(4);
}

#[needs("test -x /usr/bin/python3")]
#[test]
#[ignore = "long: half a minute"]
fn long_every_fault_of_a_pack_is_refused_with_its_remedy() {
    assert!(FAULTS.len() >= 40);
    assert_refused(usize::MAX);
}

/// Checks packs with so many of the faults.
fn assert_refused(count: usize) {
    for (name, plant, says) in sample(FAULTS, count) {
        let folder = Folder::new();
        small_pack(&folder);
        plant(&folder);
        let run = check(&folder);
        assert_eq!(run.code, 1, "{name}: {}{}", run.stdout, run.stderr);
        assert!(run.stdout.contains(says), "{name}: {}", run.stdout);
        assert!(run.stdout.starts_with("fault: "), "{name}: {}", run.stdout);
    }
}

#[needs("test -x /usr/bin/python3")]
#[test]
fn pack_without_both_kinds_of_examples_gets_a_warning() {
    let folder = Folder::new();
    small_pack(&folder);
    let text = folder.read("pack/pack.toml");
    folder.write("pack/pack.toml", text.split("[[example]]").next().unwrap());
    let run = check(&folder);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    assert!(run.stdout.contains("warning: no right program"), "{}", run.stdout);
    assert!(run.stdout.contains("warning: no wrong program"), "{}", run.stdout);
}

/// Each hand-in of one source, and the points of 43 that it gets, or what its report says.
const FORMS: &str = r##"
import io, os, shutil, tarfile, zipfile
right = open("right.py").read()
def folder(name, files):
    for path, text in files.items():
        full = os.path.join("class", name, path)
        os.makedirs(os.path.dirname(full), exist_ok=True)
        open(full, "w", newline="").write(text)
def zipped(name, files, method=zipfile.ZIP_DEFLATED, target=None):
    with zipfile.ZipFile(target or os.path.join("class", name), "w", method, compresslevel=1) as archive:
        for path, text in files.items():
            archive.writestr(path, text)
os.makedirs("class")
folder("right-folder", {"forces.py": right})
folder("right-nested", {"a/b/c/forces.py": right})
folder("right-junk", {"forces.py": right, ".git/config": "x", "__MACOSX/forces.py": "x", ".vscode/forces.py": "x", "forces.py~": "x"})
folder("right-windows", {"forces.py": right.replace("\n", "\r\n")})
folder("right-report", {"report.pdf": "%PDF", "src/forces.py": right, "video.mp4": "x" * 1000})
folder("right-old-copy", {"forces.py": right, "old/forces.py": "broken ("})
open("class/right-file.py", "w").write(right)
os.rename("class/right-file.py", "class/forces.py")
zipped("right.zip", {"forces.py": right})
zipped("right-stored.zip", {"forces.py": right}, zipfile.ZIP_STORED)
zipped("right-mac.zip", {"hand-in/forces.py": right, "__MACOSX/hand-in/._forces.py": "\0\5", "hand-in/.DS_Store": "x"})
zipped("right-backslash.zip", {"hand-in\\forces.py": right})
inner = io.BytesIO()
zipped("", {"t/forces.py": right}, target=inner)
zipped("right-twice.zip", {"inner.zip": inner.getvalue()})
folder("right-zip-in-folder", {"x": ""})
os.remove("class/right-zip-in-folder/x")
zipped("right-zip-in-folder/hand-in.zip", {"forces.py": right})
for name, mode in [("right.tar.gz", "w:gz"), ("right.tar", "w")]:
    with tarfile.open("class/" + name, mode) as archive:
        archive.add("right.py", "deep/forces.py")
raw = b"caf\xe9/forces.py"
with zipfile.ZipFile("class/right-latin.zip", "w") as archive:
    archive.writestr("cafX/forces.py", right)
data = open("class/right-latin.zip", "rb").read().replace(b"cafX", b"caf\xe9")
open("class/right-latin.zip", "wb").write(data)
zipped("bad-empty.zip", {})
zipped("bad-other.zip", {"report.pdf": "x"})
zipped("bad-leads-out.zip", {"../forces.py": right})
zipped("bad-absolute.zip", {"/forces.py": right})
zipped("bad-twice.zip", {"a/forces.py": right, "b/forces.py": right + "\n"})
zipped("bad-bomb.zip", {})
zipped("bad-many.zip", {})
data = open("class/right.zip", "rb").read()
open("class/bad-cut.zip", "wb").write(data[:60] + data[70:])
data = open("class/right.tar.gz", "rb").read()
open("class/bad-cut.tar.gz", "wb").write(data[:-6])
open("class/bad-7z.7z", "wb").write(b"7z\xbc\xaf\x27\x1c" + b"\0" * 100)
open("class/bad-rar.rar", "wb").write(b"Rar!\x1a\x07\0" + b"\0" * 100)
open("class/bad-program.exe", "wb").write(b"MZ" + b"\0" * 100)
data = open("class/right.zip", "rb").read()
open("class/bad-polyglot.zip", "wb").write(b"#!/bin/sh\n" + data)
open("class/bad-void.zip", "wb").close()
os.makedirs("class/bad-alone")
open("class/bad-alone/hand-in.ZIP", "w").write("my forces")
zipped("bad-name.zip", {"xX/forces.py": right})
data = open("class/bad-name.zip", "rb").read().replace(b"xX", b"x\0")
open("class/bad-name.zip", "wb").write(data)
zipped("bad-long.zip", {"n" * 300 + "/forces.py": right})
zipped("bad-deep.zip", {"d/" * 120 + "forces.py": right})
zipped("bad-below.zip", {"d": "", "d/forces.py": right})
open("class/bad-text.txt", "w").write("my forces are in the other folder")
os.makedirs("class/bad-nothing")
"##;

/// Fills those of the forms that take long to write, if they are still there.
const LARGE_FORMS: &str = r##"
import os, zipfile
for name, files in [
    ("bad-bomb.zip", lambda: [("forces.py", "\0" * (520 << 20))]),
    ("bad-many.zip", lambda: [(f"f{n}", "") for n in range(20_100)]),
]:
    if os.path.exists("class/" + name):
        with zipfile.ZipFile("class/" + name, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
            for path, text in files():
                archive.writestr(path, text)
"##;

#[needs("test -x /usr/bin/python3")]
#[test]
fn sampled_forms_of_a_hand_in_are_graded_or_named() {
    assert_forms(6);
}

#[needs("test -x /usr/bin/python3")]
#[test]
#[ignore = "long: half a minute"]
fn long_every_form_of_a_hand_in_is_graded_or_named() {
    assert_eq!(assert_forms(usize::MAX), 37);
}

/// Grades so many of the forms; yields their number.
fn assert_forms(count: usize) -> usize {
    let folder = Folder::new();
    let right = Path::new(&pack("functions-python")).join("examples/right/forces.py");
    fs::copy(right, folder.path("right.py")).unwrap();
    python(&folder.path("."), FORMS);
    let n_forms = draw_class(&folder, &[], count);
    python(&folder.path("."), LARGE_FORMS);
    small_pack(&folder);
    let arguments = ["class", "class", "-o", "out", "--pack", "pack", "--no-jacobians"];
    let run = grade(&folder.path("."), &arguments);
    let rows = rows(&folder);
    assert_eq!(rows.len(), n_forms, "{rows:?} {}", run.stderr);
    for (name, (points, verdict)) in &rows {
        let report = folder.read(&format!("out/reports/{name}.txt"));
        if name.starts_with("bad-") {
            assert_eq!((points.as_str(), verdict.as_str()), ("0", "bad-hand-in"), "{name}");
        } else {
            assert_eq!(verdict, "passed", "{name}: {points} {report}");
        }
    }
    for (name, says) in [
        ("bad-empty.zip", "it holds no file"),
        ("bad-other.zip", "it holds report.pdf"),
        ("bad-leads-out.zip", "../forces.py leads out of the archive"),
        ("bad-absolute.zip", "/forces.py leads out of the archive"),
        ("bad-twice.zip", "both look like the hand-in"),
        ("bad-bomb.zip", "more than 512 MiB"),
        ("bad-many.zip", "20000 files"),
        ("bad-cut.zip", "damaged"),
        ("bad-cut.tar.gz", "damaged"),
        ("bad-7z.7z", "a 7z archive, which is not read"),
        ("bad-rar.rar", "a rar archive, which is not read"),
        ("bad-polyglot.zip", "is named like an archive, but is not one"),
        ("bad-void.zip", "is named like an archive, but is not one"),
        ("bad-alone", "hand-in.ZIP is named like an archive, but is not one"),
        ("bad-name.zip", "has a zero byte in its name"),
        ("bad-long.zip", "has a name that is too long"),
        ("bad-deep.zip", "the archive holds folders nested deeper than 100"),
        ("bad-below.zip", "d/forces.py is below a file"),
        ("bad-program.exe", "a program for Windows"),
        ("bad-text.txt", "it holds bad-text.txt"),
        ("bad-nothing", "it holds no file"),
    ] {
        if rows.contains_key(name) {
            let report = folder.read(&format!("out/reports/{name}.txt"));
            assert!(report.contains(says) && report.contains("help: "), "{name}: {report}");
        }
    }
    n_forms
}

/// A package for a platform has the pack and its starter code, but not the examples, and grades as the pack does.
#[needs("test -x /usr/bin/python3")]
#[test]
fn packages_for_platforms_hold_the_pack() {
    let folder = Folder::new();
    small_pack(&folder);
    let starter = "\n[starter]\nfolder = \"../start\"\nfiles = [\"driver.py\"]\n";
    append(&folder, starter);
    fs::create_dir(folder.path("start")).unwrap();
    fs::rename(folder.path("pack/project/driver.py"), folder.path("start/driver.py")).unwrap();
    folder.write("start/solution.py", "secret");
    let export = |platform: &str, options: &[&str]| {
        let named = ["export", platform, "--pack", "pack", "-o", platform];
        grade(&folder.path("."), &[&named, options].concat())
    };
    let run = export("gradescope", &["--program", "/bin/true"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(run.stderr.contains("points of the assignment to 4\n"), "{}", run.stderr);
    python(
        &folder.path("."),
        "import zipfile\nzipfile.ZipFile('gradescope').extractall('package')",
    );
    let suite = folder.path("package/suite");
    assert!(suite.join("pack/pack.toml").is_file() && suite.join("starter/driver.py").is_file());
    for left_out in ["pack/examples", "pack/assets", "starter/solution.py", "assets/packs"] {
        assert!(!suite.join(left_out).exists(), "{left_out}");
    }
    let submission = |example: &str| {
        let own = folder.path("pack/examples").join(example).join("forces.py");
        fs::create_dir_all(folder.path("package/submission")).unwrap();
        fs::copy(own, folder.path("package/submission/forces.py")).unwrap();
        // As the package's script runs it.
        let run = grade(
            &folder.path("package"),
            &["submission", "--root", "suite", "--assignment", "t1m2", "--format", "json"],
        );
        let report: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
        (run.code, report["required"]["points_earned"].to_string())
    };
    // Four points of scenes, and five of functions.
    assert_eq!(submission("right"), (0, "9.0".to_owned()));
    assert_eq!(submission("spring-pulls-wrong-way").0, 1);

    let run = export("prairielearn", &["--program", "/bin/true", "--image", "course/oracle"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let question = "prairielearn/questions/spring-oracle-t1m2/question.html";
    assert!(folder.read(question).contains("<pl-file-upload file-names=\"forces.py\">"));

    let run = export("classroom50", &["--program", "/bin/true"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(run.stderr.contains("can read the starter code"), "{}", run.stderr);

    let run = export("github", &["--repository", "course/oracle"]);
    assert_eq!(run.code, 2, "{}", run.stdout);
    assert!(
        run.stderr.contains("name the pack in the rubric of that repository"),
        "{}",
        run.stderr
    );
}

/// The rubric names the pack, for all who grade with its scenes.
#[needs("test -x /usr/bin/python3")]
#[test]
fn rubric_names_the_pack() {
    let folder = Folder::new();
    small_pack(&folder);
    for name in ["assets", "expected"] {
        fs::rename(folder.path("pack").join(name), folder.path(name)).unwrap();
    }
    folder.write("assets/rubric.toml", "[pack]\nfolder = \"../pack\"\n");
    let here = folder.path(".");
    let run = grade(&here, &["pack/examples/right/forces.py", "--root", "."]);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    fs::create_dir(folder.path("class")).unwrap();
    fs::copy(folder.path("pack/examples/right/forces.py"), folder.path("class/ada.py")).unwrap();
    let run = grade(&here, &["class", "class", "-o", "out", "--root", "."]);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    folder.write("assets/rubric.toml", "[pack]\nfolder = \"pack\"\n");
    let run = grade(&here, &["pack/examples/right/forces.py", "--root", "."]);
    assert_eq!(run.code, 2, "{}", run.stdout);
    assert!(run.stderr.contains("assets/pack: no pack"), "{}", run.stderr);
}

/// Twenty hand-ins on starter code of the course's form, and what each gets of three points.
const CLASS: &str = r##"
import io, os, re, shutil, zipfile
start = {}
for name in os.listdir("start/FOSSSim"):
    start[name] = open("start/FOSSSim/" + name).read()
def filled(name, body):
    return re.sub(r' *// your code here\n.*\n', body, start[name])
gravity = filled("SimpleGravityForce.cpp", """
    for (std::size_t k = 0; k < gradE.size(); ++k) gradE[k] -= m[k] * (k % 2 == 0 ? m_fx : m_fy);
""")
euler = filled("ExplicitEuler.cpp", """
    VectorXs &x = scene.getX(), &v = scene.getV(), F(x.size(), 0.0);
    scene.accumulateGradU(F);
    for (std::size_t k = 0; k < x.size(); ++k) {
        x[k] += dt * v[k];
        if (!scene.isFixed(k / 2)) v[k] -= dt * F[k] / scene.getM()[k];
    }
    return true;
""")
assert gravity != start["SimpleGravityForce.cpp"] and euler != start["ExplicitEuler.cpp"]
def own(gravity=gravity, euler=euler):
    return {"SimpleGravityForce.cpp": gravity, "ExplicitEuler.cpp": euler}
def folder(name, files):
    for path, text in files.items():
        full = os.path.join("class", name, path)
        os.makedirs(os.path.dirname(full), exist_ok=True)
        open(full, "w", newline="").write(text)
def zipped(files):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for path, text in files.items():
            archive.writestr(path, text)
    return out.getvalue()
def handed(name, data):
    open(os.path.join("class", name), "wb").write(data)
def below(place, files):
    return {place + path: text for path, text in files.items()}
os.makedirs("class")
whole = {**start, **own()}
folder("right-changed-files", below("FOSSSim/", own()))
folder("right-flat", own())
folder("right-whole", below("t1m1/FOSSSim/", whole))
folder("right-built", {**below("FOSSSim/", whole), "build/FOSSSim/main.o": "x", "build/CMakeCache.txt": "x", ".git/HEAD": "x"})
folder("right-nested", below("hw1/submission/FOSSSim/", own()))
folder("right-windows", {path: text.replace("\n", "\r\n") for path, text in below("FOSSSim/", own()).items()})
folder("right-extra-file", {**below("FOSSSim/", own()), "FOSSSim/Helper.cpp": "int helper() { return 1; }\n", "README.txt": "x"})
handed("right-mac.zip", zipped({**below("t1m1/FOSSSim/", own()), **below("__MACOSX/t1m1/FOSSSim/._", own()), "t1m1/.DS_Store": "x"}))
handed("right-flat.zip", zipped(own()))
handed("right-twice.zip", zipped({"hw1/t1m1.zip": zipped(below("FOSSSim/", own()))}))
folder("right-zip-in-folder", {"note.txt": "x"})
handed("right-zip-in-folder/t1m1.zip", zipped(below("FOSSSim/", own())))
folder("wrong-gravity-sign", below("FOSSSim/", own(gravity=gravity.replace("-=", "+="))))
folder("wrong-without-mass", below("FOSSSim/", own(gravity=gravity.replace("m[k] * ", ""))))
folder("wrong-fixed-falls", below("FOSSSim/", own(euler=euler.replace("if (!scene.isFixed(k / 2)) ", ""))))
folder("unfinished-nothing", below("FOSSSim/", start))
folder("unfinished-gravity", {"FOSSSim/ExplicitEuler.cpp": euler})
folder("broken-syntax", below("FOSSSim/", own(euler=euler.replace("return true;", "return true"))))
folder("broken-name", below("FOSSSim/", own(gravity=gravity.replace("gradE[k]", "gradient[k]"))))
folder("bad-report-only", {"report.pdf": "%PDF"})
folder("bad-binary", {"report.txt": "see fosssim.exe"})
"##;

#[needs("test -x /usr/bin/python3 && g++ --version && ar --version")]
#[test]
fn sampled_class_on_the_starter_code_lands_where_it_should() {
    assert_class(2);
}

#[needs("test -x /usr/bin/python3 && g++ --version && ar --version")]
#[test]
#[ignore = "long: a minute of compiling"]
fn long_class_on_the_starter_code_lands_where_it_should() {
    assert_eq!(assert_class(usize::MAX), 20);
}

/// The course's pack, with starter code of its form whose base library draws, in the format of our skeletons. Grades so many
/// of its hand-ins, and some that are always among them; yields their number.
fn assert_class(count: usize) -> usize {
    let folder = Folder::new();
    let here = folder.path(".");
    let run = grade(&here, &["init", "cpp", "start", "--assignment", "t1m1"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    folder.write(
        "start/FOSSSim/Drawing.cpp",
        "extern \"C\" void draw();\nvoid (*display)() = draw;\n",
    );
    folder.write(
        "draw.c",
        "void glBegin(int); void glVertex2d(double, double); void glEnd(void); void glutSwapBuffers(void);\n\
         void draw(void) { glBegin(1); glVertex2d(0, 0); glEnd(); glutSwapBuffers(); }\n",
    );
    let library = "mkdir -p start/lib start/include && gcc -c draw.c -o draw.o && ar rc start/lib/libbase.a draw.o && \
                   cp -r PACK pack";
    let library = library.replace("PACK", &pack("fosssim-t1m1"));
    assert!(
        Command::new("sh").args(["-c", &library]).current_dir(&here).status().unwrap().success()
    );
    // Most of the time is the compiler's: it optimises nothing here.
    edit(&folder, "-std=c++11", "-std=c++17");
    edit(&folder, "-O1", "-O0");
    edit(
        &folder,
        "\"-s\", \"{scene}\", \"-d\", \"0\", \"-o\", \"{trace}\"",
        "\"{scene}\", \"{trace}\"",
    );
    edit(&folder, "format = \"fosssim\"", "format = \"csv\"");
    // Commands see what those before them wrote.
    edit(
        &folder,
        "commands = [[",
        "commands = [[\"mv\", \"headless.c\", \"gl.c\"], [\"mv\", \"gl.c\", \"gl2.c\"], [",
    );
    edit(&folder, "-x c headless.c", "-x c gl2.c");
    python(&here, CLASS);
    let n_submissions = draw_class(&folder, &["bad-", "broken-syntax", "right-extra-file"], count);

    let run = grade(
        &here,
        &["class", "class", "-o", "out", "--pack", "pack", "--starter", "start", "--no-jacobians"],
    );
    assert_eq!(run.code, 3, "{}{}", run.stdout, run.stderr);
    let rows = rows(&folder);
    assert_eq!(rows.len(), n_submissions, "{rows:?} {}", run.stderr);
    let expected = |name: &str| match name.split('-').next() {
        Some("right") => ("3", "passed"),
        Some("broken") => ("0", "build-failed"),
        Some("bad") => ("0", "bad-hand-in"),
        _ => match name {
            "unfinished-nothing" => ("0", "not-implemented"),
            "wrong-fixed-falls" => ("2", "failed"),
            _ => ("1", "failed"),
        },
    };
    let unexpected = rows
        .iter()
        .filter(|(name, (points, verdict))| (points.as_str(), verdict.as_str()) != expected(name));
    assert_eq!(unexpected.collect::<Vec<_>>(), [], "{}", run.stdout);
    let report = folder.read("out/reports/right-extra-file.txt");
    let report = report.split_whitespace().collect::<Vec<_>>().join(" ");
    let taken = "Taken from the hand-in: FOSSSim/ExplicitEuler.cpp, FOSSSim/Helper.cpp, FOSSSim/SimpleGravityForce.cpp; not \
                 README.txt.";
    assert!(report.contains(taken) && report.contains(", pack "), "{report}");
    let report = folder.read("out/reports/broken-syntax.txt");
    assert!(report.contains("ExplicitEuler.cpp"), "{report}");
    let (_, to_look_at) = run.stdout.split_once("Not graded, for people to look at").unwrap();
    assert_eq!(to_look_at.matches("bad hand in").count(), 2, "{to_look_at}");
    n_submissions
}
