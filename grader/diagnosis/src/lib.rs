//! Diagnosis of wrong traces.
//!
//! ```text
//! change     mistakes as data, and steps with them made
//! ```

pub mod change;
