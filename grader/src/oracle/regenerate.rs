//! Makes every oracle trace anew with the built-in simulator, and replaces the folder whole or not at
//! all.
//!
//! The new traces are written to a folder beside the old one, compared with the old ones, and only then
//! exchanged with them, in one step where the system has one. A trace that changed beyond its tolerance,
//! or lost its scene, is not replaced unless the changes are accepted; then nothing else is either.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use simulator::simulation::{Simulation, SimulationError};
use simulator::trace::csv::CsvWriter;
use simulator::trace::{self, Shape, TraceWriter};
use tempfile::TempDir;

use super::manifest::{Entry, FILE_NAME, FORMAT, Manifest};
use super::{Oracle, OracleError};
use crate::compare::{Comparison, Expectation, Tolerances, compare};
use crate::rubric::Rubric;
use crate::suite::{Case, Suite, find_trace, hash_file};
use crate::verdict::{Failure, Verdict};

/// What regenerating did, or would do.
#[derive(Debug, Clone, PartialEq)]
pub struct Regeneration {
    /// One entry a scene, and one a trace that lost its scene; by name.
    pub changes: Vec<(String, Change)>,
    /// Whether the folder was replaced. It is not where nothing changed, or where a change needs
    /// accepting.
    pub replaced: bool,
}

/// What became of a trace.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// The same bytes.
    Unchanged,
    /// There was none before.
    New,
    /// Other bytes.
    Changed {
        /// Whether the scene was edited since the old trace was made, as far as is known.
        scene_edited: bool,
        /// The new trace judged by the old one.
        comparison: Comparison,
    },
    /// Its scene is gone.
    Removed,
}

impl Change {
    /// Whether it may only happen with consent.
    pub fn needs_accepting(&self) -> bool {
        match self {
            Self::Unchanged | Self::New => false,
            Self::Changed { comparison, .. } => !comparison.verdict.is_pass(),
            Self::Removed => true,
        }
    }
}

impl Regeneration {
    /// Whether nothing was replaced because a change needs accepting.
    pub fn refused(&self) -> bool {
        !self.replaced && self.changes.iter().any(|(_, change)| change.needs_accepting())
    }
}

