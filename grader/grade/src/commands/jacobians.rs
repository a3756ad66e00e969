//! `grade jacobians`: checks the Jacobians of the built-in simulator or of a submission.

use std::path::{Path, PathBuf};

use clap::Args;
use grader::grading::Grading;
use grader::probe;
use grader::submission::Submission;
use grader::suite::assignment::{ALL, Assignment};
use grader::white_box::{self, JacobianReport};
use report::{SceneTimes, html};
use simulator::solver::linear::LinearSolver;

use crate::args::{Format, ReportArgs, RootArgs, RunArgs, parse_force};
use crate::output::{put, write_file, written};
use crate::pages::Pages;
use crate::reports::render;
use crate::stop::{Exit, Stop};
use crate::submission::{named_assignment, open_measured};

/// Check the Jacobians of each force, block by block: correct, wrong or inconclusive
#[derive(Args)]
#[command(after_help = "\
Examples:
  grade jacobians
  grade jacobians --force springforce --details --plot plots
  grade jacobians my-simulator --html pages")]
pub(crate) struct JacobianArgs {
    /// Program, or folder with submission.toml, whose forces and Jacobians to measure [default: check the built-in
    /// simulator]
    #[arg(value_name = "SUBMISSION", conflicts_with_all = ["states", "seed", "plot"])]
    submission: Option<PathBuf>,

    #[command(flatten)]
    run: RunArgs,

    /// Number of random states per force and dimension, in addition to the hard ones
    #[arg(long, value_name = "N", default_value_t = white_box::Config::default().states, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    states: u32,

    /// Seed of the random states
    #[arg(long, value_name = "N", default_value_t = white_box::Config::default().seed)]
    seed: u64,

    /// Check only this force
    #[arg(long, value_name = "TAG", value_parser = parse_force())]
    force: Option<String>,

    /// Forces that the program must offer, separated by commas [default: those of its assignment, if any]
    #[arg(long, value_name = "TAG", value_delimiter = ',', requires = "submission", value_parser = parse_force())]
    require: Vec<String>,

    /// Measure only the forces and dimensions of this assignment [default: that of submission.toml, else all]
    #[arg(long, value_name = "NAME", requires = "submission")]
    assignment: Option<String>,

    #[command(flatten)]
    root: RootArgs,

    #[command(flatten)]
    report: ReportArgs<Format>,

    /// Write the report as a page to this folder too, with the blocks as heat maps
    #[arg(long, value_name = "DIR")]
    html: Option<PathBuf>,

    /// Show the blocks and the state for every verdict, not only for those that are not correct (text only)
    #[arg(long)]
    details: bool,

    /// Write one plot per force (SVG) to this folder: errors of finite differences and of Taylor's test by step size
    #[arg(long, value_name = "DIR")]
    plot: Option<PathBuf>,
}

impl JacobianArgs {
    pub(crate) fn run(&self) -> Result<Exit, Stop> {
        let pages = self.html.as_deref().map(Pages::open).transpose()?;
        if let Some(submission) = &self.submission {
            return self.probe(submission, pages);
        }
        let config = white_box::Config { states: self.states, seed: self.seed };
        let jacobians = match &self.force {
            Some(tag) => JacobianReport {
                forces: white_box::check_forces(config, |force| force == tag),
                ..JacobianReport::default()
            },
            None => white_box::check_all(config),
        };
        let submission = Submission::BuiltIn(LinearSolver::Auto).name();
        let grading = Grading { submission, is_own: true, jacobians, ..Grading::default() };
        let bytes = render(self.report.format, &grading, &SceneTimes::new(), |out| {
            let config = report::jacobians::text::JacobianTextOptions { details: self.details };
            report::jacobians::text::write(out, &grading.jacobians, config)
        })?;
        put(&bytes, self.report.output.as_deref())?;
        if let Some(pages) = pages {
            pages.publish(|sink| html::single(&html::jacobians(&grading.jacobians, &[])?, sink))?;
        }
        if let Some(folder) = &self.plot {
            plot(folder, &grading.jacobians)?;
        }
        Ok(Exit::of(grading.jacobians.is_pass()))
    }

    /// Black-box check of a program, from its traces alone.
    fn probe(&self, path: &Path, pages: Option<Pages>) -> Result<Exit, Stop> {
        let named = self.assignment.clone().or_else(|| named_assignment(path));
        let assignment = named.filter(|name| !name.eq_ignore_ascii_case(ALL));
        let assignment = assignment.map(|name| self.root.assignment(&name)).transpose()?;
        let scope = assignment.as_ref().map(Assignment::scope);
        let program = open_measured(path, &self.run)?;
        let is_chosen = |tag: &str| self.force.as_ref().is_none_or(|force| force == tag);
        let selected = |tag: &str, dimension| {
            is_chosen(tag) && scope.is_none_or(|scope| scope.offers(tag, dimension))
        };
        let mut probing = probe::probe(&program, selected);
        let of_assignment = scope.filter(|scope| scope.has_jacobians());
        let of_assignment =
            of_assignment.and_then(|scope| scope.forces.clone()).unwrap_or_default();
        probing.required =
            if self.require.is_empty() { of_assignment } else { self.require.clone() };
        probing.required.retain(|tag| is_chosen(tag));
        let bytes = match self.report.format {
            Format::Text => {
                let options = report::probe::text::ProbeTextOptions { details: self.details };
                written(|out| report::probe::text::write(out, &probing, options))?
            }
            Format::Json => {
                report::probe::json::render(&probing).map_err(Stop::fault)?.into_bytes()
            }
            Format::Junit => {
                report::probe::junit::render(&probing).map_err(Stop::fault)?.into_bytes()
            }
        };
        put(&bytes, self.report.output.as_deref())?;
        if let Some(pages) = pages {
            pages.publish(|sink| {
                html::single(&html::probing(&probing, &probing.name.line(), &[]), sink)
            })?;
        }
        Ok(Exit::of(probing.is_pass()))
    }
}

/// Writes one plot per force.
fn plot(folder: &Path, jacobians: &JacobianReport) -> Result<(), Stop> {
    std::fs::create_dir_all(folder).map_err(Stop::about(folder))?;
    for check in &jacobians.forces {
        let Some(curves) = white_box::curves(check) else { continue };
        let svg = studies::report::jacobians::render(&curves).map_err(Stop::fault)?;
        let name = format!("{}-{}d.svg", check.tag, check.dimension.count());
        let path = folder.join(name);
        write_file(&path, svg.as_bytes()).map_err(Stop::about(&path))?;
    }
    Ok(())
}
