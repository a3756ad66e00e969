//! `results.json`: one test per feature, and one for the hidden scenes of a feature.
//!
//! Texts are those of the text report, with its colours (`ansi`), which Gradescope does not read as markup.

use std::io;

use grader::grading::points;
use grader::grading::{Credit, FeatureResult, Grading, Hidden, SceneResult};
use grader::rubric::late::{PlatformRule, SubmissionLimit, Visibility};
use grader::suite::Section;
use report::SceneTimes;
use report::text;
use serde::Serialize;

use super::score::Score;

/// The data that the results show.
#[derive(Debug, Clone, Copy)]
pub struct Results<'a> {
    /// The grading.
    pub grading: &'a Grading,
    /// How long its scenes took.
    pub times: &'a SceneTimes,
    /// The points that count.
    pub score: Score,
    /// The rubric's rules.
    pub platform: PlatformRule,
}

#[derive(Serialize)]
struct Document {
    score: f64,
    output: String,
    output_format: &'static str,
    test_output_format: &'static str,
    test_name_format: &'static str,
    stdout_visibility: &'static str,
    tests: Vec<Test>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    leaderboard: Vec<Entry>,
    extra_data: ExtraData,
}

#[derive(Default, Serialize)]
struct Test {
    name: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    number: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    score: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    max_score: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    status: Option<&'static str>,
    output: String,
    visibility: &'static str,
    tags: Vec<String>,
}

#[derive(Serialize)]
struct Entry {
    name: &'static str,
    value: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    order: Option<&'static str>,
}

#[derive(Serialize)]
struct ExtraData {
    grader_version: &'static str,
    assignment: Option<String>,
    points_earned: Option<f64>,
    points_own: Option<f64>,
    /// Whether it was over the limit: the metadata of later submissions has this.
    #[serde(rename = "refused", skip_serializing_if = "is_false")]
    is_refused: bool,
}

fn is_false(value: &bool) -> bool {
    !value
}

