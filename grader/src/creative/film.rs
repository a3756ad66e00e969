//! The film of a scene, in the same folder.

use std::ffi::OsString;
use std::path::Path;

use crate::boundary::door::Door;
use crate::boundary::printed;
use crate::submission::hand_in::place::Place;

/// Formats of films: extension, and what the file has at this offset.
const FORMATS: [(&str, usize, &[u8]); 4] = [
    ("avi", 8, b"AVI "),
    ("gif", 0, b"GIF8"),
    ("mp4", 4, b"ftyp"),
    ("webm", 0, b"\x1a\x45\xdf\xa3"),
];

/// Finds the film of the scene in this file: the one of its name, or the only film where this is the only scene. No more
/// than the first bytes of a film are read.
pub(super) fn check(place: &Place, scene: &Path) -> Result<String, String> {
    let folder = match scene.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let path = |name: &OsString| Path::new(name).to_path_buf();
    let names = place.siblings().map_err(|error| error.to_string())?;
    let n_scenes = names.iter().filter(|name| extension(&path(name)) == "xml").count();
    let films: Vec<&OsString> = names.iter().filter(|name| format(&path(name)).is_some()).collect();
    let own = films.iter().find(|film| path(film).file_stem() == scene.file_stem());
    let only = films.first().filter(|_| films.len() == 1 && n_scenes == 1);
    let Some(film) = own.or(only) else {
        let stem = printed::text(&scene.file_stem().unwrap_or_default().to_string_lossy());
        return Err(format!(
            "no film called {stem} in {}\nhelp: write one with `simulate SCENE --film FILE.mp4`, called as the scene",
            printed::text(&folder.display().to_string()),
        ));
    };
    let (size, head) =
        place.head(film, Door::Film.facts().limit.bytes()).map_err(|error| error.to_string())?;
    let name = printed::path(film.as_encoded_bytes());
    let path = path(film);
    if starts_as_film(&path, &head) {
        Ok(format!("{name}, {} KB", size.div_ceil(1000)))
    } else {
        Err(format!("{name}: the file is not in the format of .{}", extension(&path)))
    }
}

/// Whether a file with this name and start is a film in the format of its extension.
pub fn starts_as_film(name: &Path, head: &[u8]) -> bool {
    format(name).is_some_and(|(_, offset, mark)| {
        head.get(*offset..).is_some_and(|rest| rest.starts_with(mark))
    })
}

fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

fn format(path: &Path) -> Option<&'static (&'static str, usize, &'static [u8])> {
    let extension = extension(path);
    FORMATS.iter().find(|(known, ..)| *known == extension)
}
