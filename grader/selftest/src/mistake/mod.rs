//! The planted mistakes: each replaces one formula or rule of a faultless [`Student`].
//!
//! Left out are deviations that are no mistakes in the answer, because a true simulator with them gives
//! the same trace:
//!
//! - under implicit Euler, whatever only makes Newton's matrix inexact (identity instead of M in the
//!   matrix alone, `h` instead of `h²`, Jacobians at q): it converges more slowly, to the same root;
//! - for the damping's `∂F/∂x`, `w nᵀ` instead of `n wᵀ`, and the two factors swapped: both leave
//!   what the missing `n wᵀ` leaves, since `nᵀ (I − n nᵀ) = 0`; and `w` the wrong way round, which is
//!   the flipped sign;
//! - clearing only the rows of a fixed particle: its δ is 0 then, whatever its columns hold;
//! - i and j swapped in a Jacobian of two particles: the four blocks are the same.

mod derived;
mod fixed;
mod force;
mod integrator;
mod jacobian;

use grader::blame::{Family, Feature, Part};
use simulator::scene::Scene;
use simulator::scene::schema::Matrix;

use super::student::Student;

/// What part of a simulator a mistake is in.
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

    /// As a heading.
    pub fn title(self) -> &'static str {
        match self {
            Self::Force => "Forces",
            Self::Jacobian => "Jacobians",
            Self::Integrator => "Integrators",
            Self::Fixed => "Fixed particles",
        }
    }
}

/// Where a mistake can make a difference at all: on other scenes the code with the mistake is not run. And what it is
/// to be blamed on.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Scope {
    /// Scenes with this force.
    Force(Part),
    /// Of these, the ones under an implicit method.
    Jacobian(Part),
    /// Scenes under this integrator.
    Integrator(&'static str),
    /// Scenes with a fixed particle; where the mistake is in one of the explicit or implicit methods, under these.
    Fixed(Family),
}

impl Scope {
    fn contains(self, scene: &Scene) -> bool {
        let implicit = scene.integrator.matrix != Matrix::None;
        let has = |part: Part| scene.forces.iter().any(|force| force.schema.tag == part.tag());
        match self {
            Self::Force(part) => has(part),
            Self::Jacobian(part) => implicit && has(part),
            Self::Integrator(name) => scene.integrator.name == name,
            Self::Fixed(family) => {
                let concerned = match family {
                    Family::Any => true,
                    Family::Explicit => !implicit,
                    Family::Implicit => implicit,
                };
                concerned && scene.particles.iter().any(|particle| particle.fixed)
            }
        }
    }

    /// What a mistake here is to be blamed on.
    fn feature(self) -> Feature {
        match self {
            Self::Force(part) => Feature::Force(part),
            Self::Jacobian(part) => Feature::Jacobian(part),
            Self::Integrator(name) => Feature::Integrator(name),
            Self::Fixed(family) => Feature::Fixed(family),
        }
    }
}

/// A mistake.
pub struct Mistake {
    /// What part of a simulator it is in.
    pub area: Area,
    /// The force, Jacobian or integrator it is in.
    pub subject: &'static str,
    /// What is wrong, in a few words.
    pub description: &'static str,
    /// One of the five that are known to pass the course's own scenes: the ones to be sure of. (The
    /// 45 of them at hand let others pass too.)
    pub missed_by_the_course: bool,
    scope: Scope,
    plant: Box<dyn Fn(&mut Student) + Send + Sync>,
}

impl Mistake {
    /// A student who makes it.
    pub fn student(&self) -> Student {
        let mut student = Student::faultless();
        (self.plant)(&mut student);
        student
    }

    /// What it is to be blamed on: where it was planted.
    pub fn feature(&self) -> Feature {
        self.scope.feature()
    }

    /// A student who makes this one and another.
    pub fn and(&self, other: &Self) -> Student {
        let mut student = self.student();
        (other.plant)(&mut student);
        student
    }

    /// Whether it can make a difference on this scene.
    pub fn can_matter_on(&self, scene: &Scene) -> bool {
        self.scope.contains(scene)
    }

    /// The same, marked as one that the course's own scenes let pass.
    fn missed_by_the_course(mut self) -> Self {
        self.missed_by_the_course = true;
        self
    }
}

/// Mistakes in the same place.
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
            plant: Box::new(plant),
        }
    }
}

/// Every mistake, by area and subject.
pub fn all() -> Vec<Mistake> {
    let [mut forces, mut jacobians, mut integrators] =
        [force::mistakes(), jacobian::mistakes(), integrator::mistakes()];
    forces.extend(derived::in_forces());
    jacobians.extend(derived::in_jacobians());
    integrators.extend(derived::in_integrators());
    [forces, jacobians, integrators, fixed::mistakes()].into_iter().flatten().collect()
}
