//! The check of a Jacobian at one state, entry by entry.
//!
//! Cost: 8 evaluations for a column whose entries agree, some 110 for one with another entry; 37 for the noise of the function.

use crate::function::{Function, Matrix, along};
use crate::noise::{self, Noise};
use crate::ridders::{
    Difference, Estimate, Function as Values, LEVELS, Ladder, differentiate, power_of_two,
    rounded_steps,
};
use crate::taylor::{Steps, Taylor};
use crate::verdict::{CLEAR, Entry, Judgement, ROUNDING, Reason};

/// Exponents of the first steps of the ladders, relative to the size of the coordinate: 28 halvings without a gap.
const FIRST: [i32; 4] = [-2, -9, -16, -23];

/// Exponent of the first step, and number of steps, of the differences that decide most entries.
const QUICK: (i32, usize) = (-6, 4);

/// Bound of an entry, relative to it, below which the first differences that agree with it decide.
const SHARP: f64 = 1e-8;

/// Bound, relative to the largest entry of the row, above which agreement says nothing.
const BLUNT: f64 = 1e-2;

/// Ratio of the steps of the second differences to those of the first ones: the golden section, so that what repeats
/// with one of them does not with the other.
const SECOND: f64 = 0.618_033_988_7;

/// Error, relative to the entry, below which it may be rounding of the Jacobian, whose noise is then measured.
const SMALL: f64 = 1e-3;

/// Most entries of a Jacobian whose noise is measured.
const MOST_ENTRIES: usize = 1_000_000;

/// Bound of rounding errors of a Jacobian in single precision, relative to its entries, as [`ROUNDING`].
const SINGLE: f64 = 32.0 * f32::EPSILON as f64;

/// Bound of a derivative, relative to it, that no kink within the steps leaves.
const CERTAIN: f64 = 1e-6;

/// Uncertainty of a derivative, relative to it, beyond which the differences do not converge.
const UNCERTAIN: f64 = 0.1;

/// Noise, relative to the largest value, that hides everything.
const HIDDEN: f64 = 3e-3;

/// Change of a value over the shortest step, relative to the value, of a function whose steps are too coarse.
const COARSE: f64 = 1e-2;

/// Rounding of the arguments, relative to the shortest step, of a function that rounds them.
const ROUNDED: f64 = 1.0 / 16.0;

/// Step, relative to the size of the coordinate, over which only a jump changes a value by much.
const NEARBY: f64 = 1.0 / (1_u64 << 40) as f64;

/// A point, and where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// The name in reports.
    pub name: String,
    /// The coordinates.
    pub x: Vec<f64>,
    /// A typical size of each coordinate: the first steps are fractions of it.
    pub scale: Vec<f64>,
}

impl State {
    /// A state whose coordinates vary by `width`; without it, by their own sizes.
    pub fn new(name: impl Into<String>, x: Vec<f64>, width: Option<&[f64]>) -> Self {
        let largest = x.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
        let own = |x: &f64| {
            let size = if *x == 0.0 { largest } else { x.abs() };
            if size > 0.0 { size } else { 1.0 }
        };
        let scale =
            x.iter().enumerate().map(|(column, x)| match width.map(|width| width[column]) {
                Some(width) if width > 0.0 => power_of_two(width),
                _ => power_of_two(own(x)),
            });
        Self { name: name.into(), scale: scale.collect(), x }
    }
}

/// An entry that the first differences did not settle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finding {
    /// Row of the Jacobian.
    pub row: usize,
    /// Column of the Jacobian.
    pub column: usize,
    /// Its estimates.
    pub entry: Entry,
    /// Whether the function has a jump there.
    pub jump: bool,
    /// Whether shorter steps do not tell the entry from its value there, or contradict the estimate.
    pub blind: bool,
}

