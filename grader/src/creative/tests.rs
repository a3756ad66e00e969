use std::fs;
use std::time::Duration;

use test_support::root;

use super::examine::examine;
use super::*;

/// The outcome of each check of a scene, and what was found.
fn checked(name: &str, scene: &str, film: &str) -> Vec<(Outcome, String)> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, scene).unwrap();
    fs::write(path.with_extension("gif"), film).unwrap();
    let assignments = Assignment::list(&root().join("assets/assignments")).unwrap();
    let rules = Rules { assignments: &assignments, assignment: None };
    let (examined, _) = examine(&path, Duration::from_secs(60));
    let place = Place::open(folder.path(), Path::new(name)).unwrap();
    let (_, found) = judge(&path, Ok(examined), film::check(&place, &path), rules);
    found.into_iter().map(|check| (check.outcome, check.found)).collect()
}

/// A spring with this integrator, time step and distance.
fn spring(integrator: &str, dt: f64, distance: f64) -> String {
    format!(
        r#"<scene><duration time="6"/><integrator type="{integrator}" dt="{dt}"/>
        <particle m="0.1" px="0" py="0" vx="0" vy="0" fixed="1"/>
        <particle m="0.1" px="{distance}" py="0.1" vx="0" vy="0.3" fixed="0"/>
        <edge i="0" j="1"/><springforce edge="0" k="40" l0="1"/></scene>"#
    )
}

fn outcomes(found: &[(Outcome, String)]) -> String {
    let sign = |outcome: &Outcome| match outcome {
        Outcome::Passed => '+',
        Outcome::Failed => '-',
        Outcome::NotMade => '?',
    };
    found.iter().map(|(outcome, _)| sign(outcome)).collect()
}

#[test]
fn a_good_scene_passes_and_names_its_new_features() {
    let found = checked("ab1234_t1m2.xml", &spring("symplectic-euler", 0.01, 1.2), "GIF89a");
    assert_eq!(outcomes(&found), "++++++", "{found:#?}");
    assert_eq!(found[2].1, "springforce, symplectic-euler");
}

#[test]
fn each_check_can_fail() {
    // The scene of a later milestone, in a file without a milestone in its name, and an invalid film.
    let found = checked("t1m2.xml", &spring("symplectic-euler", 0.01, 1.2), "RIFF");
    assert_eq!(outcomes(&found), "-+?++-", "{found:#?}");
    let found = checked("ab_t1m1.xml", &spring("symplectic-euler", 0.01, 1.2), "GIF89a");
    assert_eq!(outcomes(&found), "++-+++", "{found:#?}");
    assert!(found[2].1.starts_with("t1m1 does not have springforce, symplectic-euler"));
    let found = checked("ab_t1m3.xml", &spring("symplectic-euler", 0.01, 1.2), "GIF89a");
    let message = "it uses nothing that is new in t1m3\nhelp: use one of linearized-implicit-euler, implicit-euler";
    assert_eq!(found[2].1, message);
    let found = checked("ab_t1m2.xml", "<scene>", "GIF89a");
    assert_eq!(outcomes(&found), "+-???+", "{found:#?}");
    let found = checked("ab_t1m2.xml", &spring("symplectic-euler", 0.01, 0.15), "GIF89a");
    assert_eq!(outcomes(&found), "++++-+", "{found:#?}");
    assert!(found[4].1.contains("particles 0 and 1"), "{}", found[4].1);
}

/// ω = 20 / s: the longest stable step of symplectic Euler is 0.1 s, and explicit Euler grows by ω² h² / 2 in each step.
#[test]
fn blow_up_drift_and_damping_are_distinguished() {
    for (integrator, dt, is_stable) in [
        ("symplectic-euler", 0.09, true),
        ("symplectic-euler", 0.11, false),
        ("explicit-euler", 0.0005, true),
        ("explicit-euler", 0.01, false),
        ("explicit-euler", 0.2, false),
        ("implicit-euler", 0.09, true),
        ("linearized-implicit-euler", 0.09, true),
    ] {
        let found = checked("ab_t1m3.xml", &spring(integrator, dt, 1.2), "GIF89a");
        assert_eq!(found[3].0 == Outcome::Passed, is_stable, "{integrator} {dt}: {:?}", found[3]);
    }
}

#[test]
fn a_run_that_takes_too_long_fails() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ab_t1m2.xml");
    fs::write(&path, spring("symplectic-euler", 1e-8, 1.2)).unwrap();
    let (examined, shown) = examine(&path, Duration::from_millis(50));
    let Examined::Scene(Facts { run: Err(run), .. }) = examined else { panic!("{examined:?}") };
    assert!(run.contains("within 0.05 s"), "{run:?}");
    let (_, motion) = shown.unwrap();
    assert_eq!(motion.times[0], 0.0);
}

/// The rounds of a step have no end, or their tolerance cannot be met.
#[test]
fn a_step_that_takes_too_long_fails() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ab_t1m2.xml");
    for tolerance in ["0", "5e-324"] {
        let scene = spring("fast-mass-spring", 0.01, 1.2);
        let options = format!("iterations=\"1000000000000000\" tolerance=\"{tolerance}\" dt=");
        fs::write(&path, scene.replace("dt=", &options)).unwrap();
        let (examined, _) = examine(&path, Duration::from_millis(50));
        let Examined::Scene(Facts { run: Err(run), .. }) = examined else { panic!("{examined:?}") };
        assert!(run.contains("step 1 of 600 is not reached within 0.05 s"), "{run:?}");
    }
}

#[test]
fn interrupted_check_is_reported() {
    let rules = Rules { assignments: &[], assignment: None };
    let ended = Err("its check was ended: out of memory".to_owned());
    let (_, checks) = judge(Path::new("ab_t1m2.xml"), ended, Ok(String::new()), rules);
    let found: Vec<_> = checks.into_iter().map(|check| (check.outcome, check.found)).collect();
    assert_eq!(outcomes(&found), "-??-?+", "{found:#?}");
    assert!(found[3].1.contains("out of memory"));
}
