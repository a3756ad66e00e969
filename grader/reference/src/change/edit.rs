//! Every formula that differs from a given one by one operation on one of its nodes.
//!
//! ```text
//! sum        a term is left out, has the other sign, counts twice or half
//! product    a factor is left out; one is added: a parameter, a mass, l, h, or its inverse
//! power      another exponent
//! number     twice or half
//! vector     n for d, v_i or v_i + v_j for v_i − v_j, n for w, …
//! matrix     a bᵀ for b aᵀ, a aᵀ for a bᵀ, I for R
//! scalar     one parameter or length for another; |x|, max(x, 0), min(x, 0) of a sum or a dot product
//! ```
//!
//! An edit that makes no sense evaluates to NaN and explains nothing.

use super::expression::{Expression, Function, Leaf};

/// A formula with one operation done to it.
#[derive(Debug, Clone)]
pub struct Edit {
    /// The changed formula.
    pub expression: Expression,
    /// The operation, in words that follow the name of the formula.
    pub words: String,
    /// How far-fetched it is: 0 is the most usual.
    pub rank: u8,
}

impl Edit {
    fn new(expression: Expression, words: String, rank: u8) -> Self {
        Self { expression, words, rank }
    }
}

/// All edits of `formula`; `scalars` are the quantities that may appear as a factor too many.
pub fn edits(formula: &Expression, scalars: &[Expression]) -> Vec<Edit> {
    let mut all = of_node(formula, scalars);
    // The root's factors change the whole formula.
    all.extend(of_children(formula, scalars));
    all
}

fn of_children(node: &Expression, scalars: &[Expression]) -> Vec<Edit> {
    let mut all = Vec::new();
    let mut below = |child: &Expression, with: &dyn Fn(Expression) -> Expression| {
        for edit in edits(child, scalars) {
            all.push(Edit { expression: with(edit.expression), ..edit });
        }
    };
    match node {
        Expression::Sum(terms) => {
            for (place, term) in terms.iter().enumerate() {
                below(term, &|new| Expression::Sum(replaced(terms, place, new)));
            }
        }
        Expression::Product(factors) => {
            for (place, factor) in factors.iter().enumerate() {
                below(factor, &|new| Expression::Product(replaced(factors, place, new)));
            }
        }
        Expression::Power(base, exponent) => {
            below(base, &|new| Expression::Power(Box::new(new), *exponent));
        }
        Expression::Dot(a, b) => {
            below(a, &|new| Expression::Dot(Box::new(new), b.clone()));
            below(b, &|new| Expression::Dot(a.clone(), Box::new(new)));
        }
        Expression::Outer(a, b) => {
            below(a, &|new| Expression::Outer(Box::new(new), b.clone()));
            below(b, &|new| Expression::Outer(a.clone(), Box::new(new)));
        }
        Expression::Transposed(inner) => {
            below(inner, &|new| Expression::Transposed(Box::new(new)));
        }
        Expression::Applied(function, inner) => {
            below(inner, &|new| Expression::Applied(*function, Box::new(new)));
        }
        Expression::Number(_) | Expression::Leaf(_) => {}
    }
    all
}

fn replaced(list: &[Expression], place: usize, new: Expression) -> Vec<Expression> {
    let mut list = list.to_vec();
    list[place] = new;
    list
}

fn without(list: &[Expression], place: usize) -> Vec<Expression> {
    let mut list = list.to_vec();
    list.remove(place);
    list
}

