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

/// Every component of momentum and angular momentum, with the sum of the sizes of its terms.
fn momenta(scene: &Scene, x: &[f64], v: &[f64]) -> [(f64, f64); 6] {
    let mut sums = [(0.0, 0.0); 6];
    let axes = scene.dimension.count();
    let vector = |values: &[f64]| [0, 1, 2].map(|axis| values.get(axis).copied().unwrap_or(0.0));
    let states = x.chunks_exact(axes).map(vector).zip(v.chunks_exact(axes).map(vector));
    for (particle, (x, v)) in scene.particles.iter().zip(states) {
        for axis in 0..3 {
            let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
            let terms =
                [(axis, v[axis]), (3 + axis, x[next] * v[last]), (3 + axis, -x[last] * v[next])];
            for (sum, term) in terms {
                sums[sum].0 += particle.mass * term;
                sums[sum].1 += particle.mass * term.abs();
            }
        }
    }
    sums
}

#[test]
fn internal_forces_keep_momenta_over_a_hundred_thousand_steps() {
    let method = INTEGRATORS.iter().find(|kind| kind.schema.name == "symplectic-euler").unwrap();
    let internal = FORCES.iter().map(|kind| &kind.schema).filter(|schema| {
        schema.conserves == Conserves::AngularMomentum && !schema.depends_on().time
    });
    let mut found = 0;
    for schema in internal {
        let mut scene = Scene::new("momenta", schema.least_dimension, &method.schema);
        let corners = [(0.0, 0.0, 0.0, 0.25), (1.25, 0.125, 0.0, -0.5), (0.375, 1.0, 0.0, 0.25)];
        let top = (schema.stencil.size() > 3).then_some((0.25, 0.375, 1.125, 0.125));
        let particles = corners.into_iter().chain(top).map(|(x, y, z, v)| Particle {
            mass: 1.0 + y,
            position: [x, y, z],
            velocity: [v * y, v, v * z],
            fixed: false,
            radius: 0.1,
            tag: None,
        });
        scene.particles = particles.collect();
        (scene.time_step, scene.duration) = (1e-3, 100.0);
        let given: Vec<(&str, f64)> =
            schema.parameters.iter().map(|each| (each.name, each.samples[0])).collect();
        let particles: Vec<usize> = (0..schema.stencil.size()).collect();
        scene.forces.push(ForceElement::new(schema, &particles, None, schema.values(&given)));
        let mut simulation = Simulation::new(&scene);
        let state = simulation.state();
        let starts = momenta(&scene, state.positions, state.velocities);
        let (mut worst, mut steps) = ([0.0_f64; 6], 0);
        while simulation.advance().unwrap() {
            steps += 1;
            let state = simulation.state();
            let now = momenta(&scene, state.positions, state.velocities);
            for ((worst, start), now) in worst.iter_mut().zip(starts).zip(now) {
                *worst = worst.max((now.0 - start.0).abs() / now.1.max(start.1).max(1e-3));
            }
        }
        assert_eq!(steps, 100_000);
        // A rounding error of 1e-16 each step, all in one direction, is 1e-11.
        assert!(worst.iter().all(|worst| *worst < 1e-11), "{}: {worst:?}", schema.tag);
        found += 1;
    }
    assert!(found >= 10, "{found}");
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

/// Undeformed places of particles, and elements on them.
struct Mesh {
    places: Vec<[f64; 3]>,
    elements: Vec<Vec<usize>>,
}

/// A sheet of two by two cells.
fn small_sheet() -> Mesh {
    let place = |n: usize| [(n % 3) as f64 / 2.0, (n / 3) as f64 / 2.0, 0.0];
    let elements = triangles([2, 2]).into_iter().map(Vec::from);
    Mesh { places: (0..9).map(place).collect(), elements: elements.collect() }
}

/// A cube of six tetrahedra around its diagonal.
fn cube() -> Mesh {
    let place = |n: usize| [n % 2, n / 2 % 2, n / 4].map(|side| side as f64);
    let elements = [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]].map(|[i, j]| vec![0, i, j, 7]);
    Mesh { places: (0..8).map(place).collect(), elements: elements.to_vec() }
}

