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

/// The shipped scene files.
pub(crate) fn shipped_scenes() -> Vec<PathBuf> {
    let mut folders = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    let root = folders.find(|folder| folder.join("assets").is_dir()).unwrap();
    let folders = ["assets", "extracreditassets"].map(|folder| root.join(folder));
    folders.iter().flat_map(|folder| find_scene_files(folder).unwrap()).collect()
}

pub(crate) fn bits(numbers: &[f64]) -> Vec<u64> {
    numbers.iter().map(|number| number.to_bits()).collect()
}
