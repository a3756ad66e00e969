//! Files that appear whole or not at all.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

/// A file being written. It takes its name on [`commit`](Self::commit); without that, nothing changes.
///
/// What is no regular file (a pipe, a device) is written to directly: it has no earlier content to
/// keep.
pub struct OutputFile {
    kind: Kind,
}

enum Kind {
    Aside { file: BufWriter<NamedTempFile>, path: PathBuf },
    Direct(BufWriter<File>),
}

impl OutputFile {
    /// Starts a file that will be called `path`.
    ///
    /// # Errors
    /// Where its folder does not exist or takes no file, or `path` is a folder.
    pub fn create(path: &Path) -> io::Result<Self> {
        // A link is followed, so that the file it leads to is replaced, not the link.
        let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
        if let Ok(metadata) = fs::metadata(&path) {
            if metadata.is_dir() {
                return Err(io::ErrorKind::IsADirectory.into());
            }
            if !metadata.is_file() {
                let file = OpenOptions::new().write(true).open(&path)?;
                return Ok(Self { kind: Kind::Direct(BufWriter::new(file)) });
            }
        }
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let mut builder = tempfile::Builder::new();
        let prefix = format!(".{name}.");
        builder.prefix(&prefix).suffix(".partial");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // As any new file: what the umask leaves of it.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let file = BufWriter::with_capacity(1 << 16, builder.tempfile_in(folder)?);
        Ok(Self { kind: Kind::Aside { file, path } })
    }

    /// Gives the file its name, its content safe on disk.
    ///
    /// # Errors
    /// Where the content cannot be written out; the old file, if any, is then still there.
    pub fn commit(self) -> io::Result<()> {
        match self.kind {
            Kind::Aside { file, path } => {
                let file = file.into_inner().map_err(io::IntoInnerError::into_error)?;
                file.as_file().sync_all()?;
                file.persist(path)?;
                Ok(())
            }
            Kind::Direct(mut file) => file.flush(),
        }
    }
}

impl Write for OutputFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.kind {
            Kind::Aside { file, .. } => file.write(bytes),
            Kind::Direct(file) => file.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.kind {
            Kind::Aside { file, .. } => file.flush(),
            Kind::Direct(file) => file.flush(),
        }
    }
}