/// Regenerating failed; the old folder is as it was.
#[derive(Debug, thiserror::Error)]
pub enum RegenerateError {
    /// A scene cannot be simulated.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The old manifest cannot be read.
    #[error(transparent)]
    Oracle(#[from] OracleError),
    /// A file cannot be written or read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}

/// Makes the traces of every scene of the suite, and replaces `folder` by them.
///
/// # Errors
/// Where a scene cannot be simulated, or a file not be written; `folder` is then as it was.
pub fn regenerate(
    suite: &Suite,
    folder: &Path,
    rubric: &Rubric,
    accept: bool,
) -> Result<Regeneration, RegenerateError> {
    // A manifest that cannot be read is what `accept` is there to replace.
    let old = match Oracle::open(folder) {
        Err(_) if accept => Oracle { folder: folder.to_path_buf(), manifest: None },
        opened => opened?,
    };
    let staging = stage(folder)?;
    let make = |case: &Case| make(case, staging.path(), &old, rubric);
    let made: Result<Vec<(Entry, Change)>, RegenerateError> =
        suite.cases.par_iter().map(make).collect();
    let (traces, mut changes): (Vec<Entry>, Vec<(String, Change)>) = made?
        .into_iter()
        .map(|(entry, change)| {
            let name = entry.scene.clone();
            (entry, (name, change))
        })
        .unzip();
    let others = other_files(suite, folder)?;
    changes.extend(others.orphans.into_iter().map(|name| (name, Change::Removed)));
    changes.sort_by(|(a, _), (b, _)| a.cmp(b));

    let mut manifest = Manifest {
        format: FORMAT,
        simulator: "Spring Oracle".to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        traces,
    };
    manifest.traces.sort_by(|a, b| a.scene.cmp(&b.scene));
    let same = old.manifest.as_ref() == Some(&manifest)
        && changes.iter().all(|(_, change)| *change == Change::Unchanged);
    let refused = !accept && changes.iter().any(|(_, change)| change.needs_accepting());
    let replaced = !same && !refused;
    if replaced {
        write_manifest(&manifest, &staging.path().join(FILE_NAME))?;
        for file in others.kept {
            copy(&folder.join(&file), &staging.path().join(&file))?;
        }
        exchange(staging, folder)?;
    }
    Ok(Regeneration { changes, replaced })
}

/// An empty folder beside `folder`; what an interrupted run left there is removed.
fn stage(folder: &Path) -> Result<TempDir, RegenerateError> {
    let parent = match folder.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    let prefix = format!(".{name}.regenerating.");
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
        // As any new folder: what the umask leaves of it.
        builder.permissions(fs::Permissions::from_mode(0o777));
    }
    builder.tempdir_in(parent).map_err(at(parent))
}

/// Makes one trace in `staging`, and compares it with the old one.
fn make(
    case: &Case,
    staging: &Path,
    old: &Oracle,
    rubric: &Rubric,
) -> Result<(Entry, Change), RegenerateError> {
    let path = staging.join(format!("{}.csv", case.id));
    write_trace(case, &path)?;
    let trace_sha256 = hash_file(&path).map_err(at(&path))?;
    let change = match find_trace(&old.folder, &case.id) {
        None => Change::New,
        Some((old_path, _)) if hash_file(&old_path).map_err(at(&old_path))? == trace_sha256 => {
            Change::Unchanged
        }
        Some((old_path, format)) => {
            let old_entry = old.manifest.as_ref().and_then(|manifest| manifest.entry(&case.id));
            Change::Changed {
                scene_edited: old_entry.is_some_and(|entry| entry.scene_sha256 != case.scene_hash),
                comparison: judge_new(case, (&old_path, format), &path, rubric.tolerances(case)),
            }
        }
    };
    let entry = Entry {
        scene: case.id.clone(),
        scene_sha256: case.scene_hash.clone(),
        trace_sha256,
        integrator: case.scene.integrator.name.to_owned(),
        time_step: case.scene.time_step,
        steps: case.scene.n_steps(),
    };
    Ok((entry, change))
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

/// The new trace, judged by the old one as if that were the oracle's.
fn judge_new(
    case: &Case,
    (old, format): (&Path, trace::TraceFormat),
    new: &Path,
    tolerances: Tolerances,
) -> Comparison {
    let shape = Shape::of(&case.scene);
    let expectation =
        Expectation { shape, time_step: case.scene.time_step, n_states: case.scene.n_steps() + 1 };
    let opened = trace::open(old, format, shape)
        .and_then(|old| Ok((old, trace::open(new, trace::TraceFormat::Csv, shape)?)));
    match opened {
        Ok((mut old, mut new)) => compare(old.as_mut(), &mut new, expectation, tolerances),
        // The old trace is of another shape, or broken: as different as can be.
        Err(error) => {
            let detail = error.to_string();
            Comparison::without_states(Verdict::Fail(Failure::Malformed { detail }))
        }
    }
}

/// Files of the old folder that are not traces of the suite.
struct OtherFiles {
    /// Traces without a scene, by the name the scene would have.
    orphans: Vec<String>,
    /// Files that are no traces, relative to the folder.
    kept: Vec<PathBuf>,
}

fn other_files(suite: &Suite, folder: &Path) -> Result<OtherFiles, RegenerateError> {
    let (mut orphans, mut kept) = (Vec::new(), Vec::new());
    for file in super::files_below(folder).map_err(at(folder))? {
        match super::trace_name(&file) {
            Some(name) if suite.cases.iter().any(|case| case.id == name) => {}
            Some(name) => orphans.push(name),
            None if file == Path::new(FILE_NAME) => {}
            None => kept.push(file),
        }
    }
    Ok(OtherFiles { orphans, kept })
}

fn write_manifest(manifest: &Manifest, path: &Path) -> Result<(), RegenerateError> {
    let text = toml::to_string(manifest).map_err(|error| RegenerateError::Io {
        path: path.to_path_buf(),
        source: io::Error::other(error),
    })?;
    let text = format!("# Made by `grade oracle regenerate`; not to be edited by hand.\n{text}");
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

/// Puts the staged folder in the place of `folder`, whose old content is removed.
fn exchange(staging: TempDir, folder: &Path) -> Result<(), RegenerateError> {
    if !folder.exists() {
        let staged = staging.keep();
        return fs::rename(&staged, folder).map_err(at(folder));
    }
    if exchange_names(staging.path(), folder).is_ok() {
        // The staging name now holds the old content, and is removed with it.
        return staging.close().map_err(at(folder));
    }
    // No exchange in one step here: the old folder steps aside first, and back if the new one cannot
    // take its place.
    let staged = staging.keep();
    let aside = staged.with_extension("old");
    fs::rename(folder, &aside).map_err(at(folder))?;
    if let Err(source) = fs::rename(&staged, folder) {
        fs::rename(&aside, folder).map_err(at(folder))?;
        return Err(RegenerateError::Io { path: folder.to_path_buf(), source });
    }
    fs::remove_dir_all(&aside).map_err(at(&aside))
}

#[cfg(target_os = "linux")]
fn exchange_names(a: &Path, b: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    Ok(renameat_with(CWD, a, CWD, b, RenameFlags::EXCHANGE)?)
}

#[cfg(not(target_os = "linux"))]
fn exchange_names(_: &Path, _: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

fn at(path: &Path) -> impl Fn(io::Error) -> RegenerateError + use<> {
    let path = path.to_path_buf();
    move |source| RegenerateError::Io { path: path.clone(), source }
}
