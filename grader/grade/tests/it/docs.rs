//! Checks of the documents: paths exist, and all registered forces and integrators are described.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use test_support::root;

#[cfg(target_os = "linux")]
use crate::agreement;
use crate::folder::{self, Folder};
use crate::student;
use needs::needs;

use grader::rubric::Rubric;
use grader::suite::assignment::{self, Assignment};
use grader::suite::{Feature, Section, Suite};
use scene::ParseOptions;
use scene::schema::{
    Derivatives, ForceSchema, IntegratorSchema, OptionKind, OptionSchema, OptionText,
};
use simulator::force::ForceKind;
use simulator::integrator::IntegratorKind;
use simulator::{force, integrator};

/// Held while a document is read or written: several tests write the same one.
static DOCUMENTS: Mutex<()> = Mutex::new(());

fn document(name: &str) -> String {
    let _held = DOCUMENTS.lock();
    fs::read_to_string(root().join(name)).unwrap()
}

/// Replaces text in a document.
fn rewrite(name: &str, old: &str, new: &str) {
    let _held = DOCUMENTS.lock();
    let path = root().join(name);
    let text = fs::read_to_string(&path).unwrap();
    fs::write(path, text.replace(old, new)).unwrap();
}

/// The text between backticks.
fn code_words(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

#[test]
fn every_path_in_the_architecture_exists() {
    for page in ["ARCHITECTURE.md", "docs/internals.md", "CONTRIBUTING.md"] {
        let text = document(page);
        let is_path =
            |word: &&str| word.contains('/') && !word.contains(['<', ' ', '·', '*', '…', '∂']);
        let paths: Vec<&str> = code_words(&text).filter(is_path).collect();
        assert!(!paths.is_empty(), "{page}");
        for path in paths {
            assert!(root().join(path).exists(), "{page} names {path}");
        }
    }
}

/// The crates of the workspace by name, with their folders.
pub(crate) fn crates() -> BTreeMap<String, PathBuf> {
    let manifest = document("Cargo.toml");
    let members = manifest.split_once("members = [").unwrap().1.split_once(']').unwrap().0;
    let folders = members.split('"').skip(1).step_by(2).map(|folder| root().join(folder));
    let named = folders.map(|folder| {
        let name = manifest_of(&folder)["package"]["name"].as_str().unwrap().to_owned();
        (name, folder)
    });
    named.collect()
}

fn manifest_of(folder: &Path) -> toml::Table {
    fs::read_to_string(folder.join("Cargo.toml")).unwrap().parse().unwrap()
}

#[test]
fn the_crates_depend_on_each_other_as_the_architecture_shows() {
    let text = document("ARCHITECTURE.md");
    let crates = crates();
    for (name, folder) in &crates {
        let manifest = manifest_of(folder);
        let dependencies = manifest.get("dependencies").and_then(toml::Value::as_table);
        let ours: BTreeSet<&str> = dependencies
            .into_iter()
            .flat_map(toml::Table::keys)
            .map(String::as_str)
            .filter(|key| crates.contains_key(*key))
            .collect();
        let mut rows = text.lines().filter_map(|line| line.split_once(" ->"));
        let row = rows.find(|(shown, _)| shown.trim() == name);
        let (_, shown) = row.unwrap_or_else(|| panic!("ARCHITECTURE.md does not show {name}"));
        let shown: BTreeSet<&str> =
            shown.split(',').map(str::trim).filter(|shown| !shown.is_empty()).collect();
        assert_eq!(shown, ours, "{name}");
        let folder = folder.strip_prefix(root()).unwrap().display().to_string();
        assert!(text.contains(&format!("| `{folder}/` | `{name}` |")), "no row of {folder}/");
    }
}

#[test]
fn links_in_documents_resolve() {
    let pages = fs::read_dir(root().join("docs")).unwrap();
    let pages = pages.map(|page| format!("docs/{}", page.unwrap().file_name().display()));
    let names: Vec<String> = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md"]
        .map(str::to_owned)
        .into_iter()
        .chain(pages.filter(|name| name.ends_with(".md")))
        .collect();
    assert!(names.len() > 14, "{names:?}");
    for name in &names {
        let text = document(name);
        let folder = root().join(name).parent().unwrap().to_path_buf();
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let is_web = link.starts_with("https://");
            assert!(is_web || folder.join(link).exists(), "{name} links to {link}");
        }
    }
}

