//! States at which Jacobians are checked, each with a name.
//!
//! Half of them are random. The others are deliberately hard: almost zero length, compressed and stretched, mass ratios
//! of 1e9, far from the origin, velocities along and across the line of two particles, no velocity, straight, folded and
//! clockwise elements of three particles, inverted ones of four, and every parameter that may be zero at zero. Some have a particle more than one element needs, with elements that share particles, are
//! listed backwards, or act on the same. Parameters are drawn from the schema's typical values.
//!
//! Coordinates are multiples of a power of two with spare digits, so that differences can take exact steps.

use std::f64::consts::{FRAC_PI_2, PI};
use std::ops::Range;

use fastrand::Rng;
use scene::schema::{Domain, ForceSchema, Initial, ParameterSchema, Stencil};
use scene::{Dimension, EDGE_RADIUS, Edge, ForceElement, PARTICLE_RADIUS, Particle, Scene};
use simulator::force::ForceKind;
use simulator::integrator;

/// A state: the initial state of a scene, at a given time.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckState {
    /// The name in reports.
    pub name: String,
    /// Masses, elements, positions and velocities.
    pub scene: Scene,
    /// Time, in seconds.
    pub time: f64,
}

impl CheckState {
    /// Positions, `n·D`, particle-major.
    pub fn positions(&self) -> Vec<f64> {
        self.scene.positions()
    }

    /// Velocities, the same shape.
    pub fn velocities(&self) -> Vec<f64> {
        self.scene.velocities()
    }

    /// Mass of each particle.
    pub fn masses(&self) -> Vec<f64> {
        self.scene.particles.iter().map(|particle| particle.mass).collect()
    }
}

/// The distance between the first two particles.
#[derive(Clone, Copy)]
enum Length {
    /// Between half a unit and three units.
    Any,
    /// This many rest lengths, or units if the force has no rest length.
    Times(f64),
}

/// The velocities.
#[derive(Clone, Copy, PartialEq)]
enum Motion {
    Any,
    Along,
    Across,
    Alike,
    Rest,
}

/// The directions from one particle to the next.
#[derive(Clone, Copy, PartialEq)]
enum Course {
    Any,
    /// Along so many axes in turn, x first.
    Axes(usize),
    /// Along x and y, then against z: particles of a solid are turned inside out.
    Inverted,
    /// Each turned by this angle from the one before.
    Turning(f64),
}

/// Angle between two lines that are nearly parallel, in radians: as small as coordinates of few digits resolve it.
const SLIGHT: f64 = 1.0 / 64.0;

/// Values that the author of an element has fixed, the same at all of its states.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Given {
    /// Values of parameters, in the order of the schema; `None` where one is drawn.
    pub parameters: Vec<Option<f64>>,
    /// Masses of the particles of an element; empty where they are drawn.
    pub masses: Vec<f64>,
}

impl Given {
    fn parameter(&self, place: usize) -> Option<f64> {
        self.parameters.get(place).copied().flatten()
    }

    /// Whether a state of this plan can have what is given.
    fn allows(&self, plan: &Plan) -> bool {
        let is_drawn = self.parameters.iter().all(Option::is_none) && self.masses.is_empty();
        let is_one = plan.arrangement == Arrangement::Single;
        let has_own = plan.without.is_some_and(|place| self.parameter(place).is_some());
        is_drawn || is_one && !has_own && (self.masses.is_empty() || plan.masses == PLAIN.masses)
    }
}

/// A recipe for a random state.
#[derive(Clone, Copy)]
struct Plan {
    length: Length,
    motion: Motion,
    /// Distance of the first particle from the origin.
    far: f64,
    masses: [f64; 2],
    /// A parameter to set to zero, or to the smallest value in its domain.
    without: Option<usize>,
    course: Course,
    arrangement: Arrangement,
}

/// The particles that the elements act on; those of a field, as if it acted between two.
#[derive(Clone, Copy, PartialEq)]
enum Arrangement {
    /// One element.
    Single,
    /// One, on the particles in descending order.
    Backwards,
    /// One, and one that begins at its second particle.
    Chain,
    /// The same, the second in descending order.
    ChainBackwards,
    /// Two on the same particles, which are all but the second.
    Twice,
}

