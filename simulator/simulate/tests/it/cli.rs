//! Output files of `simulate`.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::shared::bits;
use crate::support::{simulate, stderr};
use scene::Dimension;
use scene::schema::{Convergence, Matrix};
use scene::trace::csv::CsvReader;
use scene::trace::{Shape, State, TraceError, TraceReader};
use simulator::integrator;
use tempfile::TempDir;

/// Two particles and numbers that need all their digits.
const SCENE: &str = r#"<scene>
  <duration time="1"/>
  <integrator type="symplectic-euler" dt="0.1"/>
  <particle m="1.3" px="0.1" py="-0.2" vx="0.3" vy="-0.4" fixed="0"/>
  <particle m="0.7" px="1.1" py="1e-7" vx="-1e17" vy="0.1" fixed="1"/>
  <simplegravity fx="0.01" fy="-9.81"/>
  <dragdamping b="0.3"/>
</scene>
"#;

/// Everything in it is a power of two or a sum of few: the numbers below are exact.
const EXACT: &str = r#"<scene>
  <duration time="1"/>
  <integrator type="symplectic-euler" dt="0.5"/>
  <particle m="2" px="0" py="8" vx="1" vy="0" fixed="0"/>
  <particle m="4" px="3" py="4" vx="0" vy="-2" fixed="1"/>
  <simplegravity fx="0" fy="-10"/>
</scene>
"#;

fn folder_with(scene: &str) -> TempDir {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("scene.xml"), scene).unwrap();
    folder
}

/// Runs `simulate`, which must succeed without a remark; returns what it prints.
fn run(folder: &Path, arguments: &[&str]) -> String {
    let run = simulate(folder, arguments);
    assert_eq!((run.status.code(), stderr(&run)), (Some(0), ""), "{arguments:?}");
    String::from_utf8(run.stdout).unwrap()
}

/// The trace that `simulate scene.xml` with these options writes as CSV.
fn csv_of(scene: &str, options: &[&str]) -> String {
    let folder = folder_with(scene);
    run(folder.path(), &[&["scene.xml", "-o", "trace.csv"], options].concat());
    fs::read_to_string(folder.path().join("trace.csv")).unwrap()
}

#[test]
fn served_scenes_have_the_traces_of_single_calls_up_to_the_first_failure() {
    let folder = folder_with(SCENE);
    let path = |name: &str| folder.path().join(name);
    fs::write(path("calls"), "scene.xml 0.csv\nscene.xml 1.bin\nscene.xml\nscene.xml 2.csv\n")
        .unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_simulate"));
    command.arg("--serve").current_dir(folder.path()).stdin(fs::File::open(path("calls")).unwrap());
    let served = command.output().unwrap();
    let message = "error: standard input:3: no trace is named\n  help: write a scene and its trace, such as a.xml a.csv\n";
    assert_eq!((served.status.code(), stderr(&served)), (Some(2), message));
    for (name, alone) in [("0.csv", "alone.csv"), ("1.bin", "alone.bin")] {
        run(folder.path(), &["scene.xml", "-o", alone]);
        assert_eq!(fs::read(path(name)).unwrap(), fs::read(path(alone)).unwrap(), "{name}");
    }
    assert!(!path("2.csv").exists());
}

/// The numbers of a CSV file below its header.
fn rows(csv: &str) -> Vec<Vec<f64>> {
    let row = |line: &str| line.split(',').map(|field| field.parse().unwrap()).collect();
    csv.lines().skip(1).map(row).collect()
}

/// The numbers of a binary trace, by hand.
fn records(bytes: &[u8], n_numbers: usize) -> Vec<Vec<f64>> {
    assert_eq!(bytes.len() % (8 * n_numbers), 0);
    let number = |bytes: &[u8]| f64::from_le_bytes(bytes.try_into().unwrap());
    let record = |bytes: &[u8]| bytes.chunks(8).map(number).collect();
    bytes.chunks(8 * n_numbers).map(record).collect()
}

#[test]
fn a_csv_trace_has_a_header_and_a_row_a_state() {
    let expected = "\
step,time,x0,y0,vx0,vy0,x1,y1,vx1,vy1
0,0.0,0.0,8.0,1.0,0.0,3.0,4.0,0.0,-2.0
1,0.5,0.5,5.5,1.0,-5.0,3.0,3.0,0.0,-2.0
2,1.0,1.0,0.5,1.0,-10.0,3.0,2.0,0.0,-2.0
";
    assert_eq!(csv_of(EXACT, &[]), expected);
}

