//! Mistakes as data: a correct step with some of its terms changed.
//!
//! ```text
//! step        M (v' − v) = Σ h F,   (M − h² Σ K − h Σ B) δ = −M (u − v) + Σ h F,   x' = x + h v or h v'
//! term        a force or a part of one: F on each element by a formula; K = ∂F/∂x and B = ∂F/∂v by theirs
//! change      an operation on one of these: another formula, a factor, the ends of a pair, the elements, the place of
//!             evaluation, a coefficient of the step, the treatment of fixed particles, the reading of the scene
//! ```
//!
//! Changes compose: [`Model`] takes a list of them, and steps a scene with all of them made. [`candidates`] lists those
//! of a scene; most come from [`edit`], which changes any node of a formula. The formulas are written a third time, as
//! trees ([`forms`]), and held to [`law`](reference::law) by a test. A force without a tree (one on
//! more than two particles, or one that depends on time) is its law: its factor, ends, blocks and components can be changed.
//!
//! Shapes: states hold `n·D` numbers, particle-major. Units are the scene's. Cost of a step: `O((n·D)³)` for implicit
//! methods, dense.

pub mod candidates;
pub mod edit;
pub mod element;
pub mod elimination;
pub mod expression;
pub mod forms;
pub mod gate;
pub mod helper;
mod memory;
mod model;
pub mod round_changes;
mod round_steps;
pub mod rounds;
mod setting;
mod step;
mod work;

use std::fmt;
use std::sync::Arc;

use scene::schema::{Dependence, ForceSchema, Matrix};
use scene::{ForceElement, Scene};
use simulator::force;

use element::{Misread, Weight};
use elimination::Slip;
use expression::Expression;
use gate::Gate;
use helper::Helper;
pub use memory::Memory;
pub use model::{Model, Sample};
use reference::method::OnePoint;
pub use rounds::Task;
use rounds::{RoundsRule, is_of_rounds};
pub use step::{Contributions, Iterate, Residual, Stepped};
pub use work::Work;

/// A force, or a part of one that stands alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Term {
    /// The force's tag.
    pub tag: &'static str,
    /// The part's name; empty for the whole force.
    pub part: &'static str,
}

impl Term {
    /// The terms of a force: its parts where they stand alone, or the whole.
    pub fn of(schema: &'static ForceSchema) -> Vec<Self> {
        match schema.is_separable() {
            true => {
                schema.parts.iter().map(|part| Self { tag: schema.tag, part: part.name }).collect()
            }
            false => vec![Self { tag: schema.tag, part: "" }],
        }
    }

    /// Every term of the registry.
    pub fn all() -> impl Iterator<Item = Self> {
        force::REGISTRY.iter().flat_map(|kind| Self::of(&kind.schema))
    }

    /// The force.
    ///
    /// # Panics
    /// Where no force of the registry has this tag.
    pub fn schema(self) -> &'static ForceSchema {
        let mut kinds = force::REGISTRY.iter();
        let kind = kinds.find(|kind| kind.schema.tag == self.tag);
        &kind.unwrap_or_else(|| panic!("{} is no registered force", self.tag)).schema
    }

    /// Whether it is this term, or the whole force that this one is a part of.
    pub(crate) fn includes(self, term: Self) -> bool {
        self == term || self.part.is_empty() && self.tag == term.tag
    }

    fn depends_on(self) -> Dependence {
        match self.part {
            "" => self.schema().depends_on(),
            part => self.schema().part(part).depends_on,
        }
    }

    /// Whether this value of it is not always zero.
    pub(crate) fn has(self, quantity: Quantity) -> bool {
        match quantity {
            Quantity::Force => true,
            Quantity::ByPosition => self.depends_on().position,
            Quantity::ByVelocity => self.depends_on().velocity,
        }
    }
}

/// Methods that a program may step by in the place of one that it lacks.
const SUBSTITUTES: [&str; 2] = ["explicit-euler", "symplectic-euler"];

impl Change {
    /// Whether it can have an effect on the steps of `scene`.
    pub fn acts_in(&self, scene: &Scene) -> bool {
        // A wrong formula, or a scene that is read wrongly, may have the part where it is not.
        let is_anywhere =
            matches!(self.effect, Effect::Formula(..) | Effect::Derived(..) | Effect::Scene(_));
        let has = |term: &Term| {
            scene.forces.iter().filter(|element| element.schema.tag == term.tag).any(|element| {
                is_anywhere
                    || term.part.is_empty()
                    || element.has_part(term.schema().part(term.part))
            })
        };
        let implicit = || scene.integrator.matrix == Matrix::Jacobians;
        if let Effect::Scene(rule) | Effect::Partly(_, rule) = &self.effect
            && !rule.may_change(scene)
        {
            return false;
        }
        match (&self.effect, self.place) {
            (Effect::Rounds(rule), _) => is_of_rounds(scene) && rule.acts_in(scene),
            (_, Place::Task(_)) => is_of_rounds(scene),
            (_, Place::ForceUnder(term, name)) => has(&term) && scene.integrator.name == name,
            // Rounds have separate formulas, and share the reading of scenes.
            (effect, Place::Force(_) | Place::Fixed(_) | Place::FixedUnder(_))
                if is_of_rounds(scene) && !matches!(effect, Effect::Scene(_)) =>
            {
                false
            }
            (_, Place::Jacobian(term)) => has(&term) && implicit(),
            (Effect::Partly(..), Place::Integrator(name)) => scene.integrator.name == name,
            (Effect::Partly(quantities, _), Place::Helpers) => {
                implicit() || quantities.contains(&Quantity::Force)
            }
            (Effect::Helper(of, _, helper), _) => {
                let is_pair = |element: &ForceElement| {
                    element.pair().is_some() && of.is_none_or(|tag| element.schema.tag == tag)
                };
                let is_of_matrix = matches!(helper, Helper::Blocks(..) | Helper::Entries(..));
                let is_used = !is_of_matrix || implicit();
                is_used && !is_of_rounds(scene) && scene.forces.iter().any(is_pair)
            }
            // Under fields alone, one step of Newton's method is all of it.
            (
                Effect::Method(name, Rule::Replaced(OnePoint::Linearized | OnePoint::Implicit)),
                _,
            ) if implicit() => {
                let is_field = |element: &ForceElement| element.schema.stencil.is_field();
                scene.integrator.name == *name && !scene.forces.iter().all(is_field)
            }
            (Effect::Method(name, Rule::Replaced(_) | Rule::Idle), _) => {
                scene.integrator.name == *name
            }
            // A method in the place of another has its mistakes there.
            (Effect::Method(name, rule), _) => {
                let is_there = match rule {
                    Rule::Split(term) => has(term),
                    _ => true,
                };
                is_there && (scene.integrator.name == *name || SUBSTITUTES.contains(name))
            }
            (
                Effect::Fixed(_)
                | Effect::Scene(
                    SceneRule::Unfixed
                    | SceneRule::Heavy { .. }
                    | SceneRule::Unjoined
                    | SceneRule::StillFixed(_),
                ),
                place,
            ) => {
                let concerned = match place {
                    Place::Fixed(Some(family)) => family == implicit(),
                    // A method in the place of another has its mistakes there.
                    Place::FixedUnder(name) => {
                        scene.integrator.name == name || SUBSTITUTES.contains(&name)
                    }
                    _ => true,
                };
                let is_exchanged =
                    matches!(self.effect, Effect::Fixed(FixedRule::Hold(hold)) if hold.exchanged);
                concerned && scene.particles.iter().any(|one| one.fixed || is_exchanged)
            }
            (Effect::Start(_, _, start), Place::Force(term)) => {
                use Start::{Along, Both, Positions, Velocities};
                let is_at_the_end = matches!(start, Along(_) | Positions | Velocities | Both);
                has(&term) && (implicit() || !is_at_the_end)
            }
            (_, Place::Force(term)) => has(&term),
            _ => true,
        }
    }
}

