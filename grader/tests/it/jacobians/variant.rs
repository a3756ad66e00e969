//! Correct Jacobians, computed by other formulas: none of them may be called wrong.

use nalgebra::DMatrix;
use num_dual::{Dual64, DualNum};
use reference::law::Jacobians;

use super::element::{
    Blocks, Element, add, damping_by_velocity, elastic, elements, gravitation, green, nothing,
    spring, vortex,
};
use super::planted::{Moment, Plant};

/// A correct variant.
pub(crate) struct Variant {
    pub(crate) force: &'static str,
    pub(crate) description: &'static str,
    pub(crate) plant: Plant,
}

pub(crate) fn all() -> Vec<Variant> {
    let law = |force, description, law: fn(&Element) -> Blocks| Variant {
        force,
        description,
        plant: Plant::Law(law),
    };
    let after = |force, description, change: fn(&Moment<'_>, &mut Jacobians)| Variant {
        force,
        description,
        plant: Plant::After(change),
    };
    let spring_is = "springforce";
    vec![
        law(spring_is, "as the test's own second implementation", spring),
        law(spring_is, "factored: −k I + k l0/l (I − n nᵀ)", |e| {
            let [k, l0, ..] = e.p;
            let bend = if l0 == 0.0 { 0.0 } else { k * l0 / e.l() };
            let expanded = e.identity() * -k + e.across() * bend;
            (expanded + super::element::damping(e), damping_by_velocity(e))
        }),
        law(spring_is, "damping part multiplied out: (n·w)(I − 2 n nᵀ) + n wᵀ", |e| {
            let closing = e.closing();
            let turning = (e.identity() - e.along() * 2.0) * closing + e.n() * e.w.transpose();
            (elastic(e) + turning * (-e.p[2] / e.l()), damping_by_velocity(e))
        }),
        law(spring_is, "with fused multiply-add", |e| {
            let [k, l0, b, _] = e.p;
            let (n, l, closing) = (e.n(), e.l(), e.closing());
            let strain = (l - l0) / l;
            let identity = |i: usize, j: usize| f64::from(u8::from(i == j));
            let size = n.len();
            let across = |i: usize, j: usize| (-n[i]).mul_add(n[j], identity(i, j));
            let x = DMatrix::from_fn(size, size, |i, j| {
                let elastic = -k * n[i].mul_add(n[j], strain * across(i, j));
                let product: f64 = (0..size).fold(0.0, |sum, m| {
                    n[i].mul_add(e.w[m], closing * identity(i, m)).mul_add(across(m, j), sum)
                });
                (-b / l).mul_add(product, elastic)
            });
            (x, DMatrix::from_fn(size, size, |i, j| -b * n[i] * n[j]))
        }),
        law(spring_is, "with d/l² instead of n, and no root but one", |e| {
            let [k, l0, b, _] = e.p;
            let squared = e.d.norm_squared();
            let root = squared.sqrt();
            let along = &e.d * e.d.transpose() / squared;
            let across = e.identity() - &along;
            let rate = e.d.dot(&e.w) / squared;
            let elastic = &along * -k + &across * (-k * (root - l0) / root);
            let turning = e.identity() * rate + &e.d * e.w.transpose() / squared;
            (elastic + turning * across * -b, along * -b)
        }),
        law(spring_is, "length by scaling first, as hypot does", |e| {
            let largest = e.d.amax();
            let scaled = Element {
                d: &e.d / largest,
                w: e.w.clone(),
                p: [e.p[0], e.p[1] / largest, e.p[2] / largest, 0.0],
                m: e.m,
                pair: e.pair,
            };
            (spring(&scaled).0, damping_by_velocity(e))
        }),
        law(spring_is, "by dual numbers", dual_spring),
        law(spring_is, "by double-double arithmetic, rounded once", double_spring),
        after(spring_is, "elements added in reverse", |moment, j| {
            *j = Jacobians::zeros(moment.x.len());
            for element in elements(moment.scene, moment.x, moment.v).iter().rev() {
                let (a, b) = spring(element);
                let [first, second] = element.pair;
                for (matrix, block) in [(&mut j.by_position, a), (&mut j.by_velocity, b)] {
                    add(matrix, [second, first], &-&block);
                    add(matrix, [first, second], &-&block);
                    add(matrix, [second; 2], &block);
                    add(matrix, [first; 2], &block);
                }
            }
        }),
        after(spring_is, "zeros of either sign", |_, j| {
            for matrix in [&mut j.by_position, &mut j.by_velocity] {
                matrix.apply(|entry| *entry = if *entry == 0.0 { -0.0 } else { *entry });
            }
        }),
        after(spring_is, "four roundings more an entry", |_, j| noisy(j)),
        after("vortexforce", "four roundings more an entry", |_, j| noisy(j)),
        law("vortexforce", "as the test's own second implementation", vortex),
        law("vortexforce", "multiplied out", |e| {
            let [kbs, kvc, ..] = e.p;
            let inverse = 1.0 / e.d.norm_squared();
            let cube = inverse * inverse.sqrt();
            let turned = e.turn() * &e.d;
            let rotation = e.turn() * (kvc * kbs * cube)
                - turned * e.d.transpose() * (3.0 * kvc * kbs * cube * inverse);
            let drag = &e.w * e.d.transpose() * (2.0 * kvc * inverse * inverse);
            (rotation + drag, e.identity() * -(kvc * inverse))
        }),
        law("gravitationalforce", "as the test's own second implementation", gravitation),
        law("gravitationalforce", "by the power −3/2 of l²", |e| {
            let strength = e.p[0] * e.m[0] * e.m[1];
            let cube = e.d.norm_squared().powf(-1.5);
            let fifth = e.d.norm_squared().powf(-2.5);
            let shape = &e.d * e.d.transpose() * (3.0 * fifth) - e.identity() * cube;
            (shape * strength, e.zeros())
        }),
        law("greenspringforce", "as the test's own second implementation", green),
        law("greenspringforce", "divided first", |e| {
            let [k, l0, ..] = e.p;
            let u = &e.d / l0;
            let shape = &u * u.transpose() * 2.0 + e.identity() * (u.dot(&u) - 1.0);
            (shape * (-2.0 * k), e.zeros())
        }),
        after("dragdamping", "zeros of either sign", signed_zeros),
        law("simplegravity", "zeros written out", nothing),
        after("windforce", "zeros of either sign", signed_zeros),
    ]
}

