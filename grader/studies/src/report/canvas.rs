//! Raster canvas: antialiased shapes and text, written as PNG.

use miniz_oxide::deflate::compress_to_vec_zlib;
use zeno::{Command, Mask, PathBuilder, Stroke, Style, Transform, Vector};

use super::font::Font;

/// Compression level of PNG files, from 0 to 10.
const LEVEL: u8 = 8;

/// A canvas of opaque white pixels. The origin is the top left corner; y points down.
pub(super) struct Canvas {
    width: u32,
    height: u32,
    /// Red, green and blue of each pixel, row by row.
    pixels: Vec<u8>,
    font: Font,
}

/// A colour with its opacity, from 0 to 1.
#[derive(Clone, Copy)]
pub(super) struct Paint {
    pub(super) rgb: [u8; 3],
    pub(super) opacity: f64,
}

/// Position of text.
#[derive(Clone, Copy)]
pub(super) struct TextPlacement {
    /// Anchor point on the canvas.
    pub(super) at: [f32; 2],
    /// Distance of the baseline below the anchor, in the direction of the text.
    pub(super) below: f32,
    /// Fraction of the text's width to the left of the anchor.
    pub(super) left: f32,
    /// Clockwise rotation about the anchor, in quarter turns.
    pub(super) quarters: u8,
}

impl TextPlacement {
    /// Converts a point of the text to canvas coordinates.
    fn on_canvas(self, x: f32, y: f32) -> Vector {
        let (x, y) = match self.quarters % 4 {
            0 => (x, y),
            1 => (-y, x),
            2 => (-x, -y),
            _ => (y, -x),
        };
        Vector::new(self.at[0] + x, self.at[1] + y)
    }
}

