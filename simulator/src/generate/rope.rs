//! Rope: bars with bending between them, hung by one end.
//!
//! ```text
//!   #          n bars of length h = length / n, which start in one line at `angle` from straight down, towards +x.
//!    \         The first particle (#) is at the origin and fixed; clamped, so is the second.
//!     o
//!      \       Each bar is an elastic spring of modulus `stretching`, each inner particle has a bending force of
//!       o      modulus `bending` and the angle at rest `curl / (n − 1)`: unloaded, the rope turns by `curl`.
//!
//!              particles n + 1      springs n      bending forces n − 1
//! ```
//!
//! Particles have the mass `density · h`, those of the ends half of it. A hinge α/(2h) per angle makes the bending stiffness
//! `EI = bending / 2`.

use super::builder::{SceneBuilder, particle, round_decimals};
use super::error::count;
use super::options::{OptionSpec, Options, options};
use super::{GRAVITY, GenerateError, Generator, Size, Timeline};
use scene::schema::Domain;
use scene::{Dimension, Scene};

options! {
    /// A rope with bending.
    pub struct Rope {
        /// Bars.
        bars: u64 = 20 => OptionSpec::value("bars", "COUNT").short('n');
        /// Length of the whole at rest.
        length: f64 = 1.0 => OptionSpec::number("length", "M", Domain::Positive);
        /// Mass of a metre.
        density: f64 = 0.1 => OptionSpec::number("density", "KG_PER_M", Domain::Positive);
        /// Modulus of each bar: force per relative extension.
        stretching: f64 = 200.0 => OptionSpec::number("stretching", "N", Domain::NonNegative);
        /// Modulus of bending, twice the bending stiffness EI.
        bending: f64 = 0.01 => OptionSpec::number("bending", "N_M2", Domain::NonNegative);
        /// Angle by which the unloaded rope turns from its first bar to its last.
        curl: f64 = 0.0 => OptionSpec::number("curl", "DEGREES", Domain::Finite);
        /// Direction from straight down towards +x.
        angle: f64 = 80.0 => OptionSpec::number("angle", "DEGREES", Domain::Finite);
        /// Fix the first bar, not only its end.
        clamped: bool = false => OptionSpec::flag("clamp");
        /// Acceleration downwards.
        gravity: f64 = GRAVITY => OptionSpec::number("gravity", "M_PER_S2", Domain::Finite);
        with timeline: Timeline = Timeline::of("implicit-euler", 3.0);
    }
}

const TIME_STEP: f64 = 0.01;

impl Generator for Rope {
    fn size(&self) -> Result<Size, GenerateError> {
        let n = count("bars", self.bars, 2)?;
        Ok(Size { particles: n + 1, pairs: n })
    }

    fn scene(&self) -> Result<Scene, GenerateError> {
        let mut builder = SceneBuilder::new("rope", self.size()?, Dimension::Two, &self.timeline)?;
        self.check()?;

        let n = self.bars as usize;
        let h = self.length / n as f64;
        let radius = builder.set_drawing_scale(h);
        let (sine, cosine) = self.angle.to_radians().sin_cos();
        for i in 0..=n {
            let share = if i == 0 || i == n { 0.5 } else { 1.0 };
            let along = h * i as f64;
            let place = [round_decimals(along * sine), round_decimals(-along * cosine), 0.0];
            let mut joint = particle(self.density * h * share, place, radius);
            joint.fixed = i == 0 || (self.clamped && i == 1);
            builder.particle(joint);
        }
        for i in 0..n {
            let bar = [("alpha", self.stretching), ("l0", h)];
            builder.edge([i, i + 1]);
            builder.element("elasticbodyspringforce", &[i, i + 1], &bar);
        }
        let theta0 = self.curl.to_radians() / (n - 1) as f64;
        for i in 1..n {
            let hinge = [("alpha", self.bending), ("theta0", theta0)];
            builder.element("elasticbodybendingforce", &[i - 1, i, i + 1], &hinge);
        }
        builder.gravity(self.gravity);
        builder.viewport([-self.length; 2], [self.length; 2]);
        let description = format!("A rope of {n} bars with bending swings from a fixed end.");
        Ok(builder.finish(&self.timeline, TIME_STEP, description)?)
    }
}
