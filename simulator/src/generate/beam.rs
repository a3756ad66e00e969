//! Beam: a lattice of cubes, clamped at one end.
//!
//! ```text
//!   #---o---o---o      nx by ny by nz cubes of side `spacing`, along x, y (up) and z; the particles
//!   #---o---o---o      of the end at x = 0 (#) are fixed, and gravity bends the rest.
//!   #---o---o---o
//!
//!   particles         (nx+1)(ny+1)(nz+1)
//!   edges of cubes    nx(ny+1)(nz+1) + (nx+1)ny(nz+1) + (nx+1)(ny+1)nz
//!   face diagonals    2 (nx·ny·(nz+1) + nx·(ny+1)·nz + (nx+1)·ny·nz)
//!   space diagonals   4 nx·ny·nz
//! ```
//!
//! Springs stand on all three, at their rest length. Every particle has the mass
//! `density · volume / particles`. Particles are numbered with z fastest, then y, then x.

use clap::Args;

use super::builder::{SceneBuilder, particle};
use super::error::{check, count};
use super::{GRAVITY, GenerateError, Generator, Size, SpringLaw, Springs, Timeline};
use scene::schema::Domain;
use scene::{Dimension, Scene};

/// A clamped beam, in three dimensions.
#[derive(Debug, Clone, PartialEq, Args)]
pub struct Beam {
    /// Cubes along its length.
    #[arg(long, value_name = "COUNT", default_value_t = Beam::default().nx)]
    pub nx: u64,
    /// Cubes up.
    #[arg(long, value_name = "COUNT", default_value_t = Beam::default().ny)]
    pub ny: u64,
    /// Cubes across.
    #[arg(long, value_name = "COUNT", default_value_t = Beam::default().nz)]
    pub nz: u64,
    /// Side of a cube.
    #[arg(long, value_name = "M", default_value_t = Beam::default().spacing)]
    pub spacing: f64,
    /// Mass of a cubic metre.
    #[arg(long, value_name = "KG_PER_M3", default_value_t = Beam::default().density)]
    pub density: f64,
    /// Acceleration downwards.
    #[arg(long, value_name = "M_PER_S2", default_value_t = Beam::default().gravity)]
    pub gravity: f64,
    /// The springs.
    #[command(flatten)]
    pub springs: Springs,
    /// Integrator, time step and duration.
    #[command(flatten)]
    pub timeline: Timeline,
}

impl Default for Beam {
    fn default() -> Self {
        Self {
            nx: 8,
            ny: 2,
            nz: 2,
            spacing: 0.1,
            density: 1000.0,
            gravity: GRAVITY,
            springs: Springs { stiffness: 5e4, damping: 20.0, law: SpringLaw::Hooke },
            timeline: Timeline::of("symplectic-euler", 2.0),
        }
    }
}

const TIME_STEP: f64 = 0.005;

/// From a particle to the ones it is joined to: one of each two opposite directions.
const DIRECTIONS: [[isize; 3]; 13] = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
    [1, 1, 0],
    [1, -1, 0],
    [1, 0, 1],
    [1, 0, -1],
    [0, 1, 1],
    [0, 1, -1],
    [1, 1, 1],
    [1, 1, -1],
    [1, -1, 1],
    [1, -1, -1],
];

impl Generator for Beam {
    fn size(&self) -> Result<Size, GenerateError> {
        let [nx, ny, nz] =
            [count("nx", self.nx, 1)?, count("ny", self.ny, 1)?, count("nz", self.nz, 1)?];
        let [px, py, pz] = [nx + 1, ny + 1, nz + 1];
        let edges = nx * py * pz + px * ny * pz + px * py * nz;
        let faces = 2 * (nx * ny * pz + nx * py * nz + px * ny * nz);
        Ok(Size { particles: px * py * pz, pairs: edges + faces + 4 * nx * ny * nz })
    }

    fn scene(&self) -> Result<Scene, GenerateError> {
        let size = self.size()?;
        let mut builder = SceneBuilder::new("beam", size, Dimension::Three, &self.timeline)?;
        check("spacing", self.spacing, Domain::Positive)?;
        check("density", self.density, Domain::Positive)?;
        check("gravity", self.gravity, Domain::Finite)?;
        self.springs.check()?;

        let cells = [self.nx, self.ny, self.nz].map(|cells| cells as usize);
        let [nx, ny, nz] = cells;
        let [length, height, depth] = cells.map(|cells| cells as f64 * self.spacing);
        let radius = builder.set_drawing_scale(self.spacing);
        let mass = self.density * length * height * depth / size.particles as f64;
        for [i, j, k] in lattice(cells) {
            let position = [
                i as f64 * self.spacing,
                j as f64 * self.spacing - 0.5 * height,
                k as f64 * self.spacing - 0.5 * depth,
            ];
            let mut node = particle(mass, position, radius);
            node.fixed = i == 0;
            builder.particle(node);
        }
        let id = |[i, j, k]: [usize; 3]| (i * (ny + 1) + j) * (nz + 1) + k;
        for direction in DIRECTIONS {
            let squared: isize = direction.iter().map(|step| step * step).sum();
            let rest_length = self.spacing * (squared as f64).sqrt();
            for node in lattice(cells) {
                if let Some(other) = neighbour(node, direction, cells) {
                    builder.spring([id(node), id(other)], rest_length, &self.springs);
                }
            }
        }
        builder.gravity(self.gravity);
        builder.viewport([0.0, -0.5 * length], [length, 0.5 * length]);
        let description = format!("A beam of {nx} by {ny} by {nz} cubes, clamped at one end.");
        Ok(builder.finish(&self.timeline, TIME_STEP, description)?)
    }

    fn common(&self) -> (&Timeline, Option<&Springs>) {
        (&self.timeline, Some(&self.springs))
    }
}

/// The lattice points, in the order of their numbers.
fn lattice([nx, ny, nz]: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
    (0..=nx).flat_map(move |i| (0..=ny).flat_map(move |j| (0..=nz).map(move |k| [i, j, k])))
}

/// The lattice point in that direction, if there is one.
fn neighbour(node: [usize; 3], direction: [isize; 3], cells: [usize; 3]) -> Option<[usize; 3]> {
    let mut other = node;
    for axis in 0..3 {
        other[axis] = node[axis].checked_add_signed(direction[axis])?;
        if other[axis] > cells[axis] {
            return None;
        }
    }
    Some(other)
}
