//! Verdict on a Jacobian: correct, wrong, or inconclusive for a reason; and the judgement of one entry by its estimates.

use crate::ridders::{Difference, Estimate};
use crate::taylor::Taylor;

/// Bound on the rounding error of a value, relative to the sum of the sizes of its terms, in any sensible order of
/// operations: thirty-two roundings.
pub const ROUNDING: f64 = 32.0 * f64::EPSILON;

/// A verdict on a block, a property or a matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Verdict {
    /// It agrees wherever it is nonzero, and is contradicted nowhere.
    Correct,
    /// It is zero, as it must be, at states with a nonzero force.
    CorrectZero,
    /// At least two estimates contradict it and agree with each other.
    Wrong,
    /// Neither could be shown.
    Inconclusive(Reason),
    /// The property does not apply to this force.
    NotApplicable,
}

/// Why a check is inconclusive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Reason {
    /// The estimates contradict each other.
    Disagreement,
    /// The force has a kink at the state.
    Kink,
    /// The force is undefined there: the state is degenerate.
    Degenerate,
    /// Rounding errors exceed the digits to compare.
    Cancellation,
    /// The term vanished at every state, or there was no state.
    NoEvidence,
}

impl Verdict {
    /// Whether it counts as correct.
    pub fn is_correct(self) -> bool {
        matches!(self, Self::Correct | Self::CorrectZero | Self::NotApplicable)
    }

    /// The name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Correct => "correct",
            Self::CorrectZero => "correct-zero",
            Self::Wrong => "wrong",
            Self::Inconclusive(_) => "inconclusive",
            Self::NotApplicable => "not-applicable",
        }
    }

    /// The reason, if it is inconclusive.
    pub fn reason(self) -> Option<Reason> {
        if let Self::Inconclusive(reason) = self { Some(reason) } else { None }
    }
}

impl Reason {
    /// The name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Disagreement => "disagreement",
            Self::Kink => "kink",
            Self::Degenerate => "degenerate",
            Self::Cancellation => "cancellation",
            Self::NoEvidence => "no-evidence",
        }
    }

    /// Its meaning in words.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Disagreement => "the estimates contradict each other",
            Self::Kink => "the function has a kink or a jump there",
            Self::Degenerate => "the function has no value there",
            Self::Cancellation => "the noise of the function hides the entry",
            Self::NoEvidence => "there was no state",
        }
    }
}

/// One entry of a Jacobian with all estimates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Entry {
    /// The subject's own value.
    pub analytic: f64,
    /// Bound on its rounding error for any correct formula.
    pub rounding: f64,
    /// The derivative by differences of the subject's force.
    pub difference: Difference,
    /// An independent estimate: by dual numbers of the law, or by differences at other steps.
    pub second: Option<Estimate>,
    /// The result of Taylor's test.
    pub taylor: Taylor,
}

/// The combined judgement of the estimates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Judgement {
    /// It agrees with an estimate, and contradicts none.
    Agrees,
    /// Two estimates contradict it.
    Wrong,
    /// Neither.
    Undecided(Reason),
}

/// Ratio of a difference to the combined uncertainties above which it is a contradiction.
pub const CLEAR: f64 = 8.0;

impl Entry {
    /// The estimate with the smallest uncertainty, of the two.
    pub fn sharpest(&self) -> Option<Estimate> {
        let smaller = |a: Estimate, b: Estimate| if b.uncertainty < a.uncertainty { b } else { a };
        self.values().into_iter().flatten().reduce(smaller)
    }

    /// Difference between the entry and the finite differences, with its uncertainty; where these have no value, that between
    /// the entry and the second estimate.
    /// Not finite if the entry is not.
    pub fn error(&self) -> Estimate {
        match self.values().into_iter().flatten().next() {
            Some(Estimate { value, uncertainty }) => Estimate {
                value: (self.analytic - value).abs(),
                uncertainty: uncertainty + self.rounding,
            },
            None => Estimate { value: f64::NAN, uncertainty: f64::INFINITY },
        }
    }

    /// Largest difference from any estimate, in terms of the combined uncertainties.
    pub fn excess(&self) -> f64 {
        if !self.analytic.is_finite() {
            return f64::INFINITY;
        }
        let ratio = |estimate: Estimate| {
            let error = (self.analytic - estimate.value).abs();
            if error == 0.0 { 0.0 } else { error / (estimate.uncertainty + self.rounding) }
        };
        self.values().into_iter().flatten().map(ratio).fold(0.0, f64::max)
    }

