//! Draws scenes from the facts of the registries.
//!
//! ```text
//! scope ── dimension, integrator, kinds of forces ── particles ── elements ── time ── text        each from `Choices`
//! ```
//!
//! Half of the scenes have one or two particles and one to three steps: most mistakes show there, and a run takes no time. The
//! rest have up to [`MOST_PARTICLES`] particles and [`MOST_STEPS`] steps. Values are typical ones of the schemas, or special:
//! zero, one, equal to another, aligned with an axis, at rest, at the rest length, near another. Some scenes have whole numbers
//! and powers of two alone. The time step follows the stiffest element, so that few scenes explode.

mod circumstance;
mod text;
mod values;

use scene::schema::{
    ForceSchema, Initial, IntegratorOptions, IntegratorSchema, Masses, OptionKind, Stencil,
};
use scene::{
    Dimension, Edge, ForceElement, PARTICLE_RADIUS, ParseOptions, Particle, Particles, Scene,
    write, xml,
};
use simulator::vocabulary;

use crate::choices::Choices;
use crate::masses;

pub use circumstance::{Pair, pairs};

/// The most particles of a drawn scene: beyond every size up to which small systems are solved otherwise.
pub const MOST_PARTICLES: usize = 40;

/// The most steps of a drawn scene.
pub const MOST_STEPS: usize = 120;

/// The most states of particles in a scene.
const MOST_PLACES: usize = 300;

/// The most kinds of forces: the search for causes tries each part of each.
const MOST_KINDS: usize = 5;

/// The most elements of one kind of force.
const MOST_ELEMENTS: usize = 12;

/// The same of a field.
const MOST_FIELDS: usize = 5;

/// The features that a drawn scene may have.
#[derive(Debug, Clone)]
pub struct Scope {
    /// The forces.
    pub forces: Vec<&'static ForceSchema>,
    /// The integrators, as a scene may spell them.
    pub integrators: Vec<(&'static IntegratorSchema, &'static str)>,
    /// The dimensions.
    pub dimensions: Vec<Dimension>,
}

impl Scope {
    /// Everything in the registries.
    pub fn all() -> Self {
        let vocabulary = vocabulary();
        let spellings = |schema: &&'static IntegratorSchema| {
            let schema: &'static IntegratorSchema = schema;
            let aliases = schema.aliases.iter().copied();
            std::iter::once(schema.name).chain(aliases).map(move |spelling| (schema, spelling))
        };
        Self {
            integrators: vocabulary.integrators.iter().flat_map(spellings).collect(),
            forces: vocabulary.forces,
            dimensions: vec![Dimension::Two, Dimension::Three],
        }
    }

    /// The scope of an assignment.
    pub fn of(assignment: &grader::suite::assignment::Scope) -> Self {
        let mut scope = Self::all();
        let is_listed = |list: &Option<Vec<String>>, word: &str| {
            list.as_ref().is_none_or(|list| list.iter().any(|listed| listed == word))
        };
        scope.forces.retain(|schema| is_listed(&assignment.forces, schema.tag));
        scope.integrators.retain(|(_, spelling)| is_listed(&assignment.integrators, spelling));
        if let Some(dimensions) = &assignment.dimensions {
            scope.dimensions.retain(|dimension| dimensions.contains(&dimension.count()));
        }
        scope
    }
}

/// A drawn scene.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// The choices that draw it.
    pub choices: Vec<u64>,
    /// The scene.
    pub scene: Scene,
    /// Its file.
    pub text: String,
}

/// A scene whose file is not drawn yet.
#[derive(Debug)]
pub struct Sketch {
    /// The scene.
    pub scene: Scene,
    spelling: &'static str,
    choices: Choices,
}

impl Sketch {
    /// Draws all but the file.
    pub fn new(scope: &Scope, mut choices: Choices) -> Self {
        let (scene, spelling) = scene(scope, &mut choices);
        Self { scene, spelling, choices }
    }

    /// Draws the file; `None` where none can hold the scene, as one of a triangle without an area.
    pub fn with_file(mut self) -> Option<Drawn> {
        let text = text::of(&self.scene, self.spelling, &mut self.choices)?;
        let scene = read(&text)?;
        Some(Drawn { choices: self.choices.into_made(), scene, text })
    }
}

/// Draws a scene; `None` where no file can hold it.
pub fn draw(scope: &Scope, choices: Choices) -> Option<Drawn> {
    Sketch::new(scope, choices).with_file()
}

