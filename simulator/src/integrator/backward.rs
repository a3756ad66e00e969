//! Linearized backward Euler: the linear system of all implicit methods.
//!
//! With an iterate `u` of the new velocity, and force and Jacobians at `(q + h u, u)`,
//!
//! ```text
//! (M − h² ∂F/∂x − h ∂F/∂v) δ = M (v − u) + h F          u ← u + δ
//! ```
//!
//! Equation (1) of the hand-out of milestone 3; its equation (2) is the case `u = v`. Fixed degrees of
//! freedom are left out of the system rather than solved for, which gives them `δ = 0` as clearing
//! their rows and columns would (section 9).
//!
//! If the Jacobians of a scene are the same at every state, so is the matrix at a given `h`: it is assembled and
//! factorised once.
//!
//! Where `h² ∂F/∂x + h ∂F/∂v` is larger than `M` by many orders, the sum that is stored has lost the digits
//! of `M`, and no residual of the stored matrix can tell. The solution is then refined with residuals that
//! never form the sum: each element's contribution is its block times the *difference* of its two particles'
//! `δ`, so that motions which stretch nothing cancel exactly.

use sparse::LinearError;
use sparse::linear::{BlockMatrix, ElementSlot, LinearSolver, Link, PairSlot};
use sparse::statistics::LinearStatistics;

use super::StepError;
use super::interrupt::Interrupt;
use super::observe::{NewtonSystem, Observer};
use crate::force::{
    Block, Coupling, Degenerate, ElementJacobians, JacobianSink, Vector, add_to, vector_of,
};
use crate::solver::psd::Projection;
use crate::statistics::{NEARLY_SINGULAR, Statistics};
use crate::system::System;
use scene::Particles;

/// Ratio of stiffness to mass above which the stored sum is not trusted: about 2e-12 of `M` would be lost.
const STIFF_RATIO: f64 = 1e4;

/// Maximum number of refinements.
const MAX_REFINEMENTS: usize = 10;

/// A correction this small a part of the solution is rounding.
const CONVERGED: f64 = 4.0 * f64::EPSILON;

/// A force that is rounded is wrong by this part of itself, in directions that its stiffness does not
/// hold; a stiffness in units of mass multiplies it. Corrections settle there, whatever the solver.
const FORCE_ROUNDING: f64 = 64.0 * f64::EPSILON;

/// Largest relative correction that is ever accepted.
const MAX_CORRECTION: f64 = 1e-2;

/// Workspace for the linearisation of one system.
pub(super) struct Linearisation<const D: usize> {
    /// `q + h u`.
    trial: Vec<f64>,
    force: Vec<f64>,
    /// Number of each particle among the free ones.
    free: Vec<Option<usize>>,
    matrix: BlockMatrix<D>,
    /// The pairs of free particles, in the order in which their Jacobians come.
    slots: Vec<PairLocation>,
    /// The elements of other stencils, likewise.
    stencil_slots: Vec<StencilLocation>,
    /// Right-hand side and solution, of the free particles only.
    reduced: Vec<f64>,
    /// The smallest mass of a free particle.
    smallest_mass: f64,
    curvature: Curvature,
    /// Whether the matrix depends on `h` alone, and the `h` of the one that is kept.
    is_constant: bool,
    kept: Option<f64>,
    /// Largest entry of a contribution to the matrix, relative to the smallest mass.
    stiffness: f64,
    elements: Elements<D>,
    /// l2 norm of the last right-hand side.
    pub(super) residual: f64,
    /// Allocated at the first stiff step.
    stiff: Option<StiffWorkspace>,
    observer: Option<Observer>,
    interrupt: Interrupt,
}

/// Where the blocks of a pair of particles are in the matrix.
#[derive(Clone, Copy)]
struct PairLocation {
    particles: [u32; 2],
    place: Option<PairSlot>,
}

/// Where the blocks of an element are in the matrix.
struct StencilLocation {
    /// The origin comes last.
    particles: Particles,
    place: Option<ElementSlot>,
}

impl StencilLocation {
    fn is_of<const D: usize>(&self, element: &ElementJacobians<'_, D>) -> bool {
        self.particles.iter().eq(element.particles.iter().chain(&element.origin))
    }
}

/// Workspace for refining a stiff system.
struct StiffWorkspace {
    right: Vec<f64>,
    solution: Vec<f64>,
    product: Vec<f64>,
}

