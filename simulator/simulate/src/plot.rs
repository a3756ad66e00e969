//! Diagrams of a run: the paths of particles, and energies and momenta over time, of one or several integrators
//! (`--plot FILE.svg`).
//!
//! Curves over time have at most [`POINTS`] points. A run that fails ends its curves; a run whose energy leaves the others'
//! far behind is cut at the frame, and the legend says so.
//!
//! The paths of each integrator have a separate frame, side by side. All frames show the same part of the x–y plane at
//! the same scale, so that orbits can be compared: they hold the smallest motion, and as much of the others as fits into
//! [`PATH_BEYOND`] times its size.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use scene::Scene;
use scene::output::OutputFile;
use simulator::simulation::{Simulation, SimulationOptions};

use crate::svg::{self, COLORS, HEIGHT, LEFT, LINE, RIGHT, SPACE, short, ticks};
use crate::{Failure, print_message};

/// Maximum number of points of a curve, not counting the last.
const POINTS: u64 = 1_000;

/// Values beyond this multiple of the smallest run's largest value are cut off.
const BEYOND: f64 = 10.0;

/// Maximum number of paths of an integrator, and of the points that are looked at for all of them.
const PATHS: usize = 24;
const PATH_POINTS: u64 = 40_000;

/// The frames of paths show at most this multiple of the smallest motion.
const PATH_BEYOND: f64 = 3.0;

/// Points of a path that are nearer to each other are one point, in pixels.
const PATH_STEP: f64 = 0.4;

/// Frames of paths side by side, and the space between them in pixels.
const PATH_COLUMNS: usize = 3;
const PATH_SPACE: f64 = 36.0;

/// Dashes of the curves of one integrator.
const DASHES: [&str; 3] = ["", "7 4", "2 3"];

/// The recorded energies and momenta of a run.
struct Record {
    integrator: &'static str,
    times: Vec<f64>,
    /// Total, kinetic, potential.
    energies: [Vec<f64>; 3],
    /// One column an axis.
    momenta: Vec<Vec<f64>>,
    /// x and y of each particle that is shown.
    paths: Vec<Vec<[f64; 2]>>,
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
    let written = file.write_all(svg(&scenes[0], &records).as_bytes());
    written.and_then(|()| file.commit()).map_err(|error| Failure::at(path, error))
}

/// The particles whose paths are shown: all that move, or as many of them as there are [`PATHS`], evenly chosen.
fn shown_particles(scene: &Scene) -> Vec<usize> {
    let moves = |number: &usize| {
        let particle = &scene.particles[*number];
        !particle.fixed || particle.velocity != [0.0; 3]
    };
    let moving: Vec<usize> = (0..scene.particles.len()).filter(moves).collect();
    let n_shown = moving.len().min(PATHS);
    (0..n_shown).map(|number| moving[number * moving.len() / n_shown]).collect()
}

