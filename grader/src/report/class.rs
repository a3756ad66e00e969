//! The summary of a class: a row a submission, as text or as CSV.

use std::io::{self, Write};

use super::table::{self, Cell};
use super::text::{BAD, BOLD, DIM, GOOD, ODD, header};
use crate::class::Row;
use crate::class::entry::PassedOver;

/// Names of the columns of the CSV.
const COLUMNS: [&str; 13] = [
    "name",
    "verdict",
    "required",
    "required_of",
    "extra_credit",
    "extra_credit_of",
    "points",
    "scenes_passed",
    "scenes",
    "hidden_passed",
    "hidden",
    "jacobians_correct",
    "jacobians",
];

/// Writes the summary for people.
///
/// # Errors
/// Where the output takes no more.
pub fn write(out: &mut dyn Write, rows: &[Row], passed_over: &[PassedOver]) -> io::Result<()> {
    let names = [
        "submission",
        "required",
        "extra credit",
        "points",
        "scenes",
        "hidden",
        "Jacobians",
        "verdict",
    ];
    let nothing = || "-".to_owned();
    let pair = |(part, all): (usize, usize)| format!("{part}/{all}");
    let of = |(part, all): (&str, &str)| format!("{part}/{all}");
    let mut cells = vec![header(&names, 1..7)];
    for row in rows {
        let style = match row.verdict.as_str() {
            "passed" | "passed-shipped" => GOOD,
            _ if row.is_fault() => ODD,
            _ => BAD,
        };
        cells.push(vec![
            Cell::left(row.name.clone()),
            Cell::right(of((&row.required.0, &row.required.1))),
            Cell::right(of((&row.extra_credit.0, &row.extra_credit.1))),
            Cell::right(row.points.clone()),
            Cell::right(pair(row.scenes)),
            Cell::right(row.hidden.map_or_else(nothing, pair)),
            Cell::right(row.jacobians.map_or_else(nothing, pair)),
            Cell::left(row.verdict.replace('-', " ")).styled(style),
        ]);
    }
    table::write(out, &cells)?;
    writeln!(out)?;
    for row in rows {
        if let Some(copied) = &row.copied {
            writeln!(out, "  {ODD}{}: {copied}.{ODD:#}", row.name)?;
        }
    }
    for PassedOver { name, reason } in passed_over {
        writeln!(out, "  {DIM}passed over: {name}: {reason}{DIM:#}")?;
    }
    let count = |wanted: fn(&Row) -> bool| rows.iter().filter(|row| wanted(row)).count();
    let passed = count(|row| row.verdict == "passed" || row.verdict == "passed-shipped");
    let faults = count(Row::is_fault);
    let failed = rows.len() - passed - faults;
    let submissions = if rows.len() == 1 { "submission" } else { "submissions" };
    writeln!(
        out,
        "  {BOLD}{} {submissions}{BOLD:#}: {passed} passed, {failed} failed, {faults} could not be judged",
        rows.len()
    )?;
    if rows.iter().any(|row| row.verdict == "passed-shipped") {
        writeln!(out, "  {ODD}Hidden scenes were not run: `passed shipped` is not all.{ODD:#}")?;
    }
    Ok(())
}

/// The summary as CSV, with a header line. What there is none of is empty.
///
/// # Errors
/// Never in practice.
pub fn csv(rows: &[Row]) -> csv::Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(COLUMNS)?;
    for row in rows {
        let texts = |pair: Option<(usize, usize)>| {
            pair.map(|(part, all)| (part.to_string(), all.to_string())).unwrap_or_default()
        };
        let (scenes_passed, scenes) = texts(Some(row.scenes));
        let (hidden_passed, hidden) = texts(row.hidden);
        let (correct, jacobians) = texts(row.jacobians);
        writer.write_record([
            plain(&row.name).as_str(),
            &row.verdict,
            &row.required.0,
            &row.required.1,
            &row.extra_credit.0,
            &row.extra_credit.1,
            &row.points,
            &scenes_passed,
            &scenes,
            &hidden_passed,
            &hidden,
            &correct,
            &jacobians,
        ])?;
    }
    writer.into_inner().map_err(|error| error.into_error().into())
}

/// A name that no spreadsheet takes for a formula.
fn plain(name: &str) -> String {
    if name.starts_with(['=', '+', '-', '@']) { format!("'{name}") } else { name.to_owned() }
}
