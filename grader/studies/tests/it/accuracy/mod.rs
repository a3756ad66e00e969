//! Accuracy study: orders, planted mistakes and references. No test depends on measured times.

mod planted;
use simulator::integrator;
use studies::accuracy::order;
use studies::accuracy::problem::{PROBLEMS, Problem};
use studies::accuracy::reference::{Reference, Source};
use studies::accuracy::{self, AccuracyConfig, Closed, Errors, Quantity, Study, Target};

/// The time steps of a quick run, each run once.
const ONCE: AccuracyConfig = AccuracyConfig { repeats: 1, budget: 0.0, ..AccuracyConfig::QUICK };

fn problem(name: &str) -> &'static Problem {
    PROBLEMS.iter().find(|problem| problem.name == name).expect("a registered problem")
}

fn closed(problem: &Problem) -> Option<Closed> {
    problem.closed.map(|closed| closed(&problem.scene()))
}

fn study(names: &[&str], config: AccuracyConfig) -> Study {
    let targets = names.iter().map(|name| Target::of_problem(problem(name))).collect();
    accuracy::study(targets, None, config, None, &mut |_, _, _| {}).unwrap()
}

#[test]
fn smooth_scenes_confirm_the_order_of_every_integrator() {
    let study = study(&["oscillator", "ellipse", "spring-pendulum", "combined"], ONCE);
    for scene in &study.scenes {
        for curve in &scene.curves {
            for order in scene.orders(curve) {
                let what = format!("{}, {}: {order:?}", scene.target.name, curve.label());
                assert_ne!(order.agrees(), Some(false), "{what}");
            }
        }
    }
    let confirmations = study.confirmations();
    for kind in integrator::REGISTRY {
        let own = |label: &str| label.split(' ').next() == Some(kind.schema.name);
        let own: Vec<_> = confirmations.iter().filter(|each| own(&each.label)).collect();
        assert!(!own.is_empty(), "{}", kind.schema.name);
        for each in own {
            assert!(each.confirmed.len() >= 2, "{each:?}");
        }
    }
    assert_eq!(study.unconfirmed(), []);
}

#[test]
fn a_ladder_without_slopes_confirms_nothing() {
    let study = study(&["oscillator"], AccuracyConfig { rungs: 4, ..ONCE });
    assert_eq!(study.unconfirmed().len(), study.confirmations().len());
    let agreement = study.agreement();
    // Some errors are exact at any step.
    assert_eq!((agreement.agree, agreement.differ), (0, 0), "{agreement:?}");
    assert!(agreement.unknown > 3 * integrator::REGISTRY.len(), "{agreement:?}");
}

#[test]
fn exact_motions_neither_confirm_an_order_nor_differ() {
    let study = study(&["free-fall"], ONCE);
    let confirmations = study.confirmations();
    let fourth = confirmations.iter().find(|each| each.label == "runge-kutta-4").unwrap();
    assert_eq!((fourth.confirmed.len(), fourth.agreement.exact), (0, 3), "{fourth:?}");
    assert_eq!(fourth.agreement.judged(), 3);
    // They stop where shorter steps only show rounding.
    let curves = &study.scenes[0].curves;
    let fourth = curves.iter().find(|curve| curve.label() == "runge-kutta-4").unwrap();
    assert_eq!(fourth.points.len(), order::FEWEST);
}

#[test]
fn closed_forms_agree_with_the_adaptive_solution() {
    let mut count = 0;
    for problem in PROBLEMS.iter().filter(|problem| problem.closed.is_some()) {
        let scene = problem.scene();
        let exact = Reference::new(&scene, closed(problem).as_ref()).unwrap();
        let adaptive = Reference::new(&scene, None).unwrap();
        assert_eq!((exact.source, adaptive.source), (Source::Closed, Source::Adaptive));
        let difference = exact.difference(&adaptive).unwrap();
        for quantity in Quantity::ALL {
            let of = |errors: Errors| errors.of(quantity);
            let bar = of(exact.floor) + of(adaptive.floor);
            let name = problem.name;
            assert!(of(difference) <= bar, "{name}, {quantity:?}: {difference:?} beyond {bar:e}");
            // Uselessly large error bars would pass too.
            assert!(bar < 1e-6 * of(exact.scale), "{name}, {quantity:?}: {bar:e}");
        }
        count += 1;
    }
    assert!(count >= 10, "{count}");
}

/// `K(sin²(φ/2))`, by the arithmetic-geometric mean.
fn quarter_period(amplitude: f64) -> f64 {
    let (mut a, mut b) = (1.0_f64, (0.5 * amplitude).cos());
    for _ in 0..8 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    std::f64::consts::FRAC_PI_2 / a
}

#[test]
fn the_pendulums_period_tends_to_the_elliptic_integral_as_its_spring_stiffens() {
    // Released at a right angle, it is below its anchor after a quarter period.
    let quarter = quarter_period(std::f64::consts::FRAC_PI_2) * (1.0_f64 / 9.81).sqrt();
    let miss = |stiffness: f64| {
        let mut scene = problem("pendulum").scene();
        scene.forces[0].parameters[0] = stiffness;
        scene.duration = quarter;
        scene.time_step = quarter / 4.0;
        Reference::new(&scene, None).unwrap().end().0[2]
    };
    let (soft, stiff) = (miss(4e3), miss(4e4));
    // Gravity stretches the spring, so the length and the delay are off in proportion to 1/stiffness.
    assert!(soft.abs() > 1e-4, "{soft:e}");
    assert!((soft / stiff / 10.0 - 1.0).abs() < 0.1, "{soft:e}, {stiff:e}");
}

#[test]
fn each_problem_has_a_scene_starting_at_its_closed_form() {
    for problem in PROBLEMS {
        let scene = problem.scene();
        assert!((16..=256).contains(&scene.n_steps()), "{}: {}", problem.name, scene.n_steps());
        assert!(problem.xml.starts_with("<!-- "), "{} does not say what it is", problem.name);
        let same = PROBLEMS.iter().filter(|other| other.name == problem.name).count();
        assert_eq!(same, 1, "{}", problem.name);
    }
    assert!(PROBLEMS.iter().filter(|problem| problem.closed.is_none()).count() >= 3);
}
