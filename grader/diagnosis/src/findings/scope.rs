//! Features of a simulator, each with the scenes that fail if it is wrong.

use std::collections::BTreeSet;

use scene::schema::{self, Convergence, Masses, Matrix, StepEquation};
use scene::{ForceElement, Scene};
use simulator::integrator::IntegratorKind;
use simulator::{force, integrator};

use super::feature::{Family, Feature, Part};

/// Prediction for a scene under a cause.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Expected {
    Fails,
    /// May fail: Newton's method, for example, often converges with wrong derivatives.
    May,
    Passes,
}

/// A failing scene, with what its wrong steps show.
pub(super) struct Failing<'a> {
    pub(super) scene: &'a Scene,
    /// Free particles do not move by their velocities.
    pub(super) moves_otherwise: bool,
    /// The state of a fixed particle is wrong.
    pub(super) moves_fixed: bool,
    /// The free particles whose velocities are wrong.
    pub(super) wrong: BTreeSet<usize>,
}

impl<'a> Failing<'a> {
    /// One whose steps show nothing.
    pub(super) fn of(scene: &'a Scene) -> Self {
        Self { scene, moves_otherwise: false, moves_fixed: false, wrong: BTreeSet::new() }
    }

    /// Whether a feature can do what is shown: a force changes the velocities of free particles only.
    fn can_be(&self, feature: Feature) -> bool {
        match feature {
            Feature::Force(_) | Feature::Jacobian(_) => !self.moves_otherwise && !self.moves_fixed,
            Feature::Fixed(_) => !self.moves_otherwise,
            _ => true,
        }
    }

    fn expected(&self, hypothesis: &Hypothesis) -> Expected {
        match self.can_be(hypothesis.feature) {
            true => (hypothesis.expects)(self.scene),
            false => Expected::Passes,
        }
    }
}

/// A cause under certain circumstances.
pub(super) struct Hypothesis {
    pub(super) feature: Feature,
    /// The circumstances, in words.
    pub(super) detail: String,
    /// Whether the circumstances are special.
    pub(super) special: bool,
    pub(super) expects: Box<dyn Fn(&Scene) -> Expected>,
}

