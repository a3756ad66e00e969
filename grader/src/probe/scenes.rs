//! Scenes of the probe: parts of forces, states, and many copies of a state in one scene.
//!
//! A *group* has one particle more than there are dimensions. A force between two particles forms a chain in it,
//!
//! ```text
//! 0 —element— 1 —element— 2 —element— 3       elements (0, 1), (2, 1) and, in space, (2, 3)
//! ```
//!
//! so that the forces together span all directions. Groups do not interact. A *part* of a force is the difference
//! between the force `full` and the force `without` the part. Coordinates, parameters and masses are dyadic with few
//! bits: reading and perturbing them and moving a state back by `h v` is exact, even in single precision.
//!
//! Springs are stretched, gravitation is weak and masses are at least 1. So `M − h² ∂F/∂x` is definite wherever it is
//! symmetric, and a program may use conjugate gradients.

use fastrand::Rng;
use nalgebra::DMatrix;
use simulator::force;
use simulator::integrator;
use simulator::scene::schema::{ActsOn, ForceSchema, MAX_PARAMETERS};
use simulator::scene::{
    Dimension, EDGE_RADIUS, Edge, ForceElement, Location, PARTICLE_RADIUS, Particle, Scene,
};

/// The pairs of a chain; in two dimensions, the first two.
const PAIRS: [[usize; 2]; 3] = [[0, 1], [2, 1], [2, 3]];

/// Particles of a group.
pub(super) fn chain(dimension: Dimension) -> usize {
    dimension.count() + 1
}

fn pairs(dimension: Dimension) -> &'static [[usize; 2]] {
    &PAIRS[..dimension.count()]
}

/// Number of states at which each part is measured.
pub(super) const N_STATES: usize = 3;

/// Time steps of the implicit steps: two separate `h² K` from `h B`, and the third is a check.
pub(super) const TIME_STEPS: [f64; 3] = [0.5, 1.0, 2.0];

/// Elements of one force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Elements {
    pub(super) tag: &'static str,
    /// Parameters of the chain's elements. A force on every particle uses the first only.
    parameters: [[f64; MAX_PARAMETERS]; 3],
    /// Whether the first parameter is divided by the masses of the pair, to make the force independent of them.
    per_mass: bool,
}

impl Elements {
    const fn pairs(tag: &'static str, parameters: [[f64; MAX_PARAMETERS]; 3]) -> Self {
        Self { tag, parameters, per_mass: false }
    }

    const fn every(tag: &'static str, parameters: [f64; MAX_PARAMETERS]) -> Self {
        Self { tag, parameters: [parameters; 3], per_mass: false }
    }
}

const SPRINGS: Elements = Elements::pairs(
    "springforce",
    [[4.0, 0.75, 0.0, 0.0], [6.0, 0.5, 0.0, 0.0], [5.0, 0.625, 0.0, 0.0]],
);
const DAMPED_SPRINGS: Elements = Elements::pairs(
    "springforce",
    [[4.0, 0.75, 1.5, 0.0], [6.0, 0.5, 1.0, 0.0], [5.0, 0.625, 1.25, 0.0]],
);
const GRAVITATION: Elements = Elements {
    per_mass: true,
    ..Elements::pairs(
        "gravitationalforce",
        [[0.5, 0.0, 0.0, 0.0], [0.75, 0.0, 0.0, 0.0], [0.625, 0.0, 0.0, 0.0]],
    )
};
const VORTEX_DRAG: Elements = Elements::pairs(
    "vortexforce",
    [[0.0, 1.5, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 1.25, 0.0, 0.0]],
);
const VORTEX: Elements = Elements::pairs(
    "vortexforce",
    [[0.75, 1.5, 0.0, 0.0], [1.25, 1.0, 0.0, 0.0], [-1.0, 1.25, 0.0, 0.0]],
);
const GREEN_SPRINGS: Elements = Elements::pairs(
    "greenspringforce",
    [[0.25, 1.25, 0.0, 0.0], [0.375, 1.0, 0.0, 0.0], [0.3125, 1.125, 0.0, 0.0]],
);
const DRAG: Elements = Elements::every("dragdamping", [0.75, 0.0, 0.0, 0.0]);
const GRAVITY: Elements = Elements::every("simplegravity", [0.5, -1.25, 0.75, 0.0]);
const CONSTANT: Elements = Elements::every("constantforce", [-0.75, 1.5, 0.625, 0.0]);
const WIND: Elements = Elements::every("windforce", [0.75, 0.0, 0.0, 0.0]);

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
    /// Not at all: the force depends on the time, and an implicit step evaluates it at another time.
    None,
}

