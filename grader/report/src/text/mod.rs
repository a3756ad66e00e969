//! Text reports of a grading.
//!
//! ```text
//! brief.rs             the default: totals and failed features, each finding with an example, what to do next
//! mod.rs               all: every feature and scene, failures in detail, totals, findings; and what both share
//! failures.rs          failed scenes in detail
//! circumstances.rs     how a submission was judged and run
//! ```
//!
//! Always writes colours; the output stream strips them if needed.

mod brief;
mod circumstances;
mod failures;

use std::io::{self, Write};

use anstyle::Style;

use super::{jacobians, probe};
use crate::remarks::{self, counted};
use crate::table::{self, BAD, BOLD, Cell, DIM, GOOD, ODD, header};
use crate::wrap::wrap;
use diagnosis::findings::{Finding, Findings, TaskFinding, TaskVerdict};
use grader::grading::points;
use grader::grading::{
    Adjustment, AssignmentName, Credit, FeatureResult, Grading, GradingOutcome, Hidden,
    HiddenTally, NotRunReason, SceneResult, Totals,
};
use grader::probe::Probing;
use grader::rubric::creative::CRITERIA;
use grader::suite::Section;
use grader::verdict::Verdict;

use circumstances::write_warnings;
pub use circumstances::{WEAKER, write_protection};
pub(super) use circumstances::{missing, write_circumstances, write_provenance, write_unprotected};
pub(crate) use failures::write_failure;
pub use failures::write_scenes;
use failures::{write_digits, write_failed};

/// Options of the report.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TextOptions {
    /// How much it shows.
    pub amount: Amount,
    /// Maximum width of a line, in columns.
    pub width: usize,
    /// The commands that go on from here; `None` proposes none.
    pub next: Option<NextCommands>,
}

/// How much a report shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Amount {
    /// Totals, failed features and an example of each finding.
    Brief,
    /// Every feature and scene, and this number of failed scenes in detail.
    Full {
        /// Number of failed scenes.
        details: usize,
    },
}

/// Inputs of the commands that a report proposes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NextCommands {
    /// The submission and the options with which `grade` finds and runs it.
    pub arguments: String,
    /// The page that this run wrote.
    pub page: Option<String>,
}

/// Readers of a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Audience {
    /// Teachers: the report also says how programs were run.
    Graders,
    /// Students of a platform, who cannot change how programs are run.
    Students,
}

/// Writes the report.
///
/// # Errors
/// If writing fails.
pub fn write(out: &mut dyn Write, grading: &Grading, options: &TextOptions) -> io::Result<()> {
    let mut text = Vec::new();
    match options.amount {
        Amount::Brief => brief::write(&mut text, grading)?,
        Amount::Full { details } => write_full(&mut text, grading, options.width, details)?,
    }
    if let Some(next) = &options.next {
        brief::write_next(&mut text, grading, next, options.width)?;
    }
    out.write_all(wrap(&String::from_utf8_lossy(&text), options.width).as_bytes())
}

fn write_full(
    out: &mut dyn Write,
    grading: &Grading,
    width: usize,
    details: usize,
) -> io::Result<()> {
    for section in Section::ALL {
        let groups: Vec<&[FeatureResult]> = grading.groups(section).collect();
        if !groups.is_empty() {
            writeln!(out, "{BOLD}{}{BOLD:#}", title(section))?;
            write_features(out, &groups, grading)?;
            writeln!(out)?;
        }
    }
    if !grading.jacobians.is_empty() {
        jacobians::text::write_brief(out, &grading.jacobians.forces)?;
        writeln!(out)?;
    }
    if let Some(probing) = offered(grading) {
        probe::text::write_brief(out, probing)?;
        writeln!(out)?;
    }
    writeln!(out, "{BOLD}Scenes{BOLD:#}")?;
    let row = |scene: &SceneResult| {
        let verdict = &scene.comparison.verdict;
        let name = Cell::left(verdict.name().replace('-', " "));
        vec![Cell::left(scene.id.clone()), name.styled(style(verdict))]
    };
    table::write_unnamed(out, &remarks::scenes(grading).map(row).collect::<Vec<_>>())?;
    writeln!(out)?;
    write_failed(out, remarks::scenes(grading), details, width)?;
    write_hidden(out, grading)?;
    write_summary(out, grading, Audience::Graders, Remarks::All)?;
    writeln!(out)?;
    write_findings(out, &grading.findings)
}

