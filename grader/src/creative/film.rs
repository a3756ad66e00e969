//! The film beside a scene.

use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use crate::door::Door;

/// Formats of films: extension, and what the file has at this offset.
const FORMATS: [(&str, usize, &[u8]); 4] = [
    ("avi", 8, b"AVI "),
    ("gif", 0, b"GIF8"),
    ("mp4", 4, b"ftyp"),
    ("webm", 0, b"\x1a\x45\xdf\xa3"),
];

/// Finds the film of the scene in this file: the one of its name, or the only film where this is the only scene.
pub(super) fn check(scene: &Path) -> Result<String, String> {
    let folder = match scene.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let unreadable = |error: io::Error| format!("{}: {error}", folder.display());
    let mut films: Vec<PathBuf> = Vec::new();
    let mut n_scenes = 0;
    for entry in fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        n_scenes += usize::from(extension(&path) == "xml");
        // A pipe would be waited for.
        if format(&path).is_some() && path.is_file() {
            films.push(path);
        }
    }
    films.sort();
    let own = films.iter().find(|film| film.file_stem() == scene.file_stem());
    let only = films.first().filter(|_| films.len() == 1 && n_scenes == 1);
    let Some(film) = own.or(only) else {
        let stem = scene.file_stem().unwrap_or_default().to_string_lossy();
        return Err(format!(
            "no film called {stem} in {}\nhelp: write one with `simulate {} --film {stem}.mp4`",
            folder.display(),
            scene.display()
        ));
    };
    let name = film.file_name().unwrap_or_default().to_string_lossy();
    let size = is_film(film).map_err(|error| format!("{name}: {error}"))?;
    Ok(format!("{name}, {} KB", size.div_ceil(1000)))
}

fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

fn format(path: &Path) -> Option<&'static (&'static str, usize, &'static [u8])> {
    let extension = extension(path);
    FORMATS.iter().find(|(known, ..)| *known == extension)
}

/// The size of a film in bytes, if it starts as its format does.
fn is_film(path: &Path) -> Result<u64, String> {
    let Some((extension, offset, mark)) = format(path) else { return Err("no film".to_owned()) };
    let mut file = Door::Film.open(path).map_err(|error| error.to_string())?;
    let size = file.get_ref().metadata().map_err(|error| error.to_string())?.len();
    let mut head = Vec::new();
    file.read_to_end(&mut head).map_err(|error| error.to_string())?;
    match head.get(*offset..).is_some_and(|rest| rest.starts_with(mark)) {
        true => Ok(size),
        false => Err(format!("the file is not in the format of .{extension}")),
    }
}
