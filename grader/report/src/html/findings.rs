//! Findings of a submission, each with its proof.

use std::collections::BTreeMap;
use std::io;

use diagnosis::findings::{Finding, TaskFinding};
use grader::grading::{Grading, SceneResult};
use grader::probe;
use grader::verdict::Verdict;

use super::page::Html;
use super::scene_address;

/// Number of scenes that are linked as the proof of a finding.
const LINKED: usize = 6;

/// Adds the findings as a list; nothing where there are none.
pub(super) fn write(html: &mut Html, grading: &Grading) -> io::Result<()> {
    let mut items = Html::default();
    for finding in &grading.findings.list {
        items.markup("<li><strong>").text(&finding.sentence()).markup("</strong>: ");
        items.text(&finding.evidence()).markup(": ");
        let is_its = |scene: &&SceneResult| finding.scenes.contains(&scene.id);
        link_scenes(&mut items, &scenes(grading).filter(is_its).collect::<Vec<_>>());
        items.markup("</li>");
    }
    for note in Finding::notes(grading.findings.list.iter()) {
        items.markup("<li>").text(note).markup("</li>");
    }
    if let Some(progress) = &grading.findings.progress {
        items.markup("<li>").text(&progress.to_string()).markup("</li>");
    }
    for TaskFinding { task, verdict } in &grading.findings.tasks {
        items.markup("<li>").text(&format!("Task {}: {verdict}", task.name())).markup("</li>");
    }
    for (name, scenes) in unexplained(grading) {
        let words = format!("{} without a known cause ({name}): ", counted(scenes.len(), "scene"));
        items.markup("<li>").text(&words);
        link_scenes(&mut items, &scenes);
        items.markup("</li>");
    }
    if let Some(probing) = &grading.probing {
        let wrong = probing.parts.iter().filter(|part| part.verdict() == probe::Verdict::Wrong);
        for part in wrong {
            let names = part.findings().filter(|(_, each)| each.verdict == probe::Verdict::Wrong);
            let names: Vec<&str> = names.map(|(name, _)| name).collect();
            let space = part.dimension.count();
            let words = format!("{} {}, {space}D: {} ", part.force, part.part, names.join(", "));
            items.markup("<li>Measured from single steps: <strong>").text(&words);
            items.markup("wrong</strong>");
            for mistake in &part.diagnosis {
                items.markup("; ").text(mistake);
            }
            items.markup(" (").link("jacobians.html", "the numbers").markup(")</li>");
        }
    }
    let wrong = grading.jacobians.forces.iter().filter(|check| check.is_wrong());
    for check in wrong {
        let words = format!("Jacobians of {} in {}D", check.tag, check.dimension.count());
        items.markup("<li><strong>").text(&words).markup("</strong> are wrong (");
        items.link("jacobians.html", "the numbers").markup(")</li>");
    }
    if !items.is_empty() {
        html.markup("<section aria-labelledby=\"findings\"><h2 id=\"findings\">Findings</h2><ul class=\"findings\">");
        html.append(&items).markup("</ul></section>\n");
    }
    Ok(())
}

/// `1 scene`, `2 scenes`.
pub(super) fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

fn scenes(grading: &Grading) -> impl Iterator<Item = &SceneResult> {
    grading.features.iter().flat_map(|feature| &feature.scenes)
}

/// The causes of a scene's wrong trace, where they are known.
pub(super) fn cause(scene: &SceneResult) -> Option<String> {
    let causes = &scene.diagnosis.as_ref()?.causes;
    (!causes.is_empty()).then(|| causes.join("; "))
}

/// The scenes that no finding explains, by verdict.
fn unexplained(grading: &Grading) -> Vec<(String, Vec<&SceneResult>)> {
    let mut found: BTreeMap<String, Vec<&SceneResult>> = BTreeMap::new();
    let is_explained =
        |scene: &&SceneResult| grading.findings.list.iter().any(|f| f.scenes.contains(&scene.id));
    for scene in scenes(grading).filter(|scene| !is_explained(scene)) {
        if !matches!(scene.comparison.verdict, Verdict::Pass) {
            let name = scene.comparison.verdict.name().replace('-', " ");
            found.entry(name).or_default().push(scene);
        }
    }
    by_frequency(found)
}

fn by_frequency(found: BTreeMap<String, Vec<&SceneResult>>) -> Vec<(String, Vec<&SceneResult>)> {
    let mut found: Vec<_> = found.into_iter().collect();
    found.sort_by_key(|(_, scenes)| std::cmp::Reverse(scenes.len()));
    found
}

fn link_scenes(html: &mut Html, scenes: &[&SceneResult]) {
    for (number, scene) in scenes.iter().take(LINKED).enumerate() {
        html.markup(if number > 0 { ", " } else { "" });
        html.link(&scene_address(&scene.id), &scene.id);
    }
    if scenes.len() > LINKED {
        html.text(&format!(" and {} more", scenes.len() - LINKED));
    }
}