/// Every page counts the scenes that `grade` grades where nothing else is asked for, those without points included.
#[test]
fn counts_in_documents_match_the_suite() {
    let sections = [(Section::Required, "assets"), (Section::ExtraCredit, "extracreditassets")]
        .map(|(section, folder)| (section, root().join(folder)));
    let mut suite = Suite::load(&sections, &ParseOptions::default()).unwrap();
    let mut rubric = Rubric::load(&root().join("assets/rubric.toml")).unwrap();
    let mut all = Assignment::load(&root().join("assets/assignments"), assignment::ALL).unwrap();
    all.narrow(&mut suite).unwrap();
    rubric.assign(all);
    let [points, extra_points] = [Section::Required, Section::ExtraCredit].map(|section| {
        let of_section = suite.cases.iter().filter(|case| case.feature.section == section);
        let features: BTreeSet<&Feature> = of_section.map(|case| &case.feature).collect();
        features.iter().map(|feature| rubric.points(feature)).sum::<f64>() as usize
    });
    let counts = [points, extra_points, suite.cases.len()];
    let run = folder::grade(root(), &["--no-jacobians"]);
    let graded: usize = ["Required", "Extra", "Without"]
        .map(|title| {
            let line = run.stdout.lines().find(|line| line.trim_start().starts_with(title));
            let mut pairs =
                line.unwrap().split_whitespace().filter_map(|word| word.split_once('/'));
            pairs.next().unwrap().1.parse::<usize>().unwrap()
        })
        .iter()
        .sum();
    assert_eq!(graded, suite.cases.len(), "{}", run.stdout);
    let class = document("docs/teaching.md");
    let row = class.lines().find(|line| line.starts_with("  ada  ")).unwrap();
    let pairs = row.split_whitespace().filter_map(|word| word.split_once('/'));
    let stated: Vec<usize> = pairs.take(3).map(|(_, of)| of.parse().unwrap()).collect();
    let stated = <[usize; 3]>::try_from(stated).unwrap();
    for ((page, old), (_, new)) in counts_in_words(stated).into_iter().zip(counts_in_words(counts))
    {
        let text = document(page);
        if old != new && is_updating() {
            rewrite(page, &old, &new);
            continue;
        }
        let help =
            "`UPDATE_DOCS=1 cargo test --release -p grade --test it docs::` writes the counts";
        assert!(text.contains(&new), "{page} does not say {new:?}; {help}");
    }
    // Those of the self-test are held to a run by ci/selftest.sh.
    let (selftest, page) = (document("docs/selftest.md"), "docs/measuring.md");
    for row in selftest.lines().filter(|line| line.contains("% | ")) {
        let cells: Vec<&str> = row.split(" | ").map(|cell| cell.trim_matches(['|', ' '])).collect();
        for words in [format!(" {}  ", cells[1].replace(" of ", "/")), cells[2].to_owned()] {
            assert!(document(page).contains(&words), "{page} does not say {words:?}");
        }
    }
}

/// Pages, and what each says of the points of the required part, those of extra credit, and the scenes.
fn counts_in_words(counts: [usize; 3]) -> Vec<(&'static str, String)> {
    let [points, extra_points, scenes] = counts;
    let mut words = vec![
        ("README.md", format!("Spring Oracle has {scenes} scenes,")),
        ("docs/teaching.md", format!("  scenes: {scenes} of {scenes}")),
        ("docs/teaching.md", format!(" {}  {scenes}/{scenes} ", points + extra_points)),
    ];
    for count in counts {
        let cells = [format!(" {count}/{count} "), format!(" 0/{count} ")];
        words.extend(cells.map(|cell| ("docs/teaching.md", cell)));
    }
    words
}

/// The reports that documents show are those of `grade`, to the letter.
#[needs("command -v cc")]
#[cfg(target_os = "linux")]
#[test]
fn sample_reports_are_those_of_grade_and_short() {
    let folder = agreement::mistaken("", "drag without its Jacobian");
    let report = folder.grade(&["my-simulator", "--assignment", "t1m3"]).stdout;
    agreement::assert_short(&report);
    let (_, findings) = report.split_once("\nFindings\n").unwrap();
    hold_sample("docs/students.md", "This is the report of a program", &report);
    hold_sample(
        "README.md",
        "This is how the report of a program",
        &format!("Findings\n{findings}"),
    );
    // Knows free motion alone, and prints what it lacks.
    let folder = Folder::new();
    student::compile(&folder.path("skeleton"), "");
    folder.write(
        "skeleton/run.sh",
        "grep -q '<simplegravity' \"$2\" && { echo 'unknown force simplegravity' >&2; exit 77; }\n\
         exec \"$(dirname \"$0\")/student\" \"$@\"\n",
    );
    folder.write("skeleton/submission.toml", &agreement::manifest("skeleton"));
    let report = folder.grade(&["skeleton", "--assignment", "t1m2"]).stdout;
    let (_, findings) = report.split_once("\nFindings\n").unwrap();
    hold_sample("docs/students.md", "For an unfinished program", &format!("Findings\n{findings}"));
}

