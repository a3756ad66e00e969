//! The documents are true: paths exist, and what the registries offer is described.

use std::collections::BTreeSet;
use std::fs;
use test_support::root;

use grader::rubric::Rubric;
use grader::suite::{Feature, Section, Suite};
use simulator::scene::ParseOptions;
use simulator::scene::schema::{OptionKind, OptionSchema};
use simulator::{force, integrator};

fn document(name: &str) -> String {
    fs::read_to_string(root().join(name)).unwrap()
}

/// What stands between backticks.
fn code_words(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

#[test]
fn every_path_in_the_architecture_exists() {
    let text = document("ARCHITECTURE.md");
    let is_path = |word: &&str| word.contains('/') && !word.contains(['<', ' ', '·']);
    let paths: Vec<&str> = code_words(&text).filter(is_path).collect();
    assert!(paths.len() > 20, "{paths:?}");
    for path in paths {
        assert!(root().join(path).exists(), "ARCHITECTURE.md names {path}");
    }
}

#[test]
fn every_source_folder_is_in_the_architecture() {
    let text = document("ARCHITECTURE.md");
    let crates = ["sandbox", "reference", "report", "studies", "selftest", "grade", "test-support"];
    let crates = crates.map(|name| format!("grader/{name}"));
    for path in &crates {
        assert!(text.contains(&format!("`{path}/`")), "ARCHITECTURE.md does not name {path}");
    }
    for source in ["simulator/src", "grader/src"] {
        for entry in fs::read_dir(root().join(source)).unwrap() {
            let entry = entry.unwrap();
            let name = entry.file_name().into_string().unwrap();
            if ["lib.rs", "bin", "statistics.rs"].contains(&name.as_str()) {
                continue;
            }
            let slash = if entry.path().is_dir() { "/" } else { "" };
            let path = format!("`{source}/{name}{slash}`");
            assert!(text.contains(&path), "ARCHITECTURE.md does not name {path}");
        }
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
