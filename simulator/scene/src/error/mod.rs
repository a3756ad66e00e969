//! Errors in scene files: the place, the problem and the remedy.

mod json;

use std::borrow::Cow;
use std::fmt;
use std::path::Path;

use super::Location;
use crate::printable;
pub use json::JsonProblem;

/// One thing wrong with (or odd about) a scene file.
///
/// Displays as `file:line:column: what is wrong`, and a second line `  help: remedy`.
#[derive(Debug, thiserror::Error)]
pub struct SceneError {
    /// The file, as the user named it.
    pub file: String,
    /// Where in the file; `None` if it concerns the file as a whole.
    pub location: Option<Location>,
    /// The problem.
    pub problem: Box<Problem>,
}

impl SceneError {
    /// A problem at a place.
    pub fn new(file: &str, location: Location, problem: Problem) -> Self {
        Self { file: file.to_owned(), location: Some(location), problem: Box::new(problem) }
    }

    /// A problem of the file as a whole.
    pub fn whole_file(file: &str, problem: Problem) -> Self {
        Self { file: file.to_owned(), location: None, problem: Box::new(problem) }
    }

    /// A file or folder that cannot be read.
    pub fn unreadable(path: &Path, source: std::io::Error) -> Self {
        Self::whole_file(&path.display().to_string(), Problem::Unreadable { source })
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:", printable::line(&self.file))?;
        if let Some(Location { line, column }) = self.location {
            write!(f, "{line}:{column}:")?;
        }
        // Both quote the file.
        let shown =
            printable::text(&format!("{}\n  help: {}", self.problem, self.problem.remedy()));
        write!(f, " {shown}")
    }
}

