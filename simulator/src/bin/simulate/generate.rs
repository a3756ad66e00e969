//! `simulate generate`: writes a procedural scene.

use std::io::{self, BufWriter, Write};
use std::path::PathBuf;

use clap::{Arg, Args, Command, Subcommand, ValueEnum};
use simulator::generate::{
    Beam, Bodies, Chain, Cloth, GenerateError, Generator, Length, Net, REGISTRY, Ring, SpringLaw,
    Springs, Timeline,
};
use simulator::output::OutputFile;
use simulator::scene::schema::IntegratorSchema;
use simulator::scene::write::{self, WriteError};
use simulator::scene::{Dimension, MAX_FILE_SIZE, Scene};

use super::{Failure, parse_integrator, parse_option};

/// Write a scene of a kind, of any size, as XML.
#[derive(Args)]
pub(super) struct Generate {
    #[command(subcommand)]
    kind: Kind,
}

#[derive(Subcommand)]
enum Kind {
    /// Square net of the slides: side 1, rows, columns and diagonals, stretched or hung
    ///
    /// n segments a side make (n+1)² particles and 4n² + 2n springs.
    Net(NetOptions),
    /// Chain that swings from a fixed end
    ///
    /// n links make n + 1 particles and n springs. At rest, the uppermost spring is stretched by
    /// n · mass · gravity / stiffness.
    Chain(ChainOptions),
    /// Cloth held by two corners: structural, shear and bend springs
    ///
    /// nx by ny cells make (nx+1)(ny+1) particles, nx(ny+1) + (nx+1)ny structural and 2 nx ny shear
    /// springs, and (nx−1)(ny+1) + (nx+1)(ny−1) bend springs. With --tilt 0 the scene has two
    /// dimensions, otherwise three.
    Cloth(ClothOptions),
    /// Spinning ring, or a wheel with spokes
    ///
    /// n particles on the circle and n springs; spokes add a hub and n springs.
    Ring(RingOptions),
    /// Lattice of cubes clamped at one end, in three dimensions
    ///
    /// nx by ny by nz cubes make (nx+1)(ny+1)(nz+1) particles, joined along the edges, face diagonals and
    /// space diagonals of every cube.
    Beam(BeamOptions),
    /// Random bodies under their own gravitation
    ///
    /// A heavy body in the middle and n around it, and gravitation between each two: n(n+1)/2 forces
    /// (n(n−1)/2 with --central-mass 0). Zero momentum; bound if --virial is below 2.
    Bodies(BodiesOptions),
}

/// What every kind has. Defaults that differ by kind are filled in by [`with_defaults`].
#[derive(Args)]
#[command(next_help_heading = "Stepping and output")]
struct Common {
    /// Where the scene goes [default: standard output]
    #[arg(short, long, value_name = "SCENE")]
    output: Option<PathBuf>,

    /// Time integrator; see simulate --help
    #[arg(long, value_name = "TYPE", value_parser = parse_integrator)]
    integrator: Option<&'static IntegratorSchema>,

    /// Set an option of the integrator; may be given several times
    #[arg(long = "option", value_name = "NAME=VALUE", value_parser = parse_option)]
    options: Vec<(String, String)>,

    /// Time step in seconds [default: one that suits the scene, and the stability of symplectic Euler; explicit Euler gains energy at any]
    #[arg(long, value_name = "SECONDS")]
    dt: Option<f64>,

    /// Simulated time in seconds
    #[arg(long, value_name = "SECONDS")]
    duration: Option<f64>,

    /// Simulated time, in time steps
    #[arg(long, value_name = "COUNT", conflicts_with = "duration")]
    steps: Option<u64>,
}

impl Common {
    fn timeline(&self, default: Timeline) -> Timeline {
        let length = match (self.steps, self.duration) {
            (Some(steps), _) => Length::Steps(steps),
            (None, Some(seconds)) => Length::Seconds(seconds),
            (None, None) => default.length,
        };
        let integrator = self.integrator.unwrap_or(default.integrator);
        Timeline { integrator, options: self.options.clone(), time_step: self.dt, length }
    }
}

#[derive(Args)]
#[command(next_help_heading = "Springs")]
struct SpringOptions {
    /// Stiffness of each spring
    #[arg(short = 'k', long, value_name = "K")]
    stiffness: Option<f64>,

