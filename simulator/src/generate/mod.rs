//! Procedural scenes of any size: nets, chains, cloths, rings, beams, sheets, discs, blocks, ropes and bodies.
//!
//! A generator is a struct of options, and its [`Generator::scene`] is a pure function: the same options give the same
//! [`Scene`], seed included. The [`options`](mod@options) are data, of which the program `simulate` makes the command line
//! of `simulate generate`. One kind a file, each with its picture, units and counts; adding one is a new file, and an
//! entry in [`REGISTRY`]. Cost: time and memory in proportion to the scene.
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
//! | [`Sheet`] | a rectangle of triangles, clamped, hung or stretched | implicit Euler |
//! | [`Disc`] | a spinning disc of triangles | symplectic Euler |
//! | [`Block`] | a box of tetrahedra, clamped, hung or stretched (3D) | implicit Euler |
//! | [`Rope`] | a rope with bending that swings from a fixed end | implicit Euler |
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
pub mod options;
mod timeline;

mod beam;
mod block;
mod bodies;
mod chain;
mod cloth;
mod disc;
mod net;
mod ring;
mod rope;
mod sheet;

mod builder;
mod random;

pub use beam::Beam;
pub use block::Block;
pub use bodies::Bodies;
pub use chain::Chain;
pub use cloth::Cloth;
pub use disc::Disc;
pub use error::{GenerateError, GenerateErrorKind};
pub use net::Net;
pub use ring::Ring;
pub use rope::Rope;
pub use sheet::Sheet;
pub use timeline::{Timeline, parse_integrator, parse_option};

use crate::force::REGISTRY as FORCES;
use options::{OptionSpec, Options, Rule, options};
use scene::Scene;
use scene::schema::{Domain, ForceSchema};

/// The most particles a generated scene has.
pub const MAX_PARTICLES: u64 = 1 << 20;

/// The most springs, elements of elastic bodies, or pairs of bodies, a generated scene has.
pub const MAX_PAIRS: u64 = 1 << 22;

/// A scene with its options.
pub trait Generator: Options {
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
}

/// The size of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// Particles.
    pub particles: u64,
    /// Springs, one an edge; triangles; tetrahedra; bars of a rope; or pairs that attract each other.
    pub pairs: u64,
}

/// The heading of the springs' options.
const SPRINGS: &str = "Springs";

options! {
    /// The law of all springs of a scene.
    pub struct Springs {
        /// Stiffness of each spring.
        stiffness: f64 => OptionSpec::number("stiffness", "K", Domain::NonNegative).short('k').heading(SPRINGS);
        /// Damping of each spring, along its axis; 0 if it is not given with --spring green.
        damping: f64 => OptionSpec::number("damping", "B", Domain::NonNegative).short('b').heading(SPRINGS)
            .rule(Rule::DefaultIf { option: "spring", is: "green", default: "0" });
        /// Law of each spring; green has no damping.
        law: SpringLaw => OptionSpec::value("spring", "LAW").heading(SPRINGS);
    }
}

/// The law of springs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpringLaw {
    /// Linear in the length.
    Hooke,
    /// Quadratic in the Green strain, as in the lecture.
    Green,
}

impl SpringLaw {
    /// Every law, its name and its description.
    pub const ALL: [(Self, &str, &str); 2] = [
        (Self::Hooke, "hooke", "Linear in the length"),
        (Self::Green, "green", "Quadratic in the Green strain, as in the lecture"),
    ];

    /// The tag of its force.
    pub fn tag(self) -> &'static str {
        match self {
            Self::Hooke => "springforce",
            Self::Green => "greenspringforce",
        }
    }
}

/// The edge of a sheet, or the side of a block, whose particles are fixed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PinnedEdge {
    /// The left one.
    Left,
    /// The upper one.
    Top,
    /// The left and the right one.
    Sides,
    /// None.
    None,
}

impl PinnedEdge {
    /// Every value, its name and its description.
    pub const ALL: [(Self, &str, &str); 4] = [
        (Self::Left, "left", "The left one: a clamped beam"),
        (Self::Top, "top", "The upper one: it hangs"),
        (Self::Sides, "sides", "The left and the right one"),
        (Self::None, "none", "None"),
    ];

    /// Whether it holds a particle in this column and row, of numbers from 0 to these.
    fn holds(self, [column, row]: [usize; 2], [last_column, last_row]: [usize; 2]) -> bool {
        match self {
            Self::Left => column == 0,
            Self::Top => row == last_row,
            Self::Sides => column == 0 || column == last_column,
            Self::None => false,
        }
    }
}

/// The heading of the triangles' options.
const TRIANGLES: &str = "Triangles";

options! {
    /// The material of all triangles of a scene.
    pub struct Material {
        /// Force of each triangle.
        force: &'static ForceSchema => OptionSpec::value("triangle", "TAG").heading(TRIANGLES);
        /// Young's modulus times thickness; small strains of elasticbodycstforce meet four times as much.
        youngs_modulus: f64 => OptionSpec::number("modulus", "E", Domain::NonNegative).heading(TRIANGLES);
        /// Poisson's ratio.
        poisson_ratio: f64 => OptionSpec::number("poisson", "NU", Domain::ExceptUnit).heading(TRIANGLES);
        /// Mass of a square metre.
        density: f64 => OptionSpec::number("density", "KG_PER_M2", Domain::Positive).heading(TRIANGLES);
    }
}

/// The heading of the tetrahedra's options.
const TETRAHEDRA: &str = "Tetrahedra";

