//! The matrix that a program's implicit steps use, from the steps alone.
//!
//! A step of linearized implicit Euler from `(x − h v, v)` evaluates everything at `(x, v)`, whatever `h`:
//!
//! ```text
//! (M − A) δ = h F(x, v)      A = h² K + h B,   δ = v' − v
//! M_r δ_r − h F_r = A δ_r    for each combination r of masses, F_r by an explicit step with these masses
//! ```
//!
//! Each row of `A` is a least-squares problem with the same matrix of `δ_r`, solved by one singular value
//! decomposition. There are twice as many equations as unknowns and two more, so that the residual `s` says
//! how exactly the program solves its equations, and the standard error of entry `c` is `s √(ΔᵀΔ)⁻¹_cc`.
//!
//! The unknown is the difference of `A` to what the program's own force says, and directions in which the steps
//! do not move the particles are left out: there `A` stays what it should be. (With a right force and a right
//! Jacobian there are none. A wrong Jacobian may keep the particles on their lines.)
//!
//! Where no matrix leaves a small residual, the step is another than it should be: other masses on the left
//! or another right-hand side ([`MODELS`]) are tried. Where no model helps, the groups are stepped again in two
//! halves: an exact solver takes the same steps beside fewer groups, an iteration that stops early does not,
//! and by how much they differ says what its residual is worth. Cost: three implicit runs and one explicit a
//! state.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::differences::{Estimate, Offer, Sample};
use super::noise::{self, CLEAR, MATRIX};
use super::scenes::{Elements, Group, State, TIME_STEPS, masses, scene};
use crate::verdict::Failure;

/// A relative residual above this is not the rounding of a solver: no program that passes the course's
/// criteria solves so loosely.
pub(super) const UNEXPLAINED: f64 = 1e-4;

/// A relative residual above this is no solver's at all: whatever depends on the other particles then is wrong.
const LOOSEST: f64 = 1e-2;

/// Below this relative residual no other model is tried.
const EXPLAINED: f64 = 1e-9;

/// Singular values below this, relative to the largest, are directions in which nothing moves.
const UNMOVED: f64 = 1e-11;

/// Another model must explain the steps this many times better.
const BETTER: f64 = 1e3;

/// Steps of one state with one time step.
#[derive(Debug, Clone)]
pub(super) struct Experiment {
    pub(super) h: f64,
    /// The force at the state where the step should take it.
    pub(super) twins: Vec<Sample>,
    /// `v' − v` for each combination of masses.
    pub(super) changes: Vec<Vec<f64>>,
    /// The force at the state where the step starts, once it was needed.
    at_start: Option<Vec<Sample>>,
    /// The matrix that follows from the program's own force.
    own: DMatrix<f64>,
}

/// A matrix that explains steps.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    pub(super) matrix: Estimate,
    /// What it is more than the matrix that follows from the program's own force.
    pub(super) excess: DMatrix<f64>,
    /// Largest residual, relative to the largest term of the equations.
    pub(super) residual: f64,
    /// Projects on the directions in which the steps move the particles.
    pub(super) moved: DMatrix<f64>,
    /// Whether that is less than all of them.
    pub(super) is_partial: bool,
}

/// What a step is taken to be: `(L − A) δ = c W F`.
pub(super) struct Model {
    /// What is different from what it should be.
    pub(super) difference: &'static str,
    /// `L` of a mass.
    left: fn(f64) -> f64,
    /// `c W` of time step and mass.
    right: fn(f64, f64) -> f64,
    /// Whether the force is taken where the step starts.
    at_start: bool,
}

