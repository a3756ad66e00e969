//! Verdict on a measured number, given its expected value and an error bound.
//!
//! ```text
//! |measured − expected| ≤ bound              correct, if the bound is narrow enough
//! |measured − expected| > CLEAR · bound      wrong
//! otherwise                                  inconclusive
//! ```
//!
//! over all entries of a block. One clearly wrong entry makes the block wrong.

use scene::Dimension;

use super::noise::{CLEAR, TOO_WIDE};

/// Verdict on a force, a step or a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// The value is right, within a bound that would show a mistake.
    Correct,
    /// The program does not offer it. Not a failure.
    NotOffered,
    /// The measurement does not decide.
    Inconclusive,
    /// The value is wrong, far beyond all noise.
    Wrong,
}

impl Verdict {
    /// The stable machine-readable name, in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Correct => "correct",
            Self::NotOffered => "not-offered",
            Self::Inconclusive => "inconclusive",
            Self::Wrong => "wrong",
        }
    }
}

/// A verdict with its evidence.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The verdict.
    pub verdict: Verdict,
    /// The reason, if the verdict needs one.
    pub reason: String,
    /// Largest difference over all entries, relative to the largest entry; `None` if nothing was compared.
    pub error: Option<f64>,
    /// The widest bound of an entry, relative to the largest entry: smaller errors are invisible.
    pub bound: Option<f64>,
    /// The entry with the largest difference as a multiple of its bound.
    pub worst: Option<Entry>,
}

/// One number, measured and expected.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Number of the state.
    pub state: usize,
    /// Particle and axis of the force.
    pub row: (usize, usize),
    /// Particle and axis of the position or velocity; `None` for a force.
    pub column: Option<(usize, usize)>,
    /// The program's value.
    pub measured: f64,
    /// The expected value: for a Jacobian, from the program's own force, or ours where that is right and the force is
    /// not; ours for a force.
    pub expected: f64,
    /// Our value.
    pub ours: f64,
    /// Bound on the difference that noise alone may cause.
    pub bound: f64,
    /// The block that holds it, `D × D`, row by row: measured, expected, ours; `None` for a force.
    pub block: Option<[Vec<f64>; 3]>,
}

impl Finding {
    /// A finding without a comparison.
    pub(super) fn only(verdict: Verdict, reason: impl Into<String>) -> Self {
        Self { verdict, reason: reason.into(), error: None, bound: None, worst: None }
    }

    /// The finding on what a wrong program does not show.
    pub(super) fn not_measured(because: &str) -> Self {
        Self::only(Verdict::Inconclusive, format!("could not be measured, because {because}"))
    }

    /// The finding about these entries; `scale` is the size of the largest one.
    pub(super) fn of(entries: impl Iterator<Item = Entry>, scale: f64) -> Self {
        let (mut error, mut bound): (f64, f64) = (0.0, 0.0);
        let mut worst: Option<(f64, Entry)> = None;
        let mut sound = true;
        for entry in entries {
            let difference = (entry.measured - entry.expected).abs();
            let times = difference / entry.bound;
            sound &= times.is_finite() && entry.bound.is_finite();
            error = error.max(difference / scale);
            bound = bound.max(entry.bound / scale);
            if worst.as_ref().is_none_or(|(most, _)| times > *most) {
                worst = Some((times, entry));
            }
        }
        let times = worst.as_ref().map_or(f64::NAN, |(times, _)| *times);
        let (verdict, reason) = if !sound || times.is_nan() {
            (Verdict::Inconclusive, "the program's numbers are too noisy for a verdict".to_owned())
        } else if times > CLEAR {
            (Verdict::Wrong, String::new())
        } else if times > 1.0 {
            let reason =
                format!("the error is {times:.1} times the noise bound: too small for a verdict");
            (Verdict::Inconclusive, reason)
        } else if bound > TOO_WIDE {
            let reason = format!("noise would hide an error below {bound:.0e}");
            (Verdict::Inconclusive, reason)
        } else {
            (Verdict::Correct, String::new())
        };
        let worst = worst.map(|(_, entry)| entry);
        Self { verdict, reason, error: Some(error), bound: Some(bound), worst }
    }
}

