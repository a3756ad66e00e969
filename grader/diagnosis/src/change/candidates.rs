//! The changes that a step of a scene may have: operations on each of its terms, on its integrator, on fixed particles
//! and on the reading of the scene. The most usual come first.

use std::collections::{BTreeSet, HashMap};
use std::fmt::Display;
use std::sync::{Arc, LazyLock};

use scene::schema::{
    Dependence, ForceSchema, Masses, Matrix, ParameterSchema, Stencil, StepEquation,
};
use scene::{Dimension, ForceElement, Scene};

use super::edit::{self, NumberedEdit, edits};
use super::element::{Misread, Weight};
use super::elimination::Slip;
use super::expression::{Expression, Function, Leaf};
use super::forms::Forms;
use super::gate::Gate;
use super::helper::{self, Helper};
use super::model::{HELD, MANY_ITERATIONS, NEWTON, forms_of};
use super::rounds::is_of_rounds;
use super::{
    Accumulated, Axes, Beyond, Blocks, Carried, Change, Cleared, Coordinates, Each, Effect, Ends,
    Entries, Factor, FixedRule, Guess, Hold, Index, Kept, Large, Linearized, MassAt, MassList,
    Newton, Norm, Numbers, Order, Particles, Pick, Place, Quantity, Rule, SceneRule, SeenAt,
    Softening, Stale, Start, StillFixed, Term, Unknowns, Which,
};
use reference::method::{Method, OnePoint};

/// A term's changes do not depend on the scene, but for its dimension.
static OF_TERMS: LazyLock<HashMap<Term, Vec<Change>>> =
    LazyLock::new(|| Term::all().map(|term| (term, all_of(term))).collect());

/// Every change of a term's force or Jacobians.
pub fn of_term(term: Term) -> &'static [Change] {
    OF_TERMS.get(&term).map_or(&[], Vec::as_slice)
}

/// The term left out, with its Jacobians.
pub fn omission(term: Term) -> Change {
    Change {
        place: Place::Force(term),
        words: format!("{term} has no effect"),
        effect: Effect::Factor(term, &Quantity::ALL, Factor::number(0.0)),
        rank: 0,
    }
}

/// The force left out with one of its Jacobians, as by a relative velocity `v_i − v_i`; of a term with both Jacobians.
pub fn partial_omissions(term: Term) -> Vec<Change> {
    let depends_on = term.depends_on();
    let change = |(quantities, rest): (&'static [Quantity], &str)| Change {
        place: Place::Force(term),
        words: format!("{term} is left out, but for its {rest}"),
        effect: Effect::Factor(term, quantities, Factor::number(0.0)),
        rank: 1,
    };
    let all: [(&'static [Quantity], &str); 2] = [
        (&[Quantity::Force, Quantity::ByPosition], "dF/dv"),
        (&[Quantity::Force, Quantity::ByVelocity], "dF/dx"),
    ];
    let is_split = depends_on.position && depends_on.velocity;
    all.into_iter().filter(|_| is_split).map(change).collect()
}

const FORCE: &[Quantity] = &[Quantity::Force];
const BY_POSITION: &[Quantity] = &[Quantity::ByPosition];
const BY_VELOCITY: &[Quantity] = &[Quantity::ByVelocity];
const JACOBIANS: &[Quantity] = &[Quantity::ByPosition, Quantity::ByVelocity];

/// The components that both dimensions have.
const XY: [&str; 2] = ["x", "y"];

/// Newton's constant, as books print it.
const NEWTONS: [f64; 4] = [6.67e-11, 6.674e-11, 6.6743e-11, 6.67384e-11];

/// Words of a force that is added at the number of its particle.
const AT_INDEX: &str = "is added to components i and i + 1 for particle i";

const WITHOUT_H: &str = "is not multiplied by h";
const LACKS_H: &str = "lacks a factor h";
const TOO_OFTEN_H: &str = "is multiplied by h once too often";

/// Ends the words of a change of a force that its Jacobians have as well.
const IN_JACOBIANS: &str = ", in its Jacobians as well";

/// Ends the words of a change that is in no Jacobian.
const IN_FORCES: &str = ", in forces alone";

/// Words of a change of a force and its Jacobians become those of the force alone.
pub fn say_force_alone(change: &mut Change) {
    if let Some(alone) = change.words.strip_suffix(IN_JACOBIANS) {
        change.words.truncate(alone.len());
    }
}

/// `springforce's damping`, `dF/dx of springforce's damping`.
fn name(term: impl Display, quantity: Quantity) -> String {
    match quantity {
        Quantity::Force => term.to_string(),
        Quantity::ByPosition => format!("dF/dx of {term}"),
        Quantity::ByVelocity => format!("dF/dv of {term}"),
    }
}

/// A number as a factor, in words.
pub fn factor_words(number: f64) -> String {
    if number == 0.0 {
        "is missing".to_owned()
    } else if number == -1.0 {
        "has the wrong sign".to_owned()
    } else {
        format!("is multiplied by {}", decimal(number))
    }
}

/// The parameter of a term's force that has one value instead, where all elements of a scene have the same and this factor
/// of the force makes its steps.
pub fn value_of_factor(scene: &Scene, factor: &Change) -> Option<Change> {
    let Effect::Factor(term, quantities, Factor { number, h: 0, mass: 0 }) = factor.effect else {
        return None;
    };
    let schema = term.schema();
    let scaled_by = match (term.part, schema.parts) {
        ("", [part]) => part.scaled_by,
        ("", _) => return None,
        (part, _) => schema.part(part).scaled_by,
    };
    let [name] = *scaled_by else { return None };
    let mut values = scene.forces.iter().filter(|element| element.schema.tag == term.tag);
    let written = values.next()?.parameter(name);
    let is_one = values.all(|element| element.parameter(name) == written);
    let value: f64 = format!("{:.6e}", number * written).parse().ok()?;
    let rule = SceneRule::Parameter(term.tag, name, value);
    let (effect, rest) = match quantities {
        [Quantity::Force] if term.depends_on().has_jacobian() => {
            (Effect::Partly(FORCE, rule), IN_FORCES)
        }
        [Quantity::Force, ..] => (Effect::Scene(rule), ""),
        _ => return None,
    };
    let words = format!("{} uses {name} = {}{rest}", term.tag, decimal(value));
    is_one.then_some(Change { place: factor.place, words, effect, rank: 3 })
}

/// A factor of some quantities of a term.
pub fn factor(term: Term, quantities: &'static [Quantity], number: f64) -> Change {
    let (place, what) = match quantities {
        [Quantity::Force] => (Place::Force(term), term.to_string()),
        [one] => (Place::Jacobian(term), name(term, *one)),
        [Quantity::ByPosition, Quantity::ByVelocity] => {
            (Place::Jacobian(term), format!("each Jacobian of {term}"))
        }
        _ if number == 0.0 => return omission(term),
        _ => (Place::Force(term), format!("{term} with its Jacobians")),
    };
    Change {
        place,
        words: format!("{what} {}", factor_words(number)),
        effect: Effect::Factor(term, quantities, Factor::number(number)),
        rank: match number {
            0.0 | -1.0 => u8::from(quantities.len() > 1),
            _ => 2,
        },
    }
}

/// A factor of all forces of an integrator, or of all Jacobians of one kind.
pub fn integrator_factor(name: &'static str, quantity: Quantity, number: f64) -> Change {
    let (what, rule) = match quantity {
        Quantity::Force => ("the sum of all forces", Rule::Forces(Factor::number(number))),
        Quantity::ByPosition => {
            ("dF/dx in the matrix", Rule::Matrix(quantity, Factor::number(number)))
        }
        Quantity::ByVelocity => {
            ("dF/dv in the matrix", Rule::Matrix(quantity, Factor::number(number)))
        }
    };
    Change {
        place: Place::Integrator(name),
        words: format!("{name}: {what} {}", factor_words(number)),
        effect: Effect::Method(name, rule),
        rank: 3,
    }
}

/// The same factor of one Jacobian of each of these terms: a change for each, all in the same words.
pub fn in_each(terms: &[Term], quantity: Quantity, by: Factor) -> Vec<Change> {
    let mut names: Vec<String> = terms.iter().map(Term::to_string).collect();
    let last = names.pop().unwrap_or_default();
    let names = if names.is_empty() { last } else { format!("{} and {last}", names.join(", ")) };
    let what = match by.h {
        0 => factor_words(by.number),
        1 => TOO_OFTEN_H.to_owned(),
        _ => LACKS_H.to_owned(),
    };
    let change = |term: &Term| Change {
        place: Place::Jacobian(*term),
        words: format!("{} {what}", name(&names, quantity)),
        effect: Effect::Factor(*term, quantity.alone(), by),
        rank: 1,
    };
    terms.iter().map(change).collect()
}

/// A number in words.
fn decimal(number: f64) -> String {
    let rounded: f64 = format!("{number:.5e}").parse().unwrap_or(number);
    let is_small = rounded != 0.0 && rounded.abs() < 1e-6;
    let written = if is_small { format!("{rounded:e}") } else { rounded.to_string() };
    match written.strip_prefix('-') {
        Some(size) => format!("−{size}"),
        None => written,
    }
}

/// Rules of an integrator with numbers in them that steps determine. The residual is affine in the numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Numbered {
    /// `x' = x + h (a v + b v')`.
    Position,
    /// `x' = x + a h v` or `x' = x + a h v'`: of the velocity that is right.
    Distance,
    /// `M (v' − a v) = h F`.
    Old,
    /// `M (v' − a v) = a h F`.
    Damped,
    /// `a` is added to the masses.
    Diagonal,
}

impl Numbered {
    /// Those of a method, with the numbers of a right program.
    pub fn of(method: OnePoint) -> Vec<(Self, Vec<f64>)> {
        let position = if method == OnePoint::Explicit { [1.0, 0.0] } else { [0.0, 1.0] };
        let mut all = vec![
            (Self::Damped, vec![1.0]),
            (Self::Old, vec![1.0]),
            (Self::Distance, vec![1.0]),
            (Self::Position, position.to_vec()),
        ];
        if method != OnePoint::Implicit {
            all.push((Self::Diagonal, vec![0.0]));
        }
        all
    }

    /// Whether it is about positions, not velocities.
    pub fn moves(self) -> bool {
        matches!(self, Self::Position | Self::Distance)
    }

    /// The change with these numbers, of an integrator of this name and method; `None` for another count of numbers.
    pub fn with(self, name: &'static str, method: OnePoint, numbers: &[f64]) -> Option<Change> {
        let (rule, words) = match (self, numbers) {
            (Self::Position, &[old, new]) => {
                let [a, b] = [old, new].map(decimal);
                let words = format!("positions move with the velocity {a} v + {b} v'");
                (Rule::Position { old, new, h: 1 }, words.replace("+ −", "− "))
            }
            (Self::Distance, &[factor]) => {
                let [old, new] = match method {
                    OnePoint::Explicit => [factor, 0.0],
                    _ => [0.0, factor],
                };
                let words = format!("positions move {} times as far", decimal(factor));
                (Rule::Position { old, new, h: 1 }, words)
            }
            (Self::Old, &[old]) => {
                let words = format!("the old velocity {}", factor_words(old));
                (Rule::Kick { old, forces: 1.0 }, words)
            }
            (Self::Damped, &[factor]) => {
                let words =
                    format!("old velocity and forces are multiplied by {}", decimal(factor));
                (Rule::Kick { old: factor, forces: factor }, words)
            }
            (Self::Diagonal, &[added]) => {
                let words = match method {
                    OnePoint::Linearized => "is added to the diagonal of the matrix",
                    _ => "is added to the mass that forces are divided by",
                };
                (Rule::Diagonal(added), format!("{} {words}", decimal(added)))
            }
            _ => return None,
        };
        let rank = 2 + numbers.len() as u8;
        Some(of_method(name, rule, &words, rank))
    }
}

/// A change of a term's force by a formula with a number in it.
pub struct NumberedForce {
    term: Term,
    edit: NumberedEdit,
    is_derived: bool,
}

/// The changes of a term's force by formulas with a number in them.
pub fn numbered_forces(term: Term) -> Vec<NumberedForce> {
    let Some(forms) = forms_of(term) else { return Vec::new() };
    let mut scalars = scalars(term);
    scalars.retain(|scalar| !matches!(scalar, Expression::Leaf(Leaf::Parameter(..))));
    let both: &[bool] =
        if term.schema().depends_on().has_jacobian() { &[false, true] } else { &[false] };
    let of = |is_derived: bool| {
        let edits = forms.force.iter().flat_map(|formula| edit::numbered(formula, &scalars));
        edits.map(move |edit| NumberedForce { term, edit, is_derived }).collect::<Vec<_>>()
    };
    both.iter().flat_map(|is_derived| of(*is_derived)).collect()
}

impl NumberedForce {
    /// Whether the number is an angle in degrees; otherwise it is positive.
    pub fn is_angle(&self) -> bool {
        self.edit.is_angle
    }

    /// The change with this number.
    pub fn with(&self, number: f64) -> Change {
        let formula = Arc::new((self.edit.with)(number));
        let words = format!("{} {}", self.term, (self.edit.words)(&decimal(number)));
        let place = Place::Force(self.term);
        match self.is_derived {
            true => Change {
                place,
                words: format!("{words}{IN_JACOBIANS}"),
                effect: Effect::Derived(self.term, formula),
                rank: 4,
            },
            false => Change {
                place,
                words,
                effect: Effect::Formula(self.term, Quantity::Force, formula),
                rank: 3,
            },
        }
    }
}

/// Some particles under a method treated otherwise.
pub fn gated_particles(name: &'static str, gate: Gate) -> Change {
    let what = match gate.factor {
        0.0 => "forces are left out".to_owned(),
        factor => format!("the forces have a factor of {}", decimal(factor)),
    };
    let rank = if gate.at == 0.0 || gate.measure.is_count() { 2 } else { 3 };
    of_method(name, Rule::Gate(gate), &format!("{what} {}", gate.words(true)), rank)
}

/// Some elements of a term treated otherwise.
pub fn gated(term: Term, quantities: &'static [Quantity], gate: Gate) -> Change {
    let whole = factor(term, quantities, 2.0);
    let subject = whole.words.strip_suffix(" is multiplied by 2").unwrap_or(&whole.words);
    let what =
        if gate.factor == 0.0 { "is left out".to_owned() } else { factor_words(gate.factor) };
    let where_it_is = gate.words(term.schema().stencil.is_field());
    let is_natural = gate.at == 0.0 || gate.measure.is_count();
    Change {
        place: whole.place,
        words: format!("{subject} {what} {where_it_is}"),
        effect: Effect::Gate(term, quantities, gate),
        rank: if is_natural { 2 } else { 3 },
    }
}

