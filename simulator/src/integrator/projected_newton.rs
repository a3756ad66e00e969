//! Implicit Euler as energy minimisation: projected Newton with backtracking line search.
//!
//! The positions of the step's end minimise the incremental potential
//!
//! ```text
//! E(x) = ½ ‖x − x̃‖²_M + h² P(x) + h³ R((x − xⁿ)/h)        x̃ = xⁿ + h vⁿ
//! ```
//!
//! with `P` the potential energy and `R` Rayleigh's dissipation function (linear drag, damping by mass). Where its gradient
//! is zero, implicit Euler's equation holds; unlike root finding, minimisation can make every step descend:
//!
//! ```text
//! x ← xⁿ
//! p ← −H⁻¹ ∇E(x)                  H: the Hessian, each element of it projected to be semi-definite
//! while ‖p‖/h > tolerance, or fewer than min_iterations are made:
//!     α ← 1;  while E(x + α p) > E(x): α ← α/2
//!     x ← x + α p
//!     p ← −H⁻¹ ∇E(x)
//! v ← (x − xⁿ)/h
//! ```
//!
//! Source: lecture on optimisation time integration, algorithms 2 and 3 and `time_integrator.py`. As in its code, `‖p‖` is
//! the largest sum of the magnitudes of a particle's components, and the last `p`, which is below the tolerance, is not
//! applied. Its code may leave the loop before the first iteration, which freezes a motion that starts slowly: a particle
//! at rest then never falls, however long the run. Its algorithm 3 makes at least one iteration, and so does this one by
//! default. With `min_iterations="0"` it is the loop of the code; steps that freeze are counted.
//!
//! The unknown here is the velocity `u = (x − xⁿ)/h`, so that the linear system is the one of
//! [`backward`](super::backward), and `p = h δ`; the objective is `E/h²`. A force that is neither the
//! gradient of an energy nor of a dissipation function (the vortex, a spring with damping) has no `E`, and
//! scenes with it are refused.

use sparse::linear::LinearSolver;

use super::backward::{Curvature, Linearisation, Point};
use super::record::{Recording, incremental_potential};
use super::{
    Integrator, IntegratorKind, Interrupt, IterationRecorder, Observer, Step, StepError, drift,
};
use crate::force::Degenerate;
use crate::solver::line_search::{Objective, backtrack};
use crate::solver::psd::Projection;
use crate::system::System;
use scene::schema::{
    AccuracySetting, Convergence, Domain, Family, IntegratorOptions, IntegratorSchema, Matrix,
    OptionKind, OptionSchema, OptionText, Order, Refusal, StepEquation,
};
use scene::{ForceElement, Scene};

