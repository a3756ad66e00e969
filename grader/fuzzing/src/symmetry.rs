//! Metamorphic checks: a simulator against itself on transformed scenes. They need no oracle.
//!
//! ```text
//! run(T(scene)) = T(run(scene))       up to the envelope of T(scene)
//! ```
//!
//! A symmetry counts where our own simulator has it: a wind has a direction, a vortex has no mirror image. Quarter turns, mirror
//! images and factors of 2 are exact in floating point, so that nothing but the order of sums differs. What breaks says what a
//! program treats differently, even where no cause is proven.

use scene::schema::{Convergence, Masses, ParameterSchema};
use scene::trace::State;
use scene::{ForceElement, Scene};

use crate::draw::plain;
use crate::judge::{Judge, Judgement, Subject};
use crate::motion::{Held, simulate};

/// A transformation of scenes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Symmetry {
    /// Moved as a whole.
    Translation,
    /// A quarter turn about z.
    Rotation,
    /// Mirrored along x.
    Mirror,
    /// With particles in reverse order.
    Renumbering,
    /// With forces in reverse order.
    Reordering,
    /// Beside a copy of itself.
    SideBySide,
    /// With twice the masses, and forces in proportion.
    Masses,
}

impl Symmetry {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Translation,
        Self::Rotation,
        Self::Mirror,
        Self::Renumbering,
        Self::Reordering,
        Self::SideBySide,
        Self::Masses,
    ];

    /// Its machine-readable name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Translation => "translation",
            Self::Rotation => "rotation",
            Self::Mirror => "mirror",
            Self::Renumbering => "renumbering",
            Self::Reordering => "reordering",
            Self::SideBySide => "side-by-side",
            Self::Masses => "masses",
        }
    }

    /// What a program does that breaks it.
    pub fn broken(self) -> &'static str {
        match self {
            Self::Translation => {
                "the scene moved as a whole moves otherwise: something depends on absolute positions"
            }
            Self::Rotation => {
                "the scene turned by 90° moves otherwise: something treats x and y differently"
            }
            Self::Mirror => {
                "the mirrored scene moves otherwise: something depends on the sign of x"
            }
            Self::Renumbering => {
                "with its particles in reverse order, the scene moves otherwise: something depends on their numbers"
            }
            Self::Reordering => {
                "with its forces in reverse order, the scene moves otherwise: something depends on their order"
            }
            Self::SideBySide => {
                "beside a copy of itself, the scene moves otherwise: particles without a force between them influence each other"
            }
            Self::Masses => {
                "with twice the masses and forces in proportion, the scene moves otherwise: something misses a mass"
            }
        }
    }

    /// The transformed scene.
    fn of(self, scene: &Scene) -> Scene {
        let mut other = scene.clone();
        match self {
            Self::Translation | Self::Rotation | Self::Mirror => {
                for particle in &mut other.particles {
                    particle.position = self.place(particle.position);
                    particle.velocity = self.vector(particle.velocity);
                }
                for element in &mut other.forces {
                    self.transform(element);
                }
            }
            Self::Renumbering => {
                let last = scene.particles.len() - 1;
                other.particles.reverse();
                let of_edges = other.edges.iter_mut().flat_map(|edge| &mut edge.particles);
                let of_forces = other.forces.iter_mut().flat_map(|force| &mut force.particles);
                of_edges.chain(of_forces).for_each(|number| *number = last - *number);
            }
            Self::Reordering => other.forces.reverse(),
            Self::SideBySide => other = copies(scene, 2),
            Self::Masses => {
                other.particles.iter_mut().for_each(|particle| particle.mass *= 2.0);
                for element in &mut other.forces {
                    let factor = match element.schema.masses {
                        Masses::None => 2.0,
                        Masses::Own => 1.0,
                        Masses::Product => 0.5,
                    };
                    // Of the parameters that scale a part, its first does so alone.
                    let mut scaled: Vec<&str> = element
                        .schema
                        .parts
                        .iter()
                        .flat_map(|part| part.scaled_by)
                        .copied()
                        .collect();
                    scaled.sort_unstable();
                    scaled.dedup();
                    for name in scaled {
                        *element.parameter_mut(name) *= factor;
                    }
                }
            }
        }
        other
    }

    fn place(self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Translation => [x + SHIFT[0], y + SHIFT[1], z],
            _ => self.vector([x, y, z]),
        }
    }

    fn vector(self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Rotation => [-y, x, z],
            Self::Mirror => [-x, y, z],
            _ => [x, y, z],
        }
    }

    /// The vectors and the undeformed places of an element.
    fn transform(self, element: &mut ForceElement) {
        let is_depth = |parameter: &ParameterSchema| {
            parameter.three_dimensional && parameter.coordinate.is_none()
        };
        let last = element.schema.parameters.iter().position(is_depth);
        let vector = last.and_then(|last| element.parameters.get_mut(last.checked_sub(2)?..=last));
        if let Some([x, y, z]) = vector {
            [*x, *y, *z] = self.vector([*x, *y, *z]);
        }
        let places = element.undeformed();
        for (parameter, value) in element.schema.parameters.iter().zip(&mut element.parameters) {
            if let Some(coordinate) = parameter.coordinate {
                *value = self.place(places[coordinate.particle])[coordinate.axis];
            }
        }
    }

    /// Whether the laws of the forces in a scene have it, by the facts of the registries.
    fn holds(self, scene: &Scene) -> bool {
        let has_no_place = scene.forces.iter().all(|force| {
            let schema = force.schema;
            !(schema.stencil.is_field() && schema.depends_on().position)
        });
        let has_mirror_image = scene.forces.iter().all(|force| {
            // The sign of an angle is that of an orientation.
            let is_angle = force.schema.stencil.size() > 2 && force.undeformed().is_empty();
            force.is_variational() && !is_angle
        });
        // Error control measures components, relative to their size.
        let is_controlled = matches!(scene.integrator.convergence, Convergence::ErrorEstimate(_));
        match self {
            Self::Translation | Self::Rotation | Self::SideBySide => has_no_place && !is_controlled,
            Self::Mirror => has_no_place && has_mirror_image,
            Self::Renumbering | Self::Reordering => true,
            // A part that several parameters scale is a product of them.
            Self::Masses => scene.forces.iter().all(|force| {
                force.schema.parts.iter().all(|part| part.scaled_by.len() == 1)
                    && force.is_variational()
            }),
        }
    }

    /// The states of the transformed scene, from those of the scene.
    fn states(self, scene: &Scene, states: &[State]) -> Vec<State> {
        let axes = scene.dimension.count();
        let of = |state: &State| {
            let map = |values: &[f64], by: &dyn Fn([f64; 3]) -> [f64; 3]| {
                let mut rows: Vec<Vec<f64>> = values
                    .chunks(axes)
                    .map(|row| {
                        let mut vector = [0.0; 3];
                        vector[..axes].copy_from_slice(row);
                        by(vector)[..axes].to_vec()
                    })
                    .collect();
                if self == Self::Renumbering {
                    rows.reverse();
                }
                rows.concat()
            };
            let mut positions = map(&state.positions, &|place| self.place(place));
            let mut velocities = map(&state.velocities, &|vector| self.vector(vector));
            if self == Self::SideBySide {
                positions.extend(map(&state.positions, &|[x, y, z]| [x + APART, y, z]));
                velocities.extend(state.velocities.clone());
            }
            State { time: state.time, positions, velocities }
        };
        states.iter().map(of).collect()
    }
}

