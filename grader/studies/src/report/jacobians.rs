//! Plot of a force's Jacobian test, as SVG: errors by step size, on logarithmic axes.
//!
//! Curves differ by marker, dashes and colour. Two thin lines show the slopes 1 and 2.

use plotters::prelude::*;

use crate::report::picture::{self, Area, Drawn, PictureError};
use grader::white_box::{Curves, Window};

const SIZE: (u32, u32) = (880, 600);

/// Smaller errors are not drawn: they are below rounding error by chance.
const LOWEST: f64 = 1e-17;

/// Space for the legend above the curves, as a factor.
const ROOM: f64 = 1e4;

const BLUE: RGBColor = RGBColor(0, 90, 160);
const ORANGE: RGBColor = RGBColor(190, 80, 0);
const GREEN: RGBColor = RGBColor(0, 120, 80);
const GREY: RGBColor = RGBColor(110, 110, 110);

/// The plot as an SVG document, with a newline at its end.
///
/// # Errors
/// If the curves contain no point that can be drawn.
pub fn render(curves: &Curves) -> Result<String, PictureError> {
    picture::svg(SIZE, |area| draw(area, curves))
}

fn draw(area: &Area<'_>, curves: &Curves) -> Drawn {
    area.fill(&WHITE)?;
    let (Some(&high), Some(&low)) = (curves.steps.first(), curves.steps.last()) else {
        return Err("the plot has no steps".into());
    };
    let all = [&curves.central, &curves.with_jacobian, &curves.without_jacobian];
    let top = all.into_iter().flatten().copied().fold(LOWEST, f64::max) * ROOM;
    let mut chart = ChartBuilder::on(area)
        .caption(&curves.title, ("sans-serif", 20))
        .margin(14)
        .x_label_area_size(48)
        .y_label_area_size(76)
        .build_cartesian_2d(low.log10()..(2.0 * high).log10(), LOWEST.log10()..top.log10())?;
    chart
        .configure_mesh()
        .x_label_formatter(&power_of_ten)
        .y_label_formatter(&power_of_ten)
        .x_desc("step t along p (no unit; p has components of ±1 m and ±1 m/s)")
        .y_desc("error / |J p| (no unit)")
        .label_style(("sans-serif", 14))
        .axis_desc_style(("sans-serif", 16))
        .light_line_style(TRANSPARENT)
        .bold_line_style(GREY.mix(0.25))
        .draw()?;

    let points = |values: &[f64]| -> Vec<(f64, f64)> {
        let pairs = curves.steps.iter().zip(values);
        let drawn = pairs.filter(|(_, value)| **value > LOWEST);
        drawn.map(|(step, value)| (step.log10(), value.log10())).collect()
    };
    // The lines of slope 1 and 2, below the curves.
    for (slope, values) in [(2.0, &curves.with_jacobian), (1.0, &curves.without_jacobian)] {
        let Some(start) = points(values).first().copied() else { continue };
        let below = (start.0, start.1 - 0.5);
        let reach = ((below.1 - LOWEST.log10()) / slope).min(start.0 - low.log10());
        let end = (below.0 - reach, below.1 - slope * reach);
        chart.draw_series(DashedLineSeries::new([below, end], 3, 5, GREY.stroke_width(1)))?;
        let middle = (0.5 * (below.0 + end.0), 0.5 * (below.1 + end.1) - 0.4);
        let text = format!("slope {slope}");
        chart.draw_series([Text::new(
            text,
            middle,
            ("sans-serif", 14).into_font().color(&GREY),
        )])?;
    }

    let without = points(&curves.without_jacobian);
    let name = format!("Taylor remainder, J p left out{}", fitted(curves.windows[1]));
    chart
        .draw_series(DashedLineSeries::new(without.clone(), 9, 5, ORANGE.stroke_width(2)))?
        .label(name)
        .legend(|at| {
            EmptyElement::at(at)
                + PathElement::new([(0, 0), (8, 0)], ORANGE.stroke_width(2))
                + PathElement::new([(14, 0), (22, 0)], ORANGE.stroke_width(2))
                + TriangleMarker::new((11, 0), 4, ORANGE.filled())
        });
    chart
        .draw_series(without.iter().map(|point| TriangleMarker::new(*point, 4, ORANGE.filled())))?;

    let with = points(&curves.with_jacobian);
    let name = format!("Taylor remainder, with J p{}", fitted(curves.windows[0]));
    chart.draw_series(LineSeries::new(with.clone(), BLUE.stroke_width(2)))?.label(name).legend(
        |at| {
            EmptyElement::at(at)
                + PathElement::new([(0, 0), (22, 0)], BLUE.stroke_width(2))
                + Circle::new((11, 0), 4, BLUE.filled())
        },
    );
    chart.draw_series(with.iter().map(|point| Circle::new(*point, 4, BLUE.filled())))?;

    let central = points(&curves.central);
    chart
        .draw_series(DashedLineSeries::new(central.clone(), 2, 4, GREEN.stroke_width(2)))?
        .label("central difference against J p")
        .legend(|(x, y)| Cross::new((x + 11, y), 5, GREEN.stroke_width(2)));
    chart.draw_series(central.iter().map(|point| Cross::new(*point, 4, GREEN.stroke_width(2))))?;

    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .background_style(WHITE.mix(0.9))
        .border_style(GREY)
        .label_font(("sans-serif", 15))
        .draw()?;
    Ok(())
}

/// Label of a tick; axes are in decimal logarithms.
fn power_of_ten(exponent: &f64) -> String {
    format!("1e{exponent:.0}")
}

/// The fitted slope, if any.
fn fitted(window: Option<Window>) -> String {
    match window {
        Some(Window { slope, steps: (low, high), .. }) => {
            format!(": slope {slope:.2} from {low:.0e} to {high:.0e}")
        }
        None => ": rounding alone".to_owned(),
    }
}
