//! A mass-spring simulator: steps a scene and produces a stream of states. The crate `scene` reads scenes and writes traces.
//!
//! ```text
//! scene file -> Scene -> System<D> -> Integrator -> Trace
//! ```
//!
//! - [`force`]: energies, forces and Jacobians, one force per file, and their registry.
//! - [`parts`]: the particles of a large scene, divided among threads.
//! - [`sizes`]: sizes at which another code path begins.
//! - [`system`]: assembly of a scene's masses, forces and fixed particles.
//! - [`solver`]: linear and nonlinear solvers, without physics.
//! - [`integrator`]: time integrators, one per file, and their registry.
//! - [`fallback`]: optional fallbacks for steps that fail.
//! - [`simulation`]: runs a scene step by step.
//! - [`generate`]: procedural scenes of any size.
//!
//! # Example
//!
//! ```
//! use scene::{ParseOptions, xml};
//! use simulator::{simulation::Simulation, vocabulary};
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

pub mod parts;
pub mod sizes;

pub mod force;
pub mod system;

pub mod solver;

pub mod fallback;
pub mod growth;
pub mod integrator;
pub mod simulation;
pub mod statistics;

pub mod generate;

use scene::schema::Vocabulary;

/// The schemas of all forces and integrators, for the scene parser.
pub fn vocabulary() -> Vocabulary {
    Vocabulary {
        forces: force::REGISTRY.iter().map(|kind| &kind.schema).collect(),
        integrators: integrator::REGISTRY.iter().map(|kind| &kind.schema).collect(),
    }
}