/// The report of `grade fuzz` that the document shows is that of its seed, to the letter but for what [`of_machine`] says.
#[needs("command -v cc")]
#[cfg(target_os = "linux")]
#[test]
fn the_sample_of_drawn_scenes_is_that_of_grade() {
    let folder = agreement::mistaken("", "length along x with a sign");
    let command = "grade fuzz my-simulator --assignment t1m3 --force springforce --integrator symplectic-euler --failures 4 --seed 7";
    let arguments: Vec<&str> = command.split(' ').skip(1).collect();
    let report = folder.grade(&arguments).stdout;
    assert!(document("docs/fuzzing.md").contains(command));
    hold_sample_but("docs/fuzzing.md", "This program takes the length", &report, of_machine);
}

/// Words of a report without times and rates, and without the runs that shrinking takes, as many at a time as there are threads.
fn of_machine(report: &str) -> Vec<&str> {
    let words: Vec<&str> = report.split_whitespace().collect();
    let is_kept = |pair: &&[&str]| !["s", "s,", "a", "runs"].contains(&pair[1]);
    words.windows(2).filter(is_kept).map(|pair| pair[0]).collect()
}

/// Holds the sample below the line of a document that begins with these words, or writes it.
fn hold_sample(name: &str, words: &str, expected: &str) {
    hold_sample_but(name, words, expected, |text| vec![text]);
}

/// The same for what is left of a sample.
fn hold_sample_but(name: &str, words: &str, expected: &str, left: fn(&str) -> Vec<&str>) {
    let _held = DOCUMENTS.lock();
    let path = root().join(name);
    let text = fs::read_to_string(&path).unwrap();
    let line = text.find(words).unwrap_or_else(|| panic!("{name} lacks {words:?}"));
    let start = line + text[line..].find("```text\n").unwrap() + "```text\n".len();
    let end = start + text[start..].find("```").unwrap();
    if left(&text[start..end]) == left(expected) {
        return;
    }
    if is_updating() {
        fs::write(path, format!("{}{expected}{}", &text[..start], &text[end..])).unwrap();
        return;
    }
    let help = "`UPDATE_DOCS=1 cargo test --release -p grade --test it docs::` writes the sample";
    assert_eq!(&text[start..end], expected, "{name} is not up to date; {help}");
}

/// Whether documents are to be written, and not compared.
fn is_updating() -> bool {
    std::env::var_os("UPDATE_DOCS").is_some_and(|value| value == "1")
}

/// Holds `found`, which stands in the document `name`, against `expected`, or writes that in its place.
fn hold(name: &str, found: &[String], expected: &[String], about: &str) {
    if found == expected {
        return;
    }
    if is_updating() {
        rewrite(name, &found.join("\n"), &expected.join("\n"));
        return;
    }
    let missing = expected.iter().find(|line| !found.contains(line));
    let surplus = found.iter().find(|line| !expected.contains(line));
    panic!(
        "{name} does not have the {about} of the registry: it lacks {missing:?}, and has {surplus:?}\n  \
         help: `UPDATE_DOCS=1 cargo test --release -p grade --test it docs::` writes it"
    );
}

/// The rows of the table with this header.
fn rows_of(name: &str, header: &str) -> Vec<String> {
    let text = document(name);
    let table = text.lines().skip_while(|line| *line != header).skip(2);
    let rows: Vec<String> =
        table.take_while(|line| line.starts_with('|')).map(str::to_owned).collect();
    assert!(!rows.is_empty(), "{name} has no table {header}");
    rows
}

/// The attributes of a force: what it acts on and its required parameters, then the optional ones.
fn attributes(schema: &ForceSchema) -> String {
    let mut required = schema.stencil.attributes().to_vec();
    let mut optional = String::new();
    for parameter in schema.parameters {
        match parameter.default {
            None if parameter.is_required() => required.push(parameter.name),
            None => optional += &format!(" `{}`", parameter.name),
            Some(_) if parameter.three_dimensional => optional += &format!(" `{}`", parameter.name),
            Some(default) => optional += &format!(" `{}` ({default})", parameter.name),
        }
    }
    if schema.is_element() {
        optional += " (those of the initial positions)";
    }
    let required =
        if required.is_empty() { String::new() } else { format!("`{}`", required.join(" ")) };
    let parts =
        [required, if optional.is_empty() { optional } else { format!("optional{optional}") }];
    let parts: Vec<String> = parts.into_iter().filter(|part| !part.is_empty()).collect();
    parts.join(", ")
}

