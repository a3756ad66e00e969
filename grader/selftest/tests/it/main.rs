//! Planted mistakes: in the second simulator, in programs, and in the self-test as a whole.

mod mistakes;
#[cfg(unix)]
mod probe;
mod selftest;
