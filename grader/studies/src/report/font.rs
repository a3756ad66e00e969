//! Outlines and widths of a TrueType font's glyphs.
//!
//! Supports the features of the built-in font: a character map of format 4, and glyphs of quadratic curves, some of
//! them composed of shifted glyphs.

use zeno::{Command, Vector};

/// The tables of a font.
pub(super) struct Font {
    /// Coordinate units per em.
    pub(super) units: u16,
    glyphs: &'static [u8],
    /// Start of each glyph, in units of two bytes or one byte.
    places: &'static [u8],
    short_places: bool,
    widths: &'static [u8],
    /// Number of glyphs with their own widths; all later glyphs have the last of these widths.
    n_widths: u16,
    characters: &'static [u8],
}

/// Maximum nesting of composite glyphs.
const DEPTH: u8 = 4;

/// Flags of a point.
const ON_CURVE: u8 = 1;
const REPEAT: u8 = 8;

/// Flags of a part of a composite glyph.
const WORDS: u16 = 1;
const IS_SHIFT: u16 = 2;
const MORE: u16 = 0x20;
const SCALED: u16 = 0x8 | 0x40 | 0x80;

impl Font {
    /// Finds the tables; `None` if one is missing.
    pub(super) fn new(file: &'static [u8]) -> Option<Self> {
        let table = |name: &[u8; 4]| {
            let entries = file.get(12..)?.chunks_exact(16).take(usize::from(u16_at(file, 4)?));
            let entry = entries.into_iter().find(|entry| entry.starts_with(name))?;
            let [start, length] = [u32_at(entry, 8)? as usize, u32_at(entry, 12)? as usize];
            file.get(start..start.checked_add(length)?)
        };
        let (head, map) = (table(b"head")?, table(b"cmap")?);
        let mut maps = map.get(4..)?.chunks_exact(8).take(usize::from(u16_at(map, 2)?));
        let characters = maps.find_map(|entry| {
            let found = map.get(u32_at(entry, 4)? as usize..)?;
            (u16_at(found, 0)? == 4).then_some(found)
        })?;
        Some(Self {
            units: u16_at(head, 18)?,
            glyphs: table(b"glyf")?,
            places: table(b"loca")?,
            short_places: u16_at(head, 50)? == 0,
            widths: table(b"hmtx")?,
            n_widths: u16_at(table(b"hhea")?, 34)?,
            characters,
        })
    }

    /// The glyph of a character; 0, an empty box, if the font lacks it.
    pub(super) fn glyph(&self, character: char) -> u16 {
        u16::try_from(u32::from(character)).ok().and_then(|code| self.find(code)).unwrap_or(0)
    }

    fn find(&self, code: u16) -> Option<u16> {
        let map = self.characters;
        let size = usize::from(u16_at(map, 6)?);
        let segment = (0..size).step_by(2).find(|at| u16_at(map, 14 + at) >= Some(code))?;
        let [start, shift, place] =
            [1, 2, 3].map(|column| u16_at(map, 14 + column * size + 2 + segment));
        let (start, shift, place) = (start?, shift?, usize::from(place?));
        let above = code.checked_sub(start)?;
        if place == 0 {
            return Some(code.wrapping_add(shift));
        }
        let at = 14 + 3 * size + 2 + segment + place + 2 * usize::from(above);
        let glyph = u16_at(map, at)?;
        Some(if glyph == 0 { 0 } else { glyph.wrapping_add(shift) })
    }

    /// The advance width of a glyph, in the font's units.
    pub(super) fn width(&self, glyph: u16) -> u16 {
        let own = usize::from(glyph.min(self.n_widths.saturating_sub(1)));
        u16_at(self.widths, 4 * own).unwrap_or(0)
    }

    /// Appends the outline of a glyph, each point transformed by `place`. y points up.
    pub(super) fn outline(
        &self,
        glyph: u16,
        path: &mut Vec<Command>,
        place: &dyn Fn(f32, f32) -> Vector,
    ) -> Option<()> {
        self.parts(glyph, path, place, DEPTH)
    }

    fn parts(
        &self,
        glyph: u16,
        path: &mut Vec<Command>,
        place: &dyn Fn(f32, f32) -> Vector,
        depth: u8,
    ) -> Option<()> {
        let at = |number: usize| match self.short_places {
            true => u16_at(self.places, 2 * number).map(|place| 2 * usize::from(place)),
            false => u32_at(self.places, 4 * number).map(|place| place as usize),
        };
        let number = usize::from(glyph);
        let data = self.glyphs.get(at(number)?..at(number + 1)?)?;
        if data.is_empty() {
            return Some(());
        }
        if let Ok(n_contours) = usize::try_from(i16_at(data, 0)?) {
            return simple(data, n_contours, path, place);
        }
        let mut at = 10;
        loop {
            let [flags, part] = [u16_at(data, at)?, u16_at(data, at + 2)?];
            let (shift, next) = match flags & WORDS {
                0 => {
                    let [x, y] = [*data.get(at + 4)?, *data.get(at + 5)?].map(u8::cast_signed);
                    ([f32::from(x), f32::from(y)], at + 6)
                }
                _ => ([i16_at(data, at + 4)?, i16_at(data, at + 6)?].map(f32::from), at + 8),
            };
            if flags & IS_SHIFT == 0 || flags & SCALED != 0 {
                return None;
            }
            let shifted = |x, y| place(x + shift[0], y + shift[1]);
            self.parts(part, path, &shifted, depth.checked_sub(1)?)?;
            if flags & MORE == 0 {
                return Some(());
            }
            at = next;
        }
    }
}

