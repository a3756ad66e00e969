//! Metamorphic checks: a simulator against itself on transformed scenes. They need no oracle.
//!
//! ```text
//! T⁻¹(run(T(scene))) = run(scene)       up to the envelope of the scene
//! ```
//!
//! A symmetry counts where our own simulator has it: a wind has a direction, a vortex has no mirror image. Quarter turns, mirror
//! images and factors of 2 are exact in floating point, and shifts are as large as the scene, so that nothing but last bits and
//! the order of sums differs. A broken symmetry shows what a program treats differently, even where no cause is proven.

use grader::submission::StateSource;
use grader::verdict::Failure;
use scene::schema::Convergence;
use scene::trace::{Shape, State};
use scene::{ForceElement, Scene};

use crate::draw::plain;
use crate::judge::{Judge, Judgement, Subject};
use crate::masses::{self, vector_of};
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
    /// Two copies of the scene, side by side.
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

    /// The transformed scenes, in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Translation => "scenes moved as a whole",
            Self::Rotation => "scenes turned by 90°",
            Self::Mirror => "mirrored scenes",
            Self::Renumbering => "scenes with particles in reverse order",
            Self::Reordering => "scenes with forces in reverse order",
            Self::SideBySide => "scenes beside a copy of themselves",
            Self::Masses => "scenes with twice the masses and forces in proportion",
        }
    }

    /// The behaviour of a program that breaks it.
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
    pub(crate) fn of(self, scene: &Scene) -> Scene {
        let mut other = scene.clone();
        match self {
            Self::Translation | Self::Rotation | Self::Mirror => {
                let map = Map::of(self, scene);
                for particle in &mut other.particles {
                    particle.position = map.place(particle.position);
                    particle.velocity = map.vector(particle.velocity);
                }
                other.forces.iter_mut().for_each(|element| map.transform(element));
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
            Self::Masses => masses::multiply(&mut other, 2.0),
        }
        other
    }

    /// Whether the laws of the forces in a scene have it, by the facts of the registries.
    pub(crate) fn holds(self, scene: &Scene) -> bool {
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
            Self::Masses => masses::scale(scene),
        }
    }

    /// The run of a transformed scene as one of the scene itself.
    pub(crate) fn back(self, scene: &Scene, run: Box<dyn StateSource>) -> Box<dyn StateSource> {
        let state = State::zeros(Shape::of(&self.of(scene)));
        let axes = scene.dimension.count();
        let skipped = if self == Self::SideBySide { axes * scene.particles.len() } else { 0 };
        Box::new(Back { symmetry: self, map: Map::of(self, scene), axes, skipped, run, state })
    }
}

/// The motion of space of a symmetry: a quarter turn or a mirror image, then a shift.
#[derive(Debug, Clone, Copy)]
struct Map {
    symmetry: Symmetry,
    shift: [f64; 2],
}

impl Map {
    fn of(symmetry: Symmetry, scene: &Scene) -> Self {
        let width = width(scene);
        let shift = match symmetry {
            Symmetry::Translation => [width, -0.5 * width],
            Symmetry::SideBySide => [width, 0.0],
            _ => [0.0; 2],
        };
        Self { symmetry, shift }
    }

    fn place(self, place: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = self.vector(place);
        [x + self.shift[0], y + self.shift[1], z]
    }

    fn vector(self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        match self.symmetry {
            Symmetry::Rotation => [-y, x, z],
            Symmetry::Mirror => [-x, y, z],
            _ => [x, y, z],
        }
    }

    /// The vector that [`Self::vector`] maps to this one.
    fn back(self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        match self.symmetry {
            Symmetry::Rotation => [y, -x, z],
            _ => self.vector([x, y, z]),
        }
    }

    /// The vectors and the undeformed places of an element.
    fn transform(self, element: &mut ForceElement) {
        if let Some([x, y, z]) = vector_of(element) {
            [*x, *y, *z] = self.vector([*x, *y, *z]);
        }
        let places = element.undeformed();
        for (parameter, value) in element.schema.parameters.iter().zip(&mut element.parameters) {
            if let Some(coordinate) = parameter.coordinate {
                *value = self.place(places[coordinate.particle])[coordinate.axis];
            }
        }
    }
}

/// A run of a transformed scene, transformed back. Of two copies, it is the second.
struct Back {
    symmetry: Symmetry,
    map: Map,
    axes: usize,
    /// Numbers of the first copy.
    skipped: usize,
    run: Box<dyn StateSource>,
    state: State,
}

