//! Names common mistakes in a Jacobian from the measured matrix of a step.
//!
//! Each mistake turns the right `K = ∂F/∂x` and `B = ∂F/∂v` into a matrix of the step. It is reported if that matrix
//! agrees with the measured one at every state and time step, and clearly differs from the right one. A diagnosis is
//! help for the user: no verdict depends on it.

use nalgebra::DMatrix;

use super::differences::Estimate;
use super::noise::CLEAR;

/// The measurements of one part at one state with one time step.
pub(super) struct Measured<'a> {
    pub(super) h: f64,
    /// Coordinates of a particle.
    pub(super) count: usize,
    /// Matrix of the step.
    pub(super) matrix: &'a Estimate,
    /// Projects on the directions in which the steps determine it.
    pub(super) moved: &'a DMatrix<f64>,
    /// Derivatives by position and velocity: of the program's force, and of ours.
    pub(super) own: [&'a Estimate; 2],
    pub(super) ours: [&'a DMatrix<f64>; 2],
    /// Derivatives of the program's force at the start of the step, if they were needed.
    pub(super) at_start: Option<&'a [Estimate; 2]>,
}

/// A mistake: its description and the resulting matrix.
type Mistake = (&'static str, fn(&Measured<'_>) -> DMatrix<f64>);

const MISTAKES: [Mistake; 16] = [
    ("the Jacobian belongs to the right force: the mistake is in the force", |m| {
        m.ours[0] * (m.h * m.h) + m.ours[1] * m.h
    }),
    ("dF/dx is missing", |m| m.by_v() * m.h),
    ("dF/dv is missing", |m| m.by_x() * (m.h * m.h)),
    ("the Jacobians are missing", |m| m.by_x() * 0.0),
    ("dF/dx has the wrong sign", |m| m.by_v() * m.h - m.by_x() * (m.h * m.h)),
    ("dF/dv has the wrong sign", |m| m.by_x() * (m.h * m.h) - m.by_v() * m.h),
    ("dF/dx and dF/dv have the wrong sign", |m| -(m.by_x() * (m.h * m.h) + m.by_v() * m.h)),
    ("dF/dx is transposed", |m| m.by_x().transpose() * (m.h * m.h) + m.by_v() * m.h),
    ("dF/dx is multiplied by h instead of h²", |m| (m.by_x() + m.by_v()) * m.h),
    ("dF/dv is multiplied by h² instead of h", |m| (m.by_x() + m.by_v()) * (m.h * m.h)),
    ("dF/dx and dF/dv are swapped", |m| m.by_v() * (m.h * m.h) + m.by_x() * m.h),
    ("dF/dx and dF/dv are not multiplied by the time step", |m| m.by_x() + m.by_v()),
    ("the cross blocks are missing", |m| m.right_with_cross(0.0)),
    ("the cross blocks have the wrong sign", |m| m.right_with_cross(-1.0)),
    ("the direct blocks are missing", |m| m.right() - m.right_with_cross(0.0)),
    ("the Jacobians are evaluated at q, not at q + h v", |m| match m.at_start {
        Some([by_x, by_v]) => &by_x.value * (m.h * m.h) + &by_v.value * m.h,
        None => m.right(),
    }),
];

impl Measured<'_> {
    fn by_x(&self) -> &DMatrix<f64> {
        &self.own[0].value
    }

    fn by_v(&self) -> &DMatrix<f64> {
        &self.own[1].value
    }

    fn right(&self) -> DMatrix<f64> {
        self.by_x() * (self.h * self.h) + self.by_v() * self.h
    }

    fn right_with_cross(&self, factor: f64) -> DMatrix<f64> {
        let mut matrix = self.right();
        for column in 0..matrix.ncols() {
            for row in 0..matrix.nrows() {
                if row / self.count != column / self.count {
                    matrix[(row, column)] *= factor;
                }
            }
        }
        matrix
    }

    /// Distance of the measured matrix, or `other`, from `candidate`, as a multiple of the bound.
    fn distance(&self, candidate: &DMatrix<f64>, other: Option<&DMatrix<f64>>) -> f64 {
        let (h, [by_x, by_v]) = (self.h, self.own);
        let start = self
            .at_start
            .map_or(0.0, |[by_x, by_v]| h * h * by_x.bound.amax() + h * by_v.bound.amax());
        let slack = h * h * by_x.bound.amax() + h * by_v.bound.amax() + start;
        let wanted = other.unwrap_or(&self.matrix.value);
        let difference = (wanted - candidate) * self.moved;
        let bounds = self.matrix.bound.iter();
        difference
            .iter()
            .zip(bounds)
            .map(|(d, bound)| d.abs() / (bound + slack))
            .fold(0.0, f64::max)
    }
}

/// The mistakes that explain the measurements.
pub(super) fn diagnose(all: &[Measured<'_>]) -> Vec<String> {
    let explains = |(_, matrix): &&Mistake| {
        let fits = all.iter().all(|m| m.distance(&matrix(m), None) <= CLEAR);
        let differs = all.iter().any(|m| m.distance(&matrix(m), Some(&m.right())) > CLEAR);
        fits && differs
    };
    let mut named: Vec<&Mistake> = Vec::new();
    for mistake in MISTAKES.iter().filter(explains) {
        // If a term is zero, two mistakes may give the same matrix.
        let is_same = |(_, other): &&Mistake| {
            all.iter().all(|m| m.distance(&mistake.1(m), Some(&other(m))) <= CLEAR)
        };
        if !named.iter().any(|known| is_same(known)) {
            named.push(mistake);
        }
    }
    let names = named.into_iter().map(|(name, _)| (*name).to_owned());
    let names: Vec<String> = names.collect();
    if names.is_empty() { factor(all).into_iter().collect() } else { names }
}

/// A constant factor in one of the two Jacobians.
fn factor(all: &[Measured<'_>]) -> Option<String> {
    for (which, name) in ["dF/dx", "dF/dv"].into_iter().enumerate() {
        // A Jacobian that is zero but for its own errors has no factor.
        let is_there = |m: &Measured<'_>| {
            let Estimate { value, bound } = m.own[which];
            value.iter().zip(bound).any(|(value, bound)| value.abs() > CLEAR * bound)
        };
        if !all.iter().any(is_there) {
            continue;
        }
        let power = |h: f64| if which == 0 { h * h } else { h };
        let (mut above, mut below) = (0.0, 0.0);
        for m in all {
            let part = &m.own[which].value * power(m.h);
            let rest = &m.matrix.value - (m.right() - &part);
            above += rest.dot(&part);
            below += part.dot(&part);
        }
        let factor: f64 = above / below;
        let explains = |m: &Measured<'_>| {
            let part = &m.own[which].value * power(m.h);
            m.distance(&(m.right() + part * (factor - 1.0)), None) <= CLEAR
        };
        if factor.is_finite() && below > 0.0 && all.iter().all(explains) {
            return Some(format!("{name} is wrong by the factor {factor:.7}"));
        }
    }
    None
}
