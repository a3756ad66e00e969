//! `grade stability`: runs the hard cases, and compares stability boundaries with theory.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use grader::suite::selection::{self, Candidate};
use studies::report::stability as report;
use studies::stability::cases::{self, Case};
use studies::stability::expected::Expectations;
use studies::stability::store::Store;
use studies::stability::theory::map::Map;
use studies::stability::{self, Config, StabilityReport};

use crate::args::ReportArgs;
use crate::bar::Bar;
use crate::inputs::find_root;
use crate::installed::refuse_change;
use crate::output::{put, write_file, written};
use crate::pages::Pages;
use crate::stop::{Exit, Stop, complain};

/// Run hard cases and compare with the expected outcomes; compare stability boundaries with theory
#[derive(Args)]
#[command(after_help = "\
Examples:
  grade stability --quick
  grade stability --only \"stiff*\" --robust
  grade stability --resume trials --plot maps")]
pub(crate) struct StabilityArgs {
    /// Use fewer steps and damping ratios: some seconds in all
    #[arg(long)]
    quick: bool,

    /// Run failed cases again with fallbacks for failed steps: line search and smaller steps
    #[arg(long)]
    robust: bool,

    /// Run only these cases, without the comparison with theory (repeatable): a name, a pattern with * and ?, or a
    /// part of names
    #[arg(long, value_name = "PATTERN")]
    only: Vec<String>,

    /// Accept the outcomes of this run as the expected ones
    #[arg(long)]
    accept: bool,

    /// File of the expected outcomes [default: docs/stability-expected.csv in the folder with assets/]
    #[arg(long, value_name = "FILE")]
    expected: Option<PathBuf>,

    /// Keep finished trials in this folder, and continue an interrupted run from there
    #[arg(long, value_name = "DIR")]
    resume: Option<PathBuf>,

    /// Write one map per method (SVG) to this folder: where it is stable, and how much it damps
    #[arg(long, value_name = "DIR")]
    plot: Option<PathBuf>,

    /// Write the report as a page to this folder too, with the maps
    #[arg(long, value_name = "DIR")]
    html: Option<PathBuf>,

    #[command(flatten)]
    report: ReportArgs<TableFormat>,
}

/// Formats of tables.
#[derive(Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
enum TableFormat {
    /// For people
    #[default]
    Text,
    /// For programs
    Json,
    /// For spreadsheets: one row per trial
    Csv,
}

impl StabilityArgs {
    pub(crate) fn run(&self) -> Result<Exit, Stop> {
        let pages = self.html.as_deref().map(Pages::open).transpose()?;
        let path = self.expected_path()?;
        if self.accept {
            refuse_change(&path)?;
        }
        let mut expectations = Expectations::load(&path).map_err(Stop::bad_input)?;
        let open = |folder: &PathBuf| Store::open(folder).map_err(Stop::about(folder));
        let store = self.resume.as_ref().map(open).transpose()?;
        let selected = selected(&self.only)?;
        let config = Config { quick: self.quick, robust: self.robust };
        let bar = Bar::new("hard cases {wide_bar} {human_pos} of {human_len}, {eta} left");
        let trials = stability::run(
            config,
            store.as_ref(),
            |name| selected.contains(name),
            &|done, total| {
                bar.advance(done, total);
            },
        );
        bar.clear();
        let theory = if self.only.is_empty() {
            stability::against_theory(config)
        } else {
            StabilityReport::default()
        };
        if self.accept {
            expectations.accept(&trials);
            let bytes = expectations.render().map_err(Stop::fault)?;
            write_file(&path, &bytes).map_err(Stop::about(&path))?;
            complain("note", format!("{}: {} outcomes accepted", path.display(), trials.len()));
        }
        let changes = expectations.compare(&trials);
        let report = StabilityReport { trials, changes, ..theory };
        let bytes = match self.report.format {
            TableFormat::Text => written(|out| report::text::write(out, &report))?,
            TableFormat::Json => report::json::render(&report).map_err(Stop::fault)?.into_bytes(),
            TableFormat::Csv => report::csv::render(&report).map_err(Stop::fault)?,
        };
        put(&bytes, self.report.output.as_deref())?;
        if let Some(pages) = pages {
            pages.publish(|sink| report::html::write(&report, sink))?;
        }
        if let Some(folder) = &self.plot {
            plot(folder, &report.maps)?;
        }
        Ok(Exit::of(report.is_pass()))
    }

    fn expected_path(&self) -> Result<PathBuf, Stop> {
        match &self.expected {
            Some(path) => Ok(path.clone()),
            None => Ok(find_root()?.join("docs/stability-expected.csv")),
        }
    }
}

/// The names of the cases that match these patterns.
fn selected(only: &[String]) -> Result<HashSet<&'static str>, Stop> {
    let candidate = |case: &Case| Candidate { name: case.name, group: None, integrator: None };
    let candidates: Vec<Candidate<'static>> = cases::all().map(candidate).collect();
    let chosen = selection::choose(only, &candidates).map_err(|error| {
        Stop::bad_input(format!("{error}\n  help: docs/stability-expected.csv lists the cases"))
    })?;
    let chosen = candidates.iter().zip(chosen).filter(|(_, is_chosen)| *is_chosen);
    Ok(chosen.map(|(candidate, _)| candidate.name).collect())
}

/// Writes one map per method.
fn plot(folder: &Path, maps: &[Map]) -> Result<(), Stop> {
    std::fs::create_dir_all(folder).map_err(Stop::about(folder))?;
    for map in maps {
        let svg = report::plot::svg(map).map_err(Stop::fault)?;
        let path = folder.join(format!("stability-{}.svg", map.method));
        std::fs::write(&path, svg).map_err(Stop::about(&path))?;
    }
    Ok(())
}
