//! The zip of a Gradescope autograder.
//!
//! ```text
//! setup.sh            run once, as root, when the image is built
//! run_autograder      run for each submission
//! not-graded.json     the results until the grader has written its own
//! grade, or source/   the grader
//! suite/              assets/, extracreditassets/, expected/, hidden/
//! ```

use std::io;

use super::results;
use super::score::Score;
use crate::package::PackageFile;
use crate::shell_word;

/// The minor version of glibc 2 of the oldest base image, Ubuntu 22.04.
pub const GLIBC: u32 = 35;

/// The program in the package.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Program {
    /// Built; its bytes.
    Built(Vec<u8>),
    /// To be built on the platform, from the files in `source/`.
    Source,
}

/// Settings of the package.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Settings {
    /// The assignment. Without one, a submission could choose its own.
    pub assignment: String,
    /// Whether the package has hidden scenes.
    pub hidden: bool,
    /// Debian packages that submissions need.
    pub packages: Vec<String>,
    /// Seconds after which the grader ends, so that it can still write results.
    pub seconds: u32,
}

/// The files of the package besides the suite and the source.
///
/// # Errors
/// Never in practice: it writes to memory.
pub fn files(program: Program, settings: &Settings) -> io::Result<Vec<PackageFile>> {
    let Settings { assignment, hidden, packages, seconds } = settings;
    let build = match program {
        Program::Built(_) => "",
        Program::Source => include_str!("build.sh"),
    };
    let mut packages = packages.clone();
    if program == Program::Source {
        packages.extend(["build-essential", "ca-certificates", "curl"].map(str::to_owned));
    }
    let hidden = if *hidden { " --hidden \"$source/suite/hidden\"" } else { "" };
    let setup = include_str!("setup.sh")
        .replace("HIDDEN", hidden)
        .replace(
            "PACKAGES",
            &packages.iter().map(|it| shell_word(it)).collect::<Vec<_>>().join(" "),
        )
        .replace("BUILD\n", build);
    let arguments = format!(" --assignment {}{hidden}", shell_word(assignment));
    let run = include_str!("run_autograder.sh")
        .replace("SECONDS_OF_RUN", &seconds.to_string())
        .replace(" ARGUMENTS", &arguments);
    let not_graded = results::not_graded(
        "Your submission was not graded: the autograder failed. Your instructor can see why, and run it again.",
        "grade did not start, or was killed. The standard output of the run says more.",
        Score::default(),
    )?;
    let mut files = vec![
        PackageFile::program("setup.sh", setup),
        PackageFile::program("run_autograder", run),
        PackageFile::data("not-graded.json", not_graded),
    ];
    if let Program::Built(bytes) = program {
        files.push(PackageFile::program("grade", bytes));
    }
    Ok(files)
}
