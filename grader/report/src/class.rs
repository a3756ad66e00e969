//! Summary of a class, one row per submission, as text or CSV.

use std::io::{self, Write};

use super::table::{self, BAD, BOLD, Cell, GOOD, ODD, header};
use super::text::{write_provenance, write_unprotected};
use grader::boundary::printed::InertCsv;
use grader::class::Row;
use grader::class::entry::PassedOver;
use grader::grading::points::{self, NO_MARK};
use grader::grading::provenance::Provenance;
use grader::verdict::Fault;
use sandbox::Protection;

/// Number of scenes that are named if no submission could be judged on them.
const UNJUDGED_SHOWN: usize = 5;

/// Column names of the CSV file.
const COLUMNS: [&str; 16] = [
    "name",
    "verdict",
    "required",
    "required_of",
    "extra_credit",
    "extra_credit_of",
    "points",
    "points_not_judged",
    "scenes_passed",
    "scenes",
    "hidden_passed",
    "hidden",
    "jacobians_correct",
    "jacobians",
    "creative",
    "creative_of",
];

/// Further columns of a class with adjustments: points granted and withdrawn, and why.
const ADJUSTMENTS: [&str; 3] = ["granted", "withdrawn", "adjusted_because"];

/// Whether some of its points were not judged.
fn has_unjudged(row: &Row) -> bool {
    row.not_judged != "0"
}

/// Points for a creative scene; without marks, what is earned is not known.
pub(crate) fn creative((earned, most): &(String, String)) -> String {
    if earned == NO_MARK { earned.clone() } else { format!("{earned}/{most}") }
}

/// A submission without a result.
pub struct Gap<'a> {
    /// Its name.
    pub name: &'a str,
    /// Why.
    pub missing: Missing,
}

/// Why a submission has no result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Missing {
    /// The run that was to grade it was interrupted, or could not write the result.
    NotReached,
    /// Its files changed after it was planned.
    Changed,
    /// Its record was edited, or is not of this class.
    Altered,
}

/// Why a record does not count.
pub const ALTERED: &str = "its record was edited, or is not of this class";

impl Missing {
    /// Its verdict in the CSV file.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::NotReached => "interrupted",
            Self::Changed => "changed",
            Self::Altered => "altered",
        }
    }
}

/// A class that was graded.
pub struct Summary<'a> {
    /// Its rows, by name.
    pub rows: &'a [Row],
    /// The scenes without a usable oracle trace, with the reason.
    pub unjudged: &'a [(String, Fault)],
    /// The submissions without a result.
    pub gaps: &'a [Gap<'a>],
    /// Entries that are no submissions.
    pub passed_over: &'a [PassedOver],
    /// The protections that were in force whenever a program ran.
    pub protections: &'a [Protection],
    /// The common provenance of all submissions.
    pub provenance: &'a Provenance,
    /// Origin of the submissions, and gradebooks written, a line each.
    pub remarks: &'a [String],
}

