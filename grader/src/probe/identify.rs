//! Identifies the matrix of a program's implicit steps from the steps alone.
//!
//! A step of linearized implicit Euler from `(x − h v, v)` evaluates everything at `(x, v)`, whatever `h`:
//!
//! ```text
//! (M − A) δ = h F(x, v)      A = h² K + h B,   δ = v' − v
//! M_r δ_r − h F_r = A δ_r    for each combination r of masses, F_r by an explicit step with these masses
//! ```
//!
//! Each row of `A` is a least-squares problem with the same matrix of `δ_r`, solved by one singular value
//! decomposition. There are twice as many equations as unknowns, plus two. So the residual `s` shows how exactly the
//! program solves its equations, and the standard error of entry `c` is `s √(ΔᵀΔ)⁻¹_cc`.
//!
//! The unknown is the difference of `A` from the matrix of the program's own force. Directions in which the steps do
//! not move the particles are left out: there `A` keeps its expected value. (With a right force and a right Jacobian
//! there are no such directions. A wrong Jacobian may keep the particles on their lines.)
//!
//! If no matrix leaves a small residual, the step itself is wrong: other masses on the left or another right-hand side
//! are tried ([`MODELS`]). If no model fits, the groups are stepped again, in smaller sets and in reverse order. An exact
//! solver takes the same steps with fewer groups, an iterative solver that stops early does not; the difference
//! measures its error. In another order its steps change by no more than that: if they change much, the step is wrong.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::differences::{Estimate, Offer, Sample};
use super::noise::{self, CLEAR, MATRIX};
use super::scenes::{Elements, Group, State, TIME_STEPS};
use crate::verdict::Failure;

/// A relative residual above this is not rounding of a solver: programs that meet the course's criteria solve more
/// exactly.
pub(super) const UNEXPLAINED: f64 = 1e-4;

/// A relative residual above this cannot come from a solver: the step depends wrongly on other particles.
const LOOSEST: f64 = 1e-2;

/// With a relative residual below this, no other model is tried.
const EXPLAINED: f64 = 1e-9;

/// Relative singular values below this belong to directions without motion.
const UNMOVED: f64 = 1e-11;

/// Minimum ratio by which another model must reduce the residual.
const BETTER: f64 = 1e3;

/// Steps of one state with one time step.
#[derive(Debug, Clone)]
pub(super) struct Experiment {
    pub(super) h: f64,
    /// The force at the expected evaluation point of the step.
    pub(super) twins: Vec<Sample>,
    /// `v' − v` for each combination of masses.
    pub(super) changes: Vec<Vec<f64>>,
    /// The force at the start of the step, if it was needed.
    at_start: Option<Vec<Sample>>,
    /// The expected matrix, from the program's own force.
    own: DMatrix<f64>,
}

/// A matrix that explains steps.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    pub(super) matrix: Estimate,
    /// Its difference from the expected matrix.
    pub(super) excess: DMatrix<f64>,
    /// Largest residual, relative to the largest term of the equations.
    pub(super) residual: f64,
    /// Projects on the directions in which the steps move the particles.
    pub(super) moved: DMatrix<f64>,
    /// Whether these are not all directions.
    pub(super) is_partial: bool,
}

/// A model of the step: `(L − A) δ = c W F`.
pub(super) struct Model {
    /// The mistake that the model describes.
    pub(super) difference: &'static str,
    /// `L` as a function of the mass.
    left: fn(f64) -> f64,
    /// `c W` as a function of time step and mass.
    right: fn(f64, f64) -> f64,
    /// Whether the force is evaluated at the start of the step.
    at_start: bool,
}

/// The right step, and common mistakes.
pub(super) static MODELS: [Model; 9] = [
    Model { difference: "", left: |m| m, right: |h, _| h, at_start: false },
    Model {
        difference: "the right-hand side evaluates the force at q, not at q + h v",
        left: |m| m,
        right: |h, _| h,
        at_start: true,
    },
    Model {
        difference: "the left-hand side has the identity instead of the mass matrix",
        left: |_| 1.0,
        right: |h, _| h,
        at_start: false,
    },
    Model {
        difference: "the right-hand side lacks the factor h",
        left: |m| m,
        right: |_, _| 1.0,
        at_start: false,
    },
    Model {
        difference: "the right-hand side has h² instead of h",
        left: |m| m,
        right: |h, _| h * h,
        at_start: false,
    },
    Model {
        difference: "the right-hand side has the wrong sign",
        left: |m| m,
        right: |h, _| -h,
        at_start: false,
    },
    Model {
        difference: "the right-hand side is divided by the masses, the left-hand side is not",
        left: |m| m,
        right: |h, m| h / m,
        at_start: false,
    },
    Model {
        difference: "the Jacobians are not divided by the masses, but everything else is",
        left: |_| 1.0,
        right: |h, m| h / m,
        at_start: false,
    },
    Model {
        difference: "the right-hand side has half of its force",
        left: |m| m,
        right: |h, _| h / 2.0,
        at_start: false,
    },
];

