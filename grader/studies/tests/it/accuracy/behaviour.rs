//! Energy and momentum over long runs, compared with theory.
//!
//! On `x'' = −ω² x` each step of a method multiplies the state by a matrix, so the energy after `n` steps is known:
//!
//! ```text
//! explicit     E_n = E_0 (1 + h²ω²)^n
//! implicit     E_n = E_0 (1 + h²ω²)^{−n}
//! symplectic   v² + ω²x² − hω² x v is conserved: E_n/E_0 within (1 ± hω/2)/(1 ∓ hω/2)
//! Verlet       v² + ω²x² (1 − h²ω²/4) is conserved: E_n/E_0 within 1 − h²ω²/4 and its reciprocal
//! Runge–Kutta  E_n = E_0 |R(ihω)|^{2n}, |R|² = 1 − (hω)⁶/72 + (hω)⁸/576
//! midpoint     E_n = E_0
//! BDF2         E_n = E_0 |c₁ λ₁ⁿ + c₂ λ₂ⁿ|², the roots of (3 − 2ihω) λ² − 4λ + 1 = 0, from 1 and 1/(1 − ihω)
//! ```

use nalgebra::Complex;
use scene::schema::{IntegratorOptions, IntegratorSchema};
use scene::{ParseOptions, Scene, xml};
use simulator::integrator::REGISTRY;
use simulator::simulation::Simulation;
use simulator::vocabulary;

use super::problem;

const OMEGA: f64 = 2.0;
const STEP: f64 = 0.01;

/// A particle on a spring of rest length zero, `ω = 2`.
fn oscillator() -> Scene {
    let text = r#"<scene>
        <duration time="10"/><integrator type="explicit-euler" dt="0.01"/>
        <particle m="1" px="0" py="0" vx="0" vy="0" fixed="1"/>
        <particle m="0.5" px="1.25" py="-0.5" vx="0.5" vy="0.75" fixed="0"/>
        <edge i="0" j="1"/><springforce edge="0" k="2" l0="0"/>
    </scene>"#;
    xml::parse(text, "oscillator", &vocabulary(), &ParseOptions::default()).unwrap().scene
}

fn integrator(name: &str) -> &'static IntegratorSchema {
    &REGISTRY.iter().find(|kind| kind.schema.name == name).unwrap().schema
}

/// The scene with another method, and the tightest tolerances.
fn by(scene: &Scene, name: &str) -> Scene {
    let mut options = IntegratorOptions::defaults(integrator(name));
    if name == "projected-newton" {
        options.set("tolerance", "1e-12").unwrap();
    }
    Scene { integrator: integrator(name), integrator_options: options, ..scene.clone() }
}

fn energies(scene: &Scene, mut visit: impl FnMut(u64, f64)) {
    let mut simulation = Simulation::new(scene);
    loop {
        let energies = simulation.energies().unwrap();
        visit(simulation.statistics().steps, energies.kinetic + energies.potential);
        if !simulation.advance().unwrap() {
            break;
        }
    }
}

#[test]
fn explicit_euler_gains_and_the_implicit_ones_lose_energy_at_the_predicted_rate() {
    let growth = 1.0 + STEP * STEP * OMEGA * OMEGA;
    let rates = [
        ("explicit-euler", growth),
        ("linearized-implicit-euler", 1.0 / growth),
        ("implicit-euler", 1.0 / growth),
        ("projected-newton", 1.0 / growth),
        ("fast-mass-spring", 1.0 / growth),
    ];
    for (name, rate) in rates {
        let mut start = 0.0;
        let mut last = 0.0;
        energies(&by(&oscillator(), name), |step, energy| {
            start = if step == 0 { energy } else { start };
            last = energy / start / rate.powi(step as i32);
        });
        // A thousand steps, each with a rounding error of a few ε, or ε/(hω) if the unknowns are positions: 1e-11.
        assert!((last - 1.0).abs() < 1e-9, "{name}: {last}");
    }
}

#[test]
fn the_energy_of_symplectic_euler_stays_within_its_bound() {
    let mut scene = by(&oscillator(), "symplectic-euler");
    scene.duration = 1000.0;
    let half = 0.5 * STEP * OMEGA;
    let (mut start, mut least, mut most) = (0.0, f64::INFINITY, 0.0_f64);
    energies(&scene, |step, energy| {
        start = if step == 0 { energy } else { start };
        (least, most) = (least.min(energy / start), most.max(energy / start));
    });
    let bound = (1.0 + half) / (1.0 - half);
    assert!(most <= bound && least >= 1.0 / bound, "{least} … {most}, bound {bound}");
    // Check that the scene moves: a constant state would pass too.
    assert!(most - least > 0.1 * half, "{least} … {most}");
}

/// The least and the largest energy over a thousand steps of `a = hω`, and that at the end, in terms of the first.
fn range_of_energy(name: &str, a: f64) -> [f64; 3] {
    let mut scene = by(&oscillator(), name);
    scene.time_step = a / OMEGA;
    scene.duration = 1000.0 * scene.time_step;
    let (mut start, mut range) = (0.0, [f64::INFINITY, 0.0, 0.0]);
    energies(&scene, |step, energy| {
        start = if step == 0 { energy } else { start };
        let ratio = energy / start;
        range = [ratio.min(range[0]), ratio.max(range[1]), ratio];
    });
    range
}