/// The result at one state.
#[derive(Debug, Clone, PartialEq)]
pub struct Observation {
    /// The Jacobian.
    pub matrix: Matrix,
    /// The values of the function.
    pub values: Vec<f64>,
    /// Bounds of their noise.
    pub noise: Vec<f64>,
    /// The entries that are wrong.
    pub wrong: Vec<Finding>,
    /// The entries without a verdict.
    pub open: Vec<(Finding, Reason)>,
    /// The largest bound of an entry that agrees, relative to the largest one of its row, and its place.
    pub bound: f64,
    /// A column that agrees.
    pub agreed: Option<usize>,
    /// Whether the Jacobian is in single precision.
    pub single: bool,
}

/// Checks every entry at `state`; `None` where the function is undefined.
pub fn observe(function: &mut Function<'_>, state: &State) -> Option<Observation> {
    let mut values = vec![0.0; function.rows];
    if !function.evaluate(&state.x, &mut values) {
        return None;
    }
    let noise = noise::measure(&mut function.values(), &state.x, &state.scale, &values);
    let matrix = function.jacobian(&state.x);
    let mut row_scale = vec![0.0_f64; function.rows];
    let mut single = false;
    let mut all_single = true;
    for column in 0..function.columns {
        for (row, value) in matrix.column(column) {
            row_scale[row] = row_scale[row].max(value.abs());
            all_single &= f64::from(value as f32) == value;
            // Three bytes: fractions and small integers are no sign of single precision.
            single |= value.to_bits().trailing_zeros() < 37;
        }
    }
    let single = single && all_single;
    let largest = values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    let Noise { bounds: mut noise, shortest } = noise;
    let rounded = values.iter().all(|value| f64::from(*value as f32) == *value);
    let width = state.scale.iter().fold(0.0_f64, |width, scale| width.max(*scale));
    let least = shortest.iter().copied().reduce(f64::min).unwrap_or(0.0);
    // The change of each value over the shortest steps.
    let mut changes: Vec<f64> = row_scale.iter().map(|scale| least * width * scale).collect();
    for (column, shortest) in shortest.iter().enumerate() {
        for (row, value) in matrix.column(column) {
            changes[row] = changes[row].max(shortest * state.scale[column] * value.abs());
        }
    }
    let unit = if rounded { f64::from(f32::EPSILON) } else { f64::EPSILON };
    let of_values: Vec<f64> = values.iter().map(|value| 2.0 * unit * value.abs()).collect();
    for (row, noise) in noise.iter_mut().enumerate().filter(|_| least > 0.0) {
        // By chance, nine rounded values may lie on a line.
        *noise = noise.max(of_values[row] + ROUNDED * changes[row]);
    }
    let is_hidden = |row: usize| {
        // The shortest step changes the value by as much as it is.
        let is_coarse = changes[row] > COARSE * values[row].abs();
        noise[row] > HIDDEN * largest || is_coarse && least > 0.0
    };
    let hidden = (0..values.len()).map(is_hidden).collect();
    let point = Point {
        state,
        noise: &noise,
        shortest: &shortest,
        of_values,
        hidden,
        row_scale,
        single,
        matrix: &matrix,
    };
    let (mut findings, mut bound, mut agreed) = (Vec::new(), 0.0_f64, None);
    let mut groups = matrix.groups();
    while let Some(group) = groups.pop() {
        let sharp = point.quick(function, &group);
        if let Some(largest) = sharp {
            bound = bound.max(largest);
            agreed = group.first().copied().or(agreed);
        } else if let [column] = group[..] {
            let (opinions, largest) = point.full(function, column);
            bound = bound.max(largest);
            findings.extend(opinions);
        } else {
            let (left, right) = group.split_at(group.len() / 2);
            groups.extend([left.to_vec(), right.to_vec()]);
        }
    }
    point.allow_for_noise(function, &mut findings);
    let (mut wrong, mut open) = (Vec::new(), Vec::new());
    for finding in findings {
        match point.judge(&finding) {
            Judgement::Wrong => wrong.push(finding),
            Judgement::Undecided(reason) => open.push((finding, reason)),
            Judgement::Agrees => agreed = agreed.or(Some(finding.column)),
        }
    }
    wrong.sort_by_key(|finding| (finding.column, finding.row));
    Some(Observation { matrix, values, noise, wrong, open, bound, agreed, single })
}

