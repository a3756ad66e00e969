//! `grade selftest`: tests the grader with planted mistakes and correct variants.

use clap::{Args, ValueEnum};
use diagnosis::findings::Thresholds;
use selftest::report::drawn as report;
use selftest::{SelfTest, drawn, in_process, programs};

use crate::args::{ReportArgs, RunArgs, SuiteArgs};
use crate::inputs::{Inputs, open_oracle};
use crate::output::{put, written};
use crate::stop::{Exit, Stop};

/// Test the grader: planted mistakes must be caught and named, correct variants must pass
#[derive(Args)]
#[command(after_help = "\
Examples:
  grade selftest --in-process
  grade selftest --drawn 20 --seed 7 --details")]
pub(crate) struct SelfTestArgs {
    #[command(flatten)]
    report: ReportArgs<SelfTestFormat>,

    /// Write docs/selftest.md; same as --format markdown
    #[arg(long, conflicts_with = "format")]
    markdown: bool,

    /// Skip the programs in other languages, which need compilers
    #[arg(long)]
    in_process: bool,

    /// Only mistakes with this subject, such as a force's name in words
    #[arg(long, value_name = "NAME")]
    subject: Option<String>,

    /// Instead, draw and grade this many programs: unfinished, with none to three mistakes, in several forms
    #[arg(long, value_name = "COUNT", conflicts_with_all = ["in_process", "subject", "format", "markdown"])]
    drawn: Option<u64>,

    /// Seed of the drawn programs
    #[arg(long, value_name = "NUMBER", default_value_t = 1, requires = "drawn")]
    seed: u64,

    /// Number of the first drawn program
    #[arg(long, value_name = "NUMBER", default_value_t = 0, requires = "drawn")]
    first: u64,

    /// List the drawn programs whose mistakes are not all proven
    #[arg(long, requires = "drawn")]
    details: bool,

    /// Grade them again with each number of the search for causes moved, and print what that changes
    #[arg(long, requires = "drawn", conflicts_with = "details")]
    moved: bool,

    #[command(flatten)]
    run: RunArgs,

    #[command(flatten)]
    suite: SuiteArgs,
}

#[derive(Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
enum SelfTestFormat {
    /// For people
    #[default]
    Text,
    /// For programs; schema in docs/selftest.schema.json
    Json,
    /// For docs/selftest.md
    Markdown,
}

impl SelfTestArgs {
    pub(crate) fn run(&self) -> Result<Exit, Stop> {
        let Inputs { mut suite, expected, rubric, .. } = self.suite.read()?;
        let oracle = open_oracle(&expected)?;
        if let Some(count) = self.drawn {
            in_process::known(&mut suite);
            let plan = drawn::Plan { first: self.first, count, seed: self.seed };
            let inputs = drawn::Inputs { suite: &suite, oracle: &oracle, rubric: &rubric };
            if self.moved {
                let text = report::moved(&drawn::moved(inputs, plan));
                put(text.as_bytes(), self.report.output.as_deref())?;
                return Ok(Exit::of(true));
            }
            let results = drawn::run(inputs, plan, &Thresholds::default());
            let mut text = report::table(&results);
            if self.details {
                text += &report::details(&results);
            }
            put(text.as_bytes(), self.report.output.as_deref())?;
            let is_met = report::rates(&results).iter().all(report::DrawnRate::is_met);
            return Ok(Exit::of(is_met));
        }
        let subject = self.subject.as_deref();
        let mut rows = in_process::rows(&suite, &oracle, &rubric, subject);
        if !self.in_process {
            let (runner, _) = self.run.runner(&rubric)?;
            let of_programs = programs::rows(&suite, &oracle, &rubric, &runner, subject);
            rows.extend(of_programs.map_err(Stop::fault)?);
        }
        if let Some(subject) = subject.filter(|_| rows.len() < 2) {
            return Err(Stop::bad_input(format!(
                "no mistake has the subject {subject:?}; the first column of docs/selftest.md has them all"
            )));
        }
        let selftest = SelfTest { rows };
        let format = if self.markdown { SelfTestFormat::Markdown } else { self.report.format };
        let bytes = match format {
            SelfTestFormat::Text => written(|out| selftest::report::text::write(out, &selftest))?,
            SelfTestFormat::Json => {
                selftest::report::json::render(&selftest).map_err(Stop::fault)?.into_bytes()
            }
            SelfTestFormat::Markdown => selftest::report::markdown::render(&selftest).into_bytes(),
        };
        put(&bytes, self.report.output.as_deref())?;
        Ok(Exit::of(selftest.is_met()))
    }
}
