//! Textures of surfaces: colours by texture coordinates.

use std::ops::Range;

use miniz_oxide::inflate::decompress_to_vec_zlib_with_limit;

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

    /// The picture in a PNG file of up to 8 bits a channel, not interlaced. Transparent pixels are mixed with white.
    ///
    /// # Errors
    /// A reason, if the bytes are no such file, or a picture of more than 2²⁶ pixels.
    pub fn from_png(bytes: &[u8]) -> Result<Self, &'static str> {
        let file = PngFile::read(bytes).ok_or("it is not a whole PNG file")?;
        let Header { width, height, depth, channels, .. } = file.header;
        if !file.header.is_supported() {
            return Err("only PNG files of up to 8 bits a channel, not interlaced, can be read");
        }
        if width.saturating_mul(height) > PIXELS {
            return Err("it has too many pixels");
        }
        let line = 1 + (width * channels * depth).div_ceil(8);
        let data = decompress_to_vec_zlib_with_limit(&file.data, line * height)
            .ok()
            .filter(|data| data.len() == line * height)
            .ok_or("its pixels cannot be decompressed")?;
        let mut pixels = Vec::with_capacity(width * height);
        let mut above = vec![0; line - 1];
        for row in data.chunks_exact(line) {
            let mut bytes = row[1..].to_vec();
            unfilter(row[0], &mut bytes, &above, (channels * depth).div_ceil(8));
            pixels.extend((0..width).map(|column| file.color(&bytes, column)));
            above = bytes;
        }
        Ok(Self { width, pixels })
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

/// The parts of a PNG file that its colours need (*Portable Network Graphics Specification*, third edition).
struct PngFile<'a> {
    header: Header,
    /// Red, green and blue of each number, three bytes each.
    palette: &'a [u8],
    /// The opacities of the first numbers of the palette.
    opacities: &'a [u8],
    /// The compressed pixels.
    data: Vec<u8>,
}

#[derive(Clone, Copy)]
struct Header {
    width: usize,
    height: usize,
    /// Bits of a channel.
    depth: usize,
    /// Channels of a pixel; a number of the palette is one.
    channels: usize,
    has_palette: bool,
    is_interlaced: bool,
}

impl Header {
    fn read(content: &[u8]) -> Option<Self> {
        let number = |place: Range<usize>| {
            Some(u32::from_be_bytes(content.get(place)?.try_into().ok()?) as usize)
        };
        let &[depth, color, _, _, interlace] = content.get(8..13)? else { return None };
        let channels = match color {
            0 | 3 => 1,
            2 => 3,
            4 => 2,
            6 => 4,
            _ => return None,
        };
        let [width, height] = [number(0..4)?, number(4..8)?];
        let (has_palette, is_interlaced) = (color == 3, interlace != 0);
        let header =
            Self { width, height, depth: depth.into(), channels, has_palette, is_interlaced };
        (width > 0 && height > 0).then_some(header)
    }

    fn is_supported(&self) -> bool {
        let depths: &[usize] = if self.channels == 1 { &[1, 2, 4, 8] } else { &[8] };
        depths.contains(&self.depth) && !self.is_interlaced
    }
}

impl<'a> PngFile<'a> {
    fn read(bytes: &'a [u8]) -> Option<Self> {
        let mut rest = bytes.strip_prefix(b"\x89PNG\r\n\x1a\n")?;
        let (mut header, mut palette, mut opacities) = (None, &[][..], &[][..]);
        let mut data = Vec::new();
        loop {
            let length = u32::from_be_bytes(rest.get(..4)?.try_into().ok()?) as usize;
            let content = rest.get(8..length.checked_add(8)?)?;
            match &rest[4..8] {
                b"IHDR" => header = Some(Header::read(content)?),
                b"PLTE" => palette = content,
                b"tRNS" => opacities = content,
                b"IDAT" => data.extend(content),
                b"IEND" => return Some(Self { header: header?, palette, opacities, data }),
                _ => {}
            }
            // A checksum follows.
            rest = rest.get(length + 12..)?;
        }
    }

    /// The colour of a pixel of a row.
    fn color(&self, row: &[u8], column: usize) -> [u8; 3] {
        let Header { depth, channels, has_palette, .. } = self.header;
        let over_white = |color: [u8; 3], opacity: u8| {
            color.map(|value| (255 - u16::from(255 - value) * u16::from(opacity) / 255) as u8)
        };
        if channels > 1 {
            return match row[column * channels..][..channels] {
                [grey, opacity] => over_white([grey; 3], opacity),
                [red, green, blue, opacity] => over_white([red, green, blue], opacity),
                [red, green, blue, ..] => [red, green, blue],
                _ => [0; 3],
            };
        }
        // Numbers of fewer than 8 bits stand in their bytes from the left.
        let bit = column * depth;
        let most = 0xff >> (8 - depth);
        let number = row[bit / 8] >> (8 - depth - bit % 8) & most;
        if !has_palette {
            return [(u16::from(number) * 255 / u16::from(most)) as u8; 3];
        }
        // A number beyond the palette is black.
        let entry = self.palette.get(3 * usize::from(number)..).unwrap_or_default();
        let color = entry.first_chunk().copied().unwrap_or_default();
        over_white(color, self.opacities.get(usize::from(number)).copied().unwrap_or(255))
    }
}