/// The Jacobians in the matrix, exact or approximate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Curvature {
    /// The Jacobians, each element's contribution projected. Projected elements must be symmetric.
    Jacobians(Projection),
    /// Gauss–Newton's approximations of them.
    GaussNewton,
    /// Nothing: the matrix is that of the masses.
    Mass,
}

impl Curvature {
    fn projection(self) -> Projection {
        match self {
            Self::Jacobians(projection) => projection,
            Self::GaussNewton | Self::Mass => Projection::None,
        }
    }

    fn add<const D: usize>(
        self,
        system: &System<D>,
        [positions, velocities]: [&[f64]; 2],
        time: f64,
        sink: &mut dyn JacobianSink<D>,
    ) -> Result<(), Degenerate> {
        match self {
            Self::Jacobians(_) => system.jacobians(positions, velocities, time, sink),
            Self::GaussNewton => system.gauss_newton(positions, velocities, time, sink),
            Self::Mass => Ok(()),
        }
    }
}

/// Where a linearisation is made: the state the step starts from, and the iterate.
#[derive(Clone, Copy)]
pub(super) struct Point<'a> {
    pub(super) h: f64,
    /// The end of the step.
    pub(super) time: f64,
    pub(super) positions: &'a [f64],
    pub(super) velocities: &'a [f64],
    /// `u`.
    pub(super) iterate: &'a [f64],
}

impl<const D: usize> Linearisation<D> {
    pub(super) fn new(system: &System<D>, choice: LinearSolver) -> Self {
        let mut free = vec![None; system.n_particles()];
        let mut n_free = 0;
        for (number, fixed) in free.iter_mut().zip(system.fixed()) {
            if !fixed {
                *number = Some(n_free);
                n_free += 1;
            }
        }
        let mut links = Vec::new();
        system.couplings(&mut |coupling| {
            if let Coupling::Stencil { particles, symmetric } = coupling {
                let blocks: Vec<usize> = particles.iter().filter_map(|each| free[*each]).collect();
                let link = |blocks| Link { blocks, symmetric };
                for (place, block) in blocks.iter().enumerate() {
                    links.extend(blocks[place + 1..].iter().map(|other| link([*block, *other])));
                }
                if let [block] = blocks[..] {
                    links.push(link([block, block]));
                }
            }
        });
        let mut matrix = BlockMatrix::new(n_free, &links, choice);
        let (mut slots, mut stencil_slots) = (Vec::new(), Vec::new());
        system.couplings(&mut |coupling| {
            let Coupling::Stencil { particles, .. } = coupling else { return };
            if let [i, j] = particles[..] {
                let place = match [i, j].map(|particle| free[particle]) {
                    [Some(i), Some(j)] => matrix.pair_slot([i, j]),
                    _ => None,
                };
                slots.push(PairLocation { particles: [i as u32, j as u32], place });
            } else {
                let members: Vec<_> = particles.iter().map(|particle| free[*particle]).collect();
                let place = matrix.element_slot(&members);
                stencil_slots.push(StencilLocation { particles, place });
            }
        });
        Self {
            trial: vec![0.0; system.n_particles() * D],
            force: vec![0.0; system.n_particles() * D],
            matrix,
            slots,
            stencil_slots,
            reduced: vec![0.0; n_free * D],
            smallest_mass: system
                .masses()
                .iter()
                .zip(system.fixed())
                .filter(|(_, fixed)| !**fixed)
                .fold(f64::INFINITY, |smallest_mass, (mass, _)| smallest_mass.min(*mass)),
            free,
            curvature: Curvature::Jacobians(Projection::None),
            is_constant: system.has_constant_jacobians(),
            kept: None,
            stiffness: 0.0,
            elements: Elements::default(),
            residual: 0.0,
            stiff: None,
            observer: None,
            interrupt: Interrupt::default(),
        }
    }

    /// Hands every later system to `observer` before it is solved.
    pub(super) fn observe(&mut self, observer: Observer) {
        self.observer = Some(observer);
    }

    /// Refuses every later system once `interrupt` is raised.
    pub(super) fn interrupt_by(&mut self, interrupt: &Interrupt) {
        self.interrupt = interrupt.clone();
    }

    /// The same with another matrix than that of the Jacobians.
    pub(super) fn with_curvature(mut self, curvature: Curvature) -> Self {
        self.is_constant = match curvature {
            Curvature::Jacobians(_) => self.is_constant,
            Curvature::GaussNewton => false,
            Curvature::Mass => true,
        };
        self.curvature = curvature;
        self
    }