impl Canvas {
    /// An empty canvas of this size in pixels.
    ///
    /// # Errors
    /// If the built-in font cannot be read.
    pub(super) fn new(width: u32, height: u32) -> Result<Self, &'static str> {
        let pixels = vec![255; 3 * width as usize * height as usize];
        let font =
            Font::new(epaint_default_fonts::UBUNTU_LIGHT).ok_or("the built-in font is damaged")?;
        Ok(Self { width, height, pixels, font })
    }

    /// Fills a polygon; its edges may cross.
    pub(super) fn polygon(&mut self, corners: &[[f32; 2]], paint: Paint) {
        self.draw(&path(corners, true), Style::default(), 0.0, paint);
    }

    /// Draws a line through points, with mitred corners; a closed line returns to the first point.
    pub(super) fn line(&mut self, points: &[[f32; 2]], closed: bool, width: f32, paint: Paint) {
        self.draw(&path(points, closed), Stroke::new(width).into(), width, paint);
    }

    /// Fills a circle.
    pub(super) fn disc(&mut self, centre: [f32; 2], radius: f32, paint: Paint) {
        self.draw(&circle(centre, radius), Style::default(), 0.0, paint);
    }

    /// Draws the outline of a circle.
    pub(super) fn circle(&mut self, centre: [f32; 2], radius: f32, width: f32, paint: Paint) {
        self.draw(&circle(centre, radius), Stroke::new(width).into(), width, paint);
    }

    /// Draws a line of text of this size in pixels. Characters that the font lacks are drawn as its empty box.
    pub(super) fn text(&mut self, text: &str, size: f32, place: TextPlacement, paint: Paint) {
        let scale = size / f32::from(self.font.units);
        let glyphs: Vec<_> = text.chars().map(|character| self.font.glyph(character)).collect();
        let width = |glyph| f32::from(self.font.width(glyph)) * scale;
        let mut left = -place.left * glyphs.iter().copied().map(width).sum::<f32>();
        let mut path = Vec::new();
        for glyph in glyphs {
            let on_canvas = |x, y| place.on_canvas(left + x * scale, place.below - y * scale);
            // An unreadable glyph leaves a gap.
            let _ = self.font.outline(glyph, &mut path, &on_canvas);
            left += width(glyph);
        }
        self.draw(&path, Style::default(), 0.0, paint);
    }

    /// Fills a path, or strokes it with this width.
    fn draw(&mut self, path: &[Command], style: Style<'_>, width: f32, paint: Paint) {
        // A mitred corner extends up to 4 half widths beyond its point.
        let reach = 2.0 * width + 1.0;
        let mut low = [f32::INFINITY; 2];
        let mut high = [f32::NEG_INFINITY; 2];
        for point in path.iter().flat_map(points) {
            for (axis, value) in [point.x, point.y].into_iter().enumerate() {
                low[axis] = low[axis].min(value - reach);
                high[axis] = high[axis].max(value + reach);
            }
        }
        let within = |value: f32, size: u32| value.clamp(0.0, size as f32) as u32;
        let (left, top) = (within(low[0].floor(), self.width), within(low[1].floor(), self.height));
        let (right, bottom) =
            (within(high[0].ceil(), self.width), within(high[1].ceil(), self.height));
        if left >= right || top >= bottom {
            return;
        }
        let (columns, rows) = (right - left, bottom - top);
        let (covered, _) = Mask::new(path)
            .style(style)
            .transform(Some(Transform::translation(-(left as f32), -(top as f32))))
            .size(columns, rows)
            .render();
        for (row, covered) in covered.chunks_exact(columns as usize).enumerate() {
            let start = 3 * ((top as usize + row) * self.width as usize + left as usize);
            let pixels = self.pixels[start..].chunks_exact_mut(3);
            for (pixel, covered) in pixels.zip(covered) {
                let share = paint.opacity * f64::from(*covered) / 255.0;
                for (below, above) in pixel.iter_mut().zip(paint.rgb) {
                    let mixed = f64::from(*below) * (1.0 - share) + f64::from(above) * share;
                    *below = mixed.round() as u8;
                }
            }
        }
    }

    /// The picture as a PNG file.
    pub(super) fn png(&self) -> Vec<u8> {
        // Each row starts with the number of its filter: none.
        let rows = self.pixels.chunks_exact(3 * self.width as usize);
        let rows: Vec<u8> = rows.flat_map(|row| [&[0], row].concat()).collect();
        let mut header = [self.width.to_be_bytes(), self.height.to_be_bytes()].concat();
        // 8 bits per channel, RGB; the only compression and filter method; not interlaced.
        header.extend([8, 2, 0, 0, 0]);
        let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
        chunk(&mut file, b"IHDR", &header);
        chunk(&mut file, b"IDAT", &compress_to_vec_zlib(&rows, LEVEL));
        chunk(&mut file, b"IEND", &[]);
        file
    }
}

/// Appends a chunk of a PNG file: length, name, content, checksum of name and content.
fn chunk(file: &mut Vec<u8>, name: &[u8; 4], content: &[u8]) {
    file.extend((content.len() as u32).to_be_bytes());
    let start = file.len();
    file.extend(name);
    file.extend(content);
    let checksum = crc32(&file[start..]);
    file.extend(checksum.to_be_bytes());
}

/// CRC-32 as PNG defines it.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| {
            if crc & 1 == 1 { 0xedb8_8320 ^ (crc >> 1) } else { crc >> 1 }
        })
    })
}

fn path(points: &[[f32; 2]], closed: bool) -> Vec<Command> {
    let mut path: Vec<_> =
        points.iter().map(|[x, y]| Command::LineTo(Vector::new(*x, *y))).collect();
    if let Some(first) = points.first() {
        path[0] = Command::MoveTo(Vector::new(first[0], first[1]));
    }
    path.extend(closed.then_some(Command::Close));
    path
}

fn circle(centre: [f32; 2], radius: f32) -> Vec<Command> {
    let mut path = Vec::new();
    path.add_circle(centre, radius);
    path
}

/// The points of a path command.
fn points(command: &Command) -> impl Iterator<Item = Vector> + use<> {
    let named = match *command {
        Command::MoveTo(point) | Command::LineTo(point) => [Some(point), None, None],
        Command::QuadTo(control, point) => [Some(control), Some(point), None],
        Command::CurveTo(first, second, point) => [Some(first), Some(second), Some(point)],
        Command::Close => [None; 3],
    };
    named.into_iter().flatten()
}

