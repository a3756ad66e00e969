//! The laws and their Jacobians as formulas, written from the documents.
//!
//! A formula that programs write in several ways has several forms: a factor that one form has, another lacks, and each
//! can be forgotten. A test compares every form with [`law`](reference::law).

use scene::schema::ForceSchema;

use super::Term;
use super::expression::{Expression, Leaf};

/// The formulas of a part of a force; several entries are the same formula written differently.
pub struct Forms {
    /// The force on `i`.
    pub force: Vec<Expression>,
    /// Its derivative by `x_i`; empty where it is zero.
    pub by_position: Vec<Expression>,
    /// Its derivative by `v_i`; empty where it is zero.
    pub by_velocity: Vec<Expression>,
}

fn number(value: f64) -> Expression {
    Expression::Number(value)
}

fn times(factors: impl IntoIterator<Item = Expression>) -> Expression {
    Expression::Product(factors.into_iter().collect())
}

fn plus(terms: impl IntoIterator<Item = Expression>) -> Expression {
    Expression::Sum(terms.into_iter().collect())
}

fn minus(expression: Expression) -> Expression {
    expression.negated()
}

fn power(base: Expression, exponent: i32) -> Expression {
    Expression::Power(Box::new(base), exponent)
}

fn dot(a: Leaf, b: Leaf) -> Expression {
    Expression::Dot(Box::new(Expression::Leaf(a)), Box::new(Expression::Leaf(b)))
}

fn outer(a: Leaf, b: Leaf) -> Expression {
    Expression::Outer(Box::new(Expression::Leaf(a)), Box::new(Expression::Leaf(b)))
}

const L: Expression = Expression::Leaf(Leaf::Length);
const D: Expression = Expression::Leaf(Leaf::Difference);
const N: Expression = Expression::Leaf(Leaf::Direction);
const W: Expression = Expression::Leaf(Leaf::RelativeVelocity);
const I: Expression = Expression::Leaf(Leaf::Identity);
const R: Expression = Expression::Leaf(Leaf::Turn);

fn nn() -> Expression {
    outer(Leaf::Direction, Leaf::Direction)
}

fn across() -> Expression {
    plus([I, minus(nn())])
}

/// The forms of a part, by the force and the part's name; `None` where none is written here.
pub fn of(schema: &ForceSchema, part: &str) -> Option<Forms> {
    formulas(schema.tag, part, schema)
}

/// The forms of `term` with the parameters of another force by their names; `None` where it lacks one.
pub(super) fn of_parameters(term: Term, schema: &ForceSchema) -> Option<Forms> {
    formulas(term.tag, term.part, schema)
}

fn formulas(tag: &str, part: &str, schema: &ForceSchema) -> Option<Forms> {
    let p =
        |name: &'static str| Expression::Leaf(Leaf::Parameter(schema.parameter_idx(name), name));
    let mass = |side: usize| Expression::Leaf(Leaf::Mass(side));
    let none = Vec::new;
    Some(match (tag, part) {
        ("simplegravity", _) => Forms {
            force: vec![times([mass(0), Expression::Leaf(Leaf::Field)])],
            by_position: none(),
            by_velocity: none(),
        },
        ("constantforce", _) => Forms {
            force: vec![times([Expression::Leaf(Leaf::Field)])],
            by_position: none(),
            by_velocity: none(),
        },
        ("dragdamping", _) => Forms {
            force: vec![times([number(-1.0), p("b"), Expression::Leaf(Leaf::Velocity(0))])],
            by_position: none(),
            by_velocity: vec![times([number(-1.0), p("b"), I])],
        },
        ("massdamping", _) => Forms {
            force: vec![times([
                number(-1.0),
                p("alpha"),
                mass(0),
                Expression::Leaf(Leaf::Velocity(0)),
            ])],
            by_position: none(),
            by_velocity: vec![times([number(-1.0), p("alpha"), mass(0), I])],
        },
        ("springforce", "elastic") => elastic(&[p("k")], &p("l0")),
        ("elasticbodyspringforce", _) => elastic(&[p("alpha"), power(p("l0"), -1)], &p("l0")),
        ("springforce", "damping") => {
            let closing = || dot(Leaf::Direction, Leaf::RelativeVelocity);
            let turning =
                || plus([times([closing(), I]), outer(Leaf::Direction, Leaf::RelativeVelocity)]);
            let by_length = || power(L, -1);
            Forms {
                force: vec![times([number(-1.0), p("b"), closing(), N])],
                by_position: vec![
                    times([number(-1.0), p("b"), by_length(), turning(), across()]),
                    // The derivative of n·w, then that of n.
                    plus([
                        times([
                            number(-1.0),
                            p("b"),
                            by_length(),
                            outer(Leaf::Direction, Leaf::RelativeVelocity),
                            across(),
                        ]),
                        times([number(-1.0), p("b"), by_length(), closing(), across()]),
                    ]),
                ],
                by_velocity: vec![times([number(-1.0), p("b"), nn()])],
            }
        }
        ("gravitationalforce", _) => {
            let masses = || [p("G"), mass(0), mass(1)];
            let strength = |exponent: i32| {
                let mut factors = vec![number(-1.0)];
                factors.extend(masses());
                factors.push(power(L, exponent));
                factors
            };
            let with = |mut factors: Vec<Expression>, last: Expression| {
                factors.push(last);
                Expression::Product(factors)
            };
            Forms {
                force: vec![with(strength(-2), N), with(strength(-3), D)],
                by_position: vec![with(strength(-3), plus([I, times([number(-3.0), nn()])]))],
                by_velocity: none(),
            }
        }
        ("vortexforce", _) => {
            let swirl = plus([R, times([number(-3.0), R, nn()])]);
            let viscous = outer(Leaf::RelativeVelocity, Leaf::Direction);
            Forms {
                force: vec![times([
                    p("kvc"),
                    power(L, -2),
                    plus([times([p("kbs"), R, N]), minus(W)]),
                ])],
                by_position: vec![times([
                    p("kvc"),
                    power(L, -3),
                    plus([times([p("kbs"), swirl]), times([number(2.0), viscous])]),
                ])],
                by_velocity: vec![times([number(-1.0), p("kvc"), power(L, -2), I])],
            }
        }
        ("greenspringforce", _) => {
            let ratio = || times([power(L, 2), power(p("l0"), -2)]);
            let strain = || plus([ratio(), number(-1.0)]);
            Forms {
                force: vec![times([number(-2.0), p("k"), strain(), D])],
                by_position: vec![times([
                    number(-2.0),
                    p("k"),
                    plus([times([strain(), I]), times([number(2.0), ratio(), nn()])]),
                ])],
                by_velocity: none(),
            }
        }
        _ => return None,
    })
}

/// A spring's, of a stiffness that is a product.
fn elastic(stiffness: &[Expression], l0: &Expression) -> Forms {
    let l0 = || l0.clone();
    let scaled = |last: &[Expression]| times([&[number(-1.0)], stiffness, last].concat());
    let strain = || plus([L, minus(l0())]);
    let relative = || times([strain(), power(L, -1)]);
    let shrunk = times([plus([number(1.0), minus(times([l0(), power(L, -1)]))]), I]);
    Forms {
        force: vec![scaled(&[strain(), N])],
        by_position: vec![
            scaled(&[plus([nn(), times([relative(), across()])])]),
            scaled(&[plus([shrunk, times([l0(), power(L, -1), nn()])])]),
            scaled(&[plus([I, minus(times([l0(), power(L, -1), across()]))])]),
        ],
        by_velocity: Vec::new(),
    }
}
