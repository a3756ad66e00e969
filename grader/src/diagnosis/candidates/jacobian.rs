//! Candidates: Jacobians with another factor or form, or missing ones.

use nalgebra::{DMatrix, DVector};
use simulator::scene::ForceElement;

use super::{Culprit, Parts, Prepared, Trial, Vectors, factor, lengths};
use crate::diagnosis::formulas::{self, JACOBIANS};
use crate::diagnosis::physics::Term;

impl Trial<'_> {
    /// Wrong formulas for a term's Jacobians.
    pub(super) fn jacobian_shapes(&mut self, number: usize) {
        let Term { name, elements, .. } = self.terms[number].clone();
        let (physics, dimension) = (self.physics, self.physics.dimension);
        for wrong in JACOBIANS.iter().filter(|wrong| formulas::is_of(wrong.term, &name)) {
            let what = if wrong.by_velocity { "dF/dv" } else { "dF/dx" };
            let words = format!("{what} of {name} {}", wrong.words);
            self.try_jacobian(number, wrong.by_velocity, words, |step, _| {
                let mut matrix = DMatrix::zeros(step.delta.len(), step.delta.len());
                for element in &elements {
                    let block = (wrong.block)(&physics.pair(element, &step.at));
                    let pair = element.pair.unwrap_or_default();
                    for (row, sign_of_row) in pair.into_iter().zip([1.0, -1.0]) {
                        for (column, sign) in pair.into_iter().zip([sign_of_row, -sign_of_row]) {
                            let place = (row * dimension, column * dimension);
                            let mut part = matrix.view_mut(place, (dimension, dimension));
                            part += block.view((0, 0), (dimension, dimension)) * sign;
                        }
                    }
                }
                matrix
            });
        }
        for by_velocity in [false, true] {
            let what = if by_velocity { "dF/dv" } else { "dF/dx" };
            let of =
                |parts: (DMatrix<f64>, DMatrix<f64>)| if by_velocity { parts.1 } else { parts.0 };
            let sum = |step: &Prepared, change: &dyn Fn(&ForceElement, &mut DMatrix<f64>)| {
                let mut matrix = DMatrix::zeros(step.delta.len(), step.delta.len());
                for element in &elements {
                    let mut one = of(physics.jacobians(std::slice::from_ref(element), &step.at));
                    change(element, &mut one);
                    matrix += one;
                }
                matrix
            };
            if elements.iter().all(|element| element.pair.is_some()) {
                for power in [-3, -2, -1, 1, 2, 3] {
                    let words = format!("{what} of {name} is off by the factor {}", lengths(power));
                    self.try_jacobian(number, by_velocity, words, |step, _| {
                        sum(step, &|element, matrix| {
                            *matrix *= physics.pair(element, &step.at).d.norm().powi(power);
                        })
                    });
                }
                let words =
                    format!("{what} of {name} lacks the rows of the second of two particles");
                self.try_jacobian(number, by_velocity, words, |step, _| {
                    sum(step, &|element, matrix| {
                        let [_, j] = element.pair.unwrap_or_default();
                        matrix.rows_mut(j * dimension, dimension).fill(0.0);
                    })
                });
            } else {
                let words = format!("{what} of {name} is multiplied by the mass");
                self.try_jacobian(number, by_velocity, words, |_, matrix| {
                    DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |row, column| {
                        matrix[(row, column)] * physics.mass[row]
                    })
                });
                let words = format!("{what} of {name} has its x components only");
                self.try_jacobian(number, by_velocity, words, |_, matrix| {
                    DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |row, column| {
                        if row % dimension == 0 { matrix[(row, column)] } else { 0.0 }
                    })
                });
            }
            let Some(schema) = elements.first().map(|element| element.schema) else { continue };
            for parameter in schema.parameters {
                for value in [0.0, 1.0] {
                    if elements.iter().all(|element| element.parameter(parameter.name) == 0.0) {
                        continue;
                    }
                    let mut changed = elements.clone();
                    for element in &mut changed {
                        *element.parameter_mut(parameter.name) = value;
                    }
                    let words = format!("{what} of {name} uses {} = {value}", parameter.name);
                    self.try_jacobian(number, by_velocity, words, |step, _| {
                        of(physics.jacobians(&changed, &step.at))
                    });
                }
            }
        }
    }

    /// The Jacobians of all forces together, in the matrix of a linearized step.
    pub(super) fn jacobians_of_all(&mut self) {
        let h = self.physics.h;
        let total = |kind: usize| {
            self.each(|step| {
                let of = |parts: &Parts| match &parts.jacobians {
                    Some((k, _)) if kind == 0 => (k * &step.delta) * (h * h),
                    Some((_, b)) => (b * &step.delta) * h,
                    None => DVector::zeros(step.delta.len()),
                };
                step.terms.iter().map(of).sum::<DVector<f64>>()
            })
        };
        let (by_position, by_velocity) = (total(0), total(1));
        let both: Vectors = by_position.iter().zip(&by_velocity).map(|(k, b)| k + b).collect();
        let all = [
            ("dF/dx in the matrix of the step", by_position),
            ("dF/dv in the matrix of the step", by_velocity),
            ("the sum of the Jacobians in the matrix of the step", both),
        ];
        for (what, g) in all {
            self.try_factor(&g, Culprit::Integrator, |c| factor(what, c, h));
        }
    }

    /// Another matrix in the place of a term's `∂F/∂x` or `∂F/∂v`.
    fn try_jacobian(
        &mut self,
        number: usize,
        by_velocity: bool,
        words: String,
        other: impl Fn(&Prepared, &DMatrix<f64>) -> DMatrix<f64>,
    ) {
        let h = self.physics.h;
        let rest = self.each(|step| {
            let Some((k, b)) = &step.terms[number].jacobians else { return step.residual.clone() };
            let (right, factor) = if by_velocity { (b, h) } else { (k, h * h) };
            &step.residual - (other(step, right) - right) * &step.delta * factor
        });
        self.try_rest(&rest, Culprit::Jacobian(self.terms[number].tag), words);
    }
}