#[cfg(test)]
mod tests {
    use miniz_oxide::inflate::decompress_to_vec_zlib;

    use super::*;

    const BLACK: Paint = Paint { rgb: [0; 3], opacity: 1.0 };

    /// Total amount of black on the canvas, in pixels.
    fn ink(canvas: &Canvas) -> f64 {
        canvas.pixels.iter().map(|value| 1.0 - f64::from(*value) / 255.0).sum::<f64>() / 3.0
    }

    #[test]
    fn shapes_cover_their_areas() {
        let drawn = |draw: &dyn Fn(&mut Canvas)| {
            let mut canvas = Canvas::new(40, 30).unwrap();
            draw(&mut canvas);
            ink(&canvas)
        };
        let square = [[2.5, 3.25], [12.5, 3.25], [12.5, 13.25], [2.5, 13.25]];
        let disc = drawn(&|canvas| canvas.disc([20.3, 14.8], 10.0, BLACK));
        let ring = drawn(&|canvas| canvas.circle([20.3, 14.8], 10.0, 2.0, BLACK));
        let filled = drawn(&|canvas| canvas.polygon(&square, BLACK));
        let frame = drawn(&|canvas| canvas.line(&square, true, 2.0, BLACK));
        // Three quarters of the disc are outside the canvas.
        let cut = drawn(&|canvas| canvas.disc([0.0, 0.0], 10.0, BLACK));
        let outside = drawn(&|canvas| canvas.disc([1e7, -1e7], 10.0, BLACK));
        let faint = drawn(&|canvas| canvas.polygon(&square, Paint { opacity: 0.5, ..BLACK }));
        for (area, expected) in [
            (disc, 314.2),
            (ring, 125.7),
            (filled, 100.0),
            (frame, 80.0),
            (cut, 78.5),
            (outside, 0.0),
            (faint, 50.0),
        ] {
            assert!((area - expected).abs() <= 0.02 * expected, "{area} {expected}");
        }
    }

    #[test]
    fn text_is_drawn_at_its_place_in_every_direction() {
        for (quarters, corner) in [(0, [25, 5]), (1, [25, 25]), (2, [5, 25]), (3, [5, 5])] {
            let mut canvas = Canvas::new(50, 50).unwrap();
            let place = TextPlacement { at: [25.0, 25.0], below: 0.0, left: 0.0, quarters };
            canvas.text("H", 20.0, place, BLACK);
            let mut turned = Canvas::new(50, 50).unwrap();
            turned.text("H", 20.0, TextPlacement { quarters: 0, ..place }, BLACK);
            assert!((ink(&canvas) - ink(&turned)).abs() < 0.5);
            let dark = |x: usize, y: usize| canvas.pixels[3 * (y * 50 + x)] < 128;
            let places = (0..2500).map(|place| (place % 50, place / 50));
            let inked: Vec<_> = places.filter(|(x, y)| dark(*x, *y)).collect();
            assert!(!inked.is_empty());
            let [left, top] = corner;
            let is_within = |(x, y): &(usize, usize)| {
                (left..left + 20).contains(x) && (top..top + 20).contains(y)
            };
            assert!(inked.iter().all(is_within), "{quarters}: {inked:?}");
        }
    }

    #[test]
    fn a_png_holds_the_pixels_that_were_drawn() {
        assert_eq!(crc32(b"IEND"), 0xae42_6082);
        let mut canvas = Canvas::new(7, 5).unwrap();
        canvas.disc([3.0, 2.0], 2.0, Paint { rgb: [200, 100, 0], opacity: 0.7 });
        let file = canvas.png();
        assert_eq!(file[16..24], [0, 0, 0, 7, 0, 0, 0, 5]);
        let length = u32::from_be_bytes(file[33..37].try_into().unwrap()) as usize;
        assert_eq!(&file[37..41], b"IDAT");
        let rows = decompress_to_vec_zlib(&file[41..41 + length]).unwrap();
        let stored: Vec<u8> = rows.chunks(22).flat_map(|row| row[1..].to_vec()).collect();
        assert_eq!(stored, canvas.pixels);
    }
}
