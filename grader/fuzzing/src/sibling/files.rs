//! The files of a sibling: XML, or JSON with an OBJ file, as the original's.
//!
//! XML is written from the redrawn model; its elements stand in the original's order of kinds. JSON has no place for
//! directions and times: there, only stiffness, mass and vertices are drawn anew. A sibling opens with what it holds, and
//! with what its original says to catch. It names neither its original nor its seed: submissions read it.

use std::path::{Path, PathBuf};

use grader::boundary::own_file::read_text;
use grader::oracle::folder::Files;
use grader::suite::Case;
use scene::xml::edit::{self, AttributeValue};
use scene::{ParseOptions, Scene, load, write};
use serde_json::Value;
use simulator::vocabulary;

use super::Fault;
use super::draw::{Factors, Placement, distances, redraw};
use crate::choices::Choices;

/// Maximum size of a file of the original, in MiB.
const MAX_MEBIBYTES: u64 = 16;

/// The word that starts the sentence on mistakes in a scene's opening comment.
const CATCHES: &str = "Catches";

/// Maximum length of a line of a comment.
const WIDTH: usize = 110;

/// Draws the files of a sibling.
pub(super) fn draw(case: &Case, spread: f64, choices: &mut Choices) -> Result<Files, Fault> {
    let texts: Result<Vec<String>, _> =
        case.files.iter().map(|file| read_text(&file.path, MAX_MEBIBYTES)).collect();
    let path = |extension: &str| PathBuf::from(format!("{}.{extension}", case.id));
    match texts?.as_slice() {
        [document, mesh] => {
            let mut factors = Factors::new(spread, choices);
            // Two scenes may share a mesh; their siblings do not.
            let mesh_path = path("obj");
            let document = draw_document(document, &mesh_path, &mut factors)?;
            let mesh = draw_mesh(mesh, &case.scene, &mut factors)?;
            Ok(Files(vec![(path("json"), document), (mesh_path, mesh)]))
        }
        [text] => {
            let mut scene = redraw(&case.scene, spread, choices);
            let contents = contents(&scene);
            scene.description = scene.description.map(|_| contents.clone());
            let comment = wrapped(&purpose(&contents, &xml_comment(text)), "     ");
            let text = in_order_of(text, &xml(&scene)?, &case.integrator_spelling);
            Ok(Files(vec![(path("xml"), format!("<!-- {} -->\n{text}", comment.trim_start()))]))
        }
        _ => Err(Fault::Files("a scene has one file or two".to_owned())),
    }
}

/// The scene in files.
pub(super) fn read(files: &Files) -> Result<Scene, Fault> {
    let folder = tempfile::tempdir()?;
    files.write(folder.path())?;
    let path =
        files.0.first().map_or(folder.path().to_path_buf(), |(path, _)| folder.path().join(path));
    let options = ParseOptions { strict: true, ..ParseOptions::default() };
    let parsed = load(&path, &vocabulary(), &options);
    parsed.map(|parsed| parsed.scene).map_err(|error| Fault::Files(error.to_string()))
}

/// The elements of a scene, as a sentence.
fn contents(scene: &Scene) -> String {
    let count = scene.particles.len();
    let fixed = scene.particles.iter().filter(|particle| particle.fixed).count();
    let mut titles: Vec<&str> = Vec::new();
    for force in &scene.forces {
        if !titles.contains(&force.schema.title) {
            titles.push(force.schema.title);
        }
    }
    let particles = if count == 1 { "particle" } else { "particles" };
    let fixed = if fixed == 0 { String::new() } else { format!(", {fixed} of them fixed") };
    let forces = if titles.is_empty() { "no force".to_owned() } else { titles.join(", ") };
    format!("{count} {particles}{fixed}; {forces}; {}.", scene.integrator.name)
}

/// The opening comment: what the scene holds, then what the original's comment says to catch.
fn purpose(contents: &str, original: &str) -> String {
    let catches =
        original.find(CATCHES).and_then(|start| original.get(start..)).unwrap_or_default();
    format!("{contents} {catches}")
}

