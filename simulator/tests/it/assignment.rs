//! The assignment's own scenes against the assignment's algorithm in plain dense algebra: one matrix, one
//! factorisation, 50 rounds a step. That side uses no code of the simulator, not even its mesh reader.

use needs::needs;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use nalgebra::{DMatrix, MatrixXx3};
use scene::{ParseOptions, load};
use serde_json::Value;
use simulator::simulation::Simulation;
use simulator::vocabulary;

use crate::support::shared::assignment_scenes;

const STEPS: usize = 30;
const ROUNDS: usize = 50;
const TIME_STEP: f64 = 1.0 / 30.0;
const PIN_WEIGHT: f64 = 1e10;

type Point = [f64; 3];

fn difference(a: Point, b: Point) -> Point {
    [0, 1, 2].map(|axis| a[axis] - b[axis])
}

fn length(a: Point) -> f64 {
    a.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn dot(a: Point, b: Point) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Input of the assignment's program.
struct Assignment {
    stiffness: f64,
    masses: Vec<f64>,
    vertices: Vec<Point>,
    springs: Vec<[usize; 2]>,
    pinned: Vec<usize>,
    wind: bool,
}

impl Assignment {
    fn read(json: &Path) -> Self {
        let scene: Value = serde_json::from_str(&fs::read_to_string(json).unwrap()).unwrap();
        let mesh = json.parent().unwrap().join(scene["obj"].as_str().unwrap());
        let (mut vertices, mut faces) = (Vec::new(), Vec::new());
        for line in fs::read_to_string(mesh).unwrap().lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            match words.first() {
                Some(&"v") => {
                    vertices.push([1, 2, 3].map(|axis| words[axis].parse::<f64>().unwrap()));
                }
                Some(&"f") => {
                    let corner =
                        |word: &&str| word.split('/').next().unwrap().parse::<usize>().unwrap() - 1;
                    faces.push(words[1..].iter().map(corner).collect::<Vec<_>>());
                }
                _ => {}
            }
        }
        let mut springs = BTreeSet::new();
        for face in &faces {
            for (first, i) in face.iter().enumerate() {
                springs.extend(face[first + 1..].iter().map(|j| [*i.min(j), *i.max(j)]));
            }
        }
        let masses = match scene.get("m") {
            Some(mass) => vec![mass.as_f64().unwrap(); vertices.len()],
            None => voronoi_areas(&vertices, &faces),
        };
        let pinned = scene.get("b").map_or(Vec::new(), |list| {
            let list = list.as_array().unwrap();
            list.iter().map(|vertex| vertex.as_u64().unwrap() as usize - 1).collect()
        });
        Self {
            stiffness: scene["k"].as_f64().unwrap(),
            masses,
            springs: springs.into_iter().collect(),
            pinned,
            wind: scene.get("wind").is_some_and(|wind| wind == true),
            vertices,
        }
    }

    /// `p` after every step, at rest before the first.
    fn run(&self) -> Vec<Vec<Point>> {
        let n = self.vertices.len();
        let mut q = DMatrix::<f64>::zeros(n, n);
        for (i, mass) in self.masses.iter().enumerate() {
            q[(i, i)] += mass / (TIME_STEP * TIME_STEP);
        }
        for &[i, j] in &self.springs {
            for (a, b, sign) in [(i, i, 1.0), (j, j, 1.0), (i, j, -1.0), (j, i, -1.0)] {
                q[(a, b)] += sign * self.stiffness;
            }
        }
        self.pinned.iter().for_each(|pin| q[(*pin, *pin)] += PIN_WEIGHT);
        let factor = q.cholesky().unwrap();
        let rest = |[i, j]: [usize; 2]| length(difference(self.vertices[i], self.vertices[j]));
        let rest: Vec<f64> = self.springs.iter().map(|spring| rest(*spring)).collect();

        let (mut before, mut now) = (self.vertices.clone(), self.vertices.clone());
        let mut states = vec![now.clone()];
        for step in 0..STEPS {
            // Of the current positions, and the same in all rounds.
            let force = |now: &Point| self.force(*now, step as f64 * TIME_STEP);
            let forces: Vec<Point> = now.iter().map(force).collect();
            let mut p = now.clone();
            for _ in 0..ROUNDS {
                // d, from the positions that the round starts with.
                let vectors: Vec<Point> = self
                    .springs
                    .iter()
                    .zip(&rest)
                    .map(|(&[i, j], rest)| {
                        let v = difference(p[i], p[j]);
                        v.map(|x| x * rest / length(v))
                    })
                    .collect();
                // b − Q p, spring by spring and vertex by vertex: Q is solved for the change of p. Solved for p
                // itself, the rounding of the factor, on positions of size 1, pulls like a force, and moves
                // the flag's vertices of 1e-4 kg by 2e-9 within the 30 steps.
                let mut b = MatrixXx3::<f64>::zeros(n);
                for i in 0..n {
                    let free = self.masses[i] / (TIME_STEP * TIME_STEP);
                    for axis in 0..3 {
                        let inertia = 2.0 * now[i][axis] - before[i][axis] - p[i][axis];
                        b[(i, axis)] = free * inertia + forces[i][axis];
                    }
                }
                for &pin in &self.pinned {
                    for axis in 0..3 {
                        b[(pin, axis)] += PIN_WEIGHT * (self.vertices[pin][axis] - p[pin][axis]);
                    }
                }
                for (&[i, j], d) in self.springs.iter().zip(&vectors) {
                    for axis in 0..3 {
                        let pull = self.stiffness * (d[axis] - (p[i][axis] - p[j][axis]));
                        b[(i, axis)] += pull;
                        b[(j, axis)] -= pull;
                    }
                }
                factor.solve_mut(&mut b);
                for i in 0..n {
                    (0..3).for_each(|axis| p[i][axis] += b[(i, axis)]);
                }
            }
            before = std::mem::replace(&mut now, p);
            states.push(now.clone());
        }
        states
    }

    /// External force on a vertex that is there at a time.
    fn force(&self, vertex: Point, time: f64) -> Point {
        let mut force = [0.0, -9.8, 0.0];
        if self.wind {
            let extent = |axis: usize| {
                let values = || self.vertices.iter().map(|vertex| vertex[axis]);
                values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min)
            };
            let phi = vertex[0] / length([0, 1, 2].map(extent)) + time;
            force[0] += 3.0 + 1.5 * (1.0 + (5.0 * phi).cos());
            force[1] += 1.0 + (0.3 + phi).cos();
            force[2] += phi.sin();
        }
        force
    }
}

