//! Pages to look at: one for a submission, one for each of its scenes, one for a class.
//!
//! ```text
//! DIR/index.html               verdict, findings, features, scenes            front.rs, findings.rs
//! DIR/jacobians.html           verdicts, blocks as heat maps                  jacobians.rs, chart.rs
//! DIR/scenes/GROUP/SCENE.html  motion, residuals, energies, numbers           scene.rs, data.rs
//! DIR/assets/                  scripts and styles, embedded in the program    assets/
//! FILE.html                    all of these in one file that can be sent      bundle.rs
//! ```
//!
//! Pages are plain files that work from the file system and from any web server, and request nothing but the assets
//! next to them. They therefore use neither modules nor `fetch`, which browsers refuse for files: scripts are loaded by
//! `<script src>`, and data are elements of the page. The scripts use no library: the pages need a canvas, a line chart
//! and a filter, a few hundred lines.
//!
//! [`page::Html`] escapes by construction. Reports contain nothing of hidden scenes but the counts in a `Grading`.

pub mod page;

pub mod chart;

pub mod gallery;

mod bundle;
mod class;
mod data;
mod findings;
mod front;
mod jacobians;
mod scene;

use std::io;

use grader::grading::{Grading, SceneResult};
use grader::suite::Suite;

pub use bundle::bundle;
pub use class::{ClassResult, SUBMISSIONS, class};
pub use jacobians::{jacobians, probing};
use page::address;
use picture::web;

/// Marks pages of this program.
pub const GENERATOR: &str = "Spring Oracle";

/// Scripts and styles: file name and content.
pub const ASSETS: [(&str, &str); 10] = [
    web::STYLE,
    web::BASE,
    web::CHART,
    web::GESTURES,
    web::STRAIN,
    ("view.js", include_str!("assets/view.js")),
    ("player.js", include_str!("assets/player.js")),
    web::STAGE,
    ("gallery.js", include_str!("assets/gallery.js")),
    ("table.js", include_str!("assets/table.js")),
];

/// Receives files: path below the folder of the pages, and content.
pub type Sink<'a> = &'a mut dyn FnMut(&str, &[u8]) -> io::Result<()>;

/// Writes the scripts and styles.
///
/// # Errors
/// If `sink` fails.
pub fn assets(sink: Sink<'_>) -> io::Result<()> {
    ASSETS.iter().try_for_each(|(name, text)| sink(&format!("assets/{name}"), text.as_bytes()))
}

/// Writes one page alone, with its scripts and styles.
///
/// # Errors
/// If `sink` fails.
pub fn single(page: &[u8], sink: Sink<'_>) -> io::Result<()> {
    assets(sink)?;
    sink("index.html", page)
}

/// Writes the pages of a submission; the scenes of `suite` are those that were graded. `above` are links to the pages
/// above: address and text.
///
/// # Errors
/// If `sink` fails.
pub fn submission(
    grading: &Grading,
    suite: &Suite,
    above: &[(String, String)],
    sink: Sink<'_>,
) -> io::Result<()> {
    assets(sink)?;
    sink("index.html", &front::render(grading, above)?)?;
    let name = grading.submission.line();
    let front = [("index.html".to_owned(), name.clone())];
    if !grading.jacobians.is_empty() {
        sink("jacobians.html", &jacobians(&grading.jacobians, &front)?)?;
    }
    if let Some(found) = &grading.probing {
        sink("jacobians.html", &probing(found, &name, &front))?;
    }
    let scenes: Vec<_> = grading.features.iter().flat_map(|feature| &feature.scenes).collect();
    for (number, scene) in scenes.iter().enumerate() {
        let Some(case) = suite.cases.iter().find(|case| case.id == scene.id) else { continue };
        let [before, after] = [number.checked_sub(1), Some(number + 1)]
            .map(|number| number.and_then(|number| scenes.get(number)).copied());
        let mut others = scenes[number + 1..].iter().chain(&scenes[..number]).copied();
        let wrong = others.find(|scene| is_wrong(scene));
        let is_after = |scene: &&SceneResult| after.is_some_and(|after| after.id == scene.id);
        let beside = [before, after, wrong.filter(|scene| !is_after(scene))];
        let page = scene::render(case, scene, beside, &name)?;
        sink(&scene_file(&scene.id), &page)?;
    }
    Ok(())
}

/// Whether a scene failed, other than by a feature that is not there.
fn is_wrong(scene: &SceneResult) -> bool {
    let verdict = &scene.comparison.verdict;
    !verdict.is_pass() && !verdict.is_lack()
}

/// The file of a scene's page.
fn scene_file(id: &str) -> String {
    format!("scenes/{id}.html")
}

/// The address of a scene's page from the front page.
fn scene_address(id: &str) -> String {
    address(&scene_file(id))
}
