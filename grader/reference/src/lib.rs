//! Reference implementations of force laws, step equations and motions, independent of the simulator's formulas.
//!
//! ```text
//! law        each force, written from the documents; its derivatives by dual numbers
//! laws       the forces of a whole scene by the laws
//! method     each integrator's equation
//! equation   does a step obey its method's equation?
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
pub mod method;
pub mod second;
