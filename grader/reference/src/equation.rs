//! Residual of a step in its method's equation, from two states and the reference laws.
//!
//! The equations are those of [`Method`]: explicit substeps or stages, the force at the end of the step or a part of it,
//! or that linearized:
//!
//! ```text
//! explicit      M (v' − v) = Σ c h F             over the kicks, each force at the state before it
//!               x' − x     = Σ c h v             over the drifts, by the velocity before the first kick, after the last,
//!                                                or as kicked so far
//! stages        M (v' − v) = h Σ a F,  x' − x = h Σ b V  over the stages, made again from the start
//! linearized    (M − h² K − h B) (v' − v) = h F          F, K, B at (x + h v, v);  x' = x + h v'
//! implicit      M (v' − v) = h F(x̂, v̂),  x' = x + h v̂    x̂ = x + c (x' − x), v̂ = v + c (v' − v), c the part
//! differences   implicit with y + c (y − y₋) in the place of y = (x, v), and (1 − c) h in the place of h
//! ```
//!
//! The check uses only the simulator's states. The bound of a residual is the rounding error of its terms plus the
//! effect of the method's tolerance `τ` for the last update, for a particle with the row sums `k` and `b` of its
//! derivatives:
//!
//! ```text
//! 256 ε (m (|v| + |v'|) + h |F| + h k |x| + (h² k + h b) (|v| + |v'|)) + 4 (m + h² k + h b) τ
//! ```
//!
//! A tolerance excuses a missing update, but no particle that stays at rest: where `x' = x` and `v' = 0`, `τ` is 0.
//!
//! 256 is the backward error at which the simulator accepts a linear solution, `8 p`, for the 28 entries of the
//! fullest row in the suite. Numbers below 2⁻¹⁰²² are multiples of 2⁻¹⁰⁷⁴ = ε 2⁻¹⁰²² and have the same rounding error
//! as 2⁻¹⁰²². This is added to the size of each term: `m + h² k + h b` times for a velocity, once for a force.
//! The rounding error of a stage is that of its terms, plus the errors of the stages before it:
//!
//! ```text
//! δF = |F| + k δX + b δV        δV = |v| + |V| + h Σ |a| (|F| + δF)/m        δX = |x| + |X| + h Σ |b| (|V| + δV)
//! ```
//!
//! Of a controlled step, the parts depend on the last bits of the estimate, and each may be wrong by the tolerance: the
//! bound is the tolerance times the number of parts, times 4 for errors that grow in the step.
//!
//! A solver may be backward stable by norm alone, and not row by row: one that takes `A` for symmetric where it is so relative
//! to its largest entry, or a singular value decomposition. By [`Equation::solved_by_norm`], a linearized step may also leave
//! `64 ε ‖A‖ ‖v' − v‖` in a row, of the largest row sum and the largest change, but for particles that no derivative acts on.
//!
//! A method with a fixed number of rounds solves no equation, so only `x' = x + h v'` is checked. Cost: two or three
//! evaluations of the force per step.

use scene::Scene;
use scene::schema::Convergence;

use crate::law::Scale;
use crate::laws::Laws;
use crate::method::{Arithmetic, Method, Pair, Substep, Tableau};

const ROUNDING: f64 = 256.0 * f64::EPSILON;

/// Backward error of a solver that is stable by norm: some `ε` times the number of unknowns.
const BY_NORM: f64 = 64.0 * f64::EPSILON;

/// Smaller numbers have the same rounding error as this one.
const SMALLEST: f64 = f64::MIN_POSITIVE;

/// Positions and velocities, `n·D`.
#[derive(Debug, Clone, Default)]
pub struct State {
    /// Positions.
    pub x: Vec<f64>,
    /// Velocities.
    pub v: Vec<f64>,
}

/// The equations of one scene.
pub struct Equation {
    laws: Laws,
    method: Method,
    /// The largest last update of the velocities.
    tolerance: f64,
    /// The largest estimated error of a part of a controlled step.
    estimate: f64,
    /// Backward error by norm of the solver of a linearized step.
    by_norm: f64,
    h: f64,
    masses: Vec<f64>,
    fixed: Vec<bool>,
    axes: usize,
}

