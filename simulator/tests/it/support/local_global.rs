//! The fast mass-spring assignment in plain dense algebra: the reference for the integrator, without its code.
//!
//! ```text
//! Q = k AᵀA + M/h² + w CᵀC        y = M/h² (2 p^t − p^{t−h}) + f        b = k Aᵀ d + y + w CᵀC p^rest
//! ```

use nalgebra::linalg::Cholesky;
use nalgebra::{DMatrix, Dyn};
use scene::Scene;

/// The assignment's simulation of a scene of undamped springs, with the same force on particles of each mass.
pub(crate) struct Assignment {
    h: f64,
    /// Rounds in a step.
    pub(crate) iterations: usize,
    /// Signed incidence matrix, a spring a row.
    incidence: DMatrix<f64>,
    /// Stiffnesses, on a diagonal.
    stiffness: DMatrix<f64>,
    rest_lengths: Vec<f64>,
    masses: DMatrix<f64>,
    /// `w CᵀC`.
    penalty: DMatrix<f64>,
    factor: Cholesky<f64, Dyn>,
    force: DMatrix<f64>,
    rest: DMatrix<f64>,
    /// `p^t`, a particle a row.
    pub(crate) positions: DMatrix<f64>,
    previous: DMatrix<f64>,
}

impl Assignment {
    /// The scene's springs, gravity and constant forces; its fixed particles are pinned where they are.
    pub(crate) fn new(scene: &Scene, iterations: usize, pin_weight: f64) -> Self {
        let (n, h, axes) = (scene.particles.len(), scene.time_step, scene.dimension.count());
        let springs: Vec<_> =
            scene.forces.iter().filter(|force| force.schema.tag == "springforce").collect();
        let mut incidence = DMatrix::zeros(springs.len(), n);
        for (row, spring) in springs.iter().enumerate() {
            let [i, j] = spring.pair().unwrap();
            incidence[(row, i)] = 1.0;
            incidence[(row, j)] = -1.0;
        }
        let diagonal = |values: Vec<f64>| DMatrix::from_diagonal(&values.into());
        let stiffness = diagonal(springs.iter().map(|spring| spring.parameters[0]).collect());
        let masses = diagonal(scene.particles.iter().map(|particle| particle.mass).collect());
        let pinned = |fixed| if fixed { pin_weight } else { 0.0 };
        let penalty =
            diagonal(scene.particles.iter().map(|particle| pinned(particle.fixed)).collect());
        let q = incidence.transpose() * &stiffness * &incidence + &masses / (h * h) + &penalty;
        let mut force = DMatrix::zeros(n, axes);
        for element in &scene.forces {
            for (i, axis) in (0..n).flat_map(|i| (0..axes).map(move |axis| (i, axis))) {
                force[(i, axis)] += match element.schema.tag {
                    "simplegravity" => scene.particles[i].mass * element.parameters[axis],
                    "constantforce" => element.parameters[axis],
                    _ => 0.0,
                };
            }
        }
        let rest = DMatrix::from_fn(n, axes, |i, axis| scene.particles[i].position[axis]);
        let moved = DMatrix::from_fn(n, axes, |i, axis| h * scene.particles[i].velocity[axis]);
        Self {
            h,
            iterations,
            incidence,
            stiffness,
            rest_lengths: springs.iter().map(|spring| spring.parameters[1]).collect(),
            masses,
            penalty,
            factor: q.cholesky().expect("the matrix is positive definite"),
            force,
            previous: &rest - moved,
            positions: rest.clone(),
            rest,
        }
    }

    /// One time step.
    pub(crate) fn step(&mut self) {
        let y = self.right();
        let mut p = self.positions.clone();
        for _ in 0..self.iterations {
            let mut d = &self.incidence * &p;
            for (mut row, rest_length) in d.row_iter_mut().zip(&self.rest_lengths) {
                let length = row.norm();
                row.scale_mut(if *rest_length == 0.0 { 0.0 } else { rest_length / length });
            }
            p = self.factor.solve(&(self.incidence.transpose() * &self.stiffness * d + &y));
        }
        self.previous = std::mem::replace(&mut self.positions, p);
    }

    /// `E` of the step that starts here, at positions of `n·D` numbers; up to a constant.
    pub(crate) fn energy(&self, positions: &[f64]) -> f64 {
        let (n, axes) = self.positions.shape();
        let p = DMatrix::from_row_slice(n, axes, positions);
        let inertial = 2.0 * &self.positions - &self.previous;
        let off = &p - inertial;
        let kinetic = (off.transpose() * &self.masses * &off).trace() / (2.0 * self.h * self.h);
        let held = &p - &self.rest;
        let pins = 0.5 * (held.transpose() * &self.penalty * &held).trace();
        let lengths = &self.incidence * &p;
        let springs = lengths.row_iter().zip(&self.rest_lengths).enumerate();
        let elastic = springs.map(|(row, (d, rest_length))| {
            0.5 * self.stiffness[(row, row)] * (d.norm() - rest_length).powi(2)
        });
        kinetic + pins + elastic.sum::<f64>() - p.dot(&self.force)
    }

    /// Positions as `n·D` numbers, particle-major.
    pub(crate) fn flat(&self) -> Vec<f64> {
        self.positions.transpose().as_slice().to_vec()
    }

    fn right(&self) -> DMatrix<f64> {
        let inertial = 2.0 * &self.positions - &self.previous;
        &self.masses / (self.h * self.h) * inertial + &self.force + &self.penalty * &self.rest
    }
}
