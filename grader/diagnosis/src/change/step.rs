//! Steps of a [`Model`], and the residual of a given step in its equation.
//!
//! ```text
//! residual    r = M (v' − v) − Σ h F − Σ (h² K + h B) (v' − v)     linear in the value of every term
//! ```
//!
//! So the effect of another value of one term on the residual is the difference of the two values, and mistakes in
//! several terms add up.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};
use scene::schema::Convergence;
use scene::trace::State;

use super::gate::Measure;
use super::memory::Memory;
use super::model::{MANY_ITERATIONS, Model, Point, Sample, TermModel};
use super::work::cost;
use super::{
    Accumulated, Carried, Change, Each, Factor, Guess, Hold, Kept, Large, Newton, Norm, Quantity,
    SeenAt, Stale, Start, Term, Unknowns, power,
};
use reference::method::{Arithmetic, Method, OnePoint, Substep};

/// A step of implicit Euler whose Newton iteration needs more than this is not reproducible: where it ends depends on
/// the limit of the program, or on rounding.
const CONVERGING: usize = 10;

/// Iterates of Newton's method after which it is taken as ended.
const MOST_ITERATES: usize = 60;

/// Velocities that Newton's method passes.
#[derive(Debug, Clone)]
pub struct Iterate {
    /// The velocities.
    pub velocities: Vec<f64>,
    /// The size of the update from there, by each norm in the order of [`Norm::ALL`].
    sizes: [f64; Norm::ALL.len()],
}

impl Iterate {
    /// The one of these at which Newton's method ends.
    pub fn last<'a>(all: &'a [Self], newton: &Newton) -> Option<&'a Self> {
        let norm = Norm::ALL.iter().position(|norm| *norm == newton.norm)?;
        let ends = |iterate: &Self| iterate.sizes[norm] < newton.tolerance;
        let applied = usize::from(!newton.drops_last);
        let end = all.iter().position(ends).map_or(usize::MAX, |end| end + applied);
        all.get(end.min(newton.iterations).min(all.len() - 1))
    }
}

/// The end of a step.
#[derive(Debug, Clone)]
pub struct Stepped {
    /// The state after it.
    pub state: State,
    /// Whether Newton's method converged as fast as it does in a right program.
    pub converged: bool,
}

/// The residual of a step, coordinate by coordinate.
#[derive(Debug, Clone)]
pub struct Residual {
    /// `r`, zero for fixed particles and at a speed limit.
    pub momentum: Vec<f64>,
    /// `x' − x − h v` or `x' − x − h v'`.
    pub position: Vec<f64>,
    /// Momentum per velocity: a bound of the row sums of `M − h² K − h B`.
    pub stiffness: f64,
}

/// The contributions of each term's quantities to `r`, in the order of [`Quantity::ALL`].
#[derive(Debug)]
pub struct Contributions(Vec<[Vec<f64>; 3]>);

impl Contributions {
    /// That of a term's quantity.
    pub fn of(&self, term: usize, quantity: Quantity) -> &[f64] {
        &self.0[term][quantity.place()]
    }
}

/// Evaluates stages and substeps of a step that starts at this time.
struct Evaluation<'a> {
    model: &'a Model,
    time: f64,
}

impl Arithmetic for Evaluation<'_> {
    fn force(&mut self, x: &[f64], v: &[f64], after: f64) -> Vec<f64> {
        self.model.force(&Point::new(x, v, self.time + after))
    }

    fn drift(&self, x: &mut [f64], v: &[f64], h: f64) {
        for (dof, (x, v)) in x.iter_mut().zip(v).enumerate() {
            if !self.model.stands(dof) {
                *x += h * v;
            }
        }
    }

    fn kick(&self, v: &mut [f64], force: &[f64], h: f64) {
        for (dof, (v, force)) in v.iter_mut().zip(force).enumerate() {
            if !self.model.is_held(dof) {
                *v += h * force / self.model.mass[dof];
            }
        }
    }
}

impl Model {
    pub(super) fn is_implicit(&self) -> bool {
        matches!(self.method, Some(OnePoint::Linearized | OnePoint::Implicit))
    }

    fn time(&self, step: u64) -> f64 {
        step as f64 * self.scene.time_step
    }

    /// Where Newton's method starts and ends.
    pub fn newton(&self) -> Newton {
        self.rules.newton
    }

    /// Whether a step depends on all steps before it.
    pub fn remembers(&self) -> bool {
        self.rules.kept.is_some()
    }

    /// Takes a step after those of `memory`; `None` if it has no finite end.
    pub fn step(
        &self,
        memory: &mut Memory,
        step: u64,
        earlier: Option<&State>,
        before: &State,
    ) -> Option<Stepped> {
        let model = self.of_step(step);
        let mut state = before.clone();
        let mut converged = true;
        if model.idle {
            return Some(Stepped { state, converged });
        }
        for substep in 0..model.substeps {
            let time = self.time(step) + f64::from(substep) * model.h;
            let earlier = if substep == 0 { earlier } else { None };
            converged &= model.substep(memory, time, earlier, &mut state)?;
        }
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        (finite(&state.positions) && finite(&state.velocities))
            .then_some(Stepped { state, converged })
    }

    fn substep(
        &self,
        memory: &mut Memory,
        time: f64,
        earlier: Option<&State>,
        state: &mut State,
    ) -> Option<bool> {
        let old = state.clone();
        let mut converged = true;
        match self.method {
            Some(OnePoint::Explicit | OnePoint::Symplectic) => match self.rules.one_by_one {
                Some((each, moves)) => {
                    self.one_by_one(time, state, each, moves);
                    if moves {
                        self.fix(&old, state);
                        return Some(true);
                    }
                }
                None => self.kick(memory, time, earlier, &old, state),
            },
            Some(OnePoint::Linearized | OnePoint::Implicit) => {
                converged = self.solve(memory, time, earlier, &old, state)?;
            }
            None => return self.several(memory, time, earlier, state),
        }
        self.fix(&old, state);
        self.limit(state);
        self.drift(&old, state);
        if self.fixed_rules.stop_moved {
            let of_fixed =
                state.velocities.iter_mut().zip(&self.fixed).filter(|(_, fixed)| **fixed);
            of_fixed.for_each(|(v, _)| *v = 0.0);
        }
        if self.rules.lost {
            state.velocities = old.velocities;
        }
        Some(converged)
    }

