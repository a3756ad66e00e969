//! Forces between two particles that depend on their relative position and velocity alone.
//!
//! With `d = x_i − x_j` and `w = v_i − v_j`, such a force is `F_i = f(d, w)`, `F_j = −f(d, w)`, so that
//! with `A = ∂f/∂d` and `B = ∂f/∂w` the Jacobians of the pair are
//!
//! ```text
//! ∂F/∂x = (  A  −A )      ∂F/∂v = (  B  −B )
//!         ( −A   A )              ( −B   B )
//! ```
//!
//! Each law states `f`, `A` and `B` only; the assembly is here, once.

use std::ops::Range;

use pulp::Simd;

use super::batches::Batches;
use super::law::{PairLaw, PairLaws, Undefined};
use super::{Block, Coupling, Degenerate, Force, JacobianSink, Numbered, State, Vector, vector_of};
use crate::parts::Parts;
use scene::{ForceElement, Particles, Scene};

/// All elements of one law in a scene.
pub(super) struct PairForce<L> {
    /// Elements that move something, in the order of the file.
    active: Vec<PairElement>,
    /// Whether the Jacobians of each active element are symmetric at every state.
    symmetric: Vec<bool>,
    /// Laws of the active elements, then of the inert ones.
    laws: L,
    /// The active elements by ranges of particles, in ascending order.
    parts: Vec<Batches>,
    /// Elements between two fixed particles: they have an energy, and move nothing.
    inert: Vec<PairElement>,
}

#[derive(Clone, Copy)]
struct PairElement {
    i: u32,
    j: u32,
    element: u32,
    slot: u32,
}

impl PairElement {
    fn pair(&self) -> [u32; 2] {
        [self.i, self.j]
    }

    fn particles(&self) -> Particles {
        self.pair().map(|particle| particle as usize).into()
    }

    #[cold]
    fn degenerate(&self) -> Degenerate {
        Degenerate { element: self.element as usize, particles: self.particles() }
    }
}

