//! `expected/envelopes.toml`: the envelope of each scene.

use std::collections::HashMap;
use std::path::Path;

use serde::Deserialize;

use crate::boundary::own_file::read_text;
use crate::compare::calibration::{Envelope, StoredEnvelope};
use crate::suite::hash_bytes;

/// The file's name.
pub(super) const FILE_NAME: &str = "envelopes.toml";

/// Maximum size of the file, in MiB.
const MAX_MEBIBYTES: u64 = 64;

/// Envelopes by scene name.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Envelopes(HashMap<String, Envelope>);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EnvelopesFile {
    #[serde(rename = "scene", default)]
    scenes: Vec<StoredEnvelope>,
}

impl Envelopes {
    /// Reads the envelopes of a folder of traces. `sha256` is the hash of the file in the manifest.
    ///
    /// # Errors
    /// If the file cannot be read or has another hash. The text says what is wrong and what to do.
    pub(super) fn load(folder: &Path, sha256: &str) -> Result<Self, String> {
        let path = folder.join(FILE_NAME);
        let restore = "restore it or run `grade oracle regenerate`";
        let text = read_text(&path, MAX_MEBIBYTES)
            .map_err(|error| format!("{}: cannot be read: {error}; {restore}", path.display()))?;
        if hash_bytes(text.as_bytes()) != sha256 {
            let path = path.display();
            return Err(format!("{path} does not match the manifest; {restore}"));
        }
        let broken = |detail: &str| format!("{}: {detail}; {restore}", path.display());
        let file: EnvelopesFile =
            toml::from_str(&text).map_err(|error| broken(error.to_string().trim_end()))?;
        let entry = |stored: StoredEnvelope| {
            let envelope = stored.envelope();
            let message = || {
                broken(&format!(
                    "the lists of {} must be sorted, finite and of equal length",
                    stored.name
                ))
            };
            Ok((stored.name.clone(), envelope.ok_or_else(message)?))
        };
        Ok(Self(file.scenes.into_iter().map(entry).collect::<Result<_, String>>()?))
    }

    /// The envelope of this scene.
    pub(super) fn find(&self, scene: &str) -> Option<&Envelope> {
        self.0.get(scene)
    }
}

/// The text of the file.
pub(super) fn text(scenes: &[StoredEnvelope]) -> String {
    let entries: Vec<String> = scenes.iter().map(StoredEnvelope::entry).collect();
    let entries = entries.join("\n");
    format!("# Made by `grade oracle regenerate`; not to be edited by hand.\n\n{entries}")
}
