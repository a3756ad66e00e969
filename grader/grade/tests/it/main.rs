//! Integration tests of the `grade` binary.

mod accuracy;
#[cfg(target_os = "linux")]
mod agreement;
#[cfg(target_os = "linux")]
mod altered;
#[cfg(target_os = "linux")]
mod assignments;
mod circles;
#[cfg(target_os = "linux")]
mod class;
#[cfg(target_os = "linux")]
mod class_attacks;
mod cli;
mod creative;
mod docs;
#[cfg(target_os = "linux")]
mod doors;
mod folder;
#[cfg(target_os = "linux")]
mod fuzz;
#[cfg(target_os = "linux")]
mod gradebooks;
mod hidden;
#[cfg(target_os = "linux")]
mod init;
#[cfg(target_os = "linux")]
mod installed;
#[cfg(target_os = "linux")]
mod layouts;
#[cfg(target_os = "linux")]
mod marks;
#[cfg(target_os = "linux")]
mod packs;
#[cfg(target_os = "linux")]
mod pages;
#[cfg(target_os = "linux")]
mod plan;
mod platforms;
mod probe;
#[cfg(target_os = "linux")]
mod real_programs;
#[cfg(target_os = "linux")]
mod similar;
mod stability;
mod student;
#[cfg(target_os = "linux")]
mod verify_report;
