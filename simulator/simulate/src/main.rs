//! `simulate`: steps a scene and writes its trace. `simulate generate`: writes a scene. `simulate view`: shows a scene.

mod convergence;
mod film;
mod generate;
mod iterations;
mod plot;
mod reading;
mod svg;
mod view;

use std::fmt::Display;
use std::io::{self, IsTerminal, Write};
use std::panic::AssertUnwindSafe;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand, ValueEnum};
use film::{Film, FilmArgs};
use frames::materials::Materials;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use iterations::Iterations;
use reading::{DRAWN, Reading};
use scene::output::OutputFile;
use scene::printable;
use scene::schema::{IntegratorSchema, OptionKind, OptionSchema};
use scene::trace::csv::CsvWriter;
use scene::trace::energy::EnergyWriter;
use scene::trace::fosssim::FosssimWriter;
use scene::trace::{Shape, TraceFormat, TraceWriter};
use scene::{Overrides, ParseOptions, Parsed, Scene, SceneLimits};
use simulator::fallback::FallbackStatistics;
use simulator::generate::{parse_integrator, parse_option};
use simulator::growth::EnergyGrowth;
use simulator::simulation::{Simulation, SimulationOptions};
use simulator::sizes::PARALLEL;
use simulator::solver::linear::LinearSolver;
use simulator::statistics::{FrozenStatistics, Statistics};
use simulator::{force, integrator, vocabulary};

/// A [`LinearSolver`] by name.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Solver {
    /// Chosen for each component by size and symmetry.
    Auto,
    /// Dense for every component.
    Dense,
    /// Sparse for every component.
    Sparse,
}

impl From<Solver> for LinearSolver {
    fn from(solver: Solver) -> Self {
        match solver {
            Solver::Auto => Self::Auto,
            Solver::Dense => Self::Dense,
            Solver::Sparse => Self::Sparse,
        }
    }
}

/// Simulate a mass-spring scene and write the state after every step.
#[derive(Parser)]
#[command(
    name = "simulate",
    version = env!("VERSION"),
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    disable_help_subcommand = true
)]
struct Cli {
    #[command(subcommand)]
    command: Option<Task>,

    /// Scene file (XML, or JSON beside OBJ)
    #[arg(value_name = "SCENE", required_unless_present_any = ["scene_option", "serve"])]
    scene: Option<PathBuf>,

    /// Trace file to write; without it the scene is simulated and nothing is written
    #[arg(short, long, value_name = "TRACE")]
    output: Option<PathBuf>,

    /// Format of the trace [default: by extension; .csv or .bin]
    #[arg(long, value_parser = trace_formats(), requires = "output")]
    format: Option<TraceFormat>,

    /// Use this integrator instead of the scene's; with --plot several, separated by commas
    #[arg(long, value_name = "TYPE", value_delimiter = ',', value_parser = parse_integrator)]
    integrator: Vec<&'static IntegratorSchema>,

    /// Use this time step (seconds) instead of the scene's
    #[arg(long, value_name = "SECONDS", value_parser = parse_time_step, allow_negative_numbers = true)]
    dt: Option<f64>,

    /// Simulate this long (seconds) instead of the scene's duration
    #[arg(long, value_name = "SECONDS", value_parser = parse_duration, allow_negative_numbers = true)]
    duration: Option<f64>,

    /// Set an option of the integrator, overriding the scene; may be given several times
    #[arg(long = "option", value_name = "NAME=VALUE", value_parser = parse_option)]
    options: Vec<(String, String)>,

    /// Linear solver: chosen by the scene's size and structure, or always dense or sparse
    #[arg(long, value_enum, default_value_t = Solver::Auto)]
    solver: Solver,

    /// Retry failed steps with a line search, then with smaller steps; other steps are unchanged
    #[arg(long)]
    robust: bool,

    /// Write kinetic, potential and total energy and momentum of every state (CSV)
    #[arg(long, value_name = "FILE")]
    energy: Option<PathBuf>,

    /// Write residual, energy and step length of every iteration of an implicit method (CSV)
    #[arg(long, value_name = "FILE")]
    iterations: Option<PathBuf>,

    /// Write a diagram of the particles' paths, and of energies and momenta over time, of each integrator (SVG). Without
    /// another output, the scene is run for the diagram alone, and runs that fail are shown up to there
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,