/// A block of an element's Jacobian multiplied by a number.
pub fn scaled_block(term: Term, quantity: Quantity, place: [usize; 2], by: f64) -> Change {
    let [row, column] = place;
    Change {
        place: Place::Jacobian(term),
        words: format!(
            "{} {}",
            name(term, quantity),
            scaled_in_words(term.schema().stencil, place, by)
        ),
        effect: Effect::Blocks(term, quantity.alone(), Blocks::Scaled(row, column, by)),
        rank: 3,
    }
}

fn scaled_in_words(stencil: Stencil, [row, column]: [usize; 2], by: f64) -> String {
    let particles = stencil.particles();
    let block = format!("its block {} {}", particles[row], particles[column]);
    match by {
        0.0 => format!("lacks {block}"),
        -1.0 => format!("has {block} with the wrong sign"),
        _ => format!("has {block} multiplied by {}", decimal(by)),
    }
}

/// The speed limit of an integrator.
pub fn speed_limit(name: &'static str, limit: f64) -> Change {
    let words = format!("no velocity is larger than {}", decimal(limit));
    of_method(name, Rule::SpeedLimit(limit), &words, 3)
}

/// Forces at another point between the ends of a step.
pub fn forces_at(name: &'static str, part: f64, is_implicit: bool) -> Change {
    let velocity = if is_implicit { "v'" } else { "v" };
    let part_words = if part == 1.0 { String::new() } else { decimal(part) + " " };
    let words = format!("forces are evaluated at x + {part_words}h {velocity}");
    let rank = if (2.0 * part).fract() == 0.0 { 2 } else { 3 };
    of_method(name, Rule::ForcesAt(part), &words.replace("+ −", "− "), rank)
}

fn of_method(name: &'static str, rule: Rule, words: &str, rank: u8) -> Change {
    Change {
        place: Place::Integrator(name),
        words: format!("{name}: {words}"),
        effect: Effect::Method(name, rule),
        rank,
    }
}

/// Groups of quantities that are scaled together.
pub fn groups(term: Term) -> Vec<&'static [Quantity]> {
    let depends_on = term.depends_on();
    match (depends_on.position, depends_on.velocity) {
        (false, false) => vec![FORCE],
        (true, false) => vec![FORCE, BY_POSITION, &Quantity::ALL],
        (false, true) => vec![FORCE, BY_VELOCITY, &Quantity::ALL],
        (true, true) => vec![FORCE, BY_POSITION, BY_VELOCITY, JACOBIANS, &Quantity::ALL],
    }
}

fn all_of(term: Term) -> Vec<Change> {
    let mut all = vec![omission(term)];
    all.extend(partial_omissions(term));
    for quantities in groups(term) {
        for number in [-1.0, 0.0, 2.0, 0.5] {
            if number != 0.0 || quantities.len() < 3 {
                all.push(factor(term, quantities, number));
            }
        }
        all.extend(named_factors(term, quantities));
    }
    let forms = forms_of(term);
    if let Some(forms) = forms {
        all.extend(of_other_laws(term, forms));
        all.extend(of_formulas(term, forms));
        all.extend(of_diagonals(term, forms));
    }
    if forms.is_some() || !term.schema().stencil.is_field() {
        all.extend(of_assembly(term, forms));
    }
    all.sort_by_key(|change| change.rank);
    all
}

/// Powers of the time step and of the mass.
fn named_factors(term: Term, quantities: &'static [Quantity]) -> Vec<Change> {
    let what = factor(term, quantities, 2.0);
    let subject = what.words.strip_suffix(" is multiplied by 2").unwrap_or(&what.words).to_owned();
    let named = [
        ("is multiplied by the mass", Factor::mass(1)),
        ("is divided by the mass", Factor::mass(-1)),
        ("is divided by the mass twice", Factor::mass(-2)),
        (if quantities == FORCE { WITHOUT_H } else { LACKS_H }, Factor::h(-1)),
        (TOO_OFTEN_H, Factor::h(1)),
    ];
    let change = |(words, factor): (&str, Factor)| Change {
        place: what.place,
        words: format!("{subject} {words}"),
        effect: Effect::Factor(term, quantities, factor),
        rank: 1,
    };
    named.into_iter().map(change).collect()
}

/// The quantities that may be a factor too many.
fn scalars(term: Term) -> Vec<Expression> {
    let schema = term.schema();
    let names = schema.parameters.iter().filter(|parameter| !parameter.three_dimensional);
    let is_vector = ["simplegravity", "constantforce"].contains(&term.tag);
    let mut all: Vec<Leaf> = names
        .filter(|_| !is_vector)
        .map(|parameter| Leaf::Parameter(schema.parameter_idx(parameter.name), parameter.name))
        .collect();
    if schema.stencil.is_field() {
        if schema.depends_on().velocity {
            all.push(Leaf::Speed);
        }
    } else {
        all.extend([Leaf::Length, Leaf::Mass(0), Leaf::Mass(1)]);
    }
    all.into_iter().map(Expression::Leaf).collect()
}

fn of_formulas(term: Term, forms: &Forms) -> Vec<Change> {
    let mut scalars = scalars(term);
    // The sizes of what the law itself consists of.
    let own = forms.force.iter().flat_map(edit::numbers_in);
    let size = |own: Expression| Expression::Applied(Function::Absolute, Box::new(own));
    scalars.extend(own.map(size));
    let mut all = Vec::new();
    let quantities = [&forms.force, &forms.by_position, &forms.by_velocity];
    for (quantity, formulas) in Quantity::ALL.into_iter().zip(quantities) {
        for (number, formula) in formulas.iter().enumerate() {
            // The first is the formula of the hand-out.
            let of_other = u8::from(number > 0);
            let of_leaves = edit::of_all_leaves(formula);
            for edit in edits(formula, &scalars).into_iter().chain(of_leaves) {
                let place = match quantity {
                    Quantity::Force => Place::Force(term),
                    _ => Place::Jacobian(term),
                };
                let words = format!("{} {}", name(term, quantity), edit.words);
                let formula = Arc::new(edit.expression);
                let rank = edit.rank + of_other;
                if quantity == Quantity::Force && term.schema().depends_on().has_jacobian() {
                    all.push(Change {
                        place,
                        words: format!("{words}{IN_JACOBIANS}"),
                        effect: Effect::Derived(term, Arc::clone(&formula)),
                        rank: rank + 1,
                    });
                }
                let effect = Effect::Formula(term, quantity, formula);
                all.push(Change { place, words, effect, rank });
            }
        }
    }
    all
}

/// Jacobians of a field that have another diagonal: masses where all is 0, and the velocity by which the force is multiplied.
fn of_diagonals(term: Term, forms: &Forms) -> Vec<Change> {
    if !term.schema().stencil.is_field() {
        return Vec::new();
    }
    let change = |quantity: Quantity, words: &str, factors: Vec<Expression>| Change {
        place: Place::Jacobian(term),
        words: format!("{} {words}", name(term, quantity)),
        effect: Effect::Formula(term, quantity, Arc::new(Expression::Product(factors))),
        rank: 2,
    };
    let mut all = Vec::new();
    if forms.by_position.is_empty() {
        for (sign, words) in
            [(-1.0, "has −m on its diagonal, not 0"), (1.0, "has m on its diagonal, not 0")]
        {
            let mass = [Leaf::Mass(0), Leaf::Identity].map(Expression::Leaf);
            let factors = [vec![Expression::Number(sign)], mass.to_vec()].concat();
            all.push(change(Quantity::ByPosition, words, factors));
        }
    }
    if let [Expression::Product(factors), ..] = &forms.by_velocity[..]
        && let [numbers @ .., Expression::Leaf(Leaf::Identity)] = &factors[..]
    {
        let along = |axis: usize| {
            let [v, e] =
                [Leaf::Velocity(0), Leaf::Axis(axis)].map(|leaf| Box::new(Expression::Leaf(leaf)));
            let square = Expression::Outer(e.clone(), e.clone());
            Expression::Product(vec![Expression::Dot(v, e), square])
        };
        let diagonal = Expression::Sum((0..3).map(along).collect());
        let factors = [numbers, &[diagonal]].concat();
        let words = "has the components of v on its diagonal, as the force has";
        all.push(change(Quantity::ByVelocity, words, factors));
    }
    all
}

/// The formulas of other forces with parameters of the same names.
fn of_other_laws(term: Term, forms: &Forms) -> Vec<Change> {
    let schema = term.schema();
    let mut all = Vec::new();
    for other in Term::all().filter(|other| other.tag != term.tag) {
        let names = |term: Term| match term.part {
            "" => term.schema().parameters.iter().map(|p| p.name).collect::<Vec<_>>(),
            part => {
                let part = term.schema().part(part);
                part.scaled_by.iter().chain(part.shaped_by).copied().collect()
            }
        };
        let is_like = other.schema().stencil == schema.stencil
            && !names(other).is_empty()
            && names(other).iter().all(|name| schema.has_parameter(name));
        let theirs = is_like.then(|| super::forms::of_parameters(other, schema)).flatten();
        let Some(theirs) = theirs else { continue };
        let pairs = [
            (Quantity::Force, &theirs.force, &forms.force),
            (Quantity::ByPosition, &theirs.by_position, &forms.by_position),
            (Quantity::ByVelocity, &theirs.by_velocity, &forms.by_velocity),
        ];
        for (quantity, theirs, ours) in pairs {
            if let (Some(formula), false) = (theirs.first(), ours.is_empty()) {
                let place = match quantity {
                    Quantity::Force => Place::Force(term),
                    _ => Place::Jacobian(term),
                };
                all.push(Change {
                    place,
                    words: format!("{} is that of {other}", name(term, quantity)),
                    effect: Effect::Formula(term, quantity, Arc::new(formula.clone())),
                    rank: 2,
                });
            }
        }
    }
    all
}

