//! Comparison of the probe's verdicts with the findings: single steps cannot distinguish a mistake of the method, of the
//! output or of something that all forces need from one of every force.

use std::collections::BTreeSet;

use diagnosis::findings::{Feature, Finding, FindingKind};
use scene::schema::{Masses, StepEquation};
use scene::{Dimension, Scene};

use crate::probe::{Block, PartReport, Probing, Verdict};

/// Takes back what is called wrong of a force that no finding names, where a finding explains it: wrong numbers in the
/// output, or something wrong of the method whose steps measure it, known or not, or a proven mistake of the reading, the precision
/// or the functions that every step needs. Where every force is wrong, something that all forces need may be. Parts that
/// steps of a passed scene depend on are right there, and wrong under other circumstances at most.
pub(super) fn take_back(probing: &mut Probing, findings: &[Finding], passed: &[&Scene]) {
    let is_of_all = |feature: &Feature| {
        matches!(feature, Feature::Reading | Feature::Helpers | Feature::Precision)
    };
    let explains_all = |finding: &&Finding| match finding.kind {
        FindingKind::Output => true,
        FindingKind::Cause => finding.features.iter().any(is_of_all),
        _ => false,
    };
    let of_all = findings.iter().find(explains_all);
    let is_doubtful = |dimension| {
        let in_space = probing.parts.iter().filter(|part| part.dimension == dimension);
        let measured: Vec<&PartReport> = in_space.filter(|part| shows_masses(part)).collect();
        let forces: BTreeSet<&str> = measured.iter().map(|part| part.force).collect();
        let is_wrong = |part: &&PartReport| part.force_finding.verdict == Verdict::Wrong;
        forces.len() > 1 && measured.iter().all(is_wrong)
    };
    let doubtful =
        [Dimension::Two, Dimension::Three].map(|dimension| (dimension, is_doubtful(dimension)));
    for part in &mut probing.parts {
        let is_named = |feature: &Feature| match feature {
            Feature::Force(named) | Feature::Jacobian(named) => named.tag() == part.force,
            _ => false,
        };
        if findings.iter().any(|finding| finding.features.iter().any(is_named)) {
            continue;
        }
        let Some(space) = probing.spaces.iter().find(|space| space.dimension == part.dimension)
        else {
            continue;
        };
        let of_method = |method: Option<&'static str>| {
            let is_of = |feature: &Feature| match feature {
                Feature::Integrator(name) => Some(*name) == method,
                _ => false,
            };
            findings.iter().find(|finding| finding.features.iter().any(is_of))
        };
        let explicit = space.explicit.as_ref().ok().copied();
        let implicit = space.implicit.as_ref().ok().copied();
        if let Some(finding) = of_all.or_else(|| of_method(explicit)) {
            part.take_back(true, &finding.sentence());
        } else if let Some(finding) = of_method(implicit) {
            part.take_back(false, &finding.sentence());
        }
        if doubtful.contains(&(part.dimension, true)) {
            part.take_back(true, "every force is wrong: masses, or the sum of all forces, may be");
        }
        let (force, blocks) = shown(part, passed);
        part.take_back_of(force, blocks, false, "a scene in which it acts passes");
    }
}

/// Whether these scenes, which passed, need the force of a part, and each of its blocks: one step of Newton's method does.
fn shown(part: &PartReport, passed: &[&Scene]) -> (bool, [bool; Block::ALL.len()]) {
    let acts = |scene: &Scene, between_free: bool| {
        let is_free = |particle: &usize| !scene.particles[*particle].fixed;
        let all: Vec<usize> = (0..scene.particles.len()).collect();
        scene.forces.iter().any(|element| {
            let mut parts = element.schema.parts.iter();
            let is_there = element.schema.tag == part.force
                && parts.any(|one| one.name == part.part && element.has_part(one));
            let (particles, is_field): (&[usize], bool) = match element.particles.is_empty() {
                true => (&all, true),
                false => (&element.particles, false),
            };
            let is_moved = match between_free {
                true => !is_field && particles.iter().all(is_free),
                false => particles.iter().any(is_free),
            };
            is_there && is_moved
        })
    };
    let in_space = || passed.iter().filter(|scene| scene.dimension == part.dimension);
    let is_linearized =
        |scene: &&&Scene| scene.integrator.equation == StepEquation::LinearizedImplicitEuler;
    let of_block = |block: Block| {
        let between_free = !block.holds(0, 0);
        in_space().filter(is_linearized).any(|scene| acts(scene, between_free))
    };
    (in_space().any(|scene| acts(scene, false)), Block::ALL.map(of_block))
}