#[test]
fn the_methods_list_the_forces_of_the_registry() {
    let row = |kind: &&ForceKind| {
        let ForceSchema { tag, formula, .. } = kind.schema;
        format!("| `{tag}` | {} | {formula} |", attributes(&kind.schema))
    };
    let rows: Vec<String> = force::REGISTRY.iter().map(row).collect();
    let found = rows_of("docs/methods.md", "| force | attributes | on the particles |");
    hold("docs/methods.md", &found, &rows, "forces");
}

#[test]
fn the_derivatives_are_those_of_the_forces_of_the_registry() {
    let row = |kind: &&ForceKind| {
        let Derivatives { by_position, by_velocity, energy } = kind.schema.derivatives;
        format!("| `{}` | {by_position} | {by_velocity} | {energy} |", kind.schema.tag)
    };
    let rows: Vec<String> = force::REGISTRY.iter().map(row).collect();
    let found = rows_of("docs/methods.md", "| force | `A` | `B` | energy |");
    hold("docs/methods.md", &found, &rows, "derivatives and energies");
}

#[test]
fn the_methods_list_the_integrators_of_the_registry() {
    let row = |kind: &&IntegratorKind| {
        let IntegratorSchema { name, aliases, formula, .. } = kind.schema;
        let aliases: Vec<String> = aliases.iter().map(|alias| format!("`{alias}`")).collect();
        let aliases = aliases.join(", ");
        let space = if aliases.is_empty() { "" } else { " " };
        format!("| `{name}` |{space}{aliases} | {formula} |")
    };
    let rows: Vec<String> = integrator::REGISTRY.iter().map(row).collect();
    let found =
        rows_of("docs/methods.md", "| integrator `type` | also spelt | step from `(q, v)` |");
    hold("docs/methods.md", &found, &rows, "integrators");

    let option = |name: &str, option: &OptionSchema| {
        let default = match option.kind {
            OptionKind::Number { default, .. } if default >= 1e6 => format!("{default:e}"),
            OptionKind::Number { default, .. } => default.to_string(),
            OptionKind::Count { default, .. } => default.to_string(),
            OptionKind::Choice { words } => format!("`{}`", words[0]),
        };
        let OptionText { values, meaning } = option.formats;
        if let OptionKind::Choice { words } = option.kind {
            let stated: Vec<&str> = code_words(values).collect();
            assert_eq!(stated, words, "{name} {}", option.name);
        }
        format!("| `{name}` | `{}` | {values} | {default} | {meaning} |", option.name)
    };
    let rows: Vec<String> = integrator::REGISTRY
        .iter()
        .flat_map(|kind| kind.schema.options.iter().map(|each| option(kind.schema.name, each)))
        .collect();
    let header = "| integrator | option | values | default | meaning |";
    hold("docs/methods.md", &rows_of("docs/methods.md", header), &rows, "options");
}

/// The lines for other schedulers, run by a shell as these would.
#[test]
fn lines_for_schedulers_run_the_shard_of_their_index() {
    let folder = Folder::new();
    folder.program("bin/grade", "#!/bin/sh\necho \"$@\"\n");
    let text = document("docs/teaching.md");
    for variable in ["JOB_COMPLETION_INDEX", "AWS_BATCH_JOB_ARRAY_INDEX", "PBS_ARRAY_INDEX"] {
        let row = text.lines().find(|line| line.contains(&format!("${variable}"))).unwrap();
        let start = row.find("exec grade").unwrap();
        let end = start + row[start..].find(variable).unwrap() + variable.len();
        let line = row[start..end].replace('"', "");
        let path = format!("{}:/usr/bin:/bin", folder.path("bin").display());
        let shell = std::process::Command::new("sh")
            .args(["-c", &line])
            .env("PATH", path)
            .env(variable, "7")
            .output();
        let printed = String::from_utf8(shell.unwrap().stdout).unwrap();
        assert_eq!(printed, "class run-shard results/plan.json 7\n", "{line}");
    }
    assert!(text.contains("'arguments = class run-shard results/plan.json $(Process)'"));
}
