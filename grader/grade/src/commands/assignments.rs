//! `grade assignments`: lists the assignments, or shows one in detail.

use std::collections::BTreeMap;
use std::io::{self, Write};

use clap::Args;
use grader::grading::points;
use grader::suite::assignment::{ALL, Assignment};
use grader::suite::{Feature, Section, Suite};
use report::table::{self, BOLD, Cell, header};

use crate::args::SuiteArgs;
use crate::inputs::{Inputs, Judging};
use crate::output::print;
use crate::stop::{Exit, Stop};

/// List the assignments with their features and points, or show one
#[derive(Args)]
#[command(after_help = "\
Examples:
  grade assignments
  grade assignments t1m3")]
pub(crate) struct AssignmentsArgs {
    /// Name of the assignment to show
    #[arg(value_name = "NAME")]
    name: Option<String>,

    #[command(flatten)]
    suite: SuiteArgs,
}

impl AssignmentsArgs {
    /// Lists all assignments, or shows the one of this name.
    pub(crate) fn run(&self) -> Result<Exit, Stop> {
        let mut text = Vec::new();
        match &self.name {
            Some(name) => {
                let inputs = read(&self.suite, name)?;
                let assignment =
                    Assignment::load(&inputs.assignments, name).map_err(Stop::bad_input)?;
                write_one(&mut text, &assignment, &inputs)
            }
            None => write_list(&mut text, &self.suite)?,
        }
        .map_err(Stop::fault)?;
        print(&text)?;
        Ok(Exit::Passed)
    }
}

fn read(suite: &SuiteArgs, name: &str) -> Result<Inputs, Stop> {
    suite.read_for(&Judging { assignment: Some(name), ..Judging::default() })
}

fn write_list(text: &mut Vec<u8>, suite: &SuiteArgs) -> Result<io::Result<()>, Stop> {
    let folder = suite.read()?.assignments;
    let assignments = Assignment::list(&folder).map_err(Stop::bad_input)?;
    if assignments.is_empty() {
        return Err(Stop::bad_input(format!(
            "{}: no assignments\n  help: add one as a file NAME.toml; docs/formats.md describes it",
            folder.display()
        )));
    }
    let mut written = Ok(());
    for assignment in &assignments {
        let inputs = read(suite, &assignment.name)?;
        written = written.and_then(|()| write_entry(text, assignment, &inputs));
    }
    Ok(written
        .and_then(|()| writeln!(text, "`grade assignments NAME` shows one with its features.")))
}

/// Writes the title of an assignment, and its sums.
fn write_entry(text: &mut Vec<u8>, assignment: &Assignment, inputs: &Inputs) -> io::Result<()> {
    writeln!(text, "{BOLD}{}{BOLD:#}: {}", assignment.name, assignment.title)?;
    for section in Section::ALL {
        let sums = Sums::of(inputs, section);
        if sums.features > 0 {
            writeln!(text, "  {:<15} {}", report::text::title(section), sums.words(section))?;
        }
    }
    writeln!(text)
}

/// Writes the scope of an assignment and its features.
fn write_one(text: &mut Vec<u8>, assignment: &Assignment, inputs: &Inputs) -> io::Result<()> {
    let Assignment { name, title, document, .. } = assignment;
    writeln!(text, "{BOLD}{name}{BOLD:#}: {title}")?;
    if let Some(document) = document {
        writeln!(text, "  document     {document}")?;
    }
    let scope = assignment.scope();
    let listed = |words: Option<&Vec<String>>| {
        words.map_or_else(|| "all".to_owned(), |words| words.join(", "))
    };
    let dimensions = scope.dimensions.as_ref();
    let dimensions =
        dimensions.map(|numbers| numbers.iter().map(ToString::to_string).collect::<Vec<_>>());
    writeln!(text, "  formats      {}", listed(scope.formats.as_ref()))?;
    writeln!(text, "  dimensions   {}", listed(dimensions.as_ref()))?;
    writeln!(text, "  forces       {}", listed(scope.forces.as_ref()))?;
    if !scope.optional_forces.is_empty() {
        writeln!(text, "  allowed too  {}", scope.optional_forces.join(", "))?;
    }
    writeln!(text, "  integrators  {}", listed(scope.integrators.as_ref()))?;
    for section in Section::ALL {
        let features = features(&inputs.suite, section);
        if features.is_empty() {
            continue;
        }
        let scored = section != Section::Unscored;
        let heading = report::text::title(section);
        let sums = Sums::of(inputs, section);
        writeln!(text, "\n{BOLD}{heading}{BOLD:#}: {}", sums.words(section))?;
        let row = |(feature, scenes): (&&Feature, &usize)| {
            let points = points::shown(inputs.rubric.points(feature));
            let mut row = vec![
                Cell::left(feature.group.clone()),
                Cell::left(feature.integrator),
                Cell::right(scenes.to_string()),
            ];
            row.extend(scored.then(|| Cell::right(points)));
            row
        };
        let names = ["group", "integrator", "scenes", "points"];
        let mut rows = vec![header(if scored { &names } else { &names[..3] }, 2..4)];
        rows.extend(features.iter().map(row));
        table::write(text, &rows)?;
    }
    if name != ALL {
        writeln!(
            text,
            "\nGrade a program as this assignment: --assignment {name}, or assignment = {name:?} in submission.toml or in \
             the rubric.\nIts file: {}",
            assignment.path().display()
        )?;
    }
    Ok(())
}

/// The features of a section, with the number of their scenes.
fn features(suite: &Suite, section: Section) -> BTreeMap<&Feature, usize> {
    let mut features = BTreeMap::new();
    for case in suite.cases.iter().filter(|case| case.feature.section == section) {
        *features.entry(&case.feature).or_default() += 1;
    }
    features
}

/// Sums over the features of a section.
struct Sums {
    features: usize,
    scenes: usize,
    points: f64,
}

impl Sums {
    fn of(inputs: &Inputs, section: Section) -> Self {
        let features = features(&inputs.suite, section);
        let points = features.keys().map(|feature| inputs.rubric.points(feature));
        Self {
            features: features.len(),
            scenes: features.values().sum(),
            // The sum of nothing is -0.
            points: points.fold(0.0, |sum, points| sum + points),
        }
    }

    fn words(&self, section: Section) -> String {
        let Self { features, scenes, points } = self;
        let plural = |count: usize, noun: &str| match count {
            1 => format!("1 {noun}"),
            count => format!("{count} {noun}s"),
        };
        let text = format!("{}, {}", plural(*features, "feature"), plural(*scenes, "scene"));
        match section {
            Section::Unscored => text,
            _ => format!("{text}, {} points", points::shown(*points)),
        }
    }
}
