//! Square net: the elastic square of the slides.
//!
//! ```text
//!   o---o---o        n = 2 segments along each side of a square of side 1, centred at the origin.
//!   |\ /|\ /|        Springs along the rows, along the columns, and both diagonals of every cell,
//!   | X | X |        all at their rest length in the square; then x is multiplied by `stretch`.
//!   |/ \|/ \|
//!   o---o---o        Hung, it is not stretched, and its two upper corners are fixed, in gravity.
//!   |\ /|\ /|
//!   o---o---o        particles (n+1)²        springs 2n(n+1) + 2n² = 4n² + 2n
//! ```
//!
//! Each particle has the mass `density / (n+1)²`. Particles are numbered by columns from the left, each
//! from below. Source: CMU 15-362 (F24), special topics 4; the numbers and their order are those of the
//! peer script `gen_net.py`.

use super::builder::{SceneBuilder, particle};
use super::error::count;
use super::options::{OptionSpec, Options, Rule, options};
use super::{GRAVITY, GenerateError, Generator, Size, SpringLaw, Springs, Timeline};
use scene::schema::Domain;
use scene::{Color, Dimension, Scene, Viewport};

options! {
    /// A square net.
    pub struct Net {
        /// The net of the lecture, with its springs, integrator and time step: 4 segments, stretched. Frames with --size
        /// 900x900 look like the lecture's window.
        lecture: bool = false => OptionSpec::flag("lecture").rule(Rule::Alone);
        /// Segments along a side.
        segments: u64 = 8 => OptionSpec::value("segments", "COUNT").short('n');
        /// Hang it by its two upper corners, not stretched, in gravity.
        pinned: bool = false => OptionSpec::flag("pin");
        /// Factor of its initial x; 1 if it is not given with --pin.
        stretch: f64 = 1.4
            => OptionSpec::number("stretch", "FACTOR", Domain::Positive).rule(Rule::DefaultIf { option: "pin", is: "true", default: "1" });
        /// Mass of the whole; its side is 1.
        density: f64 = 1000.0 => OptionSpec::number("density", "KG_PER_M2", Domain::Positive);
        /// Acceleration downwards, with --pin.
        gravity: f64 = GRAVITY
            => OptionSpec::number("gravity", "M_PER_S2", Domain::Finite).rule(Rule::Needs("pin"));
        with springs: Springs = Springs { stiffness: 1e5, damping: 0.0, law: SpringLaw::Hooke };
        with timeline: Timeline = Timeline::of("linearized-implicit-euler", 1.0);
    }
}

/// The slides' time step.
const TIME_STEP: f64 = 0.004;

/// The window of the lecture's program.
const WINDOW: Window = Window {
    height: 900.0,
    scale: 200.0,
    line: 1.0,
    radius: 0.1,
    color: Color { r: 0.0, g: 0.0, b: 1.0 },
    background: Color { r: 1.0, g: 1.0, b: 1.0 },
};

/// A square window about the origin.
struct Window {
    /// In pixels; so is its width.
    height: f64,
    /// Pixels a metre.
    scale: f64,
    /// Width of a line, in pixels.
    line: f64,
    /// Radius of a particle, as a share of a segment.
    radius: f64,
    /// Of particles and lines.
    color: Color,
    background: Color,
}

impl Window {
    /// Lets the scene be drawn as this window shows it, in frames of its size.
    fn draw(&self, scene: &mut Scene, segment: f64) {
        let Self { height, scale, line, radius, color, background } = *self;
        scene.particles.iter_mut().for_each(|particle| particle.radius = radius * segment);
        scene.edges.iter_mut().for_each(|edge| edge.radius = 0.5 * line / scale);
        let colors = |count: usize| (0..count).map(|number| (number, color)).collect();
        scene.rendering.viewport = Some(Viewport { center: [0.0; 2], size: 0.5 * height / scale });
        scene.rendering.background = Some(background);
        scene.rendering.particle_colors = colors(scene.particles.len());
        scene.rendering.edge_colors = colors(scene.edges.len());
    }
}

impl Net {
    /// The net of the lecture: 20 steps of projected Newton, to its tolerance of 1e-2, on springs of squared length.
    pub fn of_the_lecture() -> Self {
        let springs = Springs { law: SpringLaw::Green, ..Self::default().springs };
        let timeline = Timeline {
            time_step: Some(TIME_STEP),
            ..Timeline::of("projected-newton", 20.0 * TIME_STEP)
        };
        Self { segments: 4, springs, timeline, ..Self::default() }
    }
}

impl Generator for Net {
    fn size(&self) -> Result<Size, GenerateError> {
        if self.lecture {
            return Self::of_the_lecture().size();
        }
        let n = count("segments", self.segments, 1)?;
        Ok(Size { particles: (n + 1) * (n + 1), pairs: 4 * n * n + 2 * n })
    }

    fn scene(&self) -> Result<Scene, GenerateError> {
        if self.lecture {
            let lecture = Self::of_the_lecture();
            let mut scene = lecture.scene()?;
            WINDOW.draw(&mut scene, 1.0 / lecture.segments as f64);
            return Ok(scene);
        }
        let mut builder = SceneBuilder::new("net", self.size()?, Dimension::Two, &self.timeline)?;
        self.check()?;

        let n = self.segments as usize;
        let side = n + 1;
        let mass = self.density / (side * side) as f64;
        let spacing = 1.0 / n as f64;
        let at = |step: usize| -0.5 + step as f64 * spacing;
        for column in 0..side {
            for row in 0..side {
                // 0.1 is the radius of a particle that names none.
                let mut corner = particle(mass, [self.stretch * at(column), at(row), 0.0], 0.1);
                corner.fixed = self.pinned && row == n && (column == 0 || column == n);
                builder.particle(corner);
            }
        }
        let id = |column: usize, row: usize| column * side + row;
        // Rest lengths are distances of the rounded coordinates, as the peer has them.
        let mut join = |(i, k): (usize, usize), (j, l): (usize, usize)| {
            let [dx, dy] = [at(i) - at(j), at(k) - at(l)];
            builder.spring([id(i, k), id(j, l)], (dx * dx + dy * dy).sqrt(), &self.springs);
        };
        for i in 0..n {
            (0..side).for_each(|k| join((i, k), (i + 1, k)));
        }
        for i in 0..side {
            (0..n).for_each(|k| join((i, k), (i, k + 1)));
        }
        for i in 0..n {
            for k in 0..n {
                join((i, k), (i + 1, k + 1));
                join((i + 1, k), (i, k + 1));
            }
        }
        if self.pinned {
            builder.gravity(self.gravity);
        }
        builder.scene.max_simulation_frequency = Some(500.0);
        let what = if self.pinned { "hung by its upper corners" } else { "stretched along x" };
        let description = format!("A square net of {n} by {n} cells, {what}.");
        Ok(builder.finish(&self.timeline, TIME_STEP, description)?)
    }
}
