//! Traces in the course's binary format.
//!
//! Raw little-endian f64 without a header, a record a state, the initial state first: all positions,
//! then all velocities, `x0 y0 x1 y1 … vx0 vy0 vx1 vy1 …` (with z in three dimensions).

use std::io::{self, BufReader, Read, Write};
use std::path::{Path, PathBuf};

use super::{Shape, State, TraceError, TraceFault, TraceReader, TraceWriter};
use crate::state::StateView;

/// Writes a trace.
pub struct FosssimWriter<W: Write> {
    output: W,
    record: Vec<u8>,
}

impl<W: Write> FosssimWriter<W> {
    /// Starts a trace.
    pub fn new(output: W) -> Self {
        Self { output, record: Vec::new() }
    }

    /// Gives the output back.
    pub fn into_inner(self) -> W {
        self.output
    }
}

impl<W: Write> TraceWriter for FosssimWriter<W> {
    fn write(&mut self, state: StateView<'_>) -> io::Result<()> {
        self.record.clear();
        for value in state.positions.iter().chain(state.velocities) {
            self.record.extend_from_slice(&value.to_le_bytes());
        }
        self.output.write_all(&self.record)
    }
}

/// Reads a trace.
pub struct FosssimReader<R: Read> {
    input: BufReader<R>,
    record: Vec<u8>,
    path: PathBuf,
    next_record: u64,
}

impl<R: Read> FosssimReader<R> {
    /// Starts at the first record. `path` names the trace in messages.
    pub fn new(input: R, path: &Path, shape: Shape) -> Self {
        let record = vec![0; 2 * shape.n_coordinates() * size_of::<f64>()];
        let input = BufReader::with_capacity(1 << 16, input);
        Self { input, record, path: path.to_path_buf(), next_record: 0 }
    }

    /// Fills the record; how many bytes there were.
    fn fill(&mut self) -> io::Result<usize> {
        let mut filled = 0;
        while filled < self.record.len() {
            match self.input.read(&mut self.record[filled..]) {
                Ok(0) => break,
                Ok(count) => filled += count,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(filled)
    }
}

impl<R: Read + Send> TraceReader for FosssimReader<R> {
    fn read(&mut self, state: &mut State) -> Result<bool, TraceError> {
        let found = self
            .fill()
            .map_err(|source| TraceError::Unreadable { path: self.path.clone(), source })?;
        if found == 0 {
            return Ok(false);
        }
        let expected = self.record.len();
        if found < expected {
            let fault = TraceFault::PartialRecord { expected, found };
            let path = self.path.clone();
            return Err(TraceError::Record { path, record: self.next_record, fault });
        }
        self.next_record += 1;
        state.time = None;
        let values = state.positions.iter_mut().chain(&mut state.velocities);
        let (numbers, _) = self.record.as_chunks::<8>();
        for (value, bytes) in values.zip(numbers) {
            *value = f64::from_le_bytes(*bytes);
        }
        Ok(true)
    }
}
