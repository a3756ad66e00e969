//! Reports of stability, one file per format, each from a [`StabilityReport`](crate::stability::StabilityReport) alone.

pub mod csv;
pub mod html;
pub mod json;
pub mod plot;
pub mod text;
