//! Generated scenes: their content, and the round trip through XML.

use needs::needs;
use std::collections::HashSet;
use std::fs;
use std::path::Path;
use std::process::Command;

use crate::shared::{parse, root, shipped_scenes};
use crate::support::{simulate, stderr};
use frames::{Bounds, Painter};
use scene::{
    self, Color, Dimension, ForceElement, Location, ParseOptions, ParticlePath, Scene, Surface,
    Viewport, write,
};
use simulator::force::REGISTRY as FORCES;
use simulator::generate::options::OptionValue;
use simulator::generate::{
    Beam, Block, Bodies, Chain, Cloth, Disc, Generator, Net, PinnedEdge, REGISTRY, Ring, Rope,
    Sheet, Size,
};
use simulator::simulation::Simulation;
use simulator::vocabulary;
use tempfile::TempDir;

/// Output of `simulate generate` with these options.
fn generate(options: &[&str]) -> String {
    let folder = TempDir::new().unwrap();
    let run = simulate(folder.path(), &[&["generate"], options].concat());
    assert_eq!((run.status.code(), stderr(&run)), (Some(0), ""), "{options:?}");
    String::from_utf8(run.stdout).unwrap()
}

fn written(scene: &Scene) -> String {
    let mut bytes = Vec::new();
    write::write(scene, &mut bytes).unwrap();
    String::from_utf8(bytes).unwrap()
}

/// The scene without what depends on where it was read, and without a surface, which XML cannot say.
fn anywhere(mut scene: Scene) -> Scene {
    scene.name.clear();
    scene.rendering.surface = Surface::default();
    scene.forces.iter_mut().for_each(|force| force.location = Location::default());
    scene
}

/// Equal in all fields, and in the sign of every zero.
#[track_caller]
fn assert_same(found: Scene, expected: Scene, what: &str) {
    let [found, expected] = [found, expected].map(anywhere);
    assert_eq!(found, expected, "{what}");
    assert_eq!(format!("{found:?}"), format!("{expected:?}"), "{what}");
}

#[test]
fn every_shipped_scene_round_trips() {
    let mut count = 0;
    for path in shipped_scenes() {
        let scene = scene::load(&path, &vocabulary(), &ParseOptions::default()).unwrap().scene;
        let text = written(&scene);
        assert_eq!(write::size(&scene).unwrap(), text.len() as u64);
        assert_same(parse(&text), scene, &path.display().to_string());
        count += 1;
    }
    assert!(count >= 108, "{count} scenes");
}

#[test]
fn every_field_of_a_scene_round_trips() {
    let color = |r| Color { r, g: 0.1, b: 1.0 };
    for dimension in [Dimension::Two, Dimension::Three] {
        let mut scene = Bodies { dimension, ..Bodies::default() }.scene().unwrap();
        let cloth = Cloth { nx: 2, ny: 2, tilt: 0.0, ..Cloth::default() }.scene().unwrap();
        scene.edges = cloth.edges;
        scene.forces.extend(cloth.forces);
        let text = "<a href=\"b\">\n\tfish & chips' ]]> \r\n &amp; größer, 🜨   two  spaces ";
        scene.description = Some(text.to_owned());
        scene.tag = Some(" <&>\"' ".to_owned());
        scene.particles[1].tag = Some(String::new());
        scene.particles[2].tag = Some("a\nb".to_owned());
        scene.particles[3].position[0] = 5e-324;
        scene.particles[3].position[1] = -0.0;
        scene.particles[4].velocity[0] = f64::MAX;
        scene.particles[5].fixed = true;
        for (index, radius) in [0.1, 0.015, 0.0, 0.25].into_iter().enumerate() {
            scene.particles[index].radius = radius;
            scene.edges[index].radius = radius;
        }
        if dimension == Dimension::Three {
            scene.particles[3].position[2] = -0.0;
            scene.particles[4].velocity[2] = 1e-7;
            let is_gravity = |schema: &str| schema == "simplegravity";
            let gravity = scene.forces.iter_mut().find(|force| is_gravity(force.schema.tag));
            gravity.unwrap().parameters[2] = 0.30000000000000004;
        }
        scene.max_simulation_frequency = Some(0.5);
        scene.rendering.viewport = Some(Viewport { center: [-0.0, 1.5], size: 1e-3 });
        scene.rendering.background = Some(color(0.25));
        scene.rendering.particle_colors = vec![(3, color(0.0)), (3, color(1.0)), (0, color(0.5))];
        scene.rendering.edge_colors = vec![(2, color(0.125))];
        let path = ParticlePath { particle: 4, duration: 0.75, color: color(0.625) };
        scene.rendering.particle_paths = vec![path];

        let text = written(&scene);
        assert_same(parse(&text), scene, "every field");
        let deep = ["pz=", "vz=", "fz="].map(|attribute| text.contains(attribute));
        assert_eq!(deep, [dimension == Dimension::Three; 3]);
    }
}

