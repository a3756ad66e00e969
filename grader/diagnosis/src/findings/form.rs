//! Faults of the output itself, seen in a single scene. They are settled before physics is suspected.
//!
//! - **Form**: no trace, a malformed trace, or a wrong number of states. At the initial state also: the initial state
//!   is missing, or its bytes or numbers are in another order.
//! - **Digits**: the numbers are the oracle's, rounded to few digits or to single precision.

use std::fmt;

use scene::Scene;
use scene::trace::State;
use simulator::solver::linear::LinearSolver;

use super::feature::{Family, Feature, Symptom};
use super::judged::{ContextRow, FirstWrong, JudgedScene, Outcome};
use crate::stepping::Stepper;
use crate::steps::{digits, is_single};

/// Numbers with at most this many digits count as rounded; an f64 has 15 to 17.
const FEW_DIGITS: usize = 14;

/// Numbers within this relative distance are equal up to the order of operations.
pub(super) const SAME: f64 = 1e-9;

/// The attributes of a particle: position, then velocity.
pub(super) const NAMES: [&str; 4] = ["px", "py", "vx", "vy"];

/// Relative error of single precision, accumulated over some steps.
const NEARLY: f64 = 1e-4;

/// How a scene failed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Kind {
    /// Wrong numbers.
    Wrong,
    /// The program says that it lacks a feature of the scene.
    Refused,
    /// There is no trace in a folder of traces.
    Missing,
    NotBuilt,
    Crash,
    Error,
    TimeOut,
    Memory,
    NoTrace,
    TooMuch,
    Malformed,
    /// Rows have the numbers of free particles alone.
    FixedLeftOut,
    NotFiniteAtLast,
    StateTooMany,
    StateTooFew,
    /// By one rule in several scenes.
    Duration,
    /// Right states, several too few.
    EndsEarly,
    /// The duration is cut to an integer.
    IntegerDuration,
    /// The duration is the next integer.
    RoundedDuration,
    /// All states are the last one, or its positions: which, in words.
    LastState(&'static str),
    /// All states are one state.
    OneState,
    InitialMissing,
    /// The steps of the trace start at 1.
    StartsAtOne,
    /// They do, with the initial state.
    CountsFromOne,
    ByteOrder,
    Order,
    /// Right numbers in the wrong order from the reading of the scene on.
    OrderRead,
    /// The same, read or written so.
    OrderOpen,
    Negated,
    Zeros,
    /// The times of the trace count by this time step.
    TimeStep(String),
    /// The times of the trace count by a time step that is another one in each scene: which, in words.
    TimeSteps(&'static str),
    /// The times of the trace are not those of the scene, and count by no one time step.
    Times,
    /// The times are wrong, the states follow one another: how, in words.
    TimeColumn(String),
    /// A number of each particle has another one in its place: both by their places in [`NAMES`].
    Column([usize; 2]),
    Late,
    VelocitiesLate,
    /// `m v` in the place of each velocity.
    Momenta,
    SingleBytes,
    InitialVelocity,
    FixedStopped,
    InitialState,
    /// The first state is read wrongly: how, in words.
    InitialRead(String),
    /// Only the first state is wrong.
    InitialWritten,
    /// The first state is wrong, read or written so.
    InitialOpen,
    InitialRounded,
    /// All numbers are read in single precision, the time step as well.
    ReadInSingle,
    Digits(usize),
    Decimals(usize),
    Single,
    /// Only the written numbers are in single precision.
    SingleWritten,
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = match self {
            Self::Wrong
            | Self::Refused
            | Self::Missing
            | Self::NotBuilt
            | Self::Crash
            | Self::Error
            | Self::TimeOut
            | Self::Memory => "",
            Self::NoTrace => "no trace where it is expected",
            Self::TooMuch => "output limit exceeded",
            Self::Malformed => "malformed",
            Self::FixedLeftOut => "rows have free particles alone, fixed ones are left out",
            Self::NotFiniteAtLast => "right, except for non-finite numbers at the end",
            Self::StateTooMany => "too many",
            Self::StateTooFew => "one too few",
            Self::Duration => "wrong duration or dt",
            Self::EndsEarly => "too few, by another duration or dt, or as the program stops early",
            Self::IntegerDuration => "the duration is read as an integer",
            Self::RoundedDuration => "the duration is rounded up to an integer",
            Self::OneState => "every state of the trace is the same",
            Self::InitialMissing => "the initial state is missing",
            Self::StartsAtOne => "the initial state is missing, or steps are counted from 1",
            Self::CountsFromOne => "steps are counted from 1",
            Self::ByteOrder => "reversed byte order",
            Self::Order | Self::OrderOpen => "right numbers in the wrong order",
            Self::OrderRead => "the numbers of particles are in the wrong order",
            Self::Negated => "positions and velocities have the wrong sign",
            Self::Zeros => "every number is 0",
            Self::TimeStep(step) => return write!(f, "dt is always taken as {step}"),
            Self::TimeSteps(how) | Self::LastState(how) => how,
            Self::TimeColumn(how) => how.as_str(),
            Self::Column([of, from]) => {
                return write!(f, "{} is written in the place of {}", NAMES[*from], NAMES[*of]);
            }
            Self::Times => "the times are not multiples of dt",
            Self::Late => "each state is written one step late",
            Self::VelocitiesLate => "the velocities are those of the step before",
            Self::Momenta => "m v stands in the place of each velocity",
            Self::SingleBytes => "4-byte numbers instead of 8-byte ones",
            Self::InitialVelocity => "initial velocities are not read",
            Self::FixedStopped => "their velocities are set to 0",
            Self::InitialState | Self::InitialOpen => "wrong initial state",
            Self::InitialRead(how) => how.as_str(),
            Self::InitialWritten => "the first state is wrong, the next one is right",
            Self::InitialRounded => "the numbers of particles are rounded",
            Self::ReadInSingle => "numbers are rounded to single precision",
            Self::Digits(digits) => {
                return write!(f, "numbers are rounded to {digits} digits");
            }
            Self::Decimals(decimals) => {
                return write!(f, "numbers are rounded to {decimals} decimals");
            }
            Self::Single => "numbers are in single precision",
            Self::SingleWritten => "numbers are written in single precision",
        };
        f.write_str(text)
    }
}

