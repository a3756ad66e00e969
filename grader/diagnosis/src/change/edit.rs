//! Every formula that differs from a given one by one operation on one of its nodes.
//!
//! ```text
//! sum        a term is left out, has the other sign, counts twice or half, or is subtracted and stands alone; the number
//!            before a term stands before the sum
//! product    a factor is left out, or two parameters or masses; one is added: a parameter, a mass, l, h, or its inverse;
//!            a projection is left out, or the one across; the sum, the mean or the integer part of the product of two
//!            masses; the parentheses around a sum are missing
//! power      another exponent
//! number     twice or half, one more or less
//! vector     n for d, v_i or v_i + v_j for v_i − v_j, n for w, …
//! matrix     a bᵀ for b aᵀ, a aᵀ for a bᵀ, I for R; entries off the diagonal with the other sign, or left out; one entry
//!            of a bᵀ left out, with the other sign, or in the place of another
//! component  one component of a vector left out, with the other sign, or in the place of the other; both exchanged
//! scalar     one parameter or length for another, or another norm; |x|, max(x, 0), min(x, 0), x², x²/2 of a sum or a dot
//!            product; one component for a dot product
//! leaves     all equal ones at once: d in the place of each n
//! numbered   a limit, a number added to a length or to 1/x, another angle, a factor 1 + c x: the steps determine c
//! ```
//!
//! An edit that makes no sense evaluates to NaN and explains nothing.

use super::Axes;
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

/// `formula` with another leaf in the place of each of several equal ones.
pub fn of_all_leaves(formula: &Expression) -> Vec<Edit> {
    let mut known: Vec<(Leaf, usize)> = Vec::new();
    let leaves = nodes(formula).into_iter().filter_map(|(node, _)| match node {
        Expression::Leaf(leaf) => Some(leaf),
        _ => None,
    });
    for leaf in leaves {
        match known.iter_mut().find(|(one, _)| *one == leaf) {
            Some((_, count)) => *count += 1,
            None => known.push((leaf, 1)),
        }
    }
    let several = known.into_iter().filter(|(_, count)| *count > 1);
    let of = |(leaf, _): (Leaf, usize)| {
        others(leaf).into_iter().map(move |new| {
            let words = format!("has {new} in the place of each {}", Expression::Leaf(leaf));
            Edit::new(with_leaf(formula, leaf, &new), words, 2)
        })
    };
    several.flat_map(of).collect()
}

