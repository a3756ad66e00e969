//! A mass-spring simulator: called as `simulate SCENE TRACE`, it turns a scene into a trace.
//!
//! PIECE protocol_xml.txt

use std::collections::HashMap;
use std::error::Error;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::process;

struct Element<'a> {
    name: &'a str,
    attributes: HashMap<&'a str, &'a str>,
}

impl Element<'_> {
    fn number(&self, attribute: &str) -> Result<f64, Box<dyn Error>> {
        let text = self.attributes.get(attribute);
        let text = text.ok_or_else(|| format!("<{}> has no {attribute}", self.name))?;
        Ok(text.trim().parse()?)
    }
}

/// The elements of a scene, in the order of the file: as much XML as scenes need.
fn elements(text: &str) -> Vec<Element<'_>> {
    let mut elements = Vec::new();
    let mut rest = text;
    while let Some(open) = rest.find('<') {
        rest = &rest[open + 1..];
        if rest.starts_with("!--") {
            rest = rest.find("-->").map_or("", |end| &rest[end..]);
            continue;
        }
        let (tag, after) = rest.split_once('>').unwrap_or((rest, ""));
        rest = after;
        let tag = tag.trim_end_matches('/');
        let (name, mut list) = tag.split_once(char::is_whitespace).unwrap_or((tag, ""));
        let mut attributes = HashMap::new();
        while let Some((attribute, value)) = list.split_once('=') {
            let value = value.trim_start();
            let Some(quote) = value.chars().next() else { break };
            let Some((value, after)) = value[1..].split_once(quote) else { break };
            attributes.insert(attribute.trim(), value);
            list = after;
        }
        elements.push(Element { name, attributes });
    }
    elements
}

#[derive(Default)]
struct Scene {
    duration: f64,
    dt: f64,
    method: String, // not looked at yet
    mass: Vec<f64>,
    fixed: Vec<bool>,
    x: Vec<[f64; 2]>,
    v: Vec<[f64; 2]>,
}

fn read(text: &str) -> Result<Scene, Box<dyn Error>> {
    let mut scene = Scene::default();
    for element in elements(text) {
        if ["pz", "vz", "fz"].iter().any(|axis| element.attributes.contains_key(axis)) {
            process::exit(77); // three dimensions
        }
        match element.name {
            "duration" => scene.duration = element.number("time")?,
            "integrator" => {
                scene.method = element.attributes.get("type").unwrap_or(&"").to_string();
                scene.dt = element.number("dt")?;
            }
            "particle" => {
                scene.mass.push(element.number("m")?);
                scene.fixed.push(element.number("fixed")? != 0.0);
                scene.x.push([element.number("px")?, element.number("py")?]);
                scene.v.push([element.number("vx")?, element.number("vy")?]);
            }
            // To do: ELEMENTS.
            _ => {}
        }
    }
    Ok(scene)
}

/// The force on each particle at the current state.
fn forces(scene: &Scene) -> Vec<[f64; 2]> {
    let total = vec![[0.0; 2]; scene.x.len()];
    // To do: add FORCES.
    total
}

/// Explicit Euler: positions with the old velocities, velocities with the forces of the old state.
fn step(scene: &mut Scene) {
    // To do: METHODS.
    let force = forces(scene);
    for i in 0..scene.x.len() {
        for axis in 0..2 {
            // A fixed particle keeps its velocity, and moves by it.
            scene.x[i][axis] += scene.dt * scene.v[i][axis];
            if !scene.fixed[i] {
                scene.v[i][axis] += scene.dt * force[i][axis] / scene.mass[i];
            }
        }
    }
}

fn simulate(scene: &str, trace: &str) -> Result<(), Box<dyn Error>> {
    if !scene.ends_with(".xml") {
        process::exit(77);
    }
    let mut scene = read(&fs::read_to_string(scene)?)?;
    let mut trace = BufWriter::new(File::create(trace)?);
    write!(trace, "step,time")?;
    for i in 0..scene.x.len() {
        write!(trace, ",x{i},y{i},vx{i},vy{i}")?;
    }
    writeln!(trace)?;
    let steps = (scene.duration / scene.dt).ceil() as u64;
    for number in 0..=steps {
        if number > 0 {
            step(&mut scene);
        }
        write!(trace, "{number},{}", number as f64 * scene.dt)?;
        for (x, v) in scene.x.iter().zip(&scene.v) {
            write!(trace, ",{},{},{},{}", x[0], x[1], v[0], v[1])?;
        }
        writeln!(trace)?;
    }
    trace.flush()?;
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["--serve"] => {
            for line in io::stdin().lines() {
                let line = line?;
                let (scene, trace) = line.split_once(' ').ok_or("a line is SCENE TRACE")?;
                simulate(scene, trace)?;
            }
            Ok(())
        }
        [scene, trace] => simulate(scene, trace),
        _ => Err("called as: simulate SCENE TRACE, or simulate --serve".into()),
    }
}
