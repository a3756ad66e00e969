//! What may be wrong with the velocities of a step.
//!
//! With the effective momentum of a term `T`,
//!
//! ```text
//! E = h F                            explicit, symplectic and implicit Euler
//! E = h F + (h² K + h B)(v' − v)     linearized implicit Euler
//! r = Σ E of what the program adds, less Σ E of what it leaves out
//! ```
//!
//! a term with another factor shows as `r = c E`, with one `c` for all coordinates of all steps looked at; other
//! candidates say what `r` is outright. Either leaves a remainder.

use nalgebra::{DMatrix, DVector};
use simulator::scene::ForceElement;

use super::formulas::{self, FORCES, JACOBIANS};
use super::physics::{Method, Physics, Point, Term};
use super::steps::Sample;

/// Where the mistake would be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Culprit {
    /// A force, by its tag.
    Force(&'static str),
    /// Jacobians of a force, by its tag.
    Jacobian(&'static str),
    /// The integrator.
    Integrator,
    /// How fixed particles are held.
    Fixed,
    /// How numbers are written.
    Output,
}

/// Something that explains a defect.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// What is wrong, in words.
    pub words: String,
    /// Where.
    pub culprit: Culprit,
}

/// A candidate with the norm of what it leaves.
pub(super) struct Tried {
    pub(super) candidate: Candidate,
    pub(super) rest: f64,
    /// Whether it says what is wrong; if not, it is a factor that nobody would write.
    pub(super) named: bool,
}

/// What a factor is, in words, and whether somebody would write it.
type Factor = Option<(String, bool)>;

/// What is known of a step before candidates are tried.
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

/// Candidates for the momentum of some steps.
pub(super) struct Trial<'a> {
    physics: &'a Physics<'a>,
    samples: &'a [Sample],
    terms: Vec<Term>,
    prepared: Vec<Prepared>,
    tried: Vec<Tried>,
}