fn record(scene: &Scene, config: SimulationOptions) -> Record {
    let mut simulation = Simulation::with_options(scene, config);
    let shown = shown_particles(scene);
    let dimension = scene.dimension.count();
    let mut record = Record {
        integrator: scene.integrator.name,
        times: Vec::new(),
        energies: Default::default(),
        momenta: vec![Vec::new(); dimension],
        paths: vec![Vec::new(); shown.len()],
        failed: None,
    };
    let n_steps = simulation.n_steps();
    let stride = n_steps.div_ceil(POINTS).max(1);
    let path_stride = n_steps.saturating_mul(shown.len() as u64).div_ceil(PATH_POINTS).max(1);
    loop {
        let state = simulation.state();
        let is_last = state.step == n_steps;
        if state.step.is_multiple_of(path_stride) || is_last {
            for (path, particle) in record.paths.iter_mut().zip(&shown) {
                path.push([0, 1].map(|axis| state.positions[particle * dimension + axis]));
            }
        }
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

fn svg(scene: &Scene, records: &[Record]) -> String {
    let paths = PathFrames::of(scene, records);
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
    let height = top + paths.height() + 2.0 * (HEIGHT + SPACE);
    let title = format!("Paths, energy and momentum of {}", scene.name);
    let mut svg = svg::start(&title, &scene.name, height);
    for (number, record) in records.iter().enumerate() {
        let mut words = record.integrator.to_owned();
        if let Some(time) = record.failed {
            let _ = write!(words, ", fails at t = {} s", short(time));
        } else if panels.iter().any(|panel| panel.is_cut(record)) {
            words += ", leaves the diagram";
        }
        svg::legend_line(&mut svg, number, &words);
    }
    for (number, panel) in panels.iter().enumerate() {
        panel.draw(&mut svg, top + paths.height() + number as f64 * (HEIGHT + SPACE) + 30.0);
    }
    paths.draw(&mut svg, top + 44.0);
    svg + "</svg>\n"
}

/// Frames with the paths of each integrator, side by side.
struct PathFrames<'a> {
    records: &'a [Record],
    title: String,
    /// The point in the middle, and the width of what a frame shows, in metres.
    center: [f64; 2],
    size: f64,
}

impl<'a> PathFrames<'a> {
    fn of(scene: &Scene, records: &'a [Record]) -> Self {
        let n_shown = records.first().map_or(0, |record| record.paths.len());
        let n_particles = scene.particles.len();
        let plane = if scene.dimension.count() == 3 { ", seen along z" } else { "" };
        let of = if n_shown < n_particles {
            format!(" of {n_shown} of {n_particles} particles")
        } else {
            String::new()
        };
        let boxes = || records.iter().map(Record::bounds);
        let size = |bounds: &[[f64; 2]; 2]| {
            bounds.map(|[low, high]| high - low).into_iter().fold(0.0, f64::max)
        };
        let moving = boxes().filter(|bounds| size(bounds).is_finite() && size(bounds) > 0.0);
        let least = moving.min_by(|a, b| size(a).total_cmp(&size(b)));
        let mut frame = least.unwrap_or([[-0.5, 0.5]; 2]);
        let reach = 0.5 * PATH_BEYOND * size(&frame);
        let limits =
            frame.map(|[low, high]| [0.5 * (low + high) - reach, 0.5 * (low + high) + reach]);
        for bounds in boxes().filter(|bounds| size(bounds).is_finite()) {
            for (axis, [low, high]) in bounds.into_iter().enumerate() {
                frame[axis][0] = frame[axis][0].min(low).max(limits[axis][0]);
                frame[axis][1] = frame[axis][1].max(high).min(limits[axis][1]);
            }
        }
        Self {
            records,
            title: format!("Paths{of}, x and y in metres{plane}"),
            center: frame.map(|[low, high]| 0.5 * (low + high)),
            size: 1.1 * size(&frame),
        }
    }

    fn columns(&self) -> usize {
        self.records.len().clamp(1, PATH_COLUMNS)
    }

    /// Width and height of a frame.
    fn side(&self) -> f64 {
        // Two or three frames fill the width; one has the size of one of two.
        let columns = self.columns().max(2) as f64;
        (RIGHT - LEFT - (columns - 1.0) * PATH_SPACE) / columns
    }

    /// Height of all frames, with the space below them.
    fn height(&self) -> f64 {
        let rows = self.records.len().div_ceil(self.columns());
        rows as f64 * (self.side() + SPACE) + 14.0
    }

    fn draw(&self, svg: &mut String, top: f64) {
        let side = self.side();
        let _ = writeln!(
            svg,
            "<text x=\"{LEFT}\" y=\"{}\" font-weight=\"bold\">{}</text>",
            top - 28.0,
            self.title
        );
        for (number, record) in self.records.iter().enumerate() {
            let (row, column) = (number / self.columns(), number % self.columns());
            let left = LEFT + column as f64 * (side + PATH_SPACE);
            self.draw_frame(svg, [left, top + row as f64 * (side + SPACE)], number, record);
        }
    }

    fn draw_frame(&self, svg: &mut String, [left, top]: [f64; 2], number: usize, record: &Record) {
        let side = self.side();
        let color = COLORS[number % COLORS.len()];
        let scale = side / self.size;
        // A rasteriser's numbers end somewhere: far points are drawn just outside the frame.
        let at = |[x, y]: [f64; 2]| {
            let near = |value: f64| value.clamp(-500.0, 500.0 + side);
            [
                left + near(0.5 * side + scale * (x - self.center[0])),
                top + near(0.5 * side - scale * (y - self.center[1])),
            ]
        };
        let _ = writeln!(
            svg,
            "<clipPath id=\"paths{number}\"><rect x=\"{left}\" y=\"{top}\" width=\"{side}\" height=\"{side}\"/></clipPath>"
        );
        for (axis, center) in self.center.into_iter().enumerate() {
            for value in ticks(center - 0.5 * self.size, center + 0.5 * self.size) {
                let mut place = self.center;
                place[axis] = value;
                let [x, y] = at(place);
                let label = short(value);
                let _ = match axis {
                    0 => writeln!(
                        svg,
                        "<path d=\"M{x:.2} {top}v{side}\" stroke=\"#e6e9ed\"/>\
                         <text x=\"{x:.2}\" y=\"{}\" font-size=\"11\" text-anchor=\"middle\">{label}</text>",
                        top + side + 15.0
                    ),
                    _ => writeln!(
                        svg,
                        "<path d=\"M{left} {y:.2}h{side}\" stroke=\"#e6e9ed\"/>\
                         <text x=\"{}\" y=\"{:.2}\" font-size=\"11\" text-anchor=\"end\">{label}</text>",
                        left - 5.0,
                        y + 4.0
                    ),
                };
            }
        }
        let beyond = if self.holds(record) { "" } else { ", leaves the frame" };
        let _ = writeln!(
            svg,
            "<rect x=\"{left}\" y=\"{top}\" width=\"{side}\" height=\"{side}\" fill=\"none\" stroke=\"#57606a\"/>\
             <text x=\"{left}\" y=\"{}\">{}{beyond}</text>",
            top - 8.0,
            record.integrator
        );
        for path in &record.paths {
            let points = spaced(path.iter().map(|point| at(*point)));
            let Some(([x0, y0], [x1, y1])) = points.first().copied().zip(points.last().copied())
            else {
                continue;
            };
            let line: Vec<String> = points.iter().map(|[x, y]| format!("{x:.2},{y:.2}")).collect();
            let _ = writeln!(
                svg,
                "<g clip-path=\"url(#paths{number})\"><polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" \
                 stroke-width=\"1.25\" stroke-linejoin=\"round\"/>\
                 <circle cx=\"{x0:.2}\" cy=\"{y0:.2}\" r=\"3\" fill=\"#fff\" stroke=\"{color}\"/>\
                 <circle cx=\"{x1:.2}\" cy=\"{y1:.2}\" r=\"3\" fill=\"{color}\"/></g>",
                line.join(" ")
            );
        }
    }

    /// Whether a frame shows all of a record's paths.
    fn holds(&self, record: &Record) -> bool {
        record.bounds().into_iter().zip(self.center).all(|([low, high], center)| {
            low >= center - 0.5 * self.size && high <= center + 0.5 * self.size || low > high
        })
    }
}

/// The points without those that lie within [`PATH_STEP`] of the last one that is kept. The last point stays.
fn spaced(points: impl Iterator<Item = [f64; 2]>) -> Vec<[f64; 2]> {
    let mut kept: Vec<[f64; 2]> = Vec::new();
    let mut skipped = None;
    for point in points {
        let is_far = |[x, y]: &[f64; 2]| (point[0] - x).hypot(point[1] - y) >= PATH_STEP;
        if kept.last().is_none_or(is_far) {
            kept.push(point);
            skipped = None;
        } else {
            skipped = Some(point).filter(|point| kept.last() != Some(point));
        }
    }
    kept.extend(skipped);
    kept
}

impl Record {
    /// Lowest and highest x and y of all paths.
    fn bounds(&self) -> [[f64; 2]; 2] {
        [0, 1].map(|axis| {
            let values = || self.paths.iter().flatten().map(|point| point[axis]);
            [values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max)]
        })
    }
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
        let longest = self.records.iter().filter_map(|record| record.times.last());
        let end = longest.copied().fold(0.0, f64::max);
        let frame = svg::Panel {
            title: self.title,
            label: "time (s)",
            top,
            x: [0.0, if end > 0.0 { end } else { 1.0 }],
            y: self.range(),
            logarithmic: false,
        };
        frame.draw(svg);
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
                let points = record.times.iter().zip(curve).map(|(time, value)| [*time, *value]);
                frame.curve(svg, number, dash, points);
            }
        }
    }
}