    /// A step of a method with several evaluations of the forces, or for a part of the step.
    fn several(
        &self,
        memory: &mut Memory,
        time: f64,
        earlier: Option<&State>,
        state: &mut State,
    ) -> Option<bool> {
        let old = state.clone();
        let mut converged = true;
        let State { positions, velocities, .. } = state;
        let by = &mut Evaluation { model: self, time };
        match Method::of(self.scene.integrator.equation) {
            Method::Explicit(substeps) => self.explicit(time, substeps, state),
            Method::Stages(tableau) => tableau.step(by, self.h, positions, velocities),
            Method::Controlled(pair) => {
                let Convergence::ErrorEstimate(name) = self.scene.integrator.convergence else {
                    return None;
                };
                let tolerance = self.scene.integrator_options.number(name);
                pair.step(by, (self.h, tolerance), positions, velocities)?;
            }
            Method::Backward { .. } => {
                let (part, inner) = self.part.as_ref()?;
                converged = inner.substep(memory, time, earlier, state)?;
                let whole = |end: &mut f64, start: &f64| *end = start + (*end - start) / part;
                state.positions.iter_mut().zip(&old.positions).for_each(|(x, y)| whole(x, y));
                state.velocities.iter_mut().zip(&old.velocities).for_each(|(v, w)| whole(v, w));
            }
            Method::Differences { .. } => {
                let (part, inner) = self.part.as_ref()?;
                if let Some(earlier) = earlier {
                    let repeated = 1.0 - part;
                    self.repeat(repeated, earlier, state);
                    let time = time + repeated * self.h;
                    converged = inner.substep(memory, time, Some(earlier), state)?;
                } else {
                    let mut whole = inner.clone();
                    whole.h = self.h;
                    converged = whole.substep(memory, time, None, state)?;
                }
            }
            Method::Rounds => self.make_rounds(time, earlier, state)?,
        }
        self.fix(&old, state);
        Some(converged)
    }

    /// `y ← y + c (y − y₋)`, and `x ← x + c h v` of fixed particles, that they go on from there.
    fn repeat(&self, c: f64, earlier: &State, state: &mut State) {
        for dof in 0..self.fixed.len() {
            let (x, v) = (&mut state.positions[dof], &mut state.velocities[dof]);
            if !self.fixed[dof] {
                *x += c * (*x - earlier.positions[dof]);
                *v += c * (*v - earlier.velocities[dof]);
            } else if !self.stands(dof) {
                *x += c * self.h * *v;
            }
        }
    }

    /// The substeps of an explicit method, in order.
    fn explicit(&self, time: f64, substeps: &[Substep], state: &mut State) {
        let State { positions, velocities, .. } = state;
        let mut by = Evaluation { model: self, time };
        let mut after = 0.0;
        for substep in substeps {
            let old = velocities.clone();
            if let Substep::Both(c) | Substep::Kick(c) = *substep {
                let force = by.force(positions, &old, after);
                by.kick(velocities, &force, c * self.h);
            }
            if let Substep::Both(c) | Substep::Drift(c) = *substep {
                let along = if matches!(substep, Substep::Both(_)) { &old } else { &*velocities };
                by.drift(positions, along, c * self.h);
                after += c * self.h;
            }
        }
    }

    /// The coordinates that are held, and the others.
    fn is_held(&self, dof: usize) -> bool {
        if let Some(unknowns) = self.fixed_rules.cleared {
            let mut fixed = (0..self.scene.particles.len())
                .filter(|particle| self.scene.particles[*particle].fixed);
            return fixed.any(|particle| self.unknowns(particle, unknowns).any(|one| one == dof));
        }
        if self.fixed_rules.ended.is_some() {
            return self.fixed[..=dof].contains(&true);
        }
        self.fixed[dof]
            && match self.fixed_rules.feel {
                None => true,
                Some(None) => false,
                Some(Some(axis)) => dof % self.dimension != axis,
            }
    }

    /// Whether it is a coordinate of a particle that does not move.
    fn stands(&self, dof: usize) -> bool {
        self.fixed[dof] && self.fixed_rules.stand
            || self.fixed_rules.ended == Some(true) && self.fixed[..=dof].contains(&true)
    }

    /// A step of an explicit method, some coordinates at a time; the velocities alone unless it moves.
    fn one_by_one(&self, time: f64, state: &mut State, each: Each, moves: bool) {
        for group in each.groups(self.mass.len(), self.dimension) {
            let force = self.force(&Point::new(&state.positions, &state.velocities, time));
            for dof in group {
                let old = state.velocities[dof];
                let [of_old, of_new] = self.position_rule(dof);
                if !self.is_held(dof) {
                    let given = self.force_coefficient(dof) * force[dof];
                    state.velocities[dof] += given / self.mass[dof];
                }
                if moves {
                    state.positions[dof] += of_old * old + of_new * state.velocities[dof];
                }
            }
        }
    }

    /// Velocities of an explicit method.
    fn kick(
        &self,
        memory: &mut Memory,
        time: f64,
        earlier: Option<&State>,
        old: &State,
        state: &mut State,
    ) {
        let mut at = self.force_point(time, earlier, old, &old.velocities);
        if let Some(term) = self.reads_given() {
            at.given = self.given_by_others(&at, term);
        }
        let force =
            if self.has_no_force(earlier) { vec![0.0; at.x.len()] } else { self.force(&at) };
        let mut force = memory.force(self.rules.kept, force, self.h);
        self.gate(&at, &mut force);
        self.copy_forces(&mut force);
        for (dof, velocity) in state.velocities.iter_mut().enumerate() {
            if !self.is_held(dof) {
                let given = self.force_coefficient(dof) * force[dof];
                let mass = self.mass[dof].powi(self.rules.inertia_matrix) + self.rules.diagonal;
                *velocity = self.rules.old * *velocity + given / mass;
            }
        }
    }

    /// `h` times the factor of the forces.
    fn force_coefficient(&self, dof: usize) -> f64 {
        let mass = self.mass[dof];
        let of_axis = match self.rules.along {
            Some((axis, factor)) if dof % self.dimension == axis => factor.of(self.h, mass),
            _ => 1.0,
        };
        self.h * self.rules.forces.of(self.h, mass) * of_axis
    }

