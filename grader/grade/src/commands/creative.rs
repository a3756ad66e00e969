//! `grade creative` and `grade gallery`: creative scenes.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;
use grader::creative::{self, Creative, Entry, Examiner, NotChecked, Rules, Wanted};
use grader::rubric::{self, Rubric};
use grader::suite::assignment::Assignment;
use rayon::prelude::*;
use report::html::gallery::{self, Gallery};

use crate::args::{RootArgs, parse_limit};
use crate::inputs::assignments_below;
use crate::output::{print, write_bytes, written};
use crate::pages::Pages;
use crate::stop::{Exit, Stop};
use crate::submission::open_sandbox;

/// Check creative scenes: name, format, features, run, overlaps, film
#[derive(Args)]
#[command(after_help = "\
Examples:
  grade creative ada_t1m2.xml --sheet sheet.png")]
pub(crate) struct CreativeArgs {
    /// Scene file, called NAME_ASSIGNMENT.xml
    #[arg(value_name = "FILE")]
    file: PathBuf,

    /// Write a contact sheet to this file: twelve pictures of the motion (PNG)
    #[arg(long, value_name = "FILE")]
    sheet: Option<PathBuf>,

    #[command(flatten)]
    rules: CreativeRules,
}

/// Show all creative scenes of a folder as one page, with a sheet for marks
#[derive(Args)]
#[command(after_help = "\
Examples:
  grade gallery hand-ins -o gallery
  grade gallery hand-ins -o gallery --hide-names key.csv")]
pub(crate) struct GalleryArgs {
    /// Folder of scenes, searched with its subfolders; if some are in folders called Creative, only those are shown
    #[arg(value_name = "DIR")]
    folder: PathBuf,

    /// Folder for the page and for marks.csv, created if missing
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,

    /// Hide the names: scenes are numbered, and this file says which is whose (CSV)
    #[arg(long, value_name = "FILE")]
    hide_names: Option<PathBuf>,

    #[command(flatten)]
    rules: CreativeRules,
}

/// Rules of the check of creative scenes.
#[derive(Args)]
struct CreativeRules {
    /// The assignment of every scene [default: that of its name]
    #[arg(long, value_name = "NAME")]
    assignment: Option<String>,

    /// Time limit of a run of a scene; its check takes two runs, and 10 s more
    #[arg(long, value_name = "SECONDS", default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..))]
    seconds: u32,

    /// Check scenes without the sandbox, with all your rights
    #[arg(long)]
    unprotected: bool,

    /// Set a limit of the check of each scene, as in --limit memory=4G (repeatable); the limits are those of `grade`
    #[arg(long, value_name = "NAME=VALUE", value_parser = parse_limit)]
    limit: Vec<(String, f64)>,

    #[command(flatten)]
    root: RootArgs,
}

/// The assignments, and the one that was named.
struct Known {
    assignments: Vec<Assignment>,
    named: Option<Assignment>,
    examiner: Examiner,
}

impl Known {
    fn read(args: &CreativeRules) -> Result<Self, Stop> {
        let root = args.root.find()?;
        let folder = assignments_below(&root);
        let assignments = Assignment::list(&folder).map_err(Stop::bad_input)?;
        let named = args.assignment.as_deref().map(|name| Assignment::load(&folder, name));
        let named = named.transpose().map_err(Stop::bad_input)?;
        let rubric = root.join("assets").join(rubric::FILE);
        let rubric = rubric.is_file().then(|| Rubric::load(&rubric)).transpose();
        let rubric = rubric.map_err(Stop::bad_input)?.unwrap_or_default();
        let of_run = Duration::from_secs(args.seconds.into());
        let mut limits = creative::limits(of_run);
        for (name, value) in &args.limit {
            limits.set(name, *value).map_err(Stop::bad_input)?;
        }
        let sandbox = open_sandbox(args.unprotected, &rubric)?;
        let launcher = std::env::current_exe().map_err(Stop::fault)?;
        let examiner = Examiner::new(sandbox, &launcher, of_run, limits).map_err(Stop::fault)?;
        Ok(Self { assignments, named, examiner })
    }

    fn check(
        &self,
        base: &Path,
        below: &Path,
        wanted: Wanted,
    ) -> Result<Option<Creative>, NotChecked> {
        let Self { assignments, named, examiner } = self;
        let rules = Rules { assignments, assignment: named.as_ref() };
        creative::check((base, below), examiner, wanted, rules)
    }
}

impl CreativeArgs {
    /// Checks a scene.
    pub(crate) fn run(&self) -> Result<Exit, Stop> {
        let file = &self.file;
        let wanted = if self.sheet.is_some() { Wanted::Sheet } else { Wanted::Nothing };
        let of_file = |reason: &str| Stop::bad_input(format!("{}: {reason}", file.display()));
        let name = file.file_name().ok_or_else(|| of_file("is not a file"))?;
        let base = file.parent().unwrap_or(Path::new(""));
        let known = Known::read(&self.rules)?;
        let found = known.check(base, name.as_ref(), wanted);
        let found = found.map_err(|error| match error {
            NotChecked::Refused(error) => Stop::bad_input(error),
            NotChecked::NotRun(error) => Stop::fault(error),
        })?;
        let found =
            found.ok_or_else(|| of_file("is no scene: it has neither \"obj\" nor \"k\""))?;
        print(&written(|out| report::creative::write(out, &found))?)?;
        if let Some(path) = &self.sheet {
            let sheet = found.picture.as_ref().map(|picture| picture.read());
            let sheet = sheet.transpose().map_err(Stop::fault)?;
            let sheet = sheet.filter(|bytes| report::creative::is_contact_sheet(bytes));
            let sheet = sheet.ok_or_else(|| of_file("no contact sheet: the file is no scene"))?;
            write_bytes(path, &sheet).map_err(Stop::about(path))?;
        }
        Ok(Exit::of(found.is_pass()))
    }
}

impl GalleryArgs {
    /// Checks the scenes of a folder and writes their page.
    pub(crate) fn run(&self) -> Result<Exit, Stop> {
        let known = Known::read(&self.rules)?;
        let pages = Pages::open_folder_alone(&self.output)?;
        let entries = creative::find(&self.folder).map_err(Stop::bad_input)?;
        let check = |Entry { below, refused }: &Entry| {
            let found = match refused {
                Some(reason) => Err(reason.clone()),
                None => known
                    .check(&self.folder, below, Wanted::Motion)
                    .map_err(|error| error.to_string()),
            };
            found.unwrap_or_else(|reason| Some(Creative::refused((&self.folder, below), reason)))
        };
        let scenes: Vec<Creative> = entries.par_iter().filter_map(check).collect();
        if scenes.is_empty() {
            return Err(Stop::bad_input(format!(
                "{}: no scenes\n  help: name a folder with .xml files",
                self.folder.display()
            )));
        }
        let gallery = Gallery::new(scenes, self.hide_names.is_some());
        if let Some(path) = &self.hide_names {
            let key = gallery.key().map_err(Stop::fault)?;
            write_bytes(path, &key).map_err(Stop::about(path))?;
        }
        pages.publish(|sink| gallery::write(&gallery, sink))?;
        Ok(Exit::Passed)
    }
}
