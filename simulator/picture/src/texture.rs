//! Textures of surfaces: colours by texture coordinates.

use std::io;

use png::{Decoder, Limits, Transformations};

/// Most pixels of a texture.
pub const PIXELS: usize = 1 << 26;

/// A picture that covers a surface. Texture coordinates are (0, 0) at its lower left corner and (1, 1) at its upper right
/// one; beyond, it repeats.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    width: usize,
    /// Red, green and blue of each pixel, from 0 to 255, row by row from the top.
    pixels: Vec<[u8; 3]>,
}

impl Texture {
    /// A texture of one colour.
    pub fn plain(rgb: [u8; 3]) -> Self {
        Self { width: 1, pixels: vec![rgb] }
    }

    /// The picture in a PNG file. Transparent pixels are mixed with white.
    ///
    /// # Errors
    /// If the bytes are no such file, or a picture of more than 2²⁶ pixels.
    pub fn from_png(bytes: &[u8]) -> io::Result<Self> {
        let mut decoder = Decoder::new(io::Cursor::new(bytes));
        decoder.set_limits(Limits { bytes: 8 * PIXELS });
        decoder.set_transformations(Transformations::normalize_to_color8());
        let mut reader = decoder.read_info()?;
        let (width, height) = (reader.info().width as usize, reader.info().height as usize);
        if width.saturating_mul(height) > PIXELS {
            return Err(io::Error::other("it has too many pixels"));
        }
        let mut pixels = vec![0; reader.output_buffer_size().unwrap_or_default()];
        let channels = reader.next_frame(&mut pixels)?.color_type.samples();
        let over_white = |value: u8, opacity: u8| {
            (255 - u16::from(255 - value) * u16::from(opacity) / 255) as u8
        };
        let color = |pixel: &[u8]| match *pixel {
            [grey] => [grey; 3],
            [grey, opacity] => [over_white(grey, opacity); 3],
            [red, green, blue, opacity] => {
                [red, green, blue].map(|value| over_white(value, opacity))
            }
            _ => [0, 1, 2].map(|channel| pixel[channel]),
        };
        Ok(Self { width, pixels: pixels.chunks_exact(channels).map(color).collect() })
    }

    /// Its number of pixels.
    pub fn count(&self) -> usize {
        self.pixels.len()
    }

    /// The same texture, each channel multiplied by a factor from 0 to 1.
    pub fn tinted(&self, factors: [f64; 3]) -> Self {
        let tables = factors.map(|factor| -> Vec<u8> {
            (0..=255).map(|value| (f64::from(value) * factor).round() as u8).collect()
        });
        let tint =
            |pixel: &[u8; 3]| [0, 1, 2].map(|channel| tables[channel][usize::from(pixel[channel])]);
        Self { width: self.width, pixels: self.pixels.iter().map(tint).collect() }
    }

    /// The colour at texture coordinates: red, green and blue from 0 to 255, interpolated between the nearest four pixels.
    pub fn color(&self, [u, v]: [f64; 2]) -> [f64; 3] {
        let (width, height) = (self.width, self.pixels.len() / self.width);
        let axes = [(u, width), (1.0 - v, height)];
        // Pixel centres lie at halves. The edges of the picture do not mix.
        let [(left, right, across), (top, bottom, down)] = axes.map(|(at, size)| {
            let at = if (0.0..=1.0).contains(&at) { at } else { at.rem_euclid(1.0) };
            let at = (at * size as f64 - 0.5).clamp(0.0, (size - 1) as f64);
            let first = at as usize;
            (first, (first + 1).min(size - 1), at - first as f64)
        });
        let mix = |a: f64, b: f64, share: f64| a + (b - a) * share;
        [0, 1, 2].map(|channel| {
            let at =
                |row: usize, column: usize| f64::from(self.pixels[row * width + column][channel]);
            let [above, below] =
                [top, bottom].map(|row| mix(at(row, left), at(row, right), across));
            mix(above, below, down)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canvas::Canvas;

    #[test]
    fn a_texture_is_upright_interpolates_and_repeats() {
        // Red above green, blue above black.
        let mut canvas = Canvas::new(2, 2, [0; 3]);
        canvas.paste(&Canvas::new(1, 1, [255, 0, 0]), [0, 0]);
        canvas.paste(&Canvas::new(1, 1, [0, 0, 255]), [1, 0]);
        canvas.paste(&Canvas::new(1, 1, [0, 255, 0]), [0, 1]);
        let texture = Texture::from_png(&canvas.png().unwrap()).unwrap();
        assert_eq!(texture.color([0.25, 0.75]), [255.0, 0.0, 0.0]);
        assert_eq!(texture.color([0.75, 0.75]), [0.0, 0.0, 255.0]);
        assert_eq!(texture.color([0.25, 0.25]), [0.0, 255.0, 0.0]);
        assert_eq!(texture.color([0.5, 0.75]), [127.5, 0.0, 127.5]);
        assert_eq!(texture.color([-0.75, 7.75]), [255.0, 0.0, 0.0]);
        assert_eq!(Texture::plain([1, 2, 3]).color([0.3, -9.1]), [1.0, 2.0, 3.0]);
    }

    #[test]
    fn all_kinds_of_colours_are_read() {
        use png::BitDepth::{Eight, One, Sixteen};
        use png::ColorType::{Grayscale, GrayscaleAlpha, Indexed, Rgb, Rgba};
        for (color, depth, row, expected) in [
            (Rgb, Eight, &[1, 2, 3, 4, 5, 6][..], [[1, 2, 3], [4, 5, 6]]),
            (Rgb, Sixteen, &[1, 9, 2, 9, 3, 9, 4, 9, 5, 9, 6, 9], [[1, 2, 3], [4, 5, 6]]),
            (Grayscale, Eight, &[7, 9], [[7; 3], [9; 3]]),
            (Grayscale, One, &[0x40], [[0; 3], [255; 3]]),
            (GrayscaleAlpha, Eight, &[9, 255, 9, 0], [[9; 3], [255; 3]]),
            (Rgba, Eight, &[1, 2, 3, 255, 0, 0, 0, 51], [[1, 2, 3], [204; 3]]),
            (Indexed, One, &[0x40], [[1, 2, 3], [255; 3]]),
        ] {
            let mut file = Vec::new();
            let mut encoder = png::Encoder::new(&mut file, 2, 1);
            encoder.set_color(color);
            encoder.set_depth(depth);
            if color == Indexed {
                encoder.set_palette(&[1, 2, 3, 4, 5, 6][..]);
                encoder.set_trns(&[255, 0][..]);
            }
            let mut writer = encoder.write_header().unwrap();
            writer.write_image_data(row).unwrap();
            writer.finish().unwrap();
            assert_eq!(Texture::from_png(&file).unwrap().pixels, expected, "{color:?} {depth:?}");
        }
    }

    #[test]
    fn non_picture_bytes_are_refused() {
        let mut file = Canvas::new(3, 3, [9; 3]).png().unwrap();
        assert!(Texture::from_png(b"flag.png").is_err());
        file.truncate(file.len() - 20);
        assert!(Texture::from_png(&file).is_err());
        let mut large = Vec::new();
        let mut writer = png::Encoder::new(&mut large, 1 << 14, 1 << 13).write_header().unwrap();
        writer.write_chunk(png::chunk::IDAT, &[]).unwrap();
        drop(writer);
        assert_eq!(Texture::from_png(&large).unwrap_err().to_string(), "it has too many pixels");
    }
}
