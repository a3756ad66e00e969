//! Remarks that all reports for people show in addition to the findings: failed scenes that no finding explains, and
//! results of single steps of a program.

use grader::grading::{Grading, SceneResult, Since};
use grader::probe::{self, PartReport, Probing};
use grader::verdict::{Failure, Verdict};

/// Scenes that failed alike, under no finding.
pub(crate) struct Unexplained<'a> {
    /// The remark, without the scenes.
    pub(crate) words: String,
    /// The scenes.
    pub(crate) scenes: Vec<&'a SceneResult>,
}

/// Shipped scenes in the order of the report.
pub(crate) fn scenes(grading: &Grading) -> impl Iterator<Item = &SceneResult> {
    grading.features.iter().flat_map(|feature| &feature.scenes)
}

/// How many of the probe's findings are wrong, and how many it could not measure: `, 1 wrong, 2 not measured`.
pub(crate) fn not_correct(probing: &Probing) -> String {
    let kinds = [(probe::Verdict::Wrong, "wrong"), (probe::Verdict::Inconclusive, "not measured")];
    let counts = kinds.map(|(verdict, words)| (probing.count(verdict), words));
    let some = counts.into_iter().filter(|(count, _)| *count > 0);
    some.map(|(count, words)| format!(", {count} {words}")).collect()
}

/// The failed scenes that no finding explains, by verdict, the most frequent first; functions one by one.
pub(crate) fn unexplained(grading: &Grading) -> Vec<Unexplained<'_>> {
    let is_explained =
        |scene: &SceneResult| grading.findings.list.iter().any(|f| f.scenes.contains(&scene.id));
    let mut groups: Vec<(&Verdict, bool, Vec<&SceneResult>)> = Vec::new();
    for scene in scenes(grading).filter(|scene| !is_explained(scene)) {
        let verdict = &scene.comparison.verdict;
        let is_open = grading.findings.open.contains(&scene.id);
        let is_its = |(known, open, _): &&mut (&Verdict, bool, Vec<&SceneResult>)| {
            known.name() == verdict.name() && *open == is_open
        };
        match groups.iter_mut().find(is_its) {
            _ if verdict.is_pass() => {}
            Some((.., scenes)) if wrong_function(verdict).is_none() => scenes.push(scene),
            _ => groups.push((verdict, is_open, vec![scene])),
        }
    }
    groups.sort_by_key(|(.., scenes)| std::cmp::Reverse(scenes.len()));
    let mut found = Vec::new();
    for (verdict, is_open, scenes) in groups {
        let name = verdict.name().replace('-', " ");
        let count = counted(scenes.len(), "scene");
        let is_of_numbers =
            matches!(verdict, Verdict::Fail(failure) if Failure::has_numbers(failure));
        let why = match () {
            () if is_open => " that the mistakes above may explain, or not",
            () if !is_of_numbers => "",
            () => " without a known cause",
        };
        if let Some(line) = wrong_function(verdict) {
            found.push(Unexplained { words: format!("A function is {line}"), scenes });
            continue;
        }
        found.push(Unexplained { words: format!("{count}{why} ({name})"), scenes });
    }
    found
}

/// The mistake of a function, in a line.
fn wrong_function(verdict: &Verdict) -> Option<&str> {
    match verdict {
        Verdict::Fail(Failure::WrongFunction { detail }) => detail.lines().next(),
        _ => None,
    }
}

/// The parts of forces that single steps show to be wrong, with what is wrong in words.
pub(crate) fn measured(grading: &Grading) -> impl Iterator<Item = (&PartReport, String)> {
    let parts = grading.probing.iter().flat_map(|probing| &probing.parts);
    let is_wrong =
        |part: &&PartReport| part.verdict() == probe::Verdict::Wrong && !part.is_step_alone();
    parts.filter(is_wrong).map(|part| {
        let wrong = part.findings().filter(|(_, each)| each.verdict == probe::Verdict::Wrong);
        let names: Vec<&str> = wrong.map(|(name, _)| name).collect();
        let space = part.dimension.count();
        (part, format!("{} {}, {space}D: {} ", part.force, part.part, names.join(", ")))
    })
}

/// A sentence on the forces whose implicit steps are wrong as a whole for no known reason, without those that `is_named`
/// holds for; `None` if no force is left.
pub(crate) fn wrong_steps(grading: &Grading, is_named: impl Fn(&str) -> bool) -> Option<String> {
    let probing = grading.probing.as_ref()?;
    let mut tags: Vec<&str> = Vec::new();
    for part in probing.parts.iter().filter(|part| part.is_step_alone()) {
        if !tags.contains(&part.force) && !is_named(part.force) {
            tags.push(part.force);
        }
    }
    let method = probing.spaces.iter().find_map(|space| space.implicit.as_ref().ok())?;
    (!tags.is_empty()).then(|| {
        format!(
            "single steps with {} are not those of {method} with any Jacobian of two particles: the method, its \
             matrix (masses; Jacobians in wrong rows, or of some elements alone) or its solver",
            tags.join(", ")
        )
    })
}

/// Names of scenes in a line.
const NAMES: usize = 3;

/// Some names and the number of the others.
pub(crate) fn named<'a>(names: impl ExactSizeIterator<Item = &'a str>) -> String {
    let more = names.len().saturating_sub(NAMES);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    names.take(NAMES).collect::<Vec<_>>().join(", ") + &more
}

/// The changes since the last run, in a sentence; none where nothing changed.
pub(crate) fn since(since: &Since) -> Option<String> {
    let Since { mended, broken } = since;
    let parts = [(mended, "failed before and pass"), (broken, "passed before and fail")];
    let parts = parts.into_iter().filter(|(scenes, _)| !scenes.is_empty());
    let part = |(scenes, what): (&Vec<String>, &str)| {
        format!(
            "{} {what} ({})",
            counted(scenes.len(), "scene"),
            named(scenes.iter().map(String::as_str))
        )
    };
    let parts: Vec<String> = parts.map(part).collect();
    (!parts.is_empty()).then(|| format!("Since the last run: {}.", parts.join("; ")))
}

/// `1 scene`, `2 scenes`.
pub(crate) fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}
