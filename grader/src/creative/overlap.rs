//! Particles that overlap, as they are drawn.
//!
//! Particles are sorted into cells as wide as the largest particle, so that those that overlap are in neighbouring
//! cells: linear in the number of particles, unless many of them are small and one is large.

use std::collections::BTreeMap;

use scene::Scene;

use super::motion::Motion;
use super::run::short;

/// Circles that touch do not overlap: they may do so by rounding.
const TOUCHING: f64 = 1.0 - 1e-9;

/// Two particles that overlap.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Overlap {
    particles: [usize; 2],
    distance: f64,
}

/// Looks for particles that overlap.
pub(super) fn check(scene: &Scene, motion: &Motion) -> Result<String, String> {
    let mut states = 0;
    let mut first: Option<(f64, Overlap)> = None;
    for (number, time) in motion.times.iter().enumerate() {
        if let Some(overlap) = overlap(scene, motion.frame(number)) {
            states += 1;
            first.get_or_insert((*time, overlap));
        }
    }
    let n_frames = motion.times.len();
    let Some((time, Overlap { particles: [i, j], distance })) = first else {
        return Ok(format!("none in {n_frames} states, {:.3} s apart", motion.interval()));
    };
    let radii = scene.particles[i].radius + scene.particles[j].radius;
    Err(format!(
        "in {states} of {n_frames} states; first at t = {time:.3} s: particles {i} and {j} are {} m apart, \
         and their radii sum to {} m\nhelp: make them smaller, or move them apart",
        short(distance),
        short(radii)
    ))
}

/// Two particles that overlap in a state, if any do: those with the lowest numbers.
fn overlap(scene: &Scene, positions: &[f64]) -> Option<Overlap> {
    let radii: Vec<f64> = scene.particles.iter().map(|particle| particle.radius).collect();
    let width = 2.0 * radii.iter().copied().fold(0.0, f64::max);
    if width <= 0.0 {
        return None;
    }
    let dimension = scene.dimension.count();
    let point = |particle: usize| {
        let mut point = [0.0; 3];
        point[..dimension].copy_from_slice(&positions[particle * dimension..][..dimension]);
        point
    };
    // A cast saturates: particles that are too far away for their cell share one.
    let cell = |particle: usize| point(particle).map(|value| (value / width).floor() as i64);
    let mut cells: BTreeMap<[i64; 3], Vec<usize>> = BTreeMap::new();
    let mut found: Option<Overlap> = None;
    for j in 0..radii.len() {
        let [x, y, z] = cell(j);
        for neighbour in 0..27 {
            let offset = [neighbour % 3 - 1, neighbour / 3 % 3 - 1, neighbour / 9 - 1];
            let key = [
                x.saturating_add(offset[0]),
                y.saturating_add(offset[1]),
                z.saturating_add(offset[2]),
            ];
            for i in cells.get(&key).into_iter().flatten().copied() {
                // Each list ascends, and a later pair counts if its first number is lower.
                if found.is_some_and(|found| found.particles[0] <= i) {
                    break;
                }
                let (a, b) = (point(i), point(j));
                let squared: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
                let distance = squared.sqrt();
                if distance < TOUCHING * (radii[i] + radii[j]) {
                    found = Some(Overlap { particles: [i, j], distance });
                }
            }
        }
        cells.entry([x, y, z]).or_default().push(j);
    }
    found
}
