//! Pictures: the same drawing as an SVG document or a PNG file.
//!
//! PNG files use a built-in font, so that the pixels are the same on every system.

use std::io;

use plotters::coord::Shift;
use plotters::prelude::{DrawingArea, DrawingBackend, IntoDrawingArea, SVGBackend};
use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingErrorKind, FontTransform,
};

use picture::canvas::{Canvas, Paint};

use super::font::Font;
use super::text::{self, TextPlacement};

/// The drawing area.
pub(super) type Area<'a> = DrawingArea<Surface<'a>, Shift>;

/// Result of drawing.
pub(super) type Drawn = Result<(), Box<dyn std::error::Error>>;

/// A picture could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("cannot draw the picture: {0}")]
pub struct PictureError(String);

impl PictureError {
    fn new(error: impl ToString) -> Self {
        Self(error.to_string())
    }
}

/// The drawing of `draw` as an SVG document of this size, with a newline at its end.
pub(super) fn svg(
    size: (u32, u32),
    draw: impl FnOnce(&Area<'_>) -> Drawn,
) -> Result<String, PictureError> {
    let mut text = String::new();
    paint(Surface::Svg(SVGBackend::with_string(&mut text, size)), draw)?;
    if !text.ends_with('\n') {
        text.push('\n');
    }
    Ok(text)
}

/// The drawing of `draw` as a PNG file with `scale` pixels per SVG unit.
pub(super) fn png(
    size: (u32, u32),
    scale: f32,
    draw: impl FnOnce(&Area<'_>) -> Drawn,
) -> Result<Vec<u8>, PictureError> {
    let pixels = |length: u32| (length as f32 * scale).round() as u32;
    let mut canvas = Canvas::new(pixels(size.0), pixels(size.1), [255; 3]);
    let font = text::font().map_err(PictureError::new)?;
    paint(Surface::Pixels { canvas: &mut canvas, font, size, scale }, draw)?;
    Ok(canvas.png())
}

fn paint(surface: Surface<'_>, draw: impl FnOnce(&Area<'_>) -> Drawn) -> Result<(), PictureError> {
    let area = surface.into_drawing_area();
    draw(&area).map_err(PictureError::new)?;
    area.present().map_err(PictureError::new)
}

/// Target of a drawing; positions and sizes are the same on both kinds.
pub(super) enum Surface<'a> {
    Svg(SVGBackend<'a>),
    Pixels {
        canvas: &'a mut Canvas,
        font: Font,
        size: (u32, u32),
        /// Pixels per unit of the drawing.
        scale: f32,
    },
}

type Done = Result<(), DrawingErrorKind<io::Error>>;

/// A colour on a canvas.
fn paint_of(color: BackendColor) -> Paint {
    let (red, green, blue) = color.rgb;
    Paint { rgb: [red, green, blue], opacity: color.alpha }
}

/// A point of a drawing on a canvas of this scale.
fn point((x, y): BackendCoord, scale: f32) -> [f32; 2] {
    [x as f32 * scale, y as f32 * scale]
}

impl DrawingBackend for Surface<'_> {
    type ErrorType = io::Error;

    fn get_size(&self) -> (u32, u32) {
        match self {
            Self::Svg(svg) => svg.get_size(),
            Self::Pixels { size, .. } => *size,
        }
    }

    fn ensure_prepared(&mut self) -> Done {
        match self {
            Self::Svg(svg) => svg.ensure_prepared(),
            Self::Pixels { .. } => Ok(()),
        }
    }

    fn present(&mut self) -> Done {
        match self {
            Self::Svg(svg) => svg.present(),
            Self::Pixels { .. } => Ok(()),
        }
    }

    fn draw_pixel(&mut self, at: BackendCoord, color: BackendColor) -> Done {
        match self {
            Self::Svg(svg) => svg.draw_pixel(at, color),
            Self::Pixels { .. } => self.draw_rect(at, (at.0 + 1, at.1 + 1), &color, true),
        }
    }

    fn draw_line<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
    ) -> Done {
        match self {
            Self::Svg(svg) => svg.draw_line(from, to, style),
            Self::Pixels { .. } => self.draw_path([from, to], style),
        }
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        upper_left: BackendCoord,
        bottom_right: BackendCoord,
        style: &S,
        fill: bool,
    ) -> Done {
        match self {
            Self::Svg(svg) => svg.draw_rect(upper_left, bottom_right, style, fill),
            Self::Pixels { canvas, scale, .. } => {
                let ((left, top), (right, bottom)) = (upper_left, bottom_right);
                let corners = [(left, top), (right, top), (right, bottom), (left, bottom)]
                    .map(|corner| point(corner, *scale));
                match fill {
                    true => canvas.polygon(&corners, paint_of(style.color())),
                    false => canvas.line(&corners, true, *scale, paint_of(style.color())),
                }
                Ok(())
            }
        }
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Done {
        match self {
            Self::Svg(svg) => svg.draw_path(path, style),
            Self::Pixels { canvas, scale, .. } => {
                let points: Vec<_> = path.into_iter().map(|at| point(at, *scale)).collect();
                let width = style.stroke_width() as f32 * *scale;
                canvas.line(&points, false, width, paint_of(style.color()));
                Ok(())
            }
        }
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        center: BackendCoord,
        radius: u32,
        style: &S,
        fill: bool,
    ) -> Done {
        match self {
            Self::Svg(svg) => svg.draw_circle(center, radius, style, fill),
            Self::Pixels { canvas, scale, .. } => {
                let (center, radius) = (point(center, *scale), radius as f32 * *scale);
                let width = style.stroke_width() as f32 * *scale;
                match fill {
                    true => canvas.disc(center, radius, paint_of(style.color())),
                    false => canvas.circle(center, radius, width, paint_of(style.color())),
                }
                Ok(())
            }
        }
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        corners: I,
        style: &S,
    ) -> Done {
        match self {
            Self::Svg(svg) => svg.fill_polygon(corners, style),
            Self::Pixels { canvas, scale, .. } => {
                let corners: Vec<_> = corners.into_iter().map(|at| point(at, *scale)).collect();
                canvas.polygon(&corners, paint_of(style.color()));
                Ok(())
            }
        }
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, at: BackendCoord) -> Done {
        match self {
            Self::Svg(svg) => svg.draw_text(text, style, at),
            Self::Pixels { canvas, font, scale, .. } => {
                // Font sizes and baselines match the SVG.
                let size = (style.size() / 1.24) as f32 * *scale;
                let below = match style.anchor().v_pos {
                    VPos::Top => 0.76 * size,
                    VPos::Center => 0.25 * size,
                    VPos::Bottom => -0.25 * size,
                };
                let left = match style.anchor().h_pos {
                    HPos::Left => 0.0,
                    HPos::Center => 0.5,
                    HPos::Right => 1.0,
                };
                let quarters = match style.transform() {
                    FontTransform::None => 0,
                    FontTransform::Rotate90 => 1,
                    FontTransform::Rotate180 => 2,
                    FontTransform::Rotate270 => 3,
                };
                let place = TextPlacement { at: point(at, *scale), below, left, quarters };
                font.draw(canvas, text, size, place, paint_of(style.color()));
                Ok(())
            }
        }
    }
}
