//! Order conditions and longest stable steps of the described methods, against the literature.

use reference::method::{DORMAND_PRINCE, Pair, RUNGE_KUTTA_4, Tableau, stable_steps};
use scene::schema::StepEquation;

/// `Σ weights · values`, over the stages.
fn sum(weights: &[f64], value: impl Fn(usize) -> f64) -> f64 {
    weights.iter().enumerate().map(|(number, weight)| weight * value(number)).sum()
}

/// Conditions of order up to 5 of a method with the same coefficients for positions and velocities: for each rooted
/// tree, a sum over the stages and its value. Hairer, Nørsett and Wanner, table II.2.1.
fn conditions(tableau: &Tableau) -> Vec<(u32, f64, f64)> {
    let b = tableau.end.velocity;
    let stages = tableau.stages;
    let c = |i: usize| stages[i].time();
    let a = |i: usize, value: &dyn Fn(usize) -> f64| sum(stages[i].velocity, value);
    let ac = |i: usize| a(i, &c);
    let acc = |i: usize| a(i, &|j| c(j) * c(j));
    vec![
        (1, sum(b, |_| 1.0), 1.0),
        (2, sum(b, c), 1.0 / 2.0),
        (3, sum(b, |i| c(i) * c(i)), 1.0 / 3.0),
        (3, sum(b, ac), 1.0 / 6.0),
        (4, sum(b, |i| c(i).powi(3)), 1.0 / 4.0),
        (4, sum(b, |i| c(i) * ac(i)), 1.0 / 8.0),
        (4, sum(b, acc), 1.0 / 12.0),
        (4, sum(b, |i| a(i, &ac)), 1.0 / 24.0),
        (5, sum(b, |i| c(i).powi(4)), 1.0 / 5.0),
        (5, sum(b, |i| c(i) * c(i) * ac(i)), 1.0 / 10.0),
        (5, sum(b, |i| ac(i) * ac(i)), 1.0 / 20.0),
        (5, sum(b, |i| c(i) * acc(i)), 1.0 / 15.0),
        (5, sum(b, |i| c(i) * a(i, &ac)), 1.0 / 30.0),
        (5, sum(b, |i| a(i, &|j| c(j).powi(3))), 1.0 / 20.0),
        (5, sum(b, |i| a(i, &|j| c(j) * ac(j))), 1.0 / 40.0),
        (5, sum(b, |i| a(i, &acc)), 1.0 / 60.0),
        (5, sum(b, |i| a(i, &|j| a(j, &ac))), 1.0 / 120.0),
    ]
}

#[test]
fn methods_satisfy_exactly_their_order_conditions() {
    let order_of = |tableau: &Tableau| {
        let failed = conditions(tableau).into_iter().find(|(_, found, value)| {
            let is_met = (found - value).abs() < 1e-14;
            !is_met
        });
        failed.map(|(order, ..)| order - 1)
    };
    assert_eq!(order_of(&RUNGE_KUTTA_4), Some(4));
    let Pair { tableau, error, .. } = &DORMAND_PRINCE;
    assert_eq!(order_of(tableau), None);
    // The estimate is that of a method of order 4: it vanishes up to there.
    let time = |i: usize| tableau.stages[i].time();
    for power in 0..4 {
        let of_error = sum(error, |i| time(i).powi(power));
        assert!(of_error.abs() < 1e-14, "{power}: {of_error:e}");
    }
    assert!(sum(error, |i| time(i).powi(4)).abs() > 1e-4);
}

#[test]
fn limits_of_undamped_and_overdamped_steps_are_known() {
    let limit = |equation, zeta| stable_steps(equation, zeta)[0];
    assert_eq!(limit(StepEquation::VelocityVerlet, 0.0), 2.0);
    let found = limit(StepEquation::RungeKutta4, 0.0);
    assert!((found - 8.0_f64.sqrt()).abs() < 1e-14, "{found}");
    // The real root of 24 + 12 z + 4 z² + z³, from Hairer and Wanner, section IV.2.
    let found = limit(StepEquation::RungeKutta4, 1.0);
    assert!((found - 2.785_293_563_405_28).abs() < 1e-12, "{found}");
    let found = limit(StepEquation::DormandPrince, 1.0);
    assert!((found - 3.306_567_892_634_7).abs() < 1e-9, "{found}");
}