    /// Where forces are evaluated, at the velocities `u`.
    fn force_point<'a>(
        &self,
        time: f64,
        earlier: Option<&'a State>,
        old: &'a State,
        u: &[f64],
    ) -> Point<'a> {
        let standard = if self.is_implicit() { 1.0 } else { 0.0 };
        let at = self.rules.forces_at.unwrap_or(standard);
        let mut at = match (self.rules.stale, earlier) {
            (Some(Stale { positions, velocities, .. }), Some(earlier)) => {
                let read = |is_of_earlier: bool| if is_of_earlier { earlier } else { old };
                let u = if velocities { &earlier.velocities } else { u };
                self.point(time, read(positions), u, at)
            }
            _ => self.point(time, old, u, at),
        };
        self.displace(&mut at, old, u, Quantity::Force);
        at.v.iter_mut().for_each(|v| *v *= self.rules.seen[0]);
        self.with_others(at, earlier)
    }

    /// Puts others in the place of the positions or velocities at which a quantity is evaluated.
    fn displace(&self, at: &mut Point<'_>, old: &State, u: &[f64], quantity: Quantity) {
        let pairs = old.velocities.iter().zip(u);
        match self.rules.seen_at {
            Some(SeenAt::Displaced { jacobians }) if jacobians || quantity == Quantity::Force => {
                at.v = pairs.map(|(v, u)| v + self.h * u).collect();
            }
            Some(SeenAt::Crossed) if quantity == Quantity::Force => {
                at.x.iter_mut().zip(pairs).for_each(|(x, (v, u))| *x += u - v);
                at.v.clone_from(&old.velocities);
            }
            Some(SeenAt::Ahead) => at.v = pairs.map(|(v, u)| u + (u - v)).collect(),
            Some(SeenAt::Moved(which)) if which[quantity.place()] => {
                at.x.iter_mut().zip(&old.positions).for_each(|(x, old)| *x -= old);
            }
            _ => {}
        }
    }

    /// Whether forces are those of a step before that there is not.
    fn has_no_force(&self, earlier: Option<&State>) -> bool {
        earlier.is_none() && self.rules.stale.is_some_and(|stale| stale.none_first)
    }

    /// `x + c h u`.
    fn point<'a>(&self, time: f64, old: &'a State, u: &[f64], c: f64) -> Point<'a> {
        let [along, u] = self.rules.unmoved.map(|is_unmoved| {
            let is_unmoved = is_unmoved && self.method == Some(OnePoint::Implicit);
            if is_unmoved { &old.velocities } else { u }
        });
        let mut x = old.positions.clone();
        let (mut along, mut u) = (along.to_vec(), u.to_vec());
        let mixed = match self.rules.seen_at {
            Some(SeenAt::Mean) => Some([0.5, 0.5]),
            Some(SeenAt::MovedOn) => Some([-1.0, 2.0]),
            _ => None,
        };
        if let Some([of_old, of_new]) = mixed.filter(|_| self.method == Some(OnePoint::Implicit)) {
            let pairs = along.iter_mut().zip(&old.velocities);
            pairs.for_each(|(u, old)| *u = of_new * *u + of_old * old);
        }
        if self.rules.whole_change[1] && self.method == Some(OnePoint::Implicit) {
            u.iter_mut().zip(&old.velocities).for_each(|(u, old)| *u += old);
        }
        let copy = |velocities: &mut [f64], [from, to]: [usize; 2]| {
            for velocity in velocities.chunks_mut(self.dimension) {
                velocity[to] = velocity[from];
            }
        };
        match self.rules.seen_at {
            Some(SeenAt::Twice) => x.iter_mut().for_each(|x| *x *= 2.0),
            Some(SeenAt::Velocity(from, to)) => copy(&mut u, [from, to]),
            Some(SeenAt::Predicted(from, to)) => copy(&mut along, [from, to]),
            Some(
                SeenAt::Ahead
                | SeenAt::Crossed
                | SeenAt::Mean
                | SeenAt::MovedOn
                | SeenAt::Displaced { .. }
                | SeenAt::Moved(_),
            )
            | None => {}
        }
        x.iter_mut().zip(&along).for_each(|(x, u)| *x += c * self.h * u);
        if self.fixed_rules.behind && self.is_implicit() {
            for (dof, x) in x.iter_mut().enumerate().filter(|(dof, _)| self.fixed[*dof]) {
                *x = old.positions[dof];
            }
        }
        let time = if self.is_implicit() { time + self.h } else { time };
        let start = [&*old.positions, &*old.velocities];
        Point { x, v: u, time, start, earlier: None, given: Vec::new() }
    }

    /// Puts the forces along one axis in the place of those along another.
    fn copy_forces(&self, force: &mut [f64]) {
        let Some([from, to]) = self.rules.forces_along else { return };
        force.chunks_mut(self.dimension).for_each(|force| force[to] = force[from]);
    }

    /// The same point, with what terms read in the place of its values.
    fn with_others<'a>(&self, mut at: Point<'a>, earlier: Option<&'a State>) -> Point<'a> {
        if self.reads(|start| matches!(start, Start::EarlierPositions | Start::EarlierVelocities)) {
            at.earlier = earlier.map(|state| [&*state.positions, &*state.velocities]);
        }
        at
    }

    /// The velocities that all forces but those of a term give, in an explicit step.
    fn given_by_others(&self, at: &Point<'_>, term: Term) -> Vec<f64> {
        let force = self.force_without(at, Some(term));
        let given = |(dof, v): (usize, &f64)| match self.is_held(dof) {
            true => *v,
            false => v + self.force_coefficient(dof) * force[dof] / self.mass[dof],
        };
        at.v.iter().enumerate().map(given).collect()
    }

    /// The point at which a Jacobian is evaluated for the velocities `u`. `None` in the first step of
    /// [`Rule::StaleJacobians`](super::Rule::StaleJacobians): its matrix has no Jacobians yet.
    fn jacobian_point<'a>(
        &self,
        quantity: Quantity,
        time: f64,
        earlier: Option<&'a State>,
        old: &'a State,
        u: &[f64],
    ) -> Option<Point<'a>> {
        let (of, u) = match earlier {
            Some(earlier) if self.rules.stale_jacobians => (earlier, &*earlier.velocities),
            None if self.rules.stale_jacobians => return None,
            _ => (old, u),
        };
        let at = self.rules.jacobians_at[usize::from(quantity == Quantity::ByVelocity)];
        let mut at = self.point(time, of, u, at.unwrap_or(1.0));
        self.displace(&mut at, of, u, quantity);
        let place = quantity.place();
        at.v.iter_mut().for_each(|v| *v *= self.rules.seen[place]);
        Some(self.with_others(at, earlier))
    }

    fn matrix_coefficients(&self, mass: f64) -> [f64; 2] {
        let [k, b] = self.rules.matrix;
        let h = self.rules.matrix_step.unwrap_or(self.h);
        let [k, b] = [h * h * k.of(h, mass), h * b.of(h, mass)];
        match self.rules.summed {
            Some(Quantity::ByPosition) => [k, k + b],
            Some(Quantity::ByVelocity) => [k + b, b],
            _ => [k, b],
        }
    }

    /// Newton's method, or one step of it.
    fn solve(
        &self,
        memory: &mut Memory,
        time: f64,
        earlier: Option<&State>,
        old: &State,
        state: &mut State,
    ) -> Option<bool> {
        let newton = self.rules.newton;
        let linearized = self.method == Some(OnePoint::Linearized);
        let most = match linearized {
            true => self.rules.iterations,
            false if self.rules.once && earlier.is_some() => 0,
            false => newton.iterations,
        };
        let guess = if linearized { Guess::Old } else { newton.guess };
        let mut u = self.first_guess(guess, time, old);
        let (mut made, mut sizes) = (0, Vec::new());
        let mut reached = linearized && most == 1;
        let mut from = Cow::Borrowed(old);
        let mut of_step = Memory::default();
        let memory = if self.rules.first_jacobians { &mut of_step } else { memory };
        while made < most {
            let Some(delta) = self.update(memory, time, earlier, &from, &u) else {
                // An iteration that diverges ends where it may.
                if made < CONVERGING {
                    return None;
                }
                made += 1;
                break;
            };
            made += 1;
            let size = self.size(newton.norm, &delta);
            reached |= size < newton.tolerance;
            sizes.push(size);
            let accumulated = self.rules.accumulated.filter(|_| !linearized);
            let mut accumulate = |by: &[Accumulated], u: &[f64]| {
                if accumulated.is_some_and(|one| by.contains(&one)) {
                    let positions = from.to_mut().positions.iter_mut();
                    positions.zip(u).for_each(|(x, u)| *x += self.h * u);
                }
            };
            accumulate(&[Accumulated::Before, Accumulated::FromBefore], &u);
            if !(reached && newton.drops_last && !linearized) {
                for (dof, (u, delta)) in u.iter_mut().zip(&delta).enumerate() {
                    let applied = if linearized {
                        power(self.mass[dof], self.rules.scaled)
                    } else {
                        newton.relaxation
                    };
                    let kept = match self.rules.whole.filter(|_| linearized) {
                        Some(of_free) if !(of_free && self.fixed[dof]) => 0.0,
                        _ if linearized => *u,
                        _ => match self.rules.restarted {
                            Some(true) => 0.0,
                            Some(false) => old.velocities[dof],
                            None => *u,
                        },
                    };
                    *u = kept + applied * delta;
                }
            }
            accumulate(&[Accumulated::After], &u);
            if reached {
                break;
            }
            accumulate(&[Accumulated::ByUpdates], &delta);
            if most == MANY_ITERATIONS && !can_converge(&sizes, newton.tolerance) {
                break;
            }
        }
        // The step moves them by the last velocity once more.
        match self.rules.accumulated.filter(|_| !linearized) {
            Some(Accumulated::FromBefore | Accumulated::ByUpdates) => {
                state.positions.clone_from(&from.positions);
            }
            Some(Accumulated::After) => {
                let before = from.positions.iter().zip(&u).map(|(x, u)| x - self.h * u);
                state.positions = before.collect();
            }
            Some(Accumulated::Before) | None => {}
        }
        state.velocities = u;
        let is_early = most < CONVERGING;
        Some(made <= CONVERGING && (reached || is_early))
    }

    /// The velocities from which Newton's method starts.
    fn first_guess(&self, guess: Guess, time: f64, old: &State) -> Vec<f64> {
        let v = &old.velocities;
        match guess {
            Guess::Old => v.clone(),
            Guess::AllZero => vec![0.0; v.len()],
            Guess::Zero => {
                (0..v.len()).map(|dof| if self.fixed[dof] { v[dof] } else { 0.0 }).collect()
            }
            Guess::FixedZero => {
                (0..v.len()).map(|dof| if self.fixed[dof] { 0.0 } else { v[dof] }).collect()
            }
            Guess::Explicit => {
                let force = self.force(&Point::new(&old.positions, v, time));
                let free = |dof: usize| if self.fixed[dof] { 0.0 } else { self.h * force[dof] };
                (0..v.len()).map(|dof| v[dof] + free(dof) / self.mass[dof]).collect()
            }
        }
    }

    /// Iterates of Newton's method in a step of implicit Euler, from this guess and by this part of each update, until
    /// they hardly move.
    pub fn iterates(&self, sample: &Sample, guess: Guess, relaxation: f64) -> Vec<Iterate> {
        let (old, time) = (&sample.before, self.time(sample.step));
        let earlier = sample.earlier.as_ref();
        let mut velocities = self.first_guess(guess, time, old);
        let mut all = Vec::new();
        while all.len() < MOST_ITERATES {
            let update = self.update(&mut Memory::default(), time, earlier, old, &velocities);
            let Some(update) = update else { break };
            let next = velocities.iter().zip(&update).map(|(u, delta)| u + relaxation * delta);
            let next: Vec<f64> = next.collect();
            let is_last = next == velocities;
            let sizes = Norm::ALL.map(|norm| self.size(norm, &update));
            all.push(Iterate { velocities: std::mem::replace(&mut velocities, next), sizes });
            if is_last {
                break;
            }
        }
        all
    }

    fn size(&self, norm: Norm, delta: &[f64]) -> f64 {
        let size = || delta.iter().map(|value| value * value).sum::<f64>().sqrt();
        match norm {
            Norm::Euclidean => size(),
            Norm::Largest => delta.iter().fold(0.0, |most, value| value.abs().max(most)),
            Norm::First => delta.first().map_or(0.0, |value| value.abs()),
            Norm::Sum => delta.iter().sum::<f64>().abs(),
            Norm::SignedSum => delta.iter().sum::<f64>(),
            Norm::Positions => self.h * size(),
        }
    }

    /// Newton's update of the velocities.
    fn update(
        &self,
        memory: &mut Memory,
        time: f64,
        earlier: Option<&State>,
        old: &State,
        u: &[f64],
    ) -> Option<Vec<f64>> {
        let kept = self.rules.kept.or(self.rules.first_jacobians.then_some(FIRST_JACOBIANS));
        let displaced = memory.velocities(kept, u).map(<[f64]>::to_vec);
        let displace = |at: &mut Point<'_>| {
            for (x, (first, u)) in at.x.iter_mut().zip(displaced.iter().flatten().zip(u)) {
                *x += self.h * (first - u);
            }
        };
        let mut at = self.force_point(time, earlier, old, u);
        displace(&mut at);
        let force = if self.has_no_force(earlier) { vec![0.0; u.len()] } else { self.force(&at) };
        let mut force = memory.force(kept, force, self.h);
        self.gate(&at, &mut force);
        self.copy_forces(&mut force);
        let size = u.len();
        self.work.add(cost::ENTRY * size * size);
        let jacobian = |quantity: Quantity| {
            let at = self.jacobian_point(quantity, time, earlier, old, u);
            let none = || DMatrix::zeros(size, size);
            at.map_or_else(none, |mut at| {
                displace(&mut at);
                let mut jacobian = match self.rules.differences {
                    Some(differences) => self.differences(quantity, &at, differences),
                    None => self.jacobian(quantity, &at),
                };
                jacobian.column_iter_mut().for_each(|mut column| {
                    self.gate(&at, column.as_mut_slice());
                });
                jacobian
            })
        };
        let both = [Quantity::ByPosition, Quantity::ByVelocity].map(jacobian);
        let [mut k, mut b] = memory.jacobians(kept, both, self.h);
        match self.rules.other {
            Some(Quantity::ByPosition) => k.clone_from(&b),
            Some(Quantity::ByVelocity) => b.clone_from(&k),
            _ => {}
        }
        let n_masses = memory.masses(kept, self.h);
        // Of each row, the factors of both Jacobians that are in the matrix before fixed particles are held, or added after that.
        let factors = |is_late: bool| -> Vec<[f64; 2]> {
            let [late_k, late_b] = self.fixed_rules.late;
            let of = |mass: &f64| {
                let [of_k, of_b] = self.matrix_coefficients(*mass);
                let part = |is_its: bool, factor: f64| if is_its == is_late { factor } else { 0.0 };
                [part(late_k, of_k), part(late_b, of_b)]
            };
            self.mass.iter().map(of).collect()
        };
        let subtract = |matrix: &mut DMatrix<f64>, factors: &[[f64; 2]]| {
            for column in 0..size {
                for (row, [of_k, of_b]) in factors.iter().enumerate() {
                    let side = match self.rules.column_masses {
                        true => self.mass[row] / self.mass[column],
                        false => 1.0,
                    };
                    let at = (row, column);
                    matrix[at] -= side * (of_k * k[at] + of_b * b[at]);
                }
            }
        };
        let mut matrix = DMatrix::zeros(size, size);
        for row in 0..size {
            let mass = self.matrix_mass(row);
            let inertia = n_masses * mass.powi(self.rules.inertia_matrix);
            matrix[(row, row)] = inertia + self.rules.diagonal;
        }
        subtract(&mut matrix, &factors(false));
        let (power, sign) = self.rules.inertia_right;
        let mut right = DVector::from_fn(size, |dof, _| {
            let [is_whole, _] = self.rules.whole_change;
            let kept = if is_whole { 0.0 } else { self.rules.old * old.velocities[dof] };
            let inertia = sign * self.mass[dof].powi(power) * (u[dof] - kept);
            let is_felt = !(self.fixed_rules.hold.unforced && self.fixed[dof]);
            let force = if is_felt { self.force_coefficient(dof) * force[dof] } else { 0.0 };
            force - inertia
        });
        if let Some(factor) = self.rules.stiff_right {
            let factor = factor.of(self.h, 1.0);
            for (row, right) in right.iter_mut().enumerate() {
                let [of_k, _] = self.matrix_coefficients(self.mass[row]);
                *right += factor
                    * of_k
                    * u.iter().enumerate().map(|(dof, u)| k[(row, dof)] * u).sum::<f64>();
            }
        }
        self.hold(&mut matrix, &mut right);
        if self.fixed_rules.late.contains(&true) {
            subtract(&mut matrix, &factors(true));
        }
        let mut delta = match self.rules.slip {
            None => matrix.lu().solve(&right)?,
            Some(slip) => slip.solve(matrix, right),
        };
        if self.fixed_rules.hold.solution {
            let fixed = delta.iter_mut().zip(&self.fixed).filter(|(_, is_fixed)| **is_fixed);
            fixed.for_each(|(delta, _)| *delta = 0.0);
        }
        delta.iter().all(|value| value.is_finite()).then(|| delta.data.into())
    }

    /// The Jacobian by differences of the forces: step, and whether it is made to both sides.
    fn differences(
        &self,
        quantity: Quantity,
        at: &Point<'_>,
        (step, central): (f64, bool),
    ) -> DMatrix<f64> {
        let size = at.x.len();
        let moved = |column: usize, by: f64| {
            let mut at = at.clone();
            let values = if quantity == Quantity::ByVelocity { &mut at.v } else { &mut at.x };
            values[column] += by;
            self.force(&at)
        };
        let base = self.force(at);
        let mut matrix = DMatrix::zeros(size, size);
        for column in 0..size {
            let ahead = moved(column, step);
            let (behind, width) = match central {
                true => (&moved(column, -step), 2.0 * step),
                false => (&base, step),
            };
            for row in 0..size {
                matrix[(row, column)] = (ahead[row] - behind[row]) / width;
            }
        }
        matrix
    }

    /// Multiplies the values on some particles by a factor.
    fn gate(&self, at: &Point<'_>, values: &mut [f64]) {
        let Some(gate) = self.rules.gate else { return };
        for (particle, values) in values.chunks_mut(self.dimension).enumerate() {
            let factor = self.at_particle(at, particle, |measured| gate.factor_of(measured));
            values.iter_mut().for_each(|value| *value *= factor);
        }
    }

    /// The unknowns that are taken for those of a particle.
    fn unknowns(&self, particle: usize, unknowns: Unknowns) -> impl Iterator<Item = usize> + use<> {
        let (count, size) = (self.scene.particles.len(), self.fixed.len());
        let first = particle * self.dimension;
        let (first, stride) = match unknowns {
            Unknowns::Own => (first, 1),
            Unknowns::Index | Unknowns::Number => (particle, 1),
            Unknowns::Axis(axis) => (first + axis, 1),
            Unknowns::ByAxis => (particle, count),
        };
        let most = match unknowns {
            Unknowns::Number | Unknowns::Axis(_) => 1,
            _ => self.dimension,
        };
        (0..most).map(move |place| first + stride * place).filter(move |dof| *dof < size)
    }

    /// Clears the rows, columns and right-hand sides of fixed particles.
    fn hold(&self, matrix: &mut DMatrix<f64>, right: &mut DVector<f64>) {
        let hold = self.fixed_rules.hold;
        let Hold { rows, columns, right: is_right, massless, unit, .. } = hold;
        let of = |particle: usize, unknowns: Unknowns| self.unknowns(particle, unknowns);
        let is_its = |one: &scene::Particle| one.fixed != hold.exchanged;
        for (particle, _) in self.scene.particles.iter().enumerate().filter(|(_, p)| is_its(p)) {
            if is_right {
                of(particle, hold.of_right).for_each(|dof| right[dof] = 0.0);
            }
            if hold.between {
                for (row, column) in self.between_fixed(particle) {
                    matrix[(row, column)] = match (row == column, rows) {
                        (true, true) => 1.0,
                        (true, false) => self.mass[row].powi(self.rules.inertia_matrix),
                        (false, _) => 0.0,
                    };
                }
                continue;
            }
            let particles = &self.scene.particles;
            let is_left = hold.which.is_some_and(|which| !which.includes(particle, particles));
            for dof in of(particle, hold.unknowns).filter(|_| !is_left) {
                if rows {
                    matrix.row_mut(dof).fill(0.0);
                }
                if columns {
                    matrix.column_mut(dof).fill(0.0);
                }
                if rows || columns || unit {
                    matrix[(dof, dof)] = 1.0;
                }
                if massless {
                    matrix[(dof, dof)] -= self.mass[dof];
                }
                let ten_to = |exponent: u8| 10.0_f64.powi(i32::from(exponent));
                let entry = &mut matrix[(dof, dof)];
                match hold.large {
                    Some(Large::Added(exponent)) => *entry += ten_to(exponent),
                    Some(Large::Masses(exponent)) => *entry += ten_to(exponent) * self.mass[dof],
                    Some(Large::Factor(exponent)) => *entry *= ten_to(exponent),
                    None => {}
                }
            }
        }
    }

    /// Rows of a fixed particle with the columns of all fixed ones.
    fn between_fixed(&self, particle: usize) -> impl Iterator<Item = (usize, usize)> + use<'_> {
        let rows = particle * self.dimension..(particle + 1) * self.dimension;
        let columns = || (0..self.fixed.len()).filter(|column| self.fixed[*column]);
        rows.flat_map(move |row| columns().map(move |column| (row, column)))
    }

    /// The velocities of fixed particles.
    fn fix(&self, old: &State, state: &mut State) {
        for dof in (0..self.fixed.len()).filter(|dof| self.fixed[*dof]) {
            if self.fixed_rules.stop {
                state.velocities[dof] = 0.0;
            }
            if self.fixed_rules.doubled {
                state.velocities[dof] += old.velocities[dof];
            }
            if self.fixed_rules.fall {
                let axis = dof % self.dimension;
                let elements = self.scene.forces.iter().filter(|e| e.schema.tag == "simplegravity");
                let g: f64 = elements.map(|element| element.parameters[axis]).sum();
                state.velocities[dof] = old.velocities[dof] + self.h * g;
            }
        }
    }

    /// Shortens the velocities of free particles to the speed limit.
    fn limit(&self, state: &mut State) {
        let Some(limit) = self.rules.speed_limit else { return };
        for (particle, velocity) in state.velocities.chunks_mut(self.dimension).enumerate() {
            let speed = velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
            if speed > limit && !self.fixed[particle * self.dimension] {
                velocity.iter_mut().for_each(|v| *v *= limit / speed);
            }
        }
    }

    /// Whether the velocity of this coordinate's particle is one that the speed limit leaves.
    fn is_limited(&self, dof: usize, velocities: &[f64]) -> bool {
        let first = dof - dof % self.dimension;
        let speed = velocities[first..first + self.dimension].iter().map(|v| v * v).sum::<f64>();
        self.rules.speed_limit.is_some_and(|limit| speed.sqrt() > (1.0 - 1e-9) * limit)
    }

    /// The factors of the old and the new velocity in `x' − x` of a coordinate.
    fn position_rule(&self, dof: usize) -> [f64; 2] {
        if let Some((axis, of)) = self.rules.position_along
            && dof % self.dimension == axis
        {
            return of.map(|part| part * self.h);
        }
        let standard = match self.method {
            Some(OnePoint::Explicit) => [1.0, 0.0, 1.0],
            _ => [0.0, 1.0, 1.0],
        };
        let [old, new, power] = self.rules.position.unwrap_or(standard);
        let h = self.h.powf(power);
        [old * h, new * h]
    }

    fn drift(&self, old: &State, state: &mut State) {
        for (dof, x) in state.positions.iter_mut().enumerate() {
            let [of_old, of_new] = self.position_rule(dof);
            if !self.stands(dof) {
                *x += of_old * old.velocities[dof] + of_new * state.velocities[dof];
            }
        }
    }

    /// The point of a step at which a value is evaluated, from its states.
    fn evaluated_at<'a>(&self, quantity: Quantity, sample: &'a Sample) -> Option<Point<'a>> {
        let time = self.time(sample.step);
        let old = &sample.before;
        let u = match self.method {
            Some(OnePoint::Implicit) => &sample.after.velocities,
            _ => &old.velocities,
        };
        let earlier = sample.earlier.as_ref();
        match quantity {
            Quantity::Force if self.has_no_force(earlier) => None,
            Quantity::Force => Some(self.force_point(time, earlier, old, u)),
            _ => self.jacobian_point(quantity, time, earlier, old, u),
        }
    }

    /// The contribution of a term's quantity to `r`, with its sign: `−h F`, `−h² K δ` or `−h B δ`.
    pub fn contribution(&self, term: usize, quantity: Quantity, sample: &Sample) -> Vec<f64> {
        self.contribution_of(&self.terms[term], quantity, sample)
    }

    /// The contributions of all terms.
    pub fn contributions(&self, sample: &Sample) -> Contributions {
        let of = |term: usize| Quantity::ALL.map(|one| self.contribution(term, one, sample));
        Contributions((0..self.terms.len()).map(of).collect())
    }

    /// The contribution of `change` to `r`, and the number of the changed term; `None` for changes of something else than a
    /// term of the scene.
    pub fn effect(
        &self,
        change: &Change,
        sample: &Sample,
        unchanged: &Contributions,
    ) -> Option<(usize, Vec<f64>)> {
        let (number, model) = self.changed(change)?;
        let mut sum = vec![0.0; self.mass.len()];
        let linearized = self.method == Some(OnePoint::Linearized);
        let changed = change.effect.quantities();
        for quantity in
            Quantity::ALL.into_iter().filter(|one| changed.contains(&self.taken_for(*one)))
        {
            if quantity != Quantity::Force && !linearized {
                continue;
            }
            let old = unchanged.of(number, quantity);
            let new = self.contribution_of(&model, quantity, sample);
            for ((sum, new), old) in sum.iter_mut().zip(new).zip(old) {
                *sum += new - old;
            }
        }
        Some((number, sum))
    }

    /// The pieces of which some quantities of a term consist, its elements or those of a field on each particle: what each
    /// contributes to `r`, and its number by each of these measures.
    pub fn pieces(
        &self,
        term: usize,
        quantities: &[Quantity],
        measures: &[Measure],
        sample: &Sample,
    ) -> Vec<(Vec<f64>, Vec<Option<f64>>)> {
        let Some(at) = quantities.first().and_then(|first| self.evaluated_at(*first, sample))
        else {
            return Vec::new();
        };
        let each = self.each_piece(term, measures, &at).into_iter().map(|(model, values)| {
            let mut sum = vec![0.0; self.mass.len()];
            for quantity in quantities {
                let value = self.contribution_of(&model, *quantity, sample);
                sum.iter_mut().zip(value).for_each(|(sum, value)| *sum += value);
            }
            (sum, values)
        });
        each.collect()
    }

    /// Contribution of all forces on each particle to `r`, and its number by each of these measures.
    pub fn particle_pieces(
        &self,
        measures: &[Measure],
        sample: &Sample,
    ) -> Vec<(Vec<f64>, Vec<Option<f64>>)> {
        let Some(at) = self.evaluated_at(Quantity::Force, sample) else { return Vec::new() };
        let mut sum = vec![0.0; self.mass.len()];
        for (term, quantity) in self.quantities() {
            let value = self.contribution(term, quantity, sample);
            sum.iter_mut().zip(value).for_each(|(sum, value)| *sum += value);
        }
        let of = |particle: usize| {
            let first = particle * self.dimension;
            let mut own = vec![0.0; sum.len()];
            let range = first..first + self.dimension;
            own[range.clone()].copy_from_slice(&sum[range]);
            let values = self.at_particle(&at, particle, |measured| {
                measures.iter().map(|measure| measure.of(measured)).collect()
            });
            (own, values)
        };
        (0..self.scene.particles.len()).map(of).collect()
    }

    /// The solution of the linear system of a step: `v' − v`.
    fn solution(&self, sample: &Sample) -> Vec<f64> {
        let mut solution = change(sample);
        if let Some(of_free) = self.rules.whole {
            for (dof, solution) in solution.iter_mut().enumerate() {
                if !(of_free && self.fixed[dof]) {
                    *solution = sample.after.velocities[dof];
                }
            }
        }
        let each = solution.iter_mut().zip(&self.mass);
        each.for_each(|(solution, mass)| *solution *= power(*mass, -self.rules.scaled));
        solution
    }

    /// The value that is in the place of this one.
    fn taken_for(&self, quantity: Quantity) -> Quantity {
        match (self.rules.other, quantity) {
            (Some(Quantity::ByPosition), Quantity::ByPosition) => Quantity::ByVelocity,
            (Some(Quantity::ByVelocity), Quantity::ByVelocity) => Quantity::ByPosition,
            _ => quantity,
        }
    }

    fn contribution_of(&self, model: &TermModel, quantity: Quantity, sample: &Sample) -> Vec<f64> {
        let linearized = self.method == Some(OnePoint::Linearized);
        if quantity != Quantity::Force && !linearized {
            return vec![0.0; self.mass.len()];
        }
        self.work.add(cost::COORDINATE * self.mass.len());
        let read = self.taken_for(quantity);
        let Some(mut at) = self.evaluated_at(read, sample) else {
            return vec![0.0; self.mass.len()];
        };
        if model.start() == Some(Start::OtherForces) {
            at.given = self.given_by_others(&at, model.term);
        }
        if let Some(State { positions, velocities, .. }) = &sample.earlier {
            at.earlier = Some([positions, velocities]);
        }
        let mut delta = self.solution(sample);
        if let (Some(factor), Quantity::ByPosition) = (self.rules.stiff_right, quantity) {
            let factor = factor.of(self.h, 1.0);
            let velocities = &sample.before.velocities;
            delta.iter_mut().zip(velocities).for_each(|(delta, v)| *delta += factor * v);
        }
        let is_by_columns = self.rules.column_masses && quantity != Quantity::Force;
        if is_by_columns {
            delta.iter_mut().zip(&self.mass).for_each(|(delta, mass)| *delta /= mass);
        }
        let mut value = match self.rules.one_by_one {
            Some((each, moves)) => self.value_one_by_one(model, &at, &sample.after, each, moves),
            None => self.value(model, read, &at, &delta),
        };
        for (dof, value) in value.iter_mut().enumerate() {
            let mass = self.mass[dof];
            let [of_k, of_b] = self.matrix_coefficients(mass);
            *value *= match quantity {
                _ if self.keeps_velocity(dof) || self.is_limited(dof, &sample.after.velocities) => {
                    0.0
                }
                Quantity::Force => -self.force_coefficient(dof),
                Quantity::ByPosition => -of_k,
                Quantity::ByVelocity => -of_b,
            };
            *value *= if is_by_columns { mass } else { 1.0 };
        }
        self.gate(&at, &mut value);
        value
    }

    /// The forces of a term, some coordinates at a time, where those before are at the end of the step.
    fn value_one_by_one(
        &self,
        model: &TermModel,
        at: &Point<'_>,
        after: &State,
        each: Each,
        moves: bool,
    ) -> Vec<f64> {
        let mut at = at.clone();
        let mut all = vec![0.0; at.x.len()];
        for group in each.groups(at.x.len(), self.dimension) {
            let value = self.value(model, Quantity::Force, &at, &[]);
            for dof in group {
                all[dof] = value[dof];
                if moves {
                    at.x[dof] = after.positions[dof];
                }
                at.v[dof] = after.velocities[dof];
            }
        }
        all
    }

    /// The residual of a step of a method with one evaluation; `None` for others, and where it does not show the step: one
    /// that depends on all before it, or a linear system that is not solved.
    pub fn residual(&self, sample: &Sample) -> Option<Residual> {
        let model = self.of_step(sample.step);
        if !std::ptr::eq(model, self) {
            return model.residual(sample);
        }
        let rules = &self.rules;
        let is_one_solve = rules.slip.is_none()
            && rules.differences.is_none()
            && rules.iterations == 1
            && !(rules.lost
                || rules.once
                || rules.restarted.is_some()
                || rules.accumulated.is_some())
            && rules.forces_along.is_none()
            && !(self.fixed_rules.hold.solution
                || self.fixed_rules.hold.large.is_some()
                || self.fixed_rules.stop_moved);
        // Before the first step, nothing is kept.
        let is_alone = sample.step == 0 || !self.remembers();
        let shows = self.substeps == 1 && is_alone && is_one_solve;
        let method = self.method.filter(|_| shows)?;
        let delta = self.solution(sample);
        let of_old = 1.0 - self.rules.old;
        let inertia = |dof: usize| {
            let of_old = if self.rules.whole_change[0] { 1.0 } else { of_old };
            let (mass, old) = (self.mass[dof], of_old * sample.before.velocities[dof]);
            let (right, sign) = self.rules.inertia_right;
            let of_matrix = mass.powi(self.rules.inertia_matrix) + self.rules.diagonal;
            match method {
                OnePoint::Implicit => sign * mass.powi(right) * (delta[dof] + old),
                OnePoint::Linearized => of_matrix * delta[dof] + sign * mass.powi(right) * old,
                OnePoint::Explicit | OnePoint::Symplectic => of_matrix * (delta[dof] + old),
            }
        };
        let mut momentum: Vec<f64> = (0..delta.len())
            .map(|dof| if self.keeps_velocity(dof) { 0.0 } else { inertia(dof) })
            .collect();
        for (term, quantity) in self.quantities() {
            let value = self.contribution(term, quantity, sample);
            momentum.iter_mut().zip(value).for_each(|(sum, value)| *sum += value);
        }
        for (dof, value) in momentum.iter_mut().enumerate() {
            if self.is_limited(dof, &sample.after.velocities) {
                *value = 0.0;
            }
        }
        let position = (0..delta.len()).map(|dof| {
            let [of_old, of_new] = self.position_rule(dof);
            let moved =
                of_old * sample.before.velocities[dof] + of_new * sample.after.velocities[dof];
            let moved = if self.stands(dof) { 0.0 } else { moved };
            sample.after.positions[dof] - sample.before.positions[dof] - moved
        });
        let position = position.collect();
        Some(Residual { momentum, position, stiffness: self.stiffness(sample) })
    }

    /// The terms and quantities that a step uses.
    pub fn quantities(&self) -> Vec<(usize, Quantity)> {
        let linearized = self.method == Some(OnePoint::Linearized);
        let of = |term: usize| Quantity::ALL.map(|quantity| (term, quantity));
        let all = (0..self.terms.len()).flat_map(of);
        all.filter(|(_, quantity)| linearized || *quantity == Quantity::Force).collect()
    }

    fn stiffness(&self, sample: &Sample) -> f64 {
        let moved = (0..self.mass.len()).filter(|dof| !self.keeps_velocity(*dof));
        let mass = moved.map(|dof| self.mass[dof]).fold(0.0, f64::max);
        if !self.is_implicit() {
            return mass;
        }
        let size = |quantity: Quantity| {
            let at = self.evaluated_at(quantity, sample);
            at.map_or(0.0, |at| row_sum(&self.jacobian(quantity, &at)))
        };
        mass + self.h * (self.h * size(Quantity::ByPosition) + size(Quantity::ByVelocity))
    }

    /// Whether the velocity of a fixed particle that no force moves changes in this step, beyond `noise`.
    pub fn moves_fixed(&self, sample: &Sample, noise: f64) -> bool {
        let delta = self.solution(sample);
        let is_kept = |dof: usize| self.fixed[dof] && self.keeps_velocity(dof);
        (0..delta.len()).any(|dof| is_kept(dof) && delta[dof].abs() > noise)
    }

    /// Whether no force changes the velocity of this coordinate.
    fn keeps_velocity(&self, dof: usize) -> bool {
        match self.method {
            Some(OnePoint::Explicit | OnePoint::Symplectic) => self.is_held(dof),
            _ => self.fixed[dof] != self.fixed_rules.hold.exchanged,
        }
    }
}

