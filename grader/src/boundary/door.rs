//! The doors: the places where bytes of students enter this process, which has the teacher's rights.
//!
//! A file of a student is opened here and nowhere else: regular files only, of limited size, and without following a link
//! that the student may have left there. Files of the teacher are read by [`own_file`](crate::boundary::own_file). A test looks for
//! other ways through the sources.

use std::fmt;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use sandbox::files::{self, Refused};

use crate::boundary::printed::Untrusted;

/// A place where bytes of students enter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Door {
    /// The files of a hand-in, for copying and hashing.
    HandIn,
    /// An archive that is handed in.
    Archive,
    /// `submission.toml`.
    Manifest,
    /// A trace.
    Trace,
    /// Values that functions of a hand-in return.
    Answers,
    /// Output of a program.
    Printed,
    /// A report in `grade verify-report`.
    Report,
    /// The record of a graded submission.
    Record,
    /// A roster, a sheet of marks or a key of a gallery.
    Sheet,
    /// Metadata of Gradescope.
    Metadata,
    /// Metadata of Gradescope's export of a class.
    Export,
    /// A source in `grade class similar`.
    Source,
    /// A creative scene, with its mesh.
    CreativeScene,
    /// The film of a creative scene.
    Film,
    /// The result of the check of a creative scene, which ran in the sandbox.
    Examined,
}

/// How much is read through a door.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limit {
    /// A file of at most so many MiB.
    Mebibytes(u64),
    /// So many bytes, whatever the file's size.
    Bytes(u64),
    /// A stream, whose reader bounds a line or a record.
    Stream,
}

/// The input of a door, and how it is read.
#[derive(Debug, Clone, Copy)]
pub struct DoorFacts {
    /// The input, and its author.
    pub what: &'static str,
    /// How much of it is read.
    pub limit: Limit,
    /// The file that parses it.
    pub parser: &'static str,
    /// Its fuzz targets.
    pub fuzz: &'static [&'static str],
}

/// Why a file does not come in.
#[derive(Debug, thiserror::Error)]
pub enum DoorError {
    /// The system refuses to read it.
    #[error("cannot be read: {0}")]
    Unreadable(io::Error),
    /// It is no regular file.
    #[error("is {0}, not a regular file\n  help: replace it by a file, or remove it")]
    Special(&'static str),
    /// It exceeds the limit.
    #[error("is larger than {0}\n  help: make it smaller")]
    TooLarge(Limit),
    /// It is not UTF-8; a sheet is not Windows-1252 either.
    #[error("is not text in UTF-8\n  help: save it as UTF-8")]
    NotText,
}

impl From<Refused> for DoorError {
    fn from(refused: Refused) -> Self {
        match refused {
            Refused::Unreadable(error) => Self::Unreadable(error),
            Refused::Special(kind) => Self::Special(kind.word()),
        }
    }
}

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Mebibytes(count) => write!(f, "{count} MiB"),
            Self::Bytes(count) => write!(f, "{count} bytes"),
            Self::Stream => write!(f, "a stream"),
        }
    }
}

impl Limit {
    /// The most bytes that are held at once.
    pub const fn bytes(self) -> u64 {
        match self {
            Self::Mebibytes(count) => count << 20,
            Self::Bytes(count) => count,
            Self::Stream => u64::MAX,
        }
    }
}

impl Door {
    /// All doors.
    pub const ALL: [Self; 15] = [
        Self::HandIn,
        Self::Archive,
        Self::Manifest,
        Self::Trace,
        Self::Answers,
        Self::Printed,
        Self::Report,
        Self::Record,
        Self::Sheet,
        Self::Metadata,
        Self::Export,
        Self::Source,
        Self::CreativeScene,
        Self::Film,
        Self::Examined,
    ];

