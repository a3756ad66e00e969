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
use selftest::mistake::{self, Area, Mistake};
use selftest::student::{self, Student};
use test_support::sample;

/// A student as a single-step program.
struct Steps(Student);

impl Stepper for Steps {
    fn name(&self) -> Untrusted {
        "student".into()
    }

    fn step(&self, scene: &Scene, integrator: &str) -> Result<Vec<f64>, Failure> {
        let refused = |reason: &str| Failure::GaveUp { reason: reason.into() };
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

/// A program that refuses constant forces.
struct WithoutConstantForce(Steps);

impl Stepper for WithoutConstantForce {
    fn name(&self) -> Untrusted {
        self.0.name()
    }

    fn step(&self, scene: &Scene, integrator: &str) -> Result<Vec<f64>, Failure> {
        match scene.forces.iter().any(|element| element.schema.tag == "constantforce") {
            true => self.0.step(&Scene { forces: Vec::new(), ..scene.clone() }, "no-method"),
            false => self.0.step(scene, integrator),
        }
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
        ("elastic bar", "elasticbodyspringforce"),
        ("bending", "elasticbodybendingforce"),
        ("triangle", "elasticbodycstforce"),
        ("St. Venant–Kirchhoff triangle", "stvktriangle"),
        ("corotated triangle", "corotatedtriangle"),
        ("stable neo-Hookean triangle", "neohookeantriangle"),
        ("damping in proportion to mass", "massdamping"),
    ];
    let found = tags.iter().find(|(name, _)| subject.starts_with(name));
    found.unwrap_or_else(|| panic!("{subject} is about no force")).1
}

#[test]
fn probing_finds_the_second_implementation_correct() {
    let probing = probe(&Steps(Student::faultless()), |_, _| true);
    assert_eq!(with(&probing, Verdict::Wrong), []);
    assert_eq!(with(&probing, Verdict::Inconclusive), []);
    // Fifteen parts of the supported forces, six findings each, and the value of damping by mass.
    assert_eq!(with(&probing, Verdict::Correct).len(), 91);
}

/// Probes mistakes, and asserts that findings are wrong, all of them where `may_be` says.
fn assert_wrong(mistakes: &[Mistake], may_be: fn(&Mistake, &str, &str) -> bool) {
    let escapes = |mistake: &Mistake| {
        let probing = probe(&Steps(mistake.student()), |_, _| true);
        let wrong = with(&probing, Verdict::Wrong);
        let is_well =
            !wrong.is_empty() && wrong.iter().all(|(force, name)| may_be(mistake, force, name));
        (!is_well).then(|| format!("{}, {}: {wrong:?}", mistake.subject, mistake.description))
    };
    assert!(!mistakes.is_empty());
    let escaped: Vec<String> = mistakes.par_iter().filter_map(escapes).collect();
    assert!(escaped.is_empty(), "{}", escaped.join("\n"));
}

#[test]
fn blocks_are_not_called_correct_where_steps_move_along_lines_only() {
    let is_of = |mistake: &&Mistake, subject: &str| {
        mistake.subject == subject && mistake.description == "missing"
    };
    let mut student = Student::faultless();
    for subject in ["spring, elastic force, ∂F/∂x", "spring, damping, ∂F/∂x"] {
        let all = in_jacobians();
        all.iter().find(|mistake| is_of(mistake, subject)).expect(subject).plant(&mut student);
    }
    // Without a spring's Jacobians, steps under its force alone leave each pair on its line, and no constant force moves it off.
    let probing = probe(&WithoutConstantForce(Steps(student)), |tag, _| tag == "springforce");
    let correct = with(&probing, Verdict::Correct);
    let of_blocks: Vec<_> = correct.iter().filter(|(_, name)| name.starts_with("dF")).collect();
    assert_eq!(of_blocks, [] as [&(&str, &str); 0], "{correct:?}");
    assert!(!with(&probing, Verdict::Wrong).is_empty());
}

fn blames_its_jacobian(mistake: &Mistake, force: &str, name: &str) -> bool {
    force == tag(mistake.subject) && name != "force"
}

/// Mistakes in Jacobians that act in the probe's states: its triangles all turn one way, and of damping by mass it judges the value
/// alone.
fn in_jacobians() -> Vec<Mistake> {
    let acts = |mistake: &Mistake| {
        mistake.area == Area::Jacobian
            && mistake.description != "area with its sign"
            && tag(mistake.subject) != "massdamping"
    };
    mistake::all().into_iter().filter(acts).collect()
}

#[test]
fn sampled_jacobian_mistakes_are_blamed_on_their_force_alone() {
    assert_wrong(&sample(in_jacobians(), 2), blames_its_jacobian);
}

#[test]
#[ignore = "long: half a minute"]
fn long_jacobian_mistakes_are_blamed_on_their_force_alone() {
    assert_wrong(&in_jacobians(), blames_its_jacobian);
}

fn blames_no_force(_: &Mistake, _: &str, name: &str) -> bool {
    name != "force"
}

/// Mistakes in linearized implicit Euler, except those in the positions, on which the velocities after a single step do not
/// depend, and what is kept of steps before: there are none.
fn in_implicit_steps() -> Vec<Mistake> {
    let shows = |mistake: &Mistake| {
        let is_of = |word: &str| mistake.description.contains(word);
        mistake.subject == "linearized implicit Euler" && !is_of("position") && !is_of("steps")
    };
    mistake::all().into_iter().filter(shows).collect()
}

#[test]
fn sampled_implicit_step_mistakes_are_blamed_on_no_force() {
    assert_wrong(&sample(in_implicit_steps(), 1), blames_no_force);
}

#[test]
#[ignore = "long: a quarter of a minute"]
fn long_implicit_step_mistakes_are_blamed_on_no_force() {
    assert_wrong(&in_implicit_steps(), blames_no_force);
}
