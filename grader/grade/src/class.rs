//! `grade class`: grades every submission in a folder, one after the other.
//!
//! The scenes of one submission run in parallel. Two submissions never run at the same time: each has the machine
//! to itself, memory use is that of one, and neither can observe the other.

use std::collections::BTreeMap;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use grader::assignment::ALL;
use grader::class::Row;
use grader::class::entry::{self, ClassEntry};
use grader::class::fingerprint::Fingerprint;
use grader::class::record::Record;
use grader::events::{Event, Observer, Task};
use grader::grading::{Checks, Grading, panic_message};
use grader::oracle::Oracle;

use grader::submission::Submission;
use grader::submission::folder;
use grader::submission::program::Runner;
use grader::suite::hash_file;
use grader::verdict::{Failure, Fault};
use report::html::{self, ClassResult};
use sandbox::Protection;

use crate::args::{ClassArgs, Format};
use crate::grading::render;
use crate::inputs::{Inputs, open_oracle};
use crate::interrupt::Interrupt;
use crate::output::{print, replace_file};
use crate::pages::Pages;
use crate::progress::Progress;
use crate::stop::{Exit, Stop};
use crate::submission::{check_secrets, open_entry, refused};

/// Reports of a submission: the name and content of each file.
type Reports = Vec<(String, Vec<u8>)>;

/// The settings and inputs shared by all submissions.
struct Class<'a> {
    args: &'a ClassArgs,
    inputs: Inputs,
    oracle: Oracle,
    runner: Runner,
    protections: Vec<Protection>,
    /// Hash of all inputs except the submission.
    fingerprint: Fingerprint,
    reports: PathBuf,
    records: PathBuf,
    pages: Option<Pages>,
    progress: Progress,
}

pub(super) fn grade(args: &ClassArgs) -> Result<Exit, Stop> {
    let unreadable = |error| Stop::bad_input(format!("{}: {error}", args.folder.display()));
    let (entries, passed_over) = entry::list(&args.folder).map_err(unreadable)?;
    if entries.is_empty() {
        return Err(Stop::bad_input(format!(
            "{}: no submissions found\n  help: put programs, folders with submission.toml, or folders of traces \
            there",
            args.folder.display()
        )));
    }
    let class = Class::open(args)?;
    let total = entries.len();
    let mut rows = Vec::with_capacity(total);
    for (entry, number) in entries.iter().zip(1..) {
        class.progress.notice(Event::Submission { name: &entry.name, number, total });
        let Some(row) = class.row(entry)? else { break };
        rows.push(row);
    }
    let not_graded: Vec<&str> = entries[rows.len()..].iter().map(|entry| &*entry.name).collect();
    let assignment = class.inputs.assignment.as_ref();
    let heading = assignment.map_or_else(String::new, |assignment| {
        format!("Assignment {}: {}\n", assignment.name, assignment.title)
    });
    let output = args.output.clone();
    let protections = class.protections.clone();
    let cases = &class.inputs.suite.cases;
    let unjudged =
        cases.iter().filter_map(|case| Some((case.id.clone(), class.oracle.fault(case)?)));
    let unjudged: Vec<(String, Fault)> = unjudged.collect();
    let pages = class.pages.clone();
    drop(class);
    let csv = report::class::csv(&rows, &not_graded).map_err(Stop::fault)?;
    save(&output.join("summary.csv"), &csv)?;
    let mut text = heading.into_bytes();
    report::class::write(&mut text, &rows, &unjudged, &not_graded, &passed_over, &protections)
        .map_err(Stop::fault)?;
    save(&output.join("summary.txt"), &text)?;
    print(&text)?;
    if let Some(pages) = pages {
        let named: Vec<_> =
            rows.iter().zip(&entries).map(|(row, entry)| (row, &*entry.report)).collect();
        let result = ClassResult {
            rows: &named,
            not_graded: &not_graded,
            passed_over: &passed_over,
            protections: &protections,
        };
        pages.write("", |sink| html::class(&result, sink))?;
        pages.announce();
    }
    if !not_graded.is_empty() {
        let done = rows.len();
        return Err(Stop(
            Exit::Interrupted,
            format!("{done} of {total} submissions graded\n  help: continue with --resume"),
        ));
    }
    let has_faults = !unjudged.is_empty() || rows.iter().any(Row::is_fault);
    Ok(if has_faults { Exit::GraderFault } else { Exit::Passed })
}

