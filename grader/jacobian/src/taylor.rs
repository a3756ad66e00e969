//! Taylor's test: the order of the remainder of a linearization as the step shrinks.
//!
//! ```text
//! R(t) = |F(z + t e) − F(z) − t J e|          t = 2⁰, 2⁻¹, 2⁻², … times a first step
//! ```
//!
//! If `J` is right, `R = O(t²)` down to rounding; if it is wrong by `ε`, `R` approaches `ε t`. The slope of `log R`
//! against `log t` distinguishes the two if it is fitted where truncation dominates. The window of the fit starts at
//! the smallest `t` whose remainder is eight times above rounding, and grows while the slope between neighbours stays
//! constant. If the remainder is at rounding level throughout, the function is linear along `e`, and `J` is right.
//! Cost: up to 44 evaluations for each coordinate.

use crate::ridders::{Function, Sides};

/// Number of steps.
const STEPS: usize = 44;

/// Minimum ratio of a remainder to its rounding bound.
const CLEAR: f64 = 8.0;

/// Maximum change of the slope between neighbours while the window grows.
const STEADY: f64 = 0.12;

/// Minimum number of remainders in a window.
const FEWEST: usize = 4;

/// The range of steps in which the slope was fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// The slope.
    pub slope: f64,
    /// The smallest and the largest step in it.
    pub steps: (f64, f64),
    /// Number of steps in it.
    pub count: usize,
}

/// The result of the test for one entry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Taylor {
    /// The remainders fall as `t²` or faster.
    Consistent(Window),
    /// The remainders are rounding errors: the function is linear along the step.
    Linear,
    /// The remainders fall as `t`.
    Wrong(Window),
    /// No window was found.
    Undecided,
}

impl Taylor {
    /// The window, if there is one.
    pub fn window(&self) -> Option<Window> {
        match self {
            Self::Consistent(window) | Self::Wrong(window) => Some(*window),
            Self::Linear | Self::Undecided => None,
        }
    }
}

/// A remainder with its rounding bound.
#[derive(Debug, Clone, Copy, Default)]
pub struct Remainder {
    /// The step `t`.
    pub step: f64,
    /// The remainder.
    pub size: f64,
    /// Bound of its rounding error.
    pub floor: f64,
}

/// Changes of a function along a sequence of steps. They yield the remainders for any Jacobian.
pub struct Steps {
    steps: Vec<f64>,
    /// `F(z + t e) − F(z)`, `size` numbers for each step.
    changes: Vec<f64>,
    size: usize,
}

impl Steps {
    /// Takes the steps along coordinate `column` of `x`, from `first` downwards. Steps that `sides` refuses or that lead to a
    /// point where the function is undefined are left out.
    pub fn take(
        function: Function<'_>,
        x: &[f64],
        column: usize,
        (first, sides): (f64, Sides),
        size: usize,
    ) -> Self {
        let mut taken = Self {
            steps: Vec::with_capacity(STEPS),
            changes: Vec::with_capacity(STEPS * size),
            size,
        };
        let (mut here, mut there) = (vec![0.0; size], vec![0.0; size]);
        if !function(x, &mut here) {
            return taken;
        }
        let mut moved = x.to_vec();
        let mut step = first;
        for _ in 0..STEPS {
            if let Some((up, _)) = sides(x[column], step).filter(|(up, _)| *up != x[column]) {
                moved[column] = up;
                if function(&moved, &mut there) {
                    taken.steps.push(up - x[column]);
                    taken.changes.extend(there.iter().zip(&here).map(|(a, b)| a - b));
                }
            }
            step *= 0.5;
        }
        taken
    }

    /// Tests the entry `jacobian` against the remainders of component `row`. `noise` bounds the rounding error of the
    /// component, `entry_noise` that of the entry.
    pub fn judge(&self, row: usize, jacobian: f64, noise: f64, entry_noise: f64) -> Taylor {
        let mut remainders = [Remainder::default(); STEPS];
        let changes = self.changes.chunks_exact(self.size);
        for ((remainder, &step), change) in remainders.iter_mut().zip(&self.steps).zip(changes) {
            *remainder = Remainder {
                step,
                size: (change[row] - step * jacobian).abs(),
                floor: 2.0 * noise + step * entry_noise,
            };
        }
        judge(&remainders[..self.steps.len()])
    }
}

