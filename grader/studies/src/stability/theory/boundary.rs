//! Largest stable time step, found by bisection and confirmed by long runs on both sides.
//!
//! Growth of one part in 10⁶ per step shows only after 10⁶ steps. The bisection therefore uses the spectral radius of
//! the measured matrix. Runs at 0.99 and 1.01 times the boundary confirm it, with enough steps to grow by `e¹²`, up to
//! a limit: a growing mode must exceed the initial amplitude of the others.

use scene::schema::IntegratorSchema;
use simulator::integrator::REGISTRY;
use simulator::simulation::Simulation;

use super::measured::Linear;

/// A radius above 1 by more than this counts as growth. Eigenvalues of matrices of 16 rows have rounding errors of
/// about 1e-15, and of √1e-15 only if two of them coincide, within 1e-15 of the boundary.
const GROWTH: f64 = 1e-9;

/// Range of the search, as `h ω`.
pub const RANGE: [f64; 2] = [1e-4, 1e6];

/// Trial steps per decade.
const PER_DECADE: i32 = 20;

/// Maximum number of steps of a confirming run.
const MAX_STEPS: u64 = 100_000;

/// Least growth, as a power of e, that tells the motion of several modes from beats: enough for a mode that begins with
/// a hundredth of the amplitude of the others.
const TOLD_FROM_BEATS: f64 = 6.0;

/// The stability boundary of a linear scene with a method.
#[derive(Debug, Clone, PartialEq)]
pub struct Boundary {
    /// The method.
    pub method: &'static str,
    /// The scene.
    pub scene: String,
    /// The largest stable `h ω` by theory; 0 if none is stable, infinite if all are.
    pub theory: f64,
    /// The same as measured; 0 if the smallest step tried is unstable, infinite if the largest is stable.
    pub measured: f64,
    /// Confirming runs at 0.99 and 1.01 times the boundary: number of steps, and whether the motion decays below and
    /// grows above. `None` if there is no boundary, or if several modes grow too slowly there for a run to show it.
    pub confirmed: Option<(u64, bool)>,
}

impl Boundary {
    /// Whether some of the steps tried are stable and others are not.
    pub fn exists(&self) -> bool {
        self.measured.is_finite() && self.measured > 0.0
    }

    /// The difference of the two relative to theory; 0 if both say none or all.
    pub fn error(&self) -> f64 {
        match self.theory == self.measured {
            true => 0.0,
            false if self.theory.is_finite() && self.theory > 0.0 => {
                (self.measured / self.theory - 1.0).abs()
            }
            false => f64::INFINITY,
        }
    }

    /// Whether they agree within 1 %, and long runs confirm it.
    pub fn agrees(&self) -> bool {
        self.error() <= 0.01 && self.confirmed.is_none_or(|(_, confirmed)| confirmed)
    }
}

/// The boundaries of oscillators and chains, for every method that supports them.
pub fn boundaries(quick: bool) -> Vec<Boundary> {
    let zetas: &[f64] = if quick {
        &[0.0, 0.1, 1.0, 3.0]
    } else {
        &[0.0, 0.001, 0.01, 0.1, 0.3, 0.5, 0.9, 1.0, 1.5, 3.0, 10.0, 100.0]
    };
    let mut scenes: Vec<Linear> = zetas.iter().map(|zeta| Linear::oscillator(*zeta)).collect();
    let chains = if quick { &zetas[..2] } else { zetas };
    scenes.extend(chains.iter().map(|zeta| Linear::chain(8, *zeta)));
    let of_scene = |scene: &Linear| -> Vec<Boundary> {
        let takers = REGISTRY.iter().filter(|kind| scene.is_taken_by(&kind.schema));
        takers.map(|kind| boundary(scene, &kind.schema)).collect()
    };
    use rayon::prelude::*;
    scenes.par_iter().flat_map_iter(of_scene).collect()
}

/// The boundary of one scene with one method.
pub fn boundary(scene: &Linear, integrator: &'static IntegratorSchema) -> Boundary {
    let is_stable = |a: f64| scene.radius(integrator, a) <= 1.0 + GROWTH;
    let [first, last] = RANGE.map(f64::log10);
    let tries = ((last - first) * f64::from(PER_DECADE)).round() as i32;
    let at = |number: i32| 10.0_f64.powf(first + f64::from(number) / f64::from(PER_DECADE));
    let measured = match (0..=tries).find(|number| !is_stable(at(*number))) {
        None => f64::INFINITY,
        Some(0) => 0.0,
        Some(number) => {
            let (mut stable, mut unstable) = (at(number - 1), at(number));
            while unstable / stable > 1.0 + 1e-6 {
                let middle = (stable * unstable).sqrt();
                *(if is_stable(middle) { &mut stable } else { &mut unstable }) = middle;
            }
            stable
        }
    };
    let mut boundary = Boundary {
        method: integrator.name,
        scene: scene.name.clone(),
        theory: scene.limit(integrator),
        measured,
        confirmed: None,
    };
    if boundary.exists() {
        boundary.confirmed = confirm(scene, integrator, measured);
    }
    boundary
}

/// Runs the scene on both sides of the boundary. `None` if no run of [`MAX_STEPS`] shows the growth above it.
fn confirm(
    scene: &Linear,
    integrator: &'static IntegratorSchema,
    limit: f64,
) -> Option<(u64, bool)> {
    let radius = scene.radius(integrator, 1.01 * limit);
    let steps = (12.0 / radius.ln()).ceil().clamp(200.0, MAX_STEPS as f64) as u64;
    if scene.modes.len() > 1 && steps as f64 * radius.ln() < TOLD_FROM_BEATS {
        return None;
    }
    // Ratio of the largest speed in the second half to that in the first half.
    let growth = |a: f64| -> f64 {
        let mut scene = scene.scene(integrator, a, steps);
        for (number, particle) in scene.particles.iter_mut().enumerate() {
            if !particle.fixed {
                particle.position[0] += 0.1 * (1.7 * number as f64).sin();
            }
        }
        let rest = scene.particles.clone();
        let mut simulation = Simulation::new(&scene);
        let mut largest = [0.0_f64; 2];
        for step in 0..steps {
            if !simulation.advance().is_ok_and(|more| more) {
                return f64::INFINITY;
            }
            let half = usize::from(2 * step >= steps);
            let velocities = simulation.state().velocities;
            for (number, particle) in rest.iter().enumerate() {
                if !particle.fixed {
                    largest[half] = largest[half].max(velocities[2 * number].abs());
                }
            }
        }
        largest[1] / largest[0]
    };
    // Threshold between no growth and theoretical growth: an undamped motion has beats, so its largest speed varies.
    let between = (0.25 * steps as f64 * radius.ln()).exp();
    Some((steps, growth(0.99 * limit) < between && growth(1.01 * limit) > between))
}