/// Iterations between which sizes of updates are compared.
const APART: usize = 10;

/// How many such comparisons in a row show a rate.
const STEADY: usize = 5;

/// Whether updates of these sizes can fall below the tolerance within [`MANY_ITERATIONS`]: not so where they grow without
/// bound, or change at a steady rate that is too slow.
fn can_converge(sizes: &[f64], tolerance: f64) -> bool {
    let compared = sizes.len() / APART;
    let &[first, .., last] = sizes else { return true };
    if compared < 2 || !sizes.len().is_multiple_of(APART) {
        return true;
    }
    let before = |number: usize| sizes[sizes.len() - 1 - number * APART];
    if last > 1e3 * first && last > 10.0 * before(1) {
        return false;
    }
    let is_steady = |number: usize| (0.4..2.5).contains(&(before(number) / before(number + 1)));
    if compared <= STEADY || !(0..STEADY).all(is_steady) {
        return true;
    }
    let rate = (last / before(STEADY)).ln() / (STEADY * APART) as f64;
    rate < 0.0 && (tolerance / last).ln() / rate < MANY_ITERATIONS as f64
}

/// What the iterations of a step keep from the first one.
const FIRST_JACOBIANS: Kept = Kept {
    carried: Carried::Again,
    forces: false,
    jacobians: [true; 2],
    inertia: false,
    displacement: false,
};

