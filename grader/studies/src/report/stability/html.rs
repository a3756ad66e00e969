//! Stability maps as a page: one picture per method, in which each cell shows its number at the pointer.

use std::io;

use report::html::page::{Html, Page};
use report::html::{self, Sink};

use super::plot::{SHADES, boundary_lines, shade};
use super::text;
use crate::stability::StabilityReport;
use crate::stability::theory::map::{CELLS, EDGES, Map, middle};

/// Side of a cell, in pixels.
const CELL: usize = 10;

/// Space for labels at the left and at the bottom, in pixels.
const MARGIN: [usize; 2] = [64, 46];

/// Writes the page, with its scripts and styles.
///
/// # Errors
/// If `sink` fails.
pub fn write(report: &StabilityReport, sink: Sink<'_>) -> io::Result<()> {
    let mut page = Html::default();
    page.markup("<h1>Stability</h1>");
    let class = if report.is_pass() { "verdict good" } else { "verdict bad" };
    let words = if report.is_pass() { "As expected." } else { "Not as expected; see the report." };
    page.element("p", &[("class", class)], words);
    if !report.maps.is_empty() {
        page.markup(
            "<p>What a step leaves of an oscillation, measured: the spectral radius over the step h ω and the damping \
             ratio ζ. Darker cells keep more; in cells with a cross the motion grows. The line is the boundary by \
             theory. Point at a cell to see its number.</p><ul class=\"legend\">",
        );
        for (number, (.., words)) in SHADES.iter().enumerate() {
            page.markup("<li>");
            page.open("svg", &[("width", "28"), ("height", "14"), ("aria-hidden", "true")]);
            let class = format!("shade-{number}");
            page.open("rect", &[("width", "28"), ("height", "14"), ("class", &class)]);
            page.close("rect").close("svg").text(words).markup("</li>");
        }
        page.markup("</ul>");
    }
    for map in &report.maps {
        page.markup("<section><h2>").text(map.method).markup("</h2>");
        draw(&mut page, map);
        page.markup("</section>\n");
    }
    page.markup("<section><h2>The whole report</h2>");
    page.report(|out| text::write(out, report))?;
    page.markup("</section>");
    html::single(&Page { title: "Stability", depth: 0, above: &[] }.render(&page), sink)
}

/// Adds the map of a method.
fn draw(page: &mut Html, map: &Map) {
    let [width, height] = [CELLS[0] * CELL, CELLS[1] * CELL];
    let [left, below] = MARGIN;
    let (all, high) = (left + width + 10, height + below);
    let label = format!("Stability map of {}; the report below has the boundaries", map.method);
    page.open(
        "svg",
        &[
            ("class", "drawing scaled"),
            ("role", "img"),
            ("aria-label", &label),
            ("viewBox", &format!("0 0 {all} {high}")),
            ("width", &all.to_string()),
        ],
    );
    for (place, radius) in map.radii.iter().enumerate() {
        let (row, column) = (place / CELLS[0], place % CELLS[0]);
        let [x, y] = [left + column * CELL, height - (row + 1) * CELL];
        let [step, ratio] = middle(column, row);
        let shade =
            shade(*radius).and_then(|grey| SHADES.iter().position(|(_, known, _)| *known == grey));
        let class = shade.map_or_else(|| "grows".to_owned(), |shade| format!("shade-{shade}"));
        page.open(
            "rect",
            &[
                ("x", &x.to_string()),
                ("y", &y.to_string()),
                ("width", "10"),
                ("height", "10"),
                ("class", &class),
            ],
        );
        let words = format!("h ω = {step:.3}, ζ = {ratio:.3}: {radius:.4}");
        page.element("title", &[], &words).close("rect");
        if shade.is_none() && row % 2 == 0 && column % 2 == 0 {
            let cross = format!("M{} {}l4 4m0 -4l-4 4", x + 3, y + 3);
            page.open("path", &[("d", &cross), ("class", "cross")]).close("path");
        }
    }
    let place = |axis: usize, exponent: f64| {
        let [low, edge] = EDGES[axis];
        (exponent - low) / (edge - low)
    };
    for line in boundary_lines(map.method) {
        let points = line.iter().map(|(step, ratio)| {
            let x = left as f64 + place(0, *step) * width as f64;
            let y = (1.0 - place(1, *ratio)) * height as f64;
            format!("{x:.1} {y:.1}")
        });
        let path = format!("M{}", points.collect::<Vec<_>>().join("L"));
        page.open("path", &[("d", &path), ("class", "boundary"), ("fill", "none")]).close("path");
    }
    let mut label = |x: f64, y: f64, anchor: &str, words: &str| {
        let [x, y] = [x, y].map(|value| format!("{value:.0}"));
        page.element("text", &[("x", &x), ("y", &y), ("text-anchor", anchor)], words);
    };
    for exponent in -2..=2 {
        let words = format!("1e{exponent}");
        let x = left as f64 + place(0, f64::from(exponent)) * width as f64;
        label(x, height as f64 + 16.0, "middle", &words);
        let y = (1.0 - place(1, f64::from(exponent))) * height as f64;
        label(left as f64 - 8.0, y.max(8.0) + 4.0, "end", &words);
    }
    label((left + width / 2) as f64, high as f64 - 8.0, "middle", "h ω (radians a step)");
    label(4.0, height as f64 / 2.0, "start", "ζ");
    page.close("svg");
}