/// The style of a verdict.
fn style(verdict: &Verdict) -> Style {
    match verdict {
        Verdict::Pass => GOOD,
        Verdict::Fail(_) if verdict.is_lack() => ODD,
        Verdict::Fail(_) => BAD,
        Verdict::GraderFault(_) => ODD,
    }
}

/// Measurements of a program, if it offers any force.
fn offered(grading: &Grading) -> Option<&Probing> {
    grading.probing.as_ref().filter(|probing| probing.counts().1 > 0)
}

/// Writes the number of hidden scenes with each verdict, and nothing else about them.
fn write_hidden(out: &mut dyn Write, grading: &Grading) -> io::Result<()> {
    let failed: Vec<&FeatureResult> = grading
        .features
        .iter()
        .filter(|result| result.hidden.n_passed() < result.hidden.n_scenes())
        .collect();
    if failed.is_empty() {
        return Ok(());
    }
    writeln!(out, "{BOLD}Hidden scenes that did not pass{BOLD:#}, by their verdicts")?;
    let row = |result: &&FeatureResult| {
        vec![
            Cell::left(result.feature.group.clone()),
            Cell::left(result.feature.integrator),
            Cell::left(verdicts(&result.hidden)),
        ]
    };
    table::write_unnamed(out, &failed.iter().map(row).collect::<Vec<_>>())?;
    writeln!(out)
}

/// The verdicts other than a pass, with their counts.
pub fn verdicts(tally: &HiddenTally) -> String {
    let others = tally.verdicts.iter().filter(|(name, _)| **name != Verdict::Pass.name());
    let others = others.map(|(name, count)| format!("{count} {}", name.replace('-', " ")));
    others.collect::<Vec<_>>().join(", ")
}

/// The heading of a section.
pub fn title(section: Section) -> &'static str {
    match section {
        Section::Required => "Required",
        Section::ExtraCredit => "Extra credit",
        Section::Unscored => "Without points",
    }
}

fn write_features(
    out: &mut dyn Write,
    groups: &[&[FeatureResult]],
    grading: &Grading,
) -> io::Result<()> {
    let names = [
        "group",
        "integrator",
        "scenes",
        "hidden",
        "error x",
        "error v",
        "points",
        "not judged",
        "verdict",
    ];
    let credits = |credit: &Credit| {
        let unjudged = if credit.unjudged > 0.0 { points::unjudged(credit) } else { String::new() };
        [points::of(credit, grading.faults), unjudged].map(Cell::right)
    };
    let sum = |group: &str, what: &str, totals: Totals| -> Vec<Cell> {
        let [earned, unjudged] = credits(&totals.credit);
        let row = [
            Cell::left(group),
            Cell::left(what),
            Cell::right(count(totals.passed, totals.scenes)),
            Cell::right(count(totals.hidden_passed, totals.hidden)),
            Cell::right(""),
            Cell::right(""),
            earned,
            unjudged,
        ];
        row.map(|cell| cell.styled(DIM)).into()
    };
    let mut rows = vec![header(&names, 2..8)];
    let mut lacking: Vec<&FeatureResult> = Vec::new();
    for group in groups {
        let (lacks, there): (Vec<&FeatureResult>, _) = group.iter().partition(|r| r.is_lacking());
        lacking.extend(lacks);
        for result in &there {
            let largest = result.largest_residuals();
            let nothing = || "-".to_owned();
            let [earned, unjudged] = credits(&result.credit());
            rows.push(vec![
                Cell::left(result.feature.group.clone()),
                Cell::left(result.feature.integrator),
                Cell::right(count(result.n_passed(), result.scenes.len())),
                Cell::right(count(result.hidden.n_passed(), result.hidden.n_scenes())),
                Cell::right(largest.map_or_else(nothing, |(position, _)| residual(position))),
                Cell::right(largest.map_or_else(nothing, |(_, velocity)| residual(velocity))),
                earned,
                unjudged,
                verdict_cell(result),
            ]);
        }
        if there.len() > 1 {
            rows.push(sum("", "together", Totals::of(there)));
        }
    }
    if !lacking.is_empty() {
        let features = counted(lacking.len(), "feature");
        rows.push(sum("not implemented", &features, Totals::of(lacking)));
    }
    if !groups.iter().copied().flatten().any(FeatureResult::has_faults) {
        rows.iter_mut().for_each(|row| drop(row.remove(7)));
    }
    let is_unscored = |result: &FeatureResult| result.feature.section == Section::Unscored;
    if groups.iter().copied().flatten().all(is_unscored) {
        rows.iter_mut().for_each(|row| drop(row.remove(6)));
    }
    if grading.hidden != Hidden::Run {
        rows.iter_mut().for_each(|row| drop(row.remove(3)));
    }
    table::write(out, &rows)
}

