//! The equations of the integrators, written a second time.
//!
//! ```text
//! explicit    both      x ← x + c h v,  v ← v + c h M⁻¹ F(x, v, t)     at once
//!             kick      v ← v + c h M⁻¹ F(x, v, t)
//!             drift     x ← x + c h v,  t ← t + c h
//! backward    implicit  M (v' − v) = h F(x', v', t + h),  x' = x + h v'
//!             linearized: one Newton step of it, from v' = v
//! rounds      x' = x + h v' alone
//! ```
//!
//! An explicit method is a list of substeps. From this description follow the check that a step obeys its equation
//! ([`crate::equation`]), the second stepper ([`crate::second`]), and the matrix of an oscillator's step
//! ([`Method::oscillator`]). A new [`StepEquation`] does not compile until this file states it.

use simulator::scene::schema::{Convergence, IntegratorSchema, StepEquation};

/// How a step is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// Substeps, one after the other, each by what is known before it.
    Explicit(&'static [Substep]),
    /// The force at the end of the step.
    Backward {
        /// One Newton step in the place of a solution.
        linearized: bool,
    },
    /// A number of rounds that solve no equation exactly.
    Rounds,
}

/// A part of an explicit step, `c` times the time step long.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Substep {
    /// Positions and velocities at once.
    Both(f64),
    /// Velocities.
    Kick(f64),
    /// Positions.
    Drift(f64),
}

/// A method with one evaluation of the forces in its equation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OnePoint {
    /// Explicit Euler.
    Explicit,
    /// Symplectic Euler.
    Symplectic,
    /// Linearized implicit Euler.
    Linearized,
    /// Implicit Euler, solved to rounding.
    Implicit,
}

use Substep::{Both, Drift, Kick};

impl Method {
    /// The method of an equation.
    pub fn of(equation: StepEquation) -> Self {
        match equation {
            StepEquation::ExplicitEuler => Self::Explicit(&[Both(1.0)]),
            StepEquation::SymplecticEuler => Self::Explicit(&[Kick(1.0), Drift(1.0)]),
            StepEquation::LinearizedImplicitEuler => Self::Backward { linearized: true },
            StepEquation::ImplicitEuler => Self::Backward { linearized: false },
            StepEquation::LocalGlobal => Self::Rounds,
        }
    }

    /// The matrix `A` of `(x, v/ω) ← A (x, v/ω)`: a step of `x'' = −ω² x − 2 ζ ω v`, with `a = h ω`. Rounds are of
    /// a spring of rest length zero, whose damping is explicit.
    pub fn oscillator(self, a: f64, zeta: f64) -> [[f64; 2]; 2] {
        let kept = 1.0 - 2.0 * zeta * a;
        match self {
            Self::Explicit(substeps) => {
                substeps.iter().fold([[1.0, 0.0], [0.0, 1.0]], |before, substep| {
                    let matrix = match *substep {
                        Both(c) => [[1.0, c * a], [-c * a, 1.0 - 2.0 * zeta * (c * a)]],
                        Kick(c) => [[1.0, 0.0], [-c * a, 1.0 - 2.0 * zeta * (c * a)]],
                        Drift(c) => [[1.0, c * a], [0.0, 1.0]],
                    };
                    product(matrix, before)
                })
            }
            Self::Backward { .. } => {
                let d = 1.0 + 2.0 * zeta * a + a * a;
                [[(1.0 + 2.0 * zeta * a) / d, a / d], [-a / d, 1.0 / d]]
            }
            Self::Rounds => {
                let d = 1.0 + a * a;
                [[1.0 / d, a * kept / d], [-a / d, kept / d]]
            }
        }
    }

    /// The factors of `h v` and `h v'` in `x' − x`; `None` where positions move by a velocity between the two.
    pub fn drift(self) -> Option<[f64; 2]> {
        let Self::Explicit(substeps) = self else { return Some([0.0, 1.0]) };
        let is_kick = |substep: &&Substep| !matches!(substep, Drift(_));
        let n_kicks = substeps.iter().filter(is_kick).count();
        let (mut kicks, mut factors) = (0, [0.0, 0.0]);
        for substep in substeps {
            if let Both(c) | Drift(c) = *substep {
                match kicks {
                    0 => factors[0] += c,
                    _ if kicks == n_kicks => factors[1] += c,
                    _ => return None,
                }
            }
            kicks += usize::from(is_kick(&substep));
        }
        Some(factors)
    }

    /// The method with one evaluation of the forces, where it is one and `integrator` solves it to rounding.
    pub fn one_point(integrator: &IntegratorSchema) -> Option<OnePoint> {
        match (Self::of(integrator.equation), integrator.convergence) {
            (Self::Explicit([Both(1.0)]), _) => Some(OnePoint::Explicit),
            (Self::Explicit([Kick(1.0), Drift(1.0)]), _) => Some(OnePoint::Symplectic),
            (Self::Backward { linearized: true }, _) => Some(OnePoint::Linearized),
            (Self::Backward { linearized: false }, Convergence::Update(_)) => {
                Some(OnePoint::Implicit)
            }
            _ => None,
        }
    }
}

fn product(a: [[f64; 2]; 2], b: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    let entry = |row: usize, column: usize| a[row][0] * b[0][column] + a[row][1] * b[1][column];
    [[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]]
}

/// The stable steps `h ω` of the oscillator, by Jury's criterion `|det A| ≤ 1`, `|tr A| ≤ 1 + det A`. Steps are stable up
/// to the first number, and again from the second number on. If the lower range is empty, the first number is 0; if the upper
/// range is empty, the second is infinite.
///
/// ```text
/// explicit     det = 1 − 2ζa + a²  tr = 2 − 2ζa     a ≤ 2ζ  (ζ ≤ 1)     a ≤ 2/(ζ + √(ζ² − 1))  (ζ > 1)
/// symplectic   det = 1 − 2ζa       tr = 2 − 2ζa − a²     4 − 4ζa − a² ≥ 0     a ≤ 2 (√(1 + ζ²) − ζ)
/// implicit     det = 1/(1 + 2ζa + a²), tr = (2 + 2ζa) det            any a
/// local-global det = (1 − 2ζa)/(1 + a²), tr = (2 − 2ζa)/(1 + a²)     4 − 4ζa + a² ≥ 0:  any a for ζ ≤ 1, and all
///                                                                    but 2(ζ − √(ζ²−1)) < a < 2(ζ + √(ζ²−1)) above
/// ```
///
/// Explicit Euler, overdamped: both eigenvalues `1 − a (ζ ± √(ζ²−1))` must be at least −1. Symplectic Euler: the
/// other condition, `ζ a ≤ 1`, follows, as `2ζ(√(1+ζ²) − ζ) = 2ζ/(√(1+ζ²) + ζ) < 1`.
pub fn stable_steps(equation: StepEquation, zeta: f64) -> [f64; 2] {
    let root = || (zeta * zeta - 1.0).sqrt();
    match equation {
        StepEquation::ExplicitEuler if zeta <= 1.0 => [2.0 * zeta, f64::INFINITY],
        StepEquation::ExplicitEuler => [2.0 / (zeta + root()), f64::INFINITY],
        StepEquation::SymplecticEuler => [2.0 / ((1.0 + zeta * zeta).sqrt() + zeta), f64::INFINITY],
        StepEquation::LocalGlobal if zeta > 1.0 => [2.0 / (zeta + root()), 2.0 * (zeta + root())],
        StepEquation::LocalGlobal
        | StepEquation::LinearizedImplicitEuler
        | StepEquation::ImplicitEuler => [f64::INFINITY; 2],
    }
}
