//! What the probe calls wrong, held against the findings: single steps cannot tell a mistake of the method, of the output or
//! of what all forces need from one of every force.

use std::collections::BTreeSet;

use diagnosis::findings::{Feature, Finding, FindingKind};
use scene::Dimension;
use scene::schema::Masses;

use crate::probe::{PartReport, Probing, Verdict};

/// Takes back what is called wrong of a force that no finding names, where a finding explains it: wrong numbers in the
/// output, or something wrong of the method whose steps measure it, known or not, or a proven mistake of the reading, the precision
/// or the functions that every step needs. Where every force is wrong, something that all forces need may be.
pub(super) fn take_back(probing: &mut Probing, findings: &[Finding]) {
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
    }
}

/// Whether a wrong mass would show in a measured force: a force that is proportional to it hides it.
fn shows_masses(part: &PartReport) -> bool {
    let kind = simulator::vocabulary().force(part.force);
    kind.is_some_and(|schema| schema.masses != Masses::Own)
        && part.force_finding.verdict != Verdict::NotOffered
}

#[cfg(test)]
mod tests {
    use scene::Scene;

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
        take_back(&mut probing, findings);
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
