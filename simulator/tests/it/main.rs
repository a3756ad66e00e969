//! The simulator's integration tests, one binary: each module is a subject.
//!
//! `cargo test --release -p simulator --test it physics` runs one of them.

mod allocations;
mod assignment;
mod bad_input;
mod cli;
mod course_frames;
mod doubtful;
mod fast_mass_spring;
mod film;
mod forests;
mod fuzz_seeds;
mod generate;
mod iterations;
mod json;
mod memory;
mod physics;
mod plot;
mod projected_newton;
mod robust;
mod scenes;
mod sizes;
mod subnormal;
mod support;
mod threads;
mod view;
