//! The check of a function's Jacobian at many states, and its report.

use std::collections::BTreeSet;
use std::fmt;

use fastrand::Rng;

use crate::branches::{self, Domain};
use crate::function::{Calls, Function};
use crate::likeness::{Change, Likeness, Pair};
use crate::probes;
use crate::ridders::rounded_steps;
use crate::state::{Finding, Observation, State, observe};
use crate::structure::{self, Property, PropertyFinding};
use crate::taylor::{Steps, Taylor, Window};
use crate::verdict::{Reason, Verdict};

/// Most switching surfaces next to which states are checked; of large functions fewer.
const SWITCHES: usize = 8;

/// Number of variables from which on fewer are.
const MANY_VARIABLES: usize = 30;

/// Most entries of a matrix whose error is named.
const MOST_ENTRIES: usize = 1_000_000;

/// The states at which a Jacobian is checked, and how its errors are described.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Points of the user's own.
    pub points: Vec<Vec<f64>>,
    /// The box of the arguments, from which points are drawn and where branches are searched for.
    pub domain: Option<Domain>,
    /// Number of points drawn from the box.
    pub draws: usize,
    /// Whether branches are searched for in the box.
    pub search: bool,
    /// Seed of the draws.
    pub seed: u64,
    /// Number of coordinates of a particle: the size of the blocks in which errors are described.
    pub block: usize,
    /// Names and values of numbers by which a Jacobian may be off: a time step, a mass.
    pub factors: Vec<(String, f64)>,
    /// Properties that the Jacobian must have.
    pub properties: Vec<Property>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            points: Vec::new(),
            domain: None,
            draws: 4,
            search: true,
            seed: 1,
            block: 1,
            factors: Vec::new(),
            properties: Vec::new(),
        }
    }
}

/// The result of a check.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// The verdict on the whole.
    pub verdict: Verdict,
    /// Number of values.
    pub rows: usize,
    /// Number of variables.
    pub columns: usize,
    /// Each state.
    pub states: Vec<StateFinding>,
    /// The entry that supports the verdict: the worst contradiction, or one without a verdict.
    pub worst: Option<Worst>,
    /// The pattern of the error.
    pub likeness: Option<Likeness>,
    /// Row and column of all entries that are wrong at some state.
    pub wrong: BTreeSet<(usize, usize)>,
    /// Row and column of all entries that have a verdict at no state.
    pub open: BTreeSet<(usize, usize)>,
    /// The largest bound of an entry that agrees, relative to the largest one of its row.
    pub bound: f64,
    /// The slope of Taylor's remainder in a column that is right, or of the worst entry.
    pub window: Option<Window>,
    /// Each property that was asked for.
    pub properties: Vec<PropertyFinding>,
    /// Calls of the function and of its Jacobian.
    pub calls: Calls,
    /// Whether values, and the Jacobian, are in single precision.
    pub single: [bool; 2],
}

/// The result at one state.
#[derive(Debug, Clone, PartialEq)]
pub struct StateFinding {
    /// The state.
    pub state: State,
    /// The verdict there.
    pub verdict: Verdict,
    /// Number of wrong entries.
    pub wrong: usize,
    /// Number of entries at a kink.
    pub kinks: usize,
    /// Number of entries at a jump.
    pub jumps: usize,
    /// The largest noise of a value, relative to the largest value.
    pub noise: f64,
}

/// One entry with its state.
#[derive(Debug, Clone, PartialEq)]
pub struct Worst {
    /// The entry.
    pub finding: Finding,
    /// The state.
    pub state: State,
    /// The largest entry of the Jacobian there, by the estimates.
    pub size: f64,
    /// The whole Jacobian there, if an entry is wrong and there are not too many.
    pub matrices: Option<Matrices>,
}

/// A Jacobian as stated and as measured, column by column.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrices {
    /// The entries as stated.
    pub stated: Vec<f64>,
    /// The same; those that are wrong as measured.
    pub measured: Vec<f64>,
}

impl Matrices {
    fn of(seen: &Observation) -> Self {
        let stated = seen.matrix.dense();
        let mut measured = stated.clone();
        for finding in &seen.wrong {
            if let Some(estimate) = finding.entry.sharpest() {
                measured[finding.column * seen.values.len() + finding.row] = estimate.value;
            }
        }
        Self { stated, measured }
    }
}