impl Arrangement {
    fn stencils(self, size: usize) -> Vec<Vec<usize>> {
        let first: Vec<usize> = (0..size).collect();
        let reversed = |particles: Range<usize>| particles.rev().collect();
        match self {
            Self::Single => vec![first],
            Self::Backwards => vec![reversed(0..size)],
            Self::Chain => vec![first, (1..size + 1).collect()],
            Self::ChainBackwards => vec![first, reversed(1..size + 1)],
            Self::Twice => vec![(0..size + 1).filter(|particle| *particle != 1).collect(); 2],
        }
    }

    fn n_particles(self, size: usize) -> usize {
        match self {
            Self::Single | Self::Backwards => size,
            Self::Chain | Self::ChainBackwards | Self::Twice => size + 1,
        }
    }
}

/// The particles of an element, or as many as suffice for a field.
fn size_of(schema: &ForceSchema) -> usize {
    schema.stencil.size().max(2)
}

const PLAIN: Plan = Plan {
    length: Length::Any,
    motion: Motion::Any,
    far: 0.0,
    masses: [0.5, 4.0],
    without: None,
    course: Course::Any,
    arrangement: Arrangement::Single,
};

/// The states for `kind`: `random` random ones, and the hard ones.
pub fn states(
    kind: &'static ForceKind,
    dimension: Dimension,
    random: u32,
    seed: u64,
) -> Vec<CheckState> {
    states_given(kind, dimension, random, seed, &Given::default())
}

/// The same with what is given; one element is then all that acts.
pub fn states_given(
    kind: &'static ForceKind,
    dimension: Dimension,
    random: u32,
    seed: u64,
    given: &Given,
) -> Vec<CheckState> {
    let mut plans: Vec<(String, Plan)> =
        (1..=random).map(|number| (format!("random {number}"), PLAIN)).collect();
    let mut hard = |name: &str, plan: Plan| plans.push((name.to_owned(), plan));
    let more = match size_of(&kind.schema) {
        2 => "three".to_owned(),
        3 => "four".to_owned(),
        4 => "five".to_owned(),
        size => (size + 1).to_string(),
    };
    let length = |times: f64| Plan { length: Length::Times(times), ..PLAIN };
    hard("length nearly zero", length(1e-6));
    hard("compressed to a hundredth", length(0.01));
    hard("stretched a hundred times", length(100.0));
    hard("at rest length", length(1.0));
    hard("just compressed", length(0.75));
    hard("mass ratio 1e9", Plan { masses: [1e-3, 1e6], ..PLAIN });
    hard("1e6 from the origin", Plan { far: 1e6, ..PLAIN });
    hard("1e8 from the origin", Plan { far: 1e8, ..PLAIN });
    hard("velocity along the line", Plan { motion: Motion::Along, ..PLAIN });
    hard("velocity across the line", Plan { motion: Motion::Across, ..PLAIN });
    hard("velocities alike", Plan { motion: Motion::Alike, ..PLAIN });
    hard("at rest", Plan { motion: Motion::Rest, ..PLAIN });
    // In a plane, the triangles of a hinge are folded onto each other, where its force jumps.
    let axes = if kind.schema.initial == Initial::Hinge { 3 } else { 2 };
    hard("along the x axis", Plan { course: Course::Axes(axes), ..PLAIN });
    if kind.schema.stencil.size() > 3 && dimension == Dimension::Three {
        let inverted = Plan { course: Course::Inverted, ..PLAIN };
        hard("inverted", inverted);
        hard("inverted, crushed", Plan { length: Length::Times(0.01), ..inverted });
    }
    if kind.schema.stencil.size() > 2 {
        let mut turning =
            |name, angle| hard(name, Plan { course: Course::Turning(angle), ..PLAIN });
        if dimension == Dimension::Two {
            turning("straight", 0.0);
        }
        turning("nearly straight", SLIGHT);
        turning("nearly straight, the other way", -SLIGHT);
        turning("nearly folded", PI - SLIGHT);
        turning("clockwise", -FRAC_PI_2);
    }
    for (number, parameter) in kind.schema.parameters.iter().enumerate() {
        if parameter.domain == Domain::NonNegative {
            let name = parameter.name;
            let plan = Plan { without: Some(number), ..PLAIN };
            hard(&format!("{name} = 0"), plan);
            let at = |times| Plan { length: Length::Times(times), ..plan };
            hard(&format!("{name} = 0, compressed"), at(0.5));
            hard(&format!("{name} = 0, stretched"), at(1.5));
            let chain = Plan { arrangement: Arrangement::Chain, ..plan };
            hard(&format!("{name} = 0, {more} particles"), chain);
        }
    }
    let arranged = |arrangement| Plan { arrangement, ..PLAIN };
    hard("listed backwards", arranged(Arrangement::Backwards));
    hard(&format!("{more} particles, two elements"), arranged(Arrangement::Chain));
    let backwards = arranged(Arrangement::ChainBackwards);
    hard(&format!("{more} particles, one element backwards"), backwards);
    let same = if size_of(&kind.schema) == 2 { "one pair" } else { "the same particles" };
    hard(&format!("two elements on {same}, a particle beside"), arranged(Arrangement::Twice));

    // These are hard for differences of two positions. A field of the position itself is rounded with it: far from the origin,
    // or in a tiny box, nothing can be measured.
    if kind.schema.stencil.is_field() && kind.schema.depends_on().position {
        plans.retain(|(_, plan)| plan.far == 0.0 && matches!(plan.length, Length::Any));
    }
    plans.retain(|(_, plan)| given.allows(plan));
    let mut rng = Rng::with_seed(seed);
    let draw = |(name, plan)| CheckState { name, ..draw(kind, dimension, &plan, given, &mut rng) };
    plans.into_iter().map(draw).collect()
}