    /// Damping of each spring, along its axis
    #[arg(short = 'b', long, value_name = "B")]
    damping: Option<f64>,

    /// Law of each spring; green has no damping
    #[arg(long = "spring", value_name = "LAW", value_enum, default_value_t = Law::Hooke)]
    law: Law,
}

#[derive(Clone, Copy, ValueEnum)]
enum Law {
    /// Linear in the length
    Hooke,
    /// Quadratic in the Green strain, as in the lecture
    Green,
}

impl SpringOptions {
    fn springs(&self, default: &Springs) -> Springs {
        Springs {
            stiffness: self.stiffness.unwrap_or(default.stiffness),
            damping: self.damping.unwrap_or(match self.law {
                Law::Hooke => default.damping,
                Law::Green => 0.0,
            }),
            law: match self.law {
                Law::Hooke => SpringLaw::Hooke,
                Law::Green => SpringLaw::Green,
            },
        }
    }
}

#[derive(Args)]
struct NetOptions {
    /// Segments along a side
    #[arg(short = 'n', long, value_name = "COUNT", default_value_t = Net::default().segments)]
    segments: u64,

    /// Hang it by its two upper corners, not stretched, in gravity
    #[arg(long)]
    pin: bool,

    /// What its initial x is multiplied by [default: 1.4, or 1 with --pin]
    #[arg(long, value_name = "FACTOR")]
    stretch: Option<f64>,

    /// Mass of the whole; its side is 1
    #[arg(long, value_name = "KG_PER_M2", default_value_t = Net::default().density)]
    density: f64,

    /// Acceleration downwards, with --pin
    #[arg(long, value_name = "M_PER_S2", requires = "pin", default_value_t = Net::default().gravity)]
    gravity: f64,

    #[command(flatten)]
    springs: SpringOptions,
    #[command(flatten)]
    common: Common,
}

#[derive(Args)]
struct ChainOptions {
    /// Links
    #[arg(short = 'n', long, value_name = "COUNT", default_value_t = Chain::default().links)]
    links: u64,

    /// Length of the whole at rest
    #[arg(long, value_name = "M", default_value_t = Chain::default().length)]
    length: f64,

    /// Mass of each particle
    #[arg(long, value_name = "KG", default_value_t = Chain::default().mass)]
    mass: f64,

    /// Where the first link points, from straight down towards +x
    #[arg(long, value_name = "DEGREES", default_value_t = Chain::default().angle)]
    angle: f64,

    /// How much of the angle is lost along the chain: 0 is a straight line, with 1 its end hangs down
    #[arg(long, value_name = "0..1", default_value_t = Chain::default().sag)]
    sag: f64,

    /// Acceleration downwards
    #[arg(long, value_name = "M_PER_S2", default_value_t = Chain::default().gravity)]
    gravity: f64,

    #[command(flatten)]
    springs: SpringOptions,
    #[command(flatten)]
    common: Common,
}

#[derive(Args)]
struct ClothOptions {
    /// Cells along the fixed edge
    #[arg(long, value_name = "COUNT", default_value_t = Cloth::default().cells[0])]
    nx: u64,

    /// Cells down from it
    #[arg(long, value_name = "COUNT", default_value_t = Cloth::default().cells[1])]
    ny: u64,

    /// Length of the fixed edge
    #[arg(long, value_name = "M", default_value_t = Cloth::default().width)]
    width: f64,

    /// Length down from it
    #[arg(long, value_name = "M", default_value_t = Cloth::default().height)]
    height: f64,

    /// Mass of a square metre
    #[arg(long, value_name = "KG_PER_M2", default_value_t = Cloth::default().density)]
    density: f64,

    /// How far it is lifted from hanging straight down; 0 makes a scene of two dimensions
    #[arg(long, value_name = "DEGREES", default_value_t = Cloth::default().tilt)]
    tilt: f64,

    /// Acceleration downwards
    #[arg(long, value_name = "M_PER_S2", default_value_t = Cloth::default().gravity)]
    gravity: f64,

    /// Stiffness of each bend spring; 0 for none
    #[arg(long, value_name = "K", default_value_t = Cloth::default().bend_stiffness)]
    bend_stiffness: f64,

    #[command(flatten)]
    springs: SpringOptions,
    #[command(flatten)]
    common: Common,
}

