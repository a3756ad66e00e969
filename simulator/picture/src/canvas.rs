//! Raster canvas: antialiased shapes, written as PNG.

use std::io;

use zeno::{Cap, Command, Mask, PathBuilder, Stroke, Style, Transform};

use crate::texture::Texture;

/// A canvas of opaque pixels. The origin is the top left corner; y points down.
pub struct Canvas {
    width: u32,
    height: u32,
    /// Red, green and blue of each pixel, row by row.
    pixels: Vec<u8>,
}

/// A colour with its opacity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Paint {
    /// Red, green and blue.
    pub rgb: [u8; 3],
    /// From 0 to 1.
    pub opacity: f64,
}

/// A corner of a triangle in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Its place on the canvas.
    pub at: [f32; 2],
    /// Its factor of perspective.
    pub scale: f64,
    /// Its texture coordinates.
    pub texture: [f64; 2],
    /// Its share of the texture's colour.
    pub gain: f64,
    /// The colour that is added to it: red, green and blue from 0 to 255.
    pub add: [f64; 3],
}

/// The colour of a triangle at a point: red, green and blue from 0 to 255. `shares` are the barycentric coordinates of the
/// point on the canvas.
pub fn color(corners: &[Corner; 3], shares: [f64; 3], texture: &Texture) -> [f64; 3] {
    // On the canvas, what is linear in space is linear only after multiplication with the scale.
    let weights: [f64; 3] = [0, 1, 2].map(|corner| shares[corner].max(0.0) * corners[corner].scale);
    let total: f64 = weights.iter().sum();
    let mean = |of: &dyn Fn(&Corner) -> f64| {
        let parts = corners.iter().zip(weights).map(|(corner, weight)| weight * of(corner));
        parts.sum::<f64>() / total
    };
    let texel = texture.color([0, 1].map(|axis| mean(&|corner| corner.texture[axis])));
    let gain = mean(&|corner| corner.gain);
    [0, 1, 2].map(|channel| {
        (gain * texel[channel] + mean(&|corner| corner.add[channel])).clamp(0.0, 255.0)
    })
}

impl Canvas {
    /// A canvas of this size in pixels, filled with a colour: red, green and blue.
    pub fn new(width: u32, height: u32, background: [u8; 3]) -> Self {
        let pixels = background.repeat(width as usize * height as usize);
        Self { width, height, pixels }
    }

    /// Red, green and blue of each pixel, row by row.
    pub fn pixels(&self) -> &[u8] {
        &self.pixels
    }

    /// Fills a circle.
    pub fn disc(&mut self, centre: [f32; 2], radius: f32, paint: Paint) {
        let mut path: Vec<Command> = Vec::new();
        path.add_circle(centre, radius);
        self.draw(&path, Style::default(), &[centre], radius + 1.0, paint);
    }

    /// Draws a line with round ends.
    pub fn round_line(&mut self, ends: [[f32; 2]; 2], width: f32, paint: Paint) {
        let mut path: Vec<Command> = Vec::new();
        path.move_to(ends[0]).line_to(ends[1]);
        let mut stroke = Stroke::new(width);
        stroke.cap(Cap::Round);
        self.draw(&path, stroke.into(), &ends, 2.0 * width + 1.0, paint);
    }

