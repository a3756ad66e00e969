//! Reports of gradings, Jacobian checks and classes, one format a file.

pub mod class;
pub mod jacobians;
pub mod json;
pub mod junit;
pub mod probe;
pub mod table;
pub mod text;

mod digits;
mod testsuites;
