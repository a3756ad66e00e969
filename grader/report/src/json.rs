//! The report for programs: JSON, with a version that changes when a field changes its meaning or goes.
//!
//! Its schema is `docs/report.schema.json`. Numbers that are not finite are `null`.

use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;

use super::jacobians::json::{JsonJacobian, JsonNewton};
use super::probe::json::JsonProbing;
use super::text;
use grader::altered::Copied;
use grader::blame::{Blame, Finding, Suspect};
use grader::calibration::{Bound, Envelope};
use grader::compare::{Allowed, Comparison, Criteria, FirstWrong, Residuals, Tolerances};
use grader::diagnosis::{Candidate, Culprit, Diagnosis};
use grader::grading::{
    Credit, FeatureResult, Grading, GradingOutcome, Hidden, HiddenTally, SceneResult, Totals,
};
use grader::rubric::FaultPoints;
use grader::suite::Section;

/// Version of the schema.
pub const SCHEMA_VERSION: u32 = 4;

/// The report as JSON, with a newline at its end.
///
/// # Errors
/// Never in practice: every value is representable.
pub fn render(grading: &Grading) -> serde_json::Result<String> {
    Ok(serde_json::to_string_pretty(&Report::of(grading))? + "\n")
}

/// The JSON schema of the report, with a newline at its end.
///
/// # Errors
/// Never in practice.
pub fn schema() -> serde_json::Result<String> {
    Ok(serde_json::to_string_pretty(&schemars::schema_for!(Report))? + "\n")
}

/// A grading of one submission.
#[derive(Serialize, JsonSchema)]
#[schemars(title = "Spring Oracle report")]
struct Report {
    /// Version of this schema.
    schema_version: u32,
    /// Version of the grader.
    grader_version: &'static str,
    /// What was graded.
    submission: String,
    /// What it comes to.
    outcome: JsonOutcome,
    /// The protections under which the program was run ("files", "network", "signals", "processes",
    /// "system-calls", "limits"); null where no program was run.
    protection: Option<Vec<&'static str>>,
    /// The protections that were not in force; null as above.
    protection_missing: Option<Vec<&'static str>>,
    /// What came of running some scenes twice more; null where no program was run.
    repetition: Option<JsonRepetition>,
    /// Forces and Jacobians of the program, measured from single steps; null where they were not.
    probe: Option<JsonProbing>,
    /// That the program passes shipped scenes and takes no right step in altered ones; null where it does, or that is not known.
    copied: Option<JsonCopied>,
    /// What it looks as if the submission had wrong, one entry for each way in which scenes failed, the most
    /// frequent first; empty where nothing failed.
    blame: Vec<JsonFinding>,
    /// Sums over the required features.
    required: JsonTotals,
    /// Sums over the extra-credit features.
    extra_credit: JsonTotals,
    /// Whether hidden scenes exist, and were run; null where none are known of.
    hidden: Option<JsonHidden>,
    /// Sums over the features of each group.
    groups: Vec<JsonGroup>,
    /// One entry a group and integrator.
    features: Vec<JsonFeature>,
    /// Checks of each force's Jacobians; empty unless the built-in simulator was graded.
    jacobians: Vec<JsonJacobian>,
    /// Checks of the linear systems of implicit methods; empty as above.
    newton_systems: Vec<JsonNewton>,
}

#[derive(Serialize, JsonSchema)]
struct JsonRepetition {
    /// Scenes that were run twice.
    scenes: usize,
    /// The names of those whose two traces were not the same bytes.
    differing: Vec<String>,
}

#[derive(Serialize, JsonSchema)]
struct JsonCopied {
    /// What was found, in words.
    message: String,
    /// Shipped scenes that it passed.
    passed: usize,
    /// Scenes altered a little, in none of which its first step is right.
    altered: Vec<JsonAltered>,
    /// A shipped scene in which its first step is no longer right once a line break is added at the end of the file;
    /// null where it remains right, or that is not known.
    bytes: Option<String>,
}

