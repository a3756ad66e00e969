//! Where files and text of others enter the grader.
//!
//! - [`door`]: files of students.
//! - [`own_file`]: files of the person who runs `grade`.
//! - [`printed`]: text of students on its way to a terminal, a page or a table.
//! - [`seal`]: signatures of files that later runs read.

pub mod door;
pub mod own_file;
pub mod printed;
pub mod seal;
