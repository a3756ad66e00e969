//! Writes a scene as XML: the inverse of the [parser](super::xml).
//!
//! ```text
//! parse(write(scene)) == scene        but for the scene's name and the places of its elements
//! ```
//!
//! An element a line, in the order description, timeline, camera, particles, edges, forces, colours.
//! Numbers are the shortest decimals that read back to the same f64. Attributes that hold what the
//! parser assumes in their absence are left out; `pz` and `vz` stand in every particle of a scene of
//! three dimensions, and in none of two. Time is in proportion to the scene, memory to its longest line.

use std::fmt::Write as _;
use std::io::{self, Write};

use super::schema::{Coordinate, OptionSchema, OptionValue, Stencil};
use super::{
    Color, Dimension, EDGE_RADIUS, Edge, ForceElement, PARTICLE_RADIUS, Particle, Rendering, Scene,
};

/// A scene that cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The output takes no more.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// A number that no scene file can hold.
    #[error("<{tag}> {attribute} is {value}; a scene file holds finite numbers only")]
    NotFinite {
        /// The element.
        tag: &'static str,
        /// Its attribute.
        attribute: &'static str,
        /// Infinite, or not a number.
        value: f64,
    },
    /// A character that no XML file can hold.
    #[error("<{tag}> {attribute} holds the character {character:?}, which XML cannot express")]
    Character {
        /// The element.
        tag: &'static str,
        /// Its attribute.
        attribute: &'static str,
        /// A control character, or one that Unicode does not assign.
        character: char,
    },
    /// A force without its target.
    #[error("<{tag}>, force {force} of the scene, lacks the {missing} it acts on")]
    NoTarget {
        /// The element.
        tag: &'static str,
        /// Its number among the scene's forces.
        force: usize,
        /// The target that its schema requires.
        missing: &'static str,
    },
}

/// Writes `scene` to `output`, a line at a time.
///
/// # Errors
/// If the output takes no more, or the scene holds what its file format cannot express; the output
/// then ends after a whole line.
pub fn write(scene: &Scene, output: impl Write) -> Result<(), WriteError> {
    let Scene {
        name: _,
        description,
        tag,
        dimension,
        duration,
        time_step,
        integrator,
        integrator_options,
        max_simulation_frequency,
        particles,
        edges,
        forces,
        rendering,
    } = scene;
    let mut lines = Lines { output, line: String::new(), tag: "" };
    lines.output.write_all(b"<scene>\n")?;
    if let Some(text) = description {
        lines.element("description", |line| line.text("text", text))?;
    }
    if let Some(text) = tag {
        lines.element("scenetag", |line| line.text("tag", text))?;
    }
    lines.element("duration", |line| line.number("time", *duration))?;
    lines.element("integrator", |line| {
        line.text("type", integrator.name)?;
        line.number("dt", *time_step)?;
        for (option, value) in integrator_options.iter() {
            line.option(option, value)?;
        }
        Ok(())
    })?;
    if let Some(max) = max_simulation_frequency {
        lines.element("maxsimfreq", |line| line.number("max", *max))?;
    }
    lines.camera(rendering)?;
    for particle in particles {
        lines.element("particle", |line| line.particle(particle, *dimension))?;
    }
    for edge in edges {
        lines.element("edge", |line| line.edge(edge))?;
    }
    for (number, force) in forces.iter().enumerate() {
        lines.element(force.schema.tag, |line| line.force(number, force, scene))?;
    }
    lines.colors(rendering)?;
    lines.output.write_all(b"</scene>\n")?;
    lines.output.flush()?;
    Ok(())
}

/// How many bytes [`write()`] writes.
///
/// # Errors
/// If the scene cannot be expressed in the file format.
pub fn size(scene: &Scene) -> Result<u64, WriteError> {
    let mut counter = Counter(0);
    write(scene, &mut counter)?;
    Ok(counter.0)
}

/// Counts bytes.
struct Counter(u64);

impl Write for Counter {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0 += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// The output, and the line that is being put together.
struct Lines<W> {
    output: W,
    line: String,
    tag: &'static str,
}

impl<W: Write> Lines<W> {
    fn element(
        &mut self,
        tag: &'static str,
        attributes: impl FnOnce(&mut Self) -> Result<(), WriteError>,
    ) -> Result<(), WriteError> {
        self.tag = tag;
        self.line.clear();
        self.line.push_str("  <");
        self.line.push_str(tag);
        attributes(self)?;
        self.line.push_str("/>\n");
        self.output.write_all(self.line.as_bytes())?;
        Ok(())
    }

    fn camera(&mut self, rendering: &Rendering) -> Result<(), WriteError> {
        if let Some(viewport) = &rendering.viewport {
            self.element("viewport", |line| {
                line.number("cx", viewport.center[0])?;
                line.number("cy", viewport.center[1])?;
                line.number("size", viewport.size)
            })?;
        }
        match &rendering.background {
            Some(color) => self.element("backgroundcolor", |line| line.color(color)),
            None => Ok(()),
        }
    }

