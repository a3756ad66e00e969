//! Fast mass-spring: implicit Euler for springs, minimised by alternating local and global steps.
//!
//! ```text
//! E(x) = 1/(2h²) Σ m_i |x_i − x̃_i|² + Σ_springs k/2 (|x_i − x_j| − l0)² − Σ x_i·f_i        x̃ = x^n + h v^n
//! local:   d = l0 (x_i − x_j)/|x_i − x_j|                  of each spring, from the iterate; x^n at first
//! global:  Q x = Σ k A_eᵀ d_e + M/h² x̃ + f                 Q = Σ k A_eᵀ A_e + M/h², A_e x = x_i − x_j
//! v^{n+1} = (x^{n+1} − x^n)/h
//! ```
//!
//! `f` is every force but the springs' elastic part, taken at the start of the step: gravity, drag, damping of
//! springs and all others are explicit. A scene of springs and constant forces converges to implicit Euler's
//! step, of which this is a descent with the constant matrix `Q`: no round increases `E`. Each step takes
//! `iterations` rounds, or fewer where `tolerance` is above 0 and `max |x_{k+1} − x_k|/h < tolerance`, in the
//! maximum norm over all coordinates. A step that does not reach the tolerance ends all the same; the
//! statistics count it. Cost: one factorisation of the `N × N` matrix a run; a round is one pass over the
//! springs and one substitution for all coordinates together.
//!
//! A spring whose ends coincide in the iterate has no direction, and is an error that names it; one of rest
//! length zero needs none, for its `d` is 0. Springs of stiffness 0 count for nothing, nor do those between two
//! fixed particles that are left out.
//!
//! Fixed particles are left out of `Q` (`pins="elimination"`), or are unknowns that `w/2 |x_i − x_i^0 − t v_i|²`
//! holds near where they should be (`pins="penalty"`), `w` being `pin_weight`. As in the assignment, a
//! penalised pin then feels forces and gives way by their size over `w`; its velocity stays what it was.
//!
//! With `acceleration="lbfgs"` a round learns from the last five (`lbfgs.rs`), and still never increases `E`. Of
//! three methods tried it took the least time on stiff chains. Anderson acceleration (Peng et al. 2018) needs about
//! as many rounds, each of them dearer, and was as fast or a little faster on nets and cloth; Chebyshev's (Wang
//! 2015) needs more rounds. `benches/local_global.rs` measures it against the plain method.
//!
//! Source: Liu, Bargteil, O'Brien and Kavan, "Fast Simulation of Mass-Spring Systems", 2013; Jacobson,
//! "Computer Graphics – Mass-Spring Systems", the assignment that is built on it.

use self::global::Storage;
use self::lbfgs::Lbfgs;
use self::local::ElasticSpring;
use self::objective::{Energy, StepObjective, Terms, largest};
use sparse::linear::LinearSolver;

use super::backward::Point;
use super::record::Recording;
use super::{Integrator, IntegratorKind, Interrupt, IterationRecorder, Step, StepError};
use crate::force::{Degenerate, ForceKind};
use crate::statistics::{RoundsEnd, Statistics};
use crate::system::{BuildForce, System};
use scene::schema::{
    AccuracySetting, Convergence, Domain, Family, IntegratorSchema, Matrix, OptionKind,
    OptionSchema, OptionText, Order, Refusal, Stencil, StepEquation,
};
use scene::{ForceElement, Scene};

mod global;
mod lbfgs;
mod local;
mod objective;
mod panels;

/// The force that the local step projects on.
const SPRING: &str = "springforce";