    /// Fills a triangle with a texture. Its edges reach half a pixel outwards, so that neighbours leave no gap.
    pub fn triangle(&mut self, corners: &[Corner; 3], texture: &Texture) {
        let at = corners.map(|corner| corner.at.map(f64::from));
        let cross = |[a, b, c]: [[f64; 2]; 3]| {
            (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        };
        let area = cross(at);
        if area == 0.0 || !area.is_finite() {
            return;
        }
        // Height above each edge, by the corner opposite to it.
        let heights = [(1, 2), (2, 0), (0, 1)].map(|(from, to): (usize, usize)| {
            area.abs() / (at[to][0] - at[from][0]).hypot(at[to][1] - at[from][1])
        });
        let range = |axis: usize, size: u32| {
            let of =
                |limit: fn(f64, f64) -> f64| limit(limit(at[0][axis], at[1][axis]), at[2][axis]);
            let within = |value: f64| value.clamp(0.0, f64::from(size)) as u32;
            within((of(f64::min) - 1.0).floor())..within((of(f64::max) + 1.0).ceil())
        };
        for row in range(1, self.height) {
            for column in range(0, self.width) {
                let here = [f64::from(column) + 0.5, f64::from(row) + 0.5];
                let shares = [[here, at[1], at[2]], [at[0], here, at[2]], [at[0], at[1], here]]
                    .map(|corners| cross(corners) / area);
                let distances = shares.iter().zip(heights).map(|(share, height)| share * height);
                let covered = (distances.fold(f64::INFINITY, f64::min) + 1.0).clamp(0.0, 1.0);
                if covered > 0.0 {
                    let color = color(corners, shares, texture);
                    let start = 3 * (row as usize * self.width as usize + column as usize);
                    for (below, above) in self.pixels[start..start + 3].iter_mut().zip(color) {
                        let mixed = f64::from(*below) * (1.0 - covered) + above * covered;
                        *below = mixed.round() as u8;
                    }
                }
            }
        }
    }

    /// Covers what the path covers, which lies within `reach` of the points.
    fn draw(
        &mut self,
        path: &[Command],
        style: Style<'_>,
        points: &[[f32; 2]],
        reach: f32,
        paint: Paint,
    ) {
        let mut low = [f32::INFINITY; 2];
        let mut high = [f32::NEG_INFINITY; 2];
        for point in points {
            for axis in 0..2 {
                low[axis] = low[axis].min(point[axis] - reach);
                high[axis] = high[axis].max(point[axis] + reach);
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

    /// Covers a part of the canvas with another canvas, whose top left corner comes to `[x, y]`. Pixels beyond
    /// the edges are left out.
    pub fn paste(&mut self, other: &Self, [x, y]: [u32; 2]) {
        let columns = other.width.min(self.width.saturating_sub(x)) as usize;
        let rows = other.height.min(self.height.saturating_sub(y)) as usize;
        for row in 0..rows {
            let from = 3 * row * other.width as usize;
            let to = 3 * ((y as usize + row) * self.width as usize + x as usize);
            self.pixels[to..to + 3 * columns]
                .copy_from_slice(&other.pixels[from..from + 3 * columns]);
        }
    }

    /// The picture as a PNG file.
    ///
    /// # Errors
    /// If the picture has no pixels.
    pub fn png(&self) -> io::Result<Vec<u8>> {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, self.width, self.height);
        encoder.set_color(png::ColorType::Rgb);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.pixels)?;
        writer.finish()?;
        Ok(file)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLACK: Paint = Paint { rgb: [0; 3], opacity: 1.0 };

    /// Total amount of black on the canvas, in pixels.
    fn ink(canvas: &Canvas) -> f64 {
        canvas.pixels.iter().map(|value| 1.0 - f64::from(*value) / 255.0).sum::<f64>() / 3.0
    }

    #[test]
    fn shapes_cover_their_areas() {
        let drawn = |draw: &dyn Fn(&mut Canvas)| {
            let mut canvas = Canvas::new(40, 30, [255; 3]);
            draw(&mut canvas);
            ink(&canvas)
        };
        let disc = drawn(&|canvas| canvas.disc([20.3, 14.8], 10.0, BLACK));
        let line = drawn(&|canvas| canvas.round_line([[8.5, 9.25], [28.5, 9.25]], 4.0, BLACK));
        // Three quarters of the disc are outside the canvas.
        let cut = drawn(&|canvas| canvas.disc([0.0, 0.0], 10.0, BLACK));
        let outside = drawn(&|canvas| canvas.disc([1e7, -1e7], 10.0, BLACK));
        let faint = Paint { opacity: 0.5, ..BLACK };
        let faint = drawn(&|canvas| canvas.disc([20.3, 14.8], 10.0, faint));
        for (area, expected) in
            [(disc, 314.2), (line, 92.6), (cut, 78.5), (outside, 0.0), (faint, 157.1)]
        {
            assert!((area - expected).abs() <= 0.02 * expected, "{area} {expected}");
        }
    }

    #[test]
    fn triangles_leave_no_gap_and_show_their_texture_in_perspective() {
        let corner = |at, texture, scale| Corner { at, scale, texture, gain: 1.0, add: [0.0; 3] };
        let corners = [[5.0, 5.0], [35.0, 4.0], [34.0, 26.0], [4.0, 25.0]];
        let texture = Texture::plain([0; 3]);
        let mut canvas = Canvas::new(40, 30, [255; 3]);
        for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
            let of = |number: usize| corner(corners[number], [0.0; 2], 1.0);
            canvas.triangle(&[of(a), of(b), of(c)], &texture);
        }
        // The diagonal, and everything else inside, is covered.
        for row in 7..24 {
            let inside = &canvas.pixels[3 * (40 * row + 7)..3 * (40 * row + 32)];
            assert!(inside.iter().all(|value| *value == 0), "{row}");
        }
        // Half a pixel around: the area and half of the outline.
        let area = 630.0 + 0.5 * 104.0;
        assert!((ink(&canvas) - area).abs() <= 0.02 * area, "{}", ink(&canvas));
        // In the middle of an edge whose one end is three times nearer, a quarter of the texture has passed.
        let mut halves = Canvas::new(4, 1, [255; 3]);
        halves.paste(&Canvas::new(1, 1, [0; 3]), [0, 0]);
        let halves = Texture::from_png(&halves.png().unwrap()).unwrap();
        let near = corner([0.0, 0.0], [0.125, 0.5], 3.0);
        let [far, last] = [[0.0, 20.0], [20.0, 0.0]].map(|at| corner(at, [1.125, 0.5], 1.0));
        let at = |share: f64| color(&[near, far, last], [1.0 - share, share, 0.0], &halves)[0];
        assert_eq!((at(0.0), at(0.5), at(1.0)), (0.0, 255.0, 0.0));
        assert!((at(0.4) - 4.0 * 255.0 * 0.4 / 2.2).abs() < 1e-9, "{}", at(0.4));
    }

    #[test]
    fn a_pasted_canvas_covers_its_part_and_is_cut_at_the_edge() {
        let mut canvas = Canvas::new(5, 4, [255; 3]);
        canvas.paste(&Canvas::new(2, 2, [0; 3]), [1, 1]);
        assert_eq!(ink(&canvas), 4.0);
        canvas.paste(&Canvas::new(3, 3, [0; 3]), [4, 2]);
        assert_eq!(ink(&canvas), 6.0);
        canvas.paste(&Canvas::new(3, 3, [0; 3]), [9, 9]);
        assert_eq!(ink(&canvas), 6.0);
    }

    #[test]
    fn a_png_holds_the_pixels_that_were_drawn() {
        let mut canvas = Canvas::new(7, 5, [255; 3]);
        canvas.disc([3.0, 2.0], 2.0, Paint { rgb: [200, 100, 0], opacity: 0.7 });
        let file = canvas.png().unwrap();
        let mut reader = png::Decoder::new(io::Cursor::new(&file)).read_info().unwrap();
        let mut pixels = vec![0; canvas.pixels.len()];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!((info.width, info.height, info.color_type), (7, 5, png::ColorType::Rgb));
        assert_eq!(pixels, canvas.pixels);
        assert!(Canvas::new(0, 5, [255; 3]).png().is_err());
    }
}
