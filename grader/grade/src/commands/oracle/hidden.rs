//! `grade oracle generate-hidden`: draws a sibling of each public scene, with its trace.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use grader::boundary::seal::Secret;
use grader::oracle::folder;
use grader::suite::assignment::Assignment;
use grader::suite::{Case, Section};
use rayon::prelude::*;
use selftest::mistake::{self, Mistake};
use selftest::sibling::{NoSibling, Sibling, find};

use super::origin;
use crate::args::SuiteArgs;
use crate::output::{print, write_file};
use crate::stop::{Exit, Stop};

/// Draw a hidden scene for each public one: the same features with other numbers, as well-posed, and catching the same
/// mistakes
#[derive(Args)]
#[command(after_help = "\
Examples:
  grade oracle generate-hidden --assignment t1m3 -o hidden

Anyone who knows or guesses the seed can draw the same scenes, and a report tells whether a guess is right, by their hash: leave \
it out, and keep the folder. Exit codes: 0 all scenes have a sibling, \
2 bad usage or input, or a scene has none; nothing is written then.")]
pub(crate) struct HiddenArgs {
    /// Only these scenes: a name, a group, an integrator, a pattern with * and ?, or a part of names [default: all]
    #[arg(value_name = "SCENE")]
    scenes: Vec<String>,

    /// Only the scenes to which this assignment gives points; `grade assignments` lists them
    #[arg(long, value_name = "NAME")]
    assignment: Option<String>,

    /// Seed of the numbers: the same seed draws the same bytes [default: random]
    #[arg(long, value_name = "NUMBER")]
    seed: Option<u64>,

    /// Write to this folder, which must not exist
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,

    /// Write to this file which mistake each scene catches (CSV)
    #[arg(long, value_name = "FILE")]
    mistakes: Option<PathBuf>,

    #[command(flatten)]
    suite: SuiteArgs,
}

impl HiddenArgs {
    pub(super) fn run(&self) -> Result<Exit, Stop> {
        // The work of minutes is not to be lost.
        folder::check_free(&self.output).map_err(Stop::bad_input)?;
        let cases = self.chosen()?;
        let mistakes = mistake::all();
        let seed = match self.seed {
            Some(seed) => seed,
            None => Secret::random().map_err(Stop::fault)?.0,
        };
        let found: Vec<Result<Sibling, NoSibling>> =
            cases.par_iter().map(|case| find(case, seed, &mistakes)).collect();
        let missing: Vec<String> = found
            .iter()
            .filter_map(|found| found.as_ref().err())
            .map(ToString::to_string)
            .collect();
        if !missing.is_empty() {
            return Err(Stop::bad_input(format!(
                "{}\n  help: try another --seed, or name the scenes that are wanted without these; nothing was written",
                missing.join("\n")
            )));
        }
        let siblings: Vec<Sibling> = found.into_iter().flatten().collect();
        let scenes = cases.iter().zip(&siblings);
        let scenes: Vec<_> =
            scenes.map(|(case, sibling)| (case.feature.section, &sibling.files)).collect();
        folder::write(&self.output, &scenes, &origin()).map_err(Stop::bad_input)?;
        if let Some(path) = &self.mistakes {
            let table = table(&cases, &siblings).map_err(Stop::fault)?;
            write_file(path, &table).map_err(Stop::about(path))?;
        }
        let text = describe(&cases, &siblings, &mistakes, &self.output);
        print(text.as_bytes())?;
        Ok(Exit::Passed)
    }

    /// The public scenes, each in the section of its folder.
    fn chosen(&self) -> Result<Vec<Case>, Stop> {
        let mut inputs = self.suite.read_strictly()?;
        if let Some(name) = &self.assignment {
            let assignment =
                Assignment::load(&inputs.assignments, name).map_err(Stop::bad_input)?;
            let has_points = |section| section != Section::Unscored;
            inputs.suite.cases.retain(|case| assignment.section(case).is_some_and(has_points));
        }
        inputs.suite.keep_only(&self.scenes).map_err(Stop::bad_input)?;
        Ok(inputs.suite.cases)
    }
}

/// Which mistake each scene catches, as CSV.
fn table(cases: &[Case], siblings: &[Sibling]) -> csv::Result<Vec<u8>> {
    let mut table = csv::Writer::from_writer(Vec::new());
    table.write_record(["scene", "subject", "mistake"])?;
    for (case, sibling) in cases.iter().zip(siblings) {
        for [subject, description] in sibling.caught.iter().flatten() {
            table.write_record([&case.id, *subject, description])?;
        }
    }
    table.into_inner().map_err(|error| error.into_error().into())
}

/// The mistakes that at least one scene catches, of those that may matter on one, and the others.
fn coverage(cases: &[Case], siblings: &[Sibling], mistakes: &[Mistake]) -> String {
    let all: BTreeSet<_> =
        siblings.iter().flat_map(|sibling| sibling.caught.iter().flatten()).copied().collect();
    let matters = |mistake: &&Mistake| cases.iter().any(|case| mistake.can_matter_on(&case.scene));
    let possible: Vec<&Mistake> = mistakes.iter().filter(matters).collect();
    let escape = |mistake: &&&Mistake| !all.contains(&[mistake.subject, mistake.description]);
    let escaped: Vec<String> = possible
        .iter()
        .filter(escape)
        .map(|mistake| format!("  {}: {}\n", mistake.subject, mistake.description))
        .collect();
    let count = possible.len() - escaped.len();
    let end = if escaped.is_empty() { ".\n" } else { "; not clearly:\n" };
    let total = possible.len();
    format!(
        "Together they clearly catch {count} of the {total} planted mistakes that can matter on them{end}{}\n",
        escaped.concat()
    )
}

/// A line for each scene, the mistakes that they catch together, what was written, and how to grade with it.
fn describe(cases: &[Case], siblings: &[Sibling], mistakes: &[Mistake], output: &Path) -> String {
    let width = cases.iter().map(|case| case.id.len()).max().unwrap_or(0);
    let mut text = format!("{:width$}  tries  mistakes caught\n", "scene");
    for (case, Sibling { tries, caught, .. }) in cases.iter().zip(siblings) {
        let caught = match caught {
            Some(caught) => format!("{0} of {0}", caught.len()),
            None => "not tested".to_owned(),
        };
        // A string takes everything.
        let _ = writeln!(text, "{:width$}  {tries:>5}  {caught:>15}", case.id);
    }
    text += &coverage(cases, siblings, mistakes);
    let (count, folder) = (siblings.len(), output.display());
    // From wherever the rubric is.
    let absolute = std::path::absolute(output).unwrap_or_else(|_| output.to_path_buf());
    // A string of JSON is one of TOML.
    let quoted = serde_json::Value::from(absolute.display().to_string());
    let _ = write!(
        text,
        "{folder}: {count} hidden scenes with their traces. Grade with --hidden {folder}, or state in the rubric:\n\n\
         [hidden]\nfolder = {quoted}\nscenes = {count}\n"
    );
    text
}