/// Steps with `elements` from all states, and the model that explains them.
pub(super) struct Steps {
    /// By state, then by time step.
    pub(super) experiments: Vec<Vec<Experiment>>,
    pub(super) fits: Vec<Vec<Fit>>,
    pub(super) model: &'static Model,
    /// The largest relative residual of all fits.
    pub(super) residual: f64,
    /// The same for the right model.
    pub(super) residual_of_right: f64,
    /// Relative difference between steps of all groups and of smaller sets; 0 if the order of the groups matters much.
    /// Measured only if no model fits.
    looseness: f64,
}

/// The elements of a scene, and the program's force with them.
pub(super) struct Variant {
    pub(super) elements: Vec<Elements>,
    /// At each state with every combination of masses.
    pub(super) forces: Vec<Sample>,
}

impl Steps {
    /// Takes the steps and fits one matrix to those of all `variants`. `own` are the expected matrices, from the
    /// program's own force, by state and time step.
    ///
    /// # Errors
    /// If a run fails.
    pub(super) fn take(
        offer: Offer<'_>,
        implicit: &str,
        variants: &[Variant],
        states: &[State],
        own: &[Vec<DMatrix<f64>>],
    ) -> Result<Self, Failure> {
        let before = |h: f64| -> Vec<Group> {
            let states: Vec<State> = states.iter().map(|state| state.before(h)).collect();
            Group::of_all_masses(&states, offer.dimension)
        };
        let forces = variants.iter().map(|variant| variant.forces.clone());
        let twins = by_state(&forces.collect::<Vec<_>>(), states.len());
        let take = |h: &f64| -> Result<Vec<Vec<Vec<f64>>>, Failure> {
            let groups = before(*h);
            let of = |variant: &Variant| offer.changes(implicit, &variant.elements, &groups, *h);
            let of_variants: Result<Vec<_>, Failure> = variants.par_iter().map(of).collect();
            Ok(by_state(&of_variants?, states.len()))
        };
        let taken: Result<Vec<_>, Failure> = TIME_STEPS.par_iter().map(take).collect();
        let taken = taken?;
        let experiment = |state: usize, step: usize| Experiment {
            h: TIME_STEPS[step],
            twins: twins[state].clone(),
            changes: taken[step][state].clone(),
            at_start: None,
            own: own[state][step].clone(),
        };
        let of_state = |state| (0..TIME_STEPS.len()).map(|step| experiment(state, step)).collect();
        let mut experiments: Vec<Vec<Experiment>> = (0..states.len()).map(of_state).collect();

        let right = &MODELS[0];
        let (mut fits, mut residual) = fit_all(&experiments, right);
        let residual_of_right = residual;
        let mut model = right;
        if residual > EXPLAINED {
            for (step, h) in TIME_STEPS.into_iter().enumerate() {
                let of = |variant: &Variant| offer.samples(&variant.elements, &before(h));
                let samples: Result<Vec<_>, Failure> = variants.iter().map(of).collect();
                let samples = by_state(&samples?, states.len());
                for (experiments, samples) in experiments.iter_mut().zip(samples) {
                    experiments[step].at_start = Some(samples);
                }
            }
            let limit = residual / BETTER;
            for other in &MODELS[1..] {
                let (found, left) = fit_all(&experiments, other);
                if left < residual && left < limit && left < UNEXPLAINED {
                    (fits, residual, model) = (found, left, other);
                }
            }
        }
        let mut looseness: f64 = 0.0;
        if residual > UNEXPLAINED {
            let mut by_order: f64 = 0.0;
            let elements = &variants[0].elements;
            for (step, h) in TIME_STEPS.into_iter().enumerate() {
                let mut groups = before(h);
                let each = groups.len() / states.len();
                let mut beside_fewer = Vec::with_capacity(groups.len());
                for of_state in groups.chunks(each) {
                    for half in of_state.chunks(each.div_ceil(2)) {
                        beside_fewer.extend(offer.changes(implicit, elements, half, h)?);
                    }
                }
                groups.reverse();
                let mut reversed = offer.changes(implicit, elements, &groups, h)?;
                reversed.reverse();
                let again = beside_fewer.chunks(each).zip(reversed.chunks(each));
                for (experiments, (beside_fewer, reversed)) in experiments.iter().zip(again) {
                    looseness = looseness.max(experiments[step].difference(beside_fewer));
                    by_order = by_order.max(experiments[step].difference(reversed));
                }
            }
            if by_order > CLEAR * LOOSEST {
                looseness = 0.0;
            }
        }
        Ok(Self { experiments, fits, model, residual, residual_of_right, looseness })
    }

