//! What a scene may say of forces and integrators, as data.
//!
//! Each force and each integrator describes itself with one of these; the parser, the help text, the
//! Jacobian check and the documentation all read the same description.

use super::ForceElement;

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

/// A force, as a scene file may mention it. Two are equal if they have the same tag.
#[derive(Debug)]
pub struct ForceSchema {
    /// The element's tag.
    pub tag: &'static str,
    /// Its name in prose.
    pub title: &'static str,
    /// What it acts on.
    pub acts_on: ActsOn,
    /// Its parameters; at most [`MAX_PARAMETERS`].
    pub parameters: &'static [ParameterSchema],
    /// Whether the force, with these parameters, follows from functions of the state: from an energy by
    /// position, or from a dissipation function by velocity. A method that minimises takes no other.
    pub variational: fn(&[f64; MAX_PARAMETERS]) -> bool,
    /// An element as it would stand in a file.
    pub example: &'static str,
}

impl PartialEq for ForceSchema {
    fn eq(&self, other: &Self) -> bool {
        self.tag == other.tag
    }
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

    /// The same, but above zero.
    pub const fn positive(mut self) -> Self {
        self.domain = Domain::Positive;
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

/// An integrator, as a scene file may mention it. Two are equal if they have the same name.
#[derive(Debug)]
pub struct IntegratorSchema {
    /// Its name: the spelling that this project writes.
    pub name: &'static str,
    /// Other spellings of the same method.
    pub aliases: &'static [&'static str],
    /// Its update rule in a line.
    pub summary: &'static str,
    /// What else may be set, as further attributes of its element.
    pub options: &'static [OptionSchema],
    /// Why it cannot simulate a force, where it cannot.
    pub refuses: fn(&ForceElement) -> Option<Refusal>,
}

impl PartialEq for IntegratorSchema {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

/// Why an integrator does not simulate a force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Refusal {
    /// What the force lacks, in words that follow "because it".
    pub because: &'static str,
    /// What to do about it.
    pub remedy: &'static str,
}

/// For integrators that simulate every force.
pub fn refuses_nothing(_: &ForceElement) -> Option<Refusal> {
    None
}

/// An option of an integrator.
#[derive(Debug, PartialEq)]
pub struct OptionSchema {
    /// The attribute.
    pub name: &'static str,
    /// What it is, in the field's terms.
    pub meaning: &'static str,
    /// The values it may have, and the one it has where the attribute is missing.
    pub kind: OptionKind,
}

/// The values of an option.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OptionKind {
    /// A number.
    Number {
        /// Which numbers.
        domain: Domain,
        /// Its value where the attribute is missing.
        default: f64,
    },
    /// A whole number, 1 or more.
    Count {
        /// Its value where the attribute is missing.
        default: u64,
    },
    /// One of several words.
    Choice {
        /// The words; the first is the default.
        words: &'static [&'static str],
    },
}

impl OptionKind {
    /// The value where the attribute is missing.
    pub fn default(self) -> OptionValue {
        match self {
            Self::Number { default, .. } => OptionValue::Number(default),
            Self::Count { default } => OptionValue::Count(default),
            Self::Choice { words } => OptionValue::Choice(words.first().copied().unwrap_or("")),
        }
    }

    /// The value that `text` stands for.
    ///
    /// # Errors
    /// Where it stands for none: what it must be, in words that follow "must be".
    pub fn parse(self, text: &str) -> Result<OptionValue, String> {
        let text = text.trim();
        match self {
            Self::Number { domain, .. } => match text.parse() {
                Ok(value) if domain.contains(value) => Ok(OptionValue::Number(value)),
                _ => Err(domain.describe().to_owned()),
            },
            Self::Count { .. } => match text.parse() {
                Ok(value) if value > 0 => Ok(OptionValue::Count(value)),
                _ => Err("a whole number, 1 or more".to_owned()),
            },
            Self::Choice { words } => {
                let word = words.iter().find(|word| **word == text);
                word.map(|word| OptionValue::Choice(word))
                    .ok_or_else(|| format!("one of {}", words.join(", ")))
            }
        }
    }
}

/// The value of an option.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OptionValue {
    /// Of an [`OptionKind::Number`].
    Number(f64),
    /// Of an [`OptionKind::Count`].
    Count(u64),
    /// Of an [`OptionKind::Choice`].
    Choice(&'static str),
}

/// The values of all options of an integrator.
#[derive(Debug, Clone, PartialEq)]
pub struct IntegratorOptions {
    integrator: &'static str,
    schema: &'static [OptionSchema],
    values: Vec<OptionValue>,
}

impl IntegratorOptions {
    /// The defaults of `integrator`.
    pub fn defaults(integrator: &IntegratorSchema) -> Self {
        let values = integrator.options.iter().map(|option| option.kind.default()).collect();
        Self { integrator: integrator.name, schema: integrator.options, values }
    }

    /// Whether these are the options of `integrator`.
    pub fn is_of(&self, integrator: &IntegratorSchema) -> bool {
        self.integrator == integrator.name
    }

    /// Sets the option `name` to what `text` stands for.
    ///
    /// # Errors
    /// Where there is no such option, or it cannot have that value.
    pub fn set(&mut self, name: &str, text: &str) -> Result<(), OptionError> {
        let Some(place) = self.schema.iter().position(|option| option.name == name) else {
            return Err(OptionError::Unknown);
        };
        let value = self.schema[place].kind.parse(text);
        self.values[place] = value.map_err(|must_be| OptionError::Value { must_be })?;
        Ok(())
    }

    /// Every option with its value, in the order of the schema.
    pub fn iter(&self) -> impl Iterator<Item = (&'static OptionSchema, OptionValue)> {
        self.schema.iter().zip(self.values.iter().copied())
    }

    /// The value of a number.
    ///
    /// # Panics
    /// Where the schema has no such number.
    pub fn number(&self, name: &str) -> f64 {
        match self.value(name) {
            OptionValue::Number(value) => value,
            other => unreachable!("{name} is {other:?}, and not a number"),
        }
    }

    /// The value of a count.
    ///
    /// # Panics
    /// Where the schema has no such count.
    pub fn count(&self, name: &str) -> u64 {
        match self.value(name) {
            OptionValue::Count(value) => value,
            other => unreachable!("{name} is {other:?}, and not a count"),
        }
    }

    /// The word chosen.
    ///
    /// # Panics
    /// Where the schema has no such choice.
    pub fn choice(&self, name: &str) -> &'static str {
        match self.value(name) {
            OptionValue::Choice(word) => word,
            other => unreachable!("{name} is {other:?}, and not a choice"),
        }
    }

    fn value(&self, name: &str) -> OptionValue {
        let found = self.iter().find(|(option, _)| option.name == name);
        found.unwrap_or_else(|| panic!("the schema has no option {name}")).1
    }
}

/// An option that cannot be set.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OptionError {
    /// The integrator has no option of that name.
    Unknown,
    /// The option cannot have that value.
    Value {
        /// What it must be, in words that follow "must be".
        must_be: String,
    },
}
