//! Our side: the simulator in this process, and its peak memory in a separate process.

use std::collections::HashMap;
use std::env;
use std::process::Command;
use std::time::Instant;

use scene::Scene;
use simulator::force::{Block, Coupling, Degenerate, ElementJacobians, JacobianSink};
use simulator::generate::{
    Generator, Material, Net, PinnedEdge, Sheet, SpringLaw, Springs, Timeline,
};
use simulator::simulation::Simulation;
use simulator::sizes::PARALLEL;
use simulator::statistics::Statistics;
use simulator::system::System;
use simulator::vocabulary;
use sparse::statistics::LinearStatistics;
use sparse::system::SparseSystem;

use crate::limits::Work;
use crate::method::{Body, METHODS, Method, Peer, STIFFNESS};

/// Our side of a cell.
pub(crate) struct Ours {
    scene: Scene,
    steps: u64,
    untimed: u64,
    body: Body,
    /// Whether the matrix is assembled in the place of steps.
    assembles: bool,
}

impl Ours {
    /// The body on which the method takes so many steps.
    ///
    /// # Errors
    /// The reason why that cannot be measured.
    pub(crate) fn new(method: &Method, segments: u64, steps: u64) -> Result<Self, String> {
        let integrator = vocabulary().integrator(method.integrator);
        let integrator = integrator.ok_or("this build has no such integrator")?;
        let untimed = u64::from(method.first_step_untimed);
        let options = method.options.iter();
        let options = options.map(|(name, value)| (name.to_string(), value.to_string()));
        let timeline = Timeline {
            integrator,
            options: options.collect(),
            time_step: Some(method.time_step),
            duration: 0.0,
            steps: Some(steps + untimed),
        };
        let scene = match method.body {
            Body::Net => {
                let is_green = method.peer == Peer::Python;
                let law = if is_green { SpringLaw::Green } else { SpringLaw::Hooke };
                let springs = Springs { stiffness: STIFFNESS, damping: 0.0, law };
                Net { segments, springs, timeline, ..Net::default() }.scene()
            }
            Body::Sheet => {
                let force = vocabulary().force("stvktriangle");
                let force = force.ok_or("this build has no such triangle")?;
                let (youngs_modulus, density) = (STIFFNESS, 1000.0);
                let sheet = Sheet {
                    nx: segments,
                    ny: segments,
                    width: 1.0,
                    height: 1.0,
                    pinned: PinnedEdge::None,
                    stretch: 1.1,
                    gravity: 0.0,
                    material: Material { force, youngs_modulus, poisson_ratio: 0.3, density },
                    timeline,
                };
                sheet.scene()
            }
        };
        let scene = scene.map_err(|error| error.to_string())?;
        let assembles = method.peer == Peer::ScikitFem;
        Ok(Self { scene, steps, untimed, body: method.body, assembles })
    }

    /// The scene.
    pub(crate) fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Steps the body, and returns the time in ns a step, and its work. Building the simulation is not timed.
    ///
    /// # Errors
    /// If a step fails.
    pub(crate) fn time(&self) -> Result<(f64, Option<Work>), String> {
        if self.assembles {
            return Ok((self.time_of_assembly()?, None));
        }
        let mut simulation = Simulation::new(&self.scene);
        advance(&mut simulation, self.untimed)?;
        let before = simulation.statistics().linear.factor;
        let start = Instant::now();
        advance(&mut simulation, self.steps)?;
        let time = start.elapsed().as_secs_f64() * 1e9 / self.steps as f64;
        let Statistics { linear, force_evaluations, .. } = simulation.statistics();
        let a_step = |after: u64, before: u64| (after - before) as f64 / self.steps as f64;
        // Implicit methods evaluate forces as well, in a small part of their time.
        let has_roots = linear.solves == 0 && self.body == Body::Net;
        let elements = self.scene.forces.len();
        let work = Work {
            roots: if has_roots { a_step(*force_evaluations, 0) * elements as f64 } else { 0.0 },
            cores: if elements < PARALLEL { 1 } else { rayon::current_num_threads() },
            operations: a_step(linear.factor.operations, before.operations),
            bytes: a_step(linear.factor.bytes, before.bytes),
            factor: linear.factor.entries as f64 * 8.0,
        };
        Ok((time, Some(work)))
    }

