//! Unpacks an archive in the sandbox, by this program itself.
//!
//! ```text
//! grade --unpack        in the sandbox: `archive` in the working directory is replaced by what it holds
//! ```
//!
//! The limits of the run bound what an archive may expand to, in bytes, files and time. An archive that is alone in an
//! archive is unpacked as well. Names must stay below the folder. Links and devices are left out. Names that are not UTF-8
//! are read as Windows-1252.

use std::fs::{self, OpenOptions};
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use flate2::read::{DeflateDecoder, GzDecoder};
use rawzip::{CompressionMethod, ZipArchive};
use sandbox::files::make_executable;
use sandbox::scratch::scratch_folder;
use sandbox::{End, Exceeded, Job, Keep, Limits, Sandbox, SandboxError};
use tar::EntryType;

use super::kind::{Archive, FileKind, HEAD, is_name_of_archive};
use super::{ReceiveError, is_junk};
use crate::boundary::door::{Door, windows_1252};
use crate::boundary::printed;
use crate::submission::hand_in::HandIn;
use crate::submission::program::failure_of_run;

/// First argument of a process that unpacks.
const UNPACKER: &str = "--unpack";

/// The archive in its working directory.
const ARCHIVE: &str = "archive";

/// Number of archives inside each other.
const MAX_NESTED: usize = 4;

/// Largest sum of the files of an archive, in bytes, and their largest number.
const MAX_BYTES: u64 = 512 << 20;
const MAX_FILES: u64 = 20_000;

/// Limits of the process. It ends by itself before it reaches those of bytes and files.
const LIMITS: Limits = Limits {
    cpu: 60.0,
    wall: 120.0,
    memory: 2 << 30,
    processes: 16,
    trace: MAX_BYTES + Door::Archive.facts().limit.bytes() + (16 << 20),
    stdout: 1 << 16,
    stderr: 1 << 16,
    files: 2 * MAX_FILES,
    budget: None,
};

/// Unpacks the archive at `path` into the new folder `to`.
///
/// # Errors
/// If it is no archive that is read, or exceeds a limit; or if it could not be run.
pub(super) fn unpack(path: &Path, to: &Path, sandbox: &Sandbox) -> Result<(), ReceiveError> {
    // A page of a browser is a sandbox, and starts no programs.
    if cfg!(target_family = "wasm") {
        fs::create_dir(to).map_err(SandboxError::no_scratch)?;
        HandIn::open(path)?.copy_to(&to.join(ARCHIVE))?;
        return unpack_in(to).map_err(|error| ReceiveError::NotUnpacked(error.to_string()));
    }
    let work = scratch_folder().map_err(SandboxError::no_scratch)?;
    let mut program = std::env::current_exe().map_err(SandboxError::no_scratch)?;
    // The sandbox's own user may lack permission to read the original.
    if sandbox.has_own_user() {
        let copy = work.path().join("program");
        let copied = HandIn::open(&program).and_then(|file| file.copy_to(&copy));
        copied.map_err(|error| SandboxError::no_scratch(io::Error::other(error)))?;
        program = copy;
    }
    let folder = work.path().join("folder");
    fs::create_dir(&folder).map_err(SandboxError::no_scratch)?;
    HandIn::open(path)?.copy_to(&folder.join(ARCHIVE))?;
    let job = Job {
        arguments: vec![UNPACKER.into()],
        folder,
        input: None,
        keep: Keep::Tree(to.to_path_buf()),
        readable: vec![program.clone()],
        limits: LIMITS,
        program,
    };
    let outcome = sandbox.run(&job)?;
    let refused = |detail: String| Err(ReceiveError::NotUnpacked(detail));
    match &outcome.end {
        End::Exited(0) => match &outcome.kept {
            Ok(()) => Ok(()),
            Err(reason) => refused(format!("the archive {reason}")),
        },
        // It says itself what is wrong.
        End::Exited(1) => refused(printed::tail(&outcome.stderr)),
        End::Exceeded(Exceeded::Trace | Exceeded::Files) => refused(too_large().to_string()),
        _ => refused(format!(
            "the archive cannot be unpacked: it {}",
            failure_of_run(&outcome, &job, sandbox)
        )),
    }
}

/// Unpacks an archive if this process was started to do so; otherwise returns `None`.
pub fn serve() -> Option<ExitCode> {
    let mut arguments = std::env::args_os().skip(1);
    if arguments.next()? != UNPACKER || arguments.next().is_some() {
        return None;
    }
    Some(match unpack_in(Path::new(".")) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let _ = writeln!(io::stderr(), "{error}");
            ExitCode::FAILURE
        }
    })
}

