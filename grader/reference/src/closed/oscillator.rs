//! Damped oscillator: a particle on a spring fixed at the origin.
//!
//! ```text
//! m y'' + b y' + k y = 0        γ = b/2m, ω0² = k/m
//! γ < ω0:  y = e^{−γt} (y0 cos ωt + (v0 + γ y0)/ω sin ωt)        ω² = ω0² − γ²
//! γ > ω0:  y = A e^{pt} + B e^{qt}                               p, q = −γ ± √(γ² − ω0²)
//! ```
//!
//! If the spring lies along the x axis, `y = x − l0`; if its rest length is zero, `y` is each coordinate separately.
//! `b` is the sum of the spring's damping and the drag.

use scene::Scene;

use super::{Closed, parameter};

/// Particle 1 on a spring to particle 0, which is fixed at the origin.
pub fn oscillator(scene: &Scene) -> Closed {
    let (x0, v0) = (scene.positions(), scene.velocities());
    let mass = scene.particles[1].mass;
    let [stiffness, rest, damping] =
        ["k", "l0", "b"].map(|name| parameter(scene, "springforce", name));
    let gamma = (damping + parameter(scene, "dragdamping", "b")) / (2.0 * mass);
    let squared = stiffness / mass;
    Closed::new(squared.sqrt().max(2.0 * gamma), move |t, x, v| {
        x.copy_from_slice(&x0);
        v.copy_from_slice(&v0);
        for (place, offset) in [(2, rest), (3, 0.0)] {
            let (y, u) = damped(x0[place] - offset, v0[place], gamma, squared, t);
            x[place] = offset + y;
            v[place] = u;
        }
    })
}

/// Displacement and velocity at `t`.
fn damped(y0: f64, v0: f64, gamma: f64, squared: f64, t: f64) -> (f64, f64) {
    let difference = squared - gamma * gamma;
    if difference > 0.0 {
        let omega = difference.sqrt();
        let (sine, cosine) = (omega * t).sin_cos();
        let decay = (-gamma * t).exp();
        let y = decay * (y0 * cosine + (v0 + gamma * y0) / omega * sine);
        let v = decay * (v0 * cosine - (squared * y0 + gamma * v0) / omega * sine);
        (y, v)
    } else {
        let fast = -gamma - (-difference).sqrt();
        // Use that their product is ω0², which avoids cancellation.
        let slow = squared / fast;
        let a = (v0 - fast * y0) / (slow - fast);
        let b = (slow * y0 - v0) / (slow - fast);
        let (a, b) = (a * (slow * t).exp(), b * (fast * t).exp());
        (a + b, slow * a + fast * b)
    }
}
