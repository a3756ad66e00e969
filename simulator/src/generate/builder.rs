//! Builds a generated scene from particles, springs, elastic bodies and a timeline.

use std::collections::HashSet;

use super::error::GenerateErrorKind;
use super::{Body, MAX_PAIRS, MAX_PARTICLES, Size, SpringLaw, Springs, Timeline};
use crate::vocabulary;
use scene::schema::{Coordinate, Domain, ForceSchema};
use scene::{
    Dimension, EDGE_RADIUS, Edge, ForceElement, Location, Parameters, Particle, Particles, Scene,
    Viewport, is_flat,
};

/// A scene under construction.
pub(super) struct SceneBuilder {
    pub(super) scene: Scene,
    hooke: &'static ForceSchema,
    green: &'static ForceSchema,
    /// Whether a spring of the law green has a damping.
    has_damped_green: bool,
    edge_radius: f64,
}

impl SceneBuilder {
    /// An empty scene with the capacity for its particles and springs.
    pub(super) fn new(
        name: &str,
        size: Size,
        dimension: Dimension,
        timeline: &Timeline,
    ) -> Result<Self, GenerateErrorKind> {
        let Size { particles, pairs } = size;
        if particles > MAX_PARTICLES {
            return Err(GenerateErrorKind::TooManyParticles { particles });
        }
        if pairs > MAX_PAIRS {
            return Err(GenerateErrorKind::TooManyPairs { pairs });
        }
        let mut scene = Scene::new(name, dimension, timeline.integrator);
        scene.particles.reserve_exact(particles as usize);
        scene.forces.reserve_exact(pairs as usize + 1);
        let [hooke, green] = [SpringLaw::Hooke, SpringLaw::Green].map(|law| force(law.tag()));
        Ok(Self { scene, hooke, green, has_damped_green: false, edge_radius: EDGE_RADIUS })
    }

    /// From here on, particles and edges are drawn in proportion to their distance.
    pub(super) fn set_drawing_scale(&mut self, spacing: f64) -> f64 {
        self.edge_radius = 0.06 * spacing;
        0.15 * spacing
    }

    pub(super) fn particle(&mut self, particle: Particle) {
        self.scene.particles.push(particle);
    }

    /// An edge with a spring on it.
    pub(super) fn spring(&mut self, particles: [usize; 2], rest_length: f64, springs: &Springs) {
        let edge = self.edge(particles);
        let elastic = [("k", springs.stiffness), ("l0", rest_length)];
        let (schema, parameters) = match springs.law {
            SpringLaw::Hooke => {
                let [k, l0] = elastic;
                (self.hooke, self.hooke.values(&[k, l0, ("b", springs.damping)]))
            }
            SpringLaw::Green => {
                self.has_damped_green |= springs.damping != 0.0;
                (self.green, self.green.values(&elastic))
            }
        };
        self.force(schema, particles.into(), Some(edge), parameters);
    }

    /// An edge, which has a number.
    pub(super) fn edge(&mut self, particles: [usize; 2]) -> usize {
        self.scene.edges.push(Edge { particles, radius: self.edge_radius });
        self.scene.edges.len() - 1
    }

    /// A body of triangles in the plane or of tetrahedra, at rest, and an edge on each of their sides. A particle has its
    /// share of the mass of its elements.
    pub(super) fn body<const D: usize, const N: usize>(
        &mut self,
        places: &[[f64; D]],
        elements: impl Iterator<Item = [usize; N]>,
        radius: f64,
        body: &Body,
    ) {
        let whole = |place: &[f64; D]| std::array::from_fn(|axis| *place.get(axis).unwrap_or(&0.0));
        self.scene.particles.extend(places.iter().map(|at| particle(0.0, whole(at), radius)));
        let schema = body.force;
        let given = [("youngsmodulus", body.youngs_modulus), ("poissonratio", body.poisson_ratio)];
        let mut sides = HashSet::new();
        for corners in elements {
            let rest = corners.map(|corner| places[corner]);
            let mut parameters = schema.values(&given);
            for (value, parameter) in parameters.iter_mut().zip(schema.parameters) {
                if let Some(Coordinate { particle, axis }) = parameter.coordinate
                    && axis < D
                {
                    *value = rest[particle][axis];
                }
            }
            self.force(schema, corners[..].into(), None, parameters);
            let size = content(&rest);
            for corner in corners {
                self.scene.particles[corner].mass += body.density * size / N as f64;
            }
            for [a, b] in SIDES.into_iter().filter(|side| side.iter().all(|end| *end < N)) {
                let [a, b] = [corners[a], corners[b]];
                if sides.insert([a.min(b), a.max(b)]) {
                    self.edge([a, b]);
                }
            }
        }
    }

