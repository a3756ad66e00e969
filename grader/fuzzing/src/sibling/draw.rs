//! Draws the numbers of a sibling.
//!
//! ```text
//! x' = s R (x − c) + c + shift + nudge     s common, R about z, nudge: a share of the distance to the nearest particle
//! v' = f R v                               f and a small further turn drawn for each particle
//! p' = f p                                 one f for all equal values of a parameter, or of the mass; lengths: s f
//! h' = f h,  n' = f n                      n: number of steps
//! ```
//!
//! Zeros and defaults stay: they say that the scene does without something. Cost: O(n²) for n particles.

use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, TAU};

use scene::schema::{Coordinate, ForceSchema, ParameterSchema};
use scene::{ForceElement, Particle, Scene, Viewport};

use crate::choices::Choices;

/// Logarithm of the largest factor of a mass, of a velocity, or of a parameter: from 0.78 to 1.28. A method that is stable
/// with a third to spare stays so.
const VALUE: f64 = 0.25;

/// The same of all lengths of a scene together.
const SIZE: f64 = 0.3;

/// The same of a rest length, on top of `SIZE`: a spring that pulls should not push.
const LENGTH: f64 = 0.04;

/// The same of the time step, and of the number of steps.
const TIME: f64 = 0.1;

/// Largest nudge of a coordinate, as a share of the distance to the nearest particle.
const NUDGE: f64 = 0.05;

/// Largest shift of a scene along an axis, as a share of its size.
const SHIFT: f64 = 0.3;

/// Largest turn of a single vector, on top of the turn of the scene, in radians.
const TURN: f64 = 0.15;

/// Smallest angle between an axis before and any axis after the turn of a scene, in radians.
const MIN_TURN: f64 = 0.2;

/// Draws factors, and remembers them: equal values stay equal.
pub(super) struct Factors<'a> {
    choices: &'a mut Choices,
    /// Scales the logarithms of all factors.
    spread: f64,
    known: HashMap<(&'static str, &'static str, u64), f64>,
}

impl<'a> Factors<'a> {
    pub(super) fn new(spread: f64, choices: &'a mut Choices) -> Self {
        Self { choices, spread, known: HashMap::new() }
    }

    /// A number between a third of `largest` and `largest`, of either sign.
    fn signed(&mut self, largest: f64) -> f64 {
        let sign = if self.choices.below(2) == 0 { 1.0 } else { -1.0 };
        sign * largest * (1.0 + 2.0 * self.choices.unit()) / 3.0
    }

    fn factor(&mut self, largest: f64) -> f64 {
        (self.spread * self.signed(largest)).exp()
    }

    /// The value of an attribute times the factor of all its equals.
    fn scaled(
        &mut self,
        (tag, name): (&'static str, &'static str),
        value: f64,
        largest: f64,
    ) -> f64 {
        let key = (tag, name, value.to_bits());
        let factor = match self.known.get(&key) {
            Some(factor) => *factor,
            None => {
                let factor = self.factor(largest);
                self.known.insert(key, factor);
                factor
            }
        };
        factor * value
    }

    /// A mass, a stiffness or another value that is no length.
    pub(super) fn value(&mut self, name: (&'static str, &'static str), value: f64) -> f64 {
        significant(self.scaled(name, value, VALUE))
    }

    /// A parameter that is no component of a vector, in a scene of which all lengths are multiplied by `size`.
    fn parameter(
        &mut self,
        schema: &'static ForceSchema,
        parameter: &'static ParameterSchema,
        value: f64,
        size: f64,
    ) -> f64 {
        let name = (schema.tag, parameter.name);
        if parameter.is_length {
            significant(size * self.scaled(name, value, LENGTH))
        } else {
            let drawn = self.value(name, value);
            // Near a bound of what it may be: away from it, by less.
            match parameter.domain.contains(drawn) {
                true => drawn,
                false => significant(value * (value / drawn).sqrt()),
            }
        }
    }
}

/// How the particles of a scene are placed anew.
pub(super) struct Placement {
    size: f64,
    angle: f64,
    center: [f64; 3],
    shift: [f64; 3],
    /// Whether the particles spread along each axis.
    spreads: [bool; 3],
    /// Decimals of coordinates.
    decimals: usize,
}