/// Forces and blocks on the wrong particles and coordinates. The length is changed only in formulas.
fn of_assembly(term: Term, forms: Option<&Forms>) -> Vec<Change> {
    let mut all = Vec::new();
    let stencil = term.schema().stencil;
    let is_pair = stencil.size() == 2;
    let names = stencil.particles();
    let mut add = |quantity: Quantity, words: &str, effect: Effect, rank: u8| {
        let place = match quantity {
            Quantity::Force => Place::Force(term),
            _ => Place::Jacobian(term),
        };
        let words = format!("{} {words}", name(term, quantity));
        all.push(Change { place, words, effect, rank });
    };
    let force = Quantity::Force;
    if is_pair {
        for (ends, words) in [
            (Ends::First, "acts on the first of two particles only"),
            (Ends::Second, "acts on the second of two particles only"),
            (Ends::Same, "has the same sign on both particles"),
            (Ends::ByNumber, "has the wrong sign where the first particle's number is the larger"),
            (Ends::SecondAtIndex, "is added to components j and j + 1 for particle j"),
            (Ends::AtIndex, AT_INDEX),
            (
                Ends::SecondToNext,
                "has its reaction on particle i + 1 of the scene, after the last on the first, in the place of j",
            ),
        ] {
            add(force, words, Effect::Ends(term, ends), 1);
        }
        for (place, axis) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let (which, axis_name) = (["first", "second"][place], XY[axis]);
            let on = format!("its {axis_name} component on the {which} of two particles");
            for (by, words) in [(0.0, "lacks"), (-1.0, "has the wrong sign in")] {
                let effect = Effect::Ends(term, Ends::Scaled(place, axis, by));
                add(force, &format!("{words} {on}"), effect, 1);
            }
            let which = ["first", "second"][place];
            let other = XY[1 - axis];
            let words = format!("has its {other} component in the place of {on}");
            add(force, &words, Effect::Ends(term, Ends::Copied(place, 1 - axis, axis)), 2);
            let words = format!(
                "has both components on the {which} of two particles added along {axis_name}"
            );
            add(force, &words, Effect::Ends(term, Ends::Gathered(place, axis, 1 - axis)), 2);
        }
        if forms.is_some() {
            for (softening, words) in [
                (Softening::Square, "has l² in the place of l, also in n"),
                (Softening::Single, "has a length rounded to single precision"),
                (Softening::Together, "has one length for all elements, √Σ l², in the place of l"),
            ] {
                add(force, words, Effect::Length(term, FORCE, softening), 2);
                let both = format!("{words}{IN_JACOBIANS}");
                add(force, &both, Effect::Length(term, &Quantity::ALL, softening), 2);
                for quantity in JACOBIANS.iter().filter(|one| term.has(**one)) {
                    add(*quantity, words, Effect::Length(term, quantity.alone(), softening), 2);
                }
            }
            for (read, what, of_which) in helper::reads(term.depends_on().velocity) {
                let words = format!("reads {what} for {of_which}");
                add(force, &words, Effect::Read(term, read), 2);
            }
            if term.depends_on().velocity {
                let words = "takes fixed particles to be at rest";
                add(force, words, Effect::Start(term, FORCE, Start::FixedAtRest), 2);
                let words = format!("{words}{IN_JACOBIANS}");
                add(force, &words, Effect::Start(term, &Quantity::ALL, Start::FixedAtRest), 2);
            }
        }
        for (digit, exponent) in
            [2, 5].into_iter().flat_map(|digit| (1..4).map(move |e| (digit, e)))
        {
            let e = f64::from(digit) / 10.0_f64.powi(exponent);
            if forms.is_some() {
                let words = format!("has a length of at least {digit}e-{exponent}");
                add(force, &words, Effect::Length(term, FORCE, Softening::AtLeast(e)), 3);
                let both = format!("{words}{IN_JACOBIANS}");
                add(force, &both, Effect::Length(term, &Quantity::ALL, Softening::AtLeast(e)), 3);
            }
        }
        for exponent in 1..=if forms.is_some() { 12 } else { 0 } {
            let e = 10.0_f64.powi(-exponent);
            for (softening, words) in [
                (Softening::Added(e), format!("has 1e-{exponent} added to the length")),
                (Softening::Squared(e), format!("has a length softened by 1e-{exponent}")),
                (Softening::AtLeast(e), format!("has a length of at least 1e-{exponent}")),
            ] {
                add(force, &words, Effect::Length(term, FORCE, softening), 3);
                let both = format!("{words}{IN_JACOBIANS}");
                add(force, &both, Effect::Length(term, &Quantity::ALL, softening), 3);
            }
        }
    } else if !stencil.is_field() {
        for (place, name) in names.iter().enumerate() {
            add(
                force,
                &format!("is missing on particle {name}"),
                Effect::Ends(term, Ends::Without(place)),
                1,
            );
        }
        for [i, j] in (0..names.len()).flat_map(|j| (0..j).map(move |i| [i, j])) {
            let words = format!("has those on {} and {} exchanged", names[i], names[j]);
            add(force, &words, Effect::Ends(term, Ends::Exchanged([i, j])), 1);
        }
        for (weight, words) in Weight::all(term.schema()) {
            add(force, words, Effect::Weight(term, FORCE, weight), 2);
            let both = format!("{words}{IN_JACOBIANS}");
            add(force, &both, Effect::Weight(term, &Quantity::ALL, weight), 2);
            add(Quantity::ByPosition, words, Effect::Weight(term, BY_POSITION, weight), 2);
        }
    } else {
        add(force, AT_INDEX, Effect::Ends(term, Ends::AtIndex), 1);
        for (particles, words) in [
            (Particles::First, "acts on the first particle only"),
            (Particles::NotFirst, "does not act on the first particle"),
            (Particles::NotLast, "does not act on the last particle"),
            (Particles::FirstHalf, "acts on the first half of the particles only"),
            (Particles::AsElements, "acts on as many particles as it has elements, the first ones"),
            (
                Particles::FirstCoordinates,
                "acts on as many coordinates as there are particles, the first ones",
            ),
        ] {
            add(force, words, Effect::Particles(term, force, particles), 1);
        }
        for (axis, name) in XY.iter().enumerate() {
            let words = format!("does not act on the last particle along {name}");
            let particles = Particles::NotLastAlong(axis);
            add(force, &words, Effect::Particles(term, force, particles), 2);
        }
    }
    let axes = [
        (Axes::Only(0), "has its x component only"),
        (Axes::Only(1), "has its y component only"),
        (Axes::Not(0), "lacks its x component"),
        (Axes::Not(1), "lacks its y component"),
        (Axes::Swapped, "has x and y swapped"),
        (Axes::Scaled(0, -1.0), "has its x component with the wrong sign"),
        (Axes::Scaled(1, -1.0), "has its y component with the wrong sign"),
        (Axes::Copied(0, 1), "has its x component in the place of its y component"),
        (Axes::Copied(1, 0), "has its y component in the place of its x component"),
    ];
    for (axes, words) in axes {
        add(force, words, Effect::Axes(term, force, axes), 2);
    }
    let depends_on = term.depends_on();
    if forms.is_some() && term.schema().masses != Masses::None {
        if term.schema().stencil.is_field() {
            let words = "has the mass of the next particle for each, and none for the last";
            add(force, words, Effect::Masses(term, FORCE, MassAt::Next), 2);
        }
        for (masses, words) in [
            (
                MassAt::Particle,
                "reads a mass at the number of its particle, as from a list with one for each coordinate",
            ),
            (MassAt::First, "has the first mass for every particle"),
            (
                MassAt::Coordinate,
                "reads the masses of x and y at the numbers i and i + 1, as from a list with one for each coordinate",
            ),
        ] {
            add(force, words, Effect::Masses(term, FORCE, masses), 2);
            if masses == MassAt::Coordinate {
                continue;
            }
            if term.depends_on().has_jacobian() {
                let words = format!("{words}{IN_JACOBIANS}");
                add(force, &words, Effect::Masses(term, &Quantity::ALL, masses), 2);
                let jacobians = Effect::Masses(term, JACOBIANS, masses);
                add(Quantity::ByPosition, words.trim_end_matches(IN_JACOBIANS), jacobians, 2);
            }
        }
    }
    if depends_on.has_jacobian() {
        let starts = [
            (depends_on.position, Start::Positions, "positions"),
            (depends_on.velocity, Start::Velocities, "velocities"),
            (depends_on.position && depends_on.velocity, Start::Both, "positions and velocities"),
        ];
        let of_before = [
            (depends_on.position, Start::EarlierPositions, "positions"),
            (depends_on.velocity, Start::EarlierVelocities, "velocities"),
        ];
        for (_, start, what) in of_before.into_iter().filter(|(is_read, ..)| *is_read) {
            let words = format!("reads the {what} of the step before");
            add(force, &words, Effect::Start(term, FORCE, start), 2);
            let words = format!("{words}{IN_JACOBIANS}");
            add(force, &words, Effect::Start(term, &Quantity::ALL, start), 2);
        }
        if depends_on.velocity && depends_on.position {
            let rest = Effect::Start(term, BY_POSITION, Start::Rest);
            add(Quantity::ByPosition, "is evaluated with velocities of 0", rest, 2);
        }
        for (_, start, what) in starts.into_iter().filter(|(is_read, ..)| *is_read) {
            let words = format!("reads the {what} at the start of the step under implicit methods");
            add(force, &words, Effect::Start(term, FORCE, start), 2);
            let words = format!("{words}{IN_JACOBIANS}");
            add(force, &words, Effect::Start(term, &Quantity::ALL, start), 2);
            for (axis, letter) in XY.iter().enumerate().filter(|_| start == Start::Positions) {
                let at = Start::Along(axis);
                let words = format!(
                    "reads {letter} of the positions at the start of the step under implicit methods"
                );
                add(force, &words, Effect::Start(term, FORCE, at), 2);
                let words = format!("{words}{IN_JACOBIANS}");
                add(force, &words, Effect::Start(term, &Quantity::ALL, at), 2);
                let words = format!("is evaluated at {letter} of x, not of x + h v");
                add(Quantity::ByPosition, &words, Effect::Start(term, BY_POSITION, at), 2);
            }
            // Its velocities are those of the start under the only method that shows them.
            if start == Start::Positions {
                let words = "is evaluated at x, not x + h v";
                for (quantity, quantities, is_there) in [
                    (Quantity::ByPosition, BY_POSITION, true),
                    (Quantity::ByVelocity, BY_VELOCITY, depends_on.velocity),
                ] {
                    if is_there {
                        add(quantity, words, Effect::Start(term, quantities, start), 2);
                    }
                }
            }
        }
    }
    for (quantity, is_there) in
        [(Quantity::ByPosition, depends_on.position), (Quantity::ByVelocity, depends_on.velocity)]
    {
        if !is_there {
            continue;
        }
        for (blocks, words) in of_stencil(stencil) {
            add(quantity, &words, Effect::Blocks(term, quantity.alone(), blocks), 1);
        }
        let of_pair = if is_pair { 0..16 } else { 0..0 };
        for place in of_pair {
            let (at, [a, b]) = ([place / 8, place / 4 % 2], [place / 2 % 2, place % 2]);
            let [row, column] = at.map(|place| names[place]);
            let entry = format!("the {}{} entry of its block {row} {column}", XY[a], XY[b]);
            for (by, words) in [(0.0, "lacks"), (-1.0, "has the wrong sign in")] {
                let effect = Effect::Blocks(term, quantity.alone(), Blocks::Entry(at, [a, b], by));
                add(quantity, &format!("{words} {entry}"), effect, 2);
            }
        }
        if stencil.is_field() {
            for (particles, words) in [
                (Particles::First, "is there for the first particle only"),
                (Particles::FirstHalf, "is there for the first half of the particles only"),
                (
                    Particles::AsElements,
                    "is there for as many particles as it has elements, the first ones",
                ),
                (
                    Particles::FirstCoordinates,
                    "is there for as many coordinates as there are particles, the first ones",
                ),
            ] {
                add(quantity, words, Effect::Particles(term, quantity, particles), 1);
            }
        }
        for (axes, rank, words) in of_blocks() {
            add(quantity, &words, Effect::Axes(term, quantity, axes), rank);
        }
    }
    all
}

/// The blocks of an element's Jacobian, changed, in words that follow its name.
fn of_stencil(stencil: Stencil) -> Vec<(Blocks, String)> {
    let (is_pair, names) = (stencil.size() == 2, stencil.particles());
    let mut blocks: Vec<(Blocks, String)> = Vec::new();
    if stencil.is_field() {
        let words = "is stored for particle 0, whatever the particle";
        blocks.push((Blocks::LocalIndices, words.to_owned()));
        let words =
            "is added from row i and column i on for particle i, as if each had one coordinate";
        blocks.push((Blocks::AtIndex { own: false }, words.to_owned()));
        for (at, name) in [(Blocks::RowAtIndex, "row"), (Blocks::ColumnAtIndex, "column")] {
            let words =
                format!("is added from {name} i on for particle i, as if each had one coordinate");
            blocks.push((at, words));
        }
    } else {
        let between = if is_pair { "the two particles" } else { "different particles" };
        let all = if is_pair { "two particles" } else { "the particles" };
        blocks.extend([
            (Blocks::Transposed, "is transposed".to_owned()),
            (Blocks::Own, format!("lacks its blocks between {between}")),
            (Blocks::SameSign, format!("has the wrong sign in its blocks between {between}")),
        ]);
        let ordinals = ["first", "second", "third", "fourth"];
        let places = ordinals.iter().enumerate().take(stencil.size());
        let backwards = || places.clone().rev();
        blocks.extend(names.iter().enumerate().map(|(place, name)| {
            (Blocks::Only(place), format!("has only its block {name} {name}"))
        }));
        blocks.extend(backwards().map(|(place, name)| {
            (Blocks::WithoutRow(place), format!("lacks the rows of the {name} of {all}"))
        }));
        blocks.extend(backwards().map(|(place, name)| {
            (Blocks::WithoutColumn(place), format!("lacks the columns of the {name} of {all}"))
        }));
        let local = match is_pair {
            true => "is stored for particles 0 and 1, whatever the pair",
            false => "is stored for the first particles of the scene, whatever the element",
        };
        blocks.extend([
            (Blocks::Cross, "lacks its blocks of each particle by itself".to_owned()),
            (Blocks::CrossTransposed, format!("has its blocks between {between} transposed")),
            (Blocks::Symmetrized, "is made symmetric".to_owned()),
            (Blocks::LocalIndices, local.to_owned()),
        ]);
        let own = "its blocks of each particle by itself";
        let from =
            "from row i and column j on for particles i and j, as if each had one coordinate";
        blocks.extend([
            (Blocks::OwnTransposed, format!("has {own} transposed")),
            (Blocks::AtIndex { own: false }, format!("is added {from}")),
            (Blocks::AtIndex { own: true }, format!("has {own} added {from}")),
        ]);
        for (at, name) in [(Blocks::RowAtIndex, "row i"), (Blocks::ColumnAtIndex, "column j")] {
            let words = format!(
                "is added from {name} on for particles i and j, as if each had one coordinate"
            );
            blocks.push((at, words));
        }
        let of_pair = (0..4).map(|place| [place / 2, place % 2]).filter(|_| is_pair);
        let of_pair: Vec<[usize; 2]> = of_pair.collect();
        for (from, to) in of_pair.iter().flat_map(|from| of_pair.iter().map(move |to| (from, to))) {
            let [from_name, to_name] = [from, to].map(|at| at.map(|place| names[place]).join(" "));
            if from != to {
                let words = format!("has its block {from_name} added to the block {to_name}");
                blocks.push((Blocks::Moved(*from, *to), words));
            }
        }
        for (place, name) in names.iter().enumerate().filter(|_| is_pair) {
            let words = format!("has the wrong sign in the row of {name}");
            blocks.push((Blocks::RowNegated(place), words));
            let words = format!("has the wrong sign in the column of {name}");
            blocks.push((Blocks::ColumnNegated(place), words));
        }
        let pairs = (0..names.len()).flat_map(|j| (0..j).map(move |i| [i, j]));
        if !is_pair {
            blocks.extend([
                (Blocks::Upper, "lacks its blocks below the diagonal".to_owned()),
                (Blocks::Lower, "lacks its blocks above the diagonal".to_owned()),
            ]);
        }
        for pair in pairs.filter(|_| !is_pair) {
            let [i, j] = pair.map(|place| names[place]);
            let words = format!("lacks its blocks between particles {i} and {j}");
            let origins = (0..names.len()).filter(|origin| !pair.contains(origin));
            blocks.extend(origins.map(|origin| {
                let words = format!("{words}, on coordinates relative to {}", names[origin]);
                (Blocks::WithoutRelative(pair, origin), words)
            }));
            blocks.push((Blocks::Without(pair), words));
        }
    }
    let size = if stencil.is_field() { 0 } else { stencil.size() };
    for (row, column) in (0..size * size).map(|place| (place / size, place % size)) {
        let of = |by: f64| {
            (Blocks::Scaled(row, column, by), scaled_in_words(stencil, [row, column], by))
        };
        blocks.extend([-1.0, 0.0].map(of));
    }
    blocks
}

/// Other entries of the blocks of a Jacobian, in words that follow its name.
fn of_blocks() -> Vec<(Axes, u8, String)> {
    let whole = [
        (Axes::Only(0), "has its x entry only"),
        (Axes::Only(1), "has its y entry only"),
        (Axes::Filled, "fills each row of its blocks with the diagonal entry"),
        (Axes::Diagonal, "lacks the entries off the diagonal of its blocks"),
        (Axes::Swapped, "has x and y swapped"),
        (Axes::RowsSwapped, "has the rows of its blocks swapped"),
        (Axes::CrossNegated, "has the entries off the diagonal of its blocks with the wrong sign"),
        (Axes::Transposed, "has each of its blocks transposed"),
        (Axes::Gathered(1, 0), "has the yy entry of its blocks added to the xx entry"),
        (Axes::Gathered(0, 1), "has the xx entry of its blocks added to the yy entry"),
    ];
    let mut all: Vec<_> = whole.map(|(axes, words)| (axes, 2, words.to_owned())).into();
    let of_entries = edit::of_entries("its blocks").into_iter().map(|(axes, words)| {
        let rank = if matches!(axes, Axes::EntryCopied(..)) { 3 } else { 2 };
        (axes, rank, words)
    });
    all.extend(of_entries);
    all
}

/// Another method in the place of this one; the most usual first.
pub fn replacements(scene: &Scene) -> Vec<Change> {
    let name = scene.integrator.name;
    let right = Method::one_point(scene.integrator);
    let others = [
        (OnePoint::Explicit, StepEquation::ExplicitEuler),
        (OnePoint::Symplectic, StepEquation::SymplecticEuler),
        (OnePoint::Linearized, StepEquation::LinearizedImplicitEuler),
        (OnePoint::Implicit, StepEquation::ImplicitEuler),
    ];
    let change = |(method, equation): (OnePoint, StepEquation)| {
        let vocabulary = simulator::vocabulary();
        let other = vocabulary.integrators.iter().find(|other| other.equation == equation)?;
        let order = match (right, method) {
            (Some(OnePoint::Explicit), OnePoint::Symplectic) => {
                ": velocities are updated before positions"
            }
            (Some(OnePoint::Symplectic), OnePoint::Explicit) => {
                ": positions move before velocities are updated"
            }
            _ => "",
        };
        (Some(method) != right).then(|| Change {
            place: Place::Integrator(name),
            words: format!("the steps of {name} are those of {}{order}", other.name),
            effect: Effect::Method(name, Rule::Replaced(method)),
            rank: 0,
        })
    };
    let idle = Change {
        place: Place::Integrator(name),
        words: format!("nothing moves under {name}"),
        effect: Effect::Method(name, Rule::Idle),
        rank: 0,
    };
    others.into_iter().filter_map(change).chain([idle]).collect()
}

