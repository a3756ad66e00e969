//! Checks of the documents: paths exist, and all registered forces and integrators are described.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use test_support::root;

use grader::rubric::Rubric;
use grader::suite::{Feature, Section, Suite};
use simulator::scene::ParseOptions;
use simulator::scene::schema::{OptionKind, OptionSchema};
use simulator::{force, integrator};

fn document(name: &str) -> String {
    fs::read_to_string(root().join(name)).unwrap()
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
fn crates() -> BTreeMap<String, PathBuf> {
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
        let dependencies = manifest["dependencies"].as_table().unwrap();
        let ours: BTreeSet<&str> = dependencies
            .keys()
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

/// Top-level modules of a crate, each with the modules that its code imports, without tests.
fn imports(source: &Path) -> BTreeMap<String, BTreeSet<String>> {
    let mut imports: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    let mut folders = vec![source.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let inside = path.strip_prefix(source).unwrap();
            let mut names: Vec<String> =
                inside.with_extension("").iter().map(|name| name.display().to_string()).collect();
            if path.is_dir() {
                if names != ["bin"] {
                    folders.push(path);
                }
                continue;
            }
            if path.extension().is_none_or(|extension| extension != "rs") {
                continue;
            }
            let module = names[0].clone();
            if ["lib", "main"].contains(&module.as_str()) {
                continue;
            }
            // Number of `super::` up to the crate's root.
            if names.last().is_some_and(|name| name == "mod") {
                names.pop();
            }
            let up = "super::".repeat(names.len());
            let text = fs::read_to_string(&path).unwrap();
            let text = text.split("#[cfg(test)]\nmod ").next().unwrap();
            let code = text.lines().map(|line| line.split("//").next().unwrap());
            let code = code.collect::<Vec<_>>().join(" ");
            let found = imports.entry(module.clone()).or_default();
            for start in ["crate::", &up] {
                for (at, _) in code.match_indices(start) {
                    if code[..at].ends_with("::") {
                        continue;
                    }
                    let rest = &code[at + start.len()..];
                    // One path, or a list of them in braces.
                    let listed = rest.strip_prefix('{').and_then(|rest| rest.split_once('}'));
                    let paths = listed.map_or(rest, |(listed, _)| listed);
                    let paths =
                        paths.split(',').take(if listed.is_some() { usize::MAX } else { 1 });
                    for path in paths {
                        let is_part = |c: char| c.is_alphanumeric() || c == '_';
                        let name: String =
                            path.trim().chars().take_while(|c| is_part(*c)).collect();
                        found.insert(name);
                    }
                }
            }
            found.remove(&module);
        }
    }
    let modules: BTreeSet<String> = imports.keys().cloned().collect();
    for found in imports.values_mut() {
        found.retain(|name| modules.contains(name));
    }
    imports
}

#[test]
fn no_modules_import_each_other_in_a_circle() {
    for (name, folder) in crates() {
        let mut left = imports(&folder.join("src"));
        // A module that imports none of the remaining ones is in no circle.
        while let Some(free) = left
            .iter()
            .find(|(_, found)| !found.iter().any(|module| left.contains_key(module)))
            .map(|(module, _)| module.clone())
        {
            left.remove(&free);
        }
        assert!(left.is_empty(), "circle of imports in {name}: {left:?}");
    }
}

#[test]
fn links_in_the_documents_lead_somewhere() {
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

#[test]
fn the_counts_of_the_readme_are_those_of_the_suite() {
    let text = document("README.md");
    let says = |words: &str| assert!(text.contains(words), "README.md does not say {words:?}");
    let sections = [(Section::Required, "assets"), (Section::ExtraCredit, "extracreditassets")]
        .map(|(section, folder)| (section, root().join(folder)));
    let suite = Suite::load(&sections, &ParseOptions::default()).unwrap();
    let rubric = Rubric::load(&root().join("assets/rubric.toml")).unwrap();
    let [required, extra] = [
        ("Required", Section::Required),
        ("Extra credit", Section::ExtraCredit),
    ]
    .map(|(title, section)| {
        let of_section = suite.cases.iter().filter(|case| case.feature.section == section);
        let scenes = of_section.clone().count();
        let features: BTreeSet<&Feature> = of_section.map(|case| &case.feature).collect();
        let points: f64 = features.iter().map(|feature| rubric.points(feature)).sum();
        let features = features.len();
        let sums = format!(
            "{scenes}/{scenes} scenes  {features}/{features} features  {points}/{points} points"
        );
        let mut lines = text.lines().filter(|line| line.starts_with(&format!("  {title} ")));
        assert!(lines.any(|line| line.ends_with(&sums)), "README.md does not say {title}: {sums}");
        points
    });
    let (scenes, points) = (suite.cases.len(), required + extra);
    says(&format!("Spring Oracle has {scenes} scenes,"));
    says(&format!(
        "Score {required} of {required} points, and {extra} of {extra} for extra credit: {points} together"
    ));
    for cell in [
        format!(" {required}/{required} "),
        format!(" {extra}/{extra} "),
        format!(" {scenes}/{scenes} "),
        format!(" 0/{required} "),
        format!(" 0/{extra} "),
        format!(" 0/{scenes} "),
    ] {
        says(&cell);
    }
    // Those of the self-test are held to a run by ci/selftest.sh.
    let selftest = document("docs/selftest.md");
    for row in selftest.lines().filter(|line| line.contains("% | ")) {
        let cells: Vec<&str> = row.split(" | ").map(|cell| cell.trim_matches(['|', ' '])).collect();
        says(&format!(" {}  ", cells[1].replace(" of ", "/")));
        assert!(text.contains(cells[2]), "README.md does not say {}", cells[2]);
    }
}

#[test]
fn every_force_and_integrator_is_described() {
    let text = document("docs/formats.md");
    for kind in force::REGISTRY {
        let row = text.lines().find(|line| line.contains(&format!("| `{}` |", kind.schema.tag)));
        let row =
            row.unwrap_or_else(|| panic!("docs/formats.md has no row for {}", kind.schema.tag));
        for parameter in kind.schema.parameters {
            let mut words = code_words(row).flat_map(str::split_whitespace);
            assert!(words.any(|word| word == parameter.name), "{row}: {}", parameter.name);
        }
    }
    for kind in integrator::REGISTRY {
        for name in kind.schema.aliases.iter().chain([&kind.schema.name]) {
            assert!(text.contains(&format!("`{name}`")), "docs/formats.md does not name {name}");
        }
        let name = kind.schema.name;
        for OptionSchema { name: option, kind, .. } in kind.schema.options {
            let start = format!("| `{name}` | `{option}` |");
            let row = text.lines().find(|line| line.starts_with(&start));
            let row = row.unwrap_or_else(|| panic!("docs/formats.md has no row {start}"));
            let words = if let OptionKind::Choice { words } = kind { *words } else { &[] };
            for word in words {
                assert!(code_words(row).any(|found| found == *word), "{row}: {word}");
            }
        }
    }
}