    /// Write a diagram of how Newton, projected Newton, Gauss–Newton, gradient descent and local-global steps converge in one
    /// step (SVG). Without another output, the scene is run up to that step alone
    #[arg(long, value_name = "FILE")]
    convergence: Option<PathBuf>,

    /// The step of --convergence
    #[arg(long, value_name = "STEP", default_value_t = 1, requires = "convergence", value_parser = clap::value_parser!(u64).range(1..))]
    convergence_step: u64,

    /// Print statistics of the run: evaluations, factorisations, iterations, solver, residual
    #[arg(long)]
    stats: bool,

    /// Simulate many scenes in one process: read lines `SCENE TRACE` from standard input, up to the first one that fails
    #[arg(long, conflicts_with_all = ["scene", "scene_option", "output", "energy", "iterations", "plot", "convergence", "stats", "FilmArgs"])]
    serve: bool,

    #[command(flatten)]
    reading: Reading,

    #[command(flatten)]
    film: FilmArgs,

    /// Scene file, as FOSSSim spells it; the trace is then FOSSSim binary unless it is a .csv
    #[arg(
        short = 's',
        value_name = "SCENE",
        conflicts_with = "scene",
        help_heading = "FOSSSim's spelling"
    )]
    scene_option: Option<PathBuf>,

    /// Display; only 0 (none) is supported: `simulate view` shows a scene
    #[arg(short = 'd', value_name = "0", value_parser = ["0"], help_heading = "FOSSSim's spelling")]
    display: Option<String>,

    /// Start paused; ignored, since there is no display
    #[arg(short = 'p', value_name = "0|1", value_parser = ["0", "1"], help_heading = "FOSSSim's spelling")]
    paused: Option<String>,
}

/// Parses the name of a trace's format.
fn trace_formats() -> impl TypedValueParser<Value = TraceFormat> {
    let names = TraceFormat::ALL.map(|format| {
        let name = PossibleValue::new(format.name()).help(format.summary());
        if format.name() == format.extension() { name } else { name.alias(format.extension()) }
    });
    PossibleValuesParser::new(names).map(|name| {
        let mut formats = TraceFormat::ALL.into_iter();
        let known = formats.find(|format| [format.name(), format.extension()].contains(&&*name));
        known.expect("the parser accepts names of formats alone")
    })
}

/// Other commands.
#[derive(Subcommand)]
enum Task {
    #[command(disable_help_subcommand = true)]
    Generate(generate::Generate),
    #[command(disable_help_subcommand = true)]
    View(view::View),
}

/// A message for the user; the run has failed.
enum Failure {
    /// The scene, the call, or a file that cannot be written.
    Input(String),
    /// The standard output takes no more.
    Output(io::Error),
}

impl Failure {
    fn at(path: &Path, error: impl Display) -> Self {
        Self::Input(format!("{}: {error}", path.display()))
    }

    /// A failure of the standard output; a closed pipe is none, since its reader has seen enough.
    fn of_stdout(result: io::Result<()>) -> Result<(), Self> {
        match result {
            Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(Self::Output(error)),
            _ => Ok(()),
        }
    }

    fn cannot_create(path: &Path, error: &io::Error) -> Self {
        Self::at(path, format!("{error}\n  help: name a file in a folder that takes new files"))
    }
}

impl<E: std::error::Error> From<E> for Failure {
    fn from(error: E) -> Self {
        Self::Input(error.to_string())
    }
}

fn main() -> ExitCode {
    let command = Cli::command().after_help(registry_help());
    let matches = command.get_matches();
    let mut cli = Cli::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    std::panic::set_hook(Box::new(|panic| {
        print_message(
            "internal error",
            format!(
                "{panic}\n  help: this is a defect of simulate; please report it with the scene"
            ),
        );
    }));
    let task = || match &cli.command {
        Some(Task::Generate(options)) => generate::run(options),
        Some(Task::View(options)) => view::run(options),
        None if cli.serve => serve(&mut cli),
        None => run(&cli),
    };
    // Nothing is used after a panic.
    match std::panic::catch_unwind(AssertUnwindSafe(task)) {
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(Failure::Input(message))) => {
            print_message("error", message);
            ExitCode::from(2)
        }
        Ok(Err(Failure::Output(error))) => {
            print_message("error", format!("standard output: {error}; the output is incomplete"));
            ExitCode::from(3)
        }
        Err(_) => ExitCode::from(3),
    }
}

