//! Findings of a submission, each with its proof.

use std::io;

use diagnosis::findings::{Finding, TaskFinding};
use grader::grading::{Grading, SceneResult};

use super::page::Html;
use super::scene_address;
use crate::remarks::{self, Unexplained, scenes};

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
    for Unexplained { words, scenes } in remarks::unexplained(grading) {
        items.markup("<li>").text(&words).markup(": ");
        link_scenes(&mut items, &scenes);
        items.markup("</li>");
    }
    for (part, words) in remarks::measured(grading) {
        items.markup("<li>Measured from single steps: <strong>").text(&words);
        items.markup("wrong</strong>");
        for mistake in &part.diagnosis {
            items.markup("; ").text(mistake);
        }
        items.markup(" (").link("jacobians.html", "the numbers").markup(")</li>");
    }
    if let Some(words) = remarks::wrong_steps(grading, |_| false) {
        items.markup("<li><strong>Wrong</strong>: ").text(&words);
        items.markup(" (").link("jacobians.html", "the numbers").markup(")</li>");
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

/// The causes of a scene's wrong trace, where they are known.
pub(super) fn cause(scene: &SceneResult) -> Option<String> {
    let causes = &scene.diagnosis.as_ref()?.causes;
    (!causes.is_empty()).then(|| causes.join("; "))
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