/// Changes of an integrator that the residual shows.
pub fn of_integrator(scene: &Scene) -> Vec<Change> {
    let name = scene.integrator.name;
    let Some(method) = Method::one_point(scene.integrator) else { return Vec::new() };
    let mut all = Vec::new();
    let mut add = |rule: Rule, rank: u8, words: &str| all.push(of_method(name, rule, words, rank));
    for (factor, words) in [
        (Factor::number(-1.0), "the sum of all forces has the wrong sign"),
        (Factor::number(0.0), "the sum of all forces is missing"),
        (Factor::h(-1), "the forces are not multiplied by h"),
        (Factor::h(1), "the forces are multiplied by h once too often"),
        (Factor::number(2.0), "the sum of all forces is multiplied by 2"),
        (Factor::number(0.5), "the sum of all forces is multiplied by 0.5"),
    ] {
        add(Rule::Forces(factor), 1, words);
    }
    for (axis, name) in XY.iter().enumerate() {
        for (factor, words) in [
            (Factor::mass(1), "are not divided by the mass"),
            (Factor::mass(-1), "are divided by the mass twice"),
            (Factor::number(-1.0), "have the wrong sign"),
            (Factor::number(0.0), "are left out"),
            (Factor::h(-1), "are not multiplied by h"),
        ] {
            add(Rule::AlongAxis(axis, factor), 2, &format!("forces along {name} {words}"));
        }
    }
    let inertia = |matrix, right, sign| Rule::Inertia { matrix, right, sign };
    let words = "the mass of a coordinate is read at the number of its particle, as from a list with one for each coordinate";
    add(Rule::MassAt(MassAt::Particle), 2, words);
    add(Rule::MassAt(MassAt::First), 2, "every coordinate has the first mass");
    let words = "masses are read as if all x came before all y, forces and velocities are not";
    add(Rule::MassAt(MassAt::ByAxis), 2, words);
    for (axis, name) in XY.iter().enumerate() {
        let words = format!("every coordinate along {name} has the first mass");
        add(Rule::MassAt(MassAt::FirstAlong(axis)), 2, &words);
    }
    if matches!(method, OnePoint::Explicit | OnePoint::Symplectic) {
        for (last, which) in [(false, "first"), (true, "last")] {
            let words = format!("the force on the {which} particle is not divided by its mass");
            add(Rule::MassAt(MassAt::OneOf { last }), 2, &words);
        }
    }
    add(Rule::Lost, 1, "positions move with the new velocity, which is lost after the step");
    for (from, to) in [(0, 1), (1, 0)] {
        let [one, other] = [from, to].map(|axis| XY[axis]);
        let words = format!("forces along {other} are those along {one}");
        add(Rule::ForcesAlong(from, to), 2, &words);
        let words = format!("forces are evaluated with v{one} in the place of v{other}");
        add(Rule::SeenAt(SeenAt::Velocity(from, to)), 2, &words);
        let (of, words) = match method {
            OnePoint::Explicit => ([0.0, 1.0], "new velocity, not the old one"),
            _ => ([1.0, 0.0], "old velocity, not the new one"),
        };
        let words = format!("positions along {other} move with the {words}");
        add(Rule::PositionAlong(to, of), 2, &words);
        if matches!(method, OnePoint::Linearized | OnePoint::Implicit) {
            let words = format!(
                "x + h v has {one} of the velocities in the place of {other} where forces are evaluated"
            );
            add(Rule::SeenAt(SeenAt::Predicted(from, to)), 2, &words);
        }
    }
    if method != OnePoint::Explicit && method != OnePoint::Symplectic {
        let words = "the Jacobians are divided by the masses of their columns, not of their rows";
        add(Rule::ColumnMasses, 2, words);
        for step in [0.1, 0.01, 0.001].into_iter().filter(|step| *step != scene.time_step) {
            let words = format!("in the matrix, the time step is always {step}");
            add(Rule::MatrixStep(step), 2, &words);
        }
        let u = if method == OnePoint::Linearized { "v" } else { "u" };
        for (jacobians, what) in [(true, "forces and Jacobians"), (false, "forces")] {
            let words = format!("{what} are evaluated with the velocities v + h {u}, not {u}");
            add(Rule::SeenAt(SeenAt::Displaced { jacobians }), 2, &words);
        }
        for (which, what) in [
            ([false, true, false], "dF/dx is"),
            ([false, true, true], "Jacobians are"),
            ([true, false, false], "forces are"),
            ([true, true, true], "forces and Jacobians are"),
        ] {
            let words = format!("{what} evaluated at the positions h {u}, not x + h {u}");
            add(Rule::SeenAt(SeenAt::Moved(which)), 2, &words);
        }
    }
    match method {
        OnePoint::Explicit | OnePoint::Symplectic => {
            add(inertia(0, 0, 1.0), 1, "forces are not divided by the mass");
            add(inertia(-1, -1, 1.0), 1, "forces are multiplied by the mass");
            add(inertia(2, 2, 1.0), 2, "forces are divided by the mass twice");
            add(Rule::ForcesAt(1.0), 1, "forces are evaluated at x + h v");
            add(Rule::ForcesAt(0.5), 2, "forces are evaluated at x + h v/2");
            add(Rule::ForcesAt(-1.0), 2, "forces are evaluated at x − h v");
            if method == OnePoint::Symplectic {
                let words =
                    "positions move first, with the old velocity; forces are evaluated there";
                add(Rule::PositionsFirst, 1, words);
            }
        }
        OnePoint::Linearized => {
            add(inertia(0, 0, 1.0), 1, "the matrix has the identity in the place of M");
            add(inertia(2, 1, 1.0), 2, "the matrix has M² in the place of M");
            add(inertia(-1, 1, 1.0), 2, "the matrix has M⁻¹ in the place of M");
            let words = "the forces are divided by the mass, and the matrix has M";
            add(Rule::Forces(Factor::mass(-1)), 2, words);
            let words = "the matrix is divided by the masses, and the right-hand side is not";
            add(Rule::Forces(Factor::mass(1)), 2, words);
            for (entries, words) in [
                (Entries::Lower, "the matrix is solved as a symmetric one, by its lower triangle"),
                (Entries::Upper, "the matrix is solved as a symmetric one, by its upper triangle"),
                (Entries::Transposed, "the matrix is transposed"),
                (Entries::Diagonal, "the matrix has its diagonal alone"),
                (Entries::OwnBlocks, "the matrix has the blocks on its diagonal alone"),
                (Entries::LowerBlocks, "the matrix lacks the blocks above its diagonal"),
                (Entries::UpperBlocks, "the matrix lacks the blocks below its diagonal"),
                (
                    Entries::NotDiagonal,
                    "masses replace the Jacobians on the diagonal of the matrix",
                ),
            ] {
                add(Rule::Entries(entries), 2, words);
            }
            for (of_particles, whose) in [(false, ""), (true, ", coordinate i that of particle i")]
            {
                let words = format!(
                    "as many coordinates as there are particles have a mass{whose}, the others none"
                );
                add(Rule::MassAt(MassAt::Half { of_particles }), 2, &words);
            }
            for (axes, rank, words) in of_blocks() {
                let words = format!("the sum of the Jacobians in the matrix {words}");
                add(Rule::Blocks(axes), rank, &words);
            }
            let words =
                "the solution of the linear system is taken for the new velocity, not its change";
            add(Rule::Whole { of_free: false }, 1, words);
            let words =
                "the solution of the linear system is taken for the new velocity of free particles";
            add(Rule::Whole { of_free: true }, 1, words);
            for (power, words) in [(-1, "divided"), (1, "multiplied")] {
                let words = format!("the solution of the linear system is {words} by the mass");
                add(Rule::Scaled(power), 2, &words);
            }
            let words = "forces and Jacobians are evaluated at 2 x + h v, not x + h v";
            add(Rule::SeenAt(SeenAt::Twice), 2, words);
            for (quantity, words) in [
                (Quantity::ByVelocity, "dF/dx is in the place of dF/dv in the matrix"),
                (Quantity::ByPosition, "dF/dv is in the place of dF/dx in the matrix"),
            ] {
                add(Rule::Other(quantity), 2, words);
            }
            for (quantity, words) in [
                (Quantity::ByVelocity, "dF/dv in the matrix is the sum of dF/dx and dF/dv"),
                (Quantity::ByPosition, "dF/dx in the matrix is the sum of dF/dx and dF/dv"),
            ] {
                add(Rule::Summed(quantity), 2, words);
            }
            add(Rule::ForcesAt(0.0), 1, "forces are evaluated at x, not x + h v");
            for (which, what, verb) in [
                ([true; 2], "Jacobians", "are"),
                ([true, false], "dF/dx", "is"),
                ([false, true], "dF/dv", "is"),
            ] {
                let words = format!("{what} {verb} evaluated at x, not x + h v");
                add(Rule::JacobiansAt(which, 0.0), 1, &words);
            }
            for (forces, jacobians, right, rank, words) in LINEARIZED {
                add(Rule::Linearized(Linearized { forces, jacobians, right }), rank, words);
            }
            add(Rule::ForcesAt(0.5), 2, "forces are evaluated at x + h v/2, not x + h v");
            for (quantity, what) in
                [(Quantity::ByPosition, "dF/dx"), (Quantity::ByVelocity, "dF/dv")]
            {
                for (factor, words) in [
                    (Factor::number(-1.0), "has the wrong sign"),
                    (Factor::number(0.0), "is missing"),
                    (Factor::h(-1), "lacks a factor h"),
                    (Factor::h(1), "has a factor h too many"),
                    (Factor::number(2.0), "is multiplied by 2"),
                    (Factor::number(0.5), "is multiplied by 0.5"),
                ] {
                    let words = format!("{what} {words} in the matrix");
                    add(Rule::Matrix(quantity, factor), 1, &words);
                }
            }
            for (factor, words) in [
                (Factor::number(-1.0), "have the wrong sign"),
                (Factor::number(0.0), "are missing"),
                (Factor::h(-1), "lack a factor h"),
                (Factor::h(1), "have a factor h too many"),
                (Factor::number(2.0), "are multiplied by 2"),
                (Factor::number(0.5), "are multiplied by 0.5"),
            ] {
                let words = format!("dF/dx and dF/dv {words} in the matrix");
                add(Rule::Matrices(factor), 2, &words);
            }
            let words = "dF/dx has h and dF/dv h² in the matrix, each the other's";
            add(Rule::StepsExchanged, 2, words);
            let words = "in the matrix, dF/dx and dF/dv are multiplied by the mass, or not divided by it where all else is";
            add(Rule::Matrices(Factor::mass(1)), 2, words);
        }
        OnePoint::Implicit => {
            add(inertia(0, 0, 1.0), 1, "the identity is in the place of M");
            add(inertia(1, 0, 1.0), 2, "M is missing in M (u − v) on the right-hand side");
            add(inertia(1, 1, 0.0), 1, "M (u − v) is missing on the right-hand side");
            add(inertia(1, 1, -1.0), 1, "M (u − v) has the wrong sign on the right-hand side");
            add(Rule::ForcesAt(0.0), 1, "forces are evaluated at x, not x + h v'");
            add(Rule::ForcesAt(0.5), 2, "forces are evaluated at x + h v'/2, not x + h v'");
        }
    }
    add(Rule::Seen([0.0, 1.0, 1.0]), 2, "forces are evaluated with velocities of 0");
    for (positions, velocities, none_first, rank, words) in [
        (true, true, false, 1, "the forces are those of the step before"),
        (
            true,
            true,
            true,
            2,
            "the forces are those of the step before, and none in the first step",
        ),
        (
            false,
            false,
            true,
            2,
            "no force acts in the first step, as where forces are evaluated after their use",
        ),
        (true, false, false, 2, "forces are evaluated at the positions of the step before"),
        (
            true,
            false,
            true,
            2,
            "forces are evaluated at the positions of the step before, and no force acts in the first step",
        ),
        (false, true, false, 2, "forces are evaluated with the velocities of the step before"),
        (
            false,
            true,
            true,
            2,
            "forces are evaluated with the velocities of the step before, and no force acts in the first step",
        ),
    ] {
        add(Rule::Stale(Stale { positions, velocities, none_first }), rank, words);
    }
    let (neither, both) = ([false; 2], [true; 2]);
    let of_forces = [("the forces", true, neither, false)];
    let of_matrix = [
        ("the matrix", false, both, true),
        ("the matrix and the forces", true, both, true),
        ("dF/dx", false, [true, false], false),
        ("dF/dv", false, [false, true], false),
        ("the Jacobians", false, both, false),
        ("the Jacobians and the forces", true, both, false),
    ];
    let is_linearized = method == OnePoint::Linearized;
    let of_matrix = of_matrix.into_iter().filter(|_| is_linearized);
    let is_step = method != OnePoint::Implicit;
    for (what, forces, jacobians, inertia) in
        of_forces.into_iter().filter(|_| is_step).chain(of_matrix)
    {
        let displacement = false;
        let kept = |carried| Rule::Kept(Kept { carried, forces, jacobians, inertia, displacement });
        let words =
            format!("each step adds to {what} of the steps before, not set to zero in between");
        add(kept(Carried::Added(Cleared::None)), 2, &words);
        // The masses are the same in each step.
        if inertia {
            // It is multiplied with the Jacobians that are added to it.
            let factors = [(1.0, 2, "h²"), (-1.0, 2, "−h²"), (1.0, 1, "h"), (-1.0, 1, "−h")];
            for (number, h, factor) in factors.into_iter().filter(|_| !forces) {
                let words = format!(
                    "each step adds to the matrix of the step before, not set to zero in between but multiplied by {factor}"
                );
                add(kept(Carried::Scaled(Factor { number, h, mass: 0 })), 2, &words);
            }
            continue;
        }
        add(kept(Carried::Again), 2, &format!("each step uses {what} of the first one"));
        let words =
            format!("each step subtracts {what} of the step before, not set to zero in between");
        add(kept(Carried::Subtracted), 2, &words);
        // One loop or one call clears one list.
        if forces && jacobians != [false; 2] {
            continue;
        }
        for (cleared, which) in [
            (Cleared::First, "only the first number of"),
            (Cleared::NotFirst, "all but the first number of"),
            (Cleared::NotLast, "all but the last number of"),
            (Cleared::Bytes, "as many bytes as there are numbers, an eighth of"),
            (Cleared::Few, if forces { "the first half of" } else { "the first row of" }),
        ] {
            let words = format!("between steps, {which} {what} is set to zero; the rest adds up");
            add(kept(Carried::Added(cleared)), 2, &words);
        }
        let axes = scene.dimension.count();
        for (axis, letter) in XY.iter().enumerate().filter(|_| forces) {
            let words =
                format!("between steps, only {letter} of {what} is set to zero; the rest adds up");
            add(kept(Carried::Added(Cleared::Along(axis, axes))), 2, &words);
        }
    }
    if method == OnePoint::Linearized {
        let displaced = Kept {
            carried: Carried::Again,
            forces: false,
            jacobians: [false; 2],
            inertia: false,
            displacement: true,
        };
        add(Rule::Kept(displaced), 2, "in x + h v, each step uses h v of the first one");
        add(Rule::StaleJacobians, 2, "the Jacobians are those of the step before");
        add(Rule::Seen([1.0, 0.0, 1.0]), 2, "dF/dx is evaluated with velocities of 0");
        for (factors, what) in [
            ([2.0; 3], "forces and Jacobians are"),
            ([2.0, 1.0, 1.0], "forces are"),
            ([1.0, 2.0, 2.0], "Jacobians are"),
        ] {
            let words = format!("{what} evaluated with twice the velocities");
            add(Rule::Seen(factors), 2, &words);
        }
        add(Rule::Seen([0.0; 3]), 2, "forces and Jacobians are evaluated with velocities of 0");
    }
    if matches!(method, OnePoint::Explicit | OnePoint::Symplectic) {
        for (each, moves, words) in [
            (
                Each::Particle,
                true,
                "each particle moves before the forces on the next are evaluated",
            ),
            (
                Each::Coordinate,
                true,
                "each coordinate moves before the forces on the next are evaluated",
            ),
            (
                Each::Axis,
                true,
                "all particles move along x before the forces along y are evaluated",
            ),
            (
                Each::Particle,
                false,
                "the velocity of each particle changes before the forces on the next are evaluated",
            ),
            (
                Each::Coordinate,
                false,
                "each component of the velocities changes before the forces on the next are evaluated",
            ),
            (
                Each::Axis,
                false,
                "all velocities along x change before the forces along y are evaluated",
            ),
        ] {
            add(Rule::OneByOne { each, moves }, 2, words);
        }
        let terms: BTreeSet<Term> =
            scene.forces.iter().flat_map(|element| Term::of(element.schema)).collect();
        for term in terms.into_iter().filter(|term| term.depends_on().velocity) {
            let words = format!("{term} acts on the velocities that the other forces give");
            add(Rule::Split(term), 2, &words);
        }
    }
    let right = if method == OnePoint::Explicit { [1.0, 0.0] } else { [0.0, 1.0] };
    for (rule, words) in [
        ([1.0, 0.0, 1.0], "positions move with the old velocity, not the new one"),
        ([0.0, 1.0, 1.0], "positions move with the new velocity, not the old one"),
        ([0.0, 0.0, 1.0], "positions do not move"),
        ([0.5, 0.5, 1.0], "positions move with the mean of the old and the new velocity"),
        ([1.0, 0.0, 0.0], "positions move by the old velocity without h"),
        ([0.0, 1.0, 0.0], "positions move by the new velocity without h"),
        ([-1.0, 0.0, 1.0], "positions move against the old velocity"),
        ([0.0, -1.0, 1.0], "positions move against the new velocity"),
        ([1.0, 1.0, 1.0], "positions move with the sum of the old and the new velocity"),
    ] {
        let [old, new, h] = rule;
        if [old, new] != right || h != 1.0 {
            add(Rule::Position { old, new, h: h as i32 }, 1, words);
        }
    }
    all
}

