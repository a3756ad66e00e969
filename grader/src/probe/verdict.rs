//! From a number, what it should be and a bound, to a verdict.
//!
//! ```text
//! |measured − expected| ≤ bound              correct, if the bound is narrow enough to tell
//! |measured − expected| > CLEAR · bound      wrong
//! otherwise                                  inconclusive
//! ```
//!
//! over all entries of a block: one that is clearly wrong makes the block wrong, however large the others.

use simulator::scene::Dimension;

use super::noise::{CLEAR, TOO_WIDE};

/// What is said of one thing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// It is what it should be, within a bound that would show a mistake.
    Correct,
    /// The program does not have it. No fault.
    NotOffered,
    /// It could not be told.
    Inconclusive,
    /// It is not what it should be, far beyond all noise.
    Wrong,
}

impl Verdict {
    /// Its name: stable, in lower case, fit for machines.
    pub fn name(self) -> &'static str {
        match self {
            Self::Correct => "correct",
            Self::NotOffered => "not-offered",
            Self::Inconclusive => "inconclusive",
            Self::Wrong => "wrong",
        }
    }
}

/// A verdict with what it rests on.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The verdict.
    pub verdict: Verdict,
    /// Why, where the verdict needs it.
    pub reason: String,
    /// Largest difference over all entries, relative to the largest entry; `None` where nothing was compared.
    pub error: Option<f64>,
    /// The widest bound of an entry, relative to the largest entry: what could not be seen is below it.
    pub bound: Option<f64>,
    /// The entry whose difference is the most times its bound.
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
    /// What the program has.
    pub measured: f64,
    /// What it should have: by its own force for a Jacobian, ours for a force.
    pub expected: f64,
    /// What we have.
    pub ours: f64,
    /// How far the two may be apart by noise alone.
    pub bound: f64,
    /// The block that holds it, `D × D`, row by row: measured, then expected; `None` for a force.
    pub block: Option<[Vec<f64>; 2]>,
}

impl Finding {
    /// Without a comparison.
    pub(super) fn only(verdict: Verdict, reason: impl Into<String>) -> Self {
        Self { verdict, reason: reason.into(), error: None, bound: None, worst: None }
    }

    /// What the entries come to; `scale` is the size of the largest that there are.
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
            (
                Verdict::Inconclusive,
                "the program's numbers are too noisy to say anything".to_owned(),
            )
        } else if times > CLEAR {
            (Verdict::Wrong, String::new())
        } else if times > 1.0 {
            let reason =
                format!("off by {times:.1} times the bound of noise: too little to be sure");
            (Verdict::Inconclusive, reason)
        } else if bound > TOO_WIDE {
            let reason = format!("a difference below {bound:.0e} would be lost in the noise");
            (Verdict::Inconclusive, reason)
        } else {
            (Verdict::Correct, String::new())
        };
        let worst = worst.map(|(_, entry)| entry);
        Self { verdict, reason, error: Some(error), bound: Some(bound), worst }
    }
}

/// What was found about one part of a force.
#[derive(Debug, Clone, PartialEq)]
pub struct PartReport {
    /// The force's tag.
    pub force: &'static str,
    /// The part's name: `all`, `elastic`, `damping`, ….
    pub part: &'static str,
    /// What the part is.
    pub meaning: &'static str,
    /// The space it was measured in.
    pub dimension: Dimension,
    /// The program's force against ours.
    pub force_finding: Finding,
    /// Whether the implicit step is `(M − A) δ = h F` with `A = h² K + h B`, whatever the Jacobians.
    pub step: Finding,
    /// The Jacobian against differences of the program's own force, by quantity and block, as
    /// [`Block::ALL`] has them.
    pub blocks: [Finding; 4],
    /// What the mistake looks like.
    pub diagnosis: Vec<String>,
    /// The scenes that show what was found, where something is not correct.
    pub replay: Option<Replay>,
}

/// Scenes to run again.
#[derive(Debug, Clone, PartialEq)]
pub struct Replay {
    /// Number of the state.
    pub state: usize,
    /// An explicit step of 1 s at the state, with each combination of masses: shows the force.
    pub explicit: String,
    /// An implicit step that evaluates everything at that state; empty where none was taken.
    pub implicit: String,
}

/// Which of the Jacobian's blocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Block {
    /// ∂F/∂x, a particle's force by its own position.
    PositionDirect,
    /// ∂F/∂x, a particle's force by another's position.
    PositionCross,
    /// ∂F/∂v, a particle's force by its own velocity.
    VelocityDirect,
    /// ∂F/∂v, a particle's force by another's velocity.
    VelocityCross,
}

impl Block {
    /// Every block, in the order of [`PartReport::blocks`].
    pub const ALL: [Self; 4] =
        [Self::PositionDirect, Self::PositionCross, Self::VelocityDirect, Self::VelocityCross];

    /// What reports call it.
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

    /// Whether the entry at these particles belongs to it.
    pub(super) fn holds(self, row: usize, column: usize) -> bool {
        let direct = matches!(self, Self::PositionDirect | Self::VelocityDirect);
        direct == (row == column)
    }
}

impl PartReport {
    /// All of its findings with their names.
    pub fn findings(&self) -> impl Iterator<Item = (&'static str, &Finding)> {
        let blocks = Block::ALL.into_iter().map(Block::name).zip(&self.blocks);
        [("force", &self.force_finding), ("step", &self.step)].into_iter().chain(blocks)
    }

    /// The gravest of its verdicts.
    pub fn verdict(&self) -> Verdict {
        let verdicts = self.findings().map(|(_, finding)| finding.verdict);
        verdicts.max().unwrap_or(Verdict::NotOffered)
    }
}
