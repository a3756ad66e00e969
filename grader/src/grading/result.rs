//! The result of grading a submission: everything that reports show, and its sums.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::fmt;

use super::altered::{Copied, Passed};
use crate::boundary::printed::Untrusted;
use crate::compare::recording::Recording;
use crate::compare::{Comparison, Criteria, Tolerances};
use crate::functions::Function;
use crate::probe::Probing;
use crate::rubric::creative::{CRITERIA, CreativeCredit, CreativeRule};
use crate::rubric::{FaultPoints, OtherRoot, Rubric};
use crate::suite::assignment::Assignment;
use crate::suite::{Case, Feature, Section, Suite};
use crate::verdict::{Fault, Verdict};
use crate::white_box::JacobianReport;
use diagnosis::findings::Diagnosis;
use diagnosis::findings::Findings;
use sandbox::Protection;

use super::provenance::Provenance;

/// The content of a report.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Grading {
    /// The submission's name.
    pub submission: Untrusted,
    /// The assignment that was graded; `None` if every scene was.
    pub assignment: Option<AssignmentName>,
    /// The assignment that the submission fits, if every scene was graded and it fits exactly one.
    pub fitting: Option<AssignmentName>,
    /// Whether it is the built-in simulator, which passes only if every feature does.
    pub is_own: bool,
    /// Features in the order of the report: by section, group, integrator.
    pub features: Vec<FeatureResult>,
    /// Protection under which its programs ran; `None` where it has none.
    pub protection: Option<Vec<Protection>>,
    /// The files that a pack took from the hand-in, in words; `None` without a pack.
    pub taken: Option<Untrusted>,
    /// Whether its programs are deterministic; `None` where it has none.
    pub repetition: Option<Repetition>,
    /// Its program's forces and Jacobians, measured from single steps; `None` if not measured.
    pub probing: Option<Probing>,
    /// Terms that altered copies do not confirm; `None` if they confirm every passed scene, or nothing was checked.
    pub copied: Option<Copied>,
    /// Findings; empty if nothing failed.
    pub findings: Findings,
    /// Jacobian checks; empty where the submission is not the built-in simulator.
    pub jacobians: JacobianReport,
    /// Whether hidden scenes exist and were run.
    pub hidden: Hidden,
    /// Credit for its creative scene; `None` if no scenes were marked.
    pub creative: Option<CreativeCredit>,
    /// Points that the teacher granted or withdrew.
    pub adjustments: Vec<Adjustment>,
    /// Display of points if something could not be judged.
    pub faults: FaultPoints,
    /// Progress of a run that was ended early.
    pub interrupted: Option<Interrupted>,
    /// Changes since the last run of the same submission; `None` if none is known.
    pub since: Option<Since>,
    /// Its provenance; `None` if unknown.
    pub provenance: Option<Provenance>,
}

/// Scenes whose verdict changed since the last run of a submission, by name.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Since {
    /// Those that failed and pass.
    pub mended: Vec<String>,
    /// Those that passed and fail.
    pub broken: Vec<String>,
}

/// Points that a teacher granted, or withdrew if they are negative.
#[derive(Debug, Clone, PartialEq)]
pub struct Adjustment {
    /// The points.
    pub points: f64,
    /// Why; students read it.
    pub reason: Untrusted,
}

/// An assignment in reports.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AssignmentName {
    /// Its name on the command line.
    pub name: String,
    /// Its title.
    pub title: String,
}

impl AssignmentName {
    /// The name of an assignment.
    pub fn of(assignment: &Assignment) -> Self {
        Self { name: assignment.name.clone(), title: assignment.title.clone() }
    }
}

/// Progress of a run that was ended early.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interrupted {
    /// Scenes graded.
    pub graded: usize,
    /// All scenes, without hidden ones.
    pub scenes: usize,
    /// Whether `--fail-fast` ended it.
    pub fail_fast: bool,
}

impl fmt::Display for Interrupted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} of {} scenes graded", self.graded, self.scenes)
    }
}

