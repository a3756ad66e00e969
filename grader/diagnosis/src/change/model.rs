//! The terms of a scene's steps, with changes made to them.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::{Arc, LazyLock};

use nalgebra::{DMatrix, Matrix3, Vector3};
use scene::schema::{Convergence, Matrix};
use scene::trace::State;
use scene::{self, ForceElement, Parameters, Scene};

use super::element::Weight;
use super::elimination::Slip;
use super::expression::{Direction, Expression, Inputs};
use super::forms::{self, Forms};
use super::gate::{Gate, Measure, Measured};
use super::helper::{self, Helper};
use super::rounds::{Rounds, is_of_rounds};
use super::work::{Work, cost};
use super::{
    Accumulated, Axes, Beyond, Blocks, Change, Coordinates, Each, Effect, Ends, Entries, Factor,
    FixedRule, Guess, Hold, Index, Kept, Linearized, MassAt, MassList, Newton, Norm, Numbers,
    Order, Particles, Place, Quantity, Read, ReadAt, Rule, SceneRule, SeenAt, Softening, Stale,
    Start, Term, Unknowns, Which,
};
use reference::laws::Laws;
use reference::method::{Method, OnePoint};

/// The first form of each formula, by force and part.
static FORMS: LazyLock<HashMap<Term, Option<Forms>>> = LazyLock::new(|| {
    let of = |term: Term| (term, forms::of(term.schema(), term.part));
    Term::all().map(of).collect()
});

/// The forms of a term; `None` where it has none.
pub(super) fn forms_of(term: Term) -> Option<&'static Forms> {
    FORMS.get(&term).and_then(Option::as_ref)
}

/// The largest number of iterations of a step.
pub(super) const MAX_ITERATIONS: usize = 20;

/// The largest number of iterations with a wrong matrix.
pub(super) const MANY_ITERATIONS: usize = 200;

/// A step of a trace: the states before and after it.
#[derive(Debug, Clone)]
pub struct Sample {
    /// The step, counted from 0.
    pub step: u64,
    /// The state one step earlier, if there is one.
    pub earlier: Option<State>,
    /// The state before the step.
    pub before: State,
    /// The state after it.
    pub after: State,
}

