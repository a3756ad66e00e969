//! Hidden scenes: a second suite that counts towards the points. Reports show only counts of its verdicts.
//!
//! ```text
//! hidden/assets/, hidden/extracreditassets/, hidden/expected/    laid out as the shipped suite
//!
//! scene -> Verdict -> Tally (verdict names, counted by feature) -> Grading
//! ```
//!
//! Only a [`HiddenTally`] leaves this module. No report can therefore show names, paths, numbers, states or messages of
//! hidden scenes, or output of programs on them. Hidden scenes run after everything else of a submission, so that no run with
//! visible output can depend on them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use scene::ParseOptions;

use super::events::{Event, Observer, Task};
use super::judge::{Judged, judge_case};
use super::result::{FeatureResult, Grading, Hidden, HiddenTally, SceneResult};
use crate::oracle::Oracle;
use crate::rubric::Rubric;
use crate::submission::Submission;
use crate::suite::assignment::Assignment;
use crate::suite::{Case, Feature, Section, Suite};
use crate::verdict::Failure;

/// Group name of hidden scenes whose own group has no shipped scene: that name is hidden as well.
pub const HIDDEN_GROUP: &str = "hidden";

/// Hidden scenes and their oracle.
#[derive(Debug)]
pub struct HiddenSuite {
    suite: Suite,
    oracle: Oracle,
    /// Number of hidden scenes in the folder.
    n_found: usize,
}

/// Hidden scenes that cannot be used. The messages contain no scene name.
#[derive(Debug, thiserror::Error)]
pub enum HiddenError {
    /// The folder does not exist, or contains no scenes.
    #[error(
        "{}: there are no hidden scenes\n  help: the folder must contain assets/ or extracreditassets/, and expected/", .0.display()
    )]
    NoScenes(PathBuf),
    /// A scene, or the manifest, cannot be read.
    #[error("{0}: the hidden scenes cannot be used\n  help: run `grade oracle verify --root {0}` for the reason", root.display())]
    Unusable {
        /// The folder.
        root: PathBuf,
    },
}

impl HiddenSuite {
    /// Reads the hidden scenes below `root`, and keeps those of the assignment, if any. Group names without scenes in
    /// `shipped` are replaced by [`HIDDEN_GROUP`].
    ///
    /// # Errors
    /// If there are none, or one cannot be read.
    pub fn load(
        root: &Path,
        shipped: &Suite,
        assignment: Option<&Assignment>,
        options: &ParseOptions,
    ) -> Result<Self, HiddenError> {
        let sections = [
            (Section::Required, root.join("assets")),
            (Section::ExtraCredit, root.join("extracreditassets")),
        ];
        if !sections.iter().any(|(_, folder)| folder.is_dir()) {
            return Err(HiddenError::NoScenes(root.to_path_buf()));
        }
        let unusable = || HiddenError::Unusable { root: root.to_path_buf() };
        let expected = root.join("expected");
        if !expected.is_dir() {
            return Err(unusable());
        }
        let mut suite = Suite::load(&sections, options).map_err(|_| unusable())?;
        let oracle = Oracle::open(&expected).map_err(|_| unusable())?;
        let n_found = suite.cases.len();
        if let Some(assignment) = assignment {
            suite.reassign(|case| assignment.place(case));
        }
        for case in &mut suite.cases {
            let is_known = |known: &Case| {
                known.feature.section == case.feature.section
                    && known.feature.group == case.feature.group
            };
            if !shipped.cases.iter().any(is_known) {
                HIDDEN_GROUP.clone_into(&mut case.feature.group);
            }
        }
        Ok(Self { suite, oracle, n_found })
    }

    /// Number of hidden scenes in the folder, whether they belong to the assignment or not.
    pub fn n_found(&self) -> usize {
        self.n_found
    }

    /// Number of hidden scenes that are graded.
    pub fn n_scenes(&self) -> usize {
        self.suite.cases.len()
    }

    /// Number of warnings about their files.
    pub fn n_warnings(&self) -> usize {
        self.suite.warnings.len()
    }

    /// The scenes, for the check of the rubric and for hashes.
    pub fn cases(&self) -> &[Case] {
        &self.suite.cases
    }

    /// Their oracle.
    pub(crate) fn oracle(&self) -> &Oracle {
        &self.oracle
    }

    /// Runs `submission` on them and adds the counts to its grading. With a failure, they have that failure and are not
    /// run.
    pub fn grade(
        &self,
        submission: &Submission,
        (rubric, skipped): (&Rubric, Option<&Failure>),
        grading: &mut Grading,
        observer: &dyn Observer,
    ) {
        observer.notice(Event::Task(Task::HiddenScenes(self.n_scenes())));
        let judge = |case: &Case| {
            if observer.is_stopped() {
                return None;
            }
            observer.notice(Event::SceneStarted { name: None });
            let judged = match skipped {
                // Nothing is recorded: no report may show it.
                None => judge_case(case, &self.oracle, rubric, submission, false),
                Some(failure) => Judged::skipped(case, &self.oracle, rubric, failure.clone()),
            };
            let result = judged.result;
            let passed = result.comparison.verdict.is_pass();
            observer.notice(Event::SceneFinished { name: None, passed });
            (!observer.is_stopped()).then_some(result)
        };
        let results: Option<Vec<SceneResult>> = self.suite.cases.par_iter().map(judge).collect();
        let Some(results) = results else { return };
        let mut tallies: BTreeMap<&Feature, HiddenTally> = BTreeMap::new();
        for (case, result) in self.suite.cases.iter().zip(&results) {
            tallies.entry(&case.feature).or_default().add(result);
        }
        for (feature, tally) in tallies {
            let known = grading.features.iter_mut().find(|known| known.feature == *feature);
            match known {
                Some(known) => known.hidden = tally,
                None => {
                    let mut result = FeatureResult::new(feature.clone(), rubric);
                    result.hidden = tally;
                    grading.features.push(result);
                }
            }
        }
        grading.features.sort_by(|a, b| a.feature.cmp(&b.feature));
        if let Some(copied) = &mut grading.copied {
            let tallies = || grading.features.iter().map(|result| &result.hidden);
            let judged = tallies().map(|tally| tally.n_scenes() - tally.n_faults()).sum();
            copied.add_hidden(judged, tallies().map(HiddenTally::n_passed).sum());
        }
        grading.hidden = Hidden::Run;
    }
}
