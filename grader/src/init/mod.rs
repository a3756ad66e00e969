//! Skeletons of submissions, one for each language. Each documents the protocol in its comments and moves particles
//! without forces.

use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::submission::folder::MANIFEST;

/// The language of a skeleton.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Language {
    /// C++, with the standard library alone.
    Cpp,
    /// Python 3, with the standard library alone.
    Python,
    /// Rust, with the standard library alone.
    Rust,
}

impl Language {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Cpp, Self::Python, Self::Rust];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cpp => "cpp",
            Self::Python => "python",
            Self::Rust => "rust",
        }
    }

    /// The program that builds it, or runs it where nothing is built.
    pub fn tool(self) -> &'static str {
        match self {
            Self::Cpp => "c++",
            Self::Python => "python3",
            Self::Rust => "rustc",
        }
    }

    /// Arguments of `grade` that its build needs, if any.
    pub fn arguments(self) -> Option<&'static str> {
        // rustup keeps its toolchains in the home folder, which submissions may not read.
        (self == Self::Rust).then_some("--readable \"$(rustc --print sysroot)\"")
    }

    /// File name and text of the source.
    fn source(self) -> (&'static str, &'static str) {
        match self {
            Self::Cpp => ("simulate.cpp", include_str!("simulate.cpp")),
            Self::Python => ("simulate.py", include_str!("simulate.py")),
            Self::Rust => ("simulate.rs", include_str!("simulate.rs")),
        }
    }

    fn manifest(self) -> String {
        let (source, _) = self.source();
        let build = match self {
            Self::Cpp => {
                format!("[\"c++\", \"-O2\", \"-std=c++17\", \"-o\", \"simulate\", \"{source}\"]")
            }
            Self::Python => String::new(),
            Self::Rust => format!("[\"rustc\", \"-O\", \"-o\", \"simulate\", \"{source}\"]"),
        };
        let build = if build.is_empty() {
            "# No build is needed. If one were: build = [\"make\"]\n".to_owned()
        } else {
            format!(
                "# Runs in a copy of this folder before anything else. Optional.\n\
                 build = {build}\n"
            )
        };
        let program = match self {
            Self::Python => format!("\"python3\", \"{{folder}}/{source}\""),
            Self::Cpp | Self::Rust => "\"./simulate\"".to_owned(),
        };
        format!(
            "# The submission's manifest; docs/formats.md describes it.\n\n\
             name = \"my simulator\"\n\n{build}\n\
             # {{scene}} and {{trace}} are the files of a run, {{folder}} is this folder.\n\
             run = [{program}, \"{{scene}}\", \"{{trace}}\"]\n\n\
             # Format of the trace: \"csv\", or \"fosssim\", the course's binary.\n\
             format = \"csv\"\n"
        )
    }
}

/// Writes the skeleton into the folder, which is created if it is missing, and returns the files.
///
/// # Errors
/// If a file exists already, or cannot be written. Nothing is overwritten.
pub fn write(language: Language, folder: &Path) -> io::Result<Vec<PathBuf>> {
    fs::create_dir_all(folder)?;
    let (name, source) = language.source();
    let files = [(name, source.to_owned()), (MANIFEST, language.manifest())];
    let files = files.map(|(name, text)| (folder.join(name), text));
    if let Some((path, _)) = files.iter().find(|(path, _)| path.exists()) {
        let message = format!("{} already exists; nothing was written", path.display());
        return Err(io::Error::new(io::ErrorKind::AlreadyExists, message));
    }
    for (path, text) in &files {
        OpenOptions::new().write(true).create_new(true).open(path)?.write_all(text.as_bytes())?;
    }
    Ok(files.into_iter().map(|(path, _)| path).collect())
}