    /// Its input, and how it is read.
    pub const fn facts(self) -> DoorFacts {
        let (what, limit, parser, fuzz): (_, _, _, &'static [&'static str]) = match self {
            Self::HandIn => (
                "every file of a hand-in, copied and hashed",
                Limit::Mebibytes(1 << 10),
                "grader/src/submission/hand_in.rs",
                &[],
            ),
            Self::Archive => (
                "an archive that is handed in; unpacked in the sandbox",
                Limit::Mebibytes(128),
                "grader/src/submission/received/unpack.rs",
                &["archive"],
            ),
            Self::Manifest => (
                "`submission.toml`",
                Limit::Mebibytes(1),
                "grader/src/submission/folder.rs",
                &["manifest"],
            ),
            Self::Trace => (
                "the trace of a program, or in a folder of traces",
                Limit::Stream,
                "simulator/scene/src/trace/mod.rs",
                &["trace-csv", "trace-fosssim"],
            ),
            Self::Answers => (
                "what functions of a hand-in give, numbers in lines",
                Limit::Mebibytes(16),
                "grader/src/functions/mod.rs",
                &[],
            ),
            Self::Printed => (
                "each end of what a program prints",
                Limit::Bytes(sandbox::KEPT as u64),
                "grader/src/boundary/printed.rs",
                &["printed"],
            ),
            Self::Report => (
                "the report that `grade verify-report` compares with",
                Limit::Mebibytes(16),
                "grader/report/src/provenance.rs",
                &["report"],
            ),
            Self::Record => (
                "the record of a graded submission, in the folder of results",
                Limit::Mebibytes(1),
                "grader/src/class/record.rs",
                &["record"],
            ),
            Self::Sheet => (
                "a roster, marks, or the key of a gallery; students choose names in it",
                Limit::Mebibytes(16),
                "grader/src/class/sheet.rs",
                &["sheet"],
            ),
            Self::Metadata => (
                "the metadata of a submission to Gradescope",
                Limit::Mebibytes(16),
                "grader/platforms/src/gradescope/metadata.rs",
                &["metadata"],
            ),
            Self::Export => (
                "the metadata of Gradescope's export of a class, with the results of each submission",
                Limit::Mebibytes(512),
                "grader/src/class/layout/gradescope.rs",
                &["export"],
            ),
            Self::Source => (
                "a source that `grade class similar` compares",
                Limit::Mebibytes(1),
                "grader/src/class/similar/tokens.rs",
                &["tokens"],
            ),
            Self::CreativeScene => (
                "a creative scene, and the mesh that it names; parsed in the sandbox",
                Limit::Mebibytes(16),
                "simulator/scene/src/lib.rs",
                &["scene-xml", "scene-json"],
            ),
            Self::Film => (
                "the start of the film of a creative scene",
                Limit::Bytes(16),
                "grader/src/creative/film.rs",
                &["film"],
            ),
            Self::Examined => (
                "what the check of a creative scene found and drew, in the sandbox",
                Limit::Mebibytes(96),
                "grader/src/creative/examiner.rs",
                &["examined"],
            ),
        };
        DoorFacts { what, limit, parser, fuzz }
    }

    /// Whether the teacher names the file, which may then be a link.
    fn follows_links(self) -> bool {
        matches!(self, Self::Sheet | Self::Metadata)
    }

    /// Opens a file. Yields its content, not more than the limit.
    ///
    /// # Errors
    /// If it cannot be opened, or is not a regular file.
    pub fn open(self, path: &Path) -> Result<io::Take<File>, DoorError> {
        let resolved;
        let path = if self.follows_links() {
            resolved = scene::input::real_path(path).map_err(DoorError::Unreadable)?;
            &resolved
        } else {
            path
        };
        Ok(open_regular(path)?.take(self.facts().limit.bytes()))
    }

    /// The whole text of a file.
    ///
    /// # Errors
    /// As [`bytes`](Self::bytes), or if it is not UTF-8.
    pub fn text(self, path: &Path) -> Result<Untrusted, DoorError> {
        let bytes = self.bytes(path)?;
        let text = match self {
            Self::Sheet => decoded(bytes),
            _ => String::from_utf8(bytes).ok(),
        };
        text.map(Untrusted::from).ok_or(DoorError::NotText)
    }

    /// The whole content of a file.
    ///
    /// # Errors
    /// If it cannot be read, is not a regular file, or exceeds the limit.
    pub fn bytes(self, path: &Path) -> Result<Vec<u8>, DoorError> {
        let limit = self.facts().limit;
        let mut file = self.open(path)?;
        let mut bytes = Vec::new();
        let size = file.get_ref().metadata().map_err(DoorError::Unreadable)?.len();
        if size <= limit.bytes() {
            file.read_to_end(&mut bytes).map_err(DoorError::Unreadable)?;
        }
        // It may have grown.
        let more = file.into_inner().read(&mut [0]).map_err(DoorError::Unreadable)?;
        if more > 0 { Err(DoorError::TooLarge(limit)) } else { Ok(bytes) }
    }

    /// The first bytes of a file, at most so many.
    ///
    /// # Errors
    /// If it cannot be read, or is not a regular file.
    pub fn head(self, path: &Path, most: u64) -> Result<Vec<u8>, DoorError> {
        let mut head = Vec::new();
        self.open(path)?.take(most).read_to_end(&mut head).map_err(DoorError::Unreadable)?;
        Ok(head)
    }
}

