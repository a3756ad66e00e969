//! Steps by rounds of a local and a global step, with changes made, and the changes that they may have.
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
//! Shapes: `Q` is `n × n`, dense; `p`, `b`, `d` have a row of three components for each particle or spring. Cost: `O(n³)`
//! once, and `O(n²)` a round. Source: hand-out "Computer Graphics – Mass-Spring Systems"; `docs/methods.md` states what it
//! leaves open.

use std::fmt;
use std::sync::Arc;

use nalgebra::{DMatrix, Dyn, LU, Vector3};
use scene::schema::StepEquation;
use scene::trace::State;
use scene::{ForceElement, Parameters, Scene};

use super::edit::{Edit, edits};
use super::expression::{Expression, Inputs, Leaf};
use super::model::{Model, Point};
use super::{Change, Effect, Factor, Particles, Place, Quantity, SceneRule, Term, candidates};

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
const ELASTIC: Term = Term { tag: "springforce", part: "elastic" };

fn is_elastic(scene: &Scene, element: &ForceElement) -> bool {
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
    factors: [[Factor; 2]; 4],
    /// Of `A`, in `AᵀA`, `Aᵀd` and `A p`.
    entries: [[f64; 2]; 3],
    springs: Option<Particles>,
    masses: Option<Particles>,
    pins: Option<Particles>,
    shift: isize,
    held: Held,
    local: Arc<Expression>,
    lengths_before: bool,
    ahead: [f64; 2],
    ahead_h: i32,
    start: f64,
    count: Count,
    velocity: Option<Factor>,
    /// `Q`, if it is factorised.
    system: Option<LU<f64, Dyn, Dyn>>,
}

/// A row of `A`.
struct Spring {
    ends: [usize; 2],
    parameters: Parameters,
}

/// `d = r v/|v|`, with the spring `v` as a formula's `d`.
fn local() -> Expression {
    Expression::Product(vec![rest_length(), Expression::Leaf(Leaf::Direction)])
}

fn rest_length() -> Expression {
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

    fn factor(&self, summand: Summand, place: usize) -> Factor {
        self.factors[summand as usize][place]
    }
}

impl Model {
    /// Factorises `Q`, with all changes made.
    pub(super) fn factorise(&mut self) {
        let Some(rounds) = &self.rounds else { return };
        let mut q = DMatrix::zeros(self.scene.particles.len(), self.scene.particles.len());
        for Spring { ends, parameters } in self.springs(rounds) {
            let k = self.of_spring(rounds, 0, &parameters);
            let entries = ends.into_iter().zip(rounds.entries[0]);
            for (row, a) in entries.clone() {
                for (column, b) in entries.clone() {
                    q[(row, column)] += k * a * b;
                }
            }
        }
        let pins = self.pins(rounds);
        let pin = rounds.factor(Summand::Pins, 0);
        for particle in 0..pins.len() {
            q[(particle, particle)] += self.of_inertia(rounds, 0, particle);
            match self.weight() {
                Some(w) if pins[particle] => {
                    q[(particle, particle)] += w * pin.of(self.h, w);
                }
                // A pin that is left out of the equations.
                None if pins[particle] => {
                    q.row_mut(particle).fill(0.0);
                    q[(particle, particle)] = 1.0;
                }
                _ => {}
            }
        }
        if let Some(rounds) = &mut self.rounds {
            rounds.system = Some(q.lu());
        }
    }

    /// `w`, where a penalty holds the pins.
    fn weight(&self) -> Option<f64> {
        let options = &self.scene.integrator_options;
        (options.choice("pins") == "penalty").then(|| options.number("pin_weight"))
    }

