//! Animations as GIF: 255 colours a frame, the frames' own where they are so few.
//!
//! More colours are reduced by median cut (Heckbert, *Color image quantization for frame buffer display*, 1982): the box
//! of colours with the longest side is split at the median of its pixels, until there are 255. A frame holds the
//! rectangle of the pixels that changed; those in it that did not are transparent.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::ops::Range;

use gif::{DisposalMethod, Encoder, Frame, Repeat};

/// Maximum number of colours of a frame.
const COLORS: usize = 255;

/// The number of transparent pixels.
const TRANSPARENT: u8 = 0;

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
        let part: Vec<_> = inside.map(|at| is_changed(at).then_some(color(at))).collect();
        let Indexed { palette, buffer } = Indexed::of(&part);
        let short = |length: usize| u16::try_from(length).unwrap_or(u16::MAX);
        let frame = Frame {
            left: short(columns.start),
            top: short(rows.start),
            width: short(columns.len()),
            height: short(rows.len()),
            delay: u16::try_from(delay).unwrap_or(u16::MAX),
            dispose: DisposalMethod::Keep,
            transparent: Some(TRANSPARENT),
            palette: Some(palette),
            buffer: buffer.into(),
            ..Frame::default()
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

/// A picture of at most 255 colours.
struct Indexed {
    /// Red, green and blue of each colour; the first is that of transparent pixels.
    palette: Vec<u8>,
    /// The number of each pixel's colour.
    buffer: Vec<u8>,
}

impl Indexed {
    /// The picture with these colours; `None` is transparent.
    fn of(pixels: &[Option<[u8; 3]>]) -> Self {
        let mut counts: BTreeMap<[u8; 3], u64> = BTreeMap::new();
        for color in pixels.iter().flatten() {
            *counts.entry(*color).or_default() += 1;
        }
        let mut indexed = Self { palette: vec![0; 3], buffer: Vec::new() };
        let mut numbers: BTreeMap<[u8; 3], u8> = BTreeMap::new();
        for (number, part) in (1..=u8::MAX).zip(median_cut(counts.into_iter().collect())) {
            indexed.palette.extend(mean(&part));
            numbers.extend(part.into_iter().map(|(color, _)| (color, number)));
        }
        let number = |pixel: &Option<[u8; 3]>| pixel.map_or(TRANSPARENT, |color| numbers[&color]);
        indexed.buffer = pixels.iter().map(number).collect();
        indexed
    }
}

/// Colours with their numbers of pixels.
type Colors = Vec<([u8; 3], u64)>;

/// Divides colours into at most 255 boxes.
fn median_cut(colors: Colors) -> Vec<Colors> {
    let mut boxes = vec![(longest_side(&colors), colors)];
    while boxes.len() < COLORS {
        let widest = boxes.iter().enumerate().max_by_key(|(number, ((length, _), _))| {
            // The first of equals.
            (*length, usize::MAX - number)
        });
        let Some((number, ((1.., axis), _))) = widest else { break };
        let axis = *axis;
        let (_, mut colors) = boxes.swap_remove(number);
        colors.sort_by_key(|(color, _)| (color[axis], *color));
        let half = colors.iter().map(|(_, count)| count).sum::<u64>() / 2;
        let mut below = 0;
        let middle = colors.iter().position(|(_, count)| {
            below += count;
            below > half
        });
        // Neither part is empty.
        let middle = middle.unwrap_or(0).clamp(1, colors.len() - 1);
        let upper = colors.split_off(middle);
        boxes.extend([colors, upper].map(|part| (longest_side(&part), part)));
    }
    boxes.into_iter().map(|(_, colors)| colors).filter(|colors| !colors.is_empty()).collect()
}

/// The length of the longest side of the box around these colours, and its axis.
fn longest_side(colors: &Colors) -> (u8, usize) {
    let side = |axis: usize| {
        let values = || colors.iter().map(|(color, _)| color[axis]);
        (values().max().unwrap_or(0) - values().min().unwrap_or(0), axis)
    };
    (0..3).map(side).max_by_key(|(length, axis)| (*length, 3 - axis)).unwrap_or_default()
}

/// The mean of some colours.
fn mean(colors: &Colors) -> [u8; 3] {
    let total: u64 = colors.iter().map(|(_, count)| count).sum();
    [0, 1, 2].map(|axis| {
        let sum: u64 = colors.iter().map(|(color, count)| u64::from(color[axis]) * count).sum();
        ((sum + total / 2) / total) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_colours_are_exact_and_many_approximate() {
        let few = [Some([1, 2, 3]), None, Some([9, 8, 7]), Some([1, 2, 3])];
        let Indexed { palette, buffer } = Indexed::of(&few);
        let shown = |palette: &[u8], number: u8| palette[3 * usize::from(number)..][..3].to_vec();
        assert_eq!((buffer[1], palette.len()), (TRANSPARENT, 9));
        assert_eq!(shown(&palette, buffer[0]), [1, 2, 3]);
        assert_eq!(shown(&palette, buffer[2]), [9, 8, 7]);
        // A gradient of 4,096 colours, in 255.
        let many: Vec<_> =
            (0..4096_u32).map(|k| Some([(k / 16) as u8, (k % 16) as u8, 77])).collect();
        let Indexed { palette, buffer } = Indexed::of(&many);
        assert_eq!(palette.len(), 3 * 256);
        for (color, number) in many.iter().flatten().zip(buffer) {
            assert_ne!(number, TRANSPARENT);
            for (a, b) in color.iter().zip(shown(&palette, number)) {
                assert!(a.abs_diff(b) <= 8, "{color:?} {a} {b}");
            }
        }
    }

    /// Frames of moving, resting and many-coloured pixels, put over each other as a player does.
    #[test]
    fn a_player_shows_the_frames() {
        let size = [9, 7];
        let n_pixels = 63;
        let mut frames = vec![vec![10; 3 * n_pixels]; 4];
        frames[1][3 * 30..3 * 33].copy_from_slice(&[1, 2, 3, 10, 10, 10, 7, 8, 9]);
        frames[2] = frames[1].clone();
        frames[3][3 * 62..].copy_from_slice(&[0, 0, 0]);
        let mut writer = GifWriter::new(Vec::new(), size, 24.0).unwrap();
        for frame in &frames {
            writer.write(frame).unwrap();
        }
        let bytes = writer.into_inner().unwrap();
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let mut decoder = options.read_info(&*bytes).unwrap();
        let mut shown = vec![0; 3 * n_pixels];
        let mut n_stored = Vec::new();
        for expected in &frames {
            let frame = decoder.read_next_frame().unwrap().unwrap();
            n_stored.push(usize::from(frame.width) * usize::from(frame.height));
            for (at, pixel) in frame.buffer.chunks_exact(4).enumerate().filter(|(_, p)| p[3] > 0) {
                let (row, column) = (at / usize::from(frame.width), at % usize::from(frame.width));
                let (row, column) =
                    (row + usize::from(frame.top), column + usize::from(frame.left));
                shown[3 * (9 * row + column)..][..3].copy_from_slice(&pixel[..3]);
            }
            assert_eq!(shown, *expected);
        }
        assert_eq!(n_stored[..3], [63, 3, 1]);
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