/// The text of a sheet as spreadsheets save it: UTF-16 with a byte order mark, UTF-8, else Windows-1252.
fn decoded(bytes: Vec<u8>) -> Option<String> {
    let units = |rest: &[u8], of: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = rest.chunks_exact(2).map(|pair| of([pair[0], pair[1]])).collect();
        rest.len().is_multiple_of(2).then(|| String::from_utf16(&units).ok())?
    };
    match bytes.as_slice() {
        [0xff, 0xfe, rest @ ..] => units(rest, u16::from_le_bytes),
        [0xfe, 0xff, rest @ ..] => units(rest, u16::from_be_bytes),
        _ => match String::from_utf8(bytes) {
            Ok(text) => Some(text),
            Err(error) => error.as_bytes().iter().map(|byte| windows_1252(*byte)).collect(),
        },
    }
}

/// A character of Windows-1252, which has five gaps.
pub(crate) fn windows_1252(byte: u8) -> Option<char> {
    const UPPER: &str = "€\0‚ƒ„…†‡ˆ‰Š‹Œ\0Ž\0\0‘’“”•–—˜™š›œ\0žŸ";
    match byte {
        0 => None,
        0x80..=0x9f => UPPER.chars().nth((byte - 0x80).into()).filter(|it| *it != '\0'),
        _ => Some(byte.into()),
    }
}

/// Opens a regular file only, and follows no link at the end of its path.
pub(crate) fn open_regular(path: &Path) -> Result<File, DoorError> {
    Ok(files::open_regular(path)?)
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::symlink;

    use rustix::fs::{CWD, Mode};

    use super::*;
    use crate::boundary::printed::RawUse;

    #[test]
    fn only_regular_files_within_the_size_limit_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        let read = |door: Door, name: &str| {
            let text = door.text(&path.join(name)).map_err(|error| error.to_string());
            text.map(|text| text.raw(RawUse::Comparison).to_owned())
        };
        fs::write(path.join("plain"), "text").unwrap();
        symlink("plain", path.join("link")).unwrap();
        rustix::fs::mkfifoat(CWD, path.join("pipe"), Mode::RWXU).unwrap();
        fs::write(path.join("bytes"), [0xff]).unwrap();
        let sized =
            |name: &str, size| File::create(path.join(name)).unwrap().set_len(size).unwrap();
        sized("most", 1 << 20);
        sized("more", (1 << 20) + 1);
        let door = Door::Manifest;
        assert_eq!(read(door, "plain").unwrap(), "text");
        assert_eq!(read(door, "most").unwrap().len(), 1 << 20);
        for (name, message) in [
            ("link", "is a link, not a regular file"),
            ("pipe", "is a pipe, not a regular file"),
            (".", "is a folder, not a regular file"),
            ("more", "is larger than 1 MiB"),
            ("bytes", "is not text in UTF-8"),
            ("nothing", "cannot be read: "),
        ] {
            assert!(read(door, name).unwrap_err().starts_with(message), "{name}");
        }
        // A link that the teacher names is the teacher's.
        assert_eq!(read(Door::Sheet, "link").unwrap(), "text");
        assert!(read(Door::Sheet, "pipe").unwrap_err().starts_with("is a pipe"));
    }

    #[test]
    fn sheets_are_read_in_the_encodings_of_spreadsheets() {
        let text = "name;id\r\nŽoë “Ñ” €;1\r\n";
        let little = text.encode_utf16().flat_map(u16::to_le_bytes);
        let big = text.encode_utf16().flat_map(u16::to_be_bytes);
        let western = b"name;id\r\n\x8eo\xeb \x93\xd1\x94 \x80;1\r\n".to_vec();
        for bytes in [
            text.as_bytes().to_vec(),
            [0xff, 0xfe].into_iter().chain(little).collect(),
            [0xfe, 0xff].into_iter().chain(big).collect(),
            western,
        ] {
            assert_eq!(decoded(bytes).as_deref(), Some(text));
        }
        // A gap, half a character, a lone surrogate, and binary data are no text.
        for bytes in [&b"a\x81"[..], &[0xff, 0xfe, 0x41], &[0xff, 0xfe, 0x00, 0xd8], &[0xff, 0x00]]
        {
            assert_eq!(decoded(bytes.to_vec()), None, "{bytes:?}");
        }
    }
}
