//! Line charts of pages without playback: drawn by the page's scripts, with a readout at the pointer and a table.

use serde::Serialize;

use crate::look::{DASHES, Look};

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
    /// Lengths of dashes and gaps; `None` for a solid line.
    dash: Option<String>,
    marker: usize,
    /// Whether markers are open.
    open: bool,
}

impl Series {
    /// The curve with look number `style` through these points; values that are not finite are gaps.
    pub fn new(
        name: impl Into<String>,
        style: usize,
        points: impl IntoIterator<Item = (f64, f64)>,
    ) -> Self {
        let (xs, ys) =
            points.into_iter().map(|(x, y)| (x, Some(y).filter(|y| y.is_finite()))).unzip();
        let Look { color, dashes, marker } = Look::of(style);
        let dashes: Vec<String> = DASHES[dashes].iter().map(u32::to_string).collect();
        Self {
            name: name.into(),
            xs,
            ys,
            // The style sheet counts from 1.
            color: format!("c{}", color + 1),
            dash: Some(dashes.join(" ")).filter(|dashes| !dashes.is_empty()),
            marker,
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
