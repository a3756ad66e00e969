//! `grade needs`: shows the buffers of each scene, and the extra cost of the general code path.

use studies::needs;

use crate::args::SuiteArgs;
use crate::output::print;
use crate::stop::{Exit, Stop};

pub(super) fn run(suite: &SuiteArgs, only: &[String]) -> Result<Exit, Stop> {
    let mut inputs = suite.read()?;
    inputs.suite.keep_only(only).map_err(Stop::bad_input)?;
    let mut all = Vec::new();
    // Sequential: parallel runs would distort the measured times.
    for case in &inputs.suite.cases {
        all.push(needs::measure(&case.id, &case.scene).map_err(Stop::bad_input)?);
    }
    let mut bytes = Vec::new();
    ::studies::report::needs::write(&mut bytes, &all, None).map_err(Stop::fault)?;
    print(&bytes)?;
    let is_pass = all.iter().all(|need| need.excess.is_empty());
    Ok(if is_pass { Exit::Passed } else { Exit::Failed })
}
