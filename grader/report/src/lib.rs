//! Reports of gradings, Jacobian checks and classes, one file per format.

pub mod class;
pub mod creative;
pub mod explanation;
pub mod html;
pub mod jacobians;
pub mod json;
pub mod junit;
pub mod look;
pub mod probe;
pub mod provenance;
pub mod similar;
pub mod table;
pub mod text;
pub mod wrap;

mod digits;
mod remarks;
mod testsuites;

/// Version of the schema of JSON reports of gradings.
pub const SCHEMA_VERSION: u32 = 5;

/// How long each scene took, by name.
pub type SceneTimes = std::collections::HashMap<String, std::time::Duration>;