/// Reads a scene from XML; `None` if the text is not a scene.
pub fn read(text: &str) -> Option<Scene> {
    let options = ParseOptions { strict: true, ..ParseOptions::default() };
    xml::parse(text, "scene.xml", &vocabulary(), &options).ok().map(|parsed| parsed.scene)
}

/// The plain file of a scene; `None` if none can hold it.
pub fn plain(scene: &Scene) -> Option<String> {
    let mut bytes = Vec::new();
    write::write(scene, &mut bytes).ok()?;
    String::from_utf8(bytes).ok()
}

fn scene(scope: &Scope, choices: &mut Choices) -> (Scene, &'static str) {
    let dimension = choices.one_of(&scope.dimensions);
    let (integrator, spelling) = choices.one_of(&scope.integrators);
    let kinds = kinds(scope, dimension, integrator, choices);
    let needed = kinds.iter().map(|kind| kind.stencil.size()).max().unwrap_or(1);
    let count = match choices.below(16) {
        0..=7 => 1 + choices.below(2),
        8..=12 => 2 + choices.below(4),
        13 | 14 => 3 + choices.below(10),
        _ => 10 + choices.below(MOST_PARTICLES - 9),
    };
    let mut scene = Scene::new("scene.xml", dimension, integrator);
    // With coordinates of few values, vectors are often exactly equal, diagonal or along an axis, at `x + h v` as well.
    let is_whole = choices.chance(3);
    particles(&mut scene, count.max(needed), is_whole, choices);
    // A motion along one axis, or in a plane of space: what looks at one coordinate alone sees a 0.
    let flat = choices.chance(2).then(|| choices.below(dimension.count()));
    if let Some(axis) = flat {
        let place = scene.particles[0].position[axis];
        for particle in &mut scene.particles {
            (particle.position[axis], particle.velocity[axis]) = (place, 0.0);
        }
    }
    for kind in kinds {
        elements(&mut scene, kind, choices);
    }
    if let Some(axis) = flat {
        for element in &mut scene.forces {
            if let Some(vector) = masses::vector_of(element) {
                vector[axis] = 0.0;
            }
        }
    }
    scene.forces.retain(|element| (integrator.refuses)(element).is_none());
    options(&mut scene.integrator_options, integrator, choices);
    time(&mut scene, is_whole, choices);
    // The same motion in another unit of mass: what compares a mass or a pivot with a fixed number sees another one.
    if choices.chance(1) && masses::scale(&scene) {
        masses::multiply(&mut scene, choices.one_of(&[1e-8, 1e-5, 1e-3, 1e3, 1e5, 1e8]));
    }
    (scene, spelling)
}

/// The kinds of forces, most often one or two.
fn kinds(
    scope: &Scope,
    dimension: Dimension,
    integrator: &IntegratorSchema,
    choices: &mut Choices,
) -> Vec<&'static ForceSchema> {
    let mut left = scope.forces.clone();
    left.retain(|schema| schema.exists_in(dimension));
    let count = [1, 1, 1, 1, 2, 2, 2, 3, 3, 0, MOST_KINDS][choices.below(11)].min(left.len());
    // A method that takes rounds knows springs.
    let refuses_all = |schema: &&'static ForceSchema| {
        let ones = schema.parameters.iter().map(|parameter| parameter.samples[0]);
        let element = ForceElement::new(schema, &[], None, ones.collect());
        (integrator.refuses)(&element).is_some() && schema.parts.len() == 1
    };
    left.retain(|schema| !refuses_all(schema));
    (0..count.min(left.len())).map(|_| left.remove(choices.below(left.len()))).collect()
}

fn particles(scene: &mut Scene, count: usize, is_whole: bool, choices: &mut Choices) {
    let axes = scene.dimension.count();
    let (is_still, has_fixed) = (choices.chance(5), choices.chance(5));
    let size = if is_whole { None } else { Some(choices.one_of(&[1.0, 1.0, 1.0, 10.0, 0.1])) };
    let is_uneven = choices.chance(2);
    for number in 0..count {
        let before = &scene.particles[..number];
        let mass = values::mass(before, is_uneven, choices);
        let (mut position, mut velocity) = ([0.0; 3], [0.0; 3]);
        for (axis, value) in position.iter_mut().enumerate().take(axes) {
            let others: Vec<f64> = before.iter().map(|other| other.position[axis]).collect();
            *value = values::coordinate(size, &others, choices);
        }
        if let (Some(size), false, true) = (size, before.is_empty(), choices.chance(1)) {
            position = values::beside(before, size, axes, choices);
        }
        if !is_still && !choices.chance(2) {
            for value in &mut velocity[..axes] {
                *value = values::coordinate(size, &[], choices);
            }
        }
        scene.particles.push(Particle {
            mass,
            position,
            velocity,
            fixed: has_fixed && choices.chance(6),
            radius: PARTICLE_RADIUS,
            tag: None,
        });
    }
}

