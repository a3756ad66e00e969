//! Skeletons of submissions. Each documents the protocol in its comments.
//!
//! ```text
//! course.rs    the course's milestones, and what is like them: a file for each force and integrator
//! layouts.rs   the six functions of the fast mass-spring assignment (C++), the files of the lecture (Python)
//! otherwise    one file: XML, which moves particles without forces; or JSON, which holds every vertex at rest
//! ```
//!
//! The words `ELEMENTS`, `FORCES` and `METHODS` in a skeleton stand for what its assignment asks for. A line `PIECE name`
//! stands for a file of `pieces/`, which several skeletons share.

mod course;
mod layouts;

use std::collections::BTreeSet;
use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use scene::schema::{ForceSchema, Stencil};
use simulator::vocabulary;

use crate::submission::folder::MANIFEST;
use crate::suite::assignment::Assignment;
use course::Course;

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

    /// Code that writes all digits of a number.
    fn digits(self) -> &'static str {
        match self {
            Self::Cpp => "precision 17 does",
            Self::Python => "repr() does",
            Self::Rust => "`{}` does",
        }
    }

    /// Arguments of `grade` that its build needs, if any.
    pub fn arguments(self) -> Option<&'static str> {
        // rustup keeps its toolchains in the home folder, which submissions may not read.
        (self == Self::Rust).then_some("--readable \"$(rustc --print sysroot)\"")
    }

    /// The skeleton in one file: its name and text, and the command that builds it.
    fn single(self, reads_json: bool) -> (&'static str, &'static str, Option<&'static str>) {
        match (self, reads_json) {
            (Self::Cpp, _) => (
                "simulate.cpp",
                include_str!("simulate.cpp"),
                Some(r#"["c++", "-O2", "-std=c++17", "-o", "simulate", "simulate.cpp"]"#),
            ),
            (Self::Python, false) => ("simulate.py", include_str!("simulate.py"), None),
            (Self::Python, true) => ("simulate.py", include_str!("springs.py"), None),
            (Self::Rust, reads_json) => (
                "simulate.rs",
                if reads_json { include_str!("springs.rs") } else { include_str!("simulate.rs") },
                Some(r#"["rustc", "-O", "-o", "simulate", "simulate.rs"]"#),
            ),
        }
    }
}

/// Parts that several skeletons share.
const PIECES: [(&str, &str); 10] = [
    ("protocol_xml.txt", include_str!("pieces/protocol_xml.txt")),
    ("protocol_json.txt", include_str!("pieces/protocol_json.txt")),
    ("protocol.txt", include_str!("pieces/protocol.txt")),
    ("elements.cpp", include_str!("pieces/elements.cpp")),
    ("not_implemented.cpp", include_str!("pieces/not_implemented.cpp")),
    ("read_root.py", include_str!("pieces/read_root.py")),
    ("solve.py", include_str!("pieces/solve.py")),
    ("main.cpp", include_str!("pieces/main.cpp")),
    ("main.py", include_str!("pieces/main.py")),
    ("not_implemented.py", include_str!("pieces/not_implemented.py")),
];

/// The text with its pieces, each behind the words before `PIECE`: the start of a comment.
fn with_pieces(text: &str) -> String {
    let mut whole = String::new();
    for line in text.lines() {
        let piece = line.split_once("PIECE ").and_then(|(start, name)| {
            PIECES.iter().find(|(known, _)| *known == name).map(|(_, piece)| (start, piece))
        });
        if let Some((start, piece)) = piece {
            for line in with_pieces(piece).lines() {
                whole += format!("{start}{line}").trim_end();
                whole.push('\n');
            }
        } else {
            whole += line;
            whole.push('\n');
        }
    }
    whole
}

/// Behaviour of a skeleton before anything is filled in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// It moves particles on which no force acts.
    Moves,
    /// It holds every vertex at rest.
    Rests,
    /// It reads scenes and takes no step.
    Reads,
}

/// A skeleton.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Skeleton {
    /// Its behaviour before anything is filled in.
    pub start: Start,
    /// Its sources: path and text.
    pub sources: Vec<(String, String)>,
    /// The command that builds it, as TOML.
    build: Option<String>,
    /// The script that runs it; `None` if it is built.
    script: Option<String>,
}

impl Skeleton {
    /// The skeleton of an assignment, or of every scene.
    pub fn new(language: Language, assignment: Option<&Assignment>) -> Self {
        let in_layout = assignment.and_then(|assignment| Self::in_layout(language, assignment));
        let mut skeleton = in_layout.unwrap_or_else(|| Self::single(language, assignment));
        for (_, text) in &mut skeleton.sources {
            *text = with_pieces(text).replace("DIGITS", language.digits());
        }
        skeleton
    }

