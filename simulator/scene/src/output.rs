//! Atomic output files: a file appears complete or not at all.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

/// A file being written under a temporary name. It gets its name when it is [sealed](Self::seal) and
/// published; until then nothing changes.
///
/// Pipes and devices are written directly: they have no earlier content to preserve.
pub struct OutputFile {
    destination: Destination,
}

enum Destination {
    Aside { file: BufWriter<NamedTempFile>, path: PathBuf },
    Direct(BufWriter<File>),
}

/// A file whose content is on disk, still under its temporary name.
#[must_use = "a sealed file has no name until it is published"]
pub struct SealedFile {
    aside: Option<(NamedTempFile, PathBuf)>,
}

/// The file that writing to `path` would replace: absolute, with links followed, also where they lead
/// to what is not there yet. `None` if it is no regular file, and nothing would be replaced.
///
/// # Errors
/// If its folder is not there, `path` is a folder, or `-`, which means standard output elsewhere.
pub fn target(path: &Path) -> io::Result<Option<PathBuf>> {
    if path.as_os_str() == "-" {
        let message = "standard output is /dev/stdout, and a file of this name ./-";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    }
    if let Ok(metadata) = fs::metadata(path) {
        return if metadata.is_dir() {
            Err(io::ErrorKind::IsADirectory.into())
        } else if metadata.is_file() {
            crate::input::real_path(path).map(Some)
        } else {
            Ok(None)
        };
    }
    let folder = folder_of(path);
    match fs::read_link(path) {
        Ok(link) => target(&folder.join(link)),
        Err(_) => match path.file_name() {
            Some(name) => Ok(Some(crate::input::real_path(folder)?.join(name))),
            None => Err(io::ErrorKind::InvalidInput.into()),
        },
    }
}

/// The folder that `path` is in.
fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

impl OutputFile {
    /// Starts a file that will be called `path`.
    ///
    /// # Errors
    /// If its folder does not exist or takes no file, or `path` is a folder or may not be written.
    pub fn create(path: &Path) -> io::Result<Self> {
        let Some(path) = target(path)? else {
            let file = OpenOptions::new().write(true).open(path)?;
            return Ok(Self { destination: Destination::Direct(BufWriter::new(file)) });
        };
        Self::aside(path)
    }

    /// Starts a file that takes the place of whatever is called `path`: a link is replaced, and not followed.
    ///
    /// # Errors
    /// As [`create`](Self::create).
    pub fn replace(path: &Path) -> io::Result<Self> {
        let Some(name) = path.file_name() else { return Err(io::ErrorKind::InvalidInput.into()) };
        if fs::symlink_metadata(path).is_ok_and(|metadata| metadata.is_dir()) {
            return Err(io::ErrorKind::IsADirectory.into());
        }
        Self::aside(crate::input::real_path(folder_of(path))?.join(name))
    }

    /// A file that replaces what is called `path`, in a folder without links.
    fn aside(path: PathBuf) -> io::Result<Self> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(".").suffix(".partial");
        let old = fs::symlink_metadata(&path).ok().filter(fs::Metadata::is_file);
        let old = old.map(|metadata| metadata.permissions());
        if old.as_ref().is_some_and(fs::Permissions::readonly) {
            return Err(io::ErrorKind::PermissionDenied.into());
        }
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // As any new file: what the umask leaves of it.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let folder = path.parent().unwrap_or(Path::new("/"));
        // The error names the temporary file, which means nothing to the user.
        let file = builder.tempfile_in(folder).map_err(|error| io::Error::from(error.kind()))?;
        if let Some(permissions) = old {
            file.as_file().set_permissions(permissions)?;
        }
        Ok(Self {
            destination: Destination::Aside { file: BufWriter::with_capacity(1 << 16, file), path },
        })
    }

    /// Writes the content to disk.
    ///
    /// # Errors
    /// If it cannot be written out; the old file, if any, is then still there.
    pub fn seal(self) -> io::Result<SealedFile> {
        let aside = match self.destination {
            Destination::Aside { file, path } => {
                let file = file.into_inner().map_err(io::IntoInnerError::into_error)?;
                file.as_file().sync_all()?;
                Some((file, path))
            }
            Destination::Direct(mut file) => {
                file.flush()?;
                None
            }
        };
        Ok(SealedFile { aside })
    }

    /// Writes the content to disk and gives the file its name.
    ///
    /// # Errors
    /// If that cannot be done; the old file, if any, is then still there.
    pub fn commit(self) -> io::Result<()> {
        self.seal()?.publish()
    }
}

impl SealedFile {
    /// Gives the file its name.
    ///
    /// # Errors
    /// If that cannot be done; the old file, if any, is then still there.
    pub fn publish(self) -> io::Result<()> {
        let Some((file, path)) = self.aside else { return Ok(()) };
        file.persist(&path).map_err(|error| error.error)?;
        #[cfg(unix)]
        if let Some(folder) = path.parent() {
            // The name itself is then on disk too; where folders cannot be synced, it soon will be.
            let _ = File::open(folder).and_then(|folder| folder.sync_all());
        }
        Ok(())
    }
}

impl Write for OutputFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.destination {
            Destination::Aside { file, .. } => file.write(bytes),
            Destination::Direct(file) => file.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.destination {
            Destination::Aside { file, .. } => file.flush(),
            Destination::Direct(file) => file.flush(),
        }
    }
}