/// The elements of one kind.
fn elements(scene: &mut Scene, kind: &'static ForceSchema, choices: &mut Choices) {
    let n_particles = scene.particles.len();
    let count = match kind.stencil {
        Stencil::EveryParticle if choices.chance(12) => 1,
        Stencil::EveryParticle => 1 + choices.below(MOST_FIELDS),
        _ if choices.chance(11) => 1,
        _ if choices.chance(13) => 1 + choices.below(MOST_ELEMENTS.min(2 * n_particles)),
        _ => 1 + choices.below(MOST_ELEMENTS),
    };
    // One parameter is the same in all of them.
    let values = (0..kind.parameters.len()).filter(|at| kind.parameters[*at].coordinate.is_none());
    let values: Vec<usize> = values.collect();
    let common = choices.chance(4) && !values.is_empty();
    let common = common.then(|| choices.one_of(&values));
    let first = scene.forces.len();
    for _ in 0..count {
        let last =
            scene.forces.last().filter(|last| last.schema == kind && !kind.stencil.is_field());
        let (particles, edge) = match last {
            // Twice on the same particles, the second time possibly the other way round.
            Some(last) if choices.chance(2) => {
                let mut particles = last.particles.clone();
                if kind.stencil != Stencil::Edge && choices.chance(8) {
                    particles.reverse();
                }
                (particles, last.edge)
            }
            _ if kind.stencil.is_field() => (Particles::new(), None),
            _ => {
                let mut all: Vec<usize> = (0..n_particles).collect();
                let size = kind.stencil.size();
                let chosen = (0..size).map(|_| all.remove(choices.below(all.len())));
                let chosen: Particles = chosen.collect();
                let edge = (kind.stencil == Stencil::Edge).then(|| {
                    // An edge without a force, so that an element's number is not its edge's.
                    if choices.chance(1) {
                        scene.edges.push(Edge {
                            particles: [chosen[1], chosen[0]],
                            radius: scene::EDGE_RADIUS,
                        });
                    }
                    scene.edges.push(Edge {
                        particles: [chosen[0], chosen[1]],
                        radius: scene::EDGE_RADIUS,
                    });
                    scene.edges.len() - 1
                });
                (chosen, edge)
            }
        };
        let mut element = ForceElement::new(kind, &particles, edge, kind.zeros());
        values::parameters(&mut element, scene, choices);
        if let (Some(place), Some(first)) = (common, scene.forces.get(first)) {
            element.parameters[place] = first.parameters[place];
        }
        scene.forces.push(element);
    }
}

fn options(options: &mut IntegratorOptions, integrator: &IntegratorSchema, choices: &mut Choices) {
    for option in integrator.options {
        if !choices.chance(4) {
            continue;
        }
        let text = match option.kind {
            OptionKind::Number { default, .. } => {
                (default * choices.one_of(&[0.1, 10.0, 0.5])).to_string()
            }
            OptionKind::Count { least, .. } => (least + choices.below(5) as u64).to_string(),
            OptionKind::Choice { words } => choices.one_of(words).to_owned(),
        };
        // A value outside of the option's domain leaves the default.
        let _ = options.set(option.name, &text);
    }
    if options.excess().is_some() {
        *options = IntegratorOptions::defaults(integrator);
    }
}

/// Time steps, times the largest rate of a scene.
const STEPS: [f64; 8] = [0.5, 0.15, 0.05, 0.015, 0.005, 2.0, 8.0, 30.0];

/// How many of these are drawn for a long motion. The others would make it explode, and take Newton's method many iterations.
const SMALL: usize = 5;

/// Steps of a long motion.
const LONG: usize = 4;

/// The largest rate of a scene, `√(k/m)` and `b/m` of its elements, is at least this.
const SLOWEST: f64 = 1.0;

