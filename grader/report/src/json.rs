//! Grading as JSON. The version changes if a field is removed or changes its meaning.
//!
//! The schema is `docs/report.schema.json`. Non-finite numbers are `null`.

mod failure;

use serde::Serialize;
use std::collections::BTreeMap;

use super::jacobians::json::{JsonJacobian, JsonNewton};
use super::probe::json::JsonProbing;
use super::provenance::JsonProvenance;
use super::remarks::{self, Unexplained};
use super::{SCHEMA_VERSION, text};
use diagnosis::findings::Diagnosis;
use diagnosis::findings::{Finding, Progress, TaskFinding};
use grader::compare::calibration::{Bound, Envelope};
use grader::compare::{Allowed, Comparison, Criteria, FirstWrong, Residuals, Tolerances};
use grader::grading::altered::{Copied, Withdrawn};
use grader::grading::{
    Adjustment, Credit, FeatureResult, Grading, GradingOutcome, Hidden, HiddenTally, NotRunReason,
    SceneResult, Totals,
};
use grader::rubric::FaultPoints;
use grader::rubric::creative::CreativeCredit;
use grader::suite::Section;

use failure::JsonFailure;

/// The report as JSON, with a newline at its end.
///
/// # Errors
/// Never in practice: every value has a JSON form.
pub fn render(grading: &Grading) -> serde_json::Result<String> {
    Ok(serde_json::to_string_pretty(&Report::of(grading))? + "\n")
}