#[test]
fn a_csv_trace_of_three_dimensions_has_z() {
    let scene = EXACT.replace("py=\"8\"", "py=\"8\" pz=\"-1\"").replace("fy=", "fz=\"2\" fy=");
    let expected = "\
step,time,x0,y0,z0,vx0,vy0,vz0,x1,y1,z1,vx1,vy1,vz1
0,0.0,0.0,8.0,-1.0,1.0,0.0,0.0,3.0,4.0,0.0,0.0,-2.0,0.0
1,0.5,0.5,5.5,-0.5,1.0,-5.0,1.0,3.0,3.0,0.0,0.0,-2.0,0.0
";
    assert_eq!(csv_of(&scene, &["--duration", "0.5"]), expected);
}

#[test]
fn a_binary_trace_is_positions_then_velocities_in_little_endian() {
    let folder = folder_with(EXACT);
    run(folder.path(), &["scene.xml", "-o", "trace.bin"]);
    let states = [
        [0.0, 8.0, 3.0, 4.0, 1.0, 0.0, 0.0, -2.0],
        [0.5, 5.5, 3.0, 3.0, 1.0, -5.0, 0.0, -2.0],
        [1.0, 0.5, 3.0, 2.0, 1.0, -10.0, 0.0, -2.0],
    ];
    let expected: Vec<u8> =
        states.as_flattened().iter().flat_map(|x: &f64| x.to_le_bytes()).collect();
    assert_eq!(fs::read(folder.path().join("trace.bin")).unwrap(), expected);
}

#[test]
fn both_formats_hold_the_same_bits() {
    for scene in [SCENE.to_owned(), SCENE.replace("py=\"-0.2\"", "py=\"-0.2\" pz=\"0.3\"")] {
        let d = if scene.contains("pz") { 3 } else { 2 };
        let folder = folder_with(&scene);
        run(folder.path(), &["scene.xml", "-o", "trace.csv"]);
        run(folder.path(), &["scene.xml", "-o", "trace.bin"]);
        let csv = rows(&fs::read_to_string(folder.path().join("trace.csv")).unwrap());
        let binary = records(&fs::read(folder.path().join("trace.bin")).unwrap(), 4 * d);
        assert_eq!((csv.len(), binary.len()), (11, 11));
        for (step, (row, record)) in csv.iter().zip(&binary).enumerate() {
            let of_particle = |particle: usize| &row[2 + particle * 2 * d..][..2 * d];
            let [first, second] = [0, 1].map(of_particle);
            let reordered = [&first[..d], &second[..d], &first[d..], &second[d..]].concat();
            assert_eq!(bits(&reordered), bits(record), "step {step}");
            assert_eq!(row[..2], [step as f64, step as f64 * 0.1]);
        }
    }
}

#[test]
fn initial_numbers_round_trip() {
    let numbers =
        ["0.1", "1e-7", "5e-324", "1.7976931348623157e308", "0.30000000000000004", "-0.0"];
    for number in numbers {
        let scene = EXACT.replace("px=\"0\"", &format!("px=\"{number}\""));
        let row = rows(&csv_of(&scene, &["--duration", "0"])).remove(0);
        assert_eq!(row[2].to_bits(), number.parse::<f64>().unwrap().to_bits(), "{number}");
    }
}

#[test]
fn trace_has_a_state_for_the_start_and_each_step() {
    for (duration, dt, states) in
        [("1", "0.25", 5), ("1", "0.3", 5), ("0", "1", 1), ("0.1", "1", 2), ("2.1", "0.3", 9)]
    {
        let folder = folder_with(SCENE);
        let times = ["--duration", duration, "--dt", dt];
        run(folder.path(), &[&["scene.xml", "-o", "trace.bin"], times.as_slice()].concat());
        let bytes = fs::read(folder.path().join("trace.bin")).unwrap();
        assert_eq!(bytes.len(), states * 8 * 8, "{duration} / {dt}");
        assert_eq!(rows(&csv_of(SCENE, &times)).len(), states, "{duration} / {dt}");
    }
}

