//! The skeletons of `grade init` pass the simplest group in the sandbox, and everything once they are filled in.

use needs::needs;
use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

use serde_json::Value;
use test_support::{root, sample};

use grader::submission::init::Language;

const GRADE: &str = env!("CARGO_BIN_EXE_grade");

/// A skeleton passes the simplest group; `--readable` names a folder with the tools of its language.
fn passes_the_simplest_group(language: Language, readable: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let submission = folder.path().join("mine");
    let init = || Command::new(GRADE).args(["init", language.name()]).arg(&submission).output();
    assert!(init().unwrap().status.success());
    let again = init().unwrap();
    assert_eq!(again.status.code(), Some(2), "nothing is overwritten");
    assert!(String::from_utf8_lossy(&again.stderr).contains("help: name another folder"));

    let mut grade = Command::new(GRADE);
    grade.arg(&submission).args(["--only", "Inertia", "--root"]).arg(root()).args(readable);
    let graded = grade.output().unwrap();
    assert_eq!(graded.status.code(), Some(0), "{}: {graded:?}", language.name());
    assert_served(&submission);
}

/// Asserts that a skeleton in one file serves two scenes as it simulates one.
fn assert_served(submission: &Path) {
    let manifest = std::fs::read_to_string(submission.join("submission.toml")).unwrap();
    let manifest: toml::Table = toml::from_str(&manifest).unwrap();
    let scene = root().join("assets/Inertia/another-hand-symplectic.xml");
    std::fs::copy(scene, submission.join("scene.xml")).unwrap();
    std::fs::write(submission.join("calls"), "scene.xml 0.csv\nscene.xml 1.csv\n").unwrap();
    let call = |key: &str| {
        let Some(words) = manifest.get(key).and_then(toml::Value::as_array) else { return };
        let word = |word: &toml::Value| {
            let word = word.as_str().unwrap().replace("{folder}", ".");
            word.replace("{scene}", "scene.xml").replace("{trace}", "trace.csv")
        };
        let words: Vec<String> = words.iter().map(word).collect();
        let calls = std::fs::File::open(submission.join("calls")).unwrap();
        let mut command = Command::new(&words[0]);
        command.args(&words[1..]).current_dir(submission).stdin(calls);
        assert!(command.status().unwrap().success(), "{words:?}");
    };
    ["build", "run", "serve"].into_iter().for_each(call);
    let read = |name: &str| std::fs::read_to_string(submission.join(name)).unwrap();
    assert!(!read("trace.csv").is_empty());
    assert_eq!([read("0.csv"), read("1.csv")], [read("trace.csv"), read("trace.csv")]);
}

#[needs("test -x /usr/bin/c++")]
#[test]
fn cpp_skeleton_passes_the_simplest_group() {
    passes_the_simplest_group(Language::Cpp, &[]);
}

#[needs("test -x /usr/bin/python3")]
#[test]
fn python_skeleton_passes_the_simplest_group() {
    passes_the_simplest_group(Language::Python, &[]);
}

#[test]
fn rust_skeleton_passes_the_simplest_group() {
    let sysroot = Command::new("rustc").args(["--print", "sysroot"]).output().unwrap();
    let sysroot = String::from_utf8(sysroot.stdout).unwrap();
    passes_the_simplest_group(Language::Rust, &["--readable", sysroot.trim()]);
}

/// Bodies for the stubs of a file, in their order.
type Bodies = &'static [(&'static str, &'static [&'static str])];

