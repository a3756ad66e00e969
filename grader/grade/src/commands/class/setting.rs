//! The settings and inputs that all submissions of a class share.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use grader::boundary::seal::Seal;
use grader::class::Row;
use grader::class::adjust::{self, Adjustments};
use grader::class::entry::{self, ClassEntry};
use grader::class::fingerprint::Fingerprint;
use grader::class::layout::{self, Arranged};
use grader::class::marks::{Marks, MarksRules};
use grader::class::phase::{FirstPhase, Unfinished};
use grader::class::plan::{Plan, Planned};
use grader::class::record::Record;
use grader::class::roster::Roster;
use grader::grading::provenance::Provenance;
use grader::oracle::Oracle;
use grader::pack::Pack;
use grader::submission::folder;
use grader::submission::hand_in::HandInError;
use grader::submission::kept::KeptRuns;
use grader::submission::program::Runner;
use grader::submission::received::Form;
use grader::suite::assignment::Assignment;
use rayon::prelude::*;
use report::html::SUBMISSIONS;
use sandbox::Protection;

use super::{ClassArgs, Phase, real};
use crate::args::Format;
use crate::inputs::{Inputs, open_oracle};
use crate::interrupt::Interrupt;
use crate::output::{create_folder, leads_into};
use crate::pages::Pages;
use crate::progress::Progress;
use crate::provenance::{options, provenance};
use crate::stop::Stop;
use crate::submission::check_secrets;

/// Folder of the first phases in the folder of the results.
pub(super) const FIRST_PHASE: &str = "first-phase";

/// A class that is graded.
pub(super) struct Class<'a> {
    pub(super) args: &'a ClassArgs,
    /// The folder of the submissions.
    pub(super) folder: &'a Path,
    /// How that folder was arranged, if a platform had laid it out.
    pub(super) arranged: Option<Arranged>,
    /// The folder of the results.
    pub(super) output: &'a Path,
    pub(super) inputs: Inputs,
    pub(super) oracle: Oracle,
    pub(super) runner: Runner,
    pub(super) protections: Vec<Protection>,
    /// Of all submissions, without their own origin.
    pub(super) provenance: Provenance,
    /// Hash of all inputs except the submission.
    fingerprint: Fingerprint,
    /// Hash of what a run depends on, except the submission and the scene.
    running: Fingerprint,
    pub(super) reports: PathBuf,
    pub(super) records: PathBuf,
    /// Signs the records.
    pub(super) seal: Seal,
    pub(super) pages: Option<Pages>,
    /// The marks of creative scenes; `None` if they were not marked.
    pub(super) marks: Option<Marks>,
    /// The adjustments of each submission.
    pub(super) adjustments: Adjustments,
    pub(super) progress: Progress,
}

