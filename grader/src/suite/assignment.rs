//! Assignments: which scenes of the suite a course's assignment grades, and which of them it requires.
//!
//! An assignment is a file `NAME.toml` in the folder `assignments` next to the rubric:
//!
//! ```toml
//! title = "Springs and drag"
//! document = "the hand-out that asks for it"
//! formats = ["xml"]                     # of scene files: xml, json
//! dimensions = [2]
//! forces = ["springforce", "dragdamping"]
//! optional-forces = ["vortexforce"]     # a program may offer them too; no scene has them
//! integrators = ["explicit-euler"]      # as programs must be able to read them
//!
//! [[feature]]                           # scenes of the scope; a later entry overrides an earlier one
//! section = "required"                  # or "extra-credit", "unscored"; default: the section of the scene's folder
//! groups = ["Spring", "LinearDrag"]     # groups, integrators and forces are optional
//! integrators = ["explicit-euler"]
//! forces = ["springforce"]              # at least one of these
//! points = 2                            # of each feature; default: the rubric's
//! solver = "dense"                      # value of {solver} in a submission's command; default: "sparse"
//! ```
//!
//! A scene is in the *scope* if its format, its dimension, each of its forces and the spelling of its integrator are
//! listed; a list that is missing contains everything. A scene of the scope belongs to the assignment if an entry
//! selects it. Nothing lists single scenes, so a new scene belongs to as many assignments as it fits.

mod fit;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};

use scene::Dimension;
use scene::schema::StepEquation;
use scene::spelling::closest;
use serde::Deserialize;
use simulator::vocabulary;
use toml::Spanned;

use crate::boundary::own_file::{OwnFileError, Toml, line_and_column, read_text};
use crate::suite::{Case, Feature, Section, SolverName, Suite};

pub use fit::fitting;

/// Folder of the assignments, next to the rubric.
pub const FOLDER: &str = "assignments";

/// The assignment of every scene, which applies if none is named.
pub const ALL: &str = "all";

/// Maximum size of an assignment's file, in MiB.
const MAX_MEBIBYTES: u64 = 1;

/// Formats of scene files, by their extensions.
const FORMATS: [&str; 2] = ["xml", "json"];

/// A named part of the suite.
#[derive(Debug, Clone, PartialEq)]
pub struct Assignment {
    /// Its name: the file's, without extension.
    pub name: String,
    /// Its title.
    pub title: String,
    /// The document that describes it; `None` if there is none.
    pub document: Option<String>,
    path: PathBuf,
    scope: Scope,
    entries: Vec<Entry>,
    /// The points of features, as far as entries set them; empty before the suite is narrowed.
    points: Vec<(Feature, f64)>,
}