#[derive(Serialize, JsonSchema)]
struct JsonAltered {
    /// The name of the shipped scene.
    scene: String,
    /// What was altered: "positions", "velocities", "masses" or "order" (of particles).
    change: &'static str,
}

#[derive(Serialize, JsonSchema)]
struct JsonHidden {
    /// Whether they were run.
    run: bool,
    /// How many there are; null where that is not known.
    scenes: Option<usize>,
}

#[derive(Serialize, JsonSchema)]
struct JsonGroup {
    /// "required" or "extra-credit".
    section: &'static str,
    group: String,
    #[serde(flatten)]
    totals: JsonTotals,
}

#[derive(Serialize, JsonSchema)]
struct JsonFinding {
    /// "wrong" (by traces), "crash", "time-out" or "memory".
    symptom: &'static str,
    /// Scenes that failed so.
    failing: usize,
    /// How many of the suspects are named: 1 where it is clear, 2 where two are close or at work together, 0 where
    /// there is no telling.
    named: usize,
    /// Whether the two that are named are at work together, and not one or the other.
    together: bool,
    /// The likeliest causes, the likeliest first.
    suspects: Vec<JsonSuspect>,
}

#[derive(Serialize, JsonSchema)]
struct JsonSuspect {
    /// What is wrong: a force or a part of one, its Jacobians, an integrator, fixed particles, reading, output, …
    feature: String,
    /// In which circumstances, or in what way; empty where there is no more to say.
    detail: String,
    /// Failing scenes that it explains.
    explained: usize,
    /// Passing scenes that speak against it.
    against: usize,
    /// Natural logarithm of how likely the verdicts are with it, up to a constant.
    score: f64,
}

#[derive(Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum JsonOutcome {
    /// Everything passed, and no hidden scenes are known of that were not run.
    Passed,
    /// Everything that was run passed; there are hidden scenes, which were not run.
    PassedShipped,
    /// Something failed.
    Failed,
    /// Something could not be judged.
    GraderFault,
}

#[derive(Serialize, JsonSchema)]
struct JsonTotals {
    /// Scenes, without hidden ones.
    scenes: usize,
    scenes_passed: usize,
    /// Scenes that could not be judged; their points are neither earned nor lost.
    scenes_not_judged: usize,
    /// Hidden scenes that were run.
    hidden: usize,
    hidden_passed: usize,
    hidden_not_judged: usize,
    features: usize,
    /// Features of which every scene passed, hidden ones too.
    features_passed: usize,
    #[serde(flatten)]
    credit: JsonCredit,
}

#[derive(Serialize, JsonSchema)]
struct JsonCredit {
    points: f64,
    /// Null where nothing was judged, or the rubric withholds points because something was not.
    points_earned: Option<f64>,
    /// Points of scenes that could not be judged. What is neither earned nor this is lost.
    points_not_judged: f64,
}

#[derive(Serialize, JsonSchema)]
struct JsonFeature {
    /// "required" or "extra-credit".
    section: &'static str,
    group: String,
    integrator: &'static str,
    #[serde(flatten)]
    credit: JsonCredit,
    /// Whether points are earned in proportion to the scenes that pass; otherwise all or nothing.
    partial: bool,
    scenes: Vec<JsonScene>,
    /// Hidden scenes by their verdicts' names; null where they were not run.
    hidden: Option<BTreeMap<&'static str, usize>>,
}

