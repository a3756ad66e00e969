//! Ignores tests whose requirements this machine lacks.

use std::process::{Command, Stdio};

use proc_macro::TokenStream;

/// Marks a test as ignored if a shell command fails when the test is compiled: `#[needs("c++ --version")]` above
/// `#[test]`. The command runs in the folder of the test's package. The test is listed as `ignored, needs c++ --version`.
///
/// # Panics
/// If the argument is not a string without escapes.
#[proc_macro_attribute]
pub fn needs(command: TokenStream, test: TokenStream) -> TokenStream {
    let literal = command.to_string();
    let command = literal.strip_prefix('"').and_then(|text| text.strip_suffix('"'));
    let command = command.filter(|text| !text.contains('\\')).expect("a string without escapes");
    let mut shell = Command::new("sh");
    shell.args(["-c", command]).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let folder = std::env::var_os("CARGO_MANIFEST_DIR").expect("cargo names the package's folder");
    if shell.current_dir(folder).status().is_ok_and(|status| status.success()) {
        return test;
    }
    let mut ignored: TokenStream =
        format!("#[ignore = \"needs {command}\"]").parse().expect("an attribute");
    ignored.extend(test);
    ignored
}
