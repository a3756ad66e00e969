//! `grade protection`: what protects this machine from submissions.

use std::path::PathBuf;

use clap::Args;
use sandbox::Protection;

use crate::args::SuiteArgs;
use crate::inputs::Judging;
use crate::output::print;
use crate::stop::{Exit, Stop};
use crate::submission::{check, check_secrets, strongest};

/// Show which protections from submissions this system offers, and check that the rubric's are among them
#[derive(Args)]
#[command(after_help = "\
Examples:
  grade protection
  grade protection --rubric rubric.toml

Exit codes: 0 programs would be run; 2 none would, or none on the hidden scenes.")]
pub(crate) struct ProtectionArgs {
    /// Folder of hidden scenes [default: the rubric's folder]
    #[arg(long, value_name = "DIR")]
    hidden: Option<PathBuf>,

    #[command(flatten)]
    suite: SuiteArgs,
}

impl ProtectionArgs {
    pub(crate) fn run(&self) -> Result<Exit, Stop> {
        let judging = Judging { hidden: self.hidden.as_deref(), ..Judging::default() };
        let inputs = self.suite.read_for(&judging)?;
        let sandbox = strongest().map_err(Stop::bad_input)?;
        let in_force = sandbox.protections();
        let names: Vec<&str> = in_force.iter().copied().map(Protection::name).collect();
        print(format!("protections in force: {}\n", names.join(", ")).as_bytes())?;
        check(&sandbox, inputs.rubric.required_protections()).map_err(Stop::bad_input)?;
        check_secrets(&inputs.secrets(), &[], in_force)?;
        if inputs.hidden.is_some() && !inputs.rubric.runs_hidden_under(in_force) {
            return Err(Stop::bad_input(
                "hidden scenes would not be run: without namespaces, a program can tell the next one about them\n  \
                 help: hidden-without-namespaces = true in [protection] of the rubric accepts that",
            ));
        }
        Ok(Exit::Passed)
    }
}
