//! Work-precision diagram of a scene, as SVG: computing time of a run against its error.
//!
//! Curves differ by colour, dashes and marker ([`look`]); those of a submission have open markers. Bars across a marker extend to
//! the median time. Runs that blew up or failed are in a separate band at the top, one row per curve, with the longest and
//! the shortest of their time steps. A grey line shows the reference's error bar; points at or below it are drawn on it.

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::{short, style, time};
use crate::accuracy::{Curve, Point, RunOutcome, SceneStudy};
use crate::report::picture::{self, Area, Drawn, PictureError};
use report::look::{self, DASHES, Look};

const WIDTH: u32 = 1100;
const HEIGHT: u32 = 640;

/// Left edge of the legend.
const LEGEND: i32 = 800;

/// Width of the plot between its axes.
const PLOT: i32 = LEGEND - 14 - 84 - 14;

const GREY: RGBColor = RGBColor(110, 110, 110);

/// Colours that also differ in brightness, for colour-blind readers.
const COLORS: [RGBColor; look::COLORS] = [
    RGBColor(0, 90, 160),
    RGBColor(215, 95, 0),
    RGBColor(0, 130, 90),
    RGBColor(150, 30, 90),
    RGBColor(20, 20, 20),
    RGBColor(150, 115, 0),
    RGBColor(105, 85, 215),
    RGBColor(0, 160, 190),
    RGBColor(200, 30, 40),
];

/// The diagram of a scene as an SVG document, with a newline at its end.
///
/// # Errors
/// If no run has an error and a time.
pub fn svg(scene: &SceneStudy) -> Result<String, PictureError> {
    picture::svg((WIDTH, HEIGHT), |area| draw(area, scene))
}

type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// A drawn point, in decimal logarithms.
struct Mark {
    time: f64,
    error: f64,
    /// The logarithm of the median time.
    median: f64,
}

/// Style of a curve.
#[derive(Clone, Copy)]
struct Style {
    color: RGBColor,
    dashes: &'static [u32],
    marker: usize,
    open: bool,
}

impl Style {
    /// The style of curve `number`.
    fn of(number: usize, scene: &SceneStudy) -> Self {
        let Look { color, dashes, marker } = Look::of(style(number, scene));
        let open = scene.curves[number].foreign;
        Self { color: COLORS[color], dashes: DASHES[dashes], marker, open }
    }
}

/// Position of a point; its error is not drawn below the floor.
fn mark(point: &Point, floor: f64) -> Option<Mark> {
    match (&point.outcome, point.cost.time) {
        (RunOutcome::Finished { largest, .. }, Some(cost)) => Some(Mark {
            time: cost.least.log10(),
            error: largest.position.max(floor).log10(),
            median: cost.median.log10(),
        }),
        _ => None,
    }
}

/// Logarithm of the time of a run without a result; for a run that stopped early, extrapolated to all its steps.
fn lost(point: &Point) -> Option<f64> {
    let cost = point.cost.time?.least;
    match point.outcome {
        RunOutcome::Finished { .. } => None,
        RunOutcome::BlownUp { .. } => Some(cost.log10()),
        RunOutcome::Failed { step, .. } => {
            Some((cost * point.steps as f64 / step.clamp(1, point.steps) as f64).log10())
        }
    }
}

