//! Arranges the folder or archive of a class that a platform laid out: one folder a student in `hand-ins/` of the results.

use std::path::Path;

use grader::class::layout::{self, Arranged, Layout};
use grader::class::roster::Roster;
use grader::rubric::Rubric;
use grader::submission::received::{Form, Received};
use sandbox::Sandbox;

use super::setting::refuse_inside;
use super::{ClassArgs, save};
use crate::stop::{Stop, complain};
use crate::submission::open_sandbox;

/// The arranged folder in the folder of the results, with the table `hand-ins.csv`.
pub(super) const HAND_INS: &str = "hand-ins";

/// The files of a class, unpacked if it is an archive.
pub(super) struct ClassFiles {
    received: Option<Received>,
}

impl ClassFiles {
    /// Opens a folder, or unpacks an archive in the sandbox.
    ///
    /// # Errors
    /// If it cannot be unpacked.
    pub(super) fn open(path: &Path, unprotected: bool) -> Result<Self, Stop> {
        if Form::of(path).ok() != Some(Form::Archive) {
            return Ok(Self { received: None });
        }
        let sandbox = if unprotected {
            Sandbox::Unprotected
        } else {
            open_sandbox(false, &Rubric::default())?
        };
        let help = |error| {
            format!("{}: {error}\n  help: unpack it yourself, and name the folder", path.display())
        };
        let received = Received::open(path, &sandbox);
        Ok(Self { received: Some(received.map_err(|error| Stop::bad_input(help(error)))?) })
    }

    /// Arranges them in the new folder `to`, unless they are a folder with one entry a student.
    pub(super) fn arrange(
        &self,
        path: &Path,
        to: &Path,
        named: Option<Layout>,
        roster: Option<&Roster>,
    ) -> Result<Option<Arranged>, Stop> {
        let from = self.received.as_ref().map_or(path, Received::folder);
        Arranged::make((from, to), named, roster, self.received.is_some()).map_err(Stop::bad_input)
    }
}

/// Arranges the class in the folder of the results, and says so; `None` if it is a folder with one entry a student.
///
/// # Errors
/// If it cannot be read or copied, or is not in the layout that is named.
pub(super) fn arrange(
    folder: &Path,
    output: &Path,
    named: Option<Layout>,
    args: &ClassArgs,
) -> Result<Option<Arranged>, Stop> {
    refuse_inside(output, folder)?;
    let roster =
        args.gradebook.roster.as_deref().map(Roster::load).transpose().map_err(Stop::bad_input)?;
    let to = output.join(HAND_INS);
    let files = ClassFiles::open(folder, args.run.unprotected)?;
    let Some(arranged) = files.arrange(folder, &to, named, roster.as_ref())? else {
        return Ok(None);
    };
    let table = layout::table(&arranged).map_err(Stop::fault)?;
    save(&to.with_extension("csv"), &table)?;
    let (title, count) = (arranged.layout.title(), arranged.hand_ins.len());
    complain("note", format!("hand-ins: {title}, {count} students, in {}", to.display()));
    Ok(Some(arranged))
}
