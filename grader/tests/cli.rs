//! The real `grade`, run in temporary folders.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use tempfile::TempDir;

const SPRING: &str = r#"<scene>
  <duration time="0.5"/>
  <integrator type="symplectic-euler" dt="0.05"/>
  <particle m="1.5" px="0" py="0.1" vx="0.2" vy="0" fixed="0"/>
  <particle m="0.5" px="1" py="0.4" vx="0" vy="-0.3" fixed="0"/>
  <edge i="0" j="1"/>
  <springforce edge="0" k="20" l0="0.8" b="0.4"/>
</scene>
"#;

const FALL: &str = r#"<scene>
  <duration time="0.4"/>
  <integrator type="explicit-euler" dt="0.05"/>
  <particle m="2" px="0" py="0" vx="1" vy="0.5" fixed="0"/>
  <simplegravity fx="0.5" fy="-9.81"/>
</scene>
"#;

/// A folder with scenes, oracle traces, and whatever a test adds.
struct Project {
    folder: TempDir,
}

impl Project {
    /// Two required scenes and one for extra credit, with their oracle traces.
    fn new() -> Self {
        let project = Self { folder: tempfile::tempdir().unwrap() };
        project.write("assets/Spring/pair.xml", SPRING);
        project.write("assets/Fall/stone.xml", FALL);
        project.write("extracreditassets/Fall/feather.xml", &FALL.replace("explicit", "implicit"));
        assert_eq!(project.grade(&["oracle", "regenerate"]).code, 0);
        project
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    /// A folder of traces that are the oracle's, but for what `edit` does to the lines of one.
    fn traces(&self, scene: &str, edit: impl Fn(&mut Vec<String>)) {
        for name in ["Spring/pair", "Fall/stone", "Fall/feather"] {
            let text = self.read(&format!("expected/{name}.csv"));
            let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
            if name == scene {
                edit(&mut lines);
            }
            self.write(&format!("traces/{name}.csv"), &(lines.join("\n") + "\n"));
        }
    }

    fn grade(&self, arguments: &[&str]) -> Run {
        run(self.folder.path(), arguments, &[])
    }

    /// Every file below a folder, with its content.
    fn snapshot(&self, folder: &str) -> Vec<(PathBuf, Vec<u8>)> {
        let (mut files, mut pending) = (Vec::new(), vec![self.path(folder)]);
        while let Some(folder) = pending.pop() {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() { pending.push(path) } else { files.push(path) }
            }
        }
        files.sort();
        files.into_iter().map(|path| (path.clone(), fs::read(path).unwrap())).collect()
    }
}

struct Run {
    code: i32,
    stdout: String,
    stderr: String,
}

impl From<Output> for Run {
    fn from(output: Output) -> Self {
        let text = |bytes| String::from_utf8(bytes).unwrap();
        let run = Self {
            code: output.status.code().unwrap(),
            stdout: text(output.stdout),
            stderr: text(output.stderr),
        };
        assert!(!run.stderr.contains("panicked"), "{}", run.stderr);
        run
    }
}

fn run(folder: &Path, arguments: &[&str], environment: &[(&str, &str)]) -> Run {
    let mut command = Command::new(env!("CARGO_BIN_EXE_grade"));
    command.current_dir(folder).args(arguments).env_remove("NO_COLOR").env_remove("CLICOLOR_FORCE");
    command.envs(environment.iter().copied()).output().unwrap().into()
}

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_path_buf()
}

#[test]
fn the_shipped_suite_passes_from_the_root_and_from_below_it() {
    for folder in [workspace(), workspace().join("grader/src")] {
        let run = run(&folder, &["--strict"], &[]);
        assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
        assert!(run.stdout.ends_with("All passed.\n"), "{}", run.stdout);
        assert_eq!(run.stderr, "");
    }
}

