//! Gradebooks of a class: whose submission it is, when it came in, and the points that count.

use std::path::PathBuf;

use clap::Args;
use grader::boundary::printed;
use grader::class::Row;
use grader::class::layout::{self, HandInFacts};
use grader::class::plan::Plan;
use grader::class::roster::{Matching, Roster, Student};
use grader::grading::points;
use grader::rubric::late::Lateness;
use grader::submission::hand_in;
use grader::time::Time;
use platforms::gradebook::{Gradebook, GradebookKind};

use super::save;
use super::setting::Class;
use crate::args::parse_kind;
use crate::stop::{Stop, complain};

/// A gradebook that `--gradebook` asks for.
#[derive(Clone)]
pub(super) struct GradebookArg {
    kind: GradebookKind,
    pub(super) file: PathBuf,
}

fn parse_gradebook(text: &str) -> Result<GradebookArg, String> {
    let kinds = GradebookKind::ALL.map(|kind| (kind.name(), kind));
    let (kind, file) = parse_kind(text, "gradebook", &kinds)?;
    let file = file.ok_or_else(|| format!("a gradebook needs a file: {}=FILE.csv", kind.name()))?;
    Ok(GradebookArg { kind, file })
}

/// Options for gradebooks.
#[derive(Args)]
pub(super) struct GradebookArgs {
    /// Write the points as a gradebook to import (repeatable): canvas=FILE, moodle=FILE, blackboard=FILE or brightspace=FILE
    #[arg(long, value_name = "KIND=FILE", value_parser = parse_gradebook, requires = "roster")]
    pub(super) gradebook: Vec<GradebookArg>,

    /// The students (CSV), by columns: name, id, login, email, section; folder and submitted of their submissions; due.
    /// Exports of Canvas, Moodle, Blackboard and Brightspace work unchanged
    #[arg(long, value_name = "FILE")]
    pub(super) roster: Option<PathBuf>,

    /// The deadline, for students without one in the roster, as in 2026-02-01T23:59:00-08:00
    #[arg(long, value_name = "TIME", requires = "roster")]
    due: Option<Time>,

    /// Without a time in the roster, a submission came in when its newest file was last changed; students can set these
    /// times back
    #[arg(long, requires = "roster")]
    folder_times: bool,

    /// Name of the gradebook's column of points [default: the name of the assignment]
    #[arg(long, value_name = "NAME", requires = "gradebook")]
    column: Option<String>,
}

impl GradebookArgs {
    /// The same options with absolute paths.
    pub(super) fn absolute(&self) -> std::io::Result<Self> {
        let gradebook = self.gradebook.iter().map(|GradebookArg { kind, file }| {
            Ok(GradebookArg { kind: *kind, file: std::path::absolute(file)? })
        });
        Ok(Self {
            gradebook: gradebook.collect::<std::io::Result<_>>()?,
            roster: self.roster.as_deref().map(std::path::absolute).transpose()?,
            due: self.due,
            folder_times: self.folder_times,
            column: self.column.clone(),
        })
    }
}

