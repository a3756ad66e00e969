//! `expected/manifest.toml`: the origin of each trace.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::OracleError;
use crate::boundary::own_file::read_text;
use crate::suite::Case;

/// The manifest's file name.
pub const FILE_NAME: &str = "manifest.toml";

/// Version of the manifest's format.
pub const FORMAT: u32 = 2;

/// Maximum size of a manifest, in MiB.
const MAX_MEBIBYTES: u64 = 64;

/// The program that makes the traces.
pub const SIMULATOR: &str = "Spring Oracle";

/// Its version.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// A manifest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Version of this format.
    pub format: u32,
    /// The program that made the traces.
    pub simulator: String,
    /// Its version.
    pub version: String,
    /// SHA-256 of the file of envelopes.
    pub envelopes_sha256: String,
    /// One entry a trace, by scene.
    #[serde(rename = "trace", default)]
    pub traces: Vec<ManifestEntry>,
}

/// The part of a manifest that every version of its format has.
#[derive(Deserialize)]
struct Version {
    format: u32,
}

/// One trace.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ManifestEntry {
    /// The scene's name; the trace is `<scene>.csv`.
    pub scene: String,
    /// SHA-256 of the scene file.
    pub scene_sha256: String,
    /// SHA-256 of the trace file.
    pub trace_sha256: String,
    /// The integrator.
    pub integrator: String,
    /// The time step, in seconds.
    pub time_step: f64,
    /// The number of steps.
    pub steps: u64,
    /// The commit of the grader that made the trace, followed by `-modified` if its sources differed, if known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub commit: Option<String>,
    /// Operating system and architecture on which it was made, if known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub platform: Option<String>,
}

impl ManifestEntry {
    /// The entry of `case`, whose trace has this hash.
    pub(super) fn of(case: &Case, trace_sha256: String) -> Self {
        Self {
            scene: case.id.clone(),
            scene_sha256: case.scene_hash.clone(),
            trace_sha256,
            integrator: case.scene.integrator.name.to_owned(),
            time_step: case.scene.time_step,
            steps: case.scene.n_steps(),
            commit: None,
            platform: None,
        }
    }
}

impl Manifest {
    /// Reads the manifest of a folder of traces, if there is one.
    ///
    /// # Errors
    /// If it cannot be read, or is not valid.
    pub fn load(folder: &Path) -> Result<Option<Self>, OracleError> {
        let path = folder.join(FILE_NAME);
        let text = match read_text(&path, MAX_MEBIBYTES) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(source) => return Err(OracleError::Unreadable { path, source }),
        };
        let invalid = |message: String| OracleError::Invalid { path: path.clone(), message };
        let unreadable = |error: toml::de::Error| invalid(error.to_string().trim_end().to_owned());
        // The format first: another version has other fields.
        let Version { format } = toml::from_str(&text).map_err(unreadable)?;
        if format < FORMAT {
            let message = format!(
                "its format is {format}, that of an earlier version of grade; this version needs {FORMAT}"
            );
            return Err(invalid(message));
        }
        if format > FORMAT {
            return Err(invalid(format!(
                "its format is {format}, but this version of grade knows up to {FORMAT}"
            )));
        }
        toml::from_str(&text).map(Some).map_err(unreadable)
    }

    /// Whether this version of this program made the traces.
    pub fn is_of_this_version(&self) -> bool {
        self.simulator == SIMULATOR && self.version == VERSION
    }

    /// The entry of a scene.
    pub fn entry(&self, scene: &str) -> Option<&ManifestEntry> {
        self.traces.iter().find(|entry| entry.scene == scene)
    }
}
