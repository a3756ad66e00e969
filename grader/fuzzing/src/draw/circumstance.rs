//! Circumstances of a scene: what may hide a mistake, or show it. Which features were drawn under which of them is the coverage of
//! a run.

use scene::{Dimension, Particle, Scene};

/// Ratio of masses from which they are far apart.
const FAR: f64 = 50.0;

/// The same of masses that are very far apart.
const VERY_FAR: f64 = 1e4;

/// A mass from which on a particle is heavy; its inverse is that of a light one.
const HEAVY: f64 = 1000.0;

/// A feature under a circumstance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Pair {
    /// The tag of a force, or the name of an integrator.
    pub feature: &'static str,
    /// A circumstance, or another feature.
    pub with: &'static str,
}

/// Whether a circumstance holds.
type Holds = fn(&Scene) -> bool;

/// The circumstances by name.
const ALL: [(&str, Holds); 24] = [
    ("one particle", |scene| scene.particles.len() == 1),
    ("many particles", |scene| scene.particles.len() > 8),
    ("fixed", |scene| any(scene, |particle| particle.fixed)),
    ("fixed and moving", |scene| any(scene, |particle| particle.fixed && is_moving(particle))),
    ("at rest", |scene| !any(scene, is_moving)),
    ("unit mass", |scene| any(scene, |particle| particle.mass == 1.0)),
    ("equal masses", |scene| scene.particles.windows(2).any(|pair| pair[0].mass == pair[1].mass)),
    ("masses far apart", |scene| mass_ratio(scene) > FAR),
    ("masses very far apart", |scene| mass_ratio(scene) > VERY_FAR),
    ("light", |scene| any(scene, |particle| particle.mass < 1.0 / HEAVY)),
    ("heavy", |scene| any(scene, |particle| particle.mass > HEAVY)),
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
    ("along an axis", |scene| {
        pairs_of(scene).any(|[a, b]| {
            (0..scene.dimension.count())
                .filter(|axis| a.position[*axis] != b.position[*axis])
                .count()
                == 1
        })
    }),
    ("at rest length", |scene| {
        scene.forces.iter().any(|element| {
            let mut values = element.schema.parameters.iter().zip(&element.parameters);
            let length = element.path_length(&scene.particles);
            values.any(|(schema, value)| schema.is_length && *value == length)
        })
    }),
    ("same particles twice", |scene| {
        scene.forces.windows(2).any(|pair| {
            let [a, b] = [&pair[0], &pair[1]];
            a.schema == b.schema && a.particles == b.particles
        })
    }),
    ("without a force", |scene| {
        let has_field = scene.forces.iter().any(|element| element.schema.stencil.is_field());
        let touched =
            |number: &usize| scene.forces.iter().any(|element| element.particles.contains(number));
        !has_field && !(0..scene.particles.len()).all(|number| touched(&number))
    }),
    ("a parameter is 0", |scene| {
        scene.forces.iter().any(|element| element.parameters.contains(&0.0))
    }),
    ("a parameter is 1", |scene| {
        scene.forces.iter().any(|element| element.parameters.contains(&1.0))
    }),
    ("no step", |scene| scene.n_steps() == 0),
    ("one step", |scene| scene.n_steps() == 1),
    ("many steps", |scene| scene.n_steps() > 20),
    ("cut last step", |scene| (scene.duration / scene.time_step).fract() != 0.0),
    ("three dimensions", |scene| scene.dimension == Dimension::Three),
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

/// Neighbours within the stencils of forces.
fn pairs_of(scene: &Scene) -> impl Iterator<Item = [&Particle; 2]> {
    let pairs = scene.forces.iter().flat_map(|element| element.particles.windows(2));
    pairs.map(|pair| [pair[0], pair[1]].map(|number| &scene.particles[number]))
}

/// The circumstances of a scene.
pub fn circumstances(scene: &Scene) -> Vec<&'static str> {
    ALL.iter().filter(|(_, holds)| holds(scene)).map(|(name, _)| *name).collect()
}

/// Each feature of a scene with each of its circumstances, and with each other feature.
pub fn pairs(scene: &Scene) -> Vec<Pair> {
    let mut features: Vec<&'static str> =
        scene.forces.iter().map(|element| element.schema.tag).collect();
    features.sort_unstable();
    features.dedup();
    features.push(scene.integrator.name);
    let circumstances = circumstances(scene);
    let mut all = Vec::new();
    for (number, feature) in features.iter().enumerate() {
        let others = features[number + 1..].iter().chain(&circumstances);
        all.extend(others.map(|with| Pair { feature, with }));
    }
    all
}
