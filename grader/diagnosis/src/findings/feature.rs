//! Features of a simulator that can cause failures.

use std::fmt;

use crate::change::Task;
use scene::ForceElement;
use scene::schema::{Dependence, ForceSchema};
use simulator::force;

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
    /// A task of the hand-out on rounds of local and global steps.
    Task(Task),
    /// The reading of scenes.
    Reading,
    /// The functions on vectors that forces share.
    Helpers,
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
            Self::Task(task) => write!(f, "{task}"),
            Self::Reading => write!(f, "reading the scene"),
            Self::Helpers => write!(f, "functions on vectors"),
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
    /// An error that the program reports, and ends.
    Error,
    /// Runs that do not end.
    TimeOut,
    /// Too much memory.
    Memory,
}

impl Symptom {
    /// All.
    pub const ALL: [Self; 5] = [Self::Wrong, Self::Crash, Self::Error, Self::TimeOut, Self::Memory];

    /// The machine-readable name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Wrong => "wrong",
            Self::Crash => "crash",
            Self::Error => "error",
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
            Self::Error => "ends with an error message",
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
    /// A part of a force, by the force's tag and the part's name.
    One(&'static str, &'static str),
}

impl Part {
    /// The parts of a force: each by itself where they stand alone, or the force as a whole.
    pub fn of(schema: &'static ForceSchema) -> Vec<Self> {
        match schema.is_separable() {
            true => schema.parts.iter().map(|part| Self::One(schema.tag, part.name)).collect(),
            false => vec![Self::All(schema.tag)],
        }
    }

    /// The tag of the force.
    pub fn tag(self) -> &'static str {
        match self {
            Self::All(tag) | Self::One(tag, _) => tag,
        }
    }

    /// The force.
    ///
    /// # Panics
    /// Where no force of the registry has this tag.
    pub fn schema(self) -> &'static ForceSchema {
        let mut kinds = force::REGISTRY.iter();
        let kind = kinds.find(|kind| kind.schema.tag == self.tag());
        &kind.unwrap_or_else(|| panic!("{} is no registered force", self.tag())).schema
    }

    /// The quantities that it depends on.
    pub fn depends_on(self) -> Dependence {
        match self {
            Self::All(_) => self.schema().depends_on(),
            Self::One(_, name) => self.schema().part(name).depends_on,
        }
    }

    /// Whether it is in an element of its force.
    pub fn is_in(self, element: &ForceElement) -> bool {
        match self {
            Self::All(_) => element.parameters.iter().any(|parameter| *parameter != 0.0),
            Self::One(_, name) => element.has_part(element.schema.part(name)),
        }
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::All(tag) => f.write_str(tag),
            Self::One(tag, name) => write!(f, "{tag}: {}", self.schema().part(name).title),
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

impl Family {
    /// The family of an integrator, by its name.
    pub(super) fn of(integrator: &str) -> Self {
        use scene::schema::Matrix;
        let mut kinds = simulator::integrator::REGISTRY.iter();
        let kind = kinds.find(|kind| kind.schema.name == integrator);
        match kind.map(|kind| kind.schema.matrix) {
            Some(Matrix::Jacobians) => Self::Implicit,
            _ => Self::Explicit,
        }
    }
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
