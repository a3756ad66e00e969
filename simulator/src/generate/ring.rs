//! Ring: a spinning hoop, or a wheel with spokes.
//!
//! ```text
//!      o---o          n particles evenly on a circle around the origin, springs between neighbours,
//!     / \ / \         all at rest length; with spokes, a hub at the origin, free as the others.
//!    o---+---o        The whole turns counterclockwise: v = spin × x.
//!     \ / \ /
//!      o---o          particles n, or n + 1 with a hub        springs n, or 2n
//! ```
//!
//! Every particle has the mass `mass`. Momentum is zero, up to rounding; angular momentum
//! `n · mass · radius² · spin` stays as it is under every method that keeps it.

use std::f64::consts::PI;

use super::builder::{SceneBuilder, particle, round_decimals};
use super::error::count;
use super::options::{OptionSpec, Options, options};
use super::{GenerateError, Generator, Size, SpringLaw, Springs, Timeline};
use scene::schema::Domain;
use scene::{Dimension, Scene};

options! {
    /// A ring, or a wheel.
    pub struct Ring {
        /// Particles on the circle.
        particles: u64 = 24 => OptionSpec::value("particles", "COUNT").short('n');
        /// Radius of the circle.
        radius: f64 = 1.0 => OptionSpec::number("radius", "M", Domain::Positive);
        /// Mass of each particle.
        mass: f64 = 0.1 => OptionSpec::number("mass", "KG", Domain::Positive);
        /// Angular velocity, counterclockwise.
        spin: f64 = 2.0 => OptionSpec::number("spin", "RAD_PER_S", Domain::Finite);
        /// Add a hub, and springs from it to all.
        spokes: bool = false => OptionSpec::flag("spokes");
        with springs: Springs = Springs { stiffness: 200.0, damping: 0.1, law: SpringLaw::Hooke };
        with timeline: Timeline = Timeline::of("symplectic-euler", 5.0);
    }
}

const TIME_STEP: f64 = 0.005;

impl Generator for Ring {
    fn size(&self) -> Result<Size, GenerateError> {
        let n = count("particles", self.particles, 3)?;
        let hub = u64::from(self.spokes);
        Ok(Size { particles: n + hub, pairs: n + hub * n })
    }

    fn scene(&self) -> Result<Scene, GenerateError> {
        let mut builder = SceneBuilder::new("ring", self.size()?, Dimension::Two, &self.timeline)?;
        self.check()?;

        let n = self.particles as usize;
        let chord = round_decimals(2.0 * self.radius * (PI / n as f64).sin());
        let drawn = builder.set_drawing_scale(chord);
        for i in 0..n {
            let (sine, cosine) = (2.0 * PI * (i as f64 / n as f64)).sin_cos();
            let [x, y] = [cosine, sine].map(|of_one| round_decimals(self.radius * of_one));
            let mut bead = particle(self.mass, [x, y, 0.0], drawn);
            bead.velocity = [-self.spin * y, self.spin * x, 0.0];
            builder.particle(bead);
        }
        for i in 0..n {
            builder.spring([i, (i + 1) % n], chord, &self.springs);
        }
        if self.spokes {
            builder.particle(particle(self.mass, [0.0; 3], drawn));
            for i in 0..n {
                builder.spring([n, i], self.radius, &self.springs);
            }
        }
        builder.viewport([-1.2 * self.radius; 2], [1.2 * self.radius; 2]);
        let what = if self.spokes { "wheel" } else { "ring" };
        let description = format!("A {what} of {n} particles spins freely.");
        Ok(builder.finish(&self.timeline, TIME_STEP, description)?)
    }
}