    /// Assembles the matrix as often as there are steps, and returns the time of one.
    fn time_of_assembly(&self) -> Result<f64, String> {
        let physics = System::<2>::new(&self.scene);
        let system = empty_matrix(&physics);
        let mut sink = Sink { system, scale: 1.0 };
        let (x, v) = (self.scene.positions(), self.scene.velocities());
        let start = Instant::now();
        for _ in 0..self.steps {
            sink.system.clear();
            physics.jacobians(&x, &v, 0.0, &mut sink).map_err(without_direction)?;
        }
        Ok(start.elapsed().as_secs_f64() * 1e9 / self.steps as f64)
    }

    /// The positions after so many steps; of a matrix, its Frobenius norm over the modulus.
    ///
    /// # Errors
    /// If a step fails.
    pub(crate) fn positions(&self, steps: u64) -> Result<Vec<f64>, String> {
        if self.assembles {
            let mut blocks = Blocks::default();
            let (x, v) = (self.scene.positions(), self.scene.velocities());
            let physics = System::<2>::new(&self.scene);
            physics.jacobians(&x, &v, 0.0, &mut blocks).map_err(without_direction)?;
            let squared: f64 = blocks.0.values().map(Block::norm_squared).sum();
            return Ok(vec![squared.sqrt() / STIFFNESS]);
        }
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

/// The matrix of the first step of linearized implicit Euler on a net, negated: `h² ∂F/∂x − M`. The solver may solve with an
/// old factor in the place of a new one, but only with that of a positive definite matrix.
pub(crate) struct Factor {
    system: SparseSystem<2>,
    /// Multiplications and additions of a factorisation, as its pattern tells them.
    pub(crate) operations: f64,
}

impl Factor {
    /// Assembles, analyses and factorises it.
    ///
    /// # Errors
    /// The reason why that cannot be done.
    pub(crate) fn new(segments: u64) -> Result<Self, String> {
        let method = &METHODS[0];
        let scene = Ours::new(method, segments, 1)?.scene;
        let physics = System::<2>::new(&scene);
        let mut system = empty_matrix(&physics);
        for (particle, mass) in physics.masses().iter().enumerate() {
            system.add_diagonal(particle, -mass);
        }
        let mut sink = Sink { system, scale: method.time_step * method.time_step };
        let (x, v) = (scene.positions(), scene.velocities());
        physics.jacobians(&x, &v, 0.0, &mut sink).map_err(without_direction)?;
        let mut factor = Self { system: sink.system, operations: 0.0 };
        factor.system.right_mut().fill(1.0);
        let work = |of: LinearStatistics| of.factor.operations as f64;
        factor.operations = work(factor.solve(false)?.1) - work(factor.solve(true)?.1);
        Ok(factor)
    }

    /// The time of a factorisation in ns: of a solution with one, less that of a solution without.
    ///
    /// # Errors
    /// If the matrix cannot be factorised.
    pub(crate) fn time(&mut self) -> Result<f64, String> {
        let (with, of_with) = self.solve(false)?;
        let (without, of_without) = self.solve(true)?;
        if (of_with.factorisations, of_without.factorisations) != (1, 0) {
            return Err("a solution did not factorise as expected".into());
        }
        Ok(with - without)
    }

    fn solve(&mut self, again: bool) -> Result<(f64, LinearStatistics), String> {
        let mut statistics = LinearStatistics::default();
        let start = Instant::now();
        let solved = if again {
            self.system.solve_again(&mut statistics)
        } else {
            self.system.solve(&mut statistics)
        };
        solved.map_err(|error| error.to_string())?;
        Ok((start.elapsed().as_secs_f64() * 1e9, statistics))
    }
}

fn without_direction(Degenerate { element, .. }: Degenerate) -> String {
    format!("element {element} has no direction")
}

/// A matrix of zeros with a block for each two particles of an element.
fn empty_matrix(physics: &System<2>) -> SparseSystem<2> {
    let mut couplings = Vec::new();
    physics.couplings(&mut |coupling| {
        if let Coupling::Stencil { particles, .. } = coupling {
            for (number, first) in particles.iter().enumerate() {
                couplings.extend(particles[..number].iter().map(|second| [*first, *second]));
            }
        }
    });
    SparseSystem::new(physics.n_particles(), &couplings, true)
}

/// The blocks of a matrix by their rows and columns.
#[derive(Default)]
struct Blocks(HashMap<[usize; 2], Block<2>>);

impl JacobianSink<2> for Blocks {
    fn add(&mut self, element: ElementJacobians<'_, 2>) {
        element.spread(element.by_position, |row, column, block| {
            *self.0.entry([row, column]).or_insert_with(Block::zeros) += block;
        });
    }
}

/// Adds a multiple of the Jacobians by positions to a system.
struct Sink {
    system: SparseSystem<2>,
    scale: f64,
}

impl JacobianSink<2> for Sink {
    fn add(&mut self, element: ElementJacobians<'_, 2>) {
        element.spread(element.by_position, |row, column, block| {
            self.system.add(row, column, &(block * self.scale));
        });
    }
}

/// Time and memory of the first steps of a net, measured in a separate process.
#[derive(Clone, Copy)]
pub(crate) struct Taken {
    /// Seconds of building the simulation and of its first step, which analyses the matrix.
    pub(crate) first: f64,
    /// Seconds of a later step.
    pub(crate) later: f64,
    /// Peak memory in bytes, with the scene.
    pub(crate) bytes: u64,
}

impl Taken {
    /// Steps taken.
    pub(crate) const STEPS: u64 = 3;

    /// Time and memory of the first steps of a net in this process, on one line.
    ///
    /// # Errors
    /// If they cannot be taken, or the system does not tell the memory of a process.
    pub(crate) fn here(method: &Method, segments: u64) -> Result<String, String> {
        let ours = Ours::new(method, segments, Self::STEPS)?;
        let start = Instant::now();
        let mut simulation = Simulation::new(&ours.scene);
        advance(&mut simulation, 1)?;
        let first = start.elapsed().as_secs_f64();
        let start = Instant::now();
        advance(&mut simulation, Self::STEPS - 1)?;
        let later = start.elapsed().as_secs_f64() / (Self::STEPS - 1) as f64;
        let unknown = || String::from("this system does not tell the peak memory of a process");
        let status = std::fs::read_to_string("/proc/self/status").map_err(|_| unknown())?;
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kibibytes = line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok());
        Ok(format!("{first} {later} {}", kibibytes.ok_or_else(unknown)? * 1024))
    }

    /// The same of a child process, which has done nothing else.
    ///
    /// # Errors
    /// The reason why it is not known.
    pub(crate) fn by_child(method: &Method, segments: usize) -> Result<Self, String> {
        let executable = env::current_exe().map_err(|error| error.to_string())?;
        let mut command = Command::new(executable);
        command.args(["--grow", method.integrator, "--segments"]).arg(segments.to_string());
        let child = command.output().map_err(|error| error.to_string())?;
        let printed = String::from_utf8_lossy(&child.stdout).into_owned();
        let mut words = printed.split_whitespace();
        let mut taken = || {
            let (first, later) = (words.next()?.parse().ok()?, words.next()?.parse().ok()?);
            Some(Self { first, later, bytes: words.next()?.parse().ok()? })
        };
        taken().ok_or_else(|| {
            let said = String::from_utf8_lossy(&child.stderr).trim().replace("error: ", "");
            if said.is_empty() { format!("it ended with {}", child.status) } else { said }
        })
    }
}
