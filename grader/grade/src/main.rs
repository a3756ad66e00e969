//! `grade`: grades a simulator against the oracle's traces.

use std::process::ExitCode;

use clap::Parser;

mod args;
mod inputs;
mod submission;

mod accuracy;
mod assignments;
mod class;
mod creative;
mod explain;
mod export;
mod grading;
mod init;
mod jacobians;
mod needs;
mod oracle;
mod selftest;
mod stability;
mod verify_report;

mod actions;
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

use args::{Cli, Command, ExportCommand, OracleCommand};
use inputs::find_assignment;
use stop::{Exit, Stop, complain};

fn main() -> ExitCode {
    #[cfg(target_os = "linux")]
    if let Some(code) = sandbox::serve() {
        return code;
    }
    if let Some(code) = grader::creative::serve(report::creative::draw) {
        return code;
    }
    let cli = Cli::parse();
    std::panic::set_hook(Box::new(|panic| {
        complain(
            "internal error",
            format!("{panic}\n  help: this is a defect of grade; please report it"),
        );
    }));
    let exit = match std::panic::catch_unwind(|| run(&cli)) {
        Ok(Ok(exit)) => exit,
        Ok(Err(Stop(exit, message))) => {
            complain(if exit == Exit::Interrupted { "interrupted" } else { "error" }, message);
            exit
        }
        Err(_) => Exit::GraderFault,
    };
    ExitCode::from(exit as u8)
}

fn run(cli: &Cli) -> Result<Exit, Stop> {
    match &cli.command {
        None => grading::grade(&cli.grade),
        Some(Command::Class(args)) => class::run(args),
        Some(Command::Assignments { name, suite }) => assignments::show(name.as_deref(), suite),
        Some(Command::Explain(args)) => explain::explain(args),
        Some(Command::Creative(args)) => creative::check(args),
        Some(Command::Gallery(args)) => creative::gallery(args),
        Some(Command::Jacobians(args)) => jacobians::check(args),
        Some(Command::Accuracy(args)) => accuracy::measure(args),
        Some(Command::Stability(args)) => stability::run(args),
        Some(Command::Needs { only, suite }) => needs::run(suite, only),
        Some(Command::Init { language, folder, assignment, root }) => {
            let assignment = assignment.as_deref();
            let assignment = assignment.map(|name| find_assignment(name, root.as_deref()));
            init::init(language, folder, assignment.transpose()?.as_ref())
        }
        Some(Command::Export(ExportCommand::Gradescope(args))) => export::gradescope(args),
        Some(Command::Export(ExportCommand::Prairielearn(args))) => export::prairielearn(args),
        Some(Command::Export(ExportCommand::Github(args))) => export::github(args),
        Some(Command::Selftest(args)) => selftest::run(args),
        Some(Command::VerifyReport(args)) => verify_report::verify(args),
        Some(Command::Oracle(OracleCommand::Regenerate { accept, suite })) => {
            oracle::regenerate(accept.as_deref(), suite)
        }
        Some(Command::Oracle(OracleCommand::Review { suite })) => oracle::review::run(suite),
        Some(Command::Oracle(OracleCommand::Verify { suite })) => oracle::verify(suite),
        Some(Command::Oracle(OracleCommand::GenerateHidden(args))) => oracle::hidden::run(args),
    }
}
