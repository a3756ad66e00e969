//! Programs in students' languages build and run in the sandbox, and pass.
//!
//! Each builds with the tools of its language and simulates free particles by explicit Euler.

use needs::needs;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use test_support::FREE_PARTICLE;

const GRADE: &str = env!("CARGO_BIN_EXE_grade");

/// In C and C++; `PARALLEL` precedes the loop over particles.
const C: &str = r#"#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
static double number(const char *text, const char *name) {
    const char *found = strstr(text, name);
    return found ? atof(found + strlen(name)) : 0;
}
int main(int count, char **arguments) {
    static char text[1 << 16];
    double x[1000][4];
    int many = 0;
    FILE *scene = fopen(arguments[1], "r"), *trace = fopen(arguments[2], "w");
    if (count < 3 || !scene || !trace) return 1;
    text[fread(text, 1, sizeof text - 1, scene)] = 0;
    double duration = number(text, "time=\""), step = number(text, "dt=\"");
    for (char *at = text; (at = strstr(at, "<particle")) && many < 1000; ++at, ++many) {
        x[many][0] = number(at, "px=\""), x[many][1] = number(at, "py=\"");
        x[many][2] = number(at, "vx=\""), x[many][3] = number(at, "vy=\"");
    }
    fprintf(trace, "step,time");
    for (int k = 0; k < many; ++k) fprintf(trace, ",x%d,y%d,vx%d,vy%d", k, k, k, k);
    for (int n = 0; n <= (int)ceil(duration / step); ++n) {
        fprintf(trace, "\n%d,%.17g", n, n * step);
        for (int k = 0; k < many; ++k) fprintf(trace, ",%.17g,%.17g,%.17g,%.17g", x[k][0], x[k][1], x[k][2], x[k][3]);
        PARALLEL
        for (int k = 0; k < many; ++k) {
            x[k][0] += step * x[k][2];
            x[k][1] += step * x[k][3];
        }
    }
    fprintf(trace, "\n");
    return fclose(trace);
}
"#;

const JAVA: &str = r#"import java.nio.file.*;
import java.util.*;
import java.util.concurrent.*;
import java.util.regex.*;
public class Simulate {
    static double number(String text, String name) {
        Matcher found = Pattern.compile("\\b" + name + "=\"([^\"]*)\"").matcher(text);
        return found.find() ? Double.parseDouble(found.group(1)) : 0;
    }
    public static void main(String[] arguments) throws Exception {
        String text = Files.readString(Path.of(arguments[0]));
        double duration = number(text, "time"), step = number(text, "dt");
        List<double[]> particles = new ArrayList<>();
        Matcher tags = Pattern.compile("<particle[^>]*>").matcher(text);
        while (tags.find()) {
            String tag = tags.group();
            particles.add(new double[] {number(tag, "px"), number(tag, "py"), number(tag, "vx"), number(tag, "vy")});
        }
        ExecutorService threads = Executors.newFixedThreadPool(2);
        StringBuilder trace = new StringBuilder("step,time");
        for (int k = 0; k < particles.size(); ++k) trace.append(String.format(",x%d,y%d,vx%d,vy%d", k, k, k, k));
        for (int n = 0; n <= (int) Math.ceil(duration / step); ++n) {
            trace.append("\n" + n + "," + n * step);
            List<Future<?>> done = new ArrayList<>();
            for (double[] x : particles) {
                trace.append("," + x[0] + "," + x[1] + "," + x[2] + "," + x[3]);
                done.add(threads.submit(() -> { x[0] += step * x[2]; x[1] += step * x[3]; }));
            }
            for (Future<?> one : done) one.get();
        }
        threads.shutdown();
        Files.writeString(Path.of(arguments[1]), trace + "\n");
    }
}
"#;

const NODE: &str = r#"const fs = require("fs");
const { Worker, isMainThread, parentPort } = require("worker_threads");
if (!isMainThread) {
  parentPort.postMessage("ready");
} else {
  const [scene, trace] = process.argv.slice(2);
  const text = fs.readFileSync(scene, "utf8");
  const number = (tag, name) => parseFloat((tag.match(new RegExp("\\b" + name + '="([^"]*)"')) || [0, "0"])[1]);
  const duration = number(text, "time"), step = number(text, "dt");
  const x = [...text.matchAll(/<particle[^>]*>/g)].map(([tag]) => ["px", "py", "vx", "vy"].map((name) => number(tag, name)));
  let out = "step,time" + x.map((_, k) => `,x${k},y${k},vx${k},vy${k}`).join("");
  for (let n = 0; n <= Math.ceil(duration / step); ++n) {
    out += `\n${n},${n * step}` + x.map((p) => "," + p.join(",")).join("");
    for (const p of x) { p[0] += step * p[2]; p[1] += step * p[3]; }
  }
  new Worker(__filename).on("message", () => fs.promises.writeFile(trace, out + "\n"));
}
"#;