/// Simulates the scenes that the standard input names, each to the end of its trace before the next one.
fn serve(cli: &mut Cli) -> Result<(), Failure> {
    for (number, line) in io::stdin().lines().enumerate() {
        let line = line.map_err(|error| Failure::Input(format!("standard input: {error}")))?;
        let Some((scene, trace)) = line.split_once(' ') else {
            return Err(Failure::Input(format!(
                "standard input:{}: no trace is named\n  help: write a scene and its trace, such as a.xml a.csv",
                number + 1
            )));
        };
        (cli.scene, cli.output) = (Some(scene.into()), Some(trace.into()));
        run(cli)?;
    }
    Ok(())
}

fn run(cli: &Cli) -> Result<(), Failure> {
    let overrides = Overrides {
        integrator: cli.integrator.first().copied(),
        time_step: cli.dt,
        duration: cli.duration,
        options: cli.options.clone(),
    };
    let is_drawn = cli.film.is_asked() || cli.plot.is_some() || cli.convergence.is_some();
    let limits = if is_drawn { DRAWN } else { SceneLimits::default() };
    let options = cli.reading.options(overrides, limits);
    let path = cli.scene.as_ref().or(cli.scene_option.as_ref());
    let path = path.ok_or_else(|| Failure::Input("no scene file given".to_owned()))?;
    let format = trace_format(cli)?;
    if cli.integrator.len() > 1 && (cli.plot.is_none() || !cli.options.is_empty()) {
        return Err(Failure::Input(
            "several integrators need --plot, and take no --option\n  help: give --integrator once"
                .to_owned(),
        ));
    }
    refuse_one_file_for_two("the scene", path, cli)?;
    refuse_other_pictures(cli)?;
    let parsed = load(path, &options)?;
    if let Some(mesh) = &parsed.mesh {
        refuse_one_file_for_two("the scene's mesh", &mesh.path, cli)?;
    }
    let scene = parsed.scene;
    // Refused before anything is written.
    if cli.iterations.is_some() {
        iterations::refuse_without(path, &scene)?;
    }
    if cli.convergence.is_some() {
        convergence::refuse_beyond(path, &scene, cli.convergence_step)?;
    }
    if let Some(plot) = &cli.plot {
        plot_all(cli, plot, path, &options, scene.clone())?;
    }
    if let Some(output) = &cli.convergence {
        let write = || {
            let config = options_of(cli);
            convergence::write(output, path, &options, &scene, (config, cli.convergence_step))
        };
        if scene.forces.len() < PARALLEL { write()? } else { rayon::scope(|_| write())? }
    }
    let has_files = cli.output.is_some() || cli.energy.is_some() || cli.iterations.is_some();
    if !has_files && !cli.stats && !cli.film.is_asked() {
        if cli.plot.is_some() || cli.convergence.is_some() {
            return Ok(());
        }
        print_message(
            "note",
            "the scene is simulated, and nothing is written\n  help: -o trace.csv writes the state after every step",
        );
    }
    // Steps that use several threads enter their pool at no cost from inside; to start it takes a moment.
    if scene.forces.len() < PARALLEL {
        simulate(cli, &scene, format)
    } else {
        rayon::scope(|_| simulate(cli, &scene, format))
    }
}

/// Reads the scene, and prints its warnings.
fn load(path: &Path, options: &ParseOptions) -> Result<Parsed, Failure> {
    let parsed = scene::load(path, &vocabulary(), options)?;
    for warning in &parsed.warnings {
        print_message("warning", warning);
    }
    match parsed.n_warnings - parsed.warnings.len() {
        0 => {}
        more => print_message("warning", format!("{more} more warnings")),
    }
    Ok(parsed)
}

/// The materials of the scene's mesh. Unreadable ones are warnings.
fn materials(scene: &Scene) -> Materials {
    let (materials, notes) = Materials::read(&scene.rendering.surface);
    for note in notes {
        print_message("warning", format!("{note}\n  note: the mesh is drawn without it"));
    }
    materials
}

/// Writes the diagram of the scene, read with each integrator.
fn plot_all(
    cli: &Cli,
    plot: &Path,
    path: &Path,
    options: &ParseOptions,
    scene: Scene,
) -> Result<(), Failure> {
    let mut scenes = vec![scene];
    for integrator in cli.integrator.iter().skip(1) {
        let overrides = Overrides { integrator: Some(integrator), ..options.overrides.clone() };
        let options = ParseOptions { overrides, ..options.clone() };
        scenes.push(scene::load(path, &vocabulary(), &options)?.scene);
    }
    plot::write(plot, &scenes, options_of(cli))
}

