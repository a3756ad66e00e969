//! `grade fuzz`: tests a program on scenes that nobody wrote.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::builder::PossibleValuesParser;
use clap::{Args, ValueEnum};
use fuzzing::campaign::{self, Campaign, Plan};
use fuzzing::draw::Scope;
use fuzzing::judge::{Judge, Subject};
use fuzzing::ours;
use fuzzing::report::{self, json, text};
use fuzzing::shrink::Effort;
use grader::boundary::seal::Secret;
use grader::submission::program::Program;
use grader::suite::assignment::{ALL, Assignment};
use scene::schema::IntegratorSchema;
use simulator::integrator;

use crate::args::{ReportArgs, RootArgs, RunArgs, parse_force};
use crate::interrupt::Interrupt;
use crate::output::{put, write_file, written};
use crate::progress::Progress;
use crate::stop::{Exit, Stop};
use crate::submission::{named_assignment, open_measured};
use crate::terminal::width;

/// Test a program on scenes that nobody wrote, and shrink what fails to the smallest scene that shows it
#[derive(Args)]
#[command(after_help = "\
Examples:
  grade fuzz my-simulator --assignment t1m3
  grade fuzz my-simulator --minutes 10 --force springforce --keep found
  grade fuzz --minutes 1 --seed 7

It finds mistakes and gives no points: a run without a failure proves nothing. docs/fuzzing.md explains a result. Exit codes: \
0 no failure found, 1 a failure, 2 bad usage or input, 3 the program could not be run, 130 interrupted (Ctrl-C).")]
pub(crate) struct FuzzArgs {
    /// Program, or folder with submission.toml [default: the built-in simulator, against the second one and by other
    /// code paths]
    #[arg(value_name = "SUBMISSION")]
    submission: Option<PathBuf>,

    /// Minutes of drawing scenes, shared by the code paths of the built-in simulator; it ends earlier after --failures.
    /// Shrinking comes on top
    #[arg(long, value_name = "M", default_value_t = 2.0, value_parser = parse_minutes, allow_hyphen_values = true)]
    minutes: f64,

    /// The most scenes
    #[arg(long, value_name = "N", default_value_t = u64::MAX, hide_default_value = true)]
    scenes: u64,

    /// Seed of the scenes: with the same seed, a deterministic program has the same result [default: random]
    #[arg(long, value_name = "NUMBER")]
    seed: Option<u64>,

    /// End after so many failures
    #[arg(long, value_name = "N", default_value_t = 40, value_parser = clap::value_parser!(u32).range(1..))]
    failures: u32,

    /// Only what this assignment asks for [default: that of submission.toml, else all]
    #[arg(long, value_name = "NAME")]
    assignment: Option<String>,

    /// Only this force, of those of the assignment (repeatable)
    #[arg(long, value_name = "TAG", value_parser = parse_force())]
    force: Vec<String>,

    /// Only this integrator, of those of the assignment (repeatable)
    #[arg(long, value_name = "NAME", value_parser = parse_integrator())]
    integrator: Vec<String>,

    /// Write the smallest scenes to this folder, as 1.xml, 2.xml, …
    #[arg(long, value_name = "DIR")]
    keep: Option<PathBuf>,

    #[command(flatten)]
    report: ReportArgs<FuzzFormat>,

    #[command(flatten)]
    run: RunArgs,

    #[command(flatten)]
    root: RootArgs,
}

/// Formats of the report of `grade fuzz`.
#[derive(Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
enum FuzzFormat {
    /// For people
    #[default]
    Text,
    /// For programs
    Json,
}

/// Seconds of processor time that a run on a drawn scene may take, which takes a right program some milliseconds. Its trace is less
/// than a megabyte.
const SECONDS: f64 = 5.0;

/// Seconds from start to end: on a busy machine a program waits for its turn, which is no failure.
const WAITING: f64 = 20.0;

fn parse_minutes(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(minutes) if minutes > 0.0 && minutes <= 1e5 => Ok(minutes),
        _ => Err("not a number above 0 and up to 100000; write minutes, such as --minutes 0.5"
            .to_owned()),
    }
}

fn parse_integrator() -> PossibleValuesParser {
    PossibleValuesParser::new(integrator::REGISTRY.iter().map(|kind| kind.schema.name))
}

