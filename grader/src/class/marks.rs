//! The judges' marks of creative scenes: the sheets that `grade gallery` writes, filled in, one for each judge.
//!
//! ```text
//! scene,assignment,failed checks,ingredients,aesthetics,originality,judge,remarks
//! ada/Creative/ada_t1m2.xml,t1m2,,7,8.5,9,,
//! ```
//!
//! A scene belongs to the submission that its path begins with; the cell may also be the submission's name. The scenes
//! of a gallery without names are numbered, and its key says which file is whose. A row counts if it has a mark for
//! every criterion. An empty cell is no mark, which is not zero.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

use super::sheet::{self, Sheet, SheetError};
use crate::boundary::printed::{self, RawUse, Untrusted, inert};
use crate::rubric::creative::{CRITERIA, CreativeRule};

/// The marks of a class.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Marks {
    /// The complete marks of each submission that has any, one for each sheet, in their order.
    pub of: BTreeMap<String, Vec<[f64; CRITERIA.len()]>>,
    /// Missing marks, a line each.
    pub remarks: Vec<String>,
}

/// Names against which marks are checked.
#[derive(Debug, Clone, Copy)]
pub struct MarksRules<'a> {
    /// The names of the submissions.
    pub submissions: &'a [&'a str],
    /// Their folder: paths in a key begin with it.
    pub folder: &'a Path,
    /// The assignment of the class, if it has one.
    pub assignment: Option<&'a str>,
    /// The rubric's.
    pub rule: CreativeRule,
}

/// The scenes of a gallery without names: the file of each.
type Key = BTreeMap<String, String>;

impl Marks {
    /// Reads sheets, and the key of their gallery if it hides names.
    ///
    /// # Errors
    /// If a sheet cannot be read; if a mark is not a number from 0 to the maximum; or if a row is of no submission, of
    /// another assignment, or the second one of a submission.
    pub fn load(
        sheets: &[PathBuf],
        key: Option<&Path>,
        rules: MarksRules<'_>,
    ) -> Result<Self, SheetError> {
        let key = key.map(|path| read_key(&Sheet::load(path)?)).transpose()?;
        let sheets = sheets.iter().map(|path| Sheet::load(path)).collect::<Result<Vec<_>, _>>()?;
        Self::of_sheets(&sheets, key.as_ref(), rules)
    }

    /// Parses a sheet, and the key of its gallery.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn parse(
        sheet: &Untrusted,
        key: Option<&Untrusted>,
        rules: MarksRules<'_>,
    ) -> Result<Self, SheetError> {
        let parse =
            |text: &Untrusted, name| Sheet::parse(text.raw(RawUse::Parsing), Path::new(name));
        let key = key.map(|key| read_key(&parse(key, "key.csv")?)).transpose()?;
        Self::of_sheets(&[parse(sheet, "marks.csv")?], key.as_ref(), rules)
    }

    fn of_sheets(
        sheets: &[Sheet],
        key: Option<&Key>,
        rules: MarksRules<'_>,
    ) -> Result<Self, SheetError> {
        let mut marks = Self::default();
        for sheet in sheets {
            marks.add(sheet, key, rules)?;
        }
        for name in rules.submissions.iter().filter(|name| !marks.of.contains_key(**name)) {
            marks.remarks.push(format!("no mark: {}", printed::text(name)));
        }
        Ok(marks)
    }

    fn add(
        &mut self,
        sheet: &Sheet,
        key: Option<&Key>,
        rules: MarksRules<'_>,
    ) -> Result<(), SheetError> {
        let column = |name: &str| {
            let place = sheet.header.iter().position(|cell| cell.eq_ignore_ascii_case(name));
            place.ok_or_else(|| {
                let message = format!(
                    "there is no column {name}\n  help: fill in the marks.csv that `grade gallery` writes"
                );
                sheet.wrong(1, message)
            })
        };
        let scene = column("scene")?;
        let mut criteria = [0; CRITERIA.len()];
        for (place, criterion) in criteria.iter_mut().zip(CRITERIA) {
            *place = column(criterion.column)?;
        }
        let assignment = column("assignment").ok();
        // The lines of the scenes, and those of the submissions with marks.
        let (mut scenes, mut marked) = (BTreeMap::new(), BTreeMap::new());
        for record in &sheet.records {
            let line = sheet::line(record);
            let cell = &record[scene];
            let shown = printed::line(cell);
            if let Some(earlier) = scenes.insert(cell, line) {
                let message =
                    format!("{shown:?} is in line {earlier} too\n  help: remove one of the lines");
                return Err(sheet.wrong(line, message));
            }
            let submission =
                find(cell, key, rules).map_err(|message| sheet.wrong(line, message))?;
            let mut row = [None; CRITERIA.len()];
            for (mark, (criterion, place)) in row.iter_mut().zip(CRITERIA.iter().zip(criteria)) {
                *mark = rules.rule.mark(&record[place]).map_err(|message| {
                    sheet.wrong(line, format!("{shown}: {}: {message}", criterion.column))
                })?;
            }
            if row.iter().all(Option::is_none) {
                continue;
            }
            let own = assignment.map_or("", |place| &record[place]);
            if let Some(of_class) = rules.assignment.filter(|name| !own.is_empty() && own != *name)
            {
                let message = format!(
                    "{shown} is a scene for {:?}, but the class is graded as {of_class}\n  help: remove the line",
                    printed::line(own)
                );
                return Err(sheet.wrong(line, message));
            }
            if let Some(earlier) = marked.insert(submission, line) {
                let message = format!(
                    "{} has marks in line {earlier} already\n  help: a submission has one creative scene: leave the \
                     marks of the others empty; a second judge fills in a sheet of their own: --marks ONE --marks OTHER",
                    printed::line(submission)
                );
                return Err(sheet.wrong(line, message));
            }
            let missing: Vec<&str> = CRITERIA
                .iter()
                .zip(row)
                .filter_map(|(criterion, mark)| mark.is_none().then_some(criterion.column))
                .collect();
            if missing.is_empty() {
                let row = row.map(Option::unwrap_or_default);
                self.of.entry(submission.to_owned()).or_default().push(row);
            } else {
                let message =
                    format!("incomplete, and does not count: no mark for {}", missing.join(", "));
                self.remarks.push(sheet.wrong(line, message).to_string());
            }
        }
        Ok(())
    }
}

