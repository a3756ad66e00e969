//! Work-precision diagrams as a page: error against computing time, and error against the time step, of each scene.

use std::io;

use report::html::chart::{Chart, Series};
use report::html::page::{Html, Page};
use report::html::{self, Sink};

use super::{style, text};
use crate::accuracy::{Curve, Point, RunOutcome, SceneStudy, Study};

/// Writes the page, with its scripts and styles.
///
/// # Errors
/// If `sink` fails.
pub fn write(study: &Study, sink: Sink<'_>) -> io::Result<()> {
    let mut page = Html::default();
    page.markup("<h1>Error against computing time</h1>");
    page.markup(
        "<p>Each point of a curve halves the time step of the one before. Lower and further left is better. Runs that \
         blew up or failed have no point; the report below lists them.</p>",
    );
    for (number, scene) in study.scenes.iter().enumerate() {
        write_scene(&mut page, scene, number)?;
    }
    page.markup("<section><h2>The whole report</h2><details><summary>As text</summary>");
    page.report(|out| text::write(out, study, text::AccuracyTextOptions { details: true }))?;
    page.markup("</details></section>");
    let page = Page { title: "Accuracy", depth: 0, above: &[] }.render(&page);
    html::single(&page, sink)
}

fn write_scene(page: &mut Html, scene: &SceneStudy, number: usize) -> io::Result<()> {
    let floor = scene.reference.floor.position;
    page.markup("<section><h2>").text(&scene.target.name).markup("</h2>");
    page.element("p", &[], &scene.target.title);
    page.markup("<p class=\"hint\">").text(&format!(
        "The reference is known to {floor:.0e} m; smaller errors are shown as that."
    ));
    page.markup("</p><div class=\"charts\">");
    let error = |point: &Point| match &point.outcome {
        RunOutcome::Finished { largest, .. } => largest.position.max(floor),
        RunOutcome::BlownUp { .. } | RunOutcome::Failed { .. } => f64::NAN,
    };
    let series = |x: fn(&Point) -> f64| {
        let of = |(number, curve): (usize, &Curve)| {
            let points = curve.points.iter().map(|point| (x(point), error(point)));
            let points = points.filter(|(x, _)| x.is_finite());
            let series = Series::new(curve.label(), style(number, scene), points);
            if curve.foreign { series.open() } else { series }
        };
        scene.curves.iter().enumerate().map(of).collect()
    };
    let chart = |what: &str, x_label: &str, series| Chart {
        title: format!("{}: error against {what}", scene.target.name),
        x_label: format!("{x_label}, logarithmic"),
        y_label: "largest position error (m)".to_owned(),
        x_log: true,
        y_log: true,
        height: 380,
        series,
    };
    let time = |point: &Point| point.cost.time.map_or(f64::NAN, |time| time.least);
    chart("time", "time of a run (s)", series(time)).write(page, &format!("time-{number}"))?;
    let step = |point: &Point| point.time_step;
    chart("the time step", "h (s)", series(step)).write(page, &format!("step-{number}"))?;
    page.markup("</div></section>\n");
    Ok(())
}
