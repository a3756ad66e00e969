//! Elastic bodies as the hand-out of Theme 4, milestone 1, writes them: bending and constant strain triangles.
//!
//! ```text
//! hinge       θ between e1 = x_2 − x_1 and e2 = x_3 − x_2     c = α/(|ē1| + |ē2|)     g = ∂θ/∂x
//!             F = −c (θ − θ0) g     ∂F/∂x = −c (g gᵀ + (θ − θ0) H_θ)
//! triangle    ∇Φ = (x_2 − x_1 | x_3 − x_1) B = (p | q)     ε = (p·p − 1, q·q − 1, p·q)     s = ∂(U/k)/∂ε
//!             F = −k Σ s_n ∂ε_n/∂x     ∂F/∂x = −k Σ (s_n ∂²ε_n/∂x² + ∂ε_n/∂x ∂s_n/∂xᵀ)
//! ```
//!
//! Force and Hessian have their own copy of each formula, so that a mistake may be in one of them alone.

use super::{Mat2, Parameters, Vec2, quarter_turn};

/// The three particles of an element.
pub(crate) struct Three {
    pub(crate) x: [Vec2; 3],
    /// Their initial positions.
    pub(crate) start: [Vec2; 3],
}

/// The blocks of a Hessian.
pub(crate) type NineBlocks = [[Mat2; 3]; 3];

/// The formulas of a hinge.
#[derive(Clone, Copy)]
pub(crate) struct Hinge {
    /// `c`, of the element and `α`.
    pub(crate) stiffness: fn(&Three, f64) -> f64,
    /// `θ`, of `e1` and `e2`.
    pub(crate) angle: fn(Vec2, Vec2) -> f64,
    /// `θ − θ0`.
    pub(crate) change: fn(f64, f64) -> f64,
    /// The derivatives of the angles of `e1` and of `e2` by themselves.
    pub(crate) slope: fn(Vec2) -> Vec2,
    /// `A(e)`, the second derivative of the angle of `e`.
    pub(crate) curvature: fn(Vec2) -> Mat2,
    /// `g` of the three particles, of both slopes.
    pub(crate) share: fn(Vec2, Vec2) -> [Vec2; 3],
    /// The weights of `g gᵀ` and of `(θ − θ0) H_θ`.
    pub(crate) weights: [f64; 2],
    /// The blocks as they are added.
    pub(crate) place: fn(NineBlocks) -> NineBlocks,
}

/// The formulas of a triangle.
#[derive(Clone, Copy)]
pub(crate) struct Triangle {
    /// The undeformed corners.
    pub(crate) corners: fn(&Three, &Parameters) -> [Vec2; 3],
    /// `B`, of the undeformed edges as columns.
    pub(crate) inverse: fn(Mat2) -> Mat2,
    /// The area, of the undeformed and of the deformed edges.
    pub(crate) area: fn(Mat2, Mat2) -> f64,
    /// `k`, of `E`, `ν` and the area.
    pub(crate) stiffness: fn(f64, f64, f64) -> f64,
    /// The strain, of `p` and `q`.
    pub(crate) strain: fn(Vec2, Vec2) -> [f64; 3],
    /// `s`, of the strain and `ν`.
    pub(crate) stress: fn([f64; 3], f64) -> [f64; 3],
    /// The derivatives of the strain by a corner with these weights, of `p`, `q`, `w`, `z`.
    pub(crate) gradient: fn(Vec2, Vec2, f64, f64) -> [Vec2; 3],
    /// The forces on the three corners, of those on the second and third.
    pub(crate) share: fn(Vec2, Vec2) -> [Vec2; 3],
    /// The weights of the second derivatives of the strain, and of the outer products.
    pub(crate) weights: [f64; 2],
    /// The blocks as they are added.
    pub(crate) place: fn(NineBlocks) -> NineBlocks,
}

pub(crate) fn path_length(three: &Three) -> f64 {
    let [a, b, c] = three.start;
    (b - a).norm() + (c - b).norm()
}

pub(crate) fn cross(a: Vec2, b: Vec2) -> f64 {
    a.x * b.y - a.y * b.x
}

impl Hinge {
    /// Without mistakes.
    pub(crate) const FAULTLESS: Self = Self {
        stiffness: |three, alpha| alpha / path_length(three),
        angle: |e1, e2| cross(e1, e2).atan2(e1.dot(&e2)),
        change: |theta, theta0| theta - theta0,
        slope: |e| quarter_turn() * e / e.norm_squared(),
        curvature: |e| {
            let squared = e.norm_squared();
            quarter_turn() / squared
                - 2.0 * (quarter_turn() * e) * e.transpose() / (squared * squared)
        },
        share: |first, second| [first, -first - second, second],
        weights: [1.0; 2],
        place: |blocks| blocks,
    };

    fn bars(three: &Three) -> [Vec2; 2] {
        let [a, b, c] = three.x;
        [b - a, c - b]
    }

