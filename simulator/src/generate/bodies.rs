//! Bodies: random small bodies around a heavy one, all attracting each other.
//!
//! ```text
//!       o    o         n bodies at random places of a disc, or a ball, and a heavy one (@) at its
//!     o    @    o      centre, the origin; no two closer than a stated distance. Gravitation between
//!        o   o         each two. Without the heavy one, a cluster whose close encounters need short
//!      o     o         time steps.
//!
//!     particles p = n + 1 (n without the heavy one)        pairs p(p−1)/2
//! ```
//!
//! The n masses lie uniformly between half and one and a half times `mass`. With `a` the acceleration
//! that all others give a body, it starts at right angles to its place x, counterclockwise about z, at
//! the speed of a circular orbit, |v|² = −a·x. Then the mean velocity is taken away, so that the momentum
//! is zero up to rounding, and all velocities are scaled until kinetic energy K and potential energy U
//! are in the ratio
//!
//! ```text
//! 2 K / |U| = virial        1: in equilibrium; below 2: bound; 0: at rest
//! ```
//!
//! Everything follows from the seed and the options, by arithmetic and square roots alone: the same
//! seed is the same scene on every machine.

use super::builder::{SceneBuilder, particle};
use super::error::{GenerateErrorKind, count};
use super::options::{OptionSpec, Options, options};
use super::random::Random;
use super::timeline::round_down;
use super::{GenerateError, Generator, Size, Timeline};
use scene::schema::Domain;
use scene::{Dimension, Particle, Scene};

options! {
    /// Random bodies that attract each other.
    pub struct Bodies {
        /// Bodies around the one in the middle.
        bodies: u64 = 16 => OptionSpec::value("bodies", "COUNT").short('n');
        /// Seed of the random numbers; the same seed gives the same bytes.
        seed: u64 = 1 => OptionSpec::value("seed", "NUMBER");
        /// A disc, or a ball.
        dimension: Dimension = Dimension::Three => OptionSpec::value("dimension", "2|3");
        /// Radius of the disc or ball they start in.
        radius: f64 = 4.0 => OptionSpec::number("radius", "M", Domain::Positive);
        /// The least distance of two of them at the start.
        min_distance: f64 = 1.0 => OptionSpec::number("min-distance", "M", Domain::Positive);
        /// Mean mass; each lies between half and one and a half times it.
        mass: f64 = 0.01 => OptionSpec::number("mass", "KG", Domain::Positive);
        /// Mass of a heavy one in the middle, on top of the others; 0 for none.
        central_mass: f64 = 100.0 => OptionSpec::number("central-mass", "KG", Domain::NonNegative);
        /// Gravitational constant.
        gravitation: f64 = 1.0 => OptionSpec::number("gravitation", "G", Domain::Positive).short('G');
        /// Twice the kinetic by the potential energy: 0 at rest, 1 in equilibrium, 2 no longer bound.
        virial: f64 = 1.0 => OptionSpec::number("virial", "RATIO", Domain::NonNegative);
        with timeline: Timeline = Timeline::of("symplectic-euler", 5.0);
    }
}

/// Random places tried for a body before it is an error.
const MAX_TRIES: u32 = 2000;

impl Generator for Bodies {
    fn size(&self) -> Result<Size, GenerateError> {
        let n = count("bodies", self.bodies, 2)? + u64::from(self.central_mass != 0.0);
        Ok(Size { particles: n, pairs: n * (n - 1) / 2 })
    }

    fn scene(&self) -> Result<Scene, GenerateError> {
        let mut builder =
            SceneBuilder::new("bodies", self.size()?, self.dimension, &self.timeline)?;
        self.check()?;

        let drawn = 0.1 * self.min_distance;
        let mut random = Random(self.seed);
        if self.central_mass != 0.0 {
            builder.particle(particle(self.central_mass, [0.0; 3], 2.0 * drawn));
        }
        for _ in 0..self.bodies {
            let place = self.place(&builder.scene.particles, &mut random)?;
            let mass = self.mass * (1.0 + 0.5 * random.signed());
            builder.particle(particle(mass, place, drawn));
        }
        self.set_moving(&mut builder.scene.particles);
        builder.gravitation(self.gravitation);
        builder.viewport([-self.radius; 2], [self.radius; 2]);
        // A small part of the time in which two that are as close as can be would go around each other.
        let masses = self.mass + self.central_mass.max(self.mass);
        let fastest = (self.min_distance.powi(3) / (self.gravitation * masses)).sqrt();
        let time_step = round_down(0.01 * fastest);
        let (bodies, seed) = (self.bodies, self.seed);
        let description = format!("{bodies} random bodies attract each other (seed {seed}).");
        Ok(builder.finish(&self.timeline, time_step, description)?)
    }
}

impl Bodies {
    /// A place far enough from all others, drawn until there is one.
    fn place(
        &self,
        others: &[Particle],
        random: &mut Random,
    ) -> Result<[f64; 3], GenerateErrorKind> {
        let mut draws = (0..MAX_TRIES)
            .map(|_| random.in_ball(self.dimension.count()).map(|part| self.radius * part));
        let is_free = |place: &[f64; 3]| {
            others.iter().all(|other| distance(place, &other.position) >= self.min_distance)
        };
        draws.find(is_free).ok_or(GenerateErrorKind::NoRoom {
            bodies: self.bodies,
            min_distance: self.min_distance,
            radius: self.radius,
        })
    }

    /// Sends all bodies around the origin, without a momentum, and with the ratio of energies asked
    /// for.
    fn set_moving(&self, particles: &mut [Particle]) {
        // Each body's −a·x, and the potential energy: every pair counts in it twice.
        let mut inwards = vec![0.0; particles.len()];
        let mut twice_potential = 0.0;
        for (body, inwards) in particles.iter().zip(&mut inwards) {
            for other in particles.iter().filter(|other| !std::ptr::eq(*other, body)) {
                let distance = distance(&body.position, &other.position);
                let pull = self.gravitation * other.mass / distance;
                twice_potential += pull * body.mass;
                for (x, y) in body.position.iter().zip(&other.position) {
                    *inwards += pull * (x - y) / distance * x / distance;
                }
            }
        }
        for (body, inwards) in particles.iter_mut().zip(inwards) {
            let [x, y, _] = body.position;
            let off_axis = (x * x + y * y).sqrt();
            if off_axis > 0.0 {
                let speed = f64::max(inwards, 0.0).sqrt();
                body.velocity = [-y / off_axis * speed, x / off_axis * speed, 0.0];
            }
        }
        let total: f64 = particles.iter().map(|body| body.mass).sum();
        for axis in 0..3 {
            let momentum: f64 = particles.iter().map(|body| body.mass * body.velocity[axis]).sum();
            particles.iter_mut().for_each(|body| body.velocity[axis] -= momentum / total);
        }
        let squared = |body: &Particle| body.velocity.iter().map(|v| v * v).sum::<f64>();
        let twice_kinetic: f64 = particles.iter().map(|body| body.mass * squared(body)).sum();
        // Two that share a place on their orbit would be at rest, and stay so.
        if twice_kinetic > 0.0 {
            let scale = (self.virial * 0.5 * twice_potential / twice_kinetic).sqrt();
            for body in particles {
                body.velocity = body.velocity.map(|component| component * scale);
            }
        }
    }
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
    squares.sum::<f64>().sqrt()
}
