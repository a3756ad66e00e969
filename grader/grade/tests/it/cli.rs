//! Command line of the `grade` binary, run in temporary folders.

use needs::needs;
use std::fs;
use std::io::Write;
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::process::Command;
use test_support::{assert_fits, root, without_provenance, without_times};

use crate::folder::{self, Folder, Run, command, files_below};

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

/// A folder with scenes, oracle traces, and files that tests add.
struct Project(Folder);

impl Deref for Project {
    type Target = Folder;

    fn deref(&self) -> &Folder {
        &self.0
    }
}

impl Project {
    /// Two required scenes and one extra-credit scene, with their oracle traces.
    fn new() -> Self {
        let project = Self(Folder::new());
        project.write("assets/Spring/pair.xml", SPRING);
        project.write("assets/Fall/stone.xml", FALL);
        project.write("extracreditassets/Fall/feather.xml", &FALL.replace("explicit", "implicit"));
        assert_eq!(project.grade(&["oracle", "regenerate"]).code, 0);
        project
    }

    /// Runs `grade` in this folder; what grades the built-in simulator does not check its Jacobians, which takes most of
    /// the time.
    fn grade(&self, arguments: &[&str]) -> Run {
        let names_command = arguments.first().is_some_and(|first| !first.starts_with('-'));
        if names_command || arguments.contains(&"--traces") {
            return self.0.grade(arguments);
        }
        self.0.grade(&[&["--no-jacobians"], arguments].concat())
    }

    /// A folder with the oracle's traces, one of them changed by `edit`.
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

    fn snapshot(&self, folder: &str) -> Vec<(PathBuf, Vec<u8>)> {
        contents(&self.path(folder))
    }
}

/// Every file below a folder, by relative path, with its content.
fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let content = |path: PathBuf| {
        (path.strip_prefix(folder).unwrap().to_path_buf(), fs::read(&path).unwrap())
    };
    files_below(folder).into_iter().map(content).collect()
}

fn run(folder: &Path, arguments: &[&str], environment: &[(&str, &str)]) -> Run {
    folder::run(command(folder, arguments).envs(environment.iter().copied()))
}

#[test]
fn the_shipped_suite_passes_from_the_root_and_from_below_it() {
    for (folder, jacobians) in
        [(root(), &[][..]), (&root().join("grader/src"), &["--no-jacobians"])]
    {
        let run = run(folder, &[&["--strict"], jacobians].concat(), &[]);
        assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
        assert!(run.stdout.ends_with("All passed.\n"), "{}", run.stdout);
        assert_eq!(run.stderr, "");
    }
}

#[test]
fn the_shipped_suite_has_the_scenes_it_promises_and_small_traces() {
    let count = |folder: &str| scene::find_scene_files(&root().join(folder)).unwrap().len();
    assert!(count("assets") >= 60 && count("extracreditassets") >= 20);
    let size: usize = contents(&root().join("expected")).iter().map(|(_, bytes)| bytes.len()).sum();
    assert!(size < 10_000_000, "expected/ has {size} bytes");
}

#[test]
fn the_shipped_traces_match_their_scenes() {
    let run = run(root(), &["oracle", "verify"], &[]);
    assert_eq!(run.code, 0, "{}", run.stdout);
}

/// Identical to the bit, except for the one scene whose sparse solver uses the machine's vector instructions.
#[test]
fn this_build_makes_the_stored_traces_by_one_thread_and_two() {
    let (group, sparse) = ("FixedParticles", "net-five-by-five-linearized");
    let regenerated = |threads: &str| {
        let project = Project(Folder::new());
        for (path, bytes) in contents(&root().join("assets").join(group)) {
            let path = format!("assets/{group}/{}", path.display());
            project.write(&path, std::str::from_utf8(&bytes).unwrap());
        }
        let run = project.grade(&["oracle", "regenerate", "--threads", threads]);
        assert_eq!(run.code, 0, "{}", run.stdout);
        project.snapshot(&format!("expected/{group}"))
    };
    let made = regenerated("1");
    assert!(made == regenerated("2"));
    for (path, bytes) in made {
        let stored = fs::read(root().join("expected").join(group).join(&path)).unwrap();
        assert!(bytes == stored || path.file_stem().unwrap() == sparse, "{}", path.display());
    }
    let report = |threads| {
        run(root(), &["--threads", threads, "--format", "json", "--no-jacobians"], &[]).stdout
    };
    let all = report("1");
    assert!(all == report("2"));
    for scene in scenes(&all) {
        let is_same = ["position", "velocity"].iter().all(|of| scene[of]["largest"] == 0.0);
        assert!(is_same || scene["name"].as_str().unwrap().ends_with(sparse), "{scene}");
    }
}

#[test]
fn first_wrong_number_is_shown() {
    let project = Project::new();
    project.traces("Spring/pair", |lines| {
        for line in &mut lines[5..9] {
            let value: f64 = line.split(',').nth(6).unwrap().parse().unwrap();
            *line = replace_field(line, 6, &(value + 1e-6).to_string());
        }
    });
    let run = project.grade(&["--traces", "traces"]);
    assert_eq!(run.code, 1);
    insta::assert_snapshot!("differs", without_provenance(&run.stdout));
}

