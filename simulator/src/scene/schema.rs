//! What a scene may say of forces and integrators, as data.
//!
//! Each force and each integrator describes itself with one of these; the parser, the help text, the
//! Jacobian check and the documentation all read the same description.

/// The most parameters a force element has.
pub const MAX_PARAMETERS: usize = 4;

/// What the parser is told of the forces and integrators that exist.
#[derive(Debug, Clone)]
pub struct Vocabulary {
    /// The forces.
    pub forces: Vec<&'static ForceSchema>,
    /// The integrators.
    pub integrators: Vec<&'static IntegratorSchema>,
}

impl Vocabulary {
    /// The integrator that `spelling` names, by its name or one of its aliases.
    pub fn integrator(&self, spelling: &str) -> Option<&'static IntegratorSchema> {
        let is_named = |schema: &&&'static IntegratorSchema| {
            schema.name == spelling || schema.aliases.contains(&spelling)
        };
        self.integrators.iter().find(is_named).copied()
    }

    /// The force with this tag.
    pub fn force(&self, tag: &str) -> Option<&'static ForceSchema> {
        self.forces.iter().find(|schema| schema.tag == tag).copied()
    }
}

/// A force, as a scene file may mention it.
#[derive(Debug, PartialEq)]
pub struct ForceSchema {
    /// The element's tag.
    pub tag: &'static str,
    /// Its name in prose.
    pub title: &'static str,
    /// What it acts on.
    pub acts_on: ActsOn,
    /// Its parameters; at most [`MAX_PARAMETERS`].
    pub parameters: &'static [ParameterSchema],
    /// An element as it would stand in a file.
    pub example: &'static str,
}

/// What a force element acts on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ActsOn {
    /// Every particle that is not fixed.
    EveryParticle,
    /// The two particles named by the attributes `i` and `j`.
    Pair,
    /// The two particles of the edge named by the attribute `edge`.
    Edge,
}

/// A parameter of a force.
#[derive(Debug, PartialEq)]
pub struct ParameterSchema {
    /// The attribute.
    pub name: &'static str,
    /// What it is, in the field's terms.
    pub meaning: &'static str,
    /// Which values it may have.
    pub domain: Domain,
    /// Its value where the attribute is missing; `None` if it may not be.
    pub default: Option<f64>,
    /// Whether it belongs to three dimensions only.
    pub three_dimensional: bool,
    /// Lower and upper bound of values that checks and benches draw from.
    pub typical: (f64, f64),
}

impl ParameterSchema {
    /// A required parameter, any finite number.
    pub const fn new(name: &'static str, meaning: &'static str, typical: (f64, f64)) -> Self {
        Self {
            name,
            meaning,
            domain: Domain::Finite,
            default: None,
            three_dimensional: false,
            typical,
        }
    }

    /// The same, but never negative.
    pub const fn non_negative(mut self) -> Self {
        self.domain = Domain::NonNegative;
        self
    }

    /// The same, with a value for where it is missing.
    pub const fn default_to(mut self, value: f64) -> Self {
        self.default = Some(value);
        self
    }

    /// The same, in scenes of three dimensions only.
    pub const fn in_three_dimensions(mut self) -> Self {
        self.three_dimensional = true;
        self
    }
}

/// Which numbers an attribute takes. All of them are finite.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Domain {
    /// Any.
    Finite,
    /// 0 or more.
    NonNegative,
    /// More than 0.
    Positive,
    /// From 0 to 1.
    UnitInterval,
}

impl Domain {
    /// Whether `value` is one of them.
    pub fn contains(self, value: f64) -> bool {
        value.is_finite()
            && match self {
                Self::Finite => true,
                Self::NonNegative => value >= 0.0,
                Self::Positive => value > 0.0,
                Self::UnitInterval => (0.0..=1.0).contains(&value),
            }
    }

    /// What it takes, in words that follow "must be".
    pub fn describe(self) -> &'static str {
        match self {
            Self::Finite => "a finite number",
            Self::NonNegative => "a finite number, 0 or more",
            Self::Positive => "a finite number above 0",
            Self::UnitInterval => "between 0 and 1",
        }
    }
}

/// An integrator, as a scene file may mention it.
#[derive(Debug, PartialEq)]
pub struct IntegratorSchema {
    /// Its name: the spelling that this project writes.
    pub name: &'static str,
    /// Other spellings of the same method.
    pub aliases: &'static [&'static str],
    /// Its update rule in a line.
    pub summary: &'static str,
}
