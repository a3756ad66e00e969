//! Procedural scenes of any size: nets, chains, cloths, rings, beams and bodies.
//!
//! A generator is a struct of options, which are also those of `simulate generate`, and its
//! [`Generator::scene`] is a pure function: the same
//! options give the same [`Scene`], seed included. One kind a file, each with its picture, units and
//! counts; adding one is a new file, and a line in [`REGISTRY`]. Cost: time and memory in proportion to
//! the scene.
//!
//! Units are metres, seconds and kilograms, and so newtons a metre for a stiffness; nothing depends on
//! their being those.
//!
//! | kind | scene | default integrator |
//! | --- | --- | --- |
//! | [`Net`] | the elastic square of the slides, stretched or hung | linearized implicit Euler |
//! | [`Chain`] | links that swing from a fixed end | linearized implicit Euler |
//! | [`Cloth`] | a rectangle of cloth held by two corners (3D) | symplectic Euler |
//! | [`Ring`] | a spinning hoop or wheel | symplectic Euler |
//! | [`Beam`] | a lattice clamped at one end (3D) | symplectic Euler |
//! | [`Bodies`] | random bodies around a heavy one, in 2D or 3D | symplectic Euler |
//!
//! # Example
//!
//! ```
//! use simulator::generate::{Generator, Ring};
//!
//! let ring = Ring { particles: 6, spokes: true, ..Ring::default() };
//! let scene = ring.scene()?;
//! assert_eq!((scene.particles.len(), scene.forces.len()), (7, 12));
//! # Ok::<(), simulator::generate::GenerateError>(())
//! ```

mod error;
mod timeline;

mod beam;
mod bodies;
mod chain;
mod cloth;
mod net;
mod ring;

mod builder;
mod random;

pub use beam::Beam;
pub use bodies::Bodies;
pub use chain::Chain;
pub use cloth::Cloth;
pub use error::GenerateError;
pub use net::Net;
pub use ring::Ring;
pub use timeline::{Timeline, parse_integrator, parse_option};

use scene::Scene;

/// The most particles a generated scene has.
pub const MAX_PARTICLES: u64 = 1 << 20;

/// The most springs, or pairs of bodies, a generated scene has.
pub const MAX_PAIRS: u64 = 1 << 22;

/// A scene with its options.
pub trait Generator {
    /// How many particles and pairs the scene will have.
    ///
    /// # Errors
    /// If a number of particles or cells is out of range.
    fn size(&self) -> Result<Size, GenerateError>;

    /// The scene.
    ///
    /// # Errors
    /// If an option is out of its domain, or the scene would be larger than [`MAX_PARTICLES`] or
    /// [`MAX_PAIRS`].
    fn scene(&self) -> Result<Scene, GenerateError>;

    /// Its timeline, and its springs if it has any.
    fn common(&self) -> (&Timeline, Option<&Springs>);
}

/// The size of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// Particles.
    pub particles: u64,
    /// Springs, each on an edge of its own; or pairs that attract each other.
    pub pairs: u64,
}

/// The law of all springs of a scene.
#[derive(Debug, Clone, PartialEq, clap::Args)]
#[command(next_help_heading = "Springs")]
pub struct Springs {
    /// Stiffness of each spring.
    #[arg(short = 'k', long, value_name = "K", required = false)]
    pub stiffness: f64,
    /// Damping of each spring, along its axis.
    #[arg(
        short = 'b',
        long,
        value_name = "B",
        required = false,
        default_value_if("law", "green", "0")
    )]
    pub damping: f64,
    /// Law of each spring; green has no damping.
    #[arg(long = "spring", value_name = "LAW", value_enum, default_value_t = SpringLaw::Hooke)]
    pub law: SpringLaw,
}

/// The law of springs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum SpringLaw {
    /// Linear in the length.
    Hooke,
    /// Quadratic in the Green strain, as in the lecture.
    Green,
}

impl SpringLaw {
    /// The tag of its force.
    pub fn tag(self) -> &'static str {
        match self {
            Self::Hooke => "springforce",
            Self::Green => "greenspringforce",
        }
    }
}

/// A generator as the registry knows it.
pub struct GeneratorKind {
    /// Its name on the command line.
    pub name: &'static str,
    /// It with its default options.
    pub default: fn() -> Box<dyn Generator>,
}

/// Every generator.
pub static REGISTRY: &[GeneratorKind] = &[
    GeneratorKind { name: "net", default: || Box::new(Net::default()) },
    GeneratorKind { name: "chain", default: || Box::new(Chain::default()) },
    GeneratorKind { name: "cloth", default: || Box::new(Cloth::default()) },
    GeneratorKind { name: "ring", default: || Box::new(Ring::default()) },
    GeneratorKind { name: "beam", default: || Box::new(Beam::default()) },
    GeneratorKind { name: "bodies", default: || Box::new(Bodies::default()) },
];

/// Standard gravity, m/s², as the slides' peers round it.
const GRAVITY: f64 = 9.81;
