//! The XML schema: every element and attribute is read, in any layout; the shipped scenes have no warnings.

use std::path::Path;

use crate::support::shared::{bits, shipped_scenes};
use scene::{
    Color, Dimension, Edge, Location, ParseOptions, Parsed, Particle, ParticlePath, Rendering,
    Scene, Surface, Viewport, parse_bytes,
};
use simulator::simulation::Simulation;
use simulator::{integrator, vocabulary};

/// One of every element, every attribute given.
const EVERYTHING: &str = r#"<scene>
  <description text="a &lt;scene&gt; of ev&#101;rything: grüße"/>
  <scenetag tag="AccuracyTestScene"/>
  <duration time="2.5"/>
  <integrator type="linearized-implicit" dt="0.125"/>
  <maxsimfreq max="60"/>
  <viewport cx="1" cy="-2" size="3.5"/>
  <backgroundcolor r="0" g="0.5" b="1"/>
  <particle m="1.5" px="1" py="-2" vx="3" vy="-4" fixed="0" radius="0.25" tag="first"/>
  <particle m="2" px="5" py="6" vx="0" vy="0" fixed="1"/>
  <particle m="3" px="7" py="8" vx="0.5" vy="0.25" fixed="0"/>
  <edge i="2" j="0" radius="0.05"/>
  <edge i="1" j="2"/>
  <springforce edge="1" k="10" l0="0.5" b="0.75"/>
  <springforce edge="0" k="20" l0="1.5"/>
  <simplegravity fx="0.125" fy="-9.81"/>
  <constantforce fx="3" fy="4"/>
  <gravitationalforce i="2" j="1" G="-6"/>
  <dragdamping b="0.3"/>
  <vortexforce i="0" j="1" kbs="0.8" kvc="1e3"/>
  <particlecolor i="2" r="0.1" g="0.2" b="0.3"/>
  <edgecolor i="1" r="0.4" g="0.5" b="0.6"/>
  <particlepath i="0" duration="1.25" r="0.7" g="0.8" b="0.9"/>
</scene>
"#;

fn parse(bytes: impl AsRef<[u8]>) -> Scene {
    let options = ParseOptions { strict: true, ..ParseOptions::default() };
    let parsed = parse_bytes(bytes.as_ref(), Path::new("scene.xml"), &vocabulary(), &options);
    let Parsed { scene, warnings, .. } = parsed.unwrap_or_else(|error| panic!("{error}"));
    assert!(warnings.is_empty());
    scene
}

/// All of a scene but the places of its forces in the file.
fn content(mut scene: Scene) -> String {
    scene.forces.iter_mut().for_each(|force| force.location = Location::default());
    format!("{scene:?}")
}

#[test]
fn every_element_and_attribute_is_read() {
    let scene = parse(EVERYTHING);
    assert_eq!(scene.name, "scene.xml");
    assert_eq!(scene.description.as_deref(), Some("a <scene> of everything: grüße"));
    assert_eq!(scene.tag.as_deref(), Some("AccuracyTestScene"));
    assert_eq!(scene.dimension, Dimension::Two);
    assert_eq!((scene.duration, scene.time_step, scene.n_steps()), (2.5, 0.125, 20));
    assert_eq!(scene.integrator.name, "linearized-implicit-euler");
    assert_eq!(scene.max_simulation_frequency, Some(60.0));
    let particles = [
        Particle {
            mass: 1.5,
            position: [1.0, -2.0, 0.0],
            velocity: [3.0, -4.0, 0.0],
            fixed: false,
            radius: 0.25,
            tag: Some("first".into()),
        },
        Particle {
            mass: 2.0,
            position: [5.0, 6.0, 0.0],
            velocity: [0.0; 3],
            fixed: true,
            radius: 0.1,
            tag: None,
        },
        Particle {
            mass: 3.0,
            position: [7.0, 8.0, 0.0],
            velocity: [0.5, 0.25, 0.0],
            fixed: false,
            radius: 0.1,
            tag: None,
        },
    ];
    assert_eq!(scene.particles, particles);
    let edges =
        [Edge { particles: [2, 0], radius: 0.05 }, Edge { particles: [1, 2], radius: 0.015 }];
    assert_eq!(scene.edges, edges);
    let rendering = Rendering {
        viewport: Some(Viewport { center: [1.0, -2.0], size: 3.5 }),
        background: Some(Color { r: 0.0, g: 0.5, b: 1.0 }),
        particle_colors: vec![(2, Color { r: 0.1, g: 0.2, b: 0.3 })],
        edge_colors: vec![(1, Color { r: 0.4, g: 0.5, b: 0.6 })],
        particle_paths: vec![ParticlePath {
            particle: 0,
            duration: 1.25,
            color: Color { r: 0.7, g: 0.8, b: 0.9 },
        }],
        surface: Surface::default(),
    };
    assert_eq!(scene.rendering, rendering);
}

