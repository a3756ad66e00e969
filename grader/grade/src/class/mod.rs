//! `grade class`: plans the grading of every submission in a folder, and runs the plan here or on a cluster.
//!
//! ```text
//! setting.rs   the options and inputs that all submissions share; the key of a submission
//! shard.rs     grades submissions, one after the other        grade class run-shard PLAN K
//! merge.rs     writes the summary from the results            grade class merge PLAN
//! gradebook.rs writes gradebooks from the rows and the roster
//! similar.rs   lists what the sources of hand-ins share
//! slurm.rs     submits both as jobs, and follows them
//! ```
//!
//! With hidden scenes, every shard runs twice: `run-shard PLAN K --hidden-scenes` after the first phase of all shards.
//! Grading on this machine is the same plan: its shards run in this process, then the merge.

mod gradebook;
mod merge;
mod setting;
mod shard;
mod similar;
mod slurm;

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use clap::Parser;
use grader::class::entry::{self, ClassEntry, PassedOver};
use grader::class::plan::{Plan, Planned};
use grader::class::record::{Foreign, Record};
use grader::grading::events::Observer;
use grader::suite::hash_bytes;
use rayon::prelude::*;
use report::class::{ALTERED, Gap, Missing};
use report::html::{self, ClassResult};

use crate::args::{ClassArgs, ClassCommand, ClassPart, Cli, Command, GradebookArgs, On};
use crate::output::{print, replace_file};
use crate::stop::{Exit, Stop, complain};
use setting::Class;

/// A pass over the submissions.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// The shipped scenes; without hidden ones, it completes every submission.
    Shipped,
    /// The hidden scenes.
    Hidden,
}

/// Name of the plan in the folder of the results.
const PLAN: &str = "plan.json";

/// Time of a shard by default, in seconds: far more than a job takes to start.
const SHARD_SECONDS: f64 = 60.0;

/// Maximum number of shards by default: half of the jobs that a Slurm queues by default.
const MAX_SHARDS: u32 = 5000;

pub(super) fn run(command: &ClassCommand) -> Result<Exit, Stop> {
    match command {
        ClassCommand::Part(ClassPart::RunShard { plan, shard, hidden_scenes, threads }) => {
            let phase = if *hidden_scenes { Phase::Hidden } else { Phase::Shipped };
            run_shard(plan, *shard, phase, *threads)
        }
        ClassCommand::Part(ClassPart::Merge { plan, gradebook }) => {
            planned(plan, with(gradebook)?, |class, plan| class.merge(plan))
        }
        ClassCommand::Similar(args) => similar::list(args),
        ClassCommand::Whole(args) if args.plan.attach => {
            planned(&args.output.join(PLAN), with(&args.gradebook)?, slurm::follow)
        }
        ClassCommand::Whole(args) if args.plan.cancel => slurm::cancel(&args.output),
        ClassCommand::Whole(args) => grade(args),
    }
}

/// Puts these gradebooks in the place of those of a plan, if there is a roster.
fn with(gradebook: &GradebookArgs) -> Result<impl FnOnce(&mut ClassArgs), Stop> {
    // Plans are read in another folder.
    let gradebook = gradebook.absolute().map_err(Stop::bad_input)?;
    Ok(move |args: &mut ClassArgs| {
        if gradebook.roster.is_some() {
            args.gradebook = gradebook;
        }
    })
}

