//! Skeletons of submissions, one for each language and scene format. Each documents the protocol in its comments. Those
//! for XML move particles without forces; those for JSON hold every vertex at rest.
//!
//! The words `ELEMENTS`, `FORCES` and `METHODS` in a skeleton stand for what its assignment asks for.

use std::collections::BTreeSet;
use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use simulator::scene::schema::{ActsOn, ForceSchema};
use simulator::vocabulary;

use crate::assignment::Assignment;
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

    /// The file name of the source.
    fn source(self) -> &'static str {
        match self {
            Self::Cpp => "simulate.cpp",
            Self::Python => "simulate.py",
            Self::Rust => "simulate.rs",
        }
    }

    /// The text of the source.
    fn text(self, reads_json: bool) -> &'static str {
        match (self, reads_json) {
            (Self::Cpp, false) => include_str!("simulate.cpp"),
            (Self::Python, false) => include_str!("simulate.py"),
            (Self::Rust, false) => include_str!("simulate.rs"),
            (Self::Cpp, true) => include_str!("springs.cpp"),
            (Self::Python, true) => include_str!("springs.py"),
            (Self::Rust, true) => include_str!("springs.rs"),
        }
    }

    fn manifest(self, assignment: Option<&Assignment>) -> String {
        let source = self.source();
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
        let (solver, about) = match reads_json(assignment) {
            true => (", \"{solver}\"", "; {solver} is dense or sparse"),
            false => ("", ""),
        };
        let assignment = match assignment {
            Some(Assignment { name, .. }) => {
                format!(
                    "\n# The assignment to grade; `grade assignments` lists them.\nassignment = \"{name}\"\n"
                )
            }
            None => String::new(),
        };
        format!(
            "# The submission's manifest; docs/formats.md describes it.\n\n\
             name = \"my simulator\"\n\n{build}\n\
             # {{scene}} and {{trace}} are the files of a run, {{folder}} is this folder{about}.\n\
             run = [{program}, \"{{scene}}\", \"{{trace}}\"{solver}]\n\n\
             # Format of the trace: \"csv\", or \"fosssim\", the course's binary.\n\
             format = \"csv\"\n{assignment}"
        )
    }
}

/// Whether the scenes of the assignment are JSON files.
pub fn reads_json(assignment: Option<&Assignment>) -> bool {
    let formats = assignment.and_then(|assignment| assignment.scope().formats.as_ref());
    formats.is_some_and(|formats| formats == &["json"])
}

/// The text of a skeleton, with the elements, forces and methods of the assignment; without one, examples.
fn filled(text: &str, assignment: Option<&Assignment>) -> String {
    let [mut elements, mut forces, mut methods] = [
        "<simplegravity fx fy/>, <edge i j/>, <springforce edge k l0 b/>, ...",
        "gravity, springs, drag, ...",
        "the other methods, by scene.method",
    ]
    .map(str::to_owned);
    let vocabulary = vocabulary();
    let scope = assignment.map(Assignment::scope);
    if let Some(tags) = scope.and_then(|scope| scope.forces.as_ref()) {
        let schemas: Vec<&ForceSchema> =
            tags.iter().filter_map(|tag| vocabulary.force(tag)).collect();
        let has_edges = schemas.iter().any(|schema| schema.acts_on == ActsOn::Edge);
        let edge = has_edges.then(|| "<edge i j/>".to_owned());
        let all: Vec<String> =
            edge.into_iter().chain(schemas.iter().map(|schema| tag(schema))).collect();
        elements = all.join(", ");
        let titles: Vec<String> =
            schemas.iter().map(|schema| schema.title.to_lowercase()).collect();
        forces = titles.join(", ");
    }
    if let Some(spellings) = scope.and_then(|scope| scope.integrators.as_ref()) {
        let others: BTreeSet<&str> = spellings.iter().map(String::as_str).collect();
        let others: Vec<&str> =
            others.into_iter().filter(|spelling| *spelling != "explicit-euler").collect();
        methods = match others.as_slice() {
            [] => "nothing more, scene.method is explicit-euler".to_owned(),
            others => format!("{}, by scene.method", others.join(", ")),
        };
    }
    text.replace("ELEMENTS", &elements).replace("FORCES", &forces).replace("METHODS", &methods)
}

/// An element of a force with the names of its attributes, as `<springforce edge k l0 b/>`.
fn tag(schema: &ForceSchema) -> String {
    let ends: &[&str] = match schema.acts_on {
        ActsOn::EveryParticle => &[],
        ActsOn::Pair => &["i", "j"],
        ActsOn::Edge => &["edge"],
    };
    let parameters = schema.parameters.iter().filter(|parameter| !parameter.three_dimensional);
    let names = parameters.map(|parameter| parameter.name);
    let attributes: Vec<&str> = ends.iter().copied().chain(names).collect();
    format!("<{} {}/>", schema.tag, attributes.join(" "))
}

/// Writes the skeleton into the folder, which is created if it is missing, and returns the files. An assignment says
/// which scenes it reads and what is to be done.
///
/// # Errors
/// If a file exists already, or cannot be written. Nothing is overwritten.
pub fn write(
    language: Language,
    assignment: Option<&Assignment>,
    folder: &Path,
) -> io::Result<Vec<PathBuf>> {
    fs::create_dir_all(folder)?;
    let source = filled(language.text(reads_json(assignment)), assignment);
    let files = [(language.source(), source), (MANIFEST, language.manifest(assignment))];
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
