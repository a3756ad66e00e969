//! The noise of a function: how far its values are from those of a nearby smooth function.
//!
//! Along a line, `9` values at equal distances `h` make a table of differences. The smooth part of the values vanishes from
//! the differences of sixth order as `h⁶`; noise `σ` of independent values remains, as `σ √924`:
//!
//! ```text
//! Δᵏfᵢ = Δᵏ⁻¹fᵢ₊₁ − Δᵏ⁻¹fᵢ        σₖ² = (k!)² / (2k)! · mean (Δᵏf)²
//! ```
//!
//! A function that rounds its arguments, such as one in single precision, is constant at the shortest `h`; one with short
//! waves is not smooth at the longest. So four distances are tried. A function that rounds its arguments rounds each to
//! another distance, which is measured along each coordinate. Cost: 36 evaluations; of such a function, 5 to 40 more for each
//! coordinate.
//! Source: Moré and Wild, *Estimating computational noise*, SIAM Journal on Scientific Computing 33 (2011).

use crate::ridders::Function;

/// Values on a line, on both sides of the point.
const SIDE: i32 = 4;
const VALUES: usize = 2 * SIDE as usize + 1;

/// Highest order of differences; it and the one before measure the noise.
const HIGHEST: usize = 6;

/// Exponents of the distances between them, relative to the direction.
const DISTANCES: [i32; 4] = [-44, -36, -28, -20];

/// Growth of `σ` from one distance to the next beyond which it is the smooth part that grows.
const SMOOTH: f64 = 1e2;

/// Ratio of a jump between two values to all other changes.
const JUMP: f64 = 1e3;

/// A bound is this many times the measured `σ`.
const SAFETY: f64 = 16.0;

/// Different values of the nine from which on the longest distance resolves a function.
const RESOLVED: usize = 6;

/// Ratio of the shortest step of a function that rounds its arguments to the shortest distance at which it varies.
const COARSER: f64 = 256.0;

/// Ratio of the shortest step along a coordinate to a step over which each value differs from the one before.
const OWN: f64 = 16.0;

/// Step, relative to the size of a coordinate, beyond which no rounding of arguments is looked for.
const LONGEST: f64 = 1.0 / 256.0;

/// The noise of a function at a point.
#[derive(Debug, Clone, PartialEq)]
pub struct Noise {
    /// Bound for each component.
    pub bounds: Vec<f64>,
    /// For each coordinate, step relative to its size below which a function that rounds its arguments is constant; 0 of others.
    pub shortest: Vec<f64>,
}

/// The noise of `function` at `x`, where it is `here`. `scale` has the typical size of each coordinate.
pub fn measure(function: Function<'_>, x: &[f64], scale: &[f64], here: &[f64]) -> Noise {
    let (mut shortest, mut was_constant) = (None, false);
    // No two coordinates move alike: many functions do not change if all do.
    let direction: Vec<f64> =
        scale.iter().enumerate().map(|(column, scale)| scale * weight(column)).collect();
    let mut levels = vec![[None; DISTANCES.len()]; here.len()];
    let mut moved = x.to_vec();
    let mut table = vec![[0.0; VALUES]; here.len()];
    let mut values = here.to_vec();
    for (number, exponent) in DISTANCES.into_iter().enumerate() {
        let distance = 2.0_f64.powi(exponent);
        // The step as it is after rounding, so that no rounding of the arguments is measured.
        let exact = |(x, direction): (&f64, &f64)| (x + distance * direction) - x;
        let steps: Vec<f64> = x.iter().zip(&direction).map(exact).collect();
        let mut defined = true;
        for place in -SIDE..=SIDE {
            for ((moved, x), step) in moved.iter_mut().zip(x).zip(&steps) {
                *moved = x + f64::from(place) * step;
            }
            defined &= function(&moved, &mut values);
            for (row, value) in table.iter_mut().zip(&values) {
                row[(place + SIDE) as usize] = *value;
            }
        }
        if defined {
            for (levels, row) in levels.iter_mut().zip(&table) {
                levels[number] = level(*row);
            }
            let most = table.iter().map(|row| distinct(*row)).max().unwrap_or(1);
            let is_last = number + 1 == DISTANCES.len();
            match shortest {
                None if most > 1 && !was_constant => shortest = Some(0.0),
                // Some arguments cross to the next value at once; all do only over longer steps.
                None if most > 1 && is_last && most >= RESOLVED => shortest = Some(distance),
                None if most > 1 => shortest = Some(COARSER * distance),
                _ => was_constant |= steps.iter().any(|step| *step != 0.0),
            }
        }
    }
    let bound = |(levels, value): (&[Option<f64>; DISTANCES.len()], &f64)| {
        let floor = 2.0 * f64::EPSILON * value.abs();
        (SAFETY * plateau(levels)).max(floor)
    };
    let bounds = levels.iter().zip(here).map(bound).collect();
    let least = shortest.unwrap_or(0.0);
    let own = |column: usize| {
        if least > 0.0 {
            resolved(function, x, (column, scale[column]), least, here.len())
        } else {
            0.0
        }
    };
    Noise { bounds, shortest: (0..x.len()).map(own).collect() }
}

