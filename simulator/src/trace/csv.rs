//! Traces as comma-separated text.
//!
//! ```text
//! step,time,x0,y0,vx0,vy0,x1,y1,vx1,vy1,…        (x0,y0,z0,vx0,vy0,vz0,… in three dimensions)
//! 0,0.0,…
//! ```
//!
//! A header, then a row a state, the initial state first. Numbers are the shortest decimals that read
//! back to the same f64. The time of a row is its step times the time step.
//!
//! A reader may also accept rows of positions alone: `step,time,x0,y0,z0,x1,…`.

use std::io::{self, BufReader, Read, Write};
use std::path::{Path, PathBuf};

use csv::ByteRecord;

use super::{Shape, State, TraceError, TraceFault, TraceReader, TraceWriter};
use crate::scene::Dimension;
use crate::state::StateView;

/// No number takes more than this many bytes of a line, its comma included.
const MAX_FIELD: usize = 64;

/// The columns of a trace of this shape.
pub fn header(shape: Shape) -> impl Iterator<Item = String> {
    columns(shape, true)
}

/// The columns of a trace, with or without velocities.
fn columns(shape: Shape, velocities: bool) -> impl Iterator<Item = String> {
    let axes: &'static [&'static str] = match (shape.dimension, velocities) {
        (Dimension::Two, true) => &["x", "y", "vx", "vy"],
        (Dimension::Two, false) => &["x", "y"],
        (Dimension::Three, true) => &["x", "y", "z", "vx", "vy", "vz"],
        (Dimension::Three, false) => &["x", "y", "z"],
    };
    let of_particle =
        move |particle: usize| axes.iter().map(move |axis| format!("{axis}{particle}"));
    ["step", "time"]
        .map(str::to_owned)
        .into_iter()
        .chain((0..shape.n_particles).flat_map(of_particle))
}

/// Writes a trace.
pub struct CsvWriter<W: Write> {
    writer: csv::Writer<W>,
    dimension: usize,
}

impl<W: Write> CsvWriter<W> {
    /// Starts a trace with its header.
    ///
    /// # Errors
    /// If the output takes nothing.
    pub fn new(output: W, shape: Shape) -> io::Result<Self> {
        let mut writer = csv::Writer::from_writer(output);
        writer.write_record(header(shape))?;
        Ok(Self { writer, dimension: shape.dimension.count() })
    }

    /// Flushes the buffer and returns the output.
    ///
    /// # Errors
    /// If the output takes no more.
    pub fn into_inner(self) -> io::Result<W> {
        self.writer.into_inner().map_err(|error| error.into_error())
    }
}

impl<W: Write> TraceWriter for CsvWriter<W> {
    fn write(&mut self, state: StateView<'_>) -> io::Result<()> {
        self.writer.write_field(state.step.to_string())?;
        let mut digits = ryu::Buffer::new();
        self.writer.write_field(digits.format(state.time))?;
        let positions = state.positions.chunks_exact(self.dimension);
        for (position, velocity) in positions.zip(state.velocities.chunks_exact(self.dimension)) {
            for value in position.iter().chain(velocity) {
                self.writer.write_field(digits.format(*value))?;
            }
        }
        Ok(self.writer.write_record(None::<&[u8]>)?)
    }
}

/// Reads a trace.
pub struct CsvReader<R: Read> {
    reader: csv::Reader<LimitedLines<BufReader<R>>>,
    record: ByteRecord,
    path: PathBuf,
    shape: Shape,
    next_step: u64,
    /// Whether rows hold velocities.
    velocities: bool,
}

impl<R: Read> CsvReader<R> {
    /// Reads the header. `path` names the trace in messages.
    ///
    /// # Errors
    /// If the header is not the one of a trace of this shape.
    pub fn new(input: R, path: &Path, shape: Shape) -> Result<Self, TraceError> {
        let mut this = Self::unread(input, path, shape);
        this.read_header(false)?;
        Ok(this)
    }

