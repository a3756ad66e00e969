//! Diagram of how several methods converge within one step of implicit Euler (`--convergence FILE.svg`).
//!
//! All methods start from the same state and minimise the same incremental potential `E`: its distance from the least value
//! that any of them finds is shown against iterations and against time. The third panel is a line search of projected
//! Newton: `E` along the step that was halved most, with the lengths that were tried.
//!
//! Values and times come from two runs, so that the times are without the evaluations of `E` for the diagram.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use scene::output::OutputFile;
use scene::{Overrides, ParseOptions, Scene};
use simulator::integrator::{Iterate, REGISTRY};
use simulator::simulation::{Simulation, SimulationError, SimulationOptions};
use simulator::vocabulary;

use crate::svg::{self, HEIGHT, LINE, Panel, SPACE};
use crate::{Failure, print_message};

/// Maximum number of iterations of a method.
const ITERATIONS: &str = "100";

/// Distances from the least energy below this part of the largest are rounding, and not shown.
const FLOOR: f64 = 1e-14;

/// Points of the curve of a line search.
const SAMPLES: usize = 120;

/// A method, and the options that make it go on until it has converged to rounding.
struct Method {
    name: &'static str,
    integrator: &'static str,
    options: &'static [(&'static str, &'static str)],
}

const METHODS: [Method; 5] = [
    Method {
        name: "Newton",
        integrator: "projected-newton",
        options: &[
            ("projection", "none"),
            ("line_search", "none"),
            ("tolerance", "1e-12"),
            ("max_iterations", ITERATIONS),
        ],
    },
    Method {
        name: PROJECTED_NEWTON,
        integrator: "projected-newton",
        options: &[("tolerance", "1e-12"), ("max_iterations", ITERATIONS)],
    },
    Method {
        name: "Gauss–Newton",
        integrator: "projected-newton",
        options: &[
            ("direction", "gauss-newton"),
            ("tolerance", "1e-12"),
            ("max_iterations", ITERATIONS),
        ],
    },
    Method {
        name: "gradient descent",
        integrator: "projected-newton",
        options: &[
            ("direction", "gradient"),
            ("tolerance", "1e-12"),
            ("max_iterations", ITERATIONS),
        ],
    },
    Method {
        name: "local-global",
        integrator: "fast-mass-spring",
        options: &[("iterations", ITERATIONS)],
    },
];

const PROJECTED_NEWTON: &str = "projected Newton";

/// A method's iterates.
struct Curve {
    name: &'static str,
    energies: Vec<f64>,
    /// Of each iterate, in milliseconds from the start of the step.
    times: Vec<f64>,
    line_search: Option<LineSearch>,
}

/// `E` along a step `p` from the iterate before.
#[derive(Clone)]
struct LineSearch {
    iteration: u64,
    halvings: u64,
    /// `α` and `E`.
    samples: Vec<[f64; 2]>,
    /// The lengths that were tried, the last of which was taken.
    tried: Vec<[f64; 2]>,
}

/// The state from which all methods start.
struct Start {
    step: u64,
    positions: Vec<f64>,
    velocities: Vec<f64>,
}

/// Refuses a step that the scene does not have.
pub(super) fn refuse_beyond(path: &Path, scene: &Scene, step: u64) -> Result<(), Failure> {
    match scene.n_steps() {
        n_steps if step <= n_steps => Ok(()),
        n_steps => Err(Failure::at(
            path,
            format!(
                "there is no step {step}: the scene has {n_steps}\n  help: give --convergence-step a number from 1 to that"
            ),
        )),
    }
}