/// The right step, and ways to get it wrong.
pub(super) static MODELS: [Model; 9] = [
    Model { difference: "", left: |m| m, right: |h, _| h, at_start: false },
    Model {
        difference: "the right-hand side takes the force at q, not at q + h v",
        left: |m| m,
        right: |h, _| h,
        at_start: true,
    },
    Model {
        difference: "the left-hand side has the identity in place of the mass matrix",
        left: |_| 1.0,
        right: |h, _| h,
        at_start: false,
    },
    Model {
        difference: "the right-hand side lacks its h",
        left: |m| m,
        right: |_, _| 1.0,
        at_start: false,
    },
    Model {
        difference: "the right-hand side has h² in place of h",
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
        difference: "the Jacobians are not divided by the masses, as everything else is",
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

/// Steps with `elements` from `states`, and the model that explains them.
pub(super) struct Steps {
    /// By state, then by time step.
    pub(super) experiments: Vec<Vec<Experiment>>,
    pub(super) fits: Vec<Vec<Fit>>,
    pub(super) model: &'static Model,
    /// The largest relative residual of all fits.
    pub(super) residual: f64,
    /// The same for the right model.
    pub(super) residual_of_right: f64,
    /// How far steps differ, relative to the same, when the groups are stepped in two halves; measured where
    /// nothing explains them.
    looseness: f64,
}

impl Steps {
    /// Takes the steps and explains them, those of all `variants` by one matrix. `own` are the matrices that
    /// follow from the program's own force, by state and time step.
    ///
    /// # Errors
    /// Where one of the runs fails.
    pub(super) fn take(
        offer: Offer<'_>,
        implicit: &str,
        variants: &[Vec<Elements>],
        states: &[State],
        own: &[Vec<DMatrix<f64>>],
    ) -> Result<Self, Failure> {
        // The force in every variant, one after the other.
        let samples = |state: &State| -> Result<Vec<Sample>, Failure> {
            let mut samples = Vec::new();
            for elements in variants {
                samples.extend(offer.samples(elements, groups(offer, state))?);
            }
            Ok(samples)
        };
        let twins: Result<Vec<_>, Failure> = states.par_iter().map(samples).collect();
        let twins = twins?;
        let pairs: Vec<(usize, usize)> = (0..states.len())
            .flat_map(|state| (0..TIME_STEPS.len()).map(move |step| (state, step)))
            .collect();
        let take = |(state, step): &(usize, usize)| {
            let h = TIME_STEPS[*step];
            let groups = groups(offer, &states[*state].before(h));
            let changes = changes(offer, implicit, variants, &groups, h)?;
            let own = own[*state][*step].clone();
            Ok(Experiment { h, twins: twins[*state].clone(), changes, at_start: None, own })
        };
        let flat: Result<Vec<Experiment>, Failure> = pairs.par_iter().map(take).collect();
        let mut experiments: Vec<Vec<Experiment>> =
            flat?.chunks(TIME_STEPS.len()).map(<[Experiment]>::to_vec).collect();

        let right = &MODELS[0];
        let (mut fits, mut residual) = fit_all(&experiments, right);
        let residual_of_right = residual;
        let mut model = right;
        if residual > EXPLAINED {
            for (experiments, state) in experiments.iter_mut().zip(states) {
                for experiment in experiments {
                    experiment.at_start = Some(samples(&state.before(experiment.h))?);
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
            for (experiments, state) in experiments.iter().zip(states) {
                for experiment in experiments {
                    let found = experiment.looseness(offer, implicit, &variants[0], state)?;
                    looseness = looseness.max(found);
                }
            }
        }
        Ok(Self { experiments, fits, model, residual, residual_of_right, looseness })
    }

    /// Whether the step is what it should be.
    pub(super) fn is_right(&self) -> bool {
        self.model.difference.is_empty() && self.is_explained()
    }

    /// Whether there are directions in which no particle moves.
    pub(super) fn is_partial(&self) -> bool {
        self.fits.iter().flatten().any(|fit| fit.is_partial)
    }

    /// Whether the solver stops so early that its error may be all that is left of the equations.
    pub(super) fn is_loose(&self) -> bool {
        !self.is_explained() && self.residual <= LOOSEST.min(CLEAR * self.looseness)
    }

    /// Whether there is a matrix.
    pub(super) fn is_explained(&self) -> bool {
        self.residual <= UNEXPLAINED
    }
}

/// A state with every combination of masses.
fn groups(offer: Offer<'_>, state: &State) -> Vec<Group> {
    let all = masses(offer.dimension).into_iter();
    all.map(|masses| Group { state: state.clone(), masses }).collect()
}

/// `v' − v` of each group by an implicit step, in every variant, one after the other.
fn changes(
    offer: Offer<'_>,
    implicit: &str,
    variants: &[Vec<Elements>],
    groups: &[Group],
    h: f64,
) -> Result<Vec<Vec<f64>>, Failure> {
    let mut changes = Vec::new();
    for elements in variants {
        let scene = scene(offer.dimension, elements, groups, h, true);
        let after = offer.stepper.step(&scene, implicit)?;
        let after = after.chunks_exact(offer.size()).zip(groups);
        changes.extend(after.map(|(after, group)| -> Vec<f64> {
            after.iter().zip(&group.state.velocities).map(|(after, v)| after - v).collect()
        }));
    }
    Ok(changes)
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

    /// How far the steps of the first variant, `elements`, are off from the same in two halves, relative to the
    /// largest term of the equations.
    fn looseness(
        &self,
        offer: Offer<'_>,
        implicit: &str,
        elements: &[Elements],
        state: &State,
    ) -> Result<f64, Failure> {
        let groups = groups(offer, &state.before(self.h));
        let variant = [elements.to_vec()];
        let mut again = Vec::with_capacity(groups.len());
        for half in groups.chunks(groups.len().div_ceil(2)) {
            again.extend(changes(offer, implicit, &variant, half, self.h)?);
        }
        let mut largest: f64 = 0.0;
        for ((again, change), group) in again.iter().zip(&self.changes).zip(&groups) {
            let heaviest = group.masses.iter().copied().fold(0.0, f64::max);
            let pairs = again.iter().zip(change);
            largest = pairs.map(|(a, b)| heaviest * (a - b).abs()).fold(largest, f64::max);
        }
        let scale = self.terms(&MODELS[0]).iter().map(DMatrix::amax).fold(0.0, f64::max);
        Ok(if scale > 0.0 { largest / scale } else { 0.0 })
    }

    /// How many times its bound a step's equation is off, with these matrices in the place of `A`: one a
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

    /// Rounding of one equation: that of the velocities, times the masses, and that of the forces.
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
        // What the program's own force does not explain.
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
            // An entry that no step shows is as uncertain as the rounding of the others.
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
    use simulator::scene::Dimension;

    use super::super::scenes::{Steps as Kind, parts, states};
    use super::super::stepper::BuiltIn;
    use super::*;

    #[test]
    fn steps_of_the_built_in_simulator_show_its_jacobians() {
        for dimension in [Dimension::Two, Dimension::Three] {
            let offer = Offer {
                stepper: &BuiltIn,
                dimension,
                explicit: "explicit-euler",
                implicit: Some("linearized-implicit-euler"),
            };
            let states = states(dimension);
            for part in parts().iter().filter(|part| part.steps == Kind::Chain) {
                // What is expected must not matter.
                let size = offer.size();
                let nothing =
                    vec![vec![DMatrix::zeros(size, size); TIME_STEPS.len()]; states.len()];
                let method = "linearized-implicit-euler";
                let steps =
                    Steps::take(offer, method, &[vec![part.full]], &states, &nothing).unwrap();
                assert!(steps.is_right() && steps.residual < 1e-13 && !steps.is_partial());
                for (fits, state) in steps.fits.iter().zip(&states) {
                    let found = offer
                        .differences(&[part.full], state, &vec![1.0; dimension.count() + 1])
                        .unwrap();
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