/// Scenes that were run twice.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Repetition {
    /// Number of scenes that were run twice.
    pub scenes: usize,
    /// Names of the scenes whose two traces differed in some byte.
    pub differing: Vec<String>,
}

/// A feature with its scenes.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureResult {
    /// The feature.
    pub feature: Feature,
    /// Maximum points.
    pub points: f64,
    /// Whether it earns points in proportion to its passed scenes, rather than all or nothing.
    pub partial: bool,
    /// Its scenes, by name.
    pub scenes: Vec<SceneResult>,
    /// Its hidden scenes; empty if they were not run.
    pub hidden: HiddenTally,
}

/// A scene with its verdict.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneResult {
    /// The scene's name.
    pub id: String,
    /// The path of the scene's file ([`Case::shown_path`](crate::suite::Case::shown_path)).
    pub path: String,
    /// Number of its particles.
    pub n_particles: usize,
    /// The criteria it was judged by.
    pub criteria: Criteria,
    /// Its weight among the scenes of its feature.
    pub weight: f64,
    /// The comparison of its trace with the oracle's.
    pub comparison: Comparison,
    /// The reason of a difference; `None` where there is no difference or no reason is found.
    pub diagnosis: Option<Diagnosis>,
    /// The comparison, reduced for display; `None` where it was not asked for.
    pub recording: Option<Recording>,
}

impl FeatureResult {
    /// A feature that has no scenes yet.
    pub(super) fn new(feature: Feature, rubric: &Rubric) -> Self {
        Self {
            points: rubric.points(&feature),
            partial: rubric.partial(&feature),
            feature,
            scenes: Vec::new(),
            hidden: HiddenTally::default(),
        }
    }

    /// A function that is graded by itself, as a feature with one check.
    pub(super) fn of_function(function: &Function, verdict: Verdict) -> Self {
        let scene = SceneResult {
            id: function.id(),
            path: function.id(),
            n_particles: 0,
            criteria: Tolerances::COURSE.into(),
            weight: 1.0,
            comparison: Comparison::without_states(verdict),
            diagnosis: None,
            recording: None,
        };
        Self {
            feature: Feature { section: Section::Required, group: function.id(), integrator: "" },
            points: function.points,
            partial: false,
            scenes: vec![scene],
            hidden: HiddenTally::default(),
        }
    }

    /// Whether every scene passed, hidden ones included.
    pub fn is_pass(&self) -> bool {
        self.n_passed() == self.scenes.len() && self.hidden.n_passed() == self.hidden.n_scenes()
    }

    /// Whether the submission lacks what every scene needs.
    pub fn is_lacking(&self) -> bool {
        !self.scenes.is_empty() && self.scenes.iter().all(|s| s.comparison.verdict.is_lack())
    }

    /// Whether any scene passed, hidden ones included.
    pub fn has_passes(&self) -> bool {
        self.n_passed() + self.hidden.n_passed() > 0
    }

    /// Whether any scene could not be judged, hidden ones included.
    pub fn has_faults(&self) -> bool {
        self.n_faults() + self.hidden.n_faults() > 0
    }

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

    /// Its points earned, lost and not judged: in proportion to the weights of all its scenes, or all or nothing.
    pub fn credit(&self) -> Credit {
        let HiddenTally {
            weight_passed: mut passed,
            weight_unjudged: mut unjudged,
            mut weight,
            ..
        } = self.hidden;
        for scene in &self.scenes {
            weight += scene.weight;
            match scene.comparison.verdict {
                Verdict::Pass => passed += scene.weight,
                Verdict::Fail(_) => {}
                Verdict::GraderFault(_) => unjudged += scene.weight,
            }
        }
        let n_scenes = self.scenes.len() + self.hidden.n_scenes();
        let n_passed = self.n_passed() + self.hidden.n_passed();
        let n_faults = self.n_faults() + self.hidden.n_faults();
        let (earned, unjudged) = match () {
            // Exact: a quotient could lose the last bit.
            () if n_passed == n_scenes => (self.points, 0.0),
            () if n_faults == n_scenes => (0.0, self.points),
            () if self.partial => (self.points * passed / weight, self.points * unjudged / weight),
            () if n_passed + n_faults < n_scenes => (0.0, 0.0),
            () => (0.0, self.points),
        };
        Credit { points: self.points, earned, unjudged }
    }

