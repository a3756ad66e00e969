//! Search of states on every branch of a function, by steering towards changes of its local behaviour.
//!
//! Segments `x(s) = x₀ + s d` run between drawn points, and from drawn points to degenerate ones, where coordinates or
//! particles coincide, lie on a line or span a parallelogram. With `m` between `a` and `b`, of a length `h`, a cell shows
//!
//! ```text
//! defect      |f(b) − f(a) − h/6 (J(a) + 4 J(m) + J(b)) d|        O(h⁵) if J is right, O(h) if it is wrong in the cell
//! curvature   4 (f(a) − 2 f(m) + f(b)) / h²                       jumps from cell to cell at a switching surface
//! ```
//!
//! Cells that stand out are bisected. A jump of the curvature that is still there marks a switching surface; the jump of a
//! smooth function falls with `h`. States on both sides of it, near and far, join the check.
//! Cost: some 50 evaluations of function and Jacobian for a segment, 24 for a bisection.

use fastrand::Rng;

use crate::function::Function;
use crate::state::State;

/// Cells of a segment.
const CELLS: usize = 24;

/// Halvings of a cell.
const HALVINGS: usize = 8;

/// Cells that are bisected for each switch that is kept.
const TRIED: usize = 4;

/// Change of the curvature that is left after bisection, relative to that before it, from which on it is a jump.
const JUMP: f64 = 0.1;

/// Defect, relative to the change of the function, from which on a cell deserves a check.
const DEFECT: f64 = 1e-3;

/// Change of a value, relative to the largest value, that may be rounding.
const NEGLIGIBLE: f64 = 1e-11;

/// Distances of the states from a switch, in cells.
const BESIDE: [f64; 2] = [0.5, 1e-3];

/// The box of the arguments.
#[derive(Debug, Clone, PartialEq)]
pub struct Domain {
    /// Lower bounds.
    pub lower: Vec<f64>,
    /// Upper bounds.
    pub upper: Vec<f64>,
}

impl Domain {
    /// A point of the box.
    pub fn draw(&self, rng: &mut Rng) -> Vec<f64> {
        self.lower
            .iter()
            .zip(&self.upper)
            .map(|(low, high)| low + (high - low) * rng.f64())
            .collect()
    }

    /// The width of the box.
    pub fn width(&self) -> Vec<f64> {
        self.lower.iter().zip(&self.upper).map(|(low, high)| high - low).collect()
    }

    fn contains(&self, x: &[f64]) -> bool {
        let mut bounds = self.lower.iter().zip(&self.upper).zip(x);
        bounds.all(|((low, high), x)| low <= x && x <= high)
    }
}

/// A line between two points.
struct Segment {
    from: Vec<f64>,
    to: Vec<f64>,
    /// Where it leads.
    name: String,
    /// Whether its cells shrink towards the end.
    shrinking: bool,
}

impl Segment {
    fn at(&self, s: f64) -> Vec<f64> {
        self.from.iter().zip(&self.to).map(|(from, to)| from + s * (to - from)).collect()
    }

    fn nodes(&self) -> Vec<f64> {
        let node = |k: usize| match self.shrinking {
            true => 1.0 - 2.0_f64.powf(-(k as f64) * 0.75),
            false => k as f64 / CELLS as f64,
        };
        (0..=CELLS).map(node).collect()
    }
}

/// A part of a segment that stands out.
struct Cell {
    segment: usize,
    from: f64,
    to: f64,
    score: f64,
}

