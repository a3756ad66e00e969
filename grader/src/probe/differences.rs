//! Measures a program's force and its derivatives from explicit steps.
//!
//! One step of explicit or symplectic Euler with `h = 1` from `(x, v)` gives `F = M (v' − v)`. In a difference table,
//! central differences at five distances from 1/16 to 1/256 along each coordinate of a group are extrapolated
//! (C. J. F. Ridders, *Accurate computation of F'(x)*, 1982). The table's entry with the least sum of error estimate
//! and noise is used. A table has 20 D (D + 1) + 9 groups.

use nalgebra::DMatrix;
use rayon::prelude::*;
use scene::{Dimension, Scene};
use simulator::force::{ElementJacobians, ForceKind, JacobianSink};
use simulator::system::{BuildForce, System};

use super::noise::{self, DIFFERENCE};
use super::scenes::{Elements, Group, chain, scene};
use super::stepper::Stepper;
use crate::verdict::Failure;

/// Number of distances of the central differences, each half of the one before.
const LEVELS: usize = 5;

/// The largest distance.
const WIDEST: f64 = 1.0 / 16.0;

/// Most coordinates in a run of explicit steps. A program may need memory with their square.
const MOST_EXPLICIT: usize = 3000;

/// Most coordinates in a run of implicit steps: one state in space. A program may need time with their cube.
const MOST_IMPLICIT: usize = 312;

/// Time step of the explicit steps; a power of two.
pub(super) const EXPLICIT_STEP: f64 = 1.0;

/// Numbers, each with an error bound.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Estimate {
    pub(super) value: DMatrix<f64>,
    pub(super) bound: DMatrix<f64>,
}

impl Estimate {
    pub(super) fn zeros(size: usize) -> Self {
        Self { value: DMatrix::zeros(size, size), bound: DMatrix::zeros(size, size) }
    }

    /// The difference; the bounds are added.
    pub(super) fn minus(&self, other: &Self) -> Self {
        Self { value: &self.value - &other.value, bound: &self.bound + &other.bound }
    }

    /// `a self + b other`.
    pub(super) fn combine(&self, a: f64, other: &Self, b: f64) -> Self {
        Self {
            value: &self.value * a + &other.value * b,
            bound: &self.bound * a.abs() + &other.bound * b.abs(),
        }
    }
}

/// A force and its derivatives at one state: the program's, and ours.
#[derive(Debug, Clone)]
pub(super) struct Differences {
    /// Groups at which the force was measured, with the program's force and ours.
    pub(super) samples: Vec<Sample>,
    /// `∂F/∂x` and `∂F/∂v` of the program's force, by finite differences.
    pub(super) by_position: Estimate,
    pub(super) by_velocity: Estimate,
    /// Our Jacobians.
    pub(super) ours: [DMatrix<f64>; 2],
    /// Noise of a force component.
    pub(super) noise: f64,
}

/// A force on a group.
#[derive(Debug, Clone)]
pub(super) struct Sample {
    pub(super) group: Group,
    pub(super) force: Vec<f64>,
    pub(super) ours: Vec<f64>,
}

/// A program with the integrator names that it accepts.
#[derive(Clone, Copy)]
pub(super) struct Offer<'a> {
    pub(super) stepper: &'a dyn Stepper,
    pub(super) dimension: Dimension,
    pub(super) explicit: &'a str,
    /// Linearized implicit Euler; `None` if the program does not offer it.
    pub(super) implicit: Option<&'a str>,
}

