//! `grade class DIR --similar`: lists what the sources of hand-ins share. Runs nothing.

use std::fmt::Display;
use std::fs;

use grader::class::entry::{self, ClassEntry};
use grader::class::similar::{self, Config, Sources};
use grader::submission::init::{Language, Skeleton};
use grader::suite::assignment::{self, Assignment};
use rayon::prelude::*;

use super::setting::refuse_inside;
use super::{save, unwritable};
use crate::args::SimilarArgs;
use crate::inputs::find_root;
use crate::output::print;
use crate::stop::{Exit, Stop};

pub(super) fn list(args: &SimilarArgs) -> Result<Exit, Stop> {
    if let Some(output) = &args.output {
        refuse_inside(output, &args.folder)?;
    }
    let (entries, passed_over) =
        entry::list(&args.folder).map_err(|error| unwritable(&args.folder, &error))?;
    let mut starter = skeletons(args);
    for folder in &args.starter {
        let failed =
            |error: &dyn Display| Stop::bad_input(format!("{}: {error}", folder.display()));
        // Links are followed in what the caller names, and in nothing that is in it.
        let place = fs::canonicalize(folder).map_err(|error| failed(&error))?;
        let sources = Sources::read("starter code", &place).map_err(|error| failed(&error))?;
        if sources.is_empty() {
            let help = "it has no sources in a known language\n  help: name the folder of the starter code";
            return Err(failed(&help));
        }
        starter.push(sources);
    }
    let read: Vec<_> = entries
        .par_iter()
        .map(|ClassEntry { name, path, .. }| {
            Sources::read(name, path).map_err(|error| (name.clone(), error.to_string()))
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
    report::similar::write(&mut text, &similarity).map_err(Stop::fault)?;
    if let Some(output) = &args.output {
        fs::create_dir_all(output).map_err(|error| unwritable(output, &error))?;
        let csv = report::similar::csv(&similarity).map_err(Stop::fault)?;
        save(&output.join("similar.txt"), &text)?;
        save(&output.join("similar.csv"), &csv)?;
    }
    print(&text)?;
    Ok(Exit::Passed)
}

/// What `grade init` writes, in every language, for every assignment that is there.
fn skeletons(args: &SimilarArgs) -> Vec<Sources> {
    let root = args.root.clone().or_else(|| find_root().ok());
    let folder = root.map(|root| root.join("assets").join(assignment::FOLDER));
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
