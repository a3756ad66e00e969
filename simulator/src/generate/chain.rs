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

use super::builder::{SceneBuilder, particle, round_decimals};
use super::error::count;
use super::options::{OptionSpec, Options, options};
use super::{GRAVITY, GenerateError, Generator, Size, SpringLaw, Springs, Timeline};
use scene::schema::Domain;
use scene::{Dimension, Scene};

options! {
    /// A hanging chain.
    pub struct Chain {
        /// Links.
        links: u64 = 12 => OptionSpec::value("links", "COUNT").short('n');
        /// Length of the whole at rest.
        length: f64 = 1.0 => OptionSpec::number("length", "M", Domain::Positive);
        /// Mass of each particle.
        mass: f64 = 0.05 => OptionSpec::number("mass", "KG", Domain::Positive);
        /// Direction of the first link, from straight down towards +x.
        angle: f64 = 80.0 => OptionSpec::number("angle", "DEGREES", Domain::Finite);
        /// Part of the angle that is lost along the chain: 0 is a straight line, with 1 its end hangs down.
        sag: f64 = 0.5 => OptionSpec::number("sag", "0..1", Domain::UnitInterval);
        /// Acceleration downwards.
        gravity: f64 = GRAVITY => OptionSpec::number("gravity", "M_PER_S2", Domain::Finite);
        with springs: Springs = Springs { stiffness: 2000.0, damping: 0.5, law: SpringLaw::Hooke };
        with timeline: Timeline = Timeline::of("linearized-implicit-euler", 4.0);
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
        self.check()?;

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
}