pub(super) static KIND: IntegratorKind = IntegratorKind {
    schema: IntegratorSchema {
        name: "fast-mass-spring",
        aliases: &["local-global"],
        summary: "springs implicit by local and global steps, the rest explicit",
        formula: "implicit Euler for springs, every other force (and the damping of springs) as of `(q, v)`: rounds of `d = l0 n` for each spring from the iterate, then `Q q' = Σ k Aᵀ d + M/h² (q + h v) + f` with `Q = Σ k AᵀA + M/h²`; `v' = (q' − q)/h`",
        equation: StepEquation::LocalGlobal,
        family: Family::Minimization,
        matrix: Matrix::Constant,
        convergence: Convergence::Rounds("iterations"),
        order: Order::always(1),
        options: &[
            OptionSchema {
                name: "iterations",
                meaning: "rounds of a local and a global step, in each time step",
                kind: OptionKind::Count { least: 1, default: 50, at_most: None },
                formats: OptionText {
                    values: "whole number, 1 or more",
                    meaning: "rounds in each step",
                },
                accuracy: &[
                    AccuracySetting { value: "1", converges: true },
                    AccuracySetting { value: "10", converges: true },
                    AccuracySetting { value: "100", converges: true },
                ],
            },
            OptionSchema {
                name: "tolerance",
                meaning: "largest change of a coordinate over h that ends the rounds early; 0: never",
                kind: OptionKind::Number { domain: Domain::NonNegative, default: 0.0 },
                formats: OptionText {
                    values: "number, 0 or more",
                    meaning: "the rounds of a step end when the largest change of a coordinate in a round, divided by `dt`, is below it; 0: never. A step that does not reach it ends after `iterations` rounds, and `--stats` counts it",
                },
                accuracy: &[],
            },
            OptionSchema {
                name: "pins",
                meaning: "how fixed particles stay: left out of the equations, or held by a penalty",
                kind: OptionKind::Choice { words: &["elimination", "penalty"] },
                formats: OptionText {
                    values: "`elimination`, `penalty`",
                    meaning: "fixed particles are left out of the equations, or held near their prescribed positions by `w/2 \\|x − x_0 − t v\\|²`; a penalised pin feels forces, and keeps its velocity",
                },
                accuracy: &[],
            },
            OptionSchema {
                name: "pin_weight",
                meaning: "stiffness of the penalty that holds a fixed particle",
                kind: OptionKind::Number { domain: Domain::Positive, default: 1e10 },
                formats: OptionText { values: "number above 0", meaning: "`w` of the penalty" },
                accuracy: &[],
            },
            OptionSchema {
                name: "matrix",
                meaning: "how the matrix is factorised, auto by its size",
                kind: OptionKind::Choice { words: &["auto", "dense", "sparse"] },
                formats: OptionText {
                    values: "`auto`, `dense`, `sparse`",
                    meaning: "how `Q` is factorised; the answers differ by rounding alone",
                },
                accuracy: &[],
            },
            OptionSchema {
                name: "acceleration",
                meaning: "how a round learns from those before it",
                kind: OptionKind::Choice { words: &["none", "lbfgs"] },
                formats: OptionText {
                    values: "`none`, `lbfgs`",
                    meaning: "`lbfgs` uses the previous rounds to reach the same minimiser in fewer rounds",
                },
                accuracy: &[],
            },
        ],
        refuses,
    },
    build_2d: build::<2, 2>,
    // Four components fill a vector register; the fourth is 0.
    build_3d: build::<3, 4>,
};

fn refuses(element: &ForceElement) -> Option<Refusal> {
    let other_spring = element.schema.stencil == Stencil::Edge && element.schema.tag != SPRING;
    other_spring.then_some(Refusal {
        because: "is no Hookean spring of constant rest length, which the local step projects on",
        remedy: "use projected-newton or implicit-euler",
    })
}

/// `P` is `D`, padded to what vector registers hold.
fn build<const D: usize, const P: usize>(
    scene: &Scene,
    system: &System<D>,
    solver: LinearSolver,
) -> Box<dyn Integrator<D>>
where
    ForceKind: BuildForce<D>,
{
    let options = &scene.integrator_options;
    let penalty = options.choice("pins") == "penalty";
    Box::new(FastMassSpring::<D, P> {
        iterations: options.count("iterations"),
        tolerance: options.number("tolerance"),
        pin_weight: penalty.then(|| options.number("pin_weight")),
        storage: match (solver, options.choice("matrix")) {
            (LinearSolver::Dense, _) | (LinearSolver::Auto, "dense") => Some(Storage::Dense),
            (LinearSolver::Sparse, _) | (LinearSolver::Auto, "sparse") => Some(Storage::Sparse),
            (LinearSolver::Auto, _) => None,
        },
        springs: elastic_springs(scene, penalty),
        initial: scene.particles.iter().map(|particle| first(particle.position)).collect(),
        external: External::new(scene, penalty),
        force: vec![0.0; system.n_particles() * D],
        accelerated: options.choice("acceleration") == "lbfgs",
        objective: None,
        lbfgs: None,
        interrupt: Interrupt::default(),
        recording: Recording::default(),
    })
}

