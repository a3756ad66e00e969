//! The equations of the integrators, written a second time.
//!
//! ```text
//! explicit    both      x ← x + c h v,  v ← v + c h M⁻¹ F(x, v, t)     at once
//!             kick      v ← v + c h M⁻¹ F(x, v, t)
//!             drift     x ← x + c h v,  t ← t + c h
//! stages      Vᵢ = v + h Σ aᵢⱼ Aⱼ,  Xᵢ = x + h Σ bᵢⱼ Vⱼ,  Aᵢ = M⁻¹ F(Xᵢ, Vᵢ, t + h Σ bᵢⱼ)     the end likewise
//! controlled  stages, for as many steps of as long as an estimate of the error allows
//! backward    implicit  M (v' − v) = h F(x', v', t + h),  x' = x + h v'
//!             linearized: one Newton step of it, from v' = v
//!             of a part c of the step: to x + c (x' − x), v + c (v' − v)
//! differences implicit from ŷ = y + c (y − y₋), of the rest (1 − c) h of the step, with y₋ one step before y = (x, v);
//!             the first step has no y₋, and c = 0
//! rounds      x' = x + h v' alone
//! ```
//!
//! An explicit method is a list of substeps, each from the end of the one before, or of stages, each from the start of
//! the step. From this description follow the check that a step obeys its equation
//! ([`crate::equation`]), the second stepper ([`crate::second`]), and the matrix of an oscillator's step
//! ([`Method::oscillator`]). A new [`StepEquation`] does not compile until this file states it.

use nalgebra::DMatrix;
use scene::schema::{Convergence, IntegratorSchema, StepEquation};

