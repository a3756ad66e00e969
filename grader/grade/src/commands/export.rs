//! `grade export`: writes what a course gives to a platform.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use grader::boundary::own_file;
use grader::pack;
use grader::rubric;
use grader::suite::Section;
use platforms::archive;
use platforms::bundle::{self, Platform};
use platforms::gradescope::export::{self, GLIBC, Program, Settings};
use platforms::package::{PackageFile, add_folder, check_portable};
use platforms::pipeline::{self, Host};
use platforms::prairielearn;
use scene::output::OutputFile;

use crate::args::SuiteArgs;
use crate::inputs::{Folders, Inputs, Judging, open_oracle};
use crate::output::{leads_into, write_bytes};
use crate::stop::{Exit, Stop, complain};

#[derive(Subcommand)]
pub(crate) enum ExportCommand {
    Gradescope(GradescopeArgs),
    Prairielearn(PrairielearnArgs),
    /// Write a workflow of GitHub Actions for a template repository
    #[command(after_help = "\
Examples:
  grade export github --assignment t1m3 --repository course/spring-oracle -o template")]
    Github(PipelineArgs),
    /// Write a pipeline of GitLab for a template project
    #[command(after_help = "\
Examples:
  grade export gitlab --assignment t1m3 --repository course/spring-oracle -o template")]
    Gitlab(PipelineArgs),
    /// Write the folder of an assignment's autograder for Classroom 50
    #[command(after_help = "\
Examples:
  grade export classroom50 --assignment t1m3 -o classroom50/cs-principles")]
    Classroom50(BundleArgs),
    /// Write a grading script for Codio, with grade, the scenes and the oracle, where students cannot read them
    #[command(after_help = "\
Examples:
  grade export codio --assignment t1m3 -o workspace")]
    Codio(BundleArgs),
}

impl ExportCommand {
    pub(crate) fn run(&self) -> Result<Exit, Stop> {
        match self {
            Self::Gradescope(args) => args.run(),
            Self::Prairielearn(args) => args.run(),
            Self::Github(args) => args.run(pipeline::GITHUB),
            Self::Gitlab(args) => args.run(pipeline::GITLAB),
            Self::Classroom50(args) => args.run(bundle::CLASSROOM_50),
            Self::Codio(args) => args.run(bundle::CODIO),
        }
    }
}

/// Scenes that a platform grades.
#[derive(Args)]
struct ContentArgs {
    /// The assignment that is graded; `grade assignments` lists them [default: the rubric's assignment, else every scene]
    #[arg(long, value_name = "NAME")]
    assignment: Option<String>,

    /// Folder of hidden scenes [default: the rubric's folder]
    #[arg(long, value_name = "DIR")]
    hidden: Option<PathBuf>,

    #[command(flatten)]
    suite: SuiteArgs,
}

/// The content of a package.
#[derive(Args)]
struct PackageArgs {
    #[command(flatten)]
    content: ContentArgs,

    /// Debian package that submissions need (repeatable)
    #[arg(long, value_name = "NAME", default_values = ["build-essential", "cmake", "python3"])]
    package: Vec<String>,
}

/// Write the zip of a Gradescope autograder, with grade, the scenes, the oracle and the rubric
#[derive(Args)]
#[command(after_help = "\
Examples:
  grade export gradescope --assignment t1m3 -o autograder.zip")]
pub(crate) struct GradescopeArgs {
    /// Write the zip to this file
    #[arg(short, long, value_name = "FILE", default_value = "autograder.zip")]
    output: PathBuf,

    /// A grade for x86-64 Linux with glibc 2.35 or older, or static [default: this program if it is one, else its source]
    #[arg(long, value_name = "FILE")]
    program: Option<PathBuf>,

    /// Seconds after which grade ends, so that it can still write results; set Gradescope's own limit higher
    #[arg(long, value_name = "N", default_value_t = 540, value_parser = clap::value_parser!(u32).range(1..=2400))]
    seconds: u32,

    #[command(flatten)]
    content: PackageArgs,
}

/// Write a PrairieLearn course folder with one question, and the Dockerfile of its grader
#[derive(Args)]
#[command(after_help = "\
Examples:
  grade export prairielearn --assignment t1m3 --image course/spring-oracle -o my-course")]
