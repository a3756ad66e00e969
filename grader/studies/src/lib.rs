//! Studies of simulators: accuracy against cost, stability on hard scenes, and what each scene needs.

pub mod accuracy;
pub mod needs;
pub mod report;
pub mod stability;
