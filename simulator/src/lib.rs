//! A mass-spring simulator: from a scene file to a stream of states.
//!
//! ```text
//! scene file -> Scene -> System<D> -> Integrator -> Trace
//! ```
//!
//! - [`scene`]: the plain model of a scene, and the one parser that knows its file format.
//! - [`force`]: one force a file; energy, force and both Jacobians of each, and the registry.
//! - [`system`]: the masses, forces and fixed particles of one scene, put together.
//! - [`solver`]: linear and nonlinear solves, with no physics in them.
//! - [`integrator`]: one time integrator a file, and the registry.
//! - [`rescue`]: what is tried where a step has no answer.
//! - [`simulation`]: a scene stepped from its start to its end.
//! - [`trace`]: states to and from files.
//! - [`generate`]: scenes of any size, by rule.
//!
//! # Example
//!
//! ```
//! use simulator::{scene::{ParseOptions, xml}, simulation::Simulation, vocabulary};
//!
//! let text = r#"<scene>
//!     <duration time="1"/> <integrator type="symplectic-euler" dt="0.25"/>
//!     <particle m="2" px="0" py="0" vx="1" vy="0" fixed="0"/>
//!     <simplegravity fx="0" fy="-10"/>
//! </scene>"#;
//! let parsed = xml::parse(text, "falling.xml", &vocabulary(), &ParseOptions::default())?;
//! let mut simulation = Simulation::new(&parsed.scene);
//! while simulation.advance()? {}
//! assert_eq!(simulation.state().positions, [1.0, -6.25]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod scene;

pub mod force;
pub mod system;

pub mod solver;

pub mod integrator;
pub mod rescue;
pub mod simulation;
pub mod state;
pub mod statistics;

pub mod input;
pub mod output;
pub mod trace;

pub mod generate;

use scene::schema::Vocabulary;

/// Every force and integrator this crate offers, as the scene parser wants to hear of them.
pub fn vocabulary() -> Vocabulary {
    Vocabulary {
        forces: force::REGISTRY.iter().map(|kind| &kind.schema).collect(),
        integrators: integrator::REGISTRY.iter().map(|kind| &kind.schema).collect(),
    }
}
