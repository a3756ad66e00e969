//! Formulas as expression trees: what a law or a Jacobian is a product and a sum of.
//!
//! With `d = x_i − x_j`, `w = v_i − v_j`, `l = |d|`, `n = d/l`, `I` the identity and `R` the quarter turn about z. A tree
//! of the wrong kind (a vector added to a number) evaluates to NaN. Vectors have three components; z is 0 in two
//! dimensions. Cost: one visit of each node.

use std::fmt;
use std::iter;
use std::ops::{AddAssign, MulAssign};

use nalgebra::{Matrix3, Vector3};

use super::helper::{self, Helper};
use super::{Axes, power};

/// A formula.
#[derive(Debug, Clone, PartialEq)]
pub enum Expression {
    /// A number.
    Number(f64),
    /// A quantity of an element.
    Leaf(Leaf),
    /// The sum of its terms.
    Sum(Vec<Expression>),
    /// The product of its factors, from left to right.
    Product(Vec<Expression>),
    /// A power of a number.
    Power(Box<Expression>, i32),
    /// `a·b`.
    Dot(Box<Expression>, Box<Expression>),
    /// `a bᵀ`.
    Outer(Box<Expression>, Box<Expression>),
    /// The transpose.
    Transposed(Box<Expression>),
    /// A function of a number.
    Applied(Function, Box<Expression>),
    /// A vector or a matrix with other components.
    Components(Axes, Box<Expression>),
}

/// A quantity of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Leaf {
    /// A parameter, by its number and name.
    Parameter(usize, &'static str),
    /// The mass of `i` (0) or `j` (1).
    Mass(usize),
    /// `l`.
    Length,
    /// `|d|₁`, the sum of the sizes of the components of `d`.
    SumLength,
    /// `|d|∞`, the largest of these.
    LargestLength,
    /// A unit vector along x, y or z.
    Axis(usize),
    /// The time step.
    TimeStep,
    /// `d`.
    Difference,
    /// `n`.
    Direction,
    /// `w`.
    RelativeVelocity,
    /// The velocity of `i` (0) or `j` (1).
    Velocity(usize),
    /// The speed of `i`.
    Speed,
    /// `I`.
    Identity,
    /// `R`.
    Turn,
    /// The first three parameters as a vector.
    Field,
}

/// A function of a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Function {
    /// `|x|`.
    Absolute,
    /// `max(x, 0)`.
    Positive,
    /// `min(x, 0)`.
    Negative,
    /// A number between −c and c; a vector of length at most c.
    AtMost(f64),
    /// `max(x, c)`.
    AtLeast(f64),
    /// The integer part.
    Truncated,
    /// Of a vector: each component multiplied by its size.
    BySize,
    /// Of a vector: its length.
    Size,
    /// Of a product: its matrices are multiplied entry by entry.
    EntryByEntry,
}

/// The arguments of a formula for one element.
#[derive(Debug, Clone)]
pub struct Inputs<'a> {
    /// Parameters, in the order of the registry.
    pub parameters: &'a [f64],
    /// Masses of `i` and `j`.
    pub masses: [f64; 2],
    /// Time step.
    pub h: f64,
    /// `d`.
    pub d: Vector3<f64>,
    /// Velocities of `i` and `j`.
    pub v: [Vector3<f64>; 2],
    /// `l`, possibly softened.
    pub l: f64,
    /// A slip in the functions on vectors; derivatives have none.
    pub helper: Option<Helper>,
    /// `1/0`: most programs leave out what they would divide by 0.
    pub by_zero: f64,
}

/// A change of the arguments, for derivatives.
#[derive(Debug, Clone, Copy, Default)]
pub struct Direction {
    /// Of `d`.
    pub d: Vector3<f64>,
    /// Of the velocities of `i` and `j`.
    pub v: [Vector3<f64>; 2],
}