/// States next to switching surfaces that are found from `starts`, at most three on each side of `most` of them.
pub fn search(
    function: &mut Function<'_>,
    domain: &Domain,
    starts: &[State],
    (block, most): (usize, usize),
    rng: &mut Rng,
) -> Vec<State> {
    let segments = segments(domain, starts, block, 4 * most, rng);
    let (mut defects, mut turns) = (Vec::new(), Vec::new());
    for (number, segment) in segments.iter().enumerate() {
        let nodes = segment.nodes();
        let mut start = sample(function, segment, nodes[0]);
        let mut before: Option<(f64, Vec<f64>)> = None;
        let mut of_segment = Vec::new();
        for ends in nodes.windows(2) {
            let (from, to) = (ends[0], ends[1]);
            let middle = sample(function, segment, 0.5 * (from + to));
            let end = sample(function, segment, to);
            let samples = [start, middle, end.clone()];
            start = end;
            let [Some(a), Some(m), Some(b)] = samples else {
                before = None;
                continue;
            };
            let (curvature, defect) = cell([&a, &m, &b], to - from);
            if defect > DEFECT {
                defects.push(Cell { segment: number, from, to, score: defect });
            }
            if let Some((start, before)) = &before {
                let score = change(before, &curvature);
                of_segment.push(Cell { segment: number, from: *start, to, score });
            }
            before = Some((from, curvature));
        }
        of_segment.sort_by(|a, b| b.score.total_cmp(&a.score));
        of_segment.truncate(3);
        turns.extend(of_segment);
    }
    let by_score = |cells: &mut Vec<Cell>, most: usize| {
        cells.sort_by(|a, b| b.score.total_cmp(&a.score));
        cells.truncate(most);
    };
    by_score(&mut turns, TRIED * most);
    by_score(&mut defects, most);
    let mut switches: Vec<(Cell, f64)> = Vec::new();
    for mut turn in turns {
        let (place, ratio) = bisect(function, &segments[turn.segment], &turn);
        if ratio > JUMP {
            // A change from straight to curved comes first.
            turn.score = turn.score.floor() + ratio.min(1.0);
            switches.push((turn, place));
        }
    }
    switches.sort_by(|a, b| b.0.score.total_cmp(&a.0.score));
    switches.truncate(most);
    let width = domain.width();
    let mut states = Vec::new();
    for (cell, place) in switches {
        let segment = &segments[cell.segment];
        for distance in BESIDE.into_iter().flat_map(|distance| [-distance, distance]) {
            let s = place + 0.5 * distance * (cell.to - cell.from);
            let name = format!("beside a switch at {place:.4} of the way {}", segment.name);
            states.push(State::new(name, segment.at(s.clamp(0.0, 1.0)), Some(&width)));
        }
    }
    for cell in defects {
        let segment = &segments[cell.segment];
        let name = format!("where values and Jacobian disagree on the way {}", segment.name);
        states.push(State::new(name, segment.at(0.5 * (cell.from + cell.to)), Some(&width)));
    }
    states
}

/// Segments between drawn points, and to degenerate ones.
fn segments(
    domain: &Domain,
    starts: &[State],
    block: usize,
    most: usize,
    rng: &mut Rng,
) -> Vec<Segment> {
    let n = domain.lower.len();
    let mut found = Vec::new();
    let mut add = |from: &[f64], to: Vec<f64>, name: String, shrinking: bool| {
        if domain.contains(&to) && domain.contains(from) && from != to {
            found.push(Segment { from: from.to_vec(), to, name, shrinking });
        }
    };
    let drawn: Vec<Vec<f64>> = (0..most.max(4)).map(|_| domain.draw(rng)).collect();
    for pair in drawn.windows(2).take(most / 2) {
        add(&pair[0], pair[1].clone(), "between two points of the box".to_owned(), false);
    }
    for start in starts {
        add(&start.x, domain.draw(rng), format!("from {}", start.name), false);
    }
    // The size of a block is the caller's; without it, coordinates and particles in two and three dimensions.
    let sizes: Vec<usize> = if block > 1 { vec![block, 1] } else { vec![1, 2, 3] };
    for size in sizes.into_iter().filter(|size| n.is_multiple_of(*size)) {
        let blocks = n / size;
        for _ in 0..most {
            let start = domain.draw(rng);
            let of = |block: usize| &start[block * size..(block + 1) * size];
            let [a, b, c, d] = std::array::from_fn(|_| rng.usize(0..blocks));
            let mut with = |block: usize, value: &dyn Fn(usize) -> f64, name: String| {
                let mut to = start.clone();
                (0..size).for_each(|axis| to[block * size + axis] = value(axis));
                add(&start, to, name, true);
            };
            if a == b {
                with(a, &|_| 0.0, format!("to {a} at zero"));
                continue;
            }
            with(b, &|axis| of(a)[axis], format!("to {b} at {a}"));
            if ![a, b].contains(&c) {
                with(
                    c,
                    &|axis| 0.5 * (of(a)[axis] + of(b)[axis]),
                    format!("to {c} between {a} and {b}"),
                );
                if ![a, b, c].contains(&d) {
                    let corner = |axis: usize| of(c)[axis] + of(b)[axis] - of(a)[axis];
                    with(d, &corner, format!("to {d} where {a}{b} and {c}{d} are parallel"));
                }
            }
        }
    }
    for start in &drawn[..2] {
        let name = |end: &str| format!("to the {end}");
        add(start, vec![0.0; n], name("origin"), true);
        add(start, domain.lower.clone(), name("lower corner"), true);
        add(start, domain.upper.clone(), name("upper corner"), true);
    }
    found
}