/// A point at which forces are evaluated.
#[derive(Debug, Clone)]
pub(super) struct Point<'a> {
    pub(super) x: Vec<f64>,
    pub(super) v: Vec<f64>,
    pub(super) time: f64,
    /// The positions and velocities at the start of the step.
    pub(super) start: [&'a [f64]; 2],
    /// Those at the start of the step before, where a term reads them.
    pub(super) earlier: Option<[&'a [f64]; 2]>,
    /// The velocities that other forces give, where one term reads them. Another one has `v`.
    pub(super) given: Vec<f64>,
}

impl<'a> Point<'a> {
    /// The start of a step.
    pub(super) fn new(x: &'a [f64], v: &'a [f64], time: f64) -> Self {
        let start = [x, v];
        Self { x: x.to_vec(), v: v.to_vec(), time, start, earlier: None, given: Vec::new() }
    }

    /// The positions and velocities that a term reads.
    fn read(&self, from: Option<Start>, fixed: &[bool], axes: usize) -> [Cow<'_, [f64]>; 2] {
        let [x, v] = self.start;
        let [x_earlier, v_earlier] = self.earlier.unwrap_or(self.start);
        let rest = |(v, at_rest): (&f64, bool)| if at_rest { 0.0 } else { *v };
        let [x, v]: [&[f64]; 2] = match from {
            Some(Start::EarlierPositions) => [x_earlier, &self.v],
            Some(Start::EarlierVelocities) => [&self.x, v_earlier],
            Some(Start::OtherForces) if !self.given.is_empty() => [&self.x, &self.given],
            Some(Start::OtherForces) => [&self.x, &self.v],
            Some(Start::Positions) => [x, &self.v],
            Some(Start::Velocities) => [&self.x, v],
            Some(Start::Both) => [x, v],
            Some(Start::Along(axis)) => {
                let mut mixed = self.x.clone();
                for dof in (axis..mixed.len()).step_by(axes) {
                    mixed[dof] = x[dof];
                }
                return [mixed.into(), (&self.v).into()];
            }
            Some(Start::Rest) => return [(&self.x).into(), vec![0.0; self.v.len()].into()],
            Some(Start::FixedAtRest) => {
                let v = self.v.iter().zip(fixed.iter().copied()).map(rest);
                return [(&self.x).into(), v.collect()];
            }
            None => [&self.x, &self.v],
        };
        [x.into(), v.into()]
    }
}

#[derive(Clone)]
struct Element {
    /// Its place in the scene's list of forces.
    place: usize,
    /// None in a field.
    particles: scene::Particles,
    parameters: Parameters,
    lost: Lost,
}

/// A formula and what is done to its values.
#[derive(Clone)]
struct Evaluation {
    /// `None`: zero.
    formula: Option<Arc<Expression>>,
    factor: Factor,
    ends: Option<Ends>,
    blocks: Option<Blocks>,
    axes: Option<Axes>,
    particles: Option<Particles>,
    start: Option<Start>,
    masses: Option<MassAt>,
}

/// The elements of a term where the scene is read otherwise for some quantities.
#[derive(Clone)]
struct Others {
    quantities: &'static [Quantity],
    elements: Arc<[Element]>,
    scene: Arc<Scene>,
    law: Option<Arc<Laws>>,
}

/// A term of a scene.
#[derive(Clone)]
pub(super) struct TermModel {
    pub(super) term: Term,
    elements: Arc<[Element]>,
    others: Option<Others>,
    evaluations: [Evaluation; 3],
    /// The Jacobians are the derivatives of the force's formula.
    derived: bool,
    softening: Option<(&'static [Quantity], Softening)>,
    read: Option<Read>,
    gate: Option<(&'static [Quantity], Gate)>,
    weight: Option<(&'static [Quantity], Weight)>,
    /// The one element that acts, and in a field the one particle.
    only: Option<(usize, Option<usize>)>,
    /// The law of a force without a formula.
    law: Option<Arc<Laws>>,
}

/// Coefficients and rules of the integrator.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rules {
    pub(super) forces: Factor,
    pub(super) matrix: [Factor; 2],
    /// Another time step there.
    pub(super) matrix_step: Option<f64>,
    pub(super) inertia_matrix: i32,
    pub(super) inertia_right: (i32, f64),
    /// Where the matrix of Newton's method reads its masses.
    pub(super) matrix_mass_at: Option<MassAt>,
    /// Whether Jacobians are divided by the masses of their columns, not of their rows.
    pub(super) column_masses: bool,
    /// The step of differences in the place of Jacobians, and whether they are central.
    pub(super) differences: Option<(f64, bool)>,
    /// Particles on which forces have a separate factor.
    pub(super) gate: Option<Gate>,
    /// Iterations of a linearized method.
    pub(super) iterations: usize,
    pub(super) entries: Entries,
    pub(super) forces_at: Option<f64>,
    pub(super) jacobians_at: [Option<f64>; 2],
    pub(super) stale: Option<Stale>,
    pub(super) stale_jacobians: bool,
    /// The iterations of a step have the Jacobians of the first one.
    pub(super) first_jacobians: bool,
    /// Entries of the blocks of Jacobians in the matrix.
    pub(super) blocks: Option<Axes>,
    /// Whether positions and velocities of every iteration are those of the first one.
    pub(super) unmoved: [bool; 2],
    /// The velocity is taken for its change, in the inertia and where forces are evaluated.
    pub(super) whole_change: [bool; 2],
    /// Whether the solution is taken for the new velocity, and whether of free particles alone.
    pub(super) whole: Option<bool>,
    /// The power of the mass by which a linearized method multiplies its solution.
    pub(super) scaled: i32,
    /// Whether Newton's method adds each update to the velocities of its start, and whether to zero in their place.
    pub(super) restarted: Option<bool>,
    /// Whether Newton's method makes no iteration after the first step.
    pub(super) once: bool,
    /// How Newton's method moves the positions of its last iteration on.
    pub(super) accumulated: Option<Accumulated>,
    /// Another state at which forces and Jacobians are evaluated.
    pub(super) seen_at: Option<SeenAt>,
    /// The Jacobian that is the other one.
    pub(super) other: Option<Quantity>,
    /// The Jacobian that is the sum of both.
    pub(super) summed: Option<Quantity>,
    /// An axis whose forces are those along the one before it.
    pub(super) forces_along: Option<[usize; 2]>,
    /// The rule of positions along one axis.
    pub(super) position_along: Option<(usize, [f64; 2])>,
    /// Whether the new velocity is lost after the step.
    pub(super) lost: bool,
    /// Factors of the velocities at which forces, dF/dx and dF/dv are evaluated.
    pub(super) seen: [f64; 3],
    /// A factor of the forces along an axis.
    pub(super) along: Option<(usize, Factor)>,
    pub(super) kept: Option<Kept>,
    pub(super) slip: Option<Slip>,
    /// Coordinates updated at a time, where forces are evaluated anew for the next, and whether their positions are as well.
    pub(super) one_by_one: Option<(Each, bool)>,
    /// A factor of `h² ∂F/∂x v` on the right-hand side.
    pub(super) stiff_right: Option<Factor>,
    /// The factor of the old velocity.
    pub(super) old: f64,
    /// A number added to the masses.
    pub(super) diagonal: f64,
    pub(super) speed_limit: Option<f64>,
    pub(super) position: Option<[f64; 3]>,
    pub(super) newton: Newton,
}

/// Rules for fixed particles.
#[derive(Debug, Clone, Copy)]
pub(super) struct FixedRules {
    pub(super) stand: bool,
    pub(super) stop: bool,
    pub(super) stop_moved: bool,
    pub(super) fall: bool,
    pub(super) feel: Option<Option<usize>>,
    pub(super) hold: Hold,
    /// Jacobians that are added to the matrix after rows and columns are cleared, by position and by velocity.
    pub(super) late: [bool; 2],
    pub(super) behind: bool,
    pub(super) cleared: Option<Unknowns>,
    /// Whether loops end at the first fixed particle, and those of positions as well.
    pub(super) ended: Option<bool>,
    pub(super) doubled: bool,
}

/// The steps of a scene with changes made.
#[derive(Clone)]
pub struct Model {
    pub(super) scene: Scene,
    pub(super) dimension: usize,
    /// The time step of a substep.
    pub(super) h: f64,
    pub(super) substeps: u32,
    /// Masses, one a coordinate.
    pub(super) mass: Vec<f64>,
    /// How the list of the masses of coordinates is filled wrongly, and whether forces read that of x for all axes.
    mass_list: Option<(MassList, bool)>,
    /// Whether a coordinate is a fixed particle's.
    pub(super) fixed: Vec<bool>,
    /// `None`: a method of [`Model::several`], or one that cannot be stepped here.
    pub(super) method: Option<OnePoint>,
    /// Of a method that solves for a part of the step: the part, and implicit Euler for it.
    pub(super) part: Option<(f64, Box<Self>)>,
    /// Of a method of rounds that are not accelerated: its rules.
    pub(super) rounds: Option<Rounds>,
    /// The integrator with that method.
    stepped_as: Option<&'static str>,
    /// Nothing moves.
    pub(super) idle: bool,
    pub(super) terms: Vec<TermModel>,
    pub(super) rules: Rules,
    pub(super) fixed_rules: FixedRules,
    /// A slip in the functions on vectors, of all forces or of the one of this tag.
    helper: Option<(Option<&'static str>, &'static [Quantity], Helper)>,
    /// `1/0` in formulas.
    by_zero: f64,
    /// The number of the last step, and its own model, where it has another size.
    last: Option<(u64, Box<Self>)>,
    /// Where its work is counted.
    pub(super) work: Work,
}

const SHORT_LAST_STEP: Effect = Effect::Scene(SceneRule::ShortLastStep);

/// Newton's method as the course has it.
pub(super) const NEWTON: Newton = Newton {
    iterations: MAX_ITERATIONS,
    tolerance: 1e-9,
    norm: Norm::Euclidean,
    guess: Guess::Old,
    drops_last: false,
    relaxation: 1.0,
};

/// The entries cleared for a fixed particle.
pub(super) const HELD: Hold = Hold {
    rows: true,
    columns: true,
    right: true,
    unknowns: Unknowns::Own,
    of_right: Unknowns::Own,
    massless: false,
    unit: false,
    between: false,
    which: None,
    solution: false,
    unforced: false,
    large: None,
    exchanged: false,
};

impl Place {
    /// Whether a scene is read by other code than that here.
    fn is_elsewhere(self, scene: &Scene) -> bool {
        match self {
            Self::FixedUnder(name) | Self::Integrator(name) => name != scene.integrator.name,
            Self::Fixed(Some(family)) => family != (scene.integrator.matrix == Matrix::Jacobians),
            Self::Task(_) => !is_of_rounds(scene),
            _ => false,
        }
    }
}

impl Model {
    /// The steps of `scene` with these changes.
    pub fn new(scene: &Scene, changes: &[Change]) -> Self {
        Self::counted(scene, changes, &Work::default())
    }

    /// The same, whose work is counted there.
    pub fn counted(scene: &Scene, changes: &[Change], work: &Work) -> Self {
        work.add(cost::MODEL);
        let last = changes.iter().position(|change| change.effect == SHORT_LAST_STEP);
        let last = last.filter(|_| !scene.is_divided()).map(|place| {
            let (before, after) = (&changes[..place], &changes[place + 1..]);
            let number = scene.n_steps() - 1;
            let mut rest = scene.clone();
            rest.time_step = scene.duration - number as f64 * scene.time_step;
            (number, Box::new(Self::counted(&rest, &[before, after].concat(), work)))
        });
        let mut scene = scene.clone();
        for change in changes {
            if let Effect::Scene(rule) = change.effect
                && !change.place.is_elsewhere(&scene)
            {
                read_wrongly(&mut scene, rule);
            }
        }
        let mass_list = changes.iter().find_map(|change| match change.effect {
            Effect::Scene(SceneRule::MassList { list, once }) => Some((list, once)),
            _ => None,
        });
        let dimension = scene.dimension.count();
        let each = || scene.particles.iter().flat_map(|particle| vec![particle; dimension]);
        let (mass, fixed) = (
            each().map(|particle| particle.mass).collect(),
            each().map(|particle| particle.fixed).collect(),
        );
        let newton = match scene.integrator.convergence {
            Convergence::Update(tolerance) => Newton { tolerance, ..NEWTON },
            _ => NEWTON,
        };
        let rules = Rules {
            forces: Factor::number(1.0),
            matrix: [Factor::number(1.0); 2],
            matrix_step: None,
            inertia_matrix: 1,
            inertia_right: (1, 1.0),
            matrix_mass_at: None,
            column_masses: false,
            differences: None,
            gate: None,
            iterations: 1,
            entries: Entries::All,
            forces_at: None,
            jacobians_at: [None; 2],
            stale: None,
            stale_jacobians: false,
            first_jacobians: false,
            blocks: None,
            unmoved: [false; 2],
            whole_change: [false; 2],
            whole: None,
            scaled: 0,
            restarted: None,
            once: false,
            accumulated: None,
            seen_at: None,
            other: None,
            summed: None,
            forces_along: None,
            position_along: None,
            lost: false,
            seen: [1.0; 3],
            along: None,
            kept: None,
            slip: None,
            one_by_one: None,
            stiff_right: None,
            old: 1.0,
            diagonal: 0.0,
            speed_limit: None,
            position: None,
            newton,
        };
        let fixed_rules = FixedRules {
            stand: false,
            stop: false,
            stop_moved: false,
            fall: false,
            feel: None,
            hold: HELD,
            late: [false; 2],
            behind: false,
            cleared: None,
            ended: None,
            doubled: false,
        };
        let mut model = Self {
            mass_list,
            dimension,
            h: scene.time_step,
            substeps: 1,
            mass,
            fixed,
            method: Method::one_point(scene.integrator),
            part: None,
            rounds: Rounds::of(&scene),
            stepped_as: None,
            idle: false,
            terms: terms_of(&scene, changes),
            rules,
            fixed_rules,
            helper: None,
            by_zero: 0.0,
            last,
            work: work.clone(),
            scene,
        };
        if mass_list.is_some() {
            model.mass = (0..model.mass.len()).map(|dof| model.mass_at(dof)).collect();
        }
        let part = match Method::of(model.scene.integrator.equation) {
            Method::Backward { linearized: false, part } => Some(part),
            Method::Differences { repeated } => Some(1.0 - repeated),
            _ => None,
        };
        if let (Some(part), Convergence::Update(_), None) =
            (part, model.scene.integrator.convergence, model.method)
        {
            let mut inner = model.clone();
            inner.h *= part;
            inner.method = Some(OnePoint::Implicit);
            changes.iter().for_each(|change| inner.make(change));
            // The velocities of fixed particles are set at the end of the whole step.
            (inner.fixed_rules.stop, inner.fixed_rules.fall) = (false, false);
            inner.fixed_rules.stop_moved = false;
            inner.fixed_rules.doubled = false;
            model.part = Some((part, Box::new(inner)));
        }
        // A method in the place of another has the mistakes of both.
        for change in changes {
            if let Effect::Method(name, rule @ (Rule::Replaced(_) | Rule::Idle)) = change.effect
                && name == model.scene.integrator.name
            {
                model.follow(rule);
            }
        }
        model.stepped_as = model.method.and_then(name_of);
        for change in changes {
            model.make(change);
        }
        // With a wrong matrix, Newton's method converges slowly.
        let is_its = |change: &&Change| {
            let name = model.scene.integrator.name;
            matches!(change.effect, Effect::Method(of, _) if of == name)
        };
        let has_end = |change: &Change| matches!(change.effect, Effect::Method(_, Rule::Newton(_)));
        let of_it: Vec<&Change> = changes.iter().filter(is_its).collect();
        if of_it.iter().any(|one| one.is_of_system()) && !of_it.iter().any(|one| has_end(one)) {
            model.rules.newton.iterations = model.rules.newton.iterations.max(MANY_ITERATIONS);
        }
        model.factorise();
        model
    }

    /// The mass that a program reads for a coordinate.
    fn mass_at(&self, dof: usize) -> f64 {
        let particle = match self.mass_list {
            Some((MassList::OneAlong(axis), _)) if dof % self.dimension == axis => return 1.0,
            Some((MassList::ZeroAlong(axis), _)) if dof % self.dimension == axis => return 0.0,
            Some((MassList::FirstAlong(axis), _)) if dof % self.dimension == axis => 0,
            Some((MassList::ByAxis, _)) => dof % self.scene.particles.len(),
            _ => dof / self.dimension,
        };
        self.scene.particles[particle].mass
    }

    /// The model of a step: its own, or that of the last step.
    pub(super) fn of_step(&self, step: u64) -> &Self {
        match &self.last {
            Some((number, last)) if *number == step => last,
            _ => self,
        }
    }

    /// The same where formulas divide by 0.
    pub fn dividing_by_zero(mut self) -> Self {
        self.by_zero = f64::INFINITY;
        self
    }

    /// Whether its steps can be taken.
    pub fn can_step(&self) -> bool {
        self.idle
            || self.method.is_some()
            || match Method::of(self.scene.integrator.equation) {
                Method::Explicit(_) | Method::Stages(_) | Method::Controlled(_) => true,
                Method::Backward { .. } | Method::Differences { .. } => self.part.is_some(),
                Method::Rounds => self.rounds.is_some(),
            }
    }

    /// Whether a change that acts in the scene has an effect: that of a method only where it steps.
    pub fn is_changed_by(&self, change: &Change) -> bool {
        match &change.effect {
            Effect::Method(_, Rule::Replaced(_) | Rule::Idle) => true,
            Effect::Method(name, _) => self.steps_by(name),
            _ => match change.place {
                Place::FixedUnder(name) | Place::ForceUnder(_, name) | Place::Integrator(name) => {
                    self.steps_by(name)
                }
                Place::Fixed(Some(family)) => {
                    let of_scene = self.scene.integrator.matrix == Matrix::Jacobians;
                    family == self.method.map_or(of_scene, |_| self.is_implicit())
                }
                // Another method in the place of rounds has none of their rules.
                Place::Task(_) => self.method.is_none(),
                _ => true,
            },
        }
    }

    /// Whether it steps by the method of this name, in the place of another or not.
    fn steps_by(&self, name: &str) -> bool {
        self.scene.integrator.name == name || self.stepped_as == Some(name)
    }

    /// The initial state.
    pub fn start(&self) -> State {
        let all = |of: fn(&scene::Particle) -> &[f64; 3]| -> Vec<f64> {
            let each = self.scene.particles.iter();
            each.flat_map(|particle| of(particle)[..self.dimension].to_vec()).collect()
        };
        State {
            time: None,
            positions: all(|particle| &particle.position),
            velocities: all(|particle| &particle.velocity),
        }
    }

    /// Whether more work is counted than is allowed.
    pub fn is_over(&self) -> bool {
        self.work.is_over()
    }

    /// Number of axes.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Number of terms.
    pub fn n_terms(&self) -> usize {
        self.terms.len()
    }

    /// The term of this number.
    pub fn term(&self, number: usize) -> Term {
        self.terms[number].term
    }

    fn make(&mut self, change: &Change) {
        if !self.is_changed_by(change) {
            return;
        }
        match &change.effect {
            Effect::Method(_, Rule::Replaced(_) | Rule::Idle)
            | Effect::Scene(_)
            | Effect::Partly(..) => {}
            Effect::Method(_, rule) => self.follow(*rule),
            Effect::Helper(of, quantities, helper) => {
                self.helper = Some((*of, quantities, *helper))
            }
            Effect::Rounds(rule) => {
                if let Some(rounds) = &mut self.rounds {
                    rounds.make(rule);
                }
            }
            Effect::Fixed(rule) => match *rule {
                FixedRule::Stand => self.fixed_rules.stand = true,
                FixedRule::Stop => self.fixed_rules.stop = true,
                FixedRule::StopMoved => self.fixed_rules.stop_moved = true,
                FixedRule::Freeze => {
                    (self.fixed_rules.stand, self.fixed_rules.stop) = (true, true);
                }
                FixedRule::Restored => {
                    let free = Hold { rows: false, columns: false, right: false, ..HELD };
                    (self.fixed_rules.stand, self.fixed_rules.feel) = (true, Some(None));
                    self.fixed_rules.hold = free;
                }
                FixedRule::Fall => self.fixed_rules.fall = true,
                FixedRule::Feel(axis) => self.fixed_rules.feel = Some(axis),
                FixedRule::Hold(hold) => {
                    self.fixed_rules.hold = hold;
                    // The right-hand side shrinks by a factor of the mass in each iteration.
                    if !hold.right {
                        self.rules.newton.iterations = MANY_ITERATIONS;
                    }
                }
                FixedRule::Late(late) => self.fixed_rules.late = late,
                FixedRule::Behind => self.fixed_rules.behind = true,
                FixedRule::Cleared(unknowns) => self.fixed_rules.cleared = Some(unknowns),
                FixedRule::Ended { stands } => self.fixed_rules.ended = Some(stands),
                FixedRule::Doubled => self.fixed_rules.doubled = true,
            },
            effect @ (Effect::Formula(term, ..)
            | Effect::Derived(term, _)
            | Effect::Factor(term, ..)
            | Effect::Ends(term, _)
            | Effect::Blocks(term, ..)
            | Effect::Axes(term, ..)
            | Effect::Length(term, ..)
            | Effect::Particles(term, ..)
            | Effect::Masses(term, ..)
            | Effect::Read(term, _)
            | Effect::Gate(term, ..)
            | Effect::Weight(term, ..)
            | Effect::Start(term, ..)) => {
                let of_it = self.terms.iter_mut().filter(|model| term.includes(model.term));
                of_it.for_each(|model| model.make(effect));
            }
        }
    }

    fn follow(&mut self, rule: Rule) {
        let rules = &mut self.rules;
        match rule {
            Rule::Replaced(method) => self.method = Some(method),
            Rule::Idle => self.idle = true,
            Rule::Forces(factor) => rules.forces = rules.forces.and(factor),
            Rule::Matrix(quantity, factor) => {
                let matrix = &mut rules.matrix[usize::from(quantity == Quantity::ByVelocity)];
                *matrix = matrix.and(factor);
            }
            Rule::Matrices(factor) => {
                rules.matrix = rules.matrix.map(|matrix| matrix.and(factor));
            }
            Rule::MatrixStep(h) => rules.matrix_step = Some(h),
            Rule::StepsExchanged => {
                let [k, b] = rules.matrix;
                rules.matrix = [k.and(Factor::h(-1)), b.and(Factor::h(1))];
            }
            Rule::Inertia { matrix, right, sign } => {
                rules.inertia_matrix = matrix;
                rules.inertia_right = (right, sign);
            }
            Rule::Unbalanced { right, sign, iterations } => {
                rules.inertia_right = (right, sign);
                rules.newton.iterations = iterations;
            }
            Rule::Solver(slip) => rules.slip = Some(slip),
            Rule::MassAt(index) => {
                self.mass = (0..self.mass.len()).map(|dof| self.mass_read(index, dof)).collect();
            }
            Rule::MatrixMassAt(index) => rules.matrix_mass_at = Some(index),
            Rule::ColumnMasses => rules.column_masses = true,
            Rule::Differences { step, central } => rules.differences = Some((step, central)),
            Rule::Gate(gate) => rules.gate = Some(gate),
            Rule::Iterations(count) => rules.iterations = count,
            Rule::Entries(entries) => rules.entries = entries,
            Rule::ForcesAt(c) => rules.forces_at = Some(c),
            Rule::JacobiansAt(which, c) => {
                let which = rules.jacobians_at.iter_mut().zip(which).filter(|(_, is_it)| *is_it);
                which.for_each(|(at, _)| *at = Some(c));
            }
            Rule::Linearized(Linearized { forces, jacobians, right }) => {
                rules.forces_at = Some(forces);
                rules.jacobians_at = [Some(jacobians); 2];
                rules.stiff_right = right;
            }
            Rule::PositionsFirst => {
                (rules.position, rules.forces_at) = (Some([1.0, 0.0, 1.0]), Some(1.0));
            }
            Rule::Stale(stale) => rules.stale = Some(stale),
            Rule::StaleJacobians => rules.stale_jacobians = true,
            Rule::Blocks(axes) => rules.blocks = Some(axes),
            Rule::WholeChange { inertia, forces } => {
                rules.whole_change = [inertia, forces];
            }
            Rule::Unmoved { positions, velocities } => {
                rules.unmoved = [positions, velocities];
                // The matrix is that of another equation: the method converges slowly.
                rules.newton.iterations = MANY_ITERATIONS;
            }
            Rule::Whole { of_free } => rules.whole = Some(of_free),
            Rule::Scaled(power) => rules.scaled = power,
            Rule::Restarted { iterations, from_zero } => {
                (rules.restarted, rules.newton.iterations) = (Some(from_zero), iterations);
            }
            Rule::Accumulated { iterations, by } => {
                (rules.accumulated, rules.newton.iterations) = (Some(by), iterations);
            }
            Rule::Once => rules.once = true,
            Rule::SeenAt(at) => rules.seen_at = Some(at),
            Rule::Mean { moves } => {
                rules.seen_at = Some(SeenAt::Mean);
                rules.position = moves.then_some([0.5, 0.5, 1.0]);
                // The matrix is that of another equation.
                rules.newton.iterations = MANY_ITERATIONS;
            }
            Rule::MovedOn => {
                rules.seen_at = Some(SeenAt::MovedOn);
                rules.position = Some([-1.0, 2.0, 1.0]);
                // The matrix is that of another equation.
                rules.newton.iterations = MANY_ITERATIONS;
            }
            Rule::FirstJacobians => {
                rules.first_jacobians = true;
                rules.newton.iterations = MANY_ITERATIONS;
            }
            Rule::Other(quantity) => rules.other = Some(quantity),
            Rule::Summed(quantity) => rules.summed = Some(quantity),
            Rule::ForcesAlong(from, to) => rules.forces_along = Some([from, to]),
            Rule::PositionAlong(axis, of) => rules.position_along = Some((axis, of)),
            Rule::Lost => rules.lost = true,
            Rule::Seen(factors) => rules.seen = factors,
            Rule::AlongAxis(axis, factor) => rules.along = Some((axis, factor)),
            Rule::Split(term) => {
                let mut terms = self.terms.iter_mut();
                if let Some(model) = terms.find(|model| model.term == term) {
                    model.evaluations[0].start = Some(Start::OtherForces);
                }
            }
            Rule::Kept(kept) => {
                let quantities = [Quantity::ByPosition, Quantity::ByVelocity];
                let mut jacobians = quantities.into_iter().zip(kept.jacobians);
                let is_kept =
                    |quantity: Quantity| self.terms.iter().any(|model| model.term.has(quantity));
                let acts = jacobians.any(|(quantity, kept)| kept && is_kept(quantity));
                if kept.forces || kept.inertia || kept.displacement || acts {
                    rules.kept = Some(kept);
                }
            }
            Rule::OneByOne { each, moves } => rules.one_by_one = Some((each, moves)),
            Rule::Position { old, new, h } => {
                rules.position = Some([old, new, f64::from(h)]);
            }
            Rule::Kick { old, forces } => {
                rules.old = old;
                rules.forces = rules.forces.and(Factor::number(forces));
            }
            Rule::Diagonal(added) => rules.diagonal = added,
            Rule::SpeedLimit(limit) => rules.speed_limit = Some(limit),
            Rule::Newton(newton) => rules.newton = newton,
            Rule::Repeated(count) => self.substeps = count,
            Rule::Substeps(count) => {
                self.substeps = count;
                self.h = self.scene.time_step / f64::from(count);
            }
        }
    }

    /// The mass of a coordinate that is read at such an index.
    fn mass_read(&self, index: MassAt, dof: usize) -> f64 {
        let (mass, axis) = (&self.mass, dof % self.dimension);
        match index {
            MassAt::Particle => mass[dof / self.dimension],
            MassAt::First => mass[0],
            MassAt::ByAxis => mass[dof % self.scene.particles.len() * self.dimension],
            MassAt::Coordinate => mass[(dof / self.dimension + axis).min(mass.len() - 1)],
            MassAt::FirstAlong(along) if axis == along => mass[0],
            MassAt::FirstAlong(_) => mass[dof],
            MassAt::Next => mass.get(dof + self.dimension).copied().unwrap_or_default(),
            MassAt::OneOf { last } => {
                let particle = if last { self.scene.particles.len() - 1 } else { 0 };
                if dof / self.dimension == particle { 1.0 } else { mass[dof] }
            }
            MassAt::Half { .. } if dof >= self.scene.particles.len() => 0.0,
            MassAt::Half { of_particles: true } => mass[dof * self.dimension],
            MassAt::Half { of_particles: false } => mass[dof],
        }
    }

    /// The mass of a coordinate on the diagonal of the matrix.
    pub(super) fn matrix_mass(&self, dof: usize) -> f64 {
        self.rules.matrix_mass_at.map_or(self.mass[dof], |index| self.mass_read(index, dof))
    }

    /// The value of a term's force, or its Jacobian times `delta`, on every coordinate.
    pub(super) fn value(
        &self,
        model: &TermModel,
        quantity: Quantity,
        at: &Point<'_>,
        delta: &[f64],
    ) -> Vec<f64> {
        let mut sum = vec![0.0; at.x.len()];
        match quantity {
            Quantity::Force => self.add_force(model, at, &mut sum),
            _ => self.each_entry(model, quantity, at, &mut |row, column, value| {
                sum[row] += value * delta[column];
            }),
        }
        sum
    }

    /// The elements of a term, those of a field on each particle: each alone, with its number by each measure at this point.
    pub(super) fn each_piece(
        &self,
        term: usize,
        measures: &[Measure],
        at: &Point<'_>,
    ) -> Vec<(TermModel, Vec<Option<f64>>)> {
        let model = &self.terms[term];
        let of = |element: &Element, particles: &[usize], particle: Option<usize>| {
            let state = |each: usize| [self.vector(&at.x, each), self.vector(&at.v, each)];
            let place = element.place;
            let measured =
                Measured { scene: &self.scene, place: Some(place), particles, state: &state };
            let values = measures.iter().map(|measure| measure.of(&measured)).collect();
            let only = Some((place, particle));
            let elements: Arc<[Element]> = match &model.law {
                None => Arc::new([element.clone()]),
                Some(_) => Arc::clone(&model.elements),
            };
            (TermModel { only, elements, ..model.clone() }, values)
        };
        let mut all = Vec::new();
        for element in &*model.elements {
            match element.particles.is_empty() {
                true => all.extend(
                    (0..self.scene.particles.len()).map(|one| of(element, &[one], Some(one))),
                ),
                false => all.push(of(element, &element.particles, None)),
            }
        }
        all
    }

    /// The term that a change is made in, if the scene has it: its number, and itself with the change made.
    pub(super) fn changed(&self, change: &Change) -> Option<(usize, TermModel)> {
        let term = match &change.effect {
            Effect::Formula(term, ..)
            | Effect::Derived(term, _)
            | Effect::Factor(term, ..)
            | Effect::Ends(term, _)
            | Effect::Blocks(term, ..)
            | Effect::Axes(term, ..)
            | Effect::Length(term, ..)
            | Effect::Particles(term, ..)
            | Effect::Masses(term, ..)
            | Effect::Read(term, _)
            | Effect::Gate(term, ..)
            | Effect::Weight(term, ..)
            | Effect::Start(term, ..) => *term,
            Effect::Method(..)
            | Effect::Fixed(_)
            | Effect::Helper(..)
            | Effect::Scene(_)
            | Effect::Partly(..)
            | Effect::Rounds(_) => {
                return None;
            }
        };
        let number = self.terms.iter().position(|model| model.term == term)?;
        let mut model = self.terms[number].clone();
        model.make(&change.effect);
        Some((number, model))
    }

    /// The sum of all forces.
    pub(super) fn force(&self, at: &Point<'_>) -> Vec<f64> {
        self.force_without(at, None)
    }

    /// The sum of all forces but one.
    pub(super) fn force_without(&self, at: &Point<'_>, left_out: Option<Term>) -> Vec<f64> {
        let mut sum = vec![0.0; at.x.len()];
        let terms = self.terms.iter().filter(|model| Some(model.term) != left_out);
        terms.for_each(|model| self.add_force(model, at, &mut sum));
        sum
    }

    /// The sum of all Jacobians of a kind.
    pub(super) fn jacobian(&self, quantity: Quantity, at: &Point<'_>) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(at.x.len(), at.x.len());
        for model in &self.terms {
            self.each_entry(model, quantity, at, &mut |row, column, value| {
                matrix[(row, column)] += value;
            });
        }
        matrix
    }

    /// The entries of a term's Jacobian that the solver reads: row, column, value.
    fn each_entry(
        &self,
        model: &TermModel,
        quantity: Quantity,
        at: &Point<'_>,
        add: &mut dyn FnMut(usize, usize, f64),
    ) {
        let axes = self.dimension;
        let place = quantity.place();
        let most = model.n_coordinates(place, at.x.len(), axes);
        let changes = self.block_changes(model, quantity);
        self.each_block(model, quantity, at, &mut |row, column, block| {
            let block = self.rules.blocks.map_or(*block, |axes| axes.of_matrix(*block));
            let first = changes.iter().flatten().find_map(|change| match change {
                Blocks::AtIndex { own } if !own || row == column => Some([row, column]),
                Blocks::RowAtIndex => Some([row, column * axes]),
                Blocks::ColumnAtIndex => Some([row * axes, column]),
                _ => None,
            });
            let first = first.unwrap_or([row * axes, column * axes]);
            for (a, b) in (0..axes).flat_map(|a| (0..axes).map(move |b| (a, b))) {
                let (row, column, value) = (first[0] + a, first[1] + b, block[(a, b)]);
                if row >= most {
                    continue;
                }
                let is_mirrored = match self.rules.entries {
                    Entries::All => false,
                    Entries::Lower if row < column => continue,
                    Entries::Upper if row > column => continue,
                    Entries::Lower | Entries::Upper => row != column,
                    Entries::Transposed => {
                        add(column, row, value);
                        continue;
                    }
                    Entries::Diagonal if row != column => continue,
                    Entries::OwnBlocks if row / axes != column / axes => continue,
                    Entries::LowerBlocks if row / axes < column / axes => continue,
                    Entries::UpperBlocks if row / axes > column / axes => continue,
                    Entries::NotDiagonal if row == column => continue,
                    Entries::Diagonal
                    | Entries::NotDiagonal
                    | Entries::OwnBlocks
                    | Entries::LowerBlocks
                    | Entries::UpperBlocks => false,
                };
                add(row, column, value);
                if is_mirrored {
                    add(column, row, value);
                }
            }
        });
    }

    fn add_force(&self, model: &TermModel, at: &Point<'_>, sum: &mut [f64]) {
        let evaluation = &model.evaluations[0];
        self.work.add(cost::FORCE * self.n_evaluations(model, Quantity::Force));
        let [x, v] = &at.read(evaluation.start, &self.fixed, self.dimension);
        let most = model.n_coordinates(0, sum.len(), self.dimension);
        let factor = |particle: usize| {
            evaluation.factor.of(self.scene.time_step, self.scene.particles[particle].mass)
        };
        // On the coordinates from `first` on.
        let mut add_at = |first: usize, particle: usize, mut force: Vector3<f64>| {
            if let Some(axes) = evaluation.axes {
                force = axes.of_vector(force);
            }
            let factor = factor(particle);
            let is_last = particle + 1 == self.scene.particles.len();
            let lacks = |axis: usize| {
                is_last && evaluation.particles == Some(Particles::NotLastAlong(axis))
            };
            let axes = (0..self.dimension).filter(|axis| first + axis < most);
            for axis in axes.filter(|axis| !lacks(*axis)) {
                sum[first + axis] += factor * force[axis];
            }
        };
        // The forces on the particles of an element, changed.
        let mut add_all = |element: &Element, particles: &[usize], forces: &mut [Vector3<f64>]| {
            if let Some(ends) = evaluation.ends {
                ends.change(particles, forces);
            }
            let weight = self.gate_factor(model, Quantity::Force, element, particles, [x, v])
                * self.size_weight(model, Quantity::Force, element, x);
            if weight == 0.0 {
                return;
            }
            for (place, (particle, force)) in particles.iter().zip(forces).enumerate() {
                let is_slipped = evaluation.ends == Some(Ends::AtIndex)
                    || place == 1 && evaluation.ends == Some(Ends::SecondAtIndex);
                let target = match evaluation.ends {
                    Some(Ends::SecondToNext) if place == 1 => {
                        (particles[0] + 1) % self.scene.particles.len()
                    }
                    _ => *particle,
                };
                let first = if is_slipped { target } else { target * self.dimension };
                for (_, axis) in element.lost.forces.iter().filter(|(one, _)| one == particle) {
                    match axis {
                        Some(axis) => force[*axis] = 0.0,
                        None => *force = Vector3::zeros(),
                    }
                }
                add_at(first, *particle, *force * weight);
            }
        };
        if let Some(law) = model.law_of(Quantity::Force) {
            let elements = model.elements_of(Quantity::Force);
            law.each_stencil(|law, stencil| {
                let forces = law.forces_on(stencil, x, v, at.time);
                let mut forces: Vec<Vector3<f64>> = forces.into_iter().map(Into::into).collect();
                add_all(&elements[stencil.number], &stencil.particles, &mut forces);
            });
            return;
        }
        let Some(formula) = &evaluation.formula else { return };
        for element in model.elements_of(Quantity::Force) {
            let of = |pair: [usize; 2], masses: Option<MassAt>| {
                formula
                    .value(&self.inputs((model, Quantity::Force), element, pair, [x, v], masses))
                    .vector()
            };
            // With a separate mass for each component.
            let on = |pair: [usize; 2]| match evaluation.masses {
                Some(MassAt::Coordinate) => Vector3::from_fn(|axis, _| {
                    let last = self.mass.len() - 1;
                    let read = pair.map(|one| (one + axis).min(last) / self.dimension);
                    let inputs = self.inputs((model, Quantity::Force), element, pair, [x, v], None);
                    let masses = read.map(|particle| self.scene.particles[particle].mass);
                    formula.value(&Inputs { masses, ..inputs }).vector()[axis]
                }),
                None if matches!(self.mass_list, Some((_, false))) => {
                    Vector3::from_fn(|axis, _| {
                        let axis = axis.min(self.dimension - 1);
                        let inputs =
                            self.inputs((model, Quantity::Force), element, pair, [x, v], None);
                        let masses = match element.particles.is_empty() {
                            true => pair.map(|one| self.mass_at(one * self.dimension + axis)),
                            false => inputs.masses,
                        };
                        formula.value(&Inputs { masses, ..inputs }).vector()[axis]
                    })
                }
                masses => of(pair, masses),
            };
            if let [i, j] = element.particles[..] {
                let force = on([i, j]);
                add_all(element, &[i, j], &mut [force, -force]);
                continue;
            }
            for particle in self.particles(model, Quantity::Force) {
                add_all(element, &[particle], &mut [on([particle; 2])]);
            }
        }
    }

    fn each_block(
        &self,
        model: &TermModel,
        quantity: Quantity,
        at: &Point<'_>,
        add: &mut impl FnMut(usize, usize, &Matrix3<f64>),
    ) {
        let place = usize::from(quantity == Quantity::ByVelocity);
        let each = if model.derived { cost::DERIVATIVES } else { cost::JACOBIAN };
        self.work.add(each * self.n_evaluations(model, quantity));
        let evaluation = &model.evaluations[1 + place];
        let [x, v] = &at.read(evaluation.start, &self.fixed, self.dimension);
        let factor =
            |row: usize| evaluation.factor.of(self.scene.time_step, self.scene.particles[row].mass);
        let mut put = |element: &Element, row: usize, column: usize, block: Matrix3<f64>| {
            let pair = [row, column];
            let particles =
                if element.particles.is_empty() { &pair[..1] } else { &element.particles };
            let weight = self.gate_factor(model, quantity, element, particles, [x, v])
                * self.size_weight(model, quantity, element, x);
            if weight == 0.0 {
                return;
            }
            let mut block = evaluation.axes.map_or(block, |axes| axes.of_matrix(block));
            for (_, entry) in
                element.lost.blocks[place].iter().filter(|(at, _)| *at == [row, column])
            {
                match entry {
                    Some([a, b]) => block[(*a, *b)] = 0.0,
                    None => return,
                }
            }
            add(row, column, &(block * (factor(row) * weight)));
        };
        if model.derived {
            self.each_derived_block(model, quantity, [x, v], &mut put);
            return;
        }
        let changes = self.block_changes(model, quantity);
        // The blocks of an element, row by row, changed.
        let mut put_all = |element: &Element, particles: &[usize], blocks: &mut [Matrix3<f64>]| {
            let m = particles.len();
            changes.iter().flatten().for_each(|change| change.change(m, blocks));
            if let (Some(Helper::Entries(of, axes)), 2) = (self.helper_of(model.term, quantity), m)
                && of.contains(&quantity)
            {
                blocks.iter_mut().for_each(|block| *block = axes.of_matrix(*block));
            }
            let is_local = changes.contains(&Some(Blocks::LocalIndices));
            let particle = |place: usize| if is_local { place } else { particles[place] };
            for (place, block) in blocks.iter().enumerate() {
                put(element, particle(place / m), particle(place % m), *block);
            }
        };
        if let Some(law) = model.law_of(quantity) {
            let elements = model.elements_of(quantity);
            law.each_stencil(|law, stencil| {
                let both = law.jacobians_on(stencil, x, v, at.time);
                let matrix = if place == 0 { both.by_position } else { both.by_velocity };
                let (m, d) = (stencil.particles.len(), self.dimension);
                let block = |place: usize| {
                    let (row, column) = (place / m * d, place % m * d);
                    let entry = |a: usize, b: usize| matrix[(row + a, column + b)];
                    Matrix3::from_fn(|a, b| if a.max(b) < d { entry(a, b) } else { 0.0 })
                };
                let mut blocks: Vec<Matrix3<f64>> = (0..m * m).map(block).collect();
                put_all(&elements[stencil.number], &stencil.particles, &mut blocks);
            });
            return;
        }
        let Some(formula) = &evaluation.formula else { return };
        for element in model.elements_of(quantity) {
            let of = |pair: [usize; 2]| {
                let inputs =
                    self.inputs((model, quantity), element, pair, [x, v], evaluation.masses);
                formula.value(&inputs).matrix()
            };
            if let [i, j] = element.particles[..] {
                let block = of([i, j]);
                put_all(element, &[i, j], &mut [block, -block, -block, block]);
                continue;
            }
            for particle in self.particles(model, quantity) {
                put_all(element, &[particle], &mut [of([particle; 2])]);
            }
        }
    }

    /// The slip in the functions on vectors by which a quantity of a term is computed.
    fn helper_of(&self, term: Term, quantity: Quantity) -> Option<Helper> {
        let (of, quantities, helper) = self.helper?;
        let is_its = of.is_none_or(|tag| tag == term.tag) && quantities.contains(&quantity);
        is_its.then_some(helper)
    }

    /// The particles on which a quantity of a field acts.
    fn particles(&self, model: &TermModel, quantity: Quantity) -> std::ops::Range<usize> {
        let count = self.scene.particles.len();
        match model.evaluations[quantity.place()].particles {
            Some(Particles::AsElements) => 0..count.min(model.elements_of(quantity).len()),
            particles => Particles::of(particles, count),
        }
    }

    /// How often a term's formula is evaluated.
    fn n_evaluations(&self, model: &TermModel, quantity: Quantity) -> usize {
        let on_all = |element: &Element| element.particles.is_empty();
        let of = |element| if on_all(element) { self.scene.particles.len() } else { 1 };
        model.elements_of(quantity).iter().map(of).sum()
    }

    /// How the blocks of a term's Jacobian are changed: by itself, and then as those of every force between two particles.
    fn block_changes(&self, model: &TermModel, quantity: Quantity) -> [Option<Blocks>; 2] {
        let is_pair = || model.term.schema().stencil.size() == 2;
        let of_all = match self.helper_of(model.term, quantity) {
            Some(Helper::Blocks(of, change)) if of.contains(&quantity) && is_pair() => Some(change),
            _ => None,
        };
        [model.evaluations[quantity.place()].blocks, of_all]
    }

    /// The blocks of the derivatives of a force's own formula.
    fn each_derived_block(
        &self,
        model: &TermModel,
        quantity: Quantity,
        at: [&[f64]; 2],
        put: &mut impl FnMut(&Element, usize, usize, Matrix3<f64>),
    ) {
        let Evaluation { formula: Some(formula), masses, .. } = &model.evaluations[0] else {
            return;
        };
        let masses = *masses;
        let by_velocity = quantity == Quantity::ByVelocity;
        for element in model.elements_of(quantity) {
            let block = |inputs: &Inputs<'_>, side: usize, sign: f64| {
                let column = |axis: usize| {
                    let mut along = Direction::default();
                    match by_velocity {
                        true => along.v[side][axis] = 1.0,
                        false => along.d[axis] = sign,
                    }
                    formula.derivative(inputs, &along).vector()
                };
                Matrix3::from_columns(&[column(0), column(1), column(2)])
            };
            if let [i, j] = element.particles[..] {
                let inputs = self.inputs((model, quantity), element, [i, j], at, masses);
                let [own, cross] = [block(&inputs, 0, 1.0), block(&inputs, 1, -1.0)];
                put(element, i, i, own);
                put(element, i, j, cross);
                put(element, j, i, -own);
                put(element, j, j, -cross);
                continue;
            }
            for particle in 0..if by_velocity { self.scene.particles.len() } else { 0 } {
                let inputs = self.inputs((model, quantity), element, [particle; 2], at, masses);
                put(element, particle, particle, block(&inputs, 0, 1.0));
            }
        }
    }

    /// Whether a term reads such values in the place of its arguments.
    pub(super) fn reads(&self, is_it: impl Fn(Start) -> bool + Copy) -> bool {
        self.terms.iter().any(|model| model.reads(is_it))
    }

    /// The term that reads the velocities that other forces give.
    pub(super) fn reads_given(&self) -> Option<Term> {
        let is_it = |model: &&TermModel| model.start() == Some(Start::OtherForces);
        self.terms.iter().find(is_it).map(|model| model.term)
    }

    /// A particle at a point, as the element of a field.
    pub(super) fn at_particle<T>(
        &self,
        at: &Point<'_>,
        particle: usize,
        then: impl FnOnce(&Measured<'_>) -> T,
    ) -> T {
        then(&Measured {
            scene: &self.scene,
            place: None,
            particles: &[particle],
            state: &|particle| [self.vector(&at.x, particle), self.vector(&at.v, particle)],
        })
    }

    /// The factor that an element's value has by its sizes.
    fn size_weight(
        &self,
        model: &TermModel,
        quantity: Quantity,
        element: &Element,
        x: &[f64],
    ) -> f64 {
        let Some((quantities, weight)) = model.weight else { return 1.0 };
        if !quantities.contains(&quantity) {
            return 1.0;
        }
        let of = &model.scene_of(quantity, &self.scene).forces[element.place];
        let mut rest: Vec<Vector3<f64>> = of.undeformed().iter().map(|x| (*x).into()).collect();
        if rest.is_empty() {
            let start = |particle: &usize| self.scene.particles[*particle].position.into();
            rest = of.particles.iter().map(start).collect();
        }
        let now = of.particles.iter().map(|particle| self.vector(x, *particle));
        weight.of(of.schema, &rest, &now.collect::<Vec<_>>())
    }

    /// The factor by which an element's value is multiplied.
    fn gate_factor(
        &self,
        model: &TermModel,
        quantity: Quantity,
        element: &Element,
        particles: &[usize],
        [x, v]: [&[f64]; 2],
    ) -> f64 {
        if let Some((place, particle)) = model.only {
            let is_it = place == element.place && particle.is_none_or(|one| particles == [one]);
            return f64::from(u8::from(is_it));
        }
        match model.gate {
            Some((quantities, gate)) if quantities.contains(&quantity) => {
                gate.factor_of(&Measured {
                    scene: model.scene_of(quantity, &self.scene),
                    place: Some(element.place),
                    particles,
                    state: &|particle| [self.vector(x, particle), self.vector(v, particle)],
                })
            }
            _ => 1.0,
        }
    }

    pub(super) fn vector(&self, values: &[f64], particle: usize) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| match axis < self.dimension {
            true => values[particle * self.dimension + axis],
            false => 0.0,
        })
    }

    fn inputs<'a>(
        &self,
        (model, quantity): (&TermModel, Quantity),
        element: &'a Element,
        [i, j]: [usize; 2],
        [x, v]: [&[f64]; 2],
        masses: Option<MassAt>,
    ) -> Inputs<'a> {
        let helper = self.helper_of(model.term, quantity);
        let of_all = match helper {
            Some(Helper::Read(read)) => Some(read),
            _ => None,
        };
        let slip = model.read.or(of_all);
        let read = |values: &[f64], particle: usize, which: Coordinates| {
            let mut vector = self.vector(values, particle);
            let Some(Read { of, at }) = slip else { return vector };
            let is_read = match of {
                Coordinates::All => true,
                Coordinates::AllPositions => matches!(which, Coordinates::Positions(_)),
                Coordinates::AllVelocities => matches!(which, Coordinates::Velocities(_)),
                _ => of == which,
            };
            if !is_read {
                return vector;
            }
            let (first, last) = (particle * self.dimension, self.dimension - 1);
            // Beyond the first and the last number, there is nothing.
            let number = |place: Option<usize>| {
                place.and_then(|place| values.get(place)).copied().unwrap_or(0.0)
            };
            match at {
                ReadAt::Number => {
                    (0..=last).for_each(|axis| vector[axis] = values[particle + axis]);
                }
                ReadAt::Axis(from, to) => vector[to] = vector[from],
                ReadAt::Next => vector[last] = number(Some(first + last + 1)),
                ReadAt::Before => vector[0] = number(first.checked_sub(1)),
                ReadAt::Scaled(factor) => vector *= factor,
                ReadAt::Negated(axis) => vector[axis] *= -1.0,
            }
            vector
        };
        let d = read(x, i, Coordinates::Positions(0)) - read(x, j, Coordinates::Positions(1));
        let softening = model.softening.filter(|(of, _)| of.contains(&quantity));
        let softening = softening.map(|(_, softening)| softening);
        let l = match softening {
            Some(Softening::Together) => {
                let each =
                    model.elements.iter().filter_map(|element| match element.particles[..] {
                        [i, j] => Some((self.vector(x, i) - self.vector(x, j)).norm_squared()),
                        _ => None,
                    });
                each.sum::<f64>().sqrt()
            }
            _ => helper::length(helper, &d),
        };
        let mass_of = |particle: usize| match masses {
            None => particle,
            Some(MassAt::Particle) => particle / self.dimension,
            Some(MassAt::First) => 0,
            Some(MassAt::Next) => particle + 1,
            // A force reads one mass for all axes: it has no other place for it.
            Some(
                MassAt::ByAxis
                | MassAt::Coordinate
                | MassAt::FirstAlong(_)
                | MassAt::OneOf { .. }
                | MassAt::Half { .. },
            ) => particle,
        };
        Inputs {
            parameters: &element.parameters,
            masses: [i, j].map(|particle| match mass_of(particle) {
                read if read < self.scene.particles.len() => self.mass_at(read * self.dimension),
                _ => 0.0,
            }),
            h: self.scene.time_step,
            d,
            v: [read(v, i, Coordinates::Velocities(0)), read(v, j, Coordinates::Velocities(1))],
            l: softening.map_or(l, |softening| softening.of(l)),
            helper,
            by_zero: self.by_zero,
        }
    }
}

