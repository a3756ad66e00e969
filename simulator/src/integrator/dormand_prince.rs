//! Dormand and Prince's pair of orders 5 and 4, with error control: a time step is made of as many steps as a tolerance
//! needs.
//!
//! ```text
//! vᵢ = v + k Σ aᵢⱼ Aⱼ,  xᵢ = x + k Σ aᵢⱼ vⱼ,  Aᵢ = M⁻¹ F(xᵢ, vᵢ, t + cᵢ k)        i = 1 … 7, the seventh is the end
//! e = k Σ eⱼ (vⱼ, Aⱼ)                         order 5 less order 4
//! ‖e‖ = max |e|/(tolerance (1 + |y|))         over all coordinates y, at the start or the end, whichever is larger
//! ‖e‖ ≤ 1: the step is taken                  k ← k min(5, max(1/5, 0.9 ‖e‖^(−1/5))), not longer after a rejected step
//! ```
//!
//! The first `k` is the whole time step `h`, and no `k` is longer than what is left of it: states are those at multiples
//! of `h`, and a step depends on nothing but its start. With a tolerance that every step meets, this is a method of order
//! 5 with six force evaluations a step, one more at the start. The end of a step is the first stage of the next one.
//!
//! The error is that of one step, estimated by that of order 4. It adds up over a motion. Source: Dormand and Prince
//! (1980); Hairer, Nørsett and Wanner, *Solving Ordinary Differential Equations I*, sections II.4 and II.5, table 5.2.

use sparse::linear::LinearSolver;

use super::{Integrator, IntegratorKind, Interrupt, Step, StepError, drift, kick};
use crate::system::System;
use scene::Scene;
use scene::schema::{
    AccuracySetting, Convergence, Domain, Family, IntegratorSchema, Matrix, OptionKind,
    OptionSchema, OptionText, Order, StepEquation, refuses_nothing,
};

pub(super) static KIND: IntegratorKind = IntegratorKind {
    schema: IntegratorSchema {
        name: "dormand-prince",
        aliases: &["rk45"],
        summary: "Dormand and Prince's pair of orders 5 and 4, with error control",
        formula: "Dormand and Prince's pair of orders 5 and 4: `h` is divided into steps whose estimated error is at most `tolerance (1 + abs(y))` in each coordinate `y` of `q` and `v`; a next step is `0.9 ‖e‖^(−1/5)` times as long, at most 5 times and at least a fifth",
        equation: StepEquation::DormandPrince,
        family: Family::Explicit,
        matrix: Matrix::None,
        convergence: Convergence::ErrorEstimate("tolerance"),
        order: Order::always(5),
        options: &[OptionSchema {
            name: "tolerance",
            meaning: "the largest estimated error of a step, absolute and relative",
            kind: OptionKind::Number { domain: Domain::Positive, default: 1e-8 },
            formats: OptionText {
                values: "number above 0",
                meaning: "the largest estimated error of a step in a coordinate `y`, divided by `1 + abs(y)`",
            },
            accuracy: &[
                AccuracySetting { value: "1e-6", converges: false },
                AccuracySetting { value: "1e-10", converges: false },
                // Every step meets it.
                AccuracySetting { value: "1e9", converges: true },
            ],
        }],
        refuses: refuses_nothing,
    },
    build_2d: build::<2>,
    build_3d: build::<3>,
};

