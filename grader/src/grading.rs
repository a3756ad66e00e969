//! A submission graded over a suite: scenes in parallel, results in the suite's order.

use std::path::Path;

use rayon::prelude::*;
use simulator::trace::{self, Shape};

use crate::compare::{Comparison, Expectation, Tolerances, compare};
use crate::jacobian::JacobianCheck;
use crate::oracle::Oracle;
use crate::rubric::Rubric;
use crate::submission::Submission;
use crate::suite::{Case, Feature, Section, Suite, find_trace};
use crate::verdict::{Fault, Verdict};

/// Everything a report says.
#[derive(Debug, Clone, PartialEq)]
pub struct Grading {
    /// What the submission is called.
    pub submission: String,
    /// Features in the order of the report: by section, group, integrator.
    pub features: Vec<FeatureResult>,
    /// Jacobian checks; empty where the submission is not the built-in simulator.
    pub jacobians: Vec<JacobianCheck>,
}

/// A feature with its scenes.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureResult {
    /// The feature.
    pub feature: Feature,
    /// Points it may earn.
    pub points: f64,
    /// Its scenes, by name.
    pub scenes: Vec<SceneResult>,
}

/// A scene with its verdict.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneResult {
    /// The scene's name.
    pub id: String,
    /// The scene's path, as given.
    pub path: String,
    /// The tolerances it was judged by.
    pub tolerances: Tolerances,
    /// How its trace compares.
    pub comparison: Comparison,
}

impl FeatureResult {
    /// Scenes that passed.
    pub fn n_passed(&self) -> usize {
        self.scenes.iter().filter(|scene| scene.comparison.verdict.is_pass()).count()
    }

    /// Scenes that could not be judged.
    pub fn n_faults(&self) -> usize {
        let is_fault =
            |scene: &&SceneResult| matches!(scene.comparison.verdict, Verdict::GraderFault(_));
        self.scenes.iter().filter(is_fault).count()
    }

    /// Points earned: in proportion to the judged scenes that passed. A scene that could not be judged
    /// costs nothing.
    pub fn points_earned(&self) -> f64 {
        let judged = self.scenes.len() - self.n_faults();
        if judged == 0 { self.points } else { self.points * self.n_passed() as f64 / judged as f64 }
    }

    /// The largest position and velocity residual of its scenes.
    pub fn largest_residuals(&self) -> (f64, f64) {
        self.scenes.iter().fold((0.0, 0.0), |(position, velocity), scene| {
            let Comparison { position: p, velocity: v, .. } = &scene.comparison;
            (p.largest.max(position), v.largest.max(velocity))
        })
    }
}

/// Sums over the features of a section.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Totals {
    /// Scenes.
    pub scenes: usize,
    /// Scenes that passed.
    pub passed: usize,
    /// Scenes that could not be judged.
    pub faults: usize,
    /// Features.
    pub features: usize,
    /// Features of which every scene passed.
    pub features_passed: usize,
    /// Points that may be earned.
    pub points: f64,
    /// Points earned.
    pub points_earned: f64,
}

/// What a grading comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Everything passed.
    Passed,
    /// Something failed.
    Failed,
    /// Something could not be judged.
    GraderFault,
}

impl Grading {
    /// Sums over the features of `section`.
    pub fn totals(&self, section: Section) -> Totals {
        let mut totals = Totals::default();
        for result in self.features.iter().filter(|result| result.feature.section == section) {
            totals.scenes += result.scenes.len();
            totals.passed += result.n_passed();
            totals.faults += result.n_faults();
            totals.features += 1;
            totals.features_passed += usize::from(result.n_passed() == result.scenes.len());
            totals.points += result.points;
            totals.points_earned += result.points_earned();
        }
        totals
    }

    /// What it comes to: a fault of the grader outweighs a failure.
    pub fn outcome(&self) -> Outcome {
        let totals = Section::ALL.map(|section| self.totals(section));
        if totals.iter().any(|totals| totals.faults > 0) {
            Outcome::GraderFault
        } else if totals.iter().any(|totals| totals.passed < totals.scenes)
            || self.jacobians.iter().any(|check| !check.is_pass())
        {
            Outcome::Failed
        } else {
            Outcome::Passed
        }
    }
}

/// Grades `submission` on every scene of the suite.
pub fn grade(
    suite: &Suite,
    submission: &Submission,
    oracle: &Oracle,
    rubric: &Rubric,
    jacobians: Vec<JacobianCheck>,
) -> Grading {
    let judge = |case: &Case| {
        let tolerances = rubric.tolerances(case);
        SceneResult {
            id: case.id.clone(),
            path: case.scene.name.clone(),
            tolerances,
            comparison: judge(case, submission, oracle, tolerances),
        }
    };
    let results: Vec<SceneResult> = suite.cases.par_iter().map(judge).collect();

    let mut features: Vec<FeatureResult> = Vec::new();
    for (case, result) in suite.cases.iter().zip(results) {
        match features.iter_mut().find(|known| known.feature == case.feature) {
            Some(known) => known.scenes.push(result),
            None => features.push(FeatureResult {
                points: rubric.points(&case.feature),
                feature: case.feature.clone(),
                scenes: vec![result],
            }),
        }
    }
    features.sort_by(|a, b| a.feature.cmp(&b.feature));
    Grading { submission: submission.name(), features, jacobians }
}

fn judge(
    case: &Case,
    submission: &Submission,
    oracle: &Oracle,
    tolerances: Tolerances,
) -> Comparison {
    let expectation = Expectation {
        shape: Shape::of(&case.scene),
        time_step: case.scene.time_step,
        n_states: case.scene.n_steps() + 1,
    };
    let mut expected = match open_oracle(case, oracle, expectation.shape) {
        Ok(expected) => expected,
        Err(fault) => return Comparison::without_states(Verdict::GraderFault(fault)),
    };
    match submission.states(case) {
        Ok(mut actual) => compare(expected.as_mut(), actual.as_mut(), expectation, tolerances),
        Err(failure) => Comparison::without_states(Verdict::Fail(failure)),
    }
}

fn open_oracle(
    case: &Case,
    oracle: &Oracle,
    shape: Shape,
) -> Result<Box<dyn trace::TraceReader>, Fault> {
    let Some((path, format)) = find_trace(&oracle.folder, &case.id) else {
        return Err(Fault::NoOracle { trace: display(&oracle.folder.join(&case.id)) + ".csv" });
    };
    oracle.check(case, &path)?;
    let broken = |error: trace::TraceError| Fault::BrokenOracle { detail: error.to_string() };
    trace::open(&path, format, shape).map_err(broken)
}

fn display(path: &Path) -> String {
    path.display().to_string()
}
