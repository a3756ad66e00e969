//! Integration tests of the studies.

mod accuracy;
mod needs;
mod needs_allocations;
mod pictures;
mod scale;
