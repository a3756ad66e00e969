//! Search of states on branches that no segment meets: far more points are drawn than can be checked, and each is probed.
//!
//! A branch may be narrow, and not show outside of it. With one random short line `d` through a point,
//!
//! ```text
//! defect     |f(x + d) − f(x − d) − 2 J(x) d|       large if J is wrong in more than a few entries
//! pattern    which entries of J(x) are zero          another one on many a branch
//! ```
//!
//! Points with the largest defects, and with the rarest patterns, join the check. A defect counts if shorter lines show the same
//! slope: noise, kinks and chaos show another one.
//! Cost: two evaluations of the function and one of the Jacobian for a probe; as many probes as a number of entries allows.

use std::collections::BTreeMap;

use fastrand::Rng;

use crate::branches::Domain;
use crate::function::Function;
use crate::state::State;

/// Most probes: one of them meets a branch of a two-thousandth of the box in 98 of 100 boxes.
const PROBES: usize = 8_000;

/// Most entries of Jacobians that are evaluated by probes: of 12 × 12, all probes; of 300 × 300, a dozen.
const PROBED: usize = 1_200_000;

/// Half the length of a probe's line, in widths of the box.
const SHORT: f64 = 1.0 / 65536.0;

/// Change of a probe's slope over a shorter line, relative to the slope and to the defect, up to which the defect is no noise.
const RESOLVED: f64 = 0.05;

/// A pattern of zeros that one in so many probes has is rare.
const RARE: usize = 16;

/// Defect, relative to the sizes of its terms, from which on a point deserves a check.
const DEFECT: f64 = 1e-3;

/// Change of a value, relative to the largest value, that may be rounding.
const NEGLIGIBLE: f64 = 1e-11;

/// Points of which shorter lines are tried, for each that is kept.
const TRIED: usize = 4;

/// A drawn point with the line along which the values disagree with the Jacobian most in one row.
struct Probe {
    x: Vec<f64>,
    line: Vec<f64>,
    row: usize,
    /// Of the value, from one end of the line to the other.
    change: f64,
    /// The same by the Jacobian.
    stated: f64,
    /// Their difference relative to the sizes of the terms.
    defect: f64,
}

/// States that stand out among many drawn points: at most `most` by the defect, and as many by the pattern of zeros.
pub fn search(
    function: &mut Function<'_>,
    domain: &Domain,
    most: usize,
    rng: &mut Rng,
) -> Vec<State> {
    let (rows, columns) = (function.rows, function.columns);
    let entries = rows * columns * function.calls_of_jacobian();
    let number = (PROBED / entries.max(1)).min(PROBES);
    let width = domain.width();
    let mut probes: Vec<Probe> = Vec::new();
    let mut patterns: BTreeMap<Vec<bool>, (usize, Vec<f64>)> = BTreeMap::new();
    for _ in 0..number {
        let x = domain.draw(rng);
        let step = |width: &f64| if rng.bool() { SHORT * width } else { -SHORT * width };
        let line: Vec<f64> = width.iter().map(step).collect();
        let Some([above, below]) = ends(function, &x, &line, 1.0) else { continue };
        let matrix = function.jacobian(&x);
        let [mut slopes, mut sizes] = [vec![0.0; rows], vec![0.0; rows]];
        let mut pattern = vec![false; rows * columns];
        for (column, step) in line.iter().enumerate() {
            for (row, value) in matrix.column(column).filter(|(_, value)| *value != 0.0) {
                slopes[row] += value * step;
                sizes[row] += (value * step).abs();
                pattern[column * rows + row] = true;
            }
        }
        patterns.entry(pattern).or_insert_with(|| (0, x.clone())).0 += 1;
        let largest = above.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        let of_row = |row: usize| {
            let (change, stated) = (above[row] - below[row], 2.0 * slopes[row]);
            let size = change.abs() + 2.0 * sizes[row] + NEGLIGIBLE * largest;
            let defect = (change - stated).abs() / size;
            (row, change, stated, if stated.is_nan() { 1.0 } else { defect })
        };
        let worst = (0..rows).map(of_row).max_by(|a, b| a.3.total_cmp(&b.3));
        if let Some((row, change, stated, defect)) = worst.filter(|worst| worst.3 > DEFECT) {
            probes.push(Probe { x, line, row, change, stated, defect });
        }
    }
    probes.sort_by(|a, b| b.defect.total_cmp(&a.defect));
    probes.truncate(TRIED * most);
    probes.retain(|probe| is_resolved(function, probe));
    let mut rare: Vec<(usize, Vec<f64>)> = patterns.into_values().collect();
    rare.retain(|(count, _)| RARE * count <= number);
    rare.sort_by_key(|(count, _)| *count);
    let state = |name: &str, x| State::new(format!("drawn where {name}"), x, Some(&width));
    let disagree = probes.into_iter().take(most).map(|probe| probe.x);
    let disagree = disagree.map(|x| state("values and Jacobian disagree", x));
    let rare = rare.into_iter().take(most).map(|(_, x)| state("few have the same zeros", x));
    disagree.chain(rare).collect()
}

/// The values at both ends of a part of a line about `x`.
fn ends(function: &mut Function<'_>, x: &[f64], line: &[f64], part: f64) -> Option<[Vec<f64>; 2]> {
    let mut values = [part, -part].map(|part| (part, vec![0.0; function.rows]));
    let defined = values.iter_mut().all(|(part, values)| {
        let moved: Vec<f64> = x.iter().zip(line).map(|(x, step)| x + *part * step).collect();
        function.evaluate(&moved, values)
    });
    defined.then(|| values.map(|(_, values)| values))
}

/// Whether shorter lines show the same slope: not so in noise, at a kink, or where the function varies within the line.
fn is_resolved(function: &mut Function<'_>, probe: &Probe) -> bool {
    let Probe { x, line, row, change, stated, .. } = probe;
    let allowed = RESOLVED * change.abs().min((change - stated).abs());
    [0.5, 0.25].into_iter().all(|part| {
        let Some([above, below]) = ends(function, x, line, part) else { return false };
        let (above, below) = (above[*row], below[*row]);
        let rounding = NEGLIGIBLE * above.abs().max(below.abs());
        ((above - below) / part - change).abs() <= allowed + rounding
    })
}
