//! `grade class DIR --similar`: lists what the sources of hand-ins share. Runs nothing.

use std::fs;
use std::path::Path;
use std::sync::LazyLock;

use grader::class::entry::{self, ClassEntry};
use grader::class::similar::{self, Config, Sources};
use grader::submission::hand_in::HandInError;
use grader::submission::init::{Language, Skeleton};
use grader::submission::received::{Form, Received, only_archive};
use grader::suite::assignment::Assignment;
use rayon::prelude::*;
use sandbox::Sandbox;

use super::arrange::ClassFiles;
use super::setting::refuse_inside;
use super::{ClassPlace, real, save};
use crate::args::{RootArgs, SuiteArgs};
use crate::inputs::assignments_below;
use crate::output::print;
use crate::stop::{Exit, Stop};
use crate::submission::strongest;
use crate::terminal::width;

pub(super) fn list(args: &ClassPlace, suite: &SuiteArgs) -> Result<Exit, Stop> {
    if let Some(output) = &args.output {
        refuse_inside(output, &args.folder)?;
    }
    let scratch = tempfile::tempdir().map_err(Stop::fault)?;
    let own = scratch.path().join("hand-ins");
    let files = ClassFiles::open(&args.folder, false)?;
    let arranged = files.arrange(&args.folder, &own, args.layout, None)?;
    let folder = if arranged.is_some() { &own } else { &args.folder };
    let pack = suite.pack.pack.as_deref();
    let (entries, mut passed_over) =
        entry::list(folder, pack.is_some()).map_err(Stop::about(folder))?;
    passed_over.extend(arranged.into_iter().flat_map(|arranged| arranged.passed_over));
    let mut starter = skeletons(&suite.root);
    if let Some(named) = pack {
        let pack = suite.root.pack(named, suite.pack.starter()?)?;
        let start = scratch.path().join("start");
        pack.start(&start).map_err(Stop::fault)?;
        starter.push(Sources::read("starter code", &start).map_err(Stop::about(named))?);
    }
    for folder in suite.pack.starter.iter().filter(|_| pack.is_none()) {
        // Links are followed in what the caller names, and in nothing that is in it.
        let place = real(folder)?;
        let sources = Sources::read("starter code", &place).map_err(Stop::about(folder))?;
        if sources.is_empty() {
            let help = "it has no sources in a known language\n  help: name the folder of the starter code";
            return Err(Stop::about(folder)(help));
        }
        starter.push(sources);
    }
    let sandbox = LazyLock::new(strongest as fn() -> _);
    let read: Vec<_> = entries
        .par_iter()
        .map(|ClassEntry { name, path, .. }| {
            sources(name, path, &sandbox).map_err(|error| (name.clone(), error))
        })
        .collect();
    let (read, unreadable): (Vec<_>, Vec<_>) = read.into_iter().partition(Result::is_ok);
    let class = read.into_iter().filter_map(Result::ok).collect();
    let mut similarity = similar::compare(class, &starter, Config::default());
    similarity.not_compared.extend(unreadable.into_iter().filter_map(Result::err));
    let others = passed_over.into_iter().map(|other| (other.name, other.reason));
    similarity.not_compared.extend(others);
    similarity.not_compared.sort();
    let mut text = Vec::new();
    report::similar::write(&mut text, &similarity, width()).map_err(Stop::fault)?;
    if let Some(output) = &args.output {
        fs::create_dir_all(output).map_err(Stop::about(output))?;
        let csv = report::similar::csv(&similarity).map_err(Stop::fault)?;
        save(&output.join("similar.txt"), &text)?;
        save(&output.join("similar.csv"), &csv)?;
    }
    print(&text)?;
    Ok(Exit::Passed)
}

/// The sources of a hand-in: of an archive, or of the only archive of a folder without sources, those in it.
fn sources(
    name: &str,
    path: &Path,
    sandbox: &LazyLock<Result<Sandbox, String>>,
) -> Result<Sources, String> {
    let said = |error: HandInError| error.to_string();
    let outside = Sources::read(name, path).map_err(said)?;
    if !outside.is_empty() {
        return Ok(outside);
    }
    let archive = match Form::of(path).map_err(said)? {
        Form::Archive => Some(path.to_path_buf()),
        _ => only_archive(path).map_err(said)?,
    };
    let Some(archive) = archive else { return Ok(outside) };
    let sandbox = sandbox.as_ref().map_err(Clone::clone)?;
    let received = Received::open(&archive, sandbox).map_err(|error| error.to_string())?;
    Sources::read(name, received.folder()).map_err(said)
}

/// The files that `grade init` writes, in every language, for every known assignment.
fn skeletons(root: &RootArgs) -> Vec<Sources> {
    let folder = root.find().ok().map(|root| assignments_below(&root));
    // Hand-ins can be compared without a suite.
    let assignments = folder.and_then(|folder| Assignment::list(&folder).ok()).unwrap_or_default();
    let choices = std::iter::once(None).chain(assignments.iter().map(Some));
    let skeleton = |(language, assignment)| {
        let skeleton = Skeleton::new(language, assignment);
        let files = skeleton.sources.iter().map(|(path, text)| (path.as_str(), text.as_str()));
        Sources::of("skeleton", files)
    };
    let all = Language::ALL.into_iter();
    all.flat_map(|language| choices.clone().map(move |choice| (language, choice)))
        .map(skeleton)
        .collect()
}