pub(crate) struct PrairielearnArgs {
    /// Write into this course folder; its other files stay
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,

    /// The name of the image in a registry, such as course/spring-oracle
    #[arg(long, value_name = "NAME", value_parser = parse_image)]
    image: String,

    /// File that students hand in, or a pattern of files that they may hand in, such as '*.h' (repeatable); folders cannot be
    /// uploaded [default: those of the pack, else submission.toml and simulate.cpp]
    #[arg(long, value_name = "NAME", value_parser = parse_pattern)]
    file: Vec<String>,

    /// A grade for x86-64 Linux with glibc 2.35 or older, or static [default: this program]
    #[arg(long, value_name = "FILE")]
    program: Option<PathBuf>,

    /// Seconds after which grade ends, so that it can still write results
    #[arg(long, value_name = "N", default_value_t = 540, value_parser = clap::value_parser!(u32).range(1..=540))]
    seconds: u32,

    #[command(flatten)]
    content: PackageArgs,
}

/// A pipeline that builds grade from its source.
#[derive(Args)]
#[command(mut_arg("hidden", |arg| {
    arg.help("Refused: students can edit the pipeline, and read what it reads").hide(true)
}))]
pub(crate) struct PipelineArgs {
    /// Write the pipeline into this repository: a folder with the files that students start from
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,

    /// The repository of the host that holds Spring Oracle, with the scenes and the oracle
    #[arg(long, value_name = "OWNER/NAME", value_parser = parse_repository)]
    repository: String,

    /// Its branch, tag or commit
    #[arg(long, value_name = "NAME", default_value = "main", value_parser = parse_reference)]
    reference: String,

    /// Minutes after which the job ends
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..=360))]
    minutes: u32,

    #[command(flatten)]
    content: ContentArgs,
}

/// A folder with grade and the suite.
#[derive(Args)]
pub(crate) struct BundleArgs {
    /// Write into this folder; its other files stay
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,

    /// A grade for x86-64 Linux with glibc 2.35 or older, or static [default: this program]
    #[arg(long, value_name = "FILE")]
    program: Option<PathBuf>,

    #[command(flatten)]
    content: ContentArgs,
}

fn parse_pattern(text: &str) -> Result<String, &'static str> {
    if is_file_name(&text.replace(['*', '?', '[', ']', '!'], "x")) {
        Ok(text.to_owned())
    } else if text.contains('/') {
        Err("PrairieLearn uploads no folders: name files without a /")
    } else {
        Err("expected letters, digits, - _ . and the wildcards * ? [ ]")
    }
}

/// The name of an image: parts of lower case between slashes, the first perhaps with a port, and a tag or a digest.
fn parse_image(text: &str) -> Result<String, &'static str> {
    let is_allowed =
        |it: char| it.is_ascii_lowercase() || it.is_ascii_digit() || "-_.".contains(it);
    let is_part = |part: &str| {
        part.starts_with(|it: char| it.is_ascii_alphanumeric()) && part.chars().all(is_allowed)
    };
    let (name, digest) = text.split_once('@').unwrap_or((text, "sha256:0"));
    let (host, path) = name.rsplit_once('/').map_or(("", name), |(host, path)| (host, path));
    let (path, tag) = path.split_once(':').unwrap_or((path, "latest"));
    let is_host =
        |host: &str| host.split('/').all(|part| is_part(part.split(':').next().unwrap_or("")));
    let is_valid = (host.is_empty() || is_host(host))
        && is_part(path)
        && is_file_name(tag)
        && digest.starts_with("sha256:");
    if is_valid {
        Ok(text.to_owned())
    } else {
        Err("expected the name of an image, such as course/spring-oracle or course/spring-oracle:2")
    }
}

fn parse_repository(text: &str) -> Result<String, &'static str> {
    if text.contains('/') && text.split('/').all(is_file_name) {
        Ok(text.to_owned())
    } else {
        Err("expected OWNER/NAME")
    }
}

fn parse_reference(text: &str) -> Result<String, &'static str> {
    if text.split('/').all(is_file_name) && !text.starts_with('-') {
        Ok(text.to_owned())
    } else {
        Err("expected the name of a branch, a tag or a commit")
    }
}

