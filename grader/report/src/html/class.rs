//! Page of a class: a row for each submission, the distribution of points, and the most frequent findings.

use std::collections::BTreeMap;
use std::io;

use grader::class::Row;
use grader::class::entry::PassedOver;
use grader::grading::provenance::Provenance;
use sandbox::Protection;

use super::Sink;
use super::page::{Html, Page, address};
use crate::class::{Gap, creative};
use crate::text;

/// Bars of the distribution of points.
const BARS: usize = 10;

/// Most frequent findings that are listed.
const LISTED: usize = 12;

/// Folder of the submissions' pages below the page of the class, so that no name of theirs is one of ours.
pub const SUBMISSIONS: &str = "submissions";

/// A class that was graded.
pub struct ClassResult<'a> {
    /// The row of each submission, and the name of its folder in [`SUBMISSIONS`], if it has pages.
    pub rows: &'a [(&'a Row, Option<&'a str>)],
    /// The submissions without a result.
    pub gaps: &'a [Gap<'a>],
    /// Entries that are no submissions.
    pub passed_over: &'a [PassedOver],
    /// The protections under which programs ran.
    pub protections: &'a [Protection],
    /// The common provenance of all submissions.
    pub provenance: &'a Provenance,
}

/// Writes the page of a class, with its scripts and styles.
///
/// # Errors
/// If `sink` fails.
pub fn class(result: &ClassResult<'_>, sink: Sink<'_>) -> io::Result<()> {
    super::assets(sink)?;
    let mut html = Html::default();
    html.markup("<h1>Class</h1><ul class=\"score\"><li>");
    let rows = || result.rows.iter().map(|(row, _)| *row);
    let passed = rows().filter(|row| verdict_class(row) == "good").count();
    let faults = rows().filter(|row| row.is_fault()).count();
    html.text(&format!(
        "{} submissions: {passed} passed, {} failed, {faults} could not be judged",
        result.rows.len(),
        result.rows.len() - passed - faults
    ));
    html.markup("</li>");
    if !result.gaps.is_empty() {
        html.markup("<li>").text(&format!("Interrupted: {} not graded", result.gaps.len()));
        html.markup("</li>");
    }
    html.lines(|out| text::write_unprotected(out, result.protections))?;
    html.lines(|out| text::write_provenance(out, result.provenance))?;
    html.markup("</ul>");
    distribution(&mut html, result);
    findings(&mut html, result);
    table(&mut html, result);
    let remarks = rows().filter_map(|row| Some((&row.name, row.copied.as_deref()?)));
    let skipped = result.passed_over.iter().map(|other| (&other.name, &*other.reason));
    let adjusted = rows().flat_map(|row| row.adjustments.iter().map(move |it| (&row.name, it)));
    let adjusted = adjusted
        .map(|(name, (points, reason))| (name, format!("adjusted by {points} points: {reason}")));
    let remarks = remarks.chain(skipped).map(|(name, remark)| (name, remark.to_owned()));
    let remarks: Vec<_> = adjusted.chain(remarks).collect();
    if !remarks.is_empty() {
        html.markup("<section aria-labelledby=\"remarks\"><h2 id=\"remarks\">Remarks</h2><ul>");
        for (name, remark) in remarks {
            html.markup("<li><strong>").text(name).markup("</strong>: ").text(&remark);
            html.markup("</li>");
        }
        html.markup("</ul></section>");
    }
    sink("index.html", &Page { title: "Class", depth: 0, above: &[] }.render(&html))
}

/// Adds the name of a submission, linked to its first page if it has pages.
fn named(html: &mut Html, row: &Row, folder: Option<&str>) {
    match folder {
        Some(folder) => {
            html.link(&address(&format!("{SUBMISSIONS}/{folder}/index.html")), &row.name)
        }
        None => html.text(&row.name),
    };
}

/// "good", "bad" or "odd".
fn verdict_class(row: &Row) -> &'static str {
    match row.verdict.as_str() {
        "passed" | "passed-shipped" => "good",
        _ if row.is_fault() => "odd",
        _ => "bad",
    }
}

/// Adds the number of submissions by points, as bars. Submissions without points are left out.
fn distribution(html: &mut Html, result: &ClassResult<'_>) {
    let number = |text: &str| text.parse::<f64>().ok();
    let all = |row: &Row| {
        let creative = row.creative.as_ref().and_then(|(_, most)| number(most));
        Some(number(&row.required.1)? + number(&row.extra_credit.1)? + creative.unwrap_or(0.0))
    };
    let highest = result.rows.iter().filter_map(|(row, _)| all(row)).fold(0.0, f64::max);
    if highest <= 0.0 {
        return;
    }
    let mut counts = [0_usize; BARS];
    for points in result.rows.iter().filter_map(|(row, _)| number(&row.points)) {
        // All points belong to the last bar.
        let bar = (points / highest * BARS as f64).floor() as usize;
        counts[bar.min(BARS - 1)] += 1;
    }
    let most = counts.iter().copied().max().unwrap_or(0).max(1);
    let width = highest / BARS as f64;
    let range = |bar: usize| format!("{:.0}–{:.0}", width * bar as f64, width * (bar + 1) as f64);
    let words: Vec<String> =
        counts.iter().enumerate().map(|(bar, count)| format!("{}: {count}", range(bar))).collect();
    html.markup("<section aria-labelledby=\"points\"><h2 id=\"points\">Points</h2>");
    let label = format!("Submissions by points: {}", words.join(", "));
    html.open(
        "svg",
        &[
            ("class", "bars"),
            ("role", "img"),
            ("aria-label", &label),
            ("viewBox", "0 0 640 180"),
            ("width", "640"),
            ("height", "180"),
        ],
    );
    for (bar, count) in counts.iter().enumerate() {
        let height = 130.0 * *count as f64 / most as f64;
        let (x, y) = (64.0 * bar as f64, 150.0 - height);
        let attributes = [
            ("x", &*format!("{:.1}", x + 4.0)),
            ("y", &format!("{y:.1}")),
            ("width", "56"),
            ("height", &format!("{height:.1}")),
        ];
        html.open("rect", &attributes).close("rect");
        let middle = format!("{:.0}", x + 32.0);
        let text = |html: &mut Html, y: String, words: &str| {
            let attributes = [("x", &*middle), ("y", &y), ("text-anchor", "middle")];
            html.element("text", &attributes, words);
        };
        if *count > 0 {
            text(html, format!("{:.1}", y - 5.0), &count.to_string());
        }
        text(html, "168".to_owned(), &range(bar));
    }
    html.close("svg").markup("</section>\n");
}