#[test]
fn the_energy_of_velocity_verlet_stays_within_its_bound() {
    for a in [0.02, 0.5, 1.9] {
        let least = 1.0 - 0.25 * a * a;
        let [low, high, _] = range_of_energy("velocity-verlet", a);
        let rounding = 1.0 + 1e-12;
        assert!(low >= least / rounding && high <= rounding / least, "{a}: {low} … {high}");
        assert!(high - low > 0.05 * a * a, "{a}: {low} … {high}");
    }
}

#[test]
fn runge_kutta_loses_energy_at_the_predicted_rate() {
    for a in [0.1_f64, 0.5, 2.0] {
        let rate = 1.0 - a.powi(6) / 72.0 + a.powi(8) / 576.0;
        let [_, high, end] = range_of_energy("runge-kutta-4", a);
        let (expected, rounding) = (rate.powi(1000), 1e-11);
        assert!((end / expected - 1.0).abs() < rounding, "{a}: {end}, not {expected}");
        assert!(high <= 1.0 + rounding, "{a}: {high}");
    }
}

#[test]
fn implicit_midpoint_keeps_a_quadratic_energy_at_any_step() {
    for a in [0.02, 1.0, 30.0] {
        let [low, high, _] = range_of_energy("implicit-midpoint", a);
        assert!(high - low < 1e-11, "{a}: {low} … {high}");
    }
}

#[test]
fn bdf2_loses_energy_at_the_predicted_rate() {
    for a in [0.02, 0.1, 0.3] {
        let (one, i) = (Complex::from(1.0), Complex::i());
        let root = (one + i * 2.0 * a).sqrt();
        let [first, second] =
            [1.0, -1.0].map(|sign| (root * sign + 2.0) / (one * 3.0 - i * 2.0 * a));
        // The second root, about 1/3, has left nothing.
        let part = (one / (one - i * a) - second) / (first - second);
        let expected = (part * first.powu(1000)).norm_sqr();
        let [_, high, end] = range_of_energy("bdf2", a);
        assert!((end / expected - 1.0).abs() < 1e-9, "{a}: {end}, not {expected}");
        assert!(high <= 1.0, "{a}: {high}");
    }
}

/// Momentum, and angular momentum about the origin.
fn momenta(scene: &Scene, x: &[f64], v: &[f64]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (number, particle) in scene.particles.iter().enumerate() {
        let (i, m) = (2 * number, particle.mass);
        sum[0] += m * v[i];
        sum[1] += m * v[i + 1];
        sum[2] += m * (x[i] * v[i + 1] - x[i + 1] * v[i]);
    }
    sum
}

/// The largest relative changes of momentum and of angular momentum over a run.
fn drift(scene: &Scene) -> [f64; 2] {
    let mut simulation = Simulation::new(scene);
    let state = simulation.state();
    let start = momenta(scene, state.positions, state.velocities);
    let scale = scene.particles.iter().map(|particle| {
        let [x, y, _] = particle.position;
        let [u, v, _] = particle.velocity;
        particle.mass * u.hypot(v) * x.hypot(y).max(1.0)
    });
    let scale: f64 = scale.sum();
    let mut drift = [0.0_f64; 2];
    while simulation.advance().unwrap() {
        let state = simulation.state();
        let now = momenta(scene, state.positions, state.velocities);
        let change = |axis: usize| (now[axis] - start[axis]).abs() / scale;
        drift = [drift[0].max(change(0)).max(change(1)), drift[1].max(change(2))];
    }
    drift
}

#[test]
fn every_method_conserves_momentum_under_internal_forces() {
    for name in ["kepler-orbit", "squared-springs", "vortex-pair"] {
        let mut scene = problem(name).scene();
        scene.time_step /= 8.0;
        for kind in REGISTRY {
            let refuses = kind.schema.refuses;
            if scene.forces.iter().any(|force| refuses(force).is_some()) {
                continue;
            }
            let [linear, _] = drift(&by(&scene, kind.schema.name));
            // A few hundred steps, each with linear systems solved to a few ε.
            assert!(linear < 1e-11, "{name}, {}: {linear:e}", kind.schema.name);
        }
    }
}

#[test]
fn only_symplectic_methods_conserve_angular_momentum() {
    for name in ["kepler-orbit", "squared-springs"] {
        let mut scene = problem(name).scene();
        scene.time_step /= 8.0;
        for symplectic in ["symplectic-euler", "velocity-verlet", "implicit-midpoint"] {
            let [_, angular] = drift(&by(&scene, symplectic));
            assert!(angular < 1e-12, "{name}, {symplectic}: {angular:e}");
        }
        for other in ["explicit-euler", "linearized-implicit-euler", "implicit-euler"] {
            let [_, angular] = drift(&by(&scene, other));
            // Each step changes the angular momentum by h² times force and velocity: first order overall.
            assert!(angular > 1e-4, "{name}, {other}: {angular:e}");
        }
    }
}
