//! Helpers shared by the tests.

use std::path::Path;
use std::process::{Command, Output};

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
