//! Integration tests of the grading itself.

mod calibration;
mod conformance;
mod jacobians;
