//! Line charts of pages without playback: drawn by the page's scripts, with a readout at the pointer and a table.

use serde::Serialize;

use super::page::Html;

/// A chart.
#[derive(Debug, Clone, Default, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Chart {
    /// Its title.
    pub title: String,
    /// Name and unit of the horizontal axis.
    pub x_label: String,
    /// Name and unit of the vertical axis.
    pub y_label: String,
    /// Whether the horizontal axis is logarithmic.
    pub x_log: bool,
    /// Whether the vertical axis is logarithmic.
    pub y_log: bool,
    /// Height in pixels.
    pub height: u32,
    /// The curves.
    pub series: Vec<Series>,
}

/// A curve. Curves differ by colour, marker and dashes.
#[derive(Debug, Clone, Serialize)]
pub struct Series {
    /// Its name.
    name: String,
    xs: Vec<f64>,
    /// `None` is a gap.
    ys: Vec<Option<f64>>,
    color: String,
    dash: Option<&'static str>,
    marker: usize,
    /// Whether markers are open.
    open: bool,
}

/// Number of colours of the style sheet.
const COLORS: usize = 10;

/// Lengths of dashes and gaps.
const DASHES: [Option<&str>; 4] = [None, Some("8 4"), Some("2 3"), Some("12 3 2 3")];

impl Series {
    /// The curve number `style` through these points; values that are not finite are gaps.
    pub fn new(
        name: impl Into<String>,
        style: usize,
        points: impl IntoIterator<Item = (f64, f64)>,
    ) -> Self {
        let (xs, ys) =
            points.into_iter().map(|(x, y)| (x, Some(y).filter(|y| y.is_finite()))).unzip();
        Self {
            name: name.into(),
            xs,
            ys,
            color: format!("c{}", style % COLORS + 1),
            dash: DASHES[style % DASHES.len()],
            marker: style,
            open: false,
        }
    }

    /// The same with open markers.
    pub fn open(self) -> Self {
        Self { open: true, ..self }
    }
}

impl Chart {
    /// Adds the chart to a page, where `id` is unique.
    ///
    /// # Errors
    /// Never in practice: every value has a JSON form.
    pub fn write(&self, html: &mut Html, id: &str) -> serde_json::Result<()> {
        html.data(id, &serde_json::to_string(self)?);
        html.open("div", &[("data-chart", id)]).markup("<noscript><p>");
        html.text(&self.title).markup(": the diagram needs JavaScript.</p></noscript>");
        html.close("div");
        Ok(())
    }
}