/// The value of a formula.
#[derive(Debug, Clone, Copy)]
pub enum Value {
    /// A number.
    Number(f64),
    /// A vector.
    Vector(Vector3<f64>),
    /// A matrix.
    Matrix(Matrix3<f64>),
}

impl Value {
    const INVALID: Self = Self::Number(f64::NAN);

    /// The vector; NaN for another kind of value.
    pub fn vector(self) -> Vector3<f64> {
        match self {
            Self::Vector(vector) => vector,
            _ => Vector3::repeat(f64::NAN),
        }
    }

    /// The matrix; NaN for another kind of value.
    pub fn matrix(self) -> Matrix3<f64> {
        match self {
            Self::Matrix(matrix) => matrix,
            _ => Matrix3::repeat(f64::NAN),
        }
    }

    fn with(self, axes: Axes) -> Self {
        match self {
            Self::Vector(vector) => Self::Vector(axes.of_vector(vector)),
            Self::Matrix(matrix) => Self::Matrix(axes.of_matrix(matrix)),
            Self::Number(_) => Self::INVALID,
        }
    }

    fn dot(self, other: Self) -> Self {
        self.dot_by(other, None)
    }

    fn dot_by(self, other: Self, helper: Option<Helper>) -> Self {
        match (self, other) {
            (Self::Vector(a), Self::Vector(b)) => Self::Number(helper::dot(helper, &a, &b)),
            _ => Self::INVALID,
        }
    }

    fn outer(self, other: Self) -> Self {
        match (self, other) {
            (Self::Vector(a), Self::Vector(b)) => Self::Matrix(a * b.transpose()),
            _ => Self::INVALID,
        }
    }
}

// Kinds are added and multiplied in place: a value is nine numbers long.

impl AddAssign<&Self> for Value {
    fn add_assign(&mut self, other: &Self) {
        match (&mut *self, other) {
            (Self::Number(a), Self::Number(b)) => *a += b,
            (Self::Vector(a), Self::Vector(b)) => *a += b,
            (Self::Matrix(a), Self::Matrix(b)) => *a += b,
            _ => *self = Self::INVALID,
        }
    }
}

impl MulAssign<&Self> for Value {
    fn mul_assign(&mut self, other: &Self) {
        *self = match (&mut *self, other) {
            (Self::Number(a), Self::Number(b)) => return *a *= b,
            (Self::Vector(a), Self::Number(b)) => return *a *= *b,
            (Self::Matrix(a), Self::Number(b)) => return *a *= *b,
            (Self::Number(a), Self::Vector(b)) => Self::Vector(b * *a),
            (Self::Number(a), Self::Matrix(b)) => Self::Matrix(b * *a),
            (Self::Matrix(a), Self::Vector(b)) => Self::Vector(*a * b),
            (Self::Matrix(a), Self::Matrix(b)) => Self::Matrix(*a * b),
            _ => Self::INVALID,
        }
    }
}

/// The sum of values; `None` if there is none.
fn sum(mut values: impl Iterator<Item = Value>) -> Option<Value> {
    let mut sum = values.next()?;
    values.for_each(|value| sum += &value);
    Some(sum)
}

/// The product of values, from left to right; `None` if there is none.
fn product(mut values: impl Iterator<Item = Value>) -> Option<Value> {
    let mut product = values.next()?;
    values.for_each(|value| product *= &value);
    Some(product)
}

impl Inputs<'_> {
    fn n(&self) -> Vector3<f64> {
        helper::direction(self.helper, self.d, self.l)
    }
}

impl Leaf {
    /// The value of a leaf that is a number.
    fn number(self, at: &Inputs<'_>) -> Option<f64> {
        Some(match self {
            Self::Parameter(number, _) => at.parameters[number],
            Self::Mass(side) => at.masses[side],
            Self::Length => at.l,
            Self::SumLength => at.d.abs().sum(),
            Self::LargestLength => at.d.amax(),
            Self::TimeStep => at.h,
            Self::Speed => helper::length(at.helper, &at.v[0]),
            _ => return None,
        })
    }

