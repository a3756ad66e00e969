//! Page of Jacobians: verdicts, and blocks as heat maps side by side.

use std::cmp::Reverse;
use std::io;

use grader::probe::{self, PartReport, Probing};
use grader::white_box::{self, Entry, Exhibit, JacobianCheck, JacobianReport, Verdict};

use super::chart::{Chart, Series};
use super::page::{Attributes, Html, Page};
use crate::jacobians::{axis, measured, words};
use crate::remarks;

/// Shades of a heat map on each side of zero.
const SHADES: f64 = 4.0;

/// The page of the checks of the built-in simulator's Jacobians. `above` are links to the pages above.
///
/// # Errors
/// Never in practice: it writes to memory.
pub fn jacobians(report: &JacobianReport, above: &[(String, String)]) -> io::Result<Vec<u8>> {
    let mut html = Html::default();
    let (correct, asked) = report.counts();
    html.markup("<h1>Jacobians of the built-in simulator</h1>");
    let class = if report.is_pass() { "verdict good" } else { "verdict bad" };
    html.element("p", &[("class", class)], &format!("{correct} of {asked} verdicts are correct."));
    html.markup(
        "<p>Each block is compared with differences of the force and with dual numbers, at many states. The maps show \
         the state with the largest error: the formula's values, the differences, and what lies between them. Errors \
         are relative to the block's largest entry.</p>",
    );
    for (number, check) in report.forces.iter().enumerate() {
        force(&mut html, check, number)?;
    }
    if !report.newton.is_empty() {
        html.markup("<section><h2>Newton systems</h2><p>Each iteration's matrix against differences of its residual.</p>");
        html.markup("<div class=\"wide\" tabindex=\"0\" role=\"region\" aria-label=\"Newton systems\"><table><thead><tr><th scope=\"col\">Integrator</th><th scope=\"col\">Scene</th><th scope=\"col\" class=\"number\">Error</th><th scope=\"col\">Verdict</th></tr></thead><tbody>");
        for check in &report.newton {
            html.markup("<tr>").element("th", &[("scope", "row")], check.integrator);
            html.element("td", &[], check.scene);
            let error = check.error.map_or_else(|| "–".to_owned(), measured);
            html.element("td", &[("class", "number")], &error);
            html.element("td", &[("class", class_of(check.verdict))], &signed(check.verdict));
            html.markup("</tr>");
        }
        html.markup("</tbody></table></div></section>");
    }
    Ok(Page { title: "Jacobians", depth: 0, above }.render(&html))
}

fn force(html: &mut Html, check: &JacobianCheck, number: usize) -> io::Result<()> {
    let id = format!("force-{number}");
    let name = format!("{} in {}D", check.tag, check.dimension.count());
    html.open("section", &[("aria-labelledby", &id)]).element("h2", &[("id", &id)], &name);
    html.markup("<div class=\"heats\">");
    for finding in &check.blocks {
        html.markup("<div><h3>").text(finding.kind.name()).markup(": ");
        html.element("span", &[("class", class_of(finding.verdict))], &signed(finding.verdict));
        html.markup("</h3>");
        if let Some(exhibit) =
            finding.exhibit.as_ref().filter(|_| finding.verdict != Verdict::CorrectZero)
        {
            html.markup("<p class=\"hint\">").text(&format!(
                "Error {}, at the state “{}”, particle {} by particle {}; evidence at {} of {} states.",
                measured(exhibit.relative_error()),
                exhibit.state.name,
                exhibit.row,
                exhibit.column,
                finding.evidence,
                check.states
            ));
            html.markup("</p>");
            exhibit_maps(html, exhibit, check.dimension.count());
        }
        html.markup("</div>");
    }
    html.markup("</div><p>Properties: ");
    let asked = check.properties.iter().filter(|each| each.verdict != Verdict::NotApplicable);
    for (number, finding) in asked.enumerate() {
        let verdict = words(finding.verdict);
        html.markup(if number > 0 { "; " } else { "" });
        html.text(&format!(
            "{} ({}): {verdict}",
            finding.property.name(),
            finding.property.meaning()
        ));
    }
    html.markup(".</p>");
    if let Some(curves) = white_box::curves(check) {
        let series = |name: &str, style: usize, values: &[f64]| {
            Series::new(name, style, curves.steps.iter().copied().zip(values.iter().copied()))
        };
        let chart = Chart {
            title: format!("Error by step size, at the state of {}", curves.title),
            x_label: "step t along p (no unit), logarithmic".to_owned(),
            y_label: "error / |J p|, logarithmic".to_owned(),
            x_log: true,
            y_log: true,
            height: 320,
            series: vec![
                series("Taylor remainder with J p: slope 2", 0, &curves.with_jacobian),
                series("Taylor remainder without J p: slope 1", 1, &curves.without_jacobian),
                series("central difference against J p", 3, &curves.central),
            ],
        };
        chart.write(html, &format!("curves-{number}"))?;
    }
    html.markup("</section>\n");
    Ok(())
}

