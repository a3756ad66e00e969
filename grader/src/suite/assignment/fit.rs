//! Which assignment a program was written for, from the scenes that it passes.
//!
//! A program *offers* a force if it passes a scene with it, and likewise a format and a dimension. It offers a method
//! without a matrix if it passes a scene with a force. Under constant forces the other methods take the same steps as
//! symplectic Euler, so that it offers one of these only if it passes a scene whose forces depend on the state. An
//! assignment fits if the program offers all that its required scenes need, and nothing outside its scope.

use std::collections::{BTreeSet, HashSet};

use scene::schema::Matrix;
use simulator::vocabulary;

use super::Assignment;
use crate::suite::{Case, Section, Suite};

/// Forces, integrators, formats and dimensions of some scenes.
#[derive(Default)]
struct Features<'a> {
    forces: BTreeSet<&'a str>,
    integrators: BTreeSet<&'a str>,
    formats: BTreeSet<&'a str>,
    dimensions: BTreeSet<usize>,
}

/// The only assignment that fits a submission that passes these scenes of the whole suite; `None` if several do, or
/// none.
pub fn fitting<'a>(
    assignments: &'a [Assignment],
    suite: &Suite,
    passed: &HashSet<&str>,
) -> Option<&'a Assignment> {
    let offered = Features::offered(suite, passed);
    let mut fitting = assignments
        .iter()
        .filter(|assignment| !assignment.is_all() && assignment.fits(suite, &offered));
    let first = fitting.next()?;
    fitting.next().is_none().then_some(first)
}

impl<'a> Features<'a> {
    /// Those of scenes.
    fn of(cases: impl Iterator<Item = &'a Case>) -> Self {
        let mut features = Self::default();
        for case in cases {
            features.add(case);
            features.integrators.insert(case.feature.integrator);
        }
        features
    }

    /// Those that a submission offers that passes these scenes.
    fn offered(suite: &'a Suite, passed: &HashSet<&str>) -> Self {
        let mut features = Self::default();
        for case in suite.cases.iter().filter(|case| passed.contains(case.id.as_str())) {
            features.add(case);
            let mut forces = case.scene.forces.iter();
            let shows_the_method = forces.any(|force| {
                case.scene.integrator.matrix == Matrix::None
                    || force.schema.depends_on().has_jacobian()
            });
            if shows_the_method {
                features.integrators.insert(case.feature.integrator);
            }
        }
        features
    }

    fn add(&mut self, case: &'a Case) {
        self.forces.extend(case.scene.forces.iter().map(|force| force.schema.tag));
        self.formats.insert(case.format());
        self.dimensions.insert(case.scene.dimension.count());
    }
}

impl Assignment {
    fn fits(&self, suite: &Suite, offered: &Features<'_>) -> bool {
        let required = |case: &&Case| self.section(case) == Some(Section::Required);
        let needed = Features::of(suite.cases.iter().filter(required));
        let has_all = needed.forces.is_subset(&offered.forces)
            && needed.integrators.is_subset(&offered.integrators)
            && needed.formats.is_subset(&offered.formats)
            && needed.dimensions.is_subset(&offered.dimensions);
        let scope = &self.scope;
        let is_optional = |tag: &&str| scope.optional_forces.iter().any(|force| force == tag);
        let has_force = |tag: &&str| {
            is_optional(tag)
                || scope
                    .forces
                    .as_ref()
                    .is_none_or(|forces| forces.iter().any(|force| force == tag))
        };
        let vocabulary = vocabulary();
        let has_integrator = |name: &&str| {
            scope.integrators.as_ref().is_none_or(|spellings| {
                spellings.iter().any(|spelling| {
                    vocabulary.integrator(spelling).is_some_and(|schema| schema.name == *name)
                })
            })
        };
        let has_format = |format: &&str| {
            scope
                .formats
                .as_ref()
                .is_none_or(|formats| formats.iter().any(|listed| listed == format))
        };
        let has_dimension = |dimension: &usize| {
            scope.dimensions.as_ref().is_none_or(|listed| listed.contains(dimension))
        };
        has_all
            && offered.forces.iter().all(has_force)
            && offered.integrators.iter().all(has_integrator)
            && offered.formats.iter().all(has_format)
            && offered.dimensions.iter().all(has_dimension)
    }
}
