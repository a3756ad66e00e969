//! Text on a canvas, in the built-in font.

use picture::canvas::{Canvas, Paint};
use zeno::Vector;

use super::font::Font;

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

/// The built-in font.
///
/// # Errors
/// If it cannot be read.
pub(super) fn font() -> Result<Font, &'static str> {
    Font::new(epaint_default_fonts::UBUNTU_LIGHT).ok_or("the built-in font is damaged")
}

impl Font {
    /// Draws a line of text of this size in pixels. Characters that the font lacks are drawn as its empty box.
    pub(super) fn draw(
        &self,
        canvas: &mut Canvas,
        text: &str,
        size: f32,
        place: TextPlacement,
        paint: Paint,
    ) {
        let scale = size / f32::from(self.units);
        let glyphs: Vec<_> = text.chars().map(|character| self.glyph(character)).collect();
        let width = |glyph| f32::from(self.width(glyph)) * scale;
        let mut left = -place.left * glyphs.iter().copied().map(width).sum::<f32>();
        let mut path = Vec::new();
        for glyph in glyphs {
            let on_canvas = |x, y| place.on_canvas(left + x * scale, place.below - y * scale);
            // An unreadable glyph leaves a gap.
            let _ = self.outline(glyph, &mut path, &on_canvas);
            left += width(glyph);
        }
        canvas.fill(&path, paint);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLACK: Paint = Paint { rgb: [0; 3], opacity: 1.0 };

    /// Total amount of black on the canvas, in pixels.
    fn ink(canvas: &Canvas) -> f64 {
        canvas.pixels().iter().map(|value| 1.0 - f64::from(*value) / 255.0).sum::<f64>() / 3.0
    }

    #[test]
    fn text_is_drawn_at_its_place_in_every_direction() {
        let font = font().unwrap();
        for (quarters, corner) in [(0, [25, 5]), (1, [25, 25]), (2, [5, 25]), (3, [5, 5])] {
            let mut canvas = Canvas::new(50, 50, [255; 3]);
            let place = TextPlacement { at: [25.0, 25.0], below: 0.0, left: 0.0, quarters };
            font.draw(&mut canvas, "H", 20.0, place, BLACK);
            let mut turned = Canvas::new(50, 50, [255; 3]);
            font.draw(&mut turned, "H", 20.0, TextPlacement { quarters: 0, ..place }, BLACK);
            assert!((ink(&canvas) - ink(&turned)).abs() < 0.5);
            let dark = |x: usize, y: usize| canvas.pixels()[3 * (y * 50 + x)] < 128;
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
}
