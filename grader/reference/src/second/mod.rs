//! Second stepper for the course's methods, built like a student's program: dense matrices over all particles.
//!
//! ```text
//! explicit                v' = v + h F/m, q' = q + h v, by the substeps or the stages of the method
//! linearized, implicit    (M − h² K − h B) δ = −M (u − v) + h F          u ← u + δ
//! the same, unreduced     ⎡  I     −h I   ⎤ ⎡δq⎤   ⎡        0         ⎤  q̂ ← q̂ + δq, u ← u + δ
//!                         ⎣−h K   M − h B ⎦ ⎣δ ⎦ = ⎣−M (u − v) + h F ⎦
//! ```
//!
//! with `F`, `K = ∂F/∂x` and `B = ∂F/∂v` at `(q̂, u)`, from `q̂ = q + h v`, `u = v`. Implicit midpoint is the same
//! for half of the step, twice; a method of differences is the same for the rest of a step. The forces are those of
//! [`arithmetic`], the Jacobians are the law's dual numbers; both are independent of the simulator. Cost:
//! `O((n·D)³)` per solve, and one evaluation of the law per column.

use nalgebra::{DMatrix, DVector};
use scene::schema::Convergence;
use scene::trace::State;
use scene::{ForceElement, Scene};

pub mod arithmetic;

use crate::law::Jacobians;
use crate::laws::Laws;
use crate::method::{self, Method, Pair as Embedded, Substep, Tableau};
use arithmetic::{Arithmetic, Pair};

/// Newton's method is given up beyond this many iterations.
const MAX_ITERATIONS: usize = 100;

/// Variant of the stepper.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Style {
    /// Order of evaluation of the forces.
    pub arithmetic: Arithmetic,
    /// Sum forces from the last element to the first.
    pub backwards: bool,
    /// Update velocities by `(h/m) F` instead of `h (F/m)`.
    pub scaled_kick: bool,
    /// Solver of the linear systems.
    pub solver: Solver,
    /// Stopping criterion of Newton's method.
    pub stop: Stop,
}

impl Default for Style {
    fn default() -> Self {
        Self {
            arithmetic: Arithmetic::default(),
            backwards: false,
            scaled_kick: false,
            solver: Solver::PartialLu,
            stop: Stop::AtTolerance,
        }
    }
}

/// Solver of a linear system.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Solver {
    /// LU with row pivoting.
    PartialLu,
    /// LU with complete pivoting.
    FullLu,
    /// Householder's QR.
    Qr,
    /// The inverse times the right-hand side.
    Inverse,
    /// The unreduced system for positions and velocities, by LU with row pivoting: positions are those of the system.
    Unreduced,
    /// LU, with a perturbed solution like that of an iterative solver that stops at a residual of 1e-12.
    Iterative,
}

/// Stopping criterion of Newton's method.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// If the update is below the tolerance.
    AtTolerance,
    /// One iteration later.
    OneMore,
    /// If the update is near rounding error.
    AtRounding,
}

/// Residual of the iterative solver, relative to the right-hand side.
const ITERATIVE: f64 = 1e-12;

/// The second stepper for one scene.
pub struct Second {
    scene: Scene,
    style: Style,
    /// The first step, and those after it.
    methods: [Stepping; 2],
    laws: Laws,
    random: fastrand::Rng,
}

