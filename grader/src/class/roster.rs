//! The roster of a class, as CSV: its students, and which submission is whose.
//!
//! ```text
//! 1. the submission that the column `folder` names
//! 2. a submission whose whole name is an ID, a login, an email address, the part of it before the @, or a name
//! 3. a submission of whose name such a key is a part between underscores: ab1234_t1m3, or Ada Lovelace_4711_file_
//! ```
//!
//! Later steps match only submissions that the earlier ones left. A submission that fits two students counts for neither,
//! and of several that fit one student none counts: a guess could give points to somebody else, and students choose the
//! names. Case and repeated spaces do not matter.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

use csv::StringRecord;

use super::sheet::{self, Sheet, SheetError};
use crate::boundary::printed::{self, RawUse, Untrusted};
use crate::time::Time;

/// A roster.
#[derive(Debug, Clone, PartialEq)]
pub struct Roster {
    path: PathBuf,
    /// The students, in the order of the file.
    pub students: Vec<Student>,
}

/// A student. Text is empty if the roster has none.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Student {
    /// Line in the file, from 1.
    pub line: u64,
    /// Name.
    pub name: Untrusted,
    /// The university's ID.
    pub id: Untrusted,
    /// The ID in Canvas.
    pub canvas_id: Untrusted,
    /// Login.
    pub login: Untrusted,
    /// Email address.
    pub email: Untrusted,
    /// Section.
    pub section: Untrusted,
    /// The name of the submission.
    pub folder: Untrusted,
    /// When the submission came in.
    pub submitted: Option<Time>,
    /// The deadline, if it is the student's own.
    pub due: Option<Time>,
}

/// A column of a roster.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Column {
    Name,
    FirstName,
    LastName,
    Id,
    CanvasId,
    Login,
    Email,
    Section,
    Folder,
    Submitted,
    Due,
}

/// Names of the columns, in lower case: ours, then those in exports of Canvas, Moodle, Blackboard and Brightspace.
const COLUMNS: [(Column, &[&str]); 11] = [
    (Column::Name, &["name", STUDENT]),
    (Column::FirstName, &["first name", "firstname"]),
    (Column::LastName, &["last name", "lastname", "surname"]),
    (Column::Id, &["id", SIS_USER_ID, "id number", "student id", "orgdefinedid"]),
    (Column::CanvasId, &["canvas id"]),
    (Column::Login, &["login", "sis login id", "username"]),
    (Column::Email, &["email", "email address"]),
    (Column::Section, &["section"]),
    (Column::Folder, &["folder"]),
    (Column::Submitted, &["submitted"]),
    (Column::Due, &["due"]),
];

/// Name of the column of names in exports of Canvas.
const STUDENT: &str = "student";

/// Name of the column of the university's IDs in exports of Canvas, whose column `ID` is Canvas's own.
const SIS_USER_ID: &str = "sis user id";

/// Whether a header is that of an export of Canvas, which may split names.
fn is_of_canvas(header: &StringRecord) -> bool {
    header.iter().any(|name| [STUDENT, SIS_USER_ID].contains(&normalised(name).as_str()))
}

/// Which submission is whose.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Matching {
    /// The place of each student's submission; `None` if there is none.
    pub submissions: Vec<Option<usize>>,
    /// The places of submissions of no student.
    pub unknown: Vec<usize>,
    /// Submissions that are nobody's until the column `folder` decides.
    pub ambiguous: Vec<Ambiguity>,
}

/// A submission that fits several students, or several submissions that fit one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ambiguity {
    /// The places of the students.
    pub students: Vec<usize>,
    /// The places of the submissions.
    pub submissions: Vec<usize>,
}

impl Student {
    /// Name, else email address, login or ID, for display.
    pub fn shown(&self) -> String {
        let known = [&self.name, &self.email, &self.login, &self.id, &self.canvas_id];
        known.into_iter().find(|text| !text.is_empty()).map_or_else(String::new, Untrusted::line)
    }

