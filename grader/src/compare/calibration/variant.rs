//! Variants: equally correct ways to simulate a scene, each a stream of states.
//!
//! ```text
//! order      forces summed in reverse or random order; particles renumbered
//! solver     dense, sparse, LU of either pivoting, QR, the inverse, 4N unknowns, an iterative one's residual
//! formula    d/l or d·(1/l), h·(F/m) or (h/m)·F, fused multiply-add, Jacobians by dual numbers
//! start      the last bit of every coordinate, velocity, mass and parameter: up, down or unchanged
//! rounding   the last bit of every coordinate and velocity after every step: likewise
//! stopping   one iteration of Newton's method more than needed, or as many as rounding allows
//! ```
//!
//! Random bits and orders have fixed seeds, so that the variants are deterministic.

use fastrand::Rng;
use scene::Scene;
use scene::schema::{Convergence, Family, Matrix, OptionValue};
use scene::trace::State;
use simulator::solver::linear::LinearSolver;

use diagnosis::stepping::Stepper;
use reference::second::arithmetic::Arithmetic;
use reference::second::{Second, Solver, Stop, Style};

/// Kind of difference between a variant and the oracle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// The order of sums.
    Order,
    /// The linear solver.
    Solver,
    /// The order of evaluation of formulas.
    Formula,
    /// The last bits of the initial state.
    Start,
    /// The last bits after every step.
    Rounding,
    /// The stopping criterion of an iteration.
    Stopping,
}

impl Class {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Order, Self::Solver, Self::Formula, Self::Start, Self::Rounding, Self::Stopping];
}

/// A running variant. Its state is reported in the scene's own order of particles.
pub(super) struct Variant {
    pub(super) class: Class,
    engine: Engine,
    /// For each coordinate of the scene's particles, its index in the variant's state.
    places: Vec<usize>,
    jitter: Option<Jitter>,
    step: u64,
    state: State,
    /// The state one step before.
    earlier: Option<State>,
}

enum Engine {
    First(Box<Stepper>),
    Second(Box<Second>),
}

/// Random last bits after every step.
struct Jitter {
    random: Rng,
    /// The time step, if the method computes the velocity as a difference of positions over it.
    quotient: Option<f64>,
}

/// Change of a start in its fifteenth digit. [`FACTOR`](super::FACTOR) times that is above the error of any number of 15
/// digits, 5e-15 of it.
const DIGIT: f64 = 1e-15;

/// Distance from 1 to the next larger number.
const BIT: f64 = f64::EPSILON;

impl Variant {
    fn of(class: Class, scene: &Scene, engine: Engine) -> Self {
        let dimension = scene.dimension.count();
        Self {
            class,
            engine,
            places: (0..scene.particles.len() * dimension).collect(),
            jitter: None,
            step: 0,
            state: State {
                time: None,
                positions: scene.positions(),
                velocities: scene.velocities(),
            },
            earlier: None,
        }
    }

    fn first(class: Class, scene: &Scene, solver: LinearSolver) -> Self {
        Self::of(class, scene, Engine::First(Box::new(Stepper::new(scene, solver))))
    }

    /// The scene as the simulator runs it.
    pub(super) fn plain(scene: &Scene) -> Self {
        Self::first(Class::Order, scene, LinearSolver::Auto)
    }

    /// Takes a step. Returns false if it fails.
    pub(super) fn advance(&mut self) -> bool {
        let before = self.state.clone();
        let (x, v) = (&mut self.state.positions, &mut self.state.velocities);
        let earlier = self.earlier.as_ref();
        let done = match &mut self.engine {
            Engine::First(stepper) => stepper.step(self.step, earlier, x, v),
            Engine::Second(second) => second.step(self.step, earlier, x, v),
        };
        self.earlier = Some(before);
        self.step += 1;
        if let Some(Jitter { random, quotient }) = &mut self.jitter {
            for (x, v) in x.iter_mut().zip(v.iter_mut()) {
                if let Some(h) = quotient {
                    *v += bit(random) * *x / *h;
                }
                *x += bit(random) * *x;
                *v += bit(random) * *v;
            }
        }
        done
    }

    /// Sets the state at the beginning of step `step`, and the one before it; both in the scene's own order. A variant of
    /// the start gets other fifteenth digits.
    pub(super) fn restart(
        &mut self,
        step: u64,
        earlier: Option<&State>,
        state: &State,
        random: &mut Rng,
    ) {
        let unit = if self.class == Class::Start { DIGIT } else { 0.0 };
        let mut placed = |values: &[f64]| {
            let mut own = vec![0.0; values.len()];
            for (&place, value) in self.places.iter().zip(values) {
                own[place] = value + unit * f64::from(random.i8(-1..=1)) * value;
            }
            own
        };
        let mut of = |state: &State| State {
            time: None,
            positions: placed(&state.positions),
            velocities: placed(&state.velocities),
        };
        (self.step, self.earlier, self.state) = (step, earlier.map(&mut of), of(state));
    }

    /// Position and velocity at this index, in the scene's own order.
    pub(super) fn at(&self, place: usize) -> (f64, f64) {
        let place = self.places[place];
        (self.state.positions[place], self.state.velocities[place])
    }

    /// All positions and velocities, in the scene's own order.
    pub(super) fn state(&self) -> (Vec<f64>, Vec<f64>) {
        (0..self.places.len()).map(|place| self.at(place)).unzip()
    }
}

/// A random last bit of a number near 1: up, down or unchanged.
fn bit(random: &mut Rng) -> f64 {
    BIT * f64::from(random.i8(-1..=1))
}

