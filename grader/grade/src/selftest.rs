//! `grade selftest`: tests the grader with planted mistakes and correct variants.

use selftest::report::drawn as report;
use selftest::{SelfTest, drawn, in_process, programs};

use crate::args::{SelfTestArgs, SelfTestFormat};
use crate::inputs::{Inputs, open_oracle};
use crate::output::put;
use crate::stop::{Exit, Stop};

pub(super) fn run(args: &SelfTestArgs) -> Result<Exit, Stop> {
    let Inputs { mut suite, expected, rubric, .. } = args.suite.read()?;
    let oracle = open_oracle(&expected)?;
    in_process::known(&mut suite);
    if let Some(count) = args.drawn {
        let results = drawn::run(
            &suite,
            &oracle,
            &rubric,
            drawn::Plan { first: args.first, count, seed: args.seed },
        );
        let mut text = report::table(&results);
        if args.details {
            text += &report::details(&results);
        }
        put(text.as_bytes(), args.output.as_deref())?;
        let is_met = report::rates(&results).iter().all(report::DrawnRate::is_met);
        return Ok(if is_met { Exit::Passed } else { Exit::Failed });
    }
    let subject = args.subject.as_deref();
    let mut rows = in_process::rows(&suite, &oracle, &rubric, subject);
    if !args.in_process {
        let (runner, _) = args.run.runner(&rubric)?;
        let of_programs = programs::rows(&suite, &oracle, &rubric, &runner, subject);
        rows.extend(of_programs.map_err(Stop::fault)?);
    }
    if let Some(subject) = subject.filter(|_| rows.len() < 2) {
        return Err(Stop::bad_input(format!(
            "no mistake has the subject {subject:?}; the first column of docs/selftest.md has them all"
        )));
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
