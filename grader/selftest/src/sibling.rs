//! Siblings of scenes that catch what their originals catch.
//!
//! ```text
//! for each try: draw a scene -> is it well-posed? -> does it catch every planted mistake that the original catches?
//! ```
//!
//! A scene catches a mistake if the second simulator with that mistake is off by ten times the tolerance: closer verdicts
//! depend on rounding errors. Where the second simulator does not know a scene, no mistake is planted. The first tries depart
//! furthest from the original. A try depends on the seed, the scene's name and the number of the try, and on nothing else.
//!
//! Cost: a simulation, a calibration of two dozen runs and, of a well-posed scene, a run for each mistake; for each try.

use std::collections::BTreeMap;
use std::fmt;

use fastrand::Rng;
use fuzzing::choices::Choices;
use fuzzing::sibling::{Fault, Files, Reference, draw};
use grader::suite::Case;
use grader::verdict::{Failure, Verdict};
use rayon::prelude::*;

use crate::mistake::Mistake;
use crate::student::{self, Student};

/// Maximum number of tries. The hardest scene of the suite took 54 of 60 with one seed, and more with others.
const TRIES: u32 = 200;

/// Smallest spread of numbers: 2 % of a mass.
const MIN_SPREAD: f64 = 0.1;

/// Maximum number of faults in a message.
const SHOWN: usize = 3;

/// Ratio of a residual to its tolerance from which a scene clearly catches a mistake.
const CLEAR: f64 = 10.0;

/// A sibling of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Sibling {
    /// Its files.
    pub files: Files,
    /// Number of tries that it took.
    pub tries: u32,
    /// The mistakes that the original catches, and the sibling as well, by subject and description; `None` if the second
    /// simulator does not know the scene.
    pub caught: Option<Vec<[&'static str; 2]>>,
}

/// A scene for which no sibling was found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NoSibling {
    /// The name of the scene.
    pub scene: String,
    /// Number of tries; 0 if the scene itself cannot be simulated.
    pub tries: u32,
    /// Kinds of failures with their numbers, the most frequent first.
    pub faults: Vec<(Fault, u32)>,
}

impl fmt::Display for NoSibling {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.tries, self.faults.as_slice()) {
            (0, [(fault, _), ..]) => {
                write!(f, "{}: no sibling, as it fails itself: {fault}", self.scene)
            }
            (tries, faults) => {
                write!(f, "{}: no sibling in {tries} tries; most often:", self.scene)?;
                for (fault, count) in faults.iter().take(SHOWN) {
                    write!(f, "\n  {count:>3}  {fault}")?;
                }
                Ok(())
            }
        }
    }
}

/// Draws the sibling of a scene, which catches those of these mistakes that the scene catches.
///
/// # Errors
/// If the original cannot be simulated, or no try is well-posed and catches what the original catches.
pub fn find(case: &Case, seed: u64, mistakes: &[Mistake]) -> Result<Sibling, NoSibling> {
    let none = |tries, faults: BTreeMap<Fault, u32>| {
        let mut faults: Vec<(Fault, u32)> = faults.into_iter().collect();
        faults.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
        NoSibling { scene: case.id.clone(), tries, faults }
    };
    let original = Reference::of(&case.scene).map_err(|fault| none(0, [(fault, 1)].into()))?;
    let is_known = student::knows(&case.scene);
    let possible = mistakes.par_iter().filter(|mistake| {
        is_known && mistake.can_matter_on(&case.scene) && catches(&original, mistake)
    });
    let caught: Vec<&Mistake> = possible.collect();
    let mut faults = BTreeMap::new();
    for number in 0..TRIES {
        let spread = 1.0 - (1.0 - MIN_SPREAD) * f64::from(number) / f64::from(TRIES - 1);
        let mut choices = choices(seed, &case.id, number);
        let drawn = draw(case, spread, &mut choices).and_then(|drawn| {
            let sibling = original.of_sibling(&drawn.scene)?;
            if is_known {
                check(&sibling, &caught)?;
            }
            Ok(drawn.files)
        });
        match drawn {
            Ok(files) => {
                let name = |mistake: &&Mistake| [mistake.subject, mistake.description];
                let caught = is_known.then(|| caught.iter().map(name).collect());
                return Ok(Sibling { files, tries: number + 1, caught });
            }
            Err(fault) => *faults.entry(fault).or_default() += 1,
        }
    }
    Err(none(TRIES, faults))
}

/// The choices of a try.
fn choices(seed: u64, scene: &str, number: u32) -> Choices {
    // Of FNV-1a, over the bytes of the name: the streams of two scenes have nothing in common.
    let mix = |sum: u64, byte: u64| (sum ^ byte).wrapping_mul(0x0100_0000_01b3);
    let of_scene = scene.bytes().map(u64::from).fold(0xcbf2_9ce4_8422_2325, mix);
    let mut of_seed = Rng::with_seed(seed);
    Choices::random(of_seed.u64(..) ^ mix(of_scene, u64::from(number)))
}

/// Whether the second simulator passes a sibling, and these mistakes fail it.
fn check(sibling: &Reference, mistakes: &[&Mistake]) -> Result<(), Fault> {
    let comparison = sibling.compare(&mut Student::faultless().simulate(sibling.scene()));
    if !comparison.verdict.is_pass() {
        return Err(Fault::Chaotic);
    }
    let escapes = |mistake: &&&Mistake| !catches(sibling, mistake);
    match mistakes.par_iter().find_first(escapes) {
        Some(mistake) => {
            Err(Fault::Escapes(format!("{}, {}", mistake.subject, mistake.description)))
        }
        None => Ok(()),
    }
}

/// Whether a mistake clearly fails on a scene.
fn catches(reference: &Reference, mistake: &Mistake) -> bool {
    let comparison = reference.compare(&mut mistake.student().simulate(reference.scene()));
    match comparison.verdict {
        Verdict::Fail(Failure::Differs) => {
            comparison.allowed.is_some_and(|allowed| allowed.used > CLEAR)
        }
        verdict => !verdict.is_pass(),
    }
}
