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

use std::io::{self, Read, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use memchr::memchr2;

use super::{Shape, State, TraceError, TraceFault, TraceReader, TraceWriter};
use crate::Dimension;
use crate::state::StateView;

/// No number takes more than this many bytes of a line, as `%.17f` writes the largest: sign, digits, point, decimals, comma.
const MAX_FIELD: usize = 1 + 309 + 1 + 17 + 1;

/// Bytes that are asked for at a time.
const READ_SIZE: usize = 1 << 16;

/// Byte order mark of UTF-8, which some editors write.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

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
    lines: Lines<R>,
    path: PathBuf,
    shape: Shape,
    next_step: u64,
    /// Whether the current line is to be read again.
    is_pending: bool,
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
        let path = path.to_path_buf();
        let (lines, next_step, is_pending) = (Lines::new(input, limit), 0, false);
        Self { lines, path, shape, next_step, is_pending, velocities: true }
    }

    fn read_header(&mut self, optional: bool) -> Result<(), TraceError> {
        let expected: Vec<String> = header(self.shape).collect();
        if !self.lines.advance().map_err(|fault| self.line_fault(fault))? {
            let columns = expected[..expected.len().min(8)].join(",");
            let fault = TraceFault::NoHeader { expected: columns };
            return Err(TraceError::Line { path: self.path.clone(), line: 1, fault });
        }
        let row = self.lines.current();
        let row = row.strip_prefix(BYTE_ORDER_MARK).unwrap_or(row);
        let fields = || row.split(|byte| *byte == b',').map(<[u8]>::trim_ascii);
        let of_positions = || columns(self.shape, false);
        if optional && fields().eq(of_positions().map(String::into_bytes)) {
            self.velocities = false;
            return Ok(());
        }
        let differ = |(found, expected): (&[u8], &String)| found != expected.as_bytes();
        let found = fields().count();
        let fault = match fields().zip(&expected).position(differ) {
            Some(column) => TraceFault::Header {
                column: column + 1,
                expected: expected[column].clone(),
                found: excerpt(fields().nth(column).unwrap_or_default()),
            },
            None if found != expected.len() => {
                let first: Vec<&[u8]> = fields().take(40).collect();
                let header = excerpt(&first.join(&b','));
                TraceFault::HeaderLength { expected: expected.len(), found, header }
            }
            None => return Ok(()),
        };
        Err(self.fault(fault))
    }

    fn line_fault(&self, fault: LineFault) -> TraceError {
        match fault {
            LineFault::TooLong => self.fault(TraceFault::LineTooLong { limit: self.lines.limit }),
            LineFault::Unreadable(source) => {
                TraceError::Unreadable { path: self.path.clone(), source }
            }
        }
    }

    /// A fault in the current line.
    fn fault(&self, fault: TraceFault) -> TraceError {
        TraceError::Line { path: self.path.clone(), line: self.lines.number, fault }
    }

    /// Reads the current line as the row of the next step; `None` if it is not.
    fn read_row(&self, state: &mut State) -> Option<()> {
        let mut row = Row(Some(self.lines.current()));
        let is_next = row.number()? == self.next_step as f64;
        state.time = Some(row.number()?);
        let dimension = self.shape.dimension.count();
        let positions = state.positions.chunks_exact_mut(dimension);
        for (position, velocity) in positions.zip(state.velocities.chunks_exact_mut(dimension)) {
            for value in position {
                *value = row.number()?;
            }
            for value in velocity {
                *value = if self.velocities { row.number()? } else { 0.0 };
            }
        }
        (is_next && row.0.is_none()).then_some(())
    }

    /// The fault of the current line, which is not the row of the next step.
    fn row_fault(&self) -> TraceFault {
        let columns = columns(self.shape, self.velocities);
        let fields = || self.lines.current().split(|byte| *byte == b',').map(<[u8]>::trim_ascii);
        let quantities = 1 + usize::from(self.velocities);
        let expected = 2 + quantities * self.shape.n_coordinates();
        let found = fields().count();
        if found != expected {
            return TraceFault::RowLength { expected, found };
        }
        let mut others = columns.zip(fields()).skip(1);
        // Some programs write every number with a point.
        let is_next = |step: &[u8]| parse_number(step) == Some(self.next_step as f64);
        match others.find(|(_, field)| parse_number(field).is_none()) {
            Some((column, field)) if fields().next().is_some_and(is_next) => {
                TraceFault::NotANumber { column, text: excerpt(field) }
            }
            _ => {
                let step = fields().next().unwrap_or_default();
                TraceFault::StepOrder { expected: self.next_step, found: excerpt(step) }
            }
        }
    }
}