/// Appends the outline of a simple glyph.
fn simple(
    data: &[u8],
    n_contours: usize,
    path: &mut Vec<Command>,
    place: &dyn Fn(f32, f32) -> Vector,
) -> Option<()> {
    let ends: Option<Vec<_>> =
        (0..n_contours).map(|each| u16_at(data, 10 + 2 * each).map(usize::from)).collect();
    let ends = ends?;
    let n_points = ends.last()? + 1;
    let hints = 10 + 2 * n_contours;
    let mut at = hints + 2 + usize::from(u16_at(data, hints)?);
    let mut flags = Vec::new();
    while flags.len() < n_points {
        let flag = *data.get(at)?;
        at += 1;
        let mut count = 1;
        if flag & REPEAT != 0 {
            count += usize::from(*data.get(at)?);
            at += 1;
        }
        flags.extend((0..count).map(|_| flag));
    }
    // x of all points, then y; each is a difference of zero, one or two bytes.
    let mut coordinates = |short: u8, same: u8| -> Option<Vec<f32>> {
        let mut value = 0;
        let mut values = Vec::new();
        for flag in &flags[..n_points] {
            value += match (flag & short != 0, flag & same != 0) {
                (true, positive) => {
                    let size = i32::from(*data.get(at)?);
                    at += 1;
                    if positive { size } else { -size }
                }
                (false, true) => 0,
                (false, false) => {
                    at += 2;
                    i32::from(i16_at(data, at - 2)?)
                }
            };
            values.push(value as f32);
        }
        Some(values)
    };
    let (x, y) = (coordinates(2, 16)?, coordinates(4, 32)?);
    let mut start = 0;
    for end in ends {
        let points = x.get(start..=end)?.iter().zip(&y[start..=end]);
        let points: Vec<Vector> = points.map(|(x, y)| place(*x, *y)).collect();
        let is_on: Vec<bool> = flags[start..=end].iter().map(|flag| flag & ON_CURVE != 0).collect();
        contour(&points, &is_on, path);
        start = end + 1;
    }
    Some(())
}

/// Appends a closed contour. The midpoint of two consecutive off-curve points is on the curve.
fn contour(points: &[Vector], is_on: &[bool], path: &mut Vec<Command>) {
    let count = points.len();
    let middle = |a: Vector, b: Vector| Vector::new(0.5 * (a.x + b.x), 0.5 * (a.y + b.y));
    let first = is_on.iter().position(|on| *on);
    let (begin, first) = match first {
        Some(first) => (points[first], first + 1),
        None => (middle(points[count - 1], points[0]), 0),
    };
    path.push(Command::MoveTo(begin));
    let mut control = None;
    for index in (first..first + count).map(|index| index % count) {
        let point = points[index];
        match (is_on[index], control) {
            (true, None) => path.push(Command::LineTo(point)),
            (true, Some(before)) => path.push(Command::QuadTo(before, point)),
            (false, None) => {}
            (false, Some(before)) => path.push(Command::QuadTo(before, middle(before, point))),
        }
        control = (!is_on[index]).then_some(point);
    }
    if let Some(before) = control {
        path.push(Command::QuadTo(before, begin));
    }
    path.push(Command::Close);
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    bytes.get(at..at + 2)?.try_into().ok().map(u16::from_be_bytes)
}

fn i16_at(bytes: &[u8], at: usize) -> Option<i16> {
    u16_at(bytes, at).map(u16::cast_signed)
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..at + 4)?.try_into().ok().map(u32::from_be_bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_characters_of_the_pictures_have_outlines_and_widths() {
        let font = Font::new(epaint_default_fonts::UBUNTU_LIGHT).unwrap();
        let letters = ('!'..='~').chain("äöüéÅñ×±ωζ²·–".chars());
        for character in letters {
            let glyph = font.glyph(character);
            let mut path = Vec::new();
            let outlined = font.outline(glyph, &mut path, &Vector::new);
            assert!(glyph != 0 && outlined.is_some() && path.len() > 3, "{character}");
            assert!((200..=1000).contains(&font.width(glyph)), "{character}");
        }
        assert_eq!(font.glyph('\u{e000}'), 0);
        let mut path = Vec::new();
        font.outline(font.glyph(' '), &mut path, &Vector::new).unwrap();
        assert!(path.is_empty() && font.width(font.glyph(' ')) > 0);
    }

    #[test]
    fn contours_may_begin_and_end_off_the_curve() {
        let corners = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];
        let corners = corners.map(|[x, y]| Vector::new(x, y));
        let mut path = Vec::new();
        contour(&corners, &[false; 4], &mut path);
        assert_eq!(path.len(), 6);
        assert_eq!(path[0], Command::MoveTo(Vector::new(1.0, 0.0)));
        assert_eq!(path[4], Command::QuadTo(corners[3], Vector::new(1.0, 0.0)));
        let mut path = Vec::new();
        contour(&corners, &[false, true, true, true], &mut path);
        assert_eq!(path[0], Command::MoveTo(corners[1]));
        assert_eq!(path[3], Command::QuadTo(corners[0], corners[1]));
    }
}
