//! Errors and costs as JSON.
//!
//! The schema is `docs/accuracy.schema.json`. Errors and floors are in the scene's units, times in seconds.

use serde::Serialize;

use super::{outcome_name, source_name};
use crate::accuracy::cheapest::Level;
use crate::accuracy::confirm::{Agreement, Confirmation};
use crate::accuracy::order::{Expected, Fit};
use crate::accuracy::{Curve, Errors, Order, Point, RunOutcome, SceneStudy, Study};

/// Version of the schema.
pub const SCHEMA_VERSION: u32 = 1;

/// The report as JSON, with a newline at its end.
///
/// # Errors
/// Never in practice: every value has a JSON form.
pub fn render(study: &Study) -> serde_json::Result<String> {
    Ok(serde_json::to_string_pretty(&JsonStudy::of(study))? + "\n")
}

/// Errors and costs of integrators over a ladder of time steps.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(title = "Spring Oracle accuracy"))]
struct JsonStudy {
    /// Version of this schema.
    schema_version: u32,
    /// Version of the grader.
    grader_version: &'static str,
    /// The submission measured in addition to the built-in simulator; null if none.
    submission: Option<String>,
    /// Slopes within tolerance of theory, and errors within rounding: of the submission if there is one.
    orders_agree: usize,
    /// Orders that differ from theory.
    orders_differ: usize,
    /// Orders that theory predicts but that could not be fitted.
    orders_unknown: usize,
    /// The order of each method, of the submission if there is one.
    methods: Vec<JsonMethod>,
    /// The scenes.
    scenes: Vec<JsonScene>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonMethod {
    /// The method with its setting.
    method: String,
    /// Its order by theory.
    order: f64,
    /// Number of scenes with a prediction.
    scenes: usize,
    /// The scenes whose errors of positions or velocities have that slope, and none another one than theory says. If there
    /// is none, the order is unconfirmed.
    confirmed_by: Vec<String>,
    /// The least and the largest of these slopes; null if no scene confirms the order.
    slopes: Option<[f64; 2]>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonScene {
    /// Its name.
    name: String,
    /// Short description of the motion.
    title: String,
    /// Particles.
    particles: usize,
    /// Simulated time.
    duration: f64,
    /// "closed-form" or "adaptive".
    reference: &'static str,
    /// Error bar of the reference.
    floor: JsonErrors,
    /// Size of the motion: the largest displacement or distance. An error of ten times this size is a blow-up.
    size: f64,
    /// One entry per method.
    curves: Vec<JsonCurve>,
    /// The built-in simulator's methods by time, at each power of ten of the largest position error.
    cheapest: Vec<JsonLevel>,
    /// The same for the submission; times are those of whole processes.
    cheapest_of_submission: Vec<JsonLevel>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonErrors {
    /// Of positions.
    position: f64,
    /// Of velocities.
    velocity: f64,
    /// Of the energy.
    energy: f64,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonCurve {
    /// "built-in" or "submission".
    whose: &'static str,
    /// The integrator.
    integrator: &'static str,
    /// The option that is set, as "name=value"; null if none.
    setting: Option<String>,
    /// Orders of position, velocity and energy.
    orders: Vec<JsonOrder>,
    /// From the coarsest time step to the finest.
    points: Vec<JsonPoint>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonOrder {
    /// "position", "velocity" or "energy".
    quantity: &'static str,
    /// "slope", "exact" or "none".
    fit: &'static str,
    /// The fitted slope.
    slope: Option<f64>,
    /// The coarsest and the finest time step of the fit.
    window: Option<[f64; 2]>,
    /// The slope predicted by theory, 0 for "exact"; null if there is no prediction.
    theory: Option<f64>,
    /// Whether both agree; null if there is no prediction, or nothing could be fitted.
    agrees: Option<bool>,
    /// Why the predicted order differs from the method's usual one.
    reason: Option<&'static str>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonPoint {
    /// Time step.
    time_step: f64,
    /// Steps.
    steps: u64,
    /// "finished", "blown-up" or "failed".
    outcome: &'static str,
    /// Largest errors over all samples; null unless finished.
    largest: Option<JsonErrors>,
    /// Errors at the end; null unless finished.
    end: Option<JsonErrors>,
    /// Whether the position's error is within the reference's error bar.
    at_floor: bool,
    /// Reason of a failure; null otherwise.
    failure: Option<String>,
    /// Evaluations of the force; null for a submission.
    force_evaluations: Option<u64>,
    /// Matrices factorised; null for a submission.
    factorisations: Option<u64>,
    /// Newton iterations and rounds of local and global steps; null for a submission.
    iterations: Option<u64>,
    /// Least, median and largest time; null if nothing was timed.
    time: Option<[f64; 3]>,
    /// Number of timed runs.
    repeats: u32,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonLevel {
    /// The position error, a power of ten.
    error: f64,
    /// Methods, by time.
    methods: Vec<JsonOffer>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonOffer {
    /// The method with its setting.
    method: String,
    /// Time step, interpolated.
    time_step: f64,
    /// Evaluations of the force, interpolated; null for a submission.
    force_evaluations: Option<f64>,
    /// Time, interpolated.
    time: f64,
}

impl JsonStudy {
    fn of(study: &Study) -> Self {
        let Agreement { agree, exact, differ, unknown } = study.agreement();
        Self {
            schema_version: SCHEMA_VERSION,
            grader_version: env!("CARGO_PKG_VERSION"),
            submission: study.submission.clone(),
            orders_agree: agree + exact,
            orders_differ: differ,
            orders_unknown: unknown,
            methods: study.confirmations().into_iter().map(JsonMethod::of).collect(),
            scenes: study.scenes.iter().map(JsonScene::of).collect(),
        }
    }
}

impl JsonMethod {
    fn of(confirmation: Confirmation) -> Self {
        let slopes = confirmation.range();
        let Confirmation { label, order, scenes, confirmed, .. } = confirmation;
        let confirmed_by = confirmed.into_iter().map(|(scene, _)| scene).collect();
        Self { method: label, order, scenes, confirmed_by, slopes }
    }
}

impl JsonScene {
    fn of(scene: &SceneStudy) -> Self {
        let levels = |foreign| {
            scene.levels(foreign).into_iter().map(|level| JsonLevel::of(scene, level)).collect()
        };
        Self {
            name: scene.target.name.clone(),
            title: scene.target.title.clone(),
            particles: scene.target.scene.particles.len(),
            duration: scene.reference.duration,
            reference: source_name(scene.reference.source),
            floor: scene.reference.floor.into(),
            size: scene.reference.size,
            curves: scene.curves.iter().map(|curve| JsonCurve::of(scene, curve)).collect(),
            cheapest: levels(false),
            cheapest_of_submission: levels(true),
        }
    }
}

impl From<Errors> for JsonErrors {
    fn from(Errors { position, velocity, energy }: Errors) -> Self {
        Self { position, velocity, energy }
    }
}

impl JsonCurve {
    fn of(scene: &SceneStudy, curve: &Curve) -> Self {
        let floor = scene.reference.floor.position;
        Self {
            whose: if curve.foreign { "submission" } else { "built-in" },
            integrator: curve.method.integrator.name,
            setting: curve.method.setting.map(|(option, value)| format!("{option}={value}")),
            orders: scene.orders(curve).iter().map(JsonOrder::of).collect(),
            points: curve.points.iter().map(|point| JsonPoint::of(point, floor)).collect(),
        }
    }
}

impl JsonOrder {
    fn of(order: &Order) -> Self {
        let (fit, slope, window) = match order.fit {
            Fit::Slope { slope, window: (coarse, fine), .. } => {
                ("slope", Some(slope), Some([coarse, fine]))
            }
            Fit::Exact => ("exact", None, None),
            Fit::None => ("none", None, None),
        };
        let theory = order.expected.map(|expected| match expected {
            Expected::Order(order) => order,
            Expected::Exact => 0.0,
        });
        let (agrees, reason) = (order.agrees(), order.reason);
        Self { quantity: order.quantity.name(), fit, slope, window, theory, agrees, reason }
    }
}

impl JsonPoint {
    fn of(point: &Point, floor: f64) -> Self {
        let (largest, end, failure) = match &point.outcome {
            RunOutcome::Finished { end, largest } => (Some(*largest), Some(*end), None),
            RunOutcome::BlownUp { .. } => (None, None, None),
            RunOutcome::Failed { reason, .. } => (None, None, Some(reason.clone())),
        };
        let (work, time) = (point.cost.work, point.cost.time);
        Self {
            time_step: point.time_step,
            steps: point.steps,
            outcome: outcome_name(&point.outcome),
            at_floor: largest.is_some_and(|errors| errors.position <= floor),
            largest: largest.map(Into::into),
            end: end.map(Into::into),
            failure,
            force_evaluations: work.map(|work| work.force_evaluations),
            factorisations: work.map(|work| work.factorisations),
            iterations: work.map(|work| work.iterations),
            time: time.map(|time| [time.least, time.median, time.largest]),
            repeats: time.map_or(0, |time| time.repeats),
        }
    }
}

impl JsonLevel {
    fn of(scene: &SceneStudy, level: Level) -> Self {
        let offers = level.offers.into_iter().map(|offer| JsonOffer {
            method: scene.curves[offer.curve].method.label(),
            time_step: offer.time_step,
            force_evaluations: offer.force_evaluations,
            time: offer.time,
        });
        Self { error: level.error, methods: offers.collect() }
    }
}

#[test]
fn documented_schema_is_current() {
    let schema = serde_json::to_string_pretty(&schemars::schema_for!(JsonStudy)).unwrap() + "\n";
    let command = "cargo test --release -p studies schema";
    test_support::assert_document("accuracy.schema.json", &schema, command);
}
