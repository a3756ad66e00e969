//! Options of generators as data: a program makes its command line of them.

use super::error::{GenerateErrorKind, check};
use super::{PinnedEdge, SpringLaw, elements};
use scene::Dimension;
use scene::schema::{Domain, ForceSchema, IntegratorSchema};

/// An option of a generator.
pub struct GeneratorOption<'a> {
    /// Name, values and rules.
    pub spec: OptionSpec,
    /// Description, without a full stop.
    pub help: &'static str,
    /// The field that has its value.
    pub value: OptionValue<'a>,
}

/// How a command line names an option, and its rules.
#[derive(Debug, Clone, Copy)]
pub struct OptionSpec {
    /// Its name on a command line.
    pub name: &'static str,
    /// Its short name, if it has one.
    pub short: Option<char>,
    /// Stands for its value; empty for a flag.
    pub value_name: &'static str,
    /// The heading that it is listed under, if any.
    pub heading: Option<&'static str>,
    /// The values of a number; `None` if [`Generator::scene`](super::Generator::scene) checks it otherwise.
    pub domain: Option<Domain>,
    /// How it depends on other options.
    pub rule: Rule,
}

/// How an option depends on others, which are named.
#[derive(Debug, Clone, Copy)]
pub enum Rule {
    /// It does not.
    Free,
    /// It is given without any other.
    Alone,
    /// It is not given with that one.
    Excludes(&'static str),
    /// It is given only with that one.
    Needs(&'static str),
    /// It has another default if `option` has the value `is`.
    DefaultIf {
        /// The other option.
        option: &'static str,
        /// Its value.
        is: &'static str,
        /// The default.
        default: &'static str,
    },
}

/// The value of an option, by type.
#[expect(missing_docs, reason = "the types say what the variants are")]
pub enum OptionValue<'a> {
    Flag(&'a mut bool),
    Count(&'a mut u64),
    Number(&'a mut f64),
    MaybeCount(&'a mut Option<u64>),
    MaybeNumber(&'a mut Option<f64>),
    Dimension(&'a mut Dimension),
    Choice(&'a mut dyn Choice),
    Integrator(&'a mut &'static IntegratorSchema),
    /// Names and values.
    Settings(&'a mut Vec<(String, String)>),
}

/// A value that is one of several words.
pub trait Choice {
    /// The words, each with its description.
    fn words(&self) -> Vec<(&'static str, &'static str)>;

    /// The word of the value.
    fn word(&self) -> &'static str;

    /// Gives it the value of a word; an unknown word changes nothing.
    fn choose(&mut self, word: &str);
}

/// A choice among the values of the constant `ALL`, each with its name and its description.
macro_rules! choices {
    ($($type:ty),*) => {$(
        impl Choice for $type {
            fn words(&self) -> Vec<(&'static str, &'static str)> {
                Self::ALL.iter().map(|(_, name, help)| (*name, *help)).collect()
            }

            fn word(&self) -> &'static str {
                let known = Self::ALL.iter().find(|(value, ..)| value == self);
                known.expect("all values have a name").1
            }

            fn choose(&mut self, word: &str) {
                if let Some((value, ..)) = Self::ALL.iter().find(|(_, name, _)| *name == word) {
                    *self = *value;
                }
            }
        }
    )*};
}

choices! { SpringLaw, PinnedEdge }

/// A force on elements with undeformed corners, among those with as many corners.
impl Choice for &'static ForceSchema {
    fn words(&self) -> Vec<(&'static str, &'static str)> {
        elements(self.stencil.size()).map(|schema| (schema.tag, schema.title)).collect()
    }

    fn word(&self) -> &'static str {
        self.tag
    }

    fn choose(&mut self, word: &str) {
        *self = elements(self.stencil.size()).find(|schema| schema.tag == word).unwrap_or(self);
    }
}

impl OptionSpec {
    /// A number within a domain.
    pub(super) const fn number(
        name: &'static str,
        value_name: &'static str,
        domain: Domain,
    ) -> Self {
        Self { domain: Some(domain), ..Self::value(name, value_name) }
    }

    /// Any other value.
    pub(super) const fn value(name: &'static str, value_name: &'static str) -> Self {
        Self { name, value_name, short: None, heading: None, domain: None, rule: Rule::Free }
    }

    /// A flag.
    pub(super) const fn flag(name: &'static str) -> Self {
        Self::value(name, "")
    }

    pub(super) const fn short(self, short: char) -> Self {
        Self { short: Some(short), ..self }
    }

    pub(super) const fn rule(self, rule: Rule) -> Self {
        Self { rule, ..self }
    }

    pub(super) const fn heading(self, heading: &'static str) -> Self {
        Self { heading: Some(heading), ..self }
    }
}

/// A struct of options.
pub trait Options {
    /// The options, with their values.
    fn options(&mut self) -> Vec<GeneratorOption<'_>>;

    /// Checks numbers against their domains.
    ///
    /// # Errors
    /// If one is out of its domain.
    fn check(&self) -> Result<(), GenerateErrorKind>;
}

/// Checks a value of any type against the domain of its option.
pub(super) trait Checked {
    fn check(&self, _spec: &OptionSpec) -> Result<(), GenerateErrorKind> {
        Ok(())
    }
}

impl Checked for f64 {
    fn check(&self, spec: &OptionSpec) -> Result<(), GenerateErrorKind> {
        spec.domain.map_or(Ok(()), |domain| check(spec.name, *self, domain))
    }
}

/// Converts a field to an [`OptionValue`].
macro_rules! values {
    ($($type:ty => $variant:ident),*) => {$(
        impl<'a> From<&'a mut $type> for OptionValue<'a> {
            fn from(value: &'a mut $type) -> Self {
                Self::$variant(value)
            }
        }
    )*};
}

values! {
    bool => Flag, u64 => Count, f64 => Number, Option<u64> => MaybeCount, Option<f64> => MaybeNumber,
    Dimension => Dimension, SpringLaw => Choice, PinnedEdge => Choice, &'static ForceSchema => Choice,
    &'static IntegratorSchema => Integrator,
    Vec<(String, String)> => Settings
}

impl Checked for bool {}
impl Checked for u64 {}
impl Checked for Option<u64> {}
impl Checked for Option<f64> {}
impl Checked for Dimension {}
impl Checked for SpringLaw {}
impl Checked for PinnedEdge {}
impl Checked for &'static ForceSchema {}
impl Checked for &'static IntegratorSchema {}
impl Checked for Vec<(String, String)> {}

/// Defines a struct of options. A field `name: type => spec;` is an option, described by its comment; a field
/// `with name: type;` is a struct of further ones. With `= value` after each type, the struct gets a `Default`.
macro_rules! options {
    (
        $(#[$meta:meta])* pub struct $name:ident {
            $($(#[doc = $help:literal])+ $field:ident: $type:ty = $default:expr => $spec:expr;)*
            $(with $group:ident: $group_type:ty = $group_default:expr;)*
        }
    ) => {
        options! {
            $(#[$meta])* pub struct $name {
                $($(#[doc = $help])+ $field: $type => $spec;)*
                $(with $group: $group_type;)*
            }
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default,)* $($group: $group_default,)* }
            }
        }
    };
    (
        $(#[$meta:meta])* pub struct $name:ident {
            $($(#[doc = $help:literal])+ $field:ident: $type:ty => $spec:expr;)*
            $(with $group:ident: $group_type:ty;)*
        }
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, PartialEq)]
        pub struct $name {
            $($(#[doc = $help])+ pub $field: $type,)*
            $(#[doc = "Further options."] pub $group: $group_type,)*
        }

        impl $crate::generate::options::Options for $name {
            fn options(&mut self) -> Vec<$crate::generate::options::GeneratorOption<'_>> {
                let own = vec![$($crate::generate::options::GeneratorOption {
                    spec: $spec,
                    help: concat!($($help),+).trim_matches([' ', '.']),
                    value: (&mut self.$field).into(),
                }),*];
                let groups: Vec<Vec<_>> = vec![$(self.$group.options()),*];
                own.into_iter().chain(groups.into_iter().flatten()).collect()
            }

            fn check(&self) -> Result<(), $crate::generate::GenerateErrorKind> {
                $($crate::generate::options::Checked::check(&self.$field, &$spec)?;)*
                $(self.$group.check()?;)*
                Ok(())
            }
        }
    };
}

pub(super) use options;