fn grade(args: &ClassArgs) -> Result<Exit, Stop> {
    let unreadable = |error| Stop::bad_input(format!("{}: {error}", args.folder.display()));
    let (entries, passed_over) = entry::list(&args.folder).map_err(unreadable)?;
    if entries.is_empty() {
        return Err(Stop::bad_input(format!(
            "{}: no submissions found\n  help: put programs, or folders with submission.toml, there",
            args.folder.display()
        )));
    }
    let most = match args.plan.on {
        On::Slurm => slurm::ready(&args.output)?,
        On::Local | On::Nothing => 0,
    };
    let class = Class::open(args)?;
    class.roster(&entries.iter().map(|entry| &*entry.name).collect::<Vec<_>>())?;
    let plan = class.plan(entries, passed_over)?;
    let path = args.output.join(PLAN);
    save(&path, plan.render(&class.seal).map_err(Stop::fault)?.as_bytes())?;
    match args.plan.on {
        On::Local => {
            for phase in class.phases() {
                for shard in 0..plan.shards.len() {
                    class.run(&plan, &plan.shard(shard).map_err(Stop::fault)?, *phase)?;
                }
            }
            class.merge(&plan)
        }
        On::Slurm => {
            let path = std::path::absolute(&path).map_err(|error| unwritable(&path, &error))?;
            if !plan.shards.is_empty() {
                // Jobs of an incomplete submission would leave gaps.
                slurm::submit(&class, &plan, &path, most).inspect_err(|_| {
                    let _ = slurm::cancel(&args.output);
                })?;
            }
            slurm::follow(&class, &plan)
        }
        On::Nothing => {
            let (path, shards) = (path.display(), plan.shards.len());
            let text = match shards {
                0 => format!("{path}: nothing to grade\n  grade class merge {path}\n"),
                _ => {
                    let hidden = match class.phases() {
                        [Phase::Shipped] => String::new(),
                        _ => format!(
                            "  grade class run-shard {path} K --hidden-scenes    the same, when all of these ended\n"
                        ),
                    };
                    format!(
                        "{path}: {shards} shards\n  grade class run-shard {path} K    for K from 0 to {}, anywhere, in \
                         any order\n{hidden}  grade class merge {path}          at the end\n",
                        shards - 1
                    )
                }
            };
            print(text.as_bytes())?;
            Ok(Exit::Passed)
        }
    }
}

/// Grades one shard of a plan, or its hidden scenes.
fn run_shard(path: &Path, shard: usize, phase: Phase, threads: Option<u16>) -> Result<Exit, Stop> {
    let set = |args: &mut ClassArgs| args.suite.threads = threads.or(args.suite.threads);
    planned(path, set, |class, plan| {
        let groups = plan.shard(shard).map_err(Stop::bad_input)?;
        if !class.phases().contains(&phase) {
            return Err(Stop::bad_input("the class has no hidden scenes"));
        }
        if phase == Phase::Hidden {
            class.check_first_phases(plan)?;
        }
        class.run(plan, &groups, phase)?;
        let places: Vec<&usize> = groups.iter().flatten().collect();
        let is_done = |place: &&&usize| {
            let planned = &plan.submissions[***place];
            let is_begun = || class.first_phase(plan, planned).is_some();
            class.is_done(plan, planned) || phase == Phase::Shipped && is_begun()
        };
        let (done, total) = (places.iter().filter(is_done).count(), places.len());
        if done == total {
            return Ok(Exit::Passed);
        }
        let is_stopped = class.progress.is_stopped();
        let exit = if is_stopped { Exit::Interrupted } else { Exit::GraderFault };
        Err(Stop(exit, format!("shard {shard}: {done} of {total} submissions graded")))
    })
}