/// How a step is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// Substeps, one after the other, each by what is known before it.
    Explicit(&'static [Substep]),
    /// Stages, each from the start of the step by what is known before it.
    Stages(&'static Tableau),
    /// Steps of stages, whose number and length an estimate of the error decides.
    Controlled(&'static Pair),
    /// The force at the end of a part of the step; the whole step goes on along the same line.
    Backward {
        /// One Newton step in the place of a solution.
        linearized: bool,
        /// The part.
        part: f64,
    },
    /// Implicit Euler of the rest of the step, after a part of the step before is made once more.
    Differences {
        /// The part.
        repeated: f64,
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

/// Coefficients of a Runge–Kutta method, which may differ for positions and velocities.
#[derive(Debug, PartialEq)]
pub struct Tableau {
    /// The states at which forces are evaluated.
    pub stages: &'static [Stage],
    /// The end of the step, made like a stage.
    pub end: Stage,
}

/// Coefficients of a state in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stage {
    /// Of the stages' velocities in its position, its own among them. Their sum is its time in the step.
    pub position: &'static [f64],
    /// Of the stages' accelerations in its velocity.
    pub velocity: &'static [f64],
}

impl Stage {
    /// The same coefficients for both.
    const fn of(row: &'static [f64]) -> Self {
        Self { position: row, velocity: row }
    }

    /// Its time in the step, as a part of the step.
    pub fn time(&self) -> f64 {
        self.position.iter().sum()
    }
}

/// Operations of stages, in one arithmetic. Slices hold `n·D` numbers.
pub trait Arithmetic {
    /// The force at a state, at this time after the start of the step.
    fn force(&mut self, x: &[f64], v: &[f64], after: f64) -> Vec<f64>;
    /// `x ← x + h v`.
    fn drift(&self, x: &mut [f64], v: &[f64], h: f64) {
        x.iter_mut().zip(v).for_each(|(x, v)| *x += h * v);
    }
    /// `v ← v + h M⁻¹ F`, not for fixed particles.
    fn kick(&self, v: &mut [f64], force: &[f64], h: f64);
}

/// Stages that were evaluated: their velocities and forces.
#[derive(Debug, Default)]
pub struct Slopes {
    /// `Vᵢ`.
    pub velocities: Vec<Vec<f64>>,
    /// `M Aᵢ`.
    pub forces: Vec<Vec<f64>>,
}

impl Tableau {
    /// Evaluates the stages of a step of `h`.
    pub fn slopes(&self, by: &mut impl Arithmetic, h: f64, x: &[f64], v: &[f64]) -> Slopes {
        let mut slopes = Slopes::default();
        for stage in self.stages {
            let mut u = v.to_vec();
            for (c, force) in stage.velocity.iter().zip(&slopes.forces) {
                by.kick(&mut u, force, c * h);
            }
            slopes.velocities.push(u.clone());
            let mut at = x.to_vec();
            for (c, u) in stage.position.iter().zip(&slopes.velocities) {
                by.drift(&mut at, u, c * h);
            }
            slopes.forces.push(by.force(&at, &u, stage.time() * h));
        }
        slopes
    }

    /// Takes a step of `h`.
    pub fn step(&self, by: &mut impl Arithmetic, h: f64, x: &mut [f64], v: &mut [f64]) {
        let slopes = self.slopes(by, h, x, v);
        for (c, force) in self.end.velocity.iter().zip(&slopes.forces) {
            by.kick(v, force, c * h);
        }
        for (c, u) in self.end.position.iter().zip(&slopes.velocities) {
            by.drift(x, u, c * h);
        }
    }
}

/// A method with an estimate of its error.
#[derive(Debug, PartialEq)]
pub struct Pair {
    /// The method. Its last stage is the end of the step.
    pub tableau: Tableau,
    /// Coefficients of the stages in the estimate.
    pub error: &'static [f64],
    /// The order of the estimate in the step size.
    pub order: u32,
}

impl Pair {
    /// Takes a step of `h`, divided so that the estimate of every part is at most `tolerance (1 + |y|)` in every coordinate
    /// `y`. Returns the number of parts; `None` beyond 10,000 tries.
    pub fn step(
        &self,
        by: &mut impl Arithmetic,
        (h, tolerance): (f64, f64),
        x: &mut [f64],
        v: &mut [f64],
    ) -> Option<u64> {
        let (mut after, mut k, mut parts, mut longest) = (0.0, h, 0, 5.0);
        for _ in 0..10_000 {
            let is_last = k >= h - after;
            k = if is_last { h - after } else { k };
            let mut part = Part { by: &mut *by, after };
            let Slopes { velocities, forces } = self.tableau.slopes(&mut part, k, x, v);
            let (mut new_x, mut new_v) = (x.to_vec(), v.to_vec());
            let mut error = [vec![0.0; x.len()], vec![0.0; x.len()]];
            let terms = velocities.iter().zip(&forces).enumerate();
            for (number, (velocity, force)) in terms {
                let weight = self.tableau.end.velocity.get(number).copied().unwrap_or(0.0);
                by.drift(&mut new_x, velocity, weight * k);
                by.kick(&mut new_v, force, weight * k);
                by.drift(&mut error[0], velocity, self.error[number] * k);
                by.kick(&mut error[1], force, self.error[number] * k);
            }
            let ratio = |((error, start), end): ((&f64, &f64), &f64)| {
                (error / (1.0 + start.abs().max(end.abs()))).abs() / tolerance
            };
            let positions = error[0].iter().zip(&*x).zip(&new_x).map(ratio);
            let ratios = positions.chain(error[1].iter().zip(&*v).zip(&new_v).map(ratio));
            let larger = |most: f64, ratio: f64| {
                if ratio.is_nan() { f64::INFINITY } else { most.max(ratio) }
            };
            let norm = ratios.fold(0.0, larger);
            let is_taken = norm <= 1.0;
            if is_taken {
                parts += 1;
                after += k;
                x.copy_from_slice(&new_x);
                v.copy_from_slice(&new_v);
                if is_last {
                    return Some(parts);
                }
            }
            let exponent = -1.0 / f64::from(self.order);
            k *= (0.9 * norm.powf(exponent)).clamp(0.2, longest);
            longest = if is_taken { 5.0 } else { 1.0 };
        }
        None
    }
}

/// A part of a step that starts later than the step.
struct Part<'a, A> {
    by: &'a mut A,
    after: f64,
}

impl<A: Arithmetic> Arithmetic for Part<'_, A> {
    fn force(&mut self, x: &[f64], v: &[f64], after: f64) -> Vec<f64> {
        self.by.force(x, v, self.after + after)
    }

    fn drift(&self, x: &mut [f64], v: &[f64], h: f64) {
        self.by.drift(x, v, h);
    }

    fn kick(&self, v: &mut [f64], force: &[f64], h: f64) {
        self.by.kick(v, force, h);
    }
}

/// Velocity Verlet: the velocity of its second stage is that of an explicit step.
static VELOCITY_VERLET: Tableau = Tableau {
    stages: &[Stage::of(&[]), Stage { position: &[0.5, 0.5], velocity: &[1.0] }],
    end: Stage::of(&[0.5, 0.5]),
};

/// The classical Runge–Kutta method.
pub static RUNGE_KUTTA_4: Tableau = Tableau {
    stages: &[
        Stage::of(&[]),
        Stage::of(&[0.5]),
        Stage::of(&[0.0, 0.5]),
        Stage::of(&[0.0, 0.0, 1.0]),
    ],
    end: Stage::of(&[1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0]),
};

/// Dormand and Prince's pair of orders 5 and 4, from Hairer, Nørsett and Wanner, table II.5.2. The estimate is the
/// difference of its two rows of weights.
pub static DORMAND_PRINCE: Pair = Pair {
    tableau: Tableau {
        stages: &[
            Stage::of(&[]),
            Stage::of(&[0.2]),
            Stage::of(&[0.075, 0.225]),
            Stage::of(&[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0]),
            Stage::of(&[19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0]),
            Stage::of(&[
                9017.0 / 3168.0,
                -355.0 / 33.0,
                46732.0 / 5247.0,
                49.0 / 176.0,
                -5103.0 / 18656.0,
            ]),
            Stage::of(FIFTH_ORDER),
        ],
        end: Stage::of(FIFTH_ORDER),
    },
    error: &[
        FIFTH_ORDER[0] - 5179.0 / 57600.0,
        0.0,
        FIFTH_ORDER[2] - 7571.0 / 16695.0,
        FIFTH_ORDER[3] - 393.0 / 640.0,
        FIFTH_ORDER[4] + 92097.0 / 339_200.0,
        FIFTH_ORDER[5] - 187.0 / 2100.0,
        -1.0 / 40.0,
    ],
    order: 5,
};

/// The weights of order 5.
const FIFTH_ORDER: &[f64] =
    &[35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0];

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
            StepEquation::LinearizedImplicitEuler => Self::Backward { linearized: true, part: 1.0 },
            StepEquation::ImplicitEuler => Self::Backward { linearized: false, part: 1.0 },
            StepEquation::LocalGlobal => Self::Rounds,
            StepEquation::VelocityVerlet => Self::Stages(&VELOCITY_VERLET),
            StepEquation::RungeKutta4 => Self::Stages(&RUNGE_KUTTA_4),
            StepEquation::ImplicitMidpoint => Self::Backward { linearized: false, part: 0.5 },
            StepEquation::DormandPrince => Self::Controlled(&DORMAND_PRINCE),
            StepEquation::BackwardDifferentiation2 => Self::Differences { repeated: 1.0 / 3.0 },
        }
    }

    /// The method of a step, by whether there is an earlier state.
    pub fn with_earlier(self, is_there: bool) -> Self {
        match self {
            Self::Differences { .. } if !is_there => Self::Differences { repeated: 0.0 },
            other => other,
        }
    }

    /// The matrix `A` of `(x, v/ω) ← A (x, v/ω)`: a step of `x'' = −ω² x − 2 ζ ω v`, with `a = h ω`. That of a two-step
    /// method is of this state and the earlier one, `(y, y₋) ← A (y, y₋)`. Rounds are of a spring of rest length zero,
    /// whose damping is explicit. A controlled step is not divided.
    pub fn oscillator(self, a: f64, zeta: f64) -> DMatrix<f64> {
        let kept = 1.0 - 2.0 * zeta * a;
        let [[p, q], [r, s]] = match self {
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
            Self::Stages(tableau) | Self::Controlled(Pair { tableau, .. }) => {
                // Both columns: the ends of steps from (1, 0) and (0, 1).
                let column = |start: [f64; 2]| {
                    let [mut x, mut v] = start.map(|value| [value]);
                    tableau.step(&mut Oscillator { zeta }, a, &mut x, &mut v);
                    [x[0], v[0]]
                };
                let [first, second] = [column([1.0, 0.0]), column([0.0, 1.0])];
                [[first[0], second[0]], [first[1], second[1]]]
            }
            Self::Backward { part, .. } => {
                let a = part * a;
                let d = 1.0 + 2.0 * zeta * a + a * a;
                let [[p, q], [r, s]] = [[(1.0 + 2.0 * zeta * a) / d, a / d], [-a / d, 1.0 / d]];
                let whole = |entry: f64, start: f64| start + (entry - start) / part;
                [[whole(p, 1.0), whole(q, 0.0)], [whole(r, 0.0), whole(s, 1.0)]]
            }
            Self::Differences { repeated: c } => {
                let implicit = Self::Backward { linearized: false, part: 1.0 };
                let rest = implicit.oscillator((1.0 - c) * a, zeta);
                let mut companion = DMatrix::zeros(4, 4);
                companion.view_mut((0, 0), (2, 2)).copy_from(&(&rest * (1.0 + c)));
                companion.view_mut((0, 2), (2, 2)).copy_from(&(rest * -c));
                companion.view_mut((2, 0), (2, 2)).fill_with_identity();
                return companion;
            }
            Self::Rounds => {
                let d = 1.0 + a * a;
                [[1.0 / d, a * kept / d], [-a / d, kept / d]]
            }
        };
        DMatrix::from_row_slice(2, 2, &[p, q, r, s])
    }

    /// The method with one evaluation of the forces, where it is one and `integrator` solves it to rounding.
    pub fn one_point(integrator: &IntegratorSchema) -> Option<OnePoint> {
        match (Self::of(integrator.equation), integrator.convergence) {
            (Self::Explicit([Both(1.0)]), _) => Some(OnePoint::Explicit),
            (Self::Explicit([Kick(1.0), Drift(1.0)]), _) => Some(OnePoint::Symplectic),
            (Self::Backward { linearized: true, part: 1.0 }, _) => Some(OnePoint::Linearized),
            (Self::Backward { linearized: false, part: 1.0 }, Convergence::Update(_)) => {
                Some(OnePoint::Implicit)
            }
            _ => None,
        }
    }
}

