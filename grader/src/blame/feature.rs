//! Features of a simulator that can cause failures.

use std::fmt;

/// A part of a simulator that may be wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Feature {
    /// The value of a force.
    Force(Part),
    /// The derivatives of a force, where an implicit method uses them.
    Jacobian(Part),
    /// A time-stepping method, by its name.
    Integrator(&'static str),
    /// The treatment of fixed particles.
    Fixed(Family),
    /// The reading of scenes.
    Reading,
    /// The number of states in a trace.
    States,
    /// The form of traces, or where they are written.
    Output,
    /// The precision of the computation or of the output.
    Precision,
    /// Something that all scenes need.
    Everything,
}

impl fmt::Display for Feature {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Force(part) => write!(f, "{part}"),
            Self::Jacobian(part) => write!(f, "{part}, its Jacobians"),
            Self::Integrator(name) => write!(f, "integrator {name}"),
            Self::Fixed(Family::Any) => write!(f, "fixed particles"),
            Self::Fixed(family) => write!(f, "fixed particles under {family} methods"),
            Self::Reading => write!(f, "reading the scene"),
            Self::States => write!(f, "the number of states"),
            Self::Output => write!(f, "the output"),
            Self::Precision => write!(f, "the precision"),
            Self::Everything => write!(f, "something common to all scenes"),
        }
    }
}

/// The way a mistake shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Symptom {
    /// Wrong traces.
    Wrong,
    /// Crashes.
    Crash,
    /// Runs that do not end.
    TimeOut,
    /// Too much memory.
    Memory,
}

impl Symptom {
    /// All.
    pub const ALL: [Self; 4] = [Self::Wrong, Self::Crash, Self::TimeOut, Self::Memory];

    /// The machine-readable name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Wrong => "wrong",
            Self::Crash => "crash",
            Self::TimeOut => "time-out",
            Self::Memory => "memory",
        }
    }
}

impl fmt::Display for Symptom {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Wrong => "wrong traces",
            Self::Crash => "crashes",
            Self::TimeOut => "does not end",
            Self::Memory => "takes too much memory",
        })
    }
}

/// A force, or a part of one that can occur in a scene without the rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Part {
    /// A whole force, by its tag.
    All(&'static str),
    /// The springs' pull, `−k (l − l0) n`.
    Elastic,
    /// The springs' damping, `−b n·(v_i − v_j) n`.
    Damping,
}

impl Part {
    /// The tag of the force.
    pub fn tag(self) -> &'static str {
        match self {
            Self::All(tag) => tag,
            Self::Elastic | Self::Damping => "springforce",
        }
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::All(tag) => f.write_str(tag),
            Self::Elastic => f.write_str("springforce: elastic force"),
            Self::Damping => f.write_str("springforce: damping"),
        }
    }
}

/// Methods with the same treatment of fixed particles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Family {
    /// All of them.
    Any,
    /// Methods that solve no system.
    Explicit,
    /// Methods that solve a system.
    Implicit,
}

impl fmt::Display for Family {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Any => "all",
            Self::Explicit => "explicit",
            Self::Implicit => "implicit",
        })
    }
}
