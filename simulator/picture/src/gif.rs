//! Animations as GIF: 256 colours a frame, the frames' own where they are so few.
//!
//! Colours beyond 256 are reduced to the nearest of 6 × 7 × 6 shades of red, green and blue.

use std::collections::BTreeMap;
use std::io::{self, Write};

use gif::{Encoder, Frame, Repeat};

/// Shades of red, green and blue.
const SHADES: [u32; 3] = [6, 7, 6];

/// Writes an animation, frame by frame.
pub struct GifWriter<W: Write> {
    encoder: Encoder<W>,
    size: [u16; 2],
    /// Frames a second.
    rate: f64,
    frames: u64,
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
        Ok(Self { encoder, size, rate, frames: 0 })
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
        let (palette, buffer) = indexed(pixels);
        let frame = Frame {
            width: self.size[0],
            height: self.size[1],
            delay: u16::try_from(delay).unwrap_or(u16::MAX),
            palette: Some(palette),
            buffer: buffer.into(),
            ..Frame::default()
        };
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

/// The palette of a frame, and the place of each pixel's colour in it.
fn indexed(pixels: &[u8]) -> (Vec<u8>, Vec<u8>) {
    let exact = palette(pixels.chunks_exact(3).map(|pixel| [pixel[0], pixel[1], pixel[2]]));
    let found = exact.or_else(|| {
        palette(pixels.chunks_exact(3).map(|pixel| reduced([pixel[0], pixel[1], pixel[2]])))
    });
    found.unwrap_or_default()
}

/// The colours in the order of their first pixel, and the place of each; `None` where there are more than 256.
fn palette(colors: impl Iterator<Item = [u8; 3]>) -> Option<(Vec<u8>, Vec<u8>)> {
    let mut known: BTreeMap<[u8; 3], u8> = BTreeMap::new();
    let (mut palette, mut places) = (Vec::new(), Vec::new());
    let mut last: Option<([u8; 3], u8)> = None;
    for color in colors {
        let place = match (last, known.get(&color)) {
            (Some((same, place)), _) if same == color => place,
            (_, Some(place)) => *place,
            (_, None) => {
                let place = u8::try_from(known.len()).ok()?;
                known.insert(color, place);
                palette.extend(color);
                place
            }
        };
        last = Some((color, place));
        places.push(place);
    }
    Some((palette, places))
}

/// The nearest of the shades.
fn reduced(color: [u8; 3]) -> [u8; 3] {
    let mut reduced = color;
    for (value, shades) in reduced.iter_mut().zip(SHADES) {
        let most = shades - 1;
        let shade = (u32::from(*value) * most + 127) / 255;
        *value = (shade * 255 / most) as u8;
    }
    reduced
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_colours_are_exact_and_many_are_reduced() {
        let (palette, places) = indexed(&[1, 2, 3, 9, 8, 7, 1, 2, 3]);
        assert_eq!((palette, places), (vec![1, 2, 3, 9, 8, 7], vec![0, 1, 0]));
        let many: Vec<u8> = (0..=255).flat_map(|k| [k, 255 - k, k / 2]).chain([3, 3, 3]).collect();
        let (palette, places) = indexed(&many);
        assert!(palette.len() <= 3 * 252 && places.len() == 257);
        assert_eq!(reduced([255, 0, 128]), [255, 0, 153]);
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
