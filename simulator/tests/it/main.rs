//! The simulator's integration tests, one binary: each module is a subject.
//!
//! `cargo test --release -p simulator --test it physics` runs one of them.

mod assignment;
mod damping;
mod doubtful;
mod elastic;
mod fast_mass_spring;
mod forces;
mod forests;
mod fuzz_seeds;
mod memory;
mod mesh;
mod physics;
mod projected_newton;
mod robust;
mod scenes;
mod sizes;
mod stencils;
mod subnormal;
mod support;
mod threads;
