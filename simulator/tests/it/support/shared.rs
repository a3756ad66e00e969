//! Helpers shared with the tests of the program `simulate`.

use std::path::{Path, PathBuf};

use scene::{ParseOptions, Scene, find_scene_files, xml};
use simulator::vocabulary;

/// A scene that is valid and without warnings.
#[track_caller]
pub(crate) fn parse(text: &str) -> Scene {
    let options = ParseOptions { strict: true, ..ParseOptions::default() };
    let parsed = xml::parse(text, "test.xml", &vocabulary(), &options);
    parsed.unwrap_or_else(|error| panic!("{error}\n{text}")).scene
}

/// The root of the repository.
pub(crate) fn root() -> &'static Path {
    let mut folders = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    folders.find(|folder| folder.join("assets").is_dir()).unwrap()
}

/// The scenes of the fast mass-spring assignment, which are not part of the repository.
pub(crate) fn assignment_scenes() -> Vec<PathBuf> {
    let beside = root().join("../shared/jacobson");
    let folder = std::env::var_os("SPRING_ORACLE_JACOBSON").map_or(beside, PathBuf::from);
    let scenes = find_scene_files(&folder).unwrap();
    assert!(scenes.len() >= 4);
    scenes
}

/// The shipped scene files.
pub(crate) fn shipped_scenes() -> Vec<PathBuf> {
    let folders = ["assets", "extracreditassets"].map(|folder| root().join(folder));
    folders.iter().flat_map(|folder| find_scene_files(folder).unwrap()).collect()
}

pub(crate) fn bits(numbers: &[f64]) -> Vec<u64> {
    numbers.iter().map(|number| number.to_bits()).collect()
}