impl Placement {
    /// `is_turned`: whether the directions of forces can be turned with the scene.
    pub(super) fn draw(scene: &Scene, is_turned: bool, factors: &mut Factors<'_>) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for particle in &scene.particles {
            for axis in 0..3 {
                low[axis] = low[axis].min(particle.position[axis]);
                high[axis] = high[axis].max(particle.position[axis]);
            }
        }
        let mut spreads = [0, 1, 2].map(|axis| high[axis] > low[axis]);
        // Particles on a line along an axis are in a plane all the same.
        spreads[0] |= is_turned;
        spreads[1] |= is_turned;
        let extent = (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f64::max);
        let extent = if extent > 0.0 { extent } else { 1.0 };
        let mut angle = 0.0;
        while is_turned
            && (angle % FRAC_PI_2 < MIN_TURN || angle % FRAC_PI_2 > FRAC_PI_2 - MIN_TURN)
        {
            angle = TAU * factors.choices.unit();
        }
        let size = factors.factor(SIZE);
        // A plane away from the origin is shifted as a whole.
        let shift = [0, 1, 2].map(|axis| {
            if spreads[axis] || low[axis] != 0.0 { factors.signed(SHIFT * extent) } else { 0.0 }
        });
        let nearest = nearest(scene).into_iter().filter(|distance| *distance > 0.0);
        let nearest = nearest.fold(extent, f64::min);
        Self {
            size,
            angle,
            center: [0, 1, 2].map(|axis| 0.5 * (low[axis] + high[axis])),
            shift,
            spreads,
            decimals: decimals(1e-3 * nearest),
        }
    }

    /// The new place of a point, without a nudge.
    fn place(&self, position: [f64; 3]) -> [f64; 3] {
        let away = [0, 1, 2].map(|axis| self.size * (position[axis] - self.center[axis]));
        let turned = turned(away, self.angle);
        [0, 1, 2].map(|axis| self.center[axis] + self.shift[axis] + turned[axis])
    }

    /// The new place of a particle whose nearest neighbour is this far.
    pub(super) fn position(
        &self,
        position: [f64; 3],
        nearest: f64,
        factors: &mut Factors<'_>,
    ) -> [f64; 3] {
        let place = self.place(position);
        [0, 1, 2].map(|axis| {
            let nudge = if self.spreads[axis] {
                factors.spread * factors.signed(NUDGE * nearest)
            } else {
                0.0
            };
            rounded(place[axis] + nudge, self.decimals)
        })
    }

    /// A vector turned with the scene and a little further, and scaled.
    fn vector(&self, vector: [f64; 3], factors: &mut Factors<'_>) -> [f64; 3] {
        let length = vector.iter().map(|value| value * value).sum::<f64>().sqrt();
        if length == 0.0 {
            return vector;
        }
        let further = factors.spread * factors.signed(TURN);
        let factor = factors.factor(VALUE);
        turned(vector, self.angle + further).map(|value| match value {
            0.0 => 0.0,
            _ => rounded(factor * value, decimals(1e-3 * length)),
        })
    }
}