/// Adds the formula's values, the estimates and their differences as heat maps.
fn exhibit_maps(html: &mut Html, exhibit: &Exhibit, dimension: usize) {
    let ours: Vec<f64> = exhibit.entries.iter().map(|entry| entry.analytic).collect();
    let estimate = |entry: &Entry| entry.sharpest().map_or(f64::NAN, |estimate| estimate.value);
    let estimates: Vec<f64> = exhibit.entries.iter().map(estimate).collect();
    let blocks = [("formula", &*ours), ("differences", &*estimates)];
    maps(html, &blocks, dimension, Some(exhibit.worst));
}

/// Adds blocks, and the first minus the second. The blocks share their shades; the difference has its own.
fn maps(html: &mut Html, blocks: &[(&str, &[f64])], dimension: usize, worst: Option<usize>) {
    let size = |values: &[f64]| values.iter().fold(0.0_f64, |size, value| size.max(value.abs()));
    let shared = blocks.iter().map(|(_, values)| size(values)).fold(0.0, f64::max);
    html.markup("<div class=\"heats\">");
    for (name, values) in blocks {
        map(html, name, values, (dimension, shared, None));
    }
    if let [(first, a), (second, b), ..] = blocks {
        let difference: Vec<f64> = a.iter().zip(*b).map(|(a, b)| a - b).collect();
        let name = format!("{first} − {second}");
        map(html, &name, &difference, (dimension, size(&difference), worst));
    }
    html.markup("</div>");
}

/// Adds a block as a table whose cells are shaded by their values, relative to `size`.
fn map(
    html: &mut Html,
    name: &str,
    values: &[f64],
    (dimension, size, worst): (usize, f64, Option<usize>),
) {
    html.markup("<table class=\"heat\"><caption>").text(name).markup("</caption><tbody>");
    for (row, values) in values.chunks(dimension).enumerate() {
        html.markup("<tr>").element("th", &[("scope", "row")], axis(row));
        for (column, value) in values.iter().enumerate() {
            let mark = if worst == Some(row * dimension + column) { " worst" } else { "" };
            let class = format!("{}{mark}", shade(*value, size));
            html.element("td", &[("class", &class)], &shown(*value));
        }
        html.markup("</tr>");
    }
    html.markup("</tbody></table>");
}

/// A value with five digits, or fewer if it is short.
fn shown(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        0.01..10_000.0 => format!("{value:.4}"),
        _ => format!("{value:.4e}"),
    }
}

/// The class of a value's shade: `n4` for the most negative, `z`, `p4` for the most positive.
fn shade(value: f64, size: f64) -> String {
    let level = if size > 0.0 { (value.abs() / size * SHADES).round() } else { 0.0 };
    match () {
        () if !value.is_finite() => "not-finite".to_owned(),
        () if level == 0.0 => "z".to_owned(),
        () if value < 0.0 => format!("n{level}"),
        () => format!("p{level}"),
    }
}

fn class_of(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Correct | Verdict::CorrectZero | Verdict::NotApplicable => "good",
        Verdict::Wrong => "bad",
        Verdict::Inconclusive(_) => "odd",
    }
}

fn signed(verdict: Verdict) -> String {
    let sign = match class_of(verdict) {
        "good" => "✓",
        "bad" => "✗",
        _ => "?",
    };
    format!("{sign} {}", words(verdict))
}

