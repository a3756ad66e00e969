//! `grade export`: writes what a course gives to a platform.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use grader::boundary::own_file;
use grader::suite::Section;
use grader::suite::assignment::ALL;
use platforms::archive;
use platforms::github;
use platforms::gradescope::export::{self, GLIBC, Program, Settings};
use platforms::package::{PackageFile, add_folder, check_portable};
use platforms::prairielearn;
use scene::output::OutputFile;

use crate::args::{ContentArgs, GithubArgs, GradescopeArgs, Judging, PrairielearnArgs, SuiteArgs};
use crate::inputs::{Folders, Inputs, open_oracle};
use crate::output::{leads_into, write_bytes, write_file};
use crate::stop::{Exit, Stop, complain};

/// Reads what a package contains; every scene in it can be judged.
fn read(content: &ContentArgs) -> Result<Inputs, Stop> {
    let judging = Judging {
        hidden: content.hidden.as_deref(),
        assignment: content.assignment.as_deref(),
        ..Judging::default()
    };
    let inputs = content.suite.read_for(&judging)?;
    check_oracle(&inputs)?;
    Ok(inputs)
}

/// Writes the zip of a Gradescope autograder.
pub(super) fn gradescope(args: &GradescopeArgs) -> Result<Exit, Stop> {
    let inputs = read(&args.content)?;
    let program = choose_program(args.program.as_deref())?;
    let mut files = Vec::new();
    let is_source = program == Program::Source;
    let settings = Settings {
        assignment: inputs
            .assignment
            .as_ref()
            .map_or(ALL, |assignment| &assignment.name)
            .to_owned(),
        hidden: inputs.hidden.is_some(),
        packages: args.content.package.clone(),
        seconds: args.seconds,
    };
    files.extend(export::files(program, &settings).map_err(Stop::fault)?);
    add_suite(&mut files, "suite/", &args.content.suite, &inputs)?;
    if is_source {
        add_source(&mut files, &args.content.suite)?;
    }
    let unwritable = |error| Stop::bad_input(format!("{}: {error}", args.output.display()));
    let mut out = OutputFile::create(&args.output).map_err(unwritable)?;
    archive::write(&mut out as &mut dyn Write, &files).map_err(unwritable)?;
    out.commit().map_err(unwritable)?;
    announce(args, &inputs, is_source);
    Ok(Exit::Passed)
}

/// Writes a PrairieLearn course folder.
pub(super) fn prairielearn(args: &PrairielearnArgs) -> Result<Exit, Stop> {
    let inputs = read(&args.content)?;
    let Program::Built(program) = choose_program(args.program.as_deref())? else {
        return Err(Stop::bad_input(
            "this program does not run in the image\n  help: name a grade for x86-64 Linux with --program; \
             docs/prairielearn.md says how to build a static one",
        ));
    };
    let assignment = inputs.assignment.as_ref();
    let name = assignment.map_or(ALL, |assignment| &assignment.name).to_owned();
    let settings = prairielearn::export::Settings {
        title: assignment
            .map_or("Mass-spring simulator", |assignment| &assignment.title)
            .to_owned(),
        uuid: uuid_of(&name),
        assignment: name,
        image: args.image.clone(),
        files: args.file.clone(),
        hidden: inputs.hidden.is_some(),
        packages: args.content.package.clone(),
        seconds: args.seconds,
    };
    let mut files = prairielearn::export::files(program, &settings).map_err(Stop::fault)?;
    let suite = format!("{}tests/suite/", settings.question());
    add_suite(&mut files, &suite, &args.content.suite, &inputs)?;
    for PackageFile { path, bytes, is_program } in &files {
        write_below(&args.output.join(path), bytes, *is_program)?;
    }
    let image = args.output.join("image");
    complain(
        "note",
        format!("build and push the image: docker build -t {} {}", args.image, image.display()),
    );
    complain("note", format!("add the question {} to an assessment", settings.question()));
    Ok(Exit::Passed)
}

/// An identifier of the question, the same whenever it is exported again.
fn uuid_of(assignment: &str) -> String {
    use sha2::{Digest, Sha256};
    let hash = Sha256::digest(format!("spring-oracle {assignment}"));
    let hex: String = hash.iter().take(16).map(|byte| format!("{byte:02x}")).collect();
    // Version 8: of the issuer's own making.
    format!("{}-{}-8{}-a{}-{}", &hex[..8], &hex[8..12], &hex[13..16], &hex[17..20], &hex[20..])
}

/// Writes a file, and the folders that it lies in.
fn write_below(path: &Path, bytes: &[u8], is_program: bool) -> Result<(), Stop> {
    let written = || {
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        write_bytes(path, bytes)?;
        #[cfg(unix)]
        if is_program {
            use std::os::unix::fs::PermissionsExt;
            fs::set_permissions(path, fs::Permissions::from_mode(0o755))?;
        }
        Ok(())
    };
    written()
        .map_err(|error: std::io::Error| Stop::bad_input(format!("{}: {error}", path.display())))
}

