//! Inputs for the fuzzers: named regressions in `seeds/<target>/`, and the rest of the corpus in `seeds.tar`.

use std::fs;
use std::path::Path;

/// The inputs of a target, with their names.
pub(crate) fn seeds(target: &str) -> Vec<(String, Vec<u8>)> {
    let fuzz = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().map(|path| path.join("ci/fuzz"));
    let fuzz = fuzz.into_iter().find(|path| path.is_dir()).expect("ci/fuzz above this crate");
    let mut seeds = Vec::new();
    for entry in fs::read_dir(fuzz.join("seeds").join(target)).into_iter().flatten() {
        let path = entry.expect("an entry").path();
        seeds.push((path.display().to_string(), fs::read(&path).expect("a seed")));
    }
    let archive = fs::read(fuzz.join("seeds.tar")).expect("the corpus");
    let mut rest = &archive[..];
    // Each file: a header of 512 bytes with its name and its size in octal digits, and its content in blocks of 512 bytes.
    while rest.first().is_some_and(|first| *first != 0) {
        let (header, blocks) = rest.split_at(512);
        let text = |from, to| String::from_utf8_lossy(&header[from..to]).into_owned();
        let name = text(0, 100).trim_end_matches('\0').to_owned();
        let size = usize::from_str_radix(&text(124, 135), 8).expect("a size");
        if name.split_once('/').is_some_and(|(folder, _)| folder == target) {
            seeds.push((name, blocks[..size].to_vec()));
        }
        rest = &blocks[size.div_ceil(512) * 512..];
    }
    seeds
}
