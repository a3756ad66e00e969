//! Adjustments: points that a teacher grants or withdraws, with reasons, as CSV. The file stays, whatever is graded again.
//!
//! ```text
//! student,points,reason
//! ab1234,2,regrade request: the scene was ambiguous
//! Ada Lovelace,-1.5,handed in by mail
//! ```
//!
//! A student is named by the submission, or, if there is a roster, by ID, login, email address or name. Points change those of
//! the submission, for all of its students, after what lateness takes off.

use std::collections::BTreeMap;
use std::path::Path;

use super::roster::Roster;
use super::sheet::{self, Sheet, SheetError};
use crate::boundary::printed::{self, inert};
use crate::grading::Adjustment;

/// The adjustments of each submission that has some, in the order of the file.
pub type Adjustments = BTreeMap<String, Vec<Adjustment>>;

/// Reads the adjustments of these submissions.
///
/// # Errors
/// If the file cannot be read, or a row is of no submission, or lacks a number or a reason.
pub fn load(
    path: &Path,
    submissions: &[&str],
    roster: Option<&Roster>,
) -> Result<Adjustments, SheetError> {
    of_sheet(&Sheet::load(path)?, submissions, roster)
}

fn of_sheet(
    sheet: &Sheet,
    submissions: &[&str],
    roster: Option<&Roster>,
) -> Result<Adjustments, SheetError> {
    let column = |name: &str| {
        let place = sheet.header.iter().position(|cell| cell.eq_ignore_ascii_case(name));
        let help = "name the columns in the first line: student,points,reason";
        place.ok_or_else(|| sheet.wrong(1, format!("there is no column {name}\n  help: {help}")))
    };
    let [student, points, reason] = [column("student")?, column("points")?, column("reason")?];
    let mut adjustments = Adjustments::new();
    for record in &sheet.records {
        let wrong = |message: String| sheet.wrong(sheet::line(record), message);
        let shown = printed::line(&record[student]);
        let named =
            submissions.iter().find(|name| [name, &&*inert(name)].contains(&&&record[student]));
        let of_roster =
            || roster.and_then(|roster| roster.submission_of(&record[student], submissions));
        let Some(submission) = named.copied().or_else(of_roster) else {
            let help = match roster {
                Some(_) => {
                    "write the name of a submission, or an ID, a login, an email address or a name of the roster"
                }
                None => "write the name of a submission, or name a roster with --roster",
            };
            return Err(wrong(format!("{shown:?} has no submission\n  help: {help}")));
        };
        let number = record[points].parse().ok().filter(|points: &f64| points.is_finite());
        let points = number.ok_or_else(|| {
            let cell = printed::line(&record[points]);
            wrong(format!("{shown}: {cell:?} is no number of points, such as 2 or -1.5"))
        })?;
        if record[reason].is_empty() {
            return Err(wrong(format!("{shown}: there is no reason\n  help: students read it")));
        }
        let reason = record[reason].into();
        let own = adjustments.entry(submission.to_owned()).or_default();
        own.push(Adjustment { points, reason });
    }
    Ok(adjustments)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boundary::printed::Untrusted;

    fn read(rows: &str, roster: Option<&str>) -> Result<Adjustments, String> {
        let sheet = Sheet::parse(&format!("Student,Points,Reason\n{rows}"), Path::new("a.csv"));
        let roster =
            roster.map(|text| Roster::parse(&Untrusted::from(text), Path::new("r.csv")).unwrap());
        let submissions = ["ada_t1m3", "=bob"];
        let read = sheet.and_then(|sheet| of_sheet(&sheet, &submissions, roster.as_ref()));
        read.map_err(|error| error.to_string())
    }

    #[test]
    fn adjustments_belong_to_submissions_or_students() {
        let roster = "name,login\nAda Lovelace,ada\nBob,b9\n";
        let rows = "ADA lovelace,2,regrade\n'=bob,-1,late\nada_t1m3,.5,more\n";
        let found = read(rows, Some(roster)).unwrap();
        let points = |name: &str| found[name].iter().map(|it| it.points).collect::<Vec<_>>();
        assert_eq!((points("ada_t1m3"), points("=bob")), (vec![2.0, 0.5], vec![-1.0]));
        for (rows, roster, message) in [
            (
                "ada,2,x\n",
                None,
                "a.csv:2: \"ada\" has no submission\n  help: write the name of a submission, or name a roster",
            ),
            ("b9,2,x\n", Some(roster), "a.csv:2: \"b9\" has no submission"),
            ("=bob,2,x\nada_t1m3,two,x\n", None, "a.csv:3: ada_t1m3: \"two\" is no number"),
            ("ada_t1m3,NaN,x\n", None, "a.csv:2: ada_t1m3: \"NaN\" is no number"),
            ("ada_t1m3,2,\n", None, "a.csv:2: ada_t1m3: there is no reason"),
        ] {
            let error = read(rows, roster).unwrap_err();
            assert!(error.starts_with(message), "{error}");
        }
    }
}
