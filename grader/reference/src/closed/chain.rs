//! Chain of equal masses and springs between two walls, moving along its line.
//!
//! ```text
//! u_i = Σ_j s_ij (p_j cos ω_j t + q_j/ω_j sin ω_j t)        p_j = Σ_i s_ij u_i(0), q_j = Σ_i s_ij u_i'(0)
//! s_ij = √(2/(n+1)) sin(π i j/(n+1))        ω_j = 2 √(k/m) sin(π j/(2 (n+1)))
//! ```
//!
//! `u_i` is the displacement of mass `i` from its equilibrium at equal spacing. The springs' rest length cancels.

use std::f64::consts::PI;

use scene::Scene;

use super::{Closed, parameter};

/// A chain along the x axis; its first and last particles are fixed.
pub fn chain(scene: &Scene) -> Closed {
    let (x0, v0) = (scene.positions(), scene.velocities());
    let n = scene.particles.len() - 2;
    let omega = 2.0 * (parameter(scene, "springforce", "k") / scene.particles[1].mass).sqrt();
    let (start, end) = (x0[0], x0[2 * (n + 1)]);
    let rest = move |i: usize| start + (end - start) * i as f64 / (n + 1) as f64;
    let shape = move |i: usize, j: usize| {
        (2.0 / (n + 1) as f64).sqrt() * (PI * (i * j) as f64 / (n + 1) as f64).sin()
    };
    let project = |value: &dyn Fn(usize) -> f64| -> Vec<f64> {
        (1..=n).map(|j| (1..=n).map(|i| shape(i, j) * value(i)).sum()).collect()
    };
    let p = project(&|i| x0[2 * i] - rest(i));
    let q = project(&|i| v0[2 * i]);
    Closed::new(omega, move |t, x, v| {
        x.copy_from_slice(&x0);
        v.copy_from_slice(&v0);
        for i in 1..=n {
            let (mut u, mut rate) = (0.0, 0.0);
            for j in 1..=n {
                let omega = omega * (PI * j as f64 / (2 * (n + 1)) as f64).sin();
                let (sine, cosine) = (omega * t).sin_cos();
                u += shape(i, j) * (p[j - 1] * cosine + q[j - 1] / omega * sine);
                rate += shape(i, j) * (q[j - 1] * cosine - p[j - 1] * omega * sine);
            }
            x[2 * i] = rest(i) + u;
            v[2 * i] = rate;
        }
    })
}
