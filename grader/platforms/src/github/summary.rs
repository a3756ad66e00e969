//! The summary of a job, in Markdown. Texts that depend on the submission stand in fenced blocks, where nothing is markup.

use std::io;

use grader::grading::points;
use grader::grading::{FeatureResult, Grading};
use grader::suite::Section;
use report::text;

/// Bytes of a summary that a step may write, with room for what other programs of the step write.
const MOST: usize = 900 * 1024;

/// The summary. It explains at most `details` failures.
///
/// # Errors
/// Never in practice: it writes to memory.
pub fn render(grading: &Grading, details: usize) -> io::Result<String> {
    let mut summary = String::from("## Spring Oracle\n\n");
    let mut totals = Vec::new();
    text::write_overview(&mut totals, grading)?;
    summary += &fenced(&plain(totals)?);
    summary += "\n| feature | scenes | hidden | points | |\n| --- | --- | --- | --- | --- |\n";
    for section in Section::ALL {
        let features = grading.features.iter().filter(|it| it.feature.section == section);
        for result in features {
            summary += &row(result, grading);
        }
    }
    let mut failures = Vec::new();
    let scenes = grading.features.iter().flat_map(|result| &result.scenes);
    text::write_scenes(&mut failures, scenes, details)?;
    let failures = plain(failures)?;
    if !failures.trim().is_empty() {
        let room = MOST.saturating_sub(summary.len());
        summary += "\n<details><summary>Scenes that did not pass</summary>\n\n";
        summary += &fenced(cut(&failures, room));
        summary += "\n</details>\n";
    }
    Ok(summary)
}

/// The summary of a submission that was not graded.
pub fn not_graded(reason: &str) -> String {
    format!("## Spring Oracle\n\nNot graded.\n\n{}", fenced(reason))
}

/// A row of the table. Groups are names of folders of the course, and could still contain markup.
fn row(result: &FeatureResult, grading: &Grading) -> String {
    let section = result.feature.section;
    let name: String =
        crate::title(result).chars().filter(|it| !"|<>`*[]&\\\n".contains(*it)).collect();
    let points = match section {
        Section::Unscored => String::new(),
        _ => points::of(&result.credit(), grading.faults),
    };
    let hidden = match result.hidden.n_scenes() {
        0 => String::new(),
        all => format!("{}/{all}", result.hidden.n_passed()),
    };
    let verdict = match (result.has_faults(), result.is_pass()) {
        (true, _) => "not judged",
        (false, true) => "pass",
        (false, false) => "**FAIL**",
    };
    let scenes = format!("{}/{}", result.n_passed(), result.scenes.len());
    format!("| {name} | {scenes} | {hidden} | {points} | {verdict} |\n")
}

/// A block in which nothing is markup: its fence is longer than any run of backticks in it.
fn fenced(text: &str) -> String {
    let runs = text.split(|character| character != '`').map(str::len);
    let fence = "`".repeat(runs.max().unwrap_or(0).max(2) + 1);
    let text = text.trim_end();
    format!("{fence}text\n{text}\n{fence}\n")
}

/// The start of a text, of whole lines, within so many bytes.
fn cut(text: &str, bytes: usize) -> &str {
    if text.len() <= bytes {
        return text;
    }
    let end = text.as_bytes()[..bytes].iter().rposition(|byte| *byte == b'\n');
    &text[..end.unwrap_or(0)]
}

/// The text without colours.
fn plain(bytes: Vec<u8>) -> io::Result<String> {
    let text = String::from_utf8(bytes).map_err(io::Error::other)?;
    Ok(anstream::adapter::strip_str(&text).to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn summary_text_cannot_break_out_of_its_block() {
        assert_eq!(fenced("a\n"), "```text\na\n```\n");
        assert_eq!(fenced("```\n<script>"), "````text\n```\n<script>\n````\n");
        assert_eq!(
            (cut("ab\ncd\n", 100), cut("ab\ncd\n", 4), cut("abcd", 2)),
            ("ab\ncd\n", "ab", "")
        );
    }
}
