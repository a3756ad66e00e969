//! Reports and diagrams of studies, one file per format.

pub mod accuracy;
pub mod jacobians;
pub mod needs;
pub mod stability;

mod picture;
