//! Ignores tests whose requirements this machine lacks.

use std::path::Path;
use std::process::{Command, Stdio};

use proc_macro::{Ident, TokenStream, TokenTree};

/// Marks a test as ignored if a shell command fails when the test is compiled: `#[needs("command -v c++")]` above
/// `#[test]`. The command runs in the root of the workspace. The test is listed as `ignored, needs command -v c++`.
///
/// `ci/long.sh` runs ignored tests whose names begin with `long_`. Such a test loses this beginning.
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
    let package = std::env::var_os("CARGO_MANIFEST_DIR").expect("cargo names the package's folder");
    let mut folders = Path::new(&package).ancestors();
    let root = folders.find(|folder| folder.join("Cargo.lock").exists()).expect("a workspace");
    if shell.current_dir(root).status().is_ok_and(|status| status.success()) {
        return test;
    }
    let mut ignored: TokenStream =
        format!("#[ignore = \"needs {command}\"]").parse().expect("an attribute");
    let mut tokens = test.into_iter().peekable();
    while let Some(token) = tokens.next() {
        let is_ignore = |token: &TokenTree| token.to_string().starts_with("[ignore");
        if tokens.peek().is_some_and(is_ignore) {
            tokens.next();
            continue;
        }
        let name = token.to_string();
        ignored.extend([match name.strip_prefix("long_") {
            Some(name) => Ident::new(name, token.span()).into(),
            None => token,
        }]);
    }
    ignored
}
