//! The scenes, the assignments, the rubric and the oracle that come with the program, for work far from their source.
//!
//! They are packed in the program by `build.rs`. The first command that needs them extracts them to a folder of the user,
//! named by a hash of the pack: `spring-oracle/suite/HASH` in the cache folder (`XDG_CACHE_HOME`, else `~/.cache`, on Windows
//! `LOCALAPPDATA`), else `spring-oracle-USER` in the folder of temporary files. A folder appears whole, by renaming. It is compared with the
//! pack each time that it is used, and replaced where it differs, so that no verdict depends on who wrote to it.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use grader::boundary::own_file;
use grader::suite::hash_bytes;
use miniz_oxide::inflate::decompress_to_vec_zlib;
use sandbox::files::{own_folder, temporary, user};

use crate::packed;
use crate::stop::{Stop, complain};

static PACK: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/suite"));

/// Number of hexadecimal digits of the hash.
const HASH: usize = 16;

/// Number of attempts to put the folder in its place, against concurrent processes.
const ATTEMPTS: usize = 5;

/// The folder in this process, once it was needed.
static FOLDER: OnceLock<PathBuf> = OnceLock::new();

/// The user's folder of files that can be made again, if there is one.
pub(super) fn cache() -> Option<PathBuf> {
    let absolute =
        |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let home = || Some(absolute("HOME")?.join(".cache"));
    // The last one is that of Windows.
    absolute("XDG_CACHE_HOME").or_else(home).or_else(|| absolute("LOCALAPPDATA"))
}

/// The folder with the program's own assets/, extracreditassets/ and expected/.
///
/// # Errors
/// If the program has none, or no folder can be written.
pub(super) fn folder() -> Result<&'static Path, Stop> {
    if let Some(folder) = FOLDER.get() {
        return Ok(folder);
    }
    let pack = decompress_to_vec_zlib(PACK)
        .map_err(|error| Stop::fault(format!("the scenes of this program: {error}")))?;
    let files =
        files(&pack).ok_or_else(|| Stop::fault("the scenes of this program cannot be read"))?;
    if files.is_empty() {
        return Err(Stop::bad_input(
            "no assets/ folder in the current folder or its parents, and this program was built without scenes\n  help: run \
             grade in the folder of the scenes, or name a folder with --root or --assets",
        ));
    }
    let hash = &hash_bytes(PACK)[..HASH];
    let own = temporary().join(format!("spring-oracle-{}", user()));
    let cached = cache().map(|cache| cache.join("spring-oracle/suite"));
    let mut refused = String::new();
    for home in cached.into_iter().chain([own]) {
        match place(&home, hash, &files) {
            Ok(folder) => {
                complain(
                    "note",
                    format!("scenes and oracle are those of this program, in {}", folder.display()),
                );
                return Ok(FOLDER.get_or_init(|| folder));
            }
            Err(error) => refused += &format!("\n  {}: {error}", home.display()),
        }
    }
    Err(Stop::bad_input(format!(
        "the scenes of this program cannot be extracted:{refused}\n  help: name a folder of your own by XDG_CACHE_HOME, or a \
         folder of scenes with --root"
    )))
}

/// Refuses a change of what comes with the program.
///
/// # Errors
/// If the path is in its folder.
pub(super) fn refuse_change(path: &Path) -> Result<(), Stop> {
    match FOLDER.get() {
        Some(folder) if path.starts_with(folder) => Err(Stop::bad_input(format!(
            "{}: comes with the program, and does not change\n  help: run grade in a folder with assets/, or name one with \
             --root",
            path.display()
        ))),
        _ => Ok(()),
    }
}

/// The files of the pack, by path; `None` if it is damaged.
fn files(pack: &[u8]) -> Option<BTreeMap<&str, Vec<u8>>> {
    let (size, rest) = line(pack)?;
    let (mut text, planes) = rest.split_at_checked(size.parse().ok()?)?;
    let n_numbers = planes.len() / 8;
    let mut numbers = (0..n_numbers).map(|idx| {
        u64::from_le_bytes(std::array::from_fn(|plane| planes[plane * n_numbers + idx]))
    });
    let mut files = BTreeMap::new();
    while !text.is_empty() {
        let (first, rest) = line(text)?;
        let (path, size) = first.rsplit_once(' ')?;
        let (bytes, rest) = if let Some((rows, ways)) = size.split_once(':') {
            let (header, rest) = line(rest)?;
            (trace(header, rows.parse().ok()?, ways.as_bytes(), &mut numbers)?, rest)
        } else {
            let (bytes, rest) = rest.split_at_checked(size.parse().ok()?)?;
            (bytes.to_vec(), rest)
        };
        files.insert(path, bytes);
        text = rest;
    }
    (numbers.len() == 0).then_some(files)
}

/// The first line, and the rest.
fn line(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let end = bytes.iter().position(|byte| *byte == b'\n')?;
    Some((str::from_utf8(&bytes[..end]).ok()?, &bytes[end + 1..]))
}

