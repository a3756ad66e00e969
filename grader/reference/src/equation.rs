//! Residual of a step in its method's equation, from two states and the reference laws.
//!
//! The equations are those of [`Method`]: explicit substeps, the force at the end of the step, or that linearized:
//!
//! ```text
//! explicit      M (v' − v) = Σ c h F             over the kicks, each force at the state before it
//!               x' − x     = Σ c h v             over the drifts, by the velocity before the first kick, after the last,
//!                                                or as kicked so far
//! linearized    (M − h² K − h B) (v' − v) = h F          F, K, B at (x + h v, v);  x' = x + h v'
//! implicit      M (v' − v) = h F(x', v')                 x' = x + h v'
//! ```
//!
//! The check uses only the simulator's states. The bound of a residual is the rounding error of its terms plus the
//! effect of the method's tolerance `τ` for the last update, for a particle with the row sums `k` and `b` of its
//! derivatives:
//!
//! ```text
//! 256 ε (m (|v| + |v'|) + h |F| + h k |x| + (h² k + h b) (|v| + |v'|)) + 4 (m + h² k + h b) τ
//! ```
//!
//! 256 is the backward error at which the simulator accepts a linear solution, `8 p`, for the 28 entries of the
//! fullest row in the suite. Numbers below 2⁻¹⁰²² are multiples of 2⁻¹⁰⁷⁴ = ε 2⁻¹⁰²² and have the same rounding error
//! as 2⁻¹⁰²². This is added to the size of each term: `m + h² k + h b` times for a velocity, once for a force.
//! A method with a fixed number of rounds solves no equation, so only `x' = x + h v'` is checked. Cost: two or three
//! evaluations of the force per step.

use simulator::scene::Scene;

use crate::laws::{Laws, Magnitude};
use crate::method::{Method, Substep};

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
    /// The largest last update of the velocities.
    tolerance: f64,
    h: f64,
    masses: Vec<f64>,
    fixed: Vec<bool>,
    axes: usize,
}

/// The largest residual so far, as a multiple of its bound.
#[derive(Default)]
struct Worst(f64);

impl Worst {
    fn note(&mut self, residual: f64, allowed: f64) {
        let excess = if residual == 0.0 { 0.0 } else { residual.abs() / allowed };
        self.0 = if excess > self.0 || excess.is_nan() { excess } else { self.0 };
    }

    /// `x' − x = h v`.
    fn note_drift(&mut self, start: f64, end: f64, moved: f64) {
        let allowed = ROUNDING * (start.abs() + end.abs() + moved.abs() + SMALLEST);
        self.note(end - start - moved, allowed);
    }
}

impl Equation {
    /// Those of `scene`.
    pub fn new(scene: &Scene) -> Self {
        Self {
            laws: Laws::new(scene),
            method: Method::of(scene.integrator.equation),
            tolerance: scene.integrator.convergence.tolerance(scene),
            h: scene.time_step,
            masses: scene.particles.iter().map(|particle| particle.mass).collect(),
            fixed: scene.particles.iter().map(|particle| particle.fixed).collect(),
            axes: scene.dimension.count(),
        }
    }

    /// For the step from `from`, which starts at `time`, to `to`: the largest residual as a multiple of its bound, and
    /// the sum of the bounds.
    pub fn excess(&self, from: &State, to: &State, time: f64) -> (f64, f64) {
        match self.method {
            Method::Explicit(substeps) => self.excess_of_substeps(substeps, from, to, time),
            Method::Backward { linearized } => self.excess_of_end(Some(linearized), from, to, time),
            Method::Rounds => self.excess_of_end(None, from, to, time),
        }
    }

