//! `grade init`: writes the skeleton of a submission.

use std::path::{Path, PathBuf};

use clap::Args;
use grader::submission::init::{self, Language, Skeleton, Start};

use crate::args::{RootArgs, parse_named};
use crate::output::print;
use crate::stop::{Exit, Stop};

/// Write a working skeleton of a submission, with the protocol explained in comments
#[derive(Args)]
#[command(after_help = "\
Examples:
  grade init cpp my-simulator
  grade init python my-simulator --assignment t1m1
  grade init --pack functions-python --to my-functions")]
pub(crate) struct InitArgs {
    /// Language of the skeleton
    #[arg(value_name = "LANG", value_parser = parse_named(Language::ALL, Language::name), required_unless_present = "pack")]
    language: Option<Language>,

    /// Folder for the skeleton, created if missing
    #[arg(value_name = "DIR", default_value = "my-simulator")]
    folder: PathBuf,

    /// Write what students of this course pack start from to the folder --to, instead of a skeleton
    #[arg(long, value_name = "DIR", conflicts_with_all = ["language", "assignment"], requires = "to")]
    pack: Option<PathBuf>,

    /// The folder for the files of the pack
    #[arg(long, value_name = "DIR", requires = "pack")]
    to: Option<PathBuf>,

    /// Folder of the starter code, in the place of the one that the pack names
    #[arg(long, value_name = "DIR", requires = "pack")]
    starter: Option<PathBuf>,

    /// The assignment that it is for; `grade assignments` lists them [default: every scene]
    #[arg(long, value_name = "NAME")]
    assignment: Option<String>,

    #[command(flatten)]
    root: RootArgs,
}

impl InitArgs {
    /// Writes a skeleton and prints the next steps.
    pub(crate) fn run(&self) -> Result<Exit, Stop> {
        if let (Some(pack), Some(to)) = (&self.pack, &self.to) {
            return self.start(pack, to);
        }
        let folder = &self.folder;
        let Some(language) = &self.language else {
            return Err(Stop::bad_input("no language is named"));
        };
        let assignment = self.assignment.as_deref().map(|name| self.root.assignment(name));
        let assignment = assignment.transpose()?;
        let files = init::write(*language, assignment.as_ref(), folder);
        let mut text = String::new();
        for file in files.map_err(Stop::about(folder))? {
            text += &format!("wrote {}\n", file.display());
        }
        let mut folder = folder.display().to_string();
        if let Some(arguments) = language.arguments() {
            folder += &format!(" {arguments}");
        }
        let (what, only) = match Skeleton::new(*language, assignment.as_ref()).start {
            Start::Rests => (
                "reads scenes and holds every vertex at rest. Write its steps, and grade it",
                Some("slanted-spring"),
            ),
            Start::Moves => (
                "moves particles on which no force acts. Grade it, then add forces and integrators",
                Some("Inertia"),
            ),
            Start::Reads => {
                ("reads scenes. Fill in what says \"your code here\", and grade it", None)
            }
        };
        text += &format!("\nThe skeleton {what}:\n\n");
        if let Some(only) = only {
            text += &format!("    grade {folder} --only {only}\n");
        }
        text += &format!("    grade {folder}\n");
        print(text.as_bytes())?;
        Ok(Exit::Passed)
    }

    /// Writes what students of a pack start from.
    fn start(&self, named: &Path, to: &Path) -> Result<Exit, Stop> {
        let pack = self.root.pack(named, self.starter.as_deref())?;
        let files = pack.start(to).map_err(Stop::about(to))?;
        if files.is_empty() {
            let named = named.display();
            return Err(Stop::bad_input(format!(
                "{named}: students of this pack start from nothing\n  help: put files into its folder project/"
            )));
        }
        let (named, to) = (named.display(), to.display());
        let text = format!(
            "wrote {} files to {to}\n\nGrade them as they are:\n\n    grade --pack {named} {to}\n",
            files.len()
        );
        print(text.as_bytes())?;
        Ok(Exit::Passed)
    }
}
