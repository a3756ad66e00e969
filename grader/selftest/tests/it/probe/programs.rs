//! Builds and wrappers of the fixtures in `src/programs/`.
//!
//! A wrapper is a shell script that sets the environment of one build to select a mistake or a solver. All scripts are
//! written before any program starts, because a file open for writing cannot be executed.

use std::fmt::Write as _;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

/// One build of a fixture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Build {
    /// `student.cpp` with these flags.
    Cpp(&'static [&'static str]),
    /// `student.c` with these flags.
    C(&'static [&'static str]),
    /// `student.py`.
    Python,
}

impl Build {
    pub(crate) fn language(self) -> &'static str {
        match self {
            Self::Cpp(_) => "C++",
            Self::C(_) => "C",
            Self::Python => "Python",
        }
    }

    /// Builds the program, and returns its command.
    fn make(self, folder: &Path) -> String {
        let source =
            |name: &str| Path::new(env!("CARGO_MANIFEST_DIR")).join("src/programs").join(name);
        let (compiler, flags, source) = match self {
            Self::Cpp(flags) => ("c++", flags, source("student.cpp")),
            Self::C(flags) => ("cc", flags, source("student.c")),
            Self::Python => return format!("python3 -S -E '{}'", source("student.py").display()),
        };
        let name: String = flags.iter().flat_map(|flag| flag.chars()).collect();
        let name: String =
            name.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
        let program = folder.join(format!("{compiler}{name}"));
        let mut command = Command::new(compiler);
        command.args(flags).arg("-o").arg(&program).arg(source).arg("-lm");
        let made = command.output().expect("a compiler");
        assert!(made.status.success(), "{flags:?}: {}", String::from_utf8_lossy(&made.stderr));
        format!("'{}'", program.display())
    }
}

/// A program that the test probes: a build and its environment.
#[derive(Debug, Clone)]
pub(crate) struct Variant {
    pub(crate) build: Build,
    pub(crate) environment: Vec<(&'static str, &'static str)>,
}

/// Builds the variants, and writes a script for each.
pub(crate) fn scripts(name: &str, variants: &[Variant]) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(&folder).expect("a folder below target");
    let mut made: Vec<(Build, String)> = Vec::new();
    let mut paths = Vec::new();
    for (number, variant) in variants.iter().enumerate() {
        if !made.iter().any(|(build, _)| *build == variant.build) {
            made.push((variant.build, variant.build.make(&folder)));
        }
        let (_, program) = made.iter().find(|(build, _)| *build == variant.build).unwrap();
        let mut text = "#!/bin/sh\n".to_owned();
        for (name, value) in &variant.environment {
            let value = value.replace('\'', r"'\''");
            let _ = writeln!(text, "export {name}='{value}'");
        }
        let _ = writeln!(text, "exec {program} \"$@\"");
        let path = folder.join(format!("variant{number}"));
        fs::write(&path, text).expect("a script can be written");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("permissions");
        paths.push(path);
    }
    paths
}