/// `STEP` is the code that moves the list of particles.
const PYTHON: &str = r#"import math, sys
import xml.etree.ElementTree as ElementTree
IMPORTS
def moved(particle):
    x, y, vx, vy, dt = particle
    return [x + dt * vx, y + dt * vy, vx, vy]
def main():
    root = ElementTree.parse(sys.argv[1]).getroot()
    duration = float(root.find("duration").get("time"))
    dt = float(root.find("integrator").get("dt"))
    state = [[float(p.get(name)) for name in ("px", "py", "vx", "vy")] for p in root.findall("particle")]
    with open(sys.argv[2], "w") as trace:
        print("step,time", *[f"x{i},y{i},vx{i},vy{i}" for i in range(len(state))], sep=",", file=trace)
        for number in range(math.ceil(duration / dt) + 1):
            print(number, number * dt, *[repr(float(value)) for row in state for value in row], sep=",", file=trace)
            STEP
if __name__ == "__main__":
    main()
"#;

fn python(imports: &str, step: &str) -> String {
    PYTHON.replace("IMPORTS", imports).replace("STEP", step)
}

/// A folder with a suite of one scene.
struct Suite {
    root: tempfile::TempDir,
}

impl Suite {
    fn new() -> Self {
        let root = tempfile::tempdir().unwrap();
        fs::create_dir_all(root.path().join("assets/Free")).unwrap();
        fs::write(root.path().join("assets/Free/one.xml"), FREE_PARTICLE).unwrap();
        let mut regenerate = Command::new(GRADE);
        let made = regenerate.args(["oracle", "regenerate", "--root"]).arg(root.path()).output();
        assert!(made.unwrap().status.success());
        Self { root }
    }

    /// Grades a submission of these files, which must pass.
    fn pass(&self, name: &str, files: &[(&str, &str)], options: &[&str]) {
        let folder = self.root.path().join(name);
        fs::create_dir(&folder).unwrap();
        write(&folder, files);
        self.pass_folder(name, &folder, options);
    }

    fn pass_folder(&self, name: &str, folder: &Path, options: &[&str]) {
        let mut grade = Command::new(GRADE);
        grade.arg(folder).args(options).args(["--no-jacobians", "--root"]).arg(self.root.path());
        let graded = grade.output().unwrap();
        let printed = String::from_utf8_lossy(&graded.stdout).into_owned();
        let errors = String::from_utf8_lossy(&graded.stderr).into_owned();
        assert_eq!(graded.status.code(), Some(0), "{name}:\n{printed}\n{errors}");
    }
}

fn write(folder: &Path, files: &[(&str, &str)]) {
    for (file, text) in files {
        fs::write(folder.join(file), text).unwrap();
    }
}

fn manifest(build: &[&str], run: &[&str]) -> String {
    let run = [run, &["{scene}", "{trace}"]].concat();
    let build = if build.is_empty() { String::new() } else { format!("build = {build:?}\n") };
    format!("{build}run = {run:?}\n")
}

#[test]
fn gcc_runs_in_the_sandbox() {
    let source = C.replace("PARALLEL", "");
    let build = manifest(&["cc", "-O2", "-o", "simulate", "simulate.c", "-lm"], &["./simulate"]);
    Suite::new().pass("c", &[("simulate.c", &source), ("submission.toml", &build)], &[]);
}

#[needs("command -v gcc")]
/// Without a library, a reader finds attributes by their text.
#[test]
fn files_that_a_program_misreads_are_said_to_be() {
    let source = C.replace("PARALLEL", "");
    let build = manifest(&["cc", "-O2", "-o", "simulate", "simulate.c", "-lm"], &["./simulate"]);
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), &[("simulate.c", &source), ("submission.toml", &build)]);
    let run = Command::new(GRADE)
        .current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
        .arg(folder.path())
        .args(["--only", "Inertia/another-hand-symplectic", "--no-progress"])
        .output()
        .unwrap();
    let text = String::from_utf8(run.stdout).unwrap();
    let words: Vec<&str> = text.split_whitespace().collect();
    let finding = "reading the scene: attributes in single quotes, and white space around = or line breaks inside a tag, \
                   and comments are misread; the same scenes are read from plain files (1 scene)";
    assert!(words.join(" ").contains(finding), "{text}");
}

#[test]
fn openmp_runs_in_the_sandbox() {
    let source = C.replace("PARALLEL", "#pragma omp parallel for");
    let build = ["gcc", "-O2", "-fopenmp", "-o", "simulate", "simulate.c", "-lm"];
    let build = manifest(&build, &["./simulate"]);
    Suite::new().pass("openmp", &[("simulate.c", &source), ("submission.toml", &build)], &[]);
}

#[needs("command -v make && command -v ar")]
#[test]
fn parallel_make_runs_in_the_sandbox() {
    let source = C.replace("PARALLEL", "");
    let rules = "simulate: simulate.o libother.a\n\tcc -o $@ $^ -lm\nlibother.a: other.o\n\tar rcs $@ $^\n\
                 %.o: %.c\n\tcc -O2 -c -o $@ $<\n";
    let files = [
        ("simulate.c", source.as_str()),
        ("other.c", "int other;\n"),
        ("Makefile", rules),
        ("submission.toml", &manifest(&["make", "-j2"], &["./simulate"])),
    ];
    Suite::new().pass("make", &files, &[]);
}