impl Offer<'_> {
    /// Number of coordinates of a group.
    pub(super) fn size(&self) -> usize {
        chain(self.dimension) * self.dimension.count()
    }

    /// Steps groups in as few runs as hold them.
    fn in_runs<T: Send>(
        &self,
        groups: &[Group],
        most: usize,
        run: impl Fn(&[Group]) -> Result<Vec<T>, Failure> + Sync,
    ) -> Result<Vec<T>, Failure> {
        let runs = (groups.len() * self.size()).div_ceil(most).max(1);
        let each = groups.len().div_ceil(runs).max(1);
        let found: Result<Vec<Vec<T>>, Failure> = groups.par_chunks(each).map(&run).collect();
        Ok(found?.into_iter().flatten().collect())
    }

    /// The force on each group.
    pub(super) fn samples(
        &self,
        elements: &[Elements],
        groups: &[Group],
    ) -> Result<Vec<Sample>, Failure> {
        let (size, count) = (self.size(), self.dimension.count());
        self.in_runs(groups, MOST_EXPLICIT, |groups| {
            let scene = scene(self.dimension, elements, groups, EXPLICIT_STEP, false);
            let after = self.stepper.step(&scene, self.explicit)?;
            // Of the same scene: wind depends on the box around all its particles.
            let ours = our_force(&scene);
            let forces = after.chunks_exact(size).zip(ours.chunks_exact(size));
            let samples = groups.iter().zip(forces).map(|(group, (after, ours))| {
                let change = after.iter().zip(&group.state.velocities).map(|(after, v)| after - v);
                let kicks = change.enumerate();
                let force =
                    kicks.map(|(i, dv)| group.masses[i / count] * dv / EXPLICIT_STEP).collect();
                Sample { group: group.clone(), force, ours: ours.to_vec() }
            });
            Ok(samples.collect())
        })
    }

    /// `v' − v` of each group by a step of linearized implicit Euler, of this name.
    pub(super) fn changes(
        &self,
        implicit: &str,
        elements: &[Elements],
        groups: &[Group],
        h: f64,
    ) -> Result<Vec<Vec<f64>>, Failure> {
        self.in_runs(groups, MOST_IMPLICIT, |groups| {
            let scene = scene(self.dimension, elements, groups, h, true);
            let after = self.stepper.step(&scene, implicit)?;
            let changes = after.chunks_exact(self.size()).zip(groups).map(|(after, group)| {
                after.iter().zip(&group.state.velocities).map(|(after, v)| after - v).collect()
            });
            Ok(changes.collect())
        })
    }

    /// The force and its derivatives at each of the `centers`, and the force on the `others`.
    pub(super) fn differences(
        &self,
        elements: &[Elements],
        centers: &[Group],
        others: &[Group],
    ) -> Result<(Vec<Differences>, Vec<Sample>), Failure> {
        let mut groups: Vec<Group> = centers.iter().flat_map(|center| self.table(center)).collect();
        groups.extend_from_slice(others);
        let mut samples = self.samples(elements, &groups)?.into_iter();
        let n_samples = noise::LINE + 4 * LEVELS * self.size();
        let found = centers.iter().map(|center| {
            let table = samples.by_ref().take(n_samples).collect();
            self.differences_of(elements, center, table)
        });
        Ok((found.collect(), samples.collect()))
    }

    /// A line of states and the states of the differences around a group's state, with its masses.
    fn table(&self, center: &Group) -> Vec<Group> {
        let state = &center.state;
        let mut states = noise::line(state, self.dimension);
        let size = self.size();
        for index in 0..2 * size {
            for level in 0..LEVELS {
                for sign in [1.0, -1.0] {
                    let mut moved = state.clone();
                    let values =
                        if index < size { &mut moved.positions } else { &mut moved.velocities };
                    values[index % size] += sign * distance(level);
                    states.push(moved);
                }
            }
        }
        let states = states.into_iter();
        states.map(|state| Group { state, masses: center.masses.clone() }).collect()
    }

    /// The force and its derivatives from the samples of a table.
    fn differences_of(
        &self,
        elements: &[Elements],
        center: &Group,
        samples: Vec<Sample>,
    ) -> Differences {
        let size = self.size();
        let forces = |samples: &[Sample]| -> Vec<Vec<f64>> {
            samples.iter().map(|sample| sample.force.clone()).collect()
        };
        let (line, table) = samples.split_at(noise::LINE);
        let fastest = samples.iter().flat_map(|sample| {
            let masses = sample.group.masses.iter().copied().fold(1.0, f64::max);
            let after = sample.force.iter().zip(&sample.group.state.velocities);
            after.map(move |(force, v)| masses * (force.abs() + v.abs()))
        });
        let rounding = noise::ROUNDING * fastest.fold(0.0, f64::max);
        let noise = noise::variance(&forces(line)).sqrt().max(rounding);
        let mut jacobians = [Estimate::zeros(size), Estimate::zeros(size)];
        for (index, column) in forces(table).chunks_exact(2 * LEVELS).enumerate() {
            let jacobian = &mut jacobians[index / size];
            for row in 0..size {
                let (value, bound) = extrapolate(column, row, noise);
                jacobian.value[(row, index % size)] = value;
                jacobian.bound[(row, index % size)] = bound;
            }
        }
        let [by_position, by_velocity] = jacobians;
        let center = std::slice::from_ref(center);
        let ours = our_jacobians(&scene(self.dimension, elements, center, EXPLICIT_STEP, false));
        Differences { samples, by_position, by_velocity, ours, noise }
    }
}

fn distance(level: usize) -> f64 {
    WIDEST / f64::from(1_u32 << level)
}

