//! Mistakes of the second simulator, judged by the black-box probe, which was developed without them.
//!
//! The second simulator is probed in this process like a program: by the velocities after single steps.

use grader::boundary::printed::Untrusted;
use grader::probe::{Probing, Stepper, Verdict, probe};
use grader::submission::StateSource;
use grader::verdict::Failure;
use rayon::prelude::*;
use scene::trace::{Shape, State};
use scene::{Dimension, Scene};
use selftest::mistake::{self, Area};
use selftest::student::{self, Student};

/// A student as a single-step program.
struct Steps(Student);

impl Stepper for Steps {
    fn name(&self) -> Untrusted {
        "student".into()
    }

    fn step(&self, scene: &Scene, integrator: &str) -> Result<Vec<f64>, Failure> {
        let refused = |detail: &str| Failure::Crashed { detail: detail.into() };
        let schema = simulator::vocabulary().integrator(integrator);
        let scene = Scene {
            integrator: schema.ok_or_else(|| refused("no such integrator"))?,
            ..scene.clone()
        };
        if scene.dimension == Dimension::Three || !student::knows(&scene) {
            return Err(refused("not known"));
        }
        let mut run = self.0.simulate(&scene);
        let mut state = State::zeros(Shape::of(&scene));
        run.read(&mut state)?;
        run.read(&mut state)?;
        if state.velocities.iter().any(|v| !v.is_finite()) {
            return Err(refused("not finite"));
        }
        Ok(state.velocities)
    }
}

/// `force: finding` of all findings with this verdict.
fn with(probing: &Probing, verdict: Verdict) -> Vec<(&'static str, &'static str)> {
    let all = probing.parts.iter().flat_map(|part| {
        let found = part.findings().filter(|(_, finding)| finding.verdict == verdict);
        found.map(|(name, _)| (part.force, name)).collect::<Vec<_>>()
    });
    all.collect()
}

/// The tag of the force that a subject refers to.
pub(crate) fn tag(subject: &str) -> &'static str {
    let tags = [
        ("spring of squared length", "greenspringforce"),
        ("spring", "springforce"),
        ("gravitation", "gravitationalforce"),
        ("linear drag", "dragdamping"),
        ("vortex", "vortexforce"),
        ("simple gravity", "simplegravity"),
        ("constant force", "constantforce"),
    ];
    let found = tags.iter().find(|(name, _)| subject.starts_with(name));
    found.unwrap_or_else(|| panic!("{subject} is about no force")).1
}

#[test]
fn probing_finds_the_second_implementation_correct() {
    let probing = probe(&Steps(Student::faultless()), |_, _| true);
    assert_eq!(with(&probing, Verdict::Wrong), []);
    assert_eq!(with(&probing, Verdict::Inconclusive), []);
    // Nine parts of the supported forces, six findings each.
    assert_eq!(with(&probing, Verdict::Correct).len(), 54);
}

#[test]
fn jacobian_mistakes_are_blamed_on_their_force_alone() {
    let escapes = |mistake: &mistake::Mistake| {
        let probing = probe(&Steps(mistake.student()), |_, _| true);
        let wrong = with(&probing, Verdict::Wrong);
        let here =
            |(force, name): &(&str, &str)| *force == tag(mistake.subject) && *name != "force";
        let is_well = !wrong.is_empty() && wrong.iter().all(here);
        (!is_well).then(|| format!("{}, {}: {wrong:?}", mistake.subject, mistake.description))
    };
    let mistakes = mistake::all();
    let mistakes = mistakes.par_iter().filter(|mistake| mistake.area == Area::Jacobian);
    let escaped: Vec<String> = mistakes.filter_map(escapes).collect();
    assert!(escaped.is_empty(), "{}", escaped.join("\n"));
}

#[test]
fn implicit_step_mistakes_are_blamed_on_no_force() {
    let escapes = |mistake: &mistake::Mistake| {
        let probing = probe(&Steps(mistake.student()), |_, _| true);
        let wrong = with(&probing, Verdict::Wrong);
        let is_well = !wrong.is_empty() && wrong.iter().all(|(_, name)| *name != "force");
        (!is_well).then(|| format!("{}: {wrong:?}", mistake.description))
    };
    // The velocities after a single step do not depend on the position update.
    let shows = |mistake: &&mistake::Mistake| {
        mistake.subject == "linearized implicit Euler" && !mistake.description.contains("position")
    };
    let escaped: Vec<String> =
        mistake::all().par_iter().filter(shows).filter_map(escapes).collect();
    assert!(escaped.is_empty(), "{}", escaped.join("\n"));
}
