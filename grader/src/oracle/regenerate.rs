//! Regenerates all oracle traces with the built-in simulator. The folder is replaced as a whole or not at all.
//!
//! ```text
//! Staged::make   new traces, in a folder next to the old one, each compared with its old trace
//!      │         `regenerate --accept` decides at once, `review` asks
//! Staged::replace   old traces of changes that are not accepted go back; the two folders are exchanged
//! ```
//!
//! The exchange is atomic where the system supports it. A trace that changed beyond its tolerance, or whose scene is
//! gone, is replaced only if the change is accepted. If nothing is accepted, the whole folder stays.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use scene::trace::csv::CsvWriter;
use scene::trace::{self, Shape, State, TraceError, TraceFault, TraceFormat, TraceWriter};
use simulator::simulation::{Simulation, SimulationError};
use tempfile::TempDir;

use super::manifest::{FILE_NAME, FORMAT, Manifest, ManifestEntry, SIMULATOR, VERSION};
use super::{Oracle, OracleError, envelopes};
use crate::compare::calibration::{Bounds, Envelope, StoredEnvelope, calibrate};
use crate::compare::{Comparison, Expectation, Pair, Tolerances, compare_watched};
use crate::rubric::Rubric;
use crate::suite::{Case, Suite, SuiteError, find_traces, hash_bytes, hash_file};
use crate::verdict::{Fault, Verdict};

/// Result of a regeneration, or of its dry run.
#[derive(Debug, Clone, PartialEq)]
pub struct Regeneration {
    /// One entry for each scene and for each trace without a scene, by name.
    pub changes: Vec<(String, TraceChange)>,
    /// Whether the folder was replaced. It stays where nothing changed, or where a change has to be accepted first.
    pub replaced: bool,
    /// The names of changes that have to be accepted, and were not.
    pub kept: BTreeSet<String>,
    /// Remainder of the old folder, if it was replaced but could not be removed.
    pub leftover: Option<Leftover>,
}

/// The accepted changes, of those that have to be.
#[derive(Debug, Clone, Copy)]
pub enum Acceptance<'a> {
    /// None. If there is one, the whole folder stays.
    Nothing,
    /// All.
    All,
    /// Those of these names. The other traces stay, with their entries.
    Some(&'a BTreeSet<String>),
}

impl Acceptance<'_> {
    fn accepts(self, name: &str) -> bool {
        match self {
            Self::Nothing => false,
            Self::All => true,
            Self::Some(names) => names.contains(name),
        }
    }
}

/// The grader that makes traces.
#[derive(Debug, Clone, Default)]
pub struct Origin {
    /// The commit that it was built from; `None` if unknown.
    pub commit: Option<String>,
    /// Operating system and architecture; `None` if unknown.
    pub platform: Option<String>,
}

/// Old content that could not be removed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Leftover {
    /// Its path.
    pub path: PathBuf,
    /// Why it could not be removed.
    pub detail: String,
}

/// Change of one trace.
#[derive(Debug, Clone, PartialEq)]
pub enum TraceChange {
    /// The same bytes, of the same scene.
    Unchanged,
    /// The same bytes, although the scene was edited.
    SceneEdited,
    /// A new trace, without an old one.
    New,
    /// Other bytes.
    Changed {
        /// Whether the scene was edited since the old trace was made, if known.
        scene_edited: bool,
        /// Number of old traces: one a format.
        n_old: usize,
        /// Difference from the old trace; of several, from the one that differs most.
        difference: TraceDifference,
    },
    /// The scene is gone.
    Removed,
}

/// Difference of a new trace from an old one.
#[derive(Debug, Clone, PartialEq)]
pub enum TraceDifference {
    /// The numbers differ.
    Numbers(Box<NumberDifference>),
    /// The number of states differs.
    Length {
        /// States of the old trace.
        old: u64,
        /// States of the new trace.
        new: u64,
    },
    /// The number of particles or dimensions differs.
    Shape,
    /// The old trace cannot be read.
    Unusable {
        /// Why.
        detail: String,
    },
}

