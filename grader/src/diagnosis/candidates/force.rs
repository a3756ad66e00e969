//! Candidates: a force with another factor, parameter or formula, or with missing elements.

use nalgebra::{DMatrix, DVector};
use simulator::scene::ForceElement;

use super::{Culprit, Prepared, Trial, Vectors, exactly, factor, norm};
use crate::diagnosis::formulas::{self, FORCES};
use crate::diagnosis::physics::{Method, Term};

impl Trial<'_> {
    /// A term with another factor: everywhere, in its force only, or in its Jacobians only.
    pub(super) fn factors(&mut self, number: usize) {
        let Term { name, tag, .. } = self.terms[number].clone();
        let h = self.physics.h;
        let force = Culprit::Force(tag);
        let whole = self.each(|step| self.effective(&step.terms[number], &step.delta));
        self.try_factor(&whole, force, |c| factor(&name, c, h));
        if self.physics.method != Method::Linearized {
            return;
        }
        let alone = self.each(|step| &step.terms[number].force * h);
        self.try_factor(&alone, force, |c| {
            factor(&format!("{name}, in the force but not in its Jacobians,"), c, h)
        });
        let jacobian = Culprit::Jacobian(tag);
        let matrices = |kind: usize, change: &dyn Fn(&DMatrix<f64>) -> DMatrix<f64>| {
            self.each(|step| match &step.terms[number].jacobians {
                Some((k, _)) if kind == 0 => (change(k) * &step.delta) * (h * h),
                Some((_, b)) => (change(b) * &step.delta) * h,
                None => DVector::zeros(step.delta.len()),
            })
        };
        let dimension = self.physics.dimension;
        let direct = |matrix: &DMatrix<f64>, is_wanted: bool| {
            DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |row, column| {
                let is_direct = row / dimension == column / dimension;
                if is_direct == is_wanted { matrix[(row, column)] } else { 0.0 }
            })
        };
        let mut directions = Vec::new();
        let mut outright = Vec::new();
        for (kind, what) in ["dF/dx", "dF/dv"].into_iter().enumerate() {
            directions.push((format!("{what} of {name}"), matrices(kind, &|m| m.clone())));
            let cross = matrices(kind, &|m| direct(m, false));
            directions.push((format!("{what} of {name}, between two particles,"), cross));
            let own = matrices(kind, &|m| direct(m, true));
            directions.push((format!("{what} of {name}, of a particle by itself,"), own));
            let transposed = matrices(kind, &|m| m.transpose() - m);
            outright.push((format!("{what} of {name} is transposed"), transposed));
        }
        let both = self.each(|step| {
            self.effective(&step.terms[number], &step.delta) - &step.terms[number].force * h
        });
        directions.push((format!("{name}, in its Jacobians but not in the force,"), both));
        for (what, g) in directions {
            self.try_factor(&g, jacobian, |c| factor(&what, c, h));
        }
        for (words, g) in outright {
            if norm(&g) > 0.0 {
                let rest: Vectors =
                    self.prepared.iter().zip(&g).map(|(step, g)| &step.residual - g).collect();
                self.try_rest(&rest, jacobian, words);
            }
        }
    }

    /// A parameter that is always 0 or 1, whatever the scene says.
    pub(super) fn parameters(&mut self, number: usize) {
        let Term { name, tag, elements } = self.terms[number].clone();
        let Some(schema) = elements.first().map(|element| element.schema) else { return };
        for parameter in schema.parameters {
            for value in [0.0, 1.0] {
                let mut changed = elements.clone();
                let is_part = |element: &ForceElement| element.parameter(parameter.name) != 0.0;
                if !changed.iter().any(is_part) {
                    continue;
                }
                for element in &mut changed {
                    *element.parameter_mut(parameter.name) = value;
                }
                let words = format!("{name} uses {} = {value}", parameter.name);
                let culprit = Culprit::Force(tag);
                let force = |step: &Prepared| self.physics.force(&changed, &step.at);
                let h = self.physics.h;
                let rest = self
                    .each(|step| &step.residual - (force(step) - &step.terms[number].force) * h);
                self.try_rest(&rest, culprit, words.clone());
                if self.physics.method == Method::Linearized {
                    let rest = self.each(|step| {
                        let other = self.effective(&self.parts(&changed, &step.at), &step.delta);
                        &step.residual - other + self.effective(&step.terms[number], &step.delta)
                    });
                    self.try_rest(&rest, culprit, words);
                }
            }
        }
    }

    /// A force of another form: with masses, with lengths, on one of two particles, along one axis.
    pub(super) fn shapes(&mut self, number: usize) {
        let Term { name, tag, elements } = self.terms[number].clone();
        let culprit = Culprit::Force(tag);
        let (physics, dimension) = (self.physics, self.physics.dimension);
        self.try_instead(number, culprit, &format!("{name} is multiplied by the mass"), |step| {
            physics.momentum(&step.terms[number].force)
        });
        self.try_instead(number, culprit, &format!("{name} is divided by the mass"), |step| {
            let force = &step.terms[number].force;
            DVector::from_fn(force.len(), |dof, _| force[dof] / physics.mass[dof])
        });
        if physics.method == Method::Linearized {
            let words = format!("{name} and its Jacobians are multiplied by the mass");
            let rest = self.each(|step| {
                let whole = self.effective(&step.terms[number], &step.delta);
                &step.residual - physics.momentum(&whole) + whole
            });
            self.try_rest(&rest, culprit, words);
        }
        for axis in 0..dimension {
            let g = self.each(|step| {
                let force = &step.terms[number].force;
                DVector::from_fn(force.len(), |dof, _| {
                    if dof % dimension == axis { physics.h * force[dof] } else { 0.0 }
                })
            });
            let along = ["x", "y", "z"][axis];
            self.try_factor(&g, culprit, |c| exactly(&format!("{name} along {along}"), c));
        }
        if elements.iter().all(|element| element.pair.is_none()) {
            let words = format!("{name} acts on the first particle only");
            self.try_instead(number, culprit, &words, |step| {
                let force = &step.terms[number].force;
                DVector::from_fn(
                    force.len(),
                    |dof, _| if dof < dimension { force[dof] } else { 0.0 },
                )
            });
            let words = format!("{name} has x and y swapped");
            self.try_instead(number, culprit, &words, |step| {
                let force = &step.terms[number].force;
                DVector::from_fn(force.len(), |dof, _| match dof % dimension {
                    0 => force[dof + 1],
                    1 => force[dof - 1],
                    _ => force[dof],
                })
            });
            return;
        }
        for (power, words) in [
            (1, "multiplied by the length (a direction is not normalised)"),
            (2, "multiplied by the length squared"),
            (-1, "divided by the length"),
            (-2, "divided by the length squared"),
        ] {
            let words = format!("{name} is {words}");
            self.try_instead(number, culprit, &words, |step| {
                let of = |element: &ForceElement| {
                    let one = physics.force(std::slice::from_ref(element), &step.at);
                    let [i, j] = element.pair.unwrap_or_default();
                    let x = &step.at.x;
                    let square =
                        |axis: usize| (x[i * dimension + axis] - x[j * dimension + axis]).powi(2);
                    one * (0..dimension).map(square).sum::<f64>().sqrt().powi(power)
                };
                elements.iter().map(of).sum()
            });
        }
        for (side, words) in
            [(1, "on the second of two particles"), (0, "on the first of two particles")]
        {
            let g = self.each(|step| {
                let mut sum = DVector::zeros(step.delta.len());
                for element in &elements {
                    let one = physics.force(std::slice::from_ref(element), &step.at);
                    let particle = element.pair.unwrap_or_default()[side];
                    let place = particle * dimension;
                    let mut part = sum.rows_mut(place, dimension);
                    part += one.rows(place, dimension) * physics.h;
                }
                sum
            });
            self.try_factor(&g, culprit, |c| exactly(&format!("{name} {words}"), c));
        }
    }

    /// A wrong formula in the place of the right one.
    pub(super) fn formulas(&mut self, number: usize) {
        let Term { name, tag, elements } = self.terms[number].clone();
        let (physics, dimension) = (self.physics, self.physics.dimension);
        if tag == "dragdamping" {
            let words = format!("{name} grows as the square of the speed");
            self.try_instead(number, Culprit::Force(tag), &words, |step| {
                let force = &step.terms[number].force;
                let square = |dof: usize| {
                    let first = dof - dof % dimension;
                    (first..first + dimension).map(|dof| step.at.v[dof].powi(2)).sum::<f64>()
                };
                DVector::from_fn(force.len(), |dof, _| force[dof] * square(dof).sqrt())
            });
        }
        for wrong in FORCES.iter().filter(|wrong| formulas::is_of(wrong.term, &name)) {
            let words = format!("{name} {}", wrong.words);
            self.try_instead(number, Culprit::Force(tag), &words, |step| {
                let mut sum = DVector::zeros(step.delta.len());
                for element in &elements {
                    let [i, j] = element.pair.unwrap_or_default();
                    let force = (wrong.on_i)(&physics.pair(element, &step.at));
                    for axis in 0..dimension {
                        sum[i * dimension + axis] += force[axis];
                        sum[j * dimension + axis] -= force[axis];
                    }
                }
                sum
            });
        }
    }

    /// Some of a term's elements only.
    pub(super) fn elements(&mut self, number: usize) {
        const MOST: usize = 40;
        let Term { name, tag, elements } = self.terms[number].clone();
        if elements.len() < 2 || elements.len() > MOST {
            return;
        }
        let culprit = Culprit::Force(tag);
        let physics = self.physics;
        let last = elements.len() - 1;
        let words = format!("only the last of several elements of {name} has an effect");
        let rest = self.each(|step| {
            let others = self.effective(&self.parts(&elements[..last], &step.at), &step.delta);
            &step.residual + others
        });
        self.try_rest(&rest, culprit, words);
        for (place, element) in elements.iter().enumerate() {
            let which = match element.pair {
                Some([i, j]) => format!("{name} between particles {i} and {j}"),
                None => format!("element {} of {name}", place + 1),
            };
            let g = self
                .each(|step| physics.force(std::slice::from_ref(element), &step.at) * physics.h);
            self.try_factor(&g, culprit, |c| exactly(&which, c));
        }
    }
}