/// `node` with `new` in the place of each such leaf.
fn with_leaf(node: &Expression, leaf: Leaf, new: &Expression) -> Expression {
    let of = |inner: &Expression| with_leaf(inner, leaf, new);
    let boxed = |inner: &Expression| Box::new(of(inner));
    match node {
        Expression::Leaf(one) if *one == leaf => new.clone(),
        Expression::Sum(parts) => Expression::Sum(parts.iter().map(of).collect()),
        Expression::Product(parts) => Expression::Product(parts.iter().map(of).collect()),
        Expression::Power(base, exponent) => Expression::Power(boxed(base), *exponent),
        Expression::Dot(a, b) => Expression::Dot(boxed(a), boxed(b)),
        Expression::Outer(a, b) => Expression::Outer(boxed(a), boxed(b)),
        Expression::Transposed(inner) => Expression::Transposed(boxed(inner)),
        Expression::Applied(function, inner) => Expression::Applied(*function, boxed(inner)),
        Expression::Components(axes, inner) => Expression::Components(*axes, boxed(inner)),
        Expression::Number(_) | Expression::Leaf(_) => node.clone(),
    }
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
            // The base may stand in the formula once more.
            let of_base = format!(" in the place of {base}");
            for edit in all.iter_mut().filter(|edit| edit.words.ends_with(&of_base)) {
                edit.words = format!("has {} in the place of {node}", edit.expression);
            }
        }
        Expression::Dot(a, b) => {
            below(a, &|new| Expression::Dot(Box::new(new), b.clone()));
            below(b, &|new| Expression::Dot(a.clone(), Box::new(new)));
            // The vector may stand in the formula once more.
            for edit in all.iter_mut().filter(|edit| edit.words.contains("component")) {
                edit.words.push_str(&format!(" in {node}"));
            }
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
        Expression::Components(axes, inner) => {
            below(inner, &|new| Expression::Components(*axes, Box::new(new)));
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

/// Single entries of a block of this name left out, with the other sign, or in the place of others, in words that follow the
/// name of what has it.
pub(super) fn of_entries(block: &str) -> Vec<(Axes, String)> {
    let entries = || (0..4).map(|place| [place / 2, place % 2]);
    let name = |entry: [usize; 2]| entry.map(|axis| ["x", "y"][axis]).concat();
    let mut all = Vec::new();
    for to in entries() {
        let its = name(to);
        all.push((Axes::Entry(to, 0.0), format!("lacks the {its} entry of {block}")));
        let words = format!("has the {its} entry of {block} with the wrong sign");
        all.push((Axes::Entry(to, -1.0), words));
        for from in entries().filter(|from| *from != to) {
            let words =
                format!("has the {} entry of {block} in the place of the {its} entry", name(from));
            all.push((Axes::EntryCopied(from, to), words));
        }
    }
    all
}

/// A vector or a matrix with other components, as where each is written by itself.
fn of_components(node: &Expression) -> Vec<Edit> {
    let with = |axes: Axes, words: String| {
        let expression = Expression::Components(axes, Box::new(node.clone()));
        Edit::new(expression, words, 3)
    };
    let names = ["x", "y"];
    let mut all = Vec::new();
    match node {
        Expression::Leaf(
            Leaf::Difference
            | Leaf::Direction
            | Leaf::RelativeVelocity
            | Leaf::Velocity(_)
            | Leaf::Field,
        ) => {
            for (axis, other) in [(0, 1), (1, 0)] {
                let [name, from] = [axis, other].map(|axis| names[axis]);
                let negative = format!("has the {name} component of {node} with the wrong sign");
                let copied = format!(
                    "has the {from} component of {node} in the place of its {name} component"
                );
                all.push(with(Axes::Scaled(axis, -1.0), negative));
                all.push(with(Axes::Not(axis), format!("lacks the {name} component of {node}")));
                all.push(with(Axes::Copied(other, axis), copied));
            }
            all.push(with(
                Axes::Swapped,
                format!("has the x and y components of {node} exchanged"),
            ));
            if *node == Expression::Leaf(Leaf::RelativeVelocity) {
                let [of_i, of_j] = [0, 1].map(|end| Expression::Leaf(Leaf::Velocity(end)));
                let sum = Expression::Sum(vec![of_i.clone(), of_j.clone()]);
                for (new, axis) in [sum, of_i, of_j].iter().flat_map(|new| [(new, 0), (new, 1)]) {
                    let parts = [(node, axis), (new, 1 - axis)].map(|(of, not)| {
                        Expression::Components(Axes::Not(not), Box::new(of.clone()))
                    });
                    let words = format!("has {new} in the place of {node} along {}", names[axis]);
                    all.push(Edit::new(Expression::Sum(parts.to_vec()), words, 3));
                }
            }
            let by_size = Expression::Applied(Function::BySize, Box::new(node.clone()));
            let words = format!("has each component of {node} multiplied by its size");
            all.push(Edit::new(by_size, words, 3));
        }
        Expression::Outer(..) => {
            let negative =
                format!("has the entries off the diagonal of {node} with the wrong sign");
            all.push(with(Axes::CrossNegated, negative));
            let diagonal = format!("lacks the entries off the diagonal of {node}");
            all.push(with(Axes::Diagonal, diagonal));
            all.push(with(
                Axes::Filled,
                format!("has each row of {node} filled with its diagonal entry"),
            ));
            all.extend(
                of_entries(&node.to_string()).into_iter().map(|(axes, words)| with(axes, words)),
            );
        }
        Expression::Leaf(Leaf::Identity) => {
            all.push(with(Axes::Filled, "has 1 in all entries of the identity".to_owned()));
            for (axis, name) in names.into_iter().enumerate() {
                let words = format!("lacks the {name}{name} entry of the identity");
                all.push(with(Axes::Entry([axis; 2], 0.0), words));
            }
        }
        Expression::Sum(_) if !node.is_number() => {
            let negative =
                format!("has the entries off the diagonal of {node} with the wrong sign");
            all.push(with(Axes::CrossNegated, negative));
        }
        _ => {}
    }
    all
}

/// The edits of a node itself.
fn of_node(node: &Expression, scalars: &[Expression]) -> Vec<Edit> {
    let mut all = of_components(node);
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
            for new in [value + 1.0, value - 1.0] {
                if value.abs() > 2.0 || new == 3.0 * value.signum() {
                    swap(Expression::Number(new), 2);
                }
            }
        }
        Expression::Leaf(leaf) => {
            for new in others(*leaf) {
                swap(new, 2);
            }
            if is_scalar(*leaf) {
                let is_parameter =
                    |one: &Expression| matches!(one, Expression::Leaf(Leaf::Parameter(..)));
                for other in scalars.iter().filter(|other| *other != node) {
                    let is_usual = is_parameter(node) && is_parameter(other);
                    swap(other.clone(), if is_usual { 2 } else { 3 });
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
            energies(node, &mut all);
            for axis in 0..2 {
                let unit = Box::new(Expression::Leaf(Leaf::Axis(axis)));
                let new = Expression::Dot(b.clone(), unit);
                let words = format!("has {new} in the place of {node}");
                all.push(Edit::new(new, words, 3));
            }
            if a != b {
                let square =
                    |x: &Expression| Expression::Dot(Box::new(x.clone()), Box::new(x.clone()));
                let size =
                    |x: &Expression| Expression::Applied(Function::Size, Box::new(x.clone()));
                for new in [square(a), square(b), size(a), size(b)] {
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
            // The other terms of a formula may hold the same ones as I − n nᵀ.
            let has_identity = terms.contains(&Expression::Leaf(Leaf::Identity));
            let of = if has_identity { format!(" of {node}") } else { String::new() };
            for (place, term) in terms.iter().enumerate() {
                let rest = match without(terms, place) {
                    mut one if one.len() == 1 => one.remove(0),
                    more => Expression::Sum(more),
                };
                all.push(Edit::new(rest, format!("lacks {}{of}", bare(term)), 1));
                let with = |new: Expression| Expression::Sum(replaced(terms, place, new));
                let sign = with(term.clone().negated());
                let words = format!("has {}{of} with the wrong sign", bare(term));
                all.push(Edit::new(sign, words, 1));
                for (factor, often) in [(2.0, "twice"), (0.5, "half")] {
                    let scaled =
                        Expression::Product(vec![Expression::Number(factor), term.clone()]);
                    let words = format!("has {} {often}", bare(term));
                    all.push(Edit::new(with(scaled), words, 2));
                }
            }
            // A number before a term is put before the sum.
            for (place, term) in terms.iter().enumerate() {
                let Expression::Product(factors) = term else { continue };
                let Some(Expression::Number(number)) = factors.first() else { continue };
                if number.abs() != 1.0 {
                    let sign = Expression::Number(number.signum());
                    let plain = Expression::Product(replaced(factors, 0, sign));
                    let sum = Expression::Sum(replaced(terms, place, plain));
                    let new = Expression::Product(vec![Expression::Number(number.abs()), sum]);
                    let words = instead(&new);
                    all.push(Edit::new(new, words, 2));
                }
            }
            if let [a, b] = terms.as_slice() {
                for negative in [a, b].into_iter().filter(|term| term.to_string().starts_with('−'))
                {
                    let words = format!("has {} in the place of {node}", bare(negative));
                    all.push(Edit::new(negative.clone().negated(), words, 2));
                }
            }
            clamps(node, &mut all);
            if node.is_number() {
                energies(node, &mut all);
            }
            if node.is_number()
                && let Some(place) = terms.iter().position(is_length)
            {
                let squared = Expression::Power(Box::new(terms[place].clone()), 2);
                let new = Expression::Sum(replaced(terms, place, squared));
                all.push(Edit::new(new.clone(), instead(&new), 2));
                let square = |term: &Expression| match term {
                    Expression::Product(factors) => {
                        let of = |factor: &Expression| match factor {
                            Expression::Number(_) => factor.clone(),
                            _ => Expression::Power(Box::new(factor.clone()), 2),
                        };
                        Expression::Product(factors.iter().map(of).collect())
                    }
                    term => Expression::Power(Box::new(term.clone()), 2),
                };
                let new = Expression::Sum(terms.iter().map(square).collect());
                let words = instead(&new);
                all.push(Edit::new(new, words, 2));
            }
        }
        Expression::Product(factors) => {
            let is_ratio = |factor: &Expression| matches!(factor, Expression::Power(_, -1));
            if let Some(place) = factors.iter().position(is_ratio)
                && let Expression::Power(below, _) = &factors[place]
                && let Some(above) = place.checked_sub(1)
                && matches!(&factors[above], Expression::Leaf(leaf) if is_scalar(*leaf))
            {
                let inverse = Expression::Power(Box::new(factors[above].clone()), -1);
                let turned = replaced(factors, place, inverse);
                let new = Expression::Product(replaced(&turned, above, (**below).clone()));
                let words = instead(&new);
                all.push(Edit::new(new, words, 2));
            }
            let is_matrix = |factor: &&Expression| factor.is_matrix();
            if factors.iter().filter(is_matrix).count() > 1 {
                let whole = Box::new(Expression::Product(factors.clone()));
                let new = Expression::Applied(Function::EntryByEntry, whole);
                let words = "multiplies its matrices entry by entry".to_owned();
                all.push(Edit::new(new, words, 2));
            }
            let pairs = (0..factors.len()).flat_map(|b| (0..b).map(move |a| (a, b)));
            for (a, b) in pairs.filter(|(a, b)| is_symbol(&factors[*a]) && is_symbol(&factors[*b]))
            {
                let rest = Expression::Product(without(&without(factors, b), a));
                let words = format!("lacks the factors {} and {}", factors[a], factors[b]);
                all.push(Edit::new(rest, words, 2));
                if [a, b].iter().all(|one| matches!(factors[*one], Expression::Leaf(Leaf::Mass(_))))
                {
                    let both = vec![factors[a].clone(), factors[b].clone()];
                    let product = Expression::Product(both.clone());
                    let sum = Expression::Sum(both);
                    let mean = Expression::Product(vec![Expression::Number(0.5), sum.clone()]);
                    let cut = Expression::Applied(Function::Truncated, Box::new(product.clone()));
                    for new in [sum, mean, cut] {
                        let words = format!("has {new} in the place of {product}");
                        let whole = without(&replaced(factors, a, new), b);
                        all.push(Edit::new(Expression::Product(whole), words, 2));
                    }
                }
            }
            // The parentheses around a sum are missing.
            let pairs =
                (1..factors.len()).flat_map(|place| [(place - 1, place), (place, place - 1)]);
            for (of_by, place) in pairs {
                let (by, Expression::Sum(terms)) = (&factors[of_by], &factors[place]) else {
                    continue;
                };
                let divides = matches!(by, Expression::Power(_, -1));
                let is_first = of_by < place;
                if !(is_symbol(by) || divides && !is_first) || !factors[place].is_number() {
                    continue;
                }
                let pair = &factors[of_by.min(place)..=of_by.max(place)];
                let product = Expression::Product(pair.to_vec());
                // A factor after the sum multiplies its last term.
                let last = terms.len() - 1;
                for number in if is_first { vec![0, last] } else { vec![last] } {
                    let scaled = match &terms[number] {
                        Expression::Product(inner) => inner.iter().chain([by]).cloned().collect(),
                        term => vec![by.clone(), term.clone()],
                    };
                    let new = Expression::Sum(replaced(terms, number, Expression::Product(scaled)));
                    let words = format!("has {new} in the place of {product}");
                    let whole = without(&replaced(factors, place, new), of_by);
                    all.push(Edit::new(Expression::Product(whole), words, 2));
                }
            }
            for (place, factor) in factors.iter().enumerate() {
                if matches!(factor, Expression::Number(number) if *number == -1.0) {
                    continue;
                }
                let rest = Expression::Product(without(factors, place));
                all.push(Edit::new(rest, format!("lacks the factor {}", shown(factor)), 1));
                // (a·b) a is b along a.
                let Expression::Dot(a, b) = factor else { continue };
                let Some(along) = factors.iter().position(|other| other == &**a) else { continue };
                let whole = without(&replaced(factors, along, (**b).clone()), place);
                let words = format!("has {b} in the place of its part along {a}");
                all.push(Edit::new(Expression::Product(whole), words, 1));
                let part = Expression::Product(vec![factor.clone(), (**a).clone()]);
                let across = Expression::Sum(vec![(**b).clone(), part.negated()]);
                let whole = without(&replaced(factors, along, across), place);
                let words = format!("has the part of {b} across {a} in the place of that along it");
                all.push(Edit::new(Expression::Product(whole), words, 2));
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
        Expression::Transposed(_) | Expression::Applied(..) | Expression::Components(..) => {}
    }
    all
}

/// Whether it is a parameter or a mass.
fn is_symbol(factor: &Expression) -> bool {
    matches!(factor, Expression::Leaf(Leaf::Parameter(..) | Leaf::Mass(_)))
}

/// Whether it is the length, with any sign.
fn is_length(term: &Expression) -> bool {
    matches!(term, Expression::Leaf(Leaf::Length))
}

fn clamps(node: &Expression, all: &mut Vec<Edit>) {
    for function in [Function::Absolute, Function::Positive, Function::Negative] {
        let new = Expression::Applied(function, Box::new(node.clone()));
        let words = format!("has {new} in the place of {node}");
        all.push(Edit::new(new, words, 2));
    }
}

/// The square, and the half of it: the energy where its derivative belongs.
fn energies(node: &Expression, all: &mut Vec<Edit>) {
    let square = Expression::Power(Box::new(node.clone()), 2);
    let half = Expression::Product(vec![Expression::Number(0.5), square.clone()]);
    for (new, factor) in [(half, "0.5 "), (square, "")] {
        let words = format!("has {factor}({node})² in the place of {node}");
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
    let over = |length: Leaf| {
        let inverse = Expression::Power(Box::new(one(length)), -1);
        Expression::Product(vec![one(Leaf::Difference), inverse])
    };
    match leaf {
        Leaf::Direction => vec![
            one(Leaf::Difference),
            one(Leaf::RelativeVelocity),
            over(Leaf::SumLength),
            over(Leaf::LargestLength),
        ],
        Leaf::Length => vec![one(Leaf::SumLength), one(Leaf::LargestLength)],
        Leaf::Difference => vec![one(Leaf::Direction)],
        Leaf::RelativeVelocity => {
            let mut all = vec![
                one(Leaf::Velocity(0)),
                Expression::Sum(vec![one(Leaf::Velocity(0)), one(Leaf::Velocity(1))]),
                one(Leaf::Velocity(1)),
                one(Leaf::Velocity(1)).negated(),
                one(Leaf::Direction),
                one(Leaf::Difference),
            ];
            let copied = |side: usize, from: usize| {
                let of = Box::new(one(Leaf::Velocity(side)));
                Expression::Components(Axes::Copied(from, 1 - from), of)
            };
            for from in [0, 1] {
                let second = copied(1, from).negated();
                all.push(Expression::Sum(vec![one(Leaf::Velocity(0)), second]));
                let first = copied(0, from);
                all.push(Expression::Sum(vec![first, one(Leaf::Velocity(1)).negated()]));
            }
            all
        }
        Leaf::Turn => vec![one(Leaf::Identity), Expression::Transposed(Box::new(one(Leaf::Turn)))],
        Leaf::Mass(0) => vec![one(Leaf::Mass(1))],
        Leaf::Mass(_) => vec![one(Leaf::Mass(0))],
        Leaf::Parameter(..)
        | Leaf::SumLength
        | Leaf::LargestLength
        | Leaf::Axis(_)
        | Leaf::TimeStep
        | Leaf::Velocity(_)
        | Leaf::Speed
        | Leaf::Identity
        | Leaf::Field => Vec::new(),
    }
}

/// The numbers in `formula`: sums, and dot products.
pub fn numbers_in(formula: &Expression) -> Vec<Expression> {
    let is_one = |node: &Expression| {
        matches!(node, Expression::Sum(_) | Expression::Dot(..)) && node.is_number()
    };
    nodes(formula).into_iter().map(|(node, _)| node).filter(is_one).collect()
}

/// A formula with another node in the place of one.
type Replacing = Box<dyn Fn(Expression) -> Expression + Send + Sync>;

/// Every node, with the formula around it.
fn nodes(formula: &Expression) -> Vec<(Expression, Replacing)> {
    let mut all: Vec<(Expression, Replacing)> = vec![(formula.clone(), Box::new(|new| new))];
    let mut below = |child: &Expression,
                     around: fn(&Expression, usize, Expression) -> Expression,
                     place: usize| {
        for (node, replacing) in nodes(child) {
            let whole = formula.clone();
            all.push((node, Box::new(move |new| around(&whole, place, replacing(new)))));
        }
    };
    match formula {
        Expression::Sum(parts) | Expression::Product(parts) => {
            for (place, part) in parts.iter().enumerate() {
                below(part, with_part, place);
            }
        }
        Expression::Power(base, _) => below(base, with_part, 0),
        Expression::Dot(a, b) | Expression::Outer(a, b) => {
            below(a, with_part, 0);
            below(b, with_part, 1);
        }
        Expression::Transposed(inner)
        | Expression::Applied(_, inner)
        | Expression::Components(_, inner) => below(inner, with_part, 0),
        Expression::Number(_) | Expression::Leaf(_) => {}
    }
    all
}

/// `whole` with another one of its parts.
fn with_part(whole: &Expression, place: usize, new: Expression) -> Expression {
    let new = |old: &Expression, number: usize| {
        Box::new(if number == place { new.clone() } else { old.clone() })
    };
    match whole {
        Expression::Sum(parts) => {
            Expression::Sum(replaced(parts, place, *new(&parts[place], place)))
        }
        Expression::Product(parts) => {
            Expression::Product(replaced(parts, place, *new(&parts[place], place)))
        }
        Expression::Power(base, exponent) => Expression::Power(new(base, 0), *exponent),
        Expression::Dot(a, b) => Expression::Dot(new(a, 0), new(b, 1)),
        Expression::Outer(a, b) => Expression::Outer(new(a, 0), new(b, 1)),
        Expression::Transposed(inner) => Expression::Transposed(new(inner, 0)),
        Expression::Applied(function, inner) => Expression::Applied(*function, new(inner, 0)),
        Expression::Components(axes, inner) => Expression::Components(*axes, new(inner, 0)),
        Expression::Number(_) | Expression::Leaf(_) => whole.clone(),
    }
}

/// A formula with a number in it that the steps determine.
pub struct NumberedEdit {
    /// The formula with this number.
    pub with: Box<dyn Fn(f64) -> Expression + Send + Sync>,
    /// The operation in words, with the number as text.
    pub words: Box<dyn Fn(&str) -> String + Send + Sync>,
    /// Whether the number is an angle in degrees; otherwise it is positive.
    pub is_angle: bool,
}

/// All edits of `formula` with a number; `scalars` are the quantities that it may depend on besides.
pub fn numbered(formula: &Expression, scalars: &[Expression]) -> Vec<NumberedEdit> {
    let mut all = Vec::new();
    let mut add = |with: Replacing,
                   node: String,
                   is_angle: bool,
                   words: &'static str,
                   of: fn(&Expression, f64) -> Expression,
                   old: Expression| {
        all.push(NumberedEdit {
            with: Box::new(move |number| with(of(&old, number))),
            words: Box::new(move |number| words.replace("{node}", &node).replace("{c}", number)),
            is_angle,
        });
    };
    for (node, with) in nodes(formula) {
        let name = shown(&node);
        if *formula == node {
            let words = "is limited to a size of {c}";
            add(with, name, false, words, at_most, node);
            continue;
        }
        let is_own = matches!(node, Expression::Sum(_) | Expression::Dot(..));
        match &node {
            Expression::Leaf(Leaf::Length) => {
                add(with, name, false, "has an l of at least {c} in one place", at_least, node);
            }
            Expression::Leaf(Leaf::Turn) => {
                add(with, name, true, "is turned by {c} degrees, not 90", turned, node);
            }
            Expression::Power(_, exponent) if *exponent < 0 => {
                add(
                    with,
                    name,
                    false,
                    "has {c} added to the denominator of {node}",
                    softened,
                    node,
                );
            }
            _ if is_own && node.is_number() => {
                add(with, name, false, "has {node} limited to {c}", at_most, node);
            }
            _ => {}
        }
    }
    for scalar in scalars {
        for (power, words) in
            [(1, "is multiplied by 1 + {c} {node}"), (-1, "is divided by 1 + {c} {node}")]
        {
            let (whole, of) = (formula.clone(), scalar.clone());
            let name = shown(scalar);
            all.push(NumberedEdit {
                with: Box::new(move |number| {
                    let product = Expression::Product(vec![Expression::Number(number), of.clone()]);
                    let sum = Expression::Sum(vec![Expression::Number(1.0), product]);
                    Expression::Product(vec![
                        Expression::Power(Box::new(sum), power),
                        whole.clone(),
                    ])
                }),
                words: Box::new(move |number| {
                    words
                        .replace("{c}", number)
                        .replace("+ 1 {node}", "+ {node}")
                        .replace("{node}", &name)
                }),
                is_angle: false,
            });
        }
    }
    all
}

fn at_most(node: &Expression, number: f64) -> Expression {
    Expression::Applied(Function::AtMost(number), Box::new(node.clone()))
}

fn at_least(node: &Expression, number: f64) -> Expression {
    Expression::Applied(Function::AtLeast(number), Box::new(node.clone()))
}

/// The rotation by an angle in degrees.
fn turned(node: &Expression, degrees: f64) -> Expression {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let times =
        |number: f64, of: Expression| Expression::Product(vec![Expression::Number(number), of]);
    Expression::Sum(vec![times(cos, Expression::Leaf(Leaf::Identity)), times(sin, node.clone())])
}

/// `1/(x + c)` for `1/x`.
fn softened(node: &Expression, number: f64) -> Expression {
    let Expression::Power(base, exponent) = node else { return node.clone() };
    let inverse = match -exponent {
        1 => (**base).clone(),
        exponent => Expression::Power(base.clone(), exponent),
    };
    let sum = Expression::Sum(vec![inverse, Expression::Number(number)]);
    Expression::Power(Box::new(sum), -1)
}