/// Writes the summary as text.
///
/// # Errors
/// If writing fails.
pub fn write(out: &mut dyn Write, summary: &Summary<'_>) -> io::Result<()> {
    let Summary { rows, unjudged, gaps, passed_over, protections, provenance, remarks } = *summary;
    let names = [
        "submission",
        "required",
        "extra",
        "creative",
        "points",
        "not judged",
        "scenes",
        "hidden",
        "Jacobians",
        "verdict",
    ];
    let nothing = || "-".to_owned();
    let pair = |(part, all): (usize, usize)| format!("{part}/{all}");
    let of = |(part, all): (&str, &str)| format!("{part}/{all}");
    let mut cells = vec![header(&names, 1..9)];
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
            Cell::right(row.creative.as_ref().map_or_else(nothing, creative)),
            Cell::right(row.points.clone()),
            Cell::right(if has_unjudged(row) { row.not_judged.clone() } else { String::new() }),
            Cell::right(pair(row.scenes)),
            Cell::right(row.hidden.map_or_else(nothing, pair)),
            Cell::right(row.jacobians.map_or_else(nothing, pair)),
            Cell::left(row.verdict.replace('-', " ")).styled(style),
        ]);
    }
    if rows.iter().all(|row| row.hidden.is_none()) {
        cells.iter_mut().for_each(|row| drop(row.remove(7)));
    }
    if !rows.iter().any(has_unjudged) {
        cells.iter_mut().for_each(|row| drop(row.remove(5)));
    }
    if rows.iter().all(|row| row.creative.is_none()) {
        cells.iter_mut().for_each(|row| drop(row.remove(3)));
    }
    table::write(out, &cells)?;
    writeln!(out)?;
    for row in rows {
        if let Some(copied) = &row.copied {
            writeln!(out, "  {ODD}{}: {copied}.{ODD:#}", row.name)?;
        }
    }
    for row in rows {
        for (points, reason) in &row.adjustments {
            let sign = if points.starts_with('-') { "" } else { "+" };
            writeln!(out, "  adjusted: {}: {sign}{points} points: {reason}", row.name)?;
        }
    }
    for (scene, fault) in unjudged.iter().take(UNJUDGED_SHOWN) {
        writeln!(out, "  {ODD}not judged for any submission: {scene}: {fault}{ODD:#}")?;
    }
    if unjudged.len() > UNJUDGED_SHOWN {
        let more = unjudged.len() - UNJUDGED_SHOWN;
        writeln!(out, "  {ODD}nor {more} more scenes; `grade oracle verify` lists them{ODD:#}")?;
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
    if !gaps.is_empty() {
        let (done, total) = (rows.len(), rows.len() + gaps.len());
        writeln!(out, "  {ODD}Partial: interrupted, {done} of {total} submissions graded.{ODD:#}")?;
    }
    for Gap { name, missing } in gaps {
        let why = match missing {
            Missing::NotReached => continue,
            Missing::Changed => "changed after it was planned",
            Missing::Altered => ALTERED,
        };
        writeln!(out, "  {ODD}not graded: {name}: {why}{ODD:#}")?;
    }
    write_unprotected(out, protections)?;
    write_provenance(out, provenance)?;
    if rows.iter().any(|row| row.verdict == "passed-shipped") {
        writeln!(out, "  {ODD}Hidden scenes were not run: `passed shipped` excludes them.{ODD:#}")?;
    }
    for remark in remarks {
        writeln!(out, "  {remark}")?;
    }
    let refused = rows.iter().filter(|row| row.is_refused());
    let refused = refused.map(|row| format!("{}: {}", row.name, row.findings.join("; ")));
    let skipped = passed_over.iter();
    let skipped = skipped.map(|other| format!("skipped: {}: {}", other.name, other.reason));
    let open: Vec<String> = refused.chain(skipped).collect();
    if !open.is_empty() {
        writeln!(out, "\n{ODD}Not graded, for people to look at{ODD:#}")?;
    }
    for line in open {
        writeln!(out, "  {line}")?;
    }
    Ok(())
}

