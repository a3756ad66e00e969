//! Grading of a shard: submissions one after the other, each with its reports and its record.
//!
//! The scenes of one submission run in parallel. Two submissions of a shard never run at the same time: each has the
//! machine to itself, memory use is that of one, and neither can observe the other. Hidden scenes run in a second phase,
//! after the shipped scenes of all.
//!
//! Each file is written under another name and renamed, the record last. A shard that is killed, or that runs twice at
//! the same time, therefore leaves whole results or none.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::Instant;

use grader::class::Row;
use grader::class::phase::FirstPhase;
use grader::class::plan::{Plan, Planned};
use grader::class::record::Record;
use grader::grading::events::{Event, Observer, Task};
use grader::grading::provenance::Provenance;
use grader::grading::{Checks, Grading, panic_message};
use grader::submission::Submission;
use grader::submission::budget::Budget;
use grader::submission::kept::KeptRuns;
use grader::submission::program::Runner;
use grader::suite::hash_bytes;
use grader::verdict::Failure;
use report::SceneTimes;
use report::html;
use report::text::{Amount, TextOptions};
use report::wrap::WIDTH;

use super::setting::{Class, extension, pages_of};
use super::{Phase, save};
use crate::args::Format;
use crate::output::{plain, write_bytes};
use crate::provenance::origin;
use crate::reports::render;
use crate::stop::{Stop, complain};
use crate::submission::{Opening, open_entry, refused};

/// Reports of a submission: the name and content of each file.
type Reports = Vec<(String, Vec<u8>)>;

