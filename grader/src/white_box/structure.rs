//! Properties of a force and its Jacobians as a whole, each with its own verdict.
//!
//! ```text
//! force         F = the law's
//! symmetry      K = Kᵀ where there is an energy            K = ∂F/∂x, B = ∂F/∂v
//! translation   Σ_b K_ab = 0, Σ_b B_ab = 0 for internal forces
//! rotation      F(Rx, Rv) = R F, K(Rx, Rv) = R K Rᵀ, B likewise
//! stencil       blocks outside the couplings are exactly zero, and the couplings are the law's
//! gradient      F = −∇U                                    by differences of the energy U
//! hessian       K = −∇²U                                   by second differences of U
//! projection    of −K of one element: semi-definite, and the nearest such matrix in the Frobenius norm (Higham 1988)
//! ```
//!
//! Tolerances are the rounding errors of the terms, times a factor of the operation; a violation exceeds eight of them.

use nalgebra::DMatrix;
use scene::ForceElement;
use scene::schema::{Conserves, ForceSchema};
use simulator::force::Coupling;

use super::check::{first_step, largest};
use super::states::CheckState;
use super::subject::Subject;
use super::verdict::{By, Property, PropertyFinding};
use jacobian::ridders::{
    Difference, Estimate, Ladder, Sample, differentiate, exact_steps, extrapolate,
};
use jacobian::structure::{self, Pair, Rotation};
use jacobian::verdict::{ROUNDING, Reason, Verdict};
use reference::law::Jacobians;
use reference::law::{Expectation, Law, Scale, Symmetry};

/// Ratio of a difference to its tolerance above which it is a violation.
const CLEAR: f64 = 8.0;

/// A quantity counts as nonzero if it is this many times its tolerance.
const SEEN: f64 = 1e3;

/// If rotating the positions rounds the line between two particles by more rounding errors than this, nothing is
/// compared.
const MOST_LOST: f64 = 1e4;

/// Number of steps of the second differences.
const HESSIAN_LEVELS: usize = 5;

/// Projects the Hessian of an element in so many dimensions.
pub(super) type Project<'a> = &'a (dyn Fn(&DMatrix<f64>, usize) -> DMatrix<f64> + Sync);

/// All properties over all states so far.
pub(super) struct Structure<'a> {
    law: &'static Law,
    project: Project<'a>,
    tallies: Vec<Tally>,
}

/// One property over all states so far.
struct Tally {
    property: Property,
    applies: bool,
    evidence: usize,
    /// The last state that counted as evidence.
    last: String,
    wrong: bool,
    /// The largest violation: in terms of the tolerance, relative, and its state.
    worst: Option<(f64, Estimate, Box<CheckState>)>,
}

/// A state with the quantities that its properties need.
struct Scenario<'a> {
    subject: &'a dyn Subject,
    state: &'a CheckState,
    x: Vec<f64>,
    v: Vec<f64>,
    force: Vec<f64>,
    jacobians: Jacobians,
    expectation: Expectation<'a>,
    scales: Vec<Scale>,
    dimension: usize,
    /// Whether the force at this state is the gradient of its energy.
    conservative: bool,
}

impl<'a> Structure<'a> {
    pub(super) fn new(law: &'static Law, project: Project<'a>) -> Self {
        let tally = |property| Tally {
            property,
            applies: false,
            evidence: 0,
            last: String::new(),
            wrong: false,
            worst: None,
        };
        Self { law, project, tallies: Property::ALL.map(tally).into() }
    }

    /// Adds the properties of `subject` at `state`, unless its force or its Jacobians are undefined.
    pub(super) fn add(&mut self, subject: &dyn Subject, state: &CheckState) {
        let Some(scenario) = Scenario::new(subject, state, self.law) else { return };
        let project = self.project;
        for tally in &mut self.tallies {
            match tally.property {
                Property::Force => scenario.force(tally),
                Property::Symmetry => scenario.symmetry(tally),
                Property::Translation => scenario.translation(tally),
                Property::Rotation => scenario.rotation(tally),
                Property::Stencil => scenario.stencil(tally),
                Property::Gradient => scenario.gradient(tally),
                Property::Hessian => scenario.hessian(tally),
                Property::Projection => scenario.projection(tally, project),
            }
        }
    }

    /// The verdicts, in the order of [`Property::ALL`].
    pub(super) fn finish(self) -> Vec<PropertyFinding> {
        self.tallies.into_iter().map(Tally::finish).collect()
    }
}