/// Writes the workflow of a template repository.
pub(super) fn github(args: &GithubArgs) -> Result<Exit, Stop> {
    let judging = Judging { assignment: args.assignment.as_deref(), ..Judging::default() };
    let inputs = args.suite.read_for(&judging)?;
    check_oracle(&inputs)?;
    keep_hidden_out(args, &inputs)?;
    let settings = github::export::Settings {
        repository: args.repository.clone(),
        reference: args.reference.clone(),
        assignment: inputs
            .assignment
            .as_ref()
            .map_or(ALL, |assignment| &assignment.name)
            .to_owned(),
        minutes: args.minutes,
    };
    let path = args.output.join(github::export::PATH);
    let unwritable = |error| Stop::bad_input(format!("{}: {error}", path.display()));
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(unwritable)?;
    }
    write_file(&path, github::export::workflow(&settings).as_bytes()).map_err(unwritable)?;
    complain("note", format!("{}: commit it to the template repository", path.display()));
    Ok(Exit::Passed)
}

/// Refuses hidden scenes that the workflow could read: students can edit it.
fn keep_hidden_out(args: &GithubArgs, inputs: &Inputs) -> Result<(), Stop> {
    let root = args.suite.folders()?.assets;
    let root = root.parent().unwrap_or(Path::new(""));
    let root = if root.as_os_str().is_empty() { Path::new(".") } else { root };
    let of_rubric = inputs.hidden.as_ref().map(|(_, folder)| folder);
    let is_inside = |folder: &&PathBuf| leads_into(folder, root).unwrap_or(true);
    let Some(folder) = args.hidden.as_ref().or(of_rubric.filter(is_inside)) else { return Ok(()) };
    Err(Stop::bad_input(format!(
        "{}: students can edit the workflow, and read what it reads: hidden scenes stay out of it and of {}\n  help: \
         leave out --hidden, keep hidden scenes outside of {1}, and grade them with `grade class --hidden` or in a \
         repository that students cannot write to (docs/github.md)",
        folder.display(),
        root.display()
    )))
}

/// Says what is in the package, and what to enter on the platform.
fn announce(args: &GradescopeArgs, inputs: &Inputs, is_source: bool) {
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
    complain("note", format!("{}: upload it as it is", args.output.display()));
    let (required, extra) = (points(Section::Required), points(Section::ExtraCredit));
    let beyond = match extra {
        extra if extra > 0.0 => format!("; {} points of extra credit are beyond", shown(extra)),
        _ => String::new(),
    };
    let required = shown(required);
    complain("note", format!("set the autograder points of the assignment to {required}{beyond}"));
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
    let bytes = own_file::read(&path)
        .map_err(|error| Stop::bad_input(format!("{}: {error}", path.display())))?;
    match (check_portable(&bytes, GLIBC), named) {
        (Ok(()), _) => Ok(Program::Built(bytes)),
        (Err(_), None) => Ok(Program::Source),
        (Err(error), Some(path)) => Err(Stop::bad_input(format!(
            "{}: does not run on the platform: {error}\n  help: leave out --program, and the platform builds the source",
            path.display()
        ))),
    }
}

/// Adds the scenes, their traces, the rubric and the hidden scenes.
fn add_suite(
    files: &mut Vec<PackageFile>,
    prefix: &str,
    suite: &SuiteArgs,
    inputs: &Inputs,
) -> Result<(), Stop> {
    let Folders { assets, extra_credit, expected } = suite.folders()?;
    let mut add = |folder: &Path, name: &str, is_kept: &dyn Fn(&str) -> bool| {
        add_folder(files, folder, &format!("{prefix}{name}/"), is_kept).map_err(Stop::bad_input)
    };
    add(&assets, "assets", &|path| path != "rubric.toml")?;
    if let Some(folder) = extra_credit.filter(|folder| folder.is_dir()) {
        add(&folder, "extracreditassets", &|_| true)?;
    }
    add(&expected, "expected", &|_| true)?;
    if let Some((_, hidden)) = &inputs.hidden {
        let parts = ["assets", "extracreditassets", "expected"];
        let is_part = |path: &str| parts.iter().any(|part| path.split('/').next() == Some(part));
        add(hidden, "hidden", &is_part)?;
    }
    if let Some(path) = &inputs.rubric_path {
        let mut text = own_file::text(path)
            .map_err(|error| Stop::bad_input(format!("{}: {error}", path.display())))?;
        // The package has them in its own place, and its readers need no path of this machine.
        if let Some(folder) = inputs.rubric.hidden().and_then(|hidden| hidden.folder.as_ref()) {
            let folder = folder.display();
            for written in [format!("\"{folder}\""), format!("'{folder}'")] {
                text = text.replace(&written, "\"../hidden\"");
            }
        }
        files.push(PackageFile::data(format!("{prefix}assets/rubric.toml"), text.into_bytes()));
    }
    Ok(())
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
        let bytes = own_file::read(&path)
            .map_err(|error| Stop::bad_input(format!("{}: {error}", path.display())))?;
        files.push(PackageFile::data(format!("source/{name}"), bytes));
    }
    for name in ["grader", "simulator", "docs"] {
        let is_kept = |path: &str| !path.split('/').any(|part| part == "target");
        add_folder(files, &root.join(name), &format!("source/{name}/"), &is_kept)
            .map_err(Stop::bad_input)?;
    }
    Ok(())
}