    /// Solves the linearisation at `point` for `delta`.
    pub(super) fn solve(
        &mut self,
        system: &System<D>,
        Point { h, time, positions, velocities, iterate }: Point<'_>,
        delta: &mut [f64],
        statistics: &mut Statistics,
    ) -> Result<(), StepError> {
        self.interrupt.check()?;
        if statistics.linear_solver.is_empty() {
            statistics.linear_solver = self.matrix.describe();
        }
        self.trial.copy_from_slice(positions);
        super::drift(&mut self.trial, iterate, h);

        system.force(&self.trial, iterate, time, &mut self.force)?;
        statistics.force_evaluations += 1;

        // The largest change of a velocity by the same right-hand side with the masses alone.
        let mut kick: f64 = 0.0;
        for (particle, mass) in system.masses().iter().enumerate() {
            let Some(number) = self.free[particle] else { continue };
            let mut largest: f64 = 0.0;
            for axis in 0..D {
                let dof = particle * D + axis;
                let right = mass * (velocities[dof] - iterate[dof]) + h * self.force[dof];
                self.reduced[number * D + axis] = right;
                largest = largest.max(right.abs());
            }
            kick = kick.max(largest / mass);
        }
        let is_kept = self.kept == Some(h);
        if !is_kept {
            self.assemble(system, h, time, iterate)?;
            statistics.projections += self.elements.projected;
            statistics.assemblies += 1;
        }

        self.residual = l2(&self.reduced);
        if let Some(observer) = &mut self.observer {
            observer(&NewtonSystem {
                h,
                time,
                positions,
                velocities,
                iterate,
                matrix: self.matrix.to_dense(),
                residual: &self.reduced,
                exact: matches!(self.curvature, Curvature::Jacobians(_))
                    && self.elements.projected == 0,
            });
        }
        if self.stiffness > STIFF_RATIO {
            self.solve_stiff(system, (time, iterate), delta, is_kept, statistics)?;
        } else {
            if is_kept {
                self.matrix.solve_again(&mut self.reduced, &mut statistics.linear)?
            } else {
                self.matrix.solve(&mut self.reduced, &mut statistics.linear)?
            }
            scatter::<D>(&self.free, &self.reduced, delta);
        }
        // Only a factor that has solved is kept.
        self.kept = self.is_constant.then_some(h);
        statistics.conditioning.last = self.amplification(system, kick);
        Ok(())
    }

    /// Amplification by the matrix that was solved last, with the solution still in place. It is that of this solution;
    /// a small pivot asks for a better estimate.
    fn amplification(&mut self, system: &System<D>, kick: f64) -> f64 {
        let seen = if kick > 0.0 { largest(&self.reduced) / kick } else { 0.0 };
        let has_small_pivot = self.smallest_mass > NEARLY_SINGULAR * self.matrix.smallest_pivot();
        if has_small_pivot && seen <= NEARLY_SINGULAR {
            seen.max(self.iterate_inversely(system))
        } else {
            seen
        }
    }

    /// Whether the last right-hand side, of a step of `h`, is within the rounding error of the forces.
    pub(super) fn residual_is_rounding(&self, h: f64) -> bool {
        let size = self.trial.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
        self.residual <= FORCE_ROUNDING * self.stiffness * self.smallest_mass * size / h
    }

    /// Amplification by two inverse iterations `x ← A⁻¹ M x`, with the factor at hand.
    fn iterate_inversely(&mut self, system: &System<D>) -> f64 {
        // Multiples of the golden ratio, modulo 1: along every vector of a regular pattern, there is a part of this one.
        let start = |number: usize| (number as f64 * 0.618_033_988_749_895).fract() - 0.5;
        let mut x: Vec<f64> = (0..self.reduced.len()).map(start).collect();
        let mut amplification: f64 = 0.0;
        // They are no work of the run.
        let mut statistics = LinearStatistics::default();
        for _ in 0..2 {
            let size = largest(&x);
            for (number, mass) in self.free.iter().zip(system.masses()) {
                if let Some(number) = number {
                    x[number * D..][..D].iter_mut().for_each(|x| *x *= mass / size);
                }
            }
            if self.matrix.solve_again(&mut x, &mut statistics).is_err() {
                break;
            }
            amplification = amplification.max(largest(&x));
        }
        amplification
    }

