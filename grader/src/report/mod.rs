//! Reports, one format a file. They see a [`Grading`](crate::grading::Grading), a
//! [`Probing`](crate::probe::Probing) or a [`Study`](crate::accuracy::Study), and nothing else.

pub mod accuracy;
pub mod class;
pub mod jacobians;
pub mod json;
pub mod junit;
pub mod needs;
pub mod probe;
pub mod selftest;
pub mod stability;
pub mod text;

mod canvas;
mod digits;
mod font;
mod picture;
pub(crate) mod points;
mod table;
mod testsuites;
