//! Zip archives, compressed by DEFLATE. The same files give the same bytes.

use std::io::{self, Write};

use rawzip::time::UtcDateTime;
use rawzip::{CompressionMethod, DataDescriptorOutput, ZipArchiveWriter};

use crate::package::PackageFile;

/// Effort of the compressor, from 0 to 10: as zip's default.
const LEVEL: u8 = 6;

/// The time of every file, 1980-01-01 in seconds since 1970: the first that the format can hold.
const TIME: i64 = 315_532_800;

/// Writes an archive with these files at its root.
///
/// # Errors
/// If writing fails, or a path is too long.
pub fn write(out: impl Write, files: &[PackageFile]) -> io::Result<()> {
    let mut archive = ZipArchiveWriter::new(out);
    for PackageFile { path, bytes, is_program } in files {
        let builder = archive
            .new_file(path.as_str())
            .compression_method(CompressionMethod::DEFLATE)
            .last_modified(UtcDateTime::from_unix(TIME))
            .unix_permissions(if *is_program { 0o100_755 } else { 0o100_644 });
        let (mut entry, _) = builder.start().map_err(io::Error::other)?;
        entry.write_all(&miniz_oxide::deflate::compress_to_vec(bytes, LEVEL))?;
        let size = bytes.len().try_into().map_err(io::Error::other)?;
        let descriptor = DataDescriptorOutput::new(rawzip::crc32(bytes), size);
        entry.finish(descriptor).map_err(io::Error::other)?;
    }
    archive.finish().map_err(io::Error::other)?;
    Ok(())
}