/// Every part, in the order of the simulator's registry.
pub(super) static PARTS: [Part; 10] = [
    Part {
        force: "simplegravity",
        name: "all",
        meaning: "the force",
        full: GRAVITY,
        without: None,
        steps: Steps::BesideSprings,
    },
    Part {
        force: "constantforce",
        name: "all",
        meaning: "the force",
        full: CONSTANT,
        without: None,
        steps: Steps::BesideSprings,
    },
    Part {
        force: "springforce",
        name: "elastic",
        meaning: "springs without damping",
        full: SPRINGS,
        without: None,
        steps: Steps::Chain,
    },
    Part {
        force: "springforce",
        name: "damping",
        meaning: "contribution of damping to springs",
        full: DAMPED_SPRINGS,
        without: Some(SPRINGS),
        steps: Steps::Chain,
    },
    Part {
        force: "gravitationalforce",
        name: "all",
        meaning: "the force",
        full: GRAVITATION,
        without: None,
        steps: Steps::BesideSprings,
    },
    Part {
        force: "dragdamping",
        name: "all",
        meaning: "the force",
        full: DRAG,
        without: None,
        steps: Steps::BesideSprings,
    },
    Part {
        force: "vortexforce",
        name: "drag",
        meaning: "vortices with kbs = 0",
        full: VORTEX_DRAG,
        without: None,
        steps: Steps::Chain,
    },
    Part {
        force: "vortexforce",
        name: "rotation",
        meaning: "contribution of kbs to vortices",
        full: VORTEX,
        without: Some(VORTEX_DRAG),
        steps: Steps::Chain,
    },
    Part {
        force: "greenspringforce",
        name: "all",
        meaning: "the force",
        full: GREEN_SPRINGS,
        without: None,
        steps: Steps::Chain,
    },
    Part {
        force: "windforce",
        name: "all",
        meaning: "the force",
        full: WIND,
        without: None,
        steps: Steps::None,
    },
];

/// The force beside which parts are measured. Without it, gravitation is measured alone, and forces on every particle
/// beside gravitation.
pub(super) const COMPANION: Elements = SPRINGS;

/// An additional force for the case that a wrong Jacobian keeps the particles on their lines.
pub(super) const EXCITER: Elements = CONSTANT;

/// The force beside which forces on every particle are measured if there are no springs.
pub(super) const SECOND_COMPANION: Elements = GRAVITATION;

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
        pairs(dimension).iter().map(|pair| difference(&state.positions, *pair)).collect();
    let is_good = |(pair, d): (&[usize; 2], &Vec<f64>)| {
        let w = difference(&state.velocities, *pair);
        let along = dot(d, &w) / norm(d);
        let across = (dot(&w, &w) - along * along).max(0.0).sqrt();
        let components = d.iter().chain(&w).all(|component| component.abs() >= 0.1875);
        (1.25..2.25).contains(&norm(d)) && along.abs() > 0.375 && across > 0.375 && components
    };
    // The volume of the unit vectors along the pairs: the chain is not flat.
    let unit = |row: usize, column: usize| directions[row][column] / norm(&directions[row]);
    let volume = DMatrix::from_fn(count, count, unit).determinant();
    pairs(dimension).iter().zip(&directions).all(is_good) && volume.abs() > 0.5
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
    let name = if implicit { "linearized-implicit-euler" } else { "explicit-euler" };
    let method = integrator::REGISTRY.iter().find(|kind| kind.schema.name == name);
    let method = method.map_or(&integrator::REGISTRY[0].schema, |kind| &kind.schema);
    let numbers = 0..groups.len();
    let edges = numbers.flat_map(|group| {
        pairs(dimension).iter().map(move |pair| pair.map(|i| group * chain(dimension) + i))
    });
    Scene {
        duration: time_step,
        time_step,
        particles: groups.iter().flat_map(|group| particles(group, dimension)).collect(),
        edges: edges.map(|particles| Edge { particles, radius: EDGE_RADIUS }).collect(),
        forces: elements.iter().flat_map(|of| force_elements(*of, dimension, groups)).collect(),
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

fn force_elements(of: Elements, dimension: Dimension, groups: &[Group]) -> Vec<ForceElement> {
    let Some(kind) = force::REGISTRY.iter().find(|kind| kind.schema.tag == of.tag) else {
        return Vec::new();
    };
    let schema: &'static ForceSchema = &kind.schema;
    let element = |parameters, pair, edge| ForceElement {
        schema,
        pair,
        edge,
        parameters,
        location: Location::default(),
    };
    if schema.acts_on == ActsOn::EveryParticle {
        let mut parameters = of.parameters[0];
        for (value, parameter) in parameters.iter_mut().zip(schema.parameters) {
            if parameter.three_dimensional && dimension == Dimension::Two {
                *value = 0.0;
            }
        }
        return vec![element(parameters, None, None)];
    }
    let pairs = pairs(dimension);
    let mut found = Vec::with_capacity(groups.len() * pairs.len());
    for (number, group) in groups.iter().enumerate() {
        for (link, ([i, j], mut parameters)) in pairs.iter().zip(of.parameters).enumerate() {
            if of.per_mass {
                parameters[0] /= group.masses[*i] * group.masses[*j];
            }
            let pair = [i, j].map(|particle| number * chain(dimension) + particle);
            let edge = (schema.acts_on == ActsOn::Edge).then_some(number * pairs.len() + link);
            found.push(element(parameters, Some(pair), edge));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_force_of_the_registry_has_a_part_in_its_order() {
        let mut tags: Vec<&str> = PARTS.iter().map(|part| part.force).collect();
        tags.dedup();
        let mut registered: Vec<&str> =
            force::REGISTRY.iter().map(|kind| kind.schema.tag).collect();
        tags.sort_unstable();
        registered.sort_unstable();
        assert_eq!(tags, registered);
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
