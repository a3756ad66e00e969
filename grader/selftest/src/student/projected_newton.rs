//! Projected Newton, as in the lecture's code.
//!
//! ```text
//! E(x) = ½ ‖x − x̃‖²_M + h² P(x)        x̃ = q + h v;  with drag, P has h b/2 |(x − q)/h|² as well
//! x ← q;  p = −H⁻¹ ∇E(x)               H: the Hessian, that of each spring projected
//! while ‖p‖/h > tolerance or fewer than min_iterations:  α ← 1, halved while E(x + α p) > E(x);  x ← x + α p;  p again
//! q' = x,  v' = (x − q)/h
//! ```
//!
//! Near the minimum, `E` falls by less than its rounding error, and the lecture's search need not end: there the whole
//! step is taken. Where a search becomes shorter than [`SHORTEST`] or a step takes more than [`MAX_ITERATIONS`], the program
//! gives up: the state is NaN from there on.
//! Source: lecture on elastodynamics, algorithms 2 and 3, `time_integrator.py`, `utils.py`.

use nalgebra::{DMatrix, DVector, Matrix4};

use super::{Blocks, Coefficient, Parameters, Plane, Vec2};

/// The forces whose energies the student has.
pub(super) const ENERGIES: [&str; 5] =
    ["springforce", "greenspringforce", "simplegravity", "constantforce", "dragdamping"];

/// Maximum number of iterations of a step: twice those of the hardest scene.
const MAX_ITERATIONS: usize = 100;

/// The shortest part of a step that the line search tries.
const SHORTEST: f64 = 1e-9;

/// Relative rounding error of `E`.
const ROUNDING: f64 = 1e-12;

/// The formulas and rules of the method.
#[derive(Clone, Copy)]
pub(crate) struct ProjectedNewton {
    /// Of inertia and elasticity in `E`, in its gradient and in its Hessian; the quantity is the mass.
    pub(crate) terms: [[Coefficient; 2]; 3],
    /// `x̃`: `(q, v, h)`.
    pub(crate) ahead: fn(Vec2, Vec2, f64) -> Vec2,
    /// The first iterate: `(q, v, h)`.
    pub(crate) first: fn(Vec2, Vec2, f64) -> Vec2,
    /// Projection of a pair's Hessian.
    pub(crate) project: fn(Blocks) -> Blocks,
    /// Whether steps are searched along.
    pub(crate) searches: bool,
    /// Measure of a step, held against the tolerance: `(p, h, norm)`, with the norm that the scene names.
    pub(crate) measure: fn(&DVector<f64>, f64, &str) -> f64,
    /// Whether the step that is below the tolerance is taken.
    pub(crate) takes_last: bool,
    /// Iterations after which the step ends, whatever its measure.
    pub(crate) iterations: usize,
    /// The new velocity: `(q, x, v, h)`.
    pub(crate) velocity: fn(Vec2, Vec2, Vec2, f64) -> Vec2,
}

impl ProjectedNewton {
    pub(super) fn faultless() -> Self {
        Self {
            terms: [[Coefficient::new(1, 0), Coefficient::new(0, 2)]; 3],
            ahead: |q, v, h| q + h * v,
            first: |q, _, _| q,
            project: make_definite,
            searches: true,
            measure: |p, h, norm| {
                let norm = if norm == "row-sum" { largest_row(p) } else { largest(p) };
                norm / h
            },
            takes_last: false,
            iterations: usize::MAX,
            velocity: |q, x, _, h| (x - q) / h,
        }
    }
}

/// The largest sum of a particle's magnitudes, `norm(p, inf)` of a row per particle; a NaN if there is one.
pub(crate) fn largest_row(p: &DVector<f64>) -> f64 {
    let rows = p.len() / 2;
    largest(&DVector::from_fn(rows, |row, _| p[2 * row].abs() + p[2 * row + 1].abs()))
}

/// The largest entry; a NaN if there is one.
pub(crate) fn largest(p: &DVector<f64>) -> f64 {
    p.iter().fold(0.0, |most: f64, entry| if entry.abs() <= most { most } else { entry.abs() })
}

