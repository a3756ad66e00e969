//! `grade needs`: what each shipped scene is given, beside what the general path costs it.

use grader::needs;
use grader::report;

use crate::args::SuiteArgs;
use crate::output::print;
use crate::stop::{Exit, Stop};

pub(super) fn run(suite: &SuiteArgs, only: Option<&str>) -> Result<Exit, Stop> {
    let inputs = suite.read()?;
    let mut all = Vec::new();
    // One after the other: times would suffer from company.
    for case in &inputs.suite.cases {
        if only.is_none_or(|text| case.id.contains(text)) {
            all.push(needs::measure(&case.id, &case.scene).map_err(Stop::bad_input)?);
        }
    }
    if all.is_empty() {
        let text = only.unwrap_or_default();
        return Err(Stop::bad_input(format!("no scene's name contains {text:?}")));
    }
    let mut bytes = Vec::new();
    report::needs::write(&mut bytes, &all, None).map_err(Stop::fault)?;
    print(&bytes)?;
    let is_pass = all.iter().all(|need| need.excess.is_empty());
    Ok(if is_pass { Exit::Passed } else { Exit::Failed })
}