fn options_of(cli: &Cli) -> SimulationOptions {
    SimulationOptions { solver: cli.solver.into(), robust: cli.robust, watch_energy: false }
}

/// Takes all steps of the scene and writes what was asked for.
fn simulate(cli: &Cli, scene: &Scene, format: TraceFormat) -> Result<(), Failure> {
    let config = SimulationOptions { watch_energy: true, ..options_of(cli) };
    let mut simulation = Simulation::with_options(scene, config);
    let mut film = Film::open(&cli.film, scene, options_of(cli))?;

    let mut trace = Trace::start(cli.output.as_deref(), format, Shape::of(scene))?;
    let mut energy = match &cli.energy {
        Some(path) => {
            let file =
                OutputFile::create(path).map_err(|error| Failure::cannot_create(path, &error))?;
            let writer = EnergyWriter::new(file, scene.dimension);
            Some((writer.map_err(|error| Failure::at(path, error))?, path))
        }
        None => None,
    };
    let iterations = cli.iterations.as_deref();
    let mut iterations =
        iterations.map(|path| Iterations::start(path, &mut simulation)).transpose()?;
    let started = Instant::now();
    let mut progress = Progress::new(&scene.name, simulation.n_steps());
    loop {
        trace.write(&simulation)?;
        if let Some(film) = &mut film {
            film.state(simulation.state())?;
        }
        if let Some((writer, path)) = &mut energy {
            let written = writer.write(simulation.state(), &simulation.energies()?);
            written.map_err(|error| Failure::at(path, error))?;
        }
        match simulation.advance() {
            Ok(true) => progress.at(simulation.statistics().steps),
            end => {
                // Warnings explain a failure as well.
                drop(progress);
                for warning in warnings(simulation.statistics(), scene, cli.robust) {
                    print_message("warning", warning);
                }
                end?;
                break;
            }
        }
        if let Some(iterations) = &mut iterations {
            iterations.write(simulation.state().step)?;
        }
    }
    let elapsed = started.elapsed();

    if let Some(film) = film {
        film.finish()?;
    }
    // All are safe on disk before the first takes its name.
    let mut sealed = Vec::new();
    if let Some((file, path)) = trace.into_file()? {
        sealed.push((file.seal().map_err(|error| Failure::at(&path, error))?, path));
    }
    if let Some((writer, path)) = energy {
        let file = writer.into_inner().and_then(OutputFile::seal);
        sealed.push((file.map_err(|error| Failure::at(path, error))?, path.clone()));
    }
    if let Some(iterations) = iterations {
        let (file, path) = iterations.into_file()?;
        sealed.push((file.seal().map_err(|error| Failure::at(&path, error))?, path));
    }
    for (file, path) in sealed {
        file.publish().map_err(|error| Failure::at(&path, error))?;
    }
    if let Some(note) = fallback_note(&simulation.statistics().fallback, scene) {
        print_message("note", note);
    }
    if cli.stats {
        Failure::of_stdout(print_statistics(&simulation, elapsed))?;
    }
    Ok(())
}

/// Refuses outputs that would replace an input or each other, before anything is written.
fn refuse_one_file_for_two(what: &str, input: &Path, cli: &Cli) -> Result<(), Failure> {
    let target = |path: &Path| scene::output::target(path).ok().flatten();
    let input = target(input);
    let outputs = [
        ("the film", &cli.film.film),
        ("the trace", &cli.output),
        ("the energies", &cli.energy),
        ("the iterations", &cli.iterations),
        ("the diagram", &cli.plot),
        ("the diagram of convergence", &cli.convergence),
    ];
    let outputs = outputs.map(|(name, path)| (name, path.as_deref().and_then(target)));
    let others = |number: usize| outputs[number + 1..].iter().map(|(name, path)| (*name, path));
    let clash = outputs.iter().enumerate().find_map(|(number, (name, path))| {
        let path = path.as_ref()?;
        let mut others = others(number).chain([(what, &input)]);
        others.find(|(_, other)| other.as_ref() == Some(path)).map(|(other, _)| (*name, other))
    });
    let Some((first, second)) = clash else { return Ok(()) };
    Err(Failure::Input(format!(
        "{first} and {second} cannot be one file\n  help: give each output a name of its own"
    )))
}

