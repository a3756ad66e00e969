//! Verdict on a Jacobian: correct, wrong, or inconclusive for a reason.

use super::states::CheckState;
use jacobian::ridders::{Difference, Estimate};
use jacobian::taylor::Taylor;

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
}

/// The variable of a derivative.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum By {
    /// Positions: `∂F/∂x`.
    Position,
    /// Velocities: `∂F/∂v`.
    Velocity,
}

/// A block's position in the Jacobian.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Part {
    /// A particle's force by its own coordinates: block `(a, a)`.
    Direct,
    /// A particle's force by another one's coordinates: block `(a, b)`.
    Cross,
}

/// A kind of block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct BlockKind {
    /// By position or velocity.
    pub by: By,
    /// Direct or cross.
    pub part: Part,
}

impl BlockKind {
    /// All four, in the order of the reports.
    pub const ALL: [Self; 4] = [
        Self { by: By::Position, part: Part::Direct },
        Self { by: By::Position, part: Part::Cross },
        Self { by: By::Velocity, part: Part::Direct },
        Self { by: By::Velocity, part: Part::Cross },
    ];

    /// The name in reports.
    pub fn name(self) -> &'static str {
        match (self.by, self.part) {
            (By::Position, Part::Direct) => "dF/dx direct",
            (By::Position, Part::Cross) => "dF/dx cross",
            (By::Velocity, Part::Direct) => "dF/dv direct",
            (By::Velocity, Part::Cross) => "dF/dv cross",
        }
    }
}

/// The result for one kind of block.
#[derive(Debug, Clone, PartialEq)]
pub struct BlockFinding {
    /// The kind of block.
    pub kind: BlockKind,
    /// The verdict.
    pub verdict: Verdict,
    /// Number of states at which the block was nonzero and could be judged.
    pub evidence: usize,
    /// Number of states at which an entry could not be judged.
    pub undecided: usize,
    /// Parameters that must affect the block, but did so at no state.
    pub unseen: Vec<&'static str>,
    /// The state that supports the verdict: the worst contradiction, or the largest error.
    pub exhibit: Option<Box<Exhibit>>,
}

/// One block at one state with all measurements.
#[derive(Debug, Clone, PartialEq)]
pub struct Exhibit {
    /// The state.
    pub state: CheckState,
    /// The particle whose force is differentiated.
    pub row: usize,
    /// The particle whose position or velocity varies.
    pub column: usize,
    /// Its entries, row by row.
    pub entries: Vec<Entry>,
    /// Index of the worst entry.
    pub worst: usize,
    /// The largest entry of the block by the most accurate estimate: the reference of relative errors.
    pub size: f64,
}

impl Exhibit {
    /// The worst entry.
    pub fn worst_entry(&self) -> &Entry {
        &self.entries[self.worst]
    }

    /// Error of the worst entry and its uncertainty, relative to the block's largest entry.
    pub fn relative_error(&self) -> Estimate {
        let Estimate { value, uncertainty } = self.worst_entry().error();
        let size = if self.size > 0.0 { self.size } else { 1.0 };
        Estimate { value: value / size, uncertainty: uncertainty / size }
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
    /// The derivative by dual numbers; `None` if the subject's force is not the law's.
    pub dual: Option<Estimate>,
    /// The result of Taylor's test.
    pub taylor: Taylor,
}

/// The combined judgement of the estimates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Judgement {
    Agrees,
    Wrong,
    Undecided(Reason),
}

/// Ratio of a difference to the combined uncertainties above which it is a contradiction.
const CLEAR: f64 = 8.0;

impl Entry {
    /// The estimate with the smallest uncertainty, of differences and dual numbers.
    pub fn sharpest(&self) -> Option<Estimate> {
        let smaller = |a: Estimate, b: Estimate| if b.uncertainty < a.uncertainty { b } else { a };
        self.values().into_iter().flatten().reduce(smaller)
    }

    /// Difference between the entry and the finite differences (dual numbers if there are none), with its uncertainty.
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
    pub(super) fn excess(&self) -> f64 {
        if !self.analytic.is_finite() {
            return f64::INFINITY;
        }
        let ratio = |estimate: Estimate| {
            let error = (self.analytic - estimate.value).abs();
            if error == 0.0 { 0.0 } else { error / (estimate.uncertainty + self.rounding) }
        };
        self.values().into_iter().flatten().map(ratio).fold(0.0, f64::max)
    }

    pub(super) fn judge(&self) -> Judgement {
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
        [difference, self.dual]
    }
}

/// A property of the whole with its verdict.
#[derive(Debug, Clone, PartialEq)]
pub struct PropertyFinding {
    /// The property.
    pub property: Property,
    /// The verdict.
    pub verdict: Verdict,
    /// Number of states at which it could be observed.
    pub evidence: usize,
    /// The largest violation with its uncertainty, relative to the size of the compared values.
    pub error: Option<Estimate>,
    /// The state of that violation.
    pub state: Option<Box<CheckState>>,
}

