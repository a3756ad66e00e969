//! Integration tests of the grading itself.

mod calibration;
mod change;
mod conformance;
mod findings;
mod jacobians;