fn is_file_name(text: &str) -> bool {
    let is_allowed = |it: char| it.is_ascii_alphanumeric() || "-_.".contains(it);
    !text.is_empty() && text.chars().all(is_allowed)
}

impl ContentArgs {
    /// Reads what a package contains; every scene in it can be judged.
    fn read(&self) -> Result<Inputs, Stop> {
        let inputs = self.suite.read_for(&Judging {
            hidden: self.hidden.as_deref(),
            assignment: self.assignment.as_deref(),
            ..Judging::default()
        })?;
        check_oracle(&inputs)?;
        Ok(inputs)
    }
}

impl GradescopeArgs {
    /// Writes the zip of a Gradescope autograder.
    fn run(&self) -> Result<Exit, Stop> {
        let inputs = self.content.content.read()?;
        let program = choose_program(self.program.as_deref())?;
        let is_source = program == Program::Source;
        let settings = Settings {
            assignment: inputs.assignment_name().to_owned(),
            hidden: inputs.hidden.is_some(),
            packages: self.content.package.clone(),
            seconds: self.seconds,
        };
        let mut files = export::files(program, &settings).map_err(Stop::fault)?;
        let suite = &self.content.content.suite;
        add_suite(&mut files, "suite/", suite, (&inputs, Traces::All))?;
        if is_source {
            add_source(&mut files, suite)?;
        }
        let unwritable = Stop::about(&self.output);
        let mut out = OutputFile::create(&self.output).map_err(&unwritable)?;
        archive::write(&mut out as &mut dyn Write, &files).map_err(&unwritable)?;
        out.commit().map_err(&unwritable)?;
        self.announce(&inputs, is_source);
        Ok(Exit::Passed)
    }

    /// Says what is in the package, and what to enter on the platform.
    fn announce(&self, inputs: &Inputs, is_source: bool) {
        let mut features: Vec<_> = inputs.suite.cases.iter().map(|case| &case.feature).collect();
        if let Some((hidden, _)) = &inputs.hidden {
            features.extend(hidden.cases().iter().map(|case| &case.feature));
        }
        features.sort();
        features.dedup();
        let points = |section| {
            let features = features.iter().filter(|feature| feature.section == section);
            features.map(|feature| inputs.rubric.points(feature)).sum::<f64>()
        };
        let shown = grader::grading::points::shown;
        complain("note", format!("{}: upload it as it is", self.output.display()));
        let (required, extra) = (points(Section::Required), points(Section::ExtraCredit));
        let beyond = match extra {
            extra if extra > 0.0 => format!("; {} points of extra credit are beyond", shown(extra)),
            _ => String::new(),
        };
        let required = shown(required);
        complain(
            "note",
            format!("set the autograder points of the assignment to {required}{beyond}"),
        );
        if is_source {
            complain(
                "note",
                "this program does not fit the platform; its source is built there, in about ten minutes",
            );
        }
        if inputs.rubric.hidden().is_some() && inputs.hidden.is_none() {
            complain(
                "warning",
                "the rubric has hidden scenes, but their folder is not here; name it with --hidden",
            );
        }
    }
}

impl PrairielearnArgs {
    /// Writes a PrairieLearn course folder.
    fn run(&self) -> Result<Exit, Stop> {
        let inputs = self.content.content.read()?;
        let program = built_program(self.program.as_deref())?;
        let assignment = inputs.assignment.as_ref();
        let name = inputs.assignment_name().to_owned();
        let settings = prairielearn::export::Settings {
            title: assignment
                .map_or("Mass-spring simulator", |assignment| &assignment.title)
                .to_owned(),
            uuid: uuid_of(&name),
            assignment: name,
            image: self.image.clone(),
            files: self.files(&inputs),
            hidden: inputs.hidden.is_some(),
            packages: self.content.package.clone(),
            seconds: self.seconds,
        };
        let mut files = prairielearn::export::files(program, &settings).map_err(Stop::fault)?;
        let suite = format!("{}tests/suite/", settings.question());
        add_suite(&mut files, &suite, &self.content.content.suite, (&inputs, Traces::All))?;
        write_all(&self.output, &files)?;
        let image = self.output.join("image");
        complain(
            "note",
            format!("build and push the image: docker build -t {} {}", self.image, image.display()),
        );
        complain(
            "note",
            format!(
                "{} must be public; after each push, choose Sync for it under \"Docker images\" on the course's page Sync",
                self.image
            ),
        );
        complain("note", format!("add the question {} to an assessment", settings.question()));
        Ok(Exit::Passed)
    }

