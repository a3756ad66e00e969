//! Planted mistakes: each replaces one formula or rule of a correct [`Student`].
//!
//! The list omits deviations that do not change the trace:
//!
//! - with implicit Euler, an inexact Newton matrix (identity instead of M in the matrix only, `h` instead of `h²`,
//!   Jacobians at q): Newton's method converges more slowly, to the same root;
//! - in the damping's `∂F/∂x`, `w nᵀ` instead of `n wᵀ`, and swapped factors: both have the same effect as the
//!   missing `n wᵀ`, since `nᵀ (I − n nᵀ) = 0`; and reversed `w`, which is the flipped sign;
//! - clearing only the rows of a fixed particle: its δ is 0 then, whatever its columns contain;
//! - i and j swapped in a Jacobian of a pair force: the four blocks are the same;
//! - with fast mass-spring, both signs of the incidence matrix swapped: `AᵀA` and `Aᵀd` are the same.

mod derived;
mod elastic;
mod fast_mass_spring;
mod fixed;
mod force;
mod foreign;
mod integrator;
mod jacobian;
mod projected_newton;
mod space;

use diagnosis::findings::{Family, Feature, Part};
use grader::suite::{Case, Suite};
use scene::Scene;
use scene::schema::{self, Convergence, Matrix, StepEquation};

use super::student::{Coefficient, Student, knows_in_space};

/// Part of a simulator with a mistake.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Area {
    /// The value of a force.
    Force,
    /// A derivative of a force.
    Jacobian,
    /// A time-stepping method.
    Integrator,
    /// The treatment of fixed particles.
    Fixed,
}

impl Area {
    /// All, in the order of the tables.
    pub const ALL: [Self; 4] = [Self::Force, Self::Jacobian, Self::Integrator, Self::Fixed];

    /// Its heading.
    pub fn title(self) -> &'static str {
        match self {
            Self::Force => "Forces",
            Self::Jacobian => "Jacobians",
            Self::Integrator => "Integrators",
            Self::Fixed => "Fixed particles",
        }
    }
}

