//! The second opinion: force laws, step equations and motions that share no formula with the simulator.
//!
//! ```text
//! law        each force, written from the documents; its derivatives by dual numbers
//! laws       the forces of a whole scene by the laws
//! method     each integrator's equation
//! equation   does a step obey its method's equation?
//! closed     motions with a closed form
//! adaptive   motions by a method of order 8
//! second     a second stepper, with dense matrices and other orders of evaluation
//! ```
//!
//! Of the simulator, only the model of a scene and the names in its registries are used.

pub mod adaptive;
pub mod closed;
pub mod equation;
pub mod law;
pub mod laws;
pub mod method;
pub mod second;
