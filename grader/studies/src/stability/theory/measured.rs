//! Step matrix of a linear scene, measured from single steps.
//!
//! ```text
//! A e_j = (step(z₀ + s e_j) − step(z₀)) / s        z = (x, v/ω), z₀ at rest
//! ```
//!
//! That of a two-step method is of two states, `z = (x, v/ω, x₋, v₋/ω)`, and keeps the first of them as the second.
//!
//! Springs of rest length zero are linear, so any `s` works; this value equals no distance in the scene, so that no
//! particles coincide. Cost: a step for each column, and one.

use ::reference::method::stable_steps;
use nalgebra::{DMatrix, Schur};
use scene::Scene;
use scene::schema::{Convergence, IntegratorSchema};
use scene::trace::State;
use simulator::simulation::Simulation;

use crate::stability::draft::Draft;

/// `s`.
const SHIFT: f64 = 0.237_1;

/// Maximum number of sweeps of the QR algorithm per row; two or three are usual, and some matrices never converge.
const SWEEPS: usize = 100;

/// A scene whose particles move along x under linear forces, with a known frequency scale.
#[derive(Debug, Clone)]
pub struct Linear {
    /// Description of the scene.
    pub name: String,
    draft: Draft,
    /// The frequency `ω` that scales steps (`h ω`), in radians per second.
    pub omega: f64,
    /// Frequency and damping ratio of each mode.
    pub modes: Vec<[f64; 2]>,
}

impl Linear {
    /// A particle on a spring of `ω = 1`, with drag.
    pub fn oscillator(zeta: f64) -> Self {
        let draft = Draft::new()
            .fixed([0.0; 2])
            .particle(1.0, [0.0; 2], [0.0; 2])
            .spring([0, 1], [1.0, 0.0, 0.0])
            .force("dragdamping", &[], &[("b", 2.0 * zeta)]);
        let name = format!("oscillator, ζ = {zeta}");
        Self { name, draft, omega: 1.0, modes: vec![[1.0, zeta]] }
    }

    /// Particles of mass 1 in a row between two walls, with damped springs of stiffness 1 and rest length zero:
    /// `ω_j = 2 sin(jπ/2(N+1))`, `ζ_j = b ω_j/2`. `zeta` is that of the highest mode.
    pub fn chain(particles: usize, zeta: f64) -> Self {
        let mode =
            |j: usize| 2.0 * (j as f64 * std::f64::consts::PI / (2 * (particles + 1)) as f64).sin();
        let omega = mode(particles);
        let damping = 2.0 * zeta / omega;
        let mut draft = Draft::new().fixed([0.0; 2]);
        for number in 1..=particles {
            draft = draft.particle(1.0, [number as f64, 0.0], [0.0; 2]);
        }
        draft = draft.fixed([(particles + 1) as f64, 0.0]);
        for number in 0..=particles {
            draft = draft.spring([number, number + 1], [1.0, 0.0, damping]);
        }
        let modes = (1..=particles).map(|j| [mode(j), 0.5 * damping * mode(j)]).collect();
        let name = format!("chain of {particles}, ζ = {zeta}");
        Self { name, draft, omega, modes }
    }

    /// Whether the method supports its forces.
    pub fn is_taken_by(&self, integrator: &IntegratorSchema) -> bool {
        self.draft.is_taken_by(integrator)
    }

    /// The scene with steps `a = h ω`, and tolerances of the methods near rounding error.
    pub(crate) fn scene(&self, integrator: &'static IntegratorSchema, a: f64, steps: u64) -> Scene {
        let mut scene = self.draft.scene(&self.name, integrator, a / self.omega, steps);
        match integrator.convergence {
            Convergence::Direct | Convergence::Update(_) => {}
            // Below it, a step is not taken at all; and a drift is no oscillation.
            Convergence::UpdateOption(name) => set(&mut scene, name, "1e-9"),
            // A step that is not divided: the map of a divided one is not linear.
            Convergence::ErrorEstimate(name) => set(&mut scene, name, "1e300"),
            // The distance to project on is zero: the first round solves.
            Convergence::Rounds(name) => set(&mut scene, name, "2"),
        }
        scene
    }