    /// The files that students hand in, and patterns of others.
    fn files(&self, inputs: &Inputs) -> Vec<String> {
        match (self.file.as_slice(), &inputs.pack) {
            ([], None) => ["submission.toml", "simulate.cpp"].map(str::to_owned).into(),
            ([], Some(pack)) => pack.file_names(),
            (named, _) => named.to_vec(),
        }
    }
}

impl BundleArgs {
    /// Writes the folder of a platform that runs a script with grade and the suite.
    fn run(&self, platform: Platform) -> Result<Exit, Stop> {
        let inputs = self.content.read()?;
        if platform.is_public {
            self.content
                .keep_hidden_out(&inputs, "whoever finds the address of the bundle can read it")?;
            if inputs.pack.as_ref().is_some_and(|pack| pack.starter().is_some()) {
                let message =
                    "anyone with the address of the bundle can read the starter code in it";
                complain("warning", message);
            }
        }
        let program = built_program(self.program.as_deref())?;
        let name = inputs.assignment_name();
        let mut files =
            platform.files(program, name, inputs.hidden.is_some()).map_err(Stop::fault)?;
        let suite = format!("{}suite/", platform.folder(name));
        add_suite(&mut files, &suite, &self.content.suite, (&inputs, Traces::OfAssignment))?;
        if let Some(most) = platform.most {
            let mut bytes = Vec::new();
            archive::write(&mut bytes, &files).map_err(Stop::fault)?;
            if bytes.len() > most {
                return Err(Stop::bad_input(format!(
                    "the bundle has {} MiB compressed, and the platform fetches at most {}\n  help: name a smaller grade with \
                     --program: that of a package, or of cargo build --profile dist --bin grade",
                    bytes.len().div_ceil(1 << 20),
                    most >> 20
                )));
            }
        }
        write_all(&self.output, &files)?;
        let script = self.output.join(platform.script(name));
        complain("note", format!("{}: the platform runs it for each submission", script.display()));
        Ok(Exit::Passed)
    }
}

impl PipelineArgs {
    /// Writes the pipeline of a template repository.
    fn run(&self, host: Host) -> Result<Exit, Stop> {
        if self.content.suite.pack.pack.is_some() {
            return Err(Stop::bad_input(
                "a pipeline grades with the scenes of its repository, not with a pack of this machine\n  help: name the pack \
                 in the rubric of that repository, under [pack]",
            ));
        }
        let inputs = self.content.read()?;
        self.content
            .keep_hidden_out(&inputs, "students can edit the pipeline, and read what it reads")?;
        let settings = pipeline::Settings {
            repository: self.repository.clone(),
            reference: self.reference.clone(),
            assignment: inputs.assignment_name().to_owned(),
            minutes: self.minutes,
        };
        let path = self.output.join(host.path);
        write_below(&path, host.pipeline(&settings).as_bytes(), false)?;
        complain("note", format!("{}: commit it to the template repository", path.display()));
        complain(
            "note",
            format!(
                "if {} is private, students can read it by the token of the pipeline; keep what they must not see out of it, \
                 and grade that with `grade class --hidden`",
                self.repository
            ),
        );
        Ok(Exit::Passed)
    }
}

impl ContentArgs {
    /// Refuses hidden scenes that students could read.
    fn keep_hidden_out(&self, inputs: &Inputs, why: &str) -> Result<(), Stop> {
        let root = self.suite.folders()?.assets;
        let root = root.parent().unwrap_or(Path::new(""));
        let root = if root.as_os_str().is_empty() { Path::new(".") } else { root };
        let of_rubric = inputs.hidden.as_ref().map(|(_, folder)| folder);
        let is_inside = |folder: &&PathBuf| leads_into(folder, root).unwrap_or(true);
        let Some(folder) = self.hidden.as_ref().or(of_rubric.filter(is_inside)) else {
            return Ok(());
        };
        Err(Stop::bad_input(format!(
            "{}: {why}: hidden scenes stay out of it and of {}\n  help: \
             leave out --hidden, keep hidden scenes outside of {1}, and grade them with `grade class --hidden` or in a \
             repository that students cannot write to (docs/github.md)",
            folder.display(),
            root.display()
        )))
    }
}