/// Of each triangle, each corner has the part that is nearest to it: `Σ (|e|² cot of the angle across)/8` over
/// its two edges; of an obtuse one, the obtuse corner has half of the area, the others a quarter.
fn voronoi_areas(vertices: &[Point], faces: &[Vec<usize>]) -> Vec<f64> {
    let mut areas = vec![0.0; vertices.len()];
    for face in faces {
        for other in 2..face.len() {
            let corners = [face[0], face[other - 1], face[other]];
            let points = corners.map(|corner| vertices[corner]);
            let edge = |from: usize, to: usize| difference(points[to % 3], points[from % 3]);
            let (u, v) = (edge(0, 1), edge(0, 2));
            let area = 0.5 * (dot(u, u) * dot(v, v) - dot(u, v).powi(2)).sqrt();
            let cosines = [0, 1, 2].map(|k| dot(edge(k, k + 1), edge(k, k + 2)));
            for k in 0..3 {
                areas[corners[k]] += match cosines.iter().position(|cosine| *cosine < 0.0) {
                    Some(obtuse) if obtuse == k => area / 2.0,
                    Some(_) => area / 4.0,
                    None => {
                        // The cotangent at a corner is the dot product there over twice the area.
                        let share = |to: usize, across: usize| {
                            let edge = edge(k, to);
                            dot(edge, edge) * cosines[across % 3] / (2.0 * area) / 8.0
                        };
                        share(k + 1, k + 2) + share(k + 2, k + 1)
                    }
                };
            }
        }
    }
    areas
}

#[needs("test -d ${SPRING_ORACLE_JACOBSON:-../shared/jacobson}")]
#[test]
#[ignore = "long: a minute"]
fn long_assignment_scenes_match_the_assignments_algorithm() {
    for path in assignment_scenes() {
        let expected = Assignment::read(&path).run();
        let parsed = load(&path, &vocabulary(), &ParseOptions::default()).unwrap();
        let mut simulation = Simulation::new(&parsed.scene);
        let mut worst = 0.0_f64;
        for state in &expected {
            let flat = state.as_flattened();
            assert_eq!(flat.len(), simulation.state().positions.len());
            for (found, expected) in simulation.state().positions.iter().zip(flat) {
                worst = worst.max((found - expected).abs());
                assert!(found.is_finite() && expected.is_finite());
            }
            simulation.advance().unwrap();
        }
        assert_eq!(simulation.statistics().steps as usize, STEPS);
        let name = path.file_name().unwrap().display();
        assert!(worst < 1e-9, "{name}: {worst:e}");
    }
}
