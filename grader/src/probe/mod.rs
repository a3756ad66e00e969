//! Measures the forces and Jacobians of any simulator from single steps.
//!
//! ```text
//! explicit Euler, h = 1, from (x, v)                 F = M (v' − v)
//! the same from states around it                     ∂F/∂x, ∂F/∂v of its force, with error bars
//! linearized implicit Euler from (x − h v, v)        (M − A) δ = h F      A = h² ∂F/∂x + h ∂F/∂v
//! ```
//!
//! A submission is seen only through traces ([`Stepper`]). One scene contains hundreds of independent groups of
//! particles, so that a force costs four or five runs in the plane, and some fifteen in space. Each part of each force gets three kinds of findings: the force
//! against ours ([`PartReport::force_finding`]), the form of the step ([`PartReport::step`]), and the Jacobian against
//! the derivative of the program's own force ([`PartReport::blocks`]). A wrong force with a consistent Jacobian can so
//! be distinguished from a right force with a wrong Jacobian.
//!
//! `noise.rs` derives the bounds from measured noise, `scenes.rs` builds the scenes, `identify.rs` identifies the
//! matrix.

mod scenes;
mod stepper;

mod noise;

mod differences;
mod identify;
mod separate;

mod diagnosis;
mod judge;
mod verdict;

mod session;

use scene::Dimension;
use scene::trace::Shape;

use crate::boundary::printed::Untrusted;
use crate::verdict::Failure;
use differences::Offer;
use session::Session;

pub use stepper::{BuiltIn, Stepper};
pub use verdict::{Block, Entry, Finding, PartReport, Replay, Verdict};

/// Names of methods with the step `v' = v + h F(q, v)/m`, in the order in which they are tried.
const EXPLICIT: [&str; 4] =
    ["explicit-euler", "symplectic-euler", "forward-backward-euler", "symplectic"];

/// Names of linearized implicit Euler.
const IMPLICIT: [&str; 2] = ["linearized-implicit-euler", "linearized-implicit"];

/// The findings about a simulator.
#[derive(Debug, Clone, PartialEq)]
pub struct Probing {
    /// The simulator's name.
    pub name: Untrusted,
    /// Its methods in the plane and in space.
    pub spaces: Vec<Space>,
    /// One entry for each part and dimension.
    pub parts: Vec<PartReport>,
    /// Tags of the forces that the simulator must offer.
    pub required: Vec<String>,
}

/// A simulator's methods in the plane or in space.
#[derive(Debug, Clone, PartialEq)]
pub struct Space {
    /// Two or three dimensions.
    pub dimension: Dimension,
    /// Its name of the method that reveals forces, or the failure.
    pub explicit: Result<&'static str, Failure>,
    /// Its name of linearized implicit Euler, or the failure.
    pub implicit: Result<&'static str, Failure>,
}

impl Probing {
    /// The most severe verdict of all parts.
    pub fn verdict(&self) -> Verdict {
        let verdicts = self.parts.iter().map(PartReport::verdict);
        verdicts.max().unwrap_or(Verdict::NotOffered)
    }

    /// The required forces that were not measured: in no dimension does the simulator offer all their parts, with
    /// Jacobians if implicit steps measure any.
    pub fn missing(&self) -> Vec<&str> {
        let vocabulary = simulator::vocabulary();
        let is_measured = |tag: &str| {
            let has_jacobian = vocabulary.force(tag).is_some_and(scenes::measures_jacobians);
            let is_offered = |part: &PartReport| {
                let blocks = part.blocks.iter().filter(|_| has_jacobian);
                let mut findings = blocks.chain([&part.force_finding]);
                findings.all(|finding| finding.verdict != Verdict::NotOffered)
            };
            [Dimension::Two, Dimension::Three].into_iter().any(|dimension| {
                let of_force =
                    |part: &&PartReport| part.force == tag && part.dimension == dimension;
                let mut parts = self.parts.iter().filter(of_force).peekable();
                parts.peek().is_some() && parts.all(is_offered)
            })
        };
        self.required.iter().map(String::as_str).filter(|tag| !is_measured(tag)).collect()
    }

    /// Whether something was measured, nothing is wrong, and no required force is missing.
    pub fn is_pass(&self) -> bool {
        let (_, offered) = self.counts();
        self.verdict() != Verdict::Wrong && offered > 0 && self.missing().is_empty()
    }

    /// Number of correct findings, and number of findings that the simulator offers.
    pub fn counts(&self) -> (usize, usize) {
        let correct = self.count(Verdict::Correct);
        (correct, correct + self.count(Verdict::Wrong) + self.count(Verdict::Inconclusive))
    }

    /// Number of findings with this verdict.
    pub fn count(&self, verdict: Verdict) -> usize {
        let findings = self.parts.iter().flat_map(PartReport::findings);
        findings.filter(|(_, finding)| finding.verdict == verdict).count()
    }
}

