//! The integration tests of the program `simulate`, one binary: each module is a subject.
//!
//! `cargo test --release -p simulate --test it plot` runs one of them.

mod bad_input;
mod cli;
mod course_frames;
mod film;
mod generate;
mod iterations;
mod json;
mod plot;
mod support;
mod view;
mod warnings;

#[path = "../../../tests/it/support/failing.rs"]
mod failing;
#[path = "../../../tests/it/support/shared.rs"]
mod shared;