impl SceneRule {
    /// Whether a scene may be another one where it is read so: false if no parameter that it sets has another value.
    fn may_change(&self, scene: &Scene) -> bool {
        let any = |tag: &str, is_other: &dyn Fn(&ForceElement) -> bool| {
            scene.forces.iter().any(|element| element.schema.tag == tag && is_other(element))
        };
        let is_cut = |value: f64| value.fract() != 0.0;
        // Rounds read springs that are not in their list of forces.
        is_of_rounds(scene)
            || match *self {
                Self::Integers(tag) => {
                    any(tag, &|element| element.parameters.iter().copied().any(is_cut))
                }
                Self::Integer(tag, name) => any(tag, &|element| is_cut(element.parameter(name))),
                Self::Default(tag, name, _) => any(tag, &|element| element.parameter(name) == 0.0),
                Self::Signed(tag, name, sign) => {
                    any(tag, &|element| sign * element.parameter(name) < 0.0)
                }
                Self::Parameter(tag, name, value) => {
                    any(tag, &|element| element.parameter(name) != value)
                }
                Self::ParameterAs(tag, one, other) | Self::Exchanged(tag, [one, other]) => {
                    any(tag, &|element| element.parameter(one) != element.parameter(other))
                }
                Self::ShortLastStep => !scene.is_divided(),
                Self::LeftOut { which: Which::Beside(other), .. } => any(other, &|_| true),
                Self::ParametersOfOne { tag, name: Some(name), .. } => {
                    let mut all = scene.forces.iter().filter(|element| element.schema.tag == tag);
                    let first = all.next().map(|element| element.parameter(name));
                    all.any(|element| Some(element.parameter(name)) != first)
                }
                Self::SmallUnsigned => {
                    let mut all = scene.forces.iter().flat_map(|element| &element.parameters);
                    all.any(|value| *value < 0.0 && *value > -1.0)
                }
                _ => true,
            }
    }
}

impl Change {
    /// Whether a scene in which it acts cannot be right: rounds may read a scene by other code than other methods, and a
    /// method has its mistakes in the place of another only where it is there.
    pub fn must_act_in(&self, scene: &Scene) -> bool {
        let is_of = |name: &str| scene.integrator.name == name;
        let is_its = match (&self.effect, self.place) {
            (Effect::Method(name, _), _) => is_of(name),
            (_, Place::FixedUnder(name)) => is_of(name),
            _ => true,
        };
        let is_shared = matches!(self.effect, Effect::Scene(_));
        let is_optional = is_of_rounds(scene) && is_shared && !matches!(self.place, Place::Task(_));
        self.acts_in(scene) && is_its && !is_optional
    }

    /// Whether no force acts with it: a program without any force makes the same traces.
    pub(crate) fn leaves_all_forces_out(&self) -> bool {
        self.effect == Effect::Scene(SceneRule::Fixed { exchanged: false })
    }

    /// Whether it is in a method's linear system or in its solver, which a program has once for all its methods that need one.
    pub(crate) fn is_of_system(&self) -> bool {
        let Effect::Method(_, rule) = &self.effect else { return false };
        matches!(
            rule,
            Rule::Matrix(..)
                | Rule::Matrices(_)
                | Rule::Summed(_)
                | Rule::MatrixStep(_)
                | Rule::StepsExchanged
                | Rule::Inertia { .. }
                | Rule::MassAt(_)
                | Rule::MatrixMassAt(_)
                | Rule::ColumnMasses
                | Rule::Entries(_)
                | Rule::Blocks(_)
                | Rule::Diagonal(_)
                | Rule::Solver(_)
        )
    }

    /// Whether it is in the masses of a method's velocity update or matrix.
    pub(crate) fn is_of_masses(&self) -> bool {
        matches!(&self.effect, Effect::Method(_, Rule::MassAt(_)))
    }

    /// Whether two statements of a step stand in the wrong order: the method is there.
    pub(crate) fn is_order_of_updates(&self) -> bool {
        let is_either =
            |method: OnePoint| matches!(method, OnePoint::Explicit | OnePoint::Symplectic);
        match &self.effect {
            Effect::Method(name, Rule::Replaced(method)) => {
                SUBSTITUTES.contains(name) && is_either(*method)
            }
            _ => false,
        }
    }
}

impl fmt::Display for Term {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.part {
            "" => f.write_str(self.tag),
            part => write!(f, "{}'s {}", self.tag, self.schema().part(part).title),
        }
    }
}

/// A value that a term contributes to a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Quantity {
    /// `F`.
    Force,
    /// `∂F/∂x`.
    ByPosition,
    /// `∂F/∂v`.
    ByVelocity,
}

impl Quantity {
    /// All.
    pub const ALL: [Self; 3] = [Self::Force, Self::ByPosition, Self::ByVelocity];

    /// Its place in [`ALL`](Self::ALL).
    fn place(self) -> usize {
        match self {
            Self::Force => 0,
            Self::ByPosition => 1,
            Self::ByVelocity => 2,
        }
    }

    /// A list of this one.
    pub(crate) fn alone(self) -> &'static [Self] {
        match self {
            Self::Force => &[Self::Force],
            Self::ByPosition => &[Self::ByPosition],
            Self::ByVelocity => &[Self::ByVelocity],
        }
    }
}