fn draw(area: &Area<'_>, scene: &SceneStudy) -> Drawn {
    area.fill(&WHITE)?;
    let floor = scene.reference.floor.position;
    let all: Vec<Mark> =
        scene.curves.iter().flat_map(|c| &c.points).filter_map(|p| mark(p, floor)).collect();
    if all.is_empty() {
        return Err("no run has an error and a time".into());
    }
    let lost_times = || scene.curves.iter().flat_map(|c| &c.points).filter_map(lost);
    let range = |values: &mut dyn Iterator<Item = f64>| {
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        })
    };
    let (left, right) = range(&mut all.iter().map(|mark| mark.time).chain(lost_times()));
    let (bottom, top) = range(&mut all.iter().map(|mark| mark.error));
    // The curve's marker is to the left of the first mark of its row.
    let (left, right) =
        (left - 0.05 * (right - left).max(1.0), right + 0.05 * (right - left).max(1.0));
    let (bottom, top) = (bottom.floor(), top.ceil().max(bottom.floor() + 1.0));
    // Rows at the top, with the height of a mark and the number below it.
    let rows: Vec<usize> = (0..scene.curves.len())
        .filter(|number| scene.curves[*number].points.iter().any(|point| lost(point).is_some()))
        .collect();
    let plot_height = f64::from(HEIGHT) - 150.0;
    let row_height = 34.0_f64.min(0.5 * plot_height / rows.len().max(1) as f64);
    let share = rows.len() as f64 * row_height / plot_height;
    let band = (top - bottom) * share / (1.0 - share);

    let (plot, legend) = area.split_horizontally(LEGEND);
    let title = format!("{}: {}", scene.target.name, scene.target.title);
    plot.draw(&text(title, (24, 12), 20, BLACK, (HPos::Left, VPos::Top)))?;
    let mut chart = ChartBuilder::on(&plot)
        .margin(14)
        .margin_top(44)
        .x_label_area_size(52)
        .y_label_area_size(84)
        .build_cartesian_2d(left..right, bottom..top + band)?;
    let decades = |low: f64, high: f64| (high.floor() - low.ceil()).max(1.0) as usize + 1;
    chart
        .configure_mesh()
        .x_labels(decades(left, right))
        .y_labels(decades(bottom, top + band))
        .x_label_formatter(&|exponent| {
            decade(*exponent, |value| time(value).replace(".00", "").replace(".0", ""))
        })
        .y_label_formatter(&|exponent| {
            if *exponent > top + 1e-9 {
                String::new()
            } else {
                decade(*exponent, |value| format!("{value:.0e}"))
            }
        })
        .x_desc("time of a run (s, the least of several), logarithmic")
        .y_desc("largest position error (m), logarithmic")
        .label_style(("sans-serif", 14))
        .axis_desc_style(("sans-serif", 16))
        .light_line_style(TRANSPARENT)
        .bold_line_style(GREY.mix(0.25))
        .draw()?;
    if !rows.is_empty() {
        no_solution(&mut chart, scene, &rows, (left, right), (top, band))?;
    }
    if floor.log10() > bottom {
        let line = [(left, floor.log10()), (right, floor.log10())];
        chart.draw_series(LineSeries::new(line, GREY.stroke_width(2)))?;
    }
    for (number, curve) in scene.curves.iter().enumerate() {
        curve_of(&mut chart, curve, Style::of(number, scene), floor)?;
    }
    key(&legend, scene, !rows.is_empty())
}

/// The label of an integer exponent; empty for others.
fn decade(exponent: f64, words: impl Fn(f64) -> String) -> String {
    let whole = exponent.round();
    if (exponent - whole).abs() > 1e-6 { String::new() } else { words(10_f64.powf(whole)) }
}

fn text<'a>(
    words: String,
    at: (i32, i32),
    size: u32,
    color: RGBColor,
    (across, down): (HPos, VPos),
) -> Text<'a, (i32, i32), String> {
    let style = ("sans-serif", size).into_font().color(&color).pos(Pos::new(across, down));
    Text::new(words, at, style)
}

