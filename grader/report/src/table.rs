//! Text tables with automatic column widths.

use std::io::{self, Write};

use anstyle::{AnsiColor, Style};

/// Style of headings.
pub const BOLD: Style = Style::new().bold();
/// Style of column names and remarks.
pub const DIM: Style = Style::new().dimmed();
/// Style of passed items.
pub const GOOD: Style = AnsiColor::Green.on_default();
/// Style of failed items.
pub const BAD: Style = AnsiColor::Red.on_default().bold();
/// Style of items that could not be judged.
pub const ODD: Style = AnsiColor::Yellow.on_default().bold();

/// Preferred maximum line width, in characters.
const WIDTH: usize = 80;

/// Indentation of cells that continue a row on the next line.
const CONTINUED: usize = 8;

/// One cell.
pub struct Cell {
    text: String,
    style: Style,
    right: bool,
}

impl Cell {
    /// A cell aligned to the left, for words.
    pub fn left(text: impl Into<String>) -> Self {
        Self { text: text.into(), style: Style::new(), right: false }
    }

    /// A cell aligned to the right, for numbers.
    pub fn right(text: impl Into<String>) -> Self {
        Self { right: true, ..Self::left(text) }
    }

    fn width(&self) -> usize {
        self.text.chars().count()
    }

    /// The same text in another style.
    pub fn styled(self, style: Style) -> Self {
        Self { style, ..self }
    }
}

/// A row of column names; columns in the range `numbers` are aligned to the right.
pub fn header(names: &[&str], numbers: std::ops::Range<usize>) -> Vec<Cell> {
    let cell = |(column, name): (usize, &&str)| {
        let cell = if numbers.contains(&column) { Cell::right(*name) } else { Cell::left(*name) };
        cell.styled(DIM)
    };
    names.iter().enumerate().map(cell).collect()
}

/// Writes a table, indented by two spaces; the first row holds the column names.
///
/// If the table is wider than `WIDTH`, the first column becomes headings: each of its values gets a separate line
/// above its rows. Cells that still do not fit continue on the next line.
pub fn write(out: &mut dyn Write, rows: &[Vec<Cell>]) -> io::Result<()> {
    lay_out(out, rows, 1)
}

/// The same without a row of column names.
pub fn write_unnamed(out: &mut dyn Write, rows: &[Vec<Cell>]) -> io::Result<()> {
    lay_out(out, rows, 0)
}

fn lay_out(out: &mut dyn Write, rows: &[Vec<Cell>], names: usize) -> io::Result<()> {
    let widths = widths(rows);
    if widths.iter().map(|width| width + 2).sum::<usize>() <= WIDTH {
        return rows.iter().try_for_each(|row| write_row(out, row, &widths, 0));
    }
    let mut heading = "";
    for (number, row) in rows.iter().enumerate() {
        let Some((first, rest)) = row.split_first() else { continue };
        if number >= names && !first.text.is_empty() && first.text != heading {
            heading = &first.text;
            writeln!(out, "  {}{heading}{:#}", first.style, first.style)?;
        }
        write_row(out, rest, &widths[1..], 2)?;
    }
    Ok(())
}

/// The width of each column.
fn widths(rows: &[Vec<Cell>]) -> Vec<usize> {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        let cells = rows.iter().filter_map(|row| row.get(column));
        cells.map(Cell::width).max().unwrap_or(0)
    };
    (0..columns).map(width).collect()
}

fn write_row(out: &mut dyn Write, row: &[Cell], widths: &[usize], indent: usize) -> io::Result<()> {
    // No trailing blanks.
    let end = row.iter().rposition(|cell| !cell.text.is_empty()).map_or(0, |last| last + 1);
    write!(out, "{:indent$}", "")?;
    let (mut position, mut blanks) = (indent, 0);
    for (number, (cell, width)) in row[..end].iter().zip(widths).enumerate() {
        let Cell { text, style, right } = cell;
        let space = width - cell.width();
        let (before, after) = if *right { (space, 0) } else { (0, space) };
        let before = 2 + blanks + before;
        if position + before + cell.width() > WIDTH && number > 0 {
            write!(out, "\n{:CONTINUED$}{style}{text}{style:#}", "")?;
            position = CONTINUED + cell.width();
        } else {
            write!(out, "{:before$}{style}{text}{style:#}", "")?;
            position += before + cell.width();
        }
        blanks = after;
    }
    writeln!(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(rows: &[&[&str]]) -> String {
        let row = |row: &&[&str]| row.iter().map(|text| Cell::left(*text)).collect();
        let mut out = Vec::new();
        write(&mut out, &rows.iter().map(row).collect::<Vec<_>>()).unwrap();
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn a_narrow_table_is_one_line_a_row() {
        let rows: [&[&str]; 3] = [&["force", "verdict"], &["drag", "correct"], &["drag", ""]];
        assert_eq!(text(&rows), "  force  verdict\n  drag   correct\n  drag\n");
    }

    #[test]
    fn a_wide_table_has_headings_and_continued_rows() {
        let [long, wide] = ["l".repeat(60), "w".repeat(15)];
        let rows: [&[&str]; 4] = [
            &["force", "block", "at"],
            &[&wide, &long, "here"],
            &[&wide, "b", &wide],
            &["drag", &long, &wide],
        ];
        let expected = format!(
            "    block{:57}at\n  {wide}\n    {long}  here\n    b\n        {wide}\n  drag\n    {long}\n        {wide}\n",
            ""
        );
        assert_eq!(text(&rows), expected);
    }
}