impl Kind {
    /// The feature at fault, if this kind of failure determines it; `None` if that takes several scenes.
    pub(super) fn feature(&self) -> Option<Feature> {
        Some(match self {
            Self::Wrong
            | Self::Refused
            | Self::Missing
            | Self::NotBuilt
            | Self::Crash
            | Self::Error
            | Self::TimeOut
            | Self::Memory => return None,
            Self::StateTooMany | Self::StateTooFew | Self::EndsEarly => Feature::States,
            Self::Duration
            | Self::IntegerDuration
            | Self::RoundedDuration
            | Self::InitialVelocity
            | Self::InitialState
            | Self::InitialRead(_)
            | Self::InitialOpen
            | Self::InitialRounded
            | Self::ReadInSingle
            | Self::OrderRead
            | Self::OrderOpen
            | Self::Times
            | Self::TimeSteps(_)
            | Self::TimeStep(_) => Feature::Reading,
            Self::FixedStopped => Feature::Fixed(Family::Any),
            Self::Digits(_) | Self::Decimals(_) | Self::Single | Self::SingleWritten => {
                Feature::Precision
            }
            Self::NoTrace
            | Self::TooMuch
            | Self::Malformed
            | Self::FixedLeftOut
            | Self::NotFiniteAtLast
            | Self::LastState(_)
            | Self::OneState
            | Self::InitialMissing
            | Self::StartsAtOne
            | Self::CountsFromOne
            | Self::ByteOrder
            | Self::Order
            | Self::InitialWritten
            | Self::Negated
            | Self::Zeros
            | Self::Late
            | Self::VelocitiesLate
            | Self::Momenta
            | Self::TimeColumn(_)
            | Self::Column(_)
            | Self::SingleBytes => Feature::Output,
        })
    }

    /// The feature at fault, or two where this kind of failure does not tell reading from writing.
    pub(super) fn features(&self) -> Vec<Feature> {
        let is_open = matches!(self, Self::OrderOpen | Self::InitialOpen | Self::Times);
        let second = is_open.then_some(Feature::Output);
        self.feature().into_iter().chain(second).collect()
    }

