//! Bending: two bars resist a change of the angle between them.
//!
//! ```text
//! e1 = x_2 − x_1    e2 = x_3 − x_2    U = c/2 (θ − θ0)²    c = α/(|ē1| + |ē2|)
//! in the plane:  θ = atan2(e1 × e2, e1·e2), in (−π, π]
//! in space:      θ = atan2(|e1 × e2|, e1·e2), in [0, π]
//! ```
//!
//! `|ē1|`, `|ē2|` are the lengths at the start of the scene. In the plane, with `J` the quarter turn and `θ − θ0` as it is,
//! not wrapped to a turn,
//!
//! ```text
//! ∂θ/∂e1 = −J e1/|e1|²    ∂θ/∂e2 = J e2/|e2|²    A(e) = J/|e|² − 2 (J e) eᵀ/|e|⁴
//! ∂²U = c (∂θ ∂θᵀ + (θ − θ0) ∂²θ),  ∂²θ/∂e1² = −A(e1),  ∂²θ/∂e2² = A(e2)
//! ```
//!
//! Where the bars are folded onto each other, `θ` jumps by a turn, and with it the force: at the fold itself, `θ` is π if
//! `e1 × e2` is 0, and −π if it is −0, as in C. In space, `θ` has no sign. With `m` the cosine of the angle at particle 2,
//! `∂θ/∂m = 1/sin θ`; there the force has no direction where the bars are in line, unless both `θ` and `θ0` are 0.
//!
//! Source: hand-out of Theme 4, milestone 1, for the plane; Bergou et al., Discrete Elastic Rods (2008), for the angle in
//! space.

use super::stencil::{Local, LocalJacobians, StencilForce, StencilLaw};
use super::{Block, Force, ForceKind, Numbered, Vector};
use nalgebra::{Matrix2, Vector2};
use scene::schema::{
    Conserves, Dependence, Derivatives, ForceSchema, Initial, Masses, ParameterSchema, PartSchema,
    Potential, Stencil,
};
use scene::{Dimension, ForceElement, Scene};

pub(super) static KIND: ForceKind = ForceKind {
    schema: ForceSchema {
        tag: "elasticbodybendingforce",
        title: "bending of an elastic body",
        formula: "`−c (θ − θ0) ∂θ/∂x`, `c = α/(\\|ē1\\| + \\|ē2\\|)` of the initial lengths; `θ` from `e1 = x_i2 − x_i1` to `e2 = x_i3 − x_i2`: `atan2(e1 × e2, e1·e2)` in the plane, `atan2(\\|e1 × e2\\|, e1·e2)` in space",
        derivatives: Derivatives {
            by_position: "`−c (∂θ ∂θᵀ + (θ − θ0) ∂²θ)`; in the plane `∂θ/∂e = ±J e/\\|e\\|²`, with `J` the quarter turn",
            by_velocity: "0",
            energy: "`U = c/2 (θ − θ0)²`",
        },
        least_dimension: Dimension::Two,
        stencil: Stencil::Named(&["i1", "i2", "i3"]),
        parameters: &[
            ParameterSchema::new("alpha", "bending modulus", (0.1, 2.0), [0.125, 0.1875, 0.15625])
                .non_negative(),
            ParameterSchema::new("theta0", "angle at rest", (-1.5, 1.5), [0.375, -0.625, 0.5]),
        ],
        parts: &[PartSchema::whole(
            &["alpha"],
            &["theta0"],
            Dependence::POSITION,
            Potential::Energy,
        )],
        masses: Masses::None,
        initial: Initial::PathLength,
        ignored: &[],
        conserves: Conserves::AngularMomentum,
        example: r#"<elasticbodybendingforce i1="0" i2="1" i3="2" alpha="0.5" theta0="0"/>"#,
    },
    build_2d,
    build_3d,
};

