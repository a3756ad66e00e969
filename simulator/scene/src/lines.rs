//! Converts byte offsets in a text to lines and columns.

use super::Location;

/// Offsets to lines and columns, cheapest where they are asked for in ascending order.
pub(super) struct LineCounter<'a> {
    text: &'a str,
    counted_to: usize,
    at: Location,
}

impl<'a> LineCounter<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Self { text, counted_to: 0, at: Location { line: 1, column: 1 } }
    }

    pub(super) fn locate(&mut self, offset: usize) -> Location {
        let offset = offset.min(self.text.len());
        if offset < self.counted_to {
            *self = Self::new(self.text);
        }
        for byte in &self.text.as_bytes()[self.counted_to..offset] {
            match byte {
                b'\n' => self.at = Location { line: self.at.line + 1, column: 1 },
                // Continuation bytes of UTF-8 are not counted as characters.
                0x80..=0xbf => {}
                _ => self.at.column += 1,
            }
        }
        self.counted_to = offset;
        self.at
    }
}