/// Where a change is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Place {
    /// The value of a force.
    Force(Term),
    /// A Jacobian of a force.
    Jacobian(Term),
    /// An integrator, by its name.
    Integrator(&'static str),
    /// Fixed particles, under explicit methods (`Some(false)`), implicit ones (`Some(true)`) or all.
    Fixed(Option<bool>),
    /// Fixed particles under one integrator, by its name.
    FixedUnder(&'static str),
    /// The value of a force under one integrator, by its name.
    ForceUnder(Term, &'static str),
    /// A task of the hand-out on rounds.
    Task(Task),
    /// The reading of scenes.
    Reading,
    /// The functions on vectors that forces share.
    Helpers,
}

/// A change of a step.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// Where.
    pub place: Place,
    /// The mistake as a sentence.
    pub words: String,
    /// The changed formula or rule.
    pub effect: Effect,
    /// How far-fetched it is: 0 is the most usual.
    pub rank: u8,
}

/// The effect of a change.
#[derive(Debug, Clone, PartialEq)]
pub enum Effect {
    /// Another formula.
    Formula(Term, Quantity, Arc<Expression>),
    /// Another formula for the force, and its derivatives for the Jacobians.
    Derived(Term, Arc<Expression>),
    /// A factor of some quantities: `number · h^power · mass^power`.
    Factor(Term, &'static [Quantity], Factor),
    /// Which particles of an element feel its force.
    Ends(Term, Ends),
    /// The blocks of an element's Jacobian.
    Blocks(Term, &'static [Quantity], Blocks),
    /// The components that are kept.
    Axes(Term, Quantity, Axes),
    /// The length `l` in some formulas of a term.
    Length(Term, &'static [Quantity], Softening),
    /// The particles on which a force without pairs acts.
    Particles(Term, Quantity, Particles),
    /// Where the masses in some formulas of a term are read.
    Masses(Term, &'static [Quantity], MassAt),
    /// How the coordinates of its particles are read.
    Read(Term, Read),
    /// The values that some quantities of a term read in the place of their arguments.
    Start(Term, &'static [Quantity], Start),
    /// Some elements of a term or of all parts of a force, of a field some particles, have a separate factor.
    Gate(Term, &'static [Quantity], Gate),
    /// Another weight of some quantities of each element.
    Weight(Term, &'static [Quantity], Weight),
    /// A coefficient or rule of an integrator.
    Method(&'static str, Rule),
    /// Fixed particles.
    Fixed(FixedRule),
    /// A function on vectors by which some quantities are computed, of all forces between two particles or of the one of this tag.
    Helper(Option<&'static str>, &'static [Quantity], Helper),
    /// The scene as it is read.
    Scene(SceneRule),
    /// The same where some quantities are evaluated.
    Partly(&'static [Quantity], SceneRule),
    /// A rule of rounds of local and global steps.
    Rounds(RoundsRule),
}

impl Effect {
    /// The quantities of a term that it changes.
    pub(crate) fn quantities(&self) -> &'static [Quantity] {
        match self {
            Self::Factor(_, quantities, _)
            | Self::Start(_, quantities, _)
            | Self::Gate(_, quantities, _)
            | Self::Weight(_, quantities, _)
            | Self::Blocks(_, quantities, _)
            | Self::Partly(quantities, _)
            | Self::Length(_, quantities, _)
            | Self::Masses(_, quantities, _) => quantities,
            Self::Formula(_, quantity, _)
            | Self::Axes(_, quantity, _)
            | Self::Particles(_, quantity, _) => quantity.alone(),
            Self::Ends(..) => &[Quantity::Force],
            Self::Derived(..) | Self::Read(..) => &Quantity::ALL,
            Self::Method(..)
            | Self::Fixed(_)
            | Self::Helper(..)
            | Self::Scene(_)
            | Self::Rounds(_) => &[],
        }
    }

    /// The factor that steps determined, where it has one.
    pub(crate) fn number(&self) -> Option<f64> {
        let factor = match self {
            Self::Factor(_, _, factor)
            | Self::Method(
                _,
                Rule::Forces(factor) | Rule::Matrix(_, factor) | Rule::Matrices(factor),
            ) => factor,
            Self::Blocks(_, _, Blocks::Scaled(_, _, number)) => return Some(*number),
            _ => return None,
        };
        (factor.h == 0 && factor.mass == 0).then_some(factor.number)
    }
}

/// The place of the force with this tag in the registry.
pub(crate) fn place_in_registry(tag: &str) -> Option<usize> {
    force::REGISTRY.iter().position(|kind| kind.schema.tag == tag)
}

/// An integer power; the usual exponents take no call.
fn power(base: f64, exponent: i32) -> f64 {
    match exponent {
        0 => 1.0,
        1 => base,
        2 => base * base,
        -1 => 1.0 / base,
        _ => base.powi(exponent),
    }
}

/// A constant factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Factor {
    /// The number.
    pub number: f64,
    /// The power of the time step.
    pub h: i32,
    /// The power of the particle's mass.
    pub mass: i32,
}

impl Factor {
    /// A number alone.
    pub const fn number(number: f64) -> Self {
        Self { number, h: 0, mass: 0 }
    }

    /// A power of the time step.
    pub const fn h(h: i32) -> Self {
        Self { number: 1.0, h, mass: 0 }
    }

    /// A power of the mass.
    pub const fn mass(mass: i32) -> Self {
        Self { number: 1.0, h: 0, mass }
    }

    pub(super) fn of(self, h: f64, mass: f64) -> f64 {
        self.number * power(h, self.h) * power(mass, self.mass)
    }

    pub(super) fn and(self, other: Self) -> Self {
        Self {
            number: self.number * other.number,
            h: self.h + other.h,
            mass: self.mass + other.mass,
        }
    }
}

/// Some particles, in the order of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Particles {
    /// The first.
    First,
    /// All but the first.
    NotFirst,
    /// All but the last.
    NotLast,
    /// As many as half of all, rounded down, the first ones.
    FirstHalf,
    /// As many as the force has elements, the first ones.
    AsElements,
    /// Along one axis all but the last, otherwise all.
    NotLastAlong(usize),
    /// As many coordinates as there are particles, from the first on.
    FirstCoordinates,
}

impl Particles {
    pub(super) fn of(all: Option<Self>, count: usize) -> std::ops::Range<usize> {
        match all {
            None | Some(Self::FirstCoordinates | Self::NotLastAlong(_) | Self::AsElements) => {
                0..count
            }
            Some(Self::First) => 0..count.min(1),
            Some(Self::FirstHalf) => 0..count / 2,
            Some(Self::NotFirst) => 1..count.max(1),
            Some(Self::NotLast) => 0..count.saturating_sub(1),
        }
    }
}

/// Forces on the particles of an element, `i` and `j` of a pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ends {
    /// On `i` alone.
    First,
    /// On `j` alone.
    Second,
    /// On all particles of an element but the one at this place.
    Without(usize),
    /// On the particles at these places, each that on the other.
    Exchanged([usize; 2]),
    /// The same on both.
    Same,
    /// One component of the force on one of them is multiplied by a number: place, component.
    Scaled(usize, usize, f64),
    /// The right ones, with the wrong sign where `i > j`.
    ByNumber,
    /// The right ones, but that on `j` is added to the coordinates from `j` on.
    SecondAtIndex,
    /// The right ones, but those on particle `i` are added to the coordinates from `i` on.
    AtIndex,
    /// The force on the particle at this place has the first component in the place of the second.
    Copied(usize, usize, usize),
    /// It has the second component added to the first; the second is zero.
    Gathered(usize, usize, usize),
    /// That on `j` is added to particle `i + 1` of the scene, after the last one to the first.
    SecondToNext,
    /// The force on one of them is multiplied by a number.
    Times(usize, f64),
    /// On one of them, a part of the force acts once more in the place of another part.
    Again(usize, [&'static str; 2]),
}

/// Blocks of an element's Jacobian; the right ones of a pair are `k, −k; −k, k`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Blocks {
    /// `k, 0; 0, k`.
    Own,
    /// `k, k; k, k`.
    SameSign,
    /// `0, −k; −k, 0`.
    Cross,
    /// Only that of the particle at this place by itself.
    Only(usize),
    /// All but the two between the particles at these places.
    Without([usize; 2]),
    /// The same on coordinates relative to the particle at the third place: its rows and columns balance those that are left.
    WithoutRelative([usize; 2], usize),
    /// The first block is added to the second, and is nowhere else: row and column each.
    Moved([usize; 2], [usize; 2]),
    /// Those in the row of the particle at this place have the wrong sign.
    RowNegated(usize),
    /// Those in the column of the particle at this place have the wrong sign.
    ColumnNegated(usize),
    /// All but the row of the particle at this place.
    WithoutRow(usize),
    /// All but the column of the particle at this place.
    WithoutColumn(usize),
    /// Those on and above the diagonal.
    Upper,
    /// Those on and below it.
    Lower,
    /// `k, −kᵀ; −kᵀ, k`.
    CrossTransposed,
    /// The transpose of the whole matrix.
    Transposed,
    /// The mean of the matrix and its transpose.
    Symmetrized,
    /// The right ones, of the first particles of the scene, whichever the element's.
    LocalIndices,
    /// `kᵀ, −k; −k, kᵀ`.
    OwnTransposed,
    /// The right ones, that of particles `i` and `j` from row `i` and column `j` on.
    AtIndex {
        /// Only the blocks of each particle with itself.
        own: bool,
    },
    /// The same of rows alone.
    RowAtIndex,
    /// The same of columns alone.
    ColumnAtIndex,
    /// The right ones, but for a factor of the one in this row and column.
    Scaled(usize, usize, f64),
    /// The same of one entry of this block, by its components.
    Entry([usize; 2], [usize; 2], f64),
}

/// Components of a vector or a matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Axes {
    /// One of them only; of a matrix, its diagonal entry.
    Only(usize),
    /// All but one.
    Not(usize),
    /// x and y exchanged.
    Swapped,
    /// Of a matrix: its first two rows exchanged.
    RowsSwapped,
    /// Of a matrix: every entry of a block is the diagonal's.
    Filled,
    /// Of a matrix: the diagonal of each block alone.
    Diagonal,
    /// One multiplied by a number.
    Scaled(usize, f64),
    /// The first in the place of the second.
    Copied(usize, usize),
    /// Of a matrix: the entries off the diagonal have the other sign.
    CrossNegated,
    /// Of a matrix: an entry multiplied by a number.
    Entry([usize; 2], f64),
    /// Of a matrix: the first entry in the place of the second.
    EntryCopied([usize; 2], [usize; 2]),
    /// Of a matrix: its transpose.
    Transposed,
    /// Of a matrix: the first entry of the diagonal is added to the second, and is nowhere else.
    Gathered(usize, usize),
}

/// Some elements of a force, in the order of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Which {
    /// All but the last.
    NotLast,
    /// All but the first.
    NotFirst,
    /// The last.
    Last,
    /// All but the last on each edge.
    NotLastOnEdge,
    /// All but the first on each edge.
    NotFirstOnEdge,
    /// Those whose first particle has the larger number.
    Descending,
    /// Those whose parameter is zero.
    Zero(&'static str),
    /// Those with a number for which there is no edge.
    BeyondEdges,
    /// Those between a fixed and another particle.
    Joined,
    /// All, in scenes that have this force.
    Beside(&'static str),
}

/// Coordinates of a pair's particles that are read at a wrong index.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Read {
    /// Which of them.
    pub of: Coordinates,
    /// Where they are read.
    pub at: ReadAt,
}

/// Coordinates of a pair's particles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coordinates {
    /// All.
    All,
    /// Positions of both.
    AllPositions,
    /// Velocities of both.
    AllVelocities,
    /// Positions of the particle at this place.
    Positions(usize),
    /// Velocities of the particle at this place.
    Velocities(usize),
}

/// Where coordinates are read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ReadAt {
    /// Those of particle `i` from number `i` on.
    Number,
    /// The second of these axes at the place of the first.
    Axis(usize, usize),
    /// The last axis one place further on, at the next particle's first.
    Next,
    /// The first axis one place before, at the last of the particle before.
    Before,
    /// There, but they are multiplied by this number.
    Scaled(f64),
    /// There, but the one along this axis has the other sign.
    Negated(usize),
}

/// Values that a force reads in the place of its arguments, most of them from the start of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// Positions.
    Positions,
    /// Velocities.
    Velocities,
    /// Both.
    Both,
    /// Positions along this axis.
    Along(usize),
    /// Velocities of the step before, at the positions of its arguments.
    EarlierVelocities,
    /// Positions of the step before.
    EarlierPositions,
    /// Velocities that are zero.
    Rest,
    /// The velocities, those of fixed particles zero.
    FixedAtRest,
    /// Of an explicit method: the velocities that the other forces give.
    OtherForces,
}

/// A length that is never zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Softening {
    /// `l + ε`.
    Added(f64),
    /// `√(l² + ε²)`.
    Squared(f64),
    /// `max(l, ε)`.
    AtLeast(f64),
    /// `l` in single precision.
    Single,
    /// `l²`.
    Square,
    /// The root of the sum of `l²` over all elements of the force.
    Together,
}

/// An index at which the mass of coordinate `r` is read, of a list with an entry for each coordinate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MassAt {
    /// The number of its particle.
    Particle,
    /// 0.
    First,
    /// That of its particle, where coordinates are stored axis after axis: all x, then all y.
    ByAxis,
    /// The number of its particle, and one more for each axis before its own.
    Coordinate,
    /// 0 along this axis, and its own along others.
    FirstAlong(usize),
    /// That of the next particle; the last one has none.
    Next,
    /// Its own, and 1 for the first or the last particle.
    OneOf {
        /// The last one.
        last: bool,
    },
    /// As many coordinates as there are particles have one, the others 0.
    Half {
        /// Coordinate i has that of particle i, and not its own.
        of_particles: bool,
    },
}

/// How a list with a mass for each coordinate is filled wrongly.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MassList {
    /// All particles for x, then all for y.
    ByAxis,
    /// 1 along this axis, as before it is filled.
    OneAlong(usize),
    /// The first particle's along this axis.
    FirstAlong(usize),
    /// 0 along this axis.
    ZeroAlong(usize),
}

