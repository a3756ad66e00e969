//! Shared support of integration tests: the repository's folders and scenes, and generated documents.

mod schema;

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use grader::suite::{Section, Suite};
use scene::ParseOptions;

/// The root of the repository.
///
/// # Panics
/// If this crate is not two folders below the root.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .nth(2)
        .expect("a crate two folders below the root")
}

/// The folder of the course's scenes and traces, which are not part of the repository.
pub fn course() -> PathBuf {
    beside("SPRING_ORACLE_FOSSSIM", "../shared/fosssim")
}

/// The same of its scenes of elastic bodies.
pub fn course_on_elastic_bodies() -> PathBuf {
    beside("SPRING_ORACLE_ELASTIC", "../shared/elastic")
}

fn beside(variable: &str, path: &str) -> PathBuf {
    std::env::var_os(variable).map_or(root().join(path), PathBuf::from)
}

/// A scene of one free particle and six states.
pub const FREE_PARTICLE: &str = r#"<scene>
  <duration time="0.5"/>
  <integrator type="explicit-euler" dt="0.1"/>
  <particle m="1" px="0" py="0" vx="1" vy="2" fixed="0"/>
</scene>
"#;

/// Seed of the samples of today: `SPRING_ORACLE_SEED`, or the number of days since 1970. It is printed, so that a failed
/// test shows it.
///
/// # Panics
/// If the variable is not a number.
#[expect(clippy::print_stdout, reason = "shown by failed tests")]
pub fn seed() -> u64 {
    let today = || SystemTime::UNIX_EPOCH.elapsed().map_or(0, |elapsed| elapsed.as_secs() / 86_400);
    let seed =
        std::env::var("SPRING_ORACLE_SEED").map_or_else(|_| today(), |text| text.parse().unwrap());
    println!("SPRING_ORACLE_SEED={seed} draws this sample again");
    seed
}

/// `count` of the items, drawn by [`seed`]; all, if there are fewer.
pub fn sample<T>(items: impl IntoIterator<Item = T>, count: usize) -> Vec<T> {
    let items: Vec<T> = items.into_iter().collect();
    let count = count.min(items.len());
    fastrand::Rng::with_seed(seed()).choose_multiple(items, count)
}

/// Writes a file, and the folders that it lies in.
///
/// # Panics
/// If it cannot be written.
pub fn write(path: &Path, text: &str) {
    let folder = path.parent().expect("a file in a folder");
    std::fs::create_dir_all(folder).expect("folders");
    std::fs::write(path, text).expect("a file");
}

/// All shipped scenes.
///
/// # Panics
/// If a scene cannot be read.
pub fn suite() -> Suite {
    let sections = [
        (Section::Required, root().join("assets")),
        (Section::ExtraCredit, root().join("extracreditassets")),
    ];
    Suite::load(&sections, &ParseOptions::default()).expect("shipped scenes")
}

/// Compares `docs/NAME` with `text`. With `UPDATE_DOCS=1`, writes it instead.
///
/// # Panics
/// If they differ; the message names the first differing line and `command`, which writes the document.
pub fn assert_document(name: &str, text: &str, command: &str) {
    let path = root().join("docs").join(name);
    if std::env::var_os("UPDATE_DOCS").is_some_and(|value| value == "1") {
        std::fs::write(&path, text).expect("a document");
    }
    let stored = std::fs::read_to_string(&path).unwrap_or_default().replace("\r\n", "\n");
    let differing = stored.lines().zip(text.lines()).find(|(stored, new)| stored != new);
    assert!(
        stored == text,
        "docs/{name} is out of date; first differing line: {differing:?}\n\
         help: review and accept it with `UPDATE_DOCS=1 {command}`"
    );
}

/// Asserts that a report fits its schema, `docs/NAME`.
///
/// # Panics
/// If it does not; the message names the place and the reason.
pub fn assert_fits(name: &str, report: &serde_json::Value) {
    let text = std::fs::read_to_string(root().join("docs").join(name)).expect("a schema");
    let schema = serde_json::from_str(&text).expect("JSON");
    if let Err(reason) = schema::validate(&schema, report) {
        panic!("docs/{name}: {reason}");
    }
}

/// A JUnit report without the times, which no two runs have in common.
///
/// # Panics
/// If a time is no number.
pub fn without_times(junit: &str) -> String {
    let mut parts = junit.split(" time=\"");
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |text, part| {
        let (seconds, rest) = part.split_once('"').unwrap();
        assert!(seconds.parse::<f64>().unwrap() >= 0.0, "{junit}");
        text + rest
    })
}

/// A text or JUnit report without the values of its provenance, which differ from build to build.
pub fn without_provenance(report: &str) -> String {
    let mut in_suite = false;
    let line = |line: &str| {
        in_suite |= line.contains("<testsuite name=\"provenance\"");
        let value = ["  Graded by grade ", " value=\""].into_iter().find(|it| line.contains(it));
        match value.filter(|value| in_suite || value.starts_with("  Graded")) {
            Some(value) => format!("{}{value}…\n", line.split(value).next().unwrap_or_default()),
            None => format!("{line}\n"),
        }
    };
    report.lines().map(line).collect()
}