pub(super) static KIND: IntegratorKind = IntegratorKind {
    schema: IntegratorSchema {
        name: "projected-newton",
        aliases: &[],
        summary: "implicit Euler by minimising an energy, with line search",
        formula: "implicit Euler as the minimiser of `E(x) = ½ ‖x − q − h v‖²_M + h² U(x) + h³ R((x − q)/h)`, with `R` the dissipation function of linear drag and of damping by mass: `x ← x + α p` from `q` with `p = −H⁻¹ ∇E`, each spring's Hessian projected, `α` halved until `E` does not grow, at least `min_iterations` times and until `‖p‖/h` is at most the tolerance, in the norm of the option `norm`; the last `p` is not applied; `q' = x`, `v' = (x − q)/h`",
        equation: StepEquation::ImplicitEuler,
        family: Family::Minimization,
        matrix: Matrix::Jacobians,
        convergence: Convergence::UpdateOption("tolerance"),
        order: Order::always(1),
        options: &[
            OptionSchema {
                name: "tolerance",
                meaning: "the norm of Newton's step, divided by h, below which it ends",
                kind: OptionKind::Number { domain: Domain::Positive, default: 1e-2 },
                formats: OptionText {
                    values: "number above 0",
                    meaning: "Newton's method ends when the norm of its step, divided by `dt`, is not larger; that last step is not applied",
                },
                accuracy: &[
                    AccuracySetting { value: "1e-2", converges: false },
                    AccuracySetting { value: "1e-5", converges: false },
                    AccuracySetting { value: "1e-10", converges: true },
                ],
            },
            OptionSchema {
                name: "norm",
                meaning: "the norm of Newton's step",
                kind: OptionKind::Choice { words: &["row-sum", "component"] },
                formats: OptionText {
                    values: "`row-sum`, `component`",
                    meaning: "the largest sum of the magnitudes of a particle's components, as numpy's `norm(p, inf)` of an array of a row per particle; or the largest magnitude of a component",
                },
                accuracy: &[],
            },
            OptionSchema {
                name: "min_iterations",
                meaning: "the fewest Newton iterations of a step",
                kind: OptionKind::Count { least: 0, default: 1, at_most: Some("max_iterations") },
                formats: OptionText {
                    values: "whole number, 0 or more, at most `max_iterations`",
                    meaning: "so many Newton steps are applied even if they are below the tolerance; with 0, a motion that starts slowly may never start, and `simulate` warns of it",
                },
                accuracy: &[],
            },
            OptionSchema {
                name: "projection",
                meaning: "what is done to negative eigenvalues of an element's Hessian",
                kind: OptionKind::Choice { words: &["clamp", "absolute", "none"] },
                formats: OptionText {
                    values: "`clamp`, `absolute`, `none`",
                    meaning: "negative eigenvalues of an element's Hessian are set to zero, replaced by their magnitude, or kept",
                },
                accuracy: &[],
            },
            OptionSchema {
                name: "direction",
                meaning: "the matrix whose solution is the step: the Hessian, that of Gauss and Newton, or the mass matrix",
                kind: OptionKind::Choice { words: &["newton", "gauss-newton", "gradient"] },
                formats: OptionText {
                    values: "`newton`, `gauss-newton`, `gradient`",
                    meaning: "the matrix `H` of the step: the projected Hessian; `M + h² Σ f fᵀ/(2U)` over the springs, with `f` the force and `U` the energy of each, which is Gauss–Newton's matrix for energies that are squares; `M`, which is gradient descent in the norm of `M`. The last two are baselines to compare with, and ignore `projection`",
                },
                accuracy: &[],
            },
            OptionSchema {
                name: "line_search",
                meaning: "how far along Newton's step",
                kind: OptionKind::Choice { words: &["backtracking", "none"] },
                formats: OptionText {
                    values: "`backtracking`, `none`",
                    meaning: "`none` applies every Newton step in full",
                },
                accuracy: &[],
            },
            OptionSchema {
                name: "max_iterations",
                meaning: "the most Newton iterations of a step",
                kind: OptionKind::Count { least: 1, default: 1000, at_most: None },
                formats: OptionText {
                    values: "whole number, 1 or more",
                    meaning: "more iterations in one step are an error",
                },
                accuracy: &[],
            },
        ],
        refuses,
    },
    build_2d: build::<2>,
    build_3d: build::<3>,
};

fn refuses(force: &ForceElement) -> Option<Refusal> {
    let refusal = Refusal {
        because: "has a part that is the gradient of no energy, nor of a dissipation function of velocities alone",
        remedy: "leave the force (or its damping) out, or use implicit-euler",
    };
    (!force.is_variational()).then_some(refusal)
}

fn build<const D: usize>(
    scene: &Scene,
    system: &System<D>,
    solver: LinearSolver,
) -> Box<dyn Integrator<D>> {
    let options = MinimiserOptions::of(&scene.integrator_options);
    Box::new(ProjectedNewton::new(system, solver, options))
}

/// The norm of Newton's step.
#[derive(Clone, Copy)]
pub(super) enum Norm {
    /// The largest sum of the magnitudes of a particle's components.
    RowSum,
    /// The largest magnitude of a component.
    Component,
}

