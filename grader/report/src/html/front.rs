//! Front page of a submission: verdict, findings, features and scenes.

use std::io;

use grader::grading::{
    AssignmentName, FeatureResult, Grading, GradingOutcome, Hidden, SceneResult, Totals, points,
};
use grader::probe::Probing;
use grader::suite::Section;
use grader::verdict::{Verdict, number};

use super::page::{Html, Page};
use super::{findings, scene_address};
use crate::remarks;
use crate::text::{self, Audience};

/// The page.
///
/// # Errors
/// Never in practice: it writes to memory.
pub(super) fn render(grading: &Grading, above: &[(String, String)]) -> io::Result<Vec<u8>> {
    let mut html = Html::default();
    verdict(&mut html, grading)?;
    findings::write(&mut html, grading)?;
    features(&mut html, grading);
    scenes(&mut html, grading);
    html.markup("<section aria-labelledby=\"run\"><h2 id=\"run\">How it was judged</h2><ul>");
    html.lines(|out| text::write_circumstances(out, grading, Audience::Graders))?;
    html.markup("</ul></section>");
    let title = format!("{}: report", grading.submission.line());
    Ok(Page { title: &title, depth: 0, above }.render(&html))
}

/// Adds the result in a few lines.
fn verdict(html: &mut Html, grading: &Grading) -> io::Result<()> {
    let (class, words) = match (grading.interrupted, grading.outcome()) {
        (Some(interrupted), _) => ("odd", format!("Interrupted: {interrupted}; no score.")),
        (None, outcome) => {
            let class = match outcome {
                GradingOutcome::Passed | GradingOutcome::PassedShipped => "good",
                GradingOutcome::Failed => "bad",
                GradingOutcome::GraderFault => "odd",
            };
            (class, text::outcome(grading))
        }
    };
    html.element("h1", &[], &grading.submission.line());
    if let Some(AssignmentName { name, title }) = &grading.assignment {
        html.element("p", &[], &format!("Assignment {name}: {title}"));
    }
    html.open("p", &[("class", &format!("verdict {class}"))]).text(&words);
    if let Hidden::NotRun { scenes, reason } = grading.hidden {
        html.markup(" ").text(&text::not_run(scenes, reason));
    }
    html.markup("</p><ul class=\"score\">");
    if grading.interrupted.is_none() {
        html.lines(|out| text::write_score(out, grading))?;
        html.lines(|out| text::write_adjustments(out, grading))?;
    }
    if let Some(since) = grading.since.as_ref().and_then(remarks::since) {
        html.element("li", &[], &since);
    }
    for section in Section::ALL {
        let totals = grading.totals(section);
        if totals.scenes + totals.hidden > 0 {
            html.markup("<li>").text(&summary(section, &totals)).markup("</li>");
        }
    }
    let jacobians = if grading.jacobians.is_empty() {
        let of_probe =
            |probing: &Probing| (probing.counts(), "findings", remarks::not_correct(probing));
        grading.probing.as_ref().map(of_probe)
    } else {
        Some((grading.jacobians.counts(), "verdicts", String::new()))
    };
    if let Some(((correct, asked), noun, rest)) = jacobians {
        html.markup("<li>").link("jacobians.html", "Jacobians");
        html.text(&format!(": {correct} of {asked} {noun} correct{rest}")).markup("</li>");
    }
    html.markup("</ul>\n");
    Ok(())
}

fn summary(section: Section, totals: &Totals) -> String {
    let mut words = format!(
        "{}: {} of {} scenes, {} of {} features",
        text::title(section),
        totals.passed,
        totals.scenes,
        totals.features_passed,
        totals.features
    );
    if totals.hidden > 0 {
        words += &format!("; {} of {} hidden scenes", totals.hidden_passed, totals.hidden);
    }
    words
}

/// Adds a table of features, with a link for each scene.
fn features(html: &mut Html, grading: &Grading) {
    if grading.features.is_empty() {
        return;
    }
    html.markup("<section aria-labelledby=\"features\"><h2 id=\"features\">Features</h2>");
    html.markup("<div class=\"wide\" tabindex=\"0\" role=\"region\" aria-labelledby=\"features\"><table><thead><tr>");
    let is_hidden = grading.hidden == Hidden::Run;
    let columns = ["Group", "Integrator", "Scenes", "Error x", "Error v", "Points", "Verdict"];
    for (place, name) in columns.into_iter().enumerate() {
        let class = match place {
            3 | 4 => "number spare",
            5 => "number",
            _ => "",
        };
        html.element("th", &[("scope", "col"), ("class", class)], name);
        if place == 2 && is_hidden {
            html.markup("<th scope=\"col\">Hidden</th>");
        }
    }
    html.markup("</tr></thead>\n");
    for section in Section::ALL {
        let features: Vec<_> =
            grading.features.iter().filter(|each| each.feature.section == section).collect();
        if features.is_empty() {
            continue;
        }
        html.markup("<tbody><tr class=\"section\"><th scope=\"rowgroup\" colspan=\"8\">");
        html.text(text::title(section)).markup("</th></tr>\n");
        for result in features {
            feature(html, result, grading, is_hidden);
        }
        html.markup("</tbody>\n");
    }
    html.markup("</table></div></section>\n");
}

