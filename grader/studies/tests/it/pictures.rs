//! The pictures of `docs/`: functions of the code and, where they show times, of the measurements in `pictures.csv`.
//!
//! `pictures.csv` is a report of `grade accuracy` as CSV. Everything in it but the times is the same on every machine, and is
//! compared with what the code gives today.

use std::collections::BTreeSet;

use ::csv::{Reader, StringRecord};
use simulator::integrator::REGISTRY;
use studies::accuracy::ladder::{self, Method};
use studies::accuracy::problem::PROBLEMS;
use studies::accuracy::reference::Reference;
use studies::accuracy::{
    self, AccuracyConfig, Cost, Curve, Errors, Point, RunOutcome, SceneStudy, Study, Target, Timing,
};
use studies::report::accuracy::{csv, plot};
use studies::report::stability::plot as map_plot;
use studies::stability::theory::map::{Map, maps};
use test_support::{assert_document, root};

const MEASURED: &str = include_str!("pictures.csv");

const COMMAND: &str = "cargo test --release -p studies pictures";

const MEASURE: &str = "measure again with the command of CONTRIBUTING.md";

/// A row of the report.
struct Row(StringRecord);

impl Row {
    fn cell(&self, name: &str) -> &str {
        let column = csv::COLUMNS.iter().position(|column| *column == name).expect("a column");
        &self.0[column]
    }

    fn number(&self, name: &str) -> f64 {
        self.cell(name).parse().expect(name)
    }

    fn errors(&self, when: &str) -> Errors {
        let of = |quantity: &str| self.number(&format!("{quantity}_error_{when}"));
        Errors { position: of("position"), velocity: of("velocity"), energy: of("energy") }
    }

    fn point(&self) -> Point {
        let largest = || self.errors("largest");
        let outcome = match self.cell("outcome") {
            "finished" => RunOutcome::Finished { end: self.errors("end"), largest: largest() },
            "blown-up" => RunOutcome::BlownUp { largest: Errors::default() },
            _ => RunOutcome::Failed {
                step: self.number("failed_step") as u64,
                time: self.number("failed_time"),
                reason: self.cell("reason").to_owned(),
            },
        };
        let time = Timing {
            least: self.number("time_least"),
            median: self.number("time_median"),
            largest: self.number("time_largest"),
            repeats: self.number("repeats") as u32,
        };
        Point {
            time_step: self.number("dt"),
            steps: self.number("steps") as u64,
            outcome,
            cost: Cost { time: Some(time), work: None },
        }
    }
}

fn rows(report: &str) -> Vec<Row> {
    let mut reader = Reader::from_reader(report.as_bytes());
    assert_eq!(reader.headers().unwrap(), csv::COLUMNS.as_slice(), "{MEASURE}");
    reader.records().map(|record| Row(record.unwrap())).collect()
}

/// The scenes that pages show, by the links to their pictures.
fn shown(folder: &str) -> BTreeSet<String> {
    let pages = ["docs/choosing.md", "docs/stability.md"];
    let pages = pages.map(|page| std::fs::read_to_string(root().join(page)).unwrap());
    let links = pages.iter().flat_map(|page| page.split("](").skip(1));
    let names = links.filter_map(|link| link.split(')').next()?.strip_prefix(folder));
    names.map(str::to_owned).collect()
}

fn kept(folder: &str) -> BTreeSet<String> {
    let files = std::fs::read_dir(root().join("docs").join(folder)).unwrap();
    files.map(|file| file.unwrap().file_name().into_string().unwrap()).collect()
}

#[test]
fn work_precision_diagrams_match_stored_measurements() {
    let rows = rows(MEASURED);
    for file in shown("pictures/accuracy/") {
        let name = file.strip_suffix(".svg").expect("a diagram");
        let problem = PROBLEMS.iter().find(|problem| problem.name == name).expect(name);
        let target = Target::of_problem(problem);
        let reference = Reference::new(&target.scene, target.closed.as_ref()).unwrap();
        let curve = |method: Method| {
            let label = method.label();
            let own = |row: &&Row| row.cell("scene") == name && row.cell("method") == label;
            let points: Vec<Point> = rows.iter().filter(own).map(Row::point).collect();
            assert!(points.len() >= 5, "{name}, {label}: {} points; {MEASURE}", points.len());
            Curve { method, foreign: false, points }
        };
        let curves: Vec<Curve> = ladder::methods(&target.scene).into_iter().map(curve).collect();
        let measured = rows.iter().filter(|row| row.cell("scene") == name).count();
        let drawn: usize = curves.iter().map(|curve| curve.points.len()).sum();
        assert_eq!(drawn, measured, "{name}: methods that are gone; {MEASURE}");
        let svg = plot::svg(&SceneStudy { target, reference, curves }).unwrap();
        assert_document(&format!("pictures/accuracy/{file}"), &svg, COMMAND);
    }
    assert_eq!(shown("pictures/accuracy/"), kept("pictures/accuracy"));
}

/// The columns of a report that are the same on every machine.
fn reproducible(report: &str, is_taken: impl Fn(&Row) -> bool) -> Vec<Vec<String>> {
    let rows = rows(report).into_iter().filter(|row| is_taken(row));
    let times = csv::COLUMNS.len() - 4;
    rows.map(|row| row.0.iter().take(times).map(str::to_owned).collect()).collect()
}

#[test]
fn stored_measurements_match_current_methods() {
    // Few steps of two scenes, with every method; a change of a method changes their errors.
    let config = AccuracyConfig { rungs: 7, repeats: 1, budget: 0.0, max_steps: 512 };
    for name in ["oscillator", "stiff-damped-spring"] {
        let problem = PROBLEMS.iter().find(|problem| problem.name == name).unwrap();
        let targets = vec![Target::of_problem(problem)];
        let study: Study = accuracy::study(targets, None, config, None, &mut |_, _, _| {}).unwrap();
        let today = reproducible(&csv::render(&study).unwrap(), |_| true);
        let stored =
            reproducible(MEASURED, |row| row.cell("scene") == name && row.number("steps") <= 512.0);
        assert!(today.len() > 7 * REGISTRY.len(), "{name}: {}", today.len());
        for (today, stored) in today.iter().zip(&stored) {
            assert_eq!(today, stored, "{MEASURE}");
        }
        assert_eq!(today.len(), stored.len(), "{name}: {MEASURE}");
    }
}

#[test]
fn stability_maps_match_current_methods() {
    let maps = maps();
    let file = |map: &Map| format!("stability-{}.svg", map.method);
    let shown = shown("stability/");
    for map in maps.iter().filter(|map| shown.contains(&file(map))) {
        let svg = map_plot::svg(map).unwrap();
        assert_document(&format!("stability/{}", file(map)), &svg, COMMAND);
    }
    assert_eq!(shown, kept("stability"));
    let known: BTreeSet<String> = maps.iter().map(file).collect();
    assert!(shown.is_subset(&known), "{shown:?}");
    // A method without a picture has the map of one that has it.
    let is_alike = |one: &Map, other: &Map| {
        let pairs = one.radii.iter().zip(&other.radii);
        pairs.into_iter().all(|(one, other)| (one - other).abs() <= 1e-6 * one.max(1.0))
    };
    for map in maps.iter().filter(|map| !shown.contains(&file(map))) {
        let stands_for = |other: &Map| shown.contains(&file(other)) && is_alike(map, other);
        assert!(maps.iter().any(stands_for), "docs/stability.md shows no {}", map.method);
    }
}
