//! Errors of differences and of Taylor's test as functions of the step, for a plot.
//!
//! Along one direction `p` in positions and velocities, with `J p = ∂F/∂x p_x + ∂F/∂v p_v`,
//!
//! ```text
//! central difference   |(F(z+tp) − F(z−tp))/2t − J p|        falls as t², then rounding grows as 1/t
//! with J               |F(z+tp) − F(z) − t J p|              falls as t²
//! without J            |F(z+tp) − F(z)|                      falls as t
//! ```
//!
//! all divided by `|J p|` in the l2 norm. `p` has components of ±1 in the scene's units;
//! `t` has no unit. Cost: 90 evaluations of the force.

use nalgebra::DVector;

use super::states::{CheckState, states};
use super::subject::{Subject, simulated};
use super::{Config, JacobianCheck, Verdict};
use jacobian::taylor::{Remainder, Taylor, Window, judge};
use jacobian::verdict::ROUNDING;
use reference::law::{self, Expectation};
use simulator::force;

/// Steps of a curve.
const STEPS: i32 = 46;

/// Signs of the direction's components, positions first. The two particles must not move alike.
const SIGNS: [f64; 12] = [1.0, -1.0, -1.0, 1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0, -1.0];

/// Errors by step, for one force at one state.
#[derive(Debug, Clone, PartialEq)]
pub struct Curves {
    /// The plot's title.
    pub title: String,
    /// The steps `t`, in falling order.
    pub steps: Vec<f64>,
    /// Error of the central difference.
    pub central: Vec<f64>,
    /// Remainder of Taylor's test.
    pub with_jacobian: Vec<f64>,
    /// The same with `J p` left out.
    pub without_jacobian: Vec<f64>,
    /// The windows of the slopes fitted to the last two.
    pub windows: [Option<Window>; 2],
}

/// The curves of a check: at the state of a wrong finding if there is one, else at a random state. `None` for a force
/// with zero Jacobians.
pub fn curves(check: &JacobianCheck) -> Option<Curves> {
    let wrong = check.blocks.iter().find(|finding| finding.verdict == Verdict::Wrong);
    let state = match wrong.and_then(|finding| finding.exhibit.as_ref()) {
        Some(exhibit) => exhibit.state.clone(),
        None => {
            let kind = force::REGISTRY.iter().find(|kind| kind.schema.tag == check.tag)?;
            let config = Config::default();
            states(kind, check.dimension, config.states, config.seed).into_iter().next()?
        }
    };
    let subject = simulated(&state.scene);
    let title = format!("{} {}D, state \"{}\"", check.tag, check.dimension.count(), state.name);
    curves_of(subject.as_ref(), check.tag, &state, title)
}

fn curves_of(
    subject: &dyn Subject,
    tag: &str,
    state: &CheckState,
    title: String,
) -> Option<Curves> {
    let (x, v, time) = (state.positions(), state.velocities(), state.time);
    let size = x.len();
    let p = |place: usize| SIGNS[place % SIGNS.len()];
    let along = |t: f64| {
        let moved = |values: &[f64], offset: usize| -> Vec<f64> {
            values.iter().enumerate().map(|(place, z)| z + t * p(place + offset)).collect()
        };
        let mut force = vec![0.0; size];
        let defined = subject.force(&moved(&x, 0), &moved(&v, size), time, &mut force).is_ok();
        defined.then(|| DVector::from_vec(force))
    };
    let jacobians = subject.jacobians(&x, &v, time).ok()?;
    let direction = |offset: usize| DVector::from_fn(size, |place, _| p(place + offset));
    let expected = &jacobians.by_position * direction(0) + &jacobians.by_velocity * direction(size);
    let unit = expected.norm();
    if unit.is_nan() || unit == 0.0 {
        return None;
    }
    let here = along(0.0)?;
    let scales = Expectation::new(law::find(tag)?, &state.scene).scales(&x, &v, time);
    let noise = ROUNDING * scales.iter().map(|scale| scale.force).sum::<f64>() / unit;
    let mut curves = Curves {
        title,
        steps: Vec::new(),
        central: Vec::new(),
        with_jacobian: Vec::new(),
        without_jacobian: Vec::new(),
        windows: [None; 2],
    };
    for exponent in 2..STEPS {
        let t = 2.0_f64.powi(-exponent);
        let (Some(above), Some(below)) = (along(t), along(-t)) else { continue };
        let change = &above - &here;
        curves.steps.push(t);
        curves.central.push(((&above - &below) / (2.0 * t) - &expected).norm() / unit);
        curves.with_jacobian.push((&change - &expected * t).norm() / unit);
        curves.without_jacobian.push(change.norm() / unit);
    }
    let window = |sizes: &[f64]| {
        let remainders: Vec<Remainder> = curves
            .steps
            .iter()
            .zip(sizes)
            .map(|(&step, &size)| Remainder { step, size, floor: noise + step * ROUNDING })
            .collect();
        match judge(&remainders) {
            Taylor::Consistent(window) | Taylor::Wrong(window) => Some(window),
            Taylor::Linear | Taylor::Undecided => None,
        }
    };
    curves.windows = [window(&curves.with_jacobian), window(&curves.without_jacobian)];
    Some(curves)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::white_box::check_forces;

    #[test]
    fn curves_show_both_slopes_and_the_central_difference_minimum() {
        let checks = check_forces(Config { states: 1, seed: 1 }, |_| true);
        let curved: Vec<Curves> = checks.iter().filter_map(curves).collect();
        // Four kinds of springs, gravitation, two kinds of drag, vortex, wind, bending and four of triangles, in two dimensions and three; three
        // of tetrahedra and hinges in three.
        assert_eq!(curved.len(), 32);
        for curves in curved {
            let [with, without] = curves.windows;
            let without = without.unwrap_or_else(|| panic!("{curves:?}"));
            assert!((without.slope - 1.0).abs() < 0.1, "{}: {without:?}", curves.title);
            if ["dragdamping", "massdamping"].iter().any(|tag| curves.title.starts_with(tag)) {
                // The force is linear: the remainder is rounding error.
                assert_eq!(with, None);
                continue;
            }
            let with = with.expect("with J the remainder is of second order");
            assert!((with.slope - 2.0).abs() < 0.1, "{}: {with:?}", curves.title);
            let lowest = curves.central.iter().copied().fold(f64::INFINITY, f64::min);
            let (first, last) = (curves.central[0], curves.central[curves.central.len() - 1]);
            assert!(lowest < 1e-8 && first > 1e4 * lowest && last > 1e2 * lowest, "{curves:?}");
        }
    }
}