/// The page of the forces and Jacobians of the submission `name`, measured from single steps.
pub fn probing(probing: &Probing, name: &str, above: &[(String, String)]) -> Vec<u8> {
    let mut html = Html::default();
    let (correct, offered) = probing.counts();
    html.markup("<h1>Forces and Jacobians that the steps of ").text(name).markup(" use</h1>");
    let class = match probing.verdict() {
        probe::Verdict::Wrong => "verdict bad",
        probe::Verdict::Inconclusive => "verdict odd",
        probe::Verdict::Correct | probe::Verdict::NotOffered => "verdict good",
    };
    html.element(
        "p",
        &[("class", class)],
        &format!("{correct} of {offered} findings are correct{}.", remarks::not_correct(probing)),
    );
    html.markup(
        "<p>Measured from single steps: the force against the documented formula, and each block of the Jacobian \
         against differences of the program's own force. Errors are relative to the largest entry.</p>",
    );
    for space in &probing.spaces {
        let failure = space.explicit.as_ref().err().or(space.implicit.as_ref().err());
        if let Some(failure) = failure {
            let words = format!("In {}D, not all is offered: {failure}", space.dimension.count());
            html.element("p", &[("class", "said")], &words);
        }
    }
    // Wrong ones first.
    let mut parts: Vec<&PartReport> = probing.parts.iter().collect();
    parts.sort_by_key(|part| Reverse(part.verdict()));
    for part in parts {
        let dimension = part.dimension.count();
        html.markup("<section><h2>").text(&format!("{} {}, {dimension}D", part.force, part.part));
        html.markup("</h2><p>").text(part.meaning).markup("</p>");
        for mistake in &part.diagnosis {
            html.markup("<p><strong>").text(mistake).markup("</strong></p>");
        }
        html.markup("<div class=\"wide\" tabindex=\"0\" role=\"region\" aria-label=\"Findings\"><table><thead><tr><th scope=\"col\">Quantity</th><th scope=\"col\">Verdict</th><th scope=\"col\" class=\"number\">Error</th><th scope=\"col\" class=\"number\">Noise</th><th scope=\"col\">Reason</th></tr></thead><tbody>");
        for (name, finding) in part.findings() {
            let (class, sign) = match finding.verdict {
                probe::Verdict::Correct => ("good", "✓"),
                probe::Verdict::Wrong => ("bad", "✗"),
                probe::Verdict::Inconclusive => ("odd", "?"),
                probe::Verdict::NotOffered => ("", "–"),
            };
            let verdict = format!("{sign} {}", finding.verdict.name().replace('-', " "));
            let shown = |value: Option<f64>| {
                value.map_or_else(|| "–".to_owned(), |value| format!("{value:.1e}"))
            };
            html.markup("<tr>").element("th", &[("scope", "row")], name);
            html.element("td", &[("class", class)], &verdict);
            html.element("td", &[("class", "number")], &shown(finding.error));
            html.element("td", &[("class", "number")], &shown(finding.bound));
            html.element("td", &[], &finding.reason).markup("</tr>");
        }
        html.markup("</tbody></table></div>");
        probed_blocks(&mut html, part);
        html.markup("</section>\n");
    }
    Page { title: "Jacobians", depth: 0, above }.render(&html)
}

/// Adds the blocks of a part: open where they are wrong.
fn probed_blocks(html: &mut Html, part: &PartReport) {
    let dimension = part.dimension.count();
    for (name, finding) in part.findings() {
        let Some(entry) = &finding.worst else { continue };
        let Some([used, own, ours]) = &entry.block else { continue };
        let open: Attributes<'_> =
            if finding.verdict == probe::Verdict::Wrong { &[("open", "")] } else { &[] };
        html.open("details", open).element("summary", &[], &format!("{name}, entry by entry"));
        let blocks =
            [("its steps use", &**used), ("its own force", &**own), ("our formula", &**ours)];
        let worst = entry.column.map(|(_, column)| entry.row.1 * dimension + column);
        maps(html, &blocks, dimension, worst);
        html.markup("</details>");
    }
}
