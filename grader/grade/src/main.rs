//! `grade`: grades a simulator against the oracle's traces.

use std::process::ExitCode;

use clap::Parser;

mod args;
mod cli;
mod commands;
mod inputs;
mod installed;
mod packed;
mod submission;

mod actions;
mod bar;
mod interrupt;
mod last_failed;
mod output;
mod pages;
mod platform;
mod progress;
mod provenance;
mod reports;
mod scenes;
mod stop;
mod terminal;
mod watch;

use cli::Cli;
use stop::{Exit, Stop, complain};

fn main() -> ExitCode {
    #[cfg(target_os = "linux")]
    if let Some(code) = sandbox::serve() {
        return code;
    }
    if let Some(code) = grader::submission::received::serve() {
        return code;
    }
    if let Some(code) = grader::creative::serve(report::creative::draw) {
        return code;
    }
    let arguments = std::env::args_os().skip(1).map_while(|argument| argument.into_string().ok());
    let ended = cli::check_spelling(arguments).and_then(|()| {
        let cli = Cli::parse();
        std::panic::set_hook(Box::new(|panic| {
            complain(
                "internal error",
                format!("{panic}\n  help: this is a defect of grade; please report it"),
            );
        }));
        std::panic::catch_unwind(|| cli.run()).unwrap_or(Ok(Exit::GraderFault))
    });
    let exit = ended.unwrap_or_else(|Stop(exit, message)| {
        complain(if exit == Exit::Interrupted { "interrupted" } else { "error" }, message);
        exit
    });
    ExitCode::from(exit as u8)
}