impl<'a> Class<'a> {
    fn open(args: &'a ClassArgs) -> Result<Self, Stop> {
        let inputs = args.suite.read_for(&args.judge.judging())?;
        let oracle = open_oracle(&inputs.expected)?;
        let [reports, records] = ["reports", "resume"].map(|name| args.output.join(name));
        for folder in [&reports, &records] {
            fs::create_dir_all(folder).map_err(|error| unwritable(folder, &error))?;
            let metadata =
                fs::symlink_metadata(folder).map_err(|error| unwritable(folder, &error))?;
            if !metadata.is_dir() {
                return Err(Stop::bad_input(format!(
                    "{}: is a symbolic link; reports are not written through links\n  help: remove it, or name \
                     another folder with --output",
                    folder.display()
                )));
            }
        }
        let pages = args.html.as_deref().map(Pages::open).transpose()?;
        keep_apart(args, &inputs)?;
        let (runner, protections) = args.run.runner(&inputs.rubric)?;
        let fingerprint = fingerprint(args, &inputs, &oracle, &runner).map_err(Stop::fault)?;
        let interrupt = Interrupt::listen()?;
        let progress = Progress::new(!args.judge.no_progress, interrupt);
        Ok(Self {
            args,
            inputs,
            oracle,
            runner,
            protections,
            fingerprint,
            reports,
            records,
            pages,
            progress,
        })
    }

    /// Grades a submission, unless an earlier run did, writes its reports, and returns its row; `None` if interrupted.
    ///
    /// # Errors
    /// If the reports cannot be written. All other failures are recorded in the row.
    fn row(&self, entry: &ClassEntry) -> Result<Option<Row>, Stop> {
        if self.progress.is_stopped() {
            return Ok(None);
        }
        let mut fingerprint = self.fingerprint.clone();
        let files = fingerprint.submission(&entry.path);
        // A submission that cannot be read has no fingerprint; it is graded again each time.
        let fingerprint = files.is_ok().then(|| fingerprint.finish());
        let record_path = self.records.join(format!("{}.json", entry.report));
        let has_pages = self.pages.as_ref().is_none_or(|pages| pages.is_written(&entry.report));
        if let (Some(fingerprint), true) = (&fingerprint, self.args.resume && has_pages)
            && let Some(record) = Record::read(&record_path, fingerprint, &self.reports)
        {
            return Ok(Some(record.row));
        }
        let graded = self.graded(entry, || match &files {
            Ok(()) => {
                self.progress.notice(Event::Task(Task::Opening));
                match self.other_assignment(&entry.path) {
                    Some(detail) => {
                        let failure = Failure::BadHandIn { detail };
                        Submission::Unusable { name: entry.name.clone(), failure }
                    }
                    None => open_entry(
                        &entry.path,
                        &entry.name,
                        self.runner.clone(),
                        &self.inputs.rubric,
                    ),
                }
            }
            Err(error) => refused(entry.name.clone(), error),
        });
        let graded = graded.or_else(|detail| {
            let name = entry.name.clone();
            self.graded(entry, || Submission::NotGraded { name, detail })
        });
        if self.progress.is_stopped() {
            return Ok(None);
        }
        let (grading, rendered) = graded.map_err(Stop::fault)?;
        let row = Row::of(&grading);
        if let Some(pages) = &self.pages {
            let above = [("../index.html".to_owned(), "Class".to_owned())];
            pages.write(&entry.report, |sink| {
                html::submission(&grading, &self.inputs.suite, &above, sink)
            })?;
        }
        let mut reports = BTreeMap::new();
        for (file, bytes) in rendered {
            let path = self.reports.join(&file);
            save(&path, &bytes)?;
            reports.insert(file, hash_file(&path).map_err(|error| unwritable(&path, &error))?);
        }
        if let Some(fingerprint) = fingerprint {
            let record = Record { fingerprint, row: row.clone(), reports };
            save(&record_path, record.render().map_err(Stop::fault)?.as_bytes())?;
        }
        Ok(Some(row))
    }

    /// A message, if a submission names another assignment than the class.
    fn other_assignment(&self, submission: &Path) -> Option<String> {
        if !submission.is_dir() || !folder::is_submission(submission) {
            return None;
        }
        let own = folder::assignment_of(submission).ok()??;
        let of_class = self.inputs.assignment.as_ref();
        let of_class = of_class.map_or(ALL, |assignment| &assignment.name);
        (own != of_class).then(|| {
            format!(
                "submission.toml names the assignment {own:?}, but the class is graded as {of_class}\n  help: change it \
                 there, or grade the class with --assignment"
            )
        })
    }