/// The start of an implicit step.
struct Start {
    state: State,
    /// Sizes of the terms of its coordinates.
    sizes: State,
    h: f64,
    time: f64,
}

impl Start {
    fn of(state: &State, h: f64, time: f64) -> Self {
        let sizes = |values: &[f64]| values.iter().map(|value| value.abs()).collect();
        let sizes = State { x: sizes(&state.x), v: sizes(&state.v) };
        Self { state: state.clone(), sizes, h, time }
    }

    /// The start of the rest of the step, after a part of the step from `earlier` is made once more.
    fn after(mut self, earlier: &State, part: f64) -> Self {
        let repeat = |values: &mut [f64], sizes: &mut [f64], earlier: &[f64]| {
            for ((value, size), earlier) in values.iter_mut().zip(sizes).zip(earlier) {
                *value += part * (*value - earlier);
                *size += part * (*size + earlier.abs());
            }
        };
        repeat(&mut self.state.x, &mut self.sizes.x, &earlier.x);
        repeat(&mut self.state.v, &mut self.sizes.v, &earlier.v);
        self.time += part * self.h;
        self.h *= 1.0 - part;
        self
    }
}

/// Evaluates stages of a step that starts at this time.
struct Stages<'a> {
    equation: &'a Equation,
    time: f64,
    /// Where, if it is kept.
    states: Option<Vec<State>>,
}

impl Arithmetic for Stages<'_> {
    fn force(&mut self, x: &[f64], v: &[f64], after: f64) -> Vec<f64> {
        if let Some(states) = &mut self.states {
            states.push(State { x: x.to_vec(), v: v.to_vec() });
        }
        self.equation.laws.force(x, v, self.time + after)
    }

    fn kick(&self, v: &mut [f64], force: &[f64], h: f64) {
        for (dof, (v, force)) in v.iter_mut().zip(force).enumerate() {
            let particle = dof / self.equation.axes;
            if !self.equation.fixed[particle] {
                *v += h * force / self.equation.masses[particle];
            }
        }
    }
}

/// The largest residual so far, as a multiple of its bound.
#[derive(Default)]
struct Worst(f64);

impl Worst {
    fn note(&mut self, residual: f64, allowed: f64) {
        let excess = match residual == 0.0 {
            true => 0.0,
            // A bound that overflows bounds nothing.
            false if allowed.is_finite() => residual.abs() / allowed,
            false => f64::INFINITY,
        };
        self.0 = if excess > self.0 || excess.is_nan() { excess } else { self.0 };
    }

    /// `x' − x = moved`, of terms of this size.
    fn note_drift(&mut self, start: f64, end: f64, (moved, size): (f64, f64)) {
        let allowed = ROUNDING * (start.abs() + end.abs() + size + SMALLEST);
        self.note(end - start - moved, allowed);
    }
}

impl Equation {
    /// Those of `scene`.
    pub fn new(scene: &Scene) -> Self {
        Self {
            laws: Laws::new(scene),
            method: Method::of(scene.integrator.equation),
            tolerance: scene.integrator.convergence.tolerance(scene),
            estimate: match scene.integrator.convergence {
                Convergence::ErrorEstimate(name) => scene.integrator_options.number(name),
                _ => 0.0,
            },
            by_norm: 0.0,
            h: scene.time_step,
            masses: scene.particles.iter().map(|particle| particle.mass).collect(),
            fixed: scene.particles.iter().map(|particle| particle.fixed).collect(),
            axes: scene.dimension.count(),
        }
    }

    /// Those of `scene`, with linear systems solved as accurately as is usual relative to the largest entry of the matrix.
    pub fn solved_by_norm(scene: &Scene) -> Self {
        Self { by_norm: BY_NORM, ..Self::new(scene) }
    }

