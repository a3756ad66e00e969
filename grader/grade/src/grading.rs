//! `grade`: grades one submission on the suite.

use std::path::Path;

use grader::boundary::printed::RawUse;
use grader::grading::events::{Event, Observer, Task};
use grader::grading::{Checks, GradingOutcome};
use grader::submission::folder;

use crate::args::{GradeArgs, Judging};
use crate::inputs::{Inputs, open_oracle};
use crate::interrupt::Interrupt;
use crate::last_failed;
use crate::platform::{Platforms, read_metadata};
use crate::progress::Progress;
use crate::provenance::{options, provenance};
use crate::reports::{Reports, Shown};
use crate::scenes::{Scenes, slowest};
use crate::stop::{Exit, Stop, complain};
use crate::submission::open_submission;
use crate::watch;

/// Grades the submission; with `--watch`, again after each change.
pub(super) fn grade(args: &GradeArgs) -> Result<Exit, Stop> {
    let interrupt = Interrupt::listen()?;
    let Some(submission) = args.submission.as_deref().filter(|_| args.watch) else {
        return grade_once(args, &interrupt);
    };
    loop {
        let files = watch::files(submission);
        let graded = grade_once(args, &interrupt);
        if interrupt.is_requested() {
            return graded;
        }
        if let Err(Stop(_, message)) = &graded {
            complain("error", message);
        }
        complain("note", format!("waiting for changes of {}", submission.display()));
        if !watch::wait(submission, &files, &interrupt) {
            return graded;
        }
    }
}

fn grade_once(args: &GradeArgs, interrupt: &Interrupt) -> Result<Exit, Stop> {
    let platforms = Platforms::begin(args)?;
    let graded = grade_and_report(args, interrupt, &platforms);
    if let Err(stop) = &graded {
        platforms.write_not_graded(stop, args);
    }
    graded
}

fn grade_and_report(
    args: &GradeArgs,
    interrupt: &Interrupt,
    platforms: &Platforms,
) -> Result<Exit, Stop> {
    let metadata = args.metadata.as_deref().map(read_metadata).transpose()?;
    // On a platform, nobody looks at what the submission chose.
    let chooses = args.submission.as_deref().filter(|_| !args.is_handed_in());
    let of_submission = chooses.and_then(named_assignment);
    let judging = Judging { of_submission: of_submission.as_deref(), ..args.judge.judging() };
    let mut inputs = args.suite.read_for(&judging)?;
    let path = args.submission.as_deref().or(args.traces.as_deref());
    let record = last_failed::file(path, &inputs.expected);
    let only = choose(args, &inputs, record.as_deref());
    let is_whole = only.is_empty();
    if !is_whole {
        let total = inputs.suite.cases.len();
        inputs.suite.keep_only(&only).map_err(Stop::bad_input)?;
        complain("note", format!("{} of {total} scenes are graded", inputs.suite.cases.len()));
    }
    let oracle = open_oracle(&inputs.expected)?;
    let reports = Reports::open(args)?;
    if args.fail_fast.is_some() && !(reports.can_be_partial() && platforms.is_empty()) {
        return Err(Stop::bad_input(
            "--fail-fast ends a run before it is complete\n  help: it works with text reports",
        ));
    }
    let progress = Progress::new(!args.judge.no_progress, interrupt.clone());
    progress.notice(Event::Task(Task::Opening));
    let provenance = provenance(&inputs, &oracle, options(&args.judge, &args.run, is_whole), path)?;
    let opened = open_submission(args, &inputs);
    interrupt.check("the submission was still being built; no scene was graded")?;
    let (submission, protection) = opened?;
    // With --only, run nothing but the chosen scenes.
    let checks = Checks {
        jacobians: !args.judge.no_jacobians,
        probe: !args.judge.no_jacobians && is_whole,
        altered: is_whole,
        hidden: is_whole,
        is_alone: args.is_handed_in(),
        recordings: reports.need_recordings(),
    };
    let scenes = Scenes::new(&progress, args.fail_fast.map(|count| count as usize));
    let mut grading = inputs.grader(&oracle, checks, &scenes).grade(&submission, protection);
    grading.provenance = Some(provenance);
    let (has_ended, times) = (scenes.has_ended(), scenes.times());
    drop(progress);
    if is_whole && !grading.is_own && grading.interrupted.is_none() {
        grading.fitting = inputs.fitting(&grading);
    }
    if let Some(record) = &record {
        last_failed::store(record, &grading);
    }
    let shown =
        Shown { grading: &grading, times: &times, suite: &inputs.suite, rubric: &inputs.rubric };
    if let Some(interrupted) = grading.interrupted {
        reports.write_partial(shown)?;
        if interrupt.is_requested() || !has_ended {
            return Err(Stop(Exit::Interrupted, interrupted.to_string()));
        }
        complain("note", format!("ended by --fail-fast: {interrupted}"));
        return Ok(Exit::Failed);
    }
    reports.write(shown)?;
    platforms.write(shown, metadata.as_ref(), args.judge.details)?;
    for (time, scene) in slowest(&times, args.durations.unwrap_or(0)) {
        complain("note", format!("{:8.3} s  {scene}", time.as_secs_f64()));
    }
    Ok(match grading.outcome() {
        // Without the hidden scenes, this is the best result possible.
        GradingOutcome::Passed | GradingOutcome::PassedShipped => Exit::Passed,
        GradingOutcome::Failed => Exit::Failed,
        GradingOutcome::GraderFault => Exit::GraderFault,
    })
}

/// The patterns of the scenes to grade; none for all scenes.
fn choose(args: &GradeArgs, inputs: &Inputs, record: Option<&Path>) -> Vec<String> {
    if !args.last_failed {
        return args.only.clone();
    }
    let known = record.map(last_failed::load).unwrap_or_default();
    let names = inputs.suite.cases.iter().map(|case| case.id.clone());
    let chosen: Vec<String> = names.filter(|name| known.contains(name)).collect();
    if chosen.is_empty() {
        complain("note", "no failed scene is known from before; all scenes are graded");
    }
    chosen
}

/// The assignment that the submission names; `None` if it names none, or cannot be read, which is reported when it is
/// opened.
pub(super) fn named_assignment(submission: &Path) -> Option<String> {
    let is_folder = submission.is_dir() && folder::is_submission(submission);
    let named = is_folder.then(|| folder::assignment_of(submission).ok().flatten()).flatten()?;
    // It is looked up among the known names.
    Some(named.raw(RawUse::Comparison).to_owned())
}
