//! A folder of traces: `<group>/<scene>.csv` or `.bin`, as the scenes are laid out.

use std::path::Path;

use simulator::trace::{self, Shape};

use super::{StateSource, failure_of};
use crate::suite::{Case, find_trace};
use crate::verdict::Failure;

/// Opens the trace of a scene.
pub(super) fn open(folder: &Path, case: &Case) -> Result<Box<dyn StateSource>, Failure> {
    let Some((path, format)) = find_trace(folder, &case.id) else {
        let detail = format!("neither {0}.csv nor {0}.bin exists", folder.join(&case.id).display());
        return Err(Failure::NoOutput { detail });
    };
    let reader = trace::open(&path, format, Shape::of(&case.scene)).map_err(failure_of)?;
    Ok(Box::new(reader))
}