    /// The rows of `A`: those of the hand-out, in which springs between two pins have a row as well. At their rest length,
    /// they exert nothing.
    fn springs(&self, rounds: &Rounds) -> Vec<Spring> {
        let is_row = |element: &&ForceElement| match self.weight() {
            Some(_) => element.schema.tag == ELASTIC.tag,
            None => is_elastic(&self.scene, element),
        };
        let elastic = self.scene.forces.iter().filter(is_row);
        let all: Vec<Spring> = elastic
            .filter_map(|element| {
                Some(Spring { ends: element.pair()?, parameters: element.parameters.clone() })
            })
            .collect();
        let kept = Particles::of(rounds.springs, all.len());
        let each = all.into_iter().enumerate();
        each.filter(|(row, _)| kept.contains(row)).map(|(_, spring)| spring).collect()
    }

    /// Whether `C` selects each particle.
    fn pins(&self, rounds: &Rounds) -> Vec<bool> {
        let n = self.scene.particles.len();
        let fixed = (0..n).filter(|particle| self.scene.particles[*particle].fixed);
        let fixed: Vec<usize> = fixed.collect();
        let mut selected = vec![false; n];
        for row in Particles::of(rounds.pins, fixed.len()) {
            let column = fixed[row] as isize + rounds.shift;
            selected[column.rem_euclid(n as isize) as usize] = true;
        }
        selected
    }

    /// The coefficient of a spring in `Q` or `b`.
    fn of_spring(&self, rounds: &Rounds, place: usize, parameters: &[f64]) -> f64 {
        let k = parameters[ELASTIC.schema().parameter_idx("k")];
        k * rounds.factor(Summand::Springs, place).of(self.h, k)
    }

    /// The coefficient of a particle's inertia in `Q` or `b`.
    fn of_inertia(&self, rounds: &Rounds, place: usize, particle: usize) -> f64 {
        if !Particles::of(rounds.masses, self.scene.particles.len()).contains(&particle) {
            return 0.0;
        }
        let mass = self.scene.particles[particle].mass;
        mass / (self.h * self.h) * rounds.factor(Summand::Inertia, place).of(self.h, mass)
    }

    /// Takes a step; `None` if it has no end.
    pub(super) fn make_rounds(
        &self,
        time: f64,
        earlier: Option<&State>,
        state: &mut State,
    ) -> Option<()> {
        let rounds = self.rounds.as_ref()?;
        let system = rounds.system.as_ref()?;
        let (h, n) = (self.h, self.scene.particles.len());
        let rows = |values: &[f64]| -> Vec<Vector3<f64>> {
            (0..n).map(|particle| self.vector(values, particle)).collect()
        };
        let pins = self.pins(rounds);
        let mut velocities = rows(&state.velocities);
        let before = rows(&state.positions);
        // Of a fixed particle that moves, a trace without velocities has none.
        if let Some(earlier) = earlier.map(|earlier| rows(&earlier.positions)) {
            let loose = (0..n).filter(|i| self.scene.particles[*i].fixed && !pins[*i]);
            loose.for_each(|i| velocities[i] = (before[i] - earlier[i]) / h);
        }
        let external = rows(&self.external(time, state));
        let right: Vec<Vector3<f64>> = (0..n)
            .map(|i| {
                let [a, b] = rounds.ahead;
                let y = before[i] * a + velocities[i] * (b * h.powi(rounds.ahead_h));
                let mass = self.scene.particles[i].mass;
                let force = external[i] * rounds.factor(Summand::External, 1).of(h, mass);
                let free = y * self.of_inertia(rounds, 1, i) + force;
                if !pins[i] {
                    return free;
                }
                let rest = match rounds.held {
                    Held::Prescribed => {
                        let particle = &self.scene.particles[i];
                        Vector3::from(particle.position)
                            + Vector3::from(particle.velocity) * (time + h)
                    }
                    Held::Before => before[i],
                };
                match self.weight() {
                    Some(w) => free + rest * (w * rounds.factor(Summand::Pins, 1).of(h, w)),
                    None => before[i] + velocities[i] * h,
                }
            })
            .collect();
        let springs = self.springs(rounds);
        let of_start = |i: usize| before[i] + velocities[i] * (rounds.start * h);
        let mut p: Vec<Vector3<f64>> = (0..n).map(of_start).collect();
        let tolerance = self.scene.integrator_options.number("tolerance");
        for _ in 0..self.n_rounds(rounds) {
            let left = self.left(rounds, &springs, &right, (&before, &p));
            let change = system.solve(&left)?;
            for (i, p) in p.iter_mut().enumerate() {
                *p += change.row(i).transpose();
            }
            if change.amax() / h < tolerance {
                break;
            }
        }
        for i in 0..n {
            let moved = p[i] - before[i];
            for axis in 0..self.dimension {
                let dof = i * self.dimension + axis;
                state.positions[dof] = p[i][axis];
                if let (Some(factor), false) = (rounds.velocity, pins[i]) {
                    let mass = self.scene.particles[i].mass;
                    state.velocities[dof] = moved[axis] / h * factor.of(h, mass);
                }
            }
        }
        Some(())
    }