/// `make_PD`: negative eigenvalues of the four blocks together become zero.
fn make_definite(blocks: Blocks) -> Blocks {
    let whole = Matrix4::from_fn(|row, column| blocks[row / 2][column / 2][(row % 2, column % 2)]);
    if whole.iter().any(|entry| !entry.is_finite()) {
        return blocks;
    }
    let mut eigen = whole.symmetric_eigen();
    eigen.eigenvalues.iter_mut().for_each(|value| *value = value.max(0.0));
    let projected = eigen.recompose();
    let block =
        |row: usize, column: usize| projected.fixed_view::<2, 2>(2 * row, 2 * column).into();
    [[block(0, 0), block(0, 1)], [block(1, 0), block(1, 1)]]
}

fn negated(blocks: Blocks) -> Blocks {
    blocks.map(|row| row.map(|block| -block))
}

/// A sum with the sum of its terms' sizes.
#[derive(Default)]
struct Sum {
    value: f64,
    size: f64,
}

impl Sum {
    fn add(&mut self, term: f64) {
        self.value += term;
        self.size += term.abs();
    }
}

impl Plane {
    pub(super) fn projected_newton_step(&mut self, rules: ProjectedNewton) {
        let h = self.scene.time_step;
        let options = &self.scene.integrator_options;
        let (tolerance, norm) = (options.number("tolerance"), options.choice("norm"));
        let least = options.count("min_iterations") as usize;
        let of_each = |rule: fn(Vec2, Vec2, f64) -> Vec2| -> Vec<Vec2> {
            self.q.iter().zip(&self.v).map(|(q, v)| rule(*q, *v, h)).collect()
        };
        let (ahead, mut x) = (of_each(rules.ahead), of_each(rules.first));
        for (i, _) in self.scene.particles.iter().enumerate().filter(|(_, p)| p.fixed) {
            x[i] = (self.student.fixed.position)(self.q[i], self.q[i] + h * self.v[i]);
        }
        for iteration in 0.. {
            let gradient = self.gradient(rules, &x, &ahead);
            let p = self.newton_step(rules, &x, &gradient);
            let is_last = iteration >= least && (rules.measure)(&p, h, norm) <= tolerance;
            if is_last || iteration == rules.iterations {
                if is_last && rules.takes_last {
                    x = moved(&x, 1.0, &p);
                }
                break;
            }
            let alpha = match rules.searches {
                _ if iteration == MAX_ITERATIONS => f64::NAN,
                true => self.search(rules, &x, &ahead, &p, &gradient),
                false => 1.0,
            };
            x = moved(&x, alpha, &p);
            if x.iter().any(|x| !x.x.is_finite()) {
                break;
            }
        }
        let fall = h * self.gravity();
        for (i, particle) in self.scene.particles.iter().enumerate() {
            self.v[i] = if particle.fixed {
                (self.student.fixed.velocity)(self.v[i], fall)
            } else {
                (rules.velocity)(self.q[i], x[i], self.v[i], h)
            };
        }
        self.q = x;
    }

    /// `α`: 1, halved until `E` does not increase, or NaN if it becomes too short.
    fn search(
        &self,
        rules: ProjectedNewton,
        x: &[Vec2],
        ahead: &[Vec2],
        p: &DVector<f64>,
        gradient: &DVector<f64>,
    ) -> f64 {
        let start = self.energy(rules, x, ahead);
        if p.dot(gradient).abs() <= ROUNDING * start.size {
            return 1.0;
        }
        let mut alpha = 1.0;
        while self.energy(rules, &moved(x, alpha, p), ahead).value > start.value {
            alpha /= 2.0;
            if alpha < SHORTEST {
                return f64::NAN;
            }
        }
        alpha
    }

    /// `E`.
    fn energy(&self, rules: ProjectedNewton, x: &[Vec2], ahead: &[Vec2]) -> Sum {
        let h = self.scene.time_step;
        let [inertia, elasticity] = rules.terms[0];
        let mut sum = Sum::default();
        for (i, particle) in self.scene.particles.iter().enumerate().filter(|(_, p)| !p.fixed) {
            let distance = x[i] - ahead[i];
            sum.add(0.5 * inertia.value(particle.mass, h) * distance.norm_squared());
        }
        let potential = self.potential(x);
        let weight = elasticity.value(1.0, h);
        Sum {
            value: sum.value + weight * potential.value,
            size: sum.size + weight * potential.size,
        }
    }

