//! Scenes in JSON with OBJ meshes: their models and their errors.
//!
//! In the scenes of these files the sign ¶ marks the place that a message must name. It is taken out
//! before the scenes are written.

mod assignment;
mod model;
mod refusals;

use std::fs;
use std::path::Path;

use scene::error::SceneError;
use scene::{Overrides, ParseOptions, Parsed, Scene};
use simulator::vocabulary;
use tempfile::TempDir;

/// A square with a tail, and one of every key. Nothing is wrong with it.
const JSON: &str = r#"{
  "obj": "mesh.obj",
  "k": 100,
  "m": 2,
  "b": [1, 3],
  "png": "cloth.png",
  "wind": true
}
"#;

const OBJ: &str = "# a square with a tail
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 2 0
f 1 2 3 4
l 4 5
";

/// An integrator that takes every scene.
const INTEGRATOR: &str = "linearized-implicit-euler";

fn folder_of(json: impl AsRef<[u8]>, obj: impl AsRef<[u8]>) -> TempDir {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("scene.json"), json).unwrap();
    fs::write(folder.path().join("mesh.obj"), obj).unwrap();
    folder
}

fn load(path: &Path, strict: bool) -> Result<Parsed, SceneError> {
    let vocabulary = vocabulary();
    let integrator = vocabulary.integrator(INTEGRATOR);
    let overrides = Overrides { integrator, ..Overrides::default() };
    scene::load(path, &vocabulary, &ParseOptions { strict, overrides, ..ParseOptions::default() })
}

fn masses(scene: &Scene) -> Vec<f64> {
    scene.particles.iter().map(|particle| particle.mass).collect()
}

fn pins(scene: &Scene) -> Vec<usize> {
    let pinned = |(particle, of): (usize, &scene::Particle)| of.fixed.then_some(particle);
    scene.particles.iter().enumerate().filter_map(pinned).collect()
}