impl Class<'_> {
    /// Grades groups of equal submissions in one phase, unless they have results, until an interrupt.
    ///
    /// # Errors
    /// If a result cannot be written, or a scene changed. All other failures are recorded in the rows.
    pub(super) fn run(&self, plan: &Plan, groups: &[Vec<usize>], phase: Phase) -> Result<(), Stop> {
        let total = plan.submissions.len();
        for group in groups {
            for number in group.iter().take(1) {
                let name = &plan.submissions[*number].name;
                self.progress.notice(Event::Submission { name, number: number + 1, total });
            }
            if self.progress.is_stopped() {
                break;
            }
            let members = group.iter().map(|place| &plan.submissions[*place]);
            self.run_group(plan, &members.collect::<Vec<_>>(), phase)?;
        }
        Ok(())
    }

    /// Grades the first of those equal submissions that have no result, and writes the results of all; of a program whose
    /// hidden scenes are to run, the record of the first phase.
    fn run_group(&self, plan: &Plan, group: &[&Planned], phase: Phase) -> Result<(), Stop> {
        let missing = group.iter().copied().filter(|planned| !self.is_done(plan, planned));
        let missing: Vec<&Planned> =
            missing.filter(|planned| self.is_as_planned(planned)).collect();
        let Some(first) = missing.first() else { return Ok(()) };
        let begun = self.first_phase(plan, first);
        if begun.is_some() != (phase == Phase::Hidden) {
            return Ok(());
        }
        let start = Instant::now();
        let kept = self.kept_runs(plan, &first.name)?;
        let folder = self.phase_folder(first);
        let is_two_phased = self.phases().len() > 1;
        let unfinished = match &begun {
            None if is_two_phased => Some(self.new_phase_folder()?),
            _ => None,
        };
        let runs = match (&begun, &unfinished) {
            (Some(_), _) => Some(KeptRuns::second_phase(folder.clone(), &self.seal)),
            (_, Some(unfinished)) => {
                Some(KeptRuns::first_phase(unfinished.path().to_path_buf(), &self.seal))
            }
            (None, None) => None,
        };
        let runs = runs.transpose().map_err(Stop::about(&folder))?.map(Arc::new);
        let spent = begun.as_ref().map_or(0.0, |begun| begun.spent);
        let budget = Budget::new(self.runner.limits.budget(), spent);
        let runner = Runner {
            kept: kept.iter().chain(&runs).cloned().collect(),
            budget: Some(budget.clone()),
            ..self.runner.clone()
        };
        let not_graded = |detail: String| {
            self.graded(|| Submission::NotGraded { name: first.name.as_str().into(), detail }, true)
        };
        let open = || self.open_submission(&first.name, runner);
        let (mut grading, is_whole) = match self.graded(open, unfinished.is_none()) {
            Ok(graded) => graded,
            Err(detail) => not_graded(detail).map_err(Stop::fault)?,
        };
        // The programs may have been killed with the run, or may have read a changed file.
        if self.progress.is_stopped() || !self.is_as_planned(first) {
            return Ok(());
        }
        if let Some(scene) = self.inputs.changed() {
            return Err(Stop::bad_input(format!(
                "{scene} changed while {} was graded\n  help: continue with --resume",
                first.name
            )));
        }
        let seconds = start.elapsed().as_secs_f64();
        // A fault is the result: the next grading begins anew.
        if let Some(unfinished) = unfinished.filter(|_| !is_whole && !Row::of(&grading).is_fault())
        {
            if runs.is_some_and(|runs| runs.has_lost()) {
                return Err(Stop::about(&folder)(io::Error::from(io::ErrorKind::StorageFull)));
            }
            let record = FirstPhase { anew: plan.anew.clone(), seconds, spent: budget.spent() };
            let published = record.publish(unfinished, &folder, &self.seal);
            return published.map_err(Stop::about(&folder));
        }
        // Another process may have completed it, and removed the first phase.
        if begun.is_some() && self.is_done(plan, first) {
            return Ok(());
        }
        if let Some(kept) = kept {
            kept.remove_unused();
        }
        let seconds = seconds + begun.map_or(0.0, |begun| begun.seconds);
        for planned in missing {
            self.name(&mut grading, planned);
            let reports = self.rendered(&grading, planned).or_else(|detail| {
                (grading, _) = not_graded(detail)?;
                self.name(&mut grading, planned);
                self.rendered(&grading, planned)
            });
            let record = Record {
                fingerprint: planned.key.clone(),
                anew: plan.anew.clone(),
                row: Row::of(&grading),
                reports: BTreeMap::new(),
                protection: grading.protection.clone(),
                seconds,
                before: self.row_before(planned),
                pages: self.pages_folder(),
            };
            self.write(planned, &grading, reports.map_err(Stop::fault)?, record)?;
        }
        if is_two_phased {
            let _ = fs::remove_dir_all(folder);
        }
        Ok(())
    }

    /// Puts the name, the origin and the marks of a submission into its grading. Names in submission.toml need not be unique.
    fn name(&self, grading: &mut Grading, planned: &Planned) {
        grading.submission = planned.name.as_str().into();
        if let Some(marks) = &self.marks {
            let own = marks.of.get(&planned.name).map_or(&[][..], |own| own);
            grading.add_marks(self.inputs.rubric.creative(), own);
        }
        grading.adjustments = self.adjustments.get(&planned.name).cloned().unwrap_or_default();
        let submission = Some(origin(&self.folder.join(&planned.name)));
        grading.provenance = Some(Provenance { submission, ..self.provenance.clone() });
    }

    /// Whether a submission has the content that was planned; says so if not.
    fn is_as_planned(&self, planned: &Planned) -> bool {
        let is_as_planned = self.key(&planned.name).0 == planned.key;
        if !is_as_planned {
            let name = &planned.name;
            complain("note", format!("{name}: changed after it was planned; not graded"));
        }
        is_as_planned
    }

    /// Writes the reports of a submission, then its record.
    fn write(
        &self,
        planned: &Planned,
        grading: &Grading,
        reports: Reports,
        mut record: Record,
    ) -> Result<(), Stop> {
        if let Some(pages) = &self.pages {
            let above = [("../../index.html".to_owned(), "Class".to_owned())];
            pages.write(&pages_of(planned), |sink| {
                html::submission(grading, &self.inputs.suite, &above, sink)
            })?;
        }
        for (file, bytes) in reports {
            let path = self.reports.join(&file);
            write_bytes(&path, &bytes).map_err(Stop::about(&path))?;
            record.reports.insert(file, hash_bytes(&bytes));
        }
        let text = record.render(&planned.report, &self.seal).map_err(Stop::fault)?;
        save(&self.record_path(planned), text.as_bytes())
    }

    /// The submission of this name, built.
    fn open_submission(&self, name: &str, runner: Runner) -> Submission {
        if let (_, Err(error)) = self.key(name) {
            return refused(name.into(), &error);
        }
        self.progress.notice(Event::Task(Task::Opening));
        let assignment = Some(self.inputs.assignment_name());
        let opening = Opening { assignment, ..self.inputs.opening(&self.args.run) };
        open_entry(&self.folder.join(name), name, runner, opening)
    }

    /// The grading of a submission, and whether it is whole: without hidden scenes of programs, unless `hidden`.
    ///
    /// # Errors
    /// A message, if the grader panics.
    fn graded(
        &self,
        open: impl FnOnce() -> Submission,
        hidden: bool,
    ) -> Result<(Grading, bool), String> {
        unpanicked(|| {
            let submission = open();
            // Nothing else runs.
            let hidden = hidden || !matches!(submission, Submission::Program(_));
            Ok((self.grade(&submission, hidden), hidden))
        })
    }

    /// The reports of a submission.
    ///
    /// # Errors
    /// A message, if the grader panics or a report cannot be rendered.
    fn rendered(&self, grading: &Grading, planned: &Planned) -> Result<Reports, String> {
        let render = |format: &Format| {
            // Without times: equal results have equal reports.
            let bytes = render(*format, grading, &SceneTimes::new(), |out| {
                let details = self.args.details.details;
                let amount = Amount::Full { details };
                let options = TextOptions { amount, width: WIDTH, next: None };
                report::text::write(out, grading, &options)
            });
            let bytes = bytes.map_err(|Stop(_, message)| message)?;
            Ok((format!("{}.{}", planned.report, extension(*format)), plain(&bytes)))
        };
        unpanicked(|| self.args.graded.format.iter().map(render).collect())
    }

    fn grade(&self, submission: &Submission, hidden: bool) -> Grading {
        let is_run = match submission {
            Submission::Program(_) => true,
            Submission::Unusable { failure, .. } => !matches!(failure, Failure::BadHandIn { .. }),
            _ => false,
        };
        let protection = is_run.then(|| self.protections.clone());
        let measured = !self.args.judge.no_jacobians;
        let checks = Checks {
            jacobians: measured,
            probe: measured,
            altered: Some(self.seal.secret()),
            hidden,
            is_alone: false,
            recordings: self.pages.is_some(),
        };
        self.inputs.grader(&self.oracle, checks, &self.progress).grade(submission, protection)
    }
}

/// The result of `work`; a panic is an error.
fn unpanicked<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        Err(format!("the grader panicked: {}", panic_message(panic.as_ref())))
    })
}
