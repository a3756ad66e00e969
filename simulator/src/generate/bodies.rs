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

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};

use super::builder::{SceneBuilder, particle};
use super::error::{GenerateErrorKind, check, count};
use super::random::Random;
use super::timeline::round_down;
use super::{GenerateError, Generator, Size, Springs, Timeline};
use scene::schema::Domain;
use scene::{Dimension, Particle, Scene};

/// Random bodies that attract each other.
#[derive(Debug, Clone, PartialEq, Args)]
pub struct Bodies {
    /// Bodies beside the one in the middle.
    #[arg(short = 'n', long, value_name = "COUNT", default_value_t = Bodies::default().bodies)]
    pub bodies: u64,
    /// Seed of the random numbers; the same seed gives the same bytes.
    #[arg(long, value_name = "NUMBER", default_value_t = Bodies::default().seed)]
    pub seed: u64,
    /// A disc, or a ball.
    #[arg(long, value_name = "2|3", default_value = "3", value_parser = PossibleValuesParser::new(["2", "3"]).map(dimension_of))]
    pub dimension: Dimension,
    /// Radius of the disc or ball they start in.
    #[arg(long, value_name = "M", default_value_t = Bodies::default().radius)]
    pub radius: f64,
    /// The least distance of two of them at the start.
    #[arg(long, value_name = "M", default_value_t = Bodies::default().min_distance)]
    pub min_distance: f64,
    /// Mean mass; each lies between half and one and a half times it.
    #[arg(long, value_name = "KG", default_value_t = Bodies::default().mass)]
    pub mass: f64,
    /// Mass of a heavy one in the middle, on top of the others; 0 for none.
    #[arg(long, value_name = "KG", default_value_t = Bodies::default().central_mass)]
    pub central_mass: f64,
    /// Gravitational constant.
    #[arg(short = 'G', long, value_name = "G", default_value_t = Bodies::default().gravitation)]
    pub gravitation: f64,
    /// Twice the kinetic by the potential energy: 0 at rest, 1 in equilibrium, 2 no longer bound.
    #[arg(long, value_name = "RATIO", default_value_t = Bodies::default().virial)]
    pub virial: f64,
    /// Integrator, time step and duration.
    #[command(flatten)]
    pub timeline: Timeline,
}

impl Default for Bodies {
    fn default() -> Self {
        Self {
            bodies: 16,
            dimension: Dimension::Three,
            radius: 4.0,
            min_distance: 1.0,
            mass: 0.01,
            central_mass: 100.0,
            gravitation: 1.0,
            virial: 1.0,
            seed: 1,
            timeline: Timeline::of("symplectic-euler", 5.0),
        }
    }
}

/// Random places tried for a body before it is an error.
const MAX_TRIES: u32 = 2000;

/// The dimension of a disc or a ball.
fn dimension_of(text: String) -> Dimension {
    if text == "2" { Dimension::Two } else { Dimension::Three }
}

impl Generator for Bodies {
    fn size(&self) -> Result<Size, GenerateError> {
        let n = count("bodies", self.bodies, 2)? + u64::from(self.central_mass != 0.0);
        Ok(Size { particles: n, pairs: n * (n - 1) / 2 })
    }

    fn scene(&self) -> Result<Scene, GenerateError> {
        let mut builder =
            SceneBuilder::new("bodies", self.size()?, self.dimension, &self.timeline)?;
        check("radius", self.radius, Domain::Positive)?;
        check("min-distance", self.min_distance, Domain::Positive)?;
        check("mass", self.mass, Domain::Positive)?;
        check("central-mass", self.central_mass, Domain::NonNegative)?;
        check("gravitation", self.gravitation, Domain::Positive)?;
        check("virial", self.virial, Domain::NonNegative)?;

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

    fn common(&self) -> (&Timeline, Option<&Springs>) {
        (&self.timeline, None)
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
