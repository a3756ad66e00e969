//! Benchmark of a class: time and memory by number of submissions. See grader/benches/README.md.
//!
//! Does not use criterion: one run takes minutes, and memory matters as well as time.

#![expect(clippy::print_stdout, reason = "the table is what it is for")]
#![expect(clippy::print_stderr, reason = "it takes minutes: what is done is told meanwhile")]

use std::fmt::Write as _;
use std::fs::{self, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Interval between memory samples.
const PAUSE: Duration = Duration::from_millis(50);

/// Default numbers of submissions.
const COUNTS: [usize; 3] = [1, 10, 100];

/// Cost of one run.
struct Cost {
    submissions: usize,
    seconds: f64,
    /// The grader's own peak, in MiB.
    own: f64,
    /// The largest sampled sum over the grader and its descendants, in MiB.
    tree: f64,
}

fn main() {
    let mut counts = Vec::new();
    let (mut markdown, mut options) = (None, Vec::new());
    let mut titles = vec![("right ones", false), ("a tenth fails, a tenth spins", true)];
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            // Passed by cargo.
            "--bench" => {}
            "--markdown" => markdown = arguments.next().map(PathBuf::from),
            "--no-jacobians" => options.push(argument),
            "--assignment" => options.extend([argument].into_iter().chain(arguments.next())),
            "--right" => titles.retain(|(_, mixed)| !mixed),
            "--mixed" => titles.retain(|(_, mixed)| *mixed),
            count => counts.push(count.parse().expect("a number of submissions")),
        }
    }
    if counts.is_empty() {
        counts.extend(COUNTS);
    }
    let mut text = String::new();
    for (title, mixed) in titles {
        let costs: Vec<Cost> = counts
            .iter()
            .filter(|count| !mixed || **count >= 10)
            .map(|count| measure(*count, mixed, &options))
            .collect();
        text += &table(title, &costs);
    }
    println!("{text}");
    if let Some(path) = markdown {
        fs::write(path, text).expect("the table can be written");
    }
}

fn table(title: &str, costs: &[Cost]) -> String {
    let mut text = format!(
        "\n### Submissions: {title}\n\n| submissions | s | s each | grader, MiB | with its programs, MiB |\n\
         | ---: | ---: | ---: | ---: | ---: |\n"
    );
    for Cost { submissions, seconds, own, tree } in costs {
        let each = seconds / *submissions as f64;
        let _ =
            writeln!(text, "| {submissions} | {seconds:.1} | {each:.2} | {own:.1} | {tree:.1} |");
    }
    for pair in costs.windows(2) {
        let [less, more] = pair else { continue };
        let growth = |of: fn(&Cost) -> f64| {
            (of(more) / of(less)).ln() / (more.submissions as f64 / less.submissions as f64).ln()
        };
        let _ = writeln!(
            text,
            "\ngrowth exponent, {} to {}: time {:.2}, the grader's memory {:.2}, that with its programs {:.2}",
            less.submissions,
            more.submissions,
            growth(|cost| cost.seconds),
            growth(|cost| cost.own),
            growth(|cost| cost.tree),
        );
    }
    text
}

/// Grades a class of this many submissions (copies of `simulate`, or other programs too) on the shipped scenes.
fn measure(count: usize, mixed: bool, options: &[String]) -> Cost {
    let grade = Path::new(env!("CARGO_BIN_EXE_grade"));
    let simulate = grade.with_file_name("simulate");
    assert!(
        simulate.is_file(),
        "{} is missing; build it with `cargo build --release -p simulate`",
        simulate.display()
    );
    let folder = tempfile::tempdir().expect("a folder");
    let class = folder.path().join("class");
    fs::create_dir(&class).expect("a folder");
    for number in 0..count {
        let path = class.join(format!("{number:03}"));
        let script = match number % 10 {
            3 if mixed => Some("#!/bin/sh\nexit 1\n"),
            7 if mixed => Some("#!/bin/sh\nwhile :; do :; done\n"),
            _ => None,
        };
        match script {
            None => {
                fs::copy(&simulate, &path).expect("a copy");
                // Equal submissions would be graded once. Nothing reads what follows a program.
                let mut copy = OpenOptions::new().append(true).open(&path).expect("the copy");
                writeln!(copy, "{number}").expect("the copy");
            }
            Some(script) => {
                fs::write(&path, script).expect("a script");
                let as_program = fs::metadata(&simulate).expect("permissions").permissions();
                fs::set_permissions(&path, as_program).expect("permissions");
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let started = Instant::now();
    let mut grader = Command::new(grade)
        .arg("class")
        .arg(&class)
        .arg("-o")
        .arg(folder.path().join("out"))
        .arg("--root")
        .arg(root)
        .args(["--limit", "cpu=1", "--no-progress"])
        .args(options)
        .stdout(Stdio::null())
        .spawn()
        .expect("grade starts");
    let (mut own, mut tree) = (0, 0);
    let status = loop {
        if let Some(status) = grader.try_wait().expect("grade can be waited for") {
            break status;
        }
        // The peak only grows, so the last sample is accurate except for the final moment.
        own = own.max(kibibytes(grader.id(), "VmHWM:"));
        tree = tree.max(of_tree(grader.id()));
        std::thread::sleep(PAUSE);
    };
    let seconds = started.elapsed().as_secs_f64();
    assert!(status.success(), "grade class ended with {status}");
    eprintln!("{count} submissions: {seconds:.1} s");
    let mebibytes = |kibibytes: u64| kibibytes as f64 / 1024.0;
    Cost { submissions: count, seconds, own: mebibytes(own), tree: mebibytes(tree) }
}

/// A number of `/proc/PROCESS/status`; 0 if the process has ended.
fn kibibytes(process: u32, field: &str) -> u64 {
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix(field));
    line.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or(0)
}

/// Resident memory of a process and its descendants. Pages shared by two processes count twice.
fn of_tree(root: u32) -> u64 {
    let (mut sum, mut processes) = (0, vec![root]);
    while let Some(process) = processes.pop() {
        sum += kibibytes(process, "VmRSS:");
        let threads = fs::read_dir(format!("/proc/{process}/task")).into_iter().flatten().flatten();
        for thread in threads {
            let children = fs::read_to_string(thread.path().join("children")).unwrap_or_default();
            processes
                .extend(children.split_whitespace().filter_map(|child| child.parse::<u32>().ok()));
        }
    }
    sum
}
