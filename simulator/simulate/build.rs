//! Tells `simulate` its version and its commit.

#[path = "../commit.rs"]
mod commit;

fn main() {
    commit::tell();
}
