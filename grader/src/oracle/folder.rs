//! Writes a folder of scenes with their oracle, as a whole or not at all.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::{fs, io};

use scene::ParseOptions;

use super::regenerate::{FolderLocation, at, stage};
use super::{Acceptance, Origin, RegenerateError, Staged};
use crate::rubric::Rubric;
use crate::suite::{Section, Suite};

/// The folders of the scenes of a suite, below its root.
pub const SECTIONS: [(Section, &str); 2] =
    [(Section::Required, "assets"), (Section::ExtraCredit, "extracreditassets")];

/// The folder of the traces, below the root of a suite.
pub const EXPECTED: &str = "expected";

/// The files of a scene, the scene file first: path below the section's folder, and content.
#[derive(Debug, Clone, PartialEq)]
pub struct Files(pub Vec<(PathBuf, String)>);

impl Files {
    /// Writes the files below a folder.
    ///
    /// # Errors
    /// If one cannot be written.
    pub fn write(&self, folder: &Path) -> io::Result<()> {
        for (path, text) in &self.0 {
            let path = folder.join(path);
            if let Some(parent) = path.parent() {
                fs::create_dir_all(parent)?;
            }
            let mut file = fs::File::create(&path)?;
            file.write_all(text.as_bytes())?;
            file.sync_all()?;
        }
        Ok(())
    }
}

/// Checks that nothing is in the way of a new folder.
///
/// # Errors
/// If there is something of that name, or no folder that it can be in.
pub fn check_free(folder: &Path) -> Result<(), RegenerateError> {
    // A dangling link is in the way, too.
    match fs::symlink_metadata(folder) {
        Ok(_) => Err(RegenerateError::Exists { path: folder.to_path_buf() }),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            FolderLocation::of(folder).map(drop)
        }
        Err(error) => Err(at(folder)(error)),
    }
}

/// Writes scenes, each in the folder of its section, with their traces, envelopes and manifest, into a new folder.
///
/// # Errors
/// If the folder exists, a file cannot be written, or a scene cannot be read or simulated.
pub fn write(
    folder: &Path,
    scenes: &[(Section, &Files)],
    origin: &Origin,
) -> Result<(), RegenerateError> {
    check_free(folder)?;
    let place = FolderLocation::of(folder)?;
    let staging = stage(&place)?;
    let sections = SECTIONS.map(|(section, name)| (section, staging.path().join(name)));
    for (section, files) in scenes {
        let (_, below) =
            sections.iter().find(|(known, _)| known == section).unwrap_or(&sections[0]);
        files.write(below).map_err(at(below))?;
    }
    let options = ParseOptions { strict: true, ..ParseOptions::default() };
    let suite = Suite::load(&sections, &options)?;
    let expected = staging.path().join(EXPECTED);
    let staged = Staged::make(&suite, &expected, &Rubric::default(), Acceptance::All)?;
    staged.replace(Acceptance::All, origin)?;
    check_free(folder)?;
    fs::rename(staging.path(), place.path()).map_err(at(folder))?;
    // The staged folder was renamed: nothing is left to remove.
    let _ = staging.keep();
    Ok(())
}
