//! Which files of a hand-in a pack takes, and where they belong in the project.
//!
//! A pack names files by patterns relative to the project, such as `FOSSSim/*.cpp`. The hand-in may be the project, a folder
//! that holds it at any depth, or only the content of `FOSSSim/`. Every folder of the hand-in is tried as the place of the
//! project, and as the place of a folder that a pattern begins with. The one counts that has the most names of the starter
//! code, then the most files, then the least depth.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use crate::boundary::printed::{self, Untrusted};
use crate::suite::selection::is_like;

/// A path in which `*` is any text within a name, `?` any character, and `**` any number of folders.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Pattern(Vec<String>);

impl Pattern {
    /// Parses a pattern.
    ///
    /// # Errors
    /// A message, if it is not a relative path.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let parts: Vec<String> = text.split('/').map(str::to_owned).collect();
        if parts.iter().any(|part| ["", ".", ".."].contains(&part.as_str())) {
            return Err(format!(
                "{text:?} is not a path below the project\n  help: name files as in \"FOSSSim/*.cpp\""
            ));
        }
        Ok(Self(parts))
    }

    /// Whether a relative path matches.
    pub(crate) fn matches(&self, path: &Path) -> bool {
        let names: Vec<_> = path.iter().map(OsStr::to_string_lossy).collect();
        let names: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
        matches(&self.0, &names)
    }

    /// The pattern of the file's name.
    pub(crate) fn name(&self) -> &str {
        self.0.last().map_or("", |name| name)
    }

    /// The folders that it begins with, as far as they have no wildcard.
    fn folders(&self) -> &[String] {
        let folders = &self.0[..self.0.len() - 1];
        let literal = folders.iter().take_while(|part| !part.contains(['*', '?']));
        &folders[..literal.count()]
    }
}

fn matches(pattern: &[String], names: &[&str]) -> bool {
    match (pattern, names) {
        ([], []) => true,
        ([first, rest @ ..], _) if first == "**" => {
            (0..=names.len()).any(|skipped| matches(rest, &names[skipped..]))
        }
        ([first, rest @ ..], [name, names @ ..]) => is_like(name, first) && matches(rest, names),
        _ => false,
    }
}

/// The files that are taken.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Taken {
    /// The folder of the hand-in that they lie in.
    pub(crate) place: PathBuf,
    /// Each file, by its path in the project: its path in the hand-in.
    pub(crate) files: BTreeMap<PathBuf, PathBuf>,
}

impl Taken {
    /// The only file of a hand-in, for a pack that takes one file: it may have another name, such as the student's, with the
    /// same extension.
    pub(crate) fn only(file: &Path, pattern: &Pattern) -> Option<Self> {
        let target: PathBuf = pattern.0.iter().collect();
        let is_one = !target.to_string_lossy().contains(['*', '?']);
        (is_one && file.extension() == target.extension()).then(|| Self {
            place: PathBuf::new(),
            files: BTreeMap::from([(target, file.to_path_buf())]),
        })
    }

    /// The files of a hand-in that were taken, and those that were not, in words.
    pub(crate) fn words(&self, files: &[PathBuf]) -> Untrusted {
        let taken: BTreeSet<&PathBuf> = self.files.values().collect();
        let left: Vec<&PathBuf> = files.iter().filter(|file| !taken.contains(file)).collect();
        let taken = listed(&taken.into_iter().collect::<Vec<_>>());
        match left.as_slice() {
            [] => taken.into(),
            left => format!("{taken}; not {}", listed(left)).into(),
        }
    }
}

/// Paths for messages: all, or the first ones and how many follow.
fn listed(files: &[&PathBuf]) -> String {
    const SHOWN: usize = 5;
    let first = files.iter().take(SHOWN).map(|file| shown(file)).collect::<Vec<_>>().join(", ");
    match files.len().saturating_sub(SHOWN) {
        0 if files.is_empty() => "no file".to_owned(),
        0 => first,
        more => format!("{first} and {more} more"),
    }
}

/// Why nothing is taken.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum NotTaken {
    /// No file matches.
    #[error("nothing in it is {patterns}; it holds {found}\n  help: hand in the sources")]
    Nothing {
        /// The patterns.
        patterns: String,
        found: String,
    },
    /// Several places are equally good.
    #[error(
        "{one} and {other} both look like the hand-in, with the same files\n  help: hand in one of them"
    )]
    Ambiguous {
        /// One.
        one: String,
        /// Another.
        other: String,
    },
}