/// Refuses diagrams whose name is that of another kind of picture.
fn refuse_other_pictures(cli: &Cli) -> Result<(), Failure> {
    for path in [&cli.plot, &cli.convergence].into_iter().flatten() {
        if path.extension().is_some_and(|extension| !extension.eq_ignore_ascii_case("svg")) {
            return Err(Failure::at(
                path,
                "diagrams are written as SVG\n  help: give it a name that ends in .svg; browsers show it and print it",
            ));
        }
    }
    Ok(())
}

fn trace_format(cli: &Cli) -> Result<TraceFormat, Failure> {
    let Some(path) = &cli.output else { return Ok(TraceFormat::Csv) };
    let by_extension = TraceFormat::of_path(path);
    match cli.format.or(by_extension) {
        Some(format) => Ok(format),
        None if cli.scene_option.is_some() => Ok(TraceFormat::Fosssim),
        None => Err(Failure::at(
            path,
            "the extension is not that of a trace format\n  help: name it .csv or .bin, or add --format csv or --format fosssim",
        )),
    }
}

/// The trace being written, if one is.
enum Trace {
    None,
    Csv(Box<CsvWriter<OutputFile>>, PathBuf),
    Fosssim(FosssimWriter<OutputFile>, PathBuf),
}

impl Trace {
    fn start(path: Option<&Path>, format: TraceFormat, shape: Shape) -> Result<Self, Failure> {
        let Some(path) = path else { return Ok(Self::None) };
        let fail = |error: io::Error| Failure::at(path, error);
        let file =
            OutputFile::create(path).map_err(|error| Failure::cannot_create(path, &error))?;
        Ok(match format {
            TraceFormat::Csv => {
                Self::Csv(Box::new(CsvWriter::new(file, shape).map_err(fail)?), path.to_path_buf())
            }
            TraceFormat::Fosssim => Self::Fosssim(FosssimWriter::new(file), path.to_path_buf()),
        })
    }

    fn write(&mut self, simulation: &Simulation) -> Result<(), Failure> {
        let (result, path) = match self {
            Self::None => return Ok(()),
            Self::Csv(writer, path) => (writer.write(simulation.state()), path),
            Self::Fosssim(writer, path) => (writer.write(simulation.state()), path),
        };
        result.map_err(|error| Failure::at(path, error))
    }

    /// The file, with all that is buffered written to it.
    fn into_file(self) -> Result<Option<(OutputFile, PathBuf)>, Failure> {
        let (result, path) = match self {
            Self::None => return Ok(None),
            Self::Csv(writer, path) => (writer.into_inner(), path),
            Self::Fosssim(writer, path) => (Ok(writer.into_inner()), path),
        };
        match result {
            Ok(file) => Ok(Some((file, path))),
            Err(error) => Err(Failure::at(&path, error)),
        }
    }
}

/// A bar on the terminal, for runs that take longer than a moment.
struct Progress {
    name: String,
    n_steps: u64,
    started: Instant,
    looked: Instant,
    /// Steps between two looks at the clock: as many as take some milliseconds.
    stride: u64,
    next_look: u64,
    bar: Option<ProgressBar>,
}

impl Progress {
    fn new(name: &str, n_steps: u64) -> Self {
        let now = Instant::now();
        let name = name.to_owned();
        Self { name, n_steps, started: now, looked: now, stride: 1, next_look: 1, bar: None }
    }