/// The entries of a step's matrix that its solver reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Entries {
    /// All.
    All,
    /// Those on and below the diagonal, for those above it as well.
    Lower,
    /// Those on and above the diagonal, for those below it as well.
    Upper,
    /// All, rows in the place of columns.
    Transposed,
    /// Those on the diagonal.
    Diagonal,
    /// Those in the blocks of one particle.
    OwnBlocks,
    /// Those in blocks on and below the diagonal.
    LowerBlocks,
    /// Those in blocks on and above the diagonal.
    UpperBlocks,
    /// Those that are not on the diagonal.
    NotDiagonal,
}

/// A rule of an integrator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rule {
    /// Another method in its place.
    Replaced(OnePoint),
    /// Nothing moves.
    Idle,
    /// A factor of the sum of all forces.
    Forces(Factor),
    /// A factor of a Jacobian in the matrix.
    Matrix(Quantity, Factor),
    /// The same factor of both.
    Matrices(Factor),
    /// The time step in the matrix.
    MatrixStep(f64),
    /// `h K` and `h² B` in the matrix.
    StepsExchanged,
    /// The mass: its power in the matrix (or the velocity update), and a factor of `M (u − v)` on the right.
    Inertia {
        /// Power in the matrix.
        matrix: i32,
        /// Power on the right-hand side.
        right: i32,
        /// Factor on the right-hand side.
        sign: f64,
    },
    /// The mass of each coordinate is read at a wrong index.
    MassAt(MassAt),
    /// The same in the matrix of Newton's method alone.
    MatrixMassAt(MassAt),
    /// Jacobians are divided by the mass of their column, not of their row.
    ColumnMasses,
    /// The solver reads these entries of the Jacobians in the matrix.
    Entries(Entries),
    /// The blocks of the Jacobians in the matrix have other entries.
    Blocks(Axes),
    /// Forces at `x + c h v` (implicit: `x + c h u`).
    ForcesAt(f64),
    /// Jacobians at `x + c h u`: by position, by velocity, or both.
    JacobiansAt([bool; 2], f64),
    /// A linearized method's right-hand side and matrix at other points.
    Linearized(Linearized),
    /// `x' = x + h v` first, and forces there.
    PositionsFirst,
    /// Newton's method takes the velocity for its change over the step.
    WholeChange {
        /// In `M (u − v)`.
        inertia: bool,
        /// Where forces are evaluated, with `v + u`.
        forces: bool,
    },
    /// Newton's method evaluates forces and Jacobians at the same positions, velocities or both in every iteration: those
    /// of its first guess.
    Unmoved {
        /// Positions.
        positions: bool,
        /// Velocities.
        velocities: bool,
    },
    /// A linearized method takes its solution for the new velocity, not for its change.
    Whole {
        /// Fixed particles keep theirs.
        of_free: bool,
    },
    /// A linearized method multiplies its solution by this power of the mass.
    Scaled(i32),
    /// Newton's method adds each update to the velocities of its start.
    Restarted {
        /// The number of iterations.
        iterations: usize,
        /// It takes each update for the velocities.
        from_zero: bool,
    },
    /// Newton's method makes no iteration after the first step.
    Once,
    /// Newton's method moves the positions of its last iteration on, not those of its start.
    Accumulated {
        /// The number of iterations.
        iterations: usize,
        /// By which velocities.
        by: Accumulated,
    },
    /// Forces and Jacobians are evaluated at such a state.
    SeenAt(SeenAt),
    /// Newton's method takes the mean of the old and the new velocity for positions, where forces and Jacobians are evaluated.
    Mean {
        /// The step moves positions by it as well.
        moves: bool,
    },
    /// Newton's method moves positions by `h` times each update, and by `h u` from there.
    MovedOn,
    /// Newton's method has the Jacobians of its first iteration in all others of a step.
    FirstJacobians,
    /// A Jacobian in the matrix is the other one.
    Other(Quantity),
    /// The sum of both Jacobians in the place of this one in the matrix.
    Summed(Quantity),
    /// The forces along the second axis are those along the first.
    ForcesAlong(usize, usize),
    /// Along one axis, `x' = x + h (a v + b v')`.
    PositionAlong(usize, [f64; 2]),
    /// Positions move with the new velocity, which is lost then.
    Lost,
    /// Forces of the step before.
    Stale(Stale),
    /// The Jacobians of the step before; none in the first step.
    StaleJacobians,
    /// Values are kept from step to step.
    Kept(Kept),
    /// The linear system is solved by an elimination with a slip.
    Solver(Slip),
    /// Velocities are multiplied by such a factor where the forces, dF/dx and dF/dv are evaluated.
    Seen([f64; 3]),
    /// A factor of the forces along an axis.
    AlongAxis(usize, Factor),
    /// Of an explicit method: a force acts on the velocities that the other forces give.
    Split(Term),
    /// Jacobians are quotients of differences of the forces, with this step.
    Differences {
        /// The step.
        step: f64,
        /// Whether it is made to both sides.
        central: bool,
    },
    /// Forces and Jacobians on some particles have a separate factor.
    Gate(Gate),
    /// A linearized method makes so many iterations of Newton's method.
    Iterations(usize),
    /// Another power of the mass and another factor of `M (u − v)` on the right, with which Newton's method does not
    /// converge: it ends after this many iterations.
    Unbalanced {
        /// The power of the mass.
        right: i32,
        /// The factor.
        sign: f64,
        /// The number of iterations.
        iterations: usize,
    },
    /// Forces are evaluated anew for each of these, when those before it are updated already.
    OneByOne {
        /// Which.
        each: Each,
        /// Positions are updated with the velocities; otherwise after all of them.
        moves: bool,
    },
    /// `x' = x + h^power (a v + b v')`.
    Position {
        /// `a`.
        old: f64,
        /// `b`.
        new: f64,
        /// The power.
        h: i32,
    },
    /// `M (v' − a v) = b h F`, in the place of `M (v' − v) = h F`.
    Kick {
        /// `a`.
        old: f64,
        /// `b`.
        forces: f64,
    },
    /// A number added to every mass of the matrix, or of the velocity update.
    Diagonal(f64),
    /// No particle moves faster than this.
    SpeedLimit(f64),
    /// The end of Newton's method.
    Newton(Newton),
    /// This many steps in the place of one.
    Repeated(u32),
    /// This many steps of the same method in the place of one.
    Substeps(u32),
}

