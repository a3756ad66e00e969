//! The machine of the measurements.

use std::fs;
use std::process::Command;
use std::thread;

use crate::theirs::{Peers, output};

/// The head of the Markdown document.
pub(crate) fn describe(peers: &Peers) -> String {
    let told = |program: &str, arguments: &[&str]| {
        output(Command::new(program).args(arguments)).unwrap_or_else(|_| "unknown".into())
    };
    let cores = thread::available_parallelism().map_or_else(|_| "?".into(), |n| n.to_string());
    let [compiler, cholmod, python, pardiso, taichi, scikit_fem] = peers.versions();
    format!(
        "# Benchmarks\n\n\
         Written by `cargo bench -p simulator --bench peers -- --markdown FILE`. What is measured, and how:\n\
         `simulator/benches/README.md`. Ratios carry over to other machines, times do not.\n\n\
         | | |\n| --- | --- |\n\
         | date | {} |\n| processor | {} |\n| cores | {cores} |\n| load at the end | {} |\n| system | {} |\n| ours | {} |\n\
         | C++ peer | {compiler}, Eigen {} |\n| CHOLMOD peer | {cholmod} |\n| Python peer | {python} |\n\
         | PARDISO peer | {pardiso} |\n| Taichi peer | {taichi} |\n\
         | scikit-fem peer | {scikit_fem} |\n",
        told("date", &["-u", "+%Y-%m-%d"]),
        processor().unwrap_or_else(|| "unknown".into()),
        load().unwrap_or_else(|| "unknown".into()),
        system().unwrap_or_else(|| std::env::consts::OS.into()),
        told("rustc", &["--version"]),
        told("pkg-config", &["--modversion", "eigen3"]),
    )
}

fn processor() -> Option<String> {
    let text = fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

/// Processes that run or wait, on average over the last 15 minutes.
fn load() -> Option<String> {
    let text = fs::read_to_string("/proc/loadavg").ok()?;
    text.split_whitespace().nth(2).map(str::to_owned)
}

fn system() -> Option<String> {
    let text = fs::read_to_string("/etc/os-release").ok()?;
    let name = text.lines().find_map(|line| line.strip_prefix("PRETTY_NAME="))?;
    Some(name.trim_matches('"').to_owned())
}