#[derive(Serialize, JsonSchema)]
struct JsonScene {
    name: String,
    path: String,
    /// "pass", "differs", "drifts", "not-finite", "too-short", "too-long", "malformed", "no-output", "crashed", "timed-out",
    /// "out-of-memory", "too-many-processes", "too-much-output", "build-failed", "bad-hand-in" or "grader-fault".
    verdict: &'static str,
    /// The verdict in a sentence.
    message: String,
    /// What it counts among the scenes of its feature.
    weight: f64,
    /// "calibrated" or "fixed": what it was judged by.
    criteria: &'static str,
    /// The fixed tolerances; null where they are calibrated.
    tolerances: Option<JsonTolerances>,
    /// What calibrated tolerances come to; null where they are fixed.
    calibration: Option<JsonCalibration>,
    /// States compared.
    states: u64,
    position: JsonResiduals,
    velocity: JsonResiduals,
    /// The first number out of tolerance.
    first_wrong: Option<JsonFirstWrong>,
    /// Why the trace differs; null where it does not, or that was not found out.
    diagnosis: Option<JsonDiagnosis>,
}

#[derive(Serialize, JsonSchema)]
struct JsonDiagnosis {
    /// Single steps that were looked at, each from the trace's own state before it.
    steps: u64,
    /// How many of them are wrong by themselves.
    steps_wrong: u64,
    /// The first runs of them: first and last step, from 1.
    ranges: Vec<[u64; 2]>,
    /// The same in words.
    message: String,
    /// Steps that the program made from the oracle's states, from 1; null where there were none.
    restarted: Option<Vec<u64>>,
    /// Those of them that are wrong; null as above.
    restarted_wrong: Option<Vec<u64>>,
    /// What explains the wrong steps, to rounding; where there are several, each does so as well as the others.
    explanations: Vec<JsonExplanation>,
    /// What the explanation leaves of the defect, relative to it; null where there is none.
    remainder: Option<f64>,
}

#[derive(Serialize, JsonSchema)]
struct JsonExplanation {
    /// "force", "jacobian", "integrator", "fixed" or "output".
    place: &'static str,
    /// The force; null where the place is another.
    force: Option<&'static str>,
    /// What is wrong, in words.
    message: String,
}

#[derive(Serialize, JsonSchema)]
struct JsonTolerances {
    /// Exclusive bound of each residual.
    largest: f64,
    /// Exclusive bound of the sum of residuals.
    accumulated: f64,
}

#[derive(Serialize, JsonSchema)]
struct JsonCalibration {
    /// With how many variants of a correct program the envelope was measured.
    variants: usize,
    /// The first state that is not compared, but for energy and momentum; null where there is none.
    horizon: Option<u64>,
    /// Of positions, at the last state compared; null where no state was.
    position: Option<JsonBound>,
    /// Of velocities, likewise.
    velocity: Option<JsonBound>,
    /// The largest ratio of a residual to its tolerance: at most 1 where the states agree.
    used: Option<f64>,
}

#[derive(Serialize, JsonSchema)]
struct JsonBound {
    /// The largest residual of the variants so far.
    envelope: f64,
    /// Inclusive bound of each residual.
    tolerance: f64,
}

#[derive(Serialize, JsonSchema)]
struct JsonResiduals {
    /// The largest over particles and states; null where no state was compared.
    largest: Option<f64>,
    /// The sum over particles and states; null where no state was compared.
    accumulated: Option<f64>,
}

#[derive(Serialize, JsonSchema)]
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
    /// The residual, or sum of residuals, that is too large.
    residual: Option<f64>,
    tolerance: f64,
    /// The envelope that the tolerance follows from; null where it is fixed.
    envelope: Option<f64>,
    /// Whether the sum of residuals is too large, and not this residual.
    accumulated: bool,
    /// The particle's states around that step.
    context: Vec<JsonContext>,
}

#[derive(Serialize, JsonSchema)]
struct JsonContext {
    step: u64,
    /// The oracle's position, then velocity.
    expected: Vec<f64>,
    /// The trace's.
    got: Vec<f64>,
}

