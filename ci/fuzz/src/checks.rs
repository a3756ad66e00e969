//! Properties of parsers of scenes and readers of traces, for any bytes.
//!
//! The fuzzers call these, and `simulator/tests/it/fuzz_seeds.rs` does with the inputs that they found.

use std::io::{self, Read};
use std::path::Path;

use scene::schema::OptionValue;
use scene::state::StateView;
use scene::trace::csv::{CsvReader, CsvWriter};
use scene::trace::fosssim::{FosssimReader, FosssimWriter};
use scene::trace::{Shape, State, TraceError, TraceReader, TraceWriter};
use scene::{Dimension, ParseOptions, Scene, parse_bytes, write};
use simulator::simulation::Simulation;
use simulator::vocabulary;
use tempfile::TempDir;

/// The largest scene that is simulated, in particles and in forces.
const LARGEST: usize = 12;

/// Upper bound of the iterations per step in a simulated scene.
const MAX_ITERATIONS: u64 = 100;

/// Scenes in XML.
pub(crate) fn scene_xml(bytes: &[u8]) {
    scene(bytes, Path::new("scene.xml"));
}

/// Scenes in JSON: the document, a zero byte, and the mesh `mesh.obj`.
pub(crate) fn scene_json(bytes: &[u8]) {
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    let (document, mesh) = (&bytes[..end], bytes.get(end + 1..).unwrap_or_default());
    // A document may name any file of this machine, pipes included: those are not what is tried here.
    if let Ok(value) = serde_json::from_slice::<serde_json::Value>(document)
        && value.get("obj").is_some_and(|name| name != "mesh.obj")
    {
        return;
    }
    thread_local! {
        static FOLDER: TempDir = tempfile::tempdir().expect("a folder");
    }
    FOLDER.with(|folder| {
        std::fs::write(folder.path().join("mesh.obj"), mesh).expect("a file");
        scene(document, &folder.path().join("scene.json"));
    });
}

/// A scene is refused with a message, or can be written, read again and simulated.
fn scene(bytes: &[u8], path: &Path) {
    let parse = |bytes: &[u8], path: &Path, strict| {
        let options = ParseOptions { strict, ..ParseOptions::default() };
        parse_bytes(bytes, path, &vocabulary(), &options)
    };
    let strict = parse(bytes, path, true);
    let parsed = match parse(bytes, path, false) {
        Ok(parsed) => parsed,
        Err(error) => {
            assert!(error.to_string().contains("help:"), "a remedy in: {error}");
            assert!(strict.is_err(), "strict takes what is else refused: {error}");
            return;
        }
    };
    assert_eq!(strict.is_ok(), parsed.warnings.is_empty(), "{:?}", parsed.warnings);
    let mut text = Vec::new();
    if write::write(&parsed.scene, &mut text).is_ok() {
        let again =
            parse(&text, Path::new("again.xml"), true).expect("what is written can be read");
        let mut text_again = Vec::new();
        write::write(&again.scene, &mut text_again).expect("it can be written again");
        assert_eq!(text, text_again, "{}", String::from_utf8_lossy(&text));
    }
    if is_small(&parsed.scene) {
        simulate(&parsed.scene);
    }
}

fn is_small(scene: &Scene) -> bool {
    let few = |value| !matches!(value, OptionValue::Count(count) if count > MAX_ITERATIONS);
    scene.particles.len() <= LARGEST
        && scene.forces.len() <= LARGEST
        && scene.integrator_options.iter().all(|(_, value)| few(value))
}

/// Three steps: each has a finite answer, or is an error with a remedy.
fn simulate(scene: &Scene) {
    let mut simulation = Simulation::new(scene);
    for _ in 0..3 {
        match simulation.advance() {
            Ok(true) => {
                let StateView { positions, velocities, .. } = simulation.state();
                assert!(positions.iter().chain(velocities).all(|value| value.is_finite()));
            }
            Ok(false) => return,
            Err(error) => {
                assert!(error.to_string().contains("help:"), "a remedy in: {error}");
                return;
            }
        }
        let _ = simulation.energies();
    }
}