/// Probes a simulator with every force that `select` accepts by its tag and dimension. Runs are parallel; the result
/// does not depend on their order.
pub fn probe(stepper: &dyn Stepper, select: impl Fn(&str, Dimension) -> bool) -> Probing {
    let mut spaces: Vec<Space> = Vec::new();
    let mut parts = Vec::new();
    for dimension in [Dimension::Two, Dimension::Three] {
        let wanted = scenes::parts(dimension).filter(|part| select(part.force, dimension));
        let wanted: Vec<_> = wanted.collect();
        if wanted.is_empty() {
            continue;
        }
        let blank = Offer { stepper, dimension, explicit: "", implicit: None };
        // A name that was accepted in 2D is used in 3D as well.
        let known = spaces.first();
        let explicit = match known.map(|space| &space.explicit) {
            Some(Ok(known)) => first_of(blank, &[*known], false),
            _ => first_of(blank, &EXPLICIT, false),
        };
        let implicit = match (&explicit, known.map(|space| &space.implicit)) {
            (Err(failure), _) => Err(failure.clone()),
            (Ok(_), Some(Ok(known))) => first_of(blank, &[*known], true),
            (Ok(_), _) => first_of(blank, &IMPLICIT, true),
        };
        if let Ok(explicit) = &explicit {
            let implicit = implicit.as_ref().ok().copied();
            let mut session = Session::new(Offer { stepper, dimension, explicit, implicit });
            parts.extend(session.reports(&wanted));
        }
        spaces.push(Space { dimension, explicit, implicit });
    }
    Probing { name: stepper.name(), spaces, parts, required: Vec::new() }
}

/// The first accepted name, or the first failure.
fn first_of(
    offer: Offer<'_>,
    spellings: &[&'static str],
    implicit: bool,
) -> Result<&'static str, Failure> {
    let mut first = None;
    for spelling in spellings {
        match session::takes(offer, spelling, implicit) {
            Ok(()) => return Ok(spelling),
            Err(failure) => {
                first.get_or_insert(failure);
            }
        }
    }
    Err(first.unwrap_or(Failure::TooShort { states: 0, expected: 2 }))
}

/// Particles and dimension of the states in reports.
pub fn shape(dimension: Dimension) -> Shape {
    Shape { dimension, n_particles: scenes::chain(dimension) }
}

/// Positions and velocities of the state with this number, particle-major.
pub fn state(dimension: Dimension, number: usize) -> Option<(Vec<f64>, Vec<f64>)> {
    let states = scenes::states(dimension);
    states.into_iter().nth(number).map(|state| (state.positions, state.velocities))
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use scene::Scene;
    use simulator::force::REGISTRY;

    use super::*;

    #[test]
    fn the_built_in_simulator_is_correct_in_every_part() {
        let probing = probe(&BuiltIn, |_, _| true);
        let both = [Dimension::Two, Dimension::Three];
        let parts: usize = both.map(|dimension| scenes::parts(dimension).count()).iter().sum();
        assert_eq!(probing.parts.len(), parts);
        for part in &probing.parts {
            for (name, finding) in part.findings() {
                // Steps of methods that evaluate forces at different times cannot be compared.
                let kind = REGISTRY.iter().find(|kind| kind.schema.tag == part.force).unwrap();
                let is_value = scenes::Steps::of(&kind.schema) == scenes::Steps::None;
                let expected = if is_value && name != "force" {
                    Verdict::NotOffered
                } else {
                    Verdict::Correct
                };
                assert_eq!(
                    finding.verdict, expected,
                    "{} {} {} {:?}: {finding:?}",
                    part.force, part.part, name, part.dimension
                );
            }
        }
    }

    /// Counts the runs of the built-in simulator.
    #[derive(Default)]
    struct Counting(AtomicUsize);

    impl Stepper for Counting {
        fn name(&self) -> Untrusted {
            BuiltIn.name()
        }

        fn step(&self, scene: &Scene, integrator: &str) -> Result<Vec<f64>, Failure> {
            self.0.fetch_add(1, Ordering::Relaxed);
            BuiltIn.step(scene, integrator)
        }
    }

    #[test]
    fn probing_a_force_takes_few_runs() {
        let runs = |dimension| {
            let counting = Counting::default();
            probe(&counting, |force, of| force == "gravitationalforce" && of == dimension);
            counting.0.into_inner()
        };
        // Two for the methods' names; gravitation is measured together with springs, which are measured as well.
        assert_eq!(runs(Dimension::Two), 2 + 2 * (1 + 3) + 1);
        assert_eq!(runs(Dimension::Three), 2 + 2 * (4 + 9) + 1);
    }
}