fn build_2d(scene: &Scene, elements: &[Numbered<'_>]) -> Box<dyn Force<2>> {
    Box::new(StencilForce::new(scene, elements, |element| Bending::of_element(scene, element)))
}

fn build_3d(scene: &Scene, elements: &[Numbered<'_>]) -> Box<dyn Force<3>> {
    Box::new(StencilForce::new(scene, elements, |element| Bending::of_element(scene, element)))
}

struct Bending {
    /// `c`.
    stiffness: f64,
    rest_angle: f64,
}

impl Bending {
    fn of_element(scene: &Scene, element: &ForceElement) -> Self {
        let stiffness = element.parameter("alpha") / element.path_length(&scene.particles);
        Self { stiffness, rest_angle: element.parameter("theta0") }
    }

    fn energy(&self, angle: f64) -> f64 {
        let change = angle - self.rest_angle;
        0.5 * self.stiffness * change * change
    }
}

/// An angle of the plane, and its derivatives by the local coordinates `x_1 − x_2` and `x_3 − x_2`.
struct Turn {
    angle: f64,
    gradient: [Vector2<f64>; 2],
    squared: [f64; 2],
    bars: [Vector2<f64>; 2],
}

impl Turn {
    fn new(at: &Local<2, 2>) -> Option<Self> {
        // A difference, and not a negation, for the sign of a zero.
        let bars = [Vector2::zeros() - at.d[0], at.d[1]];
        let squared = bars.map(|bar| bar.norm_squared());
        if squared.contains(&0.0) {
            return None;
        }
        let [e1, e2] = bars;
        let angle = (e1.x * e2.y - e1.y * e2.x).atan2(e1.dot(&e2));
        let gradient = [quarter_turn(&e1) / squared[0], quarter_turn(&e2) / squared[1]];
        Some(Self { angle, gradient, squared, bars })
    }

    /// `±A(e)` of this bar: the second derivative by its local coordinate.
    fn curvature(&self, bar: usize) -> Matrix2<f64> {
        let (e, squared) = (self.bars[bar], self.squared[bar]);
        let turn = Matrix2::new(0.0, -1.0, 1.0, 0.0) / squared;
        let curvature = turn - quarter_turn(&e) * e.transpose() * (2.0 / (squared * squared));
        if bar == 0 { -curvature } else { curvature }
    }
}

fn quarter_turn(e: &Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-e.y, e.x)
}

impl StencilLaw<2, 2> for Bending {
    const ORIGIN: Option<usize> = Some(1);

    fn energy(&self, at: &Local<2, 2>) -> Option<f64> {
        Some(self.energy(Turn::new(at)?.angle))
    }

    fn forces(&self, at: &Local<2, 2>) -> Option<[Vector<2>; 2]> {
        let turn = Turn::new(at)?;
        let moment = -self.stiffness * (turn.angle - self.rest_angle);
        Some(turn.gradient.map(|gradient| gradient * moment))
    }

    fn jacobians(&self, at: &Local<2, 2>) -> Option<LocalJacobians<2, 2>> {
        let turn = Turn::new(at)?;
        let change = turn.angle - self.rest_angle;
        let mut jacobians = LocalJacobians::zeros();
        for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let mut hessian = turn.gradient[a] * turn.gradient[b].transpose();
            if a == b {
                hessian += turn.curvature(a) * change;
            }
            jacobians.by_position[a][b] = hessian * -self.stiffness;
        }
        Some(jacobians)
    }
}

/// The angle in space, with the energy as a function of the cosine `m` of the angle at particle 2.
struct Fold {
    angle: f64,
    lengths: [f64; 2],
    directions: [Vector<3>; 2],
    cosine: f64,
    /// `∂m/∂d` of both local coordinates.
    gradient: [Vector<3>; 2],
}

/// Below this angle, `(sin θ − θ cos θ)/sin³ θ` is summed as a series: both ways are as accurate there.
const SMALL_ANGLE: f64 = 0.02;

impl Fold {
    fn new(at: &Local<2, 3>) -> Option<Self> {
        let lengths = at.d.map(|d| d.norm());
        if lengths.contains(&0.0) {
            return None;
        }
        let directions = [at.d[0] / lengths[0], at.d[1] / lengths[1]];
        let [u, v] = directions;
        let cosine = u.dot(&v);
        let angle = u.cross(&v).norm().atan2(-cosine);
        // `u × (v × u) = v − m u`, without its cancellation.
        let gradient = [u.cross(&v.cross(&u)) / lengths[0], v.cross(&u.cross(&v)) / lengths[1]];
        Some(Self { angle, lengths, directions, cosine, gradient })
    }

    /// `∂²m/∂d_a∂d_b`.
    fn curvature(&self, a: usize, b: usize) -> Block<3> {
        let across = |bar: usize| {
            Block::<3>::identity() - self.directions[bar] * self.directions[bar].transpose()
        };
        if a == b {
            let mixed = self.gradient[a] * self.directions[a].transpose();
            let sum = mixed + mixed.transpose() + across(a) * (self.cosine / self.lengths[a]);
            -sum / self.lengths[a]
        } else {
            across(a) * across(b) / (self.lengths[a] * self.lengths[b])
        }
    }

    /// The first two derivatives of `(θ − θ0)²/2` by `m`; `None` where they are not defined.
    fn by_cosine(&self, rest_angle: f64) -> Option<[f64; 2]> {
        let (theta, sin) = (self.angle, self.angle.sin());
        if rest_angle == 0.0 && theta < SMALL_ANGLE {
            let squared = theta * theta;
            let first = if theta == 0.0 { 1.0 } else { theta / sin };
            return Some([first, 1.0 / 3.0 + squared * (2.0 / 15.0 + squared * (2.0 / 63.0))]);
        }
        // The angle of opposite directions is π as rounded, whose sine is not 0.
        let is_line = self.gradient.iter().any(|gradient| gradient.norm_squared() == 0.0);
        let change = theta - rest_angle;
        (!is_line).then(|| [change / sin, (sin - change * theta.cos()) / (sin * sin * sin)])
    }
}

impl StencilLaw<2, 3> for Bending {
    const ORIGIN: Option<usize> = Some(1);

    fn energy(&self, at: &Local<2, 3>) -> Option<f64> {
        Some(self.energy(Fold::new(at)?.angle))
    }

    fn forces(&self, at: &Local<2, 3>) -> Option<[Vector<3>; 2]> {
        let fold = Fold::new(at)?;
        let [first, _] = fold.by_cosine(self.rest_angle)?;
        Some(fold.gradient.map(|gradient| gradient * (-self.stiffness * first)))
    }

    fn jacobians(&self, at: &Local<2, 3>) -> Option<LocalJacobians<2, 3>> {
        let fold = Fold::new(at)?;
        let [first, second] = fold.by_cosine(self.rest_angle)?;
        let mut jacobians = LocalJacobians::zeros();
        for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let outer = fold.gradient[a] * fold.gradient[b].transpose();
            let hessian = outer * second + fold.curvature(a, b) * first;
            jacobians.by_position[a][b] = hessian * -self.stiffness;
        }
        Some(jacobians)
    }
}