/// The scenes that an assignment may use.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scope {
    /// Formats of scene files, by their extensions; `None`: all.
    pub formats: Option<Vec<String>>,
    /// 2, 3 or both; `None`: both.
    pub dimensions: Option<Vec<usize>>,
    /// Tags of forces; `None`: all.
    pub forces: Option<Vec<String>>,
    /// Tags of forces that a program may offer although no scene of the assignment has them.
    pub optional_forces: Vec<String>,
    /// Spellings of integrators; `None`: all.
    pub integrators: Option<Vec<String>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct AssignmentFile {
    title: String,
    document: Option<String>,
    formats: Option<Vec<Spanned<String>>>,
    dimensions: Option<Vec<Spanned<usize>>>,
    forces: Option<Vec<Spanned<String>>>,
    #[serde(default)]
    optional_forces: Vec<Spanned<String>>,
    integrators: Option<Vec<Spanned<String>>>,
    feature: Vec<Spanned<EntryTable>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct EntryTable {
    section: Option<Section>,
    groups: Option<Vec<Spanned<String>>>,
    integrators: Option<Vec<Spanned<String>>>,
    forces: Option<Vec<Spanned<String>>>,
    points: Option<Spanned<f64>>,
    solver: Option<SolverName>,
}

/// One `[[feature]]`.
#[derive(Debug, Clone, PartialEq)]
struct Entry {
    line: usize,
    section: Option<Section>,
    groups: Option<Vec<Group>>,
    /// Primary names.
    integrators: Option<Vec<&'static str>>,
    forces: Option<Vec<String>>,
    points: Option<f64>,
    solver: Option<SolverName>,
}

/// The name of a group in an entry, and where it stands.
#[derive(Debug, Clone, PartialEq)]
struct Group {
    name: String,
    line: usize,
    column: usize,
}

/// An assignment that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum AssignmentError {
    /// The file or folder cannot be read, or is not valid.
    #[error(transparent)]
    File(#[from] OwnFileError),
    /// There is no assignment of this name.
    #[error("there is no assignment {name:?} in {}\n  help: {}", folder.display(), known_names(name, known))]
    Unknown {
        /// The name.
        name: String,
        /// The folder that was searched.
        folder: PathBuf,
        /// The names of the assignments there.
        known: Vec<String>,
    },
    /// An entry selects no scene.
    #[error("{}:{line}: [[feature]] selects no scene\n  help: correct its groups, integrators and forces; a scene must also be within the formats, dimensions, forces and integrators of the assignment", path.display())]
    NoMatch {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
    },
}

fn known_names(name: &str, known: &[String]) -> String {
    let names: Vec<&str> = known.iter().map(String::as_str).collect();
    match (closest(name, &names), known) {
        (_, []) => "add one as a file NAME.toml; docs/formats.md describes it".to_owned(),
        (Some(similar), _) => format!("did you mean {similar}? All are {}", known.join(", ")),
        (None, _) => format!("the assignments are {}", known.join(", ")),
    }
}

impl Assignment {
    /// Reads the assignment `name`, in upper or lower case, from a folder of assignments.
    ///
    /// # Errors
    /// If there is no such file, or it is not a valid assignment.
    pub fn load(folder: &Path, name: &str) -> Result<Self, AssignmentError> {
        let known = names(folder)?;
        // A name is no path: only files of the folder are read.
        let exact = known.iter().find(|known| *known == name);
        let Some(name) = exact.or(known.iter().find(|known| known.eq_ignore_ascii_case(name)))
        else {
            let (name, folder) = (name.to_owned(), folder.to_path_buf());
            return Err(AssignmentError::Unknown { name, folder, known });
        };
        let path = folder.join(format!("{name}.toml"));
        let text = read_text(&path, MAX_MEBIBYTES)
            .map_err(|source| OwnFileError::Unreadable { path: path.clone(), source })?;
        Self::parse(name, &text, &path)
    }

    /// All assignments of a folder, by name; none if the folder does not exist.
    ///
    /// # Errors
    /// If one cannot be read, or is not valid.
    pub fn list(folder: &Path) -> Result<Vec<Self>, AssignmentError> {
        names(folder)?.iter().map(|name| Self::load(folder, name)).collect()
    }

    /// Parses an assignment. `path` is the file's name in messages.
    ///
    /// # Errors
    /// If the text is not a valid assignment.
    pub fn parse(name: &str, text: &str, path: &Path) -> Result<Self, AssignmentError> {
        let toml = Toml { path, text };
        let invalid = |start, message| AssignmentError::File(toml.invalid(start, message));
        let file: AssignmentFile = toml.parse()?;
        let unknown = |word: &Spanned<String>, what: &str, known: Vec<&str>| {
            let message = format!(
                "unknown {what} {:?}\n  help: the {what}s are {}",
                word.as_ref(),
                known.join(", ")
            );
            invalid(word.span().start, message)
        };
        let vocabulary = vocabulary();
        let forces = |words: Vec<Spanned<String>>| {
            for word in &words {
                if vocabulary.force(word.as_ref()).is_none() {
                    let tags = vocabulary.forces.iter().map(|force| force.tag).collect();
                    return Err(unknown(word, "force", tags));
                }
            }
            Ok(words.into_iter().map(Spanned::into_inner).collect::<Vec<_>>())
        };
        let integrator = |word: &Spanned<String>| {
            let found = vocabulary.integrator(word.as_ref()).map(|schema| schema.name);
            let names = || vocabulary.integrators.iter().map(|schema| schema.name).collect();
            found.ok_or_else(|| unknown(word, "integrator", names()))
        };
        for word in file.formats.iter().flatten() {
            if !FORMATS.contains(&word.as_ref().as_str()) {
                return Err(unknown(word, "format", FORMATS.to_vec()));
            }
        }
        for number in file.dimensions.iter().flatten() {
            if ![2, 3].contains(number.as_ref()) {
                let message = format!("a scene has 2 or 3 dimensions, not {}", number.as_ref());
                return Err(invalid(number.span().start, message));
            }
        }
        for word in file.integrators.iter().flatten() {
            integrator(word)?;
        }
        let plain = |words: Vec<Spanned<String>>| {
            words.into_iter().map(Spanned::into_inner).collect::<Vec<_>>()
        };
        let scope = Scope {
            formats: file.formats.map(plain),
            dimensions: file
                .dimensions
                .map(|numbers| numbers.into_iter().map(Spanned::into_inner).collect()),
            forces: file.forces.map(forces).transpose()?,
            optional_forces: forces(file.optional_forces)?,
            integrators: file.integrators.map(plain),
        };
        let entry = |table: Spanned<EntryTable>| {
            let (line, _) = line_and_column(text, table.span().start);
            let EntryTable { section, groups, integrators, forces: tags, points, solver } =
                table.into_inner();
            if let Some(points) = points.as_ref().filter(|points| !is_points(*points.as_ref())) {
                let message = format!("points are from 0 to {MOST:e}, not {}", points.as_ref());
                return Err(invalid(points.span().start, message));
            }
            let names = |words: Vec<Spanned<String>>| words.iter().map(integrator).collect();
            let group = |word: Spanned<String>| {
                let (line, column) = line_and_column(text, word.span().start);
                Group { name: word.into_inner(), line, column }
            };
            let groups = groups.map(|words| words.into_iter().map(group).collect());
            Ok(Entry {
                line,
                section,
                groups,
                integrators: integrators.map(names).transpose()?,
                forces: tags.map(forces).transpose()?,
                points: points.map(Spanned::into_inner),
                solver,
            })
        };
        Ok(Self {
            name: name.to_owned(),
            title: file.title,
            document: file.document,
            path: path.to_path_buf(),
            scope,
            entries: file.feature.into_iter().map(entry).collect::<Result<_, _>>()?,
            points: Vec::new(),
        })
    }

    /// The file that it was read from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The scenes that it may use.
    pub fn scope(&self) -> &Scope {
        &self.scope
    }

    /// The section of a scene; `None` if the scene does not belong to the assignment.
    pub fn section(&self, case: &Case) -> Option<Section> {
        self.place(case).map(|(section, _)| section)
    }

    /// The section and the solver of a scene; `None` if the scene does not belong to the assignment.
    pub(crate) fn place(&self, case: &Case) -> Option<(Section, SolverName)> {
        let selecting = || self.entries.iter().filter(|entry| entry.selects(case));
        if !self.scope.contains(case) || selecting().next().is_none() {
            return None;
        }
        let section = selecting().filter_map(|entry| entry.section).next_back();
        let solver = selecting().filter_map(|entry| entry.solver).next_back();
        Some((section.unwrap_or(case.feature.section), solver.unwrap_or_default()))
    }

    /// The points of a feature of the narrowed suite; `None` if they are the rubric's.
    pub fn points(&self, feature: &Feature) -> Option<f64> {
        if feature.section == Section::Unscored {
            return Some(0.0);
        }
        let set = self.points.iter().filter(|(known, _)| known == feature);
        set.map(|(_, points)| *points).next_back()
    }

    /// A warning about each group of its file that the suite does not have. It is no error, as a suite may be a part of the
    /// one that the file was written for.
    pub fn unknown_groups(&self, suite: &Suite) -> Vec<String> {
        let known: BTreeSet<&str> =
            suite.cases.iter().map(|case| case.feature.group.as_str()).collect();
        let known: Vec<&str> = known.into_iter().collect();
        let named = self.entries.iter().flat_map(|entry| entry.groups.iter().flatten());
        let unknown = named.filter(|group| !known.contains(&group.name.as_str()));
        let warning = |Group { name, line, column }: &Group| {
            let help = closest(name, &known).map(|near| format!("\n  help: did you mean {near}?"));
            let (path, help) = (self.path.display(), help.unwrap_or_default());
            format!("{path}:{line}:{column}: no scene is in the group {name:?}{help}")
        };
        unknown.map(warning).collect()
    }

    /// Keeps the scenes of the assignment, each in its section.
    ///
    /// # Errors
    /// If an entry selects no scene.
    pub fn narrow(&mut self, suite: &mut Suite) -> Result<(), AssignmentError> {
        let is_idle = |entry: &&Entry| {
            let selects = |case: &Case| self.scope.contains(case) && entry.selects(case);
            !suite.cases.iter().any(selects)
        };
        if let Some(entry) = self.entries.iter().find(is_idle) {
            return Err(AssignmentError::NoMatch { path: self.path.clone(), line: entry.line });
        }
        suite.reassign(|case| self.place(case));
        for entry in self.entries.iter().filter(|entry| entry.points.is_some()) {
            for case in suite.cases.iter().filter(|case| entry.selects(case)) {
                self.points.extend(entry.points.map(|points| (case.feature.clone(), points)));
            }
        }
        Ok(())
    }

    /// Whether the starter code contains an integrator: an entry without points names it.
    pub fn comes_with(&self, integrator: &str) -> bool {
        let names = |entry: &&Entry| {
            entry.integrators.as_ref().is_some_and(|names| names.contains(&integrator))
        };
        let section = Some(Section::Unscored);
        self.entries.iter().filter(names).any(|entry| entry.section == section)
    }

    /// Whether it is the one of every scene.
    pub fn is_all(&self) -> bool {
        self.name == ALL
    }
}

/// The names of the assignments in a folder, sorted.
fn names(folder: &Path) -> Result<Vec<String>, AssignmentError> {
    let unreadable = |source| OwnFileError::Unreadable { path: folder.to_path_buf(), source };
    let entries = match std::fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(unreadable(error).into()),
    };
    let mut names = Vec::new();
    for entry in entries {
        let path = entry.map_err(unreadable)?.path();
        if path.extension().is_some_and(|extension| extension == "toml") {
            names.extend(path.file_stem().and_then(|stem| stem.to_str()).map(str::to_owned));
        }
    }
    names.sort();
    Ok(names)
}