/// The shift of a scene: powers of two, which round little.
const SHIFT: [f64; 2] = [4.0, -2.0];

/// The distance of a copy.
const APART: f64 = 64.0;

/// The scene so many times, side by side.
pub(crate) fn copies(scene: &Scene, count: usize) -> Scene {
    let mut all = scene.clone();
    all.forces.retain(|force| force.schema.stencil.is_field());
    (all.particles, all.edges) = (Vec::new(), Vec::new());
    for copy in 0..count {
        let (particles, edges) = (all.particles.len(), all.edges.len());
        let by = APART * copy as f64;
        all.particles.extend(scene.particles.iter().cloned().map(|mut particle| {
            particle.position[0] += by;
            particle
        }));
        all.edges.extend(scene.edges.iter().cloned().map(|mut edge| {
            edge.particles = edge.particles.map(|number| number + particles);
            edge
        }));
        let between = scene.forces.iter().filter(|force| !force.schema.stencil.is_field());
        all.forces.extend(between.cloned().map(|mut force| {
            force.particles.iter_mut().for_each(|number| *number += particles);
            force.edge = force.edge.map(|edge| edge + edges);
            let parameters = force.schema.parameters.iter().zip(&mut force.parameters);
            for (_, value) in parameters.filter(|(schema, _)| {
                schema.coordinate.is_some_and(|coordinate| coordinate.axis == 0)
            }) {
                *value += by;
            }
            force
        }));
    }
    all
}

/// A symmetry that the laws of a scene have and our own simulator, with these states, does not.
pub(crate) fn broken_by_ours(judge: &Judge, scene: &Scene, states: &[State]) -> Option<Symmetry> {
    let is_broken = |symmetry: &Symmetry| {
        if !symmetry.holds(scene) {
            return false;
        }
        let other = symmetry.of(scene);
        let expected = symmetry.states(scene, states);
        let Ok(ours) = simulate(&other) else { return false };
        let found = judge.judge_states(&other, &expected, || Ok(Box::new(Held::of(ours))));
        matches!(found, Judgement::Wrong(_))
    };
    Symmetry::ALL.into_iter().find(is_broken)
}

/// The symmetries that a subject breaks in a scene in which it has these states.
pub fn broken(
    judge: &Judge,
    subject: &dyn Subject,
    scene: &Scene,
    states: &[State],
) -> Vec<Symmetry> {
    let Ok(ours) = simulate(scene) else { return Vec::new() };
    let is_broken = |symmetry: &Symmetry| {
        let other = symmetry.of(scene);
        let Some(text) = plain(&other) else { return false };
        let expected = symmetry.states(scene, &ours);
        let own = simulate(&other)
            .map(|states| judge.judge_states(&other, &expected, || Ok(Box::new(Held::of(states)))));
        if !matches!(own, Ok(Judgement::Right(_))) {
            return false;
        }
        let expected = symmetry.states(scene, states);
        let found = judge.judge_states(&other, &expected, || subject.start(&other, &text));
        matches!(found, Judgement::Wrong(_))
    };
    Symmetry::ALL.into_iter().filter(is_broken).collect()
}