impl TermModel {
    /// The elements of which a quantity is the sum.
    fn elements_of(&self, quantity: Quantity) -> &[Element] {
        self.others_of(quantity).map_or(&self.elements, |others| &others.elements)
    }

    /// The law of these elements, if the force has no formula.
    fn law_of(&self, quantity: Quantity) -> Option<&Laws> {
        self.others_of(quantity).map_or(&self.law, |others| &others.law).as_deref()
    }

    /// The scene of these elements: `scene`, or as it is read for this quantity.
    fn scene_of<'a>(&'a self, quantity: Quantity, scene: &'a Scene) -> &'a Scene {
        self.others_of(quantity).map_or(scene, |others| &others.scene)
    }

    fn others_of(&self, quantity: Quantity) -> Option<&Others> {
        self.others.as_ref().filter(|others| others.quantities.contains(&quantity))
    }

    /// The values that its force reads in the place of its arguments.
    pub(super) fn start(&self) -> Option<Start> {
        self.evaluations[0].start
    }

    /// Whether one of its values reads such values.
    pub(super) fn reads(&self, is_it: impl Fn(Start) -> bool) -> bool {
        self.evaluations.iter().filter_map(|evaluation| evaluation.start).any(is_it)
    }

    /// The number of coordinates, from the first on, in which its value of this number acts.
    fn n_coordinates(&self, value: usize, all: usize, dimension: usize) -> usize {
        match self.evaluations[value].particles {
            Some(Particles::FirstCoordinates) => all / dimension,
            _ => all,
        }
    }