impl Scope {
    /// Whether a scene is in the scope.
    pub fn contains(&self, case: &Case) -> bool {
        let is_listed = |list: &Option<Vec<String>>, word: &str| {
            list.as_ref().is_none_or(|list| list.iter().any(|listed| listed == word))
        };
        let dimension = case.scene.dimension.count();
        let mut forces = case.scene.forces.iter();
        is_listed(&self.formats, case.format())
            && self.dimensions.as_ref().is_none_or(|listed| listed.contains(&dimension))
            && is_listed(&self.integrators, &case.integrator_spelling)
            && forces.all(|force| is_listed(&self.forces, force.schema.tag))
    }

    /// Whether programs of the assignment offer linearized implicit Euler, which reveals their Jacobians.
    pub fn has_jacobians(&self) -> bool {
        let vocabulary = vocabulary();
        let is_linearized = |spelling: &String| {
            let found = vocabulary.integrator(spelling);
            found.is_some_and(|schema| schema.equation == StepEquation::LinearizedImplicitEuler)
        };
        self.integrators.as_ref().is_none_or(|spellings| spellings.iter().any(is_linearized))
    }

    /// Whether programs of the assignment offer a force in a dimension.
    pub fn offers(&self, tag: &str, dimension: Dimension) -> bool {
        let has_force = |forces: &Vec<String>| forces.iter().any(|force| force == tag);
        let has_dimension = |listed: &Vec<usize>| listed.contains(&dimension.count());
        self.forces.as_ref().is_none_or(has_force)
            && self.dimensions.as_ref().is_none_or(has_dimension)
    }
}

impl Entry {
    fn selects(&self, case: &Case) -> bool {
        let has = |tags: &Vec<String>| {
            case.scene.forces.iter().any(|force| tags.iter().any(|tag| tag == force.schema.tag))
        };
        let Feature { group, integrator, .. } = &case.feature;
        self.groups.as_ref().is_none_or(|groups| groups.iter().any(|named| named.name == *group))
            && self.integrators.as_ref().is_none_or(|names| names.contains(integrator))
            && self.forces.as_ref().is_none_or(has)
    }
}

/// Maximum points of a feature.
const MOST: f64 = 1e9;

fn is_points(value: f64) -> bool {
    (0.0..=MOST).contains(&value)
}
