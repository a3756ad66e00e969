//! Resolves references, applies overrides and validates the scene.

use super::unresolved::{Reference, UnresolvedForce, UnresolvedIntegrator};
use super::{Parser, closest};
use crate::error::{Problem, SceneError};
use crate::resolve::{refuse_dimension, refuse_force, refuse_undeformed, set_options};
use crate::schema::{Coordinate, IntegratorOptions, IntegratorSchema, Stencil};
use crate::{
    Dimension, Edge, ForceElement, MAX_STEPS, Parsed, ParticlePath, Particles, Rendering, Scene,
    step_count,
};

impl Parser<'_> {
    /// Resolves what names other elements, applies the overrides, and checks the whole.
    pub(super) fn finish(mut self) -> Result<Parsed, SceneError> {
        let draft = std::mem::take(&mut self.draft);
        let dimension = if draft.three_dimensional { Dimension::Three } else { Dimension::Two };
        let n_particles = draft.particles.len();
        let n_edges = draft.edges.len();

        let mut edges = Vec::with_capacity(n_edges);
        for ([i, j], radius) in draft.edges {
            let particles =
                [self.particle_index(i, n_particles)?, self.particle_index(j, n_particles)?];
            edges.push(Edge { particles, radius });
        }
        let mut forces = Vec::with_capacity(draft.forces.len());
        for UnresolvedForce { schema, stencil, mut parameters, location } in draft.forces {
            let (mut particles, mut edge) = (Particles::new(), None);
            for reference in stencil {
                if schema.stencil == Stencil::Edge {
                    let number = self.resolve(reference, "edge", n_edges)?;
                    (particles, edge) = (edges[number].particles.into(), Some(number));
                } else {
                    particles.push(self.particle_index(reference, n_particles)?);
                }
            }
            for (value, parameter) in parameters.iter_mut().zip(schema.parameters) {
                if let Some(Coordinate { particle, axis }) = parameter.coordinate
                    && value.is_nan()
                {
                    *value = draft.particles[particles[particle]].position[axis];
                }
            }
            let force = ForceElement { schema, particles, edge, parameters, location };
            refuse_dimension(self.name, &force, dimension)?;
            refuse_undeformed(self.name, &force, &draft.particles)?;
            forces.push(force);
        }
        let mut rendering = Rendering {
            viewport: draft.viewport.into_value(),
            background: draft.background.into_value(),
            ..Rendering::default()
        };
        for (particle, color) in draft.particle_colors {
            let particle = self.particle_index(particle, n_particles)?;
            rendering.particle_colors.push((particle, color));
        }
        for (edge, color) in draft.edge_colors {
            rendering.edge_colors.push((self.resolve(edge, "edge", n_edges)?, color));
        }
        for (particle, duration, color) in draft.particle_paths {
            let particle = self.particle_index(particle, n_particles)?;
            rendering.particle_paths.push(ParticlePath { particle, duration, color });
        }

        let Some((duration, duration_location)) = draft.duration.0 else {
            return Err(self.missing("duration", "<duration time=\"10\"/>"));
        };
        let Some((integrator, _)) = draft.integrator.0 else {
            let example = "<integrator type=\"symplectic-euler\" dt=\"0.01\"/>";
            return Err(self.missing("integrator", example));
        };
        if n_particles == 0 {
            let example = "<particle m=\"1\" px=\"0\" py=\"0\" vx=\"0\" vy=\"0\" fixed=\"0\"/>";
            return Err(self.missing("particle", example));
        }
        let integrator_spelling = integrator.spelling.clone();
        let overrides = &self.options.overrides;
        let duration = overrides.duration.unwrap_or(duration);
        let time_step = overrides.time_step.unwrap_or(integrator.time_step);
        let (integrator, mut integrator_options) = match overrides.integrator {
            Some(other) => {
                let own = integrator.options.filter(|options| options.is_of(other));
                (other, own.unwrap_or_else(|| IntegratorOptions::defaults(other)))
            }
            None => self.integrator(integrator)?,
        };
        set_options(self.name, integrator, &mut integrator_options, &overrides.options)?;
        for force in &forces {
            refuse_force(self.name, integrator, force)?;
        }
        let steps = step_count(duration, time_step);
        if steps > MAX_STEPS as f64 {
            let problem = Problem::TooManySteps { duration, time_step, steps, limit: MAX_STEPS };
            return Err(SceneError::new(self.name, duration_location, problem));
        }

        let scene = Scene {
            name: self.name.to_owned(),
            description: draft.description.into_value(),
            tag: draft.tag.into_value(),
            dimension,
            duration,
            time_step,
            integrator,
            integrator_options,
            max_simulation_frequency: draft.max_simulation_frequency.into_value(),
            particles: draft.particles,
            edges,
            forces,
            rendering,
        };
        Ok(Parsed {
            scene,
            warnings: self.warnings,
            n_warnings: self.n_warnings,
            integrator_spelling,
            mesh: None,
        })
    }

    fn integrator(
        &mut self,
        draft: UnresolvedIntegrator,
    ) -> Result<(&'static IntegratorSchema, IntegratorOptions), SceneError> {
        if let (Some(schema), Some(options)) =
            (self.vocabulary.integrator(&draft.spelling), draft.options)
        {
            return Ok((schema, options));
        }
        let names: Vec<&str> =
            self.vocabulary.integrators.iter().map(|schema| schema.name).collect();
        let problem = Problem::UnknownIntegrator {
            suggestion: closest(&draft.spelling, &names),
            known: names.join(", "),
            found: draft.spelling,
        };
        Err(self.error(draft.type_offset, problem))
    }

    fn missing(&self, tag: &'static str, example: &'static str) -> SceneError {
        SceneError::whole_file(self.name, Problem::MissingElement { tag, example })
    }

    fn particle_index(&mut self, reference: Reference, count: usize) -> Result<usize, SceneError> {
        self.resolve(reference, "particle", count)
    }

    fn resolve(
        &mut self,
        Reference { index, tag, attribute, offset }: Reference,
        what: &'static str,
        count: usize,
    ) -> Result<usize, SceneError> {
        if index < count {
            return Ok(index);
        }
        let (tag, attribute) = (tag.to_owned(), attribute.to_owned());
        Err(self.error(offset, Problem::NoSuch { tag, attribute, index, what, count }))
    }
}
