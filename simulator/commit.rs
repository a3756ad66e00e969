//! For build scripts of programs, which include this file: tells the compiler the commit that a program is built from, if git
//! knows it, as `COMMIT`, and the version with it, as `VERSION`. Without git, or outside of the repository, the version stands alone.

use std::fs;
use std::process::Command;

/// The repository, from the folder of a program.
const ROOT: &str = "../..";

/// Paths, relative to the repository, that decide what is built.
const SOURCES: [&str; 4] = ["simulator", "grader", "Cargo.toml", "Cargo.lock"];

/// Tells the commit, and builds again where it changes.
pub(crate) fn tell() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed={ROOT}/simulator/commit.rs");
    let mut version = std::env::var("CARGO_PKG_VERSION").expect("the version of the program");
    if let Some(commit) = commit() {
        println!("cargo:rustc-env=COMMIT={commit}");
        version += &format!(" ({commit})");
    }
    println!("cargo:rustc-env=VERSION={version}");
}

/// The commit, and whether the sources differ from it.
fn commit() -> Option<String> {
    // Another repository may contain a copy of these sources.
    let is_ours = |top: &String| fs::canonicalize(top).ok() == fs::canonicalize(ROOT).ok();
    git(&["rev-parse", "--show-toplevel"]).filter(is_ours)?;
    let commit = git(&["rev-parse", "HEAD"])?;
    let status = ["-C", ROOT, "status", "--porcelain", "--"];
    let changes = git(&[&status[..], &SOURCES].concat())?;
    for path in SOURCES {
        println!("cargo:rerun-if-changed={ROOT}/{path}");
    }
    for name in ["HEAD", "logs/HEAD"] {
        let path = git(&["rev-parse", "--git-path", name]);
        // A path that does not exist would run this at every build.
        if let Some(path) = path.filter(|path| fs::exists(path).unwrap_or(false)) {
            println!("cargo:rerun-if-changed={path}");
        }
    }
    Some(if changes.is_empty() { commit } else { commit + "-modified" })
}

/// The output of a git command; `None` if it fails.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}
