//! A folder of traces, `<group>/<scene>.csv` or `.bin`, laid out as the scenes are.

use std::path::{Path, PathBuf};

use scene::trace::{self, State, TraceFormat, TraceReader};

use super::StateSource;
use crate::suite::{Case, find_trace};
use crate::verdict::Failure;

/// Opens the trace of a scene.
pub(super) fn open(folder: &Path, case: &Case) -> Result<Box<dyn StateSource>, Failure> {
    let (path, format) = find_trace(folder, &case.id).map_err(Failure::NoTrace)?;
    if leads_out(&path, folder) {
        let reason = format!("{} is a link that leads out of the submission", path.display());
        return Err(Failure::Unreadable { reason: reason.into() });
    }
    let reader = trace::open_of_scene(&path, format, &case.scene).map_err(Failure::of_trace)?;
    Ok(Box::new(TraceFile { reader, path, format, states: 0 }))
}

/// Whether a link leads out of the folder, for example to the oracle or to another submission.
fn leads_out(path: &Path, folder: &Path) -> bool {
    match (scene::input::real_path(path), scene::input::real_path(folder)) {
        (Ok(path), Ok(folder)) => !path.starts_with(folder),
        // Opening a missing file reports it.
        _ => false,
    }
}

struct TraceFile {
    reader: Box<dyn TraceReader>,
    path: PathBuf,
    format: TraceFormat,
    /// Number of states read so far.
    states: u64,
}

impl StateSource for TraceFile {
    fn read(&mut self, state: &mut State) -> Result<bool, Failure> {
        let is_state = StateSource::read(&mut self.reader, state)?;
        self.states += u64::from(is_state);
        Ok(is_state)
    }

    fn has_velocities(&self) -> bool {
        self.reader.has_velocities()
    }

    fn location(&self) -> Option<String> {
        let path = self.path.display();
        Some(match self.format {
            // Lines count from 1, and the first is the header.
            TraceFormat::Csv => format!("{path}:{}", self.states + 1),
            TraceFormat::Fosssim => format!("{path}: record {}", self.states.saturating_sub(1)),
        })
    }
}