    /// `b − Q p`, with the local step at `p`.
    fn left(
        &self,
        rounds: &Rounds,
        springs: &[Spring],
        right: &[Vector3<f64>],
        (before, p): (&[Vector3<f64>], &[Vector3<f64>]),
    ) -> DMatrix<f64> {
        let (n, pins) = (p.len(), self.pins(rounds));
        let pin = rounds.factor(Summand::Pins, 0);
        let is_out = |i: usize| self.weight().is_none() && pins[i];
        let mut left: Vec<Vector3<f64>> = (0..n)
            .map(|i| match self.weight() {
                _ if is_out(i) => right[i] - p[i],
                Some(w) if pins[i] => {
                    right[i] - p[i] * (self.of_inertia(rounds, 0, i) + w * pin.of(self.h, w))
                }
                _ => right[i] - p[i] * self.of_inertia(rounds, 0, i),
            })
            .collect();
        for Spring { ends: [i, j], parameters } in springs {
            let row = |place: usize, p: &[Vector3<f64>]| {
                let [a, b] = rounds.entries[place];
                p[*i] * a + p[*j] * b
            };
            let d = self.local(rounds, parameters, row(2, p), row(2, before).norm());
            let pull = d * self.of_spring(rounds, 1, parameters);
            let stiff = row(0, p) * self.of_spring(rounds, 0, parameters);
            for (number, end) in [*i, *j].into_iter().enumerate() {
                if !is_out(end) {
                    left[end] += pull * rounds.entries[1][number];
                    left[end] -= stiff * rounds.entries[0][number];
                }
            }
        }
        DMatrix::from_fn(n, 3, |i, axis| left[i][axis])
    }

    /// `d` of a spring `v`.
    fn local(
        &self,
        rounds: &Rounds,
        parameters: &Parameters,
        v: Vector3<f64>,
        length_before: f64,
    ) -> Vector3<f64> {
        let mut parameters = parameters.clone();
        let rest = &mut parameters[ELASTIC.schema().parameter_idx("l0")];
        if rounds.lengths_before {
            *rest = length_before;
        }
        // A spring of rest length zero needs no direction.
        if *rest == 0.0 && *rounds.local == local() {
            return Vector3::zeros();
        }
        let (masses, still) = ([1.0; 2], [Vector3::zeros(); 2]);
        let at = Inputs { parameters, masses, h: self.h, d: v, v: still, l: v.norm() };
        rounds.local.value(&at).vector()
    }

    fn n_rounds(&self, rounds: &Rounds) -> u64 {
        let right = self.scene.integrator_options.count("iterations");
        match rounds.count {
            Count::More(more) => right.saturating_add_signed(more),
            Count::Exactly(count) => count,
            Count::Times(part) => (part * right as f64) as u64,
        }
    }

    /// `f_ext`: every term but the elastic part of springs.
    fn external(&self, time: f64, state: &State) -> Vec<f64> {
        let State { positions, velocities, .. } = state;
        let at = Point { x: positions.clone(), v: velocities.clone(), time };
        self.force_without(&at, Some(ELASTIC))
    }
}

