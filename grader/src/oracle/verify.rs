//! Whether the stored traces still match their scenes and their manifest.

use std::path::Path;

use super::Oracle;
use crate::suite::{Suite, find_trace};
use crate::verdict::Fault;

/// Something that does not match.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Finding {
    /// There is no manifest.
    #[error("there is no manifest; make it with `grade oracle regenerate`")]
    NoManifest,
    /// A scene and its trace do not go together.
    #[error("{scene}: {fault}")]
    Scene {
        /// The scene.
        scene: String,
        /// Why not.
        fault: Fault,
    },
    /// A trace has no scene.
    #[error(
        "{trace}: there is no such scene; remove the trace with `grade oracle regenerate --accept`"
    )]
    Orphan {
        /// The name its scene would have.
        trace: String,
    },
    /// The folder cannot be listed.
    #[error("the folder cannot be listed: {detail}")]
    Unreadable {
        /// Why.
        detail: String,
    },
}

/// Compares the folder with the suite; what does not match, by scene.
pub fn verify(suite: &Suite, oracle: &Oracle) -> Vec<Finding> {
    let mut findings = Vec::new();
    if oracle.manifest.is_none() {
        findings.push(Finding::NoManifest);
    }
    for case in &suite.cases {
        let checked = match find_trace(&oracle.folder, &case.id) {
            Some((path, _)) => oracle.check(case, &path),
            None => {
                let trace = format!("{}.csv", oracle.folder.join(&case.id).display());
                Err(Fault::NoOracle { trace })
            }
        };
        if let Err(fault) = checked {
            findings.push(Finding::Scene { scene: case.id.clone(), fault });
        }
    }
    findings.extend(orphans(suite, &oracle.folder));
    findings
}

fn orphans(suite: &Suite, folder: &Path) -> Vec<Finding> {
    let files = match super::files_below(folder) {
        Ok(files) => files,
        Err(error) => return vec![Finding::Unreadable { detail: error.to_string() }],
    };
    let names = files.iter().filter_map(|file| super::trace_name(file));
    let orphans = names.filter(|name| suite.cases.iter().all(|case| case.id != *name));
    orphans.map(|trace| Finding::Orphan { trace }).collect()
}