fn verdict_cell(result: &FeatureResult) -> Cell {
    match result.has_faults() {
        false if result.is_pass() => Cell::left("pass").styled(GOOD),
        // Explains why the feature earns no points.
        false if !result.partial && result.has_passes() => {
            Cell::left("FAIL (all or nothing)").styled(BAD)
        }
        false => Cell::left("FAIL").styled(BAD),
        true => Cell::left("FAULT").styled(ODD),
    }
}

/// `2/3`, or `-` where `all` is 0.
pub(super) fn count(passed: usize, all: usize) -> String {
    if all == 0 { "-".to_owned() } else { format!("{passed}/{all}") }
}

pub(super) fn residual(value: f64) -> String {
    if value == 0.0 { "0".to_owned() } else { format!("{value:.1e}") }
}

/// Writes what is wrong, in the order in which a student should read it.
pub fn write_findings(out: &mut dyn Write, findings: &Findings) -> io::Result<()> {
    if !findings.list.is_empty() {
        write_list(out, findings)?;
    }
    write_tasks(out, findings)
}

fn write_tasks(out: &mut dyn Write, findings: &Findings) -> io::Result<()> {
    if findings.tasks.is_empty() {
        return Ok(());
    }
    writeln!(out, "{BOLD}Tasks{BOLD:#}, as far as positions tell")?;
    for TaskFinding { task, verdict } in &findings.tasks {
        let style = match verdict {
            TaskVerdict::Wrong(_) => BAD,
            TaskVerdict::Consistent { unexplained: 0, .. } => GOOD,
            _ => ODD,
        };
        writeln!(out, "  {:<5}  {style}{verdict}{style:#}", task.name())?;
    }
    writeln!(out)
}

fn write_list(out: &mut dyn Write, findings: &Findings) -> io::Result<()> {
    writeln!(out, "{BOLD}Findings{BOLD:#}")?;
    let (lacks, wrong): (Vec<&Finding>, Vec<&Finding>) =
        findings.list.iter().partition(|finding| finding.kind.is_lack());
    wrong.iter().try_for_each(|finding| write_finding(out, finding))?;
    for note in Finding::notes(findings.list.iter()) {
        writeln!(out, "    {DIM}{note}{DIM:#}")?;
    }
    write_lacks(out, &lacks)?;
    if let Some(progress) = &findings.progress {
        writeln!(out, "  {progress}")?;
    }
    writeln!(out)
}

fn write_finding(out: &mut dyn Write, finding: &Finding) -> io::Result<()> {
    let (sentence, evidence) = (finding.sentence(), finding.evidence());
    writeln!(out, "  {BAD}{sentence}{BAD:#} {DIM}({evidence}){DIM:#}")
}

fn write_lacks(out: &mut dyn Write, lacks: &[&Finding]) -> io::Result<()> {
    lacks.chunk_by(|a, b| a.kind == b.kind).try_for_each(|group| {
        let all: Vec<String> = group.iter().map(|finding| finding.words.join(" or ")).collect();
        let title = group[0].kind.title();
        writeln!(out, "  {ODD}{title}{ODD:#} {}", all.join("; "))
    })
}

/// Writes what is wrong, and the totals: what a platform shows above its own table of features.
///
/// # Errors
/// If writing fails.
pub fn write_overview(out: &mut dyn Write, grading: &Grading) -> io::Result<()> {
    write_findings(out, &grading.findings)?;
    write_summary(out, grading, Audience::Students, Remarks::All)
}

/// Which circumstances of a run are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Remarks {
    /// Those that a reader has to know.
    Warnings,
    /// All.
    All,
}

