//! Time of a step by force, integrator and number of particles; time of reading and writing.
//! See README.md in this folder.

mod harness;

use std::fmt::Write;
use std::hint::black_box;
use std::mem::take;
use std::path::Path;
use std::time::Duration;

use harness::Harness;
use scene::schema::{ForceSchema, IntegratorOptions, Stencil};
use scene::state::StateView;
use scene::trace::csv::{CsvReader, CsvWriter};
use scene::trace::fosssim::{FosssimReader, FosssimWriter};
use scene::trace::{Shape, State, TraceReader, TraceWriter};
use scene::{Dimension, ParseOptions, Scene, xml};
use simulator::integrator::{BuildIntegrator, Step};
use simulator::simulation::Simulation;
use simulator::solver::linear::LinearSolver;
use simulator::statistics::Statistics;
use simulator::system::System;
use simulator::{force, integrator, vocabulary};

const TIME_STEP: f64 = 1e-3;

/// A zigzag of `n` moving particles, an edge from each to the next; the force acts along these edges,
/// or once on every particle. Parameters are the middles of their typical values.
fn chain(n: usize, force: &ForceSchema) -> String {
    let mut text = format!(
        "<scene>\n<duration time=\"1\"/>\n<integrator type=\"explicit-euler\" dt=\"{TIME_STEP}\"/>\n"
    );
    for i in 0..n {
        let (side, drift) = (i % 2, 0.1 * (i % 5) as f64);
        let _ = writeln!(
            text,
            r#"<particle m="{}" px="{i}" py="{side}" vx="{drift}" vy="-{drift}" fixed="0"/>"#,
            1.0 + drift
        );
    }
    for j in 1..n {
        let _ = writeln!(text, r#"<edge i="{}" j="{j}"/>"#, j - 1);
    }
    let elements = if force.stencil.is_field() { 1 } else { n + 1 - force.stencil.size() };
    for i in 0..elements {
        let _ = write!(text, "<{}", force.tag);
        for (number, attribute) in force.stencil.attributes().iter().enumerate() {
            let _ = write!(text, r#" {attribute}="{}""#, i + number);
        }
        for parameter in force.parameters.iter().filter(|parameter| !parameter.three_dimensional) {
            let (low, high) = parameter.typical;
            let _ = write!(text, r#" {}="{}""#, parameter.name, 0.5 * (low + high) + 0.1);
        }
        text += "/>\n";
    }
    text + "</scene>\n"
}

fn parse(text: &str) -> Scene {
    let parsed = xml::parse(text, "bench.xml", &vocabulary(), &ParseOptions::default());
    parsed.expect("the scene is valid").scene
}

/// One step from the same state again and again; copying the state is not timed.
fn steps(harness: &Harness) {
    for force in force::REGISTRY.iter().filter(|kind| kind.schema.exists_in(Dimension::Two)) {
        for integrator in integrator::REGISTRY {
            for n in [2, 16, 128] {
                let mut scene = parse(&chain(n, &force.schema));
                let schema = &integrator.schema;
                if scene.forces.iter().any(|force| (schema.refuses)(force).is_some()) {
                    continue;
                }
                scene.integrator = schema;
                scene.integrator_options = IntegratorOptions::defaults(schema);
                let system = System::<2>::new(&scene);
                let start = Simulation::new(&scene);
                let StateView { positions, velocities, .. } = start.state();
                let start = (positions.to_vec(), velocities.to_vec());
                let (positions, velocities) = start.clone();
                let earlier = Some(&State { time: None, positions, velocities });
                let mut method = integrator.build(&scene, &system, LinearSolver::Auto);
                let mut statistics = Statistics::default();
                let name = format!("step/{}/{}/{n}", force.schema.tag, schema.name);
                let step = |(positions, velocities): &mut (Vec<f64>, Vec<f64>)| {
                    let statistics = &mut statistics;
                    let (size, time) = (TIME_STEP, 0.0);
                    let step = Step { size, time, positions, velocities, earlier, statistics };
                    method.step(&system, step).expect("the step has an answer");
                };
                harness.run_on(&name, n as u64, || start.clone(), step);
            }
        }
    }
}

/// The text of a scene in memory to its model; an element is a byte.
fn parsing(harness: &Harness) {
    let spring = force::REGISTRY.iter().find(|kind| kind.schema.stencil == Stencil::Edge);
    let spring = &spring.expect("some force acts on edges").schema;
    for n in [16, 1024] {
        let text = chain(n, spring);
        let name = format!("parse/chain/{n}");
        harness.run(&name, text.len() as u64, || parse(black_box(&text)));
    }
}

/// A hundred states of 128 particles to memory and back; an element is a number.
fn traces(harness: &Harness) {
    const STATES: u64 = 100;
    let scene = parse(&chain(128, &force::REGISTRY[0].schema));
    let shape = Shape::of(&scene);
    let numbers = 2 * shape.n_coordinates();
    // Digits as of a real trace: all of them.
    let mut random = fastrand::Rng::with_seed(1);
    let values: Vec<f64> = (0..numbers).map(|_| random.f64() - 0.5).collect();
    let (positions, velocities) = values.split_at(shape.n_coordinates());
    let write_all = |writer: &mut dyn TraceWriter| {
        for step in 0..STATES {
            let state = StateView { step, time: step as f64 * TIME_STEP, positions, velocities };
            writer.write(state).expect("memory takes it");
        }
    };
    let write_csv = |output: Vec<u8>| {
        let mut writer = CsvWriter::new(output, shape).expect("memory takes it");
        write_all(&mut writer);
        writer.into_inner().expect("memory takes it")
    };
    let write_binary = |output: Vec<u8>| {
        let mut writer = FosssimWriter::new(output);
        write_all(&mut writer);
        writer.into_inner()
    };
    let read_all = |mut reader: Box<dyn TraceReader + '_>| {
        let mut state = State::zeros(shape);
        let mut count = 0;
        while reader.read(&mut state).expect("what was written can be read") {
            count += 1;
        }
        assert_eq!(count, STATES);
    };
    let (csv, binary) = (write_csv(Vec::new()), write_binary(Vec::new()));
    let name = Path::new("bench");

    let numbers = STATES * numbers as u64;
    let empty = || Vec::with_capacity(csv.len());
    harness.run_on("trace/write/csv", numbers, empty, |output| write_csv(take(output)));
    let empty = || Vec::with_capacity(binary.len());
    harness.run_on("trace/write/fosssim", numbers, empty, |output| write_binary(take(output)));
    harness.run("trace/read/csv", numbers, || {
        let reader = CsvReader::new(black_box(csv.as_slice()), name, shape);
        read_all(Box::new(reader.expect("the header is right")));
    });
    harness.run("trace/read/fosssim", numbers, || {
        read_all(Box::new(FosssimReader::new(black_box(binary.as_slice()), name, shape)));
    });
}

/// All of it takes about two minutes.
fn main() {
    let harness = Harness::new(20, Duration::from_millis(45));
    steps(&harness);
    parsing(&harness);
    traces(&harness);
}