/// The submission of a scene.
fn find<'a>(cell: &str, key: Option<&Key>, rules: MarksRules<'a>) -> Result<&'a str, String> {
    let MarksRules { submissions, folder, .. } = rules;
    let file = key.map(|key| {
        let file = key.get(cell);
        file.ok_or_else(|| format!("the key has no scene {:?}", printed::line(cell)))
    });
    let file = file.transpose()?;
    let path = match file {
        Some(file) => below(file, folder).unwrap_or_else(|| file.clone()),
        None => cell.to_owned(),
    };
    let begins_with = |name: &str| {
        let rest = path.strip_prefix(name);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
    };
    // As the gallery writes it for spreadsheets, or as it is: another submission may have that very name.
    let mut names = submissions.iter();
    let found = names.clone().find(|name| begins_with(&inert(name)));
    let found = found.or_else(|| names.find(|name| begins_with(name)));
    found.copied().ok_or_else(|| {
        let numbered = match key {
            None if cell.starts_with("Scene ") => "; if the gallery hides names, name its key with --key",
            _ => "",
        };
        format!(
            "{:?} is in no submission of {}\n  help: run `grade gallery` on this folder, or write the submission's \
             name{numbered}",
            printed::line(&path),
            folder.display()
        )
    })
}

/// The path of a file below a folder.
fn below(file: &str, folder: &Path) -> Option<String> {
    let plain = |path: &Path| {
        let path = std::path::absolute(path).ok()?;
        Some(path.components().filter(|part| *part != Component::CurDir).collect::<PathBuf>())
    };
    let rest = plain(Path::new(file))?.strip_prefix(plain(folder)?).ok()?.to_path_buf();
    rest.into_os_string().into_string().ok()
}

