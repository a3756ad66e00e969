//! Diagrams of a run: energies and momenta over time, of one or several integrators (`--plot FILE.svg`).
//!
//! Curves have at most [`POINTS`] points. A run that fails ends its curves; a run whose energy leaves the others' far
//! behind is cut at the frame, and the legend says so.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use simulator::output::OutputFile;
use simulator::scene::Scene;
use simulator::simulation::{Simulation, SimulationOptions};

use crate::{Failure, print_message};

/// Maximum number of points of a curve, not counting the last.
const POINTS: u64 = 1_000;

/// Values beyond this multiple of the smallest run's largest value are cut off.
const BEYOND: f64 = 10.0;

/// Colours of integrators.
const COLORS: [&str; 6] = ["#0a5aa0", "#b34700", "#00735a", "#7b2d8e", "#9c1c4e", "#1b1f24"];

/// Dashes of the curves of one integrator.
const DASHES: [&str; 3] = ["", "7 4", "2 3"];

/// Width of the diagram, and the frame of a panel: left, right, height. In pixels.
const WIDTH: f64 = 800.0;
const LEFT: f64 = 90.0;
const RIGHT: f64 = 780.0;
const HEIGHT: f64 = 260.0;

/// Space between the panels, for titles and labels.
const SPACE: f64 = 80.0;

/// Height of a line of the legend.
const LINE: f64 = 20.0;

/// The recorded energies and momenta of a run.
struct Record {
    integrator: &'static str,
    times: Vec<f64>,
    /// Total, kinetic, potential.
    energies: [Vec<f64>; 3],
    /// One column an axis.
    momenta: Vec<Vec<f64>>,
    /// The time at which the run failed.
    failed: Option<f64>,
}

/// A diagram of one kind of quantity.
struct Panel<'a> {
    title: &'static str,
    names: &'static [&'static str],
    /// The curves of a record.
    of: fn(&Record) -> &[Vec<f64>],
    records: &'a [Record],
}

/// Runs the scenes, which differ in their integrators, and writes the diagram.
pub(super) fn write(
    path: &Path,
    scenes: &[Scene],
    config: SimulationOptions,
) -> Result<(), Failure> {
    let file = OutputFile::create(path).map_err(|error| Failure::cannot_create(path, &error));
    let mut file = file?;
    let records: Vec<Record> = scenes.iter().map(|scene| record(scene, config)).collect();
    let written = file.write_all(svg(&scenes[0].name, &records).as_bytes());
    written.and_then(|()| file.commit()).map_err(|error| Failure::at(path, error))
}

fn record(scene: &Scene, config: SimulationOptions) -> Record {
    let mut simulation = Simulation::with_options(scene, config);
    let mut record = Record {
        integrator: scene.integrator.name,
        times: Vec::new(),
        energies: Default::default(),
        momenta: vec![Vec::new(); scene.dimension.count()],
        failed: None,
    };
    let stride = simulation.n_steps().div_ceil(POINTS).max(1);
    loop {
        let state = simulation.state();
        let is_last = state.step == simulation.n_steps();
        if state.step.is_multiple_of(stride) || is_last {
            match simulation.energies() {
                Ok(energies) => {
                    let total = energies.kinetic + energies.potential;
                    record.times.push(state.time);
                    let values = [total, energies.kinetic, energies.potential];
                    record.energies.iter_mut().zip(values).for_each(|(all, one)| all.push(one));
                    let momentum = energies.momentum;
                    record.momenta.iter_mut().zip(momentum).for_each(|(all, one)| all.push(one));
                }
                Err(error) => {
                    print_message("note", error);
                    record.failed = Some(state.time);
                    return record;
                }
            }
        }
        let time = state.time;
        match simulation.advance() {
            Ok(true) => {}
            Ok(false) => return record,
            Err(error) => {
                print_message("note", error);
                record.failed = Some(time);
                return record;
            }
        }
    }
}

fn svg(scene: &str, records: &[Record]) -> String {
    let panels = [
        Panel {
            title: "Energy",
            names: &["total", "kinetic", "potential"],
            of: |record| &record.energies,
            records,
        },
        Panel { title: "Momentum", names: &["x", "y", "z"], of: |record| &record.momenta, records },
    ];
    let top = 50.0 + LINE * records.len() as f64;
    let height = top + 2.0 * (HEIGHT + SPACE);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" viewBox=\"0 0 {WIDTH} {height}\" \
         font-family=\"sans-serif\" font-size=\"13\" fill=\"#1b1f24\">\n\
         <title>Energy and momentum of {0}</title>\n<rect width=\"{WIDTH}\" height=\"{height}\" fill=\"#fff\"/>\n\
         <text x=\"{LEFT}\" y=\"28\" font-size=\"16\" font-weight=\"bold\">{0}</text>\n",
        escaped(scene)
    );
    for (number, record) in records.iter().enumerate() {
        let y = 50.0 + LINE * number as f64;
        let color = COLORS[number % COLORS.len()];
        let mut words = record.integrator.to_owned();
        if let Some(time) = record.failed {
            let _ = write!(words, ", fails at t = {} s", short(time));
        } else if panels.iter().any(|panel| panel.is_cut(record)) {
            words += ", leaves the diagram";
        }
        let _ = writeln!(
            svg,
            "<path d=\"M{LEFT} {0}h28\" stroke=\"{color}\" stroke-width=\"3\"/><text x=\"{1}\" y=\"{y}\">{words}</text>",
            y - 4.5,
            LEFT + 36.0
        );
    }
    for (number, panel) in panels.iter().enumerate() {
        panel.draw(&mut svg, top + number as f64 * (HEIGHT + SPACE) + 30.0);
    }
    svg + "</svg>\n"
}