/// Chooses among the files of a hand-in. `known` are the paths that the starter code has.
///
/// # Errors
/// If no file matches, or if two places are equally good.
pub(crate) fn take(
    files: &[PathBuf],
    patterns: &[Pattern],
    known: &BTreeSet<PathBuf>,
) -> Result<Taken, NotTaken> {
    // A place: a folder of the hand-in, and the folders of patterns that it stands for.
    let mut places: BTreeMap<(PathBuf, PathBuf), BTreeMap<PathBuf, PathBuf>> = BTreeMap::new();
    let starts: BTreeSet<PathBuf> = patterns
        .iter()
        .flat_map(|pattern| {
            let folders = pattern.folders();
            (0..=folders.len()).map(|length| folders[..length].iter().collect())
        })
        .collect();
    for file in files {
        for start in &starts {
            for folder in file.ancestors().skip(1) {
                let Ok(below) = file.strip_prefix(folder) else { continue };
                let target = start.join(below);
                if patterns.iter().any(|pattern| pattern.matches(&target)) {
                    let place = (folder.to_path_buf(), start.clone());
                    places.entry(place).or_default().insert(target, file.clone());
                }
            }
        }
    }
    let merit = |((folder, start), taken): &(&(PathBuf, PathBuf), &BTreeMap<PathBuf, PathBuf>)| {
        let known = taken.keys().filter(|target| known.contains(*target)).count();
        let depth = folder.components().count();
        (known, taken.len(), std::cmp::Reverse((depth, start.components().count())))
    };
    let Some(best) = places.iter().max_by_key(merit) else {
        let names: Vec<&str> =
            patterns.iter().flat_map(|pattern| pattern.0.last()).map(String::as_str).collect();
        let found = listed(&files.iter().collect::<Vec<_>>());
        return Err(NotTaken::Nothing { patterns: names.join(", "), found });
    };
    let other = places.iter().find(|other| other.0 != best.0 && merit(other) == merit(&best));
    let ((place, _), taken) = best;
    if let Some(((other, _), _)) = other {
        return Err(NotTaken::Ambiguous { one: shown(place), other: shown(other) });
    }
    Ok(Taken { place: place.clone(), files: taken.clone() })
}

/// A path for messages.
fn shown(path: &Path) -> String {
    printed::path(path.as_os_str().as_encoded_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(names: &[&str]) -> Vec<PathBuf> {
        names.iter().map(PathBuf::from).collect()
    }

    fn taken(files: &[&str]) -> Result<(String, Vec<String>), NotTaken> {
        let patterns = ["FOSSSim/*.cpp", "FOSSSim/*.h", "FOSSSim/Bodies/*.cpp"];
        let patterns = patterns.map(|pattern| Pattern::parse(pattern).unwrap());
        let known =
            paths(&["FOSSSim/SpringForce.cpp", "FOSSSim/Drag.cpp", "FOSSSim/Bodies/Bend.cpp"]);
        let taken = take(&paths(files), &patterns, &known.into_iter().collect())?;
        let targets = taken.files.keys().map(|target| target.display().to_string());
        Ok((taken.place.display().to_string(), targets.collect()))
    }

    #[test]
    fn project_is_found_at_any_depth_and_without_its_folder() {
        let both = vec!["FOSSSim/Drag.cpp".to_owned(), "FOSSSim/SpringForce.cpp".to_owned()];
        for (files, place) in [
            (["FOSSSim/Drag.cpp", "FOSSSim/SpringForce.cpp"], ""),
            (["a/b/FOSSSim/Drag.cpp", "a/b/FOSSSim/SpringForce.cpp"], "a/b"),
            (["Drag.cpp", "SpringForce.cpp"], ""),
            (["My Work/Drag.cpp", "My Work/SpringForce.cpp"], "My Work"),
        ] {
            assert_eq!(taken(&files), Ok((place.to_owned(), both.clone())), "{files:?}");
        }
        let nested =
            ["t/FOSSSim/Drag.cpp", "t/FOSSSim/Bodies/Bend.cpp", "t/FOSSSim/build/main.cpp"];
        let found = vec!["FOSSSim/Bodies/Bend.cpp".to_owned(), "FOSSSim/Drag.cpp".to_owned()];
        assert_eq!(taken(&nested), Ok(("t".to_owned(), found)));
    }

    #[test]
    fn place_with_most_names_of_the_starter_code_counts_and_then_the_least_deep() {
        let place = |files: &[&str]| taken(files).map(|(place, _)| place);
        let milestones =
            ["t1m1/FOSSSim/Drag.cpp", "t1m3/FOSSSim/Drag.cpp", "t1m3/FOSSSim/SpringForce.cpp"];
        assert_eq!(place(&milestones), Ok("t1m3".to_owned()));
        assert_eq!(place(&["FOSSSim/Drag.cpp", "old/FOSSSim/Drag.cpp"]), Ok(String::new()));
        let twice = place(&["a/FOSSSim/Drag.cpp", "b/FOSSSim/Drag.cpp"]).unwrap_err().to_string();
        assert!(twice.contains("b and a") || twice.contains("a and b"), "{twice}");
    }

    #[test]
    fn hand_in_without_sources_is_named_as_such() {
        let error = taken(&["report.pdf", "notes.docx"]).unwrap_err().to_string();
        assert!(
            error.contains("*.cpp, *.h") && error.contains("report.pdf, notes.docx"),
            "{error}"
        );
        assert!(taken(&[]).unwrap_err().to_string().contains("no file"));
    }

    #[test]
    fn double_star_is_any_number_of_folders() {
        let matches =
            |pattern: &str, path: &str| Pattern::parse(pattern).unwrap().matches(Path::new(path));
        for path in ["a.h", "x/a.h", "x/y/a.h"] {
            assert!(matches("**/*.h", path) && matches("**", path), "{path}");
        }
        assert!(matches("include/**", "include/eigen/Eigen/Dense"));
        assert!(!matches("include/**", "src/a.h") && !matches("*.h", "x/a.h"));
        for pattern in ["/etc/*", "../*", "a//b", ""] {
            assert!(Pattern::parse(pattern).is_err(), "{pattern}");
        }
    }
}