    /// Fills the matrix.
    fn assemble(
        &mut self,
        system: &System<D>,
        h: f64,
        time: f64,
        iterate: &[f64],
    ) -> Result<(), StepError> {
        self.kept = None;
        self.matrix.clear();
        if self.is_constant {
            self.matrix.forget_factors();
        }
        for (number, mass) in self.free.iter().zip(system.masses()) {
            if let Some(number) = number {
                self.matrix.add_diagonal(*number, *mass);
            }
        }
        self.elements.start(h, self.curvature.projection());
        let mut sink = Assembly {
            elements: &mut self.elements,
            free: &self.free,
            matrix: &mut self.matrix,
            slots: self.slots.iter(),
            stencil_slots: self.stencil_slots.iter(),
            largest_entry: 0.0,
        };
        self.curvature.add(system, [&self.trial, iterate], time, &mut sink)?;
        self.stiffness = sink.largest_entry / self.smallest_mass;
        Ok(())
    }

    /// Solves with residuals that do not come from the stored matrix, until the corrections settle at rounding. A matrix
    /// that `is_kept` was factorised before.
    fn solve_stiff(
        &mut self,
        system: &System<D>,
        (time, iterate): (f64, &[f64]),
        delta: &mut [f64],
        is_kept: bool,
        statistics: &mut Statistics,
    ) -> Result<(), StepError> {
        let floor = FORCE_ROUNDING * self.stiffness;
        let StiffWorkspace { right, solution, product } =
            self.stiff.get_or_insert_with(|| StiffWorkspace {
                right: vec![0.0; self.reduced.len()],
                solution: vec![0.0; self.reduced.len()],
                product: vec![0.0; delta.len()],
            });
        right.copy_from_slice(&self.reduced);
        solution.fill(0.0);
        let mut last = f64::INFINITY;
        for round in 0..MAX_REFINEMENTS {
            let linear = &mut statistics.linear;
            if round == 0 && !is_kept {
                self.matrix.solve(&mut self.reduced, linear)?;
            } else {
                self.matrix.solve_again(&mut self.reduced, linear)?;
            }
            for (solution, correction) in solution.iter_mut().zip(&self.reduced) {
                *solution += correction;
            }
            let (correction, size) = (l2(&self.reduced), l2(solution));
            self.reduced.copy_from_slice(solution);
            scatter::<D>(&self.free, &self.reduced, delta);
            // At rounding the corrections stop shrinking; far above it, that means that the stored
            // matrix is useless.
            let converged = correction <= CONVERGED * size;
            let stagnated = correction > 0.5 * last;
            if converged || (stagnated && correction <= floor.min(MAX_CORRECTION) * size) {
                return Ok(());
            }
            if stagnated || !correction.is_finite() {
                let correction = correction / size;
                return Err(LinearError::RefinementStalled { size: right.len(), correction }.into());
            }
            last = correction;
            statistics.linear.refinements += 1;

            product.fill(0.0);
            let elements = &mut self.elements;
            let mut sink = ElementProduct { elements, delta: &*delta, product };
            self.curvature.add(system, [&self.trial, iterate], time, &mut sink)?;
            for (particle, mass) in system.masses().iter().enumerate() {
                let Some(number) = self.free[particle] else { continue };
                for axis in 0..D {
                    let (dof, own) = (particle * D + axis, number * D + axis);
                    self.reduced[own] = right[own] - mass * delta[dof] - product[dof];
                }
            }
        }
        let correction = last / l2(solution);
        Err(LinearError::RefinementStalled { size: right.len(), correction }.into())
    }
}

/// Scatters the reduced solution to the free particles; fixed ones get zero.
fn scatter<const D: usize>(free: &[Option<usize>], reduced: &[f64], delta: &mut [f64]) {
    for (delta, number) in delta.chunks_exact_mut(D).zip(free) {
        match number {
            Some(number) => delta.copy_from_slice(&reduced[number * D..][..D]),
            None => delta.fill(0.0),
        }
    }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()))
}

fn l2(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum::<f64>().sqrt()
}

/// Computes element contributions to the matrix from Jacobians.
#[derive(Default)]
struct Elements<const D: usize> {
    h: f64,
    projection: Projection,
    /// Number of elements that the projection changed.
    projected: u64,
    /// The blocks of an element.
    blocks: Vec<Block<D>>,
    scratch: Vec<f64>,
}

impl<const D: usize> Elements<D> {
    fn start(&mut self, h: f64, projection: Projection) {
        (self.h, self.projection, self.projected) = (h, projection, 0);
    }

    /// `−(h² ∂F/∂x + h ∂F/∂v)`, projected, of one particle or of one relative to an origin.
    #[inline]
    fn single(&mut self, jacobian_x: &Block<D>, jacobian_v: &Block<D>) -> Block<D> {
        let contribution = jacobian_x * -(self.h * self.h) - jacobian_v * self.h;
        let (contribution, changed) = self.projection.project(contribution);
        self.projected += u64::from(changed);
        contribution
    }