/// The summary as CSV, with a header line. Missing values are empty cells. Submissions without a result have the verdict
/// `interrupted`, `changed` or `altered`.
///
/// # Errors
/// Never in practice.
pub fn csv(rows: &[Row], gaps: &[Gap<'_>]) -> csv::Result<Vec<u8>> {
    let is_adjusted = rows.iter().any(|row| !row.adjustments.is_empty());
    let further = ADJUSTMENTS.iter().filter(|_| is_adjusted);
    let columns: Vec<&str> = COLUMNS.iter().chain(further).copied().collect();
    let mut table = InertCsv::new(&columns)?;
    for row in rows {
        let texts = |pair: Option<(usize, usize)>| {
            pair.map(|(part, all)| (part.to_string(), all.to_string())).unwrap_or_default()
        };
        let (scenes_passed, scenes) = texts(Some(row.scenes));
        let (hidden_passed, hidden) = texts(row.hidden);
        let (correct, jacobians) = texts(row.jacobians);
        // A missing value is an empty cell.
        let (creative, creative_of) = row.creative.clone().unwrap_or_default();
        let creative = if creative == NO_MARK { "" } else { &creative };
        let [granted, withdrawn, reasons] = adjustments(row);
        let cells = [
            row.name.as_str(),
            &row.verdict,
            &row.required.0,
            &row.required.1,
            &row.extra_credit.0,
            &row.extra_credit.1,
            &row.points,
            &row.not_judged,
            &scenes_passed,
            &scenes,
            &hidden_passed,
            &hidden,
            &correct,
            &jacobians,
            creative,
            &creative_of,
            &granted,
            &withdrawn,
            &reasons,
        ];
        table.row(&cells[..columns.len()])?;
    }
    for Gap { name, missing } in gaps {
        let mut record = vec![(*name).to_owned(), missing.name().to_owned()];
        record.resize(columns.len(), String::new());
        table.row(record)?;
    }
    table.bytes()
}

/// The cells of [`ADJUSTMENTS`]: no number begins with a sign, which spreadsheets could read as a formula.
fn adjustments(row: &Row) -> [String; 3] {
    let numbers = || row.adjustments.iter().filter_map(|(points, _)| points.parse::<f64>().ok());
    let sum = |sign: f64| match numbers().map(|points| (sign * points).max(0.0)).sum::<f64>() {
        0.0 => String::new(),
        sum => points::shown(sum),
    };
    let reasons: Vec<&str> = row.adjustments.iter().map(|(_, reason)| &**reason).collect();
    [sum(1.0), sum(-1.0), reasons.join("; ")]
}

#[cfg(test)]
mod tests {
    use grader::boundary::printed::inert;

    use super::*;

    /// A row of a submission with this name.
    fn row(name: &str) -> Row {
        let one = || ("1".to_owned(), "1".to_owned());
        Row {
            name: name.to_owned(),
            verdict: "passed".to_owned(),
            required: one(),
            extra_credit: one(),
            points: "2".to_owned(),
            earned: Some("2".to_owned()),
            not_judged: "0".to_owned(),
            scenes: (1, 1),
            hidden: None,
            jacobians: None,
            creative: None,
            adjustments: Vec::new(),
            features: Default::default(),
            copied: None,
            findings: Vec::new(),
        }
    }

    #[test]
    fn cells_are_never_formulas_for_any_separator() {
        let names = [
            "=1",
            "+1",
            "-1",
            "@a",
            " =1",
            "\t=1",
            "a;=1",
            "a; =1",
            "a,=1",
            "a\";=1",
            "\"=1",
            "a\n=1",
            "a\r+1",
            "'=1",
            "\"\";\"=1\"",
            "\u{a0}=1",
            ";;-1",
            "a\t@b",
            "＝1",
        ];
        for name in names {
            let csv = String::from_utf8(csv(&[row(name)], &[]).unwrap()).unwrap();
            let read = |separator: u8, quoting: bool| {
                let mut reader = csv::ReaderBuilder::new();
                reader.delimiter(separator).quoting(quoting).flexible(true).has_headers(false);
                let records = reader.from_reader(csv.as_bytes()).into_records();
                records
                    .flat_map(|record| {
                        record.unwrap().iter().map(str::to_owned).collect::<Vec<_>>()
                    })
                    .collect::<Vec<_>>()
            };
            for separator in [b',', b';', b'\t', b'|'] {
                for cell in [read(separator, true), read(separator, false)].concat() {
                    let cell = cell.trim().trim_start_matches('"').trim();
                    assert!(!cell.starts_with(['=', '+', '-', '@', '＝']), "{name:?}: {cell:?}");
                }
            }
            // A correct CSV reader finds one row of cells.
            assert_eq!(read(b',', true).len(), 2 * COLUMNS.len(), "{name:?}");
        }
        assert_eq!(inert("Ada Lovelace-King = 1"), "Ada Lovelace-King = 1");
    }
}