impl<L> PairForce<L> {
    /// The elements, each with the law that `law` makes of it and its two particles.
    pub(super) fn new<const D: usize>(
        scene: &Scene,
        elements: &[Numbered<'_>],
        law: impl Fn(&ForceElement, [usize; 2]) -> L::Law,
    ) -> Self
    where
        L: PairLaws<D>,
    {
        Self::in_parts(scene, elements, law, &Parts::of_scene(scene))
    }

    /// The same, for these parts.
    fn in_parts<const D: usize>(
        scene: &Scene,
        elements: &[Numbered<'_>],
        law: impl Fn(&ForceElement, [usize; 2]) -> L::Law,
        parts: &Parts,
    ) -> Self
    where
        L: PairLaws<D>,
    {
        let with_pairs = elements.iter().filter_map(|&(element, description)| {
            let [i, j] = description.pair()?;
            // No scene file holds 2³² of anything.
            let [i, j, element] = [i, j, element].map(|number| number as u32);
            Some(PairElement { i, j, element, slot: 0 })
        });
        let is_fixed = |particle: u32| scene.particles[particle as usize].fixed;
        let moves = |element: &PairElement| !element.pair().into_iter().all(is_fixed);
        let (mut active, mut inert): (Vec<_>, Vec<_>) = with_pairs.partition(moves);

        let pairs: Vec<[u32; 2]> = active.iter().map(PairElement::pair).collect();
        let mut order = Vec::with_capacity(pairs.len());
        let batches = |part: &Range<usize>| Batches::new(&pairs, part.clone(), &mut order);
        let parts = parts.ranges().iter().map(batches).collect();
        for (slot, number) in order.iter_mut().enumerate() {
            match active.get_mut(*number as usize) {
                Some(element) => element.slot = slot as u32,
                // Any law will do for a hole.
                None => *number = 0,
            }
        }
        for (slot, element) in (order.len()..).zip(&mut inert) {
            element.slot = slot as u32;
        }
        let mut laws = L::default();
        for element in order.iter().map(|number| &active[*number as usize]).chain(&inert) {
            let description = &scene.forces[element.element as usize];
            laws.push(law(description, element.pair().map(|particle| particle as usize)));
        }
        let description = |element: &PairElement| &scene.forces[element.element as usize];
        let symmetric = active.iter().map(|element| description(element).is_variational());
        Self { symmetric: symmetric.collect(), active, laws, parts, inert }
    }
}

impl<const D: usize, L: PairLaws<D>> Force<D> for PairForce<L> {
    fn energy(&self, state: State<'_>) -> Option<f64> {
        let mut sum = 0.0;
        for element in self.active.iter().chain(&self.inert) {
            let (d, _) = relative::<D>(state, element.pair());
            let law = self.laws.law(element.slot as usize).at(state.time);
            sum += law.energy(d.norm())?;
        }
        Some(sum)
    }

    fn add_force(
        &self,
        state: State<'_>,
        particles: Range<usize>,
        force: &mut [f64],
    ) -> Result<(), Degenerate> {
        let arch = pulp::Arch::new();
        let is_asked = |batches: &&Batches| particles.contains(&batches.range().start);
        for batches in self.parts.iter().filter(is_asked) {
            let Range { start, end } = batches.range();
            let sums = &mut force[(start - particles.start) * D..(end - particles.start) * D];
            let added = arch.dispatch(AddForce { laws: &self.laws, batches, state, sums });
            added.map_err(|Undefined| self.first_undefined(state))?;
        }
        Ok(())
    }

    fn add_jacobians(
        &self,
        state: State<'_>,
        sink: &mut dyn JacobianSink<D>,
    ) -> Result<(), Degenerate> {
        for active in &self.active {
            let (d, w) = relative(state, active.pair());
            let law = self.laws.law(active.slot as usize).at(state.time);
            let (a, b) = law.jacobians(&d, &w).ok_or_else(|| active.degenerate())?;
            sink.add_pair([active.i as usize, active.j as usize], &a, &b);
        }
        Ok(())
    }

    fn has_constant_jacobians(&self) -> bool {
        let mut laws = self.active.iter().map(|element| self.laws.law(element.slot as usize));
        laws.all(|law| law.has_constant_jacobians())
    }

    /// With `U = ρ²/2`, `∂²U/∂d² ≈ (∂ρ/∂d)(∂ρ/∂d)ᵀ = f fᵀ/(2U)`. Where `U` is 0, that is the Hessian along `d`. An energy that
    /// is negative is no square, and has no part in it.
    fn add_gauss_newton(
        &self,
        state: State<'_>,
        sink: &mut dyn JacobianSink<D>,
    ) -> Result<(), Degenerate> {
        for active in &self.active {
            let (d, w) = relative(state, active.pair());
            let law = self.laws.law(active.slot as usize).at(state.time);
            let values = law.force(&d, &w).zip(law.jacobians(&d, &w));
            let (f, (a, b)) = values.ok_or_else(|| active.degenerate())?;
            let energy = law.energy(d.norm()).unwrap_or(0.0);
            let along = match energy {
                0.0 => d.try_normalize(0.0).map_or(a, |n| n * n.dot(&(a * n)) * n.transpose()),
                _ if energy > 0.0 => f * (-0.5 / energy) * f.transpose(),
                _ => Block::zeros(),
            };
            sink.add_pair([active.i as usize, active.j as usize], &along, &b);
        }
        Ok(())
    }

    fn couplings(&self, visit: &mut dyn FnMut(Coupling)) {
        for (element, symmetric) in self.active.iter().zip(&self.symmetric) {
            let (particles, symmetric) = (element.particles(), *symmetric);
            visit(Coupling::Stencil { particles, symmetric });
        }
    }
}

impl<L> PairForce<L> {
    /// The first element of the file whose force is not defined.
    #[cold]
    fn first_undefined<const D: usize>(&self, state: State<'_>) -> Degenerate
    where
        L: PairLaws<D>,
    {
        let is_undefined = |active: &&PairElement| {
            let (d, w) = relative::<D>(state, active.pair());
            let law = self.laws.law(active.slot as usize).at(state.time);
            law.force(&d, &w).is_none()
        };
        let first = self.active.iter().find(is_undefined).expect("one of them is not defined");
        first.degenerate()
    }
}

// Code that is compiled for the vectors that the processor has: everything below is inlined into this.
struct AddForce<'a, const D: usize, L> {
    laws: &'a L,
    batches: &'a Batches,
    state: State<'a>,
    sums: &'a mut [f64],
}

impl<const D: usize, L: PairLaws<D>> pulp::WithSimd for AddForce<'_, D, L> {
    type Output = Result<(), Undefined>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { laws, batches, state, sums } = self;
        if laws.use_velocity() {
            batches.add::<D, true, S>(simd, laws, state, sums)
        } else {
            batches.add::<D, false, S>(simd, laws, state, sums)
        }
    }
}

/// `d = x_i − x_j` and `w = v_i − v_j`.
#[inline]
fn relative<const D: usize>(state: State<'_>, pair: [u32; 2]) -> (Vector<D>, Vector<D>) {
    let [i, j] = pair.map(|particle| particle as usize);
    let d = vector_of(state.positions, i) - vector_of(state.positions, j);
    let w = vector_of(state.velocities, i) - vector_of(state.velocities, j);
    (d, w)
}