/// A vector for each step.
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

    /// A vector for each step, zero where a particle is fixed.
    fn each(&self, of: impl Fn(&Prepared) -> DVector<f64>) -> Vectors {
        self.prepared.iter().map(|step| self.physics.free(of(step))).collect()
    }

    /// `r = c g` with the best `c`.
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

    /// `r` is what `of` says, less nothing.
    fn try_rest(&mut self, rest: &Vectors, culprit: Culprit, words: String) {
        let candidate = Candidate { words, culprit };
        self.tried.push(Tried { candidate, rest: norm(rest), named: true });
    }

    /// Another force, and perhaps other Jacobians, in the place of a term's.
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

    /// Tries all; the simplest first.
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

    /// A term with another factor: as a whole, its force alone, its Jacobians alone.
    fn factors(&mut self, number: usize) {
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

    /// What may be wrong with the method.
    fn integrator(&mut self) {
        let (h, method) = (self.physics.h, self.physics.method);
        let culprit = Culprit::Integrator;
        let sum = |step: &Prepared| {
            step.terms.iter().map(|parts| self.effective(parts, &step.delta)).sum::<DVector<f64>>()
        };
        if self.terms.is_empty() {
            return;
        }
        let whole = self.each(sum);
        self.try_factor(&whole, culprit, |c| factor("the sum of all forces", c, h));
        if method == Method::Linearized {
            let alone = self
                .each(|step| step.terms.iter().map(|parts| &parts.force * h).sum::<DVector<f64>>());
            self.try_factor(&alone, culprit, |c| factor("the right-hand side", c, h));
        }
        self.forces_of_fixed();
        let physics = self.physics;
        let forces = |step: &Prepared| {
            step.terms.iter().map(|parts| parts.force.clone()).sum::<DVector<f64>>()
        };
        let by_mass = |vector: DVector<f64>| physics.momentum(&vector);
        let massless = self.each(|step| &step.residual - by_mass(step.delta.clone()) + &step.delta);
        self.try_rest(&massless, culprit, "the mass is left out".to_owned());
        let multiplied = self.each(|step| &step.delta - by_mass(forces(step)) * h);
        if method.is_implicit() {
            self.jacobians_of_all();
            self.newton();
        } else {
            self.try_rest(&multiplied, culprit, "forces are multiplied by the mass".to_owned());
        }
        self.places();
    }

    /// Forces between a fixed and a free particle.
    fn forces_of_fixed(&mut self) {
        let scene = self.physics.scene;
        let is_held = |element: &&ForceElement| {
            element.pair.is_some_and(|pair| pair.iter().any(|&each| scene.particles[each].fixed))
        };
        let held: Vec<ForceElement> = scene.forces.iter().filter(is_held).cloned().collect();
        if held.is_empty() {
            return;
        }
        let g = self.each(|step| self.effective(&self.parts(&held, &step.at), &step.delta));
        self.try_factor(&g, Culprit::Fixed, |c| {
            exactly("the force between a fixed and a free particle", c)
        });
    }

    /// The Jacobians of all forces, in the matrix of a linearized step.
    fn jacobians_of_all(&mut self) {
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

    /// Newton's method ended early.
    fn newton(&mut self) {
        const MOST: usize = 4;
        if self.physics.method != Method::Implicit {
            return;
        }
        let all: Vec<Vec<Vec<f64>>> =
            self.samples.iter().map(|sample| self.physics.newton(sample, MOST)).collect();
        for made in 1..=MOST {
            let rest: Option<Vectors> = self
                .samples
                .iter()
                .zip(&all)
                .map(|(sample, iterates)| {
                    let iterate = DVector::from_vec(iterates.get(made - 1)?.clone());
                    let new = DVector::from_vec(sample.after.velocities.clone());
                    Some(self.physics.free(self.physics.momentum(&(new - iterate))))
                })
                .collect();
            if let Some(rest) = rest {
                let times = if made == 1 { "iteration" } else { "iterations" };
                let words = format!("Newton's method ends after {made} {times}");
                self.try_rest(&rest, Culprit::Integrator, words);
            }
        }
    }

    /// Forces evaluated elsewhere.
    fn places(&mut self) {
        let physics = self.physics;
        let h = physics.h;
        let elements = &physics.scene.forces;
        let momentum = |step: &Prepared| physics.momentum(&step.delta);
        let time = |sample: &Sample| sample.step as f64 * h;
        let old = |sample: &Sample, time: f64| Point {
            x: sample.before.positions.clone(),
            v: sample.before.velocities.clone(),
            time,
        };
        let mut found: Vec<(&str, Culprit, Vectors)> = Vec::new();
        let mut add = |words, culprit, of: &dyn Fn(&Sample, &Prepared) -> DVector<f64>| {
            let steps = self.samples.iter().zip(&self.prepared);
            let rest = steps.map(|(sample, step)| physics.free(of(sample, step))).collect();
            found.push((words, culprit, rest));
        };
        let integrator = Culprit::Integrator;
        match physics.method {
            Method::Explicit | Method::Symplectic => {
                add("forces are evaluated at q + h v", integrator, &|sample, step| {
                    let mut at = old(sample, time(sample));
                    at.x = physics.along(&at.x, &at.v);
                    momentum(step) - physics.force(elements, &at) * h
                });
            }
            Method::Linearized => {
                let with = |force: &Point, jacobians: &Point, step: &Prepared| {
                    let (k, b) = physics.jacobians(elements, jacobians);
                    let matrix = (k * &step.delta) * (h * h) + (b * &step.delta) * h;
                    momentum(step) - physics.force(elements, force) * h - matrix
                };
                add(
                    "forces and Jacobians are evaluated at q, not q + h v",
                    integrator,
                    &|sample, step| {
                        let at = old(sample, time(sample) + h);
                        with(&at, &at, step)
                    },
                );
                add("forces are evaluated at q, not q + h v", integrator, &|sample, step| {
                    with(&old(sample, time(sample) + h), &step.at, step)
                });
                add("Jacobians are evaluated at q, not q + h v", integrator, &|sample, step| {
                    with(&step.at, &old(sample, time(sample) + h), step)
                });
            }
            Method::Implicit => {
                add("forces are evaluated at q, not q + h v'", integrator, &|sample, step| {
                    let mut at = old(sample, time(sample) + h);
                    at.v.clone_from(&sample.after.velocities);
                    momentum(step) - physics.force(elements, &at) * h
                });
            }
        }
        if physics.method.is_implicit() && physics.fixed.contains(&true) {
            let words = "fixed particles are taken where they were, not where they will be";
            add(words, Culprit::Fixed, &|sample, step| {
                let mut at =
                    Point { x: step.at.x.clone(), v: step.at.v.clone(), time: step.at.time };
                for (dof, x) in at.x.iter_mut().enumerate().filter(|(dof, _)| physics.fixed[*dof]) {
                    *x = sample.before.positions[dof];
                }
                let force = momentum(step) - physics.force(elements, &at) * h;
                if physics.method == Method::Implicit {
                    return force;
                }
                let (k, b) = physics.jacobians(elements, &at);
                force - (k * &step.delta) * (h * h) - (b * &step.delta) * h
            });
        }
        for (words, culprit, rest) in found {
            self.try_rest(&rest, culprit, words.to_owned());
        }
    }

    /// A parameter that is 0 or 1 whatever the scene says.
    fn parameters(&mut self, number: usize) {
        let Term { name, tag, elements } = self.terms[number].clone();
        let Some(schema) = elements.first().map(|element| element.schema) else { return };
        for (place, parameter) in schema.parameters.iter().enumerate() {
            for value in [0.0, 1.0] {
                let mut changed = elements.clone();
                let is_part = |element: &ForceElement| element.parameters[place] != 0.0;
                if !changed.iter().any(is_part) {
                    continue;
                }
                changed.iter_mut().for_each(|element| element.parameters[place] = value);
                let words = format!("{name} is as if {} were {value}", parameter.name);
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

    /// A force of another form: by mass, by length, on one of two particles, along one axis.
    fn shapes(&mut self, number: usize) {
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

    /// Another formula in the place of the right one.
    fn formulas(&mut self, number: usize) {
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

    /// Jacobians of another form, in the place of a term's.
    fn jacobian_shapes(&mut self, number: usize) {
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
            if formulas::has_length(&name) {
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
                let words = format!("{what} of {name} is there along x alone");
                self.try_jacobian(number, by_velocity, words, |_, matrix| {
                    DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |row, column| {
                        if row % dimension == 0 { matrix[(row, column)] } else { 0.0 }
                    })
                });
            }
            let Some(schema) = elements.first().map(|element| element.schema) else { continue };
            for (place, parameter) in schema.parameters.iter().enumerate() {
                for value in [0.0, 1.0] {
                    if elements.iter().all(|element| element.parameters[place] == 0.0) {
                        continue;
                    }
                    let mut changed = elements.clone();
                    changed.iter_mut().for_each(|element| element.parameters[place] = value);
                    let words =
                        format!("{what} of {name} is as if {} were {value}", parameter.name);
                    self.try_jacobian(number, by_velocity, words, |step, _| {
                        of(physics.jacobians(&changed, &step.at))
                    });
                }
            }
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

    /// Some of a term's elements.
    fn elements(&mut self, number: usize) {
        const MOST: usize = 40;
        let Term { name, tag, elements } = self.terms[number].clone();
        if elements.len() < 2 || elements.len() > MOST {
            return;
        }
        let culprit = Culprit::Force(tag);
        let physics = self.physics;
        let last = elements.len() - 1;
        let words = format!("only the last of several elements of {name} counts");
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

fn norm(vectors: &Vectors) -> f64 {
    vectors.iter().map(DVector::norm_squared).sum::<f64>().sqrt()
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-6 * b.abs().max(1.0)
}

/// `what` with the factor `1 + c`; `None` where that is nearly 1.
fn factor(what: &str, c: f64, h: f64) -> Factor {
    let factor = 1.0 + c;
    let words = match factor {
        // What is so close is some other mistake that looks like it.
        f if (f - 1.0).abs() < 1e-4 => return None,
        f if near(f, 0.0) => "is left out".to_owned(),
        f if near(f, -1.0) => "has the wrong sign".to_owned(),
        f if near(f * h, 1.0) => "is not multiplied by h".to_owned(),
        f if near(f * h * h, 1.0) => "is not multiplied by h²".to_owned(),
        f if near(f / h, 1.0) => "is multiplied by h once too often".to_owned(),
        f if is_simple(f) => format!("is multiplied by {}", digits(f)),
        f => return Some((format!("{what} is multiplied by {}", digits(f)), false)),
    };
    Some((format!("{what} {words}"), true))
}

/// Whether it is a fraction of small numbers.
fn is_simple(factor: f64) -> bool {
    (1..=4).any(|denominator| {
        let numerator = factor * f64::from(denominator);
        numerator.abs() < 8.5 && near(numerator, numerator.round())
    })
}

/// The same where the factor is one of few.
fn exactly(what: &str, c: f64) -> Factor {
    [0.0, -1.0, 2.0].into_iter().find(|f| near(1.0 + c, *f))?;
    factor(what, c, f64::INFINITY)
}

/// A power of the length, in words.
fn lengths(power: i32) -> String {
    let digits = ["", "l", "l²", "l³"][power.unsigned_abs() as usize % 4];
    if power < 0 { format!("1/{digits}") } else { digits.to_owned() }
}

/// Six digits, without zeros at the end.
fn digits(value: f64) -> String {
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    rounded.to_string()
}
