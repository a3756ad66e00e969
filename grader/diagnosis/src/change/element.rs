//! Elements with a shape at rest, read wrongly or weighted by other sizes.
//!
//! ```text
//! reading   other undeformed corners; the particles in another order than these; Lamé's μ and λ by other formulas; damping
//! weight    a factor c q^a of an element, q its size at rest, or that of the state divided by it
//! ```
//!
//! Lamé's parameters become `E` and `ν` again, so that each law is evaluated as it is. Sizes: the area or volume between undeformed
//! corners; of elements without these, that of the initial positions, or the length of the path through them.

use nalgebra::{DMatrix, Vector3};
use scene::schema::{Coordinate, Domain, ForceSchema, Initial};
use scene::{ForceElement, Particle};

/// How an element is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Misread {
    /// Its undeformed corners are the initial positions.
    Initial,
    /// The matrix of its undeformed edges is transposed; of a triangle in space, in axes along its first edge.
    Transposed,
    /// The particles at these places are exchanged, and the undeformed corners are not.
    Exchanged([usize; 2]),
    /// Its particles are in reverse order, and the undeformed corners are not.
    Reversed,
    /// Its Lamé parameters have other formulas.
    Lame(Lame),
    /// Its damping is so many halves of what it is.
    Damped(i32),
}

/// Halves of damping, in words.
const DAMPED: [(i32, &str); 3] = [
    (-2, "has the damping by beta with the wrong sign"),
    (4, "has twice the damping by beta"),
    (1, "has half of the damping by beta"),
];

/// Formulas of Lamé's parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lame {
    /// `λ = E ν/(1 − ν²)`.
    PlaneStress,
    /// `λ = E ν/((1 + ν)(1 − 2ν))`.
    Solid,
    /// `λ = E ν/(1 − 2ν)`.
    WithoutSum,
    /// `λ = 0`.
    NoLambda,
    /// `μ = E/(1 + ν)`.
    WithoutTwo,
    /// `μ` half as large.
    Half,
    /// `μ = E/2`, `λ = 0`.
    WithoutNu,
    /// Each in the place of the other.
    Exchanged,
}

impl Lame {
    /// All, in words.
    const ALL: [(Self, &str); 8] = [
        (Self::PlaneStress, "has λ = E ν/(1 − ν²)"),
        (Self::Solid, "has λ = E ν/((1 + ν) (1 − 2ν))"),
        (Self::WithoutSum, "has λ = E ν/(1 − 2ν)"),
        (Self::NoLambda, "lacks the part with λ"),
        (Self::WithoutTwo, "has μ = E/(1 + ν)"),
        (Self::Half, "has half of μ"),
        (Self::WithoutNu, "lacks ν"),
        (Self::Exchanged, "has μ and λ exchanged"),
    ];

    /// `E` and `ν` with which the right formulas give these parameters.
    fn of(self, modulus: f64, nu: f64, is_solid: bool) -> [f64; 2] {
        let solid = modulus * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
        let plane = modulus * nu / (1.0 - nu * nu);
        let right = [0.5 * modulus / (1.0 + nu), if is_solid { solid } else { plane }];
        let [mu, lambda] = match self {
            Self::PlaneStress => [right[0], plane],
            Self::Solid => [right[0], solid],
            Self::WithoutSum => [right[0], solid * (1.0 + nu)],
            Self::NoLambda => [right[0], 0.0],
            Self::WithoutTwo => [2.0 * right[0], right[1]],
            Self::Half => [0.5 * right[0], right[1]],
            Self::WithoutNu => [0.5 * modulus, 0.0],
            Self::Exchanged => [right[1], right[0]],
        };
        let nu = lambda / if is_solid { 2.0 * (lambda + mu) } else { lambda + 2.0 * mu };
        [2.0 * mu * (1.0 + nu), nu]
    }
}

fn is_solid(schema: &ForceSchema) -> bool {
    let mut all = schema.parameters.iter();
    all.any(|parameter| parameter.domain == Domain::SolidPoissonRatio)
}

