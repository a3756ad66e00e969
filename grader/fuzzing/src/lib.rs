//! Differential testing of simulators on drawn scenes, shrunk to the smallest that fails.
//!
//! ```text
//! Choices ── draw ──> scene, file ──> judge ── wrong ──> cause ──> shrink ──> symmetries ──> Report
//!    ^                                 │ right: novel?
//!    └────────── mutated ──────────────┘
//! ```
//!
//! - [`choices`]: recorded choices, of which everything random is made.
//! - [`draw`]: scenes from the facts of the registries.
//! - [`sibling`]: scenes with the same features as another and other numbers, which serve as hidden scenes.
//! - [`judge`]: a simulator on a drawn scene, by an envelope measured for it.
//! - [`cause`]: the search for causes over drawn scenes.
//! - [`shrink`]: the smallest scene that fails by the same cause.
//! - [`symmetry`]: a simulator against itself on transformed scenes.
//! - [`campaign`]: a run over many scenes.
//! - [`ours`]: our own simulator against the second one, and against itself.
//! - [`report`]: text and JSON.
//!
//! It knows no file and no rubric, and gives no points: it finds.

pub mod choices;

mod conditioning;
mod masses;

pub mod draw;
pub mod motion;
pub mod sibling;

pub mod judge;

pub mod cause;
pub mod shrink;
pub mod symmetry;

pub mod campaign;
pub mod ours;

pub mod report;
