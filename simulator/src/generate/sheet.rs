//! Sheet: a rectangle of triangles.
//!
//! ```text
//!   #---o---o---o      nx = 3 by ny = 2 cells of two triangles, whose diagonals alternate; `width` by
//!   |  /|\  |  /|      `height`, the lower left corner at the origin.
//!   | / | \ | / |
//!   |/  |  \|/  |      The particles of the pinned edge (#) are fixed: the left one makes a clamped
//!   #---o---o---o      beam, the upper one a hung sheet. x is multiplied by `stretch`, and the
//!   |\  |  /|\  |      undeformed corners are not.
//!   | \ | / | \ |
//!   |  \|/  |  \|      particles (nx+1)(ny+1)        triangles 2 nx ny
//!   #---o---o---o
//! ```
//!
//! Particles are numbered by rows from below, each from the left.

use super::builder::SceneBuilder;
use super::error::count;
use super::options::{OptionSpec, Options, options};
use super::{GRAVITY, GenerateError, Generator, Material, PinnedEdge, Size, Timeline};
use scene::schema::Domain;
use scene::{Dimension, Scene};

options! {
    /// A rectangle of triangles.
    pub struct Sheet {
        /// Cells along its width.
        nx: u64 = 16 => OptionSpec::value("nx", "COUNT");
        /// Cells along its height.
        ny: u64 = 4 => OptionSpec::value("ny", "COUNT");
        /// Extent along x.
        width: f64 = 1.0 => OptionSpec::number("width", "M", Domain::Positive);
        /// Extent along y.
        height: f64 = 0.25 => OptionSpec::number("height", "M", Domain::Positive);
        /// Edge whose particles are fixed.
        pinned: PinnedEdge = PinnedEdge::Left => OptionSpec::value("pin", "EDGE");
        /// Factor of its initial x.
        stretch: f64 = 1.0 => OptionSpec::number("stretch", "FACTOR", Domain::Positive);
        /// Acceleration downwards.
        gravity: f64 = GRAVITY => OptionSpec::number("gravity", "M_PER_S2", Domain::Finite);
        with material: Material = Material::of(500.0);
        with timeline: Timeline = Timeline::of("implicit-euler", 2.0);
    }
}

const TIME_STEP: f64 = 0.01;

impl Generator for Sheet {
    fn size(&self) -> Result<Size, GenerateError> {
        let [nx, ny] = [count("nx", self.nx, 1)?, count("ny", self.ny, 1)?];
        Ok(Size { particles: (nx + 1) * (ny + 1), pairs: 2 * nx * ny })
    }

    fn scene(&self) -> Result<Scene, GenerateError> {
        let mut builder = SceneBuilder::new("sheet", self.size()?, Dimension::Two, &self.timeline)?;
        self.check()?;

        let [nx, ny] = [self.nx, self.ny].map(|cells| cells as usize);
        let at = |place: usize, count: usize, length: f64| length * place as f64 / count as f64;
        let rows = (0..=ny).map(|row| at(row, ny, self.height));
        let places: Vec<[f64; 2]> = rows
            .flat_map(|y| (0..=nx).map(move |column| [at(column, nx, self.width), y]))
            .collect();
        let cells = (0..ny).flat_map(|row| (0..nx).map(move |column| [column, row]));
        let triangles = cells.flat_map(|[column, row]| {
            let a = row * (nx + 1) + column;
            let (b, c, d) = (a + 1, a + nx + 1, a + nx + 2);
            if (column + row) % 2 == 0 { [[a, b, d], [a, d, c]] } else { [[a, b, c], [b, d, c]] }
        });
        let radius = builder.set_drawing_scale(at(1, nx, self.width).min(at(1, ny, self.height)));
        builder.body(&places, triangles, radius, &self.material.body());
        for (number, particle) in builder.scene.particles.iter_mut().enumerate() {
            let (column, row) = (number % (nx + 1), number / (nx + 1));
            particle.position[0] *= self.stretch;
            particle.fixed = self.pinned.holds([column, row], [nx, ny]);
        }
        builder.gravity(self.gravity);
        let width = self.stretch * self.width;
        let hangs = if self.pinned == PinnedEdge::Left { width } else { 0.0 };
        builder.viewport([0.0, -hangs], [width, self.height]);
        let description = format!("A sheet of {nx} by {ny} cells of two triangles.");
        Ok(builder.finish(&self.timeline, TIME_STEP, description)?)
    }
}
