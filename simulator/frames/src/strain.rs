//! Strain of the triangles of elastic bodies, and its colours.
//!
//! ```text
//! strain = max |σ − 1|    of the principal stretches σ1 ≥ σ2, the singular values of F
//! σ1² + σ2² = tr G⁻¹H     σ1 σ2 = J     G, H the scalar products of two sides: undeformed, and now
//! ```
//!
//! In the plane, `J` is negative where a triangle is turned inside out, and `σ2` with it. The colour scale is matplotlib's
//! viridis (Smith and van der Walt, 2015), perceptually uniform, from violet for 0 to yellow; between nine of its colours,
//! colours are interpolated.

use scene::{ForceElement, Scene};

use crate::point;

/// Viridis at equal distances.
const VIRIDIS: [[u8; 3]; 9] = [
    [68, 1, 84],
    [71, 45, 123],
    [59, 82, 139],
    [44, 114, 142],
    [33, 145, 140],
    [40, 174, 128],
    [94, 201, 98],
    [173, 220, 48],
    [253, 231, 37],
];

/// The triangles of a scene's elastic bodies.
pub(crate) struct Strain {
    pub(crate) triangles: Vec<Triangle>,
    /// The strain of the last colour.
    pub(crate) full: f64,
}

/// A triangle, and its sides while it is not deformed.
pub(crate) struct Triangle {
    pub(crate) corners: [usize; 3],
    sides: Sides,
}

impl Strain {
    pub(crate) fn of(scene: &Scene, full: f64) -> Self {
        let triangle = |element: &ForceElement| {
            let corners = <[usize; 3]>::try_from(&element.particles[..]).ok()?;
            let undeformed = element.undeformed();
            let sides = Sides::of([0, 1, 2].map(|corner| undeformed[corner]));
            Some(Triangle { corners, sides })
        };
        let elements = scene.forces.iter().filter(|element| element.schema.is_triangle());
        Self { triangles: elements.filter_map(triangle).collect(), full }
    }

    /// The colour of a triangle.
    pub(crate) fn color(
        &self,
        triangle: &Triangle,
        positions: &[f64],
        dimension: usize,
    ) -> [u8; 3] {
        let now = Sides::of(triangle.corners.map(|corner| point(positions, corner, dimension)));
        color(triangle.sides.strain_of(&now, dimension == 2) / self.full)
    }
}

/// The scalar products of the sides `u` and `v` at the first corner, and the z coordinate of `u × v`.
struct Sides {
    products: [f64; 3],
    turn: f64,
}

impl Sides {
    fn of([a, b, c]: [[f64; 3]; 3]) -> Self {
        let [u, v] = [b, c].map(|end| [0, 1, 2].map(|axis| end[axis] - a[axis]));
        let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum();
        Self { products: [dot(u, u), dot(u, v), dot(v, v)], turn: u[0] * v[1] - u[1] * v[0] }
    }

    /// The square of twice the area.
    fn determinant(&self) -> f64 {
        let [uu, uv, vv] = self.products;
        (uu * vv - uv * uv).max(0.0)
    }

    /// The strain of a triangle with these sides that has the sides `now`; whether both lie in the plane.
    fn strain_of(&self, now: &Self, is_plane: bool) -> f64 {
        let ([a, b, c], [p, q, r]) = (self.products, now.products);
        let trace = (c * p - 2.0 * b * q + a * r) / self.determinant();
        let ratio = if is_plane {
            now.turn / self.turn
        } else {
            (now.determinant() / self.determinant()).sqrt()
        };
        // (σ1 ± σ2)² = tr G⁻¹H ± 2J.
        let [sum, difference] = [ratio, -ratio].map(|ratio| (trace + 2.0 * ratio).max(0.0).sqrt());
        let stretches = [0.5 * (sum + difference), 0.5 * (sum - difference)];
        stretches.iter().map(|stretch| (stretch - 1.0).abs()).fold(0.0, f64::max)
    }
}

/// The colour of a share of the scale; beyond it, the last.
fn color(share: f64) -> [u8; 3] {
    let place = share.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
    let first = (place as usize).min(VIRIDIS.len() - 2);
    let mix = place - first as f64;
    [0, 1, 2].map(|channel| {
        let [low, high] = [first, first + 1].map(|number| f64::from(VIRIDIS[number][channel]));
        (low + mix * (high - low)).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strain_is_the_largest_change_of_a_principal_stretch() {
        let rest = [[0.2, 0.1, 0.0], [1.3, 0.4, 0.0], [0.6, 1.2, 0.0]];
        // Stretches along axes that are turned, then turned again.
        let map = |[s1, s2]: [f64; 2], [x, y, _]: [f64; 3]| {
            let (sine, cosine) = 0.7_f64.sin_cos();
            let (u, v) = (s1 * (cosine * x + sine * y), s2 * (cosine * y - sine * x));
            let (sine, cosine) = 1.9_f64.sin_cos();
            [cosine * u - sine * v + 3.0, sine * u + cosine * v, 0.0]
        };
        let strain = |stretches: [f64; 2], is_plane: bool| {
            let now = Sides::of(rest.map(|corner| map(stretches, corner)));
            Sides::of(rest).strain_of(&now, is_plane)
        };
        for (stretches, expected) in [
            ([1.0, 1.0], 0.0),
            ([1.25, 0.9], 0.25),
            ([1.1, 0.6], 0.4),
            ([0.5, 0.5], 0.5),
            ([1.0, 0.0], 1.0),
        ] {
            for is_plane in [true, false] {
                let error = strain(stretches, is_plane) - expected;
                assert!(error.abs() < 1e-7, "{stretches:?}: {error:e}");
            }
        }
        // Inside out: −1 is two away from 1. In space, there is no inside.
        assert!((strain([1.0, -1.0], true) - 2.0).abs() < 1e-12);
        assert!(strain([1.0, -1.0], false).abs() < 1e-7);
    }

    #[test]
    fn colours_go_from_violet_to_yellow_and_grow_lighter() {
        let lightness = |[r, g, b]: [u8; 3]| {
            0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b)
        };
        let colors: Vec<[u8; 3]> = (0..=40).map(|n| color(f64::from(n) / 40.0)).collect();
        assert_eq!((colors[0], colors[40], color(7.0)), (VIRIDIS[0], VIRIDIS[8], VIRIDIS[8]));
        assert!(colors.windows(2).all(|pair| lightness(pair[0]) < lightness(pair[1])));
    }
}