    /// Whether the right model explains the step.
    pub(super) fn is_right(&self) -> bool {
        self.model.difference.is_empty() && self.is_explained()
    }

    /// Whether there are directions without motion.
    pub(super) fn is_partial(&self) -> bool {
        self.fits.iter().flatten().any(|fit| fit.is_partial)
    }

    /// Whether the solver stops so early that its error may explain the whole residual.
    pub(super) fn is_loose(&self) -> bool {
        !self.is_explained() && self.residual <= LOOSEST.min(CLEAR * self.looseness)
    }

    /// Whether some matrix explains the steps.
    pub(super) fn is_explained(&self) -> bool {
        self.residual <= UNEXPLAINED
    }
}

/// Of what belongs to every state of each variant, what belongs to each state: that of all variants.
fn by_state<T: Clone>(of_variants: &[Vec<T>], n_states: usize) -> Vec<Vec<T>> {
    let of_state = |state: usize| {
        let parts = of_variants.iter().map(|all| {
            let n = all.len() / n_states;
            &all[state * n..(state + 1) * n]
        });
        parts.collect::<Vec<_>>().concat()
    };
    (0..n_states).map(of_state).collect()
}

fn fit_all(experiments: &[Vec<Experiment>], model: &Model) -> (Vec<Vec<Fit>>, f64) {
    let fits: Vec<Vec<Fit>> = experiments
        .iter()
        .map(|of_state| of_state.iter().map(|experiment| experiment.fit(model)).collect())
        .collect();
    let residuals = fits.iter().flatten().map(|fit: &Fit| fit.residual);
    let residual = residuals.fold(0.0, f64::max);
    (fits, residual)
}

impl Experiment {
    /// `L δ` and `c W F` of each step.
    fn terms(&self, model: &Model) -> [DMatrix<f64>; 2] {
        let (steps, size) = (self.changes.len(), self.changes.first().map_or(0, Vec::len));
        let forces = match &self.at_start {
            Some(samples) if model.at_start => samples,
            _ => &self.twins,
        };
        let mass = |step: usize, column: usize| {
            let masses = &self.twins[step].group.masses;
            masses[column * masses.len() / size]
        };
        let left = DMatrix::from_fn(steps, size, |step, column| {
            (model.left)(mass(step, column)) * self.changes[step][column]
        });
        let right = DMatrix::from_fn(steps, size, |step, column| {
            (model.right)(self.h, mass(step, column)) * forces[step].force[column]
        });
        [left, right]
    }

    /// Largest difference of these steps from its own first ones, relative to the largest term of the equations.
    fn difference(&self, others: &[Vec<f64>]) -> f64 {
        let mut largest: f64 = 0.0;
        for ((other, change), twin) in others.iter().zip(&self.changes).zip(&self.twins) {
            let heaviest = twin.group.masses.iter().copied().fold(0.0, f64::max);
            let pairs = other.iter().zip(change);
            largest = pairs.map(|(a, b)| heaviest * (a - b).abs()).fold(largest, f64::max);
        }
        let scale = self.terms(&MODELS[0]).iter().map(DMatrix::amax).fold(0.0, f64::max);
        if scale > 0.0 { largest / scale } else { 0.0 }
    }

    /// Residual of the steps' equations with these matrices as `A`, as a multiple of its bound: one matrix for each
    /// combination of masses, for the first variant.
    pub(super) fn excess(&self, matrices: &[Estimate]) -> f64 {
        let [left, right] = self.terms(&MODELS[0]);
        let mut worst: f64 = 0.0;
        for (step, (matrix, change)) in matrices.iter().zip(&self.changes).enumerate() {
            for row in 0..change.len() {
                let mut rest = left[(step, row)] - right[(step, row)];
                let mut bound = self.rounding(&left, &right) * noise::FORCE;
                for (column, change) in change.iter().enumerate() {
                    rest -= matrix.value[(row, column)] * change;
                    bound += matrix.bound[(row, column)] * change.abs();
                }
                worst = worst.max(rest.abs() / bound);
            }
        }
        worst
    }

    /// Rounding error of one equation, from the velocities times the masses and from the forces.
    fn rounding(&self, left: &DMatrix<f64>, right: &DMatrix<f64>) -> f64 {
        let speeds = self.twins.iter().zip(&self.changes).flat_map(|(twin, change)| {
            let mass = twin.group.masses.iter().copied().fold(1.0, f64::max);
            let speeds = twin.group.state.velocities.iter().zip(change);
            speeds.map(move |(v, dv)| mass * (v.abs() + dv.abs()))
        });
        noise::ROUNDING * speeds.fold(left.amax() + right.amax(), f64::max)
    }

