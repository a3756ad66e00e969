//! Pages of reports (`--html`): a folder, or one file if its name ends in `.html`.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use grader::boundary::own_file;
use report::html::{self, Sink};

use crate::output::{create_folder, write_bytes};
use crate::stop::{Stop, complain};

/// A folder for pages, or a file that holds all of them.
#[derive(Clone)]
pub(super) struct Pages {
    folder: PathBuf,
    /// The file; its folder is `folder`.
    file: Option<PathBuf>,
}

impl Pages {
    /// Opens the folder, and creates it if it is missing; or the file, if the name is that of one.
    ///
    /// # Errors
    /// If it holds anything but pages of an earlier run: a page must not replace a file of the user's.
    pub(super) fn open(path: &Path) -> Result<Self, Stop> {
        let is_page = path.extension().is_some_and(|extension| extension == "html");
        if is_page && !path.is_dir() { Self::open_file(path) } else { Self::open_folder(path) }
    }

    /// The same of a command whose pages need a folder.
    ///
    /// # Errors
    /// Also if the name is that of a file.
    pub(super) fn open_folder_alone(path: &Path) -> Result<Self, Stop> {
        let pages = Self::open(path)?;
        match &pages.file {
            None => Ok(pages),
            Some(_) => Err(Stop::about(path)(
                "the pages of many submissions need a folder\n  help: name one with --html DIR",
            )),
        }
    }

    fn open_file(file: &Path) -> Result<Self, Stop> {
        let folder = file.parent().unwrap_or(Path::new("")).to_path_buf();
        let pages = Self { folder, file: Some(file.to_path_buf()) };
        if !file.exists() || is_page(file) {
            return Ok(pages);
        }
        Err(Stop::about(file)(
            "is no page of grade, and is not replaced\n  help: name another file with --html",
        ))
    }

    fn open_folder(folder: &Path) -> Result<Self, Stop> {
        fs::create_dir_all(folder).map_err(Stop::about(folder))?;
        let is_empty = fs::read_dir(folder).map_err(Stop::about(folder))?.next().is_none();
        let pages = Self { folder: folder.to_path_buf(), file: None };
        if is_empty || pages.is_written("") {
            return Ok(pages);
        }
        Err(Stop::bad_input(format!(
            "{}: holds files other than pages of grade\n  help: name an empty folder, or one that does not exist, \
             with --html",
            folder.display()
        )))
    }

    /// The folder.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// The first page.
    pub(super) fn index(&self) -> PathBuf {
        self.file.clone().unwrap_or_else(|| self.folder.join("index.html"))
    }

    /// Whether the folder below it holds pages of this program.
    pub(super) fn is_written(&self, below: &str) -> bool {
        is_page(&self.folder.join(below).join("index.html"))
    }

    /// Writes pages to the folder below it.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub(super) fn write(
        &self,
        below: &str,
        write: impl FnOnce(Sink<'_>) -> io::Result<()>,
    ) -> Result<(), Stop> {
        let folder = self.folder.join(below);
        let scenes = folder.join("scenes");
        create_folder(&self.folder, below).map_err(Stop::about(&folder))?;
        // Scenes of an earlier run may not be in this one. They are removed last: another shard may write the same pages.
        let mut others = BTreeSet::new();
        if self.is_written(below) {
            others = files_below(&scenes).map_err(Stop::about(&scenes))?;
        }
        let mut last = folder.clone();
        let written = write(&mut |name, bytes| {
            last = folder.join(name);
            others.remove(&last);
            let path = Path::new(below).join(name);
            create_folder(&self.folder, path.parent().unwrap_or(Path::new("")))?;
            write_bytes(&last, bytes)
        });
        written.map_err(Stop::about(&last))?;
        for other in others {
            match fs::remove_file(&other) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => {
                    return Err(Stop::about(&other)(error));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Writes the pages of the folder itself, and says where they are.
    pub(super) fn publish(
        &self,
        write: impl FnOnce(Sink<'_>) -> io::Result<()>,
    ) -> Result<(), Stop> {
        match &self.file {
            None => self.write("", write)?,
            Some(file) => {
                let mut files = Vec::new();
                write(&mut |name, bytes| {
                    files.push((name.to_owned(), bytes.to_vec()));
                    Ok(())
                })
                .and_then(|()| write_bytes(file, &html::bundle(&files)))
                .map_err(Stop::about(file))?;
            }
        }
        complain("note", format!("open {} in a browser", self.index().display()));
        Ok(())
    }
}

/// Whether a file is a page of this program.
fn is_page(path: &Path) -> bool {
    let text = own_file::text(path);
    text.is_ok_and(|text| text.contains(&format!("content=\"{}\"", html::GENERATOR)))
}

/// Every file below a folder; none if it does not exist, or is a link. Links are not followed.
fn files_below(folder: &Path) -> io::Result<BTreeSet<PathBuf>> {
    if folder.is_symlink() {
        return Ok(BTreeSet::new());
    }
    let (mut found, mut pending) = (BTreeSet::new(), vec![folder.to_path_buf()]);
    while let Some(folder) = pending.pop() {
        let entries = match fs::read_dir(&folder) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
            entries => entries?,
        };
        for entry in entries {
            let entry = entry?;
            if entry.file_type()?.is_dir() {
                pending.push(entry.path());
            } else {
                found.insert(entry.path());
            }
        }
    }
    Ok(found)
}
