//! Reports on stability, one format a file; they see a [`StabilityReport`](crate::stability::StabilityReport).

pub mod csv;
pub mod json;
pub mod plot;
pub mod text;