    fn value(self, at: &Inputs<'_>) -> Value {
        match self {
            Self::Axis(axis) => Value::Vector(Vector3::ith(axis, 1.0)),
            Self::Difference => Value::Vector(at.d),
            Self::Direction => Value::Vector(at.n()),
            Self::RelativeVelocity => Value::Vector(at.v[0] - at.v[1]),
            Self::Velocity(side) => Value::Vector(at.v[side]),
            Self::Identity => Value::Matrix(Matrix3::identity()),
            // The quarter turn maps z to itself.
            Self::Turn => Value::Matrix(Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0)),
            Self::Field => Value::Vector(Vector3::from_fn(|axis, _| at.parameters[axis])),
            _ => self.number(at).map_or(Value::INVALID, Value::Number),
        }
    }

    fn derivative(self, at: &Inputs<'_>, along: &Direction) -> Value {
        let lengthening = || at.n().dot(&along.d);
        match self {
            Self::Length => Value::Number(lengthening()),
            Self::SumLength => Value::Number(at.d.map(f64::signum).dot(&along.d)),
            Self::LargestLength => {
                let axis = at.d.iamax();
                Value::Number(at.d[axis].signum() * along.d[axis])
            }
            Self::Difference => Value::Vector(along.d),
            Self::Direction => Value::Vector((along.d - at.n() * lengthening()) / at.l),
            Self::RelativeVelocity => Value::Vector(along.v[0] - along.v[1]),
            Self::Velocity(side) => Value::Vector(along.v[side]),
            Self::Speed => Value::Number(at.v[0].dot(&along.v[0]) / at.v[0].norm()),
            Self::Parameter(..) | Self::Mass(_) | Self::TimeStep => Value::Number(0.0),
            Self::Identity | Self::Turn => Value::Matrix(Matrix3::zeros()),
            Self::Field | Self::Axis(_) => Value::Vector(Vector3::zeros()),
        }
    }
}

impl Expression {
    /// Whether its value is a number.
    pub fn is_number(&self) -> bool {
        match self {
            Self::Number(_) | Self::Power(..) | Self::Dot(..) => true,
            Self::Leaf(leaf) => matches!(
                leaf,
                Leaf::Parameter(..)
                    | Leaf::Mass(_)
                    | Leaf::Length
                    | Leaf::SumLength
                    | Leaf::LargestLength
                    | Leaf::TimeStep
                    | Leaf::Speed
            ),
            Self::Sum(parts) | Self::Product(parts) => parts.iter().all(Self::is_number),
            Self::Outer(..) | Self::Transposed(_) | Self::Components(..) => false,
            Self::Applied(Function::Size, _) => true,
            Self::Applied(_, inner) => inner.is_number(),
        }
    }

    /// Whether its value is a matrix.
    pub fn is_matrix(&self) -> bool {
        match self {
            Self::Leaf(leaf) => matches!(leaf, Leaf::Identity | Leaf::Turn),
            Self::Outer(..) | Self::Transposed(_) => true,
            Self::Sum(parts) => parts.iter().all(Self::is_matrix),
            // A product with a vector is one.
            Self::Product(parts) => {
                parts.iter().any(Self::is_matrix)
                    && parts.iter().all(|part| part.is_number() || part.is_matrix())
            }
            Self::Number(_) | Self::Power(..) | Self::Dot(..) => false,
            Self::Applied(_, inner) | Self::Components(_, inner) => inner.is_matrix(),
        }
    }

    /// The value of a formula that is a number; `None` for some that are, and for all others.
    fn number(&self, at: &Inputs<'_>) -> Option<f64> {
        match self {
            Self::Number(number) => Some(*number),
            Self::Leaf(leaf) => leaf.number(at),
            Self::Sum(terms) => {
                let mut numbers = terms.iter().map(|term| term.number(at));
                let first = numbers.next()??;
                numbers.try_fold(first, |sum, number| Some(sum + number?))
            }
            Self::Product(factors) => {
                let mut numbers = factors.iter().map(|factor| factor.number(at));
                numbers.try_fold(1.0, |product, number| Some(product * number?))
            }
            Self::Power(base, exponent) => match base.number(at)? {
                0.0 if *exponent < 0 => Some(at.by_zero),
                base => Some(power(base, *exponent)),
            },
            _ => None,
        }
    }

