//! The part of HTTP/1.1 that the viewer needs: requests with a body of known length, and whole responses.
//!
//! A request is read strictly: lines end with CRLF, a header that counts stands once, and everything has a limit. Any
//! other request is refused, and its connection closed. Source: RFC 9112.

use std::borrow::Cow;
use std::io::{self, BufRead, Read, Write};

/// Largest head of a request (its request line and headers), in bytes.
const MAX_HEAD: usize = 16 << 10;

/// Largest body of a request, in bytes.
const MAX_BODY: usize = 64 << 10;

/// A request.
#[derive(Debug, PartialEq)]
pub(super) struct Request {
    pub(super) method: String,
    /// Path with query, as it was sent.
    pub(super) target: String,
    pub(super) host: String,
    pub(super) origin: Option<String>,
    /// Whether the connection ends with this request.
    pub(super) closes: bool,
    pub(super) body: Vec<u8>,
}

impl Request {
    /// Reads the next request of a connection; `None` at its end, or if it breaks off.
    ///
    /// # Errors
    /// The response to a request that is malformed, too large or of another version. The connection ends with it.
    pub(super) fn read(stream: &mut impl BufRead) -> Result<Option<Self>, Response> {
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            let room = MAX_HEAD - head.len();
            if room == 0 {
                return Err(Response::refusal(Status::HeadTooLarge, "the headers are too large"));
            }
            match stream.by_ref().take(room as u64).read_until(b'\n', &mut head) {
                Ok(0) | Err(_) => return Ok(None),
                Ok(_) => {}
            }
        }
        let (mut request, length) = Self::parse(&head)?;
        if length > MAX_BODY {
            return Err(Response::refusal(Status::BodyTooLarge, "the body is too large"));
        }
        request.body.resize(length, 0);
        Ok(stream.read_exact(&mut request.body).is_ok().then_some(request))
    }

    /// The request of a head, with the length of its body.
    fn parse(head: &[u8]) -> Result<(Self, usize), Response> {
        let malformed = |what: &'static str| Response::refusal(Status::Malformed, what);
        let head = std::str::from_utf8(head).ok().and_then(|head| head.strip_suffix("\r\n\r\n"));
        let mut lines = head.ok_or_else(|| malformed("the headers are no text"))?.split("\r\n");
        let words: Vec<&str> = lines.next().unwrap_or_default().split(' ').collect();
        let &[method, target, version] = words.as_slice() else {
            return Err(malformed("the request line is malformed"));
        };
        let is_path = target.starts_with('/') && target.bytes().all(|byte| byte.is_ascii_graphic());
        let is_method = !method.is_empty() && method.bytes().all(|byte| byte.is_ascii_uppercase());
        if !is_path || !is_method {
            return Err(malformed("the request line is malformed"));
        }
        if version != "HTTP/1.1" {
            return Err(Response::refusal(Status::OtherVersion, "only HTTP/1.1 is supported"));
        }
        let [mut host, mut origin, mut length, mut connection] = [None; 4];
        for line in lines {
            let header = line.split_once(':').filter(|(name, value)| {
                let is_name =
                    |byte: u8| byte.is_ascii_alphanumeric() || b"!#$%&'*+-.^_`|~".contains(&byte);
                let is_value = |c: char| !c.is_control() || c == '\t';
                !name.is_empty() && name.bytes().all(is_name) && value.chars().all(is_value)
            });
            let (name, value) = header.ok_or_else(|| malformed("a header is malformed"))?;
            let slot = match name.to_ascii_lowercase().as_str() {
                "host" => &mut host,
                "origin" => &mut origin,
                "content-length" => &mut length,
                "connection" => &mut connection,
                "transfer-encoding" => {
                    let what = "a body must have a Content-Length";
                    return Err(Response::refusal(Status::NotImplemented, what));
                }
                _ => continue,
            };
            if slot.replace(value.trim_matches([' ', '\t'])).is_some() {
                return Err(malformed("a header stands twice"));
            }
        }
        let length = match length {
            None => 0,
            Some(digits) => {
                let is_number = digits.bytes().all(|byte| byte.is_ascii_digit());
                let number = digits.parse().ok().filter(|_| is_number);
                number.ok_or_else(|| malformed("the Content-Length is no number"))?
            }
        };
        let request = Self {
            method: method.to_owned(),
            target: target.to_owned(),
            host: host.ok_or_else(|| malformed("the Host header is missing"))?.to_owned(),
            origin: origin.map(str::to_owned),
            closes: connection.is_some_and(|value: &str| value.eq_ignore_ascii_case("close")),
            body: Vec::new(),
        };
        Ok((request, length))
    }
}

