//! Integration tests of the grading itself.

mod calibration;
mod change;
mod conformance;
mod diagnosis;
mod findings;
mod jacobians;