    fn colors(&mut self, rendering: &Rendering) -> Result<(), WriteError> {
        for (tag, colors) in
            [("particlecolor", &rendering.particle_colors), ("edgecolor", &rendering.edge_colors)]
        {
            for (index, color) in colors {
                self.element(tag, |line| {
                    line.index("i", *index);
                    line.color(color)
                })?;
            }
        }
        for path in &rendering.particle_paths {
            self.element("particlepath", |line| {
                line.index("i", path.particle);
                line.number("duration", path.duration)?;
                line.color(&path.color)
            })?;
        }
        Ok(())
    }

    fn particle(&mut self, particle: &Particle, dimension: Dimension) -> Result<(), WriteError> {
        let Particle { mass, position, velocity, fixed, radius, tag } = particle;
        let axes = dimension.count();
        self.number("m", *mass)?;
        for (attribute, value) in ["px", "py", "pz"].into_iter().zip(position).take(axes) {
            self.number(attribute, *value)?;
        }
        for (attribute, value) in ["vx", "vy", "vz"].into_iter().zip(velocity).take(axes) {
            self.number(attribute, *value)?;
        }
        self.index("fixed", usize::from(*fixed));
        self.number_unless("radius", *radius, Some(PARTICLE_RADIUS))?;
        match tag {
            Some(tag) => self.text("tag", tag),
            None => Ok(()),
        }
    }

    fn edge(&mut self, Edge { particles: [i, j], radius }: &Edge) -> Result<(), WriteError> {
        self.index("i", *i);
        self.index("j", *j);
        self.number_unless("radius", *radius, Some(EDGE_RADIUS))
    }

    fn force(
        &mut self,
        number: usize,
        force: &ForceElement,
        scene: &Scene,
    ) -> Result<(), WriteError> {
        let tag = self.tag;
        let no = |missing| WriteError::NoTarget { tag, force: number, missing };
        match force.schema.stencil {
            Stencil::EveryParticle => {}
            Stencil::Named(attributes) if attributes.len() != force.particles.len() => {
                return Err(no("particles"));
            }
            Stencil::Named(attributes) => {
                for (attribute, particle) in attributes.iter().zip(&force.particles) {
                    self.index(attribute, *particle);
                }
            }
            Stencil::Edge => self.index("edge", force.edge.ok_or_else(|| no("edge"))?),
        }
        for (parameter, value) in force.schema.parameters.iter().zip(&force.parameters) {
            if scene.dimension == Dimension::Three || !parameter.three_dimensional {
                let initial = parameter.coordinate.map(|Coordinate { particle, axis }| {
                    scene.particles[force.particles[particle]].position[axis]
                });
                self.number_unless(parameter.name, *value, parameter.default.or(initial))?;
            }
        }
        Ok(())
    }

    fn option(&mut self, option: &OptionSchema, value: OptionValue) -> Result<(), WriteError> {
        if value == option.kind.default() {
            return Ok(());
        }
        match value {
            OptionValue::Number(value) => self.number(option.name, value),
            OptionValue::Choice(word) => self.text(option.name, word),
            OptionValue::Count(count) => {
                self.open(option.name);
                // A string takes everything.
                let _ = write!(self.line, "{count}\"");
                Ok(())
            }
        }
    }

    fn color(&mut self, color: &Color) -> Result<(), WriteError> {
        self.number("r", color.r)?;
        self.number("g", color.g)?;
        self.number("b", color.b)
    }

    fn number(&mut self, attribute: &'static str, value: f64) -> Result<(), WriteError> {
        if !value.is_finite() {
            return Err(WriteError::NotFinite { tag: self.tag, attribute, value });
        }
        self.open(attribute);
        self.line.push_str(ryu::Buffer::new().format_finite(value));
        self.line.push('"');
        Ok(())
    }

    /// Nothing where the value is, to the bit, what stands for a missing attribute.
    fn number_unless(
        &mut self,
        attribute: &'static str,
        value: f64,
        default: Option<f64>,
    ) -> Result<(), WriteError> {
        match default {
            Some(default) if default.to_bits() == value.to_bits() => Ok(()),
            _ => self.number(attribute, value),
        }
    }

    fn index(&mut self, attribute: &'static str, value: usize) {
        self.open(attribute);
        // A string takes everything.
        let _ = write!(self.line, "{value}\"");
    }

    fn text(&mut self, attribute: &'static str, text: &str) -> Result<(), WriteError> {
        self.open(attribute);
        for character in text.chars() {
            match character {
                '&' => self.line.push_str("&amp;"),
                '<' => self.line.push_str("&lt;"),
                '>' => self.line.push_str("&gt;"),
                '"' => self.line.push_str("&quot;"),
                // As they are, a reader would make spaces of them.
                '\t' => self.line.push_str("&#9;"),
                '\n' => self.line.push_str("&#10;"),
                '\r' => self.line.push_str("&#13;"),
                '\0'..='\x1f' | '\u{fffe}' | '\u{ffff}' => {
                    return Err(WriteError::Character { tag: self.tag, attribute, character });
                }
                _ => self.line.push(character),
            }
        }
        self.line.push('"');
        Ok(())
    }

    fn open(&mut self, attribute: &str) {
        self.line.push(' ');
        self.line.push_str(attribute);
        self.line.push_str("=\"");
    }
}
