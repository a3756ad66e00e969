//! Mistakes of a pack, found from its files and from its example programs.
//!
//! [`files`] looks at scenes, traces, points and the files that a hand-in is built with; [`example`] compares the verdicts of an
//! example with what the pack says of it.

use std::collections::BTreeSet;
use std::fmt;
use std::path::{Path, PathBuf};

use super::{Example, MANIFEST, Pack};
use crate::boundary::own_file;
use crate::functions::{Function, Functions, GROUP};
use crate::grading::hidden::HiddenSuite;
use crate::grading::{Grading, SceneResult};
use crate::oracle::Oracle;
use crate::rubric::Rubric;
use crate::submission::received::kind::FileKind;
use crate::suite::selection::{Candidate, choose};
use crate::suite::{Case, Section, Suite, hash_file};
use crate::verdict::Verdict;

/// Number of first bytes that tell a program: the name of its interpreter is among them.
const HEAD: u64 = 4096;

/// A fault of a pack, with its remedy; or a warning, which does not fail the check.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// Whether it is only a warning.
    pub is_warning: bool,
    /// The mistake and its place.
    pub message: String,
    /// The remedy.
    pub help: String,
}

impl Finding {
    fn fault(message: impl Into<String>, help: impl Into<String>) -> Self {
        Self { is_warning: false, message: message.into(), help: help.into() }
    }

    fn warning(message: impl Into<String>, help: impl Into<String>) -> Self {
        Self { is_warning: true, ..Self::fault(message, help) }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = if self.is_warning { "warning" } else { "fault" };
        write!(f, "{kind}: {}\n  help: {}", self.message, self.help)
    }
}

/// The scenes and traces that a pack grades by.
#[derive(Debug, Clone, Copy)]
pub struct Graded<'a> {
    /// The scenes.
    pub suite: &'a Suite,
    /// Their traces.
    pub oracle: &'a Oracle,
    /// The folder of the traces.
    pub expected: &'a Path,
    /// Tolerances and points.
    pub rubric: &'a Rubric,
    /// The hidden scenes, and their folder.
    pub hidden: Option<(&'a HiddenSuite, &'a Path)>,
}

/// The faults of its files.
pub fn files(pack: &Pack, graded: Graded<'_>) -> Vec<Finding> {
    let mut found = Vec::new();
    scenes(&graded.suite.cases, graded.oracle, &mut found);
    if let Some((hidden, _)) = graded.hidden {
        scenes(hidden.cases(), hidden.oracle(), &mut found);
    }
    if graded.rubric.hidden().is_some() && graded.hidden.is_none() {
        found.push(Finding::fault(
            "the rubric promises hidden scenes, and there are none",
            "put them into hidden/ in the pack, or name their folder with --hidden",
        ));
    }
    points(pack, graded, &mut found);
    leaks(pack, graded, &mut found);
    replaced(pack, &mut found);
    examples(pack, graded.suite, &mut found);
    found
}

/// Each scene has a trace that was made of it.
fn scenes(cases: &[Case], oracle: &Oracle, found: &mut Vec<Finding>) {
    for case in cases {
        if let Some(fault) = oracle.fault(case) {
            found.push(Finding::fault(
                format!("{}: {fault}", case.id),
                "write its trace with `grade oracle regenerate`, and look it over",
            ));
        }
    }
}

/// Each required feature has points, and their sum is the one that the pack states.
fn points(pack: &Pack, graded: Graded<'_>, found: &mut Vec<Finding>) {
    let required = graded.suite.cases.iter().map(|case| &case.feature);
    let required = required.filter(|feature| feature.section == Section::Required);
    let required: BTreeSet<_> = required.collect();
    for feature in &required {
        if graded.rubric.points(feature) == 0.0 {
            found.push(Finding::fault(
                format!("{feature} is required, and has no points"),
                "give it points in the rubric, or put its scenes into the section `unscored` of the assignment",
            ));
        }
    }
    let sum: f64 = required.iter().map(|feature| graded.rubric.points(feature)).sum();
    let sum = sum + pack.functions().map_or(0.0, Functions::points);
    if let Some(points) = pack.points
        && (points - sum).abs() > 1e-9
    {
        found.push(Finding::fault(
            format!("{MANIFEST} promises {points} required points, and the features have {sum}"),
            "correct `points`, or the points of the rubric or the assignment",
        ));
    }
}

