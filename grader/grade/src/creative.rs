//! `grade creative` and `grade gallery`: creative scenes.

use std::fs;
use std::path::Path;
use std::time::Duration;

use grader::assignment::{self, Assignment};
use grader::creative::{self, Creative, Rules};
use rayon::prelude::*;
use report::html::gallery::{self, Gallery};
use simulator::scene;

use crate::args::{CreativeArgs, CreativeRules, GalleryArgs};
use crate::inputs::find_root;
use crate::output::{print, write_bytes};
use crate::pages::Pages;
use crate::stop::{Exit, Stop};

/// The assignments, and the one that was named.
struct Known {
    assignments: Vec<Assignment>,
    named: Option<Assignment>,
    limit: Duration,
}

impl Known {
    fn read(args: &CreativeRules) -> Result<Self, Stop> {
        let root = args.root.clone().map_or_else(find_root, Ok)?;
        let folder = root.join("assets").join(assignment::FOLDER);
        let assignments = Assignment::list(&folder).map_err(Stop::bad_input)?;
        let named = args.assignment.as_deref().map(|name| Assignment::load(&folder, name));
        let named = named.transpose().map_err(Stop::bad_input)?;
        Ok(Self { assignments, named, limit: Duration::from_secs(args.seconds.into()) })
    }

    fn check(&self, path: &Path) -> Result<Creative, Stop> {
        let Self { assignments, named, limit } = self;
        let rules = Rules { assignments, assignment: named.as_ref(), limit: *limit };
        creative::check(path, rules).map_err(Stop::bad_input)
    }
}

/// Checks a scene.
pub(super) fn check(args: &CreativeArgs) -> Result<Exit, Stop> {
    let found = Known::read(&args.rules)?.check(&args.file)?;
    let mut text = Vec::new();
    report::creative::write(&mut text, &found).map_err(Stop::fault)?;
    print(&text)?;
    if let Some(path) = &args.sheet {
        let Some((scene, motion)) = &found.shown else {
            return Err(Stop::bad_input(format!(
                "{}: no contact sheet: the file is no scene",
                args.file.display()
            )));
        };
        let sheet = report::creative::contact_sheet(scene, motion).png();
        write_bytes(path, &sheet).map_err(|error| unwritable(path, &error))?;
    }
    Ok(if found.is_pass() { Exit::Passed } else { Exit::Failed })
}

/// Checks the scenes of a folder and writes their page.
pub(super) fn gallery(args: &GalleryArgs) -> Result<Exit, Stop> {
    let known = Known::read(&args.rules)?;
    let pages = Pages::open(&args.output)?;
    let mut files = scene::find_scene_files(&args.folder).map_err(Stop::bad_input)?;
    // A link may lead to a scene that nobody is to see.
    files.retain(|path| fs::symlink_metadata(path).is_ok_and(|found| found.is_file()));
    // Hand-ins hold other scenes too.
    if files.iter().any(|path| is_in_creative(path)) {
        files.retain(|path| is_in_creative(path));
    }
    if files.is_empty() {
        return Err(Stop::bad_input(format!(
            "{}: no scenes\n  help: name a folder with .xml files",
            args.folder.display()
        )));
    }
    let scenes: Result<Vec<Creative>, Stop> =
        files.par_iter().map(|path| known.check(path)).collect();
    let gallery = Gallery::new(scenes?, &args.folder, args.hide_names.is_some());
    if let Some(path) = &args.hide_names {
        let key = gallery.key().map_err(Stop::fault)?;
        write_bytes(path, &key).map_err(|error| unwritable(path, &error))?;
    }
    pages.write("", |sink| gallery::write(&gallery, sink))?;
    pages.announce();
    Ok(Exit::Passed)
}

/// Whether a file is below a folder called `Creative`, as the hand-outs ask.
fn is_in_creative(path: &Path) -> bool {
    let folders = path.parent().into_iter().flat_map(Path::components);
    folders.into_iter().any(|folder| folder.as_os_str().eq_ignore_ascii_case("creative"))
}

fn unwritable(path: &Path, error: &std::io::Error) -> Stop {
    Stop::bad_input(format!("{}: {error}", path.display()))
}