impl<'a> Class<'a> {
    /// Opens the class of these submissions, with its results in `output`.
    pub(super) fn open(
        (submissions, arranged): (&'a Path, Option<Arranged>),
        output: &'a Path,
        args: &'a ClassArgs,
    ) -> Result<Self, Stop> {
        let inputs = args.suite.read_for(&args.judge.judging())?;
        let oracle = open_oracle(&inputs.expected)?;
        let gradebooks = args.gradebook.gradebook.iter().map(|gradebook| &*gradebook.file);
        let html = args.graded.html.as_deref();
        for path in [output].into_iter().chain(html).chain(gradebooks) {
            refuse_inside(path, submissions)?;
        }
        let folder =
            |name: &str| create_folder(output, name).map_err(Stop::about(&output.join(name)));
        let (reports, records) = (folder("reports")?, folder("resume")?);
        let seal = Seal::of(output);
        let seal = seal.map_err(Stop::about(&output.join("records.key")))?;
        let pages = args.graded.html.as_deref().map(Pages::open_folder_alone).transpose()?;
        let (runner, protections) = args.run.runner(&inputs.rubric)?;
        keep_apart(args, (submissions, output), &inputs, &protections)?;
        let mut running = running(args, &runner).map_err(Stop::fault)?;
        running.part(inputs.pack.as_ref().map_or("", Pack::hash).as_bytes());
        let fingerprint = fingerprint(args, submissions, (&inputs, &oracle), running.clone());
        let fingerprint = fingerprint.map_err(Stop::fault)?;
        let provenance = provenance(&inputs, &oracle, options(&args.judge, &args.run, true), None)?;
        let marks = marks(args, submissions, &inputs)?;
        let adjustments = adjustments(args, submissions, (&inputs, arranged.as_ref()))?;
        let interrupt = Interrupt::listen()?;
        let progress = Progress::new(!args.judge.no_progress, interrupt);
        Ok(Self {
            args,
            folder: submissions,
            arranged,
            output,
            inputs,
            oracle,
            runner,
            protections,
            provenance,
            fingerprint,
            running,
            reports,
            records,
            seal,
            pages,
            marks,
            adjustments,
            progress,
        })
    }

    /// Hash of everything that the reports depend on, except the submissions.
    pub(super) fn inputs_hash(&self) -> String {
        let mut all = self.fingerprint.clone();
        if let Some(marks) = &self.marks {
            all.part(format!("{marks:?}").as_bytes());
        }
        if !self.adjustments.is_empty() {
            all.part(format!("{:?}", self.adjustments).as_bytes());
        }
        all.finish()
    }

    /// The key of a submission, and why its files cannot be read, if so.
    pub(super) fn key(&self, name: &str) -> (String, Result<(), HandInError>) {
        let path = self.folder.join(name);
        let mut key = self.fingerprint.clone();
        let files = key.submission(&path);
        if let Err(error) = &files {
            key = self.fingerprint.clone();
            key.part(error.to_string().as_bytes());
        }
        // A program that is built from a copy does not see the folder's name. Other reports name the path.
        let is_copied = self.inputs.pack.is_some()
            || Form::of(&path).ok() == Some(Form::Archive)
            || folder::assignment_of(&path).is_ok();
        if files.is_err() || !is_copied {
            key.part(name.as_bytes());
        }
        if let Some(marks) = &self.marks {
            key.part(format!("{:?}", marks.of.get(name)).as_bytes());
        }
        if let Some(own) = self.adjustments.get(name) {
            key.part(format!("adjusted {own:?}").as_bytes());
        }
        (key.finish(), files)
    }

    /// The phases of this class, in their order.
    pub(super) fn phases(&self) -> &'static [Phase] {
        match self.inputs.hidden {
            Some(_) => &[Phase::Shipped, Phase::Hidden],
            None => &[Phase::Shipped],
        }
    }

    /// The folder of a submission's first phase.
    pub(super) fn phase_folder(&self, planned: &Planned) -> PathBuf {
        self.output.join(FIRST_PHASE).join(&planned.key)
    }

    /// The first phase of a submission that still lacks its second one.
    pub(super) fn first_phase(&self, plan: &Plan, planned: &Planned) -> Option<FirstPhase> {
        let found = FirstPhase::read(&self.phase_folder(planned), &self.seal)?;
        (plan.anew.is_none() || plan.anew == found.anew).then_some(found)
    }

    /// An empty folder for the runs of a first phase.
    pub(super) fn new_phase_folder(&self) -> Result<Unfinished, Stop> {
        let made = create_folder(self.output, FIRST_PHASE);
        made.and_then(|folder| Unfinished::new(&folder))
            .map_err(Stop::about(&self.output.join(FIRST_PHASE)))
    }

    /// The runs kept of a submission, if they are kept; those of earlier gradings are not used in a plan without
    /// `--resume`.
    ///
    /// # Errors
    /// If their folder cannot be created or read.
    pub(super) fn kept_runs(&self, plan: &Plan, name: &str) -> Result<Option<Arc<KeptRuns>>, Stop> {
        let mut program = self.running.clone();
        program.part(format!("{:?}", self.protections).as_bytes());
        // Unreadable hand-ins are not run.
        if !self.args.graded.keep_runs || program.submission(&self.folder.join(name)).is_err() {
            return Ok(None);
        }
        let name = Path::new("runs").join(program.finish());
        let folder =
            create_folder(self.output, &name).map_err(Stop::about(&self.output.join(&name)))?;
        let kept = KeptRuns::open(folder.clone(), &self.seal, plan.anew.is_some());
        Ok(Some(Arc::new(kept.map_err(Stop::about(&folder))?)))
    }