/// Writes the diagram of step `step`, from 1 to the last one.
pub(super) fn write(
    output: &Path,
    path: &Path,
    options: &ParseOptions,
    scene: &Scene,
    (config, step): (SimulationOptions, u64),
) -> Result<(), Failure> {
    let mut simulation = Simulation::with_options(scene, config);
    let file = OutputFile::create(output).map_err(|error| Failure::cannot_create(output, &error));
    let mut file = file?;
    while simulation.state().step < step - 1 {
        simulation.advance()?;
    }
    let state = simulation.state();
    let start = Start {
        step: state.step,
        positions: state.positions.to_vec(),
        velocities: state.velocities.to_vec(),
    };
    let mut curves = Vec::new();
    for method in &METHODS {
        let integrator = REGISTRY.iter().find(|kind| kind.schema.name == method.integrator);
        let chosen = method.options.iter().map(|(name, value)| ((*name).into(), (*value).into()));
        let overrides = Overrides {
            integrator: integrator.map(|kind| &kind.schema),
            options: chosen.collect(),
            ..options.overrides.clone()
        };
        match scene::load(path, &vocabulary(), &ParseOptions { overrides, ..options.clone() }) {
            Ok(parsed) => curves.extend(run(method.name, &parsed.scene, config, &start)),
            Err(error) => print_message("note", format!("{}: {error}", method.name)),
        }
    }
    if curves.is_empty() {
        return Err(Failure::at(
            path,
            "no method of the diagram can simulate this scene\n  help: they minimise an energy, and need forces that have one",
        ));
    }
    let written = file.write_all(svg(scene, step, &curves).as_bytes());
    written.and_then(|()| file.commit()).map_err(|error| Failure::at(output, error))
}

/// Takes the step twice: for the values, and for the times. None, with a note, if the step fails before its second iterate.
fn run(
    name: &'static str,
    scene: &Scene,
    config: SimulationOptions,
    start: &Start,
) -> Option<Curve> {
    let search = name == PROJECTED_NEWTON;
    let (Values { energies, line_search, .. }, end) =
        take_step(scene, config, start, Values::default(), move |values, iterate, _| {
            values.add(iterate, search);
        });
    if let Err(error) = end
        && energies.len() < 2
    {
        print_message("note", format!("{name}: {error}"));
        return None;
    }
    let (times, _) =
        take_step(scene, config, start, Vec::new(), |times: &mut Vec<f64>, _, began| {
            times.push(began.elapsed().as_secs_f64() * 1e3);
        });
    (!energies.is_empty()).then_some(Curve { name, energies, times, line_search })
}

/// One step, each of whose iterates is handed to `keep`, with the moment when the step began. A step that does not converge
/// has iterates as well.
fn take_step<T: Send + Clone + 'static>(
    scene: &Scene,
    config: SimulationOptions,
    start: &Start,
    kept: T,
    keep: impl Fn(&mut T, &Iterate<'_>, Instant) + Send + 'static,
) -> (T, Result<bool, SimulationError>) {
    let kept = Arc::new(Mutex::new(kept));
    let shared = Arc::clone(&kept);
    // Fallbacks are no part of a method.
    let config = SimulationOptions { robust: false, ..config };
    let mut simulation = Simulation::with_options(scene, config);
    simulation.set_state(start.step, None, &start.positions, &start.velocities);
    let began = Instant::now();
    simulation.record_by(Box::new(move |iterate| {
        keep(&mut shared.lock().unwrap_or_else(PoisonError::into_inner), iterate, began);
    }));
    let end = simulation.advance();
    let kept = kept.lock().unwrap_or_else(PoisonError::into_inner).clone();
    (kept, end)
}

/// The energies of the iterates, and the line search with the most halvings.
#[derive(Clone, Default)]
struct Values {
    energies: Vec<f64>,
    previous: Vec<f64>,
    line_search: Option<LineSearch>,
}

impl Values {
    fn add(&mut self, iterate: &Iterate<'_>, search: bool) {
        self.energies.extend(iterate.energy_at(iterate.velocities));
        let most = self.line_search.as_ref().map(|search| search.halvings);
        if let Some(taken) = iterate.step_length
            && search
            && most.is_none_or(|most| iterate.halvings > most)
        {
            let along = |alpha: f64| {
                let ends = self.previous.iter().zip(iterate.velocities);
                let place: Vec<f64> =
                    ends.map(|(start, end)| start + alpha / taken * (end - start)).collect();
                iterate.energy_at(&place).map(|energy| [alpha, energy])
            };
            let lengths = (0..=SAMPLES).map(|number| 1.1 * number as f64 / SAMPLES as f64);
            let halved = (0..=iterate.halvings).map(|halving| 0.5_f64.powi(halving as i32));
            self.line_search = Some(LineSearch {
                iteration: iterate.iteration,
                halvings: iterate.halvings,
                samples: lengths.filter_map(along).collect(),
                tried: halved.filter_map(along).collect(),
            });
        }
        self.previous.clear();
        self.previous.extend_from_slice(iterate.velocities);
    }
}

