//! What probing a program found, one format a file. They see a [`Probing`](grader::probe::Probing) and nothing
//! else.

pub mod json;
pub mod junit;
pub mod text;