/// Points of a linearized method: of forces, of Jacobians, and the factor of `h² ∂F/∂x v` on the right-hand side. At
/// `(x, v)` with that term is the form of Baraff and Witkin.
const LINEARIZED: [(f64, f64, Option<Factor>, u8, &str); 9] = [
    (0.0, 0.0, None, 1, "forces and Jacobians are evaluated at x, not x + h v"),
    (0.5, 0.5, None, 2, "forces and Jacobians are evaluated at x + h v/2, not x + h v"),
    (
        0.0,
        1.0,
        Some(Factor::h(-1)),
        2,
        "forces are evaluated at x, Jacobians at x + h v, and the right-hand side has h dF/dx v as well",
    ),
    (
        0.0,
        0.0,
        Some(Factor::number(1.0)),
        1,
        "the step is linearized at x, not x + h v: its right-hand side is h F + h² dF/dx v there",
    ),
    (
        0.0,
        0.0,
        Some(Factor::h(-1)),
        2,
        "the step is linearized at x, not x + h v: its right-hand side is h F + h dF/dx v there",
    ),
    (
        0.0,
        0.0,
        Some(Factor::number(-1.0)),
        2,
        "the step is linearized at x, not x + h v: its right-hand side is h F − h² dF/dx v there",
    ),
    (
        0.0,
        1.0,
        Some(Factor::number(1.0)),
        2,
        "forces are evaluated at x, Jacobians at x + h v, and the right-hand side has h² dF/dx v as well",
    ),
    (
        1.0,
        0.0,
        Some(Factor::number(1.0)),
        2,
        "Jacobians are evaluated at x, forces at x + h v, and the right-hand side has h² dF/dx v as well",
    ),
    (
        1.0,
        1.0,
        Some(Factor::number(1.0)),
        2,
        "the right-hand side has h² dF/dx v as well, although forces are taken at x + h v",
    ),
];

/// Usual limits of an iteration.
const LIMITS: [usize; 7] = [10, 20, 25, 30, 50, 100, 200];

/// Changes of the integrator that only whole steps show: where Newton's method ends, and substeps.
pub fn of_process(scene: &Scene) -> Vec<Change> {
    let name = scene.integrator.name;
    let Some(method) = Method::one_point(scene.integrator) else { return Vec::new() };
    let change = |rule: Rule, rank: u8, words: String| of_method(name, rule, &words, rank);
    let mut all = Vec::new();
    if method == OnePoint::Linearized {
        for (slip, words) in Slip::all() {
            all.push(change(Rule::Solver(slip), 2, words));
        }
        for (exponent, central) in (1..=8).flat_map(|e| [(e, false), (e, true)]) {
            if central && exponent > 4 {
                continue;
            }
            let kind = if central { "central" } else { "forward" };
            let words = format!("Jacobians are {kind} differences with a step of 1e-{exponent}");
            let rule = Rule::Differences { step: 10.0_f64.powi(-exponent), central };
            all.push(change(rule, 2, words));
        }
        for count in [2, 3] {
            let words = format!("Newton's method makes {count} iterations, not one");
            all.push(change(Rule::Iterations(count), 2, words));
        }
    }
    if method == OnePoint::Implicit {
        for (right, sign, words) in [
            (1, 0.0, "M (u − v) is missing on the right-hand side"),
            (0, 1.0, "M is missing in M (u − v) on the right-hand side"),
            (1, -1.0, "M (u − v) has the wrong sign on the right-hand side"),
        ] {
            for iterations in LIMITS {
                let words = format!("{words}; Newton's method ends after {iterations} iterations");
                all.push(change(Rule::Unbalanced { right, sign, iterations }, 2, words));
            }
        }
        for (iterations, end) in ends_after(&[10, 20, 50, 100]) {
            let words =
                format!("Newton's method adds each update to the velocities of its start{end}");
            let from_zero = false;
            all.push(change(Rule::Restarted { iterations, from_zero }, 2, words));
            let words = format!(
                "Newton's method takes each update for the velocities, not for their change{end}"
            );
            let from_zero = true;
            all.push(change(Rule::Restarted { iterations, from_zero }, 2, words));
            let words =
                format!("Newton's method moves positions on in every iteration, not from x{end}");
            let by = Accumulated::Before;
            all.push(change(Rule::Accumulated { iterations, by }, 2, words));
            for (by, from) in
                [(Accumulated::After, ""), (Accumulated::FromBefore, " from x + h v on")]
            {
                let words = format!(
                    "Newton's method moves the particles by h u in every iteration{from}, not once at its end{end}"
                );
                all.push(change(Rule::Accumulated { iterations, by }, 2, words));
            }
            let words = format!(
                "Newton's method moves positions by h times the update in every iteration, and by h u at its end{end}"
            );
            let by = Accumulated::ByUpdates;
            all.push(change(Rule::Accumulated { iterations, by }, 2, words));
        }
        for ([positions, velocities], what) in [
            ([true, false], "the positions x + h v"),
            ([false, true], "the velocities v"),
            ([true, true], "x + h v and v"),
        ] {
            let words = format!(
                "Newton's method evaluates forces at {what} of its start in every iteration"
            );
            all.push(change(Rule::Unmoved { positions, velocities }, 1, words));
        }
        for (inertia, forces, what) in [
            (true, true, "in M (u − v) and where forces are evaluated"),
            (true, false, "in M (u − v)"),
            (false, true, "where forces are evaluated"),
        ] {
            let words =
                format!("Newton's method takes the velocity for its change over the step, {what}");
            all.push(change(Rule::WholeChange { inertia, forces }, 1, words));
        }
        let words = "Newton's method evaluates forces with the velocities u + (u − v), not u";
        all.push(change(Rule::SeenAt(SeenAt::Ahead), 1, words.to_owned()));
        let words = "Newton's method adds u − v to the positions where forces are evaluated, and not to the velocities";
        all.push(change(Rule::SeenAt(SeenAt::Crossed), 2, words.to_owned()));
        for (moves, rest) in [(true, ", and positions move there"), (false, ", not x + h u")] {
            let words =
                format!("Newton's method evaluates forces at the positions x + h (v + u)/2{rest}");
            all.push(change(Rule::Mean { moves }, 2, words));
        }
        let words = "Newton's method moves positions by h times each update, and by h u from there";
        all.push(change(Rule::MovedOn, 2, words.to_owned()));
        let words =
            "Newton's method has the Jacobians of its first iteration in all others of a step";
        all.push(change(Rule::FirstJacobians, 2, words.to_owned()));
        let words = "Newton's method makes no iteration after the first step";
        all.push(change(Rule::Once, 2, words.to_owned()));
        let ends = newton_ends().into_iter();
        all.extend(ends.map(|(newton, rank, words)| change(Rule::Newton(newton), rank, words)));
    }
    for count in [2, 3] {
        let words = format!(
            "{count} steps are made in the place of one, or one state in {count} is written"
        );
        all.push(change(Rule::Repeated(count), 3, words));
    }
    for count in [2, 3, 4, 5, 10, 20] {
        let words = format!("each step is made of {count} shorter ones");
        all.push(change(Rule::Substeps(count), 3, words));
    }
    all
}

/// The rules of the matrix of Newton's method: those that a linearized method has.
pub fn of_newtons_matrix(scene: &Scene) -> Vec<Change> {
    let Some(integrator) = simulator::vocabulary().integrator("linearized-implicit-euler") else {
        return Vec::new();
    };
    let linearized = Scene { integrator, ..scene.clone() };
    let rules = of_integrator(&linearized).into_iter();
    rules.filter_map(|rule| of_newton(scene.integrator.name, &rule)).collect()
}

/// The same rule of the matrix, or of fixed particles, in Newton's method of this name as in a linearized method.
pub fn of_newton(name: &'static str, change: &Change) -> Option<Change> {
    if let Place::FixedUnder(of) = change.place {
        let known = simulator::vocabulary().integrator(of);
        let is_implicit = known.is_some_and(|known| known.matrix == Matrix::Jacobians);
        let words = change.words.replacen(of, name, 1);
        let of_name = || Change { place: Place::FixedUnder(name), words, ..change.clone() };
        return (is_implicit && of != name).then(of_name);
    }
    let Effect::Method(linearized, rule) = change.effect else { return None };
    let is_of_matrix = change.is_of_system()
        || matches!(
            rule,
            Rule::JacobiansAt(..)
                | Rule::Other(_)
                | Rule::SeenAt(SeenAt::Moved([false, ..]))
                | Rule::Kept(Kept { forces: false, displacement: false, .. })
        );
    let words = change.words.strip_prefix(linearized)?.strip_prefix(": ")?;
    // Masses stand on the right-hand side of Newton's method as well.
    let (rule, words) = match rule {
        Rule::MassAt(index) => (Rule::MatrixMassAt(index), format!("{words}, in the matrix alone")),
        _ => (rule, words.to_owned()),
    };
    (is_of_matrix && name != linearized).then(|| of_method(name, rule, &words, change.rank))
}

/// Iterations of Newton's method, and how it ends in words: where it ends by itself, steps show no limit.
fn ends_after(limits: &[usize]) -> impl Iterator<Item = (usize, String)> + '_ {
    let by_limit =
        limits.iter().map(|limit| (*limit, format!(", and ends after {limit} iterations")));
    std::iter::once((MANY_ITERATIONS, String::new())).chain(by_limit)
}