#[derive(Args)]
struct RingOptions {
    /// Particles on the circle
    #[arg(short = 'n', long, value_name = "COUNT", default_value_t = Ring::default().particles)]
    particles: u64,

    /// Radius of the circle
    #[arg(long, value_name = "M", default_value_t = Ring::default().radius)]
    radius: f64,

    /// Mass of each particle
    #[arg(long, value_name = "KG", default_value_t = Ring::default().mass)]
    mass: f64,

    /// Angular velocity, counterclockwise
    #[arg(long, value_name = "RAD_PER_S", default_value_t = Ring::default().spin)]
    spin: f64,

    /// Add a hub, and springs from it to all
    #[arg(long)]
    spokes: bool,

    #[command(flatten)]
    springs: SpringOptions,
    #[command(flatten)]
    common: Common,
}

#[derive(Args)]
struct BeamOptions {
    /// Cubes along its length
    #[arg(long, value_name = "COUNT", default_value_t = Beam::default().cells[0])]
    nx: u64,

    /// Cubes up
    #[arg(long, value_name = "COUNT", default_value_t = Beam::default().cells[1])]
    ny: u64,

    /// Cubes across
    #[arg(long, value_name = "COUNT", default_value_t = Beam::default().cells[2])]
    nz: u64,

    /// Side of a cube
    #[arg(long, value_name = "M", default_value_t = Beam::default().spacing)]
    spacing: f64,

    /// Mass of a cubic metre
    #[arg(long, value_name = "KG_PER_M3", default_value_t = Beam::default().density)]
    density: f64,

    /// Acceleration downwards
    #[arg(long, value_name = "M_PER_S2", default_value_t = Beam::default().gravity)]
    gravity: f64,

    #[command(flatten)]
    springs: SpringOptions,
    #[command(flatten)]
    common: Common,
}

#[derive(Args)]
struct BodiesOptions {
    /// Bodies
    #[arg(short = 'n', long, value_name = "COUNT", default_value_t = Bodies::default().bodies)]
    bodies: u64,

    /// What the random numbers start from; the same seed gives the same bytes
    #[arg(long, value_name = "NUMBER", default_value_t = Bodies::default().seed)]
    seed: u64,

    /// A disc, or a ball
    #[arg(long, value_name = "2|3", value_enum, default_value_t = Axes::Three)]
    dimension: Axes,

    /// Radius of the disc or ball they start in
    #[arg(long, value_name = "M", default_value_t = Bodies::default().radius)]
    radius: f64,

    /// The least distance of two of them at the start
    #[arg(long, value_name = "M", default_value_t = Bodies::default().min_distance)]
    min_distance: f64,

    /// Mass of each in the mean; they lie between half and one and a half times it
    #[arg(long, value_name = "KG", default_value_t = Bodies::default().mass)]
    mass: f64,

    /// Mass of a heavy one in the middle, on top of the others; 0 for none
    #[arg(long, value_name = "KG", default_value_t = Bodies::default().central_mass)]
    central_mass: f64,

    /// Gravitational constant
    #[arg(short = 'G', long, value_name = "G", default_value_t = Bodies::default().gravitation)]
    gravitation: f64,

    /// Twice the kinetic by the potential energy: 0 at rest, 1 in equilibrium, 2 no longer bound
    #[arg(long, value_name = "RATIO", default_value_t = Bodies::default().virial)]
    virial: f64,

    #[command(flatten)]
    common: Common,
}

#[derive(Clone, Copy, ValueEnum)]
enum Axes {
    #[value(name = "2")]
    Two,
    #[value(name = "3")]
    Three,
}

impl Kind {
    /// The generator that the options describe, and what all kinds have.
    fn generator(&self) -> (Box<dyn Generator>, &Common) {
        match self {
            Self::Net(options) => (Box::new(options.generator()), &options.common),
            Self::Chain(options) => (Box::new(options.generator()), &options.common),
            Self::Cloth(options) => (Box::new(options.generator()), &options.common),
            Self::Ring(options) => (Box::new(options.generator()), &options.common),
            Self::Beam(options) => (Box::new(options.generator()), &options.common),
            Self::Bodies(options) => (Box::new(options.generator()), &options.common),
        }
    }
}

