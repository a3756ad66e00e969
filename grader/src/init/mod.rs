//! Skeletons of submissions, one a language. Each documents the protocol in its comments, and moves particles
//! on which no force acts.

use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::submission::folder::MANIFEST;

/// A language that there is a skeleton in.
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

    /// Its name, as on the command line.
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

    /// What has to be said to have it built, beside its folder's name, if anything.
    pub fn arguments(self) -> Option<&'static str> {
        // rustup keeps its toolchains in the home folder, which no submission may read.
        (self == Self::Rust).then_some("--readable \"$(rustc --print sysroot)\"")
    }

    /// What the source is called, and what it says.
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
            "# Nothing is built. If something were: build = [\"make\"]\n".to_owned()
        } else {
            format!(
                "# Run in a copy of this folder, before anything else. Leave it out if nothing is built.\n\
                 build = {build}\n"
            )
        };
        let program = match self {
            Self::Python => format!("\"python3\", \"{{folder}}/{source}\""),
            Self::Cpp | Self::Rust => "\"./simulate\"".to_owned(),
        };
        format!(
            "# What `grade` has to know of this submission; docs/formats.md says more.\n\n\
             name = \"my simulator\"\n\n{build}\n\
             # {{scene}} and {{trace}} are the files of a run, {{folder}} is this folder.\n\
             run = [{program}, \"{{scene}}\", \"{{trace}}\"]\n\n\
             # Of the trace: \"csv\", or \"fosssim\", the course's binary.\n\
             format = \"csv\"\n"
        )
    }
}

/// Writes the skeleton into the folder, which is made where it is missing, and returns the files.
///
/// # Errors
/// Where a file is already there, or cannot be written. Nothing is overwritten.
pub fn write(language: Language, folder: &Path) -> io::Result<Vec<PathBuf>> {
    fs::create_dir_all(folder)?;
    let (name, source) = language.source();
    let files = [(name, source.to_owned()), (MANIFEST, language.manifest())];
    let files = files.map(|(name, text)| (folder.join(name), text));
    if let Some((path, _)) = files.iter().find(|(path, _)| path.exists()) {
        let message = format!("{} is already there; nothing was written", path.display());
        return Err(io::Error::new(io::ErrorKind::AlreadyExists, message));
    }
    for (path, text) in &files {
        OpenOptions::new().write(true).create_new(true).open(path)?.write_all(text.as_bytes())?;
    }
    Ok(files.into_iter().map(|(path, _)| path).collect())
}
