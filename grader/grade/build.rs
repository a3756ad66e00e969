//! Tells `grade` its version and its commit.
//!
//! Packs the scenes, the assignments, the rubric and the oracle into the program: the size of a text, the text and eight
//! planes, all deflated. The text is a sequence of files, each a line with its path and its size, and its bytes. A trace has in
//! place of the size its number of rows, a colon, and the way each column is predicted as a letter; in place of the bytes
//! its header. Its numbers are in the planes, one for each byte of a number (`src/packed.rs`). `src/installed.rs` extracts all.

use std::fs;
use std::path::{Path, PathBuf};

#[path = "../../simulator/commit.rs"]
mod commit;
#[path = "src/packed.rs"]
mod packed;

/// Paths, relative to the repository, that are packed.
const SUITE: [&str; 4] = ["assets", "extracreditassets", "expected", "docs/stability-expected.csv"];

fn main() {
    commit::tell();
    println!("cargo:rerun-if-changed=src/packed.rs");
    pack(Path::new("../.."));
}

/// Packs the suite; nothing where it is not next to the source, as where a platform builds it.
fn pack(root: &Path) {
    let mut text = Vec::new();
    let mut planes: [Vec<u8>; 8] = Default::default();
    let parts = SUITE.map(|part| root.join(part));
    for part in parts.clone().into_iter().filter(|_| parts.iter().all(|part| part.exists())) {
        println!("cargo:rerun-if-changed={}", part.display());
        for file in files(part) {
            let bytes = fs::read(&file).expect("a file of the suite");
            let path = file.strip_prefix(root).expect("a path of the repository").display();
            if let Some((header, columns)) = trace(&bytes) {
                let ways = pack_trace(&columns, &mut planes);
                text.extend(format!("{path} {}:{ways}\n{header}\n", columns[0].len()).into_bytes());
            } else {
                text.extend(format!("{path} {}\n", bytes.len()).into_bytes());
                text.extend(bytes);
            }
        }
    }
    let packed = [format!("{}\n", text.len()).into_bytes(), text, planes.concat()].concat();
    let folder = std::env::var_os("OUT_DIR").expect("the folder of the build");
    let deflated = miniz_oxide::deflate::compress_to_vec_zlib(&packed, 9);
    fs::write(Path::new(&folder).join("suite"), deflated).expect("a file of the build");
}

/// The header of a trace, and its columns without the number of the row; `None` where they do not give back its text.
fn trace(bytes: &[u8]) -> Option<(&str, Vec<Vec<f64>>)> {
    let (header, rows) = str::from_utf8(bytes).ok()?.split_once('\n')?;
    let mut columns = vec![Vec::new(); header.split(',').count().checked_sub(1)?];
    for row in rows.lines() {
        for (column, number) in columns.iter_mut().zip(row.split(',').skip(1)) {
            column.push(number.parse().ok()?);
        }
    }
    let is_rectangle = columns.iter().all(|column| column.len() == columns[0].len());
    (!columns.is_empty() && is_rectangle && packed::text(header, &columns) == bytes)
        .then_some((header, columns))
}

/// Appends the numbers of a trace to the planes; the way that each column is predicted.
fn pack_trace(columns: &[Vec<f64>], planes: &mut [Vec<u8>; 8]) -> String {
    let dt = columns[0].get(1).copied().unwrap_or(0.0);
    let mut ways = vec![' '; columns.len()];
    for idx in packed::order(columns.len()) {
        let column = &columns[idx];
        let differences = |way| {
            let velocities = match packed::distance(way) {
                Some(distance) => columns.get(idx + distance)?.as_slice(),
                None => &[],
            };
            let predicted = |row: usize| packed::predict(way, &column[..row], velocities, dt);
            let each = (0..column.len()).map(|row| difference(column[row], predicted(row)));
            Some((each.collect::<Vec<u64>>(), way))
        };
        let bits = |(differences, _): &(Vec<u64>, usize)| -> u32 {
            differences.iter().map(|difference| u64::BITS - difference.leading_zeros()).sum()
        };
        // The time is unpacked first, when no velocity is known.
        let ways_of_column = 0..if idx == 0 { 1 } else { packed::WAYS };
        let (best, way) =
            ways_of_column.filter_map(differences).min_by_key(bits).expect("a polynomial");
        ways[idx] = char::from(b'a' + way as u8);
        for difference in best {
            for (plane, byte) in planes.iter_mut().zip(difference.to_le_bytes()) {
                plane.push(byte);
            }
        }
    }
    ways.into_iter().collect()
}

/// The distance of a number from its prediction in doubles, its sign in the last bit.
fn difference(value: f64, predicted: f64) -> u64 {
    let [value, predicted] = [value, predicted].map(|number| packed::rank(number.to_bits()));
    let signed = value.wrapping_sub(predicted).cast_signed();
    (signed << 1 ^ signed >> 63).cast_unsigned()
}

/// The files of a folder, or the file itself, in order.
fn files(path: PathBuf) -> Vec<PathBuf> {
    if path.is_file() {
        return vec![path];
    }
    let entries = fs::read_dir(path).expect("a folder of the suite");
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    paths.sort();
    paths.into_iter().flat_map(files).collect()
}