/// Checks `function`.
pub fn check(function: &mut Function<'_>, settings: &Settings) -> Report {
    let mut rng = Rng::with_seed(settings.seed);
    let width = settings.domain.as_ref().map(Domain::width);
    let named = |(number, x): (usize, &Vec<f64>)| {
        State::new(format!("point {}", number + 1), x.clone(), width.as_deref())
    };
    let mut states: Vec<State> = settings.points.iter().enumerate().map(named).collect();
    if let Some(domain) = &settings.domain {
        for number in 1..=settings.draws {
            let x = domain.draw(&mut rng);
            states.push(State::new(format!("drawn {number}"), x, width.as_deref()));
        }
        if settings.search {
            let most = (SWITCHES * MANY_VARIABLES / function.columns.max(1)).clamp(1, SWITCHES);
            let found =
                branches::search(function, domain, &states, (settings.block, most), &mut rng);
            states.extend(found);
            states.extend(probes::search(function, domain, most, &mut rng));
        }
    }
    let mut tally = Tally::default();
    let mut first = None;
    for state in states {
        let observation = observe(function, &state);
        if let Some(observation) = &observation {
            tally.properties(function, &state, observation, settings);
            first.get_or_insert_with(|| (state.x.clone(), observation.matrix.clone()));
        }
        let elsewhere = first.as_ref().is_some_and(|(x, matrix)| {
            observation.as_ref().is_some_and(|seen| *x != state.x && seen.matrix == *matrix)
        });
        tally.add(state, observation, settings, elsewhere);
    }
    tally.finish(function)
}

/// All states so far.
#[derive(Default)]
struct Tally {
    states: Vec<StateFinding>,
    worst: Option<(f64, Worst)>,
    undecided: Option<Worst>,
    likenesses: Vec<Likeness>,
    wrong: BTreeSet<(usize, usize)>,
    /// Entries without a verdict at every state so far.
    open: Option<BTreeSet<(usize, usize)>>,
    reasons: BTreeSet<Reason>,
    bound: f64,
    nonzero: bool,
    agreed: Option<(State, usize, Observation)>,
    single: [bool; 2],
    properties: Vec<PropertyFinding>,
}

impl Tally {
    fn add(
        &mut self,
        state: State,
        observation: Option<Observation>,
        settings: &Settings,
        same_elsewhere: bool,
    ) {
        let Some(observation) = observation else {
            let verdict = Verdict::Inconclusive(Reason::Degenerate);
            let finding = StateFinding { state, verdict, wrong: 0, kinks: 0, jumps: 0, noise: 0.0 };
            return self.states.push(finding);
        };
        let Observation { matrix, values, noise, wrong, open, bound, agreed, single } =
            &observation;
        let rows = values.len();
        let largest = values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        let loudest = noise.iter().fold(0.0, |largest: f64, noise| largest.max(*noise));
        let is_single =
            largest > 0.0 && values.iter().all(|value| f64::from(*value as f32) == *value);
        let [values_single, jacobian_single] = self.single;
        let noisy = loudest > 1e-10 * largest;
        self.single = [values_single || is_single && noisy, jacobian_single || *single];
        self.bound = self.bound.max(*bound);
        self.nonzero |=
            (0..matrix.columns()).any(|column| matrix.column(column).any(|(_, v)| v != 0.0));
        let at = |finding: &Finding| (finding.row, finding.column);
        let undecided: BTreeSet<_> = open.iter().map(|(finding, _)| at(finding)).collect();
        self.open = Some(match self.open.take() {
            None => undecided,
            Some(known) => known.intersection(&undecided).copied().collect(),
        });
        self.reasons.extend(open.iter().map(|(_, reason)| *reason));
        self.wrong.extend(wrong.iter().map(at));
        let size = || {
            let stated = (0..matrix.columns()).flat_map(|column| matrix.column(column));
            let stated = stated.map(|(_, value)| value.abs()).filter(|value| value.is_finite());
            let measured = wrong.iter().filter_map(|finding| finding.entry.sharpest());
            stated.chain(measured.map(|estimate| estimate.value.abs())).fold(0.0, f64::max)
        };
        if let Some((finding, _)) = open.first().filter(|_| self.undecided.is_none()) {
            let (finding, state) = (*finding, state.clone());
            self.undecided = Some(Worst { finding, state, size: size(), matrices: None });
        }
        let excess = |finding: &Finding| finding.entry.excess();
        if let Some(finding) = wrong.iter().max_by(|a, b| excess(a).total_cmp(&excess(b))) {
            let is_drawn = rows * matrix.columns() <= MOST_ENTRIES;
            let matrices = is_drawn.then(|| Matrices::of(&observation));
            if let Some(matrices) = &matrices {
                let likeness = likeness(&observation, matrices, settings, same_elsewhere);
                self.likenesses.push(likeness);
            }
            if self.worst.as_ref().is_none_or(|(known, _)| excess(finding) > *known) {
                let (finding, state) = (*finding, state.clone());
                let worst = Worst { finding, state, size: size(), matrices };
                self.worst = Some((excess(&finding), worst));
            }
        } else if let (Some(column), None) = (agreed, &self.agreed) {
            self.agreed = Some((state.clone(), *column, observation.clone()));
        }
        let verdict = match open.iter().map(|(_, reason)| *reason).min() {
            _ if !wrong.is_empty() => Verdict::Wrong,
            Some(reason) => Verdict::Inconclusive(reason),
            None => Verdict::Correct,
        };
        let kinks = open.iter().filter(|(_, reason)| *reason == Reason::Kink).count();
        let jumps = open.iter().filter(|(finding, _)| finding.jump).count();
        let noise = if largest > 0.0 { loudest / largest } else { 0.0 };
        let (wrong, kinks) = (wrong.len(), kinks - jumps);
        self.states.push(StateFinding { state, verdict, wrong, kinks, jumps, noise });
    }