impl Misread {
    /// Those of a force, in words.
    pub(super) fn all(schema: &ForceSchema) -> Vec<(Self, String)> {
        let names = schema.stencil.particles();
        if names.len() < 3 {
            return Vec::new();
        }
        let mut all = Vec::new();
        let pairs = (0..names.len()).flat_map(|j| (0..j).map(move |i| [i, j]));
        for [i, j] in pairs {
            let words = format!("has {} and {} exchanged", names[i], names[j]);
            all.push((Self::Exchanged([i, j]), words));
        }
        all.push((Self::Reversed, "has its particles in reverse order".to_owned()));
        if schema.has_parameter("beta") {
            all.extend(DAMPED.map(|(halves, words)| (Self::Damped(halves), words.to_owned())));
        }
        if schema.is_element() {
            let words = "takes the initial positions for the undeformed corners";
            all.push((Self::Initial, words.to_owned()));
            let words = "has the matrix of its undeformed edges transposed";
            all.push((Self::Transposed, words.to_owned()));
            let is_usual = if is_solid(schema) { Lame::Solid } else { Lame::PlaneStress };
            let others = Lame::ALL.iter().filter(|(lame, _)| *lame != is_usual);
            all.extend(others.map(|(lame, words)| (Self::Lame(*lame), (*words).to_owned())));
        }
        all
    }

    /// Changes an element so.
    pub(super) fn read(self, element: &mut ForceElement, particles: &[Particle]) {
        let corners: Vec<[f64; 3]> = match self {
            Self::Exchanged([i, j]) => return element.particles.swap(i, j),
            Self::Reversed => return element.particles.reverse(),
            Self::Lame(lame) => {
                let [modulus, nu] = ["youngsmodulus", "poissonratio"];
                let values = [modulus, nu].map(|name| element.parameter(name));
                let read = lame.of(values[0], values[1], is_solid(element.schema));
                *element.parameter_mut(modulus) = read[0];
                *element.parameter_mut(nu) = read[1];
                return;
            }
            Self::Damped(halves) => {
                *element.parameter_mut("beta") *= 0.5 * f64::from(halves);
                return;
            }
            Self::Initial => element.particles.iter().map(|one| particles[*one].position).collect(),
            Self::Transposed => transposed(&element.undeformed()),
        };
        for (value, parameter) in element.parameters.iter_mut().zip(element.schema.parameters) {
            if let Some(Coordinate { particle, axis }) = parameter.coordinate {
                *value = corners[particle][axis];
            }
        }
    }
}

/// Corners whose edges from the first are the rows of a matrix with the columns of these.
fn transposed(corners: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let at = |corner: usize| Vector3::from(corners[corner]);
    let edges: Vec<Vector3<f64>> = (1..corners.len()).map(|corner| at(corner) - at(0)).collect();
    let edges: Vec<Vector3<f64>> = match edges[..] {
        [u, v] if u.z != 0.0 || v.z != 0.0 => {
            let along = u.normalize();
            let height = u.cross(&v).norm() / u.norm();
            vec![Vector3::new(u.norm(), 0.0, 0.0), Vector3::new(v.dot(&along), height, 0.0)]
        }
        _ => edges,
    };
    let row = |row: usize| {
        let mut edge = [0.0; 3];
        edges.iter().zip(&mut edge).for_each(|(column, entry)| *entry = column[row]);
        edge
    };
    [[0.0; 3]].into_iter().chain((0..edges.len()).map(row)).collect()
}

/// A factor `number · rest^of_rest · (now/rest)^of_change` of an element, of two sizes each: its content and the length from its first
/// to its second particle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weight {
    /// A number.
    pub number: f64,
    /// The powers of content and length at rest.
    pub of_rest: [i32; 2],
    /// Those of what the state has of them.
    pub of_change: [i32; 2],
}

impl Weight {
    /// Those of a force, in words.
    pub(super) fn all(schema: &ForceSchema) -> Vec<(Self, &'static str)> {
        let rest = |number, of_rest| Self { number, of_rest, of_change: [0; 2] };
        let now = |of_change| Self { number: 1.0, of_rest: [0; 2], of_change };
        match (schema.initial, schema.stencil.size()) {
            (_, 4) if schema.is_element() => vec![
                (now([1, 0]), "has the volume of the moment"),
                (rest(1.0, [-1, 0]), "lacks the factor volume"),
                (rest(1.0, [1, 0]), "has the volume twice"),
            ],
            (_, 3) if schema.is_element() => vec![
                (now([1, 0]), "has the area of the moment"),
                (rest(1.0, [-1, 0]), "lacks the factor area"),
                (rest(1.0, [1, 0]), "has the area twice"),
            ],
            (Initial::PathLength, 3) => vec![
                (now([-1, 0]), "is divided by the lengths of the moment"),
                (rest(1.0, [1, 0]), "is not divided by the lengths"),
                (rest(1.0, [1, -1]), "is divided by the first length alone"),
                (rest(2.0, [0, 0]), "is divided by the mean of the lengths"),
            ],
            (Initial::Hinge, _) => vec![
                (now([-1, 0]), "has the areas of the moment"),
                (now([0, 2]), "has the edge of the moment"),
                (now([-1, 2]), "has the edge and the areas of the moment"),
                (rest(1.0, [1, 0]), "is not divided by the areas"),
                (rest(0.5, [1, 0]), "is not divided by the mean of the areas"),
                (rest(1.0, [0, -1]), "has |e| in the place of |e|²"),
                (rest(1.0, [0, -2]), "lacks the factor |e|²"),
                (rest(1.0 / 6.0, [1, -2]), "lacks the factor 6 |e|²/area"),
            ],
            _ => Vec::new(),
        }
    }