#[cfg(test)]
mod tests {
    use super::super::spring::{KIND, Springs};
    use super::*;
    use crate::sizes::{BATCH, LANES, MAX_ADVANCE, MAX_PERIOD, MIN_REPEATS};
    use scene::schema::{
        Convergence, Family, IntegratorSchema, Matrix, Order, StepEquation, refuses_nothing,
    };
    use scene::{Dimension, Particle};

    const PARTICLES: usize = 200;

    /// A method that is not run. With one of the registry, all of the simulator would be compiled for these tests.
    static EXPLICIT: IntegratorSchema = IntegratorSchema {
        name: "explicit-euler",
        aliases: &[],
        summary: "",
        formula: "",
        equation: StepEquation::ExplicitEuler,
        family: Family::Explicit,
        matrix: Matrix::None,
        convergence: Convergence::Direct,
        order: Order::always(1),
        options: &[],
        refuses: refuses_nothing,
    };

    /// `(i, j)` of springs in every pattern there is: rows near and far, upwards and downwards, both
    /// diagonals of a net, patterns of period 3, short rows, rows with holes, and no pattern at all.
    fn pairs(rng: &mut fastrand::Rng) -> Vec<[usize; 2]> {
        let mut pairs = Vec::new();
        while pairs.len() < 800 {
            let repeats = rng.usize(1..70);
            let start = || rng.clone().usize(0..PARTICLES - repeats - 20);
            let (first, offset) = (start(), 1 + rng.usize(..19));
            let pattern: &[[usize; 2]] = match rng.u32(..5) {
                0 => &[[0, offset]],
                1 => &[[offset, 0]],
                2 => &[[0, offset + 1], [offset, 1]],
                3 => &[[0, 1], [offset, offset + 1], [0, offset]],
                _ => &[],
            };
            let is_pair = |[i, j]: &[usize; 2]| i != j;
            let skipped = rng.usize(1..12);
            for t in (first..first + repeats).filter(|t| skipped < 3 || t % skipped > 0) {
                pairs.extend(pattern.iter().map(|pair| pair.map(|end| end + t)).filter(is_pair));
            }
            let scattered = [rng.usize(..PARTICLES), rng.usize(..PARTICLES)];
            pairs.extend(Some(scattered).filter(is_pair));
        }
        pairs
    }

    /// A scene of random states, in which such a share of the springs is damped, and of no rest length.
    fn scene(rng: &mut fastrand::Rng, dimensions: usize, damped: f64, unstretched: f64) -> Scene {
        let pairs = pairs(rng);
        scene_of(rng, dimensions, [damped, unstretched], PARTICLES, pairs)
    }

    fn scene_of(
        rng: &mut fastrand::Rng,
        dimensions: usize,
        [damped, unstretched]: [f64; 2],
        n_particles: usize,
        pairs: Vec<[usize; 2]>,
    ) -> Scene {
        let dimension = if dimensions == 3 { Dimension::Three } else { Dimension::Two };
        let mut scene = Scene::new("random", dimension, &EXPLICIT);
        for _ in 0..n_particles {
            let [position, velocity] = [(); 2].map(|()| {
                let [x, y] = [(); 2].map(|()| rng.f64() - 0.5);
                [x, y, if dimensions == 3 { rng.f64() - 0.5 } else { 0.0 }]
            });
            let particle =
                Particle { mass: 1.0, position, velocity, fixed: false, radius: 0.1, tag: None };
            scene.particles.push(particle);
        }
        for pair in pairs {
            let damping = if rng.f64() < damped { rng.f64() } else { 0.0 };
            let rest_length = if rng.f64() < unstretched { 0.0 } else { rng.f64() };
            let values = [("k", rng.f64()), ("l0", rest_length), ("b", damping)];
            let parameters = KIND.schema.values(&values);
            scene.forces.push(ForceElement::new(&KIND.schema, &pair, None, parameters));
        }
        scene
    }

    fn springs<const D: usize>(scene: &Scene, n_parts: usize) -> PairForce<Springs<D>> {
        let elements: Vec<Numbered<'_>> = scene.forces.iter().enumerate().collect();
        let parts = Parts::new(scene.particles.len(), n_parts);
        PairForce::in_parts::<D>(scene, &elements, Springs::<D>::of_element, &parts)
    }

    /// The forces of all springs, pair by pair in the order of the file.
    fn pair_by_pair<const D: usize>(scene: &Scene, state: State<'_>) -> Vec<f64> {
        let mut sums = vec![0.0; state.positions.len()];
        for element in &scene.forces {
            let [i, j] = element.pair().unwrap();
            let (d, w) = relative::<D>(state, [i as u32, j as u32]);
            let force = Springs::<D>::of_element(element, [i, j]).force(&d, &w).unwrap();
            for axis in 0..D {
                sums[i * D + axis] += force[axis];
                sums[j * D + axis] -= force[axis];
            }
        }
        sums
    }

