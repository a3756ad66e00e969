//! A fast mass-spring simulator: called as `simulate SCENE TRACE SOLVER`, it turns a scene into a trace.
//!
//! PIECE protocol_json.txt

use std::collections::HashSet;
use std::error::Error;
use std::fs::{self, File};
use std::io::{BufWriter, Write};

type Vector = [f64; 3];

const TIME_STEP: f64 = 1.0 / 30.0;
const STEPS: u32 = 30;
/// On each vertex, not scaled by its mass.
#[allow(dead_code)]
const EXTERNAL_FORCE: Vector = [0.0, -9.8, 0.0];

#[derive(Default)]
#[allow(dead_code)] // Not all of it is used yet.
struct Scene {
    stiffness: f64,
    mass: Option<f64>,
    wind: bool,
    pinned: Vec<usize>,           // from 0
    springs: Vec<(usize, usize)>, // vertices from 0
    rest: Vec<Vector>,
    x: Vec<Vector>,
    previous: Vec<Vector>,
}

/// The text of a key's value: as much JSON as scenes need.
fn value<'a>(json: &'a str, key: &str) -> Option<&'a str> {
    let rest = json.split_once(&format!("\"{key}\""))?.1.split_once(':')?.1.trim_start();
    let end = if rest.starts_with('[') { rest.find(']') } else { rest.find([',', '}']) };
    Some(rest[..end?].trim())
}

fn read(path: &str) -> Result<Scene, Box<dyn Error>> {
    let json = fs::read_to_string(path)?;
    let mut scene = Scene {
        stiffness: value(&json, "k").ok_or("no k")?.parse()?,
        mass: value(&json, "m").map(str::parse).transpose()?,
        wind: value(&json, "wind") == Some("true"),
        ..Scene::default()
    };
    let pins = value(&json, "b").unwrap_or("").trim_start_matches('[');
    for vertex in pins.split(',').map(str::trim).filter(|vertex| !vertex.is_empty()) {
        scene.pinned.push(vertex.parse::<usize>()? - 1);
    }
    let mesh = fs::read_to_string(value(&json, "obj").ok_or("no obj")?.trim_matches('"'))?;
    let mut known = HashSet::new();
    for line in mesh.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let numbers: Vec<f64> = words.take(3).map(str::parse).collect::<Result<_, _>>()?;
                let [x, y, z] = numbers[..] else {
                    return Err("a vertex has three coordinates".into());
                };
                scene.rest.push([x, y, z]);
            }
            Some("f") => {
                // 3/1 is vertex 3.
                let corner = |word: &str| word.split('/').next().unwrap_or("").parse::<usize>();
                let face: Vec<usize> = words.map(corner).collect::<Result<_, _>>()?;
                for (place, &i) in face.iter().enumerate() {
                    for &j in &face[place + 1..] {
                        if known.insert((i.min(j), i.max(j))) {
                            scene.springs.push((i - 1, j - 1));
                        }
                    }
                }
            }
            _ => {}
        }
    }
    (scene.x, scene.previous) = (scene.rest.clone(), scene.rest.clone());
    Ok(scene)
}

/// Data that stay the same in all steps. To do: signed incidence matrix, masses, Q and its factorisation.
fn precompute(_scene: &mut Scene, _is_dense: bool) {}

/// One step. To do: 50 rounds of the local step (a vector d for each spring) and the global step (Q p = b).
fn step(scene: &mut Scene) {
    scene.previous.clone_from(&scene.x);
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, path, trace, solver] = &arguments[..] else {
        return Err("called as: simulate SCENE TRACE SOLVER".into());
    };
    let mut scene = read(path)?;
    precompute(&mut scene, solver == "dense");
    let mut trace = BufWriter::new(File::create(trace)?);
    write!(trace, "step,time")?;
    for i in 0..scene.x.len() {
        write!(trace, ",x{i},y{i},z{i}")?;
    }
    writeln!(trace)?;
    for number in 0..=STEPS {
        if number > 0 {
            step(&mut scene);
        }
        write!(trace, "{number},{}", f64::from(number) * TIME_STEP)?;
        for number in scene.x.iter().flatten() {
            write!(trace, ",{number}")?;
        }
        writeln!(trace)?;
    }
    trace.flush()?;
    Ok(())
}
