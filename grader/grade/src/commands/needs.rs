//! `grade needs`: shows the buffers of each scene, and the extra cost of the general code path.

use clap::Args;
use studies::needs;

use crate::args::{OnlyArgs, SuiteArgs};
use crate::output::{print, written};
use crate::stop::{Exit, Stop};

/// Show the buffers that each scene needs, and the extra cost of the general code path
#[derive(Args)]
#[command(after_help = "\
Examples:
  grade needs --only Spring")]
pub(crate) struct NeedsArgs {
    #[command(flatten)]
    only: OnlyArgs,

    #[command(flatten)]
    suite: SuiteArgs,
}

impl NeedsArgs {
    pub(crate) fn run(&self) -> Result<Exit, Stop> {
        let mut inputs = self.suite.read()?;
        inputs.suite.keep_only(&self.only.only).map_err(Stop::bad_input)?;
        let mut all = Vec::new();
        // Sequential: parallel runs would distort the measured times.
        for case in &inputs.suite.cases {
            all.push(needs::measure(&case.id, &case.scene).map_err(Stop::bad_input)?);
        }
        print(&written(|out| studies::report::needs::write(out, &all, None))?)?;
        Ok(Exit::of(all.iter().all(|need| need.excess.is_empty())))
    }
}