impl Tally {
    /// Adds comparisons at `state`; `size` is the reference of relative errors.
    fn compare(
        &mut self,
        state: &CheckState,
        size: f64,
        seen: bool,
        pairs: impl Iterator<Item = Pair>,
    ) {
        self.applies = true;
        // Both Jacobians of a state count as one piece of evidence.
        if seen && self.last != state.name {
            self.evidence += 1;
            self.last.clone_from(&state.name);
        }
        for pair in pairs {
            let excess = pair.excess();
            self.wrong |= excess.is_nan() || excess > CLEAR;
            if self.worst.as_ref().is_none_or(|(known, ..)| excess > *known || excess.is_nan()) {
                let unit = if size > 0.0 { size } else { 1.0 };
                let error = Estimate {
                    value: (pair.value - pair.expected).abs() / unit,
                    uncertainty: pair.allowance / unit,
                };
                self.worst = Some((excess, error, Box::new(state.clone())));
            }
        }
    }

    fn finish(self) -> PropertyFinding {
        let verdict = match self {
            Self { wrong: true, .. } => Verdict::Wrong,
            Self { applies: false, .. } => Verdict::NotApplicable,
            Self { evidence: 0, .. } => Verdict::Inconclusive(Reason::NoEvidence),
            _ => Verdict::Correct,
        };
        let (error, state) = self.worst.map(|(_, error, state)| (error, state)).unzip();
        PropertyFinding { property: self.property, verdict, evidence: self.evidence, error, state }
    }
}

impl<'a> Scenario<'a> {
    fn new(subject: &'a dyn Subject, state: &'a CheckState, law: &'static Law) -> Option<Self> {
        let (x, v, time) = (state.positions(), state.velocities(), state.time);
        let expectation = Expectation::new(law, &state.scene);
        let mut force = vec![0.0; x.len()];
        subject.force(&x, &v, time, &mut force).ok()?;
        let jacobians = subject.jacobians(&x, &v, time).ok()?;
        let variational = state.scene.forces.iter().all(ForceElement::is_variational);
        Some(Self {
            conservative: variational && subject.energy(&x, &v, time).is_some(),
            scales: expectation.scales(&x, &v, time),
            dimension: state.scene.dimension.count(),
            subject,
            state,
            x,
            v,
            force,
            jacobians,
            expectation,
        })
    }

