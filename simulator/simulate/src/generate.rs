//! `simulate generate`: writes a procedural scene.

use std::io::{self, BufWriter, Write};
use std::path::PathBuf;

use clap::{Arg, Args, Command, Subcommand};
use scene::output::OutputFile;
use scene::write::{self, WriteError};
use scene::{MAX_FILE_SIZE, Scene};
use simulator::generate::{
    Beam, Bodies, Chain, Cloth, GenerateError, Generator, Net, REGISTRY, Ring,
};

use super::Failure;

/// Write a scene of a kind, of any size, as XML.
#[derive(Args)]
pub(super) struct Generate {
    #[command(subcommand)]
    generator: GeneratorCommand,
}

#[derive(Subcommand)]
enum GeneratorCommand {
    /// Square net of the slides: side 1, rows, columns and diagonals, stretched or hung
    ///
    /// n segments a side make (n+1)² particles and 4n² + 2n springs.
    Net(Options<Net>),
    /// Chain that swings from a fixed end
    ///
    /// n links make n + 1 particles and n springs. At rest, the uppermost spring is stretched by
    /// n · mass · gravity / stiffness.
    Chain(Options<Chain>),
    /// Cloth held by two corners: structural, shear and bend springs
    ///
    /// nx by ny cells make (nx+1)(ny+1) particles, nx(ny+1) + (nx+1)ny structural and 2 nx ny shear
    /// springs, and (nx−1)(ny+1) + (nx+1)(ny−1) bend springs. With --tilt 0 the scene has two
    /// dimensions, otherwise three.
    Cloth(Options<Cloth>),
    /// Spinning ring, or a wheel with spokes
    ///
    /// n particles on the circle and n springs; spokes add a hub and n springs.
    Ring(Options<Ring>),
    /// Lattice of cubes clamped at one end, in three dimensions
    ///
    /// nx by ny by nz cubes make (nx+1)(ny+1)(nz+1) particles, joined along the edges, face diagonals and
    /// space diagonals of every cube.
    Beam(Options<Beam>),
    /// Random bodies under their own gravitation
    ///
    /// A heavy body in the middle and n around it, and gravitation between each two: n(n+1)/2 forces
    /// (n(n−1)/2 with --central-mass 0). Zero momentum; bound if --virial is below 2.
    Bodies(Options<Bodies>),
}

/// The options of a generator, and the output.
#[derive(Args)]
struct Options<G: Args> {
    #[command(flatten)]
    generator: G,

    /// Scene file to write [default: standard output]
    #[arg(short, long, value_name = "SCENE", help_heading = "Stepping and output")]
    output: Option<PathBuf>,
}

impl GeneratorCommand {
    fn options(&self) -> (&dyn Generator, Option<&PathBuf>) {
        match self {
            Self::Net(options) => (&options.generator, options.output.as_ref()),
            Self::Chain(options) => (&options.generator, options.output.as_ref()),
            Self::Cloth(options) => (&options.generator, options.output.as_ref()),
            Self::Ring(options) => (&options.generator, options.output.as_ref()),
            Self::Beam(options) => (&options.generator, options.output.as_ref()),
            Self::Bodies(options) => (&options.generator, options.output.as_ref()),
        }
    }
}

/// Completes the command by the defaults that differ from generator to generator.
pub(super) fn with_defaults(command: Command) -> Command {
    command.mut_subcommand("generate", |generate| {
        REGISTRY.iter().fold(generate, |generate, kind| {
            let default = (kind.default)();
            let (timeline, springs) = default.common();
            let value_of = |argument: &str| match argument {
                "integrator" => Some(timeline.integrator.name.to_owned()),
                "duration" => Some(timeline.duration.to_string()),
                "stiffness" => springs.map(|springs| springs.stiffness.to_string()),
                "damping" => springs.map(|springs| springs.damping.to_string()),
                _ => None,
            };
            let complete = |arg: Arg| {
                // A negative number is a wrong value, and not an unknown option.
                let takes_values = arg.get_action().takes_values();
                let arg = if takes_values { arg.allow_negative_numbers(true) } else { arg };
                match value_of(arg.get_id().as_str()) {
                    // The parser keeps the text until the program ends.
                    Some(value) => arg.default_value(&*value.leak()),
                    None => arg,
                }
            };
            generate.mut_subcommand(kind.name, |command| command.mut_args(complete))
        })
    })
}

/// Writes the scene that the options describe.
pub(super) fn run(options: &Generate) -> Result<(), Failure> {
    let (generator, output) = options.generator.options();
    let scene =
        generator.scene().map_err(|error: GenerateError| Failure::Input(error.to_string()))?;
    // What cannot be written, or not be read again, is refused before the first byte.
    let size = write::size(&scene)?;
    if size > MAX_FILE_SIZE {
        return Err(Failure::Input(format!(
            "this scene takes {size} bytes, and simulate reads at most {MAX_FILE_SIZE}\n  help: make it smaller"
        )));
    }
    let Some(path) = output else { return print(&scene) };
    let mut file =
        OutputFile::create(path).map_err(|error| Failure::cannot_create(path, &error))?;
    write::write(&scene, &mut file).map_err(|error| Failure::at(path, error))?;
    file.commit().map_err(|error| Failure::at(path, error))
}

fn print(scene: &Scene) -> Result<(), Failure> {
    let mut out = BufWriter::with_capacity(1 << 16, io::stdout().lock());
    match write::write(scene, &mut out).and_then(|()| Ok(out.flush()?)) {
        Err(WriteError::Io(error)) => Failure::of_stdout(Err(error)),
        result => Ok(result?),
    }
}
