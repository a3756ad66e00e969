//! Scenes of the probe: parts of forces, states, and many copies of a state in one scene.
//!
//! A *group* has one particle more than there are dimensions, or as many as the largest stencil there. A force between two
//! particles forms a chain in it, one of more acts on consecutive ones, the first after the last,
//!
//! ```text
//! 0 —element— 1 —element— 2 —element— 3       elements (0, 1), (2, 1) and, in space, (2, 3)
//! (0, 1, 2), (1, 2, 0)                        two elements of three particles in the plane
//! ```
//!
//! as many elements as dimensions, so that the forces together span all directions. Groups do not interact. A *part* of a force is the difference
//! between the force `full` and the force `without` the part. Coordinates, parameters and masses are dyadic with few
//! bits: reading and perturbing them and moving a state back by `h v` is exact, even in single precision.
//!
//! Springs are stretched, gravitation is weak and masses are at least 1. So `M − h² ∂F/∂x` is definite wherever it is
//! symmetric, and a program may use conjugate gradients.

use std::sync::LazyLock;

use fastrand::Rng;
use nalgebra::DMatrix;
use scene::schema::{ForceSchema, Initial, Masses, PartSchema, Stencil, StepEquation};
use scene::{
    Dimension, EDGE_RADIUS, Edge, ForceElement, PARTICLE_RADIUS, Parameters, Particle, Scene,
};
use simulator::force;
use simulator::integrator;

/// Particles of a group.
pub(super) fn chain(dimension: Dimension) -> usize {
    let there = force::REGISTRY.iter().filter(|kind| kind.schema.exists_in(dimension));
    let sizes = there.map(|kind| kind.schema.stencil.size());
    sizes.fold(dimension.count() + 1, usize::max)
}

/// The pairs of a chain that elements join.
fn pairs(dimension: Dimension) -> impl Iterator<Item = [usize; 2]> {
    (0..dimension.count())
        .map(|link| if link % 2 == 0 { [link, link + 1] } else { [link + 1, link] })
}

/// The stencils in a group.
fn stencils(stencil: Stencil, dimension: Dimension) -> Vec<Vec<usize>> {
    if stencil.size() == 2 {
        return pairs(dimension).map(Vec::from).collect();
    }
    let (size, n_particles) = (stencil.size(), chain(dimension));
    let particles = |first: usize| (first..first + size).map(|place| place % n_particles).collect();
    (0..dimension.count()).map(particles).collect()
}

/// Number of states at which each part is measured.
pub(super) const N_STATES: usize = 3;

/// Time steps of the implicit steps: two separate `h² K` from `h B`, and the third is a check.
pub(super) const TIME_STEPS: [f64; 3] = [0.5, 1.0, 2.0];

/// Elements of one force, with the samples of its parameters but for those of parts that are left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Elements {
    schema: &'static ForceSchema,
    /// How many of its parts they have, from the first on.
    parts: usize,
}

impl Elements {
    /// Those of the force with this tag that have its parts up to `part`.
    ///
    /// # Panics
    /// Where there is no such force or part.
    fn up_to(tag: &str, part: &str) -> Self {
        let mut kinds = force::REGISTRY.iter();
        let kind = kinds.find(|kind| kind.schema.tag == tag);
        let schema = &kind.unwrap_or_else(|| panic!("{tag} is no registered force")).schema;
        let number = schema.parts.iter().position(|known| known.name == part);
        Self { schema, parts: 1 + number.unwrap_or_else(|| panic!("{tag} has no part {part}")) }
    }

    /// The parameters of the element at this place in the chain. A force that grows with the masses or a size of the initial
    /// positions is divided by them, not to depend on them.
    fn parameters(self, place: usize, masses: &[f64], initial: f64) -> Parameters {
        let Self { schema, parts } = self;
        let mut values = schema.zeros();
        for (value, parameter) in values.iter_mut().zip(schema.parameters) {
            let is_of = |part: &PartSchema| part.scaled_by.contains(&parameter.name);
            if schema.parts[parts..].iter().any(is_of) {
                continue;
            }
            *value = parameter.samples[place];
            let is_scale = is_of(&schema.parts[0]);
            if is_scale && schema.masses == Masses::Product {
                *value /= masses.iter().product::<f64>();
            }
            if is_scale {
                *value /= initial;
            }
        }
        values
    }
}

