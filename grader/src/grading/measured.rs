//! What the probe calls wrong, held against the findings: single steps cannot tell a mistake of the method, of the output or
//! of what all forces need from one of every force.

use diagnosis::findings::{Feature, Finding, FindingKind};

use crate::probe::Probing;

/// Takes back what is called wrong of a force that no finding names, where a finding explains it: wrong numbers in the
/// output, or a proven mistake of the method whose steps measure it, or of the reading, the precision or the functions that
/// every step needs.
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
            let is_cause = |finding: &&Finding| {
                finding.kind == FindingKind::Cause && finding.features.iter().any(is_of)
            };
            findings.iter().find(is_cause)
        };
        let explicit = space.explicit.as_ref().ok().copied();
        let implicit = space.implicit.as_ref().ok().copied();
        if let Some(finding) = of_all.or_else(|| of_method(explicit)) {
            part.take_back(true, &finding.sentence());
        } else if let Some(finding) = of_method(implicit) {
            part.take_back(false, &finding.sentence());
        }
    }
}

#[cfg(test)]
mod tests {
    use scene::Scene;

    use super::*;
    use crate::boundary::printed::Untrusted;
    use crate::probe::{BuiltIn, Stepper, Verdict, probe};
    use crate::verdict::Failure;
    use diagnosis::findings::Part;

    /// Explicit Euler that does not divide by the mass.
    struct Undivided;

    impl Stepper for Undivided {
        fn name(&self) -> Untrusted {
            "undivided".into()
        }

        fn step(&self, scene: &Scene, integrator: &str) -> Result<Vec<f64>, Failure> {
            let mut velocities = BuiltIn.step(scene, integrator)?;
            if integrator != "explicit-euler" {
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

    #[test]
    fn a_mistake_of_the_method_is_not_called_one_of_every_force() {
        let probing = probe(&Undivided, |tag, _| ["dragdamping", "springforce"].contains(&tag));
        let wrong = |findings: &[Finding]| {
            let mut probing = probing.clone();
            take_back(&mut probing, findings);
            let is_wrong = |part: &&crate::probe::PartReport| part.verdict() == Verdict::Wrong;
            let mut forces: Vec<_> =
                probing.parts.iter().filter(is_wrong).map(|part| part.force).collect();
            forces.dedup();
            forces
        };
        assert_eq!(wrong(&[]), ["springforce", "dragdamping", "springforce", "dragdamping"]);
        assert!(wrong(&[cause(Feature::Integrator("explicit-euler"))]).is_empty());
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
}
