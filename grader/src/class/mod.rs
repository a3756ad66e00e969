//! Grading of a class: a folder of submissions, with a report and a table row for each.
//!
//! ```text
//! DIR ─> layout, arranged: one folder a student      layout/
//! DIR ─> entries, by name ─> plan ─> shards, in any order: Submission -> Grading ─> reports ─> record ─┐
//!          entry.rs         plan.rs                                                        record.rs   │
//!                                                                  phase.rs, kept.rs: with hidden scenes, in two phases
//!                              └──────────────────────────> merge <── records with the plan's keys <───┘
//!                                                             └─> rows, by name ─> summary
//!                    marks.rs ─> credit for creative scenes
//!                   adjust.rs ─> points that the teacher grants or withdraws
//!                                                    roster.rs ─> whose submission it is ─> gradebooks
//! ```
//!
//! A row depends on its submission, the suite and the grader only.

pub mod adjust;
pub mod entry;
pub mod fingerprint;
pub mod layout;
pub mod marks;
pub mod phase;
pub mod plan;
pub mod record;
pub mod roster;
pub mod sheet;
pub mod similar;

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use crate::boundary::printed::Untrusted;
use crate::grading::points;
use crate::grading::{Grading, GradingOutcome, Hidden, SceneResult};
use crate::probe::Probing;
use crate::suite::Section;
use crate::verdict::{Failure, Verdict};
use diagnosis::findings::Finding;

/// The table row of one submission. Points are text, as in the report, so that storing and reading them again cannot
/// change their hundredths.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// The name of the submission's file or folder.
    pub name: String,
    /// "passed", "passed-shipped", "failed" or "grader-fault"; the verdict's name if all scenes have the same one.
    pub verdict: String,
    /// Required points: earned and maximum.
    pub required: (String, String),
    /// Extra-credit points: earned and maximum.
    pub extra_credit: (String, String),
    /// Credit for the creative scene, earned and maximum; "no mark" in the place of what is earned without marks. `None`
    /// where a class has none.
    pub creative: Option<(String, String)>,
    /// Sum of all, with adjustments.
    pub points: String,
    /// The sum without adjustments and without rounding, as the shortest decimal; `None` if nothing was judged, or points
    /// are withheld.
    pub earned: Option<String>,
    /// Points that the teacher granted or withdrew, as the shortest decimals, with the reasons.
    pub adjustments: Vec<(String, String)>,
    /// Points of each feature that has some, earned and maximum.
    pub features: BTreeMap<String, String>,
    /// Points of scenes that were not judged.
    pub not_judged: String,
    /// Shipped scenes: passed and total.
    pub scenes: (usize, usize),
    /// Hidden scenes: passed and total; `None` where there are none, or they were not run.
    pub hidden: Option<(usize, usize)>,
    /// Findings about its forces and Jacobians: correct and total; `None` where they were not measured.
    pub jacobians: Option<(usize, usize)>,
    /// Terms that altered copies do not confirm, in words; `None` if they confirm every passed scene.
    pub copied: Option<String>,
    /// The likely causes of its failures, in words.
    pub findings: Vec<String>,
}

impl Row {
    /// The row of a grading.
    pub fn of(grading: &Grading) -> Self {
        let [required, extra] =
            [Section::Required, Section::ExtraCredit].map(|section| grading.totals(section));
        let both = [required, extra];
        let sum = |of: fn(&crate::grading::Totals) -> usize| both.iter().map(of).sum::<usize>();
        let shown = |totals: crate::grading::Totals| {
            (points::earned(&totals.credit, grading.faults), points::shown(totals.credit.points))
        };
        let together = grading.credit();
        Self {
            name: grading.submission.line(),
            verdict: verdict(grading),
            required: shown(required),
            extra_credit: shown(extra),
            creative: grading
                .creative
                .as_ref()
                .map(|creative| points::creative(creative, grading.faults)),
            points: match (together.shown(grading.faults), &*grading.adjustments) {
                (Some(earned), [_, ..]) => points::shown(grading.adjusted(earned)),
                _ => points::earned(&together, grading.faults),
            },
            adjustments: grading
                .adjustments
                .iter()
                .map(|it| (it.points.to_string(), it.reason.line()))
                .collect(),
            earned: together.shown(grading.faults).map(|earned| earned.to_string()),
            features: features(grading),
            not_judged: points::unjudged(&together),
            scenes: (sum(|totals| totals.passed), sum(|totals| totals.scenes)),
            hidden: (grading.hidden == Hidden::Run)
                .then(|| (sum(|totals| totals.hidden_passed), sum(|totals| totals.hidden))),
            jacobians: grading.probing.as_ref().map(Probing::counts),
            copied: grading.copied.as_ref().map(ToString::to_string),
            findings: findings(grading),
        }
    }