/// Values of the step before at which forces are evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stale {
    /// Positions.
    pub positions: bool,
    /// Velocities.
    pub velocities: bool,
    /// There is no force in the first step.
    pub none_first: bool,
}

/// The velocities by which Newton's method moves positions in every iteration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Accumulated {
    /// Those before it; the step moves positions from its start.
    Before,
    /// Those before it, and positions stay there.
    FromBefore,
    /// Those after it, and positions stay there.
    After,
    /// The update, but the last one, and positions move on from there.
    ByUpdates,
}

/// A state that is not the one at which forces should be evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SeenAt {
    /// `2 x + h v`.
    Twice,
    /// The velocities along the second axis are those along the first.
    Velocity(usize, usize),
    /// In `x + h v`, they are.
    Predicted(usize, usize),
    /// Of Newton's method: velocities are `u + (u − v)`.
    Ahead,
    /// Of Newton's method: velocities are `v`, and `u − v` is added to the positions.
    Crossed,
    /// Of Newton's method: positions are `x + h (v + u)/2`.
    Mean,
    /// Of Newton's method: positions are `x + h (2 u − v)`.
    MovedOn,
    /// Velocities are `v + h u` with those of the positions `x + h u`.
    Displaced {
        /// For Jacobians as well as forces.
        jacobians: bool,
    },
    /// Positions are `h v` or `h u`, for each of [`Quantity::ALL`] that is marked.
    Moved([bool; 3]),
}

