//! Page of a scene: motion, residuals, energies, the numbers around the first wrong step, and what the scene tests.

use std::fs;

use diagnosis::explanation::{Contribution, Explanation};
use grader::boundary::own_file;
use grader::compare::FirstWrong;
use grader::grading::SceneResult;
use grader::suite::{Case, SceneFile};
use grader::verdict::number;

use super::front::sign;
use super::page::{Html, Page, address};
use super::{data, findings};
use crate::digits::{self, DiffLine, LineKind};
use crate::remarks::counted;
use crate::text;

/// Largest scene file that is shown, in bytes.
const SHOWN: u64 = 20_000;

/// The page. `beside` are the scenes before and after it, and the next one that failed.
///
/// # Errors
/// Never in practice: every value has a JSON form.
pub(super) fn render(
    case: &Case,
    result: &SceneResult,
    beside: [Option<&SceneResult>; 3],
    submission: &str,
) -> serde_json::Result<Vec<u8>> {
    let depth = 1 + case.id.matches('/').count();
    let up = "../".repeat(depth);
    let mut html = Html::default();
    let verdict = &result.comparison.verdict;
    html.element("h1", &[], &case.id);
    let mut links = Html::default();
    links.markup("<nav class=\"beside\" aria-label=\"Other scenes\">");
    for (scene, words) in beside.into_iter().zip(["Previous: ", "Next: ", "Next that failed: "]) {
        if let Some(scene) = scene {
            let href = format!("{up}{}", super::scene_address(&scene.id));
            links.link(&href, &format!("{words}{}", scene.id));
        }
    }
    links.markup("</nav>");
    html.append(&links);
    if let Some(description) = &case.scene.description {
        html.element("p", &[("class", "description")], description);
    }
    let is_pass = verdict.is_pass();
    html.open("div", &[("class", if is_pass { "" } else { "explained" })]);
    html.markup("<div class=\"finding\">");
    finding(&mut html, result);
    html.markup("</div>\n");
    if result.recording.is_some() {
        html.markup(
            "<section class=\"motion\" aria-labelledby=\"motion\"><h2 id=\"motion\">Motion</h2>",
        );
        html.markup("<noscript><p>The motion and the diagrams need JavaScript; the numbers below do not.</p></noscript>");
        html.markup("<div id=\"player\"></div></section>\n");
    }
    let explanation = result.diagnosis.as_ref().and_then(|found| found.explanation.as_ref());
    if let Some(explanation) = explanation.filter(|_| !is_pass) {
        equation(&mut html, explanation);
    }
    html.markup("</div>\n");
    if let Some(recording) = &result.recording {
        charts(&mut html, result);
        html.data("recording", &data::render(case, result, recording)?);
    }
    if let Some(first) = &result.comparison.first_wrong {
        first_wrong(&mut html, first);
    }
    about(&mut html, case);
    html.append(&links);
    let above = [(format!("{up}{}", address("index.html")), submission.to_owned())];
    Ok(Page { title: &case.id, depth, above: &above }.render(&html))
}

/// Adds the verdict and its cause.
fn finding(html: &mut Html, result: &SceneResult) {
    let verdict = &result.comparison.verdict;
    let (class, sign) = sign(verdict);
    let name = verdict.name().replace('-', " ");
    html.open("div", &[("class", &format!("verdict {class}"))]);
    html.markup("<p><strong>").text(&format!("{sign} {name}")).markup("</strong>: ");
    html.element("span", &[("class", "said")], &verdict.to_string()).markup("</p>");
    if let Some(diagnosis) = &result.diagnosis {
        html.markup("<p>Redoing each step from the submission's own trace: ");
        html.text(&diagnosis.steps.words()).markup(".</p>");
        if let Some(restarts) = &diagnosis.restarts {
            html.markup("<p>Running the program from the oracle's states: ");
            html.text(&restarts.words()).markup(".</p>");
        }
        match findings::cause(result) {
            Some(cause) => {
                html.markup("<p>Cause, which reproduces the trace: <strong>");
                html.text(&cause).markup("</strong>.</p>");
            }
            None if diagnosis.steps.wrong > 0 => {
                html.markup("<p>No cause is proven.</p>");
            }
            None => {}
        }
    }
    html.markup("</div>\n");
}