impl NetOptions {
    fn generator(&self) -> Net {
        let default = Net::default();
        Net {
            segments: self.segments,
            pinned: self.pin,
            stretch: self.stretch.unwrap_or(if self.pin { 1.0 } else { default.stretch }),
            density: self.density,
            gravity: self.gravity,
            springs: self.springs.springs(&default.springs),
            timeline: self.common.timeline(default.timeline),
        }
    }
}

impl ChainOptions {
    fn generator(&self) -> Chain {
        let default = Chain::default();
        Chain {
            links: self.links,
            length: self.length,
            mass: self.mass,
            angle: self.angle,
            sag: self.sag,
            gravity: self.gravity,
            springs: self.springs.springs(&default.springs),
            timeline: self.common.timeline(default.timeline),
        }
    }
}

impl ClothOptions {
    fn generator(&self) -> Cloth {
        let default = Cloth::default();
        Cloth {
            cells: [self.nx, self.ny],
            width: self.width,
            height: self.height,
            density: self.density,
            tilt: self.tilt,
            gravity: self.gravity,
            bend_stiffness: self.bend_stiffness,
            springs: self.springs.springs(&default.springs),
            timeline: self.common.timeline(default.timeline),
        }
    }
}

impl RingOptions {
    fn generator(&self) -> Ring {
        let default = Ring::default();
        Ring {
            particles: self.particles,
            radius: self.radius,
            mass: self.mass,
            spin: self.spin,
            spokes: self.spokes,
            springs: self.springs.springs(&default.springs),
            timeline: self.common.timeline(default.timeline),
        }
    }
}

impl BeamOptions {
    fn generator(&self) -> Beam {
        let default = Beam::default();
        Beam {
            cells: [self.nx, self.ny, self.nz],
            spacing: self.spacing,
            density: self.density,
            gravity: self.gravity,
            springs: self.springs.springs(&default.springs),
            timeline: self.common.timeline(default.timeline),
        }
    }
}

impl BodiesOptions {
    fn generator(&self) -> Bodies {
        Bodies {
            bodies: self.bodies,
            dimension: match self.dimension {
                Axes::Two => Dimension::Two,
                Axes::Three => Dimension::Three,
            },
            radius: self.radius,
            min_distance: self.min_distance,
            mass: self.mass,
            central_mass: self.central_mass,
            gravitation: self.gravitation,
            virial: self.virial,
            seed: self.seed,
            timeline: self.common.timeline(Bodies::default().timeline),
        }
    }
}

/// The command, its help showing the defaults that differ by kind.
pub(super) fn with_defaults(command: Command) -> Command {
    command.mut_subcommand("generate", |generate| {
        REGISTRY.iter().fold(generate, |generate, kind| {
            let default = (kind.default)();
            let of_argument = |name: &str| match (name, default.springs(), default.timeline()) {
                ("integrator", _, timeline) => Some(timeline.integrator.name.to_owned()),
                ("duration", _, Timeline { length: Length::Seconds(seconds), .. }) => {
                    Some(seconds.to_string())
                }
                ("stiffness", Some(springs), _) => Some(springs.stiffness.to_string()),
                ("damping", Some(springs), _) => Some(springs.damping.to_string()),
                _ => None,
            };
            let complete = |arg: Arg| {
                let help = arg.get_help().cloned().unwrap_or_default();
                // A negative number is a wrong value, and not an unknown option.
                let takes_values = arg.get_action().takes_values();
                let arg = if takes_values { arg.allow_negative_numbers(true) } else { arg };
                match of_argument(arg.get_id().as_str()) {
                    Some(value) => arg.help(format!("{help} [default: {value}]")),
                    None => arg,
                }
            };
            generate.mut_subcommand(kind.name, |command| command.mut_args(complete))
        })
    })
}

/// Writes the scene that the options describe.
pub(super) fn run(options: &Generate) -> Result<(), Failure> {
    let (generator, common) = options.kind.generator();
    let scene =
        generator.scene().map_err(|error: GenerateError| Failure::Input(error.to_string()))?;
    // What cannot be written, or not be read again, is refused before the first byte.
    let size = write::size(&scene)?;
    if size > MAX_FILE_SIZE {
        return Err(Failure::Input(format!(
            "this scene takes {size} bytes, and simulate reads at most {MAX_FILE_SIZE}\n  help: make it smaller"
        )));
    }
    let Some(path) = &common.output else { return print(&scene) };
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
