//! Helpers shared by the tests.

pub(crate) mod bending;
pub(crate) mod failing;
pub(crate) mod local_global;
pub(crate) mod shared;

use std::fs;
use std::path::Path;

/// Whether tests rewrite the documents that they write.
pub(crate) fn update_docs() -> bool {
    std::env::var_os("UPDATE_DOCS").is_some_and(|value| value == "1")
}

/// Asserts that the section with this heading of a page of docs/ ends with the table, or rewrites it.
pub(crate) fn assert_table(page: &str, heading: &str, table: &str, command: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs").join(page);
    let text = fs::read_to_string(&path).unwrap().replace("\r\n", "\n");
    let start = text.find(heading).expect("the section stands there") + heading.len();
    let end = text[start..].find("\n##").map_or(text.len(), |length| start + length);
    let first = start + text[start..end].find("\n| ").unwrap_or(end - start);
    if update_docs() {
        fs::write(&path, format!("{}{table}{}", &text[..first], &text[end..])).unwrap();
        return;
    }
    assert!(text[first..end] == *table, "docs/{page} is out of date; `UPDATE_DOCS=1 {command}`");
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