/// Changes of the steps of a scene of rounds, each with the task that it belongs to; empty for other scenes.
pub fn of_rounds(scene: &Scene) -> Vec<Change> {
    if Rounds::of(scene).is_none() {
        return Vec::new();
    }
    let mut all = of_summands();
    all.extend(of_matrices());
    all.extend(of_local());
    all.extend(of_inertia_and_rounds());
    all.extend(of_rest_lengths(scene));
    all.retain(|change| change.acts_in(scene));
    all.extend(of_external(scene));
    all.sort_by_key(|change| change.rank);
    all
}

fn change(task: Task, rule: RoundsRule, rank: u8, words: impl fmt::Display) -> Change {
    Change {
        place: Place::Task(task),
        words: format!("{task}: {words}"),
        effect: Effect::Rounds(rule),
        rank,
    }
}

/// Factors, signs, powers of `Δt` and of a summand's own quantity, and omissions.
fn of_summands() -> Vec<Change> {
    let mut all = Vec::new();
    for (summand, quantity, names) in [
        (Summand::Springs, "k", ["the springs", "k AᵀA", "k Aᵀd"]),
        (Summand::Inertia, "M", ["the inertia", "M/Δt²", "(M/Δt²) y"]),
        (Summand::Pins, "w", ["the pins", "w CᵀC", "w CᵀC p_rest"]),
        (Summand::External, "the mass", ["", "", "f_ext"]),
    ] {
        for (side, name) in [Side::Both, Side::System, Side::Right].into_iter().zip(names) {
            if name.is_empty() {
                continue;
            }
            let place = match side {
                Side::Both => format!("in both Q and b, the term of {name}"),
                Side::System => format!("in Q, {name}"),
                Side::Right => format!("in b, {name}"),
            };
            let mut add = |factor: Factor, rank: u8, words: String| {
                let task = match (summand, side) {
                    (Summand::Pins, _) => Task::Selection,
                    (Summand::Inertia, Side::Both) if factor.h == 0 => Task::Masses,
                    (_, Side::Right) => Task::Round,
                    _ => Task::System,
                };
                let rule = RoundsRule::Factor(summand, side, factor);
                all.push(change(task, rule, rank, format!("{place} {words}")));
            };
            for (number, rank) in [(0.0, 0), (-1.0, 0), (2.0, 2), (0.5, 2)] {
                add(Factor::number(number), rank, candidates::factor_words(number));
            }
            let too_often = format!("is multiplied by {quantity} once too often");
            match summand {
                Summand::External => {
                    add(Factor::mass(1), 1, "is multiplied by the mass".to_owned());
                    add(Factor::mass(-1), 1, "is divided by the mass".to_owned());
                }
                _ => {
                    add(Factor::mass(-1), 1, format!("lacks the factor {quantity}"));
                    add(Factor::mass(1), 2, too_often);
                }
            }
            let by_h = |power: i32| if power == 1 { "Δt" } else { "Δt²" };
            for power in [1, 2] {
                let more = match (summand, power) {
                    (Summand::Inertia, 1) => "is divided by Δt, not by Δt²".to_owned(),
                    (Summand::Inertia, _) => "is not divided by Δt²".to_owned(),
                    _ => format!("is multiplied by {}", by_h(power)),
                };
                add(Factor::h(power), 1, more);
                let less = match summand {
                    Summand::Inertia => format!("is divided by {} too often", by_h(power)),
                    _ => format!("is divided by {}", by_h(power)),
                };
                add(Factor::h(-power), 1, less);
            }
        }
    }
    all
}

