//! A PrairieLearn course folder with one externally graded question.
//!
//! ```text
//! questions/NAME/info.json, question.html       the question
//! questions/NAME/tests/suite/                   scenes, oracle, rubric, hidden scenes
//! questions/NAME/tests/run.sh                   the entry point
//! image/Dockerfile, image/grade                 the image
//! ```

use std::io;

use serde_json::json;

use super::results;
use crate::package::PackageFile;

/// Settings of the question.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Settings {
    /// The assignment.
    pub assignment: String,
    /// Its title.
    pub title: String,
    /// A number that no other question has.
    pub uuid: String,
    /// The name of the image in a registry.
    pub image: String,
    /// The files that students hand in; a pattern such as `*.h` stands for any number of files, or none.
    pub files: Vec<String>,
    /// Whether there are hidden scenes.
    pub hidden: bool,
    /// Debian packages that submissions need.
    pub packages: Vec<String>,
    /// Seconds after which the grader ends.
    pub seconds: u32,
}

/// Seconds that PrairieLearn waits at most.
const LONGEST: u32 = 600;

impl Settings {
    /// The folder of the question.
    pub fn question(&self) -> String {
        format!("questions/spring-oracle-{}/", self.assignment)
    }
}

/// The files of the course folder besides the suite; `program` is `grade`.
///
/// # Errors
/// Never in practice: it writes to memory.
pub fn files(program: Vec<u8>, settings: &Settings) -> io::Result<Vec<PackageFile>> {
    let question = settings.question();
    let info = json!({
        "uuid": settings.uuid,
        "title": settings.title,
        "topic": "Mass-spring systems",
        "type": "v3",
        "gradingMethod": "External",
        "externalGradingOptions": {
            "image": settings.image,
            "entrypoint": ["bash", "/grade/tests/run.sh"],
            "timeout": LONGEST.min(settings.seconds + 60),
        },
    });
    let is_pattern = |name: &&String| name.contains(['*', '?', '[']);
    let (patterns, names): (Vec<_>, Vec<_>) = settings.files.iter().partition(is_pattern);
    let attribute = |name: &str, values: Vec<&String>| match values.as_slice() {
        [] => String::new(),
        values => {
            let values: Vec<&str> = values.iter().map(|value| value.as_str()).collect();
            format!(" {name}=\"{}\"", values.join(","))
        }
    };
    let attributes =
        attribute("file-names", names) + &attribute("optional-file-patterns", patterns);
    let html = format!(
        "<pl-question-panel>\n  <p>Hand in your simulator.</p>\n</pl-question-panel>\n\n\
         <pl-file-upload{attributes}></pl-file-upload>\n\n<pl-submission-panel>\n  \
         <pl-external-grader-results></pl-external-grader-results>\n  \
         <pl-file-preview></pl-file-preview>\n</pl-submission-panel>\n"
    );
    let mut arguments = format!("--assignment '{}'", settings.assignment);
    if settings.hidden {
        arguments += " --hidden hidden";
    }
    let run = include_str!("run.sh")
        .replace("SECONDS_OF_RUN", &settings.seconds.to_string())
        .replace("ARGUMENTS", &arguments);
    let docker = include_str!("Dockerfile").replace("PACKAGES", &settings.packages.join(" "));
    let not_gradable = results::not_gradable(
        "Your submission was not graded: the grader failed, which is not your fault. Tell your instructor.",
        "",
    )?;
    let text = |value: &serde_json::Value| format!("{value:#}\n");
    Ok(vec![
        PackageFile::data(format!("{question}info.json"), text(&info)),
        PackageFile::data(format!("{question}question.html"), html),
        PackageFile::data(format!("{question}tests/run.sh"), run),
        PackageFile::data(format!("{question}tests/not-gradable.json"), not_gradable),
        PackageFile::data("image/Dockerfile", docker),
        PackageFile::program("image/grade", program),
    ])
}
