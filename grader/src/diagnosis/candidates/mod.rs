//! Candidate mistakes that explain the wrong velocities of a step.
//!
//! With the effective momentum of a term `T`,
//!
//! ```text
//! E = h F                            explicit, symplectic and implicit Euler
//! E = h F + (h² K + h B)(v' − v)     linearized implicit Euler
//! r = Σ E of the terms that the program adds, minus Σ E of those it leaves out
//! ```
//!
//! A term with another factor shows as `r = c E`, with the same `c` for all coordinates of all examined steps. Other
//! candidates predict `r` itself. Either kind leaves a remainder.

mod force;
mod jacobian;
mod method;

use nalgebra::{DMatrix, DVector};
use simulator::scene::ForceElement;

use super::physics::{Method, Physics, Point, Term};
use super::steps::Sample;

/// The place of a mistake.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Culprit {
    /// A force, by its tag.
    Force(&'static str),
    /// Jacobians of a force, by its tag.
    Jacobian(&'static str),
    /// The integrator.
    Integrator,
    /// The treatment of fixed particles.
    Fixed,
    /// The notation of numbers in the output.
    Output,
}

/// A possible explanation of a defect.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The mistake, in words.
    pub words: String,
    /// Its place.
    pub culprit: Culprit,
}

/// A candidate with the norm of its remainder.
pub(super) struct Tried {
    pub(super) candidate: Candidate,
    pub(super) rest: f64,
    /// Whether it is a plausible mistake, rather than an unusual factor.
    pub(super) named: bool,
}

/// A factor in words, and whether it is a plausible mistake.
type Factor = Option<(String, bool)>;

/// The quantities of a step that all candidates need.
struct Prepared {
    at: Point,
    delta: DVector<f64>,
    residual: DVector<f64>,
    terms: Vec<Parts>,
}

/// A term's force, and its Jacobians where the method uses them.
struct Parts {
    force: DVector<f64>,
    jacobians: Option<(DMatrix<f64>, DMatrix<f64>)>,
}

/// Tries candidates on the momentum of some steps.
pub(super) struct Trial<'a> {
    physics: &'a Physics<'a>,
    samples: &'a [Sample],
    terms: Vec<Term>,
    prepared: Vec<Prepared>,
    tried: Vec<Tried>,
}

/// One vector for each step.
type Vectors = Vec<DVector<f64>>;

impl<'a> Trial<'a> {
    pub(super) fn new(physics: &'a Physics<'a>, samples: &'a [Sample]) -> Self {
        let terms = Term::all(physics.scene);
        let mut trial = Self { physics, samples, terms, prepared: Vec::new(), tried: Vec::new() };
        trial.prepared = samples.iter().map(|sample| trial.prepare(sample)).collect();
        trial
    }

    fn prepare(&self, sample: &Sample) -> Prepared {
        let at = self.physics.point(sample);
        let delta = self.physics.delta(sample);
        let terms: Vec<Parts> =
            self.terms.iter().map(|term| self.parts(&term.elements, &at)).collect();
        let mut residual = self.physics.momentum(&delta);
        for parts in &terms {
            residual -= self.effective(parts, &delta);
        }
        Prepared { residual: self.physics.free(residual), at, delta, terms }
    }

    fn parts(&self, elements: &[ForceElement], at: &Point) -> Parts {
        let linearized = self.physics.method == Method::Linearized;
        Parts {
            force: self.physics.force(elements, at),
            jacobians: linearized.then(|| self.physics.jacobians(elements, at)),
        }
    }

    /// `E`.
    fn effective(&self, parts: &Parts, delta: &DVector<f64>) -> DVector<f64> {
        let h = self.physics.h;
        let force = &parts.force * h;
        match &parts.jacobians {
            Some((k, b)) => force + (k * delta) * (h * h) + (b * delta) * h,
            None => force,
        }
    }

    /// The norm of the defect.
    pub(super) fn norm(&self) -> f64 {
        norm(&self.residuals())
    }

    fn residuals(&self) -> Vectors {
        self.prepared.iter().map(|step| step.residual.clone()).collect()
    }