    /// The same of any element, by blocks on its local coordinates.
    fn several(&mut self, element: &ElementJacobians<'_, D>) -> &[Block<D>] {
        self.blocks.clear();
        if let ([jacobian_x], [jacobian_v]) = (element.by_position, element.by_velocity) {
            let block = self.single(jacobian_x, jacobian_v);
            self.blocks.push(block);
            return &self.blocks;
        }
        let h = self.h;
        let jacobians = element.by_position.iter().zip(element.by_velocity);
        self.blocks.extend(jacobians.map(|(x, v)| x * -(h * h) - v * h));
        let is_relative = element.origin.is_some();
        let (projection, scratch) = (self.projection, &mut self.scratch);
        let changed = projection.project_element(&mut self.blocks, is_relative, scratch);
        self.projected += u64::from(changed);
        &self.blocks
    }
}

/// The larger of `known` and the entries of `block`.
fn largest_entry<const D: usize>(known: f64, block: &Block<D>) -> f64 {
    // A comparison is one instruction, which `max` with its care for NaN is not; the matrix is checked for
    // those anyway. `known` comes last: the blocks do not wait for each other.
    let larger = |a: f64, b: f64| if a > b { a } else { b };
    larger(block.iter().map(|entry| entry.abs()).fold(0.0, larger), known)
}

/// Subtracts `h² ∂F/∂x + h ∂F/∂v` from the matrix, rows and columns of fixed particles left out.
struct Assembly<'a, const D: usize> {
    elements: &'a mut Elements<D>,
    free: &'a [Option<usize>],
    matrix: &'a mut BlockMatrix<D>,
    /// Of the pairs that are still to come.
    slots: std::slice::Iter<'a, PairLocation>,
    /// Of the elements that are still to come.
    stencil_slots: std::slice::Iter<'a, StencilLocation>,
    /// The largest entry of a block so far.
    largest_entry: f64,
}

impl<const D: usize> JacobianSink<D> for Assembly<'_, D> {
    fn add_pair(&mut self, [i, j]: [usize; 2], by_position: &Block<D>, by_velocity: &Block<D>) {
        // If a force yields its pairs in another order than in `couplings`, look the blocks up: slower, same result.
        if let Some(PairLocation { particles, place: Some(place) }) = self.slots.next()
            && *particles == [i as u32, j as u32]
        {
            let block = self.elements.single(by_position, by_velocity);
            self.largest_entry = largest_entry(self.largest_entry, &block);
            self.matrix.add_pair(*place, &block);
            return;
        }
        self.add(ElementJacobians::single(&i, Some(j), by_position, by_velocity));
    }

    fn add(&mut self, element: ElementJacobians<'_, D>) {
        let blocks = self.elements.several(&element);
        self.largest_entry = blocks.iter().fold(self.largest_entry, largest_entry);
        // Elements that couple no particles have no slot.
        let next = self.stencil_slots.as_slice().first().filter(|next| next.is_of(&element));
        if let Some(StencilLocation { particles, place }) = next {
            self.stencil_slots.next();
            if let Some(place) = place {
                let n = particles.len();
                element.spread_places(blocks, |row, column, block| {
                    self.matrix.add_at(*place, row * n + column, block);
                });
                return;
            }
        }
        element.spread(blocks, |row, column, block| {
            if let (Some(row), Some(column)) = (self.free[row], self.free[column]) {
                self.matrix.add(row, column, block);
            }
        });
    }
}

/// Adds `−(h² ∂F/∂x + h ∂F/∂v) δ`, element by element.
struct ElementProduct<'a, const D: usize> {
    elements: &'a mut Elements<D>,
    delta: &'a [f64],
    product: &'a mut [f64],
}

impl<const D: usize> JacobianSink<D> for ElementProduct<'_, D> {
    fn add(&mut self, element: ElementJacobians<'_, D>) {
        let ElementJacobians { particles, origin, .. } = element;
        let of_origin = origin.map_or(Vector::zeros(), |origin| vector_of(self.delta, origin));
        let blocks = self.elements.several(&element);
        for (row, blocks) in particles.iter().zip(blocks.chunks_exact(particles.len())) {
            let mut product = Vector::<D>::zeros();
            for (column, block) in particles.iter().zip(blocks) {
                product += block * (vector_of::<D>(self.delta, *column) - of_origin);
            }
            add_to(self.product, *row, &product);
            if let Some(origin) = origin {
                add_to(self.product, origin, &-product);
            }
        }
    }
}