#[test]
fn fosssims_spelling_writes_binary_unless_the_file_is_a_csv() {
    let folder = folder_with(EXACT);
    run(folder.path(), &["scene.xml", "-o", "expected.bin"]);
    let expected = fs::read(folder.path().join("expected.bin")).unwrap();
    for output in ["trace.bin", "trace.out", "trace"] {
        run(folder.path(), &["-s", "scene.xml", "-d", "0", "-p", "1", "-o", output]);
        assert_eq!(fs::read(folder.path().join(output)).unwrap(), expected, "{output}");
    }
    run(folder.path(), &["-s", "scene.xml", "-d", "0", "-o", "trace.csv"]);
    assert_eq!(fs::read_to_string(folder.path().join("trace.csv")).unwrap(), csv_of(EXACT, &[]));
}

#[test]
fn format_option_overrides_the_extension() {
    let folder = folder_with(EXACT);
    run(folder.path(), &["scene.xml", "-o", "trace.bin"]);
    let binary = fs::read(folder.path().join("trace.bin")).unwrap();
    let csv = csv_of(EXACT, &[]).into_bytes();
    for (format, expected) in [("csv", &csv), ("fosssim", &binary), ("bin", &binary)] {
        for output in ["named.csv", "named.bin", "named"] {
            run(folder.path(), &["scene.xml", "-o", output, "--format", format]);
            assert!(
                fs::read(folder.path().join(output)).unwrap() == *expected,
                "{format} {output}"
            );
        }
    }
}

#[test]
fn options_override_the_scene() {
    let changes = [
        (
            "type=\"symplectic-euler\"",
            "type=\"explicit-euler\"",
            ["--integrator", "explicit-euler"],
        ),
        ("type=\"symplectic-euler\"", "type=\"implicit\"", ["--integrator", "implicit"]),
        ("dt=\"0.1\"", "dt=\"0.05\"", ["--dt", "0.05"]),
        ("time=\"1\"", "time=\"0.35\"", ["--duration", "0.35"]),
    ];
    let plain = csv_of(SCENE, &[]);
    for (old, new, option) in changes {
        let overridden = csv_of(SCENE, &option);
        assert_ne!(overridden, plain, "{option:?} changes something");
        assert_eq!(overridden, csv_of(&SCENE.replace(old, new), &[]), "{option:?}");
    }
}

#[test]
fn overrides_repair_unknown_integrators_and_excess_steps() {
    let scene = SCENE.replace("symplectic-euler", "adams");
    assert_eq!(csv_of(&scene, &["--integrator", "symplectic"]), csv_of(SCENE, &[]));
    let scene = SCENE.replace("time=\"1\"", "time=\"1e300\"");
    assert_eq!(csv_of(&scene, &["--duration", "1"]), csv_of(SCENE, &[]));
}

#[test]
fn the_energy_file_holds_energies_and_momentum_of_every_state() {
    // Kinetic ½·2·1² + ½·4·2² = 9, potential −2·(−10·8) − 4·(−10·4) = 320, momentum 2·(1, 0) + 4·(0, −2);
    // then y falls to 5.5 and 0.5 at 5 and 10 a second, and the fixed particle to 3 and 2.
    let expected = "\
step,time,kinetic,potential,total,momentum_x,momentum_y
0,0.0,9.0,320.0,329.0,2.0,-8.0
1,0.5,34.0,230.0,264.0,2.0,-18.0
2,1.0,109.0,90.0,199.0,2.0,-28.0
";
    let folder = folder_with(EXACT);
    assert_eq!(run(folder.path(), &["scene.xml", "--energy", "energy.csv"]), "");
    assert_eq!(fs::read_to_string(folder.path().join("energy.csv")).unwrap(), expected);
    assert!(!folder.path().join("trace.csv").exists());
}