    /// The fault in words, with the features at fault.
    pub(super) fn sentence(&self) -> String {
        let features: Vec<String> = self.features().iter().map(Feature::to_string).collect();
        match self {
            Self::TimeStep(_) | Self::TimeSteps(_) => self.to_string(),
            _ => format!("{}: {self}", features.join(" or ")),
        }
    }

    /// Whether the states of such a trace are those of the scene's steps, one after another.
    pub(super) fn keeps_states(&self) -> bool {
        matches!(
            self,
            Self::Wrong
                | Self::NotFiniteAtLast
                | Self::StateTooMany
                | Self::StateTooFew
                | Self::Duration
                | Self::EndsEarly
                | Self::IntegerDuration
                | Self::RoundedDuration
                | Self::Digits(_)
                | Self::Decimals(_)
                | Self::Single
                | Self::SingleWritten
                | Self::TimeColumn(_)
        )
    }

    /// Whether the first state of such a trace is what the program read, in the order of the scene.
    pub(super) fn shows_start(&self) -> bool {
        let is_initial = matches!(
            self,
            Self::InitialState
                | Self::InitialOpen
                | Self::InitialRounded
                | Self::InitialVelocity
                | Self::FixedStopped
                | Self::OrderRead
                | Self::OrderOpen
        );
        is_initial || self.keeps_states()
    }

    /// The symptom.
    pub(super) fn symptom(&self) -> Symptom {
        match self {
            Self::Crash => Symptom::Crash,
            Self::Error => Symptom::Error,
            Self::TimeOut => Symptom::TimeOut,
            Self::Memory => Symptom::Memory,
            _ => Symptom::Wrong,
        }
    }
}

impl Kind {
    /// How a scene failed; `None` if it passed, was not judged, or was not run.
    pub(super) fn of(judged: &JudgedScene<'_>) -> Option<Self> {
        let JudgedScene { scene, first_wrong, .. } = judged;
        let in_numbers = || first_wrong.as_ref().and_then(|first| in_numbers(judged, first));
        let has_right_numbers = first_wrong.is_none();
        Some(match &judged.outcome {
            Outcome::Passed | Outcome::NotJudged => return None,
            Outcome::NotBuilt => Self::NotBuilt,
            Outcome::Refused(_) => Self::Refused,
            Outcome::Missing => Self::Missing,
            Outcome::Crashed(_) => Self::Crash,
            Outcome::Stopped(_) => Self::Error,
            Outcome::TimedOut => Self::TimeOut,
            Outcome::OutOfMemory => Self::Memory,
            Outcome::NoTrace => Self::NoTrace,
            Outcome::TooMuchOutput => Self::TooMuch,
            Outcome::Malformed(_) | Outcome::Fields { .. } => {
                time_column(judged).or_else(in_numbers).unwrap_or(Self::Malformed)
            }
            Outcome::StartsAtOne => Self::StartsAtOne,
            Outcome::OtherTimes(step) => {
                Self::TimeStep(format!("{:.9e}", step).parse::<f64>().unwrap_or(*step).to_string())
            }
            Outcome::NotFinite(step) if has_right_numbers && *step == scene.n_steps() => {
                Self::NotFiniteAtLast
            }
            Outcome::TooShort { states: 0, .. } if has_right_numbers => Self::NoTrace,
            Outcome::TooShort { states, expected } if has_right_numbers => {
                if states + 1 < *expected { Self::EndsEarly } else { Self::StateTooFew }
            }
            Outcome::TooLong if has_right_numbers => Self::StateTooMany,
            Outcome::NotFinite(_)
            | Outcome::TooShort { .. }
            | Outcome::TooLong
            | Outcome::Differs => in_numbers().unwrap_or(Self::Wrong),
        })
    }
}