    /// For the step from `from`, which starts at `time`, to `to`: the largest residual as a multiple of its bound, and
    /// the sum of the bounds. `earlier` is the state one step before `from`, which only two-step methods use; their first
    /// step has none.
    pub fn excess(
        &self,
        earlier: Option<&State>,
        from: &State,
        to: &State,
        time: f64,
    ) -> (f64, f64) {
        let h = self.h;
        match self.method.with_earlier(earlier.is_some()) {
            Method::Explicit(substeps) => self.excess_of_substeps(substeps, from, to, time),
            Method::Stages(tableau) => self.excess_of_stages(tableau, from, to, time),
            Method::Controlled(pair) => self.excess_of_control(pair, from, to, time),
            Method::Backward { linearized, part } => {
                self.excess_of_end((Some(linearized), part), &Start::of(from, h, time), to)
            }
            Method::Differences { repeated } => {
                let start = Start::of(from, h, time).after(earlier.unwrap_or(from), repeated);
                self.excess_of_end((Some(false), 1.0), &start, to)
            }
            Method::Rounds => self.excess_of_end((None, 1.0), &Start::of(from, h, time), to),
        }
    }

    /// The same for an explicit method.
    fn excess_of_substeps(
        &self,
        substeps: &[Substep],
        from: &State,
        to: &State,
        time: f64,
    ) -> (f64, f64) {
        let h = self.h;
        let is_kick = |substep: &&Substep| !matches!(substep, Substep::Drift(_));
        let mut kicks_left = substeps.iter().filter(is_kick).count();
        let (mut x, mut v, mut drifted) = (from.x.clone(), from.v.clone(), 0.0);
        // Per coordinate: change of momentum, sum of its terms' magnitudes, change of position, stiffness.
        let size = x.len();
        let [mut given, mut terms, mut moved, mut stiffness] = [(); 4].map(|()| vec![0.0; size]);
        for substep in substeps {
            let before = v.clone();
            if let Substep::Both(c) | Substep::Kick(c) = *substep {
                let force = self.laws.force(&x, &v, time + drifted);
                let scales = self.laws.scales_of_rounded(&x, &v, time + drifted);
                for dof in (0..size).filter(|dof| !self.fixed[dof / self.axes]) {
                    let scale = scales[dof / self.axes];
                    let mass = self.masses[dof / self.axes];
                    given[dof] += c * h * force[dof];
                    terms[dof] += c * h * scale.force;
                    let by_position = c * h * scale.by_position;
                    stiffness[dof] += c * h * (h * scale.by_position + scale.by_velocity);
                    // The intermediate state has rounding errors too.
                    if drifted > 0.0 {
                        terms[dof] += by_position * (from.x[dof].abs() + to.x[dof].abs());
                    }
                    v[dof] += c * h * force[dof] / mass;
                }
                kicks_left -= 1;
                if kicks_left == 0 {
                    v.clone_from(&to.v);
                }
            }
            if let Substep::Both(c) | Substep::Drift(c) = *substep {
                let along = if matches!(substep, Substep::Both(_)) { &before } else { &v };
                for dof in 0..size {
                    moved[dof] += c * h * along[dof];
                    x[dof] = from.x[dof] + moved[dof];
                }
                drifted += c * h;
            }
        }
        let mut worst = Worst::default();
        for ((start, end), moved) in from.x.iter().zip(&to.x).zip(&moved) {
            worst.note_drift(*start, *end, (*moved, moved.abs()));
        }
        let mut sum = 0.0;
        for dof in 0..size {
            let change = to.v[dof] - from.v[dof];
            if self.fixed[dof / self.axes] {
                worst.note(change, 0.0);
                continue;
            }
            let mass = self.masses[dof / self.axes];
            let mut rounding = mass * (from.v[dof].abs() + to.v[dof].abs()) + terms[dof];
            rounding += (mass + stiffness[dof] + 1.0) * SMALLEST;
            sum += ROUNDING * rounding;
            worst.note(mass * change - given[dof], ROUNDING * rounding);
        }
        (worst.0, sum)
    }