/// Difference of the numbers of two traces.
#[derive(Debug, Clone, PartialEq)]
pub struct NumberDifference {
    /// The new trace judged by the old one.
    pub comparison: Comparison,
    /// The largest residuals of position and velocity in each of at most 60 spans of states.
    pub sizes: Vec<[f64; 2]>,
}

/// Maximum number of spans of states in a difference.
const SPANS: u64 = 60;

impl TraceDifference {
    /// Whether the numbers agree within the tolerance.
    pub fn is_within_tolerance(&self) -> bool {
        matches!(self, Self::Numbers(difference) if difference.comparison.verdict.is_pass())
    }
}

impl TraceChange {
    /// Whether the change has to be accepted by the user.
    pub fn needs_accepting(&self) -> bool {
        match self {
            Self::Unchanged | Self::SceneEdited | Self::New => false,
            Self::Changed { difference, .. } => !difference.is_within_tolerance(),
            Self::Removed => true,
        }
    }
}

impl Regeneration {
    /// Whether a change that has to be accepted was not.
    pub fn refused(&self) -> bool {
        !self.kept.is_empty()
    }
}

/// Regenerating failed. The old folder is unchanged, unless the message says otherwise.
#[derive(Debug, thiserror::Error)]
pub enum RegenerateError {
    /// A scene cannot be simulated.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The old manifest cannot be read.
    #[error(transparent)]
    Oracle(#[from] OracleError),
    /// The scenes of a new folder cannot be read.
    #[error(transparent)]
    Suite(#[from] SuiteError),
    /// There is something in the place of a new folder.
    #[error("{}: exists already\n  help: name another folder, or remove it", path.display())]
    Exists {
        /// Its path.
        path: PathBuf,
    },
    /// The path has no file name from which to derive the new folder's name.
    #[error("{}: a folder without a name cannot be replaced", path.display())]
    NoName {
        /// The folder.
        path: PathBuf,
    },
    /// Nothing is known of a trace that would stay.
    #[error("{}: without a manifest, {scene} cannot stay as it is\n  help: accept all changes with --accept", folder.display())]
    Unknown {
        /// The folder.
        folder: PathBuf,
        /// The trace.
        scene: String,
    },
    /// The folder contains the current working directory.
    #[error("{}: cannot be replaced, because it contains the current folder\n  help: run the command from another folder", path.display())]
    HoldsCurrent {
        /// The folder.
        path: PathBuf,
    },
    /// The old folder was moved aside, but neither the new nor the old one could take its place.
    #[error("{}: could not be replaced: {source}\n  help: its content is now in {}", path.display(), aside.display())]
    Aside {
        /// The folder.
        path: PathBuf,
        /// The path of its content.
        aside: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A file cannot be written or read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}

/// New traces in a folder next to the old one. It is removed unless it takes the old one's place.
pub struct Staged {
    folder: PathBuf,
    place: FolderLocation,
    staging: TempDir,
    old: Oracle,
    made: Vec<Made>,
    /// Files of the old folder that are neither traces nor made here.
    others: Vec<PathBuf>,
    /// One entry for each scene and for each trace without a scene, by name.
    pub changes: Vec<(String, TraceChange)>,
}

impl Staged {
    /// Makes the traces of every scene of the suite and compares them with those of `folder`.
    ///
    /// # Errors
    /// If a scene cannot be simulated, a file cannot be written, or, unless all changes are accepted, the old manifest
    /// cannot be read.
    pub fn make(
        suite: &Suite,
        folder: &Path,
        rubric: &Rubric,
        accept: Acceptance<'_>,
    ) -> Result<Self, RegenerateError> {
        let old = match Oracle::open(folder) {
            Err(_) if matches!(accept, Acceptance::All) => Oracle::without_manifest(folder),
            opened => opened?,
        };
        let place = FolderLocation::of(folder)?;
        let staging = stage(&place)?;
        let make = |case: &Case| make(case, staging.path(), &old, rubric);
        let made: Result<Vec<Made>, RegenerateError> = suite.cases.par_iter().map(make).collect();
        let made = made?;
        let others = other_files(suite, folder)?;
        let changes = made.iter().map(|made| (made.entry.scene.clone(), made.change.clone()));
        let removed = others.orphans.into_iter().map(|name| (name, TraceChange::Removed));
        let mut changes: Vec<_> = changes.chain(removed).collect();
        changes.sort_by(|(a, _), (b, _)| a.cmp(b));
        let folder = folder.to_path_buf();
        Ok(Self { folder, place, staging, old, made, others: others.kept, changes })
    }

    /// The hash of the new trace of a scene; `None` if its scene is gone.
    pub fn trace_hash(&self, scene: &str) -> Option<&str> {
        let made = self.made.iter().find(|made| made.entry.scene == scene)?;
        Some(&made.entry.trace_sha256)
    }

    /// The hash of the files from which the old trace of a scene was made, if known.
    pub fn old_scene_hash(&self, scene: &str) -> Option<&str> {
        Some(&self.old.manifest.as_ref()?.entry(scene)?.scene_sha256)
    }

    /// How far correct programs differ at the end of a scene, by the new envelope.
    pub fn bounds(&self, scene: &str) -> Option<Bounds> {
        let made = self.made.iter().find(|made| made.entry.scene == scene)?;
        Some(made.envelope.at(made.entry.steps))
    }

    /// Replaces the folder, if something changed and is accepted. If it is a link, its target is replaced.
    ///
    /// # Errors
    /// If a file cannot be written, or the folder cannot be replaced. Except as the error says, it is then unchanged.
    pub fn replace(
        mut self,
        accept: Acceptance<'_>,
        origin: &Origin,
    ) -> Result<Regeneration, RegenerateError> {
        let changes = std::mem::take(&mut self.changes);
        let is_kept = |(name, change): &&(String, TraceChange)| {
            change.needs_accepting() && !accept.accepts(name)
        };
        let kept: BTreeSet<String> =
            changes.iter().filter(is_kept).map(|(name, _)| name.clone()).collect();
        if matches!(accept, Acceptance::Nothing) && !kept.is_empty() {
            return Ok(Regeneration { changes, replaced: false, kept, leftover: None });
        }
        for scene in &kept {
            self.keep(scene)?;
        }
        let is_made = |made: &&Made| !kept.contains(&made.entry.scene);
        let made = self.made.iter().filter(is_made);
        let mut traces: Vec<ManifestEntry> =
            made.clone().map(|made| self.entry_of(made, origin)).collect();
        let mut stored: Vec<StoredEnvelope> =
            made.map(|made| StoredEnvelope::of(&made.entry.scene, &made.envelope)).collect();
        for scene in &kept {
            traces.extend(self.old_entry(scene).cloned());
            let envelope = self.old.envelopes.as_ref().ok();
            let envelope = envelope.and_then(|envelopes| envelopes.find(scene));
            stored.extend(envelope.map(|envelope| StoredEnvelope::of(scene, envelope)));
        }
        traces.sort_by(|a, b| a.scene.cmp(&b.scene));
        stored.sort_by(|a, b| a.name.cmp(&b.name));
        let envelopes = envelopes::text(&stored);
        let manifest = Manifest {
            format: FORMAT,
            simulator: SIMULATOR.to_owned(),
            version: VERSION.to_owned(),
            envelopes_sha256: hash_bytes(envelopes.as_bytes()),
            traces,
        };
        let is_unchanged = |(name, change): &(String, TraceChange)| {
            *change == TraceChange::Unchanged || kept.contains(name)
        };
        let same = self.old.manifest.as_ref() == Some(&manifest)
            && self.old.envelopes.is_ok()
            && changes.iter().all(is_unchanged);
        if same {
            return Ok(Regeneration { changes, replaced: false, kept, leftover: None });
        }
        write_manifest(&manifest, &self.staging.path().join(FILE_NAME))?;
        write_text(&envelopes, &self.staging.path().join(envelopes::FILE_NAME))?;
        for file in &self.others {
            copy(&self.folder.join(file), &self.staging.path().join(file))?;
        }
        let leftover = exchange(self.staging, &self.place.path(), &Means::default())?;
        Ok(Regeneration { changes, replaced: true, kept, leftover })
    }

    /// Puts the old traces of a scene in the place of the new one.
    fn keep(&self, scene: &str) -> Result<(), RegenerateError> {
        if self.old_entry(scene).is_none() {
            let (folder, scene) = (self.folder.clone(), scene.to_owned());
            return Err(RegenerateError::Unknown { folder, scene });
        }
        let new = self.staging.path().join(format!("{scene}.csv"));
        if new.exists() {
            fs::remove_file(&new).map_err(at(&new))?;
        }
        for (old, _) in find_traces(&self.folder, scene) {
            let name = old.strip_prefix(&self.folder).unwrap_or(&old);
            copy(&old, &self.staging.path().join(name))?;
        }
        Ok(())
    }

    fn old_entry(&self, scene: &str) -> Option<&ManifestEntry> {
        self.old.manifest.as_ref()?.entry(scene)
    }

    /// The entry of a new trace: the old one, if that says the same.
    fn entry_of(&self, made: &Made, Origin { commit, platform }: &Origin) -> ManifestEntry {
        let same = |old: &&ManifestEntry| {
            let (commit, platform) = (old.commit.clone(), old.platform.clone());
            ManifestEntry { commit, platform, ..made.entry.clone() } == **old
        };
        let (commit, platform) = (commit.clone(), platform.clone());
        let new = || ManifestEntry { commit, platform, ..made.entry.clone() };
        self.old_entry(&made.entry.scene).filter(same).cloned().unwrap_or_else(new)
    }
}

/// The folder's canonical location, with links resolved.
pub(super) struct FolderLocation {
    /// An absolute path.
    parent: PathBuf,
    name: OsString,
}

impl FolderLocation {
    pub(super) fn of(folder: &Path) -> Result<Self, RegenerateError> {
        let no_name = || RegenerateError::NoName { path: folder.to_path_buf() };
        // A dangling link exists, but is not a folder.
        if fs::symlink_metadata(folder).is_err() {
            let name = folder.file_name().ok_or_else(no_name)?.to_owned();
            let parent = match folder.parent() {
                Some(parent) if !parent.as_os_str().is_empty() => parent,
                _ => Path::new("."),
            };
            return Ok(Self { parent: scene::input::real_path(parent).map_err(at(parent))?, name });
        }
        let path = scene::input::real_path(folder).map_err(at(folder))?;
        if !path.is_dir() {
            return Err(at(folder)(io::ErrorKind::NotADirectory.into()));
        }
        let (Some(parent), Some(name)) = (path.parent(), path.file_name()) else {
            return Err(no_name());
        };
        let current = std::env::current_dir().and_then(|current| scene::input::real_path(&current));
        if current.is_ok_and(|current| current.starts_with(&path)) {
            return Err(RegenerateError::HoldsCurrent { path: folder.to_path_buf() });
        }
        Ok(Self { parent: parent.to_path_buf(), name: name.to_owned() })
    }

    pub(super) fn path(&self) -> PathBuf {
        self.parent.join(&self.name)
    }
}

/// A new empty folder next to the one to replace. Remainders of interrupted runs are removed.
pub(super) fn stage(
    FolderLocation { parent, name }: &FolderLocation,
) -> Result<TempDir, RegenerateError> {
    let prefix = format!(".{}.regenerating.", name.to_string_lossy());
    for entry in fs::read_dir(parent).map_err(at(parent))?.flatten() {
        if entry.file_name().to_string_lossy().starts_with(&prefix) {
            fs::remove_dir_all(entry.path()).map_err(at(&entry.path()))?;
        }
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // The umask applies, as for any new folder.
        builder.permissions(fs::Permissions::from_mode(0o777));
    }
    builder.tempdir_in(parent).map_err(at(parent))
}

/// A new trace and its entries in the manifest and the envelopes.
struct Made {
    entry: ManifestEntry,
    change: TraceChange,
    envelope: Envelope,
}

/// Makes one trace in `staging` and compares it with the old one.
fn make(
    case: &Case,
    staging: &Path,
    old: &Oracle,
    rubric: &Rubric,
) -> Result<Made, RegenerateError> {
    let path = staging.join(format!("{}.csv", case.id));
    write_trace(case, &path)?;
    let trace_sha256 = hash_file(&path).map_err(at(&path))?;
    let old_entry = old.manifest.as_ref().and_then(|manifest| manifest.entry(&case.id));
    let scene_edited = old_entry.is_some_and(|entry| entry.scene_sha256 != case.scene_hash);
    let old_traces = find_traces(&old.folder, &case.id);
    let is_same = |old: &Path| hash_file(old).map_err(at(old)).map(|hash| hash == trace_sha256);
    let change = match old_traces.as_slice() {
        [] => TraceChange::New,
        [(old, _)] if is_same(old)? => {
            if scene_edited {
                TraceChange::SceneEdited
            } else {
                TraceChange::Unchanged
            }
        }
        [first, others @ ..] => {
            let compare = |old| compare_traces(case, old, &path, rubric.tolerances(case));
            let mut difference = compare(first);
            for other in others {
                if difference.is_within_tolerance() {
                    difference = compare(other);
                }
            }
            TraceChange::Changed { scene_edited, n_old: old_traces.len(), difference }
        }
    };
    let envelope = calibrate(&case.scene);
    Ok(Made { entry: ManifestEntry::of(case, trace_sha256), change, envelope })
}

fn write_trace(case: &Case, path: &Path) -> Result<(), RegenerateError> {
    if let Some(parent) = path.parent() {
        fs::create_dir_all(parent).map_err(at(parent))?;
    }
    let file = io::BufWriter::new(File::create(path).map_err(at(path))?);
    let mut writer = CsvWriter::new(file, Shape::of(&case.scene)).map_err(at(path))?;
    let mut simulation = Simulation::new(&case.scene);
    loop {
        writer.write(simulation.state()).map_err(at(path))?;
        if !simulation.advance()? {
            break;
        }
    }
    let file = writer.into_inner().and_then(|file| Ok(file.into_inner()?)).map_err(at(path))?;
    file.sync_all().map_err(at(path))
}

/// Difference of the new trace from the old one, which takes the role of the oracle.
fn compare_traces(
    case: &Case,
    (old, format): &(PathBuf, TraceFormat),
    new: &Path,
    tolerances: Tolerances,
) -> TraceDifference {
    let expectation = Expectation::of(&case.scene);
    let Expectation { shape, n_states, .. } = expectation;
    match count_states(old, *format, shape) {
        Ok(count) if count == n_states => {}
        Ok(count) => return TraceDifference::Length { old: count, new: n_states },
        Err(error) => return difference_of(&error),
    }
    let opened = trace::open(old, *format, shape)
        .and_then(|old| Ok((old, trace::open(new, TraceFormat::Csv, shape)?)));
    let mut sizes = vec![[0.0_f64; 2]; n_states.min(SPANS) as usize];
    let mut watch = |pair: Pair<'_>| {
        let span = (pair.step * sizes.len() as u64 / n_states.max(1)) as usize;
        let found = distances(pair.expected, pair.got, shape.dimension.count());
        if let Some(size) = sizes.get_mut(span) {
            *size = [size[0].max(found[0]), size[1].max(found[1])];
        }
    };
    let comparison = match opened {
        Ok((mut old, mut new)) => {
            compare_watched(old.as_mut(), &mut new, expectation, tolerances, &mut watch)
        }
        Err(error) => return difference_of(&error),
    };
    match comparison.verdict {
        Verdict::GraderFault(Fault::BrokenOracle { detail }) => {
            TraceDifference::Unusable { detail }
        }
        _ => TraceDifference::Numbers(Box::new(NumberDifference { comparison, sizes })),
    }
}

/// The largest distances of a particle between two states: in position and in velocity.
fn distances(old: &State, new: &State, dimension: usize) -> [f64; 2] {
    let quantities = [(&old.positions, &new.positions), (&old.velocities, &new.velocities)];
    quantities.map(|(old, new)| {
        let pairs = old.chunks(dimension).zip(new.chunks(dimension));
        let squared = |(old, new): (&[f64], &[f64])| {
            old.iter().zip(new).map(|(old, new)| (old - new).powi(2)).sum::<f64>()
        };
        pairs.map(squared).fold(0.0, f64::max).sqrt()
    })
}

/// Number of states of a trace, read to its end.
fn count_states(path: &Path, format: TraceFormat, shape: Shape) -> Result<u64, TraceError> {
    let mut reader = trace::open(path, format, shape)?;
    let mut state = State::zeros(shape);
    let mut count = 0;
    while reader.read(&mut state)? {
        count += 1;
    }
    Ok(count)
}

fn difference_of(error: &TraceError) -> TraceDifference {
    match error {
        TraceError::Line { fault: TraceFault::HeaderLength { .. }, .. } => TraceDifference::Shape,
        // The same number of columns for another number of particles: the headers differ after `x0,y0`.
        TraceError::Line { fault: TraceFault::Header { found, expected, .. }, .. }
            if matches!((found.as_str(), expected.as_str()), ("z0", "vx0") | ("vx0", "z0")) =>
        {
            TraceDifference::Shape
        }
        _ => TraceDifference::Unusable { detail: error.to_string() },
    }
}

/// Files of the old folder that are not traces of the suite.
struct OtherFiles {
    /// Traces without a scene, by the scene name they imply.
    orphans: BTreeSet<String>,
    /// Other files, relative to the folder.
    kept: Vec<PathBuf>,
}

fn other_files(suite: &Suite, folder: &Path) -> Result<OtherFiles, RegenerateError> {
    let mut files = super::files_below(folder).map_err(at(folder))?;
    let orphans = super::orphans(suite, &files);
    let made = [FILE_NAME, envelopes::FILE_NAME].map(Path::new);
    files.retain(|file| super::trace_name(file).is_none() && !made.contains(&file.as_path()));
    Ok(OtherFiles { orphans, kept: files })
}

fn write_manifest(manifest: &Manifest, path: &Path) -> Result<(), RegenerateError> {
    let text = toml::to_string(manifest).map_err(|error| RegenerateError::Io {
        path: path.to_path_buf(),
        source: io::Error::other(error),
    })?;
    let text = format!("# Made by `grade oracle regenerate`; not to be edited by hand.\n{text}");
    write_text(&text, path)
}

fn write_text(text: &str, path: &Path) -> Result<(), RegenerateError> {
    let mut file = File::create(path).map_err(at(path))?;
    file.write_all(text.as_bytes()).and_then(|()| file.sync_all()).map_err(at(path))
}

fn copy(from: &Path, to: &Path) -> Result<(), RegenerateError> {
    if let Some(parent) = to.parent() {
        fs::create_dir_all(parent).map_err(at(parent))?;
    }
    fs::copy(from, to).map_err(at(from))?;
    Ok(())
}

/// File-system operations, replaced in tests.
struct Means {
    /// Exchanges two names atomically.
    exchange_names: fn(&Path, &Path) -> io::Result<()>,
    /// Removes a folder and its content.
    remove: fn(&Path) -> io::Result<()>,
}

impl Default for Means {
    fn default() -> Self {
        Self {
            exchange_names: sandbox::files::exchange_names,
            remove: |path| fs::remove_dir_all(path),
        }
    }
}

/// Puts the staged folder in the place of `folder` and removes the old content. Returns what could not be removed. On
/// an error, the staged folder is removed.
fn exchange(
    staging: TempDir,
    folder: &Path,
    means: &Means,
) -> Result<Option<Leftover>, RegenerateError> {
    let remove = |path: PathBuf| {
        let removed = (means.remove)(&path);
        removed.err().map(|error| Leftover { path, detail: error.to_string() })
    };
    if !folder.exists() {
        fs::rename(staging.path(), folder).map_err(at(folder))?;
        // The staged folder was renamed: nothing is left to remove.
        let _ = staging.keep();
        return Ok(None);
    }
    if (means.exchange_names)(staging.path(), folder).is_ok() {
        // The staging name now holds the old content.
        return Ok(remove(staging.keep()));
    }
    // No atomic exchange here: the old folder is moved aside first, and back if the new one cannot take its place.
    let aside = staging.path().with_extension("old");
    fs::rename(folder, &aside).map_err(at(folder))?;
    if let Err(source) = fs::rename(staging.path(), folder) {
        return Err(match fs::rename(&aside, folder) {
            Ok(()) => RegenerateError::Io { path: folder.to_path_buf(), source },
            Err(source) => RegenerateError::Aside { path: folder.to_path_buf(), aside, source },
        });
    }
    let _ = staging.keep();
    Ok(remove(aside))
}

pub(super) fn at(path: &Path) -> impl Fn(io::Error) -> RegenerateError + use<> {
    let path = path.to_path_buf();
    move |source| RegenerateError::Io { path: path.clone(), source }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NO_EXCHANGE: fn(&Path, &Path) -> io::Result<()> =
        |_, _| Err(io::ErrorKind::Unsupported.into());
    const NO_REMOVAL: fn(&Path) -> io::Result<()> = |_| Err(io::ErrorKind::ResourceBusy.into());

    /// A folder with `expected/old.txt`, and a second one with `new.txt` that replaces it.
    fn prepare() -> (TempDir, PathBuf, TempDir) {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("expected");
        fs::create_dir(&folder).unwrap();
        fs::write(folder.join("old.txt"), "old").unwrap();
        let staging = stage(&FolderLocation::of(&folder).unwrap()).unwrap();
        fs::write(staging.path().join("new.txt"), "new").unwrap();
        (root, folder, staging)
    }

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn folders_are_exchanged_in_one_step_or_two() {
        for exchange_names in [Means::default().exchange_names, NO_EXCHANGE] {
            let (root, folder, staging) = prepare();
            let means = Means { exchange_names, ..Means::default() };
            assert_eq!(exchange(staging, &folder, &means).unwrap(), None);
            assert_eq!(
                (names(&folder), names(root.path())),
                (vec!["new.txt".into()], vec!["expected".into()])
            );
        }
    }

    #[test]
    fn old_content_that_cannot_be_removed_is_reported_and_is_no_error() {
        for exchange_names in [Means::default().exchange_names, NO_EXCHANGE] {
            let (_root, folder, staging) = prepare();
            let means = Means { exchange_names, remove: NO_REMOVAL };
            let leftover = exchange(staging, &folder, &means).unwrap().unwrap();
            assert_eq!(names(&folder), ["new.txt"]);
            assert_eq!(names(&leftover.path), ["old.txt"]);
        }
    }

    #[test]
    fn the_staged_folder_is_removed_if_the_exchange_fails() {
        let (root, folder, staging) = prepare();
        assert!(exchange(staging, &root.path().join("none/expected"), &Means::default()).is_err());
        assert_eq!(
            (names(&folder), names(root.path())),
            (vec!["old.txt".into()], vec!["expected".into()])
        );

        // A file blocks the name that the old folder would be moved to.
        let (root, folder, staging) = prepare();
        let aside = staging.path().with_extension("old");
        fs::create_dir(&aside).unwrap();
        fs::write(aside.join("in the way"), "").unwrap();
        let means = Means { exchange_names: NO_EXCHANGE, ..Means::default() };
        assert!(exchange(staging, &folder, &means).is_err());
        assert_eq!(names(&folder), ["old.txt"]);
        assert_eq!(names(root.path()), [".expected.regenerating.old", "expected"]);
    }
}