    fn make(&mut self, effect: &Effect) {
        match effect {
            Effect::Formula(_, quantity, formula) => {
                self.evaluations[quantity.place()].formula = Some(Arc::clone(formula));
            }
            Effect::Derived(_, formula) => {
                self.evaluations[0].formula = Some(Arc::clone(formula));
                self.derived = true;
            }
            Effect::Factor(_, quantities, factor) => {
                for quantity in *quantities {
                    let evaluation = &mut self.evaluations[quantity.place()];
                    evaluation.factor = evaluation.factor.and(*factor);
                }
            }
            Effect::Ends(_, ends) => {
                self.evaluations[0].ends = Some(match *ends {
                    Ends::Again(place, [from, _]) if self.term.part == from => {
                        Ends::Times(place, 2.0)
                    }
                    Ends::Again(place, [_, to]) if self.term.part == to => Ends::Times(place, 0.0),
                    ends => ends,
                });
            }
            Effect::Blocks(_, quantities, blocks) => {
                for quantity in *quantities {
                    self.evaluations[quantity.place()].blocks = Some(*blocks);
                }
            }
            Effect::Axes(_, quantity, axes) => {
                self.evaluations[quantity.place()].axes = Some(*axes);
            }
            Effect::Length(_, quantities, softening) => {
                self.softening = Some((quantities, *softening));
            }
            Effect::Masses(_, quantities, masses) => {
                for quantity in *quantities {
                    self.evaluations[quantity.place()].masses = Some(*masses);
                }
            }
            Effect::Read(_, read) => self.read = Some(*read),
            Effect::Gate(_, quantities, gate) => self.gate = Some((quantities, *gate)),
            Effect::Weight(_, quantities, weight) => self.weight = Some((quantities, *weight)),
            Effect::Start(_, quantities, start) => {
                for quantity in *quantities {
                    self.evaluations[quantity.place()].start = Some(*start);
                }
            }
            Effect::Particles(_, quantity, particles) => {
                self.evaluations[quantity.place()].particles = Some(*particles);
            }
            Effect::Method(..)
            | Effect::Fixed(_)
            | Effect::Helper(..)
            | Effect::Scene(_)
            | Effect::Partly(..)
            | Effect::Rounds(_) => {}
        }
    }
}

