//! Pictures of a wrong scene: the residuals over time, and the particles at the first wrong step.

use std::io;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use grader::compare::recording::{ExactState, Recording};
use grader::grading::SceneResult;
use picture::canvas::Paint;
use picture::drawing::{Drawing, Shape};
use serde::Serialize;

const SIZE: [u32; 2] = [480, 240];
const MARGIN: f32 = 16.0;
const GREEN: Paint = Paint { rgb: [20, 130, 70], opacity: 1.0 };
const RED: Paint = Paint { rgb: [200, 40, 40], opacity: 1.0 };
const GREY: Paint = Paint { rgb: [150, 150, 150], opacity: 1.0 };

/// A picture.
#[derive(Clone, Serialize)]
pub(super) struct Image {
    label: String,
    /// Its data, as a URL.
    url: String,
}

/// The pictures of a scene with a wrong number; `None` if it has none, or was not recorded.
pub(super) fn of_scene(scene: &SceneResult) -> Option<io::Result<Vec<Image>>> {
    let (first, recording) = (scene.comparison.first_wrong.as_ref()?, scene.recording.as_ref()?);
    let step = first.place.step;
    let mut images = vec![residuals(&scene.id, recording)];
    let exact = recording.exact.iter().find(|state| state.step == step);
    images.extend(exact.map(|state| particles(&scene.id, recording.dimension, state)));
    Some(images.into_iter().collect())
}

/// Decimal logarithms of the position residuals (red) and of their tolerances (grey), over the steps.
fn residuals(name: &str, recording: &Recording) -> io::Result<Image> {
    // Below it, a residual is a rounding error.
    const LOWEST: f64 = 1e-18;
    let points = recording.residuals.iter().map(|residuals| residuals.position);
    let logarithm = |value: f64| value.max(LOWEST).log10();
    let values: Vec<(u64, f64)> = points.clone().map(|it| (it.step, logarithm(it.value))).collect();
    let bounds: Vec<(u64, f64)> = points
        .filter_map(|it| it.bound.map(|bound| (it.step, logarithm(bound.tolerance))))
        .collect();
    let finite = || values.iter().chain(&bounds).map(|(_, y)| *y).filter(|y| y.is_finite());
    let low = finite().fold(f64::INFINITY, f64::min);
    let high = finite().fold(f64::NEG_INFINITY, f64::max).max(low + 1.0);
    let last = recording.n_states.max(2) as f64 - 1.0;
    let [width, height] = SIZE.map(|size| size as f32 - 2.0 * MARGIN);
    let place = |(step, y): &(u64, f64)| {
        let y = y.clamp(low, high);
        let (right, up) = ((*step as f64 / last) as f32, ((y - low) / (high - low)) as f32);
        [MARGIN + right * width, MARGIN + (1.0 - up) * height]
    };
    let curve = |points: &[(u64, f64)], paint: Paint| {
        let pairs = points.windows(2).map(|ends| [place(&ends[0]), place(&ends[1])]);
        pairs.map(|ends| Shape::Line { ends, width: 1.5, paint }).collect::<Vec<_>>()
    };
    let shapes = [curve(&bounds, GREY), curve(&values, RED)].concat();
    let label = format!(
        "{name}: position residual over the steps (red) and its tolerance (grey), from 1e{low:.0} m to 1e{high:.0} m"
    );
    image(label, shapes)
}

/// The particles of the oracle (green) and of the submission (red) in one state, with lines between the two.
fn particles(name: &str, dimension: usize, state: &ExactState) -> io::Result<Image> {
    // A particle's position, then its velocity.
    let plane = |numbers: &[f64]| -> Vec<[f64; 2]> {
        numbers.chunks_exact(2 * dimension).map(|it| [it[0], it[1]]).collect()
    };
    let (expected, got) = (plane(&state.expected), plane(&state.got));
    let all = || expected.iter().chain(&got).filter(|at| at.iter().all(|value| value.is_finite()));
    let side = |axis: usize| {
        let values = || all().map(|at| at[axis]);
        let low = values().fold(f64::INFINITY, f64::min);
        (low, values().fold(f64::NEG_INFINITY, f64::max) - low)
    };
    let ((left, across), (bottom, up)) = (side(0), side(1));
    let [width, height] = SIZE.map(|size| f64::from(size) - 2.0 * f64::from(MARGIN));
    let scale = (width / across).min(height / up);
    let scale = if scale.is_finite() { scale } else { 1.0 };
    let place = |at: &[f64; 2]| {
        let (x, y) = ((at[0] - left) * scale, (at[1] - bottom) * scale);
        [MARGIN + x as f32, SIZE[1] as f32 - MARGIN - y as f32]
    };
    let mut shapes = Vec::new();
    for (expected, got) in expected.iter().zip(&got) {
        let ends = [place(expected), place(got)];
        shapes.push(Shape::Line { ends, width: 1.0, paint: GREY });
        shapes.push(Shape::Disc { at: ends[0], radius: 5.0, paint: GREEN });
        shapes.push(Shape::Disc { at: ends[1], radius: 3.0, paint: RED });
    }
    let step = state.step;
    image(
        format!("{name}: particles at the first wrong step, {step}: expected (green), yours (red)"),
        shapes,
    )
}

fn image(label: String, shapes: Vec<Shape>) -> io::Result<Image> {
    let png = Drawing { size: SIZE, background: [255, 255, 255], shapes }.canvas().png()?;
    Ok(Image { label, url: format!("data:image/png;base64,{}", STANDARD.encode(png)) })
}