fn curve_of(chart: &mut Chart<'_, '_>, curve: &Curve, look: Style, floor: f64) -> Drawn {
    // Leave a gap at missing points: no line crosses runs that blew up.
    for run in curve.points.split(|point| mark(point, floor).is_none()) {
        let marks: Vec<Mark> = run.iter().filter_map(|point| mark(point, floor)).collect();
        let Some(Mark { time, error, .. }) = marks.first() else { continue };
        let start = (*time, *error);
        let pixel = |at: (f64, f64)| chart.backend_coord(&at);
        let origin = pixel(start);
        let line: Vec<(i32, i32)> = marks
            .iter()
            .map(|mark| pixel((mark.time, mark.error)))
            .map(|(x, y)| (x - origin.0, y - origin.1))
            .collect();
        for dash in dashed(&line, look.dashes) {
            let dash = PathElement::new(dash, look.color.stroke_width(2));
            chart.draw_series([EmptyElement::at(start) + dash])?;
        }
        for Mark { time, error, median } in marks {
            let bar =
                PathElement::new([(time, error), (median, error)], look.color.stroke_width(1));
            chart.draw_series([bar])?;
            chart.draw_series([EmptyElement::at((time, error)) + marker(look)])?;
        }
    }
    Ok(())
}

/// The dashes of a line through these pixels: `pattern` holds the lengths of dashes and gaps, and is empty for a solid line.
fn dashed(line: &[(i32, i32)], pattern: &[u32]) -> Vec<Vec<(i32, i32)>> {
    if pattern.is_empty() {
        return vec![line.to_vec()];
    }
    let mut lengths = pattern.iter().map(|length| f64::from(*length)).cycle();
    let mut left = lengths.next().unwrap_or_default();
    let (mut dashes, mut dash, mut is_gap) = (Vec::new(), Vec::new(), false);
    dash.extend(line.first());
    for ends in line.windows(2) {
        let [from, to] = [ends[0], ends[1]].map(|(x, y)| (f64::from(x), f64::from(y)));
        let length = (to.0 - from.0).hypot(to.1 - from.1);
        let mut done = 0.0;
        while done + left < length {
            done += left;
            let part = done / length;
            let at = (from.0 + part * (to.0 - from.0), from.1 + part * (to.1 - from.1));
            let end = (at.0.round() as i32, at.1.round() as i32);
            dash.push(end);
            let whole = std::mem::replace(&mut dash, vec![end]);
            if !is_gap {
                dashes.push(whole);
            }
            is_gap = !is_gap;
            left = lengths.next().unwrap_or_default();
        }
        left -= length - done;
        dash.push(ends[1]);
    }
    if !is_gap {
        dashes.push(dash);
    }
    dashes
}

/// Draws the band above the errors: one row per curve, one cross per run, with the first and the last time step.
fn no_solution(
    chart: &mut Chart<'_, '_>,
    scene: &SceneStudy,
    rows: &[usize],
    (left, right): (f64, f64),
    (top, band): (f64, f64),
) -> Drawn {
    let ground =
        Rectangle::new([(left, top), (right, top + band)], RGBColor(250, 236, 232).filled());
    chart.draw_series([ground])?;
    chart.draw_series(LineSeries::new([(left, top), (right, top)], GREY.stroke_width(1)))?;
    for (row, number) in rows.iter().enumerate() {
        let look = Style::of(*number, scene);
        let height = top + band * (1.0 - (row as f64 + 0.32) / rows.len() as f64);
        // Runs that stop early take similar times: space their numbers so that they do not overlap.
        let pixels = f64::from(PLOT) / (right - left);
        let crosses: Vec<(f64, f64)> = scene.curves[*number]
            .points
            .iter()
            .filter_map(|point| Some((lost(point)?, point.time_step)))
            .collect();
        let mut free = f64::NEG_INFINITY;
        for (place, (time, step)) in crosses.iter().enumerate() {
            let is_end = place == 0 || place + 1 == crosses.len();
            let label = if is_end { short(*step) } else { String::new() };
            let at = time * pixels;
            let half = 3.0 * label.chars().count() as f64 + 2.0;
            let shift = if is_end { (free + half - at).max(0.0) } else { 0.0 };
            if is_end {
                free = at + shift + half;
            }
            let style = ("sans-serif", 11)
                .into_font()
                .color(&look.color)
                .pos(Pos::new(HPos::Center, VPos::Top));
            let words = Text::new(label, (shift.round() as i32, 8), style);
            let cross = Cross::new((0, 0), 5, look.color.stroke_width(3));
            chart.draw_series([EmptyElement::at((*time, height)) + cross + words])?;
        }
        // The curve's marker is before its first cross.
        if let Some((time, _)) = crosses.first() {
            let beside = EmptyElement::at((*time, height)) + shifted(look, -16);
            chart.draw_series([beside])?;
        }
    }
    Ok(())
}