/// Coordinates that are updated together, one group after another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Each {
    /// Those of each particle.
    Particle,
    /// Each by itself, particle by particle.
    Coordinate,
    /// Those along each axis.
    Axis,
}

impl Each {
    /// The groups, of so many coordinates in a space of this dimension.
    pub(super) fn groups(self, count: usize, dimension: usize) -> Vec<Vec<usize>> {
        let all: Vec<usize> = (0..count).collect();
        match self {
            Self::Particle => all.chunks(dimension).map(<[usize]>::to_vec).collect(),
            Self::Coordinate => all.chunks(1).map(<[usize]>::to_vec).collect(),
            Self::Axis => {
                (0..dimension).map(|axis| (axis..count).step_by(dimension).collect()).collect()
            }
        }
    }
}

/// Where the forces of a step are linearized.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linearized {
    /// Forces at `x + c h v`.
    pub forces: f64,
    /// Jacobians at `x + c h v`.
    pub jacobians: f64,
    /// A factor of `h² ∂F/∂x v` on the right-hand side: a number and a power of the time step; `None` without the term.
    pub right: Option<Factor>,
}

/// Values that a program should compute anew in each step, and does not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kept {
    /// How they are used.
    pub carried: Carried,
    /// The sum of all forces.
    pub forces: bool,
    /// The sums of Jacobians, by position and by velocity.
    pub jacobians: [bool; 2],
    /// The masses in the matrix.
    pub inertia: bool,
    /// `h v`, where a linearized method evaluates forces and Jacobians.
    pub displacement: bool,
}

/// How the values of the step before are used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Carried {
    /// They are used again.
    Again,
    /// Those of a step are added to them, where these entries are cleared first.
    Added(Cleared),
    /// They are subtracted from those of a step.
    Subtracted,
    /// So many times those are added to them.
    Scaled(Factor),
}

/// Entries of a vector, or of a matrix row by row, that are cleared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cleared {
    /// None.
    None,
    /// The first.
    First,
    /// All but the first.
    NotFirst,
    /// All but the last.
    NotLast,
    /// An eighth, from the first on: as many bytes as there are entries.
    Bytes,
    /// As many as there are particles; of a matrix, its first row.
    Few,
    /// Those of a vector along one of so many axes.
    Along(usize, usize),
}

/// Where Newton's method starts and ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Newton {
    /// The largest number of iterations.
    pub iterations: usize,
    /// It ends at an update below this.
    pub tolerance: f64,
    /// The size of an update.
    pub norm: Norm,
    /// The first guess.
    pub guess: Guess,
    /// Whether the last update is not applied.
    pub drops_last: bool,
    /// The part of each update that is applied.
    pub relaxation: f64,
}

/// The size of an update.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Norm {
    /// The root of the sum of squares.
    Euclidean,
    /// The largest entry.
    Largest,
    /// The first entry.
    First,
    /// The absolute sum, signs included.
    Sum,
    /// The sum, which may be negative.
    SignedSum,
    /// The change of positions, `h` times that of velocities.
    Positions,
}

impl Norm {
    /// All.
    pub const ALL: [Self; 6] =
        [Self::Euclidean, Self::Largest, Self::First, Self::Sum, Self::SignedSum, Self::Positions];
}

/// The first guess of the new velocities.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Guess {
    /// The old ones.
    Old,
    /// Zero.
    Zero,
    /// Zero, those of fixed particles as well.
    AllZero,
    /// The old ones, those of fixed particles zero.
    FixedZero,
    /// Those of explicit Euler.
    Explicit,
}