    /// Judges the entry by its estimates.
    pub fn judge(&self) -> Judgement {
        if self.difference == Difference::Kink {
            return Judgement::Undecided(Reason::Kink);
        }
        if !self.analytic.is_finite() {
            return Judgement::Wrong;
        }
        let off = |estimate: Estimate, times: f64| {
            let error = (self.analytic - estimate.value).abs();
            error > times * (estimate.uncertainty + self.rounding)
        };
        let values = self.values();
        let opinions = || values.iter().flatten().copied();
        let by_value = opinions().filter(|estimate| off(*estimate, CLEAR)).count();
        let against = by_value + usize::from(matches!(self.taylor, Taylor::Wrong(_)));
        let agree = opinions().filter(|estimate| !off(*estimate, 1.0)).count();
        let same = match values {
            [Some(first), Some(second)] => {
                let apart = (first.value - second.value).abs();
                apart <= CLEAR * (first.uncertainty + second.uncertainty)
            }
            _ => true,
        };
        match (against, agree) {
            (2.., 0) if by_value < 2 || same => Judgement::Wrong,
            (1.., _) => Judgement::Undecided(Reason::Disagreement),
            (0, 0) => Judgement::Undecided(Reason::Cancellation),
            (0, _) => Judgement::Agrees,
        }
    }

    fn values(&self) -> [Option<Estimate>; 2] {
        let difference = match self.difference {
            Difference::Smooth(estimate) => Some(estimate),
            Difference::Kink | Difference::Unavailable => None,
        };
        [difference, self.second]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::taylor::Window;

    fn estimate(value: f64, uncertainty: f64) -> Estimate {
        Estimate { value, uncertainty }
    }

    fn entry(
        analytic: f64,
        difference: Difference,
        second: Option<Estimate>,
        taylor: Taylor,
    ) -> Entry {
        Entry { analytic, rounding: 1e-14, difference, second, taylor }
    }

    const WINDOW: Window = Window { slope: 1.0, steps: (1e-8, 1e-4), count: 12 };

    #[test]
    fn wrong_needs_two_agreeing_estimates() {
        let smooth = |value| Difference::Smooth(estimate(value, 1e-12));
        let second = |value| Some(estimate(value, 1e-15));
        let right = Taylor::Consistent(Window { slope: 2.0, ..WINDOW });
        let wrong = Taylor::Wrong(WINDOW);
        let off = 1.0 + 1e-6;
        use Judgement::{Agrees, Undecided, Wrong};
        let cases = [
            (entry(1.0, smooth(1.0), second(1.0), right), Agrees),
            (entry(off, smooth(1.0), second(1.0), wrong), Wrong),
            (entry(off, smooth(1.0), second(1.0), Taylor::Undecided), Wrong),
            (entry(off, smooth(1.0), None, wrong), Wrong),
            (entry(off, Difference::Unavailable, second(1.0), wrong), Wrong),
            // A single contradiction is not enough, and neither are two that contradict each other.
            (entry(off, smooth(1.0), second(off), right), Undecided(Reason::Disagreement)),
            (entry(off, smooth(1.0), None, right), Undecided(Reason::Disagreement)),
            (entry(off, smooth(1.0), second(2.0), right), Undecided(Reason::Disagreement)),
            (entry(1.0, smooth(1.0), second(1.0), wrong), Undecided(Reason::Disagreement)),
            (entry(off, smooth(1.0), second(off), wrong), Undecided(Reason::Disagreement)),
            // Without an estimate nothing is correct.
            (entry(1.0, Difference::Unavailable, None, right), Undecided(Reason::Cancellation)),
            (entry(1.0, Difference::Kink, second(1.0), right), Undecided(Reason::Kink)),
            (entry(f64::NAN, smooth(1.0), second(1.0), Taylor::Undecided), Wrong),
            (entry(f64::INFINITY, smooth(1.0), second(1.0), Taylor::Undecided), Wrong),
            // An estimate with infinite uncertainty contradicts nothing.
            (
                entry(off, Difference::Smooth(estimate(1.0, 1.0)), second(off), Taylor::Undecided),
                Agrees,
            ),
        ];
        for (entry, expected) in cases {
            assert_eq!(entry.judge(), expected, "{entry:?}");
        }
    }
}