/// Writes the totals and the score. With warnings alone, the table above it has the totals of each section.
fn write_summary(
    out: &mut dyn Write,
    grading: &Grading,
    audience: Audience,
    remarks: Remarks,
) -> io::Result<()> {
    let mut rows = Vec::new();
    for section in Section::ALL.into_iter().filter(|_| remarks == Remarks::All) {
        let totals = grading.totals(section);
        if totals.scenes + totals.hidden > 0 {
            let mut row = vec![
                Cell::left(title(section)),
                Cell::right(format!("{}/{} scenes", totals.passed, totals.scenes)),
                Cell::right(format!("{}/{} features", totals.features_passed, totals.features)),
            ];
            if section != Section::Unscored {
                let points = points::of(&totals.credit, grading.faults);
                row.push(Cell::right(format!("{points} points")));
            }
            rows.push(row);
            if totals.hidden > 0 {
                rows.push(vec![
                    Cell::left("  hidden"),
                    Cell::right(format!("{}/{} scenes", totals.hidden_passed, totals.hidden)),
                ]);
            }
        }
    }
    if !grading.jacobians.is_empty() {
        let (correct, asked) = grading.jacobians.counts();
        let count = format!("{correct}/{asked} verdicts");
        rows.push(vec![Cell::left("Jacobians"), Cell::right(count)]);
    }
    if let Some(probing) = offered(grading) {
        let (correct, offered) = probing.counts();
        let text = format!("{correct}/{offered} findings{}", remarks::not_correct(probing));
        rows.push(vec![Cell::left("Jacobians"), Cell::right(text)]);
    }
    let graded_as = grading.assignment.as_ref().map(|AssignmentName { name, title }| {
        format!(", assignment {BOLD}{name}{BOLD:#}: {title}")
    });
    let graded_as = graded_as.unwrap_or_default();
    writeln!(out, "{BOLD}Summary{BOLD:#} for {}{graded_as}", grading.submission.line())?;
    table::write_unnamed(out, &rows)?;
    match remarks {
        Remarks::All => write_circumstances(out, grading, audience)?,
        Remarks::Warnings => write_warnings(out, grading)?,
    }
    if let Some(interrupted) = grading.interrupted {
        let ended = if interrupted.fail_fast { "Ended by --fail-fast" } else { "Interrupted" };
        return writeln!(out, "  {ODD}{ended}: {interrupted}; no score.{ODD:#}");
    }
    let style = match grading.outcome() {
        GradingOutcome::Passed | GradingOutcome::PassedShipped => GOOD,
        GradingOutcome::Failed => BAD,
        GradingOutcome::GraderFault => ODD,
    };
    let text = outcome(grading);
    write_score(out, grading)?;
    write_adjustments(out, grading)?;
    if let Some(since) = grading.since.as_ref().and_then(remarks::since) {
        writeln!(out, "  {since}")?;
    }
    match grading.hidden {
        Hidden::NotRun { scenes, reason } => {
            let not_run = not_run(scenes, reason);
            writeln!(out, "  {style}{text}{style:#} {ODD}{not_run}{ODD:#}")?;
        }
        Hidden::None | Hidden::Run => writeln!(out, "  {style}{text}{style:#}")?,
    }
    match &grading.fitting {
        Some(AssignmentName { name, title }) => writeln!(
            out,
            "  This program offers what the assignment {BOLD}{name}{BOLD:#} asks for ({title}).\n  Grade it as that: \
             --assignment {name}, or assignment = {name:?} in submission.toml."
        ),
        None => Ok(()),
    }
}

/// Writes the points that the teacher granted or withdrew, and the sum, without the deduction for lateness.
pub(super) fn write_adjustments(out: &mut dyn Write, grading: &Grading) -> io::Result<()> {
    for Adjustment { points, reason } in &grading.adjustments {
        let sign = if *points < 0.0 { "" } else { "+" };
        writeln!(out, "  Adjusted: {sign}{} points: {}", points::shown(*points), reason.line())?;
    }
    match grading.credit().shown(grading.faults) {
        Some(earned) if !grading.adjustments.is_empty() => writeln!(
            out,
            "  {BOLD}{} points{BOLD:#} with adjustments, before what lateness takes off.",
            points::shown(grading.adjusted(earned))
        ),
        _ => Ok(()),
    }
}

