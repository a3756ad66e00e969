//! Findings on blocks and properties of a force.

use super::states::CheckState;
use jacobian::ridders::Estimate;
use jacobian::verdict::{Entry, Verdict};

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