    /// The grading of a submission, and its reports by file name.
    ///
    /// # Errors
    /// A message, if the grader panics or a report cannot be rendered.
    fn graded(
        &self,
        entry: &ClassEntry,
        open: impl FnOnce() -> Submission,
    ) -> Result<(Grading, Reports), String> {
        let graded = catch_unwind(AssertUnwindSafe(|| {
            let mut grading = self.grade(&open());
            // Names in submission.toml need not be unique.
            grading.submission.clone_from(&entry.name);
            let render = |format: &Format| {
                let bytes = render(&grading, *format, |out| {
                    let config = report::text::TextOptions { details: self.args.judge.details };
                    report::text::write(out, &grading, config)
                });
                let bytes = bytes.map_err(|Stop(_, message)| message)?;
                Ok((format!("{}.{}", entry.report, extension(*format)), bytes))
            };
            let reports = self.args.format.iter().map(render).collect::<Result<_, String>>()?;
            Ok((grading, reports))
        }));
        graded.unwrap_or_else(|panic| {
            Err(format!("the grader panicked: {}", panic_message(panic.as_ref())))
        })
    }

    fn grade(&self, submission: &Submission) -> Grading {
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
            altered: true,
            hidden: true,
            recordings: self.pages.is_some(),
        };
        self.inputs.grader(&self.oracle, checks, &self.progress).grade(submission, protection)
    }
}

/// Checks that no submission can read the oracle, the hidden scenes, the reports, or another submission.
fn keep_apart(args: &ClassArgs, inputs: &Inputs) -> Result<(), Stop> {
    let real = |path: &Path| {
        fs::canonicalize(path)
            .map_err(|error| Stop::bad_input(format!("{}: {error}", path.display())))
    };
    let folder = real(&args.folder)?;
    let mut secrets = inputs.secrets();
    secrets.push(args.output.clone());
    secrets.extend(args.html.clone());
    for secret in &secrets {
        if real(secret)?.starts_with(&folder) {
            return Err(Stop::bad_input(format!(
                "{}: is inside the folder of submissions\n  help: move it out of {}",
                secret.display(),
                args.folder.display()
            )));
        }
    }
    if args.run.unprotected {
        return Ok(());
    }
    secrets.push(args.folder.clone());
    let readable =
        args.run.readable.iter().map(|path| real(path)).collect::<Result<Vec<_>, _>>()?;
    check_secrets(&secrets, &readable)
}

/// Hash of everything that the reports of this run depend on, except the submission.
fn fingerprint(
    args: &ClassArgs,
    inputs: &Inputs,
    oracle: &Oracle,
    runner: &Runner,
) -> std::io::Result<Fingerprint> {
    let mut fingerprint = Fingerprint::of_grader()?;
    let mut formats = args.format.clone();
    formats.sort_unstable();
    for format in formats {
        fingerprint.part(extension(format).as_bytes());
    }
    let how = format!(
        "{:?} {:?} {} {} {} {} {:?} {:?}",
        runner.limits,
        runner.readable,
        args.folder.display(),
        args.run.unprotected,
        args.judge.no_jacobians,
        args.judge.details,
        args.judge.criteria,
        args.html,
    );
    fingerprint.part(how.as_bytes());
    match &inputs.assignment {
        Some(assignment) => fingerprint.file(assignment.path())?,
        None => fingerprint.part(b""),
    }
    match &inputs.rubric_path {
        Some(path) => fingerprint.file(path)?,
        None => fingerprint.part(b""),
    }
    fingerprint.suite(&inputs.suite, oracle);
    match &inputs.hidden {
        Some((hidden, _)) => fingerprint.hidden(hidden),
        None => fingerprint.part(b""),
    }
    Ok(fingerprint)
}

fn extension(format: Format) -> &'static str {
    match format {
        Format::Text => "txt",
        Format::Json => "json",
        Format::Junit => "xml",
    }
}

fn save(path: &Path, bytes: &[u8]) -> Result<(), Stop> {
    replace_file(path, bytes).map_err(|error| unwritable(path, &error))
}

fn unwritable(path: &Path, error: &std::io::Error) -> Stop {
    Stop::bad_input(format!("{}: {error}", path.display()))
}
