//! Diagnosis: why the trace of a simulator is wrong.
//!
//! ```text
//! trace ── single steps: our step from the trace's own state k − 1, against its state k
//!       ── the steps that are wrong by themselves, as evidence
//!       ── mistakes that make the same steps, proven by replay of whole scenes
//! ```
//!
//! A right step agrees from any state, so that one early mistake can be distinguished from a hundred.
//!
//! - [`bound`]: accepted differences between correct programs.
//! - [`stepping`]: single steps of the built-in simulator.
//! - [`steps`]: the steps of a trace that are wrong by themselves. Cost: four simulator steps for each state.
//! - [`roots`]: other solutions of implicit steps.
//! - [`change`]: mistakes as data, and steps with them made.
//! - [`explanation`]: one wrong step in numbers.
//! - [`findings`]: what is wrong in a submission, from all its scenes.
//!
//! This crate runs no program and reads no file. The caller states how each scene ended ([`findings::JudgedScene`]).

pub mod bound;
pub mod stepping;

pub mod change;
pub mod roots;
pub mod steps;

pub mod explanation;
pub mod findings;