fn feature(html: &mut Html, result: &FeatureResult, grading: &Grading, is_hidden: bool) {
    html.markup("<tr>").element("th", &[("scope", "row")], &result.feature.group);
    html.element("td", &[], result.feature.integrator);
    html.markup("<td class=\"marks\">");
    for scene in &result.scenes {
        let (class, sign) = sign(&scene.comparison.verdict);
        let label = format!("{}: {}", scene.id, scene.comparison.verdict.name());
        let href = scene_address(&scene.id);
        let attributes =
            [("class", class), ("href", href.as_str()), ("title", &label), ("aria-label", &label)];
        html.element("a", &attributes, sign);
    }
    html.markup("</td>");
    if is_hidden {
        let hidden = &result.hidden;
        let failed = text::verdicts(hidden);
        let separator = if failed.is_empty() { "" } else { ": " };
        let passed = text::count(hidden.n_passed(), hidden.n_scenes());
        html.element("td", &[], &format!("{passed}{separator}{failed}"));
    }
    let largest = result.largest_residuals();
    let shown = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), text::residual);
    for value in [largest.map(|(position, _)| position), largest.map(|(_, velocity)| velocity)] {
        html.element("td", &[("class", "number spare")], &shown(value));
    }
    let credit = result.credit();
    let points = if credit.unjudged > 0.0 {
        format!("{}, {} not judged", points::of(&credit, grading.faults), points::unjudged(&credit))
    } else {
        points::of(&credit, grading.faults)
    };
    html.element("td", &[("class", "number")], &points);
    let (class, words) = match result.has_faults() {
        true => ("odd", "not judged"),
        false if result.is_lacking() => ("lack", "not implemented"),
        false if result.is_pass() => ("good", "pass"),
        false if !result.partial && result.has_passes() => ("bad", "fail (all or nothing)"),
        false => ("bad", "fail"),
    };
    html.element("td", &[("class", class)], words).markup("</tr>\n");
}

/// Class and sign of a verdict.
pub(super) fn sign(verdict: &Verdict) -> (&'static str, &'static str) {
    match verdict {
        Verdict::Pass => ("good", "✓"),
        Verdict::Fail(_) if verdict.is_lack() => ("lack", "–"),
        Verdict::Fail(_) => ("bad", "✗"),
        Verdict::GraderFault(_) => ("odd", "?"),
    }
}

/// Adds the table of scenes, with filters.
fn scenes(html: &mut Html, grading: &Grading) {
    let mut scenes: Vec<&SceneResult> =
        grading.features.iter().flat_map(|feature| &feature.scenes).collect();
    if scenes.is_empty() {
        return;
    }
    // Failures first; otherwise the order of the suite.
    scenes.sort_by_key(|scene| scene.comparison.verdict.is_pass());
    html.markup("<section aria-labelledby=\"scenes\" data-filtered><h2 id=\"scenes\">Scenes</h2>");
    html.markup(
        "<form class=\"filters\" role=\"search\"><label>Show <select name=\"verdict\"><option value=\"\">all</option>\
         <option value=\"bad\">failed</option><option value=\"good\">passed</option>\
         <option value=\"lack\">not implemented</option><option value=\"odd\">not judged</option></select></label> <label>containing \
         <input type=\"search\" name=\"text\" autocomplete=\"off\"></label> <output></output></form>",
    );
    html.markup("<div class=\"wide\" tabindex=\"0\" role=\"region\" aria-labelledby=\"scenes\"><table><thead><tr>");
    for name in ["Scene", "Verdict", "First wrong", "Cause"] {
        let class = if name == "First wrong" { "spare" } else { "" };
        html.element("th", &[("scope", "col"), ("class", class)], name);
    }
    html.markup("</tr></thead><tbody>\n");
    for scene in scenes {
        let verdict = &scene.comparison.verdict;
        let (class, sign) = sign(verdict);
        html.open("tr", &[("data-verdict", class)]).markup("<th scope=\"row\">");
        html.link(&scene_address(&scene.id), &scene.id).markup("</th>");
        let is_in = |list: &[String]| list.contains(&scene.id);
        let before = match &grading.since {
            Some(since) if is_in(&since.mended) => " (failed before)",
            Some(since) if is_in(&since.broken) => " (passed before)",
            _ => "",
        };
        let name = format!("{sign} {}{before}", verdict.name().replace('-', " "));
        html.element("td", &[("class", class)], &name).markup("<td class=\"spare\">");
        if let Some(first) = &scene.comparison.first_wrong {
            html.text(&format!("step {}, t = {} s", first.place.step, number(first.time)));
        }
        html.markup("</td>");
        html.element("td", &[], &findings::cause(scene).unwrap_or_default()).markup("</tr>\n");
    }
    html.markup("</tbody></table></div></section>\n");
}