/// Draws the legend, to the right of the plot.
fn key(area: &Area<'_>, scene: &SceneStudy, lost: bool) -> Drawn {
    let mut y = 54;
    // The notes below take as much again as eight rows.
    let pitch = 26.min((HEIGHT as i32 - y) / (scene.curves.len() as i32 + 8));
    for (number, curve) in scene.curves.iter().enumerate() {
        let look = Style::of(number, scene);
        let (from, to) = (4, 50);
        for dash in dashed(&[(from, y), (to, y)], look.dashes) {
            area.draw(&PathElement::new(dash, look.color.stroke_width(2)))?;
        }
        area.draw(&(EmptyElement::at((27, y)) + marker(look)))?;
        area.draw(&text(curve.label(), (60, y), 14, BLACK, (HPos::Left, VPos::Center)))?;
        y += pitch;
    }
    y += 8;
    let mut notes = vec![
        "Each point halves the time step of the".to_owned(),
        "one before. Lines to the right of a".to_owned(),
        "marker reach to the median time.".to_owned(),
    ];
    if lost {
        notes.extend([
            String::new(),
            "× in the band at the top: blew up or".to_owned(),
            "failed, from and to these time steps (s).".to_owned(),
        ]);
    }
    let errors = scene.reference.floor.position;
    notes.extend([
        String::new(),
        format!("The reference is known to {errors:.0e} m;"),
        "no point is shown below that.".to_owned(),
    ]);
    if scene.curves.iter().any(|curve| curve.foreign) {
        notes.extend([
            String::new(),
            "theirs: open markers; wall time of the".to_owned(),
            "whole process.".to_owned(),
        ]);
    }
    for note in notes {
        area.draw(&text(note, (4, y), 13, GREY, (HPos::Left, VPos::Center)))?;
        y += 18;
    }
    Ok(())
}

type Marker<'a> = DynElement<'static, SVGBackend<'a>, (i32, i32)>;

/// The marker of a curve, at the origin.
fn marker<'a>(look: Style) -> Marker<'a> {
    shifted(look, 0)
}

/// The marker of a curve, shifted to the right of the origin.
fn shifted<'a>(look: Style, x: i32) -> Marker<'a> {
    let thin = look.color.stroke_width(2);
    let style = if look.open { thin } else { look.color.filled() };
    let polygon = |corners: &[(i32, i32)]| -> Marker<'a> {
        let corners: Vec<(i32, i32)> = corners.iter().map(|(dx, dy)| (x + dx, *dy)).collect();
        if look.open {
            let closed = [corners.clone(), vec![corners[0]]].concat();
            PathElement::new(closed, thin).into_dyn()
        } else {
            Polygon::new(corners, style).into_dyn()
        }
    };
    match look.marker {
        0 => Circle::new((x, 0), 5, style).into_dyn(),
        1 => polygon(&[(0, -6), (6, 5), (-6, 5)]),
        2 => polygon(&[(-5, -5), (5, -5), (5, 5), (-5, 5)]),
        3 => polygon(&[(0, -7), (6, 0), (0, 7), (-6, 0)]),
        4 => polygon(&[(0, 6), (6, -5), (-6, -5)]),
        5 => polygon(&[(0, -8), (2, -2), (8, 0), (2, 2), (0, 8), (-2, 2), (-8, 0), (-2, -2)]),
        _ => polygon(&[(-6, -3), (0, -7), (6, -3), (4, 5), (-4, 5)]),
    }
}
