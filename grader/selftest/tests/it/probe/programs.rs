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

    /// The command of the program, or the reason why it cannot run.
    fn make(self, folder: &Path) -> Result<String, String> {
        let source =
            |name: &str| Path::new(env!("CARGO_MANIFEST_DIR")).join("src/programs").join(name);
        let (compiler, flags, source) = match self {
            Self::Cpp(flags) => ("c++", flags, source("student.cpp")),
            Self::C(flags) => ("cc", flags, source("student.c")),
            Self::Python => {
                let found = Command::new("python3")
                    .args(["-c", "import sys; print(sys.executable)"])
                    .output()
                    .map_err(|error| format!("python3: {error}"))?;
                let python = String::from_utf8_lossy(&found.stdout).trim().to_owned();
                if !found.status.success() || python.is_empty() {
                    return Err("python3 does not run".to_owned());
                }
                return Ok(format!("'{python}' -S -E '{}'", source("student.py").display()));
            }
        };
        let name: String = flags.iter().flat_map(|flag| flag.chars()).collect();
        let name: String =
            name.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
        let program = folder.join(format!("{compiler}{name}"));
        let made = Command::new(compiler)
            .args(flags)
            .arg("-o")
            .arg(&program)
            .arg(source)
            .arg("-lm")
            .output()
            .map_err(|error| format!("{compiler}: {error}"))?;
        if !made.status.success() {
            let said = String::from_utf8_lossy(&made.stderr);
            return Err(format!("{compiler} {flags:?}: {said}"));
        }
        Ok(format!("'{}'", program.display()))
    }
}

/// A program that the test probes: a build and its environment.
#[derive(Debug, Clone)]
pub(crate) struct Variant {
    pub(crate) build: Build,
    pub(crate) environment: Vec<(&'static str, &'static str)>,
}

/// A folder with one script per variant, and the reasons for missing builds.
pub(crate) struct Workshop {
    scripts: Vec<Result<PathBuf, String>>,
}

impl Workshop {
    pub(crate) fn new(name: &str, variants: &[Variant]) -> Self {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        fs::create_dir_all(&folder).expect("a folder below target");
        let mut made: Vec<(Build, Result<String, String>)> = Vec::new();
        for variant in variants {
            if !made.iter().any(|(build, _)| *build == variant.build) {
                made.push((variant.build, variant.build.make(&folder)));
            }
        }
        let script = |(number, variant): (usize, &Variant)| {
            let known = made.iter().find(|(build, _)| *build == variant.build);
            let program = known.expect("every build was made").1.clone()?;
            let mut text = "#!/bin/sh\n".to_owned();
            for (name, value) in &variant.environment {
                let value = value.replace('\'', r"'\''");
                let _ = writeln!(text, "export {name}='{value}'");
            }
            let _ = writeln!(text, "exec {program} \"$@\"");
            let path = folder.join(format!("variant{number}"));
            fs::write(&path, text).expect("a script can be written");
            fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("permissions");
            Ok(path)
        };
        Self { scripts: variants.iter().enumerate().map(script).collect() }
    }

    /// The program of the variant with this number; `None`, with a printed reason, if it cannot be built.
    #[expect(clippy::print_stderr, reason = "a test that is skipped says why")]
    pub(crate) fn program(&self, number: usize) -> Option<&Path> {
        match &self.scripts[number] {
            Ok(path) => Some(path),
            Err(reason) => {
                eprintln!("skipped: {reason}");
                None
            }
        }
    }
}