/// The first comment of an XML file, if it stands before the scene.
fn xml_comment(text: &str) -> String {
    let head = text.split("<scene").next().unwrap_or_default();
    let comment = head.split_once("<!--").and_then(|(_, rest)| rest.split_once("-->"));
    comment.map_or_else(String::new, |(comment, _)| comment.to_owned())
}

/// The words of a text in lines of limited length that start with `indent`, joined by line breaks.
fn wrapped(text: &str, indent: &str) -> String {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.len() + word.len() < WIDTH => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(format!("{indent}{word}")),
        }
    }
    lines.join("\n")
}

fn xml(scene: &Scene) -> Result<String, Fault> {
    let mut bytes = Vec::new();
    write::write(scene, &mut bytes).map_err(|error| Fault::Files(error.to_string()))?;
    String::from_utf8(bytes).map_err(|error| Fault::Files(error.to_string()))
}

/// The lines of a written scene, one for each element, in the order in which `original` has their kinds, with this
/// spelling of the integrator.
fn in_order_of(original: &str, written: &str, spelling: &str) -> String {
    let mut tags: Vec<String> = Vec::new();
    let seen = edit::edit(original, |AttributeValue { tag, .. }| {
        if tags.iter().all(|known| known != tag) {
            tags.push(tag.to_owned());
        }
        None
    });
    debug_assert!(seen.is_some(), "the original was parsed");
    let rank = |line: &str| {
        let tag = line.trim_start().trim_start_matches('<').split([' ', '/', '>']).next();
        tags.iter().position(|known| Some(known.as_str()) == tag)
    };
    let mut elements: Vec<&str> = written.lines().filter(|line| line.starts_with("  <")).collect();
    elements.sort_by_key(|line| rank(line));
    let text = format!("<scene>\n{}\n</scene>\n", elements.join("\n"));
    let respelt = edit::edit(&text, |AttributeValue { tag, name, .. }| {
        (tag == "integrator" && name == "type").then(|| spelling.to_owned())
    });
    respelt.unwrap_or(text)
}

/// The JSON file, with another stiffness and mass, which names this mesh.
fn draw_document(text: &str, mesh: &Path, factors: &mut Factors<'_>) -> Result<String, Fault> {
    let unusable = |error: serde_json::Error| Fault::Files(error.to_string());
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut entries: serde_json::Map<String, Value> =
        serde_json::from_str(text).map_err(unusable)?;
    for name in ["k", "m"] {
        if let Some(value) = entries.get_mut(name) {
            let number = value.as_f64().unwrap_or_default();
            *value = Value::from(factors.value(("scene", name), number));
        }
    }
    let name = mesh.file_name().unwrap_or_default().to_string_lossy();
    entries.insert("obj".to_owned(), Value::from(name));
    Ok(serde_json::to_string_pretty(&entries).map_err(unusable)? + "\n")
}

/// The OBJ file, with other vertices.
fn draw_mesh(text: &str, scene: &Scene, factors: &mut Factors<'_>) -> Result<String, Fault> {
    let placement = Placement::draw(scene, false, factors);
    let mut places = scene
        .particles
        .iter()
        .zip(distances(scene))
        .map(|(particle, nearest)| placement.position(particle.position, nearest, factors))
        .collect::<Vec<_>>()
        .into_iter();
    let is_comment = |line: &&str| line.starts_with('#');
    let comment: Vec<&str> =
        text.lines().take_while(is_comment).map(|line| line.trim_start_matches('#')).collect();
    let opening = wrapped(&purpose(&contents(scene), &comment.join(" ")), "# ");
    let mut mesh = opening + "\n";
    for line in text.lines().skip_while(is_comment) {
        let words: Vec<&str> = line.split_whitespace().collect();
        if let ["v", _, _, _, rest @ ..] = words.as_slice() {
            let missing = || Fault::Files("its mesh has more vertices than particles".to_owned());
            let [x, y, z] = places.next().ok_or_else(missing)?;
            let numbers = [x, y, z].map(|number| number.to_string());
            let words: Vec<&str> =
                numbers.iter().map(String::as_str).chain(rest.iter().copied()).collect();
            mesh += &format!("v {}\n", words.join(" "));
        } else {
            mesh += &format!("{line}\n");
        }
    }
    Ok(mesh)
}
