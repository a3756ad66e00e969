//! Elastic bodies against theory: conserved momenta over many steps, equilibria of single triangles, hard starts.
//!
//! Equilibria are reached by steps of implicit Euler that are much longer than any period.

use scene::schema::Conserves;
use scene::{ForceElement, ParseOptions, Particle, Scene, xml};
use simulator::force::REGISTRY as FORCES;
use simulator::integrator::REGISTRY as INTEGRATORS;
use simulator::simulation::{FailureKind, Simulation};
use simulator::vocabulary;

fn read(text: &str) -> Scene {
    xml::parse(text, "elastic.xml", &vocabulary(), &ParseOptions::default()).unwrap().scene
}

/// Positions at the end.
pub(crate) fn end(scene: &Scene) -> Vec<f64> {
    let mut simulation = Simulation::new(scene);
    while simulation.advance().unwrap() {}
    simulation.state().positions.to_vec()
}

pub(crate) fn particle(x: f64, y: f64, mass: f64, fixed: bool) -> String {
    let fixed = u8::from(fixed);
    format!(r#"<particle m="{mass:?}" px="{x:?}" py="{y:?}" vx="0" vy="0" fixed="{fixed}"/>"#)
}

/// A scene that comes to rest.
pub(crate) fn resting(elements: &str) -> Scene {
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

/// The corners of the triangles of a sheet, two in each cell.
fn triangles([nx, ny]: [usize; 2]) -> Vec<[usize; 3]> {
    let cells = (0..ny).flat_map(|j| (0..nx).map(move |i| [i, j]));
    let halves = cells.flat_map(|[i, j]| {
        let a = j * (nx + 1) + i;
        let (b, c, d) = (a + 1, a + nx + 1, a + nx + 2);
        if (i + j) % 2 == 0 { [[a, b, d], [a, d, c]] } else { [[a, b, c], [b, d, c]] }
    });
    halves.collect()
}

/// Every triangle, and what its modulus is of Young's for small strains.
pub(crate) const MATERIALS: [(&str, f64); 4] = [
    ("elasticbodycstforce", 0.25),
    ("stvktriangle", 1.0),
    ("corotatedtriangle", 1.0),
    ("neohookeantriangle", 1.0),
];

/// A sheet of `nx` by `ny` cells of two triangles, the left side fixed, each particle with its share of the mass 1.
pub(crate) fn sheet(tag: &str, size: [f64; 2], cells: [usize; 2], modulus: f64, nu: f64) -> String {
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
    for [i1, i2, i3] in triangles(cells) {
        text += &format!(
            r#"<{tag} i1="{i1}" i2="{i2}" i3="{i3}" youngsmodulus="{modulus:?}" poissonratio="{nu:?}"/>"#
        );
    }
    text
}

/// A triangle whose base is held at the stretch `λ`: its height per undeformed height.
fn height_of_a_stretched_triangle(tag: &str, nu: f64, stretch: f64) -> f64 {
    let corners = [
        particle(0.0, 0.0, 1.0, true),
        particle(stretch, 0.0, 1.0, true),
        particle(0.4, 0.9, 1.0, false),
    ];
    let rest = r#"xb1x="0" xb1y="0" xb2x="1" xb2y="0" xb3x="0.3" xb3y="0.8""#;
    let positions = end(&resting(&format!(
        r#"{}<{tag} i1="0" i2="1" i3="2" youngsmodulus="2" poissonratio="{nu:?}" {rest}/>"#,
        corners.concat()
    )));
    assert!((positions[4] - 0.3 * stretch).abs() < 1e-9, "{tag}: {positions:?}");
    positions[5] / 0.8
}

#[test]
fn a_stretched_triangle_grows_narrower_as_in_the_closed_form() {
    for nu in [0.0_f64, 0.3, 0.49] {
        for stretch in [0.8, 1.3] {
            let squared = stretch * stretch;
            // (μ + λ)/μ.
            let bulk = (1.0 + nu) / (1.0 - nu);
            let expected = [
                ("elasticbodycstforce", (1.0 - nu * (squared - 1.0)).sqrt()),
                ("stvktriangle", (1.0 - nu * (squared - 1.0)).sqrt()),
                ("corotatedtriangle", 1.0 - nu * (stretch - 1.0)),
                ("neohookeantriangle", stretch * (1.0 + bulk) / (1.0 + bulk * squared)),
            ];
            for (tag, expected) in expected {
                let error = height_of_a_stretched_triangle(tag, nu, stretch) - expected;
                assert!(error.abs() < 1e-9, "{tag} {nu} {stretch}: {error:e}");
            }
        }
    }
}

/// Affine motions are in the space of the triangles: a sheet that is stretched at both sides has no force inside, on any
/// mesh.
#[test]
fn a_homogeneous_stretch_is_an_equilibrium_of_every_mesh() {
    for (tag, _) in MATERIALS {
        let largest = motion_in_a_homogeneous_stretch(tag);
        assert!(largest < 1e-13, "{tag}: {largest:e}");
    }
}

/// How far a particle moves in a step.
fn motion_in_a_homogeneous_stretch(tag: &str) -> f64 {
    let mut scene = read(&format!(
        r#"<scene><duration time="1"/><integrator type="implicit-euler" dt="1"/>{}</scene>"#,
        sheet(tag, [1.0, 0.75], [5, 3], 2.0, 0.35)
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
    moved.iter().zip(&rest).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// A start of the sheet of two by two cells, whose place `n` is `(x, y)` undeformed.
type Start = fn(n: usize, at: [f64; 2]) -> [f64; 3];

/// Between −1/2 and 1/2.
fn scattered(n: usize, axis: usize) -> f64 {
    ((n * n * 11 + n * (5 + 8 * axis) + 3 * axis) % 41) as f64 / 41.0 - 0.5
}

const STARTS: [(&str, Start); 4] = [
    ("inverted", |n, [x, y]| {
        [0.02 * scattered(n, 0) - x, y + 0.02 * scattered(n, 1), 0.02 * scattered(n, 2)]
    }),
    ("crushed", |n, _| [0, 1, 2].map(|axis| 0.05 * scattered(n, axis))),
    ("flat", |_, [x, y]| [x + 0.3 * y, 0.0, 0.0]),
    ("in one place", |_, _| [0.0; 3]),
];

/// The energies at the start and at the end of forty steps.
fn fall(
    scene_of: &str,
    tag: &str,
    start: Start,
    dimension: usize,
) -> Result<[f64; 2], FailureKind> {
    let places = (0..9).map(|n| [(n % 3) as f64 / 2.0, (n / 3) as f64 / 2.0]);
    let mut text = String::new();
    for (n, at) in places.clone().enumerate() {
        let [x, y, z] = start(n, at);
        let depth = if dimension == 3 { format!(r#"pz="{z:?}" vz="0""#) } else { String::new() };
        text +=
            &format!(r#"<particle m="1" px="{x:?}" py="{y:?}" vx="0" vy="0" fixed="0" {depth}/>"#);
    }
    let places: Vec<[f64; 2]> = places.collect();
    for [i1, i2, i3] in triangles([2, 2]) {
        let corners = [i1, i2, i3].map(|corner| places[corner]);
        let rest = corners.iter().zip(1..).map(|([x, y], corner)| {
            let depth = if dimension == 3 { format!(r#"xb{corner}z="0""#) } else { String::new() };
            format!(r#"xb{corner}x="{x:?}" xb{corner}y="{y:?}" {depth} "#)
        });
        let rest: String = rest.collect();
        text += &format!(
            r#"<{tag} i1="{i1}" i2="{i2}" i3="{i3}" youngsmodulus="10" poissonratio="0.3" {rest}/>"#
        );
    }
    let scene = read(&format!(
        r#"<scene><duration time="2"/><integrator {scene_of} dt="0.05"/>{text}</scene>"#
    ));
    let mut simulation = Simulation::new(&scene);
    let total = |simulation: &Simulation| {
        simulation.energies().map(|energies| energies.kinetic + energies.potential)
    };
    let first = total(&simulation).map_err(|error| error.kind)?;
    while simulation.advance().map_err(|error| error.kind)? {}
    Ok([first, total(&simulation).map_err(|error| error.kind)?])
}

/// Every step converges from these starts, and implicit Euler loses energy. At the exceptions, the force has no direction:
/// a flat triangle in space has two sides that it may open to, and the nearest rotation to `F = 0` is none.
#[test]
fn implicit_steps_converge_from_inverted_crushed_and_flat_starts() {
    for (tag, _) in MATERIALS {
        for (name, start) in STARTS {
            for dimension in [2, 3] {
                let is_undefined = match (tag, name) {
                    ("corotatedtriangle", "in one place") => true,
                    ("corotatedtriangle" | "neohookeantriangle", "flat" | "in one place") => {
                        dimension == 3
                    }
                    _ => false,
                };
                for integrator in
                    [r#"type="implicit-euler""#, r#"type="projected-newton" tolerance="1e-9""#]
                {
                    let context = format!("{tag}, {name}, {dimension}D, {integrator}");
                    match fall(integrator, tag, start, dimension) {
                        Ok([first, last]) => {
                            assert!(!is_undefined && last <= first, "{context}: {first} {last}");
                        }
                        Err(FailureKind::Degenerate { .. }) => assert!(is_undefined, "{context}"),
                        Err(other) => panic!("{context}: {other:?}"),
                    }
                }
            }
        }
    }
}