/// A start of a mesh, whose particle `n` is at this place while it is undeformed.
type Start = fn(n: usize, at: [f64; 3]) -> [f64; 3];

/// Between −1/2 and 1/2.
fn scattered(n: usize, axis: usize) -> f64 {
    ((n * n * 11 + n * (5 + 8 * axis) + 3 * axis) % 41) as f64 / 41.0 - 0.5
}

const INVERTED: Start = |n, [x, y, z]| {
    [0.02 * scattered(n, 0) - x, y + 0.02 * scattered(n, 1), z + 0.02 * scattered(n, 2)]
};
const CRUSHED: Start = |n, _| [0, 1, 2].map(|axis| 0.05 * scattered(n, axis));
const ONE_PLACE: Start = |_, _| [0.0; 3];

const STARTS: [(&str, Start); 4] = [
    ("inverted", INVERTED),
    ("crushed", CRUSHED),
    ("flat", |_, [x, y, _]| [x + 0.3 * y, 0.0, 0.0]),
    ("in one place", ONE_PLACE),
];

const STARTS_OF_SOLIDS: [(&str, Start); 5] = [
    ("inverted", INVERTED),
    ("crushed", CRUSHED),
    ("flat", |_, [x, y, z]| [x + 0.3 * z, y - 0.2 * z, 0.0]),
    ("on a line", |_, [x, y, z]| [x + 0.3 * y - 0.2 * z, 0.0, 0.0]),
    ("in one place", ONE_PLACE),
];

