//! Grades mass-spring simulators against oracle traces, feature by feature.
//!
//! ```text
//! trace -> Comparison -> Verdict -> Report
//! ```
//!
//! - [`assignment`]: the part of the suite that an assignment grades.
//! - [`suite`]: the scenes that are graded, and their features.
//! - [`selection`]: scenes chosen by patterns.
//! - [`submission`]: submissions; a simulator, built-in or foreign, is seen only through its states.
//! - [`calibration`]: envelopes of the differences between correct programs.
//! - [`compare`]: comparison of a trace with the oracle's.
//! - [`diagnosis`]: the steps of a trace that are wrong by themselves.
//! - [`verdict`]: a pass, or a named failure.
//! - [`rubric`]: tolerances and points.
//! - [`late`]: the rubric's rules for late submissions and course platforms.
//! - [`time`]: points in time.
//! - [`events`]: events of a run, sent to an observer.
//! - [`stepping`]: single steps of the built-in simulator.
//! - [`recording`]: a comparison reduced for display.
//! - [`grading`]: grading of one submission over a suite.
//! - [`class`]: grading of a folder of submissions.
//! - [`creative`]: checks of creative scenes.
//! - [`similar`]: what the sources of hand-ins share.
//! - [`altered`]: detection of programs that look traces up.
//! - [`findings`]: what is wrong in a submission, proven by replay.
//! - [`jacobian`]: each force's Jacobians against differences of the force.
//! - [`sibling`]: scenes with the same features and other numbers, drawn by a seed.
//! - [`oracle`]: regeneration and verification of the stored traces.
//! - [`init`]: skeletons of submissions.
//! - [`door`]: files of students; [`own_file`]: all others; [`printed`]: text of students.
//! - [`seal`]: signatures of what is stored between runs.

pub mod assignment;
pub mod selection;
pub mod suite;

pub mod submission;
pub mod verdict;

pub mod calibration;
pub mod compare;
pub mod diagnosis;
pub mod late;
pub mod rubric;
pub mod time;

pub mod stepping;

pub mod recording;

pub mod altered;
pub mod class;
pub mod creative;
pub mod events;
pub mod findings;
pub mod grading;
pub mod jacobian;
pub mod sibling;
pub mod similar;

pub mod init;
pub mod probe;

pub mod door;
pub mod oracle;
pub mod own_file;
pub mod printed;
pub mod seal;
