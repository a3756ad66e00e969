//! `grade completions`: completions of the command line, for a shell.

use clap::{Args, Command};
use clap_complete::Shell;

use crate::output::print;
use crate::stop::{Exit, Stop};

/// Print completions of this command line for a shell
#[derive(Args)]
#[command(after_help = "\
Examples:
  grade completions bash
  grade completions zsh")]
pub(crate) struct CompletionsArgs {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

impl CompletionsArgs {
    pub(crate) fn run(&self, mut command: Command) -> Result<Exit, Stop> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut command, "grade", &mut script);
        print(&script)?;
        Ok(Exit::Passed)
    }
}