impl Norm {
    /// Of a vector of `D` components per particle, in which a NaN is never the largest.
    fn of<const D: usize>(self, vector: &[f64]) -> f64 {
        let magnitudes = |particle: &[f64; D]| particle.map(f64::abs);
        vector.as_chunks::<D>().0.iter().map(magnitudes).fold(0.0, |largest, particle| match self {
            Self::RowSum => largest.max(particle.iter().sum()),
            Self::Component => particle.into_iter().fold(largest, f64::max),
        })
    }
}

pub(super) struct MinimiserOptions {
    pub(super) tolerance: f64,
    pub(super) curvature: Curvature,
    pub(super) norm: Norm,
    pub(super) min_iterations: u64,
    pub(super) line_search: bool,
    pub(super) max_iterations: u64,
}

impl MinimiserOptions {
    fn of(values: &IntegratorOptions) -> Self {
        Self {
            tolerance: values.number("tolerance"),
            norm: match values.choice("norm") {
                "row-sum" => Norm::RowSum,
                _ => Norm::Component,
            },
            min_iterations: values.count("min_iterations"),
            curvature: match (values.choice("direction"), values.choice("projection")) {
                ("gradient", _) => Curvature::Mass,
                ("gauss-newton", _) => Curvature::GaussNewton,
                (_, "clamp") => Curvature::Jacobians(Projection::Clamp),
                (_, "absolute") => Curvature::Jacobians(Projection::Absolute),
                _ => Curvature::Jacobians(Projection::None),
            },
            line_search: values.choice("line_search") == "backtracking",
            max_iterations: values.count("max_iterations"),
        }
    }
}

pub(super) struct ProjectedNewton<const D: usize> {
    options: MinimiserOptions,
    linearisation: Linearisation<D>,
    /// `u`.
    pub(super) iterate: Vec<f64>,
    /// `p/h`.
    delta: Vec<f64>,
    trial_positions: Vec<f64>,
    trial_velocities: Vec<f64>,
    force: Vec<f64>,
    recording: Recording,
}

impl<const D: usize> ProjectedNewton<D> {
    pub(super) fn new(system: &System<D>, solver: LinearSolver, options: MinimiserOptions) -> Self {
        let zeros = vec![0.0; system.n_particles() * D];
        Self {
            linearisation: Linearisation::new(system, solver).with_curvature(options.curvature),
            options,
            iterate: zeros.clone(),
            delta: zeros.clone(),
            trial_positions: zeros.clone(),
            trial_velocities: zeros.clone(),
            force: zeros,
            recording: Recording::default(),
        }
    }

    /// Leaves the velocity that minimises in `self.iterate`, and returns the number of iterations.
    pub(super) fn minimise(
        &mut self,
        system: &System<D>,
        step: &mut Step<'_>,
    ) -> Result<u64, StepError> {
        let Step { size: h, time, positions, velocities, statistics, .. } = step;
        let (h, time) = (*h, *time + *h);
        let (positions, velocities): (&[f64], &[f64]) = (positions, velocities);
        // x ← xⁿ; a fixed particle is where its velocity takes it.
        self.iterate.copy_from_slice(velocities);
        for (iterate, fixed) in self.iterate.chunks_exact_mut(D).zip(system.fixed()) {
            if !fixed {
                iterate.fill(0.0);
            }
        }
        let mut iterations = 0;
        let (mut step_length, mut halvings) = (None, 0);
        loop {
            let point = Point { h, time, positions, velocities, iterate: &self.iterate };
            self.recording.record(system, point, iterations, (step_length, halvings));
            self.linearisation.solve(system, point, &mut self.delta, statistics)?;
            let update = self.options.norm.of::<D>(&self.delta);
            let is_within = update <= self.options.tolerance;
            if is_within && iterations >= self.options.min_iterations {
                break;
            }
            let not_converged = |update| {
                let residual = self.linearisation.residual;
                StepError::NotConverged { iterations, update, residual }
            };
            // A NaN is never the largest.
            if self.delta.iter().any(|delta| !delta.is_finite()) {
                return Err(not_converged(f64::NAN));
            }
            if iterations == self.options.max_iterations {
                return Err(not_converged(update));
            }
            iterations += 1;

            let mut alpha = 1.0;
            halvings = 0;
            if self.options.line_search {
                let mut line = Line {
                    system,
                    point,
                    delta: &self.delta,
                    positions: &mut self.trial_positions,
                    velocities: &mut self.trial_velocities,
                    force: &mut self.force,
                    evaluations: 0,
                };
                let (start, _) = line.value(0.0);
                let found = backtrack(&mut line, start)?;
                statistics.energy_evaluations += line.evaluations;
                let Some((length, count)) = found else {
                    // Within the tolerance, rounding may be all that is left.
                    if is_within {
                        break;
                    }
                    return Err(StepError::NoDescent { iterations, update });
                };
                (alpha, halvings) = (length, u64::from(count));
                statistics.line_search_halvings += halvings;
            }
            step_length = Some(alpha);
            for (value, delta) in self.iterate.iter_mut().zip(&self.delta) {
                *value += alpha * delta;
            }
        }
        statistics.newton_iterations += iterations;
        statistics.max_newton_iterations = statistics.max_newton_iterations.max(iterations);
        Ok(iterations)
    }
}

