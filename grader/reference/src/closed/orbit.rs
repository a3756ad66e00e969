//! Two bodies under gravitation: their relative position moves on a conic section.
//!
//! ```text
//! d'' = −μ d/|d|³        μ = G (m0 + m1), 1/a = 2/r0 − |w0|²/μ, σ = d0·w0/√μ
//! t √(μ/a³) = E + σ/√a (1 − cos E) − (1 − r0/a) sin E        Kepler's equation, from the start
//! d = f d0 + g w0        f = 1 − a/r0 (1 − cos E)            g = t − √(a³/μ) (E − sin E)
//! w = f' d0 + g' w0      f' = −√(μa)/(r r0) sin E            g' = 1 − a/r (1 − cos E)
//! r = a + (r0 − a) cos E + σ √a sin E
//! ```
//!
//! Lagrange's coefficients need no perihelion, and hold for the circle. Source: R. H. Battin, *An Introduction
//! to the Mathematics and Methods of Astrodynamics*, section 4.3.

use scene::Scene;

use super::{Closed, parameter};

/// Particles 0 and 1 under one `<gravitationalforce>`, bound to each other.
pub fn orbit(scene: &Scene) -> Closed {
    let (x0, v0) = (scene.positions(), scene.velocities());
    let dimension = scene.dimension.count();
    let [first, second] = [0, 1].map(|particle| scene.particles[particle].mass);
    let total = first + second;
    let mu = parameter(scene, "gravitationalforce", "G") * total;
    let difference = |values: &[f64]| -> Vec<f64> {
        (0..dimension).map(|axis| values[dimension + axis] - values[axis]).collect()
    };
    let (d0, w0) = (difference(&x0), difference(&v0));
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let r0 = dot(&d0, &d0).sqrt();
    let a = 1.0 / (2.0 / r0 - dot(&w0, &w0) / mu);
    let sigma = dot(&d0, &w0) / mu.sqrt();
    let mean_motion = (mu / (a * a * a)).sqrt();
    let nearest = a * (1.0 - ((1.0 - r0 / a).powi(2) + sigma * sigma / a).sqrt());
    // The angular velocity is largest at the smallest distance.
    let rate = (mu * a).sqrt() / (nearest * nearest);
    Closed::new(rate, move |t, x, v| {
        let anomaly = eccentric_anomaly(mean_motion * t, sigma / a.sqrt(), 1.0 - r0 / a);
        let (sine, cosine) = anomaly.sin_cos();
        let r = a + (r0 - a) * cosine + sigma * a.sqrt() * sine;
        let f = 1.0 - a / r0 * (1.0 - cosine);
        let g = t - (anomaly - sine) / mean_motion;
        let f_rate = -(mu * a).sqrt() / (r * r0) * sine;
        let g_rate = 1.0 - a / r * (1.0 - cosine);
        for axis in 0..dimension {
            let (i, j) = (axis, dimension + axis);
            let centre_velocity = (first * v0[i] + second * v0[j]) / total;
            let centre = (first * x0[i] + second * x0[j]) / total + centre_velocity * t;
            let d = f * d0[axis] + g * w0[axis];
            let w = f_rate * d0[axis] + g_rate * w0[axis];
            x[i] = centre - second / total * d;
            x[j] = centre + first / total * d;
            v[i] = centre_velocity - second / total * w;
            v[j] = centre_velocity + first / total * w;
        }
    })
}

/// The `E` with `E + s (1 − cos E) − c sin E = m`, by Newton's method; the left side grows with `E`, since
/// `s² + c² < 1`.
fn eccentric_anomaly(m: f64, s: f64, c: f64) -> f64 {
    let mut anomaly = m;
    for _ in 0..64 {
        let (sine, cosine) = anomaly.sin_cos();
        let value = anomaly + s * (1.0 - cosine) - c * sine - m;
        let slope = 1.0 + s * sine - c * cosine;
        // Newton's step may overshoot on eccentric orbits; the solution is at most half a turn away.
        let update = (value / slope).clamp(-1.0, 1.0);
        anomaly -= update;
        if update.abs() <= f64::EPSILON * anomaly.abs() {
            break;
        }
    }
    anomaly
}
