//! Builder of scenes.

use scene::schema::{IntegratorOptions, IntegratorSchema};
use scene::{Dimension, Edge, ForceElement, PARTICLE_RADIUS, Particle, Rendering, Scene};
use simulator::vocabulary;

/// Particles and forces, without a method to step them.
#[derive(Debug, Clone)]
pub(in crate::stability) struct Draft {
    dimension: Dimension,
    particles: Vec<Particle>,
    edges: Vec<Edge>,
    forces: Vec<ForceElement>,
}

impl Draft {
    /// An empty scene in two dimensions.
    pub(in crate::stability) fn new() -> Self {
        Self {
            dimension: Dimension::Two,
            particles: Vec::new(),
            edges: Vec::new(),
            forces: Vec::new(),
        }
    }

    /// The particles and forces of a scene.
    pub(in crate::stability) fn of(scene: &Scene) -> Self {
        Self {
            dimension: scene.dimension,
            particles: scene.particles.clone(),
            edges: scene.edges.clone(),
            forces: scene.forces.clone(),
        }
    }

    /// Adds a free particle.
    pub(in crate::stability) fn particle(
        self,
        mass: f64,
        position: [f64; 2],
        velocity: [f64; 2],
    ) -> Self {
        self.any_particle(mass, position, velocity, false)
    }

    /// Adds a fixed particle at rest.
    pub(in crate::stability) fn fixed(self, position: [f64; 2]) -> Self {
        self.any_particle(1.0, position, [0.0; 2], true)
    }

    fn any_particle(mut self, mass: f64, x: [f64; 2], v: [f64; 2], fixed: bool) -> Self {
        self.particles.push(Particle {
            mass,
            position: [x[0], x[1], 0.0],
            velocity: [v[0], v[1], 0.0],
            fixed,
            radius: PARTICLE_RADIUS,
            tag: None,
        });
        self
    }

    /// Adds a spring with stiffness, rest length and damping.
    pub(in crate::stability) fn spring(mut self, pair: [usize; 2], parameters: [f64; 3]) -> Self {
        let edge = self.edges.len();
        self.edges.push(Edge { particles: pair, radius: scene::EDGE_RADIUS });
        let [k, l0, b] = parameters;
        self = self.force("springforce", &pair, &[("k", k), ("l0", l0), ("b", b)]);
        if let Some(force) = self.forces.last_mut() {
            force.edge = Some(edge);
        }
        self
    }

    /// Adds a force.
    ///
    /// # Panics
    /// If no force has this tag.
    pub(in crate::stability) fn force(
        mut self,
        tag: &str,
        particles: &[usize],
        values: &[(&str, f64)],
    ) -> Self {
        let schema = vocabulary().force(tag).expect("the cases name forces of the registry");
        let parameters = schema.values(values);
        self.forces.push(ForceElement::new(schema, particles, None, parameters));
        self
    }

    /// Adds the edges and forces of another scene.
    pub(in crate::stability) fn with_forces_of(mut self, other: Self) -> Self {
        self.edges.extend(other.edges);
        self.forces.extend(other.forces);
        self
    }

    /// Whether the method supports these forces.
    pub(in crate::stability) fn is_taken_by(&self, integrator: &IntegratorSchema) -> bool {
        self.forces.iter().all(|force| (integrator.refuses)(force).is_none())
    }

    /// The scene with this method, its default options and this number of steps.
    pub(in crate::stability) fn scene(
        &self,
        name: &str,
        integrator: &'static IntegratorSchema,
        time_step: f64,
        steps: u64,
    ) -> Scene {
        let mut scene = Scene {
            name: name.to_owned(),
            description: None,
            tag: None,
            dimension: self.dimension,
            duration: steps as f64 * time_step,
            time_step,
            integrator,
            integrator_options: IntegratorOptions::defaults(integrator),
            max_simulation_frequency: None,
            particles: self.particles.clone(),
            edges: self.edges.clone(),
            forces: self.forces.clone(),
            rendering: Rendering::default(),
        };
        // By rounding, `ceil(steps · h / h)` may be `steps + 1`.
        if scene.n_steps() != steps {
            scene.duration = (steps as f64 - 0.5) * time_step;
        }
        scene
    }
}