/// Adds the first step that is wrong by itself, with its numbers in the equation of the method.
fn equation(html: &mut Html, explanation: &Explanation) {
    let Explanation { step, time, particle, before, after, right, balance } = explanation;
    html.markup("<section class=\"equation\" aria-labelledby=\"equation\"><h2 id=\"equation\">First wrong step</h2><p>");
    html.text(&format!(
        "Step {step}, from t = {} s, particle {particle}, from the submission's own state before it.",
        number(*time)
    ));
    html.markup("</p>");
    let mut states = vec![
        Row::of("x before", &before[0]),
        Row::of("v before", &before[1]),
        Row::of("x after, yours", &after[0]),
        Row::of("v after, yours", &after[1]),
    ];
    if let Some([x, v]) = right {
        states.extend([Row::of("x after, right", x), Row::of("v after, right", v)]);
    }
    table(html, "States of the particle", &states);
    let Some(balance) = balance else {
        html.markup("</section>\n");
        return;
    };
    html.markup("<p>The equation of the step, with these numbers: <strong>");
    html.text(balance.equation).markup("</strong></p>");
    let mut rows = vec![Row::of("M (v' − v)", &balance.inertia)];
    for Contribution { name, right, with_mistakes } in &balance.terms {
        let with = with_mistakes.as_ref().filter(|with| *with != right);
        if [Some(right), with].into_iter().flatten().any(|values| values.iter().any(|v| *v != 0.0))
        {
            rows.push(Row::of(name, right));
            rows.extend(
                with.map(|with| Row { is_mistaken: true, ..Row::of("with the mistake", with) }),
            );
        }
    }
    rows.push(Row::of("sum, 0 if right", &balance.rest));
    rows.extend(
        balance
            .rest_with_mistakes
            .as_ref()
            .map(|rest| Row { is_mistaken: true, ..Row::of("sum, with the mistake", rest) }),
    );
    if balance.moves_otherwise {
        rows.push(Row::of("off the rule for x'", &balance.drift));
    }
    table(html, "Terms of the equation", &rows);
    html.markup("</section>\n");
}

/// Numbers of a vector, with a name.
struct Row<'a> {
    name: &'a str,
    values: &'a [f64],
    /// Whether it is of the proven mistake.
    is_mistaken: bool,
}

impl<'a> Row<'a> {
    fn of(name: &'a str, values: &'a [f64]) -> Self {
        Self { name, values, is_mistaken: false }
    }
}