/// Adds the findings by their number of submissions.
fn findings(html: &mut Html, result: &ClassResult<'_>) {
    let mut found: BTreeMap<&str, Vec<&(&Row, Option<&str>)>> = BTreeMap::new();
    for entry in result.rows {
        for finding in &entry.0.findings {
            found.entry(finding).or_default().push(entry);
        }
    }
    if found.is_empty() {
        return;
    }
    let mut found: Vec<_> = found.into_iter().collect();
    found.sort_by_key(|(_, entries)| std::cmp::Reverse(entries.len()));
    html.markup("<section aria-labelledby=\"findings\"><h2 id=\"findings\">Most frequent findings</h2><ol class=\"findings\">");
    for (finding, entries) in found.into_iter().take(LISTED) {
        html.markup("<li><strong>").text(finding).markup("</strong>: ");
        for (number, (row, folder)) in entries.iter().enumerate() {
            html.markup(if number > 0 { ", " } else { "" });
            named(html, row, *folder);
        }
        html.markup("</li>");
    }
    html.markup("</ol></section>\n");
}

fn table(html: &mut Html, result: &ClassResult<'_>) {
    html.markup("<section aria-labelledby=\"rows\" data-filtered><h2 id=\"rows\">Submissions</h2>");
    html.markup(
        "<form class=\"filters\" role=\"search\"><label>Show <select name=\"verdict\"><option value=\"\">all</option>\
         <option value=\"bad\">failed</option><option value=\"good\">passed</option>\
         <option value=\"odd\">not judged</option></select></label> <label>containing \
         <input type=\"search\" name=\"text\" autocomplete=\"off\"></label> <output></output></form>",
    );
    html.markup("<div class=\"wide\" tabindex=\"0\" role=\"region\" aria-labelledby=\"rows\"><table><thead><tr>");
    html.markup("<th scope=\"col\">Submission</th>");
    for name in ["Required", "Extra", "Creative", "Points", "Scenes", "Hidden", "Jacobians"] {
        let class = if name == "Points" { "number" } else { "number spare" };
        html.element("th", &[("scope", "col"), ("class", class)], name);
    }
    html.markup(
        "<th scope=\"col\">Verdict</th><th scope=\"col\">Findings</th></tr></thead><tbody>\n",
    );
    for (row, folder) in result.rows {
        let class = verdict_class(row);
        html.open("tr", &[("data-verdict", class)]).markup("<th scope=\"row\">");
        named(html, row, *folder);
        html.markup("</th>");
        let of = |(part, all): (usize, usize)| format!("{part}/{all}");
        let nothing = || "–".to_owned();
        let points = if row.is_fault() {
            format!("{}, {} not judged", row.points, row.not_judged)
        } else {
            row.points.clone()
        };
        for (class, value) in [
            ("number spare", format!("{}/{}", row.required.0, row.required.1)),
            ("number spare", format!("{}/{}", row.extra_credit.0, row.extra_credit.1)),
            ("number spare", row.creative.as_ref().map_or_else(nothing, creative)),
            ("number", points),
            ("number spare", of(row.scenes)),
            ("number spare", row.hidden.map_or_else(nothing, of)),
            ("number spare", row.jacobians.map_or_else(nothing, of)),
        ] {
            html.element("td", &[("class", class)], &value);
        }
        let sign = match class {
            "good" => "✓",
            "bad" => "✗",
            _ => "?",
        };
        let verdict = format!("{sign} {}", row.verdict.replace('-', " "));
        html.element("td", &[("class", class)], &verdict);
        html.element("td", &[], &row.findings.join("; ")).markup("</tr>\n");
    }
    for gap in result.gaps {
        html.markup("<tr data-verdict=\"odd\">").element("th", &[("scope", "row")], gap.name);
        let verdict = format!("? {}", gap.missing.name());
        html.markup(
            "<td class=\"spare\" colspan=\"3\"></td><td></td><td class=\"spare\" colspan=\"3\"></td>",
        );
        html.element("td", &[("class", "odd")], &verdict);
        html.markup("<td></td></tr>\n");
    }
    html.markup("</tbody></table></div></section>\n");
}
