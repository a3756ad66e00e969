//! The suite: all scenes that are graded.
//!
//! A scene's name is its path below the section's folder, without the extension: `Spring/two-springs`. The folders of
//! that path are its group, and a group under one integrator is a *feature*.

pub mod assignment;
pub mod selection;

use std::collections::HashMap;
use std::fmt;
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};

use rayon::prelude::*;
use scene::error::SceneError;
use scene::input;
use scene::json::is_json;
use scene::trace::TraceFormat;
use scene::{ParseOptions, Scene};
use serde::Deserialize;
use sha2::{Digest, Sha256};
use simulator::vocabulary;

use crate::boundary::seal::hexadecimal;

/// Whether a scene is required or earns extra credit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Section {
    /// Required.
    Required,
    /// Extra credit.
    ExtraCredit,
    /// Shown, without points and without effect on the outcome.
    Unscored,
}

impl Section {
    /// All, in the order of the reports.
    pub const ALL: [Self; 3] = [Self::Required, Self::ExtraCredit, Self::Unscored];

    /// The machine-readable name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Required => "required",
            Self::ExtraCredit => "extra-credit",
            Self::Unscored => "unscored",
        }
    }
}

/// A group of scenes under one integrator; or a function, without one.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Feature {
    /// Required or extra credit.
    pub section: Section,
    /// The scenes' folder, relative to the section's.
    pub group: String,
    /// The integrator's name.
    pub integrator: &'static str,
}

impl fmt::Display for Feature {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.integrator {
            "" => write!(f, "{}", self.group),
            integrator => write!(f, "{} / {integrator}", self.group),
        }
    }
}

/// One scene of the suite.
#[derive(Debug, Clone)]
pub struct Case {
    /// Its name: path below the section's folder, without extension, with `/` between folders.
    pub id: String,
    /// The feature that it tests.
    pub feature: Feature,
    /// The scene.
    pub scene: Scene,
    /// The integrator as the scene file spells it: its name or one of its aliases.
    pub integrator_spelling: String,
    /// The linear solver that a program with several is asked to use.
    pub solver: SolverName,
    /// The files of the scene: the scene file, and its mesh if it names one.
    pub files: Vec<SceneFile>,
    /// SHA-256 of the scene file followed by its mesh, if any, in hexadecimal.
    pub scene_hash: String,
}

/// A linear solver that an assignment may ask a program to use.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SolverName {
    /// With dense matrices.
    Dense,
    /// With sparse matrices.
    #[default]
    Sparse,
}

impl SolverName {
    /// Its name in commands.
    pub fn name(self) -> &'static str {
        match self {
            Self::Dense => "dense",
            Self::Sparse => "sparse",
        }
    }
}

impl Case {
    /// The format of its scene file: `json` or `xml`.
    pub fn format(&self) -> &'static str {
        let is_json = self.files.first().is_some_and(|file| is_json(&file.path));
        if is_json { "json" } else { "xml" }
    }

    /// The path of its scene file in reports: as given, or from the section's folder on, because students may read the report,
    /// and an absolute path tells about the machine.
    pub fn shown_path(&self) -> String {
        let path = Path::new(&self.scene.name);
        let kept = Path::new(&self.id).components().count() + 1;
        if path.is_absolute() {
            let parts: Vec<_> = path.components().collect();
            let shown: PathBuf = parts[parts.len().saturating_sub(kept)..].iter().collect();
            shown.display().to_string()
        } else {
            self.scene.name.clone()
        }
    }

    /// Whether its files still have the content that was read.
    pub fn is_current(&self) -> bool {
        let mut hasher = Sha256::new();
        let is_read = self
            .files
            .iter()
            .all(|file| input::open(&file.path).and_then(|file| feed(&mut hasher, file)).is_ok());
        is_read && hexadecimal(&hasher.finalize()) == self.scene_hash
    }
}

/// A file of a scene.
#[derive(Debug, Clone)]
pub struct SceneFile {
    /// Its path.
    pub path: PathBuf,
    /// Its path relative to the scene's folder; its file name if it lies elsewhere.
    pub name: PathBuf,
}

impl SceneFile {
    fn new(path: &Path, folder: &Path) -> Self {
        let below = path.strip_prefix(folder).ok();
        let below =
            below.filter(|name| name.components().all(|part| matches!(part, Component::Normal(_))));
        let name =
            below.map_or_else(|| path.file_name().unwrap_or_default().into(), Path::to_path_buf);
        Self { path: path.to_path_buf(), name }
    }
}

/// All graded scenes, sorted by section and name, and warnings about their files.
#[derive(Debug)]
pub struct Suite {
    /// The scenes.
    pub cases: Vec<Case>,
    /// The sections that have a folder.
    pub sections: Vec<Section>,
    /// Warnings about scene files.
    pub warnings: Vec<SceneError>,
}

