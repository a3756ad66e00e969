//! Diagrams as SVG: frames with axes and curves.

use std::fmt::Write as _;

/// Colours of curves.
pub(super) const COLORS: [&str; 6] =
    ["#0a5aa0", "#b34700", "#00735a", "#7b2d8e", "#9c1c4e", "#1b1f24"];

/// Width of the diagram, and the frame of a panel: left, right, height. In pixels.
pub(super) const WIDTH: f64 = 800.0;
pub(super) const LEFT: f64 = 90.0;
pub(super) const RIGHT: f64 = 780.0;
pub(super) const HEIGHT: f64 = 260.0;

/// Space between the panels, for titles and labels.
pub(super) const SPACE: f64 = 80.0;

/// Height of a line of the legend.
pub(super) const LINE: f64 = 20.0;

/// The start of a diagram of this height, with its title. It ends with `</svg>`.
pub(super) fn start(title: &str, heading: &str, height: f64) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" viewBox=\"0 0 {WIDTH} {height}\" \
         font-family=\"sans-serif\" font-size=\"13\" fill=\"#1b1f24\">\n\
         <title>{0}</title>\n<rect width=\"{WIDTH}\" height=\"{height}\" fill=\"#fff\"/>\n\
         <text x=\"{LEFT}\" y=\"28\" font-size=\"16\" font-weight=\"bold\">{1}</text>\n",
        escaped(title),
        escaped(heading)
    )
}

/// Line `number` of the legend, of the curve with that number.
pub(super) fn legend_line(svg: &mut String, number: usize, words: &str) {
    let y = 50.0 + LINE * number as f64;
    let color = COLORS[number % COLORS.len()];
    let _ = writeln!(
        svg,
        "<path d=\"M{LEFT} {0}h28\" stroke=\"{color}\" stroke-width=\"3\"/><text x=\"{1}\" y=\"{y}\">{2}</text>",
        y - 4.5,
        LEFT + 36.0,
        escaped(words)
    );
}

/// A panel with axes, as wide as the diagram.
pub(super) struct Panel<'a> {
    pub(super) title: &'a str,
    /// Of the horizontal axis.
    pub(super) label: &'a str,
    pub(super) top: f64,
    /// The range of each axis.
    pub(super) x: [f64; 2],
    pub(super) y: [f64; 2],
    /// Whether `y` holds exponents of ten.
    pub(super) logarithmic: bool,
}

impl Panel<'_> {
    /// Where a point is. A rasteriser's numbers end somewhere: far points are just outside the frame.
    pub(super) fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let part = |value: f64, [low, high]: [f64; 2]| (value - low) / (high - low);
        let bottom = self.top + HEIGHT;
        let y = bottom - HEIGHT * part(y, self.y);
        [LEFT + (RIGHT - LEFT) * part(x, self.x), y.clamp(self.top - 500.0, bottom + 500.0)]
    }

    /// Draws the axes.
    pub(super) fn draw(&self, svg: &mut String) {
        let Self { title, label, top, x: [left, right], y: [low, high], logarithmic } = *self;
        let bottom = top + HEIGHT;
        let width = RIGHT - LEFT;
        let _ = writeln!(
            svg,
            "<clipPath id=\"panel{top}\"><rect x=\"{LEFT}\" y=\"{top}\" width=\"{width}\" height=\"{HEIGHT}\"/></clipPath>"
        );
        for value in ticks(low, high) {
            let [_, y] = self.at([left, value]);
            let text = if logarithmic { short(10.0_f64.powf(value)) } else { short(value) };
            let _ = writeln!(
                svg,
                "<path d=\"M{LEFT} {y:.2}H{RIGHT}\" stroke=\"#e6e9ed\"/>\
                 <text x=\"{0}\" y=\"{1:.2}\" text-anchor=\"end\">{text}</text>",
                LEFT - 8.0,
                y + 4.5
            );
        }
        for value in ticks(left, right) {
            let [x, _] = self.at([value, low]);
            let _ = writeln!(
                svg,
                "<path d=\"M{x:.2} {top}V{bottom}\" stroke=\"#e6e9ed\"/>\
                 <text x=\"{x:.2}\" y=\"{0}\" text-anchor=\"middle\">{1}</text>",
                bottom + 18.0,
                short(value)
            );
        }
        let _ = writeln!(
            svg,
            "<rect x=\"{LEFT}\" y=\"{top}\" width=\"{width}\" height=\"{HEIGHT}\" fill=\"none\" stroke=\"#57606a\"/>\
             <text x=\"{LEFT}\" y=\"{}\" font-weight=\"bold\">{title}</text>\
             <text x=\"{RIGHT}\" y=\"{}\" text-anchor=\"end\">{label}</text>",
            top - 10.0,
            bottom + 34.0
        );
    }

    /// Draws the curve with this number through the points.
    pub(super) fn curve(
        &self,
        svg: &mut String,
        number: usize,
        dash: &str,
        points: impl Iterator<Item = [f64; 2]>,
    ) {
        let points = points.map(|point| self.at(point)).map(|[x, y]| format!("{x:.2},{y:.2}"));
        let _ = writeln!(
            svg,
            "<polyline clip-path=\"url(#panel{})\" points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.75\" \
             stroke-dasharray=\"{dash}\"/>",
            self.top,
            points.collect::<Vec<_>>().join(" "),
            COLORS[number % COLORS.len()]
        );
    }
}

/// Round numbers in a range: 1, 2 or 5 times a power of ten apart.
pub(super) fn ticks(low: f64, high: f64) -> Vec<f64> {
    let rough = (high - low) / 6.0;
    let power = 10.0_f64.powf(rough.log10().floor());
    let factors = [1.0, 2.0, 5.0, 10.0];
    let step = factors.map(|factor| factor * power).into_iter().find(|step| *step >= rough);
    let step = step.unwrap_or(rough);
    let first = (low / step).ceil() as i64;
    let last = (high / step).floor() as i64;
    (first..=last).map(|number| number as f64 * step).collect()
}

/// A number of a tick, without the rounding of its multiplication.
pub(super) fn short(value: f64) -> String {
    let rounded: f64 = format!("{value:.4e}").parse().unwrap_or(value);
    match rounded.abs() {
        0.0 => "0".to_owned(),
        1e-3..1e6 => format!("{rounded}"),
        _ => format!("{rounded:e}"),
    }
}

/// Text in XML. Control characters, which XML cannot hold, are replaced.
pub(super) fn escaped(text: &str) -> String {
    let mut escaped = String::new();
    for character in text.chars() {
        match character {
            '&' => escaped += "&amp;",
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            control if control.is_control() => escaped.push(char::REPLACEMENT_CHARACTER),
            other => escaped.push(other),
        }
    }
    escaped
}
