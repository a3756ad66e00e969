//! `grade class`: plans the grading of every submission in a folder, and runs the plan here or on a cluster.
//!
//! ```text
//! arrange.rs   one folder a student, where a platform laid out the class
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

mod arrange;
mod gradebook;
mod merge;
mod setting;
mod shard;
mod similar;
mod slurm;

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use std::time::SystemTime;

use clap::{Args, FromArgMatches, Subcommand, ValueEnum};
use grader::class::entry::{self, ClassEntry, PassedOver};
use grader::class::layout::Layout;
use grader::class::plan::{Plan, Planned};
use grader::class::record::{Foreign, Record};
use grader::grading::events::Observer;
use grader::submission::folder::is_submission;
use grader::suite::hash_bytes;
use rayon::prelude::*;
use report::class::{ALTERED, Gap, Missing};
use report::html::{self, ClassResult};

use crate::args::{DetailsArgs, Format, JudgeArgs, RunArgs, SuiteArgs, parse_named};
use crate::output::{print, replace_file};
use crate::stop::{Exit, Stop, complain};
use arrange::{HAND_INS, arrange};
use gradebook::GradebookArgs;
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

/// Grade every submission in a folder, here or on a cluster: one report each, and a summary table
#[derive(Args)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = "\
Examples:
  grade class hand-ins -o results
  grade class hand-ins -o results --assignment t1m3 --html pages --resume
  grade class hand-ins -o results --roster roster.csv --gradebook canvas=grades.csv
  grade class canvas-download -o results --layout canvas --roster roster.csv
  grade class hand-ins -o results --on slurm --at-once 50
  grade class hand-ins --similar --starter starter-code

Exit codes: 0 all graded, whatever their verdicts; 2 bad usage or input; 3 something could not be judged or written, or is \
no hand-in that can be graded; 130 some are not graded (Ctrl-C, or a result is missing); continue with --resume."
)]
pub(crate) struct ClassCommand {
    #[command(subcommand)]
    part: Option<ClassPart>,

    #[command(flatten)]
    place: Option<ClassPlace>,

    #[command(flatten)]
    args: ClassArgs,
}

/// A part of a plan. Parts can run anywhere, in any order, at the same time and more than once.
#[derive(Subcommand)]
enum ClassPart {
    /// Grade the submissions of a shard that have no result yet
    #[command(after_help = "\
Examples:
  grade class run-shard results/plan.json 0")]
    RunShard {
        /// The plan: plan.json in the folder of the results
        #[arg(value_name = "PLAN")]
        plan: PathBuf,

        /// Number of the shard, from 0
        #[arg(value_name = "K")]
        shard: usize,

        /// Run the hidden scenes, after the shards have run without this option
        #[arg(long)]
        hidden_scenes: bool,

        /// Number of threads [default: as planned, else one per core]
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
        threads: Option<u16>,
    },
    /// Write the summary of a plan from the results that there are
    #[command(after_help = "\
Examples:
  grade class merge results/plan.json")]
    Merge {
        /// The plan: plan.json in the folder of the results
        #[arg(value_name = "PLAN")]
        plan: PathBuf,

        /// As for the whole class; without a roster, those of the plan
        #[command(flatten)]
        gradebook: GradebookArgs,
    },
}

/// The folders of a class. Clap can tell that they are given only if no group of arguments is in them.
#[derive(Args)]
struct ClassPlace {
    /// Folder of submissions: programs, folders with submission.toml, archives of them; with --pack, sources; folders of traces
    /// if the rubric allows them. Downloads of Canvas, Gradescope and Moodle, also
    /// as archives, and clones from GitHub, are recognised
    #[arg(value_name = "DIR")]
    folder: PathBuf,

    /// How the folder is laid out [default: recognised]
    #[arg(long, value_name = "NAME", value_parser = parse_named(Layout::ALL, Layout::name))]
    layout: Option<Layout>,

    /// Folder for the reports (reports/NAME.txt, …), summary.txt and summary.csv, created if missing
    #[arg(short, long, value_name = "DIR", required_unless_present = "similar")]
    output: Option<PathBuf>,