    /// A force that needs no edge to act on.
    pub(super) fn element(&mut self, tag: &str, particles: &[usize], given: &[(&str, f64)]) {
        let schema = force(tag);
        self.force(schema, particles.into(), None, schema.values(given));
    }

    /// An acceleration downwards, where there is one.
    pub(super) fn gravity(&mut self, gravity: f64) {
        if gravity != 0.0 {
            self.element("simplegravity", &[], &[("fy", -gravity)]);
        }
    }

    /// Gravitation between each two particles.
    pub(super) fn gravitation(&mut self, constant: f64) {
        let n_particles = self.scene.particles.len();
        for i in 0..n_particles {
            for j in i + 1..n_particles {
                self.element("gravitationalforce", &[i, j], &[("G", constant)]);
            }
        }
    }

    /// A camera on a box, with a margin around it; one frame a step where it is shown live.
    pub(super) fn viewport(&mut self, low: [f64; 2], high: [f64; 2]) {
        let center = [0, 1].map(|axis| 0.5 * (low[axis] + high[axis]));
        let size = 0.6 * (high[0] - low[0]).max(high[1] - low[1]);
        self.scene.rendering.viewport = Some(Viewport { center, size });
    }

    /// The scene, its timeline set and its numbers checked.
    pub(super) fn finish(
        mut self,
        timeline: &Timeline,
        usual_time_step: f64,
        description: String,
    ) -> Result<Scene, GenerateErrorKind> {
        if self.has_damped_green {
            return Err(GenerateErrorKind::NoDamping);
        }
        for (particle, Particle { mass, position, velocity, .. }) in
            self.scene.particles.iter().enumerate()
        {
            let fault = |what, value| Err(GenerateErrorKind::Particle { what, particle, value });
            if !Domain::Positive.contains(*mass) {
                return fault("mass", *mass);
            }
            for (what, vector) in [("position", position), ("velocity", velocity)] {
                if let Some(value) = vector.iter().find(|value| !value.is_finite()) {
                    return fault(what, *value);
                }
            }
        }
        for force in &self.scene.forces {
            if is_flat(&force.undeformed()) {
                return Err(GenerateErrorKind::Flat);
            }
            if !force.schema.has_parameter("l0") {
                continue;
            }
            let value = force.parameter("l0");
            if !Domain::Positive.contains(value) {
                return Err(GenerateErrorKind::RestLength { value });
            }
        }
        timeline.apply(usual_time_step, &mut self.scene)?;
        let integrator = self.scene.integrator;
        for force in &self.scene.forces {
            if let Some(refusal) = (integrator.refuses)(force) {
                let (integrator, tag) = (integrator.name, force.schema.tag);
                return Err(GenerateErrorKind::Refused { integrator, tag, refusal });
            }
        }
        self.scene.description = Some(description);
        if self.scene.max_simulation_frequency.is_none() {
            let per_second = (1.0 / self.scene.time_step).round();
            self.scene.max_simulation_frequency = Some(per_second).filter(|max| max.is_finite());
        }
        Ok(self.scene)
    }

    fn force(
        &mut self,
        schema: &'static ForceSchema,
        particles: Particles,
        edge: Option<usize>,
        parameters: Parameters,
    ) {
        let location = Location::default();
        self.scene.forces.push(ForceElement { schema, particles, edge, parameters, location });
    }
}

/// The sides of a tetrahedron; the first three are those of a triangle.
const SIDES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];

/// The area of a triangle in the plane, or the volume of a tetrahedron.
fn content<const D: usize>(corners: &[[f64; D]]) -> f64 {
    let edge = |corner: usize, axis: usize| corners[corner][axis] - corners[0][axis];
    let minor = |first: usize, [a, b]: [usize; 2]| {
        edge(first, a) * edge(first + 1, b) - edge(first + 1, a) * edge(first, b)
    };
    match D {
        2 => 0.5 * minor(1, [0, 1]).abs(),
        _ => {
            let along = [(0, [1, 2]), (1, [2, 0]), (2, [0, 1])];
            along.map(|(axis, others)| edge(1, axis) * minor(2, others)).iter().sum::<f64>().abs()
                / 6.0
        }
    }
}

/// A free particle at rest.
pub(super) fn particle(mass: f64, position: [f64; 3], radius: f64) -> Particle {
    Particle { mass, position, velocity: [0.0; 3], fixed: false, radius, tag: None }
}

/// Rounds to twelve decimals, on which sines and cosines of different systems agree.
pub(super) fn round_decimals(value: f64) -> f64 {
    let scaled = value * 1e12;
    // Beyond 2^53, a number has no decimals that far down.
    if scaled.abs() < 9e15 { scaled.round() / 1e12 } else { value }
}

fn force(tag: &str) -> &'static ForceSchema {
    vocabulary().force(tag).expect("the generators name forces of the registry")
}