/// The integrator with this method.
fn name_of(method: OnePoint) -> Option<&'static str> {
    let mut kinds = simulator::integrator::REGISTRY.iter().map(|kind| &kind.schema);
    kinds.find(|schema| Method::one_point(schema) == Some(method)).map(|schema| schema.name)
}

/// Row and column of blocks of a Jacobian, and the entry if it is one.
type LostBlocks = Vec<([usize; 2], Option<[usize; 2]>)>;

/// The parts of an element that later elements overwrite.
#[derive(Clone, Default)]
struct Lost {
    /// The particles on which its force is overwritten, and the component if it is one.
    forces: Vec<(usize, Option<usize>)>,
    /// Of its Jacobians by position, then by velocity.
    blocks: [LostBlocks; 2],
}

fn lost(scene: &Scene, changes: &[Change]) -> Vec<Lost> {
    let mut all = vec![Lost::default(); scene.forces.len()];
    for change in changes {
        let Effect::Scene(rule) = change.effect else { continue };
        let of = match rule {
            SceneRule::Overwrites(tag, ..)
            | SceneRule::Assigned(tag, ..)
            | SceneRule::AssignedDiagonal(tag, _)
            | SceneRule::AssignedCross(tag, ..)
            | SceneRule::Scattered(tag)
            | SceneRule::AssignedOwn(tag, ..) => Some(tag),
            SceneRule::AssignedByAll { .. } => None,
            _ => continue,
        };
        for (number, element) in scene.forces.iter().enumerate() {
            if of.is_some_and(|tag| element.schema.tag != tag) {
                continue;
            }
            if let SceneRule::AssignedByAll { quantities, own, is_first: true, fields } = rule {
                let is_put = |other: &&ForceElement| fields || !other.particles.is_empty();
                for quantity in quantities.iter().filter(|_| is_put(&element)) {
                    let has_it = |other: &&ForceElement| depends_on(other, *quantity);
                    let before = scene.forces[..number].iter().filter(is_put).filter(has_it);
                    let mut blocks: Vec<_> = before.flat_map(|one| blocks_of(scene, one)).collect();
                    blocks.retain(|[row, column]| !own || row == column);
                    let place = usize::from(*quantity == Quantity::ByVelocity);
                    all[number].blocks[place].extend(whole(blocks));
                }
                continue;
            }
            let order = match rule {
                SceneRule::Overwrites(.., order)
                | SceneRule::AssignedCross(.., order)
                | SceneRule::AssignedOwn(.., order) => order,
                _ => Order::File,
            };
            let earlier = all.iter_mut().enumerate();
            let earlier = earlier.filter(|(other, _)| order.is_before(scene, *other, number));
            let mut before: Vec<&mut Lost> = earlier.map(|(_, lost)| lost).collect();
            if let (SceneRule::Scattered(tag), [i, j]) = (rule, &element.particles[..]) {
                for (lost, other) in before.iter_mut().zip(&scene.forces) {
                    let [first, second] = match other.particles[..] {
                        [first, second] if other.schema.tag == tag => [first, second],
                        _ => continue,
                    };
                    let same = [(first == *i, first), (second == *j, second)];
                    let is_same = same.map(|(is_same, _)| is_same);
                    let of_ends = same.into_iter().filter(|(is_same, _)| *is_same);
                    for (_, particle) in of_ends {
                        lost.forces.push((particle, None));
                        lost.blocks.iter_mut().for_each(|all| all.push(([particle; 2], None)));
                    }
                    if is_same == [true; 2] {
                        for block in [[first, second], [second, first]] {
                            lost.blocks.iter_mut().for_each(|all| all.push((block, None)));
                        }
                    }
                }
                continue;
            }
            let (quantities, blocks): (&[Quantity], _) = match rule {
                SceneRule::Assigned(_, quantity, _) => {
                    (&[quantity], whole(blocks_of(scene, element)))
                }
                SceneRule::AssignedByAll { quantities, own, is_first: false, fields }
                    if fields || !element.particles.is_empty() =>
                {
                    let mut blocks = blocks_of(scene, element);
                    blocks.retain(|[row, column]| !own || row == column);
                    (quantities, whole(blocks))
                }
                SceneRule::AssignedCross(_, quantity, _) => {
                    let mut blocks = blocks_of(scene, element);
                    blocks.retain(|[row, column]| row != column);
                    (&[quantity], whole(blocks))
                }
                SceneRule::AssignedDiagonal(_, quantity) => {
                    let axes = 0..scene.dimension.count();
                    let own = particles_of(scene, element).into_iter();
                    let entries = own
                        .flat_map(|one| axes.clone().map(move |axis| ([one; 2], Some([axis; 2]))));
                    (&[quantity], entries.collect())
                }
                SceneRule::AssignedOwn(_, quantity, place, entry, _) => {
                    let places = place.map_or(0..element.particles.len(), |place| place..place + 1);
                    let blocks = element.particles[places].iter().map(|one| ([*one; 2], entry));
                    (&[quantity], blocks.collect())
                }
                _ => (&[], Vec::new()),
            };
            for quantity in quantities {
                let place = usize::from(*quantity == Quantity::ByVelocity);
                if depends_on(element, *quantity) {
                    before.iter_mut().for_each(|lost| lost.blocks[place].extend(&blocks));
                }
            }
            let (particles, axis) = match (&element.particles[..], rule) {
                ([first, ..], SceneRule::Overwrites(_, Ends::First, axis, _)) => {
                    (vec![*first], axis)
                }
                ([_, second, ..], SceneRule::Overwrites(_, Ends::Second, axis, _)) => {
                    (vec![*second], axis)
                }
                (_, SceneRule::Overwrites(_, _, axis, _)) => (particles_of(scene, element), axis),
                _ => continue,
            };
            let forces = particles.into_iter().map(|particle| (particle, axis));
            let forces: Vec<_> = forces.collect();
            before.iter_mut().for_each(|lost| lost.forces.extend(&forces));
        }
    }
    all
}

