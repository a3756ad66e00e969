//! Arranges the folder of a class that a platform laid out: one folder a student in `hand-ins/` of the results.

use std::path::Path;

use grader::class::layout::{self, Arranged, Layout};
use grader::class::roster::Roster;

use super::save;
use super::setting::refuse_inside;
use crate::stop::{Stop, complain};

/// The arranged folder in the folder of the results, beside the table `hand-ins.csv`.
pub(super) const HAND_INS: &str = "hand-ins";

/// Arranges the class in the folder of the results, and says so; `None` if it is one entry a student.
///
/// # Errors
/// If it cannot be read or copied, or is not in the layout that is named.
pub(super) fn arrange(
    folder: &Path,
    output: &Path,
    named: Option<Layout>,
    roster: Option<&Path>,
) -> Result<Option<Arranged>, Stop> {
    refuse_inside(output, folder)?;
    let roster = roster.map(Roster::load).transpose().map_err(Stop::bad_input)?;
    let to = output.join(HAND_INS);
    let arranged = Arranged::make((folder, to.as_path()), named, roster.as_ref(), false);
    let Some(arranged) = arranged.map_err(Stop::bad_input)? else { return Ok(None) };
    let table = layout::table(&arranged).map_err(Stop::fault)?;
    save(&to.with_extension("csv"), &table)?;
    let (title, count) = (arranged.layout.title(), arranged.hand_ins.len());
    complain("note", format!("hand-ins: {title}, {count} students, in {}", to.display()));
    Ok(Some(arranged))
}
