//! The self-test for people.

use std::io::{self, Write};

use super::{blamed, expected, rates, verdict};
use crate::report::table::{self, Cell};
use crate::report::text::{BAD, BOLD, DIM, GOOD, ODD, header};
use crate::selftest::{Expectation, Outcome, Row, SelfTest};

/// Writes the matrix and the rates.
///
/// # Errors
/// Where the output takes no more.
pub fn write(out: &mut dyn Write, selftest: &SelfTest) -> io::Result<()> {
    writeln!(out, "{BOLD}Mistakes{BOLD:#}")?;
    let names = ["where", "mistake", "in", "scenes", "verdict", "blamed on", ""];
    let mut rows = vec![header(&names, 3..4)];
    rows.extend(selftest.mistakes().map(mistake));
    table::write(out, &rows)?;
    writeln!(out, "\n{BOLD}Correct variants{BOLD:#}")?;
    let names = ["what varies", "variant", "in", "scenes", "worst", "verdict", ""];
    let mut rows = vec![header(&names, 3..5)];
    rows.extend(selftest.variants().map(variant));
    table::write(out, &rows)?;
    writeln!(out, "\n{BOLD}Rates{BOLD:#}")?;
    let row = |(name, rate, target): (&str, crate::selftest::Rate, f64)| {
        let met = rate.all > 0 && rate.value() >= target;
        vec![
            Cell::left(name),
            Cell::right(format!("{}/{}", rate.right, rate.all)),
            Cell::right(format!("{:.1} %", 100.0 * rate.value())),
            Cell::left(format!("target {} %", 100.0 * target)),
            if met { Cell::left("met").styled(GOOD) } else { Cell::left("MISSED").styled(BAD) },
        ]
    };
    table::write(out, &rates(selftest).map(row))?;
    match selftest.skipped() {
        0 => Ok(()),
        1 => writeln!(out, "  {ODD}1 row was skipped{ODD:#} and counts in no rate."),
        n => writeln!(out, "  {ODD}{n} rows were skipped{ODD:#} and count in no rate."),
    }
}

fn start(row: &Row) -> Vec<Cell> {
    vec![
        Cell::left(row.subject.clone()),
        Cell::left(row.description.clone()),
        Cell::left(row.language.clone()),
    ]
}

/// The verdict, in its colour.
fn told(row: &Row) -> Cell {
    let style = match row.is_told() {
        Some(true) => GOOD,
        Some(false) => BAD,
        None => ODD,
    };
    Cell::left(verdict(row)).styled(style)
}

fn mistake(row: &Row) -> Vec<Cell> {
    let mut cells = start(row);
    match &row.result {
        Outcome::Skipped(reason) => {
            cells.extend([Cell::left(""), told(row), Cell::left(reason.clone()).styled(DIM)]);
        }
        Outcome::Graded(graded) => {
            cells.push(Cell::right(format!("{}/{}", graded.failed, graded.scenes)));
            cells.push(told(row));
            cells.push(Cell::left(blamed(graded)));
            if row.is_blamed_rightly() == Some(false) {
                cells.push(Cell::left(format!("not {}", expected(row))).styled(BAD));
            }
        }
    }
    cells
}

fn variant(row: &Row) -> Vec<Cell> {
    let mut cells = start(row);
    match &row.result {
        Outcome::Skipped(reason) => {
            let nothing = Cell::left("");
            cells.extend([
                nothing,
                Cell::left(""),
                told(row),
                Cell::left(reason.clone()).styled(DIM),
            ]);
        }
        Outcome::Graded(graded) => {
            let worst = graded.worst.map_or_else(|| "-".to_owned(), |worst| format!("{worst:.1e}"));
            cells.push(Cell::right(format!("{}/{}", graded.scenes - graded.failed, graded.scenes)));
            cells.push(Cell::right(worst));
            cells.push(told(row));
            if let (Some(example), Expectation::Correct) = (&graded.example, row.expectation) {
                let line = example.lines().next().unwrap_or_default();
                cells.push(Cell::left(line.to_owned()).styled(DIM));
            }
        }
    }
    cells
}