#[test]
fn the_potential_is_the_sum_of_the_forces_that_have_one() {
    // Particles at (0, 0, 0) and (3, 4, 0), both at rest, so that r = 5.
    let scene = |force: &str| {
        format!(
            r#"<scene><duration time="0"/><integrator type="implicit" dt="1"/>
            <particle m="2" px="0" py="0" pz="0" vx="0" vy="0" fixed="0"/>
            <particle m="4" px="3" py="4" vx="0" vy="0" vz="0" fixed="1"/>
            <edge i="0" j="1"/>{force}</scene>"#
        )
    };
    let spring = r#"<springforce edge="0" k="6" l0="3" b="7"/>"#;
    let gravitation = r#"<gravitationalforce i="0" j="1" G="10"/>"#;
    let potentials = [
        ("", 0.0),
        (spring, 12.0),
        (gravitation, -16.0),
        (r#"<simplegravity fx="1" fy="-10"/>"#, 148.0),
        (r#"<constantforce fx="1" fy="-10"/>"#, 37.0),
        (r#"<dragdamping b="1"/>"#, 0.0),
        (r#"<vortexforce i="0" j="1" kbs="1" kvc="1"/>"#, 0.0),
        (&format!("{spring}{gravitation}{spring}"), 8.0),
    ];
    for (force, potential) in potentials {
        let folder = folder_with(&scene(force));
        run(folder.path(), &["scene.xml", "--energy", "energy.csv"]);
        let energy = fs::read_to_string(folder.path().join("energy.csv")).unwrap();
        assert!(energy.lines().next().unwrap().ends_with(",momentum_x,momentum_y,momentum_z"));
        assert_eq!(
            rows(&energy),
            [[0.0, 0.0, 0.0, potential, potential, 0.0, 0.0, 0.0]],
            "{force}"
        );
    }
}

#[test]
fn statistics_are_rows_of_a_name_and_a_value() {
    let value = |output: &str, name: &str| {
        let row = output.lines().find(|row| row.starts_with(&format!("{name:<22} ")));
        row.map(|row| row[23..].to_owned())
    };
    let spring = "<edge i=\"0\" j=\"1\"/><springforce edge=\"0\" k=\"10\" l0=\"1\"/></scene>";
    let scene = EXACT.replace("</scene>", spring).replace("vx=\"1\"", "vx=\"0.5\"");
    for kind in integrator::REGISTRY {
        let name = kind.schema.name;
        let folder = folder_with(&scene);
        let output = run(folder.path(), &["scene.xml", "--stats", "--integrator", name]);
        assert_eq!(value(&output, "steps").as_deref(), Some("2"), "{name}: {output}");
        assert!(value(&output, "time").unwrap().ends_with(" ms"), "{name}: {output}");
        let evaluations: u64 = value(&output, "force evaluations").unwrap().parse().unwrap();
        let implicit = kind.schema.matrix == Matrix::Jacobians;
        for row in ["matrix assemblies", "linear solves", "factorisations"] {
            let found = value(&output, row).map(|count| count.parse::<u64>().unwrap());
            let expected = match (name, row) {
                // Its matrix is made once, and serves fifty rounds in each of two steps.
                ("fast-mass-spring", "linear solves") => Some(100),
                ("fast-mass-spring", _) => Some(1),
                _ => implicit.then_some(evaluations),
            };
            assert_eq!(found, expected, "{name}: {row}\n{output}");
        }
        let solver = value(&output, "linear solver");
        let expected = match name {
            "fast-mass-spring" => Some("constant dense Cholesky 1 × 1, 1 entries in its factor"),
            _ => implicit.then_some("dense complete-pivoting LU 2 × 2"),
        };
        assert_eq!(solver.as_deref(), expected, "{name}: {output}");
        let rounds = value(&output, "local-global rounds");
        let expected = (name == "fast-mass-spring").then_some("100, at most 50 a step");
        assert_eq!(rounds.as_deref(), expected, "{name}: {output}");
        let newton = value(&output, "Newton iterations");
        if name == "projected-newton" {
            // The last step of Newton's method is not taken, and not counted.
            let iterations: u64 = newton.unwrap().split(',').next().unwrap().parse().unwrap();
            assert_eq!(iterations + 2, evaluations, "{output}");
            let searched = value(&output, "energy evaluations").unwrap();
            assert_eq!(searched, (2 * iterations).to_string(), "{output}");
        } else if matches!(kind.schema.convergence, Convergence::Update(_)) {
            assert!(newton.unwrap().starts_with(&format!("{evaluations}, at most ")), "{output}");
            assert!(evaluations > 2);
        } else {
            let expected = match name {
                // The force at the end of the first step is that at the start of the second.
                "velocity-verlet" => 3,
                "runge-kutta-4" => 8,
                "dormand-prince" => {
                    let taken = value(&output, "controlled steps").unwrap();
                    let rejected: u64 = value(&output, "rejected steps").unwrap().parse().unwrap();
                    let (taken, most) = taken.split_once(", at most ").unwrap();
                    assert!(most.ends_with(" a step"), "{output}");
                    6 * (taken.parse::<u64>().unwrap() + rejected) + 2
                }
                _ => 2,
            };
            assert_eq!((newton, evaluations), (None, expected), "{name}: {output}");
        }
    }
}

#[test]
fn run_without_output_says_so() {
    let folder = folder_with(SCENE);
    let note = "note: the scene is simulated, and nothing is written\n  help: -o trace.csv writes the state after every step\n";
    let alone = simulate(folder.path(), &["scene.xml"]);
    assert_eq!((alone.status.code(), stderr(&alone)), (Some(0), note));
    assert!(alone.stdout.is_empty());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    // With statistics, no note is printed.
    run(folder.path(), &["scene.xml", "--stats"]);
}

#[test]
fn longer_earlier_file_is_replaced_entirely() {
    let folder = folder_with(EXACT);
    for (output, option) in [("trace.csv", "-o"), ("energy.csv", "--energy")] {
        fs::write(folder.path().join(output), vec![b'x'; 100_000]).unwrap();
        run(folder.path(), &["scene.xml", option, output]);
        let text = fs::read_to_string(folder.path().join(output)).unwrap();
        assert!(text.starts_with("step,time,") && text.lines().count() == 4, "{text}");
    }
    // The scene and the two outputs: what was written aside is gone.
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3);
}

#[test]
fn lone_hyphen_is_not_a_file_name() {
    let folder = folder_with(EXACT);
    for options in [&["--format", "csv", "-o", "-"][..], &["--energy", "-"]] {
        let output = simulate(folder.path(), &[&["scene.xml"], options].concat());
        assert_eq!(output.status.code(), Some(2), "{options:?}");
        assert!(stderr(&output).contains("standard output is /dev/stdout"), "{}", stderr(&output));
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn no_output_replaces_the_scene_or_another_output() {
    let folder = folder_with(EXACT);
    for arguments in [
        &["-s", "scene.xml", "-d", "0", "-o", "scene.xml"][..],
        &["scene.xml", "-o", "./scene.xml", "--format", "csv"],
        &["scene.xml", "--energy", "scene.xml"],
        &["scene.xml", "-o", "one.csv", "--energy", "./one.csv"],
    ] {
        let output = simulate(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(stderr(&output).contains("cannot be one file"), "{}", stderr(&output));
        assert_eq!(fs::read_to_string(folder.path().join("scene.xml")).unwrap(), EXACT);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}

#[cfg(unix)]
#[test]
fn a_device_is_written_to_and_stays_a_device() {
    use std::os::unix::fs::FileTypeExt;
    let folder = folder_with(EXACT);
    run(
        folder.path(),
        &["scene.xml", "-o", "/dev/null", "--format", "csv", "--energy", "/dev/null"],
    );
    assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
    let printed = run(folder.path(), &["scene.xml", "-o", "/dev/stdout", "--format", "csv"]);
    assert_eq!(printed, csv_of(EXACT, &[]));
}

#[cfg(unix)]
#[test]
fn dangling_link_is_followed() {
    let folder = folder_with(EXACT);
    std::os::unix::fs::symlink("target.csv", folder.path().join("link.csv")).unwrap();
    run(folder.path(), &["scene.xml", "-o", "link.csv"]);
    assert!(fs::symlink_metadata(folder.path().join("link.csv")).unwrap().is_symlink());
    assert_eq!(fs::read_to_string(folder.path().join("target.csv")).unwrap(), csv_of(EXACT, &[]));
}

#[cfg(unix)]
#[test]
fn read_only_files_and_permissions_are_kept() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder_with(EXACT);
    let path = folder.path().join("old.csv");
    for (mode, code) in [(0o400, 2), (0o640, 0)] {
        fs::write(&path, "earlier").unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
        let output = simulate(folder.path(), &["scene.xml", "-o", "old.csv"]);
        assert_eq!(output.status.code(), Some(code), "{}", stderr(&output));
        assert_eq!(fs::read_to_string(&path).unwrap() == "earlier", code == 2);
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, mode);
        fs::remove_file(&path).unwrap();
    }
}

#[test]
fn non_finite_energies_are_an_error_and_write_no_file() {
    let scene = r#"<scene><duration time="1"/><integrator type="explicit-euler" dt="0.5"/>
        <particle m="1" px="0" py="0" vx="0" vy="0" fixed="1"/>
        <particle m="1" px="0" py="0" vx="0" vy="0" fixed="1"/>
        <gravitationalforce i="0" j="1" G="1"/></scene>"#;
    let folder = folder_with(scene);
    let output = simulate(folder.path(), &["scene.xml", "-o", "t.csv", "--energy", "e.csv"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("the energy of the state is not finite"),
        "{}",
        stderr(&output)
    );
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[cfg(unix)]
#[test]
fn a_link_is_followed_and_stays_a_link() {
    let folder = folder_with(EXACT);
    let target = folder.path().join("results/target.csv");
    let link = folder.path().join("link.csv");
    fs::create_dir(folder.path().join("results")).unwrap();
    fs::write(&target, "earlier").unwrap();
    std::os::unix::fs::symlink("results/target.csv", &link).unwrap();
    run(folder.path(), &["scene.xml", "-o", "link.csv"]);
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(fs::read_to_string(&target).unwrap(), csv_of(EXACT, &[]));
    assert_eq!(fs::read_dir(folder.path().join("results")).unwrap().count(), 1);
}

#[cfg(unix)]
#[test]
fn a_new_file_has_the_permissions_of_any_new_file() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder_with(EXACT);
    run(folder.path(), &["scene.xml", "-o", "trace.csv"]);
    let mode = |name: &str| fs::metadata(folder.path().join(name)).unwrap().permissions().mode();
    assert_eq!(mode("trace.csv"), mode("scene.xml"));
}

#[test]
fn help_and_version_succeed() {
    let folder = TempDir::new().unwrap();
    // Lines are wrapped.
    let help = run(folder.path(), &["--help"]).split_whitespace().collect::<Vec<_>>().join(" ");
    for kind in integrator::REGISTRY {
        assert!(help.contains(kind.schema.name), "{help}");
    }
    for kind in simulator::force::REGISTRY {
        assert!(help.contains(kind.schema.example), "{help}");
    }
    assert!(run(folder.path(), &["--version"]).starts_with("simulate "));
}

/// The states of a CSV trace of `EXACT` after `edit`, or what is wrong with it.
fn read_back(edit: impl Fn(&str) -> String) -> Result<Vec<State>, TraceError> {
    let text = edit(&csv_of(EXACT, &[]));
    let n_particles = EXACT.matches("<particle").count();
    let shape = Shape { dimension: Dimension::Two, n_particles };
    let mut reader = CsvReader::new(text.as_bytes(), Path::new("trace.csv"), shape)?;
    let (mut states, mut state) = (Vec::new(), State::zeros(shape));
    while reader.read(&mut state)? {
        states.push(state.clone());
    }
    Ok(states)
}

#[test]
fn traces_are_read_as_other_programs_write_them() {
    let plain = read_back(str::to_owned).unwrap();
    let steps_with_points = |text: &str| {
        let line = |line: &str| match line.split_once(',') {
            Some((step, rest)) if step != "step" => format!("{step}.0,{rest}"),
            _ => line.to_owned(),
        };
        text.lines().map(line).collect::<Vec<_>>().join("\r\n")
    };
    assert_eq!(read_back(steps_with_points).unwrap(), plain);
    assert_eq!(read_back(|text| text.replace(',', " , ")).unwrap(), plain);
    assert_eq!(read_back(|text| text.trim_end().to_owned()).unwrap(), plain);
    assert!(read_back(|text| text.replace("\n1,", "\n1.5,")).is_err());
}

#[test]
fn c_spellings_of_nan_are_read() {
    for text in ["nan", "-nan", "NaN", "-nan(ind)", "1.#QNAN", "-1.#IND"] {
        let with = |trace: &str| {
            let (head, last) = trace.trim_end().rsplit_once(',').unwrap();
            assert!(last.parse::<f64>().is_ok());
            format!("{head},{text}")
        };
        let states = read_back(with).unwrap();
        assert!(states.last().unwrap().velocities.last().unwrap().is_nan(), "{text}");
    }
    assert!(read_back(|trace| format!("{}x", trace.trim_end())).is_err());
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_standard_output_is_an_error_and_a_closed_one_is_not() {
    let folder = folder_with(SCENE);
    let run = |arguments: &[&str], stdout: std::process::Stdio| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_simulate"));
        command.current_dir(folder.path()).args(arguments).stdout(stdout).output().unwrap()
    };
    for arguments in [&["scene.xml", "--stats"][..], &["generate", "ring"]] {
        let full = fs::File::options().write(true).open("/dev/full").unwrap();
        let output = run(arguments, full.into());
        assert_eq!(output.status.code(), Some(3), "{arguments:?}: {}", stderr(&output));
        assert!(stderr(&output).contains("standard output: No space left on device"));
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = run(arguments, writer.into());
        assert_eq!((output.status.code(), stderr(&output)), (Some(0), ""), "{arguments:?}");
    }
}
