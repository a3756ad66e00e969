//! Residual of a step in its method's equation, from two states and the reference laws.
//!
//! ```text
//! explicit      x' = x + h v      M (v' − v) = h F(x, v)
//! symplectic    x' = x + h v'     M (v' − v) = h F(x, v)
//! linearized    x' = x + h v'     (M − h² K − h B) (v' − v) = h F          F, K, B at (x + h v, v)
//! implicit      x' = x + h v'     M (v' − v) = h F(x', v')                 projected Newton the same
//! ```
//!
//! The check uses only the simulator's states. The bound of a residual is the rounding error of its terms plus the
//! effect of the method's tolerance `τ` for the last update (implicit Euler 1e-9, projected Newton 1e-2), for a
//! particle with the row sums `k` and `b` of its derivatives:
//!
//! ```text
//! 256 ε (m (|v| + |v'|) + h |F| + h k |x| + (h² k + h b) (|v| + |v'|)) + 4 (m + h² k + h b) τ
//! ```
//!
//! 256 is the backward error at which the simulator accepts a linear solution, `8 p`, for the 28 entries of the
//! fullest row in the suite. Numbers below 2⁻¹⁰²² are multiples of 2⁻¹⁰⁷⁴ = ε 2⁻¹⁰²² and have the same rounding error
//! as 2⁻¹⁰²². This is added to the size of each term: `m + h² k + h b` times for a velocity, once for a force.
//! `fast-mass-spring` takes a fixed number of iterations and solves no equation, so only `x' = x + h v'` is checked.
//! Cost: two or three evaluations of the force per step.

use simulator::scene::Scene;

use crate::laws::{Laws, Magnitude};

const ROUNDING: f64 = 256.0 * f64::EPSILON;

/// Smaller numbers have the same rounding error as this one.
const SMALLEST: f64 = f64::MIN_POSITIVE;

/// Positions and velocities, `n·D`.
#[derive(Debug, Clone, Default)]
pub struct State {
    /// Positions.
    pub x: Vec<f64>,
    /// Velocities.
    pub v: Vec<f64>,
}

/// The equations of one scene.
pub struct Equation {
    laws: Laws,
    method: Method,
    h: f64,
    masses: Vec<f64>,
    fixed: Vec<bool>,
    axes: usize,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Method {
    Explicit,
    Symplectic,
    Linearized,
    /// Implicit Euler, with the tolerance of the last update.
    Implicit,
    Projected,
    /// Only positions are checked.
    Other,
}

impl Equation {
    /// The equations of the scene's method, with the laws of its forces.
    pub fn new(scene: &Scene) -> Self {
        let method = match scene.integrator.name {
            "explicit-euler" => Method::Explicit,
            "symplectic-euler" => Method::Symplectic,
            "linearized-implicit-euler" => Method::Linearized,
            "implicit-euler" => Method::Implicit,
            "projected-newton" => Method::Projected,
            _ => Method::Other,
        };
        Self {
            laws: Laws::new(scene),
            method,
            h: scene.time_step,
            masses: scene.particles.iter().map(|particle| particle.mass).collect(),
            fixed: scene.particles.iter().map(|particle| particle.fixed).collect(),
            axes: scene.dimension.count(),
        }
    }

    /// For the step from `from`, which starts at `time`, to `to`: the largest residual as a multiple of its bound, and
    /// the sum of the bounds.
    pub fn excess(&self, from: &State, to: &State, time: f64) -> (f64, f64) {
        let h = self.h;
        let drift = if self.method == Method::Explicit { &from.v } else { &to.v };
        let mut worst = 0.0_f64;
        let mut note = |residual: f64, allowed: f64| {
            let excess = if residual == 0.0 { 0.0 } else { residual.abs() / allowed };
            worst = if excess > worst || excess.is_nan() { excess } else { worst };
        };
        for ((start, end), v) in from.x.iter().zip(&to.x).zip(drift) {
            note(
                end - start - h * v,
                ROUNDING * (start.abs() + end.abs() + (h * v).abs() + SMALLEST),
            );
        }
        let moved: Vec<f64> = from.x.iter().zip(&from.v).map(|(x, v)| x + h * v).collect();
        let change: Vec<f64> = to.v.iter().zip(&from.v).map(|(end, start)| end - start).collect();
        let (x, v, at, tolerance) = match self.method {
            Method::Explicit | Method::Symplectic => (&from.x, &from.v, time, 0.0),
            Method::Linearized => (&moved, &from.v, time + h, 0.0),
            Method::Implicit => (&to.x, &to.v, time + h, 1e-9),
            // Used only for the bound.
            Method::Other => (&to.x, &to.v, time + h, 0.0),
            Method::Projected => (&to.x, &to.v, time + h, 1e-2),
        };
        let mut force = match self.method {
            Method::Other => Vec::new(),
            _ => self.laws.force(x, v, at),
        };
        let magnitudes = self.laws.magnitudes(x, v, at);
        if self.method == Method::Linearized {
            let free = |dof: &usize| !self.fixed[dof / self.axes];
            let along = |scale: f64| -> Vec<f64> {
                let of = |dof: usize| if free(&dof) { scale * change[dof] } else { 0.0 };
                (0..change.len()).map(of).collect()
            };
            let linear = self.laws.along([x, v], [&along(h), &along(1.0)], at);
            force.iter_mut().zip(linear).for_each(|(force, linear)| *force += linear);
        }
        let implicit = !matches!(self.method, Method::Explicit | Method::Symplectic);
        let largest = |values: &[f64]| values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        let size = largest(x);
        let speed = largest(&from.v) + largest(&to.v);
        let mut sum = 0.0;
        for (dof, change) in change.iter().enumerate() {
            let particle = dof / self.axes;
            if self.fixed[particle] {
                note(*change, 0.0);
                continue;
            }
            let mass = self.masses[particle];
            let Magnitude { force: terms, by_position, by_velocity } =
                magnitudes.get(particle).copied().unwrap_or_default();
            let stiffness = h * h * by_position + h * by_velocity;
            let mut rounding = mass * (from.v[dof].abs() + to.v[dof].abs()) + h * terms;
            rounding += (mass + stiffness + 1.0) * SMALLEST;
            if implicit {
                rounding += h * by_position * size + stiffness * speed;
            }
            let allowed = ROUNDING * rounding + 4.0 * (mass + stiffness) * tolerance;
            sum += allowed;
            if self.method == Method::Other {
                continue;
            }
            note(mass * change - h * force[dof], allowed);
        }
        (worst, sum)
    }
}
