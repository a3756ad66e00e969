//! Columns of text, as wide as they need to be.

use std::io::{self, Write};

use anstyle::Style;

/// One cell.
pub(super) struct Cell {
    text: String,
    style: Style,
    right: bool,
}

impl Cell {
    /// Words, flush left.
    pub(super) fn left(text: impl Into<String>) -> Self {
        Self { text: text.into(), style: Style::new(), right: false }
    }

    /// Numbers, flush right.
    pub(super) fn right(text: impl Into<String>) -> Self {
        Self { right: true, ..Self::left(text) }
    }

    pub(super) fn styled(self, style: Style) -> Self {
        Self { style, ..self }
    }
}

/// Writes rows of cells below each other, each line indented by two spaces.
pub(super) fn write(out: &mut dyn Write, rows: &[Vec<Cell>]) -> io::Result<()> {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        let cells = rows.iter().filter_map(|row| row.get(column));
        cells.map(|cell| cell.text.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    for row in rows {
        // No blanks at the end of a line.
        let end = row.iter().rposition(|cell| !cell.text.is_empty()).map_or(0, |last| last + 1);
        let cells = row[..end].iter().zip(&widths);
        for (column, (Cell { text, style, right }, width)) in cells.enumerate() {
            let space = " ".repeat(width - text.chars().count());
            let (before, after) = if *right { (space.as_str(), "") } else { ("", space.as_str()) };
            let after = if column + 1 == end { "" } else { after };
            write!(out, "  {before}{style}{text}{style:#}{after}")?;
        }
        writeln!(out)?;
    }
    Ok(())
}
