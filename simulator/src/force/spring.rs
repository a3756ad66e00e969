//! Hookean spring with internal damping.
//!
//! ```text
//! U    = k/2 (l − l0)²                     l = |d|,  n = d/l
//! f    = −k (l − l0) n − b (n·w) n
//! ∂f/∂d = −k (n nᵀ + (l − l0)/l (I − n nᵀ)) − b/l ((n·w) I + n wᵀ)(I − n nᵀ)
//! ∂f/∂w = −b n nᵀ
//! ```
//!
//! The damping part of `∂f/∂d` is not symmetric: `n wᵀ (I − n nᵀ)` is an outer product of two
//! orthogonal vectors. Source: hand-out of milestone 2, sections 3.1 and 3.4; of milestone 3, sections
//! 8.3 and 8.4.
//!
//! A spring of length zero has no direction. Where its rest length and damping are zero too, the law is
//! `f = −k d`, which needs none; otherwise the force is not defined there.

use pulp::Simd;

use super::batches::{load, store};
use super::law::{PairLaw, PairLaws, Relative, Undefined, one_by_one};
use super::pair::PairForce;
use super::reciprocal::reciprocal;
use super::{Block, Force, ForceKind, Numbered, Vector};
use scene::schema::{
    Conserves, Dependence, Derivatives, ForceSchema, Initial, Masses, ParameterSchema, PartSchema,
    Potential, Stencil,
};
use scene::{Dimension, ForceElement, Scene};

pub(super) static KIND: ForceKind = ForceKind {
    schema: ForceSchema {
        tag: "springforce",
        title: "spring with internal damping",
        formula: "`F_i = −k (l − l0) n − b (n·w) n`, `F_j = −F_i`",
        derivatives: Derivatives {
            by_position: "`−k (n nᵀ + (l − l0)/l (I − n nᵀ)) − b/l ((n·w) I + n wᵀ)(I − n nᵀ)`",
            by_velocity: "`−b n nᵀ`",
            energy: "`U = k/2 (l − l0)²`; none for `b`",
        },
        least_dimension: Dimension::Two,
        stencil: Stencil::Edge,
        parameters: &[
            ParameterSchema::new("k", "stiffness", (1.0, 100.0), [4.0, 6.0, 5.0]).non_negative(),
            ParameterSchema::new("l0", "rest length", (0.2, 2.0), [0.75, 2.5, 0.625])
                .non_negative()
                .length(),
            ParameterSchema::new("b", "damping", (0.1, 10.0), [1.5, 1.0, 1.25])
                .non_negative()
                .default_to(0.0),
        ],
        parts: &[
            PartSchema {
                name: "elastic",
                title: "elastic force",
                meaning: "springs without damping",
                scaled_by: &["k"],
                shaped_by: &["l0"],
                stands_alone: true,
                depends_on: Dependence::POSITION,
                derives_from: Potential::Energy,
            },
            PartSchema {
                name: "damping",
                title: "damping",
                meaning: "contribution of damping to springs",
                scaled_by: &["b"],
                shaped_by: &[],
                stands_alone: true,
                depends_on: Dependence::STATE,
                derives_from: Potential::Neither,
            },
        ],
        masses: Masses::None,
        initial: Initial::None,
        ignored: &[],
        conserves: Conserves::AngularMomentum,
        example: r#"<springforce edge="0" k="100" l0="1" b="0.5"/>"#,
    },
    build_2d: build::<2>,
    build_3d: build::<3>,
};