    /// Do not grade: list pairs of hand-ins that share code, for people to judge; names, comments, layout and the order
    /// of functions do not count. With --output, also as similar.txt and similar.csv
    #[arg(long, conflicts_with_all = ["GradedArgs", "GradebookArgs", "PlanArgs", "RunArgs", "JudgeArgs", "DetailsArgs", "assets", "extra_credit", "expected", "rubric", "strict", "threads"])]
    similar: bool,
}

#[derive(Args)]
struct ClassArgs {
    #[command(flatten)]
    graded: GradedArgs,

    #[command(flatten)]
    gradebook: GradebookArgs,

    #[command(flatten)]
    plan: PlanArgs,

    #[command(flatten)]
    run: RunArgs,

    #[command(flatten)]
    judge: JudgeArgs,

    #[command(flatten)]
    details: DetailsArgs,

    #[command(flatten)]
    suite: SuiteArgs,
}

/// Reports and results of a class.
#[derive(Args)]
struct GradedArgs {
    /// Formats of the reports
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [Format::Text, Format::Json])]
    format: Vec<Format>,

    /// Write pages to this folder too: one for the class, and those of each submission
    #[arg(long, value_name = "DIR")]
    html: Option<PathBuf>,

    /// Reuse reports of an earlier run from the output folder if submission, suite and grader are unchanged
    #[arg(long)]
    resume: bool,

    /// The marks of creative scenes, as extra credit: the marks.csv of `grade gallery`, filled in (repeatable: one for each
    /// judge)
    #[arg(long, value_name = "FILE")]
    marks: Vec<PathBuf>,

    /// Which scene of the marks is whose, if the gallery hides names: the file of its --hide-names
    #[arg(long, value_name = "FILE", requires = "marks")]
    key: Option<PathBuf>,

    /// Points that you grant or withdraw, with reasons (CSV): student,points,reason. The reports and gradebooks show them,
    /// also when the class is graded again with this file
    #[arg(long, value_name = "FILE")]
    adjustments: Option<PathBuf>,

    /// Keep the trace of every run in the output folder too (runs/); with --resume, programs then run only on scenes
    /// that are new or changed
    #[arg(long)]
    keep_runs: bool,
}

/// Where a plan runs.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum On {
    /// On this machine
    Local,
    /// As an array of jobs of the Slurm cluster that this machine belongs to
    Slurm,
    /// Nowhere: only write the plan
    Nothing,
}

/// Options of a plan.
#[derive(Args)]
struct PlanArgs {
    /// Where to grade
    #[arg(long, value_enum, value_name = "WHERE", default_value_t = On::Local)]
    on: On,

    /// Number of shards, each a job of a cluster [default: 1 on this machine; else as many as take a minute each by
    /// earlier results, at most 5000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    shards: Option<u32>,

    /// Number of jobs of each array that run at the same time; Slurm limits arrays to 1000 jobs [default: no limit]
    #[arg(long, value_name = "M", value_parser = clap::value_parser!(u32).range(1..))]
    at_once: Option<u32>,

    /// Option of sbatch for each job, as in --sbatch=--partition=short (repeatable)
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    sbatch: Vec<String>,

    /// Show the progress of the jobs that an earlier command started, and the summary at their end
    #[arg(long, conflicts_with_all = ["resume", "cancel"])]
    attach: bool,

    /// End the jobs that an earlier command started; their results stay
    #[arg(long, conflicts_with = "resume")]
    cancel: bool,
}