#[test]
fn each_malformed_trace_has_a_named_fault() {
    type Edit = fn(&mut Vec<String>);
    let edits: [(&str, &str, Edit); 13] = [
        ("too-short", "after 7 of 11 states", |lines| lines.truncate(8)),
        ("too-short", "after 0 of 11 states", |lines| lines.truncate(1)),
        ("too-long", "the trace has more than 11 states", |lines| {
            let extra = lines[11].replacen("10,", "11,", 1);
            lines.push(extra);
        }),
        ("not-finite", "pair.csv:4: NaN in the trace: step 2, particle 0, x", |lines| {
            lines[3] = replace_field(&lines[3], 2, "nan");
        }),
        ("not-finite", "pair.csv:2: inf in the trace: step 0, particle 1, vy", |lines| {
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
        ("malformed", "pair.csv:4: state 2 has the time 0.2 instead of 0.1", |lines| {
            lines[3] = replace_field(&lines[3], 1, "0.2");
        }),
        ("malformed", "pair.csv:4: state 2 has the time 1e308 instead of 0.1", |lines| {
            lines[3] = replace_field(&lines[3], 1, "1e308");
        }),
    ];
    let project = Project::new();
    for (verdict, message, edit) in edits {
        // Judged before tolerances: the initial state is wrong too.
        project.traces("Spring/pair", |lines| {
            lines[1] = replace_field(&lines[1], 3, "0.3");
            edit(lines);
        });
        let run = project.grade(&["--traces", "traces", "--format", "json"]);
        assert_eq!(run.code, 1, "{message}");
        assert_eq!(scene(&run.stdout, "Spring/pair")["verdict"], verdict, "{message}");
        let shown = scene(&run.stdout, "Spring/pair")["message"].to_string().replace('\\', "");
        assert!(shown.contains(message), "{shown} does not contain {message}");
        assert_eq!(scene(&run.stdout, "Fall/stone")["verdict"], "pass");
    }
}

fn replace_field(line: &str, field: usize, text: &str) -> String {
    let mut fields: Vec<&str> = line.split(',').collect();
    fields[field] = text;
    fields.join(",")
}

/// The scenes of a JSON report.
fn scenes(report: &str) -> Vec<serde_json::Value> {
    let report: serde_json::Value = serde_json::from_str(report).unwrap();
    let features = report["features"].as_array().unwrap().iter();
    features.flat_map(|feature| feature["scenes"].as_array().unwrap().clone()).collect()
}

/// A scene of a JSON report.
fn scene(report: &str, name: &str) -> serde_json::Value {
    scenes(report).into_iter().find(|scene| scene["name"] == name).unwrap()
}

#[test]
fn a_missing_trace_is_missing() {
    let project = Project::new();
    project.traces("Spring/pair", |_| ());
    fs::remove_file(project.path("traces/Spring/pair.csv")).unwrap();
    let run = project.grade(&["--traces", "traces", "--format", "json"]);
    assert_eq!((run.code, &scene(&run.stdout, "Spring/pair")["verdict"]), (1, &"missing".into()));
}

#[cfg(unix)]
#[test]
fn pipe_as_trace_is_refused_without_blocking() {
    let project = Project::new();
    project.traces("", |_| {});
    fs::remove_file(project.path("traces/Spring/pair.csv")).unwrap();
    let made = Command::new("mkfifo").arg(project.path("traces/Spring/pair.csv")).status().unwrap();
    assert!(made.success());
    let run = project.grade(&["--traces", "traces"]);
    assert_eq!(run.code, 1, "{}", run.stderr);
    let message = "pair.csv: cannot be read: it is a pipe, a socket or a device";
    let text = folder::words(&run.stdout);
    assert!(text.contains(message), "{text}");
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
fn endless_line_is_refused_early() {
    let project = Project::new();
    project.traces("Spring/pair", |lines| lines[4] = "7".repeat(10_000_000));
    let run = project.grade(&["--traces", "traces", "--format", "json"]);
    assert_eq!(scene(&run.stdout, "Spring/pair")["verdict"], "malformed");
    assert!(
        run.stdout.contains("pair.csv:5: the line is longer than 3290 bytes"),
        "{}",
        run.stdout
    );
}

#[test]
fn edited_scene_is_reported_and_costs_no_points() {
    let project = Project::new();
    project.write("assets/Spring/pair.xml", &SPRING.replace("k=\"20\"", "k=\"21\""));
    let run = project.grade(&["--format", "json"]);
    assert_eq!(run.code, 3);
    let shown = scene(&run.stdout, "Spring/pair");
    assert_eq!(shown["verdict"], "grader-fault");
    assert!(shown["message"].as_str().unwrap().starts_with("the scene was edited after"));
    let report: serde_json::Value = serde_json::from_str(&run.stdout).unwrap();
    let required = &report["required"];
    assert_eq!((&required["points_earned"], &required["points"]), (&1.0.into(), &2.0.into()));
    assert_eq!(required["points_not_judged"], 1.0);
    assert!(project.grade(&[]).stdout.contains("Score 1 of 2 points, 1 not judged, and"));
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
        [("Spring/pair", "does not match its manifest"), ("Fall/stone", "no oracle trace")]
    {
        let shown = scene(&run.stdout, name);
        assert_eq!(shown["verdict"], "grader-fault");
        assert!(shown["message"].as_str().unwrap().contains(message), "{shown}");
    }
    let verify = project.grade(&["oracle", "verify"]);
    assert_eq!(verify.code, 1);
    assert!(verify.stdout.contains("2 mismatches"), "{}", verify.stdout);
}

#[test]
fn regeneration_is_atomic() {
    let project = Project::new();
    let before = project.snapshot("expected");

    let run = project.grade(&["oracle", "regenerate"]);
    assert_eq!((run.code, project.snapshot("expected")), (0, before.clone()));
    assert!(run.stdout.contains("is unchanged"), "{}", run.stdout);

    // One scene changes beyond tolerance, one is new: without --accept, neither trace is written.
    project.write("assets/Spring/pair.xml", &SPRING.replace("k=\"20\"", "k=\"21\""));
    project.write("assets/Spring/other.xml", SPRING);
    let run = project.grade(&["oracle", "regenerate"]);
    assert_eq!((run.code, project.snapshot("expected")), (1, before.clone()));
    insta::assert_snapshot!("regenerate_refused", run.stdout);

    let run = project.grade(&["oracle", "regenerate", "--accept"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert_eq!(project.snapshot("expected").len(), before.len() + 1);
    assert_eq!(project.grade(&[]).code, 0);

    // A scene that cannot be simulated leaves everything unchanged.
    let before = project.snapshot("expected");
    project.write(
        "assets/Spring/other.xml",
        &SPRING.replace("px=\"1\" py=\"0.4\"", "px=\"0\" py=\"0.1\""),
    );
    let run = project.grade(&["oracle", "regenerate", "--accept"]);
    assert_eq!((run.code, project.snapshot("expected")), (2, before));
    assert!(run.stderr.contains("particles 0 and 1 are at the same place"), "{}", run.stderr);
    let names = fs::read_dir(project.path("")).unwrap();
    let strays = names
        .filter(|entry| entry.as_ref().unwrap().file_name().to_string_lossy().starts_with('.'));
    assert_eq!(strays.count(), 0);
}

#[test]
fn changes_within_tolerance_need_no_review() {
    let project = Project::new();
    // The old trace differs in its last digit, as a trace from another machine may.
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
fn changes_are_accepted_by_name() {
    let project = Project::new();
    project.write("assets/Spring/pair.xml", &SPRING.replace("k=\"20\"", "k=\"21\""));
    fs::remove_file(project.path("assets/Fall/stone.xml")).unwrap();
    let run = project.grade(&["oracle", "review"]);
    assert!(run.code == 2 && run.stderr.contains("--accept SCENE"), "{}", run.stderr);

    let run = project.grade(&["oracle", "regenerate", "--accept", "Fall/stnoe"]);
    assert!(run.code == 2 && run.stderr.contains("did you mean"), "{}", run.stderr);
    let run = project.grade(&["oracle", "regenerate", "--accept", "Spring/pair"]);
    assert_eq!(run.code, 1, "{}", run.stderr);
    let end = "old traces stay where changes marked ! were not accepted: 1\n";
    assert!(run.stdout.ends_with(end), "{}", run.stdout);
    assert!(project.path("expected/Fall/stone.csv").exists());
    assert_eq!(project.grade(&[]).code, 0);
}

/// `script` of util-linux makes the terminal.
#[needs("script --version | grep util-linux")]
#[test]
fn changes_are_reviewed_on_a_terminal() {
    let project = Project::new();
    fs::remove_file(project.path("assets/Fall/stone.xml")).unwrap();
    let grade = format!("{} oracle review", env!("CARGO_BIN_EXE_grade"));
    let script = Command::new("script")
        .current_dir(project.path(""))
        .args(["--quiet", "--return", "--command", &grade, "/dev/null"])
        .stdin(std::process::Stdio::piped())
        .stdout(std::process::Stdio::piped())
        .spawn();
    let mut script = script.unwrap();
    script.stdin.take().unwrap().write_all(b"a\nw\n").unwrap();
    let output = script.wait_with_output().unwrap();
    let shown = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{shown}");
    assert!(shown.contains("1 of 1  Fall/stone"), "{shown}");
    assert!(!project.path("expected/Fall/stone.csv").exists());
    assert!(!project.path(".expected.review.json").exists());
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
fn criteria_are_chosen_on_the_command_line_and_the_report_says_which() {
    let project = Project::new();
    project.traces("Spring/pair", |lines| {
        let value: f64 = lines[4].split(',').nth(2).unwrap().parse().unwrap();
        lines[4] = replace_field(&lines[4], 2, &(value + 1e-12).to_string());
    });
    let run = |criteria: &[&str]| {
        let mut arguments = vec!["--traces", "traces", "--format", "json"];
        arguments.extend(criteria);
        let run = project.grade(&arguments);
        (run.code, scene(&run.stdout, "Spring/pair"))
    };
    let (code, calibrated) = run(&[]);
    assert_eq!((code, &calibrated["criteria"]), (1, &"calibrated".into()));
    assert_eq!(calibrated["tolerances"], serde_json::Value::Null);
    let bound = &calibrated["calibration"]["position"];
    let [envelope, tolerance] = ["envelope", "tolerance"].map(|name| bound[name].as_f64().unwrap());
    assert!(0.0 < envelope && envelope < 1e-14 && tolerance >= 10.0 * envelope, "{bound}");
    assert!(calibrated["calibration"]["used"].as_f64().unwrap() > 1.0);
    // One state was altered: the step into it and the step out of it are wrong.
    assert_eq!(calibrated["diagnosis"]["ranges"], serde_json::json!([[3, 4]]));

    let (code, course) = run(&["--criteria", "course"]);
    assert_eq!((code, &course["criteria"]), (0, &"fixed".into()));
    assert_eq!(course["tolerances"]["largest"], 1e-10);
    assert_eq!(course["calibration"], serde_json::Value::Null);
    // The command line overrides the rubric.
    project.write("assets/rubric.toml", "[default]\ncriteria = \"course\"\n");
    assert_eq!(run(&[]).0, 0);
    assert_eq!(run(&["--criteria", "calibrated"]).0, 1);
    // Traces without an envelope are judged by the course's criteria.
    fs::remove_file(project.path("assets/rubric.toml")).unwrap();
    fs::remove_file(project.path("expected/manifest.toml")).unwrap();
    assert_eq!(run(&[]).1["criteria"], "fixed");
    let text = project.grade(&["--traces", "traces", "--verbose"]).stdout;
    let text = folder::words(&text);
    assert!(text.contains("Judged by the course's criteria: each residual below 1e-10"), "{text}");
}

#[test]
fn unrecorded_envelopes_give_no_verdict() {
    let project = Project::new();
    let text = project.read("expected/envelopes.toml");
    project
        .write("expected/envelopes.toml", &text.replacen("position = [", "position = [9e9, ", 1));
    let run = project.grade(&["--only", "pair", "--format", "json"]);
    assert_eq!(run.code, 3, "{}", run.stdout);
    assert!(run.stdout.contains("envelopes.toml does not match the manifest"));
    let verify = project.grade(&["oracle", "verify"]);
    assert!(verify.stdout.contains("1 mismatch"), "{}", verify.stdout);
    // Regenerating fixes this, and needs no --accept.
    assert_eq!(project.grade(&["oracle", "regenerate"]).code, 0);
    assert_eq!(project.read("expected/envelopes.toml"), text);
    assert_eq!(project.grade(&[]).code, 0);
}

#[test]
fn a_manifest_of_an_earlier_format_says_what_to_do() {
    let project = Project::new();
    project.edit_manifest("format = 2", "format = 1");
    let run = project.grade(&[]);
    assert_eq!(run.code, 2);
    assert!(run.stderr.contains("its format is 1, that of an earlier version"), "{}", run.stderr);
    assert!(run.stderr.contains("grade oracle regenerate --accept"), "{}", run.stderr);
    assert_eq!(project.grade(&["oracle", "regenerate", "--accept"]).code, 0);
    assert_eq!(project.grade(&[]).code, 0);
}

#[test]
fn a_wrong_rubric_is_refused_with_its_line() {
    let project = Project::new();
    for (rubric, message) in [
        ("[default]\nlargest = -1\n", "rubric.toml:2:11: a tolerance is above 0, not -1"),
        ("[default]\n\nlarge = 1e-9\n", "rubric.toml:3:1: unknown field `large`"),
        (
            "[[feature]]\ngroup = \"Sprong\"\npoints = 2\n",
            "[[feature]] group \"Sprong\" matches no scene",
        ),
        (
            "[[scene]]\nname = \"Spring/pear\"\nlargest = 1\n",
            "[[scene]] \"Spring/pear\" matches no scene",
        ),
        ("points = \n", "rubric.toml:1:"),
        (
            "[default]\n[[feature]]\ngroup = \"Spring\"\n",
            "rubric.toml:2:1: [[feature]] group \"Spring\" sets nothing",
        ),
        ("[[scene]]\nname = \"Spring/pair\"\n", "rubric.toml:1:1: [[scene]] \"Spring/pair\" sets"),
    ] {
        project.write("assets/rubric.toml", rubric);
        let run = project.grade(&[]);
        assert_eq!((run.code, run.stdout.as_str()), (2, ""));
        assert!(run.stderr.contains(message), "{message}: {}", run.stderr);
    }
}

#[test]
fn usage_and_input_errors_have_their_own_exit_code() {
    let project = Project::new();
    for (arguments, message) in [
        (&["--traces", "nowhere"][..], "nowhere: folder not found"),
        (&["--only", "nothing"][..], "nothing matches \"nothing\""),
        (&["--frobnicate"][..], "--frobnicate"),
        (&["--assets", "nowhere"][..], "nowhere: folder not found"),
        (&["--rubric", "none.toml"][..], "none.toml: cannot be read"),
        (&["-o", "no/report.txt"][..], "no/report.txt: "),
        (&["--threads", "0"][..], "0 is not in 1.."),
        (&["jacobians", "--states", "1000001"][..], "1000001 is not in 1.."),
        (&["--expected", "typo"][..], "typo: folder not found; create"),
        (&["oracle", "verify", "--expected", "typo"][..], "typo: folder not found"),
        (&["oracle", "regenerate", "--expected", "/"][..], "without a name"),
        (&["jacobians", "--force", "magic"][..], "springforce"),
    ] {
        let run = project.grade(arguments);
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
    assert!(run.stderr.contains("two scenes have the same name Spring/pair"), "{}", run.stderr);
}

#[test]
fn simulator_failure_crashes_only_its_scene() {
    let project = Project::new();
    let collapsing = SPRING.replace("px=\"1\" py=\"0.4\"", "px=\"0\" py=\"0.1\"");
    project.write("assets/Spring/pair.xml", &collapsing);
    // Without a manifest, the scene of the old trace is unknown.
    fs::remove_file(project.path("expected/manifest.toml")).unwrap();
    let run = project.grade(&["--format", "json"]);
    assert_eq!(run.code, 1);
    let shown = scene(&run.stdout, "Spring/pair");
    assert_eq!(shown["verdict"], "crashed");
    assert!(shown["message"].as_str().unwrap().contains("step 1"), "{shown}");
    assert_eq!(scene(&run.stdout, "Fall/stone")["verdict"], "pass");
}

#[test]
fn colours_appear_on_terminals_or_when_forced() {
    let project = Project::new();
    let coloured = |environment: &[(&str, &str)]| {
        run(&project.path(""), &["--no-jacobians"], environment).stdout.contains('\u{1b}')
    };
    assert!(!coloured(&[]));
    assert!(coloured(&[("CLICOLOR_FORCE", "1")]));
    assert!(!coloured(&[("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")]));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_standard_output_is_an_error_and_a_closed_one_is_not() {
    let project = Project::new();
    let run = |arguments: &[&str], stdout: std::process::Stdio| -> Run {
        folder::run(command(&project.path(""), arguments).stdout(stdout))
    };
    for arguments in [
        &["--no-jacobians", "--format", "json"][..],
        &["--no-jacobians"],
        &["accuracy", "--list"],
        &["oracle", "verify"],
        &["init", "python", "new"],
        &["needs"],
    ] {
        let full = fs::File::options().write(true).open("/dev/full").unwrap();
        let Run { code, stderr, .. } = run(arguments, full.into());
        assert_eq!(code, 3, "{arguments:?}: {stderr}");
        assert!(stderr.contains("standard output: No space left on device"), "{stderr}");
    }
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let Run { code, stderr, .. } = run(&["--no-jacobians"], writer.into());
    assert_eq!((code, stderr.as_str()), (0, ""));
}

#[test]
fn a_report_goes_to_a_file_without_colours() {
    let project = Project::new();
    let run = run(&project.path(""), &["-o", "report.txt"], &[("CLICOLOR_FORCE", "1")]);
    assert_eq!((run.code, run.stdout.as_str()), (0, ""));
    insta::assert_snapshot!("passed", without_provenance(&project.read("report.txt")));
}

#[test]
fn the_json_report_fits_its_documented_schema() {
    let project = Project::new();
    project.traces("Spring/pair", |lines| lines[4] = replace_field(&lines[4], 2, "0.5"));
    for arguments in [&["--format", "json"][..], &["--format", "json", "--traces", "traces"]] {
        let report = serde_json::from_str(&project.0.grade(arguments).stdout).unwrap();
        assert_fits("report.schema.json", &report);
    }
}

#[test]
fn the_junit_report_tells_failures_from_faults() {
    let project = Project::new();
    project.traces("Spring/pair", |lines| lines[4] = replace_field(&lines[4], 2, "0.5"));
    project.write("assets/Fall/stone.xml", &FALL.replace("m=\"2\"", "m=\"3\""));
    let run = project.grade(&["--traces", "traces", "--format", "junit"]);
    assert_eq!(run.code, 3);
    insta::assert_snapshot!("junit", without_provenance(&without_times(&run.stdout)));
}

#[test]
fn one_run_has_several_reports() {
    let project = Project::new();
    project.traces("Fall/feather", |lines| lines[2] = replace_field(&lines[2], 2, "0.5"));
    let asked =
        ["--report", "text", "--report", "json=kept/report.json", "--report", "junit=report.xml"];
    fs::create_dir(project.path("kept")).unwrap();
    let run =
        project.grade(&[&["--traces", "traces", "--report", "html=pages"][..], &asked].concat());
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(run.stdout.contains("All required features passed."), "{}", run.stdout);
    let read = |name: &str| fs::read_to_string(project.path(name)).unwrap();
    let json: serde_json::Value = serde_json::from_str(&read("kept/report.json")).unwrap();
    assert_eq!(json["outcome"], "passed");
    // Extra credit that failed is no failure of the run.
    let junit = read("report.xml");
    assert!(junit.contains(" tests=\"3\" failures=\"0\" errors=\"0\""), "{junit}");
    assert!(junit.contains(" skipped=\"1\" errors=\"0\" failures=\"0\""), "{junit}");
    assert!(
        junit.contains("type=\"differs\">the trace differs from the oracle&apos;s\nfirst at"),
        "{junit}"
    );
    assert!(read("pages/index.html").contains("Fall/feather"));
    let refused = |arguments: &[&str], reason: &str| {
        let run = project.grade(&[&["--traces", "traces"], arguments].concat());
        assert!(run.code == 2 && run.stderr.contains(reason), "{reason}: {}", run.stderr);
        assert_eq!(run.stdout, "");
    };
    refused(&["--report", "text", "--report", "json"], "two reports have this destination");
    refused(&["--report", "html"], "html=pages or html=report.html");
    let reports =
        "the reports are text, json, junit, html, gradescope, prairielearn, classroom50 and github";
    refused(&["--report", "pdf=x"], reports);
    refused(&["--report", "text", "--format", "json"], "cannot be used with");
    refused(&["--report", "text", "--report", "json=x", "--fail-fast", "1"], "text reports");
    refused(&["--durations", "-1"], "-1 is not in 1..");
}

#[test]
fn grade_jacobians_checks_without_grading() {
    let run = run(root(), &["jacobians"], &[]);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    insta::assert_snapshot!("jacobians", without_digits(&run.stdout));
}

/// The report with errors masked, since their digits are rounding errors.
fn without_digits(report: &str) -> String {
    let is_error = |word: &&str| word.contains('e') && word.parse::<f64>().is_ok();
    let line = |line: &str| {
        let mut words: Vec<&str> = line.split_whitespace().collect();
        words.iter_mut().filter(|word| is_error(word)).for_each(|word| *word = "#");
        words.join(" ") + "\n"
    };
    report.lines().map(line).collect()
}

#[test]
fn verbose_jacobians_show_their_blocks() {
    let arguments = ["jacobians", "--force", "springforce", "--states", "3", "--details"];
    let run = run(root(), &arguments, &[]);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    for text in ["analytic", "differences", "dual numbers", "Taylor: slope 2.0", "<springforce i=0"]
    {
        assert!(run.stdout.contains(text), "{text}: {}", run.stdout);
    }
    assert!(!run.stdout.contains("Newton"), "{}", run.stdout);
}

#[test]
fn the_jacobians_have_reports_for_programs_too() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["jacobians", "--format", "json", "-o", "report.json"];
    let written = run(folder.path(), &arguments, &[]);
    assert_eq!((written.code, written.stdout.as_str()), (0, ""), "{}", written.stderr);
    let text = fs::read_to_string(folder.path().join("report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_fits("report.schema.json", &report);
    // The state of every verdict can be reproduced: 16 numbers of 2 particles in 3D.
    let spring = report["jacobians"].as_array().unwrap();
    let spring =
        spring.iter().find(|each| each["force"] == "springforce" && each["dimension"] == 3);
    for block in spring.unwrap()["blocks"].as_array().unwrap() {
        let state = &block["exhibit"]["state"];
        let n = state["masses"].as_array().unwrap().len();
        assert_eq!(state["positions"].as_array().unwrap().len(), 3 * n);
        assert_eq!(state["velocities"].as_array().unwrap().len(), 3 * n);
        assert_eq!(state["forces"][0]["parameters"][2]["name"], "b");
        assert_eq!(block["exhibit"]["entries"].as_array().unwrap().len(), 9);
    }
    assert_eq!(report["newton_systems"].as_array().unwrap().len(), 13);

    let spring = ["jacobians", "--force", "springforce"];
    let junit = run(folder.path(), &[&spring[..], &["--format", "junit"]].concat(), &[]);
    assert_eq!(junit.code, 0);
    let suite = "<testsuite name=\"jacobians / springforce 3D\" tests=\"12\" skipped=\"0\" errors=\"0\" failures=\"0\">";
    assert!(junit.stdout.contains(suite), "{}", junit.stdout);
}

#[test]
fn one_plot_is_drawn_per_force() {
    let folder = tempfile::tempdir().unwrap();
    let drawn = run(folder.path(), &["jacobians", "--plot", "plots/all"], &[]);
    assert_eq!(drawn.code, 0, "{}", drawn.stderr);
    let plots = folder.path().join("plots/all");
    // Four kinds of springs, gravitation, two kinds of drag, the vortex, wind, bending and four of triangles, in 2D and 3D; three of
    // tetrahedra and the hinge in 3D.
    assert_eq!(fs::read_dir(&plots).unwrap().count(), 32);
    let svg = fs::read_to_string(plots.join("springforce-3d.svg")).unwrap();
    for text in ["<svg", "step t along p", "error / |J p|", "slope 1", "slope 2", "with J p: slope"]
    {
        assert!(svg.contains(text), "{text}");
    }
    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    let spring = ["jacobians", "--force", "springforce", "--plot", "file"];
    let refused = run(folder.path(), &spring, &[]);
    assert_eq!(refused.code, 2);
    assert!(refused.stderr.contains("file: "), "{}", refused.stderr);
}

impl Project {
    /// Edits the manifest of the oracle's traces.
    fn edit_manifest(&self, from: &str, to: &str) {
        let text = self.read("expected/manifest.toml");
        assert!(text.contains(from), "{text}");
        self.write("expected/manifest.toml", &text.replacen(from, to, 1));
    }
}

#[test]
fn each_manifest_entry_is_verified() {
    let extra = r#"
[[trace]]
scene = "Fall/none"
scene_sha256 = ""
trace_sha256 = ""
integrator = "explicit-euler"
time_step = 0.05
steps = 8
"#;
    let twice = extra.replace("Fall/none", "Fall/stone");
    type Edit<'a> = (&'a str, &'a str, &'a str);
    let edits: [Edit; 6] = [
        (
            "\"symplectic-euler\"",
            "\"explicit-euler\"",
            "Spring/pair: the manifest records the integrator explicit-euler, but the scene's is symplectic-euler",
        ),
        ("time_step = 0.05", "time_step = 0.1", "the time step 0.1 s, but the scene's is 0.05 s"),
        ("steps = 10", "steps = 11", "the number of steps 11, but the scene's is 10"),
        ("version = \"", "version = \"0.0.", "the traces were made by Spring Oracle 0.0."),
        ("steps = 10\n", &format!("steps = 10\n{extra}"), "Fall/none: in the manifest, but there"),
        ("steps = 10\n", &format!("steps = 10\n{twice}"), "Fall/stone: 2 entries in the manifest"),
    ];
    for (from, to, message) in edits {
        let project = Project::new();
        project.edit_manifest(from, to);
        let run = project.grade(&["oracle", "verify"]);
        assert_eq!(run.code, 1, "{message}");
        assert!(run.stdout.contains(message), "{message}: {}", run.stdout);
        assert!(run.stdout.contains("regenerate`\n"), "{}", run.stdout);
        assert!(run.stdout.contains(": 1 mismatch"), "{}", run.stdout);

        let run = project.grade(&["oracle", "regenerate"]);
        assert_eq!(run.code, 0, "{message}");
        assert!(run.stdout.contains("3 of 3 traces are unchanged"), "{}", run.stdout);
        assert!(run.stdout.contains("replaced: its manifest was missing or"), "{}", run.stdout);
        assert_eq!(project.grade(&["oracle", "verify"]).code, 0, "{message}");
    }
}

#[test]
#[cfg(unix)]
fn regeneration_follows_a_link_and_keeps_it() {
    let project = Project::new();
    fs::create_dir(project.path("elsewhere")).unwrap();
    fs::rename(project.path("expected"), project.path("elsewhere/traces")).unwrap();
    std::os::unix::fs::symlink("elsewhere/traces", project.path("expected")).unwrap();
    project.write("assets/Spring/other.xml", SPRING);
    let run = project.grade(&["oracle", "regenerate"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(project.path("expected").is_symlink());
    assert!(project.path("elsewhere/traces/Spring/other.csv").is_file());
    assert_eq!(fs::read_dir(project.path("elsewhere")).unwrap().count(), 1);
    assert_eq!(project.grade(&[]).code, 0);
}

#[test]
fn a_folder_that_holds_the_current_one_is_not_replaced() {
    let project = Project::new();
    project.write("assets/Spring/other.xml", SPRING);
    let before = project.snapshot(".");
    for (folder, expected) in [("expected", "."), ("expected", "../expected"), ("assets", "..")] {
        let arguments = ["oracle", "regenerate", "--root", "..", "--expected", expected];
        let run = run(&project.path(folder), &arguments, &[]);
        assert_eq!(run.code, 2, "{expected}");
        assert!(run.stderr.contains("run the command from another folder"), "{}", run.stderr);
        assert!(project.snapshot(".") == before, "{expected}");
    }
    // A name that ends in dots is resolved: `assets/../expected/.` is the folder itself.
    let run = project.grade(&["oracle", "regenerate", "--expected", "assets/../expected/."]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(project.path("expected/Spring/other.csv").is_file());
    assert_eq!(project.grade(&["oracle", "verify"]).code, 0);
}

#[test]
fn regeneration_creates_a_missing_folder() {
    let project = Project::new();
    let run = project.grade(&["oracle", "regenerate", "--expected", "fresh"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert_eq!(project.grade(&["--expected", "fresh"]).code, 0);
}

#[test]
#[cfg(unix)]
fn endless_rubrics_and_manifests_are_refused() {
    let project = Project::new();
    let run = project.grade(&["--rubric", "/dev/zero"]);
    assert_eq!(run.code, 2);
    assert!(
        run.stderr.contains("/dev/zero: cannot be read: it is larger than 1 MiB"),
        "{}",
        run.stderr
    );

    fs::remove_file(project.path("expected/manifest.toml")).unwrap();
    std::os::unix::fs::symlink("/dev/zero", project.path("expected/manifest.toml")).unwrap();
    let run = project.grade(&[]);
    assert_eq!(run.code, 2);
    let message = "manifest.toml: cannot be read: it is larger than 64 MiB";
    assert!(run.stderr.contains(message), "{}", run.stderr);
}

#[test]
fn two_traces_of_one_scene_cause_a_warning() {
    let project = Project::new();
    project.traces("Spring/pair", |_| ());
    project.write("traces/Spring/pair.bin", "");
    let run = project.grade(&["--traces", "traces", "--format", "json"]);
    let shown = scene(&run.stdout, "Spring/pair");
    assert_eq!((run.code, &shown["verdict"]), (1, &"no-output".into()));
    let message = "both traces/Spring/pair.csv and traces/Spring/pair.bin exist; keep one";
    assert!(shown["message"].as_str().unwrap().contains(message), "{shown}");

    project.write("expected/Spring/pair.bin", "");
    let run = project.grade(&["--format", "json"]);
    let shown = scene(&run.stdout, "Spring/pair");
    assert_eq!((run.code, &shown["verdict"]), (3, &"grader-fault".into()));
    let message = "both expected/Spring/pair.csv and expected/Spring/pair.bin exist; keep one";
    assert!(shown["message"].as_str().unwrap().contains(message), "{shown}");
    let run = project.grade(&["oracle", "verify"]);
    assert!(run.code == 1 && run.stdout.contains(message), "{}", run.stdout);

    // The binary trace has no states: it is not replaced without --accept.
    let run = project.grade(&["oracle", "regenerate"]);
    assert_eq!(run.code, 1);
    let message = "! Spring/pair: one trace replaces two; changed: the old trace has 0 states";
    assert!(run.stdout.contains(message), "{}", run.stdout);
    assert_eq!(project.grade(&["oracle", "regenerate", "--accept"]).code, 0);
    assert!(!project.path("expected/Spring/pair.bin").exists());
    assert_eq!(project.grade(&[]).code, 0);
}

#[test]
#[cfg(target_os = "linux")]
fn upper_case_extension_gets_a_hint() {
    let project = Project::new();
    project.traces("Spring/pair", |_| ());
    let trace = |name: &str| project.path(&format!("traces/Spring/{name}"));
    fs::rename(trace("pair.csv"), trace("pair.CSV")).unwrap();
    let run = project.grade(&["--traces", "traces", "--format", "json"]);
    let shown = scene(&run.stdout, "Spring/pair");
    assert_eq!(shown["verdict"], "missing");
    let message = shown["message"].as_str().unwrap();
    assert!(
        message.starts_with("there is no trace: neither traces/Spring/pair.csv nor"),
        "{shown}"
    );
    assert!(
        message
            .ends_with("help: traces/Spring/pair.CSV exists; change its extension to lower case")
    );
}

#[test]
fn a_weight_alone_leaves_a_scene_its_calibrated_tolerances() {
    let project = Project::new();
    project.traces("", |_| {});
    for (rule, criteria) in [("weight = 2", "calibrated"), ("largest = 1e-9", "fixed")] {
        let rubric = format!("[[scene]]\nname = \"Spring/pair\"\n{rule}\n");
        project.write("assets/rubric.toml", &rubric);
        let run = project.grade(&["--traces", "traces", "--format", "json"]);
        assert_eq!(scene(&run.stdout, "Spring/pair")["criteria"], criteria, "{rule}");
    }
}

#[test]
fn only_selects_scenes_by_name_group_integrator_and_pattern() {
    let project = Project::new();
    for (name, integrator) in [("a", "linearized-implicit-euler"), ("b", "implicit-euler")] {
        let text = SPRING.replace("symplectic-euler", integrator);
        project.write(&format!("assets/Spring/{name}.xml"), &text);
    }
    assert_eq!(project.grade(&["oracle", "regenerate"]).code, 0);
    project.write("assets/GreenSpring/pair.xml", SPRING);
    assert_eq!(project.grade(&["oracle", "regenerate"]).code, 0);
    let names = |text: &str| -> Vec<String> {
        let only = text.split_whitespace().flat_map(|pattern| ["--only", pattern]);
        let run = project.grade(&[&["--format", "json"], &*only.collect::<Vec<_>>()].concat());
        assert_eq!(run.code, 0, "{}", run.stderr);
        let scenes = scenes(&run.stdout).into_iter();
        let mut names: Vec<String> =
            scenes.map(|scene| scene["name"].as_str().unwrap().to_owned()).collect();
        names.sort();
        names
    };
    assert_eq!(names("implicit-euler"), ["Fall/feather", "Spring/b"]);
    assert_eq!(names("implicit"), ["Fall/feather", "Spring/b"]);
    assert_eq!(names("linearized-implicit"), ["Spring/a"]);
    assert_eq!(names("Spring/"), ["Spring/a", "Spring/b", "Spring/pair"]);
    assert_eq!(names("Spring"), names("Spring/"));
    assert_eq!(names("*Spring/p*"), ["GreenSpring/pair", "Spring/pair"]);
    assert_eq!(names("Spring/pair stone"), ["Fall/stone", "Spring/pair"]);
    for command in [&[][..], &["needs"]] {
        let run = project.grade(&[command, &["--only", "stone", "--only", "Fall/stoen"]].concat());
        assert_eq!(run.code, 2, "{command:?}");
        assert_eq!(
            run.stderr,
            "error: nothing matches \"Fall/stoen\"\n  help: did you mean Fall/stone?\n"
        );
    }
    assert_eq!(project.grade(&["--only", "euler"]).code, 2);
}

#[test]
fn uncompared_residuals_are_not_shown_as_zero() {
    let project = Project::new();
    project.traces("Spring/pair", |_| ());
    fs::remove_file(project.path("traces/Spring/pair.csv")).unwrap();
    let text = project.grade(&["--traces", "traces", "--verbose"]).stdout;
    let row = text.lines().find(|line| line.contains("symplectic-euler")).unwrap();
    let cells: Vec<&str> = row.split_whitespace().collect();
    assert_eq!(cells, ["Spring", "symplectic-euler", "0/1", "-", "-", "0/1", "FAIL"]);

    let report = project.grade(&["--traces", "traces", "--format", "json"]).stdout;
    let none = serde_json::json!({ "largest": null, "accumulated": null });
    let zero = serde_json::json!({ "largest": 0.0, "accumulated": 0.0 });
    for (name, residuals) in [("Spring/pair", none), ("Fall/stone", zero)] {
        let shown = scene(&report, name);
        assert_eq!((&shown["position"], &shown["velocity"]), (&residuals, &residuals), "{name}");
    }
}

#[test]
fn regeneration_reports_how_a_trace_changed() {
    let third = "<particle m=\"1\" px=\"3\" py=\"0\" vx=\"0\" vy=\"0\" fixed=\"0\"/>\n  <edge";
    let cases = [
        (
            "<duration",
            "<!-- half a second -->\n  <duration",
            "  Spring/pair: scene edited; trace unchanged",
        ),
        (
            "time=\"0.5\"",
            "time=\"1\"",
            "! Spring/pair: scene edited; changed: the old trace has 11 states, the new one 21",
        ),
        (
            "<edge",
            third,
            "! Spring/pair: scene edited; changed: the old trace has a different number",
        ),
    ];
    for (from, to, message) in cases {
        let project = Project::new();
        project.write("assets/Spring/pair.xml", &SPRING.replacen(from, to, 1));
        let run = project.grade(&["oracle", "regenerate"]);
        let (code, outcome) = if message.starts_with('!') {
            (1, "expected was NOT replaced")
        } else {
            (0, "expected was replaced\n")
        };
        assert_eq!(run.code, code, "{}", run.stdout);
        assert!(run.stdout.starts_with(message), "{message}: {}", run.stdout);
        assert!(run.stdout.contains("2 of 3 traces are unchanged"), "{}", run.stdout);
        assert!(run.stdout.contains(outcome), "{}", run.stdout);
    }
    // Two particles in three dimensions have as many columns as three particles in two.
    let project = Project::new();
    project.write("assets/Spring/pair.xml", &SPRING.replacen("px=", "pz=\"0\" px=", 1));
    assert_eq!(project.grade(&["oracle", "regenerate", "--accept"]).code, 0);
    project.write("assets/Spring/pair.xml", &SPRING.replacen("<edge", third, 1));
    let run = project.grade(&["oracle", "regenerate"]);
    assert!(
        run.code == 1 && run.stdout.contains("different number of particles"),
        "{}",
        run.stdout
    );
    // An unreadable trace does not count as a zero difference.
    let project = Project::new();
    project.write("expected/Spring/pair.csv", "nothing\n");
    let run = project.grade(&["oracle", "regenerate"]);
    let message = "! Spring/pair: changed: the old trace cannot be used: ";
    assert!(run.code == 1 && run.stdout.starts_with(message), "{}", run.stdout);
}

#[test]
fn extra_credit_rule_is_harmless_without_extra_credit() {
    let project = Project::new();
    project.write("assets/rubric.toml", "[[feature]]\nsection = \"extra-credit\"\npoints = 2\n");
    assert_eq!(project.grade(&["--assets", "assets"]).code, 0);
    // If there is extra credit, the rule must match some of it.
    let rule = "[[feature]]\nsection = \"extra-credit\"\ngroup = \"Spring\"\npoints = 2\n";
    project.write("assets/rubric.toml", rule);
    assert_eq!(project.grade(&["--assets", "assets"]).code, 0);
    assert_eq!(project.grade(&[]).code, 2);
}

/// Submissions that cannot be graded: a submission that could read the oracle does not run, and a failed build is
/// reported once.
#[test]
#[cfg(target_os = "linux")]
fn folder_submissions_are_built_and_graded() {
    let project = Project::new();
    let manifest = |build: &str| {
        format!(
            "name = \"mine\"\nbuild = [{build}]\nrun = [\"./x\", \"{{scene}}\", \"{{trace}}\"]\n"
        )
    };
    project
        .write("mine/submission.toml", &manifest("\"sh\", \"-c\", \"echo no luck >&2; exit 7\""));
    let run = project.grade(&["mine"]);
    assert_eq!(run.code, 1, "{}", run.stderr);
    assert!(run.stdout.contains("Summary for mine"), "{}", run.stdout);
    let printed = "\nNo scene was run: build failed\n  the build ended with exit status 7; it printed:\n  no luck\n";
    assert!(run.stdout.contains(printed), "{}", run.stdout);
    let next = "Next\n  Mend what the message above says, and grade again.\n";
    assert!(run.stdout.ends_with(next), "{}", run.stdout);
    let all = project.grade(&["mine", "--verbose"]).stdout;
    assert!(all.contains("  no luck\n  and the same for 2 more scenes\n"), "{all}");
    assert!(!project.path("mine/x").exists());

    let failed = project.grade(&["mine", "--readable", "nowhere"]);
    assert!(
        failed.code == 2 && failed.stderr.contains("--readable nowhere: "),
        "{}",
        failed.stderr
    );
    let failed = project.grade(&["class", "mine", "-o", "results"]);
    assert!(failed.stderr.contains("help: `grade mine` grades it"), "{}", failed.stderr);
    let failed = project.grade(&["class", "mime", "-o", "results"]);
    assert!(
        failed.code == 2 && failed.stderr.contains("mime: folder not found"),
        "{}",
        failed.stderr
    );

    // The first error of a compiler is the cause of the others.
    let compiler = "echo first error >&2; seq 3000 >&2; exit 1";
    project.write("mine/submission.toml", &manifest(&format!("\"sh\", \"-c\", \"{compiler}\"")));
    let text = project.grade(&["mine", "--verbose"]).stdout;
    for part in ["it printed:\n  first error\n  1\n", "lines left out …\n", "  3000\n"] {
        assert!(text.contains(part), "{text}");
    }
    project
        .write("mine/submission.toml", &manifest("\"sh\", \"-c\", \"echo no luck >&2; exit 7\""));

    let run = project.grade(&["mine", "--format", "json"]);
    assert_eq!(run.stdout.matches("\"verdict\": \"build-failed\"").count(), 3);

    project.write("submission.toml", &manifest("\"true\""));
    let run = project.grade(&["."]);
    assert_eq!(run.code, 2, "{}", run.stdout);
    assert!(run.stderr.contains("which contains it"), "{}", run.stderr);

    for (manifest, message) in [
        ("run = [\"./x\", \"{scene}\"]", "mine/submission.toml:1: run holds no {trace}"),
        ("run = []", "mine/submission.toml:1: run names no program"),
        ("\nruns = 1", "mine/submission.toml:2: unknown field `runs`"),
    ] {
        project.write("mine/submission.toml", manifest);
        let run = project.grade(&["mine"]);
        assert_eq!(run.code, 2);
        assert!(run.stderr.contains(message), "{}", run.stderr);
    }
}

/// A particle at 0.5 on a spring of rest length 1 from the origin, with h² k = m: `x' = 0.5 + (±1 − x')`.
#[test]
fn other_root_of_a_step_passes_if_the_rubric_allows() {
    let project = Project::new();
    let scene = r#"<scene>
  <duration time="0.1"/>
  <integrator type="implicit-euler" dt="0.1"/>
  <particle m="1" px="0" py="0" vx="0" vy="0" fixed="1"/>
  <particle m="1" px="0.5" py="0" vx="0" vy="0" fixed="0"/>
  <edge i="0" j="1"/>
  <springforce edge="0" k="100" l0="1"/>
</scene>
"#;
    project.write("assets/Spring/through.xml", scene);
    assert_eq!(project.grade(&["oracle", "regenerate"]).code, 0);
    let expected = project.read("expected/Spring/through.csv");
    let [header, first, last] = expected.lines().collect::<Vec<_>>()[..] else {
        panic!("{expected}")
    };
    assert!(last.contains(",0.75,0.0,2.5,"), "{last}");
    let report = |position: &str, velocity: &str| -> serde_json::Value {
        let last = format!("1,0.1,0,0,0,0,{position},0,{velocity},0");
        project.write("mine/Spring/through.csv", &format!("{header}\n{first}\n{last}\n"));
        let run = project.grade(&["mine", "--only", "Spring/through", "--format", "json"]);
        serde_json::from_str(&run.stdout).unwrap()
    };
    let scene = |report: &serde_json::Value| report["features"][0]["scenes"][0].clone();
    let failed = report("-0.25", "-7.5");
    assert_eq!(scene(&failed)["verdict"], "differs", "{failed}");
    assert_eq!(failed["findings"][0]["kind"], "other-root", "{failed}");

    project.write("assets/rubric.toml", "[default]\nother-root = \"pass\"\n");
    let passed = report("-0.25", "-7.5");
    assert_eq!(scene(&passed)["verdict"], "pass", "{passed}");
    assert_eq!(scene(&passed)["other_root"], 1);
    let text = project.grade(&["mine", "--only", "Spring/through"]).stdout;
    let text = folder::words(&text);
    let shown = "another solution of the same equations, as the rubric allows: Spring/through.";
    assert!(text.contains(shown), "{text}");
    // This step solves nothing.
    assert_eq!(scene(&report("-0.26", "-7.6"))["verdict"], "differs");
}