/// The values at a point of a segment, and their derivatives along it.
#[derive(Clone)]
struct Sample {
    values: Vec<f64>,
    slopes: Vec<f64>,
}

/// A sample; `None` where the function is undefined.
fn sample(function: &mut Function<'_>, segment: &Segment, s: f64) -> Option<Sample> {
    let direction: Vec<f64> =
        segment.to.iter().zip(&segment.from).map(|(to, from)| to - from).collect();
    let (mut values, mut slopes) = (vec![0.0; function.rows], vec![0.0; function.rows]);
    let x = segment.at(s);
    if !function.evaluate(&x, &mut values) {
        return None;
    }
    function.jacobian(&x).add_product(&direction, &mut slopes);
    Some(Sample { values, slopes })
}

/// Curvature of each value in a cell, and the largest defect.
fn cell([a, m, b]: [&Sample; 3], h: f64) -> (Vec<f64>, f64) {
    let largest =
        a.values.iter().chain(&b.values).fold(0.0_f64, |largest, value| largest.max(value.abs()));
    let defect = (0..a.values.len()).map(|row| {
        let [ja, jm, jb] = [a, m, b].map(|sample| sample.slopes[row]);
        let integral = h / 6.0 * (ja + 4.0 * jm + jb);
        let slopes = h / 6.0 * (ja.abs() + 4.0 * jm.abs() + jb.abs());
        let change = b.values[row] - a.values[row];
        let defect = (change - integral).abs() / (change.abs() + slopes + NEGLIGIBLE * largest);
        // Where the Jacobian is not finite, it is to be checked; where all is zero, there is nothing to check.
        if integral.is_nan() { 1.0 } else { defect }
    });
    let defect = defect.filter(|defect| !defect.is_nan()).fold(0.0, f64::max);
    (curvature([&a.values, &m.values, &b.values], h, largest), defect)
}

fn curvature([a, m, b]: [&[f64]; 3], h: f64, largest: f64) -> Vec<f64> {
    let of_row = |((a, m), b): ((&f64, &f64), &f64)| {
        let second = (a - m) + (b - m);
        if second.abs() > NEGLIGIBLE * largest { 4.0 * second / (h * h) } else { 0.0 }
    };
    a.iter().zip(m).zip(b).map(of_row).collect()
}

/// The largest relative change between the curvatures of two cells; beyond 1 if one of them is zero.
fn change(before: &[f64], after: &[f64]) -> f64 {
    let ratio = |(a, b): (&f64, &f64)| match (*a == 0.0, *b == 0.0) {
        (true, true) => 0.0,
        (false, false) => (a - b).abs() / (a.abs() + b.abs()),
        _ => 2.0,
    };
    before.iter().zip(after).map(ratio).fold(0.0, f64::max)
}

/// Halves a pair of cells towards the larger change of curvature: its place, and the last change relative to the first.
fn bisect(function: &mut Function<'_>, segment: &Segment, cell: &Cell) -> (f64, f64) {
    let (mut from, mut to) = (cell.from, cell.to);
    let (mut first, mut jump) = (None, 0.0);
    let rows = function.rows;
    let mut curvature_at = |from: f64, to: f64| {
        let mut values = [from, 0.5 * (from + to), to].map(|s| (s, vec![0.0; rows]));
        let defined = values.iter_mut().all(|(s, value)| function.evaluate(&segment.at(*s), value));
        let [(_, a), (_, m), (_, b)] = &values;
        let largest = a.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        defined.then(|| curvature([a, m, b], to - from, largest))
    };
    for _ in 0..HALVINGS {
        // Four quarters: three pairs of neighbours overlap, so that no switch falls between two.
        let quarter = 0.25 * (to - from);
        let cells: [_; 4] = std::array::from_fn(|k| {
            let start = from + k as f64 * quarter;
            curvature_at(start, start + quarter)
        });
        let jumps = cells.windows(2).map(|pair| match pair {
            [Some(a), Some(b)] => a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max),
            _ => 0.0,
        });
        let best = jumps.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((place, largest)) = best else { break };
        from += place as f64 * quarter;
        to = from + 2.0 * quarter;
        first.get_or_insert(largest);
        jump = largest;
    }
    let first = first.filter(|first| *first > 0.0);
    (0.5 * (from + to), first.map_or(0.0, |first| jump / first))
}