    /// The factor of an element with these undeformed corners, or initial positions, at these positions.
    pub(super) fn of(
        &self,
        schema: &ForceSchema,
        rest: &[Vector3<f64>],
        now: &[Vector3<f64>],
    ) -> f64 {
        let [rest, now] = [rest, now].map(|corners| sizes(schema, corners));
        let powers =
            |sizes: [f64; 2], powers: [i32; 2]| sizes[0].powi(powers[0]) * sizes[1].powi(powers[1]);
        let change = [now[0] / rest[0], now[1] / rest[1]];
        self.number * powers(rest, self.of_rest) * powers(change, self.of_change)
    }
}

/// Content and first length.
fn sizes(schema: &ForceSchema, corners: &[Vector3<f64>]) -> [f64; 2] {
    let first = corners[1] - corners[0];
    let area = |edge: Vector3<f64>, side: Vector3<f64>| 0.5 * edge.cross(&side).norm();
    let content = match schema.initial {
        Initial::PathLength => corners.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum(),
        Initial::Hinge => {
            let of = |corner: usize| area(first, corners[corner] - corners[0]);
            of(2) + of(3)
        }
        _ => {
            let edges: Vec<Vector3<f64>> =
                corners[1..].iter().map(|corner| corner - corners[0]).collect();
            let products =
                DMatrix::from_fn(edges.len(), edges.len(), |a, b| edges[a].dot(&edges[b]));
            let parts: f64 = (1..=edges.len()).map(|n| n as f64).product();
            products.determinant().max(0.0).sqrt() / parts
        }
    };
    [content, first.norm()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn right_formulas_of_the_read_modulus_and_ratio_give_the_wrong_parameters() {
        let (modulus, nu) = (21.0, 0.3);
        let right = |modulus: f64, nu: f64, is_solid: bool| {
            let below = if is_solid { 1.0 - 2.0 * nu } else { 1.0 - nu };
            [0.5 * modulus / (1.0 + nu), modulus * nu / ((1.0 + nu) * below)]
        };
        for is_solid in [true, false] {
            let [mu, lambda] = right(modulus, nu, is_solid);
            for (lame, expected) in [
                (Lame::PlaneStress, [mu, modulus * nu / 0.91]),
                (Lame::Solid, [mu, modulus * nu / (1.3 * 0.4)]),
                (Lame::WithoutSum, [mu, modulus * nu / 0.4]),
                (Lame::NoLambda, [mu, 0.0]),
                (Lame::WithoutTwo, [2.0 * mu, lambda]),
                (Lame::Half, [0.5 * mu, lambda]),
                (Lame::WithoutNu, [0.5 * modulus, 0.0]),
                (Lame::Exchanged, [lambda, mu]),
            ] {
                let [read, ratio] = lame.of(modulus, nu, is_solid);
                let found = right(read, ratio, is_solid);
                let errors = [0, 1].map(|which| (found[which] - expected[which]).abs());
                assert!(errors.iter().all(|error| *error < 1e-12), "{lame:?}: {found:?}");
            }
        }
    }

    #[test]
    fn transposed_edges_are_rows() {
        let corners = [[0.5, 0.0, 1.0], [1.5, 2.0, 4.0], [4.5, 5.0, 7.0], [7.5, 8.0, 10.0]];
        let edges = [[1.0, 4.0, 7.0], [2.0, 5.0, 8.0], [3.0, 6.0, 9.0]];
        assert_eq!(transposed(&corners)[1..], edges);
        // In space, (1, 0) and (2, 3) along the first edge and across it.
        let triangle = [[0.0; 3], [0.0, 0.0, 1.0], [0.0, 3.0, 2.0]];
        assert_eq!(transposed(&triangle)[1..], [[1.0, 2.0, 0.0], [0.0, 3.0, 0.0]]);
    }
}
