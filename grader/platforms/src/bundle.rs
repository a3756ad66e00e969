//! Bundles: a folder with `grade`, the suite, and a script that a platform runs for each submission.
//!
//! ```text
//! Classroom 50    autograders/ASSIGNMENT/          autograder.py, below a classroom's folder of the classroom50 repository
//! Codio           .guides/secure/spring-oracle/    grade.py, in the workspace of the assignment
//! ```
//!
//! Formats: Classroom 50's page "Advanced Autograding" and Codio's page "Assignment Level Scripts", of 2026.

use std::io;

use crate::package::PackageFile;

/// A platform that runs a script.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Platform {
    /// The folder, in that which a course names; `ASSIGNMENT` stands for the name of the assignment.
    folder: &'static str,
    /// Name of the script.
    script: &'static str,
    template: &'static str,
    /// Seconds after which grading ends, so that there is time to report.
    seconds: u32,
    /// Whether students can read the bundle.
    pub is_public: bool,
    /// Bytes of the bundle, compressed, that the platform fetches at most.
    pub most: Option<usize>,
}

/// Classroom 50.
pub const CLASSROOM_50: Platform = Platform {
    folder: "autograders/ASSIGNMENT/",
    script: "autograder.py",
    template: include_str!("classroom50/autograder.py"),
    seconds: 0,
    is_public: true,
    most: Some(10 << 20),
};

/// Codio.
pub const CODIO: Platform = Platform {
    folder: ".guides/secure/spring-oracle/",
    script: "grade.py",
    template: include_str!("codio/grade.py"),
    seconds: 150,
    is_public: false,
    most: None,
};

impl Platform {
    /// The folder of the bundle.
    pub fn folder(self, assignment: &str) -> String {
        self.folder.replace("ASSIGNMENT", assignment)
    }

    /// The path of the script.
    pub fn script(self, assignment: &str) -> String {
        self.folder(assignment) + self.script
    }

    /// The script and `grade`.
    ///
    /// # Errors
    /// Never in practice: a name has a JSON form.
    pub fn files(
        self,
        program: Vec<u8>,
        assignment: &str,
        hidden: bool,
    ) -> io::Result<Vec<PackageFile>> {
        // Text of Python in double quotes is that of JSON.
        let name = serde_json::to_string(assignment)?;
        let hidden = if hidden { ", \"--hidden\", FOLDER / \"suite/hidden\"" } else { "" };
        let script = self
            .template
            .replace("SECONDS_OF_RUN", &self.seconds.to_string())
            .replace("ARGUMENTS", &format!("\"--assignment\", {name}{hidden}"))
            .replace("ASSIGNMENT_NAME", &name);
        let folder = self.folder(assignment);
        Ok(vec![
            PackageFile::data(format!("{folder}{}", self.script), script),
            PackageFile::program(format!("{folder}grade"), program),
        ])
    }
}
