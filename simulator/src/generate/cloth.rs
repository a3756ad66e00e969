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

use clap::Args;

use super::builder::{SceneBuilder, particle, round_decimals};
use super::error::{check, count};
use super::{GRAVITY, GenerateError, Generator, Size, SpringLaw, Springs, Timeline};
use scene::schema::Domain;
use scene::{Dimension, Scene};

/// A hanging cloth.
#[derive(Debug, Clone, PartialEq, Args)]
pub struct Cloth {
    /// Cells along the fixed edge.
    #[arg(long, value_name = "COUNT", default_value_t = Cloth::default().nx)]
    pub nx: u64,
    /// Cells down from it.
    #[arg(long, value_name = "COUNT", default_value_t = Cloth::default().ny)]
    pub ny: u64,
    /// Length of the fixed edge.
    #[arg(long, value_name = "M", default_value_t = Cloth::default().width)]
    pub width: f64,
    /// Length down from it.
    #[arg(long, value_name = "M", default_value_t = Cloth::default().height)]
    pub height: f64,
    /// Mass of a square metre.
    #[arg(long, value_name = "KG_PER_M2", default_value_t = Cloth::default().density)]
    pub density: f64,
    /// Angle by which it is lifted from hanging straight down; 0 makes a scene of two dimensions.
    #[arg(long, value_name = "DEGREES", default_value_t = Cloth::default().tilt)]
    pub tilt: f64,
    /// Acceleration downwards.
    #[arg(long, value_name = "M_PER_S2", default_value_t = Cloth::default().gravity)]
    pub gravity: f64,
    /// Stiffness of each bend spring, which has the damping of the others; 0 for none.
    #[arg(long, value_name = "K", default_value_t = Cloth::default().bend_stiffness)]
    pub bend_stiffness: f64,
    /// The structural and the shear springs.
    #[command(flatten)]
    pub springs: Springs,
    /// Integrator, time step and duration.
    #[command(flatten)]
    pub timeline: Timeline,
}

impl Default for Cloth {
    fn default() -> Self {
        Self {
            nx: 12,
            ny: 12,
            width: 1.0,
            height: 1.0,
            density: 1.0,
            tilt: 60.0,
            gravity: GRAVITY,
            springs: Springs { stiffness: 500.0, damping: 0.1, law: SpringLaw::Hooke },
            bend_stiffness: 20.0,
            timeline: Timeline::of("symplectic-euler", 3.0),
        }
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
        check("width", self.width, Domain::Positive)?;
        check("height", self.height, Domain::Positive)?;
        check("density", self.density, Domain::Positive)?;
        check("tilt", self.tilt, Domain::Finite)?;
        check("gravity", self.gravity, Domain::Finite)?;
        check("bend-stiffness", self.bend_stiffness, Domain::NonNegative)?;
        self.springs.check()?;

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

    fn common(&self) -> (&Timeline, Option<&Springs>) {
        (&self.timeline, Some(&self.springs))
    }
}