options! {
    /// The material of all tetrahedra of a scene.
    pub struct Solid {
        /// Force of each tetrahedron.
        force: &'static ForceSchema => OptionSpec::value("tetrahedron", "TAG").heading(TETRAHEDRA);
        /// Young's modulus.
        youngs_modulus: f64 => OptionSpec::number("modulus", "E", Domain::NonNegative).heading(TETRAHEDRA);
        /// Poisson's ratio.
        poisson_ratio: f64 => OptionSpec::number("poisson", "NU", Domain::SolidPoissonRatio).heading(TETRAHEDRA);
        /// Mass of a cubic metre.
        density: f64 => OptionSpec::number("density", "KG_PER_M3", Domain::Positive).heading(TETRAHEDRA);
    }
}

/// The forces on elements with this many undeformed corners, in the order of the registry.
fn elements(corners: usize) -> impl Iterator<Item = &'static ForceSchema> {
    let schemas = FORCES.iter().map(|kind| &kind.schema);
    schemas.filter(move |schema| schema.is_element() && schema.stencil.size() == corners)
}

/// The force of all elements of a body, and their mass.
struct Body {
    force: &'static ForceSchema,
    youngs_modulus: f64,
    poisson_ratio: f64,
    /// Mass of a unit of area or volume.
    density: f64,
}

impl Material {
    /// A material of the registry's first triangle.
    fn of(youngs_modulus: f64) -> Self {
        let force = elements(3).next().expect("the registry has a triangle");
        Self { force, youngs_modulus, poisson_ratio: 0.3, density: 1.0 }
    }

    fn body(&self) -> Body {
        let Self { force, youngs_modulus, poisson_ratio, density } = *self;
        Body { force, youngs_modulus, poisson_ratio, density }
    }
}

impl Solid {
    /// A material of the registry's last tetrahedron, which may be crushed.
    fn of(youngs_modulus: f64) -> Self {
        let force = elements(4).last().expect("the registry has a tetrahedron");
        Self { force, youngs_modulus, poisson_ratio: 0.3, density: 1000.0 }
    }

    fn body(&self) -> Body {
        let Self { force, youngs_modulus, poisson_ratio, density } = *self;
        Body { force, youngs_modulus, poisson_ratio, density }
    }
}

/// A generator as the registry knows it.
pub struct GeneratorKind {
    /// Its name on the command line.
    pub name: &'static str,
    /// Its scene, in one line.
    pub summary: &'static str,
    /// More about its scene.
    pub details: &'static str,
    /// It with its default options.
    pub default: fn() -> Box<dyn Generator>,
}

/// Every generator.
pub static REGISTRY: &[GeneratorKind] = &[
    GeneratorKind {
        name: "net",
        summary: "Square net of the slides: side 1, rows, columns and diagonals, stretched or hung",
        details: "n segments a side make (n+1)² particles and 4n² + 2n springs.",
        default: || Box::new(Net::default()),
    },
    GeneratorKind {
        name: "chain",
        summary: "Chain that swings from a fixed end",
        details: "n links make n + 1 particles and n springs. At rest, the uppermost spring is stretched by \
            n · mass · gravity / stiffness.",
        default: || Box::new(Chain::default()),
    },
    GeneratorKind {
        name: "cloth",
        summary: "Cloth held by two corners: structural, shear and bend springs",
        details: "nx by ny cells make (nx+1)(ny+1) particles, nx(ny+1) + (nx+1)ny structural and 2 nx ny shear \
            springs, and (nx−1)(ny+1) + (nx+1)(ny−1) bend springs. With --tilt 0 the scene has two dimensions, \
            otherwise three.",
        default: || Box::new(Cloth::default()),
    },
    GeneratorKind {
        name: "ring",
        summary: "Spinning ring, or a wheel with spokes",
        details: "n particles on the circle and n springs; spokes add a hub and n springs.",
        default: || Box::new(Ring::default()),
    },
    GeneratorKind {
        name: "beam",
        summary: "Lattice of cubes clamped at one end, in three dimensions",
        details: "nx by ny by nz cubes make (nx+1)(ny+1)(nz+1) particles, joined along the edges, face diagonals \
            and space diagonals of every cube.",
        default: || Box::new(Beam::default()),
    },
    GeneratorKind {
        name: "sheet",
        summary: "Rectangle of triangles: a clamped beam, a hung or a stretched sheet",
        details: "nx by ny cells make (nx+1)(ny+1) particles and 2 nx ny triangles of any force on triangles. Each \
            particle has a third of the mass of its triangles.",
        default: || Box::new(Sheet::default()),
    },
    GeneratorKind {
        name: "disc",
        summary: "Spinning disc of triangles",
        details: "n rings about the centre make 1 + 3n(n+1) particles and 6n² triangles.",
        default: || Box::new(Disc::default()),
    },
    GeneratorKind {
        name: "block",
        summary: "Box of tetrahedra in three dimensions: a clamped beam, a hung or a stretched block",
        details: "nx by ny by nz cells make (nx+1)(ny+1)(nz+1) particles and 6 nx ny nz tetrahedra of any force on \
            tetrahedra. Each particle has a quarter of the mass of its tetrahedra.",
        default: || Box::new(Block::default()),
    },
    GeneratorKind {
        name: "rope",
        summary: "Rope with bending that swings from a fixed end",
        details: "n bars make n + 1 particles, n elastic springs and n − 1 bending forces. The bending stiffness of the \
            rope is EI = bending / 2.",
        default: || Box::new(Rope::default()),
    },
    GeneratorKind {
        name: "bodies",
        summary: "Random bodies under their own gravitation",
        details: "A heavy body in the middle and n around it, and gravitation between each two: n(n+1)/2 forces \
            (n(n−1)/2 with --central-mass 0). Zero momentum; bound if --virial is below 2.",
        default: || Box::new(Bodies::default()),
    },
];

/// Standard gravity, m/s², as the slides' peers round it.
const GRAVITY: f64 = 9.81;