/// A part of a force: one line of the report.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part {
    /// The force's tag.
    pub(super) force: &'static str,
    /// Its name among the parts of that force.
    pub(super) name: &'static str,
    /// Its description.
    pub(super) meaning: &'static str,
    /// The forces with the part and without it: the part is the difference.
    pub(super) full: Elements,
    pub(super) without: Option<Elements>,
    /// How implicit steps measure it.
    pub(super) steps: Steps,
}

/// How implicit steps measure a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Steps {
    /// In the chain that the force itself forms.
    Chain,
    /// Together with a chain of springs, because the force alone is weak or moves the particles along one line.
    BesideSprings,
    /// Not at all: the force depends on the time, and an implicit step evaluates it at another time; or its Jacobians depend on
    /// masses, by which steps measure them.
    None,
}

impl Steps {
    pub(super) fn of(schema: &ForceSchema) -> Self {
        let depends_on = schema.depends_on();
        let is_by_mass = schema.masses == Masses::Own && depends_on.has_jacobian();
        if depends_on.time || is_by_mass {
            Self::None
        } else if schema.stencil.size() != 2 || schema.masses == Masses::Product {
            Self::BesideSprings
        } else {
            Self::Chain
        }
    }
}

/// Whether implicit steps measure Jacobians of this force.
pub(super) fn measures_jacobians(schema: &ForceSchema) -> bool {
    schema.depends_on().has_jacobian() && Steps::of(schema) != Steps::None
}

/// Every part that exists in this dimension, a force's parts one after the other in the order of the simulator's registry.
pub(super) fn parts(dimension: Dimension) -> impl Iterator<Item = &'static Part> {
    static PARTS: LazyLock<Vec<Part>> = LazyLock::new(every_part);
    PARTS.iter().filter(move |part| part.full.schema.exists_in(dimension))
}

fn every_part() -> Vec<Part> {
    let of_force = |schema: &'static ForceSchema| {
        schema.parts.iter().enumerate().map(move |(number, part)| Part {
            force: schema.tag,
            name: part.name,
            meaning: part.meaning,
            full: Elements { schema, parts: number + 1 },
            without: (number > 0).then_some(Elements { schema, parts: number }),
            steps: Steps::of(schema),
        })
    };
    force::REGISTRY.iter().flat_map(|kind| of_force(&kind.schema)).collect()
}

/// The force together with which parts are measured. Without it, gravitation is measured alone, and forces on every
/// particle together with gravitation.
pub(super) fn companion() -> Elements {
    Elements::up_to("springforce", "elastic")
}

/// An additional force for the case that a wrong Jacobian keeps the particles on their lines.
pub(super) fn exciter() -> Elements {
    Elements::up_to("constantforce", "all")
}

/// The force together with which forces on every particle are measured if there are no springs.
pub(super) fn second_companion() -> Elements {
    Elements::up_to("gravitationalforce", "all")
}

/// Positions and velocities of a group, `(D + 1) · D` numbers each, particle-major.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct State {
    pub(super) positions: Vec<f64>,
    pub(super) velocities: Vec<f64>,
}

impl State {
    /// The state a time `h` earlier of particles that move with constant velocity.
    pub(super) fn before(&self, h: f64) -> Self {
        let back = |(x, v): (&f64, &f64)| x - h * v;
        Self {
            positions: self.positions.iter().zip(&self.velocities).map(back).collect(),
            velocities: self.velocities.clone(),
        }
    }
}

/// A state with masses.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Group {
    pub(super) state: State,
    pub(super) masses: Vec<f64>,
}

impl Group {
    /// Each state with masses of 1.
    pub(super) fn of_unit_masses(states: &[State], dimension: Dimension) -> Vec<Self> {
        let masses = vec![1.0; chain(dimension)];
        states.iter().map(|state| Self { state: state.clone(), masses: masses.clone() }).collect()
    }

