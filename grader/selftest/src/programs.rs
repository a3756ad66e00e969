//! Self-test programs in other languages, built in several ways and run like any submission.
//!
//! The sources in `programs/` are embedded in the grader, so only a compiler is needed. An argument selects the
//! mistake, so that each variant of the build is compiled once. A build that fails because a compiler is missing or
//! does not support a flag is skipped with the reason.

use std::fs;
use std::path::Path;

use rayon::prelude::*;
use scene::trace::TraceFormat;
use scene::{Dimension, Scene};

use super::library::{self, Build, Planned};
use super::{Graded, Outcome, Row};
use grader::grading;
use grader::oracle::Oracle;
use grader::rubric::Rubric;
use grader::submission::Submission;
use grader::submission::folder::{self, Built, FolderError};
use grader::submission::program::{Program, Runner};
use grader::suite::{Case, Suite};
use grader::verdict::Failure;
use sandbox::scratch::{Scratch, scratch_folder};

/// Limits for runs that must exceed them: processor time in seconds, memory in bytes.
const TIGHT: [(&str, f64); 2] = [("cpu", 1.0), ("memory", 268_435_456.0)];

impl Build {
    fn language(self) -> String {
        match self {
            Self::Cpp(flags) => format!("C++ {}", flags.join(" ")),
            Self::C(flags) => format!("C {}", flags.join(" ")),
            Self::Python => "Python".to_owned(),
        }
    }

    fn tool(self) -> &'static str {
        match self {
            Self::Cpp(_) => "c++",
            Self::C(_) => "cc",
            Self::Python => "python3",
        }
    }

    fn source(self) -> (&'static str, &'static str) {
        match self {
            Self::Cpp(_) => ("student.cpp", include_str!("programs/student.cpp")),
            Self::C(_) => ("student.c", include_str!("programs/student.c")),
            Self::Python => ("student.py", include_str!("programs/student.py")),
        }
    }

    /// Whether every compiler supports the flags; a failed build is then an error.
    fn is_plain(self) -> bool {
        match self {
            Self::Cpp(flags) | Self::C(flags) => {
                flags.iter().all(|flag| flag.starts_with("-O") || flag.starts_with("-DREAL"))
            }
            Self::Python => true,
        }
    }

    /// The manifest of a submission in a folder with the source.
    fn manifest(self) -> String {
        let (file, _) = self.source();
        let build = match self {
            Self::Cpp(flags) | Self::C(flags) => {
                let flags: String = flags.iter().map(|flag| format!("{flag:?}, ")).collect();
                format!(
                    "build = [{:?}, {flags}\"-o\", \"student\", {file:?}, \"-lm\"]\n",
                    self.tool()
                )
            }
            Self::Python => String::new(),
        };
        let (run, format) = match self {
            Self::Python => (
                r#"["python3", "-S", "-E", "{folder}/student.py", "{scene}", "-o", "{trace}"]"#,
                "csv",
            ),
            _ => (r#"["./student", "-s", "{scene}", "-d", "0", "-o", "{trace}"]"#, "fosssim"),
        };
        format!("name = {:?}\n{build}run = {run}\nformat = \"{format}\"\n", self.language())
    }

    /// Whether the program supports the scene.
    fn knows(self, scene: &Scene) -> bool {
        const SYMPLECTIC: [&str; 2] = ["symplectic-euler", "linearized-implicit-euler"];
        let (methods, others): (&[&str], &[&str]) = match self {
            Self::Cpp(_) => (
                &[
                    "explicit-euler",
                    "symplectic-euler",
                    "linearized-implicit-euler",
                    "implicit-euler",
                ],
                &["constantforce", "vortexforce"],
            ),
            Self::C(_) => (&SYMPLECTIC, &[]),
            Self::Python => (
                &["explicit-euler", "symplectic-euler", "linearized-implicit-euler"],
                &["vortexforce"],
            ),
        };
        let common = ["simplegravity", "springforce", "gravitationalforce", "dragdamping"];
        let offers = |tag: &&str| common.contains(tag) || others.contains(tag);
        scene.dimension == Dimension::Two
            && methods.contains(&scene.integrator.name)
            && scene.forces.iter().all(|element| offers(&element.schema.tag))
    }
}

/// A built program, or the reason for its absence.
enum Made {
    Program(Program),
    Failed(Failure),
    Skipped(String),
}