/// Whether a wrong mass would show in a measured force: a force that is proportional to it hides it.
fn shows_masses(part: &PartReport) -> bool {
    let kind = simulator::vocabulary().force(part.force);
    kind.is_some_and(|schema| schema.masses != Masses::Own)
        && part.force_finding.verdict != Verdict::NotOffered
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boundary::printed::Untrusted;
    use crate::probe::{BuiltIn, Stepper, probe};
    use crate::verdict::Failure;
    use diagnosis::findings::Part;

    /// Explicit Euler that does not divide by the mass, but in scenes with gravitation.
    struct Undivided;

    impl Stepper for Undivided {
        fn name(&self) -> Untrusted {
            "undivided".into()
        }

        fn step(&self, scene: &Scene, integrator: &str) -> Result<Vec<f64>, Failure> {
            let mut velocities = BuiltIn.step(scene, integrator)?;
            let has_gravitation =
                scene.forces.iter().any(|element| element.schema.tag == "gravitationalforce");
            if integrator != "explicit-euler" || has_gravitation {
                return Ok(velocities);
            }
            let count = scene.dimension.count();
            for (particle, after) in scene.particles.iter().zip(velocities.chunks_mut(count)) {
                for (after, before) in after.iter_mut().zip(&particle.velocity) {
                    *after = before + particle.mass * (*after - before);
                }
            }
            Ok(velocities)
        }
    }

    fn cause(feature: Feature) -> Finding {
        Finding {
            kind: FindingKind::Cause,
            features: vec![feature],
            words: vec!["a mistake".to_owned()],
            scenes: Vec::new(),
            open: 0,
            unexplained: 0,
            example: None,
        }
    }

    /// The forces called wrong of a program with these forces, where findings are known.
    fn wrong(probing: &Probing, findings: &[Finding]) -> Vec<&'static str> {
        let mut probing = probing.clone();
        take_back(&mut probing, findings, &[]);
        let is_wrong = |part: &&PartReport| part.force_finding.verdict == Verdict::Wrong;
        let mut forces: Vec<_> =
            probing.parts.iter().filter(is_wrong).map(|part| part.force).collect();
        forces.dedup();
        forces
    }

    #[test]
    fn a_mistake_of_the_method_is_not_called_one_of_every_force() {
        let tags = ["gravitationalforce", "dragdamping", "springforce"];
        let probing = probe(&Undivided, |tag, _| tags.contains(&tag));
        let wrong = |findings: &[Finding]| wrong(&probing, findings);
        assert_eq!(wrong(&[]), ["springforce", "dragdamping", "springforce", "dragdamping"]);
        assert!(wrong(&[cause(Feature::Integrator("explicit-euler"))]).is_empty());
        let unknown =
            Finding { kind: FindingKind::Feature, ..cause(Feature::Integrator("explicit-euler")) };
        assert!(wrong(&[unknown]).is_empty());
        let both = [
            cause(Feature::Integrator("explicit-euler")),
            cause(Feature::Force(Part::All("dragdamping"))),
        ];
        assert_eq!(wrong(&both), ["dragdamping"]);
        assert!(wrong(&[cause(Feature::Reading)]).is_empty());
        // Implicit steps don't measure a force.
        let implicit = cause(Feature::Integrator("linearized-implicit-euler"));
        assert_eq!(wrong(&[implicit]).len(), 4);
    }

    /// A spring, and a particle that drags, in a step of this method.
    fn spring(integrator: &str, fixed: u8) -> Scene {
        let text = format!(
            r#"<scene> <duration time="1"/> <integrator type="{integrator}" dt="0.1"/>
  <particle m="1" px="0" py="0" vx="0" vy="0" fixed="{fixed}"/>
  <particle m="2" px="1" py="0" vx="3" vy="4" fixed="0"/>
  <edge i="0" j="1"/> <springforce edge="0" k="1" l0="0.5" b="0"/>
</scene>"#
        );
        let vocabulary = simulator::vocabulary();
        let options = scene::ParseOptions::default();
        scene::xml::parse(&text, "a.xml", &vocabulary, &options).expect("a scene").scene
    }

    #[test]
    fn what_a_scene_that_passed_needs_is_not_called_wrong() {
        let of = |tag: &str, dimension| tag == "springforce" && dimension == Dimension::Two;
        let probing = probe(&Undivided, of);
        let wrong = |passed: &[&Scene]| {
            let mut probing = probing.clone();
            take_back(&mut probing, &[], passed);
            let is_wrong = |part: &&PartReport| part.force_finding.verdict == Verdict::Wrong;
            probing.parts.iter().filter(is_wrong).map(|part| part.part).collect::<Vec<_>>()
        };
        assert_eq!(wrong(&[]), ["elastic", "damping"]);
        // It does not damp, and one of two fixed particles moves nothing.
        assert_eq!(wrong(&[&spring("explicit-euler", 0)]), ["damping"]);
        let mut fixed = spring("explicit-euler", 1);
        fixed.particles[1].fixed = true;
        assert_eq!(wrong(&[&fixed]), ["elastic", "damping"]);
        let shown = |scene: &Scene| shown(&probing.parts[0], &[scene]).1;
        assert_eq!(shown(&spring("linearized-implicit-euler", 0)), [true; 4]);
        assert_eq!(shown(&spring("linearized-implicit-euler", 1)), [true, false, true, false]);
        assert_eq!(shown(&spring("implicit-euler", 0)), [false; 4]);
    }

    #[test]
    fn where_every_force_is_wrong_none_is_called_so() {
        let of = |tags: &[&str]| {
            wrong(&probe(&Undivided, |tag, of| of == Dimension::Two && tags.contains(&tag)), &[])
        };
        assert!(of(&["springforce", "dragdamping"]).is_empty());
        assert_eq!(of(&["springforce"]), ["springforce"]);
        assert_eq!(of(&["springforce", "gravitationalforce"]), ["springforce"]);
    }
}