    /// Each state with every combination of masses.
    pub(super) fn of_all_masses(states: &[State], dimension: Dimension) -> Vec<Self> {
        let all = masses(dimension);
        let of_state = |state: &State| -> Vec<Self> {
            all.iter().map(|masses| Self { state: state.clone(), masses: masses.clone() }).collect()
        };
        states.iter().flat_map(of_state).collect()
    }
}

/// States in general position: no special distances, angles or velocities.
pub(super) fn states(dimension: Dimension) -> Vec<State> {
    let mut rng = Rng::with_seed(4);
    let mut found = Vec::new();
    while found.len() < N_STATES {
        let mut dyadic = |count: u32, unit: f64| -> Vec<f64> {
            let numbers = 0..chain(dimension) * dimension.count();
            numbers.map(|_| (f64::from(rng.u32(0..=2 * count)) - f64::from(count)) * unit).collect()
        };
        let state = State { positions: dyadic(40, 1.0 / 16.0), velocities: dyadic(12, 1.0 / 8.0) };
        if is_general(&state, dimension) {
            found.push(state);
        }
    }
    found
}

fn is_general(state: &State, dimension: Dimension) -> bool {
    let count = dimension.count();
    let difference = |values: &[f64], [i, j]: [usize; 2]| -> Vec<f64> {
        (0..count).map(|axis| values[i * count + axis] - values[j * count + axis]).collect()
    };
    let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
    let norm = |a: &[f64]| dot(a, a).sqrt();
    let directions: Vec<Vec<f64>> =
        pairs(dimension).map(|pair| difference(&state.positions, pair)).collect();
    let is_good = |(pair, d): ([usize; 2], &Vec<f64>)| {
        let w = difference(&state.velocities, pair);
        let along = dot(d, &w) / norm(d);
        let across = (dot(&w, &w) - along * along).max(0.0).sqrt();
        let components = d.iter().chain(&w).all(|component| component.abs() >= 0.1875);
        (1.25..2.25).contains(&norm(d)) && along.abs() > 0.375 && across > 0.375 && components
    };
    // The volume of the unit vectors along the pairs: the chain is not flat.
    let unit = |row: usize, column: usize| directions[row][column] / norm(&directions[row]);
    let volume = DMatrix::from_fn(count, count, unit).determinant();
    pairs(dimension).zip(&directions).all(is_good) && volume.abs() > 0.5
}

/// Combinations of masses for one state: twice as many as the unknowns in a row of the matrix, plus two.
pub(super) fn masses(dimension: Dimension) -> Vec<Vec<f64>> {
    let particles = chain(dimension);
    let count = 2 * particles * dimension.count() + 2;
    let all = 1 << (2 * particles);
    // Spread over all combinations of 1, 2, 4 and 8; the stride is coprime to their number.
    let masses = |index: usize| {
        let code = (index * 27 + 5) % all;
        (0..particles).map(|i| f64::from(1 << (code >> (2 * i) & 3))).collect()
    };
    (0..count).map(masses).collect()
}

/// A scene of one step with all `groups`, and `elements` in each.
pub(super) fn scene(
    dimension: Dimension,
    elements: &[Elements],
    groups: &[Group],
    time_step: f64,
    implicit: bool,
) -> Scene {
    let wanted = match implicit {
        true => StepEquation::LinearizedImplicitEuler,
        false => StepEquation::ExplicitEuler,
    };
    let method = integrator::REGISTRY.iter().find(|kind| kind.schema.equation == wanted);
    let method = &method.unwrap_or_else(|| panic!("no integrator solves {wanted:?}")).schema;
    let numbers = 0..groups.len();
    let edges = numbers.flat_map(|group| {
        pairs(dimension).map(move |pair| pair.map(|i| group * chain(dimension) + i))
    });
    let particles: Vec<Particle> =
        groups.iter().flat_map(|group| particles(group, dimension)).collect();
    let forces = elements.iter().flat_map(|of| force_elements(*of, dimension, groups, &particles));
    Scene {
        duration: time_step,
        time_step,
        forces: forces.collect(),
        particles,
        edges: edges.map(|particles| Edge { particles, radius: EDGE_RADIUS }).collect(),
        ..Scene::new("probe", dimension, method)
    }
}