fn svg(scene: &Scene, step: u64, curves: &[Curve]) -> String {
    let search = curves.iter().find_map(|curve| curve.line_search.as_ref());
    let n_panels = if search.is_some() { 3.0 } else { 2.0 };
    let top = 50.0 + LINE * curves.len() as f64;
    let title = format!("Convergence in step {step} of {}", scene.name);
    let mut svg = svg::start(&title, &scene.name, top + n_panels * (HEIGHT + SPACE));
    for (number, curve) in curves.iter().enumerate() {
        svg::legend_line(&mut svg, number, curve.name);
    }
    // A method that diverges may reach energies that are not numbers.
    let finite =
        |curve: &Curve| curve.energies.clone().into_iter().filter(|energy| energy.is_finite());
    let least = curves.iter().flat_map(finite).fold(f64::INFINITY, f64::min);
    let largest =
        curves.iter().flat_map(finite).fold(0.0, |largest, energy| (energy - least).max(largest));
    let floor = FLOOR * if largest > 0.0 { largest } else { 1.0 };
    // Number, time and distance from the least energy of the iterates that are shown.
    let shown = |curve: &Curve| -> Vec<[f64; 3]> {
        let iterates = curve.energies.iter().zip(&curve.times).enumerate();
        let distances =
            iterates.map(|(number, (energy, time))| [number as f64, *time, energy - least]);
        distances.filter(|[.., distance]| distance.is_finite() && *distance > floor).collect()
    };
    let curves: Vec<Vec<[f64; 3]>> = curves.iter().map(shown).collect();
    let range = [floor.log10(), (10.0 * floor / FLOOR).log10()];
    for (row, label) in ["iteration", "time (ms)"].into_iter().enumerate() {
        let end = curves.iter().flatten().map(|point| point[row]).fold(0.0, f64::max);
        let panel = Panel {
            title: &format!(
                "Step {step}: energy above the least (J), by {}",
                ["iteration", "time"][row]
            ),
            label,
            top: top + row as f64 * (HEIGHT + SPACE) + 30.0,
            x: [0.0, if end > 0.0 { end } else { 1.0 }],
            y: range,
            logarithmic: true,
        };
        panel.draw(&mut svg);
        for (number, curve) in curves.iter().enumerate() {
            let points = curve.iter().map(|point| [point[row], point[2].log10()]);
            panel.curve(&mut svg, number, "", points);
        }
    }
    if let Some(search) = search {
        search.draw(&mut svg, top + 2.0 * (HEIGHT + SPACE) + 30.0);
    }
    svg + "</svg>\n"
}

impl LineSearch {
    fn draw(&self, svg: &mut String, top: f64) {
        let values = || self.samples.iter().chain(&self.tried).map(|[_, energy]| *energy);
        let low = values().fold(f64::INFINITY, f64::min);
        let high = values().fold(f64::NEG_INFINITY, f64::max);
        let space = 0.05 * if high > low { high - low } else { 1.0 };
        let title = format!(
            "Line search of projected Newton, iteration {}: E(x + α p) (J); halvings of α: {}",
            self.iteration, self.halvings
        );
        let panel = Panel {
            title: &title,
            label: "α",
            top,
            x: [0.0, 1.1],
            y: [low - space, high + space],
            logarithmic: false,
        };
        panel.draw(svg);
        let number = METHODS.iter().position(|method| method.name == PROJECTED_NEWTON).unwrap_or(0);
        panel.curve(svg, number, "", self.samples.iter().copied());
        let start = self.samples.first().map(|[_, energy]| *energy);
        panel.curve(svg, number, "2 3", start.into_iter().flat_map(|e| [[0.0, e], [1.1, e]]));
        for (halvings, point) in self.tried.iter().enumerate() {
            let [x, y] = panel.at(*point);
            let fill = if halvings + 1 == self.tried.len() { "#1b1f24" } else { "#fff" };
            let _ = writeln!(
                svg,
                "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"4\" fill=\"{fill}\" stroke=\"#1b1f24\"/>"
            );
        }
    }
}
