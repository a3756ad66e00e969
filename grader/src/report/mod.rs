//! Reports, one format a file. They see a [`Grading`](crate::grading::Grading) or a
//! [`Probing`](crate::probe::Probing) and nothing else.

pub mod class;
pub mod jacobians;
pub mod json;
pub mod junit;
pub mod probe;
pub mod selftest;
pub mod text;

mod digits;
pub(crate) mod points;
mod table;
