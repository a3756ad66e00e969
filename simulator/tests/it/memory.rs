//! Peak memory of readers on hostile traces and scenes: bounded by the scene's shape or by the file's size.

use std::io::{self, Read};
use std::path::Path;

use scene::trace::csv::{self, CsvReader};
use scene::trace::fosssim::FosssimReader;
use scene::trace::{Shape, State, TraceReader};
use scene::{Dimension, ParseOptions, parse_bytes};
use simulator::vocabulary;

/// How long the hostile traces are, in bytes: much more than a reader may hold.
const LENGTH: u64 = 20 << 20;

/// Bytes that readers may hold for any shape: buffers and messages.
const BUFFERS: usize = 256 << 10;

/// Bytes for each number of a state. A line has 64, which are 64 fields where all of them are commas; a field is
/// held by where it ends, in eight bytes. The first line is held three times (csv keeps it as headers, as bytes
/// and as text), and a list twice while it grows.
const PER_NUMBER: usize = 64 * (3 * (1 + 8) + 16);

/// Bytes for each byte of a scene's file. Elements become plain data of up to 200 bytes, and the shortest
/// that are taken have some 20; lists grow by doubling, and are held twice while they do.
const PER_BYTE: usize = 48;

/// Yields a pattern over and over.
struct Pattern(&'static [u8], usize);

impl Read for Pattern {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        for byte in &mut *buffer {
            *byte = self.0[self.1 % self.0.len()];
            self.1 += 1;
        }
        Ok(buffer.len())
    }
}

/// The most bytes that this thread holds at one time while `task` runs, beyond those held before.
fn peak(task: impl FnOnce()) -> usize {
    allocation_counter::measure(task).bytes_max as usize
}

/// Reads to the end, or to the first fault.
fn exhaust<E>(reader: Result<impl TraceReader, E>, shape: Shape) {
    let Ok(mut reader) = reader else { return };
    let mut state = State::zeros(shape);
    while let Ok(true) = reader.read(&mut state) {}
}

#[test]
fn reader_memory_is_bounded_on_hostile_input() {
    for shape in [
        Shape { dimension: Dimension::Two, n_particles: 1 },
        Shape { dimension: Dimension::Three, n_particles: 1000 },
    ] {
        let bound = BUFFERS + PER_NUMBER * 2 * shape.n_coordinates();
        let header: String = csv::header(shape).collect::<Vec<_>>().join(",") + "\n";
        let fields = ",".repeat(64 * (2 + 2 * shape.n_coordinates()) - 1) + "\n";
        let patterns: [&[u8]; 8] =
            [b",", b"\n", b"\r", b"1", b"\"", b"1,", b"\xff", b"0,0.0,1e-300000000000000000000\n"];
        for pattern in patterns {
            for begin in ["", &header, &fields, &(header.clone() + &fields)] {
                let input = begin.as_bytes().chain(Pattern(pattern, 0).take(LENGTH));
                let held =
                    peak(|| exhaust(CsvReader::new(input, Path::new("trace"), shape), shape));
                assert!(
                    held <= bound,
                    "{pattern:?} after {:.9}…: {held} bytes, not {bound}",
                    begin.trim_end()
                );
            }
        }
        let input = Pattern(b"\xff", 0).take(LENGTH);
        let reader = FosssimReader::new(input, Path::new("trace"), shape);
        let held = peak(|| exhaust::<()>(Ok(reader), shape));
        assert!(held <= bound, "{held} bytes, not {bound}");
    }

    let floods: [(&str, &str); 9] = [
        ("<scene>", "<particle/>"),
        ("<scene>", r#"<particle m="1" px="0" py="0" vx="0" vy="0" fixed="0"/>"#),
        ("<scene>", r#"<edge i="0" j="1"/>"#),
        ("<scene>", r#"<constantforce particle="0"/>"#),
        ("<scene>", "<a>"),
        ("<scene>", "<!--"),
        ("<scene>", "&#65;"),
        ("<scene ", r#"a="1" "#),
        ("", "<"),
    ];
    for (begin, flood) in floods {
        let text = begin.to_owned() + &flood.repeat((1 << 20) / flood.len());
        let bound = BUFFERS + PER_BYTE * text.len();
        let held = peak(|| {
            let options = ParseOptions::default();
            let parsed =
                parse_bytes(text.as_bytes(), Path::new("scene.xml"), &vocabulary(), &options);
            assert!(parsed.is_err(), "{flood}");
        });
        assert!(held <= bound, "{flood}: {held} bytes, not {bound}");
    }
}
