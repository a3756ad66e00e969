//! Time of a step by force, integrator and number of particles; time of reading and writing.
//! See README.md beside this file.

use std::fmt::Write;
use std::hint::black_box;
use std::path::Path;
use std::time::Duration;

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use simulator::integrator::{BuildIntegrator, Step};
use simulator::scene::schema::{ActsOn, ForceSchema};
use simulator::scene::{ParseOptions, Scene, xml};
use simulator::simulation::Simulation;
use simulator::solver::linear::LinearSolver;
use simulator::state::StateView;
use simulator::statistics::Statistics;
use simulator::system::System;
use simulator::trace::csv::{CsvReader, CsvWriter};
use simulator::trace::fosssim::{FosssimReader, FosssimWriter};
use simulator::trace::{Shape, State, TraceReader, TraceWriter};
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
    let elements = if force.acts_on == ActsOn::EveryParticle { 1 } else { n - 1 };
    for i in 0..elements {
        let _ = match force.acts_on {
            ActsOn::EveryParticle => write!(text, "<{}", force.tag),
            ActsOn::Pair => write!(text, r#"<{} i="{i}" j="{}""#, force.tag, i + 1),
            ActsOn::Edge => write!(text, r#"<{} edge="{i}""#, force.tag),
        };
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
fn steps(criterion: &mut Criterion) {
    for force in force::REGISTRY {
        let mut group = criterion.benchmark_group(format!("step/{}", force.schema.tag));
        for integrator in integrator::REGISTRY {
            for n in [2, 16, 128] {
                let scene = parse(&chain(n, &force.schema));
                let system = System::<2>::new(&scene);
                let start = Simulation::new(&scene);
                let StateView { positions, velocities, .. } = start.state();
                let start = (positions.to_vec(), velocities.to_vec());
                let mut method = integrator.build(&scene, &system, LinearSolver::Auto);
                let mut statistics = Statistics::default();
                group.throughput(Throughput::Elements(n as u64));
                group.bench_function(BenchmarkId::new(integrator.schema.name, n), |bencher| {
                    let step = |(positions, velocities): &mut (Vec<f64>, Vec<f64>)| {
                        let statistics = &mut statistics;
                        let step =
                            Step { size: TIME_STEP, time: 0.0, positions, velocities, statistics };
                        method.step(&system, step).expect("the step has an answer");
                    };
                    bencher.iter_batched_ref(|| start.clone(), step, BatchSize::SmallInput);
                });
            }
        }
        group.finish();
    }
}

/// The text of a scene in memory to its model.
fn parsing(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("parse");
    let spring = force::REGISTRY.iter().find(|kind| kind.schema.acts_on == ActsOn::Edge);
    let spring = &spring.expect("some force acts on edges").schema;
    for n in [16, 1024] {
        let text = chain(n, spring);
        group.throughput(Throughput::Bytes(text.len() as u64));
        group.bench_function(BenchmarkId::new("chain", n), |bencher| {
            bencher.iter(|| parse(black_box(&text)));
        });
    }
    group.finish();
}

/// A hundred states of 128 particles to memory and back; throughput is in numbers.
fn traces(criterion: &mut Criterion) {
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

    let mut group = criterion.benchmark_group("trace");
    group.throughput(Throughput::Elements(STATES * numbers as u64));
    group.bench_function("write/csv", |bencher| {
        let room = || Vec::with_capacity(csv.len());
        bencher.iter_batched(room, write_csv, BatchSize::LargeInput);
    });
    group.bench_function("write/fosssim", |bencher| {
        let room = || Vec::with_capacity(binary.len());
        bencher.iter_batched(room, write_binary, BatchSize::LargeInput);
    });
    group.bench_function("read/csv", |bencher| {
        bencher.iter(|| {
            let reader = CsvReader::new(black_box(csv.as_slice()), name, shape);
            read_all(Box::new(reader.expect("the header is right")));
        });
    });
    group.bench_function("read/fosssim", |bencher| {
        bencher.iter(|| {
            read_all(Box::new(FosssimReader::new(black_box(binary.as_slice()), name, shape)));
        });
    });
    group.finish();
}

/// Short, so that all of the benches take about two minutes.
fn short() -> Criterion {
    Criterion::default()
        .sample_size(20)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_millis(900))
        .without_plots()
}

criterion_group! { name = benches; config = short(); targets = steps, parsing, traces }
criterion_main!(benches);