fn table(html: &mut Html, label: &str, rows: &[Row<'_>]) {
    html.open(
        "div",
        &[("class", "wide"), ("tabindex", "0"), ("role", "region"), ("aria-label", label)],
    );
    html.markup("<table><thead><tr><td></td>");
    let axes = rows.first().map_or(0, |row| row.values.len());
    for axis in ["x", "y", "z"].iter().take(axes) {
        html.element("th", &[("scope", "col"), ("class", "number")], axis);
    }
    html.markup("</tr></thead><tbody>");
    for Row { name, values, is_mistaken } in rows {
        html.open("tr", &[("class", if *is_mistaken { "mistaken" } else { "" })]);
        html.element("th", &[("scope", "row")], name);
        for value in *values {
            let shown = data::short(*value).map_or_else(|| "–".to_owned(), number);
            html.element("td", &[], &shown.replace('-', "−"));
        }
        html.markup("</tr>");
    }
    html.markup("</tbody></table></div>");
}

/// Adds the places of the diagrams, which the scripts fill.
fn charts(html: &mut Html, result: &SceneResult) {
    if result.comparison.is_compared() {
        html.markup("<section aria-labelledby=\"residuals\"><h2 id=\"residuals\">Residuals</h2>");
        html.markup("<p class=\"hint\">The largest distance of a particle from the oracle's, at each state.</p>");
        html.markup("<div class=\"charts\" id=\"residual-charts\"></div></section>\n");
    }
    html.markup(
        "<section aria-labelledby=\"energies\"><h2 id=\"energies\">Energy and momentum</h2>",
    );
    html.markup("<p class=\"hint\">Of all particles, fixed ones included; forces without an energy add nothing.</p>");
    html.markup("<div class=\"charts\" id=\"energy-charts\"></div></section>\n");
}

/// Adds the first wrong number, and the states around it.
fn first_wrong(html: &mut Html, first: &FirstWrong) {
    let FirstWrong { place, time, residual, tolerance, envelope, accumulated, .. } = first;
    html.markup("<section aria-labelledby=\"first\"><h2 id=\"first\">First wrong number</h2><p>");
    html.text(&format!(
        "Step {}, t = {} s, particle {}, {}: the {} {} is {}, the tolerance {}",
        place.step,
        number(*time),
        place.particle,
        place.coordinate(),
        place.quantity.name(),
        if *accumulated { "sum of residuals" } else { "residual" },
        text::residual(*residual),
        text::residual(*tolerance),
    ));
    if let Some(envelope) = envelope {
        html.text(&format!("; correct programs differ by up to {}", text::residual(*envelope)));
    }
    html.markup(".</p>");
    let (expected, got) = (digits::full(first.expected), digits::full(first.got));
    let common = digits::common_prefix(&expected, &got);
    html.markup("<table class=\"digits\"><tbody>");
    for (label, text) in [("expected", &expected), ("got", &got)] {
        html.markup("<tr>").element("th", &[("scope", "row")], label).markup("<td>");
        html.text(&text[..common]).element("mark", &[], &text[common..]).markup("</td></tr>");
    }
    html.markup("</tbody></table>");
    let numbers = first.context.first().map_or(0, |row| row.expected.len());
    let columns = match numbers {
        6 => "x y z vx vy vz",
        _ => "x y vx vy",
    };
    html.markup("<h3>")
        .text(&format!("Particle {} around that step", place.particle))
        .markup("</h3>");
    html.markup("<p class=\"hint\">").text(&format!(
        "Step, {columns}; − expected, + got, marked from the first digit that differs."
    ));
    html.markup("</p><pre class=\"diff\" tabindex=\"0\">");
    for DiffLine { kind, pieces } in digits::context(first, 0..numbers) {
        let (class, sign) = match kind {
            LineKind::Same => ("same", " "),
            LineKind::Expected => ("expected", "−"),
            LineKind::Got => ("got", "+"),
        };
        html.open("span", &[("class", class)]).text(sign).markup(" ");
        for (text, differs) in pieces {
            if differs && kind != LineKind::Same {
                html.element("mark", &[], &text);
            } else {
                html.text(&text);
            }
        }
        html.markup("</span>\n");
    }
    html.markup("</pre></section>\n");
}

/// Adds what the scene tests and contains.
fn about(html: &mut Html, case: &Case) {
    let scene = &case.scene;
    html.markup("<section aria-labelledby=\"about\"><h2 id=\"about\">The scene</h2>");
    let sources: Vec<_> = case.files.iter().filter_map(source).collect();
    if let Some(comment) = sources.iter().find_map(|(_, source)| comment(source)) {
        html.element("p", &[], &comment);
    }
    let space = scene.dimension.count();
    let mut forces: Vec<(&str, usize)> = Vec::new();
    for element in &scene.forces {
        match forces.iter_mut().find(|(tag, _)| *tag == element.schema.tag) {
            Some((_, count)) => *count += 1,
            None => forces.push((element.schema.tag, 1)),
        }
    }
    let forces: Vec<String> = forces.iter().map(|(tag, count)| format!("{count} {tag}")).collect();
    let forces = if forces.is_empty() { "none".to_owned() } else { forces.join(", ") };
    html.markup("<dl>");
    for (name, value) in [
        ("Integrator", scene.integrator.name.to_owned()),
        ("Time step", format!("{} s", number(scene.time_step))),
        ("Steps", scene.n_steps().to_string()),
        ("Particles", format!("{}, in {space}D", scene.particles.len())),
        ("Edges", scene.edges.len().to_string()),
        ("Forces", forces),
    ] {
        html.element("dt", &[], name).element("dd", &[], &value);
    }
    html.markup("</dl>");
    for (name, source) in &sources {
        let lines = counted(source.lines().count(), "line");
        html.markup("<details><summary>").text(&format!("Source of {name}, {lines}"));
        html.markup("</summary><pre tabindex=\"0\">").text(source).markup("</pre></details>");
    }
    html.markup("</section>\n");
}

/// Name and text of a file that is not too long to be shown.
fn source(file: &SceneFile) -> Option<(String, String)> {
    let is_short = fs::metadata(&file.path).is_ok_and(|metadata| metadata.len() <= SHOWN);
    let text = is_short.then(|| own_file::text(&file.path).ok()).flatten()?;
    Some((file.path.file_name()?.to_string_lossy().into_owned(), text))
}

/// The comment that a scene or a mesh opens with, on one line.
fn comment(source: &str) -> Option<String> {
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    if source.starts_with('#') {
        let lines = source.lines().map_while(|line| line.strip_prefix('#'));
        return Some(words(&lines.collect::<Vec<_>>().join(" ")));
    }
    let (before, rest) = source.split_once("<!--")?;
    let (comment, _) = rest.split_once("-->")?;
    let is_first = before.trim().is_empty() || before.trim_start().starts_with("<?xml");
    is_first.then(|| words(comment))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opening_comment_is_the_scene_description() {
        let found = comment("<?xml version=\"1.0\"?>\n<!-- Tests\n   this. -->\n<scene/>");
        assert_eq!(found.as_deref(), Some("Tests this."));
        assert_eq!(comment("<scene><!-- not first --></scene>"), None);
        assert_eq!(
            comment("# A flag\n#  of four.\nv 0 0 0\n# no").as_deref(),
            Some("A flag of four.")
        );
    }
}
