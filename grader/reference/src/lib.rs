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
//! No formula is shared with the simulator, but facts are: this crate reads scenes by the simulator's model, and from its
//! registries the names and the order of parameters, which parts a force has and what they depend on, its stencil, and
//! each integrator's step equation, options and end of iteration. A wrong fact is wrong on both sides. `simulator/tests/facts.rs`
//! holds the facts of each force against what the force does, and `tests/laws.rs` each law's parameters against the registry.

pub mod adaptive;
pub mod closed;
pub mod equation;
pub mod law;
pub mod laws;
pub mod method;
pub mod second;
