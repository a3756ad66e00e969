//! The scenes below a folder of hand-ins, found without following a link.
//!
//! Each entry of the folder is a hand-in with separate limits ([`hand_in`](crate::submission::hand_in)). A refused
//! part is an entry with the reason, and hides nothing of the others.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

use scene::json;

use crate::boundary::printed;
use crate::submission::hand_in::{HandIn, HandInError, WalkStep};

/// The most scenes of one hand-in.
const MAX_SCENES: usize = 200;

/// A scene, or a file or folder that is not read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// Its path from the folder.
    pub below: PathBuf,
    /// Why it is not read.
    pub refused: Option<String>,
}

/// Finds the scenes below a folder, by path: `*.xml` and `*.json`. If some of a hand-in are in folders called `Creative`, as
/// the hand-outs ask, its others are left out.
///
/// # Errors
/// If the folder itself cannot be listed.
pub fn find(folder: &Path) -> Result<Vec<Entry>, HandInError> {
    let failed = |source| HandInError::Unreadable {
        path: printed::text(&folder.display().to_string()),
        source,
    };
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).map_err(failed)? {
        names.push(entry.map_err(failed)?.file_name());
    }
    names.sort();
    let mut hand_ins: Vec<Vec<Entry>> = names.iter().map(|name| find_in(folder, name)).collect();
    for (name, found) in names.iter().zip(&mut hand_ins) {
        // Hand-ins hold other scenes too.
        let is_scene = |entry: &Entry| is_named_as_scene(&entry.below);
        if found.iter().any(|entry| is_scene(entry) && is_in_creative(&entry.below)) {
            found.retain(|entry| !is_scene(entry) || is_in_creative(&entry.below));
        }
        if found.len() > MAX_SCENES {
            let reason =
                format!("it holds {} scenes; the first {MAX_SCENES} are shown", found.len());
            found.truncate(MAX_SCENES);
            found.push(Entry { below: name.into(), refused: Some(reason) });
        }
    }
    Ok(hand_ins.into_iter().flatten().collect())
}

fn find_in(folder: &Path, name: &OsStr) -> Vec<Entry> {
    let mut found = Vec::new();
    let mut add = |path: &OsStr, refused: Option<String>| {
        let mut below = PathBuf::from(name);
        if !path.is_empty() {
            below.push(path);
        }
        if refused.is_none() && !is_named_as_scene(&below) {
            return;
        }
        found.push(Entry { below, refused });
    };
    let walked = HandIn::unchecked(&folder.join(name)).and_then(|hand_in| {
        hand_in.walk_past(&mut |path, step| {
            let is_named = is_named_as_scene(Path::new(if path.is_empty() { name } else { path }));
            match step {
                Ok(WalkStep::File(_)) => add(path, None),
                Ok(WalkStep::Link(_)) if is_named => {
                    let reason = "is a link, not a regular file\nhelp: replace it by the file";
                    add(path, Some(reason.to_owned()));
                }
                Ok(_) => {}
                Err(HandInError::Closed { .. }) if !is_named => {}
                Err(HandInError::TooLarge { .. }) if path.is_empty() && !is_named => {}
                Err(error @ (HandInError::TooLarge { .. } | HandInError::TooMany { .. })) => {
                    return Err(error);
                }
                Err(error) => add(path, Some(error.to_string())),
            }
            Ok(())
        })
    });
    if let Err(error) = walked {
        add("".as_ref(), Some(error.to_string()));
    }
    found
}

fn is_named_as_scene(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "xml") || json::is_json(path)
}

/// Whether a file is below a folder called `Creative`.
fn is_in_creative(path: &Path) -> bool {
    let folders = path.parent().into_iter().flat_map(Path::components);
    folders.into_iter().any(|folder| folder.as_os_str().eq_ignore_ascii_case("creative"))
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn refused_scene_hides_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        for name in [
            "ada/Creative/ada_t1m2.xml",
            "ada/assets/other.xml",
            "bob/bob_t1m2.xml",
            "eve/Creative/eve_t1m2.xml",
        ] {
            fs::create_dir_all(path.join(name).parent().unwrap()).unwrap();
            fs::write(path.join(name), "<scene>").unwrap();
        }
        symlink("/nowhere", path.join("eve/Creative/dangling.xml")).unwrap();
        symlink("/etc", path.join("eve/etc")).unwrap();
        let pipe = path.join("eve/Creative/pipe.json");
        rustix::fs::mkfifoat(rustix::fs::CWD, pipe, rustix::fs::Mode::RWXU).unwrap();
        fs::create_dir(path.join("large")).unwrap();
        for name in ["film.avi", "large/film.avi"] {
            fs::File::create(path.join(name)).unwrap().set_len(1 << 40).unwrap();
        }
        for number in 0..=MAX_SCENES {
            fs::create_dir_all(path.join("mallory/creative")).unwrap();
            fs::write(path.join(format!("mallory/creative/{number:04}.xml")), "").unwrap();
        }
        let found = find(path).unwrap();
        let (shown, refused): (Vec<&Entry>, Vec<&Entry>) =
            found.iter().partition(|entry| entry.refused.is_none());
        assert_eq!(shown.len(), 3 + MAX_SCENES);
        assert_eq!(shown[0].below, Path::new("ada/Creative/ada_t1m2.xml"));
        assert_eq!(shown[1].below, Path::new("bob/bob_t1m2.xml"));
        assert_eq!(shown[2].below, Path::new("eve/Creative/eve_t1m2.xml"));
        let reasons: Vec<(&str, &str)> = refused
            .iter()
            .map(|entry| (entry.below.to_str().unwrap(), entry.refused.as_deref().unwrap()))
            .collect();
        for ((below, reason), (expected, begins)) in reasons.iter().zip([
            ("eve/Creative/dangling.xml", "is a link"),
            ("eve/Creative/pipe.json", "Creative/pipe.json: is a pipe"),
            ("large", "the files are larger"),
            ("mallory", "it holds 201 scenes"),
        ]) {
            assert!(*below == expected && reason.starts_with(begins), "{below}: {reason}");
        }
        assert_eq!(reasons.len(), 4, "{reasons:?}");
    }
}
