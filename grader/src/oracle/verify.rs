//! Verifies that the stored traces match their scenes and their manifest.

use std::collections::{BTreeMap, BTreeSet};

use super::Oracle;
use super::manifest::{ManifestEntry, SIMULATOR, VERSION};
use crate::suite::{Case, Suite};
use crate::verdict::Fault;

/// A mismatch.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Mismatch {
    /// There is no manifest.
    #[error("there is no manifest; make it with `grade oracle regenerate`")]
    NoManifest,
    /// The envelopes cannot be used.
    #[error("{detail}")]
    Envelopes {
        /// Why.
        detail: String,
    },
    /// A trace does not match its scene.
    #[error("{scene}: {fault}")]
    Scene {
        /// The scene.
        scene: String,
        /// Why.
        fault: Fault,
    },
    /// The manifest was written by another program or another version.
    #[error(
        "the traces were made by {simulator} {version}, but this is {SIMULATOR} {VERSION}; remake them with `grade oracle regenerate`"
    )]
    OtherVersion {
        /// The program.
        simulator: String,
        /// Its version.
        version: String,
    },
    /// The manifest disagrees with the scene.
    #[error(
        "{scene}: the manifest records the {fact} {recorded}, but the scene's is {actual}; restore the manifest or run `grade oracle regenerate`"
    )]
    Entry {
        /// The scene.
        scene: String,
        /// The property of the scene.
        fact: &'static str,
        /// Its value in the manifest.
        recorded: String,
        /// Its value in the scene.
        actual: String,
    },
    /// The manifest has several entries for one scene.
    #[error(
        "{scene}: {count} entries in the manifest; restore the manifest or run `grade oracle regenerate`"
    )]
    Duplicate {
        /// The scene.
        scene: String,
        /// Their number.
        count: usize,
    },
    /// The manifest has an entry for a scene that does not exist, and there is no trace either.
    #[error(
        "{scene}: in the manifest, but there is no such scene; restore the manifest or run `grade oracle regenerate`"
    )]
    NoScene {
        /// The name of the scene.
        scene: String,
    },
    /// A trace has no scene.
    #[error("{trace}: trace without a scene; remove it with `grade oracle regenerate --accept`")]
    Orphan {
        /// The scene name that the trace implies.
        trace: String,
    },
    /// The folder cannot be listed.
    #[error("the folder cannot be listed: {detail}")]
    Unreadable {
        /// Why.
        detail: String,
    },
}

/// Compares the folder with the suite. Returns the mismatches by scene.
pub fn verify(suite: &Suite, oracle: &Oracle) -> Vec<Mismatch> {
    let mut findings = Vec::new();
    match &oracle.manifest {
        None => findings.push(Mismatch::NoManifest),
        Some(manifest) if !manifest.is_of_this_version() => {
            let (simulator, version) = (manifest.simulator.clone(), manifest.version.clone());
            findings.push(Mismatch::OtherVersion { simulator, version });
        }
        Some(_) => {}
    }
    if let Err(detail) = &oracle.envelopes {
        findings.push(Mismatch::Envelopes { detail: detail.clone() });
    }
    for case in &suite.cases {
        let checked = oracle.find(case).and_then(|(path, _)| oracle.check_trace(case, &path));
        let edited = checked == Err(Fault::StaleOracle);
        if let Err(fault) = checked {
            findings.push(Mismatch::Scene { scene: case.id.clone(), fault });
        }
        // An edited scene, whose finding is above, may well differ in these properties.
        let entry = oracle.manifest.as_ref().and_then(|manifest| manifest.entry(&case.id));
        if let (Some(entry), false) = (entry, edited) {
            findings.extend(differences(case, entry));
        }
    }
    let orphans = match super::files_below(&oracle.folder) {
        Ok(files) => super::orphans(suite, &files),
        Err(error) => {
            findings.push(Mismatch::Unreadable { detail: error.to_string() });
            BTreeSet::new()
        }
    };
    findings.extend(odd_entries(suite, oracle, &orphans));
    findings.extend(orphans.into_iter().map(|trace| Mismatch::Orphan { trace }));
    findings
}

/// Properties of a scene that the manifest records differently.
fn differences(case: &Case, entry: &ManifestEntry) -> Vec<Mismatch> {
    let is = ManifestEntry::of(case, String::new());
    let step = |value: f64| format!("{value} s");
    let facts = [
        ("integrator", entry.integrator.clone(), is.integrator),
        ("time step", step(entry.time_step), step(is.time_step)),
        ("number of steps", entry.steps.to_string(), is.steps.to_string()),
    ];
    let differing = facts.into_iter().filter(|(_, recorded, actual)| recorded != actual);
    let finding = |(fact, recorded, actual)| Mismatch::Entry {
        scene: case.id.clone(),
        fact,
        recorded,
        actual,
    };
    differing.map(finding).collect()
}

/// Manifest entries without a scene, unless their trace is reported, and scenes with several entries.
fn odd_entries(suite: &Suite, oracle: &Oracle, orphans: &BTreeSet<String>) -> Vec<Mismatch> {
    let mut counts = BTreeMap::new();
    for entry in oracle.manifest.iter().flat_map(|manifest| &manifest.traces) {
        *counts.entry(entry.scene.as_str()).or_insert(0_usize) += 1;
    }
    let mut findings = Vec::new();
    for (name, count) in counts {
        let scene = name.to_owned();
        if count > 1 {
            findings.push(Mismatch::Duplicate { scene: scene.clone(), count });
        }
        if suite.cases.iter().all(|case| case.id != name) && !orphans.contains(name) {
            findings.push(Mismatch::NoScene { scene });
        }
    }
    findings
}