    /// In so many parts, the forces have the bits of pair by pair.
    fn assert_same_bits<const D: usize>(scene: &Scene, parts: &[usize], what: &str) {
        let n_particles = scene.particles.len();
        let masses = vec![1.0; n_particles];
        let positions = scene.positions();
        let velocities = scene.velocities();
        let state =
            State { masses: &masses, positions: &positions, velocities: &velocities, time: 0.0 };
        let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        let expected = bits(&pair_by_pair::<D>(scene, state));
        for n_parts in parts {
            let mut sums = vec![0.0; positions.len()];
            springs::<D>(scene, *n_parts).add_force(state, 0..n_particles, &mut sums).unwrap();
            assert!(bits(&sums) == expected, "{what} in {n_parts} parts");
        }
    }

    fn assert_same_bits_of_every_pattern<const D: usize>() {
        let mut rng = fastrand::Rng::with_seed(D as u64);
        for (damped, unstretched) in [(0.0, 0.0), (1.0, 0.0), (0.3, 0.0), (0.0, 0.2), (0.5, 0.5)] {
            let scene = scene(&mut rng, D, damped, unstretched);
            let what = format!("{damped} {unstretched}");
            assert_same_bits::<D>(&scene, &[1, 2, 3, 7, PARTICLES], &what);
        }
    }

    #[test]
    fn vectors_and_threads_give_the_bits_of_pair_by_pair() {
        assert_same_bits_of_every_pattern::<2>();
        assert_same_bits_of_every_pattern::<3>();
    }

    #[test]
    fn runs_of_every_length_have_the_bits_of_pair_by_pair() {
        let mut rng = fastrand::Rng::with_seed(8);
        let around = |size: usize| [size - 1, size, size + 1];
        for period in 1..=MAX_PERIOD + 1 {
            let mut lengths = [MIN_REPEATS, 2 * LANES, BATCH / period].map(around).to_vec();
            lengths.push(around(2 * (BATCH / period)));
            for repeats in lengths.into_iter().flatten() {
                // Rows of 20 repeats, between which particles are skipped.
                for advance in 1..=MAX_ADVANCE as usize + 1 {
                    if advance > 1 && repeats < 20 {
                        continue;
                    }
                    let first = |repeat: usize| repeat + repeat / 20 * (advance - 1);
                    let pairs = (0..repeats).flat_map(|repeat| {
                        let of_run =
                            move |run: usize| [first(repeat) + run, first(repeat) + 9 - run];
                        (0..period).map(of_run)
                    });
                    let pairs: Vec<[usize; 2]> = pairs.collect();
                    let scene = scene_of(&mut rng, 2, [0.3, 0.1], first(repeats) + 10, pairs);
                    let what = format!("{repeats} repeats of {period}, advance {advance}");
                    assert_same_bits::<2>(&scene, &[1, 3], &what);
                }
            }
        }
    }

    #[test]
    fn missing_spring_between_coincident_particles_is_harmless() {
        let mut rng = fastrand::Rng::with_seed(7);
        let row =
            (0..PARTICLES - 1).filter(|first| first % 20 != 7).map(|first| [first, first + 1]);
        let mut scene = scene_of(&mut rng, 2, [0.3, 0.0], PARTICLES, row.collect());
        for first in (7..PARTICLES - 1).step_by(20) {
            scene.particles[first + 1].position = scene.particles[first].position;
        }
        let masses = vec![1.0; PARTICLES];
        let positions = scene.positions();
        let state =
            State { masses: &masses, positions: &positions, velocities: &positions, time: 0.0 };
        let mut sums = vec![0.0; positions.len()];
        springs::<2>(&scene, 1).add_force(state, 0..PARTICLES, &mut sums).unwrap();
        assert_eq!(sums, pair_by_pair::<2>(&scene, state));
    }

    #[test]
    fn first_spring_without_a_direction_is_named() {
        let mut rng = fastrand::Rng::with_seed(5);
        let mut scene = scene(&mut rng, 2, 0.0, 0.0);
        let [i, j] = scene.forces[300].pair().unwrap();
        scene.particles[i].position = scene.particles[j].position;
        let first = scene.forces.iter().position(|element| {
            let pair = element.pair().unwrap();
            pair == [i, j] || pair == [j, i]
        });
        let positions = scene.positions();
        let masses = vec![1.0; PARTICLES];
        let state =
            State { masses: &masses, positions: &positions, velocities: &positions, time: 0.0 };
        for n_parts in [1, 4] {
            let mut sums = vec![0.0; positions.len()];
            let added = springs::<2>(&scene, n_parts).add_force(state, 0..PARTICLES, &mut sums);
            assert_eq!(added.unwrap_err().element, first.unwrap());
        }
    }
}
