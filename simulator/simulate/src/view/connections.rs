//! The open connections of the viewer: each request has one deadline, and there are few connections of each kind.
//!
//! A connection is a stranger's until it has sent the token. If there are too many of a kind, the one whose last request is
//! the oldest is closed. So idle or slow connections, with or without the token, cannot block the page.

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

/// The open connections, by their last request; the oldest first.
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

    /// Admits a stranger. `None` if the system has no more of what a connection takes.
    pub(super) fn admit(&self, stream: &TcpStream) -> Option<u64> {
        let mut state = self.state();
        state.number += 1;
        let (number, stream) = (state.number, stream.try_clone().ok()?);
        state.add(Connection { number, is_known: false, stream });
        Some(number)
    }

    /// Notes that a connection has sent a request with the token.
    pub(super) fn know(&self, number: u64) {
        let mut state = self.state();
        // Another one may have taken its place.
        let Some(place) = state.open.iter().position(|each| each.number == number) else { return };
        let connection = state.open.remove(place);
        state.add(Connection { is_known: true, ..connection });
    }

    /// Forgets a connection that has ended.
    pub(super) fn forget(&self, number: u64) {
        self.state().open.retain(|connection| connection.number != number);
    }
}

impl State {
    /// Adds a connection, and closes one of its kind if there are too many.
    fn add(&mut self, connection: Connection) {
        let is_known = connection.is_known;
        let most = if is_known { MAX_KNOWN } else { MAX_STRANGERS };
        let of_kind = |each: &Connection| each.is_known == is_known;
        if self.open.iter().filter(|each| of_kind(each)).count() >= most
            && let Some(first) = self.open.iter().position(of_kind)
        {
            // The thread that reads it comes to its end.
            let _ = self.open.remove(first).stream.shutdown(Shutdown::Both);
        }
        self.open.push(connection);
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
    fn connection_with_the_oldest_request_is_dropped_first() {
        let connections = Connections::default();
        let pairs: Vec<_> = (0..MAX_KNOWN + MAX_STRANGERS + 2).map(|_| pair()).collect();
        let open =
            || -> Vec<u64> { connections.state().open.iter().map(|each| each.number).collect() };
        let is_closed = |number: u64| {
            let stream = &pairs[number as usize - 1].1;
            stream.set_nonblocking(true).unwrap();
            matches!(stream.try_clone().unwrap().read(&mut [0]), Ok(0))
        };
        let mut admitted = pairs.iter().map(|(ours, _)| connections.admit(ours).unwrap());
        for number in admitted.by_ref().take(MAX_KNOWN) {
            connections.know(number);
        }
        let strangers: Vec<u64> = admitted.by_ref().take(MAX_STRANGERS + 1).collect();
        // One stranger had to go, and none with the token.
        let known: Vec<u64> = (1..=MAX_KNOWN as u64).collect();
        assert_eq!(open(), [&known[..], &strangers[1..]].concat());
        assert!(is_closed(strangers[0]) && !is_closed(1));
        // The first one has just made a request: the second one makes room.
        connections.know(1);
        connections.know(strangers[1]);
        assert!(is_closed(2) && !is_closed(1));
        assert_eq!(open().last(), Some(&strangers[1]));
        // One that was closed is not known again.
        let before = open();
        connections.know(2);
        assert_eq!(open(), before);
    }
}