/// A problem in a scene file.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what the variants and their fields are")]
pub enum Problem {
    #[error("cannot be read: {source}")]
    Unreadable { source: std::io::Error },
    #[error("the file has {size} bytes, and a scene may have at most {limit}")]
    TooLarge { size: u64, limit: u64 },
    #[error("the scene has more than {limit} {what}")]
    Exceeds { what: &'static str, limit: u64 },
    #[error("this is not UTF-8 text: invalid byte 0x{byte:02x}")]
    NotText { byte: u8 },
    #[error("the file is empty")]
    Empty,
    #[error("this is not well-formed XML: {detail}")]
    Malformed { detail: String },
    #[error("the file ends inside <{tag}>, which is opened here")]
    Truncated { tag: String },
    #[error("a document type declaration is not part of a scene")]
    Doctype,
    #[error("the root element is <{found}>, not <scene>")]
    WrongRoot { found: String },
    #[error("there is no <scene> element")]
    NoRoot,
    #[error("elements are nested more than {limit} deep")]
    TooDeep { limit: usize },
    #[error("there is more than one root element: <{found}>")]
    SecondRoot { found: String },
    #[error("there is text between the elements: {text:?}")]
    StrayText { text: String },
    #[error("<{tag}> may not contain other elements, but contains <{inner}>")]
    Nested { tag: String, inner: String },
    #[error("unknown element <{tag}>")]
    UnknownElement { tag: String, suggestion: Option<&'static str> },
    #[error("<{tag}> changes the physics of the scene, and is not modelled")]
    UnmodelledPhysics { tag: String },
    #[error("<{tag}> has an unknown attribute {attribute:?}")]
    UnknownAttribute { tag: String, attribute: String, suggestion: Option<&'static str> },
    #[error("there is no <{tag}> element")]
    MissingElement { tag: &'static str, example: &'static str },
    #[error("second <{tag}>; the first is at line {first}")]
    RepeatedElement { tag: &'static str, first: u32, fatal: bool },
    #[error("<{tag}> has no attribute {attribute:?}")]
    MissingAttribute { tag: String, attribute: String, similar: Option<String> },
    #[error("<{tag}> {attribute}={text:?} is not a number")]
    NotANumber { tag: String, attribute: String, text: String },
    #[error("<{tag}> {attribute}={text:?} is out of the range of an f64")]
    Overflow { tag: String, attribute: String, text: String },
    #[error("<{tag}> {attribute}={text:?} must be {must_be}")]
    OutOfDomain { tag: String, attribute: String, text: String, must_be: Cow<'static, str> },
    #[error("<{tag}> {attribute}={text:?} is not a whole number from 0 up")]
    NotAnIndex { tag: String, attribute: String, text: String },
    #[error("<{tag}> {attribute}=\"{index}\": there is no such {what}")]
    NoSuch { tag: String, attribute: String, index: usize, what: &'static str, count: usize },
    #[error("<{tag}> names particle {particle} twice")]
    SameParticle { tag: String, particle: usize },
    #[error(
        "the particles of <{tag}> are all in one place at the start, and its stiffness is per initial length"
    )]
    NoLength { tag: &'static str },
    #[error("the undeformed corners of <{tag}> are on one line: it has no area")]
    FlatTriangle { tag: &'static str },
    #[error("the undeformed corners of <{tag}> are in one plane: it has no volume")]
    FlatTetrahedron { tag: &'static str },
    #[error(
        "a triangle of <{tag}> has no area at the start, and its stiffness is per initial area"
    )]
    FlatHinge { tag: &'static str },
    #[error("<{tag}> exists in three dimensions only, and this scene has two")]
    InSpaceOnly { tag: &'static str },
    #[error("unknown integrator type {found:?}")]
    UnknownIntegrator { found: String, suggestion: Option<&'static str>, known: String },
    #[error("{integrator} has no option {option:?}")]
    UnknownOption { integrator: &'static str, option: String, known: String },
    #[error("{integrator} takes no {option}={text:?}: it must be {must_be}")]
    OptionValue { integrator: &'static str, option: String, text: String, must_be: String },
    #[error("{integrator} cannot simulate this <{tag}>, because it {because}")]
    RefusedForce {
        integrator: &'static str,
        tag: &'static str,
        because: &'static str,
        remedy: &'static str,
    },
    #[error("duration {} s at a time step of {time_step} s is {steps:e} steps", readable(*.duration))]
    TooManySteps { duration: f64, time_step: f64, steps: f64, limit: u64 },
    #[error(transparent)]
    Json(#[from] JsonProblem),
}

impl Problem {
    /// A remedy for the user.
    pub fn remedy(&self) -> String {
        match self {
            Self::Unreadable { .. } => "check the path and its permissions".into(),
            Self::SecondRoot { .. } => "put everything into the first <scene>".into(),
            Self::TooLarge { .. } => "split the scene, or check that this is the right file".into(),
            Self::Exceeds { what, .. } => {
                format!("if you trust the scene, raise this limit: --limit {what}=NUMBER")
            }
            Self::NotText { .. } => "a scene is text; check that this is the right file".into(),
            Self::Empty | Self::NoRoot => {
                "a scene is an XML file whose root element is <scene>".into()
            }
            Self::Malformed { .. } => "correct the markup here or shortly before".into(),
            Self::Truncated { tag } => {
                format!("close it with </{tag}>, or restore the lost end of the file")
            }
            Self::TooDeep { .. } => "a scene is a flat list of elements inside <scene>".into(),
            Self::Doctype => {
                "remove the <!DOCTYPE ...>; entities of one's own are not supported".into()
            }
            Self::WrongRoot { .. } => "enclose everything in <scene> ... </scene>".into(),
            Self::StrayText { .. } => "remove it, or make it a comment: <!-- ... -->".into(),
            Self::Nested { tag, .. } => format!("close <{tag} .../> before the next element"),
            Self::UnknownElement { suggestion, .. } => match suggestion {
                Some(suggestion) => format!("did you mean <{suggestion}>?"),
                None => "it is ignored; remove it".into(),
            },
            Self::UnmodelledPhysics { .. } => {
                "remove the element, or use a simulator that models it".into()
            }
            Self::UnknownAttribute { suggestion, .. } => match suggestion {
                Some(suggestion) => format!("did you mean {suggestion:?}?"),
                None => "it is ignored; remove it".into(),
            },
            Self::MissingElement { example, .. } => format!("add for instance {example}"),
            Self::RepeatedElement { fatal: true, .. } => "keep one of them".into(),
            Self::RepeatedElement { .. } => "the last one counts; keep one of them".into(),
            Self::MissingAttribute { attribute, similar, .. } => match similar {
                Some(similar) => format!("it has {similar:?}; rename that to {attribute:?}"),
                None => format!("add {attribute}=\"...\""),
            },
            Self::NotANumber { .. } => "write a decimal number, such as 0.5 or 1e-3".into(),
            Self::Overflow { .. } => "write a number below 1.8e308 in magnitude".into(),
            Self::OutOfDomain { attribute, must_be, .. } => {
                format!("give {attribute} a value that is {must_be}")
            }
            Self::NotAnIndex { .. } => "particles and edges are numbered 0, 1, 2, …".into(),
            Self::NoSuch { what, count: 0, .. } => format!("the scene has no {what}; add one"),
            Self::NoSuch { what, count: 1, .. } => format!("the scene has one {what}: number 0"),
            Self::NoSuch { what, count, .. } => {
                format!("the scene has {count} of them: {what}s 0 to {}", count - 1)
            }
            Self::SameParticle { .. } => "join two different particles".into(),
            Self::NoLength { .. } => "place its particles apart".into(),
            Self::FlatTriangle { .. } => {
                "give it corners that span a triangle, xb1x to xb3y, or place its particles so"
                    .into()
            }
            Self::FlatTetrahedron { .. } => {
                "give it corners that span a tetrahedron, xb1x to xb4z, or place its particles so"
                    .into()
            }
            Self::FlatHinge { .. } => {
                "place its particles so that i1 i2 i3 and i1 i2 i4 are triangles".into()
            }
            Self::InSpaceOnly { .. } => "give its particles pz and vz".into(),
            Self::UnknownIntegrator { suggestion: Some(suggestion), .. } => {
                format!("did you mean {suggestion:?}?")
            }
            Self::UnknownIntegrator { known, .. } => format!("known types: {known}"),
            Self::UnknownOption { known, .. } if known.is_empty() => {
                "it has none; leave it out".into()
            }
            Self::UnknownOption { known, .. } => format!("its options: {known}"),
            Self::OptionValue { option, must_be, .. } => {
                format!("give {option} a value that is {must_be}")
            }
            Self::RefusedForce { remedy, .. } => (*remedy).into(),
            Self::TooManySteps { limit, .. } => {
                format!(
                    "at most {limit:e} steps are simulated; shorten the duration or lengthen the step"
                )
            }
            Self::Json(problem) => problem.remedy(),
        }
    }
}

/// A number in a message: with an exponent where it has hundreds of digits.
fn readable(value: f64) -> String {
    if value < 1e16 { value.to_string() } else { format!("{value:e}") }
}