/// The derivative of component `row` from samples `F(+d₀), F(−d₀), F(+d₁), …`, with an error bound.
fn extrapolate(samples: &[Vec<f64>], row: usize, noise: f64) -> (f64, f64) {
    let mut best = (0.0, f64::INFINITY);
    let mut last: Vec<(f64, f64)> = Vec::new();
    for (level, pair) in samples.chunks_exact(2).enumerate() {
        let slope = (pair[0][row] - pair[1][row]) / (2.0 * distance(level));
        let mut line = vec![(slope, noise / distance(level))];
        let mut power = 1.0;
        for (order, (coarser, coarser_noise)) in last.iter().enumerate() {
            power *= 4.0;
            let (finer, finer_noise) = line[order];
            let value = (power * finer - coarser) / (power - 1.0);
            let share = (power * finer_noise + coarser_noise) / (power - 1.0);
            let error = (value - finer).abs().max((value - coarser).abs());
            let bound = error + DIFFERENCE * share;
            if bound < best.1 {
                best = (value, bound);
            }
            line.push((value, share));
        }
        last = line;
    }
    best
}

/// Our force on every particle of a scene at its start; NaN where it is undefined.
fn our_force(scene: &Scene) -> Vec<f64> {
    match scene.dimension {
        Dimension::Two => force_of::<2>(scene),
        Dimension::Three => force_of::<3>(scene),
    }
}

fn force_of<const D: usize>(scene: &Scene) -> Vec<f64>
where
    ForceKind: BuildForce<D>,
{
    let (x, v) = (scene.positions(), scene.velocities());
    let mut force = vec![0.0; x.len()];
    if System::<D>::new(scene).force(&x, &v, 0.0, &mut force).is_err() {
        force.fill(f64::NAN);
    }
    force
}

/// Our Jacobians by position and velocity at a scene's start.
fn our_jacobians(scene: &Scene) -> [DMatrix<f64>; 2] {
    match scene.dimension {
        Dimension::Two => jacobians_of::<2>(scene),
        Dimension::Three => jacobians_of::<3>(scene),
    }
}

fn jacobians_of<const D: usize>(scene: &Scene) -> [DMatrix<f64>; 2]
where
    ForceKind: BuildForce<D>,
{
    let (x, v) = (scene.positions(), scene.velocities());
    let mut matrices =
        Matrices([DMatrix::zeros(x.len(), x.len()), DMatrix::zeros(x.len(), x.len())]);
    if System::<D>::new(scene).jacobians(&x, &v, 0.0, &mut matrices).is_err() {
        matrices.0.iter_mut().for_each(|matrix| matrix.fill(f64::NAN));
    }
    matrices.0
}

struct Matrices([DMatrix<f64>; 2]);

impl<const D: usize> JacobianSink<D> for Matrices {
    fn add(&mut self, element: ElementJacobians<'_, D>) {
        let [by_position, by_velocity] = &mut self.0;
        for (matrix, blocks) in
            [(by_position, element.by_position), (by_velocity, element.by_velocity)]
        {
            element.spread(blocks, |row, column, block| {
                let mut view = matrix.fixed_view_mut::<D, D>(row * D, column * D);
                view += block;
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::noise::CLEAR;
    use super::super::scenes::{Steps, parts, states};
    use super::super::stepper::BuiltIn;
    use super::*;

    #[test]
    fn finite_differences_are_within_narrow_bounds() {
        for dimension in [Dimension::Two, Dimension::Three] {
            let offer =
                Offer { stepper: &BuiltIn, dimension, explicit: "explicit-euler", implicit: None };
            for part in parts(dimension).filter(|part| part.steps != Steps::None) {
                let centers = Group::of_unit_masses(&states(dimension), dimension);
                let (found, _) = offer.differences(&[part.full], &centers, &[]).unwrap();
                assert_eq!(found.len(), centers.len());
                for found in found {
                    for (estimate, ours) in
                        [&found.by_position, &found.by_velocity].into_iter().zip(&found.ours)
                    {
                        let error = (&estimate.value - ours).abs();
                        let excess = error.component_div(&estimate.bound).max();
                        assert!(excess < 1.0, "{} {}: {excess}", part.force, part.name);
                        // Narrow enough to detect an error of a millionth of an entry.
                        let scale = ours.amax().max(1.0);
                        let width = CLEAR * estimate.bound.amax() / scale;
                        assert!(width < 1e-8, "{} {}: {width:e}", part.force, part.name);
                    }
                }
            }
        }
    }
}