    fn change(&self, [e1, e2]: [Vec2; 2], p: &Parameters) -> f64 {
        (self.change)((self.angle)(e1, e2), p["theta0"])
    }

    pub(crate) fn force(&self, three: &Three, p: &Parameters) -> [Vec2; 3] {
        let bars = Self::bars(three);
        let moment = -(self.stiffness)(three, p["alpha"]) * self.change(bars, p);
        let [first, second] = bars.map(self.slope);
        (self.share)(first, second).map(|gradient| moment * gradient)
    }

    pub(crate) fn jacobian(&self, three: &Three, p: &Parameters) -> NineBlocks {
        let bars = Self::bars(three);
        let stiffness = -(self.stiffness)(three, p["alpha"]);
        let change = self.change(bars, p);
        let [first, second] = bars.map(self.slope);
        let g = (self.share)(first, second);
        let [a1, a2] = bars.map(self.curvature);
        let zero = Mat2::zeros();
        let curvature = [[-a1, a1, zero], [a1, a2 - a1, -a2], [zero, -a2, a2]];
        let [outer, second] = self.weights;
        (self.place)(std::array::from_fn(|row| {
            std::array::from_fn(|column| {
                let gg = g[row] * g[column].transpose();
                stiffness * (outer * gg + second * change * curvature[row][column])
            })
        }))
    }
}

impl Triangle {
    /// Without mistakes.
    pub(crate) const FAULTLESS: Self = Self {
        corners: |_, p| {
            [("xb1x", "xb1y"), ("xb2x", "xb2y"), ("xb3x", "xb3y")]
                .map(|(x, y)| Vec2::new(p[x], p[y]))
        },
        inverse: |edges| edges.try_inverse().unwrap_or_else(Mat2::zeros),
        area: |undeformed, _| 0.5 * undeformed.determinant().abs(),
        stiffness: |modulus, nu, area| modulus * area / (1.0 - nu * nu),
        strain: |p, q| [p.dot(&p) - 1.0, q.dot(&q) - 1.0, p.dot(&q)],
        stress: |[xx, yy, xy], nu| [xx + nu * yy, yy + nu * xx, 2.0 * (1.0 - nu) * xy],
        gradient: |p, q, w, z| [2.0 * w * p, 2.0 * z * q, z * p + w * q],
        share: |second, third| [-second - third, second, third],
        weights: [1.0; 2],
        place: |blocks| blocks,
    };

    /// `k`, `p`, `q` and the weights of corners 2 and 3.
    fn state(&self, three: &Three, p: &Parameters) -> (f64, [Vec2; 2], [[f64; 2]; 2]) {
        let edges = |[a, b, c]: [Vec2; 3]| Mat2::from_columns(&[b - a, c - a]);
        let undeformed = edges((self.corners)(three, p));
        let deformed = edges(three.x);
        let inverse = (self.inverse)(undeformed);
        let gradient = deformed * inverse;
        let area = (self.area)(undeformed, deformed);
        let k = (self.stiffness)(p["youngsmodulus"], p["poissonratio"], area);
        let weights = [0, 1].map(|row| [inverse[(row, 0)], inverse[(row, 1)]]);
        (k, [gradient.column(0).into(), gradient.column(1).into()], weights)
    }

    pub(crate) fn force(&self, three: &Three, parameters: &Parameters) -> [Vec2; 3] {
        let (k, [p, q], weights) = self.state(three, parameters);
        let stress = (self.stress)((self.strain)(p, q), parameters["poissonratio"]);
        let [second, third] = weights.map(|[w, z]| {
            let gradient = (self.gradient)(p, q, w, z);
            gradient.iter().zip(stress).map(|(gradient, s)| -k * s * gradient).sum()
        });
        (self.share)(second, third)
    }

    pub(crate) fn jacobian(&self, three: &Three, parameters: &Parameters) -> NineBlocks {
        let (k, [p, q], weights) = self.state(three, parameters);
        let nu = parameters["poissonratio"];
        let [xx, yy, xy] = (self.stress)((self.strain)(p, q), nu);
        let all = [
            [-weights[0][0] - weights[1][0], -weights[0][1] - weights[1][1]],
            weights[0],
            weights[1],
        ];
        let [second, outer] = self.weights;
        (self.place)(std::array::from_fn(|row| {
            std::array::from_fn(|column| {
                let ([w, z], [v, y]) = (all[row], all[column]);
                let bent = 2.0 * (xx * w * v + yy * z * y) + xy * (w * y + z * v);
                let g = (self.gradient)(p, q, w, z);
                let other = (self.gradient)(p, q, v, y);
                // The stress is linear in the strain: its derivative along each axis.
                let along = [0, 1].map(|axis| (self.stress)(other.map(|each| each[axis]), nu));
                let products: Mat2 =
                    (0..3).map(|n| g[n] * Vec2::new(along[0][n], along[1][n]).transpose()).sum();
                -k * (second * bent * Mat2::identity() + outer * products)
            })
        }))
    }
}
