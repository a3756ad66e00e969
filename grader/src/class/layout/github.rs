//! Clones of GitHub repositories, one a student: `ASSIGNMENT-LOGIN`, with `.git` in each.
//!
//! The assignment is what all names begin with, up to a hyphen. A folder of clones that is called `ASSIGNMENT` or
//! `ASSIGNMENT-submissions`, as by GitHub's own tool, decides where logins have hyphens too.

use super::arrange::Person;
use super::{ClassFolder, FolderEntry, HandInParts, Reading};

pub(super) fn read(folder: &ClassFolder, is_named: bool) -> Reading {
    let is_clone = |entry: &&FolderEntry| {
        let git = || folder.path.join(&entry.file_name).join(".git");
        entry.is_folder && (is_named || git().symlink_metadata().is_ok())
    };
    let (clones, others): (Vec<_>, Vec<_>) = folder.entries.iter().partition(is_clone);
    let names: Vec<&str> = clones.iter().map(|entry| &*entry.name).collect();
    let prefix = prefix(&names, &folder.path.file_name().unwrap_or_default().to_string_lossy());
    let rest = others.iter().map(|entry| entry.passed_over("it is no clone of a repository"));
    let hand_in = |entry: &&FolderEntry| {
        let login = &entry.name[prefix..];
        let mut found = HandInParts::new(login, entry.whole());
        found.facts.people = vec![Person { login: login.to_owned(), ..Person::default() }];
        found
    };
    Reading { hand_ins: clones.iter().map(hand_in).collect(), rest: rest.collect() }
}

/// The number of bytes before the logins.
fn prefix(names: &[&str], folder: &str) -> usize {
    let of_folder = format!("{}-", folder.strip_suffix("-submissions").unwrap_or(folder));
    if names.iter().all(|name| name.len() > of_folder.len() && name.starts_with(&of_folder)) {
        return of_folder.len();
    }
    let Some((first, others)) = names.split_first().filter(|(_, others)| !others.is_empty()) else {
        return 0;
    };
    let shared = |start: &&str| {
        others.iter().all(|name| name.starts_with(*start) && name.len() > start.len())
    };
    let hyphens = first.char_indices().filter(|(_, character)| *character == '-');
    let starts = hyphens.map(|(place, _)| &first[..=place]).filter(shared);
    starts.filter(|start| start.len() < first.len()).map(str::len).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logins_follow_what_all_names_share() {
        for (names, folder, login) in [
            (&["t1m3-ada", "t1m3-bob"][..], "clones", "ada"),
            (&["lab-1-ada", "lab-1-bob-2"], "clones", "ada"),
            (&["t1m3-ada-l", "t1m3-ada-m"], "t1m3-submissions", "ada-l"),
            (&["t1m3-ada"], "t1m3", "ada"),
            (&["ada-l"], "clones", "ada-l"),
            (&["ada", "bob"], "clones", "ada"),
            (&["t1-", "t1-bob"], "clones", "t1-"),
        ] {
            assert_eq!(&names[0][prefix(names, folder)..], login, "{names:?}");
        }
    }
}
