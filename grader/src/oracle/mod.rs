//! The stored oracle: a folder of traces, the manifest of their origin, and their envelopes.

mod envelopes;
pub mod folder;
pub mod manifest;
mod regenerate;
mod verify;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use envelopes::Envelopes;
use manifest::Manifest;
use scene::trace::TraceFormat;

pub use regenerate::{
    Acceptance, Leftover, NumberDifference, Origin, RegenerateError, Regeneration, Staged,
    TraceChange, TraceDifference,
};
pub use verify::{Mismatch, verify};

use crate::compare::Calibrated;
use crate::suite::{Case, NoTrace, Suite, find_trace, hash_file};
use crate::verdict::Fault;

/// A folder of oracle traces.
#[derive(Debug, Clone)]
pub struct Oracle {
    /// The folder.
    pub folder: PathBuf,
    /// The origin of its traces; `None` for traces from elsewhere.
    pub manifest: Option<Manifest>,
    /// The envelopes, or why their file cannot be used.
    envelopes: Result<Envelopes, String>,
}

/// A manifest that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum OracleError {
    /// The manifest cannot be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file is not a valid manifest.
    #[error("{}: not a manifest: {message}\n  help: restore it, or write a new one with `grade oracle regenerate --accept`", path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// The fault.
        message: String,
    },
}

impl Oracle {
    /// Opens the folder. Its traces are read later.
    ///
    /// # Errors
    /// If there is a manifest that cannot be read.
    pub fn open(folder: &Path) -> Result<Self, OracleError> {
        let manifest = Manifest::load(folder)?;
        let envelopes = match &manifest {
            Some(manifest) => Envelopes::load(folder, &manifest.envelopes_sha256),
            None => Ok(Envelopes::default()),
        };
        Ok(Self { folder: folder.to_path_buf(), manifest, envelopes })
    }

    /// A folder of traces without a manifest.
    fn without_manifest(folder: &Path) -> Self {
        let envelopes = Ok(Envelopes::default());
        Self { folder: folder.to_path_buf(), manifest: None, envelopes }
    }

    /// The calibrated criteria of a scene; `None` where it has no envelope.
    pub fn calibrated(&self, case: &Case) -> Option<Calibrated> {
        let envelope = self.envelopes.as_ref().ok()?.find(&case.id)?;
        Some(Calibrated::new(envelope.clone(), &case.scene))
    }

    /// The trace of a scene.
    ///
    /// # Errors
    /// If there is none, or more than one.
    pub fn find(&self, case: &Case) -> Result<(PathBuf, TraceFormat), Fault> {
        find_trace(&self.folder, &case.id).map_err(|error| match error {
            NoTrace::Missing { stem, .. } => {
                Fault::NoOracle { trace: format!("{}.csv", stem.display()) }
            }
            NoTrace::Several { .. } => Fault::BrokenOracle { detail: error.to_string() },
        })
    }

    /// Why the trace of a scene cannot be used; `None` if it can.
    pub fn fault(&self, case: &Case) -> Option<Fault> {
        self.find(case).and_then(|(path, _)| self.check(case, &path)).err()
    }

    /// SHA-256 of the trace of a scene; `None` if it cannot be used.
    pub fn trace_hash(&self, case: &Case) -> Option<String> {
        let (path, _) = self.find(case).ok()?;
        self.check(case, &path).ok()?;
        hash_file(&path).ok()
    }

    /// Checks that the trace at `path` was made from the current scene and has not been altered since.
    ///
    /// # Errors
    /// If either is not so. Without a manifest, nothing is checked.
    pub fn check(&self, case: &Case, path: &Path) -> Result<(), Fault> {
        if let Err(detail) = &self.envelopes {
            return Err(Fault::BrokenOracle { detail: detail.clone() });
        }
        self.check_trace(case, path)
    }

    /// The same for the trace only, without its envelope.
    fn check_trace(&self, case: &Case, path: &Path) -> Result<(), Fault> {
        let Some(manifest) = &self.manifest else { return Ok(()) };
        let trace = || path.display().to_string();
        let Some(entry) = manifest.entry(&case.id) else {
            return Err(Fault::AlteredOracle { trace: trace() });
        };
        if entry.scene_sha256 != case.scene_hash {
            return Err(Fault::StaleOracle);
        }
        match hash_file(path) {
            Ok(hash) if hash == entry.trace_sha256 => Ok(()),
            Ok(_) => Err(Fault::AlteredOracle { trace: trace() }),
            Err(error) => Err(Fault::BrokenOracle { detail: format!("{}: {error}", trace()) }),
        }
    }
}

/// Every file below `folder`, relative to it, sorted; none where it does not exist.
fn files_below(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let (mut found, mut pending) = (Vec::new(), vec![PathBuf::new()]);
    while let Some(below) = pending.pop() {
        let entries = match std::fs::read_dir(folder.join(&below)) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => continue,
            entries => entries?,
        };
        for entry in entries {
            let entry = entry?;
            let path = below.join(entry.file_name());
            if entry.file_type()?.is_dir() { pending.push(path) } else { found.push(path) }
        }
    }
    found.sort();
    Ok(found)
}

/// The traces among `files` without a scene, by the scene name they imply.
fn orphans(suite: &Suite, files: &[PathBuf]) -> BTreeSet<String> {
    let names = files.iter().filter_map(|file| trace_name(file));
    names.filter(|name| suite.cases.iter().all(|case| case.id != *name)).collect()
}

/// The scene name that `file`, relative to the folder, belongs to; `None` if it is not a trace.
fn trace_name(file: &Path) -> Option<String> {
    TraceFormat::of_path(file)?;
    let parts: Vec<String> =
        file.with_extension("").iter().map(|part| part.to_string_lossy().into_owned()).collect();
    Some(parts.join("/"))
}