/// The shortest step along a coordinate, relative to its size: where the values at five equal distances all differ in some
/// component, and at least `least`.
fn resolved(
    function: Function<'_>,
    x: &[f64],
    (column, size): (usize, f64),
    least: f64,
    rows: usize,
) -> f64 {
    const PLACES: [f64; 5] = [-2.0, -1.0, 0.0, 1.0, 2.0];
    let mut moved = x.to_vec();
    let mut table = PLACES.map(|_| vec![0.0; rows]);
    let mut step = least / OWN;
    while step < LONGEST {
        let defined = table.iter_mut().zip(PLACES).all(|(values, place)| {
            moved[column] = x[column] + place * step * size;
            function(&moved, values)
        });
        let differ = |row: usize| table.windows(2).all(|pair| pair[0][row] != pair[1][row]);
        if defined && (0..rows).any(differ) {
            return least.max(OWN * step);
        }
        step *= 4.0;
    }
    least
}

/// Between 0.3 and 1 in size, of either sign.
fn weight(column: usize) -> f64 {
    let fraction = ((column + 1) as f64 * 0.618_033_988_7).fract();
    if fraction < 0.5 { -0.3 - fraction } else { fraction }
}

/// Number of different values.
fn distinct(mut values: [f64; VALUES]) -> usize {
    values.sort_by(f64::total_cmp);
    1 + values.windows(2).filter(|pair| pair[0] != pair[1]).count()
}

/// `σ` of values at equal distances; `None` if they are all the same, or all but for one jump.
fn level(mut values: [f64; VALUES]) -> Option<f64> {
    let mut changes: Vec<f64> = values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    changes.sort_by(f64::total_cmp);
    // One change among nothing is a jump of the function, or one of the values to which it rounds.
    if changes[VALUES - 2] >= JUMP * changes[VALUES - 3] {
        return None;
    }
    let (mut factor, mut largest) = (1.0, 0.0_f64);
    for order in 1..=HIGHEST {
        let count = VALUES - order;
        for place in 0..count {
            values[place] = values[place + 1] - values[place];
        }
        // (k!)² / (2k)! from that of k − 1.
        factor *= order as f64 / (2.0 * (2.0 * order as f64 - 1.0));
        let square: f64 = values[..count].iter().map(|value| value * value).sum();
        if order + 1 >= HIGHEST {
            largest = largest.max((factor * square / count as f64).sqrt());
        }
    }
    Some(largest)
}

/// The largest `σ` before the smooth part takes over.
fn plateau(levels: &[Option<f64>]) -> f64 {
    let mut largest = 0.0_f64;
    for level in levels.iter().flatten() {
        if largest > 0.0 && *level > SMOOTH * largest {
            break;
        }
        largest = largest.max(*level);
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bound(function: impl Fn(f64) -> f64, x: f64) -> f64 {
        let mut evaluate = |x: &[f64], values: &mut [f64]| {
            values[0] = function(x[0]);
            true
        };
        measure(&mut evaluate, &[x], &[x.abs()], &[function(x)]).bounds[0]
    }

    #[test]
    fn noise_of_each_kind_is_bounded_and_not_by_much() {
        let single = |x: f64| f64::from((x as f32).sin());
        let cancelled = |x: f64| (x + 1e8) - 1e8;
        let iterated = |x: f64| x.sin() + 1e-9 * (1e15 * x).sin();
        let waves = |x: f64| (1e5 * x).sin();
        type Case<'a> = (&'a str, &'a dyn Fn(f64) -> f64, f64);
        let cases: [Case<'_>; 6] = [
            ("sine", &f64::sin, 1e-16),
            ("line", &|x| 3.0 * x, 1e-16),
            ("single precision", &single, 3e-8),
            ("cancellation", &cancelled, 7e-9),
            ("an iteration", &iterated, 1e-10),
            ("short waves", &waves, 1e-12),
        ];
        for (name, function, size) in cases {
            for x in [0.3, 0.7, 1.3] {
                let bound = bound(function, x);
                assert!(bound > size && bound < 300.0 * size, "{name} at {x}: {bound:e}");
            }
        }
        assert_eq!(bound(|_| 7.0, 1.0), 2.0 * f64::EPSILON * 7.0);
    }
}