/// Nothing that a hand-in is built with, or may read, tells the answers.
fn leaks(pack: &Pack, graded: Graded<'_>, found: &mut Vec<Finding>) {
    let mut secrets = vec![("the oracle", graded.expected.to_path_buf())];
    secrets.extend(graded.hidden.map(|(_, folder)| ("hidden scenes", folder.to_path_buf())));
    secrets.extend(pack.examples.iter().map(|example| ("an example", example.folder.clone())));
    let real = |path: &Path| scene::input::real_path(path).unwrap_or_else(|_| path.to_path_buf());
    for readable in &pack.readable {
        for (what, secret) in &secrets {
            let secret = real(secret);
            if secret.starts_with(readable) || readable.starts_with(&secret) {
                found.push(Finding::fault(
                    format!("programs may read {}, which has {what} in it", readable.display()),
                    "remove it from `readable`, or move it elsewhere",
                ));
            }
        }
    }
    let traces: BTreeSet<String> =
        graded.suite.cases.iter().filter_map(|case| graded.oracle.trace_hash(case)).collect();
    for layer in pack.layers() {
        for file in &layer.files {
            let path = layer.folder.join(file);
            let help = "leave it out by `files` of [starter], or remove it";
            let place = file.display();
            if let Some((what, _)) =
                secrets.iter().find(|(_, secret)| real(&path).starts_with(real(secret)))
            {
                let message = format!("hand-ins are built with {place}, which is {what}");
                found.push(Finding::fault(message, help));
            } else if hash_file(&path).is_ok_and(|hash| traces.contains(&hash)) {
                let message =
                    format!("hand-ins are built with {place}, which is a trace of the oracle");
                found.push(Finding::fault(message, help));
            } else if own_file::head(&path, HEAD).is_ok_and(|head| is_binary_program(&head)) {
                let message =
                    format!("hand-ins are built with {place}, a program that they could run");
                found.push(Finding::fault(message, help));
            }
        }
    }
}

/// Whether a file is a program, not an object or a library.
fn is_binary_program(head: &[u8]) -> bool {
    // The type of an ELF file: 2 is a program, 3 a shared library, or a program that names the one that starts it.
    let is_program = match head.get(16) {
        Some(2) => true,
        Some(3) => head.windows(8).any(|part| part == b"/lib64/l"),
        _ => false,
    };
    head.starts_with(b"\x7fELF") && is_program || FileKind::of(head) == FileKind::Foreign("Windows")
}

/// A file of the pack that a command names is not one that a hand-in replaces.
fn replaced(pack: &Pack, found: &mut Vec<Finding>) {
    let commands = pack.recipe.build.iter().chain([&pack.recipe.run]);
    let words: Vec<&str> = commands.flatten().flat_map(|word| word.split_whitespace()).collect();
    for file in pack.project.iter().flat_map(|layer| &layer.files) {
        let is_named = words.iter().any(|word| {
            let word = word.trim_start_matches("{folder}/").trim_start_matches("./");
            Path::new(word) == file
        });
        // Files that every hand-in has are the student's.
        let is_students = pack.needs.contains(file);
        if is_named && !is_students && pack.patterns.iter().any(|pattern| pattern.matches(file)) {
            found.push(Finding::fault(
                format!("a hand-in can replace {}, which the pack runs", file.display()),
                "name the files of hand-ins so that it is none of them, or put it into another folder",
            ));
        }
    }
}

/// There are right and wrong examples, and they are where the pack says.
fn examples(pack: &Pack, suite: &Suite, found: &mut Vec<Finding>) {
    for example in &pack.examples {
        let place = format!("{MANIFEST}:{}", example.line);
        if !example.folder.exists() {
            let message = format!("{place}: there is no example {}", example.folder.display());
            found.push(Finding::fault(message, "correct `folder`; it is seen from the pack"));
        }
        if let Err(error) = chosen(pack, suite, &example.fails) {
            let message = format!("{place}: {error}");
            found.push(Finding::fault(
                message,
                "correct `fails`: names, groups or patterns of scenes",
            ));
        }
    }
    if !pack.examples.iter().any(|example| example.fails.is_empty()) {
        found.push(Finding::warning(
            "no right program shows that the pack can be passed",
            "add [[example]] with the folder of a right hand-in",
        ));
    }
    if !pack.examples.iter().any(|example| !example.fails.is_empty()) {
        found.push(Finding::warning(
            "no wrong program shows that the pack finds mistakes",
            "add [[example]] with a wrong hand-in, and the scenes that it fails: fails = [\"Spring\"]",
        ));
    }
}