impl Results<'_> {
    /// The document, with a newline at its end.
    ///
    /// # Errors
    /// Never in practice: it writes to memory.
    pub fn render(&self) -> io::Result<String> {
        let Self { grading, score, .. } = self;
        let same = same_failure(grading);
        let mut tests = Vec::new();
        for (section, number) in Section::ALL.into_iter().zip(1..) {
            let features = grading.features.iter().filter(|it| it.feature.section == section);
            for (result, place) in features.zip(1..) {
                let number = format!("{number}.{place}");
                tests.extend(self.tests(result, number, same.is_some())?);
            }
        }
        tests.extend(self.protection()?);
        let document = Document {
            score: score.counted,
            output: self.overview(same)?,
            output_format: "ansi",
            test_output_format: "ansi",
            test_name_format: "text",
            stdout_visibility: "hidden",
            tests,
            leaderboard: self.leaderboard(),
            extra_data: ExtraData {
                grader_version: env!("CARGO_PKG_VERSION"),
                assignment: grading.assignment.as_ref().map(|assignment| assignment.name.clone()),
                points_earned: Some(score.earned),
                points_own: Some(score.own),
                is_refused: false,
            },
        };
        render(&document)
    }

    /// The findings, the totals, and the changes of the points.
    fn overview(&self, same: Option<&SceneResult>) -> io::Result<String> {
        let mut out = Vec::new();
        if same.is_some() {
            let scenes = self.grading.features.iter().flat_map(|result| &result.scenes);
            text::write_scenes(&mut out, scenes, 1)?;
        }
        text::write_overview(&mut out, self.grading)?;
        let mut overview = utf8(out)?;
        for remark in self.score.remarks() {
            overview += &format!("  {remark}\n");
        }
        if self.grading.features.iter().any(FeatureResult::has_faults) {
            overview +=
                "  Tell your instructor: a part could not be graded, through no fault of yours.\n";
        }
        Ok(overview)
    }

    /// How programs were run, for instructors.
    fn protection(&self) -> io::Result<Option<Test>> {
        let Some(protections) = &self.grading.protection else { return Ok(None) };
        let mut out = Vec::new();
        text::write_protection(&mut out, protections)?;
        let (name, output) = ("Protection, for the instructor".to_owned(), utf8(out)?);
        Ok(Some(Test { name, output, visibility: "hidden", ..Test::default() }))
    }

    /// The test of a feature and, if it has hidden scenes, theirs. `is_told` if the overview explains the failures.
    fn tests(
        &self,
        result: &FeatureResult,
        number: String,
        is_told: bool,
    ) -> io::Result<Vec<Test>> {
        let section = result.feature.section;
        let name = crate::title(result);
        let tags = vec![
            section.name().to_owned(),
            result.feature.group.clone(),
            result.feature.integrator.to_owned(),
        ];
        let hidden_tests = result.hidden.n_scenes();
        let shipped = FeatureResult { hidden: Default::default(), ..result.clone() };
        let (of_shipped, of_hidden) = split(result);
        let mut tests = Vec::new();
        if !result.scenes.is_empty() {
            let mut out = Vec::new();
            if !is_told {
                text::write_scenes(&mut out, result.scenes.iter(), usize::MAX)?;
            }
            let head = crate::passed(result) + ".\n";
            tests.push(Test {
                name: name.clone(),
                number: Some(number),
                status: status(&shipped),
                output: head + &utf8(out)?,
                visibility: "visible",
                tags: tags.clone(),
                ..self.points(section, &of_shipped)
            });
        }
        if hidden_tests > 0 {
            let tally = &result.hidden;
            let others = text::verdicts(tally);
            let others = if others.is_empty() { others } else { format!(" Others: {others}.") };
            let only_hidden = FeatureResult { scenes: Vec::new(), ..result.clone() };
            tests.push(Test {
                name: format!("{name} (hidden scenes)"),
                status: status(&only_hidden),
                output: format!(
                    "{} of {hidden_tests} hidden scenes passed.{others}\n",
                    tally.n_passed()
                ),
                visibility: visibility(self.platform.hidden),
                tags,
                ..self.points(section, &of_hidden)
            });
        }
        Ok(tests)
    }

    /// A test with these points; without any where the section has none.
    fn points(&self, section: Section, credit: &Credit) -> Test {
        match section {
            Section::Unscored => Test::default(),
            _ => Test {
                score: Some(credit.shown(self.grading.faults).unwrap_or(0.0)),
                max_score: Some(credit.points),
                ..Test::default()
            },
        }
    }

    /// Points of all, and the time of programs that pass everything: speed compares only at equal accuracy.
    fn leaderboard(&self) -> Vec<Entry> {
        let Self { grading, times, score, platform } = self;
        if !platform.leaderboard {
            return Vec::new();
        }
        let mut entries = vec![Entry { name: "Points", value: score.counted, order: None }];
        let deciding = grading.features.iter().filter(|result| grading.decides(result));
        let is_complete = !matches!(grading.hidden, Hidden::NotRun { .. });
        let mut deciding = deciding.peekable();
        if is_complete && deciding.peek().is_some() && deciding.clone().all(FeatureResult::is_pass)
        {
            let scenes = deciding.flat_map(|result| &result.scenes);
            let seconds = scenes.filter_map(|scene| times.get(&scene.id));
            let value = seconds.map(std::time::Duration::as_secs_f64).sum::<f64>();
            let value = (value * 1000.0).round() / 1000.0;
            entries.push(Entry {
                name: "Seconds for all required scenes",
                value,
                order: Some("asc"),
            });
        }
        entries
    }
}

/// The results of a submission that was not graded. Students see `message`, instructors also `reason`.
///
/// # Errors
/// Never in practice: it writes to memory.
pub fn not_graded(message: &str, reason: &str, score: Score) -> io::Result<String> {
    let mut output = message.to_owned();
    for remark in score.remarks() {
        output += &format!("\n{remark}");
    }
    let test = Test {
        name: "Reason, for the instructor".to_owned(),
        output: reason.to_owned(),
        visibility: "hidden",
        ..Test::default()
    };
    render(&Document { tests: vec![test], ..ungraded(output, score, false) })
}