    /// A submission of the plan.
    pub(super) fn planned(&self, entry: ClassEntry) -> Planned {
        let (key, _) = self.key(&entry.name);
        Planned::new(entry, key)
    }

    /// The record of a submission that was graded as planned, with all its reports; it may be a fault.
    pub(super) fn record(&self, plan: &Plan, planned: &Planned) -> Option<Record> {
        let path = self.record_path(planned);
        let record = Record::load(&path, &planned.report, &self.seal).ok().flatten()?;
        let is_recent = plan.anew.is_none() || plan.anew == record.anew;
        let is_valid = is_recent && record.is_of(&planned.key, &self.reports);
        is_valid.then_some(record)
    }

    /// The row of the record that a new one replaces.
    pub(super) fn row_before(&self, planned: &Planned) -> Option<Row> {
        let record = Record::load(&self.record_path(planned), &planned.report, &self.seal);
        record.ok().flatten().map(|record| record.row)
    }

    /// The folder of the class's pages, as records have it.
    pub(super) fn pages_folder(&self) -> Option<PathBuf> {
        self.pages.as_ref().and_then(|pages| std::path::absolute(pages.folder()).ok())
    }

    /// Whether a submission has pages in the folder of this run. They are of its record: one that was graded without
    /// pages, or with pages elsewhere, is not graded again for them.
    pub(super) fn has_pages(&self, planned: &Planned, record: &Record) -> bool {
        let is_written = |pages: &Pages| pages.is_written(&pages_of(planned));
        record.pages.is_some()
            && record.pages == self.pages_folder()
            && self.pages.as_ref().is_some_and(is_written)
    }

    /// Groups of submissions with the same files, whatever their names.
    pub(super) fn equal(&self, plan: &Plan) -> Vec<Vec<String>> {
        let files = |planned: &Planned| {
            let mut files = Fingerprint::default();
            files.submission(&self.folder.join(&planned.name)).ok()?;
            Some((files.finish(), planned.name.clone()))
        };
        let mut groups: BTreeMap<String, Vec<String>> = BTreeMap::new();
        for (files, name) in plan.submissions.par_iter().filter_map(files).collect::<Vec<_>>() {
            groups.entry(files).or_default().push(name);
        }
        let mut groups: Vec<_> = groups.into_values().filter(|group| group.len() > 1).collect();
        groups.sort();
        groups
    }

    pub(super) fn record_path(&self, planned: &Planned) -> PathBuf {
        self.records.join(format!("{}.json", planned.report))
    }

    /// Whether a submission needs no grading.
    pub(super) fn is_done(&self, plan: &Plan, planned: &Planned) -> bool {
        self.record(plan, planned).is_some_and(|record| !record.row.is_fault())
    }
}

/// The marks of creative scenes, if there are any.
fn marks(args: &ClassArgs, folder: &Path, inputs: &Inputs) -> Result<Option<Marks>, Stop> {
    if args.graded.marks.is_empty() {
        return Ok(None);
    }
    let listed = entry::list(folder, inputs.pack.is_some());
    let (entries, _) = listed.map_err(Stop::about(folder))?;
    let submissions: Vec<&str> = entries.iter().map(|entry| &*entry.name).collect();
    let rules = MarksRules {
        submissions: &submissions,
        folder,
        assignment: inputs.assignment.as_ref().map(|assignment| &*assignment.name),
        rule: inputs.rubric.creative(),
    };
    Marks::load(&args.graded.marks, args.graded.key.as_deref(), rules)
        .map(Some)
        .map_err(Stop::bad_input)
}