    fn properties(
        &mut self,
        function: &mut Function<'_>,
        state: &State,
        observation: &Observation,
        settings: &Settings,
    ) {
        for property in &settings.properties {
            let found = structure::check(*property, function, state, observation, settings.block);
            match self.properties.iter_mut().find(|known| known.property == *property) {
                None => self.properties.push(found),
                Some(known) if found.error > known.error => *known = found,
                Some(_) => {}
            }
        }
    }

    fn finish(self, function: &mut Function<'_>) -> Report {
        let open = self.open.unwrap_or_default();
        let is_wrong = |property: &PropertyFinding| property.verdict == Verdict::Wrong;
        let verdict = match self.reasons.first() {
            _ if !self.wrong.is_empty() || self.properties.iter().any(is_wrong) => Verdict::Wrong,
            Some(reason) if !open.is_empty() => Verdict::Inconclusive(*reason),
            _ if self.agreed.is_none()
                && !self.states.iter().any(|s| s.verdict == Verdict::Correct) =>
            {
                let of_states = self.states.iter().filter_map(|state| state.verdict.reason()).min();
                Verdict::Inconclusive(of_states.unwrap_or(Reason::NoEvidence))
            }
            _ if !self.nonzero => Verdict::CorrectZero,
            _ => Verdict::Correct,
        };
        let worst = self.worst.map(|(_, worst)| worst);
        let worst = worst.or(self.undecided.filter(|_| verdict.reason().is_some()));
        let window = match &worst {
            Some(worst) => worst.finding.entry.taylor.window(),
            None => {
                self.agreed.and_then(|(state, column, seen)| slope(function, &state, column, &seen))
            }
        };
        let likeness = common(&self.likenesses);
        Report {
            verdict,
            rows: function.rows,
            columns: function.columns,
            states: self.states,
            worst,
            likeness,
            wrong: self.wrong,
            open,
            bound: self.bound,
            window,
            properties: self.properties,
            calls: function.calls,
            single: self.single,
        }
    }
}

/// The pattern of the wrong entries of one state.
fn likeness(
    seen: &Observation,
    Matrices { stated, measured }: &Matrices,
    settings: &Settings,
    same_elsewhere: bool,
) -> Likeness {
    let rows = seen.values.len();
    let mut bounds = vec![0.0_f64; rows];
    for finding in &seen.wrong {
        if let Some(estimate) = finding.entry.sharpest() {
            let bound = estimate.uncertainty + finding.entry.rounding;
            bounds[finding.row] = bounds[finding.row].max(bound);
        }
    }
    let wrong: Vec<_> = seen.wrong.iter().map(|finding| (finding.row, finding.column)).collect();
    let block = settings.block.max(1);
    let pair = Pair { rows, block, stated, measured, bounds: &bounds, wrong: &wrong };
    pair.likeness(&settings.factors, same_elsewhere)
}

/// The likeness with a name that most states share; of as many, the first.
pub fn common(likenesses: &[Likeness]) -> Option<Likeness> {
    let count = |of: &Likeness| likenesses.iter().filter(|other| is_alike(of, other)).count();
    let is_named = |likeness: &Likeness| likeness.change != Change::Other;
    likenesses.iter().rev().max_by_key(|likeness| (is_named(likeness), count(likeness))).cloned()
}

/// Whether two likenesses are the same, but for the digits of a factor.
pub fn is_alike(a: &Likeness, b: &Likeness) -> bool {
    use Change::Factor;
    a.region == b.region
        && match (&a.change, &b.change) {
            (Factor(x, _), Factor(y, _)) => (x - y).abs() <= 1e-4 * x.abs(),
            (x, y) => x == y,
        }
}