fn draw(
    kind: &'static ForceKind,
    dimension: Dimension,
    plan: &Plan,
    given: &Given,
    rng: &mut Rng,
) -> CheckState {
    let schema = &kind.schema;
    let stencils = plan.arrangement.stencils(size_of(schema));
    let length = schema.parameters.iter().position(|parameter| parameter.is_length);
    let mut rest_length = 1.0;
    let elements = stencils.iter().enumerate().map(|(number, particles)| {
        let mut parameters = schema.zeros();
        for (place, (value, parameter)) in parameters.iter_mut().zip(schema.parameters).enumerate()
        {
            let absent = plan.without == Some(place)
                || (parameter.three_dimensional && dimension == Dimension::Two);
            let drawn = if absent { 0.0 } else { typical(parameter, rng) };
            *value = given.parameter(place).unwrap_or(drawn);
            if Some(place) == length && number == 0 && *value > 0.0 {
                rest_length = *value;
            }
        }
        let acts_on = if schema.stencil.is_field() { 0 } else { schema.stencil.size() };
        let edge = (schema.stencil == Stencil::Edge).then_some(number);
        ForceElement::new(schema, &particles[..acts_on], edge, parameters)
    });
    let elements = elements.collect();
    let (mut scene, time) = compose(elements, &stencils, dimension, plan, rest_length, rng);
    for (particle, mass) in scene.particles.iter_mut().zip(given.masses.iter().cycle()) {
        particle.mass = *mass;
    }
    CheckState { name: String::new(), scene, time }
}

/// A value within the typical bounds, a multiple of 2⁻¹⁰ or a bound.
fn typical(parameter: &ParameterSchema, rng: &mut Rng) -> f64 {
    let (low, high) = parameter.typical;
    on_grid(low + (high - low) * rng.f64(), 10).clamp(low, high)
}

fn compose(
    elements: Vec<ForceElement>,
    stencils: &[Vec<usize>],
    dimension: Dimension,
    plan: &Plan,
    rest_length: f64,
    rng: &mut Rng,
) -> (Scene, f64) {
    let n_particles = plan.arrangement.n_particles(stencils[0].len());
    let positions = positions(n_particles, dimension, plan, rest_length, rng);
    let line: [f64; 3] = std::array::from_fn(|axis| positions[1][axis] - positions[0][axis]);
    let velocities = velocities(dimension, plan.motion, line, n_particles, rng);
    let particles =
        positions.into_iter().zip(velocities).enumerate().map(|(number, (position, velocity))| {
            let mass = match plan.masses {
                [low, high] if low * 1e6 > high => on_grid(low + (high - low) * rng.f64(), 10),
                masses => masses[number % 2],
            };
            Particle { mass, position, velocity, fixed: false, radius: PARTICLE_RADIUS, tag: None }
        });
    let edges = stencils
        .iter()
        .map(|stencil| Edge { particles: [stencil[0], stencil[1]], radius: EDGE_RADIUS });
    let scene = Scene {
        particles: particles.collect(),
        edges: edges.collect(),
        forces: elements,
        ..Scene::new("state", dimension, &integrator::REGISTRY[0].schema)
    };
    (scene, on_grid(8.0 * rng.f64(), 10))
}

