//! Masses from areas: the mixed Voronoi area of each vertex, at density 1.
//!
//! A triangle of area `A` with angles `α_i` gives to its corner `i`, with `j` and `k` the others,
//!
//! ```text
//! no obtuse angle     A (w_j + w_k) / 2 (w_i + w_j + w_k),   w_i = l_i cos α_i
//! α_i obtuse          A/2
//! another one is      A/4
//! ```
//!
//! where `l_i` is the side opposite to corner `i`, and `w_i` are the barycentric weights of the
//! circumcentre: without an obtuse angle these are the areas nearer to a corner than to the others.
//! They add up to `A`. Faces of more than three corners are fans of triangles around their first, and
//! those of two have no area. Shares add up in the order of libigl's `massmatrix`, all first corners,
//! then all second and all third ones, so that the sums are the same bits. Time is in proportion to the triangles.
//!
//! Source: Meyer, Desbrun, Schröder, Barr, *Discrete Differential-Geometry Operators for Triangulated
//! 2-Manifolds* (2003), section 3.3; the area is Kahan's, *Miscalculating Area and Angles of a
//! Needle-like Triangle*.

use super::obj::{ElementKind, Mesh};
use super::springs::distance;

/// The area around each vertex, in the order of the mesh; 0 where no triangle has one, and not finite
/// where it is out of range.
pub(super) fn voronoi_areas(mesh: &Mesh) -> Vec<f64> {
    let mut shares = Vec::new();
    for (kind, corners) in mesh.elements() {
        let [first, rest @ ..] = corners else { continue };
        if kind == ElementKind::Face {
            for pair in rest.windows(2) {
                let triangle = [first, &pair[0], &pair[1]].map(|corner| corner.vertex as usize);
                shares
                    .push((triangle, corner_areas(triangle.map(|vertex| mesh.positions[vertex]))));
            }
        }
    }
    let mut areas = vec![0.0; mesh.positions.len()];
    for corner in 0..3 {
        for (triangle, shares) in &shares {
            areas[triangle[corner]] += shares[corner];
        }
    }
    areas
}

/// The area that a triangle contributes to each of its corners.
fn corner_areas([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    let sides = [distance(&b, &c), distance(&c, &a), distance(&a, &b)];
    let area = area(sides);
    if area == 0.0 {
        // The cosines of a triangle that is a point have no value.
        return [0.0; 3];
    }
    let opposite = |i: usize| [sides[i], sides[(i + 1) % 3], sides[(i + 2) % 3]];
    let cosines: [f64; 3] = std::array::from_fn(|i| {
        let [l, m, n] = opposite(i);
        (n * n + m * m - l * l) / (m * n * 2.0)
    });
    if let Some(obtuse) = cosines.iter().position(|cosine| *cosine < 0.0) {
        return std::array::from_fn(|i| if i == obtuse { 0.5 * area } else { 0.25 * area });
    }
    let weights: [f64; 3] = std::array::from_fn(|i| cosines[i] * sides[i]);
    let sum = weights[0] + weights[1] + weights[2];
    let partial = weights.map(|weight| weight / sum * area);
    std::array::from_fn(|i| 0.5 * (partial[(i + 1) % 3] + partial[(i + 2) % 3]))
}

/// The area of a triangle by its sides.
fn area(mut sides: [f64; 3]) -> f64 {
    sides.sort_by(|a, b| b.total_cmp(a));
    let [a, b, c] = sides;
    let product = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c));
    // Rounded, the sides of a triangle that is a line may be just too short for one.
    0.25 * product.max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangle_area_is_split_by_nearest_corner() {
        let mut random = fastrand::Rng::with_seed(1);
        for _ in 0..20 {
            // Angles between 45 and 75 degrees on the unit circle around the origin, in a tilted plane.
            let angles = [50.0 + 20.0 * random.f64(), 50.0 + 20.0 * random.f64()];
            let [a, b] = angles.map(f64::to_radians);
            let at = |angle: f64| [angle.cos(), 0.6 * angle.sin(), 0.8 * angle.sin() + 3.0];
            let shares = corner_areas([at(0.0), at(2.0 * a), at(2.0 * (a + b))]);
            // Each corner has half of the two triangles that join it, a neighbour and the circumcentre;
            // the angle there is twice the one at the corner opposite.
            let c = std::f64::consts::PI - a - b;
            let [ab, bc, ca] = [a, b, c].map(|angle| 0.25 * (2.0 * angle).sin());
            let expected = [ab + ca, ab + bc, bc + ca];
            for (share, expected) in shares.iter().zip(expected) {
                assert!((share - expected).abs() < 1e-14, "{shares:?} {expected:?}");
            }
        }
    }

    #[test]
    fn an_obtuse_triangle_gives_half_to_its_obtuse_corner() {
        // Base 4, height 1, its top outside the base: area 2.
        let corners = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [-1.0, 1.0, 0.0]];
        for turn in 0..3 {
            let turned = std::array::from_fn(|i| corners[(i + turn) % 3]);
            let expected: [f64; 3] = std::array::from_fn(|i| [1.0, 0.5, 0.5][(i + turn) % 3]);
            for (share, expected) in corner_areas(turned).iter().zip(expected) {
                assert!((share - expected).abs() < 1e-14, "{turn}");
            }
        }
    }

    #[test]
    fn a_triangle_that_is_a_line_or_a_point_has_no_area() {
        let line = [[0.0; 3], [0.1, 0.2, 0.3], [0.3, 0.6, 0.9]];
        assert!(corner_areas(line).iter().sum::<f64>() < 1e-8);
        assert_eq!(corner_areas([[7.0, 8.0, 9.0]; 3]), [0.0; 3]);
    }
}