impl Panel<'_> {
    fn values<'a>(&self, record: &'a Record) -> impl Iterator<Item = f64> + use<'a> {
        (self.of)(record).iter().flatten().copied()
    }

    fn largest(&self, record: &Record) -> f64 {
        self.values(record).fold(0.0, |largest, value| largest.max(value.abs()))
    }

    /// The largest magnitude that is shown.
    fn limit(&self) -> f64 {
        let largest = self.records.iter().map(|record| self.largest(record));
        let least = largest.filter(|largest| *largest > 0.0).fold(f64::INFINITY, f64::min);
        BEYOND * least
    }

    fn is_cut(&self, record: &Record) -> bool {
        self.largest(record) > self.limit()
    }

    /// The range of the values, with some space.
    fn range(&self) -> [f64; 2] {
        let limit = self.limit();
        let all = || {
            let records = self.records.iter();
            records.flat_map(|record| self.values(record)).map(|value| value.clamp(-limit, limit))
        };
        let low = all().fold(f64::INFINITY, f64::min).min(0.0);
        let high = all().fold(f64::NEG_INFINITY, f64::max).max(0.0);
        let size = high - low;
        if size > 0.0 { [low - 0.05 * size, high + 0.05 * size] } else { [-1.0, 1.0] }
    }

    fn draw(&self, svg: &mut String, top: f64) {
        let bottom = top + HEIGHT;
        let longest = self.records.iter().filter_map(|record| record.times.last());
        let end = longest.copied().fold(0.0, f64::max);
        let end = if end > 0.0 { end } else { 1.0 };
        let [low, high] = self.range();
        let x = |time: f64| LEFT + (RIGHT - LEFT) * time / end;
        let y = |value: f64| bottom - HEIGHT * (value - low) / (high - low);
        let id = self.title;
        let _ = writeln!(
            svg,
            "<clipPath id=\"{id}\"><rect x=\"{LEFT}\" y=\"{top}\" width=\"{}\" height=\"{HEIGHT}\"/></clipPath>",
            RIGHT - LEFT
        );
        for value in ticks(low, high) {
            let at = y(value);
            let _ = writeln!(
                svg,
                "<path d=\"M{LEFT} {at:.2}H{RIGHT}\" stroke=\"#e6e9ed\"/>\
                 <text x=\"{0}\" y=\"{1:.2}\" text-anchor=\"end\">{2}</text>",
                LEFT - 8.0,
                at + 4.5,
                short(value)
            );
        }
        for time in ticks(0.0, end) {
            let at = x(time);
            let _ = writeln!(
                svg,
                "<path d=\"M{at:.2} {top}V{bottom}\" stroke=\"#e6e9ed\"/>\
                 <text x=\"{at:.2}\" y=\"{0}\" text-anchor=\"middle\">{1}</text>",
                bottom + 18.0,
                short(time)
            );
        }
        let _ = writeln!(
            svg,
            "<rect x=\"{LEFT}\" y=\"{top}\" width=\"{}\" height=\"{HEIGHT}\" fill=\"none\" stroke=\"#57606a\"/>\
             <text x=\"{LEFT}\" y=\"{}\" font-weight=\"bold\">{}</text>\
             <text x=\"{RIGHT}\" y=\"{}\" text-anchor=\"end\">time (s)</text>",
            RIGHT - LEFT,
            top - 10.0,
            self.title,
            bottom + 34.0
        );
        let n_curves = self.records.first().map_or(0, |record| (self.of)(record).len());
        for (number, name) in self.names.iter().take(n_curves).enumerate() {
            let at = RIGHT - 110.0 * (n_curves - number) as f64;
            let _ = writeln!(
                svg,
                "<path d=\"M{at} {}h28\" stroke=\"#1b1f24\" stroke-width=\"2\" stroke-dasharray=\"{}\"/>\
                 <text x=\"{}\" y=\"{}\">{name}</text>",
                top - 14.5,
                DASHES[number],
                at + 34.0,
                top - 10.0
            );
        }
        for (number, record) in self.records.iter().enumerate() {
            for (curve, dash) in (self.of)(record).iter().zip(DASHES) {
                // A rasteriser's numbers end somewhere: far points are drawn just outside the frame.
                let points = record.times.iter().zip(curve).map(|(time, value)| {
                    format!("{:.2},{:.2}", x(*time), y(*value).clamp(top - 500.0, bottom + 500.0))
                });
                let _ = writeln!(
                    svg,
                    "<polyline clip-path=\"url(#{id})\" points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.75\" \
                     stroke-dasharray=\"{dash}\"/>",
                    points.collect::<Vec<_>>().join(" "),
                    COLORS[number % COLORS.len()]
                );
            }
        }
    }
}

/// Round numbers in a range: 1, 2 or 5 times a power of ten apart.
fn ticks(low: f64, high: f64) -> Vec<f64> {
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
fn short(value: f64) -> String {
    let rounded: f64 = format!("{value:.4e}").parse().unwrap_or(value);
    match rounded.abs() {
        0.0 => "0".to_owned(),
        1e-3..1e6 => format!("{rounded}"),
        _ => format!("{rounded:e}"),
    }
}

/// Text in XML. Control characters, which XML cannot hold, are replaced.
fn escaped(text: &str) -> String {
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