impl Back {
    fn rows(&self, values: &[f64], shift: [f64; 2]) -> Vec<f64> {
        let mut rows: Vec<Vec<f64>> = values[self.skipped..]
            .chunks(self.axes)
            .map(|row| {
                let mut vector = [0.0; 3];
                vector[..self.axes].copy_from_slice(row);
                vector.iter_mut().zip(shift).for_each(|(value, shift)| *value -= shift);
                self.map.back(vector)[..self.axes].to_vec()
            })
            .collect();
        if self.symmetry == Symmetry::Renumbering {
            rows.reverse();
        }
        rows.concat()
    }
}

impl StateSource for Back {
    fn read(&mut self, state: &mut State) -> Result<bool, Failure> {
        let is_there = self.run.read(&mut self.state)?;
        if is_there {
            state.time = self.state.time;
            state.positions = self.rows(&self.state.positions, self.map.shift);
            state.velocities = self.rows(&self.state.velocities, [0.0; 2]);
        }
        Ok(is_there)
    }

    fn has_velocities(&self) -> bool {
        self.run.has_velocities()
    }
}

/// A power of two beyond the width of a scene: shifted by it, coordinates lose two bits at most.
fn width(scene: &Scene) -> f64 {
    let places = scene.particles.iter().map(|particle| particle.position);
    let undeformed = scene.forces.iter().flat_map(ForceElement::undeformed);
    let sizes = places.chain(undeformed).flatten().map(f64::abs);
    sizes.fold(SMALLEST, f64::max).log2().ceil().exp2() * 2.0
}

/// The size of a scene at a point.
const SMALLEST: f64 = 1.0 / 64.0;

/// The scene so many times, side by side.
pub(crate) fn copies(scene: &Scene, count: usize) -> Scene {
    let apart = width(scene);
    let mut all = scene.clone();
    all.forces.retain(|force| force.schema.stencil.is_field());
    (all.particles, all.edges) = (Vec::new(), Vec::new());
    for copy in 0..count {
        let (particles, edges) = (all.particles.len(), all.edges.len());
        let by = apart * copy as f64;
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

/// The symmetries that a subject breaks in a scene in which it has these states, and our own simulator does not.
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
        let Ok(own) = simulate(&other) else { return false };
        let own = || Ok(symmetry.back(scene, Box::new(Held::of(own))));
        if !matches!(judge.judge_states(scene, &ours, own), Judgement::Right(_)) {
            return false;
        }
        let theirs = || Ok(symmetry.back(scene, subject.start(&other, &text)?));
        matches!(judge.judge_states(scene, states, theirs), Judgement::Wrong(_))
    };
    Symmetry::ALL.into_iter().filter(is_broken).collect()
}

#[cfg(test)]
mod tests {
    use grader::verdict::Verdict;

    use super::*;
    use crate::draw::read;
    use crate::judge::Nothing;
    use crate::ours::Path;

    const OBLIQUE: &str = r#"<scene>
        <duration time="0.2"/>
        <integrator type="explicit-euler" dt="0.1"/>
        <particle m="0.7" px="0.3" py="-0.4" vx="-0.9" vy="0.2" fixed="0"/>
        <particle m="1.3" px="1.1" py="0.5" vx="0.4" vy="-0.6" fixed="0"/>
        <edge i="0" j="1"/>
        <springforce edge="0" k="3.0" l0="0.8" b="0.1"/>
        <springforce edge="0" k="2.0" l0="1.7" b="0.3"/>
    </scene>"#;

    /// Our own simulator of a scene that was changed.
    struct Mistaken(fn(&mut Scene));

    impl Subject for Mistaken {
        fn start(&self, scene: &Scene, _: &str) -> Result<Box<dyn StateSource>, Verdict> {
            let mut scene = scene.clone();
            self.0(&mut scene);
            Ok(Box::new(Held::of(simulate(&scene).unwrap())))
        }
    }

    #[test]
    fn a_mistake_breaks_its_symmetries() {
        use Symmetry::{
            Masses, Mirror, Renumbering, Reordering, Rotation, SideBySide, Translation,
        };
        let scene = read(OBLIQUE).unwrap();
        type Change = fn(&mut Scene);
        let cases: [(Change, &[Symmetry]); 7] = [
            (|_| {}, &[]),
            (
                |scene| scene.particles[0].velocity[0] += 0.1,
                &[Rotation, Mirror, Renumbering, SideBySide],
            ),
            (
                |scene| scene.particles.iter_mut().for_each(|each| each.velocity[0] *= 0.5),
                &[Rotation],
            ),
            (
                |scene| {
                    scene
                        .particles
                        .iter_mut()
                        .for_each(|each| each.velocity[1] -= 0.1 * each.position[1])
                },
                &[Translation, Rotation],
            ),
            (
                |scene| {
                    scene
                        .particles
                        .iter_mut()
                        .for_each(|each| each.velocity[0] -= 0.1 * each.position[0])
                },
                &[Translation, Rotation, SideBySide],
            ),
            (|scene| scene.particles.iter_mut().for_each(|each| each.mass += 0.1), &[Masses]),
            (|scene| scene.forces[0].parameters[0] *= 1.1, &[Reordering, SideBySide]),
        ];
        for (number, (mistake, expected)) in cases.into_iter().enumerate() {
            let subject = Mistaken(mistake);
            let mut source = subject.start(&scene, "").unwrap();
            let (mut state, mut states) = (State::zeros(Shape::of(&scene)), Vec::new());
            while source.read(&mut state).unwrap() {
                states.push(state.clone());
            }
            let found = broken(&Judge::default(), &subject, &scene, &states);
            assert_eq!(found, expected, "{number}");
        }
    }