/// Opens the class of a plan for `work`, in the folder and with the arguments that it was planned with, as far as `set`
/// does not change them.
fn planned(
    path: &Path,
    set: impl FnOnce(&mut ClassArgs),
    work: impl FnOnce(&Class<'_>, &Plan) -> Result<Exit, Stop>,
) -> Result<Exit, Stop> {
    let path = std::path::absolute(path).map_err(|error| unwritable(path, &error))?;
    let plan = Plan::read(&path).map_err(Stop::bad_input)?;
    std::env::set_current_dir(&plan.folder).map_err(|error| unwritable(&plan.folder, &error))?;
    let command = Cli::try_parse_from(
        std::iter::once("grade").chain(plan.arguments.iter().map(String::as_str)),
    );
    let command = command.ok().and_then(|cli| cli.command);
    let Some(Command::Class(ClassCommand::Whole(mut args))) = command else {
        let path = path.display();
        return Err(Stop::bad_input(format!("{path}: the arguments are not those of grade class")));
    };
    set(&mut args);
    let class = Class::open(&args)?;
    if class.inputs_hash() != plan.inputs {
        return Err(Stop::bad_input(format!(
            "{}: the scenes, their traces, the rubric, the marks or grade changed after the plan was made\n  help: plan again \
             with --resume",
            path.display()
        )));
    }
    work(&class, &plan)
}

impl Class<'_> {
    /// Checks that the shipped scenes of all submissions have run, except of those that changed.
    fn check_first_phases(&self, plan: &Plan) -> Result<(), Stop> {
        let waits = |planned: &&Planned| {
            let has_run =
                self.first_phase(plan, planned).is_some() || self.record(plan, planned).is_some();
            !has_run && self.key(&planned.name).0 == planned.key
        };
        match plan.submissions.iter().filter(waits).count() {
            0 => Ok(()),
            waiting => Err(Stop(
                Exit::GraderFault,
                format!(
                    "the shipped scenes of {waiting} submissions have not run, and hidden scenes run after those of \
                     all\n  help: run every shard without --hidden-scenes first; after a job that failed, continue with \
                     --resume"
                ),
            )),
        }
    }

    /// The plan of these submissions; with --resume, of those that have no result.
    fn plan(&self, entries: Vec<ClassEntry>, passed_over: Vec<PassedOver>) -> Result<Plan, Stop> {
        let argument = |argument: std::ffi::OsString| {
            argument.into_string().map_err(|argument| {
                let argument = argument.display();
                Stop::bad_input(format!("{argument}: is not UTF-8, and cannot be part of a plan"))
            })
        };
        let arguments = std::env::args_os().skip(1).map(argument).collect::<Result<_, _>>()?;
        let folder = std::env::current_dir().map_err(Stop::fault)?;
        let submissions: Vec<Planned> =
            entries.into_par_iter().map(|entry| self.planned(entry)).collect();
        let mut plan = Plan::new((folder, arguments), self.inputs_hash(), submissions, passed_over);
        if !self.args.resume {
            let moment = format!("{:?} {}", SystemTime::now(), std::process::id());
            plan.anew = Some(hash_bytes(moment.as_bytes()));
        }
        let places = 0..plan.submissions.len();
        let places: Vec<usize> = places
            .into_par_iter()
            .filter(|place| !self.is_done(&plan, &plan.submissions[*place]))
            .collect();
        let seconds: BTreeMap<usize, f64> = places
            .par_iter()
            .filter_map(|place| {
                let planned = &plan.submissions[*place];
                match Record::load(&self.record_path(planned), &planned.report, &self.seal) {
                    Ok(record) => Some((*place, record?.seconds)),
                    Err(Foreign) => {
                        let note = format!("{}: {ALTERED}; graded again", planned.name);
                        // Without --resume, no record counts.
                        self.args.resume.then(|| complain("note", note))?;
                        None
                    }
                }
            })
            .collect();
        let shards = self.args.plan.shards.unwrap_or_else(|| match self.args.plan.on {
            On::Local => 1,
            On::Slurm | On::Nothing => {
                let shards = plan.estimate(&places, &seconds) / SHARD_SECONDS;
                (shards.ceil() as u32).clamp(1, MAX_SHARDS)
            }
        });
        plan.divide(&places, &seconds, shards as usize);
        // Shards recognise the folder of the pages by its first page.
        if let Some(pages) = self.pages.as_ref().filter(|pages| !pages.is_written("")) {
            let passed_over = &plan.passed_over;
            let names = plan.submissions.iter().map(|planned| &*planned.name);
            let gaps: Vec<Gap<'_>> =
                names.map(|name| Gap { name, missing: Missing::NotReached }).collect();
            let Self { protections, provenance, .. } = self;
            let result =
                ClassResult { rows: &[], gaps: &gaps, passed_over, protections, provenance };
            pages.write("", |sink| html::class(&result, sink))?;
        }
        Ok(plan)
    }
}

fn save(path: &Path, bytes: &[u8]) -> Result<(), Stop> {
    replace_file(path, bytes).map_err(|error| unwritable(path, &error))
}

fn unwritable(path: &Path, error: &io::Error) -> Stop {
    Stop::bad_input(format!("{}: {error}", path.display()))
}

/// The folder of the results, without links.
fn real(output: &Path) -> Result<PathBuf, Stop> {
    std::fs::canonicalize(output).map_err(|error| unwritable(output, &error))
}