/// Replaces `archive` in a folder by what it holds, and an archive that is alone in it likewise.
fn unpack_in(folder: &Path) -> io::Result<()> {
    let mut next = Some(folder.join(ARCHIVE));
    for _ in 0..MAX_NESTED {
        let Some(path) = next else { return Ok(()) };
        let bytes = Door::Archive
            .bytes(&path)
            .map_err(|error| io::Error::other(format!("the archive {error}")))?;
        fs::remove_file(&path)?;
        let into = path.parent().unwrap_or(Path::new("")).to_path_buf();
        unpack_bytes(&bytes, &into)?;
        next = archive_alone(folder)?;
    }
    Err(io::Error::other(format!("more than {MAX_NESTED} archives inside each other")))
}

/// The file below `folder`, if it is the only one besides junk, and an archive.
fn archive_alone(folder: &Path) -> io::Result<Option<PathBuf>> {
    let mut found = None;
    let mut folders = vec![folder.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder)? {
            let entry = entry?;
            if is_junk(entry.file_name().as_encoded_bytes()) {
                continue;
            }
            if entry.file_type()?.is_dir() {
                folders.push(entry.path());
            } else if found.replace(entry.path()).is_some() {
                return Ok(None);
            }
        }
    }
    let Some(path) = found else { return Ok(None) };
    let head = Door::Archive.head(&path, HEAD).map_err(io::Error::other)?;
    match FileKind::of(&head) {
        FileKind::Archive(_) => Ok(Some(path)),
        _ if is_name_of_archive(&path) => Err(not_an_archive(&path)),
        _ => Ok(None),
    }
}

/// Writes what archives hold to a folder.
struct Unpacked<'a> {
    folder: &'a Path,
    bytes: u64,
    files: u64,
}

/// Unpacks the bytes of an archive into a folder.
///
/// # Errors
/// If they are no archive of a kind that is read, or hold a name that leads out of the folder or stands twice.
pub fn unpack_bytes(bytes: &[u8], folder: &Path) -> io::Result<()> {
    let mut into = Unpacked { folder, bytes: 0, files: 0 };
    match FileKind::of(&bytes[..bytes.len().min(HEAD as usize)]) {
        FileKind::Archive(Archive::Zip) => into.unzip(bytes),
        FileKind::Archive(Archive::Tar) => into.untar(bytes),
        FileKind::Archive(Archive::Gzip) => {
            let mut head = Vec::new();
            GzDecoder::new(bytes).take(HEAD).read_to_end(&mut head).map_err(damaged)?;
            match FileKind::of(&head) {
                FileKind::Archive(Archive::Tar) => into.untar(GzDecoder::new(bytes)),
                _ => Err(io::Error::other(
                    "a compressed file, without an archive in it\n  help: hand in a zip or a tar.gz",
                )),
            }
        }
        FileKind::Archive(other) => Err(io::Error::other(format!(
            "{}, which is not read\n  help: hand in a zip or a tar.gz",
            other.name()
        ))),
        _ => Err(io::Error::other("not an archive")),
    }
}

