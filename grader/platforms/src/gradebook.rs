//! Gradebooks: the points of a class as CSV that a course platform imports.
//!
//! ```text
//! Canvas   Student,ID,SIS User ID,SIS Login ID,Section,COLUMN    and a row with the points possible
//! Moodle   Email address,ID number,Username,COLUMN               of these, the columns that the roster fills
//! ```
//!
//! A student without points has an empty cell. Formats: Canvas's guide "How do I import grades in the Gradebook?" and
//! Moodle's page "Grade import", of 2026.

use grader::boundary::printed::{InertCsv, RawUse, Untrusted, inert};
use grader::class::roster::{Roster, Student};
use grader::class::sheet::SheetError;

/// A platform with a gradebook.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GradebookKind {
    /// Canvas.
    Canvas,
    /// Moodle.
    Moodle,
}

/// A column about the student.
struct Column {
    name: &'static str,
    of: fn(&Student) -> &Untrusted,
    /// Whether the platform finds the student by it.
    identifies: bool,
}

const CANVAS: [Column; 5] = [
    Column { name: "Student", of: |student| &student.name, identifies: false },
    Column { name: "ID", of: |student| &student.canvas_id, identifies: true },
    Column { name: "SIS User ID", of: |student| &student.id, identifies: true },
    Column { name: "SIS Login ID", of: |student| &student.login, identifies: true },
    Column { name: "Section", of: |student| &student.section, identifies: false },
];

const MOODLE: [Column; 3] = [
    Column { name: "Email address", of: |student| &student.email, identifies: true },
    Column { name: "ID number", of: |student| &student.id, identifies: true },
    Column { name: "Username", of: |student| &student.login, identifies: true },
];

/// The points of a class.
pub struct Gradebook<'a> {
    /// Name of the column of points.
    pub column: &'a str,
    /// Points possible, without extra credit.
    pub possible: &'a str,
    /// The students with their points; `None` leaves the cell empty.
    pub rows: &'a [(&'a Student, Option<String>)],
}

impl GradebookKind {
    /// All.
    pub const ALL: [Self; 2] = [Self::Canvas, Self::Moodle];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Canvas => "canvas",
            Self::Moodle => "moodle",
        }
    }

    fn all_columns(self) -> &'static [Column] {
        match self {
            Self::Canvas => &CANVAS,
            Self::Moodle => &MOODLE,
        }
    }

    /// Checks that the platform can find every student of a roster.
    ///
    /// # Errors
    /// If nothing that it knows identifies a student, or it would have to be changed so that no spreadsheet reads it as a
    /// formula.
    pub fn check(self, roster: &Roster) -> Result<(), SheetError> {
        for student in &roster.students {
            let identities = self.all_columns().iter().filter(|column| column.identifies);
            let identities: Vec<&Untrusted> =
                identities.map(|column| (column.of)(student)).filter(|id| !id.is_empty()).collect();
            let shown = student.shown();
            if identities.is_empty() {
                let columns = match self {
                    Self::Canvas => "canvas id, id or login",
                    Self::Moodle => "email, id or login",
                };
                let message = format!(
                    "{} cannot find {shown}\n  help: fill in one of the columns {columns}",
                    self.name()
                );
                return Err(roster.wrong(student.line, message));
            }
            let is_changed = |id: &&Untrusted| inert(&id.text()) != id.raw(RawUse::Comparison);
            if let Some(id) = identities.into_iter().find(is_changed) {
                let message = format!(
                    "spreadsheets read {id:?} as a formula, and {} would not find {shown} by it if it were changed\n  \
                     help: leave the cell empty, and fill in another one",
                    self.name()
                );
                return Err(roster.wrong(student.line, message));
            }
        }
        Ok(())
    }

    /// The gradebook as CSV.
    ///
    /// # Errors
    /// Never in practice.
    pub fn render(self, gradebook: &Gradebook<'_>) -> csv::Result<Vec<u8>> {
        let Gradebook { column, possible, rows } = *gradebook;
        let is_used = |of: fn(&Student) -> &Untrusted| {
            rows.iter().any(|(student, _)| !of(student).is_empty())
        };
        let columns = self.all_columns().iter();
        let columns: Vec<&Column> =
            columns.filter(|column| self == Self::Canvas || is_used(column.of)).collect();
        let names = columns.iter().map(|column| column.name);
        let mut table = InertCsv::new(names.chain([column]))?;
        if self == Self::Canvas {
            let empty = columns[1..].iter().map(|_| "");
            table.row(["    Points Possible"].into_iter().chain(empty).chain([possible]))?;
        }
        for (student, points) in rows {
            let cells = columns.iter().map(|column| (column.of)(student).text());
            table.row(cells.chain([points.clone().unwrap_or_default()]))?;
        }
        table.bytes()
    }
}
