//! Our side: the simulator in this process, and its peak memory in a process of its own.

use std::env;
use std::process::Command;
use std::time::Instant;

use simulator::generate::{Generator, Length, Net, Springs, Timeline};
use simulator::scene::Scene;
use simulator::scene::schema::ForceSchema;
use simulator::simulation::Simulation;
use simulator::vocabulary;

use crate::method::{METHODS, Method, Peer, STIFFNESS};

/// Our side of a cell.
pub(crate) struct Ours {
    scene: Scene,
    steps: u64,
    untimed: u64,
}

/// The slides' spring, if this build has it.
pub(crate) fn green_spring() -> Option<&'static ForceSchema> {
    vocabulary().force("greenspringforce")
}

impl Ours {
    /// The net on which the method takes so many steps.
    ///
    /// # Errors
    /// The reason why that cannot be measured.
    pub(crate) fn new(method: &Method, segments: u64, steps: u64) -> Result<Self, String> {
        let integrator = vocabulary().integrator(method.integrator);
        let integrator = integrator.ok_or("this build has no such integrator")?;
        let untimed = u64::from(method.first_step_untimed);
        let net = Net {
            segments,
            springs: Springs { stiffness: STIFFNESS, damping: 0.0 },
            timeline: Timeline {
                integrator,
                time_step: Some(method.time_step),
                length: Length::Steps(steps + untimed),
            },
            ..Net::default()
        };
        let mut scene = net.scene().map_err(|error| error.to_string())?;
        if let (Peer::Python, Some(green)) = (method.peer, green_spring()) {
            replace_springs(&mut scene, green);
        }
        Ok(Self { scene, steps, untimed })
    }

    /// The net.
    pub(crate) fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Steps the net, and returns the time in ns a step. Building the simulation is not timed.
    ///
    /// # Errors
    /// Where a step has no answer.
    pub(crate) fn time(&self) -> Result<f64, String> {
        let mut simulation = Simulation::new(&self.scene);
        advance(&mut simulation, self.untimed)?;
        let start = Instant::now();
        advance(&mut simulation, self.steps)?;
        Ok(start.elapsed().as_secs_f64() * 1e9 / self.steps as f64)
    }

    /// The positions after so many steps.
    ///
    /// # Errors
    /// Where a step has no answer.
    pub(crate) fn positions(&self, steps: u64) -> Result<Vec<f64>, String> {
        let mut simulation = Simulation::new(&self.scene);
        advance(&mut simulation, steps)?;
        Ok(simulation.state().positions.to_vec())
    }
}

fn advance(simulation: &mut Simulation, steps: u64) -> Result<(), String> {
    for _ in 0..steps {
        simulation.advance().map_err(|error| error.to_string())?;
    }
    Ok(())
}

/// The same net with another law of its springs.
fn replace_springs(scene: &mut Scene, law: &'static ForceSchema) {
    for spring in scene.forces.iter_mut().filter(|force| force.edge.is_some()) {
        let [stiffness, rest_length, ..] = spring.parameters;
        spring.schema = law;
        for (value, parameter) in spring.parameters.iter_mut().zip(law.parameters) {
            *value = match parameter.name {
                "k" => stiffness,
                "l0" => rest_length,
                _ => parameter.default.unwrap_or(0.0),
            };
        }
    }
}

/// Peak memory of this process in bytes, after two linearized implicit steps of a net.
///
/// # Errors
/// The reason why it is not known.
pub(crate) fn peak_memory(segments: u64) -> Result<u64, String> {
    Ours::new(&METHODS[0], segments, 2)?.time()?;
    let unknown = || String::from("this system does not tell the peak memory of a process");
    let status = std::fs::read_to_string("/proc/self/status").map_err(|_| unknown())?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kibibytes = line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok());
    Ok(kibibytes.ok_or_else(unknown)? * 1024)
}

/// The same of a child process, which has done nothing else.
///
/// # Errors
/// The reason why it is not known.
pub(crate) fn memory_of_child(segments: usize) -> Result<u64, String> {
    let executable = env::current_exe().map_err(|error| error.to_string())?;
    let child = Command::new(executable).arg("--memory").arg(segments.to_string()).output();
    let child = child.map_err(|error| error.to_string())?;
    let bytes = String::from_utf8_lossy(&child.stdout).trim().parse();
    bytes.map_err(|_| String::from_utf8_lossy(&child.stderr).trim().replace("error: ", ""))
}