/// The overall result in a sentence.
pub(super) fn outcome(grading: &Grading) -> String {
    let is_measured_wrong = grading
        .probing
        .as_ref()
        .is_some_and(|probing| probing.verdict() == grader::probe::Verdict::Wrong);
    match grading.outcome() {
        // Mistakes that only measurements show cost no points.
        GradingOutcome::Passed | GradingOutcome::PassedShipped if is_measured_wrong => {
            let which = if grading.is_flawless() { "features" } else { "required features" };
            format!("All {which} passed; single steps show a mistake.")
        }
        GradingOutcome::Passed if grading.is_flawless() => "All passed.".to_owned(),
        GradingOutcome::PassedShipped if grading.is_flawless() => {
            "All shipped scenes passed.".to_owned()
        }
        GradingOutcome::Passed | GradingOutcome::PassedShipped => {
            "All required features passed.".to_owned()
        }
        GradingOutcome::Failed if grading.only_lacks() && !is_measured_wrong => {
            "Unfinished; nothing wrong was found in what is there.".to_owned()
        }
        GradingOutcome::Failed => {
            let deciding: Vec<&FeatureResult> =
                grading.features.iter().filter(|result| grading.decides(result)).collect();
            let is_required = |result: &&FeatureResult| result.feature.section == Section::Required;
            let of =
                if deciding.iter().all(is_required) { "required features" } else { "features" };
            let wrong = deciding.iter().filter(|result| !result.is_pass()).count();
            match wrong {
                0 => "Jacobians are wrong.".to_owned(),
                _ => format!("{wrong} of {} {of} failed.", deciding.len()),
            }
        }
        GradingOutcome::GraderFault => {
            "Something could not be judged; its points are neither earned nor lost.".to_owned()
        }
    }
}

/// A sentence that hidden scenes were not run.
pub fn not_run(scenes: Option<usize>, reason: NotRunReason) -> String {
    let reason = match reason {
        NotRunReason::Unavailable => "",
        NotRunReason::WithoutNamespaces => ": this system refuses programs their own namespaces",
    };
    match scenes {
        Some(1) => format!("1 hidden scene was not run{reason}."),
        Some(count) => format!("{count} hidden scenes were not run{reason}."),
        None => format!("Hidden scenes were not run{reason}."),
    }
}

/// Writes the points, with extra credit separate.
pub(super) fn write_score(out: &mut dyn Write, grading: &Grading) -> io::Result<()> {
    let [required, extra] =
        [Section::Required, Section::ExtraCredit].map(|section| grading.totals(section));
    if required.features + extra.features == 0 {
        return Ok(());
    }
    let words = |credit: &Credit, noun| points::in_words(credit, grading.faults, noun);
    write!(out, "  {BOLD}Score {}{BOLD:#}", words(&required.credit, " points"))?;
    if extra.features > 0 {
        write!(out, ", and {} for extra credit", words(&extra.credit, ""))?;
    }
    let creative = grading.creative.as_ref();
    if let Some(credit) = creative.and_then(Credit::of_creative) {
        write!(out, ", and {} for the creative scene", words(&credit, ""))?;
    }
    if extra.features > 0 || creative.is_some_and(|creative| !creative.marks.is_empty()) {
        write!(out, ": {} together", points::earned(&grading.credit(), grading.faults))?;
    }
    writeln!(out)?;
    match creative.map(|creative| (creative.means(), creative)) {
        None => Ok(()),
        Some((None, _)) => writeln!(out, "  Creative scene: no mark"),
        Some((Some(means), creative)) => {
            let marks = CRITERIA.iter().zip(means);
            let marks = marks
                .map(|(criterion, mean)| format!("{} {}", criterion.column, points::shown(mean)));
            let marks = marks.collect::<Vec<_>>().join(", ");
            let of = match creative.marks.len() {
                1 => String::new(),
                judges => format!(", means of {judges} judges"),
            };
            writeln!(out, "  Creative scene: {marks}, of {}{of}", points::shown(creative.maximum))
        }
    }
}

#[cfg(test)]
mod tests {
    use grader::probe::{BuiltIn, Verdict, probe};

    use super::*;

    #[test]
    fn a_mistake_in_single_steps_is_said_where_all_features_pass() {
        let mut grading = Grading::default();
        assert_eq!(outcome(&grading), "All passed.");
        let mut probing = probe(&BuiltIn, |tag, _| tag == "dragdamping");
        probing.parts[0].force_finding.verdict = Verdict::Wrong;
        grading.probing = Some(probing);
        assert_eq!(outcome(&grading), "All features passed; single steps show a mistake.");
        // A step that is wrong as a whole is not blamed on the force.
        let part = &mut grading.probing.as_mut().unwrap().parts[0];
        part.force_finding.verdict = Verdict::Correct;
        part.step.verdict = Verdict::Wrong;
        assert_eq!(outcome(&grading), "All features passed; single steps show a mistake.");
        assert_eq!(remarks::measured(&grading).count(), 0);
        let words = remarks::wrong_steps(&grading, |_| false).unwrap();
        assert!(words.starts_with("single steps with dragdamping are not those of "), "{words}");
        assert_eq!(remarks::wrong_steps(&grading, |tag| tag == "dragdamping"), None);
    }
}