impl<const D: usize> Integrator<D> for ProjectedNewton<D> {
    fn step(&mut self, system: &System<D>, mut step: Step<'_>) -> Result<(), StepError> {
        let iterations = self.minimise(system, &mut step)?;
        let frozen = iterations == 0 && !self.linearisation.residual_is_rounding(step.size);
        step.statistics.frozen.last |= frozen;
        step.velocities.copy_from_slice(&self.iterate);
        drift(step.positions, step.velocities, step.size);
        Ok(())
    }

    fn observe(&mut self, observer: Observer) {
        self.linearisation.observe(observer);
    }

    fn record_by(&mut self, recorder: IterationRecorder) -> bool {
        self.recording = Recording::to(recorder);
        true
    }

    fn interrupt_by(&mut self, interrupt: &Interrupt) {
        self.linearisation.interrupt_by(interrupt);
    }
}

/// `E/h²` from the iterate along Newton's step.
struct Line<'a, const D: usize> {
    system: &'a System<D>,
    point: Point<'a>,
    delta: &'a [f64],
    positions: &'a mut [f64],
    velocities: &'a mut [f64],
    force: &'a mut [f64],
    evaluations: u64,
}

impl<const D: usize> Line<'_, D> {
    /// Moves to `α`.
    fn move_to(&mut self, alpha: f64) {
        let Point { h, positions, iterate, .. } = self.point;
        for ((trial, start), delta) in self.velocities.iter_mut().zip(iterate).zip(self.delta) {
            *trial = start + alpha * delta;
        }
        self.positions.copy_from_slice(positions);
        drift(self.positions, self.velocities, h);
    }
}

impl<const D: usize> Objective for Line<'_, D> {
    type Error = Degenerate;

    fn value(&mut self, alpha: f64) -> (f64, f64) {
        self.move_to(alpha);
        self.evaluations += 1;
        incremental_potential(self.system, self.point, self.velocities, self.positions)
    }

    fn slope(&mut self, alpha: f64) -> Result<f64, Degenerate> {
        self.move_to(alpha);
        let Point { h, time, velocities: start, .. } = self.point;
        self.system.force(self.positions, self.velocities, time, self.force)?;
        let mut slope = 0.0;
        let moved = self.velocities.chunks_exact(D).zip(start.chunks_exact(D));
        let pulled = self.force.chunks_exact(D).zip(self.delta.chunks_exact(D));
        for (((velocity, start), (force, delta)), mass) in
            moved.zip(pulled).zip(self.system.masses())
        {
            for axis in 0..D {
                let gradient = mass * (velocity[axis] - start[axis]) - h * force[axis];
                slope += gradient * delta[axis];
            }
        }
        Ok(slope)
    }
}