fn build<const D: usize>(scene: &Scene, elements: &[Numbered<'_>]) -> Box<dyn Force<D>> {
    Box::new(PairForce::<Springs<D>>::new::<D>(scene, elements, Springs::<D>::of_element))
}

#[derive(Clone, Copy)]
pub(super) struct Spring {
    pub(super) stiffness: f64,
    pub(super) rest_length: f64,
    pub(super) damping: f64,
}

impl Spring {
    /// Whether the law is the linear `f = −k d`, which needs no direction.
    fn linear(&self) -> bool {
        self.rest_length == 0.0 && self.damping == 0.0
    }
}

impl<const D: usize> PairLaw<D> for Spring {
    const USES_VELOCITY: bool = true;

    fn energy(&self, distance: f64) -> Option<f64> {
        let stretch = distance - self.rest_length;
        Some(0.5 * self.stiffness * stretch * stretch)
    }

    fn force(&self, d: &Vector<D>, w: &Vector<D>) -> Option<Vector<D>> {
        if self.linear() {
            return Some(d * -self.stiffness);
        }
        let length = d.norm();
        if length == 0.0 {
            return None;
        }
        let n = d * (1.0 / length);
        let mut tension = self.stiffness * (length - self.rest_length);
        if self.damping != 0.0 {
            tension += self.damping * n.dot(w);
        }
        Some(n * -tension)
    }

    #[inline(always)]
    fn jacobians(&self, d: &Vector<D>, w: &Vector<D>) -> Option<(Block<D>, Block<D>)> {
        if self.linear() {
            return Some((Block::identity() * -self.stiffness, Block::zeros()));
        }
        let length = d.norm();
        if length == 0.0 {
            return None;
        }
        let n = d * (1.0 / length);
        let along = n * n.transpose();
        let across = Block::identity() - along;
        let strain = (length - self.rest_length) / length;
        let elastic = (along + across * strain) * -self.stiffness;
        if self.damping == 0.0 {
            return Some((elastic, Block::zeros()));
        }
        let turning = Block::identity() * n.dot(w) + n * w.transpose();
        let damping = turning * across * (-self.damping / length);
        Some((elastic + damping, along * -self.damping))
    }

    fn has_constant_jacobians(&self) -> bool {
        self.linear()
    }
}

/// The springs of a scene, by slot. Their parameters are laid out as vectors are, and meet the same shuffles.
#[derive(Default)]
pub(super) struct Springs<const D: usize> {
    /// Stiffness and rest length.
    elastic: Vec<[f64; D]>,
    /// Damping; empty as long as there is none.
    damping: Vec<[f64; D]>,
    /// Whether one of them is linear.
    any_linear: bool,
}

impl<const D: usize> Springs<D> {
    /// The law of an element.
    pub(super) fn of_element(element: &ForceElement, _: [usize; 2]) -> Spring {
        let [stiffness, rest_length, damping] =
            ["k", "l0", "b"].map(|name| element.parameter(name));
        Spring { stiffness, rest_length, damping }
    }
}

impl<const D: usize> PairLaws<D> for Springs<D> {
    type Law = Spring;

    fn push(&mut self, law: Spring) {
        let Spring { stiffness, rest_length, damping } = law;
        if damping != 0.0 || !self.damping.is_empty() {
            self.damping.resize(self.elastic.len(), [0.0; D]);
            self.damping.push(leading([damping, 0.0]));
        }
        self.elastic.push(leading([stiffness, rest_length]));
        self.any_linear |= law.linear();
    }

    #[inline(always)]
    fn law(&self, slot: usize) -> Spring {
        let [stiffness, rest_length, ..] = self.elastic[slot][..] else { unreachable!() };
        let damping = self.damping.get(slot).map_or(0.0, |damping| damping[0]);
        Spring { stiffness, rest_length, damping }
    }

    fn use_velocity(&self) -> bool {
        !self.damping.is_empty()
    }

    #[inline(always)]
    fn forces<S: Simd>(
        &self,
        simd: S,
        first_slot: usize,
        relative: impl Relative<D>,
        forces: &mut [[f64; D]],
    ) -> Result<(), Undefined> {
        let (count, lanes) = (forces.len(), S::F64_LANES);
        // Linear springs are rare, and need no root.
        if self.any_linear || count < lanes {
            return one_by_one(self, first_slot, relative, forces);
        }
        let elastic = &self.elastic[first_slot..first_slot + count];
        let damping = self.damping.get(first_slot..first_slot + count);
        let zero = simd.splat_f64s(0.0);
        let mut exact = simd.equal_f64s(zero, zero);
        for first in (0..count).step_by(lanes) {
            // The last vector repeats some springs of the one before it.
            let first = first.min(count - lanes);
            let d = deinterleave(simd, relative.positions(simd, first));
            let [stiffness, rest_length, ..] = deinterleave(simd, load::<D, S>(elastic, first))[..]
            else {
                unreachable!("there are two dimensions or more")
            };
            let length = simd.sqrt_f64s(dot(simd, &d, &d));
            let inverse = reciprocal(simd, length, &mut exact);
            let n = d.map(|component| simd.mul_f64s(component, inverse));
            let mut pull = simd.mul_f64s(stiffness, simd.sub_f64s(rest_length, length));
            if let Some(damping) = damping {
                let w = deinterleave(simd, relative.velocities(simd, first));
                let damping = deinterleave(simd, load::<D, S>(damping, first))[0];
                let damped = simd.sub_f64s(pull, simd.mul_f64s(damping, dot(simd, &n, &w)));
                pull = simd.select_f64s(simd.equal_f64s(damping, zero), pull, damped);
            }
            let force = interleave(simd, n.map(|component| simd.mul_f64s(component, pull)));
            store::<D, S>(&mut forces[first..first + lanes], force);
        }
        if simd.first_true_m64s(simd.not_m64s(exact)) < lanes {
            return one_by_one(self, first_slot, relative, forces);
        }
        Ok(())
    }
}

/// `a·b`, summed in the order of a [`Vector`]'s.
#[inline(always)]
fn dot<const D: usize, S: Simd>(simd: S, a: &[S::f64s; D], b: &[S::f64s; D]) -> S::f64s {
    let mut products = a.iter().zip(b).map(|(a, b)| simd.mul_f64s(*a, *b));
    let first = products.next().unwrap_or(simd.splat_f64s(0.0));
    products.fold(first, |sum, product| simd.add_f64s(sum, product))
}

/// The first two of `D` numbers.
fn leading<const D: usize>(values: [f64; 2]) -> [f64; D] {
    std::array::from_fn(|axis| values.get(axis).copied().unwrap_or(0.0))
}

/// From particle-major vectors to one vector an axis, their lanes in an order of the processor's own.
#[inline(always)]
fn deinterleave<const D: usize, S: Simd>(simd: S, vectors: [S::f64s; D]) -> [S::f64s; D] {
    let mut axes = vectors;
    match *vectors.as_slice() {
        [a, b] => axes.copy_from_slice(&simd.deinterleave_shfl_f64s([a, b])),
        [a, b, c] => axes.copy_from_slice(&simd.deinterleave_shfl_f64s([a, b, c])),
        _ => {}
    }
    axes
}

/// The way back.
#[inline(always)]
fn interleave<const D: usize, S: Simd>(simd: S, axes: [S::f64s; D]) -> [S::f64s; D] {
    let mut vectors = axes;
    match *axes.as_slice() {
        [a, b] => vectors.copy_from_slice(&simd.interleave_shfl_f64s([a, b])),
        [a, b, c] => vectors.copy_from_slice(&simd.interleave_shfl_f64s([a, b, c])),
        _ => {}
    }
    vectors
}