impl Report {
    fn of(grading: &Grading) -> Self {
        Self {
            schema_version: SCHEMA_VERSION,
            grader_version: env!("CARGO_PKG_VERSION"),
            submission: grading.submission.clone(),
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
            repetition: grading.repetition.as_ref().map(|repetition| JsonRepetition {
                scenes: repetition.scenes,
                differing: repetition.differing.clone(),
            }),
            probe: grading.probing.as_ref().map(JsonProbing::of),
            copied: grading.copied.as_ref().map(JsonCopied::of),
            blame: grading.blame.as_ref().map(JsonFinding::all).unwrap_or_default(),
            required: JsonTotals::of(grading.totals(Section::Required), grading.faults),
            extra_credit: JsonTotals::of(grading.totals(Section::ExtraCredit), grading.faults),
            hidden: JsonHidden::of(grading),
            groups: JsonGroup::all_of(grading),
            features: grading
                .features
                .iter()
                .map(|result| JsonFeature::of(result, grading))
                .collect(),
            jacobians: grading.jacobians.forces.iter().map(JsonJacobian::of).collect(),
            newton_systems: grading.jacobians.newton.iter().map(JsonNewton::of).collect(),
        }
    }
}

impl JsonCopied {
    fn of(copied: &Copied) -> Self {
        let Copied { passed, altered, bytes } = copied;
        let altered = altered
            .iter()
            .map(|(scene, change)| JsonAltered { scene: scene.clone(), change: change.name() });
        Self {
            message: copied.to_string(),
            passed: *passed,
            altered: altered.collect(),
            bytes: bytes.clone(),
        }
    }
}

impl JsonHidden {
    fn of(grading: &Grading) -> Option<Self> {
        match grading.hidden {
            Hidden::None => None,
            Hidden::NotRun { scenes } => Some(Self { run: false, scenes }),
            Hidden::Run => {
                let scenes = grading.features.iter().map(|result| result.hidden.n_scenes()).sum();
                Some(Self { run: true, scenes: Some(scenes) })
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
    fn all(blame: &Blame) -> Vec<Self> {
        let suspect = |suspect: &Suspect| JsonSuspect {
            feature: suspect.feature.to_string(),
            detail: suspect.detail.clone(),
            explained: suspect.explained,
            against: suspect.against,
            score: suspect.score,
        };
        let finding = |finding: &Finding| Self {
            symptom: finding.symptom.name(),
            failing: finding.failing,
            named: finding.named,
            together: finding.together,
            suspects: finding.suspects.iter().map(suspect).collect(),
        };
        blame.findings.iter().map(finding).collect()
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
        let residuals = |residuals: &Residuals| match scene.comparison.is_compared() {
            true => JsonResiduals::of(residuals),
            false => JsonResiduals { largest: None, accumulated: None },
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
            weight: scene.weight,
            criteria: scene.criteria.name(),
            tolerances,
            calibration,
            states: *states,
            position: residuals(position),
            velocity: residuals(velocity),
            first_wrong: first_wrong.as_ref().map(JsonFirstWrong::of),
            diagnosis: scene.diagnosis.as_ref().map(JsonDiagnosis::of),
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
        let Diagnosis { steps, explanation, restarts } = diagnosis;
        let candidates = explanation.iter().flat_map(|explanation| &explanation.candidates);
        let explanation_of = |candidate: &Candidate| {
            let (place, force) = match candidate.culprit {
                Culprit::Force(tag) => ("force", Some(tag)),
                Culprit::Jacobian(tag) => ("jacobian", Some(tag)),
                Culprit::Integrator => ("integrator", None),
                Culprit::Fixed => ("fixed", None),
                Culprit::Output => ("output", None),
            };
            JsonExplanation { place, force, message: candidate.words.clone() }
        };
        Self {
            steps: steps.total,
            steps_wrong: steps.wrong,
            ranges: steps.ranges.clone(),
            message: steps.words(),
            restarted: restarts.as_ref().map(|restarts| restarts.made.clone()),
            restarted_wrong: restarts.as_ref().map(|restarts| restarts.wrong.clone()),
            explanations: candidates.map(explanation_of).collect(),
            remainder: explanation.as_ref().map(|explanation| explanation.remainder),
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
