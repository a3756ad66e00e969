//! Rules of the steps by rounds of a local and a global step, with changes made.
//!
//! ```text
//! Q = k AᵀA + M/Δt² + w CᵀC
//! b = k Aᵀd + M/Δt² y + f_ext + w CᵀC p_rest      y = 2 p^t − p^{t−Δt} = p^t + Δt v
//! v = A p,  d_e = r_e v_e/|v_e|                   of each spring, from the p of the round before; p^t at first
//! p = Q⁻¹ b                                       for a number of rounds;  v' = (p − p^t)/Δt
//! ```
//!
//! Each summand of `Q` and `b` has a coefficient `number · Δtᵃ · quantityᵇ`, and each matrix rows that may be missing. An
//! operation on one of them is a change. It belongs to the [`Task`] of the hand-out that makes what is changed. `f_ext` is
//! the sum of all terms but the elastic part of springs, at the start of the step.
//!
//! Source: hand-out "Computer Graphics – Mass-Spring Systems"; `docs/methods.md` states what it leaves open.

use std::fmt;
use std::sync::Arc;

use nalgebra::{Dyn, LU};
use scene::schema::StepEquation;
use scene::{ForceElement, Scene};

use super::expression::{Expression, Leaf};
use super::{Factor, Particles, Term};

/// A matrix or a part of the step that a student makes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Task {
    /// The signed incidence matrix `A`.
    Incidence,
    /// The mass matrix `M`.
    Masses,
    /// The selection matrix `C` of pinned vertices, and what holds them.
    Selection,
    /// The rest lengths `r`.
    RestLengths,
    /// The quadratic form `Q`, which is factorised once.
    System,
    /// A round: the local step, `b` and the global step.
    Round,
}

impl Task {
    /// All, in the order of the hand-out.
    pub const ALL: [Self; 6] = [
        Self::Incidence,
        Self::Masses,
        Self::Selection,
        Self::RestLengths,
        Self::System,
        Self::Round,
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Incidence => "A",
            Self::Masses => "M",
            Self::Selection => "C",
            Self::RestLengths => "r",
            Self::System => "Q",
            Self::Round => "round",
        }
    }

    /// Whether the motion of a scene depends on it: `M` where masses differ, `C` where there are pins, `r` where springs
    /// have a rest length, the others where a spring moves something.
    pub fn is_in(self, scene: &Scene) -> bool {
        if !is_of_rounds(scene) {
            return false;
        }
        let is_elastic = |element: &&ForceElement| is_elastic(scene, element);
        let springs = || scene.forces.iter().filter(is_elastic);
        let free = || scene.particles.iter().filter(|particle| !particle.fixed);
        match self {
            Self::Incidence | Self::System | Self::Round => springs().next().is_some(),
            Self::Masses => free().zip(free().skip(1)).any(|(a, b)| a.mass != b.mass),
            Self::Selection => scene.particles.iter().any(|particle| particle.fixed),
            Self::RestLengths => springs().any(|element| element.parameter("l0") != 0.0),
        }
    }
}

impl fmt::Display for Task {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "task {}", self.name())
    }
}

/// Whether rounds make the steps of a scene.
pub fn is_of_rounds(scene: &Scene) -> bool {
    scene.integrator.equation == StepEquation::LocalGlobal
}

/// The elastic part of springs, which the rounds move.
pub(super) const ELASTIC: Term = Term { tag: "springforce", part: "elastic" };

pub(super) fn is_elastic(scene: &Scene, element: &ForceElement) -> bool {
    let moves = |pair: [usize; 2]| pair.iter().any(|end| !scene.particles[*end].fixed);
    element.schema.tag == ELASTIC.tag
        && element.parameter("k") > 0.0
        && element.pair().is_some_and(moves)
}

/// A summand of `Q` and `b`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Summand {
    /// `k AᵀA` and `k Aᵀd`; its quantity is `k`.
    Springs,
    /// `M/Δt²` and `M/Δt² y`; its quantity is the mass.
    Inertia,
    /// `w CᵀC` and `w CᵀC p_rest`; its quantity is `w`.
    Pins,
    /// `f_ext`, in `b` alone; its quantity is the mass.
    External,
}

/// Where a part of the equation stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// In `Q` and `b`.
    Both,
    /// In `Q`.
    System,
    /// In `b`.
    Right,
}

impl Side {
    fn is_in(self, place: usize) -> bool {
        match self {
            Self::Both => true,
            Self::System => place == 0,
            Self::Right => place == 1,
        }
    }
}

/// Where a row of `A` is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Uses {
    /// In `AᵀA`.
    pub system: bool,
    /// In `Aᵀd`.
    pub right: bool,
    /// In `v = A p`, of which `d` is made.
    pub local: bool,
}

/// The positions at which pins are held.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Held {
    /// Where they should be.
    Prescribed,
    /// Where they are at the start of the step.
    Before,
}

/// The number of rounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Count {
    /// So many more.
    More(i64),
    /// So many.
    Exactly(u64),
    /// A part of them.
    Times(f64),
}