fn particles(group: &Group, dimension: Dimension) -> Vec<Particle> {
    let count = dimension.count();
    let vector = |values: &[f64], particle: usize| -> [f64; 3] {
        std::array::from_fn(|axis| if axis < count { values[particle * count + axis] } else { 0.0 })
    };
    let particle = |(number, mass): (usize, &f64)| Particle {
        mass: *mass,
        position: vector(&group.state.positions, number),
        velocity: vector(&group.state.velocities, number),
        fixed: false,
        radius: PARTICLE_RADIUS,
        tag: None,
    };
    group.masses.iter().enumerate().map(particle).collect()
}

/// Sets parameters that belong to three dimensions to 0.
fn clear_depth(element: &mut ForceElement) {
    for (value, parameter) in element.parameters.iter_mut().zip(element.schema.parameters) {
        if parameter.three_dimensional {
            *value = 0.0;
        }
    }
}

/// The elements of all groups, on the particles of the scene.
fn force_elements(
    of: Elements,
    dimension: Dimension,
    groups: &[Group],
    all: &[Particle],
) -> Vec<ForceElement> {
    let schema = of.schema;
    if schema.stencil.is_field() {
        let mut element = ForceElement::new(schema, &[], None, of.parameters(0, &[], 1.0));
        if dimension == Dimension::Two {
            clear_depth(&mut element);
        }
        return vec![element];
    }
    let stencils = stencils(schema.stencil, dimension);
    let mut found = Vec::with_capacity(groups.len() * stencils.len());
    for (number, group) in groups.iter().enumerate() {
        for (place, stencil) in stencils.iter().enumerate() {
            let masses: Vec<f64> = stencil.iter().map(|particle| group.masses[*particle]).collect();
            let global = |particle: &usize| number * chain(dimension) + particle;
            let particles: Vec<usize> = stencil.iter().map(global).collect();
            let is_edge = schema.stencil == Stencil::Edge;
            let edge = is_edge.then_some(number * stencils.len() + place);
            let mut element = ForceElement::new(schema, &particles, edge, schema.zeros());
            let initial = match schema.initial {
                Initial::PathLength => 1.0 / element.path_length(all),
                Initial::Hinge => element.hinge_weight(all),
                Initial::None | Initial::BoxDiagonal => 1.0,
            };
            element.parameters = of.parameters(place, &masses, initial);
            if dimension == Dimension::Two {
                clear_depth(&mut element);
            }
            found.push(element);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_have_few_digits_and_are_within_their_domains() {
        for parameter in force::REGISTRY.iter().flat_map(|kind| kind.schema.parameters) {
            for sample in parameter.samples {
                let is_short = (sample * 64.0).fract() == 0.0 && sample.abs() <= 64.0;
                let fits = parameter.domain.contains(sample) && sample != 0.0;
                assert!(is_short && fits, "{}: {sample}", parameter.name);
            }
        }
    }

    #[test]
    fn moving_a_state_back_is_exact_in_single_precision() {
        for dimension in [Dimension::Two, Dimension::Three] {
            for state in states(dimension) {
                for h in TIME_STEPS {
                    let before = state.before(h);
                    for ((x, v), back) in
                        state.positions.iter().zip(&state.velocities).zip(&before.positions)
                    {
                        assert_eq!(back + h * v, *x);
                        assert_eq!(f64::from(*back as f32), *back);
                    }
                }
            }
        }
    }

    #[test]
    fn masses_are_all_different_combinations() {
        for dimension in [Dimension::Two, Dimension::Three] {
            let mut all: Vec<String> =
                masses(dimension).iter().map(|masses| format!("{masses:?}")).collect();
            let count = all.len();
            all.sort();
            all.dedup();
            assert_eq!(all.len(), count);
        }
    }
}
