//! Report on a creative scene, and its contact sheet.

use std::io::{self, Write};

use frames::Painter;
use grader::creative::{Creative, Motion, Outcome, Wanted};
use picture::canvas::Canvas;
use scene::Scene;

use crate::html::gallery::MotionData;
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
    writeln!(out, "{BOLD}{}{BOLD:#}", creative.path.line())?;
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

/// Whether bytes begin as a contact sheet of ours does: a PNG of its size.
pub fn is_contact_sheet(bytes: &[u8]) -> bool {
    let [width, height] = sheet_size().map(u32::to_be_bytes);
    let head = [&b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"[..], &width, &height].concat();
    bytes.starts_with(&head)
}

/// Width and height of a contact sheet, in pixels.
fn sheet_size() -> [u32; 2] {
    [0, 1].map(|axis| side(SHEET[axis], PICTURE[axis]))
}

/// The length of so many pictures and the space around them.
fn side(count: u32, length: u32) -> u32 {
    count * (length + GAP) + GAP
}

/// Twelve pictures of a motion at equal intervals, row by row.
fn contact_sheet(scene: &Scene, motion: &Motion) -> Canvas {
    let [columns, rows] = SHEET;
    let [width, height] = sheet_size();
    let mut sheet = Canvas::new(width, height, [255; 3]);
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

/// The picture of a scene that is wanted of the sandbox.
///
/// # Errors
/// Never in practice: the output is memory.
pub fn draw(wanted: Wanted, scene: &Scene, motion: &Motion) -> io::Result<Vec<u8>> {
    Ok(match wanted {
        Wanted::Nothing => Vec::new(),
        Wanted::Motion => serde_json::to_vec(&MotionData::of(scene, motion))?,
        Wanted::Sheet => contact_sheet(scene, motion).png()?,
    })
}
