//! Tells `grade` the commit that it is built from, if git knows it. Without git, or outside of the repository, it tells
//! nothing.

use std::fs;
use std::path::Path;
use std::process::Command;

/// Paths, relative to the repository, that decide what is built.
const SOURCES: [&str; 4] = ["simulator", "grader", "Cargo.toml", "Cargo.lock"];

fn main() {
    let root = Path::new("../..");
    println!("cargo:rerun-if-changed=build.rs");
    // Another repository may contain a copy of these sources.
    let is_ours = |top: &String| fs::canonicalize(top).ok() == fs::canonicalize(root).ok();
    let Some(_) = git(&["rev-parse", "--show-toplevel"]).filter(is_ours) else { return };
    let Some(commit) = git(&["rev-parse", "HEAD"]) else { return };
    let status = ["-C", "../..", "status", "--porcelain", "--"];
    let Some(changes) = git(&[&status[..], &SOURCES].concat()) else { return };
    let modified = if changes.is_empty() { "" } else { "-modified" };
    println!("cargo:rustc-env=GRADE_COMMIT={commit}{modified}");
    for path in SOURCES {
        println!("cargo:rerun-if-changed=../../{path}");
    }
    for name in ["HEAD", "logs/HEAD"] {
        let path = git(&["rev-parse", "--git-path", name]);
        // A path that does not exist would run this at every build.
        if let Some(path) = path.filter(|path| Path::new(path).exists()) {
            println!("cargo:rerun-if-changed={path}");
        }
    }
}

/// The output of a git command; `None` if it fails.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}
