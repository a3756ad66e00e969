//! Markdown table of mistakes and the scenes that catch them.

use std::fmt::Write;

use grader::suite::Section;
use rayon::prelude::*;
use selftest::mistake::{Area, Mistake};

use super::judging::{Finding, Graded};

/// Number of scenes named in a row.
const NAMED: usize = 3;

const INTRODUCTION: &str = "\
# Mistakes that the scenes catch

A grading suite is worth what it catches. Each row of this table is a mistake that a student may make; it
was planted in a second, independent implementation of the course's simulator (`grader/selftest/src`),
and that program was run and graded with the course's tolerances against the oracle's traces. Nothing of
this is in the simulator itself. While it is faultless, the second implementation agrees with the simulator on
every scene that it knows and that is not chaotic: those in the plane without wind and `beta`, by every method but Dormand–Prince;
those in space without wind, by the four methods of Euler; and those of fast mass-spring without acceleration, with wind as
well. The others are held to references of their own, in the simulator's tests.

The numbers count the scenes that catch the mistake: required + extra credit. Only clear verdicts count:
where a residual is within a factor of 100 of its tolerance, on either side, the scene is left out of the
row. Every mistake must be caught by two scenes at least. The three simplest of them are named: those with
the fewest kinds of force, then the fewest particles.

A mistake in a Jacobian leaves the answer of implicit Euler as it is, as long as Newton's method still
converges: such rows count few of its scenes. So it is with projected Newton, whose loose tolerance shows mistakes in
the Hessian, the first guess and the line search. Where a line search has no end, or a step takes more than a hundred
iterations, the second implementation writes NaN.

The five mistakes marked † are known to pass the course's own scenes, where every spring moves along its
own axis and every dragged particle has mass 1. They are not the only ones; they are the ones to be sure of.

The table is written by `UPDATE_DOCS=1 cargo test --release -p selftest mistakes -- --include-ignored`; without the
variable, the tests fail where the table is not up to date.
";

/// The table.
pub(crate) struct Table {
    pub(crate) rows: Vec<Row>,
    /// Scenes of each section.
    n_scenes: [usize; 2],
}

/// One mistake.
pub(crate) struct Row {
    pub(crate) mistake: Mistake,
    /// The scenes that catch the mistake, simplest first.
    pub(crate) caught_by: Vec<String>,
    /// Number of these scenes in each section.
    counts: [usize; 2],
}

impl Table {
    /// Judges every mistake on every scene on which it can have an effect.
    pub(crate) fn new(mistakes: Vec<Mistake>, scenes: &[Graded]) -> Self {
        let rows = mistakes.into_par_iter().map(|mistake| Row::new(mistake, scenes)).collect();
        Self { rows, n_scenes: by_section(scenes.iter()) }
    }

    /// The document.
    pub(crate) fn markdown(&self) -> String {
        let mut text = INTRODUCTION.to_owned();
        let [required, extra] = self.n_scenes;
        let n_mistakes = self.rows.len();
        let _ = writeln!(text, "\n{n_mistakes} mistakes, {required} + {extra} scenes.");
        for area in Area::ALL {
            let _ = writeln!(text, "\n## {}", area.title());
            let mut subject = "";
            for row in self.rows.iter().filter(|row| row.mistake.area == area) {
                if row.mistake.subject != subject {
                    subject = row.mistake.subject;
                    let _ = writeln!(text, "\n### {}\n", capitalized(subject));
                    text.push_str("| mistake | caught by | for example |\n| --- | ---: | --- |\n");
                }
                text += &row.markdown();
            }
        }
        text
    }
}

impl Row {
    fn new(mistake: Mistake, scenes: &[Graded]) -> Self {
        let student = mistake.student();
        let mut caught_by: Vec<&Graded> = scenes
            .par_iter()
            .filter(|graded| mistake.can_matter_on(&graded.scene))
            .filter(|graded| graded.judge(&student) == Finding::Caught)
            .collect();
        let counts = by_section(caught_by.iter().copied());
        caught_by.sort_by_key(|graded| graded.complexity());
        let caught_by = caught_by.into_iter().map(|graded| graded.id.clone()).collect();
        Self { mistake, caught_by, counts }
    }

    /// Its line of the document.
    pub(crate) fn markdown(&self) -> String {
        let mark = if self.mistake.missed_by_the_course { " †" } else { "" };
        let [required, extra] = self.counts;
        let description = self.mistake.description;
        let names = self.caught_by[..self.caught_by.len().min(NAMED)].join(", ");
        format!("| {description}{mark} | {required} + {extra} | {names} |\n")
    }
}

/// Number of scenes in each section.
fn by_section<'a>(scenes: impl Iterator<Item = &'a Graded>) -> [usize; 2] {
    let mut counts = [0; 2];
    for graded in scenes {
        counts[usize::from(graded.section == Section::ExtraCredit)] += 1;
    }
    counts
}

pub(crate) fn capitalized(text: &str) -> String {
    let mut characters = text.chars();
    characters
        .next()
        .map_or(String::new(), |first| first.to_uppercase().chain(characters).collect())
}