#[test]
fn the_shipped_suite_has_the_scenes_it_promises_and_small_traces() {
    let count =
        |folder: &str| simulator::scene::find_scene_files(&workspace().join(folder)).unwrap().len();
    assert!(count("assets") >= 60 && count("extracreditassets") >= 20);
    let mut size = 0;
    let mut pending = vec![workspace().join("expected")];
    while let Some(folder) = pending.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                pending.push(path)
            } else {
                size += fs::metadata(path).unwrap().len()
            }
        }
    }
    assert!(size < 10_000_000, "expected/ has {size} bytes");
}

#[test]
fn the_shipped_traces_match_their_scenes() {
    let run = run(&workspace(), &["oracle", "verify"], &[]);
    assert_eq!(run.code, 0, "{}", run.stdout);
}

#[test]
fn a_wrong_number_is_shown_where_it_first_is() {
    let project = Project::new();
    project.traces("Spring/pair", |lines| {
        for line in &mut lines[5..9] {
            let value: f64 = line.split(',').nth(6).unwrap().parse().unwrap();
            *line = replace_field(line, 6, &(value + 1e-6).to_string());
        }
    });
    let run = project.grade(&["--traces", "traces"]);
    assert_eq!(run.code, 1);
    insta::assert_snapshot!("differs", run.stdout);
}

#[test]
fn every_fault_of_form_has_its_name() {
    type Edit = fn(&mut Vec<String>);
    let edits: [(&str, &str, Edit); 12] = [
        ("too-short", "after 7 of 11 states", |lines| lines.truncate(8)),
        ("too-short", "after 0 of 11 states", |lines| lines.truncate(1)),
        ("too-long", "after its last state, number 11", |lines| {
            let extra = lines[11].replacen("10,", "11,", 1);
            lines.push(extra);
        }),
        ("not-finite", "NaN in the trace: step 2, particle 0, x", |lines| {
            lines[3] = replace_field(&lines[3], 2, "nan");
        }),
        ("not-finite", "inf in the trace: step 0, particle 1, vy", |lines| {
            lines[1] = replace_field(&lines[1], 9, "1e999");
        }),
        ("malformed", ":1: column 3 of the header is \"y0\", not \"x0\"", |lines| {
            lines[0] = lines[0].replace("x0,y0", "y0,x0");
        }),
        ("malformed", ":1: there is no header line", |lines| {
            lines.clear();
            lines.push(String::new());
        }),
        ("malformed", ":1: column 1 of the header is \"0\"", |lines| {
            lines.remove(0);
        }),
        ("malformed", ":4: the number of fields is 9, not 10", |lines| {
            lines[3] = lines[3].rsplit_once(',').unwrap().0.to_owned();
        }),
        ("malformed", ":4: column vx0: \"fast\" is not a number", |lines| {
            lines[3] = replace_field(&lines[3], 4, "fast");
        }),
        ("malformed", ":4: the step is \"7\" where 2 comes next", |lines| {
            lines[3] = replace_field(&lines[3], 0, "7");
        }),
        ("malformed", "state 2 is given the time 0.2, not 0.1", |lines| {
            lines[3] = replace_field(&lines[3], 1, "0.2");
        }),
    ];
    let project = Project::new();
    for (verdict, message, edit) in edits {
        // Judged before tolerance: the initial state is wrong as well.
        project.traces("Spring/pair", |lines| {
            lines[1] = replace_field(&lines[1], 3, "0.3");
            edit(lines);
        });
        let run = project.grade(&["--traces", "traces", "--format", "json"]);
        assert_eq!(run.code, 1, "{message}");
        assert_eq!(scene(&run.stdout, "Spring/pair")["verdict"], verdict, "{message}");
        let told = scene(&run.stdout, "Spring/pair")["message"].to_string().replace('\\', "");
        assert!(told.contains(message), "{told} does not contain {message}");
        assert_eq!(scene(&run.stdout, "Fall/stone")["verdict"], "pass");
    }
}

fn replace_field(line: &str, field: usize, text: &str) -> String {
    let mut fields: Vec<&str> = line.split(',').collect();
    fields[field] = text;
    fields.join(",")
}