/// All variants of the scene.
pub(super) fn variants(scene: &Scene) -> Vec<Variant> {
    let mut all = Vec::new();
    orders(scene, &mut all);
    solvers(scene, &mut all);
    formulas(scene, &mut all);
    last_bits(scene, &mut all);
    stopping(scene, &mut all);
    all
}

fn orders(scene: &Scene, all: &mut Vec<Variant>) {
    let auto = LinearSolver::Auto;
    let mut backwards = scene.clone();
    backwards.forces.reverse();
    all.push(Variant::first(Class::Order, &backwards, auto));
    for seed in 0..2 {
        let mut shuffled = scene.clone();
        Rng::with_seed(seed).shuffle(&mut shuffled.forces);
        all.push(Variant::first(Class::Order, &shuffled, auto));
    }
    for seed in 0..2 {
        let mut order: Vec<usize> = (0..scene.particles.len()).rev().collect();
        if seed > 0 {
            Rng::with_seed(seed).shuffle(&mut order);
        }
        let renumbered = renumber(scene, &order);
        let mut variant = Variant::first(Class::Order, &renumbered, auto);
        let dimension = scene.dimension.count();
        for (new, &old) in order.iter().enumerate() {
            for axis in 0..dimension {
                variant.places[old * dimension + axis] = new * dimension + axis;
            }
        }
        all.push(variant);
    }
}

/// The scene with its particles in the order `order[0], order[1], …`.
fn renumber(scene: &Scene, order: &[usize]) -> Scene {
    let mut new_number = vec![0; order.len()];
    order.iter().enumerate().for_each(|(new, &old)| new_number[old] = new);
    let mut renumbered = scene.clone();
    renumbered.particles = order.iter().map(|&old| scene.particles[old].clone()).collect();
    for element in &mut renumbered.forces {
        element.particles.iter_mut().for_each(|particle| *particle = new_number[*particle]);
    }
    for edge in &mut renumbered.edges {
        edge.particles = edge.particles.map(|old| new_number[old]);
    }
    renumbered
}

fn solvers(scene: &Scene, all: &mut Vec<Variant>) {
    if scene.integrator.matrix != Matrix::None {
        for solver in [LinearSolver::Dense, LinearSolver::Sparse] {
            all.push(Variant::first(Class::Solver, scene, solver));
        }
    }
    if Second::is_implicit(scene) {
        let solvers = [Solver::FullLu, Solver::Qr, Solver::Inverse, Solver::Unreduced];
        for solver in solvers.into_iter().chain([Solver::Iterative; 2]) {
            let style = Style { solver, ..Style::default() };
            push_second(Class::Solver, scene, style, all);
        }
    }
}

fn formulas(scene: &Scene, all: &mut Vec<Variant>) {
    for fused in [false, true] {
        for reciprocal in [false, true] {
            let arithmetic = Arithmetic { fused, reciprocal };
            let (backwards, scaled_kick) = (fused != reciprocal, reciprocal);
            let style = Style { arithmetic, backwards, scaled_kick, ..Style::default() };
            push_second(Class::Formula, scene, style, all);
        }
    }
}

fn push_second(class: Class, scene: &Scene, style: Style, all: &mut Vec<Variant>) {
    if let Some(second) = Second::new(scene, style, all.len() as u64) {
        all.push(Variant::of(class, scene, Engine::Second(Box::new(second))));
    }
}

fn last_bits(scene: &Scene, all: &mut Vec<Variant>) {
    for seed in 0..4 {
        let random = &mut Rng::with_seed(seed);
        let mut changed = scene.clone();
        for particle in &mut changed.particles {
            for value in particle.position.iter_mut().chain(&mut particle.velocity) {
                *value += bit(random) * *value;
            }
            // Half of them also change the parameters of the forces.
            if seed % 2 == 1 {
                particle.mass += bit(random) * particle.mass;
            }
        }
        if seed % 2 == 1 {
            for element in &mut changed.forces {
                // Four draws an element or more: the stored envelopes were measured with them.
                let bits: Vec<f64> =
                    (0..element.parameters.len().max(4)).map(|_| bit(random)).collect();
                element
                    .parameters
                    .iter_mut()
                    .zip(bits)
                    .for_each(|(value, bit)| *value += bit * *value);
            }
        }
        all.push(Variant::first(Class::Start, &changed, LinearSolver::Auto));
    }
    let is_quotient = scene.integrator.family == Family::Minimization;
    for seed in 0..4 {
        let mut variant = Variant::first(Class::Rounding, scene, LinearSolver::Auto);
        let quotient = is_quotient.then_some(scene.time_step);
        variant.jitter = Some(Jitter { random: Rng::with_seed(seed), quotient });
        all.push(variant);
    }
}

fn stopping(scene: &Scene, all: &mut Vec<Variant>) {
    if matches!(scene.integrator.convergence, Convergence::Update(_)) {
        for stop in [Stop::OneMore, Stop::AtRounding] {
            push_second(Class::Stopping, scene, Style { stop, ..Style::default() }, all);
        }
        return;
    }
    // A tolerance set by the scene fixes the end of the iteration; only rounding in the comparison with it is free.
    let tolerances = scene.integrator_options.iter().filter_map(|(option, value)| match value {
        OptionValue::Number(value) if option.name == "tolerance" && value > 0.0 => Some(value),
        _ => None,
    });
    for tolerance in tolerances {
        for factor in [1.0 - 1e-9, 1.0 + 1e-9] {
            let mut changed = scene.clone();
            let text = (tolerance * factor).to_string();
            if changed.integrator_options.set("tolerance", &text).is_ok() {
                all.push(Variant::first(Class::Stopping, &changed, LinearSolver::Auto));
            }
        }
    }
}
