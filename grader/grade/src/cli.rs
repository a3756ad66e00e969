//! The command line.

use std::path::Path;

use clap::{CommandFactory, Parser, Subcommand};
use scene::spelling::closest;

use crate::commands::accuracy::AccuracyArgs;
use crate::commands::assignments::AssignmentsArgs;
use crate::commands::class::ClassCommand;
use crate::commands::completions::CompletionsArgs;
use crate::commands::creative::{CreativeArgs, GalleryArgs};
use crate::commands::explain::ExplainArgs;
use crate::commands::export::ExportCommand;
use crate::commands::fuzz::FuzzArgs;
use crate::commands::grade::GradeArgs;
use crate::commands::init::InitArgs;
use crate::commands::jacobians::JacobianArgs;
use crate::commands::needs::NeedsArgs;
use crate::commands::oracle::OracleCommand;
use crate::commands::pack::PackCommand;
use crate::commands::protection::ProtectionArgs;
use crate::commands::selftest::SelfTestArgs;
use crate::commands::stability::StabilityArgs;
use crate::commands::verify_report::VerifyReportArgs;
use crate::stop::{Exit, Stop};

/// Grade a mass-spring simulator, feature by feature, against oracle traces.
///
/// Without arguments, grade the built-in simulator on every scene of assets/ and extracreditassets/ against the
/// traces in expected/, and check the Jacobians of every force.
#[derive(Parser)]
#[command(name = "grade", version = env!("VERSION"), args_conflicts_with_subcommands = true)]
#[command(after_help = "\
Examples:
  grade my-simulator
  grade my-simulator --assignment t1m3
  grade my-simulator --only Spring --html pages
  grade --report text --report junit=report.xml

Exit codes: 0 all required features passed, 1 one failed, 2 bad usage or input, 3 grader fault or a full \
standard output, 130 interrupted (Ctrl-C).")]
pub(super) struct Cli {
    #[command(subcommand)]
    command: Option<Command>,

    #[command(flatten)]
    grade: GradeArgs,
}

#[derive(Subcommand)]
#[expect(clippy::large_enum_variant, reason = "one value a process")]
enum Command {
    Class(ClassCommand),
    Assignments(AssignmentsArgs),
    Explain(ExplainArgs),
    Fuzz(FuzzArgs),
    VerifyReport(VerifyReportArgs),
    Creative(CreativeArgs),
    Gallery(GalleryArgs),
    Jacobians(JacobianArgs),
    Accuracy(AccuracyArgs),
    Init(InitArgs),
    Stability(StabilityArgs),
    Needs(NeedsArgs),
    Protection(ProtectionArgs),
    Completions(CompletionsArgs),
    Selftest(SelfTestArgs),
    /// Write what a course uploads to a platform, so that the platform grades with grade
    #[command(subcommand)]
    Export(ExportCommand),
    /// Check a course pack
    #[command(subcommand)]
    Pack(PackCommand),
    /// Regenerate or verify the oracle traces; draw hidden scenes
    #[command(subcommand)]
    Oracle(OracleCommand),
}

impl Cli {
    pub(super) fn run(&self) -> Result<Exit, Stop> {
        let Some(command) = &self.command else { return self.grade.run() };
        match command {
            Command::Class(args) => args.run(),
            Command::Assignments(args) => args.run(),
            Command::Explain(args) => args.run(),
            Command::Fuzz(args) => args.run(),
            Command::VerifyReport(args) => args.run(),
            Command::Creative(args) => args.run(),
            Command::Gallery(args) => args.run(),
            Command::Jacobians(args) => args.run(),
            Command::Accuracy(args) => args.run(),
            Command::Init(args) => args.run(),
            Command::Stability(args) => args.run(),
            Command::Needs(args) => args.run(),
            Command::Protection(args) => args.run(),
            Command::Completions(args) => args.run(Cli::command()),
            Command::Selftest(args) => args.run(),
            Command::Export(command) => command.run(),
            Command::Pack(command) => command.run(),
            Command::Oracle(command) => command.run(),
        }
    }
}

/// Checks that no argument is a misspelled command, where a submission or a folder can stand too.
///
/// # Errors
/// If the first argument is neither a command, a file nor a folder, and similar to a command.
pub(super) fn check_spelling(arguments: impl Iterator<Item = String>) -> Result<(), Stop> {
    let mut command = Cli::command();
    for argument in arguments {
        if let Some(found) = command.find_subcommand(&argument) {
            command = found.clone();
            continue;
        }
        let names: Vec<&str> = command.get_subcommands().map(clap::Command::get_name).collect();
        let Some(name) = closest(&argument, &names) else { break };
        if argument.starts_with('-') || Path::new(&argument).exists() {
            break;
        }
        return Err(Stop::bad_input(format!(
            "{argument}: no command, file or folder has this name\n  help: did you mean the command {name:?}?"
        )));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The examples in the help of a command and of those below it.
    fn examples(command: &clap::Command) -> Vec<String> {
        let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        let own = help.lines().filter_map(|line| line.strip_prefix("  ")).map(str::to_owned);
        own.chain(command.get_subcommands().flat_map(examples)).collect()
    }

    #[test]
    fn every_example_parses_and_every_command_has_one() {
        let examples = examples(&Cli::command());
        for example in &examples {
            if let Err(error) = Cli::try_parse_from(example.split_whitespace()) {
                panic!("{example}: {error}");
            }
        }
        let mut commands = vec![("grade".to_owned(), Cli::command())];
        while let Some((name, command)) = commands.pop() {
            let begins =
                |example: &String| (example.to_owned() + " ").starts_with(&(name.clone() + " "));
            assert!(examples.iter().any(begins), "no example of {name}");
            let further = command.get_subcommands();
            commands.extend(further.map(|sub| (format!("{name} {}", sub.get_name()), sub.clone())));
        }
    }

    #[test]
    fn misspelled_command_is_answered_by_the_nearest() {
        let check = |line: &str| {
            let checked = check_spelling(line.split_whitespace().map(str::to_owned));
            checked.err().map(|Stop(_, message)| message)
        };
        let nearest = |line: &str| check(line).is_some_and(|message| message.contains("\"class\""));
        assert!(nearest("clas hand-ins") && nearest("CLASSS") && nearest("calss -o x y"));
        assert!(check("class run-shrd plan.json 3").unwrap().contains("\"run-shard\""));
        assert!(check("oracle verfy").unwrap().contains("\"verify\""));
        for right in ["class hand-ins", "my-simulator", "-o clas", "src", "help clas"] {
            assert_eq!(check(right), None, "{right}");
        }
    }

    #[test]
    fn completions_of_bash_offer_commands_and_options() {
        let mut script = Vec::new();
        clap_complete::generate(
            clap_complete::Shell::Bash,
            &mut Cli::command(),
            "grade",
            &mut script,
        );
        let ask = "COMP_WORDS=(grade \"$@\") COMP_CWORD=$#; _grade grade \"${!#}\" x; echo \"${COMPREPLY[@]}\"";
        let script = String::from_utf8(script).unwrap() + ask;
        let answer = |words: &[&str]| {
            let bash = std::process::Command::new("bash")
                .args(["-c", &script, "bash"])
                .args(words)
                .output();
            String::from_utf8(bash.unwrap().stdout).unwrap()
        };
        assert!(answer(&["cl"]).split_whitespace().any(|word| word == "class"));
        assert!(answer(&["class", "--gradeb"]).contains("--gradebook"));
        assert!(answer(&["export", "class"]).contains("classroom50"));
    }
}
