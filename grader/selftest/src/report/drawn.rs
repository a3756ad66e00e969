//! Rates of the drawn programs, as text and as a section of `docs/selftest.md`.

use crate::Rate;
use crate::drawn::{Moved, Result};

/// A rate with its name and its target; a target of 0 is none.
pub struct DrawnRate {
    /// The name.
    pub name: String,
    /// The rate.
    pub rate: Rate,
    /// The bound: at least this, or at most if `at_most`.
    pub target: f64,
    /// Whether the target is an upper bound.
    pub at_most: bool,
}

impl DrawnRate {
    /// Whether the target is met.
    pub fn is_met(&self) -> bool {
        match (self.at_most, self.rate.all) {
            (_, 0) => true,
            (true, _) => self.rate.value() <= self.target,
            (false, _) => self.rate.value() >= self.target,
        }
    }
}

/// The rates of these programs.
pub fn rates(results: &[Result]) -> Vec<DrawnRate> {
    let of = |mistakes: usize| results.iter().filter(move |result| result.wrong.len() == mistakes);
    let rate = |name: &str, rate: Rate, target: f64, at_most: bool| DrawnRate {
        name: name.to_owned(),
        rate,
        target,
        at_most,
    };
    let all = |flags: &[bool]| flags.iter().all(|flag| *flag);
    let mistaken = results.iter().filter(|result| !result.wrong.is_empty());
    vec![
        rate("mistakes caught", Rate::of(mistaken.map(|r| Some(r.caught))), 1.0, false),
        rate(
            "programs with a false statement",
            Rate::of(results.iter().map(|r| Some(!r.false_findings.is_empty()))),
            0.005,
            true,
        ),
        rate(
            "right programs with a finding on a mistake",
            Rate::of(
                of(0).map(|r| {
                    Some(!r.false_findings.is_empty() || r.caught && r.delivery.is_exact())
                }),
            ),
            0.0,
            true,
        ),
        rate("one mistake: named first", Rate::of(of(1).map(|r| Some(r.first))), 0.97, false),
        rate("one mistake: proven", Rate::of(of(1).map(|r| Some(all(&r.proven)))), 0.85, false),
        rate("two mistakes: both named", Rate::of(of(2).map(|r| Some(all(&r.named)))), 0.9, false),
        rate(
            "two mistakes: both proven",
            Rate::of(of(2).map(|r| Some(all(&r.proven)))),
            0.7,
            false,
        ),
        rate("three mistakes: all named", Rate::of(of(3).map(|r| Some(all(&r.named)))), 0.8, false),
        rate(
            "three mistakes: all proven",
            Rate::of(of(3).map(|r| Some(all(&r.proven)))),
            0.0,
            false,
        ),
    ]
}

/// The rates as a Markdown table.
pub fn table(results: &[Result]) -> String {
    let mut text =
        "| | programs | share | target | |\n| --- | ---: | ---: | ---: | --- |\n".to_owned();
    for one in rates(results) {
        let DrawnRate { name, rate, target, at_most, .. } = &one;
        let target = match (*target, at_most) {
            (0.0, false) => String::new(),
            (target, true) => format!("≤ {} %", 100.0 * target),
            (target, false) => format!("≥ {} %", 100.0 * target),
        };
        let met = if one.is_met() { "" } else { "missed" };
        let share = 100.0 * rate.value();
        text += &format!(
            "| {name} | {} of {} | {share:.1} % | {target} | {met} |\n",
            rate.right, rate.all
        );
    }
    text
}

/// The effect of moving each number of the search, as a Markdown table: programs with a false statement, and shares of
/// the planted mistakes that are named and proven, as counts; the first row is the search as it is.
pub fn moved(all: &[Moved]) -> String {
    let mut text = "| number | value | false | named | proven | time |\n| --- | ---: | ---: | ---: | ---: | ---: |\n".to_owned();
    let is_true = |flags: &[bool]| flags.iter().filter(|flag| **flag).count();
    let base = all.first().map_or(1.0, |first| first.seconds);
    for one in all {
        let count = |of: &dyn Fn(&Result) -> usize| one.results.iter().map(of).sum::<usize>();
        let wrong = count(&|result| usize::from(!result.false_findings.is_empty()));
        let [named, proven] = [count(&|r| is_true(&r.named)), count(&|r| is_true(&r.proven))];
        let (name, value) = match one.number {
            Some(name) => (format!("`{name}`"), one.value.to_string()),
            None => ("as it is".to_owned(), String::new()),
        };
        let time = one.seconds / base;
        text += &format!("| {name} | {value} | {wrong} | {named} | {proven} | {time:.2} |\n");
    }
    text
}

/// The programs with a false statement, and those whose mistakes were not named.
pub fn details(results: &[Result]) -> String {
    let mut text = String::new();
    for result in results {
        let missing = result.named.iter().any(|named| !named);
        let unproven = result.proven.iter().any(|proven| !proven);
        let note = match () {
            () if !result.false_findings.is_empty() => "FALSE",
            () if !result.wrong.is_empty() && !result.caught => "ESCAPED",
            () if missing => "not named",
            () if unproven => "not proven",
            () => continue,
        };
        text += &format!("{note}: {} {}\n", result.number, result.description);
        for finding in &result.findings {
            text += &format!("    {finding}\n");
        }
    }
    text
}
