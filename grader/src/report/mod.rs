//! Reports, one format a file. They see a [`Grading`](crate::grading::Grading) and nothing else.

pub mod jacobians;
pub mod json;
pub mod junit;
pub mod text;

mod digits;
mod table;
