//! JSON for programs.

use diagnosis::findings::Finding;
use serde::Serialize;

use super::{sentence, size_of};
use crate::campaign::{Campaign, Discovery};

/// Version of the format.
const VERSION: u32 = 1;

#[derive(Serialize)]
#[serde(rename_all = "kebab-case")]
struct Report<'a> {
    version: u32,
    runs: Vec<Run<'a>>,
}

#[derive(Serialize)]
#[serde(rename_all = "kebab-case")]
struct Run<'a> {
    submission: &'a str,
    seed: u64,
    scenes: u64,
    right: u64,
    wrong: u64,
    refused: u64,
    undecided: u64,
    covered_pairs: usize,
    discoveries: Vec<Found<'a>>,
    further_kinds: usize,
}

#[derive(Serialize)]
#[serde(rename_all = "kebab-case")]
struct Found<'a> {
    verdict: &'static str,
    words: String,
    proven: bool,
    in_this_scene: Option<String>,
    scenes: usize,
    particles: usize,
    forces: usize,
    steps: usize,
    first_wrong: Option<First>,
    broken_symmetries: Vec<&'static str>,
    scene: &'a str,
}

#[derive(Serialize)]
struct First {
    step: u64,
    particle: usize,
    place: String,
    expected: f64,
    got: f64,
    tolerance: f64,
}

/// The report of runs by name.
///
/// # Errors
/// If it cannot be expressed.
pub fn render(runs: &[(String, Campaign)]) -> Result<String, serde_json::Error> {
    let report = Report { version: VERSION, runs: runs.iter().map(run).collect() };
    Ok(serde_json::to_string_pretty(&report)? + "\n")
}

fn run((name, campaign): &(String, Campaign)) -> Run<'_> {
    let Campaign { seed, tally, discoveries, further, .. } = campaign;
    Run {
        submission: name,
        seed: *seed,
        scenes: tally.scenes,
        right: tally.right,
        wrong: tally.wrong,
        refused: tally.refused,
        undecided: tally.nothing.values().sum(),
        covered_pairs: tally.covered,
        discoveries: discoveries.iter().map(found).collect(),
        further_kinds: *further,
    }
}

fn found(discovery: &Discovery) -> Found<'_> {
    let wrong = &discovery.shrunk.wrong;
    let [particles, forces, steps] = size_of(&discovery.shrunk.scene);
    Found {
        verdict: wrong.failure.name(),
        words: sentence(discovery),
        proven: discovery.proven.is_some(),
        in_this_scene: discovery.possible.as_ref().map(Finding::sentence),
        scenes: discovery.count,
        particles,
        forces,
        steps,
        first_wrong: wrong.comparison.first_wrong.as_ref().map(|first| First {
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