/// A circumstance: a description and a test of the scene.
type Circumstance<T> = (&'static str, fn(&Scene, T) -> bool);

/// Circumstances under which forces may be wrong.
const OF_FORCES: [Circumstance<Part>; 5] = [
    ("", |_, _| true),
    ("with several elements", |scene, part| elements(scene, part).count() > 1),
    ("with two on one edge", |scene, part| {
        let edges: Vec<_> = elements(scene, part).filter_map(|element| element.edge).collect();
        (1..edges.len()).any(|k| edges[..k].contains(&edges[k]))
    }),
    ("where masses are not 1", |scene, _| unusual_masses(scene)),
    ("between two free particles", |scene, part| {
        elements(scene, part).any(|element| {
            let is_free = |particle: &usize| !scene.particles[*particle].fixed;
            !element.particles.is_empty() && element.particles.iter().all(is_free)
        })
    }),
];

/// Circumstances under which Jacobians may be wrong.
const OF_JACOBIANS: [Circumstance<Part>; 4] = [
    ("", |_, _| true),
    ("between two free particles", |scene, part| {
        elements(scene, part).any(|element| {
            let is_free = |particle: &usize| !scene.particles[*particle].fixed;
            !element.particles.is_empty() && element.particles.iter().all(is_free)
        })
    }),
    ("between particles other than the first two", |scene, part| {
        let others = |element: &ForceElement| element.particles.iter().any(|each| *each > 1);
        let is_field = part.schema().stencil.is_field();
        elements(scene, part)
            .any(|element| others(element) || (is_field && scene.particles.len() > 1))
    }),
    ("where masses are not 1", |scene, _| unusual_masses(scene)),
];

/// Circumstances under which integrators may be wrong.
const OF_INTEGRATORS: [Circumstance<()>; 6] = [
    ("", |_, ()| true),
    ("where forces act", |scene, ()| parts().any(|part| acts(scene, part))),
    ("where forces depend on positions", |scene, ()| some(scene, by_position)),
    ("where forces depend on velocities", |scene, ()| some(scene, by_velocity)),
    ("where forces have Jacobians", |scene, ()| {
        some(scene, by_position) || some(scene, by_velocity)
    }),
    ("where forces act and masses are not 1", |scene, ()| {
        unusual_masses(scene) && parts().any(|part| acts(scene, part))
    }),
];

/// Circumstances under which fixed particles may be wrong.
const OF_FIXED: [Circumstance<()>; 5] = [
    ("", |_, ()| true),
    ("that move", |scene, ()| {
        scene.particles.iter().any(|particle| particle.fixed && particle.velocity != [0.0; 3])
    }),
    ("that forces act on", |scene, ()| {
        scene.forces.iter().any(|element| element.particles.is_empty()) || joined(scene)
    }),
    ("joined to others by forces", |scene, ()| joined(scene)),
    ("under simple gravity", |scene, ()| {
        scene.forces.iter().any(|element| element.schema.tag == "simplegravity")
    }),
];

/// A feature with the circumstances under which it fails, in words, and the failing scenes that use it.
pub(super) type Guilty = (Feature, String, Vec<usize>);

/// The only feature that is used in every failing scene and in no right one: with the circumstances in words, if it fails
/// under these alone. `None` if there is none, more than one, or fewer than `few` failing scenes.
pub(super) fn only(failing: &[Failing<'_>], right: &[&Scene], few: usize) -> Option<Guilty> {
    if failing.len() < few {
        return None;
    }
    let mut all = hypotheses();
    all.extend(on_particles(failing));
    let fits = |hypothesis: &&Hypothesis| {
        let of = |scene: &Failing<'_>| scene.expected(hypothesis);
        let mut surely = failing.iter().map(of).filter(|expected| *expected == Expected::Fails);
        failing.iter().all(|scene| of(scene) != Expected::Passes)
            && right.iter().all(|scene| (hypothesis.expects)(scene) != Expected::Fails)
            && surely.next().is_some()
    };
    for special in [false, true] {
        let fitting: Vec<&Hypothesis> =
            all.iter().filter(|one| one.special == special).filter(fits).collect();
        let Some(first) = fitting.first() else { continue };
        let is_alone = fitting.iter().all(|one| one.feature == first.feature);
        // Where every failing scene uses the derivatives of a force, they may be wrong as well as the force.
        let is_derivative = |one: &&Hypothesis| match (one.feature, first.feature) {
            (Feature::Jacobian(part), Feature::Force(force)) => part == force,
            _ => false,
        };
        let may_be = |one: &Hypothesis| {
            failing.iter().all(|scene| scene.expected(one) != Expected::Passes)
                && right.iter().all(|scene| (one.expects)(scene) != Expected::Fails)
        };
        let is_sure = is_alone && !all.iter().filter(is_derivative).any(may_be);
        let every = (0..failing.len()).collect();
        return is_sure.then(|| (first.feature, first.detail.clone(), every));
    }
    None
}

/// The features that no right scene uses and of which some failing scenes use one only, if together they are in every
/// failing scene; otherwise none.
pub(super) fn eliminated(failing: &[Failing<'_>], right: &[&Scene], few: usize) -> Vec<Guilty> {
    let all = hypotheses();
    let is_plain = |one: &&Hypothesis| {
        let broad = !one.special || matches!(one.feature, Feature::Integrator(_));
        broad && !matches!(one.feature, Feature::Everything | Feature::Reading | Feature::Precision)
    };
    let open: Vec<&Hypothesis> = all
        .iter()
        .filter(is_plain)
        .filter(|one| right.iter().all(|scene| (one.expects)(scene) != Expected::Fails))
        .collect();
    let suspects = |scene: &Failing<'_>| {
        let used = open.iter().filter(|one| scene.expected(one) != Expected::Passes);
        let mut features: Vec<Feature> = used.map(|one| one.feature).collect();
        features.sort_unstable();
        features.dedup();
        features
    };
    let of_each: Vec<Vec<Feature>> = failing.iter().map(suspects).collect();
    let mut guilty: Vec<Guilty> = Vec::new();
    for features in &of_each {
        let [one] = features.as_slice() else { continue };
        let alone = of_each.iter().filter(|other| *other == features).count();
        if alone >= few && guilty.iter().all(|(known, ..)| known != one) {
            let users = of_each.iter().enumerate().filter(|(_, other)| other.contains(one));
            guilty.push((*one, String::new(), users.map(|(number, _)| number).collect()));
        }
    }
    let is_covered = |number: usize| guilty.iter().any(|(_, _, scenes)| scenes.contains(&number));
    if (0..failing.len()).all(is_covered) { guilty } else { Vec::new() }
}

/// Forces on single particles, and integrators where forces act, that are wrong on those particles whose velocities are.
fn on_particles(failing: &[Failing<'_>]) -> Vec<Hypothesis> {
    let wrong: BTreeSet<usize> = failing.iter().flat_map(|scene| scene.wrong.clone()).collect();
    let has_wrong = move |scene: &Scene| {
        let each = scene.particles.iter().enumerate();
        each.filter(|(_, particle)| !particle.fixed).any(|(number, _)| wrong.contains(&number))
    };
    let detail = "on some particles";
    let mut all = Vec::new();
    for part in parts().filter(|part| part.schema().stencil.is_field()) {
        let has_wrong = has_wrong.clone();
        let expects = move |scene: &Scene| when(acts(scene, part) && has_wrong(scene));
        all.push(hypothesis(Feature::Force(part), detail, expects));
    }
    for kind in integrator::REGISTRY {
        let (name, has_wrong) = (kind.schema.name, has_wrong.clone());
        let expects = move |scene: &Scene| {
            let is_forced = || parts().any(|part| acts(scene, part));
            when(scene.integrator.name == name && is_forced() && has_wrong(scene))
        };
        all.push(hypothesis(Feature::Integrator(name), detail, expects));
    }
    all
}

/// All features under all circumstances, the unconditional ones first.
fn hypotheses() -> Vec<Hypothesis> {
    let mut all = Vec::new();
    for part in parts() {
        for (detail, holds) in OF_FORCES {
            let expects = move |scene: &Scene| when(acts(scene, part) && holds(scene, part));
            all.push(hypothesis(Feature::Force(part), detail, expects));
        }
    }
    for part in parts().filter(|part| part.depends_on().has_jacobian()) {
        for (detail, holds) in OF_JACOBIANS {
            let expects = move |scene: &Scene| match scene.integrator.equation {
                _ if !(acts(scene, part) && holds(scene, part)) => Expected::Passes,
                StepEquation::LinearizedImplicitEuler => Expected::Fails,
                _ if scene.integrator.matrix == Matrix::Jacobians => Expected::May,
                _ => Expected::Passes,
            };
            all.push(hypothesis(Feature::Jacobian(part), detail, expects));
        }
    }
    for kind in integrator::REGISTRY {
        let name = kind.schema.name;
        for (detail, holds) in OF_INTEGRATORS {
            let expects =
                move |scene: &Scene| when(scene.integrator.name == name && holds(scene, ()));
            all.push(hypothesis(Feature::Integrator(name), detail, expects));
        }
    }
    // Newton's method may end too early, and be near enough in most scenes.
    let ends = |kind: &&&IntegratorKind| {
        matches!(kind.schema.convergence, Convergence::Update(_) | Convergence::UpdateOption(_))
    };
    for kind in integrator::REGISTRY.iter().filter(ends) {
        let name = kind.schema.name;
        let newton = move |scene: &Scene| match scene.integrator.name == name {
            true if some(scene, by_position) => Expected::May,
            _ => Expected::Passes,
        };
        all.push(hypothesis(Feature::Integrator(name), "stopping of Newton's method", newton));
    }
    for of in [Family::Any, Family::Explicit, Family::Implicit] {
        for (detail, holds) in OF_FIXED {
            let expects = move |scene: &Scene| {
                let concerned = of == Family::Any || of == family(scene);
                let fixed = scene.particles.iter().any(|particle| particle.fixed);
                when(concerned && fixed && holds(scene, ()))
            };
            all.push(hypothesis(Feature::Fixed(of), detail, expects));
        }
    }
    for kind in integrator::REGISTRY {
        let name = kind.schema.name;
        let expects = move |scene: &Scene| {
            let fixed = scene.particles.iter().any(|particle| particle.fixed);
            when(scene.integrator.name == name && fixed)
        };
        all.push(hypothesis(Feature::Fixed(Family::of(name)), &format!("{name} alone"), expects));
    }
    let several = "or adding up its forces, where there are several";
    all.push(hypothesis(Feature::Reading, several, |scene: &Scene| when(scene.forces.len() > 1)));
    all.push(hypothesis(Feature::Reading, "masses", |scene: &Scene| {
        // A force proportional to the mass accelerates all masses alike.
        let feels = |part: Part| part.schema().masses != Masses::Own && acts(scene, part);
        when(unusual_masses(scene) && parts().any(feels))
    }));
    all.push(hypothesis(Feature::Everything, "", |_: &Scene| Expected::Fails));
    all
}

fn hypothesis(
    feature: Feature,
    detail: &str,
    expects: impl Fn(&Scene) -> Expected + 'static,
) -> Hypothesis {
    let special = !detail.is_empty();
    Hypothesis { feature, detail: detail.to_owned(), special, expects: Box::new(expects) }
}

fn when(fails: bool) -> Expected {
    if fails { Expected::Fails } else { Expected::Passes }
}

/// Every force, in the parts that stand alone.
fn parts() -> impl Iterator<Item = Part> {
    force::REGISTRY.iter().flat_map(|kind| Part::of(&kind.schema))
}

/// The elements through which a part acts on a free particle.
fn elements(scene: &Scene, part: Part) -> impl Iterator<Item = &ForceElement> {
    let is_free = |particle: &usize| !scene.particles[*particle].fixed;
    let all = scene.forces.iter().filter(move |element| element.schema.tag == part.tag());
    all.filter(move |element| {
        let reaches = if element.particles.is_empty() {
            scene.particles.iter().any(|particle| !particle.fixed)
        } else {
            element.particles.iter().any(is_free)
        };
        part.is_in(element) && reaches
    })
}

fn acts(scene: &Scene, part: Part) -> bool {
    elements(scene, part).next().is_some()
}

fn unusual_masses(scene: &Scene) -> bool {
    scene.particles.iter().any(|particle| !particle.fixed && particle.mass != 1.0)
}

/// Whether some force joins a fixed and a free particle.
fn joined(scene: &Scene) -> bool {
    let is_fixed = |particle: &usize| scene.particles[*particle].fixed;
    let is_mixed =
        |particles: &[usize]| particles.iter().any(is_fixed) && !particles.iter().all(is_fixed);
    scene.forces.iter().any(|element| is_mixed(&element.particles))
}

fn family(scene: &Scene) -> Family {
    match scene.integrator.family {
        schema::Family::Explicit | schema::Family::Symplectic => Family::Explicit,
        schema::Family::Implicit | schema::Family::Minimization => Family::Implicit,
    }
}

/// Whether some force that acts is of this sort.
fn some(scene: &Scene, is: impl Fn(Part) -> bool) -> bool {
    parts().any(|part| is(part) && acts(scene, part))
}

fn by_position(part: Part) -> bool {
    part.depends_on().position
}

fn by_velocity(part: Part) -> bool {
    part.depends_on().velocity
}