/// The findings about one part of a force.
#[derive(Debug, Clone, PartialEq)]
pub struct PartReport {
    /// The force's tag.
    pub force: &'static str,
    /// The part's name: `all`, `elastic`, `damping`, ….
    pub part: &'static str,
    /// The part's description.
    pub meaning: &'static str,
    /// The space it was measured in.
    pub dimension: Dimension,
    /// The program's force against ours.
    pub force_finding: Finding,
    /// Whether the implicit step has the form `(M − A) δ = h F` with `A = h² K + h B`, whatever the Jacobians.
    pub step: Finding,
    /// The Jacobian against differences of the program's own force, or against that of the right force if it is the one
    /// and the program's force is wrong: by quantity and block, as [`Block::ALL`] has them.
    pub blocks: [Finding; 4],
    /// Likely mistakes.
    pub diagnosis: Vec<String>,
    /// The scenes that reproduce the findings, if something is not correct.
    pub replay: Option<Replay>,
}

/// Scenes that reproduce a finding.
#[derive(Debug, Clone, PartialEq)]
pub struct Replay {
    /// Number of the state.
    pub state: usize,
    /// An explicit step of 1 s at the state, with each combination of masses: reveals the force.
    pub explicit: String,
    /// An implicit step that evaluates everything at that state; empty if none was taken.
    pub implicit: String,
}

/// A block of the Jacobian.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Block {
    /// ∂F/∂x: a particle's force by its own position.
    PositionDirect,
    /// ∂F/∂x: a particle's force by another one's position.
    PositionCross,
    /// ∂F/∂v: a particle's force by its own velocity.
    VelocityDirect,
    /// ∂F/∂v: a particle's force by another one's velocity.
    VelocityCross,
}

impl Block {
    /// Every block, in the order of [`PartReport::blocks`].
    pub const ALL: [Self; 4] =
        [Self::PositionDirect, Self::PositionCross, Self::VelocityDirect, Self::VelocityCross];

    /// The name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::PositionDirect => "dF/dx direct",
            Self::PositionCross => "dF/dx cross",
            Self::VelocityDirect => "dF/dv direct",
            Self::VelocityCross => "dF/dv cross",
        }
    }

    /// Whether it is a derivative by the positions.
    pub(super) fn is_by_position(self) -> bool {
        matches!(self, Self::PositionDirect | Self::PositionCross)
    }

    /// Whether it contains the entry of these particles.
    pub(crate) fn holds(self, row: usize, column: usize) -> bool {
        let direct = matches!(self, Self::PositionDirect | Self::VelocityDirect);
        direct == (row == column)
    }
}

impl PartReport {
    /// All findings with their names.
    pub fn findings(&self) -> impl Iterator<Item = (&'static str, &Finding)> {
        let blocks = Block::ALL.into_iter().map(Block::name).zip(&self.blocks);
        [("force", &self.force_finding), ("step", &self.step)].into_iter().chain(blocks)
    }

    /// The most severe of its verdicts.
    pub fn verdict(&self) -> Verdict {
        let verdicts = self.findings().map(|(_, finding)| finding.verdict);
        verdicts.max().unwrap_or(Verdict::NotOffered)
    }

    /// Whether all that is wrong is the implicit step as a whole, for no known reason: that is no mistake of the force.
    pub fn is_step_alone(&self) -> bool {
        let others = self.blocks.iter().chain([&self.force_finding]);
        self.step.verdict == Verdict::Wrong
            && self.diagnosis.is_empty()
            && others.into_iter().all(|finding| finding.verdict != Verdict::Wrong)
    }

    /// Takes back what is called wrong: of the force and what implicit steps measure, or of that alone.
    pub fn take_back(&mut self, with_force: bool, because: &str) {
        self.take_back_of(with_force, [true; Block::ALL.len()], true, because);
    }

    /// Takes back what is called wrong of the force, of these blocks in the order of [`Block::ALL`] and of the step.
    pub fn take_back_of(
        &mut self,
        force: bool,
        blocks: [bool; Block::ALL.len()],
        step: bool,
        because: &str,
    ) {
        let blocks = self.blocks.iter_mut().zip(blocks);
        let others = [(&mut self.step, step), (&mut self.force_finding, force)];
        let mut is_taken = false;
        for (finding, is_meant) in blocks.chain(others) {
            if is_meant && finding.verdict == Verdict::Wrong {
                *finding = Finding::not_measured(because);
                is_taken = true;
            }
        }
        if is_taken {
            self.diagnosis.clear();
        }
    }
}