/// `x'' = −x − 2 ζ x'`, of one coordinate.
struct Oscillator {
    zeta: f64,
}

impl Arithmetic for Oscillator {
    fn force(&mut self, x: &[f64], v: &[f64], _: f64) -> Vec<f64> {
        vec![-x[0] - 2.0 * self.zeta * v[0]]
    }

    fn kick(&self, v: &mut [f64], force: &[f64], h: f64) {
        v[0] += h * force[0];
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
/// Verlet       det = 1 − 2ζa + 2ζ²a² − ζa³/2    tr = 2 − 2ζa − a² + 2ζ²a² + ζa³/2       ζ a ≤ 1 (ζ > ½), and
///                                                (4ζ² − 1) a² − 4ζa + 4 ≥ 0     a ≤ 2/(ζ + √(1 − 3ζ²)) (ζ ≤ ½)
/// midpoint     det = (1 − ζa + a²/4)/(1 + ζa + a²/4), |tr| < 1 + det  any a
/// BDF2         (3/2 − z) λ² − 2λ + 1/2 = 0, z = a (−ζ ± √(ζ²−1)): |λ| ≤ 1 wherever Re z ≤ 0         any a
/// Runge–Kutta  eigenvalues R(z), z = a (−ζ ± √(ζ²−1)), R the Taylor polynomial of eᶻ of degree 4    |R(z)| ≤ 1
/// Dormand–     the same with R the Taylor polynomial of degree 5 and z⁶/600
/// Prince
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
        | StepEquation::ImplicitEuler
        | StepEquation::ImplicitMidpoint
        | StepEquation::BackwardDifferentiation2 => [f64::INFINITY; 2],
        StepEquation::VelocityVerlet if zeta > 0.5 => [1.0 / zeta, f64::INFINITY],
        StepEquation::VelocityVerlet => {
            [2.0 / (zeta + (1.0 - 3.0 * zeta * zeta).sqrt()), f64::INFINITY]
        }
        StepEquation::RungeKutta4 => [along_the_ray(&TAYLOR[..5], zeta), f64::INFINITY],
        StepEquation::DormandPrince => [along_the_ray(&TAYLOR, zeta), f64::INFINITY],
    }
}