    /// The matrix `A`, for `(x, v/ω)` of the free particles, of each state that a step uses; `None` if a step fails.
    pub fn matrix(&self, integrator: &'static IntegratorSchema, a: f64) -> Option<DMatrix<f64>> {
        let earlier_states = u64::from(integrator.equation.is_two_step());
        let scene = self.scene(integrator, a, 1 + earlier_states);
        let free: Vec<usize> =
            (0..scene.particles.len()).filter(|idx| !scene.particles[*idx].fixed).collect();
        let mut simulation = Simulation::new(&scene);
        let mut after = |[now, earlier]: &[State; 2]| {
            simulation.set_state(earlier_states, Some(earlier), &now.positions, &now.velocities);
            simulation.advance().ok()?;
            let state = simulation.state();
            let of = |values: &[f64], scale: f64| -> Vec<f64> {
                free.iter().map(|idx| values[2 * idx] / scale).collect()
            };
            Some([of(state.positions, 1.0), of(state.velocities, self.omega)].concat())
        };
        let start =
            State { time: None, positions: scene.positions(), velocities: scene.velocities() };
        let start = [start.clone(), start];
        let rest = after(&start)?;
        let size = rest.len();
        let mut matrix = DMatrix::zeros(size, (1 + earlier_states as usize) * size);
        for column in 0..matrix.ncols() {
            let mut shifted = start.clone();
            let State { positions, velocities, .. } = &mut shifted[column / size];
            let place = 2 * free[column % free.len()];
            if column % size < free.len() {
                positions[place] += SHIFT
            } else {
                velocities[place] += SHIFT * self.omega
            }
            for (row, (moved, rest)) in after(&shifted)?.iter().zip(&rest).enumerate() {
                matrix[(row, column)] = (moved - rest) / SHIFT;
            }
        }
        // An earlier state is the state one step before.
        let columns = matrix.ncols();
        let mut square = matrix.resize_vertically(columns, 0.0);
        square.view_mut((size, 0), (columns - size, columns)).fill_with_identity();
        Some(square)
    }

    /// The spectral radius of `A`; infinite if a step fails.
    pub fn radius(&self, integrator: &'static IntegratorSchema, a: f64) -> f64 {
        let Some(matrix) = self.matrix(integrator, a) else { return f64::INFINITY };
        if matrix.iter().any(|entry| !entry.is_finite()) {
            return f64::INFINITY;
        }
        let sweeps = SWEEPS * matrix.nrows();
        match Schur::try_new(matrix.clone(), f64::EPSILON, sweeps) {
            Some(schur) => {
                let eigenvalues = schur.complex_eigenvalues();
                eigenvalues.iter().fold(0.0, |most: f64, value| most.max(value.norm()))
            }
            None => radius_by_powers(matrix),
        }
    }

    /// The longest stable step by theory, as `h ω`: the least over the modes.
    pub fn limit(&self, integrator: &IntegratorSchema) -> f64 {
        let of_mode = |[omega, zeta]: &[f64; 2]| {
            stable_steps(integrator.equation, *zeta)[0] * (self.omega / omega)
        };
        self.modes.iter().map(of_mode).fold(f64::INFINITY, f64::min)
    }
}

/// The spectral radius by Gelfand's formula, `ρ = lim ‖A^m‖^(1/m)`, by repeated squaring up to `m = 2⁵⁹`. There the
/// factor `m` that a double eigenvalue adds to the norm is below rounding. Each square is scaled to norm 1.
fn radius_by_powers(mut matrix: DMatrix<f64>) -> f64 {
    let (mut logarithm, mut weight) = (0.0, 1.0);
    for _ in 0..60 {
        let norm = matrix.norm();
        if norm == 0.0 {
            return 0.0;
        }
        logarithm += weight * norm.ln();
        matrix /= norm;
        matrix = &matrix * &matrix;
        weight *= 0.5;
    }
    logarithm.exp()
}

fn set(scene: &mut Scene, name: &str, value: &str) {
    let set = scene.integrator_options.set(name, value);
    debug_assert!(set.is_ok(), "{name}={value}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrix_powers_find_the_spectral_radius() {
        // A rotation by 0.3 scaled by 0.8, and a double eigenvalue 2 with one eigenvector.
        let (sin, cos) = 0.3_f64.sin_cos();
        let turn = DMatrix::from_row_slice(2, 2, &[0.8 * cos, -0.8 * sin, 0.8 * sin, 0.8 * cos]);
        let double = DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 0.0, 2.0]);
        for (matrix, radius) in [(turn, 0.8), (double, 2.0)] {
            // Every squaring has a rounding error of a few ε, with half the weight of the one before.
            let off = radius_by_powers(matrix) / radius - 1.0;
            assert!(off.abs() < 16.0 * f64::EPSILON, "{off:e}");
        }
        // Nilpotent: zero after two steps.
        assert_eq!(radius_by_powers(DMatrix::from_row_slice(2, 2, &[0.0, 1.0, 0.0, 0.0])), 0.0);
    }
}