/// The springs that pull: not those of no stiffness, nor, without a penalty, those between two fixed particles.
fn elastic_springs(scene: &Scene, penalty: bool) -> Vec<ElasticSpring> {
    let numbered = scene.forces.iter().enumerate();
    let springs = numbered.filter(|(_, force)| force.schema.tag == SPRING);
    let elastic = springs.filter_map(|(element, force)| {
        let ends = force.pair()?;
        let [stiffness, rest_length] = ["k", "l0"].map(|name| force.parameter(name));
        let moves = penalty || ends.iter().any(|end| !scene.particles[*end].fixed);
        (moves && stiffness > 0.0).then_some(ElasticSpring {
            ends,
            stiffness,
            rest_length,
            element,
        })
    });
    elastic.collect()
}

/// Every force but the springs' elastic part.
struct External<const D: usize> {
    system: System<D>,
    /// The number that each of its elements has in the scene.
    elements: Vec<usize>,
}

impl<const D: usize> External<D>
where
    ForceKind: BuildForce<D>,
{
    /// A system without the springs' stiffness; with a penalty, fixed particles feel it too.
    fn new(scene: &Scene, penalty: bool) -> Self {
        let mut scene = scene.clone();
        let forces = std::mem::take(&mut scene.forces).into_iter().enumerate();
        let mut elements = Vec::new();
        for (element, mut force) in forces {
            if force.schema.tag == SPRING {
                if force.parameter("b") == 0.0 {
                    continue;
                }
                (*force.parameter_mut("k"), *force.parameter_mut("l0")) = (0.0, 0.0);
            }
            elements.push(element);
            scene.forces.push(force);
        }
        if penalty {
            scene.particles.iter_mut().for_each(|particle| particle.fixed = false);
        }
        Self { system: System::new(&scene), elements }
    }
}

struct FastMassSpring<const D: usize, const P: usize> {
    iterations: u64,
    tolerance: f64,
    pin_weight: Option<f64>,
    storage: Option<Storage>,
    springs: Vec<ElasticSpring>,
    initial: Vec<[f64; P]>,
    external: External<D>,
    /// Sum of the external forces, `n·D`.
    force: Vec<f64>,
    accelerated: bool,
    /// Built in the first step, and rebuilt if the time step changes.
    objective: Option<StepObjective<P>>,
    /// Built in the first step of an accelerated run.
    lbfgs: Option<Lbfgs<P>>,
    interrupt: Interrupt,
    recording: Recording,
}

/// The first components, the rest 0.
fn first<const P: usize>(vector: [f64; 3]) -> [f64; P] {
    padded(&vector[..P.min(3)])
}

fn padded<const P: usize>(values: &[f64]) -> [f64; P] {
    let mut vector = [0.0; P];
    vector[..values.len()].copy_from_slice(values);
    vector
}

impl<const D: usize, const P: usize> Integrator<D> for FastMassSpring<D, P> {
    fn step(&mut self, system: &System<D>, step: Step<'_>) -> Result<(), StepError> {
        let Step { size: h, time, positions, velocities, statistics, .. } = step;
        self.evaluate_external(positions, velocities, time)?;
        statistics.force_evaluations += 1;
        let mut objective = match self.objective.take() {
            Some(objective) if objective.h == h => objective,
            _ => StepObjective::new(&self.terms(system), h, statistics)?,
        };
        self.fill(&mut objective, system, time, positions, velocities);
        let mut recording = std::mem::take(&mut self.recording);
        let mut iterate = if recording.is_on() { velocities.to_vec() } else { Vec::new() };
        let mut record = |round, objective: &StepObjective<P>, step_length| {
            if !recording.is_on() {
                return;
            }
            for (particle, u) in objective.particles.iter().zip(&objective.u) {
                if !system.fixed()[*particle] {
                    let of_particle = &mut iterate[particle * D..particle * D + D];
                    of_particle.iter_mut().zip(u).for_each(|(velocity, u)| *velocity = u / h);
                }
            }
            let time = time + h;
            let point = Point { h, time, positions, velocities, iterate: &iterate };
            recording.record(system, point, round, (step_length, 0));
        };
        let minimised = self.minimise(&mut objective, statistics, &mut record);
        self.recording = recording;
        minimised?;
        for (slot, particle) in objective.particles.iter().enumerate() {
            let of_particle = particle * D..particle * D + D;
            let (x, v) = (&mut positions[of_particle.clone()], &mut velocities[of_particle]);
            match objective.u.get(slot) {
                Some(u) => {
                    for axis in 0..D {
                        x[axis] += u[axis];
                        if !system.fixed()[*particle] {
                            v[axis] = u[axis] / h;
                        }
                    }
                }
                None => (0..D).for_each(|axis| x[axis] += h * v[axis]),
            }
        }
        self.objective = Some(objective);
        Ok(())
    }