/// Coefficients of `eᶻ` up to degree 5, and that of `z⁶` of Dormand and Prince's method.
const TAYLOR: [f64; 7] = [1.0, 1.0, 1.0 / 2.0, 1.0 / 6.0, 1.0 / 24.0, 1.0 / 120.0, 1.0 / 600.0];

/// The longest `a` with `|R(z)| ≤ 1` for `z = a (−ζ ± √(ζ²−1))` and all shorter ones, of the polynomial `R` with these
/// coefficients, the first of which is 1.
///
/// For `ζ ≤ 1`, `z = a e^{iφ}` with `cos φ = −ζ`, and `|R|² − 1` is a polynomial in `a` with the coefficients
/// `Σ r_j r_k cos (j − k)φ`, `j + k = m`: its terms that cancel do so without rounding errors of the size of 1. Beyond,
/// the larger of both `|z|` is on the negative axis. No limit is shorter than 1/2 or longer than 8 there.
fn along_the_ray(coefficients: &[f64], zeta: f64) -> f64 {
    let (angle, scale) = if zeta <= 1.0 {
        ((-zeta).acos(), 1.0)
    } else {
        (std::f64::consts::PI, zeta + (zeta * zeta - 1.0).sqrt())
    };
    let growth = |size: f64| -> f64 {
        let mut sum = 0.0;
        for m in (1..=2 * (coefficients.len() - 1)).rev() {
            let of = |j: usize| {
                let pair = Some((coefficients.get(j)?, coefficients.get(m - j)?));
                pair.map(|(a, b)| a * b * ((2.0 * j as f64 - m as f64) * angle).cos())
            };
            sum = sum * size + (0..=m).filter_map(of).sum::<f64>();
        }
        sum
    };
    let sizes = (32..=512).map(|number| f64::from(number) / 64.0);
    let mut limit = [0.0, f64::INFINITY];
    for size in sizes {
        if growth(size) > 0.0 {
            limit[1] = size;
            break;
        }
        limit[0] = size;
    }
    for _ in 0..60 {
        let middle = 0.5 * (limit[0] + limit[1]);
        limit[usize::from(growth(middle) > 0.0)] = middle;
    }
    limit[0] / scale
}
