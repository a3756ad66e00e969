//! `grade stability`: runs the hard cases, and compares stability boundaries with theory.

use std::collections::HashSet;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};

use grader::suite::selection::{self, Candidate};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use studies::report::stability as report;
use studies::stability::cases::{self, Case};
use studies::stability::expected::Expectations;
use studies::stability::store::Store;
use studies::stability::theory::map::Map;
use studies::stability::{self, Config, StabilityReport};

use crate::args::{StabilityArgs, TableFormat};
use crate::inputs::find_root;
use crate::output::{put, write_file};
use crate::pages::Pages;
use crate::stop::{Exit, Stop, complain};

pub(super) fn run(args: &StabilityArgs) -> Result<Exit, Stop> {
    let pages = args.html.as_deref().map(Pages::open).transpose()?;
    let path = expected_path(args)?;
    let mut expectations = Expectations::load(&path).map_err(Stop::bad_input)?;
    let store = match &args.resume {
        Some(folder) => Some(Store::open(folder).map_err(|error| unusable(folder, &error))?),
        None => None,
    };
    let selected = selected(&args.only)?;
    let config = Config { quick: args.quick, robust: args.robust };
    let bar = progress_bar();
    let trials =
        stability::run(config, store.as_ref(), |name| selected.contains(name), &|done, total| {
            bar.set_length(total as u64);
            bar.set_position(done as u64);
        });
    bar.finish_and_clear();
    let theory = if args.only.is_empty() {
        stability::against_theory(config)
    } else {
        StabilityReport::default()
    };
    if args.accept {
        expectations.accept(&trials);
        let bytes = expectations.render().map_err(Stop::fault)?;
        write_file(&path, &bytes).map_err(|error| unusable(&path, &error))?;
        complain("note", format!("{}: {} outcomes accepted", path.display(), trials.len()));
    }
    let changes = expectations.compare(&trials);
    let report = StabilityReport { trials, changes, ..theory };
    let bytes = match args.format {
        TableFormat::Text => {
            let mut bytes = Vec::new();
            report::text::write(&mut bytes, &report).map_err(Stop::fault)?;
            bytes
        }
        TableFormat::Json => report::json::render(&report).map_err(Stop::fault)?.into_bytes(),
        TableFormat::Csv => report::csv::render(&report).map_err(Stop::fault)?,
    };
    put(&bytes, args.output.as_deref())?;
    if let Some(pages) = pages {
        pages.write("", |sink| report::html::write(&report, sink))?;
        pages.announce();
    }
    if let Some(folder) = &args.plot {
        plot(folder, &report.maps)?;
    }
    Ok(if report.is_pass() { Exit::Passed } else { Exit::Failed })
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

fn expected_path(args: &StabilityArgs) -> Result<PathBuf, Stop> {
    match &args.expected {
        Some(path) => Ok(path.clone()),
        None => Ok(find_root()?.join("docs/stability-expected.csv")),
    }
}

fn unusable(path: &Path, error: &io::Error) -> Stop {
    Stop::bad_input(format!("{}: {error}", path.display()))
}

/// A progress bar, if standard error is a terminal.
fn progress_bar() -> ProgressBar {
    let target = match io::stderr().is_terminal() {
        true => ProgressDrawTarget::stderr(),
        false => ProgressDrawTarget::hidden(),
    };
    let bar = ProgressBar::with_draw_target(Some(1), target);
    let style = "hard cases {wide_bar} {human_pos} of {human_len}, {eta} left";
    bar.set_style(
        ProgressStyle::with_template(style).unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    bar
}

/// Writes one map per method.
fn plot(folder: &Path, maps: &[Map]) -> Result<(), Stop> {
    std::fs::create_dir_all(folder).map_err(|error| unusable(folder, &error))?;
    for map in maps {
        let svg = report::plot::svg(map).map_err(Stop::fault)?;
        let path = folder.join(format!("stability-{}.svg", map.method));
        std::fs::write(&path, svg).map_err(|error| unusable(&path, &error))?;
    }
    Ok(())
}
