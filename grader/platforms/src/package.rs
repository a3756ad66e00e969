//! Files of a package, and the choice between the built program and its source.

use std::fs;
use std::io;
use std::path::Path;

use grader::boundary::own_file;

/// A file of a package.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PackageFile {
    /// Its path in the package, with `/` between folders.
    pub path: String,
    /// Its content.
    pub bytes: Vec<u8>,
    /// Whether it can be run.
    pub is_program: bool,
}

impl PackageFile {
    /// A file that is read.
    pub fn data(path: impl Into<String>, bytes: impl Into<Vec<u8>>) -> Self {
        Self { path: path.into(), bytes: bytes.into(), is_program: false }
    }

    /// A file that is run.
    pub fn program(path: impl Into<String>, bytes: impl Into<Vec<u8>>) -> Self {
        Self { is_program: true, ..Self::data(path, bytes) }
    }
}

/// Adds the files below a folder that `is_kept` accepts by their path below it, in the order of their names. Links are
/// followed.
///
/// # Errors
/// If a file or folder cannot be read, or a name is not UTF-8.
pub fn add_folder(
    files: &mut Vec<PackageFile>,
    folder: &Path,
    prefix: &str,
    is_kept: &dyn Fn(&str) -> bool,
) -> io::Result<()> {
    add_below(files, (folder, folder), prefix, is_kept)
}

fn add_below(
    files: &mut Vec<PackageFile>,
    (root, folder): (&Path, &Path),
    prefix: &str,
    is_kept: &dyn Fn(&str) -> bool,
) -> io::Result<()> {
    let about = |path: &Path, error: io::Error| {
        io::Error::new(error.kind(), format!("{}: {error}", path.display()))
    };
    let entries = fs::read_dir(folder).map_err(|error| about(folder, error))?;
    let mut paths = entries
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<io::Result<Vec<_>>>()
        .map_err(|error| about(folder, error))?;
    paths.sort();
    for path in paths {
        let below = path.strip_prefix(root).map_err(io::Error::other)?.to_str();
        let below = below.ok_or_else(|| about(&path, io::Error::other("the name is not UTF-8")))?;
        if !is_kept(below) {
            continue;
        }
        if path.is_dir() {
            add_below(files, (root, &path), prefix, is_kept)?;
        } else {
            let bytes = own_file::read(&path).map_err(|error| about(&path, error))?;
            files.push(PackageFile::data(format!("{prefix}{below}"), bytes));
        }
    }
    Ok(())
}

/// Why a program may not start on another system.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Unportable {
    /// It is no program of 64-bit Linux on this kind of processor.
    #[error("it is no ELF program for x86-64")]
    OtherSystem,
    /// It needs a newer C library.
    #[error("it needs glibc 2.{needed}, and the platform has 2.{offered}")]
    NewerLibrary {
        /// The minor version that it needs.
        needed: u32,
        /// The minor version of the platform.
        offered: u32,
    },
}

/// Checks that a program starts on x86-64 Linux with glibc `2.offered`: a static one needs no version of it, and any
/// other names those that it needs.
///
/// # Errors
/// If it may not start there.
pub fn check_portable(program: &[u8], offered: u32) -> Result<(), Unportable> {
    // Magic number, 64 bits, little endian; machine 62 is x86-64.
    if !program.starts_with(b"\x7fELF\x02\x01") || program.get(18..20) != Some(&[62, 0]) {
        return Err(Unportable::OtherSystem);
    }
    let name = b"GLIBC_2.";
    let versions = program.windows(name.len() + 3).filter(|window| window.starts_with(name));
    let minor = |window: &[u8]| {
        let digits = window[name.len()..].iter().take_while(|byte| byte.is_ascii_digit());
        digits.fold(0, |value, digit| 10 * value + u32::from(digit - b'0'))
    };
    match versions.map(minor).max() {
        Some(needed) if needed > offered => Err(Unportable::NewerLibrary { needed, offered }),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn newest_required_library_decides_portability() {
        let program = |machine: u8, names: &str| {
            let mut bytes = b"\x7fELF\x02\x01".to_vec();
            bytes.resize(18, 0);
            bytes.extend([machine, 0]);
            bytes.extend(names.as_bytes());
            bytes.extend([0; 4]);
            bytes
        };
        assert_eq!(check_portable(&program(62, ""), 35), Ok(()));
        assert_eq!(check_portable(&program(62, "GLIBC_2.2.5\0GLIBC_2.35"), 35), Ok(()));
        let newer = Unportable::NewerLibrary { needed: 36, offered: 35 };
        assert_eq!(check_portable(&program(62, "GLIBC_2.4\0GLIBC_2.36"), 35), Err(newer));
        assert_eq!(check_portable(&program(183, ""), 35), Err(Unportable::OtherSystem));
        assert_eq!(check_portable(b"#!/bin/sh\n", 35), Err(Unportable::OtherSystem));
    }
}
