//! Tests that the scenes of each assignment alone catch every mistake that is possible in it.

use std::collections::BTreeMap;

use grader::suite::assignment::Assignment;
use grader::suite::{Case, Section};
use selftest::mistake::Mistake;
use test_support::root;

use super::table::Table;
use super::{ENOUGH, own_suite};

/// Mistakes that cannot show in an assignment, although their code runs: under uniform gravity alone, the force is the
/// same at every position.
const INVISIBLE: [(&str, &str); 1] = [("t1m1", "force at q + h v")];

/// Mistakes in one assignment: possible ones, and those that too few of its scenes catch.
pub(crate) struct Catch {
    pub(crate) assignment: Assignment,
    /// Mistakes that can show in a required scene, then those that can in extra credit only.
    pub(crate) possible: [usize; 2],
    /// Mistakes that fewer than [`ENOUGH`] scenes catch, in words.
    pub(crate) escaped: Vec<String>,
}

/// Every assignment that has scenes which the second simulator supports.
fn catches(table: &Table) -> Vec<Catch> {
    let suite = own_suite();
    let assignments = Assignment::list(&root().join("assets/assignments")).expect("assignments");
    let catch = |assignment: Assignment| {
        let scenes: BTreeMap<&str, (&Case, Section)> = suite
            .cases
            .iter()
            .filter_map(|case| Some((case.id.as_str(), (case, assignment.section(case)?))))
            .collect();
        let mut possible = [0; 2];
        let mut escaped = Vec::new();
        for row in &table.rows {
            let Mistake { subject, description, .. } = &row.mistake;
            let matters = |section| {
                let of_section = scenes.values().filter(|(_, own)| *own == section);
                of_section.clone().any(|(case, _)| row.mistake.can_show_on(&case.scene))
            };
            // A mistake that shows in required scenes costs points there.
            let section = [Section::Required, Section::ExtraCredit]
                .into_iter()
                .find(|section| matters(*section));
            let Some(section) = section else { continue };
            if INVISIBLE.contains(&(&assignment.name, description)) {
                continue;
            }
            possible[usize::from(section == Section::ExtraCredit)] += 1;
            let caught = row
                .caught_by
                .iter()
                .filter(|id| scenes.get(id.as_str()).is_some_and(|(_, own)| *own == section));
            let caught = caught.count();
            if caught < ENOUGH {
                escaped.push(format!("{}: {subject}, {description}: {caught}", assignment.name));
            }
        }
        Catch { assignment, possible, escaped }
    };
    let catches = assignments.into_iter().map(catch);
    catches.filter(|catch| catch.possible != [0; 2]).collect()
}

/// The part of `docs/mistakes.md` about assignments.
pub(crate) fn markdown(catches: &[Catch]) -> String {
    let mut text = "\n## Assignments\n\n\
        Each assignment is held by itself: every mistake that can show in one of its required scenes is caught by two of\n\
        them at least, and every other one by two of its extra-credit scenes. A Jacobian shows only where Newton's method is not\n\
        run to the root of its equation.\n\n\
        | assignment | mistakes in required scenes | in extra credit only |\n| --- | ---: | ---: |\n"
        .to_owned();
    for Catch { assignment, possible: [required, extra], .. } in catches {
        text += &format!("| `{}` | {required} | {extra} |\n", assignment.name);
    }
    text
}

/// Asserts that the scenes of each assignment catch the mistakes that are possible in it.
pub(crate) fn assert_caught(table: &Table) -> Vec<Catch> {
    let catches = catches(table);
    let escaped: Vec<&str> =
        catches.iter().flat_map(|catch| &catch.escaped).map(String::as_str).collect();
    assert!(escaped.is_empty(), "caught by fewer than {ENOUGH} scenes:\n{}", escaped.join("\n"));
    catches
}
