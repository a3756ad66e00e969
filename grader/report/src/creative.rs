//! Report on a creative scene, and its contact sheet.

use std::io::{self, Write};

use grader::creative::{Creative, Motion, Outcome};
use picture::canvas::Canvas;
use simulator::frames::Painter;
use simulator::scene::Scene;

use crate::table::{BAD, BOLD, GOOD, ODD};

/// Columns and rows of a contact sheet.
const SHEET: [u32; 2] = [4, 3];

/// Width and height of a picture of a contact sheet, in pixels.
const PICTURE: [u32; 2] = [400, 300];

/// Space around the pictures, in pixels.
const GAP: u32 = 8;

/// Writes the checks of a scene as text.
///
/// # Errors
/// If `out` takes no more.
pub fn write(out: &mut dyn Write, creative: &Creative) -> io::Result<()> {
    writeln!(out, "{BOLD}{}{BOLD:#}", creative.path.display())?;
    for check in &creative.checks {
        let style = match check.outcome {
            Outcome::Passed => GOOD,
            Outcome::Failed => BAD,
            Outcome::NotMade => ODD,
        };
        let word = check.outcome.word();
        let mut lines = check.found.lines();
        let first = lines.next().unwrap_or_default();
        writeln!(out, "  {:<9} {style}{word:<11}{style:#}  {first}", check.name)?;
        for line in lines {
            writeln!(out, "{:24}  {}", "", line.trim())?;
        }
    }
    Ok(())
}

/// Twelve pictures of a motion at equal intervals, row by row.
pub fn contact_sheet(scene: &Scene, motion: &Motion) -> Canvas {
    let [columns, rows] = SHEET;
    let side = |count: u32, length: u32| count * (length + GAP) + GAP;
    let size = [side(columns, PICTURE[0]), side(rows, PICTURE[1])];
    let mut sheet = Canvas::new(size[0], size[1], [255; 3]);
    let mut painter = Painter::new(scene, PICTURE, motion.bounds);
    let n_pictures = (columns * rows) as usize;
    let last = motion.times.len().saturating_sub(1);
    let mut picture = 0;
    for (frame, time) in motion.times.iter().enumerate() {
        let positions = motion.frame(frame);
        painter.follow(frame as u64, *time, positions);
        while picture < n_pictures && picture * last / (n_pictures - 1) <= frame {
            let [column, row] = [picture as u32 % columns, picture as u32 / columns];
            let at = [side(column, PICTURE[0]), side(row, PICTURE[1])];
            sheet.paste(&painter.draw(*time, positions).canvas(), at);
            picture += 1;
        }
    }
    sheet
}
