//! Reports of a black-box probe, one file per format, each from a [`Probing`](grader::probe::Probing) alone.

pub mod json;
pub mod junit;
pub mod text;
