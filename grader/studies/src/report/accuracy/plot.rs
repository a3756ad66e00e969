//! Work-precision diagram of a scene, as SVG and PNG: computing time of a run against its error.
//!
//! Curves differ by colour, marker and dashes; those of a submission have open markers. Bars across a marker extend to
//! the median time. Runs that blew up or failed are in a separate band at the top, one row per curve, with the time
//! step below each mark. A grey line shows the reference's error bar; points at or below it are drawn on it.

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::{short, time};
use crate::accuracy::{Curve, Point, RunOutcome, SceneStudy};
use crate::report::picture::{self, Area, Drawn, PictureError, Surface};

const WIDTH: u32 = 1100;
const HEIGHT: u32 = 640;

/// Left edge of the legend.
const LEGEND: i32 = 800;

/// Width of the plot between its axes.
const PLOT: i32 = LEGEND - 14 - 84 - 14;

/// PNG pixels per SVG unit.
const SCALE: f32 = 1.5;

const GREY: RGBColor = RGBColor(110, 110, 110);

/// Colours that also differ in brightness, for colour-blind readers.
const COLORS: [RGBColor; 10] = [
    RGBColor(0, 90, 160),
    RGBColor(200, 80, 0),
    RGBColor(0, 130, 90),
    RGBColor(150, 30, 90),
    RGBColor(90, 90, 90),
    RGBColor(20, 20, 20),
    RGBColor(120, 90, 0),
    RGBColor(90, 60, 180),
    RGBColor(0, 140, 170),
    RGBColor(190, 30, 30),
];

/// Lengths of dash and gap; `None` for a solid line.
const DASHES: [Option<(i32, i32)>; 5] =
    [None, Some((9, 4)), Some((2, 4)), Some((14, 3)), Some((5, 5))];

/// The diagram of a scene as an SVG document, with a newline at its end.
///
/// # Errors
/// If no run has an error and a time.
pub fn svg(scene: &SceneStudy) -> Result<String, PictureError> {
    picture::svg((WIDTH, HEIGHT), |area| draw(area, scene))
}

/// The same diagram as a PNG file.
///
/// # Errors
/// If no run has an error and a time.
pub fn png(scene: &SceneStudy) -> Result<Vec<u8>, PictureError> {
    picture::png((WIDTH, HEIGHT), SCALE, |area| draw(area, scene))
}

type Chart<'a, 'b> = ChartContext<'a, Surface<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// A drawn point, in decimal logarithms.
struct Mark {
    time: f64,
    error: f64,
    /// The logarithm of the median time.
    median: f64,
}

/// Style of a curve.
#[derive(Clone, Copy)]
struct Look {
    color: RGBColor,
    dashes: Option<(i32, i32)>,
    marker: usize,
    open: bool,
}

