//! The open connections of the viewer: each request has one deadline, and strangers hold few connections.
//!
//! A connection is a stranger's until it has sent the token. If there are too many of those, the one that was opened first
//! is closed: whoever opens connections and sends nothing, or a byte now and then, does not keep the page out.

use std::io::{self, BufRead, BufReader, Read};
use std::net::{Shutdown, TcpStream};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Most connections of strangers at a time; a browser opens six before its first request.
const MAX_STRANGERS: usize = 12;

/// Most connections with the token at a time.
const MAX_KNOWN: usize = 24;

/// Time for a request, from its first byte to its last; of a stranger, from the start of the connection.
const REQUEST: Duration = Duration::from_secs(10);

/// Time between two requests of a connection with the token.
const IDLE: Duration = Duration::from_secs(60);

/// The open connections, the oldest first.
#[derive(Default)]
pub(super) struct Connections(Mutex<State>);

#[derive(Default)]
struct State {
    open: Vec<Connection>,
    number: u64,
}

struct Connection {
    number: u64,
    is_known: bool,
    stream: TcpStream,
}

impl Connections {
    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Admits a stranger, and closes another one if there are too many. `None` if there are too many with the token.
    pub(super) fn admit(&self, stream: &TcpStream) -> Option<u64> {
        let mut state = self.state();
        let known = state.open.iter().filter(|connection| connection.is_known).count();
        if known >= MAX_KNOWN {
            return None;
        }
        if state.open.len() - known >= MAX_STRANGERS {
            let first = state.open.iter().position(|connection| !connection.is_known)?;
            // The thread that reads it comes to its end.
            let _ = state.open.remove(first).stream.shutdown(Shutdown::Both);
        }
        state.number += 1;
        let (number, stream) = (state.number, stream.try_clone().ok()?);
        state.open.push(Connection { number, is_known: false, stream });
        Some(number)
    }

    /// Notes that a connection has sent the token.
    pub(super) fn know(&self, number: u64) {
        let mut state = self.state();
        let found = state.open.iter_mut().find(|connection| connection.number == number);
        found.into_iter().for_each(|connection| connection.is_known = true);
    }

    /// Forgets a connection that has ended.
    pub(super) fn forget(&self, number: u64) {
        self.state().open.retain(|connection| connection.number != number);
    }
}

/// The requests of a connection, each read until its deadline.
pub(super) struct Requests(BufReader<Timed>);

impl Requests {
    /// Of a connection that begins now.
    pub(super) fn of(stream: TcpStream) -> Self {
        Self(BufReader::new(Timed { stream, deadline: Instant::now() + REQUEST }))
    }

    /// The reader of the next request. Waits for its first byte, if the connection is known.
    pub(super) fn next(&mut self, is_known: bool) -> io::Result<&mut impl BufRead> {
        if is_known {
            self.within(IDLE).0.fill_buf()?;
            self.within(REQUEST);
        }
        Ok(&mut self.0)
    }

    /// Reads and drops what comes, in this time and up to so many bytes.
    pub(super) fn drain(&mut self, time: Duration, bytes: u64) -> io::Result<u64> {
        io::copy(&mut self.within(time).0.by_ref().take(bytes), &mut io::sink())
    }

    fn within(&mut self, time: Duration) -> &mut Self {
        self.0.get_mut().deadline = Instant::now() + time;
        self
    }
}

/// A connection that is read until a deadline.
struct Timed {
    stream: TcpStream,
    deadline: Instant,
}

impl Read for Timed {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let left = self.deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(io::ErrorKind::TimedOut.into());
        }
        self.stream.set_read_timeout(Some(left))?;
        self.stream.read(bytes)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::net::{Ipv4Addr, TcpListener};

    use super::*;

    fn pair() -> (TcpStream, TcpStream) {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        let theirs = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        (listener.accept().unwrap().0, theirs)
    }

    #[test]
    fn arriving_bytes_do_not_extend_the_deadline() {
        let (ours, mut theirs) = pair();
        theirs.write_all(b"GET /").unwrap();
        let mut timed = Timed { stream: ours, deadline: Instant::now() + IDLE };
        let mut byte = [0];
        assert_eq!(timed.read(&mut byte).unwrap(), 1);
        timed.deadline = Instant::now();
        assert_eq!(timed.read(&mut byte).unwrap_err().kind(), io::ErrorKind::TimedOut);
    }

    #[test]
    fn oldest_unauthenticated_connection_is_dropped_first() {
        let connections = Connections::default();
        let pairs: Vec<_> = (0..MAX_STRANGERS + 3).map(|_| pair()).collect();
        let known = connections.admit(&pairs[0].0).unwrap();
        connections.know(known);
        for (ours, _) in &pairs[1..] {
            connections.admit(ours).unwrap();
        }
        let open: Vec<u64> = connections.state().open.iter().map(|each| each.number).collect();
        let expected: Vec<u64> = [1].into_iter().chain(4..=MAX_STRANGERS as u64 + 3).collect();
        assert_eq!(open, expected);
        // The closed one has come to its end.
        let mut closed = pairs[1].1.try_clone().unwrap();
        assert_eq!(closed.read(&mut [0]).unwrap(), 0);
    }
}
