//! Page of a scene: motion, residuals, energies, the numbers around the first wrong step, and what the scene tests.

use std::fs;

use grader::boundary::own_file;
use grader::compare::FirstWrong;
use grader::grading::SceneResult;
use grader::suite::{Case, SceneFile};
use grader::verdict::number;

use super::findings::counted;
use super::front::sign;
use super::page::{Html, Page, address};
use super::{data, findings};
use crate::digits::{self, DiffLine, LineKind};
use crate::text;

/// Largest scene file that is shown, in bytes.
const SHOWN: u64 = 20_000;

/// The page. `beside` are the scenes before and after it.
///
/// # Errors
/// Never in practice: every value has a JSON form.
pub(super) fn render(
    case: &Case,
    result: &SceneResult,
    beside: [Option<&SceneResult>; 2],
    submission: &str,
) -> serde_json::Result<Vec<u8>> {
    let depth = 1 + case.id.matches('/').count();
    let up = "../".repeat(depth);
    let mut html = Html::default();
    heading(&mut html, case, result);
    if let Some(recording) = &result.recording {
        motion(&mut html, result);
        html.data("recording", &data::render(case, result, recording)?);
    }
    if let Some(first) = &result.comparison.first_wrong {
        first_wrong(&mut html, first);
    }
    about(&mut html, case);
    html.markup("<nav class=\"beside\" aria-label=\"Other scenes\">");
    for (scene, words) in beside.into_iter().zip(["Previous scene: ", "Next scene: "]) {
        if let Some(scene) = scene {
            let href = format!("{up}{}", super::scene_address(&scene.id));
            html.link(&href, &format!("{words}{}", scene.id));
        }
    }
    html.markup("</nav>");
    let above = [(format!("{up}{}", address("index.html")), submission.to_owned())];
    Ok(Page { title: &case.id, depth, above: &above }.render(&html))
}

fn heading(html: &mut Html, case: &Case, result: &SceneResult) {
    let verdict = &result.comparison.verdict;
    html.element("h1", &[], &case.id);
    if let Some(description) = &case.scene.description {
        html.element("p", &[("class", "description")], description);
    }
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
                html.markup("<p>No change that grade tries explains this.</p>");
            }
            None => {}
        }
    }
    html.markup("</div>\n");
}

/// Adds the places that the scripts fill.
fn motion(html: &mut Html, result: &SceneResult) {
    html.markup("<section aria-labelledby=\"motion\"><h2 id=\"motion\">Motion</h2>");
    html.markup("<noscript><p>The motion and the diagrams need JavaScript; the numbers below do not.</p></noscript>");
    html.markup("<div id=\"player\"></div></section>\n");
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
    let columns = match first.context.first().map_or(0, |row| row.expected.len()) {
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
    for DiffLine { kind, pieces } in digits::context(first) {
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
