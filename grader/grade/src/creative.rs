//! `grade creative` and `grade gallery`: creative scenes.

use std::path::Path;
use std::time::Duration;

use grader::creative::{self, Creative, Entry, Examiner, NotChecked, Rules, Wanted};
use grader::rubric::Rubric;
use grader::suite::assignment::{self, Assignment};
use rayon::prelude::*;
use report::html::gallery::{self, Gallery};

use crate::args::{CreativeArgs, CreativeRules, GalleryArgs};
use crate::inputs::find_root;
use crate::output::{print, write_bytes};
use crate::pages::Pages;
use crate::stop::{Exit, Stop};
use crate::submission::open_sandbox;

/// The assignments, and the one that was named.
struct Known {
    assignments: Vec<Assignment>,
    named: Option<Assignment>,
    examiner: Examiner,
}

impl Known {
    fn read(args: &CreativeRules) -> Result<Self, Stop> {
        let root = args.root.clone().map_or_else(find_root, Ok)?;
        let folder = root.join("assets").join(assignment::FOLDER);
        let assignments = Assignment::list(&folder).map_err(Stop::bad_input)?;
        let named = args.assignment.as_deref().map(|name| Assignment::load(&folder, name));
        let named = named.transpose().map_err(Stop::bad_input)?;
        let rubric = root.join("assets/rubric.toml");
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

/// Checks a scene.
pub(super) fn check(args: &CreativeArgs) -> Result<Exit, Stop> {
    let file = &args.file;
    let wanted = if args.sheet.is_some() { Wanted::Sheet } else { Wanted::Nothing };
    let of_file = |reason: &str| Stop::bad_input(format!("{}: {reason}", file.display()));
    let name = file.file_name().ok_or_else(|| of_file("is not a file"))?;
    let base = file.parent().unwrap_or(Path::new(""));
    let known = Known::read(&args.rules)?;
    let found = known.check(base, name.as_ref(), wanted);
    let found = found.map_err(|error| match error {
        NotChecked::Refused(error) => Stop::bad_input(error),
        NotChecked::NotRun(error) => Stop::fault(error),
    })?;
    let found = found.ok_or_else(|| of_file("is no scene: it has neither \"obj\" nor \"k\""))?;
    let mut text = Vec::new();
    report::creative::write(&mut text, &found).map_err(Stop::fault)?;
    print(&text)?;
    if let Some(path) = &args.sheet {
        let sheet = found.picture.as_ref().map(|picture| picture.read());
        let sheet = sheet.transpose().map_err(Stop::fault)?;
        let sheet = sheet.filter(|bytes| report::creative::is_contact_sheet(bytes));
        let sheet = sheet.ok_or_else(|| of_file("no contact sheet: the file is no scene"))?;
        write_bytes(path, &sheet).map_err(|error| unwritable(path, &error))?;
    }
    Ok(if found.is_pass() { Exit::Passed } else { Exit::Failed })
}

/// Checks the scenes of a folder and writes their page.
pub(super) fn gallery(args: &GalleryArgs) -> Result<Exit, Stop> {
    let known = Known::read(&args.rules)?;
    let pages = Pages::open(&args.output)?;
    let entries = creative::find(&args.folder).map_err(Stop::bad_input)?;
    let check = |Entry { below, refused }: &Entry| {
        let found = match refused {
            Some(reason) => Err(reason.clone()),
            None => {
                known.check(&args.folder, below, Wanted::Motion).map_err(|error| error.to_string())
            }
        };
        found.unwrap_or_else(|reason| Some(Creative::refused(args.folder.join(below), reason)))
    };
    let scenes: Vec<Creative> = entries.par_iter().filter_map(check).collect();
    if scenes.is_empty() {
        return Err(Stop::bad_input(format!(
            "{}: no scenes\n  help: name a folder with .xml files",
            args.folder.display()
        )));
    }
    let gallery = Gallery::new(scenes, &args.folder, args.hide_names.is_some());
    if let Some(path) = &args.hide_names {
        let key = gallery.key().map_err(Stop::fault)?;
        write_bytes(path, &key).map_err(|error| unwritable(path, &error))?;
    }
    pages.write("", |sink| gallery::write(&gallery, sink))?;
    pages.announce();
    Ok(Exit::Passed)
}

fn unwritable(path: &Path, error: &std::io::Error) -> Stop {
    Stop::bad_input(format!("{}: {error}", path.display()))
}