/// Outcomes of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Status {
    Done,
    Malformed,
    Forbidden,
    NotFound,
    OtherMethod,
    Conflict,
    BodyTooLarge,
    HeadTooLarge,
    Fault,
    NotImplemented,
    OtherVersion,
}

impl Status {
    /// Code and reason of the status line.
    fn line(self) -> &'static str {
        match self {
            Self::Done => "200 OK",
            Self::Malformed => "400 Bad Request",
            Self::Forbidden => "403 Forbidden",
            Self::NotFound => "404 Not Found",
            Self::OtherMethod => "405 Method Not Allowed",
            Self::Conflict => "409 Conflict",
            Self::BodyTooLarge => "413 Content Too Large",
            Self::HeadTooLarge => "431 Request Header Fields Too Large",
            Self::Fault => "500 Internal Server Error",
            Self::NotImplemented => "501 Not Implemented",
            Self::OtherVersion => "505 HTTP Version Not Supported",
        }
    }
}

/// A response.
#[derive(Debug, PartialEq)]
pub(super) struct Response {
    pub(super) status: Status,
    pub(super) content_type: &'static str,
    pub(super) body: Cow<'static, [u8]>,
}

impl Response {
    /// Headers of every response. Nothing is stored, embedded or sent elsewhere, and no text becomes a script.
    const HEADERS: &str = "Cache-Control: no-store\r\n\
        Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; \
        img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n\
        Cross-Origin-Opener-Policy: same-origin\r\n\
        Cross-Origin-Resource-Policy: same-origin\r\n\
        Referrer-Policy: no-referrer\r\n\
        X-Content-Type-Options: nosniff\r\n";

    /// A response with content.
    pub(super) fn of(content_type: &'static str, body: impl Into<Cow<'static, [u8]>>) -> Self {
        Self { status: Status::Done, content_type, body: body.into() }
    }

    /// A response that says why there is no other.
    pub(super) fn refusal(status: Status, why: impl Into<String>) -> Self {
        let body = Cow::Owned(format!("{}\n", why.into()).into_bytes());
        Self { status, content_type: "text/plain; charset=utf-8", body }
    }