/// Where Newton's method may start and end.
fn newton_ends() -> Vec<(Newton, u8, String)> {
    let mut all = Vec::new();
    for iterations in 1..LIMITS[0] {
        let times = if iterations == 1 { "iteration" } else { "iterations" };
        let words = format!("Newton's method ends after {iterations} {times}");
        all.push((Newton { iterations, ..NEWTON }, 1, words));
    }
    // Whole powers first.
    let (whole, half) = ((0..=16).step_by(2), (1..=16).step_by(2));
    let tolerances = whole.chain(half).map(|exponent| {
        let tolerance = 10.0_f64.powf(-f64::from(exponent) / 2.0);
        let written = match exponent {
            0 => "1".to_owned(),
            _ if exponent % 2 == 0 => format!("1e-{}", exponent / 2),
            _ => format!("{tolerance:.1e}"),
        };
        (tolerance, written)
    });
    let tolerances: Vec<(f64, String)> = tolerances.collect();
    for (norm, rank, what) in [
        (Norm::Euclidean, 2, "Newton's method"),
        (Norm::First, 2, "Newton's method looks at the first component of the update only, and"),
        (
            Norm::Sum,
            2,
            "Newton's method adds up the components of the update with their signs, and",
        ),
        (Norm::Positions, 3, "Newton's method looks at the update of positions, and"),
        (Norm::Largest, 3, "Newton's method looks at the largest component of the update, and"),
    ] {
        for (drops_last, rest) in [(false, ""), (true, " and does not apply the last one")] {
            if norm != Norm::Euclidean || drops_last {
                let newton = Newton { norm, drops_last, ..NEWTON };
                all.push((newton, rank, format!("{what} stops at a small update{rest}")));
            }
            for (tolerance, written) in &tolerances {
                let newton = Newton { norm, drops_last, tolerance: *tolerance, ..NEWTON };
                all.push((newton, rank, format!("{what} stops at an update of {written}{rest}")));
            }
        }
    }
    let words = "Newton's method stops where the sum of the update is negative";
    all.push((Newton { norm: Norm::SignedSum, ..NEWTON }, 2, words.to_owned()));
    for (guess, relaxation, rank, words) in [
        (Guess::Old, 0.5, 2, "Newton's method applies half of each update"),
        (Guess::Zero, 1.0, 3, "Newton's method starts from zero velocities"),
        (
            Guess::AllZero,
            1.0,
            3,
            "Newton's method starts from zero velocities, of fixed particles as well",
        ),
        (
            Guess::FixedZero,
            1.0,
            2,
            "Newton's method sets the velocities of fixed particles to zero before it starts",
        ),
        (Guess::Explicit, 1.0, 3, "Newton's method starts from a step of explicit Euler"),
    ] {
        let newton = Newton { guess, relaxation, ..NEWTON };
        all.push((newton, rank, words.to_owned()));
        let limits: Vec<usize> = (1..LIMITS[0]).chain(LIMITS).collect();
        for (iterations, end) in ends_after(&limits) {
            all.push((Newton { iterations, ..newton }, rank, format!("{words}{end}")));
        }
        for (tolerance, written) in &tolerances {
            let newton = Newton { tolerance: *tolerance, ..newton };
            all.push((newton, rank + 1, format!("{words}, and stops at an update of {written}")));
        }
    }
    all
}

/// Changes of the treatment of fixed particles, by all methods, by a family of them or by the scene's alone; empty where
/// there are none.
pub fn of_fixed(scene: &Scene) -> Vec<Change> {
    let name = scene.integrator.name;
    let mut all = of_fixed_by_family(scene);
    let alone = |change: &Change| {
        let words = match change.words.split_once(" methods ") {
            Some((_, rest)) => format!("steps of {name} {rest}"),
            None => format!("{name}: {}", change.words),
        };
        let place = Place::FixedUnder(name);
        Change { place, words, effect: change.effect.clone(), rank: change.rank + 1 }
    };
    let is_new = |(number, one): &(usize, &Change)| {
        all[number + 1..].iter().all(|later| later.effect != one.effect)
    };
    let by_it: Vec<Change> =
        all.iter().enumerate().filter(is_new).map(|(_, change)| alone(change)).collect();
    all.extend(by_it);
    all
}

fn of_fixed_by_family(scene: &Scene) -> Vec<Change> {
    // Rounds have pins in their place.
    if is_of_rounds(scene) || !scene.particles.iter().any(|particle| particle.fixed) {
        return Vec::new();
    }
    let implicit = matches!(
        Method::one_point(scene.integrator),
        Some(OnePoint::Linearized | OnePoint::Implicit)
    );
    let mut all = Vec::new();
    let family = if implicit { "implicit" } else { "explicit" };
    let mut add = |family: Option<bool>, effect: Effect, rank: u8, words: &str| {
        let place = Place::Fixed(family);
        all.push(Change { place, words: words.to_owned(), effect, rank });
    };
    let rule = Effect::Fixed;
    add(None, Effect::Scene(SceneRule::Unfixed), 0, "fixed particles are treated as free");
    let has_several = scene.particles.iter().filter(|particle| particle.fixed).count() > 1;
    let has_late = scene.particles.iter().skip_while(|one| one.fixed).any(|one| one.fixed);
    if has_several {
        for (which, name) in [(StillFixed::First, "first"), (StillFixed::Last, "last")] {
            let words = format!("of several fixed particles, only the {name} is held");
            let effect = || Effect::Scene(SceneRule::StillFixed(which));
            add(None, effect(), 1, &words);
            let words = format!("{family} methods hold only the {name} of several fixed particles");
            add(Some(implicit), effect(), 1, &words);
        }
    }
    if has_late {
        let effect = || Effect::Scene(SceneRule::StillFixed(StillFixed::Leading));
        let words = "of the fixed particles, only those before the first free one are held";
        add(None, effect(), 1, words);
        let words =
            format!("{family} methods hold only the fixed particles before the first free one");
        add(Some(implicit), effect(), 1, &words);
    }
    for (which, name, end) in [
        (StillFixed::NotParticleFirst, "first", scene.particles.first()),
        (StillFixed::NotParticleLast, "last", scene.particles.last()),
    ] {
        if end.is_some_and(|particle| particle.fixed) {
            let effect = || Effect::Scene(SceneRule::StillFixed(which));
            add(None, effect(), 1, &format!("the {name} particle is not held where it is fixed"));
            let words =
                format!("{family} methods do not hold the {name} particle where it is fixed");
            add(Some(implicit), effect(), 1, &words);
        }
    }
    for (of, rank, words) in [
        (FixedRule::Stand, 1, "do not move fixed particles, although they have a velocity"),
        (FixedRule::Stop, 1, "set the velocities of fixed particles to zero"),
        (FixedRule::Freeze, 2, "do not move fixed particles, and set their velocities to zero"),
        (
            FixedRule::Restored,
            2,
            "put fixed particles back after each step, and keep the velocities that forces give them",
        ),
    ] {
        add(Some(implicit), rule(of), rank, &format!("{family} methods {words}"));
    }
    for exponent in 3..=15 {
        for (is_free, words) in [(true, "are free, with a mass of"), (false, "have the mass")] {
            let heavy = SceneRule::Heavy { mass: 10.0_f64.powi(exponent), is_free };
            let words = format!("fixed particles {words} 1e{exponent}");
            add(None, Effect::Scene(heavy), 2, &words);
        }
    }
    add(
        None,
        rule(FixedRule::Stand),
        1,
        "fixed particles stand still, although they have a velocity",
    );
    add(None, rule(FixedRule::Stop), 1, "the velocities of fixed particles are set to zero");
    let words = "fixed particles stand still, and their velocities are set to zero";
    add(None, rule(FixedRule::Freeze), 2, words);
    let words = "fixed particles move in the first step, and their velocities are set to zero then";
    add(None, rule(FixedRule::StopMoved), 2, words);
    add(None, rule(FixedRule::Fall), 1, "fixed particles fall under simple gravity");
    let words = "forces between a fixed and another particle are left out";
    add(None, Effect::Scene(SceneRule::Unjoined), 1, words);
    if !implicit {
        let words = "explicit methods move fixed particles by forces";
        add(Some(false), rule(FixedRule::Feel(None)), 0, words);
        for (axis, letter) in XY.iter().enumerate() {
            let words = format!("explicit methods move fixed particles by forces along {letter}");
            add(Some(false), rule(FixedRule::Feel(Some(axis))), 1, &words);
        }
        for (unknowns, words) in [
            (Unknowns::Index, "clear the components i, i + 1 of the force for fixed particle i"),
            (Unknowns::Number, "clear the component i of the force for fixed particle i"),
            (Unknowns::ByAxis, "clear the forces on fixed particles as if all x came before all y"),
        ] {
            let words = format!("explicit methods {words}");
            add(Some(false), rule(FixedRule::Cleared(unknowns)), 1, &words);
        }
        let words = "explicit methods end their loop at the first fixed particle: forces change no velocity from there on";
        add(Some(false), rule(FixedRule::Ended { stands: false }), 1, words);
        let words = "explicit methods end their loop at the first fixed particle: no particle moves from there on";
        add(Some(false), rule(FixedRule::Ended { stands: true }), 1, words);
        return all;
    }
    let words = "implicit methods add the velocities of fixed particles to themselves in each step";
    add(Some(true), rule(FixedRule::Doubled), 2, words);
    let words = "implicit methods evaluate forces at the old positions of fixed particles";
    add(Some(true), rule(FixedRule::Behind), 1, words);
    let free = Hold { rows: false, columns: false, right: false, ..HELD };
    let words = "implicit methods move fixed particles by forces";
    add(Some(true), rule(FixedRule::Hold(free)), 0, words);
    let lacks = |what: &str| format!("implicit methods do not clear the {what} of fixed particles");
    let holds = [
        (Hold { rows: false, columns: false, ..HELD }, "rows and columns"),
        (Hold { rows: false, ..HELD }, "rows"),
        (Hold { right: false, ..HELD }, "right-hand sides"),
        (Hold { columns: false, right: false, ..HELD }, "columns and right-hand sides"),
        (Hold { rows: false, right: false, ..HELD }, "rows and right-hand sides"),
    ];
    for (hold, what) in holds {
        add(Some(true), rule(FixedRule::Hold(hold)), 1, &lacks(what));
    }
    let felt = Hold { rows: false, columns: false, right: false, unforced: true, ..HELD };
    let words = "implicit methods clear the forces on fixed particles, and neither their rows and columns nor their right-hand sides";
    add(Some(true), rule(FixedRule::Hold(felt)), 2, words);
    for (right, unforced, what) in [
        (true, false, "rows and columns"),
        (false, true, "rows and columns, and clear the forces on them"),
        (false, false, "rows, columns and right-hand sides"),
    ] {
        let hold = Hold { rows: false, columns: false, right, unforced, unit: true, ..HELD };
        let words = format!(
            "implicit methods set the diagonal entries of fixed particles to 1, and do not clear their {what}"
        );
        add(Some(true), rule(FixedRule::Hold(hold)), 2, &words);
    }
    let exchanged = Hold { exchanged: true, ..HELD };
    let words = "implicit methods clear rows, columns and right-hand sides of free particles, not of fixed ones";
    add(Some(true), rule(FixedRule::Hold(exchanged)), 1, words);
    for exponent in 3..=12 {
        for (large, what) in [
            (Large::Added(exponent), format!("add 1e{exponent} to")),
            (Large::Masses(exponent), format!("add 1e{exponent} masses to")),
            (Large::Factor(exponent), format!("multiply by 1e{exponent}")),
        ] {
            for (right, end) in
                [(true, "rows and columns"), (false, "rows, columns and right-hand sides")]
            {
                let large = Some(large);
                let hold = Hold { rows: false, columns: false, right, large, ..HELD };
                let words = format!(
                    "implicit methods {what} the diagonal entries of fixed particles, and do not clear their {end}"
                );
                add(Some(true), rule(FixedRule::Hold(hold)), 2, &words);
            }
        }
    }
    for (late, what) in [
        ([true, false], "h² dF/dx"),
        ([false, true], "h dF/dv"),
        ([true, true], "h² dF/dx and h dF/dv"),
    ] {
        let words = format!(
            "implicit methods add {what} to the matrix after rows and columns of fixed particles are cleared"
        );
        add(Some(true), rule(FixedRule::Late(late)), 1, &words);
    }
    let cleared = [
        (true, true, true),
        (true, true, false),
        (false, false, true),
        (true, false, true),
        (true, false, false),
    ];
    let held = [
        (Unknowns::Axis(0), "hold fixed particles along x only"),
        (Unknowns::Axis(1), "hold fixed particles along y only"),
        (Unknowns::Index, "clear the unknowns i, i + 1 of fixed particle i"),
        (Unknowns::Number, "hold the unknown i of fixed particle i, and no other"),
        (Unknowns::ByAxis, "hold fixed particles as if all x came before all y"),
    ];
    for (rows, columns, right) in cleared {
        for (unknowns, words) in held {
            let hold = Hold { rows, columns, right, unknowns, of_right: unknowns, ..HELD };
            let words = format!("implicit methods {words}");
            add(Some(true), rule(FixedRule::Hold(hold)), 2, &words);
        }
    }
    // Programs that clear the sum of forces as well.
    for (unknowns, words) in held {
        for right in [true, false] {
            let hold = Hold { right, unknowns, of_right: unknowns, unforced: true, ..HELD };
            let words = format!("implicit methods {words}, and clear the forces on them");
            add(Some(true), rule(FixedRule::Hold(hold)), 2, &words);
        }
    }
    for (axis, letter) in XY.iter().enumerate() {
        let hold = Hold { of_right: Unknowns::Axis(axis), ..HELD };
        let words = format!(
            "implicit methods clear the right-hand sides of fixed particles along {letter} only"
        );
        add(Some(true), rule(FixedRule::Hold(hold)), 2, &words);
    }
    let solved = Hold { rows: false, columns: false, right: false, solution: true, ..HELD };
    let words = "implicit methods solve for fixed particles as for free ones, and drop their part of the solution";
    add(Some(true), rule(FixedRule::Hold(solved)), 1, words);
    for (which, name, is_there) in [
        (StillFixed::Leading, "fixed particles before the first free one", has_late),
        (StillFixed::First, "first of several fixed particles", has_several),
        (StillFixed::Last, "last of several fixed particles", has_several),
    ] {
        let parts =
            [(true, true, "rows and columns"), (true, false, "rows"), (false, true, "columns")];
        for (rows, columns, what) in parts.into_iter().filter(|_| is_there) {
            for (right, unforced, end) in
                [(true, false, ""), (false, true, ", and clear the forces on all")]
            {
                let which = Some(which);
                let hold = Hold { rows, columns, right, unforced, which, ..HELD };
                let words = format!("implicit methods clear {what} of the {name} only{end}");
                let change = rule(FixedRule::Hold(hold));
                add(Some(true), change, 2, &words);
            }
        }
    }
    let between = Hold { between: true, ..HELD };
    let words =
        "implicit methods clear only blocks between two fixed particles, not those with a free one";
    add(Some(true), rule(FixedRule::Hold(between)), 1, words);
    let with_mass = Hold { rows: false, columns: false, between: true, ..HELD };
    let words = format!("{words}, and keep their masses");
    add(Some(true), rule(FixedRule::Hold(with_mass)), 1, &words);
    let massless = Hold { rows: false, columns: false, massless: true, ..HELD };
    let words = "implicit methods leave the mass of fixed particles out of the matrix";
    add(Some(true), rule(FixedRule::Hold(massless)), 2, words);
    all
}