/// An identifier of the question, the same whenever it is exported again.
fn uuid_of(assignment: &str) -> String {
    use sha2::{Digest, Sha256};
    let hash = Sha256::digest(format!("spring-oracle {assignment}"));
    let hex: String = hash.iter().take(16).map(|byte| format!("{byte:02x}")).collect();
    // Version 8: of the issuer's own making.
    format!("{}-{}-8{}-a{}-{}", &hex[..8], &hex[8..12], &hex[13..16], &hex[17..20], &hex[20..])
}

/// Writes files below a folder.
fn write_all(folder: &Path, files: &[PackageFile]) -> Result<(), Stop> {
    files.iter().try_for_each(|PackageFile { path, bytes, is_program }| {
        write_below(&folder.join(path), bytes, *is_program)
    })
}

/// Writes a file, and the folders that it lies in.
fn write_below(path: &Path, bytes: &[u8], is_program: bool) -> Result<(), Stop> {
    let written = || {
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        write_bytes(path, bytes)?;
        if is_program {
            sandbox::files::make_executable(path)?;
        }
        Ok(())
    };
    written().map_err(Stop::about::<std::io::Error>(path))
}

/// Checks that every scene can be judged.
fn check_oracle(inputs: &Inputs) -> Result<(), Stop> {
    let oracle = open_oracle(&inputs.expected)?;
    let faults = inputs.suite.cases.iter().filter_map(|case| Some((case, oracle.fault(case)?)));
    match faults.into_iter().next() {
        Some((case, fault)) => Err(Stop::bad_input(format!("{}: {fault}", case.id))),
        None => Ok(()),
    }
}

/// The named program, or this one, or else the source.
fn choose_program(named: Option<&Path>) -> Result<Program, Stop> {
    let path = match named {
        Some(path) => path.to_path_buf(),
        None => std::env::current_exe().map_err(Stop::fault)?,
    };
    let bytes = own_file::read(&path).map_err(Stop::about(&path))?;
    match (check_portable(&bytes, GLIBC), named) {
        (Ok(()), _) => Ok(Program::Built(bytes)),
        (Err(_), None) => Ok(Program::Source),
        (Err(error), Some(path)) => Err(Stop::bad_input(format!(
            "{}: does not run on the platform: {error}\n  help: leave out --program, and the platform builds the source",
            path.display()
        ))),
    }
}

/// The named program, or this one, which must run on the platform.
fn built_program(named: Option<&Path>) -> Result<Vec<u8>, Stop> {
    match choose_program(named)? {
        Program::Built(program) => Ok(program),
        Program::Source => Err(Stop::bad_input(
            "this program does not run on the platform\n  help: name a grade for x86-64 Linux with --program; \
             docs/prairielearn.md says how to build a static one",
        )),
    }
}

/// Folders of a suite, of hidden scenes and of a pack with scenes.
const PARTS: [&str; 3] = ["assets", "extracreditassets", "expected"];

/// The traces of the oracle in a package.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Traces {
    /// Those of every scene.
    All,
    /// Those of the assignment, where the size of a package counts.
    OfAssignment,
}