/// Traces as text. The first byte says of what shape.
pub(crate) fn trace_csv(bytes: &[u8]) {
    let Some((shape, bytes)) = shape(bytes) else { return };
    let path = Path::new("trace.csv");
    let whole = outcome(CsvReader::new(bytes, path, shape), shape);
    assert_eq!(whole, outcome(CsvReader::new(Dribbling::of(bytes), path, shape), shape));
    let mut writer = CsvWriter::new(Vec::new(), shape).expect("memory takes all");
    write_all(&whole, &mut writer);
    let text = writer.into_inner().expect("memory takes all");
    let again = outcome(CsvReader::new(&text[..], path, shape), shape);
    assert_eq!(canonical(again.states), canonical(whole.states));
}

/// The course's binary traces. The first byte says of what shape.
pub(crate) fn trace_fosssim(bytes: &[u8]) {
    let Some((shape, bytes)) = shape(bytes) else { return };
    let path = Path::new("trace.bin");
    let whole = outcome(Ok(FosssimReader::new(bytes, path, shape)), shape);
    assert_eq!(whole, outcome(Ok(FosssimReader::new(Dribbling::of(bytes), path, shape)), shape));
    let mut writer = FosssimWriter::new(Vec::new());
    write_all(&whole, &mut writer);
    let record = 2 * 8 * shape.n_coordinates();
    assert_eq!(writer.into_inner(), bytes[..record * whole.states.len()]);
}

/// Two or three dimensions, one to eight particles.
fn shape(bytes: &[u8]) -> Option<(Shape, &[u8])> {
    let (first, rest) = bytes.split_first()?;
    let dimension = if first & 1 == 0 { Dimension::Two } else { Dimension::Three };
    Some((Shape { dimension, n_particles: 1 + usize::from(first >> 1 & 7) }, rest))
}

/// A trace as read: the bits of its states, and the message that ends it.
#[derive(Debug, PartialEq)]
struct Outcome {
    states: Vec<[Vec<u64>; 2]>,
    error: Option<String>,
}

fn outcome<R: TraceReader>(reader: Result<R, TraceError>, shape: Shape) -> Outcome {
    let mut outcome = Outcome { states: Vec::new(), error: None };
    let mut reader = match reader {
        Ok(reader) => reader,
        Err(error) => return Outcome { error: Some(error.to_string()), ..outcome },
    };
    let mut state = State::zeros(shape);
    loop {
        match reader.read(&mut state) {
            Ok(true) => {
                let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect();
                outcome.states.push([bits(&state.positions), bits(&state.velocities)]);
            }
            Ok(false) => return outcome,
            Err(error) => return Outcome { error: Some(error.to_string()), ..outcome },
        }
    }
}

/// States of which one NaN is as good as another: text does not tell them apart.
fn canonical(mut states: Vec<[Vec<u64>; 2]>) -> Vec<[Vec<u64>; 2]> {
    for bits in states.iter_mut().flatten().flatten() {
        if f64::from_bits(*bits).is_nan() {
            *bits = f64::NAN.to_bits();
        }
    }
    states
}

fn write_all(outcome: &Outcome, writer: &mut impl TraceWriter) {
    for (step, [positions, velocities]) in (0..).zip(&outcome.states) {
        let values =
            |bits: &[u64]| bits.iter().map(|bits| f64::from_bits(*bits)).collect::<Vec<_>>();
        let (positions, velocities) = (values(positions), values(velocities));
        let state = StateView { step, time: 0.0, positions: &positions, velocities: &velocities };
        writer.write(state).expect("memory takes all");
    }
}

/// Yields a few bytes at a time, as pipes do.
struct Dribbling<'a> {
    rest: &'a [u8],
    size: usize,
}

impl<'a> Dribbling<'a> {
    fn of(bytes: &'a [u8]) -> Self {
        Self { rest: bytes, size: 0 }
    }
}

impl Read for Dribbling<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.size = self.size % 7 + 1;
        let count = self.size.min(buffer.len()).min(self.rest.len());
        let (now, rest) = self.rest.split_at(count);
        buffer[..count].copy_from_slice(now);
        self.rest = rest;
        Ok(count)
    }
}
