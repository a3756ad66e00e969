//! Reports of a run, one format a file.

pub mod json;
pub mod text;

use grader::verdict::Failure;
use scene::Scene;

use crate::campaign::{Discovery, forces};

/// Sizes of a scene in words.
fn sizes([particles, forces, steps]: [usize; 3]) -> String {
    let count = |count: usize, one: &str| match count {
        1 => format!("1 {one}"),
        _ => format!("{count} {one}s"),
    };
    let list = [count(particles, "particle"), count(forces, "force"), count(steps, "step")];
    list.join(", ")
}

fn size_of(scene: &Scene) -> [usize; 3] {
    [scene.particles.len(), scene.forces.len(), scene.n_steps() as usize]
}

/// The mistake in a sentence.
fn sentence(discovery: &Discovery) -> String {
    match &discovery.proven {
        _ if discovery.is_spelling => {
            "the file is legal XML, and the same scene passes if its file is spelt plainly"
                .to_owned()
        }
        Some(finding) => finding.sentence(),
        None => {
            let scene = &discovery.shrunk.scene;
            let forces = match forces(scene).as_slice() {
                [] => "no force".to_owned(),
                tags => tags.join(", "),
            };
            let failure = outcome(&discovery.shrunk.wrong.failure);
            format!("{failure} with {forces} under {}; no cause is proven", scene.integrator.name)
        }
    }
}

/// The name of a failure. A path of our own that has no answer did not crash.
fn outcome(failure: &Failure) -> &'static str {
    match failure {
        Failure::GaveUp { .. } => "gave-up",
        _ => failure.name(),
    }
}

/// The file of the smallest scene, with a comment that says what it shows.
pub fn file(discovery: &Discovery) -> String {
    let comment = format!("{}: {}.", sizes(size_of(&discovery.shrunk.scene)), sentence(discovery));
    // A comment must not hold two hyphens.
    format!("<!-- {} -->\n{}", comment.replace("--", "- -"), discovery.text)
}