    /// The texts by which a submission is recognised, normalised.
    fn keys(&self) -> Vec<String> {
        let [id, canvas_id, login, email, name] =
            [&self.id, &self.canvas_id, &self.login, &self.email, &self.name]
                .map(|text| text.raw(RawUse::Comparison));
        let local = email.split('@').next().unwrap_or_default();
        let last_first = name.split_once(',');
        let first_last = last_first.map(|(last, first)| format!("{first} {last}"));
        let texts = [id, canvas_id, login, email, local, name];
        let texts = texts.into_iter().chain(first_last.as_deref());
        texts.map(normalised).filter(|key| !key.is_empty()).collect()
    }
}

impl Roster {
    /// Reads a roster.
    ///
    /// # Errors
    /// If it cannot be read, a line is invalid, nothing identifies a student, or two students have the same ID, login or
    /// email address.
    pub fn load(path: &Path) -> Result<Self, SheetError> {
        Self::of_sheet(&Sheet::load(path)?, path)
    }

    /// Parses a roster. `path` is its name in messages.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn parse(text: &Untrusted, path: &Path) -> Result<Self, SheetError> {
        Self::of_sheet(&Sheet::parse(text.raw(RawUse::Parsing), path)?, path)
    }

    fn of_sheet(sheet: &Sheet, path: &Path) -> Result<Self, SheetError> {
        let mut roster = Self { path: path.to_path_buf(), students: Vec::new() };
        let header = &sheet.header;
        let columns = roster.columns(header)?;
        let is_of_canvas = is_of_canvas(header);
        let has_canvas_ids = columns.contains(&Some(Column::CanvasId));
        for record in &sheet.records {
            let student = roster.student(&columns, record)?;
            // A row of Canvas about the assignments.
            if is_of_canvas && has_canvas_ids && student.canvas_id.is_empty() {
                continue;
            }
            if student.keys().is_empty() {
                let message =
                    "nothing identifies the student\n  help: fill in id, login, email or name";
                return Err(roster.wrong(student.line, message));
            }
            roster.students.push(student);
        }
        roster.refuse_duplicates()?;
        Ok(roster)
    }

    /// The column of each place of the header.
    fn columns(&self, header: &StringRecord) -> Result<Vec<Option<Column>>, SheetError> {
        let is_of_canvas = is_of_canvas(header);
        let column = |name: &str| {
            let name = normalised(name);
            let known = COLUMNS.iter().find(|(_, names)| names.contains(&name.as_str()));
            match known.map(|(column, _)| *column) {
                Some(Column::Id) if is_of_canvas && name == "id" => Some(Column::CanvasId),
                column => column,
            }
        };
        let columns: Vec<Option<Column>> = header.iter().map(column).collect();
        for (place, column) in columns.iter().enumerate().filter(|(_, column)| column.is_some()) {
            if let Some(earlier) = columns[..place].iter().position(|other| other == column) {
                let names = [&header[earlier], &header[place]];
                let message = format!(
                    "the columns {:?} and {:?} mean the same\n  help: remove one of them",
                    names[0], names[1]
                );
                return Err(self.wrong(1, message));
            }
        }
        let identifies = [Column::Id, Column::CanvasId, Column::Login, Column::Email, Column::Name];
        if !identifies.iter().any(|column| columns.contains(&Some(*column))) {
            let message = "no column identifies students\n  help: name the columns in the first line, such as \
                           name,id,email,section";
            return Err(self.wrong(1, message));
        }
        Ok(columns)
    }

    fn student(
        &self,
        columns: &[Option<Column>],
        record: &StringRecord,
    ) -> Result<Student, SheetError> {
        let line = sheet::line(record);
        let time = |cell: &str| match cell {
            "" => Ok(None),
            cell => cell.parse().map(Some).map_err(|error| self.wrong(line, format!("{error}"))),
        };
        let mut student = Student { line, ..Student::default() };
        let (mut name, mut last_name) = ("", "");
        for (column, cell) in columns.iter().zip(record) {
            match column {
                Some(Column::Name | Column::FirstName) => name = cell,
                Some(Column::LastName) => last_name = cell,
                Some(Column::Id) => student.id = unmarked(cell).into(),
                Some(Column::CanvasId) => student.canvas_id = cell.into(),
                Some(Column::Login) => student.login = unmarked(cell).into(),
                Some(Column::Email) => student.email = cell.into(),
                Some(Column::Section) => student.section = cell.into(),
                Some(Column::Folder) => student.folder = cell.into(),
                Some(Column::Submitted) => student.submitted = time(cell)?,
                Some(Column::Due) => student.due = time(cell)?,
                None => {}
            }
        }
        student.name = format!("{name} {last_name}").trim().into();
        Ok(student)
    }

    fn refuse_duplicates(&self) -> Result<(), SheetError> {
        type Fact = fn(&Student) -> &Untrusted;
        let facts: [(&str, Fact); 4] = [
            ("ID", |student| &student.id),
            ("Canvas ID", |student| &student.canvas_id),
            ("login", |student| &student.login),
            ("email address", |student| &student.email),
        ];
        for (fact, of) in facts {
            let mut seen: HashMap<String, u64> = HashMap::new();
            for student in self.students.iter().filter(|student| !of(student).is_empty()) {
                if let Some(line) =
                    seen.insert(normalised(of(student).raw(RawUse::Comparison)), student.line)
                {
                    let message = format!(
                        "the {fact} {:?} is that of line {line} too\n  help: correct one of the lines",
                        of(student)
                    );
                    return Err(self.wrong(student.line, message));
                }
            }
        }
        Ok(())
    }

    /// Finds the submission of each student among these names.
    pub fn find_submissions(&self, names: &[&str]) -> Matching {
        let named = |student: &Student| {
            let folder = student.folder.raw(RawUse::Comparison);
            names.iter().position(|name| *name == folder)
        };
        let mut submissions: Vec<Option<usize>> = self.students.iter().map(named).collect();
        let (mut unknown, mut ambiguous) = (Vec::new(), Vec::new());
        // Students whom the column `folder` does not decide.
        let open: Vec<(usize, Vec<String>)> = self
            .students
            .iter()
            .enumerate()
            .filter(|(_, student)| student.folder.is_empty())
            .map(|(place, student)| (place, student.keys()))
            .collect();
        let taken: Vec<usize> = submissions.iter().flatten().copied().collect();
        // The submissions that fit each student, and no other one.
        let mut own: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (submission, name) in names.iter().enumerate() {
            if taken.contains(&submission) {
                continue;
            }
            let steps = [whole_names(name), parts(name)];
            let fitting = steps.iter().find_map(|texts| {
                let fits = |keys: &[String]| keys.iter().any(|key| texts.contains(key));
                let fitting = open.iter().filter(|(_, keys)| fits(keys));
                let fitting: Vec<usize> = fitting.map(|(place, _)| *place).collect();
                (!fitting.is_empty()).then_some(fitting)
            });
            match fitting.as_deref() {
                None | Some([]) => unknown.push(submission),
                Some([place]) => own.entry(*place).or_default().push(submission),
                Some(several) => ambiguous
                    .push(Ambiguity { students: several.to_vec(), submissions: vec![submission] }),
            }
        }
        for (place, found) in own {
            match found.as_slice() {
                [submission] => submissions[place] = Some(*submission),
                _ => ambiguous.push(Ambiguity { students: vec![place], submissions: found }),
            }
        }
        Matching { submissions, unknown, ambiguous }
    }

    /// The submission, among these names, of the one student whom a text identifies.
    pub fn submission_of<'a>(&self, text: &str, names: &[&'a str]) -> Option<&'a str> {
        let key = normalised(text);
        let mut fitting =
            self.students.iter().enumerate().filter(|(_, student)| student.keys().contains(&key));
        let (place, _) = fitting.next().filter(|_| !key.is_empty())?;
        let is_only_one = fitting.next().is_none();
        let submission = self.find_submissions(names).submissions[place];
        submission.filter(|_| is_only_one).map(|submission| names[submission])
    }

    /// Description of an ambiguity, with its remedy.
    pub fn explain(
        &self,
        Ambiguity { students, submissions }: &Ambiguity,
        names: &[&str],
    ) -> String {
        let students = students.iter().map(|place| {
            let student = &self.students[*place];
            format!("{} (line {})", student.shown(), student.line)
        });
        let students: Vec<String> = students.collect();
        let submissions = submissions.iter().map(|place| printed::text(names[*place]));
        let submissions: Vec<String> = submissions.collect();
        match students.as_slice() {
            [student] => format!(
                "two submissions: {student}: {}; none of them counts until the column folder names one",
                submissions.join(", ")
            ),
            _ => format!(
                "whose is it: {} fits {}; it counts for nobody until the column folder of one of them names it",
                submissions.join(", "),
                students.join(", ")
            ),
        }
    }

    /// An error in this line.
    pub fn wrong(&self, line: u64, message: impl Into<String>) -> SheetError {
        sheet::wrong(&self.path, line, message)
    }
}