/// The text of a trace, from the differences of its numbers from what they are predicted to be.
fn trace(
    header: &str,
    n_rows: usize,
    ways: &[u8],
    differences: &mut impl Iterator<Item = u64>,
) -> Option<Vec<u8>> {
    let mut columns = vec![Vec::new(); ways.len()];
    for idx in packed::order(ways.len()) {
        let way = ways[idx].checked_sub(b'a').map(usize::from).filter(|way| *way < packed::WAYS)?;
        let dt = columns[0].get(1).copied().unwrap_or(0.0);
        let mut column = Vec::with_capacity(n_rows);
        let velocities = match packed::distance(way) {
            Some(distance) => columns.get(idx + distance)?.as_slice(),
            None => &[],
        };
        for _ in 0..n_rows {
            let predicted = packed::predict(way, &column, velocities, dt);
            column.push(restored(differences.next()?, predicted));
        }
        columns[idx] = column;
    }
    Some(packed::text(header, &columns))
}

/// The number at a distance from its prediction, in doubles, whose sign is in the last bit.
fn restored(difference: u64, predicted: f64) -> f64 {
    let signed = (difference >> 1) ^ (difference & 1).wrapping_neg();
    f64::from_bits(packed::rank(packed::rank(predicted.to_bits()).wrapping_add(signed)))
}

/// The folder of this name in `home`, with these files and no others.
fn place(home: &Path, name: &str, files: &BTreeMap<&str, Vec<u8>>) -> io::Result<PathBuf> {
    own_folder(home)?;
    let folder = home.join(name);
    if holds(&folder, files) {
        return Ok(folder);
    }
    let new = tempfile::tempdir_in(home)?;
    let filled = new.path().join(name);
    for (path, bytes) in files {
        let path = filled.join(path);
        fs::create_dir_all(path.parent().unwrap_or(home))?;
        fs::write(path, bytes)?;
    }
    for _ in 0..ATTEMPTS {
        // One that differs makes way.
        if fs::rename(&filled, &folder).is_ok() || holds(&folder, files) {
            return Ok(folder);
        }
        let _ = fs::rename(&folder, tempfile::tempdir_in(new.path())?.path().join(name));
    }
    fs::rename(&filled, &folder).map(|()| folder)
}

/// Whether a folder has these files, and no others.
fn holds(folder: &Path, files: &BTreeMap<&str, Vec<u8>>) -> bool {
    let is_same = |(path, bytes): (&&str, &Vec<u8>)| {
        own_file::read(&folder.join(path)).is_ok_and(|read| read == *bytes)
    };
    count(folder).is_ok_and(|count| count == files.len()) && files.iter().all(is_same)
}

/// The number of files in a folder and those below it.
fn count(folder: &Path) -> io::Result<usize> {
    let mut sum = 0;
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        sum += if entry.file_type()?.is_dir() { count(&entry.path())? } else { 1 };
    }
    Ok(sum)
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::{MetadataExt, PermissionsExt};

    use super::*;

    #[test]
    fn extracted_folder_is_compared_and_replaced() {
        let home = tempfile::tempdir().unwrap();
        let files = BTreeMap::from([("a/b", b"1".to_vec()), ("c", b"2".to_vec())]);
        let place = || place(&home.path().join("suite"), "x", &files).unwrap();
        let folder = place();
        assert_eq!(fs::read(folder.join("a/b")).unwrap(), b"1");
        let made = fs::metadata(folder.join("c")).unwrap().ino();
        assert_eq!(fs::metadata(place().join("c")).unwrap().ino(), made, "used again");
        fs::write(folder.join("c"), "3").unwrap();
        assert_eq!(fs::read(place().join("c")).unwrap(), b"2");
        fs::write(folder.join("a/d"), "more").unwrap();
        assert!(!place().join("a/d").exists());
        fs::remove_file(folder.join("c")).unwrap();
        assert!(place().join("c").exists());
        assert_eq!(fs::read_dir(home.path().join("suite")).unwrap().count(), 1, "nothing is left");
    }

    #[test]
    fn folder_that_others_may_write_to_is_refused() {
        let home = tempfile::tempdir().unwrap();
        fs::set_permissions(home.path(), fs::Permissions::from_mode(0o777)).unwrap();
        assert!(place(home.path(), "x", &BTreeMap::new()).is_err());
    }

    #[test]
    fn pack_is_the_suite_of_the_repository() {
        let pack = decompress_to_vec_zlib(PACK).unwrap();
        let files = files(&pack).unwrap();
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let all = ["assets", "extracreditassets", "expected"]
            .map(|part| count(&root.join(part)).unwrap());
        assert_eq!(files.len(), all.iter().sum::<usize>() + 1);
        assert!(files.iter().all(|(path, bytes)| fs::read(root.join(path)).unwrap() == *bytes));
        assert!(super::files(&pack[..pack.len() - 1]).is_none());
    }
}