/// A grading of one submission.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(title = "Spring Oracle report"))]
struct Report {
    /// Version of this schema.
    schema_version: u32,
    /// Version of the grader.
    grader_version: &'static str,
    /// Name of the submission.
    submission: String,
    /// Name of the assignment that was graded; null if every scene was graded.
    assignment: Option<String>,
    /// Name of the assignment that the submission fits; null unless every scene was graded and it fits exactly one.
    fitting_assignment: Option<String>,
    /// Overall outcome.
    outcome: JsonOutcome,
    /// The protections under which the program was run ("files", "network", "signals", "processes",
    /// "system-calls", "limits", "memory", "closed-folders" in the place of "files"); null if no program was run.
    protection: Option<Vec<&'static str>>,
    /// The protections that were not in force; null as above.
    protection_missing: Option<Vec<&'static str>>,
    /// The files that a course pack took from the hand-in, in words; null without a pack.
    taken: Option<String>,
    /// Result of re-running some scenes; null if no program was run.
    repetition: Option<JsonRepetition>,
    /// Forces and Jacobians of the program, measured from single steps; null if not measured.
    probe: Option<JsonProbing>,
    /// Terms that altered copies of passed scenes do not confirm; null if they confirm all, or were not run.
    copied: Option<JsonCopied>,
    /// Findings, in the order in which a student should read them; empty if nothing failed, or nothing is known.
    findings: Vec<JsonFinding>,
    /// Failed scenes under no finding, those that failed alike together.
    unexplained: Vec<JsonUnexplained>,
    /// Progress of an unfinished submission; null if it lacks nothing.
    progress: Option<JsonProgress>,
    /// Outcomes of the tasks of the hand-out on fast mass-spring, from positions; empty unless all scenes are of that method.
    tasks: Vec<JsonTask>,
    /// Sums over the required features.
    required: JsonTotals,
    /// Sums over the extra-credit features.
    extra_credit: JsonTotals,
    /// Sums over the features without points.
    unscored: JsonTotals,
    /// Credit for the creative scene; null if the scenes of the class were not marked.
    creative: Option<JsonCreative>,
    /// Points that the teacher granted or withdrew.
    adjustments: Vec<JsonAdjustment>,
    /// Whether hidden scenes exist and were run; null if none are known.
    hidden: Option<JsonHidden>,
    /// Sums over the features of each group.
    groups: Vec<JsonGroup>,
    /// One entry per group and integrator.
    features: Vec<JsonFeature>,
    /// Checks of each force's Jacobians; empty unless the built-in simulator was graded.
    jacobians: Vec<JsonJacobian>,
    /// Checks of the linear systems of implicit methods; empty as above.
    newton_systems: Vec<JsonNewton>,
    /// Provenance of the report; null if unknown.
    provenance: Option<JsonProvenance>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonUnexplained {
    /// How many, and how they failed, as text.
    message: String,
    /// Names of the scenes.
    scenes: Vec<String>,
}

impl JsonUnexplained {
    fn of(unexplained: &Unexplained<'_>) -> Self {
        let scenes = unexplained.scenes.iter().map(|scene| scene.id.clone()).collect();
        Self { message: unexplained.words.clone(), scenes }
    }
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonRepetition {
    /// Scenes that were run twice.
    scenes: usize,
    /// Names of the scenes whose traces were not identical.
    differing: Vec<String>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonCopied {
    /// The finding as text.
    message: String,
    /// Shipped scenes with a right trace.
    passed: usize,
    /// Those among them that do not count; their verdict is "fails-altered".
    withdrawn: Vec<JsonWithdrawn>,
    /// The altered copies on which the program failed.
    wrong: Vec<JsonWrongCopy>,
    /// Other scenes with a right trace that altered copies do not confirm; they count.
    unchecked: Vec<String>,
    /// A shipped scene on which the program fails if a line break is added at the end of the file; null if it does not,
    /// or if unknown.
    bytes: Option<String>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonWithdrawn {
    /// The name of the scene.
    scene: String,
    /// The terms that the program does not show in altered copies.
    terms: String,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonWrongCopy {
    /// The name of the shipped scene.
    scene: String,
    /// The verdict on its copy, or "not-run" after several copies that exceeded a limit.
    verdict: &'static str,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonAdjustment {
    /// The points; negative if they were withdrawn.
    points: f64,
    /// Why.
    reason: String,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonCreative {
    /// Marks for ingredients, aesthetics and originality, by judge; empty if it has no mark.
    marks: Vec<[f64; 3]>,
    /// Best mark.
    maximum: f64,
    /// Points for the best marks: the rubric's share of the required points.
    points: f64,
    /// Points earned; null if it has no mark.
    points_earned: Option<f64>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonHidden {
    /// Whether they were run.
    run: bool,
    /// Number of hidden scenes; null if unknown.
    scenes: Option<usize>,
    /// Why they were not run: "unavailable" or "no-namespaces"; null if they were.
    reason: Option<&'static str>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonGroup {
    /// "required", "extra-credit" or "unscored".
    section: &'static str,
    group: String,
    #[serde(flatten)]
    totals: JsonTotals,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonFinding {
    /// "output", "cause" (a mistake, proven by replay), "possible-cause" (it explains most scenes, not all), "feature" (one to
    /// look at), "crash", "error" (the program reports one, and ends), "time-out", "memory", "other-root", "common" (no cause
    /// found), "no-effect" (as if a feature were not implemented) or "not-implemented" (the program says so).
    kind: &'static str,
    /// The finding as a sentence.
    message: String,
    /// Its evidence as text.
    evidence: String,
    /// The feature at fault, and the mistake as text; several if each explains everything alike.
    alternatives: Vec<JsonAlternative>,
    /// Names of the scenes that it explains.
    scenes: Vec<String>,
    /// Scenes in which Newton's method converges slowly or not at all with the mistake: neither for nor against it.
    open: usize,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonAlternative {
    /// A force or a part of it, its Jacobians, an integrator, fixed particles, reading, output, …
    feature: String,
    /// The mistake.
    message: String,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonTask {
    /// "A", "M", "C", "r", "Q" or "round".
    task: &'static str,
    /// "wrong", "ambiguous" (a mistake in it, or one in another task with the same positions), "consistent" or "unknown".
    verdict: &'static str,
    /// The same as text.
    message: String,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonProgress {
    /// Implemented features.
    implemented: Vec<String>,
    /// The simplest thing that is not; null if there is none.
    next: Option<JsonNext>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonNext {
    /// The forces and the integrator.
    feature: String,
    /// A scene with them.
    scene: String,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
enum JsonOutcome {
    /// Every required feature passed, and all known hidden scenes were run.
    Passed,
    /// Every required feature passed; hidden scenes exist but were not run.
    PassedShipped,
    /// A required feature failed.
    Failed,
    /// Something could not be judged.
    GraderFault,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonTotals {
    /// Scenes, excluding hidden ones.
    scenes: usize,
    scenes_passed: usize,
    /// Scenes that could not be judged; their points are neither earned nor lost.
    scenes_not_judged: usize,
    /// Hidden scenes that were run.
    hidden: usize,
    hidden_passed: usize,
    hidden_not_judged: usize,
    features: usize,
    /// Features of which every scene passed, including hidden ones.
    features_passed: usize,
    #[serde(flatten)]
    credit: JsonCredit,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonCredit {
    points: f64,
    /// Points earned; null if nothing was judged, or if the rubric withholds points because something was not.
    points_earned: Option<f64>,
    /// Points of scenes that could not be judged. Points neither earned nor counted here are lost.
    points_not_judged: f64,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonFeature {
    /// "required", "extra-credit" or "unscored".
    section: &'static str,
    group: String,
    integrator: &'static str,
    #[serde(flatten)]
    credit: JsonCredit,
    /// Whether points are earned in proportion to the scenes that pass; otherwise all or nothing.
    partial: bool,
    scenes: Vec<JsonScene>,
    /// Number of hidden scenes by verdict; null if they were not run.
    hidden: Option<BTreeMap<&'static str, usize>>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonScene {
    name: String,
    path: String,
    /// "pass", "not-implemented", "missing", "differs", "drifts", "fails-altered", "wrong-function", "not-finite", "too-short", "too-long", "malformed", "no-output", "crashed", "timed-out", "not-run",
    /// "out-of-memory", "too-many-processes", "too-much-output", "build-failed", "bad-hand-in" or "grader-fault".
    verdict: &'static str,
    /// The verdict in a sentence.
    message: String,
    /// The facts of a failure; null for other verdicts.
    failure: Option<JsonFailure>,
    /// Its weight among the scenes of its feature.
    weight: f64,
    /// Kind of tolerances used: "calibrated" or "fixed".
    criteria: &'static str,
    /// The fixed tolerances; null if they are calibrated.
    tolerances: Option<JsonTolerances>,
    /// The calibrated tolerances; null if they are fixed.
    calibration: Option<JsonCalibration>,
    /// States compared.
    states: u64,
    position: JsonResiduals,
    velocity: JsonResiduals,
    /// The first number out of tolerance.
    first_wrong: Option<JsonFirstWrong>,
    /// Why the trace differs; null if it does not, or if unknown.
    diagnosis: Option<JsonDiagnosis>,
    /// The first state that differs, where the trace passes because its steps solve the same equations; null elsewhere.
    other_root: Option<u64>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonDiagnosis {
    /// Single steps that were redone, each from the trace's own states.
    steps: u64,
    /// Number of those steps that are wrong.
    steps_wrong: u64,
    /// The first ranges of wrong steps: first and last step, from 1.
    ranges: Vec<[u64; 2]>,
    /// The same as text.
    message: String,
    /// Steps that the program made from the oracle's states, from 1; null where there were none.
    restarted: Option<Vec<u64>>,
    /// The wrong ones among them; null as above.
    restarted_wrong: Option<Vec<u64>>,
    /// The findings that explain the trace, as text.
    causes: Vec<String>,
    /// The first step that solves the right equation and differs, from 1; null if there is none.
    other_root: Option<u64>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonTolerances {
    /// Exclusive bound of each residual.
    largest: f64,
    /// Exclusive bound of the sum of residuals.
    accumulated: f64,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonCalibration {
    /// Number of variants of a correct program used to measure the envelope.
    variants: usize,
    /// The first state of which only energy and momentum are compared; null if there is none.
    horizon: Option<u64>,
    /// Of positions, at the last state compared; null if no state was compared.
    position: Option<JsonBound>,
    /// Of velocities, likewise.
    velocity: Option<JsonBound>,
    /// The largest ratio of a residual to its tolerance: at most 1 if the states agree.
    used: Option<f64>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonBound {
    /// The largest residual of the variants so far.
    envelope: f64,
    /// Inclusive bound of each residual.
    tolerance: f64,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonResiduals {
    /// The largest over particles and states; null if no state was compared.
    largest: Option<f64>,
    /// The sum over particles and states; null if no state was compared.
    accumulated: Option<f64>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonFirstWrong {
    step: u64,
    /// Seconds.
    time: f64,
    particle: usize,
    /// "position" or "velocity".
    quantity: &'static str,
    /// Column of the trace, without the particle's number: "x", "vy", ….
    coordinate: &'static str,
    expected: f64,
    got: f64,
    /// The residual or sum of residuals that exceeds its tolerance.
    residual: Option<f64>,
    tolerance: f64,
    /// The envelope from which the tolerance is computed; null if the tolerance is fixed.
    envelope: Option<f64>,
    /// Whether the sum of residuals exceeds its tolerance, rather than this residual.
    accumulated: bool,
    /// The particle's states around that step.
    context: Vec<JsonContext>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonContext {
    step: u64,
    /// The oracle's position, then velocity.
    expected: Vec<f64>,
    /// The trace's position, then velocity.
    got: Vec<f64>,
}

impl Report {
    fn of(grading: &Grading) -> Self {
        Self {
            schema_version: SCHEMA_VERSION,
            grader_version: env!("CARGO_PKG_VERSION"),
            submission: grading.submission.line(),
            assignment: grading.assignment.as_ref().map(|assignment| assignment.name.clone()),
            fitting_assignment: grading.fitting.as_ref().map(|fitting| fitting.name.clone()),
            outcome: match grading.outcome() {
                GradingOutcome::Passed => JsonOutcome::Passed,
                GradingOutcome::PassedShipped => JsonOutcome::PassedShipped,
                GradingOutcome::Failed => JsonOutcome::Failed,
                GradingOutcome::GraderFault => JsonOutcome::GraderFault,
            },
            protection: grading.protection.as_ref().map(|protections| {
                protections.iter().map(|protection| protection.name()).collect()
            }),
            protection_missing: grading.protection.as_deref().map(text::missing),
            taken: grading.taken.as_ref().map(|taken| taken.line()),
            repetition: grading.repetition.as_ref().map(|repetition| JsonRepetition {
                scenes: repetition.scenes,
                differing: repetition.differing.clone(),
            }),
            probe: grading.probing.as_ref().map(JsonProbing::of),
            copied: grading.copied.as_ref().map(JsonCopied::of),
            findings: grading.findings.list.iter().map(JsonFinding::of).collect(),
            unexplained: remarks::unexplained(grading).iter().map(JsonUnexplained::of).collect(),
            progress: grading.findings.progress.as_ref().map(JsonProgress::of),
            tasks: grading.findings.tasks.iter().map(JsonTask::of).collect(),
            required: JsonTotals::of(grading.totals(Section::Required), grading.faults),
            extra_credit: JsonTotals::of(grading.totals(Section::ExtraCredit), grading.faults),
            unscored: JsonTotals::of(grading.totals(Section::Unscored), grading.faults),
            creative: grading.creative.as_ref().map(JsonCreative::of),
            adjustments: grading.adjustments.iter().map(JsonAdjustment::of).collect(),
            hidden: JsonHidden::of(grading),
            groups: JsonGroup::all_of(grading),
            features: grading
                .features
                .iter()
                .map(|result| JsonFeature::of(result, grading))
                .collect(),
            jacobians: grading.jacobians.forces.iter().map(JsonJacobian::of).collect(),
            newton_systems: grading.jacobians.newton.iter().map(JsonNewton::of).collect(),
            provenance: grading.provenance.as_ref().map(JsonProvenance::of),
        }
    }
}

impl JsonCopied {
    fn of(copied: &Copied) -> Self {
        let Copied { passed, withdrawn, wrong, unchecked, bytes, .. } = copied;
        let withdrawn = withdrawn.iter().map(|Withdrawn { scene, terms }| JsonWithdrawn {
            scene: scene.clone(),
            terms: terms.clone(),
        });
        let wrong =
            wrong.iter().map(|(scene, verdict)| JsonWrongCopy { scene: scene.clone(), verdict });
        Self {
            message: copied.to_string(),
            passed: *passed,
            withdrawn: withdrawn.collect(),
            wrong: wrong.collect(),
            unchecked: unchecked.clone(),
            bytes: bytes.clone(),
        }
    }
}

impl JsonAdjustment {
    fn of(Adjustment { points, reason }: &Adjustment) -> Self {
        Self { points: *points, reason: reason.text() }
    }
}

impl JsonCreative {
    fn of(creative: &CreativeCredit) -> Self {
        let CreativeCredit { marks, maximum, points } = creative;
        Self {
            marks: marks.clone(),
            maximum: *maximum,
            points: *points,
            points_earned: creative.earned(),
        }
    }
}

impl JsonHidden {
    fn of(grading: &Grading) -> Option<Self> {
        match grading.hidden {
            Hidden::None => None,
            Hidden::NotRun { scenes, reason } => {
                let reason = match reason {
                    NotRunReason::Unavailable => "unavailable",
                    NotRunReason::WithoutNamespaces => "no-namespaces",
                };
                Some(Self { run: false, scenes, reason: Some(reason) })
            }
            Hidden::Run => {
                let scenes = grading.features.iter().map(|result| result.hidden.n_scenes()).sum();
                Some(Self { run: true, scenes: Some(scenes), reason: None })
            }
        }
    }
}

impl JsonGroup {
    fn all_of(grading: &Grading) -> Vec<Self> {
        let groups = Section::ALL.into_iter().flat_map(|section| grading.groups(section));
        let json = |group: &[FeatureResult]| {
            let feature = &group.first()?.feature;
            Some(Self {
                section: feature.section.name(),
                group: feature.group.clone(),
                totals: JsonTotals::of(Totals::of(group), grading.faults),
            })
        };
        groups.filter_map(json).collect()
    }
}

impl JsonFinding {
    fn of(finding: &Finding) -> Self {
        let alternatives = finding.features.iter().zip(&finding.words);
        let alternatives = alternatives.map(|(feature, message)| JsonAlternative {
            feature: feature.to_string(),
            message: message.clone(),
        });
        Self {
            kind: finding.kind.name(),
            message: finding.sentence(),
            evidence: finding.evidence(),
            alternatives: alternatives.collect(),
            scenes: finding.scenes.clone(),
            open: finding.open,
        }
    }
}

impl JsonTask {
    fn of(TaskFinding { task, verdict }: &TaskFinding) -> Self {
        Self { task: task.name(), verdict: verdict.name(), message: verdict.to_string() }
    }
}

impl JsonProgress {
    fn of(progress: &Progress) -> Self {
        let next = progress.next.clone().map(|(feature, scene)| JsonNext { feature, scene });
        Self { implemented: progress.implemented.clone(), next }
    }
}

impl JsonTotals {
    fn of(totals: Totals, faults: FaultPoints) -> Self {
        Self {
            scenes: totals.scenes,
            scenes_passed: totals.passed,
            scenes_not_judged: totals.faults,
            hidden: totals.hidden,
            hidden_passed: totals.hidden_passed,
            hidden_not_judged: totals.hidden_faults,
            features: totals.features,
            features_passed: totals.features_passed,
            credit: JsonCredit::of(&totals.credit, faults),
        }
    }
}

impl JsonCredit {
    fn of(credit: &Credit, faults: FaultPoints) -> Self {
        Self {
            points: credit.points,
            points_earned: credit.shown(faults),
            points_not_judged: credit.unjudged,
        }
    }
}

impl JsonFeature {
    fn of(result: &FeatureResult, grading: &Grading) -> Self {
        let HiddenTally { verdicts, .. } = &result.hidden;
        Self {
            partial: result.partial,
            hidden: (grading.hidden == Hidden::Run).then(|| verdicts.clone()),
            section: result.feature.section.name(),
            group: result.feature.group.clone(),
            integrator: result.feature.integrator,
            credit: JsonCredit::of(&result.credit(), grading.faults),
            scenes: result.scenes.iter().map(JsonScene::of).collect(),
        }
    }
}

impl JsonScene {
    fn of(scene: &SceneResult) -> Self {
        let Comparison { verdict, states, position, velocity, first_wrong, .. } = &scene.comparison;
        let residuals = |residuals: &Residuals| {
            if scene.comparison.is_compared() {
                JsonResiduals::of(residuals)
            } else {
                JsonResiduals { largest: None, accumulated: None }
            }
        };
        let (tolerances, calibration) = match &scene.criteria {
            Criteria::Fixed(Tolerances { largest, accumulated }) => {
                (Some(JsonTolerances { largest: *largest, accumulated: *accumulated }), None)
            }
            Criteria::Calibrated(calibrated) => {
                let allowed = scene.comparison.is_compared().then_some(scene.comparison.allowed);
                let calibration = JsonCalibration::of(&calibrated.envelope, allowed.flatten());
                (None, Some(calibration))
            }
        };
        Self {
            name: scene.id.clone(),
            path: scene.path.clone(),
            verdict: verdict.name(),
            message: verdict.to_string(),
            failure: JsonFailure::of(verdict),
            weight: scene.weight,
            criteria: scene.criteria.name(),
            tolerances,
            calibration,
            states: *states,
            position: residuals(position),
            velocity: residuals(velocity),
            first_wrong: first_wrong.as_ref().map(JsonFirstWrong::of),
            diagnosis: scene.diagnosis.as_ref().map(JsonDiagnosis::of),
            other_root: scene.comparison.other_root,
        }
    }
}

impl JsonCalibration {
    fn of(envelope: &Envelope, allowed: Option<Allowed>) -> Self {
        let bound = |Bound { envelope, tolerance }| JsonBound { envelope, tolerance };
        Self {
            variants: envelope.variants,
            horizon: envelope.horizon.map(|horizon| horizon.step),
            position: allowed.map(|allowed| bound(allowed.position)),
            velocity: allowed.map(|allowed| bound(allowed.velocity)),
            used: allowed.and_then(|allowed| finite(allowed.used)),
        }
    }
}

impl JsonDiagnosis {
    fn of(diagnosis: &Diagnosis) -> Self {
        let Diagnosis { steps, causes, other_root, restarts, .. } = diagnosis;
        Self {
            steps: steps.total,
            steps_wrong: steps.wrong,
            ranges: steps.ranges.clone(),
            message: steps.words(),
            restarted: restarts.as_ref().map(|restarts| restarts.made.clone()),
            restarted_wrong: restarts.as_ref().map(|restarts| restarts.wrong.clone()),
            causes: causes.clone(),
            other_root: *other_root,
        }
    }
}

impl JsonResiduals {
    fn of(residuals: &Residuals) -> Self {
        Self { largest: finite(residuals.largest), accumulated: finite(residuals.accumulated) }
    }
}

impl JsonFirstWrong {
    fn of(first: &FirstWrong) -> Self {
        let context = first.context.iter().map(|row| JsonContext {
            step: row.step,
            expected: row.expected.clone(),
            got: row.got.clone(),
        });
        Self {
            step: first.place.step,
            time: first.time,
            particle: first.place.particle,
            quantity: first.place.quantity.name(),
            coordinate: first.place.coordinate(),
            expected: first.expected,
            got: first.got,
            residual: finite(first.residual),
            tolerance: first.tolerance,
            envelope: first.envelope,
            accumulated: first.accumulated,
            context: context.collect(),
        }
    }
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

#[test]
fn documented_schema_is_current() {
    let schema = serde_json::to_string_pretty(&schemars::schema_for!(Report)).unwrap() + "\n";
    let command = "cargo test --release -p report schema";
    test_support::assert_document("report.schema.json", &schema, command);
}
