//! `grade pack`: checks a course pack.

use std::fs;
use std::path::Path;

use clap::{Args, Subcommand};
use grader::grading::Checks;
use grader::grading::events::{Event, Observer, Task};
use grader::pack::Example;
use grader::pack::check::{self, Finding, Graded};
use sandbox::scratch::scratch_folder;

use crate::args::{JudgeArgs, RunArgs, SuiteArgs};
use crate::inputs::{Inputs, open_oracle};
use crate::interrupt::Interrupt;
use crate::output::print;
use crate::progress::Progress;
use crate::stop::{Exit, Stop};

#[derive(Subcommand)]
pub(crate) enum PackCommand {
    Check(CheckArgs),
}

impl PackCommand {
    pub(crate) fn run(&self) -> Result<Exit, Stop> {
        match self {
            Self::Check(args) => args.run(),
        }
    }
}

/// Check a course pack: every scene has a trace and every feature points, nothing tells the answers, its right programs pass,
/// and its wrong programs fail where it says
#[derive(Args)]
#[command(after_help = "\
Examples:
  grade pack check my-pack
  grade pack check fosssim-t1m3 --starter course/t1m3

Exit codes: 0 no faults (warnings do not count), 1 faults, 2 bad usage or input.")]
pub(crate) struct CheckArgs {
    /// The pack: a folder or zip with pack.toml, or the name of a pack in assets/packs/
    #[arg(value_name = "PACK")]
    named: std::path::PathBuf,

    #[command(flatten)]
    run: RunArgs,

    #[command(flatten)]
    judge: JudgeArgs,

    #[command(flatten)]
    suite: SuiteArgs,
}

impl CheckArgs {
    fn run(&self) -> Result<Exit, Stop> {
        let interrupt = Interrupt::listen()?;
        let opened = self.suite.read_with(&self.judge.judging(), Some(&self.named));
        let (inputs, found) = match opened {
            Ok(inputs) => {
                let found = self.findings(&inputs, &interrupt)?;
                (Some(inputs), found)
            }
            // An unreadable part is a fault of the pack, and hides the others.
            Err(Stop(Exit::BadInput, message)) => {
                print(format!("fault: {message}\n").as_bytes())?;
                (None, Vec::new())
            }
            Err(other) => return Err(other),
        };
        let Some(inputs) = inputs else { return Ok(Exit::Failed) };
        let faults = found.iter().filter(|finding| !finding.is_warning).count();
        let mut text: String = found.iter().map(|finding| format!("{finding}\n")).collect();
        let title = inputs.pack.as_ref().map_or("", |pack| &*pack.title);
        let examples = inputs.pack.as_ref().map_or(0, |pack| pack.examples().len());
        text += &format!(
            "{title}: {} scenes, {examples} examples, {faults} faults, {} warnings\n",
            inputs.suite.cases.len(),
            found.len() - faults,
        );
        print(text.as_bytes())?;
        Ok(Exit::of(faults == 0))
    }

    fn findings(&self, inputs: &Inputs, interrupt: &Interrupt) -> Result<Vec<Finding>, Stop> {
        let pack = inputs.pack.as_ref().ok_or_else(|| Stop::fault("no pack is read"))?;
        let oracle = open_oracle(&inputs.expected)?;
        let hidden = inputs.hidden.as_ref().map(|(hidden, folder)| (hidden, folder.as_path()));
        let graded = Graded {
            suite: &inputs.suite,
            oracle: &oracle,
            expected: &inputs.expected,
            rubric: &inputs.rubric,
            hidden,
        };
        let mut found = check::files(pack, graded);
        // Programs could read what they must not.
        if found.iter().any(|finding| !finding.is_warning) {
            return Ok(found);
        }
        let (runner, protections) = self.run.runner(&inputs.rubric)?;
        let progress = Progress::new(!self.judge.no_progress, interrupt.clone());
        let grade = |path: &Path, name: &str| {
            progress.notice(Event::Task(Task::Opening));
            let limits = inputs.rubric.build_limits();
            let submission = pack.submission(path, name.into(), runner.clone(), limits);
            let submission = submission.map_err(Stop::fault)?;
            let grader = inputs.grader(&oracle, Checks::default(), &progress);
            Ok(grader.grade(&submission, Some(protections.clone())))
        };
        for example in pack.examples() {
            let grading = grade(&example.folder, &name_of(example))?;
            interrupt.check("the pack was not checked to its end")?;
            found.extend(check::example(pack, example, &inputs.suite, &grading));
        }
        let files = check::starting_files(pack);
        if !files.is_empty() {
            let start = scratch_folder().map_err(Stop::fault)?;
            for (from, below) in files {
                let to = start.path().join("start").join(below);
                let copied = fs::create_dir_all(to.parent().unwrap_or(start.path()));
                copied.and_then(|()| fs::copy(from, to)).map_err(Stop::fault)?;
            }
            let grading = grade(&start.path().join("start"), "what students start from")?;
            found.extend(check::start(&grading));
        }
        interrupt.check("the pack was not checked to its end")?;
        Ok(found)
    }
}

fn name_of(example: &Example) -> String {
    example.folder.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
