//! Stability map of a method over `h ω` and the damping ratio, as SVG.
//!
//! The grey of a cell shows the amplification in one step: darker is closer to 1. A cell where the oscillation grows is
//! white with a cross. The line is the theoretical boundary. The map needs no colours.

use plotters::prelude::*;

use crate::report::picture::{self, Area, Drawn, PictureError};
use crate::stability::theory::map::{CELLS, EDGES, Map, middle};

const SIZE: (u32, u32) = (900, 640);

const RED: RGBColor = RGBColor(170, 30, 0);

/// Shades by spectral radius: the least radius, the grey, and its label.
pub(super) const SHADES: [(f64, u8, &str); 5] = [
    (0.99, 120, "0.99 to 1: kept"),
    (0.9, 150, "0.9 to 0.99"),
    (0.5, 180, "0.5 to 0.9"),
    (0.1, 210, "0.1 to 0.5"),
    (0.0, 235, "below 0.1: gone in a step"),
];

/// The map as an SVG document, with a newline at its end.
///
/// # Errors
/// If the drawing fails.
pub fn svg(map: &Map) -> Result<String, PictureError> {
    picture::svg(SIZE, |area| draw(area, map))
}

/// The grey of a cell; `None` if the motion grows.
pub(super) fn shade(radius: f64) -> Option<u8> {
    let kept = |radius: f64| SHADES.iter().find(|(least, ..)| radius >= *least);
    (radius <= 1.0 + 1e-9).then(|| kept(radius).map_or(255, |(_, grey, _)| *grey))
}

fn draw(area: &Area<'_>, map: &Map) -> Drawn {
    area.fill(&WHITE)?;
    let (left, right) = area.split_horizontally(650);
    let [[x0, x1], [y0, y1]] = EDGES;
    let title = format!("{}: what a step leaves of an oscillation", map.method);
    let mut chart = ChartBuilder::on(&left)
        .caption(title, ("sans-serif", 20))
        .margin(14)
        .x_label_area_size(48)
        .y_label_area_size(72)
        .build_cartesian_2d(x0..x1, y0..y1)?;
    chart
        .configure_mesh()
        .disable_mesh()
        .x_labels(5)
        .y_labels(5)
        .x_label_formatter(&power_of_ten)
        .y_label_formatter(&power_of_ten)
        .x_desc("h ω (radians a step)")
        .y_desc("damping ratio ζ (no unit)")
        .label_style(("sans-serif", 15))
        .axis_desc_style(("sans-serif", 17))
        .draw()?;

    let width = (x1 - x0) / CELLS[0] as f64;
    let height = (y1 - y0) / CELLS[1] as f64;
    let (mut cells, mut crosses) = (Vec::new(), Vec::<(f64, f64)>::new());
    for (row, radii) in map.radii.chunks(CELLS[0]).enumerate() {
        let y = y0 + height * row as f64;
        let mut column = 0;
        // Draw adjacent cells of the same shade as one rectangle.
        for run in radii.chunk_by(|a, b| shade(*a) == shade(*b)) {
            let [start, end] =
                [column, column + run.len()].map(|column| x0 + width * column as f64);
            if let Some(grey) = shade(run[0]) {
                let style = RGBColor(grey, grey, grey).filled();
                cells.push(Rectangle::new([(start, y), (end, y + height)], style));
            } else if row % 2 == 0 {
                let within = (column..column + run.len()).filter(|column| column % 2 == 0);
                let centre = |column| -> (f64, f64) { middle(column, row).map(f64::log10).into() };
                crosses.extend(within.map(centre));
            }
            column += run.len();
        }
    }
    chart.draw_series(cells)?;
    chart.draw_series(crosses.into_iter().map(|at| Cross::new(at, 3, BLACK.stroke_width(1))))?;
    for line in boundary_lines(map.method) {
        chart.draw_series(LineSeries::new(line, RED.stroke_width(3)))?;
    }
    legend(&right, map)
}

/// The theoretical boundary within the map, as points in logarithms.
pub(super) fn boundary_lines(method: &str) -> Vec<Vec<(f64, f64)>> {
    let [[x0, x1], [y0, y1]] = EDGES;
    let zetas = (0..=2000).map(|number| y0 + (y1 - y0) * f64::from(number) / 2000.0);
    let line = |of: &dyn Fn(f64) -> Option<f64>| -> Vec<(f64, f64)> {
        let points = zetas.clone().filter_map(|zeta| {
            let a = of(10.0_f64.powf(zeta)).filter(|a| a.is_finite() && *a > 0.0)?;
            Some((a.log10(), zeta))
        });
        points.filter(|(a, _)| (x0..=x1).contains(a)).collect()
    };
    let Some(integrator) = simulator::vocabulary().integrator(method) else { return Vec::new() };
    let stable = |zeta| reference::method::stable_steps(integrator.equation, zeta);
    let first = line(&|zeta| Some(stable(zeta)[0]));
    let second = line(&|zeta| Some(stable(zeta)[1]).filter(|second| second.is_finite()));
    [first, second].into_iter().filter(|line| !line.is_empty()).collect()
}

fn legend(area: &Area<'_>, map: &Map) -> Drawn {
    let text = |words: &str, at: (i32, i32)| {
        Text::new(words.to_owned(), at, ("sans-serif", 15).into_font().color(&BLACK))
    };
    let mut y = 60;
    area.draw(&text("left of it after a step", (10, y)))?;
    area.draw(&text("(spectral radius):", (10, y + 20)))?;
    y += 50;
    for (_, grey, words) in SHADES {
        let style = RGBColor(grey, grey, grey).filled();
        area.draw(&Rectangle::new([(10, y), (40, y + 18)], style))?;
        area.draw(&Rectangle::new([(10, y), (40, y + 18)], BLACK.stroke_width(1)))?;
        area.draw(&text(words, (50, y + 2)))?;
        y += 28;
    }
    area.draw(&Rectangle::new([(10, y), (40, y + 18)], BLACK.stroke_width(1)))?;
    area.draw(&Cross::new((25, y + 9), 3, BLACK.stroke_width(1)))?;
    area.draw(&text("above 1: it grows", (50, y + 2)))?;
    y += 44;
    if boundary_lines(map.method).is_empty() {
        area.draw(&text("by theory: stable everywhere", (10, y)))?;
    } else {
        area.draw(&PathElement::new([(10, y + 8), (40, y + 8)], RED.stroke_width(3)))?;
        area.draw(&text("boundary by theory", (50, y)))?;
    }
    Ok(())
}

/// Label of a tick; axes are in decimal logarithms.
fn power_of_ten(exponent: &f64) -> String {
    match exponent.round() as i32 {
        whole @ 0..=2 => format!("{}", 10_u32.pow(whole.unsigned_abs())),
        whole => format!("{}", 10.0_f64.powi(whole)),
    }
}