/// After the error that the first row has step 1, its rows are read from that one on.
impl<R: Read + Send> TraceReader for CsvReader<R> {
    fn read(&mut self, state: &mut State) -> Result<bool, TraceError> {
        let is_pending = std::mem::take(&mut self.is_pending);
        if !is_pending && !self.lines.advance().map_err(|fault| self.line_fault(fault))? {
            return Ok(false);
        }
        if self.read_row(state).is_none() {
            let fault = self.row_fault();
            if fault.starts_at_one() {
                (self.next_step, self.is_pending) = (1, true);
            }
            return Err(self.fault(fault));
        }
        self.next_step += 1;
        Ok(true)
    }

    fn has_velocities(&self) -> bool {
        self.velocities
    }
}

/// The rest of a row; `None` after its last field.
struct Row<'a>(Option<&'a [u8]>);

impl Row<'_> {
    /// The next field, if it is a number.
    #[inline]
    fn number(&mut self) -> Option<f64> {
        let rest = self.0?;
        // One pass finds both the number and its end, unless something else stands there.
        if let Ok((value, length)) = fast_float2::parse_partial::<f64, _>(rest) {
            match rest.get(length) {
                Some(b',') => {
                    self.0 = Some(&rest[length + 1..]);
                    return Some(value);
                }
                None => {
                    self.0 = None;
                    return Some(value);
                }
                Some(_) => {}
            }
        }
        let mut fields = rest.splitn(2, |byte| *byte == b',');
        let field = fields.next()?;
        self.0 = fields.next();
        parse_number(field.trim_ascii())
    }
}

/// Parses a number in the notation of any common language; `None` if it is not a number.
fn parse_number(field: &[u8]) -> Option<f64> {
    fast_float2::parse(field).ok().or_else(|| {
        // `-nan`, `nan(ind)`, `-nan(snan)`, `1.#QNAN`, `-1.#IND`, `1.#INF`: not finite, by C libraries.
        let lower = field.to_ascii_lowercase();
        let signs = lower.iter().take_while(|byte| b"+-".contains(byte)).count();
        let unsigned = &lower[signs..];
        (unsigned.starts_with(b"nan") || unsigned.starts_with(b"1.#")).then_some(f64::NAN)
    })
}

/// The beginning of some bytes, as text fit for a message.
fn excerpt(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(80)]);
    text.chars().take(40).collect()
}

/// The lines of a text that are not empty. A carriage return alone ends a line as well, but is not counted.
///
/// Memory is that of the longest line, and no line may be longer than the limit.
struct Lines<R> {
    input: R,
    /// Bytes read; the current line is at `line`, the bytes after it at `rest`.
    buffer: Vec<u8>,
    line: Range<usize>,
    rest: Range<usize>,
    /// Largest length of a line, in bytes.
    limit: usize,
    /// Number of the current line, from 1.
    number: u64,
    /// Number of the line at the start of `rest`.
    next_number: u64,
}

enum LineFault {
    TooLong,
    Unreadable(io::Error),
}

impl<R: Read> Lines<R> {
    fn new(input: R, limit: usize) -> Self {
        let buffer = vec![0; READ_SIZE];
        Self { input, buffer, line: 0..0, rest: 0..0, limit, number: 1, next_number: 1 }
    }

    /// The current line, without its end.
    fn current(&self) -> &[u8] {
        &self.buffer[self.line.clone()]
    }

