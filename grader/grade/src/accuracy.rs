//! `grade accuracy`: measures error against computing time, of the built-in simulator and of a submission.

use std::fs;
use std::path::{Path, PathBuf};

use grader::boundary::own_file;
use grader::class::fingerprint::Fingerprint;
use grader::rubric::Rubric;
use grader::submission::Submission;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use scene::ParseOptions;
use sha2::{Digest, Sha256};
use simulator::vocabulary;
use studies::accuracy::problem::PROBLEMS;
use studies::accuracy::{self, AccuracyConfig, Store, Study, Target};
use studies::report::accuracy::{csv, html, json, plot, text};

use crate::args::{AccuracyArgs, AccuracyFormat};
use crate::inputs::find_root;
use crate::output::{print, put, write_file};
use crate::pages::Pages;
use crate::stop::{Exit, Stop, complain};
use crate::submission::open_program;

pub(super) fn measure(args: &AccuracyArgs) -> Result<Exit, Stop> {
    if args.list {
        list()?;
        return Ok(Exit::Passed);
    }
    let pages = args.html.as_deref().map(Pages::open).transpose()?;
    let targets = targets(args)?;
    let submission = args.submission.as_deref().map(|path| open(path, args)).transpose()?;
    let mut config = if args.quick { AccuracyConfig::QUICK } else { AccuracyConfig::FULL };
    config.rungs = args.rungs.unwrap_or(config.rungs);
    let store = match &args.results {
        Some(folder) => Some(Store::new(folder, &provenance(args)?)),
        None => None,
    };
    let bar = progress_bar();
    let mut progress = |what: &str, done: usize, total: usize| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
        bar.set_message(what.to_owned());
    };
    let study =
        accuracy::study(targets, submission.as_ref(), config, store.as_ref(), &mut progress);
    bar.finish_and_clear();
    let study = study.map_err(Stop::bad_input)?;
    if let Some(folder) = &args.results {
        write_results(folder, &study)?;
    }
    let bytes = match args.format {
        AccuracyFormat::Text => {
            let mut bytes = Vec::new();
            let config = text::AccuracyTextOptions { details: args.details };
            text::write(&mut bytes, &study, config).map_err(Stop::fault)?;
            bytes
        }
        AccuracyFormat::Csv => csv::render(&study).map_err(Stop::fault)?.into_bytes(),
        AccuracyFormat::Json => json::render(&study).map_err(Stop::fault)?.into_bytes(),
    };
    put(&bytes, args.output.as_deref())?;
    if let Some(pages) = pages {
        pages.write("", |sink| html::write(&study, sink))?;
        pages.announce();
    }
    // Chosen scenes need not confirm every method; all of them together must.
    let is_confirmed = !args.scene.is_empty() || study.unconfirmed().is_empty();
    Ok(if study.agreement().differ == 0 && is_confirmed { Exit::Passed } else { Exit::Failed })
}

fn list() -> Result<(), Stop> {
    let mut words = String::new();
    for problem in PROBLEMS {
        words += &format!("{:22}{}\n", problem.name, problem.title);
    }
    print(words.as_bytes())
}

/// The scenes to measure.
fn targets(args: &AccuracyArgs) -> Result<Vec<Target>, Stop> {
    if args.scene.is_empty() {
        return Ok(PROBLEMS.iter().map(Target::of_problem).collect());
    }
    args.scene.iter().map(|name| target(name, args)).collect()
}

fn target(name: &str, args: &AccuracyArgs) -> Result<Target, Stop> {
    if let Some(problem) = PROBLEMS.iter().find(|problem| problem.name == name) {
        return Ok(Target::of_problem(problem));
    }
    let path = scene_file(name, args)?;
    let parsed = scene::load(&path, &vocabulary(), &ParseOptions::default());
    let parsed = parsed.map_err(Stop::bad_input)?;
    for warning in &parsed.warnings {
        complain("warning", warning);
    }
    Ok(Target::of_scene(name, parsed.scene))
}

/// The file of a scene, given by its path or by its name in the suite.
fn scene_file(name: &str, args: &AccuracyArgs) -> Result<PathBuf, Stop> {
    let path = PathBuf::from(name);
    if path.is_file() {
        return Ok(path);
    }
    let root = match &args.root {
        Some(root) => Ok(root.clone()),
        None => find_root(),
    };
    let folders = root
        .ok()
        .into_iter()
        .flat_map(|root| ["assets", "extracreditassets"].map(|folder| root.join(folder)));
    for folder in folders {
        for extension in ["xml", "json"] {
            let path = folder.join(format!("{name}.{extension}"));
            if path.is_file() {
                return Ok(path);
            }
        }
    }
    Err(Stop::bad_input(format!(
        "{name}: scene not found\n  \
        help: name a file, a scene of `grade accuracy --list`, or a scene of the suite, such as \
        Spring/ring-of-eight-linearized"
    )))
}

/// Opens the program to measure beside the built-in simulator.
fn open(path: &Path, args: &AccuracyArgs) -> Result<Submission, Stop> {
    // This command needs no suite and no rubric.
    match open_program(path, &args.run, &Rubric::default(), &[])? {
        (submission @ Submission::Program(_), _) => Ok(submission),
        (Submission::Unusable { name, failure }, _) => {
            Err(Stop::bad_input(format!("{}: {failure}", name.line())))
        }
        _ => Err(Stop::bad_input(format!("{}: not a program", path.display()))),
    }
}

/// Hash of what results depend on besides scenes and methods: this executable and the measured program.
fn provenance(args: &AccuracyArgs) -> Result<String, Stop> {
    let own = std::env::current_exe().map_err(Stop::fault)?;
    let mut hash = Sha256::new();
    hash.update(own_file::read(&own).map_err(Stop::fault)?);
    if let Some(path) = &args.submission {
        let mut files = Fingerprint::default();
        let path = fs::canonicalize(path).map_err(Stop::bad_input)?;
        files.submission(&path).map_err(Stop::bad_input)?;
        hash.update(files.finish());
    }
    Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Writes every report and diagram to the folder.
fn write_results(folder: &Path, study: &Study) -> Result<(), Stop> {
    let mut report = Vec::new();
    text::write(&mut report, study, text::AccuracyTextOptions { details: true })
        .map_err(Stop::fault)?;
    let mut files = vec![
        ("report.txt".to_owned(), report),
        ("points.csv".to_owned(), csv::render(study).map_err(Stop::fault)?.into_bytes()),
        ("report.json".to_owned(), json::render(study).map_err(Stop::fault)?.into_bytes()),
    ];
    for scene in &study.scenes {
        let name = accuracy::file_name(&scene.target.name);
        match plot::svg(scene) {
            Ok(svg) => files.push((format!("{name}.svg"), svg.into_bytes())),
            Err(error) => complain("warning", format!("{name}: {error}")),
        }
    }
    for (name, bytes) in files {
        let path = folder.join(name);
        write_file(&path, &bytes)
            .map_err(|error| Stop::bad_input(format!("{}: {error}", path.display())))?;
    }
    Ok(())
}

/// A progress bar on standard error, if that is a terminal.
fn progress_bar() -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::stderr());
    let style = ProgressStyle::with_template("{wide_bar} {pos} of {len}, {elapsed}  {msg}");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}
