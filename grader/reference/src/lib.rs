//! Reference implementations of force laws, step equations and motions, independent of the simulator's formulas.
//!
//! ```text
//! law        force laws, written from the documents; derivatives by dual numbers
//! laws       sum of the laws over a scene
//! equation   residual of a step in its method's equation
//! closed     motions with a closed form
//! adaptive   motions by a method of order 8
//! second     second stepper, with dense matrices and other orders of evaluation
//! ```
//!
//! This crate uses only the scene model and the registries' names from the simulator.

pub mod adaptive;
pub mod closed;
pub mod equation;
pub mod law;
pub mod laws;
pub mod second;