/// The energies at the start and at the end of forty steps.
fn fall(
    integrator: &str,
    tag: &str,
    mesh: &Mesh,
    start: Start,
    dimension: usize,
) -> Result<[f64; 2], FailureKind> {
    let axes = &["x", "y", "z"][..dimension];
    let coordinates = |name: &str, at: [f64; 3]| -> String {
        axes.iter().zip(at).map(|(axis, value)| format!(r#" {name}{axis}="{value:?}""#)).collect()
    };
    let mut text = String::new();
    for (n, at) in mesh.places.iter().enumerate() {
        let state = coordinates("p", start(n, *at)) + &coordinates("v", [0.0; 3]);
        text += &format!(r#"<particle m="1"{state} fixed="0"/>"#);
    }
    for element in &mesh.elements {
        text += &format!(r#"<{tag} youngsmodulus="10" poissonratio="0.3""#);
        for (corner, number) in (1..).zip(element) {
            let rest = coordinates(&format!("xb{corner}"), mesh.places[*number]);
            text += &format!(r#" i{corner}="{number}"{rest}"#);
        }
        text += "/>";
    }
    let scene = read(&format!(
        r#"<scene><duration time="2"/><integrator {integrator} dt="0.05"/>{text}</scene>"#
    ));
    let mut simulation = Simulation::new(&scene);
    let total = |simulation: &Simulation| {
        simulation.energies().map(|energies| energies.kinetic + energies.potential)
    };
    let first = total(&simulation).map_err(|error| error.kind)?;
    while simulation.advance().map_err(|error| error.kind)? {}
    Ok([first, total(&simulation).map_err(|error| error.kind)?])
}

/// Every step converges from this start, and implicit Euler loses energy; or the force has no direction there.
fn assert_falls(
    tag: &str,
    mesh: &Mesh,
    (name, start): (&str, Start),
    dimension: usize,
    is_undefined: bool,
) {
    for integrator in [r#"type="implicit-euler""#, r#"type="projected-newton" tolerance="1e-9""#] {
        let context = format!("{tag}, {name}, {dimension}D, {integrator}");
        match fall(integrator, tag, mesh, start, dimension) {
            Ok([first, last]) => {
                assert!(!is_undefined && last <= first, "{context}: {first} {last}");
            }
            Err(FailureKind::Degenerate { .. }) => assert!(is_undefined, "{context}"),
            Err(other) => panic!("{context}: {other:?}"),
        }
    }
}

/// At the exceptions, the force has no direction: a flat triangle in space has two sides that it may open to, and no
/// rotation is nearest to `F = 0`.
#[test]
fn implicit_steps_converge_from_inverted_crushed_and_flat_starts() {
    for (tag, _) in MATERIALS {
        for start in STARTS {
            for dimension in [2, 3] {
                let is_undefined = match (tag, start.0) {
                    ("corotatedtriangle", "in one place") => true,
                    ("corotatedtriangle" | "neohookeantriangle", "flat" | "in one place") => {
                        dimension == 3
                    }
                    _ => false,
                };
                assert_falls(tag, &small_sheet(), start, dimension, is_undefined);
            }
        }
    }
}

const SOLIDS: [&str; 3] = ["stvktetrahedron", "corotatedtetrahedron", "neohookeantetrahedron"];

/// No one rotation is nearest to an `F` of rank 1 or 0.
#[test]
fn implicit_steps_of_solids_converge_from_inverted_crushed_and_flat_starts() {
    for tag in SOLIDS {
        for start in STARTS_OF_SOLIDS {
            let is_undefined =
                tag == "corotatedtetrahedron" && ["on a line", "in one place"].contains(&start.0);
            assert_falls(tag, &cube(), start, 3, is_undefined);
        }
    }
}

/// The inverted cube of the last two materials is turned right; that of St. Venant and Kirchhoff stays inverted.
#[test]
fn inverted_solids_are_turned_right_where_the_energy_does_so() {
    for (tag, is_turned) in SOLIDS.into_iter().zip([false, true, true]) {
        let implicit = r#"type="implicit-euler""#;
        let [first, last] = fall(implicit, tag, &cube(), INVERTED, 3).unwrap();
        assert_eq!(first > 1.0 && last < 0.9 * first, is_turned, "{tag}: {first} {last}");
    }
}

/// With `F = I + e A`, the energy is that of Hooke's law, `V̄ (μ ‖ε‖² + λ/2 (tr ε)²)`, up to terms of `e³`.
#[test]
fn small_strains_of_solids_obey_hookes_law() {
    let strain = [[1.0, 0.3, -0.2], [0.3, -0.6, 0.5], [-0.2, 0.5, 0.8]];
    let size = 1e-4;
    let corners = [[0.1, -0.2, 0.3], [1.2, 0.1, 0.2], [0.3, 1.4, -0.1], [-0.2, 0.3, 1.6]];
    let edge = |corner: usize| [0, 1, 2].map(|axis| corners[corner][axis] - corners[0][axis]);
    let [u, v, w] = [edge(1), edge(2), edge(3)];
    let volume = (u[0] * (v[1] * w[2] - v[2] * w[1])
        + u[1] * (v[2] * w[0] - v[0] * w[2])
        + u[2] * (v[0] * w[1] - v[1] * w[0]))
        / 6.0;
    for tag in SOLIDS {
        for nu in [-0.6, 0.0, 0.3, 0.49] {
            let mut text = String::new();
            let mut rest = String::new();
            for (number, at) in corners.iter().enumerate() {
                let moved = [0, 1, 2].map(|axis| {
                    let along: f64 = strain[axis].iter().zip(at).map(|(a, x)| a * x).sum();
                    at[axis] + size * along
                });
                let [x, y, z] = moved;
                text += &format!(
                    r#"<particle m="1" px="{x:?}" py="{y:?}" pz="{z:?}" vx="0" vy="0" fixed="0"/>"#
                );
                let (n, [x, y, z]) = (number + 1, at);
                rest +=
                    &format!(r#" i{n}="{number}" xb{n}x="{x:?}" xb{n}y="{y:?}" xb{n}z="{z:?}""#);
            }
            let scene = resting(&format!(
                r#"{text}<{tag} youngsmodulus="3" poissonratio="{nu:?}"{rest}/>"#
            ));
            let (mu, lambda) = (1.5 / (1.0 + nu), 3.0 * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)));
            let squares: f64 = strain.iter().flatten().map(|entry| entry * entry).sum();
            let trace: f64 = (0..3).map(|axis| strain[axis][axis]).sum();
            let expected = volume * size * size * (mu * squares + 0.5 * lambda * trace * trace);
            let found = Simulation::new(&scene).energies().unwrap().potential;
            assert!((found / expected - 1.0).abs() < 1e-3, "{tag} {nu}: {found:e} {expected:e}");
        }
    }
}

#[test]
fn solids_that_cannot_be_are_refused_by_place_and_remedy() {
    let scene = |depth: &str, element: &str| {
        let corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)].map(|(x, y, z)| {
            let depth = if depth.is_empty() { String::new() } else { format!(r#" pz="{z}""#) };
            format!(r#"<particle m="1" px="{x}" py="{y}"{depth} vx="0" vy="0" fixed="0"/>"#)
        });
        let text = format!(
            "<scene><duration time=\"1\"/><integrator type=\"implicit-euler\" dt=\"1\"/>{}\n{element}</scene>",
            corners.concat()
        );
        xml::parse(&text, "solid.xml", &vocabulary(), &ParseOptions::default())
    };
    let refused = |depth: &str, element: &str, words: &str, remedy: &str| {
        let message = scene(depth, element).unwrap_err().to_string();
        let is_there = message.contains("solid.xml:2:") && message.contains(words);
        assert!(is_there && message.contains(remedy), "{message}");
    };
    for tag in SOLIDS {
        let element = |nu: &str, more: &str| {
            format!(
                r#"<{tag} i1="0" i2="1" i3="2" i4="3" youngsmodulus="5" poissonratio="{nu}"{more}/>"#
            )
        };
        assert!(scene("z", &element("0.3", "")).is_ok());
        refused("", &element("0.3", ""), "three dimensions only", "pz and vz");
        refused("z", &element("0.3", r#" xb4z="0""#), "in one plane", "span a tetrahedron");
        refused("z", &element("0.5", ""), "above -1 and below 0.5", "poissonratio");
        refused("z", &element("-1", ""), "above -1 and below 0.5", "poissonratio");
    }
}

/// `k (θ − θ0)² |ē|/h̄` of Grinspun et al., with the wings at a right angle.
#[test]
fn hinges_have_the_energy_of_discrete_shells_and_initial_triangles() {
    let scene = |fourth: &str| {
        let places = [r#"px="0" py="0""#, r#"px="0" py="2""#, r#"px="0.5" py="1""#, fourth];
        let particles =
            places.map(|at| format!(r#"<particle m="1" {at} vx="0" vy="0" vz="0" fixed="0"/>"#));
        let hinge =
            r#"<hingebendingforce i1="0" i2="1" i3="2" i4="3" stiffness="0.75" theta0="0.25"/>"#;
        let start = r#"<duration time="1"/><integrator type="implicit-euler" dt="1"/>"#;
        let text = format!("<scene>{start}{}\n{hinge}</scene>", particles.concat());
        xml::parse(&text, "hinge.xml", &vocabulary(), &ParseOptions::default())
    };
    // Heights of 0.5 and 1.5: h̄ is 1/3. The normals are −z and, of the fourth corner above or below, −x or x.
    for (fourth, angle) in [("1.5", 1.0), ("-1.5", -1.0)] {
        let parsed = scene(&format!(r#"px="0" py="0.3" pz="{fourth}""#)).unwrap();
        let found = Simulation::new(&parsed.scene).energies().unwrap().potential;
        let change = angle * std::f64::consts::FRAC_PI_2 - 0.25;
        let expected = 0.75 * change * change * 2.0 * 3.0;
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    }
    let refused = scene(r#"px="0" py="-1" pz="0""#).unwrap_err().to_string();
    assert!(refused.contains("hinge.xml:2:") && refused.contains("no area"), "{refused}");
}
