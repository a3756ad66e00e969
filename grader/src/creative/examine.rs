//! The part of the checks that runs in the sandbox: parses a scene, runs it, and looks for overlaps.

use std::path::Path;
use std::time::Duration;

use scene::error::JsonProblem;
use scene::error::{Problem, SceneError};
use scene::{ParseOptions, Scene, json};
use serde::{Deserialize, Serialize};
use simulator::vocabulary;

use super::motion::Motion;
use super::{overlap, run};

/// Findings of a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Examined {
    /// JSON that is not meant to be a scene.
    NoScene,
    /// A scene in JSON without its mesh.
    NeedsMesh {
        /// The path of the mesh from the scene's folder.
        mesh: String,
        /// File, line and column that name it.
        place: String,
    },
    /// No scene, and why.
    Malformed(String),
    /// A scene.
    Scene(Facts),
}

/// Findings of a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Facts {
    /// Its elements, or its first warning.
    pub format: Result<String, String>,
    /// Tags of its forces, each once.
    pub forces: Vec<String>,
    /// Its integrator, as it is spelt.
    pub integrator: String,
    /// Coordinates of a particle.
    pub dimension: usize,
    /// Its own description.
    pub description: Option<String>,
    /// How the runs ended.
    pub run: Result<String, String>,
    /// Whether particles overlap.
    pub overlap: Result<String, String>,
}

/// Examines the scene in a file of the current folder. Each of its runs has the time `limit`.
pub(super) fn examine(path: &Path, limit: Duration) -> (Examined, Option<(Scene, Motion)>) {
    if json::is_json(path) && !json::is_scene(path) {
        return (Examined::NoScene, None);
    }
    let options = ParseOptions { confined: true, ..ParseOptions::default() };
    let parsed = match scene::load(path, &vocabulary(), &options) {
        Ok(parsed) => parsed,
        Err(error) => return (refusal(&error), None),
    };
    let scene = parsed.scene;
    let format = match parsed.warnings.first() {
        None => Ok(contents(&scene)),
        Some(warning) => Err(format!("{warning}\n(number of warnings: {})", parsed.n_warnings)),
    };
    let mut forces: Vec<String> =
        scene.forces.iter().map(|force| force.schema.tag.to_owned()).collect();
    forces.sort_unstable();
    forces.dedup();
    let (run, motion) = run::check(&scene, limit);
    let facts = Facts {
        format,
        forces,
        integrator: parsed.integrator_spelling,
        dimension: scene.dimension.count(),
        description: scene.description.clone(),
        run,
        overlap: overlap::check(&scene, &motion),
    };
    (Examined::Scene(facts), Some((scene, motion)))
}

fn refusal(error: &SceneError) -> Examined {
    let Problem::Json(JsonProblem::MeshUnreadable { mesh, source }) = &*error.problem else {
        return Examined::Malformed(error.to_string());
    };
    if source.kind() != std::io::ErrorKind::NotFound {
        return Examined::Malformed(error.to_string());
    }
    let location = error.location.unwrap_or_default();
    let place = format!("{}:{}:{}", error.file, location.line, location.column);
    Examined::NeedsMesh { mesh: mesh.clone(), place }
}

/// The elements of a scene.
fn contents(scene: &Scene) -> String {
    let count = |number: usize, what: &str| {
        format!("{number} {what}{}", if number == 1 { "" } else { "s" })
    };
    format!(
        "{}, {}, {}; {} in {}D, {} s in steps of {} s",
        count(scene.particles.len(), "particle"),
        count(scene.edges.len(), "edge"),
        count(scene.forces.len(), "force"),
        scene.integrator.name,
        scene.dimension.count(),
        scene.duration,
        scene.time_step,
    )
}