    /// `P`.
    fn potential(&self, x: &[Vec2]) -> Sum {
        let u = self.velocities_to(x);
        let mut sum = Sum::default();
        for element in &self.scene.forces {
            let (p, ij) = (&Parameters(element.clone()), element.pair().unwrap_or_default());
            let pair = || self.pair(ij, x, &u);
            let free = self.scene.particles.iter().enumerate().filter(|(_, p)| !p.fixed);
            match element.schema.tag {
                "springforce" => sum.add(0.5 * p["k"] * (pair().l() - p["l0"]).powi(2)),
                "greenspringforce" => sum.add((self.student.green_energy)(&pair(), p)),
                "simplegravity" => free.for_each(|(i, particle)| {
                    sum.add(-particle.mass * Vec2::new(p["fx"], p["fy"]).dot(&x[i]));
                }),
                "constantforce" => {
                    free.for_each(|(i, _)| sum.add(-Vec2::new(p["fx"], p["fy"]).dot(&x[i])));
                }
                "dragdamping" => free.for_each(|(i, _)| {
                    sum.add(self.scene.time_step * 0.5 * p["b"] * u[i].norm_squared());
                }),
                tag => unreachable!("the student knows no energy of {tag}"),
            }
        }
        sum
    }

    /// `∇E = M (x − x̃) − h² F`.
    fn gradient(&self, rules: ProjectedNewton, x: &[Vec2], ahead: &[Vec2]) -> DVector<f64> {
        let h = self.scene.time_step;
        let [inertia, elasticity] = rules.terms[1];
        let force = self.force(x, &self.velocities_to(x));
        DVector::from_fn(2 * x.len(), |dof, _| {
            let (i, axis) = (dof / 2, dof % 2);
            let mass = self.scene.particles[i].mass;
            inertia.value(mass, h) * (x[i] - ahead[i])[axis]
                - elasticity.value(mass, h) * force[i][axis]
        })
    }

    /// `−H⁻¹ ∇E` with `H = M − h² (∂F/∂x + ∂F/∂v / h)`.
    fn newton_step(
        &self,
        rules: ProjectedNewton,
        x: &[Vec2],
        gradient: &DVector<f64>,
    ) -> DVector<f64> {
        let h = self.scene.time_step;
        let [inertia, elasticity] = rules.terms[2];
        // The blocks are of forces: negated, of the energy.
        let projected = |blocks| negated((rules.project)(negated(blocks)));
        let (dx, dv) = self.jacobians(x, &self.velocities_to(x), projected);
        let mut hessian = (dx + dv / h) * -elasticity.value(1.0, h);
        for (i, particle) in self.scene.particles.iter().enumerate() {
            for dof in [2 * i, 2 * i + 1] {
                hessian[(dof, dof)] += inertia.value(particle.mass, h);
            }
        }
        let mut right = -gradient;
        for (i, particle) in self.scene.particles.iter().enumerate().filter(|(_, p)| p.fixed) {
            (self.student.fixed.hold)(&mut hessian, &mut right, i, particle.mass);
        }
        let nonsense = || DVector::repeat(right.len(), f64::NAN);
        DMatrix::lu(hessian).solve(&right).unwrap_or_else(nonsense)
    }

    /// `(x − q)/h`.
    fn velocities_to(&self, x: &[Vec2]) -> Vec<Vec2> {
        let h = self.scene.time_step;
        x.iter().zip(&self.q).map(|(x, q)| (x - q) / h).collect()
    }
}

/// `x + α p`.
fn moved(x: &[Vec2], alpha: f64, p: &DVector<f64>) -> Vec<Vec2> {
    let step = |(i, x): (usize, &Vec2)| x + alpha * p.fixed_rows::<2>(2 * i);
    x.iter().enumerate().map(step).collect()
}