/// The results of a submission over the limit; the next one is graded if it comes in `wait` seconds later.
///
/// # Errors
/// Never in practice: it writes to memory.
pub fn refused(limit: SubmissionLimit, wait: f64, score: Score) -> io::Result<String> {
    let SubmissionLimit { submissions, hours } = limit;
    let minutes = (wait / 60.0).ceil() as u64;
    let output = format!(
        "Not graded: {submissions} submissions in {} hours are graded, and there were as many before this one. The next \
         one is graded if you hand it in {} h {} min after this one, or later.\nThe points are those of an earlier \
         submission: {}.\n",
        points::shown(hours.0),
        minutes / 60,
        minutes % 60,
        points::shown(score.counted)
    );
    render(&ungraded(output, score, true))
}

/// Results without tests.
fn ungraded(output: String, score: Score, is_refused: bool) -> Document {
    Document {
        score: score.counted,
        output,
        output_format: "text",
        test_output_format: "text",
        test_name_format: "text",
        stdout_visibility: "hidden",
        tests: Vec::new(),
        leaderboard: Vec::new(),
        extra_data: ExtraData {
            grader_version: env!("CARGO_PKG_VERSION"),
            assignment: None,
            points_earned: None,
            points_own: None,
            is_refused,
        },
    }
}

fn render(document: &Document) -> io::Result<String> {
    Ok(serde_json::to_string_pretty(document)? + "\n")
}

/// The credit of the shipped scenes and of the hidden ones. A feature that earns all or nothing has all its points with
/// the hidden scenes, if it has any, since these decide too.
fn split(result: &FeatureResult) -> (Credit, Credit) {
    let whole = result.credit();
    let hidden = &result.hidden;
    if hidden.n_scenes() == 0 {
        return (whole, Credit::default());
    }
    if !result.partial || result.scenes.is_empty() {
        return (Credit::default(), whole);
    }
    let weight = hidden.weight + result.scenes.iter().map(|scene| scene.weight).sum::<f64>();
    let part = |of_hidden: f64| result.points * of_hidden / weight;
    let of_hidden = Credit {
        points: part(hidden.weight),
        earned: part(hidden.weight_passed),
        unjudged: part(hidden.weight_unjudged),
    };
    let of_shipped = Credit {
        points: whole.points - of_hidden.points,
        // Differences can fall below 0 by a rounding error.
        earned: (whole.earned - of_hidden.earned).max(0.0),
        unjudged: (whole.unjudged - of_hidden.unjudged).max(0.0),
    };
    (of_shipped, of_hidden)
}

/// "passed" or "failed"; `None` if something could not be judged.
fn status(result: &FeatureResult) -> Option<&'static str> {
    match (result.has_faults(), result.is_pass()) {
        (true, _) => None,
        (false, true) => Some("passed"),
        (false, false) => Some("failed"),
    }
}

fn visibility(visibility: Visibility) -> &'static str {
    match visibility {
        Visibility::Visible => "visible",
        Visibility::AfterDueDate => "after_due_date",
        Visibility::AfterPublished => "after_published",
    }
}

/// The first scene, if all scenes have the same failure and no state, as after a failed build.
fn same_failure(grading: &Grading) -> Option<&SceneResult> {
    let mut scenes = grading.features.iter().flat_map(|result| &result.scenes);
    let first = scenes.next().filter(|scene| !scene.comparison.verdict.is_pass())?;
    let same = |scene: &SceneResult| {
        scene.comparison.states == 0 && scene.comparison.verdict == first.comparison.verdict
    };
    (same(first) && scenes.all(same)).then_some(first)
}

fn utf8(bytes: Vec<u8>) -> io::Result<String> {
    String::from_utf8(bytes).map_err(io::Error::other)
}