/// Judges remainders of falling steps.
pub fn judge(remainders: &[Remainder]) -> Taylor {
    if remainders.len() < FEWEST || remainders.iter().any(|r| !r.size.is_finite()) {
        return Taylor::Undecided;
    }
    let Some(smallest) = remainders.iter().rposition(|r| r.size > CLEAR * r.floor) else {
        return Taylor::Linear;
    };
    let slope = |at: usize| (remainders[at].size / remainders[at + 1].size).log2();
    let mut largest = smallest;
    while largest > 0 && remainders[largest - 1].size > CLEAR * remainders[largest - 1].floor {
        let next = slope(largest - 1);
        // At the start the slope is unknown, and rounding is at its largest.
        let steady = smallest - largest < 2 || (next - slope(largest)).abs() < STEADY;
        if !steady {
            break;
        }
        largest -= 1;
    }
    let count = smallest - largest + 1;
    if count < FEWEST {
        return Taylor::Undecided;
    }
    let window = Window {
        slope: fit(&remainders[largest..=smallest]),
        steps: (remainders[smallest].step, remainders[largest].step),
        count,
    };
    match window.slope {
        slope if slope > 1.7 => Taylor::Consistent(window),
        slope if (0.7..1.3).contains(&slope) => Taylor::Wrong(window),
        _ => Taylor::Undecided,
    }
}

/// Slope of the least-squares line through `log₂ R` against `log₂ t`.
fn fit(remainders: &[Remainder]) -> f64 {
    let n = remainders.len() as f64;
    let mut points = [(0.0, 0.0); STEPS];
    let points = &mut points[..remainders.len()];
    let (mut x, mut y) = (0.0, 0.0);
    for (point, remainder) in points.iter_mut().zip(remainders) {
        *point = (remainder.step.log2(), remainder.size.log2());
        (x, y) = (x + point.0 / n, y + point.1 / n);
    }
    let (above, below) = points
        .iter()
        .fold((0.0, 0.0), |(a, b), (px, py)| (a + (px - x) * (py - y), b + (px - x) * (px - x)));
    above / below
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ridders::exact_steps;

    /// The test of `jacobian` as the derivative of `function` at 1.25.
    fn taylor(function: impl Fn(f64) -> f64, jacobian: f64) -> Taylor {
        let x = [1.25];
        let evaluate = |x: &[f64], values: &mut [f64]| {
            values[0] = function(x[0]);
            true
        };
        let noise = 2.0 * f64::EPSILON * function(x[0]).abs();
        Steps::take(&mut { evaluate }, &x, 0, (0.25, exact_steps), 1).judge(
            0,
            jacobian,
            noise,
            f64::EPSILON * jacobian,
        )
    }

    #[test]
    fn the_slope_is_two_where_the_derivative_is_right() {
        for (function, jacobian) in
            [(f64::sin as fn(f64) -> f64, 1.25_f64.cos()), (|x| 1.0 / x, -1.0 / 1.5625)]
        {
            let Taylor::Consistent(window) = taylor(function, jacobian) else { panic!() };
            assert!((window.slope - 2.0).abs() < 0.1 && window.count >= 8, "{window:?}");
            assert!(window.steps.0 < 1e-5 && window.steps.1 > 1e-3, "{window:?}");
        }
    }

    #[test]
    fn the_slope_is_one_where_it_is_wrong() {
        for relative in [1.0, 1e-2, 1e-4, 1e-5, -1e-5, 1e-6] {
            let result = taylor(f64::sin, 1.25_f64.cos() * (1.0 + relative));
            let Taylor::Wrong(window) = result else { panic!("{relative:e}: {result:?}") };
            assert!((window.slope - 1.0).abs() < 0.2, "{relative:e}: {window:?}");
        }
    }

    #[test]
    fn a_linear_function_leaves_rounding() {
        assert_eq!(taylor(|x| 3.0 * x, 3.0), Taylor::Linear);
        assert!(matches!(taylor(|x| 3.0 * x, 3.000003), Taylor::Wrong(_)));
        assert_eq!(taylor(|_| 3.0, f64::NAN), Taylor::Undecided);
    }

    #[test]
    fn a_function_without_curvature_falls_faster() {
        // At an inflection the remainder is of third order.
        let at_inflection = |x: f64| (x - 1.25).powi(3) + x;
        let Taylor::Consistent(window) = taylor(at_inflection, 1.0) else { panic!() };
        assert!((window.slope - 3.0).abs() < 0.2, "{window:?}");
    }
}