    fn at(&mut self, step: u64) {
        if step < self.next_look {
            return;
        }
        let now = Instant::now();
        let quick = now - self.looked < Duration::from_millis(10);
        self.stride = if quick { self.stride * 2 } else { (self.stride / 2).max(1) };
        self.looked = now;
        self.next_look = step + self.stride;
        if let Some(bar) = &self.bar {
            bar.set_position(step);
        } else if self.started.elapsed() > Duration::from_millis(500) && io::stderr().is_terminal()
        {
            let bar =
                ProgressBar::with_draw_target(Some(self.n_steps), ProgressDrawTarget::stderr());
            let style = "{msg} {wide_bar} step {human_pos} of {human_len}, {eta} left";
            bar.set_style(
                ProgressStyle::with_template(style)
                    .unwrap_or_else(|_| ProgressStyle::default_bar()),
            );
            bar.set_message(self.name.clone());
            self.bar = Some(bar);
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

fn print_statistics(simulation: &Simulation, elapsed: Duration) -> io::Result<()> {
    let Statistics {
        steps,
        force_evaluations,
        assemblies,
        newton_iterations,
        max_newton_iterations,
        energy_evaluations,
        line_search_halvings,
        projections,
        local_global_iterations,
        max_local_global_iterations,
        unconverged_steps,
        rounds_end,
        frozen,
        control,
        linear_solver,
        linear,
        conditioning,
        fallback,
        energy_growth: _,
    } = simulation.statistics();
    let mut rows: Vec<(&str, String)> = vec![
        ("steps", steps.to_string()),
        ("time", format!("{:.3} ms", elapsed.as_secs_f64() * 1e3)),
        ("force evaluations", force_evaluations.to_string()),
    ];
    if !linear_solver.is_empty() {
        rows.extend([
            ("linear solver", linear_solver.clone()),
            ("matrix assemblies", assemblies.to_string()),
            ("linear solves", linear.solves.to_string()),
            ("factorisations", linear.factorisations.to_string()),
            ("refinements", linear.refinements.to_string()),
            ("indefinite matrices", linear.indefinite.to_string()),
            ("complete pivotings", linear.complete_pivotings.to_string()),
            ("worst linear residual", format!("{:.1e}", linear.worst_residual)),
        ]);
    }
    if conditioning.largest > 0.0 {
        rows.extend([
            ("largest amplification", format!("{:.1e}", conditioning.largest)),
            ("nearly singular steps", conditioning.nearly_singular.to_string()),
        ]);
    }
    if linear.iterations > 0 {
        rows.push((
            "factors reused",
            format!("{}, with {} iterations", linear.reused, linear.iterations),
        ));
    }
    if *newton_iterations > 0 {
        rows.push((
            "Newton iterations",
            format!("{newton_iterations}, at most {max_newton_iterations} a step"),
        ));
    }
    if frozen.steps > 0 {
        rows.push(("frozen steps", format!("{}, first {}", frozen.steps, frozen.first)));
    }
    if *energy_evaluations > 0 {
        rows.push(("energy evaluations", energy_evaluations.to_string()));
        rows.push(("line search halvings", line_search_halvings.to_string()));
    }
    if *projections > 0 {
        rows.push(("projected Hessians", projections.to_string()));
    }
    if *local_global_iterations > 0 {
        rows.extend([
            (
                "local-global rounds",
                format!("{local_global_iterations}, at most {max_local_global_iterations} a step"),
            ),
            ("unconverged steps", unconverged_steps.to_string()),
            ("last round's change", format!("up to {:.1e} m", rounds_end.change)),
        ]);
    }
    if rounds_end.residual > 0.0 {
        rows.push((
            "residual of rounds",
            format!("down to {:.1e} of the first", rounds_end.residual),
        ));
    }
    if rounds_end.distance > 0.0 {
        let distance = if rounds_end.distance.is_finite() {
            format!("in the worst step about {:.1e} m, or more", rounds_end.distance)
        } else {
            "unknown: the last rounds of a step do not contract".to_owned()
        };
        rows.push(("distance to minimiser", distance));
    }
    if control.taken > 0 {
        rows.extend([
            (
                "controlled steps",
                format!("{}, at most {} a step", control.taken, control.max_taken),
            ),
            ("rejected steps", control.rejected.to_string()),
        ]);
    }
    if fallback.steps() > 0 {
        let FallbackStatistics { line_searched, substepped, substeps, max_substeps } = fallback;
        rows.extend([
            ("steps by line search", line_searched.to_string()),
            (
                "steps in smaller ones",
                format!("{substepped}, by {substeps}, at most {max_substeps} a step"),
            ),
        ]);
    }
    let mut out = anstream::stdout();
    for (name, value) in rows {
        writeln!(out, "{name:<22} {value}")?;
    }
    out.flush()
}

/// Warnings of what makes a trace doubtful without making a step fail.
fn warnings(statistics: &Statistics, scene: &Scene, robust: bool) -> Vec<String> {
    let (name, h) = (&scene.name, scene.time_step);
    let mut warnings = Vec::new();
    if let Some((step, amplification)) = statistics.conditioning.first {
        let time = (step - 1) as f64 * h;
        let later = match statistics.conditioning.nearly_singular {
            1 => String::new(),
            2 => ", as in a later step".to_owned(),
            count => format!(", as in {} later steps", count - 1),
        };
        let help = if robust {
            "the fallbacks did not help: shorten the time step"
        } else {
            "shorten the time step, or add --robust"
        };
        warnings.push(format!(
            "{name}: step {step} (from t = {time} s): the matrix of the step is nearly singular: it \
             enlarges a change of velocity {amplification:.1e} times{later}\n  help: {help}"
        ));
    }
    if let Some(EnergyGrowth { step, energy, before, kinetic }) = statistics.energy_growth {
        let time = step as f64 * h;
        let which = if kinetic { "kinetic energy" } else { "energy" };
        warnings.push(format!(
            "{name}: step {step} (to t = {time} s): the {which} has grown to {energy:.1e}, from a \
             scale of {before:.1e}; the motion is unstable\n  help: shorten the time step"
        ));
    }
    warnings.extend(frozen_warning(&statistics.frozen, scene));
    warnings
}

/// A note for traces in which steps were recovered by fallbacks.
fn fallback_note(fallback: &FallbackStatistics, scene: &Scene) -> Option<String> {
    let FallbackStatistics { line_searched, substepped, substeps, .. } = fallback;
    let (name, method, h) = (&scene.name, scene.integrator.name, scene.time_step);
    let mut note = format!("{name}: {} steps failed at first;", fallback.steps());
    match (line_searched, substepped) {
        (0, 0) => return None,
        (_, 0) => note += " a line search solved their equations",
        (_, _) => {
            if *line_searched > 0 {
                note += &format!(" a line search solved the equations of {line_searched};");
            }
            note += &format!(
                " {substepped} were replaced by {substeps} substeps, so the trace differs from plain \
                 {method} at dt = {h}"
            );
        }
    }
    Some(note)
}

/// A warning for traces in which steps took no Newton iteration and should have.
fn frozen_warning(
    FrozenStatistics { steps, first, .. }: &FrozenStatistics,
    scene: &Scene,
) -> Option<String> {
    let (name, method) = (&scene.name, scene.integrator.name);
    (*steps > 0).then(|| {
        format!(
            "{name}: {method} left the particles where they were in {steps} steps, first in step {first}: the first \
             Newton iteration was within the tolerance\n  help: set min_iterations to 1, or a smaller tolerance"
        )
    })
}

fn print_message(kind: &str, message: impl Display) {
    let message = printable::text(&message.to_string());
    let _ = writeln!(anstream::stderr(), "{kind}: {message}");
}

/// Integrators and forces for the help text.
fn registry_help() -> String {
    let mut text = String::from("Integrators:\n");
    for kind in integrator::REGISTRY {
        text += &format!("  {:<26} {}\n", kind.schema.name, kind.schema.summary);
        if !kind.schema.aliases.is_empty() {
            text += &format!("  {:<26} also: {}\n", "", kind.schema.aliases.join(", "));
        }
        for option in kind.schema.options {
            text += &format!("  {:<26} {}: {}\n", "", option.name, describe_option(option));
        }
    }
    text += "\nForces:\n";
    for kind in force::REGISTRY {
        text += &format!("  {:<34} {}\n", kind.schema.title, kind.schema.example);
    }
    text += "\nExit codes: 0 the trace is whole, 2 the scene or the call is wrong (nothing is written), ";
    text += "3 a full standard output, or a defect of simulate.";
    text
}

/// The meaning of an option and its values.
fn describe_option(OptionSchema { meaning, kind, .. }: &OptionSchema) -> String {
    match kind {
        OptionKind::Number { default, .. } if *default >= 1e6 => {
            format!("{meaning} [default: {default:e}]")
        }
        OptionKind::Number { default, .. } => format!("{meaning} [default: {default}]"),
        OptionKind::Count { default, .. } => format!("{meaning} [default: {default}]"),
        OptionKind::Choice { words } => {
            format!("{meaning}: {} [default: {}]", words.join(", "), words[0])
        }
    }
}

fn parse_time_step(text: &str) -> Result<f64, String> {
    parse_seconds(text, |seconds| seconds > 0.0, "a number of seconds above 0")
}

fn parse_duration(text: &str) -> Result<f64, String> {
    parse_seconds(text, |seconds| seconds >= 0.0, "a number of seconds, 0 or more")
}

fn parse_seconds(text: &str, accept: fn(f64) -> bool, must_be: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds.is_finite() && accept(seconds) => Ok(seconds),
        _ => Err(format!("it must be {must_be}")),
    }
}