/// The method that is stepped.
#[derive(Clone, Copy)]
enum Stepping {
    Explicit(&'static [Substep]),
    Stages(&'static Tableau),
    /// Stages with an estimate of their error, to a tolerance.
    Controlled(&'static Embedded, f64),
    /// One Newton step.
    Linearized,
    /// Newton's method for a part of the step, until the norm of an update is below a tolerance.
    Newton {
        part: f64,
        tolerance: f64,
    },
    /// Newton's method for the rest of the step, after a part of the step before is made once more.
    Differences {
        repeated: f64,
        tolerance: f64,
    },
}

impl Stepping {
    /// That of a step, by whether there is an earlier state. `None` where the result depends on how a method goes about it:
    /// its own tolerance, or its rounds.
    fn of(scene: &Scene, has_earlier: bool) -> Option<Self> {
        let integrator = scene.integrator;
        let method = Method::of(integrator.equation).with_earlier(has_earlier);
        match (method, integrator.convergence) {
            (Method::Explicit(substeps), _) => Some(Self::Explicit(substeps)),
            (Method::Stages(tableau), _) => Some(Self::Stages(tableau)),
            (Method::Controlled(pair), Convergence::ErrorEstimate(name)) => {
                Some(Self::Controlled(pair, scene.integrator_options.number(name)))
            }
            (Method::Controlled(_), _) => None,
            (Method::Backward { linearized: true, .. }, _) => Some(Self::Linearized),
            (Method::Backward { linearized: false, part }, Convergence::Update(tolerance)) => {
                Some(Self::Newton { part, tolerance })
            }
            (Method::Differences { repeated }, Convergence::Update(tolerance)) => {
                Some(Self::Differences { repeated, tolerance })
            }
            (
                Method::Backward { linearized: false, .. }
                | Method::Differences { .. }
                | Method::Rounds,
                _,
            ) => None,
        }
    }
}

impl Second {
    /// `None` where the scene's method has no second implementation: it has its own tolerance, or takes rounds.
    pub fn new(scene: &Scene, style: Style, seed: u64) -> Option<Self> {
        let methods = [Stepping::of(scene, false)?, Stepping::of(scene, true)?];
        let (scene, laws) = (scene.clone(), Laws::new(scene));
        Some(Self { scene, style, methods, laws, random: fastrand::Rng::with_seed(seed) })
    }

    /// Whether it steps the scene by solving linear systems.
    pub fn is_implicit(scene: &Scene) -> bool {
        use Stepping::{Differences, Linearized, Newton};
        let method = Stepping::of(scene, true);
        matches!(method, Some(Linearized | Newton { .. } | Differences { .. }))
    }

    /// Takes the step of this number; false where it has no answer. `earlier` is the state one step before, if there is one.
    pub fn step(
        &mut self,
        step: u64,
        earlier: Option<&State>,
        x: &mut [f64],
        v: &mut [f64],
    ) -> bool {
        let time = step as f64 * self.scene.time_step;
        let done = match self.methods[usize::from(earlier.is_some())] {
            Stepping::Explicit(substeps) => {
                self.explicit(time, x, v, substeps);
                Some(())
            }
            Stepping::Stages(tableau) => {
                let h = self.scene.time_step;
                tableau.step(&mut Evaluation { second: self, time }, h, x, v);
                Some(())
            }
            Stepping::Controlled(pair, tolerance) => {
                let h = self.scene.time_step;
                pair.step(&mut Evaluation { second: self, time }, (h, tolerance), x, v).map(|_| ())
            }
            Stepping::Linearized => self.implicit(time, x, v, None),
            Stepping::Newton { part, tolerance } => {
                let (h, start) = (self.scene.time_step, v.to_vec());
                let done = self.implicit(time, x, v, Some((part, tolerance)));
                if part < 1.0 {
                    drift(self.style.arithmetic, (1.0 - part) * h, v, x);
                    for (v, start) in v.iter_mut().zip(&start) {
                        *v = start + (*v - start) / part;
                    }
                }
                done
            }
            Stepping::Differences { repeated, tolerance } => {
                if let Some(State { positions, velocities, .. }) = earlier {
                    self.repeat(repeated, positions, x);
                    self.repeat(repeated, velocities, v);
                }
                let time = time + repeated * self.scene.time_step;
                self.implicit(time, x, v, Some((1.0 - repeated, tolerance)))
            }
        };
        done.is_some() && x.iter().chain(v.iter()).all(|value| value.is_finite())
    }

    fn explicit(&self, mut time: f64, x: &mut [f64], v: &mut [f64], substeps: &[Substep]) {
        let arithmetic = self.style.arithmetic;
        for substep in substeps {
            match *substep {
                Substep::Both(c) => {
                    let old = v.to_vec();
                    self.kick(time, x, v, c * self.scene.time_step);
                    drift(arithmetic, c * self.scene.time_step, &old, x);
                }
                Substep::Kick(c) => self.kick(time, x, v, c * self.scene.time_step),
                Substep::Drift(c) => {
                    drift(arithmetic, c * self.scene.time_step, v, x);
                    time += c * self.scene.time_step;
                }
            }
        }
    }

    fn kick(&self, time: f64, x: &[f64], v: &mut [f64], h: f64) {
        let force = self.force(x, v, time);
        self.push(v, &force, h);
    }

    /// `y ← (1 + c) y − c y₋`.
    fn repeat(&self, c: f64, earlier: &[f64], now: &mut [f64]) {
        for (now, earlier) in now.iter_mut().zip(earlier) {
            *now = self.style.arithmetic.multiply_add(1.0 + c, *now, -c * earlier);
        }
    }

    /// `v ← v + h M⁻¹ F`.
    fn push(&self, v: &mut [f64], force: &[f64], h: f64) {
        let arithmetic = self.style.arithmetic;
        for (place, (velocity, force)) in v.iter_mut().zip(force).enumerate() {
            let particle = &self.scene.particles[place / self.dimension()];
            if !particle.fixed {
                *velocity = if self.style.scaled_kick {
                    arithmetic.multiply_add(h / particle.mass, *force, *velocity)
                } else {
                    *velocity + h * arithmetic.divide(*force, particle.mass)
                };
            }
        }
    }

    /// Newton's method for a part of the step to a tolerance, or one Newton step for all of it.
    fn implicit(
        &mut self,
        time: f64,
        x: &mut [f64],
        v: &mut [f64],
        newton: Option<(f64, f64)>,
    ) -> Option<()> {
        let (part, tolerance) = newton.unwrap_or((1.0, 0.0));
        let most = newton.map_or(1, |_| MAX_ITERATIONS);
        let h = part * self.scene.time_step;
        let arithmetic = self.style.arithmetic;
        let mut u = v.to_vec();
        let mut ahead = x.to_vec();
        drift(arithmetic, h, &u, &mut ahead);
        let (mut reached, mut made) = (false, 0);
        while made < most {
            let (delta, moved) = self.update((time, h), v, &ahead, &u)?;
            made += 1;
            for (u, delta) in u.iter_mut().zip(&delta) {
                *u += delta;
            }
            if let Some(moved) = moved {
                for (ahead, moved) in ahead.iter_mut().zip(moved) {
                    *ahead += moved;
                }
            } else {
                ahead.copy_from_slice(x);
                drift(arithmetic, h, &u, &mut ahead);
            }
            let norm =
                |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>().sqrt();
            let update = norm(&delta);
            let ends = match self.style.stop {
                Stop::AtTolerance => update < tolerance,
                Stop::OneMore => reached,
                Stop::AtRounding => update <= 1e-14 * norm(&u) || (reached && made > 12),
            };
            reached |= update < tolerance;
            if ends {
                break;
            }
            if made == MAX_ITERATIONS {
                return None;
            }
        }
        v.copy_from_slice(&u);
        x.copy_from_slice(&ahead);
        Some(())
    }

    /// Newton's update of the velocities in a step of `h` from `time` on, and of the positions where the system has them; 0 for
    /// fixed particles.
    fn update(
        &mut self,
        (time, h): (f64, f64),
        v: &[f64],
        ahead: &[f64],
        u: &[f64],
    ) -> Option<(Vec<f64>, Option<Vec<f64>>)> {
        let time = time + h;
        let dimension = self.dimension();
        let force = self.force(ahead, u, time);
        let Jacobians { by_position: k, by_velocity: b } = self.laws.jacobians(ahead, u, time);
        let free: Vec<usize> =
            (0..u.len()).filter(|dof| !self.scene.particles[dof / dimension].fixed).collect();
        if free.is_empty() {
            return Some((vec![0.0; u.len()], None));
        }
        let mass = |dof: usize| self.scene.particles[dof / dimension].mass;
        let right = DVector::from_iterator(
            free.len(),
            free.iter().map(|&dof| h * force[dof] - mass(dof) * (u[dof] - v[dof])),
        );
        let inertia = |row: usize, column: usize| if row == column { mass(row) } else { 0.0 };
        let reduced = |i: usize, j: usize| {
            let (row, column) = (free[i], free[j]);
            inertia(row, column) - h * (h * k[(row, column)] + b[(row, column)])
        };
        let n = free.len();
        let on_all = |solution: &[f64]| {
            let mut all = vec![0.0; u.len()];
            for (&dof, value) in free.iter().zip(solution) {
                all[dof] = *value;
            }
            all
        };
        let solution = match self.style.solver {
            Solver::Unreduced => {
                let matrix = DMatrix::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
                    (true, true) => f64::from(u8::from(i == j)),
                    (true, false) => -h * f64::from(u8::from(i == j - n)),
                    (false, true) => -h * k[(free[i - n], free[j])],
                    (false, false) => {
                        let (row, column) = (free[i - n], free[j - n]);
                        inertia(row, column) - h * b[(row, column)]
                    }
                });
                let mut all = DVector::zeros(2 * n);
                all.rows_mut(n, n).copy_from(&right);
                let solution = matrix.lu().solve(&all)?;
                let (moved, delta) = solution.as_slice().split_at(n);
                return Some((on_all(delta), Some(on_all(moved))));
            }
            Solver::PartialLu => DMatrix::from_fn(n, n, reduced).lu().solve(&right)?,
            Solver::FullLu => DMatrix::from_fn(n, n, reduced).full_piv_lu().solve(&right)?,
            Solver::Qr => DMatrix::from_fn(n, n, reduced).qr().solve(&right)?,
            Solver::Inverse => DMatrix::from_fn(n, n, reduced).try_inverse()? * right,
            Solver::Iterative => {
                let size = ITERATIVE * right.norm() / (n as f64).sqrt();
                let off = right.map(|value| value + size * (2.0 * self.random.f64() - 1.0));
                DMatrix::from_fn(n, n, reduced).lu().solve(&off)?
            }
        };
        Some((on_all(solution.as_slice()), None))
    }

    fn dimension(&self) -> usize {
        self.scene.dimension.count()
    }

    /// The force on every particle, fixed ones included.
    fn force(&self, x: &[f64], v: &[f64], time: f64) -> Vec<f64> {
        let mut force = vec![0.0; x.len()];
        let add = |element: &ForceElement| self.add_force(element, x, v, time, &mut force);
        if self.style.backwards {
            self.scene.forces.iter().rev().for_each(add)
        } else {
            self.scene.forces.iter().for_each(add)
        }
        force
    }

    fn add_force(
        &self,
        element: &ForceElement,
        x: &[f64],
        v: &[f64],
        time: f64,
        force: &mut [f64],
    ) {
        let dimension = self.dimension();
        let arithmetic = self.style.arithmetic;
        let vector = |values: &[f64], particle: usize| -> [f64; 3] {
            std::array::from_fn(|axis| {
                if axis < dimension { values[particle * dimension + axis] } else { 0.0 }
            })
        };
        if let Some([i, j]) = element.pair() {
            let difference = |values: &[f64]| {
                let (a, b) = (vector(values, i), vector(values, j));
                std::array::from_fn(|axis| a[axis] - b[axis])
            };
            let masses = [i, j].map(|particle| self.scene.particles[particle].mass);
            let pair = Pair { masses, d: difference(x), w: difference(v) };
            // A force with one way to evaluate it is the law's.
            let on_i = arithmetic
                .on_pair(element, &pair)
                .unwrap_or_else(|| vector(&self.by_law(element, x, v, time), i));
            for axis in 0..dimension {
                force[i * dimension + axis] += on_i[axis];
                force[j * dimension + axis] -= on_i[axis];
            }
            return;
        }
        // A force with only one way to evaluate it comes from the law.
        let mut by_law = None;
        for (particle, body) in self.scene.particles.iter().enumerate() {
            let found = arithmetic.on_particle(element, body.mass, vector(v, particle));
            let on = found.unwrap_or_else(|| {
                let all = by_law.get_or_insert_with(|| self.by_law(element, x, v, time));
                vector(all, particle)
            });
            for axis in 0..dimension {
                force[particle * dimension + axis] += on[axis];
            }
        }
    }

    /// The force of one element on every particle, as the law has it.
    fn by_law(&self, element: &ForceElement, x: &[f64], v: &[f64], time: f64) -> Vec<f64> {
        Laws::of(&self.scene, std::slice::from_ref(element)).force(x, v, time)
    }
}

/// Evaluates stages of a step that starts at this time.
struct Evaluation<'a> {
    second: &'a Second,
    time: f64,
}

impl method::Arithmetic for Evaluation<'_> {
    fn force(&mut self, x: &[f64], v: &[f64], after: f64) -> Vec<f64> {
        self.second.force(x, v, self.time + after)
    }

    fn drift(&self, x: &mut [f64], v: &[f64], h: f64) {
        drift(self.second.style.arithmetic, h, v, x);
    }

    fn kick(&self, v: &mut [f64], force: &[f64], h: f64) {
        self.second.push(v, force, h);
    }
}

fn drift(arithmetic: Arithmetic, h: f64, velocities: &[f64], positions: &mut [f64]) {
    for (position, velocity) in positions.iter_mut().zip(velocities) {
        *position = arithmetic.multiply_add(h, *velocity, *position);
    }
}