    /// The same for an explicit method.
    fn excess_of_substeps(
        &self,
        substeps: &[Substep],
        from: &State,
        to: &State,
        time: f64,
    ) -> (f64, f64) {
        let h = self.h;
        let is_kick = |substep: &&Substep| !matches!(substep, Substep::Drift(_));
        let mut kicks_left = substeps.iter().filter(is_kick).count();
        let (mut x, mut v, mut drifted) = (from.x.clone(), from.v.clone(), 0.0);
        // Per coordinate: change of momentum, sum of its terms' magnitudes, change of position, stiffness.
        let size = x.len();
        let [mut given, mut terms, mut moved, mut stiffness] = [(); 4].map(|()| vec![0.0; size]);
        for substep in substeps {
            let before = v.clone();
            if let Substep::Both(c) | Substep::Kick(c) = *substep {
                let force = self.laws.force(&x, &v, time + drifted);
                let magnitudes = self.laws.magnitudes(&x, &v, time + drifted);
                for dof in (0..size).filter(|dof| !self.fixed[dof / self.axes]) {
                    let magnitude = magnitudes.get(dof / self.axes).copied().unwrap_or_default();
                    let mass = self.masses[dof / self.axes];
                    given[dof] += c * h * force[dof];
                    terms[dof] += c * h * magnitude.force;
                    let by_position = c * h * magnitude.by_position;
                    stiffness[dof] += c * h * (h * magnitude.by_position + magnitude.by_velocity);
                    // The intermediate state has rounding errors too.
                    if drifted > 0.0 {
                        terms[dof] += by_position * (from.x[dof].abs() + to.x[dof].abs());
                    }
                    v[dof] += c * h * force[dof] / mass;
                }
                kicks_left -= 1;
                if kicks_left == 0 {
                    v.clone_from(&to.v);
                }
            }
            if let Substep::Both(c) | Substep::Drift(c) = *substep {
                let along = if matches!(substep, Substep::Both(_)) { &before } else { &v };
                for dof in 0..size {
                    moved[dof] += c * h * along[dof];
                    x[dof] = from.x[dof] + moved[dof];
                }
                drifted += c * h;
            }
        }
        let mut worst = Worst::default();
        for ((start, end), moved) in from.x.iter().zip(&to.x).zip(&moved) {
            worst.note_drift(*start, *end, *moved);
        }
        let mut sum = 0.0;
        for dof in 0..size {
            let change = to.v[dof] - from.v[dof];
            if self.fixed[dof / self.axes] {
                worst.note(change, 0.0);
                continue;
            }
            let mass = self.masses[dof / self.axes];
            let mut rounding = mass * (from.v[dof].abs() + to.v[dof].abs()) + terms[dof];
            rounding += (mass + stiffness[dof] + 1.0) * SMALLEST;
            sum += ROUNDING * rounding;
            worst.note(mass * change - given[dof], ROUNDING * rounding);
        }
        (worst.0, sum)
    }

    /// The same for a method with the force at the end of the step, linearized or not. `None` stands for rounds, of which
    /// only the positions are checked.
    fn excess_of_end(
        &self,
        linearized: Option<bool>,
        from: &State,
        to: &State,
        time: f64,
    ) -> (f64, f64) {
        let (h, tolerance) = (self.h, self.tolerance);
        let mut worst = Worst::default();
        for ((start, end), v) in from.x.iter().zip(&to.x).zip(&to.v) {
            worst.note_drift(*start, *end, h * v);
        }
        let moved: Vec<f64> = from.x.iter().zip(&from.v).map(|(x, v)| x + h * v).collect();
        let change: Vec<f64> = to.v.iter().zip(&from.v).map(|(end, start)| end - start).collect();
        let at = time + h;
        let (x, v) = match linearized {
            Some(true) => (&moved, &from.v),
            // For rounds, used only for the bound.
            Some(false) | None => (&to.x, &to.v),
        };
        let mut force = match linearized {
            Some(_) => self.laws.force(x, v, at),
            None => Vec::new(),
        };
        let magnitudes = self.laws.magnitudes(x, v, at);
        if linearized == Some(true) {
            let free = |dof: &usize| !self.fixed[dof / self.axes];
            let along = |scale: f64| -> Vec<f64> {
                let of = |dof: usize| if free(&dof) { scale * change[dof] } else { 0.0 };
                (0..change.len()).map(of).collect()
            };
            let linear = self.laws.along([x, v], [&along(h), &along(1.0)], at);
            force.iter_mut().zip(linear).for_each(|(force, linear)| *force += linear);
        }
        let largest = |values: &[f64]| values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        let size = largest(x);
        let speed = largest(&from.v) + largest(&to.v);
        let mut sum = 0.0;
        for (dof, change) in change.iter().enumerate() {
            let particle = dof / self.axes;
            if self.fixed[particle] {
                worst.note(*change, 0.0);
                continue;
            }
            let mass = self.masses[particle];
            let Magnitude { force: terms, by_position, by_velocity } =
                magnitudes.get(particle).copied().unwrap_or_default();
            let stiffness = h * h * by_position + h * by_velocity;
            let mut rounding = mass * (from.v[dof].abs() + to.v[dof].abs()) + h * terms;
            rounding += (mass + stiffness + 1.0) * SMALLEST;
            rounding += h * by_position * size + stiffness * speed;
            let allowed = ROUNDING * rounding + 4.0 * (mass + stiffness) * tolerance;
            sum += allowed;
            if linearized.is_some() {
                worst.note(mass * change - h * force[dof], allowed);
            }
        }
        (worst.0, sum)
    }
}