/// A scene of a JSON report.
fn scene(report: &str, name: &str) -> serde_json::Value {
    let report: serde_json::Value = serde_json::from_str(report).unwrap();
    let features = report["features"].as_array().unwrap();
    let mut scenes = features.iter().flat_map(|feature| feature["scenes"].as_array().unwrap());
    scenes.find(|scene| scene["name"] == name).unwrap().clone()
}

#[test]
fn a_missing_trace_is_no_output() {
    let project = Project::new();
    project.traces("Spring/pair", |_| ());
    fs::remove_file(project.path("traces/Spring/pair.csv")).unwrap();
    let run = project.grade(&["--traces", "traces", "--format", "json"]);
    assert_eq!((run.code, &scene(&run.stdout, "Spring/pair")["verdict"]), (1, &"no-output".into()));
}

#[test]
fn binary_traces_are_graded_and_a_partial_record_is_malformed() {
    let project = Project::new();
    project.traces("Spring/pair", |_| ());
    fs::remove_file(project.path("traces/Spring/pair.csv")).unwrap();
    let bytes: Vec<u8> = {
        let text = project.read("expected/Spring/pair.csv");
        let record = |line: &str| -> Vec<u8> {
            let numbers: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
            // step, time, x0, y0, vx0, vy0, x1, …: positions first in the binary.
            [2, 3, 6, 7, 4, 5, 8, 9].iter().flat_map(|i| numbers[*i].to_le_bytes()).collect()
        };
        text.lines().skip(1).flat_map(record).collect()
    };
    let path = project.path("traces/Spring/pair.bin");
    fs::write(&path, &bytes).unwrap();
    let run = project.grade(&["--traces", "traces"]);
    assert_eq!(run.code, 0, "{}", run.stdout);

    fs::write(&path, &bytes[..bytes.len() - 3]).unwrap();
    let run = project.grade(&["--traces", "traces", "--format", "json"]);
    assert_eq!(scene(&run.stdout, "Spring/pair")["verdict"], "malformed");
    assert!(run.stdout.contains("record 10: the file ends after 61 of the record's 64 bytes"));
}

#[test]
fn a_line_without_end_is_refused_before_it_fills_the_memory() {
    let project = Project::new();
    project.traces("Spring/pair", |lines| lines[4] = "7".repeat(10_000_000));
    let run = project.grade(&["--traces", "traces", "--format", "json"]);
    assert_eq!(scene(&run.stdout, "Spring/pair")["verdict"], "malformed");
    assert!(run.stdout.contains("pair.csv:5: the line is longer than 640 bytes"), "{}", run.stdout);
}

#[test]
fn an_edited_scene_is_told_as_such_and_costs_nothing() {
    let project = Project::new();
    project.write("assets/Spring/pair.xml", &SPRING.replace("k=\"20\"", "k=\"21\""));
    let run = project.grade(&["--format", "json"]);
    assert_eq!(run.code, 3);
    let told = scene(&run.stdout, "Spring/pair");
    assert_eq!(told["verdict"], "grader-fault");
    assert!(told["message"].as_str().unwrap().starts_with("the scene was edited after"));
    let report: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!(report["required"]["points_earned"], report["required"]["points"]);
    assert_eq!(project.grade(&["oracle", "verify"]).code, 1);
}

#[test]
fn an_altered_or_missing_oracle_trace_is_a_fault_of_the_grader() {
    let project = Project::new();
    let text = project.read("expected/Spring/pair.csv");
    project.write("expected/Spring/pair.csv", &text.replacen("0.2", "0.3", 1));
    fs::remove_file(project.path("expected/Fall/stone.csv")).unwrap();
    let run = project.grade(&["--format", "json"]);
    assert_eq!(run.code, 3);
    for (name, message) in
        [("Spring/pair", "is not the one its manifest"), ("Fall/stone", "no oracle trace")]
    {
        let told = scene(&run.stdout, name);
        assert_eq!(told["verdict"], "grader-fault");
        assert!(told["message"].as_str().unwrap().contains(message), "{told}");
    }
    let verify = project.grade(&["oracle", "verify"]);
    assert_eq!(verify.code, 1);
    assert!(verify.stdout.contains("2 things do not match"), "{}", verify.stdout);
}