/// The slope of Taylor's remainder in the first row of a column that has one.
fn slope(
    function: &mut Function<'_>,
    state: &State,
    column: usize,
    seen: &Observation,
) -> Option<Window> {
    let rows = function.rows;
    let first = (0.25 * state.scale[column], rounded_steps as fn(f64, f64) -> Option<(f64, f64)>);
    let mut values = function.values();
    let steps = Steps::take(&mut values, &state.x, column, first, rows);
    let judged = seen.matrix.column(column).map(|(row, value)| {
        steps.judge(row, value, seen.noise[row], crate::verdict::ROUNDING * value.abs())
    });
    let mut consistent = judged.filter(|taylor| matches!(taylor, Taylor::Consistent(_)));
    consistent.find_map(|taylor| taylor.window())
}

impl Report {
    /// Whether the Jacobian is correct.
    pub fn is_pass(&self) -> bool {
        self.verdict.is_correct()
    }

    /// Number of states that are wrong, and of those with a verdict.
    pub fn counts(&self) -> (usize, usize) {
        let wrong = self.states.iter().filter(|state| state.verdict == Verdict::Wrong).count();
        let judged = self.states.iter().filter(|state| state.verdict.reason().is_none()).count();
        (wrong, judged)
    }

    /// Whether it is wrong at some states and right at others: on a branch.
    pub fn is_on_branch(&self) -> bool {
        let (wrong, judged) = self.counts();
        wrong > 0 && wrong < judged
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { rows, columns, calls, .. } = self;
        let name = match self.verdict {
            Verdict::CorrectZero => "correct: zero everywhere",
            verdict => verdict.name(),
        };
        write!(f, "{rows} x {columns} Jacobian: {name}")?;
        if let Some(reason) = self.verdict.reason() {
            write!(f, ", {}", reason.meaning())?;
        }
        if let Some(likeness) = &self.likeness {
            write!(f, "\n  {likeness}")?;
        }
        if let (wrong, judged) = self.counts()
            && wrong > 0
        {
            let places = self.wrong.len();
            let entries = if places == 1 { "entry is" } else { "entries are" };
            write!(f, "\n  {places} {entries} wrong, at {wrong} of {}", counted(judged, "state"))?;
            if wrong < judged {
                write!(f, ": on a branch, or where the entry is not zero")?;
            }
        }
        if let Some(Worst { finding, state, .. }) = &self.worst {
            let Finding { row, column, entry, .. } = finding;
            write!(f, "\n  entry ({row}, {column}) at {}: yours {:?}", state.name, entry.analytic)?;
            match entry.sharpest() {
                Some(e) => write!(f, ", measured {:?} ± {:.1e}", e.value, e.uncertainty)?,
                None => write!(f, ", not measured")?,
            }
            write!(f, "\n    x = {:?}", state.x)?;
        }
        if self.verdict.is_correct() && self.bound > 0.0 {
            write!(f, "\n  no entry is off by more than {:.1e} of its row's largest", self.bound)?;
        }
        if let Some(window) = self.window {
            let (low, high) = window.steps;
            write!(
                f,
                "\n  Taylor's remainder falls as t^{:.2} for t from {low:.0e} to {high:.0e}",
                window.slope
            )?;
        }
        for property in self.properties.iter().filter(|p| p.verdict == Verdict::Wrong) {
            write!(f, "\n  {}: violated by {:.1e}", property.property.name(), property.error)?;
        }
        let count = |of: fn(&StateFinding) -> bool| self.states.iter().filter(|s| of(s)).count();
        for (number, what) in [
            (count(|state| state.kinks > 0), "a kink of the function"),
            (count(|state| state.jumps > 0), "a jump of the function"),
            (count(|s| s.verdict == Verdict::Inconclusive(Reason::Degenerate)), "no value"),
        ] {
            if number > 0 {
                write!(f, "\n  {what} at {number} of {}", counted(self.states.len(), "state"))?;
            }
        }
        match self.single {
            [true, true] => write!(f, "\n  the values and the Jacobian are in single precision")?,
            [true, false] => write!(f, "\n  the values are in single precision")?,
            [false, true] => write!(f, "\n  the Jacobian is in single precision")?,
            [false, false] => {}
        }
        write!(
            f,
            "\n  {}, {} of the function, {} of the Jacobian",
            counted(self.states.len(), "state"),
            counted(calls.values, "call"),
            calls.jacobians
        )
    }
}

/// `1 state`, `2 states`.
fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}
