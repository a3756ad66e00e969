//! Explicit and symplectic Euler: one evaluation of the forces, then one pass over the particles.

use std::ops::Range;

use pulp::Simd;

use super::{Integrator, Step, StepError};
use crate::system::System;

/// The method: positions move with the velocities after the kick if `SYMPLECTIC`, else with those before it.
pub(super) struct Euler<const SYMPLECTIC: bool> {
    force: Vec<f64>,
    /// The mass of each coordinate's particle.
    masses: Vec<f64>,
    /// Whether the end of the last step is finite.
    is_finite: bool,
}

impl<const SYMPLECTIC: bool> Euler<SYMPLECTIC> {
    pub(super) fn new<const D: usize>(system: &System<D>) -> Self {
        let masses: Vec<f64> = system.masses().iter().flat_map(|mass| [*mass; D]).collect();
        Self { force: vec![0.0; masses.len()], masses, is_finite: false }
    }
}

/// The kick and the drift of a range of particles.
struct Advance<'a, const D: usize, const SYMPLECTIC: bool> {
    euler: &'a Euler<SYMPLECTIC>,
    system: &'a System<D>,
    h: f64,
    particles: Range<usize>,
    positions: &'a mut [f64],
    velocities: &'a mut [f64],
}

impl<const D: usize, const SYMPLECTIC: bool> pulp::WithSimd for Advance<'_, D, SYMPLECTIC> {
    /// Whether all numbers are finite.
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        let Self { euler, system, h, particles: Range { start, end }, positions, velocities } =
            self;
        let within = |range: &Range<usize>| {
            let (from, to) = (range.start.max(start), range.end.min(end));
            (from < to).then(|| (from * D..to * D, (from - start) * D..(to - start) * D))
        };
        // Of `a − a`: zero unless an `a` is infinite or NaN.
        let mut sum = simd.splat_f64s(0.0);
        let mut rest_is_finite = true;
        for (all, own) in system.free().iter().filter_map(within) {
            let (x, x_rest) = S::as_mut_simd_f64s(&mut positions[own.clone()]);
            let (v, v_rest) = S::as_mut_simd_f64s(&mut velocities[own]);
            let (force, force_rest) = S::as_simd_f64s(&euler.force[all.clone()]);
            let (mass, mass_rest) = S::as_simd_f64s(&euler.masses[all]);
            let h_all = simd.splat_f64s(h);
            for (((x, v), force), mass) in x.iter_mut().zip(v).zip(force).zip(mass) {
                let kick = simd.mul_f64s(h_all, simd.div_f64s(*force, *mass));
                let kicked = simd.add_f64s(*v, kick);
                let moving = if SYMPLECTIC { kicked } else { *v };
                let moved = simd.add_f64s(*x, simd.mul_f64s(h_all, moving));
                (*x, *v) = (moved, kicked);
                sum = simd.add_f64s(sum, simd.sub_f64s(moved, moved));
                sum = simd.add_f64s(sum, simd.sub_f64s(kicked, kicked));
            }
            for (((x, v), force), mass) in
                x_rest.iter_mut().zip(v_rest).zip(force_rest).zip(mass_rest)
            {
                let kicked = *v + h * (force / mass);
                *x += h * if SYMPLECTIC { kicked } else { *v };
                *v = kicked;
                rest_is_finite &= x.is_finite() & v.is_finite();
            }
        }
        for (_, own) in system.held().iter().filter_map(within) {
            for (x, v) in positions[own.clone()].iter_mut().zip(&velocities[own]) {
                *x += h * v;
                rest_is_finite &= x.is_finite();
            }
        }
        rest_is_finite && simd.reduce_sum_f64s(sum) == 0.0
    }
}

impl<const D: usize, const SYMPLECTIC: bool> Integrator<D> for Euler<SYMPLECTIC> {
    fn step(&mut self, system: &System<D>, step: Step<'_>) -> Result<(), StepError> {
        let Step { size, time, positions, velocities, statistics, .. } = step;
        system.force(positions, velocities, time, &mut self.force)?;
        statistics.force_evaluations += 1;
        let (euler, arch) = (&*self, pulp::Arch::new());
        let advance = |particles, [positions, velocities]: [&mut [f64]; 2]| {
            arch.dispatch(Advance { euler, system, h: size, particles, positions, velocities })
        };
        let all = |left, right| left & right;
        self.is_finite = system.parts().map(D, [positions, velocities], advance, all);
        Ok(())
    }

    fn is_finite(&self) -> bool {
        self.is_finite
    }
}
