//! Annotations: `::error file=F,line=L,title=T::message`. GitHub shows at most ten errors and ten warnings of a step.

use diagnosis::findings::FindingKind;
use grader::grading::{FeatureResult, Grading, SceneResult};
use grader::suite::Section;
use grader::verdict::{Failure, Verdict};

/// Errors and warnings that a step shows, each.
const SHOWN: usize = 10;

/// Annotations, a line each: errors of the compiler at their files, then the features that did not pass.
pub fn render(grading: &Grading) -> String {
    let mut errors = Vec::new();
    let mut warnings = Vec::new();
    let scenes = grading.features.iter().flat_map(|result| &result.scenes);
    let output = scenes.clone().find_map(|scene| match &scene.comparison.verdict {
        verdict @ Verdict::Fail(Failure::BuildFailed { .. }) => Some(verdict.to_string()),
        _ => None,
    });
    errors.extend(output.iter().flat_map(|output| compiler_errors(output)));
    for result in grading.features.iter().filter(|result| !result.is_pass()) {
        let decides = grading.decides(result);
        let kind = if decides { "error" } else { "warning" };
        let line =
            || command(kind, &[("title", &crate::title(result))], &sentence(result, grading));
        match result.feature.section {
            Section::Unscored => {}
            _ if decides => errors.push(line()),
            // Nobody needs to hear that extra credit was not tried.
            _ if is_untried(result) => {}
            _ => warnings.push(line()),
        }
    }
    let lines = |lines: Vec<String>| lines.into_iter().take(SHOWN).collect::<String>();
    lines(errors) + &lines(warnings)
}

/// The annotation of a submission that was not graded.
pub fn not_graded(reason: &str) -> String {
    command("error", &[("title", "Not graded")], reason)
}

/// Whether a feature is not implemented at all.
fn is_untried(result: &FeatureResult) -> bool {
    let is_lack = |scene: &SceneResult| scene.comparison.verdict.is_lack();
    !result.scenes.is_empty() && result.scenes.iter().all(is_lack) && result.hidden.n_passed() == 0
}

/// How many scenes passed, the verdict of the first other one, and what is proven about the failures.
fn sentence(result: &FeatureResult, grading: &Grading) -> String {
    let (passed, all) = (result.n_passed(), result.scenes.len());
    let mut sentence = format!("{passed} of {all} scenes passed");
    let not_passed = |scene: &&SceneResult| !scene.comparison.verdict.is_pass();
    if let Some(first) = result.scenes.iter().find(not_passed) {
        let verdict = first.comparison.verdict.name().replace('-', " ");
        sentence += &format!("; {}: {verdict}", first.id);
    }
    if result.hidden.n_scenes() > 0 {
        let (passed, all) = (result.hidden.n_passed(), result.hidden.n_scenes());
        sentence += &format!("; {passed} of {all} hidden scenes passed");
    }
    let is_here = |name: &String| result.scenes.iter().any(|scene| scene.id == *name);
    let findings =
        grading.findings.list.iter().filter(|finding| finding.kind == FindingKind::Cause);
    for finding in findings.filter(|finding| finding.scenes.iter().any(is_here)) {
        sentence += &format!("\n{finding}");
    }
    sentence
}

/// Errors in a compiler's output, such as `student.cpp:10:5: error: expected ';'`.
fn compiler_errors(output: &str) -> impl Iterator<Item = String> {
    output.lines().filter_map(|line| {
        let (place, message) = line
            .trim()
            .split_once(": error: ")
            .or_else(|| line.trim().split_once(": fatal error: "))?;
        let mut parts = place.split(':');
        let (file, row) = (parts.next()?, parts.next()?);
        // Only files of the submission: a path within it.
        let is_within = !file.is_empty() && !file.starts_with('/') && !file.contains("..");
        let is_number = |text: &str| !text.is_empty() && text.bytes().all(|it| it.is_ascii_digit());
        (is_within && is_number(row)).then(|| {
            command("error", &[("file", file), ("line", row), ("title", "Does not build")], message)
        })
    })
}

/// A workflow command, with escaped properties and message.
fn command(name: &str, properties: &[(&str, &str)], message: &str) -> String {
    let data = |text: &str| text.replace('%', "%25").replace('\r', "%0D").replace('\n', "%0A");
    let property = |text: &str| data(text).replace(':', "%3A").replace(',', "%2C");
    let properties = properties.iter().map(|(name, value)| format!("{name}={}", property(value)));
    format!("::{name} {}::{}\n", properties.collect::<Vec<_>>().join(","), data(message))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn annotation_text_cannot_inject_commands() {
        let line =
            command("error", &[("file", "a,b:c%\n.cpp"), ("title", "T")], "50 %\r\n::error::x");
        assert_eq!(line, "::error file=a%2Cb%3Ac%25%0A.cpp,title=T::50 %25%0D%0A::error::x\n");
    }

    #[test]
    fn errors_of_compilers_are_found_in_the_files_of_the_submission() {
        let output = "exit status 1\nsrc/a.cpp:10:5: error: expected ';'\n  a.hpp:3: error: no\n\
                      /usr/include/x.h:1:1: error: y\n../z.c:1: error: z\na.cpp:x: error: w\nb.cpp:7:1: warning: v\n\
                      c.cpp:2:10: fatal error: n.h: No such file\n";
        let found: Vec<String> = compiler_errors(output).collect();
        assert_eq!(
            found,
            [
                "::error file=src/a.cpp,line=10,title=Does not build::expected ';'\n",
                "::error file=a.hpp,line=3,title=Does not build::no\n",
                "::error file=c.cpp,line=2,title=Does not build::n.h: No such file\n",
            ]
        );
    }
}