#[test]
fn regenerating_replaces_everything_or_nothing() {
    let project = Project::new();
    let before = project.snapshot("expected");

    let run = project.grade(&["oracle", "regenerate"]);
    assert_eq!((run.code, project.snapshot("expected")), (0, before.clone()));
    assert!(run.stdout.contains("is as it was"), "{}", run.stdout);

    // One scene changes beyond tolerance, one is new: without consent, neither trace is written.
    project.write("assets/Spring/pair.xml", &SPRING.replace("k=\"20\"", "k=\"21\""));
    project.write("assets/Spring/other.xml", SPRING);
    let run = project.grade(&["oracle", "regenerate"]);
    assert_eq!((run.code, project.snapshot("expected")), (1, before.clone()));
    insta::assert_snapshot!("regenerate_refused", run.stdout);

    let run = project.grade(&["oracle", "regenerate", "--accept"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert_eq!(project.snapshot("expected").len(), before.len() + 1);
    assert_eq!(project.grade(&[]).code, 0);

    // A scene that cannot be simulated leaves everything as it is.
    let before = project.snapshot("expected");
    project.write(
        "assets/Spring/other.xml",
        &SPRING.replace("px=\"1\" py=\"0.4\"", "px=\"0\" py=\"0.1\""),
    );
    let run = project.grade(&["oracle", "regenerate", "--accept"]);
    assert_eq!((run.code, project.snapshot("expected")), (2, before));
    assert!(run.stderr.contains("particles 0 and 1 are at the same place"), "{}", run.stderr);
    let names = fs::read_dir(project.folder.path()).unwrap();
    let strays = names
        .filter(|entry| entry.as_ref().unwrap().file_name().to_string_lossy().starts_with('.'));
    assert_eq!(strays.count(), 0);
}

#[test]
fn a_change_within_tolerance_needs_no_consent() {
    let project = Project::new();
    // The old trace differs in its last digit, as one made on another machine may.
    let text = project.read("expected/Fall/stone.csv");
    let position = text.find("0.05,").unwrap() + 5;
    let edited = format!("{}0.05000000000000001{}", &text[..position], &text[position + 4..]);
    project.write("expected/Fall/stone.csv", &edited);
    let run = project.grade(&["oracle", "regenerate"]);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    assert!(
        run.stdout.contains("Fall/stone: changed within tolerance, position by 6.9e-18"),
        "{}",
        run.stdout
    );
    assert_eq!(project.read("expected/Fall/stone.csv"), text);
}

#[test]
fn a_trace_without_a_scene_is_removed_only_with_consent_and_other_files_stay() {
    let project = Project::new();
    project.write("expected/README.md", "Ours.\n");
    fs::remove_file(project.path("assets/Fall/stone.xml")).unwrap();
    let run = project.grade(&["oracle", "regenerate"]);
    assert_eq!(run.code, 1);
    assert!(run.stdout.contains("! Fall/stone: removed: its scene is gone"), "{}", run.stdout);
    assert!(project.path("expected/Fall/stone.csv").exists());
    assert_eq!(project.grade(&["oracle", "regenerate", "--accept"]).code, 0);
    assert!(!project.path("expected/Fall/stone.csv").exists());
    assert_eq!(project.read("expected/README.md"), "Ours.\n");
    assert_eq!(project.grade(&["oracle", "verify"]).code, 0);
}

#[test]
fn the_rubric_sets_tolerances_and_points() {
    let project = Project::new();
    project.traces("Spring/pair", |lines| {
        let value: f64 = lines[4].split(',').nth(2).unwrap().parse().unwrap();
        lines[4] = replace_field(&lines[4], 2, &(value + 1e-8).to_string());
    });
    assert_eq!(project.grade(&["--traces", "traces"]).code, 1);
    for rubric in [
        "[default]\nlargest = 1e-7",
        "[[feature]]\ngroup = \"Spring\"\nlargest = 1e-7",
        "[[feature]]\nlargest = 1e-9\n[[scene]]\nname = \"Spring/pair\"\nlargest = 1e-7",
    ] {
        project.write("assets/rubric.toml", rubric);
        let run = project.grade(&["--traces", "traces"]);
        assert_eq!(run.code, 0, "{rubric}: {}{}", run.stdout, run.stderr);
    }
    project.write("assets/rubric.toml", "[[feature]]\nsection = \"extra-credit\"\npoints = 2.5\n");
    let run = project.grade(&["--traces", "traces", "--format", "json"]);
    let report: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    assert_eq!(report["extra_credit"]["points"], 2.5);
    assert_eq!(
        (&report["required"]["points"], &report["required"]["points_earned"]),
        (&2.0.into(), &1.0.into())
    );
}

#[test]
fn a_wrong_rubric_is_refused_with_its_line() {
    let project = Project::new();
    for (rubric, message) in [
        ("[default]\nlargest = -1\n", "rubric.toml:2:11: a tolerance is above 0, not -1"),
        ("[default]\n\nlarge = 1e-9\n", "rubric.toml:3:1: unknown field `large`"),
        ("[[feature]]\ngroup = \"Sprong\"\n", "[[feature]] group \"Sprong\" fits no scene"),
        ("[[scene]]\nname = \"Spring/pear\"\n", "[[scene]] \"Spring/pear\" fits no scene"),
        ("points = \n", "rubric.toml:1:"),
    ] {
        project.write("assets/rubric.toml", rubric);
        let run = project.grade(&[]);
        assert_eq!((run.code, run.stdout.as_str()), (2, ""));
        assert!(run.stderr.contains(message), "{message}: {}", run.stderr);
    }
}

#[test]
fn wrong_usage_and_input_are_told_apart_from_failures() {
    let project = Project::new();
    let empty = tempfile::tempdir().unwrap();
    for (folder, arguments, message) in [
        (project.folder.path(), vec!["--traces", "nowhere"], "nowhere: there is no such folder"),
        (project.folder.path(), vec!["--only", "nothing"], "contains \"nothing\""),
        (project.folder.path(), vec!["--frobnicate"], "--frobnicate"),
        (project.folder.path(), vec!["--assets", "nowhere"], "nowhere: there is no such folder"),
        (project.folder.path(), vec!["--rubric", "none.toml"], "none.toml: cannot be read"),
        (project.folder.path(), vec!["-o", "no/report.txt"], "no/report.txt: "),
        (project.folder.path(), vec!["--threads", "0"], "0 is not in 1.."),
        (project.folder.path(), vec!["jacobians", "--force", "magic"], "springforce"),
        (empty.path(), vec![], "there is no assets/ folder here or above"),
    ] {
        let run = run(folder, &arguments, &[]);
        assert_eq!((run.code, run.stdout.as_str()), (2, ""), "{arguments:?}");
        assert!(run.stderr.contains(message), "{message}: {}", run.stderr);
    }
    project.write("assets/Fall/stone.xml", "<scene>");
    let run = project.grade(&[]);
    assert_eq!(run.code, 2);
    assert!(run.stderr.contains("stone.xml:1:1: the file ends inside <scene>"), "{}", run.stderr);
}

#[test]
fn two_scenes_of_one_name_are_refused() {
    let project = Project::new();
    project.write("extracreditassets/Spring/pair.xml", SPRING);
    let run = project.grade(&[]);
    assert_eq!(run.code, 2);
    assert!(run.stderr.contains("two scenes are called Spring/pair"), "{}", run.stderr);
}

#[test]
fn the_simulator_giving_up_is_a_crash_of_that_scene_only() {
    let project = Project::new();
    let collapsing = SPRING.replace("px=\"1\" py=\"0.4\"", "px=\"0\" py=\"0.1\"");
    project.write("assets/Spring/pair.xml", &collapsing);
    // Without a manifest, nothing is known of the scene the old trace was made from.
    fs::remove_file(project.path("expected/manifest.toml")).unwrap();
    let run = project.grade(&["--format", "json"]);
    assert_eq!(run.code, 1);
    let told = scene(&run.stdout, "Spring/pair");
    assert_eq!(told["verdict"], "crashed");
    assert!(told["message"].as_str().unwrap().contains("step 1"), "{told}");
    assert_eq!(scene(&run.stdout, "Fall/stone")["verdict"], "pass");
}

#[test]
fn reports_are_the_same_bytes_for_one_and_two_threads() {
    let folder = workspace();
    let outputs = ["1", "2"].map(|threads| {
        let target = tempfile::tempdir().unwrap();
        let expected = target.path().join("expected");
        let arguments = ["oracle", "regenerate", "--threads", threads, "--root", ".", "--expected"];
        let arguments = [&arguments[..], &[expected.to_str().unwrap()]].concat();
        assert_eq!(run(&folder, &arguments, &[]).code, 0);
        let manifest = fs::read(expected.join("manifest.toml")).unwrap();
        let report = run(&folder, &["--threads", threads, "--format", "json"], &[]).stdout;
        (manifest, report)
    });
    // The manifest holds the hash of every trace.
    assert!(outputs[0] == outputs[1]);
}

#[test]
fn colours_are_for_terminals_and_those_who_force_them() {
    let project = Project::new();
    let coloured = |environment: &[(&str, &str)]| {
        run(project.folder.path(), &[], environment).stdout.contains('\u{1b}')
    };
    assert!(!coloured(&[]));
    assert!(coloured(&[("CLICOLOR_FORCE", "1")]));
    assert!(!coloured(&[("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")]));
}

#[test]
fn a_report_goes_to_a_file_without_colours() {
    let project = Project::new();
    let run = run(project.folder.path(), &["-o", "report.txt"], &[("CLICOLOR_FORCE", "1")]);
    assert_eq!((run.code, run.stdout.as_str()), (0, ""));
    insta::assert_snapshot!("passed", project.read("report.txt"));
}

#[test]
fn the_json_report_fits_its_documented_schema() {
    let project = Project::new();
    project.traces("Spring/pair", |lines| lines[4] = replace_field(&lines[4], 2, "0.5"));
    let documented = fs::read_to_string(workspace().join("docs/report.schema.json")).unwrap();
    let schema = serde_json::from_str(&documented).unwrap();
    for arguments in [&["--format", "json"][..], &["--format", "json", "--traces", "traces"]] {
        let report = serde_json::from_str(&project.grade(arguments).stdout).unwrap();
        if let Err(error) = jsonschema::validate(&schema, &report) {
            panic!("{error} at {}", error.instance_path());
        }
    }
}

#[test]
fn the_documented_schema_is_the_one_in_force() {
    let path = workspace().join("docs/report.schema.json");
    let schema = grader::report::json::schema().unwrap();
    if std::env::var_os("UPDATE_DOCS").is_some() {
        fs::write(&path, &schema).unwrap();
    }
    let documented = fs::read_to_string(path).unwrap_or_default();
    assert!(documented == schema, "docs/report.schema.json is out of date; run with UPDATE_DOCS=1");
}

#[test]
fn the_junit_report_tells_failures_from_faults() {
    let project = Project::new();
    project.traces("Spring/pair", |lines| lines[4] = replace_field(&lines[4], 2, "0.5"));
    project.write("assets/Fall/stone.xml", &FALL.replace("m=\"2\"", "m=\"3\""));
    let run = project.grade(&["--traces", "traces", "--format", "junit"]);
    assert_eq!(run.code, 3);
    insta::assert_snapshot!("junit", run.stdout);
}

#[test]
fn jacobians_can_be_checked_by_themselves() {
    let run = run(&workspace(), &["jacobians", "--force", "springforce", "--states", "50"], &[]);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    assert_eq!(run.stdout.matches("springforce").count(), 2);
    assert!(!run.stdout.contains("zero"));
}
