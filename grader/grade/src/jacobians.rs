//! `grade jacobians`: checks the Jacobians of the built-in simulator or of a submission.

use std::io;
use std::path::Path;

use grader::findings::Findings;
use grader::grading::Grading;
use grader::grading::Hidden;
use grader::probe;
use grader::suite::assignment::{ALL, Assignment};
use grader::white_box::{self, JacobianReport};

use grader::rubric::{FaultPoints, Rubric};
use grader::submission::Submission;
use report::{SceneTimes, html};
use simulator::solver::linear::LinearSolver;

use crate::args::{Format, JacobianArgs};
use crate::grading::named_assignment;
use crate::inputs::find_assignment;
use crate::output::{put, write_file};
use crate::pages::Pages;
use crate::reports::render;
use crate::stop::{Exit, Stop};
use crate::submission::open_program;

pub(super) fn check(args: &JacobianArgs) -> Result<Exit, Stop> {
    let pages = args.html.as_deref().map(Pages::open).transpose()?;
    if let Some(submission) = &args.submission {
        return probe_program(submission, args, pages);
    }
    let config = white_box::Config { states: args.states, seed: args.seed };
    let jacobians = match &args.force {
        Some(tag) => JacobianReport {
            forces: white_box::check_forces(config, |force| force == tag),
            ..JacobianReport::default()
        },
        None => white_box::check_all(config),
    };
    let grading = Grading {
        submission: Submission::BuiltIn(LinearSolver::Auto).name(),
        assignment: None,
        fitting: None,
        is_own: true,
        features: Vec::new(),
        jacobians,
        protection: None,
        repetition: None,
        probing: None,
        copied: None,
        creative: None,
        findings: Findings::default(),
        hidden: Hidden::None,
        faults: FaultPoints::default(),
        interrupted: None,
        provenance: None,
    };
    let bytes = render(args.format, &grading, &SceneTimes::new(), |out| {
        let config = report::jacobians::text::JacobianTextOptions { details: args.details };
        report::jacobians::text::write(out, &grading.jacobians, config)
    })?;
    put(&bytes, args.output.as_deref())?;
    if let Some(pages) = pages {
        pages.write("", |sink| html::single(&html::jacobians(&grading.jacobians, &[])?, sink))?;
        pages.announce();
    }
    if let Some(folder) = &args.plot {
        plot(folder, &grading.jacobians)?;
    }
    Ok(if grading.jacobians.is_pass() { Exit::Passed } else { Exit::Failed })
}

/// Writes one plot per force.
pub(super) fn plot(folder: &Path, jacobians: &JacobianReport) -> Result<(), Stop> {
    let unwritable =
        |path: &Path, error: io::Error| Stop::bad_input(format!("{}: {error}", path.display()));
    std::fs::create_dir_all(folder).map_err(|error| unwritable(folder, error))?;
    for check in &jacobians.forces {
        let Some(curves) = white_box::curves(check) else { continue };
        let svg = studies::report::jacobians::render(&curves).map_err(Stop::fault)?;
        let name = format!("{}-{}d.svg", check.tag, check.dimension.count());
        let path = folder.join(name);
        write_file(&path, svg.as_bytes()).map_err(|error| unwritable(&path, error))?;
    }
    Ok(())
}

/// Black-box check of a program, from its traces alone.
pub(super) fn probe_program(
    path: &Path,
    args: &JacobianArgs,
    pages: Option<Pages>,
) -> Result<Exit, Stop> {
    let named = args.assignment.clone().or_else(|| named_assignment(path));
    let assignment = named.filter(|name| name != ALL);
    let assignment =
        assignment.map(|name| find_assignment(&name, args.root.as_deref())).transpose()?;
    let scope = assignment.as_ref().map(Assignment::scope);
    // This command needs no suite and no rubric.
    let rubric = Rubric::default();
    let program = match open_program(path, &args.run, &rubric, &[])? {
        (Submission::Program(program), _) => program,
        (Submission::Unusable { name, failure }, _) => {
            return Err(Stop::bad_input(format!("{}: {failure}", name.line())));
        }
        _ => return Err(Stop::bad_input(format!("{}: not a program", path.display()))),
    };
    let is_chosen = |tag: &str| args.force.as_ref().is_none_or(|force| force == tag);
    let selected = |tag: &str, dimension| {
        is_chosen(tag) && scope.is_none_or(|scope| scope.offers(tag, dimension))
    };
    let mut probing = probe::probe(&program, selected);
    let of_assignment = scope.filter(|scope| scope.has_jacobians());
    let of_assignment = of_assignment.and_then(|scope| scope.forces.clone()).unwrap_or_default();
    probing.required = if args.require.is_empty() { of_assignment } else { args.require.clone() };
    probing.required.retain(|tag| is_chosen(tag));
    let bytes = match args.format {
        Format::Text => {
            let config = report::probe::text::ProbeTextOptions { details: args.details };
            let mut bytes = Vec::new();
            report::probe::text::write(&mut bytes, &probing, config).map_err(Stop::fault)?;
            bytes
        }
        Format::Json => report::probe::json::render(&probing).map_err(Stop::fault)?.into_bytes(),
        Format::Junit => report::probe::junit::render(&probing).map_err(Stop::fault)?.into_bytes(),
    };
    put(&bytes, args.output.as_deref())?;
    if let Some(pages) = pages {
        pages.write("", |sink| {
            html::single(&html::probing(&probing, &probing.name.line(), &[]), sink)
        })?;
        pages.announce();
    }
    Ok(if probing.is_pass() { Exit::Passed } else { Exit::Failed })
}