/// Slips in the functions on vectors that all forces between two particles share; empty where there are none of these.
pub fn of_helpers(scene: &Scene) -> Vec<Change> {
    let change = |(helper, words): (Helper, String)| Change {
        place: Place::Helpers,
        words: format!("in all forces, {words}"),
        effect: Effect::Helper(None, &Quantity::ALL, helper),
        rank: 2,
    };
    let alone = |(helper, words): (Helper, String)| Change {
        effect: Effect::Helper(None, FORCE, helper),
        rank: 3,
        ..change((helper, words + IN_FORCES))
    };
    let slips = || helper::all().into_iter().map(|(slip, words)| (slip, words.to_owned()));
    // A single term that reads velocities has such slips among its changes.
    let terms = scene.forces.iter().filter(|element| element.pair().is_some());
    let terms: BTreeSet<Term> = terms.flat_map(|element| Term::of(element.schema)).collect();
    let has_several = terms.iter().filter(|term| term.depends_on().velocity).count() > 1;
    let reads = helper::reads(true).into_iter().filter(|(read, ..)| {
        has_several || !matches!(read.of, Coordinates::Velocities(_) | Coordinates::AllVelocities)
    });
    let reads = reads.map(|(read, what, of_which)| {
        (Helper::Read(read), format!("{what} is read for {of_which}"))
    });
    let both = [(JACOBIANS, "each Jacobian"), (BY_POSITION, "each dF/dx")];
    let of_matrix = both.into_iter().flat_map(|(quantities, what)| {
        let words = move |rest: String| format!("{what} {rest}");
        let blocks = of_stencil(Stencil::Edge).into_iter();
        let blocks =
            blocks.map(move |(blocks, rest)| (Helper::Blocks(quantities, blocks), words(rest)));
        let entries = of_blocks().into_iter();
        let entries = entries.map(move |(axes, _, rest)| {
            (Helper::Entries(quantities, axes), words(rest.to_string()))
        });
        blocks.chain(entries)
    });
    // One force's first: all forces have a slip only where the scenes of several show it.
    let mut all: Vec<Change> = Vec::new();
    let mut tags: Vec<&'static str> = Vec::new();
    for schema in scene.forces.iter().map(|element| element.schema) {
        let is_new = !tags.contains(&schema.tag);
        tags.push(schema.tag);
        let whole = Term { tag: schema.tag, part: "" };
        if !is_new || schema.stencil.size() != 2 || Term::of(schema).len() < 2 {
            continue;
        }
        for (quantities, rank, rest) in [(&Quantity::ALL[..], 2, ""), (FORCE, 3, IN_FORCES)] {
            all.extend(slips().map(|(slip, words)| Change {
                place: Place::Force(whole),
                words: format!("in {whole}, {words}{rest}"),
                effect: Effect::Helper(Some(schema.tag), quantities, slip),
                rank,
            }));
        }
        let parts = Term::of(schema);
        let pairs = parts.iter().flat_map(|from| parts.iter().map(move |to| [*from, *to]));
        for [from, to] in pairs.filter(|[from, to]| from != to) {
            let of = |(place, end): (usize, &&str)| Change {
                place: Place::Force(whole),
                words: format!("{from} acts on {end} twice, in the place of {to}"),
                effect: Effect::Ends(whole, Ends::Again(place, [from.part, to.part])),
                rank: 2,
            };
            all.extend(schema.stencil.particles().iter().enumerate().map(of));
        }
        for (quantities, what) in both {
            all.extend(of_stencil(schema.stencil).into_iter().map(|(blocks, words)| Change {
                place: Place::Jacobian(whole),
                words: format!("{what} of {whole} {words}"),
                effect: Effect::Blocks(whole, quantities, blocks),
                rank: 2,
            }));
        }
    }
    all.extend(slips().chain(reads).chain(of_matrix).map(change));
    all.extend(slips().map(alone));
    all.retain(|change| change.acts_in(scene));
    all
}

/// Particles that are taken as fixed although they are not.
pub fn taken_as_fixed() -> [Change; 2] {
    let change = |(exchanged, words): (bool, &str)| Change {
        place: Place::Fixed(None),
        words: words.to_owned(),
        effect: Effect::Scene(SceneRule::Fixed { exchanged }),
        rank: 1,
    };
    [
        (false, "no force acts: none is added to the sum, or all particles are taken as fixed"),
        (true, "free particles are taken as fixed, and fixed ones as free"),
    ]
    .map(change)
}

/// These changes of the elements that a force has, made where the force alone, or its Jacobians alone, are summed; of all
/// elements of the scene, also where a method of this name sums forces.
fn partly(all: &[Change], method: &'static str) -> Vec<Change> {
    let mut found = Vec::new();
    for change in all {
        let Effect::Scene(rule) = change.effect else { continue };
        let depends_on = match (rule, change.place) {
            (
                SceneRule::OneForce { .. }
                | SceneRule::NotFirstForce { .. }
                | SceneRule::NotLastForce { even_alone: true },
                _,
            ) => Dependence { position: true, velocity: true, time: false },
            (
                SceneRule::LeftOut { .. }
                | SceneRule::OfEdge(..)
                | SceneRule::ParticlesBefore(_)
                | SceneRule::ParametersOfOne { .. }
                | SceneRule::EdgeAsParticle(..)
                | SceneRule::Pairs(..)
                | SceneRule::Counted(..)
                | SceneRule::RunningEdge(..),
                Place::Force(term),
            ) => term.schema().depends_on(),
            (SceneRule::AlsoAs(_, other), Place::Force(_)) => {
                Term { tag: other, part: "" }.schema().depends_on()
            }
            (SceneRule::Root(..), Place::Force(term)) => term.schema().depends_on(),
            (SceneRule::Parameter(_, "G", value), Place::Force(term))
                if NEWTONS.contains(&value) =>
            {
                term.schema().depends_on()
            }
            _ => continue,
        };
        // In Jacobians alone, a formula has such a parameter.
        let is_of_parameter = matches!(rule, SceneRule::Root(..) | SceneRule::Parameter(..));
        if change.place == Place::Reading {
            let words = format!("{method}: {}", change.words);
            let effect = Effect::Partly(FORCE, rule);
            found.push(Change { place: Place::Integrator(method), words, effect, rank: 2 });
        }
        for (quantities, what, is_there) in [
            (FORCE, "forces", depends_on.has_jacobian()),
            (BY_POSITION, "dF/dx", depends_on.position),
            (BY_VELOCITY, "dF/dv", depends_on.velocity),
            (JACOBIANS, "both Jacobians", depends_on.position && depends_on.velocity),
        ] {
            if is_there && (quantities == FORCE || !is_of_parameter) {
                let place = match change.place {
                    Place::Force(term) if quantities != FORCE => Place::Jacobian(term),
                    Place::Force(term) => Place::Force(term),
                    _ => Place::Helpers,
                };
                let words = format!("{}, in {what} alone", change.words);
                let effect = Effect::Partly(quantities, rule);
                found.push(Change { place, words, effect, rank: change.rank.max(2) });
            }
        }
    }
    found
}

