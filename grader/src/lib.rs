//! Grades mass-spring simulators against oracle traces, feature by feature.
//!
//! ```text
//! trace -> Comparison -> Verdict -> Report
//! ```
//!
//! - [`suite`]: the scenes that are graded, and their features.
//! - [`selection`]: scenes chosen by patterns.
//! - [`submission`]: what is graded; a simulator, built-in or foreign, is met only through its states.
//! - [`calibration`]: what a correct program may differ by.
//! - [`compare`]: a trace against the oracle's.
//! - [`diagnosis`]: why a trace is wrong.
//! - [`verdict`]: a pass, or a named failure.
//! - [`rubric`]: tolerances and points.
//! - [`events`]: what happens meanwhile, told as it happens.
//! - [`stepping`]: single steps of the built-in simulator.
//! - [`grading`]: all of it, over a suite.
//! - [`class`]: a folder of submissions, each graded alone.
//! - [`altered`]: whether a program simulates, or looks its traces up.
//! - [`blame`]: what a failing submission looks as if it had wrong.
//! - [`jacobian`]: each force's Jacobians against differences of the force.
//! - [`oracle`]: the stored traces: regenerated, verified.
//! - [`init`]: skeletons of submissions.

pub mod selection;
pub mod suite;

pub mod submission;
pub mod verdict;

pub mod calibration;
pub mod compare;
pub mod diagnosis;
pub mod rubric;

pub mod stepping;

pub mod altered;
pub mod blame;
pub mod class;
pub mod events;
pub mod grading;
pub mod jacobian;

pub mod init;
pub mod probe;

pub mod oracle;
pub mod printed;