    /// Moves to the next line that is not empty; false at the end of the file.
    fn advance(&mut self) -> Result<bool, LineFault> {
        let mut searched = 0;
        loop {
            let Range { start, end } = self.rest;
            let found = memchr2(b'\n', b'\r', &self.buffer[start + searched..end]);
            let length = found.map_or(end - start, |at| searched + at);
            self.number = self.next_number;
            if length > self.limit {
                return Err(LineFault::TooLong);
            }
            if found.is_some() {
                self.next_number += u64::from(self.buffer[start + length] == b'\n');
                self.line = start..start + length;
                self.rest = start + length + 1..end;
                searched = 0;
                if length > 0 {
                    return Ok(true);
                }
            } else if self.fill()? {
                searched = length;
            } else {
                self.line = self.rest.clone();
                self.rest.start = self.rest.end;
                return Ok(!self.line.is_empty());
            }
        }
    }

    /// Reads on behind `rest`, which moves to the start of the buffer; false at the end of the file.
    fn fill(&mut self) -> Result<bool, LineFault> {
        self.buffer.copy_within(self.rest.clone(), 0);
        self.rest = 0..self.rest.len();
        if self.buffer.len() - self.rest.end < READ_SIZE / 2 {
            self.buffer.resize(self.buffer.len() * 2, 0);
        }
        loop {
            match self.input.read(&mut self.buffer[self.rest.end..]) {
                Ok(count) => {
                    self.rest.end += count;
                    return Ok(count > 0);
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(LineFault::Unreadable(error)),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use fastrand::Rng;

    use std::path::Path;

    use super::{CsvReader, Row, State, TraceReader, header};
    use crate::Dimension;
    use crate::trace::Shape;

    #[test]
    fn the_largest_numbers_are_read_with_all_their_digits() {
        let shape = Shape { dimension: Dimension::Two, n_particles: 1 };
        let columns: Vec<String> = header(shape).collect();
        let numbers = [f64::MIN, f64::MAX, -1.5, f64::MIN_POSITIVE];
        let [x, y, vx, vy] = numbers.map(|number| format!("{number:.17}"));
        let text = format!("{}\n0,{:.17},{x},{y},{vx},{vy}\n", columns.join(","), 0.0);
        let mut reader = CsvReader::new(text.as_bytes(), Path::new("a.csv"), shape).unwrap();
        let mut state = State::zeros(shape);
        assert!(reader.read(&mut state).unwrap());
        assert_eq!([state.positions, state.velocities].concat(), [f64::MIN, f64::MAX, -1.5, 0.0]);
    }

    #[test]
    fn parsed_numbers_match_the_standard_library() {
        let mut random = Rng::with_seed(4);
        let mut texts: Vec<String> =
            ["1", "+1.5", ".5", "5.", "-0", "1e5", "1E-5", " 2 ", "inf", "-Infinity", "1e999"]
                .map(str::to_owned)
                .into();
        for _ in 0..20_000 {
            let value = f64::from_bits(random.u64(..));
            let digits = random.usize(0..20);
            texts.extend([
                format!("{value:?}"),
                format!("{value:e}"),
                format!("{value:.digits$e}"),
            ]);
        }
        let line = texts.join(",");
        let mut row = Row(Some(line.as_bytes()));
        for text in texts {
            let expected: f64 = text.trim().parse().unwrap();
            let number = row.number().unwrap();
            assert!(
                number.to_bits() == expected.to_bits() || number.is_nan() && expected.is_nan(),
                "{text}"
            );
        }
        assert!(row.number().is_none());
        for text in ["", "1e", "0x10", "1 2", "1_0", "--1", "1,", "é", "\u{3000}1"] {
            let last = text.rsplit(',').next().unwrap().as_bytes();
            assert_eq!(Row(Some(last)).number(), None, "{text}");
        }
        for text in ["nan(ind)", "-nan(snan)", "1.#QNAN", "-1.#IND", "NaN"] {
            assert!(Row(Some(text.as_bytes())).number().is_some_and(f64::is_nan), "{text}");
        }
    }
}
