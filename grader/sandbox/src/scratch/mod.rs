//! Scratch folders: of this user alone, and removed on drop.

#[cfg(not(unix))]
mod elsewhere;
#[cfg(unix)]
mod unix;

#[cfg(not(unix))]
pub use elsewhere::{Scratch, scratch_folder};
#[cfg(unix)]
pub use unix::{Scratch, scratch_folder};
#[cfg(target_os = "linux")]
pub(crate) use unix::{scratch_folder_in_memory, sweep};

/// Prefix of the names of scratch folders.
pub(crate) const PREFIX: &str = "spring-oracle-";

/// Number of random characters after the prefix.
pub(crate) const RANDOM: usize = 16;

/// Whether a path has the name of a scratch folder.
#[cfg(target_os = "linux")]
pub(crate) fn is_scratch(path: &std::path::Path) -> bool {
    path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(PREFIX.as_bytes()))
}

/// The text without the random paths of scratch folders: `/tmp/NAME/scratch/trace.csv` becomes `trace.csv`, and the
/// folder itself `.`.
pub fn without_paths(text: &str) -> String {
    let (mut out, mut rest) = (String::with_capacity(text.len()), text);
    while let Some(start) = rest.find(PREFIX) {
        let (before, found) = rest.split_at(start);
        let after = found[PREFIX.len()..].trim_start_matches(|c: char| c.is_ascii_alphanumeric());
        if found.len() - after.len() < PREFIX.len() + RANDOM || !before.ends_with(['/', '\\']) {
            out += before;
            out += PREFIX;
            rest = &found[PREFIX.len()..];
            continue;
        }
        let ends_path = |c: char| c.is_whitespace() || "\"'`()[]<>=,:;".contains(c);
        out += &before[..before
            .rfind(ends_path)
            .map_or(0, |place| place + before[place..].chars().next().map_or(1, char::len_utf8))];
        let inside = ["/scratch", "/folder"].iter().find_map(|name| after.strip_prefix(name));
        let inside = inside.filter(|inside| !inside.starts_with(|c: char| c.is_alphanumeric()));
        rest = inside.unwrap_or(after);
        match rest.strip_prefix('/') {
            Some(path) if path.starts_with(|c: char| !ends_path(c)) => rest = path,
            _ => out.push('.'),
        }
    }
    out + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_of_scratch_folders_are_not_shown() {
        let at = format!("/tmp/{PREFIX}{}", "a1".repeat(RANDOM / 2));
        for (text, expected) in [
            (format!("{at}/scratch/trace.csv:2: bad"), "trace.csv:2: bad"),
            (format!("File \"{at}/folder/sim.py\", line 1"), "File \"sim.py\", line 1"),
            (format!("cwd={at}/scratch"), "cwd=."),
            (format!("in {at}/scratch/ and {at}: no"), "in ./ and .: no"),
            (format!("{at}/scratchy"), "scratchy"),
            (format!("é{at}/folder/a\n{at}/folder/b"), "a\nb"),
            (format!("my {PREFIX}notes"), "my spring-oracle-notes"),
            (format!("/x/{PREFIX}notes"), "/x/spring-oracle-notes"),
        ] {
            assert_eq!(without_paths(&text), expected, "{text}");
        }
    }
}