/// Coefficients of each stage after the first. The last row is the end of the step.
const ROWS: [&[f64]; STAGES - 1] = [
    &[1.0 / 5.0],
    &[3.0 / 40.0, 9.0 / 40.0],
    &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0],
    &[19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0],
    &[9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
    &[35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];

/// Times of the stages after the first, as parts of a step.
const TIMES: [f64; STAGES - 1] = [1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0, 1.0];

/// Coefficients of the estimated error.
const ERROR: [f64; STAGES] = [
    71.0 / 57600.0,
    0.0,
    -71.0 / 16695.0,
    71.0 / 1920.0,
    -17253.0 / 339_200.0,
    22.0 / 525.0,
    -1.0 / 40.0,
];

const STAGES: usize = 7;

/// The most steps, taken or rejected, in a time step.
const MAX_TRIALS: u64 = 10_000;

fn build<const D: usize>(
    scene: &Scene,
    system: &System<D>,
    _: LinearSolver,
) -> Box<dyn Integrator<D>> {
    let zeros = || vec![0.0; system.n_particles() * D];
    let all = || std::array::from_fn(|_| zeros());
    Box::new(DormandPrince {
        tolerance: scene.integrator_options.number("tolerance"),
        start: zeros(),
        rates: [all(), all()],
        end: [zeros(), zeros()],
        error: zeros(),
        force: zeros(),
        interrupt: Interrupt::default(),
    })
}

struct DormandPrince {
    tolerance: f64,
    /// Positions at the start of the time step.
    start: Vec<f64>,
    /// Velocities and accelerations of the stages.
    rates: [[Vec<f64>; STAGES]; 2],
    /// Positions and velocities of the stage; after all of them, of the end of the step.
    end: [Vec<f64>; 2],
    error: Vec<f64>,
    force: Vec<f64>,
    interrupt: Interrupt,
}

impl DormandPrince {
    /// Evaluates the force at `end` as that of a stage.
    fn evaluate<const D: usize>(
        &mut self,
        system: &System<D>,
        stage: usize,
        time: f64,
    ) -> Result<(), StepError> {
        let Self { rates: [velocities, accelerations], end: [x, v], force, .. } = self;
        system.force(x, v, time, force)?;
        velocities[stage].copy_from_slice(v);
        accelerations[stage].fill(0.0);
        kick(system, force, 1.0, &mut accelerations[stage]);
        Ok(())
    }

    /// The stages after the first of a step of `k` from `state`; the end of the step is then in `end`.
    fn stages<const D: usize>(
        &mut self,
        system: &System<D>,
        (time, k): (f64, f64),
        state: [&[f64]; 2],
    ) -> Result<(), StepError> {
        for (number, row) in ROWS.iter().enumerate() {
            for ((end, start), rates) in self.end.iter_mut().zip(state).zip(&self.rates) {
                end.copy_from_slice(start);
                for (coefficient, rate) in row.iter().zip(rates) {
                    drift(end, rate, coefficient * k);
                }
            }
            self.evaluate(system, number + 1, time + TIMES[number] * k)?;
        }
        Ok(())
    }

    /// `‖e‖` of a step of `k` from `state`; NaN if a number is not finite.
    fn norm(&mut self, k: f64, state: [&[f64]; 2]) -> f64 {
        let mut worst = 0.0;
        for ((rates, start), end) in self.rates.iter().zip(state).zip(&self.end) {
            self.error.fill(0.0);
            for (coefficient, rate) in ERROR.iter().zip(rates) {
                drift(&mut self.error, rate, coefficient * k);
            }
            for ((error, start), end) in self.error.iter().zip(start).zip(end) {
                let size = 1.0 + start.abs().max(end.abs());
                let ratio = error.abs() / (self.tolerance * size);
                if ratio > worst || ratio.is_nan() {
                    worst = ratio;
                }
            }
        }
        worst
    }
}

impl<const D: usize> Integrator<D> for DormandPrince {
    fn step(&mut self, system: &System<D>, step: Step<'_>) -> Result<(), StepError> {
        let Step { size: h, mut time, positions, velocities, statistics, .. } = step;
        self.start.copy_from_slice(positions);
        self.end[0].copy_from_slice(positions);
        self.end[1].copy_from_slice(velocities);
        self.evaluate(system, 0, time)?;
        statistics.force_evaluations += 1;
        let (mut k, mut left, mut taken, mut longest) = (h, h, 0, 5.0);
        for trial in 1.. {
            self.interrupt.check()?;
            k = left.min(k);
            self.stages(system, (time, k), [&*positions, &*velocities])?;
            statistics.force_evaluations += ROWS.len() as u64;
            let norm = self.norm(k, [&*positions, &*velocities]);
            let is_taken = norm <= 1.0;
            if is_taken {
                taken += 1;
                positions.copy_from_slice(&self.end[0]);
                velocities.copy_from_slice(&self.end[1]);
                for rates in &mut self.rates {
                    rates.swap(0, STAGES - 1);
                }
                time += k;
                left -= k;
                if left == 0.0 {
                    statistics.control.add(taken, trial - taken);
                    break;
                }
            }
            if trial == MAX_TRIALS {
                return Err(StepError::ErrorControl { trials: trial, size: k });
            }
            // Of a NaN, the shortest.
            let factor = 0.9 * norm.powf(-0.2);
            k *= if factor >= 0.2 { factor.min(longest) } else { 0.2 };
            longest = if is_taken { 5.0 } else { 1.0 };
        }
        // Not the sum of steps, whose rounding differs.
        for (particle, _) in system.fixed().iter().enumerate().filter(|(_, fixed)| **fixed) {
            let own = particle * D..(particle + 1) * D;
            positions[own.clone()].copy_from_slice(&self.start[own.clone()]);
            drift(&mut positions[own.clone()], &velocities[own], h);
        }
        Ok(())
    }

    fn interrupt_by(&mut self, interrupt: &Interrupt) {
        self.interrupt = interrupt.clone();
    }
}
