//! Text report of the self-test.

use std::io::{self, Write};

use super::{blamed, expected, rates, verdict};
use crate::{Expectation, Outcome, Row, SelfTest};
use report::table::{self, BAD, BOLD, Cell, DIM, GOOD, ODD, header};

/// Writes the matrix and the rates.
///
/// # Errors
/// If writing fails.
pub fn write(out: &mut dyn Write, selftest: &SelfTest) -> io::Result<()> {
    writeln!(out, "{BOLD}Mistakes{BOLD:#}")?;
    let names = ["where", "verdict", "scenes", "in", "mistake", "findings", ""];
    let mut rows = vec![header(&names, 2..3)];
    rows.extend(selftest.mistakes().map(mistake));
    table::write(out, &rows)?;
    writeln!(out, "\n{BOLD}Correct variants{BOLD:#}")?;
    let names = ["what varies", "verdict", "scenes", "worst", "in", "variant", ""];
    let mut rows = vec![header(&names, 2..4)];
    rows.extend(selftest.variants().map(variant));
    table::write(out, &rows)?;
    writeln!(out, "\n{BOLD}Rates{BOLD:#}")?;
    let row = |(name, rate, target): (&str, crate::Rate, f64)| {
        let met = rate.all > 0 && rate.value() >= target;
        vec![
            Cell::left(name),
            Cell::right(format!("{}/{}", rate.right, rate.all)),
            Cell::right(format!("{:.1} %", 100.0 * rate.value())),
            Cell::left(format!("target {} %", 100.0 * target)),
            if met { Cell::left("met").styled(GOOD) } else { Cell::left("MISSED").styled(BAD) },
        ]
    };
    table::write_unnamed(out, &rates(selftest).map(row))?;
    match selftest.skipped() {
        0 => Ok(()),
        1 => writeln!(out, "  {ODD}1 row was skipped{ODD:#} and is not counted in the rates."),
        n => writeln!(out, "  {ODD}{n} rows were skipped{ODD:#} and are not counted in the rates."),
    }
}

/// The verdict with its colour.
fn told(row: &Row) -> Cell {
    let style = match row.is_told() {
        Some(true) => GOOD,
        Some(false) => BAD,
        None => ODD,
    };
    Cell::left(verdict(row)).styled(style)
}

/// The first cells of a row, with these numbers among them.
fn start<const N: usize>(row: &Row, numbers: [String; N]) -> Vec<Cell> {
    let mut cells = vec![Cell::left(row.subject.clone()), told(row)];
    cells.extend(numbers.map(Cell::right));
    cells.extend([&row.language, &row.description].map(|text| Cell::left(text.clone())));
    cells
}

fn mistake(row: &Row) -> Vec<Cell> {
    match &row.result {
        Outcome::Skipped(reason) => {
            let mut cells = start(row, [String::new()]);
            cells.push(Cell::left(reason.clone()).styled(DIM));
            cells
        }
        Outcome::Graded(graded) => {
            let mut cells = start(row, [format!("{}/{}", graded.failed, graded.scenes)]);
            cells.push(Cell::left(blamed(graded)));
            if row.is_blamed_rightly() == Some(false) {
                cells.push(Cell::left(format!("not {}", expected(row))).styled(BAD));
            }
            cells
        }
    }
}

fn variant(row: &Row) -> Vec<Cell> {
    match &row.result {
        Outcome::Skipped(reason) => {
            let mut cells = start(row, [String::new(), String::new()]);
            cells.push(Cell::left(reason.clone()).styled(DIM));
            cells
        }
        Outcome::Graded(graded) => {
            let worst = graded.worst.map_or_else(|| "-".to_owned(), |worst| format!("{worst:.1e}"));
            let passed = format!("{}/{}", graded.scenes - graded.failed, graded.scenes);
            let mut cells = start(row, [passed, worst]);
            if let (Some(example), Expectation::Correct) = (&graded.example, row.expectation) {
                let line = example.lines().next().unwrap_or_default();
                cells.push(Cell::left(line.to_owned()).styled(DIM));
            }
            cells
        }
    }
}