#[test]
fn generated_numbers_are_shortest_round_trip_decimals() {
    let mut scene = Ring { particles: 3, ..Ring::default() }.scene().unwrap();
    scene.particles[0].position = [0.1 + 0.2, 1e23, 0.0];
    let text = written(&scene);
    assert!(text.contains(r#"px="0.30000000000000004" py="1e23""#), "{text}");
}

#[test]
fn unwritable_values_are_refused_by_name() {
    let sound = Ring::default().scene().unwrap();
    let refusal = |change: fn(&mut Scene)| {
        let mut scene = sound.clone();
        change(&mut scene);
        write::size(&scene).unwrap_err().to_string()
    };
    let infinite = refusal(|scene| scene.particles[2].position[1] = f64::INFINITY);
    assert_eq!(infinite, "<particle> py is inf; a scene file holds finite numbers only");
    let character = refusal(|scene| scene.description = Some("bell \x07".to_owned()));
    assert_eq!(
        character,
        "<description> text holds the character '\\u{7}', which XML cannot express"
    );
    let target = refusal(|scene| scene.forces[1].edge = None);
    assert_eq!(target, "<springforce>, force 1 of the scene, lacks the edge it acts on");
}

#[needs("test -f ../shared/peers/gen_net.py && python3 --version")]
#[test]
fn generated_net_equals_the_peers_net() {
    let script = root().join("../shared/peers/gen_net.py");
    for (n, integrator, dt, steps, k, b) in [
        ("4", "symplectic-euler", "0.001", "200", "1000", "0"),
        ("1", "explicit-euler", "0.1", "1", "7.3", "0.01"),
        ("3", "linearized-implicit-euler", "0.004", "20", "1e5", "2.5"),
        ("37", "implicit-euler", "0.01", "100", "12345.678", "0.3"),
    ] {
        for pin in [false, true] {
            let mut peer = Command::new("python3");
            peer.arg(&script).args([n, integrator, dt, steps, k, b]);
            let mut options = vec!["net", "-n", n, "--integrator", integrator, "--dt", dt];
            options.extend(["--steps", steps, "--stiffness", k, "--damping", b]);
            if pin {
                peer.arg("--pin");
                options.push("--pin");
            }
            let peer = peer.output().unwrap();
            assert!(peer.status.success(), "{}", stderr(&peer));
            let mut ours = parse(&generate(&options));
            assert!(ours.description.take().is_some(), "the peer writes none");
            assert_same(ours, parse(std::str::from_utf8(&peer.stdout).unwrap()), n);
        }
    }
}

/// Generators of several sizes, and what the documented formulas say of them by hand.
fn counted() -> Vec<(Box<dyn Generator>, Size)> {
    let size = |particles, pairs| Size { particles, pairs };
    let cloth =
        |[nx, ny]: [u64; 2], bend_stiffness| Cloth { nx, ny, bend_stiffness, ..Cloth::default() };
    let bodies = |bodies, central_mass| Bodies { bodies, central_mass, ..Bodies::default() };
    vec![
        (Box::new(Net { segments: 1, ..Net::default() }), size(4, 6)),
        (Box::new(Net { segments: 4, pinned: true, ..Net::default() }), size(25, 72)),
        (Box::new(Chain { links: 1, ..Chain::default() }), size(2, 1)),
        (Box::new(Chain { links: 7, ..Chain::default() }), size(8, 7)),
        (Box::new(cloth([1, 1], 1.0)), size(4, 4 + 2)),
        (Box::new(cloth([3, 2], 0.0)), size(12, 9 + 8 + 12)),
        (Box::new(cloth([3, 2], 1.0)), size(12, 9 + 8 + 12 + 2 * 3 + 4)),
        (Box::new(Ring { particles: 3, ..Ring::default() }), size(3, 3)),
        (Box::new(Ring { particles: 9, spokes: true, ..Ring::default() }), size(10, 18)),
        (Box::new(Beam { nx: 1, ny: 1, nz: 1, ..Beam::default() }), size(8, 28)),
        (
            Box::new(Beam { nx: 3, ny: 2, nz: 1, ..Beam::default() }),
            size(24, (18 + 16 + 12) + 2 * (12 + 9 + 8) + 24),
        ),
        (Box::new(Sheet { nx: 1, ny: 1, ..Sheet::default() }), size(4, 2)),
        (Box::new(Sheet { nx: 5, ny: 3, ..Sheet::default() }), size(24, 30)),
        (Box::new(Disc { rings: 1, ..Disc::default() }), size(7, 6)),
        (Box::new(Disc { rings: 4, ..Disc::default() }), size(61, 96)),
        (Box::new(Block { nx: 1, ny: 1, nz: 1, ..Block::default() }), size(8, 6)),
        (Box::new(Block { nx: 4, ny: 3, nz: 2, ..Block::default() }), size(60, 144)),
        (Box::new(Rope { bars: 7, ..Rope::default() }), size(8, 7)),
        (Box::new(bodies(2, 0.0)), size(2, 1)),
        (Box::new(bodies(9, 1.0)), size(10, 45)),
    ]
}

/// The number of faces of tetrahedra that no other one has.
fn faces(scene: &Scene) -> usize {
    let mut outer = HashSet::new();
    for element in scene.forces.iter().filter(|element| element.particles.len() == 4) {
        for left_out in 0..4 {
            let mut face = element.particles.to_vec();
            face.remove(left_out);
            face.sort_unstable();
            if !outer.remove(&face) {
                outer.insert(face);
            }
        }
    }
    outer.len()
}

#[test]
fn particles_and_springs_are_as_many_as_the_formulas_say() {
    for (generator, expected) in counted() {
        let scene = generator.scene().unwrap();
        let what = format!("{}: {:?}", scene.name, scene.description);
        let pairs: Vec<[usize; 2]> = scene.forces.iter().filter_map(|force| force.pair()).collect();
        let is_element = |force: &&ForceElement| force.schema.is_element();
        let elements = scene.forces.iter().filter(is_element).count();
        assert_eq!(scene.particles.len() as u64, expected.particles, "{what}");
        assert_eq!((pairs.len() + elements) as u64, expected.pairs, "{what}");
        assert_eq!(generator.size().unwrap(), expected, "{what}");
        let n_edges = match scene.name.as_str() {
            "bodies" => 0,
            // Euler's formula: a mesh without a hole.
            "sheet" | "disc" => scene.particles.len() + elements - 1,
            "block" => scene.particles.len() + elements + faces(&scene) / 2 - 1,
            _ => pairs.len(),
        };
        assert_eq!(scene.edges.len(), n_edges, "{what}");
        let different: HashSet<[usize; 2]> =
            pairs.iter().map(|[i, j]| [*i.min(j), *i.max(j)]).collect();
        assert_eq!(different.len(), pairs.len(), "no two particles are joined twice: {what}");
        assert_same(parse(&written(&scene)), scene, &what);
    }
}

#[test]
fn only_the_stretched_net_starts_under_tension() {
    for kind in REGISTRY.iter().filter(|kind| kind.name != "net") {
        let scene = (kind.default)().scene().unwrap();
        for force in scene.forces.iter().filter(|force| force.schema.has_parameter("l0")) {
            let [a, b] = force.pair().unwrap().map(|index| scene.particles[index].position);
            let length = (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt();
            // A bend spring of a flat cloth counts as well.
            let rest_length = force.parameter("l0");
            assert!((length - rest_length).abs() < 1e-11, "{}: {length}", kind.name);
        }
        for force in scene.forces.iter().filter(|force| force.schema.is_element()) {
            let corners = force.particles.iter().map(|corner| scene.particles[*corner].position);
            assert_eq!(force.undeformed()[..], corners.collect::<Vec<_>>(), "{}", kind.name);
        }
    }
    let net = Net::default().scene().unwrap();
    let width = net.particles.iter().map(|particle| particle.position[0]).fold(0.0, f64::max);
    assert_eq!(width, 0.7);
}

/// Simulates to the end; the particles must stay within three times the extent of the start.
#[track_caller]
fn assert_calm(scene: &Scene) {
    let extent = |positions: &[f64]| positions.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let mut simulation = Simulation::new(scene);
    let start = extent(simulation.state().positions);
    let first = simulation.energies().unwrap();
    while simulation.advance().unwrap() {}
    let last = simulation.energies().unwrap();
    let what = scene.description.as_deref().unwrap();
    assert!(simulation.state().step > 0, "{what}");
    assert!(extent(simulation.state().positions) < 3.0 * start, "{what}");
    // Energy is lost to dampers and to implicit methods, and none is won.
    let [before, after] = [first, last].map(|energies| energies.kinetic + energies.potential);
    assert!(after <= before + 0.02 * before.abs().max(0.1), "{what}: {before} to {after}");
}

#[test]
fn default_scene_of_every_kind_is_strict_and_simulates() {
    for kind in REGISTRY {
        let text = generate(&[kind.name]);
        let default = (kind.default)();
        assert_same(parse(&text), default.scene().unwrap(), kind.name);
        assert_calm(&parse(&text));

        let folder = TempDir::new().unwrap();
        assert_eq!(
            simulate(folder.path(), &["generate", kind.name, "-o", "scene.xml"]).stdout,
            b""
        );
        assert_eq!(fs::read_to_string(folder.path().join("scene.xml")).unwrap(), text);
        let run = simulate(folder.path(), &["scene.xml", "--strict", "-o", "trace.csv"]);
        assert_eq!((run.status.code(), stderr(&run)), (Some(0), ""), "{}", kind.name);
        let trace = fs::read_to_string(folder.path().join("trace.csv")).unwrap();
        let scene = parse(&text);
        assert_eq!(trace.lines().count() as u64, 2 + scene.n_steps(), "{}", kind.name);
    }
}

/// The mass of all particles, and the least and the largest.
fn masses(scene: &Scene) -> [f64; 3] {
    let masses = scene.particles.iter().map(|particle| particle.mass);
    masses.fold([0.0, f64::INFINITY, 0.0], |[sum, least, most], mass| {
        [sum + mass, least.min(mass), most.max(mass)]
    })
}

#[test]
fn bodies_of_every_triangle_have_their_mass_and_rest_state() {
    let triangles: Vec<&str> =
        FORCES.iter().map(|kind| &kind.schema).filter(|s| s.is_triangle()).map(|s| s.tag).collect();
    assert!(triangles.len() >= 4, "{triangles:?}");
    for tag in triangles {
        let of = |options: &[&str]| parse(&generate(&[options, &["--triangle", tag]].concat()));
        let sheet = of(&[
            "sheet",
            "--width",
            "2",
            "--height",
            "0.5",
            "--density",
            "3",
            "--stretch",
            "1.25",
        ]);
        let [mass, least, most] = masses(&sheet);
        assert!((mass - 3.0).abs() < 1e-12, "{tag}: {mass}");
        // A cell weighs 3/64; a particle has from two to eight of the triangles, each half a cell.
        assert!(
            (least - 3.0 / 64.0 / 3.0).abs() < 1e-12
                && (most - 3.0 / 64.0 * 4.0 / 3.0).abs() < 1e-12,
            "{tag}: {least} {most}"
        );
        let disc = of(&["disc", "-n", "3", "--radius", "2", "--density", "1.5"]);
        // The area of the polygon of 18 corners.
        let area = 9.0 * 4.0 * (std::f64::consts::TAU / 18.0).sin();
        assert!((masses(&disc)[0] - 1.5 * area).abs() < 1e-9, "{tag}");
        for (scene, is_stretched) in [(&sheet, true), (&disc, false)] {
            let elements = scene.forces.iter().filter(|force| force.schema.is_triangle());
            assert!(elements.clone().all(|force| force.schema.tag == tag));
            // The energy of the stretched sheet alone: the undeformed corners are not stretched.
            let gravity = scene.forces.iter().find(|force| force.schema.tag == "simplegravity");
            let mut weightless = scene.clone();
            weightless.forces.retain(|force| Some(force) != gravity);
            let energy = Simulation::new(&weightless).energies().unwrap().potential;
            assert_eq!(energy > 1e-3, is_stretched, "{tag}: {energy}");
            assert!(energy > -1e-15, "{tag}: {energy}");
        }
        assert_calm(&of(&["sheet", "--pin", "top", "--duration", "0.5"]));
        assert_calm(&of(&["disc", "--duration", "0.5"]));
    }
    for tag in ["stvktetrahedron", "corotatedtetrahedron", "neohookeantetrahedron"] {
        for stretch in [1.0, 1.25] {
            let (stretched, rest) = (stretch.to_string(), ["--gravity", "0", "--density", "3"]);
            let own = ["block", "--tetrahedron", tag, "--height", "0.5", "--stretch", &stretched];
            let block = parse(&generate(&[&own[..], &rest].concat()));
            assert!((masses(&block)[0] - 3.0 * 0.5 * 0.25).abs() < 1e-12, "{tag}");
            assert!(block.forces.iter().all(|force| force.schema.tag == tag));
            let energy = Simulation::new(&block).energies().unwrap().potential;
            assert_eq!(energy > 1.0, stretch > 1.0, "{tag}: {energy}");
        }
    }
    let fixed = |pinned| {
        let scene = Sheet { nx: 3, ny: 2, pinned, ..Sheet::default() }.scene().unwrap();
        let fixed = scene.particles.iter().enumerate().filter(|(_, particle)| particle.fixed);
        fixed.map(|(number, _)| number).collect::<Vec<_>>()
    };
    assert_eq!(fixed(PinnedEdge::Left), [0, 4, 8]);
    assert_eq!(fixed(PinnedEdge::Top), [8, 9, 10, 11]);
    assert_eq!(fixed(PinnedEdge::Sides), [0, 3, 4, 7, 8, 11]);
    assert_eq!(fixed(PinnedEdge::None), [0; 0]);
}

#[test]
fn a_rope_has_its_mass_and_its_rest_state() {
    let scene = parse(&generate(&[
        "rope",
        "-n",
        "12",
        "--length",
        "3",
        "--density",
        "0.4",
        "--curl",
        "90",
        "--clamp",
    ]));
    let [mass, least, most] = masses(&scene);
    assert!((mass - 1.2).abs() < 1e-12, "{mass}");
    assert_eq!((2.0 * least, scene.particles.iter().filter(|p| p.fixed).count()), (most, 2));
    let angles = scene.forces.iter().filter(|force| force.schema.has_parameter("theta0"));
    let turn: f64 = angles.map(|force| force.parameter("theta0")).sum();
    assert!((turn - std::f64::consts::FRAC_PI_2).abs() < 1e-12, "{turn}");
    // Without weight and curl, it is at rest.
    let rope = Rope { gravity: 0.0, ..Rope::default() }.scene().unwrap();
    let mut simulation = Simulation::new(&rope);
    let start = simulation.state().positions.to_vec();
    while simulation.advance().unwrap() {}
    let moved = simulation.state().positions.iter().zip(&start).map(|(a, b)| (a - b).abs());
    assert!(moved.fold(0.0, f64::max) < 1e-9);
}

#[test]
fn the_time_step_is_shortened_for_larger_and_stiffer_scenes() {
    for options in [
        &["net", "-n", "24", "--integrator", "symplectic-euler", "--duration", "0.2"][..],
        &["net", "-n", "8", "--pin", "-b", "200", "--integrator", "symplectic-euler"],
        &["chain", "-n", "40", "-k", "1e5", "--integrator", "symplectic-euler"],
        &["chain", "--angle", "-170", "--sag", "0"],
        &["cloth", "--nx", "24", "--ny", "30", "--duration", "0.5"],
        &["cloth", "--tilt", "0", "--bend-stiffness", "0", "--duration", "1"],
        &["ring", "-n", "100", "-k", "1e5", "--spin", "-3", "--spokes"],
        &["beam", "--nx", "12", "--spacing", "0.05", "--duration", "0.2"],
        &["bodies", "-n", "30", "--seed", "5", "--min-distance", "0.7", "--duration", "2"],
        &["sheet", "--modulus", "1e5", "--integrator", "symplectic-euler", "--duration", "0.2"],
        &["sheet", "--pin", "sides", "--stretch", "1.2", "--integrator", "symplectic-euler"],
        &["disc", "-n", "12", "--modulus", "1e4", "--duration", "0.2"],
        &["rope", "-n", "40", "--clamp", "--curl", "300", "--integrator", "symplectic-euler"],
        &["block", "--modulus", "1e7", "--integrator", "symplectic-euler", "--duration", "0.1"],
    ] {
        assert_calm(&parse(&generate(options)));
    }
    let usual = parse(&generate(&["ring"])).time_step;
    let stiff = parse(&generate(&["ring", "-k", "1e7"])).time_step;
    let chosen = parse(&generate(&["ring", "-k", "1e7", "--dt", "0.3"])).time_step;
    assert!(stiff < 0.1 * usual, "{stiff} against {usual}");
    assert_eq!(chosen, 0.3);
}

#[test]
fn generated_scene_has_the_requested_steps() {
    // 0.01 · 7 = 0.07, and 0.07 / 0.01 rounds to more than 7.
    assert_eq!((0.01_f64 * 7.0 / 0.01).ceil(), 8.0);
    for steps in ["0", "1", "7", "56", "100"] {
        let scene = parse(&generate(&["ring", "--dt", "0.01", "--steps", steps]));
        assert_eq!(scene.n_steps().to_string(), steps);
    }
    assert_eq!(parse(&generate(&["ring", "--duration", "0.75"])).duration, 0.75);
}

#[test]
fn the_seed_determines_the_bytes() {
    let with_seed = |seed| generate(&["bodies", "--seed", seed]);
    assert_eq!(with_seed("7"), with_seed("7"));
    assert_eq!(with_seed("1"), generate(&["bodies"]), "1 is the default");
    // The description names the seed; the first body after the heavy one must be another as well.
    let first_body = |seed| {
        let scene = parse(&with_seed(seed));
        format!("{:?}", scene.particles[1])
    };
    let different: HashSet<String> =
        ["0", "1", "2", "18446744073709551615"].map(first_body).into_iter().collect();
    assert_eq!(different.len(), 4);
}

#[test]
fn bodies_are_spaced_momentum_free_and_bound() {
    for dimension in [Dimension::Two, Dimension::Three] {
        for (central_mass, virial) in [(0.0, 1.0), (50.0, 1.0), (50.0, 0.5)] {
            let bodies = Bodies {
                bodies: 20,
                dimension,
                mass: 2.0,
                min_distance: 0.9,
                central_mass,
                virial,
                seed: 3,
                ..Bodies::default()
            };
            let scene = bodies.scene().unwrap();
            let places: Vec<[f64; 3]> = scene.particles.iter().map(|body| body.position).collect();
            for (i, a) in places.iter().enumerate() {
                for b in &places[..i] {
                    let squared: f64 = (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum();
                    assert!(squared.sqrt() >= 0.9);
                }
            }
            let deep = places.iter().any(|place| place[2] != 0.0);
            assert_eq!(deep, dimension == Dimension::Three);
            let energies = Simulation::new(&scene).energies().unwrap();
            let ratio = -2.0 * energies.kinetic / energies.potential;
            assert!((ratio - virial).abs() < 1e-12, "{ratio}");
            assert!(energies.momentum.iter().all(|component| component.abs() < 1e-10));
        }
    }
}

#[test]
fn bad_options_are_refused_and_nothing_is_written() {
    let refused: &[(&[&str], &str)] = &[
        (&["net", "-n", "0"], "segments is 0, and must be from 1 to 1048576"),
        (&["net", "-n", "-3"], "invalid value '-3'"),
        (&["net", "-n", "1024"], "1050625 particles, and may have at most 1048576"),
        (&["net", "-n", "760"], "bytes, and simulate reads at most"),
        (&["net", "--stretch", "0"], "stretch is 0, and must be a finite number above 0"),
        (&["net", "--gravity", "1"], "--pin"),
        (&["net", "-k", "-1"], "stiffness is -1, and must be a finite number, 0 or more"),
        (&["net", "-b", "nan"], "damping is NaN, and must be"),
        (&["net", "--integrator", "adams"], "known types: explicit-euler"),
        (&["net", "--steps", "3", "--duration", "1"], "cannot be used with"),
        (&["net", "--seed", "3"], "unexpected argument '--seed'"),
        (&["chain", "-n", "99999999999999999999"], "invalid value"),
        (&["chain", "-n", "18446744073709551615"], "must be from 1 to 1048576"),
        (&["chain", "--mass", "0"], "mass is 0, and must be"),
        (&["chain", "--sag", "1.1"], "sag is 1.1, and must be between 0 and 1"),
        (&["chain", "--dt", "-1"], "dt is -1, and must be a finite number above 0"),
        (&["chain", "--duration", "inf"], "duration is inf, and must be"),
        (&["chain", "--dt", "1e-9"], "steps are simulated; shorten the duration"),
        (&["chain", "--steps", "18446744073709551615"], "steps are simulated; shorten"),
        (&["cloth", "--ny", "0"], "ny is 0, and must be from 1"),
        (&["cloth", "--density", "1e308", "--width", "1e9"], "mass of particle 0 comes out as inf"),
        (&["ring", "-n", "2"], "particles is 2, and must be from 3"),
        (&["ring", "--radius", "1e-200"], "rest length of a spring comes out as 0"),
        (&["ring", "--radius", "1e200", "--spin", "1e200"], "velocity of particle 0 comes out as"),
        (&["beam", "--nx", "1048576", "--ny", "1048576", "--nz", "1048576"], "particles, and may"),
        (&["beam", "--nz", "1048577"], "nz is 1048577, and must be from 1 to 1048576"),
        (&["bodies", "-n", "1"], "bodies is 1, and must be from 2"),
        (&["bodies", "-n", "3000"], "springs, elements or pairs, and may have at most"),
        (&["bodies", "--min-distance", "3.5"], "16 bodies 3.5 apart do not fit"),
        (&["bodies", "--virial", "-1"], "virial is -1, and must be"),
        (&["bodies", "--dimension", "4"], "invalid value '4'"),
        (&["sheet", "--poisson", "-1"], "poisson is -1, and must be a finite number other than"),
        (&["sheet", "--triangle", "springforce"], "[possible values: elasticbodycstforce,"),
        (&["sheet", "--width", "1e-17", "--nx", "1"], "an element comes out flat"),
        (&["block", "--poisson", "0.5"], "poisson is 0.5, and must be above -1 and below 0.5"),
        (&["block", "--tetrahedron", "stvktriangle"], "[possible values: stvktetrahedron,"),
        (&["disc", "-n", "0"], "rings is 0, and must be from 1"),
        (&["rope", "-n", "1"], "bars is 1, and must be from 2"),
        (&["torus"], "unrecognized subcommand 'torus'"),
        (&[], "Usage: simulate generate"),
    ];
    for (options, message) in refused {
        let folder = TempDir::new().unwrap();
        let output = if options.is_empty() { &[][..] } else { &["-o", "scene.xml"][..] };
        for output in [output, &[]] {
            let run = simulate(folder.path(), &[&["generate"], *options, output].concat());
            assert_eq!(run.status.code(), Some(2), "{options:?}: {}", stderr(&run));
            assert!(stderr(&run).contains(message), "{options:?}: {}", stderr(&run));
            assert!(!stderr(&run).contains("internal error"), "{options:?}");
            assert_eq!(run.stdout, b"", "{options:?}");
            assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "{options:?}");
        }
    }
}

#[test]
fn an_output_that_cannot_be_created_leaves_the_old_file() {
    let folder = TempDir::new().unwrap();
    fs::create_dir(folder.path().join("folder")).unwrap();
    for output in ["folder", "missing/scene.xml"] {
        let run = simulate(folder.path(), &["generate", "net", "-o", output]);
        assert_eq!(run.status.code(), Some(2), "{output}");
        assert!(stderr(&run).contains(&format!("error: {output}: ")), "{}", stderr(&run));
    }
    fs::write(folder.path().join("old.xml"), "old").unwrap();
    let run = simulate(folder.path(), &["generate", "net", "-n", "0", "-o", "old.xml"]);
    assert_eq!(run.status.code(), Some(2));
    assert_eq!(fs::read_to_string(folder.path().join("old.xml")).unwrap(), "old");
}

#[test]
fn help_lists_every_kind_and_its_defaults() {
    let folder = TempDir::new().unwrap();
    let help = |arguments: &[&str]| {
        let run = simulate(folder.path(), arguments);
        assert_eq!(run.status.code(), Some(0), "{arguments:?}");
        String::from_utf8(run.stdout).unwrap()
    };
    let overview = help(&["generate", "--help"]);
    for kind in REGISTRY {
        assert!(overview.contains(&format!("\n  {} ", kind.name)), "{overview}");
        let text = help(&["generate", kind.name, "--help"]);
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        for option in (kind.default)().options() {
            let default = match option.value {
                OptionValue::Count(value) => value.to_string(),
                OptionValue::Number(value) => value.to_string(),
                OptionValue::Integrator(schema) => schema.name.to_owned(),
                _ => continue,
            };
            let said = format!("{} [default: {default}]", option.help);
            assert!(text.contains(&said), "{said}: {text}");
        }
    }
    assert!(help(&["--help"]).contains("generate"));
}

#[test]
fn the_net_of_the_lecture_is_the_shipped_scene() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../extracreditassets/ProjectedNewton/stretched-square-of-four.xml");
    let shipped = scene::load(&path, &vocabulary(), &ParseOptions::default()).unwrap().scene;
    let net = Net { lecture: true, ..Net::default() };
    assert_eq!(net.size().unwrap().particles, 25);
    let made = anywhere(net.scene().unwrap());
    assert_eq!((made.duration, made.time_step), (shipped.duration, shipped.time_step));
    assert_eq!(made.integrator.name, shipped.integrator.name);
    assert_eq!(made.integrator_options, shipped.integrator_options);
    assert_eq!((made.positions(), made.velocities()), (shipped.positions(), shipped.velocities()));
    let masses = |scene: &Scene| scene.particles.iter().map(|p| p.mass).collect::<Vec<_>>();
    assert_eq!(masses(&made), masses(&shipped));
    let springs = |scene: &Scene| {
        let springs = scene
            .forces
            .iter()
            .map(|force| (force.schema.tag, force.pair(), force.parameters.clone()));
        springs.collect::<Vec<_>>()
    };
    assert_eq!(springs(&made), springs(&shipped));
}

/// The lecture's program draws blue lines of one pixel and blue discs of a tenth of a segment, 200 pixels a metre, on a white
/// window of 900 by 900 pixels whose middle is the origin.
#[test]
fn lecture_net_matches_the_lecture_window() {
    let scene = parse(&generate(&["net", "--lecture"]));
    let painter = Painter::new(&scene, [900, 900], Bounds::default());
    let canvas = painter.draw(0.0, &scene.positions()).canvas();
    // How blue a pixel is, from 0 for white to 1.
    let share = |x: usize, y: usize| {
        let at = 3 * (900 * y + x);
        let [red, green, blue] = [0, 1, 2].map(|channel| canvas.pixels()[at + channel]);
        assert_eq!((red, blue), (green, 255), "pixel {x}, {y}");
        1.0 - f64::from(red) / 255.0
    };
    let screen = |[x, y, _]: [f64; 3]| [450.0 + 200.0 * x, 900.0 - (450.0 + 200.0 * y)];
    let centers: Vec<[f64; 2]> =
        scene.particles.iter().map(|particle| screen(particle.position)).collect();
    let lines: Vec<[[f64; 2]; 2]> =
        scene.edges.iter().map(|edge| edge.particles.map(|end| centers[end])).collect();
    let distance = |[x, y]: [f64; 2], [[ax, ay], [bx, by]]: [[f64; 2]; 2]| {
        let [dx, dy] = [bx - ax, by - ay];
        let along = (((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy)).clamp(0.0, 1.0);
        (x - ax - along * dx).hypot(y - ay - along * dy)
    };
    let mut blue = 0.0;
    for (x, y) in (0..900).flat_map(|y| (0..900).map(move |x| (x, y))) {
        let at = [x as f64 + 0.5, y as f64 + 0.5];
        let to_disc = centers.iter().map(|[x, y]| (at[0] - x).hypot(at[1] - y) - 5.0);
        let to_disc = to_disc.fold(f64::INFINITY, f64::min);
        let to_line = lines.iter().map(|line| distance(at, *line) - 0.5);
        let to_line = to_line.fold(f64::INFINITY, f64::min);
        let share = share(x, y);
        blue += share;
        // A pixel's corners are 0.71 pixels from its middle.
        if to_disc < -0.75 {
            assert_eq!(share, 1.0, "in a disc: {x}, {y}");
        }
        if to_disc.min(to_line) > 0.75 {
            assert_eq!(share, 0.0, "beside all: {x}, {y}");
        }
        if to_line < 0.0 {
            assert!(share > 0.2, "on a line: {x}, {y}");
        }
    }
    // The area of discs and lines; lines cross in few pixels.
    let length = |[[ax, ay], [bx, by]]: [[f64; 2]; 2]| (bx - ax).hypot(by - ay);
    let area = 25.0 * std::f64::consts::PI * 25.0
        + lines.iter().map(|line| length(*line) - 10.0).sum::<f64>();
    assert!((blue / area - 1.0).abs() < 0.02, "{blue} {area}");
}