/// Entries and rows of the matrices.
fn of_matrices() -> Vec<Change> {
    let mut all = Vec::new();
    let [every, without_local] =
        [true, false].map(|local| Uses { system: true, right: true, local });
    let entries = [
        ([1.0, 1.0], "the two entries of each row have the same sign"),
        ([1.0, 0.0], "each row lacks its −1"),
        ([0.0, -1.0], "each row lacks its +1"),
        ([0.0, 0.0], "all entries are 0"),
        ([1.0, -2.0], "each row has its −1 twice"),
        ([2.0, -1.0], "each row has its +1 twice"),
    ];
    for (entries, words) in entries {
        for (uses, rest) in [(every, ""), (without_local, "; d is made of p_i − p_j")] {
            let rule = RoundsRule::Entries(entries, uses);
            all.push(change(Task::Incidence, rule, 1, format!("{words}{rest}")));
        }
    }
    let words = "its orientation of each spring is not that of d: +1 and −1 are swapped";
    let swapped = RoundsRule::Entries([-1.0, 1.0], without_local);
    all.push(change(Task::Incidence, swapped, 1, words));
    let none = Uses { system: false, right: false, local: false };
    for (task, uses, name) in [
        (Task::System, Uses { system: true, ..none }, "in Q, each row of A in AᵀA"),
        (Task::Round, Uses { right: true, ..none }, "in b, each row of A in Aᵀd"),
        (Task::Round, Uses { local: true, ..none }, "each row of A in v = A p"),
    ] {
        for (entries, words) in [
            ([1.0, 1.0], "has two entries of the same sign"),
            ([1.0, 0.0], "lacks its −1"),
            ([0.0, -1.0], "lacks its +1"),
        ] {
            let rule = RoundsRule::Entries(entries, uses);
            all.push(change(task, rule, 2, format!("{name} {words}")));
        }
    }
    for (task, rows) in [
        (
            Task::Incidence,
            ["only its first row is there", "it lacks its first row", "it lacks its last row"],
        ),
        (
            Task::Masses,
            [
                "only its first entry is there",
                "it lacks its first entry",
                "it lacks its last entry",
            ],
        ),
        (
            Task::Selection,
            ["only the first pin is held", "the first pin is not held", "the last pin is not held"],
        ),
    ] {
        let which = [Particles::First, Particles::NotFirst, Particles::NotLast];
        for (particles, words) in which.into_iter().zip(rows) {
            all.push(change(task, RoundsRule::Rows(task, particles), 1, words));
        }
    }
    for (shift, words) in [
        (1, "the vertex after each pin is held in its place: b counts from 1"),
        (-1, "the vertex before each pin is held in its place"),
    ] {
        all.push(change(Task::Selection, RoundsRule::Shifted(shift), 1, words));
    }
    let words = "pins are held where they were at the start of the step, not at p_rest";
    all.push(change(Task::Selection, RoundsRule::Held(Held::Before), 1, words));
    for (rule, words) in [
        (SceneRule::FirstMass, "every mass is that of the first vertex"),
        (SceneRule::IntegerMasses, "masses are read as integers"),
    ] {
        all.push(of_scene(Task::Masses, rule, 2, words));
    }
    all.push(of_scene(Task::Selection, SceneRule::Unfixed, 0, "no pin is held"));
    let unjoined = SceneRule::UnjoinedOf(ELASTIC.tag);
    all.push(of_scene(Task::Selection, unjoined, 2, "springs to pins are left out"));
    let before = SceneRule::PairBefore(ELASTIC.tag);
    all.push(of_scene(Task::Incidence, before, 2, "each row is that of the spring before it"));
    all
}

fn of_scene(task: Task, rule: SceneRule, rank: u8, words: &str) -> Change {
    Change {
        place: Place::Task(task),
        words: format!("{task}: {words}"),
        effect: Effect::Scene(rule),
        rank,
    }
}

