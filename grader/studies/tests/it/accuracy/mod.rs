//! Accuracy study: orders, planted mistakes, energies, momenta and references. No test depends on measured times.

mod behaviour;
mod planted;
use simulator::integrator;
use simulator::scene::schema::Order;
use studies::accuracy::order::Fit;
use studies::accuracy::problem::{PROBLEMS, Problem};
use studies::accuracy::reference::{Reference, Source};
use studies::accuracy::{self, AccuracyConfig, Closed, Errors, Quantity, Target};

/// Few time steps, each run once.
const ONCE: AccuracyConfig =
    AccuracyConfig { rungs: 8, repeats: 1, budget: 0.0, max_steps: 1 << 14 };

fn problem(name: &str) -> &'static Problem {
    PROBLEMS.iter().find(|problem| problem.name == name).expect("a registered problem")
}

fn closed(problem: &Problem) -> Option<Closed> {
    problem.closed.map(|closed| closed(&problem.scene()))
}

fn is_high(order: &Order) -> bool {
    order.without_velocity > 2
}

#[test]
fn every_integrator_has_the_order_of_theory_on_smooth_scenes() {
    let names = ["free-fall", "wind", "damped-oscillator", "ellipse", "kepler-orbit", "combined"];
    let targets = names.map(|name| Target::of_problem(problem(name))).into();
    let study = accuracy::study(targets, None, ONCE, None, &mut |_, _, _| {}).unwrap();
    let mut seen = Vec::new();
    for scene in &study.scenes {
        for curve in &scene.curves {
            for order in scene.orders(curve) {
                let what = format!("{}, {}: {order:?}", scene.target.name, curve.label());
                if order.expected.is_some() {
                    // An error of high order passes from too coarse to rounding in a few halvings of the step: on some
                    // scenes none are left for a slope.
                    let is_open =
                        order.agrees().is_none() && is_high(&curve.method.integrator.order);
                    assert!(is_open || order.agrees() == Some(true), "{what}");
                    if let (Quantity::Position, Fit::Slope { .. }) = (order.quantity, order.fit) {
                        seen.push(curve.method.integrator.name);
                    }
                }
            }
        }
    }
    for kind in integrator::REGISTRY {
        let name = kind.schema.name;
        // At order 5 no scene leaves five errors above rounding; simulator/tests/it/physics.rs measures that order.
        let least = match kind.schema.order.without_velocity {
            ..=2 => 3,
            3 | 4 => 1,
            _ => 0,
        };
        assert!(seen.iter().filter(|seen| **seen == name).count() >= least, "{name}: {seen:?}");
    }
}

#[test]
fn closed_forms_are_the_adaptive_solution_within_both_error_bars() {
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
fn every_problem_has_a_scene_of_its_own_that_starts_where_its_closed_form_does() {
    for problem in PROBLEMS {
        let scene = problem.scene();
        assert!((16..=256).contains(&scene.n_steps()), "{}: {}", problem.name, scene.n_steps());
        assert!(problem.xml.starts_with("<!-- "), "{} does not say what it is", problem.name);
        let same = PROBLEMS.iter().filter(|other| other.name == problem.name).count();
        assert_eq!(same, 1, "{}", problem.name);
    }
    assert!(PROBLEMS.iter().filter(|problem| problem.closed.is_none()).count() >= 3);
}