/// A suite that cannot be graded.
#[derive(Debug, thiserror::Error)]
pub enum SuiteError {
    /// A scene cannot be read.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// There are no scenes.
    #[error("no scenes (*.xml, *.json) below {}", folders(.0))]
    NoScenes(Vec<PathBuf>),
    /// Two scenes have the same name.
    #[error("two scenes have the same name {id}\n  help: rename one of them")]
    SameName {
        /// The name.
        id: String,
    },
}

fn folders(folders: &[PathBuf]) -> String {
    let names: Vec<String> = folders.iter().map(|folder| folder.display().to_string()).collect();
    names.join(" or ")
}

impl Suite {
    /// Reads every scene below the folders of the sections. A missing folder has no scenes.
    ///
    /// # Errors
    /// If a scene cannot be read, if there is none, or if two have the same name.
    pub fn load(
        sections: &[(Section, PathBuf)],
        options: &ParseOptions,
    ) -> Result<Self, SuiteError> {
        let mut files = Vec::new();
        let mut present = Vec::new();
        for (section, folder) in sections.iter().filter(|(_, folder)| folder.exists()) {
            present.push(*section);
            let found = scene::find_scene_files(folder)?;
            files.extend(found.into_iter().map(|file| (*section, folder.as_path(), file)));
        }
        let load = |(section, folder, file): (Section, &Path, PathBuf)| {
            load_case(section, folder, &file, options)
        };
        let loaded: Result<Vec<(Case, Vec<SceneError>)>, SceneError> =
            files.into_par_iter().map(load).collect();
        let (mut cases, mut warnings) = (Vec::new(), Vec::new());
        for (case, remarks) in loaded? {
            cases.push(case);
            warnings.extend(remarks);
        }
        if cases.is_empty() {
            let searched = sections.iter().map(|(_, folder)| folder.clone()).collect();
            return Err(SuiteError::NoScenes(searched));
        }
        let mut seen = HashMap::new();
        for case in &cases {
            if seen.insert(case.id.as_str(), ()).is_some() {
                return Err(SuiteError::SameName { id: case.id.clone() });
            }
        }
        let mut suite = Self { cases, sections: present, warnings };
        suite.sort();
        Ok(suite)
    }

    /// Keeps the scenes for which `place` returns a section and a solver, and sets both.
    pub(crate) fn reassign(&mut self, place: impl Fn(&Case) -> Option<(Section, SolverName)>) {
        self.cases.retain_mut(|case| match place(case) {
            Some((section, solver)) => {
                (case.feature.section, case.solver) = (section, solver);
                true
            }
            None => false,
        });
        self.sort();
    }

    fn sort(&mut self) {
        self.cases.sort_by(|a, b| (a.feature.section, &a.id).cmp(&(b.feature.section, &b.id)));
    }
}

fn load_case(
    section: Section,
    folder: &Path,
    file: &Path,
    options: &ParseOptions,
) -> Result<(Case, Vec<SceneError>), SceneError> {
    let bytes = scene::read_bounded(file)?;
    let parsed = scene::parse_bytes(&bytes, file, &vocabulary(), options)?;
    let relative = file.strip_prefix(folder).unwrap_or(file).with_extension("");
    let parts: Vec<String> =
        relative.iter().map(|part| part.to_string_lossy().into_owned()).collect();
    let group = match parts.as_slice() {
        [] | [_] => ".".to_owned(),
        [folders @ .., _] => folders.join("/"),
    };
    let feature = Feature { section, group, integrator: parsed.scene.integrator.name };
    let home = file.parent().unwrap_or(folder);
    let mut files = vec![SceneFile::new(file, home)];
    files.extend(parsed.mesh.as_ref().map(|mesh| SceneFile::new(&mesh.path, home)));
    let mesh = parsed.mesh.as_ref().map_or(&[][..], |mesh| &mesh.bytes);
    let scene_hash = hash([&bytes, mesh]);
    let case = Case {
        id: parts.join("/"),
        feature,
        scene: parsed.scene,
        integrator_spelling: parsed.integrator_spelling,
        solver: SolverName::default(),
        files,
        scene_hash,
    };
    Ok((case, parsed.warnings))
}

/// SHA-256 of the parts, one after the other, in hexadecimal.
fn hash(parts: [&[u8]; 2]) -> String {
    let mut hasher = Sha256::new();
    parts.into_iter().for_each(|part| hasher.update(part));
    hexadecimal(&hasher.finalize())
}

/// SHA-256 of a file, read as a stream, in hexadecimal.
///
/// # Errors
/// If it cannot be read.
pub fn hash_file(path: &Path) -> io::Result<String> {
    hash_reader(input::open(path)?)
}

