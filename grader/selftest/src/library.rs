//! Library of programs with mistakes, each with the feature to blame, and of correct variants.
//!
//! The labels follow from the nature of each mistake and were written before any run.

use super::Expectation;
use diagnosis::findings::{Family, Feature, Part, Symptom};

/// A source file and its build.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Build {
    /// `student.cpp`, with these flags.
    Cpp(&'static [&'static str]),
    /// `student.c`, with these flags.
    C(&'static [&'static str]),
    /// `student.py`.
    Python,
}

/// A planned row.
pub(super) struct Planned {
    /// Place of the mistake, or varied property of the variant.
    pub(super) subject: &'static str,
    /// Short description of the mistake or variant.
    pub(super) description: &'static str,
    pub(super) build: Build,
    /// Settings of the program, as `NAME=value`.
    pub(super) settings: &'static [&'static str],
    pub(super) expectation: Expectation,
    /// Whether its runs exceed a limit, which takes as long as the limit; then only one scene per feature runs.
    pub(super) is_endless: bool,
}

/// The build that most rows use.
const CPP: Build = Build::Cpp(&["-O2"]);
const SINGLE: Build = Build::Cpp(&["-O2", "-DREAL=float"]);
const C: Build = Build::C(&["-O2"]);
const PYTHON: Build = Build::Python;

const ELASTIC: Part = Part::One("springforce", "elastic");
const DAMPING: Part = Part::One("springforce", "damping");
const GRAVITY: Part = Part::All("simplegravity");
const GRAVITATION: Part = Part::All("gravitationalforce");
const DRAG: Part = Part::All("dragdamping");
const VORTEX: Part = Part::All("vortexforce");

const EXPLICIT: Feature = Feature::Integrator("explicit-euler");
const SYMPLECTIC: Feature = Feature::Integrator("symplectic-euler");
const LINEARIZED: Feature = Feature::Integrator("linearized-implicit-euler");
const IMPLICIT: Feature = Feature::Integrator("implicit-euler");

/// Settings of a program.
type Settings = &'static [&'static str];

/// A correct variant: the varied property, the variant, its build and its settings.
type Correct = (&'static str, &'static str, Build, Settings);

#[rustfmt::skip]
const CORRECT: &[Correct] = &[
    ("flags", "-O2", CPP, &[]),
    ("flags", "-O0", Build::Cpp(&["-O0"]), &[]),
    ("flags", "-O3, any vector instructions, fused multiply-add", Build::Cpp(&["-O3", "-march=native", "-ffp-contract=fast"]), &[]),
    ("flags", "fused multiply-add", Build::Cpp(&["-O2", "-mfma", "-ffp-contract=fast"]), &[]),
    ("flags", "fast-math", Build::Cpp(&["-O2", "-ffast-math"]), &[]),
    ("flags", "fast-math, any vector instructions", Build::Cpp(&["-Ofast", "-march=native"]), &[]),
    ("precision", "long double", Build::Cpp(&["-O2", "-DREAL=long double"]), &[]),
    ("precision", "the x87's 80 bits between stores", Build::Cpp(&["-O2", "-mfpmath=387"]), &[]),
    ("order", "forces summed backwards", CPP, &["ORDER=reversed"]),
    ("solver", "LU without pivots", CPP, &["SOLVER=nopivot"]),
    ("solver", "conjugate gradients of the normal equations to 1e-15", CPP, &["SOLVER=krylov", "TOLERANCE=1e-15"]),
    ("start", "Newton's method from (q, v), not from (q + h v, v)", CPP, &["START=state"]),
    ("output", "CSV by %.17g", CPP, &["FORMAT=csv"]),
    ("output", "CSV by %.16e", CPP, &["FORMAT=csv", "DIGITS=%.16e"]),
    ("system", "the unreduced 4 n by Gauss and Jordan, -O2", C, &[]),
    ("system", "the unreduced 4 n by Gauss and Jordan, fast-math", Build::C(&["-Ofast"]), &[]),
    ("system", "lists of lists by connected parts", PYTHON, &[]),
];

/// A mistake: its place, its description, its build, its settings, its symptom and the feature to blame.
type Mistake = (&'static str, &'static str, Build, Settings, Symptom, Feature);

