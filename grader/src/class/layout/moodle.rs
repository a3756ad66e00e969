//! Moodle's download of all submissions: `First Last_N_assignsubmission_file_`, a folder each, or a file with its own name at
//! the end. `…_assignsubmission_onlinetext_` is text that was typed in; it is the hand-in only of those without files. `N` is
//! Moodle's number of the participant, which no roster has; with blind marking, the name is `Participant`.

use std::collections::BTreeMap;

use super::arrange::{Person, file_name};
use super::{ClassFolder, HandInParts, Part, Reading};

/// Between the student and the kind of the submission.
const MARK: &str = "_assignsubmission_";

pub(super) fn read(folder: &ClassFolder) -> Reading {
    let mut students: BTreeMap<(&str, &str), [Vec<Part>; 2]> = BTreeMap::new();
    let mut rest = Vec::new();
    for entry in &folder.entries {
        let parsed = entry.name.split_once(MARK).and_then(|(student, kind)| {
            let (name, number) = student.rsplit_once('_')?;
            let (kind, file) = kind.split_once('_').unwrap_or((kind, ""));
            let is_number = !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
            let place = ["file", "onlinetext"].iter().position(|known| *known == kind)?;
            (is_number && (entry.is_folder || !file.is_empty()))
                .then_some((name, number, place, file))
        });
        match parsed {
            Some((name, number, place, file)) => {
                let to = if entry.is_folder { String::new() } else { file_name(file) };
                let part = Part { from: entry.file_name.clone(), to };
                students.entry((name, number)).or_default()[place].push(part);
            }
            None => rest.push(entry.passed_over("its name is not one of Moodle")),
        }
    }
    let hand_in = |((name, number), [files, texts]): ((&str, &str), [Vec<Part>; 2])| {
        let parts = if files.is_empty() { texts } else { files };
        let mut found = HandInParts::new(&format!("{name}_{number}"), parts);
        found.facts.people = vec![Person { name: name.to_owned(), ..Person::default() }];
        found
    };
    Reading { hand_ins: students.into_iter().map(hand_in).collect(), rest }
}
