//! Tells `grade` the commit that it is built from, if git knows it. Without git, or outside of the repository, it tells
//! nothing.
//!
//! Packs the scenes, the assignments, the rubric and the oracle into the program: one deflated sequence of files, each a line
//! with its path and its size, and its bytes. `src/installed.rs` extracts it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Paths, relative to the repository, that decide what is built.
const SOURCES: [&str; 4] = ["simulator", "grader", "Cargo.toml", "Cargo.lock"];

/// Paths, relative to the repository, that are packed.
const SUITE: [&str; 4] = ["assets", "extracreditassets", "expected", "docs/stability-expected.csv"];

fn main() {
    let root = Path::new("../..");
    println!("cargo:rerun-if-changed=build.rs");
    pack(root);
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

/// Packs the suite; nothing where it is not beside the source, as where a platform builds it.
fn pack(root: &Path) {
    let mut packed = Vec::new();
    let parts = SUITE.map(|part| root.join(part));
    for part in parts.clone().into_iter().filter(|_| parts.iter().all(|part| part.exists())) {
        println!("cargo:rerun-if-changed={}", part.display());
        for file in files(part) {
            let bytes = fs::read(&file).expect("a file of the suite");
            let path = file.strip_prefix(root).expect("a path of the repository");
            packed.extend(format!("{} {}\n", path.display(), bytes.len()).into_bytes());
            packed.extend(bytes);
        }
    }
    let folder = std::env::var_os("OUT_DIR").expect("the folder of the build");
    let deflated = miniz_oxide::deflate::compress_to_vec_zlib(&packed, 6);
    fs::write(Path::new(&folder).join("suite"), deflated).expect("a file of the build");
}

/// The files of a folder, or the file itself, in order.
fn files(path: PathBuf) -> Vec<PathBuf> {
    if path.is_file() {
        return vec![path];
    }
    let entries = fs::read_dir(path).expect("a folder of the suite");
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    paths.sort();
    paths.into_iter().flat_map(files).collect()
}

/// The output of a git command; `None` if it fails.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}