/// Wrong times, by the number of their state and the time step, in words.
type Times = (fn(f64, f64) -> f64, &'static str);

/// How the times of states may be wrong.
const TIMES: [Times; 5] = [
    (|number, step| (number - 1.0).max(0.0) * step, "each time is that of the state before"),
    (|number, step| (number + 1.0) * step, "each time is that of the state after"),
    (
        |number, step| if number == 0.0 { 0.0 } else { (number + 1.0) * step },
        "each time but the first is that of the state after",
    ),
    (|_, _| 0.0, "every time is 0"),
    (|number, _| number, "each time is the number of the state"),
];

/// The kind of failure if only the times of a trace are known to be wrong.
pub(super) fn time_column(judged: &JudgedScene<'_>) -> Option<Kind> {
    let times = judged.states.iter().map(|state| state.time).collect::<Option<Vec<f64>>>()?;
    let step = judged.scene.time_step;
    let are = |of: fn(f64, f64) -> f64| {
        let wanted: Vec<f64> = (0..times.len()).map(|number| of(number as f64, step)).collect();
        same(&times, &wanted)
    };
    if times.len() < 2 || are(|number, step| number * step) {
        return None;
    }
    let is_rounded = |decimals: &i32| {
        let unit = 10.0_f64.powi(-decimals);
        times.iter().enumerate().all(|(number, time)| {
            (time - number as f64 * step).abs() <= 0.501 * unit
                && same(&[*time], &[(time / unit).round() * unit])
        })
    };
    let words = if let Some((_, words)) = TIMES.iter().find(|(of, _)| are(*of)) {
        (*words).to_owned()
    } else if let Some(decimals) = (1..=6).find(is_rounded) {
        format!("times are rounded to {decimals} decimals")
    } else {
        "the times are wrong".to_owned()
    };
    Some(Kind::TimeColumn(words))
}

/// The kind of failure if the first wrong numbers are right numbers in a wrong form.
fn in_numbers(judged: &JudgedScene<'_>, first: &FirstWrong<'_>) -> Option<Kind> {
    let scene = judged.scene;
    let row = |step: u64| first.context.iter().find(|row| row.step == step);
    if first.step == 0 {
        let initial = row(0)?;
        if let Some(kind) = in_order(judged, first.particle, initial, row(1)) {
            return Some(kind);
        }
    }
    if let Some(kind) = late(scene, first.context) {
        return Some(kind);
    }
    // An initial state can differ by rounding alone, whatever the later ones do. Rounded numbers have few digits later too;
    // otherwise they are read so.
    let rounded = match (first.step, row(0)) {
        (0, Some(initial)) => {
            let mut kinds = in_digits(std::slice::from_ref(initial));
            let kept = kinds.iter().position(|kind| is_kept(kind, first.context));
            let kept = kept.map(|number| kinds.swap_remove(number));
            kept.or((!kinds.is_empty()).then_some(Kind::InitialRounded))
        }
        _ => in_digits(first.context).into_iter().next(),
    };
    if rounded.is_some() || first.step > 0 {
        return rounded;
    }
    Some(match origin(judged) {
        Origin::Read => Kind::InitialState,
        Origin::Written { in_order: true } => Kind::InitialWritten,
        Origin::Written { in_order: false } | Origin::Open => Kind::InitialOpen,
    })
}

/// Where a wrong initial state comes from, by the state after it.
enum Origin {
    /// The next state follows from it: it is read so.
    Read,
    /// The next state is that of the scene, in its order or in another one.
    Written { in_order: bool },
    /// Neither, or both.
    Open,
}

fn origin(judged: &JudgedScene<'_>) -> Origin {
    let [first, second, ..] = judged.states else { return Origin::Open };
    if judged.has_positions_alone {
        return Origin::Open;
    }
    let numbers = |state: &State| [state.positions.as_slice(), &state.velocities].concat();
    let after = |mut state: State| {
        let mut stepper = Stepper::new(judged.scene, LinearSolver::Auto);
        let State { positions, velocities, .. } = &mut state;
        stepper.step(0, None, positions, velocities).then(|| numbers(&state))
    };
    let mut start = first.clone();
    start.positions = judged.scene.positions();
    start.velocities = judged.scene.velocities();
    let (Some(of_scene), Some(of_trace)) = (after(start), after(first.clone())) else {
        return Origin::Open;
    };
    let got = numbers(second);
    let is_read = same(&got, &of_trace);
    let in_order = same(&got, &of_scene);
    let is_written = in_order || same(&sorted(got), &sorted(of_scene));
    match (is_read, is_written) {
        (true, false) => Origin::Read,
        (false, true) => Origin::Written { in_order },
        _ => Origin::Open,
    }
}

/// The numbers in ascending order.
fn sorted(mut numbers: Vec<f64>) -> Vec<f64> {
    numbers.sort_by(f64::total_cmp);
    numbers
}

/// Whether the states are those of the step before, or their velocities.
fn late(scene: &Scene, context: &[ContextRow]) -> Option<Kind> {
    let axes = scene.dimension.count();
    let pairs = || context.windows(2).filter(|pair| pair[0].step + 1 == pair[1].step);
    let moves = |pair: &&[ContextRow]| !same(&pair[0].expected, &pair[1].expected);
    if pairs().filter(moves).count() < 2 {
        return None;
    }
    if pairs().all(|pair| same(&pair[1].got, &pair[0].expected)) {
        return Some(Kind::Late);
    }
    let of_velocities = |pair: &[ContextRow]| {
        let (position, velocity) = pair[1].got.split_at(axes);
        same(position, &pair[1].expected[..axes]) && same(velocity, &pair[0].expected[axes..])
    };
    let changes =
        |pair: &&[ContextRow]| !same(&pair[0].expected[axes..], &pair[1].expected[axes..]);
    let is_shown = pairs().filter(changes).count() > 1;
    (is_shown && pairs().all(of_velocities)).then_some(Kind::VelocitiesLate)
}

/// The kind of failure of a wrong initial state.
fn in_order(
    judged: &JudgedScene<'_>,
    particle: usize,
    initial: &ContextRow,
    next: Option<&ContextRow>,
) -> Option<Kind> {
    let JudgedScene { scene, states, .. } = judged;
    let ContextRow { expected, got, .. } = initial;
    let axes = scene.dimension.count();
    let swapped: Vec<f64> =
        got.iter().map(|value| f64::from_bits(value.to_bits().swap_bytes())).collect();
    if same(&swapped, expected) {
        return Some(Kind::ByteOrder);
    }
    let of_all = |of: fn(&scene::Particle) -> &[f64; 3]| {
        scene.particles.iter().flat_map(move |particle| of(particle)[..axes].to_vec())
    };
    let state: Vec<f64> = of_all(|particle| &particle.position)
        .chain(of_all(|particle| &particle.velocity))
        .collect();
    let place = |axis: usize| 2 * (axes * particle + axis);
    let singles = (0..axes).all(|axis| {
        let at = place(axis);
        let bits = got[axis].to_bits();
        let halves = [f32::from_bits(bits as u32), f32::from_bits((bits >> 32) as u32)];
        let wanted = state.get(at..at + 2);
        wanted.is_some_and(|wanted| halves[0] == wanted[0] as f32 && halves[1] == wanted[1] as f32)
    });
    let is_shown =
        state.get(place(0)..place(axes)).is_some_and(|all| all.iter().any(|v| *v != 0.0));
    if singles && is_shown {
        return Some(Kind::SingleBytes);
    }
    let negated: Vec<f64> = got.iter().map(|value| -value).collect();
    if same(&negated, expected) {
        return Some(Kind::Negated);
    }
    let is_zero =
        |state: &State| state.positions.iter().chain(&state.velocities).all(|value| *value == 0.0);
    if states.len() > 1 && states.iter().all(is_zero) {
        return Some(Kind::Zeros);
    }
    // States of more particles than the scene has are read at the wrong places.
    if judged.outcome == Outcome::TooLong {
        return None;
    }
    let (position, velocity) = got.split_at(axes);
    if same(position, &expected[..axes]) && velocity.iter().all(|v| *v == 0.0) {
        let fixed = scene.particles.get(particle).is_some_and(|particle| particle.fixed);
        return Some(if fixed { Kind::FixedStopped } else { Kind::InitialVelocity });
    }
    let mass = scene.particles.get(particle).map_or(1.0, |particle| particle.mass);
    let momentum: Vec<f64> = expected[axes..].iter().map(|v| mass * v).collect();
    let is_momentum = same(position, &expected[..axes]) && same(velocity, &momentum);
    if is_momentum && !matches!(origin(judged), Origin::Read) {
        return Some(Kind::Momenta);
    }
    if next.is_some_and(|next| same(got, &next.expected)) {
        return Some(Kind::InitialMissing);
    }
    // Each number of the scene stands in one place.
    let first = states.first().map(|first| [&*first.positions, &first.velocities].concat());
    if first.is_some_and(|first| !same(&sorted(first), &sorted(state.clone()))) {
        return None;
    }
    let mut rest = state;
    let is_taken = |value: &f64| {
        let place = rest.iter().position(|known| same(&[*value], &[*known]));
        place.map(|place| rest.swap_remove(place)).is_some()
    };
    got.iter().all(is_taken).then(|| match origin(judged) {
        Origin::Read => Kind::OrderRead,
        Origin::Written { .. } => Kind::Order,
        Origin::Open => Kind::OrderOpen,
    })
}

/// The forms in which all numbers are the oracle's, rounded: the one with the fewest digits first.
fn in_digits(context: &[ContextRow]) -> Vec<Kind> {
    let pairs = || context.iter().flat_map(|row| row.expected.iter().zip(&row.got));
    let within = |unit: &dyn Fn(f64) -> f64| {
        pairs().all(|(expected, got)| (expected - got).abs() <= 0.51 * unit(*expected))
    };
    let mut kinds = Vec::new();
    let most = |count: fn(f64) -> usize| pairs().map(|(_, got)| count(*got)).max();
    let (Some(digits), Some(decimals)) = (most(digits), most(decimals)) else { return kinds };
    let significant = |value: f64| {
        if value == 0.0 {
            return 0.0;
        }
        10f64.powi(value.abs().log10().floor() as i32 + 1 - digits as i32)
    };
    if digits <= FEW_DIGITS && within(&significant) {
        kinds.push(Kind::Digits(digits));
    }
    if decimals <= FEW_DIGITS && within(&|_| 10f64.powi(-(decimals as i32))) {
        kinds.push(Kind::Decimals(decimals));
    }
    let scale = pairs().fold(0.0, |most: f64, (expected, _)| most.max(expected.abs()));
    let single =
        pairs().all(|(expected, got)| is_single(*got) && (expected - got).abs() <= NEARLY * scale);
    if single && pairs().any(|(expected, _)| f64::from(*expected as f32) != *expected) {
        kinds.push(Kind::Single);
    }
    kinds
}

/// Whether the numbers of all states are written in this form.
fn is_kept(kind: &Kind, context: &[ContextRow]) -> bool {
    let mut all = context.iter().flat_map(|row| &row.got);
    match *kind {
        Kind::Digits(most) => all.all(|value| digits(*value) <= most),
        Kind::Decimals(most) => all.all(|value| decimals(*value) <= most),
        _ => all.all(|value| is_single(*value)),
    }
}

/// Decimals of the shortest decimal that reads back to the same f64.
fn decimals(value: f64) -> usize {
    format!("{value}").split_once('.').map_or(0, |(_, behind)| behind.len())
}

/// Whether numbers are equal up to the order of operations.
pub(super) fn same(a: &[f64], b: &[f64]) -> bool {
    let scale = largest(b);
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME * scale)
}

pub(super) fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, value| most.max(value.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(values: &[(f64, f64)]) -> Vec<ContextRow> {
        let (expected, got) = values.iter().copied().unzip();
        vec![ContextRow { step: 3, expected, got }]
    }

    #[test]
    fn rounded_numbers_are_recognized_by_their_digits() {
        let kind = |values: &[(f64, f64)]| in_digits(&rows(values)).into_iter().next();
        let (a, b) = (22.0 / 7.0, 1e3 / 7.0);
        assert_eq!(kind(&[(a, 3.14286), (b, 142.857)]), Some(Kind::Digits(6)));
        assert_eq!(kind(&[(a, 3.142857), (b, 142.857143)]), Some(Kind::Decimals(6)));
        assert_eq!(kind(&[(a, f64::from(a as f32)), (b, f64::from(b as f32))]), Some(Kind::Single));
        // The shortest decimals that read back to the same f32.
        assert_eq!(kind(&[(a, 3.1428573), (b, 142.85715)]), Some(Kind::Single));
        // Short numbers that differ from the oracle's, and long ones that are almost equal.
        assert_eq!(kind(&[(a, 3.25), (b, 142.5)]), None);
        assert_eq!(kind(&[(a, a + 1e-9), (b, b)]), None);
    }
}
