//! JSON for programs.
//!
//! The schema is `docs/fuzzing.schema.json`. Non-finite numbers are `null`.

use diagnosis::findings::Finding;
use serde::Serialize;

use super::{outcome, sentence, size_of};
use crate::campaign::{Campaign, Discovery};

/// Version of the schema.
const SCHEMA_VERSION: u32 = 1;

/// Runs on drawn scenes, and what they found.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(title = "Spring Oracle fuzzing"))]
struct JsonReport<'a> {
    /// Version of this schema.
    schema_version: u32,
    /// Version of the grader.
    grader_version: &'static str,
    /// One run of a program; of the built-in simulator, one for each code path.
    runs: Vec<JsonRun<'a>>,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonRun<'a> {
    /// The program, or the code path.
    submission: &'a str,
    /// The seed: with it, a deterministic program has the same result.
    seed: u64,
    /// Scenes that were run: those that are right, wrong, refused and undecided.
    scenes: u64,
    /// Scenes in which the program is right.
    right: u64,
    /// Scenes in which it is wrong.
    wrong: u64,
    /// Scenes of which it says that it lacks something.
    refused: u64,
    /// Scenes that tell nothing.
    undecided: u64,
    /// Scenes that the program took with others in one run.
    served: u64,
    /// Scenes in which it is right, and was not with others in one run.
    right_alone: u64,
    /// Scenes in which it was right with others in one run, and is not by itself: one in 128 is tried.
    right_served: u64,
    /// Pairs of a feature and a circumstance, or another feature, that were run.
    covered_pairs: usize,
    /// Kinds of failures, the most frequent first.
    discoveries: Vec<JsonDiscovery<'a>>,
    /// Kinds of failures that were not shrunk.
    further_kinds: usize,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonDiscovery<'a> {
    /// Name of the failure in the smallest scene.
    verdict: &'static str,
    /// The mistake in words.
    words: String,
    /// Whether these words are a proven cause.
    proven: bool,
    /// A cause that makes the program's numbers in the smallest scene alone.
    in_this_scene: Option<String>,
    /// Failures of this kind.
    scenes: usize,
    /// Particles of the smallest scene.
    particles: usize,
    /// Its force elements.
    forces: usize,
    /// Its steps.
    steps: usize,
    /// The first wrong number in it.
    first_wrong: Option<JsonNumber>,
    /// Symmetries that the program breaks in it.
    broken_symmetries: Vec<&'static str>,
    /// Its file.
    scene: &'a str,
}

#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct JsonNumber {
    /// The step, counted from 1; 0 is the initial state.
    step: u64,
    /// The particle, counted from 0.
    particle: usize,
    /// Step, particle and coordinate in words.
    place: String,
    /// The right number.
    expected: f64,
    /// The program's.
    got: f64,
    /// The largest difference that is allowed.
    tolerance: f64,
}

/// The report of runs by name.
///
/// # Errors
/// If it cannot be expressed.
pub fn render(runs: &[(String, Campaign)]) -> Result<String, serde_json::Error> {
    let report = JsonReport {
        schema_version: SCHEMA_VERSION,
        grader_version: env!("CARGO_PKG_VERSION"),
        runs: runs.iter().map(run).collect(),
    };
    Ok(serde_json::to_string_pretty(&report)? + "\n")
}

fn run((name, campaign): &(String, Campaign)) -> JsonRun<'_> {
    let Campaign { seed, tally, discoveries, further, .. } = campaign;
    JsonRun {
        submission: name,
        seed: *seed,
        scenes: tally.scenes,
        right: tally.right,
        wrong: tally.wrong,
        refused: tally.refused,
        undecided: tally.nothing.values().sum(),
        served: tally.served,
        right_alone: tally.unlike,
        right_served: tally.right_served,
        covered_pairs: tally.covered,
        discoveries: discoveries.iter().map(found).collect(),
        further_kinds: *further,
    }
}

fn found(discovery: &Discovery) -> JsonDiscovery<'_> {
    let wrong = &discovery.shrunk.wrong;
    let [particles, forces, steps] = size_of(&discovery.shrunk.scene);
    JsonDiscovery {
        verdict: outcome(&wrong.failure),
        words: sentence(discovery),
        proven: discovery.proven.is_some(),
        in_this_scene: discovery.possible.as_ref().map(Finding::sentence),
        scenes: discovery.count,
        particles,
        forces,
        steps,
        first_wrong: wrong.comparison.first_wrong.as_ref().map(|first| JsonNumber {
            step: first.place.step,
            particle: first.place.particle,
            place: first.place.to_string(),
            expected: first.expected,
            got: first.got,
            tolerance: first.tolerance,
        }),
        broken_symmetries: discovery.broken.iter().map(|symmetry| symmetry.name()).collect(),
        scene: &discovery.text,
    }
}

#[test]
fn documented_schema_is_current() {
    let schema = serde_json::to_string_pretty(&schemars::schema_for!(JsonReport<'_>)).unwrap();
    let command = "cargo test --release -p fuzzing schema";
    test_support::assert_document("fuzzing.schema.json", &(schema + "\n"), command);
}