impl Unpacked<'_> {
    fn unzip(&mut self, bytes: &[u8]) -> io::Result<()> {
        let archive = ZipArchive::from_slice(bytes).map_err(damaged)?;
        let mut entries = archive.entries();
        while let Some(entry) = entries.next_entry().map_err(damaged)? {
            let Some(path) = path_of(entry.file_path().as_bytes())? else { continue };
            let mode = entry.mode();
            if mode.is_symlink() {
                continue;
            }
            if entry.is_dir() {
                self.make(&path)?;
                continue;
            }
            let shown = printed::path(path.as_os_str().as_encoded_bytes());
            let refused = |why: &str| Err(io::Error::other(format!("{shown} is {why}")));
            if entry.flags().is_encrypted() {
                return refused("encrypted\n  help: make the zip without a password");
            }
            let local = archive.get_entry(entry.wayfinder()).map_err(damaged)?;
            let content: Box<dyn Read> = match entry.compression_method() {
                CompressionMethod::STORE => Box::new(local.data()),
                CompressionMethod::DEFLATE => Box::new(DeflateDecoder::new(local.data())),
                _ => {
                    return refused(
                        "compressed by a method that is not read\n  help: make the zip with DEFLATE, the usual method",
                    );
                }
            };
            let is_executable = mode.permissions() & 0o111 != 0;
            self.write(&path, local.verifying_reader(content), is_executable)?;
        }
        Ok(())
    }

    fn untar(&mut self, archive: impl Read) -> io::Result<()> {
        let mut archive = tar::Archive::new(archive);
        for entry in archive.entries().map_err(damaged)? {
            let entry = entry.map_err(damaged)?;
            let Some(path) = path_of(&entry.path_bytes())? else { continue };
            let is_executable = entry.header().mode().unwrap_or(0) & 0o111 != 0;
            match entry.header().entry_type() {
                EntryType::Directory => self.make(&path)?,
                EntryType::Regular | EntryType::Continuous | EntryType::GNUSparse => {
                    self.write(&path, entry, is_executable)?;
                }
                _ => {}
            }
        }
        // The end of a compressed archive holds its checksum.
        io::copy(&mut archive.into_inner().take(MAX_BYTES), &mut io::sink()).map_err(damaged)?;
        Ok(())
    }

    fn make(&mut self, path: &Path) -> io::Result<()> {
        self.count(0)?;
        fs::create_dir_all(self.folder.join(path)).map_err(|error| not_written(path, &error))
    }

    /// Writes a new file. It can be executed if the archive says so; since Windows does not record that, also if it is a
    /// script or a program.
    fn write(
        &mut self,
        path: &Path,
        mut content: impl Read,
        is_executable: bool,
    ) -> io::Result<()> {
        self.count(0)?;
        let target = self.folder.join(path);
        let failed = |error: io::Error| not_written(path, &error);
        fs::create_dir_all(target.parent().unwrap_or(self.folder)).map_err(|error| {
            let is_file = error.kind() == io::ErrorKind::AlreadyExists;
            if is_file { about(path, "is below a file") } else { failed(error) }
        })?;
        let mut file =
            OpenOptions::new().write(true).create_new(true).open(&target).map_err(failed)?;
        let mut buffer = [0; 1 << 16];
        let mut is_run = is_executable;
        loop {
            let length = content.read(&mut buffer).map_err(damaged)?;
            if length == 0 {
                break;
            }
            self.count(length as u64)?;
            file.write_all(&buffer[..length]).map_err(failed)?;
            is_run |= FileKind::of(&buffer[..length]).is_run()
                && file.stream_position()? == length as u64;
        }
        if is_run {
            make_executable(&target).map_err(failed)?;
        }
        Ok(())
    }

    /// Counts an entry without content, or bytes of one.
    fn count(&mut self, bytes: u64) -> io::Result<()> {
        self.files += u64::from(bytes == 0);
        self.bytes += bytes;
        if self.files > MAX_FILES || self.bytes > MAX_BYTES { Err(too_large()) } else { Ok(()) }
    }
}

/// The path of an entry below the folder; `None` for junk, and for the folder itself.
fn path_of(name: &[u8]) -> io::Result<Option<PathBuf>> {
    let name = match std::str::from_utf8(name) {
        Ok(name) => name.to_owned(),
        Err(_) => {
            let text = name.iter().map(|byte| windows_1252(*byte).unwrap_or('_'));
            text.collect()
        }
    };
    let name = name.replace('\\', "/");
    let parts: Vec<&str> =
        name.split('/').filter(|part| !part.is_empty() && *part != ".").collect();
    let leads_out =
        name.starts_with('/') || name.as_bytes().get(1) == Some(&b':') || parts.contains(&"..");
    let wrong = match () {
        () if name.contains('\0') => Some("has a zero byte in its name"),
        () if leads_out => Some("leads out of the archive"),
        () => None,
    };
    if let Some(wrong) = wrong {
        return Err(about(Path::new(&name), wrong));
    }
    if parts.is_empty() || parts.iter().any(|part| is_junk(part.as_bytes())) {
        return Ok(None);
    }
    Ok(Some(parts.iter().collect()))
}

fn too_large() -> io::Error {
    io::Error::other(format!(
        "the archive holds more than {} MiB or {MAX_FILES} files\n  help: hand in sources, without the products of a build",
        MAX_BYTES >> 20
    ))
}

fn damaged(error: impl std::fmt::Display) -> io::Error {
    io::Error::other(format!(
        "the archive is damaged: {error}\n  help: make it again, and hand it in"
    ))
}

/// A file that is an archive by its name alone.
pub(super) fn not_an_archive(path: &Path) -> io::Error {
    let name = printed::path(path.file_name().unwrap_or_default().as_encoded_bytes());
    io::Error::other(format!(
        "{name} is named like an archive, but is not one\n  help: make it again, and hand it in"
    ))
}

/// Why an entry cannot be written.
fn not_written(path: &Path, error: &io::Error) -> io::Error {
    match error.kind() {
        io::ErrorKind::AlreadyExists => about(path, "stands in the archive twice"),
        io::ErrorKind::NotADirectory => about(path, "is below a file"),
        io::ErrorKind::InvalidFilename => about(path, "has a name that is too long"),
        _ => about(path, &format!("cannot be written: {error}")),
    }
}

/// An error that says which entry is wrong.
fn about(path: &Path, wrong: &str) -> io::Error {
    let path = printed::path(path.as_os_str().as_encoded_bytes());
    io::Error::other(format!(
        "{path} {wrong}\n  help: make the archive from the folder that is handed in"
    ))
}
