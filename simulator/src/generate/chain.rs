//! Chain: links that swing from a fixed end.
//!
//! ```text
//!   #          The fixed end (#) is at the origin. Link i of n starts at rest length and points at the
//!    \         angle θ_i from straight down, towards +x:
//!     o
//!      \           θ_i = angle · (1 − sag · i/(n−1))        i = 0 … n−1
//!       |
//!       o      A sag of 0 is a straight line; with a sag of 1 the last link hangs straight down.
//!
//!              particles n + 1        springs n
//! ```
//!
//! Every particle has the mass `mass`; the rest length of a link is `length / n`. The uppermost spring
//! carries them all: at rest it is stretched by `n · mass · gravity / stiffness`.

use clap::Args;

use super::builder::{SceneBuilder, particle, round_decimals};
use super::error::{check, count};
use super::{GRAVITY, GenerateError, Generator, Size, SpringLaw, Springs, Timeline};
use scene::schema::Domain;
use scene::{Dimension, Scene};

/// A hanging chain.
#[derive(Debug, Clone, PartialEq, Args)]
pub struct Chain {
    /// Links.
    #[arg(short = 'n', long, value_name = "COUNT", default_value_t = Chain::default().links)]
    pub links: u64,
    /// Length of the whole at rest.
    #[arg(long, value_name = "M", default_value_t = Chain::default().length)]
    pub length: f64,
    /// Mass of each particle.
    #[arg(long, value_name = "KG", default_value_t = Chain::default().mass)]
    pub mass: f64,
    /// Direction of the first link, from straight down towards +x.
    #[arg(long, value_name = "DEGREES", default_value_t = Chain::default().angle)]
    pub angle: f64,
    /// Part of the angle that is lost along the chain: 0 is a straight line, with 1 its end hangs down.
    #[arg(long, value_name = "0..1", default_value_t = Chain::default().sag)]
    pub sag: f64,
    /// Acceleration downwards.
    #[arg(long, value_name = "M_PER_S2", default_value_t = Chain::default().gravity)]
    pub gravity: f64,
    /// The springs.
    #[command(flatten)]
    pub springs: Springs,
    /// Integrator, time step and duration.
    #[command(flatten)]
    pub timeline: Timeline,
}

impl Default for Chain {
    fn default() -> Self {
        Self {
            links: 12,
            length: 1.0,
            mass: 0.05,
            angle: 80.0,
            sag: 0.5,
            gravity: GRAVITY,
            springs: Springs { stiffness: 2000.0, damping: 0.5, law: SpringLaw::Hooke },
            timeline: Timeline::of("linearized-implicit-euler", 4.0),
        }
    }
}

const TIME_STEP: f64 = 0.005;

impl Generator for Chain {
    fn size(&self) -> Result<Size, GenerateError> {
        let n = count("links", self.links, 1)?;
        Ok(Size { particles: n + 1, pairs: n })
    }

    fn scene(&self) -> Result<Scene, GenerateError> {
        let mut builder = SceneBuilder::new("chain", self.size()?, Dimension::Two, &self.timeline)?;
        check("length", self.length, Domain::Positive)?;
        check("mass", self.mass, Domain::Positive)?;
        check("angle", self.angle, Domain::Finite)?;
        check("sag", self.sag, Domain::UnitInterval)?;
        check("gravity", self.gravity, Domain::Finite)?;
        self.springs.check()?;

        let n = self.links as usize;
        let link = self.length / n as f64;
        let radius = builder.set_drawing_scale(link);
        let mut end = particle(self.mass, [0.0; 3], radius);
        end.fixed = true;
        builder.particle(end);
        let [mut x, mut y] = [0.0, 0.0];
        for i in 0..n {
            let along = i as f64 / (n - 1).max(1) as f64;
            let (sine, cosine) = (self.angle * (1.0 - self.sag * along)).to_radians().sin_cos();
            x += link * sine;
            y -= link * cosine;
            builder.particle(particle(
                self.mass,
                [round_decimals(x), round_decimals(y), 0.0],
                radius,
            ));
            builder.spring([i, i + 1], link, &self.springs);
        }
        builder.gravity(self.gravity);
        builder.viewport([-self.length; 2], [self.length; 2]);
        let description = format!("A chain of {n} links swings from a fixed end.");
        Ok(builder.finish(&self.timeline, TIME_STEP, description)?)
    }

    fn common(&self) -> (&Timeline, Option<&Springs>) {
        (&self.timeline, Some(&self.springs))
    }
}