#[rustfmt::skip]
const MISTAKES: &[Mistake] = &[
    ("output", "no header", CPP, &["MISTAKE=output: no header", "FORMAT=csv"], Symptom::Wrong, Feature::Output),
    ("output", "no time column", CPP, &["MISTAKE=output: no time", "FORMAT=csv"], Symptom::Wrong, Feature::Output),
    ("output", "all positions before all velocities, in CSV", CPP, &["MISTAKE=output: grouped otherwise", "FORMAT=csv"], Symptom::Wrong, Feature::Output),
    ("output", "decimal commas", CPP, &["MISTAKE=output: decimal commas", "FORMAT=csv"], Symptom::Wrong, Feature::Output),
    ("output", "positions and velocities by particle, in binary", CPP, &["MISTAKE=output: grouped otherwise"], Symptom::Wrong, Feature::Output),
    ("output", "velocities before positions", CPP, &["MISTAKE=output: velocities before positions"], Symptom::Wrong, Feature::Output),
    ("output", "velocities before positions, in CSV", CPP, &["MISTAKE=output: velocities before positions", "FORMAT=csv"], Symptom::Wrong, Feature::Output),
    ("output", "particles in reverse order", CPP, &["MISTAKE=output: particles in reverse order"], Symptom::Wrong, Feature::Output),
    ("output", "big-endian numbers", CPP, &["MISTAKE=output: bytes in reverse order"], Symptom::Wrong, Feature::Output),
    ("output", "four bytes a number", CPP, &["MISTAKE=output: four bytes a number"], Symptom::Wrong, Feature::Output),
    ("output", "without the initial state", CPP, &["MISTAKE=output: without the initial state"], Symptom::Wrong, Feature::Output),
    ("output", "NaN in the last state", CPP, &["MISTAKE=output: NaN at the end"], Symptom::Wrong, Feature::Output),
    ("output", "cut off within the last state", CPP, &["MISTAKE=output: cut off"], Symptom::Wrong, Feature::Output),
    ("output", "garbage behind the last state", CPP, &["MISTAKE=output: garbage behind the end"], Symptom::Wrong, Feature::Output),
    ("output", "to the standard output", CPP, &["MISTAKE=output: to the standard output"], Symptom::Wrong, Feature::Output),
    ("output", "under another name", CPP, &["MISTAKE=output: under another name"], Symptom::Wrong, Feature::Output),
    ("output", "none, with exit status 0", CPP, &["MISTAKE=output: none, and status 0"], Symptom::Wrong, Feature::Output),
    ("number of states", "one too many", CPP, &["MISTAKE=states: one too many"], Symptom::Wrong, Feature::States),
    ("number of states", "one too few", CPP, &["MISTAKE=states: one too few"], Symptom::Wrong, Feature::States),
    ("number of states", "the quotient rounded down (duration/dt)", CPP, &["MISTAKE=states: the quotient rounded down"], Symptom::Wrong, Feature::States),
    ("number of states", "the quotient rounded to the nearest (duration/dt)", CPP, &["MISTAKE=states: the quotient rounded to the nearest"], Symptom::Wrong, Feature::States),
    ("number of states", "time summed up to the duration", CPP, &["MISTAKE=states: time summed up to the duration"], Symptom::Wrong, Feature::States),
    ("precision", "numbers by %.6g", CPP, &["FORMAT=csv", "DIGITS=%.6g"], Symptom::Wrong, Feature::Precision),
    ("precision", "numbers by %f", CPP, &["FORMAT=csv", "DIGITS=%f"], Symptom::Wrong, Feature::Precision),
    ("precision", "numbers by %.9e", CPP, &["FORMAT=csv", "DIGITS=%.9e"], Symptom::Wrong, Feature::Precision),
    ("precision", "single precision throughout", SINGLE, &[], Symptom::Wrong, Feature::Precision),
    ("precision", "the state in single precision", CPP, &["MISTAKE=precision: the state in single precision"], Symptom::Wrong, Feature::Precision),
    ("precision", "dt in single precision", CPP, &["MISTAKE=precision: dt in single precision"], Symptom::Wrong, Feature::Precision),
    ("precision", "forces between pairs in single precision", CPP, &["MISTAKE=precision: forces in single precision"], Symptom::Wrong, Feature::Precision),
    ("reading", "dt is always 0.01", CPP, &["MISTAKE=reading: dt is always 0.01"], Symptom::Wrong, Feature::Reading),
    ("reading", "velocities are left 0", CPP, &["MISTAKE=reading: velocities are left 0"], Symptom::Wrong, Feature::Reading),
    ("reading", "the duration is always 1 s", CPP, &["MISTAKE=reading: the duration is always 1 s"], Symptom::Wrong, Feature::Reading),
    ("reading", "only the first force", CPP, &["MISTAKE=reading: only the first force"], Symptom::Wrong, Feature::Reading),
    ("reading", "every mass is 1", CPP, &["MISTAKE=reading: every mass is 1"], Symptom::Wrong, Feature::Reading),
    ("reading", "l0 is read as k", CPP, &["MISTAKE=reading: l0 as k"], Symptom::Wrong, Feature::Force(ELASTIC)),
    ("simple gravity", "only along y", CPP, &["MISTAKE=gravity: only along y"], Symptom::Wrong, Feature::Force(GRAVITY)),
    ("crash", "segmentation fault with damping", CPP, &["MISTAKE=crash: segmentation fault with damping"], Symptom::Crash, Feature::Force(DAMPING)),
    ("crash", "exception in the vortex", CPP, &["MISTAKE=crash: exception in the vortex"], Symptom::Crash, Feature::Force(VORTEX)),
    ("crash", "gravitation is refused", CPP, &["MISTAKE=crash: no gravitation"], Symptom::Crash, Feature::Force(GRAVITATION)),
    ("crash", "exception at a fixed particle", CPP, &["MISTAKE=crash: exception at a fixed particle"], Symptom::Crash, Feature::Fixed(Family::Any)),
    ("crash", "implicit Euler aborts", CPP, &["MISTAKE=crash: implicit Euler aborts"], Symptom::Crash, IMPLICIT),
    ("crash", "linearized implicit Euler is not written", CPP, &["MISTAKE=crash: no linearized implicit Euler"], Symptom::Crash, LINEARIZED),
    ("crash", "status 1 with a right trace", CPP, &["MISTAKE=crash: status 1 with a right trace"], Symptom::Crash, Feature::Everything),
    ("crash", "a matrix lost every linearized step", CPP, &["MISTAKE=crash: a matrix lost every linearized step"], Symptom::Memory, LINEARIZED),
    ("Newton's method", "never stops", CPP, &["MISTAKE=newton: never stops"], Symptom::TimeOut, IMPLICIT),
    ("Newton's method", "a single iteration", CPP, &["MISTAKE=newton: a single iteration"], Symptom::Wrong, IMPLICIT),
    ("Newton's method", "two iterations", CPP, &["MISTAKE=newton: two iterations"], Symptom::Wrong, IMPLICIT),
    ("Newton's method", "stops at 1e-3", CPP, &["MISTAKE=newton: stops at 1e-3"], Symptom::Wrong, IMPLICIT),
    ("Newton's method", "looks at the first component only", CPP, &["MISTAKE=newton: looks at the first component only"], Symptom::Wrong, IMPLICIT),
    ("Newton's method", "adds the components up, signs and all", CPP, &["MISTAKE=newton: adds the components up, signs and all"], Symptom::Wrong, IMPLICIT),
    ("Newton's method", "the squared norm against 1e-5", CPP, &["MISTAKE=newton: the squared norm against 1e-5"], Symptom::Wrong, IMPLICIT),
    ("Newton's method", "returns the iterate before the last", CPP, &["MISTAKE=newton: returns the iterate before the last"], Symptom::Wrong, IMPLICIT),
    ("fixed particles", "not read", CPP, &["MISTAKE=fixed: not read"], Symptom::Wrong, Feature::Fixed(Family::Any)),
    ("fixed particles", "stopped", CPP, &["MISTAKE=fixed: stopped"], Symptom::Wrong, Feature::Fixed(Family::Any)),
    ("fixed particles", "springs to them are left out", CPP, &["MISTAKE=fixed: springs to them are left out"], Symptom::Wrong, Feature::Fixed(Family::Any)),
    ("fixed particles", "move with the forces under explicit methods", CPP, &["MISTAKE=fixed: move with the forces under explicit methods"], Symptom::Wrong, Feature::Fixed(Family::Explicit)),
    ("fixed particles", "only the right-hand side is cleared", CPP, &["MISTAKE=fixed: only the right-hand side is cleared"], Symptom::Wrong, Feature::Fixed(Family::Implicit)),
    ("fixed particles", "the right-hand side is not cleared", CPP, &["MISTAKE=fixed: the right-hand side is not cleared"], Symptom::Wrong, Feature::Fixed(Family::Implicit)),
    ("explicit Euler", "position with the new velocity", CPP, &["MISTAKE=explicit: position with the new velocity"], Symptom::Wrong, EXPLICIT),
    ("symplectic Euler", "position with the old velocity", CPP, &["MISTAKE=symplectic: position with the old velocity"], Symptom::Wrong, SYMPLECTIC),
    ("spring", "one spring too stiff by 1e-6 in its Jacobian", CPP, &["MISTAKE=spring: Jacobian off by 1e-6"], Symptom::Wrong, Feature::Jacobian(ELASTIC)),
    ("spring", "Jacobian without l0", CPP, &["MISTAKE=spring: Jacobian without l0"], Symptom::Wrong, Feature::Jacobian(ELASTIC)),
    ("damping", "∂F/∂x made symmetric", CPP, &["MISTAKE=damping: dF/dx made symmetric"], Symptom::Wrong, Feature::Jacobian(DAMPING)),
    ("damping", "∂F/∂x over l²", CPP, &["MISTAKE=damping: dF/dx over l²"], Symptom::Wrong, Feature::Jacobian(DAMPING)),
    ("gravitation", "1/l in force and Jacobian", CPP, &["MISTAKE=gravitation: 1/l in force and Jacobian"], Symptom::Wrong, Feature::Force(GRAVITATION)),
    ("vortex", "cross blocks transposed", CPP, &["MISTAKE=vortex: cross blocks transposed"], Symptom::Wrong, Feature::Jacobian(VORTEX)),
    ("spring", "l0/r² in ∂F/∂x", C, &["MISTAKE=l0/r² in dF/dx"], Symptom::Wrong, Feature::Jacobian(ELASTIC)),
    ("damping", "∂F/∂x of d·w missing", C, &["MISTAKE=dF/dx of d·w missing"], Symptom::Wrong, Feature::Jacobian(DAMPING)),
    ("gravitation", "its force doubled, its Jacobian not", C, &["MISTAKE=gravitation's force doubled, its Jacobian not"], Symptom::Wrong, Feature::Force(GRAVITATION)),
    ("linear drag", "no Jacobian", C, &["MISTAKE=drag without its Jacobian"], Symptom::Wrong, Feature::Jacobian(DRAG)),
    ("linearized implicit Euler", "forces at q instead of q + h v", C, &["MISTAKE=no h v ahead"], Symptom::Wrong, LINEARIZED),
    ("linearized implicit Euler", "h² B instead of h B", C, &["MISTAKE=h² B"], Symptom::Wrong, LINEARIZED),
    ("linear drag", "its Jacobian divided by the mass", PYTHON, &["MISTAKE=drag's Jacobian divided by the mass"], Symptom::Wrong, Feature::Jacobian(DRAG)),
    ("damping", "n and its change swapped", PYTHON, &["MISTAKE=n and its change swapped"], Symptom::Wrong, Feature::Jacobian(DAMPING)),
];

/// All rows, correct variants first.
pub(super) fn rows() -> Vec<Planned> {
    let correct = CORRECT.iter().map(|(subject, description, build, settings)| Planned {
        subject,
        description,
        build: *build,
        settings,
        expectation: Expectation::Correct,
        is_endless: false,
    });
    let mistakes =
        MISTAKES.iter().map(|(subject, description, build, settings, symptom, feature)| {
            let is_endless = matches!(symptom, Symptom::TimeOut | Symptom::Memory);
            let expectation = Expectation::Mistake(*symptom, *feature);
            Planned { subject, description, build: *build, settings, expectation, is_endless }
        });
    correct.chain(mistakes).collect()
}
