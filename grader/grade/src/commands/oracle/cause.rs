//! Why a trace changed, if its scene file did: the attributes that differ from the file that the old trace was made from.
//!
//! The manifest holds the hash of that file. Git's history may hold the file itself, and the hash proves it.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use grader::boundary::own_file;
use grader::suite::{Case, hash_bytes};
use scene::xml::edit;

/// Maximum number of commits that are searched.
const COMMITS: &str = "200";

/// Maximum number of differences that are named.
const SHOWN: usize = 6;

/// An attribute: the element's tag, its number among those of the same tag, and the attribute's name.
type Attribute = (String, usize, String);

/// Changes of a scene's file since it had this hash, a line each; empty if git does not know the old file, or
/// the scene has several files.
pub(super) fn changes(case: &Case, old_hash: &str) -> Vec<String> {
    let [file] = case.files.as_slice() else { return Vec::new() };
    let Some(old) = old_text(&file.path, old_hash) else { return Vec::new() };
    let Ok(new) = own_file::text(&file.path) else { return Vec::new() };
    let mut lines = differences(&old, &new);
    let more = lines.len().saturating_sub(SHOWN);
    lines.truncate(SHOWN);
    if more > 0 {
        lines.push(format!("… and {more} more"));
    }
    lines
}

/// The file as it was when it had this hash, from git's history.
fn old_text(path: &Path, hash: &str) -> Option<String> {
    let (folder, name) = (path.parent()?, path.file_name()?.to_str()?);
    let git = |arguments: &[&str]| {
        let output = Command::new("git").current_dir(folder).args(arguments).output().ok()?;
        output.status.success().then_some(output.stdout)
    };
    let commits = git(&["log", "-n", COMMITS, "--format=%H", "--", name])?;
    let commits = String::from_utf8(commits).ok()?;
    let versions =
        commits.lines().filter_map(|commit| git(&["show", &format!("{commit}:./{name}")]));
    let mut versions = versions.filter(|bytes| hash_bytes(bytes) == hash);
    String::from_utf8(versions.next()?).ok()
}

/// The attributes that differ; for files that are not XML, the first line that differs.
fn differences(old: &str, new: &str) -> Vec<String> {
    let (Some(old_values), Some(new_values)) = (attributes(old), attributes(new)) else {
        let (mut old, mut new) = (old.lines(), new.lines());
        let differs = (1..).map_while(|line| match (old.next(), new.next()) {
            (None, None) => None,
            (old, new) => Some((line, old.unwrap_or_default(), new.unwrap_or_default())),
        });
        let first = differs.filter(|(_, old, new)| old != new).take(1);
        return first.map(|(line, old, new)| format!("line {line}: {old} -> {new}")).collect();
    };
    let mut lines = Vec::new();
    for (attribute, new) in &new_values {
        let (tag, number, name) = attribute;
        match old_values.get(attribute) {
            Some(old) if old == new => {}
            Some(old) => lines.push(format!("{tag} {number}: {name} {old} -> {new}")),
            None => lines.push(format!("{tag} {number}: {name} {new} is new")),
        }
    }
    let gone = old_values.iter().filter(|(attribute, _)| !new_values.contains_key(*attribute));
    lines.extend(
        gone.map(|((tag, number, name), old)| format!("{tag} {number}: {name} {old} is gone")),
    );
    if lines.is_empty() {
        lines.push("no attribute: order, comments or white space".to_owned());
    }
    lines
}

/// The attributes of a scene; `None` if it is not XML.
fn attributes(text: &str) -> Option<BTreeMap<Attribute, String>> {
    let mut values = BTreeMap::new();
    edit::edit(text, |edit::AttributeValue { tag, number, name, value }| {
        values.insert((tag.to_owned(), number, name.to_owned()), value.to_owned());
        None
    })?;
    (!values.is_empty()).then_some(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changed_new_and_missing_attributes_are_named() {
        let old = "<scene><particle m=\"1\" px=\"0\"/><particle m=\"2\" px=\"1\"/></scene>";
        let new = "<scene><particle m=\"1\" px=\"0\"/><particle m=\"3\" py=\"1\"/></scene>";
        let lines = ["particle 1: m 2 -> 3", "particle 1: py 1 is new", "particle 1: px 1 is gone"];
        assert_eq!(differences(old, new), lines);
        assert_eq!(differences(old, &format!("<!-- a -->{old}")).len(), 1);
        assert_eq!(differences("{\n1}", "{\n2}"), ["line 2: 1} -> 2}"]);
    }
}