    /// The skeleton in one file.
    fn single(language: Language, assignment: Option<&Assignment>) -> Self {
        let reads_json = reads_json(assignment);
        let (file, text, build) = language.single(reads_json);
        Self {
            start: if reads_json { Start::Rests } else { Start::Moves },
            sources: vec![(file.to_owned(), filled(text, assignment))],
            build: build.map(str::to_owned),
            script: (language == Language::Python).then(|| file.to_owned()),
        }
    }

    /// The skeleton in the layout of the assignment's starter code, or of the code in its document.
    fn in_layout(language: Language, assignment: &Assignment) -> Option<Self> {
        let compiled =
            |sources: &str| format!(r#"["sh", "-c", "c++ -O2 -std=c++17 -o simulate {sources}"]"#);
        if language == Language::Cpp && reads_json(Some(assignment)) {
            let build = Some(compiled("-Iinclude main.cpp src/*.cpp"));
            let sources = layouts::fast_mass_springs();
            return Some(Self { start: Start::Reads, sources, build, script: None });
        }
        if let Some(sources) =
            (language == Language::Python).then(|| layouts::lecture(assignment)).flatten()
        {
            let script = Some(layouts::SIMULATOR.to_owned());
            return Some(Self { start: Start::Reads, sources, build: None, script });
        }
        let course = Course::of(assignment)?;
        let sources = course.files(language)?;
        let start = if course.moves() { Start::Moves } else { Start::Reads };
        let is_compiled = language == Language::Cpp;
        let build = is_compiled.then(|| compiled(&format!("{}/*.cpp", course::FOLDER)));
        let script = (!is_compiled).then(|| format!("{}/main.py", course::FOLDER));
        Some(Self { start, sources, build, script })
    }

    /// The text of its submission.toml.
    fn manifest(&self, assignment: Option<&Assignment>) -> String {
        let build = match &self.build {
            None => "# No build is needed. If one were: build = [\"make\"]\n".to_owned(),
            Some(build) => format!(
                "# Runs in a copy of this folder before anything else. Optional.\n\
                 build = {build}\n"
            ),
        };
        let program = match &self.script {
            Some(script) => format!("\"python3\", \"{{folder}}/{script}\""),
            None => "\"./simulate\"".to_owned(),
        };
        let serve = if reads_json(assignment) {
            String::new()
        } else {
            format!(
                "# Many scenes in one process, for `grade fuzz`: reads lines `SCENE TRACE` from standard input. Optional.\n\
                 serve = [{program}, \"--serve\"]\n\n"
            )
        };
        let (solver, about) = if reads_json(assignment) {
            (", \"{solver}\"", "; {solver} is dense or sparse")
        } else {
            ("", "")
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
             run = [{program}, \"{{scene}}\", \"{{trace}}\"{solver}]\n\n{serve}\
             # Format of the trace: \"csv\", or \"fosssim\", the course's binary.\n\
             format = \"csv\"\n{assignment}"
        )
    }
}

/// Whether the scenes of the assignment are JSON files.
fn reads_json(assignment: Option<&Assignment>) -> bool {
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
        let has_edges = schemas.iter().any(|schema| schema.stencil == Stencil::Edge);
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
    let parameters = schema.parameters.iter().filter(|parameter| !parameter.three_dimensional);
    let names = parameters.map(|parameter| parameter.name);
    let attributes: Vec<&str> = schema.stencil.attributes().iter().copied().chain(names).collect();
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
    let skeleton = Skeleton::new(language, assignment);
    let manifest = (MANIFEST.to_owned(), skeleton.manifest(assignment));
    let files = skeleton.sources.into_iter().chain([manifest]);
    let files: Vec<(PathBuf, String)> =
        files.map(|(name, text)| (folder.join(name), text)).collect();
    if let Some((path, _)) = files.iter().find(|(path, _)| path.exists()) {
        let message = format!(
            "{} already exists; nothing was written\n  help: name another folder",
            path.display()
        );
        return Err(io::Error::new(io::ErrorKind::AlreadyExists, message));
    }
    for (path, text) in &files {
        fs::create_dir_all(path.parent().unwrap_or(folder))?;
        OpenOptions::new().write(true).create_new(true).open(path)?.write_all(text.as_bytes())?;
    }
    Ok(files.into_iter().map(|(path, _)| path).collect())
}
