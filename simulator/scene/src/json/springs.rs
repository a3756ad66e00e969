//! Springs of a mesh: the vertices they connect and their rest lengths.
//!
//! ```text
//! face  a b c d   every pair: ab ac ad bc bd cd     (a quad brings both diagonals)
//! line  a b c     every step: ab bc
//! rest length     |x_i − x_j|
//! ```
//!
//! A pair of vertices has one spring, however many faces and lines join it, and springs come in the
//! order in which their pairs first appear. A spring between two vertices at one place has a rest length of 0: it pulls
//! towards one place and needs no direction. Time is in proportion to the pairs, of which a mesh may
//! have [`MAX_PAIRS`].

use std::collections::HashSet;

use super::obj::{Corner, ElementKind, Mesh};
use super::source::{Source, Warnings};
use crate::SceneLimits;
use crate::error::{JsonProblem, SceneError};

/// The most pairs that faces and lines may join, each counted as often as it is joined. A face of n
/// vertices alone has n²/2.
pub(super) const MAX_PAIRS: usize = 10_000_000;

/// A spring, and its length at rest.
pub(super) struct MeshSpring {
    pub(super) particles: [usize; 2],
    pub(super) rest_length: f64,
}

/// The springs of `mesh`, which stands in `source`; at most `most`.
///
/// # Errors
/// If there are too many pairs, or a spring is too long; under `strict` where a line element joins
/// two vertices that are joined already, or where there are no springs.
pub(super) fn springs(
    mesh: &Mesh,
    most: u64,
    source: &mut Source<'_>,
    warnings: &mut Warnings,
) -> Result<Vec<MeshSpring>, SceneError> {
    let mut springs = Vec::new();
    let mut joined = HashSet::new();
    let mut n_pairs = 0;
    for (kind, corners) in mesh.elements() {
        n_pairs += match kind {
            ElementKind::Face => corners.len().saturating_mul(corners.len() - 1) / 2,
            ElementKind::Line => corners.len() - 1,
        };
        if n_pairs > MAX_PAIRS {
            let problem = JsonProblem::TooManyPairs { limit: MAX_PAIRS };
            return Err(source.error(corners[0].place as usize, problem));
        }
        SceneLimits::check(n_pairs, most, "forces")
            .map_err(|problem| SceneError::whole_file(source.name, problem))?;
        for (start, a) in corners.iter().enumerate() {
            let others = match kind {
                ElementKind::Face => &corners[start + 1..],
                ElementKind::Line => &corners[start + 1..(start + 2).min(corners.len())],
            };
            for b in others {
                let [i, j] = [a, b].map(|corner: &Corner| corner.vertex);
                if joined.insert((i.min(j), i.max(j))) {
                    springs.push(spring(mesh, [a, b], source)?);
                } else if corners.len() == 2 {
                    let [i, j] = [i, j].map(|vertex| vertex as usize + 1);
                    warnings.add(source, a.place as usize, JsonProblem::JoinedTwice { i, j })?;
                }
            }
        }
    }
    if springs.is_empty() {
        let first = mesh.places.first().map_or(0, |place| *place as usize);
        warnings.add(source, first, JsonProblem::NoSprings)?;
    }
    Ok(springs)
}

fn spring(
    mesh: &Mesh,
    corners: [&Corner; 2],
    source: &mut Source<'_>,
) -> Result<MeshSpring, SceneError> {
    let particles @ [i, j] = corners.map(|corner| corner.vertex as usize);
    let rest_length = distance(&mesh.positions[i], &mesh.positions[j]);
    if rest_length.is_finite() {
        return Ok(MeshSpring { particles, rest_length });
    }
    let problem = JsonProblem::RestLength { i: i + 1, j: j + 1 };
    Err(source.error(corners[0].place as usize, problem))
}

/// The distance of two points; infinite or NaN where it is out of range.
pub(super) fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}
