//! Assembly of a scene: masses, forces and fixed particles.
//!
//! All slices of positions, velocities and forces hold `n·D` numbers, particle-major. Sums run in the
//! order of the registry, and within a force in the order of the file, so that they are the same bits
//! every time.

use std::ops::Range;

use crate::force::{
    Coupling, Degenerate, Force, ForceKind, JacobianSink, Numbered, REGISTRY, State,
};
use crate::parts::Parts;
use scene::{ForceElement, Scene};

/// The forces of a kind, in `D` dimensions.
pub trait BuildForce<const D: usize> {
    /// Builds the force that all of `elements` make together.
    fn build(&self, scene: &Scene, elements: &[Numbered<'_>]) -> Box<dyn Force<D>>;
}

impl BuildForce<2> for ForceKind {
    fn build(&self, scene: &Scene, elements: &[Numbered<'_>]) -> Box<dyn Force<2>> {
        (self.build_2d)(scene, elements)
    }
}

impl BuildForce<3> for ForceKind {
    fn build(&self, scene: &Scene, elements: &[Numbered<'_>]) -> Box<dyn Force<3>> {
        (self.build_3d)(scene, elements)
    }
}

/// The physics of one scene.
pub struct System<const D: usize> {
    masses: Vec<f64>,
    fixed: Vec<bool>,
    free: Vec<Range<usize>>,
    held: Vec<Range<usize>>,
    parts: Parts,
    forces: Vec<Box<dyn Force<D>>>,
    /// Of each force.
    tags: Vec<&'static str>,
    is_variational: bool,
}

impl<const D: usize> System<D>
where
    ForceKind: BuildForce<D>,
{
    /// The system that `scene` describes, with the forces it mentions and no others.
    pub fn new(scene: &Scene) -> Self {
        Self::of_kinds(scene, REGISTRY)
    }

    /// The same with forces of these kinds.
    pub fn of_kinds(scene: &Scene, kinds: &[&ForceKind]) -> Self {
        let (mut forces, mut tags) = (Vec::new(), Vec::new());
        for kind in kinds {
            let is_of_kind = |(_, element): &Numbered<'_>| element.schema.tag == kind.schema.tag;
            let elements: Vec<Numbered<'_>> =
                scene.forces.iter().enumerate().filter(is_of_kind).collect();
            if !elements.is_empty() {
                forces.push(kind.build(scene, &elements));
                tags.push(kind.schema.tag);
            }
        }
        let fixed: Vec<bool> = scene.particles.iter().map(|particle| particle.fixed).collect();
        let (mut free, mut held) = (Vec::new(), Vec::new());
        let mut start = 0;
        for run in fixed.chunk_by(|a, b| a == b) {
            let end = start + run.len();
            (if run[0] { &mut held } else { &mut free }).push(start..end);
            start = end;
        }
        let masses = scene.particles.iter().map(|particle| particle.mass).collect();
        let is_variational = scene.forces.iter().all(ForceElement::is_variational);
        let parts = Parts::of_scene(scene);
        Self { masses, fixed, free, held, parts, forces, tags, is_variational }
    }
}

impl<const D: usize> System<D> {
    /// Mass of each particle.
    pub fn masses(&self) -> &[f64] {
        &self.masses
    }

    /// The tags of the forces that it holds, in the order of the registry.
    pub fn force_tags(&self) -> &[&'static str] {
        &self.tags
    }

    /// Whether every force is the gradient of an energy or of a dissipation function, negated.
    pub fn is_variational(&self) -> bool {
        self.is_variational
    }

    /// Which particles are fixed.
    pub fn fixed(&self) -> &[bool] {
        &self.fixed
    }

    /// The particles that are not fixed, as ranges in ascending order.
    pub fn free(&self) -> &[Range<usize>] {
        &self.free
    }

    /// The fixed particles, likewise.
    pub(crate) fn held(&self) -> &[Range<usize>] {
        &self.held
    }

    /// The particles, divided among threads where there are many.
    pub(crate) fn parts(&self) -> &Parts {
        &self.parts
    }

    /// Number of particles.
    pub fn n_particles(&self) -> usize {
        self.masses.len()
    }

    /// Sets `force` to the sum of all forces at `time`, in seconds; zero on fixed particles.
    ///
    /// # Errors
    /// If a force is not defined at this state.
    pub fn force(
        &self,
        positions: &[f64],
        velocities: &[f64],
        time: f64,
        force: &mut [f64],
    ) -> Result<(), Degenerate> {
        let state = self.state(positions, velocities, time);
        let on = |particles, [force]: [&mut [f64]; 1]| self.force_on(particles, state, force);
        // Which of several errors is met first depends on the parts.
        self.parts
            .map(D, [force], on, Result::and)
            .or_else(|_| self.force_on(0..self.n_particles(), state, force))
    }

    /// The forces on some of the particles.
    fn force_on(
        &self,
        particles: Range<usize>,
        state: State<'_>,
        force: &mut [f64],
    ) -> Result<(), Degenerate> {
        force.fill(0.0);
        for each in &self.forces {
            each.add_force(state, particles.clone(), force)?;
        }
        let Range { start, end } = particles;
        for held in &self.held {
            let (from, to) = (held.start.max(start), held.end.min(end));
            if from < to {
                force[(from - start) * D..(to - start) * D].fill(0.0);
            }
        }
        Ok(())
    }

    /// Hands every block of `∂F/∂x` and `∂F/∂v` to `sink`, those of fixed particles included.
    ///
    /// # Errors
    /// If a force is not defined at this state.
    pub fn jacobians(
        &self,
        positions: &[f64],
        velocities: &[f64],
        time: f64,
        sink: &mut dyn JacobianSink<D>,
    ) -> Result<(), Degenerate> {
        let state = self.state(positions, velocities, time);
        self.forces.iter().try_for_each(|each| each.add_jacobians(state, sink))
    }

    /// Whether the Jacobians are the same numbers at every state and time.
    pub fn has_constant_jacobians(&self) -> bool {
        self.forces.iter().all(|each| each.has_constant_jacobians())
    }

    /// Hands Gauss–Newton's approximations of these blocks to `sink`.
    ///
    /// # Errors
    /// If a force is not defined at this state.
    pub fn gauss_newton(
        &self,
        positions: &[f64],
        velocities: &[f64],
        time: f64,
        sink: &mut dyn JacobianSink<D>,
    ) -> Result<(), Degenerate> {
        let state = self.state(positions, velocities, time);
        self.forces.iter().try_for_each(|each| each.add_gauss_newton(state, sink))
    }

    /// Says which particles the Jacobians couple, fixed ones included.
    pub fn couplings(&self, visit: &mut dyn FnMut(Coupling)) {
        self.forces.iter().for_each(|each| each.couplings(visit));
    }

    /// Kinetic energy `½ Σ m_i |v_i|²`, of fixed particles too.
    pub fn kinetic_energy(&self, velocities: &[f64]) -> f64 {
        let of_particle = |(velocity, mass): (&[f64], &f64)| {
            0.5 * mass * velocity.iter().map(|component| component * component).sum::<f64>()
        };
        velocities.chunks_exact(D).zip(&self.masses).map(of_particle).sum()
    }

    /// Potential energy: the sum over the forces that have one.
    pub fn potential_energy(&self, positions: &[f64], velocities: &[f64], time: f64) -> f64 {
        let state = self.state(positions, velocities, time);
        self.forces.iter().filter_map(|each| each.energy(state)).sum()
    }

    /// Potential energy as [`potential_energy`](Self::potential_energy), and the sum of the magnitudes of
    /// each force's, which bounds its rounding.
    pub fn energy_and_size(&self, positions: &[f64], velocities: &[f64], time: f64) -> (f64, f64) {
        let state = self.state(positions, velocities, time);
        let energies = self.forces.iter().filter_map(|each| each.energy(state));
        energies.fold((0.0, 0.0), |(sum, size), energy| (sum + energy, size + energy.abs()))
    }

    /// Rayleigh's dissipation function: the sum over the forces that have one.
    pub fn dissipation(&self, positions: &[f64], velocities: &[f64], time: f64) -> f64 {
        let state = self.state(positions, velocities, time);
        self.forces.iter().map(|each| each.dissipation(state)).sum()
    }

    /// Momentum `Σ m_i v_i`, of fixed particles too.
    pub fn momentum(&self, velocities: &[f64]) -> [f64; D] {
        let mut momentum = [0.0; D];
        for (velocity, mass) in velocities.chunks_exact(D).zip(&self.masses) {
            for (sum, component) in momentum.iter_mut().zip(velocity) {
                *sum += mass * component;
            }
        }
        momentum
    }

    fn state<'a>(&'a self, positions: &'a [f64], velocities: &'a [f64], time: f64) -> State<'a> {
        State { masses: &self.masses, positions, velocities, time }
    }
}