impl ClassCommand {
    pub(crate) fn run(&self) -> Result<Exit, Stop> {
        match (&self.part, &self.place) {
            (Some(ClassPart::RunShard { plan, shard, hidden_scenes, threads }), _) => {
                let phase = if *hidden_scenes { Phase::Hidden } else { Phase::Shipped };
                run_shard(plan, *shard, phase, *threads)
            }
            (Some(ClassPart::Merge { plan, gradebook }), _) => {
                planned(plan, with(gradebook)?, |class, plan| class.merge(plan))
            }
            (
                None,
                Some(ClassPlace { folder, output: Some(output), similar: false, layout, .. }),
            ) => {
                let args = &self.args;
                if args.plan.attach {
                    planned(&output.join(PLAN), with(&args.gradebook)?, slurm::follow)
                } else if args.plan.cancel {
                    slurm::cancel(output)
                } else {
                    grade((folder, *layout), output, args)
                }
            }
            (None, Some(place)) => similar::list(place, &self.args.suite),
            (None, None) => Err(Stop::bad_input("grade class: no folder of submissions is named")),
        }
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

fn grade(
    (folder, layout): (&Path, Option<Layout>),
    output: &Path,
    args: &ClassArgs,
) -> Result<Exit, Stop> {
    if !folder.exists() {
        let message = "folder not found\n  help: name the folder with one entry a student";
        return Err(Stop::about(folder)(message));
    }
    // A class may also be an archive.
    if folder.is_dir() && is_submission(folder) {
        let shown = folder.display();
        return Err(Stop::bad_input(format!(
            "{shown}: is one submission, with a submission.toml, and no class\n  help: `grade {shown}` grades it; a class is \
             a folder with one entry a student"
        )));
    }
    let most = match args.plan.on {
        On::Slurm => slurm::ready(output)?,
        On::Local | On::Nothing => 0,
    };
    let arranged = arrange(folder, output, layout, args)?;
    let own = output.join(HAND_INS);
    let folder = if arranged.is_some() { own.as_path() } else { folder };
    let class = Class::open((folder, arranged), output, args)?;
    let listed = entry::list(folder, class.inputs.pack.is_some());
    let (entries, mut passed_over) = listed.map_err(Stop::about(folder))?;
    passed_over.extend(class.arranged.iter().flat_map(|arranged| arranged.passed_over.clone()));
    if entries.is_empty() {
        return Err(Stop::bad_input(format!(
            "{}: no submissions found\n  help: put programs, folders with submission.toml or archives of them there; with \
             --pack, also sources",
            folder.display()
        )));
    }
    class.roster(&entries.iter().map(|entry| &*entry.name).collect::<Vec<_>>())?;
    let plan = class.plan(entries, passed_over)?;
    let path = output.join(PLAN);
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
            let path = std::path::absolute(&path).map_err(Stop::about(&path))?;
            if !plan.shards.is_empty() {
                // Jobs of an incomplete submission would leave gaps.
                slurm::submit(&class, &plan, &path, most).inspect_err(|_| {
                    let _ = slurm::cancel(output);
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
    let path = std::path::absolute(path).map_err(Stop::about(path))?;
    let plan = Plan::read(&path).map_err(Stop::bad_input)?;
    let folder = path.parent().unwrap_or(Path::new("")).join(&plan.folder);
    std::env::set_current_dir(&folder).map_err(Stop::about(&folder))?;
    // The first argument is the name of the command.
    let matches = ClassCommand::augment_args(clap::Command::new("class"));
    let matches = matches.try_get_matches_from(&plan.arguments);
    let command = matches.and_then(|matches| ClassCommand::from_arg_matches(&matches));
    let Ok(ClassCommand {
        place: Some(ClassPlace { folder, output: Some(output), .. }),
        mut args,
        ..
    }) = command
    else {
        return Err(Stop::about(&path)("the arguments are not those of grade class"));
    };
    set(&mut args);
    let own = output.join(HAND_INS);
    let folder = if plan.arranged.is_some() { own } else { folder };
    let class = Class::open((folder.as_path(), plan.arranged.clone()), &output, &args)?;
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
        let here = std::env::current_dir().map_err(Stop::fault)?;
        let folder = relative(&real(self.output)?, &real(&here)?);
        let submissions: Vec<Planned> =
            entries.into_par_iter().map(|entry| self.planned(entry)).collect();
        let mut plan = Plan::new((folder, arguments), self.inputs_hash(), submissions, passed_over);
        plan.arranged = self.arranged.clone();
        if !self.args.graded.resume {
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
                        self.args.graded.resume.then(|| complain("note", note))?;
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
    replace_file(path, bytes).map_err(Stop::about(path))
}

/// The way from one folder to another, both absolute and without links.
fn relative(from: &Path, to: &Path) -> PathBuf {
    let shared = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    let up = from.components().skip(shared).map(|_| Component::ParentDir);
    up.chain(to.components().skip(shared)).collect()
}

/// A path without links.
fn real(path: &Path) -> Result<PathBuf, Stop> {
    scene::input::real_path(path).map_err(Stop::about(path))
}