    /// The same; the rows may hold positions alone. Their velocities are then read as 0.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_optional_velocities(
        input: R,
        path: &Path,
        shape: Shape,
    ) -> Result<Self, TraceError> {
        let mut this = Self::unread(input, path, shape);
        this.read_header(true)?;
        Ok(this)
    }

    fn unread(input: R, path: &Path, shape: Shape) -> Self {
        let limit = MAX_FIELD * (2 + 2 * shape.n_coordinates());
        let input = LimitedLines::new(BufReader::with_capacity(1 << 16, input), limit);
        let reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .quoting(false)
            .from_reader(input);
        let path = path.to_path_buf();
        let record = ByteRecord::new();
        Self { reader, record, path, shape, next_step: 0, velocities: true }
    }

    fn read_header(&mut self, optional: bool) -> Result<(), TraceError> {
        let expected: Vec<String> = header(self.shape).collect();
        if !self.read_record()? {
            let columns = expected[..expected.len().min(8)].join(",");
            return Err(self.at_line(1, TraceFault::NoHeader { expected: columns }));
        }
        let fields = || self.record.iter().map(<[u8]>::trim_ascii);
        let of_positions = || columns(self.shape, false);
        if optional && fields().eq(of_positions().map(String::into_bytes)) {
            self.velocities = false;
            return Ok(());
        }
        let differ = |(found, expected): (&[u8], &String)| found != expected.as_bytes();
        let fault = match fields().zip(&expected).position(differ) {
            Some(column) => TraceFault::Header {
                column: column + 1,
                expected: expected[column].clone(),
                found: excerpt(self.record.get(column).unwrap_or_default().trim_ascii()),
            },
            None if self.record.len() != expected.len() => {
                let first: Vec<&[u8]> = fields().take(40).collect();
                TraceFault::HeaderLength {
                    expected: expected.len(),
                    found: self.record.len(),
                    header: excerpt(&first.join(&b',')),
                }
            }
            None => return Ok(()),
        };
        Err(self.at_line(1, fault))
    }

    /// Reads the next row. Returns false at the end of the file.
    fn read_record(&mut self) -> Result<bool, TraceError> {
        self.reader.read_byte_record(&mut self.record).map_err(|error| {
            match error.into_kind() {
                csv::ErrorKind::Io(error) if error.kind() == io::ErrorKind::FileTooLarge => {
                    // What follows is read ahead of the records.
                    let LimitedLines { limit, line, .. } = *self.reader.get_ref();
                    self.at_line(line, TraceFault::LineTooLong { limit })
                }
                csv::ErrorKind::Io(source) => {
                    TraceError::Unreadable { path: self.path.clone(), source }
                }
                other => {
                    let source = io::Error::other(format!("{other:?}"));
                    TraceError::Unreadable { path: self.path.clone(), source }
                }
            }
        })
    }

    fn at_line(&self, line: u64, fault: TraceFault) -> TraceError {
        TraceError::Line { path: self.path.clone(), line, fault }
    }

    /// Line of the record that was read last.
    fn line(&self) -> u64 {
        self.record.position().map_or(0, csv::Position::line)
    }

    fn number(&self, column: usize) -> Result<f64, TraceError> {
        let field = self.record.get(column).unwrap_or_default().trim_ascii();
        parse_number(field).ok_or_else(|| {
            let column = columns(self.shape, self.velocities).nth(column).unwrap_or_default();
            self.at_line(self.line(), TraceFault::NotANumber { column, text: excerpt(field) })
        })
    }
}

impl<R: Read + Send> TraceReader for CsvReader<R> {
    fn read(&mut self, state: &mut State) -> Result<bool, TraceError> {
        if !self.read_record()? {
            return Ok(false);
        }
        let quantities = 1 + usize::from(self.velocities);
        let expected = 2 + quantities * self.shape.n_coordinates();
        if self.record.len() != expected {
            let found = self.record.len();
            return Err(self.at_line(self.line(), TraceFault::RowLength { expected, found }));
        }
        let step = self.record.get(0).unwrap_or_default().trim_ascii();
        // Some programs write every number with a point.
        if parse_number(step) != Some(self.next_step as f64) {
            let fault = TraceFault::StepOrder { expected: self.next_step, found: excerpt(step) };
            return Err(self.at_line(self.line(), fault));
        }
        self.next_step += 1;
        state.time = Some(self.number(1)?);
        let dimension = self.shape.dimension.count();
        for coordinate in 0..self.shape.n_coordinates() {
            let (particle, axis) = (coordinate / dimension, coordinate % dimension);
            let column = 2 + particle * quantities * dimension + axis;
            state.positions[coordinate] = self.number(column)?;
            state.velocities[coordinate] = match self.velocities {
                true => self.number(column + dimension)?,
                false => 0.0,
            };
        }
        Ok(true)
    }

    fn has_velocities(&self) -> bool {
        self.velocities
    }
}

/// Parses a number in the notation of any common language; `None` if it is not a number.
fn parse_number(field: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(field).ok()?;
    text.parse().ok().or_else(|| {
        // `-nan`, `nan(ind)`, `-nan(snan)`, `1.#QNAN`, `-1.#IND`, `1.#INF`: not finite, by C libraries.
        let lower = text.to_ascii_lowercase();
        let unsigned = lower.trim_start_matches(['+', '-']);
        (unsigned.starts_with("nan") || unsigned.starts_with("1.#")).then_some(f64::NAN)
    })
}

/// The beginning of some bytes, as text fit for a message.
fn excerpt(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(80)]);
    text.chars().take(40).collect()
}

/// Fails where a line is longer than `limit`, so that no line fills the memory. What is before that line is
/// handed over first, since it may have a fault of its own.
struct LimitedLines<R> {
    inner: R,
    limit: usize,
    /// The line that is being read, from 1.
    line: u64,
    since_line_end: usize,
    is_too_long: bool,
}

impl<R> LimitedLines<R> {
    fn new(inner: R, limit: usize) -> Self {
        Self { inner, limit, line: 1, since_line_end: 0, is_too_long: false }
    }
}

impl<R: Read> Read for LimitedLines<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = if self.is_too_long { 0 } else { self.inner.read(buffer)? };
        let mut good = 0;
        // A carriage return alone ends a record as well.
        for line in buffer[..count].split_inclusive(|byte| b"\r\n".contains(byte)) {
            self.since_line_end += line.len();
            if self.since_line_end > self.limit {
                self.is_too_long = true;
                break;
            }
            good += line.len();
            match line.last() {
                Some(b'\n') => (self.line, self.since_line_end) = (self.line + 1, 0),
                Some(b'\r') => self.since_line_end = 0,
                _ => {}
            }
        }
        match good {
            0 if self.is_too_long => Err(io::ErrorKind::FileTooLarge.into()),
            good => Ok(good),
        }
    }
}
