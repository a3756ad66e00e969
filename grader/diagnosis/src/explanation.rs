//! One wrong step in full: the states around it, and the equation of the method with the numbers put in.

use crate::change::{Change, Memory, Model, Quantity, Term};
use reference::method::{Method, OnePoint};

use scene::Scene;

use crate::steps::Evidence;

/// Multiple of a step's noise that its rule for positions may be off.
const OFF: f64 = 3.0;

/// Share of the largest residual from which on a particle is wrong in a step.
const SHARE: f64 = 1e-3;

/// A wrong step, at the first wrong particle of the trace; where that one is right in this step, at the one furthest off.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// The step, counted from 1.
    pub step: u64,
    /// The time before it.
    pub time: f64,
    /// The particle.
    pub particle: usize,
    /// Its state before the step, in the trace: position, velocity.
    pub before: [Vec<f64>; 2],
    /// Its state after the step, in the trace.
    pub after: [Vec<f64>; 2],
    /// Its state after a right step from the trace's own state before it; `None` if that step fails.
    pub right: Option<[Vec<f64>; 2]>,
    /// The equation, of methods with one evaluation of the forces; `None` for others.
    pub balance: Option<Balance>,
}

/// The equation of a step at one particle: `inertia + Σ terms = rest`, where the rest of a right step is rounding.
#[derive(Debug, Clone, PartialEq)]
pub struct Balance {
    /// The equation in words.
    pub equation: &'static str,
    /// `M (v' − v)`.
    pub inertia: Vec<f64>,
    /// The contribution of each term.
    pub terms: Vec<Contribution>,
    /// The residual of the right equation.
    pub rest: Vec<f64>,
    /// The same with the proven mistakes put in; `None` without any.
    pub rest_with_mistakes: Option<Vec<f64>>,
    /// The residual of the rule for positions.
    pub drift: Vec<f64>,
    /// Whether that is more than rounding.
    pub moves_otherwise: bool,
}

/// A term's part in the equation, with its sign.
#[derive(Debug, Clone, PartialEq)]
pub struct Contribution {
    /// Its formula and term: `− h F, simplegravity`.
    pub name: String,
    /// By its law.
    pub right: Vec<f64>,
    /// With the proven mistakes put in; `None` without any.
    pub with_mistakes: Option<Vec<f64>>,
}

impl Explanation {
    /// The first wrong step of a scene, with these mistakes; `None` if none of the steps is wrong. `first_wrong` is the
    /// first particle whose numbers are out of tolerance.
    pub fn of(
        scene: &Scene,
        steps: &[Evidence],
        mistakes: &[Change],
        first_wrong: Option<usize>,
    ) -> Option<Self> {
        let Evidence { sample, noise, .. } = steps.iter().find(|evidence| evidence.is_wrong())?;
        let model = Model::new(scene, &[]);
        let axes = scene.dimension.count();
        let earlier = sample.earlier.as_ref();
        let stepped = model.step(&mut Memory::default(), sample.step, earlier, &sample.before);
        let residual = model.residual(sample);
        let off = |dof: usize| {
            let by_step = stepped.as_ref().map_or(0.0, |stepped| {
                (stepped.state.velocities[dof] - sample.after.velocities[dof]).abs()
                    + (stepped.state.positions[dof] - sample.after.positions[dof]).abs()
            });
            let by_equation =
                residual.as_ref().map_or(0.0, |r| r.momentum[dof].abs() + r.position[dof].abs());
            // Of an implicit step, the equation shows the particle at fault; the step spreads it.
            if by_equation > 0.0 { by_equation } else { by_step }
        };
        let of_particle =
            |particle: usize| (particle * axes..(particle + 1) * axes).map(off).sum::<f64>();
        let particles = 0..scene.particles.len();
        let furthest = particles.max_by(|a, b| of_particle(*a).total_cmp(&of_particle(*b)))?;
        let is_off = |particle: &usize| of_particle(*particle) > SHARE * of_particle(furthest);
        let particle = first_wrong.filter(is_off).unwrap_or(furthest);
        let at = |values: &[f64]| values[particle * axes..(particle + 1) * axes].to_vec();
        let state = |state: &scene::trace::State| [at(&state.positions), at(&state.velocities)];
        let changed = (!mistakes.is_empty()).then(|| Model::new(scene, mistakes));
        let balance =
            residual.zip(Method::one_point(scene.integrator)).map(|(residual, method)| {
                let contributions = |model: &Model| -> Vec<(Term, Quantity, Vec<f64>)> {
                    let of = |(number, quantity): (usize, Quantity)| {
                        let value = at(&model.contribution(number, quantity, sample));
                        (model.term(number), quantity, value)
                    };
                    model.quantities().into_iter().map(of).collect()
                };
                let with = changed.as_ref().map(&contributions);
                let mut inertia = at(&residual.momentum);
                let terms = contributions(&model).into_iter().map(|(term, quantity, right)| {
                    inertia.iter_mut().zip(&right).for_each(|(sum, value)| *sum -= value);
                    let with_mistakes = with.as_ref().map(|with| {
                        let same = with.iter().find(|(t, q, _)| (*t, *q) == (term, quantity));
                        same.map_or_else(|| vec![0.0; axes], |(_, _, value)| value.clone())
                    });
                    Contribution { name: name(term, quantity), right, with_mistakes }
                });
                let terms = terms.collect();
                Balance {
                    equation: equation(method),
                    inertia,
                    terms,
                    rest: at(&residual.momentum),
                    rest_with_mistakes: changed
                        .as_ref()
                        .and_then(|model| model.residual(sample))
                        .map(|residual| at(&residual.momentum)),
                    moves_otherwise: residual
                        .position
                        .iter()
                        .any(|left| left.abs() > OFF * noise[0]),
                    drift: at(&residual.position),
                }
            });
        Some(Self {
            step: sample.step + 1,
            time: sample.step as f64 * scene.time_step,
            particle,
            before: state(&sample.before),
            after: state(&sample.after),
            right: stepped.map(|stepped| state(&stepped.state)),
            balance,
        })
    }
}

fn name(term: Term, quantity: Quantity) -> String {
    let what = match quantity {
        Quantity::Force => "− h F",
        Quantity::ByPosition => "− h² K δ",
        Quantity::ByVelocity => "− h B δ",
    };
    format!("{what}, {term}")
}

fn equation(method: OnePoint) -> &'static str {
    match method {
        OnePoint::Explicit => "M (v' − v) − h F(x, v) = 0,  x' = x + h v",
        OnePoint::Symplectic => "M (v' − v) − h F(x, v) = 0,  x' = x + h v'",
        OnePoint::Linearized => {
            "(M − h² K − h B) δ − h F = 0 with K = ∂F/∂x, B = ∂F/∂v, F at x + h v;  δ = v' − v, x' = x + h v'"
        }
        OnePoint::Implicit => "M (v' − v) − h F(x', v') = 0,  x' = x + h v'",
    }
}