/// Edits of the formula of `d`; those of its factor `r` may be in the rest lengths as well.
fn of_local() -> Vec<Change> {
    let leaf = Expression::Leaf;
    let k = Leaf::Parameter(ELASTIC.schema().parameter_idx("k"), "k");
    let own = local();
    let scalars = [rest_length(), leaf(Leaf::Length), leaf(k)];
    let mut all = Vec::new();
    let rule = |formula: Expression| RoundsRule::Local(Arc::new(formula));
    // Divided by r, it lacks r.
    let is_new = |edit: &&Edit| !edit.words.ends_with("divided by l0");
    for edit in edits(&own, &scalars).iter().filter(is_new) {
        let words = format!("d {}", in_symbols(&edit.words));
        all.push(change(Task::Round, rule(edit.expression.clone()), edit.rank, words));
    }
    for (number, rank) in [(-1.0, 0), (0.0, 0), (2.0, 2), (0.5, 2)] {
        let scaled = Expression::Product(vec![Expression::Number(number), own.clone()]);
        let words = format!("d {}", candidates::factor_words(number));
        all.push(change(Task::Round, rule(scaled), rank, words));
    }
    let square = Expression::Power(Box::new(rest_length()), 2);
    let inverse = Expression::Power(Box::new(rest_length()), -1);
    let of_rest = |by: Expression| Expression::Product(vec![by, leaf(Leaf::Direction)]);
    for (by, rank, words) in [
        (square, 1, "rest lengths are squared"),
        (inverse, 2, "rest lengths are 1/r"),
        (Expression::Number(1.0), 1, "every rest length is 1"),
        (Expression::Number(0.0), 1, "every rest length is 0"),
        (rest_length().negated(), 2, "rest lengths are negative"),
        (leaf(Leaf::Length), 1, "rest lengths are those of the deformed mesh, of each round's p"),
        (
            Expression::Product(vec![Expression::Number(2.0), rest_length()]),
            2,
            "rest lengths are doubled",
        ),
        (
            Expression::Product(vec![Expression::Number(0.5), rest_length()]),
            2,
            "rest lengths are halved",
        ),
    ] {
        all.push(change(Task::RestLengths, rule(of_rest(by)), rank, words));
    }
    let words = "rest lengths are those of the deformed mesh, at p^t";
    all.push(change(Task::RestLengths, RoundsRule::LengthsBefore, 1, words));
    all
}

/// Words about a formula in the hand-out's symbols: `r` for `l0`, and the spring `v = A p` for `d`.
fn in_symbols(words: &str) -> String {
    let symbol = |word: &str| {
        match word {
            "l0" => "r",
            "l0²" => "r²",
            "l" => "|v|",
            "l²" => "|v|²",
            "n" => "v/|v|",
            "d" => "v",
            "d/|d|₁" => "v/|v|₁",
            "d/|d|∞" => "v/|v|∞",
            other => other,
        }
        .to_owned()
    };
    words.split(' ').map(symbol).collect::<Vec<String>>().join(" ")
}

/// The places of rest lengths in the scene.
fn of_rest_lengths(scene: &Scene) -> Vec<Change> {
    let tag = ELASTIC.tag;
    let task = Task::RestLengths;
    let mut all = vec![
        of_scene(
            task,
            SceneRule::FirstParameters(tag),
            1,
            "every rest length is that of the first spring",
        ),
        of_scene(task, SceneRule::Integer(tag, "l0"), 2, "rest lengths are read as integers"),
    ];
    let has_one = scene.forces.iter().filter(|element| is_elastic(scene, element)).count() < 2;
    all.retain(|change| {
        !(has_one && change.effect == Effect::Scene(SceneRule::FirstParameters(tag)))
    });
    all
}