    /// Writes the response, and whether the connection ends with it.
    pub(super) fn write(&self, out: &mut impl Write, closes: bool) -> io::Result<()> {
        let connection = if closes { "Connection: close\r\n" } else { "" };
        let head = format!(
            "HTTP/1.1 {}\r\nContent-Type: {}\r\nContent-Length: {}\r\n{}{connection}\r\n",
            self.status.line(),
            self.content_type,
            self.body.len(),
            Self::HEADERS,
        );
        out.write_all(head.as_bytes())?;
        out.write_all(&self.body)?;
        out.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Option<Request>, Status> {
        Request::read(&mut text.as_bytes()).map_err(|response| response.status)
    }

    #[test]
    fn requests_are_read_one_after_another() {
        let text = "POST /a/b?c HTTP/1.1\r\nhost:  h:1\t\r\nOrigin: o\r\nX: 1\r\nX: 2\r\nContent-Length: 3\r\n\r\nabc\
                    GET / HTTP/1.1\r\nHost: h\r\nConnection: Close\r\n\r\n";
        let mut stream = text.as_bytes();
        let first = Request::read(&mut stream).unwrap().unwrap();
        let expected = Request {
            method: "POST".to_owned(),
            target: "/a/b?c".to_owned(),
            host: "h:1".to_owned(),
            origin: Some("o".to_owned()),
            closes: false,
            body: b"abc".to_vec(),
        };
        assert_eq!(first, expected);
        let second = Request::read(&mut stream).unwrap().unwrap();
        assert_eq!((second.method.as_str(), second.closes, second.body.len()), ("GET", true, 0));
        assert_eq!(Request::read(&mut stream), Ok(None));
    }

    #[test]
    fn malformed_requests_are_refused() {
        let malformed = [
            "\r\n\r\n",
            "GET / HTTP/1.1\r\n\r\n",
            "GET /\r\nHost: h\r\n\r\n",
            "GET  / HTTP/1.1\r\nHost: h\r\n\r\n",
            "get / HTTP/1.1\r\nHost: h\r\n\r\n",
            "GET http://h/ HTTP/1.1\r\nHost: h\r\n\r\n",
            "GET /\u{e9} HTTP/1.1\r\nHost: h\r\n\r\n",
            "GET / HTTP/1.1\r\nHost: h\r\nHost: h\r\n\r\n",
            "GET / HTTP/1.1\r\nHost: h\r\nOrigin: a\r\norigin: a\r\n\r\n",
            "GET / HTTP/1.1\r\nHost : h\r\n\r\n",
            "GET / HTTP/1.1\r\nHost: h\r\n folded\r\n\r\n",
            "GET / HTTP/1.1\nHost: h\r\n\r\n",
            "GET / HTTP/1.1\r\nHost: h\nOrigin: x\r\n\r\n",
            "GET / HTTP/1.1\r\nHost: h\0\r\n\r\n",
            "POST / HTTP/1.1\r\nHost: h\r\nContent-Length: -1\r\n\r\n",
            "POST / HTTP/1.1\r\nHost: h\r\nContent-Length: +1\r\n\r\n1",
            "POST / HTTP/1.1\r\nHost: h\r\nContent-Length: 99999999999999999999999\r\n\r\n",
        ];
        for text in malformed {
            assert_eq!(read(text), Err(Status::Malformed), "{text:?}");
        }
        let large = format!("GET / HTTP/1.1\r\nHost: h\r\nX: {}\r\n\r\n", "x".repeat(MAX_HEAD));
        assert_eq!(read(&large), Err(Status::HeadTooLarge));
        let long =
            format!("POST / HTTP/1.1\r\nHost: h\r\nContent-Length: {}\r\n\r\n", MAX_BODY + 1);
        assert_eq!(read(&long), Err(Status::BodyTooLarge));
        assert_eq!(read("GET / HTTP/1.0\r\nHost: h\r\n\r\n"), Err(Status::OtherVersion));
        let chunked = "POST / HTTP/1.1\r\nHost: h\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n";
        assert_eq!(read(chunked), Err(Status::NotImplemented));
        // Connections that break off.
        for text in ["", "GET / HT", "POST / HTTP/1.1\r\nHost: h\r\nContent-Length: 2\r\n\r\n1"] {
            assert_eq!(read(text), Ok(None), "{text:?}");
        }
    }

    #[test]
    fn no_bytes_make_the_reader_panic() {
        let request = b"POST /a HTTP/1.1\r\nHost: h\r\nOrigin: o\r\nContent-Length: 2\r\n\r\n{}";
        let mut random = fastrand::Rng::with_seed(1);
        for _ in 0..20_000 {
            let mut bytes = request.to_vec();
            for _ in 0..random.usize(1..6) {
                let place = random.usize(0..bytes.len());
                match random.u8(0..3) {
                    0 => bytes[place] = random.u8(..),
                    1 => bytes.insert(place, *random.choice(b"\r\n :\0\xff").unwrap()),
                    _ => bytes.truncate(place.max(1)),
                }
            }
            let _ = Request::read(&mut bytes.as_slice());
        }
    }
}