    /// The points that the teacher granted, less those withdrawn.
    pub fn adjustment(&self) -> f64 {
        self.adjustments.iter().filter_map(|(points, _)| points.parse::<f64>().ok()).sum()
    }

    /// How many points more it has than before, and in which features; `None` if it has the same points.
    pub fn change(&self, before: &Self) -> Option<Change> {
        let [now, then] = [self, before].map(|row| row.points.parse::<f64>().ok());
        let difference = now? - then?;
        let names: BTreeSet<&String> = self.features.keys().chain(before.features.keys()).collect();
        let of = |row: &Self, name: &String| {
            row.features.get(name).map_or_else(|| "none".to_owned(), Clone::clone)
        };
        let reasons = names.into_iter().filter(|name| of(self, name) != of(before, name));
        let reasons = reasons
            .map(|name| format!("{name} {} instead of {}", of(self, name), of(before, name)));
        let mut reasons: Vec<String> = reasons.collect();
        if self.adjustments != before.adjustments {
            reasons.push("adjustments".to_owned());
        }
        if self.creative != before.creative {
            reasons.push("creative scene".to_owned());
        }
        (self.points != before.points).then(|| Change {
            difference,
            message: format!(
                "changed: {}: {} instead of {} points ({})",
                self.name,
                self.points,
                before.points,
                reasons.join("; ")
            ),
        })
    }

    /// Whether its files could not be graded, and somebody should look at them.
    pub fn is_refused(&self) -> bool {
        self.verdict == Failure::BAD_HAND_IN
    }

    /// Whether something could not be judged.
    pub fn is_fault(&self) -> bool {
        self.verdict == FAULT
    }
}

/// A change of the points of a submission that was graded again.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// Points gained, or lost if it is negative.
    pub difference: f64,
    /// The points before and now, and the features with other points.
    pub message: String,
}

/// The points of features, for comparing with those of a later grading.
fn features(grading: &Grading) -> BTreeMap<String, String> {
    let with_points = grading.features.iter().filter(|it| it.feature.section != Section::Unscored);
    let named = with_points.map(|it| {
        let name = format!("{} / {}", it.feature.section.name(), it.feature);
        (name, points::of(&it.credit(), grading.faults))
    });
    named.collect()
}

/// The findings of the report; without any, what all scenes failed by, such as the build.
fn findings(grading: &Grading) -> Vec<String> {
    let mut findings: Vec<String> = grading.findings.list.iter().map(Finding::sentence).collect();
    if findings.is_empty() {
        let scenes = grading.features.iter().flat_map(|result| &result.scenes);
        let mut failures = scenes.map(|scene| match &scene.comparison.verdict {
            Verdict::Fail(failure) => Some(failure),
            _ => None,
        });
        let first = failures.next().flatten();
        let is_of_all = |first: &&Failure| {
            failures.all(|failure| failure.is_some_and(|failure| failure.name() == first.name()))
        };
        findings.extend(first.filter(|first| !first.has_numbers()).filter(is_of_all).map(
            |failure| {
                let said = failure.to_string();
                let said = Untrusted::from(said.lines().next().unwrap_or_default()).line();
                format!("{}: {said}", failure.name().replace('-', " "))
            },
        ));
    }
    findings
}

/// Verdict of rows in which something could not be judged.
const FAULT: &str = "grader-fault";

fn verdict(grading: &Grading) -> String {
    let outcome = match grading.outcome_in_class() {
        GradingOutcome::Passed => "passed",
        GradingOutcome::PassedShipped => "passed-shipped",
        GradingOutcome::GraderFault => FAULT,
        GradingOutcome::Failed => {
            let scenes = grading.features.iter().flat_map(|result| &result.scenes);
            let mut names = scenes.map(|scene: &SceneResult| match &scene.comparison.verdict {
                Verdict::Fail(failure) => failure.name(),
                _ => "failed",
            });
            let first = names.next().unwrap_or("failed");
            if names.all(|name| name == first) { first } else { "failed" }
        }
    };
    outcome.to_owned()
}