/// Milestone 3 in C++.
const T1M3: Bodies = &[
    (
        "SimpleGravityForce.cpp",
        &["for (std::size_t k = 0; k < x.size(); ++k) gradE[k] -= m[k] * (k % 2 == 0 ? m_fx : m_fy);"],
    ),
    (
        "DragDampingForce.cpp",
        &[
            "for (std::size_t k = 0; k < v.size(); ++k) gradE[k] += m_b * v[k];",
            "for (std::size_t k = 0; k < v.size(); ++k) hessE(k, k) += m_b;",
        ],
    ),
    (
        "GravitationalForce.cpp",
        &[
            "scalar d[2] = {x[2*m_j] - x[2*m_i], x[2*m_j+1] - x[2*m_i+1]}, r = std::hypot(d[0], d[1]);
             for (int a = 0; a < 2; ++a) {
                 scalar g = m_G * m[2*m_i] * m[2*m_j] / (r * r * r) * d[a];
                 gradE[2*m_i+a] -= g; gradE[2*m_j+a] += g; }",
            "scalar n[2] = {x[2*m_j] - x[2*m_i], x[2*m_j+1] - x[2*m_i+1]}, r = std::hypot(n[0], n[1]);
             n[0] /= r; n[1] /= r;
             for (int a = 0; a < 2; ++a) for (int b = 0; b < 2; ++b) {
                 scalar h = m_G * m[2*m_i] * m[2*m_j] / (r * r * r) * ((a == b) - 3 * n[a] * n[b]);
                 hessE(2*m_i+a, 2*m_i+b) += h; hessE(2*m_j+a, 2*m_j+b) += h;
                 hessE(2*m_i+a, 2*m_j+b) -= h; hessE(2*m_j+a, 2*m_i+b) -= h; }",
        ],
    ),
    (
        "SpringForce.cpp",
        &[
            "scalar n[2], u[2], l = 0, s = 0;
             for (int a = 0; a < 2; ++a) { n[a] = x[2*m_i+a] - x[2*m_j+a]; u[a] = v[2*m_i+a] - v[2*m_j+a]; }
             l = std::hypot(n[0], n[1]); n[0] /= l; n[1] /= l; s = n[0] * u[0] + n[1] * u[1];
             for (int a = 0; a < 2; ++a) {
                 scalar g = (m_k * (l - m_l0) + m_b * s) * n[a];
                 gradE[2*m_i+a] += g; gradE[2*m_j+a] -= g; }",
            "scalar n[2], u[2], l = 0, s = 0;
             for (int a = 0; a < 2; ++a) { n[a] = x[2*m_i+a] - x[2*m_j+a]; u[a] = v[2*m_i+a] - v[2*m_j+a]; }
             l = std::hypot(n[0], n[1]); n[0] /= l; n[1] /= l; s = n[0] * u[0] + n[1] * u[1];
             for (int a = 0; a < 2; ++a) for (int b = 0; b < 2; ++b) {
                 scalar flat = (a == b) - n[a] * n[b];
                 scalar side = u[b] - s * n[b];
                 scalar h = m_k * (n[a] * n[b] + (l - m_l0) / l * flat) + m_b / l * (s * flat + n[a] * side);
                 hessE(2*m_i+a, 2*m_i+b) += h; hessE(2*m_j+a, 2*m_j+b) += h;
                 hessE(2*m_i+a, 2*m_j+b) -= h; hessE(2*m_j+a, 2*m_i+b) -= h; }",
            "scalar n[2] = {x[2*m_i] - x[2*m_j], x[2*m_i+1] - x[2*m_j+1]}, l = std::hypot(n[0], n[1]);
             for (int a = 0; a < 2; ++a) for (int b = 0; b < 2; ++b) {
                 scalar h = m_b * n[a] * n[b] / (l * l);
                 hessE(2*m_i+a, 2*m_i+b) += h; hessE(2*m_j+a, 2*m_j+b) += h;
                 hessE(2*m_i+a, 2*m_j+b) -= h; hessE(2*m_j+a, 2*m_i+b) -= h; }",
        ],
    ),
    ("LinearizedImplicitEuler.cpp", &[NEWTON]),
    ("ImplicitEuler.cpp", &[NEWTON]),
];

/// Newton's method on the velocities; with one iteration, the linearized step.
const NEWTON: &str = "
    VectorXs &x = scene.getX(), &v = scene.getV(), u = v;
    for (int iteration = 0; iteration < (LINEARIZED ? 1 : 100); ++iteration) {
        VectorXs dx(x.size()), dv(x.size()), b(x.size(), 0.0);
        for (std::size_t k = 0; k < x.size(); ++k) { dx[k] = dt * u[k]; dv[k] = u[k] - v[k]; }
        MatrixXs A(x.size()), K(x.size()), B(x.size());
        scene.accumulateGradU(b, dx, dv);
        scene.accumulateddUdxdx(K, dx, dv);
        scene.accumulateddUdxdv(B, dx, dv);
        for (std::size_t r = 0; r < x.size(); ++r) {
            b[r] = -dt * b[r] - scene.getM()[r] * dv[r];
            for (std::size_t c = 0; c < x.size(); ++c) {
                A(r, c) = dt * dt * K(r, c) + dt * B(r, c) + (r == c ? scene.getM()[r] : 0);
                if (scene.isFixed(r / 2) || scene.isFixed(c / 2)) A(r, c) = r == c;
            }
            if (scene.isFixed(r / 2)) b[r] = 0;
        }
        const VectorXs d = solve(A, b);
        scalar norm = 0;
        for (std::size_t k = 0; k < x.size(); ++k) { u[k] += d[k]; norm += d[k] * d[k]; }
        if (std::sqrt(norm) < 1e-9) break;
    }
    for (std::size_t k = 0; k < x.size(); ++k) { v[k] = u[k]; x[k] += dt * v[k]; }
    return true;";

