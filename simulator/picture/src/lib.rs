//! Pictures as PNG and SVG, animations as GIF, and the scripts and styles that all pages share.
//!
//! ```text
//! Drawing: background, discs, lines, triangles ──> SVG
//!                                              └─> Canvas (pixels) ──> PNG
//!                                                                  └─> a frame of a GIF, or of a film
//! ```
//!
//! The same drawing gives the same bytes on every system. Coordinates are pixels from the top left corner.

pub mod canvas;
pub mod drawing;
pub mod gif;
pub mod texture;
pub mod web;
