//! Energies and momentum of every state, as comma-separated text.
//!
//! ```text
//! step,time,kinetic,potential,total,momentum_x,momentum_y        (and momentum_z in three dimensions)
//! ```
//!
//! Fixed particles count as any other. Forces without an energy (drag, spring damping, vortex) add
//! nothing to `potential`.

use std::io::{self, Write};

use crate::Dimension;
use crate::state::{Energies, StateView};

/// Writes the file.
pub struct EnergyWriter<W: Write> {
    writer: csv::Writer<W>,
}

impl<W: Write> EnergyWriter<W> {
    /// Starts the file with its header.
    ///
    /// # Errors
    /// If the output takes nothing.
    pub fn new(output: W, dimension: Dimension) -> io::Result<Self> {
        let mut writer = csv::Writer::from_writer(output);
        let columns = ["step", "time", "kinetic", "potential", "total"].into_iter();
        let momentum = ["momentum_x", "momentum_y", "momentum_z"];
        writer.write_record(columns.chain(momentum.into_iter().take(dimension.count())))?;
        Ok(Self { writer })
    }

    /// Writes the energies of `state`.
    ///
    /// # Errors
    /// If the output takes no more.
    pub fn write(&mut self, state: StateView<'_>, energies: &Energies) -> io::Result<()> {
        self.writer.write_field(state.step.to_string())?;
        let total = energies.kinetic + energies.potential;
        let columns = [state.time, energies.kinetic, energies.potential, total];
        let mut digits = ryu::Buffer::new();
        for value in columns.iter().chain(&energies.momentum) {
            self.writer.write_field(digits.format(*value))?;
        }
        Ok(self.writer.write_record(None::<&[u8]>)?)
    }

    /// Flushes the buffer and returns the output.
    ///
    /// # Errors
    /// If the output takes no more.
    pub fn into_inner(self) -> io::Result<W> {
        self.writer.into_inner().map_err(|error| error.into_error())
    }
}