/// `v' − v`.
fn change(sample: &Sample) -> Vec<f64> {
    let pairs = sample.after.velocities.iter().zip(&sample.before.velocities);
    pairs.map(|(new, old)| new - old).collect()
}

fn row_sum(matrix: &DMatrix<f64>) -> f64 {
    matrix.row_iter().map(|row| row.iter().map(|x| x.abs()).sum()).fold(0.0, f64::max)
}

impl Default for Factor {
    fn default() -> Self {
        Self::number(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::model::NEWTON;
    use super::*;

    #[test]
    fn a_test_ends_newtons_method_at_the_first_update_that_passes_it() {
        let of = |number: usize, size: f64| Iterate {
            velocities: vec![number as f64],
            sizes: [size; Norm::ALL.len()],
        };
        let path = [of(0, 1.0), of(1, 1e-1), of(2, 1e-3), of(3, 1e-9), of(4, 0.0)];
        let end = |newton: Newton| Iterate::last(&path, &newton).map(|last| last.velocities[0]);
        let tested = |tolerance, drops_last| end(Newton { tolerance, drops_last, ..NEWTON });
        assert_eq!(tested(0.5, false), Some(2.0));
        assert_eq!(tested(0.5, true), Some(1.0));
        assert_eq!(tested(1e-12, false), Some(4.0));
        assert_eq!(end(Newton { iterations: 1, ..NEWTON }), Some(1.0));
    }
}