/// Whether a force has such a Jacobian.
fn depends_on(element: &ForceElement, quantity: Quantity) -> bool {
    Term { tag: element.schema.tag, part: "" }.has(quantity)
}

/// Each as a whole, without a component or entry.
fn whole<T, U>(all: Vec<T>) -> Vec<(T, Option<U>)> {
    all.into_iter().map(|one| (one, None)).collect()
}

impl Index {
    fn of(self, number: usize) -> usize {
        match self {
            Self::LastDigit => number % 10,
            Self::FirstDigit => number / 10_usize.pow(number.checked_ilog10().unwrap_or(0)),
            Self::Byte => number % 256,
            Self::Less => number.saturating_sub(1),
        }
    }
}

impl Which {
    /// Whether each element of the scene is one of these elements of a force.
    fn of(self, scene: &Scene, tag: &str) -> Vec<bool> {
        let is_its = |element: &ForceElement| element.schema.tag == tag;
        let first = scene.forces.iter().position(is_its);
        let last = scene.forces.iter().rposition(is_its);
        let is_one = |(number, element): (usize, &ForceElement)| match self {
            Self::NotLast => Some(number) != last,
            Self::NotFirst => Some(number) != first,
            Self::Last => Some(number) == last,
            Self::NotLastOnEdge => {
                let mut later = scene.forces[number + 1..].iter().filter(|one| is_its(one));
                element.edge.is_some() && later.any(|one| one.edge == element.edge)
            }
            Self::NotFirstOnEdge => {
                let mut earlier = scene.forces[..number].iter().filter(|one| is_its(one));
                element.edge.is_some() && earlier.any(|one| one.edge == element.edge)
            }
            Self::Descending => element.pair().is_some_and(|[i, j]| i > j),
            Self::Zero(name) => element.parameter(name) == 0.0,
            Self::BeyondEdges => {
                let before = scene.forces[..number].iter().filter(|one| is_its(one));
                before.count() >= scene.edges.len()
            }
            Self::Joined => element.particles.iter().any(|each| scene.particles[*each].fixed),
            Self::Beside(other) => scene.forces.iter().any(|one| one.schema.tag == other),
        };
        let each = scene.forces.iter().enumerate();
        each.map(|(number, element)| is_its(element) && is_one((number, element))).collect()
    }
}

/// The particles that an element acts on.
fn particles_of(scene: &Scene, element: &ForceElement) -> Vec<usize> {
    match element.particles.is_empty() {
        true => (0..scene.particles.len()).collect(),
        false => element.particles.to_vec(),
    }
}

/// The blocks of an element's Jacobian: row and column.
fn blocks_of(scene: &Scene, element: &ForceElement) -> Vec<[usize; 2]> {
    let all = particles_of(scene, element);
    if element.particles.is_empty() {
        return all.into_iter().map(|particle| [particle; 2]).collect();
    }
    all.iter().flat_map(|&row| all.iter().map(move |&column| [row, column])).collect()
}

fn terms_of(scene: &Scene, changes: &[Change]) -> Vec<TermModel> {
    let lost = lost(scene, changes);
    // A part before the last of its force, where each part is assigned.
    let is_overwritten = |term: Term, place: usize| {
        let quantity = [Quantity::ByPosition, Quantity::ByVelocity][place];
        let of_force = Term::of(term.schema());
        let last = of_force.iter().rfind(|term| term.has(quantity));
        let is_its = |change: &Change| {
            change.effect == Effect::Scene(SceneRule::Assigned(term.tag, quantity, true))
        };
        last != Some(&term) && changes.iter().any(is_its)
    };
    // A scene that is read otherwise where some quantities are evaluated.
    let partly = changes.iter().find_map(|change| match change.effect {
        Effect::Partly(quantities, rule) if !change.place.is_elsewhere(scene) => {
            let mut read = scene.clone();
            read_wrongly(&mut read, rule);
            Some((quantities, Arc::new(read)))
        }
        _ => None,
    });
    let of_others = partly.iter().flat_map(|(_, read)| &read.forces);
    let mut terms: Vec<Term> = Vec::new();
    for element in scene.forces.iter().chain(of_others) {
        for term in Term::of(element.schema) {
            if !terms.contains(&term) {
                terms.push(term);
            }
        }
    }
    let model = |term: Term| {
        let elements = scene.forces.iter().zip(&lost).enumerate();
        let elements = elements.filter(|(_, (element, _))| element.schema.tag == term.tag);
        let elements = elements.map(|(place, (element, lost))| Element {
            place,
            particles: element.particles.clone(),
            parameters: element.parameters.clone(),
            lost: {
                let mut lost = lost.clone();
                for (place, blocks) in lost.blocks.iter_mut().enumerate() {
                    if is_overwritten(term, place) {
                        blocks.extend(whole(blocks_of(scene, element)));
                    }
                }
                lost
            },
        });
        let forms = forms_of(term);
        let law = |scene: &Scene| {
            if forms.is_some() {
                return None;
            }
            let of_it = scene.forces.iter().filter(|element| element.schema.tag == term.tag);
            let mut alone: Vec<ForceElement> = of_it.cloned().collect();
            if !term.part.is_empty() {
                let others = term.schema().parts.iter().filter(|part| part.name != term.part);
                for part in others {
                    alone.iter_mut().for_each(|element| element.remove_part(part));
                }
            }
            Some(Arc::new(Laws::of(scene, &alone)))
        };
        let evaluation = |formulas: Option<&Vec<Expression>>| Evaluation {
            formula: formulas.and_then(|all| all.first()).map(|first| Arc::new(first.clone())),
            factor: Factor::number(1.0),
            ends: None,
            blocks: None,
            axes: None,
            particles: None,
            start: None,
            masses: None,
        };
        let others = |(quantities, read): &(&'static [Quantity], Arc<Scene>)| {
            let elements = read.forces.iter().enumerate();
            let of_it = elements.filter(|(_, element)| element.schema.tag == term.tag);
            let elements = of_it.map(|(place, element)| Element {
                place,
                particles: element.particles.clone(),
                parameters: element.parameters.clone(),
                lost: Lost::default(),
            });
            let (elements, scene) = (elements.collect(), Arc::clone(read));
            Others { quantities, elements, scene, law: law(read) }
        };
        TermModel {
            term,
            elements: elements.collect(),
            others: partly.as_ref().map(others),
            evaluations: [
                evaluation(forms.map(|forms| &forms.force)),
                evaluation(forms.map(|forms| &forms.by_position)),
                evaluation(forms.map(|forms| &forms.by_velocity)),
            ],
            derived: false,
            softening: None,
            read: None,
            gate: None,
            weight: None,
            only: None,
            law: law(scene),
        }
    };
    terms.into_iter().map(model).collect()
}