/// Replaces a filtered row by its bytes. `size` is the number of bytes of a pixel, at least 1.
fn unfilter(filter: u8, row: &mut [u8], above: &[u8], size: usize) {
    for at in 0..row.len() {
        let before = |bytes: &[u8]| at.checked_sub(size).map_or(0, |at| i16::from(bytes[at]));
        let (left, up, corner) = (before(row), i16::from(above[at]), before(above));
        let predicted = match filter {
            1 => left,
            2 => up,
            3 => (left + up) / 2,
            // Paeth: the one of the three that is nearest to left + up - corner.
            4 => {
                let [by_left, by_up] = [up - corner, left - corner];
                let by_corner = by_left + by_up;
                let nearest = by_left.abs().min(by_up.abs()).min(by_corner.abs());
                if by_left.abs() == nearest {
                    left
                } else if by_up.abs() == nearest {
                    up
                } else {
                    corner
                }
            }
            _ => 0,
        };
        row[at] = row[at].wrapping_add(predicted as u8);
    }
}

#[cfg(test)]
mod tests {
    use miniz_oxide::deflate::compress_to_vec_zlib;

    use super::*;
    use crate::canvas::Canvas;

    #[test]
    fn a_texture_is_upright_interpolates_and_repeats() {
        // Red above green, blue above black.
        let mut canvas = Canvas::new(2, 2, [0; 3]);
        canvas.paste(&Canvas::new(1, 1, [255, 0, 0]), [0, 0]);
        canvas.paste(&Canvas::new(1, 1, [0, 0, 255]), [1, 0]);
        canvas.paste(&Canvas::new(1, 1, [0, 255, 0]), [0, 1]);
        let texture = Texture::from_png(&canvas.png()).unwrap();
        assert_eq!(texture.color([0.25, 0.75]), [255.0, 0.0, 0.0]);
        assert_eq!(texture.color([0.75, 0.75]), [0.0, 0.0, 255.0]);
        assert_eq!(texture.color([0.25, 0.25]), [0.0, 255.0, 0.0]);
        assert_eq!(texture.color([0.5, 0.75]), [127.5, 0.0, 127.5]);
        assert_eq!(texture.color([-0.75, 7.75]), [255.0, 0.0, 0.0]);
        assert_eq!(Texture::plain([1, 2, 3]).color([0.3, -9.1]), [1.0, 2.0, 3.0]);
    }

    /// A PNG file with this header from its depth on, palette and rows.
    fn file(size: [u8; 2], kind: [u8; 5], palette: &[u8], rows: &[u8]) -> Vec<u8> {
        let header = [&[0, 0, 0, size[0], 0, 0, 0, size[1]], &kind[..]].concat();
        let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
        let data = compress_to_vec_zlib(rows, 6);
        // The pixels in two chunks.
        let (first, second) = data.split_at(4);
        for (name, content) in [
            (b"IHDR", &*header),
            (b"PLTE", palette),
            (b"IDAT", first),
            (b"IDAT", second),
            (b"IEND", &[]),
        ] {
            file.extend((content.len() as u32).to_be_bytes());
            file.extend(name);
            file.extend(content);
            file.extend([0; 4]);
        }
        file
    }

    /// Three equal rows by each filter, which predict the same bytes.
    #[test]
    fn all_filters_and_kinds_of_colours_are_read() {
        let rows = [
            [0, 10, 20, 30, 40, 50, 60],
            [1, 10, 20, 30, 30, 30, 30],
            [2, 0, 0, 0, 0, 0, 0],
            [3, 5, 10, 15, 15, 15, 15],
            [4, 0, 0, 0, 0, 0, 0],
        ];
        let texture =
            Texture::from_png(&file([2, 5], [8, 2, 0, 0, 0], &[], rows.as_flattened())).unwrap();
        assert_eq!(texture.pixels, [[10, 20, 30], [40, 50, 60]].repeat(5));
        let pixels = |kind, palette: &[u8], row: &[u8]| {
            Texture::from_png(&file([2, 1], kind, palette, row)).unwrap().pixels
        };
        assert_eq!(pixels([8, 0, 0, 0, 0], &[], &[0, 7, 9]), [[7; 3], [9; 3]]);
        assert_eq!(pixels([4, 0, 0, 0, 0], &[], &[0, 0x1f]), [[17; 3], [255; 3]]);
        assert_eq!(pixels([8, 4, 0, 0, 0], &[], &[0, 9, 255, 9, 0]), [[9; 3], [255; 3]]);
        let half = pixels([8, 6, 0, 0, 0], &[], &[0, 1, 2, 3, 255, 0, 0, 0, 51]);
        assert_eq!(half, [[1, 2, 3], [204; 3]]);
        let palette = [1, 2, 3, 4, 5, 6];
        assert_eq!(pixels([1, 3, 0, 0, 0], &palette, &[0, 0x40]), [[1, 2, 3], [4, 5, 6]]);
        for refused in [[16, 2, 0, 0, 0], [8, 2, 0, 0, 1], [3, 0, 0, 0, 0]] {
            let error = Texture::from_png(&file([2, 1], refused, &[], &[0; 13])).unwrap_err();
            assert!(error.starts_with("only PNG files of up to 8 bits"), "{error}");
        }
    }

    #[test]
    fn non_picture_bytes_are_refused() {
        let mut file = Canvas::new(3, 3, [9; 3]).png();
        assert!(Texture::from_png(b"flag.png").is_err());
        file.truncate(file.len() - 20);
        assert!(Texture::from_png(&file).is_err());
        // A header that asks for 2^31 pixels a side.
        let mut large = Canvas::new(1, 1, [0; 3]).png();
        large[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
        assert!(Texture::from_png(&large).is_err());
    }
}