    /// The same for a method of stages.
    fn excess_of_stages(
        &self,
        tableau: &Tableau,
        from: &State,
        to: &State,
        time: f64,
    ) -> (f64, f64) {
        let size = from.x.len();
        let mut stages = Stages { equation: self, time, states: Some(Vec::new()) };
        let slopes = tableau.slopes(&mut stages, self.h, &from.x, &from.v);
        let states = stages.states.unwrap_or_default();
        let mass = |dof: usize| self.masses[dof / self.axes];
        let free = |dof: &usize| !self.fixed[dof / self.axes];
        // Bounds of rounding errors of the stages, in units of ε: of each coordinate's force, and the largest of a
        // velocity.
        let (mut of_forces, mut of_velocities): (Vec<Vec<f64>>, Vec<f64>) = Default::default();
        let pushed = |of_forces: &[Vec<f64>], row: &[f64], dof: usize| -> f64 {
            let terms = row.iter().zip(of_forces);
            terms.map(|(c, force)| (c * self.h).abs() * force[dof]).sum()
        };
        let moved = |of_velocities: &[f64], row: &[f64], dof: usize| -> f64 {
            let terms = row.iter().zip(&slopes.velocities).zip(of_velocities);
            terms.map(|((c, u), rounding)| (c * self.h).abs() * (u[dof].abs() + rounding)).sum()
        };
        for (stage, at) in tableau.stages.iter().zip(&states) {
            let scales = self.laws.scales_of_rounded(&at.x, &at.v, time + stage.time() * self.h);
            let largest = |of: &dyn Fn(usize) -> f64| (0..size).map(of).fold(0.0, f64::max);
            let of_velocity = largest(&|dof| {
                let pushed = pushed(&of_forces, stage.velocity, dof) / mass(dof);
                from.v[dof].abs() + at.v[dof].abs() + if free(&dof) { pushed } else { 0.0 }
            });
            of_velocities.push(of_velocity);
            let of_position = largest(&|dof| {
                from.x[dof].abs() + at.x[dof].abs() + moved(&of_velocities, stage.position, dof)
            });
            let of_force = |dof: usize| {
                let scale = scales[dof / self.axes];
                scale.force + scale.by_position * of_position + scale.by_velocity * of_velocity
            };
            of_forces.push((0..size).map(of_force).collect());
        }
        let mut worst = Worst::default();
        let mut sum = 0.0;
        for dof in 0..size {
            let weighted = |row: &[f64], values: &[Vec<f64>]| -> f64 {
                row.iter().zip(values).map(|(c, value)| c * self.h * value[dof]).sum()
            };
            let terms = moved(&of_velocities, tableau.end.position, dof);
            let drifted = weighted(tableau.end.position, &slopes.velocities);
            worst.note_drift(from.x[dof], to.x[dof], (drifted, terms));
            let change = to.v[dof] - from.v[dof];
            if !free(&dof) {
                worst.note(change, 0.0);
                continue;
            }
            let mut rounding = mass(dof) * (from.v[dof].abs() + to.v[dof].abs());
            rounding += pushed(&of_forces, tableau.end.velocity, dof);
            rounding += (mass(dof) + 1.0) * SMALLEST;
            sum += ROUNDING * rounding;
            let given = weighted(tableau.end.velocity, &slopes.forces);
            worst.note(mass(dof) * change - given, ROUNDING * rounding);
        }
        (worst.0, sum)
    }

    /// The same for a step divided by error control, made again by the laws.
    fn excess_of_control(&self, pair: &Pair, from: &State, to: &State, time: f64) -> (f64, f64) {
        let mut stages = Stages { equation: self, time, states: None };
        let (mut x, mut v) = (from.x.clone(), from.v.clone());
        let tolerance = self.estimate;
        let parts = pair.step(&mut stages, (self.h, tolerance), &mut x, &mut v);
        let Some(parts) = parts else { return (f64::INFINITY, 0.0) };
        let allowed = 4.0 * parts as f64 * (tolerance + ROUNDING);
        let mut worst = Worst::default();
        let mut sum = 0.0;
        for dof in 0..x.len() {
            worst.note(to.x[dof] - x[dof], allowed * (1.0 + x[dof].abs()));
            if self.fixed[dof / self.axes] {
                worst.note(to.v[dof] - from.v[dof], 0.0);
                continue;
            }
            let of_velocity = allowed * (1.0 + v[dof].abs());
            sum += self.masses[dof / self.axes] * of_velocity;
            worst.note(to.v[dof] - v[dof], of_velocity);
        }
        (worst.0, sum)
    }