    fn record_by(&mut self, recorder: IterationRecorder) -> bool {
        self.recording = Recording::to(recorder);
        true
    }

    fn interrupt_by(&mut self, interrupt: &Interrupt) {
        self.interrupt = interrupt.clone();
    }
}

impl<const D: usize, const P: usize> FastMassSpring<D, P> {
    fn terms<'a>(&'a self, system: &'a System<D>) -> Terms<'a> {
        Terms {
            masses: system.masses(),
            fixed: system.fixed(),
            springs: &self.springs,
            pin_weight: self.pin_weight,
            storage: self.storage,
        }
    }

    fn evaluate_external(
        &mut self,
        positions: &[f64],
        velocities: &[f64],
        time: f64,
    ) -> Result<(), Degenerate> {
        let External { system, elements } = &self.external;
        let evaluated = system.force(positions, velocities, time, &mut self.force);
        evaluated.map_err(|error| Degenerate { element: elements[error.element], ..error })
    }

    /// Puts the start of the step into `objective`.
    fn fill(
        &self,
        objective: &mut StepObjective<P>,
        system: &System<D>,
        time: f64,
        positions: &[f64],
        velocities: &[f64],
    ) {
        let (h, n_unknowns) = (objective.h, objective.n_unknowns());
        for (slot, &particle) in objective.particles.iter().enumerate() {
            let of_particle = particle * D..particle * D + D;
            let x: [f64; P] = padded(&positions[of_particle.clone()]);
            let v: [f64; P] = padded(&velocities[of_particle.clone()]);
            objective.start[slot] = x;
            if slot >= n_unknowns {
                objective.drift[slot] = v.map(|v| h * v);
                continue;
            }
            let force: [f64; P] = padded(&self.force[of_particle]);
            let inertia = system.masses()[particle] / h;
            let load = &mut objective.load[slot];
            *load = std::array::from_fn(|axis| inertia * v[axis] + force[axis]);
            if let (Some(weight), true) = (self.pin_weight, system.fixed()[particle]) {
                for axis in 0..P {
                    let target = self.initial[particle][axis] + (time + h) * v[axis];
                    load[axis] += weight * (target - x[axis]);
                }
            }
        }
    }

    /// The rounds of a step.
    fn minimise(
        &mut self,
        objective: &mut StepObjective<P>,
        statistics: &mut Statistics,
        record: &mut Record<'_, P>,
    ) -> Result<(), StepError> {
        let lbfgs = self.accelerated.then(|| {
            let lbfgs = self.lbfgs.get_or_insert_with(|| Lbfgs::new(objective.n_unknowns()));
            lbfgs.forget();
            lbfgs
        });
        objective.start()?;
        record(0, objective, None);
        let mut rounds = Rounds {
            most: self.iterations,
            tolerance: self.tolerance,
            made: 0,
            norms: RoundNorms::default(),
            interrupt: &self.interrupt,
        };
        let (reached, end) = match lbfgs {
            Some(lbfgs) => {
                let reached = rounds.accelerated(objective, lbfgs, statistics, record)?;
                let is_plain = rounds.made == 1;
                let change =
                    if is_plain { largest(objective.change()) } else { lbfgs.largest_change };
                (reached, RoundsEnd { change, ..RoundsEnd::default() })
            }
            None => {
                let reached = rounds.plain(objective, statistics, record)?;
                let hidden = HIDDEN * largest(&objective.start);
                (reached, rounds.norms.end(largest(objective.change()), hidden))
            }
        };
        objective.check(!self.accelerated || rounds.made == 1, statistics)?;
        let made = rounds.made;
        statistics.local_global_iterations += made;
        statistics.max_local_global_iterations = statistics.max_local_global_iterations.max(made);
        statistics.unconverged_steps += u64::from(self.tolerance > 0.0 && !reached);
        statistics.rounds_end.add(end);
        Ok(())
    }
}

