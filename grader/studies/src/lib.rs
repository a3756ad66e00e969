//! Studies of simulators: accuracy against cost, stability on hard scenes, and resources of each scene.

pub mod accuracy;
pub mod needs;
pub mod report;
pub mod stability;

mod store;