    /// The value.
    pub fn value(&self, at: &Inputs<'_>) -> Value {
        match self {
            Self::Number(number) => Value::Number(*number),
            Self::Leaf(leaf) => leaf.value(at),
            Self::Sum(terms) => {
                sum(terms.iter().map(|term| term.value(at))).unwrap_or(Value::INVALID)
            }
            Self::Product(factors) => {
                // Most formulas are a vector or a matrix after some numbers.
                let (mut number, mut rest) = (1.0, &factors[..]);
                while let [first, others @ ..] = rest
                    && let Some(factor) = first.number(at)
                {
                    (number, rest) = (number * factor, others);
                }
                let values = rest.iter().map(|factor| factor.value(at));
                product(iter::once(Value::Number(number)).chain(values)).unwrap_or(Value::INVALID)
            }
            Self::Power(base, exponent) => match base.value(at) {
                Value::Number(base) if base == 0.0 && *exponent < 0 => Value::Number(at.by_zero),
                Value::Number(base) => Value::Number(power(base, *exponent)),
                _ => Value::INVALID,
            },
            Self::Dot(a, b) => a.value(at).dot_by(b.value(at), at.helper),
            Self::Outer(a, b) => a.value(at).outer(b.value(at)),
            Self::Transposed(inner) => match inner.value(at) {
                Value::Matrix(matrix) => Value::Matrix(matrix.transpose()),
                _ => Value::INVALID,
            },
            Self::Applied(Function::EntryByEntry, inner) => {
                let factors = match &**inner {
                    Self::Product(factors) => &factors[..],
                    other => std::slice::from_ref(other),
                };
                let by_entry = |mut a: Value, b: Value| {
                    if let (Value::Matrix(a), Value::Matrix(b)) = (a, b) {
                        return Value::Matrix(a.component_mul(&b));
                    }
                    a *= &b;
                    a
                };
                let values = factors.iter().map(|factor| factor.value(at));
                values.reduce(by_entry).unwrap_or(Value::INVALID)
            }
            Self::Applied(function, inner) => match (function, inner.value(at)) {
                (Function::Size, Value::Vector(x)) => Value::Number(x.norm()),
                (Function::Truncated, Value::Number(x)) => Value::Number(x.trunc()),
                (Function::Absolute, Value::Number(x)) => Value::Number(x.abs()),
                (Function::Positive, Value::Number(x)) => Value::Number(x.max(0.0)),
                (Function::Negative, Value::Number(x)) => Value::Number(x.min(0.0)),
                (Function::AtMost(most), Value::Number(x)) => {
                    Value::Number(x.signum() * x.abs().min(*most))
                }
                (Function::AtMost(most), Value::Vector(x)) => Value::Vector(x.cap_magnitude(*most)),
                (Function::AtLeast(least), Value::Number(x)) => Value::Number(x.max(*least)),
                (Function::BySize, Value::Vector(x)) => Value::Vector(x.map(|x| x * x.abs())),
                _ => Value::INVALID,
            },
            Self::Components(axes, inner) => inner.value(at).with(*axes),
        }
    }