/// A change of a step of rounds.
#[derive(Debug, Clone, PartialEq)]
pub enum RoundsRule {
    /// A factor of a summand.
    Factor(Summand, Side, Factor),
    /// The entries of a row of `A` for the ends of its spring.
    Entries([f64; 2], Uses),
    /// The rows of `A`, `M` or `C` that are there.
    Rows(Task, Particles),
    /// `C` has its columns so many places further on.
    Shifted(isize),
    /// Where pins are held.
    Held(Held),
    /// The formula of `d`.
    Local(Arc<Expression>),
    /// `r` is the length of each spring at the start of the step.
    LengthsBefore,
    /// `y = a p^t + b Δt^c v`.
    Ahead {
        /// `a`.
        position: f64,
        /// `b`.
        velocity: f64,
        /// `c`.
        h: i32,
    },
    /// The rounds start from `p^t + c Δt v`.
    Start(f64),
    /// The number of rounds.
    Count(Count),
    /// A factor of the new velocity; `None`: it stays what it was.
    Velocity(Option<Factor>),
}

impl RoundsRule {
    /// Whether it can have an effect on the steps of a scene of rounds.
    pub(super) fn acts_in(&self, scene: &Scene) -> bool {
        let has_pins = || scene.particles.iter().any(|particle| particle.fixed);
        let has_penalty = || scene.integrator_options.choice("pins") == "penalty";
        let has_spring = || scene.forces.iter().any(|element| is_elastic(scene, element));
        match self {
            Self::Factor(Summand::Pins, ..) | Self::Held(_) => has_pins() && has_penalty(),
            Self::Rows(Task::Selection, _) | Self::Shifted(_) => has_pins(),
            Self::Factor(Summand::Springs, ..)
            | Self::Entries(..)
            | Self::Rows(Task::Incidence, _)
            | Self::Local(_)
            | Self::LengthsBefore
            | Self::Start(_)
            | Self::Count(_) => has_spring(),
            _ => true,
        }
    }
}

/// The rules of a step of rounds.
#[derive(Clone)]
pub(super) struct Rounds {
    /// By summand, in `Q` and in `b`.
    pub(super) factors: [[Factor; 2]; 4],
    /// Of `A`, in `AᵀA`, `Aᵀd` and `A p`.
    pub(super) entries: [[f64; 2]; 3],
    pub(super) springs: Option<Particles>,
    pub(super) masses: Option<Particles>,
    pub(super) pins: Option<Particles>,
    pub(super) shift: isize,
    pub(super) held: Held,
    pub(super) local: Arc<Expression>,
    pub(super) lengths_before: bool,
    pub(super) ahead: [f64; 2],
    pub(super) ahead_h: i32,
    pub(super) start: f64,
    pub(super) count: Count,
    pub(super) velocity: Option<Factor>,
    /// `Q`, if it is factorised.
    pub(super) system: Option<LU<f64, Dyn, Dyn>>,
}

/// `d = r v/|v|`, with the spring `v` as a formula's `d`.
pub(super) fn local() -> Expression {
    Expression::Product(vec![rest_length(), Expression::Leaf(Leaf::Direction)])
}

pub(super) fn rest_length() -> Expression {
    Expression::Leaf(Leaf::Parameter(ELASTIC.schema().parameter_idx("l0"), "l0"))
}

impl Rounds {
    /// The right rules of a scene; `None` where rounds do not make its steps, or are accelerated.
    pub(super) fn of(scene: &Scene) -> Option<Self> {
        let is_plain =
            is_of_rounds(scene) && scene.integrator_options.choice("acceleration") == "none";
        is_plain.then(|| Self {
            factors: [[Factor::number(1.0); 2]; 4],
            entries: [[1.0, -1.0]; 3],
            springs: None,
            masses: None,
            pins: None,
            shift: 0,
            held: Held::Prescribed,
            local: Arc::new(local()),
            lengths_before: false,
            ahead: [1.0, 1.0],
            ahead_h: 1,
            start: 0.0,
            count: Count::More(0),
            velocity: Some(Factor::number(1.0)),
            system: None,
        })
    }

    pub(super) fn make(&mut self, rule: &RoundsRule) {
        match rule {
            RoundsRule::Factor(summand, side, factor) => {
                for (place, known) in self.factors[*summand as usize].iter_mut().enumerate() {
                    if side.is_in(place) {
                        *known = known.and(*factor);
                    }
                }
            }
            RoundsRule::Entries(entries, Uses { system, right, local }) => {
                for (known, is_used) in self.entries.iter_mut().zip([system, right, local]) {
                    if *is_used {
                        *known = *entries;
                    }
                }
            }
            RoundsRule::Rows(Task::Incidence, rows) => self.springs = Some(*rows),
            RoundsRule::Rows(Task::Selection, rows) => self.pins = Some(*rows),
            RoundsRule::Rows(_, rows) => self.masses = Some(*rows),
            RoundsRule::Shifted(by) => self.shift = *by,
            RoundsRule::Held(held) => self.held = *held,
            RoundsRule::Local(formula) => self.local = Arc::clone(formula),
            RoundsRule::LengthsBefore => self.lengths_before = true,
            RoundsRule::Ahead { position, velocity, h } => {
                (self.ahead, self.ahead_h) = ([*position, *velocity], *h);
            }
            RoundsRule::Start(c) => self.start = *c,
            RoundsRule::Count(count) => self.count = *count,
            RoundsRule::Velocity(factor) => self.velocity = *factor,
        }
    }

    pub(super) fn factor(&self, summand: Summand, place: usize) -> Factor {
        self.factors[summand as usize][place]
    }
}