fn positions(
    n_particles: usize,
    dimension: Dimension,
    plan: &Plan,
    rest_length: f64,
    rng: &mut Rng,
) -> Vec<[f64; 3]> {
    let first = vector(dimension, rng).map(|component| on_grid(component + plan.far, 12));
    let mut positions = vec![first];
    let mut before: Option<[f64; 3]> = None;
    while positions.len() < n_particles {
        let length = match plan.length {
            Length::Any => 0.5 + 2.5 * rng.f64(),
            Length::Times(times) => times * rest_length,
        };
        let any = unit(vector(dimension, rng));
        let direction = match (plan.course, before) {
            (Course::Any, _) | (Course::Turning(_), None) => any,
            (Course::Axes(count), _) => {
                std::array::from_fn(|axis| f64::from(axis == (positions.len() - 1) % count))
            }
            (Course::Inverted, _) => match positions.len() % 3 {
                0 => [0.0, 0.0, -1.0],
                1 => [1.0, 0.0, 0.0],
                _ => [0.0, 1.0, 0.0],
            },
            (Course::Turning(angle), Some(before)) => turned(before, any, dimension, angle),
        };
        before = Some(direction);
        // Twelve binary digits of the length: sums stay exact near the origin.
        let digits = 12 - length.log2().floor() as i32;
        let last = positions[positions.len() - 1];
        positions.push(std::array::from_fn(|axis| {
            let offset = on_grid(length * direction[axis], digits);
            if axis < dimension.count() { last[axis] + offset } else { 0.0 }
        }));
    }
    positions.iter_mut().for_each(|position| position[dimension.count()..].fill(0.0));
    positions
}

fn velocities(
    dimension: Dimension,
    motion: Motion,
    line: [f64; 3],
    n_particles: usize,
    rng: &mut Rng,
) -> Vec<[f64; 3]> {
    let base = vector(dimension, rng).map(|component| on_grid(2.0 * component, 12));
    let speed = on_grid(0.5 + rng.f64(), 12);
    let along = unit(line);
    // A quarter turn in the plane. In space it is perpendicular as well, unless the line is the z axis.
    let across = [-along[1], along[0], 0.0];
    (0..n_particles)
        .map(|number| match motion {
            Motion::Any => vector(dimension, rng).map(|component| on_grid(2.0 * component, 12)),
            Motion::Rest => [0.0; 3],
            _ if number == 0 => base,
            Motion::Alike => base,
            Motion::Along | Motion::Across => {
                let direction = if motion == Motion::Along { along } else { across };
                std::array::from_fn(|axis| base[axis] + on_grid(speed * direction[axis], 24))
            }
        })
        .collect()
}

/// Components between −1 and 1; the third is 0 in two dimensions.
fn vector(dimension: Dimension, rng: &mut Rng) -> [f64; 3] {
    std::array::from_fn(|axis| if axis < dimension.count() { 2.0 * rng.f64() - 1.0 } else { 0.0 })
}

fn unit(vector: [f64; 3]) -> [f64; 3] {
    let length = vector.iter().map(|component| component * component).sum::<f64>().sqrt();
    if length == 0.0 { [1.0, 0.0, 0.0] } else { vector.map(|component| component / length) }
}

/// The direction turned by an angle: anticlockwise in two dimensions, towards `aside` in three.
fn turned(direction: [f64; 3], aside: [f64; 3], dimension: Dimension, angle: f64) -> [f64; 3] {
    let [x, y, _] = direction;
    let across = match dimension {
        Dimension::Two => [-y, x, 0.0],
        Dimension::Three => {
            let along: f64 = direction.iter().zip(aside).map(|(a, b)| a * b).sum();
            unit(std::array::from_fn(|axis| aside[axis] - along * direction[axis]))
        }
    };
    std::array::from_fn(|axis| angle.cos() * direction[axis] + angle.sin() * across[axis])
}

/// The nearest multiple of `2⁻ᵈⁱᵍⁱᵗˢ`.
fn on_grid(value: f64, digits: i32) -> f64 {
    let grid = 2.0_f64.powi(digits);
    (value * grid).round() / grid
}