/// Adds the scenes, their traces, the rubric and the hidden scenes.
fn add_suite(
    files: &mut Vec<PackageFile>,
    prefix: &str,
    suite: &SuiteArgs,
    (inputs, traces): (&Inputs, Traces),
) -> Result<(), Stop> {
    let Folders { assets, extra_credit, expected } = suite.folders_of(inputs.pack.as_ref())?;
    let mut add = |folder: &Path, name: &str, is_kept: &dyn Fn(&str) -> bool| {
        add_folder(files, folder, &format!("{prefix}{name}/"), is_kept).map_err(Stop::bad_input)
    };
    add(&assets, "assets", &|path| ![rubric::FILE, pack::FOLDER].contains(&path))?;
    if let Some(folder) = extra_credit.filter(|folder| folder.is_dir()) {
        add(&folder, "extracreditassets", &|_| true)?;
    }
    let is_judged = |path: &str| {
        let name = path.rsplit_once('.').map_or(path, |(name, _)| name);
        let is_of = |id: &str| id == name || id.starts_with(&format!("{path}/"));
        inputs.suite.cases.iter().any(|case| is_of(&case.id))
    };
    // The folder also has the manifest and the envelopes.
    let is_kept = |path: &str| traces == Traces::All || path.ends_with(".toml") || is_judged(path);
    add(&expected, "expected", &is_kept)?;
    if let Some((_, hidden)) = &inputs.hidden {
        let is_part = |path: &str| PARTS.iter().any(|part| path.split('/').next() == Some(part));
        add(hidden, "hidden", &is_part)?;
    }
    if let Some(pack) = &inputs.pack {
        let starter = pack.starter();
        // These are elsewhere in the package, or left out.
        let is_elsewhere = |name: &str| {
            let path = pack.folder().join(name);
            let is_example = pack.examples().iter().any(|example| path == example.folder);
            is_example
                || starter.is_some_and(|(folder, _)| path == folder)
                || PARTS.contains(&name)
                || ["hidden", rubric::FILE].contains(&name)
        };
        add(pack.folder(), "pack", &|path| !is_elsewhere(path))?;
        if let Some((folder, laid)) = starter {
            let is_kept = |path: &str| laid.iter().any(|file| file.starts_with(path));
            add(folder, "starter", &is_kept)?;
        }
    }
    if let Some(text) = package_rubric(inputs)? {
        files
            .push(PackageFile::data(format!("{prefix}assets/{}", rubric::FILE), text.into_bytes()));
    }
    Ok(())
}

/// The rubric of a package, which has hidden scenes and pack in their own places: its readers need no path of this machine.
fn package_rubric(inputs: &Inputs) -> Result<Option<String>, Stop> {
    let text = match &inputs.rubric_path {
        Some(path) => Some(own_file::text(path).map_err(Stop::about(path))?),
        None => None,
    };
    let moves_hidden = inputs.rubric.hidden().is_some_and(|hidden| hidden.folder.is_some());
    if !moves_hidden && inputs.pack.is_none() {
        return Ok(text);
    }
    let mut table: toml::Table =
        toml::from_str(text.as_deref().unwrap_or("")).map_err(Stop::fault)?;
    if moves_hidden && let Some(toml::Value::Table(hidden)) = table.get_mut("hidden") {
        hidden.insert("folder".to_owned(), "../hidden".into());
    }
    if let Some(pack) = &inputs.pack {
        let starter = pack.starter().map(|_| ("starter", "../starter"));
        let keys = [("folder", "../pack")].into_iter().chain(starter);
        let keys: toml::Table = keys.map(|(key, value)| (key.to_owned(), value.into())).collect();
        table.insert("pack".to_owned(), keys.into());
    }
    toml::to_string(&table).map(Some).map_err(Stop::fault)
}

/// Adds the source of this program, which is in the folder of the scenes.
fn add_source(files: &mut Vec<PackageFile>, suite: &SuiteArgs) -> Result<(), Stop> {
    let assets = suite.folders()?.assets;
    let root = match assets.parent() {
        Some(root) if !root.as_os_str().is_empty() => root.to_path_buf(),
        _ => PathBuf::from("."),
    };
    if !root.join("grader/grade/Cargo.toml").is_file() {
        return Err(Stop::bad_input(format!(
            "{}: this program does not run on the platform, and its source is not here\n  help: name a grade for x86-64 \
             Linux with --program, or run this in the source of Spring Oracle",
            root.display()
        )));
    }
    for name in ["Cargo.toml", "Cargo.lock"] {
        let path = root.join(name);
        let bytes = own_file::read(&path).map_err(Stop::about(&path))?;
        files.push(PackageFile::data(format!("source/{name}"), bytes));
    }
    for name in ["grader", "simulator", "docs"] {
        let is_kept = |path: &str| !path.split('/').any(|part| part == "target");
        add_folder(files, &root.join(name), &format!("source/{name}/"), &is_kept)
            .map_err(Stop::bad_input)?;
    }
    Ok(())
}
