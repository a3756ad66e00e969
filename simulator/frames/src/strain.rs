//! Strain of the triangles and tetrahedra of elastic bodies, and its colours.
//!
//! ```text
//! strain = max |σ − 1|    of the principal stretches σ1 ≥ σ2 ≥ σ3, the singular values of F
//! triangle       σ1² + σ2² = tr G⁻¹H     σ1 σ2 = J     G, H the scalar products of two sides: undeformed, and now
//! tetrahedron    σ² the roots of λ³ − I λ² + A λ − J²     I = tr G⁻¹H, A = tr(G N)/det G, of three sides
//! ```
//!
//! `N` are the scalar products of the cross products of the sides. In the plane, `J` is negative where a triangle is turned
//! inside out, and `σ2` with it; so are those of a tetrahedron and `σ3`. Of tetrahedra, the faces that no other one has are
//! drawn. The colour scale is matplotlib's
//! viridis (Smith and van der Walt, 2015), perceptually uniform, from violet for 0 to yellow; between nine of its colours,
//! colours are interpolated.

use std::collections::HashMap;
use std::f64::consts::TAU;

use scene::{ForceElement, Scene};
use serde::Serialize;

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

/// The elements of a scene's elastic bodies.
pub(crate) struct Strain {
    pub(crate) elements: Vec<Element>,
    /// The strain of the last colour.
    pub(crate) full: f64,
}

/// An element of one colour.
pub(crate) struct Element {
    /// Its particles.
    pub(crate) corners: Vec<usize>,
    /// The triangles that are drawn, by their particles.
    pub(crate) faces: Vec<[usize; 3]>,
    rest: Shape,
}

/// A shape at rest.
enum Shape {
    Triangle(Sides),
    Tetrahedron(Edges),
}

/// Data for the pages' own colouring by strain (`strain.js`).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StrainPalette {
    /// Six hexadecimal digits each: equal distances of the scale.
    colors: Vec<String>,
    elements: Vec<StrainElement>,
}

/// An element that has faces to draw.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct StrainElement {
    corners: Vec<usize>,
    faces: Vec<[usize; 3]>,
    /// The undeformed corners.
    rest: Vec<[f64; 3]>,
}

impl StrainPalette {
    /// Those of a scene; `None` if it has no elastic body with triangles or tetrahedra.
    pub fn of(scene: &Scene) -> Option<Self> {
        let elements = Strain::of(scene, 1.0).elements.into_iter().zip(elements(scene));
        let elements = elements.filter(|(element, _)| !element.faces.is_empty());
        let elements: Vec<StrainElement> = elements
            .map(|(Element { corners, faces, .. }, of)| StrainElement {
                corners,
                faces,
                rest: of.undeformed().to_vec(),
            })
            .collect();
        let colors = VIRIDIS.map(|[red, green, blue]| format!("{red:02x}{green:02x}{blue:02x}"));
        (!elements.is_empty()).then(|| Self { colors: colors.to_vec(), elements })
    }
}

fn elements(scene: &Scene) -> impl Iterator<Item = &ForceElement> {
    scene.forces.iter().filter(|element| element.schema.is_element())
}

impl Strain {
    pub(crate) fn of(scene: &Scene, full: f64) -> Self {
        let mut counts: HashMap<[usize; 3], usize> = HashMap::new();
        for face in elements(scene).flat_map(|element| faces(&element.particles)) {
            *counts.entry(sorted(face)).or_default() += 1;
        }
        let element = |element: &ForceElement| {
            let undeformed = element.undeformed();
            let (rest, is_solid) = match undeformed[..] {
                [a, b, c] => (Shape::Triangle(Sides::of([a, b, c])), false),
                [a, b, c, d] => (Shape::Tetrahedron(Edges::of([a, b, c, d])), true),
                _ => unreachable!("elements have three or four corners"),
            };
            let mut faces = faces(&element.particles);
            faces.retain(|face| !is_solid || counts[&sorted(*face)] == 1);
            Element { corners: element.particles.to_vec(), faces, rest }
        };
        Self { elements: elements(scene).map(element).collect(), full }
    }

    /// The colour of an element.
    pub(crate) fn color(&self, element: &Element, positions: &[f64], dimension: usize) -> [u8; 3] {
        let at = |place: usize| point(positions, element.corners[place], dimension);
        let strain = match &element.rest {
            Shape::Triangle(rest) => rest.strain_of(&Sides::of([0, 1, 2].map(at)), dimension == 2),
            Shape::Tetrahedron(rest) => rest.strain_of(&Edges::of([0, 1, 2, 3].map(at))),
        };
        color(strain / self.full)
    }
}

