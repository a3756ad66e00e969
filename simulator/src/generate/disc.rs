//! Disc: rings of triangles about a centre, spinning.
//!
//! ```text
//!       o---o          Ring i of n = 1 … has 6 i particles on the circle of radius `radius · i/n`, the first
//!      / \ / \         one towards +x. Between it and the ring inside lie 6 (2i − 1) triangles.
//!     o---o---o
//!      \ / \ /         particles 1 + 3n(n+1)        triangles 6n²
//!       o---o
//! ```
//!
//! The disc starts undeformed, turning about its centre with `spin`. Its mass is that of the polygon.

use std::f64::consts::PI;

use super::builder::{SceneBuilder, round_decimals};
use super::error::count;
use super::options::{OptionSpec, Options, options};
use super::{GenerateError, Generator, Material, Size, Timeline};
use scene::schema::Domain;
use scene::{Dimension, Scene};

options! {
    /// A disc of triangles.
    pub struct Disc {
        /// Rings about the centre.
        rings: u64 = 5 => OptionSpec::value("rings", "COUNT").short('n');
        /// Radius of the outermost ring.
        radius: f64 = 1.0 => OptionSpec::number("radius", "M", Domain::Positive);
        /// Angular velocity, counterclockwise.
        spin: f64 = 3.0 => OptionSpec::number("spin", "RAD_PER_S", Domain::Finite);
        with material: Material = Material::of(50.0);
        with timeline: Timeline = Timeline::of("symplectic-euler", 5.0);
    }
}

const TIME_STEP: f64 = 0.005;

impl Generator for Disc {
    fn size(&self) -> Result<Size, GenerateError> {
        let n = count("rings", self.rings, 1)?;
        Ok(Size { particles: 1 + 3 * n * (n + 1), pairs: 6 * n * n })
    }

    fn scene(&self) -> Result<Scene, GenerateError> {
        let mut builder = SceneBuilder::new("disc", self.size()?, Dimension::Two, &self.timeline)?;
        self.check()?;

        let n = self.rings as usize;
        let mut places = vec![[0.0; 2]];
        for ring in 1..=n {
            let radius = self.radius * (ring as f64 / n as f64);
            places.extend((0..6 * ring).map(|place| {
                let (sine, cosine) = (2.0 * PI * (place as f64 / (6 * ring) as f64)).sin_cos();
                [cosine, sine].map(|of_one| round_decimals(radius * of_one))
            }));
        }
        let triangles = (1..=n).flat_map(|ring| {
            (0..6).flat_map(move |sector| {
                let outer = move |place| on_ring(ring, sector * ring + place);
                let inner = move |place| on_ring(ring - 1, sector * (ring - 1) + place);
                let outward = (0..ring).map(move |k| [outer(k), outer(k + 1), inner(k)]);
                let inward = (1..ring).map(move |k| [outer(k), inner(k), inner(k - 1)]);
                outward.chain(inward)
            })
        });
        let radius = builder.set_drawing_scale(self.radius / n as f64);
        builder.body(&places, triangles, radius, &self.material.body());
        for particle in &mut builder.scene.particles {
            let [x, y, _] = particle.position;
            particle.velocity = [-self.spin * y, self.spin * x, 0.0];
        }
        builder.viewport([-1.2 * self.radius; 2], [1.2 * self.radius; 2]);
        let description = format!("A disc of {n} rings of triangles spins freely.");
        Ok(builder.finish(&self.timeline, TIME_STEP, description)?)
    }
}

/// The number of the particle at a place of a ring, which is a circle.
fn on_ring(ring: usize, place: usize) -> usize {
    match ring {
        0 => 0,
        _ => 1 + 3 * ring * (ring - 1) + place % (6 * ring),
    }
}