/// Properties of a force other than its derivatives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Property {
    /// The force is the law's.
    Force,
    /// `∂F/∂x` is symmetric where the force has an energy, and both are where the couplings say so.
    Symmetry,
    /// Rows sum to zero: internal forces do not change when all particles move alike.
    Translation,
    /// `J(Rx) = R J(x) Rᵀ`, and `F(Rx) = R F(x)`.
    Rotation,
    /// Blocks outside the couplings are exactly zero, and the couplings are the law's.
    Stencil,
    /// `F = −∇U`.
    Gradient,
    /// `∂F/∂x = −∇²U`.
    Hessian,
    /// The projection of an element's Hessian is the nearest semi-definite matrix.
    Projection,
}

impl Property {
    /// All, in the order of the reports.
    pub const ALL: [Self; 8] = [
        Self::Force,
        Self::Symmetry,
        Self::Translation,
        Self::Rotation,
        Self::Stencil,
        Self::Gradient,
        Self::Hessian,
        Self::Projection,
    ];

    /// The name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Force => "force",
            Self::Symmetry => "symmetry",
            Self::Translation => "translation",
            Self::Rotation => "rotation",
            Self::Stencil => "stencil",
            Self::Gradient => "gradient",
            Self::Hessian => "hessian",
            Self::Projection => "projection",
        }
    }

    /// The statement of the property.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Force => "the force follows the documented formula",
            Self::Symmetry => "symmetric where there is an energy",
            Self::Translation => "rows sum to zero",
            Self::Rotation => "rotates with the scene",
            Self::Stencil => "zero outside the couplings",
            Self::Gradient => "F = -grad U",
            Self::Hessian => "dF/dx = -Hessian of U",
            Self::Projection => "the nearest semi-definite matrix",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jacobian::taylor::Window;

    fn estimate(value: f64, uncertainty: f64) -> Estimate {
        Estimate { value, uncertainty }
    }

    fn entry(
        analytic: f64,
        difference: Difference,
        dual: Option<Estimate>,
        taylor: Taylor,
    ) -> Entry {
        Entry { analytic, rounding: 1e-14, difference, dual, taylor }
    }

    const WINDOW: Window = Window { slope: 1.0, steps: (1e-8, 1e-4), count: 12 };

    #[test]
    fn wrong_needs_two_agreeing_estimates() {
        let smooth = |value| Difference::Smooth(estimate(value, 1e-12));
        let dual = |value| Some(estimate(value, 1e-15));
        let right = Taylor::Consistent(Window { slope: 2.0, ..WINDOW });
        let wrong = Taylor::Wrong(WINDOW);
        let off = 1.0 + 1e-6;
        use Judgement::{Agrees, Undecided, Wrong};
        let cases = [
            (entry(1.0, smooth(1.0), dual(1.0), right), Agrees),
            (entry(off, smooth(1.0), dual(1.0), wrong), Wrong),
            (entry(off, smooth(1.0), dual(1.0), Taylor::Undecided), Wrong),
            (entry(off, smooth(1.0), None, wrong), Wrong),
            (entry(off, Difference::Unavailable, dual(1.0), wrong), Wrong),
            // A single contradiction is not enough, and neither are two that contradict each other.
            (entry(off, smooth(1.0), dual(off), right), Undecided(Reason::Disagreement)),
            (entry(off, smooth(1.0), None, right), Undecided(Reason::Disagreement)),
            (entry(off, smooth(1.0), dual(2.0), right), Undecided(Reason::Disagreement)),
            (entry(1.0, smooth(1.0), dual(1.0), wrong), Undecided(Reason::Disagreement)),
            (entry(off, smooth(1.0), dual(off), wrong), Undecided(Reason::Disagreement)),
            // Without an estimate nothing is correct.
            (entry(1.0, Difference::Unavailable, None, right), Undecided(Reason::Cancellation)),
            (entry(1.0, Difference::Kink, dual(1.0), right), Undecided(Reason::Kink)),
            (entry(f64::NAN, smooth(1.0), dual(1.0), Taylor::Undecided), Wrong),
            (entry(f64::INFINITY, smooth(1.0), dual(1.0), Taylor::Undecided), Wrong),
            // An estimate with infinite uncertainty contradicts nothing.
            (
                entry(off, Difference::Smooth(estimate(1.0, 1.0)), dual(off), Taylor::Undecided),
                Agrees,
            ),
        ];
        for (entry, expected) in cases {
            assert_eq!(entry.judge(), expected, "{entry:?}");
        }
    }
}
