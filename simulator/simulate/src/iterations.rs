//! The iterates of every step (`--iterations FILE.csv`).
//!
//! ```text
//! step,iteration,residual,energy,step_length,halvings
//! ```
//!
//! `step` is the number of the state that the step leads to. The first iterate of a step has number 0 and no step length.
//! `energy` is empty where there is no incremental potential.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, channel};

use scene::Scene;
use scene::output::OutputFile;
use scene::schema::Convergence;
use simulator::integrator::Iterate;
use simulator::simulation::Simulation;

use crate::Failure;

/// One row of the file.
struct Row {
    iteration: u64,
    residual: Option<f64>,
    energy: Option<f64>,
    step_length: Option<f64>,
    halvings: u64,
}

/// Refuses a scene whose method has no iterations to record.
pub(super) fn refuse_without(path: &Path, scene: &Scene) -> Result<(), Failure> {
    match scene.integrator.convergence {
        Convergence::Update(_) | Convergence::UpdateOption(_) | Convergence::Rounds(_) => Ok(()),
        Convergence::Direct | Convergence::ErrorEstimate(_) => Err(Failure::at(
            path,
            format!(
                "{} has no iterations to record\n  help: leave --iterations out, or choose a method that iterates, for \
                 example --integrator implicit-euler",
                scene.integrator.name
            ),
        )),
    }
}

/// The file being written.
pub(super) struct Iterations {
    writer: csv::Writer<OutputFile>,
    path: PathBuf,
    rows: Receiver<Row>,
}

impl Iterations {
    /// Starts the file, and records the simulation's iterates.
    pub(super) fn start(path: &Path, simulation: &mut Simulation) -> Result<Self, Failure> {
        let (sender, rows) = channel();
        let recorder = move |iterate: &Iterate<'_>| {
            // The receiver lives as long as the run.
            let _ = sender.send(Row {
                iteration: iterate.iteration,
                residual: iterate.residual(),
                energy: iterate.energy_at(iterate.velocities),
                step_length: iterate.step_length,
                halvings: iterate.halvings,
            });
        };
        simulation.record_by(Box::new(recorder));
        let file =
            OutputFile::create(path).map_err(|error| Failure::cannot_create(path, &error))?;
        let mut writer = csv::Writer::from_writer(file);
        let header = ["step", "iteration", "residual", "energy", "step_length", "halvings"];
        writer.write_record(header).map_err(|error| Failure::at(path, error))?;
        Ok(Self { writer, path: path.to_path_buf(), rows })
    }

    /// Writes the iterates of the step that led to state `step`.
    pub(super) fn write(&mut self, step: u64) -> Result<(), Failure> {
        let number = |value: Option<f64>| {
            value.map_or_else(String::new, |value| ryu::Buffer::new().format(value).to_owned())
        };
        for Row { iteration, residual, energy, step_length, halvings } in self.rows.try_iter() {
            let record = [
                step.to_string(),
                iteration.to_string(),
                number(residual),
                number(energy),
                number(step_length),
                halvings.to_string(),
            ];
            self.writer.write_record(record).map_err(|error| Failure::at(&self.path, error))?;
        }
        Ok(())
    }

    /// The file, with all that is buffered written to it.
    pub(super) fn into_file(self) -> Result<(OutputFile, PathBuf), Failure> {
        match self.writer.into_inner() {
            Ok(file) => Ok((file, self.path)),
            Err(error) => Err(Failure::at(&self.path, error.into_error())),
        }
    }
}