/// A rule for fixed particles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FixedRule {
    /// They do not move.
    Stand,
    /// Their velocities are zero from the first step on.
    Stop,
    /// They move in the first step, and their velocities are zero from then on.
    StopMoved,
    /// They do not move, and their velocities are zero from the first step on.
    Freeze,
    /// Simple gravity changes their velocities.
    Fall,
    /// They do not move, and forces change their velocities.
    Restored,
    /// Explicit methods move them as free ones; along one axis only if given.
    Feel(Option<usize>),
    /// The entries cleared in the linear system of an implicit method.
    Hold(Hold),
    /// `h² ∂F/∂x` or `h ∂F/∂v` is added to the matrix after rows and columns are cleared.
    Late([bool; 2]),
    /// Implicit methods evaluate forces at their old positions.
    Behind,
    /// Explicit methods clear the forces on these unknowns in the place of theirs.
    Cleared(Unknowns),
    /// Explicit methods end their loop at the first one: forces change no velocity from there on.
    Ended {
        /// Positions do not move either.
        stands: bool,
    },
    /// Implicit methods add their velocities once more in each step.
    Doubled,
}

/// Rows, columns and right-hand side of a fixed particle that are cleared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hold {
    /// Rows.
    pub rows: bool,
    /// Columns.
    pub columns: bool,
    /// Right-hand side.
    pub right: bool,
    /// Which unknowns.
    pub unknowns: Unknowns,
    /// Which of the right-hand side.
    pub of_right: Unknowns,
    /// Whether the mass is removed from the diagonal.
    pub massless: bool,
    /// Whether the diagonal is 1, whatever is cleared.
    pub unit: bool,
    /// Whether only blocks between two fixed particles are cleared.
    pub between: bool,
    /// The fixed particles whose rows and columns these are; `None`: all.
    pub which: Option<StillFixed>,
    /// Whether their part of the solution is cleared.
    pub solution: bool,
    /// Whether no force acts on them.
    pub unforced: bool,
    /// What makes their diagonal entries large.
    pub large: Option<Large>,
    /// Whether all this is done to free particles in their place.
    pub exchanged: bool,
}

/// A power of ten that makes an entry of the diagonal large.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Large {
    /// It is added.
    Added(u8),
    /// That many masses are added.
    Masses(u8),
    /// The entry is multiplied by it.
    Factor(u8),
}

/// The unknowns that are taken for those of particle `i`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unknowns {
    /// Its own.
    Own,
    /// `i` and the following ones.
    Index,
    /// `i` alone.
    Number,
    /// Along one axis only.
    Axis(usize),
    /// Those of the particle, where coordinates are stored axis after axis: all x, then all y.
    ByAxis,
}

/// The number taken for that of a particle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Index {
    /// Its last digit.
    LastDigit,
    /// Its first digit.
    FirstDigit,
    /// Its lowest byte.
    Byte,
    /// One less; of the first, itself.
    Less,
}

/// Numbers of particles and edges.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Numbers {
    /// All.
    All,
    /// Of the particles of edges.
    ParticlesOfEdges,
    /// Of edges, where elements name them.
    Edges,
}

/// The order in which a program sums the elements of a scene, as far as one force is concerned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// That of the file.
    File,
    /// By kinds: that force first.
    First,
    /// By kinds, in the order of the registry.
    Registry,
    /// By kinds: fields, that force, others.
    AfterFields,
    /// By kinds: that force last.
    Last,
}

impl Order {
    /// Those of a program that sums kind by kind.
    const BY_KIND: [Self; 4] = [Self::First, Self::Registry, Self::AfterFields, Self::Last];

    /// Whether one element of the scene comes before another one, which is of that force.
    pub(super) fn is_before(self, scene: &Scene, other: usize, number: usize) -> bool {
        let [one, of] = [other, number].map(|number| scene.forces[number].schema);
        match self {
            _ if one.tag == of.tag => other < number,
            Self::File => other < number,
            Self::First => false,
            Self::Registry => place_in_registry(one.tag) < place_in_registry(of.tag),
            Self::AfterFields => one.stencil.is_field(),
            Self::Last => true,
        }
    }

    /// Whether it is another order than the ones before it in this scene.
    fn is_new(self, scene: &Scene, tag: &str) -> bool {
        let of_force = |number: &usize| scene.forces[*number].schema.tag == tag;
        let before = |order: Self| -> Vec<bool> {
            let of_it = (0..scene.forces.len()).filter(of_force);
            let pairs = of_it.flat_map(|number| (0..scene.forces.len()).map(move |o| (o, number)));
            pairs.map(|(other, number)| order.is_before(scene, other, number)).collect()
        };
        let earlier = [Self::File].into_iter().chain(Self::BY_KIND);
        let mut earlier = earlier.take_while(|order| *order != self);
        let own = before(self);
        earlier.all(|order| before(order) != own)
    }
}

/// The treatment of elements for which there are no more edges.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Beyond {
    /// They act on their own edges.
    Own,
    /// They have no effect.
    None,
    /// They act on the first edge, and so on.
    First,
}

/// A pair of particles in the place of an element's own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pick {
    /// The first two of the scene.
    FirstTwo,
    /// Its own first one, and the next of the scene.
    Next,
    /// The same, after the last one the first.
    NextAround,
    /// Its own second one, and the one before it in the scene.
    Previous,
    /// Its own first one, and the one before its second, which may be the same.
    Less,
    /// The first of the scene at this end.
    First(usize),
    /// The last of the scene at this end.
    Last(usize),
    /// Those of the first element of the force.
    OfFirst,
    /// Those of the last element of the force.
    OfLast,
    /// Those of the first edge of the scene.
    FirstEdge,
    /// Those of the last edge of the scene.
    LastEdge,
}

impl Pick {
    /// The wrong pair on which each element of a force acts; the right one if the scene has no such pair.
    pub(super) fn pairs(self, scene: &Scene, tag: &str) -> Vec<[usize; 2]> {
        let all = || {
            let of_it = scene.forces.iter().filter(|element| element.schema.tag == tag);
            of_it.filter_map(ForceElement::pair)
        };
        let count = scene.particles.len();
        let of_edge = |edge: Option<&scene::Edge>| edge.map(|edge| edge.particles);
        let of = |[i, j]: [usize; 2]| match self {
            Self::FirstTwo => Some([0, 1]),
            Self::Next => (i + 1 < count).then_some([i, i + 1]),
            Self::NextAround => Some([i, (i + 1) % count]),
            Self::Previous => j.checked_sub(1).map(|before| [before, j]),
            Self::Less => j.checked_sub(1).map(|before| [i, before]),
            Self::First(0) => Some([0, j]),
            Self::First(_) => Some([i, 0]),
            Self::Last(0) => Some([count - 1, j]),
            Self::Last(_) => Some([i, count - 1]),
            Self::OfFirst => all().next(),
            Self::OfLast => all().next_back(),
            Self::FirstEdge => of_edge(scene.edges.first()),
            Self::LastEdge => of_edge(scene.edges.last()),
        };
        all().map(|own| of(own).unwrap_or(own)).collect()
    }
}