    /// The derivative as the arguments change along `along`.
    pub fn derivative(&self, at: &Inputs<'_>, along: &Direction) -> Value {
        match self {
            Self::Number(_) => Value::Number(0.0),
            Self::Leaf(leaf) => leaf.derivative(at, along),
            Self::Sum(terms) => {
                let values = terms.iter().map(|term| term.derivative(at, along));
                sum(values).unwrap_or(Value::INVALID)
            }
            Self::Product(factors) => {
                let values: Vec<Value> = factors.iter().map(|factor| factor.value(at)).collect();
                let with = |place: usize| {
                    let changed = factors[place].derivative(at, along);
                    let each =
                        |(k, value): (usize, &Value)| if k == place { changed } else { *value };
                    product(values.iter().enumerate().map(each))
                };
                sum((0..factors.len()).filter_map(with)).unwrap_or(Value::Number(0.0))
            }
            Self::Power(base, exponent) => match (base.value(at), base.derivative(at, along)) {
                (Value::Number(base), Value::Number(change)) => {
                    Value::Number(f64::from(*exponent) * power(base, exponent - 1) * change)
                }
                _ => Value::INVALID,
            },
            Self::Dot(a, b) => {
                let mut both = a.derivative(at, along).dot(b.value(at));
                both += &a.value(at).dot(b.derivative(at, along));
                both
            }
            Self::Outer(a, b) => {
                let mut both = a.derivative(at, along).outer(b.value(at));
                both += &a.value(at).outer(b.derivative(at, along));
                both
            }
            Self::Transposed(inner) => match inner.derivative(at, along) {
                Value::Matrix(matrix) => Value::Matrix(matrix.transpose()),
                _ => Value::INVALID,
            },
            Self::Applied(function, inner) => {
                match (function, inner.value(at), inner.derivative(at, along)) {
                    (Function::Truncated, Value::Number(_), Value::Number(_)) => Value::Number(0.0),
                    (Function::Absolute, Value::Number(x), Value::Number(change)) => {
                        Value::Number(x.signum() * change)
                    }
                    (Function::Positive, Value::Number(x), Value::Number(change)) => {
                        Value::Number(if x > 0.0 { change } else { 0.0 })
                    }
                    (Function::Negative, Value::Number(x), Value::Number(change)) => {
                        Value::Number(if x < 0.0 { change } else { 0.0 })
                    }
                    (Function::AtMost(most), Value::Number(x), Value::Number(change)) => {
                        Value::Number(if x.abs() < *most { change } else { 0.0 })
                    }
                    (Function::AtMost(most), Value::Vector(x), Value::Vector(change)) => {
                        let (size, n) = (x.norm(), x.normalize());
                        Value::Vector(match size < *most {
                            true => change,
                            false => (change - n * n.dot(&change)) * (*most / size),
                        })
                    }
                    (Function::AtLeast(least), Value::Number(x), Value::Number(change)) => {
                        Value::Number(if x > *least { change } else { 0.0 })
                    }
                    (Function::Size, Value::Vector(x), Value::Vector(change)) => {
                        Value::Number(x.normalize().dot(&change))
                    }
                    (Function::BySize, Value::Vector(x), Value::Vector(change)) => {
                        Value::Vector(x.map(|x| 2.0 * x.abs()).component_mul(&change))
                    }
                    _ => Value::INVALID,
                }
            }
            Self::Components(axes, inner) => inner.derivative(at, along).with(*axes),
        }
    }

    /// The negative.
    pub fn negated(self) -> Self {
        match self {
            Self::Product(mut factors) => {
                match factors.first() {
                    Some(Self::Number(number)) if *number == -1.0 && factors.len() > 1 => {
                        factors.remove(0);
                    }
                    Some(Self::Number(number)) => factors[0] = Self::Number(-number),
                    _ => factors.insert(0, Self::Number(-1.0)),
                }
                Self::Product(factors)
            }
            other => Self::Product(vec![Self::Number(-1.0), other]),
        }
    }
}

impl fmt::Display for Leaf {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Parameter(_, name) => name,
            Self::Mass(0) => "m_i",
            Self::Mass(_) => "m_j",
            Self::Length => "l",
            Self::SumLength => "|d|₁",
            Self::LargestLength => "|d|∞",
            Self::Axis(0) => "e_x",
            Self::Axis(1) => "e_y",
            Self::Axis(_) => "e_z",
            Self::TimeStep => "h",
            Self::Difference => "d",
            Self::Direction => "n",
            Self::RelativeVelocity => "w",
            Self::Velocity(0) => "v_i",
            Self::Velocity(_) => "v_j",
            Self::Speed => "|v|",
            Self::Identity => "I",
            Self::Turn => "R",
            Self::Field => "g",
        })
    }
}