    /// The largest position and velocity residual of its scenes, except those that pass at another root; `None` where
    /// none was compared.
    pub fn largest_residuals(&self) -> Option<(f64, f64)> {
        let comparisons = self.scenes.iter().map(|scene| &scene.comparison);
        let residuals = comparisons
            .filter(|comparison| comparison.is_compared() && comparison.other_root.is_none())
            .map(|Comparison { position, velocity, .. }| (position.largest, velocity.largest));
        residuals.reduce(|(p, v), (position, velocity)| (p.max(position), v.max(velocity)))
    }
}

/// Points of a feature or a sum of features. Points that are neither earned nor unjudged are lost.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Credit {
    /// Maximum points.
    pub points: f64,
    /// Points earned.
    pub earned: f64,
    /// Points of scenes that could not be judged.
    pub unjudged: f64,
}

impl Credit {
    /// That of a creative scene; `None` if it has no mark.
    pub fn of_creative(creative: &CreativeCredit) -> Option<Self> {
        let earned = creative.earned()?;
        Some(Self { points: creative.points, earned, unjudged: 0.0 })
    }

    /// The points earned for display; `None` if nothing was judged or points are withheld.
    pub fn shown(&self, faults: FaultPoints) -> Option<f64> {
        let is_withheld = faults == FaultPoints::Withheld || self.unjudged >= self.points;
        (self.unjudged == 0.0 || !is_withheld).then_some(self.earned)
    }
}

impl std::ops::Add for Credit {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            points: self.points + other.points,
            earned: self.earned + other.earned,
            unjudged: self.unjudged + other.unjudged,
        }
    }
}

/// Sums over the features of a section.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Totals {
    /// Scenes, without hidden ones.
    pub scenes: usize,
    /// Scenes that passed.
    pub passed: usize,
    /// Scenes that could not be judged.
    pub faults: usize,
    /// Hidden scenes that were run.
    pub hidden: usize,
    /// Hidden scenes that passed.
    pub hidden_passed: usize,
    /// Hidden scenes that could not be judged.
    pub hidden_faults: usize,
    /// Features.
    pub features: usize,
    /// Features all of whose scenes passed, hidden ones included.
    pub features_passed: usize,
    /// Sum of their points.
    pub credit: Credit,
}

impl Totals {
    /// Sums over these features.
    pub fn of<'a>(features: impl IntoIterator<Item = &'a FeatureResult>) -> Self {
        let mut totals = Self::default();
        for result in features {
            totals.scenes += result.scenes.len();
            totals.passed += result.n_passed();
            totals.faults += result.n_faults();
            totals.hidden += result.hidden.n_scenes();
            totals.hidden_passed += result.hidden.n_passed();
            totals.hidden_faults += result.hidden.n_faults();
            totals.features += 1;
            totals.features_passed += usize::from(result.is_pass());
            totals.credit = totals.credit + result.credit();
        }
        totals
    }
}

/// Overall result of a grading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GradingOutcome {
    /// Every required feature passed.
    Passed,
    /// Every required feature passed, but hidden scenes were not run.
    PassedShipped,
    /// A required feature failed; in a grading without required features, any feature.
    Failed,
    /// Something could not be judged.
    GraderFault,
}

impl Grading {
    /// Sums over the features of `section`.
    pub fn totals(&self, section: Section) -> Totals {
        Totals::of(self.features.iter().filter(|result| result.feature.section == section))
    }

    /// All points: required, extra credit, and of the creative scene if it has marks.
    pub fn credit(&self) -> Credit {
        let sections = [Section::Required, Section::ExtraCredit];
        let [required, extra] = sections.map(|section| self.totals(section).credit);
        let creative = self.creative.as_ref().and_then(Credit::of_creative);
        required + extra + creative.unwrap_or_default()
    }