impl Ends {
    /// Changes the forces on the particles of an element.
    fn change(self, particles: &[usize], forces: &mut [Vector3<f64>]) {
        let keep = |forces: &mut [Vector3<f64>], kept: &dyn Fn(usize) -> bool| {
            let left_out = forces.iter_mut().enumerate().filter(|(place, _)| !kept(*place));
            left_out.for_each(|(_, force)| *force = Vector3::zeros());
        };
        match self {
            Self::First => keep(forces, &|place| place == 0),
            Self::Second => keep(forces, &|place| place == 1),
            Self::Without(left_out) => keep(forces, &|place| place != left_out),
            Self::Exchanged([one, other]) => forces.swap(one, other),
            Self::Same => forces.fill(forces[0]),
            Self::Scaled(place, axis, factor) => forces[place][axis] *= factor,
            Self::ByNumber if particles[0] > particles[1] => {
                forces.iter_mut().for_each(|force| *force = -*force);
            }
            Self::Copied(place, from, to) => forces[place][to] = forces[place][from],
            Self::Gathered(place, to, from) => {
                forces[place][to] += forces[place][from];
                forces[place][from] = 0.0;
            }
            Self::Times(place, factor) => forces[place] *= factor,
            Self::ByNumber
            | Self::SecondAtIndex
            | Self::AtIndex
            | Self::SecondToNext
            | Self::Again(..) => {}
        }
    }
}

impl Blocks {
    /// Changes the `m²` blocks of an element, row by row.
    fn change(self, m: usize, blocks: &mut [Matrix3<f64>]) {
        let right = blocks.to_vec();
        for (place, block) in blocks.iter_mut().enumerate() {
            let (row, column) = (place / m, place % m);
            let transposed = || right[column * m + row].transpose();
            let is_left_out = match self {
                Self::Own => row != column,
                Self::Only(kept) => [row, column] != [kept; 2],
                Self::Cross => row == column,
                Self::Upper => row > column,
                Self::Lower => row < column,
                Self::Without([i, j]) | Self::WithoutRelative([i, j], _) => {
                    [row, column] == [i, j] || [row, column] == [j, i]
                }
                Self::Moved(from, _) => [row, column] == from,
                Self::WithoutRow(left_out) => row == left_out,
                Self::WithoutColumn(left_out) => column == left_out,
                _ => false,
            };
            match self {
                _ if is_left_out => *block = Matrix3::zeros(),
                Self::SameSign if row != column => *block = -*block,
                Self::Moved([a, b], to) if [row, column] == to => *block += right[a * m + b],
                Self::RowNegated(place) if row == place => *block = -*block,
                Self::ColumnNegated(place) if column == place => *block = -*block,
                Self::CrossTransposed if row != column => *block = block.transpose(),
                Self::OwnTransposed if row == column => *block = block.transpose(),
                Self::Transposed => *block = transposed(),
                Self::Symmetrized => *block = (*block + transposed()) * 0.5,
                Self::WithoutRelative([i, j], origin) if row == origin || column == origin => {
                    for [a, b] in [[i, j], [j, i]] {
                        let own = right[a * m + b];
                        if [row, column] == [origin; 2] {
                            *block -= own;
                        } else if row == a || column == b {
                            *block += own;
                        }
                    }
                }
                Self::Scaled(at_row, at_column, factor) if [row, column] == [at_row, at_column] => {
                    *block *= factor;
                }
                Self::Entry(at, [a, b], factor) if [row, column] == at => block[(a, b)] *= factor,
                _ => {}
            }
        }
    }
}

impl Axes {
    pub(super) fn of_vector(self, vector: Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Only(axis) => {
                Vector3::from_fn(|row, _| if row == axis { vector[row] } else { 0.0 })
            }
            Self::Not(axis) => {
                Vector3::from_fn(|row, _| if row == axis { 0.0 } else { vector[row] })
            }
            Self::Swapped => Vector3::new(vector.y, vector.x, vector.z),
            Self::Scaled(axis, factor) => {
                Vector3::from_fn(|row, _| vector[row] * if row == axis { factor } else { 1.0 })
            }
            Self::Copied(from, to) => {
                Vector3::from_fn(|row, _| vector[if row == to { from } else { row }])
            }
            Self::RowsSwapped
            | Self::Filled
            | Self::Diagonal
            | Self::CrossNegated
            | Self::Entry(..)
            | Self::EntryCopied(..)
            | Self::Transposed
            | Self::Gathered(..) => vector,
        }
    }

    pub(super) fn of_matrix(self, matrix: Matrix3<f64>) -> Matrix3<f64> {
        let keep = |test: &dyn Fn(usize, usize) -> bool| {
            Matrix3::from_fn(
                |row, column| if test(row, column) { matrix[(row, column)] } else { 0.0 },
            )
        };
        match self {
            Self::Only(axis) => keep(&|row, column| row == axis && column == axis),
            Self::Not(axis) => keep(&|row, column| row != axis && column != axis),
            Self::Swapped => {
                let order = [1, 0, 2];
                Matrix3::from_fn(|row, column| matrix[(order[row], order[column])])
            }
            Self::RowsSwapped => Matrix3::from_fn(|row, column| matrix[([1, 0, 2][row], column)]),
            Self::Filled => Matrix3::from_fn(|row, _| matrix[(row, row)]),
            Self::Diagonal => keep(&|row, column| row == column),
            Self::Scaled(axis, factor) => Matrix3::from_fn(|row, column| {
                matrix[(row, column)] * if row == axis { factor } else { 1.0 }
            }),
            Self::Copied(from, to) => {
                Matrix3::from_fn(|row, column| matrix[(if row == to { from } else { row }, column)])
            }
            Self::CrossNegated => Matrix3::from_fn(|row, column| {
                matrix[(row, column)] * if row == column { 1.0 } else { -1.0 }
            }),
            Self::Entry(place, factor) => Matrix3::from_fn(|row, column| {
                matrix[(row, column)] * if [row, column] == place { factor } else { 1.0 }
            }),
            Self::Transposed => matrix.transpose(),
            Self::Gathered(from, to) => {
                let mut changed = matrix;
                changed[(to, to)] += changed[(from, from)];
                changed[(from, from)] = 0.0;
                changed
            }
            Self::EntryCopied([row, column], to) => {
                let mut changed = matrix;
                changed[(to[0], to[1])] = matrix[(row, column)];
                changed
            }
        }
    }
}

impl Softening {
    fn of(self, l: f64) -> f64 {
        match self {
            Self::Added(e) => l + e,
            Self::Squared(e) => l.hypot(e),
            Self::AtLeast(e) => l.max(e),
            Self::Square => l * l,
            Self::Together => l,
            Self::Single => f64::from(l as f32),
        }
    }
}

