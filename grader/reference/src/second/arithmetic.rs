//! Force laws in alternative floating-point evaluation orders.
//!
//! ```text
//! quotients      d/l                or   d · (1/l)
//! products       a·b + c rounded twice   or once (fused multiply-add)
//! ```
//!
//! Formulas and sources are those of [`law`](crate::law), whose values these are but for rounding. Units are
//! the scene's.

use scene::ForceElement;

/// Evaluation of products, sums and quotients.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Arithmetic {
    /// `a·b + c` is rounded once.
    pub fused: bool,
    /// `a/b` is `a · (1/b)`.
    pub reciprocal: bool,
}

type Vector = [f64; 3];

/// Arguments of a pair force, with `d = x_i − x_j` and `w = v_i − v_j`.
pub struct Pair {
    /// Masses of `i` and `j`.
    pub masses: [f64; 2],
    /// Difference of positions.
    pub d: Vector,
    /// Difference of velocities.
    pub w: Vector,
}

impl Arithmetic {
    /// `a·b + c`.
    pub fn multiply_add(self, a: f64, b: f64, c: f64) -> f64 {
        if self.fused { a.mul_add(b, c) } else { a * b + c }
    }

    /// `a/b`.
    pub fn divide(self, a: f64, b: f64) -> f64 {
        if self.reciprocal { a * (1.0 / b) } else { a / b }
    }

    fn dot(self, a: Vector, b: Vector) -> f64 {
        self.multiply_add(a[0], b[0], self.multiply_add(a[1], b[1], a[2] * b[2]))
    }

    /// The force on the first particle of a pair; `None` where there is but one way to evaluate it.
    pub fn on_pair(self, element: &ForceElement, pair: &Pair) -> Option<Vector> {
        let Pair { masses: [mi, mj], d, w } = *pair;
        let squared = self.dot(d, d);
        let l = squared.sqrt();
        let n = d.map(|component| self.divide(component, l));
        match element.schema.tag {
            "springforce" => {
                let [k, l0, b] = ["k", "l0", "b"].map(|name| element.parameter(name));
                if l0 == 0.0 && b == 0.0 {
                    return Some(d.map(|component| -k * component));
                }
                let tension = self.multiply_add(b, self.dot(n, w), k * (l - l0));
                Some(n.map(|component| -tension * component))
            }
            "greenspringforce" => {
                let [k, l0] = ["k", "l0"].map(|name| element.parameter(name));
                let ratio = self.divide(l, l0);
                let factor = -2.0 * k * self.multiply_add(ratio, ratio, -1.0);
                Some(d.map(|component| factor * component))
            }
            "gravitationalforce" => {
                let strength = self.divide(-element.parameter("G") * mi * mj, squared);
                Some(n.map(|component| strength * component))
            }
            "vortexforce" => {
                let [kbs, kvc] = ["kbs", "kvc"].map(|name| element.parameter(name));
                let factor = self.divide(kvc, squared);
                let turned = [-n[1], n[0], n[2]];
                let on = |axis: usize| factor * self.multiply_add(kbs, turned[axis], -w[axis]);
                Some(std::array::from_fn(on))
            }
            _ => None,
        }
    }

    /// The force on a single particle; `None` if the force is a pair force or has only one way to evaluate it.
    pub fn on_particle(
        self,
        element: &ForceElement,
        mass: f64,
        velocity: Vector,
    ) -> Option<Vector> {
        let uniform = || ["fx", "fy", "fz"].map(|name| element.parameter(name));
        match element.schema.tag {
            "simplegravity" => Some(uniform().map(|component| mass * component)),
            "constantforce" => Some(uniform()),
            "dragdamping" => {
                let b = element.parameter("b");
                Some(velocity.map(|component| -b * component))
            }
            _ => None,
        }
    }
}