    /// The same for a method with the force at the end of a part of the step, linearized or not. `None` stands for
    /// rounds, of which only the positions are checked.
    fn excess_of_end(
        &self,
        (linearized, part): (Option<bool>, f64),
        Start { state: from, sizes, h, time }: &Start,
        to: &State,
    ) -> (f64, f64) {
        let h = *h;
        let mut worst = Worst::default();
        let between = |start: &[f64], end: &[f64]| -> Vec<f64> {
            start.iter().zip(end).map(|(start, end)| (1.0 - part) * start + part * end).collect()
        };
        let ends = [between(&from.x, &to.x), between(&from.v, &to.v)];
        for (dof, v) in ends[1].iter().enumerate() {
            let size = (1.0 - part) * from.v[dof].abs() + part * to.v[dof].abs();
            let combined = sizes.x[dof] - from.x[dof].abs();
            worst.note_drift(from.x[dof], to.x[dof], (h * v, h * size + combined));
        }
        let moved: Vec<f64> = from.x.iter().zip(&from.v).map(|(x, v)| x + h * v).collect();
        let change: Vec<f64> = to.v.iter().zip(&from.v).map(|(end, start)| end - start).collect();
        let at = time + part * h;
        let (x, v) = match linearized {
            Some(true) => (&moved, &from.v),
            // For rounds, used only for the bound.
            Some(false) | None => (&ends[0], &ends[1]),
        };
        let mut force = match linearized {
            Some(_) => self.laws.force(x, v, at),
            None => Vec::new(),
        };
        let scales = self.laws.scales_of_rounded(x, v, at);
        if linearized == Some(true) {
            let free = |dof: &usize| !self.fixed[dof / self.axes];
            let along = |scale: f64| -> Vec<f64> {
                let of = |dof: usize| if free(&dof) { scale * change[dof] } else { 0.0 };
                (0..change.len()).map(of).collect()
            };
            let linear = self.laws.along([x, v], [&along(h), &along(1.0)], at);
            force.iter_mut().zip(linear).for_each(|(force, linear)| *force += linear);
        }
        let largest = |values: &[f64]| values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        let size = largest(x);
        let speed = largest(&sizes.v) + largest(&to.v);
        let stays = |particle: usize| {
            let mut dofs = particle * self.axes..(particle + 1) * self.axes;
            dofs.all(|dof| to.v[dof] == 0.0 && to.x[dof] == from.x[dof])
        };
        let stiffness = |particle: usize| {
            let Scale { by_position, by_velocity, .. } = scales[particle];
            h * h * by_position + h * by_velocity
        };
        // Where a program keeps the rows of fixed particles, they hold the mass or 1.
        let rows = (0..self.masses.len()).map(|particle| {
            let row = self.masses[particle] + stiffness(particle);
            if self.fixed[particle] { row.max(1.0) } else { row }
        });
        let by_norm = match linearized {
            Some(true) => self.by_norm * rows.fold(0.0, f64::max) * largest(&change),
            _ => 0.0,
        };
        let mut sum = 0.0;
        for (dof, change) in change.iter().enumerate() {
            let particle = dof / self.axes;
            if self.fixed[particle] {
                worst.note(*change, 0.0);
                continue;
            }
            let mass = self.masses[particle];
            let Scale { force: terms, by_position, .. } = scales[particle];
            let stiffness = stiffness(particle);
            let mut rounding = mass * (sizes.v[dof] + to.v[dof].abs()) + h * terms;
            rounding += (mass + stiffness + 1.0) * SMALLEST;
            rounding += h * by_position * size + stiffness * speed;
            let tolerance = if stays(particle) { 0.0 } else { self.tolerance };
            let solver = if stiffness > 0.0 { by_norm } else { 0.0 };
            let allowed = ROUNDING * rounding + 4.0 * (mass + stiffness) * tolerance + solver;
            sum += allowed;
            if linearized.is_some() {
                worst.note(mass * change - h * force[dof], allowed);
            }
        }
        (worst.0, sum)
    }
}