#[test]
fn every_force_arrives_with_its_particles_and_parameters() {
    type Row = (&'static str, Option<[usize; 2]>, Option<usize>, Vec<f64>, u32);
    let scene = parse(EVERYTHING);
    let found = scene.forces.iter().map(|force| -> Row {
        assert_eq!(force.location.column, 3, "{}", force.schema.tag);
        let parameters = force.parameters.to_vec();
        (force.schema.tag, force.pair(), force.edge, parameters, force.location.line)
    });
    let expected: [Row; 7] = [
        ("springforce", Some([1, 2]), Some(1), vec![10.0, 0.5, 0.75], 14),
        ("springforce", Some([2, 0]), Some(0), vec![20.0, 1.5, 0.0], 15),
        ("simplegravity", None, None, vec![0.125, -9.81, 0.0], 16),
        ("constantforce", None, None, vec![3.0, 4.0, 0.0], 17),
        ("gravitationalforce", Some([2, 1]), None, vec![-6.0], 18),
        ("dragdamping", None, None, vec![0.3], 19),
        ("vortexforce", Some([0, 1]), None, vec![0.8, 1e3], 20),
    ];
    assert_eq!(found.collect::<Vec<_>>(), expected);
}

#[test]
fn drawing_elements_are_optional() {
    let scene = parse(
        r#"<scene><duration time="0"/><integrator type="implicit" dt="1"/>
           <particle m="1" px="0" py="0" vx="0" vy="0" fixed="0"/></scene>"#,
    );
    assert_eq!(scene.rendering, Rendering::default());
    assert_eq!((scene.description, scene.tag), (None, None));
    assert_eq!(scene.max_simulation_frequency, None);
    assert!(scene.edges.is_empty() && scene.forces.is_empty());
}

#[test]
fn integrator_spellings_are_equivalent() {
    let spellings = [
        ("explicit-euler", "explicit-euler"),
        ("symplectic-euler", "symplectic-euler"),
        ("symplectic", "symplectic-euler"),
        ("semi-implicit-euler", "symplectic-euler"),
        ("semi-implicit", "symplectic-euler"),
        ("forward-backward-euler", "symplectic-euler"),
        ("linearized-implicit-euler", "linearized-implicit-euler"),
        ("linearized-implicit", "linearized-implicit-euler"),
        ("implicit-euler", "implicit-euler"),
        ("implicit", "implicit-euler"),
        ("projected-newton", "projected-newton"),
        ("fast-mass-spring", "fast-mass-spring"),
        ("local-global", "fast-mass-spring"),
        ("velocity-verlet", "velocity-verlet"),
        ("runge-kutta-4", "runge-kutta-4"),
        ("rk4", "runge-kutta-4"),
        ("implicit-midpoint", "implicit-midpoint"),
        ("dormand-prince", "dormand-prince"),
        ("rk45", "dormand-prince"),
        ("bdf2", "bdf2"),
        ("backward-differentiation-2", "bdf2"),
    ];
    for (spelling, name) in spellings {
        // Of forces that every method takes.
        let scene = EVERYTHING.replace("\"linearized-implicit\"", &format!("\"{spelling}\""));
        let taken = |line: &&str| !line.contains("vortex") && !line.contains(r#"b="0.75""#);
        let scene: String = scene.lines().filter(taken).collect();
        assert_eq!(parse(scene).integrator.name, name, "{spelling}");
    }
    // No method and no spelling is missing from the list above.
    let registered: usize =
        integrator::REGISTRY.iter().map(|kind| 1 + kind.schema.aliases.len()).sum();
    assert_eq!(registered, spellings.len());
}

#[test]
fn file_layout_does_not_change_the_model() {
    let plain = content(parse(EVERYTHING));
    let body = EVERYTHING.replace('\n', " ");
    let layouts = [
        ("CRLF", EVERYTHING.replace('\n', "\r\n")),
        ("one line", body.clone()),
        ("byte order mark", format!("\u{feff}{EVERYTHING}")),
        ("declaration", format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{EVERYTHING}")),
        ("comments around", format!("<!-- <scene> & -->\n{EVERYTHING}<!-- end -->\n")),
        ("processing instruction", format!("<?xml-stylesheet href=\"a\"?>{EVERYTHING}")),
        ("comment inside", body.replace("<edge ", "<!-- <edge i=\"9\" --><edge ")),
        ("end tags", body.replace("radius=\"0.05\"/>", "radius=\"0.05\" ></edge >")),
        ("single quotes", EVERYTHING.replace('"', "'")),
        ("spaces in numbers", EVERYTHING.replace("m=\"1.5\"", "m=\" \t1.5\n\"")),
        ("spaces in references", EVERYTHING.replace("edge=\"1\"", "edge=\" 1 \"")),
        ("spaces around =", EVERYTHING.replace("i=\"", "i = \"")),
        ("another way to write it", EVERYTHING.replace("px=\"5\"", "px=\"+0.5E+1\"")),
        ("a character reference", EVERYTHING.replace("px=\"5\"", "px=\"&#53;\"")),
    ];
    for (name, text) in layouts {
        assert_ne!(text, EVERYTHING, "{name}");
        assert_eq!(content(parse(text)), plain, "{name}");
    }
}

#[test]
fn columns_count_characters_and_lines_survive_crlf() {
    let text = EVERYTHING.replace("  <dragdamping", "<!-- grüße --><dragdamping");
    let place = |text: &str| parse(text).forces[5].location;
    assert_eq!(place(&text), Location { line: 19, column: 15 });
    assert_eq!(place(&text.replace('\n', "\r\n")), Location { line: 19, column: 15 });
    assert_eq!(place(&format!("\u{feff}{}", text.replace('\n', " "))).line, 1);
}

#[test]
fn element_order_does_not_change_the_trace() {
    // Numbers follow the order within a kind, and so do sums: that order is kept.
    let trace = |text: &str| {
        let scene = parse(text);
        let mut simulation = Simulation::new(&scene);
        let mut states = Vec::new();
        loop {
            states.push([bits(simulation.state().positions), bits(simulation.state().velocities)]);
            if !simulation.advance().unwrap() {
                return states;
            }
        }
    };
    let expected = trace(EVERYTHING);
    let lines: Vec<&str> = EVERYTHING.lines().collect();
    let elements = &lines[1..lines.len() - 1];
    let kind = |line: &&str| line.split_whitespace().next().unwrap().to_owned();
    let mut random = fastrand::Rng::with_seed(7);
    for round in 0..8 {
        let mut order: Vec<String> = elements.iter().map(kind).collect();
        random.shuffle(&mut order);
        // Each place in the shuffled order takes the next element of its kind.
        let mut left = elements.to_vec();
        let shuffled = order.iter().map(|wanted| {
            let next = left.iter().position(|line| kind(line) == *wanted).unwrap();
            left.remove(next)
        });
        let shuffled: Vec<&str> = shuffled.collect();
        assert_ne!(shuffled, elements, "round {round}");
        assert!(
            trace(&format!("<scene>{}</scene>", shuffled.join("\n"))) == expected,
            "{shuffled:?}"
        );
    }
}

#[test]
fn any_z_attribute_makes_a_scene_of_three_dimensions() {
    let additions = [
        ("py=\"-2\"", "py=\"-2\" pz=\"9\""),
        ("vy=\"-4\"", "vy=\"-4\" vz=\"9\""),
        ("fy=\"-9.81\"", "fy=\"-9.81\" fz=\"9\""),
        ("fy=\"4\"", "fy=\"4\" fz=\"9\""),
        ("py=\"-2\"", "py=\"-2\" pz=\"0\""),
    ];
    for (old, new) in additions {
        let scene = parse(EVERYTHING.replace(old, new));
        assert_eq!(scene.dimension, Dimension::Three, "{new}");
        let values = [
            scene.particles[0].position[2],
            scene.particles[0].velocity[2],
            scene.forces[2].parameters[2],
            scene.forces[3].parameters[2],
        ];
        let expected = additions
            .map(|(_, each)| if each == new && !new.contains("\"0\"") { 9.0 } else { 0.0 });
        assert_eq!(values, expected[..4], "{new}");
        // The particles that do not mention z are in the plane.
        assert_eq!((scene.particles[1].position[2], scene.particles[1].velocity[2]), (0.0, 0.0));
    }
}

#[test]
fn the_number_of_steps_rounds_up_in_floating_point() {
    for (duration, dt, steps) in [
        ("1", "0.25", 4),
        ("1", "0.3", 4),
        ("0", "0.1", 0),
        ("1e-9", "1", 1),
        ("0.3", "0.1", 3),
        // In f64 these are a little more than 7 and than 28, as the course's oracle finds too.
        ("2.1", "0.3", 8),
        ("0.28", "0.01", 29),
    ] {
        let scene = EVERYTHING
            .replace("time=\"2.5\"", &format!("time=\"{duration}\""))
            .replace("dt=\"0.125\"", &format!("dt=\"{dt}\""));
        assert_eq!(parse(scene).n_steps(), steps, "{duration} / {dt}");
    }
}

#[test]
fn the_examples_of_the_help_text_are_elements_of_the_schema() {
    for schema in vocabulary().forces {
        let is_plane = schema.exists_in(Dimension::Two);
        let particles = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 1]].map(|[x, y, z]| {
            let depth = if is_plane { String::new() } else { format!(r#"pz="{z}" vz="0""#) };
            format!(r#"<particle m="1" px="{x}" py="{y}" vx="0" vy="0" fixed="0" {depth}/>"#)
        });
        let scene = parse(format!(
            r#"<scene><duration time="1"/><integrator type="explicit-euler" dt="0.1"/>{}<edge i="0" j="1"/>{}</scene>"#,
            particles.concat(),
            schema.example
        ));
        assert_eq!(scene.forces.last().unwrap().schema.tag, schema.tag);
    }
}

#[test]
fn every_shipped_scene_is_read_without_warnings() {
    let scenes = shipped_scenes();
    assert!(scenes.len() > 100, "{} scenes", scenes.len());
    for path in scenes {
        let options = ParseOptions { strict: true, ..ParseOptions::default() };
        let parsed = scene::load(&path, &vocabulary(), &options);
        let parsed = parsed.unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(parsed.n_warnings, 0, "{}", path.display());
    }
}