/// Changes of the reading of a scene. `time_steps` are those that may be taken for the scene's own.
pub fn of_reading(scene: &Scene, time_steps: &[f64]) -> Vec<Change> {
    let mut all = Vec::new();
    let mut add = |place: Place, rule: SceneRule, rank: u8, words: String| {
        all.push(Change { place, words, effect: Effect::Scene(rule), rank });
    };
    let reading = Place::Reading;
    add(reading, SceneRule::Masses(1.0), 1, "every mass is taken as 1".to_owned());
    add(reading, SceneRule::FirstMass, 2, "every mass is that of the first particle".to_owned());
    add(reading, SceneRule::LastMass, 2, "every mass is that of the last particle".to_owned());
    let axes = XY.into_iter().enumerate().take(scene.dimension.count());
    let along = axes.flat_map(|(axis, name)| {
        [
            (MassList::OneAlong(axis), "taken as 1"),
            (MassList::ZeroAlong(axis), "0"),
            (MassList::FirstAlong(axis), "those of the first particle"),
        ]
        .map(|(list, what)| (list, format!("masses along {name} are {what}")))
    });
    let by_axis = "masses are read as if all x came before all y".to_owned();
    for (list, words) in [(MassList::ByAxis, by_axis)].into_iter().chain(along) {
        for (once, rest) in [(false, "in forces as well"), (true, "in forces that of x alone")] {
            add(reading, SceneRule::MassList { list, once }, 2, format!("{words}, {rest}"));
        }
    }
    if scene.particles.iter().any(|particle| particle.mass.fract() != 0.0) {
        add(reading, SceneRule::IntegerMasses, 2, "masses are read as integers".to_owned());
    }
    let words = "negative numbers above −1 in forces are read without their sign";
    add(reading, SceneRule::SmallUnsigned, 2, words.to_owned());
    add(reading, SceneRule::Velocities, 1, "initial velocities are taken as 0".to_owned());
    add(reading, SceneRule::SingleTimeStep, 2, "dt is rounded to single precision".to_owned());
    if !scene.is_divided() {
        let words = "dt is the duration divided by the number of steps";
        add(reading, SceneRule::EvenTimeStep, 2, words.to_owned());
        let words = "the last step is shortened to end at the duration";
        add(reading, SceneRule::ShortLastStep, 2, words.to_owned());
    }
    for step in time_steps.iter().filter(|step| **step != scene.time_step) {
        add(reading, SceneRule::TimeStep(*step), 2, format!("dt is always taken as {step}"));
        if *step < scene.time_step {
            let words = format!("dt is taken as {step} where it is larger");
            add(reading, SceneRule::TimeStepAtMost(*step), 2, words);
        }
    }
    if scene.forces.len() > 1 {
        for (last, which) in [(false, "first"), (true, "last")] {
            let words = format!("only the {which} force of a scene is read");
            add(reading, SceneRule::OneForce { last }, 1, words);
        }
        for (even_alone, words) in [
            (true, "the last force of a scene is left out"),
            (false, "the last force of a scene is left out where there are several"),
        ] {
            add(reading, SceneRule::NotLastForce { even_alone }, 1, words.to_owned());
        }
        let words = "the first force of a scene is left out";
        add(reading, SceneRule::NotFirstForce { by_kind: false }, 1, words.to_owned());
        let is_sorted = scene.forces.is_sorted_by_key(|element| {
            let mut kinds = simulator::force::REGISTRY.iter();
            kinds.position(|kind| kind.schema.tag == element.schema.tag)
        });
        if !is_sorted {
            let words = format!("{words}, where forces are in the order of their kinds");
            add(reading, SceneRule::NotFirstForce { by_kind: true }, 1, words);
        }
    }
    let is_sorted = scene.edges.is_sorted_by_key(|edge| edge.particles);
    if !is_sorted {
        let words = "edges are sorted by their particles, which gives them other numbers";
        add(reading, SceneRule::SortedEdges, 2, words.to_owned());
    }
    let of_edges = scene.edges.iter().flat_map(|edge| edge.particles).max().unwrap_or(0);
    let of_elements =
        scene.forces.iter().flat_map(|element| element.edge.iter().chain(&element.particles));
    let of_all = of_elements.copied().fold(of_edges, usize::max);
    for (index, from, words) in [
        (Index::FirstDigit, 10, "only the first digit of a number is read"),
        (Index::LastDigit, 10, "only the last digit of a number is read"),
        (Index::Byte, 256, "a number is kept in one byte"),
        (Index::Less, 1, "numbers are taken to start at 1"),
    ] {
        for (highest, which, what) in [
            (of_all, Numbers::All, "particles and edges"),
            (of_edges, Numbers::ParticlesOfEdges, "the particles of edges"),
            (scene.edges.len().saturating_sub(1), Numbers::Edges, "edges"),
        ] {
            if highest >= from {
                let words = format!("of the numbers of {what}: {words}");
                add(reading, SceneRule::Indices(index, which), 2, words);
            }
        }
    }
    let is_known = |place: usize| {
        let [i, j] = scene.edges[place].particles;
        let mut before = scene.edges[..place].iter();
        before.any(|edge| edge.particles == [i, j] || edge.particles == [j, i])
    };
    if (0..scene.edges.len()).any(is_known) {
        let words =
            "a second edge between two particles is left out, and later ones are renumbered";
        for is_clamped in [false, true] {
            add(reading, SceneRule::UniqueEdges { is_clamped }, 2, words.to_owned());
        }
    }
    if scene.forces.len() > 1 {
        let has_field = scene
            .forces
            .iter()
            .any(|element| element.particles.is_empty() && element.schema.depends_on().velocity);
        let of_forces = [(false, "every force between particles"), (true, "every force")];
        for (fields, of) in of_forces.into_iter().filter(|(fields, _)| has_field || !fields) {
            for (quantities, what, is) in [
                (BY_POSITION, "dF/dx of", "is"),
                (BY_VELOCITY, "dF/dv of", "is"),
                (JACOBIANS, "both Jacobians of", "are"),
            ] {
                for (own, blocks) in
                    [(false, "blocks"), (true, "the blocks of a particle by itself")]
                {
                    for is_first in [false, true] {
                        let words = match is_first {
                            false => format!("{what} {of} {is} assigned to {blocks}, not added"),
                            true => format!(
                                "{what} {of} {is} put into {blocks} that are not there yet, and not added to others"
                            ),
                        };
                        let rule = SceneRule::AssignedByAll { quantities, own, is_first, fields };
                        add(Place::Helpers, rule, 2, words);
                    }
                }
            }
        }
    }
    let mut tags: Vec<&'static str> = Vec::new();
    for element in &scene.forces {
        if !tags.contains(&element.schema.tag) {
            tags.push(element.schema.tag);
        }
    }
    for tag in tags {
        let of_it = || scene.forces.iter().filter(|element| element.schema.tag == tag);
        let Some(schema) = of_it().next().map(|element| element.schema) else { continue };
        let terms = Term::of(schema);
        let of_parameter = |name: &str| {
            let is_its = |term: &&Term| !term.part.is_empty() && schema.part(term.part).names(name);
            Place::Force(*terms.iter().find(is_its).unwrap_or(&terms[0]))
        };
        let whole = Place::Force(terms[0]);
        let mut left_out = |which: Which, words: String| {
            add(whole, SceneRule::LeftOut { tag, which }, 1, words);
        };
        left_out(Which::Last, format!("the last element of {tag} has no effect"));
        if of_it().count() > 1 {
            for (which, what) in [(Which::NotLast, "last"), (Which::NotFirst, "first")] {
                let words = format!("only the {what} of several elements of {tag} has an effect");
                left_out(which, words);
            }
            if of_it().count() > scene.edges.len() && of_it().any(|one| one.edge.is_some()) {
                let words = format!("of {tag}, only as many as there are edges have an effect");
                left_out(Which::BeyondEdges, words);
            }
            if of_it().any(|element| element.edge.is_some()) {
                let words = format!("only the last {tag} on each edge has an effect");
                left_out(Which::NotLastOnEdge, words);
                let words = format!("only the first {tag} on each edge has an effect");
                left_out(Which::NotFirstOnEdge, words);
            }
        }
        if of_it().any(|element| element.pair().is_some_and(|[i, j]| i > j)) {
            let words = format!("{tag} has no effect where i is larger than j");
            left_out(Which::Descending, words);
        }
        let is_joined = |element: &ForceElement| {
            element.particles.iter().any(|particle| scene.particles[*particle].fixed)
        };
        if of_it().any(is_joined) {
            let words = format!("{tag} has no effect where one of its particles is fixed");
            left_out(Which::Joined, words);
        }
        let is_of_scene = |parameter: &&ParameterSchema| {
            !parameter.three_dimensional || scene.dimension == Dimension::Three
        };
        for parameter in schema.parameters.iter().filter(is_of_scene) {
            if of_it().any(|element| element.parameter(parameter.name) == 0.0) {
                let words = format!("{tag} has no effect where {} is 0", parameter.name);
                left_out(Which::Zero(parameter.name), words);
            }
        }
        for other in scene.forces.iter().map(|element| element.schema.tag).collect::<BTreeSet<_>>()
        {
            if other != tag {
                let words = format!("{tag} has no effect in scenes with {other}");
                left_out(Which::Beside(other), words);
            }
        }
        let is_shared = |end: usize| {
            let mut known = BTreeSet::new();
            let ends = of_it().filter_map(|element| element.pair()).map(|pair| pair[end]);
            ends.filter(|particle| !known.insert(*particle)).count() > 0
        };
        if is_shared(0) || is_shared(1) {
            let words = format!(
                "of several {tag} with the same first or second particle, the last alone acts on it"
            );
            add(whole, SceneRule::Scattered(tag), 2, words);
        }
        if of_it().count() > 1 {
            for (power, words) in [
                (-1, "is divided by the number of its elements"),
                (1, "is multiplied by the number of its elements"),
            ] {
                let words = format!("each {tag} {words}");
                add(whole, SceneRule::Counted(tag, power), 2, words);
            }
            for (last, which) in [(false, "first"), (true, "last")] {
                let words = format!("each {tag} has the parameters of the {which}");
                add(whole, SceneRule::ParametersOfOne { tag, name: None, last }, 2, words);
                for parameter in schema.parameters.iter().filter(|_| schema.parameters.len() > 1) {
                    let name = parameter.name;
                    let mut values = of_it().map(|element| element.parameter(name));
                    let one = values.next();
                    if values.any(|value| Some(value) != one) {
                        let words = format!("each {tag} has {name} of the {which}");
                        let rule = SceneRule::ParametersOfOne { tag, name: Some(name), last };
                        add(of_parameter(name), rule, 2, words);
                    }
                }
            }
            if of_it().all(|element| !element.particles.is_empty()) {
                let words = format!("each {tag} acts on the particles of the one before it");
                add(whole, SceneRule::ParticlesBefore(tag), 3, words);
            }
        }
        if scene.forces.len() > 1 {
            let is_pair = of_it().any(|element| element.pair().is_some());
            let ends: &[(Ends, &str)] = match is_pair {
                true => &[
                    (Ends::Same, " on its two particles"),
                    (Ends::First, " on its first particle"),
                    (Ends::Second, " on its second particle"),
                ],
                false => &[(Ends::Same, "")],
            };
            let orders = [
                (Order::File, "the elements before it"),
                (Order::First, "its own elements before it"),
                (
                    Order::Registry,
                    "its own elements before it and of forces before it in the hand-out",
                ),
                (Order::AfterFields, "its own elements before it and of all fields"),
                (Order::Last, "its own elements before it and of all other forces"),
            ];
            let is_new = |order: Order| order == Order::File || order.is_new(scene, tag);
            let new: Vec<(Order, &str)> =
                orders.into_iter().filter(|(order, _)| is_new(*order)).collect();
            let each = ends.iter().flat_map(|ends| new.iter().map(move |order| (ends, order)));
            for ((ends, on), (order, before)) in each {
                let words = format!("{tag} overwrites the forces{on} of {before}");
                add(whole, SceneRule::Overwrites(tag, *ends, None, *order), 2, words.clone());
                for (axis, name) in XY.iter().enumerate() {
                    let words = format!("{words}, along {name} alone");
                    add(whole, SceneRule::Overwrites(tag, *ends, Some(axis), *order), 3, words);
                }
            }
            for quantity in [Quantity::ByPosition, Quantity::ByVelocity] {
                let of_parts = terms.iter().filter(|term| term.has(quantity));
                let of_parts: Vec<Term> = of_parts.copied().collect();
                let Some(first) = of_parts.first() else { continue };
                let whole = name(Term { part: "", ..*first }, quantity);
                let words = format!("{whole} is assigned to its blocks, not added");
                add(Place::Jacobian(*first), SceneRule::Assigned(tag, quantity, false), 2, words);
                let over = |(order, before): (Order, &str)| match order {
                    Order::File => String::new(),
                    _ => format!(", over those of {before}"),
                };
                for order in new.iter().filter(|_| is_pair) {
                    let words = format!(
                        "{whole} is assigned to its blocks between the two particles, not added{}",
                        over(*order)
                    );
                    let rule = SceneRule::AssignedCross(tag, quantity, order.0);
                    add(Place::Jacobian(*first), rule, 2, words);
                }
                // Where a scene has no other force, another order makes no difference. Fields have no dF/dx, and those with a
                // dF/dv stand last in the hand-out.
                let is_other = |order: Order| match order {
                    Order::Registry => false,
                    Order::AfterFields => quantity == Quantity::ByVelocity,
                    _ => true,
                };
                for order in orders.iter().filter(|(order, _)| is_pair && is_other(*order)) {
                    let words = format!(
                        "{whole} is assigned to the blocks of each particle by itself, not added{}",
                        over(*order)
                    );
                    let rule = SceneRule::AssignedOwn(tag, quantity, None, None, order.0);
                    add(Place::Jacobian(*first), rule, 2, words);
                }
                if !is_pair {
                    let words = format!(
                        "{whole} is assigned to the diagonal of the matrix, over all that stands before it"
                    );
                    let rule = SceneRule::AssignedDiagonal(tag, quantity);
                    add(Place::Jacobian(*first), rule, 2, words);
                }
                for place in 0..if is_pair { 2 } else { 0 } {
                    let end = first.schema().stencil.particles()[place];
                    let block = format!("the block {end} {end}");
                    let entries = (0..4).map(|entry| Some([entry / 2, entry % 2]));
                    for entry in [None].into_iter().chain(entries) {
                        let which = match entry {
                            None => block.clone(),
                            Some([a, b]) => format!("the {}{} entry of {block}", XY[a], XY[b]),
                        };
                        let words = format!("{which} of {whole} is assigned, not added");
                        let rule =
                            SceneRule::AssignedOwn(tag, quantity, Some(place), entry, Order::File);
                        add(Place::Jacobian(*first), rule, 2 + u8::from(entry.is_some()), words);
                    }
                }
                if of_parts.len() > 1 {
                    let words =
                        format!("each part of {whole} is assigned to its blocks, not added");
                    let rule = SceneRule::Assigned(tag, quantity, true);
                    add(Place::Jacobian(*first), rule, 2, words);
                }
            }
        }
        let own: Vec<[usize; 2]> = of_it().filter_map(ForceElement::pair).collect();
        let is_of_edges = of_it().any(|element| element.edge.is_some());
        for (pick, what, is_there) in [
            (Pick::FirstTwo, "acts on particles 0 and 1", !is_of_edges),
            (Pick::Next, "acts on its first particle i and on i + 1", true),
            (
                Pick::NextAround,
                "acts on its first particle i and on i + 1, after the last on the first",
                true,
            ),
            (Pick::Previous, "acts on its second particle j and on j − 1", true),
            (Pick::Less, "acts on its first particle i and on j − 1", true),
            (Pick::First(0), "acts on particle 0 in the place of its first particle", true),
            (Pick::First(1), "acts on particle 0 in the place of its second particle", true),
            (Pick::Last(0), "acts on the last particle in the place of its first one", true),
            (Pick::Last(1), "acts on the last particle in the place of its second one", true),
            (Pick::OfFirst, "acts on the particles of the first one", true),
            (Pick::OfLast, "acts on the particles of the last one", true),
            (Pick::FirstEdge, "acts on the first edge, whatever its edge attribute", is_of_edges),
            (Pick::LastEdge, "acts on the last edge, whatever its edge attribute", is_of_edges),
        ] {
            let pairs = pick.pairs(scene, tag);
            let is_possible = pick == Pick::Less || pairs.iter().all(|[i, j]| i != j);
            if is_there && is_possible && pairs != own {
                let words = format!("each {tag} {what}");
                add(whole, SceneRule::Pairs(tag, pick), 2, words);
            }
        }
        if is_of_edges {
            for (beyond, words) in [
                (Beyond::Own, ""),
                (Beyond::None, "; those beyond the last edge have no effect"),
                (Beyond::First, "; after the last edge comes the first"),
            ] {
                if beyond == Beyond::Own || of_it().count() > scene.edges.len() {
                    let words = format!(
                        "each {tag} acts on the next edge, whatever its edge attribute{words}"
                    );
                    add(whole, SceneRule::RunningEdge(tag, beyond), 2, words);
                }
            }
            for parameter in schema.parameters {
                let name = parameter.name;
                let words = format!("{tag} reads {name} at the number of its edge, not its own");
                add(of_parameter(name), SceneRule::OfEdge(tag, name), 2, words);
            }
            for (end, what) in [(None, "a"), (Some(0), "its first"), (Some(1), "its second")] {
                let words =
                    format!("{tag} takes the number of its edge for that of {what} particle");
                add(whole, SceneRule::EdgeAsParticle(tag, end), 2, words);
            }
        }
        let is_like = |other: &&'static ForceSchema| {
            let stencil = other.stencil;
            other.tag != tag
                && other.exists_in(scene.dimension)
                && (stencil.is_field() || stencil.size() == 2 && schema.stencil.size() == 2)
                && Term::of(other).into_iter().all(|term| forms_of(term).is_some())
        };
        let others = simulator::force::REGISTRY.iter().map(|kind| &kind.schema);
        for other in others.filter(is_like) {
            let words = format!("each {tag} acts as a {} with its parameters as well", other.tag);
            add(whole, SceneRule::AlsoAs(tag, other.tag), 2, words);
        }
        for (misread, words) in Misread::all(schema) {
            add(whole, SceneRule::Misread(tag, misread), 2, format!("{tag} {words}"));
        }
        let is_cut = |name: &str| of_it().any(|element| element.parameter(name).fract() != 0.0);
        let of_scene = || schema.parameters.iter().filter(is_of_scene);
        if of_scene().filter(|parameter| is_cut(parameter.name)).count() > 1 {
            let words = format!("{tag} reads its numbers as integers");
            add(whole, SceneRule::Integers(tag), 2, words);
        }
        for parameter in of_scene() {
            let name = parameter.name;
            let place = of_parameter(name);
            let known = if name == "G" { &NEWTONS[..] } else { &[] };
            for value in [0.0, 1.0].iter().chain(known) {
                let words = format!("{tag} uses {name} = {}", decimal(*value));
                add(place, SceneRule::Parameter(tag, name, *value), 1, words);
            }
            if of_it().any(|element| element.pair().is_some()) {
                let words = format!("{tag} takes the initial distance of its particles for {name}");
                add(place, SceneRule::InitialDistance(tag, name, None), 2, words.clone());
                for (is_zero, is) in [(true, "is 0"), (false, "is not 0")] {
                    if of_it().any(|element| (element.parameter(name) == 0.0) == is_zero) {
                        let words = format!("{words} where that {is}");
                        add(place, SceneRule::InitialDistance(tag, name, Some(is_zero)), 2, words);
                    }
                }
            }
            for (sign, written) in [(1.0, ""), (-1.0, "−")] {
                if of_it().any(|element| element.parameter(name) * sign < 0.0) {
                    let words = format!("{tag} takes {written}|{name}| for {name}");
                    add(place, SceneRule::Signed(tag, name, sign), 2, words);
                }
            }
            let values = || of_it().map(|element| element.parameter(name));
            if is_cut(name) {
                let words = format!("{tag} reads {name} as an integer");
                add(place, SceneRule::Integer(tag, name), 2, words);
            }
            if values().any(|value| value == 0.0) && values().any(|value| value != 0.0)
                || values().all(|value| value == 0.0)
            {
                let words = format!("{tag} uses {name} = 1 where it is not given");
                add(place, SceneRule::Default(tag, name, 1.0), 2, words);
            }
            let given = of_it().skip_while(|element| element.parameter(name) == 0.0);
            if given.skip(1).any(|element| element.parameter(name) == 0.0) {
                let words = format!("{tag} without {name} takes that of the element before");
                add(place, SceneRule::Carried(tag, name), 2, words);
            }
            for other in of_scene().filter(|other| other.name != name) {
                // As where a ratio of critical damping is taken for the damping.
                for (number, factor) in [(1.0, ""), (2.0, "2 ")] {
                    let words = format!("{tag} takes {factor}{name} √{} for {name}", other.name);
                    let root = SceneRule::Root(tag, [name, other.name], number);
                    add(place, root, 3, words);
                }
                let words = format!("{tag} reads {} in the place of {name}", other.name);
                add(place, SceneRule::ParameterAs(tag, name, other.name), 2, words);
                if name < other.name {
                    let words = format!("{tag} reads {name} and {} each as the other", other.name);
                    add(whole, SceneRule::Exchanged(tag, [name, other.name]), 2, words);
                }
            }
        }
    }
    // Of rounds, masses and springs are tasks, and their scenes need not list forces.
    let is_of_task = |change: &Change| {
        use SceneRule::{FirstMass, IntegerMasses, Masses, NotFirstForce, NotLastForce, OneForce};
        let is_of_masses =
            matches!(change.effect, Effect::Scene(Masses(_) | FirstMass | IntegerMasses));
        let is_of_list = matches!(
            change.effect,
            Effect::Scene(NotFirstForce { .. } | NotLastForce { .. } | OneForce { .. })
        );
        let is_of_springs = matches!(change.place, Place::Force(Term { tag: "springforce", .. }));
        is_of_masses || is_of_list || is_of_springs
    };
    if is_of_rounds(scene) {
        all.retain(|change| !is_of_task(change));
    } else {
        all.extend(partly(&all, scene.integrator.name));
        all.extend(taken_as_fixed());
    }
    all
}
