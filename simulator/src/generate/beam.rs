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

use super::builder::{SceneBuilder, particle};
use super::error::count;
use super::options::{OptionSpec, Options, options};
use super::{GRAVITY, GenerateError, Generator, Size, SpringLaw, Springs, Timeline};
use scene::schema::Domain;
use scene::{Dimension, Scene};

options! {
    /// A clamped beam, in three dimensions.
    pub struct Beam {
        /// Cubes along its length.
        nx: u64 = 8 => OptionSpec::value("nx", "COUNT");
        /// Cubes up.
        ny: u64 = 2 => OptionSpec::value("ny", "COUNT");
        /// Cubes across.
        nz: u64 = 2 => OptionSpec::value("nz", "COUNT");
        /// Side of a cube.
        spacing: f64 = 0.1 => OptionSpec::number("spacing", "M", Domain::Positive);
        /// Mass of a cubic metre.
        density: f64 = 1000.0 => OptionSpec::number("density", "KG_PER_M3", Domain::Positive);
        /// Acceleration downwards.
        gravity: f64 = GRAVITY => OptionSpec::number("gravity", "M_PER_S2", Domain::Finite);
        with springs: Springs = Springs { stiffness: 5e4, damping: 20.0, law: SpringLaw::Hooke };
        with timeline: Timeline = Timeline::of("symplectic-euler", 2.0);
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
        self.check()?;

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
}

/// The lattice points, in the order of their numbers.
pub(super) fn lattice([nx, ny, nz]: [usize; 3]) -> impl Iterator<Item = [usize; 3]> {
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
