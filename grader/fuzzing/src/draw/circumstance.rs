//! Circumstances of a scene: what may hide a mistake, or show it. Which features were drawn under which of them is the coverage of
//! a run.

use scene::{Dimension, ForceElement, Particle, Scene};

/// Ratio of masses from which they are far apart.
const FAR: f64 = 50.0;

/// The same of masses that are very far apart.
const VERY_FAR: f64 = 1e4;

/// A mass from which on a particle is heavy; its inverse is that of a light one.
const HEAVY: f64 = 1000.0;

/// The same of a very heavy, and a very light one.
const VERY_HEAVY: f64 = 1e6;

/// The distance of particles that are close.
const CLOSE: f64 = 1e-3;

/// Ratio of the distance of particles from the origin to that from each other, from which they are far from the origin.
const REMOTE: f64 = 1e3;

/// Elements at a particle from which on there are many.
const MANY: usize = 8;

/// A feature under a circumstance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Pair {
    /// The tag of a force, or the name of an integrator.
    pub feature: &'static str,
    /// A circumstance, or another feature.
    pub with: &'static str,
}

/// Whether a circumstance of a scene holds.
type OfScene = fn(&Scene) -> bool;

/// Whether a circumstance of an element holds.
type OfElement = fn(&ForceElement, &Scene) -> bool;

/// The circumstances of a scene by name.
const OF_SCENES: [(&str, OfScene); 21] = [
    ("one particle", |scene| scene.particles.len() == 1),
    ("many particles", |scene| scene.particles.len() > MANY),
    ("fixed", |scene| any(scene, |particle| particle.fixed)),
    ("fixed and moving", |scene| any(scene, |particle| particle.fixed && is_moving(particle))),
    ("at rest", |scene| !any(scene, is_moving)),
    ("unit mass", |scene| any(scene, |particle| particle.mass == 1.0)),
    ("equal masses", |scene| scene.particles.windows(2).any(|pair| pair[0].mass == pair[1].mass)),
    ("masses far apart", |scene| mass_ratio(scene) > FAR),
    ("masses very far apart", |scene| mass_ratio(scene) > VERY_FAR),
    ("light", |scene| any(scene, |particle| particle.mass < 1.0 / HEAVY)),
    ("heavy", |scene| any(scene, |particle| particle.mass > HEAVY)),
    ("very light", |scene| any(scene, |particle| particle.mass < 1.0 / VERY_HEAVY)),
    ("very heavy", |scene| any(scene, |particle| particle.mass > VERY_HEAVY)),
    ("without motion in an axis", |scene| {
        let is_flat = |axis: &usize| {
            let mut neighbours = scene.particles.windows(2);
            neighbours.all(|pair| pair[0].position[*axis] == pair[1].position[*axis])
                && scene.particles.iter().all(|particle| particle.velocity[*axis] == 0.0)
        };
        (0..scene.dimension.count()).any(|axis| is_flat(&axis))
    }),
    ("an edge without a force", |scene| {
        let is_used = |edge: usize| scene.forces.iter().any(|force| force.edge == Some(edge));
        !(0..scene.edges.len()).all(is_used)
    }),
    ("without a force", |scene| {
        let has_field = scene.forces.iter().any(|element| element.schema.stencil.is_field());
        let touched =
            |number: &usize| scene.forces.iter().any(|element| element.particles.contains(number));
        !has_field && !(0..scene.particles.len()).all(|number| touched(&number))
    }),
    ("no step", |scene| scene.n_steps() == 0),
    ("one step", |scene| scene.n_steps() == 1),
    ("many steps", |scene| scene.n_steps() > 20),
    ("cut last step", |scene| (scene.duration / scene.time_step).fract() != 0.0),
    ("three dimensions", |scene| scene.dimension == Dimension::Three),
];

