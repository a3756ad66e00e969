//! Animations as GIF: at most 256 colours a frame, the frame's own if it has no more.
//!
//! NeuQuant (Dekker, *Kohonen neural networks for optimal colour quantization*, 1994) reduces more colours. A frame holds
//! the rectangle of the pixels that changed; those in it that did not are transparent.

use std::io::{self, Write};
use std::ops::Range;

use gif::{DisposalMethod, Encoder, Frame, Repeat};

/// Writes an animation, frame by frame.
pub struct GifWriter<W: Write> {
    encoder: Encoder<W>,
    size: [u16; 2],
    /// Frames a second.
    rate: f64,
    frames: u64,
    /// The pixels of the last frame; empty before the first.
    last: Vec<u8>,
}

impl<W: Write> GifWriter<W> {
    /// Starts an animation of this size that repeats for ever.
    ///
    /// # Errors
    /// If the output takes nothing, or a side has more than 65,535 pixels.
    pub fn new(output: W, [width, height]: [u32; 2], rate: f64) -> io::Result<Self> {
        let side = |length: u32| {
            u16::try_from(length)
                .map_err(|_| io::Error::other("a GIF has at most 65,535 pixels a side"))
        };
        let size = [side(width)?, side(height)?];
        let mut encoder = Encoder::new(output, size[0], size[1], &[]).map_err(io::Error::other)?;
        encoder.set_repeat(Repeat::Infinite).map_err(io::Error::other)?;
        Ok(Self { encoder, size, rate, frames: 0, last: Vec::new() })
    }

    /// Writes a frame: red, green and blue of each pixel, row by row.
    ///
    /// # Errors
    /// If the output takes no more.
    pub fn write(&mut self, pixels: &[u8]) -> io::Result<()> {
        // Delays are hundredths of a second: rounded so that their sum keeps the rate.
        let at = |frame: u64| (frame as f64 * 100.0 / self.rate).round() as u64;
        let delay = at(self.frames + 1) - at(self.frames);
        self.frames += 1;
        let [width, height] = self.size.map(usize::from);
        let color = |at: usize| [pixels[3 * at], pixels[3 * at + 1], pixels[3 * at + 2]];
        let is_changed = |at: usize| self.last.get(3 * at..3 * at + 3) != Some(&color(at));
        let [columns, rows] = changed([width, height], is_changed);
        let inside =
            rows.clone().flat_map(|row| columns.clone().map(move |column| row * width + column));
        let pixel = |at: usize| match (is_changed(at), color(at)) {
            (true, [red, green, blue]) => [red, green, blue, 255],
            (false, _) => [0; 4],
        };
        let mut part: Vec<u8> = inside.flat_map(pixel).collect();
        let short = |length: usize| u16::try_from(length).unwrap_or(u16::MAX);
        let (part_width, part_height) = (short(columns.len()), short(rows.len()));
        let frame = Frame {
            left: short(columns.start),
            top: short(rows.start),
            delay: u16::try_from(delay).unwrap_or(u16::MAX),
            dispose: DisposalMethod::Keep,
            ..Frame::from_rgba(part_width, part_height, &mut part)
        };
        self.last.clear();
        self.last.extend_from_slice(pixels);
        self.encoder.write_frame(&frame).map_err(io::Error::other)
    }

    /// Ends the animation and returns the output.
    ///
    /// # Errors
    /// If the output takes no more.
    pub fn into_inner(self) -> io::Result<W> {
        self.encoder.into_inner().map_err(io::Error::other)
    }
}

/// The smallest box around the pixels that changed, as columns and rows: the first pixel if none did.
fn changed([width, height]: [usize; 2], is_changed: impl Fn(usize) -> bool) -> [Range<usize>; 2] {
    let mut columns = width..0;
    let mut rows = height..0;
    for at in (0..width * height).filter(|at| is_changed(*at)) {
        let (row, column) = (at / width, at % width);
        columns = columns.start.min(column)..columns.end.max(column + 1);
        rows = rows.start.min(row)..row + 1;
    }
    if rows.is_empty() { [0..1, 0..1] } else { [columns, rows] }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Shows an animation as a player does: the pixels after each frame, and how many pixels each frame stores.
    fn played(bytes: &[u8], width: usize, n_pixels: usize) -> Vec<(Vec<u8>, usize)> {
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let mut decoder = options.read_info(bytes).unwrap();
        let mut shown = vec![0; 3 * n_pixels];
        let mut frames = Vec::new();
        while let Some(frame) = decoder.read_next_frame().unwrap() {
            for (at, pixel) in frame.buffer.chunks_exact(4).enumerate().filter(|(_, p)| p[3] > 0) {
                let (row, column) = (at / usize::from(frame.width), at % usize::from(frame.width));
                let at = width * (row + usize::from(frame.top)) + column + usize::from(frame.left);
                shown[3 * at..][..3].copy_from_slice(&pixel[..3]);
            }
            frames.push((shown.clone(), frame.buffer.len() / 4));
        }
        frames
    }

    #[test]
    fn frames_store_what_changed_and_show_few_colours_exactly() {
        let mut frames = vec![vec![10; 3 * 63]; 4];
        frames[1][3 * 30..3 * 33].copy_from_slice(&[1, 2, 3, 10, 10, 10, 7, 8, 9]);
        frames[2] = frames[1].clone();
        frames[3][3 * 62..].copy_from_slice(&[0, 0, 0]);
        let mut writer = GifWriter::new(Vec::new(), [9, 7], 24.0).unwrap();
        for frame in &frames {
            writer.write(frame).unwrap();
        }
        let played = played(&writer.into_inner().unwrap(), 9, 63);
        for ((shown, _), expected) in played.iter().zip(&frames) {
            assert_eq!(shown, expected);
        }
        let n_stored: Vec<usize> = played.iter().map(|(_, stored)| *stored).collect();
        assert_eq!(n_stored[..3], [63, 3, 1]);
    }

    #[test]
    fn many_colours_are_near() {
        let pixels: Vec<u8> =
            (0..4096_u32).flat_map(|k| [(k / 16) as u8, (k % 16) as u8, 77]).collect();
        let mut writer = GifWriter::new(Vec::new(), [64, 64], 24.0).unwrap();
        writer.write(&pixels).unwrap();
        let played = played(&writer.into_inner().unwrap(), 64, 4096);
        for (shown, expected) in played[0].0.iter().zip(&pixels) {
            assert!(shown.abs_diff(*expected) <= 8, "{expected} {shown}");
        }
    }

    #[test]
    fn delays_keep_the_rate() {
        let mut writer = GifWriter::new(Vec::new(), [1, 1], 24.0).unwrap();
        for _ in 0..24 {
            writer.write(&[0, 0, 0]).unwrap();
        }
        let bytes = writer.into_inner().unwrap();
        let mut decoder = gif::DecodeOptions::new().read_info(&*bytes).unwrap();
        let mut total = 0;
        while let Some(frame) = decoder.read_next_frame().unwrap() {
            total += frame.delay;
        }
        assert_eq!(total, 100);
    }
}