/// Scenes on which a mistake can have an effect; on others its code does not run.
#[derive(Debug, Clone, Copy)]
enum Scope {
    /// Scenes with this force.
    Force(Part),
    /// Of these, the ones under an implicit method.
    Jacobian(Part),
    /// Scenes under this integrator.
    Integrator(&'static str),
    /// Scenes with a force between two particles.
    Pairs,
    /// Scenes with a fixed particle; where the mistake is in one of the explicit or implicit methods, under these.
    Fixed(Family),
    /// Scenes under this integrator that have something, and the feature to blame.
    Within(&'static str, fn(&Scene) -> bool, Feature),
}

impl Scope {
    fn contains(self, scene: &Scene) -> bool {
        let implicit = scene.integrator.matrix == Matrix::Jacobians;
        // Methods that minimise refuse damping.
        let minimises = scene.integrator.family == schema::Family::Minimization;
        let has = |part: Part| {
            let mut forces = scene.forces.iter().filter(|force| force.schema.tag == part.tag());
            forces.any(|force| !minimises || part.is_in(force))
        };
        match self {
            Self::Force(part) => has(part),
            Self::Jacobian(part) => implicit && has(part),
            Self::Pairs => scene.forces.iter().any(|force| force.pair().is_some()),
            Self::Integrator(name) => scene.integrator.name == name,
            Self::Fixed(family) => {
                let concerned = match family {
                    Family::Any => true,
                    Family::Explicit => !implicit,
                    Family::Implicit => implicit,
                };
                concerned && scene.particles.iter().any(|particle| particle.fixed)
            }
            Self::Within(name, has, _) => scene.integrator.name == name && has(scene),
        }
    }

    /// The feature that findings should blame for a mistake here.
    fn feature(self) -> Feature {
        match self {
            Self::Force(part) => Feature::Force(part),
            Self::Jacobian(part) => Feature::Jacobian(part),
            Self::Integrator(name) => Feature::Integrator(name),
            Self::Pairs => Feature::Helpers,
            Self::Fixed(family) => Feature::Fixed(family),
            Self::Within(_, _, feature) => feature,
        }
    }
}

/// A mistake.
pub struct Mistake {
    /// The part of a simulator it is in.
    pub area: Area,
    /// The force, Jacobian or integrator it is in.
    pub subject: &'static str,
    /// Short description of the mistake.
    pub description: &'static str,
    /// Whether it is one of the five mistakes known to pass the course's own scenes, which this suite must catch. (The
    /// 45 course scenes available here also miss others.)
    pub missed_by_the_course: bool,
    scope: Scope,
    /// Whether it is in the student's steps in space, which no other mistake is in.
    is_in_space: bool,
    plant: Box<dyn Fn(&mut Student) + Send + Sync>,
}

impl Mistake {
    /// A student with this mistake.
    pub fn student(&self) -> Student {
        let mut student = Student::faultless();
        (self.plant)(&mut student);
        student
    }

    /// The feature that findings should blame: the one it was planted in.
    pub fn feature(&self) -> Feature {
        self.scope.feature()
    }

    /// Plants it in a student.
    pub fn plant(&self, student: &mut Student) {
        (self.plant)(student);
    }

    /// A student who makes this one and another.
    pub fn and(&self, other: &Self) -> Student {
        let mut student = self.student();
        (other.plant)(&mut student);
        student
    }

    /// Whether it can have an effect on this scene.
    pub fn can_matter_on(&self, scene: &Scene) -> bool {
        if self.is_in_space != knows_in_space(scene) {
            return false;
        }
        let is_of_method = matches!(self.scope, Scope::Integrator(_) | Scope::Within(..));
        if is_of_method || scene.integrator.equation != StepEquation::LocalGlobal {
            return self.scope.contains(scene);
        }
        // Fast mass-spring shares only the reading of the scene.
        self.misreads(scene)
    }

    /// Whether it can change the trace of this scene: it can have an effect, and not only on the way to the root of an
    /// equation that Newton's method solves, nor by a reading that leaves the scene as it is.
    pub fn can_show_on(&self, scene: &Scene) -> bool {
        let is_solved = matches!(scene.integrator.convergence, Convergence::Update(_));
        let is_on_the_way = self.area == Area::Jacobian && is_solved;
        let is_idle = self.student().misreads() && !self.misreads(scene);
        self.can_matter_on(scene) && !is_on_the_way && !is_idle
    }

    /// Whether it reads this scene otherwise.
    fn misreads(&self, scene: &Scene) -> bool {
        let mut read = scene.clone();
        (self.student().read)(&mut read);
        read != *scene
    }

    /// Marks the mistake as missed by the course's own scenes.
    fn missed_by_the_course(mut self) -> Self {
        self.missed_by_the_course = true;
        self
    }
}

/// The common place of several mistakes.
struct Subject {
    area: Area,
    name: &'static str,
    scope: Scope,
}

impl Subject {
    fn mistake(
        &self,
        description: &'static str,
        plant: impl Fn(&mut Student) + Send + Sync + 'static,
    ) -> Mistake {
        Mistake {
            area: self.area,
            subject: self.name,
            description,
            missed_by_the_course: false,
            scope: self.scope,
            is_in_space: false,
            plant: Box::new(plant),
        }
    }
}

/// A formula or rule of the student, in which several mistakes are made.
struct Place<T: 'static> {
    subject: Subject,
    of: fn(&mut Student) -> &mut T,
}

impl<T> Place<T> {
    fn mistake(
        &self,
        description: &'static str,
        change: impl Fn(&mut T) + Send + Sync + 'static,
    ) -> Mistake {
        let of = self.of;
        self.subject.mistake(description, move |student| change(of(student)))
    }
}

/// An operation on a coefficient, with a description.
type Operation = (&'static str, fn(&mut Coefficient));

const OMIT: fn(&mut Coefficient) = |coefficient| coefficient.scale = 0.0;
const NEGATE: fn(&mut Coefficient) = |coefficient| coefficient.scale = -1.0;
const SQUARE_QUANTITY: fn(&mut Coefficient) = |coefficient| coefficient.of_quantity = 2;
const OMIT_QUANTITY: fn(&mut Coefficient) = |coefficient| coefficient.of_quantity = 0;
/// `h` in the place of `h²`.
const TAKE_ROOT_OF_H: fn(&mut Coefficient) = |coefficient| coefficient.of_h /= 2;
const OMIT_H: fn(&mut Coefficient) = |coefficient| coefficient.of_h = 0;
const MULTIPLY_BY_H_SQUARED: fn(&mut Coefficient) = |coefficient| coefficient.of_h += 2;

/// Thresholds, other formulas, stray indices. When the list was written, no operation of the grader made them; operations
/// with a number that the steps determine, and those on norms and projections, now make about half of them.
pub fn foreign() -> Vec<Mistake> {
    foreign::mistakes()
}

/// Those with elastic bodies in space, which show in scenes of space alone.
pub fn in_space() -> Vec<Mistake> {
    let mistakes = space::mistakes().into_iter();
    mistakes.map(|mistake| Mistake { is_in_space: true, ..mistake }).collect()
}

/// Every other mistake, by area and subject.
pub fn all() -> Vec<Mistake> {
    let [mut forces, mut jacobians, mut integrators] =
        [force::mistakes(), jacobian::mistakes(), integrator::mistakes()];
    forces.extend(elastic::in_forces());
    forces.extend(derived::in_forces());
    jacobians.extend(elastic::in_jacobians());
    jacobians.extend(derived::in_jacobians());
    integrators.extend(derived::in_integrators());
    integrators.extend(projected_newton::mistakes());
    integrators.extend(fast_mass_spring::mistakes());
    [forces, jacobians, integrators, fixed::mistakes()].into_iter().flatten().collect()
}

/// Those that can have an effect on a scene of the suite.
pub fn possible(suite: &Suite, mut mistakes: Vec<Mistake>) -> Vec<Mistake> {
    let matters = |mistake: &Mistake, case: &Case| mistake.can_matter_on(&case.scene);
    mistakes.retain(|mistake| suite.cases.iter().any(|case| matters(mistake, case)));
    mistakes
}