/// A power in superscript digits: `²`.
fn superscript(exponent: i32) -> String {
    let digit = |digit: char| match digit {
        '2' => '²',
        '3' => '³',
        '4' => '⁴',
        '5' => '⁵',
        '6' => '⁶',
        other => other,
    };
    if exponent == 1 { String::new() } else { exponent.to_string().chars().map(digit).collect() }
}

impl fmt::Display for Expression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{}", number.to_string().replace('-', "−")),
            Self::Leaf(leaf) => leaf.fmt(f),
            Self::Sum(terms) => {
                for (place, term) in terms.iter().enumerate() {
                    let text = term.to_string();
                    match (place, text.strip_prefix('−')) {
                        (0, _) => f.write_str(&text)?,
                        (_, Some(rest)) => write!(f, " − {rest}")?,
                        (_, None) => write!(f, " + {text}")?,
                    }
                }
                Ok(())
            }
            Self::Product(factors) => {
                let mut text = String::new();
                for factor in factors {
                    let part = match factor {
                        Self::Number(number) if *number == -1.0 && text.is_empty() => {
                            text.push('−');
                            continue;
                        }
                        Self::Power(base, exponent) if *exponent < 0 => {
                            let one = if matches!(text.as_str(), "" | "−") { "1" } else { "" };
                            text += &format!("{one}/{}{}", inner(base), superscript(-exponent));
                            continue;
                        }
                        other => inner(other),
                    };
                    if !matches!(text.as_str(), "" | "−") {
                        text.push(' ');
                    }
                    text += &part;
                }
                f.write_str(if text.is_empty() { "1" } else { &text })
            }
            Self::Power(base, exponent) if *exponent < 0 => {
                write!(f, "1/{}{}", inner(base), superscript(-exponent))
            }
            Self::Power(base, exponent) => write!(f, "{}{}", inner(base), superscript(*exponent)),
            Self::Dot(a, b) => write!(f, "{}·{}", inner(a), inner(b)),
            Self::Outer(a, b) => write!(f, "{} {}ᵀ", inner(a), inner(b)),
            Self::Transposed(matrix) => write!(f, "({matrix})ᵀ"),
            Self::Applied(Function::Truncated, x) => write!(f, "the integer part of {x}"),
            Self::Applied(Function::Absolute, x) => write!(f, "|{x}|"),
            Self::Applied(Function::Positive, x) => write!(f, "max({x}, 0)"),
            Self::Applied(Function::Negative, x) => write!(f, "min({x}, 0)"),
            Self::Applied(Function::AtMost(most), x) => write!(f, "min(|{x}|, {most})"),
            Self::Applied(Function::AtLeast(least), x) => write!(f, "max({x}, {least})"),
            Self::Applied(Function::Size, x) => write!(f, "|{x}|"),
            Self::Applied(Function::EntryByEntry, x) => write!(f, "{} entry by entry", inner(x)),
            Self::Applied(Function::BySize, x) => write!(f, "{} by size", inner(x)),
            Self::Components(Axes::Copied(from, _), x) => {
                let component = format!("{}.{}", inner(x), if *from == 0 { "x" } else { "y" });
                write!(f, "({component}, {component})")
            }
            Self::Components(_, x) => write!(f, "{} with other components", inner(x)),
        }
    }
}

/// A factor, in parentheses if it is a sum.
fn inner(expression: &Expression) -> String {
    match expression {
        Expression::Sum(_) => format!("({expression})"),
        Expression::Product(factors) if factors.len() > 1 => format!("({expression})"),
        _ => expression.to_string(),
    }
}