/// The faces of a tetrahedron, or a triangle.
fn faces(corners: &[usize]) -> Vec<[usize; 3]> {
    match *corners {
        [a, b, c] => vec![[a, b, c]],
        [a, b, c, d] => vec![[a, b, c], [a, b, d], [a, c, d], [b, c, d]],
        _ => Vec::new(),
    }
}

fn sorted(mut face: [usize; 3]) -> [usize; 3] {
    face.sort_unstable();
    face
}

/// The edges of a tetrahedron from its first corner.
struct Edges([[f64; 3]; 3]);

impl Edges {
    fn of([a, b, c, d]: [[f64; 3]; 4]) -> Self {
        Self([b, c, d].map(|end| [0, 1, 2].map(|axis| end[axis] - a[axis])))
    }

    /// The cross products of the other two.
    fn normals(&self) -> [[f64; 3]; 3] {
        let [u, v, w] = self.0;
        [cross(v, w), cross(w, u), cross(u, v)]
    }

    /// The strain of a tetrahedron with these edges that has the edges `now`.
    fn strain_of(&self, now: &Self) -> f64 {
        let ([rest, rest_normals], [edges, normals]) =
            ([self.0, self.normals()], [now.0, now.normals()]);
        let determinant = dot(rest[0], rest_normals[0]);
        // The sum of the products of the scalar products of each two.
        let sum = |a: [[f64; 3]; 3], b: [[f64; 3]; 3]| -> f64 {
            let pairs = (0..9).map(|place| (place / 3, place % 3));
            pairs.map(|(i, j)| dot(a[i], a[j]) * dot(b[i], b[j])).sum::<f64>() / determinant.powi(2)
        };
        let (trace, areas) = (sum(rest_normals, edges), sum(rest, normals));
        let volume = dot(edges[0], normals[0]) / determinant;
        let mut stretches = roots(trace, areas, volume * volume).map(|root| root.max(0.0).sqrt());
        stretches[2] *= volume.signum();
        stretches.iter().map(|stretch| (stretch - 1.0).abs()).fold(0.0, f64::max)
    }
}

/// The roots of `λ³ − a λ² + b λ − c`, which are real: the largest first.
fn roots(a: f64, b: f64, c: f64) -> [f64; 3] {
    let mean = a / 3.0;
    let p = (mean * mean - b / 3.0).max(0.0);
    if p == 0.0 {
        return [mean; 3];
    }
    let q = mean.powi(3) - 0.5 * mean * b + 0.5 * c;
    let angle = (q / p.powf(1.5)).clamp(-1.0, 1.0).acos() / 3.0;
    [0.0, -1.0, 1.0].map(|third| mean + 2.0 * p.sqrt() * (angle + third * TAU / 3.0).cos())
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The scalar products of the sides `u` and `v` at the first corner, and the z coordinate of `u × v`.
struct Sides {
    products: [f64; 3],
    turn: f64,
}

impl Sides {
    fn of([a, b, c]: [[f64; 3]; 3]) -> Self {
        let [u, v] = [b, c].map(|end| [0, 1, 2].map(|axis| end[axis] - a[axis]));
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
    fn strain_of_a_tetrahedron_is_the_largest_change_of_a_principal_stretch() {
        let rest = [[0.2, 0.1, 0.3], [1.3, 0.4, -0.1], [0.6, 1.2, 0.2], [0.4, 0.3, 1.1]];
        // Stretches along axes that are turned, then turned again.
        let turn = |angle: f64, [x, y, z]: [f64; 3]| {
            let (sine, cosine) = angle.sin_cos();
            let (x, y) = (cosine * x - sine * y, sine * x + cosine * y);
            [x, cosine * y - sine * z, sine * y + cosine * z]
        };
        let strain = |stretches: [f64; 3]| {
            let map = |corner: [f64; 3]| {
                let turned = turn(0.7, corner);
                turn(1.9, [0, 1, 2].map(|axis| stretches[axis] * turned[axis]))
            };
            Edges::of(rest).strain_of(&Edges::of(rest.map(map)))
        };
        for (stretches, expected) in [
            ([1.0; 3], 0.0),
            ([1.25, 0.9, 1.1], 0.25),
            ([1.1, 0.6, 1.3], 0.4),
            ([0.5; 3], 0.5),
            ([1.0, 1.0, 0.0], 1.0),
            ([1.2, 0.9, -0.8], 1.8),
        ] {
            let error = strain(stretches) - expected;
            // Where roots coincide, rounding moves them by a root of it.
            assert!(error.abs() < 1e-4, "{stretches:?}: {error:e}");
        }
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