/// SHA-256 of a stream, in hexadecimal.
pub(crate) fn hash_reader(file: impl Read) -> io::Result<String> {
    let mut hasher = Sha256::new();
    feed(&mut hasher, file)?;
    Ok(hexadecimal(&hasher.finalize()))
}

/// Adds a stream to a hash.
fn feed(hasher: &mut Sha256, mut file: impl Read) -> io::Result<()> {
    let mut buffer = vec![0; 1 << 16];
    loop {
        match file.read(&mut buffer) {
            Ok(0) => return Ok(()),
            Ok(count) => hasher.update(&buffer[..count]),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

/// SHA-256 of bytes, in hexadecimal.
pub fn hash_bytes(bytes: &[u8]) -> String {
    hash([bytes, &[]])
}

/// Reasons why a scene has no usable trace.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NoTrace {
    /// The trace does not exist.
    #[error("neither {0}.csv nor {0}.bin exists{hint}", stem.display(), hint = hint(other_case.as_ref()))]
    Missing {
        /// The trace's path, without extension.
        stem: PathBuf,
        /// A file with the right name whose extension is not in lower case.
        other_case: Option<PathBuf>,
    },
    /// There is a trace in each format.
    #[error("both {0}.csv and {0}.bin exist; keep one", stem.display())]
    Several {
        /// Their path, without extension.
        stem: PathBuf,
    },
}

fn hint(other_case: Option<&PathBuf>) -> String {
    let hint = |path: &PathBuf| {
        format!("\n  help: {} exists; change its extension to lower case", path.display())
    };
    other_case.map(hint).unwrap_or_default()
}

/// The trace of a scene in a folder laid out as the scenes are.
///
/// # Errors
/// If there is none, or more than one.
pub fn find_trace(folder: &Path, id: &str) -> Result<(PathBuf, TraceFormat), NoTrace> {
    let mut found = find_traces(folder, id);
    match (found.pop(), found.is_empty()) {
        (Some(trace), true) => Ok(trace),
        (Some(_), false) => Err(NoTrace::Several { stem: folder.join(id) }),
        (None, _) => {
            let stem = folder.join(id);
            Err(NoTrace::Missing { other_case: in_other_case(&stem), stem })
        }
    }
}

/// All traces of a scene in a folder laid out as the scenes are, at most one a format.
pub fn find_traces(folder: &Path, id: &str) -> Vec<(PathBuf, TraceFormat)> {
    let trace = |format: TraceFormat| {
        // Not `with_extension`: a scene's name may contain a dot.
        let path = folder.join(format!("{id}.{}", format.extension()));
        // Files that are not regular are rejected when they are opened.
        path.exists().then_some((path, format))
    };
    TraceFormat::ALL.into_iter().filter_map(trace).collect()
}

/// The file `stem` with a trace's extension in another case, such as `a.CSV`; the first by name.
fn in_other_case(stem: &Path) -> Option<PathBuf> {
    let name = stem.file_name()?.to_str()?;
    let is_other_case = |path: &PathBuf| {
        let file = path.file_name().and_then(|file| file.to_str());
        let extension =
            file.and_then(|file| file.strip_prefix(name)).and_then(|rest| rest.strip_prefix('.'));
        let of_trace = |format: TraceFormat| {
            extension.is_some_and(|extension| extension.eq_ignore_ascii_case(format.extension()))
        };
        TraceFormat::ALL.into_iter().any(of_trace) && path.is_file()
    };
    let entries = std::fs::read_dir(stem.parent()?).ok()?;
    entries.flatten().map(|entry| entry.path()).filter(is_other_case).min()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn the_hash_of_a_scene_covers_its_mesh() {
        let folder = tempfile::TempDir::new().unwrap();
        let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
        write("net.json", r#"{"obj": "net.obj", "k": 1, "m": 1}"#);
        write("package.json", r#"{"name": "not a scene"}"#);
        let mut options = ParseOptions::default();
        options.overrides.integrator = vocabulary().integrator("implicit-euler");
        let sections = [(Section::Required, folder.path().to_path_buf())];
        let hash_with = |mesh: &str| {
            write("net.obj", mesh);
            let suite = Suite::load(&sections, &options).unwrap();
            let [case] = &suite.cases[..] else { panic!("{:?}", suite.cases) };
            assert_eq!(case.id, "net");
            case.scene_hash.clone()
        };
        let mesh = "v 0 0 0\nv 1 0 0\nf 1 2\n";
        let hash = hash_with(mesh);
        assert_ne!(hash, hash_with("v 0 0 0\nv 2 0 0\nf 1 2\n"));
        assert_eq!(hash, hash_with(mesh));
        // It is that of both files, one after the other.
        let both = fs::read_to_string(folder.path().join("net.json")).unwrap() + mesh;
        write("both", &both);
        assert_eq!(hash, hash_file(&folder.path().join("both")).unwrap());
    }
}
