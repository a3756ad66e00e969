//! Independent particles in a field.
//!
//! ```text
//! throw       x = x0 + v0 t + g t²/2                 v = v0 + g t
//! with drag   x = x0 + u t + (v0 − u)(1 − e^{−ct})/c  v = u + (v0 − u) e^{−ct}      c = b/m, u = g/c
//! in wind     m v' = s (4.5 + 1.5 cos 5t, 1 + cos(t + 0.3))                        integrated twice
//! ```

use scene::Scene;

use super::{Closed, parameter};

/// Particles under `<simplegravity>` alone.
pub fn thrown(scene: &Scene) -> Closed {
    let (x0, v0) = (scene.positions(), scene.velocities());
    let (gravity, dimension) = (gravity(scene), scene.dimension.count());
    Closed::new(0.0, move |t, x, v| {
        for place in 0..x.len() {
            let g = gravity[place % dimension];
            x[place] = x0[place] + t * (v0[place] + 0.5 * g * t);
            v[place] = v0[place] + g * t;
        }
    })
}

/// Particles under `<simplegravity>` and `<dragdamping>`.
pub fn dragged(scene: &Scene) -> Closed {
    let (x0, v0) = (scene.positions(), scene.velocities());
    let (gravity, dimension) = (gravity(scene), scene.dimension.count());
    let drag = parameter(scene, "dragdamping", "b");
    let rates: Vec<f64> = scene.particles.iter().map(|particle| drag / particle.mass).collect();
    let fastest = rates.iter().copied().fold(0.0, f64::max);
    Closed::new(fastest, move |t, x, v| {
        for place in 0..x.len() {
            let c = rates[place / dimension];
            let terminal = gravity[place % dimension] / c;
            let excess = v0[place] - terminal;
            x[place] = x0[place] + terminal * t - excess * (-c * t).exp_m1() / c;
            v[place] = terminal + excess * (-c * t).exp();
        }
    })
}

/// A single particle in `<windforce>`: alone, it has the phase `t`.
pub fn windy(scene: &Scene) -> Closed {
    let (x0, v0) = (scene.positions(), scene.velocities());
    let a = parameter(scene, "windforce", "strength") / scene.particles[0].mass;
    Closed::new(5.0, move |t, x, v| {
        let (lag_sine, lag_cosine) = 0.3_f64.sin_cos();
        v[0] = v0[0] + a * (4.5 * t + 0.3 * (5.0 * t).sin());
        x[0] = x0[0] + v0[0] * t + a * (2.25 * t * t + 0.06 * (1.0 - (5.0 * t).cos()));
        v[1] = v0[1] + a * (t + (t + 0.3).sin() - lag_sine);
        x[1] = x0[1] + v0[1] * t + a * (0.5 * t * t - (t + 0.3).cos() + lag_cosine - t * lag_sine);
    })
}

fn gravity(scene: &Scene) -> [f64; 3] {
    ["fx", "fy", "fz"].map(|name| parameter(scene, "simplegravity", name))
}