/// The time step, and the duration: a whole number of steps to the last bit, or a last step that is cut clearly.
fn time(scene: &mut Scene, is_whole: bool, choices: &mut Choices) {
    let mut rate = SLOWEST;
    for element in &scene.forces {
        let scaling = element.schema.parts.iter().flat_map(|part| part.scaled_by);
        let scale = scaling.map(|name| element.parameter(name).abs()).fold(0.0, f64::max);
        for stencil in element.stencils(scene.particles.len()) {
            let lightest = stencil.iter().map(|number| scene.particles[*number].mass);
            let lightest = lightest.fold(f64::INFINITY, f64::min);
            let length = match element.schema.initial {
                Initial::PathLength => element.path_length(&scene.particles).min(1.0),
                Initial::Hinge => 1.0 / element.hinge_weight(&scene.particles).max(1.0),
                Initial::None | Initial::BoxDiagonal => 1.0,
            };
            let heaviest = stencil.iter().map(|number| scene.particles[*number].mass);
            let of_masses = match element.schema.masses {
                Masses::None => 1.0,
                Masses::Own => lightest,
                Masses::Product => lightest * heaviest.fold(0.0, f64::max),
            };
            let of_law = (scale * of_masses / (lightest * length)).abs();
            rate = rate.max(if of_law.is_finite() { of_law.sqrt().max(0.5 * of_law) } else { 0.0 });
        }
    }
    let count = match choices.below(32) {
        0..=8 => 1,
        9..=18 => 2 + choices.below(2),
        19..=28 => 4 + choices.below(17),
        29 => 0,
        _ => 20 + choices.below(MOST_STEPS - 19),
    };
    // A long run of many particles shows what shorter or smaller ones do.
    let count = count.min(MOST_PLACES / scene.particles.len());
    let sizes = if count < LONG { &STEPS[..] } else { &STEPS[..SMALL] };
    let step = values::significant(choices.one_of(sizes) / rate, 2);
    let step = if choices.chance(2) { choices.one_of(&[0.01, 0.1, 0.5, 1.0]) } else { step };
    let step = if is_whole { step.log2().floor().exp2() } else { step };
    let is_cut = count > 0 && choices.chance(4);
    let share = if is_cut { choices.one_of(&[0.5, 0.25, 0.8]) } else { 0.0 };
    let mut duration = (count as f64 - share) * step;
    // 0.3 / 0.1 is below 3 in floating point, and 2.1 / 0.3 above 7.
    for _ in 0..4 {
        let steps = duration / step;
        if is_cut || steps == count as f64 {
            break;
        }
        duration = if steps > count as f64 { duration.next_down() } else { duration.next_up() };
    }
    (scene.time_step, scene.duration) = (step, duration);
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use scene::trace::Shape;

    use super::*;

    #[test]
    fn drawn_scenes_are_read_as_they_were_drawn_and_replay_to_the_same_text() {
        let scope = Scope::all();
        let (mut drawn, mut covered) = (0, HashSet::new());
        for seed in 0..3000 {
            let Some(Drawn { choices, scene, text }) = draw(&scope, Choices::random(seed)) else {
                continue;
            };
            drawn += 1;
            let again = draw(&scope, Choices::replayed(choices)).map(|again| again.text);
            assert_eq!(again.as_ref(), Some(&text));
            // The plain file holds the same scene, but for the places of its elements.
            let plain = read(&plain(&scene).unwrap()).unwrap();
            assert_eq!(plain.particles, scene.particles, "{text}");
            assert_eq!((plain.duration, plain.time_step), (scene.duration, scene.time_step));
            assert!(Shape::of(&scene).n_particles <= MOST_PARTICLES);
            covered.extend(pairs(&scene));
        }
        assert!(drawn > 2700, "{drawn} of 3000");
        // Every force and every integrator was drawn with most circumstances.
        for schema in &scope.forces {
            let count = covered.iter().filter(|pair: &&Pair| pair.feature == schema.tag).count();
            assert!(count >= 12, "{}: {count}", schema.tag);
        }
    }

    #[test]
    fn every_sequence_of_bytes_draws_a_scene_of_the_scope() {
        let mut scope = Scope::all();
        scope.forces.retain(|schema| ["springforce", "dragdamping"].contains(&schema.tag));
        scope.dimensions = vec![Dimension::Two];
        for byte in 0..=255_u8 {
            let bytes: Vec<u8> = (0..90_u8).map(|place| place.wrapping_mul(byte) ^ byte).collect();
            let Some(drawn) = draw(&scope, Choices::of_bytes(&bytes)) else { continue };
            assert_eq!(drawn.scene.dimension, Dimension::Two);
            assert!(
                drawn.scene.forces.iter().all(|element| scope.forces.contains(&element.schema))
            );
        }
    }
}
