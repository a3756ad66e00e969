//! Grades mass-spring simulators against oracle traces, feature by feature.
//!
//! ```text
//! trace -> Comparison -> Verdict -> Report
//! ```
//!
//! - [`boundary`]: files of students, other files, text of students.
//! - [`suite`]: the scenes that are graded, their features, and the part that an assignment grades.
//! - [`submission`]: submissions; a simulator, built-in or foreign, is seen only through its states.
//! - [`pack`]: what a teacher gives, so that students hand in sources only.
//! - [`verdict`]: a pass, or a named failure.
//! - [`compare`]: comparison of a trace with the oracle's, and envelopes of the differences between correct programs.
//! - [`rubric`]: tolerances, points, lateness.
//! - [`time`]: points in time.
//! - [`white_box`]: each force's Jacobians against differences of the force.
//! - [`probe`]: forces and Jacobians of a program, from its traces.
//! - [`creative`]: checks of creative scenes.
//! - [`functions`]: functions of a hand-in, each by itself.
//! - [`oracle`]: regeneration and verification of the stored traces.
//! - [`grading`]: grading of one submission over a suite.
//! - [`class`]: grading of a folder of submissions.

pub mod boundary;
pub mod time;

pub mod suite;

pub mod pack;
pub mod submission;
pub mod verdict;

pub mod compare;
pub mod rubric;

pub mod probe;
pub mod white_box;

pub mod creative;
pub mod functions;

pub mod oracle;

pub mod class;
pub mod grading;