    fn fit(&self, model: &Model) -> Fit {
        let (steps, size) = (self.changes.len(), self.changes.first().map_or(0, Vec::len));
        let [left, right] = self.terms(model);
        let changes = DMatrix::from_fn(steps, size, |step, column| self.changes[step][column]);
        // The part that the program's own force does not explain.
        let wanted = &left - &right - &changes * self.own.transpose();
        let decomposition = changes.clone().svd(true, true);
        let (Some(u), Some(v_t)) = (&decomposition.u, &decomposition.v_t) else {
            return Fit::none(size);
        };
        let values = &decomposition.singular_values;
        let least = values.max() * UNMOVED;
        let invert = |value: f64| if value > least { 1.0 / value } else { 0.0 };
        let is_partial = values.iter().any(|value| *value <= least);
        let scaled = v_t.transpose() * DMatrix::from_diagonal(&values.map(invert));
        let kept = v_t.transpose() * DMatrix::from_diagonal(&values.map(|v| f64::from(v > least)));
        let transposed = &scaled * (u.transpose() * &wanted);
        let rest = &wanted - &changes * &transposed;
        let freedom = (steps - size) as f64;
        let spread = rest.column_iter().map(|column| (column.norm_squared() / freedom).sqrt());
        let rounding = self.rounding(&left, &right);
        let noise = spread.fold(0.0, f64::max).max(rounding);
        let errors: Vec<f64> = scaled.row_iter().map(|row| row.norm()).collect();
        let bound = DMatrix::from_fn(size, size, |_, column| {
            // An entry that no step determines is as uncertain as the rounding of the others.
            MATRIX * noise * errors[column].max(f64::EPSILON)
        });
        let scale = left.amax().max(right.amax());
        let residual = if scale > 0.0 { rest.amax() / scale } else { f64::INFINITY };
        let excess = transposed.transpose();
        let matrix = Estimate { value: &self.own + &excess, bound };
        Fit { matrix, excess, residual, moved: kept * v_t, is_partial }
    }
}

impl Fit {
    fn none(size: usize) -> Self {
        let infinite = DMatrix::from_element(size, size, f64::INFINITY);
        Self {
            matrix: Estimate { value: DMatrix::zeros(size, size), bound: infinite },
            excess: DMatrix::zeros(size, size),
            residual: f64::INFINITY,
            moved: DMatrix::zeros(size, size),
            is_partial: true,
        }
    }
}

#[cfg(test)]
mod tests {
    use scene::Dimension;

    use super::super::scenes::{Steps as Kind, parts, states};
    use super::super::stepper::BuiltIn;
    use super::*;

    #[test]
    fn jacobians_are_identified_from_built_in_steps() {
        for dimension in [Dimension::Two, Dimension::Three] {
            let offer = Offer {
                stepper: &BuiltIn,
                dimension,
                explicit: "explicit-euler",
                implicit: Some("linearized-implicit-euler"),
            };
            let states = states(dimension);
            for part in parts(dimension).filter(|part| part.steps == Kind::Chain) {
                // The expected matrix must not affect the result.
                let size = offer.size();
                let nothing =
                    vec![vec![DMatrix::zeros(size, size); TIME_STEPS.len()]; states.len()];
                let method = "linearized-implicit-euler";
                let elements = vec![part.full];
                let all = Group::of_all_masses(&states, dimension);
                let forces = offer.samples(&elements, &all).unwrap();
                let variant = Variant { elements, forces };
                let steps = Steps::take(offer, method, &[variant], &states, &nothing).unwrap();
                assert!(steps.is_right() && steps.residual < 1e-13 && !steps.is_partial());
                let centers = Group::of_unit_masses(&states, dimension);
                let (found, _) = offer.differences(&[part.full], &centers, &[]).unwrap();
                for (fits, found) in steps.fits.iter().zip(&found) {
                    for (fit, h) in fits.iter().zip(TIME_STEPS) {
                        let [by_position, by_velocity] = &found.ours;
                        let ours = by_position * (h * h) + by_velocity * h;
                        let error = (&fit.matrix.value - &ours).abs();
                        assert!(error.component_div(&fit.matrix.bound).max() < 1.0);
                        let width = CLEAR * fit.matrix.bound.amax() / ours.amax();
                        assert!(width < 1e-5, "{} {}: {width:e}", part.force, part.name);
                    }
                }
            }
        }
    }
}
