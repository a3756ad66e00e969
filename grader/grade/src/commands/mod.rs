//! One module for each command: its arguments, and what it does.

pub(crate) mod accuracy;
pub(crate) mod assignments;
pub(crate) mod class;
pub(crate) mod completions;
pub(crate) mod creative;
pub(crate) mod explain;
pub(crate) mod export;
pub(crate) mod fuzz;
pub(crate) mod grade;
pub(crate) mod init;
pub(crate) mod jacobians;
pub(crate) mod needs;
pub(crate) mod oracle;
pub(crate) mod pack;
pub(crate) mod protection;
pub(crate) mod selftest;
pub(crate) mod stability;
pub(crate) mod verify_report;
