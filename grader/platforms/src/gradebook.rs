//! Gradebooks: the points of a class as CSV that a course platform imports.
//!
//! ```text
//! Canvas        Student,ID,SIS User ID,SIS Login ID,Section,COLUMN    and a row with the points possible
//! Moodle        Email address,ID number,Username,COLUMN               of these, the columns that the roster fills
//! Blackboard    Username,COLUMN
//! Brightspace   OrgDefinedId,Username,COLUMN Points Grade,End-of-Line Indicator     the same; the last cell is #
//! ```
//!
//! A student without points has no row: an empty cell would remove the points that the platform has.
//!
//! Formats: Canvas's guide "How do I import grades in the Gradebook?", Moodle's page "Grade import", Blackboard's "Upload
//! grades" and Brightspace's "Importing grades", of 2026.

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
    /// Blackboard.
    Blackboard,
    /// Brightspace.
    Brightspace,
}

/// How a platform's file looks.
struct Format {
    name: &'static str,
    columns: &'static [Column],
    /// Whether columns that the roster does not fill stay.
    keeps_empty: bool,
    /// Label of the row with the points possible.
    possible: Option<&'static str>,
    /// Text after the name of the column of points.
    suffix: &'static str,
    /// Name and cells of a last column.
    end: Option<(&'static str, &'static str)>,
    /// The columns of a roster that identify students.
    identities: &'static str,
}

/// A column about the student.
struct Column {
    name: &'static str,
    of: fn(&Student) -> &Untrusted,
    /// Whether the platform finds the student by it.
    identifies: bool,
}

/// A column by which the platform finds the student.
const fn key(name: &'static str, of: fn(&Student) -> &Untrusted) -> Column {
    Column { name, of, identifies: true }
}

/// A column for people.
const fn label(name: &'static str, of: fn(&Student) -> &Untrusted) -> Column {
    Column { name, of, identifies: false }
}

const CANVAS: Format = Format {
    name: "canvas",
    columns: &[
        label("Student", |student| &student.name),
        key("ID", |student| &student.canvas_id),
        key("SIS User ID", |student| &student.id),
        key("SIS Login ID", |student| &student.login),
        label("Section", |student| &student.section),
    ],
    keeps_empty: true,
    possible: Some("    Points Possible"),
    suffix: "",
    end: None,
    identities: "canvas id, id or login",
};

const MOODLE: Format = Format {
    name: "moodle",
    columns: &[
        key("Email address", |student| &student.email),
        key("ID number", |student| &student.id),
        key("Username", |student| &student.login),
    ],
    keeps_empty: false,
    possible: None,
    suffix: "",
    end: None,
    identities: "email, id or login",
};

const BLACKBOARD: Format = Format {
    name: "blackboard",
    columns: &[key("Username", |student| &student.login)],
    identities: "login",
    ..MOODLE
};

const BRIGHTSPACE: Format = Format {
    name: "brightspace",
    columns: &[
        key("OrgDefinedId", |student| &student.id),
        key("Username", |student| &student.login),
    ],
    suffix: " Points Grade",
    end: Some(("End-of-Line Indicator", "#")),
    identities: "id or login",
    ..MOODLE
};

/// The points of a class.
pub struct Gradebook<'a> {
    /// Name of the column of points.
    pub column: &'a str,
    /// Points possible, without extra credit.
    pub possible: &'a str,
    /// The students with their points; with `None`, a student has no row.
    pub rows: &'a [(&'a Student, Option<String>)],
}

impl GradebookKind {
    /// All.
    pub const ALL: [Self; 4] = [Self::Canvas, Self::Moodle, Self::Blackboard, Self::Brightspace];

    fn format(self) -> &'static Format {
        match self {
            Self::Canvas => &CANVAS,
            Self::Moodle => &MOODLE,
            Self::Blackboard => &BLACKBOARD,
            Self::Brightspace => &BRIGHTSPACE,
        }
    }

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        self.format().name
    }

    /// Checks that the platform can find every student of a roster.
    ///
    /// # Errors
    /// If nothing that it knows identifies a student, or it would have to be changed so that no spreadsheet reads it as a
    /// formula.
    pub fn check(self, roster: &Roster) -> Result<(), SheetError> {
        let Format { name, columns, identities: of_roster, .. } = self.format();
        for student in &roster.students {
            let identities = columns.iter().filter(|column| column.identifies);
            let identities: Vec<&Untrusted> =
                identities.map(|column| (column.of)(student)).filter(|id| !id.is_empty()).collect();
            let shown = student.shown();
            if identities.is_empty() {
                let message = format!(
                    "{name} cannot find {shown}\n  help: fill in one of the columns {of_roster}"
                );
                return Err(roster.wrong(student.line, message));
            }
            let is_changed = |id: &&Untrusted| inert(&id.text()) != id.raw(RawUse::Comparison);
            if let Some(id) = identities.into_iter().find(is_changed) {
                let message = format!(
                    "spreadsheets read {id:?} as a formula, and {name} would not find {shown} by it if it were changed\n  \
                     help: leave the cell empty, and fill in another one"
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
        let Format { columns, keeps_empty, possible: label, suffix, end, .. } = self.format();
        let is_used = |of: fn(&Student) -> &Untrusted| {
            rows.iter().any(|(student, _)| !of(student).is_empty())
        };
        let columns: Vec<&Column> =
            columns.iter().filter(|column| *keeps_empty || is_used(column.of)).collect();
        let names = columns.iter().map(|column| column.name.to_owned());
        let last = end.map(|(name, _)| name.to_owned());
        let mut table = InertCsv::new(names.chain([format!("{column}{suffix}")]).chain(last))?;
        if let Some(label) = label {
            let empty = columns[1..].iter().map(|_| "");
            table.row([*label].into_iter().chain(empty).chain([possible]))?;
        }
        let with_points =
            rows.iter().filter_map(|(student, points)| Some((student, points.clone()?)));
        for (student, points) in with_points {
            let cells = columns.iter().map(|column| (column.of)(student).text());
            table.row(cells.chain([points]).chain(end.map(|(_, cell)| cell.to_owned())))?;
        }
        table.bytes()
    }
}