/// An ID or a login without the `#` by which Brightspace keeps spreadsheets from changing it.
fn unmarked(cell: &str) -> &str {
    cell.strip_prefix('#').unwrap_or(cell)
}

/// Lower case, with single spaces.
fn normalised(text: &str) -> String {
    text.to_lowercase().split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A submission's name, as it is and with spaces in the place of underscores.
fn whole_names(name: &str) -> Vec<String> {
    vec![normalised(name), normalised(&name.replace('_', " "))]
}

/// The parts of a submission's name between underscores, with and without the extension.
fn parts(name: &str) -> Vec<String> {
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    name.split('_').chain(stem.split('_')).chain([stem]).map(normalised).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Roster, String> {
        let path = Path::new("roster.csv");
        let roster = Sheet::parse(text, path).and_then(|sheet| Roster::of_sheet(&sheet, path));
        roster.map_err(|error| error.to_string())
    }

    fn find(roster: &str, names: &[&str]) -> Result<Matching, String> {
        Ok(parse(roster)?.find_submissions(names))
    }

    #[test]
    fn columns_are_found_by_name_in_any_order_and_with_any_separator() {
        for text in [
            "name,id,login,email,section\nAda,7,ada,ada@x.edu,1\n",
            "\u{feff}Section;Email;Login;ID;Name\r\n1;ada@x.edu;ada;7;Ada\r\n",
            "First name\tSurname\tID number\tEmail address\tUsername\tSection\nAda\t\t7\tada@x.edu\tada\t1\n",
        ] {
            let student = &parse(text).unwrap().students[0];
            let facts = [&student.name, &student.id, &student.login, &student.email];
            let facts = facts.map(Untrusted::text);
            assert_eq!(facts, ["Ada", "7", "ada", "ada@x.edu"], "{text}");
            assert_eq!((student.section.text(), student.canvas_id.text()), ("1".into(), "".into()));
        }
        let student = &parse("name,id\n\"\u{1b}[2JEve\nAda\",1\n").unwrap().students[0];
        assert_eq!(student.shown(), "\u{fffd}[2JEve\u{fffd}Ada");
        // An export of Canvas has rows about the assignments.
        let canvas = "Student,ID,SIS User ID,SIS Login ID,Section,Lab (9)\n,,,,,Manual Posting\n    Points Possible,,,,,10\n\"Lovelace, Ada\",11,7,ada,1,\n";
        let roster = parse(canvas).unwrap();
        assert_eq!(roster.students.len(), 1);
        let Student { line, name, canvas_id, id, login, .. } = &roster.students[0];
        let facts = [name, canvas_id, id, login].map(Untrusted::text);
        assert_eq!(
            (*line, facts.each_ref()),
            (4, ["Lovelace, Ada", "11", "7", "ada"].map(str::to_owned).each_ref())
        );
        // Canvas may split names.
        let split = "LastName,FirstName,ID,SIS User ID,SIS Login ID,Section,Lab (9)\n    Points Possible,,,,,,10\nLovelace,Ada,11,7,ada,1,\n";
        let roster = parse(split).unwrap();
        let Student { name, canvas_id, id, login, .. } = &roster.students[0];
        assert_eq!(roster.students.len(), 1);
        assert_eq!(
            [name, canvas_id, id, login].map(Untrusted::text),
            ["Ada Lovelace", "11", "7", "ada"]
        );
        // Brightspace marks IDs and logins.
        let roster = parse("OrgDefinedId,Username,End-of-Line Indicator\n#7,#ada,#\n").unwrap();
        let Student { id, login, .. } = &roster.students[0];
        assert_eq!([id, login].map(Untrusted::text), ["7", "ada"]);
    }

    #[test]
    fn an_invalid_line_is_named() {
        for (text, message) in [
            ("", "roster.csv:1: no column identifies students"),
            ("points\n1\n", "roster.csv:1: no column identifies students"),
            ("id,name,ID\n", "roster.csv:1: the columns \"id\" and \"ID\" mean the same"),
            ("id,name\n1,Ada\n1,Bob\n", "roster.csv:3: the ID \"1\" is that of line 2 too"),
            ("email\nA@x.edu\na@x.edu\n", "roster.csv:3: the email address"),
            ("id,name\n1,Lovelace, Ada\n", "roster.csv:2: 3 cells, but the first line has 2"),
            ("id,section\n,1\n", "roster.csv:2: nothing identifies the student"),
            ("id,submitted\n1,2026-02-01 10:00\n", "roster.csv:2: \"2026-02-01 10:00\" is no time"),
        ] {
            let error = parse(text).unwrap_err();
            assert!(error.starts_with(message), "{error}");
        }
    }

    #[test]
    fn submissions_match_platform_names() {
        let roster = "name,id,canvas id,login,email,folder\n\
                      \"Lovelace, Ada\",,,,,\nBob B,42,,,,\nCleo,,4711,,,\nDot,,,dot9,,\nEve,,,,eve.e@x.edu,\n\
                      Fay,,,,,team 1\nGus,,,,,team 1\nHal,,,,hal@x.edu,nowhere\n";
        let names = [
            "ADA  lovelace_123_assignsubmission_file_",
            "42",
            "cleo_4711_99_simulator",
            "dot9_t1m3.sh",
            "eve.e",
            "team 1",
            "hal",
            "zoe",
        ];
        let found = find(roster, &names).unwrap();
        let whose = [Some(0), Some(1), Some(2), Some(3), Some(4), Some(5), Some(5), None];
        assert_eq!((found.submissions, found.unknown), (whose.to_vec(), vec![6, 7]));
        assert!(found.ambiguous.is_empty());
        // A whole name outweighs a part, whichever comes first.
        let found = find("login,section\nada_b,1\nada,2\n", &["ada", "ada_b"]).unwrap();
        assert_eq!(found.submissions, [Some(1), Some(0)]);
    }

    #[test]
    fn ambiguous_submission_needs_the_folder_column() {
        let told = |text: &str, names: &[&str]| {
            let roster = parse(text).unwrap();
            let found = roster.find_submissions(names);
            let told = found.ambiguous.iter().map(|found| roster.explain(found, names));
            (found.submissions, told.collect::<Vec<_>>())
        };
        let roster = "name,id\nAda,1\nBob,2\n";
        let (whose, remarks) = told(roster, &["ada_2", "bob"]);
        assert_eq!(whose, [None, Some(1)]);
        assert!(remarks[0].starts_with("whose is it: ada_2 fits Ada (line 2), Bob (line 3);"));
        // The whole name of an upload outweighs no other upload.
        let (whose, remarks) = told(roster, &["ada_old", "1", "bob"]);
        assert_eq!(whose, [None, Some(2)]);
        assert!(
            remarks[0].starts_with("two submissions: Ada (line 2): ada_old, 1;"),
            "{remarks:?}"
        );
        let found = find("login,folder\nada,ada\n", &["ada", "ada_old"]).unwrap();
        assert_eq!((found.submissions, found.unknown), (vec![Some(0)], vec![1]));
    }
}