/// Fixed particles that are taken as fixed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StillFixed {
    /// The first of them.
    First,
    /// The last of them.
    Last,
    /// Those before the first free particle.
    Leading,
    /// Those other than the first particle of the scene.
    NotParticleFirst,
    /// Those other than the last particle of the scene.
    NotParticleLast,
}

impl StillFixed {
    /// Whether the fixed particle of this number is one of them.
    fn includes(self, number: usize, particles: &[scene::Particle]) -> bool {
        let fixed = |particle: &scene::Particle| particle.fixed;
        match self {
            Self::First => particles.iter().position(fixed) == Some(number),
            Self::Last => particles.iter().rposition(fixed) == Some(number),
            Self::Leading => particles[..number].iter().all(fixed),
            Self::NotParticleFirst => number != 0,
            Self::NotParticleLast => number + 1 != particles.len(),
        }
    }
}

/// A scene read wrongly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SceneRule {
    /// Every mass is this.
    Masses(f64),
    /// Every mass is the first particle's.
    FirstMass,
    /// Every mass is the last particle's.
    LastMass,
    /// A list of masses with one for each coordinate is filled wrongly.
    MassList {
        /// How.
        list: MassList,
        /// Forces read the mass of the first coordinate for all axes.
        once: bool,
    },
    /// Each element of a force is one of another force as well, with the same parameters in their order.
    AlsoAs(&'static str, &'static str),
    /// The time step is this.
    TimeStep(f64),
    /// The time step is at most this.
    TimeStepAtMost(f64),
    /// The time step is the duration divided by the number of steps.
    EvenTimeStep,
    /// The time step is rounded to single precision.
    SingleTimeStep,
    /// The last step ends at the duration, where this is no multiple of the time step.
    ShortLastStep,
    /// Initial velocities are zero.
    Velocities,
    /// Only the first or the last force element of the scene is there.
    OneForce {
        /// The last one.
        last: bool,
    },
    /// The last force element of the scene is not there; a single one may be.
    NotLastForce {
        /// A single one is not there either.
        even_alone: bool,
    },
    /// Masses are cut to integers of at least 1.
    IntegerMasses,
    /// All parameters are cut to integers.
    Integers(&'static str),
    /// A parameter is cut to an integer.
    Integer(&'static str, &'static str),
    /// A parameter has this value where it is not written, or 0.
    Default(&'static str, &'static str, f64),
    /// Some elements of a force are left out.
    LeftOut {
        /// The force's tag.
        tag: &'static str,
        /// Which.
        which: Which,
    },
    /// A parameter is the initial distance of the two particles; only where it is 0, or is not, if so.
    InitialDistance(&'static str, &'static str, Option<bool>),
    /// A parameter is that of the element with the number of the edge, 0 without one.
    OfEdge(&'static str, &'static str),
    /// A parameter has this value.
    Parameter(&'static str, &'static str, f64),
    /// Elements are multiplied by this power of their number.
    Counted(&'static str, i32),
    /// A parameter is multiplied by the square root of another one, and by a number.
    Root(&'static str, [&'static str; 2], f64),
    /// Negative parameters above −1 lose their sign.
    SmallUnsigned,
    /// A parameter has this sign, whatever is written.
    Signed(&'static str, &'static str, f64),
    /// A parameter is read as another.
    ParameterAs(&'static str, &'static str, &'static str),
    /// Two parameters are read each as the other.
    Exchanged(&'static str, [&'static str; 2]),
    /// Each element of a force is read so.
    Misread(&'static str, Misread),
    /// Each element of a force has the parameters of the first one, or of the last one.
    ParametersOfOne {
        /// The force's tag.
        tag: &'static str,
        /// The parameter; `None`: all.
        name: Option<&'static str>,
        /// The last one.
        last: bool,
    },
    /// An element acts between the particles `edge` and `edge + 1`, or on `edge` in the place of this end.
    EdgeAsParticle(&'static str, Option<usize>),
    /// The first element acts on the first edge, and so on.
    RunningEdge(&'static str, Beyond),
    /// Edges are sorted by their particles.
    SortedEdges,
    /// The first force element of the scene is not there; the first one of the kind that comes first, if so.
    NotFirstForce {
        /// In the order of kinds, then of the file.
        by_kind: bool,
    },
    /// The forces of an element on these ends overwrite those before it; one component only if given.
    Overwrites(&'static str, Ends, Option<usize>, Order),
    /// The blocks of an element's Jacobian overwrite those of elements before it, in the order of the file; those of each
    /// part also those of the parts before it, if so.
    Assigned(&'static str, Quantity, bool),
    /// The same of the diagonal entries alone.
    AssignedDiagonal(&'static str, Quantity),
    /// Of several contributions to one block of the Jacobians, one is left.
    AssignedByAll {
        /// Which Jacobians.
        quantities: &'static [Quantity],
        /// Only the blocks of each particle by itself.
        own: bool,
        /// The first contribution is left; otherwise the last.
        is_first: bool,
        /// Those of fields count as well.
        fields: bool,
    },
    /// The same of the blocks between the two particles alone, in this order.
    AssignedCross(&'static str, Quantity, Order),
    /// The same of the block of the particle at this place by itself, or of each particle, or of one entry of it.
    AssignedOwn(&'static str, Quantity, Option<usize>, Option<[usize; 2]>, Order),
    /// Each element acts on the particles of the one before it.
    ParticlesBefore(&'static str),
    /// The pair of each element is another one, whatever its attributes.
    Pairs(&'static str, Pick),
    /// These fixed particles are fixed, the others are free.
    StillFixed(StillFixed),
    /// Fixed particles have this mass.
    Heavy {
        /// The mass.
        mass: f64,
        /// They are free.
        is_free: bool,
    },
    /// Free particles are fixed; fixed ones are free, if so.
    Fixed {
        /// Fixed ones are free.
        exchanged: bool,
    },
    /// Of the elements of a force with the same first particle, or the same second, the last alone acts there; its
    /// Jacobians on each pair of places likewise.
    Scattered(&'static str),
    /// A parameter that is not given, or 0, is that of the element of its force before.
    Carried(&'static str, &'static str),
    /// Some numbers are read wrongly.
    Indices(Index, Numbers),
    /// An edge between the particles of an earlier one is left out, so that later ones have other numbers.
    UniqueEdges {
        /// Elements of an edge that is not there act on the last one; otherwise they have no effect.
        is_clamped: bool,
    },
    /// Fixed particles are free.
    Unfixed,
    /// Forces between a fixed and another particle are left out.
    Unjoined,
}