/// For each pattern, the names of the scenes and functions that it chooses.
fn chosen(
    pack: &Pack,
    suite: &Suite,
    patterns: &[String],
) -> Result<Vec<BTreeSet<String>>, String> {
    let functions = pack.functions().into_iter().flat_map(|functions| &functions.each);
    let functions: Vec<String> = functions.map(Function::id).collect();
    let of_functions =
        functions.iter().map(|id| Candidate { name: id, group: Some(GROUP), integrator: None });
    let candidates: Vec<Candidate<'_>> =
        suite.cases.iter().map(Candidate::from).chain(of_functions).collect();
    let of_pattern = |pattern: &String| {
        let chosen = choose(std::slice::from_ref(pattern), &candidates);
        let chosen = chosen.map_err(|error| error.to_string())?.into_iter();
        let names = candidates.iter().zip(chosen).filter(|(_, is_chosen)| *is_chosen);
        Ok(names.map(|(candidate, _)| candidate.name.to_owned()).collect())
    };
    patterns.iter().map(of_pattern).collect()
}

/// Where the verdicts of an example are not what the pack says: a scene of each pattern of `fails` fails, and all other
/// required scenes pass.
pub fn example(pack: &Pack, example: &Example, suite: &Suite, grading: &Grading) -> Vec<Finding> {
    let Ok(patterns) = chosen(pack, suite, &example.fails) else { return Vec::new() };
    let name = example.folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let scenes: Vec<(&SceneResult, Section)> = grading
        .features
        .iter()
        .flat_map(|result| result.scenes.iter().map(|scene| (scene, result.feature.section)))
        .collect();
    let mut found = Vec::new();
    for (pattern, names) in example.fails.iter().zip(&patterns) {
        let mut those = scenes.iter().filter(|(scene, _)| names.contains(&scene.id));
        if those.all(|(scene, _)| matches!(scene.comparison.verdict, Verdict::Pass)) {
            found.push(Finding::fault(
                format!("example {name} passes every scene of {pattern:?}, where it should fail"),
                "add a scene that shows its mistake, or correct `fails`",
            ));
        }
    }
    let is_expected = |scene: &SceneResult| patterns.iter().any(|names| names.contains(&scene.id));
    let wrong = scenes.iter().filter(|(scene, section)| {
        *section == Section::Required
            && !is_expected(scene)
            && !matches!(scene.comparison.verdict, Verdict::Pass)
    });
    let wrong: Vec<&SceneResult> = wrong.map(|(scene, _)| *scene).collect();
    if let Some(first) = wrong.first() {
        let verdict = &first.comparison.verdict;
        let help = match example.fails.is_empty() {
            true => "correct the program, the build, the driver, or the scene's trace",
            false => "correct the program, or name these scenes in `fails` too",
        };
        found.push(Finding::fault(
            format!(
                "example {name} does not pass {} required scenes; the first is {}: {verdict}",
                wrong.len(),
                first.id
            ),
            help,
        ));
    }
    found
}

/// The fault of a pack whose starter code passes as it is.
pub fn start(grading: &Grading) -> Option<Finding> {
    let scenes =
        grading.features.iter().filter(|result| result.feature.section == Section::Required);
    let mut scenes = scenes.flat_map(|result| &result.scenes);
    let all_pass = scenes.all(|scene| matches!(scene.comparison.verdict, Verdict::Pass));
    all_pass.then(|| {
        Finding::fault(
            "what students start from passes every required scene as it is",
            "remove the solution from the starter code or from project/",
        )
    })
}

/// The starter code as a hand-in: the files that the patterns take.
pub fn starting_files(pack: &Pack) -> Vec<(PathBuf, PathBuf)> {
    let layers = pack.layers();
    let files =
        layers.flat_map(|layer| layer.files.iter().map(|file| (layer.folder.join(file), file)));
    let taken = files.filter(|(_, file)| pack.patterns.iter().any(|pattern| pattern.matches(file)));
    taken.map(|(path, file)| (path, file.clone())).collect()
}
