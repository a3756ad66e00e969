//! Kind of a file, by its first bytes.

use std::path::Path;

/// Number of bytes that tell.
pub(crate) const HEAD: u64 = 512;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FileKind {
    /// An archive or a compressed file.
    Archive(Archive),
    /// A program for this system.
    Program,
    /// A program that this system does not run.
    Foreign(&'static str),
    /// A script with a first line that names its interpreter.
    Script,
    /// Anything else.
    Other,
}

/// A kind of archive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Archive {
    Zip,
    Tar,
    Gzip,
    SevenZip,
    Rar,
    Xz,
    Bzip2,
    Zstandard,
}

impl Archive {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Zip => "a zip archive",
            Self::Tar => "a tar archive",
            Self::Gzip => "a gzip file",
            Self::SevenZip => "a 7z archive",
            Self::Rar => "a rar archive",
            Self::Xz => "an xz file",
            Self::Bzip2 => "a bzip2 file",
            Self::Zstandard => "a Zstandard file",
        }
    }
}

/// Whether the name is that of an archive or a compressed file.
pub(crate) fn is_name_of_archive(path: &Path) -> bool {
    const EXTENSIONS: [&str; 9] = ["zip", "tar", "gz", "tgz", "7z", "rar", "xz", "bz2", "zst"];
    let extension = path.extension().unwrap_or_default();
    EXTENSIONS.iter().any(|known| extension.eq_ignore_ascii_case(known))
}

impl FileKind {
    /// The kind of a file with these first bytes.
    pub(crate) fn of(head: &[u8]) -> Self {
        const STARTS: [(&[u8], FileKind); 15] = [
            (b"PK\x03\x04", FileKind::Archive(Archive::Zip)),
            (b"PK\x05\x06", FileKind::Archive(Archive::Zip)),
            (b"\x1f\x8b", FileKind::Archive(Archive::Gzip)),
            (b"7z\xbc\xaf\x27\x1c", FileKind::Archive(Archive::SevenZip)),
            (b"Rar!\x1a\x07", FileKind::Archive(Archive::Rar)),
            (b"\xfd7zXZ\0", FileKind::Archive(Archive::Xz)),
            (b"BZh", FileKind::Archive(Archive::Bzip2)),
            (b"\x28\xb5\x2f\xfd", FileKind::Archive(Archive::Zstandard)),
            (b"#!", FileKind::Script),
            (b"MZ", FileKind::own(cfg!(windows), "Windows")),
            (b"\xcf\xfa\xed\xfe", FileKind::own(cfg!(target_os = "macos"), "macOS")),
            (b"\xce\xfa\xed\xfe", FileKind::own(cfg!(target_os = "macos"), "macOS")),
            (b"\xfe\xed\xfa\xcf", FileKind::own(cfg!(target_os = "macos"), "macOS")),
            (b"\xca\xfe\xba\xbe\0\0\0\x01", FileKind::own(cfg!(target_os = "macos"), "macOS")),
            (b"\xca\xfe\xba\xbe\0\0\0\x02", FileKind::own(cfg!(target_os = "macos"), "macOS")),
        ];
        if let Some((_, kind)) = STARTS.iter().find(|(start, _)| head.starts_with(start)) {
            return *kind;
        }
        if head.starts_with(b"\x7fELF") {
            // Of 64-bit little-endian files: the kind of processor, by the numbers of the ELF specification.
            let machine = head.get(18..20).map(|bytes| u16::from_le_bytes([bytes[0], bytes[1]]));
            return match machine {
                _ if cfg!(any(windows, target_os = "macos")) => Self::Foreign("Linux"),
                Some(62) => Self::own(cfg!(target_arch = "x86_64"), "Linux on x86-64"),
                Some(183) => Self::own(cfg!(target_arch = "aarch64"), "Linux on Arm"),
                // A 32-bit program may run here, and the system says so if it does not.
                _ => Self::Program,
            };
        }
        if head.get(257..262) == Some(b"ustar") {
            return Self::Archive(Archive::Tar);
        }
        Self::Other
    }

    /// A program of a system, which may be this one.
    const fn own(is_this: bool, system: &'static str) -> Self {
        if is_this { Self::Program } else { Self::Foreign(system) }
    }

    /// Whether it is made to be run.
    pub(crate) fn is_run(self) -> bool {
        matches!(self, Self::Program | Self::Script)
    }
}