/// Milestone 2 in Python.
const T1M2: Bodies = &[
    (
        "SimpleGravityForce.py",
        &["for k in range(len(x)):
            gradE[k] -= m[k] * (self.fx if k % 2 == 0 else self.fy)"],
    ),
    (
        "DragDampingForce.py",
        &["for k in range(len(x)):
            gradE[k] += self.b * v[k]"],
    ),
    (
        "GravitationalForce.py",
        &["i, j = 2 * self.i, 2 * self.j
        d = [x[j] - x[i], x[j + 1] - x[i + 1]]
        r = (d[0] ** 2 + d[1] ** 2) ** 0.5
        for a in range(2):
            g = self.G * m[i] * m[j] / r ** 3 * d[a]
            gradE[i + a] -= g
            gradE[j + a] += g"],
    ),
    (
        "SpringForce.py",
        &["i, j = 2 * self.i, 2 * self.j
        d = [x[i] - x[j], x[i + 1] - x[j + 1]]
        l = (d[0] ** 2 + d[1] ** 2) ** 0.5
        s = sum(d[a] / l * (v[i + a] - v[j + a]) for a in range(2))
        for a in range(2):
            g = (self.k * (l - self.l0) + self.b * s) * d[a] / l
            gradE[i + a] += g
            gradE[j + a] -= g"],
    ),
    (
        "SymplecticEuler.py",
        &["gradU = zeros(len(scene.x))
        scene.accumulateGradU(gradU)
        for k in range(len(scene.x)):
            if not scene.fixed[k // 2]:
                scene.v[k] -= dt * gradU[k] / scene.m[k]
            scene.x[k] += dt * scene.v[k]"],
    ),
];

/// The points earned and possible of a graded folder: required, and extra credit; and the verdicts that are no pass.
fn points(folder: &Path) -> ([(f64, f64); 2], BTreeSet<String>) {
    let mut grade = Command::new(GRADE);
    grade.arg(folder).args(["--format", "json", "--no-jacobians", "--root"]).arg(root());
    let output = grade.output().unwrap();
    let report: Value =
        serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{output:?}"));
    let number = |value: &Value| value.as_f64().unwrap_or(-1.0);
    let sum = |section: &str| {
        (number(&report[section]["points_earned"]), number(&report[section]["points"]))
    };
    let scenes = report["features"].as_array().unwrap().iter();
    let scenes = scenes.flat_map(|feature| feature["scenes"].as_array().unwrap());
    let verdicts = scenes.map(|scene| scene["verdict"].as_str().unwrap().to_owned());
    (["required", "extra_credit"].map(sum), verdicts.filter(|verdict| verdict != "pass").collect())
}

#[needs("test -x /usr/bin/c++ && test -x /usr/bin/python3")]
#[test]
fn sampled_skeleton_of_a_milestone_passes_once_it_is_filled_in() {
    assert_passes_once_filled_in(1);
}

#[needs("test -x /usr/bin/c++ && test -x /usr/bin/python3")]
#[test]
#[ignore = "long: a quarter of a minute"]
fn long_skeletons_of_milestones_pass_once_they_are_filled_in() {
    assert_passes_once_filled_in(usize::MAX);
}

/// Fills in so many skeletons.
fn assert_passes_once_filled_in(count: usize) {
    let skeletons = [
        (Language::Cpp, "t1m3", "notImplemented(", T1M3),
        (Language::Python, "t1m2", "not_implemented(", T1M2),
    ];
    for (language, assignment, stub, bodies) in sample(skeletons, count) {
        passes_once_filled_in(language, assignment, stub, bodies);
    }
}

/// A skeleton fails only with "not implemented", and passes everything once its stubs are filled in.
fn passes_once_filled_in(language: Language, assignment: &str, stub: &str, bodies: Bodies) {
    let folder = tempfile::tempdir().unwrap();
    let submission = folder.path().join("mine");
    let mut init = Command::new(GRADE);
    init.args(["init", language.name()]).arg(&submission).args(["--assignment", assignment]);
    assert!(init.arg("--root").arg(root()).output().unwrap().status.success());
    // Most of the time is the compiler's: it optimises nothing here.
    let manifest = submission.join("submission.toml");
    let text = std::fs::read_to_string(&manifest).unwrap();
    std::fs::write(&manifest, text.replace(" -O2 ", " -O0 ")).unwrap();
    let (points_before, verdicts) = points(&submission);
    assert_eq!(verdicts, BTreeSet::from(["not-implemented".to_owned()]), "{assignment}");
    assert!(points_before[0].0 < points_before[0].1);

    let mut files: BTreeSet<String> = BTreeSet::new();
    for (file, bodies) in bodies {
        let path = submission.join("FOSSSim").join(file);
        let text = std::fs::read_to_string(&path).unwrap();
        let mut bodies = bodies.iter();
        let filled = text.lines().map(|line| {
            let indent = &line[..line.len() - line.trim_start().len()];
            if line.trim_start().starts_with(stub) {
                format!("{indent}{}\n", bodies.next().unwrap())
            } else {
                format!("{line}\n")
            }
        });
        let filled: String = filled.collect();
        assert_eq!(bodies.next(), None, "{file}");
        let linearized = file.starts_with("Linearized").to_string();
        std::fs::write(&path, filled.replace("LINEARIZED", &linearized)).unwrap();
        files.insert((*file).to_owned());
    }
    // Every stub is one of these.
    for entry in std::fs::read_dir(submission.join("FOSSSim")).unwrap() {
        let path = entry.unwrap().path();
        let is_stub = std::fs::read_to_string(&path).unwrap().contains("your code here");
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        assert!(!is_stub || files.contains(&name), "{name}");
    }
    let ([required, extra], verdicts) = points(&submission);
    assert_eq!((required.0, extra.0), (required.1, extra.1), "{assignment}: {verdicts:?}");
    assert!(verdicts.is_empty() && required.1 > 0.0, "{verdicts:?}");
}