    /// Adds the credit for the marks of its creative scene.
    pub fn add_marks(&mut self, rule: CreativeRule, marks: &[[f64; CRITERIA.len()]]) {
        let required = self.totals(Section::Required).credit.points;
        self.creative = Some(rule.credit(marks, required));
    }

    /// Points after adjustments, which make none negative.
    pub fn adjusted(&self, points: f64) -> f64 {
        (points + self.adjustments.iter().map(|it| it.points).sum::<f64>()).max(0.0)
    }

    /// The features of `section`, group by group.
    pub fn groups(&self, section: Section) -> impl Iterator<Item = &[FeatureResult]> {
        let same = |a: &FeatureResult, b: &FeatureResult| {
            (a.feature.section, &a.feature.group) == (b.feature.section, &b.feature.group)
        };
        let groups = self.features.chunk_by(same);
        groups.filter(move |group| group.iter().all(|result| result.feature.section == section))
    }

    /// Marks the grading as ended early and drops statements about all scenes together.
    pub fn interrupt(&mut self, suite: &Suite) {
        let graded = self.features.iter().map(|result| result.scenes.len()).sum();
        self.interrupted =
            Some(Interrupted { graded, scenes: suite.cases.len(), fail_fast: false });
        (self.repetition, self.probing, self.copied) = (None, None, None);
        self.findings = Findings::default();
        self.fitting = None;
    }

    /// The names of the scenes that passed.
    pub fn passed(&self) -> HashSet<&str> {
        let scenes = self.features.iter().flat_map(|feature| &feature.scenes);
        let passed = scenes.filter(|scene| scene.comparison.verdict.is_pass());
        passed.map(|scene| scene.id.as_str()).collect()
    }

    /// The scenes that passed by their own states rather than as another root.
    pub fn passed_cases<'a>(&'a self, suite: &'a Suite, other_root: OtherRoot) -> Vec<Passed<'a>> {
        let results = self.features.iter().flat_map(|feature| &feature.scenes);
        let passed = results.filter(|scene| scene.comparison.verdict.is_pass());
        let passed = passed.filter(|scene| scene.comparison.other_root.is_none());
        let criteria: HashMap<&str, &Criteria> =
            passed.map(|scene| (scene.id.as_str(), &scene.criteria)).collect();
        let of = |case: &'a Case| {
            let criteria = criteria.get(case.id.as_str())?;
            Some(Passed { case, criteria, other_root })
        };
        suite.cases.iter().filter_map(of).collect()
    }

    /// Adds what altered copies do not confirm. Scenes that fail there do not count as passed.
    pub(super) fn withdraw(&mut self, copied: Option<Copied>) {
        for scene in self.features.iter_mut().flat_map(|feature| &mut feature.scenes) {
            if let Some(failure) = copied.as_ref().and_then(|copied| copied.failure(&scene.id)) {
                scene.comparison.verdict = Verdict::Fail(failure);
            }
        }
        self.copied = copied;
    }

    /// Whether every feature passed, whether it is required or not.
    pub fn is_flawless(&self) -> bool {
        self.features.iter().all(FeatureResult::is_pass) && self.jacobians.is_pass()
    }

    /// The overall result. A fault of the grader outweighs a failure. Extra credit decides only where nothing is
    /// required, as with `--only`; measured Jacobians do not decide, since the scenes show what is wrong.
    pub fn outcome(&self) -> GradingOutcome {
        if self.features.iter().any(FeatureResult::has_faults) {
            return GradingOutcome::GraderFault;
        }
        self.outcome_of_judged(FeatureResult::is_pass)
    }

    /// Whether every scene that did not pass lacks something, so that no failure shows a mistake.
    pub fn only_lacks(&self) -> bool {
        let mut scenes = self.features.iter().flat_map(|feature| &feature.scenes);
        let passes_hidden =
            |feature: &FeatureResult| feature.hidden.n_passed() == feature.hidden.n_scenes();
        scenes.all(|s| s.comparison.verdict.is_pass() || s.comparison.verdict.is_lack())
            && self.features.iter().all(passes_hidden)
            && self.jacobians.is_pass()
    }

    /// The result as one of a class: scenes whose oracle traces cannot be used count for no submission, and do not
    /// decide.
    pub fn outcome_in_class(&self) -> GradingOutcome {
        let scenes = self.features.iter().flat_map(|feature| &feature.scenes);
        let mut faults = scenes.filter_map(|scene| match &scene.comparison.verdict {
            Verdict::GraderFault(fault) => Some(fault),
            _ => None,
        });
        let scenes = self.features.iter().map(|feature| feature.scenes.len()).sum::<usize>();
        let n_faults = self.features.iter().map(FeatureResult::n_faults).sum::<usize>();
        let has_hidden = self.features.iter().any(|feature| feature.hidden.n_faults() > 0);
        if has_hidden || n_faults > 0 && n_faults == scenes || !faults.all(Fault::is_of_oracle) {
            return GradingOutcome::GraderFault;
        }
        self.outcome_of_judged(|feature| {
            let all = feature.n_passed() + feature.n_faults() == feature.scenes.len();
            all && feature.hidden.n_passed() == feature.hidden.n_scenes()
        })
    }

    /// Whether a failure of this feature is one of the submission: extra credit decides only where nothing is required.
    pub fn decides(&self, result: &FeatureResult) -> bool {
        let is_required = |result: &FeatureResult| result.feature.section == Section::Required;
        self.is_own || is_required(result) || !self.features.iter().any(is_required)
    }

    fn outcome_of_judged(&self, is_pass: impl Fn(&FeatureResult) -> bool) -> GradingOutcome {
        let mut deciding = self.features.iter().filter(|result| self.decides(result));
        if !(deciding.all(is_pass) && self.jacobians.is_pass()) {
            GradingOutcome::Failed
        } else if matches!(self.hidden, Hidden::NotRun { .. }) {
            GradingOutcome::PassedShipped
        } else {
            GradingOutcome::Passed
        }
    }
}