/// The prediction `y`, where rounds start, how many there are, and the new velocity.
fn of_inertia_and_rounds() -> Vec<Change> {
    let mut all = Vec::new();
    let mut add = |rule: RoundsRule, rank: u8, words: &str| {
        all.push(change(Task::Round, rule, rank, words));
    };
    let ahead = |position: f64, velocity: f64, h: i32| RoundsRule::Ahead { position, velocity, h };
    for (velocity, h, rank, words) in [
        (0.0, 1, 0, "y is p^t: Δt v is missing"),
        (-1.0, 1, 0, "y is p^t − Δt v, which is p^{t−Δt}"),
        (2.0, 1, 2, "y has Δt v twice"),
        (0.5, 1, 2, "y has half of Δt v"),
        (1.0, 0, 1, "y has v without Δt"),
        (1.0, 2, 1, "y has Δt² v in the place of Δt v"),
    ] {
        add(ahead(1.0, velocity, h), rank, words);
    }
    // y = α p^t + β p^{t−Δt}, with p^{t−Δt} = p^t − Δt v.
    for (now, before, words) in [
        (2.0, 1.0, "y is 2 p^t + p^{t−Δt}"),
        (2.0, 0.0, "y is 2 p^t: p^{t−Δt} is missing"),
        (1.0, -1.0, "y is p^t − p^{t−Δt}: 2 p^t counts once"),
        (0.0, -1.0, "y is −p^{t−Δt}: 2 p^t is missing"),
        (-2.0, -1.0, "y is −2 p^t − p^{t−Δt}"),
        (2.0, -2.0, "y is 2 p^t − 2 p^{t−Δt}"),
        (-1.0, 2.0, "y is 2 p^{t−Δt} − p^t: the two are swapped"),
    ] {
        add(ahead(now + before, -before, 1), 1, words);
    }
    add(ahead(0.0, 0.0, 1), 0, "y is missing");
    add(RoundsRule::Start(1.0), 1, "rounds start from y = p^t + Δt v, not from p^t");
    add(RoundsRule::Start(-1.0), 2, "rounds start from p^{t−Δt}, not from p^t");
    for (more, words) in [(-1, "a round too few is made"), (1, "a round too many is made")] {
        add(RoundsRule::Count(Count::More(more)), 1, words);
    }
    add(RoundsRule::Count(Count::Exactly(0)), 1, "no round is made");
    add(RoundsRule::Count(Count::Exactly(1)), 0, "a single round is made");
    for count in [2, 3, 4, 5, 10, 20, 30, 40, 50, 100] {
        let words = format!("{count} rounds are made, whatever their number should be");
        add(RoundsRule::Count(Count::Exactly(count)), 2, &words);
    }
    add(RoundsRule::Count(Count::Times(0.5)), 2, "half as many rounds are made");
    add(RoundsRule::Count(Count::Times(2.0)), 2, "twice as many rounds are made");
    add(RoundsRule::Velocity(None), 0, "the velocity is not renewed");
    for (factor, words) in [
        (Factor::h(1), "the velocity is p − p^t, not divided by Δt"),
        (Factor::h(-1), "the velocity is divided by Δt once too often"),
        (Factor::number(-1.0), "the velocity has the wrong sign"),
        (Factor::number(0.0), "the velocity is 0"),
        (Factor::number(2.0), "the velocity is multiplied by 2"),
        (Factor::number(0.5), "the velocity is multiplied by 0.5"),
    ] {
        add(RoundsRule::Velocity(Some(factor)), 1, words);
    }
    all
}

/// Changes of the value of each force that is external to the rounds.
fn of_external(scene: &Scene) -> Vec<Change> {
    let name = scene.integrator.name;
    let mut terms: Vec<Term> =
        scene.forces.iter().flat_map(|element| Term::of(element.schema)).collect();
    terms.sort_unstable();
    terms.dedup();
    terms.retain(|term| *term != ELASTIC);
    let is_of_value = |change: &&Change| match &change.effect {
        Effect::Factor(_, quantities, _) => **quantities == [Quantity::Force],
        Effect::Derived(..) => false,
        effect => effect.quantities().contains(&Quantity::Force),
    };
    let of = |term: Term| {
        let all = candidates::of_term(term).iter().filter(is_of_value);
        all.map(move |change| Change {
            place: Place::ForceUnder(term, name),
            words: format!("{name}: {}", change.words),
            ..change.clone()
        })
    };
    terms.into_iter().flat_map(of).collect()
}