impl Class<'_> {
    /// The roster, and which of the submissions is whose; `None` without a roster.
    ///
    /// # Errors
    /// If the roster cannot be used: it is read before anything is graded.
    pub(super) fn roster(&self, names: &[&str]) -> Result<Option<(Roster, Matching)>, Stop> {
        let args = &self.args.gradebook;
        let Some(path) = &args.roster else { return Ok(None) };
        let mut roster = Roster::load(path).map_err(Stop::bad_input)?;
        if let Some(arranged) = &self.arranged {
            layout::assign(&mut roster, arranged);
        }
        for GradebookArg { kind, .. } in &args.gradebook {
            kind.check(&roster).map_err(Stop::bad_input)?;
        }
        let matching = roster.find_submissions(names);
        let has_penalty = self.inputs.rubric.late().penalty.0 > 0.0;
        let lacks_due = |student: &&Student| {
            let is_timed = student.submitted.is_some() || args.folder_times;
            is_timed && student.due.or(args.due).is_none()
        };
        if let Some(student) = roster.students.iter().find(lacks_due).filter(|_| has_penalty) {
            let message = "there is a time of submission, but no deadline\n  help: name it with --due, as in \
                           --due 2026-02-01T23:59:00-08:00, or in the column due";
            return Err(Stop::bad_input(roster.wrong(student.line, message)));
        }
        Ok(Some((roster, matching)))
    }

    /// Writes the gradebooks, if every submission has a row. Returns remarks for the summary.
    pub(super) fn write_gradebooks(&self, plan: &Plan, rows: &[Row]) -> Result<Vec<String>, Stop> {
        let names: Vec<&str> = plan.submissions.iter().map(|planned| &*planned.name).collect();
        let Some((roster, matching)) = self.roster(&names)? else { return Ok(Vec::new()) };
        let args = &self.args.gradebook;
        let file = args.roster.as_deref().unwrap_or(self.folder).display();
        let mut remarks = remarks(&roster, &matching, &names);
        let missing = matching.submissions.iter().filter(|found| found.is_none()).count();
        let (unknown, ambiguous) = (matching.unknown.len(), matching.ambiguous.len());
        if !remarks.is_empty() {
            complain(
                "warning",
                format!(
                    "{file}: students without a submission: {missing}; submissions of no student: {unknown}; ambiguous: \
                     {ambiguous}; summary.txt names them"
                ),
            );
        }
        let students = roster.students.len();
        remarks.insert(
            0,
            format!("{file}: {} of {students} students have a submission", students - missing),
        );
        if rows.len() < names.len() {
            remarks.push("no gradebook is written: some submissions have no result".to_owned());
            return Ok(remarks);
        }
        let is_timed_by_files = |(student, found): &(&Student, &Option<usize>)| {
            student.submitted.is_none() && found.is_some()
        };
        let pairs = roster.students.iter().zip(&matching.submissions);
        let by_files = pairs.filter(is_timed_by_files).count();
        if args.folder_times && by_files > 0 {
            let warning = format!(
                "{by_files} times are those of files, which students can set back; put the platform's times into the \
                 column submitted"
            );
            complain("warning", &warning);
            remarks.push(warning);
        }
        let mut graded = Vec::with_capacity(students);
        let mut has_less = false;
        for (student, submission) in roster.students.iter().zip(&matching.submissions) {
            let row = submission.map(|place| &rows[place]);
            let points = row.and_then(|row| self.points(student, row, &mut remarks));
            has_less |= points.is_some() && points.as_ref() != row.map(|row| &row.points);
            graded.push((student, points));
        }
        if has_less {
            let remark = "the table and the reports show the points before what lateness takes off";
            remarks.push(remark.to_owned());
        }
        let assignment = self.inputs.assignment.as_ref().map(|assignment| &*assignment.name);
        let column = args.column.as_deref().or(assignment).unwrap_or("Spring Oracle");
        let possible = rows.first().map_or("0", |row| &row.required.1);
        let with_points = graded.iter().filter(|(_, points)| points.is_some()).count();
        for GradebookArg { kind, file } in &args.gradebook {
            let gradebook = Gradebook { column, possible, rows: &graded };
            save(file, &kind.render(&gradebook).map_err(Stop::fault)?)?;
            remarks.push(format!(
                "{}: points of {with_points} of {students} students, in the column {column:?}",
                file.display()
            ));
        }
        Ok(remarks)
    }

    /// The points that count for a student; `None` if the submission could not be graded or judged. Adds remarks on what
    /// changed them.
    fn points(&self, student: &Student, row: &Row, remarks: &mut Vec<String>) -> Option<String> {
        let shown = student.shown();
        let earned = row.earned.as_ref().and_then(|earned| earned.parse::<f64>().ok());
        let Some(earned) = earned else {
            remarks.push(format!("no points: {shown}: {} could not be judged", row.name));
            return None;
        };
        // Points by hand say that somebody looked at it.
        if row.is_refused() && row.adjustments.is_empty() {
            remarks.push(format!("no points: {shown}: {} could not be graded", row.name));
            return None;
        }
        if row.not_judged != "0" {
            remarks.push(format!("not judged: {shown}: {} points of {}", row.not_judged, row.name));
        }
        let args = &self.args.gradebook;
        let of_folder = || self.folder_time(&row.name).filter(|_| args.folder_times);
        let counted = |points: f64| points::shown((points + row.adjustment()).max(0.0));
        let Some(due) = student.due.or(args.due) else { return Some(row.points.clone()) };
        let Some(submitted) = student.submitted.or_else(of_folder) else {
            if self.facts(&row.name).is_some_and(|facts| facts.late) {
                remarks.push(format!(
                    "marked as late: {shown}: {} counts as in time until the column submitted says when it came in",
                    row.name
                ));
                return Some(row.points.clone());
            }
            remarks.push(format!("time unknown: {shown}: {} counts as in time", row.name));
            return Some(row.points.clone());
        };
        let Some(late) = self.inputs.rubric.late().lateness(submitted.0 - due.0) else {
            return Some(row.points.clone());
        };
        let Lateness { days, percent } = late;
        if self.inputs.rubric.late().penalty.0 == 0.0 {
            remarks.push(format!(
                "late: {shown}: on day {days} after the deadline; nothing is taken off, as the rubric has no rule for \
                 that ([late])"
            ));
            return Some(row.points.clone());
        }
        let remaining = points::shown(late.remaining(earned));
        let of = points::shown(earned);
        let points = counted(late.remaining(earned));
        let adjusted = match &*row.adjustments {
            [] => String::new(),
            [_, ..] => format!("; with adjustments, {points} count"),
        };
        remarks.push(format!(
            "late: {shown}: on day {days} after the deadline, {} % taken off, {remaining} of {of} points remain{adjusted}",
            points::shown(percent)
        ));
        Some(points)
    }

    /// Facts of the platform about a submission.
    fn facts(&self, name: &str) -> Option<&HandInFacts> {
        self.arranged.as_ref()?.of(name)
    }

    /// When the newest file of a submission was changed; `None` if it cannot be read, which is its verdict.
    fn folder_time(&self, name: &str) -> Option<Time> {
        if let Some(facts) = self.facts(name) {
            return facts.changed.map(|seconds| Time(seconds as f64));
        }
        hand_in::last_changed(&self.folder.join(name)).ok().flatten()
    }
}

/// Students without a submission, submissions without a student, and ambiguous ones, a line each.
fn remarks(roster: &Roster, matching: &Matching, names: &[&str]) -> Vec<String> {
    let pairs = roster.students.iter().zip(&matching.submissions);
    let ambiguous: Vec<usize> =
        matching.ambiguous.iter().flat_map(|found| found.students.iter().copied()).collect();
    let missing = pairs
        .enumerate()
        .filter(|(place, (_, submission))| submission.is_none() && !ambiguous.contains(place));
    let missing = missing
        .map(|(_, (student, _))| student)
        .map(|student| format!("no submission: {} (line {})", student.shown(), student.line));
    let unknown = matching.unknown.iter().map(|place| {
        format!("no student: {}; its points are in no gradebook", printed::text(names[*place]))
    });
    let ambiguous = matching.ambiguous.iter().map(|found| roster.explain(found, names));
    missing.chain(unknown).chain(ambiguous).collect()
}
