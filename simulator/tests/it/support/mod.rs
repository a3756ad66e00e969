//! Helpers shared by the tests.

pub(crate) mod local_global;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use simulator::scene::{ParseOptions, Scene, find_scene_files, xml};
use simulator::vocabulary;

/// Runs the real `simulate` in `folder`, so that it names files as its user would.
pub(crate) fn simulate(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_simulate"));
    command.args(arguments).current_dir(folder);
    command.output().expect("the binary starts")
}

/// Standard error as text; messages are UTF-8.
pub(crate) fn stderr(output: &Output) -> &str {
    std::str::from_utf8(&output.stderr).expect("messages are UTF-8")
}

/// A scene that is valid and without warnings.
#[track_caller]
pub(crate) fn parse(text: &str) -> Scene {
    let options = ParseOptions { strict: true, ..ParseOptions::default() };
    let parsed = xml::parse(text, "test.xml", &vocabulary(), &options);
    parsed.unwrap_or_else(|error| panic!("{error}\n{text}")).scene
}

/// The shipped scene files.
pub(crate) fn shipped_scenes() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let folders = ["assets", "extracreditassets"].map(|folder| root.join(folder));
    folders.iter().flat_map(|folder| find_scene_files(folder).unwrap()).collect()
}

pub(crate) fn bits(numbers: &[f64]) -> Vec<u64> {
    numbers.iter().map(|number| number.to_bits()).collect()
}

/// The largest magnitude; a NaN if there is one.
pub(crate) fn largest(numbers: impl IntoIterator<Item = f64>) -> f64 {
    numbers
        .into_iter()
        .fold(0.0, |largest, number| if number.abs() <= largest { largest } else { number.abs() })
}

pub(crate) fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    largest(a.iter().zip(b).map(|(a, b)| a - b))
}