impl FuzzArgs {
    pub(crate) fn run(&self) -> Result<Exit, Stop> {
        let interrupt = Interrupt::listen()?;
        let seed = match self.seed {
            Some(seed) => seed,
            None => Secret::random().map_err(Stop::fault)?.0 % 1_000_000,
        };
        let paths = ours::Path::all();
        let shares = if self.submission.is_some() { 1 } else { paths.len() };
        let plan = Plan {
            scope: self.scope()?,
            seed,
            time: Duration::from_secs_f64(60.0 * self.minutes) / shares as u32,
            scenes: self.scenes,
            failures: self.failures as usize,
            effort: Effort::default(),
        };
        let mut runs: Vec<(String, Campaign)> = Vec::new();
        if let Some(path) = &self.submission {
            let program = self.program(path)?;
            let name = program.name().line();
            // While the kernel makes or removes the namespaces of a run, others use its core.
            let threads = (rayon::current_num_threads() * 3).div_ceil(2);
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let fuzz = || self.fuzz(&name, &program, Judge::default(), &plan, &interrupt);
            let campaign = pool.map_err(Stop::fault)?.install(fuzz);
            runs.push((name, campaign));
            self.show(&runs)?;
        } else {
            for path in paths {
                if interrupt.is_requested() {
                    break;
                }
                let name = path.name();
                let campaign = self.fuzz(&name, &path, path.judge(), &plan, &interrupt);
                runs.push((name, campaign));
                self.show(&runs[runs.len() - 1..])?;
            }
        }
        self.write(&runs)?;
        if let Some(fault) = runs.iter().find_map(|(_, run)| run.fault.as_ref()) {
            return Err(Stop::fault(fault));
        }
        interrupt.check("the search was interrupted; failures were not shrunk")?;
        Ok(Exit::of(runs.iter().all(|(_, run)| run.tally.wrong == 0)))
    }

    fn fuzz(
        &self,
        name: &str,
        subject: &dyn Subject,
        judge: Judge,
        plan: &Plan,
        interrupt: &Interrupt,
    ) -> Campaign {
        let progress = Progress::new(true, interrupt.clone());
        let notice = |tally: &campaign::Tally| {
            progress.show(&format!("{name}: {}", text::summary(tally, plan.seed)));
        };
        campaign::run(subject, &judge, plan, &|| interrupt.is_requested(), &notice)
    }

    fn scope(&self) -> Result<Scope, Stop> {
        let named = self.assignment.clone();
        let named = named.or_else(|| self.submission.as_deref().and_then(named_assignment));
        let assignment = named.filter(|name| !name.eq_ignore_ascii_case(ALL));
        let assignment = assignment.map(|name| self.root.assignment(&name)).transpose()?;
        let mut scope = Scope::all();
        if let Some(assignment) = &assignment {
            scope = Scope::of(assignment.scope());
            if !has_xml(assignment) {
                return Err(Stop::bad_input(format!(
                    "{}: its scenes are JSON, and drawn scenes are XML\n  help: name another --assignment, or --assignment all",
                    assignment.name
                )));
            }
        }
        let is_chosen = |schema: &&'static IntegratorSchema| {
            self.integrator.is_empty() || self.integrator.iter().any(|name| name == schema.name)
        };
        scope.integrators.retain(|(schema, _)| is_chosen(schema));
        if !self.force.is_empty() {
            scope.forces.retain(|schema| self.force.iter().any(|tag| tag == schema.tag));
        }
        if scope.integrators.is_empty() || !self.force.is_empty() && scope.forces.is_empty() {
            let message = "the assignment has none of these forces or integrators\n  help: `grade assignments` lists what each asks for";
            return Err(Stop::bad_input(message));
        }
        Ok(scope)
    }

    fn program(&self, path: &Path) -> Result<Program, Stop> {
        let program = open_measured(path, &self.run)?;
        let is_set = |name: &str| self.run.limit.iter().any(|(set, _)| set == name);
        let short = [("cpu", SECONDS), ("wall", WAITING), ("trace", sandbox::IN_MEMORY as f64)];
        let short = short.into_iter().filter(|(name, _)| !is_set(name));
        let program = program.with_limits(&short.collect::<Vec<_>>());
        program.asked_to_serve().map_err(Stop::fault)
    }

    /// Whether each run is shown when it ends.
    fn is_shown(&self) -> bool {
        self.report.format == FuzzFormat::Text && self.report.output.is_none()
    }

    /// Shows runs that ended.
    fn show(&self, runs: &[(String, Campaign)]) -> Result<(), Stop> {
        if self.is_shown() { put(&text(runs)?, None) } else { Ok(()) }
    }

    /// Writes the report, if it was not shown, and the smallest scenes.
    fn write(&self, runs: &[(String, Campaign)]) -> Result<(), Stop> {
        if !self.is_shown() {
            let bytes = match self.report.format {
                FuzzFormat::Text => text(runs)?,
                FuzzFormat::Json => json::render(runs).map_err(Stop::fault)?.into_bytes(),
            };
            put(&bytes, self.report.output.as_deref())?;
        }
        let Some(folder) = &self.keep else { return Ok(()) };
        std::fs::create_dir_all(folder).map_err(Stop::about(folder))?;
        let discoveries = runs.iter().flat_map(|(_, run)| &run.discoveries);
        for (number, discovery) in discoveries.enumerate() {
            let path = folder.join(format!("{}.xml", number + 1));
            write_file(&path, report::file(discovery).as_bytes()).map_err(Stop::about(&path))?;
        }
        Ok(())
    }
}

/// The text of runs.
fn text(runs: &[(String, Campaign)]) -> Result<Vec<u8>, Stop> {
    written(|out| runs.iter().try_for_each(|(name, run)| text::write(out, name, run, width())))
}

/// Whether an assignment has scenes in XML.
fn has_xml(assignment: &Assignment) -> bool {
    let formats = &assignment.scope().formats;
    formats.as_ref().is_none_or(|formats| formats.iter().any(|format| format == "xml"))
}