/// Hidden scenes of a grading.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Hidden {
    /// There are none.
    #[default]
    None,
    /// There are hidden scenes, but they were not run.
    NotRun {
        /// Their number, if known.
        scenes: Option<usize>,
        /// Why.
        reason: NotRunReason,
    },
    /// They were run.
    Run,
}

/// Why hidden scenes were not run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NotRunReason {
    /// They were not available, or not asked for.
    Unavailable,
    /// The system refuses the namespaces that keep a program from telling another one about them.
    WithoutNamespaces,
}

/// Hidden scenes of one feature, counted by verdict.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HiddenTally {
    /// Number of scenes by the name of their verdict.
    pub verdicts: BTreeMap<&'static str, usize>,
    /// Weight of the passed scenes.
    pub weight_passed: f64,
    /// Weight of the scenes that could not be judged.
    pub weight_unjudged: f64,
    /// Weight of all scenes.
    pub weight: f64,
}

impl HiddenTally {
    /// Hidden scenes.
    pub fn n_scenes(&self) -> usize {
        self.verdicts.values().sum()
    }

    /// Number of passed scenes.
    pub fn n_passed(&self) -> usize {
        self.count(&Verdict::Pass)
    }

    /// Number of scenes that could not be judged.
    pub fn n_faults(&self) -> usize {
        let fault = Fault::StaleOracle;
        self.count(&Verdict::GraderFault(fault))
    }

    fn count(&self, verdict: &Verdict) -> usize {
        self.verdicts.get(verdict.name()).copied().unwrap_or(0)
    }

    pub(super) fn add(&mut self, scene: &SceneResult) {
        let verdict = &scene.comparison.verdict;
        *self.verdicts.entry(verdict.name()).or_default() += 1;
        self.weight += scene.weight;
        match verdict {
            Verdict::Pass => self.weight_passed += scene.weight,
            Verdict::Fail(_) => {}
            Verdict::GraderFault(_) => self.weight_unjudged += scene.weight,
        }
    }
}

