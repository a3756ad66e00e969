//! Block: a box of tetrahedra.
//!
//! ```text
//!   #---o---o---o      nx by ny by nz cells along x (`length`), y (up, `height`) and z (`depth`), each of
//!   |  /|  /|  /|      six tetrahedra about its diagonal: one for each order in which the three axes lead
//!   | / | / | / |      from its first corner to the last. Faces of neighbours meet.
//!   |/  |/  |/  |
//!   #---o---o---o      The particles of the pinned side (#) are fixed: the left one makes a clamped beam.
//!
//!   particles (nx+1)(ny+1)(nz+1)        tetrahedra 6 nx ny nz
//! ```
//!
//! A particle has a quarter of the mass of its tetrahedra. x is multiplied by `stretch`, and the undeformed corners are not.
//! Particles are numbered with z fastest, then y, then x.

use super::beam::lattice;
use super::builder::SceneBuilder;
use super::error::count;
use super::options::{OptionSpec, Options, options};
use super::{GRAVITY, GenerateError, Generator, PinnedEdge, Size, Solid, Timeline};
use scene::schema::Domain;
use scene::{Dimension, Scene};

options! {
    /// A box of tetrahedra, in three dimensions.
    pub struct Block {
        /// Cells along its length.
        nx: u64 = 8 => OptionSpec::value("nx", "COUNT");
        /// Cells up.
        ny: u64 = 2 => OptionSpec::value("ny", "COUNT");
        /// Cells across.
        nz: u64 = 2 => OptionSpec::value("nz", "COUNT");
        /// Extent along x.
        length: f64 = 1.0 => OptionSpec::number("length", "M", Domain::Positive);
        /// Extent along y.
        height: f64 = 0.25 => OptionSpec::number("height", "M", Domain::Positive);
        /// Extent along z.
        depth: f64 = 0.25 => OptionSpec::number("depth", "M", Domain::Positive);
        /// Side whose particles are fixed.
        pinned: PinnedEdge = PinnedEdge::Left => OptionSpec::value("pin", "SIDE");
        /// Factor of its initial x.
        stretch: f64 = 1.0 => OptionSpec::number("stretch", "FACTOR", Domain::Positive);
        /// Acceleration downwards.
        gravity: f64 = GRAVITY => OptionSpec::number("gravity", "M_PER_S2", Domain::Finite);
        with solid: Solid = Solid::of(1e6);
        with timeline: Timeline = Timeline::of("implicit-euler", 1.0);
    }
}

const TIME_STEP: f64 = 0.01;

/// The orders of three axes.
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

impl Generator for Block {
    fn size(&self) -> Result<Size, GenerateError> {
        let [nx, ny, nz] =
            [count("nx", self.nx, 1)?, count("ny", self.ny, 1)?, count("nz", self.nz, 1)?];
        Ok(Size { particles: (nx + 1) * (ny + 1) * (nz + 1), pairs: 6 * nx * ny * nz })
    }

    fn scene(&self) -> Result<Scene, GenerateError> {
        let size = self.size()?;
        let mut builder = SceneBuilder::new("block", size, Dimension::Three, &self.timeline)?;
        self.check()?;

        let cells = [self.nx, self.ny, self.nz].map(|cells| cells as usize);
        let extents = [self.length, self.height, self.depth];
        let at = |axis: usize, place: usize| extents[axis] * place as f64 / cells[axis] as f64;
        let place = |[i, j, k]: [usize; 3]| {
            [at(0, i), at(1, j) - 0.5 * self.height, at(2, k) - 0.5 * self.depth]
        };
        let places: Vec<[f64; 3]> = lattice(cells).map(place).collect();
        let [nx, ny, nz] = cells;
        let id = |[i, j, k]: [usize; 3]| (i * (ny + 1) + j) * (nz + 1) + k;
        let tetrahedra = lattice([nx - 1, ny - 1, nz - 1]).flat_map(|cell| {
            ORDERS.map(|order| {
                let mut corner = cell;
                let mut next = |axis: usize| {
                    corner[axis] += 1;
                    id(corner)
                };
                let [second, third, fourth] = order.map(&mut next);
                [id(cell), second, third, fourth]
            })
        });
        let spacing = (0..3).map(|axis| at(axis, 1)).fold(f64::INFINITY, f64::min);
        let radius = builder.set_drawing_scale(spacing);
        builder.body(&places, tetrahedra, radius, &self.solid.body());
        for ([i, j, _], particle) in lattice(cells).zip(&mut builder.scene.particles) {
            particle.position[0] *= self.stretch;
            particle.fixed = self.pinned.holds([i, j], [nx, ny]);
        }
        builder.gravity(self.gravity);
        let length = self.stretch * self.length;
        builder.viewport([0.0, -0.5 * length], [length, 0.5 * length]);
        let description = format!("A block of {nx} by {ny} by {nz} cells of six tetrahedra.");
        Ok(builder.finish(&self.timeline, TIME_STEP, description)?)
    }
}
