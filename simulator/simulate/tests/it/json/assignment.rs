//! The assignment's own scenes, if they are available.

use needs::needs;
use std::collections::BTreeSet;
use std::fs;

use crate::shared::assignment_scenes;

use super::{load, masses, pins};

/// Counts of an OBJ file by its lines alone: vertices, pairs of the faces, and the area of the faces
/// cut into two triangles each.
fn by_lines(obj: &str) -> (usize, usize, f64) {
    let numbers = |line: &str, statement: &str| -> Option<Vec<f64>> {
        let rest = line.strip_prefix(statement)?.strip_prefix(' ')?;
        let number = |word: &str| word.split('/').next().unwrap().parse().unwrap();
        Some(rest.split_whitespace().map(number).collect())
    };
    let vertices: Vec<Vec<f64>> = obj.lines().filter_map(|line| numbers(line, "v")).collect();
    let faces: Vec<Vec<f64>> = obj.lines().filter_map(|line| numbers(line, "f")).collect();
    let mut pairs = BTreeSet::new();
    let mut area = 0.0;
    for face in &faces {
        let corners: Vec<usize> = face.iter().map(|corner| *corner as usize - 1).collect();
        for a in &corners {
            pairs.extend(corners.iter().filter(|b| a < b).map(|b| (*a, *b)));
        }
        for other in 2..corners.len() {
            let [p, q, r] = [corners[0], corners[other - 1], corners[other]].map(|c| &vertices[c]);
            let [u, v] = [q, r].map(|to| [0, 1, 2].map(|axis| to[axis] - p[axis]));
            let cross =
                [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            area += 0.5 * cross.iter().map(|c| c * c).sum::<f64>().sqrt();
        }
    }
    (vertices.len(), pairs.len(), area)
}

#[needs("test -d ${SPRING_ORACLE_JACOBSON:-../shared/jacobson}")]
#[test]
fn the_scenes_of_the_assignment_load() {
    for path in assignment_scenes() {
        let json = fs::read_to_string(&path).unwrap();
        let (_, list) = json.split_once("\"b\"").unwrap();
        let list = &list[list.find('[').unwrap() + 1..list.find(']').unwrap()];
        let mut pinned: Vec<usize> =
            list.split(',').map(|vertex| vertex.trim().parse::<usize>().unwrap() - 1).collect();
        pinned.sort_unstable();
        let (n_vertices, n_pairs, area) =
            by_lines(&fs::read_to_string(path.with_extension("obj")).unwrap());

        let scene = load(&path, true).unwrap_or_else(|error| panic!("{error}")).scene;
        let name = path.display();
        assert_eq!(scene.particles.len(), n_vertices, "{name}");
        assert_eq!((scene.edges.len(), scene.forces.len()), (n_pairs, n_pairs + 1), "{name}");
        assert_eq!(pins(&scene), pinned, "{name}");
        let total: f64 = masses(&scene).iter().sum();
        let expected = if json.contains("\"m\"") { n_vertices as f64 } else { area };
        assert!((total - expected).abs() < 1e-12 * expected, "{name}: {total}, {expected}");
    }
}