/// The adjustments of the class, if there are any.
fn adjustments(
    args: &ClassArgs,
    folder: &Path,
    (inputs, arranged): (&Inputs, Option<&Arranged>),
) -> Result<Adjustments, Stop> {
    let Some(path) = &args.graded.adjustments else { return Ok(Adjustments::new()) };
    let listed = entry::list(folder, inputs.pack.is_some());
    let (entries, _) = listed.map_err(Stop::about(folder))?;
    let submissions: Vec<&str> = entries.iter().map(|entry| &*entry.name).collect();
    let roster = args.gradebook.roster.as_deref().map(Roster::load).transpose();
    let mut roster = roster.map_err(Stop::bad_input)?;
    if let (Some(roster), Some(arranged)) = (&mut roster, arranged) {
        layout::assign(roster, arranged);
    }
    adjust::load(path, &submissions, roster.as_ref()).map_err(Stop::bad_input)
}

/// Refuses a path for results that is in the folder of submissions: a link in it would lead elsewhere.
pub(super) fn refuse_inside(path: &Path, submissions: &Path) -> Result<(), Stop> {
    match leads_into(path, submissions) {
        Ok(false) => Ok(()),
        Ok(true) => Err(Stop::bad_input(format!(
            "{}: is inside the folder of submissions\n  help: move it out of {}",
            path.display(),
            submissions.display()
        ))),
        Err(error) => Err(Stop::about(submissions)(error)),
    }
}

/// Checks that no submission can read the oracle, the hidden scenes, the reports, or another submission.
fn keep_apart(
    args: &ClassArgs,
    (folder, output): (&Path, &Path),
    inputs: &Inputs,
    protections: &[Protection],
) -> Result<(), Stop> {
    let mut secrets = inputs.secrets();
    for secret in &secrets {
        refuse_inside(secret, folder)?;
    }
    secrets.push(output.to_path_buf());
    secrets.extend(args.graded.html.clone());
    if args.run.unprotected {
        return Ok(());
    }
    secrets.push(folder.to_path_buf());
    secrets.extend(
        args.gradebook
            .roster
            .iter()
            .chain(&args.graded.marks)
            .chain(&args.graded.key)
            .chain(&args.graded.adjustments)
            .cloned(),
    );
    let mut readable =
        args.run.readable.iter().map(|path| real(path)).collect::<Result<Vec<_>, _>>()?;
    readable.extend(inputs.pack.iter().flat_map(Pack::readable).cloned());
    check_secrets(&secrets, &readable, protections)
}

/// Hash of the grader, and of how it runs programs.
fn running(args: &ClassArgs, runner: &Runner) -> std::io::Result<Fingerprint> {
    let mut running = Fingerprint::of_grader()?;
    let how = format!("{:?} {:?} {}", runner.limits, runner.readable, args.run.unprotected);
    running.part(how.as_bytes());
    Ok(running)
}

/// Hash of everything that the reports of this run depend on, except the submission.
fn fingerprint(
    args: &ClassArgs,
    folder: &Path,
    (inputs, oracle): (&Inputs, &Oracle),
    mut fingerprint: Fingerprint,
) -> std::io::Result<Fingerprint> {
    let mut formats = args.graded.format.clone();
    formats.sort_unstable();
    for format in formats {
        fingerprint.part(extension(format).as_bytes());
    }
    let how = format!(
        "{} {} {} {:?}",
        folder.display(),
        args.judge.no_jacobians,
        args.details.details,
        args.judge.criteria,
    );
    fingerprint.part(how.as_bytes());
    let assignment = inputs.assignment.as_ref().map(Assignment::path);
    for path in [assignment, inputs.rubric_path.as_deref()] {
        match path {
            Some(path) => fingerprint.file(path)?,
            None => fingerprint.part(b""),
        }
    }
    fingerprint.suite(&inputs.suite, oracle);
    match &inputs.hidden {
        Some((hidden, _)) => fingerprint.hidden(hidden),
        None => fingerprint.part(b""),
    }
    Ok(fingerprint)
}

/// The folder of a submission's pages below those of the class.
pub(super) fn pages_of(planned: &Planned) -> String {
    format!("{SUBMISSIONS}/{}", planned.report)
}

pub(super) fn extension(format: Format) -> &'static str {
    match format {
        Format::Text => "txt",
        Format::Json => "json",
        Format::Junit => "xml",
    }
}
