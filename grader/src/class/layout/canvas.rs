//! Canvas's download of all submissions: `lastfirst_LATE_USER_FILE_name.ext`, a file each.
//!
//! `USER` and `FILE` are Canvas's numbers. A text or a link that was typed in is `lastfirst_USER_text.html` or
//! `…_link.html`. With anonymous grading, `anon_CODE` stands for the name and the user. A file whose name was uploaded before
//! has `-1`, `-2`, … at the end of its stem: the name is as the student gave it, and the newest file of it counts.

use std::collections::BTreeMap;

use super::arrange::{Person, file_name};
use super::{ClassFolder, FolderEntry, HandInParts, Part, Reading};
use crate::submission::received::is_left_behind;

/// A name, taken apart.
struct CanvasName<'a> {
    student: String,
    user: &'a str,
    is_late: bool,
    /// Number of the file; later ones are larger.
    number: u64,
    file: String,
}

pub(super) fn read(folder: &ClassFolder) -> Reading {
    let mut students: BTreeMap<(String, &str), Vec<(CanvasName<'_>, &FolderEntry)>> =
        BTreeMap::new();
    let mut rest = Vec::new();
    for entry in &folder.entries {
        match parse(&entry.name).filter(|_| !entry.is_folder) {
            Some(name) => {
                let files = students.entry((name.student.clone(), name.user)).or_default();
                files.push((name, entry));
            }
            None => rest.push(entry.passed_over("its name is not one of Canvas")),
        }
    }
    let hand_in =
        |((student, user), files): ((String, &str), Vec<(CanvasName<'_>, &FolderEntry)>)| {
            let is_late = files.iter().any(|(name, _)| name.is_late);
            let mut found = HandInParts::new(&format!("{student}_{user}"), parts(&files));
            found.facts.late = is_late;
            found.facts.people =
                vec![Person { name: student, canvas_id: user.to_owned(), ..Person::default() }];
            found
        };
    Reading { hand_ins: students.into_iter().map(hand_in).collect(), rest }
}

fn parse(name: &str) -> Option<CanvasName<'_>> {
    let words: Vec<&str> = name.split('_').collect();
    let is_number =
        |word: &&str| !word.is_empty() && word.bytes().all(|byte| byte.is_ascii_digit());
    let is_anonymous = words[0] == "anon" && words.len() > 2;
    // Names have no number between underscores.
    let first = if is_anonymous { 2 } else { 1 };
    let place = words.iter().skip(first).position(is_number)? + first;
    let (before, user, rest) = match is_anonymous {
        true => (&words[..1], words[1], &words[place..]),
        false => (&words[..place], words[place], &words[place + 1..]),
    };
    let is_late = words[..place].contains(&"LATE");
    let student: Vec<&str> = before.iter().copied().filter(|word| *word != "LATE").collect();
    let (number, file) = match rest {
        [number, file @ ..] if is_number(number) && !file.is_empty() => {
            (number.parse().ok()?, file.join("_"))
        }
        [typed @ ("text.html" | "link.html")] => (0, (*typed).to_owned()),
        _ => return None,
    };
    Some(CanvasName { student: student.join("_"), user, is_late, number, file })
}

/// The files of a student, each by the name that it was given.
fn parts(files: &[(CanvasName<'_>, &FolderEntry)]) -> Vec<Part> {
    let mut named: BTreeMap<String, Vec<&(CanvasName<'_>, &FolderEntry)>> = BTreeMap::new();
    for file in files {
        named.entry(original(&file.0.file).to_owned()).or_default().push(file);
    }
    let mut parts = Vec::new();
    for (original, mut uploads) in named {
        uploads.sort_by_key(|(name, _)| name.number);
        // Several with a number and none without: the student numbered them.
        let is_first = |(name, _): &&(CanvasName<'_>, &FolderEntry)| name.file == original;
        let is_numbered = uploads.len() > 1 && !uploads.iter().any(is_first);
        let newest = if is_numbered { 0 } else { uploads.len() - 1 };
        for (name, entry) in &uploads[newest..] {
            let to = file_name(if is_numbered { &name.file } else { &original });
            if !is_left_behind(to.as_bytes()) {
                parts.push(Part { from: entry.file_name.clone(), to });
            }
        }
    }
    parts
}

/// A name without the number of a repeated upload.
fn original(name: &str) -> String {
    let (stem, extension) = match name.rfind('.').filter(|place| *place > 0) {
        Some(place) => name.split_at(place),
        None => (name, ""),
    };
    let cut = stem.rsplit_once('-').filter(|(stem, number)| {
        !stem.is_empty()
            && (1..=2).contains(&number.len())
            && number.bytes().all(|byte| byte.is_ascii_digit())
    });
    format!("{}{extension}", cut.map_or(stem, |(stem, _)| stem))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_taken_apart_from_the_left() {
        let told = |name| {
            let name = parse(name)?;
            Some(format!(
                "{} {} {} {} {}",
                name.student, name.user, name.is_late, name.number, name.file
            ))
        };
        for (name, wanted) in [
            ("lovelaceada_12_345_sim.zip", "lovelaceada 12 false 345 sim.zip"),
            ("lovelaceada_LATE_12_345_sim.zip", "lovelaceada 12 true 345 sim.zip"),
            // The student chooses the name after the numbers.
            ("bob_1_2_LATE_3_4_x.py", "bob 1 false 2 LATE_3_4_x.py"),
            ("bob_1_text.html", "bob 1 false 0 text.html"),
            ("bob_LATE_1_link.html", "bob 1 true 0 link.html"),
            ("anon_a1b2c_345_sim.py", "anon a1b2c false 345 sim.py"),
            ("anon_12345_LATE_345_sim.py", "anon 12345 true 345 sim.py"),
        ] {
            assert_eq!(told(name).as_deref(), Some(wanted), "{name}");
        }
        for name in ["ada", "12_345_sim.py", "ada_12_sim.py", "ada_1_2", "ada_1_2_", "my_sim_v2.py"]
        {
            assert_eq!(told(name).filter(|told| !told.ends_with(' ')), None, "{name}");
        }
    }

    #[test]
    fn repeated_uploads_get_their_name_back() {
        for (name, wanted) in [
            ("sim-1.py", "sim.py"),
            ("sim-12.tar.gz", "sim-12.tar.gz"),
            ("sim.tar-1.gz", "sim.tar.gz"),
            ("t1-m3.zip", "t1-m3.zip"),
            ("Makefile-2", "Makefile"),
            ("-1.py", "-1.py"),
            ("lecture-2026.py", "lecture-2026.py"),
        ] {
            assert_eq!(original(name), wanted);
        }
    }
}
