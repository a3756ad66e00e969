//! `grade selftest`: mistakes that must be caught and blamed, correct variants that must pass.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use selftest::{SelfTest, in_process, programs};

use crate::args::{RunArgs, SuiteArgs};
use crate::inputs::{Inputs, open_oracle};
use crate::output::put;
use crate::stop::{Exit, Stop};

#[derive(Args)]
pub(super) struct SelfTestArgs {
    /// Format of the report
    #[arg(long, value_enum, default_value_t = SelfTestFormat::Text)]
    format: SelfTestFormat,

    /// The document docs/selftest.md: the same as --format markdown
    #[arg(long, conflicts_with = "format")]
    markdown: bool,

    /// Write the report to this file instead of the standard output
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,

    /// Leave out the programs in other languages: then no compiler is needed
    #[arg(long)]
    in_process: bool,

    #[command(flatten)]
    run: RunArgs,

    #[command(flatten)]
    suite: SuiteArgs,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SelfTestFormat {
    /// For people
    Text,
    /// For programs; schema in docs/selftest.schema.json
    Json,
    /// For docs/selftest.md
    Markdown,
}

pub(super) fn run(args: &SelfTestArgs) -> Result<Exit, Stop> {
    let Inputs { mut suite, expected, rubric, .. } = args.suite.read()?;
    let oracle = open_oracle(&expected)?;
    in_process::known(&mut suite);
    let mut rows = in_process::rows(&suite, &oracle, &rubric);
    if !args.in_process {
        let (runner, _) = args.run.runner(&rubric)?;
        let of_programs = programs::rows(&suite, &oracle, &rubric, &runner);
        rows.extend(of_programs.map_err(Stop::fault)?);
    }
    let selftest = SelfTest { rows };
    let format = if args.markdown { SelfTestFormat::Markdown } else { args.format };
    let bytes = match format {
        SelfTestFormat::Text => {
            let mut bytes = Vec::new();
            selftest::report::text::write(&mut bytes, &selftest).map_err(Stop::fault)?;
            bytes
        }
        SelfTestFormat::Json => {
            selftest::report::json::render(&selftest).map_err(Stop::fault)?.into_bytes()
        }
        SelfTestFormat::Markdown => selftest::report::markdown::render(&selftest).into_bytes(),
    };
    put(&bytes, args.output.as_deref())?;
    Ok(if selftest.is_met() { Exit::Passed } else { Exit::Failed })
}