    fn law(&self) -> &'static Law {
        self.expectation.law
    }

    fn schema(&self) -> &'static ForceSchema {
        self.state.scene.forces[0].schema
    }

    fn scale(&self, row: usize) -> &Scale {
        &self.scales[row / self.dimension]
    }

    /// All pairs of row and column.
    fn places(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let size = self.x.len();
        (0..size).flat_map(move |row| (0..size).map(move |column| (row, column)))
    }

    /// Whether the law depends on the positions at all.
    fn bends(&self) -> bool {
        self.schema().depends_on().position
    }

    /// Whether `matrix` is clearly nonzero, compared with its rounding error.
    fn is_seen(&self, by: By) -> bool {
        let matrix = by.of(&self.jacobians);
        self.places().any(|(row, column)| {
            let rounding = ROUNDING * by.scale(self.scale(row));
            matrix[(row, column)].abs() > SEEN * rounding && rounding > 0.0
        })
    }

    fn force(&self, tally: &mut Tally) {
        let expected = self.expectation.force(&self.x, &self.v, self.state.time);
        let size = largest(&expected);
        let noise = ROUNDING * self.scales.iter().map(|scale| scale.force).fold(0.0, f64::max);
        let pairs =
            self.force.iter().zip(&expected).enumerate().map(|(row, (value, expected))| Pair {
                value: *value,
                expected: *expected,
                allowance: 2.0 * ROUNDING * self.scale(row).force,
            });
        tally.compare(self.state, size, size > SEEN * noise, pairs);
    }

    fn symmetry(&self, tally: &mut Tally) {
        let couplings = self.subject.couplings();
        let claimed = !couplings.is_empty()
            && couplings.iter().all(|coupling| match coupling {
                Coupling::Diagonal(_) => true,
                Coupling::Stencil { symmetric, .. } => *symmetric,
            });
        for by in [By::Position, By::Velocity] {
            if !(claimed || (by == By::Position && self.conservative && self.bends())) {
                continue;
            }
            let matrix = by.of(&self.jacobians);
            let allowance =
                |row, column| ROUNDING * (by.scale(self.scale(row)) + by.scale(self.scale(column)));
            let pairs =
                structure::symmetry(|row, column| matrix[(row, column)], matrix.nrows(), allowance);
            tally.compare(self.state, matrix.amax(), self.is_seen(by), pairs);
        }
    }

    fn translation(&self, tally: &mut Tally) {
        if self.schema().conserves < Conserves::Momentum {
            return;
        }
        let size = [self.x.len(); 2];
        for by in [By::Position, By::Velocity] {
            let matrix = by.of(&self.jacobians);
            let allowance = |row, _| 2.0 * ROUNDING * by.scale(self.scale(row));
            let entry = |row, column| matrix[(row, column)];
            let pairs = structure::translation(entry, size, self.dimension, allowance);
            tally.compare(self.state, matrix.amax(), self.is_seen(by), pairs);
        }
    }

    fn rotation(&self, tally: &mut Tally) {
        let turn = match (self.law().symmetry, self.dimension) {
            (Symmetry::None, _) => return,
            (Symmetry::Isotropic, 3) => Rotation::about_every_axis(),
            (_, dimension) => Rotation::about_z(dimension),
        };
        let (x, v) = (turn.turned(&self.x), turn.turned(&self.v));
        let mut force = vec![0.0; x.len()];
        let time = self.state.time;
        let Ok(()) = self.subject.force(&x, &v, time, &mut force) else { return };
        let Ok(jacobians) = self.subject.jacobians(&x, &v, time) else { return };
        // The rotated positions are rounded. The effect on a value grows as the line gets shorter.
        let lost = match self.expectation.shortest(&self.x) {
            Some(length) => 1.0 + largest(&self.x) / length,
            None => 1.0,
        };
        if lost > MOST_LOST {
            return;
        }
        let scales = self.expectation.scales_of_rounded(&self.x, &self.v, time);
        let allowance = |row: usize, of: &dyn Fn(&Scale) -> f64| {
            // A rotated row mixes the components of its particle.
            8.0 * ROUNDING * lost * of(&scales[row / self.dimension])
        };
        let expected = turn.turned(&self.force);
        let pairs = force.iter().zip(&expected).enumerate().map(|(row, (value, expected))| Pair {
            value: *value,
            expected: *expected,
            allowance: allowance(row, &|scale| scale.force),
        });
        tally.compare(self.state, largest(&expected), false, pairs);
        for by in [By::Position, By::Velocity] {
            let (matrix, here) = (by.of(&jacobians), by.of(&self.jacobians));
            let size = here.nrows();
            let expected = DMatrix::from_fn(size, size, |row, column| {
                turn.conjugated(|row, column| here[(row, column)], row, column)
            });
            let pairs = self.places().map(|place| Pair {
                value: matrix[place],
                expected: expected[place],
                allowance: allowance(place.0, &|scale| by.scale(scale)),
            });
            tally.compare(self.state, expected.amax(), self.is_seen(by), pairs);
        }
    }

    fn stencil(&self, tally: &mut Tally) {
        let couplings = self.subject.couplings();
        let n_particles = self.scales.len();
        let dimension = self.dimension;
        let claims = |a: usize, b: usize| {
            couplings.iter().any(|coupling| match coupling {
                Coupling::Diagonal(particle) => a == b && a == *particle,
                Coupling::Stencil { particles, .. } => {
                    particles.contains(&a) && particles.contains(&b)
                }
            })
        };
        let only_diagonal = |a: usize| {
            !couplings.iter().any(|coupling| match coupling {
                Coupling::Diagonal(_) => false,
                Coupling::Stencil { particles, .. } => particles.contains(&a),
            })
        };
        let mut outside = 0;
        let mut pairs = Vec::new();
        for (a, b) in (0..n_particles).flat_map(|a| (0..n_particles).map(move |b| (a, b))) {
            let zero = |value: f64| Pair { value, expected: 0.0, allowance: 0.0 };
            let joined =
                self.expectation.joins(a, b) && (!self.schema().stencil.is_field() || a == b);
            outside += usize::from(!joined);
            if claims(a, b) && !joined {
                // The claim itself is the violation.
                pairs.push(zero(1.0));
            }
            for matrix in [&self.jacobians.by_position, &self.jacobians.by_velocity] {
                let block = matrix.view((a * dimension, b * dimension), (dimension, dimension));
                if !(claims(a, b) && joined) {
                    pairs.extend(block.iter().map(|entry| zero(*entry)));
                } else if only_diagonal(a) {
                    // The coupling claims a multiple of the identity.
                    let places = (0..dimension).flat_map(|r| (0..dimension).map(move |c| (r, c)));
                    pairs.extend(places.map(|(row, column)| Pair {
                        value: block[(row, column)],
                        expected: if row == column { block[(0, 0)] } else { 0.0 },
                        allowance: 0.0,
                    }));
                }
            }
        }
        let size = self.jacobians.by_position.amax().max(self.jacobians.by_velocity.amax());
        let seen = outside > 0 && largest(&self.force) > 0.0;
        tally.compare(self.state, size, seen, pairs.into_iter());
    }

    /// The energy, and a bound of its rounding error.
    fn energy(&self) -> (impl Fn(&[f64]) -> f64, f64) {
        let energy =
            |x: &[f64]| self.subject.energy(x, &self.v, self.state.time).unwrap_or(f64::NAN);
        (energy, ROUNDING * self.scales.iter().map(|scale| scale.energy).sum::<f64>())
    }

    /// The first step along the positions.
    fn first_step(&self) -> f64 {
        first_step(self.expectation.shortest(&self.x), 1.0)
    }

    fn gradient(&self, tally: &mut Tally) {
        if !self.conservative {
            return;
        }
        let (energy, noise) = self.energy();
        let mut evaluate = |x: &[f64], values: &mut [f64]| {
            values[0] = energy(x);
            values[0].is_finite()
        };
        let mut seen = false;
        let mut pairs = Vec::new();
        for (column, force) in self.force.iter().enumerate() {
            let differences = differentiate(
                &mut evaluate,
                &self.x,
                column,
                Ladder::exact(self.first_step()),
                &[noise],
            );
            let Difference::Smooth(Estimate { value, uncertainty }) = differences[0] else {
                continue;
            };
            seen |= value.abs() > SEEN * uncertainty;
            let allowance = uncertainty + ROUNDING * self.scale(column).force;
            pairs.push(Pair { value: *force, expected: -value, allowance });
        }
        tally.compare(self.state, largest(&self.force), seen, pairs.into_iter());
    }

    fn hessian(&self, tally: &mut Tally) {
        if !(self.conservative && self.bends()) {
            return;
        }
        let (energy, noise) = self.energy();
        let matrix = &self.jacobians.by_position;
        let mut seen = false;
        let mut pairs = Vec::new();
        for (row, column) in self.places() {
            let estimate =
                second_difference(&energy, &self.x, [row, column], self.first_step(), noise);
            let Some(Estimate { value, uncertainty }) = estimate else { continue };
            seen |= value.abs() > SEEN * uncertainty;
            pairs.push(Pair {
                value: matrix[(row, column)],
                expected: -value,
                allowance: uncertainty + ROUNDING * self.scale(row).by_position,
            });
        }
        tally.compare(self.state, matrix.amax(), seen, pairs.into_iter());
    }

    fn projection(&self, tally: &mut Tally, project: Project<'_>) {
        let is_one_element =
            self.state.scene.forces.len() == 1 && !self.schema().stencil.is_field();
        if !(self.conservative && is_one_element && self.bends()) {
            return;
        }
        let hessian = -&self.jacobians.by_position;
        let hessian = (&hessian + hessian.transpose()) * 0.5;
        if hessian.iter().any(|entry| !entry.is_finite()) {
            return;
        }
        let projected = project(&hessian, self.dimension);
        let size = hessian.norm();
        let allowance = ROUNDING * size;
        let mut eigen = hessian.clone().symmetric_eigen();
        let below = eigen.eigenvalues.map(|eigenvalue| eigenvalue.min(0.0)).norm();
        let indefinite = below > SEEN * allowance;
        eigen.eigenvalues.apply(|eigenvalue| *eigenvalue = eigenvalue.max(0.0));
        let nearest = eigen.recompose();
        let entries = projected.iter().zip(nearest.iter());
        let mut pairs: Vec<Pair> = entries
            .map(|(value, expected)| Pair { value: *value, expected: *expected, allowance })
            .collect();
        let distance = (&projected - &hessian).norm();
        pairs.push(Pair { value: distance, expected: below, allowance });
        let lowest = projected.symmetric_eigenvalues().min();
        pairs.push(Pair { value: lowest.min(0.0), expected: 0.0, allowance });
        tally.compare(self.state, size, indefinite, pairs.into_iter());
    }
}

