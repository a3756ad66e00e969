//! Cloth: a rectangle held by two corners.
//!
//! ```text
//!   #---o---o---#      nx = 3 by ny = 2 cells, `width` by `height`; the corners # are fixed.
//!   |\ /|\ /|\ /|
//!   | X | X | X |      structural springs along rows and columns:  nx(ny+1) + (nx+1)ny
//!   |/ \|/ \|/ \|      shear springs, both diagonals of a cell:    2 nx ny
//!   o---o---o---o      bend springs over two cells, unless their
//!   |\ /|\ /|\ /|      stiffness is 0:                             (nx−1)(ny+1) + (nx+1)(ny−1)
//!   o---o---o---o
//!                      particles (nx+1)(ny+1)
//! ```
//!
//! The upper edge lies along x, at the origin's height. The cloth starts flat and at rest, tilted about
//! that edge: by 0° it hangs straight down, by 90° it lies level, towards +z. A cloth that is not tilted
//! stays in its plane, and its scene is two-dimensional; any other has three dimensions. Every particle
//! has the mass `density · width · height / particles`.

use super::builder::{SceneBuilder, particle, round_decimals};
use super::error::count;
use super::options::{OptionSpec, Options, options};
use super::{GRAVITY, GenerateError, Generator, Size, SpringLaw, Springs, Timeline};
use scene::schema::Domain;
use scene::{Dimension, Scene};

options! {
    /// A hanging cloth.
    pub struct Cloth {
        /// Cells along the fixed edge.
        nx: u64 = 12 => OptionSpec::value("nx", "COUNT");
        /// Cells down from it.
        ny: u64 = 12 => OptionSpec::value("ny", "COUNT");
        /// Length of the fixed edge.
        width: f64 = 1.0 => OptionSpec::number("width", "M", Domain::Positive);
        /// Length down from it.
        height: f64 = 1.0 => OptionSpec::number("height", "M", Domain::Positive);
        /// Mass of a square metre.
        density: f64 = 1.0 => OptionSpec::number("density", "KG_PER_M2", Domain::Positive);
        /// Angle by which it is lifted from hanging straight down; 0 makes a scene of two dimensions.
        tilt: f64 = 60.0 => OptionSpec::number("tilt", "DEGREES", Domain::Finite);
        /// Acceleration downwards.
        gravity: f64 = GRAVITY => OptionSpec::number("gravity", "M_PER_S2", Domain::Finite);
        /// Stiffness of each bend spring, which has the damping of the others; 0 for none.
        bend_stiffness: f64 = 20.0 => OptionSpec::number("bend-stiffness", "K", Domain::NonNegative);
        with springs: Springs = Springs { stiffness: 500.0, damping: 0.1, law: SpringLaw::Hooke };
        with timeline: Timeline = Timeline::of("symplectic-euler", 3.0);
    }
}

const TIME_STEP: f64 = 0.005;

impl Generator for Cloth {
    fn size(&self) -> Result<Size, GenerateError> {
        let [nx, ny] = [count("nx", self.nx, 1)?, count("ny", self.ny, 1)?];
        let structural = nx * (ny + 1) + (nx + 1) * ny;
        let bend = match self.bend_stiffness {
            0.0 => 0,
            _ => (nx - 1) * (ny + 1) + (nx + 1) * (ny - 1),
        };
        let particles = (nx + 1) * (ny + 1);
        Ok(Size { particles, pairs: structural + 2 * nx * ny + bend })
    }

    fn scene(&self) -> Result<Scene, GenerateError> {
        let dimension = if self.tilt == 0.0 { Dimension::Two } else { Dimension::Three };
        let size = self.size()?;
        let mut builder = SceneBuilder::new("cloth", size, dimension, &self.timeline)?;
        self.check()?;

        let [nx, ny] = [self.nx, self.ny].map(|cells| cells as usize);
        let [dx, dy] = [self.width / nx as f64, self.height / ny as f64];
        let radius = builder.set_drawing_scale(dx.min(dy));
        let mass = self.density * self.width * self.height / size.particles as f64;
        let (sine, cosine) = self.tilt.to_radians().sin_cos();
        for row in 0..=ny {
            let down = row as f64 * dy;
            let [y, z] = match dimension {
                Dimension::Two => [-down, 0.0],
                Dimension::Three => [round_decimals(-down * cosine), round_decimals(down * sine)],
            };
            for column in 0..=nx {
                let x = column as f64 * dx - 0.5 * self.width;
                let mut knot = particle(mass, [x, y, z], radius);
                knot.fixed = row == 0 && (column == 0 || column == nx);
                builder.particle(knot);
            }
        }
        let id = |column: usize, row: usize| row * (nx + 1) + column;
        let diagonal = dx.hypot(dy);
        let bend = Springs { stiffness: self.bend_stiffness, ..self.springs.clone() };
        // By kind: columns and rows to step, rest length, law.
        let mut kinds = vec![
            ((1, 0), dx, &self.springs),
            ((0, 1), dy, &self.springs),
            ((1, 1), diagonal, &self.springs),
            ((-1, 1), diagonal, &self.springs),
        ];
        if self.bend_stiffness != 0.0 {
            kinds.extend([((2, 0), 2.0 * dx, &bend), ((0, 2), 2.0 * dy, &bend)]);
        }
        for ((right, down), rest_length, springs) in kinds {
            for row in 0..=ny {
                for column in 0..=nx {
                    let other = column.checked_add_signed(right).filter(|other| *other <= nx);
                    if let (Some(other), true) = (other, row + down <= ny) {
                        let pair = [id(column, row), id(other, row + down)];
                        builder.spring(pair, rest_length, springs);
                    }
                }
            }
        }
        builder.gravity(self.gravity);
        let half = 0.5 * self.width;
        builder.viewport([-half, -1.1 * self.height], [half, 0.1 * self.height]);
        let description = format!("A cloth of {nx} by {ny} cells hangs by two corners.");
        Ok(builder.finish(&self.timeline, TIME_STEP, description)?)
    }
}
