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

use super::pair::{PairForce, PairLaw};
use super::{Block, Force, ForceKind, Numbered, Vector};
use crate::scene::Scene;
use crate::scene::schema::{ActsOn, ForceSchema, ParameterSchema};

pub(super) static KIND: ForceKind = ForceKind {
    schema: ForceSchema {
        tag: "springforce",
        title: "spring with internal damping",
        acts_on: ActsOn::Edge,
        parameters: &[
            ParameterSchema::new("k", "stiffness", (1.0, 100.0)).non_negative(),
            ParameterSchema::new("l0", "rest length", (0.2, 2.0)).non_negative(),
            ParameterSchema::new("b", "damping", (0.1, 10.0)).non_negative().default_to(0.0),
        ],
        variational: |parameters| parameters[2] == 0.0,
        example: r#"<springforce edge="0" k="100" l0="1" b="0.5"/>"#,
    },
    build_2d: build::<2>,
    build_3d: build::<3>,
};

fn build<const D: usize>(scene: &Scene, elements: &[Numbered<'_>]) -> Box<dyn Force<D>> {
    Box::new(PairForce::new(scene, elements, |parameters, _| Spring {
        stiffness: parameters[0],
        rest_length: parameters[1],
        damping: parameters[2],
    }))
}

struct Spring {
    stiffness: f64,
    rest_length: f64,
    damping: f64,
}

impl Spring {
    /// Whether the law is the linear `f = −k d`, which needs no direction.
    fn linear(&self) -> bool {
        self.rest_length == 0.0 && self.damping == 0.0
    }
}

impl<const D: usize> PairLaw<D> for Spring {
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

    fn symmetric(&self) -> bool {
        self.damping == 0.0
    }
}