/// Gathers the results of scenes by feature, in the order of the suite.
pub(super) fn gather(
    submission: Untrusted,
    rubric: &Rubric,
    results: Vec<(&Case, SceneResult)>,
    findings: Findings,
) -> Grading {
    let mut features: Vec<FeatureResult> = Vec::new();
    for (case, result) in results {
        match features.iter_mut().find(|known| known.feature == case.feature) {
            Some(known) => known.scenes.push(result),
            None => {
                let mut feature = FeatureResult::new(case.feature.clone(), rubric);
                feature.scenes.push(result);
                features.push(feature);
            }
        }
    }
    features.sort_by(|a, b| a.feature.cmp(&b.feature));
    Grading { submission, features, findings, faults: rubric.fault_points(), ..Grading::default() }
}

#[cfg(test)]
mod tests {

    use super::*;
    use crate::verdict::Failure;

    /// A feature of scenes with these weights: passed, failed, or not judged.
    fn feature(partial: bool, scenes: &[(f64, char)]) -> FeatureResult {
        let scene = |&(weight, kind): &(f64, char)| SceneResult {
            id: String::new(),
            n_particles: 1,
            path: String::new(),
            criteria: Tolerances::COURSE.into(),
            weight,
            comparison: Comparison::without_states(match kind {
                'p' => Verdict::Pass,
                'f' => Verdict::Fail(Failure::Differs),
                _ => Verdict::GraderFault(Fault::StaleOracle),
            }),
            diagnosis: None,
            recording: None,
        };
        FeatureResult {
            feature: Feature {
                section: Section::Required,
                group: String::new(),
                integrator: "explicit-euler",
            },
            points: 0.7,
            partial,
            scenes: scenes.iter().map(scene).collect(),
            hidden: HiddenTally::default(),
        }
    }

    #[test]
    fn points_not_judged_are_neither_earned_nor_lost() {
        let credit = |partial, scenes: &[(f64, char)]| {
            let Credit { earned, unjudged, .. } = feature(partial, scenes).credit();
            (earned, unjudged)
        };
        let [third, half] = [0.7 * 1.0 / 3.0, 0.7 * 2.0 / 4.0];
        for (scenes, partial, all_or_nothing) in [
            (&[(1.0, '?'), (1.0, '?')][..], (0.0, 0.7), (0.0, 0.7)),
            (&[(1.0, 'p'), (1.0, 'f'), (1.0, '?')], (third, third), (0.0, 0.0)),
            (&[(1.0, 'p'), (2.0, '?'), (1.0, 'p')], (half, half), (0.0, 0.7)),
            (&[(0.1, 'p'), (0.2, 'p'), (0.3, 'p')], (0.7, 0.0), (0.7, 0.0)),
            (&[(3.0, 'f')], (0.0, 0.0), (0.0, 0.0)),
        ] {
            assert_eq!(credit(true, scenes), partial, "{scenes:?}");
            assert_eq!(credit(false, scenes), all_or_nothing, "{scenes:?}");
        }
        let mut hidden = feature(true, &[(1.0, 'p')]);
        let verdicts = [("pass", 1), ("grader-fault", 1), ("differs", 1)].into();
        let (weight_passed, weight_unjudged, weight) = (1.0, 1.0, 3.0);
        hidden.hidden = HiddenTally { verdicts, weight_passed, weight_unjudged, weight };
        assert_eq!(hidden.credit(), Credit { points: 0.7, earned: half, unjudged: 0.7 / 4.0 });
    }

    #[test]
    fn earned_points_are_shown_if_something_was_judged() {
        let shown = |earned, unjudged| {
            let credit = Credit { points: 2.0, earned, unjudged };
            [FaultPoints::Apart, FaultPoints::Withheld].map(|faults| credit.shown(faults))
        };
        assert_eq!(shown(1.0, 0.0), [Some(1.0), Some(1.0)]);
        assert_eq!(shown(1.0, 1.0), [Some(1.0), None]);
        assert_eq!(shown(0.0, 2.0), [None, None]);
    }
}