/// A state to check, with its noise and the analytic matrix.
struct Point<'a> {
    state: &'a State,
    noise: &'a [f64],
    shortest: &'a [f64],
    /// Bound of the rounding of each value.
    of_values: Vec<f64>,
    /// Rows whose noise hides their values.
    hidden: Vec<bool>,
    row_scale: Vec<f64>,
    single: bool,
    matrix: &'a Matrix,
}

impl Point<'_> {
    fn rounding(&self, row: usize, value: f64) -> f64 {
        let unit = if self.single { SINGLE } else { ROUNDING };
        unit * (value.abs() + self.row_scale[row] / 8.0)
    }

    /// The entries of a column, with zeros; of a group, the sum of its columns times their sizes.
    fn analytic(&self, group: &[usize], weights: bool) -> Vec<f64> {
        let mut values = vec![0.0; self.row_scale.len()];
        for column in group {
            let weight = if weights { self.state.scale[*column] } else { 1.0 };
            self.matrix.column(*column).for_each(|(row, value)| values[row] += weight * value);
        }
        values
    }

    /// The largest bound if the differences by a group of columns agree with all its entries, sharply.
    fn quick(&self, function: &mut Function<'_>, group: &[usize]) -> Option<f64> {
        let first = 2.0_f64.powi(QUICK.0);
        let ladder = |first| Ladder { first, levels: QUICK.1, sides: rounded_steps };
        let is_one = group.len() == 1;
        let analytic = self.analytic(group, !is_one);
        let State { x, scale, .. } = self.state;
        let differences = if let [column] = *group {
            let ladder = ladder(first * scale[column]);
            differentiate(&mut function.values(), x, column, ladder, self.noise)
        } else {
            let mut direction = vec![0.0; x.len()];
            group.iter().for_each(|column| direction[*column] = scale[*column]);
            let mut values = function.values();
            let mut line = along(&mut values, x, &direction);
            differentiate(&mut line, &[0.0], 0, ladder(first), self.noise)
        };
        let unit = if is_one { 1.0 } else { group.iter().fold(0.0, |u, c| scale[*c].max(u)) };
        let mut largest = 0.0_f64;
        for (row, (analytic, difference)) in analytic.iter().zip(differences).enumerate() {
            let Difference::Smooth(Estimate { value, uncertainty }) = difference else {
                return None;
            };
            let bound = uncertainty + self.rounding(row, *analytic);
            let size = self.row_scale[row] * unit;
            let is_sharp = bound <= SHARP * analytic.abs().max(0.1 * size) || bound == 0.0;
            let agrees = (analytic - value).abs() <= bound;
            // A value that does not depend on anything has no size.
            if !(agrees && (is_sharp || size == 0.0 && value == 0.0)) {
                return None;
            }
            largest = if size > 0.0 { largest.max(bound / size) } else { largest };
        }
        Some(largest)
    }

    /// All estimates of the entries of a column that the differences at many steps do not settle, and the largest bound of
    /// those that they settle.
    fn full(&self, function: &mut Function<'_>, column: usize) -> (Vec<Finding>, f64) {
        let rows = self.row_scale.len();
        let analytic = self.analytic(&[column], false);
        let State { x, scale, .. } = self.state;
        let mut values = function.values();
        let mut ladders: Vec<Ladder> =
            FIRST.iter().filter_map(|e| self.ladder(column, scale[column], *e)).collect();
        let mut tries: Vec<Vec<Difference>> = Vec::new();
        for ladder in &ladders {
            tries.push(differentiate(&mut values, x, column, *ladder, self.noise));
        }
        // A coordinate far closer to zero than to its neighbours may have a pole there.
        let own = x[column].abs();
        let is_close = own > 0.0 && own < 2.0_f64.powi(FIRST[2]) * scale[column];
        let regular = ladders.len();
        let best = |tries: &[Vec<Difference>], ladders: &[Ladder], row| {
            let best = self.best(row, &tries[..regular], &ladders[..regular]);
            if best.0 == Difference::Unavailable { self.best(row, tries, ladders) } else { best }
        };
        let nothing = (0..rows).any(|row| best(&tries, &ladders, row).0 == Difference::Unavailable);
        if is_close && nothing {
            for ladder in FIRST.iter().filter_map(|e| self.ladder(column, power_of_two(own), *e)) {
                tries.push(differentiate(&mut values, x, column, ladder, self.noise));
                ladders.push(ladder);
            }
        }
        let mut again: Vec<Option<Vec<Difference>>> = vec![None; ladders.len()];
        let (mut steps, mut nearby, mut local) = (None, None, None);
        let (mut findings, mut bound) = (Vec::new(), 0.0_f64);
        for row in 0..rows {
            let (difference, number) = best(&tries, &ladders, row);
            let rounding = self.rounding(row, analytic[row]);
            let (second, taylor) = (None, Taylor::Undecided);
            let analytic = analytic[row];
            let entry = Entry { analytic, rounding, difference, second, taylor };
            // Long steps may miss what lies within them.
            let blind = match (difference, tries.get(number + 1).map(|finer| finer[row])) {
                (Difference::Smooth(_), Some(Difference::Smooth(short))) => {
                    (analytic - short.value).abs() <= CLEAR * short.uncertainty
                }
                _ => false,
            };
            let mut finding = Finding { row, column, entry, jump: false, blind };
            if self.judge(&finding) == Judgement::Agrees {
                let relative = entry.error().uncertainty / self.row_scale[row];
                bound = if relative.is_finite() { bound.max(relative) } else { bound };
                continue;
            }
            let others = again[number].get_or_insert_with(|| {
                let first = SECOND * ladders[number].first;
                let ladder = Ladder { first, ..ladders[number] };
                differentiate(&mut values, x, column, ladder, self.noise)
            });
            if let Difference::Smooth(estimate) = others[row] {
                finding.entry.second = Some(estimate);
            }
            if let (Difference::Smooth(long), true) = (difference, self.shortest[column] > 0.0) {
                let local = local.get_or_insert_with(|| {
                    let step = self.shortest[column] * scale[column];
                    (step, changes(&mut values, x, column, rows, step))
                });
                finding.blind |= self.is_contradicted(row, long, local);
            }
            let steps = steps.get_or_insert_with(|| {
                Steps::take(&mut values, x, column, (ladders[0].first, rounded_steps), rows)
            });
            finding.entry.taylor = steps.judge(row, analytic, self.noise[row], rounding);
            if difference == Difference::Kink {
                let tiny = scale[column] * NEARBY;
                let changes =
                    nearby.get_or_insert_with(|| changes(&mut values, x, column, rows, tiny));
                finding.jump =
                    changes[row].abs() > 64.0 * (self.noise[row] + self.row_scale[row] * tiny);
            }
            findings.push(finding);
        }
        (findings, bound)
    }

    /// Whether a function that rounds its arguments has another slope over the shortest step than over long ones, which then
    /// miss what lies within them. Along a coordinate, only that one is rounded anew, and the values.
    fn is_contradicted(
        &self,
        row: usize,
        long: Estimate,
        (step, changes): &(f64, Vec<f64>),
    ) -> bool {
        let slope = changes[row] / (2.0 * step);
        let bound = self.of_values[row] / step + ROUNDED * slope.abs() + long.uncertainty;
        (slope - long.value).abs() > CLEAR * bound
    }

    /// The steps from a fraction of `scale` on, down to the shortest that the function resolves.
    fn ladder(&self, column: usize, scale: f64, exponent: i32) -> Option<Ladder> {
        let first = scale * 2.0_f64.powi(exponent);
        let shortest = self.shortest[column] * scale;
        let levels =
            (0..LEVELS).filter(|level| first / 2.0_f64.powi(*level as i32) >= shortest).count();
        (levels >= 4).then_some(Ladder { first, levels, sides: rounded_steps })
    }

    /// The derivative of a row from the ladder that gives the sharpest one, and the number of the ladder.
    ///
    /// Shorter steps decide what longer ones may claim: a function that is not smooth over short steps is not smooth over
    /// long ones either, even if the values there happen to look so.
    fn best(
        &self,
        row: usize,
        tries: &[Vec<Difference>],
        ladders: &[Ladder],
    ) -> (Difference, usize) {
        let mut best = (Difference::Unavailable, 0);
        for (number, (differences, ladder)) in tries.iter().zip(ladders).enumerate().rev() {
            let Difference::Smooth(Estimate { value, uncertainty }) = differences[row] else {
                if differences[row] == Difference::Kink && best.0 == Difference::Unavailable {
                    best = (Difference::Kink, number);
                }
                continue;
            };
            let shortest = ladder.first / 2.0_f64.powi(ladder.levels as i32 - 1);
            let is_noise = uncertainty <= 4.0 * self.noise[row] / shortest;
            if !is_noise && uncertainty > UNCERTAIN * value.abs() {
                break;
            }
            match best.0 {
                Difference::Unavailable => best = (differences[row], number),
                // With a kink at the point, no longer steps give a sharp estimate.
                Difference::Kink if uncertainty > CERTAIN * value.abs() => {}
                Difference::Kink => best = (differences[row], number),
                Difference::Smooth(known) => {
                    if (known.value - value).abs() > CLEAR * (known.uncertainty + uncertainty) {
                        break;
                    }
                    if uncertainty < known.uncertainty {
                        best = (differences[row], number);
                    }
                    if !is_noise && uncertainty > known.uncertainty {
                        break;
                    }
                }
            }
        }
        best
    }

    /// The judgement of an entry, which says nothing if its bound is too wide.
    fn judge(&self, finding: &Finding) -> Judgement {
        if self.hidden[finding.row] && finding.entry.difference != Difference::Kink {
            return Judgement::Undecided(Reason::Cancellation);
        }
        let judgement = finding.entry.judge();
        let Estimate { uncertainty, .. } = finding.entry.error();
        let value = finding.entry.sharpest().map_or(0.0, |estimate| estimate.value.abs());
        let size = self.row_scale[finding.row].max(value);
        let is_blind = judgement == Judgement::Wrong && finding.blind;
        if is_blind && finding.entry.analytic.is_finite() {
            return Judgement::Undecided(Reason::Cancellation);
        }
        if judgement == Judgement::Agrees && uncertainty > BLUNT * size && size > 0.0 {
            return Judgement::Undecided(Reason::Cancellation);
        }
        judgement
    }

    /// Adds the measured noise of the Jacobian to the bounds of entries that are wrong by little.
    fn allow_for_noise(&self, function: &mut Function<'_>, findings: &mut [Finding]) {
        let is_close = |finding: &Finding| {
            let size = finding.entry.analytic.abs().max(self.row_scale[finding.row]);
            self.judge(finding) == Judgement::Wrong && finding.entry.error().value <= SMALL * size
        };
        let (rows, columns) = (function.rows, function.columns);
        let close: Vec<bool> = findings.iter().map(is_close).collect();
        if !close.contains(&true) || rows * columns > MOST_ENTRIES {
            return;
        }
        let here = self.matrix.dense();
        let mut entries = |x: &[f64], values: &mut [f64]| {
            values.copy_from_slice(&function.jacobian(x).dense());
            true
        };
        let noise = noise::measure(&mut entries, &self.state.x, &self.state.scale, &here).bounds;
        for (finding, _) in findings.iter_mut().zip(close).filter(|(_, is_close)| *is_close) {
            finding.entry.rounding += noise[finding.column * rows + finding.row];
        }
    }
}

/// The change of each value from one side of a step to the other; 0 where it is undefined.
fn changes(function: Values<'_>, x: &[f64], column: usize, rows: usize, step: f64) -> Vec<f64> {
    let mut moved = x.to_vec();
    let mut sides = [step, -step].map(|step| (step, vec![0.0; rows]));
    let defined = sides.iter_mut().all(|(step, values)| {
        moved[column] = x[column] + *step;
        function(&moved, values)
    });
    let [(_, above), (_, below)] = &sides;
    let change = |(above, below): (&f64, &f64)| if defined { above - below } else { 0.0 };
    above.iter().zip(below).map(change).collect()
}