const CMAKE: &str = "cmake_minimum_required(VERSION 3.10)\nproject(simulate CXX)\n\
                     add_executable(simulate simulate.cpp)\n";

#[needs("command -v cmake && command -v ninja && command -v c++")]
#[test]
fn cmake_and_ninja_run_in_the_sandbox() {
    let build = "set -e; cmake -G Ninja -B out -DCMAKE_BUILD_TYPE=Release .; cmake --build out";
    let files = [
        ("simulate.cpp", C.replace("PARALLEL", "")),
        ("CMakeLists.txt", CMAKE.to_owned()),
        ("submission.toml", manifest(&["sh", "-c", build], &["./out/simulate"])),
    ];
    let files = files.each_ref().map(|(name, text)| (*name, text.as_str()));
    Suite::new().pass("cmake", &files, &[]);
}

#[needs("command -v cmake && command -v make && command -v ccache && command -v c++")]
#[test]
fn ccache_runs_in_the_sandbox() {
    // Twice, so that the second run uses the cache.
    let build = "set -e; cmake -B out -DCMAKE_CXX_COMPILER_LAUNCHER=ccache .; cmake --build out; \
                 cmake --build out --target clean; cmake --build out";
    let files = [
        ("simulate.cpp", C.replace("PARALLEL", "")),
        ("CMakeLists.txt", CMAKE.to_owned()),
        ("submission.toml", manifest(&["sh", "-c", build], &["./out/simulate"])),
    ];
    let files = files.each_ref().map(|(name, text)| (*name, text.as_str()));
    Suite::new().pass("ccache", &files, &[]);
}

#[needs("command -v javac && command -v java")]
#[test]
fn java_runs_in_the_sandbox() {
    let run = ["java", "-cp", "{folder}", "Simulate"];
    let build = manifest(&["javac", "Simulate.java"], &run);
    Suite::new().pass("java", &[("Simulate.java", JAVA), ("submission.toml", &build)], &[]);
}

#[needs("command -v node")]
#[test]
fn node_runs_in_the_sandbox() {
    let run = manifest(&[], &["node", "simulate.js"]);
    Suite::new().pass("node", &[("simulate.js", NODE), ("submission.toml", &run)], &[]);
}

/// The Python interpreter, and the folders that it needs for imports.
fn pass_python(name: &str, program: &str, imports: &str, step: &str) {
    let source = python(imports, step);
    let run = manifest(&[], &[program, "{folder}/simulate.py"]);
    Suite::new().pass(name, &[("simulate.py", &source), ("submission.toml", &run)], &[]);
}

#[needs("/usr/bin/python3 -c 'import numpy'")]
#[test]
fn numpy_runs_in_the_sandbox() {
    let step = "array = numpy.array(state); array[:, :2] += dt * array[:, 2:]; \
                numpy.linalg.solve(numpy.eye(4), numpy.ones(4)); state = array.tolist()";
    pass_python("numpy", "/usr/bin/python3", "import numpy", step);
}

/// A virtual environment inside the hand-in.
#[needs("/usr/bin/python3 -c 'import venv, ensurepip'")]
#[test]
fn python_virtual_environment_runs_in_the_sandbox() {
    let suite = Suite::new();
    let folder: PathBuf = suite.root.path().join("venv");
    fs::create_dir(&folder).unwrap();
    let made = Command::new("/usr/bin/python3")
        .args(["-m", "venv", "--without-pip", "--system-site-packages"])
        .arg(folder.join("environment"))
        .status();
    assert!(made.unwrap().success());
    let step = "state = [moved(row + [dt]) for row in state]";
    fs::write(folder.join("simulate.py"), python("", step)).unwrap();
    let run = manifest(&[], &["./environment/bin/python", "{folder}/simulate.py"]);
    fs::write(folder.join("submission.toml"), run).unwrap();
    suite.pass_folder("venv", &folder, &[]);
}

#[needs("test -x /usr/bin/python3")]
#[test]
fn python_multiprocessing_runs_in_the_sandbox() {
    let imports = "import multiprocessing\nfrom multiprocessing import shared_memory";
    let pool = "pool = multiprocessing.Pool(2); state = pool.map(moved, [row + [dt] for row in state]); \
                pool.close(); pool.join()";
    pass_python("pool", "/usr/bin/python3", imports, pool);
    let queue = "queue = multiprocessing.Queue(); \
                 child = multiprocessing.Process(target=queue.put, args=([moved(row + [dt]) for row in state],)); \
                 child.start(); state = queue.get(); child.join()";
    pass_python("queue", "/usr/bin/python3", imports, queue);
    let memory = "memory = shared_memory.SharedMemory(create=True, size=64); memory.buf[0] = 1; memory.close(); \
                  memory.unlink(); state = [moved(row + [dt]) for row in state]";
    pass_python("shared-memory", "/usr/bin/python3", imports, memory);
}