    /// Moved by its size, a scene has several times the rounding errors, which are then above the tolerance of Newton's method.
    #[test]
    fn a_tolerance_near_rounding_errors_tells_nothing() {
        let stiff = r#"<scene>
            <duration time="0.0008"/>
            <integrator type="implicit-euler" dt="0.0008"/>
            <particle m="1.0" px="0.0" py="0.0" pz="0.0" vx="0.0" vy="0.0" vz="0.0" fixed="0"/>
            <particle m="1.0" px="0.0" py="0.0" pz="-5000.0" vx="0.0" vy="0.0" vz="0.0" fixed="0"/>
            <particle m="1.0" px="1.0" py="0.0" pz="0.0" vx="0.0" vy="0.0" vz="0.0" fixed="0"/>
            <particle m="1.0" px="0.0" py="0.0" pz="0.0" vx="0.0" vy="0.0" vz="1.0" fixed="0"/>
            <neohookeantriangle i1="2" i2="1" i3="0" youngsmodulus="1.0" poissonratio="0.0" xb1x="0.0" xb2z="1.0" xb3y="1.0"/>
        </scene>"#;
        let scene = read(stiff).unwrap();
        assert!(simulate(&Symmetry::Translation.of(&scene)).is_err());
        let path = Path::Symmetry(Symmetry::Translation);
        let moved = path.judge().judge(&path, &scene, stiff);
        assert!(matches!(moved, Judgement::Tells(Nothing::Slow)), "{moved:?}");
    }

    /// A turned bar is folded to the other side, and the penalty of a pin is a stiffness.
    #[test]
    fn a_fold_and_a_penalty_break_no_symmetry_of_ours() {
        let fold = r#"<scene>
            <duration time="1.0"/>
            <integrator type="explicit-euler" dt="1.0"/>
            <particle m="1.0" px="0.0" py="0.0" vx="0.0" vy="0.0" fixed="0"/>
            <particle m="1.0" px="1.0" py="0.0" vx="0.0" vy="0.0" fixed="0"/>
            <particle m="1.0" px="2.0" py="0.0" vx="0.0" vy="0.0" fixed="0"/>
            <elasticbodybendingforce i1="2" i2="0" i3="1" alpha="1.0" theta0="0.0"/>
        </scene>"#;
        let penalty = r#"<scene>
            <duration time="0.008"/>
            <integrator type="fast-mass-spring" dt="0.008" pins="penalty"/>
            <particle m="1.0" px="0.0" py="0.0" vx="0.0" vy="0.0" fixed="0"/>
            <particle m="1.0" px="0.0" py="2.0" vx="0.0" vy="0.0" fixed="1"/>
            <particle m="1.0" px="0.0" py="1.0" vx="0.0" vy="0.0" fixed="0"/>
            <elasticbodycstforce i1="1" i2="0" i3="2" youngsmodulus="1.0" poissonratio="0.0" xb1y="0.0" xb2x="-0.5"/>
        </scene>"#;
        let judged = |text: &str, symmetry: Symmetry| {
            let path = Path::Symmetry(symmetry);
            path.judge().judge(&path, &read(text).unwrap(), text)
        };
        // The jump is a millionth of the speed.
        let fast =
            fold.replace("1.0\"/>\n            <integrator", "0.001\"/>\n            <integrator");
        let fast = fast.replace("dt=\"1.0\"", "dt=\"0.001\"").replace("vx=\"0.0\"", "vx=\"500.0\"");
        for fold in [fold, &fast] {
            let turned = judged(fold, Symmetry::Rotation);
            assert!(matches!(turned, Judgement::Tells(Nothing::Sensitive)), "{turned:?}");
        }
        let doubled = judged(penalty, Symmetry::Masses);
        assert!(matches!(doubled, Judgement::Right(_)), "{doubled:?}");
    }
}