/// Reads which scene is whose.
fn read_key(sheet: &Sheet) -> Result<Key, SheetError> {
    if sheet.header.iter().ne(["scene", "file"]) {
        let message = "the columns are not scene,file\n  help: name the file that `grade gallery --hide-names` wrote";
        return Err(sheet.wrong(1, message));
    }
    let mut key = Key::new();
    for record in &sheet.records {
        if key.insert(record[0].to_owned(), record[1].to_owned()).is_some() {
            let message = format!("{:?} is there twice", printed::line(&record[0]));
            return Err(sheet.wrong(sheet::line(record), message));
        }
    }
    Ok(key)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str =
        "scene,assignment,failed checks,ingredients,aesthetics,originality,judge,remarks\n";

    fn read(sheets: &[&str], key: Option<&str>) -> Result<Marks, String> {
        let parse = |text: &str, name: &str| Sheet::parse(text, Path::new(name));
        let rules = MarksRules {
            submissions: &["ada", "ada b", "=bob"],
            folder: Path::new("hand-ins"),
            assignment: Some("t1m2"),
            rule: CreativeRule::default(),
        };
        let marks = || {
            let key = key.map(|text| read_key(&parse(text, "key.csv")?)).transpose()?;
            let sheets = sheets.iter().map(|text| parse(&format!("{HEAD}{text}"), "marks.csv"));
            Marks::of_sheets(&sheets.collect::<Result<Vec<_>, _>>()?, key.as_ref(), rules)
        };
        marks().map_err(|error: SheetError| error.to_string())
    }

    #[test]
    fn marks_belong_to_the_submission_of_their_scene() {
        let marks = read(
            &[
                "ada/Creative/ada_t1m2.xml,t1m2,film,7,8.5,9,,\nada b,,,0,0,10,,\n",
                "ada,t1m2,,1,2,3,Judge 2,fine\n'=bob/x.xml,t1m2,,1,,,,\nada/other.xml,t1m1,,,,,,\n",
            ],
            None,
        );
        let marks = marks.unwrap();
        let ada = vec![[7.0, 8.5, 9.0], [1.0, 2.0, 3.0]];
        let of = [("ada", ada), ("ada b", vec![[0.0, 0.0, 10.0]])];
        assert_eq!(marks.of, of.map(|(name, marks)| (name.to_owned(), marks)).into());
        // Missing marks are not zero.
        assert_eq!(
            marks.remarks,
            [
                "marks.csv:3: incomplete, and does not count: no mark for aesthetics, originality",
                "no mark: =bob"
            ]
        );
    }

    #[test]
    fn key_maps_numbered_scenes_to_submissions() {
        let key = "scene,file\nScene 1,hand-ins/ada b/Creative/x_t1m2.xml\nScene 2,./hand-ins/=bob/y.xml\n";
        let rows = "Scene 1,t1m2,,1,2,3,,\nScene 2,t1m2,,4,5,6,,\n";
        let marks = read(&[rows], Some(key)).unwrap();
        assert_eq!(marks.of.keys().collect::<Vec<_>>(), ["=bob", "ada b"]);
        let error = read(&[rows], None).unwrap_err();
        assert!(
            error.starts_with("marks.csv:2: \"Scene 1\" is in no submission of hand-ins"),
            "{error}"
        );
        assert!(error.ends_with("name its key with --key"), "{error}");
        let error = read(&["Scene 3,t1m2,,1,2,3,,\n"], Some(key)).unwrap_err();
        assert_eq!(error, "marks.csv:2: the key has no scene \"Scene 3\"");
    }

    #[test]
    fn an_invalid_row_is_named_by_its_line() {
        for (rows, message) in [
            ("ada,,,good,1,1,,\n", "marks.csv:2: ada: ingredients: \"good\" is no number"),
            ("ada,,,1,NaN,1,,\n", "marks.csv:2: ada: aesthetics: \"NaN\" is no number"),
            ("ada,,,1,1,-1,,\n", "marks.csv:2: ada: originality: marks are from 0 to 10, not -1"),
            (
                "ada b,,,,,,,\nada,,,10.5,1,1,,\n",
                "marks.csv:3: ada: ingredients: marks are from 0 to 10",
            ),
            ("eve,,,1,1,1,,\n", "marks.csv:2: \"eve\" is in no submission of hand-ins"),
            (
                "ada/a.xml,,,1,1,1,,\nada/b.xml,,,1,1,1,,\n",
                "marks.csv:3: ada has marks in line 2 already",
            ),
            ("ada,,,1,1,1,,\nada,,,,,,,\n", "marks.csv:3: \"ada\" is in line 2 too"),
            (
                "ada,t1m1,,1,1,1,,\n",
                "marks.csv:2: ada is a scene for \"t1m1\", but the class is graded as t1m2",
            ),
            ("ada,,,\"7,5\",1,1,,\n", "marks.csv:2: ada: ingredients: \"7,5\" is no number"),
            ("ada,,,1,1\n", "marks.csv:2: 5 cells, but the first line has 8"),
        ] {
            let error = read(&[rows], None).unwrap_err();
            assert!(error.starts_with(message), "{rows}: {error}");
        }
        let sheet = Sheet::parse("scene,originality\n", Path::new("marks.csv")).unwrap();
        let rules = MarksRules {
            submissions: &[],
            folder: Path::new(""),
            assignment: None,
            rule: CreativeRule::default(),
        };
        let error = Marks::of_sheets(&[sheet], None, rules).unwrap_err().to_string();
        assert!(error.starts_with("marks.csv:1: there is no column ingredients"), "{error}");
    }
}