    /// One vector for each step, zero for fixed particles.
    fn each(&self, of: impl Fn(&Prepared) -> DVector<f64>) -> Vectors {
        self.prepared.iter().map(|step| self.physics.free(of(step))).collect()
    }

    /// Tries `r = c g` with the best `c`.
    fn try_factor(&mut self, g: &Vectors, culprit: Culprit, words: impl Fn(f64) -> Factor) {
        let residuals = self.residuals();
        let product =
            |a: &Vectors, b: &Vectors| -> f64 { a.iter().zip(b).map(|(a, b)| a.dot(b)).sum() };
        let square = product(g, g);
        if square.is_nan() || square == 0.0 {
            return;
        }
        let c = product(g, &residuals) / square;
        let Some((words, named)) = words(c) else { return };
        let rest: Vectors = residuals.iter().zip(g).map(|(r, g)| r - g * c).collect();
        let candidate = Candidate { words, culprit };
        self.tried.push(Tried { candidate, rest: norm(&rest), named });
    }

    /// Tries `r = rest`.
    fn try_rest(&mut self, rest: &Vectors, culprit: Culprit, words: String) {
        let candidate = Candidate { words, culprit };
        self.tried.push(Tried { candidate, rest: norm(rest), named: true });
    }

    /// Tries another force, and possibly other Jacobians, in the place of a term's.
    fn try_instead(
        &mut self,
        number: usize,
        culprit: Culprit,
        words: &str,
        other: impl Fn(&Prepared) -> DVector<f64>,
    ) {
        let h = self.physics.h;
        let rest = self.each(|step| &step.residual - (other(step) - &step.terms[number].force) * h);
        self.try_rest(&rest, culprit, words.to_owned());
    }

    /// Tries all candidates, the simplest first.
    pub(super) fn run(mut self) -> Vec<Tried> {
        for number in 0..self.terms.len() {
            self.factors(number);
        }
        self.integrator();
        for number in 0..self.terms.len() {
            self.parameters(number);
            self.shapes(number);
            self.formulas(number);
            self.elements(number);
            if self.physics.method == Method::Linearized {
                self.jacobian_shapes(number);
            }
        }
        self.tried
    }
}

fn norm(vectors: &Vectors) -> f64 {
    vectors.iter().map(DVector::norm_squared).sum::<f64>().sqrt()
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-6 * b.abs().max(1.0)
}

/// `what` with the factor `1 + c`; `None` if the factor is close to 1.
fn factor(what: &str, c: f64, h: f64) -> Factor {
    let factor = 1.0 + c;
    let words = match factor {
        // A factor this close to 1 is another mistake in disguise.
        f if (f - 1.0).abs() < 1e-4 => return None,
        f if near(f, 0.0) => "is missing".to_owned(),
        f if near(f, -1.0) => "has the wrong sign".to_owned(),
        f if near(f * h, 1.0) => "is not multiplied by h".to_owned(),
        f if near(f * h * h, 1.0) => "is not multiplied by h²".to_owned(),
        f if near(f / h, 1.0) => "is multiplied by h once too often".to_owned(),
        f if is_simple(f) => format!("is multiplied by {}", digits(f)),
        f => return Some((format!("{what} is multiplied by {}", digits(f)), false)),
    };
    Some((format!("{what} {words}"), true))
}

/// Whether it is a ratio of small integers.
fn is_simple(factor: f64) -> bool {
    (1..=4).any(|denominator| {
        let numerator = factor * f64::from(denominator);
        numerator.abs() < 8.5 && near(numerator, numerator.round())
    })
}

/// The same for a factor from a short list.
fn exactly(what: &str, c: f64) -> Factor {
    [0.0, -1.0, 2.0].into_iter().find(|f| near(1.0 + c, *f))?;
    factor(what, c, f64::INFINITY)
}

/// A power of the length, in words.
fn lengths(power: i32) -> String {
    let digits = ["", "l", "l²", "l³"][power.unsigned_abs() as usize % 4];
    if power < 0 { format!("1/{digits}") } else { digits.to_owned() }
}

/// At most six digits, without trailing zeros.
fn digits(value: f64) -> String {
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    rounded.to_string()
}