/// Changes the sign of every zero.
fn signed_zeros(_: &Moment<'_>, jacobians: &mut Jacobians) {
    for matrix in [&mut jacobians.by_position, &mut jacobians.by_velocity] {
        matrix.apply(|entry| *entry = if *entry == 0.0 { -0.0 } else { *entry });
    }
}

/// Changes every entry by up to four rounding errors, in a pseudo-random pattern.
fn noisy(jacobians: &mut Jacobians) {
    for matrix in [&mut jacobians.by_position, &mut jacobians.by_velocity] {
        matrix.apply(|entry| {
            let dice = entry.to_bits().wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 61;
            *entry *= 1.0 + (dice as f64 - 3.5) / 3.5 * 4.0 * f64::EPSILON;
        });
    }
}

/// `∂f/∂d` and `∂f/∂w`, column by column, with `f = −(k (l − l0) + b n·w) n` of dual numbers.
fn dual_spring(e: &Element) -> Blocks {
    let size = e.d.len();
    let [k, l0, b, _] = e.p;
    let column = |seed: usize| -> Vec<f64> {
        let number =
            |value: f64, place: usize| Dual64::new(value, f64::from(u8::from(place == seed)));
        let d: Vec<Dual64> = (0..size).map(|axis| number(e.d[axis], axis)).collect();
        let w: Vec<Dual64> = (0..size).map(|axis| number(e.w[axis], size + axis)).collect();
        let dot = |a: &[Dual64], b: &[Dual64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<Dual64>();
        let l = dot(&d, &d).sqrt();
        let n: Vec<Dual64> = d.iter().map(|component| component / l).collect();
        let tension = (l - l0) * k + dot(&n, &w) * b;
        n.iter().map(|component| -(tension * component).eps).collect()
    };
    let matrix = |first: usize| {
        let columns: Vec<Vec<f64>> = (first..first + size).map(column).collect();
        DMatrix::from_fn(size, size, |row, column| columns[column][row])
    };
    (matrix(0), matrix(size))
}

/// A number as the sum of two, with some 32 digits.
#[derive(Clone, Copy)]
struct Double(f64, f64);

impl Double {
    fn new(value: f64) -> Self {
        Self(value, 0.0)
    }

    fn quick(a: f64, b: f64) -> Self {
        let sum = a + b;
        Self(sum, b - (sum - a))
    }

    fn plus(self, other: Self) -> Self {
        let sum = self.0 + other.0;
        let part = sum - self.0;
        let error = (self.0 - (sum - part)) + (other.0 - part);
        Self::quick(sum, error + self.1 + other.1)
    }

    fn minus(self, other: Self) -> Self {
        self.plus(Self(-other.0, -other.1))
    }

    fn times(self, other: Self) -> Self {
        let product = self.0 * other.0;
        let error = self.0.mul_add(other.0, -product);
        Self::quick(product, error + self.0 * other.1 + self.1 * other.0)
    }

    fn over(self, other: Self) -> Self {
        let first = self.0 / other.0;
        let rest = self.minus(other.times(Self::new(first)));
        Self::quick(first, rest.0 / other.0)
    }

    fn root(self) -> Self {
        let first = self.0.sqrt();
        let rest = self.minus(Self::new(first).times(Self::new(first)));
        Self::quick(first, rest.0 / (2.0 * first))
    }
}

fn double_spring(e: &Element) -> Blocks {
    let size = e.d.len();
    let [k, l0, b, _] = e.p.map(Double::new);
    let d: Vec<Double> = e.d.iter().copied().map(Double::new).collect();
    let w: Vec<Double> = e.w.iter().copied().map(Double::new).collect();
    let dot = |a: &[Double], b: &[Double]| {
        a.iter().zip(b).fold(Double::new(0.0), |sum, (a, b)| sum.plus(a.times(*b)))
    };
    let l = dot(&d, &d).root();
    let n: Vec<Double> = d.iter().map(|component| component.over(l)).collect();
    let closing = dot(&n, &w);
    let unit = |i: usize, j: usize| Double::new(f64::from(u8::from(i == j)));
    let across = |i: usize, j: usize| unit(i, j).minus(n[i].times(n[j]));
    let strain = l.minus(l0).over(l);
    let x = DMatrix::from_fn(size, size, |i, j| {
        let elastic = k.times(n[i].times(n[j]).plus(strain.times(across(i, j))));
        let turning = (0..size).fold(Double::new(0.0), |sum, m| {
            let term = closing.times(unit(i, m)).plus(n[i].times(w[m]));
            sum.plus(term.times(across(m, j)))
        });
        let total = elastic.plus(b.over(l).times(turning));
        -(total.0 + total.1)
    });
    let v = DMatrix::from_fn(size, size, |i, j| {
        let value = b.times(n[i]).times(n[j]);
        -(value.0 + value.1)
    });
    (x, v)
}
