//! Provenance of a grading, from its inputs on disk.

use std::io;
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use grader::class::fingerprint::Fingerprint;
use grader::grading::provenance::{GradingOptions, Provenance, SceneHashes, SubmissionOrigin};
use grader::oracle::Oracle;
use grader::suite::{Case, hash_file};

use crate::args::{JudgeArgs, RunArgs};
use crate::inputs::Inputs;
use crate::stop::Stop;

/// The commit that this program was built from, if known.
pub(super) const COMMIT: Option<&str> = option_env!("COMMIT");

/// The platform that this program was built for.
pub(super) fn platform() -> String {
    format!("{} {}", std::env::consts::OS, std::env::consts::ARCH)
}

/// The options of a grading.
pub(super) fn options(judge: &JudgeArgs, run: &RunArgs, whole: bool) -> GradingOptions {
    let criteria = judge.criteria.and_then(|criteria| criteria.to_possible_value());
    GradingOptions {
        whole,
        jacobians: !judge.no_jacobians,
        criteria: criteria.map(|criteria| criteria.get_name().to_owned()),
        limits: run.limit.clone(),
        readable: run.readable.iter().map(|path| path.display().to_string()).collect(),
        unprotected: run.unprotected,
    }
}

/// Provenance of a grading with these inputs; of the built-in simulator, without a path.
pub(super) fn provenance(
    inputs: &Inputs,
    oracle: &Oracle,
    options: GradingOptions,
    submission: Option<&Path>,
) -> Result<Provenance, Stop> {
    let hash = |path: Option<&PathBuf>| {
        let hash = |path: &PathBuf| {
            let failed = |error: io::Error| Stop::fault(format!("{}: {error}", path.display()));
            hash_file(path).map_err(failed)
        };
        path.map(hash).transpose()
    };
    let scene = |case: &Case| {
        let (scene, trace) = (case.scene_hash.clone(), oracle.trace_hash(case));
        (case.id.clone(), SceneHashes { scene, trace })
    };
    let assignment = inputs.assignment.as_ref().map(|assignment| assignment.path().to_path_buf());
    let manifest = oracle.manifest.as_ref();
    let hidden = inputs.hidden.as_ref().filter(|_| options.whole);
    Ok(Provenance {
        commit: COMMIT.map(str::to_owned),
        platform: platform(),
        rubric: hash(inputs.rubric_path.as_ref())?,
        pack: inputs.pack.as_ref().map(|pack| pack.hash().to_owned()),
        assignment: hash(assignment.as_ref())?,
        envelopes: manifest.map(|manifest| manifest.envelopes_sha256.clone()),
        scenes: inputs.suite.cases.iter().map(scene).collect(),
        hidden: hidden.map(|(hidden, _)| {
            let mut hash = Fingerprint::default();
            hash.hidden(hidden);
            hash.finish()
        }),
        submission: submission.map(origin),
        options,
    })
}

/// The submission at `path`.
pub(super) fn origin(path: &Path) -> SubmissionOrigin {
    let mut files = Fingerprint::default();
    let is_read = files.submission(path).is_ok();
    let path = path.display().to_string();
    SubmissionOrigin { path, files: is_read.then(|| files.finish()) }
}
