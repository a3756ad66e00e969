//! Self-test as the document `docs/selftest.md`.
//!
//! The document omits residuals, which depend on the compiler, so that it is the same on every machine.

use std::fmt::Write;

use super::{blamed, expected, rates, verdict};
use crate::{Outcome, Row, SelfTest};

const INTRODUCTION: &str = "\
# Self-test

`grade selftest` grades programs of which it is known whether they are right, by the code that grades any
submission, and says how often the verdicts were right. It exits with 1 where a target is missed; CI runs it.

- **In process**: the second simulator, written in Rust without the first, spoilt in one place at a time
  ([mistakes.md](mistakes.md) says which scenes catch each of its mistakes). It needs no compiler. Projected Newton and
  fast mass-spring are left out: no step of them is redone to find a cause.
- **Programs** in C++, C and Python (`grader/selftest/src/programs`), with mistakes of a program's own: output,
  precision, reading, crashes, Newton's method. They are built and run under protection. What cannot be built
  where the self-test runs is shown as skipped, and counts in no rate.

A mistake is *caught* where a scene fails. It is *named rightly* where the first finding of the report names the feature
that was written down beside the mistake, by what the mistake is, before it was run: the force or the part of it, its
Jacobians, the integrator, fixed particles (under which methods), the output, … and whether it shows by wrong traces, by
crashes, or by runs that do not end. Where several causes fit alike, all are named.

How findings are proven is described in [internals.md](internals.md).

`grade selftest --markdown` writes this file; `ci/selftest.sh` holds it to what comes out. Residuals stand in the text
and JSON reports, for they depend on the compiler.
";

/// The document.
pub fn render(selftest: &SelfTest) -> String {
    let mut text = INTRODUCTION.to_owned();
    text.push_str("\n## Rates\n\n| | rows | share | target |\n| --- | ---: | ---: | ---: |\n");
    for (name, rate, target) in rates(selftest) {
        let (right, all, share) = (rate.right, rate.all, 100.0 * rate.value());
        let _ =
            writeln!(text, "| {name} | {right} of {all} | {share:.1} % | {} % |", 100.0 * target);
    }
    let skipped = selftest.skipped();
    if skipped > 0 {
        let _ = writeln!(text, "\nRows skipped: {skipped}.");
    }
    text.push_str("\n## Correct variants\n\n");
    text.push_str("| what varies | variant | in | scenes passed | verdict |\n");
    text.push_str("| --- | --- | --- | ---: | --- |\n");
    for row in selftest.variants() {
        let scenes = match &row.result {
            Outcome::Skipped(reason) => reason.clone(),
            Outcome::Graded(graded) => {
                format!("{} of {}", graded.scenes - graded.failed, graded.scenes)
            }
        };
        let Row { subject, description, language, .. } = row;
        let verdict = verdict(row);
        let _ = writeln!(text, "| {subject} | {description} | {language} | {scenes} | {verdict} |");
    }
    text.push_str("\n## Mistakes\n\n");
    text.push_str("| where | mistake | in | scenes failed | findings | |\n");
    text.push_str("| --- | --- | --- | ---: | --- | --- |\n");
    for row in selftest.mistakes() {
        mistake(&mut text, row);
    }
    text
}

fn mistake(text: &mut String, row: &Row) {
    let Row { subject, description, language, .. } = row;
    let _ = write!(text, "| {subject} | {description} | {language} | ");
    let _ = match &row.result {
        Outcome::Skipped(reason) => writeln!(text, "skipped | {reason} | |"),
        Outcome::Graded(graded) => {
            let caught = if graded.failed == 0 { " **escaped**" } else { "" };
            let right = match row.is_blamed_rightly() {
                Some(false) => format!("**not {}**", expected(row)),
                _ => String::new(),
            };
            let blamed = blamed(graded);
            writeln!(text, "{} of {}{caught} | {blamed} | {right} |", graded.failed, graded.scenes)
        }
    };
}
