//! `grade accuracy`: measures error against computing time, of the built-in simulator and of a submission.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use grader::boundary::own_file;
use grader::class::fingerprint::Fingerprint;
use scene::ParseOptions;
use sha2::{Digest, Sha256};
use simulator::vocabulary;
use studies::accuracy::problem::PROBLEMS;
use studies::accuracy::{self, AccuracyConfig, Store, Study, Target};
use studies::report::accuracy::{csv, html, json, plot, text};

use crate::args::{ReportArgs, RootArgs, RunArgs};
use crate::bar::Bar;
use crate::output::{print, put, write_file, written};
use crate::pages::Pages;
use crate::stop::{Exit, Stop, complain};
use crate::submission::open_measured;

/// Measure error against computing time for every integrator, over a ladder of time steps
#[derive(Args)]
#[command(after_help = "\
Examples:
  grade accuracy --quick
  grade accuracy my-simulator --scene pendulum --results curves")]
pub(crate) struct AccuracyArgs {
    /// Program, or folder with submission.toml, to measure beside the built-in simulator
    #[arg(value_name = "SUBMISSION")]
    submission: Option<PathBuf>,

    #[command(flatten)]
    run: RunArgs,

    /// Measure only this scene (repeatable): a scene of `--list`, a scene of the suite by its name, or a file
    #[arg(long, value_name = "SCENE")]
    scene: Vec<String>,

    /// List the scenes that are measured by default
    #[arg(long)]
    list: bool,

    /// Use fewer time steps and repeats: half a minute for all scenes
    #[arg(long)]
    quick: bool,

    /// Number of time steps in the ladder, each half of the one before
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=30))]
    rungs: Option<u32>,

    /// Keep all results in this folder: measured points, so that an interrupted run can continue; the report as text,
    /// CSV and JSON; and one diagram per scene as SVG
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,

    #[command(flatten)]
    report: ReportArgs<AccuracyFormat>,

    /// Write the report as a page to this folder too, with one diagram per scene
    #[arg(long, value_name = "DIR")]
    html: Option<PathBuf>,

    /// Show every point of every curve (text only)
    #[arg(long)]
    details: bool,

    #[command(flatten)]
    root: RootArgs,
}

/// Formats of the report of `grade accuracy`.
#[derive(Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
enum AccuracyFormat {
    /// For people
    #[default]
    Text,
    /// For spreadsheets: one row per point
    Csv,
    /// For programs; schema in docs/accuracy.schema.json
    Json,
}

impl AccuracyArgs {
    pub(crate) fn run(&self) -> Result<Exit, Stop> {
        if self.list {
            list()?;
            return Ok(Exit::Passed);
        }
        let pages = self.html.as_deref().map(Pages::open).transpose()?;
        let targets = self.targets()?;
        let submission = self.submission.as_deref().map(|path| open_measured(path, &self.run));
        let submission = submission.transpose()?;
        let mut config = if self.quick { AccuracyConfig::QUICK } else { AccuracyConfig::FULL };
        config.rungs = self.rungs.unwrap_or(config.rungs);
        let store = match &self.results {
            Some(folder) => Some(Store::new(folder, &self.provenance()?)),
            None => None,
        };
        let bar = Bar::new("{wide_bar} {pos} of {len}, {elapsed}  {msg}");
        let mut progress = |what: &str, done: usize, total: usize| {
            bar.advance(done, total);
            bar.say(what.to_owned());
        };
        let study =
            accuracy::study(targets, submission.as_ref(), config, store.as_ref(), &mut progress);
        bar.clear();
        let study = study.map_err(Stop::bad_input)?;
        if let Some(folder) = &self.results {
            write_results(folder, &study)?;
        }
        let bytes = match self.report.format {
            AccuracyFormat::Text => {
                let options = text::AccuracyTextOptions { details: self.details };
                written(|out| text::write(out, &study, options))?
            }
            AccuracyFormat::Csv => csv::render(&study).map_err(Stop::fault)?.into_bytes(),
            AccuracyFormat::Json => json::render(&study).map_err(Stop::fault)?.into_bytes(),
        };
        put(&bytes, self.report.output.as_deref())?;
        if let Some(pages) = pages {
            pages.publish(|sink| html::write(&study, sink))?;
        }
        // Chosen scenes need not confirm every method; all of them together must.
        let is_confirmed = !self.scene.is_empty() || study.unconfirmed().is_empty();
        Ok(Exit::of(study.agreement().differ == 0 && is_confirmed))
    }

    /// The scenes to measure.
    fn targets(&self) -> Result<Vec<Target>, Stop> {
        if self.scene.is_empty() {
            return Ok(PROBLEMS.iter().map(Target::of_problem).collect());
        }
        self.scene.iter().map(|name| self.target(name)).collect()
    }

    fn target(&self, name: &str) -> Result<Target, Stop> {
        if let Some(problem) = PROBLEMS.iter().find(|problem| problem.name == name) {
            return Ok(Target::of_problem(problem));
        }
        let path = self.scene_file(name)?;
        let parsed = scene::load(&path, &vocabulary(), &ParseOptions::default());
        let parsed = parsed.map_err(Stop::bad_input)?;
        for warning in &parsed.warnings {
            complain("warning", warning);
        }
        Ok(Target::of_scene(name, parsed.scene))
    }

    /// The file of a scene, given by its path or by its name in the suite.
    fn scene_file(&self, name: &str) -> Result<PathBuf, Stop> {
        let path = PathBuf::from(name);
        if path.is_file() {
            return Ok(path);
        }
        if let Ok(root) = self.root.find() {
            for folder in ["assets", "extracreditassets"] {
                for extension in ["xml", "json"] {
                    let path = root.join(folder).join(format!("{name}.{extension}"));
                    if path.is_file() {
                        return Ok(path);
                    }
                }
            }
        }
        Err(Stop::bad_input(format!(
            "{name}: scene not found\n  \
            help: name a file, a scene of `grade accuracy --list`, or a scene of the suite, such as \
            Spring/ring-of-eight-linearized"
        )))
    }

    /// Hash of what results depend on besides scenes and methods: this executable and the measured program.
    fn provenance(&self) -> Result<String, Stop> {
        let own = std::env::current_exe().map_err(Stop::fault)?;
        let mut hash = Sha256::new();
        hash.update(own_file::read(&own).map_err(Stop::fault)?);
        if let Some(path) = &self.submission {
            let mut files = Fingerprint::default();
            let path = scene::input::real_path(path).map_err(Stop::bad_input)?;
            files.submission(&path).map_err(Stop::bad_input)?;
            hash.update(files.finish());
        }
        Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
    }
}

fn list() -> Result<(), Stop> {
    let mut words = String::new();
    for problem in PROBLEMS {
        words += &format!("{:22}{}\n", problem.name, problem.title);
    }
    print(words.as_bytes())
}

/// Writes every report and diagram to the folder.
fn write_results(folder: &Path, study: &Study) -> Result<(), Stop> {
    let options = text::AccuracyTextOptions { details: true };
    let report = written(|out| text::write(out, study, options))?;
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
        write_file(&path, &bytes).map_err(Stop::about(&path))?;
    }
    Ok(())
}