/// The circumstances of a force by name: of one of its elements in a scene.
const OF_ELEMENTS: [(&str, OfElement); 13] = [
    ("along an axis", |element, scene| {
        differences(element, scene).any(|d| d.iter().filter(|d| **d != 0.0).count() == 1)
    }),
    ("diagonal", |element, scene| {
        let is_diagonal = |[x, y, z]: [f64; 3]| {
            let pairs = [[x, y], [y, z], [z, x]];
            pairs.iter().any(|[a, b]| *a != 0.0 && a.abs() == b.abs())
        };
        differences(element, scene).any(is_diagonal)
    }),
    ("close", |element, scene| {
        differences(element, scene).any(|d| (0.0..CLOSE).contains(&size(d)) && d != [0.0; 3])
    }),
    ("far from the origin", |element, scene| {
        let place = element.particles.first().map(|first| size(scene.particles[*first].position));
        differences(element, scene)
            .any(|d| d != [0.0; 3] && place.is_some_and(|place| place > REMOTE * size(d)))
    }),
    ("with equal velocities", |element, scene| {
        let same = |[a, b]: [&Particle; 2]| is_moving(a) && a.velocity == b.velocity;
        neighbours(element, scene).any(same)
    }),
    ("turned round within a step", |element, scene| {
        neighbours(element, scene).any(|pair| {
            let [now, then] = [0.0, scene.time_step].map(|h| difference(pair, h));
            now.iter().zip(then).map(|(now, then)| now * then).sum::<f64>() < 0.0
        })
    }),
    ("between fixed particles", |element, scene| {
        let mut ends = element.particles.iter();
        !element.particles.is_empty() && ends.all(|end| scene.particles[*end].fixed)
    }),
    ("at rest length", |element, scene| {
        let mut values = element.schema.parameters.iter().zip(&element.parameters);
        let length = element.path_length(&scene.particles);
        values.any(|(schema, value)| schema.is_length && *value == length)
    }),
    ("compressed", |element, scene| {
        let mut values = element.schema.parameters.iter().zip(&element.parameters);
        values.any(|(schema, value)| {
            schema.is_length && differences(element, scene).any(|d| 2.0 * size(d) < *value)
        })
    }),
    ("same particles twice", |element, scene| {
        let is_same = |other: &&ForceElement| {
            other.schema == element.schema && other.particles == element.particles
        };
        scene.forces.iter().filter(is_same).count() > 1
    }),
    ("many at a particle", |element, scene| {
        element.particles.iter().any(|end| {
            let at = |other: &&ForceElement| {
                other.schema == element.schema && other.particles.contains(end)
            };
            scene.forces.iter().filter(at).count() > MANY
        })
    }),
    ("a parameter is 1", |element, _| element.parameters.contains(&1.0)),
    ("a parameter is negative", |element, _| element.parameters.iter().any(|value| *value < 0.0)),
];

fn any(scene: &Scene, is: fn(&Particle) -> bool) -> bool {
    scene.particles.iter().any(is)
}

/// The largest mass over the smallest.
fn mass_ratio(scene: &Scene) -> f64 {
    let masses = || scene.particles.iter().map(|particle| particle.mass);
    masses().fold(0.0, f64::max) / masses().fold(f64::INFINITY, f64::min)
}

fn is_moving(particle: &Particle) -> bool {
    particle.velocity != [0.0; 3]
}

/// Neighbours within the stencil of a force.
fn neighbours<'a>(
    element: &'a ForceElement,
    scene: &'a Scene,
) -> impl Iterator<Item = [&'a Particle; 2]> {
    let pairs = element.particles.windows(2);
    pairs.map(|pair| [pair[0], pair[1]].map(|number| &scene.particles[number]))
}

/// The difference of two positions after a time without forces.
fn difference([a, b]: [&Particle; 2], h: f64) -> [f64; 3] {
    let at =
        |particle: &Particle, axis: usize| particle.position[axis] + h * particle.velocity[axis];
    [0, 1, 2].map(|axis| at(a, axis) - at(b, axis))
}

/// Differences of neighbours, where a step may evaluate forces: at its start, and at `x + h v`.
fn differences<'a>(
    element: &'a ForceElement,
    scene: &'a Scene,
) -> impl Iterator<Item = [f64; 3]> + 'a {
    neighbours(element, scene).flat_map(|pair| [0.0, scene.time_step].map(|h| difference(pair, h)))
}

fn size(vector: [f64; 3]) -> f64 {
    vector.iter().map(|value| value * value).sum::<f64>().sqrt()
}

/// Each feature of a scene with each of its circumstances, and with each other feature.
pub fn pairs(scene: &Scene) -> Vec<Pair> {
    let mut features: Vec<&'static str> =
        scene.forces.iter().map(|element| element.schema.tag).collect();
    features.sort_unstable();
    features.dedup();
    features.push(scene.integrator.name);
    let of_scene = OF_SCENES.iter().filter(|(_, holds)| holds(scene)).map(|(name, _)| *name);
    let of_scene: Vec<&'static str> = of_scene.collect();
    let mut all = Vec::new();
    for (number, feature) in features.iter().enumerate() {
        let others = features[number + 1..].iter().chain(&of_scene);
        all.extend(others.map(|with| Pair { feature, with }));
    }
    // A parameter by name: it is 0 in each element.
    for (number, element) in scene.forces.iter().enumerate() {
        let is_same = |other: &&ForceElement| other.schema == element.schema;
        if scene.forces[..number].iter().any(|other| is_same(&other)) {
            continue;
        }
        for (place, parameter) in element.schema.parameters.iter().enumerate() {
            if scene.forces.iter().filter(is_same).all(|one| one.parameters[place] == 0.0) {
                all.push(Pair { feature: element.schema.tag, with: parameter.name });
            }
        }
    }
    for (with, holds) in OF_ELEMENTS {
        let mut tags: Vec<&'static str> = Vec::new();
        for element in &scene.forces {
            let feature = element.schema.tag;
            if !tags.contains(&feature) && holds(element, scene) {
                tags.push(feature);
                all.push(Pair { feature, with });
            }
        }
    }
    all
}