/// Changes the scene as a wrong reader does.
fn read_wrongly(scene: &mut Scene, rule: SceneRule) {
    let of = |tag: &'static str| move |element: &ForceElement| element.schema.tag == tag;
    match rule {
        SceneRule::Masses(mass) => {
            scene.particles.iter_mut().for_each(|particle| particle.mass = mass);
        }
        SceneRule::FirstMass => {
            if let Some(mass) = scene.particles.first().map(|particle| particle.mass) {
                scene.particles.iter_mut().for_each(|particle| particle.mass = mass);
            }
        }
        SceneRule::LastMass => {
            if let Some(mass) = scene.particles.last().map(|particle| particle.mass) {
                scene.particles.iter_mut().for_each(|particle| particle.mass = mass);
            }
        }
        SceneRule::TimeStep(step) => scene.time_step = step,
        SceneRule::TimeStepAtMost(step) => scene.time_step = scene.time_step.min(step),
        SceneRule::EvenTimeStep => scene.time_step = scene.duration / scene.n_steps() as f64,
        // Another model makes the last step.
        SceneRule::ShortLastStep => {}
        SceneRule::SingleTimeStep => scene.time_step = f64::from(scene.time_step as f32),
        SceneRule::Velocities => {
            scene.particles.iter_mut().for_each(|particle| particle.velocity = [0.0; 3]);
        }
        SceneRule::OneForce { last } => {
            let kept = if last { scene.forces.len().saturating_sub(1) } else { 0 };
            let mut number = 0..;
            scene.forces.retain(|_| number.next() == Some(kept));
        }
        SceneRule::NotLastForce { even_alone } => {
            if even_alone || scene.forces.len() > 1 {
                scene.forces.pop();
            }
        }
        SceneRule::IntegerMasses => {
            let cut = |mass: f64| mass.trunc().max(1.0);
            scene.particles.iter_mut().for_each(|particle| particle.mass = cut(particle.mass));
        }
        SceneRule::Integer(tag, name) => {
            for element in scene.forces.iter_mut().filter(|element| of(tag)(element)) {
                let value = element.parameter_mut(name);
                *value = value.trunc();
            }
        }
        SceneRule::Integers(tag) => {
            for element in scene.forces.iter_mut().filter(|element| of(tag)(element)) {
                element.parameters.iter_mut().for_each(|value| *value = value.trunc());
            }
        }
        SceneRule::Default(tag, name, default) => {
            for element in scene.forces.iter_mut().filter(|element| of(tag)(element)) {
                let value = element.parameter_mut(name);
                *value = if *value == 0.0 { default } else { *value };
            }
        }
        SceneRule::NotFirstForce { by_kind } => {
            let of_kind = |element: &ForceElement| {
                let mut kinds = simulator::force::REGISTRY.iter();
                kinds.position(|kind| kind.schema.tag == element.schema.tag)
            };
            let mut all = 0..scene.forces.len();
            let first = if by_kind {
                all.min_by_key(|one| of_kind(&scene.forces[*one]))
            } else {
                all.next()
            };
            if let Some(first) = first {
                scene.forces.remove(first);
            }
        }
        SceneRule::LeftOut { tag, which } => {
            let mut left_out = which.of(scene, tag).into_iter();
            scene.forces.retain(|_| left_out.next() != Some(true));
        }
        SceneRule::InitialDistance(tag, name, where_zero) => {
            let Scene { particles, forces, .. } = scene;
            for element in forces.iter_mut().filter(|element| of(tag)(element)) {
                if where_zero.is_some_and(|is_zero| is_zero != (element.parameter(name) == 0.0)) {
                    continue;
                }
                let Some(pair) = element.pair() else { continue };
                let [i, j] = pair.map(|particle| particles[particle].position);
                let squares = i.iter().zip(&j).map(|(i, j)| (i - j) * (i - j));
                *element.parameter_mut(name) = squares.sum::<f64>().sqrt();
            }
        }
        SceneRule::Parameter(tag, name, value) => {
            for element in scene.forces.iter_mut().filter(|element| of(tag)(element)) {
                *element.parameter_mut(name) = value;
            }
        }
        SceneRule::Counted(tag, power) => {
            let count = scene.forces.iter().filter(|element| of(tag)(element)).count() as f64;
            for element in scene.forces.iter_mut().filter(|element| of(tag)(element)) {
                for name in element.schema.parts.iter().flat_map(|part| part.scaled_by) {
                    *element.parameter_mut(name) *= count.powi(power);
                }
            }
        }
        SceneRule::Root(tag, [name, other], number) => {
            for element in scene.forces.iter_mut().filter(|element| of(tag)(element)) {
                let root = element.parameter(other).sqrt();
                *element.parameter_mut(name) *= number * root;
            }
        }
        SceneRule::SmallUnsigned => {
            let all = scene.forces.iter_mut().flat_map(|element| &mut element.parameters);
            all.filter(|value| **value > -1.0).for_each(|value| *value = value.abs());
        }
        SceneRule::Signed(tag, name, sign) => {
            for element in scene.forces.iter_mut().filter(|element| of(tag)(element)) {
                let value = element.parameter_mut(name);
                *value = value.abs() * sign;
            }
        }
        SceneRule::ParameterAs(tag, name, other) => {
            for element in scene.forces.iter_mut().filter(|element| of(tag)(element)) {
                *element.parameter_mut(name) = element.parameter(other);
            }
        }
        SceneRule::Exchanged(tag, [one, other]) => {
            for element in scene.forces.iter_mut().filter(|element| of(tag)(element)) {
                let values = [element.parameter(one), element.parameter(other)];
                *element.parameter_mut(one) = values[1];
                *element.parameter_mut(other) = values[0];
            }
        }
        SceneRule::Misread(tag, misread) => {
            let Scene { particles, forces, .. } = scene;
            for element in forces.iter_mut().filter(|element| of(tag)(element)) {
                misread.read(element, particles);
            }
        }
        SceneRule::ParametersOfOne { tag, name, last } => {
            let mut all = scene.forces.iter().filter(|element| of(tag)(element));
            let one = if last { all.next_back() } else { all.next() };
            if let Some(one) = one.cloned() {
                for element in scene.forces.iter_mut().filter(|element| of(tag)(element)) {
                    match name {
                        Some(name) => *element.parameter_mut(name) = one.parameter(name),
                        None => element.parameters.clone_from(&one.parameters),
                    }
                }
            }
        }
        SceneRule::EdgeAsParticle(tag, end) => {
            let count = scene.particles.len();
            for element in scene.forces.iter_mut().filter(|element| of(tag)(element)) {
                match (element.edge, end) {
                    (Some(edge), Some(end)) if edge < count => element.particles[end] = edge,
                    (Some(edge), None) if count > 1 => {
                        element.particles = [edge % count, (edge + 1) % count].into();
                    }
                    _ => {}
                }
            }
        }
        SceneRule::ParticlesBefore(tag) => {
            let mut before: Option<scene::Particles> = None;
            for element in scene.forces.iter_mut().filter(|element| of(tag)(element)) {
                let own = element.particles.clone();
                element.particles = before.replace(own.clone()).unwrap_or(own);
            }
        }
        SceneRule::Pairs(tag, pick) => {
            let pairs = pick.pairs(scene, tag);
            let of_it = scene.forces.iter_mut().filter(|element| of(tag)(element));
            for (element, pair) in of_it.filter(|element| element.pair().is_some()).zip(pairs) {
                element.particles = pair.into();
            }
        }
        SceneRule::RunningEdge(tag, beyond) => {
            if beyond == Beyond::None {
                read_wrongly(scene, SceneRule::LeftOut { tag, which: Which::BeyondEdges });
            }
            let Scene { edges, forces, .. } = scene;
            let of_it = forces.iter_mut().filter(|element| of(tag)(element));
            for (number, element) in of_it.enumerate() {
                let number = match beyond {
                    Beyond::First => number % edges.len().max(1),
                    _ => number,
                };
                if let Some(edge) = edges.get(number) {
                    element.particles = edge.particles.into();
                }
            }
        }
        SceneRule::OfEdge(tag, name) => {
            let mut of_it = scene.forces.iter_mut().filter(|element| of(tag)(element));
            let values: Vec<f64> = of_it.by_ref().map(|one| one.parameter(name)).collect();
            for element in scene.forces.iter_mut().filter(|element| of(tag)(element)) {
                let Some(edge) = element.edge else { continue };
                *element.parameter_mut(name) = values.get(edge).copied().unwrap_or(0.0);
            }
        }
        SceneRule::SortedEdges => {
            scene.edges.sort_by_key(|edge| edge.particles);
            for element in &mut scene.forces {
                if let Some(edge) = element.edge {
                    element.particles = scene.edges[edge].particles.into();
                }
            }
        }
        SceneRule::Overwrites(..)
        | SceneRule::Assigned(..)
        | SceneRule::AssignedDiagonal(..)
        | SceneRule::AssignedCross(..)
        | SceneRule::AssignedByAll { .. }
        | SceneRule::MassList { .. }
        | SceneRule::Scattered(_)
        | SceneRule::AssignedOwn(..) => {}
        SceneRule::StillFixed(which) => {
            let before = scene.particles.clone();
            for (number, particle) in scene.particles.iter_mut().enumerate() {
                particle.fixed &= which.includes(number, &before);
            }
        }
        SceneRule::Heavy { mass, is_free } => {
            for particle in scene.particles.iter_mut().filter(|particle| particle.fixed) {
                (particle.fixed, particle.mass) = (!is_free, mass);
            }
        }
        SceneRule::Carried(tag, name) => {
            let mut before = 0.0;
            for element in scene.forces.iter_mut().filter(|element| of(tag)(element)) {
                let value = element.parameter_mut(name);
                *value = if *value == 0.0 { before } else { *value };
                before = *value;
            }
        }
        SceneRule::Fixed { exchanged } => {
            for particle in &mut scene.particles {
                particle.fixed = !(exchanged && particle.fixed);
            }
        }
        SceneRule::Indices(index, which) => {
            let (last, last_edge) = (scene.particles.len() - 1, scene.edges.len().max(1) - 1);
            let of = |particles: &mut [usize]| {
                particles.iter_mut().for_each(|one| *one = index.of(*one).min(last));
            };
            if which != Numbers::Edges {
                scene.edges.iter_mut().for_each(|edge| of(&mut edge.particles));
            }
            for element in &mut scene.forces {
                match (element.edge, which) {
                    (Some(edge), Numbers::ParticlesOfEdges) => {
                        element.particles = scene.edges[edge].particles.into();
                    }
                    (Some(edge), _) => {
                        let edge = index.of(edge).min(last_edge);
                        element.particles = scene.edges[edge].particles.into();
                    }
                    (None, Numbers::All) => of(&mut element.particles),
                    (None, _) => {}
                }
            }
        }
        SceneRule::UniqueEdges { is_clamped } => {
            let mut edges: Vec<scene::Edge> = Vec::new();
            for edge in &scene.edges {
                let [i, j] = edge.particles;
                let is_known =
                    |known: &scene::Edge| known.particles == [i, j] || known.particles == [j, i];
                if !edges.iter().any(is_known) {
                    edges.push(edge.clone());
                }
            }
            let is_there = |edge: usize| is_clamped || edge < edges.len();
            scene.forces.retain(|element| element.edge.is_none_or(is_there));
            for element in &mut scene.forces {
                if let Some(edge) = element.edge {
                    element.particles = edges[edge.min(edges.len() - 1)].particles.into();
                }
            }
            scene.edges = edges;
        }
        SceneRule::Unfixed => {
            scene.particles.iter_mut().for_each(|particle| particle.fixed = false);
        }
        SceneRule::AlsoAs(tag, other) => {
            let Some(schema) = simulator::vocabulary().force(other) else { return };
            let also = |element: &ForceElement| {
                let particles: &[usize] =
                    if schema.stencil.is_field() { &[] } else { &element.particles };
                let mut parameters = schema.zeros();
                let pairs = parameters.iter_mut().zip(&element.parameters);
                pairs.for_each(|(new, old)| *new = *old);
                ForceElement::new(schema, particles, element.edge, parameters)
            };
            let more: Vec<ForceElement> =
                scene.forces.iter().filter(|element| of(tag)(element)).map(also).collect();
            scene.forces.extend(more);
        }
        SceneRule::Unjoined => {
            let Scene { particles, forces, .. } = scene;
            forces.retain(|element| element.particles.iter().all(|each| !particles[*each].fixed));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn changed(change: Blocks, right: &[Matrix3<f64>]) -> Vec<Matrix3<f64>> {
        let mut blocks = right.to_vec();
        change.change(right.len().isqrt(), &mut blocks);
        blocks
    }

    #[test]
    fn blocks_of_a_pair_are_changed_as_listed() {
        let k = Matrix3::new(1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0);
        let (o, t) = (Matrix3::zeros(), k.transpose());
        let mean = (k + t) * 0.5;
        for (change, expected) in [
            (Blocks::Own, [k, o, o, k]),
            (Blocks::SameSign, [k, k, k, k]),
            (Blocks::Cross, [o, -k, -k, o]),
            (Blocks::WithoutRow(1), [k, -k, o, o]),
            (Blocks::WithoutColumn(0), [o, -k, o, k]),
            (Blocks::CrossTransposed, [k, -t, -t, k]),
            (Blocks::Transposed, [t, -t, -t, t]),
            (Blocks::Symmetrized, [mean, -mean, -mean, mean]),
            (Blocks::Scaled(0, 1, 3.0), [k, -k * 3.0, -k, k]),
        ] {
            assert_eq!(changed(change, &[k, -k, -k, k]), expected, "{change:?}");
        }
    }

    #[test]
    fn blocks_left_out_on_relative_coordinates_still_balance() {
        let mut random = fastrand::Rng::with_seed(7);
        let [a, b, c, d] = [(); 4].map(|()| Matrix3::from_fn(|_, _| random.f64() - 0.5));
        // Particles 0 and 2 relative to 1.
        let all = |b: Matrix3<f64>, c: Matrix3<f64>| {
            [a, -a - b, b, -a - c, a + b + c + d, -b - d, c, -c - d, d]
        };
        let found = changed(Blocks::WithoutRelative([0, 2], 1), &all(b, c));
        let expected = all(Matrix3::zeros(), Matrix3::zeros());
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).amax() < 1e-15, "{found}{expected}");
        }
        assert_ne!(found, changed(Blocks::Without([0, 2]), &all(b, c)));
    }
}
