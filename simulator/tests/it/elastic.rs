//! Elastic bodies against theory: conserved momenta over many steps, and convergence in the mesh.
//!
//! ```text
//! rod         hinges c = α/(2h) on bars of length h       bending stiffness E I = α/2
//! sheet       ε = ∇Φᵀ∇Φ − I is twice Green's strain        a small stretch meets the modulus 4 E
//! ```
//!
//! Equilibria are reached by steps of implicit Euler that are much longer than any period. docs/methods.md states the
//! orders.

use scene::schema::Conserves;
use scene::{ForceElement, ParseOptions, Particle, Scene, xml};
use simulator::force::REGISTRY as FORCES;
use simulator::integrator::REGISTRY as INTEGRATORS;
use simulator::simulation::Simulation;
use simulator::vocabulary;

fn read(text: &str) -> Scene {
    xml::parse(text, "elastic.xml", &vocabulary(), &ParseOptions::default()).unwrap().scene
}

/// Positions at the end.
fn end(scene: &Scene) -> Vec<f64> {
    let mut simulation = Simulation::new(scene);
    while simulation.advance().unwrap() {}
    simulation.state().positions.to_vec()
}

fn particle(x: f64, y: f64, mass: f64, fixed: bool) -> String {
    let fixed = u8::from(fixed);
    format!(r#"<particle m="{mass:?}" px="{x:?}" py="{y:?}" vx="0" vy="0" fixed="{fixed}"/>"#)
}

/// A scene that comes to rest.
fn resting(elements: &str) -> Scene {
    read(&format!(
        r#"<scene><duration time="12000"/><integrator type="implicit-euler" dt="1000"/>{elements}</scene>"#
    ))
}

/// Momentum and angular momentum, and the sums of the sizes of their terms.
fn momenta(scene: &Scene, x: &[f64], v: &[f64]) -> [(f64, f64); 2] {
    let (mut momentum, mut angular) = ((0.0, 0.0), (0.0, 0.0));
    let states = x.as_chunks::<2>().0.iter().zip(v.as_chunks::<2>().0);
    for (particle, (x, v)) in scene.particles.iter().zip(states) {
        let m = particle.mass;
        momentum.0 += m * (v[0] + v[1]);
        momentum.1 += m * (v[0].abs() + v[1].abs());
        angular.0 += m * (x[0] * v[1] - x[1] * v[0]);
        angular.1 += m * ((x[0] * v[1]).abs() + (x[1] * v[0]).abs());
    }
    [momentum, angular]
}

#[test]
fn internal_forces_keep_momenta_over_a_hundred_thousand_steps() {
    let method = INTEGRATORS.iter().find(|kind| kind.schema.name == "symplectic-euler").unwrap();
    let internal = FORCES.iter().map(|kind| &kind.schema).filter(|schema| {
        schema.conserves == Conserves::AngularMomentum && !schema.depends_on().time
    });
    let mut found = 0;
    for schema in internal {
        let mut scene = Scene::new("momenta", scene::Dimension::Two, &method.schema);
        let corners = [(0.0, 0.0, 0.25), (1.25, 0.125, -0.5), (0.375, 1.0, 0.25)];
        scene.particles = corners
            .map(|(x, y, v)| Particle {
                mass: 1.0 + y,
                position: [x, y, 0.0],
                velocity: [v * y, v, 0.0],
                fixed: false,
                radius: 0.1,
                tag: None,
            })
            .to_vec();
        (scene.time_step, scene.duration) = (1e-3, 100.0);
        let given: Vec<(&str, f64)> =
            schema.parameters.iter().map(|each| (each.name, each.samples[0])).collect();
        let particles: Vec<usize> = (0..schema.stencil.size()).collect();
        scene.forces.push(ForceElement::new(schema, &particles, None, schema.values(&given)));
        let mut simulation = Simulation::new(&scene);
        let state = simulation.state();
        let [momentum, angular] = momenta(&scene, state.positions, state.velocities);
        let (mut worst, mut steps) = ([0.0_f64; 2], 0);
        while simulation.advance().unwrap() {
            steps += 1;
            let state = simulation.state();
            let now = momenta(&scene, state.positions, state.velocities);
            for ((worst, start), now) in worst.iter_mut().zip([momentum, angular]).zip(now) {
                *worst = worst.max((now.0 - start.0).abs() / now.1.max(start.1));
            }
        }
        assert_eq!(steps, 100_000);
        // A rounding error of 1e-16 each step, all in one direction, is 1e-11.
        assert!(worst.iter().all(|worst| *worst < 1e-11), "{}: {worst:?}", schema.tag);
        found += 1;
    }
    assert!(found >= 6, "{found}");
}

/// Orders between errors on meshes that are each twice as fine as the one before.
fn orders(errors: &[f64]) -> Vec<f64> {
    errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect()
}

/// The deflection under a load at its end of a rod of `n` bars beyond its fixed bar, relative to Euler and Bernoulli's. The
/// rod begins in the middle of the fixed bar.
fn deflection_of_a_rod(n: u32) -> f64 {
    let (length, alpha, load) = (1.0, 2.0, 1e-4);
    let h = length / (f64::from(n) + 0.5);
    let mut text = String::new();
    for i in 0..n + 2 {
        text += &particle(h * (f64::from(i) - 0.5), 0.0, 1.0, i < 2);
    }
    for i in 0..n + 1 {
        let j = i + 1;
        text += &format!(r#"<elasticbodyspringforce i1="{i}" i2="{j}" alpha="1e5" l0="{h:?}"/>"#);
    }
    for i in 0..n {
        let (j, k) = (i + 1, i + 2);
        text += &format!(
            r#"<elasticbodybendingforce i1="{i}" i2="{j}" i3="{k}" alpha="{alpha:?}" theta0="0"/>"#
        );
    }
    // A soft, long spring to a fixed particle far above is a constant load.
    let (last, far) = (n + 1, n + 2);
    text += &particle(length, 1e6, 1.0, true);
    text += &format!(
        r#"<elasticbodyspringforce i1="{last}" i2="{far}" alpha="{:?}" l0="1"/>"#,
        load * 1e-6
    );
    let positions = end(&resting(&text));
    let expected = load * length * length * length / (3.0 * 0.5 * alpha);
    positions[2 * last as usize + 1] / expected
}

#[test]
fn a_cantilever_of_hinges_converges_to_euler_and_bernoulli() {
    let bars = [4, 8, 16, 32, 64];
    let errors = bars.map(|n| (deflection_of_a_rod(n) - 1.0).abs());
    // The half bar counts: their lengths are not quite halved.
    let shorter = bars.windows(2).map(|n| (f64::from(n[1]) + 0.5) / (f64::from(n[0]) + 0.5));
    let orders: Vec<f64> =
        orders(&errors).iter().zip(shorter).map(|(order, by)| order / by.log2()).collect();
    assert!(orders.iter().all(|order| (order - 2.0).abs() < 0.1), "{errors:?}: {orders:?}");
    assert!(errors[4] < 1e-4, "{errors:?}");
}

/// A sheet of `nx` by `ny` cells of two triangles, the left side fixed, each particle with its share of the mass 1.
fn sheet(size: [f64; 2], cells: [usize; 2], modulus: f64, nu: f64) -> String {
    let [nx, ny] = cells;
    let [width, height] = size;
    let mut text = String::new();
    let cell_mass = 1.0 / (nx * ny) as f64;
    for j in 0..=ny {
        for i in 0..=nx {
            let inner = |place: usize, count: usize| {
                if place == 0 || place == count { 0.5 } else { 1.0 }
            };
            let mass = cell_mass * inner(i, nx) * inner(j, ny);
            let (x, y) = (width * i as f64 / nx as f64, height * j as f64 / ny as f64);
            text += &particle(x, y, mass, i == 0);
        }
    }
    for j in 0..ny {
        for i in 0..nx {
            let a = j * (nx + 1) + i;
            let (b, c, d) = (a + 1, a + nx + 1, a + nx + 2);
            let halves =
                if (i + j) % 2 == 0 { [[a, b, d], [a, d, c]] } else { [[a, b, c], [b, d, c]] };
            for [i1, i2, i3] in halves {
                text += &format!(
                    r#"<elasticbodycstforce i1="{i1}" i2="{i2}" i3="{i3}" youngsmodulus="{modulus:?}" poissonratio="{nu:?}"/>"#
                );
            }
        }
    }
    text
}

/// The length of a sheet of length 1 and weight 1, modulus 1, that hangs from one side: `∫ λ dX`, with the stress
/// `2 λ (λ² − 1) = 1 − X`.
fn length_of_a_hanging_sheet() -> f64 {
    let stretch = |load: f64| {
        let mut stretch = 1.0;
        for _ in 0..50 {
            let (value, slope): (f64, f64) =
                (2.0 * stretch * (stretch * stretch - 1.0), 6.0 * stretch * stretch - 2.0);
            stretch -= (value - load) / slope;
        }
        stretch
    };
    // Simpson's rule.
    let n = 2000;
    let weight = |i: i32| match i {
        0 | 2000 => 1.0,
        i if i % 2 == 1 => 4.0,
        _ => 2.0,
    };
    (0..=n).map(|i| weight(i) * stretch(f64::from(i) / f64::from(n))).sum::<f64>()
        / (3.0 * f64::from(n))
}

#[test]
fn a_sheet_stretched_by_its_weight_converges_to_the_closed_form() {
    let expected = length_of_a_hanging_sheet();
    let errors = [4, 8, 16, 32].map(|n| {
        let elements = sheet([1.0, 1.0], [n, 2], 1.0, 0.0) + r#"<simplegravity fx="1" fy="0"/>"#;
        (end(&resting(&elements))[2 * n] - expected).abs()
    });
    assert!(orders(&errors).iter().all(|order| (order - 2.0).abs() < 0.1), "{errors:?}");
    assert!(errors[3] < 1e-4, "{errors:?}");
}

#[test]
fn a_beam_of_triangles_converges_to_euler_and_bernoulli_with_shear() {
    let (length, height, modulus, nu, weight) = (1.0, 0.125, 1.0, 0.3, 1e-7);
    // Under its weight, spread over its length: w L⁴/(8 E I) and the shear, w L²/(2 κ G A), with Cowper's κ.
    let young = 4.0 * modulus;
    let inertia = height * height * height / 12.0;
    let shear = young / (2.0 * (1.0 + nu)) * height * 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu);
    let expected = weight * (1.0 / (8.0 * young * inertia) + 1.0 / (2.0 * shear));
    let errors = [2, 4, 8, 16].map(|n| {
        let elements = sheet([length, height], [8 * n, n], modulus, nu)
            + &format!(r#"<simplegravity fx="0" fy="{weight:?}"/>"#);
        let middle = n / 2 * (8 * n + 1) + 8 * n;
        let rest = height / n as f64 * (n / 2) as f64;
        ((end(&resting(&elements))[2 * middle + 1] - rest) / expected - 1.0).abs()
    });
    // Triangles of constant strain are too stiff where they bend, coarse meshes the more.
    assert!(orders(&errors).iter().all(|order| *order > 1.4), "{errors:?}");
    assert!(errors[3] < 0.02, "{errors:?}");
}

/// Affine motions are in the space of the triangles: a sheet that is stretched at both sides has no force inside, on any
/// mesh.
#[test]
fn a_homogeneous_stretch_is_an_equilibrium_of_every_mesh() {
    let mut scene = read(&format!(
        r#"<scene><duration time="1"/><integrator type="implicit-euler" dt="1"/>{}</scene>"#,
        sheet([1.0, 0.75], [5, 3], 2.0, 0.35)
    ));
    let is_inside = |place: usize| ![0, 5].contains(&(place % 6)) && ![0, 3].contains(&(place / 6));
    for (place, particle) in scene.particles.iter_mut().enumerate() {
        // Inside, the mesh is irregular.
        if is_inside(place) {
            particle.position[0] += 0.03 * ((place * 7 % 5) as f64 - 2.0);
            particle.position[1] += 0.02 * ((place * 3 % 5) as f64 - 2.0);
        }
        particle.fixed = !is_inside(place);
    }
    for force in &mut scene.forces {
        let corners: Vec<[f64; 3]> =
            force.particles.iter().map(|corner| scene.particles[*corner].position).collect();
        for (parameter, value) in force.schema.parameters.iter().zip(&mut force.parameters) {
            if let Some(coordinate) = parameter.coordinate {
                *value = corners[coordinate.particle][coordinate.axis];
            }
        }
    }
    for particle in &mut scene.particles {
        let [x, y, _] = particle.position;
        particle.position = [1.4 * x + 0.2 * y, 0.1 * x + 0.8 * y, 0.0];
    }
    let moved = end(&scene);
    let rest = scene.positions();
    let largest = moved.iter().zip(&rest).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(largest < 1e-13, "{largest:e}");
}