/// The edits of a node itself.
fn of_node(node: &Expression, scalars: &[Expression]) -> Vec<Edit> {
    let mut all = Vec::new();
    let instead = |new: &Expression| format!("has {new} in the place of {node}");
    let mut swap = |new: Expression, rank: u8| {
        let words = instead(&new);
        all.push(Edit::new(new, words, rank));
    };
    match node {
        Expression::Number(value) => {
            if value.abs() != 1.0 {
                swap(Expression::Number(value.signum()), 1);
            }
            for factor in [2.0, 0.5] {
                swap(Expression::Number(factor * value), 2);
            }
        }
        Expression::Leaf(leaf) => {
            for new in others(*leaf) {
                swap(new, 2);
            }
            if is_scalar(*leaf) {
                for other in scalars.iter().filter(|other| *other != node) {
                    swap(other.clone(), 3);
                }
            }
        }
        Expression::Power(base, exponent) => {
            for new in [exponent + 1, exponent - 1, -exponent, exponent + 2, exponent - 2] {
                if new == 0 || new == *exponent {
                    continue;
                }
                let new = match new {
                    1 => (**base).clone(),
                    new => Expression::Power(base.clone(), new),
                };
                swap(new, 2);
            }
        }
        Expression::Dot(a, b) => {
            clamps(node, &mut all);
            if a != b {
                let square =
                    |x: &Expression| Expression::Dot(Box::new(x.clone()), Box::new(x.clone()));
                for new in [square(a), square(b)] {
                    let words = instead(&new);
                    all.push(Edit::new(new, words, 3));
                }
            }
        }
        Expression::Outer(a, b) => {
            let outer = |a: &Expression, b: &Expression| {
                Expression::Outer(Box::new(a.clone()), Box::new(b.clone()))
            };
            if a != b {
                swap(outer(b, a), 1);
                swap(outer(a, a), 2);
                swap(outer(b, b), 2);
            }
            swap(Expression::Leaf(Leaf::Identity), 2);
            let across =
                Expression::Sum(vec![Expression::Leaf(Leaf::Identity), outer(a, b).negated()]);
            swap(across, 2);
        }
        Expression::Sum(terms) => {
            for (place, term) in terms.iter().enumerate() {
                let rest = match without(terms, place) {
                    mut one if one.len() == 1 => one.remove(0),
                    more => Expression::Sum(more),
                };
                all.push(Edit::new(rest, format!("lacks {}", bare(term)), 1));
                let with = |new: Expression| Expression::Sum(replaced(terms, place, new));
                let sign = with(term.clone().negated());
                let words = format!("has {} with the wrong sign", bare(term));
                all.push(Edit::new(sign, words, 1));
                for (factor, often) in [(2.0, "twice"), (0.5, "half")] {
                    let scaled =
                        Expression::Product(vec![Expression::Number(factor), term.clone()]);
                    let words = format!("has {} {often}", bare(term));
                    all.push(Edit::new(with(scaled), words, 2));
                }
            }
            clamps(node, &mut all);
        }
        Expression::Product(factors) => {
            for (place, factor) in factors.iter().enumerate() {
                if matches!(factor, Expression::Number(number) if *number == -1.0) {
                    continue;
                }
                let rest = Expression::Product(without(factors, place));
                all.push(Edit::new(rest, format!("lacks the factor {}", shown(factor)), 1));
            }
            for scalar in scalars {
                let with = |new: Expression| {
                    let mut factors = factors.clone();
                    factors.insert(0, new);
                    Expression::Product(factors)
                };
                let of = Expression::Product(factors.clone());
                let inverse = Expression::Power(Box::new(scalar.clone()), -1);
                let square = Expression::Power(Box::new(scalar.clone()), 2);
                let more = [
                    (scalar.clone(), format!("has {} multiplied by {scalar}", bare(&of)), 2),
                    (inverse, format!("has {} divided by {scalar}", bare(&of)), 2),
                    (square, format!("has {} multiplied by {scalar}²", bare(&of)), 3),
                ];
                for (factor, words, rank) in more {
                    all.push(Edit::new(with(factor), words, rank));
                }
            }
        }
        Expression::Transposed(_) | Expression::Applied(..) => {}
    }
    all
}

fn clamps(node: &Expression, all: &mut Vec<Edit>) {
    for function in [Function::Absolute, Function::Positive, Function::Negative] {
        let new = Expression::Applied(function, Box::new(node.clone()));
        let words = format!("has {new} in the place of {node}");
        all.push(Edit::new(new, words, 2));
    }
}

/// A term without its sign.
fn bare(term: &Expression) -> String {
    let text = term.to_string();
    let text = text.strip_prefix('−').unwrap_or(&text);
    text.to_owned()
}

/// A factor, in parentheses if it is a sum.
fn shown(factor: &Expression) -> String {
    if matches!(factor, Expression::Sum(_)) { format!("({factor})") } else { factor.to_string() }
}

fn is_scalar(leaf: Leaf) -> bool {
    matches!(leaf, Leaf::Parameter(..) | Leaf::Mass(_) | Leaf::Length)
}

/// Leaves and sums of leaves that are mistaken for this one.
fn others(leaf: Leaf) -> Vec<Expression> {
    let one = Expression::Leaf;
    match leaf {
        Leaf::Direction => vec![one(Leaf::Difference), one(Leaf::RelativeVelocity)],
        Leaf::Difference => vec![one(Leaf::Direction)],
        Leaf::RelativeVelocity => vec![
            one(Leaf::Velocity(0)),
            Expression::Sum(vec![one(Leaf::Velocity(0)), one(Leaf::Velocity(1))]),
            one(Leaf::Velocity(1)),
            one(Leaf::Velocity(1)).negated(),
            one(Leaf::Direction),
            one(Leaf::Difference),
        ],
        Leaf::Turn => vec![one(Leaf::Identity), Expression::Transposed(Box::new(one(Leaf::Turn)))],
        Leaf::Mass(0) => vec![one(Leaf::Mass(1))],
        Leaf::Mass(_) => vec![one(Leaf::Mass(0))],
        Leaf::Parameter(..)
        | Leaf::Length
        | Leaf::TimeStep
        | Leaf::Velocity(_)
        | Leaf::Speed
        | Leaf::Identity
        | Leaf::Field => Vec::new(),
    }
}