impl Look {
    /// The style of curve `number`: ten differ by colour and marker. A submission's curve has the style of the
    /// built-in simulator's same method, with an open marker.
    fn of(number: usize, scene: &SceneStudy) -> Self {
        let curve = &scene.curves[number];
        let is_alike = |other: &Curve| !other.foreign && other.method == curve.method;
        let number = scene.curves.iter().position(is_alike).unwrap_or(number);
        let foreign = curve.foreign;
        Self {
            color: COLORS[number % COLORS.len()],
            dashes: DASHES[number % DASHES.len()],
            marker: number % 10,
            open: foreign,
        }
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
        .y_label_formatter(&|exponent| match *exponent > top + 1e-9 {
            true => String::new(),
            false => decade(*exponent, |value| format!("{value:.0e}")),
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
        curve_of(&mut chart, curve, Look::of(number, scene), floor)?;
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

fn curve_of(chart: &mut Chart<'_, '_>, curve: &Curve, look: Look, floor: f64) -> Drawn {
    // Leave a gap at missing points: no line crosses runs that blew up.
    for run in curve.points.split(|point| mark(point, floor).is_none()) {
        let marks: Vec<Mark> = run.iter().filter_map(|point| mark(point, floor)).collect();
        let line = marks.iter().map(|mark| (mark.time, mark.error));
        let stroke = look.color.stroke_width(2);
        match look.dashes {
            None => chart.draw_series(LineSeries::new(line, stroke))?,
            Some((dash, gap)) => {
                chart.draw_series(DashedLineSeries::new(line, dash, gap, stroke))?
            }
        };
        for Mark { time, error, median } in marks {
            let bar =
                PathElement::new([(time, error), (median, error)], look.color.stroke_width(1));
            chart.draw_series([bar])?;
            chart.draw_series([EmptyElement::at((time, error)) + marker(look)])?;
        }
    }
    Ok(())
}

/// Draws the band above the errors: one row per curve, one cross per run, with its time step.
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
        let look = Look::of(*number, scene);
        let height = top + band * (1.0 - (row as f64 + 0.32) / rows.len() as f64);
        // Runs that stop early take similar times: space their numbers so that they do not overlap.
        let pixels = f64::from(PLOT) / (right - left);
        let mut free = f64::NEG_INFINITY;
        for point in &scene.curves[*number].points {
            let Some(time) = lost(point) else { continue };
            let label = short(point.time_step);
            let at = time * pixels;
            let half = 3.0 * label.chars().count() as f64 + 2.0;
            let shift = (free + half - at).max(0.0);
            free = at + shift + half;
            let style = ("sans-serif", 11)
                .into_font()
                .color(&look.color)
                .pos(Pos::new(HPos::Center, VPos::Top));
            let words = Text::new(label, (shift.round() as i32, 8), style);
            let cross = Cross::new((0, 0), 5, look.color.stroke_width(3));
            chart.draw_series([EmptyElement::at((time, height)) + cross + words])?;
        }
        // The curve's marker is before its first cross.
        let first = scene.curves[*number].points.iter().find_map(lost);
        if let Some(time) = first {
            let beside = EmptyElement::at((time, height)) + shifted(look, -16);
            chart.draw_series([beside])?;
        }
    }
    Ok(())
}

/// Draws the legend, to the right of the plot.
fn key(area: &Area<'_>, scene: &SceneStudy, lost: bool) -> Drawn {
    let mut y = 54;
    for (number, curve) in scene.curves.iter().enumerate() {
        let look = Look::of(number, scene);
        let (from, to) = (4, 50);
        let (dash, gap) = look.dashes.unwrap_or((to - from, 0));
        let mut x = from;
        while x < to {
            let end = (x + dash).min(to);
            area.draw(&PathElement::new([(x, y), (end, y)], look.color.stroke_width(2)))?;
            x = end + gap.max(1);
        }
        area.draw(&(EmptyElement::at((27, y)) + marker(look)))?;
        area.draw(&text(curve.label(), (60, y), 14, BLACK, (HPos::Left, VPos::Center)))?;
        y += 26;
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
            "failed; the number is the time step (s).".to_owned(),
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

type Marker<'a> = DynElement<'static, Surface<'a>, (i32, i32)>;

/// The marker of a curve, at the origin.
fn marker<'a>(look: Look) -> Marker<'a> {
    shifted(look, 0)
}

/// The marker of a curve, shifted to the right of the origin.
fn shifted<'a>(look: Look, x: i32) -> Marker<'a> {
    let thin = look.color.stroke_width(2);
    let style = if look.open { thin } else { look.color.filled() };
    let polygon = |corners: &[(i32, i32)]| -> Marker<'a> {
        let corners: Vec<(i32, i32)> = corners.iter().map(|(dx, dy)| (x + dx, *dy)).collect();
        match look.open {
            false => Polygon::new(corners, style).into_dyn(),
            true => {
                let closed = [corners.clone(), vec![corners[0]]].concat();
                PathElement::new(closed, thin).into_dyn()
            }
        }
    };
    let strokes = |paths: &[(i32, i32)]| -> Marker<'a> {
        let corners: Vec<(i32, i32)> = paths.iter().map(|(dx, dy)| (x + dx, *dy)).collect();
        PathElement::new(corners, look.color.stroke_width(2)).into_dyn()
    };
    match look.marker {
        0 => Circle::new((x, 0), 5, style).into_dyn(),
        1 => polygon(&[(0, -6), (6, 5), (-6, 5)]),
        2 => polygon(&[(-5, -5), (5, -5), (5, 5), (-5, 5)]),
        3 => polygon(&[(0, -7), (6, 0), (0, 7), (-6, 0)]),
        4 => polygon(&[(0, 6), (6, -5), (-6, -5)]),
        5 => polygon(&[(0, -8), (2, -2), (8, 0), (2, 2), (0, 8), (-2, 2), (-8, 0), (-2, -2)]),
        6 => strokes(&[(-6, 0), (6, 0), (0, 0), (0, -6), (0, 6)]),
        7 => polygon(&[(-6, -3), (0, -7), (6, -3), (4, 5), (-4, 5)]),
        8 => polygon(&[(-6, -6), (6, 6), (6, -6), (-6, 6)]),
        _ => strokes(&[(0, -6), (0, 6), (0, 0), (-6, -4), (6, 4), (0, 0), (-6, 4), (6, -4)]),
    }
}
