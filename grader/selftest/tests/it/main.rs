//! Integration tests of the self-test: planted mistakes in the second simulator and in programs.

mod drawn_scenes;
mod mistakes;
#[cfg(unix)]
mod probe;
mod selftest;
mod sibling;
