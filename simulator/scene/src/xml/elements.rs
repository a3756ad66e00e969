//! Parses each element of the XML schema.

use quick_xml::events::BytesStart;
use smallvec::SmallVec;

use super::attributes::Element;
use super::unresolved::{
    FROM_INITIAL, Once, Reference, UnresolvedForce, UnresolvedIntegrator, UnresolvedScene,
};
use super::{ELEMENTS, Parser, UNMODELLED, closest};
use crate::error::{Problem, SceneError};
use crate::schema::{Domain, ForceSchema, IntegratorOptions, OptionError};
use crate::{Color, EDGE_RADIUS, PARTICLE_RADIUS, Parameters, Particle, Viewport};

impl Parser<'_> {
    /// Reads the element that starts at `offset`, inside the root.
    pub(super) fn read_element(
        &mut self,
        start: &BytesStart<'_>,
        tag: &str,
        offset: usize,
    ) -> Result<(), SceneError> {
        if let Some(schema) = self.vocabulary.force(tag) {
            let element = self.element(start, schema.tag, offset)?;
            return self.force(&element, schema);
        }
        let Some(known) = ELEMENTS.iter().find(|&&element| element == tag).copied() else {
            return self.unknown_element(tag, offset);
        };
        let element = self.element(start, known, offset)?;
        let known_attributes: &[&str] = match known {
            "description" => {
                let text = self.text_of(&element, "text")?.to_owned();
                self.set_once(|draft| &mut draft.description, text, &element)?;
                &["text"]
            }
            "scenetag" => {
                let text = self.text_of(&element, "tag")?.to_owned();
                self.set_once(|draft| &mut draft.tag, text, &element)?;
                &["tag"]
            }
            "duration" => {
                let time = self.number(&element, "time", Domain::NonNegative)?;
                self.set_once(|draft| &mut draft.duration, time, &element)?;
                &["time"]
            }
            "integrator" => {
                let (integrator, attributes) = self.unresolved_integrator(&element)?;
                self.set_once(|draft| &mut draft.integrator, integrator, &element)?;
                return self.check_attributes(&element, &attributes);
            }
            "maxsimfreq" => {
                let max = self.number(&element, "max", Domain::NonNegative)?;
                self.set_once(|draft| &mut draft.max_simulation_frequency, max, &element)?;
                &["max"]
            }
            "particle" => {
                let particle = self.particle(&element)?;
                self.draft.particles.push(particle);
                &["m", "px", "py", "pz", "vx", "vy", "vz", "fixed", "radius", "tag"]
            }
            "edge" => {
                let ends = [self.reference(&element, "i")?, self.reference(&element, "j")?];
                self.check_distinct(&ends)?;
                let radius =
                    self.number_or(&element, "radius", Domain::NonNegative, EDGE_RADIUS)?;
                self.draft.edges.push((ends, radius));
                &["i", "j", "radius"]
            }
            "particlecolor" => {
                let color = (self.reference(&element, "i")?, self.color(&element)?);
                self.draft.particle_colors.push(color);
                &["i", "r", "g", "b"]
            }
            "edgecolor" => {
                let color = (self.reference(&element, "i")?, self.color(&element)?);
                self.draft.edge_colors.push(color);
                &["i", "r", "g", "b"]
            }
            "backgroundcolor" => {
                let color = self.color(&element)?;
                self.set_once(|draft| &mut draft.background, color, &element)?;
                &["r", "g", "b"]
            }
            "particlepath" => {
                let duration = self.number(&element, "duration", Domain::NonNegative)?;
                let path = (self.reference(&element, "i")?, duration, self.color(&element)?);
                self.draft.particle_paths.push(path);
                &["i", "duration", "r", "g", "b"]
            }
            "viewport" => {
                let center = [
                    self.number(&element, "cx", Domain::Finite)?,
                    self.number(&element, "cy", Domain::Finite)?,
                ];
                let size = self.number(&element, "size", Domain::Positive)?;
                self.set_once(|draft| &mut draft.viewport, Viewport { center, size }, &element)?;
                &["cx", "cy", "size"]
            }
            _ => return self.unknown_element(tag, offset),
        };
        self.check_attributes(&element, known_attributes)
    }

    fn unknown_element(&mut self, tag: &str, offset: usize) -> Result<(), SceneError> {
        let lower = tag.to_ascii_lowercase();
        // A warning that is not kept needs no suggestion.
        let suggestion = if self.keeps_warnings() || lower.ends_with("force") {
            let forces = self.vocabulary.forces.iter().map(|schema| schema.tag);
            let known: Vec<&'static str> = ELEMENTS.iter().copied().chain(forces).collect();
            closest(tag, &known)
        } else {
            None
        };
        let is_unmodelled = UNMODELLED.iter().any(|beginning| lower.starts_with(beginning))
            || (lower.ends_with("force") && suggestion.is_none());
        let tag = tag.to_owned();
        if is_unmodelled {
            return Err(self.error(offset, Problem::UnmodelledPhysics { tag }));
        }
        self.warn(offset, Problem::UnknownElement { tag, suggestion })
    }

    /// The integrator, and the attributes it has.
    fn unresolved_integrator(
        &mut self,
        element: &Element<'_>,
    ) -> Result<(UnresolvedIntegrator, Vec<&'static str>), SceneError> {
        let spelling = self.text_of(element, "type")?.trim().to_owned();
        let type_offset = element.find("type").map_or(element.offset, |attribute| attribute.offset);
        let time_step = self.number(element, "dt", Domain::Positive)?;
        let mut known = vec!["type", "dt"];
        let mut options = None;
        if let Some(schema) = self.vocabulary.integrator(&spelling) {
            let mut values = IntegratorOptions::defaults(schema);
            for option in schema.options {
                known.push(option.name);
                let Some(attribute) = element.find(option.name) else { continue };
                if let Err(OptionError::Value { must_be }) =
                    values.set(option.name, &attribute.value)
                {
                    return Err(self.out_of_domain(element, option.name, must_be));
                }
            }
            if let Some((option, must_be)) = values.excess() {
                return Err(self.out_of_domain(element, option.name, must_be));
            }
            options = Some(values);
        }
        Ok((UnresolvedIntegrator { spelling, type_offset, time_step, options }, known))
    }

    fn particle(&mut self, element: &Element<'_>) -> Result<Particle, SceneError> {
        let deep = element.find("pz").is_some() || element.find("vz").is_some();
        self.draft.three_dimensional |= deep;
        let fixed = match self.text_of(element, "fixed")?.trim() {
            "0" => false,
            "1" => true,
            _ => return Err(self.out_of_domain(element, "fixed", "0 (free) or 1 (fixed)")),
        };
        Ok(Particle {
            mass: self.number(element, "m", Domain::Positive)?,
            position: [
                self.number(element, "px", Domain::Finite)?,
                self.number(element, "py", Domain::Finite)?,
                self.number_or(element, "pz", Domain::Finite, 0.0)?,
            ],
            velocity: [
                self.number(element, "vx", Domain::Finite)?,
                self.number(element, "vy", Domain::Finite)?,
                self.number_or(element, "vz", Domain::Finite, 0.0)?,
            ],
            fixed,
            radius: self.number_or(element, "radius", Domain::NonNegative, PARTICLE_RADIUS)?,
            tag: element.find("tag").map(|attribute| attribute.value.to_string()),
        })
    }

    fn force(
        &mut self,
        element: &Element<'_>,
        schema: &'static ForceSchema,
    ) -> Result<(), SceneError> {
        let mut known = schema.stencil.attributes().to_vec();
        let mut stencil = SmallVec::with_capacity(known.len());
        for attribute in schema.stencil.attributes() {
            stencil.push(self.reference(element, attribute)?);
        }
        self.check_distinct(&stencil)?;
        let mut parameters = Parameters::with_capacity(schema.parameters.len());
        for parameter in schema.parameters {
            let given = element.find(parameter.name).is_some();
            self.draft.three_dimensional |= given && parameter.three_dimensional;
            let default = parameter.default.or(parameter.coordinate.map(|_| FROM_INITIAL));
            parameters.push(match default {
                Some(default) => {
                    self.number_or(element, parameter.name, parameter.domain, default)?
                }
                None => self.number(element, parameter.name, parameter.domain)?,
            });
            known.push(parameter.name);
        }
        known.extend(schema.ignored);
        let location = self.lines.locate(element.offset);
        self.draft.forces.push(UnresolvedForce { schema, stencil, parameters, location });
        self.check_attributes(element, &known)
    }

    fn color(&mut self, element: &Element<'_>) -> Result<Color, SceneError> {
        Ok(Color {
            r: self.number(element, "r", Domain::UnitInterval)?,
            g: self.number(element, "g", Domain::UnitInterval)?,
            b: self.number(element, "b", Domain::UnitInterval)?,
        })
    }

    /// An error at the first reference to a particle that the element has named before.
    fn check_distinct(&mut self, particles: &[Reference]) -> Result<(), SceneError> {
        for (number, Reference { index, tag, offset, .. }) in particles.iter().enumerate() {
            let same = |other: &&Reference| other.index == *index;
            if let Some(other) = particles[..number].iter().find(same) {
                let problem = Problem::SameParticle { tag: (*tag).to_owned(), particle: *index };
                return Err(self.error(other.offset.max(*offset), problem));
            }
        }
        Ok(())
    }

    /// Stores the value of an element that counts once.
    fn set_once<T>(
        &mut self,
        slot: fn(&mut UnresolvedScene) -> &mut Once<T>,
        value: T,
        &Element { tag, offset, .. }: &Element<'_>,
    ) -> Result<(), SceneError> {
        let location = self.lines.locate(offset);
        let Some((_, first)) = slot(&mut self.draft).0.replace((value, location)) else {
            return Ok(());
        };
        // Of the others, the last one counts.
        let fatal = ["duration", "integrator"].contains(&tag);
        let problem = Problem::RepeatedElement { tag, first: first.line, fatal };
        if fatal { Err(self.error(offset, problem)) } else { self.warn(offset, problem) }
    }
}
