//! A drawing: shapes in the order in which they cover each other.

use std::fmt::Write;
use std::sync::Arc;

use crate::canvas::{Canvas, Corner, Paint, color};
use crate::texture::Texture;

/// Shapes over a background.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawing {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Red, green and blue of the background.
    pub background: [u8; 3],
    /// The shapes, the lowest first.
    pub shapes: Vec<Shape>,
}

/// A shape.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A filled circle.
    Disc {
        /// Its centre.
        at: [f32; 2],
        /// Its radius.
        radius: f32,
        /// Its colour.
        paint: Paint,
    },
    /// A line with round ends.
    Line {
        /// Its ends.
        ends: [[f32; 2]; 2],
        /// Its width.
        width: f32,
        /// Its colour.
        paint: Paint,
    },
    /// A triangle of a surface.
    Triangle {
        /// Its corners.
        corners: [Corner; 3],
        /// Its paint. SVG shows the colour of its middle.
        texture: Arc<Texture>,
    },
}

/// Coordinates beyond this are not drawn: a rasteriser's fixed-point numbers would overflow.
const FAR: f32 = 20_000.0;

impl Shape {
    /// Whether all of its numbers are near enough to be drawn.
    fn is_near(&self) -> bool {
        let near = |point: &[f32; 2]| point.iter().all(|value| value.abs() < FAR);
        match self {
            Self::Disc { at, radius, .. } => near(at) && *radius < FAR,
            Self::Line { ends, width, .. } => ends.iter().all(near) && *width < FAR,
            Self::Triangle { corners, .. } => corners.iter().all(|corner| near(&corner.at)),
        }
    }
}

impl Drawing {
    /// The drawing in pixels.
    pub fn canvas(&self) -> Canvas {
        let mut canvas = Canvas::new(self.size[0], self.size[1], self.background);
        for shape in self.shapes.iter().filter(|shape| shape.is_near()) {
            match shape {
                Shape::Disc { at, radius, paint } => canvas.disc(*at, *radius, *paint),
                Shape::Line { ends, width, paint } => canvas.round_line(*ends, *width, *paint),
                Shape::Triangle { corners, texture } => canvas.triangle(corners, texture),
            }
        }
        canvas
    }

    /// The drawing as an SVG document, with a newline at its end.
    pub fn svg(&self) -> String {
        let [width, height] = self.size;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\">\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"{}\"/>\n",
            hexadecimal(self.background)
        );
        for shape in self.shapes.iter().filter(|shape| shape.is_near()) {
            // Writing to a string cannot fail.
            let _ = match shape {
                Shape::Disc { at: [x, y], radius, paint } => {
                    let (color, opacity) = (hexadecimal(paint.rgb), opacity("fill", paint.opacity));
                    writeln!(
                        svg,
                        "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{radius:.2}\" fill=\"{color}\"{opacity}/>"
                    )
                }
                Shape::Line { ends: [[x1, y1], [x2, y2]], width, paint } => {
                    let color = hexadecimal(paint.rgb);
                    let opacity = opacity("stroke", paint.opacity);
                    writeln!(
                        svg,
                        "<line x1=\"{x1:.2}\" y1=\"{y1:.2}\" x2=\"{x2:.2}\" y2=\"{y2:.2}\" stroke=\"{color}\" \
                         stroke-width=\"{width:.2}\" stroke-linecap=\"round\"{opacity}/>"
                    )
                }
                Shape::Triangle { corners, texture } => {
                    let middle = color(corners, [1.0 / 3.0; 3], texture);
                    let color = hexadecimal(middle.map(|value| value.round() as u8));
                    let [[x1, y1], [x2, y2], [x3, y3]] = corners.map(|corner| corner.at);
                    // The outline closes the gaps between neighbours.
                    writeln!(
                        svg,
                        "<path d=\"M{x1:.2} {y1:.2}L{x2:.2} {y2:.2}L{x3:.2} {y3:.2}Z\" fill=\"{color}\" \
                         stroke=\"{color}\" stroke-linejoin=\"round\"/>"
                    )
                }
            };
        }
        svg + "</svg>\n"
    }
}

fn hexadecimal([red, green, blue]: [u8; 3]) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// The attribute of an opacity; empty for opaque shapes.
fn opacity(what: &str, opacity: f64) -> String {
    if opacity < 1.0 { format!(" {what}-opacity=\"{opacity:.3}\"") } else { String::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn later_shapes_cover_earlier_ones_and_far_ones_are_left_out() {
        let paint = |rgb| Paint { rgb, opacity: 1.0 };
        let line = Shape::Line {
            ends: [[2.0, 10.0], [18.0, 10.0]],
            width: 6.0,
            paint: paint([0, 0, 255]),
        };
        let disc = Shape::Disc { at: [10.0, 10.0], radius: 4.0, paint: paint([255, 0, 0]) };
        let far = Shape::Disc { at: [1e30, 10.0], radius: 4.0, paint: paint([0; 3]) };
        let not_finite = Shape::Disc { at: [f32::NAN, 1.0], radius: 4.0, paint: paint([0; 3]) };
        let shapes = vec![line, disc, far, not_finite];
        let drawing = Drawing { size: [20, 20], background: [255; 3], shapes };
        let canvas = drawing.canvas();
        let pixel = |x: usize, y: usize| &canvas.pixels()[3 * (20 * y + x)..][..3];
        assert_eq!(pixel(10, 10), [255, 0, 0]);
        assert_eq!(pixel(3, 10), [0, 0, 255]);
        assert_eq!(pixel(10, 1), [255, 255, 255]);
        let svg = drawing.svg();
        assert_eq!(svg.matches("<circle").count(), 1);
        assert!(svg.contains("stroke=\"#0000ff\" stroke-width=\"6.00\""), "{svg}");
    }
}