/// `∂²U/∂x_row ∂x_column` by central differences, extrapolated.
fn second_difference(
    energy: &impl Fn(&[f64]) -> f64,
    x: &[f64],
    [row, column]: [usize; 2],
    first: f64,
    noise: f64,
) -> Option<Estimate> {
    let mut samples = Vec::with_capacity(HESSIAN_LEVELS);
    let mut moved = x.to_vec();
    let mut step = 0.5 * first;
    for _ in 0..HESSIAN_LEVELS {
        // On the diagonal both steps add up.
        let reach = if row == column { 2.0 * step } else { step };
        if exact_steps(x[row], reach).is_some() && exact_steps(x[column], reach).is_some() {
            let mut at = |along_row: f64, along_column: f64| {
                if row == column {
                    moved[row] = x[row] + (along_row + along_column);
                } else {
                    moved[row] = x[row] + along_row;
                    moved[column] = x[column] + along_column;
                }
                energy(&moved)
            };
            let same = at(step, step) + at(-step, -step);
            let opposite = at(step, -step) + at(-step, step);
            let value = (same - opposite) / (4.0 * step * step);
            samples.push(Sample { step, value, noise: 2.0 * noise / (step * step) });
        }
        step *= 0.5;
    }
    extrapolate(&samples)
}