/// The distance from each particle to the nearest one that is elsewhere; infinite without one.
fn nearest(scene: &Scene) -> Vec<f64> {
    let all = &scene.particles;
    let squared =
        |a: [f64; 3], b: [f64; 3]| (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>();
    let of = |position| {
        let others = all.iter().map(|other| squared(position, other.position));
        others.filter(|squared| *squared > 0.0).fold(f64::INFINITY, f64::min).sqrt()
    };
    all.iter().map(|particle| of(particle.position)).collect()
}

/// The distance from each particle to the nearest one elsewhere; without one, the distance that the particle travels at its
/// first speed.
pub(super) fn distances(scene: &Scene) -> Vec<f64> {
    let ways = scene.particles.iter().map(|particle| {
        let speed = particle.velocity.iter().map(|value| value * value).sum::<f64>().sqrt();
        speed * scene.duration
    });
    let found = nearest(scene).into_iter().zip(ways);
    found.map(|(nearest, way)| if nearest.is_finite() { nearest } else { way }).collect()
}

fn turned([x, y, z]: [f64; 3], angle: f64) -> [f64; 3] {
    let (sin, cos) = angle.sin_cos();
    [cos * x - sin * y, sin * x + cos * y, z]
}

/// Decimals that resolve `resolution`.
fn decimals(resolution: f64) -> usize {
    (-resolution.log10()).ceil().clamp(1.0, 300.0) as usize
}

fn rounded(value: f64, decimals: usize) -> f64 {
    format!("{value:.decimals$}").parse().unwrap_or(value)
}

/// A number with three digits.
fn significant(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// A scene with the same structure and other numbers.
pub(super) fn redraw(scene: &Scene, spread: f64, choices: &mut Choices) -> Scene {
    let mut drawn = scene.clone();
    let mut factors = Factors::new(spread, choices);
    let placement = Placement::draw(scene, true, &mut factors);
    for (particle, nearest) in drawn.particles.iter_mut().zip(distances(scene)) {
        particle.mass = factors.value(("particle", "m"), particle.mass);
        particle.position = placement.position(particle.position, nearest, &mut factors);
        particle.velocity = placement.vector(particle.velocity, &mut factors);
    }
    for force in &mut drawn.forces {
        redraw_force(force, &placement, &mut factors);
        redraw_undeformed(force, &placement, &scene.particles, &drawn.particles);
    }
    if let Some(Viewport { center: [x, y], size }) = &mut drawn.rendering.viewport {
        let place = placement.place([*x, *y, 0.0]);
        [*x, *y] = [place[0], place[1]].map(significant);
        *size = significant(*size * placement.size);
    }
    redraw_time(&mut drawn, &mut factors);
    permute(&mut drawn, choices);
    drawn
}

/// The parameters of an element. A parameter that only three dimensions have is the last component of a vector.
fn redraw_force(force: &mut ForceElement, placement: &Placement, factors: &mut Factors<'_>) {
    let schema = force.schema;
    let is_depth =
        |parameter: &ParameterSchema| parameter.three_dimensional && parameter.coordinate.is_none();
    let last = schema.parameters.iter().position(is_depth);
    let vector = last.and_then(|last| Some(last.checked_sub(2)?..=last));
    if let Some(components) = vector.clone().and_then(|range| force.parameters.get_mut(range))
        && let [x, y, z] = components
    {
        [*x, *y, *z] = placement.vector([*x, *y, *z], factors);
    }
    for (number, parameter) in schema.parameters.iter().enumerate() {
        let is_component = parameter.coordinate.is_some()
            || vector.as_ref().is_some_and(|range| range.contains(&number));
        let value = &mut force.parameters[number];
        if !is_component && *value != 0.0 && parameter.default != Some(*value) {
            *value = factors.parameter(schema, parameter, *value, placement.size);
        }
    }
}

/// The places of an element's particles before it was deformed. One that is a particle's initial position stays so.
fn redraw_undeformed(
    force: &mut ForceElement,
    placement: &Placement,
    old: &[Particle],
    new: &[Particle],
) {
    let places = force.undeformed();
    for (parameter, value) in force.schema.parameters.iter().zip(&mut force.parameters) {
        let Some(Coordinate { particle, axis }) = parameter.coordinate else { continue };
        let (place, number) = (places[particle], force.particles[particle]);
        *value = if place == old[number].position {
            new[number].position[axis]
        } else {
            rounded(placement.place(place)[axis], placement.decimals)
        };
    }
}

/// The time step and the duration. A whole number of steps stays one, to the last bit; otherwise, the last step is cut by
/// the same share.
fn redraw_time(scene: &mut Scene, factors: &mut Factors<'_>) {
    let steps = scene.duration / scene.time_step;
    let wanted = (scene.n_steps() as f64 * factors.factor(TIME)).round();
    let step = significant(scene.time_step * factors.factor(TIME));
    let is_whole = (steps - steps.round()).abs() <= 1e-9 * steps;
    let cut = if is_whole { 0.0 } else { steps.ceil() - steps };
    let decimals = decimals(1e-3 * step);
    // 2.1 / 0.3 is not 7 in floating point: then it is 8.
    let durations = (0..100).map(|more| rounded((wanted + f64::from(more) - cut) * step, decimals));
    let is_as_whole = |duration: &f64| (duration / step).fract() == 0.0;
    let duration = durations.into_iter().find(|duration| is_as_whole(duration) == is_whole);
    if let Some(duration) = duration.filter(|duration| *duration > 0.0) {
        (scene.time_step, scene.duration) = (step, duration);
    }
}

/// Permutes the particles, the edges, and the forces of each kind.
fn permute(scene: &mut Scene, choices: &mut Choices) {
    let particles = permutation(scene.particles.len(), choices);
    let edges = permutation(scene.edges.len(), choices);
    scene.particles = moved(&scene.particles, &particles);
    scene.edges = moved(&scene.edges, &edges);
    let mut ends = scene.edges.iter_mut().flat_map(|edge| &mut edge.particles);
    ends.by_ref().for_each(|end| *end = particles[*end]);
    for force in &mut scene.forces {
        force.particles.iter_mut().for_each(|particle| *particle = particles[*particle]);
        force.edge = force.edge.map(|edge| edges[edge]);
    }
    let rendering = &mut scene.rendering;
    rendering.particle_colors.iter_mut().for_each(|(particle, _)| *particle = particles[*particle]);
    rendering.edge_colors.iter_mut().for_each(|(edge, _)| *edge = edges[*edge]);
    rendering.particle_paths.iter_mut().for_each(|path| path.particle = particles[path.particle]);
    let mut tags: Vec<&str> = scene.forces.iter().map(|force| force.schema.tag).collect();
    tags.sort_unstable();
    tags.dedup();
    for tag in tags {
        let mut own: Vec<&mut ForceElement> =
            scene.forces.iter_mut().filter(|force| force.schema.tag == tag).collect();
        let elements: Vec<ForceElement> = own.iter().map(|force| (**force).clone()).collect();
        let places = permutation(own.len(), choices);
        for (place, element) in places.into_iter().zip(elements) {
            *own[place] = element;
        }
    }
}

/// The new place of each of `count` things.
fn permutation(count: usize, choices: &mut Choices) -> Vec<usize> {
    let mut places: Vec<usize> = (0..count).collect();
    choices.shuffle(&mut places);
    places
}

/// The things, each at its new place.
fn moved<T: Clone>(things: &[T], places: &[usize]) -> Vec<T> {
    let mut order: Vec<(usize, &T)> = places.iter().copied().zip(things).collect();
    order.sort_by_key(|(place, _)| *place);
    order.into_iter().map(|(_, thing)| thing.clone()).collect()
}