/// All rows, in order, or those with this subject.
///
/// # Errors
/// If the grader or its machine cannot build or run programs.
pub fn rows(
    suite: &Suite,
    oracle: &Oracle,
    rubric: &Rubric,
    runner: &Runner,
    subject: Option<&str>,
) -> Result<Vec<Row>, FolderError> {
    let mut planned = library::rows();
    planned.retain(|row| subject.is_none_or(|subject| row.subject == subject));
    let mut builds: Vec<Build> = Vec::new();
    for row in &planned {
        if !builds.contains(&row.build) {
            builds.push(row.build);
        }
    }
    let make = |build: &Build| make(*build, rubric, runner);
    let made: Vec<(Made, Option<Scratch>)> =
        builds.par_iter().map(make).collect::<Result<_, _>>()?;
    let run = |row: &Planned| {
        let place = builds.iter().position(|build| *build == row.build);
        let result = match place.map(|place| &made[place].0) {
            Some(Made::Program(program)) => {
                let program = row.call(program);
                Outcome::Graded(grade(row, &Submission::Program(program), suite, oracle, rubric))
            }
            Some(Made::Failed(failure)) => {
                let name = row.build.language().into();
                let unusable = Submission::Unusable { name, failure: failure.clone() };
                Outcome::Graded(grade(row, &unusable, suite, oracle, rubric))
            }
            Some(Made::Skipped(reason)) => Outcome::Skipped(reason.clone()),
            None => Outcome::Skipped("not built".to_owned()),
        };
        Row {
            subject: row.subject.to_owned(),
            description: row.description.to_owned(),
            language: row.build.language(),
            expectation: row.expectation,
            result,
        }
    };
    Ok(planned.par_iter().map(run).collect())
}

impl Planned {
    /// The program with its settings.
    fn call(&self, program: &Program) -> Program {
        let arguments = self.settings.iter().flat_map(|setting| ["-e", setting]);
        let mut program = program.with_arguments(arguments);
        if self.settings.contains(&"FORMAT=csv") {
            program = program.with_format(TraceFormat::Csv);
        }
        if self.is_endless {
            program = program.with_limits(&TIGHT);
        }
        program
    }
}

fn grade(
    row: &Planned,
    submission: &Submission,
    suite: &Suite,
    oracle: &Oracle,
    rubric: &Rubric,
) -> Graded {
    let mut features = Vec::new();
    let known = suite.cases.iter().filter(|case| row.build.knows(&case.scene));
    let wanted = known.filter(|case| {
        let is_first = !features.contains(&&case.feature);
        features.push(&case.feature);
        is_first || !row.is_endless
    });
    let part = Suite {
        cases: wanted.cloned().collect(),
        sections: suite.sections.clone(),
        warnings: Vec::new(),
    };
    let judge =
        |case: &Case, criteria| grading::judge(case, oracle, criteria, || submission.states(case));
    Graded::of(&grading::collect(&part, submission.name(), oracle, rubric, judge))
}

/// Builds a source in the sandbox. The folder that it runs from exists as long as the returned value.
fn make(
    build: Build,
    rubric: &Rubric,
    runner: &Runner,
) -> Result<(Made, Option<Scratch>), FolderError> {
    if !is_there(build.tool()) {
        return Ok((Made::Skipped(format!("{} not found", build.tool())), None));
    }
    let unwritable = FolderError::NotCopied;
    let home = scratch_folder().map_err(unwritable)?;
    let folder = home.path().join("submission");
    let (file, source) = build.source();
    fs::create_dir(&folder).map_err(unwritable)?;
    fs::write(folder.join(file), source).map_err(unwritable)?;
    fs::write(folder.join(folder::MANIFEST), build.manifest()).map_err(unwritable)?;
    let made = match folder::open(
        &folder,
        &folder.as_path().into(),
        runner.clone(),
        rubric.build_limits(),
    )? {
        Built::Program(program) => Made::Program(program),
        Built::Failed { failure, .. } if build.is_plain() => Made::Failed(failure),
        Built::Failed { failure, .. } => {
            let text = failure.to_string();
            let line =
                text.lines().find(|line| line.contains("error")).unwrap_or("the build failed");
            Made::Skipped(line.to_owned())
        }
    };
    Ok((made, Some(home)))
}

/// Whether a tool is in a folder that sandboxed programs can read.
fn is_there(tool: &str) -> bool {
    ["/usr/local/bin", "/usr/bin", "/bin"]
        .iter()
        .any(|folder| Path::new(folder).join(tool).exists())
}