/// Receives the number of a round, its iterate, and the part of its step that was taken.
type Record<'a, const P: usize> = dyn FnMut(u64, &StepObjective<P>, Option<f64>) + 'a;

/// Share of the largest coordinate below which the changes of rounds are mostly rounding: `ε` times what the solution
/// amplifies it by, `k h²/m`, of up to 10⁴ in the assignment's scenes.
const HIDDEN: f64 = 1e-11;

/// The rounds of one step.
struct Rounds<'a> {
    most: u64,
    tolerance: f64,
    made: u64,
    norms: RoundNorms,
    interrupt: &'a Interrupt,
}

/// `|δ|_Q` of some rounds of a step.
#[derive(Debug, Clone, Copy, Default)]
struct RoundNorms {
    first: f64,
    /// Of the last round but one; `None` in the first round.
    before: Option<f64>,
    last: f64,
}

impl RoundNorms {
    fn take(&mut self, norm: f64, is_first: bool) {
        if is_first {
            *self = Self { first: norm, before: None, last: norm };
        } else {
            (self.before, self.last) = (Some(self.last), norm);
        }
    }

    /// The end of a step whose last round changed a coordinate by up to `change`. Where that is at most `hidden`, rounding
    /// hides how the rounds contract.
    fn end(&self, change: f64, hidden: f64) -> RoundsEnd {
        let Self { first, before, last } = *self;
        let distance = match before {
            _ if change <= hidden => change,
            Some(before) if last < before => change * last / (before - last),
            Some(_) => f64::INFINITY,
            None => 0.0,
        };
        RoundsEnd { change, residual: if first > 0.0 { last / first } else { 0.0 }, distance }
    }
}

impl Rounds<'_> {
    /// Whether the tolerance is reached.
    fn plain<const P: usize>(
        &mut self,
        objective: &mut StepObjective<P>,
        statistics: &mut Statistics,
        record: &mut Record<'_, P>,
    ) -> Result<bool, StepError> {
        loop {
            let reached = self.round(objective, statistics);
            record(self.made, objective, Some(1.0));
            if reached || self.made == self.most {
                return Ok(reached);
            }
            self.interrupt.check()?;
            objective.evaluate::<false>()?;
        }
    }

    /// The same with a history; the first round of a step has none.
    fn accelerated<const P: usize>(
        &mut self,
        objective: &mut StepObjective<P>,
        lbfgs: &mut Lbfgs<P>,
        statistics: &mut Statistics,
        record: &mut Record<'_, P>,
    ) -> Result<bool, StepError> {
        let mut reached = self.round(objective, statistics);
        record(self.made, objective, Some(1.0));
        let mut energy = Energy::default();
        while !reached && self.made < self.most {
            self.interrupt.check()?;
            if self.made == 1 {
                energy = objective.evaluate::<true>()?;
            }
            energy = lbfgs.round(objective, energy, statistics)?;
            self.made += 1;
            record(self.made, objective, Some(lbfgs.step_length));
            reached = lbfgs.largest_change / objective.h < self.tolerance;
        }
        Ok(reached)
    }

    /// A plain round: whether it changed the iterate by less than the tolerance.
    fn round<const P: usize>(
        &mut self,
        objective: &mut StepObjective<P>,
        statistics: &mut Statistics,
    ) -> bool {
        objective.round();
        statistics.linear.solves += 1;
        statistics.linear.factor.add(objective.work_of_solve());
        // Only a tolerance makes another round the last one.
        let (is_first, may_end) = (self.made == 0, self.tolerance > 0.0);
        self.made += 1;
        if is_first || may_end || self.made + 1 >= self.most {
            self.norms.take(objective.change_squared().max(0.0).sqrt(), is_first);
        }
        self.tolerance > 0.0 && largest(objective.change()) / objective.h < self.tolerance
    }
}
